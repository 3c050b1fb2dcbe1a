//! LAS and LAZ files, made by our own writer and by hand.

use super::*;
use glam::{DVec3, Vec3};
use laz::encoders::ArithmeticEncoder;
use laz::models::{ArithmeticModel, ArithmeticModelBuilder};
use laz::record::{FieldCompressor, RecordCompressor, SequentialPointRecordCompressor};
use splat_core::{Cloud, Field};
use std::io::Cursor;

fn read(bytes: &[u8]) -> Result<Import, Error> {
    read_las_from(bytes, Path::new("a.las"))
}

/// A survey: centimetres, colours, and what LAS knows of a point.
fn survey(count: usize, classes: f32) -> Cloud {
    let points: Vec<DVec3> = (0..count)
        .map(|i| DVec3::new(500_000.25 + i as f64 * 0.5, 4_321_000.0 + (i % 7) as f64, (i % 5) as f64 * 0.01))
        .collect();
    let field = |name: &str, value: &dyn Fn(usize) -> f32| Field {
        name: name.to_owned(),
        values: (0..count).map(value).collect(),
    };
    let mut cloud = Cloud::from_points(&points);
    let levels = crate::srgb::linear_from_srgb8();
    cloud.colors =
        Some((0..count).map(|i| Vec3::new(levels[i % 256], levels[255], levels[i * 7 % 256])).collect());
    cloud.fields = vec![
        field("intensity", &|i| (i * 37 % 65536) as f32),
        field("return_number", &|i| (i % 2 + 1) as f32),
        field("number_of_returns", &|_| 2.0),
        field("classification", &|i| i as f32 % classes),
        field("scan_angle", &|i| (i % 40) as f32 - 20.0),
        field("user_data", &|i| (i % 250) as f32),
        field("point_source_id", &|_| 300.0),
    ];
    cloud
}

fn written(cloud: &Cloud, compressed: bool) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.las");
    assert_eq!(write_las(&path, cloud, compressed).unwrap(), 0);
    std::fs::read(path).unwrap()
}

/// Scan angles of LAS 1.4 are multiples of .006 degrees.
fn without_angles(mut cloud: Cloud) -> Cloud {
    cloud.fields.retain(|field| field.name != "scan_angle");
    cloud
}

#[test]
fn a_survey_round_trips_bit_for_bit_in_every_form() {
    for classes in [30.0, 100.0] {
        let cloud = survey(1234, classes);
        for compressed in [false, true] {
            let import = read(&written(&cloud, compressed)).unwrap();
            assert_eq!(
                without_angles(import.cloud.clone()),
                without_angles(cloud.clone()),
                "{classes} {compressed}"
            );
            let angles = |cloud: &Cloud| cloud.field("scan_angle").unwrap().values.clone();
            let off = angles(&import.cloud)
                .iter()
                .zip(angles(&cloud))
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f32::max);
            assert!(off <= 0.0031, "{off}");
            let format = if classes > 32.0 { "1.4, point format 7" } else { "1.2, point format 2" };
            let kind = if compressed { "LAZ" } else { "LAS" };
            assert_eq!(import.report.format, format!("{kind} {format}"));
        }
    }
}

#[test]
fn returns_that_say_nothing_are_no_fields() {
    let cloud = Cloud { fields: Vec::new(), ..survey(5, 1.0) };
    assert_eq!(read(&written(&cloud, false)).unwrap().cloud, cloud);
}

#[test]
fn many_chunks_and_no_point_at_all_round_trip() {
    let cloud = Cloud { fields: Vec::new(), colors: None, ..survey(120_001, 2.0) };
    assert_eq!(read(&written(&cloud, true)).unwrap().cloud, cloud);
    for compressed in [false, true] {
        assert_eq!(read(&written(&Cloud::default(), compressed)).unwrap().cloud.len(), 0);
    }
}

#[test]
fn points_keep_a_small_part_of_their_spacing() {
    let points: Vec<DVec3> =
        (0..100).map(|i| DVec3::new(f64::from(i) / 3.0, 1e-3 / f64::from(i + 1), 7e6 / 3.0)).collect();
    let cloud = Cloud::from_points(&points);
    let read_back = read(&written(&cloud, false)).unwrap().cloud;
    for (index, point) in points.iter().enumerate() {
        let off = (read_back.world_position(index) - *point).abs().max_element();
        assert!(off <= 0.5e-4 * cloud.diagonal() / 10.0 + 1e-6, "{off}");
    }
}

