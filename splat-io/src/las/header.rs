//! The header of a LAS file.

use super::bytes_at;
use crate::error::quoted;
use crate::{Error, Place};
use std::ops::Range;
use std::path::Path;

/// Size of the header of LAS 1.0 to 1.2, in bytes; later ones are longer.
const HEADER_BYTES: usize = 227;

/// Size of the header of LAS 1.4, in bytes.
const HEADER_BYTES_1_4: usize = 375;

/// Size of what stands before the data of a variable length record, in bytes.
const RECORD_HEADER_BYTES: usize = 54;

/// The bit of the point format that says that points are compressed.
const COMPRESSED: u8 = 0x80;

/// Least size of a point of each format, in bytes.
const POINT_BYTES: [usize; 11] = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];

/// Greatest number of points.
const MOST_POINTS: u64 = u32::MAX as u64 - 1;

/// What a header says, checked.
#[derive(Debug, Clone)]
pub(super) struct Header {
    /// The minor version; the major one is 1.
    pub minor: u8,
    /// The point format, 0 to 10.
    pub format: u8,
    pub is_compressed: bool,
    /// Number of points that the header claims, below 2^32 - 1.
    pub count: u64,
    /// Size of a point, in bytes: at least what its format needs.
    pub record_bytes: usize,
    /// Where the points begin: within the file.
    pub data: usize,
    /// How whole numbers become coordinates.
    pub axes: [Axis; 3],
    /// Where the variable length records are.
    records: Range<usize>,
    /// Whether the points are in the order of an octree.
    is_copc: bool,
}

/// Checks the first four bytes of a file.
pub(super) fn check_magic(bytes: &[u8], path: &Path) -> Result<(), Error> {
    if bytes.starts_with(b"LASF") {
        return Ok(());
    }
    let start = quoted(&bytes[..bytes.len().min(4)]);
    let found = if bytes.is_empty() { "an empty file".to_owned() } else { start };
    Err(Error::invalid(path, Place::Byte(0), found, "LASF"))
}

impl Header {
    /// Reads and checks the header.
    pub fn read(bytes: &[u8], path: &Path) -> Result<Self, Error> {
        let invalid = |at: usize, found: String, expected: &str| {
            Err(Error::invalid(path, Place::Byte(at as u64), found, expected))
        };
        check_magic(bytes, path)?;
        let (Some([major, minor]), true) = (bytes_at(bytes, 24), bytes.len() >= HEADER_BYTES) else {
            return invalid(bytes.len(), "the end of the file".to_owned(), "a header of at least 227 bytes");
        };
        if major != 1 || minor > 4 {
            return Err(Error::unsupported(path, format!("LAS {major}.{minor}"), "LAS 1.0 to 1.4"));
        }
        if minor == 4 && bytes.len() < HEADER_BYTES_1_4 {
            return invalid(bytes.len(), "the end of the file".to_owned(), "a header of 375 bytes");
        }
        let number = |at: usize| u32::from_le_bytes(bytes_at(bytes, at).unwrap_or_default());
        let short = |at: usize| u16::from_le_bytes(bytes_at(bytes, at).unwrap_or_default());
        let float = |at: usize| f64::from_le_bytes(bytes_at(bytes, at).unwrap_or_default());

        let (header_bytes, data) = (usize::from(short(94)), number(96) as usize);
        if header_bytes < HEADER_BYTES {
            return invalid(94, format!("a header of {header_bytes} bytes"), "at least 227 bytes");
        }
        if data < header_bytes || data > bytes.len() {
            let expected = format!("points from byte {header_bytes} to {}", bytes.len());
            return invalid(96, format!("points from byte {data}"), &expected);
        }
        let format = bytes[104] & 0x3f;
        let Some(&least) = POINT_BYTES.get(usize::from(format)) else {
            return Err(Error::unsupported(path, format!("point format {format}"), "a format from 0 to 10"));
        };
        let record_bytes = usize::from(short(105));
        if record_bytes < least {
            let expected = format!("at least {least}, as point format {format} needs");
            return invalid(105, format!("points of {record_bytes} bytes"), &expected);
        }
        let mut axes = [Axis::default(); 3];
        for (i, axis) in axes.iter_mut().enumerate() {
            let (scale, offset) = (float(131 + 8 * i), float(155 + 8 * i));
            if !scale.is_finite() || scale == 0.0 || !offset.is_finite() {
                let found = format!("a scale of {scale} and an offset of {offset}");
                return invalid(131 + 8 * i, found, "finite numbers, and a scale other than 0");
            }
            *axis = Axis::new(scale, offset);
        }
        let long = (minor == 4).then(|| u64::from_le_bytes(bytes_at(bytes, 247).unwrap_or_default()));
        let count = long.filter(|&count| count > 0).unwrap_or(u64::from(number(107)));
        if count > MOST_POINTS {
            let what = format!("a cloud of {count} points");
            return Err(Error::limit(path, what, format!("{MOST_POINTS} points")));
        }
        let mut header = Self {
            minor,
            format,
            is_compressed: bytes[104] & !0x3f & COMPRESSED != 0,
            count,
            record_bytes,
            data,
            axes,
            records: header_bytes..data,
            is_copc: false,
        };
        header.is_copc = header.record(bytes, b"copc", 1).is_some();
        Ok(header)
    }

