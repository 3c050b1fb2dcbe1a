//! From a cloud to a picture: set-up, tiles, A-buffer, resolve, film.

use crate::film::{FILM, SMALLER_FILM};
use crate::memory::{Budget, filled};
use crate::pixel::PixelResolver;
use crate::raster::{Rasterizer, SamplePlace};
use crate::setup::{SetUp, SortKey, View, VisibleSplat, set_up, sort_keys};
use crate::texture::ScalarLookup;
use crate::{AovSelection, Camera, Cloud, Error, Film, PixelRect, RenderOptions};
use splat_abuffer::{Fragment, MAX_RANK, SplatSurface, TileBuffer};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Side of a tile, in pixels: that of the selection table.
const TILE: i32 = crate::sampling::SELECTION_SIZE as i32;

/// A finished picture, and what it took.
#[derive(Debug, Clone, PartialEq)]
pub struct Rendered {
    /// The picture.
    pub film: Film,
    /// What it took.
    pub statistics: Statistics,
}

/// What a picture took. Times of one thread.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Statistics {
    /// Splats of the cloud that were never rendered, by cause.
    pub dropped: BTreeMap<&'static str, usize>,
    /// Splats that were rasterised.
    pub drawn: usize,
    /// Samples tested against a splat.
    pub tests: u64,
    /// Fragments resolved.
    pub fragments: u64,
    /// Samples resolved.
    pub samples: u64,
    /// Time of set-up.
    pub setup: Duration,
    /// Time of sorting splats into tiles.
    pub bin: Duration,
    /// Time of making fragments.
    pub raster: Duration,
    /// Time of resolving them.
    pub resolve: Duration,
}

impl Statistics {
    /// Adds what some tiles took.
    pub fn add_tiles(&mut self, tiles: &Self) {
        self.tests += tiles.tests;
        self.fragments += tiles.fragments;
        self.samples += tiles.samples;
        self.raster += tiles.raster;
        self.resolve += tiles.resolve;
    }
}

/// A picture in the making: its first tiles are finished, whatever the threads.
#[derive(Debug, Clone, PartialEq)]
pub struct Unfinished {
    /// The finished tiles; what the others hold means nothing.
    pub film: Film,
    /// How many are finished.
    pub tiles: usize,
    /// What they took.
    pub statistics: Statistics,
}

impl Unfinished {
    /// Checks that this can become the picture of a frame of this window, these AOVs and so many tiles.
    ///
    /// # Errors
    /// [`Error::Invalid`] if it is part of another one.
    pub fn check(
        &self,
        frame: [u32; 2],
        window: PixelRect,
        aovs: AovSelection,
        tiles: usize,
    ) -> Result<(), Error> {
        let film = &self.film;
        if (film.frame, film.window, film.aovs()) == (frame, window, aovs) && self.tiles <= tiles {
            return Ok(());
        }
        let found = format!("{} tiles of {}x{} pixels", self.tiles, film.frame[0], film.frame[1]);
        Err(Error::invalid("unfinished picture", found, "one of the same frame, window and AOVs"))
    }
}

/// Renders a cloud. `progress` is told the finished part of the picture, from 0 to 1, now and then.
///
/// The cloud must have normals, and sizes and areas if the picture is to be free of holes: see
/// [`crate::prepare::prepare`].
///
/// # Errors
/// If the camera, the options or the cloud's arrays are out of range, or there is too little memory. Bad points are no error;
/// they are counted.
pub fn render(
    cloud: &Cloud,
    camera: &Camera,
    options: &RenderOptions,
    progress: &mut dyn FnMut(f64),
) -> Result<Rendered, Error> {
    render_from(None, cloud, camera, options, &mut |done, _| progress(done))
}

