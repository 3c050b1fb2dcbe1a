//! The headers of an OpenEXR file, as far as a texture needs them.
//!
//! They are read here and not by the crate `exr`, which believes the sizes that a header claims.

use super::Bytes;
use crate::Error;
use crate::error::quoted;
use exr::compression::Compression;
use exr::meta::attribute::SampleType;
use std::io::Read;

/// The longest name that the format allows.
const LONGEST_NAME: u64 = 255;

/// The longest attribute that is kept, in bytes; longer ones of no concern are skipped.
const LONGEST_ATTRIBUTE: u64 = 1 << 20;

/// One image of a file: the format's "part".
#[derive(Debug, Clone)]
pub(super) struct Part {
    /// In the order in which the pixels are stored: by name.
    pub channels: Vec<Channel>,
    /// None where a newer version of the format knows more of them: its number.
    pub compression: Result<Compression, u8>,
    /// First column and row of the data window.
    pub corner: [i32; 2],
    pub size: [u64; 2],
    pub tiles: Option<Tiles>,
    pub is_deep: bool,
    /// Number of blocks, over all levels.
    pub chunks: u64,
    /// The attributes that say nothing of where the pixels are.
    pub attributes: Vec<Attribute>,
}

/// An attribute, as it stands in the file.
#[derive(Debug, Clone)]
pub(super) struct Attribute {
    pub name: Vec<u8>,
    /// Its type.
    pub kind: Vec<u8>,
    pub value: Vec<u8>,
}

