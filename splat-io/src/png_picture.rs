//! PNG pictures as they stand in files: to compare.

use crate::ply::open;
use crate::png_file::display_levels;
use crate::texture_file::Format;
use crate::texture_file::png::{Decoded, decode};
use crate::{Error, PngDepth};
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// A picture of levels: red, green, blue (sRGB) and alpha (straight).
#[derive(Debug, Clone, PartialEq)]
pub struct PngPicture {
    /// Width and height, in pixels.
    pub size: [u32; 2],
    /// How many levels there are.
    pub depth: PngDepth,
    /// Row by row; grey as three equal colours, opaque where there is no alpha.
    pub pixels: Vec<[u16; 4]>,
}

/// Reads a PNG file of any colour type; one of less than 8 bits as one of 8. `gAMA`, `iCCP` and the like are ignored.
///
/// # Errors
/// [`Error::Io`]; [`Error::Unsupported`] for what is no PNG file; [`Error::Limit`] and [`Error::Invalid`] as for textures
/// ([`crate::texture_file`]).
pub fn read_png(path: &Path) -> Result<PngPicture, Error> {
    let (mut file, size) = open(path)?;
    let mut start = Vec::new();
    file.by_ref().take(16).read_to_end(&mut start).map_err(Error::io(path, "read"))?;
    file.seek(SeekFrom::Start(0)).map_err(Error::io(path, "read"))?;
    if Format::of(&start) != Format::Png {
        return Err(Error::unsupported(path, "a file that is no PNG image", "a PNG image"));
    }
    let Decoded { size, channels, has_alpha, is_16_bit, data } =
        decode(BufReader::with_capacity(256 << 10, file), size, path)?;
    let depth = if is_16_bit { PngDepth::Sixteen } else { PngDepth::Eight };
    let pixel = |sample: &dyn Fn(usize) -> u16| {
        let is_grey = channels < 3;
        let color = |component: usize| sample(if is_grey { 0 } else { component });
        let alpha = if has_alpha { sample(channels - 1) } else { depth.highest() };
        [color(0), color(1), color(2), alpha]
    };
    let mut pixels = Vec::new();
    let bytes = channels * if is_16_bit { 2 } else { 1 };
    let count = data.len() / bytes;
    if pixels.try_reserve_exact(count).is_err() {
        return Err(Error::limit(path, format!("an image of {count} pixels"), "free memory"));
    }
    pixels.extend(data.chunks_exact(bytes).map(|bytes| match depth {
        PngDepth::Eight => pixel(&|index| bytes[index].into()),
        PngDepth::Sixteen => pixel(&|index| u16::from_be_bytes([bytes[2 * index], bytes[2 * index + 1]])),
    }));
    Ok(PngPicture { size, depth, pixels })
}

impl PngDepth {
    /// The highest level.
    pub fn highest(self) -> u16 {
        match self {
            Self::Eight => 255,
            Self::Sixteen => u16::MAX,
        }
    }

    /// The levels that [`crate::write_png`] has for a linear, premultiplied colour.
    pub fn levels(self, rgba: [f32; 4]) -> [u16; 4] {
        display_levels(rgba, self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Metadata, write_png};
    use splat_core::{AovSelection, Film, PixelRect};

    #[test]
    fn what_was_written_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.png");
        let window = PixelRect::new(0, 0, 3, 1);
        let mut film = Film::new([3, 1], window, AovSelection::default());
        for alpha in [0.5, 1.0] {
            film.rgba = vec![[0.25, 0.5, 0.0, alpha], [1.0, 2.0, -1.0, 1.0], [0.214, 0.2141, 0.0, 1.0]];
            for depth in [PngDepth::Eight, PngDepth::Sixteen] {
                write_png(&path, &film, &Metadata::default(), depth).unwrap();
                let read = read_png(&path).unwrap();
                assert_eq!((read.size, read.depth), ([3, 1], depth));
                let expected: Vec<_> = film.rgba.iter().map(|&rgba| depth.levels(rgba)).collect();
                assert_eq!(read.pixels, expected);
            }
        }
        let bytes = std::fs::read(&path).unwrap();
        for length in 0..bytes.len() - 12 {
            std::fs::write(&path, &bytes[..length]).unwrap();
            assert!(read_png(&path).is_err(), "{length}");
        }
    }
}
