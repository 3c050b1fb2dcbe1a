//! Averages of a pyramid over a footprint. Seeds 1 and 2, with the errata E1 to E14 of docs/specification.md.
//!
//! [`Sampler::lookup`] is the scalar reference. A lookup has a set-up of its own, in `f64`:
//! [`Ellipse`] (the sanitised footprint in texels), then [`RowKernel`] (an ellipse at one level, summed row by row)
//! or [`ProbeRow`].

mod assembly;
mod ellipse;
mod ewa_printed;
mod isotropic;
mod mean;
mod rows;
mod summed_area;

pub use assembly::{ProbeRow, Probes, SIDE_PER_SEMI_AXIS};
pub use ellipse::{Ellipse, MAX_ANISOTROPY, MAX_PERIODS, Symmetric, honoured_anisotropy, place};
pub use mean::Average;
pub use rows::{BILINEAR_VARIANCE, KERNEL_VARIANCE, RowKernel, RowSpan, WEIGHT_POLYNOMIAL, weight};
pub use summed_area::SummedArea;

use super::Footprint;
use super::pyramid::Pyramid;
use glam::{DVec2, Vec2};
use isotropic::BetweenLevels;
use mean::Mean;

/// How a footprint is averaged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Filter {
    /// Two levels of bilinear lookups, as wide as the footprint is long: pbrt's triangle filter.
    Trilinear,
    /// EWA as pbrt prints it, for comparison: errata E1 to E10 included.
    EwaPrinted,
    /// pbrt's EWA along the footprint's principal axes, with exact weights: two levels, each ellipse a texel wider.
    Ewa,
    /// Footprint Assembly over the levels.
    Assembly(Probes),
    /// Variance-compensated EWA at a single level: see [`RowKernel::variance_compensated`].
    EwaVc(Quality),
}

/// The least minor semi-axis of variance-compensated EWA, in texels of the level that is summed, where there are levels
/// to choose from. Time grows with it, linearly or with its square; the error falls.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Quality(f64);

impl Quality {
    /// 1.5 texels.
    pub const FAST: Self = Self(1.5);
    /// 2 texels.
    pub const DEFAULT: Self = Self(2.0);
    /// 3 texels.
    pub const REFERENCE: Self = Self(3.0);

    /// A number of texels, clamped to 1.25 (below, few texels make a kernel) to 8; not a number: 1.25.
    pub fn new(texels: f64) -> Self {
        Self(if texels.is_nan() { 1.25 } else { texels.clamp(1.25, 8.0) })
    }

    /// The number of texels.
    pub fn texels(self) -> f64 {
        self.0
    }
}

impl Default for Quality {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// What is shown where a footprint is smaller than a texel. EWA's discs would show there as blobs (E14).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Magnification {
    /// Bilinear interpolation.
    #[default]
    Bilinear,
    /// Catmull-Rom interpolation, each step kept within its four values.
    Bicubic,
}

/// Longest semi-axes, in texels, at which magnification is shown alone and not at all: between them the two are mixed.
const MAGNIFYING: [f64; 2] = [0.5, 1.0];

/// Looks textures up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampler {
    /// The filter of footprints of a texel or more.
    pub filter: Filter,
    /// The filter of smaller ones. [`Filter::EwaPrinted`] knows of none.
    pub magnification: Magnification,
    /// A: how many times as long as wide a footprint may be; longer ones are widened. Clamped to 1 to
    /// [`MAX_ANISOTROPY`]. It bounds the time of every lookup, whatever the footprint: variance-compensated EWA of
    /// quality Q reads some `4 pi Q^2 A` texels at most (twice as many where sizes are no powers of two), probes `8
    /// (2 A + 1)`.
    pub max_anisotropy: f64,
    /// Factor on all footprints: below 1 for sharper, above 1 for smoother textures. Not a number: 0.
    pub width: f64,
}

impl Default for Sampler {
    fn default() -> Self {
        Self {
            filter: Filter::EwaVc(Quality::DEFAULT),
            magnification: Magnification::Bilinear,
            max_anisotropy: 16.0,
            width: 1.0,
        }
    }
}

impl Sampler {
    /// The texture's mean colour around `st` over a footprint, linear; channels that the texture does not have are 0.
    ///
    /// Any `st` and footprint will do: the colour is finite, and within the range of the texels but for rounding.
    pub fn lookup(&self, pyramid: &Pyramid, st: Vec2, footprint: &Footprint) -> [f32; 4] {
        self.average(pyramid, st, footprint).color
    }

    /// The same with its cost.
    pub fn average(&self, pyramid: &Pyramid, st: Vec2, footprint: &Footprint) -> Average {
        let footprint = Footprint { semi_axes: footprint.semi_axes.map(|axis| axis * self.width as f32) };
        let place = place(pyramid.wrap(), st);
        if self.filter == Filter::EwaPrinted {
            let anisotropy = honoured_anisotropy(self.max_anisotropy) as f32;
            return ewa_printed::lookup(pyramid, place, &footprint, anisotropy).rounded();
        }
        let ellipse = Ellipse::new(&footprint, pyramid.levels()[0].size(), self.max_anisotropy);
        let [only_magnifying, only_filtering] = MAGNIFYING;
        let share = (ellipse.major - only_magnifying) / (only_filtering - only_magnifying);
        if share <= 0.0 {
            return self.magnified(pyramid, place).rounded();
        }
        let filtered = self.filtered(pyramid, place, &ellipse);
        if share >= 1.0 {
            return filtered.rounded();
        }
        self.magnified(pyramid, place).mix(filtered, share).rounded()
    }

    fn magnified(&self, pyramid: &Pyramid, place: DVec2) -> Mean {
        match self.magnification {
            Magnification::Bilinear => isotropic::bilinear(pyramid, 0, place),
            Magnification::Bicubic => isotropic::bicubic(pyramid, place),
        }
    }

    fn filtered(&self, pyramid: &Pyramid, place: DVec2, ellipse: &Ellipse) -> Mean {
        let rows = |kernel: RowKernel| {
            // An ellipse always has a texel (it is at least a texel wide); should it not, the nearest do.
            kernel.mean(pyramid).unwrap_or_else(|| isotropic::bilinear(pyramid, kernel.level, place))
        };
        match self.filter {
            Filter::Trilinear => isotropic::trilinear(pyramid, place, ellipse),
            Filter::Assembly(probes) => assembly::assemble(pyramid, place, ellipse, probes),
            Filter::EwaVc(quality) => {
                rows(RowKernel::variance_compensated(pyramid, place, ellipse, quality.texels()))
            }
            Filter::Ewa | Filter::EwaPrinted => BetweenLevels::of_width(pyramid, ellipse.minor)
                .mix(|level| rows(RowKernel::widened(pyramid, level, place, ellipse))),
        }
    }
}
