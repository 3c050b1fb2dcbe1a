//! Pictures as PNG: 8 or 16 bits, sRGB, straight alpha.

use crate::srgb::srgb8_from_linear;
use crate::{AtomicFile, Error, Metadata};
use png::{BitDepth, ColorType, Encoder, EncodingError, PixelDimensions, SrgbRenderingIntent, Unit};
use splat_core::Film;
use splat_core::srgb::encode as srgb_from_linear;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Bits of a value in a PNG file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PngDepth {
    /// 256 levels.
    #[default]
    Eight,
    /// 65,536 levels.
    Sixteen,
}

/// Writes the film's window as a PNG file, in one step ([`AtomicFile`]).
///
/// Color is divided by alpha (nothing where alpha rounds to 0), clamped to [0, 1], encoded as sRGB and
/// rounded to the nearest level, ties up. Without transparency (every alpha rounds to the highest level) the file
/// has no alpha channel. The metadata become text chunks: software as `Software`, the options as `Comment`, pixels an
/// inch the chunk `pHYs`, all else text by the name that it has in EXR files ([`crate::write_exr`]).
///
/// # Errors
/// [`Error::Io`]; [`Error::Core`] if the film is empty or its arrays do not fit its window;
/// [`Error::Encode`].
pub fn write_png(path: &Path, film: &Film, metadata: &Metadata, depth: PngDepth) -> Result<(), Error> {
    check_colors(film).map_err(Error::core(path))?;
    let mut file = AtomicFile::create(path)?;
    encode(BufWriter::new(&mut file), film, metadata, depth).map_err(|error| match error {
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

fn encode(out: impl Write, film: &Film, metadata: &Metadata, depth: PngDepth) -> Result<(), EncodingError> {
    let is_opaque = match depth {
        PngDepth::Eight => film.rgba.iter().all(|pixel| level(pixel[3]) == 255),
        PngDepth::Sixteen => film.rgba.iter().all(|pixel| level16(pixel[3].into()) == u16::MAX),
    };
    let channels = if is_opaque { 3 } else { 4 };
    let mut encoder = Encoder::new(out, film.width() as u32, film.height() as u32);
    encoder.set_color(if is_opaque { ColorType::Rgb } else { ColorType::Rgba });
    encoder.set_depth(match depth {
        PngDepth::Eight => BitDepth::Eight,
        PngDepth::Sixteen => BitDepth::Sixteen,
    });
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    encoder.set_pixel_dims(metadata.pixels_per_inch.map(|density| {
        let per_metre = (density / 0.0254).round() as u32;
        PixelDimensions { xppu: per_metre, yppu: per_metre, unit: Unit::Meter }
    }));
    for (keyword, text) in metadata.texts("Software", "Comment") {
        // A text chunk holds Latin-1 and, between its keyword and text, a zero byte.
        if text.chars().all(|c| c != '\0' && u32::from(c) < 256) {
            encoder.add_text_chunk(keyword.to_owned(), text)?;
        } else {
            encoder.add_itxt_chunk(keyword.to_owned(), text.replace('\0', " "))?;
        }
    }
    let mut writer = encoder.write_header()?;
    let mut stream = writer.stream_writer()?;
    let mut line = Vec::with_capacity(film.width() * channels * 2);
    for pixels in film.rgba.chunks_exact(film.width()) {
        line.clear();
        for &pixel in pixels {
            match depth {
                PngDepth::Eight => line.extend_from_slice(&encode_pixel(pixel)[..channels]),
                PngDepth::Sixteen => {
                    line.extend(
                        encode_pixel16(pixel)[..channels].iter().flat_map(|value| value.to_be_bytes()),
                    );
                }
            }
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

/// A value as one of 65,536 levels: clamped, ties rounded up, not a number as 0.
fn level16(value: f64) -> u16 {
    (value * 65_535.0 + 0.5) as u16
}

/// Straight alpha, sRGB, from premultiplied linear.
fn encode_pixel16([red, green, blue, alpha]: [f32; 4]) -> [u16; 4] {
    if level16(alpha.into()) == 0 {
        return [0; 4];
    }
    let straight = |value: f32| level16(srgb_from_linear(f64::from(value) / f64::from(alpha)));
    [straight(red), straight(green), straight(blue), level16(alpha.into())]
}

/// The levels of a linear, premultiplied color.
pub(crate) fn display_levels(pixel: [f32; 4], depth: PngDepth) -> [u16; 4] {
    match depth {
        PngDepth::Eight => encode_pixel(pixel).map(u16::from),
        PngDepth::Sixteen => encode_pixel16(pixel),
    }
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
        write_as(film, metadata, PngDepth::Eight)
    }

    fn write_as(film: &Film, metadata: &Metadata, depth: PngDepth) -> (Vec<u8>, png::Info<'static>) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.png");
        write_png(&path, film, metadata, depth).unwrap();
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
    fn sixteen_bits_tell_more_levels() {
        let film =
            film(&[[0.0; 4], [0.25, 0.5, 0.0, 0.5], [2.0, f32::NAN, -1.0, 1.0], [0.214, 0.2141, 0.0, 1.0]]);
        let (bytes, info) = write_as(&film, &Metadata::default(), PngDepth::Sixteen);
        assert_eq!((info.color_type, info.bit_depth), (ColorType::Rgba, BitDepth::Sixteen));
        let values: Vec<u16> =
            bytes.chunks_exact(2).map(|two| u16::from_be_bytes([two[0], two[1]])).collect();
        // encode(0.5) = 0.735357, encode(0.214) = 0.4999 of the unit.
        let grey = [0.214f32, 0.2141].map(|x| (srgb_from_linear(x.into()) * 65535.0).round() as u16);
        assert_ne!(grey[0], grey[1]);
        let expected =
            [[0, 0, 0, 0], [48192, 65535, 0, 32768], [65535, 0, 0, 65535], [grey[0], grey[1], 0, 65535]];
        assert_eq!(values, expected.concat());
        let opaque = write_as(&self::film(&[[1.0; 4]]), &Metadata::default(), PngDepth::Sixteen);
        assert_eq!((opaque.1.color_type, opaque.0.len()), (ColorType::Rgb, 6));
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
        let message = write_png(Path::new("x.png"), &empty, &Metadata::default(), PngDepth::Eight)
            .unwrap_err()
            .to_string();
        assert_eq!(message, "x.png: picture window: found no pixel, expected one pixel or more");
        let mut short = film(&[[0.0; 4]; 3]);
        short.rgba.pop();
        assert!(write_png(Path::new("x.png"), &short, &Metadata::default(), PngDepth::Sixteen).is_err());
    }
}
