//! Footprints as ellipses among texels, eight lookups at once: [`Ellipse`](splat_core::texture::filter::Ellipse) and
//! [`RowKernel`](splat_core::texture::filter::RowKernel) of the reference in `f32`.
//!
//! What `f32` must not do here is cancel. The determinant of the two vectors is off by 2^-24 of their lengths' product,
//! which is at most that of the axes times the anisotropy, of which no more than 256 counts: 1e-5 of itself. The
//! determinant of a level's matrix is made from the axes, not from the matrix. Places are reduced to a whole and a fraction
//! in `f64`, per lookup.

use super::pyramid::{LanePyramid, Metric};
use crate::lanes::{Eight, LANES, Lanes};
use splat_core::texture::filter::MAX_PERIODS;

/// Eight footprints: per vector and component.
pub type Footprints = [[Eight; 2]; 2];

/// Eight ellipses, in texels of level 0.
#[derive(Clone, Copy)]
pub struct Ellipses<L> {
    /// M = J J^T: [xx, xy, yy].
    pub matrix: [L; 3],
    /// The squared semi-axes, the major first.
    pub squared: [L; 2],
    /// The unit vector along the major axis.
    pub direction: [L; 2],
}

impl<L: Lanes> Ellipses<L> {
    /// The ellipses of footprints, any at all. `widest` is the reciprocal of the greatest anisotropy.
    #[inline(always)]
    pub fn new(footprints: &Footprints, width: f32, size: [u32; 2], widest: f32) -> Self {
        let [[ax, ay], [bx, by]] = [finite::<L>(&footprints[0], width), finite::<L>(&footprints[1], width)];
        let [ax, bx] = bounded([ax, bx], size[0] as f32);
        let [ay, by] = bounded([ay, by], size[1] as f32);
        let determinant = ax * by - ay * bx;
        let (xx, xy, yy) = (ax * ax + bx * bx, ax * ay + bx * by, ay * ay + by * by);

        let (zero, one, half) = (L::splat(0.0), L::splat(1.0), L::splat(0.5));
        let difference = half * (xx - yy);
        let root = (difference * difference + xy * xy).square_root();
        let major = half * (xx + yy) + root;
        let least = major * L::splat(widest * widest);
        let minor = (determinant * determinant / major).greatest(least).least(major);

        // The column of M - minor^2 that has no difference in it.
        let steep = difference.less(zero);
        let x = steep.select(xy, difference + root);
        let y = steep.select(root - difference, xy);
        let length = x * x + y * y;
        let is_disc = length.less_or_equal(zero);
        let reciprocal = one / length.square_root();
        let (x, y) = (is_disc.select(one, x * reciprocal), (y * reciprocal).and_not(is_disc));
        let matrix = [major * x * x + minor * y * y, (major - minor) * x * y, major * y * y + minor * x * x];
        Self { matrix, squared: [major, minor], direction: [x, y] }
    }
}

/// Vectors without NaN (those are zero) and infinities, times `width`.
#[inline(always)]
fn finite<L: Lanes>(vectors: &[Eight; 2], width: f32) -> [L; 2] {
    let width = L::splat(width);
    let (x, y) = (L::load(&vectors[0]) * width, L::load(&vectors[1]) * width);
    let (least, greatest) = (L::splat(f32::MIN), L::splat(f32::MAX));
    // Neither of a comparison with NaN is so.
    let is_number = x.less_or_equal(x) & y.less_or_equal(y);
    [(x & is_number).least(greatest).greatest(least), (y & is_number).least(greatest).greatest(least)]
}

/// One component of both vectors, in texels: an extent of more than [`MAX_PERIODS`] is shrunk to that. In two steps, so
/// that nothing overflows.
#[inline(always)]
fn bounded<L: Lanes>([a, b]: [L; 2], count: f32) -> [L; 2] {
    let (zero, most) = (L::splat(0.0), L::splat(MAX_PERIODS as f32));
    let longest = a.greatest(zero - a).greatest(b.greatest(zero - b));
    let shrinkage = most / longest.greatest(most);
    let (a, b) = (a * shrinkage, b * shrinkage);
    let length = (a * a + b * b).square_root();
    let scale = most / length.greatest(most) * L::splat(count);
    [a * scale, b * scale]
}

