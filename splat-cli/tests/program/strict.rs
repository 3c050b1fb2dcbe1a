//! `--strict`: refused is what is dropped, skipped or changed otherwise; what, how many, and where the first one is.

use super::common::{fails, message_of, succeeds};
use std::fs;

const HEAD: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                    property float nx\nproperty float ny\nproperty float nz\nproperty float radius\n\
                    property float opacity\nend_header\n";

/// A good point of that header.
const GOOD: &str = "0 0 0 0 0 1 0.5 1\n";

/// Files, and what the strict say of them.
fn cases() -> Vec<(&'static str, String, &'static str)> {
    let points = |bad: &str| format!("{HEAD}{GOOD}{bad}\n{GOOD}");
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let faces = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                 element face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n";
    let pcd =
        "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 2\nHEIGHT 1\nDATA ascii\n0 0 0\n1 0 0\n";
    vec![
        ("nan.ply", points("nan 0 0 0 0 1 0.5 1"), "1 points not_finite (the first: point 1)"),
        ("far.ply", points("1e300 0 0 0 0 1 0.5 1"), "1 points not_finite (the first: point 1)"),
        ("normal.ply", points("0 0 0 0 0 0 0.5 1"), "1 points zero_normal (the first: point 1)"),
        ("size.ply", points("0 0 0 0 0 1 -0.5 1"), "1 points negative_size (the first: point 1)"),
        ("opacity.ply", points("0 0 0 0 0 1 0.5 1.5"), "1 opacities outside [0, 1] (the first: point 1)"),
        ("more.ply", points(GOOD.trim_end()) + GOOD, "bytes behind the last row (the first: from byte"),
        ("more.pcd", format!("{pcd}2 0 0\n3 0 0\n"), "2 lines behind the last point (the first: line 10)"),
        ("nan.pcd", pcd.replace("1 0 0", "nan 0 0"), "1 points not_finite (the first: point 1)"),
        (
            "more.pts",
            "1\n0 0 0\n1 0 0\n0 1 0\n".to_owned(),
            "2 points more than the file says (the first: point 1)",
        ),
        ("inf.xyz", "0 0 0\n1 inf 0\n0 1 0\n".to_owned(), "1 points not_finite (the first: point 1)"),
        (
            "flat.obj",
            format!("{obj}f 1 2 3\nf 1 1 2\n"),
            "1 triangles without an area (the first: triangle 1)",
        ),
        ("line.obj", format!("{obj}f 1 2 3\nl 1 2\n"), "free-form surfaces (the first: line 5)"),
        ("word.obj", format!("{obj}f 1 2 3\nnonsense\n"), "1 lines of unknown meaning (the first: line 5)"),
        (
            "face.ply",
            format!("{faces}3 0 1 2\n2 0 1\n"),
            "1 faces of fewer than three corners (the first: face 1)",
        ),
    ]
}

#[test]
fn the_strict_refuse_what_others_count() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for (name, contents, expected) in cases() {
        fs::write(folder.join(name), contents).unwrap();
        succeeds(folder, &format!("convert {name} -o out.ply --points 50"));
        let message = fails(folder, &format!("convert {name} -o strict.ply --points 50 --strict"), 1);
        assert!(message.contains(&format!("{name}: --strict: ")) && message.contains(expected), "{message}");
        assert!(!folder.join("strict.ply").exists(), "{name}");
        // As a cloud, a file of faces is as good as any.
        if name == "face.ply" {
            continue;
        }
        let info = fails(folder, &format!("info {name} --strict"), 1);
        assert!(info.contains(expected), "{info}");
        succeeds(folder, &format!("info {name}"));
        if name.ends_with(".obj") {
            continue;
        }
        let render = "-o out.png --size 8x8 --spp 1 --radius 0.5";
        succeeds(folder, &format!("render {name} {render}"));
        let message = fails(folder, &format!("render {name} {render} --strict"), 1);
        assert!(message.contains(expected), "{message}");
        succeeds(folder, &format!("prepare {name} -o out.ply --radius 0.5"));
        let message = fails(folder, &format!("prepare {name} -o strict.ply --radius 0.5 --strict"), 1);
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn the_strict_take_what_is_in_order() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("good.ply"), format!("{HEAD}{GOOD}1 0 0 0 0 1 0.5 1\n0 1 0 0 0 1 0.5 1\n\n"))
        .unwrap();
    // What is unknown is estimated, and no fault.
    let rows: String = (0..100).map(|i| format!("{} {} 0\n", i % 10, i / 10)).collect();
    fs::write(folder.join("bare.xyz"), rows).unwrap();
    let scene = "[[cloud]]\npath = \"good.ply\"\n[input]\nstrict = true\n[film]\nsize = \"8x8\"\nspp = 1\n";
    fs::write(folder.join("good.toml"), scene).unwrap();
    for name in ["good.ply", "bare.xyz"] {
        succeeds(folder, &format!("info {name} --strict"));
        succeeds(folder, &format!("convert {name} -o out.ply --strict"));
        succeeds(folder, &format!("prepare {name} -o out.ply --strict"));
        succeeds(folder, &format!("render {name} -o out.png --size 8x8 --spp 1 --strict"));
    }
    succeeds(folder, "render good.toml -o out.png");
    let bad = fs::read_to_string(folder.join("good.ply")).unwrap().replace("1 0 0 0 0 1", "1 0 0 0 0 0");
    fs::write(folder.join("good.ply"), bad).unwrap();
    assert!(fails(folder, "render good.toml -o out.png", 1).contains("zero_normal (the first: point 1)"));
    fs::write(folder.join("good.toml"), scene.replace("true", "false")).unwrap();
    let drawn = succeeds(folder, "render good.toml -o out.png");
    assert!(message_of(&drawn).contains("points dropped: 1 (1 zero_normal)"), "{}", message_of(&drawn));
}