#[derive(Debug, Clone)]
pub(super) struct Channel {
    pub name: Vec<u8>,
    pub kind: SampleType,
    pub is_linear: bool,
    pub sampling: [i32; 2],
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Tiles {
    pub size: [u32; 2],
    levels: Levels,
    round_up: bool,
}

#[derive(Debug, Clone, Copy)]
enum Levels {
    One,
    Mip,
    Rip,
}

/// The headers.
pub(super) struct Header {
    pub parts: Vec<Part>,
    /// Whether each block starts with the number of its part.
    pub is_multi_part: bool,
}

impl Header {
    /// Reads all up to the tables of offsets.
    pub fn read<R: Read>(bytes: &mut Bytes<'_, R>) -> Result<Self, Error> {
        const TILED: u32 = 0x200;
        const LONG_NAMES: u32 = 0x400;
        const DEEP: u32 = 0x800;
        const MULTI_PART: u32 = 0x1000;
        let _magic = bytes.u32()?;
        let version = bytes.u32()?;
        let flags = version & !0xff;
        if !(1..=2).contains(&(version & 0xff)) || flags & !(TILED | LONG_NAMES | DEEP | MULTI_PART) != 0 {
            let found = format!("OpenEXR version {}, flags {flags:#x}", version & 0xff);
            return Err(Error::unsupported(bytes.path, found, "version 1 or 2 and flags within 0x1e00"));
        }
        let is_multi_part = flags & MULTI_PART != 0;
        let mut parts = Vec::new();
        while let Some(part) = read_part(bytes, flags & TILED != 0, flags & DEEP != 0)? {
            parts.push(part);
            if !is_multi_part {
                break;
            }
        }
        if parts.is_empty() {
            return Err(bytes.invalid("no image", "one or more"));
        }
        Ok(Self { parts, is_multi_part })
    }
}

/// Reads one header; none where the list of headers ends.
fn read_part<R: Read>(
    bytes: &mut Bytes<'_, R>,
    flag_tiled: bool,
    flag_deep: bool,
) -> Result<Option<Part>, Error> {
    let (mut channels, mut compression, mut window, mut tile_attribute) = (None, None, None, None);
    let (mut kind, mut chunk_count) = (None, None);
    let mut attributes = Vec::new();
    let mut is_empty = true;
    loop {
        let name = bytes.text(LONGEST_NAME)?;
        if name.is_empty() {
            break;
        }
        is_empty = false;
        let kind_name = bytes.text(LONGEST_NAME)?;
        let size = bytes.u32()?;
        let known: [(&[u8], &[u8]); 6] = [
            (b"channels", b"chlist"),
            (b"compression", b"compression"),
            (b"dataWindow", b"box2i"),
            (b"tiles", b"tiledesc"),
            (b"type", b"string"),
            (b"chunkCount", b"int"),
        ];
        let size = u64::from(size);
        let Some(index) = known.iter().position(|&known| known == (&name[..], &kind_name[..])) else {
            if size > LONGEST_ATTRIBUTE {
                bytes.skip(size)?;
            } else {
                attributes.push(Attribute { name, kind: kind_name, value: bytes.take(size)? });
            }
            continue;
        };
        if size > LONGEST_ATTRIBUTE {
            let found = format!("{size} bytes of attribute {}", quoted(&name));
            return Err(bytes.invalid(found, format!("at most {LONGEST_ATTRIBUTE}")));
        }
        let value = bytes.take(size)?;
        let ints = |count: usize| -> Result<Vec<i32>, Error> {
            let ints = value.chunks_exact(4).map(|c| i32::from_le_bytes([c[0], c[1], c[2], c[3]]));
            let ints: Vec<i32> = ints.take(count).collect();
            if ints.len() == count { Ok(ints) } else { Err(short(bytes, &name)) }
        };
        match index {
            0 => channels = Some(parse_channels(&value).ok_or_else(|| short(bytes, &name))?),
            1 => compression = Some(*value.first().ok_or_else(|| short(bytes, &name))?),
            2 => window = Some(ints(4)?),
            3 => {
                let size = ints(2)?;
                let mode = *value.get(8).ok_or_else(|| short(bytes, &name))?;
                tile_attribute = Some((size, mode));
            }
            4 => kind = Some(value),
            _ => chunk_count = Some(ints(1)?[0]),
        }
    }
    if is_empty {
        return Ok(None);
    }

    let missing = |name: &str, bytes: &Bytes<'_, R>| {
        bytes.invalid(format!("no attribute {name}"), "the attributes channels, compression and dataWindow")
    };
    let channels = channels.ok_or_else(|| missing("channels", bytes))?;
    let compression = compression.ok_or_else(|| missing("compression", bytes))?;
    let window = window.ok_or_else(|| missing("dataWindow", bytes))?;
    let side = |low: i32, high: i32| {
        u64::try_from(i64::from(high) - i64::from(low) + 1).ok().filter(|&side| side > 0)
    };
    let (Some(width), Some(height)) = (side(window[0], window[2]), side(window[1], window[3])) else {
        return Err(bytes.invalid(format!("data window {window:?}"), "one pixel or more"));
    };
    let size = [width, height];
    let (is_tiled, is_deep, is_known) = match kind.as_deref() {
        Some(b"scanlineimage") => (false, false, true),
        Some(b"tiledimage") => (true, false, true),
        Some(b"deepscanline") => (false, true, true),
        Some(b"deeptile") => (true, true, true),
        Some(_) => (false, true, false),
        None => (flag_tiled, flag_deep, true),
    };
    let tiles = if is_tiled {
        let (sides, mode) = tile_attribute.ok_or_else(|| missing("tiles", bytes))?;
        let levels = match mode & 0xf {
            0 => Some(Levels::One),
            1 => Some(Levels::Mip),
            2 => Some(Levels::Rip),
            _ => None,
        };
        match (u32::try_from(sides[0]), u32::try_from(sides[1]), levels) {
            (Ok(width @ 1..), Ok(height @ 1..), Some(levels)) => {
                Some(Tiles { size: [width, height], levels, round_up: mode >> 4 == 1 })
            }
            _ => {
                let found = format!("tiles of {} x {}, mode {mode:#x}", sides[0], sides[1]);
                return Err(bytes.invalid(found, "tiles of one pixel or more, modes 0 to 2"));
            }
        }
    } else {
        None
    };
    let compression = compression_of(compression);
    let chunks = match (is_known, chunk_count) {
        (true, _) => {
            let lines = compression.map_or(1, Compression::scan_lines_per_block) as u64;
            tiles.map_or(u128::from(height.div_ceil(lines)), |tiles| tiles.count(size))
        }
        (false, count) => count.map_or(0, |count| count.max(0) as u128),
    };
    // Each has 8 bytes in the table of offsets and at least 8 of its own.
    let most = u128::from(bytes.left / 16);
    if chunks > most {
        let found = format!("{chunks} blocks of {width} x {height} pixels");
        return Err(bytes.invalid(found, format!("at most {most} in what is left of the file")));
    }
    let (corner, chunks) = ([window[0], window[1]], chunks as u64);
    Ok(Some(Part { channels, compression, corner, size, tiles, is_deep, chunks, attributes }))
}

