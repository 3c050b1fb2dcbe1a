//! Tables in binary, either endian.

use super::faces::{Faces, List};
use super::header::Header;
use super::rows::{Rows, Table, Tables};
use crate::source::Source;
use crate::table::{Element, Kind, Scalar};
use crate::{Error, Place};
use std::io::Read;

/// Reads the tables that are wanted; what follows the last of them is left alone.
pub(super) fn read<R: Read, const BIG: bool>(
    source: &mut Source<R>,
    header: &Header,
    tables: &mut impl Tables,
) -> Result<(), Error> {
    for (index, element) in header.elements[..tables.end()].iter().enumerate() {
        match tables.table(index) {
            Table::Rows(rows) if element.is_fixed() => read_fixed::<R, BIG>(source, element, rows)?,
            Table::Rows(rows) => read_varying::<R, BIG>(source, element, rows)?,
            Table::Faces(faces) => read_faces::<R, BIG>(source, element, faces)?,
            Table::Skipped => skip::<R, BIG>(source, element)?,
        }
    }
    Ok(())
}

/// Reads rows that all have the same size: whole windows at a time.
fn read_fixed<R: Read, const BIG: bool>(
    source: &mut Source<R>,
    element: &Element,
    taker: &mut dyn Rows,
) -> Result<(), Error> {
    let row_bytes = element.least_bytes();
    let mut fields: Vec<(usize, Scalar, usize)> = Vec::new();
    let mut offset = 0;
    for (property, slot) in element.properties.iter().zip(taker.slots()) {
        if let Kind::Scalar(kind) = property.kind {
            fields.extend(slot.map(|slot| (offset, kind, slot)));
            offset += kind.bytes();
        }
    }
    let count = taker.count();
    let mut values = vec![0.0; taker.width()];
    let mut done = 0;
    while done < count {
        if !source.want(row_bytes)? {
            return Err(cut_off(source, element, done as u64));
        }
        let window = source.window();
        let rows = (window.len() / row_bytes).min(count - done);
        for row in window[..rows * row_bytes].chunks_exact(row_bytes) {
            for &(offset, kind, slot) in &fields {
                values[slot] = kind.decode::<BIG>(&row[offset..]);
            }
            taker.push(&values);
        }
        source.consume(rows * row_bytes);
        done += rows;
    }
    Ok(())
}

/// Reads rows with lists in them, which are skipped.
fn read_varying<R: Read, const BIG: bool>(
    source: &mut Source<R>,
    element: &Element,
    taker: &mut dyn Rows,
) -> Result<(), Error> {
    let mut values = vec![0.0; taker.width()];
    for row in 0..taker.count() {
        for (property, slot) in element.properties.iter().zip(taker.slots()) {
            match property.kind {
                Kind::Scalar(kind) => {
                    let value = scalar::<R, BIG>(source, kind, element, row as u64)?;
                    if let Some(slot) = *slot {
                        values[slot] = value;
                    }
                }
                Kind::List { count, item } => skip_list::<R, BIG>(source, count, item, element, row as u64)?,
            }
        }
        taker.push(&values);
    }
    Ok(())
}

/// Reads the table of faces.
fn read_faces<R: Read, const BIG: bool>(
    source: &mut Source<R>,
    element: &Element,
    faces: &mut Faces,
) -> Result<(), Error> {
    for row in 0..element.count {
        let byte = source.offset();
        faces.start_row();
        for (index, property) in element.properties.iter().enumerate() {
            match (property.kind, faces.list(index)) {
                (Kind::Scalar(kind), _) => _ = scalar::<R, BIG>(source, kind, element, row)?,
                (Kind::List { count, item }, List::Skipped) => {
                    skip_list::<R, BIG>(source, count, item, element, row)?;
                }
                (Kind::List { count, item }, list) => {
                    for _ in 0..list_length::<R, BIG>(source, count, item, element, row)? {
                        faces.value(list, scalar::<R, BIG>(source, item, element, row)?);
                    }
                }
            }
        }
        faces.end_row(source.path(), || Place::Row { element: element.name.clone(), row, byte })?;
    }
    Ok(())
}

/// Skips a table.
fn skip<R: Read, const BIG: bool>(source: &mut Source<R>, element: &Element) -> Result<(), Error> {
    if element.is_fixed() {
        // Fits: the claims were checked against the file's size.
        let bytes = element.count.saturating_mul(element.least_bytes() as u64);
        return if source.skip(bytes)? { Ok(()) } else { Err(cut_off(source, element, element.count)) };
    }
    for row in 0..element.count {
        for property in &element.properties {
            match property.kind {
                Kind::Scalar(kind) => _ = scalar::<R, BIG>(source, kind, element, row)?,
                Kind::List { count, item } => skip_list::<R, BIG>(source, count, item, element, row)?,
            }
        }
    }
    Ok(())
}

#[inline]
fn scalar<R: Read, const BIG: bool>(
    source: &mut Source<R>,
    kind: Scalar,
    element: &Element,
    row: u64,
) -> Result<f64, Error> {
    if !source.want(kind.bytes())? {
        return Err(cut_off(source, element, row));
    }
    let value = kind.decode::<BIG>(source.window());
    source.consume(kind.bytes());
    Ok(value)
}

fn skip_list<R: Read, const BIG: bool>(
    source: &mut Source<R>,
    count: Scalar,
    item: Scalar,
    element: &Element,
    row: u64,
) -> Result<(), Error> {
    let length = list_length::<R, BIG>(source, count, item, element, row)?;
    if source.skip(length * item.bytes() as u64)? { Ok(()) } else { Err(cut_off(source, element, row)) }
}

/// Reads the length of a list, and holds it against what the file has left.
fn list_length<R: Read, const BIG: bool>(
    source: &mut Source<R>,
    count: Scalar,
    item: Scalar,
    element: &Element,
    row: u64,
) -> Result<u64, Error> {
    let byte = source.offset();
    let length = scalar::<R, BIG>(source, count, element, row)?;
    let most = source.left() / item.bytes() as u64;
    if length < 0.0 || length > most as f64 {
        let place = Place::Row { element: element.name.clone(), row, byte };
        let found = format!("a list of {length} entries");
        return Err(Error::invalid(
            source.path(),
            place,
            found,
            format!("0 to {most}, what the file has left"),
        ));
    }
    Ok(length as u64)
}

/// The file ends in a row.
fn cut_off<R: Read>(source: &Source<R>, element: &Element, row: u64) -> Error {
    let byte = source.offset() + source.window().len() as u64;
    let place = Place::Row { element: element.name.clone(), row, byte };
    Error::invalid(source.path(), place, "the end of the file", format!("{} rows", element.count))
}
