//! Tables as text: a row a line, numbers between blanks.

use super::faces::{Faces, List};
use super::header::Header;
use super::rows::{Rows, Table, Tables};
use crate::error::quoted;
use crate::source::Source;
use crate::table::{Element, Kind, Scalar};
use crate::{Error, Place};
use std::io::Read;

/// Greatest length of a number, in bytes: more than the longest exact `f64` needs.
const MOST_WORD_BYTES: usize = 1100;

/// Reads the tables that are wanted; what follows the last of them is left alone.
pub(super) fn read<R: Read>(
    source: &mut Source<R>,
    header: &Header,
    tables: &mut impl Tables,
) -> Result<(), Error> {
    let mut text = Text { source, line: header.next_line };
    for (index, element) in header.elements[..tables.end()].iter().enumerate() {
        match tables.table(index) {
            Table::Rows(rows) => text.read_rows(element, rows)?,
            Table::Faces(faces) => text.read_faces(element, faces)?,
            Table::Skipped if element.properties.is_empty() => {}
            Table::Skipped => text.skip_rows(element)?,
        }
    }
    Ok(())
}

/// The text, and where it stands.
struct Text<'a, R> {
    source: &'a mut Source<R>,
    /// Number of the current line.
    line: u64,
}

fn is_blank(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | 0x0b | 0x0c)
}

fn is_line_end(byte: u8) -> bool {
    matches!(byte, b'\n' | b'\r')
}

