//! What separates the numbers of a text, where its rows begin, and what its columns mean.
//!
//! Without names the first three columns are x, y and z. Behind them, from left to right, three columns of length 1 are a
//! normal, three of whole numbers from 0 to 255 a colour; one that is neither is the intensity, further ones are
//! nameless fields. Of four columns behind x, y and z the intensity comes first if the last three can be a colour and
//! the first three cannot, or in a PTS file.

use crate::error::quoted;
use crate::table::Scalar;
use crate::{Error, Place};
use std::path::Path;

/// Number of rows that are looked at to tell what the columns mean.
const SAMPLE: usize = 1000;

/// Greatest length of a line of names, in bytes.
const MOST_NAMES_BYTES: usize = 1 << 16;

/// Greatest number of columns.
const MOST_COLUMNS: usize = 64;

/// What stands between numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Separator {
    Blanks,
    Byte(u8),
}

impl Separator {
    fn of(line: &[u8]) -> Self {
        let found = [b';', b','].into_iter().find(|byte| line.contains(byte));
        found.map_or(Self::Blanks, Self::Byte)
    }

    pub fn describe(self) -> &'static str {
        match self {
            Self::Blanks => "blanks",
            Self::Byte(b';') => "semicolons",
            Self::Byte(_) => "commas",
        }
    }

    /// The words of a line.
    #[inline]
    pub fn split(self, line: &[u8]) -> impl Iterator<Item = &[u8]> {
        let is_end = move |byte: &u8| match self {
            Self::Blanks => byte.is_ascii_whitespace(),
            Self::Byte(separator) => *byte == separator,
        };
        line.split(is_end)
            .filter(move |word| self != Self::Blanks || !word.is_empty())
            .map(<[u8]>::trim_ascii)
    }
}

/// The lines of a text with their numbers, from 1; blanks at both ends taken off.
#[derive(Debug, Clone)]
pub(super) struct Lines<'a> {
    rest: &'a [u8],
    number: u64,
}

impl<'a> Lines<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        // The byte order mark of UTF-8 says nothing.
        Self { rest: bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), number: 0 }
    }

    /// What is not read yet.
    pub fn rest(&self) -> &'a [u8] {
        self.rest
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (u64, &'a [u8]);

    #[inline]
    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self.rest.iter().position(|&byte| byte == b'\n');
        let (line, rest) = match end {
            Some(end) => (&self.rest[..end], &self.rest[end + 1..]),
            None => (self.rest, &[][..]),
        };
        self.rest = rest;
        self.number += 1;
        Some((self.number, line.trim_ascii()))
    }
}

/// Whether a line is a comment.
#[inline]
pub(super) fn is_comment(line: &[u8]) -> bool {
    line.starts_with(b"#") || line.starts_with(b"//")
}

/// The number of a line that has one whole number and nothing else.
pub(super) fn count_line(line: &[u8]) -> Option<u64> {
    str::from_utf8(line).ok()?.parse().ok()
}

/// How a text is to be read.
pub(super) struct Layout<'a> {
    /// The names of the columns: a meaning, a field's name, or [`super::SKIPPED`].
    pub names: Vec<String>,
    /// The line that gives them, or the first row.
    pub names_line: u64,
    pub separator: Separator,
    /// Number of points that a first line claims.
    pub claimed: Option<u64>,
    /// The first row and all that follows.
    pub rows: Lines<'a>,
    pub assumptions: Vec<String>,
}

impl<'a> Layout<'a> {
    /// Finds the layout, but for the names if `columns` has them.
    pub fn find(bytes: &'a [u8], path: &Path, columns: Option<&[String]>) -> Result<Self, Error> {
        let mut lines = Lines::new(bytes);
        let (mut claimed, mut from_comment, mut from_line) = (None, None, None);
        let (rows, first_number, first) = loop {
            let rows = lines.clone();
            let Some((number, line)) = lines.next() else {
                return Err(Error::invalid(path, Place::File, "no row of numbers", "a point a line"));
            };
            if line.is_empty() {
                continue;
            }
            if is_comment(line) {
                from_comment = names(line).filter(|names| has_places(names)).map(|names| (number, names));
            } else if claimed.is_none() && from_line.is_none() && count_line(line).is_some() {
                claimed = count_line(line);
            } else if Separator::of(line).split(line).next().is_some_and(is_number) {
                break (rows, number, line);
            } else if from_line.is_none() {
                from_line = names(line).map(|names| (number, names));
            } else {
                let found = quoted(line);
                return Err(Error::invalid(path, Place::Line(number), found, "a row of numbers"));
            }
        };
        let separator = Separator::of(first);
        let mut count = separator.split(first).count();
        // A separator at the end of the row begins no column.
        count -= usize::from(separator.split(first).last().is_some_and(<[u8]>::is_empty));
        if !(3..=MOST_COLUMNS).contains(&count) {
            let expected = format!("3 to {MOST_COLUMNS} numbers: x, y, z and what else there is");
            return Err(Error::invalid(
                path,
                Place::Line(first_number),
                format!("{count} numbers"),
                expected,
            ));
        }
        let from_comment = from_comment.filter(|(_, names): &(u64, Vec<String>)| names.len() == count);
        let mut assumptions = Vec::new();
        let (names_line, names) = match (columns, from_line.or(from_comment)) {
            (Some(columns), _) => (first_number, columns.to_vec()),
            (None, Some((line, names))) => {
                assumptions.push(format!("the columns are named by line {line}"));
                (line, names)
            }
            (None, None) => {
                let is_pts = path.extension().is_some_and(|name| name.eq_ignore_ascii_case("pts"));
                let names = Sample::new(&rows, separator, count).names(is_pts);
                let list = names.join(" ");
                assumptions.push(format!("the columns are taken as {list}, from their values (--columns)"));
                (first_number, names)
            }
        };
        if names.len() != count {
            let expected = format!("as many as the first row, line {first_number}, has numbers: {count}");
            return Err(Error::invalid(
                path,
                Place::Line(names_line),
                format!("{} columns", names.len()),
                expected,
            ));
        }
        Ok(Self { names, names_line, separator, claimed, rows, assumptions })
    }
}

