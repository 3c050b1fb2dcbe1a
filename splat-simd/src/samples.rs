//! The samples of a frame in the order in which lanes want them.

use crate::evaluate::LaneLimits;
use crate::lanes::{Eight, Kernel, LANES, Lanes, Level};
use crate::places::{PLACES, pixel_of, place_of};
use splat_core::PixelRect;
use splat_core::distortion::FilmMap;
use splat_core::raster::Rasterizer;
use splat_core::sampling::PATTERNS;

/// The samples of a frame in groups of eight, of which the last may be padded.
#[derive(Debug)]
pub struct LaneSamples {
    samples: usize,
    groups: Vec<GroupSamples>,
    /// For each place of a tile, the numbers of its patterns: of positions, and of lens points.
    patterns: Box<[[u8; 2]; PLACES]>,
}

/// A group of the samples of every pattern.
#[derive(Debug)]
pub struct GroupSamples {
    /// Positions relative to the pixel's corner. Where a lane is no sample they are not numbers, so that it never hits.
    jitter: [[Eight; 2]; PATTERNS],
    /// Lens points, as [`splat_core::evaluate::LensPoint::p`].
    lens: [[Eight; 2]; PATTERNS],
}

impl LaneSamples {
    /// The samples that a frame takes.
    pub fn new(rasterizer: &Rasterizer) -> Self {
        let range = rasterizer.range();
        let samples = rasterizer.samples();
        let group = |group: usize| {
            let number = |lane: usize| {
                let number = range.start + group * LANES + lane;
                (number < range.end).then_some(number)
            };
            let cell = |value: &dyn Fn(usize, usize) -> f32, padding: f32| {
                [0, 1].map(|axis| {
                    std::array::from_fn(|lane| number(lane).map_or(padding, |number| value(number, axis)))
                })
            };
            GroupSamples {
                jitter: std::array::from_fn(|pattern| {
                    let points = samples.jitter_of_pattern(pattern);
                    cell(&|number, axis| points[number][axis], f32::NAN)
                }),
                lens: std::array::from_fn(|pattern| {
                    let points = samples.lens_of_pattern(pattern);
                    cell(&|number, axis| points.get(number).map_or(0.0, |point| point.p[axis]), 0.0)
                }),
            }
        };
        let patterns = |place| {
            let [x, y] = pixel_of(place as u16);
            samples.patterns_of(x, y).map(|pattern| pattern as u8)
        };
        Self {
            samples: range.len(),
            groups: (0..range.len().div_ceil(LANES)).map(group).collect(),
            patterns: Box::new(std::array::from_fn(patterns)),
        }
    }

    /// Number of groups a pixel.
    pub fn groups(&self) -> usize {
        self.groups.len()
    }

    /// Number of samples a pixel.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Number of samples in a group of a pixel.
    pub fn samples_of(&self, group: usize) -> usize {
        LANES.min(self.samples - group * LANES)
    }

    /// The samples of a group.
    #[inline(always)]
    pub fn group(&self, group: usize) -> &GroupSamples {
        &self.groups[group]
    }

    /// For each place of a tile, the numbers of its patterns.
    #[inline(always)]
    pub fn patterns(&self) -> &[[u8; 2]; PLACES] {
        &self.patterns
    }
}

impl GroupSamples {
    /// The positions of a pattern, relative to the pixel's corner.
    #[inline(always)]
    pub fn jitter(&self, [filter, _]: [u8; 2]) -> &[Eight; 2] {
        &self.jitter[usize::from(filter) % PATTERNS]
    }

    /// The lens points of a pattern.
    #[inline(always)]
    pub fn lens(&self, [_, lens]: [u8; 2]) -> &[Eight; 2] {
        &self.lens[usize::from(lens) % PATTERNS]
    }
}

/// The positions of a tile's samples where the lens distorts; else empty. Those of [`GroupSamples`] are then not used.
#[derive(Debug, Default)]
pub struct DistortedSamples {
    /// For each place, the pixel of the ideal picture from whose corner its samples are counted.
    corners: Vec<[i32; 2]>,
    /// By group, then by place: positions relative to that. Not numbers where a lane sees nothing, or is no sample.
    jitter: Vec<[Eight; 2]>,
}

impl DistortedSamples {
    /// Takes those of the pixels of `region`, which lies within one tile; the others are left undefined.
    pub fn fill(&mut self, rasterizer: &Rasterizer, region: &PixelRect, level: Level) {
        // There may be some of a picture before.
        self.corners.clear();
        if let Some(map) = rasterizer.distortion() {
            level.run(FillJob { samples: self, map, rasterizer, region });
        }
    }

    #[inline(always)]
    fn fill_by(&mut self, map: &FilmMap, rasterizer: &Rasterizer, region: &PixelRect) {
        let range = rasterizer.range();
        let groups = range.len().div_ceil(LANES);
        self.corners.resize(PLACES, [0; 2]);
        self.jitter.resize(groups * PLACES, [[f32::NAN; LANES]; 2]);
        for y in region.y0..region.y1 {
            for x in region.x0..region.x1 {
                let place = usize::from(place_of(x, y));
                let pixel = map.pixel(x, y);
                self.corners[place] = pixel.map_or([x, y], |pixel| pixel.corner);
                let film = &rasterizer.samples().jitter(x, y)[range.clone()];
                for (group, film) in film.chunks(LANES).enumerate() {
                    let mut lanes = [[f32::NAN; LANES]; 2];
                    for (lane, &film) in film.iter().enumerate() {
                        [lanes[0][lane], lanes[1][lane]] = film;
                    }
                    self.jitter[group * PLACES + place] = match &pixel {
                        Some(pixel) => pixel.samples(&lanes),
                        None => [[f32::NAN; LANES]; 2],
                    };
                }
            }
        }
    }

    /// Whether the samples lie where [`GroupSamples`] has them.
    pub fn is_empty(&self) -> bool {
        self.corners.is_empty()
    }

    /// Corner and position of the samples of a group in a place.
    #[inline(always)]
    pub fn of(&self, group: usize, place: u16) -> ([i32; 2], &[Eight; 2]) {
        let place = usize::from(place);
        (self.corners[place], &self.jitter[group * PLACES + place])
    }
}

/// [`DistortedSamples::fill`] with the instructions of a level.
struct FillJob<'a> {
    samples: &'a mut DistortedSamples,
    map: &'a FilmMap,
    rasterizer: &'a Rasterizer,
    region: &'a PixelRect,
}

impl Kernel for FillJob<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        self.samples.fill_by(self.map, self.rasterizer, self.region);
    }
}

/// The limits of a frame, in lanes.
#[inline(always)]
pub fn limits<L: Lanes>(rasterizer: &Rasterizer) -> LaneLimits<L> {
    LaneLimits::new(rasterizer.limits())
}
