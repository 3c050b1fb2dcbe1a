//! Files that other people's programs wrote. They are not part of the project: the test runs where the
//! environment variable `SPLAT_TEST_DATA` names a folder that has them. The expected numbers come from other
//! readers.

use super::*;
use glam::DVec3;
use splat_core::Shapes;

/// File, points, least and greatest coordinates.
type Readable = (&'static str, usize, [f64; 3], [f64; 3]);

const READABLE: [Readable; 17] = [
    ("tricky_ply/plyrs_greg_turk_example1_ok_ascii.ply", 8, [0.0; 3], [1.0; 3]),
    ("tricky_ply/plyrs_greg_turk_example2_ok_ascii.ply", 8, [0.0; 3], [1.0; 3]),
    ("tricky_ply/plyrs_house_2_ok_little_endian.ply", 5, [-1.0, -1.0, 0.0], [1.0, 2.0, 0.0]),
    ("tricky_ply/pdal_mesh.ply", 4, [1.0, 1.0, 0.0], [2.0; 3]),
    ("tricky_ply/pdal_simple_text.ply", 3, [-1.0, 0.0, 0.0], [1.0, 1.0, 0.0]),
    (
        "tricky_ply/happly_platonic_shelf_big_endian.ply",
        50,
        [-6.524307, -1.158087, -1.158087],
        [6.963232, 1.158087, 1.158086],
    ),
    ("tricky_ply/trimesh_ply_points_bin.ply", 8, [-1.0; 3], [1.0; 3]),
    (
        "tricky_ply/trimesh_points_ascii_with_lists.ply",
        5,
        [-0.0644999966, 0.0359793007, 0.0404362008],
        [-0.0627499968, 0.0367288999, 0.0425948985],
    ),
    (
        "tricky_ply/trimesh_points_emptyface.ply",
        1024,
        [-138.556778, -107.852547, -42.1914597],
        [126.950531, 101.54319, 125.626076],
    ),
    ("tricky_ply/trimesh_metadata.ply", 4, [-4.0, -4.0, 0.0], [4.0, 4.0, 0.0]),
    ("tricky_ply/assimp_cube_binary_header_with_RN_newline.ply", 8, [0.0; 3], [1.0; 3]),
    ("tricky_ply/assimp_cube_uv.ply", 24, [-1.0, -1.00000095, -1.0], [1.0; 3]),
    ("tricky_ply/draco_int_point_cloud.ply", 16, [-797.0, 249.0, 1.0], [-409.0, 517.0, 8.0]),
    (
        "tricky_ply/draco_point_cloud_test_pos_norm.ply",
        4,
        [37.9344635, 8.42106915, 1.34473896],
        [44.0828056, 19.2937145, 3.51623106],
    ),
    (
        "surfels/bunny_npm_surfels.ply",
        1839,
        [-4.95847511, -0.003149, -3.72983289],
        [4.94885015, 9.65474796, 3.8106389],
    ),
    (
        "surfels/dragon_res3_surfels.ply",
        22792,
        [-0.107672997, 0.0527742989, -0.050051],
        [0.0959824994, 0.196643993, 0.0408262014],
    ),
    (
        "surfels/pond_pmvs.ply",
        70051,
        [-1.50206006, 0.571367025, -2.63168001],
        [1.97646999, 1.09156001, 0.509944975],
    ),
];

const REFUSED: [(&str, &str); 6] = [
    ("tricky_ply/plyrs_all_atomic_types_ok_ascii.ply", "expected the numbers x, y and z in element point"),
    (
        "tricky_ply/plyrs_leading_spaces_ok_ascii.ply",
        "found the properties x, y, expected the numbers x, y and z",
    ),
    (
        "tricky_ply/plyrs_single_elements_err_ascii.ply",
        "line 5: found element point of 2 rows, at least 8 bytes",
    ),
    ("tricky_ply/pdal_no_vertex.ply", "found no element, expected an element named `vertex` or `point`"),
    ("tricky_ply/pdal_sized_dims.ply", "found the properties x, y, j, i, expected the numbers x, y and z"),
    (
        "tricky_ply/trimesh_ply_empty_header.ply",
        "found no element, expected an element named `vertex` or `point`",
    ),
];

fn range(values: impl Iterator<Item = f32>) -> (f32, f32, f64) {
    let values: Vec<f32> = values.collect();
    let mean = values.iter().copied().map(f64::from).sum::<f64>() / values.len() as f64;
    (values.iter().copied().fold(f32::MAX, f32::min), values.iter().copied().fold(f32::MIN, f32::max), mean)
}

#[test]
fn files_from_the_wild() {
    let Some(folder) = std::env::var_os("SPLAT_TEST_DATA") else { return };
    let folder = Path::new(&folder);
    for (name, count, low, high) in READABLE {
        let import = read_ply(&folder.join(name)).unwrap();
        let cloud = &import.cloud;
        assert_eq!(cloud.len(), count, "{name}");
        let (found_low, found_high) = cloud.bounds().unwrap();
        let tolerance = 1e-6 * DVec3::from_array(low).abs().max(DVec3::from_array(high).abs()).max_element();
        assert!((found_low - DVec3::from_array(low)).length() <= tolerance, "{name}: {found_low}");
        assert!((found_high - DVec3::from_array(high)).length() <= tolerance, "{name}: {found_high}");
        let points = import.report.elements.iter().find(|element| element.is_points).unwrap();
        assert_eq!(points.count, count as u64);
        assert_eq!(import.report.bytes, folder.join(name).metadata().unwrap().len());
        // The two files whose normals are all zero.
        let has_normals = points.properties.iter().any(|property| property.name == "nx");
        let are_zero = name.contains("points_bin") || name.contains("pos_norm");
        assert_eq!(!cloud.normals.is_empty(), has_normals && !are_zero, "{name}");
        assert!(cloud.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-6), "{name}");
    }
    for (name, expected) in REFUSED {
        let message = read_ply(&folder.join(name)).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn surfels_from_the_wild() {
    let Some(folder) = std::env::var_os("SPLAT_TEST_DATA") else { return };
    let folder = Path::new(&folder);
    for (name, sizes) in [
        ("bunny_npm_surfels", (0.14845, 0.58572, 0.27324)),
        ("dragon_res3_surfels", (0.00061259, 0.0027431, 0.0015184)),
        ("pond_pmvs", (0.0, 0.0088129, 0.0039268)),
    ] {
        let cloud = read_ply(&folder.join(format!("surfels/{name}.ply"))).unwrap().cloud;
        let Shapes::Discs(radii) = &cloud.shapes else { panic!("{name}") };
        let (least, greatest, mean) = range(radii.iter().copied());
        for (found, expected) in
            [(f64::from(least), sizes.0), (f64::from(greatest), sizes.1), (mean, sizes.2)]
        {
            assert!((found - expected).abs() <= 5e-5 * expected, "{name}: {found} for {expected}");
        }
        assert!(cloud.oriented, "{name}");
        if name == "pond_pmvs" {
            let colors = cloud.colors.unwrap();
            for (channel, expected) in [152.27, 129.53, 110.44].into_iter().enumerate() {
                let level = |color: &glam::Vec3| crate::srgb::srgb8_from_linear(color[channel].into());
                let (_, _, mean) = range(colors.iter().map(|color| f32::from(level(color))));
                assert!((mean - expected).abs() < 0.01, "{mean}");
            }
        } else {
            assert_eq!(cloud.colors, None);
        }
    }
}
