//! `.splat` and `.spz` files made here, and those of other people's programs, where `SPLAT_TEST_DATA` names a folder that
//! has them.

use super::*;
use crate::{CloudOptions, Error, Import, read_cloud};
use flate2::Compression;
use flate2::write::GzEncoder;
use glam::{DVec3, Vec3};
use proptest::prelude::*;
use ruzstd::encoding::{CompressionLevel, compress_to_vec};
use splat_core::{Cloud, Shapes, SphericalHarmonics, srgb};
use std::io::Write;
use std::path::Path;
use std::path::PathBuf;

fn spz(bytes: &[u8]) -> Result<Import, Error> {
    read_spz_from(bytes, bytes.len() as u64, Path::new("x.spz"))
}

fn read_any(path: &Path) -> Result<Import, Error> {
    read_cloud(path, &CloudOptions::default())
}

fn splat(bytes: &[u8]) -> Result<Import, Error> {
    read_splat_from(bytes, bytes.len() as u64, Path::new("x.splat"))
}

fn axes(cloud: &Cloud) -> &[[Vec3; 2]] {
    let Shapes::Ellipses(axes) = &cloud.shapes else { panic!("{:?}", cloud.shapes) };
    axes
}

// ---------------------------------------------------------------------------------------------------------
// Files made here

/// The header of an `.spz` file.
fn spz_header(version: u32, count: u32, degree: u8) -> Vec<u8> {
    let mut header = b"NGSP".to_vec();
    header.extend(version.to_le_bytes());
    header.extend(count.to_le_bytes());
    header.extend([degree, 12, 0, 6]);
    header
}

/// The streams of `count` splats with harmonics of degree 1, all alike.
fn spz_streams(version: u32, count: usize) -> [Vec<u8>; 6] {
    let rotation = if version == 2 { vec![128, 128, 128] } else { (3_u32 << 30).to_le_bytes().to_vec() };
    let splat: [Vec<u8>; 6] = [
        // 1, -1/4096 and 2 in 12 fractional bits.
        vec![0, 16, 0, 255, 255, 255, 0, 32, 0],
        vec![51],
        vec![255, 0, 128],
        vec![160, 176, 144],
        rotation,
        vec![0, 64, 128, 192, 255, 128, 128, 128, 64],
    ];
    splat.map(|bytes| bytes.repeat(count))
}

fn gzip(data: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(data).unwrap();
    encoder.finish().unwrap()
}

/// An `.spz` file of `count` splats.
fn spz_file(version: u32, count: usize) -> Vec<u8> {
    let streams = spz_streams(version, count);
    let mut file = spz_header(version, count as u32, 1);
    if version < 4 {
        file.extend(streams.concat());
        return gzip(&file);
    }
    let frames = streams.each_ref().map(|data| compress_to_vec(&data[..], CompressionLevel::Fastest));
    file.extend(32_u32.to_le_bytes());
    file.extend([0; 12]);
    for (frame, data) in frames.iter().zip(&streams) {
        file.extend((frame.len() as u64).to_le_bytes());
        file.extend((data.len() as u64).to_le_bytes());
    }
    file.extend(frames.concat());
    file
}

#[test]
fn spz_files_of_every_version_are_the_same_splats() {
    for version in 2..=4 {
        let import = spz(&spz_file(version, 3)).unwrap();
        assert_eq!(import.report.format, format!("spz, version {version}"));
        let cloud = import.cloud;
        assert_eq!((cloud.check_lengths(), cloud.len(), cloud.trained), (Ok(()), 3, true));
        // y and z are reversed.
        assert_eq!(cloud.world_position(2), DVec3::new(1.0, 1.0 / 4096.0, -2.0));
        assert!((cloud.opacities.as_ref().unwrap()[2] - 0.2).abs() < 1e-7);
        // Scales of 1, e and 1/e: the third axis is the shortest.
        assert!(cloud.normals[2].abs_diff_eq(Vec3::Z, 2e-2), "{}", cloud.normals[2]);
        let [t1, t2] = axes(&cloud)[2];
        assert!(t1.abs_diff_eq(Vec3::X, 2e-2) && t2.abs_diff_eq(1f32.exp() * Vec3::Y, 4e-2), "{t1} {t2}");
        let terms = cloud.harmonics.as_ref().unwrap().of(2);
        let tenth = 0.5 / 0.15;
        assert!(terms[0].abs_diff_eq(Vec3::new(tenth, -tenth, 0.5 / 255.0 / 0.15), 1e-4));
        assert_eq!(terms[1], Vec3::new(1.0, 0.5, 0.0), "y is reversed, and its term");
        assert_eq!(terms[2], Vec3::new(-0.5, -127.0 / 128.0, 0.0), "so is z");
        assert_eq!(terms[3], Vec3::new(0.0, 0.0, -0.5));
    }
}