    /// The data of a variable length record, found by its user and number. Records that do not fit are passed over, as
    /// their number is that of the file, not the one that the header claims.
    pub fn record<'a>(&self, bytes: &'a [u8], user: &[u8], id: u16) -> Option<&'a [u8]> {
        let mut rest = &bytes[self.records.clone()];
        loop {
            let head = rest.get(..RECORD_HEADER_BYTES)?;
            let length = usize::from(u16::from_le_bytes(bytes_at(head, 20)?));
            let data = rest.get(RECORD_HEADER_BYTES..RECORD_HEADER_BYTES + length)?;
            if head[2..18].starts_with(user) && u16::from_le_bytes(bytes_at(head, 18)?) == id {
                return Some(data);
            }
            rest = &rest[RECORD_HEADER_BYTES + length..];
        }
    }

    /// Number of bytes of each point behind those of its format.
    pub fn extra_bytes(&self) -> usize {
        self.record_bytes - POINT_BYTES[usize::from(self.format)]
    }

    /// Whether points have the layout of LAS 1.4.
    pub fn is_extended(&self) -> bool {
        self.format >= 6
    }

    /// The format in words.
    pub fn describe(&self) -> String {
        let name = if self.is_compressed { "LAZ" } else { "LAS" };
        let octree = if self.is_copc { ", an octree (COPC)" } else { "" };
        format!("{name} 1.{}, point format {}{octree}", self.minor, self.format)
    }
}

/// How the whole numbers of an axis become coordinates.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Axis {
    scale: f64,
    offset: f64,
    /// Where the scale is 10^-k and the offset a multiple of it: that multiple, and 10^k.
    decimal: Option<(i64, f64)>,
}

impl Axis {
    pub fn new(scale: f64, offset: f64) -> Self {
        let decimal = (0..=12).map(|k| 10_f64.powi(k)).find(|power| scale == 1.0 / power).and_then(|power| {
            let multiple = offset * power;
            let whole = multiple.round();
            // Half a unit in the last place of the offset, and another of the product.
            let is_whole = (multiple - whole).abs() <= multiple.abs() * f64::EPSILON;
            (is_whole && whole.abs() < (1_u64 << 52) as f64).then_some((whole as i64, power))
        });
        Self { scale, offset, decimal }
    }

    /// A coordinate, in the units of the file.
    #[inline]
    pub fn world(&self, number: i32) -> f64 {
        match self.decimal {
            // Both are exact, so the quotient is the nearest f64.
            Some((offset, power)) => (offset + i64::from(number)) as f64 / power,
            None => f64::from(number) * self.scale + self.offset,
        }
    }
}
