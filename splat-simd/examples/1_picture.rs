//! Any cloud to a picture, as `splat render` does it without options.
//!
//! `cargo run --release -p splat-simd --example 1_picture -- scan.laz scan.png`

use splat_core::fit::{Framing, fit};
use splat_core::prepare::{PrepareOptions, prepare};
use splat_core::{Cloud, RenderOptions};
use splat_io::{CloudOptions, Metadata, PictureOptions, read_cloud, write_picture};
use std::path::PathBuf;

fn main() -> anyhow::Result<()> {
    let [input, output] = ["scan.ply", "scan.png"].map(PathBuf::from);
    let mut arguments = std::env::args().skip(1).map(PathBuf::from);
    let (input, output) = (arguments.next().unwrap_or(input), arguments.next().unwrap_or(output));

    let mut cloud: Cloud = read_cloud(&input, &CloudOptions::default())?.cloud;
    let options = RenderOptions::suited_to(&cloud);
    prepare(&mut cloud, &PrepareOptions::for_picture(&options), &mut |_| {});
    let camera = fit(&cloud, &Framing::default(), &options)?;
    let picture = splat_simd::render(&cloud, &camera, &options, &mut |_| {})?;
    write_picture(&output, &picture.film, &Metadata::default(), &PictureOptions::default())?;
    Ok(())
}
