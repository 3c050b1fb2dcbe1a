//! Surfaces summed sample by sample, for large circles of confusion.
//!
//! Through the point p of the lens the sample at x looks at the point x - p d of the plane whose defocus is d. So if the samples
//! of a tile are sorted by that point, those that may hit a splat in the plane lie together, however large its circle of
//! confusion: the work does not grow with the blur. All tiles have the same samples, so a few orders serve a frame, one for each
//! small range of defocus.
//!
//! They are evaluated eight at a time, whatever their pixels, and each hit is added to the sums of its sample; when all splats
//! are done, these are [`SurfaceSums`] of the tile's cells.

use crate::evaluate::LaneHits;
use crate::lanes::{Eight, Kernel, LANES, Lanes};
use crate::lens_image::LensImages;
use crate::places::{Apart, PLACES, TILE, clip, pixel_of};
use crate::raster::{Evaluation, RasterFrame};
use crate::records::cell_of;
use crate::resolve::interval;
use crate::surface_sums::SurfaceSums;
use crate::table::{LaneTable, TableKernel, with_table};
use rayon::prelude::*;
use splat_abuffer::SplatSurface;
use splat_core::PixelRect;
use splat_core::raster::Rasterizer;
use splat_core::setup::VisibleSplat;

/// Columns and rows of the grid by which samples are sorted. (Those of a row lie together, so that it may have more columns.)
const COLUMNS: usize = 128;
const ROWS: usize = 24;

/// How far samples may look past the place by which they are sorted, in pixels, if there is memory for so many orders: less makes
/// runs shorter.
const USUAL_DRIFT: f64 = 0.75;

/// What is known of the opaque fragments of a sample: the sums of weights times colours, and of weights; the greatest near
/// end of their intervals, and the least far end.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(32))]
pub struct SampleSums(pub Eight);

impl SampleSums {
    /// Those of no fragments.
    pub const EMPTY: Self = Self([0.0, 0.0, 0.0, 0.0, f32::NEG_INFINITY, f32::INFINITY, 0.0, 0.0]);

    /// Whether there are none.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        let [_, _, _, weight, ..] = self.0;
        weight == 0.0
    }
}

/// Eight samples of a tile.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(32))]
struct LensCell {
    /// Column and row.
    pixel: [Eight; 2],
    /// Position relative to the pixel's corner.
    jitter: [Eight; 2],
    lens: [Eight; 2],
    /// The numbers of the samples, as bits: eight times its cell's in the tile, plus its lane.
    numbers: Eight,
}

impl LensCell {
    /// Samples that no splat hits.
    const NONE: Self = Self {
        pixel: [[f32::NAN; LANES]; 2],
        jitter: [[f32::NAN; LANES]; 2],
        lens: [[0.0; LANES]; 2],
        numbers: [0.0; LANES],
    };

    /// Where in the tile the sample of a lane looks at a defocus, to rounding.
    fn sharp(&self, lane: usize, defocus: f32) -> [f32; 2] {
        [0, 1]
            .map(|axis| (self.pixel[axis][lane] + self.jitter[axis][lane]) - self.lens[axis][lane] * defocus)
    }

    /// Takes the sample of a lane from another cell.
    fn set(&mut self, lane: usize, from: &Self, other: usize) {
        for axis in 0..2 {
            self.pixel[axis][lane] = from.pixel[axis][other];
            self.jitter[axis][lane] = from.jitter[axis][other];
            self.lens[axis][lane] = from.lens[axis][other];
        }
        self.numbers[lane] = from.numbers[other];
    }
}

/// The samples of every tile of a frame with a lens that does not distort, in some orders.
#[derive(Debug)]
pub struct LensSamples {
    images: LensImages,
    /// Number of samples a pixel.
    count: usize,
    /// In equal steps of defocus.
    orders: Vec<SortedSamples>,
}

