//! The header of a PCD file.

use crate::error::quoted;
use crate::table::Scalar;
use crate::{Error, Place};
use std::path::Path;

/// Greatest size of a header, in bytes.
const MOST_HEADER_BYTES: usize = 1 << 16;

/// Greatest number of fields, and of values of a field.
const MOST_FIELDS: usize = 256;
const MOST_VALUES: usize = 65536;

/// A scanner at the origin, not turned.
pub(super) const NO_VIEWPOINT: [f64; 7] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];

/// How the points are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Data {
    Text,
    Binary,
    Compressed,
}

impl Data {
    pub fn describe(self) -> &'static str {
        match self {
            Self::Text => "ASCII",
            Self::Binary => "binary",
            Self::Compressed => "binary, compressed",
        }
    }
}

/// A type that can be read, or one of which only the size counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Type {
    Scalar(Scalar),
    /// A 64-bit integer.
    Long,
}

/// A field of the points.
#[derive(Debug, Clone)]
pub(super) struct Field {
    pub name: String,
    /// `I`, `U` or `F`.
    letter: char,
    /// `None` if letter and size do not go together.
    pub kind: Option<Type>,
    /// Size of a value, in bytes.
    pub bytes: usize,
    /// Values a point.
    pub count: usize,
}

impl Field {
    /// Whether it stands for nothing.
    pub fn is_padding(&self) -> bool {
        self.name == "_"
    }

    /// The type as the header has it.
    pub fn describe(&self) -> String {
        let Self { letter, bytes, count, .. } = self;
        if *count == 1 { format!("{letter}{bytes}") } else { format!("{count} x {letter}{bytes}") }
    }
}

/// A parsed header.
#[derive(Debug)]
pub(super) struct Header {
    pub fields: Vec<Field>,
    /// The line that names them.
    pub fields_line: u64,
    pub width: u64,
    pub height: u64,
    /// Below 2^32 - 1.
    pub points: u64,
    /// Place of the scanner, and its turn as a quaternion, the real part first.
    pub viewpoint: [f64; 7],
    pub data: Data,
    /// The line that says how the points are written: the last of the header.
    pub data_line: u64,
    /// The first byte of the points.
    pub body: usize,
}

