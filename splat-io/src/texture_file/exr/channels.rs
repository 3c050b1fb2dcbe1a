//! All channels of an image of an OpenEXR file, as they stand there.

use super::header::{Header, Part};
use super::{Block, Bytes, Layout, read_blocks};
use crate::Error;
use crate::error::Place;
use crate::texture_file::zeros;
use exr::meta::attribute::SampleType;
use exr::prelude::f16;
use splat_core::PixelRect;
use std::collections::BTreeMap;
use std::io::BufRead;
use std::path::Path;

/// The values of a channel, row by row.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// 16-bit floats.
    Half(Vec<f16>),
    /// 32-bit floats.
    Float(Vec<f32>),
    /// Unsigned integers.
    Uint(Vec<u32>),
}

/// The first flat image of a file.
#[derive(Debug)]
pub(crate) struct Channels {
    /// The data window.
    pub window: PixelRect,
    /// The compression's number in the format.
    pub compression: exr::compression::Compression,
    /// Names and values, by name.
    pub channels: Vec<(String, Values)>,
    /// Other attributes of the header: values by name and type.
    pub attributes: BTreeMap<(Vec<u8>, Vec<u8>), Vec<u8>>,
}

pub(crate) fn read(reader: impl BufRead, size: u64, path: &Path) -> Result<Channels, Error> {
    let mut bytes = Bytes { reader, path, left: size, offset: 0 };
    let header = Header::read(&mut bytes)?;
    let Some(index) = header.parts.iter().position(|part| !part.is_deep) else {
        return Err(Error::unsupported(path, "deep data", "a flat image"));
    };
    let part = &header.parts[index];
    let window = window(part, path)?;
    let layout = Layout::new(part, size, path)?;
    bytes.skip(8 * header.parts.iter().map(|part| part.chunks).sum::<u64>())?;
    let mut channels = Vec::with_capacity(part.channels.len());
    for channel in &part.channels {
        let values = match channel.kind {
            SampleType::F16 => Values::Half(zeros(path, layout.pixels)?),
            SampleType::F32 => Values::Float(zeros(path, layout.pixels)?),
            SampleType::U32 => Values::Uint(zeros(path, layout.pixels)?),
        };
        channels.push((String::from_utf8_lossy(&channel.name).into_owned(), values));
    }
    read_blocks(&mut bytes, &header, index, &layout, |block| block.copy_all(&mut channels))?;
    let attributes = part.attributes.iter().cloned().map(|a| ((a.name, a.kind), a.value)).collect();
    Ok(Channels { window, compression: layout.compression, channels, attributes })
}

/// The data window, whose corners are 32-bit numbers here.
fn window(part: &Part, path: &Path) -> Result<PixelRect, Error> {
    let end = |axis: usize| {
        let end = i64::from(part.corner[axis]) + i64::try_from(part.size[axis]).unwrap_or(i64::MAX);
        i32::try_from(end).map_err(|_| {
            Error::invalid(path, Place::Field("dataWindow"), format!("an end at {end}"), "at most 2147483647")
        })
    };
    Ok(PixelRect::new(part.corner[0], part.corner[1], end(0)?, end(1)?))
}

impl Block<'_> {
    /// Copies every channel into the image's.
    fn copy_all(&self, channels: &mut [(String, Values)]) {
        let width = self.size[0];
        for (row, line) in self.data.chunks_exact(width * self.layout.pixel_bytes).enumerate() {
            let start = (self.start[1] + row) * self.layout.size[0] + self.start[0];
            let mut rest = line;
            for (_, values) in &mut *channels {
                rest = match values {
                    Values::Half(values) => copy(&mut values[start..start + width], rest, f16::from_ne_bytes),
                    Values::Float(values) => {
                        copy(&mut values[start..start + width], rest, f32::from_ne_bytes)
                    }
                    Values::Uint(values) => copy(&mut values[start..start + width], rest, u32::from_ne_bytes),
                };
            }
        }
    }
}

/// Fills `values` from the start of `bytes`; returns the rest.
fn copy<'a, T, const N: usize>(values: &mut [T], bytes: &'a [u8], convert: fn([u8; N]) -> T) -> &'a [u8] {
    let (chunks, _) = bytes.as_chunks::<N>();
    values.iter_mut().zip(chunks).for_each(|(value, &chunk)| *value = convert(chunk));
    &bytes[values.len() * N..]
}
