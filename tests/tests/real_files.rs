//! Real scans, where `SPLAT_TEST_DATA` names a folder that has them: surfels made from meshes must close where the mesh
//! does.

use glam::{DVec2, DVec3};
use splat_core::fit::{Framing, Up, fit};
use splat_core::prepare::{PrepareOptions, prepare};
use splat_core::{Camera, Cloud, RenderOptions, Shading, Shapes, render};
use splat_tests::tolerances::INTERIOR_HOLES;
use std::path::PathBuf;

/// The folder of real files, if there is one.
fn real_files() -> Option<PathBuf> {
    std::env::var_os("SPLAT_TEST_DATA").map(PathBuf::from).filter(|folder| folder.is_dir())
}

/// The triangles of a PLY mesh with three `float` coordinates a vertex and faces of three, ASCII or little-endian. Our
/// own reader passes over faces.
fn triangles(bytes: &[u8]) -> Vec<[DVec3; 3]> {
    let end = bytes.windows(11).position(|window| window == b"end_header\n").unwrap() + 11;
    let (header, body) = bytes.split_at(end);
    let header = std::str::from_utf8(header).unwrap();
    let count = |element: &str| -> usize {
        header.lines().find_map(|line| line.strip_prefix(element)?.trim().parse().ok()).unwrap()
    };
    let (vertices, faces) = (count("element vertex"), count("element face"));
    let (points, indices): (Vec<DVec3>, Vec<usize>) = if header.contains("ascii") {
        let mut words = std::str::from_utf8(body).unwrap().split_ascii_whitespace();
        let mut number = || words.next().unwrap().parse::<f64>().unwrap();
        let points = (0..vertices).map(|_| DVec3::new(number(), number(), number())).collect();
        (points, (0..faces * 4).map(|_| number() as usize).collect())
    } else {
        let (points, faces) = body.split_at(vertices * 12);
        let float = |bytes: &[u8]| f64::from(f32::from_le_bytes(bytes.try_into().unwrap()));
        let points =
            points.chunks_exact(12).map(|p| DVec3::new(float(&p[..4]), float(&p[4..8]), float(&p[8..])));
        let index = |bytes: &[u8]| u32::from_le_bytes(bytes.try_into().unwrap()) as usize;
        let faces = faces.chunks_exact(13);
        let indices = faces.flat_map(|f| [f[0].into(), index(&f[1..5]), index(&f[5..9]), index(&f[9..13])]);
        (points.collect(), indices.collect())
    };
    indices
        .chunks_exact(4)
        .map(|face| {
            assert_eq!(face[0], 3, "a triangle");
            [1, 2, 3].map(|corner| points[face[corner]])
        })
        .collect()
}

/// For each pixel, whether all 4 x 4 points of a grid in it are covered by the mesh.
fn covered(mesh: &[[DVec3; 3]], camera: &Camera) -> Vec<bool> {
    const GRID: usize = 4;
    let (width, height) = (camera.width as usize * GRID, camera.height as usize * GRID);
    let mut points = vec![false; width * height];
    for triangle in mesh {
        let [a, b, c] = triangle.map(|corner| {
            let p = camera.world_to_camera.transform_point3(corner);
            (DVec2::new(p.x, p.y) / p.z * camera.pixel_scale() + camera.principal_point) * GRID as f64
        });
        let side = |p: DVec2, q: DVec2, r: DVec2| (q - p).perp_dot(r - p);
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        for y in low.y.max(0.0) as usize..(high.y.max(0.0) as usize + 1).min(height) {
            for x in low.x.max(0.0) as usize..(high.x.max(0.0) as usize + 1).min(width) {
                let p = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                let sides = [side(a, b, p), side(b, c, p), side(c, a, p)];
                points[y * width + x] |= sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0);
            }
        }
    }
    let pixel = |x: usize, y: usize| {
        (0..GRID * GRID).all(|i| points[(y * GRID + i / GRID) * width + x * GRID + i % GRID])
    };
    (0..camera.height as usize)
        .flat_map(|y| (0..camera.width as usize).map(move |x| (x, y)))
        .map(|(x, y)| pixel(x, y))
        .collect()
}

/// The pixels whose eight neighbours are covered, too.
fn interior(covered: &[bool], width: usize) -> Vec<bool> {
    let height = covered.len() / width;
    let mut inside = vec![false; covered.len()];
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            inside[y * width + x] = (y - 1..=y + 1).all(|y| (x - 1..=x + 1).all(|x| covered[y * width + x]));
        }
    }
    inside
}