impl LensSamples {
    /// Those of a frame whose splats have this range of defocus, in as many orders as are useful and fit into some bytes, but in
    /// one at least. They are sorted on all threads of the current pool.
    pub fn new(
        rasterizer: &Rasterizer,
        images: LensImages,
        [least, greatest]: [f64; 2],
        bytes: usize,
    ) -> Self {
        let count = rasterizer.range().len();
        let cells = cells(rasterizer);
        let range = images.lens_radius * (greatest - least);
        let wanted = (range / (2.0 * USUAL_DRIFT)) as usize + 1;
        let orders = wanted.min(bytes / Self::bytes_per_order(count)).max(1);
        let step = (greatest - least) / orders as f64;
        let sort = |order: usize| SortedSamples::new(&cells, &images, least + (order as f64 + 0.5) * step);
        Self { images, count, orders: (0..orders).into_par_iter().map(sort).collect() }
    }

    /// Bytes that an order of so many samples a pixel takes.
    pub fn bytes_per_order(samples: usize) -> usize {
        // Each row is padded.
        (PLACES * samples / LANES + ROWS) * size_of::<LensCell>() + COLUMNS * ROWS * size_of::<u32>()
    }

    /// The order that is best for a defocus.
    #[inline(always)]
    fn order(&self, defocus: f64) -> &SortedSamples {
        let last = self.orders.len() - 1;
        let (first, end) = (self.orders[0].defocus, self.orders[last].defocus);
        // Steps are alike, and one of 0 is as good as any other.
        let steps = (defocus - first) / (end - first) * last as f64 + 0.5;
        &self.orders[(steps as usize).min(last)]
    }

    /// Where in a tile, given by its first pixel, a splat may be hit; `None` if that is not known.
    #[inline(always)]
    fn runs(&self, splat: &VisibleSplat, corner: [i32; 2]) -> Option<Runs<'_>> {
        let image = self.images.image(splat)?;
        let order = self.order(image.defocus());
        let drift = self.images.drift(&image, order.defocus) as f32;
        let [x, y] = [0, 1].map(|axis| self.images.nearness(&image, axis, splat, corner));
        Some(Runs {
            order,
            columns: [order.column(x.min - drift), order.column(x.max + drift)],
            rows: [order.row(y.min - drift), order.row(y.max + drift)],
        })
    }

    /// How much less time it takes to sum a splat by lens points than pixel by pixel, by an estimate, in cells tested.
    pub fn gain(&self, splat: &VisibleSplat, region: &PixelRect) -> f64 {
        let Some(image) = self.images.image(splat) else { return 0.0 };
        let blur = 2.0 * self.images.lens_radius * image.defocus().abs();
        let share = splat.bounds.intersect(region).area() as f64 / splat.bounds.area() as f64;
        let cells_a_pixel = self.count as f64 / LANES as f64;
        let area = |room: f64| {
            let [width, height] = [0, 1].map(|axis| image.max[axis] - image.min[axis] + room);
            share * cells_a_pixel * width * height
        };
        // Hits are evaluated and scattered, samples around them only evaluated; and each splat has its price.
        let by_pixels = 0.8 * area(blur + 2.0 * self.images.filter_radius);
        by_pixels - (3.0 * area(0.0) + 0.4 * area(4.0 * USUAL_DRIFT) + 3.0)
    }
}

/// The samples of every tile, in the order of their places.
fn cells(rasterizer: &Rasterizer) -> Vec<LensCell> {
    let (table, range) = (rasterizer.samples(), rasterizer.range());
    let mut cells = vec![LensCell::NONE; PLACES * range.len() / LANES];
    let samples = (0..PLACES as u16).flat_map(|place| range.clone().map(move |sample| (place, sample)));
    for (i, (place, sample)) in samples.enumerate() {
        let (cell, lane) = (&mut cells[i / LANES], i % LANES);
        let [x, y] = pixel_of(place);
        let (jitter, lens) = (table.jitter(x, y)[sample], table.lens(x, y)[sample].p);
        for axis in 0..2 {
            cell.pixel[axis][lane] = [x, y][axis] as f32;
            cell.jitter[axis][lane] = jitter[axis];
            cell.lens[axis][lane] = lens[axis];
        }
        let number = sample - range.start;
        let number = cell_of(place, number / LANES) * LANES + number % LANES;
        cell.numbers[lane] = f32::from_bits(number as u32);
    }
    cells
}

