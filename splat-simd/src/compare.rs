//! Both cores side by side: their fragments, splat by splat.

use crate::lanes::{LANES, Level};
use crate::lattice::{CellList, Lattice};
use crate::lens_image::LensImages;
use crate::lens_sums::{LensSamples, LensSums, LensSumsJob};
use crate::places::{PLACES, PlaceList, TILE, pixel_of};
use crate::raster::{LatticeJob, RasterFrame, RasterJob, Target};
use crate::records::{RecordBuffer, cell_of};
use crate::render::set_up;
use crate::samples::{DistortedSamples, LaneSamples};
use splat_abuffer::Fragment;
use splat_core::raster::SamplePlace;
use splat_core::render::Frame;
use splat_core::setup::SetUp;
use splat_core::{Camera, Cloud, Error, PixelRect, RenderOptions};

/// Pixels around a splat's candidates in which [`compare`] looks for hits of the reference that neither core visits.
const BORDER: i32 = 2;

/// Bytes for samples in some orders: less than a frame takes, so that not every splat finds one made for it.
const ORDER_BYTES: usize = 1 << 20;

/// The fast core, one splat at a time.
struct SplatBySplat<'a> {
    frame: &'a Frame,
    samples: LaneSamples,
    lattice: Option<Lattice>,
    lens_samples: Option<LensSamples>,
    level: Level,
    records: RecordBuffer,
    places: PlaceList,
    distorted: DistortedSamples,
    cells: CellList,
    lens_sums: LensSums,
}

impl<'a> SplatBySplat<'a> {
    fn new(frame: &'a Frame, level: Level) -> Self {
        let images = LensImages::new(&frame.view);
        let lens_samples = images.map(|images| {
            let defocus = images.defocus_range(&frame.set_up.splats);
            LensSamples::new(&frame.rasterizer, images, defocus, ORDER_BYTES)
        });
        Self {
            frame,
            samples: LaneSamples::new(&frame.rasterizer),
            lattice: images.map(|images| Lattice::new(&frame.rasterizer, images)),
            lens_samples,
            level,
            records: RecordBuffer::default(),
            places: PlaceList::default(),
            distorted: DistortedSamples::default(),
            cells: CellList::default(),
            lens_sums: LensSums::default(),
        }
    }

    /// Gives the fragments of a splat to `sink`: tile by tile, then by pixel and sample. Returns the number of samples
    /// tested.
    fn fragments(&mut self, rank: usize, method: Method, sink: &mut dyn FnMut(SamplePlace, Fragment)) -> u64 {
        let bounds = self.frame.set_up.splats[rank].bounds;
        let mut tests = 0;
        for row in bounds.y0.div_euclid(TILE)..=(bounds.y1 - 1).div_euclid(TILE) {
            for column in bounds.x0.div_euclid(TILE)..=(bounds.x1 - 1).div_euclid(TILE) {
                let [x, y] = [column * TILE, row * TILE];
                let tile = PixelRect::new(x, y, x + TILE, y + TILE);
                let region = tile.intersect(&self.frame.view.window);
                if method == Method::LensSamples && self.shows_one_side(rank) {
                    tests += self.hit(rank, region);
                    self.collect_hits(rank, [x, y], sink);
                } else {
                    tests += self.rasterize(rank, region, method);
                    self.collect([x, y], method, sink);
                }
            }
        }
        tests
    }

    /// Whether a lens, if there is one, shows but one side of a splat.
    fn shows_one_side(&self, rank: usize) -> bool {
        let one = !self.frame.set_up.splats[rank].flips || self.frame.rasterizer.culls();
        one && self.lens_samples.is_some()
    }

    /// Finds the fragments of a splat in a region of a tile sample by sample. Returns the number of samples tested.
    fn hit(&mut self, rank: usize, region: PixelRect) -> u64 {
        let frame = RasterFrame::new(self.frame, &self.samples);
        let (ranks, buffers) = (&[rank as u32], &mut self.lens_sums);
        self.lens_samples.as_ref().map_or(0, |samples| {
            let [tests, _] =
                self.level.run_single(LensSumsJob { frame, samples, ranks, region, buffers, sums: None });
            tests
        })
    }

    /// Gives those fragments to `sink`.
    fn collect_hits(&self, rank: usize, corner: [i32; 2], sink: &mut dyn FnMut(SamplePlace, Fragment)) {
        let first = self.frame.rasterizer.range().start;
        // What shows both sides is culled.
        let splat = &self.frame.set_up.splats[rank];
        let back = splat.back && !splat.flips;
        for ([cell, lane], depth, weight) in self.lens_sums.found() {
            let [column, row] = pixel_of((cell % PLACES) as u16);
            let sample = first + cell / PLACES * LANES + lane;
            let place = SamplePlace { x: corner[0] + column, y: corner[1] + row, sample };
            sink(place, Fragment::new(depth, weight, rank as u32, back));
        }
    }

