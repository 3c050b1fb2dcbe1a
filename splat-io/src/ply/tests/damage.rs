//! Damaged and lying files: an error that says what is wrong, never a panic, never much memory or time.

use super::*;
use proptest::prelude::*;
use std::time::{Duration, Instant};

/// A small file with everything in it.
fn sample(format: Format) -> Vec<u8> {
    let row = |i: f64| {
        vec![
            i.into(),
            (i + 1.5).into(),
            [i, i].into(),
            (-i).into(),
            0.0.into(),
            1.0.into(),
            0.0.into(),
            200.0.into(),
        ]
    };
    let properties = [
        "float x",
        "double y",
        "list uchar short weights",
        "int z",
        "float nx",
        "float ny",
        "float nz",
        "uchar radius",
    ];
    let vertices = Table::new("vertex", &properties, vec![row(1.0), row(2.0), row(3.0)]);
    file(format, &[Table::faces(), vertices, Table::faces_named("tail")])
}

impl Table {
    fn faces_named(name: &'static str) -> Self {
        Self { name, ..Self::faces() }
    }
}

#[test]
fn a_file_cut_off_anywhere_is_an_error_or_has_all_its_points() {
    for format in FORMATS {
        let bytes = sample(format);
        let whole = read(&bytes).unwrap();
        // The last number of the last point, of which an ASCII file may lose a digit unnoticed.
        let tail = body(format, &[Table::faces_named("tail")]).len();
        for length in 0..bytes.len() {
            match read(&bytes[..length]) {
                Ok(import) => {
                    assert_eq!(import.cloud.len(), whole.cloud.len());
                    assert!(length + tail + 4 >= bytes.len(), "{format:?} {length}");
                }
                Err(error) => assert!(!error.to_string().is_empty()),
            }
            // The file system may have promised more than there is.
            let lied = read_ply_from(&bytes[..length], bytes.len() as u64, Path::new("x.ply"));
            assert!(lied.is_err() || length + tail + 4 >= bytes.len(), "{format:?} {length}");
        }
    }
}

#[test]
fn truncation_names_the_row_and_the_byte_or_line() {
    let bytes = sample(Format::BinaryLittleEndian);
    let cut = bytes.len() - body(Format::BinaryLittleEndian, &[Table::faces_named("tail")]).len() - 1;
    let error = read_ply_from(&bytes[..cut], bytes.len() as u64, Path::new("x.ply")).unwrap_err().to_string();
    assert_eq!(
        error,
        format!("x.ply: row 2 of element vertex, byte {cut}: found the end of the file, expected 3 rows")
    );

    let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                property float z\nend_header\n1 1 1\n22222 22 22\n";
    assert_eq!(
        message(text.as_bytes()),
        "x.ply: line 10: found the end of the file, expected row 2 of the 3 rows of element vertex"
    );
}

#[test]
fn wrong_text_names_line_word_and_property() {
    let text = |row: &str| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty uchar y\nproperty float z\n\
             end_header\n1.00000000 1 1\n{row}\n"
        )
    };
    for (row, expected) in [
        ("a 2 3", "line 9: found `a`, expected a number for property x of row 1 of element vertex"),
        ("1 256 3", "line 9: found `256`, expected a whole number, 0 to 255 for property y of row 1"),
        ("1 -1 3", "line 9: found `-1`, expected a whole number, 0 to 255"),
        ("1 2.5 3", "line 9: found `2.5`, expected a whole number, 0 to 255"),
        ("1 nan 3", "line 9: found `nan`, expected a whole number, 0 to 255"),
        ("1 2", "line 9: found the end of the line, expected property z of row 1 of element vertex"),
        ("1 2 3 4", "line 9: found `4`, expected the end of row 1 of element vertex"),
        ("1 2 \u{7f}\u{e9}", "line 9: found `\\x7f\\xc3\\xa9`"),
    ] {
        let message = message(text(row).as_bytes());
        assert!(message.contains(expected), "{message}");
    }
    let long = message(text(&format!("1 2 {}", "9".repeat(2_000_000))).as_bytes());
    assert!(long.contains("a number of at most") && long.len() < 200, "{long}");
}