/// The samples of a tile, sorted by where they look at some defocus.
#[derive(Debug)]
struct SortedSamples {
    /// Row by row of the grid; each row begins a cell.
    cells: Vec<LensCell>,
    /// Where the samples of each place of the grid start; at last, where those of the last one end.
    starts: Vec<u32>,
    defocus: f64,
    /// The first corner of the grid, the same on both axes; columns and rows a pixel.
    origin: f32,
    scale: [f32; 2],
}

impl SortedSamples {
    /// Sorts samples for a defocus.
    fn new(all: &[LensCell], images: &LensImages, defocus: f64) -> Self {
        let room = images.lens_radius * defocus.abs() + images.filter_radius + 1.0;
        let scale = |count: usize| (count as f64 / (f64::from(TILE) + 2.0 * room)) as f32;
        let mut sorted = Self {
            cells: Vec::new(),
            starts: vec![0; COLUMNS * ROWS + 1],
            defocus,
            origin: -room as f32,
            scale: [scale(COLUMNS), scale(ROWS)],
        };
        let lanes = all.iter().flat_map(|cell| (0..LANES).map(move |lane| (cell, lane)));
        let places: Vec<usize> = lanes
            .clone()
            .map(|(cell, lane)| {
                let [x, y] = cell.sharp(lane, defocus as f32);
                sorted.row(y) * COLUMNS + sorted.column(x)
            })
            .collect();
        places.iter().for_each(|&place| sorted.starts[place] += 1);
        let mut end = 0;
        for row in sorted.starts.chunks_mut(COLUMNS) {
            end = u32::next_multiple_of(end, LANES as u32);
            for start in row {
                end += std::mem::replace(start, end);
            }
        }
        // What no sample takes is none.
        sorted.cells.resize((end as usize).div_ceil(LANES), LensCell::NONE);
        for ((cell, lane), place) in lanes.zip(places) {
            let to = sorted.starts[place] as usize;
            sorted.starts[place] += 1;
            sorted.cells[to / LANES].set(to % LANES, cell, lane);
        }
        // Now each place has its end where its start was.
        sorted.starts.copy_within(0..COLUMNS * ROWS, 1);
        sorted.starts[0] = 0;
        sorted
    }

    /// The column of the grid nearest to where a sample looks.
    #[inline(always)]
    fn column(&self, x: f32) -> usize {
        (((x - self.origin) * self.scale[0]) as usize).min(COLUMNS - 1)
    }

    /// The row.
    #[inline(always)]
    fn row(&self, y: f32) -> usize {
        (((y - self.origin) * self.scale[1]) as usize).min(ROWS - 1)
    }

    /// The cells of a row from a column to another.
    #[inline(always)]
    fn run(&self, row: usize, [first, last]: [usize; 2]) -> &[LensCell] {
        let start = self.starts[row * COLUMNS + first] as usize;
        // That of a row is where the row before ends.
        let start = if first == 0 { start.div_ceil(LANES) } else { start / LANES };
        let end = (self.starts[row * COLUMNS + last + 1] as usize).div_ceil(LANES);
        &self.cells[start..end]
    }
}

/// Samples that a splat may hit: those of some rows and columns (first and last) of the grid.
struct Runs<'a> {
    order: &'a SortedSamples,
    columns: [usize; 2],
    rows: [usize; 2],
}