/// Renders a cloud, from where it was left: the same bits as [`render`], if `begun` is a part of the same picture. `watch` is
/// told the finished part, from 0 to 1, and what that looks like, now and then.
///
/// # Errors
/// As [`render`]; [`Error::Invalid`] if `begun` cannot be part of it.
pub fn render_from(
    begun: Option<Unfinished>,
    cloud: &Cloud,
    camera: &Camera,
    options: &RenderOptions,
    watch: &mut dyn FnMut(f64, &Unfinished),
) -> Result<Rendered, Error> {
    let frame = Frame::new(cloud, camera, options, set_up)?;
    let window = frame.view.window;
    let mut memory = frame.memory;
    let start = Instant::now();
    let tiles = Tiles::new(&frame.set_up.splats, &window, &mut memory)?;
    let statistics = frame.statistics(start.elapsed());
    let size = [camera.width, camera.height];
    let mut made = match begun {
        Some(begun) => begun,
        None => Unfinished {
            film: Film::for_picture(size, window, options)?,
            tiles: 0,
            statistics: Statistics::default(),
        },
    };
    made.check(size, window, options.aovs, tiles.len())?;
    let tiles_before = std::mem::replace(&mut made.statistics, statistics);
    made.statistics.add_tiles(&tiles_before);
    made.film.position_origin = cloud.origin;
    // The stream and the groups grow by doubling.
    let share = memory.left() / 3;
    let mut picture = Picture {
        frame: &frame,
        pixels: PixelResolver::new(
            cloud,
            camera,
            options,
            &frame.view,
            &frame.set_up.splats,
            &frame.set_up.surfaces,
            &ScalarLookup,
        ),
        buffer: TileBuffer::default(),
        budget: options.tile_memory.min(share) / TileBuffer::BYTES_PER_FRAGMENT,
        most: if memory.is_limited() { share / TileBuffer::BYTES_PER_FRAGMENT } else { usize::MAX },
        made,
    };
    let count = tiles.len();
    for tile in picture.made.tiles..count {
        watch(tile as f64 / count as f64, &picture.made);
        let (region, ranks) = tiles.get(tile);
        picture.render_region(&region, ranks)?;
        picture.made.tiles += 1;
    }
    watch(1.0, &picture.made);
    let Unfinished { film, statistics, .. } = picture.made;
    Ok(Rendered { film, statistics })
}

/// Gives every fragment of a picture to `sink`, splat by splat in splat order: its place, its splat's index in the
/// cloud, and the fragment. Returns the number of samples tested.
///
/// # Errors
/// As [`render`].
pub fn fragments(
    cloud: &Cloud,
    camera: &Camera,
    options: &RenderOptions,
    sink: &mut dyn FnMut(SamplePlace, u32, Fragment),
) -> Result<u64, Error> {
    let frame = Frame::new(cloud, camera, options, set_up)?;
    let splats = frame.set_up.splats.iter().enumerate();
    Ok(splats
        .map(|(rank, splat)| {
            let mut sink = |place, fragment| sink(place, splat.index, fragment);
            frame.rasterizer.rasterize(splat, rank as u32, &splat.bounds, &mut sink)
        })
        .sum())
}

/// Everything that is ready before the first fragment, the same in every core.
#[derive(Debug)]
pub struct Frame {
    /// The camera as set-up sees it.
    pub view: View,
    /// The visible splats, in splat order.
    pub set_up: SetUp,
    /// What set-up took.
    pub set_up_time: Duration,
    /// The samples and the kernel.
    pub rasterizer: Rasterizer,
    /// What is left of [`RenderOptions::memory`] after all this and the film.
    pub memory: Budget,
}

/// Bytes that a splat takes in set-up: the result; and at most twice its key, once in the list that it was found in and once
/// in that of all.
const SET_UP_BYTES: usize =
    size_of::<VisibleSplat>() + size_of::<SplatSurface>() + 3 * size_of::<SortKey>() + 4;

/// At most so many bytes a sample of a pixel take the tables of all cores: 64 patterns of positions, and of points on the lens,
/// as they are made, in the order of the reference, and in that of lanes.
const SAMPLE_BYTES: usize = 8 << 10;

