//! LAS files, the usual carrier of LiDAR scans, and their compressed form LAZ (COPC files are LAZ, too).
//!
//! Read are LAS 1.0 to 1.4 with all point formats, 0 to 10. Coordinates are exact: the whole number in the file times
//! the scale plus the offset, in `f64`. Where scale and offset are decimal fractions (as they are in nearly every file)
//! it is the `f64` nearest to the decimal coordinate, so that the same survey in two files with different offsets is the
//! same cloud, bit for bit.
//!
//! | of a point | becomes |
//! |---|---|
//! | X, Y, Z | position |
//! | red, green, blue | colour: sRGB, 8-bit if no value of the file is above 255, else 16-bit; absent if all are 0 |
//! | intensity, classification, return number, number of returns, scan angle, user data, point source, near infrared | scalar fields; one that is 0 everywhere is left out, and so are returns that are all 1 |
//! | synthetic, key-point, withheld, overlap | counted in the report; the points are kept |
//! | GPS time, wave packets, extra bytes | not read |
//!
//! Uncompressed points are decoded here. Compressed ones go through the crate `laz`, chunk by chunk, after every
//! size that the file claims was held against its own.

mod gps_time;
mod header;
mod laz_points;
mod points;
#[cfg(test)]
mod tests;
mod writer;

pub use writer::write_las;

use crate::whole_file::{bytes_at, read_whole, sha256};
use crate::{ElementReport, Error, Import, ImportReport, PropertyReport, Usage};
use header::Header;
use points::Points;
use std::path::Path;

/// The names of the scalar fields that LAS files can be written with.
pub(crate) const FIELD_NAMES: [&str; 7] = [
    "intensity",
    "return_number",
    "number_of_returns",
    "classification",
    "scan_angle",
    "user_data",
    "point_source_id",
];

/// Reads a cloud from a LAS or LAZ file. See the [module](self) for what is understood.
///
/// # Errors
/// [`Error::Io`]; [`Error::Unsupported`] for versions, point formats and compressions that are not known;
/// [`Error::Invalid`] for anything malformed or truncated, or claiming more points than the file can hold;
/// [`Error::Limit`] for 2^32 - 1 points or more, or more than memory.
pub fn read_las(path: &Path) -> Result<Import, Error> {
    read_las_from(&read_whole(path, header::check_magic)?, path)
}

/// Reads a cloud from the bytes of a LAS or LAZ file; `path` is its name in messages.
///
/// # Errors
/// As [`read_las`].
pub fn read_las_from(bytes: &[u8], path: &Path) -> Result<Import, Error> {
    let header = Header::read(bytes, path)?;
    let mut points = Points::new(&header);
    if header.is_compressed {
        laz_points::read(bytes, &header, &mut points, path)?;
    } else {
        read_plain(bytes, &header, &mut points, path)?;
    }
    let count = points.len() as u64;
    let (cloud, assumptions, properties) = points.finish(&header);
    let report = ImportReport {
        path: path.to_owned(),
        format: header.describe(),
        bytes: bytes.len() as u64,
        sha256: sha256(bytes),
        elements: vec![ElementReport { name: "points".to_owned(), count, is_points: true, properties }],
        assumptions,
        losses: Vec::new(),
    };
    Ok(Import { cloud, report })
}

/// Reads points that are not compressed.
fn read_plain(bytes: &[u8], header: &Header, points: &mut Points, path: &Path) -> Result<(), Error> {
    let data = &bytes[header.data..];
    let room = (data.len() / header.record_bytes) as u64;
    if header.count > room {
        let found = format!("a header that claims {} points of {} bytes", header.count, header.record_bytes);
        let expected = format!("at most {room}: the file of {} bytes has no more", bytes.len());
        return Err(Error::invalid(path, crate::Place::File, found, expected));
    }
    points.reserve(header.count, path)?;
    // Fits: the file has as many.
    let records = data.chunks_exact(header.record_bytes).take(header.count as usize);
    records.for_each(|record| points.push(record));
    Ok(())
}

/// What is said of a column.
fn property(name: &str, kind: &str, usage: Usage) -> PropertyReport {
    PropertyReport { name: name.to_owned(), kind: kind.to_owned(), usage }
}