/// What is hit of a splat.
#[derive(Debug, Default)]
struct Hits {
    /// Of each hit, of which the first `count` are in use: view depth, which becomes the near end of its interval; square of
    /// (u, v), which becomes its weight; far end; and as bits the number of its sample.
    depth: Vec<f32>,
    r2: Vec<f32>,
    far: Vec<f32>,
    numbers: Vec<f32>,
    count: usize,
}

impl Hits {
    /// Makes room for those of all samples of a tile.
    fn reserve(&mut self, samples: &LensSamples) {
        // Eight more are written than kept.
        let room = PLACES * samples.count + LANES;
        for values in [&mut self.depth, &mut self.r2, &mut self.far, &mut self.numbers] {
            values.resize(room, 0.0);
        }
    }

    /// Appends hits of a cell.
    #[inline(always)]
    fn push<L: Lanes>(&mut self, hits: &LaneHits<L>, numbers: &Eight) {
        let hit = !hits.missed.bits() as u8;
        // All are written; the next ones overwrite those that are too many.
        for (to, lanes) in
            [(&mut self.depth, hits.depth), (&mut self.r2, hits.r2), (&mut self.numbers, L::load(numbers))]
        {
            if let Some(to) = to[self.count..].first_chunk_mut() {
                lanes.pack(hit).store_cell::<0>(to);
            }
        }
        self.count += hit.count_ones() as usize;
    }

    /// Fills the last eight with what is no hit.
    #[inline(always)]
    fn end(&mut self) {
        self.depth[self.count..self.count + LANES].fill(f32::NAN);
    }
}

/// The buffers of [`LensSumsJob`].
#[derive(Debug, Default)]
pub struct LensSums {
    /// Of each sample of a tile, by cell and lane. Between two tiles all are empty.
    sums: Vec<SampleSums>,
    hits: Hits,
}

impl LensSums {
    /// Bytes of a sample with all that belongs to it.
    pub const BYTES_PER_SAMPLE: usize = size_of::<SampleSums>() + 4 * size_of::<f32>();
}

/// Sums the surfaces of a region by lens points. Gives the number of samples tested and that of fragments.
#[derive(Debug)]
pub struct LensSumsJob<'a> {
    /// The frame.
    pub frame: RasterFrame<'a>,
    /// Its samples.
    pub samples: &'a LensSamples,
    /// The ranks of the splats, in splat order.
    pub ranks: &'a [u32],
    /// The pixels; they lie within one tile.
    pub region: PixelRect,
    /// Scratch.
    pub buffers: &'a mut LensSums,
    /// Where the sums go; without, fragments are made and forgotten, all but those of the last splat ([`LensSums::found`]).
    pub sums: Option<&'a mut SurfaceSums>,
}

impl Kernel for LensSumsJob<'_> {
    type Output = [u64; 2];

    #[inline(always)]
    fn run<L: Lanes>(self) -> [u64; 2] {
        with_table::<L, _>(self.frame.rasterizer.table(), self)
    }
}

impl TableKernel for LensSumsJob<'_> {
    type Output = [u64; 2];

    #[inline(always)]
    fn run<L: Lanes, T: LaneTable>(self, table: &T) -> [u64; 2] {
        let frame = self.frame;
        let LensSums { sums, hits } = self.buffers;
        if let Some(to) = &self.sums {
            sums.resize(to.cells() * LANES, SampleSums::EMPTY);
        }
        hits.reserve(self.samples);
        let [mut tests, mut fragments] = [0; 2];
        let corner = corner_of(&self.region);
        let runs = |rank: Option<&u32>| {
            rank.and_then(|&rank| self.samples.runs(&frame.splats[rank as usize], corner))
        };
        let mut next = runs(self.ranks.first());
        for (i, &rank) in self.ranks.iter().enumerate() {
            frame.fetch_ahead(self.ranks, i);
            // A splat ahead: its quotients and roots take long, and nothing waits for them here.
            let runs = std::mem::replace(&mut next, runs(self.ranks.get(i + 1)));
            hits.count = 0;
            if let Some(splat) = LensSplat::<L, T>::new(&frame, rank, &self.region, table) {
                tests += splat.hit(self.samples, runs.as_ref(), hits);
                fragments +=
                    u64::from(if self.sums.is_some() { splat.sum(hits, sums) } else { splat.weigh(hits) });
            }
        }
        if let Some(to) = self.sums {
            to.take_samples(sums);
        }
        [tests, fragments]
    }
}

