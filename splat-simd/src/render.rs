//! The fast renderer: set-up and tiles in parallel, eight samples a vector.

use crate::lanes::{LANES, Level};
use crate::raster::{RasterFrame, RasterJob, RecordBuffer};
use crate::resolve::ResolveJob;
use crate::samples::LaneSamples;
use rayon::prelude::*;
use splat_abuffer::{Coverage, Fragment, Resolve, SplatSurface, Thickness};
use splat_core::pixel::PixelResolver;
use splat_core::raster::SamplePlace;
use splat_core::render::{Frame, quarters, tiles};
use splat_core::setup::{SetUp, View, set_up_range, splat_order};
use splat_core::{AovSelection, Camera, Cloud, Error, Film, PixelRect, RenderOptions, Rendered, Statistics};
use std::sync::Mutex;
use std::time::Instant;

/// Splats that a task of the parallel set-up takes.
const SET_UP_CHUNK: usize = 4096;

/// Tiles between two reports of progress, per thread.
const TILES_A_REPORT: usize = 16;

/// A renderer that keeps its threads and buffers from picture to picture.
#[derive(Debug)]
pub struct Renderer {
    level: Level,
    threads: rayon::ThreadPool,
    workers: Mutex<Vec<Worker>>,
}

/// The buffers of a thread.
#[derive(Debug, Default)]
struct Worker {
    records: RecordBuffer,
    fragments: Vec<Fragment>,
}

/// A finished tile.
struct Tile {
    film: Film,
    statistics: Statistics,
}

/// What all tiles of a picture share.
struct Picture<'a> {
    cloud: &'a Cloud,
    camera: &'a Camera,
    options: &'a RenderOptions,
    frame: &'a Frame,
    samples: LaneSamples,
    surfaces: Vec<SplatSurface>,
    level: Level,
}

/// Renders a cloud with a renderer made for it: as [`splat_core::render()`], on all processors.
///
/// # Errors
/// As [`splat_core::render()`].
pub fn render(
    cloud: &Cloud,
    camera: &Camera,
    options: &RenderOptions,
    progress: &mut dyn FnMut(f64),
) -> Result<Rendered, Error> {
    Renderer::new(0, Level::choose())?.render(cloud, camera, options, progress)
}

impl Renderer {
    /// A renderer of this many threads (0: one a processor) at a level.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the threads cannot be made.
    pub fn new(threads: usize, level: Level) -> Result<Self, Error> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let threads = pool.map_err(|error| Error::invalid("threads", error, "fewer threads"))?;
        Ok(Self { level, threads, workers: Mutex::default() })
    }

    /// Number of threads.
    pub fn threads(&self) -> usize {
        self.threads.current_num_threads()
    }

    /// The instruction set of the lanes.
    pub fn level(&self) -> Level {
        self.level
    }

    /// Renders a cloud: the same bits as [`splat_core::render()`], whatever the threads and the level. `progress` is told
    /// the finished part of the picture, from 0 to 1, now and then.
    ///
    /// # Errors
    /// As [`splat_core::render()`].
    pub fn render(
        &mut self,
        cloud: &Cloud,
        camera: &Camera,
        options: &RenderOptions,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Rendered, Error> {
        let frame = self.threads.install(|| Frame::new(cloud, camera, options, set_up))?;
        let window = frame.view.window;
        let start = Instant::now();
        let tiles = tiles(&frame.set_up.splats, &window);
        let mut statistics = frame.statistics(start.elapsed());
        let picture = Picture {
            cloud,
            camera,
            options,
            frame: &frame,
            samples: LaneSamples::new(&frame.rasterizer),
            surfaces: frame.set_up.surfaces(),
            level: self.level,
        };
        let mut film = Film::new([camera.width, camera.height], window, options.aovs);
        film.position_origin = cloud.origin;
        let (count, batch) = (tiles.len(), TILES_A_REPORT * self.threads());
        for (number, tiles) in tiles.chunks(batch).enumerate() {
            progress((number * batch) as f64 / count as f64);
            let finished: Vec<Tile> = self.threads.install(|| {
                tiles
                    .par_iter()
                    .map(|(region, ranks)| self.with_worker(|worker| picture.tile(worker, region, ranks)))
                    .collect()
            });
            for tile in finished {
                film.paste(&tile.film);
                add(&mut statistics, &tile.statistics);
            }
        }
        progress(1.0);
        Ok(Rendered { film, statistics })
    }

    /// Lends one of the kept buffers, or a new one.
    fn with_worker<T>(&self, work: impl FnOnce(&mut Worker) -> T) -> T {
        // A poisoned lock only means that another tile panicked; the buffers are cleared before use.
        let take = || self.workers.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let mut worker = take().pop().unwrap_or_default();
        let result = work(&mut worker);
        take().push(worker);
        result
    }
}

/// Adds the statistics of a tile.
fn add(sum: &mut Statistics, tile: &Statistics) {
    sum.tests += tile.tests;
    sum.fragments += tile.fragments;
    sum.samples += tile.samples;
    sum.raster += tile.raster;
    sum.resolve += tile.resolve;
}

