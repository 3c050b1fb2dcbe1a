//! Texture lookups by lanes: the filters of [`splat_core::texture`], eight texels at once.
//!
//! A lookup has three steps. The set-up (`ellipse`) turns footprints into ellipses and those into kernels, for eight
//! lookups at once, one a lane. Each lookup then finds its level and its place there, in `f64`. The sums (`rows`,
//! `interpolation`) read the texels of one lookup, eight of a row at once, from a [`LanePyramid`].
//!
//! All arithmetic is in `f32`, each operation rounded, sums in a fixed order: a lookup has the same bits at every level, in
//! every batch, on every thread. They are not those of the scalar filters, whose sums are `f64`, but within some roundings
//! of them: but for the level of a pyramid and the number of probes, which `f32` may decide otherwise where the two
//! are a rounding apart.

mod ellipse;
mod interpolation;
mod pyramid;
mod rows;

pub use pyramid::LanePyramid;

use crate::lanes::{Eight, Kernel, LANES, Lanes, Level};
use ellipse::{Ellipses, Footprints, RowKernels, Widening};
use glam::Vec2;
use interpolation::{Bilinear, ProbeRow, ProbedLevel, bicubic};
use rows::{Place, RowKernel, Sums};
use splat_core::texture::filter::{
    Average, BILINEAR_VARIANCE, KERNEL_VARIANCE, MAX_ANISOTROPY, SIDE_PER_SEMI_AXIS, honoured_anisotropy,
    weight,
};
use splat_core::texture::{Filter, Footprint, Magnification, Probes, Sampler};
use std::sync::LazyLock;

/// What is looked up: a place of the texture and the footprint around it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Lookup {
    /// The place; any at all.
    pub st: Vec2,
    /// The footprint; any at all.
    pub footprint: Footprint,
}

/// A [`Sampler`] prepared for lanes.
///
/// [`Filter::EwaPrinted`] is there for comparison, and faulty: lanes take [`Filter::Ewa`] for it.
#[derive(Debug, Clone, Copy)]
pub struct LaneSampler {
    filter: Filter,
    magnification: Magnification,
    /// The reciprocal of the largest anisotropy.
    widest: f32,
    width: f32,
    /// For rows of Gaussian probes, by their number: the distance from one to the next, for an ellipse whose squared axes
    /// differ by 1.
    spacings: &'static [f32],
}

/// Eight lookups, per quantity.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lookups {
    /// s and t.
    pub st: [Eight; 2],
    /// Per conjugate semi-diameter and component.
    pub semi_axes: Footprints,
}

/// Semi-axes, in texels, at which magnification is shown alone and not at all.
const MAGNIFYING: [f32; 2] = [0.5, 1.0];

impl LaneSampler {
    /// The sampler.
    pub fn new(sampler: &Sampler) -> Self {
        Self {
            filter: sampler.filter,
            magnification: sampler.magnification,
            widest: (1.0 / honoured_anisotropy(sampler.max_anisotropy)) as f32,
            width: sampler.width as f32,
            spacings: if sampler.filter == Filter::Assembly(Probes::Gaussian) { &SPACINGS } else { &[] },
        }
    }

    /// The texture's mean colour around a place over a footprint, as [`Sampler::lookup`] has it. [`Self::lookups`] is
    /// faster where there are several.
    pub fn lookup(&self, level: Level, pyramid: &LanePyramid, st: Vec2, footprint: &Footprint) -> [f32; 4] {
        self.average(level, pyramid, st, footprint).color
    }

    /// The same with its cost: texels that were loaded, those of weight zero included.
    pub fn average(&self, level: Level, pyramid: &LanePyramid, st: Vec2, footprint: &Footprint) -> Average {
        let mut found = [Average::default()];
        self.lookups(level, pyramid, &[Lookup { st, footprint: *footprint }], &mut found);
        found[0]
    }

    /// Many lookups; as many as `found` has entries. Each is what it is alone, whatever else is looked up with it.
    // One copy of the kernels is enough.
    #[inline(never)]
    pub fn lookups(&self, level: Level, pyramid: &LanePyramid, lookups: &[Lookup], found: &mut [Average]) {
        level.run_single(Batch { sampler: self, pyramid, lookups, found });
    }

    /// Up to eight lookups within a kernel over lanes, with as many averages.
    #[inline(always)]
    pub(crate) fn eight<L: Lanes>(&self, pyramid: &LanePyramid, lookups: &Lookups, found: &mut [Average]) {
        match pyramid.channels {
            1 => Eightfold::<L::Single, 1>::new(self, pyramid, lookups).averages(found),
            // Two are stored as three.
            2 | 3 => Eightfold::<L::Single, 3>::new(self, pyramid, lookups).averages(found),
            _ => Eightfold::<L::Single, 4>::new(self, pyramid, lookups).averages(found),
        }
    }
}

