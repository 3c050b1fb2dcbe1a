//! What the properties mean.

use super::*;
use glam::{DVec3, Vec2, Vec3};
use splat_core::srgb::decode;
use splat_core::{Defect, Shapes, TextureCoordinates};

/// A file of one vertex for each format: the same values after "float x/y/z" = 1 2 3.
fn one(properties: &[(&str, f64)]) -> Vec<Import> {
    let mut names = vec!["float x", "float y", "float z"];
    names.extend(properties.iter().map(|&(name, _)| name));
    let values = [1.0, 2.0, 3.0].into_iter().chain(properties.iter().map(|&(_, value)| value));
    let table = Table::new("vertex", &names, vec![values.map(Value::One).collect()]);
    FORMATS.map(|format| read(&file(format, std::slice::from_ref(&table))).unwrap()).to_vec()
}

fn usage(import: &Import, property: &str) -> Usage {
    let properties = &import.report.elements[0].properties;
    properties.iter().find(|known| known.name == property).unwrap().usage
}

#[test]
fn normals_have_many_names_and_become_unit_vectors() {
    for [x, y, z] in [
        ["nx", "ny", "nz"],
        ["normal_x", "normal_y", "normal_z"],
        ["normalx", "normaly", "normalz"],
        ["NX", "Ny", "nz"],
    ] {
        let names = [x, y, z].map(|name| format!("double {name}"));
        for import in one(&[(&names[0], 2.0), (&names[1], -3.0), (&names[2], 6.0)]) {
            assert_eq!(import.cloud.normals, [Vec3::new(2.0 / 7.0, -3.0 / 7.0, 6.0 / 7.0)]);
            assert!(import.cloud.oriented);
            assert_eq!(usage(&import, y), Usage::Normal);
        }
    }
}

#[test]
fn normals_that_are_all_zero_or_incomplete_are_absent() {
    for import in one(&[("float nx", 0.0), ("float ny", 0.0), ("float nz", -0.0)]) {
        assert!(import.cloud.normals.is_empty() && !import.cloud.oriented);
        assert_eq!(usage(&import, "nx"), Usage::Unused("every normal is zero"));
        assert!(import.report.assumptions.iter().any(|line| line.contains("every normal is zero")));
    }
    for import in one(&[("float nx", 1.0), ("float ny", 0.0)]) {
        assert!(import.cloud.normals.is_empty());
        assert_eq!(usage(&import, "nx"), Usage::Unused("the other components are missing"));
    }
}

#[test]
fn colors_are_linearised_by_type() {
    let linear = decode(51.0 / 255.0) as f32;
    for (kind, value, expected) in [
        ("uchar", 51.0, linear),
        ("ushort", 13107.0, linear),
        ("int", 51.0, linear),
        ("float", 0.25, 0.25),
        ("double", 0.25, 0.25),
    ] {
        for [r, g, b] in
            [["red", "green", "blue"], ["r", "g", "b"], ["diffuse_red", "diffuse_green", "diffuse_blue"]]
        {
            let names = [r, g, b].map(|name| format!("{kind} {name}"));
            for import in one(&[(&names[2], value), (&names[1], value), (&names[0], 0.0)]) {
                assert_eq!(import.cloud.colors, Some(vec![Vec3::new(0.0, expected, expected)]), "{kind}");
            }
        }
    }
    for import in one(&[("float red", 255.0), ("float green", 0.0), ("float blue", 0.0)]) {
        assert!(import.report.assumptions.iter().any(|line| line.contains("colors reach 255")));
    }
}

#[test]
fn opacities_are_scaled_and_clamped() {
    for (property, value, expected) in [
        ("uchar alpha", 51.0, 0.2),
        ("ushort opacity", 13107.0, 0.2),
        ("float a", 0.2, 0.2),
        ("uchar diffuse_alpha", 255.0, 1.0),
        ("float opacity", 1.5, 1.0),
        ("float opacity", -3.0, 0.0),
        ("short alpha", -5.0, 0.0),
    ] {
        for import in one(&[(property, value)]) {
            assert_eq!(import.cloud.opacities, Some(vec![expected]), "{property}");
        }
    }
    for import in one(&[("float opacity", 2.0)]) {
        assert!(import.report.assumptions.iter().any(|line| line.starts_with("1 opacities outside")));
    }
}

