//! From splats to fragments: the eight samples of a cell against one splat at a time.

use crate::evaluate::{LaneHits, LaneLimits, LaneSplat};
use crate::lanes::{Kernel, LANES, Lanes, prefetch};
use crate::places::PlaceList;
use crate::records::{Hits, Page, RecordBuffer};
use crate::samples::{LaneSamples, limits};
use splat_abuffer::SplatSurface;
use splat_core::PixelRect;
use splat_core::kernel::{KernelTable, Polynomials};
use splat_core::raster::{Form, Rasterizer};
use splat_core::setup::VisibleSplat;

/// How many splats ahead of the one at work the next ones are fetched.
const AHEAD: usize = 6;

/// What is the same for all regions of a frame.
#[derive(Debug, Clone, Copy)]
pub struct RasterFrame<'a> {
    /// The samples and the kernel.
    pub rasterizer: &'a Rasterizer,
    /// The samples, in lanes.
    pub samples: &'a LaneSamples,
    /// All splats, by rank.
    pub splats: &'a [VisibleSplat],
    /// What the fragments of each share, by rank.
    pub surfaces: &'a [SplatSurface],
    /// Radius of the pixel filter, in pixels.
    pub filter_radius: f32,
}

/// Rasterises some splats over a region, which lies within one tile, until the buffer takes no more. Gives the number of
/// samples tested.
#[derive(Debug)]
pub struct RasterJob<'a> {
    /// The frame.
    pub frame: RasterFrame<'a>,
    /// The ranks of the splats, in splat order.
    pub ranks: &'a [u32],
    /// The pixels.
    pub region: PixelRect,
    /// Where the fragments go.
    pub records: &'a mut RecordBuffer,
    /// Scratch.
    pub places: &'a mut PlaceList,
}

impl Kernel for RasterJob<'_> {
    type Output = u64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> u64 {
        // A copy of the loop for each form of the evaluation and each way to read the table: nothing is decided inside.
        let table = self.frame.rasterizer.table();
        match table.polynomials() {
            None => self.with_table::<L, _>(table),
            Some(polynomials) => match polynomials.degree {
                2 => self.with_table::<L, _>(&OfDegree::<2>(polynomials)),
                3 => self.with_table::<L, _>(&OfDegree::<3>(polynomials)),
                _ => self.with_table::<L, _>(&OfDegree::<4>(polynomials)),
            },
        }
    }
}

// The forms of the evaluation, as constants to specialise by.
const PINHOLE: u8 = 0;
const THIN_LENS: u8 = 1;
const ORTHOGRAPHIC: u8 = 2;

impl RasterJob<'_> {
    #[inline(always)]
    fn with_table<L: Lanes, T: LaneTable>(self, table: &T) -> u64 {
        match self.frame.rasterizer.form() {
            Form::Pinhole => self.rasterize::<L, T, PINHOLE>(table),
            Form::ThinLens => self.rasterize::<L, T, THIN_LENS>(table),
            Form::Orthographic => self.rasterize::<L, T, ORTHOGRAPHIC>(table),
        }
    }

    #[inline(always)]
    fn rasterize<L: Lanes, T: LaneTable, const FORM: u8>(self, table: &T) -> u64 {
        let Self { frame, ranks, region, records, places } = self;
        let mut tests = 0;
        for (i, &rank) in ranks.iter().enumerate() {
            if let Some(&next) = ranks.get(i + AHEAD) {
                prefetch(&frame.splats[next as usize]);
                prefetch(&frame.surfaces[next as usize]);
            }
            let splat = &frame.splats[rank as usize];
            places.fill::<L>(splat, &region, frame.filter_radius);
            let cells = places.places().len() * frame.samples.groups();
            let Some(page) = records.begin(rank, &frame.surfaces[rank as usize], cells) else { break };
            tests += (places.places().len() * frame.samples.samples()) as u64;
            let splat = Evaluation::<L, T>::new(&frame, splat, table);
            if splat.splat.plain {
                splat.rasterize::<FORM, true>(places, page);
            } else {
                splat.rasterize::<FORM, false>(places, page);
            }
        }
        tests
    }
}

/// A group of the samples of a pixel: its place in its tile, and the group's number.
type Cell = (u16, usize);

/// A splat ready to be evaluated in a frame.
struct Evaluation<'a, L, T> {
    samples: &'a LaneSamples,
    splat: &'a VisibleSplat,
    table: &'a T,
    culls: bool,
    lane_splat: LaneSplat<L>,
    limits: LaneLimits<L>,
    /// Added: that can come from memory.
    minus_fraction: [L; 2],
    weight_scale: L,
}

impl<'a, L: Lanes, T: LaneTable> Evaluation<'a, L, T> {
    #[inline(always)]
    fn new(frame: &RasterFrame<'a>, splat: &'a VisibleSplat, table: &'a T) -> Self {
        Self {
            samples: frame.samples,
            splat,
            table,
            culls: frame.rasterizer.culls(),
            lane_splat: LaneSplat::new(&splat.constants),
            limits: limits(frame.rasterizer),
            minus_fraction: [L::splat(-splat.constants.xf), L::splat(-splat.constants.yf)],
            weight_scale: L::splat(splat.weight_scale),
        }
    }

