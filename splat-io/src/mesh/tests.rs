//! Tests of the readers of meshes. The files are made here.

use super::*;
use crate::{Error, read_ply_mesh_from};
use proptest::prelude::*;
use std::path::Path;

fn obj(text: &str) -> Result<MeshImport, Error> {
    read_obj_from(text.as_bytes(), text.len() as u64, Path::new("a.obj"))
}

fn mesh(text: &str) -> Mesh {
    let mesh = obj(text).unwrap().mesh;
    mesh.check().unwrap();
    mesh
}

fn message(text: &str) -> String {
    obj(text).unwrap_err().to_string()
}

fn ply_mesh(header: &str, body: &[u8]) -> Result<MeshImport, Error> {
    let file = [format!("ply\n{header}end_header\n").as_bytes(), body].concat();
    read_ply_mesh_from(&file[..], file.len() as u64, Path::new("a.ply"))
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn every_form_of_a_corner_means_the_same() {
    let with = |tables: &str, face: &str| mesh(&format!("{SQUARE}{tables}{face}\n"));
    let plain = with("", "f 1 2 3 4");
    assert_eq!(plain.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert!(plain.texture_triangles.is_empty() && plain.normal_triangles.is_empty());
    assert_eq!(with("", "f -4 -3 -2 -1"), plain);
    let tables = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 2\n";
    let full = with(tables, "f 1/1/1 2/2/1 3/3/1 4/4/1");
    assert_eq!(full.texture_triangles, full.triangles);
    assert_eq!(full.normal_triangles, [[0; 3]; 2]);
    assert_eq!(full.normals, [Vec3::Z * 2.0]);
    assert_eq!(full.texture_coordinates[2], DVec2::ONE);
    assert_eq!(with(tables, "f -4/-4/-1 -3/-3/-1 -2/-2/-1 -1/-1/-1"), full);
    assert!(with(tables, "f 1//1 2//1 3//1").texture_triangles.is_empty());
    assert!(with(tables, "f 1/1 2/2 3/3").normal_triangles.is_empty());
    assert!(with(tables, "f 1/1/ 2/2/ 3//").texture_triangles.is_empty());
}

#[test]
fn layout_of_the_text_says_nothing() {
    let expected = mesh(&format!("{SQUARE}f 1 2 3 4\n"));
    let texts = [
        format!("\u{feff}# made by hand\n\n{SQUARE}f 1 2 3 4"),
        format!("mtllib a.mtl\no cow # big\ng\ns off\nusemtl skin\n{SQUARE}f 1 2 3 4 # all of it\n"),
        format!("{SQUARE}f 1 2 \\\n 3 \\\r\n 4\n").replace('\n', "\r\n").replace("\\\r\r\n", "\\\r\n"),
        format!("{SQUARE}f 1 2 3 4\n").replace('\n', "\r"),
        format!("f 1 2 3 4\n{SQUARE}"),
        format!("\u{feff}{SQUARE}f 1 2 3 4\n"),
        format!("{SQUARE}\tf  1\t2   3 4  \n").replace("v ", "v\t"),
    ];
    for text in texts {
        assert_eq!(mesh(&text), expected, "{text:?}");
    }
}

#[test]
fn what_is_passed_over_is_said() {
    let report = obj(&format!("{SQUARE}l 1 2\np 1\nwobble 3\nf 1 2 3\n")).unwrap().report;
    assert_eq!(report.assumptions.len(), 2, "{:?}", report.assumptions);
    assert!(report.assumptions[0].starts_with("2 lines of points"));
    assert!(report.assumptions[1].ends_with("the first `wobble` in line 7"));
    let counts: Vec<_> =
        report.elements.iter().map(|element| (element.name.as_str(), element.count)).collect();
    assert_eq!(counts, [("v", 4), ("f", 1)]);
    assert_eq!(report.sha256.len(), 64);
}

#[test]
fn vertex_colors_are_srgb_of_either_range() {
    let half = splat_core::srgb::decode(0.5) as f32;
    let colored = mesh("v 0 0 0\nv 1 0 0 1 0.5 0\nv 0 1 0 0 0 1\nf 1 2 3\n");
    assert_eq!(colored.colors, Some(vec![Vec3::ONE, Vec3::new(1.0, half, 0.0), Vec3::Z]));
    let bytes = mesh("v 0 0 0 255 0 0\nv 1 0 0 0 127.5 0\nv 0 1 0 0 0 255\nf 1 2 3\n");
    assert_eq!(bytes.colors, Some(vec![Vec3::X, half * Vec3::Y, Vec3::Z]));
}

#[test]
fn faces_with_and_without_texture_go_together() {
    let mixed = mesh(&format!("{SQUARE}vt 0 0\nvt 1 0\nvt 1 1\nf 1 2 3\nf 1/1 2/2 3/3\nf 1 3 4\n"));
    assert_eq!(mixed.texture_triangles, [[NO_INDEX; 3], [0, 1, 2], [NO_INDEX; 3]]);
}

#[test]
fn errors_tell_the_line_and_what_was_expected() {
    for (text, line) in [
        ("v 0 0\n", 1),
        ("v 0 0 0\nv 1 x 0\n", 2),
        ("vt\n", 1),
        ("vt 1 2 3 4\n", 1),
        ("vn 1 2\n", 1),
        ("# a\nf 1 2\n", 2),
        ("f 1 2 0\n", 1),
        ("f 1 2 -1\n", 1),
        ("f 1/1/1/1 2 3\n", 1),
        ("f /1 2 3\n", 1),
        ("f 1 2 4294967296\n", 1),
        ("f 1 2 99999999999999999999\n", 1),
        ("v 0 0 0\nf 1 \\\n 1 \\\n 9\n", 2),
        ("v 0 0 0\nvt 0 0\nf 1 1 1\nf 1/1 1/1 1/2\n", 4),
    ] {
        let message = message(text);
        assert!(message.starts_with(&format!("a.obj: line {line}: found ")), "{text:?}: {message}");
        assert!(message.contains("expected"), "{message}");
    }
    let many = message("v 0 0 0\nf 1 1 7\n");
    assert_eq!(many, "a.obj: line 2: found a face with `v` 7, expected 1 to 1, as many `v` as the file has");
    assert!(message(SQUARE).contains("no face among 4 vertices"));
    assert!(message("").contains("no face"));
}

#[test]
fn ply_faces_are_read_from_every_format() {
    let header = |format: &str| {
        format!(
            "format {format} 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
             property float s\nproperty float t\nelement face 2\nproperty uchar flag\n\
             property list uchar int vertex_index\n"
        )
    };
    let rows = [
        [0.0f32, 0.0, 0.0, 0.0, 0.0],
        [2.0, 0.0, 0.0, 1.0, 0.0],
        [2.0, 2.0, 0.0, 1.0, 1.0],
        [0.0, 2.0, 0.0, 0.0, 1.0],
    ];
    let faces: [&[i32]; 2] = [&[0, 1, 2, 3], &[0, 1]];
    let text: String =
        rows.iter().map(|row| row.map(|v| format!("{v} ")).concat() + "\n").collect::<String>()
            + "7 4 0 1 2 3\n7 2 0 1\n";
    let binary = |big: bool| {
        let word = |bytes: [u8; 4]| if big { bytes.into_iter().rev().collect() } else { bytes.to_vec() };
        let mut bytes: Vec<u8> = rows.as_flattened().iter().flat_map(|v| word(v.to_le_bytes())).collect();
        for face in faces {
            bytes.extend([7, face.len() as u8]);
            bytes.extend(face.iter().flat_map(|i| word(i.to_le_bytes())));
        }
        bytes
    };
    for (format, body) in [
        ("ascii", text.into_bytes()),
        ("binary_little_endian", binary(false)),
        ("binary_big_endian", binary(true)),
    ] {
        let mesh = ply_mesh(&header(format), &body).unwrap().mesh;
        mesh.check().unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]], "{format}");
        assert_eq!(mesh.texture_triangles, mesh.triangles);
        assert_eq!(mesh.texture_coordinates[2], DVec2::ONE);
        assert_eq!(mesh.area(), (4.0, 0));
        let cut = ply_mesh(&header(format), &body[..body.len() - 3]).unwrap_err().to_string();
        assert!(cut.contains("face") || cut.contains("line"), "{cut}");
    }
}

