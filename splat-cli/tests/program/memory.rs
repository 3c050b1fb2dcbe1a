//! `--max-memory`: the same bytes, or a refusal before the memory is taken; and no more than the limit and 64 MB.

use super::common::{PROGRAM, message_of};
use super::faults::sheet;
use glam::{DVec3, Vec2, Vec3};
use splat_core::{Cloud, Shapes, TextureCoordinates};
use splat_io::{CloudTarget, PlyEncoding, write_cloud, write_ply};
use std::fs;
use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

const MEGABYTE: u64 = 1 << 20;

/// What may be taken beyond the limit.
const SLACK: u64 = 64 * MEGABYTE;

/// How a run ended, what it said, and the most memory that it held.
struct Run {
    code: Option<i32>,
    message: String,
    peak: u64,
}

/// Runs the program in `folder`, and watches its memory.
fn watched(folder: &Path, command: &str) -> Run {
    let mut child = Command::new(PROGRAM)
        .current_dir(folder)
        .args(command.split_whitespace())
        .stderr(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let status = format!("/proc/{}/status", child.id());
    let mut peak = 0;
    while child.try_wait().unwrap().is_none() {
        peak = peak.max(fs::read_to_string(&status).ok().and_then(|text| high_water(&text)).unwrap_or(0));
        std::thread::sleep(Duration::from_micros(500));
    }
    let mut message = String::new();
    child.stderr.take().unwrap().read_to_string(&mut message).unwrap();
    Run { code: child.wait().unwrap().code(), message, peak }
}

fn high_water(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}

/// A sheet without anything but its points.
fn bare(side: u32) -> Cloud {
    let sheet = sheet(side);
    Cloud::from_points(&(0..sheet.len()).map(|index| sheet.world_position(index)).collect::<Vec<_>>())
}

/// Discs that all cover the whole picture, one behind the other.
fn pile(count: u32) -> Cloud {
    let points: Vec<DVec3> = (0..count).map(|i| DVec3::new(0.0, 0.0, f64::from(i) * 1e-3)).collect();
    let mut cloud = Cloud::from_points(&points);
    cloud.normals = vec![Vec3::Z; points.len()];
    cloud.shapes = Shapes::Discs(vec![5.0; points.len()]);
    cloud.areas = Some(vec![1.0; points.len()]);
    cloud.opacities = Some(vec![0.01; points.len()]);
    cloud
}

/// A textured sheet, and its image.
fn textured(folder: &Path, side: u32, texels: u32) {
    let mut cloud = sheet(side);
    let coordinates = |index: usize| {
        let place = cloud.world_position(index);
        TextureCoordinates {
            center: Vec2::new(place.x as f32, place.y as f32),
            ..TextureCoordinates::default()
        }
    };
    cloud.texture_coordinates = Some((0..cloud.len()).map(coordinates).collect());
    write_ply(&folder.join("in.ply"), &cloud, PlyEncoding::Binary).unwrap();
    let file = fs::File::create(folder.join("image.png")).unwrap();
    let mut encoder = png::Encoder::new(file, texels, texels);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_compression(png::Compression::Fastest);
    let bytes: Vec<u8> =
        (0..texels * texels * 4).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    encoder.write_header().unwrap().write_image_data(&bytes).unwrap();
}

/// A scene, a command, and the limits in MB under which it is run: refused under the first, done under the last.
struct Case {
    make: fn(&Path),
    command: &'static str,
    limits: &'static [u64],
}

const CASES: &[Case] = &[
    Case {
        make: |folder| write_ply(&folder.join("in.ply"), &bare(250), PlyEncoding::Binary).unwrap(),
        command: "render in.ply -o out.exr --size 320x240 --spp 4 --threads 1",
        limits: &[16, 96, 256],
    },
    Case {
        make: |folder| {
            write_cloud(&folder.join("in.xyz"), &bare(250), CloudTarget::Text, PlyEncoding::Ascii).unwrap();
        },
        command: "prepare in.xyz -o out.ply --threads 4",
        limits: &[16, 512],
    },
    Case {
        make: |folder| {
            write_cloud(&folder.join("in.las"), &sheet(400), CloudTarget::Las, PlyEncoding::Binary).unwrap();
        },
        command: "convert in.las -o out.laz",
        limits: &[16, 256],
    },
    Case {
        make: |folder| {
            write_cloud(&folder.join("in.laz"), &sheet(400), CloudTarget::Laz, PlyEncoding::Binary).unwrap();
        },
        command: "convert in.laz -o out.csv",
        limits: &[16, 256],
    },
    Case {
        make: |folder| write_ply(&folder.join("in.ply"), &sheet(20), PlyEncoding::Binary).unwrap(),
        command: "render in.ply -o out.exr --size 1500x1000 --spp 1 --aov all --exr-compression none --threads 2",
        limits: &[64, 200, 900],
    },
    // Of a part of the samples there are sums, too.
    Case {
        make: |folder| write_ply(&folder.join("in.ply"), &sheet(20), PlyEncoding::Binary).unwrap(),
        command: "render in.ply -o out.exr --size 1000x600 --spp 2 --samples 0:1 --aov all --exr-compression none",
        limits: &[64, 120, 900],
    },
    Case {
        make: |folder| write_ply(&folder.join("in.ply"), &pile(1200), PlyEncoding::Binary).unwrap(),
        command: "render in.ply -o out.png --size 64x64 --spp 16 --threads 1 --resolve over",
        limits: &[7, 24, 1024],
    },
    Case {
        make: |folder| write_ply(&folder.join("in.ply"), &pile(1200), PlyEncoding::Binary).unwrap(),
        command: "render in.ply -o out.png --size 64x64 --spp 16 --threads 4",
        limits: &[7, 40, 1024],
    },
    Case {
        make: |folder| write_ply(&folder.join("in.ply"), &pile(800), PlyEncoding::Binary).unwrap(),
        command: "render in.ply -o out.png --size 64x64 --spp 4 --engine reference",
        limits: &[7, 40, 1024],
    },
    Case {
        make: |folder| write_ply(&folder.join("in.ply"), &sheet(60), PlyEncoding::Binary).unwrap(),
        command: "render in.ply -o out.png --size 160x120 --spp 64 --lens-radius 0.3 --threads 2",
        limits: &[8, 64, 512],
    },
    Case {
        make: |folder| textured(folder, 40, 1500),
        command: "render in.ply -o out.png --texture image.png --size 160x120 --spp 1 --threads 2",
        limits: &[32, 100, 512],
    },
];

#[cfg(target_os = "linux")]
#[test]
fn a_limit_holds_and_changes_no_byte() {
    for Case { make, command, limits } in CASES {
        let folder = tempfile::tempdir().unwrap();
        make(folder.path());
        let output = command.split_whitespace().skip_while(|word| *word != "-o").nth(1).unwrap();
        let output = folder.path().join(output);
        let free = watched(folder.path(), command);
        assert_eq!(free.code, Some(0), "{command}: {}", free.message);
        let expected = fs::read(&output).unwrap();
        let mut done = Vec::new();
        for limit in *limits {
            fs::remove_file(&output).unwrap_or_default();
            let run = watched(folder.path(), &format!("{command} --max-memory {limit}M"));
            let Run { code, message, peak } = &run;
            let said = format!("{command} --max-memory {limit}M: {} MB, {message}", peak / MEGABYTE);
            assert!(*peak <= limit * MEGABYTE + SLACK, "{said}");
            match code {
                Some(0) => assert!(fs::read(&output).unwrap() == expected, "{said}"),
                Some(1) => {
                    assert!(message.contains(" of memory, and ") && message.contains(" left: "), "{said}");
                    assert!(!output.exists(), "{said}");
                }
                _ => panic!("{said}"),
            }
            done.push(*code == Some(0));
        }
        assert!(!done[0] && done[done.len() - 1], "{command}: {done:?}");
        assert!(done.is_sorted(), "{command}: {done:?}");
    }
}

#[cfg(unix)]
#[test]
fn what_the_system_refuses_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    write_ply(&folder.path().join("in.ply"), &sheet(9), PlyEncoding::Binary).unwrap();
    // 69 GB of colours; the address space is held to 2 GB (ulimit counts in KiB).
    let line = format!(
        "ulimit -v 2000000 && exec {PROGRAM} render in.ply -o out.png --size 65536x65536 --spp 1 --threads 1"
    );
    let output = Command::new("sh").current_dir(folder.path()).args(["-c", &line]).output().unwrap();
    let message = message_of(&output);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("the picture needs 64.0 GB of memory, and the system has no more"), "{message}");
}
