//! Candidates of a splat against the evaluation: the rasterization loop (L164-203).

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

    /// The sample positions.
    pub fn samples(&self) -> &SampleTable {
        &self.samples
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
        let constants = &splat.constants;
        let limits = &self.limits;
        match self.form {
            Form::Pinhole => self.visit(splat, rank, region, sink, |d, _, _| constants.pinhole(d, limits)),
            Form::ThinLens => self.visit(splat, rank, region, sink, |d, lens, sample| {
                constants.thin_lens(d, &lens[sample], limits)
            }),
            Form::Orthographic => {
                self.visit(splat, rank, region, sink, |d, _, _| constants.orthographic(d, limits));
            }
        }
        region.area() as u64 * self.range.len() as u64
    }

    /// The loop itself; `evaluate` gets the sample's offset, the pixel's lens points and the sample's index.
    #[inline(always)]
    fn visit(
        &self,
        splat: &VisibleSplat,
        rank: u32,
        region: &PixelRect,
        sink: &mut impl FnMut(SamplePlace, Fragment),
        evaluate: impl Fn([f32; 2], &[LensPoint<f32>], usize) -> Option<Hit<f32>>,
    ) {
        for y in region.y0..region.y1 {
            for x in region.x0..region.x1 {
                let jitter = self.samples.jitter(x, y);
                let lens = self.samples.lens(x, y);
                for sample in self.range.clone() {
                    let offset = splat.constants.offset(x, y, jitter[sample]);
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
