//! Where the samples of a pixel lie, on the picture and on the lens: SPEC section 5 (L21-29, L172-182).
//!
//! As in the listing there are [`PATTERNS`] patterns of S samples each, and a 32 x 32 table selects one by
//! (x mod 32, y mod 32); a second table does so for the lens. A sample is therefore a pure function of seed, S,
//! pattern kind, filter, pixel and sample index.

mod aperture;
mod dealt;
mod filter;
mod poisson;
mod sobol;

pub use filter::PixelFilter;

use crate::evaluate::LensPoint;
use crate::real::Real;
use crate::{Lens, RenderOptions};
use aperture::on_aperture;
use filter::FilterSampler;
use glam::DVec2;
use rand_pcg::Pcg32;
use rand_pcg::rand_core::Rng;

/// Number of different patterns (`jitterPatterns`, L22).
pub const PATTERNS: usize = 64;

/// Side of the selection table (`selSize`, L27), in pixels.
pub const SELECTION_SIZE: usize = 32;

/// Side of the blocks of the selection table in which each pattern stands exactly once.
pub const BLOCK: usize = 8;

/// How the points of a pattern are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PatternKind {
    /// Dart throwing with a least distance: the listing's patterns.
    PoissonDisc,
    /// The first two dimensions of Sobol's sequence, Owen-scrambled: every elementary interval of a pattern holds
    /// its share of the points.
    Sobol,
    /// One such set for all patterns, dealt out so that the points of each are far from each other: the least error at
    /// edges.
    Dealt,
}

/// The samples of every pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct SampleTable {
    samples: usize,
    jitter: Vec<[f32; 2]>,
    lens: Option<LensSamples>,
    filter_selection: Selection,
}

/// The lens points of every pixel's samples.
#[derive(Debug, Clone, PartialEq)]
struct LensSamples {
    unit: Vec<[f32; 2]>,
    points: Vec<LensPoint<f32>>,
    selection: Selection,
}

/// For each place of the 32 x 32 table, the number of a pattern.
type Selection = Box<[u8; SELECTION_SIZE * SELECTION_SIZE]>;

/// The streams of random numbers, one a purpose, so that one never shifts another.
#[derive(Debug, Clone, Copy)]
enum Stream {
    FilterPoints = 1,
    FilterSelection,
    LensPoints,
    LensSelection,
    LensOrder,
}

impl Stream {
    fn generator(self, seed: u64) -> Pcg32 {
        Pcg32::new(seed, self as u64)
    }
}

impl SampleTable {
    /// The samples that these options ask for, on this lens.
    pub fn new(options: &RenderOptions, lens: Option<Lens>, pixel_scale: DVec2) -> Self {
        let samples = options.samples as usize;
        let filter = FilterSampler::new(options.filter);
        let place = |point: [f64; 2]| point.map(|value| filter.jitter(value));
        Self {
            samples,
            jitter: patterns(options, Stream::FilterPoints, place),
            lens: lens.map(|lens| LensSamples::new(options, lens, pixel_scale)),
            filter_selection: selection(&mut Stream::FilterSelection.generator(options.seed)),
        }
    }

    /// Number of samples a pixel.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// The positions of a pixel's samples relative to its upper left corner, in pixels.
    #[inline]
    pub fn jitter(&self, x: i32, y: i32) -> &[[f32; 2]] {
        pattern(&self.jitter, &self.filter_selection, self.samples, x, y)
    }

    /// The lens points of a pixel's samples; empty for a pinhole.
    #[inline]
    pub fn lens(&self, x: i32, y: i32) -> &[LensPoint<f32>] {
        self.lens.as_ref().map_or(&[], |lens| pattern(&lens.points, &lens.selection, self.samples, x, y))
    }

