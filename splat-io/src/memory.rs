//! How much memory reading a file takes, told from the first bytes and the size of it.
//!
//! These are bounds from above of what is taken at the peak, all copies on the way counted; the tests of `--max-memory` hold them
//! against what is measured. What a header claims beyond what its file can hold is left to the reader to refuse.

use crate::cloud_file::{CloudFormat, cloud_format};
use crate::ply::elements_of;
use crate::points3d::find_points3d;
use crate::{Error, ply};
use flate2::read::GzDecoder;
use std::io::{self, Read};
use std::path::Path;

/// A point at least: its place in `f64` and `f32`, a coordinate to find the origin by, the splat's size, and what formats add
/// whose columns are fixed: colours and opacities, or axes and a normal.
const POINT: u64 = 128;

/// And for each column: its numbers, and once more while they become something else.
const COLUMN: u64 = 8;

/// A LAS point: as others, but scalar fields in place of columns.
const LAS_POINT: u64 = 160;

/// A compressed one: arrays grow while it is decoded.
const LAZ_POINT: u64 = 256;

/// A point of an spz file: its data unpacked, and the splat with the harmonics.
const SPZ_POINT: u64 = 420;

/// A byte of an OBJ file: a vertex of 8 bytes becomes three doubles in an array that grows.
const OBJ_BYTE: u64 = 10;

/// A byte of COLMAP's points, of which each has 43 at least.
const POINTS3D_BYTE: u64 = 4;

/// Bytes of the start of a file that are looked at.
const HEAD: u64 = 64 << 10;

/// The most bytes of memory that reading a cloud takes.
///
/// # Errors
/// As [`cloud_format`], and what is wrong with a PLY header.
pub fn memory_of_cloud(path: &Path) -> Result<u64, Error> {
    let format = cloud_format(path)?;
    let path = &find_points3d(path).unwrap_or_else(|| path.to_owned());
    let (mut file, size) = ply::open(path)?;
    let mut head = Vec::new();
    let mut read_head = || file.by_ref().take(HEAD).read_to_end(&mut head).map_err(Error::io(path, "read"));
    let points = |count: u64, columns: u64| count.saturating_mul(POINT + COLUMN * columns);
    Ok(match format {
        CloudFormat::Ply => {
            let elements = elements_of(path)?;
            let of =
                |columns: usize, count: u64| points(count.min(size / columns.max(1) as u64), columns as u64);
            elements
                .iter()
                .map(|element| of(element.properties.len(), element.count))
                .fold(0, u64::saturating_add)
        }
        CloudFormat::Las => {
            read_head()?;
            size.saturating_add(las_points(&head, size))
        }
        CloudFormat::Pcd => {
            read_head()?;
            let text = String::from_utf8_lossy(&head);
            let words = |key: &str| text.lines().find_map(|line| line.strip_prefix(key)).unwrap_or_default();
            let count = words("POINTS ").trim().parse().unwrap_or(0);
            let columns = words("FIELDS ").split_whitespace().count() as u64;
            let is_compressed = words("DATA ").trim() == "binary_compressed";
            let count = if is_compressed { count } else { count.min(size / columns.max(1)) };
            // Of compressed ones the rows stand in memory, too.
            size.saturating_add(points(count, if is_compressed { 2 * columns } else { columns }))
        }
        CloudFormat::Spz => {
            read_head()?;
            let mut start = [0; 12];
            // A damaged one is refused by its reader.
            let read = if head.starts_with(b"NGSP") {
                (&head[..]).read_exact(&mut start)
            } else {
                GzDecoder::new(&head[..]).read_exact(&mut start)
            };
            let count = read.map_or(0, |()| u32_at(&start, 8));
            size.saturating_add(count.saturating_mul(SPZ_POINT))
        }
        CloudFormat::Splat => (size / 32).saturating_mul(POINT),
        CloudFormat::Points3d => size.saturating_mul(POINTS3D_BYTE),
        CloudFormat::Text => {
            let (rows, columns) = count_rows(file).map_err(Error::io(path, "read"))?;
            size.saturating_add(points(rows, columns))
        }
    })
}