#[test]
fn claims_of_spz_files_are_held_against_the_file() {
    let message = |bytes: &[u8]| spz(bytes).unwrap_err().to_string();
    for (version, degree, expected) in [
        (1, 0, "version 1 of .spz is not supported, expected version 2, 3 or 4"),
        (5, 0, "version 5"),
        (3, 9, "found degree 9"),
        (4, 0, "version 4 in a gzip file"),
    ] {
        let message = message(&gzip(&spz_header(version, 0, degree)));
        assert!(message.contains(expected), "{message}");
    }
    let mut extended = spz_header(3, 0, 0);
    extended[14] = 2;
    assert!(message(&gzip(&extended)).contains("extensions"));

    // Many splats in a small file: refused before anything is unpacked.
    let claim = message(&gzip(&spz_header(3, 4_000_000_000, 3)));
    assert!(claim.contains("4000000000 splats, 260000000000 bytes, expected at most"), "{claim}");
    assert!(message(&spz_header(3, 100_000, 0)).contains("expected at most 1050176 bytes"));
    assert!(message(&spz_header(4, 100_000, 0)).contains("expected at most 1050176 bytes"));
    // A bomb: a megabyte of zeros behind one splat.
    let bomb = [spz_header(3, 1, 0), vec![0; 1 << 20]].concat();
    assert!(message(&gzip(&bomb)).contains("more data than the splats have"));
    // The same as a frame.
    let mut bomb = spz_file(4, 1);
    let frame = compress_to_vec(&vec![0; 1 << 20][..], CompressionLevel::Fastest);
    bomb[32..40].copy_from_slice(&(frame.len() as u64).to_le_bytes());
    let from = 32 + 6 * 16;
    bomb.splice(from..from, frame);
    assert!(message(&bomb).contains("more data than the splats have"));
    // Sizes that do not fit, and places beyond the file.
    let mut wrong = spz_file(4, 1);
    wrong[40] += 1;
    assert!(message(&wrong).contains("found 10 bytes of positions, expected 9 for 1 splats"));
    for place in [16, 32, 39] {
        let mut beyond = spz_file(4, 1);
        beyond[place..place + 1].copy_from_slice(&[255]);
        assert!(spz(&beyond).is_err(), "{place}");
    }
    assert!(message(b"").contains("the end of the data after 0 bytes"));
    assert!(message(b"plain text, 16 b").contains("found `plai`, expected `NGSP`"));
}

/// The record of a `.splat` file.
fn record(position: [f32; 3], scales: [f32; 3], rgba: [u8; 4], rotation: [u8; 4]) -> Vec<u8> {
    let numbers = position.into_iter().chain(scales).flat_map(f32::to_le_bytes);
    numbers.chain(rgba).chain(rotation).collect()
}

#[test]
fn splat_records_are_what_they_say() {
    // A quarter of a turn around x: y goes to z.
    let first = record([1.0, -2.0, 3.0], [0.25, 0.0, 0.5], [255, 0, 51, 102], [219, 219, 128, 128]);
    let import = splat(&[first, vec![0; 32]].concat()).unwrap();
    let cloud = import.cloud;
    assert_eq!((cloud.len(), cloud.trained, &cloud.harmonics), (2, true, &None));
    assert_eq!(cloud.world_position(0), DVec3::new(1.0, -2.0, 3.0));
    assert!(cloud.normals[0].abs_diff_eq(Vec3::Z, 1e-6));
    let [t1, t2] = axes(&cloud)[0];
    assert!(t1.abs_diff_eq(-0.5 * Vec3::Y, 1e-6) && t2.abs_diff_eq(0.25 * Vec3::X, 1e-6), "{t1} {t2}");
    let expected = Vec3::new(1.0, 0.0, srgb::decode(0.2) as f32);
    assert!(cloud.colors.as_ref().unwrap()[0].abs_diff_eq(expected, 1e-6));
    assert!((cloud.opacities.as_ref().unwrap()[0] - 0.4).abs() < 1e-7);
    assert_eq!(cloud.defect(0), None);
    assert!(cloud.defect(1).is_some(), "a splat without a size");
    assert!(splat(&[0; 33]).unwrap_err().to_string().contains("found 33 bytes, expected a multiple of 32"));
    assert!(splat(&[]).unwrap().cloud.is_empty());
}

