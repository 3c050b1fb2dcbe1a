//! OpenEXR. Headers and the places of blocks are read here, with every claim checked; the crate `exr` unpacks single blocks, of
//! sizes that have been checked.

pub(crate) mod channels;
mod header;

use super::{Image, check_size, zeros};
use crate::Error;
use crate::error::{Place, quoted};
use exr::compression::Compression;
use exr::math::RoundingMode;
use exr::meta::BlockDescription;
use exr::meta::attribute::{
    ChannelDescription, IntegerBounds, LevelMode, LineOrder, SampleType, Text, TileDescription,
};
use exr::prelude::Vec2;
use header::{Header, Part};
use splat_core::texture::pyramid::{Texels, f16};
use std::io::{self, BufRead, ErrorKind, Read};
use std::panic::{self, AssertUnwindSafe};
use std::path::Path;

/// The most bytes of one unpacked block: a block of 256 lines of [`super::MAX_PIXELS`]' 16384 pixels and 64 channels.
const MAX_BLOCK_BYTES: u64 = 1 << 30;

pub(super) fn read(reader: impl BufRead, size: u64, path: &Path) -> Result<Image, Error> {
    let mut bytes = Bytes { reader, path, left: size, offset: 0 };
    let header = Header::read(&mut bytes)?;
    let (index, layer) = Layer::choose(&header.parts, path)?;
    let layout = Layout::new(&header.parts[index], size, path)?;
    // Blocks follow each other, so that their places need not be looked up, and may be wrong.
    bytes.skip(8 * header.parts.iter().map(|part| part.chunks).sum::<u64>())?;
    if layer.is_half(layout.part) {
        let mut values = zeros::<f16>(path, layout.pixels * layer.channels.len())?;
        read_blocks(&mut bytes, &header, index, &layout, |block| {
            block.copy(&layer, &mut values, |data, _| f16::from_ne_bytes([data[0], data[1]]));
        })?;
        Ok(layer.into_image(&layout, Texels::F16(values)))
    } else {
        let mut values = zeros::<f32>(path, layout.pixels * layer.channels.len())?;
        read_blocks(&mut bytes, &header, index, &layout, |block| block.copy(&layer, &mut values, to_f32))?;
        Ok(layer.into_image(&layout, Texels::F32(values)))
    }
}

/// The bytes of a file in turn.
struct Bytes<'a, R> {
    reader: R,
    path: &'a Path,
    /// Bytes from here to the end, as the file system has it.
    left: u64,
    /// Place in the file, in bytes.
    offset: u64,
}

impl<R> Bytes<'_, R> {
    fn invalid(&self, found: impl Into<String>, expected: impl Into<String>) -> Error {
        Error::invalid(self.path, Place::Byte(self.offset), found, expected)
    }
}