/// The same with a lens: its points, and the cells of a lattice.
const LENS_SAMPLE_BYTES: usize = 40 << 10;

/// Splats that are counted at once.
const COUNT_CHUNK: usize = 4096;

/// Sets memory aside for the samples, the film and the set-up of a picture.
fn budget(cloud: &Cloud, camera: &Camera, view: &View, options: &RenderOptions) -> Result<Budget, Error> {
    let mut memory = Budget::new(options.memory);
    if !memory.is_limited() {
        return Ok(memory);
    }
    let per_sample = if camera.lens().is_some() { LENS_SAMPLE_BYTES } else { SAMPLE_BYTES };
    let samples = per_sample * options.samples as usize;
    memory.take("the table of samples", samples, "fewer samples (--spp) need less")?;
    let film = view.window.area().saturating_mul(options.film_bytes_per_pixel());
    memory.take(FILM, film, SMALLER_FILM)?;
    let mut splats = cloud.len();
    if splats.saturating_mul(SET_UP_BYTES) > memory.left() {
        // Not all may be in view: to know takes a moment.
        let chunks = (0..cloud.len()).step_by(COUNT_CHUNK);
        let ends = |start: usize| start..cloud.len().min(start + COUNT_CHUNK);
        splats = chunks.map(|start| sort_keys(cloud, view, options, ends(start)).0.len()).sum();
    }
    let set_up = splats.saturating_mul(SET_UP_BYTES);
    memory.take("the set-up of the splats in view", set_up, "a cloud of fewer points needs less")?;
    Ok(memory)
}

impl Frame {
    /// What set-up took, and `bin`, the time of sorting splats into tiles.
    pub fn statistics(&self, bin: Duration) -> Statistics {
        Statistics {
            dropped: self.set_up.dropped.clone(),
            drawn: self.set_up.splats.len(),
            setup: self.set_up_time,
            bin,
            ..Statistics::default()
        }
    }

    /// Checks everything, and sets up the splats with `set_up`, which must do as [`set_up`].
    ///
    /// # Errors
    /// As [`render`].
    pub fn new(
        cloud: &Cloud,
        camera: &Camera,
        options: &RenderOptions,
        set_up: impl FnOnce(&Cloud, &View, &RenderOptions) -> SetUp,
    ) -> Result<Self, Error> {
        camera.check()?;
        options.check()?;
        cloud.check_lengths()?;
        if cloud.len() > MAX_RANK as usize {
            return Err(Error::invalid("cloud", cloud.len(), "fewer than 2^31 splats"));
        }
        if cloud.normals.len() != cloud.len() {
            return Err(Error::Length { what: "normals", found: 0, expected: cloud.len() });
        }
        let view = View::new(camera, options);
        if view.window.is_empty() {
            return Err(Error::invalid("crop", format!("{:?}", options.window), "a part of the frame"));
        }
        let memory = budget(cloud, camera, &view, options)?;
        let start = Instant::now();
        let set_up = set_up(cloud, &view, options);
        let set_up_time = start.elapsed();
        let rasterizer = Rasterizer::new(&view, options);
        Ok(Self { view, set_up, set_up_time, rasterizer, memory })
    }
}

/// The tiles of a window, each with the ranks of the splats that may leave fragments in it, in splat order. The grid
/// starts at the frame's corner, whatever the window.
#[derive(Debug)]
pub struct Tiles {
    window: PixelRect,
    grid: Grid,
    /// All lists, one after the other.
    ranks: Vec<u32>,
    /// Where the list of each tile ends; it starts where that before ends.
    ends: Vec<usize>,
}

