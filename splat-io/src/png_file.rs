//! Pictures as PNG: 8 bits, sRGB, straight alpha.

use crate::srgb::srgb8_from_linear;
use crate::{AtomicFile, Error, Metadata};
use png::{BitDepth, ColorType, Encoder, EncodingError, PixelDimensions, SrgbRenderingIntent, Unit};
use splat_core::Film;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Writes the film's window as a PNG file, in one step ([`AtomicFile`]).
///
/// Color is divided by alpha (nothing where alpha rounds to 0), clamped to [0, 1], encoded as sRGB and
/// rounded to the nearest of 256 levels, ties up. Without transparency (every alpha rounds to 255) the file
/// has no alpha channel. The software and the options of the metadata become text chunks `Software` and
/// `Comment`, pixels an inch the chunk `pHYs`.
///
/// # Errors
/// [`Error::Io`]; [`Error::Core`] if the film is empty or its arrays do not fit its window;
/// [`Error::Encode`].
pub fn write_png(path: &Path, film: &Film, metadata: &Metadata) -> Result<(), Error> {
    check_colors(film).map_err(Error::core(path))?;
    let mut file = AtomicFile::create(path)?;
    encode(BufWriter::new(&mut file), film, metadata).map_err(|error| match error {
        EncodingError::IoError(error) => Error::io(path, "write")(error),
        other => Error::Encode { path: path.to_owned(), reason: other.to_string() },
    })?;
    file.commit()
}

/// Checks that the film has a color for every pixel of its window, and at least one.
pub(crate) fn check_colors(film: &Film) -> Result<(), splat_core::Error> {
    if film.window.is_empty() {
        return Err(splat_core::Error::invalid("picture window", "no pixel", "one pixel or more"));
    }
    check_length("rgba", film.rgba.len(), film)
}

/// Checks the length of one of the film's arrays.
pub(crate) fn check_length(what: &'static str, found: usize, film: &Film) -> Result<(), splat_core::Error> {
    let expected = film.window.area();
    if found == expected {
        Ok(())
    } else {
        Err(splat_core::Error::invalid(what, format!("{found} for {expected} pixels"), "a value a pixel"))
    }
}

fn encode(out: impl Write, film: &Film, metadata: &Metadata) -> Result<(), EncodingError> {
    let is_opaque = film.rgba.iter().all(|pixel| level(pixel[3]) == 255);
    let channels = if is_opaque { 3 } else { 4 };
    let mut encoder = Encoder::new(out, film.width() as u32, film.height() as u32);
    encoder.set_color(if is_opaque { ColorType::Rgb } else { ColorType::Rgba });
    encoder.set_depth(BitDepth::Eight);
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    encoder.set_pixel_dims(metadata.pixels_per_inch.map(|density| {
        let per_metre = (density / 0.0254).round() as u32;
        PixelDimensions { xppu: per_metre, yppu: per_metre, unit: Unit::Meter }
    }));
    for (keyword, text) in [("Software", &metadata.software), ("Comment", &metadata.options)] {
        // A text chunk holds Latin-1 and, between its keyword and text, a zero byte.
        let Some(text) = text else { continue };
        if text.chars().all(|c| c != '\0' && u32::from(c) < 256) {
            encoder.add_text_chunk(keyword.to_owned(), text.clone())?;
        } else {
            encoder.add_itxt_chunk(keyword.to_owned(), text.replace('\0', " "))?;
        }
    }
    let mut writer = encoder.write_header()?;
    let mut stream = writer.stream_writer()?;
    let mut line = Vec::with_capacity(film.width() * channels);
    for pixels in film.rgba.chunks_exact(film.width()) {
        line.clear();
        for &pixel in pixels {
            line.extend_from_slice(&encode_pixel(pixel)[..channels]);
        }
        stream.write_all(&line)?;
    }
    stream.finish()?;
    writer.finish()
}