/// The share of a mesh's interior pixels in which its surfels, rendered without any option, leave alpha below .99.
fn holes(surfels: &str, mesh: &str) -> Option<f64> {
    let data = real_files()?;
    let cloud = splat_io::read_ply(&data.join("surfels").join(surfels)).unwrap().cloud;
    let mesh = triangles(&std::fs::read(data.join("meshes").join(mesh)).unwrap());
    let bare = bare(&cloud);
    let estimated = share_of_holes(&format!("{surfels}, estimated"), bare, &mesh);
    Some(estimated.max(share_of_holes(surfels, cloud, &mesh)))
}

/// The points of a cloud alone.
fn bare(cloud: &Cloud) -> Cloud {
    Cloud {
        shapes: Shapes::Discs(vec![0.0; cloud.len()]),
        normals: Vec::new(),
        oriented: false,
        ..cloud.clone()
    }
}

/// The same for surfels that are sampled from the mesh.
fn holes_of_samples(mesh: &str, count: usize) -> Option<f64> {
    let path = real_files()?.join("meshes").join(mesh);
    let is_obj = mesh.ends_with(".obj");
    let import = if is_obj { splat_io::read_obj(&path) } else { splat_io::read_ply_mesh(&path) };
    let mesh_read = import.unwrap().mesh;
    let cloud = splat_io::sample_surface(&mesh_read, count, 0, &mut |_| {}).unwrap().cloud;
    let triangles: Vec<_> =
        (0..mesh_read.triangles.len()).map(|triangle| mesh_read.corners(triangle)).collect();
    Some(share_of_holes(&format!("{count} surfels on {mesh}"), cloud, &triangles))
}

/// The share of a mesh's interior pixels in which this cloud leaves alpha below .99.
fn share_of_holes(name: &str, mut cloud: Cloud, mesh: &[[DVec3; 3]]) -> f64 {
    let options = RenderOptions { shading: Shading::Headlight, ..RenderOptions::default() };
    prepare(&mut cloud, &PrepareOptions::default(), &mut |_| {});
    let framing =
        Framing { width: 1280, height: 960, up: Up::Y, azimuth: 30.0, elevation: 20.0, orthographic: false };
    let camera = fit(&cloud, &framing, &options).unwrap();
    let film = render(&cloud, &camera, &options, &mut |_| {}).unwrap().film;
    let covered = covered(mesh, &camera);
    let inside = interior(&covered, 1280);
    let total = inside.iter().filter(|&&inside| inside).count();
    let open = inside.iter().zip(&film.rgba).filter(|(inside, rgba)| **inside && rgba[3] < 0.99).count();
    assert!(total > 100_000, "{total} interior pixels");
    let share = open as f64 / total as f64;
    // How far the silhouette reaches beyond the mesh's, whose rim is covered by half.
    let alpha: f64 = film.rgba.iter().map(|rgba| f64::from(rgba[3])).sum();
    let solid = covered.iter().filter(|&&covered| covered).count();
    let rim = (solid - total) as f64;
    let bloat = (alpha - solid as f64) / rim - 0.5;
    #[expect(clippy::print_stdout, reason = "the measured figures, for --nocapture")]
    {
        println!(
            "{name}: {open} of {total} interior pixels below alpha .99: {:.4} %; bloat {bloat:.2} pixels",
            100.0 * share
        );
    }
    share
}

#[test]
fn the_dragon_has_no_holes() {
    if let Some(share) = holes("dragon_res3_surfels.ply", "dragon_vrip_res3.ply") {
        assert!(share <= INTERIOR_HOLES, "{share}");
    }
}

#[test]
fn the_bunny_has_no_holes() {
    if let Some(share) = holes("bunny_npm_surfels.ply", "bunny_npm.ply") {
        assert!(share <= INTERIOR_HOLES, "{share}");
    }
}

#[test]
fn sampled_meshes_have_no_holes() {
    for (mesh, count) in [
        ("spot/spot_triangulated.obj", 200_000),
        ("spot/spot_triangulated.obj", 20_000),
        ("dragon_vrip_res3.ply", 200_000),
    ] {
        if let Some(share) = holes_of_samples(mesh, count) {
            assert!(share <= INTERIOR_HOLES, "{mesh}: {share}");
        }
    }
}
