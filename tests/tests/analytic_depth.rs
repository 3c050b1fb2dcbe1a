//! Depth, normal, position and the other AOVs, against planes met by the very rays of the samples.

use glam::{DMat4, DQuat, DVec2, DVec3, Vec3};
use splat_core::film::NO_ID;
use splat_core::{AovSelection, Cloud, Kernel, Lens, PixelFilter, RenderOptions};
use splat_tests::analytic::{
    Plane, center_of, picture, pixels, sample_positions, sample_table, tilted_plane, wall,
};
use splat_tests::scenes::{Surfel, cloud, hard_discs, orthographic, pinhole, with_lens};
use splat_tests::tolerances as tol;

// ---------------------------------------------------------------------------------------------------------
// Depth, normal, position

#[test]
fn the_depth_of_a_tilted_plane() {
    let options = RenderOptions { aovs: AovSelection::ALL, ..hard_discs(64) };
    // Measured from the centre, and from the deepest point of a disc that reaches behind the eye.
    for radius in [6.0, 50.0] {
        let cloud = tilted_plane(radius);
        let plane = Plane::of(&cloud, 0);
        for camera in [pinhole(48, 36, 60.0), orthographic(48, 36, 16.0)] {
            let film = picture(&cloud, &camera, &options);
            let table = sample_table(&camera, &options);
            let depths = film.depth.as_ref().expect("asked for");
            for (x, y) in pixels(&film) {
                let found = f64::from(depths[film.index(x, y)]);
                // Against the very samples' places: rounding only.
                let exact =
                    sample_positions(&table, x, y).map(|p| plane.depth(&camera, p)).sum::<f64>() / 64.0;
                let error = (found / exact - 1.0).abs();
                assert!(error <= tol::PLANE_DEPTH, "({x}, {y}): {found}, expected {exact}: {error}");
                // Against the pixel's centre: its samples' mean lies within 1/(2 S) of it on either axis,
                // since one sample lies in each of S strips, and a curved w has another mean than its middle.
                let at = |dx: f64, dy: f64| plane.depth(&camera, center_of(x, y) + DVec2::new(dx, dy));
                let middle = at(0.0, 0.0);
                let slope = (at(0.5, 0.0) - at(-0.5, 0.0)).abs() + (at(0.0, 0.5) - at(0.0, -0.5)).abs();
                let bend = (at(0.5, 0.0) + at(-0.5, 0.0) - 2.0 * middle).abs()
                    + (at(0.0, 0.5) + at(0.0, -0.5) - 2.0 * middle).abs()
                    + (at(0.5, 0.5) + at(-0.5, -0.5) - at(0.5, -0.5) - at(-0.5, 0.5)).abs();
                let bound = slope / 128.0 + bend + tol::PLANE_DEPTH * middle;
                assert!((found - middle).abs() <= bound, "({x}, {y}): {found}, {middle} +- {bound}");
                assert!(bound < 0.01 * middle, "({x}, {y}): a bound of {bound} says nothing");
            }
        }
    }
}

#[test]
fn the_depth_of_a_tilted_plane_through_a_lens() {
    // The ray from lens point p: (p + (s - p/focus) w, w).
    let lens = Lens { radius: 0.4, focus: 3.0, blades: 0 };
    let camera = with_lens(pinhole(48, 36, 60.0), lens);
    let options = RenderOptions { aovs: AovSelection::ALL, ..hard_discs(16) };
    let cloud = tilted_plane(6.0);
    let plane = Plane::of(&cloud, 0);
    let film = picture(&cloud, &camera, &options);
    let table = sample_table(&camera, &options);
    let (depths, positions) =
        (film.depth.as_ref().expect("asked for"), film.position.as_ref().expect("asked for"));
    for (x, y) in pixels(&film) {
        let points: DVec3 = sample_positions(&table, x, y)
            .zip(table.unit_lens(x, y))
            .map(|(position, unit)| {
                let p = DVec2::from(unit.map(f64::from)) * lens.radius;
                let screen = (position - camera.principal_point) / 60.0;
                let (origin, direction) = (p.extend(0.0), (screen - p / lens.focus).extend(1.0));
                let along = plane.normal.dot(plane.point - origin) / plane.normal.dot(direction);
                origin + along * direction
            })
            .sum::<DVec3>()
            / 16.0;
        let i = film.index(x, y);
        let error = (f64::from(depths[i]) / points.z - 1.0).abs();
        assert!(error <= tol::PLANE_DEPTH, "({x}, {y}): {error}");
        let position = positions[i].as_dvec3() + film.position_origin;
        let error = (position - points).length() / points.z;
        assert!(error <= tol::PLANE_DEPTH, "({x}, {y}): {error}");
    }
}

