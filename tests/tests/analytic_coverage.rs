//! How much of each pixel a splat covers, and the weights it leaves there, against areas in closed form.

use std::f64::consts::PI;

use glam::{DMat2, DMat3, DVec2, DVec3, Vec3};
use splat_core::{
    AovSelection, Camera, Cloud, Film, Kernel, PatternKind, PixelFilter, Projection, RenderOptions, Shapes,
    TableMode,
};
use splat_tests::analytic::{Plane, alpha_moments, alphas, center_of, picture, pixels};
use splat_tests::scenes::{self, OPAQUE, Surfel, cloud, hard_discs, orthographic, pinhole, soft};
use splat_tests::tolerances as tol;

// ---------------------------------------------------------------------------------------------------------
// Coverage of a disc

/// An ellipse of the picture, in pixels.
#[derive(Debug, Clone, Copy)]
struct Ellipse {
    area: f64,
    center: DVec2,
    /// An upper bound of its perimeter.
    perimeter: f64,
}

/// The image of a disc, from its cone: a ray d meets the plane n.p = k in d k/(n.d), within R of P where
/// k^2 |d|^2 - 2 k (P.d)(n.d) + (|P|^2 - R^2)(n.d)^2 <= 0.
fn image_of_disc(plane: Plane, radius: f64, camera: &Camera) -> Ellipse {
    let Plane { point, normal } = plane;
    let k = normal.dot(point);
    let outer = |a: DVec3, b: DVec3| DMat3::from_cols(a * b.x, a * b.y, a * b.z);
    let cone = DMat3::from_diagonal(DVec3::splat(k * k)) - k * (outer(point, normal) + outer(normal, point))
        + (point.length_squared() - radius * radius) * outer(normal, normal);
    let a = DMat2::from_cols(cone.x_axis.truncate(), cone.y_axis.truncate());
    let level = -cone.determinant() / a.determinant();
    let center = -(a.inverse() * cone.z_axis.truncate());
    let scale = camera.pixel_scale();
    // a^2 + b^2 of the semi-axes, and P <= 2 pi sqrt((a^2 + b^2) / 2).
    let squares = level * (a.x_axis.x + a.y_axis.y) / a.determinant();
    Ellipse {
        area: PI * level / a.determinant().sqrt() * scale.x * scale.y,
        center: center * scale + camera.principal_point,
        perimeter: 2.0 * PI * (0.5 * squares).sqrt() * scale.max_element(),
    }
}

fn assert_ellipse(name: &str, film: &Film, expected: Ellipse, options: &RenderOptions) {
    let area: f64 = alphas(film).sum();
    let error = (area - expected.area).abs();
    let bound = tol::area_of_samples(expected.perimeter, options.samples);
    assert!(error <= bound, "{name}: area {area}, expected {} +- {bound}", expected.area);
    let (centroid, _) = alpha_moments(film);
    let error = (centroid - expected.center).length();
    let bound = tol::centroid_of_samples(expected.perimeter, expected.area, options.samples);
    assert!(error <= bound, "{name}: centroid {error} pixels off, bound {bound}");
}

#[test]
fn a_disc_covers_the_area_of_its_ellipse() {
    let mut camera = pinhole(128, 112, 100.0);
    let focal_length = DVec2::new(110.0, 85.0);
    camera.projection = Projection::Perspective { focal_length, lens: None };
    camera.principal_point = DVec2::new(61.3, 52.9);
    for (i, normal) in [
        DVec3::new(0.0, 0.0, -1.0),
        DVec3::new(1.0, 0.0, -1.0),
        DVec3::new(-0.4, 0.7, -1.0),
        DVec3::new(0.3, -3.0, -0.5),
        DVec3::new(-2.0, 0.5, 0.6),
    ]
    .into_iter()
    .enumerate()
    {
        for filter in [PixelFilter::Box, PixelFilter::Tent] {
            // The same disc by different sigma and F.
            let cutoff: f64 = [1.0, 4.0, 9.0][i % 3];
            let surfel = Surfel::new(DVec3::new(0.35, -0.2, 3.0), normal, 1.1 / cutoff.sqrt());
            let cloud = cloud(&[surfel]);
            let options = RenderOptions { cutoff, filter, ..hard_discs(64) };
            let film = picture(&cloud, &camera, &options);
            let Shapes::Discs(sizes) = &cloud.shapes else { unreachable!("discs") };
            let expected = image_of_disc(Plane::of(&cloud, 0), f64::from(sizes[0]) * cutoff.sqrt(), &camera);
            assert_ellipse(&format!("disc {i}, {filter:?}"), &film, expected, &options);
        }
    }
}

