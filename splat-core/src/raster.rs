//! Candidates of a splat against the evaluation: the rasterization loop (L164-203).

use crate::distortion::FilmMap;
use crate::evaluate::{Hit, LensPoint, Limits};
use crate::kernel::KernelTable;
use crate::sampling::SampleTable;
use crate::setup::{View, VisibleSplat};
use crate::{PixelRect, RenderOptions};
use splat_abuffer::Fragment;
use std::ops::Range;

/// What is the same for all splats of a frame.
#[derive(Debug)]
pub struct Rasterizer {
    samples: SampleTable,
    distortion: Option<FilmMap>,
    range: Range<usize>,
    limits: Limits<f32>,
    table: KernelTable,
    form: Form,
    cull: bool,
}

/// Which form of the evaluation the camera needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// [`crate::evaluate::SplatConstants::pinhole`].
    Pinhole,
    /// [`crate::evaluate::SplatConstants::thin_lens`].
    ThinLens,
    /// [`crate::evaluate::SplatConstants::orthographic`].
    Orthographic,
}

/// Where a fragment falls: pixel of the full frame, and sample of the pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct SamplePlace {
    /// Column.
    pub x: i32,
    /// Row.
    pub y: i32,
    /// Index of the sample.
    pub sample: usize,
}

impl Rasterizer {
    /// The rasterizer of a view with checked options.
    pub fn new(view: &View, options: &RenderOptions) -> Self {
        let range = options.sample_range();
        Self {
            samples: SampleTable::new(options, view.lens, view.pixel_scale),
            distortion: view.distortion,
            range: range.start as usize..range.end as usize,
            limits: Limits::new(view.cutoff, view.near, view.far),
            table: KernelTable::new(options.kernel, options.cutoff, options.table),
            form: match (view.orthographic, view.lens) {
                (true, _) => Form::Orthographic,
                (false, None) => Form::Pinhole,
                (false, Some(_)) => Form::ThinLens,
            },
            cull: options.cull,
        }
    }

    /// The sample positions, on the film if the lens distorts.
    pub fn samples(&self) -> &SampleTable {
        &self.samples
    }

    /// The lens distortion, if any.
    pub fn distortion(&self) -> Option<&FilmMap> {
        self.distortion.as_ref()
    }

