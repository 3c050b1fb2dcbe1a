//! The same file from the same command, whatever the threads and instructions; the same picture from any order of the
//! input. See `determinism` of `splat-tests` for the renderer alone.

use super::common::{PROGRAM, message_of, read_png, succeeds};
use glam::{DVec3, Vec3};
use splat_core::Cloud;
use splat_io::{PlyEncoding, write_ply};
use std::fs;
use std::path::Path;
use std::process::Command;

/// Bare points with colours, of which normals, sizes and areas are estimated: a bowl of noisy points.
fn bowl(at: DVec3, count: usize) -> Cloud {
    // Multiples of irrational numbers are as good as random ones, and the same everywhere.
    let number = |i: usize, factor: f64| (factor * (i + 1) as f64).fract();
    let point = |i: usize| {
        let (x, y) = (2.0 * number(i, 2.0f64.sqrt()) - 1.0, 2.0 * number(i, 3.0f64.sqrt()) - 1.0);
        at + DVec3::new(x, y, 0.5 * (x * x + y * y) + 0.02 * number(i, 5.0f64.sqrt()))
    };
    let points: Vec<DVec3> = (0..count).map(point).collect();
    let color = |i: usize| Vec3::new(number(i, 7.0f64.sqrt()) as f32, 0.5, (i % 2) as f32);
    Cloud { colors: Some((0..count).map(color).collect()), ..Cloud::from_points(&points) }
}

fn write(folder: &Path, name: &str, cloud: &Cloud) {
    write_ply(&folder.join(name), cloud, PlyEncoding::Binary).unwrap();
}

/// The bytes of the file that `splat render` writes at a level.
fn file(folder: &Path, level: &str, arguments: &str) -> Vec<u8> {
    let arguments = format!("render a.ply b.ply -o out.exr --size 70x50 --spp 5 --quiet {arguments}");
    let mut program = Command::new(PROGRAM);
    let output = program
        .current_dir(folder)
        .args(arguments.split_whitespace())
        .env("SPLAT_LEVEL", level)
        .output()
        .unwrap();
    assert!(output.status.success(), "{arguments}: {}", message_of(&output));
    fs::read(folder.join("out.exr")).unwrap()
}

#[test]
fn threads_and_instructions_change_no_byte_of_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(folder, "a.ply", &bowl(DVec3::ZERO, 1500));
    write(folder, "b.ply", &bowl(DVec3::new(1.2, 0.3, 0.5), 900));
    let mut different = vec![];
    for part in ["--aov depth,normal,id,variance", "--lens-radius 0.2", "--tile 1/2x2", "--samples 1:4"] {
        let expected = file(folder, "portable", &format!("{part} --threads 1"));
        for (level, threads) in [("avx512", 1), ("avx512", 16), ("avx2", 3), ("portable", 2)] {
            let found = file(folder, level, &format!("{part} --threads {threads}"));
            assert!(found == expected, "{part}, {level}, {threads} threads: another file");
        }
        different.push(expected);
    }
    different.dedup();
    assert_eq!(different.len(), 4, "each part is another picture");
}

#[test]
fn the_order_of_inputs_and_points_and_the_engine_change_no_pixel() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let (a, b) = (bowl(DVec3::ZERO, 1500), bowl(DVec3::new(1.2, 0.3, 0.5), 900));
    let backwards: Vec<usize> = (0..a.len()).rev().collect();
    write(folder, "a.ply", &a);
    write(folder, "b.ply", &b);
    write(folder, "backwards.ply", &a.only(&backwards));
    let pixels = |inputs: &str| {
        succeeds(folder, &format!("render {inputs} -o out.png --size 70x50 --spp 4 --quiet"));
        read_png(&folder.join("out.png")).pixels
    };
    let expected = pixels("a.ply b.ply");
    assert!(expected.iter().filter(|pixel| pixel[3] > 0).count() > 500, "an empty picture says nothing");
    for inputs in
        ["b.ply a.ply", "backwards.ply b.ply", "b.ply backwards.ply", "a.ply b.ply --engine reference"]
    {
        assert!(pixels(inputs) == expected, "{inputs}: another picture");
    }
}
