//! The numerical reference: every fragment of one splat, for checking a renderer of one's own.
//!
//! `cargo run --release -p splat-simd --example 4_fragments`
#![expect(clippy::print_stdout, reason = "an example shows what it finds")]

use glam::{DMat4, DVec2, DVec3, Vec3};
use splat_core::{Camera, Cloud, Projection, RenderOptions, Shapes};

fn main() -> anyhow::Result<()> {
    let cloud = Cloud {
        normals: vec![Vec3::new(0.0, 0.6, -0.8)],
        shapes: Shapes::Discs(vec![0.05]),
        areas: Some(vec![0.01]),
        ..Cloud::from_points(&[DVec3::new(0.02, 0.01, 2.0)])
    };
    let camera = Camera {
        width: 16,
        height: 16,
        projection: Projection::Perspective { focal_length: DVec2::splat(40.0), lens: None },
        principal_point: DVec2::splat(8.0),
        world_to_camera: DMat4::IDENTITY,
        near: 0.01,
        far: f64::INFINITY,
        clip_planes: Vec::new(),
        distortion: None,
    };
    let options = RenderOptions { samples: 4, ..RenderOptions::default() };
    println!("pixel, sample: depth, weight (bits)");
    let tests = splat_core::fragments(&cloud, &camera, &options, &mut |place, _splat, fragment| {
        let (depth, weight) = (fragment.depth, fragment.weight);
        println!(
            "({}, {}), {}: {depth} ({:08x}), {weight} ({:08x})",
            place.x,
            place.y,
            place.sample,
            depth.to_bits(),
            weight.to_bits()
        );
    })?;
    println!("{tests} samples tested");
    Ok(())
}
