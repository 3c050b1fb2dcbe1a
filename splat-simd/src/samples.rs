//! The samples of a frame in the order in which lanes want them.

use crate::evaluate::{LaneLensPoint, LaneLimits};
use crate::lanes::{LANES, Lanes};
use splat_core::raster::Rasterizer;
use splat_core::sampling::PATTERNS;

/// One value for each of eight samples.
type Eight = [f32; LANES];

/// The positions and lens points of every pattern, in groups of eight samples of which the last may be padded.
#[derive(Debug)]
pub struct LaneSamples {
    groups: usize,
    /// The lanes of the last group that are samples, as bits.
    last_group: u32,
    jitter: Vec<[Eight; 2]>,
    lens: Vec<[Eight; 2]>,
}

impl LaneSamples {
    /// The samples that a frame takes.
    pub fn new(rasterizer: &Rasterizer) -> Self {
        let range = rasterizer.range();
        let samples = rasterizer.samples();
        let groups = range.len().div_ceil(LANES);
        let spare = groups * LANES - range.len();
        // A padded lane repeats the group's first sample: harmless numbers.
        let sample = |group: usize, lane: usize| {
            let number = range.start + group * LANES + lane;
            if number < range.end { number } else { range.start + group * LANES }
        };
        let cells = || (0..PATTERNS).flat_map(|pattern| (0..groups).map(move |group| (pattern, group)));
        let jitter = cells().map(|(pattern, group)| {
            let points = samples.jitter_of_pattern(pattern);
            [0, 1].map(|axis| std::array::from_fn(|lane| points[sample(group, lane)][axis]))
        });
        let lens = cells().filter(|&(pattern, _)| !samples.lens_of_pattern(pattern).is_empty()).map(
            |(pattern, group)| {
                let points = samples.lens_of_pattern(pattern);
                [0, 1].map(|axis| std::array::from_fn(|lane| points[sample(group, lane)].p[axis]))
            },
        );
        Self {
            groups,
            last_group: u32::from(u8::MAX) >> spare,
            jitter: jitter.collect(),
            lens: lens.collect(),
        }
    }

    /// Number of groups of eight samples a pixel.
    pub fn groups(&self) -> usize {
        self.groups
    }

    /// The lanes of a group that are samples, as bits.
    #[inline(always)]
    pub fn live(&self, group: usize) -> u32 {
        if group + 1 == self.groups { self.last_group } else { u32::from(u8::MAX) }
    }

    /// The groups of a pattern: positions relative to the pixel's corner.
    #[inline(always)]
    pub fn jitter(&self, pattern: usize) -> &[[Eight; 2]] {
        &self.jitter[pattern * self.groups..][..self.groups]
    }

    /// The lens points of a group of a pattern.
    #[inline(always)]
    pub fn lens<L: Lanes>(&self, pattern: usize, group: usize) -> LaneLensPoint<L> {
        let [x, y] = &self.lens[pattern * self.groups + group];
        LaneLensPoint { p: [L::load(x), L::load(y)] }
    }
}

/// The limits of a frame, in lanes.
pub fn limits<L: Lanes>(rasterizer: &Rasterizer) -> LaneLimits<L> {
    LaneLimits::new(rasterizer.limits())
}
