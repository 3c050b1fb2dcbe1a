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
    let Shapes::Ellipses(axes) = &cloud.shapes else { panic!("ellipses") };
    for axis in axes[centre] {
        // The cell is a square of one spacing.
        approx::assert_relative_eq!(axis.length(), 0.8 * 0.5, max_relative = 1e-5);
    }
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
fn planes_spheres_and_cylinders_have_their_normals() {
    let options = PrepareOptions { areas: false, ..PrepareOptions::default() };
    let numbers: Vec<f64> = random(20_000, 5).collect();
    let plane: Vec<DVec3> =
        numbers.chunks_exact(2).map(|n| DVec3::new(n[0], n[1], 2.0 * n[0] - n[1])).collect();
    let normal = DVec3::new(2.0, -1.0, -1.0).normalize();
    // f32 normals and positions.
    assert!(angles(&prepared(&plane, &options), |_| normal).1 < 0.1);

    let round = angles(&prepared(&sphere(10_000, 1), &options), |p| p);
    assert!(round.0 < 1.0 && round.1 < 5.0, "{round:?}");
    let cylinder: Vec<DVec3> = numbers
        .chunks_exact(2)
        .map(|n| {
            let angle = std::f64::consts::TAU * n[0];
            DVec3::new(libm::cos(angle), libm::sin(angle), 6.0 * n[1])
        })
        .collect();
    let curved = angles(&prepared(&cylinder, &options), |p| p.with_z(0.0).normalize());
    assert!(curved.0 < 2.0 && curved.1 < 15.0, "{curved:?}");
}

#[test]
fn noise_of_a_quarter_spacing_leaves_the_normals_of_a_sphere() {
    let points = sphere(20_000, 1);
    let spacing = (4.0 * std::f64::consts::PI / 20_000.0).sqrt();
    let shift = random(20_000, 9).map(|n| 1.0 + 0.5 * spacing * (n - 0.5));
    let noisy: Vec<DVec3> = points.iter().zip(shift).map(|(&p, factor)| p * factor).collect();
    let error = angles(&prepared(&noisy, &PrepareOptions::default()), |p| p.normalize());
    assert!(error.0 < 5.0, "{error:?}");
}

#[test]
fn areas_of_a_sphere_add_up_to_its_surface() {
    let cloud = prepared(&sphere(10_000, 3), &PrepareOptions::default());
    let sum: f64 = cloud.areas.unwrap().iter().map(|&area| f64::from(area)).sum();
    approx::assert_relative_eq!(sum, 4.0 * std::f64::consts::PI, max_relative = 0.1);
}

#[test]
fn parallel_sheets_stay_apart() {
    // Five spacings apart: even in a corner the neighbours are all on the own sheet.
    let points: Vec<DVec3> = (0..800)
        .map(|i| DVec3::new(f64::from(i % 20), f64::from(i / 20 % 20), 5.0 * f64::from(i / 400)))
        .collect();
    let cloud = prepared(&points, &PrepareOptions::default());
    assert!(cloud.normals.iter().all(|normal| normal.z.abs() > 0.999), "sheets are flat");
    let Shapes::Ellipses(axes) = &cloud.shapes else { panic!("ellipses") };
    assert!(axes.iter().flatten().all(|axis| axis.z.abs() < 1e-6 && axis.length() < 4.0));
}

/// The sum of the weights of a flat cloud at a place.
fn weight(cloud: &Cloud, place: DVec3, options: &PrepareOptions) -> f64 {
    let Shapes::Ellipses(axes) = &cloud.shapes else { panic!("ellipses") };
    let areas = cloud.areas.as_ref().unwrap();
    let one = |index: usize| {
        let offset = place - cloud.world_position(index);
        let axes = axes[index].map(|axis| axis.as_dvec3());
        let uv = axes.map(|axis| offset.dot(axis) / axis.length_squared());
        let r2 = uv[0] * uv[0] + uv[1] * uv[1];
        let extent = axes[0].length() * axes[1].length() * options.kernel.integral(options.cutoff);
        f64::from(areas[index]) * options.kernel.value(r2, options.cutoff) / extent
    };
    (0..cloud.len()).map(one).sum()
}

