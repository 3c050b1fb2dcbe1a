//! Scenes for `splat-core`: cameras, clouds of a few splats, and the same splats and sample rays for the
//! brute-force truth.

use std::f64::consts::TAU;

use glam::{DMat4, DVec2, DVec3, Vec3Swizzles};
use splat_core::setup::{CameraSplat, View};
use splat_core::{Camera, Cloud, Kernel, Lens, Projection, RenderOptions, Shapes};

use crate::brute_force::{self, Disc, SampleRay};
use crate::random::Random;

/// A pinhole at the origin that looks along z, the principal point in the middle, `focal` pixels at depth 1.
pub fn pinhole(width: u32, height: u32, focal: f64) -> Camera {
    Camera {
        width,
        height,
        projection: Projection::Perspective { focal_length: DVec2::splat(focal), lens: None },
        principal_point: DVec2::new(f64::from(width), f64::from(height)) / 2.0,
        world_to_camera: DMat4::IDENTITY,
        near: 1e-4,
        far: f64::INFINITY,
        clip_planes: vec![],
        distortion: None,
    }
}

/// The same with a round lens.
pub fn thin_lens(width: u32, height: u32, focal: f64, radius: f64, focus: f64) -> Camera {
    let lens = Some(Lens { radius, focus, blades: 0 });
    let projection = Projection::Perspective { focal_length: DVec2::splat(focal), lens };
    Camera { projection, ..pinhole(width, height, focal) }
}

/// The same with parallel rays.
pub fn orthographic(width: u32, height: u32, pixels_per_unit: f64) -> Camera {
    let projection = Projection::Orthographic { pixels_per_unit };
    Camera { projection, near: 0.0, ..pinhole(width, height, 1.0) }
}

/// Every hit a fragment of weight 1: nothing is hidden by a weight of zero at the rim.
pub fn hard(cutoff: f64, samples: u32) -> RenderOptions {
    RenderOptions { cutoff, samples, kernel: Kernel::Disc, ..RenderOptions::default() }
}

/// The axes of a splat at `center` (camera space) whose normal leaves the direction to the eye by `tilt`
/// degrees towards `turn` radians; the axes have these lengths, and are turned in their plane by `twist`.
pub fn tilted_axes(center: DVec3, tilt: f64, turn: f64, twist: f64, lengths: [f64; 2]) -> [DVec3; 2] {
    let to_eye = -center.try_normalize().unwrap_or(DVec3::Z);
    let (a, b) = to_eye.any_orthonormal_pair();
    let side = a * libm::cos(turn) + b * libm::sin(turn);
    let (sine, cosine) = (libm::sin(tilt.to_radians()), libm::cos(tilt.to_radians()));
    // The direction of steepest descent, and the horizontal one.
    let (down, across) = (side * cosine - to_eye * sine, to_eye.cross(side));
    let (s, c) = (libm::sin(twist), libm::cos(twist));
    [(across * c + down * s) * lengths[0], (down * c - across * s) * lengths[1]]
}

/// The axes of a splat of any direction whose longer axis is `sigma` long, the other one shorter by up to
/// `ratio`.
pub fn random_axes(rng: &mut Random, sigma: f64, ratio: f64) -> [DVec3; 2] {
    let (a, b) = rng.direction().any_orthonormal_pair();
    let twist = rng.range(0.0, TAU);
    let (s, c) = (libm::sin(twist), libm::cos(twist));
    [(a * c + b * s) * sigma, (b * c - a * s) * (sigma / rng.log_range(1.0, ratio))]
}

/// A white, oriented cloud of these splats: centre and axes in the world, normals T1 x T2. Everything is
/// rounded to f32; [`splat_core::setup::camera_splat`] says what became of it.
pub fn ellipses(splats: &[(DVec3, [DVec3; 2])]) -> Cloud {
    Cloud {
        positions: splats.iter().map(|s| s.0.as_vec3()).collect(),
        normals: splats.iter().map(|s| s.1[0].cross(s.1[1]).normalize().as_vec3()).collect(),
        shapes: Shapes::Ellipses(splats.iter().map(|s| s.1.map(|axis| axis.as_vec3())).collect()),
        oriented: true,
        ..Cloud::default()
    }
}

/// A white, oriented cloud of round splats: position, normal, sigma.
pub fn discs(splats: &[(DVec3, DVec3, f64)]) -> Cloud {
    Cloud {
        positions: splats.iter().map(|s| s.0.as_vec3()).collect(),
        normals: splats.iter().map(|s| s.1.as_vec3()).collect(),
        shapes: Shapes::Discs(splats.iter().map(|s| s.2 as f32).collect()),
        oriented: true,
        ..Cloud::default()
    }
}

/// A splat in camera space with the normal T1 x T2.
pub fn camera_space(center: DVec3, axes: [DVec3; 2]) -> CameraSplat {
    let normal = axes[0].cross(axes[1]).normalize();
    CameraSplat { center, axes, normal, back: normal.dot(center) > 0.0 }
}

/// The same splat for the brute-force truth.
pub fn truth_of(splat: &CameraSplat) -> Disc {
    Disc { center: splat.center, t1: splat.axes[0], t2: splat.axes[1], normal: splat.normal }
}

/// The view's lens for the brute-force truth.
pub fn lens_of(view: &View) -> Option<brute_force::Lens> {
    view.lens.map(|lens| brute_force::Lens { radius: lens.radius, focus: lens.focus })
}

/// A point of the unit aperture on the view's lens, in camera units; zero for a pinhole.
pub fn on_lens(view: &View, unit: [f32; 2]) -> DVec2 {
    view.lens.map_or(DVec2::ZERO, |lens| DVec2::from(unit.map(f64::from)) * lens.radius)
}

/// The ray of the picture's point `pixel` through the point `unit` of the unit aperture.
pub fn sample_ray(view: &View, pixel: DVec2, unit: [f32; 2]) -> SampleRay {
    let screen = (pixel - view.principal_point) / view.pixel_scale;
    match lens_of(view) {
        _ if view.orthographic => SampleRay::orthographic(screen),
        None => SampleRay::pinhole(screen),
        Some(lens) => SampleRay::thin_lens(screen, on_lens(view, unit), &lens),
    }
}

/// The picture's point whose ray through the point `unit` of the unit aperture meets `point`.
pub fn image_of(view: &View, point: DVec3, unit: [f32; 2]) -> DVec2 {
    let screen = match lens_of(view) {
        _ if view.orthographic => point.xy(),
        None => point.xy() / point.z,
        Some(lens) => lens.image_of(point, on_lens(view, unit)),
    };
    screen * view.pixel_scale + view.principal_point
}

/// A random point of the unit aperture.
pub fn random_unit_lens(rng: &mut Random) -> [f32; 2] {
    rng.in_disc().to_array().map(|value| value as f32)
}
