//! From splats to fragments: the eight samples of a cell against one splat at a time.

use crate::evaluate::{LaneHits, LaneLimits, LaneSplat};
use crate::interval_bounds::IntervalBounds;
use crate::lanes::{Eight, Kernel, LANES, Lanes, prefetch};
use crate::lattice::{CellList, Lattice};
use crate::places::{Apart, PLACES, PlaceList, TILE, clip as clip_hits};
use crate::records::{Key, Page, Record, RecordBuffer};
use crate::samples::{DistortedSamples, GroupSamples, LaneSamples, limits};
use crate::surface_sums::{COLOR, GREY, Line, SurfaceSums, add_weights};
use crate::table::{LaneTable, TableKernel, with_table};
use splat_abuffer::SplatSurface;
use splat_core::PixelRect;
use splat_core::raster::{Form, Rasterizer};
use splat_core::render::Frame;
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

impl<'a> RasterFrame<'a> {
    /// A frame with its samples in lanes.
    pub fn new(frame: &'a Frame, samples: &'a LaneSamples) -> Self {
        Self {
            rasterizer: &frame.rasterizer,
            samples,
            splats: &frame.set_up.splats,
            surfaces: &frame.set_up.surfaces,
            filter_radius: frame.view.filter_radius as f32,
        }
    }

    /// Asks for a splat that comes soon after number `i` of a list.
    #[inline(always)]
    pub fn fetch_ahead(&self, ranks: &[u32], i: usize) {
        if let Some(&next) = ranks.get(i + AHEAD) {
            prefetch(&self.splats[next as usize]);
            prefetch(&self.surfaces[next as usize]);
        }
    }
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
    /// The positions of the region's samples, if the lens distorts.
    pub distorted: &'a DistortedSamples,
    /// What becomes of the fragments.
    pub target: Target<'a>,
}

/// What becomes of the fragments of a region.
#[derive(Debug)]
pub enum Target<'a> {
    /// They stay in the record buffer.
    Records,
    /// They are summed, and the buffer forgets them.
    Sums(&'a mut SurfaceSums),
    /// Those of the layered cells of these sums stay in the record buffer.
    Layered(&'a SurfaceSums),
}

impl Kernel for RasterJob<'_> {
    type Output = u64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> u64 {
        with_table::<L, _>(self.frame.rasterizer.table(), self)
    }
}

// The forms of the evaluation, as constants to specialise by.
const PINHOLE: u8 = 0;
const THIN_LENS: u8 = 1;
const ORTHOGRAPHIC: u8 = 2;
// The first two where the lens distorts.
const DISTORTED_PINHOLE: u8 = 3;
const DISTORTED_THIN_LENS: u8 = 4;

/// Whether a form needs lens points.
const fn has_lens(form: u8) -> bool {
    matches!(form, THIN_LENS | DISTORTED_THIN_LENS)
}

/// Whether a form takes its positions from [`DistortedSamples`].
const fn is_distorted(form: u8) -> bool {
    matches!(form, DISTORTED_PINHOLE | DISTORTED_THIN_LENS)
}

// Which hits are taken: those of lens points on the eye's side of the splat's plane, of the others, or of all.
const ANY_SIDE: u8 = 0;
const SAME_SIDE: u8 = 1;
const OTHER_SIDE: u8 = 2;

impl TableKernel for RasterJob<'_> {
    type Output = u64;

    #[inline(always)]
    fn run<L: Lanes, T: LaneTable>(self, table: &T) -> u64 {
        match (self.frame.rasterizer.form(), self.distorted.is_empty()) {
            (Form::Pinhole, true) => self.rasterize::<L, T, PINHOLE>(table),
            (Form::ThinLens, true) => self.rasterize::<L, T, THIN_LENS>(table),
            (Form::Pinhole, false) => self.rasterize::<L, T, DISTORTED_PINHOLE>(table),
            (Form::ThinLens, false) => self.rasterize::<L, T, DISTORTED_THIN_LENS>(table),
            (Form::Orthographic, _) => self.rasterize::<L, T, ORTHOGRAPHIC>(table),
        }
    }
}