impl LensSums {
    /// The cell and the lane of the sample of each fragment of the last splat of a [`LensSumsJob`] without sums, its depth and its
    /// weight.
    pub fn found(&self) -> impl Iterator<Item = ([usize; 2], f32, f32)> {
        let Hits { depth, r2: weight, numbers, count, .. } = &self.hits;
        let all = depth.iter().zip(weight).zip(numbers).take(*count);
        all.filter(|((_, weight), _)| **weight > 0.0).map(|((&depth, &weight), number)| {
            let number = number.to_bits() as usize;
            ([number / LANES, number % LANES], depth, weight)
        })
    }
}

/// The first pixel of the tile of a region.
#[inline(always)]
fn corner_of(region: &PixelRect) -> [i32; 2] {
    [region.x0 & !(TILE - 1), region.y0 & !(TILE - 1)]
}

/// A splat over the samples of a tile.
struct LensSplat<'a, L, T> {
    splat: Evaluation<'a, L, T>,
    surface: &'a SplatSurface,
    /// From the splat's pixel to the tile's first.
    apart: Apart<L>,
    /// The pixels to which it is confined, if not to all of the tile.
    clip: Option<PixelRect>,
    corner: [i32; 2],
}

impl<'a, L: Lanes, T: LaneTable> LensSplat<'a, L, T> {
    /// A splat in a region of a tile; `None` if it shows nothing but its culled back.
    #[inline(always)]
    fn new(frame: &RasterFrame<'a>, rank: u32, region: &PixelRect, table: &'a T) -> Option<Self> {
        let splat = Evaluation::<L, T>::new(frame, &frame.splats[rank as usize], table);
        if splat.culls && splat.splat.back && !splat.splat.flips {
            return None;
        }
        let corner = corner_of(region);
        Some(Self {
            apart: Apart::new(splat.splat, corner),
            splat,
            surface: &frame.surfaces[rank as usize],
            clip: (region.area() < PLACES).then_some(*region),
            corner,
        })
    }

    /// Appends what is hit, of these runs, if they are known. Returns the number of samples tested.
    #[inline(always)]
    fn hit(&self, samples: &LensSamples, runs: Option<&Runs<'_>>, hits: &mut Hits) -> u64 {
        let cells = if self.splat.splat.plain {
            self.hit_runs::<true>(samples, runs, hits)
        } else {
            self.hit_runs::<false>(samples, runs, hits)
        };
        hits.end();
        (cells * LANES) as u64
    }

    /// [`Self::hit`], given whether the splat is plain. Returns the number of cells tested.
    #[inline(always)]
    fn hit_runs<const PLAIN: bool>(
        &self,
        samples: &LensSamples,
        runs: Option<&Runs<'_>>,
        hits: &mut Hits,
    ) -> usize {
        let Some(Runs { order, columns, rows: [first, last] }) = runs else {
            let all = &samples.orders[0].cells;
            self.hit_cells::<PLAIN>(all, hits);
            return all.len();
        };
        let mut tested = 0;
        for row in *first..last + 1 {
            let run = order.run(row, *columns);
            tested += run.len();
            self.hit_cells::<PLAIN>(run, hits);
        }
        tested
    }

    /// Finds what is hit of some cells.
    #[inline(always)]
    fn hit_cells<const PLAIN: bool>(&self, cells: &[LensCell], hits: &mut Hits) {
        for cell in cells {
            hits.push(&self.evaluate::<PLAIN>(cell), &cell.numbers);
        }
    }

