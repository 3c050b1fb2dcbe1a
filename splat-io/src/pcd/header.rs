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

/// What a line of the header can begin with, other than DATA.
const KEYS: [&str; 10] =
    ["VERSION", "FIELDS", "COLUMNS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS"];

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
        let entries = Entries::read(bytes, path)?;
        let (fields, fields_line) = entries.fields()?;
        let (width, height) = (entries.number("WIDTH")?, entries.number("HEIGHT")?.unwrap_or(1));
        let points = entries.points(width.map(|width| width * height))?;
        Ok(Self {
            fields,
            fields_line,
            width: width.unwrap_or(points),
            height,
            points,
            viewpoint: entries.viewpoint().unwrap_or(NO_VIEWPOINT),
            data: entries.data,
            data_line: entries.data_line,
            body: entries.body,
        })
    }

    /// Size of a point, in bytes, where it is binary.
    pub fn row_bytes(&self) -> usize {
        self.fields.iter().map(|field| field.bytes * field.count).sum()
    }
}

/// A line of the header.
struct Entry<'a> {
    key: &'a str,
    words: Vec<&'a str>,
    line: u64,
}

/// The lines of the header, before anything is understood of them.
struct Entries<'a> {
    path: &'a Path,
    entries: Vec<Entry<'a>>,
    data: Data,
    data_line: u64,
    body: usize,
}

impl<'a> Entries<'a> {
    fn read(bytes: &'a [u8], path: &'a Path) -> Result<Self, Error> {
        let mut entries = Vec::new();
        for (number, line, body) in lines(bytes) {
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
                    return Ok(Self { path, entries, data, data_line: number, body });
                }
                Some(key) if KEYS.contains(&key) => {
                    entries.push(Entry { key, words: words.collect(), line: number });
                }
                Some(_) => return invalid("a line of the header of a PCD file"),
            }
        }
        let expected = "the header of a PCD file, which ends with one";
        Err(Error::invalid(path, Place::File, "no line DATA", expected))
    }

    fn get(&self, key: &str) -> Option<&Entry<'a>> {
        self.entries.iter().find(|entry| entry.key == key)
    }

    #[cold]
    fn invalid(&self, line: u64, found: impl Into<String>, expected: impl Into<String>) -> Error {
        Error::invalid(self.path, Place::Line(line), found, expected)
    }

    /// The fields, and the line that names them.
    fn fields(&self) -> Result<(Vec<Field>, u64), Error> {
        let Some(Entry { words: names, line, .. }) = self.get("FIELDS").or_else(|| self.get("COLUMNS"))
        else {
            return Err(self.invalid(self.data_line, "no line FIELDS before it", "the names of the fields"));
        };
        if !(1..=MOST_FIELDS).contains(&names.len()) {
            return Err(self.invalid(
                *line,
                format!("{} fields", names.len()),
                format!("1 to {MOST_FIELDS}"),
            ));
        }
        let sizes =
            self.numbers("SIZE", 4, names.len(), |size| [1, 2, 4, 8].contains(&size), "1, 2, 4 or 8")?;
        let is_count = |count| (1..=MOST_VALUES).contains(&count);
        let counts = self.numbers("COUNT", 1, names.len(), is_count, "1 to 65536 values")?;
        let (letters, letters_line) = self.words("TYPE", "F", names.len())?;
        let mut fields = Vec::new();
        for (index, name) in names.iter().enumerate() {
            let (word, bytes, count) = (letters[index], sizes[index], counts[index]);
            let letter = match word {
                "I" => 'I',
                "U" => 'U',
                "F" => 'F',
                _ => return Err(self.invalid(letters_line, quoted(word.as_bytes()), "I, U or F")),
            };
            fields.push(Field { name: (*name).to_owned(), letter, kind: kind(letter, bytes), bytes, count });
        }
        Ok((fields, *line))
    }

    /// One word a field, and their line.
    fn words(&self, key: &str, default: &'static str, count: usize) -> Result<(Vec<&'a str>, u64), Error> {
        match self.get(key) {
            Some(Entry { words, line, .. }) if words.len() != count => {
                let found = format!("{} words behind {key}", words.len());
                Err(self.invalid(*line, found, format!("{count}, one a field")))
            }
            Some(Entry { words, line, .. }) => Ok((words.clone(), *line)),
            None => Ok((vec![default; count], self.data_line)),
        }
    }

    /// One number a field.
    fn numbers(
        &self,
        key: &str,
        default: usize,
        count: usize,
        accepted: impl Fn(usize) -> bool,
        expected: &str,
    ) -> Result<Vec<usize>, Error> {
        if self.get(key).is_none() {
            return Ok(vec![default; count]);
        }
        let (words, line) = self.words(key, "", count)?;
        let number = |word: &&str| {
            let number = word.parse().ok().filter(|&number| accepted(number));
            number.ok_or_else(|| self.invalid(line, quoted(word.as_bytes()), expected))
        };
        words.iter().map(number).collect()
    }

    /// A line of one number.
    fn number(&self, key: &str) -> Result<Option<u64>, Error> {
        let Some(Entry { words, line, .. }) = self.get(key) else { return Ok(None) };
        match words[..] {
            [word] if word.parse::<u32>().is_ok() => Ok(word.parse().ok()),
            _ => Err(self.invalid(*line, quoted(words.join(" ").as_bytes()), "a whole number below 2^32")),
        }
    }

    /// The number of points: what POINTS says, or the size of the grid.
    fn points(&self, grid: Option<u64>) -> Result<u64, Error> {
        let points = match (self.number("POINTS")?, grid) {
            (Some(points), Some(grid)) if points != grid => {
                let found = format!("{points} points, but WIDTH times HEIGHT is {grid}");
                return Err(self.invalid(self.data_line, found, "as many"));
            }
            (Some(points), _) | (None, Some(points)) => points,
            (None, None) => {
                return Err(self.invalid(self.data_line, "neither POINTS nor WIDTH", "one of them"));
            }
        };
        if points >= u64::from(u32::MAX) {
            let what = format!("a cloud of {points} points");
            return Err(Error::limit(self.path, what, format!("{} points", u32::MAX - 1)));
        }
        Ok(points)
    }

    fn viewpoint(&self) -> Option<[f64; 7]> {
        let numbers: Option<Vec<f64>> =
            self.get("VIEWPOINT")?.words.iter().map(|word| word.parse().ok()).collect();
        numbers?.try_into().ok()
    }
}

/// The lines that can be a header, each with its number and the place behind it.
fn lines(bytes: &[u8]) -> impl Iterator<Item = (u64, &[u8], usize)> {
    let mut start = 0;
    (1..).map_while(move |number| {
        let rest = bytes.get(start..bytes.len().min(MOST_HEADER_BYTES)).filter(|rest| !rest.is_empty())?;
        let length = rest.iter().position(|&byte| byte == b'\n');
        let line = &rest[..length.unwrap_or(rest.len())];
        start += length.map_or(rest.len(), |length| length + 1);
        Some((number, line.trim_ascii(), start))
    })
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