impl<R: Read> Bytes<'_, R> {
    /// Marks bytes as about to be read, if the file has as many.
    fn claim(&mut self, count: u64) -> Result<(), Error> {
        if count > self.left {
            let found = format!("{} bytes to the end of the file", self.left);
            return Err(self.invalid(found, format!("{count} or more")));
        }
        self.left -= count;
        self.offset += count;
        Ok(())
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Error> {
        self.claim(N as u64)?;
        let mut array = [0; N];
        self.reader.read_exact(&mut array).map_err(|error| self.blame(error))?;
        Ok(array)
    }

    fn take(&mut self, count: u64) -> Result<Vec<u8>, Error> {
        self.claim(count)?;
        let mut bytes = zeros(self.path, usize::try_from(count).unwrap_or(usize::MAX))?;
        self.reader.read_exact(&mut bytes).map_err(|error| self.blame(error))?;
        Ok(bytes)
    }

    fn skip(&mut self, count: u64) -> Result<(), Error> {
        self.claim(count)?;
        let skipped = io::copy(&mut self.reader.by_ref().take(count), &mut io::sink());
        match skipped {
            Ok(skipped) if skipped == count => Ok(()),
            Ok(_) => Err(self.blame(ErrorKind::UnexpectedEof.into())),
            Err(error) => Err(self.blame(error)),
        }
    }

    fn u32(&mut self) -> Result<u32, Error> {
        self.array().map(u32::from_le_bytes)
    }

    fn i32(&mut self) -> Result<i32, Error> {
        self.array().map(i32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64, Error> {
        self.array().map(u64::from_le_bytes)
    }

    /// A text that ends with a zero, which is not part of it.
    fn text(&mut self, longest: u64) -> Result<Vec<u8>, Error> {
        let mut text = Vec::new();
        loop {
            match self.array()? {
                [0] => return Ok(text),
                [byte] => text.push(byte),
            }
            if text.len() as u64 > longest {
                return Err(self.invalid(quoted(&text), format!("a name of at most {longest} bytes")));
            }
        }
    }

    fn blame(&self, error: io::Error) -> Error {
        if error.kind() == ErrorKind::UnexpectedEof {
            self.invalid("the end of the file", "more of the OpenEXR image")
        } else {
            Error::io(self.path, "read")(error)
        }
    }
}

/// The channels that make the texture.
struct Layer {
    /// Indices among the channels of the part.
    channels: Vec<usize>,
}

impl Layer {
    /// The first suitable layer with the index of its part: first those without a name.
    fn choose(parts: &[Part], path: &Path) -> Result<(usize, Self), Error> {
        let flat = || parts.iter().enumerate().filter(|(_, part)| !part.is_deep);
        for (index, part) in flat() {
            if let Some(layer) = Self::find(part, b"") {
                return Ok((index, layer));
            }
        }
        for (index, part) in flat() {
            // Sorted, so that channels of one layer stand together.
            let mut prefixes: Vec<&[u8]> =
                part.channels.iter().filter_map(|channel| prefix(&channel.name)).collect();
            prefixes.dedup();
            if let Some(layer) = prefixes.into_iter().find_map(|prefix| Self::find(part, prefix)) {
                return Ok((index, layer));
            }
        }
        let expected = "channels R, G and B, or Y alone, of a flat image, with or without A";
        if flat().next().is_none() {
            return Err(Error::unsupported(path, "deep data", expected));
        }
        let names: Vec<u8> = flat()
            .flat_map(|(_, part)| &part.channels)
            .flat_map(|channel| [&channel.name[..], b" "].concat())
            .collect();
        Err(Error::unsupported(
            path,
            format!("an image of the channels {}", quoted(names.trim_ascii())),
            expected,
        ))
    }

    fn find(part: &Part, prefix: &[u8]) -> Option<Self> {
        let find = |name: &[u8]| {
            let name = [prefix, name].concat();
            part.channels.binary_search_by(|channel| channel.name.cmp(&name)).ok()
        };
        let mut channels = match (find(b"R"), find(b"G"), find(b"B")) {
            (Some(red), Some(green), Some(blue)) => vec![red, green, blue],
            _ => vec![find(b"Y")?],
        };
        channels.extend(find(b"A"));
        Some(Self { channels })
    }

    fn is_half(&self, part: &Part) -> bool {
        self.channels.iter().all(|&channel| part.channels[channel].kind == SampleType::F16)
    }

    fn into_image(self, layout: &Layout<'_>, texels: Texels) -> Image {
        Image { size: layout.size.map(|side| side as u32), channels: self.channels.len(), texels }
    }
}

/// The name of a channel's layer, with its point.
fn prefix(name: &[u8]) -> Option<&[u8]> {
    name.iter().rposition(|&byte| byte == b'.').map(|point| &name[..=point])
}

/// The most channels of a part: each costs time in each block, however small the block is.
const MAX_CHANNELS: usize = 1024;

/// The blocks of a part, all checked.
struct Layout<'a> {
    part: &'a Part,
    size: [usize; 2],
    pixels: usize,
    compression: Compression,
    channels: Vec<ChannelDescription>,
    /// Bytes of a pixel.
    pixel_bytes: usize,
    /// Pixels of a block, but for those at the right and lower edge, which may be smaller.
    block: [usize; 2],
    /// Blocks of the largest level, per axis.
    blocks: [usize; 2],
}

impl<'a> Layout<'a> {
    fn new(part: &'a Part, file_size: u64, path: &Path) -> Result<Self, Error> {
        let [width, height] = part.size;
        let pixels = check_size(path, width, height)?;
        let count = part.channels.len();
        if count > MAX_CHANNELS {
            return Err(Error::limit(
                path,
                format!("an image of {count} channels"),
                MAX_CHANNELS.to_string(),
            ));
        }
        let compression = part.compression.map_err(|number| {
            let found = format!("OpenEXR compression {number}");
            Error::unsupported(path, found, "none, RLE, ZIP, ZIPS, PIZ, PXR24, B44, B44A, DWAA or DWAB")
        })?;
        if let Some(channel) = part.channels.iter().find(|channel| channel.sampling != [1, 1]) {
            let [x, y] = channel.sampling;
            let found = format!("channel {} of one value per {x} x {y} pixels", quoted(&channel.name));
            return Err(Error::unsupported(path, found, "channels of full resolution, such as R, G and B"));
        }
        let channels: Vec<ChannelDescription> = part
            .channels
            .iter()
            .map(|channel| ChannelDescription {
                name: Text::from_slice_unchecked(&channel.name),
                sample_type: channel.kind,
                quantize_linearly: channel.is_linear,
                sampling: Vec2(1, 1),
            })
            .collect();
        let pixel_bytes: usize = channels.iter().map(|channel| channel.sample_type.bytes_per_sample()).sum();

        let claimed = pixels as u64 * pixel_bytes as u64;
        let most = file_size.saturating_mul(most_bytes_of_one(compression));
        if claimed > most.min(FREE_BYTES.max(file_size.saturating_mul(MOST_RATIO))) {
            return Err(Error::invalid(
                path,
                Place::Field("dataWindow"),
                format!(
                    "{width} x {height} pixels of {} channels in a file of {file_size} bytes",
                    channels.len()
                ),
                "no more than the file can hold",
            ));
        }
        let size = [width as usize, height as usize];
        let block = match part.tiles {
            Some(tiles) => [0, 1].map(|axis| size[axis].min(tiles.size[axis] as usize)),
            None => [size[0], size[1].min(compression.scan_lines_per_block())],
        };
        let block_bytes = (block[0] * block[1]) as u64 * pixel_bytes as u64;
        if block_bytes > MAX_BLOCK_BYTES {
            let what = format!("a block of {} x {} pixels, {block_bytes} bytes", block[0], block[1]);
            return Err(Error::limit(path, what, format!("{MAX_BLOCK_BYTES} bytes")));
        }
        let blocks = [0, 1].map(|axis| size[axis].div_ceil(block[axis]));
        Ok(Self { part, size, pixels, compression, channels, pixel_bytes, block, blocks })
    }

    /// The number of the block of the largest level whose place is next in the file; none for another level.
    fn place<R: Read>(&self, bytes: &mut Bytes<'_, R>) -> Result<Option<[usize; 2]>, Error> {
        let (place, is_wanted) = match self.part.tiles {
            Some(_) => {
                let place = [bytes.i32()?, bytes.i32()?].map(i64::from);
                (place, [bytes.i32()?, bytes.i32()?] == [0, 0])
            }
            None => {
                let row = i64::from(bytes.i32()?) - i64::from(self.part.corner[1]);
                let lines = self.compression.scan_lines_per_block() as i64;
                if row.rem_euclid(lines) != 0 {
                    return Err(
                        bytes.invalid(format!("a block at row {row}"), format!("a multiple of {lines}"))
                    );
                }
                ([0, row.div_euclid(lines)], true)
            }
        };
        if !is_wanted {
            return Ok(None);
        }
        let in_range = |axis: usize| usize::try_from(place[axis]).ok().filter(|&at| at < self.blocks[axis]);
        match (in_range(0), in_range(1)) {
            (Some(x), Some(y)) => Ok(Some([x, y])),
            _ => {
                let found = format!("block {}, {}", place[0], place[1]);
                Err(bytes.invalid(found, format!("below {}, {}", self.blocks[0], self.blocks[1])))
            }
        }
    }
}

/// Unpacked bytes beyond [`FREE_BYTES`] that are accepted for each byte of a file. DWA can make far more of one, but only of
/// pictures of one colour, and none of such a size have been seen.
const MOST_RATIO: u64 = 1400;

/// An image of so many bytes, all channels together, may be as small a file as its compression can make it.
const FREE_BYTES: u64 = 1 << 28;

/// How many bytes a packed byte can become, at most. Deflate: 258 for two bits. Its product with 4/3 for PXR24's 24-bit
/// floats, and PIZ's run lengths (255 16-bit values for 9 bits), stay below 1400; DWA deflates run lengths, or one
/// word for a square of 64 values.
fn most_bytes_of_one(compression: Compression) -> u64 {
    match compression {
        Compression::Uncompressed => 1,
        Compression::RLE => 64,
        Compression::B44 | Compression::B44A => 64,
        Compression::DWAA(_) | Compression::DWAB(_) => 1 << 17,
        _ => MOST_RATIO,
    }
}

/// An unpacked block.
struct Block<'a> {
    layout: &'a Layout<'a>,
    /// Its upper left pixel and its size, in pixels of the image.
    start: [usize; 2],
    size: [usize; 2],
    /// Line by line, and there channel by channel, in the machine's byte order.
    data: Vec<u8>,
}

