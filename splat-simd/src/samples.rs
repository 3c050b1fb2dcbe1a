//! The samples of a frame in the order in which lanes want them.

use crate::evaluate::LaneLimits;
use crate::lanes::{Eight, LANES, Lanes};
use crate::places::{PLACES, pixel_of};
use splat_core::raster::Rasterizer;
use splat_core::sampling::PATTERNS;

/// The positions and lens points of every pattern, in cells of eight samples of which the last may be padded.
///
/// The position of a padded lane is not a number, so it never hits.
#[derive(Debug)]
pub struct LaneSamples {
    groups: usize,
    samples: usize,
    jitter: Vec<[Eight; 2]>,
    lens: Vec<[Eight; 2]>,
    /// For each place of a tile, where its cells begin in `jitter` and in `lens`.
    first: Box<[[u32; 2]; PLACES]>,
}

impl LaneSamples {
    /// The samples that a frame takes.
    pub fn new(rasterizer: &Rasterizer) -> Self {
        let range = rasterizer.range();
        let samples = rasterizer.samples();
        let groups = range.len().div_ceil(LANES);
        let number = |group: usize, lane: usize| {
            let number = range.start + group * LANES + lane;
            (number < range.end).then_some(number)
        };
        let cells = || (0..PATTERNS).flat_map(|pattern| (0..groups).map(move |group| (pattern, group)));
        let jitter = cells().map(|(pattern, group)| {
            let points = samples.jitter_of_pattern(pattern);
            [0, 1].map(|axis| {
                std::array::from_fn(|lane| number(group, lane).map_or(f32::NAN, |number| points[number][axis]))
            })
        });
        let with_lens = cells().filter(|&(pattern, _)| !samples.lens_of_pattern(pattern).is_empty());
        let lens = with_lens.map(|(pattern, group)| {
            let points = samples.lens_of_pattern(pattern);
            [0, 1].map(|axis| {
                std::array::from_fn(|lane| number(group, lane).map_or(0.0, |number| points[number].p[axis]))
            })
        });
        let first = |place| {
            let [x, y] = pixel_of(place as u16);
            samples.patterns_of(x, y).map(|pattern| (pattern * groups) as u32)
        };
        Self {
            groups,
            samples: range.len(),
            jitter: jitter.collect(),
            lens: lens.collect(),
            first: Box::new(std::array::from_fn(first)),
        }
    }

    /// Number of cells a pixel.
    pub fn groups(&self) -> usize {
        self.groups
    }

    /// Number of samples a pixel.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Number of samples in a cell of a pixel.
    pub fn samples_of(&self, group: usize) -> usize {
        LANES.min(self.samples - group * LANES)
    }

    /// The cell of a place: positions relative to the pixel's corner.
    #[inline(always)]
    pub fn jitter(&self, place: u16, group: usize) -> &[Eight; 2] {
        &self.jitter[self.first[usize::from(place) % PLACES][0] as usize + group]
    }

    /// The lens points of the cell of a place, as [`splat_core::evaluate::LensPoint::p`].
    #[inline(always)]
    pub fn lens(&self, place: u16, group: usize) -> &[Eight; 2] {
        &self.lens[self.first[usize::from(place) % PLACES][1] as usize + group]
    }
}

/// The limits of a frame, in lanes.
#[inline(always)]
pub fn limits<L: Lanes>(rasterizer: &Rasterizer) -> LaneLimits<L> {
    LaneLimits::new(rasterizer.limits())
}
