//! Scenes for the benchmarks, [`Case`] names one; and what the programs measure with.

#![forbid(unsafe_code)]

mod case;
pub mod memory;
pub mod textures;
pub mod timing;

pub use case::{Blur, Case, Scene, Subject};

use glam::{DMat4, DVec2, DVec3};
use splat_core::prepare::{PrepareOptions, prepare};
use splat_core::{Camera, Cloud, Kernel, PixelFilter, Projection, RenderOptions, Shapes};

/// The benchmarks' sphere: `count` discs evenly spread over a sphere of radius 1, their size 1.5 spacings, with
/// areas for cutoff 2.
pub fn sphere(count: usize) -> Cloud {
    let mut cloud = bare_sphere(count);
    let options = PrepareOptions { kernel: Kernel::Gaussian, cutoff: 2.0, ..PrepareOptions::default() };
    prepare(&mut cloud, &options, &mut |_| {});
    cloud
}

/// The same without areas.
pub fn bare_sphere(count: usize) -> Cloud {
    // Points on a spiral that turns by the golden angle: Fibonacci's lattice on the sphere.
    let golden_angle = std::f64::consts::PI * (3.0 - 5.0f64.sqrt());
    let points: Vec<DVec3> = (0..count)
        .map(|i| {
            let z = 1.0 - (2.0 * i as f64 + 1.0) / count as f64;
            let radius = (1.0 - z * z).sqrt();
            let angle = golden_angle * i as f64;
            DVec3::new(radius * angle.cos(), radius * angle.sin(), z)
        })
        .collect();
    let spacing = (4.0 * std::f64::consts::PI / count as f64).sqrt();
    let mut cloud = Cloud::from_points(&points);
    cloud.normals = points.iter().map(|point| point.as_vec3()).collect();
    cloud.shapes = Shapes::Discs(vec![(1.5 * spacing) as f32; count]);
    cloud.oriented = true;
    cloud
}

/// The camera of the sphere: 1920 x 1080, 90 degrees across the width, at a distance of 2.17, so that the sphere's
/// radius is about 500 pixels.
pub fn sphere_camera() -> Camera {
    Camera {
        width: 1920,
        height: 1080,
        projection: Projection::Perspective { focal_length: DVec2::splat(960.0), lens: None },
        principal_point: DVec2::new(960.0, 540.0),
        world_to_camera: DMat4::from_translation(DVec3::new(0.0, 0.0, 2.17)),
        near: 0.01,
        far: f64::INFINITY,
        clip_planes: Vec::new(),
        distortion: None,
    }
}

/// The listing's kernel and cutoff, 8 samples of the pixel's own square, front faces only.
pub fn sphere_options() -> RenderOptions {
    RenderOptions {
        samples: 8,
        filter: PixelFilter::Box,
        kernel: Kernel::Gaussian,
        cutoff: 2.0,
        cull: true,
        ..RenderOptions::default()
    }
}
