//! Pieces of pictures, joined.

use crate::common::{fails, read_png, succeeds};
use glam::DVec3;
use splat_core::{Cloud, Shapes};
use splat_io::{PlyEncoding, Values, read_exr, write_ply};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// A ball over a roof whose two sides' normals cancel along the ridge; some of it transparent.
fn scene() -> Cloud {
    let golden_angle = std::f64::consts::PI * (3.0 - 5.0f64.sqrt());
    let ball = (0..500).map(|i| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / 500.0;
        let (sin, cos) = (golden_angle * f64::from(i)).sin_cos();
        let normal = DVec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z);
        (0.6 * normal, normal)
    });
    let roof = (0..400).map(|i| {
        let (x, z) = (f64::from(i % 20) / 9.5 - 1.0, f64::from(i / 20) / 9.5 - 1.0);
        (DVec3::new(x, -0.5 - 0.5 * x.abs(), z), DVec3::new(0.5 * x.signum(), 1.0, 0.0).normalize())
    });
    let (points, normals): (Vec<DVec3>, Vec<DVec3>) = ball.chain(roof).unzip();
    let mut cloud = Cloud::from_points(&points);
    cloud.normals = normals.iter().map(|normal| normal.as_vec3()).collect();
    cloud.colors = Some(normals.iter().map(|normal| (0.5 + 0.5 * normal).as_vec3()).collect());
    cloud.opacities = Some((0..points.len()).map(|i| [1.0, 0.6, 0.9][i % 3]).collect());
    cloud.shapes = Shapes::Discs(vec![0.07; points.len()]);
    cloud.oriented = true;
    cloud
}

/// A folder with the scene.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    write_ply(&folder.path().join("in.ply"), &scene(), PlyEncoding::Binary).unwrap();
    folder
}

const RENDER: &str = "render in.ply --quiet --size 48x36 --spp 16";
const LENS: &str = "--lens-radius 0.3 --background 0.2,0.3,0.5,0.5 --aov all";

fn bytes(folder: &Path, name: &str) -> Vec<u8> {
    fs::read(folder.join(name)).unwrap()
}

#[test]
fn tiles_and_crops_are_the_file_of_one_run() {
    let folder = folder();
    let folder = folder.path();
    for options in ["--resolve surface --exr-type float --exr-compression piz", "--resolve over --threads 1"]
    {
        succeeds(folder, &format!("{RENDER} {LENS} {options} -o whole.exr"));
        for tile in 0..6 {
            succeeds(folder, &format!("{RENDER} {LENS} {options} -o tile{tile}.exr --tile {tile}/3x2"));
        }
        succeeds(folder, "merge tile3.exr tile0.exr tile5.exr tile1.exr tile4.exr tile2.exr -o tiles.exr");
        assert!(bytes(folder, "tiles.exr") == bytes(folder, "whole.exr"), "{options}");
    }
    // With other threads, and a crop for the whole.
    succeeds(folder, &format!("{RENDER} -o whole.exr --crop 3,5,40,30"));
    succeeds(folder, &format!("{RENDER} -o a.exr --crop 3,5,11,30 --threads 1"));
    succeeds(folder, &format!("{RENDER} -o b.exr --crop 11,5,40,30 --threads 2"));
    succeeds(folder, "merge a.exr b.exr -o crops.exr --crop 3,5,40,30 --quiet");
    assert!(bytes(folder, "crops.exr") == bytes(folder, "whole.exr"));
}

#[test]
fn channels_in_files_of_their_own_are_joined_each() {
    let folder = folder();
    let folder = folder.path();
    let line = format!("{RENDER} --aov depth,id --aov-files");
    succeeds(folder, &format!("{line} -o whole.png"));
    for tile in 0..2 {
        succeeds(folder, &format!("{line} -o tile{tile}.exr --tile {tile}/2x1"));
    }
    for aov in ["depth", "id"] {
        succeeds(folder, &format!("merge tile0.{aov}.exr tile1.{aov}.exr -o joined.exr"));
        assert!(bytes(folder, "joined.exr") == bytes(folder, &format!("whole.{aov}.exr")), "{aov}");
    }
}

