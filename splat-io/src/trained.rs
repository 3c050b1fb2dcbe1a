//! Trained Gaussian splats, of which the shortest axis is dropped: what is left of each is a surfel.
//!
//! | format | by | harmonics |
//! |---|---|---|
//! | PLY of 3DGS and 2DGS, ASCII or binary | [`crate::read_ply`] | degree 0 to 3 |
//! | compressed PLY of SuperSplat and PlayCanvas | [`crate::read_ply`] | degree 0 to 3, 8 bits |
//! | `.spz`, version 2 to 4 | [`read_spz`] | degree 0 to 3, 8 bits, -1 to 1 |
//! | `.splat` | [`read_splat`], [`write_splat`] | none |
//!
//! [`crate::read_cloud`] tells which it is. In PLY files, by property:
//!
//! | property | meaning |
//! |---|---|
//! | `x y z` | position |
//! | `opacity` | opacity = 1/(1 + exp(-value)) |
//! | `scale_0 scale_1 scale_2` | standard deviations along the three axes = exp(value); `scale_2` is absent in 2DGS |
//! | `rot_0 rot_1 rot_2 rot_3` | a quaternion w, x, y, z, normalised here; the axes are the columns of its matrix |
//! | `f_dc_0 f_dc_1 f_dc_2` | the constant term of the colour, r g b ([`splat_core::harmonics`]) |
//! | `f_rest_0` .. | the further terms of red, then those of green, then of blue |
//! | `nx ny nz` | zeros: ignored |
//!
//! The axes are those of the camera that the training used, mostly y down and z forward; an `.spz` file has y up and z back, and
//! is turned to agree with the others.

mod gaussians;
mod splat_file;
pub(crate) mod spz;
#[cfg(test)]
mod tests;

pub(crate) use gaussians::{Gaussian, Gaussians, sigmoid};
pub use splat_file::{read_splat, read_splat_from, write_splat};
pub use spz::{read_spz, read_spz_from};