impl Tiles {
    /// Sorts splats, whose bounds lie in the window, into its tiles.
    ///
    /// # Errors
    /// [`Error::Memory`].
    pub fn new(splats: &[VisibleSplat], window: &PixelRect, memory: &mut Budget) -> Result<Self, Error> {
        const WHAT: &str = "the lists of the tiles' splats";
        const HELP: &str = "a smaller size, smaller splats, or a part at a time (--crop, --tile) need less";
        let grid = Grid::new(window);
        memory.take(WHAT, splats.len().saturating_mul(size_of::<Span>()) + 8 * grid.len(), HELP)?;
        let spans: Vec<Span> = splats.iter().map(|splat| grid.span(&splat.bounds)).collect();
        // The length of each list first, so that all fit into one array; then where it starts, which each rank moves on.
        let mut ends = vec![0; grid.len()];
        for &span in &spans {
            grid.for_each_tile(span, |tile| ends[tile] += 1);
        }
        let mut total = 0;
        for end in &mut ends {
            total += std::mem::replace(end, total);
        }
        memory.take(WHAT, size_of::<u32>().saturating_mul(total), HELP)?;
        let mut ranks = filled(WHAT, 0, total, HELP)?;
        for (rank, &span) in spans.iter().enumerate() {
            grid.for_each_tile(span, |tile| {
                ranks[ends[tile]] = rank as u32;
                ends[tile] += 1;
            });
        }
        Ok(Self { window: *window, grid, ranks, ends })
    }

    /// Number of tiles.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// The pixels of a tile, and the ranks of its splats.
    pub fn get(&self, tile: usize) -> (PixelRect, &[u32]) {
        let start = if tile == 0 { 0 } else { self.ends[tile - 1] };
        (self.grid.pixels(tile).intersect(&self.window), &self.ranks[start..self.ends[tile]])
    }

    /// [`Tiles::get`] of each tile, row by row.
    pub fn iter(&self) -> impl Iterator<Item = (PixelRect, &[u32])> {
        (0..self.len()).map(|tile| self.get(tile))
    }
}

/// The grid of the tiles of a window, numbered row by row.
#[derive(Debug)]
struct Grid {
    /// Column and row of the first tile, counted from the frame's corner.
    first: [i32; 2],
    columns: i32,
    rows: i32,
}

impl Grid {
    fn new(window: &PixelRect) -> Self {
        let first = [window.x0.div_euclid(TILE), window.y0.div_euclid(TILE)];
        let columns = (window.x1 - 1).div_euclid(TILE) - first[0] + 1;
        let rows = (window.y1 - 1).div_euclid(TILE) - first[1] + 1;
        Self { first, columns, rows }
    }

    fn len(&self) -> usize {
        (self.columns * self.rows) as usize
    }

    fn pixels(&self, tile: usize) -> PixelRect {
        let tile = tile as i32;
        let x = (self.first[0] + tile % self.columns) * TILE;
        let y = (self.first[1] + tile / self.columns) * TILE;
        PixelRect::new(x, y, x + TILE, y + TILE)
    }

    /// The tiles that a rectangle within the window reaches into.
    fn span(&self, bounds: &PixelRect) -> Span {
        // A side of a frame has at most 2048 tiles.
        let tile = |pixel: i32, axis: usize| (pixel.div_euclid(TILE) - self.first[axis]) as u16;
        Span {
            columns: [tile(bounds.x0, 0), tile(bounds.x1 - 1, 0)],
            rows: [tile(bounds.y0, 1), tile(bounds.y1 - 1, 1)],
        }
    }

    /// Calls `visit` with the number of each tile of a span.
    fn for_each_tile(&self, span: Span, mut visit: impl FnMut(usize)) {
        let [first, last] = span.columns.map(usize::from);
        for row in span.rows[0]..=span.rows[1] {
            let start = usize::from(row) * self.columns as usize;
            (start + first..start + last + 1).for_each(&mut visit);
        }
    }
}

/// Some tiles of a grid: first and last column, first and last row.
#[derive(Debug, Clone, Copy)]
struct Span {
    columns: [u16; 2],
    rows: [u16; 2],
}

/// A picture in the making.
struct Picture<'a> {
    frame: &'a Frame,
    pixels: PixelResolver<'a>,
    buffer: TileBuffer,
    /// Fragments that a tile may hold.
    budget: usize,
    /// Fragments that a pixel may hold.
    most: usize,
    made: Unfinished,
}

