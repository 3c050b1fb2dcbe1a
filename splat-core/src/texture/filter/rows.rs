//! The sum over the texels of an ellipse, row by row.

use super::ellipse::{Ellipse, MAX_PERIODS, Symmetric, texel_place};
use super::mean::{Mean, WeightedSum};
use crate::texture::pyramid::{Level, Pyramid};
use glam::DVec2;

/// The variance along an axis of the weights `exp(-2 r^2) - exp(-2)` on the unit disc: `(1 - 5 e^-2) / (4 (1 - 3 e^-2))`.
pub const KERNEL_VARIANCE: f64 = 0.136_080_289_536_098_63;

/// The variance of bilinear interpolation, in squared texels, as a mean over the places between texels.
pub const BILINEAR_VARIANCE: f64 = 1.0 / 6.0;

/// `exp(-2 r2) - exp(-2)` for r2 in [0, 1], by a polynomial of degree 5, lowest power first: at most 1.8e-5 off (E4: the
/// printed table is 1.6e-2 off).
pub const WEIGHT_POLYNOMIAL: [f64; 6] = [
    0.864_646_916_333_420_4,
    -1.998_683_279_408_553_8,
    1.984_040_230_135_516_7,
    -1.261_187_188_828_156_3,
    0.513_430_374_005_441_1,
    -0.102_262_491_250_787_85,
];

/// The weight of a texel at squared radius `r2`: 0 from the rim on.
#[inline]
pub fn weight(r2: f64) -> f64 {
    let value = WEIGHT_POLYNOMIAL.iter().rev().fold(0.0, |sum, coefficient| sum * r2 + coefficient);
    if r2 < 1.0 { value.max(0.0) } else { 0.0 }
}

/// An ellipse among the texels of one level, ready to be summed row by row.
///
/// With (dx, dy) a texel's place from the centre, the squared radius is a sum of two squares,
/// `r2 = curvature (dx - slope dy)^2 + inverse_yy dy^2`: exact spans of rows and no cancellation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowKernel {
    /// The pyramid's level.
    pub level: usize,
    /// The centre, in texels of the level; texel i has its centre at i.
    pub center: DVec2,
    /// How far the middle of a row moves per row.
    pub slope: f64,
    /// Factor on the squared distance from the middle of the row.
    pub curvature: f64,
    /// Factor on the squared distance of the row.
    pub inverse_yy: f64,
    /// How far the ellipse extends from its centre in t, in rows: at most [`MAX_PERIODS`] times the level's.
    pub extent: f64,
}

/// The part of a row that an ellipse covers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowSpan {
    /// The first texel, before any wrap.
    pub first: i64,
    /// The last texel; less than `first` where the row has none.
    pub last: i64,
    /// The place where r2 is least, in texels.
    pub middle: f64,
    /// r2 there.
    pub least: f64,
}

impl RowKernel {
    /// The ellipse with the positive definite `matrix` (in squared texels of the level) around `place` (in periods).
    pub fn new(levels: &[Level], level: usize, place: DVec2, matrix: Symmetric) -> Self {
        let [mut xx, mut xy, mut yy] = matrix;
        // Of a side that has few texels, an ellipse may cover many periods: no more than some are looked at.
        let limit = |squared: f64, count: u32| {
            let most = MAX_PERIODS * f64::from(count);
            if squared > most * most { most / squared.sqrt() } else { 1.0 }
        };
        let [width, height] = levels[level].size();
        let (x, y) = (limit(xx, width), limit(yy, height));
        (xx, xy, yy) = (xx * x * x, xy * x * y, yy * y * y);
        let determinant = xx * yy - xy * xy;
        Self {
            level,
            center: texel_place(place, &levels[level]),
            slope: xy / yy,
            curvature: yy / determinant,
            inverse_yy: 1.0 / yy,
            extent: yy.sqrt(),
        }
    }

