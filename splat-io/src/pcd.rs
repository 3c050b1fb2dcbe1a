//! PCD files, the clouds of the Point Cloud Library.
//!
//! Read are versions 0.5 to 0.7, as text, binary or compressed, with the fields in any order and of any type. Fields are
//! found by name as the properties of PLY files are (`normal_x`, `curvature` ..); `rgb` and `rgba` are three
//! 8-bit sRGB channels packed in one number, whose alpha, which few programs set, is passed over. Fields of more than
//! one value a point, and 64-bit integers, are not read. Points of organised clouds that are not numbers stay in their
//! places, and are not drawn.

mod header;
mod lzf;
#[cfg(test)]
mod tests;

use crate::error::quoted;
use crate::table::{Columns, Element, Hints, Kind, Outcome, Property, Row, SLOTS, Scalar};
use crate::whole_file::{bytes_at, read_whole, sha256};
use crate::{ElementReport, Error, Import, ImportReport, Loss, Place, PropertyReport, Usage};
use header::{Data, Field, Header, Type};
use std::borrow::Cow;
use std::path::Path;

/// Reads a cloud from a PCD file. See the [module](self) for what is understood.
///
/// # Errors
/// [`Error::Io`]; [`Error::Invalid`] for anything malformed, truncated, or claiming more points than the file can hold;
/// [`Error::Limit`] for 2^32 - 1 points or more, or more than memory.
pub fn read_pcd(path: &Path) -> Result<Import, Error> {
    let has_header = |head: &[u8], path: &Path| Header::read(head, path).map(drop);
    read_pcd_from(&read_whole(path, has_header)?, path)
}

/// Reads a cloud from the bytes of a PCD file; `path` is its name in messages.
///
/// # Errors
/// As [`read_pcd`].
pub fn read_pcd_from(bytes: &[u8], path: &Path) -> Result<Import, Error> {
    let header = Header::read(bytes, path)?;
    let used: Vec<Column> =
        header.fields.iter().enumerate().flat_map(|(i, field)| columns(i, field)).collect();
    let properties = used
        .iter()
        .map(|column| Property { name: column.name.clone(), kind: Kind::Scalar(column.kind) })
        .collect();
    let element =
        Element { name: "points".to_owned(), count: header.points, line: header.fields_line, properties };
    let body = Body::open(bytes, &header, path)?;
    let mut table = Columns::new(&element, path)?;
    let slots: Vec<Option<usize>> = table.roles.slots.clone();
    let used: Vec<(Column, usize)> =
        used.into_iter().zip(slots).filter_map(|(column, slot)| Some((column, slot?))).collect();
    let more = match &body {
        Body::Text(text) => read_text(text, &header, &used, &mut table, path)?,
        Body::Binary { rows, places, more } => {
            read_binary(rows, places, &header, &used, &mut table);
            more.clone()
        }
    };
    let mut outcome = table.finish(Hints::default());
    let mut assumptions = std::mem::take(&mut outcome.assumptions);
    assumptions.append(&mut outcome.color_assumptions);
    let [x, y, z, w, i, j, k] = header.viewpoint;
    if header.viewpoint != header::NO_VIEWPOINT {
        assumptions
            .push(format!("the scanner's place ({x}, {y}, {z}) and turn ({w}, {i}, {j}, {k}) are not used"));
    }
    if header.width > 1 && header.height > 1 {
        assumptions.push(format!("the cloud is a grid of {} x {} points", header.width, header.height));
    }
    let report = ImportReport {
        path: path.to_owned(),
        format: format!("PCD, {}", header.data.describe()),
        bytes: bytes.len() as u64,
        sha256: sha256(bytes),
        elements: vec![report(&header, &element, &outcome)],
        assumptions,
        losses: outcome.losses.into_iter().chain(more).collect(),
    };
    Ok(Import { cloud: outcome.cloud, report })
}

/// A column of the table of points: a field, or a channel of a packed colour.
struct Column {
    name: String,
    kind: Scalar,
    /// Index of the field.
    field: usize,
    /// By how many bits a channel is shifted in a packed colour.
    shift: Option<u32>,
}

