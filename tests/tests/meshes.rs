//! Meshes as surfels: areas, spread, the texture's affine map, and a real one where `SPLAT_TEST_DATA` names a folder that
//! has it.

use glam::{DVec2, DVec3, Vec2};
use splat_core::{Cloud, Shapes};
use splat_io::mesh::{Mesh, Sampled, sample_surface};
use splat_tests::random::Random;
use splat_tests::tolerances::{EVEN_SHARE, EVEN_SPACING, INTERPOLATED, SAMPLED_AREA, SPACING_SCATTER};
use std::path::PathBuf;

/// A mesh of bare triangles.
fn soup(triangles: &[[DVec3; 3]]) -> Mesh {
    Mesh {
        positions: triangles.as_flattened().to_vec(),
        triangles: (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        ..Mesh::default()
    }
}

/// A parallelogram of `n` x `n` cells of two triangles.
fn sheet(origin: DVec3, u: DVec3, v: DVec3, n: usize) -> Vec<[DVec3; 3]> {
    let at = |i: usize, j: usize| origin + (u * i as f64 + v * j as f64) / n as f64;
    let cells = (0..n * n).map(|cell| (cell % n, cell / n));
    cells
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect()
}

/// The surface of the unit cube, each side of `n` x `n` cells.
fn cube(n: usize) -> Mesh {
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let sides =
        [(x, y, z), (y, x, DVec3::ZERO), (y, z, x), (z, y, DVec3::ZERO), (z, x, y), (x, z, DVec3::ZERO)];
    soup(&sides.map(|(u, v, origin)| sheet(origin, u, v, n)).concat())
}

/// The unit sphere of 8 (4^levels) triangles.
fn sphere(levels: usize) -> Mesh {
    let corner = |i: usize, axis: DVec3| if i == 0 { axis } else { -axis };
    let mut triangles: Vec<[DVec3; 3]> = (0..8)
        .map(|i| {
            let [a, b, c] =
                [corner(i & 1, DVec3::X), corner(i >> 1 & 1, DVec3::Y), corner(i >> 2 & 1, DVec3::Z)];
            if (i & 1) + (i >> 1 & 1) + (i >> 2 & 1) == 1 || i == 7 { [a, c, b] } else { [a, b, c] }
        })
        .collect();
    for _ in 0..levels {
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let [ab, bc, ca] = [a + b, b + c, c + a].map(DVec3::normalize);
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    soup(&triangles)
}

fn sampled(mesh: &Mesh, count: usize) -> Sampled {
    let sampled = sample_surface(mesh, count, 7, &mut |_| {}).unwrap();
    assert_eq!(sampled.cloud.len(), count);
    sampled.cloud.check_lengths().unwrap();
    assert!((0..count).all(|index| sampled.cloud.defect(index).is_none()));
    sampled
}

/// The distance of each place to the nearest other one.
fn nearest_distances(places: &[DVec3]) -> Vec<f64> {
    let nearest = |i: usize| {
        let others = places.iter().enumerate().filter(|&(j, _)| i != j);
        others.map(|(_, place)| place.distance(places[i])).fold(f64::INFINITY, f64::min)
    };
    (0..places.len()).map(nearest).collect()
}

fn places(cloud: &Cloud) -> Vec<DVec3> {
    (0..cloud.len()).map(|index| cloud.world_position(index)).collect()
}

fn axes(cloud: &Cloud) -> &[[glam::Vec3; 2]] {
    match &cloud.shapes {
        Shapes::Ellipses(axes) => axes,
        Shapes::Discs(_) => panic!("surfels of a mesh have axes"),
    }
}

/// Least and mean distance, and the standard deviation over the mean.
fn statistics(distances: &[f64]) -> [f64; 3] {
    let mean = distances.iter().sum::<f64>() / distances.len() as f64;
    let variance = distances.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / distances.len() as f64;
    [distances.iter().copied().fold(f64::INFINITY, f64::min), mean, variance.sqrt() / mean]
}

#[test]
fn areas_add_up_to_that_of_the_mesh() {
    let square = soup(&sheet(DVec3::ZERO, DVec3::X, DVec3::Y, 1));
    for (mesh, area) in [(square, 1.0), (cube(3), 6.0), (sphere(4), 4.0 * std::f64::consts::PI)] {
        let Sampled { cloud, area: found, skipped, .. } = sampled(&mesh, 3000);
        let sum: f64 = cloud.areas.as_ref().unwrap().iter().map(|&area| f64::from(area)).sum();
        assert_eq!(skipped, 0);
        assert!((sum / found - 1.0).abs() < SAMPLED_AREA, "{sum} of {found}");
        // 2048 flat triangles in place of a sphere lose 0.3 %.
        assert!(
            (found / area - 1.0).abs() < if area > 6.0 { 4e-3 } else { SAMPLED_AREA },
            "{found} for {area}"
        );
        for ([t1, t2], normal) in axes(&cloud).iter().zip(&cloud.normals) {
            let sigma = (found / 3000.0).sqrt();
            let errors = [
                f64::from(t1.length()) / sigma - 1.0,
                f64::from(t2.length()) / sigma - 1.0,
                f64::from(t1.dot(*t2)) / sigma / sigma,
                f64::from(t1.cross(*t2).dot(*normal)) / sigma / sigma - 1.0,
            ];
            assert!(errors.iter().all(|error| error.abs() < SAMPLED_AREA), "{errors:?}");
        }
    }
}

#[test]
fn every_part_of_the_surface_has_its_share() {
    // Triangles of very different sizes, and sharp edges: each side of the cube gets a sixth.
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let fine = sheet(DVec3::ZERO, y, x, 40);
    let coarse = [
        sheet(z, x, y, 1),
        sheet(x, y, z, 2),
        sheet(DVec3::ZERO, z, y, 1),
        sheet(y, z, x, 3),
        sheet(DVec3::ZERO, x, z, 1),
    ];
    let mesh = soup(&[fine, coarse.concat()].concat());
    let cloud = sampled(&mesh, 6000).cloud;
    for side in [-x, -y, -z, x, y, z] {
        let count = cloud.normals.iter().filter(|normal| normal.as_dvec3().dot(side) > 0.9).count();
        assert!((count as f64 - 1000.0).abs() <= 1000.0 * EVEN_SHARE, "{count} on {side}");
        let middle = places(&cloud).into_iter().zip(&cloud.normals).filter(|(place, normal)| {
            let offset = *place - DVec3::splat(0.5);
            let along = offset - side * offset.dot(side);
            normal.as_dvec3().dot(side) > 0.9 && along.abs().max_element() < 0.25
        });
        let count = middle.count();
        assert!((count as f64 - 250.0).abs() <= 250.0 * EVEN_SHARE, "{count} in the middle of {side}");
    }
}

#[test]
fn surfels_are_far_more_evenly_spread_than_random_points() {
    for (name, mesh) in
        [("sphere of 2048 triangles", sphere(4)), ("sphere of 32", sphere(1)), ("cube", cube(1))]
    {
        let count = 2000;
        let Sampled { cloud, area, .. } = sampled(&mesh, count);
        let spacing = (area / count as f64).sqrt();
        let mut random = Random::new(3);
        let at_random: Vec<DVec3> = (0..count)
            .map(|_| {
                // The triangles of each of these meshes are nearly of one size.
                let [a, b, c] = mesh.corners(random.index(mesh.triangles.len()));
                let (mut u, mut v) = (random.unit(), random.unit());
                if u + v > 1.0 {
                    (u, v) = (1.0 - u, 1.0 - v);
                }
                a + u * (b - a) + v * (c - a)
            })
            .collect();
        let [least, mean, scatter] = statistics(&nearest_distances(&places(&cloud)));
        let [random_least, random_mean, random_scatter] = statistics(&nearest_distances(&at_random));
        #[expect(clippy::print_stdout, reason = "the measured figures, for --nocapture")]
        {
            println!(
                "{name}: nearest neighbour in spacings: least {:.3}, mean {:.3}, scatter {scatter:.3}; at random {:.3}, \
                 {:.3}, {random_scatter:.3}",
                least / spacing,
                mean / spacing,
                random_least / spacing,
                random_mean / spacing
            );
        }
        assert!(least >= EVEN_SPACING[0] * spacing, "{name}: {}", least / spacing);
        assert!(mean >= EVEN_SPACING[1] * spacing, "{name}: {}", mean / spacing);
        assert!(scatter <= SPACING_SCATTER, "{name}: {scatter}");
    }
}

#[test]
fn a_thin_wall_is_covered_on_both_sides() {
    let (u, v) = (DVec3::X, DVec3::Y);
    let gap = DVec3::Z * 1e-3;
    let mesh =
        soup(&[sheet(gap, u, v, 1), sheet(DVec3::ZERO, v, u, 1), sheet(DVec3::X * 3.0, u, v, 1)].concat());
    let cloud = sampled(&mesh, 3000).cloud;
    let count =
        |is_there: fn(DVec3) -> bool| places(&cloud).into_iter().filter(|&p| is_there(p)).count() as f64;
    for count in [count(|p| p.z > 5e-4), count(|p| p.z < 5e-4 && p.x < 2.0), count(|p| p.x > 2.0)] {
        assert!((count - 1000.0).abs() <= 1000.0 * EVEN_SHARE, "{count}");
    }
}

#[test]
fn texture_coordinates_are_the_affine_map_of_the_triangle() {
    let mut random = Random::new(5);
    for case in 0..50 {
        let mut point = |scale: f64| DVec3::from_array([0; 3].map(|_| scale * random.range(-1.0, 1.0)));
        let offset = if case % 2 == 0 { DVec3::ZERO } else { DVec3::new(5e5, 5e6, 100.0) };
        let corners = [0; 3].map(|_| offset + point(2.0));
        let at = [0; 3].map(|_| point(1.0).truncate());
        let (edge_a, edge_b) = (at[1] - at[0], at[2] - at[0]);
        let slender = (corners[1] - corners[0]).cross(corners[2] - corners[0]).length() < 0.5;
        if slender || edge_a.perp_dot(edge_b).abs() < 0.1 {
            continue;
        }
        let mesh =
            Mesh { texture_coordinates: at.to_vec(), texture_triangles: vec![[0, 1, 2]], ..soup(&[corners]) };
        let cloud = sampled(&mesh, 100).cloud;
        // The map the other way: from (s, t) to the plane.
        let world = |st: DVec2| {
            let d = edge_a.perp_dot(edge_b);
            let (b, c) = ((st - at[0]).perp_dot(edge_b) / d, edge_a.perp_dot(st - at[0]) / d);
            corners[0] + b * (corners[1] - corners[0]) + c * (corners[2] - corners[0])
        };
        for (index, coordinates) in cloud.texture_coordinates.as_ref().unwrap().iter().enumerate() {
            let [t1, t2] = axes(&cloud)[index].map(|axis| axis.as_dvec3());
            assert!(coordinates.per_u.x > 0.0, "s grows along the first axis");
            assert!(coordinates.per_u.y.abs() < 1e-6 * coordinates.per_u.x.max(1.0), "and t stays");
            for uv in [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::new(-1.5, 0.7)] {
                let place = cloud.world_position(index) + f64::from(uv.x) * t1 + f64::from(uv.y) * t2;
                let error = world(coordinates.at(uv).as_dvec2()).distance(place);
                assert!(error < INTERPOLATED, "case {case}: {error:e}");
            }
        }
    }
}

#[test]
fn colors_are_interpolated_and_normals_decide_the_side() {
    let square = sheet(DVec3::ZERO, DVec3::X, DVec3::Y, 1);
    let mut mesh = soup(&square);
    mesh.colors = Some(mesh.positions.iter().map(|p| p.as_vec3()).collect());
    let cloud = sampled(&mesh, 200).cloud;
    for (place, color) in places(&cloud).iter().zip(cloud.colors.as_ref().unwrap()) {
        assert!(place.distance(color.as_dvec3()) < INTERPOLATED, "{place} {color}");
    }
    assert!(cloud.oriented && cloud.normals.iter().all(|&normal| normal == glam::Vec3::Z));
    mesh.normals = vec![glam::Vec3::new(0.5, 0.5, -3.0)];
    mesh.normal_triangles = vec![[0; 3]; 2];
    let turned = sampled(&mesh, 200).cloud;
    assert!(turned.normals.iter().all(|&normal| normal == -glam::Vec3::Z));
    assert!(axes(&turned).iter().all(|[t1, t2]| t1.cross(*t2).z < 0.0));
}

#[test]
fn the_seed_and_nothing_else_decides_where() {
    let mesh = cube(2);
    let with = |seed| sample_surface(&mesh, 500, seed, &mut |_| {}).unwrap();
    assert_eq!(with(1), with(1));
    assert_ne!(with(1), with(2));
}

#[test]
fn triangles_without_area_are_skipped_and_meshes_without_refused() {
    let good = sheet(DVec3::ZERO, DVec3::X, DVec3::Y, 1);
    let line = [DVec3::ZERO, DVec3::X, 2.0 * DVec3::X];
    let bad =
        [[DVec3::ONE; 3], line, [DVec3::NAN, DVec3::X, DVec3::Y], [DVec3::INFINITY, DVec3::X, DVec3::Y]];
    let mixed = soup(&[&good[..], &bad[..], &good[..]].concat());
    let Sampled { cloud, area, skipped, .. } = sampled(&mixed, 100);
    assert_eq!((cloud.len(), area, skipped), (100, 2.0, 4));
    let refused = |mesh: &Mesh, count| sample_surface(mesh, count, 0, &mut |_| {}).unwrap_err().to_string();
    assert!(refused(&soup(&bad), 9).contains("area of the mesh: found 0 in 4 triangles"));
    assert!(refused(&Mesh::default(), 9).contains("found 0 in 0 triangles"));
    assert!(refused(&soup(&good), 0).contains("number of surfels: found 0"));
    let wrong = Mesh { triangles: vec![[0, 1, 6]], ..soup(&good) };
    assert!(refused(&wrong, 9).contains("a corner that is not there"));
}

#[test]
fn spot_becomes_surfels_that_know_their_texture() {
    let folder = std::env::var_os("SPLAT_TEST_DATA").map(PathBuf::from).filter(|folder| folder.is_dir());
    let Some(data) = folder else { return };
    let mesh = splat_io::read_obj(&data.join("meshes/spot/spot_triangulated.obj")).unwrap().mesh;
    assert_eq!(mesh.positions.len(), 2930);
    assert_eq!((mesh.texture_coordinates.len(), mesh.normals.len(), mesh.triangles.len()), (3225, 0, 5856));
    let Sampled { cloud, skipped, without_texture, .. } = sampled(&mesh, 20_000);
    assert_eq!((skipped, without_texture), (0, 0));
    let (low, high) = cloud.bounds().unwrap();
    assert!((low - DVec3::new(-0.471552, -0.736784, -0.668909)).abs().max_element() < 0.02, "{low}");
    assert!((high - DVec3::new(0.471552, 0.953646, 1.049)).abs().max_element() < 0.02, "{high}");
    // The range of the file's own `vt`, which leaves the texture a little.
    let (low, high) = (Vec2::new(-0.0522422, 0.111175), Vec2::new(0.989056, 1.00066));
    let inside = |c: &splat_core::TextureCoordinates| (low.cmple(c.center) & c.center.cmple(high)).all();
    assert!(cloud.texture_coordinates.unwrap().iter().all(inside));
}

#[test]
fn ply_meshes_of_others_become_surfels() {
    let folder = std::env::var_os("SPLAT_TEST_DATA").map(PathBuf::from).filter(|folder| folder.is_dir());
    let Some(data) = folder else { return };
    for (name, triangles, is_textured) in [
        ("meshes/bunny_npm.ply", 3674, false),
        ("meshes/dragon_vrip_res3.ply", 47794, false),
        ("tricky_ply/assimp_cube_uv.ply", 12, true),
        ("tricky_ply/happly_platonic_shelf_big_endian.ply", 0, false),
    ] {
        let path = data.join(name);
        assert!(splat_io::ply_has_faces(&path).unwrap(), "{name}");
        let mesh = splat_io::read_ply_mesh(&path).unwrap().mesh;
        assert!(mesh.triangles.len() == triangles || triangles == 0, "{name}: {}", mesh.triangles.len());
        let cloud = sampled(&mesh, 5000).cloud;
        assert_eq!(cloud.texture_coordinates.is_some(), is_textured, "{name}");
    }
}