    /// The numbers of the patterns, below [`PATTERNS`], from which a pixel takes its positions and its lens points.
    #[inline]
    pub fn patterns_of(&self, x: i32, y: i32) -> [usize; 2] {
        let filter = pattern_number(&self.filter_selection, x, y);
        [filter, self.lens.as_ref().map_or(0, |lens| pattern_number(&lens.selection, x, y))]
    }

    /// The positions of a pattern's samples.
    pub fn jitter_of_pattern(&self, pattern: usize) -> &[[f32; 2]] {
        &self.jitter[pattern * self.samples..][..self.samples]
    }

    /// The lens points of a pattern's samples; empty for a pinhole.
    pub fn lens_of_pattern(&self, pattern: usize) -> &[LensPoint<f32>] {
        self.lens.as_ref().map_or(&[], |lens| &lens.points[pattern * self.samples..][..self.samples])
    }

    /// The lens points of a pixel's samples on an aperture of radius 1; empty for a pinhole.
    pub fn unit_lens(&self, x: i32, y: i32) -> &[[f32; 2]] {
        self.lens.as_ref().map_or(&[], |lens| pattern(&lens.unit, &lens.selection, self.samples, x, y))
    }
}

/// The slice of a pixel's pattern.
fn pattern<'a, T>(points: &'a [T], selection: &Selection, samples: usize, x: i32, y: i32) -> &'a [T] {
    let first = pattern_number(selection, x, y) * samples;
    &points[first..first + samples]
}

/// The number of a pixel's pattern.
fn pattern_number(selection: &Selection, x: i32, y: i32) -> usize {
    let column = x as usize % SELECTION_SIZE;
    let row = y as usize % SELECTION_SIZE;
    usize::from(selection[row * SELECTION_SIZE + column])
}

impl LensSamples {
    fn new(options: &RenderOptions, lens: Lens, pixel_scale: DVec2) -> Self {
        let mut unit = patterns(options, Stream::LensPoints, |point| on_aperture(point, lens.blades));
        // Sample j takes its place on the picture and its place on the lens from two patterns; a random order keeps
        // the two from moving together (erratum E16).
        let mut random = Stream::LensOrder.generator(options.seed);
        for pattern in unit.chunks_mut(options.samples as usize) {
            shuffle(pattern, &mut random);
        }
        let points = unit.iter().map(|&unit| LensPoint::new(unit, lens, pixel_scale)).collect();
        Self { unit, points, selection: selection(&mut Stream::LensSelection.generator(options.seed)) }
    }
}

impl<R: Real> LensPoint<R> {
    /// The point `unit` of an aperture of radius 1, on this lens. Each value is rounded once.
    pub fn new(unit: [f32; 2], lens: Lens, pixel_scale: DVec2) -> Self {
        let p = [0, 1].map(|axis| f64::from(unit[axis]) * lens.radius * pixel_scale[axis]);
        Self { p: p.map(R::from_f64) }
    }
}

/// [`PATTERNS`] patterns of S samples, one after the other, where `place` puts the points of the unit square.
fn patterns(options: &RenderOptions, stream: Stream, place: impl Fn([f64; 2]) -> [f32; 2]) -> Vec<[f32; 2]> {
    let mut random = stream.generator(options.seed);
    let samples = options.samples as usize;
    let pattern = match options.pattern {
        PatternKind::PoissonDisc => poisson::pattern,
        PatternKind::Sobol => sobol::pattern,
        PatternKind::Dealt => return dealt::patterns(samples, place, &mut random),
    };
    (0..PATTERNS).flat_map(|_| pattern(samples, &mut random)).map(place).collect()
}

/// A selection table in which every 8 x 8 block holds each pattern once, in random order. That spreads the patterns
/// more evenly than the listing's independent choice (L27-29), at no cost.
fn selection(random: &mut Pcg32) -> Selection {
    let mut table = Box::new([0; SELECTION_SIZE * SELECTION_SIZE]);
    for block_row in 0..SELECTION_SIZE / BLOCK {
        for block_column in 0..SELECTION_SIZE / BLOCK {
            let mut order: [u8; PATTERNS] = std::array::from_fn(|i| i as u8);
            shuffle(&mut order, random);
            for (i, &number) in order.iter().enumerate() {
                let row = block_row * BLOCK + i / BLOCK;
                let column = block_column * BLOCK + i % BLOCK;
                table[row * SELECTION_SIZE + column] = number;
            }
        }
    }
    table
}

