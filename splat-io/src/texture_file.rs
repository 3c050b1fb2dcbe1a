//! Images that become textures: PNG and OpenEXR.
//!
//! The format is told by the file's first bytes, not by its name.
//!
//! PNG, every colour type and bit depth: integers are sRGB, alpha is straight. The chunks `gAMA`, `cHRM`, `sRGB` and
//! `iCCP` are ignored: the few files that mean anything but sRGB by them are outnumbered by those that carry
//! them by mistake. Of an animation, the still image counts.
//!
//! | PNG | texels |
//! |---|---|
//! | up to 8 bits a channel, no transparency | [`Texels::Srgb8`]: the very codes; an alpha that is opaque everywhere is dropped |
//! | up to 8 bits, some transparency | [`Texels::F16`], linear, premultiplied: its error is at most 1/36 of a code |
//! | 16 bits | [`Texels::F32`], linear, premultiplied: 16-bit floats would lose the last four of the bits |
//!
//! OpenEXR: scan lines or tiles (the largest level of several), every compression but HTJ2K, any part of a multi-part
//! file. Read are `R G B` and, if present, `A`; without these `Y` (grey) and `A`; channels without a layer's name come
//! first, then the layers in the order of their names. Chroma (`RY BY`) is ignored. Values are linear and premultiplied, as the
//! format has it; `half` becomes [`Texels::F16`], anything else [`Texels::F32`] (`uint`: the number itself). Only the
//! size of the data window counts, not its place.
//!
//! A size that a header claims is held against limits ([`MAX_PIXELS`], 2^24 per axis) and against what so small a
//! file can hold, before anything is allocated.

pub(crate) mod exr;
pub(crate) mod png;
#[cfg(test)]
mod tests;

use crate::Error;
use crate::error::quoted;
use crate::ply::open;
use splat_core::texture::pyramid::{MAX_SIZE, Pyramid, Texels, Wrap};
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// The most pixels of an image: 16384 x 16384. With four 32-bit floats each, that is 4 GiB.
pub const MAX_PIXELS: u64 = 1 << 28;

/// Reads an image as a texture. See the [module](self) for what is understood.
///
/// # Errors
/// [`Error::Io`]; [`Error::Unsupported`] for other formats, deep data, channels that make no colour, subsampled channels and
/// what is no regular file; [`Error::Limit`] for an image of more than [`MAX_PIXELS`], 2^24 per axis, or more than
/// memory; [`Error::Invalid`] for anything damaged, truncated, or claiming more than the file can hold.
pub fn read_pyramid(path: &Path, wrap: [Wrap; 2]) -> Result<Pyramid, Error> {
    let (file, size) = open(path)?;
    read_pyramid_from(BufReader::with_capacity(256 << 10, file), size, path, wrap)
}

/// Reads an image of `size` bytes from the start of `reader` as a texture; `path` is its name in messages.
///
/// # Errors
/// As [`read_pyramid`].
pub fn read_pyramid_from(
    mut reader: impl BufRead + Seek,
    size: u64,
    path: &Path,
    wrap: [Wrap; 2],
) -> Result<Pyramid, Error> {
    let mut start = Vec::new();
    reader.by_ref().take(16).read_to_end(&mut start).map_err(Error::io(path, "read"))?;
    reader.seek(SeekFrom::Start(0)).map_err(Error::io(path, "read"))?;
    let image = match Format::of(&start) {
        Format::Png => png::read(reader, size, path)?,
        Format::Exr => exr::read(reader, size, path)?,
        Format::Other(name) => {
            return Err(Error::unsupported(path, name, "a PNG or OpenEXR image: convert it to one of these"));
        }
        Format::Unknown => {
            let found = match start.len() {
                0 => "an empty file".to_owned(),
                _ => format!("a file that starts with {}", quoted(&start)),
            };
            return Err(Error::unsupported(path, found, "a PNG or OpenEXR image"));
        }
    };
    Pyramid::new(image.size, image.channels, image.texels, wrap)
        .map_err(|error| Error::limit(path, error.to_string(), format!("{MAX_SIZE} texels per axis")))
}

/// An image as a pyramid takes it.
struct Image {
    size: [u32; 2],
    channels: usize,
    texels: Texels,
}

/// What the first bytes of a file say.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Format {
    Png,
    Exr,
    /// A known format that is not read, with its article.
    Other(&'static str),
    Unknown,
}

impl Format {
    pub(crate) fn of(start: &[u8]) -> Self {
        if start.get(8..12) == Some(b"WEBP") && start.starts_with(b"RIFF") {
            return Self::Other("a WebP image");
        }
        let formats: [(&[u8], Self); 13] = [
            (b"\x89PNG\r\n\x1a\n", Self::Png),
            (b"\x76\x2f\x31\x01", Self::Exr),
            (b"\xff\xd8\xff", Self::Other("a JPEG image")),
            (b"GIF8", Self::Other("a GIF image")),
            (b"II*\0", Self::Other("a TIFF image")),
            (b"MM\0*", Self::Other("a TIFF image")),
            (b"BM", Self::Other("a BMP image")),
            (b"#?R", Self::Other("a Radiance HDR image")),
            (b"8BPS", Self::Other("a Photoshop image")),
            (b"DDS ", Self::Other("a DDS image")),
            (b"Ptex", Self::Other("a Ptex texture")),
            (b"\xabKTX ", Self::Other("a KTX texture")),
            (b"\0\0\0\x0cjP  ", Self::Other("a JPEG 2000 image")),
        ];
        let format = formats.into_iter().find(|(magic, _)| start.starts_with(magic));
        format.map_or(Self::Unknown, |(_, format)| format)
    }
}

/// Holds the size that an image claims against the limits; its pixels.
fn check_size(path: &Path, width: u64, height: u64) -> Result<usize, Error> {
    let most = u64::from(MAX_SIZE);
    if width > most || height > most {
        return Err(Error::limit(
            path,
            format!("an image of {width} x {height} pixels"),
            format!("{most} pixels per axis"),
        ));
    }
    let pixels = width * height;
    if pixels > MAX_PIXELS {
        return Err(Error::limit(
            path,
            format!("an image of {width} x {height} pixels"),
            format!("{MAX_PIXELS} pixels"),
        ));
    }
    Ok(pixels as usize)
}

/// That many values, all zero, or an error where memory ends.
fn zeros<T: Copy + Default>(path: &Path, count: usize) -> Result<Vec<T>, Error> {
    let mut values = Vec::new();
    if values.try_reserve_exact(count).is_err() {
        return Err(Error::limit(path, format!("an image of {count} values"), "free memory"));
    }
    values.resize(count, T::default());
    Ok(values)
}