#[test]
fn decimal_coordinates_do_not_depend_on_the_offset() {
    let coordinate = |number: i64, offset: f64| {
        let units = (offset * 100.0).round() as i64;
        header::Axis::new(0.01, offset).world((number - units) as i32)
    };
    for number in [63_561_985, 63_898_255, 63_730_121, -7, 85_121_756] {
        for offset in [0.0, -0.0, 637_301.2, 851_217.56, 639_000.0, 496.48, -1234.56] {
            assert_eq!(coordinate(number, offset), number as f64 / 100.0, "{number} {offset}");
        }
    }
    // No decimal fraction: the formula as it stands.
    assert_eq!(header::Axis::new(0.125, 1.0 / 3.0).world(3), 3.0 * 0.125 + 1.0 / 3.0);
    assert_eq!(header::Axis::new(0.01, 1.0 / 3.0).world(3), 3.0 * 0.01 + 1.0 / 3.0);
}

#[test]
fn what_is_special_of_points_is_counted() {
    let mut bytes = written(&survey(8, 1.0), false);
    let at = |point: usize| 227 + 26 * point + 15;
    bytes[at(0)] = 7;
    bytes[at(1)] = 2 | 0x80;
    bytes[at(2)] = 2 | 0x20;
    let assumptions = read(&bytes).unwrap().report.assumptions.join("\n");
    for expected in ["1 points are classified as noise", "1 points are withheld", "1 points are synthetic"] {
        assert!(assumptions.contains(expected), "{assumptions}");
    }
}

#[test]
fn lying_headers_are_refused_with_their_place() {
    let plain = written(&survey(3, 1.0), false);
    let packed = written(&survey(3, 1.0), true);
    let message = |bytes: &[u8], at: usize, value: &[u8]| {
        let mut bytes = bytes.to_vec();
        bytes[at..at + value.len()].copy_from_slice(value);
        read(&bytes).unwrap_err().to_string()
    };
    let most = u32::MAX.to_le_bytes();
    let cases = [
        (message(&plain, 0, b"LASX"), "byte 0: found `LASX`, expected LASF"),
        (message(&plain, 24, &[2]), "LAS 2.2 is not supported"),
        (message(&plain, 94, &[9, 0]), "byte 94: found a header of 9 bytes"),
        (message(&plain, 96, &most), "byte 96: found points from byte 4294967295"),
        (message(&plain, 104, &[11]), "point format 11 is not supported"),
        (message(&plain, 105, &[25, 0]), "byte 105: found points of 25 bytes, expected at least 26"),
        (message(&plain, 107, &[4]), "a header that claims 4 points of 26 bytes, expected at most 3"),
        (message(&plain, 107, &most), "a cloud of 4294967295 points is beyond the limit"),
        (message(&plain, 131, &0_f64.to_le_bytes()), "byte 131: found a scale of 0"),
        (
            message(&plain, 155, &f64::NAN.to_le_bytes()),
            "byte 131: found a scale of 0.01 and an offset of NaN",
        ),
        (message(&packed, 107, &[4]), "after 3 points, expected 4 compressed points"),
        (
            message(&packed, 107, &(u32::MAX - 2).to_le_bytes()),
            "a header that claims 4294967293 compressed points, expected at most",
        ),
        (message(&packed, 229, b"x"), "found compressed points, expected the record of user"),
        (message(&packed, 104, &[0x80]), "does not fit point format 0 of 26 bytes"),
    ];
    for (found, expected) in cases {
        assert!(found.contains(expected), "{found}");
    }
}

/// Sizes that the decoder would believe: each would take gigabytes.
#[test]
fn compressed_points_cannot_claim_memory() {
    for classes in [30.0, 100.0] {
        let bytes = written(&survey(100, classes), true);
        let data = u32::from_le_bytes(bytes[96..100].try_into().unwrap()) as usize;
        let table = i64::from_le_bytes(bytes[data..data + 8].try_into().unwrap()) as usize;
        let mut chunks = bytes.clone();
        chunks[table + 4..table + 8].copy_from_slice(&u32::MAX.to_le_bytes());
        let message = read(&chunks).unwrap_err().to_string();
        assert!(message.contains("4294967295 chunks"), "{message}");
        if classes > 32.0 {
            let mut layers = bytes.clone();
            let sizes = data + 8 + 36 + 4;
            layers[sizes..sizes + 4].copy_from_slice(&u32::MAX.to_le_bytes());
            let message = read(&layers).unwrap_err().to_string();
            assert!(message.contains("layers longer than their chunk"), "{message}");
        }
    }
}

#[test]
fn no_damage_makes_a_panic() {
    let mut random = crate::damage::Random::new(3);
    for (classes, compressed) in [(30.0, false), (30.0, true), (100.0, false), (100.0, true)] {
        let bytes = written(&survey(40, classes), compressed);
        for cut in 0..bytes.len() {
            // The end of a table of chunks may be lost unnoticed.
            let cut_off = read(&bytes[..cut]);
            assert!(cut_off.is_err() || (compressed && cut + 8 >= bytes.len()), "{cut} of {}", bytes.len());
        }
        for _ in 0..3000 {
            let outcome = read(&random.damaged(&bytes)).map_err(|error| error.to_string());
            // Then the decoder itself would have panicked.
            assert!(!outcome.is_err_and(|message| message.contains("nonsense")));
        }
    }
}

