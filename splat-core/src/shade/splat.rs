//! The colour of a splat in a pixel.

use super::{Detail, Material, ShadedPoint};
use crate::evaluate::SplatConstants;
use crate::setup::{
    CameraSplat, Extent, View, camera_splat, finished_color, light, project, rotation, shading_normal,
    splat_color, world_axes,
};
use crate::texture::filter::KERNEL_VARIANCE;
use crate::texture::{
    ImageLookup, PixelDerivatives, Ray, RayDifferential, SpacePoint, SurfacePoint, TexturePoint,
};
use crate::{Cloud, RenderOptions, Shapes};
use glam::{DMat2, DMat3, DVec2, DVec3};

/// Splats with less than this, in pixels, for a sigma have one colour for all pixels.
const SMALL: f64 = 0.5;

/// Circles of confusion of a larger radius, in pixels, are as good as this.
const LARGEST_BLUR: f64 = 1e6;

/// The least g of the centre of a pixel at which a splat's plane can be looked up: nearer to the horizon, the whole splat is.
const LEAST_G: f64 = 1.0 / 16.0;

/// The shader of a frame.
#[derive(Debug, Clone, Copy)]
pub struct SplatShader<'a> {
    cloud: &'a Cloud,
    view: &'a View,
    options: &'a RenderOptions,
    to_world: DMat3,
    images: &'a dyn ImageLookup,
}

/// A splat, ready to be shaded in any pixel.
#[derive(Debug, Clone, Copy)]
pub struct ShadedSplat {
    index: usize,
    /// Whether it has one colour for all pixels.
    is_whole: bool,
    splat: CameraSplat,
    /// The constants of section 4, and the same rounded.
    exact: SplatConstants<f64>,
    constants: SplatConstants<f32>,
    /// World position of the centre, and the sigma-scaled axes in the rotated basis of the constants.
    center: DVec3,
    axes: [DVec3; 2],
    /// The same of the texture coordinates.
    own_center: DVec2,
    own_axes: [DVec2; 2],
    /// Unit world normal, on the viewer's side.
    normal: DVec3,
    /// Variance of a pixel's view of the splat, in squared pixels: its footprint's, and that of the circle of confusion.
    variance: f64,
}

/// What a pixel sees of a splat.
#[derive(Debug, Clone, Copy)]
pub struct Sight {
    /// Where on the splat.
    point: SurfacePoint,
    /// By which rays, if that matters.
    ray: Option<RayDifferential>,
    /// The directions in which they go on, if surroundings are seen.
    surroundings: Option<SurfacePoint>,
}

impl Sight {
    /// The point at which [`Material::image`] is looked up.
    pub fn image_point(&self) -> &SurfacePoint {
        self.surroundings.as_ref().unwrap_or(&self.point)
    }
}

/// Colours of a splat, linear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shaded {
    /// Before light falls on it, or surroundings are seen in it.
    pub albedo: [f32; 3],
    /// What is seen, in the resolve's terms: `over` blends it in display space.
    pub color: [f32; 3],
}

impl<'a> SplatShader<'a> {
    /// The shader of a frame, which has its images looked up by `images`.
    pub fn new(
        cloud: &'a Cloud,
        view: &'a View,
        options: &'a RenderOptions,
        images: &'a dyn ImageLookup,
    ) -> Self {
        Self { cloud, view, options, to_world: view.linear.inverse(), images }
    }

