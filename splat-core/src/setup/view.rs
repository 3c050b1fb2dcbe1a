//! What set-up needs of camera and options, computed once a frame.

use super::bounds::{Extent, half_depth};
use super::number::{floor, greater, lesser};
use super::{BOX_PADDING, CameraSplat};
use crate::distortion::FilmMap;
use crate::{Camera, Cloud, Lens, PixelRect, RenderOptions, Shapes};
use glam::{DMat3, DVec2, DVec3, DVec4, Vec4Swizzles};

/// An empty rectangle.
const NO_PIXELS: PixelRect = PixelRect::new(0, 0, 0, 0);

/// A camera as set-up sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// World position of the eye.
    pub eye: DVec3,
    /// World to camera, without the translation.
    pub linear: DMat3,
    /// Whether `linear` mirrors.
    pub mirrors: bool,
    /// World direction of growing depth along a ray (orthographic), not normalised.
    pub world_forward: DVec3,
    /// Whether all rays are parallel.
    pub orthographic: bool,
    /// Pixels a unit of x/w, or of x.
    pub pixel_scale: DVec2,
    /// Principal point, in pixels.
    pub principal_point: DVec2,
    /// The lens, if any.
    pub lens: Option<Lens>,
    /// The lens distortion, if any. Everything but the window and candidates is in pixels of the ideal picture.
    pub distortion: Option<FilmMap>,
    /// Least depth, in camera units.
    pub near: f64,
    /// Greatest depth, in camera units; may be infinite.
    pub far: f64,
    /// F.
    pub cutoff: f64,
    /// R = sqrt(F): the radius of the splats, in sigma.
    pub radius: f64,
    /// The kernel's integral over them.
    pub kernel_integral: f64,
    /// Radius of the pixel filter, in pixels.
    pub filter_radius: f64,
    /// Width and height of the full frame, in pixels.
    pub frame: [u32; 2],
    /// A box around what the full frame shows, in pixels; without distortion the frame itself.
    pub seen: [Extent; 2],
    /// The pixels to render.
    pub window: PixelRect,
    /// How the depth grows in the world's directions.
    depth_gradient: DVec3,
    clip_planes: Vec<DVec4>,
}

impl View {
    /// The view of a checked camera with checked options.
    pub fn new(camera: &Camera, options: &RenderOptions) -> Self {
        let linear = camera.linear();
        let frame = PixelRect::new(0, 0, camera.width as i32, camera.height as i32);
        // A plane n.p + d over world points is n'.q + d' over camera points q = M p, (n', d') = M^-T (n, d).
        let to_camera = camera.world_to_camera.inverse().transpose();
        let filter_radius = options.filter.radius();
        let distortion = FilmMap::new(camera, filter_radius);
        let seen = [camera.width, camera.height].map(|side| Extent { min: 0.0, max: f64::from(side) });
        Self {
            eye: camera.eye(),
            linear,
            mirrors: linear.determinant() < 0.0,
            world_forward: linear.inverse() * DVec3::Z,
            orthographic: camera.is_orthographic(),
            pixel_scale: camera.pixel_scale(),
            principal_point: camera.principal_point,
            lens: camera.lens(),
            distortion,
            near: camera.near,
            far: camera.far,
            cutoff: options.cutoff,
            radius: options.cutoff.sqrt(),
            kernel_integral: options.kernel.integral(options.cutoff),
            filter_radius,
            frame: [camera.width, camera.height],
            seen: distortion.map_or(seen, |map| map.seen()),
            window: options.window.map_or(frame, |window| window.intersect(&frame)),
            depth_gradient: linear.row(2),
            clip_planes: camera.clip_planes.iter().map(|&plane| to_camera * plane).collect(),
        }
    }

    /// The largest coordinate of a sample relative to its pixel's corner, in pixels.
    pub fn max_jitter(&self) -> f64 {
        self.distortion.map_or(self.filter_radius + 0.5, |map| map.max_jitter())
    }

    /// Where a sample of a pixel looks: the pixel of the ideal picture from whose corner it is counted, and its place from
    /// there. `jitter` is its place on the film. Not a number if it sees nothing.
    pub fn ideal_sample(&self, x: i32, y: i32, jitter: [f32; 2]) -> ([i32; 2], [f32; 2]) {
        match &self.distortion {
            None => ([x, y], jitter),
            Some(map) => {
                map.pixel(x, y).map_or(([x, y], [f32::NAN; 2]), |pixel| (pixel.corner, pixel.sample(jitter)))
            }
        }
    }

    /// The near plane that boxes are clipped at: a little in front, since a hit's depth is rounded.
    pub(super) fn box_near(&self) -> f64 {
        self.near * (1.0 - 1.0 / 65_536.0)
    }