/// A file of point format 1 in one chunk, its GPS times by a compressor of the test's choice.
fn with_times<C>(points: u32, times: C, time: impl Fn(u32) -> i64) -> Vec<u8>
where
    C: FieldCompressor<Cursor<Vec<u8>>> + Send + Sync,
{
    let vlr = laz::LazVlrBuilder::default().with_point_format(1, 0).unwrap().build();
    let mut description = Vec::new();
    vlr.write_to(&mut description).unwrap();
    // Without chunks.
    description[0] = 1;
    let mut bytes = written(&Cloud::default(), false);
    let mut put = |at: usize, value: &[u8]| bytes[at..at + value.len()].copy_from_slice(value);
    put(96, &(227 + 54 + description.len() as u32).to_le_bytes());
    put(104, &[0x81, 28, 0]);
    put(107, &points.to_le_bytes());
    put(131, &[0.01_f64.to_le_bytes(); 3].concat());
    let mut head = [0; 54];
    head[2..16].copy_from_slice(b"laszip encoded");
    head[18..20].copy_from_slice(&laz::LazVlr::RECORD_ID.to_le_bytes());
    head[20..22].copy_from_slice(&(description.len() as u16).to_le_bytes());
    bytes.extend(head);
    bytes.extend(description);
    let mut compressor = SequentialPointRecordCompressor::new(Cursor::new(Vec::new()));
    compressor.add_field_compressor(laz::las::v2::LasPoint0Compressor::default());
    compressor.add_field_compressor(times);
    for point in 0..points {
        let mut record = [0; 28];
        record[..4].copy_from_slice(&x_of(point).to_le_bytes());
        record[20..].copy_from_slice(&time(point).to_le_bytes());
        compressor.compress_next(&record).unwrap();
    }
    compressor.done().unwrap();
    bytes.extend(compressor.into_inner().into_inner());
    bytes
}

/// The coordinate of a point of [`with_times`], in hundredths.
fn x_of(point: u32) -> u32 {
    point * point % 9973
}

#[test]
fn gps_times_of_the_older_compression_are_followed() {
    let noise = |point: u32| i64::from(point.wrapping_mul(2_654_435_761) >> 7);
    let times: [&dyn Fn(u32) -> i64; 6] = [
        &|_| 7,
        &|point| 1000 * i64::from(point),
        // Multiples of all sizes, both ways, and the same time again.
        &|point| 50 * (noise(point) % 1200 - 300) * i64::from(point % 5),
        &|point| noise(point) << (point % 40),
        // Sequences far apart, by turns.
        &|point| (i64::from(point % 4) << 40) + i64::from(point) * 300,
        &|point| ((noise(point) % 7) << 40) + i64::from(point) * 300 * (noise(point) % 3),
    ];
    for (number, time) in times.into_iter().enumerate() {
        let count = 3000;
        let import = read(&with_times(count, laz::las::v2::GpsTimeCompressor::default(), time)).unwrap();
        assert_eq!(import.cloud.len(), count as usize);
        for point in 0..count {
            let x = f64::from(x_of(point)) / 100.0;
            let found = import.cloud.world_position(point as usize).x;
            assert!((found - x).abs() < 1e-5, "times {number}, point {point}: {found}, not {x}");
        }
    }
}

/// Says of the second point that its time belongs to another sequence, a million times over.
struct Astray(ArithmeticModel);

impl FieldCompressor<Cursor<Vec<u8>>> for Astray {
    fn size_of_field(&self) -> usize {
        8
    }

    fn compress_first(&mut self, out: &mut Cursor<Vec<u8>>, time: &[u8]) -> std::io::Result<()> {
        std::io::Write::write_all(out, time)
    }

    fn compress_with(
        &mut self,
        encoder: &mut ArithmeticEncoder<Cursor<Vec<u8>>>,
        _time: &[u8],
    ) -> std::io::Result<()> {
        (0..1_000_000).try_for_each(|_| encoder.encode_symbol(&mut self.0, 3))
    }
}

/// The crate's decoder overflows the stack here, which no one can catch.
#[test]
fn gps_times_cannot_go_astray() {
    let model = ArithmeticModelBuilder::new(6).with_compression(true).build();
    let bytes = with_times(2, Astray(model), |_| 0);
    assert!(bytes.len() < 600, "{}", bytes.len());
    let message = read(&bytes).unwrap_err().to_string();
    assert!(message.contains("a GPS time that goes from sequence to sequence after 1 points"), "{message}");
}