impl Block<'_> {
    /// Copies the channels of the layer into the image.
    fn copy<T>(&self, layer: &Layer, values: &mut [T], convert: impl Fn(&[u8], SampleType) -> T) {
        let width = self.size[0];
        let count = layer.channels.len();
        let mut offset = 0;
        let layout: Vec<(SampleType, usize)> = self
            .layout
            .channels
            .iter()
            .map(|channel| {
                let start = offset;
                offset += width * channel.sample_type.bytes_per_sample();
                (channel.sample_type, start)
            })
            .collect();
        for (row, line) in self.data.chunks_exact(width * self.layout.pixel_bytes).enumerate() {
            let start = ((self.start[1] + row) * self.layout.size[0] + self.start[0]) * count;
            let values = &mut values[start..start + width * count];
            for (component, &channel) in layer.channels.iter().enumerate() {
                let (kind, start) = layout[channel];
                let bytes = kind.bytes_per_sample();
                let samples = line[start..start + width * bytes].chunks_exact(bytes);
                for (sample, value) in samples.zip(values[component..].iter_mut().step_by(count)) {
                    *value = convert(sample, kind);
                }
            }
        }
    }
}

fn to_f32(data: &[u8], kind: SampleType) -> f32 {
    match kind {
        SampleType::F16 => f16::from_ne_bytes([data[0], data[1]]).to_f32(),
        SampleType::F32 => f32::from_ne_bytes([data[0], data[1], data[2], data[3]]),
        SampleType::U32 => u32::from_ne_bytes([data[0], data[1], data[2], data[3]]) as f32,
    }
}