    /// The hits of eight samples.
    #[inline(always)]
    fn evaluate<const PLAIN: bool>(&self, LensCell { pixel, jitter, lens, .. }: &LensCell) -> LaneHits<L> {
        let pixel = [L::load(&pixel[0]), L::load(&pixel[1])];
        let whole = self.apart.to(pixel);
        let d = [
            whole[0] + (L::load(&jitter[0]) + self.splat.minus_fraction[0]),
            whole[1] + (L::load(&jitter[1]) + self.splat.minus_fraction[1]),
        ];
        let p = [L::load(&lens[0]), L::load(&lens[1])];
        let mut hits = self.splat.lane_splat.thin_lens::<PLAIN>(d, p, &self.splat.limits);
        if let Some(region) = &self.clip {
            clip(pixel, self.corner, region, &mut hits);
        }
        let VisibleSplat { flips, back, .. } = *self.splat.splat;
        if flips {
            // One side is seen alone.
            hits.missed = if back { hits.missed.or_not(hits.flipped) } else { hits.missed | hits.flipped };
        }
        hits
    }

    /// Turns the squares of hits into weights. Returns the number of fragments.
    #[inline(always)]
    fn weigh(&self, hits: &mut Hits) -> u32 {
        let eights = hits.count.div_ceil(LANES);
        let mut misses = L::splat(0.0);
        let (depth, _) = hits.depth.as_chunks();
        let (r2, _) = hits.r2.as_chunks_mut();
        for (depth, r2) in depth.iter().zip(r2).take(eights) {
            let (_, weight) = self.splat.weighed(L::load(depth), L::load(r2), &mut misses);
            weight.store_cell::<0>(r2);
        }
        count_hits(eights, misses)
    }

    /// Adds hits to the sums of their samples. Returns the number of fragments.
    ///
    /// In two loops, so that neither waits for what the other has just written.
    #[inline(always)]
    fn sum(&self, hits: &mut Hits, sums: &mut [SampleSums]) -> u32 {
        let eights = hits.count.div_ceil(LANES);
        let mut misses = L::splat(0.0);
        let (depth, _) = hits.depth.as_chunks_mut();
        let (r2, _) = hits.r2.as_chunks_mut();
        let (far, _) = hits.far.as_chunks_mut();
        for ((depth, r2), far) in depth.iter_mut().zip(r2).zip(far).take(eights) {
            let (w, weight) = self.splat.weighed(L::load(depth), L::load(r2), &mut misses);
            let [near_end, far_end] = interval(w, self.surface);
            near_end.store_cell::<0>(depth);
            weight.store_cell::<0>(r2);
            far_end.store_cell::<0>(far);
        }
        let [red, green, blue] = self.surface.color;
        let color = [red, green, blue, 1.0];
        let ends = hits.depth.iter().zip(&hits.far);
        let all = ends.zip(&hits.r2).zip(&hits.numbers).take(hits.count);
        for (((&near, &far), &weight), number) in all {
            let [weight_color @ .., last_near, first_far, _, _] = &mut sums[number.to_bits() as usize].0;
            for (sum, color) in weight_color.iter_mut().zip(color) {
                *sum += weight * color;
            }
            // What weighs nothing has no numbers for ends.
            *last_near = if near > *last_near { near } else { *last_near };
            *first_far = if far < *first_far { far } else { *first_far };
        }
        count_hits(eights, misses)
    }
}

/// The number of hits in some eights, given the misses in each lane.
#[inline(always)]
fn count_hits<L: Lanes>(eights: usize, misses: L) -> u32 {
    let mut counts = [0.0; LANES];
    misses.store_cell::<0>(&mut counts);
    (eights * LANES) as u32 - counts.iter().sum::<f32>() as u32
}
