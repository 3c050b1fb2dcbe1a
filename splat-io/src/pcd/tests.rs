//! PCD files of every kind, made here.

use super::*;
use glam::Vec3;

fn read(bytes: &[u8]) -> Result<Import, Error> {
    read_pcd_from(bytes, Path::new("a.pcd"))
}

/// Rows of x y z (float), rgb (packed), a padding byte, an index (short), three numbers, intensity (double).
const ROWS: [(Vec3, u32, i16, f64); 4] = [
    (Vec3::new(1.0, 2.0, 3.0), 0xff10_20ff, -7, 0.5),
    (Vec3::new(1.0, 2.0, 4.0), 0x0010_2000, 8, 0.25),
    (Vec3::NAN, 0x0080_8080, 9, 1e300),
    (Vec3::new(1.0, 2.0, 5.0), 0x00ff_ffff, 10, -0.5),
];

fn header(rgb: char, data: &str) -> String {
    format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z rgb _ index hist intensity\n\
         SIZE 4 4 4 4 1 2 4 8\nTYPE F F F {rgb} U I F F\nCOUNT 1 1 1 1 1 1 3 1\nWIDTH 2\nHEIGHT 2\n\
         VIEWPOINT 0 0 5 1 0 0 0\nPOINTS 4\nDATA {data}\n"
    )
}

fn text(rgb: char) -> Vec<u8> {
    let mut bytes = header(rgb, "ascii").into_bytes();
    for (p, packed, index, intensity) in ROWS {
        let packed = if rgb == 'F' { f32::from_bits(packed).to_string() } else { packed.to_string() };
        let row = format!("{} {} {} {packed} 0 {index} 7 8 9 {intensity:e}\r\n", p.x, p.y, p.z);
        bytes.extend(row.bytes());
    }
    bytes
}

/// The numbers of a row, field by field.
fn numbers((p, packed, index, intensity): (Vec3, u32, i16, f64)) -> [Vec<u8>; 8] {
    let float = |value: f32| value.to_le_bytes().to_vec();
    [
        float(p.x),
        float(p.y),
        float(p.z),
        packed.to_le_bytes().to_vec(),
        vec![0],
        index.to_le_bytes().to_vec(),
        [7.0, 8.0, 9.0].map(float).concat(),
        intensity.to_le_bytes().to_vec(),
    ]
}

fn binary() -> Vec<u8> {
    let mut bytes = header('U', "binary").into_bytes();
    ROWS.into_iter().for_each(|row| bytes.extend(numbers(row).concat()));
    bytes
}

/// Compressed as literals alone.
fn compressed() -> Vec<u8> {
    let fields = (0..8).filter(|&field| field != 4);
    let whole: Vec<u8> =
        fields.flat_map(|field| ROWS.into_iter().flat_map(move |row| numbers(row)[field].clone())).collect();
    let mut packed = Vec::new();
    for literal in whole.chunks(32) {
        packed.push(literal.len() as u8 - 1);
        packed.extend(literal);
    }
    let mut bytes = header('U', "binary_compressed").into_bytes();
    bytes.extend((packed.len() as u32).to_le_bytes());
    bytes.extend((whole.len() as u32).to_le_bytes());
    bytes.extend(packed);
    bytes
}

/// Everything of a cloud, so that what is not a number equals itself.
fn bits(import: &Import) -> String {
    format!("{:?}", import.cloud)
}

#[test]
fn text_binary_and_compressed_give_the_same_cloud() {
    let import = read(&text('U')).unwrap();
    let cloud = &import.cloud;
    assert_eq!(cloud.len(), 4);
    assert_eq!(cloud.world_position(3).to_array(), [1.0, 2.0, 5.0]);
    assert!(cloud.positions[2].is_nan());
    assert_eq!(cloud.field("index").unwrap().values, [-7.0, 8.0, 9.0, 10.0]);
    assert_eq!(cloud.field("intensity").unwrap().values, [0.5, 0.25, f32::INFINITY, -0.5]);
    let linear = crate::srgb::linear_from_srgb8();
    let colors = cloud.colors.as_ref().unwrap();
    assert_eq!(colors[0], Vec3::new(linear[0x10], linear[0x20], linear[0xff]));
    assert_eq!(colors[3], Vec3::ONE);
    for other in [text('I'), binary(), compressed()] {
        assert_eq!(bits(&read(&other).unwrap()), bits(&import), "{}", other.escape_ascii());
    }
    // Alpha makes some packed colours floats that are not numbers, which text cannot keep.
    let packed = read(&text('F')).unwrap();
    assert_eq!(packed.cloud.colors.unwrap()[1], colors[1]);
    let assumptions = import.report.assumptions.join("\n");
    assert!(assumptions.contains("(0, 0, 5)") && assumptions.contains("2 x 2"), "{assumptions}");
    let usages: Vec<_> = import.report.elements[0].properties.iter().map(|p| p.usage).collect();
    assert_eq!(usages[3], Usage::Color);
    assert_eq!(usages[4], Usage::Unused("padding"));
    assert_eq!(usages[6], Usage::Unused("several values a point"));
    assert_eq!(usages[7], Usage::Field);
}

#[test]
fn mistakes_are_named() {
    let whole = String::from_utf8(text('U')).unwrap();
    let cases = [
        (
            "DATA ascii",
            "DATA hex",
            "line 11: found `DATA hex`, expected DATA ascii, binary or binary_compressed",
        ),
        ("DATA ascii\n", "", "expected a line of the header of a PCD file"),
        ("FIELDS", "NAMES", "expected a line of the header of a PCD file"),
        ("SIZE 4 4", "SIZE 4 3", "line 4: found `3`, expected 1, 2, 4 or 8"),
        ("TYPE F F", "TYPE F X", "line 5: found `X`, expected I, U or F"),
        ("COUNT 1", "COUNT", "line 6: found 7 words behind COUNT, expected 8, one a field"),
        ("POINTS 4", "POINTS 5", "found 5 points, but WIDTH times HEIGHT is 4, expected as many"),
        ("POINTS 4", "POINTS -4", "line 10: found `-4`, expected a whole number below 2^32"),
        ("\n1 2 4 ", "\n1 two 4 ", "line 13: found `two`, expected a number for y"),
        ("\n1 2 4 ", "\n1 2 ", "line 13: found 9 numbers, expected 10, as FIELDS and COUNT say"),
        ("FIELDS x y", "FIELDS x w", "expected the numbers x, y and z in element points"),
    ];
    for (old, new, expected) in cases {
        let message = read(whole.replacen(old, new, 1).as_bytes()).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }
    let many =
        whole.replace("WIDTH 2\nHEIGHT 2", "WIDTH 4000000000").replace("POINTS 4", "POINTS 4000000000");
    assert!(read(many.as_bytes()).unwrap_err().to_string().contains("expected 4000000000 points"));
}

#[test]
fn no_damage_makes_a_panic() {
    let mut random = crate::damage::Random::new(2);
    for bytes in [text('F'), binary(), compressed()] {
        for cut in 0..bytes.len() {
            // The last number may lose digits unnoticed.
            assert!(read(&bytes[..cut]).is_err() || cut + 10 > bytes.len(), "{cut}");
        }
        for _ in 0..3000 {
            _ = read(&random.damaged(&bytes));
        }
    }
}