impl RasterJob<'_> {
    #[inline(always)]
    fn rasterize<L: Lanes, T: LaneTable, const FORM: u8>(self, table: &T) -> u64 {
        let Self { frame, ranks, region, records, places, distorted, mut target } = self;
        let mut tests = 0;
        for (i, &rank) in ranks.iter().enumerate() {
            frame.fetch_ahead(ranks, i);
            let splat = &frame.splats[rank as usize];
            places.fill::<L>(splat, &region, frame.filter_radius);
            if let Target::Layered(sums) = &target {
                places.retain(|place| sums.is_layered(place.into()));
            }
            let surface = &frame.surfaces[rank as usize];
            if FORM == PINHOLE
                && splat.plain
                && let Target::Sums(sums) = &mut target
                && IntervalBounds::suit(splat, surface, frame.filter_radius)
            {
                tests += (places.places().len() * frame.samples.samples()) as u64;
                sums.bounds.add::<L::Single>(splat, surface, places, frame.filter_radius);
                let splat = Evaluation::<L, T>::new(&frame, splat, table);
                records.fragments += u64::from(splat.sum_plain(places, surface, sums));
                continue;
            }
            let cells = places.places().len() * frame.samples.groups();
            let Some(mut page) = records.begin(rank, surface, cells) else { break };
            tests += (places.places().len() * frame.samples.samples()) as u64;
            let splat = Evaluation::<L, T>::new(&frame, splat, table);
            // With distortion none is plain.
            if splat.splat.plain && !is_distorted(FORM) {
                splat.rasterize::<FORM, true>(places, distorted, &mut page);
            } else {
                splat.rasterize::<FORM, false>(places, distorted, &mut page);
            }
            splat.finish(page, surface, &mut target);
        }
        tests
    }
}

/// [`RasterJob`] by lens points: for a frame with a lens.
#[derive(Debug)]
pub struct LatticeJob<'a> {
    /// As [`RasterJob::frame`].
    pub frame: RasterFrame<'a>,
    /// The cells.
    pub lattice: &'a Lattice,
    /// As [`RasterJob::ranks`].
    pub ranks: &'a [u32],
    /// The pixels; they lie within one tile.
    pub region: PixelRect,
    /// Where the fragments go.
    pub records: &'a mut RecordBuffer,
    /// Scratch.
    pub cells: &'a mut CellList,
}

impl Kernel for LatticeJob<'_> {
    type Output = u64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> u64 {
        with_table::<L, _>(self.frame.rasterizer.table(), self)
    }
}

impl TableKernel for LatticeJob<'_> {
    type Output = u64;

    #[inline(always)]
    fn run<L: Lanes, T: LaneTable>(self, table: &T) -> u64 {
        let Self { frame, lattice, ranks, region, records, cells } = self;
        let corner = [region.x0 & !(TILE - 1), region.y0 & !(TILE - 1)];
        let partial = region.area() < PLACES;
        let mut tests = 0;
        for (i, &rank) in ranks.iter().enumerate() {
            frame.fetch_ahead(ranks, i);
            let splat = &frame.splats[rank as usize];
            lattice.list::<L>(splat, corner, cells);
            let surface = &frame.surfaces[rank as usize];
            let Some(mut page) = records.begin(rank, surface, cells.cells().len()) else { break };
            tests += (cells.cells().len() * LANES) as u64;
            let clip = partial.then_some(&region);
            let splat = Evaluation::<L, T>::new(&frame, splat, table);
            if splat.splat.plain {
                splat.rasterize_cells::<true>(lattice, cells.cells(), corner, clip, &mut page);
            } else {
                splat.rasterize_cells::<false>(lattice, cells.cells(), corner, clip, &mut page);
            }
            splat.finish(page, surface, &mut Target::Records);
        }
        tests
    }
}

/// A splat ready to be evaluated in a frame.
pub struct Evaluation<'a, L, T> {
    samples: &'a LaneSamples,
    /// The splat.
    pub splat: &'a VisibleSplat,
    table: &'a T,
    /// Whether backs are not drawn.
    pub culls: bool,
    /// The splat in lanes.
    pub lane_splat: LaneSplat<L>,
    /// What is a hit.
    pub limits: LaneLimits<L>,
    /// Minus the fraction of the splat's position. (Added: that can come from memory.)
    pub minus_fraction: [L; 2],
    weight_scale: L,
}