#[test]
fn ranges_of_samples_agree_to_two_units_in_the_last_place() {
    let folder = folder();
    let folder = folder.path();
    for resolve in ["surface --coverage soft", "over"] {
        let line = format!("{RENDER} {LENS} --resolve {resolve} --exr-type float");
        succeeds(folder, &format!("{line} -o whole.exr"));
        for (name, options) in [
            ("a", "--samples 0:3"),
            ("b", "--samples 3:4"),
            ("c", "--samples 4:16 --tile 0/2x1"),
            ("d", "--samples 4:9 --tile 1/2x1 --threads 1"),
            ("e", "--samples 9:16 --tile 1/2x1"),
        ] {
            succeeds(folder, &format!("{line} -o {name}.exr {options}"));
            // The ranges of the whole frame are needed by tile, too.
            if !options.contains("tile") {
                for tile in 0..2 {
                    succeeds(folder, &format!("{line} -o {name}{tile}.exr {options} --tile {tile}/2x1"));
                }
            }
        }
        succeeds(folder, "merge e.exr b1.exr d.exr a0.exr c.exr b0.exr a1.exr -o joined.exr");
        succeeds(folder, "diff whole.exr joined.exr --ulp 2 --quiet");
        // What sums are exact in any order is the same to the bit.
        succeeds(folder, "diff whole.exr joined.exr --quiet --channels N,id,layers,samples");
        let [whole, joined] = ["whole.exr", "joined.exr"].map(|name| read_exr(&folder.join(name)).unwrap());
        assert_eq!(whole.metadata, joined.metadata);
        let names = |picture: &splat_io::ExrPicture| -> Vec<String> {
            picture.channels.iter().map(|(name, _)| name.clone()).collect()
        };
        assert_eq!(names(&whole), names(&joined));
        // The range alone is not the whole; else this test would say nothing.
        fails(folder, "diff whole.exr a.exr --quiet --channels R", 1);
        let Some(Values::Float(normals)) = whole.channel("N.X") else { panic!("no normals") };
        assert!(normals.iter().any(|x| *x > 0.3) && normals.iter().any(|x| *x < -0.3));
    }
}

#[test]
fn halves_and_pictures_for_the_screen_are_those_of_one_run() {
    let folder = folder();
    let folder = folder.path();
    for (kind, whole) in [("half", "whole.exr"), ("float", "whole.png")] {
        succeeds(folder, &format!("{RENDER} --exr-type {kind} -o {whole}"));
        for (name, range) in [("a.exr", "0:8"), ("b.exr", "8:16")] {
            succeeds(folder, &format!("{RENDER} --exr-type {kind} -o {name} --samples {range}"));
        }
        if kind == "half" {
            succeeds(folder, "merge a.exr b.exr -o joined.exr");
            succeeds(folder, "diff whole.exr joined.exr --ulp 1 --quiet");
            let message = fails(folder, "merge a.exr b.exr -o joined.png", 2);
            assert!(message.contains("--exr-type float"), "{message}");
        } else {
            succeeds(folder, "merge a.exr b.exr -o joined.png");
            let [a, b] = ["whole.png", "joined.png"].map(|name| read_png(&folder.join(name)));
            assert!(a == b);
        }
    }
}

#[test]
fn what_would_leave_gaps_or_overlap_is_refused() {
    let folder = folder();
    let folder = folder.path();
    for (name, options) in [
        ("left", "--crop 0,0,20,36"),
        ("right", "--crop 20,0,48,36"),
        ("wide", "--crop 19,0,48,36"),
        ("upper", "--crop 20,0,48,20"),
        ("early", "--samples 0:6"),
        ("late", "--samples 10:16"),
        ("most", "--samples 5:16"),
        ("rest", "--samples 6:16"),
        ("whole", ""),
    ] {
        succeeds(folder, &format!("{RENDER} -o {name}.exr {options}"));
    }
    let refusals = [
        ("left.exr", "1008 pixels of 0,0,48,36 are in no piece, the first at 20,0"),
        ("left.exr upper.exr", "448 pixels of 0,0,48,36 are in no piece, the first at 20,20"),
        ("left.exr wide.exr", "both have the pixels 19,0,20,36: leave one"),
        ("left.exr right.exr left.exr", "both have samples"),
        ("whole.exr right.exr", "both have the pixels 20,0,48,36"),
        (
            "early.exr late.exr",
            "no piece has the samples 6:10 of the pixels 0,0,48,36: render them with --samples 6:10",
        ),
        ("rest.exr", "no piece has the samples 0:6"),
        ("early.exr", "no piece has the samples 6:16"),
        ("early.exr most.exr", "both have samples from 5 on"),
        ("early.exr rest.exr --crop 0,0,20,36", "reach beyond the whole"),
    ];
    for (pieces, expected) in refusals {
        let message = fails(folder, &format!("merge {pieces} -o out.exr"), 1);
        assert!(message.contains(expected), "{pieces}: {message}");
    }
    let message = fails(folder, "merge left.exr right.exr --crop 0,0,49,36 -o out.exr", 2);
    assert!(message.contains("--crop reaches beyond the frame of 48x36 pixels"), "{message}");
    assert!(!folder.join("out.exr").exists());
    succeeds(folder, "merge early.exr rest.exr -o out.exr");
    succeeds(folder, "merge left.exr right.exr -o out.exr");
}

