//! Texture filtering alone: an image averaged over a long, thin footprint, by the fast filter and by pbrt's.
//!
//! `cargo run --release -p splat-simd --example 5_texture -- image.png`
#![expect(clippy::print_stdout, reason = "an example shows what it finds")]

use glam::Vec2;
use splat_core::texture::pyramid::Texels;
use splat_core::texture::{Filter, Footprint, Pyramid, Sampler, Wrap};
use splat_io::read_pyramid;
use std::path::Path;

fn main() -> anyhow::Result<()> {
    let wrap = [Wrap::Repeat; 2];
    let image = match std::env::args().nth(1) {
        Some(path) => read_pyramid(Path::new(&path), wrap)?,
        // Squares of 8 texels.
        None => {
            let texel = |i: usize| f32::from(u8::from((i % 256 / 8 + i / 256 / 8).is_multiple_of(2)));
            Pyramid::new([256, 256], 1, Texels::F32((0..256 * 256).map(texel).collect()), wrap)?
        }
    };
    // Semi-axes in units of the whole image, as screen derivatives give them.
    let footprint = Footprint { semi_axes: [Vec2::new(0.1, 0.02), Vec2::new(-0.001, 0.005)] };
    for filter in [Sampler::default().filter, Filter::EwaPrinted, Filter::Trilinear] {
        let sampler = Sampler { filter, ..Sampler::default() };
        let [red, green, blue, alpha] = sampler.lookup(&image, Vec2::new(0.3, 0.6), &footprint);
        println!("{filter:?}: {red:.4} {green:.4} {blue:.4} {alpha:.4}");
    }
    Ok(())
}