#[test]
fn the_normal_and_the_position_of_a_tilted_plane_anywhere() {
    for origin in [DVec3::ZERO, DVec3::new(500_000.0, 5_000_000.0, 100.0)] {
        let point = origin + DVec3::new(0.2, -0.1, 4.0);
        let surfel = Surfel::new(point, DVec3::new(0.5, -0.3, -0.8), 6.0);
        // Not the only point, so that the origin is no accident.
        let cloud =
            cloud(&[surfel, surfel, Surfel::new(point + DVec3::new(9.0, 0.1, 1.0), DVec3::NEG_Z, 0.1)]);
        let plane = Plane::of(&cloud, 0);
        let turn = DQuat::from_rotation_z(0.4);
        for mut camera in [pinhole(48, 36, 60.0), orthographic(48, 36, 16.0)] {
            camera.world_to_camera = DMat4::from_quat(turn) * DMat4::from_translation(-origin);
            let options = RenderOptions { aovs: AovSelection::ALL, ..hard_discs(16) };
            let film = picture(&cloud, &camera, &options);
            assert_eq!(film.position_origin, cloud.origin);
            let positions = film.position.as_ref().expect("asked for");
            let depths = film.depth.as_ref().expect("asked for");
            for (x, y) in pixels(&film) {
                let i = film.index(x, y);
                let position = positions[i].as_dvec3() + film.position_origin;
                // Points of a plane have their mean on the plane.
                let off = (position - plane.point).dot(plane.normal).abs();
                assert!(off <= tol::PLANE_POSITION, "({x}, {y}): {off} off the plane");
                let seen = camera.world_to_camera.transform_point3(position);
                assert!((seen.z - f64::from(depths[i])).abs() <= tol::PLANE_POSITION);
                let screen =
                    if camera.is_orthographic() { seen.truncate() } else { seen.truncate() / seen.z };
                let pixel = screen * camera.pixel_scale() + camera.principal_point;
                let error = (pixel - center_of(x, y)).abs().max_element();
                assert!(error <= tol::PLANE_PIXEL, "({x}, {y}): {error} pixels off");
                let normal = film.normal.as_ref().expect("asked for")[i].as_dvec3();
                assert!((normal - plane.normal).length() <= tol::UNIT_VECTOR, "{normal}");
                assert_eq!(film.albedo.as_ref().expect("asked for")[i], Vec3::ONE);
            }
        }
    }
}

#[test]
fn normals_of_unknown_side_face_the_eye() {
    for orthographic_camera in [false, true] {
        for oriented in [false, true] {
            let camera = if orthographic_camera { orthographic(8, 8, 4.0) } else { pinhole(8, 8, 10.0) };
            let away = Surfel { normal: DVec3::new(0.2, 0.1, 1.0), ..wall(4.0) };
            let cloud = Cloud { oriented, ..cloud(&[away]) };
            let options = RenderOptions { aovs: AovSelection::ALL, ..hard_discs(4) };
            let film = picture(&cloud, &camera, &options);
            let expected = if oriented { cloud.normals[0] } else { -cloud.normals[0] };
            for normal in film.normal.iter().flatten() {
                assert!((*normal - expected).length() <= tol::UNIT_VECTOR as f32, "{normal}");
            }
        }
    }
}

// ---------------------------------------------------------------------------------------------------------
// AOVs