impl<R: Read> Text<'_, R> {
    /// Reads a table of which rows are wanted.
    fn read_rows(&mut self, element: &Element, taker: &mut dyn Rows) -> Result<(), Error> {
        let mut values = vec![0.0; taker.width()];
        for row in 0..taker.count() as u64 {
            self.start_row(element, row)?;
            for (property, slot) in element.properties.iter().zip(taker.slots()) {
                let name = &property.name;
                match (property.kind, *slot) {
                    (Kind::Scalar(kind), Some(slot)) => {
                        values[slot] = self.number(kind, element, row, name)?;
                    }
                    (Kind::Scalar(_), None) => self.skip_word(element, row, name)?,
                    (Kind::List { count, .. }, _) => {
                        for _ in 0..self.list_length(count, element, row, name)? {
                            self.skip_word(element, row, name)?;
                        }
                    }
                }
            }
            self.end_row(element, row)?;
            taker.push(&values);
        }
        Ok(())
    }

    /// Reads the table of faces.
    fn read_faces(&mut self, element: &Element, faces: &mut Faces) -> Result<(), Error> {
        for row in 0..element.count {
            self.start_row(element, row)?;
            faces.start_row();
            for (index, property) in element.properties.iter().enumerate() {
                let name = &property.name;
                match (property.kind, faces.list(index)) {
                    (Kind::Scalar(_), _) => self.skip_word(element, row, name)?,
                    (Kind::List { count, item }, list) => {
                        for _ in 0..self.list_length(count, element, row, name)? {
                            match list {
                                List::Skipped => self.skip_word(element, row, name)?,
                                _ => faces.value(list, self.number(item, element, row, name)?),
                            }
                        }
                    }
                }
            }
            let place = Place::Line(self.line);
            self.end_row(element, row)?;
            faces.end_row(self.source.path(), || place)?;
        }
        Ok(())
    }

    /// Reads the length of a list.
    fn list_length(&mut self, count: Scalar, element: &Element, row: u64, name: &str) -> Result<u64, Error> {
        let length = self.number(count, element, row, name)?;
        if length < 0.0 {
            let found = format!("a list of {length} entries");
            return Err(self.invalid(found, format!("0 or more in property {name} of row {row}")));
        }
        Ok(length as u64)
    }

    /// Goes to the next word of the line and gives its length, or `None` at the end of the line or file. The
    /// word is then at the front of the window.
    #[inline]
    fn next_word(&mut self) -> Result<Option<usize>, Error> {
        loop {
            let window = self.source.window();
            let blanks = window.iter().position(|&byte| !is_blank(byte)).unwrap_or(window.len());
            let at_word = blanks < window.len();
            self.source.consume(blanks);
            if at_word {
                break;
            }
            if !self.source.want(1)? {
                return Ok(None);
            }
        }
        if is_line_end(self.source.window()[0]) {
            return Ok(None);
        }
        loop {
            let window = self.source.window();
            if let Some(length) = window.iter().position(|&byte| is_blank(byte) || is_line_end(byte)) {
                return Ok(Some(length));
            }
            let length = window.len();
            if length > MOST_WORD_BYTES {
                let found = quoted(window);
                return Err(self.invalid(found, format!("a number of at most {MOST_WORD_BYTES} bytes")));
            }
            if !self.source.want(length + 1)? {
                return Ok(Some(length));
            }
        }
    }

    /// The next word of the row, which must be there.
    #[inline]
    fn word(&mut self, element: &Element, row: u64, property: &str) -> Result<usize, Error> {
        match self.next_word()? {
            Some(length) => Ok(length),
            None => {
                let found = self.end_found();
                Err(self
                    .invalid(found, format!("property {property} of row {row} of element {}", element.name)))
            }
        }
    }

    fn skip_word(&mut self, element: &Element, row: u64, property: &str) -> Result<(), Error> {
        let length = self.word(element, row, property)?;
        self.source.consume(length);
        Ok(())
    }

    /// Reads the next number of the row.
    #[inline]
    fn number(&mut self, kind: Scalar, element: &Element, row: u64, property: &str) -> Result<f64, Error> {
        let length = self.word(element, row, property)?;
        let word = &self.source.window()[..length];
        match kind.parse(word) {
            Ok(value) => {
                self.source.consume(length);
                Ok(value)
            }
            Err(expected) => {
                let found = quoted(word);
                let element = &element.name;
                let expected =
                    format!("{expected} for property {property} of row {row} of element {element}");
                Err(self.invalid(found, expected))
            }
        }
    }

    /// Goes to the first word of the next line that has one.
    #[inline]
    fn start_row(&mut self, element: &Element, row: u64) -> Result<(), Error> {
        while self.next_word()?.is_none() {
            if !self.end_line()? {
                let (name, count) = (&element.name, element.count);
                let expected = format!("row {row} of the {count} rows of element {name}");
                return Err(self.invalid("the end of the file", expected));
            }
        }
        Ok(())
    }

    /// Checks that the line has no further word, and ends it.
    #[inline]
    fn end_row(&mut self, element: &Element, row: u64) -> Result<(), Error> {
        if let Some(length) = self.next_word()? {
            let found = quoted(&self.source.window()[..length]);
            return Err(self.invalid(found, format!("the end of row {row} of element {}", element.name)));
        }
        self.end_line()?;
        Ok(())
    }

    /// Reads the line end that comes next; `false` at the end of the file.
    #[inline]
    fn end_line(&mut self) -> Result<bool, Error> {
        if !self.source.want(1)? {
            return Ok(false);
        }
        if self.source.want(2)? && self.source.window().starts_with(b"\r\n") {
            self.source.consume(1);
        }
        self.source.consume(1);
        self.line += 1;
        Ok(true)
    }

    /// Skips a table.
    fn skip_rows(&mut self, element: &Element) -> Result<(), Error> {
        for row in 0..element.count {
            self.start_row(element, row)?;
            loop {
                let window = self.source.window();
                let end = window.iter().position(|&byte| is_line_end(byte));
                let length = end.unwrap_or(window.len());
                self.source.consume(length);
                if end.is_some() || !self.source.want(1)? {
                    break;
                }
            }
            self.end_line()?;
        }
        Ok(())
    }

    /// What is where a word was expected.
    fn end_found(&self) -> &'static str {
        if self.source.window().is_empty() { "the end of the file" } else { "the end of the line" }
    }

    #[cold]
    fn invalid(&self, found: impl Into<String>, expected: impl Into<String>) -> Error {
        Error::invalid(self.source.path(), Place::Line(self.line), found, expected)
    }
}