    /// What the splat with this index in the cloud is made of.
    fn material(&self, index: usize) -> &'a Material {
        self.options.material.of(index)
    }

    /// The splat with this index in the cloud, if it has a colour of its own in each pixel; not if it is seen edge-on.
    pub fn splat_by_pixel(&self, index: usize) -> Option<ShadedSplat> {
        self.material(index).varies_by_pixel().then(|| self.splat(index))?.filter(|splat| !splat.is_whole)
    }

    /// The splat with this index in the cloud; `None` if it is seen edge-on.
    pub fn splat(&self, index: usize) -> Option<ShadedSplat> {
        let splat = camera_splat(self.cloud, index, self.view);
        let exact = project(&splat, self.view)?;
        Some(self.prepare(index, &splat, &exact))
    }

    /// The colours of a splat as a whole: at its reference point, averaged over a pixel there.
    pub(crate) fn whole(&self, index: usize, splat: &CameraSplat, exact: &SplatConstants<f64>) -> Shaded {
        let prepared = self.prepare(index, splat, exact);
        self.shaded(&prepared, &self.sight_at(&prepared, exact.pixel()))
    }

    /// The colours of a splat in the pixel (x, y).
    pub fn shade(&self, splat: &ShadedSplat, x: i32, y: i32) -> Shaded {
        self.shaded(splat, &self.sight(splat, x, y))
    }

    /// What is seen of a splat in the pixel (x, y).
    pub fn sight(&self, splat: &ShadedSplat, x: i32, y: i32) -> Sight {
        if splat.is_whole {
            return self.sight_at(splat, splat.exact.pixel());
        }
        let film = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
        // A pixel whose middle sees nothing has no fragments.
        let seen = self.view.distortion.as_ref().and_then(|map| map.pixel(x, y));
        self.sight_at(splat, seen.map_or(film, |seen| seen.middle()))
    }

    fn prepare(&self, index: usize, splat: &CameraSplat, exact: &SplatConstants<f64>) -> ShadedSplat {
        let (cloud, view) = (self.cloud, self.view);
        let [c, s] = rotation(splat, view);
        let unit_normal = cloud.normals[index].as_dvec3().normalize();
        let [t1, t2] = world_axes(cloud, index, unit_normal);
        let coordinates = cloud.texture_coordinates.as_ref().map(|all| all[index]).unwrap_or_default();
        // The axes of a round splat are nobody's: what is said about them means nothing.
        let known = matches!(cloud.shapes, Shapes::Ellipses(_));
        let [s1, s2] = [coordinates.per_u, coordinates.per_v]
            .map(|axis| if known { axis.as_dvec2() } else { DVec2::ZERO });
        let depth = splat.center.z;
        let blur = view.circle_of_confusion(Extent { min: depth, max: depth });
        // Infinite in the plane of the lens.
        let blur = (blur * view.pixel_scale.max_element()).min(LARGEST_BLUR);
        // |J|^2, the sum of its squares, by the rows (p, q) and (m, 0) of `project`.
        let (q, m) = (1.0 / exact.a1, 1.0 / exact.b[0]);
        let p = exact.b[1] * q * m;
        let is_small = p * p + q * q + m * m < SMALL * SMALL;
        ShadedSplat {
            index,
            is_whole: is_small || self.material(index).detail == Detail::Splat,
            splat: *splat,
            exact: *exact,
            constants: exact.to_f32(),
            center: cloud.world_position(index),
            axes: [c * t1 + s * t2, c * t2 - s * t1],
            own_center: coordinates.center.as_dvec2(),
            own_axes: [c * s1 + s * s2, c * s2 - s * s1],
            normal: shading_normal(cloud, index, view),
            // A disc of even density has a quarter of its squared radius.
            variance: KERNEL_VARIANCE + 0.25 * blur * blur,
        }
    }

    /// What a pixel sees of a splat, its middle being at this place of the ideal picture.
    fn sight_at(&self, splat: &ShadedSplat, pixel: DVec2) -> Sight {
        let Material { environment, shader, .. } = self.material(splat.index);
        let next = self.view.distortion.map_or(DMat2::IDENTITY, |map| map.next_pixels(pixel));
        let point = splat.surface_point(pixel - splat.exact.pixel(), next);
        let ray = (environment.is_some() || shader.is_some()).then(|| RayDifferential {
            ray: self.ray(pixel),
            next: [self.ray(pixel + next.x_axis), self.ray(pixel + next.y_axis)],
        });
        let surroundings = environment.as_ref().zip(ray.as_ref()).map(|(environment, ray)| {
            environment.direction(point.space.point, splat.normal, splat.splat.back, ray)
        });
        Sight { point, ray, surroundings }
    }

    /// The colours of a splat given what is seen of it.
    pub fn shaded(&self, splat: &ShadedSplat, sight: &Sight) -> Shaded {
        let Material { texture, environment, .. } = self.material(splat.index);
        let albedo = match texture {
            Some(texture) => texture.color(&sight.point, self.images),
            None => splat_color(self.cloud, splat.index, self.view, self.options.shading),
        };
        let seen = environment.as_ref().zip(sight.surroundings.as_ref());
        let seen = seen.map(|(environment, at)| environment.image().color(at, self.images));
        Shaded { albedo, color: self.finished(splat, sight, seen.unwrap_or_else(|| self.lit(splat, albedo))) }
    }

    /// The colour of a splat given that of [`Material::image`] at [`Sight::image_point`].
    pub fn color_by_image(&self, splat: &ShadedSplat, sight: &Sight, image: [f32; 3]) -> [f32; 3] {
        let color = if sight.surroundings.is_some() { image } else { self.lit(splat, image) };
        self.finished(splat, sight, color)
    }

    /// The colour under the light.
    fn lit(&self, splat: &ShadedSplat, albedo: [f32; 3]) -> [f32; 3] {
        let light = light(&splat.splat, || splat.normal, self.view, self.options) as f32;
        albedo.map(|value| value * light)
    }

    /// After the caller's shader, in the resolve's terms.
    fn finished(&self, splat: &ShadedSplat, sight: &Sight, mut color: [f32; 3]) -> [f32; 3] {
        if let (Some(shader), Some(ray)) = (&self.material(splat.index).shader, sight.ray) {
            let (normal, back, index) = (splat.normal, splat.splat.back, splat.index);
            color = shader(&ShadedPoint { surface: sight.point, normal, back, ray, index }, color);
            // No caller's mistake reaches the picture.
            color = color.map(|value| if value.is_nan() { 0.0 } else { value });
        }
        finished_color(color, self.options)
    }

    /// The ray through a place of the ideal picture and the middle of the lens, in the world.
    fn ray(&self, pixel: DVec2) -> Ray {
        let view = self.view;
        let screen = (pixel - view.principal_point) / view.pixel_scale;
        let (origin, direction) = if view.orthographic {
            (screen.extend(0.0), DVec3::Z)
        } else {
            (DVec3::ZERO, screen.extend(1.0))
        };
        Ray::new(view.eye + self.to_world * origin, self.to_world * direction)
    }
}

