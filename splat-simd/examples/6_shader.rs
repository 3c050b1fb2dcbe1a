//! A shader of one's own: contour lines of the height, on any cloud.
//!
//! `cargo run --release -p splat-simd --example 6_shader -- scan.laz contours.png`

use anyhow::Context;
use splat_core::fit::{Framing, Up, fit};
use splat_core::prepare::{PrepareOptions, prepare};
use splat_core::shade::ShadedPoint;
use splat_core::{Material, RenderOptions};
use splat_io::{CloudOptions, Metadata, PictureOptions, read_cloud, write_picture};
use std::path::PathBuf;
use std::sync::Arc;

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1).map(PathBuf::from);
    let input = arguments.next().context("expected a cloud and a picture")?;
    let output = arguments.next().context("expected a picture")?;

    let mut cloud = read_cloud(&input, &CloudOptions::default())?.cloud;
    let (low, high) = cloud.bounds().context("the cloud is empty")?;
    let step = (high.z - low.z) / 20.0;
    let contours = move |at: &ShadedPoint, color: [f32; 3]| {
        // How much of the height's range in this pixel lies in a line of a tenth of the step.
        let height = at.surface.space.point.z / step;
        let reach = (at.surface.space.dx.z.abs() + at.surface.space.dy.z.abs()) / step;
        let share = (0.05 + 0.5 * reach - (height - height.round()).abs()) / reach.max(1e-3);
        color.map(|value| value * (1.0 - 0.8 * share.clamp(0.0, 1.0) as f32))
    };
    let material = Material { shader: Some(Arc::new(contours)), ..Material::PLAIN };
    let options = RenderOptions { material: material.into(), ..RenderOptions::suited_to(&cloud) };
    prepare(&mut cloud, &PrepareOptions::for_picture(&options), &mut |_| {});
    let camera = fit(&cloud, &Framing { up: Up::Z, elevation: 50.0, ..Framing::default() }, &options)?;
    let picture = splat_simd::render(&cloud, &camera, &options, &mut |_| {})?;
    write_picture(&output, &picture.film, &Metadata::default(), &PictureOptions::default())?;
    Ok(())
}
