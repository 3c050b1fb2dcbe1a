//! From the first bytes of a file to its header.

use super::{Format, Header};
use crate::error::quoted;
use crate::source::Source;
use crate::table::{Element, Kind, Property, Scalar};
use crate::{Error, Place};
use glam::DVec3;
use std::collections::HashSet;
use std::io::Read;
use std::path::Path;

/// Greatest size of a header, in bytes.
const MOST_HEADER_BYTES: u64 = 1 << 20;

impl Header {
    /// Reads the header, up to the first byte of the tables.
    pub fn read<R: Read>(source: &mut Source<R>) -> Result<Self, Error> {
        let line_end = read_magic(source)?;
        let mut parser = Parser::default();
        let mut line_number = 2;
        loop {
            skip_blanks(source)?;
            if source.offset() > MOST_HEADER_BYTES {
                return Err(too_long(source.path()));
            }
            if at_end_header(source)? {
                let header = parser.finish(source, line_number)?;
                finish_header(source, line_end, &header, line_number)?;
                return Ok(header);
            }
            let line = read_line(source, line_end, line_number)?;
            parser.line(&line, source.path(), line_number)?;
            line_number += 1;
        }
    }
}

/// What ends a header's lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum LineEnd {
    /// A line feed, perhaps after a carriage return.
    Feed,
    /// A carriage return alone.
    Return,
}

/// Reads the first line, `ply`, and sees how lines end here.
fn read_magic<R: Read>(source: &mut Source<R>) -> Result<LineEnd, Error> {
    source.want(3)?;
    if !source.window().starts_with(b"ply") {
        let found = match source.window() {
            [] => "an empty file".to_owned(),
            window => quoted(&window[..window.len().min(16)]),
        };
        return Err(Error::invalid(
            source.path(),
            Place::Byte(0),
            found,
            "`ply`, the first line of a PLY file",
        ));
    }
    source.consume(3);
    skip_blanks(source)?;
    source.want(2)?;
    match source.window() {
        [b'\n', ..] => source.consume(1),
        [b'\r', b'\n', ..] => source.consume(2),
        [b'\r', ..] => {
            source.consume(1);
            return Ok(LineEnd::Return);
        }
        window => {
            let found = if window.is_empty() { "the end of the file".to_owned() } else { quoted(window) };
            return Err(Error::invalid(source.path(), Place::Line(1), found, "the end of the line `ply`"));
        }
    }
    Ok(LineEnd::Feed)
}

/// Skips blanks and tabs.
fn skip_blanks<R: Read>(source: &mut Source<R>) -> Result<(), Error> {
    while source.offset() <= MOST_HEADER_BYTES
        && source.want(1)?
        && matches!(source.window()[0], b' ' | b'\t')
    {
        source.consume(1);
    }
    Ok(())
}

const END_HEADER: &[u8] = b"end_header";

/// Whether the last line of the header comes next.
fn at_end_header<R: Read>(source: &mut Source<R>) -> Result<bool, Error> {
    source.want(END_HEADER.len() + 1)?;
    let rest = source.window().strip_prefix(END_HEADER);
    Ok(rest.is_some_and(|rest| matches!(rest.first(), None | Some(b' ' | b'\t' | b'\r' | b'\n'))))
}

/// Reads a line without its end; the rest of it may have blanks.
fn read_line<R: Read>(source: &mut Source<R>, line_end: LineEnd, number: u64) -> Result<Vec<u8>, Error> {
    let end = if line_end == LineEnd::Feed { b'\n' } else { b'\r' };
    let mut line = Vec::new();
    while source.want(1)? {
        let window = source.window();
        let found = window.iter().position(|&byte| byte == end);
        let length = found.unwrap_or(window.len());
        line.extend_from_slice(&window[..length]);
        source.consume(length + usize::from(found.is_some()));
        if source.offset() > MOST_HEADER_BYTES {
            return Err(too_long(source.path()));
        }
        if found.is_some() {
            return Ok(line);
        }
    }
    Err(Error::invalid(source.path(), Place::Line(number), "the end of the file", "`end_header`"))
}

fn too_long(path: &Path) -> Error {
    Error::limit(path, "a header of more than 1 MiB", "1 MiB (is `end_header` missing?)")
}

/// Reads the last line, `end_header`, and so finds where the tables start.
///
/// A carriage return and a line feed are ambiguous here: the line feed may end the line, or be the first byte
/// of a binary table after a lone carriage return. Tables of fixed size tell by the size of the file;
/// otherwise the line feed is the line's, unless all other lines end with a lone carriage return.
fn finish_header<R: Read>(
    source: &mut Source<R>,
    line_end: LineEnd,
    header: &Header,
    number: u64,
) -> Result<(), Error> {
    source.consume(END_HEADER.len());
    skip_blanks(source)?;
    source.want(2)?;
    match source.window() {
        [] => {}
        [b'\n', ..] => source.consume(1),
        [b'\r', b'\n', ..] => {
            let after_return = u128::from(source.left()).saturating_sub(1);
            let by_size =
                header.exact_bytes().filter(|&exact| exact == after_return || exact + 1 == after_return);
            let feed_is_data = by_size.map_or(line_end == LineEnd::Return, |exact| exact == after_return);
            source.consume(if feed_is_data && header.format != Format::Ascii { 1 } else { 2 });
        }
        [b'\r', ..] => source.consume(1),
        window => {
            let found = quoted(window);
            return Err(Error::invalid(
                source.path(),
                Place::Line(number),
                found,
                "the end of the line `end_header`",
            ));
        }
    }
    Ok(())
}

