//! Pictures in whichever format the file's name asks for.

use crate::exr_file::{write_aov_files, write_color_exr};
use crate::{Error, ExrOptions, Metadata, PngDepth, write_exr, write_png};
use splat_core::Film;
use std::path::Path;

/// A format of picture files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PictureFormat {
    /// OpenEXR: everything that the film holds.
    Exr,
    /// PNG: color and alpha.
    Png,
}

impl PictureFormat {
    /// The format that the extension of a file's name asks for, in upper or lower case.
    ///
    /// # Errors
    /// [`Error::Unsupported`] naming what there is.
    pub fn from_path(path: &Path) -> Result<Self, Error> {
        match path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase()).as_deref() {
            Some("exr") => Ok(Self::Exr),
            Some("png") => Ok(Self::Png),
            Some(other) => {
                Err(Error::unsupported(path, format!("the picture format .{other}"), ".exr or .png"))
            }
            None => Err(Error::unsupported(path, "a picture's name without an extension", ".exr or .png")),
        }
    }
}

/// How pictures are packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PictureOptions {
    /// Of EXR files.
    pub exr: ExrOptions,
    /// Of PNG files.
    pub png_depth: PngDepth,
    /// Whether each AOV becomes an EXR file of its own ([`write_aov_files`]), which lets a PNG file have some, too.
    pub separate_aovs: bool,
}

/// Writes a picture in the format that the file's extension asks for, each file in one step ([`crate::AtomicFile`]).
///
/// # Errors
/// As [`PictureFormat::from_path`], [`write_exr`] and [`write_png`].
pub fn write_picture(
    path: &Path,
    film: &Film,
    metadata: &Metadata,
    options: &PictureOptions,
) -> Result<(), Error> {
    match PictureFormat::from_path(path)? {
        PictureFormat::Exr if options.separate_aovs => write_color_exr(path, film, metadata, &options.exr)?,
        PictureFormat::Exr => write_exr(path, film, metadata, &options.exr)?,
        PictureFormat::Png => write_png(path, film, metadata, options.png_depth)?,
    }
    if options.separate_aovs {
        write_aov_files(path, film, metadata, &options.exr)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extension_picks_the_format() {
        assert_eq!(PictureFormat::from_path(Path::new("a.b/x.EXR")).unwrap(), PictureFormat::Exr);
        assert_eq!(PictureFormat::from_path(Path::new("x.png")).unwrap(), PictureFormat::Png);
        for name in ["x.jpg", "x", ".png", "png"] {
            let message = PictureFormat::from_path(Path::new(name)).unwrap_err().to_string();
            assert!(message.starts_with(name) && message.contains(".exr or .png"), "{message}");
        }
    }
}
