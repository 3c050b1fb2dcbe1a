//! The fast surfel renderer: eight subpixel samples at once, tiles in parallel, and the bits of the reference.
//!
//! The kernels are written once over the small trait [`Lanes`] and run on `wide::f32x8` anywhere, and on AVX2 registers
//! where the processor has them, chosen once a frame ([`Level`]). What it draws is what [`splat_core::render()`] draws, bit
//! for bit: same set-up, same evaluation in the same rounding order, same resolve.

mod evaluate;
mod lanes;
mod raster;
mod render;
mod resolve;
mod samples;

pub use evaluate::{LaneHits, LaneLensPoint, LaneLimits, LaneSplat};
pub use lanes::{Lanes, Level};
pub use render::{Difference, Renderer, compare, fragments, render};
