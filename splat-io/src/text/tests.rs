//! Texts of every kind, made here.

use super::*;
use splat_core::Cloud;

fn read(text: &str) -> Result<Import, Error> {
    read_text_from(text.as_bytes(), Path::new("a.xyz"), None)
}

fn names(import: &Import) -> Vec<&str> {
    import.report.elements[0].properties.iter().map(|property| property.name.as_str()).collect()
}

fn message(text: &str) -> String {
    read(text).unwrap_err().to_string()
}

#[test]
fn any_separator_comment_line_end_and_header_will_do() {
    let texts = [
        "1 2 3 9\n4 5 6 8\n",
        "  1\t2   3 9 \r\n\r\n4 5 6 8",
        "1,2,3,9\n4,5,6,8",
        "1;2;3;9;\n4;5;6;8;\n",
        "\u{feff}X Y Z Intensity\n1 2 3 9\n4 5 6 8\n",
        "//X Y Z Intensity\n1 2 3 9\n# x\n4 5 6 8\n",
        "# made by hand\n\"x\", \"y\", \"z\", 'intensity'\n1, 2, 3, 9\n4, 5, 6, 8\n",
        "x\ty\tz\tintensity\n1.0 2e0 +3 9.\n4 5 6 8\n",
    ];
    let expected = read(texts[0]).unwrap().cloud;
    assert_eq!(expected.len(), 2);
    assert_eq!(expected.field("intensity").unwrap().values, [9.0, 8.0]);
    for text in texts {
        assert_eq!(
            read(text).unwrap().cloud,
            Cloud { fields: read(text).unwrap().cloud.fields, ..expected.clone() }
        );
        assert_eq!(read(text).unwrap().cloud.field("INTENSITY").unwrap().values, [9.0, 8.0], "{text}");
    }
}

#[test]
fn columns_are_told_by_their_values() {
    let cases = [
        ("1 2 3", "x y z"),
        ("1 2 3 0.5", "x y z intensity"),
        ("1 2 3 255 0 17", "x y z r g b"),
        ("1 2 3 0.6 0 -0.8", "x y z nx ny nz"),
        ("1 2 3 0.5 0.25 1", "x y z r g b"),
        ("1 2 3 117.0 73.0 49.0 255.", "x y z r g b intensity"),
        ("1 2 3 -700 73 49 255", "x y z intensity r g b"),
        ("1 2 3 9 8 7 0 0 1", "x y z r g b nx ny nz"),
        ("1 2 3 0 0.6 0.8 9 8 7 0.5", "x y z nx ny nz r g b intensity"),
        ("1 2 3 0.5 0.7", "x y z intensity column_5"),
    ];
    for (text, expected) in cases {
        assert_eq!(names(&read(text).unwrap()).join(" "), expected, "{text}");
    }
    let pts = read_text_from(b"1\n1 2 3 5 73 49 255\n", Path::new("a.pts"), None).unwrap();
    assert_eq!(names(&pts).join(" "), "x y z intensity r g b");
}

#[test]
fn the_caller_may_name_the_columns() {
    let columns = ["z", "-", "x", "y", "time"].map(str::to_owned);
    let import = read_text_from(b"3 oops 1 2 7\n", Path::new("a.txt"), Some(&columns)).unwrap();
    assert_eq!(import.cloud.world_position(0).to_array(), [1.0, 2.0, 3.0]);
    assert_eq!(import.cloud.field("time").unwrap().values, [7.0]);
    assert_eq!(import.report.elements[0].properties[1].usage, Usage::Unused("not wanted"));
    let short = read_text_from(b"3 1 2 7\n", Path::new("a.txt"), Some(&columns)).unwrap_err().to_string();
    assert_eq!(
        short,
        "a.txt: line 1: found 5 columns, expected as many as the first row, line 1, has numbers: 4"
    );
}

#[test]
fn colours_are_srgb_of_the_range_that_they_have() {
    let decode = |v: f64| splat_core::srgb::decode(v) as f32;
    for (text, range) in [("x y z r g b\n0 0 0 255 51 0", 255.0), ("x y z r g b\n0 0 0 1 0.2 0", 1.0)] {
        let cloud = read(text).unwrap().cloud;
        let expected = Vec3::new(1.0, decode(0.2), 0.0);
        assert!((cloud.colors.unwrap()[0] - expected).abs().max_element() < 1e-6, "{range}");
    }
    let deep = read("x y z r g b\n0 0 0 65535 13107 0").unwrap().cloud.colors.unwrap()[0];
    assert_eq!(deep, Vec3::new(1.0, decode(0.2), 0.0));
}