impl Header {
    /// Reads and checks the header.
    pub fn read(bytes: &[u8], path: &Path) -> Result<Self, Error> {
        let mut lines = Header::lines(bytes);
        let mut entries: Vec<(&str, Vec<&str>, u64)> = Vec::new();
        let (data, data_line, body) = loop {
            let Some((number, line, end)) = lines.next() else {
                let found = "no line DATA";
                return Err(Error::invalid(
                    path,
                    Place::File,
                    found,
                    "the header of a PCD file, which ends with one",
                ));
            };
            let invalid =
                |expected: &str| Err(Error::invalid(path, Place::Line(number), quoted(line), expected));
            let Ok(text) = str::from_utf8(line) else { return invalid("a header of text") };
            let mut words = text.split_ascii_whitespace();
            match words.next() {
                None => {}
                Some(word) if word.starts_with('#') => {}
                Some("DATA") => {
                    let data = match words.next() {
                        Some("ascii") => Data::Text,
                        Some("binary") => Data::Binary,
                        Some("binary_compressed") => Data::Compressed,
                        _ => return invalid("DATA ascii, binary or binary_compressed"),
                    };
                    break (data, number, end);
                }
                Some(
                    key @ ("VERSION" | "FIELDS" | "COLUMNS" | "SIZE" | "TYPE" | "COUNT" | "WIDTH" | "HEIGHT"
                    | "VIEWPOINT" | "POINTS"),
                ) => entries.push((key, words.collect(), number)),
                Some(_) => return invalid("a line of the header of a PCD file"),
            }
        };
        let entry = |key: &str| entries.iter().find(|(known, ..)| *known == key);
        let Some((_, names, fields_line)) = entry("FIELDS").or_else(|| entry("COLUMNS")) else {
            return Err(Error::invalid(
                path,
                Place::Line(data_line),
                "no line FIELDS before it",
                "the names of the fields",
            ));
        };
        if !(1..=MOST_FIELDS).contains(&names.len()) {
            let found = format!("{} fields", names.len());
            return Err(Error::invalid(
                path,
                Place::Line(*fields_line),
                found,
                format!("1 to {MOST_FIELDS}"),
            ));
        }
        // One word a field.
        let list = |key: &str, default: &'static str| match entry(key) {
            Some((_, words, line)) if words.len() != names.len() => {
                let found = format!("{} words behind {key}", words.len());
                Err(Error::invalid(path, Place::Line(*line), found, format!("{}, one a field", names.len())))
            }
            Some((_, words, line)) => Ok((words.clone(), *line)),
            None => Ok((vec![default; names.len()], data_line)),
        };
        let (sizes, types, counts) = (list("SIZE", "4")?, list("TYPE", "F")?, list("COUNT", "1")?);
        let mut fields = Vec::new();
        for (index, name) in names.iter().enumerate() {
            let (size, letter, count) = (sizes.0[index], types.0[index], counts.0[index]);
            let bytes: Option<usize> = size.parse().ok().filter(|bytes| [1, 2, 4, 8].contains(bytes));
            let Some(bytes) = bytes else {
                return Err(Error::invalid(
                    path,
                    Place::Line(sizes.1),
                    quoted(size.as_bytes()),
                    "1, 2, 4 or 8",
                ));
            };
            let Some(letter) = ["I", "U", "F"].contains(&letter).then(|| letter.chars().next()).flatten()
            else {
                return Err(Error::invalid(
                    path,
                    Place::Line(types.1),
                    quoted(letter.as_bytes()),
                    "I, U or F",
                ));
            };
            let count = match count.parse() {
                Ok(count) if (1..=MOST_VALUES).contains(&count) => count,
                _ => {
                    let expected = format!("1 to {MOST_VALUES} values");
                    return Err(Error::invalid(
                        path,
                        Place::Line(counts.1),
                        quoted(count.as_bytes()),
                        expected,
                    ));
                }
            };
            let kind = kind(letter, bytes);
            fields.push(Field { name: (*name).to_owned(), letter, kind, bytes, count });
        }
        let number = |key: &str| match entry(key) {
            None => Ok(None),
            Some((_, words, line)) => match words[..] {
                [word] if word.parse::<u32>().is_ok() => Ok(word.parse::<u64>().ok()),
                _ => {
                    let found = quoted(words.join(" ").as_bytes());
                    Err(Error::invalid(path, Place::Line(*line), found, "a whole number below 2^32"))
                }
            },
        };
        let (width, height) = (number("WIDTH")?, number("HEIGHT")?.unwrap_or(1));
        let points = number("POINTS")?;
        let grid = width.map(|width| width * height);
        let points = match (points, grid) {
            (Some(points), Some(grid)) if points != grid => {
                let found = format!("{points} points, but WIDTH times HEIGHT is {grid}");
                return Err(Error::invalid(path, Place::Line(data_line), found, "as many"));
            }
            (Some(points), _) | (None, Some(points)) => points,
            (None, None) => {
                return Err(Error::invalid(
                    path,
                    Place::Line(data_line),
                    "neither POINTS nor WIDTH",
                    "one of them",
                ));
            }
        };
        if points >= u64::from(u32::MAX) {
            let what = format!("a cloud of {points} points");
            return Err(Error::limit(path, what, format!("{} points", u32::MAX - 1)));
        }
        let viewpoint = entry("VIEWPOINT").and_then(|(_, words, _)| {
            let numbers: Option<Vec<f64>> = words.iter().map(|word| word.parse().ok()).collect();
            numbers?.try_into().ok()
        });
        Ok(Self {
            fields,
            fields_line: *fields_line,
            width: width.unwrap_or(points),
            height,
            points,
            viewpoint: viewpoint.unwrap_or(NO_VIEWPOINT),
            data,
            data_line,
            body,
        })
    }

    /// Size of a point, in bytes, where it is binary.
    pub fn row_bytes(&self) -> usize {
        self.fields.iter().map(|field| field.bytes * field.count).sum()
    }

    /// The lines that can be a header, each with its number and the place behind it.
    fn lines(bytes: &[u8]) -> impl Iterator<Item = (u64, &[u8], usize)> {
        let mut start = 0;
        (1..).map_while(move |number| {
            let rest =
                bytes.get(start..bytes.len().min(MOST_HEADER_BYTES)).filter(|rest| !rest.is_empty())?;
            let length = rest.iter().position(|&byte| byte == b'\n');
            let line = &rest[..length.unwrap_or(rest.len())];
            start += length.map_or(rest.len(), |length| length + 1);
            Some((number, line.trim_ascii(), start))
        })
    }
}

/// The type of a letter and a size.
fn kind(letter: char, bytes: usize) -> Option<Type> {
    Some(match (letter, bytes) {
        ('I', 1) => Type::Scalar(Scalar::I8),
        ('I', 2) => Type::Scalar(Scalar::I16),
        ('I', 4) => Type::Scalar(Scalar::I32),
        ('U', 1) => Type::Scalar(Scalar::U8),
        ('U', 2) => Type::Scalar(Scalar::U16),
        ('U', 4) => Type::Scalar(Scalar::U32),
        ('I' | 'U', 8) => Type::Long,
        ('F', 4) => Type::Scalar(Scalar::F32),
        ('F', 8) => Type::Scalar(Scalar::F64),
        _ => return None,
    })
}