#[test]
fn an_absurd_claim_fails_at_once() {
    let xyz = "property float x\nproperty float y\nproperty float z\n";
    let list = "property list uchar int i\n";
    let elements = [
        (format!("element vertex 1000000000\n{xyz}"), "element vertex of 1000000000 rows, at least "),
        (format!("element vertex 4294967295\n{xyz}"), "4294967295 points is beyond the limit"),
        (format!("element vertex 18446744073709551615\n{xyz}"), "beyond the limit"),
        (format!("element vertex 4000000000\n{list}{xyz}"), "element vertex of 4000000000 rows"),
        (
            format!("element face 18446744073709551615\n{list}element vertex 1\n{xyz}"),
            "line 3: found element face of 18446744073709551615 rows, at least ",
        ),
        (
            format!("element face 18446744073709551615\nproperty double d\nelement vertex 1\n{xyz}"),
            "line 3: found element face of 18446744073709551615 rows, at least ",
        ),
    ];
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for (element, expected) in &elements {
            let text = format!("ply\nformat {format} 1.0\n{element}end_header\n1 2 3\n1 2 3\n");
            let start = Instant::now();
            let message = message(text.as_bytes());
            assert!(start.elapsed() < Duration::from_millis(100));
            assert!(message.contains(expected), "{message}");
        }
        // Rows of nothing take no room and no time.
        let text = format!(
            "ply\nformat {format} 1.0\nelement nothing 18446744073709551615\nelement vertex 0\n\
             {xyz}end_header\n"
        );
        assert!(cloud(text.as_bytes()).is_empty());
    }
    let claim = message(
        format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex 1000000000\n{xyz}end_header\n0123456789ab"
        )
        .as_bytes(),
    );
    assert!(
        claim.ends_with("expected at most 1 rows: the file of 136 bytes has 12 left for them"),
        "{claim}"
    );
}

#[test]
fn an_absurd_list_fails_at_once() {
    let header = "element vertex 1\nproperty list int double i\nproperty float x\nproperty float y\n\
                  property float z\nend_header\n";
    for length in [i32::MAX, -1, 3] {
        let text = format!("ply\nformat binary_big_endian 1.0\n{header}");
        let bytes = [text.as_bytes(), &length.to_be_bytes(), &[0; 12]].concat();
        assert!(message(&bytes).contains(&format!("found a list of {length} entries, expected 0 to 1")));
        let message = message(format!("ply\nformat ascii 1.0\n{header}{length} 1 2 3\n").as_bytes());
        let expected = if length < 0 {
            "line 9: found a list of -1 entries"
        } else {
            "line 9: found the end of the line"
        };
        assert!(message.contains(expected), "{message}");
    }
}

proptest! {
    #[test]
    fn damaged_bytes_never_panic(
        format in 0..3_usize,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        cut in any::<prop::sample::Index>(),
        is_cut in any::<bool>(),
    ) {
        let mut bytes = sample(FORMATS[format]);
        for (place, value) in changes {
            let place = place.index(bytes.len());
            bytes[place] = value;
        }
        if is_cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        if let Ok(import) = read(&bytes) {
            prop_assert_eq!(import.cloud.check_lengths(), Ok(()));
            prop_assert!(import.cloud.len() <= bytes.len());
        }
    }

    #[test]
    fn any_words_after_the_header_never_panic(
        format in 0..3_usize,
        words in prop::collection::vec("[-+0-9.einaf#\r\n\t x]{0,12}", 0..40),
    ) {
        let table = Table::new("vertex", &["float x", "uchar y", "list uchar int l", "double z"], vec![]);
        let header = header(FORMATS[format], &[table], "\n").replace("vertex 0", "vertex 2");
        let bytes = [header.into_bytes(), words.join(" ").into_bytes()].concat();
        if let Ok(import) = read(&bytes) {
            prop_assert_eq!(import.cloud.len(), 2);
        }
    }
}