fn short<R>(bytes: &Bytes<'_, R>, attribute: &[u8]) -> Error {
    bytes.invalid(format!("a malformed attribute {}", quoted(attribute)), "one as its type has it")
}

/// The compression of a number; an error with that number where there is none.
fn compression_of(number: u8) -> Result<Compression, u8> {
    Ok(match number {
        0 => Compression::Uncompressed,
        1 => Compression::RLE,
        2 => Compression::ZIP1,
        3 => Compression::ZIP16,
        4 => Compression::PIZ,
        5 => Compression::PXR24,
        6 => Compression::B44,
        7 => Compression::B44A,
        8 => Compression::DWAA(None),
        9 => Compression::DWAB(None),
        _ => return Err(number),
    })
}

/// The list of channels, sorted; none if it is malformed, empty, or names one twice.
fn parse_channels(mut value: &[u8]) -> Option<Vec<Channel>> {
    let mut channels = Vec::new();
    loop {
        let end = value.iter().position(|&byte| byte == 0)?;
        if end == 0 {
            break;
        }
        let (name, rest) = (&value[..end], &value[end + 1..]);
        let (fields, rest) = rest.split_first_chunk::<16>()?;
        let int =
            |at: usize| i32::from_le_bytes([fields[at], fields[at + 1], fields[at + 2], fields[at + 3]]);
        let kind = match int(0) {
            0 => SampleType::U32,
            1 => SampleType::F16,
            2 => SampleType::F32,
            _ => return None,
        };
        let is_linear = fields[4] != 0;
        channels.push(Channel { name: name.to_vec(), kind, is_linear, sampling: [int(8), int(12)] });
        value = rest;
    }
    channels.sort_by(|a, b| a.name.cmp(&b.name));
    let is_unique = channels.windows(2).all(|pair| pair[0].name != pair[1].name);
    (is_unique && !channels.is_empty()).then_some(channels)
}

impl Tiles {
    /// The number of tiles over all levels of an image.
    fn count(&self, size: [u64; 2]) -> u128 {
        let level_count = |side: u64| {
            let floor = u64::from(side.ilog2());
            1 + floor + u64::from(self.round_up && !side.is_power_of_two())
        };
        let tiles = |axis: usize, level: u64| {
            let side = if self.round_up { size[axis].div_ceil(1 << level) } else { size[axis] >> level };
            u128::from(side.max(1).div_ceil(self.size[axis].into()))
        };
        match self.levels {
            Levels::One => tiles(0, 0) * tiles(1, 0),
            Levels::Mip => {
                (0..level_count(size[0].max(size[1]))).map(|level| tiles(0, level) * tiles(1, level)).sum()
            }
            Levels::Rip => {
                let sum =
                    |axis: usize| (0..level_count(size[axis])).map(|level| tiles(axis, level)).sum::<u128>();
                sum(0) * sum(1)
            }
        }
    }
}