/// The most bytes of memory that reading a mesh, and sampling it with so many surfels, takes.
///
/// # Errors
/// As [`memory_of_cloud`].
pub fn memory_of_mesh(path: &Path, surfels: usize) -> Result<u64, Error> {
    /// Four candidates a surfel, each with its place, its neighbours, and its turn in the queue.
    const SURFEL: u64 = 1600;
    let is_obj = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj"));
    let mesh = if is_obj { ply::open(path)?.1.saturating_mul(OBJ_BYTE) } else { memory_of_cloud(path)? };
    Ok(mesh.saturating_add(SURFEL.saturating_mul(surfels as u64)))
}

/// The most bytes of memory that an image takes as a texture, ready for lanes, where so many texels stand in one.
///
/// # Errors
/// [`Error::Io`].
pub fn memory_of_image(path: &Path) -> Result<u64, Error> {
    let (mut file, _) = ply::open(path)?;
    let mut head = Vec::new();
    file.by_ref().take(HEAD).read_to_end(&mut head).map_err(Error::io(path, "read"))?;
    let png = || {
        let [width, height] =
            [16, 20].map(|at| head.get(at..at + 4)?.first_chunk().copied().map(u32::from_be_bytes));
        let (depth, kind) = (head.get(24)?, head.get(25)?);
        // Grey, RGB, palette, grey and alpha, RGBA; a palette and any other kind may gain an alpha.
        let channels = match kind {
            0 => 2,
            4 => 2,
            _ => 4,
        };
        Some((u64::from(width?) * u64::from(height?), channels, if *depth == 16 { 8 } else { 4 }))
    };
    let exr = || {
        const WINDOW: &[u8] = b"dataWindow\0box2i\0\x10\0\0\0";
        let windows = head.windows(WINDOW.len() + 16).filter(|bytes| bytes.starts_with(WINDOW));
        let pixels = windows.map(|bytes| {
            let [x0, y0, x1, y1] = [0, 4, 8, 12].map(|at| {
                bytes[WINDOW.len() + at..]
                    .first_chunk()
                    .map_or(0, |four| i64::from(i32::from_le_bytes(*four)))
            });
            ((x1 - x0 + 1).max(0) as u64).saturating_mul((y1 - y0 + 1).max(0) as u64)
        });
        Some((pixels.max()?, 4, 12))
    };
    let known = if head.starts_with(b"\x89PNG") { png() } else { exr() };
    // As decoded; and by lanes, whose rows of a mirrored texture stand twice.
    let bytes = |(pixels, channels, decoded): (u64, u64, u64)| {
        pixels.saturating_mul(channels * (decoded + 2 * 16 / 3 + 1))
    };
    Ok(known.map_or(0, bytes))
}

/// The rows of a text, and the words of the longest of the first.
fn count_rows(mut file: impl Read) -> io::Result<(u64, u64)> {
    let is_space = |byte: &u8| matches!(byte, b' ' | b'\t' | b',' | b';' | b'\r');
    let words = |line: &[u8]| line.split(is_space).filter(|word| !word.is_empty()).count() as u64;
    let (mut rows, mut columns) = (1, None);
    let mut buffer = vec![0; HEAD as usize];
    loop {
        let read = match file.read(&mut buffer) {
            Ok(0) => return Ok((rows, columns.unwrap_or(0))),
            Ok(read) => &buffer[..read],
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(error) => return Err(error),
        };
        rows += read.iter().filter(|&&byte| byte == b'\n').count() as u64;
        columns = columns.or_else(|| read.split(|&byte| byte == b'\n').map(words).max());
    }
}

fn u32_at(bytes: &[u8], at: usize) -> u64 {
    bytes.get(at..).and_then(|rest| rest.first_chunk()).map_or(0, |four| u32::from_le_bytes(*four).into())
}

/// What the points of a LAS file take, by its header.
fn las_points(head: &[u8], size: u64) -> u64 {
    let Some(&[minor]) = head.get(25..26) else { return 0 };
    let record =
        u64::from(head.get(105).copied().unwrap_or(0)) | u64::from(head.get(106).copied().unwrap_or(0)) << 8;
    let long =
        || head.get(247..).and_then(|rest| rest.first_chunk()).map_or(0, |eight| u64::from_le_bytes(*eight));
    let count = u32_at(head, 107).max(if minor >= 4 { long() } else { 0 });
    if head.get(104).is_some_and(|format| format & 0x80 != 0) {
        count.saturating_mul(LAZ_POINT)
    } else {
        count.min(size / record.max(1)).saturating_mul(LAS_POINT)
    }
}