    /// Variance-compensated EWA. The result shall be the `ellipse`'s kernel over bilinearly interpolated texels of
    /// level 0, of variance `KERNEL_VARIANCE M + 1/6`. A level's texels are blurred already by its known variance, so
    /// the kernel there makes up the rest (E5): `S (M + (1/6 - variance) / KERNEL_VARIANCE) S`, with S the level's
    /// texels per texel of level 0, per axis. The level is the coarsest whose texels are not larger than `minor /
    /// quality`; the rest is positive since quality exceeds `sqrt(1 / (12 KERNEL_VARIANCE)) = .78`.
    pub fn variance_compensated(pyramid: &Pyramid, place: DVec2, ellipse: &Ellipse, quality: f64) -> Self {
        let levels = pyramid.levels();
        let fine_enough = levels.partition_point(|level| quality * level.coarseness() <= ellipse.minor);
        let index = fine_enough.saturating_sub(1);
        let level = &levels[index];
        let [rest_x, rest_y] =
            level.variance().map(|variance| (BILINEAR_VARIANCE - variance) / KERNEL_VARIANCE);
        let [width, height] = level.texel_size();
        let [xx, xy, yy] = ellipse.matrix;
        let matrix =
            [(xx + rest_x) / (width * width), xy / (width * height), (yy + rest_y) / (height * height)];
        Self::new(levels, index, place, matrix)
    }

    /// pbrt's EWA at one level: the ellipse in texels of the level, plus one texel squared per axis for the
    /// reconstruction, which also keeps it from falling between texels.
    pub fn widened(pyramid: &Pyramid, level: usize, place: DVec2, ellipse: &Ellipse) -> Self {
        let [width, height] = pyramid.levels()[level].texel_size();
        let [xx, xy, yy] = ellipse.matrix;
        let matrix = [xx / (width * width) + 1.0, xy / (width * height), yy / (height * height) + 1.0];
        Self::new(pyramid.levels(), level, place, matrix)
    }

    /// The first and the last row.
    pub fn rows(&self) -> (i64, i64) {
        ((self.center.y - self.extent).ceil() as i64, (self.center.y + self.extent).floor() as i64)
    }

    /// The texels of row `y` that lie in the ellipse: those between the roots of `r2 = 1`.
    #[inline]
    pub fn span(&self, y: i64) -> RowSpan {
        let dy = y as f64 - self.center.y;
        let middle = self.center.x + self.slope * dy;
        let least = self.inverse_yy * dy * dy;
        let half = ((1.0 - least).max(0.0) / self.curvature).sqrt();
        RowSpan { first: (middle - half).ceil() as i64, last: (middle + half).floor() as i64, middle, least }
    }

    /// The weighted mean of the texels in the ellipse; none only where there is no texel.
    pub(super) fn mean(&self, pyramid: &Pyramid) -> Option<Mean> {
        let mut sum = WeightedSum::default();
        let (first, last) = self.rows();
        for y in first..=last {
            let span = self.span(y);
            for x in span.first..=span.last {
                let dx = x as f64 - span.middle;
                let weight = weight(span.least + self.curvature * dx * dx);
                sum.add_texel(pyramid.texel(self.level, x, y), weight);
            }
        }
        sum.mean()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kernel_s_variance() {
        let e = libm::exp(-2.0);
        assert!((KERNEL_VARIANCE - (1.0 - 5.0 * e) / (4.0 * (1.0 - 3.0 * e))).abs() < 1e-15);
    }

    #[test]
    fn the_polynomial_is_close_to_the_exponential() {
        let error = |i: u32| {
            let r2 = f64::from(i) / 1e4;
            (weight(r2) - (libm::exp(-2.0 * r2) - libm::exp(-2.0))).abs()
        };
        assert!((0..=10_000).map(error).fold(0.0, f64::max) < 1.8e-5);
        assert_eq!(weight(1.0), 0.0);
    }
}