/// The error of a pixel of so many fragments, and bytes that each takes, where `left` bytes are left.
pub fn pixel_too_large(fragments: usize, bytes: usize, left: usize) -> Error {
    Error::Memory {
        what: "a pixel with so many fragments",
        needed: fragments.saturating_mul(bytes),
        left: Some(left),
        help: "fewer samples at a time (--samples), fewer threads (--threads) or smaller splats need less",
    }
}

impl Picture<'_> {
    /// Renders a tile, or a part of one. A region whose fragments exceed the budget is split into four; a single
    /// pixel gets what it needs, if there is as much.
    fn render_region(&mut self, region: &PixelRect, ranks: &[u32]) -> Result<(), Error> {
        let start = Instant::now();
        let complete = self.collect(region, ranks);
        self.made.statistics.raster += start.elapsed();
        if complete {
            let start = Instant::now();
            self.resolve(region);
            self.made.statistics.resolve += start.elapsed();
            return Ok(());
        }
        if region.area() == 1 {
            let bytes = TileBuffer::BYTES_PER_FRAGMENT;
            return Err(pixel_too_large(self.buffer.len(), bytes, self.most * bytes));
        }
        quarters(region).try_for_each(|quarter| self.render_region(&quarter, ranks))
    }

    /// Fills the buffer with the region's fragments. Stops and returns false where they exceed the budget.
    fn collect(&mut self, region: &PixelRect, ranks: &[u32]) -> bool {
        let rasterizer = &self.frame.rasterizer;
        let range = rasterizer.range();
        self.buffer.clear(region.area() * range.len());
        let budget = if region.area() > 1 { self.budget } else { self.most };
        let buffer = &mut self.buffer;
        let positions = rasterizer.positions(region);
        let mut tests = 0;
        for &rank in ranks {
            let splat = &self.frame.set_up.splats[rank as usize];
            let candidates = splat.bounds.intersect(region);
            tests += rasterizer.rasterize_at(&positions, splat, rank, &candidates, &mut |place, fragment| {
                buffer.push(local_sample(region, place, range.len(), range.start), fragment);
            });
            if buffer.len() > budget {
                return false;
            }
        }
        self.made.statistics.tests += tests;
        self.made.statistics.fragments += buffer.len() as u64;
        true
    }

    /// Resolves the region's samples into the film.
    fn resolve(&mut self, region: &PixelRect) {
        self.buffer.group();
        let rasterizer = &self.frame.rasterizer;
        let range = rasterizer.range();
        for y in region.y0..region.y1 {
            for x in region.x0..region.x1 {
                self.pixels.start();
                for sample in range.clone() {
                    let place = SamplePlace { x, y, sample };
                    let fragments = self.buffer.sample(local_sample(region, place, range.len(), range.start));
                    self.pixels.add(place, fragments, rasterizer.samples());
                }
                self.pixels.finish(x, y, &mut self.made.film);
            }
        }
        self.made.statistics.samples += region.area() as u64 * range.len() as u64;
    }
}

/// Index of a sample within a region.
fn local_sample(region: &PixelRect, place: SamplePlace, samples: usize, first_sample: usize) -> usize {
    let pixel = (place.y - region.y0) as usize * region.width() + (place.x - region.x0) as usize;
    pixel * samples + place.sample - first_sample
}

/// The four quarters of a region of more than one pixel; the empty ones left out.
pub fn quarters(region: &PixelRect) -> impl Iterator<Item = PixelRect> {
    let PixelRect { x0, y0, x1, y1 } = *region;
    let [x, y] = [x0 + (x1 - x0 + 1) / 2, y0 + (y1 - y0 + 1) / 2];
    [
        PixelRect::new(x0, y0, x, y),
        PixelRect::new(x, y0, x1, y),
        PixelRect::new(x0, y, x, y1),
        PixelRect::new(x, y, x1, y1),
    ]
    .into_iter()
    .filter(|quarter| !quarter.is_empty())
}