/// A list of lookups, as a computation over lanes.
struct Batch<'a> {
    sampler: &'a LaneSampler,
    pyramid: &'a LanePyramid,
    lookups: &'a [Lookup],
    found: &'a mut [Average],
}

impl Kernel for Batch<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for (lookups, found) in self.lookups.chunks(LANES).zip(self.found.chunks_mut(LANES)) {
            self.sampler.eight::<L>(self.pyramid, &Lookups::new(lookups), found);
        }
    }
}

impl Lookups {
    /// The lanes of up to eight lookups; the others are points.
    #[inline(always)]
    fn new(lookups: &[Lookup]) -> Self {
        let mut eight = Self { st: [[0.0; LANES]; 2], semi_axes: [[[0.0; LANES]; 2]; 2] };
        for (lane, Lookup { st, footprint }) in lookups.iter().enumerate().take(LANES) {
            eight.st[0][lane] = st.x;
            eight.st[1][lane] = st.y;
            for (axis, vector) in eight.semi_axes.iter_mut().zip(footprint.semi_axes) {
                axis[0][lane] = vector.x;
                axis[1][lane] = vector.y;
            }
        }
        eight
    }
}

/// Two levels that are mixed: the finer one, and the share of the next.
#[derive(Debug, Clone, Copy, Default)]
struct Between {
    finer: usize,
    share: f32,
}

/// A mean colour, in the pyramid's unit, and the texels read.
#[derive(Debug, Clone, Copy, Default)]
struct Mean {
    color: [f32; 4],
    texels: u32,
}

/// Eight lookups under way, of a texture of `C` channels.
struct Eightfold<'a, L, const C: usize> {
    sampler: &'a LaneSampler,
    pyramid: &'a LanePyramid,
    lookups: &'a Lookups,
    /// Squared semi-axes, the major first.
    squared: [Eight; 2],
    axes: [Eight; 2],
    direction: [Eight; 2],
    levels: [Between; LANES],
    kernels: [RowKernels; 2],
    lanes: std::marker::PhantomData<L>,
}

impl<'a, L: Lanes, const C: usize> Eightfold<'a, L, C> {
    /// The set-up.
    #[inline(always)]
    fn new(sampler: &'a LaneSampler, pyramid: &'a LanePyramid, lookups: &'a Lookups) -> Self {
        let ellipses = Ellipses::<L>::new(&lookups.semi_axes, sampler.width, pyramid.size(), sampler.widest);
        let mut eightfold = Self {
            sampler,
            pyramid,
            lookups,
            squared: [[0.0; LANES]; 2],
            axes: [[0.0; LANES]; 2],
            direction: [[0.0; LANES]; 2],
            levels: [Between::default(); LANES],
            kernels: [RowKernels::default(); 2],
            lanes: std::marker::PhantomData,
        };
        for axis in 0..2 {
            ellipses.squared[axis].store_cell::<0>(&mut eightfold.squared[axis]);
            ellipses.squared[axis].square_root().store_cell::<0>(&mut eightfold.axes[axis]);
            ellipses.direction[axis].store_cell::<0>(&mut eightfold.direction[axis]);
        }
        eightfold.choose_levels();
        let widening = match sampler.filter {
            Filter::EwaVc(_) => Widening::Compensated,
            Filter::Ewa | Filter::EwaPrinted => Widening::Texel,
            Filter::Trilinear | Filter::Assembly(_) => return eightfold,
        };
        let count = if widening == Widening::Texel { 2 } else { 1 };
        for next in 0..count {
            let mut levels = [0; LANES];
            for (level, between) in levels.iter_mut().zip(&eightfold.levels) {
                *level = (between.finer + next).min(pyramid.levels.len() - 1);
            }
            eightfold.kernels[next] = RowKernels::new(pyramid, &levels, &ellipses, widening);
        }
        eightfold
    }

