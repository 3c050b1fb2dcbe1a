//! A picture of the differences.

use super::measure::{Difference, difference};
use super::pictures::Pair;
use crate::usage::UsageError;
use colorous::MAGMA;
use splat_core::{AovSelection, Film, PixelRect};
use splat_io::srgb::linear_from_srgb8;
use splat_io::{
    Compression, ExrPicture, Metadata, PictureFormat, PngDepth, Values, write_exr_picture, write_png,
};
use std::path::Path;

/// Writes FLIP's map in colours (.png), or the absolute differences of all channels and the map as floats (.exr).
///
/// # Errors
/// What the writers say; a .png of pictures without colours.
pub fn write(path: &Path, pair: &Pair, found: &Difference) -> anyhow::Result<()> {
    let [width, height] = pair.size;
    let frame = PixelRect::new(0, 0, width as i32, height as i32);
    if PictureFormat::from_path(path)? == PictureFormat::Png {
        let Some(map) = &found.flip else {
            return Err(
                UsageError::new("no colours, no .png of their differences: write an .exr file").into()
            );
        };
        let mut film = Film::new([width as u32, height as u32], frame, AovSelection::default());
        for (rgba, &error) in film.rgba.iter_mut().zip(map) {
            let color = MAGMA.eval_continuous(error.clamp(0.0, 1.0).into());
            let [red, green, blue] =
                [color.r, color.g, color.b].map(|level| linear_from_srgb8()[usize::from(level)]);
            *rgba = [red, green, blue, 1.0];
        }
        return Ok(write_png(path, &film, &Metadata::default(), PngDepth::Eight)?);
    }
    let area = width * height;
    let differences = pair.channels.iter().map(|(name, [a, b])| {
        let values = (0..area).map(|index| difference(a.get(index), b.get(index)) as f32).collect();
        (name.clone(), Values::Float(values))
    });
    let map = found.flip.iter().map(|map| ("flip".to_owned(), Values::Float(map.clone())));
    let picture = ExrPicture {
        frame: PixelRect::new(0, 0, pair.window.x1.max(1), pair.window.y1.max(1)),
        window: pair.window,
        channels: differences.chain(map).collect(),
        metadata: Metadata::default(),
        position_origin: None,
        ending: None,
        compression: None,
    };
    Ok(write_exr_picture(path, &picture, Compression::Zip)?)
}