/// The levels of eight lookups as lanes.
struct Metrics {
    scale: [Eight; 2],
    rest: [Eight; 2],
    reach: [Eight; 2],
}

impl Metrics {
    #[inline(always)]
    fn new(pyramid: &LanePyramid, levels: &[usize; LANES]) -> Self {
        let empty = [[0.0; LANES]; 2];
        let mut metrics = Self { scale: empty, rest: empty, reach: empty };
        for (lane, &level) in levels.iter().enumerate() {
            let Metric { scale, rest, reach, .. } = pyramid.metric(level);
            for axis in 0..2 {
                metrics.scale[axis][lane] = scale[axis];
                metrics.rest[axis][lane] = rest[axis];
                metrics.reach[axis][lane] = reach[axis];
            }
        }
        metrics
    }
}

/// What stands on the diagonal of a level's matrix beside the ellipse's own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Widening {
    /// What the level's prefilter lacks.
    Compensated,
    /// A texel squared of the level, as in pbrt.
    Texel,
}

/// Eight ellipses at one level each, to be summed row by row: with (dx, dy) a texel's place from the centre,
/// `r2 = ((dx - slope dy) per_width)^2 + inverse_yy dy^2`.
#[derive(Debug, Clone, Copy, Default)]
pub struct RowKernels {
    /// How far the middle of a row moves per row.
    pub slope: Eight,
    /// Half the length of the row through the centre.
    pub width: Eight,
    /// Its reciprocal.
    pub per_width: Eight,
    /// Factor on the squared distance of the row.
    pub inverse_yy: Eight,
    /// How many columns and rows the ellipse extends from its centre.
    pub extent: [Eight; 2],
}

impl RowKernels {
    /// The kernels of ellipses, each at its level.
    #[inline(always)]
    pub fn new<L: Lanes>(
        pyramid: &LanePyramid,
        levels: &[usize; LANES],
        ellipses: &Ellipses<L>,
        widening: Widening,
    ) -> Self {
        let metrics = Metrics::new(pyramid, levels);
        let [sx, sy] = [L::load(&metrics.scale[0]), L::load(&metrics.scale[1])];
        let one = L::splat(1.0);
        let (rest_x, rest_y) = match widening {
            Widening::Compensated => (L::load(&metrics.rest[0]), L::load(&metrics.rest[1])),
            Widening::Texel => (one / (sx * sx), one / (sy * sy)),
        };
        let ([xx, xy, yy], [major, minor]) = (ellipses.matrix, ellipses.squared);
        let determinant = major * minor + (rest_x * yy + rest_y * xx + rest_x * rest_y);
        let (xx, xy, yy) = ((xx + rest_x) * (sx * sx), xy * (sx * sy), (yy + rest_y) * (sy * sy));

        // Of a side that has few texels, an ellipse may cover many periods: no more than some are looked at.
        let (reach_x, reach_y) = (L::load(&metrics.reach[0]), L::load(&metrics.reach[1]));
        let x = reach_x / xx.square_root().greatest(reach_x);
        let y = reach_y / yy.square_root().greatest(reach_y);
        let (xy, yy, scale) = (xy * x * y, yy * y * y, (sx * sy) * (x * y));
        let inverse_yy = one / yy;
        let width = (determinant * inverse_yy).square_root() * scale;
        let mut kernels = Self {
            slope: [0.0; LANES],
            width: [0.0; LANES],
            per_width: [0.0; LANES],
            inverse_yy: [0.0; LANES],
            extent: [[0.0; LANES]; 2],
        };
        (xy * inverse_yy).store_cell::<0>(&mut kernels.slope);
        width.store_cell::<0>(&mut kernels.width);
        (one / width).store_cell::<0>(&mut kernels.per_width);
        inverse_yy.store_cell::<0>(&mut kernels.inverse_yy);
        xx.square_root().least(reach_x).store_cell::<0>(&mut kernels.extent[0]);
        yy.square_root().store_cell::<0>(&mut kernels.extent[1]);
        kernels
    }
}
