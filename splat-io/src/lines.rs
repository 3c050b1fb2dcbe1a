//! A text file line by line.

use crate::error::quoted;
use crate::source::Source;
use crate::{Error, Place};
use std::io::Read;

/// Greatest length of a line, in bytes: COLMAP writes all points of an image into one.
const MOST_BYTES: usize = 64 << 20;

/// The lines of a text.
pub(crate) struct Lines<R> {
    /// The file.
    pub source: Source<R>,
    /// The current line, without its end.
    line: Vec<u8>,
    /// Its number, counted from 1.
    pub number: u64,
}

impl<R: Read> Lines<R> {
    pub fn new(source: Source<R>) -> Self {
        Self { source, line: Vec::new(), number: 0 }
    }

    /// Goes to the next line and says whether there was one.
    pub fn next(&mut self) -> Result<bool, Error> {
        self.line.clear();
        self.number += 1;
        let mut is_any = false;
        while self.source.want(1)? {
            is_any = true;
            let window = self.source.window();
            let end = window.iter().position(|&byte| byte == b'\n');
            let part = &window[..end.unwrap_or(window.len())];
            if self.line.len() + part.len() > MOST_BYTES {
                let what = format!("line {} of more than 64 MiB", self.number);
                return Err(Error::limit(self.source.path(), what, "64 MiB"));
            }
            self.line.extend_from_slice(part);
            let bytes = part.len() + usize::from(end.is_some());
            self.source.consume(bytes);
            if end.is_some() {
                break;
            }
        }
        Ok(is_any)
    }

    /// Goes to the next line that holds something and is no comment, and says whether there was one.
    pub fn next_row(&mut self) -> Result<bool, Error> {
        while self.next()? {
            if !self.line.trim_ascii().is_empty() && !self.line.trim_ascii_start().starts_with(b"#") {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// The line, blanks around it taken off.
    pub fn text(&self) -> Result<&str, Error> {
        str::from_utf8(self.line.trim_ascii()).map_err(|_| self.invalid("UTF-8 text"))
    }

    /// An error in this line.
    pub fn invalid(&self, expected: impl Into<String>) -> Error {
        let found = if self.line.is_empty() { "nothing".to_owned() } else { quoted(&self.line) };
        Error::invalid(self.source.path(), Place::Line(self.number), found, expected)
    }
}