#[test]
fn sizes_have_many_names() {
    for name in ["radius", "psz", "size", "scale", "pscale"] {
        for import in one(&[(&format!("float {name}"), 0.5)]) {
            assert_eq!(import.cloud.shapes, Shapes::Discs(vec![0.5]));
            assert!(
                import.report.assumptions.iter().any(|line| line.starts_with(&format!("{name} is read")))
            );
        }
    }
    for import in one(&[("float psz", 0.5), ("double radius", 0.25), ("float confidence", 1.0)]) {
        assert_eq!(import.cloud.shapes, Shapes::Discs(vec![0.25]));
        assert_eq!(usage(&import, "psz"), Usage::Unused("another property of this meaning comes first"));
        assert_eq!(usage(&import, "confidence"), Usage::Field);
        assert_eq!(import.cloud.field("confidence").unwrap().values, [1.0]);
    }
    for import in one(&[]) {
        assert_eq!(import.cloud.shapes, Shapes::Discs(vec![0.0]));
        assert!(import.report.assumptions.contains(&"no size: every size is unknown".to_owned()));
    }
}

#[test]
fn areas_and_tangents() {
    let axes = ["tu_x", "tu_y", "tu_z", "tv_x", "tv_y", "tv_z"].map(|name| format!("float {name}"));
    let mut properties: Vec<_> =
        axes.iter().zip(1..).map(|(name, i)| (name.as_str(), f64::from(i))).collect();
    properties.extend([("float area", 0.5), ("float radius", 9.0)]);
    for import in one(&properties) {
        let [u, v] = [Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 5.0, 6.0)];
        assert_eq!(import.cloud.shapes, Shapes::Ellipses(vec![[u, v]]));
        assert_eq!(import.cloud.areas, Some(vec![0.5]));
        assert_eq!(usage(&import, "radius"), Usage::Unused("the tangent axes give the size"));
    }
    for import in one(&properties[1..]) {
        assert_eq!(import.cloud.shapes, Shapes::Discs(vec![9.0]));
    }
}

#[test]
fn texture_coordinates_have_many_names_and_perhaps_derivatives() {
    let center = Vec2::new(0.25, -1.5);
    for [s, t] in [["s", "t"], ["u", "v"], ["texture_u", "texture_v"], ["S", "T"]] {
        let names = [s, t].map(|name| format!("float {name}"));
        for import in one(&[(&names[0], 0.25), (&names[1], -1.5)]) {
            let expected = TextureCoordinates { center, ..TextureCoordinates::default() };
            assert_eq!(import.cloud.texture_coordinates, Some(vec![expected]));
            assert_eq!(usage(&import, t), Usage::TextureCoordinate);
            assert!(import.report.assumptions.iter().any(|line| line.contains("derivatives are unknown")));
        }
    }
    let derivatives =
        [("float ds_du", 1.0), ("float dt_du", 2.0), ("double ds_dv", 3.0), ("uchar dt_dv", 4.0)];
    for import in one(&[&derivatives[..], &[("float s", 0.25), ("float t", -1.5)]].concat()) {
        let expected = TextureCoordinates { center, per_u: Vec2::new(1.0, 2.0), per_v: Vec2::new(3.0, 4.0) };
        assert_eq!(import.cloud.texture_coordinates, Some(vec![expected]));
        assert_eq!(usage(&import, "dt_du"), Usage::TextureDerivative);
    }
    for import in one(&derivatives) {
        assert_eq!(import.cloud.texture_coordinates, None);
        assert_eq!(usage(&import, "ds_dv"), Usage::Unused("the texture coordinates are missing"));
    }
    for import in one(&[("float s", 1.0)]) {
        assert_eq!(import.cloud.texture_coordinates, None);
        assert_eq!(usage(&import, "s"), Usage::Unused("the other components are missing"));
    }
}

#[test]
fn bad_points_stay_in_their_rows() {
    let text = "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\n\
                property float z\nproperty float nx\nproperty float ny\nproperty float nz\n\
                property float radius\nend_header\n\
                0 0 0 0 0 1 1\nnan 0 0 0 0 1 1\n0 -nan(ind) 0 0 0 1 1\n0 0 0 0 1.#INF 1 1\n0 0 0 0 0 0 1\n\
                0 0 1e39 0 0 1 -1\n";
    let cloud = cloud(text.as_bytes());
    let defects: Vec<_> = (0..6).map(|index| cloud.defect(index)).collect();
    let bad = Some(Defect::NotFinite);
    assert_eq!(defects, [None, bad, bad, bad, Some(Defect::ZeroNormal), bad]);
}

