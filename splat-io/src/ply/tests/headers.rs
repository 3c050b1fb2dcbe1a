//! Headers as they come: line ends, blanks, orders, spellings.

use super::*;
use glam::Vec3;

const XYZ: [&str; 3] = ["float x", "float y", "float z"];

fn expected() -> Vec<Vec3> {
    vec![Vec3::new(1.0, 2.0, 3.0), Vec3::new(-4.0, 0.5, 1.5), Vec3::new(0.25, -7.0, 100.0)]
}

fn rows() -> Vec<[f64; 3]> {
    expected().iter().map(|p| p.to_array().map(f64::from)).collect()
}

#[test]
fn every_format_type_and_order_gives_the_same_cloud() {
    // Whole numbers, so that every type can hold them.
    let rows = [[1.0, 2.0, 3.0], [100.0, 0.0, 7.0], [5.0, 6.0, 127.0]];
    let reference = cloud(&file(Format::Ascii, &[Table::vertex(XYZ, &rows)]));
    assert_eq!(reference.positions.len(), 3);
    for format in FORMATS {
        for kind in Scalar::ALL {
            for spelling in kind.names() {
                for order in [[0, 1, 2], [2, 0, 1], [1, 2, 0], [2, 1, 0]] {
                    let names = order.map(|axis| format!("{spelling} {}", ["x", "y", "z"][axis]));
                    let shuffled: Vec<[f64; 3]> =
                        rows.iter().map(|row| order.map(|axis| row[axis])).collect();
                    let names = names.each_ref().map(String::as_str);
                    let faces = Table::faces();
                    let vertices = Table::vertex(names, &shuffled);
                    for tables in [vec![vertices.clone(), faces.clone()], vec![faces, vertices]] {
                        assert_eq!(cloud(&file(format, &tables)), reference, "{format:?} {names:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn lists_and_unknown_properties_are_skipped_anywhere() {
    let list = |values: &[f64]| Value::Many(values.to_vec());
    let row = |index: usize| {
        let [x, y, z] = rows()[index];
        let before = list(&[1.0; 300][..index * 150]);
        vec![before, x.into(), list(&[]), y.into(), 9.0.into(), z.into(), list(&[2.0, 3.0][..index])]
    };
    let properties = [
        "list ushort double first",
        "float x",
        "list char uchar second",
        "double y",
        "int unknown",
        "float z",
        "list int float last",
    ];
    let table = Table::new("vertex", &properties, (0..3).map(row).collect());
    for format in FORMATS {
        let import =
            read(&file(format, &[Table::faces(), table.clone(), Table::new("edge", &[], vec![])])).unwrap();
        assert_eq!(import.cloud.positions, expected());
        assert_eq!(import.report.elements.len(), 3);
        assert_eq!(import.report.elements[1].properties[0].kind, "list ushort double");
        assert_eq!(import.report.elements[1].properties[0].usage, Usage::Unused("a list"));
        assert_eq!(import.report.elements[1].properties[3].usage, Usage::Position);
        assert_eq!(import.report.elements[1].properties[4].usage, Usage::Field);
    }
}

#[test]
fn lines_end_in_any_way() {
    let table = Table::vertex(XYZ, &rows());
    for format in FORMATS {
        for end in ["\n", "\r\n", "\r", " \t\n", " \r\n"] {
            let mut bytes = header(format, std::slice::from_ref(&table), end).into_bytes();
            let mut body = body(format, std::slice::from_ref(&table));
            if format == Format::Ascii {
                let text = String::from_utf8(body).unwrap().replace('\n', end);
                body = text.into_bytes();
            }
            bytes.extend(body);
            assert_eq!(cloud(&bytes).positions, expected(), "{format:?} {end:?}");
        }
    }
}

#[test]
fn a_table_may_start_with_a_line_feed_or_a_blank() {
    for first in [b'\n', b'\r', b' ', b'\t'] {
        let x = f32::from_le_bytes([first, b'\n', first, 0x40]);
        let mut rows = rows();
        rows[0][0] = f64::from(x);
        let vertices = Table::vertex(XYZ, &rows);
        for tables in [vec![vertices.clone()], vec![vertices.clone(), Table::faces()]] {
            let body = body(Format::BinaryLittleEndian, &tables);
            for end in ["\n", "\r\n", "\r"] {
                let header = header(Format::BinaryLittleEndian, &tables, end);
                // With faces the size does not tell; the other lines do.
                let bytes = [header.as_bytes(), &body].concat();
                assert_eq!(cloud(&bytes).positions[0].x, x, "{end:?} {first}");
            }
            // Lines end with a line feed, the last one with a carriage return as well, or alone.
            let header = header(Format::BinaryLittleEndian, &tables, "\n");
            let crlf = header.replace("end_header\n", "end_header\r\n");
            assert_eq!(cloud(&[crlf.as_bytes(), &body].concat()).positions[0].x, x);
            let cr = header.replace("end_header\n", "end_header\r");
            if first != b'\n' || tables.len() == 1 {
                assert_eq!(cloud(&[cr.as_bytes(), &body].concat()).positions[0].x, x);
            }
        }
    }
}

#[test]
fn text_rows_are_loose() {
    let text = "ply \r\nformat ascii 1.0\t\r\n\r\n  comment  odd   blanks\r\nobj_info\r\n\
                element  vertex\t3 \r\nproperty float x\r\n\tproperty float32 y\r\nproperty float z  \r\n\
                end_header \r\n\
                \t 1\t2  3 \r\n\r\n   \n-4 .5 1.5e0\r\n+0.25 -7. 1E2";
    assert_eq!(cloud(text.as_bytes()).positions, expected());
}

#[test]
fn the_table_of_points_is_called_vertex_or_point() {
    let mut table = Table::vertex(XYZ, &rows());
    table.name = "point";
    let other = Table::new("vertex", &["float x", "float y", "float z"], vec![]);
    for format in FORMATS {
        assert_eq!(cloud(&file(format, &[Table::faces(), table.clone()])).positions, expected());
        assert!(cloud(&file(format, &[table.clone(), other.clone()])).is_empty());
    }
}

#[test]
fn a_cloud_may_be_empty() {
    for format in FORMATS {
        let import = read(&file(format, &[Table::new("vertex", &XYZ, vec![])])).unwrap();
        assert!(import.cloud.is_empty());
        assert_eq!(import.cloud.check_lengths(), Ok(()));
    }
}

#[test]
fn comments_may_be_long_but_not_endless() {
    let table = Table::vertex(XYZ, &rows());
    for length in [100, 300_000, 1_000_000] {
        let comment = format!("comment {}\nelement", "x".repeat(length));
        let header = header(Format::BinaryBigEndian, std::slice::from_ref(&table), "\n");
        let header = header.replacen("element", &comment, 1);
        let bytes =
            [header.as_bytes(), &body(Format::BinaryBigEndian, std::slice::from_ref(&table))].concat();
        assert_eq!(cloud(&bytes).positions, expected());
    }
    for filler in ["x", "x\n", " ", "\ncomment", "\n"] {
        let endless = format!("ply\nformat ascii 1.0\ncomment {}", filler.repeat(2 << 20));
        let message = message(endless.as_bytes());
        assert!(message.contains("1 MiB") || message.contains("line 4"), "{message}");
    }
}

#[test]
fn wrong_headers_are_refused_by_line() {
    let head =
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
    let good = format!("{head}end_header\n1 2 3\n");
    assert_eq!(cloud(good.as_bytes()).len(), 1);
    let cases = [
        ("ply", "PLY", "byte 0: found `PLY"),
        ("ply", "plyx", "line 1: found `x"),
        ("format ascii 1.0\n", "", "line 6: found `end_header`, expected a `format` line"),
        ("ascii", "text", "line 2: found `format text 1.0`, expected `ascii`"),
        ("1.0", "2.0", "line 2: found `format ascii 2.0`, expected version 1.0"),
        ("1.0", "1.0\nformat ascii 1.0", "line 3: found `format ascii 1.0`, expected one"),
        ("vertex 1", "vertex", "line 3: found `element vertex`, expected `element NAME COUNT`"),
        ("vertex 1", "vertex -1", "COUNT a whole number"),
        ("vertex 1", "vertex 99999999999999999999", "COUNT a whole number"),
        (
            "float x",
            "half x",
            "line 4: found `property half x`, expected `property TYPE NAME`, TYPE one of char",
        ),
        ("float y", "list float int y", "COUNT_TYPE a type of whole numbers"),
        ("float y", "float x", "line 5: found `property float x`, expected every property"),
        ("float z", "float z\nelement vertex 3", "line 7: found `element vertex 3`, expected every element"),
        ("float z", "float z\nbanana", "line 7: found `banana`, expected `format`, `comment`"),
        ("element vertex 1\n", "", "expected `element` before the first `property`"),
        ("end_header\n", "end_headers\n", "line 7: found `end_headers`"),
        ("end_header\n1 2 3\n", "", "line 7: found the end of the file, expected `end_header`"),
        ("end_header\n", "end_header 1\n", "line 7: found `1"),
        ("vertex", "vertices", "whole file: found only `vertices`, expected an element named `vertex`"),
        ("property float z\n", "", "line 3: found the properties x, y, expected the numbers x, y and z"),
        ("float z", "list uchar float z", "found the properties x, y, z, expected the numbers x, y and z"),
    ];
    for (from, to, expected) in cases {
        let message = message(good.replacen(from, to, 1).as_bytes());
        assert!(message.contains(expected), "{from} -> {to}: {message}");
    }
    assert!(message(b"").contains("an empty file"));
    assert!(message(b"ply\nformat ascii 1.0\nend_header\n").contains("found no element"));
    let none = message(b"ply\nformat ascii 1.0\nelement vertex 0\nend_header\n");
    assert!(none.contains("found no property"), "{none}");
}
