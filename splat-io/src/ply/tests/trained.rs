//! Trained Gaussian splats: 3DGS, 2DGS and compressed.

use super::*;
use glam::{DVec3, Vec3};
use proptest::prelude::*;
use splat_core::{Shapes, SphericalHarmonics, srgb};

/// The properties of a 3DGS file with harmonics of degree 1, in no usual order, and what is not used.
const PROPERTIES: [&str; 27] = [
    "x", "scale_0", "scale_1", "scale_2", "y", "z", "nx", "ny", "nz", "f_dc_2", "f_dc_1", "f_dc_0",
    "f_rest_0", "f_rest_1", "f_rest_2", "f_rest_3", "f_rest_4", "f_rest_5", "f_rest_6", "f_rest_7",
    "f_rest_8", "opacity", "rot_3", "rot_2", "rot_1", "rot_0", "age",
];

/// A splat turned by 90 degrees around z, by a quaternion of length sqrt(8), whose first axis is the shortest.
fn splat() -> [f64; 27] {
    let (a, b, c) = (0.5_f64.ln(), 2.0_f64.ln(), 3.0_f64.ln());
    [
        1.0, a, b, c, 2.0, 3.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0,
        0.0, 2.0, 0.0, 0.0, 2.0, 77.0,
    ]
}

/// The file of these properties, with a further element before and behind.
fn gaussian_file(format: Format, without: &[&str], rows: usize) -> Vec<u8> {
    let kept: Vec<usize> = (0..27).filter(|&i| !without.contains(&PROPERTIES[i])).collect();
    let names: Vec<String> = kept.iter().map(|&i| format!("float {}", PROPERTIES[i])).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let values = splat();
    let row = || kept.iter().map(|&i| values[i].into()).collect();
    let table = Table::new("vertex", &names, (0..rows).map(|_| row()).collect());
    file(format, &[Table::faces(), table])
}

fn axes(cloud: &Cloud, index: usize) -> [Vec3; 2] {
    let Shapes::Ellipses(axes) = &cloud.shapes else { panic!("{:?}", cloud.shapes) };
    axes[index]
}

#[test]
fn a_3dgs_splat_becomes_the_disc_of_its_longer_axes() {
    for format in FORMATS {
        let import = read(&gaussian_file(format, &[], 2)).unwrap();
        let cloud = &import.cloud;
        assert_eq!((cloud.check_lengths(), cloud.len(), cloud.trained), (Ok(()), 2, true));
        assert_eq!(cloud.world_position(1), DVec3::new(1.0, 2.0, 3.0));
        assert!(cloud.normals[1].abs_diff_eq(Vec3::Y, 1e-6));
        let [t1, t2] = axes(cloud, 1);
        assert!(t1.abs_diff_eq(-2.0 * Vec3::X, 1e-6) && t2.abs_diff_eq(3.0 * Vec3::Z, 1e-6), "{t1} {t2}");
        assert_eq!(cloud.opacities.as_deref(), Some(&[0.5, 0.5][..]));

        let step = 0.282_094_79;
        let expected = [0.5 + step, 0.5, 0.5 - step].map(|value| srgb::decode(value) as f32);
        let color = cloud.colors.as_ref().unwrap()[1];
        assert!(color.abs_diff_eq(Vec3::from_array(expected), 1e-6), "{color}");
        let terms = [[1.0, 0.0, -1.0], [1.0, 4.0, 7.0], [2.0, 5.0, 8.0], [3.0, 6.0, 9.0]];
        assert_eq!(cloud.harmonics.as_ref().unwrap().of(1), terms.map(Vec3::from_array));

        let points = import.report.elements.iter().find(|element| element.is_points).unwrap();
        let usage = |name: &str| points.properties.iter().find(|p| p.name == name).unwrap().usage;
        assert_eq!([usage("rot_0"), usage("f_rest_8")], [Usage::Rotation, Usage::Harmonic]);
        assert!(matches!([usage("nx"), usage("age")], [Usage::Unused(_), Usage::Unused(_)]));
    }
}

