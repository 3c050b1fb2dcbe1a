//! Clouds of every format, from outside: converted, described, coloured and rendered.

use super::common::{PROGRAM, Png, fails, message_of, read_png, real_files, succeeds};
use glam::{DVec3, Vec3};
use splat_core::{Cloud, Field};
use splat_io::srgb::linear_from_srgb8;
use splat_io::{PlyEncoding, write_ply};
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

/// Renders a small picture and returns its samples.
fn picture(folder: &Path, arguments: &str) -> Png {
    succeeds(folder, &format!("render {arguments} -o out.png --size 96x72 --spp 4"));
    read_png(&folder.join("out.png"))
}

/// A hill in centimetres, in map coordinates, with 8-bit colours, intensity and two classes.
fn hill(folder: &Path, with_colors: bool) -> Cloud {
    let side = 40;
    let place = |i: i32| [i % side, i / side].map(|k| f64::from(k) * 0.5);
    let height =
        |[x, y]: [f64; 2]| (8.0 * (-0.02 * ((x - 10.0).powi(2) + (y - 10.0).powi(2))).exp() * 100.0).round();
    let points: Vec<DVec3> = (0..side * side)
        .map(|i| {
            let [x, y] = place(i);
            DVec3::new(500_000.25 + x, 4_321_000.5 + y, height([x, y]) / 100.0)
        })
        .collect();
    let mut cloud = Cloud::from_points(&points);
    let levels = linear_from_srgb8();
    if with_colors {
        cloud.colors = Some(
            (0..points.len()).map(|i| Vec3::new(levels[i % 256], levels[255], levels[i / 8 % 256])).collect(),
        );
    }
    let field = |name: &str, value: &dyn Fn(usize) -> f32| Field {
        name: name.to_owned(),
        values: (0..points.len()).map(value).collect(),
    };
    cloud.fields = vec![
        field("intensity", &|i| (i % 40) as f32 * 10.0),
        field("classification", &|i| if points[i].z > 2.0 { 6.0 } else { 2.0 }),
    ];
    write_ply(&folder.join("hill.ply"), &cloud, PlyEncoding::Binary).unwrap();
    cloud
}

#[test]
fn every_format_gives_the_same_picture() {
    let folder = tempfile::tempdir().unwrap();
    hill(folder.path(), true);
    let expected = picture(folder.path(), "hill.ply");
    for name in ["hill.las", "hill.laz", "hill.xyz", "hill.txt", "hill.asc", "hill.csv"] {
        let message = message_of(&succeeds(folder.path(), &format!("convert hill.ply -o {name}")));
        assert!(!message.contains("warning"), "{message}");
        assert!(picture(folder.path(), name) == expected, "{name}");
        succeeds(folder.path(), &format!("convert {name} -o again.ply"));
        assert!(picture(folder.path(), "again.ply") == expected, "{name}");
    }
    let message = message_of(&succeeds(folder.path(), "convert hill.ply hill.las -o two.laz -v"));
    assert!(message.contains("3200 points"), "{message}");
    assert!(fails(folder.path(), "convert hill.ply -o hill.e57", 2).contains(".csv"));
}

#[test]
fn what_a_format_cannot_hold_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let mut cloud = hill(folder.path(), false);
    cloud.normals = vec![Vec3::Z; cloud.len()];
    cloud.positions[3] = Vec3::NAN;
    write_ply(&folder.path().join("in.ply"), &cloud, PlyEncoding::Binary).unwrap();
    let message = message_of(&succeeds(folder.path(), "convert in.ply -o out.las"));
    assert!(message.contains("no place for normals"), "{message}");
    assert!(message.contains("1 points without finite coordinates"), "{message}");
}

#[test]
fn attributes_become_colours() {
    let folder = tempfile::tempdir().unwrap();
    hill(folder.path(), false);
    let by_default = picture(folder.path(), "hill.ply");
    assert!(by_default == picture(folder.path(), "hill.ply --color intensity --colormap gray"));
    let colors = ["height", "normal", "class", "classification", "intensity --colormap inferno"];
    let pictures: Vec<Png> =
        colors.iter().map(|color| picture(folder.path(), &format!("hill.ply --color {color}"))).collect();
    for (i, one) in pictures.iter().enumerate() {
        assert!(*one != by_default && pictures[..i].iter().all(|other| other != one), "{}", colors[i]);
    }
    // Half of the range is the whole map.
    let message = message_of(&succeeds(
        folder.path(),
        "render hill.ply -o out.png --size 9x9 --color height --color-range 0:4 -v",
    ));
    assert!(message.contains("colours show the height from 0 to 4 (viridis"), "{message}");
    assert!(fails(folder.path(), "render hill.ply -o out.png --color rgb", 1).contains("no colours"));
    let message = fails(folder.path(), "render hill.ply -o out.png --color time", 1);
    assert!(message.contains("the cloud has intensity, classification"), "{message}");
    assert!(!fails(folder.path(), "render hill.ply -o out.png --color-range 4:0", 2).is_empty());
}

