//! What can be wrong with a file.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// Why a file cannot be read or written.
///
/// Every message is whole: it names the file and holds the cause's own words. Hence no error has a `source`,
/// which a program that prints chains would say twice. What a message repeats of a file is short and of one line,
/// whatever the file holds.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The operating system refused: the blame lies outside the file's contents.
    #[error("{}: cannot {action}: {cause}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What was tried, as a verb: "open", "read", "write".
        action: &'static str,
        /// What the operating system said.
        cause: io::Error,
    },
    /// The file may well be right, but this version cannot do it.
    #[error("{}: {} is not supported, expected {}", path.display(), Shown(found), Shown(expected))]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// What the file holds or asks for.
        found: String,
        /// What would be accepted.
        expected: String,
    },
    /// The file breaks the rules of its format.
    #[error("{}: {place}: found {}, expected {}", path.display(), Shown(found), Shown(expected))]
    Invalid {
        /// The file.
        path: PathBuf,
        /// Where in the file.
        place: Place,
        /// What is there.
        found: String,
        /// What may be there.
        expected: String,
    },
    /// The file asks for more than this version allows.
    #[error("{}: {} is beyond the limit of {limit}", path.display(), Shown(what))]
    Limit {
        /// The file.
        path: PathBuf,
        /// What is too large, with its size.
        what: String,
        /// The greatest accepted size.
        limit: String,
    },
    /// Not JSON, or not the JSON expected; the cause names line, column, what was found and what was
    /// expected.
    #[error("{}: {}", path.display(), Shown(&cause.to_string()))]
    Json {
        /// The file.
        path: PathBuf,
        /// What the JSON parser said.
        cause: serde_json::Error,
    },
    /// The contents, well formed, make no sense to the renderer; or what was to be written does not.
    #[error("{}: {cause}", path.display())]
    Core {
        /// The file.
        path: PathBuf,
        /// What the renderer's own check said.
        cause: splat_core::Error,
    },
    /// The encoder of a picture format failed: a mistake of the program, not of the user.
    #[error("{}: cannot encode: {reason}", path.display())]
    Encode {
        /// The file.
        path: PathBuf,
        /// What the encoder said.
        reason: String,
    },
}

/// Where in a file something is wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    File,
    /// A line of a text, counted from 1.
    Line(u64),
    /// A byte, counted from 0.
    Byte(u64),
    /// A row of the binary table of an element.
    Row {
        /// The element's name.
        element: String,
        /// The row, counted from 0.
        row: u64,
        /// The byte of the file, counted from 0.
        byte: u64,
    },
    /// A named field.
    Field(&'static str),
    /// One of several cameras.
    Camera {
        /// Its name.
        name: String,
        /// The field, where it is one.
        field: Option<&'static str>,
    },
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File => write!(f, "whole file"),
            Self::Line(line) => write!(f, "line {line}"),
            Self::Byte(byte) => write!(f, "byte {byte}"),
            Self::Row { element, row, byte } => {
                write!(f, "row {row} of element {}, byte {byte}", Shown(element))
            }
            Self::Field(field) => write!(f, "field {field}"),
            Self::Camera { name, field: None } => write!(f, "camera {}", quoted(name.as_bytes())),
            Self::Camera { name, field: Some(field) } => {
                write!(f, "camera {}, field {field}", quoted(name.as_bytes()))
            }
        }
    }
}

impl Error {
    /// An [`Error::Io`]; made for `map_err`.
    pub(crate) fn io(path: &Path, action: &'static str) -> impl FnOnce(io::Error) -> Self {
        move |cause| Self::Io { path: path.to_owned(), action, cause }
    }

    /// An [`Error::Invalid`].
    pub(crate) fn invalid(
        path: &Path,
        place: Place,
        found: impl Into<String>,
        expected: impl Into<String>,
    ) -> Self {
        Self::Invalid { path: path.to_owned(), place, found: found.into(), expected: expected.into() }
    }

    /// An [`Error::Unsupported`].
    pub(crate) fn unsupported(path: &Path, found: impl Into<String>, expected: impl Into<String>) -> Self {
        Self::Unsupported { path: path.to_owned(), found: found.into(), expected: expected.into() }
    }

    /// An [`Error::Limit`].
    pub(crate) fn limit(path: &Path, what: impl Into<String>, limit: impl Into<String>) -> Self {
        Self::Limit { path: path.to_owned(), what: what.into(), limit: limit.into() }
    }

    /// The same error, said of one of the cameras of a file.
    pub(crate) fn of_camera(self, name: &str) -> Self {
        let place = |field| Place::Camera { name: name.to_owned(), field };
        match self {
            Self::Invalid { path, place: Place::Field(field), found, expected } => {
                Self::Invalid { path, place: place(Some(field)), found, expected }
            }
            Self::Core { path, cause: splat_core::Error::Invalid { what, found, expected } } => {
                Self::Invalid { path, place: place(Some(what)), found, expected: expected.to_owned() }
            }
            other => other,
        }
    }

    /// An [`Error::Core`]; made for `map_err`.
    pub(crate) fn core(path: &Path) -> impl FnOnce(splat_core::Error) -> Self {
        move |cause| Self::Core { path: path.to_owned(), cause }
    }
}

/// A text that may repeat what a file holds, as it may appear in a message: no control characters, its middle left out if
/// it is long.
struct Shown<'a>(&'a str);

impl fmt::Display for Shown<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const MOST: usize = 400;
        const KEPT: usize = 150;
        let count = self.0.chars().count();
        let is_kept = |place: usize| count <= MOST || place < KEPT || place >= count - KEPT;
        for (place, c) in self.0.chars().enumerate() {
            match c {
                _ if place == KEPT && !is_kept(place) => f.write_str(" .. ")?,
                _ if !is_kept(place) => {}
                _ if c.is_control() => write!(f, "{}", c.escape_default())?,
                _ => write!(f, "{c}")?,
            }
        }
        Ok(())
    }
}

/// Bytes of a file as they may appear in a message: in backquotes, on one line, shortened, nothing raw.
pub(crate) fn quoted(bytes: &[u8]) -> String {
    const MOST: usize = 40;
    let shown = &bytes[..bytes.len().min(MOST)];
    let more = if bytes.len() > MOST { ".." } else { "" };
    format!("`{}{more}`", shown.escape_ascii())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_file_holds_cannot_spoil_a_message() {
        let long = format!("a\u{1b}[31m\n{}\u{e9}z", "\u{e9}".repeat(1000));
        let error = Error::invalid(Path::new("x"), Place::Line(1), long, "y").to_string();
        assert!(error.starts_with("x: line 1: found a\\u{1b}[31m\\n\u{e9}"), "{error}");
        assert!(error.ends_with("\u{e9}z, expected y") && error.len() < 700, "{error}");
    }
}
