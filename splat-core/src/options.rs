//! What the caller decides about a picture.

use crate::kernel::{Kernel, TableMode};
use crate::sampling::{PatternKind, PixelFilter};
use crate::shade::Optics;
use crate::{AovSelection, Cloud, Error, Materials, PixelRect, SampleSums};
use glam::DVec3;
use splat_abuffer::{Coverage, Resolve, Thickness};
use std::ops::Range;

/// Everything about a picture but the cloud and the camera. The default is what `surface` wants.
#[derive(Debug, Clone, PartialEq)]
pub struct RenderOptions {
    /// Number of samples a pixel, 1 to [`MAX_SAMPLES`].
    pub samples: u32,
    /// Which of them are taken; `None` for all.
    pub sample_range: Option<Range<u32>>,
    /// The pixels to render; `None` for the whole frame.
    pub window: Option<PixelRect>,
    /// The pixel filter.
    pub filter: PixelFilter,
    /// The set of sample positions.
    pub pattern: PatternKind,
    /// Seed of the sample positions.
    pub seed: u64,
    /// The shape of a splat's weight.
    pub kernel: Kernel,
    /// F: a splat reaches to sqrt(F) sigma; greater than 0, at most 64.
    pub cutoff: f64,
    /// How the kernel's table is read.
    pub table: TableMode,
    /// How fragments become a colour.
    pub resolve: Resolve,
    /// c: the half thickness of a fragment, in sigma along the normal; 0 or more.
    pub thickness: f64,
    /// Whether splats are seen from the front only.
    pub cull: bool,
    /// What stands behind everything: linear red, green, blue, and alpha; `None` is transparent.
    pub background: Option<[f32; 4]>,
    /// How light falls on splats.
    pub shading: Shading,
    /// What colours splats besides the cloud.
    pub material: Materials,
    /// What is computed besides colour and alpha.
    pub aovs: AovSelection,
    /// Bytes that the fragments of a tile may take; a tile that needs more is split, to a pixel if need be.
    pub tile_memory: usize,
    /// Bytes that a picture may take besides the cloud, the material and what a renderer keeps: for its samples, set-up, lists,
    /// film and, on all threads together, fragments. What cannot do with that is [`Error::Memory`]; `usize::MAX` is without
    /// limit.
    pub memory: usize,
}

/// How light falls on splats.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shading {
    /// The cloud's colour as it is (white where it has none).
    Color,
    /// The cloud's colour (light grey where it has none), lit by a lamp at the eye.
    Headlight,
    /// The cloud's colour (light grey where it has none), lit from infinitely far away: Lambert's law, and some light from
    /// all around.
    Lambert {
        /// To the light, in the world; its length does not matter.
        to_light: DVec3,
    },
}

/// Greatest number of samples a pixel.
pub const MAX_SAMPLES: u32 = 65_536;

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            samples: 16,
            sample_range: None,
            window: None,
            filter: PixelFilter::BlackmanHarris,
            pattern: PatternKind::Dealt,
            seed: 0,
            kernel: Kernel::Windowed,
            cutoff: 4.0,
            table: TableMode::Poly8,
            resolve: Resolve::Surface { coverage: Coverage::Opaque, thickness: Thickness::AroundHit },
            thickness: 0.5,
            cull: false,
            background: None,
            shading: Shading::Color,
            material: Materials::default(),
            aovs: AovSelection::default(),
            tile_memory: 64 << 20,
            memory: usize::MAX,
        }
    }
}

impl RenderOptions {
    /// What suits a cloud: trained splats are blended one by one, surfels without a colour are lit from the eye, all else
    /// is as by default.
    pub fn suited_to(cloud: &Cloud) -> Self {
        if cloud.trained {
            return Self { resolve: Resolve::Over, kernel: Kernel::Gaussian, cutoff: 9.0, ..Self::default() };
        }
        let has_colors = cloud.colors.is_some() || cloud.harmonics.is_some();
        let shading = if has_colors { Shading::Color } else { Shading::Headlight };
        Self { shading, ..Self::default() }
    }

    /// The samples that are taken.
    pub fn sample_range(&self) -> Range<u32> {
        self.sample_range.clone().unwrap_or(0..self.samples)
    }

    /// Whether those are not all: then the rest is to be added, and the film keeps its sums.
    pub fn takes_part_of_samples(&self) -> bool {
        self.sample_range() != (0..self.samples)
    }

    /// Bytes that the film takes for each pixel, with its sums if it keeps them.
    pub fn film_bytes_per_pixel(&self) -> usize {
        let sums = if self.takes_part_of_samples() { SampleSums::bytes_per_pixel(self.aovs) } else { 0 };
        self.aovs.bytes_per_pixel() + sums
    }

    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field, what it holds, and what it may hold.
    pub fn check(&self) -> Result<(), Error> {
        if self.samples == 0 || self.samples > MAX_SAMPLES {
            return Err(Error::invalid("samples", self.samples, "1 to 65536"));
        }
        if self.pattern == PatternKind::PoissonDisc && self.samples > 1024 {
            return Err(Error::invalid(
                "samples",
                self.samples,
                "at most 1024 with the Poisson-disc pattern",
            ));
        }
        let range = self.sample_range();
        if range.start >= range.end || range.end > self.samples {
            let found = format!("{}:{}", range.start, range.end);
            return Err(Error::invalid("sample range", found, "A:B with A < B, B at most the samples"));
        }
        if !(self.cutoff > 0.0 && self.cutoff <= 64.0) {
            return Err(Error::invalid("cutoff", self.cutoff, "more than 0, at most 64"));
        }
        if !(self.thickness.is_finite() && self.thickness >= 0.0) {
            return Err(Error::invalid("thickness", self.thickness, "a finite number, 0 or more"));
        }
        if let Resolve::Surface { coverage: Coverage::Soft { saturation }, .. } = self.resolve
            && !(saturation.is_finite() && saturation > 0.0)
        {
            return Err(Error::invalid("wsat", saturation, "a finite number greater than 0"));
        }
        if let Shading::Lambert { to_light } = self.shading
            && !(to_light.is_finite() && to_light.length_squared() > 0.0)
        {
            return Err(Error::invalid("light", to_light, "a finite direction, not zero"));
        }
        for material in self.material.iter() {
            if let Some(Optics::Refract(index)) = material.environment.as_ref().map(|all| all.optics())
                && !(index.is_finite() && index > 0.0)
            {
                return Err(Error::invalid("index of refraction", index, "a finite number greater than 0"));
            }
        }
        if let Some(background) = self.background
            && !(background.iter().all(|value| value.is_finite()) && (0.0..=1.0).contains(&background[3]))
        {
            return Err(Error::invalid("background", format!("{background:?}"), "finite, alpha in [0, 1]"));
        }
        Ok(())
    }
}