    /// Where the samples of the pixels of a region look.
    pub fn positions(&self, region: &PixelRect) -> Positions<'_> {
        let moved = self.distortion.as_ref().map(|map| Moved::new(map, &self.samples, &self.range, region));
        Positions { samples: &self.samples, range: self.range.clone(), moved }
    }

    /// The table of the kernel.
    pub fn table(&self) -> &KernelTable {
        &self.table
    }

    /// Which hits count.
    pub fn limits(&self) -> &Limits<f32> {
        &self.limits
    }

    /// The form of the evaluation that the camera needs.
    pub fn form(&self) -> Form {
        self.form
    }

    /// Whether backs are not drawn.
    pub fn culls(&self) -> bool {
        self.cull
    }

    /// The indices of the samples that are taken.
    pub fn range(&self) -> Range<usize> {
        self.range.clone()
    }

    /// Tests every sample of the pixels of `region` against a splat, and gives the fragments to the sink. The region
    /// need not lie within the splat's candidates. Returns the number of tests.
    pub fn rasterize(
        &self,
        splat: &VisibleSplat,
        rank: u32,
        region: &PixelRect,
        sink: &mut impl FnMut(SamplePlace, Fragment),
    ) -> u64 {
        // A row at a time: nothing says how large the region is.
        let rows = (region.y0..region.y1).map(|y| PixelRect { y0: y, y1: y + 1, ..*region });
        rows.map(|row| self.rasterize_at(&self.positions(&row), splat, rank, &row, sink)).sum()
    }

    /// [`Self::rasterize`] given the positions of the region's samples (and perhaps others).
    pub fn rasterize_at(
        &self,
        positions: &Positions<'_>,
        splat: &VisibleSplat,
        rank: u32,
        region: &PixelRect,
        sink: &mut impl FnMut(SamplePlace, Fragment),
    ) -> u64 {
        let (constants, limits) = (&splat.constants, &self.limits);
        match self.form {
            Form::Pinhole => {
                self.visit(positions, splat, rank, region, sink, |d, _, _| constants.pinhole(d, limits));
            }
            Form::ThinLens => self.visit(positions, splat, rank, region, sink, |d, lens, sample| {
                constants.thin_lens(d, &lens[sample], limits)
            }),
            Form::Orthographic => {
                self.visit(positions, splat, rank, region, sink, |d, _, _| constants.orthographic(d, limits));
            }
        }
        region.area() as u64 * self.range.len() as u64
    }

    /// The loop itself; `evaluate` gets the sample's offset, the pixel's lens points and the sample's index.
    #[inline(always)]
    fn visit(
        &self,
        positions: &Positions<'_>,
        splat: &VisibleSplat,
        rank: u32,
        region: &PixelRect,
        sink: &mut impl FnMut(SamplePlace, Fragment),
        evaluate: impl Fn([f32; 2], &[LensPoint<f32>], usize) -> Option<Hit<f32>>,
    ) {
        for y in region.y0..region.y1 {
            for x in region.x0..region.x1 {
                let ([px, py], jitter) = positions.of(x, y);
                let lens = self.samples.lens(x, y);
                for (sample, &jitter) in self.range.clone().zip(jitter) {
                    let offset = splat.constants.offset(px, py, jitter);
                    let Some(hit) = evaluate(offset, lens, sample) else { continue };
                    let back = splat.back != (hit.flipped && splat.flips);
                    let weight = splat.weight_scale * self.table.weight(hit.r2);
                    // Finite by construction: near < depth < far, and both factors of the weight are bounded.
                    if weight > 0.0 && !(self.cull && back) {
                        sink(SamplePlace { x, y, sample }, Fragment::new(hit.depth, weight, rank, back));
                    }
                }
            }
        }
    }
}

/// Where the samples of some pixels look, in the ideal picture: at their own places, unless the lens distorts.
#[derive(Debug)]
pub struct Positions<'a> {
    samples: &'a SampleTable,
    range: Range<usize>,
    moved: Option<Moved>,
}

/// The positions of a region's samples where the lens distorts.
#[derive(Debug)]
struct Moved {
    region: PixelRect,
    corners: Vec<[i32; 2]>,
    jitter: Vec<[f32; 2]>,
}

impl Positions<'_> {
    /// The pixel of the ideal picture from whose corner the samples of a pixel are counted, and their places from there, in
    /// pixels; those that are taken. Not numbers where a sample sees nothing: then it hits nothing.
    #[inline]
    pub fn of(&self, x: i32, y: i32) -> ([i32; 2], &[[f32; 2]]) {
        let Some(Moved { region, corners, jitter }) = &self.moved else {
            return ([x, y], &self.samples.jitter(x, y)[self.range.clone()]);
        };
        let pixel = (y - region.y0) as usize * region.width() + (x - region.x0) as usize;
        (corners[pixel], &jitter[pixel * self.range.len()..][..self.range.len()])
    }
}

impl Moved {
    fn new(map: &FilmMap, samples: &SampleTable, range: &Range<usize>, region: &PixelRect) -> Self {
        let mut moved = Self { region: *region, corners: Vec::new(), jitter: Vec::new() };
        for y in region.y0..region.y1 {
            for x in region.x0..region.x1 {
                let pixel = map.pixel(x, y);
                moved.corners.push(pixel.map_or([x, y], |pixel| pixel.corner));
                let jitter = samples.jitter(x, y)[range.clone()].iter();
                moved.jitter.extend(jitter.map(|&jitter| pixel.map_or([f32::NAN; 2], |p| p.sample(jitter))));
            }
        }
        moved
    }
}