impl ShadedSplat {
    /// What a pixel sees of the splat, given the offset of its centre from the splat's and those of the next pixels from it.
    ///
    /// The derivative of the homography gives the pixel's footprint in (u, v), a Gaussian. Through a lens it is as much larger
    /// as the circle of confusion. Of that the splat, itself a Gaussian, leaves only what lies on it: their product. So a
    /// lookup never strays beyond the splat, and one that is smaller than a pixel is looked up as a whole.
    fn surface_point(&self, offset: DVec2, next: DMat2) -> SurfacePoint {
        let c = &self.exact;
        let g = 1.0 + DVec2::from(c.h).dot(offset);
        let (place, axes) = if g >= LEAST_G {
            let uv = DVec2::from(c.reference) + DVec2::new(c.a1 * offset.y, DVec2::from(c.b).dot(offset)) / g;
            let jacobian = PixelDerivatives::of_splat(&self.constants, offset.as_vec2().to_array(), None);
            on_the_splat(uv, DMat2::from_cols(jacobian.x, jacobian.y) * next, self.variance)
        } else {
            (DVec2::ZERO, [DVec2::X / KERNEL_VARIANCE.sqrt(), DVec2::Y / KERNEL_VARIANCE.sqrt()])
        };
        let own = |uv: DVec2| uv.x * self.own_axes[0] + uv.y * self.own_axes[1];
        let space = |uv: DVec2| uv.x * self.axes[0] + uv.y * self.axes[1];
        let [x, y] = axes;
        SurfacePoint {
            own: TexturePoint {
                st: self.own_center + own(place),
                derivatives: PixelDerivatives { x: own(x), y: own(y) }.bounded(),
            },
            space: SpacePoint { point: self.center + space(place), dx: space(x), dy: space(y) },
        }
    }
}

/// The product of a pixel's Gaussian around `uv`, of covariance S = `variance` `j` `j`^T, and the splat's own (mean 0,
/// covariance 1): its mean (S + 1)^-1 uv, and semi-axes of an ellipse whose lookup has its covariance S (S + 1)^-1.
fn on_the_splat(uv: DVec2, j: DMat2, variance: f64) -> (DVec2, [DVec2; 2]) {
    let s = j * j.transpose() * variance;
    let shrink = (s + DMat2::IDENTITY).inverse();
    let covariance = s * shrink * (1.0 / KERNEL_VARIANCE);
    // Cholesky: any root of it will do.
    let first = covariance.x_axis.x.max(0.0).sqrt();
    let across = if first > 0.0 { covariance.x_axis.y / first } else { 0.0 };
    let second = (covariance.y_axis.y - across * across).max(0.0).sqrt();
    (shrink * uv, [DVec2::new(first, across), DVec2::new(0.0, second)])
}
