//! Tests of the reader and the writer together. The files are made here.

mod corpus;
mod damage;
mod headers;
mod meaning;
mod roundtrip;
mod trained;

use super::*;
use crate::table::Scalar;
use splat_core::Cloud;

/// The bytes of a number in a binary file.
pub(crate) fn encode(kind: Scalar, value: f64, big: bool) -> Vec<u8> {
    let mut bytes = match kind {
        Scalar::I8 => (value as i8).to_be_bytes().to_vec(),
        Scalar::U8 => (value as u8).to_be_bytes().to_vec(),
        Scalar::I16 => (value as i16).to_be_bytes().to_vec(),
        Scalar::U16 => (value as u16).to_be_bytes().to_vec(),
        Scalar::I32 => (value as i32).to_be_bytes().to_vec(),
        Scalar::U32 => (value as u32).to_be_bytes().to_vec(),
        Scalar::F32 => (value as f32).to_be_bytes().to_vec(),
        Scalar::F64 => value.to_be_bytes().to_vec(),
    };
    if !big {
        bytes.reverse();
    }
    bytes
}

/// A value of a table.
#[derive(Debug, Clone)]
enum Value {
    One(f64),
    Many(Vec<f64>),
}

impl From<f64> for Value {
    fn from(value: f64) -> Self {
        Self::One(value)
    }
}

impl<const N: usize> From<[f64; N]> for Value {
    fn from(values: [f64; N]) -> Self {
        Self::Many(values.to_vec())
    }
}

/// A table of a file to be made.
#[derive(Debug, Clone)]
struct Table {
    name: &'static str,
    /// As in the header: "float x", "list uchar int vertex_indices".
    properties: Vec<String>,
    rows: Vec<Vec<Value>>,
}

impl Table {
    fn new(name: &'static str, properties: &[&str], rows: Vec<Vec<Value>>) -> Self {
        Self { name, properties: properties.iter().map(|&property| property.to_owned()).collect(), rows }
    }

    /// A vertex table of plain numbers.
    fn vertex<const N: usize>(properties: [&str; N], rows: &[[f64; N]]) -> Self {
        let rows = rows.iter().map(|row| row.iter().map(|&value| Value::One(value)).collect()).collect();
        Self::new("vertex", &properties, rows)
    }

    /// A table of faces, lists of different lengths.
    fn faces() -> Self {
        let rows = vec![vec![[0.0, 1.0, 2.0].into(), 7.0.into()], vec![[].into(), 8.0.into()]];
        Self::new("face", &["list uchar int vertex_indices", "ushort flags"], rows)
    }
}

const FORMATS: [Format; 3] = [Format::Ascii, Format::BinaryLittleEndian, Format::BinaryBigEndian];

/// The header of such a file, with the given line end.
fn header(format: Format, tables: &[Table], end: &str) -> String {
    let name = match format {
        Format::Ascii => "ascii",
        Format::BinaryLittleEndian => "binary_little_endian",
        Format::BinaryBigEndian => "binary_big_endian",
    };
    let mut lines = vec!["ply".to_owned(), format!("format {name} 1.0"), "comment made by a test".to_owned()];
    for table in tables {
        lines.push(format!("element {} {}", table.name, table.rows.len()));
        lines.extend(table.properties.iter().map(|property| format!("property {property}")));
    }
    lines.push("end_header".to_owned());
    lines.iter().map(|line| format!("{line}{end}")).collect()
}

/// The tables of such a file.
fn body(format: Format, tables: &[Table]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for table in tables {
        for row in &table.rows {
            for (property, value) in table.properties.iter().zip(row) {
                let words: Vec<&str> = property.split(' ').collect();
                match value {
                    Value::One(value) => put(&mut bytes, format, words[0], *value),
                    Value::Many(values) => {
                        put(&mut bytes, format, words[1], values.len() as f64);
                        values.iter().for_each(|&value| put(&mut bytes, format, words[2], value));
                    }
                }
            }
            if format == Format::Ascii {
                bytes.push(b'\n');
            }
        }
    }
    bytes
}

fn put(bytes: &mut Vec<u8>, format: Format, kind: &str, value: f64) {
    let kind = Scalar::from_name(kind.as_bytes()).unwrap();
    match format {
        Format::Ascii if kind == Scalar::F32 => bytes.extend(format!("{} ", value as f32).bytes()),
        Format::Ascii => bytes.extend(format!("{value} ").bytes()),
        Format::BinaryLittleEndian => bytes.extend(encode(kind, value, false)),
        Format::BinaryBigEndian => bytes.extend(encode(kind, value, true)),
    }
}

fn file(format: Format, tables: &[Table]) -> Vec<u8> {
    let mut bytes = header(format, tables, "\n").into_bytes();
    bytes.extend(body(format, tables));
    bytes
}

fn read(bytes: &[u8]) -> Result<Import, Error> {
    read_ply_from(bytes, bytes.len() as u64, Path::new("x.ply"))
}

fn cloud(bytes: &[u8]) -> Cloud {
    read(bytes).unwrap_or_else(|error| panic!("{error}\n{}", String::from_utf8_lossy(bytes))).cloud
}

fn message(bytes: &[u8]) -> String {
    let message = read(bytes).unwrap_err().to_string();
    assert!(message.starts_with("x.ply: "), "{message}");
    message
}