#[test]
fn pieces_of_different_pictures_are_refused() {
    let folder = folder();
    let folder = folder.path();
    let other = Cloud { opacities: None, ..scene() };
    write_ply(&folder.join("other.ply"), &other, PlyEncoding::Binary).unwrap();
    succeeds(folder, &format!("{RENDER} -o first.exr --tile 0/2x1"));
    let others = [
        ("--exp lerp256", "the options"),
        ("--radius-scale 1.5", "the options"),
        ("--view front", "the camera"),
        ("--lens-radius 0.1", "the camera"),
        ("--near 0.5", "the camera"),
        ("--seed 1", "--seed"),
        ("--spp 8", "--spp"),
        ("--size 64x48", "the frame"),
        ("--exr-type float", "the channels"),
        ("--aov depth", "the channels"),
        ("--engine reference", "the engine"),
    ];
    for (options, expected) in others {
        let line =
            format!("render in.ply --quiet --size 48x36 --spp 16 {options} -o second.exr --tile 1/2x1");
        // What is said twice is said last.
        let line = match options.split_whitespace().next() {
            Some("--size") => line.replacen("--size 48x36 ", "", 1),
            Some("--spp") => line.replacen("--spp 16 ", "", 1),
            _ => line,
        };
        succeeds(folder, &line);
        let message = fails(folder, "merge first.exr second.exr -o out.exr", 1);
        let whole = format!("not pieces of one picture: {expected}");
        assert!(message.contains(&whole) && message.contains("one command line"), "{options}: {message}");
    }
    succeeds(folder, &format!("{} -o second.exr --tile 1/2x1", RENDER.replace("in.ply", "other.ply")));
    let message = fails(folder, "merge first.exr second.exr -o out.exr", 1);
    assert!(message.contains("the inputs (inputHash)"), "{message}");
}

#[test]
fn files_that_cannot_be_pieces_are_refused() {
    let folder = folder();
    let folder = folder.path();
    succeeds(folder, &format!("{RENDER} -o a.png --tile 0/2x1"));
    let message = fails(folder, "merge a.png -o out.exr", 1);
    assert!(message.contains("pieces must be .exr files"), "{message}");
    succeeds(folder, &format!("{RENDER} -o a.exr --aov depth --aov-files --samples 0:8"));
    succeeds(folder, &format!("{RENDER} -o b.exr --aov depth --aov-files --samples 8:16"));
    for name in ["", ".depth"] {
        let message = fails(folder, &format!("merge a{name}.exr b{name}.exr -o out.exr"), 1);
        assert!(message.contains("no sums") && message.contains("without --aov-files"), "{message}");
    }
    // A picture of no known making: that of a difference.
    succeeds(folder, &format!("{RENDER} -o c.exr"));
    succeeds(folder, "diff c.exr c.exr -o strange.exr --quiet");
    let message = fails(folder, "merge strange.exr -o out.exr", 1);
    assert!(message.contains("does not say how it was made (no software)"), "{message}");
    fs::write(folder.join("broken.exr"), &bytes(folder, "c.exr")[..900]).unwrap();
    fails(folder, "merge broken.exr -o out.exr", 1);
    fails(folder, "merge c.exr -o c.exr", 2);
    fails(folder, "merge c.exr -o out.jpg", 2);
    fails(folder, "merge -o out.exr", 2);
    assert!(!folder.join("out.exr").exists());
}
