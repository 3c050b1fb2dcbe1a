//! From the fragments of a pixel's samples to its sums, and to the film. SPEC section 6.

use crate::film::NO_ID;
use crate::raster::SamplePlace;
use crate::sampling::SampleTable;
use crate::setup::{View, VisibleSplat, shading_normal, splat_color};
use crate::shade::{Shaded, SplatShader};
use crate::sums::{Ending, Sums};
use crate::texture::ImageLookup;
use crate::{AovSelection, Camera, Cloud, Error, Film, PixelRect, RenderOptions, Shading};
use glam::{DMat3, DVec2, DVec3};
use splat_abuffer::{Fragment, Resolver, SampleColor, SplatSurface};

/// Resolves the samples of one pixel after the other.
///
/// Sums are in `f64`, in the order of the samples: so the mean of a part of the samples, joined with the mean of the
/// rest, agrees with the mean of all to rounding.
#[derive(Debug)]
pub struct PixelResolver<'a> {
    cloud: &'a Cloud,
    view: &'a View,
    to_world: DMat3,
    aovs: AovSelection,
    shading: Shading,
    ending: Ending,
    options: &'a RenderOptions,
    resolver: Resolver,
    splats: &'a [VisibleSplat],
    surfaces: &'a [SplatSurface],
    /// If it knows more of the colours than `surfaces`.
    shader: Option<SplatShader<'a>>,
    /// The colours of the pixel's splats that were asked for, by rank.
    shaded: Vec<(u32, Shaded)>,
    sums: Sums,
    /// Samples that were added.
    samples: u32,
    id: Option<u32>,
}

/// What a fragment's splat shares among its fragments, of this pixel at least.
fn surface_of(fragment: &Fragment, surfaces: &[SplatSurface], shaded: &[(u32, Shaded)]) -> SplatSurface {
    let rank = fragment.rank();
    let surface = surfaces[rank as usize];
    match shaded.iter().find(|&&(known, _)| known == rank) {
        None => surface,
        Some((_, Shaded { color, .. })) => SplatSurface { color: *color, ..surface },
    }
}

impl<'a> PixelResolver<'a> {
    /// A resolver for a frame with these splats and what their fragments share, both by rank; `images` looks up the material's.
    pub fn new(
        cloud: &'a Cloud,
        camera: &Camera,
        options: &'a RenderOptions,
        view: &'a View,
        splats: &'a [VisibleSplat],
        surfaces: &'a [SplatSurface],
        images: &'a dyn ImageLookup,
    ) -> Self {
        let material = &options.material;
        let needs_shader = material.varies_by_pixel() || (options.aovs.albedo && !material.is_plain());
        Self {
            cloud,
            view,
            to_world: camera.linear().inverse(),
            aovs: options.aovs,
            shading: options.shading,
            ending: Ending::of(options),
            options,
            resolver: Resolver::new(options.resolve),
            surfaces,
            shader: needs_shader.then(|| SplatShader::new(cloud, view, options, images)),
            shaded: Vec::new(),
            splats,
            sums: Sums::default(),
            samples: 0,
            id: None,
        }
    }

    /// Begins a pixel.
    pub fn start(&mut self) {
        self.sums = Sums::default();
        self.samples = 0;
        self.id = None;
        self.shaded.clear();
    }

    /// Adds the next sample, given its fragments.
    pub fn add(&mut self, place: SamplePlace, fragments: &mut [Fragment], samples: &SampleTable) {
        let sample = if fragments.is_empty() {
            SampleColor::NOTHING
        } else {
            self.shade(place, fragments);
            self.resolver
                .resolve_with(fragments, |fragment| surface_of(fragment, self.surfaces, &self.shaded))
        };
        self.add_colors(std::iter::once(sample));
        if !fragments.is_empty() {
            self.add_aovs(place, fragments, samples);
        }
    }

    /// Makes sure that the colours of some fragments' splats in this pixel are known.
    fn shade(&mut self, place: SamplePlace, fragments: &[Fragment]) {
        let Some(shader) = &self.shader else { return };
        for fragment in fragments {
            let rank = fragment.rank();
            if self.shaded.iter().all(|&(known, _)| known != rank) {
                let index = self.splats[rank as usize].index as usize;
                if let Some(splat) = shader.splat(index) {
                    self.shaded.push((rank, shader.shade(&splat, place.x, place.y)));
                }
            }
        }
    }

    /// The unlit colour of a splat in this pixel.
    fn albedo(&self, rank: u32) -> [f32; 3] {
        if let Some((_, shaded)) = self.shaded.iter().find(|&&(known, _)| known == rank) {
            return shaded.albedo;
        }
        splat_color(self.cloud, self.splats[rank as usize].index as usize, self.view, self.shading)
    }

