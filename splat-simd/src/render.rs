//! The fast renderer: set-up and tiles in parallel, eight samples a vector.

use crate::lanes::{LANES, Level};
use crate::lattice::{CellList, Lattice};
use crate::lens_image::LensImages;
use crate::lens_sums::{LensSamples, LensSums, LensSumsJob};
use crate::over::Over;
use crate::places::{PLACES, PlaceList, place_of};
use crate::raster::{LatticeJob, RasterFrame, RasterJob, Target};
use crate::records::{RecordBuffer, cell_of};
use crate::resolve::{ResolveCell, ResolveJob, SummedSurfaces, Surfaces};
use crate::samples::{DistortedSamples, LaneSamples};
use crate::shade::{LaneImages, TileShader};
use crate::surface_sums::{COLOR, FindLayered, GREY, SurfaceSums};
use rayon::prelude::*;
use splat_abuffer::{Fragment, Resolve, SampleColor, SplatSurface, Thickness};
use splat_core::memory::Budget;
use splat_core::pixel::PixelResolver;
use splat_core::raster::SamplePlace;
use splat_core::render::{Frame, Tiles, Unfinished, pixel_too_large, quarters};
use splat_core::setup::{Dropped, SetUp, SortKey, View, VisibleSplat, sort_keys, splat_order};
use splat_core::shade::SplatShader;
use splat_core::{AovSelection, Camera, Cloud, Error, Film, PixelRect, RenderOptions, Rendered, Statistics};
use std::sync::Mutex;
use std::time::Instant;

/// Splats that a task of the parallel set-up takes in its first step.
const SET_UP_CHUNK: usize = 4096;

/// The same for its second step.
const SET_UP_PART: usize = 256;

/// Tasks of that step whose results are joined at once.
const SET_UP_PARTS: usize = 16;

/// Tiles between two reports of progress, per thread.
const TILES_A_REPORT: usize = 16;

/// At most so many bytes a sample of a pixel take the buffers of a thread besides the records.
const WORKER_BYTES: usize =
    (32 << 10) + PLACES * (SurfaceSums::BYTES_PER_CELL / LANES + LensSums::BYTES_PER_SAMPLE);

/// Bytes that each of a tile's splats takes, in arrays that grow by doubling: its rank, and what its fragments share.
const LISTED_BYTES: usize = 2 * (size_of::<u32>() + size_of::<SplatSurface>());

/// The same for its shader.
const SHADED_BYTES: usize = 1024;

/// Bytes that the samples of a frame with a lens take in all their orders, at most, if they take no more in one.
const MAX_ORDER_BYTES: usize = 16 << 20;

/// By at least as many of a tile's splats, if it has them, is chosen how it is rasterised.
const SPLATS_ASKED: usize = 32;

/// If more of a tile's cells than this hold several layers, sums are not worth their while: such cells are rasterised
/// twice.
const MOST_LAYERED: f32 = 0.25;

/// The same out of focus, where to rasterise a pixel again takes far longer than by lens points.
const MOST_LAYERED_BLURRED: f32 = 1.0 / 32.0;

/// The number of groups of samples up to which the sums of a tile stay in the second cache.
const MOST_SUMMED: usize = 8;

/// A renderer that keeps its threads and buffers from picture to picture.
#[derive(Debug)]
pub struct Renderer {
    level: Level,
    threads: rayon::ThreadPool,
    workers: Mutex<Vec<Worker>>,
    /// That of the last picture, kept for its memory.
    set_up: SetUp,
    /// Those of the last picture's material.
    images: LaneImages,
}

/// The buffers of a thread.
#[derive(Debug, Default)]
struct Worker {
    records: RecordBuffer,
    places: PlaceList,
    distorted: DistortedSamples,
    cells: CellList,
    colors: Vec<SampleColor>,
    fragments: Vec<Fragment>,
    over: Over,
    sums: SurfaceSums,
    lens_sums: LensSums,
    /// The part of the last tile's cells that held several layers.
    layered_share: f32,
}

