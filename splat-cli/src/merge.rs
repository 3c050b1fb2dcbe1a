//! `splat merge`: one picture from its pieces.

use crate::arguments::MergeArguments;
use crate::console::Console;
use crate::output::{check_picture, spare_inputs};
use crate::usage::UsageError;
use anyhow::{Context, ensure};
use splat_core::{AovSelection, Film};
use splat_io::{ExrPicture, PictureFormat, Piece, Values, merge, read_exr, write_exr_picture, write_png};
use std::path::Path;

/// Runs the command.
///
/// # Errors
/// Pieces that cannot be read or joined; what the writer says.
pub fn run(arguments: &MergeArguments) -> anyhow::Result<()> {
    let MergeArguments { pieces, output, crop, .. } = arguments;
    let console = Console { quiet: arguments.quiet, verbose: false };
    spare_inputs(output, pieces)?;
    check_picture(output, AovSelection::default(), false)?;
    let count = pieces.len();
    let pieces = pieces.iter().map(|path| read(path)).collect::<anyhow::Result<Vec<Piece>>>()?;
    let of_pieces = pieces.first().and_then(|piece| piece.picture.compression);
    if let (Some(crop), Some(Piece { picture: ExrPicture { frame, .. }, .. })) = (crop, pieces.first()) {
        let [width, height] = [frame.width(), frame.height()];
        let message = format!("--crop reaches beyond the frame of {width}x{height} pixels");
        ensure!(crop.intersect(frame) == *crop, UsageError::new(message));
    }
    let picture = merge(pieces, *crop)?;
    if PictureFormat::from_path(output)? == PictureFormat::Png {
        write_png(output, &film(&picture)?, &picture.metadata, arguments.png_depth.into())?;
    } else {
        let compression = arguments.exr_compression.map(Into::into).or(of_pieces).unwrap_or_default();
        write_exr_picture(output, &picture, compression)?;
    }
    let (width, height) = (picture.window.width(), picture.window.height());
    let pieces = if count == 1 { "piece" } else { "pieces" };
    console.summary(format_args!("{}: {count} {pieces} joined, {width}x{height} pixels", output.display()));
    Ok(())
}

fn read(path: &Path) -> anyhow::Result<Piece> {
    let is_png = PictureFormat::from_path(path).is_ok_and(|format| format == PictureFormat::Png);
    ensure!(
        !is_png,
        "{}: pieces must be .exr files: those have all bits, and say where they belong",
        path.display()
    );
    Ok(Piece { path: path.to_owned(), picture: read_exr(path)? })
}

/// The colours of a picture, for a PNG file.
fn film(picture: &ExrPicture) -> anyhow::Result<Film> {
    let float = |name: &str| match picture.channel(name) {
        Some(Values::Float(values)) => Some(values),
        _ => None,
    };
    let channels = ["R", "G", "B", "A"].map(float).into_iter().collect::<Option<Vec<_>>>();
    let channels = channels.context(UsageError::new(
        "a .png of these pieces would not be that of one run, since half floats are rounded already: render them with \
         --exr-type float, or write an .exr file",
    ))?;
    let mut film = Film::new([0; 2], picture.window, AovSelection::default());
    for (index, rgba) in film.rgba.iter_mut().enumerate() {
        rgba.iter_mut().zip(&channels).for_each(|(value, channel)| *value = channel[index]);
    }
    Ok(film)
}