    /// Tests all samples of a list of pixels. `PLAIN` is that of the splat, here and below.
    #[inline(always)]
    fn rasterize<const FORM: u8, const PLAIN: bool>(&self, list: &PlaceList, mut page: Page<'_>) {
        let groups = self.samples.groups();
        if groups == 1 {
            let mut pairs = list.places().chunks_exact(L::CELLS);
            for places in &mut pairs {
                if L::CELLS == 2 {
                    self.test::<FORM, PLAIN, true>(list, [(places[0], 0), (places[1], 0)], 1, &mut page);
                } else {
                    self.test::<FORM, PLAIN, false>(list, [(places[0], 0); 2], 1, &mut page);
                }
            }
            if let [place] = pairs.remainder() {
                self.test::<FORM, PLAIN, false>(list, [(*place, 0); 2], 1, &mut page);
            }
        } else {
            for &place in list.places() {
                for group in (0..groups).step_by(L::CELLS) {
                    if L::CELLS == 2 && group + 1 < groups {
                        let cells = [(place, group), (place, group + 1)];
                        self.test::<FORM, PLAIN, true>(list, cells, groups, &mut page);
                    } else {
                        self.test::<FORM, PLAIN, false>(list, [(place, group); 2], groups, &mut page);
                    }
                }
            }
        }
        page.close();
    }

    /// Tests the samples of a cell, or if `BOTH` of two.
    #[inline(always)]
    fn test<const FORM: u8, const PLAIN: bool, const BOTH: bool>(
        &self,
        list: &PlaceList,
        cells: [Cell; 2],
        groups: usize,
        page: &mut Page<'_>,
    ) {
        let hits = self.evaluate::<FORM, PLAIN>(list, cells);
        let weight = self.weight_scale * self.table.kernel(hits.r2, hits.missed);
        let missed = hits.missed | L::splat(0.0).not_less(weight);
        let numbers = [
            usize::from(cells[0].0) * groups + cells[0].1,
            usize::from(cells[1].0) * groups + cells[1].1,
        ];
        let (back, depth) = (self.splat.back, hits.depth);
        if FORM != THIN_LENS {
            put::<L, BOTH>(page, numbers, back, &Hits { missed, depth, weight });
            return;
        }
        // A lens may see both sides.
        let flipped = if self.splat.flips { hits.flipped.and_not(missed) } else { L::splat(0.0) };
        if flipped.bits() != 0 && !(self.culls && !back) {
            let missed = L::splat(0.0).or_not(flipped);
            put::<L, BOTH>(page, numbers, !back, &Hits { missed, depth, weight });
        }
        if !(self.culls && back) {
            put::<L, BOTH>(page, numbers, back, &Hits { missed: missed | flipped, depth, weight });
        }
    }

    /// The hits in one cell (given twice), or in two.
    #[inline(always)]
    fn evaluate<const FORM: u8, const PLAIN: bool>(&self, list: &PlaceList, cells: [Cell; 2]) -> LaneHits<L> {
        let [first, second] = cells;
        let (jitter_a, jitter_b) =
            (self.samples.jitter(first.0, first.1), self.samples.jitter(second.0, second.1));
        let (offset_a, offset_b) = (list.offset(first.0), list.offset(second.0));
        let jitter = [
            L::load_cells(&jitter_a[0], &jitter_b[0]) + self.minus_fraction[0],
            L::load_cells(&jitter_a[1], &jitter_b[1]) + self.minus_fraction[1],
        ];
        let d = [
            L::splat_cells(offset_a[0], offset_b[0]) + jitter[0],
            L::splat_cells(offset_a[1], offset_b[1]) + jitter[1],
        ];
        match FORM {
            PINHOLE => self.lane_splat.pinhole::<PLAIN>(d, &self.limits),
            THIN_LENS => {
                let (a, b) = (self.samples.lens(first.0, first.1), self.samples.lens(second.0, second.1));
                let p = [L::load_cells(&a[0], &b[0]), L::load_cells(&a[1], &b[1])];
                self.lane_splat.thin_lens::<PLAIN>(d, p, &self.limits)
            }
            _ => self.lane_splat.orthographic(d, &self.limits),
        }
    }
}

/// Puts the hits of one cell, or if `BOTH` of two, on a page.
#[inline(always)]
fn put<L: Lanes, const BOTH: bool>(page: &mut Page<'_>, cells: [usize; 2], back: bool, hits: &Hits<L>) {
    page.put::<L, 0>(cells[0], back, hits);
    if BOTH {
        page.put::<L, 1>(cells[1], back, hits);
    }
}

/// A table of the kernel that lanes can read.
trait LaneTable {
    /// [`KernelTable::weight`] for a sample a lane; arbitrary where `missed` is set.
    fn kernel<L: Lanes>(&self, r2: L, missed: L) -> L;
}

/// Polynomials of this degree.
struct OfDegree<'a, const DEGREE: usize>(&'a Polynomials);

impl<const DEGREE: usize> LaneTable for OfDegree<'_, DEGREE> {
    #[inline(always)]
    fn kernel<L: Lanes>(&self, r2: L, _: L) -> L {
        let x = r2 * L::splat(self.0.scale);
        let bin = x.to_index();
        let coefficients = &self.0.coefficients;
        let mut value = L::look_up(&coefficients[DEGREE], bin);
        for power in (0..DEGREE).rev() {
            value = value * x + L::look_up(&coefficients[power], bin);
        }
        value
    }
}

impl LaneTable for KernelTable {
    #[inline(always)]
    fn kernel<L: Lanes>(&self, r2: L, missed: L) -> L {
        let mut values = [[0.0; LANES]; 2];
        r2.store_cell::<0>(&mut values[0]);
        if L::CELLS == 2 {
            r2.store_cell::<1>(&mut values[1]);
        }
        let misses = missed.bits();
        for (lane, value) in values.as_flattened_mut().iter_mut().enumerate().take(LANES * L::CELLS) {
            *value = if misses >> lane & 1 == 0 { self.weight(*value) } else { 0.0 };
        }
        L::load_cells(&values[0], &values[1])
    }
}