#[test]
fn what_is_written_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.splat");
    let axes_of = [
        // Perpendicular; the second longer; slanted.
        [Vec3::new(0.3, 0.0, 0.0), Vec3::new(0.0, 0.1, 0.1)],
        [Vec3::new(0.1, 0.0, 0.0), Vec3::new(0.0, 0.3, -0.3)],
        [Vec3::new(0.2, 0.1, 0.0), Vec3::new(0.2, 0.0, 0.1)],
    ];
    let mut cloud = Cloud::from_points(&[DVec3::ONE, DVec3::NAN, DVec3::new(1e6, 2.0, 3.0)]);
    cloud.normals = axes_of.iter().map(|[t1, t2]| t1.cross(*t2).normalize()).collect();
    cloud.shapes = Shapes::Ellipses(axes_of.to_vec());
    cloud.colors = Some([0.0, 0.5, 2.0].map(Vec3::splat).to_vec());
    cloud.opacities = Some(vec![0.25, 0.5, 1.0]);
    assert_eq!(write_splat(&path, &cloud).unwrap(), 1);
    let back = read_any(&path).unwrap().cloud;
    assert_eq!(back.len(), 2);
    for (index, old) in [(0, 0), (1, 2)] {
        assert_eq!(back.world_position(index), cloud.world_position(old));
        assert!((back.opacities.as_ref().unwrap()[index] - [0.25, 0.5, 1.0][old]).abs() <= 0.5 / 255.0);
        let covariance = |axes: &[Vec3; 2], d: Vec3| axes.iter().map(|axis| axis.dot(d).powi(2)).sum::<f32>();
        for direction in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE] {
            let (new, old) =
                (covariance(&axes(&back)[index], direction), covariance(&axes_of[old], direction));
            assert!((new - old).abs() < 0.02 * 0.3, "{direction}: {new} {old}");
        }
    }
    assert_eq!(back.colors.as_ref().unwrap()[0], Vec3::ZERO);
    assert!(back.colors.as_ref().unwrap()[1].abs_diff_eq(Vec3::ONE, 1e-6), "clamped");

    // What comes from such a file survives another round, to the byte's step.
    assert_eq!(write_splat(&path, &back).unwrap(), 0);
    let again = read_any(&path).unwrap().cloud;
    assert_eq!((again.positions, again.opacities), (back.positions, back.opacities));
    for (new, old) in again.colors.unwrap().into_iter().zip(back.colors.unwrap()) {
        assert!(new.abs_diff_eq(old, 1e-6));
    }

    let mut discs = Cloud::from_points(&[DVec3::ZERO]);
    discs.normals = vec![Vec3::new(0.6, 0.0, 0.8)];
    discs.shapes = Shapes::Discs(vec![0.5]);
    assert_eq!(write_splat(&path, &discs).unwrap(), 0);
    let back = read_any(&path).unwrap().cloud;
    assert!(back.normals[0].abs().abs_diff_eq(discs.normals[0], 0.02), "{}", back.normals[0]);
    let [t1, t2] = axes(&back)[0];
    assert!((t1.length() - 0.5).abs() < 1e-6 && (t2.length() - 0.5).abs() < 1e-6);
}

#[test]
fn files_cut_off_anywhere_are_an_error() {
    for version in 2..=4 {
        let bytes = spz_file(version, 2);
        for length in 0..bytes.len() {
            assert!(spz(&bytes[..length]).is_err(), "version {version}, {length} of {}", bytes.len());
        }
    }
    let bytes = [0; 96];
    for length in (0..96).filter(|length| length % 32 != 0) {
        assert!(splat(&bytes[..length]).is_err());
        // The file system may have promised more than there is.
        assert!(read_splat_from(&bytes[..length], 96, Path::new("x.splat")).is_err());
    }
}

