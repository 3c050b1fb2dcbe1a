//! Clouds of other programs, where `SPLAT_TEST_DATA` names a folder that has them. The expected numbers were found by other
//! readers (see the folder's own list of facts).

use glam::DVec3;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};
use splat_core::Cloud;
use splat_io::{CloudOptions, Error, Import, read_cloud, read_las_from, read_pcd_from, read_text_from};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// A file of the folder, if there is one.
fn file(name: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("SPLAT_TEST_DATA").map(PathBuf::from).filter(|folder| folder.is_dir());
    folder.map(|folder| folder.join(name))
}

fn read(name: &str) -> Option<Import> {
    let import = |path: PathBuf| read_cloud(&path, &CloudOptions::default());
    file(name).map(|path| import(path).unwrap_or_else(|error| panic!("{error}")))
}

/// What is known of a file.
struct Facts {
    name: &'static str,
    count: usize,
    low: [f64; 3],
    high: [f64; 3],
    /// Means of sRGB levels, in the file's own range.
    color: Option<[f64; 3]>,
    /// Least and greatest.
    intensity: Option<[f32; 2]>,
}

/// Half of the last digit that the facts have.
const DIGIT: f64 = 0.005;

const FACTS: [Facts; 15] = [
    Facts {
        name: "clouds/autzen_trim.laz",
        count: 110_000,
        low: [636_001.76, 848_935.2, 406.26],
        high: [637_179.22, 849_497.9, 520.51],
        color: Some([111.42, 119.71, 99.44]),
        intensity: Some([0.0, 254.0]),
    },
    Facts {
        name: "clouds/1.2-with-color.las",
        count: 1065,
        low: [635_619.85, 848_899.7, 406.59],
        high: [638_982.55, 853_535.43, 586.38],
        color: Some([121.66, 111.34, 126.54]),
        intensity: Some([0.0, 254.0]),
    },
    Facts {
        name: "clouds/1.2-with-color.copc.laz",
        count: 1065,
        low: [635_619.85, 848_899.7, 406.59],
        high: [638_982.55, 853_535.43, 586.38],
        color: Some([121.66, 111.34, 126.54]),
        intensity: Some([0.0, 254.0]),
    },
    Facts {
        name: "clouds/warsaw_small.las",
        count: 3000,
        low: [639_913.26, 485_143.14, 84.7],
        high: [639_946.75, 485_175.91, 104.55],
        color: Some([28_751.7, 26_560.51, 22_623.06]),
        intensity: Some([67.0, 62_657.0]),
    },
    Facts {
        name: "clouds/points_cloudcompare.xyz",
        count: 101,
        low: [665_171.375, 5_648_298.1, 228.049_194],
        high: [665_187.871, 5_648_381.9, 245.903_29],
        color: None,
        intensity: Some([255.0, 255.0]),
    },
    Facts {
        name: "clouds/bunny_8.pts",
        count: 9,
        low: [-0.068_009, 0.112_568, 0.001_795],
        high: [0.033_213, 0.151_244, 0.037_195],
        color: None,
        intensity: None,
    },
    Facts {
        name: "clouds/colored_cloud.pcd",
        count: 1000,
        low: [-0.887_100_995, -0.650_735_319, 0.882_000_029],
        high: [0.488_799_989, -0.375_489_593, 1.531_999_95],
        color: None,
        intensity: None,
    },
    UTM17,
    Facts { name: "clouds/utm17_2.txt", intensity: None, ..UTM17 },
    Facts { name: "tricky_las/bad_vlr_count.las", ..UTM17 },
    Facts { name: "tricky_text/crlf_test.txt", intensity: Some([0.0, 9.0]), ..UTM17 },
    Facts { name: "tricky_las/permutations_1.0_0.las", ..ONE_POINT },
    Facts { name: "tricky_las/permutations_1.1_1.las", ..ONE_POINT },
    Facts { name: "tricky_las/permutations_1.2_2.las", color: Some([255.0, 12.0, 234.0]), ..ONE_POINT },
    Facts { name: "tricky_las/permutations_1.2_3.las", color: Some([255.0, 12.0, 234.0]), ..ONE_POINT },
];

const UTM17: Facts = Facts {
    name: "clouds/utm17.las",
    count: 10,
    low: [289_814.15, 4_320_978.61, 170.58],
    high: [289_818.5, 4_320_980.59, 170.76],
    color: None,
    intensity: Some([240.0, 280.0]),
};

const ONE_POINT: Facts = Facts {
    name: "",
    count: 1,
    low: [470_692.44, 4_602_888.9, 16.0],
    high: [470_692.44, 4_602_888.9, 16.0],
    color: None,
    intensity: None,
};