/// Puts a slice into random order (Fisher and Yates).
fn shuffle<T>(items: &mut [T], random: &mut Pcg32) {
    for last in (1..items.len()).rev() {
        items.swap(last, below(last + 1, random));
    }
}

/// A random number in 0..`end`, its bias at most `end` / 2^32.
fn below(end: usize, random: &mut Pcg32) -> usize {
    ((u64::from(random.next_u32()) * end as u64) >> 32) as usize
}

/// A random multiple of 2^-24 in [0, 1).
fn unit(random: &mut Pcg32) -> f64 {
    f64::from(random.next_u32() >> 8) / f64::from(1 << 24)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(options: &RenderOptions) -> SampleTable {
        let lens = Lens { radius: 0.5, focus: 2.0, blades: 0 };
        SampleTable::new(options, Some(lens), DVec2::new(100.0, 50.0))
    }

    #[test]
    fn every_pattern_stands_once_in_every_block() {
        for stream in [Stream::FilterSelection, Stream::LensSelection] {
            let selection = selection(&mut stream.generator(7));
            for block in 0..16 {
                let (row, column) = (block / 4 * BLOCK, block % 4 * BLOCK);
                let mut found: Vec<u8> = (0..PATTERNS)
                    .map(|i| selection[(row + i / BLOCK) * SELECTION_SIZE + column + i % BLOCK])
                    .collect();
                found.sort_unstable();
                assert_eq!(found, (0..PATTERNS as u8).collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn all_samples_are_reachable_and_differ() {
        // Erratum E15: with plain indices only 71 of 512 entries are reachable.
        let options = RenderOptions { samples: 8, ..RenderOptions::default() };
        let table = table(&options);
        let mut seen: Vec<[u32; 2]> = (0..32)
            .flat_map(|y| (0..32).map(move |x| (x, y)))
            .flat_map(|(x, y)| table.jitter(x, y).iter().map(|j| j.map(f32::to_bits)))
            .collect();
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen.len(), PATTERNS * 8);
    }

    #[test]
    fn picture_and_lens_are_not_correlated() {
        // Erratum E16. The correlation of n independent pairs has a standard deviation of 1/sqrt(n).
        let options = RenderOptions { samples: 16, filter: PixelFilter::Box, ..RenderOptions::default() };
        let table = table(&options);
        let pairs: Vec<([f32; 2], [f32; 2])> = (0..32)
            .flat_map(|y| (0..32).map(move |x| (x, y)))
            .flat_map(|(x, y)| table.jitter(x, y).iter().copied().zip(table.unit_lens(x, y).iter().copied()))
            .collect();
        let n = pairs.len() as f64;
        for axis in 0..4 {
            let product = |(j, l): &([f32; 2], [f32; 2])| f64::from((j[axis / 2] - 0.5) * l[axis % 2]);
            let covariance = pairs.iter().map(product).sum::<f64>() / n;
            let correlation = covariance / ((1.0f64 / 12.0).sqrt() * 0.5);
            assert!(correlation.abs() < 5.0 / n.sqrt(), "axis {axis}: {correlation}");
        }
    }

    #[test]
    fn lens_points_are_scaled_to_pixels_at_depth_1() {
        let options = RenderOptions { samples: 3, ..RenderOptions::default() };
        let table = table(&options);
        for (unit, point) in table.unit_lens(5, 9).iter().zip(table.lens(5, 9)) {
            assert_eq!(point.p, [unit[0] * 50.0, unit[1] * 25.0]);
        }
    }
}