    /// Makes the fragments of a splat in a region of a tile.
    fn rasterize(&mut self, rank: usize, region: PixelRect, method: Method) -> u64 {
        let frame = RasterFrame::new(self.frame, &self.samples);
        let candidates = self.frame.set_up.splats[rank].bounds.intersect(&region);
        self.distorted.fill(&self.frame.rasterizer, &candidates, self.level);
        let Self { records, places, distorted, cells, .. } = self;
        records.clear(self.samples.groups(), false, usize::MAX);
        let ranks = &[rank as u32];
        let tests = match (method, &self.lattice) {
            (Method::LensPoints, Some(lattice)) => {
                let job = LatticeJob { frame, lattice, ranks, region, records, cells };
                self.level.run_single(job)
            }
            _ => {
                let target = Target::Records;
                self.level.run(RasterJob { frame, ranks, region, records, places, distorted, target })
            }
        };
        self.records.group();
        tests
    }

    /// Gives the fragments of the tile of which `corner` is the first pixel to `sink`.
    fn collect(&self, corner: [i32; 2], method: Method, sink: &mut dyn FnMut(SamplePlace, Fragment)) {
        if self.records.fragments == 0 {
            return;
        }
        let first = self.frame.rasterizer.range().start;
        for pixel in 0..PLACES as u16 {
            let [column, row] = pixel_of(pixel);
            for number in 0..self.samples.samples() {
                let (cell, lane) = match (method, &self.lattice) {
                    (Method::LensPoints, Some(lattice)) => lattice.cell_of(pixel, number),
                    _ => (cell_of(pixel, number / LANES), number % LANES),
                };
                let place = SamplePlace { x: corner[0] + column, y: corner[1] + row, sample: first + number };
                let [entries, _] = self.records.cell(cell);
                for fragment in entries.iter().filter_map(|&entry| self.records.fragment(entry, lane)) {
                    sink(place, fragment);
                }
            }
        }
    }
}

/// How the fast core looks for fragments: all ways find the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Pixel by pixel, eight samples of each at once.
    Pixels,
    /// Eight neighbouring points of the lens at once, for large circles of confusion; without a lens pixel by pixel.
    LensPoints,
    /// Sample by sample, where they look through the lens; without a lens, or for splats of which it shows both sides, pixel by
    /// pixel.
    LensSamples,
}

impl Method {
    /// Every one.
    pub const ALL: [Self; 3] = [Self::Pixels, Self::LensPoints, Self::LensSamples];
}

/// Gives every fragment of a picture to `sink`, as [`splat_core::fragments()`] does: splat by splat in splat order, but
/// each splat's tile by tile. Returns the number of samples tested.
///
/// # Errors
/// As [`splat_core::render()`].
pub fn fragments(
    cloud: &Cloud,
    camera: &Camera,
    options: &RenderOptions,
    level: Level,
    method: Method,
    sink: &mut dyn FnMut(SamplePlace, u32, Fragment),
) -> Result<u64, Error> {
    let frame = Frame::new(cloud, camera, options, |cloud, view, options| {
        set_up(cloud, view, options, SetUp::default())
    })?;
    let mut fast = SplatBySplat::new(&frame, level);
    let splats = frame.set_up.splats.iter().enumerate();
    Ok(splats
        .map(|(rank, splat)| {
            fast.fragments(rank, method, &mut |place, fragment| sink(place, splat.index, fragment))
        })
        .sum())
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
/// else the number of fragments in which they agree. The reference tests every sample of the splat's box and of a border
/// around it, wherever the fast core looks, and through a lens the fast core looks by all of its methods. `progress` is told
/// the finished part, from 0 to 1.
///
/// # Errors
/// As [`splat_core::render()`].
pub fn compare(
    cloud: &Cloud,
    camera: &Camera,
    options: &RenderOptions,
    level: Level,
    progress: &mut dyn FnMut(f64),
) -> Result<Result<u64, Difference>, Error> {
    let frame = Frame::new(cloud, camera, options, |cloud, view, options| {
        set_up(cloud, view, options, SetUp::default())
    })?;
    let mut core = SplatBySplat::new(&frame, level);
    let methods: &[Method] = if core.lattice.is_some() { &Method::ALL } else { &[Method::Pixels] };
    let count = frame.set_up.splats.len();
    let (mut reference, mut fast) = (Vec::new(), Vec::new());
    let mut total = 0;
    for (rank, splat) in frame.set_up.splats.iter().enumerate() {
        if rank % 256 == 0 {
            progress(rank as f64 / count as f64);
        }
        let PixelRect { x0, y0, x1, y1 } = splat.bounds;
        let near = PixelRect::new(x0 - BORDER, y0 - BORDER, x1 + BORDER, y1 + BORDER);
        reference.clear();
        frame.rasterizer.rasterize(
            splat,
            rank as u32,
            &near.intersect(&frame.view.window),
            &mut |place, fragment| reference.push((place, fragment)),
        );
        // One order for both: rows, columns, samples.
        let key = |place: &SamplePlace| (place.y, place.x, place.sample);
        reference.sort_by_key(|(place, _)| key(place));
        for &method in methods {
            fast.clear();
            core.fragments(rank, method, &mut |place, fragment| fast.push((place, fragment)));
            fast.sort_by_key(|(place, _)| key(place));
            if let Some(difference) = first_difference(&reference, &fast, splat.index) {
                return Ok(Err(difference));
            }
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
