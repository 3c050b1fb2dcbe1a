//! The header: what tables the file has. Claims are checked here, before anything is allocated for them.

mod reader;

use crate::error::quoted;
use crate::source::Source;
use crate::table::{Element, Hints};
use crate::{Error, Place};
use glam::DVec3;
use std::io::Read;
use std::path::Path;

/// How the tables are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Format {
    Ascii,
    BinaryLittleEndian,
    BinaryBigEndian,
}

impl Format {
    /// The format in words.
    pub fn describe(self) -> &'static str {
        match self {
            Self::Ascii => "ASCII",
            Self::BinaryLittleEndian => "binary little endian",
            Self::BinaryBigEndian => "binary big endian",
        }
    }
}

/// A parsed header.
#[derive(Debug)]
pub(super) struct Header {
    pub format: Format,
    pub elements: Vec<Element>,
    /// Number of the first line after the header.
    pub next_line: u64,
    /// What a comment `splat oriented` says.
    pub oriented: Option<bool>,
    /// Whether a comment `splat trained` says so.
    pub trained: bool,
    /// What a comment `splat origin` says; finite.
    pub origin: Option<DVec3>,
}

impl Header {
    /// What the comments say of the points.
    pub fn hints(&self) -> Hints {
        Hints { oriented: self.oriented, origin: self.origin }
    }

    /// Index of the table of points: `vertex`, else `point`.
    pub fn points(&self, path: &Path) -> Result<usize, Error> {
        let position = |name| self.elements.iter().position(|e| e.name.eq_ignore_ascii_case(name));
        position("vertex").or_else(|| position("point")).ok_or_else(|| {
            let names: Vec<_> = self.elements.iter().take(8).map(|e| quoted(e.name.as_bytes())).collect();
            let found =
                if names.is_empty() { "no element".to_owned() } else { format!("only {}", names.join(", ")) };
            Error::invalid(path, Place::File, found, "an element named `vertex` or `point`")
        })
    }

    /// Holds what the tables up to the last one to be read claim against what the file has.
    pub fn check_claims<R: Read>(&self, points: usize, last: usize, source: &Source<R>) -> Result<(), Error> {
        if self.elements[points].count >= u64::from(u32::MAX) {
            let what = format!("a cloud of {} points", self.elements[points].count);
            return Err(Error::limit(source.path(), what, format!("{} points", u32::MAX - 1)));
        }
        let mut left = u128::from(source.left());
        // The last number of an ASCII file may lack the blank behind it.
        let lacking = u128::from(self.format == Format::Ascii);
        for element in &self.elements[..=last] {
            let row = match self.format {
                Format::Ascii => 2 * element.properties.len(),
                _ => element.least_bytes(),
            } as u128;
            let claimed = u128::from(element.count) * row;
            if claimed > left + lacking {
                let (name, count) = (&element.name, element.count);
                let found = format!("element {name} of {count} rows, at least {claimed} bytes");
                let expected = format!(
                    "at most {} rows: the file of {} bytes has {left} left for them",
                    (left + lacking) / row,
                    source.size()
                );
                return Err(Error::invalid(source.path(), Place::Line(element.line), found, expected));
            }
            left = left.saturating_sub(claimed);
        }
        Ok(())
    }

    /// Size of all tables, in bytes, where the header alone tells it.
    fn exact_bytes(&self) -> Option<u128> {
        let fixed = self.format != Format::Ascii && self.elements.iter().all(Element::is_fixed);
        let bytes = |e: &Element| u128::from(e.count) * e.least_bytes() as u128;
        fixed.then(|| self.elements.iter().map(bytes).sum())
    }
}