#[test]
fn a_2dgs_splat_lies_in_its_first_two_axes() {
    let cloud = read(&gaussian_file(Format::BinaryLittleEndian, &["scale_2"], 1)).unwrap().cloud;
    assert!(cloud.normals[0].abs_diff_eq(Vec3::Z, 1e-6));
    let [t1, t2] = axes(&cloud, 0);
    assert!(t1.abs_diff_eq(0.5 * Vec3::Y, 1e-6) && t2.abs_diff_eq(-2.0 * Vec3::X, 1e-6), "{t1} {t2}");
}

#[test]
fn harmonics_of_every_degree_and_of_none() {
    for (count, degree) in [(0, None), (9, Some(1)), (24, Some(2)), (45, Some(3)), (72, Some(3))] {
        let mut names: Vec<String> = PROPERTIES.map(|name| format!("float {name}")).to_vec();
        names.retain(|name| !name.contains("rest"));
        let mut row: Vec<Value> = splat().iter().copied().map(Value::One).collect();
        row.drain(12..21);
        names.extend((0..count).map(|i| format!("float f_rest_{i}")));
        row.extend((0..count).map(|i| Value::One(f64::from(i))));
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let table = Table::new("vertex", &names, vec![row]);
        let cloud = read(&file(Format::BinaryLittleEndian, &[table])).unwrap().cloud;
        assert_eq!(cloud.harmonics.as_ref().map(SphericalHarmonics::degree), degree);
        if let Some(harmonics) = &cloud.harmonics {
            // The last term that is kept: its red, green and blue are a channel apart in the file.
            let (channel, last) = (count / 3, harmonics.of(0).len() - 1);
            let expected = [0, 1, 2].map(|c| (c * channel + last as i32 - 1) as f32);
            assert_eq!(harmonics.of(0)[last].to_array(), expected);
        }
    }
}

#[test]
fn what_is_missing_is_named() {
    for name in ["x", "opacity", "f_dc_2", "scale_1"] {
        let message = message(&gaussian_file(Format::Ascii, &[name], 1));
        assert!(message.contains(&format!("found no property {name} in element vertex")), "{message}");
    }
    let message = message(&gaussian_file(Format::Ascii, &["f_rest_7"], 1));
    assert!(
        message
            .contains("found 7 properties f_rest_0, f_rest_1, .. in element vertex, expected 0, 9, 24 or 45")
    );
    // Without a rotation they are no trained splats.
    let cloud = read(&gaussian_file(Format::Ascii, &["rot_0"], 1)).unwrap().cloud;
    assert!(!cloud.trained && cloud.harmonics.is_none());
}

/// Two packed splats, the second in the second chunk.
fn packed_file(format: Format, chunks: usize, colored: bool, sh_rows: Option<usize>) -> Vec<u8> {
    let mut bounds = vec![
        "min_x",
        "min_y",
        "min_z",
        "max_x",
        "max_y",
        "max_z",
        "min_scale_x",
        "min_scale_y",
        "min_scale_z",
        "max_scale_x",
        "max_scale_y",
        "max_scale_z",
    ];
    let mut values = vec![0.0, 1.0, 2.0, 1.0, 3.0, 5.0, -3.0, 0.0, 0.0, -3.0, 0.0, 2.0_f64.ln()];
    if colored {
        bounds.extend(["min_r", "min_g", "min_b", "max_r", "max_g", "max_b"]);
        values.extend([-1.0, 0.0, 0.0, 1.0, 2.0, 1.0]);
    }
    let floats: Vec<String> = bounds.iter().map(|name| format!("float {name}")).collect();
    let floats: Vec<&str> = floats.iter().map(String::as_str).collect();
    let row = || values.iter().copied().map(Value::One).collect();
    let chunk = Table::new("chunk", &floats, (0..chunks).map(|_| row()).collect());
    let integers = ["uint packed_position", "uint packed_rotation", "uint packed_scale", "uint packed_color"];
    // (1, 0, 1) of the bounds; the greatest component is z; (0, 0, 1); r = 1, g = 0, b = .2, opacity = .4.
    let position = f64::from(2047_u32 << 21 | 2047);
    let rotation = f64::from(3_u32 << 30 | 512 << 20 | 512 << 10 | 512);
    let color = f64::from(255_u32 << 24 | 51 << 8 | 102);
    let splat = [position, rotation, 2047.0, color].map(Value::One).to_vec();
    let vertices = Table::new("vertex", &integers, vec![splat; 257]);
    let mut tables = vec![vertices, chunk];
    if let Some(rows) = sh_rows {
        let names: Vec<String> = (0..9).map(|i| format!("uchar f_rest_{i}")).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let row = [0.0, 255.0, 127.0, 128.0, 1.0, 2.0, 3.0, 4.0, 5.0].map(Value::One).to_vec();
        tables.insert(0, Table::new("sh", &names, vec![row; rows]));
    }
    file(format, &tables)
}