/// An alpha as one of 256 levels, ties rounded up.
fn level(alpha: f32) -> u8 {
    (f64::from(alpha) * 255.0 + 0.5) as u8
}

/// Straight alpha, sRGB, from premultiplied linear.
fn encode_pixel([red, green, blue, alpha]: [f32; 4]) -> [u8; 4] {
    if level(alpha) == 0 {
        return [0; 4];
    }
    let straight = |value: f32| srgb8_from_linear(f64::from(value) / f64::from(alpha));
    [straight(red), straight(green), straight(blue), level(alpha)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::{AovSelection, PixelRect};
    use std::fs;

    fn film(pixels: &[[f32; 4]]) -> Film {
        let window = PixelRect::new(0, 0, pixels.len() as i32, 1);
        let mut film = Film::new([pixels.len() as u32, 1], window, AovSelection::default());
        film.rgba.copy_from_slice(pixels);
        film
    }

    fn write(film: &Film, metadata: &Metadata) -> (Vec<u8>, png::Info<'static>) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.png");
        write_png(&path, film, metadata).unwrap();
        let bytes = fs::read(&path).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        reader.finish().unwrap();
        (pixels, reader.info().clone())
    }

    #[test]
    fn alpha_is_straight_and_color_is_srgb() {
        let film = film(&[
            [0.0, 0.0, 0.0, 0.0],
            [9.0, 9.0, 9.0, 0.0],
            [0.25, 0.5, 0.0, 0.5],
            [1.0, 2.0, -1.0, 1.0],
            [0.214, 0.214, 0.214, 1.0],
        ]);
        let (pixels, info) = write(&film, &Metadata::default());
        assert_eq!(info.color_type, ColorType::Rgba);
        let expected = [[0; 4], [0; 4], [188, 255, 0, 128], [255, 255, 0, 255], [127, 127, 127, 255]];
        assert_eq!(pixels, expected.concat());
    }

    #[test]
    fn an_opaque_picture_has_no_alpha_channel() {
        let (pixels, info) = write(&film(&[[0.0, 1.0, 0.0, 1.0]]), &Metadata::default());
        assert_eq!(info.color_type, ColorType::Rgb);
        assert_eq!(pixels, [0, 255, 0]);
    }

    #[test]
    fn not_a_number_is_black_or_nothing() {
        assert_eq!(encode_pixel([f32::NAN, f32::INFINITY, -f32::INFINITY, 1.0]), [0, 255, 0, 255]);
        assert_eq!(encode_pixel([1.0, 1.0, 1.0, f32::NAN]), [0; 4]);
    }

    #[test]
    fn it_says_what_it_is() {
        let metadata = Metadata {
            software: Some("splat 1".to_owned()),
            options: Some("--view front → ü".to_owned()),
            pixels_per_inch: Some(300.0),
            ..Metadata::default()
        };
        let (_, info) = write(&film(&[[0.0; 4]; 3]), &metadata);
        assert_eq!(info.srgb, Some(SrgbRenderingIntent::Perceptual));
        assert_eq!(info.uncompressed_latin1_text[0].keyword, "Software");
        assert_eq!(info.uncompressed_latin1_text[0].text, "splat 1");
        let size = info.pixel_dims.unwrap();
        assert_eq!((size.xppu, size.yppu, size.unit), (11_811, 11_811, Unit::Meter));
        assert_eq!(info.utf8_text[0].get_text().unwrap(), "--view front → ü");
    }

    #[test]
    fn an_empty_or_damaged_film_is_refused() {
        let empty = Film::new([4, 4], PixelRect::new(2, 2, 2, 2), AovSelection::default());
        let message = write_png(Path::new("x.png"), &empty, &Metadata::default()).unwrap_err().to_string();
        assert_eq!(message, "x.png: picture window: found no pixel, expected one pixel or more");
        let mut short = film(&[[0.0; 4]; 3]);
        short.rgba.pop();
        assert!(write_png(Path::new("x.png"), &short, &Metadata::default()).is_err());
    }
}