#[test]
fn ply_faces_may_bring_their_own_texture_coordinates() {
    let header = "format ascii 1.0\nelement face 2\nproperty list uchar int vertex_indices\n\
                  property list uchar float texcoord\nelement vertex 3\nproperty float x\nproperty float y\n\
                  property float z\n";
    let body = b"3 0 1 2 6 0 0 0.5 0 0 0.25\n3 2 1 0 0\n0 0 0\n1 0 0\n0 1 0\n";
    let mesh = ply_mesh(header, body).unwrap().mesh;
    mesh.check().unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [2, 1, 0]]);
    assert_eq!(mesh.texture_triangles, [[0, 1, 2], [NO_INDEX; 3]]);
    assert_eq!(mesh.texture_coordinates[1], DVec2::new(0.5, 0.0));
}

#[test]
fn wrong_ply_meshes_are_refused() {
    let vertices =
        "format ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
    let message = |faces: &str, body: &str| {
        ply_mesh(&format!("{vertices}{faces}"), body.as_bytes()).unwrap_err().to_string()
    };
    let list = "element face 1\nproperty list uchar int vertex_indices\n";
    assert!(message("", "0 0 0\n").contains("expected an element `face`"));
    assert!(message(list, "0 0 0\n3 0 0 1\n").contains("line 11: found a face with the vertex 1"));
    assert!(message(list, "0 0 0\n3 0 0 -1\n").contains("the vertex -1"));
    assert!(message(&list.replace("face 1", "face 1000000"), "0 0 0\n").contains("1000000"));
}