#[test]
fn packed_splats_are_unpacked() {
    for format in FORMATS {
        let cloud = read(&packed_file(format, 2, true, Some(257))).unwrap().cloud;
        assert_eq!((cloud.check_lengths(), cloud.len(), cloud.trained), (Ok(()), 257, true));
        assert_eq!(cloud.world_position(256), DVec3::new(1.0, 1.0, 5.0));
        // Half a turn around z, but for the grid of 10 bits; the first axis is the shortest, exp(-3).
        assert!(cloud.normals[256].abs_diff_eq(-Vec3::X, 3e-3), "{}", cloud.normals[256]);
        let [t1, t2] = axes(&cloud, 256);
        assert!(t1.abs_diff_eq(-Vec3::Y, 3e-3) && t2.abs_diff_eq(2.0 * Vec3::Z, 6e-3), "{t1} {t2}");
        let color = cloud.colors.as_ref().unwrap()[256];
        let expected = Vec3::new(1.0, 0.0, srgb::decode(0.2) as f32);
        assert!(color.abs_diff_eq(expected, 1e-5), "{color}");
        assert!((cloud.opacities.as_ref().unwrap()[256] - 0.4).abs() < 1e-6);
        let terms = cloud.harmonics.as_ref().unwrap().of(256);
        let byte = |byte: f32| (byte + 0.5) / 32.0 - 4.0;
        assert_eq!(terms[1], Vec3::new(-4.0, byte(128.0), byte(3.0)));
        assert_eq!(terms[2], Vec3::new(4.0, byte(1.0), byte(4.0)));

        let plain = read(&packed_file(format, 2, false, None)).unwrap().cloud;
        assert_eq!(plain.harmonics, None);
        assert!(plain.colors.unwrap()[0].abs_diff_eq(expected, 1e-5));
    }
}

#[test]
fn tables_of_packed_splats_must_go_together() {
    let few = message(&packed_file(Format::Ascii, 1, true, None));
    assert!(few.contains("found 1 chunks for 257 splats, expected one for every 256"), "{few}");
    let rows = message(&packed_file(Format::Ascii, 2, true, Some(256)));
    assert!(rows.contains("found 256 rows in element sh, expected 257"), "{rows}");
    let lonely = Table::vertex(["uint packed_position"], &[[0.0]]);
    let lonely = message(&file(Format::BinaryLittleEndian, &[lonely]));
    assert!(lonely.contains("found no element `chunk`"), "{lonely}");
}

#[test]
fn trained_splats_cut_off_anywhere_are_an_error() {
    for format in [Format::BinaryLittleEndian, Format::BinaryBigEndian] {
        // The faces in front are skipped; the splats are the last bytes.
        let bytes = gaussian_file(format, &[], 2);
        assert!((0..bytes.len()).all(|length| read(&bytes[..length]).is_err()));
        let bytes = packed_file(format, 2, false, None);
        for length in (0..bytes.len()).rev().step_by(7) {
            assert!(read(&bytes[..length]).is_err());
        }
    }
    let huge = gaussian_file(Format::BinaryLittleEndian, &[], 2);
    let text = String::from_utf8_lossy(&huge).replacen("element vertex 2", "element vertex 2000000000", 1);
    assert!(message(text.as_bytes()).contains("at least"));
}

proptest! {
    #[test]
    fn damaged_trained_splats_never_panic(
        packed in any::<bool>(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
    ) {
        let mut bytes = if packed {
            packed_file(Format::BinaryLittleEndian, 2, true, Some(257))
        } else {
            gaussian_file(Format::BinaryLittleEndian, &[], 3)
        };
        for (place, value) in changes {
            let place = place.index(bytes.len());
            bytes[place] = value;
        }
        if let Ok(import) = read(&bytes) {
            prop_assert_eq!(import.cloud.check_lengths(), Ok(()));
            prop_assert!(import.cloud.len() <= bytes.len());
        }
    }
}
