//! A cloud from all cameras of a reconstruction, with one renderer that keeps its threads and buffers.
//!
//! `cargo run --release -p splat-simd --example 3_cameras -- model/ model/` draws a COLMAP model's points.

use anyhow::Context;
use splat_core::RenderOptions;
use splat_core::fit::NEAR;
use splat_core::prepare::{PrepareOptions, prepare};
use splat_io::{CloudOptions, Metadata, PictureOptions, read_cameras, read_cloud, write_picture};
use splat_simd::{Level, Renderer};
use std::path::PathBuf;

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1).map(PathBuf::from);
    let cloud = arguments.next().context("expected a cloud and a file or folder of cameras")?;
    let cameras = arguments.next().context("expected a file or folder of cameras")?;

    let mut cloud = read_cloud(&cloud, &CloudOptions::default())?.cloud;
    let options = RenderOptions::suited_to(&cloud);
    prepare(&mut cloud, &PrepareOptions::for_picture(&options), &mut |_| {});
    let mut renderer = Renderer::new(0, Level::choose())?;
    for (number, named) in read_cameras(&cameras, NEAR * cloud.diagonal())?.cameras.iter().enumerate() {
        let picture = renderer.render(&cloud, &named.camera, &options, &mut |_| {})?;
        let output = PathBuf::from(format!("view-{number:04}.png"));
        write_picture(&output, &picture.film, &Metadata::default(), &PictureOptions::default())?;
    }
    Ok(())
}
