//! Preparation, end to end.

use super::*;
use crate::TextureCoordinates;
use glam::{DVec3, Vec2, Vec3};

/// n x n points on the plane z = 0, at this spacing.
fn grid(n: usize, spacing: f64) -> Cloud {
    let points: Vec<DVec3> =
        (0..n * n).map(|i| DVec3::new((i % n) as f64, (i / n) as f64, 0.0) * spacing).collect();
    Cloud::from_points(&points)
}

#[test]
fn a_regular_grid_gets_its_normal_spacing_and_area() {
    let mut cloud = grid(21, 0.5);
    let estimated = prepare(&mut cloud, &PrepareOptions::default(), &mut |_| {});
    assert_eq!(estimated, Estimated { normals: true, sizes: 441, areas: true, ..Estimated::default() });
    let centre = 10 * 21 + 10;
    assert!(cloud.normals.iter().all(|n| n.z.abs() > 0.999_99), "{:?}", cloud.normals[centre]);
    let Shapes::Discs(sizes) = &cloud.shapes else { panic!("discs") };
    // The eighth neighbour of a square grid is at sqrt(2) spacings: sigma = sqrt(2) sqrt(pi / 8) = 0.886 of them.
    approx::assert_relative_eq!(sizes[centre], 0.5 * 0.886_227, max_relative = 1e-5);
    // The sum of the kernel over a square grid differs from its integral by a few per cent at this sigma.
    approx::assert_relative_eq!(cloud.areas.as_ref().unwrap()[centre], 0.25, max_relative = 0.05);
}

#[test]
fn estimates_do_not_depend_on_the_order_of_points() {
    let mut cloud = grid(9, 1.0);
    // Move the points off the grid, so that nothing is symmetric, and repeat one.
    for (i, p) in cloud.positions.iter_mut().enumerate() {
        *p += Vec3::new((i * 7 % 11) as f32, (i * 5 % 13) as f32, (i * 3 % 7) as f32) * 0.02;
    }
    cloud.positions[3] = cloud.positions[4];
    let mut reversed = cloud.clone();
    reversed.positions.reverse();
    prepare(&mut cloud, &PrepareOptions::default(), &mut |_| {});
    prepare(&mut reversed, &PrepareOptions::default(), &mut |_| {});
    reversed.normals.reverse();
    reversed.areas.as_mut().unwrap().reverse();
    assert_eq!(cloud.normals, reversed.normals);
    assert_eq!(cloud.areas, reversed.areas);
}

#[test]
fn bad_and_few_points_do_no_harm() {
    for count in 1..4 {
        let mut points = vec![DVec3::NAN, DVec3::new(1e300, 0.0, 0.0)];
        points.extend((0..count).map(|i| DVec3::new(f64::from(i), 0.0, 0.0)));
        let mut cloud = Cloud::from_points(&points);
        prepare(&mut cloud, &PrepareOptions::default(), &mut |_| {});
        assert!((2..points.len()).all(|i| cloud.defect(i).is_none()), "{cloud:?}");
        assert!(cloud.defect(0).is_some() && cloud.defect(1).is_some());
    }
    let mut coincident = Cloud::from_points(&[DVec3::ONE; 20]);
    prepare(&mut coincident, &PrepareOptions::default(), &mut |_| {});
    assert!((0..20).all(|i| coincident.defect(i).is_none()), "{coincident:?}");
}

#[test]
fn a_splat_that_grows_carries_more_of_its_texture() {
    let mut cloud = grid(3, 1.0);
    cloud.shapes = Shapes::Ellipses(vec![[Vec3::X, Vec3::Y]; 9]);
    let given = TextureCoordinates { center: Vec2::splat(0.5), per_u: Vec2::X, per_v: Vec2::new(2.0, 3.0) };
    cloud.texture_coordinates = Some(vec![given; 9]);
    prepare(&mut cloud, &PrepareOptions { size_scale: 0.5, ..PrepareOptions::default() }, &mut |_| {});
    let halved = TextureCoordinates { per_u: 0.5 * given.per_u, per_v: 0.5 * given.per_v, ..given };
    assert_eq!(cloud.texture_coordinates, Some(vec![halved; 9]));
    assert_eq!(cloud.shapes, Shapes::Ellipses(vec![[0.5 * Vec3::X, 0.5 * Vec3::Y]; 9]));
}

/// Numbers in [0, 1) that look random: a low-discrepancy sequence would be too even.
fn random(count: usize, seed: u64) -> impl Iterator<Item = f64> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    (0..count).map(move |_| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64
    })
}

/// Random points on the unit sphere.
fn sphere(count: usize, seed: u64) -> Vec<DVec3> {
    let numbers: Vec<f64> = random(2 * count, seed).collect();
    let point = |n: &[f64]| {
        let (z, angle) = (2.0 * n[0] - 1.0, std::f64::consts::TAU * n[1]);
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * libm::cos(angle), r * libm::sin(angle), z)
    };
    numbers.chunks_exact(2).map(point).collect()
}

/// The cloud of bare points, prepared.
fn prepared(points: &[DVec3], options: &PrepareOptions) -> Cloud {
    let mut cloud = Cloud::from_points(points);
    prepare(&mut cloud, options, &mut |_| {});
    cloud
}

/// Root mean square and greatest angle between normals, sides left out, and those expected, in degrees.
fn angles(cloud: &Cloud, expected: impl Fn(DVec3) -> DVec3) -> (f64, f64) {
    let angle = |index: usize| {
        let cosine = cloud.normals[index].as_dvec3().dot(expected(cloud.world_position(index))).abs();
        libm::acos(cosine.min(1.0)).to_degrees()
    };
    let angles: Vec<f64> = (0..cloud.len()).map(angle).collect();
    let square = angles.iter().map(|angle| angle * angle).sum::<f64>() / angles.len() as f64;
    (square.sqrt(), angles.into_iter().fold(0.0, f64::max))
}