    /// Adds the next samples, already resolved; enough where no AOV is wanted but variance, coverage and samples.
    #[inline(always)]
    pub fn add_colors(&mut self, samples: impl Iterator<Item = SampleColor>) {
        if self.aovs.variance || self.aovs.coverage {
            let (mut sums, mut count) = (self.sums, self.samples);
            for sample in samples {
                count += 1;
                sums.add(&sample, &self.aovs);
            }
            (self.sums, self.samples) = (sums, count);
        } else {
            // So it nearly always is: the few sums that it needs stay in registers.
            let Sums { mut color, mut transmittance, .. } = self.sums;
            let mut count = self.samples;
            for sample in samples {
                count += 1;
                for (sum, value) in color.iter_mut().zip(sample.color) {
                    *sum += f64::from(value);
                }
                transmittance += f64::from(sample.transmittance);
            }
            (self.sums.color, self.sums.transmittance, self.samples) = (color, transmittance, count);
        }
    }

    /// A film of which every pixel is as one without fragments, with this many samples each.
    ///
    /// # Errors
    /// [`Error::Memory`].
    pub fn empty_film(&mut self, frame: [u32; 2], window: PixelRect, samples: usize) -> Result<Film, Error> {
        let mut film = Film::for_picture(frame, window, self.options)?;
        self.start();
        self.add_colors((0..samples).map(|_| SampleColor::NOTHING));
        self.finish(window.x0, window.y0, &mut film);
        film.repeat_first_pixel();
        Ok(film)
    }

    /// Adds to the sums what only the AOVs need.
    fn add_aovs(&mut self, place: SamplePlace, fragments: &[Fragment], samples: &SampleTable) {
        let layers = self.resolver.layers();
        self.sums.layers += layers.len() as f64;
        if self.aovs.id && self.id.is_none() && !layers.is_empty() {
            let front = self.resolver.fragments_of(&layers[0], fragments);
            // The first of the heaviest, in splat order.
            let heaviest = front.reduce(|best, next| if next.weight > best.weight { next } else { best });
            self.id = heaviest.map(|fragment| self.splats[fragment.rank() as usize].index);
        }
        let AovSelection { depth, normal, albedo, position, .. } = self.aovs;
        if !(depth || normal || albedo || position) {
            return;
        }
        let Some(layer) = self.resolver.visible_layer() else { return };
        let (mut weight, mut depth_sum) = (0.0, 0.0);
        let (mut normal_sum, mut albedo_sum) = (DVec3::ZERO, DVec3::ZERO);
        for fragment in self.resolver.fragments_of(layer, fragments) {
            let index = self.splats[fragment.rank() as usize].index as usize;
            let w = f64::from(fragment.weight);
            weight += w;
            depth_sum += w * f64::from(fragment.depth);
            if normal {
                normal_sum += w * self.facing_normal(index);
            }
            if albedo {
                albedo_sum += w * DVec3::from(self.albedo(fragment.rank()).map(f64::from));
            }
        }
        let depth = depth_sum / weight;
        self.sums.visible += 1.0;
        self.sums.depth += depth;
        self.sums.add_normal(normal_sum.normalize_or_zero());
        self.sums.albedo += albedo_sum / weight;
        if position {
            self.sums.position += self.world_position(place, depth, samples) - self.cloud.origin;
        }
    }

    /// The world normal of a splat; where normals do not tell the outside, the one that faces the eye.
    fn facing_normal(&self, index: usize) -> DVec3 {
        if self.cloud.oriented {
            return self.cloud.normals[index].as_dvec3().normalize();
        }
        shading_normal(self.cloud, index, self.view)
    }

    /// The world position of the point at depth `w` on a sample's ray.
    fn world_position(&self, place: SamplePlace, w: f64, samples: &SampleTable) -> DVec3 {
        let jitter = samples.jitter(place.x, place.y)[place.sample];
        let ([x, y], jitter) = self.view.ideal_sample(place.x, place.y, jitter);
        let pixel = DVec2::new(f64::from(x), f64::from(y)) + DVec2::from(jitter.map(f64::from));
        let screen = (pixel - self.view.principal_point) / self.view.pixel_scale;
        let xy = match self.view.lens {
            _ if self.view.orthographic => screen,
            None => screen * w,
            Some(lens) => {
                // The ray goes from the lens point p at depth 0 through (focus s, focus).
                let unit = samples.unit_lens(place.x, place.y)[place.sample];
                let p = DVec2::from(unit.map(f64::from)) * lens.radius;
                p + (screen - p / lens.focus) * w
            }
        };
        self.view.eye + self.to_world * xy.extend(w)
    }

    /// Writes the pixel's means to the film.
    pub fn finish(&self, x: i32, y: i32, film: &mut Film) {
        let index = film.index(x, y);
        self.sums.finish(self.samples, &self.ending, index, film);
        if let Some(ids) = &mut film.id {
            ids[index] = self.id.unwrap_or(NO_ID);
        }
    }
}