/// Share of the unit square, without a rim, where weights sum to less than 1/2, and how far it reaches beyond its edge.
fn open_and_bloat(points: &[DVec3]) -> (f64, f64) {
    let options = PrepareOptions::default();
    let cloud = prepared(points, &options);
    let numbers: Vec<f64> = random(2000, 77).collect();
    let inside = numbers.chunks_exact(2).map(|n| DVec3::new(0.1 + 0.8 * n[0], 0.1 + 0.8 * n[1], 0.0));
    let open = inside.filter(|&place| weight(&cloud, place, &options) < 0.5).count() as f64 / 1000.0;
    let outside =
        (0..1000).map(|i| DVec3::new(-0.1 * f64::from(i % 20) / 20.0, 0.1 + 8e-4 * f64::from(i), 0.0));
    let covered = outside.filter(|&place| weight(&cloud, place, &options) >= 0.5).count();
    (open, 0.1 * covered as f64 / 1000.0)
}

#[test]
fn even_clouds_close_and_random_ones_nearly() {
    let numbers: Vec<f64> = random(4000, 11).collect();
    let pairs = || numbers.chunks_exact(2).enumerate();
    let scattered: Vec<DVec3> = pairs().map(|(_, n)| DVec3::new(n[0], n[1], 0.0)).collect();
    let spacing = 1.0 / 44.0;
    let jittered: Vec<DVec3> = pairs()
        .take(44 * 44)
        .map(|(i, n)| DVec3::new((i % 44) as f64 + n[0], (i / 44) as f64 + n[1], 0.0) * spacing)
        .collect();
    // Scan lines that are five times as far apart as their points, each shifted by half a point.
    let scanned: Vec<DVec3> = pairs()
        .map(|(i, n)| {
            let (line, along) = (i / 100, (i % 100) as f64 + if i / 100 % 2 == 0 { 0.5 } else { 0.0 });
            DVec3::new((along + 0.3 * n[0]) / 100.0, (line as f64 + 0.5) / 20.0, 0.0)
        })
        .collect();
    for (points, most_open, most_bloat) in [(scattered, 0.02, 0.6), (jittered, 0.0, 0.6), (scanned, 0.0, 0.3)]
    {
        let (open, bloat) = open_and_bloat(&points);
        assert!(
            open <= most_open && bloat <= most_bloat * spacing,
            "{open} open, {} spacings",
            bloat / spacing
        );
    }
}

#[test]
fn a_point_far_from_all_is_no_giant() {
    let mut points: Vec<DVec3> =
        (0..400).map(|i| DVec3::new(f64::from(i % 20), f64::from(i / 20), 0.0)).collect();
    points.push(DVec3::new(1000.0, 0.0, 0.0));
    let cloud = prepared(&points, &PrepareOptions::default());
    let Shapes::Ellipses(axes) = &cloud.shapes else { panic!("ellipses") };
    // Twice the corners' size, which have neighbours on one side only.
    assert!(axes[400].iter().all(|axis| axis.length() < 6.0), "{:?}", axes[400]);
}

#[test]
fn duplicates_share_their_place() {
    let once = sphere(500, 2);
    let twice: Vec<DVec3> = once.iter().chain(&once).copied().collect();
    let [single, double] = [once, twice].map(|points| prepared(&points, &PrepareOptions::default()));
    assert_eq!(single.normals, double.normals[500..]);
    let (Shapes::Ellipses(a), Shapes::Ellipses(b)) = (&single.shapes, &double.shapes) else {
        panic!("ellipses")
    };
    assert_eq!((&a[..], &a[..]), b.split_at(500));
    // Both stand for half of the area.
    for (one, half) in single.areas.unwrap().iter().zip(&double.areas.unwrap()) {
        approx::assert_relative_eq!(*one, 2.0 * half, max_relative = 1e-6);
    }
}

#[test]
fn lines_of_points_get_bounded_splats() {
    let points: Vec<DVec3> = (0..50).map(|i| DVec3::new(0.1 * f64::from(i), 1e6, -2e6)).collect();
    let cloud = prepared(&points, &PrepareOptions::default());
    assert!((0..50).all(|index| cloud.defect(index).is_none()));
    assert!(cloud.normals.iter().all(|normal| normal.x.abs() < 1e-3));
}