/// The columns that a field makes: three of a packed colour, none if it cannot be read.
fn columns(index: usize, field: &Field) -> Vec<Column> {
    let Some(Type::Scalar(kind)) = field.kind.filter(|_| field.count == 1 && !field.is_padding()) else {
        return Vec::new();
    };
    if is_packed(field) {
        let channels = [("red", 16), ("green", 8), ("blue", 0)];
        let column = |(name, shift): (&str, u32)| Column {
            name: name.to_owned(),
            kind: Scalar::U8,
            field: index,
            shift: Some(shift),
        };
        return channels.map(column).into();
    }
    vec![Column { name: field.name.clone(), kind, field: index, shift: None }]
}

fn is_packed(field: &Field) -> bool {
    ["rgb", "rgba"].contains(&field.name.as_str()) && field.bytes == 4
}

/// What stands behind the header.
enum Body<'a> {
    Text(&'a [u8]),
    /// Rows of the fields' numbers.
    Binary {
        rows: Cow<'a, [u8]>,
        /// Of each field: where its first number is, and from each to the next one, in bytes.
        places: Vec<(usize, usize)>,
        /// What stands behind the last row.
        more: Option<Loss>,
    },
}

impl<'a> Body<'a> {
    /// Finds the points, and holds their number against the file's size.
    fn open(bytes: &'a [u8], header: &Header, path: &Path) -> Result<Self, Error> {
        let body = &bytes[header.body..];
        let row_bytes = header.row_bytes();
        let claimed = u128::from(header.points) * row_bytes as u128;
        let too_few = |found: String, at: usize| {
            let expected = format!("{} points of {row_bytes} bytes", header.points);
            Err(Error::invalid(path, Place::Byte(at as u64), found, expected))
        };
        match header.data {
            Data::Text => {
                // A number and what ends it take two bytes; the last number may lack its end.
                let least = u128::from(header.points) * 2 * header.fields.len() as u128;
                if least > body.len() as u128 + 1 {
                    return too_few(format!("{} bytes of text", body.len()), header.body);
                }
                Ok(Self::Text(body))
            }
            Data::Binary => {
                if claimed > body.len() as u128 {
                    return too_few(format!("{} bytes", body.len()), header.body);
                }
                let starts = header.fields.iter().scan(0, |end, field| {
                    let start = *end;
                    *end += field.bytes * field.count;
                    Some((start, row_bytes))
                });
                let (rows, more) = body.split_at(claimed as usize);
                let more = behind(more, header.body + rows.len());
                Ok(Self::Binary { rows: Cow::Borrowed(rows), places: starts.collect(), more })
            }
            Data::Compressed => {
                let sizes = bytes_at::<4>(body, 0).zip(bytes_at::<4>(body, 4));
                let Some((packed, whole)) =
                    sizes.map(|(packed, whole)| (u32::from_le_bytes(packed), u32::from_le_bytes(whole)))
                else {
                    return too_few(format!("{} bytes", body.len()), header.body);
                };
                let Some((packed, more)) = body[8..].split_at_checked(packed as usize) else {
                    return too_few(
                        format!("{} bytes, of {packed} compressed ones", body.len()),
                        header.body,
                    );
                };
                // Padding is not compressed.
                let fields = header.fields.iter();
                let sizes =
                    fields.map(|field| if field.is_padding() { 0 } else { field.bytes * field.count });
                let claimed = u128::from(header.points) * sizes.clone().sum::<usize>() as u128;
                if claimed != u128::from(whole) {
                    return too_few(format!("{whole} bytes when decompressed"), header.body + 4);
                }
                let Some(rows) = lzf::decompress(packed, whole as usize) else {
                    return too_few("damaged compressed bytes".to_owned(), header.body + 8);
                };
                // All numbers of the first field come first, then those of the second.
                let points = header.points as usize;
                let places = sizes.zip(&header.fields).scan(0, |end, (size, field)| {
                    let start = *end;
                    *end += size * points;
                    Some((start, field.bytes * field.count))
                });
                let more = behind(more, header.body + 8 + packed.len());
                Ok(Self::Binary { places: places.collect(), rows: Cow::Owned(rows), more })
            }
        }
    }
}