/// A header half read.
#[derive(Default)]
struct Parser {
    format: Option<Format>,
    elements: Vec<Element>,
    element_names: HashSet<String>,
    /// Names of the last element's properties.
    property_names: HashSet<String>,
    oriented: Option<bool>,
    trained: bool,
    origin: Option<DVec3>,
}

impl Parser {
    /// Takes a line, which has no blanks in front.
    fn line(&mut self, line: &[u8], path: &Path, number: u64) -> Result<(), Error> {
        let words: Vec<&[u8]> =
            line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).take(6).collect();
        let wrong = |expected: &str| Error::invalid(path, Place::Line(number), quoted(line), expected);
        match words[..] {
            [] | [b"obj_info", ..] => {}
            [b"comment", ref rest @ ..] => self.comment(rest),
            [b"format", format, version] => {
                if self.format.is_some() {
                    return Err(wrong("one `format` line only"));
                }
                if version != b"1.0" {
                    return Err(wrong("version 1.0"));
                }
                self.format = Some(match format {
                    b"ascii" => Format::Ascii,
                    b"binary_little_endian" => Format::BinaryLittleEndian,
                    b"binary_big_endian" => Format::BinaryBigEndian,
                    _ => return Err(wrong("`ascii`, `binary_little_endian` or `binary_big_endian`")),
                });
            }
            [b"element", name, count] => {
                let count = str::from_utf8(count).ok().and_then(|count| count.parse().ok());
                let count =
                    count.ok_or_else(|| wrong("`element NAME COUNT`, COUNT a whole number, 0 or more"))?;
                let name = String::from_utf8_lossy(name).into_owned();
                if !self.element_names.insert(name.clone()) {
                    return Err(wrong("every element declared once"));
                }
                self.property_names.clear();
                self.elements.push(Element { name, count, line: number, properties: Vec::new() });
            }
            [b"property", b"list", count, item, name] => {
                const EXPECTED: &str = "`property list COUNT_TYPE ITEM_TYPE NAME`, COUNT_TYPE a type of \
                                        whole numbers";
                let count = Scalar::from_name(count).filter(|count| count.range().is_some());
                let kind = count.zip(Scalar::from_name(item)).map(|(count, item)| Kind::List { count, item });
                self.property(name, kind.ok_or_else(|| wrong(EXPECTED))?).map_err(wrong)?;
            }
            [b"property", kind, name] => {
                const EXPECTED: &str = "`property TYPE NAME`, TYPE one of char uchar short ushort int uint \
                                        float double int8 uint8 int16 uint16 int32 uint32 float32 float64";
                let kind = Scalar::from_name(kind).map(Kind::Scalar);
                self.property(name, kind.ok_or_else(|| wrong(EXPECTED))?).map_err(wrong)?;
            }
            [b"format", ..] => return Err(wrong("`format NAME 1.0`")),
            [b"element", ..] => return Err(wrong("`element NAME COUNT`")),
            [b"property", ..] => {
                return Err(wrong("`property TYPE NAME` or `property list COUNT_TYPE ITEM_TYPE NAME`"));
            }
            _ => {
                return Err(wrong("`format`, `comment`, `obj_info`, `element`, `property` or `end_header`"));
            }
        }
        Ok(())
    }

    fn property(&mut self, name: &[u8], kind: Kind) -> Result<(), &'static str> {
        let name = String::from_utf8_lossy(name).into_owned();
        if !self.property_names.insert(name.clone()) {
            return Err("every property of an element declared once");
        }
        let element = self.elements.last_mut().ok_or("`element` before the first `property`")?;
        element.properties.push(Property { name, kind });
        Ok(())
    }

    /// Understands this crate's own comments; any other, or a damaged one, says nothing.
    fn comment(&mut self, words: &[&[u8]]) {
        match words {
            [b"splat", b"oriented", b"0"] => self.oriented = Some(false),
            [b"splat", b"oriented", b"1"] => self.oriented = Some(true),
            [b"splat", b"trained", b"1"] => self.trained = true,
            [b"splat", b"origin", x, y, z] => {
                let number = |word: &[u8]| Scalar::F64.parse(word).ok();
                let origin = number(x).zip(number(y)).zip(number(z));
                let origin = origin.map(|((x, y), z)| DVec3::new(x, y, z));
                self.origin = origin.filter(|origin| origin.is_finite());
            }
            _ => {}
        }
    }

    fn finish<R: Read>(&mut self, source: &Source<R>, number: u64) -> Result<Header, Error> {
        let format = self.format.ok_or_else(|| {
            Error::invalid(source.path(), Place::Line(number), "`end_header`", "a `format` line before it")
        })?;
        Ok(Header {
            format,
            elements: std::mem::take(&mut self.elements),
            next_line: number + 1,
            oriented: self.oriented,
            trained: self.trained,
            origin: self.origin,
        })
    }
}