#[test]
fn counts_bounds_and_colours_are_those_of_other_readers() {
    for facts in FACTS {
        let Some(Import { cloud, report }) = read(facts.name) else { return };
        let name = facts.name;
        assert_eq!(cloud.len(), facts.count, "{name}");
        assert!(cloud.check_lengths().is_ok(), "{name}");
        let (low, high) = cloud.bounds().unwrap();
        // The facts have nine digits, or as many decimals as the file; offsets are rounded to f32.
        let rounding = cloud.diagonal() * f64::from(f32::EPSILON);
        let is_text = report.format.starts_with("text");
        let rounding = rounding + if is_text { 1e-9 * high.abs().max_element() } else { 0.0 };
        for (found, expected) in [(low, facts.low), (high, facts.high)] {
            let off = (found - DVec3::from(expected)).abs().max_element();
            assert!(off <= rounding + 1e-9, "{name}: {found} {expected:?}");
        }
        if let Some(expected) = facts.color {
            let range = if expected[0] > 255.0 { 65535.0 } else { 255.0 };
            let colors = cloud.colors.as_ref().unwrap();
            for (channel, expected) in expected.into_iter().enumerate() {
                let level =
                    |c: &glam::Vec3| (splat_core::srgb::encode(f64::from(c[channel])) * range).round();
                let mean = colors.iter().map(level).sum::<f64>() / colors.len() as f64;
                assert!((mean - expected).abs() <= DIGIT, "{name}: {mean} {expected}");
            }
        }
        let intensity = cloud.field("intensity").map(|field| {
            let values = field.values.iter().copied();
            [values.clone().fold(f32::INFINITY, f32::min), values.fold(f32::NEG_INFINITY, f32::max)]
        });
        assert_eq!(intensity, facts.intensity, "{name}: {:?}", report.assumptions);
    }
}

/// Everything that matters of a cloud's points, in an order that does not depend on the file's: octrees have their own.
fn sorted(cloud: &Cloud) -> Vec<([u32; 3], [u32; 3], Vec<u32>)> {
    let mut rows: Vec<_> = (0..cloud.len())
        .map(|i| {
            let fields = cloud.fields.iter().filter(|field| field.name != "scan_angle");
            let color = cloud.colors.as_ref().unwrap()[i];
            (
                cloud.positions[i].to_array().map(f32::to_bits),
                color.to_array().map(f32::to_bits),
                fields.map(|field| field.values[i].to_bits()).collect(),
            )
        })
        .collect();
    rows.sort();
    rows
}

/// The offsets of the two files differ, and so do their point formats: scan angles are rounded otherwise.
#[test]
fn a_survey_and_its_octree_are_the_same_points_bit_for_bit() {
    let Some(las) = read("clouds/1.2-with-color.las") else { return };
    let Some(copc) = read("clouds/1.2-with-color.copc.laz") else { return };
    assert_eq!(las.cloud.origin, copc.cloud.origin);
    let names = |cloud: &Cloud| cloud.fields.iter().map(|field| field.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&las.cloud), names(&copc.cloud));
    assert_eq!(sorted(&las.cloud), sorted(&copc.cloud));
}

#[test]
fn las_and_laz_of_a_real_survey_are_the_same_cloud() {
    let Some(import) = read("clouds/autzen_trim.laz") else { return };
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.las", "a.laz"] {
        let path = folder.path().join(name);
        splat_io::write_las(&path, &import.cloud, name == "a.laz").unwrap();
        let again = read_cloud(&path, &CloudOptions::default()).unwrap();
        assert_eq!(again.cloud, import.cloud, "{name}");
    }
}

#[test]
fn every_file_is_read_or_refused_clearly() {
    let refused = [
        ("clouds/A4.e57", "an E57 file is not supported, expected LAS, LAZ or PLY"),
        ("tricky_las/permutations_1.2-no-points.las", "claims 1065 points of 34 bytes, expected at most 0"),
        ("tricky_text/badheader.txt", "line 1: found the properties X, Y, X"),
        ("tricky_text/missingheader.pcd", "line 1: found `289814.15 4320978.61 170.76`"),
    ];
    for (name, expected) in refused {
        let Some(path) = file(name) else { return };
        let message = read_cloud(&path, &CloudOptions::default()).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }
    let Some(empty) = read("tricky_las/no-points.las") else { return };
    assert!(empty.cloud.is_empty());
    let Some(nan) = read("tricky_las/gps-time-nan.las") else { return };
    assert_eq!(nan.cloud.len(), 1);
}

/// What the readers make of damaged bytes of a file of this name.
fn read_damaged(name: &str, bytes: &[u8]) -> Result<Import, Error> {
    let path = Path::new(name);
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("las" | "laz") => read_las_from(bytes, path),
        Some("pcd") => read_pcd_from(bytes, path),
        _ => read_text_from(bytes, path, None),
    }
}

/// Real compression has every model of the decoder at work, which our own small files have not.
#[test]
fn damaged_real_files_are_refused_or_read_at_once() {
    let names = [
        "clouds/1.2-with-color.copc.laz",
        "clouds/autzen_trim.laz",
        "clouds/1.2-with-color.las",
        "clouds/colored_cloud.pcd",
        "clouds/points_cloudcompare.xyz",
        "tricky_las/permutations_1.2_3.las",
    ];
    for name in names {
        let Some(path) = file(name) else { return };
        let whole = std::fs::read(path).unwrap();
        let mut random = Pcg64Mcg::seed_from_u64(whole.len() as u64);
        let mut below = |n: usize| (random.next_u64() % n as u64) as usize;
        // The larger file is for bugs that need more points.
        let rounds = if whole.len() > 100_000 { 20 } else { 300 };
        for round in 0..rounds {
            let mut bytes = whole.clone();
            if round % 4 == 0 {
                bytes.truncate(below(whole.len()));
            } else {
                // Half of the damage goes where the sizes are.
                let end = if round % 2 == 0 { whole.len() } else { whole.len().min(2000) };
                for _ in 0..=below(3) {
                    bytes[below(end)] ^= 1 << below(8);
                }
            }
            let start = Instant::now();
            let outcome = read_damaged(name, &bytes).map_err(|error| error.to_string());
            assert!(start.elapsed() < Duration::from_secs(10), "{name}: {:?}", start.elapsed());
            // The decoder of compressed points would have panicked.
            assert!(!outcome.is_err_and(|message| message.contains("nonsense")), "{name}");
        }
    }
}