    /// The levels of the lookups.
    #[inline(always)]
    fn choose_levels(&mut self) {
        for lane in 0..LANES {
            let (major, minor) = (self.axes[0][lane], self.axes[1][lane]);
            self.levels[lane] = match self.sampler.filter {
                Filter::EwaVc(quality) => {
                    let finer = self.pyramid.coarsest_within(minor / quality.texels() as f32);
                    Between { finer, share: 0.0 }
                }
                Filter::Trilinear => self.pyramid.of_width(major),
                Filter::Ewa | Filter::EwaPrinted => self.pyramid.of_width(minor),
                Filter::Assembly(Probes::Gaussian) => {
                    let variance = KERNEL_VARIANCE as f32 * self.squared[1][lane];
                    self.pyramid.of_variance(variance + BILINEAR_VARIANCE as f32)
                }
                Filter::Assembly(_) => self.pyramid.of_width(SIDE_PER_SEMI_AXIS as f32 * minor),
            };
        }
    }

    /// The averages of the first lookups, one for each entry of `found`.
    #[inline(always)]
    fn averages(&self, found: &mut [Average]) {
        let mut means = [Mean::default(); LANES];
        let means = &mut means[..found.len().min(LANES)];
        let is_summed = matches!(self.sampler.filter, Filter::EwaVc(_) | Filter::Ewa | Filter::EwaPrinted);
        if is_summed {
            self.sum(means);
        } else {
            for (lane, mean) in means.iter_mut().enumerate() {
                *mean = self.probed(lane);
            }
        }
        let [only_magnifying, only_filtering] = MAGNIFYING;
        for (lane, (mean, found)) in means.iter().zip(found).enumerate() {
            let share = (self.axes[0][lane] - only_magnifying) / (only_filtering - only_magnifying);
            let Mean { color, texels } = if share >= 1.0 {
                *mean
            } else {
                let magnified = self.magnified(lane);
                if share > 0.0 { magnified.mix(*mean, share) } else { magnified }
            };
            *found = Average { color, texels };
            for value in &mut found.color {
                *value = (*value * self.pyramid.unit).clamp(f32::MIN, f32::MAX);
            }
        }
    }

    #[inline(always)]
    fn magnified(&self, lane: usize) -> Mean {
        match self.sampler.magnification {
            Magnification::Bilinear => self.bilinear(0, lane),
            Magnification::Bicubic => {
                let color = bicubic::<C>(&self.pyramid.levels[0], self.place(0, lane));
                Mean { color, texels: 16 }
            }
        }
    }

    #[inline(always)]
    fn bilinear(&self, level: usize, lane: usize) -> Mean {
        let mut sum = Bilinear::<L>::new();
        sum.add::<C>(&self.pyramid.levels[level], self.place(level, lane), 1.0);
        Mean { color: sum.sums::<C>(), texels: sum.texels }
    }

    /// EWA of the first lookups: row by row at one level, or at two. In steps of eight lookups each, so that one need not
    /// wait for another.
    #[inline(always)]
    fn sum(&self, means: &mut [Mean]) {
        let count = if matches!(self.sampler.filter, Filter::EwaVc(_)) { 1 } else { 2 };
        for next in 0..count {
            let mut found = [Mean::default(); LANES];
            self.sum_at(next, &mut found[..means.len().min(LANES)]);
            for (lane, (mean, found)) in means.iter_mut().zip(found).enumerate() {
                if next == 0 {
                    *mean = found;
                } else if self.levels[lane].share > 0.0 {
                    *mean = mean.mix(found, self.levels[lane].share);
                }
            }
        }
    }

    /// The same at the finer or the next level.
    #[inline(always)]
    fn sum_at(&self, next: usize, means: &mut [Mean]) {
        let mut kernels = [RowKernel::default(); LANES];
        let mut levels = [&self.pyramid.levels[0]; LANES];
        for (lane, kernel) in kernels.iter_mut().enumerate().take(means.len()) {
            let index = (self.levels[lane].finer + next).min(self.pyramid.levels.len() - 1);
            levels[lane] = &self.pyramid.levels[index];
            *kernel = RowKernel::new(&self.kernels[next], lane, self.place(index, lane));
        }
        let mut sums = [Sums::<L, C>::new(); LANES];
        for (lane, mean) in means.iter_mut().enumerate().take(LANES) {
            let needed = next == 0 || self.levels[lane].share > 0.0;
            if needed && self.axes[0][lane] > MAGNIFYING[0] {
                let vectors;
                (sums[lane], vectors) = kernels[lane].sums(levels[lane]);
                mean.texels = LANES as u32 * vectors;
            }
        }
        for (mean, sums) in means.iter_mut().zip(&sums) {
            mean.color = sums.mean();
        }
    }