#[test]
fn map_coordinates_keep_their_precision() {
    let shift = DVec3::new(500_000.0, 5_000_000.0, 100.0);
    let rows: Vec<[f64; 3]> =
        (0..50).map(|i| (shift + DVec3::new(f64::from(i) * 0.001, 0.002, 0.0)).to_array()).collect();
    for kind in ["double", "float"] {
        let names = ["x", "y", "z"].map(|name| format!("{kind} {name}"));
        let table = Table::vertex(names.each_ref().map(String::as_str), &rows);
        // A program that declares `float` and prints all its digits.
        let text = String::from_utf8(file(Format::Ascii, std::slice::from_ref(&table))).unwrap();
        let text = if kind == "float" {
            let body: Vec<_> = rows.iter().map(|[x, y, z]| format!("{x} {y} {z}\n")).collect();
            header(Format::Ascii, std::slice::from_ref(&table), "\n") + &body.concat()
        } else {
            text
        };
        let mut files = vec![text.into_bytes()];
        if kind == "double" {
            files.extend(FORMATS.map(|format| file(format, std::slice::from_ref(&table))));
        }
        for bytes in files {
            let import = read(&bytes).unwrap();
            assert!((import.cloud.origin - shift).length() < 1.0);
            for (index, row) in rows.iter().enumerate() {
                let error = import.cloud.world_position(index) - DVec3::from_array(*row);
                assert!(error.length() < 1e-8, "{error}");
            }
            assert!(import.report.assumptions.iter().any(|line| line.contains("far from zero")));
        }
    }
}

#[test]
fn the_comments_of_the_writer_are_understood() {
    let text = |comment: &str, x: &str| {
        format!(
            "ply\nformat ascii 1.0\ncomment splat {comment}\nelement vertex 1\nproperty float x\n\
             property float y\nproperty float z\nproperty float nx\nproperty float ny\nproperty float nz\n\
             end_header\n{x} 2 3 0 0 1\n"
        )
    };
    assert!(cloud(text("oriented 1", "1").as_bytes()).oriented);
    assert!(!cloud(text("oriented 0", "1").as_bytes()).oriented);
    assert!(cloud(text("oriented maybe", "1").as_bytes()).oriented);
    assert_eq!(cloud(text("origin 0 0 0", "1").as_bytes()).origin, DVec3::ZERO);
    assert_eq!(cloud(text("origin 1 -2 0.5", "1").as_bytes()).origin, DVec3::new(1.0, -2.0, 0.5));
    // Not if it costs precision, is damaged, or absurd.
    let chosen = DVec3::new(1.000_000_001, 2.0, 3.0);
    for comment in ["origin 0 0 0", "origin nan 0 0", "origin 1e300 0 0", "origin 1 2", "origin a b c"] {
        assert_eq!(cloud(text(comment, "1.000000001").as_bytes()).origin, chosen, "{comment}");
    }
}

#[test]
fn the_report_tells_all() {
    let table = Table::vertex(["float x", "float y", "float z", "uchar quality"], &[[1.0, 2.0, 3.0, 4.0]]);
    let bytes = file(Format::BinaryBigEndian, &[table, Table::faces()]);
    let report = read(&bytes).unwrap().report;
    assert_eq!(report.path, Path::new("x.ply"));
    assert_eq!(report.format, "PLY, binary big endian");
    assert_eq!(report.bytes, bytes.len() as u64);
    let names: Vec<_> = report.elements.iter().map(|e| (e.name.as_str(), e.count, e.is_points)).collect();
    assert_eq!(names, [("vertex", 1, true), ("face", 2, false)]);
    assert!(
        report.assumptions.contains(&"element face (2 rows) is ignored: only points are drawn".to_owned())
    );
    assert_eq!(report.elements[0].properties[3].kind, "uchar");
    assert_eq!(report.elements[0].properties[3].usage.to_string(), "scalar field");
}

#[test]
fn the_hash_covers_the_whole_file() {
    let mut bytes =
        b"ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty int y\nproperty int z\n\
                      element face 1\nproperty list uchar int i\nend_header\n1 2 3\n3 0 0 0\n"
            .to_vec();
    // Computed by another program (Python's hashlib).
    let hash = |bytes: &[u8]| read(bytes).unwrap().report.sha256;
    assert_eq!(hash(&bytes), "e565e3c0e924c640f184a0c9508bd0d4dcbdeced59b66c5b28fab0ff56463dba");
    bytes.extend(vec![b'\n'; 1_000_000]);
    assert_eq!(hash(&bytes), "be43bba81dfaff291f83dbd134f9815fcd7fb53df9d49d604b82bc50d3fdfe05");
}
