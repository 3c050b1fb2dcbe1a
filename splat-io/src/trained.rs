//! Trained Gaussian splats, of which the shortest axis is dropped: what is left of each is a surfel.
//!
//! | format | by | harmonics |
//! |---|---|---|
//! | PLY of 3DGS and 2DGS, ASCII or binary | [`crate::read_ply`] | degree 0 to 3 |
//! | compressed PLY of SuperSplat and PlayCanvas | [`crate::read_ply`] | degree 0 to 3, 8 bits |
//! | `.spz`, version 2 to 4 | [`read_spz`] | degree 0 to 3, 8 bits, -1 to 1 |
//! | `.splat` | [`read_splat`], [`write_splat`] | none |
//!
//! [`read_trained`] tells the latter two by their content and name. In PLY files, by property:
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
mod spz;
#[cfg(test)]
mod tests;

pub(crate) use gaussians::{Gaussian, Gaussians, sigmoid};
pub use splat_file::{read_splat, read_splat_from, write_splat};
pub use spz::{read_spz, read_spz_from};

use crate::ply::open;
use crate::{Error, Import};
use std::io::Read;
use std::path::Path;

/// Reads trained splats from an `.spz` file, known by its first bytes, or a `.splat` file, known by its name; `None` for
/// any other file, PLY among them.
///
/// # Errors
/// [`Error::Unsupported`] for `.ksplat`; what [`read_spz`] and [`read_splat`] say.
pub fn read_trained(path: &Path) -> Result<Option<Import>, Error> {
    let (mut file, _) = open(path)?;
    let mut start = Vec::new();
    file.by_ref().take(4).read_to_end(&mut start).map_err(Error::io(path, "read"))?;
    let has_extension = |name: &str| path.extension().is_some_and(|found| found.eq_ignore_ascii_case(name));
    if start.starts_with(b"ply") {
        return Ok(None);
    }
    if start.starts_with(&spz::GZIP) || start == spz::MAGIC || has_extension("spz") {
        return read_spz(path).map(Some);
    }
    if has_extension("ksplat") {
        let expected = "trained splats as .ply, .spz or .splat (convert it, for example with SuperSplat)";
        return Err(Error::unsupported(path, "the format .ksplat", expected));
    }
    if has_extension("splat") { read_splat(path).map(Some) } else { Ok(None) }
}