#[test]
fn an_orthographic_disc_covers_its_foreshortened_area() {
    let mut camera = orthographic(96, 80, 24.0);
    camera.principal_point = DVec2::new(44.7, 43.1);
    let options = hard_discs(64);
    for normal in [DVec3::new(0.0, 0.0, -1.0), DVec3::new(1.0, -0.5, -1.0), DVec3::new(0.2, 4.0, 1.0)] {
        let cloud = cloud(&[Surfel::new(DVec3::new(0.2, -0.3, 3.0), normal, 1.25)]);
        let foreshortening = normal.z.abs() / normal.length();
        let expected = Ellipse {
            area: PI * 1.25 * 1.25 * foreshortening * 24.0 * 24.0,
            center: DVec2::new(0.2, -0.3) * 24.0 + camera.principal_point,
            perimeter: 2.0 * PI * 1.25 * 24.0,
        };
        assert_ellipse(&format!("{normal}"), &picture(&cloud, &camera, &options), expected, &options);
    }
}

#[test]
fn an_ellipse_covers_the_area_of_its_axes() {
    // Axes that are neither equal nor perpendicular, seen straight on: pi F |T1 x T2|.
    let camera = pinhole(96, 80, 60.0);
    let axes = [Vec3::new(0.5, 0.1, 0.0), Vec3::new(-0.2, 0.3, 0.0)];
    let surfel = Surfel::new(DVec3::new(0.1, 0.1, 2.0), DVec3::NEG_Z, 1.0);
    let cloud = Cloud { shapes: Shapes::Ellipses(vec![axes]), ..cloud(&[surfel]) };
    let options = RenderOptions { cutoff: 2.0, ..hard_discs(64) };
    let expected = Ellipse {
        area: PI * 2.0 * 0.17 * 30.0 * 30.0,
        center: DVec2::new(51.0, 43.0),
        perimeter: 2.0 * PI * (0.5 * 2.0 * (0.26 + 0.13f64)).sqrt() * 30.0,
    };
    assert_ellipse("ellipse", &picture(&cloud, &camera, &options), expected, &options);
}

/// The part of pixel (x, y) within a circle, by rows, each exact.
fn part_in_circle(x: i32, y: i32, center: DVec2, radius: f64) -> f64 {
    const ROWS: u32 = 256;
    let row = |i: u32| {
        let dy = f64::from(y) + (f64::from(i) + 0.5) / f64::from(ROWS) - center.y;
        let half = (radius * radius - dy * dy).max(0.0).sqrt();
        let (x0, x1) = (f64::from(x), f64::from(x) + 1.0);
        (x1.min(center.x + half) - x0.max(center.x - half)).max(0.0)
    };
    (0..ROWS).map(row).sum::<f64>() / f64::from(ROWS)
}

#[test]
fn the_edge_of_a_half_plane_covers_parts_of_pixels() {
    // The edge of a disc of 6000 pixels, from four sides and slanted, through the picture's middle (about).
    let camera = orthographic(24, 24, 1.0);
    // Sobol's patterns have one of 256 samples in each of 256 strips; the default ones do not care for the axes.
    let patterns = [PatternKind::Sobol, PatternKind::Dealt];
    let radius = 6000.0;
    for (direction, bound) in [
        (DVec2::X, tol::STRAIGHT_EDGE),
        (DVec2::NEG_X, tol::STRAIGHT_EDGE),
        (DVec2::Y, tol::STRAIGHT_EDGE),
        (DVec2::NEG_Y, tol::STRAIGHT_EDGE),
        (DVec2::new(0.6, 0.8), tol::SLANTED_EDGE),
        (DVec2::new(-0.96, 0.28), tol::SLANTED_EDGE),
    ] {
        let center = -direction * (radius - 0.3);
        let cloud = cloud(&[Surfel::new(center.extend(5.0), DVec3::NEG_Z, radius)]);
        for pattern in patterns {
            let film = picture(&cloud, &camera, &RenderOptions { pattern, ..hard_discs(256) });
            let center = cloud.world_position(0).truncate() + camera.principal_point;
            let (mut partial, mut largest) = (0, 0.0f64);
            for ((x, y), alpha) in pixels(&film).zip(alphas(&film)) {
                let expected = part_in_circle(x, y, center, radius);
                partial += i32::from(expected > 0.01 && expected < 0.99);
                largest = largest.max((alpha - expected).abs());
            }
            let bound = if pattern == PatternKind::Sobol { bound } else { tol::SLANTED_EDGE };
            assert!(largest <= bound, "{pattern:?}, {direction}: {largest} > {bound}");
            assert!(partial >= 20, "{direction}: only {partial} pixels on the edge");
        }
    }
}

