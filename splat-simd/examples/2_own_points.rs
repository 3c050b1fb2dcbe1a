//! Splats made in code, through a thin lens, with depth and normals: `own.exr`.
//!
//! `cargo run --release -p splat-simd --example 2_own_points`

#![expect(clippy::disallowed_methods, reason = "the last bits of this shape may be any")]

use glam::{DMat4, DVec2, DVec3, Vec3};
use splat_core::{AovSelection, Camera, Cloud, Lens, Projection, RenderOptions, Shapes};
use splat_io::{Metadata, PictureOptions, write_picture};
use std::path::Path;

fn main() -> anyhow::Result<()> {
    // A wavy floor: y is down, z forward. Sizes are standard deviations: splats reach twice as far.
    let spacing = 0.05;
    let places = (0..200).flat_map(|i| (0..400).map(move |j| (f64::from(i) - 100.0, f64::from(j))));
    let points: Vec<DVec3> = places
        .map(|(i, j)| {
            let (x, z) = (i * spacing, 2.0 + j * spacing);
            DVec3::new(x, 1.0 + 0.1 * (2.0 * x).sin() * (2.0 * z).cos(), z)
        })
        .collect();
    let cloud = Cloud {
        normals: points
            .iter()
            .map(|p| {
                let slope_x = 0.2 * (2.0 * p.x).cos() * (2.0 * p.z).cos();
                let slope_z = -0.2 * (2.0 * p.x).sin() * (2.0 * p.z).sin();
                DVec3::new(slope_x, -1.0, slope_z).normalize().as_vec3()
            })
            .collect(),
        shapes: Shapes::Discs(vec![0.9 * spacing as f32; points.len()]),
        areas: Some(vec![(spacing * spacing) as f32; points.len()]),
        colors: Some(points.iter().map(|p| Vec3::new(0.8, 0.4, 0.1 + 0.04 * p.z as f32)).collect()),
        oriented: true,
        ..Cloud::from_points(&points)
    };
    let camera = Camera {
        width: 960,
        height: 540,
        projection: Projection::Perspective {
            focal_length: DVec2::splat(900.0),
            lens: Some(Lens { radius: 0.05, focus: 5.0, blades: 6 }),
        },
        principal_point: DVec2::new(480.0, 270.0),
        world_to_camera: DMat4::IDENTITY,
        near: 0.01,
        far: f64::INFINITY,
        clip_planes: Vec::new(),
        distortion: None,
    };
    let options = RenderOptions {
        samples: 64,
        aovs: AovSelection { depth: true, normal: true, ..AovSelection::default() },
        ..RenderOptions::default()
    };
    let picture = splat_simd::render(&cloud, &camera, &options, &mut |_| {})?;
    write_picture(Path::new("own.exr"), &picture.film, &Metadata::default(), &PictureOptions::default())?;
    Ok(())
}