    /// The depth extent per sigma, |t|, of a splat of the cloud.
    pub(super) fn steepness(&self, cloud: &Cloud, index: usize) -> f64 {
        match &cloud.shapes {
            // |t| is the length of the depth's gradient along the plane of the disc.
            Shapes::Discs(sizes) => {
                let normal = cloud.normals[index].as_dvec3();
                let squared = self.depth_gradient.cross(normal).length_squared() / normal.length_squared();
                f64::from(sizes[index]) * squared.sqrt()
            }
            Shapes::Ellipses(axes) => {
                let [t1, t2] = axes[index].map(|axis| self.depth_gradient.dot(axis.as_dvec3()));
                (t1 * t1 + t2 * t2).sqrt()
            }
        }
    }

    /// Whether a splat lies wholly outside the near or the far plane (L71-84).
    pub(super) fn is_out_of_depth(&self, depth: f64, half_depth: f64) -> bool {
        depth + half_depth <= self.near || depth - half_depth >= self.far
    }

    /// Whether there are planes besides near and far.
    pub(super) fn has_clip_planes(&self) -> bool {
        !self.clip_planes.is_empty()
    }

    /// Whether a splat lies wholly outside one of the caller's planes: the listing's exact test of a disc against a
    /// plane, the axes being sigma-scaled (Q = 1).
    pub(super) fn is_clipped(&self, splat: &CameraSplat) -> bool {
        self.clip_planes.iter().any(|plane| {
            let [a, b] = splat.axes.map(|axis| plane.xyz().dot(axis));
            let c = plane.xyz().dot(splat.center) + plane.w;
            c < 0.0 && self.cutoff * (a * a + b * b) < c * c
        })
    }

    /// The depths of the visible part of a disc of `radius` sigma.
    pub(super) fn depth_extent(&self, splat: &CameraSplat, radius: f64) -> Extent {
        let extent = half_depth(splat, radius);
        Extent { min: greater(splat.center.z - extent, self.near), max: splat.center.z + extent }
    }

    /// Radius of the largest circle of confusion over these depths, in tan units (L136-141; errata E6-E9).
    pub fn circle_of_confusion(&self, depth: Extent) -> f64 {
        self.lens.map_or(0.0, |lens| {
            let blur = |w: f64| (1.0 / w - 1.0 / lens.focus).abs();
            lens.radius * blur(depth.min).max(blur(depth.max))
        })
    }

    /// Radius of the lens in pixels at depth 1, per axis.
    pub(super) fn lens_pixels(&self) -> Option<[f64; 2]> {
        self.lens.map(|lens| (lens.radius * self.pixel_scale).to_array())
    }

    /// How far samples may be from the projection of a splat's reference point, given the splat's box in pixels.
    pub(super) fn reach(&self, from: DVec2, screen: &[Extent; 2]) -> Reach {
        let room = self.filter_radius + 1.0;
        let farthest =
            |axis: usize, min: f64, max: f64| greater((min - from[axis]).abs(), (max - from[axis]).abs());
        Reach {
            of_splat: [0, 1].map(|axis| farthest(axis, screen[axis].min, screen[axis].max)),
            in_frame: [0, 1].map(|axis| {
                let Extent { min, max } = self.seen[axis];
                farthest(axis, greater(screen[axis].min, min) - room, lesser(screen[axis].max, max) + room)
            }),
        }
    }

    /// The pixels of the window of which a sample may fall into a box (in pixels). Pixel i's samples lie within the
    /// filter's radius of i + 1/2.
    #[inline(always)]
    pub(super) fn pixels_that_reach(&self, screen: &[Extent; 2]) -> PixelRect {
        let Some(map) = &self.distortion else { return self.film_pixels_that_reach(screen) };
        map.film_box(screen).map_or(NO_PIXELS, |film| self.film_pixels_that_reach(&film))
    }

    /// The same for a box of the film.
    #[inline(always)]
    fn film_pixels_that_reach(&self, screen: &[Extent; 2]) -> PixelRect {
        let room = self.filter_radius + BOX_PADDING;
        // The window is far smaller than the range of these integers.
        let first = |extent: Extent| -floor(room + 0.5 - extent.min);
        let end = |extent: Extent| floor(extent.max + room - 0.5) + 1;
        let [x, y] = *screen;
        PixelRect::new(first(x), first(y), end(x), end(y)).intersect(&self.window)
    }
}

/// Largest offsets per axis, in pixels, from the projection of a splat's reference point. They depend on the frame, never
/// on the window: a crop must not change what is drawn.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reach {
    /// Of the splat's points, as a pinhole sees them.
    pub of_splat: [f64; 2],
    /// Of samples in the frame that a pinhole's hit may have.
    pub in_frame: [f64; 2],
}