#[test]
fn the_id_is_that_of_the_heaviest_fragment_in_front() {
    // Two coplanar Gaussians of one size: the nearer centre is the heavier. A third one far behind.
    let camera = pinhole(32, 24, 20.0);
    let surfels = [
        Surfel::new(DVec3::new(0.0, 0.0, 8.0), DVec3::NEG_Z, 20.0),
        Surfel::new(DVec3::new(-0.6, 0.0, 4.0), DVec3::NEG_Z, 3.0),
        Surfel::new(DVec3::new(0.6, 0.0, 4.0), DVec3::NEG_Z, 3.0),
    ];
    let options = RenderOptions {
        samples: 4,
        filter: PixelFilter::Box,
        kernel: Kernel::Gaussian,
        cutoff: 3.0,
        thickness: 0.01,
        aovs: AovSelection::ALL,
        ..RenderOptions::default()
    };
    let film = picture(&cloud(&surfels), &camera, &options);
    let ids = film.id.as_ref().expect("asked for");
    for (x, y) in pixels(&film) {
        assert_eq!(ids[film.index(x, y)], if x < 16 { 1 } else { 2 }, "({x}, {y})");
    }
    assert!(film.layers.iter().flatten().all(|&n| n == 2.0));
    // Nothing there, nothing told.
    let empty = picture(&cloud(&[Surfel::new(DVec3::NEG_Z, DVec3::Z, 0.1)]), &camera, &options);
    assert_eq!(empty.rgba, vec![[0.0; 4]; 32 * 24]);
    assert!(empty.id.iter().flatten().all(|&id| id == NO_ID));
    assert!(empty.depth.iter().flatten().all(|&z| z == f32::INFINITY));
    assert!(empty.coverage.iter().chain(&empty.layers).flatten().all(|&value| value == 0.0));
    assert!(empty.normal.iter().chain(&empty.albedo).flatten().all(|&value| value == Vec3::ZERO));
    assert!(empty.position.iter().chain(&empty.variance).flatten().all(|&value| value == Vec3::ZERO));
}

#[test]
fn aovs_count_samples_layers_coverage_and_variance() {
    // A transparent wall before an opaque disc.
    let camera = pinhole(24, 24, 24.0);
    let surfels = [wall(3.0).with_opacity(0.25), Surfel::new(DVec3::new(0.0, 0.0, 4.0), DVec3::NEG_Z, 1.0)];
    let options = RenderOptions { aovs: AovSelection::ALL, ..hard_discs(16) };
    let film = picture(&cloud(&surfels), &camera, &options);
    let (layers, variance) = (film.layers.as_ref().expect("asked"), film.variance.as_ref().expect("asked"));
    let mut partial = 0;
    for i in 0..film.rgba.len() {
        // p of the samples hit the disc: two layers, alpha 1; the others see the wall alone.
        let p = layers[i] - 1.0;
        partial += i32::from(p > 0.0 && p < 1.0);
        assert!((0.0..=1.0).contains(&p));
        assert_eq!(film.rgba[i][3], 0.25 + 0.75 * p);
        assert_eq!(film.coverage.as_ref().expect("asked")[i], 1.0);
        assert_eq!(film.samples.as_ref().expect("asked")[i], 16.0);
        // The variance of the mean of n values, of which a part p is .75 larger.
        let expected = 0.75 * 0.75 * p * (1.0 - p) / 15.0;
        assert!(
            (variance[i] - Vec3::splat(expected)).abs().max_element() <= tol::VARIANCE,
            "{}",
            variance[i]
        );
        // The disc is what one sees, at its very depth; the wall alone leaves most of the light.
        let depth = film.depth.as_ref().expect("asked")[i];
        assert_eq!(depth, if p > 0.0 { 4.0 } else { f32::INFINITY });
    }
    assert!(partial > 20, "{partial}");
    // Without the wall, coverage is alpha.
    let alone = picture(&cloud(&surfels[1..]), &camera, &options);
    let coverage = alone.coverage.as_ref().expect("asked");
    assert!(alone.rgba.iter().zip(coverage).all(|(pixel, &c)| pixel[3] == c));
    assert!(coverage.iter().any(|&c| c > 0.0 && c < 1.0));
    let some = RenderOptions { sample_range: Some(3..5), ..options };
    assert!(picture(&cloud(&surfels), &camera, &some).samples.iter().flatten().all(|&n| n == 2.0));
    let one = RenderOptions { samples: 1, ..some };
    let one = RenderOptions { sample_range: None, ..one };
    assert!(picture(&cloud(&surfels), &camera, &one).variance.iter().flatten().all(|&v| v == Vec3::ZERO));
}