/// Bytes behind the points, from this byte of the file on.
fn behind(more: &[u8], start: usize) -> Option<Loss> {
    Loss::new("bytes behind the last point", more.len() as u64, format!("byte {start}"))
}

fn read_binary(
    rows: &[u8],
    places: &[(usize, usize)],
    header: &Header,
    used: &[(Column, usize)],
    table: &mut Columns,
) {
    let mut values: Row = [0.0; SLOTS];
    for row in 0..header.points as usize {
        for (column, slot) in used {
            let (start, step) = places[column.field];
            let number = &rows[start + row * step..];
            values[*slot] = match column.shift {
                Some(shift) => channel(Scalar::U32.decode::<false>(number) as u32, shift),
                None => column.kind.decode::<false>(number),
            };
        }
        table.push(&values);
    }
}

/// A channel of a packed colour, 0 to 255.
fn channel(packed: u32, shift: u32) -> f64 {
    f64::from(packed >> shift & 255)
}

fn read_text(
    text: &[u8],
    header: &Header,
    used: &[(Column, usize)],
    table: &mut Columns,
    path: &Path,
) -> Result<Option<Loss>, Error> {
    let width: usize = header.fields.iter().map(|field| field.count).sum();
    let starts: Vec<usize> = header
        .fields
        .iter()
        .scan(0, |end, field| {
            let start = *end;
            *end += field.count;
            Some(start)
        })
        .collect();
    let mut lines = (header.data_line + 1..).zip(text.split(|&byte| byte == b'\n'));
    let mut values: Row = [0.0; SLOTS];
    let mut words: Vec<&[u8]> = Vec::new();
    for row in 0..header.points {
        let line = lines.find(|(_, line)| !line.trim_ascii().is_empty());
        let Some((number, line)) = line else {
            let expected = format!("row {row} of {} points", header.points);
            return Err(Error::invalid(path, Place::File, "the end of the file", expected));
        };
        let invalid =
            |found: String, expected: String| Err(Error::invalid(path, Place::Line(number), found, expected));
        words.clear();
        words.extend(line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).take(width + 1));
        if words.len() != width {
            let found = if words.len() > width {
                "more numbers".to_owned()
            } else {
                format!("{} numbers", words.len())
            };
            return invalid(found, format!("{width}, as FIELDS and COUNT say"));
        }
        for (column, slot) in used {
            let field = &header.fields[column.field];
            let word = words[starts[column.field]];
            let value = match (column.shift, field.kind) {
                (Some(shift), Some(Type::Scalar(Scalar::F32))) => {
                    Scalar::F32.parse(word).map(|value| channel((value as f32).to_bits(), shift))
                }
                (Some(shift), _) => Scalar::I32
                    .parse(word)
                    .map(|value| value as i32 as u32)
                    .or_else(|_| Scalar::U32.parse(word).map(|value| value as u32))
                    .map(|packed| channel(packed, shift)),
                (None, _) => column.kind.parse(word),
            };
            match value {
                Ok(value) => values[*slot] = value,
                Err(expected) => return invalid(quoted(word), format!("{expected} for {}", field.name)),
            }
        }
        table.push(&values);
    }
    let mut more = lines.filter(|(_, line)| !line.trim_ascii().is_empty());
    let first = more.next().map(|(number, _)| number);
    Ok(first.and_then(|line| {
        Loss::new("lines behind the last point", 1 + more.count() as u64, format!("line {line}"))
    }))
}

/// What is said of the fields.
fn report(header: &Header, element: &Element, outcome: &Outcome) -> ElementReport {
    let mut usages = outcome.usages.iter();
    let property = |(index, field): (usize, &Field)| {
        // A packed colour has three columns of one use.
        let usage = columns(index, field).iter().map_while(|_| usages.next()).last().copied();
        let reason = if field.is_padding() {
            "padding"
        } else if field.count != 1 {
            "several values a point"
        } else {
            "a type that is not read"
        };
        PropertyReport {
            name: field.name.clone(),
            kind: field.describe(),
            usage: usage.unwrap_or(Usage::Unused(reason)),
        }
    };
    ElementReport {
        name: element.name.clone(),
        count: element.count,
        is_points: true,
        properties: header.fields.iter().enumerate().map(property).collect(),
    }
}
