//! The fast surfel renderer: eight subpixel samples at once, tiles in parallel, and the bits of the reference.
//!
//! The kernels are written once over a small trait of lanes and run on `wide::f32x8` anywhere, and on AVX2 or AVX-512
//! registers where the processor has them, chosen once a frame ([`Level`]). What it draws is what [`splat_core::render()`]
//! draws, bit for bit: same set-up, same evaluation in the same rounding order, same resolve.

mod compare;
mod evaluate;
mod interval_bounds;
mod lanes;
mod lattice;
mod lens_image;
mod lens_sums;
mod over;
mod places;
mod raster;
mod records;
mod render;
mod resolve;
mod samples;
mod shade;
mod surface_sums;
mod table;
pub mod texture;

pub use compare::{Difference, Method, compare, fragments};
pub use lanes::Level;
pub use render::{Renderer, render};