impl<'a, L: Lanes, T: LaneTable> Evaluation<'a, L, T> {
    /// A splat of a frame.
    #[inline(always)]
    pub fn new(frame: &RasterFrame<'a>, splat: &'a VisibleSplat, table: &'a T) -> Self {
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
    fn rasterize<const FORM: u8, const PLAIN: bool>(
        &self,
        list: &PlaceList,
        distorted: &DistortedSamples,
        page: &mut Page<'_>,
    ) {
        let back = self.splat.back;
        if has_lens(FORM) && self.splat.flips {
            // Once for each side: few splats stand so that the lens sees both.
            if !(self.culls && back) {
                self.side::<FORM, PLAIN, true, SAME_SIDE>(list, distorted, page, back);
            }
            if back || !self.culls {
                self.side::<FORM, PLAIN, true, OTHER_SIDE>(list, distorted, page, !back);
            }
        } else if has_lens(FORM) && !(self.culls && back) {
            self.side::<FORM, PLAIN, true, ANY_SIDE>(list, distorted, page, back);
        } else if !has_lens(FORM) {
            self.side::<FORM, PLAIN, false, ANY_SIDE>(list, distorted, page, back);
        }
    }

    /// Tests the samples of a list of cells of a tile, given by its first pixel; of the pixels of `clip` alone, if given.
    #[inline(always)]
    fn rasterize_cells<const PLAIN: bool>(
        &self,
        lattice: &Lattice,
        cells: &[u32],
        corner: [i32; 2],
        clip: Option<&PixelRect>,
        page: &mut Page<'_>,
    ) {
        let apart = Apart::new(self.splat, corner);
        let ordinary = clip.is_none() && !self.splat.flips && matches!(apart, Apart::Near(_));
        if ordinary {
            if !(self.culls && self.splat.back) {
                for &cell in cells {
                    let hits = self.cell_hits::<PLAIN>(lattice, cell, &apart);
                    page.put(cell, self.splat.back, &hits);
                }
            }
        } else {
            for &cell in cells {
                let mut hits = self.cell_hits::<PLAIN>(lattice, cell, &apart);
                if let Some(region) = clip {
                    clip_hits(lattice.pixels(cell), corner, region, &mut hits);
                }
                self.put_sides(cell, hits, page);
            }
        }
    }

    /// The hits in a cell of a lattice.
    #[inline(always)]
    fn cell_hits<const PLAIN: bool>(&self, lattice: &Lattice, cell: u32, apart: &Apart<L>) -> LaneHits<L> {
        let (d, p) = lattice.offset(cell, apart, &self.minus_fraction);
        self.lane_splat.thin_lens::<PLAIN>(d, p, &self.limits)
    }

    /// Puts the hits of a cell, front and back apart, on a page.
    #[inline(always)]
    fn put_sides(&self, cell: u32, mut hits: LaneHits<L>, page: &mut Page<'_>) {
        let back = self.splat.back;
        if self.splat.flips {
            let others = LaneHits { missed: hits.missed.or_not(hits.flipped), ..hits };
            hits.missed = hits.missed | hits.flipped;
            if back || !self.culls {
                page.put(cell, !back, &others);
            }
        }
        if !(self.culls && back) {
            page.put(cell, back, &hits);
        }
    }

    /// Adds the hits in a list of pixels to the sums of their cells: for a plain splat before a pinhole. Returns the number of
    /// fragments.
    #[inline(always)]
    fn sum_plain(&self, list: &PlaceList, surface: &SplatSurface, sums: &mut SurfaceSums) -> u32 {
        if sums.is_grey() {
            self.sum_plain_to(list, surface, sums.cells_mut::<GREY>())
        } else {
            self.sum_plain_to(list, surface, sums.cells_mut::<COLOR>())
        }
    }

    /// [`Self::sum_plain`] to cells of `LINES` lines.
    ///
    /// In two loops, each so short that the processor sees several of its turns at once.
    #[inline(always)]
    fn sum_plain_to<const LINES: usize>(
        &self,
        list: &PlaceList,
        surface: &SplatSurface,
        (cells, squares): (&mut [[Line; LINES]], &mut [Eight]),
    ) -> u32 {
        let squares = &mut squares[..list.places().len()];
        let mut misses = [L::splat(0.0); 2];
        for group in 0..self.samples.groups() {
            self.square_places(list, group, squares);
            let cells = &mut cells[group * PLACES..][..PLACES];
            self.sum_places(list.places(), squares, surface, cells, &mut misses);
        }
        let [misses, last_misses] = misses;
        Self::count_hits(squares.len() * self.samples.groups(), misses, last_misses)
    }

    /// The squares of (u, v) in a group of samples of some places; not numbers where the splat is not hit.
    #[inline(always)]
    fn square_places(&self, list: &PlaceList, group: usize, squares: &mut [Eight]) {
        let source = Source {
            list,
            patterns: self.samples.patterns(),
            samples: self.samples.group(group),
            distorted: &DistortedSamples::default(),
            group,
            center: [self.splat.constants.xi, self.splat.constants.yi],
        };
        let (pairs, last) = list.places().as_chunks::<2>();
        let (pair_squares, last_square) = squares.as_chunks_mut::<2>();
        for (&[a, b], [first, second]) in pairs.iter().zip(pair_squares) {
            if L::CELLS == 2 {
                let squares = self.square_plain(&source, [a, b]);
                squares.store_cell::<0>(first);
                squares.store_cell::<1>(second);
            } else {
                self.square_plain(&source, [a; 2]).store_cell::<0>(first);
                self.square_plain(&source, [b; 2]).store_cell::<0>(second);
            }
        }
        if let (&[place], [square]) = (last, last_square) {
            self.square_plain(&source, [place; 2]).store_cell::<0>(square);
        }
    }

    /// Adds hits in some places, given by the squares of (u, v), to the sums of their cells, and to `misses` where there is none:
    /// in pairs of places, and in the last one.
    #[inline(always)]
    fn sum_places<const LINES: usize>(
        &self,
        places: &[u16],
        squares: &[Eight],
        surface: &SplatSurface,
        cells: &mut [[Line; LINES]],
        [misses, last_misses]: &mut [L; 2],
    ) {
        let (pairs, last) = places.as_chunks::<2>();
        let (pair_squares, last_square) = squares.as_chunks::<2>();
        for (&[a, b], [first, second]) in pairs.iter().zip(pair_squares) {
            let [a, b] = [usize::from(a), usize::from(b)];
            if L::CELLS == 2 {
                let weight = self.weights(L::load_cells(first, second), misses);
                add_weights(cells, [a, b], weight, surface.color);
            } else {
                let weight = self.weights(L::load(first), misses);
                add_weights(cells, [a; 2], weight, surface.color);
                let weight = self.weights(L::load(second), misses);
                add_weights(cells, [b; 2], weight, surface.color);
            }
        }
        if let (&[place], [square]) = (last, last_square) {
            let weight = self.weights(L::load(square), last_misses);
            add_weights(cells, [usize::from(place); 2], weight, surface.color);
        }
    }

    /// The squares of (u, v) of a plain splat before a pinhole in one place (given twice), or in two; not numbers where it is
    /// not hit.
    #[inline(always)]
    fn square_plain(&self, source: &Source<'_>, places: [u16; 2]) -> L {
        let hits = self.evaluate::<PINHOLE, true>(source, places);
        hits.r2 | hits.missed
    }

    /// Weights of hits, 0 where there is none (where the square of (u, v) is not a number). Adds to `misses` where there is none.
    #[inline(always)]
    fn weights(&self, r2: L, misses: &mut L) -> L {
        let missed = r2.not_less_or_equal(L::splat(f32::INFINITY));
        let weight = self.weight_scale * self.table.kernel(r2, missed);
        // Not a number where it is not hit.
        let missed = L::splat(0.0).not_less(weight);
        *misses = *misses + (missed & L::splat(1.0));
        weight.and_not(missed)
    }

    /// Makes fragments of the hits of a page.
    #[inline(always)]
    fn finish(&self, mut page: Page<'_>, surface: &SplatSurface, target: &mut Target<'_>) {
        let fragments = match target {
            Target::Sums(sums) => self.sum(&page, surface, sums),
            Target::Records | Target::Layered(_) => self.weigh(page.records()),
        };
        page.close(fragments);
    }

    /// Adds the hits of a page to the sums of their cells. Returns the number of fragments.
    #[inline(always)]
    fn sum(&self, page: &Page<'_>, surface: &SplatSurface, sums: &mut SurfaceSums) -> u32 {
        sums.need_ends();
        let (records, keys) = page.records_and_keys();
        let (mut misses, mut last_misses) = (L::splat(0.0), L::splat(0.0));
        let (pairs, last) = records.as_chunks::<2>();
        let (pair_keys, last_key) = keys.as_chunks::<2>();
        for ([first, second], keys) in pairs.iter().zip(pair_keys) {
            let [a, b] = keys.map(Key::list);
            if L::CELLS == 2 {
                self.sum_cells([first, second], [a, b], surface, sums, &mut misses);
            } else {
                self.sum_cells([first; 2], [a; 2], surface, sums, &mut misses);
                self.sum_cells([second; 2], [b; 2], surface, sums, &mut misses);
            }
        }
        if let ([record], [key]) = (last, last_key) {
            self.sum_cells([record; 2], [key.list(); 2], surface, sums, &mut last_misses);
        }
        Self::count_hits(records.len(), misses, last_misses)
    }

    /// [`Self::sum`] for one record (given twice), or for two.
    #[inline(always)]
    fn sum_cells(
        &self,
        [first, second]: [&Record; 2],
        cells: [usize; 2],
        surface: &SplatSurface,
        sums: &mut SurfaceSums,
        misses: &mut L,
    ) {
        let depth = L::load_cells(&first.depth, &second.depth);
        let r2 = L::load_cells(&first.weight, &second.weight);
        let (depth, weight) = self.weighed(depth, r2, misses);
        sums.add(cells, depth, weight, surface);
    }

    /// The number of hits in some records, given the misses in each lane: in pairs of records, and in the last one, of which
    /// the first cell counts. Exact as long as a splat has fewer than 2^24 records.
    #[inline(always)]
    fn count_hits(records: usize, misses: L, last_misses: L) -> u32 {
        let mut counts = [[0.0; LANES]; 3];
        misses.store_cell::<0>(&mut counts[0]);
        if L::CELLS == 2 {
            misses.store_cell::<1>(&mut counts[1]);
        }
        last_misses.store_cell::<0>(&mut counts[2]);
        let counts: Eight = std::array::from_fn(|lane| counts[0][lane] + counts[1][lane] + counts[2][lane]);
        (records * LANES) as u32 - counts.iter().sum::<f32>() as u32
    }

    /// Turns the r2 of some records into weights, and drops what weighs nothing. Returns the number of fragments left.
    ///
    /// Not at once where the hits are found: this way neither loop is so long that the processor sees only one cell of it
    /// at a time.
    #[inline(always)]
    fn weigh(&self, records: &mut [Record]) -> u32 {
        let count = records.len();
        let (mut misses, mut last_misses) = (L::splat(0.0), L::splat(0.0));
        let (pairs, last) = records.as_chunks_mut::<2>();
        if L::CELLS == 2 {
            for [first, second] in pairs {
                let depth = L::load_cells(&first.depth, &second.depth);
                let weight = L::load_cells(&first.weight, &second.weight);
                let (depth, weight) = self.weighed(depth, weight, &mut misses);
                depth.store_cell::<0>(&mut first.depth);
                depth.store_cell::<1>(&mut second.depth);
                weight.store_cell::<0>(&mut first.weight);
                weight.store_cell::<1>(&mut second.weight);
            }
        } else {
            for [first, second] in pairs {
                self.weigh_one(first, &mut misses);
                self.weigh_one(second, &mut misses);
            }
        }
        if let [record] = last {
            self.weigh_one(record, &mut last_misses);
        }
        Self::count_hits(count, misses, last_misses)
    }

    /// [`Self::weigh`] for one record.
    #[inline(always)]
    fn weigh_one(&self, record: &mut Record, misses: &mut L) {
        let (depth, weight) = self.weighed(L::load(&record.depth), L::load(&record.weight), misses);
        depth.store_cell::<0>(&mut record.depth);
        weight.store_cell::<0>(&mut record.weight);
    }

    /// Depth and weight, given depths (not numbers where there is none) and r2. Adds to `misses` where there is none.
    #[inline(always)]
    pub fn weighed(&self, depth: L, r2: L, misses: &mut L) -> (L, L) {
        let missed = depth.not_less_or_equal(L::splat(f32::INFINITY));
        let weight = self.weight_scale * self.table.kernel(r2, missed);
        let missed = missed | L::splat(0.0).not_less(weight);
        *misses = *misses + (missed & L::splat(1.0));
        (depth | missed, weight.and_not(missed))
    }

    /// Tests all samples of a list of pixels, and takes the hits of `SIDE`, which see the back of the splat or its front.
    #[inline(always)]
    fn side<const FORM: u8, const PLAIN: bool, const SPARSE: bool, const SIDE: u8>(
        &self,
        list: &PlaceList,
        distorted: &DistortedSamples,
        page: &mut Page<'_>,
        back: bool,
    ) {
        let patterns = self.samples.patterns();
        let center = [self.splat.constants.xi, self.splat.constants.yi];
        for group in 0..self.samples.groups() {
            let samples = self.samples.group(group);
            let source = Source { list, patterns, samples, distorted, group, center };
            let mut column = page.column(group, back, list.places().len());
            let (pairs, last) = list.places().as_chunks::<2>();
            if L::CELLS == 2 {
                for &places in pairs {
                    let hits = self.hits::<FORM, PLAIN, SIDE>(&source, places);
                    column.put::<L, SPARSE, 0>(places[0], &hits);
                    column.put::<L, SPARSE, 1>(places[1], &hits);
                }
                if let &[place] = last {
                    let hits = self.hits::<FORM, PLAIN, SIDE>(&source, [place; 2]);
                    column.put::<L, SPARSE, 0>(place, &hits);
                }
            } else {
                for &place in list.places() {
                    let hits = self.hits::<FORM, PLAIN, SIDE>(&source, [place; 2]);
                    column.put::<L, SPARSE, 0>(place, &hits);
                }
            }
            column.close();
        }
    }

    /// The hits of `SIDE` in one place (given twice), or in two.
    #[inline(always)]
    fn hits<const FORM: u8, const PLAIN: bool, const SIDE: u8>(
        &self,
        source: &Source<'_>,
        places: [u16; 2],
    ) -> LaneHits<L> {
        let mut hits = self.evaluate::<FORM, PLAIN>(source, places);
        match SIDE {
            SAME_SIDE => hits.missed = hits.missed | hits.flipped,
            OTHER_SIDE => hits.missed = hits.missed.or_not(hits.flipped),
            _ => {}
        }
        hits
    }

    /// The hits in one place (given twice), or in two.
    #[inline(always)]
    fn evaluate<const FORM: u8, const PLAIN: bool>(
        &self,
        source: &Source<'_>,
        [first, second]: [u16; 2],
    ) -> LaneHits<L> {
        let (offset_a, jitter_a) = source.position::<FORM>(first);
        let (offset_b, jitter_b) = source.position::<FORM>(second);
        let jitter = [
            L::load_cells(&jitter_a[0], &jitter_b[0]) + self.minus_fraction[0],
            L::load_cells(&jitter_a[1], &jitter_b[1]) + self.minus_fraction[1],
        ];
        let d = [
            L::splat_cells(offset_a[0], offset_b[0]) + jitter[0],
            L::splat_cells(offset_a[1], offset_b[1]) + jitter[1],
        ];
        match FORM {
            PINHOLE | DISTORTED_PINHOLE => self.lane_splat.pinhole::<PLAIN>(d, &self.limits),
            THIN_LENS | DISTORTED_THIN_LENS => {
                let (a, b) = (source.lens(first), source.lens(second));
                let p = [L::load_cells(&a[0], &b[0]), L::load_cells(&a[1], &b[1])];
                self.lane_splat.thin_lens::<PLAIN>(d, p, &self.limits)
            }
            _ => self.lane_splat.orthographic(d, &self.limits),
        }
    }
}

/// Where the samples of a group are found.
struct Source<'a> {
    list: &'a PlaceList,
    patterns: &'a [[u8; 2]; PLACES],
    samples: &'a GroupSamples,
    distorted: &'a DistortedSamples,
    group: usize,
    /// The splat's pixel.
    center: [i32; 2],
}

impl Source<'_> {
    /// The patterns of a place.
    #[inline(always)]
    fn pattern(&self, place: u16) -> [u8; 2] {
        self.patterns[usize::from(place) % PLACES]
    }

    /// The lens points of a place.
    #[inline(always)]
    fn lens(&self, place: u16) -> &[Eight; 2] {
        self.samples.lens(self.pattern(place))
    }

    /// The positions of a place, and from where they are counted relative to the splat's pixel.
    #[inline(always)]
    fn position<const FORM: u8>(&self, place: u16) -> ([f32; 2], &[Eight; 2]) {
        if is_distorted(FORM) {
            let ([x, y], jitter) = self.distorted.of(self.group, place);
            ([(x - self.center[0]) as f32, (y - self.center[1]) as f32], jitter)
        } else {
            (self.list.offset(place), self.samples.jitter(self.pattern(place)))
        }
    }
}