#[test]
fn a_count_is_checked_and_not_trusted() {
    assert_eq!(read("2\n1 2 3\n4 5 6\n").unwrap().cloud.len(), 2);
    let more = read("1\n1 2 3\n4 5 6\n").unwrap();
    assert!(more.report.assumptions.iter().any(|a| a == "the file says 1 points and has 2: all are kept"));
    assert_eq!(read("1\n1 2 3\n1\n4 5 6\n").unwrap().cloud.len(), 2);
    let fewer = message("18446744073709551615\n1 2 3\n");
    assert_eq!(
        fewer,
        "a.xyz: whole file: found 1 points, expected 18446744073709551615 points, as the file says"
    );
}

#[test]
fn mistakes_are_named_with_their_line() {
    let cases = [
        ("", "whole file: found an empty file, expected a cloud"),
        ("# only\n\n", "whole file: found no row of numbers, expected a point a line"),
        ("1 2\n", "line 1: found 2 numbers, expected 3 to 64 numbers: x, y, z and what else there is"),
        ("1 2 3\n4 five 6\n", "line 2: found `five`, expected a number with a decimal point for y"),
        (
            "1 2 3\n\n4 5\n",
            "line 3: found the end of the line, expected 3 numbers, as in the first row: z is missing",
        ),
        ("1 2 3\n4 5 6 7\n", "line 2: found `7`, expected the end of a row of 3 numbers"),
        ("1;2,5;3\n", "line 1: found `2,5`, expected a number with a decimal point for y"),
        ("1,2,3\n1,,3\n", "line 2: found ``, expected a number with a decimal point for y"),
        (
            "X,Y,X\n1,2,3\n",
            "line 1: found the properties X, Y, X, expected the numbers x, y and z in element points",
        ),
        ("x y z\nagain\n1 2 3\n", "line 2: found `again`, expected a row of numbers"),
        (
            "x y\n1 2 3\n",
            "line 1: found 2 columns, expected as many as the first row, line 2, has numbers: 3",
        ),
    ];
    for (text, expected) in cases {
        assert_eq!(message(text), format!("a.xyz: {expected}"), "{text:?}");
    }
    let binary = read_text_from(b"\0\x01\x02", Path::new("a.bin"), None).unwrap_err();
    assert!(matches!(binary, Error::Unsupported { .. }), "{binary}");
}

#[test]
fn points_that_are_not_finite_keep_their_rows() {
    let cloud = read("1 2 3\nnan nan nan\n4 5 inf\n").unwrap().cloud;
    assert_eq!(cloud.len(), 3);
    assert_eq!(cloud.positions.iter().filter(|position| position.is_finite()).count(), 1);
}

#[test]
fn no_damage_makes_a_panic() {
    let text = b"3\n//X Y Z R G B Nx Ny Nz t\n1.5 2 3 255 1 2 0 0 1 7\n-1,2e9;3 nan 4\n\"x\"\r\n;;;\n1 2 3\n";
    let mut random = crate::damage::Random::new(1);
    for cut in 0..text.len() {
        _ = read_text_from(&text[..cut], Path::new("a.pts"), None);
    }
    for _ in 0..3000 {
        let damaged = random.damaged(text);
        _ = read_text_from(&damaged, Path::new("a.txt"), None);
    }
}

#[test]
fn what_is_written_reads_back() {
    let levels = crate::srgb::linear_from_srgb8();
    let points: Vec<_> = (0..50)
        .map(|i| glam::DVec3::new(6e5 + f64::from(i) * 0.37, 5e6 - f64::from(i) / 4.0, 0.01))
        .collect();
    let mut cloud = Cloud::from_points(&points);
    cloud.colors =
        Some((0..50).map(|i| Vec3::new(levels[i], levels[255 - i], levels[7 * i % 256])).collect());
    cloud.normals = vec![Vec3::new(0.6, 0.0, -0.8); 50];
    cloud.oriented = true;
    cloud.shapes = splat_core::Shapes::Discs((0..50).map(|i| i as f32 * 0.1).collect());
    let values = (0..50).map(|i| 1.0 / i as f32).collect();
    cloud.fields = vec![splat_core::Field { name: "gps,time".to_owned(), values }];
    let folder = tempfile::tempdir().unwrap();
    for (name, separator) in [("a.xyz", ' '), ("a.csv", ',')] {
        let path = folder.path().join(name);
        write_text(&path, &cloud, separator).unwrap();
        let mut again = read_text(&path, None).unwrap().cloud;
        assert_eq!(again.fields[0].name, "gps_time");
        again.fields[0].name = "gps,time".to_owned();
        assert_eq!(again, cloud);
    }
    let text = std::fs::read_to_string(folder.path().join("a.xyz")).unwrap();
    assert!(
        text.starts_with("# x y z r g b nx ny nz radius gps_time\n600000.00 5000000.00 0.01 0 255 0 0.6"),
        "{text}"
    );
}