/// Which fragments of a region are kept, and how: [`Target`] without its buffers.
#[derive(Debug, Clone, Copy)]
enum Keep {
    Records,
    Sums,
    Layered,
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
    /// For large circles of confusion.
    lattice: Option<Lattice>,
    /// The same, for surfaces that are summed.
    lens_samples: Option<LensSamples>,
    /// Whether surfaces may be known by sums alone.
    can_sum: bool,
    images: &'a LaneImages,
    level: Level,
    /// Bytes that the fragments of a tile may take.
    tile_memory: usize,
    /// Bytes that those of a pixel may take.
    pixel_memory: usize,
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
        Ok(Self {
            level,
            threads,
            workers: Mutex::default(),
            set_up: SetUp::default(),
            images: LaneImages::new(level),
        })
    }

    /// Number of threads.
    pub fn threads(&self) -> usize {
        self.threads.current_num_threads()
    }

    /// The instruction set of the lanes.
    pub fn level(&self) -> Level {
        self.level
    }

    /// Renders a cloud: the same bits as [`splat_core::render()`], whatever the threads and the level; but colours of images
    /// that are looked up pixel by pixel are rounded otherwise (see [`crate::texture`]). `progress` is told
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
        self.render_from(None, cloud, camera, options, &mut |done, _| progress(done))
    }

    /// Renders a cloud, from where it was left: the same bits as [`Renderer::render`], if `begun` is a part of the same
    /// picture, whichever threads made it.
    ///
    /// # Errors
    /// As [`splat_core::render_from()`].
    pub fn render_from(
        &mut self,
        begun: Option<Unfinished>,
        cloud: &Cloud,
        camera: &Camera,
        options: &RenderOptions,
        watch: &mut dyn FnMut(f64, &Unfinished),
    ) -> Result<Rendered, Error> {
        let frame = self.frame(cloud, camera, options)?;
        let window = frame.view.window;
        let mut memory = frame.memory;
        let start = Instant::now();
        let tiles = Tiles::new(&frame.set_up.splats, &window, &mut memory)?;
        let mut statistics = frame.statistics(start.elapsed());
        self.take_lists(&tiles, options, &mut memory)?;
        let picture = Picture::new(cloud, camera, options, &frame, self, memory);
        let (size, samples) = ([camera.width, camera.height], frame.rasterizer.range().len());
        let mut made = match begun {
            Some(begun) => begun,
            None => Unfinished {
                film: picture.pixels().empty_film(size, window, samples)?,
                tiles: 0,
                statistics: Statistics::default(),
            },
        };
        made.check(size, window, options.aovs, tiles.len())?;
        statistics.add_tiles(&made.statistics);
        statistics.samples = (window.area() * samples) as u64;
        made.statistics = statistics;
        made.film.position_origin = cloud.origin;
        let (count, batch) = (tiles.len(), TILES_A_REPORT * self.threads());
        for first in (made.tiles..count).step_by(batch) {
            watch(first as f64 / count as f64, &made);
            let finished: Vec<Tile> = self.threads.install(|| {
                (first..count.min(first + batch))
                    .into_par_iter()
                    .map(|tile| tiles.get(tile))
                    .filter(|(_, ranks)| !ranks.is_empty())
                    .map(|(region, ranks)| self.with_worker(|worker| picture.tile(worker, &region, ranks)))
                    .collect::<Result<_, Error>>()
            })?;
            for tile in finished {
                made.film.paste(&tile.film);
                made.statistics.add_tiles(&tile.statistics);
            }
            made.tiles = count.min(first + batch);
        }
        watch(1.0, &made);
        self.set_up = frame.set_up;
        let Unfinished { film, statistics, .. } = made;
        Ok(Rendered { film, statistics })
    }

    /// Makes every fragment of a picture and forgets it at once: to measure how long that takes. The time is
    /// [`Statistics::raster`].
    ///
    /// # Errors
    /// As [`splat_core::render()`].
    pub fn rasterize(
        &mut self,
        cloud: &Cloud,
        camera: &Camera,
        options: &RenderOptions,
    ) -> Result<Statistics, Error> {
        let frame = self.frame(cloud, camera, options)?;
        let mut memory = frame.memory;
        let start = Instant::now();
        let tiles = Tiles::new(&frame.set_up.splats, &frame.view.window, &mut memory)?;
        let mut statistics = frame.statistics(start.elapsed());
        let picture = Picture::new(cloud, camera, options, &frame, self, memory);
        let counts: Vec<Statistics> = self.threads.install(|| {
            let tiles = (0..tiles.len()).into_par_iter().map(|tile| tiles.get(tile));
            tiles
                .filter(|(_, ranks)| !ranks.is_empty())
                .map(|(region, ranks)| self.with_worker(|worker| picture.count(worker, &region, ranks)))
                .collect()
        });
        counts.iter().for_each(|count| statistics.add_tiles(count));
        self.set_up = frame.set_up;
        Ok(statistics)
    }

    /// Sets memory aside for what each thread keeps of the splats of a tile.
    fn take_lists(&self, tiles: &Tiles, options: &RenderOptions, memory: &mut Budget) -> Result<(), Error> {
        const HELP: &str = "fewer threads (--threads) or a larger size, of which tiles show less, need less";
        let longest = (0..tiles.len()).map(|tile| tiles.get(tile).1.len()).max().unwrap_or(0);
        let shader = if options.material.varies_by_pixel() { SHADED_BYTES } else { 0 };
        let bytes = longest.saturating_mul(LISTED_BYTES + shader).saturating_mul(self.threads());
        memory.take("the list of a tile's splats on all threads", bytes, HELP)
    }

    /// What is ready before the first fragment; in the memory of the last picture.
    fn frame(&mut self, cloud: &Cloud, camera: &Camera, options: &RenderOptions) -> Result<Frame, Error> {
        let memory = std::mem::take(&mut self.set_up);
        self.images.set(&options.material);
        let set_up = |cloud: &_, view: &_, options: &_| set_up(cloud, view, options, memory);
        self.threads.install(|| Frame::new(cloud, camera, options, set_up))
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

/// [`splat_core::setup::set_up`] in parallel. `all` gives its memory.
pub(crate) fn set_up(cloud: &Cloud, view: &View, options: &RenderOptions, mut all: SetUp) -> SetUp {
    let chunks: Vec<(Vec<SortKey>, Dropped)> = (0..cloud.len().div_ceil(SET_UP_CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let start = chunk * SET_UP_CHUNK;
            sort_keys(cloud, view, options, start..cloud.len().min(start + SET_UP_CHUNK))
        })
        .collect();
    all.clear();
    let mut keys = Vec::with_capacity(chunks.iter().map(|(keys, _)| keys.len()).sum());
    for (chunk, dropped) in chunks {
        keys.extend(chunk);
        all.add_dropped(dropped);
    }
    keys.par_sort_unstable();
    let order = splat_order(cloud, keys);
    all.reserve(order.len());
    // A batch at a time: what the tasks hand over is never much, and goes through the same memory.
    let mut parts = vec![SetUp::default(); SET_UP_PARTS];
    for batch in order.chunks(SET_UP_PARTS * SET_UP_PART) {
        let tasks = parts.par_iter_mut().zip(batch.par_chunks(SET_UP_PART));
        tasks.for_each(|(part, order)| part.extend(cloud, view, options, order));
        parts.iter_mut().for_each(|part| all.append(part));
    }
    all
}

impl<'a> Picture<'a> {
    fn new(
        cloud: &'a Cloud,
        camera: &'a Camera,
        options: &'a RenderOptions,
        frame: &'a Frame,
        renderer: &'a Renderer,
        memory: Budget,
    ) -> Self {
        let (images, level) = (&renderer.images, renderer.level);
        // A splat may need as much as is there, and buffers grow by doubling: they may take four times their use, and once more
        // while they move.
        let films = 2 * TILES_A_REPORT * PLACES * options.film_bytes_per_pixel();
        let others = WORKER_BYTES * options.samples as usize + films;
        let orders = MAX_ORDER_BYTES.min(memory.left() / 16);
        let share = (memory.left().saturating_sub(orders) / renderer.threads()).saturating_sub(others) / 5;
        let samples = LaneSamples::new(&frame.rasterizer);
        // Of a cell of a lattice every sample lies in another pixel.
        let by_pixel = options.material.varies_by_pixel();
        let lens_images = LensImages::new(&frame.view).filter(|_| !by_pixel);
        let lattice = lens_images.map(|images| Lattice::new(&frame.rasterizer, images));
        let can_sum = can_sum(cloud, options, samples.groups());
        let lens_samples = lens_images.filter(|_| can_sum).map(|images| {
            let defocus = images.defocus_range(&frame.set_up.splats);
            renderer.threads.install(|| LensSamples::new(&frame.rasterizer, images, defocus, orders))
        });
        Self {
            cloud,
            camera,
            options,
            frame,
            samples,
            lattice,
            lens_samples,
            can_sum,
            images,
            level,
            tile_memory: options.tile_memory.min(share),
            pixel_memory: if memory.is_limited() { share } else { usize::MAX },
        }
    }

    fn pixels(&self) -> PixelResolver<'_> {
        let Frame { view, set_up, .. } = self.frame;
        PixelResolver::new(
            self.cloud,
            self.camera,
            self.options,
            view,
            &set_up.splats,
            &set_up.surfaces,
            self.images,
        )
    }

    /// Renders a tile.
    fn tile(&self, worker: &mut Worker, region: &PixelRect, ranks: &[u32]) -> Result<Tile, Error> {
        let mut pixels = self.pixels();
        let frame = [self.camera.width, self.camera.height];
        let mut film = pixels.empty_film(frame, *region, self.samples.samples())?;
        let start = Instant::now();
        worker.distorted.fill(&self.frame.rasterizer, region, self.level);
        let mut statistics = Statistics { raster: start.elapsed(), ..Statistics::default() };
        self.region(worker, region, ranks, &mut pixels, &mut film, &mut statistics)?;
        Ok(Tile { film, statistics })
    }

    /// Makes the fragments of a tile and forgets them.
    fn count(&self, worker: &mut Worker, region: &PixelRect, ranks: &[u32]) -> Statistics {
        let start = Instant::now();
        let [tests, fragments] = match self.lens_samples_for(region, ranks) {
            Some(samples) => {
                let (frame, region, buffers) = (self.raster_frame(), *region, &mut worker.lens_sums);
                self.level.run_single(LensSumsJob { frame, samples, ranks, region, buffers, sums: None })
            }
            None => {
                worker.records.clear(self.samples.groups(), two_sided(self.cloud, self.options), usize::MAX);
                worker.records.forget();
                worker.distorted.fill(&self.frame.rasterizer, region, self.level);
                let lattice = if self.can_sum { None } else { self.lattice_for(region, ranks) };
                let tests = self.rasterize(worker, region, ranks, lattice);
                [tests, worker.records.fragments]
            }
        };
        Statistics { tests, fragments, raster: start.elapsed(), ..Statistics::default() }
    }

    /// The lattice, if by it these splats have less to test in a region than pixel by pixel.
    fn lattice_for(&self, region: &PixelRect, ranks: &[u32]) -> Option<&Lattice> {
        // A lattice's cells spread over the tile, whatever small part of it is asked for.
        let lattice = self.lattice.as_ref().filter(|_| region.area() >= PLACES / 2)?;
        let gain: f64 = self.some_splats(ranks).map(|splat| lattice.gain(splat, region)).sum();
        (gain > 0.0).then_some(lattice)
    }

    /// The samples by lens points, if it takes less time to sum these splats by them than pixel by pixel.
    fn lens_samples_for(&self, region: &PixelRect, ranks: &[u32]) -> Option<&LensSamples> {
        let samples = self.lens_samples.as_ref().filter(|_| region.area() >= PLACES / 2)?;
        let gain: f64 = self.some_splats(ranks).map(|splat| samples.gain(splat, region)).sum();
        (gain > 0.0).then_some(samples)
    }

    /// A part of some splats, to tell what is better for all.
    fn some_splats(&self, ranks: &[u32]) -> impl Iterator<Item = &VisibleSplat> {
        ranks
            .iter()
            .step_by(ranks.len() / SPLATS_ASKED + 1)
            .map(|&rank| &self.frame.set_up.splats[rank as usize])
    }

    /// Makes the records of a region. Returns the number of samples tested.
    fn rasterize(
        &self,
        worker: &mut Worker,
        region: &PixelRect,
        ranks: &[u32],
        lattice: Option<&Lattice>,
    ) -> u64 {
        let Some(lattice) = lattice else {
            return self.rasterize_pixels(worker, region, ranks, Keep::Records);
        };
        let Worker { records, cells, .. } = worker;
        let (frame, region) = (self.raster_frame(), *region);
        self.level.run_single(LatticeJob { frame, lattice, ranks, region, records, cells })
    }

    /// Makes the fragments of a region pixel by pixel. Returns the number of samples tested.
    fn rasterize_pixels(&self, worker: &mut Worker, region: &PixelRect, ranks: &[u32], keep: Keep) -> u64 {
        let Worker { records, places, distorted, sums, .. } = worker;
        let (frame, region) = (self.raster_frame(), *region);
        let target = match keep {
            Keep::Records => Target::Records,
            Keep::Sums => Target::Sums(sums),
            Keep::Layered => Target::Layered(sums),
        };
        self.level.run(RasterJob { frame, ranks, region, records, places, distorted, target })
    }

    /// Renders a part of a tile, in quarters if its records exceed the budget; a single pixel gets what it needs, if there is as
    /// much.
    fn region(
        &self,
        worker: &mut Worker,
        region: &PixelRect,
        ranks: &[u32],
        pixels: &mut PixelResolver<'_>,
        film: &mut Film,
        statistics: &mut Statistics,
    ) -> Result<(), Error> {
        let start = Instant::now();
        let limit = if region.area() > 1 { self.tile_memory } else { self.pixel_memory };
        let limit = limit / RecordBuffer::BYTES_PER_RECORD;
        // One splat may hit all cells of a region, on both sides.
        if region.area() > 1
            && self.pixel_memory < usize::MAX
            && 2 * region.area() * self.samples.groups() > limit
        {
            return quarters(region)
                .try_for_each(|quarter| self.region(worker, &quarter, ranks, pixels, film, statistics));
        }
        let sums = self.sum_surfaces(worker, region, ranks, limit);
        let summed = sums.is_some();
        // Sums are of cells of pixels.
        let lattice = if summed { None } else { self.lattice_for(region, ranks) };
        let (tests, fragments) = sums.unwrap_or_else(|| {
            // So that sums are tried again in a while.
            worker.layered_share *= 0.9;
            worker.records.clear(self.samples.groups(), two_sided(self.cloud, self.options), limit);
            let tests = self.rasterize(worker, region, ranks, lattice);
            (tests, worker.records.fragments)
        });
        if !worker.records.is_complete() {
            if summed {
                worker.sums.clear();
            }
            statistics.raster += start.elapsed();
            if region.area() == 1 {
                let bytes = RecordBuffer::BYTES_PER_RECORD;
                return Err(pixel_too_large(limit + 1, bytes, self.pixel_memory));
            }
            return quarters(region)
                .try_for_each(|quarter| self.region(worker, &quarter, ranks, pixels, film, statistics));
        }
        worker.records.group();
        statistics.raster += start.elapsed();
        statistics.tests += tests;
        statistics.fragments += fragments;
        let start = Instant::now();
        match self.options.resolve {
            Resolve::Surface { coverage, .. } if summed => {
                let mut sums = std::mem::take(&mut worker.sums);
                if sums.is_grey() {
                    let mut cells = SummedSurfaces::<GREY> { coverage, sums: &mut sums };
                    self.resolve_cells(worker, region, lattice, &mut cells, pixels, film);
                } else {
                    let mut cells = SummedSurfaces::<COLOR> { coverage, sums: &mut sums };
                    self.resolve_cells(worker, region, lattice, &mut cells, pixels, film);
                }
                worker.sums = sums;
            }
            Resolve::Surface { coverage, thickness: Thickness::AroundHit } if few(self.options.aovs) => {
                if self.cloud.opacities.is_none() {
                    self.resolve_cells(
                        worker,
                        region,
                        lattice,
                        &mut Surfaces::<true> { coverage },
                        pixels,
                        film,
                    );
                } else {
                    self.resolve_cells(
                        worker,
                        region,
                        lattice,
                        &mut Surfaces::<false> { coverage },
                        pixels,
                        film,
                    );
                }
            }
            Resolve::Over if few(self.options.aovs) => {
                let mut over = std::mem::take(&mut worker.over);
                self.resolve_cells(worker, region, lattice, &mut over, pixels, film);
                worker.over = over;
            }
            _ => self.resolve_each(worker, region, lattice, pixels, film),
        }
        statistics.resolve += start.elapsed();
        Ok(())
    }

    /// Makes the fragments of a region: sums where a cell holds one layer, and records for the others. Returns the number of
    /// samples tested and that of fragments; `None` if there can be no sums, or they are not worth their while.
    fn sum_surfaces(
        &self,
        worker: &mut Worker,
        region: &PixelRect,
        ranks: &[u32],
        limit: usize,
    ) -> Option<(u64, u64)> {
        let lens_samples = self.lens_samples_for(region, ranks);
        let most = if lens_samples.is_some() { MOST_LAYERED_BLURRED } else { MOST_LAYERED };
        if !self.can_sum || worker.layered_share > most {
            return None;
        }
        let groups = self.samples.groups();
        worker.sums.prepare(groups, !self.frame.set_up.colored);
        worker.records.clear(groups, false, usize::MAX);
        worker.records.forget();
        let [tests, fragments] = match lens_samples {
            Some(samples) => self.sum_samples(worker, region, ranks, samples),
            None => {
                let tests = self.rasterize_pixels(worker, region, ranks, Keep::Sums);
                [tests, worker.records.fragments]
            }
        };
        let [layered, hit] = self.level.run_single(FindLayered { sums: &mut worker.sums });
        worker.layered_share = layered as f32 / hit.max(1) as f32;
        if lens_samples.is_some() && worker.layered_share > most {
            worker.sums.clear();
            return None;
        }
        worker.records.clear(groups, false, limit);
        if layered > 0 {
            self.rasterize_pixels(worker, region, ranks, Keep::Layered);
        }
        Some((tests, fragments))
    }

    /// Sums the surfaces of a region by lens points. Returns the number of samples tested and that of fragments.
    fn sum_samples(
        &self,
        worker: &mut Worker,
        region: &PixelRect,
        ranks: &[u32],
        samples: &LensSamples,
    ) -> [u64; 2] {
        let Worker { sums, lens_sums: buffers, .. } = worker;
        let (frame, region, sums) = (self.raster_frame(), *region, Some(sums));
        self.level.run_single(LensSumsJob { frame, samples, ranks, region, buffers, sums })
    }

    /// If colours differ from pixel to pixel, the shader for a tile.
    fn shader(&self) -> Option<TileShader<'_>> {
        let Frame { view, set_up, .. } = self.frame;
        let by_pixel = self.options.material.varies_by_pixel();
        by_pixel.then(|| {
            let shader = SplatShader::new(self.cloud, view, self.options, self.images);
            TileShader::new(shader, &set_up.splats, &self.options.material, self.images)
        })
    }

    fn raster_frame(&self) -> RasterFrame<'_> {
        RasterFrame::new(self.frame, &self.samples)
    }

    /// Resolves eight samples at once, by `cells`.
    fn resolve_cells(
        &self,
        worker: &mut Worker,
        region: &PixelRect,
        lattice: Option<&Lattice>,
        cells: &mut impl ResolveCell,
        pixels: &mut PixelResolver<'_>,
        film: &mut Film,
    ) {
        let mut shader = self.shader();
        self.level.run_single(ResolveJob {
            region: *region,
            buffer: &mut worker.records,
            shader: shader.as_mut(),
            samples: &self.samples,
            cells,
            lattice,
            scratch: &mut worker.colors,
            pixels,
            film,
        });
    }

    /// Resolves sample by sample, as the reference does: for the listing's intervals, and the AOVs that ask for the
    /// fragments of a layer.
    fn resolve_each(
        &self,
        worker: &mut Worker,
        region: &PixelRect,
        lattice: Option<&Lattice>,
        pixels: &mut PixelResolver<'_>,
        film: &mut Film,
    ) {
        let range = self.frame.rasterizer.range();
        let Worker { records, fragments, .. } = worker;
        for y in region.y0..region.y1 {
            for x in region.x0..region.x1 {
                pixels.start();
                for sample in range.clone() {
                    let number = sample - range.start;
                    let place = place_of(x, y);
                    let (cell, lane) = match lattice {
                        None => (cell_of(place, number / LANES), number % LANES),
                        Some(lattice) => lattice.cell_of(place, number),
                    };
                    let entries = records.cell(cell).into_iter().flatten();
                    fragments.clear();
                    fragments.extend(entries.filter_map(|&entry| records.fragment(entry, lane)));
                    let place = SamplePlace { x, y, sample };
                    pixels.add(place, fragments, self.frame.rasterizer.samples());
                }
                pixels.finish(x, y, film);
            }
        }
    }
}

/// Whether the surfaces of a picture of so many groups of samples a pixel may be known by sums alone.
fn can_sum(cloud: &Cloud, options: &RenderOptions, groups: usize) -> bool {
    matches!(options.resolve, Resolve::Surface { thickness: Thickness::AroundHit, .. })
        && few(options.aovs)
        && cloud.opacities.is_none()
        && !options.material.varies_by_pixel()
        && !two_sided(cloud, options)
        && groups <= MOST_SUMMED
}

/// Whether both sides of a splat can be seen, and are not the same to the resolve.
fn two_sided(cloud: &Cloud, options: &RenderOptions) -> bool {
    cloud.oriented && !options.cull && options.resolve != Resolve::Over
}

/// Whether the AOVs need no more of a sample than its colour, transmittance and coverage.
fn few(aovs: AovSelection) -> bool {
    let AovSelection { depth, normal, albedo, position, id, layers, .. } = aovs;
    !(depth || normal || albedo || position || id || layers)
}
