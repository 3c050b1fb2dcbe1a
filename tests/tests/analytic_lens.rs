//! What a lens makes of points and discs in focus and out of it, against its geometry.

use std::f64::consts::PI;

use glam::{DMat4, DVec2, DVec3};
use splat_core::{Kernel, Lens, Projection, RenderOptions};
use splat_tests::analytic::{
    Plane, alpha_moments, alphas, center_of, picture, pixels, sample_positions, sample_table,
};
use splat_tests::brute_force::{self, Disc, SampleRay};
use splat_tests::scenes::{self, Surfel, cloud, hard_discs, pinhole, with_lens};
use splat_tests::tolerances as tol;

#[test]
fn a_point_out_of_focus_fills_its_circle_of_confusion() {
    const SAMPLES: u32 = 2048;
    let focal_length = DVec2::new(90.0, 75.0);
    for (depth, focus, blades) in [
        (2.0, 4.0, 0),
        (6.0, 3.0, 0),
        (5.0, f64::INFINITY, 0),
        (2.0, 4.0, 3),
        (6.0, 3.0, 5),
        (5.0, f64::INFINITY, 6),
    ] {
        let lens = Lens { radius: 0.5, focus, blades };
        let mut camera = pinhole(56, 48, 1.0);
        camera.projection = Projection::Perspective { focal_length, lens: Some(lens) };
        // A little disc of 1.5 pixels in x.
        let size = 1.5 * depth / focal_length.x;
        let surfel = Surfel::new(DVec3::new(0.02, -0.03, 1.0) * depth, DVec3::NEG_Z, size);
        let options = hard_discs(SAMPLES);
        let film = picture(&cloud(&[surfel]), &camera, &options);
        let name = format!("depth {depth}, focus {focus}, {blades} blades");

        let blur = lens.radius * (1.0 / depth - 1.0 / focus).abs() * focal_length;
        let disc = size / depth * focal_length;
        // The blur moves light, but loses none.
        let hits = alphas(&film).sum::<f64>() * f64::from(SAMPLES);
        let expected = PI * disc.x * disc.y * f64::from(SAMPLES);
        let bound = tol::deviations_of_count(expected);
        assert!((hits - expected).abs() <= bound, "{name}: {hits} hits, expected {expected} +- {bound}");

        // Second moments add: the aperture's, the disc's, and a pixel's (Sheppard's correction).
        let of_aperture = match blades {
            0 => 0.25,
            n => (2.0 + libm::cos(2.0 * PI / f64::from(n))) / 12.0,
        };
        let expected = of_aperture * blur * blur + 0.25 * disc * disc + 1.0 / 12.0;
        let (mean, moment) = alpha_moments(&film);
        let center = DVec2::new(0.02, -0.03) * focal_length + camera.principal_point;
        let bound = tol::deviations_of_moment(hits);
        for axis in 0..2 {
            let ratio = moment[axis] / expected[axis];
            assert!((ratio - 1.0).abs() <= bound, "{name}, axis {axis}: moment {ratio} of the expected");
            let error = (mean[axis] - center[axis]).abs();
            let bound = tol::deviations_of_mean(expected[axis], hits);
            assert!(error <= bound, "{name}, axis {axis}: {error} pixels off, bound {bound}");
        }

        // Every hit lies within the sum of both ellipses, and some lie near its rim.
        let reach = blur + disc;
        let mut farthest = 0.0f64;
        for ((x, y), _) in pixels(&film).zip(alphas(&film)).filter(|(_, alpha)| *alpha > 0.0) {
            let to_center = center_of(x, y) - center;
            let nearest = (to_center.abs() - 0.5).max(DVec2::ZERO) / reach;
            assert!(nearest.length() <= 1.0, "{name}: ({x}, {y}) lies outside of the blur");
            farthest = farthest.max((to_center / reach).length());
        }
        if blades == 0 {
            assert!(farthest >= tol::FARTHEST_PIXEL, "{name}: the farthest hit is at {farthest}");
        }
    }
}

#[test]
fn a_tilted_disc_out_of_focus_is_what_its_rays_hit() {
    let lens = Lens { radius: 0.6, focus: 5.0, blades: 0 };
    let camera = with_lens(pinhole(64, 56, 60.0), lens);
    let normal = DVec3::new(0.8, -0.5, -0.7).normalize();
    let cloud = cloud(&[Surfel::new(DVec3::new(0.3, 0.1, 3.0), normal, 0.9)]);
    let options = hard_discs(16);
    let film = picture(&cloud, &camera, &options);
    let table = sample_table(&camera, &options);
    let disc = Disc::round(
        cloud.world_position(0),
        Plane::of(&cloud, 0).normal,
        f64::from(0.9f32),
        &DMat4::IDENTITY,
    );
    let oracle_lens = brute_force::Lens { radius: lens.radius, focus: lens.focus };
    let mut partial = 0;
    for ((x, y), alpha) in pixels(&film).zip(alphas(&film)) {
        let squares: Vec<f64> = sample_positions(&table, x, y)
            .zip(table.unit_lens(x, y))
            .map(|(position, unit)| {
                let screen = (position - camera.principal_point) / 60.0;
                let on_lens = DVec2::from(unit.map(f64::from)) * lens.radius;
                let ray = SampleRay::thin_lens(screen, on_lens, &oracle_lens);
                disc.intersect(&ray).map_or(f64::INFINITY, |hit| hit.r2())
            })
            .collect();
        let within = |r2: f64| squares.iter().filter(|&&square| square < r2).count() as f64 / 16.0;
        let (least, most) = (within(1.0 - tol::LENS_R2), within(1.0 + tol::LENS_R2));
        assert!(least <= alpha && alpha <= most, "({x}, {y}): {alpha}, expected {least} to {most}");
        partial += i32::from(alpha > 0.0 && alpha < 1.0);
    }
    assert!(partial > 300, "{partial}");
}

#[test]
fn in_focus_a_lens_is_a_pinhole() {
    // Every ray of a sample meets the plane of focus in one point; only rounding at the rim may tell.
    let options = RenderOptions { kernel: Kernel::Disc, ..scenes::golden()[0].options.clone() };
    let surfels = [
        Surfel::new(DVec3::new(-0.3, 0.1, 3.0), DVec3::NEG_Z, 0.2).colored([0.2, 0.5, 0.9]),
        Surfel::new(DVec3::new(0.5, -0.2, 3.0), DVec3::NEG_Z, 0.4).colored([0.9, 0.1, 0.3]),
    ];
    let camera = pinhole(64, 48, 50.0);
    let sharp = picture(&cloud(&surfels), &camera, &options);
    for blades in [0, 7] {
        let camera = with_lens(camera.clone(), Lens { radius: 0.5, focus: 3.0, blades });
        let film = picture(&cloud(&surfels), &camera, &options);
        let differing = film.rgba.iter().zip(&sharp.rgba).filter(|(a, b)| a != b).count();
        assert!(differing <= tol::IN_FOCUS_PIXELS, "{differing} pixels differ");
        // A little out of focus, many do.
        let camera = with_lens(camera, Lens { radius: 0.5, focus: 3.1, blades });
        let film = picture(&cloud(&surfels), &camera, &options);
        let differing = film.rgba.iter().zip(&sharp.rgba).filter(|(a, b)| a != b).count();
        assert!(differing >= 20, "only {differing} pixels differ");
    }
}