/// [`splat_core::setup::set_up`] in parallel.
fn set_up(cloud: &Cloud, view: &View, options: &RenderOptions) -> SetUp {
    let chunks: Vec<SetUp> = (0..cloud.len().div_ceil(SET_UP_CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let start = chunk * SET_UP_CHUNK;
            set_up_range(cloud, view, options, start..cloud.len().min(start + SET_UP_CHUNK))
        })
        .collect();
    let mut all = SetUp::default();
    for chunk in chunks {
        all.splats.extend(chunk.splats);
        for (cause, count) in chunk.dropped {
            *all.dropped.entry(cause).or_default() += count;
        }
    }
    all.splats.par_sort_unstable_by(|a, b| splat_order(cloud, a, b));
    all
}

impl Picture<'_> {
    /// Renders a tile.
    fn tile(&self, worker: &mut Worker, region: &PixelRect, ranks: &[u32]) -> Tile {
        let mut film = Film::new([self.camera.width, self.camera.height], *region, self.options.aovs);
        let mut statistics = Statistics::default();
        let splats = &self.frame.set_up.splats;
        let mut pixels = PixelResolver::new(
            self.cloud,
            self.camera,
            self.options,
            &self.frame.view,
            splats,
            &self.surfaces,
        );
        self.region(worker, region, ranks, &mut pixels, &mut film, &mut statistics);
        Tile { film, statistics }
    }

    /// Renders a part of a tile, in quarters if its records exceed the budget.
    fn region(
        &self,
        worker: &mut Worker,
        region: &PixelRect,
        ranks: &[u32],
        pixels: &mut PixelResolver<'_>,
        film: &mut Film,
        statistics: &mut Statistics,
    ) {
        let start = Instant::now();
        let frame = RasterFrame {
            rasterizer: &self.frame.rasterizer,
            samples: &self.samples,
            splats: &self.frame.set_up.splats,
        };
        let budget = self.options.tile_memory / RecordBuffer::BYTES_PER_RECORD;
        let job = RasterJob { frame, ranks, region: *region, budget, buffer: &mut worker.records };
        let complete = self.level.run(job);
        if !complete {
            statistics.raster += start.elapsed();
            for quarter in quarters(region) {
                self.region(worker, &quarter, ranks, pixels, film, statistics);
            }
            return;
        }
        worker.records.group(region.area() * self.samples.groups());
        statistics.raster += start.elapsed();
        statistics.tests += worker.records.tests;
        statistics.fragments += worker.records.fragments;
        let start = Instant::now();
        match (self.options.resolve, self.options.aovs) {
            (Resolve::Surface { coverage, thickness: Thickness::AroundHit }, aovs) if few(aovs) => {
                self.resolve_lanes(worker, region, coverage, pixels, film);
            }
            _ => self.resolve_each(worker, region, pixels, film),
        }
        statistics.samples += (region.area() * self.frame.rasterizer.range().len()) as u64;
        statistics.resolve += start.elapsed();
    }

    /// Resolves eight samples at once.
    fn resolve_lanes(
        &self,
        worker: &Worker,
        region: &PixelRect,
        coverage: Coverage,
        pixels: &mut PixelResolver<'_>,
        film: &mut Film,
    ) {
        self.level.run(ResolveJob {
            region: *region,
            buffer: &worker.records,
            samples: &self.samples,
            surfaces: &self.surfaces,
            coverage,
            pixels,
            film,
        });
    }

    /// Resolves sample by sample, as the reference does: for `over`, the listing's intervals, and the AOVs that ask for
    /// the fragments of a layer.
    fn resolve_each(
        &self,
        worker: &mut Worker,
        region: &PixelRect,
        pixels: &mut PixelResolver<'_>,
        film: &mut Film,
    ) {
        let range = self.frame.rasterizer.range();
        let groups = self.samples.groups();
        let Worker { records, fragments } = worker;
        for y in region.y0..region.y1 {
            for x in region.x0..region.x1 {
                let pixel = (y - region.y0) as usize * region.width() + (x - region.x0) as usize;
                pixels.start();
                for sample in range.clone() {
                    let number = sample - range.start;
                    let cell = records.cell(pixel * groups + number / LANES);
                    fragments.clear();
                    fragments
                        .extend(cell.iter().filter_map(|&record| records.fragment(record, number % LANES)));
                    let place = SamplePlace { x, y, sample };
                    pixels.add(place, fragments, self.frame.rasterizer.samples());
                }
                pixels.finish(x, y, film);
            }
        }
    }
}

/// Whether the AOVs need no more of a sample than its colour, transmittance and coverage.
fn few(aovs: AovSelection) -> bool {
    let AovSelection { depth, normal, albedo, position, id, layers, .. } = aovs;
    !(depth || normal || albedo || position || id || layers)
}

