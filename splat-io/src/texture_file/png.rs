//! PNG.

use super::{Image, check_size, zeros};
use crate::srgb::linear_from_srgb8;
use crate::{Error, error::Place};
use png::{BitDepth, ColorType, Decoder, DecodingError, Limits, Transformations};
use splat_core::srgb;
use splat_core::texture::pyramid::{Texels, f16};
use std::io::{BufRead, ErrorKind, Seek};
use std::path::Path;

/// The most that the decoder may allocate besides the image: a line, a palette.
const DECODER_BYTES: usize = 256 << 20;

/// Deflate makes at most this many bytes of one.
const MOST_BYTES_OF_ONE: u64 = 1032;

/// An image as the file has it.
pub(crate) struct Decoded {
    pub size: [u32; 2],
    /// Samples of a pixel.
    pub channels: usize,
    /// Whether the last of them is alpha.
    pub has_alpha: bool,
    /// Whether samples have 16 bits, the most significant byte first, or else 8.
    pub is_16_bit: bool,
    /// Row by row.
    pub data: Vec<u8>,
}

/// Unpacks an image to 8 or 16 bits a sample.
pub(crate) fn decode(reader: impl BufRead + Seek, size: u64, path: &Path) -> Result<Decoded, Error> {
    let mut decoder = Decoder::new_with_limits(reader, Limits { bytes: DECODER_BYTES });
    decoder.set_transformations(Transformations::EXPAND);
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let header = decoder.read_header_info().map_err(|error| blame(path, error))?;
    let (width, height) = header.size();
    let pixels = check_size(path, width.into(), height.into())?;
    let packed_bits = pixels as u64 * header.bits_per_pixel() as u64;
    if packed_bits / 8 > size.saturating_mul(MOST_BYTES_OF_ONE) {
        return Err(Error::invalid(
            path,
            Place::Field("IHDR"),
            format!("{width} x {height} pixels in a file of {size} bytes"),
            "no more than the file can hold",
        ));
    }

    let mut reader = decoder.read_info().map_err(|error| blame(path, error))?;
    let (color, depth) = reader.output_color_type();
    let channels = color.samples();
    let bytes = pixels * channels * if depth == BitDepth::Sixteen { 2 } else { 1 };
    let mut data = zeros::<u8>(path, bytes)?;
    reader.next_frame(&mut data).map_err(|error| blame(path, error))?;

    Ok(Decoded {
        size: [width, height],
        channels,
        has_alpha: matches!(color, ColorType::GrayscaleAlpha | ColorType::Rgba),
        is_16_bit: depth == BitDepth::Sixteen,
        data,
    })
}

pub(super) fn read(reader: impl BufRead + Seek, size: u64, path: &Path) -> Result<Image, Error> {
    let Decoded { size, channels, has_alpha, is_16_bit, mut data } = decode(reader, size, path)?;
    if is_16_bit {
        return linear16(size, channels, has_alpha, &data, path);
    }
    if !has_alpha {
        return Ok(Image { size, channels, texels: Texels::Srgb8(data) });
    }
    if data.chunks_exact(channels).all(|pixel| pixel[channels - 1] == u8::MAX) {
        drop_alpha(&mut data, channels);
        return Ok(Image { size, channels: channels - 1, texels: Texels::Srgb8(data) });
    }
    let linear = linear_from_srgb8();
    let mut values = zeros::<f16>(path, data.len())?;
    for (pixel, values) in data.chunks_exact(channels).zip(values.chunks_exact_mut(channels)) {
        let alpha = f32::from(pixel[channels - 1]) / 255.0;
        for (&code, value) in pixel.iter().zip(&mut *values) {
            *value = f16::from_f32(linear[usize::from(code)] * alpha);
        }
        values[channels - 1] = f16::from_f32(alpha);
    }
    Ok(Image { size, channels, texels: Texels::F16(values) })
}

/// 16-bit samples, most significant byte first, as linear values, premultiplied if there is a transparent pixel.
fn linear16(
    size: [u32; 2],
    channels: usize,
    has_alpha: bool,
    data: &[u8],
    path: &Path,
) -> Result<Image, Error> {
    let linear: Vec<f32> =
        (0..=u16::MAX).map(|code| srgb::decode(f64::from(code) / 65535.0) as f32).collect();
    let code = |bytes: &[u8]| u16::from_be_bytes([bytes[0], bytes[1]]);
    let alpha = |pixel: &[u8]| code(&pixel[2 * (channels - 1)..]);
    let is_opaque = !has_alpha || data.chunks_exact(2 * channels).all(|pixel| alpha(pixel) == u16::MAX);
    let colors = if has_alpha { channels - 1 } else { channels };
    let kept = if is_opaque { colors } else { channels };
    let mut values = zeros::<f32>(path, data.len() / (2 * channels) * kept)?;
    for (pixel, values) in data.chunks_exact(2 * channels).zip(values.chunks_exact_mut(kept)) {
        let alpha = if is_opaque { 1.0 } else { f32::from(alpha(pixel)) / 65535.0 };
        for (bytes, value) in pixel.chunks_exact(2).zip(&mut values[..colors]) {
            *value = linear[usize::from(code(bytes))] * alpha;
        }
        if !is_opaque {
            values[colors] = alpha;
        }
    }
    Ok(Image { size, channels: kept, texels: Texels::F32(values) })
}

/// Removes the last channel, in place.
fn drop_alpha(data: &mut Vec<u8>, channels: usize) {
    let pixels = data.len() / channels;
    let colors = channels - 1;
    for pixel in 0..pixels {
        data.copy_within(pixel * channels..pixel * channels + colors, pixel * colors);
    }
    data.truncate(pixels * colors);
    data.shrink_to_fit();
}

fn blame(path: &Path, error: DecodingError) -> Error {
    match error {
        DecodingError::IoError(cause) if cause.kind() == ErrorKind::UnexpectedEof => {
            Error::invalid(path, Place::File, "the end of the file", "more of the PNG image")
        }
        DecodingError::IoError(cause) => Error::io(path, "read")(cause),
        DecodingError::LimitsExceeded => {
            Error::limit(path, "the memory for a line of the image", format!("{DECODER_BYTES} bytes"))
        }
        error @ (DecodingError::Format(_) | DecodingError::Parameter(_)) => {
            Error::invalid(path, Place::File, format!("a damaged PNG image ({error})"), "an intact one")
        }
    }
}