#[test]
fn the_weights_of_a_splat_sum_to_its_area() {
    // area k / (sigma^2 I), with a saturation above the greatest weight: alpha is the weight, but for a
    // factor.
    let camera = pinhole(64, 64, 64.0);
    for kernel in [Kernel::Gaussian, Kernel::Windowed] {
        for table in [TableMode::Lerp256, TableMode::Floor256] {
            let surfel = Surfel::new(DVec3::new(0.05, 0.02, 2.0), DVec3::NEG_Z, 0.4);
            let cloud = Cloud { areas: Some(vec![0.5]), ..cloud(&[surfel]) };
            let options = RenderOptions {
                samples: 16,
                filter: PixelFilter::Box,
                kernel,
                table,
                resolve: soft(4.0),
                ..RenderOptions::default()
            };
            let film = picture(&cloud, &camera, &options);
            let sum = 4.0 * alphas(&film).sum::<f64>();
            let expected = 0.5 * 32.0 * 32.0;
            // The floor table is half a bin of 4/256 too early in the mean, for which the exponential falls
            // by half that: so much of its own integral, in units of the kernel's.
            let rim = libm::exp(-2.0);
            let jump = if kernel == Kernel::Windowed { 2.0 * rim } else { 0.0 };
            let floor = 1.0 / 256.0 * (1.0 - rim) / (1.0 - rim - jump);
            let bias = if table == TableMode::Floor256 { floor } else { 0.0 };
            let error = sum / expected - 1.0 - bias;
            assert!(error.abs() <= tol::SUM_OF_WEIGHTS, "{kernel:?}, {table:?}: {error}");
            // The greatest one at the middle.
            let peak = 4.0 * alphas(&film).fold(0.0, f64::max);
            let expected = 0.5 / (0.16 * kernel.integral(4.0));
            assert!((peak / expected - 1.0).abs() <= tol::PEAK_OF_WEIGHTS, "{kernel:?}: {peak}, {expected}");
        }
    }
}

// ---------------------------------------------------------------------------------------------------------
// A closed surface

#[test]
fn the_weights_of_a_closed_surface_sum_to_one() {
    let camera = pinhole(112, 112, 200.0);
    // Fronts only, a saturation of 2 and one sample a pixel: alpha is W/2 of one sample, if W < 2.
    let options = RenderOptions {
        samples: 1,
        filter: PixelFilter::Box,
        resolve: soft(2.0),
        cull: true,
        ..RenderOptions::default()
    };
    // The image of a unit sphere at distance 4 has a radius of 200/sqrt(15) pixels.
    let inside =
        |x: i32, y: i32| (center_of(x, y) - DVec2::splat(56.0)).length() < 0.95 * 200.0 / 15f64.sqrt();
    for count in [500, 4000] {
        for (kernel, cutoff) in [(Kernel::Windowed, 4.0), (Kernel::Gaussian, 4.0), (Kernel::Windowed, 9.0)] {
            let options = RenderOptions { kernel, cutoff, ..options.clone() };
            let cloud = scenes::sphere(DVec3::new(0.0, 0.0, 4.0), 1.0, count, &options);
            let film = picture(&cloud, &camera, &options);
            let weights: Vec<f64> = pixels(&film)
                .zip(alphas(&film))
                .filter(|&((x, y), _)| inside(x, y))
                .map(|(_, alpha)| 2.0 * alpha)
                .collect();
            let n = weights.len() as f64;
            let mean = weights.iter().sum::<f64>() / n;
            let spread = (weights.iter().map(|w| (w - mean).powi(2)).sum::<f64>() / n).sqrt();
            let least = weights.iter().copied().fold(f64::INFINITY, f64::min);
            let name = format!("{count} splats, {kernel:?}, F = {cutoff}");
            let Shapes::Ellipses(axes) = &cloud.shapes else { unreachable!("estimated sizes are ellipses") };
            let [t1, t2] = axes[count / 2];
            let bound = tol::mean_weight(f64::from(t1.cross(t2).length().sqrt()));
            assert!((mean - 1.0).abs() <= bound, "{name}: mean {mean}, bound {bound}");
            assert!(spread <= tol::SPREAD_OF_WEIGHT, "{name}: spread {spread}");
            let bound = 1.0 - bound - 4.0 * tol::SPREAD_OF_WEIGHT;
            assert!(least >= bound, "{name}: least {least}, bound {bound}");
            // With a saturation of 1, front and back together let next to nothing through.
            let usual = RenderOptions { resolve: soft(1.0), cull: false, samples: 4, ..options.clone() };
            let film = picture(&cloud, &camera, &usual);
            for ((x, y), alpha) in pixels(&film).zip(alphas(&film)).filter(|&((x, y), _)| inside(x, y)) {
                assert!(1.0 - alpha <= (1.0 - bound).powi(2), "{name}: alpha {alpha} at ({x}, {y})");
            }

            // So there is no hole: neither in front alone, nor with the far side behind.
            for cull in [false, true] {
                let options = RenderOptions {
                    resolve: OPAQUE,
                    cull,
                    samples: 8,
                    aovs: AovSelection::ALL,
                    ..options.clone()
                };
                let film = picture(&cloud, &camera, &options);
                for (x, y) in pixels(&film).filter(|&(x, y)| inside(x, y)) {
                    let i = film.index(x, y);
                    assert_eq!(film.rgba[i], [1.0; 4], "{name}: ({x}, {y})");
                    assert_eq!(film.coverage.as_ref().expect("asked for")[i], 1.0, "{name}: ({x}, {y})");
                }
            }
        }
    }
}