/// Gives every fragment of a picture to `sink`, as [`splat_core::fragments()`] does: splat by splat in splat order, each
/// splat's by pixel, row by row, and sample. Returns the number of samples tested.
///
/// # Errors
/// As [`render`].
pub fn fragments(
    cloud: &Cloud,
    camera: &Camera,
    options: &RenderOptions,
    level: Level,
    sink: &mut dyn FnMut(SamplePlace, u32, Fragment),
) -> Result<u64, Error> {
    let frame = Frame::new(cloud, camera, options, set_up)?;
    let samples = LaneSamples::new(&frame.rasterizer);
    let mut buffer = RecordBuffer::default();
    let mut tests = 0;
    for (rank, splat) in frame.set_up.splats.iter().enumerate() {
        tests += splat_fragments(&frame, &samples, level, rank, &mut buffer, &mut |place, fragment| {
            sink(place, splat.index, fragment);
        });
    }
    Ok(tests)
}

/// The fragments of one splat, by pixel and sample. Returns the number of samples tested.
fn splat_fragments(
    frame: &Frame,
    samples: &LaneSamples,
    level: Level,
    rank: usize,
    buffer: &mut RecordBuffer,
    sink: &mut dyn FnMut(SamplePlace, Fragment),
) -> u64 {
    let splats = &frame.set_up.splats;
    let region = splats[rank].bounds;
    let (groups, first) = (samples.groups(), frame.rasterizer.range().start);
    let raster_frame = RasterFrame { rasterizer: &frame.rasterizer, samples, splats };
    let ranks = &[rank as u32];
    level.run(RasterJob { frame: raster_frame, ranks, region, budget: usize::MAX, buffer });
    buffer.group(region.area() * groups);
    for cell in 0..region.area() * groups {
        let pixel = cell / groups;
        let [x, y] = [pixel % region.width(), pixel / region.width()].map(|offset| offset as i32);
        for lane in 0..LANES {
            let sample = first + cell % groups * LANES + lane;
            let place = SamplePlace { x: region.x0 + x, y: region.y0 + y, sample };
            for fragment in buffer.cell(cell).iter().filter_map(|&record| buffer.fragment(record, lane)) {
                sink(place, fragment);
            }
        }
    }
    buffer.tests
}

/// A fragment in which the two cores differ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// Pixel and sample.
    pub place: SamplePlace,
    /// Index of the splat in the cloud.
    pub splat: u32,
    /// What the reference has there.
    pub reference: Option<Fragment>,
    /// What the fast core has there.
    pub fast: Option<Fragment>,
}

/// Runs both cores side by side over every splat, and gives the first fragment in which they differ, bit for bit, or
/// else the number of fragments in which they agree. `progress` is told the finished part, from 0 to 1.
///
/// # Errors
/// As [`render`].
pub fn compare(
    cloud: &Cloud,
    camera: &Camera,
    options: &RenderOptions,
    level: Level,
    progress: &mut dyn FnMut(f64),
) -> Result<Result<u64, Difference>, Error> {
    let frame = Frame::new(cloud, camera, options, set_up)?;
    let samples = LaneSamples::new(&frame.rasterizer);
    let mut buffer = RecordBuffer::default();
    let count = frame.set_up.splats.len();
    let mut total = 0;
    for (rank, splat) in frame.set_up.splats.iter().enumerate() {
        if rank % 256 == 0 {
            progress(rank as f64 / count as f64);
        }
        let mut reference = Vec::new();
        frame.rasterizer.rasterize(splat, rank as u32, &splat.bounds, &mut |place, fragment| {
            reference.push((place, fragment));
        });
        let mut fast = Vec::with_capacity(reference.len());
        splat_fragments(&frame, &samples, level, rank, &mut buffer, &mut |place, fragment| {
            fast.push((place, fragment));
        });
        // One order for both: rows, columns, samples.
        let key = |place: &SamplePlace| (place.y, place.x, place.sample);
        reference.sort_by_key(|(place, _)| key(place));
        fast.sort_by_key(|(place, _)| key(place));
        if let Some(difference) = first_difference(&reference, &fast, splat.index) {
            return Ok(Err(difference));
        }
        total += reference.len() as u64;
    }
    Ok(Ok(total))
}

/// The first place at which two sorted lists of a splat's fragments differ.
fn first_difference(
    reference: &[(SamplePlace, Fragment)],
    fast: &[(SamplePlace, Fragment)],
    splat: u32,
) -> Option<Difference> {
    let bits = |(place, f): &(SamplePlace, Fragment)| {
        ((place.y, place.x, place.sample), f.rank(), f.is_back(), f.depth.to_bits(), f.weight.to_bits())
    };
    let same = reference.iter().zip(fast).take_while(|(a, b)| bits(a) == bits(b)).count();
    let next = [reference.get(same), fast.get(same)];
    let place = next.iter().flatten().map(|(place, _)| *place).min_by_key(|p| (p.y, p.x, p.sample))?;
    let at_place = |entry: Option<&(SamplePlace, Fragment)>| {
        entry.filter(|(other, _)| *other == place).map(|(_, fragment)| *fragment)
    };
    let [reference, fast] = next.map(at_place);
    Some(Difference { place, splat, reference, fast })
}
