//! Footprint Assembly (seed 2): a long footprint as a row of isotropic lookups.
//!
//! The rows follow the ellipse's principal axes, since edge vectors are not axes (E1): conjugate vectors of
//! a long footprint make the printed row too short and too wide.

use super::ellipse::Ellipse;
use super::isotropic::{BetweenLevels, bilinear};
use super::mean::{Mean, WeightedSum};
use super::rows::{BILINEAR_VARIANCE, KERNEL_VARIANCE, weight};
use crate::texture::pyramid::Pyramid;
use glam::DVec2;

/// How many lookups a footprint takes, and what they weigh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Probes {
    /// Texram (Schilling, Knittel and Strasser 1996): with r1, r2 the full sides along the axes, `N =
    /// 2^round(log2(|r1| / |r2|))` at `p_n = p + (n / 2) (r1 / N)`, n = +-1, +-3 .. +-(N - 1) (N = 1: at p), all of
    /// one weight. They stand .71 to 1.41 |r2| apart: gaps alias.
    Texram,
    /// The same with N rounded up to a power of two: .5 to 1 |r2| apart.
    TexramCeiling,
    /// As many as it takes, at most a minor semi-axis apart, with the weights `exp(-2 x^2) - exp(-2)` along the axis,
    /// x in (-1, 1), and spaced so that the whole has the variance of the ellipse's kernel (as Feline, McCormack et
    /// al. 1999).
    #[default]
    Gaussian,
}

/// The full side of the square whose variance is that of the kernel on a disc of semi-axis 1: `sqrt(12 KERNEL_VARIANCE)`.
pub const SIDE_PER_SEMI_AXIS: f64 = 1.277_874_592_608_047_5;

/// The lookups of one footprint: a row of equally spaced squares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProbeRow {
    /// The mode.
    pub probes: Probes,
    /// The number of lookups: 1 to `2 max_anisotropy + 1`.
    pub count: u32,
    /// From one to the next, in texels of level 0.
    pub step: DVec2,
    /// The variance of each lookup, per axis, in squared texels of level 0, without interpolation.
    pub variance: f64,
}

impl ProbeRow {
    /// The row for an ellipse.
    pub fn new(ellipse: &Ellipse, probes: Probes) -> Self {
        let ratio = if ellipse.minor > 0.0 { ellipse.major / ellipse.minor } else { 1.0 };
        let (count, length) = match probes {
            Probes::Texram => {
                let count = libm::exp2(libm::log2(ratio).round());
                (count as u32, SIDE_PER_SEMI_AXIS * ellipse.major / count)
            }
            Probes::TexramCeiling => {
                // A ratio of 8 and a rounding is 8.
                let count = libm::exp2((libm::log2(ratio) - 1e-3).ceil());
                (count as u32, SIDE_PER_SEMI_AXIS * ellipse.major / count)
            }
            Probes::Gaussian => {
                let rest = (ellipse.major * ellipse.major - ellipse.minor * ellipse.minor).max(0.0);
                let count = (2.0 * (ratio * ratio - 1.0).max(0.0).sqrt()).ceil().max(1.0) as u32;
                let spread = spread(count);
                (count, if spread > 0.0 { (KERNEL_VARIANCE * rest / spread).sqrt() } else { 0.0 })
            }
        };
        let variance = KERNEL_VARIANCE * ellipse.minor * ellipse.minor;
        Self { probes, count, step: length * ellipse.direction, variance }
    }

    /// The side of each square, in texels of level 0.
    pub fn side(&self) -> f64 {
        (12.0 * self.variance).sqrt()
    }

    /// The weighted mean of `lookup` at the offsets of the row, in texels of level 0.
    pub(super) fn mean(&self, lookup: impl Fn(DVec2) -> Mean) -> Mean {
        let mut sum = WeightedSum::default();
        for i in 0..self.count {
            let weight = match self.probes {
                Probes::Texram | Probes::TexramCeiling => 1.0,
                Probes::Gaussian => gaussian(i, self.count),
            };
            sum.add(lookup(steps(i, self.count) * self.step), weight);
        }
        sum.mean().unwrap_or_default()
    }
}

/// The place of the i-th of `count` points around 0, one apart: n / 2 of the patent's p_n.
fn steps(i: u32, count: u32) -> f64 {
    f64::from(i) - 0.5 * (f64::from(count) - 1.0)
}

fn gaussian(i: u32, count: u32) -> f64 {
    let x = 2.0 * steps(i, count) / f64::from(count);
    weight(x * x)
}

/// The variance of the Gaussian weights of `count` points that are one apart.
fn spread(count: u32) -> f64 {
    let (mut moment, mut total) = (0.0, 0.0);
    for i in 0..count {
        let (weight, x) = (gaussian(i, count), steps(i, count));
        (moment, total) = (moment + weight * x * x, total + weight);
    }
    moment / total
}

/// Footprint Assembly over the levels of a pyramid.
pub(super) fn assemble(pyramid: &Pyramid, place: DVec2, ellipse: &Ellipse, probes: Probes) -> Mean {
    let row = ProbeRow::new(ellipse, probes);
    let between = match probes {
        // As published: squares as large as texels.
        Probes::Texram | Probes::TexramCeiling => BetweenLevels::of_width(pyramid, row.side()),
        Probes::Gaussian => BetweenLevels::of_variance(pyramid, row.variance + BILINEAR_VARIANCE),
    };
    let [width, height] = pyramid.levels()[0].size().map(f64::from);
    row.mean(|offset| {
        let place = place + offset / DVec2::new(width, height);
        between.mix(|level| bilinear(pyramid, level, place))
    })
}