/// Pieces of OBJ files, sound and otherwise.
fn piece() -> impl Strategy<Value = String> {
    let index = prop_oneof![-5..9i64, any::<i64>()];
    prop_oneof![
        Just("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 1\nvn 0 0 1\n".to_owned()),
        prop::collection::vec(any::<f64>(), 0..9)
            .prop_map(|v| format!("v {}\n", v.iter().map(|v| format!("{v} ")).collect::<String>())),
        prop::collection::vec((index.clone(), index.clone(), index), 0..6).prop_map(|corners| {
            format!("f {}\n", corners.iter().map(|(a, b, c)| format!("{a}/{b}/{c} ")).collect::<String>())
        }),
        prop::collection::vec(-3..4i64, 3..6).prop_map(|corners| format!(
            "f {}\n",
            corners.iter().map(|a| format!("{a} ")).collect::<String>()
        )),
        "[vtnfl/# \\\\\r\n0-9.-]{0,12}",
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn hostile_obj_files_do_no_harm(pieces in prop::collection::vec(piece(), 0..12)) {
        if let Ok(import) = obj(&pieces.concat()) {
            prop_assert!(import.mesh.check().is_ok());
            if let Ok(sampled) = sample_surface(&import.mesh, 50, 1, &mut |_| {}) {
                prop_assert_eq!(sampled.cloud.len(), 50);
                prop_assert!(sampled.cloud.check_lengths().is_ok());
            }
        }
    }

    #[test]
    fn any_bytes_do_no_harm(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        _ = read_obj_from(&bytes[..], bytes.len() as u64, Path::new("a.obj"));
    }

    #[test]
    fn hostile_ply_faces_do_no_harm(body in "[0-4 \n.-]{0,60}", bytes in prop::collection::vec(0..6u8, 0..60)) {
        for format in ["ascii", "binary_little_endian"] {
            let header = format!(
                "format {format} 1.0\nelement vertex 2\nproperty uchar x\nproperty char y\nproperty char z\n\
                 element face 2\nproperty list char uchar vertex_indices\nproperty list uchar float texcoord\n"
            );
            let body = if format == "ascii" { body.as_bytes() } else { &bytes[..] };
            if let Ok(import) = ply_mesh(&header, body) {
                prop_assert!(import.mesh.check().is_ok());
            }
        }
    }
}