#[test]
fn classes_are_chosen_and_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let cloud = hill(folder.path(), true);
    let high = cloud.fields[1].values.iter().filter(|&&class| class == 6.0).count();
    for (classes, count) in [("6", high), ("!2", high), ("2,6", cloud.len()), ("!7,18", cloud.len())] {
        let message =
            message_of(&succeeds(folder.path(), &format!("convert hill.ply -o out.laz --classes {classes}")));
        assert!(message.contains(&format!("{count} points")), "{classes}: {message}");
    }
    assert!(fails(folder.path(), "render hill.ply -o out.png --classes 9", 1).contains("there are 2, 6"));
    fs::write(folder.path().join("bare.xyz"), "1 2 3\n").unwrap();
    assert!(fails(folder.path(), "render bare.xyz -o out.png --classes 2", 1).contains("no classification"));
    succeeds(folder.path(), "convert bare.xyz -o out.las --classes !7,18");
}

#[test]
fn claims_of_billions_of_points_fail_at_once_in_little_memory() {
    let folder = tempfile::tempdir().unwrap();
    hill(folder.path(), true);
    for name in ["hill.las", "hill.laz"] {
        succeeds(folder.path(), &format!("convert hill.ply -o {name}"));
        let mut bytes = fs::read(folder.path().join(name)).unwrap();
        bytes[107..111].copy_from_slice(&4_000_000_000_u32.to_le_bytes());
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    let pcd = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 4000000000\nDATA binary\n1 2 3\n";
    fs::write(folder.path().join("hill.pcd"), pcd).unwrap();
    fs::write(folder.path().join("hill.pts"), "4000000000\n1 2 3\n").unwrap();
    for name in ["hill.las", "hill.laz", "hill.pcd", "hill.pts"] {
        // The whole address space, program and libraries included, is held to 100 MB (ulimit counts in KiB).
        let line = format!("ulimit -v 97656 && exec {PROGRAM} info {name}");
        let start = Instant::now();
        let output = Command::new("sh").current_dir(folder.path()).args(["-c", &line]).output().unwrap();
        let message = message_of(&output);
        assert_eq!(output.status.code(), Some(1), "{name}: {message}");
        assert!(message.contains("4000000000"), "{message}");
        assert!(start.elapsed() < Duration::from_secs(2), "{name}: {:?}", start.elapsed());
    }
}

#[test]
fn info_tells_columns_fields_and_assumptions() {
    let folder = tempfile::tempdir().unwrap();
    hill(folder.path(), true);
    succeeds(folder.path(), "convert hill.ply -o hill.las");
    let info = |arguments: &str| -> serde_json::Value {
        serde_json::from_slice(&succeeds(folder.path(), &format!("info --json {arguments}")).stdout).unwrap()
    };
    let las = info("hill.las");
    assert_eq!(las["format"], "LAS 1.2, point format 2");
    assert_eq!(las["bounds"][0][0], 500_000.25);
    assert_eq!(las["fields"][0]["name"], "intensity");
    assert_eq!(las["fields"][0]["range"], serde_json::json!([0.0, 195.0, 390.0]));
    assert_eq!(las["elements"][0]["properties"][3]["used_as"], "color");

    fs::write(folder.path().join("a.txt"), "7 1 2 3\n8 4 5 6\n").unwrap();
    let text = info("a.txt --columns time,x,y,z");
    assert_eq!((&text["bounds"][0][0], &text["fields"][0]["name"]), (&1.0.into(), &"time".into()));
    let guessed = info("a.txt")["assumptions"].to_string();
    assert!(guessed.contains("taken as x y z intensity"), "{guessed}");
    assert!(fails(folder.path(), "info a.txt --columns x,y", 2).contains("x, y and z"));
}

/// The octree has the points in another order.
#[test]
fn a_survey_and_its_octree_give_the_same_picture() {
    let Some(data) = real_files() else { return };
    let folder = tempfile::tempdir().unwrap();
    let of = |name: &str| picture(folder.path(), data.join(name).to_str().unwrap());
    assert!(of("clouds/1.2-with-color.las") == of("clouds/1.2-with-color.copc.laz"));
}