fn is_number(word: &[u8]) -> bool {
    Scalar::F64.parse(word).is_ok()
}

/// The names in a line, if it is text; quotes and the signs of a comment taken off.
fn names(line: &[u8]) -> Option<Vec<String>> {
    let line = line.get(..line.len().min(MOST_NAMES_BYTES)).filter(|head| head.len() == line.len())?;
    let line = str::from_utf8(line).ok()?.trim_start_matches(['#', '/']).trim();
    let separator = match Separator::of(line.as_bytes()) {
        Separator::Blanks if line.contains('\t') => Separator::Byte(b'\t'),
        separator => separator,
    };
    let name = |word: &[u8]| {
        let word = str::from_utf8(word).unwrap_or_default();
        word.trim_matches(['"', '\'']).trim().to_owned()
    };
    Some(separator.split(line.as_bytes()).map(name).filter(|name| !name.is_empty()).collect())
}

/// Whether x, y and z are among the names.
fn has_places(names: &[String]) -> bool {
    ["x", "y", "z"].iter().all(|place| names.iter().any(|name| name.eq_ignore_ascii_case(place)))
}

/// The first rows, to guess from.
struct Sample {
    rows: Vec<Vec<f64>>,
    columns: usize,
}

impl Sample {
    fn new(lines: &Lines<'_>, separator: Separator, columns: usize) -> Self {
        let row = |(_, line): (u64, &[u8])| {
            let words = separator.split(line).take(columns);
            let row: Option<Vec<f64>> = words.map(|word| Scalar::F64.parse(word).ok()).collect();
            row.filter(|row| row.len() == columns)
        };
        Self { rows: lines.clone().take(SAMPLE).filter_map(row).collect(), columns }
    }

    /// Names for the columns. See the [module](self).
    fn names(&self, is_pts: bool) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        let mut rest: &[&str] = &[];
        while names.len() < self.columns {
            let at = names.len();
            let has = |name: &str| names.iter().any(|known| known == name);
            if rest.is_empty() {
                let intensity_first = self.columns == 7 && (is_pts || !self.is_color(3)) && self.is_color(4);
                rest = match at {
                    0 => &["x", "y", "z"],
                    3 if intensity_first => &["intensity", "r", "g", "b"],
                    _ if !has("nx") && self.is_normal(at) => &["nx", "ny", "nz"],
                    _ if !has("r") && (self.is_color(at) || (self.columns == 6 && self.is_fraction(at))) => {
                        &["r", "g", "b"]
                    }
                    _ if !has("intensity") => &["intensity"],
                    _ => &[],
                };
            }
            match rest.split_first() {
                Some((name, others)) => {
                    names.push((*name).to_owned());
                    rest = others;
                }
                None => names.push(format!("column_{}", at + 1)),
            }
        }
        names
    }

    /// Whether three columns are there, and all rows of them are as `holds` says.
    fn all(&self, at: usize, holds: impl Fn(&[f64]) -> bool) -> bool {
        at + 3 <= self.columns && !self.rows.is_empty() && self.rows.iter().all(|row| holds(&row[at..at + 3]))
    }

    fn is_color(&self, at: usize) -> bool {
        self.all(at, |color| color.iter().all(|v| v.fract() == 0.0 && (0.0..=255.0).contains(v)))
    }

    fn is_fraction(&self, at: usize) -> bool {
        self.all(at, |color| color.iter().all(|v| (0.0..=1.0).contains(v)))
    }

    /// Numbers with three digits make lengths that are off by 1 %.
    fn is_normal(&self, at: usize) -> bool {
        self.all(at, |n| (n.iter().map(|v| v * v).sum::<f64>() - 1.0).abs() < 0.02)
    }
}
