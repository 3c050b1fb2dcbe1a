//! Every real file through the program: what `info` says of it against facts that another program found, and a picture.
//!
//! The files are in the folder that `SPLAT_TEST_DATA` names; without it nothing is tested.

use super::common::{fails, read_png, real_files, succeeds};
use serde_json::Value;

/// A cloud: its file, number of points, and bounds.
type Fact = (&'static str, u64, Option<[[f64; 3]; 2]>);

const PLAYBOT: [[f64; 3]; 2] =
    [[-1.02343023, -1.07757521, -1.02860546], [1.02601933, 0.0359582566, 1.02876985]];
const BUNNY: [[f64; 3]; 2] = [[-4.95847511, -0.003149, -3.72983289], [4.94885015, 9.65474796, 3.8106389]];
const DRAGON: [[f64; 3]; 2] =
    [[-0.107672997, 0.0527742989, -0.050051], [0.0959824994, 0.196643993, 0.0408262014]];
const COLORED: [[f64; 3]; 2] = [[635619.85, 848899.7, 406.59], [638982.55, 853535.43, 586.38]];
const UTM: [[f64; 3]; 2] = [[289814.15, 4320978.61, 170.58], [289818.5, 4320980.59, 170.76]];
const GARDEN: [[f64; 3]; 2] = [[-6.60607433, -4.71046066, -0.11175108], [9.68600273, 11.2098465, 2.75984144]];

/// The clouds, trained splats, surfels and meshes (as clouds of their vertices), with the facts of another program.
const CLOUDS: [Fact; 26] = [
    ("clouds/autzen_trim.laz", 110_000, Some([[636001.76, 848935.2, 406.26], [637179.22, 849497.9, 520.51]])),
    ("clouds/1.2-with-color.las", 1065, Some(COLORED)),
    ("clouds/1.2-with-color.copc.laz", 1065, Some(COLORED)),
    ("clouds/warsaw_small.las", 3000, Some([[639913.26, 485143.14, 84.7], [639946.75, 485175.91, 104.55]])),
    (
        "clouds/points_cloudcompare.xyz",
        101,
        Some([[665171.375, 5648298.1, 228.049194], [665187.871, 5648381.9, 245.90329]]),
    ),
    // Its first line counts 8, and 9 follow.
    ("clouds/bunny_8.pts", 9, Some([[-0.068009, 0.112568, 0.001795], [0.033213, 0.151244, 0.037195]])),
    (
        "clouds/colored_cloud.pcd",
        1000,
        Some([[-0.887100995, -0.650735319, 0.882000029], [0.488799989, -0.375489593, 1.53199995]]),
    ),
    ("clouds/utm17.las", 10, Some(UTM)),
    ("clouds/utm17_2.txt", 10, Some(UTM)),
    (
        "splats/train-1000.ply",
        1000,
        Some([[-13.0210342, -3.92198253, -3.82172847], [10.2931576, 1.96831131, 13.8217335]]),
    ),
    ("splats/playbot_lod5.ply", 3000, Some(PLAYBOT)),
    ("splats/playbot_lod5_2dgs.ply", 3000, Some(PLAYBOT)),
    ("splats/playbot_lod5.splat", 3000, Some(PLAYBOT)),
    ("splats/playbot_lod5.spz", 3000, Some(PLAYBOT)),
    ("splats/playbot_lod5.compressed.ply", 3000, Some(PLAYBOT)),
    ("splats/minimal.splat", 4, Some([[-1.0, 0.0, -1.0], [0.0, 0.0, 0.0]])),
    ("splats/minimal-v2.spz", 4, None),
    ("splats/minimal-v3.spz", 4, None),
    ("surfels/bunny_npm_surfels.ply", 1839, Some(BUNNY)),
    ("surfels/dragon_res3_surfels.ply", 22792, Some(DRAGON)),
    (
        "surfels/pond_pmvs.ply",
        70051,
        Some([[-1.50206006, 0.571367025, -2.63168001], [1.97646999, 1.09156001, 0.509944975]]),
    ),
    ("meshes/bunny_npm.ply", 1839, Some(BUNNY)),
    ("meshes/dragon_vrip_res3.ply", 22998, Some(DRAGON)),
    ("cameras/garden_colmap_text/points3D.txt", 5000, Some(GARDEN)),
    ("cameras/garden_colmap_bin/points3D.bin", 5000, Some(GARDEN)),
    ("tricky_las/bad_vlr_count.las", 10, Some(UTM)),
];

/// Files that are refused: what the message must say, besides the file's name.
const REFUSED: [(&str, &str); 3] =
    [("clouds/A4.e57", "E57"), ("splats/minimal.ksplat", "ksplat"), ("tricky_text/missingheader.pcd", "PCD")];

#[test]
fn counts_and_bounds_are_those_that_another_program_found() {
    let Some(data) = real_files() else { return };
    for (file, count, bounds) in CLOUDS {
        let output = succeeds(&data, &format!("info --json {file}"));
        let info: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(info["points"], count, "{file}");
        let Some(expected) = bounds else { continue };
        // Nine digits are given; what is packed in few bits has the precision that the format has.
        let packed = file.ends_with(".spz") || file.ends_with(".compressed.ply");
        for (corner, expected) in expected.iter().enumerate() {
            for (axis, expected) in expected.iter().enumerate() {
                let found = info["bounds"][corner][axis].as_f64().unwrap();
                let tolerance = if packed { 2e-3 } else { 1e-8 * expected.abs().max(1.0) };
                assert!((found - expected).abs() <= tolerance, "{file}: {found} for {expected}");
            }
        }
    }
}

#[test]
fn every_file_becomes_a_picture_without_any_option() {
    let Some(data) = real_files() else { return };
    let folder = tempfile::tempdir().unwrap();
    let picture = folder.path().join("out.png");
    let mesh = ("meshes/spot/spot_triangulated.obj", 0, None);
    for (file, ..) in CLOUDS.iter().chain([&mesh]) {
        succeeds(&data, &format!("render {file} -o {} --size 160x120 --quiet", picture.display()));
        let seen = read_png(&picture).pixels.iter().filter(|pixel| pixel[3] > 0).count();
        // Ten points, or four, are dots in an empty picture.
        assert!(seen > 20, "{file}: {seen} pixels show anything");
    }
}

#[test]
fn what_cannot_be_read_is_refused_with_a_reason() {
    let Some(data) = real_files() else { return };
    for (file, reason) in REFUSED {
        let message = fails(&data, &format!("info {file}"), 1);
        assert!(message.contains(file) && message.contains(reason), "{message}");
    }
}

#[test]
fn twins_give_the_same_image_bits() {
    let Some(data) = real_files() else { return };
    let folder = tempfile::tempdir().unwrap();
    let pixels = |file: &str, options: &str| {
        let picture = folder.path().join("out.exr");
        let output = picture.display();
        succeeds(&data, &format!("render {file} -o {output} --exr-type float --spp 4 {options}"));
        // The files differ in the hash of the input only.
        let bytes = std::fs::read(&picture).unwrap();
        let hash = bytes.windows(9).position(|window| window == b"inputHash").unwrap();
        let text = hash + "inputHash\0string\0".len() + 4;
        [&bytes[..text], &bytes[text + 64..]].concat()
    };
    let las = pixels("clouds/1.2-with-color.las", "");
    assert!(las == pixels("clouds/1.2-with-color.copc.laz", ""), "LAS and COPC");
    let text = "--camera cameras/garden_colmap_text --frames 1";
    let binary = "--camera cameras/garden_colmap_bin --frames 1";
    let [text, binary] =
        [text, binary].map(|camera| pixels("cameras/garden_colmap_text/points3D.txt", camera));
    assert!(text == binary, "cameras of COLMAP as text and binary");
    let points =
        pixels("cameras/garden_colmap_bin/points3D.bin", "--camera cameras/garden_colmap_bin --frames 1");
    assert!(text == points, "points of COLMAP as text and binary");
}