#[test]
fn the_number_of_threads_and_the_order_change_no_bit() {
    let points = sphere(40_000, 8);
    let options = PrepareOptions {
        orientation: Orientation::Graph(DVec3::Z),
        outliers: Outliers::Statistical { neighbors: 8, sigmas: 2.0 },
        ..PrepareOptions::default()
    };
    let with = |threads: usize, points: &[DVec3]| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| prepared(points, &options))
    };
    let one = with(1, &points);
    assert_eq!(one, with(3, &points));
    assert!(one.outliers.as_ref().unwrap().iter().any(|&outlier| outlier));
    let backwards: Vec<DVec3> = points.into_iter().rev().collect();
    let mut other = with(2, &backwards);
    other.normals.reverse();
    other.areas.as_mut().unwrap().reverse();
    other.outliers.as_mut().unwrap().reverse();
    if let Shapes::Ellipses(axes) = &mut other.shapes {
        axes.reverse();
    }
    other.positions.reverse();
    assert_eq!(one, other);
}

#[test]
fn sides_are_found() {
    let sphere = sphere(5000, 4);
    let outwards = |orientation: Orientation| {
        let cloud = prepared(&sphere, &PrepareOptions { orientation, ..PrepareOptions::default() });
        assert_eq!(cloud.oriented, orientation != Orientation::TwoSided);
        let outwards = |i: &usize| cloud.normals[*i].as_dvec3().dot(sphere[*i]) > 0.0;
        (0..cloud.len()).filter(outwards).count()
    };
    assert_eq!(outwards(Orientation::Graph(DVec3::Y)), 5000);
    assert_eq!(outwards(Orientation::Viewpoint(DVec3::ZERO)), 0);
    let up = outwards(Orientation::Direction(DVec3::Z));
    let upper = sphere.iter().filter(|p| p.z > 0.0).count();
    assert!(up.abs_diff(upper) < 100, "{up}, {upper}");
    assert!((1..5000).contains(&outwards(Orientation::TwoSided)));
}

#[test]
fn given_normals_keep_their_sides_and_given_sizes_stay() {
    let mut cloud = grid(5, 1.0);
    cloud.normals = vec![Vec3::NEG_Z; 25];
    cloud.oriented = true;
    let Shapes::Discs(sizes) = &mut cloud.shapes else { panic!("discs") };
    sizes[3] = 0.7;
    let options =
        PrepareOptions { orientation: Orientation::Direction(DVec3::Z), ..PrepareOptions::default() };
    let estimated = prepare(&mut cloud, &options, &mut |_| {});
    assert_eq!(estimated, Estimated { sizes: 24, areas: true, ..Estimated::default() });
    assert!(cloud.normals.iter().all(|&normal| normal == Vec3::NEG_Z));
    let Shapes::Discs(sizes) = &cloud.shapes else { panic!("discs") };
    assert_eq!(sizes[3], 0.7);
    approx::assert_relative_eq!(sizes[12], 0.8, max_relative = 1e-6);
    let again = cloud.clone();
    assert_eq!(prepare(&mut cloud, &options, &mut |_| {}), Estimated::default());
    assert_eq!(cloud, again);

    let mut fixed = grid(5, 1.0);
    prepare(&mut fixed, &PrepareOptions { radius: Some(0.25), size_scale: 2.0, ..options }, &mut |_| {});
    assert_eq!(fixed.shapes, Shapes::Discs(vec![0.5; 25]));
}

#[test]
fn outliers_are_marked_and_taken_out() {
    for outliers in
        [Outliers::Statistical { neighbors: 8, sigmas: 3.0 }, Outliers::Radius { radius: 2.5, count: 3 }]
    {
        let mut cloud = grid(20, 1.0);
        cloud.positions[7] = Vec3::new(9.0, 9.0, 40.0);
        cloud.positions[8] = Vec3::NAN;
        let estimated =
            prepare(&mut cloud, &PrepareOptions { outliers, ..PrepareOptions::default() }, &mut |_| {});
        assert_eq!(estimated.outliers, 1);
        assert_eq!(cloud.defect(7), Some(crate::Defect::Outlier));
        assert_eq!(cloud.defect(8), Some(crate::Defect::NotFinite));
        assert_eq!(cloud.bounds().unwrap().1.z, 0.0);
        cloud.remove_outliers();
        assert_eq!((cloud.len(), cloud.check_lengths(), &cloud.outliers), (399, Ok(()), &None));
        assert!(cloud.positions[7].is_nan());
    }
}