    /// A row of probes at one level, or at two.
    #[inline(always)]
    fn probed(&self, lane: usize) -> Mean {
        let row = match self.sampler.filter {
            Filter::Assembly(probes) => self.row(lane, probes),
            _ => ProbeRow::ONE,
        };
        let Between { finer, share } = self.levels[lane];
        let level = |index: usize, share: f32| {
            let index = index.min(self.pyramid.levels.len() - 1);
            ProbedLevel { level: &self.pyramid.levels[index], place: self.place(index, lane), share }
        };
        let levels = [level(finer, 1.0 - share), level(finer + 1, share)];
        let (color, texels) = row.mean::<L, C>(if share > 0.0 { &levels } else { &levels[..1] });
        Mean { color, texels }
    }

    /// The probes for an ellipse.
    #[inline(always)]
    fn row(&self, lane: usize, probes: Probes) -> ProbeRow {
        let (major, minor) = (self.axes[0][lane], self.axes[1][lane]);
        let ratio = if minor > 0.0 { major / minor } else { 1.0 };
        let (count, length) = match probes {
            Probes::Texram => power_of_two(ratio, std::f32::consts::SQRT_2),
            // A ratio of 8 and a rounding is 8: 2^-.001.
            Probes::TexramCeiling => power_of_two(ratio * 0.999_307_1, 1.0),
            Probes::Gaussian => {
                let count = (2.0 * (ratio * ratio - 1.0).max(0.0).sqrt()).ceil().max(1.0) as u32;
                let rest = (self.squared[0][lane] - self.squared[1][lane]).max(0.0).sqrt();
                (count, rest * self.sampler.spacings.get(count as usize).unwrap_or(&0.0))
            }
        };
        let length = match probes {
            Probes::Gaussian => length,
            Probes::Texram | Probes::TexramCeiling => SIDE_PER_SEMI_AXIS as f32 * major * length,
        };
        let step = [length * self.direction[0][lane], length * self.direction[1][lane]];
        ProbeRow { count, step, gaussian: probes == Probes::Gaussian }
    }

    /// Where a lookup is, in texels of a level.
    #[inline(always)]
    fn place(&self, level: usize, lane: usize) -> Place {
        self.pyramid.place(level, [self.lookups.st[0][lane], self.lookups.st[1][lane]])
    }
}

/// 2^k and its reciprocal, with k the exponent of a value of at least 1/2, and one more if the mantissa exceeds `limit`.
#[inline(always)]
fn power_of_two(value: f32, limit: f32) -> (u32, f32) {
    let exponent = (value.to_bits() >> 23) as i32 - 127;
    let mantissa = f32::from_bits(value.to_bits() & 0x7f_ffff | 0x3f80_0000);
    let count = 1 << (exponent + i32::from(mantissa > limit)).clamp(0, 16);
    (count, 1.0 / count as f32)
}

impl Mean {
    /// `(1 - t) self + t other`.
    #[inline(always)]
    fn mix(mut self, other: Self, t: f32) -> Self {
        for (value, other) in self.color.iter_mut().zip(other.color) {
            *value = (1.0 - t) * *value + t * other;
        }
        self.texels += other.texels;
        self
    }
}

impl<L: Lanes, const C: usize> Sums<L, C> {
    /// The mean; 0 where no texel has a weight, which no ellipse has: all are at least a texel wide.
    #[inline(always)]
    fn mean(&self) -> [f32; 4] {
        let last = self.colors[C - 1];
        let at = |channel: usize| if channel < C { channel } else { C - 1 };
        let mut color = L::sums([self.colors[0], self.colors[at(1)], self.colors[at(2)], self.weight]);
        let weight = if color[3] > 0.0 { color[3] } else { 1.0 };
        color[3] = if C == 4 { L::sums([last; 4])[0] } else { 0.0 };
        for (channel, value) in color.iter_mut().enumerate() {
            *value = if channel < C { *value / weight } else { 0.0 };
        }
        color
    }
}

/// By the number of probes: see [`LaneSampler::spacings`].
static SPACINGS: LazyLock<Vec<f32>> = LazyLock::new(|| {
    let spacing = |count: u32| {
        let (mut moment, mut total) = (0.0, 0.0);
        for i in 0..count {
            let step = f64::from(i) - 0.5 * (f64::from(count) - 1.0);
            let x = 2.0 * step / f64::from(count);
            let weight = weight(x * x);
            (moment, total) = (moment + weight * step * step, total + weight);
        }
        if moment > 0.0 { (KERNEL_VARIANCE * total / moment).sqrt() as f32 } else { 0.0 }
    };
    // A ratio of 256 takes 512 probes; roundings one more.
    (0..=2 * MAX_ANISOTROPY as u32 + 1).map(spacing).collect()
});