#[test]
fn measure_normals() {
    for k in [6, 8, 10, 12, 16, 20, 24, 32] {
        let options = PrepareOptions { normals_k: k, areas: false, ..PrepareOptions::default() };
        let clean = angles(&prepared(&sphere(20_000, 1), &options), |p| p);
        let spacing = (4.0 * std::f64::consts::PI / 20_000.0).sqrt();
        let noise: Vec<f64> = random(20_000, 9).collect();
        let noisy: Vec<DVec3> = sphere(20_000, 1)
            .iter()
            .zip(noise)
            .map(|(&p, n)| p * (1.0 + 0.5 * spacing * (n - 0.5)))
            .collect();
        let noisy = angles(&prepared(&noisy, &options), |p| p.normalize());
        // An edge of a box: two half planes.
        let numbers: Vec<f64> = random(40_000, 3).collect();
        let roof: Vec<DVec3> = numbers
            .chunks_exact(2)
            .enumerate()
            .map(|(i, n)| if i % 2 == 0 { DVec3::new(n[0], n[1], 0.0) } else { DVec3::new(n[0], 0.0, n[1]) })
            .collect();
        let cloud = prepared(&roof, &options);
        let edge = angles(&cloud, |p| if p.z == 0.0 { DVec3::Z } else { DVec3::Y });
        println!(
            "k {k}: sphere rms {:.2} max {:.1}; noisy rms {:.2} max {:.1}; edge rms {:.2}",
            clean.0, clean.1, noisy.0, noisy.1, edge.0
        );
    }
}

/// The sum of weights at a place on the surface.
fn weight(cloud: &Cloud, q: DVec3, options: &PrepareOptions) -> f64 {
    let Shapes::Discs(sizes) = &cloud.shapes else { panic!("discs") };
    let areas = cloud.areas.as_ref().unwrap();
    let term = |i: usize| {
        let size = f64::from(sizes[i]);
        let offset = q - cloud.world_position(i);
        let n = cloud.normals[i].as_dvec3();
        let off = offset.dot(n);
        if off.abs() > size {
            return 0.0;
        }
        let r2 = (offset.length_squared() - off * off) / (size * size);
        if r2 >= options.cutoff {
            return 0.0;
        }
        f64::from(areas[i]) * options.kernel.value(r2, options.cutoff)
            / (size * size * options.kernel.integral(options.cutoff))
    };
    (0..cloud.len()).map(term).sum()
}

#[test]
fn measure_closing() {
    let square = |n: &[f64]| DVec3::new(n[0], n[1], 0.0);
    let numbers: Vec<f64> = random(8_000, 11).collect();
    let poisson: Vec<DVec3> = numbers.chunks_exact(2).map(square).collect();
    let jitter: Vec<DVec3> = numbers
        .chunks_exact(2)
        .enumerate()
        .map(|(i, n)| DVec3::new(((i % 63) as f64 + n[0]) / 63.0, ((i / 63) as f64 + n[1]) / 63.0, 0.0))
        .filter(|p| p.y <= 1.0)
        .collect();
    let lines = |ratio: f64| -> Vec<DVec3> {
        let rows = (63.0 / ratio.sqrt()) as usize;
        let columns = (63.0 * ratio.sqrt()) as usize;
        (0..rows * columns)
            .map(|i| {
                let n = &numbers[2 * (i % 4000)..];
                DVec3::new(
                    ((i % columns) as f64 + 0.3 * n[0] + if (i / columns) % 2 == 0 { 0.5 } else { 0.0 })
                        / columns as f64,
                    ((i / columns) as f64 + 0.5 + 0.1 * n[1]) / rows as f64,
                    0.0,
                )
            })
            .collect()
    };
    let tests: Vec<DVec3> = random(4_000, 77).collect::<Vec<_>>().chunks_exact(2).map(square).collect();
    for (name, points) in [
        ("poisson", poisson),
        ("jitter", jitter),
        ("lines 3", lines(3.0)),
        ("lines 5", lines(5.0)),
        ("lines 10", lines(10.0)),
    ] {
        for k in [6, 8, 12, 16] {
            let mut text = format!("{name} k {k}:");
            for scale in [0.6, 0.7, 0.8, 1.0] {
                let options = PrepareOptions { radius_k: k, size_scale: scale, ..PrepareOptions::default() };
                let cloud = prepared(&points, &options);
                let inside: Vec<f64> = tests
                    .iter()
                    .filter(|q| q.x > 0.1 && q.x < 0.9 && q.y > 0.1 && q.y < 0.9)
                    .map(|&q| weight(&cloud, q, &options))
                    .collect();
                let open = inside.iter().filter(|&&w| w < 0.5).count() as f64 / inside.len() as f64;
                // Beyond the left edge.
                let out = (0..1000)
                    .map(|i| {
                        DVec3::new(-0.06 * f64::from(i % 20) / 20.0, 0.1 + 0.8 * f64::from(i) / 1000.0, 0.0)
                    })
                    .filter(|&q| weight(&cloud, q, &options) >= 0.5)
                    .count() as f64
                    / 1000.0
                    * 0.06
                    * 63.0;
                text += &format!(" | {scale}: open {:.2} % bloat {out:.2}", 100.0 * open);
            }
            println!("{text}");
        }
    }
}