/// Reads and unpacks the blocks of the largest level of a part.
fn read_blocks<R: Read>(
    bytes: &mut Bytes<'_, R>,
    header: &Header,
    wanted: usize,
    layout: &Layout<'_>,
    mut each: impl FnMut(&Block<'_>),
) -> Result<(), Error> {
    let mut missing = layout.blocks[0] * layout.blocks[1];
    let mut is_read = vec![false; missing];
    while missing > 0 {
        let part = if header.is_multi_part { bytes.u32()? as usize } else { 0 };
        if part != wanted {
            let Some(part) = header.parts.get(part) else {
                let found = format!("a block of part {part}");
                return Err(bytes.invalid(found, format!("a part below {}", header.parts.len())));
            };
            skip_block(bytes, part)?;
            continue;
        }
        let place = layout.place(bytes)?;
        let packed_size = u64::from(bytes.u32()?);
        let Some(place) = place else {
            bytes.skip(packed_size)?;
            continue;
        };
        let is_read = &mut is_read[place[1] * layout.blocks[0] + place[0]];
        if *is_read {
            return Err(bytes.invalid(format!("block {}, {} again", place[0], place[1]), "another"));
        }
        *is_read = true;
        missing -= 1;

        let start = [0, 1].map(|axis| place[axis] * layout.block[axis]);
        let size = [0, 1].map(|axis| layout.block[axis].min(layout.size[axis] - start[axis]));
        let expected = (size[0] * size[1] * layout.pixel_bytes) as u64;
        if packed_size > 2 * expected + (1 << 16) {
            let found = format!("{packed_size} bytes for a block of {expected}");
            return Err(bytes.invalid(found, "hardly more than unpacked"));
        }
        let place = Place::Byte(bytes.offset);
        let packed = bytes.take(packed_size)?;
        let data = unpack(layout, size, packed).map_err(|found| {
            Error::invalid(bytes.path, place, format!("a damaged block ({found})"), "an intact one")
        })?;
        each(&Block { layout, start, size, data });
    }
    Ok(())
}

/// Skips a block, from behind the number of its part on.
fn skip_block<R: Read>(bytes: &mut Bytes<'_, R>, part: &Part) -> Result<(), Error> {
    bytes.skip(if part.tiles.is_some() { 16 } else { 4 })?;
    let size = if part.is_deep {
        let sizes = [bytes.u64()?, bytes.u64()?];
        let _unpacked = bytes.u64()?;
        sizes[0].saturating_add(sizes[1])
    } else {
        bytes.u32()?.into()
    };
    bytes.skip(size)
}

/// Holds the sizes at the start of a DWA block against those of the block: the decoder allocates them unseen.
fn check_dwa(channels: usize, size: [usize; 2], packed: &[u8]) -> Result<(), String> {
    // Eleven counters; those from 3 to 5, and 2, are of packed data and held against that by the decoder.
    const UNPACKED: [usize; 5] = [1, 6, 7, 8, 9];
    let squares = size[0].div_ceil(8) * size[1].div_ceil(8);
    // 64 values a square, of at most 4 bytes, and as much again, since run lengths may be longer than what they pack.
    let most = (channels * squares * 64 * 8) as u64;
    for counter in UNPACKED {
        let value = packed.get(8 * counter..).and_then(|bytes| bytes.first_chunk());
        let value = u64::from_le_bytes(*value.ok_or("too short")?);
        if value > most {
            return Err(format!("{value} values or bytes in counter {counter}, at most {most} expected"));
        }
    }
    Ok(())
}

/// Unpacks a block of `size` pixels.
fn unpack(layout: &Layout<'_>, size: [usize; 2], packed: Vec<u8>) -> Result<Vec<u8>, String> {
    let expected = size[0] * size[1] * layout.pixel_bytes;
    if matches!(layout.compression, Compression::DWAA(_) | Compression::DWAB(_)) && packed.len() != expected {
        check_dwa(layout.channels.len(), size, &packed)?;
    }
    let size = Vec2(size[0], size[1]);
    let blocks = BlockDescription::Tiles(TileDescription {
        tile_size: size,
        level_mode: LevelMode::Singular,
        rounding_mode: RoundingMode::Down,
    });
    let channels = layout.channels.iter().cloned().collect();
    let header = exr::meta::header::Header::new(Text::default(), size, channels).with_encoding(
        layout.compression,
        blocks,
        LineOrder::Increasing,
    );
    let bounds = IntegerBounds::from_dimensions(size);
    // Damaged B44 blocks overflow in the crate's decoder, which panics where overflows are checked. No other panic is known,
    // but the decoders of PIZ and DWA index by what they read. No state outlives them that could be left broken.
    let unpacked = panic::catch_unwind(AssertUnwindSafe(|| {
        layout.compression.decompress_image_section_from_le(&header, packed, bounds, false)
    }));
    let data = match unpacked {
        Ok(data) => data.map_err(|error| error.to_string())?,
        Err(_) => return Err("its decoder gave up".to_owned()),
    };
    if data.len() == expected { Ok(data) } else { Err(format!("{} bytes for {expected}", data.len())) }
}