proptest! {
    #[test]
    fn damaged_files_never_panic(
        version in 2_u32..5,
        unpacked in any::<bool>(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
    ) {
        let mut bytes = spz_file(version, 5);
        if unpacked && version < 4 {
            bytes = [spz_header(version, 5, 1), spz_streams(version, 5).concat()].concat();
        }
        for (place, value) in changes {
            let place = place.index(bytes.len());
            bytes[place] = value;
        }
        if let Ok(import) = spz(&bytes) {
            prop_assert_eq!(import.cloud.check_lengths(), Ok(()));
        }
        bytes.truncate(bytes.len() / 32 * 32);
        prop_assert_eq!(splat(&bytes).unwrap().cloud.check_lengths(), Ok(()));
    }
}

// ---------------------------------------------------------------------------------------------------------
// Files of other programs

fn real_file(name: &str) -> Option<PathBuf> {
    Some(Path::new(&std::env::var_os("SPLAT_TEST_DATA")?).join("splats").join(name))
}

fn real_cloud(name: &str) -> Option<Cloud> {
    let path = real_file(name)?;
    Some(read_any(&path).unwrap().cloud)
}

/// Name, splats, degree, least and greatest coordinates, trained opacities.
type Facts = (&'static str, usize, Option<usize>, [f64; 3], [f64; 3], Option<[f64; 2]>);

#[test]
fn facts_of_real_files() {
    let low = [-1.02343023, -1.07757521, -1.02860546];
    let high = [1.02601933, 0.0359582566, 1.02876985];
    let facts: [Facts; 9] = [
        (
            "train-1000.ply",
            1000,
            Some(3),
            [-13.0210342, -3.92198253, -3.82172847],
            [10.2931576, 1.96831131, 13.8217335],
            Some([-5.2335, 3.2947]),
        ),
        ("playbot_lod5.ply", 3000, Some(2), low, high, Some([-2.7039, 5.5373])),
        ("playbot_lod5_2dgs.ply", 3000, Some(2), low, high, Some([-2.7039, 5.5373])),
        ("playbot_lod5.splat", 3000, None, low, high, None),
        ("playbot_lod5.spz", 3000, Some(2), low, high, None),
        ("playbot_lod5.compressed.ply", 3000, Some(2), low, high, None),
        ("minimal.splat", 4, None, [-1.0, 0.0, -1.0], [0.0; 3], None),
        ("minimal-v2.spz", 4, None, [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], None),
        ("minimal-v3.spz", 4, None, [-1.0, 0.0, -1.0], [0.0; 3], None),
    ];
    for (name, count, degree, low, high, opacity) in facts {
        let Some(cloud) = real_cloud(name) else { return };
        assert_eq!((cloud.len(), cloud.trained, cloud.check_lengths()), (count, true, Ok(())), "{name}");
        assert_eq!(cloud.harmonics.as_ref().map(SphericalHarmonics::degree), degree, "{name}");
        // spz: 1/8192, half a step.
        let tolerance = if name.ends_with("spz") { 1.3e-4 } else { 1e-7 * 14.0 };
        let (found_low, found_high) = cloud.bounds().unwrap();
        assert!(found_low.abs_diff_eq(DVec3::from_array(low), tolerance), "{name}: {found_low}");
        assert!(found_high.abs_diff_eq(DVec3::from_array(high), tolerance), "{name}: {found_high}");
        assert!((0..count).all(|index| cloud.defect(index).is_none()), "{name}");
        let opacities = cloud.opacities.as_ref().unwrap();
        let least = opacities.iter().copied().fold(f32::MAX, f32::min);
        let greatest = opacities.iter().copied().fold(f32::MIN, f32::max);
        if let Some(expected) = opacity.map(|range| range.map(sigmoid)) {
            assert!((f64::from(least) - expected[0]).abs() < 1e-5, "{name}: {least}");
            assert!((f64::from(greatest) - expected[1]).abs() < 1e-5, "{name}: {greatest}");
        }
    }
}

#[test]
fn minimal_files_by_hand() {
    let Some(cloud) = real_cloud("minimal.splat") else { return };
    let step = srgb::decode(85.0 / 255.0) as f32;
    let blue = srgb::decode(128.0 / 255.0) as f32;
    let colors = cloud.colors.as_ref().unwrap();
    assert!(colors[0].abs_diff_eq(Vec3::new(step, step, blue), 1e-6));
    for cloud in ["minimal.splat", "minimal-v2.spz", "minimal-v3.spz"].map(|name| real_cloud(name).unwrap()) {
        for [t1, t2] in axes(&cloud) {
            // .spz: exp(123/16 - 10), the nearest to 0.1.
            assert!(
                (t1.length() - 0.1).abs() < 1e-3 && (t2.length() - 0.1).abs() < 1e-3 && t1.dot(*t2) < 1e-6
            );
        }
        assert!(cloud.opacities.unwrap().iter().all(|opacity| (opacity - 230.0 / 255.0).abs() < 1e-6));
    }
    let ksplat = read_any(&real_file("minimal.ksplat").unwrap()).unwrap_err();
    assert!(
        matches!(ksplat, Error::Unsupported { .. }) && ksplat.to_string().contains(".ksplat"),
        "{ksplat}"
    );
}

/// How far a format's numbers may lie from the trained ones.
struct Quantised {
    name: &'static str,
    /// In scene units.
    position: f64,
    /// Of the two axes, relative to their length: rotation and scale.
    axes: f32,
    opacity: f32,
    /// Display-referred: the greatest value that the format can hold, and the step.
    color: (f32, f32),
    /// The range that holds them, and the step.
    harmonics: Option<(f32, f32)>,
}

#[test]
fn one_object_in_every_format() {
    let Some(truth) = real_cloud("playbot_lod5.ply") else { return };
    let formats = [
        // Quaternions in steps of 1/128, half of it each: an angle of up to 2 * 2 / 256; colours and opacities of 8 bits.
        Quantised {
            name: "playbot_lod5.splat",
            position: 0.0,
            axes: 0.017,
            opacity: 0.0021,
            color: (1.0, 0.0021),
            harmonics: None,
        },
        // Bounds of at most 2.1 in 10 or 11 bits; sqrt(2)/1023 and bounds of at most 8 for logarithms of scales; 18 bits of
        // colour in bounds of 3; harmonics in steps of 1/32.
        Quantised {
            name: "playbot_lod5.compressed.ply",
            position: 1.1e-3,
            axes: 0.008,
            opacity: 1e-6,
            color: (9.0, 0.006),
            harmonics: Some((4.0, 0.0158)),
        },
        // 12 fractional bits; sqrt(1/2)/511 and steps of 1/16 of logarithms; steps of 1/(255 .15) of the constant term;
        // harmonics within 1 in 5 bits (degree 1) or 4.
        Quantised {
            name: "playbot_lod5.spz",
            position: 2.2e-4,
            axes: 0.035,
            opacity: 0.0021,
            color: (1.4403, 0.004),
            harmonics: Some((1.0, 0.071)),
        },
        // In 2DGS the rotation was computed anew.
        Quantised {
            name: "playbot_lod5_2dgs.ply",
            position: 0.0,
            axes: 1e-5,
            opacity: 0.0,
            color: (9.0, 0.0),
            harmonics: Some((9.0, 0.0)),
        },
    ];
    for format in formats {
        let cloud = real_cloud(format.name).unwrap();
        for index in 0..cloud.len() {
            // The compressed file has them in another order.
            let place = cloud.world_position(index);
            let near = |other: &usize| truth.world_position(*other).distance(place);
            let other = match format.name.contains("compressed") {
                true => (0..truth.len()).min_by(|a, b| near(a).total_cmp(&near(b))).unwrap(),
                false => index,
            };
            assert!(near(&other) <= format.position, "{}: {place}", format.name);
            check_splat(&format, (&cloud, index), (&truth, other));
        }
    }
}

fn check_splat(format: &Quantised, (cloud, index): (&Cloud, usize), (truth, other): (&Cloud, usize)) {
    let name = format.name;
    let of = |values: &Option<Vec<f32>>, index: usize| values.as_ref().unwrap()[index];
    let opacity = of(&cloud.opacities, index) - of(&truth.opacities, other);
    assert!(opacity.abs() <= format.opacity, "{name} {index}: {opacity}");

    // Where two axes are the shortest to rounding, either may be dropped.
    let (new, old) = (axes(cloud)[index], axes(truth)[other]);
    let longest = old[0].length().max(old[1].length());
    let difference = |flip: f32| (0..2).map(|i| (new[i] * flip - old[i]).length()).fold(0.0, f32::max);
    let same = difference(1.0).min(difference(-1.0)) <= format.axes * longest;
    let covariance = |axes: [Vec3; 2], d: Vec3| axes.iter().map(|axis| axis.dot(d).powi(2)).sum::<f32>();
    let alike = [Vec3::X, Vec3::Y, Vec3::Z]
        .into_iter()
        .all(|d| (covariance(new, d) - covariance(old, d)).abs() <= 3.0 * format.axes * longest * longest);
    assert!(same || alike, "{name} {index}: {new:?} {old:?}");

    let color = |cloud: &Cloud, index: usize| {
        cloud.colors.as_ref().unwrap()[index].to_array().map(|value| srgb::encode(value.into()) as f32)
    };
    for (new, old) in color(cloud, index).into_iter().zip(color(truth, other)) {
        let (most, step) = format.color;
        assert!((new - old.min(most)).abs() <= step, "{name} {index}: {new} {old}");
    }
    if let Some((most, step)) = format.harmonics {
        let terms = |cloud: &Cloud, index: usize| cloud.harmonics.as_ref().unwrap().of(index)[1..].to_vec();
        for (new, old) in terms(cloud, index).into_iter().zip(terms(truth, other)) {
            let held = old.clamp(Vec3::splat(-most), Vec3::splat(most));
            assert!(new.abs_diff_eq(held, step), "{name} {index}: {new} {old}");
        }
    }
}
