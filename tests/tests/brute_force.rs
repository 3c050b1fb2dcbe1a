//! The brute-force truth against answers that can be written down.

use std::f64::consts::SQRT_2;

use glam::{DMat4, DQuat, DVec2, DVec3};
use splat_tests::brute_force::{Disc, Lens, Rect, SampleRay, View};
use splat_tests::random::Random;
use splat_tests::tolerances as tol;

/// Axes 2 and 1 in the plane w = 4, about (1, 0, 4), its normal away from the eye.
fn flat_ellipse() -> Disc {
    Disc::new(DVec3::new(1.0, 0.0, 4.0), DVec3::X * 2.0, DVec3::Y)
}

/// A floor of radius 1 (F = 1) about the point under the eye, one unit below it, its front up.
fn floor() -> Disc {
    Disc::new(DVec3::new(0.0, 1.0, 0.0), DVec3::X, DVec3::Z)
}

#[test]
fn a_ray_meets_the_plane_in_its_coordinates() {
    let hit = flat_ellipse().intersect(&SampleRay::pinhole(DVec2::new(0.75, -0.5))).expect("not parallel");
    // (3, -2, 4) is the centre plus one first axis and minus two second ones.
    assert_eq!((hit.u, hit.v, hit.depth, hit.along), (1.0, -2.0, 4.0, 4.0));
    assert_eq!(hit.r2(), 5.0);
    assert!(!hit.front, "the normal t1 x t2 points away");
    let turned = Disc { normal: DVec3::NEG_Z, ..flat_ellipse() };
    assert!(turned.intersect(&SampleRay::pinhole(DVec2::ZERO)).expect("not parallel").front);
}

#[test]
fn a_perspective_ray_begins_at_its_origin_and_an_orthographic_one_nowhere() {
    let behind = Disc::new(DVec3::new(0.0, 0.0, -4.0), DVec3::X, DVec3::Y);
    assert_eq!(behind.intersect(&SampleRay::pinhole(DVec2::ZERO)), None);
    let hit = behind.intersect(&SampleRay::orthographic(DVec2::new(0.5, 0.25))).expect("not parallel");
    assert_eq!((hit.u, hit.v, hit.depth, hit.front), (0.5, 0.25, -4.0, false));
    let edge_on = Disc::new(DVec3::new(0.0, 0.0, 4.0), DVec3::X, DVec3::Z);
    assert_eq!(edge_on.intersect(&SampleRay::pinhole(DVec2::ZERO)), None);
    assert_eq!(edge_on.intersect(&SampleRay::orthographic(DVec2::ZERO)), None);
}

#[test]
fn the_facing_is_that_of_the_ray_s_origin() {
    // A steep plane through (0, 0, 2) between two points of the lens.
    let disc = Disc::new(DVec3::new(0.0, 0.0, 2.0), DVec3::Y, DVec3::new(0.01, 0.0, 1.0));
    let lens = Lens { radius: 0.5, focus: 2.0 };
    let front = |x: f64| {
        let ray = SampleRay::thin_lens(DVec2::ZERO, DVec2::new(x, 0.0), &lens);
        disc.intersect(&ray).expect("all rays of the middle meet at (0, 0, 2)").front
    };
    assert_ne!(front(0.4), front(-0.4));
}

#[test]
fn a_transformed_disc_keeps_its_front_under_scale_and_reflection() {
    let mut rng = Random::new(201);
    for i in 0..200 {
        let scale = DVec3::new(if i % 2 == 0 { 1.0 } else { -1.0 }, 2.0, 0.7);
        let turn = DQuat::from_axis_angle(rng.direction(), rng.range(0.0, 3.0));
        let camera = DMat4::from_scale_rotation_translation(scale, turn, rng.direction() * 2.0);
        let (position, normal) = (rng.direction() * 3.0, rng.direction());
        let disc = Disc::round(position, normal, 0.3, &camera);
        let eye = camera.inverse().transform_point3(DVec3::ZERO);
        assert_eq!(disc.normal.dot(-disc.center) > 0.0, normal.dot(eye - position) > 0.0);
        assert!(disc.normal.dot(disc.t1).abs() <= tol::EXACT && disc.normal.dot(disc.t2).abs() <= tol::EXACT);
        // One sigma of the world away from the centre.
        let back = camera.inverse().transform_point3(disc.point(0.6, 0.8));
        assert!(((back - position).length() - 0.3).abs() <= tol::EXACT);
    }
}

#[test]
fn lens_rays_of_a_screen_point_meet_in_the_plane_of_focus() {
    let mut rng = Random::new(202);
    for focus in [0.5, 3.0, f64::INFINITY] {
        let lens = Lens { radius: 0.2, focus };
        for _ in 0..100 {
            let (at, on_lens) = (rng.in_disc(), rng.in_disc() * lens.radius);
            let ray = SampleRay::thin_lens(at, on_lens, &lens);
            let w = if focus.is_finite() { focus } else { 1e12 };
            let point = ray.origin + ray.direction * (w / ray.direction.z);
            let error = (point.truncate() / w - at).length();
            assert!(error <= tol::FAR_FIELD, "{error:e}");
            // `image_of` is the ray's inverse, at any depth.
            let point = ray.origin + ray.direction * rng.range(0.1, 3.0);
            let error = (lens.image_of(point, on_lens) - at).length();
            assert!(error <= tol::RAY, "{error:e}");
        }
    }
}

#[test]
fn the_lens_of_an_f_number() {
    // The image plane at 1 and the focus at 5: f = 5/6.
    assert!((Lens::of_f_number(2.8, 5.0).radius - 5.0 / 6.0 / 5.6).abs() <= tol::EXACT);
    assert_eq!(Lens::of_f_number(2.0, f64::INFINITY).radius, 0.25);
}

#[test]
fn the_circle_of_confusion_in_closed_form() {
    let lens = Lens { radius: 0.3, focus: 4.0 };
    for w in [0.1, 1.0, 4.0, 100.0] {
        let expected = 0.3 * f64::abs(1.0 / w - 0.25);
        let scale = 0.3 * (1.0 / w + 0.25);
        assert!((lens.circle_of_confusion(w) - expected).abs() <= tol::COC * scale);
    }
}

#[test]
fn the_box_of_a_flat_ellipse() {
    let expected = Rect::new(0.25 - 0.5 * SQRT_2, -0.25 * SQRT_2, 0.25 + 0.5 * SQRT_2, 0.25 * SQRT_2);
    let found = flat_ellipse().projected_box(2.0, 0.1, View::Perspective).expect("in front");
    assert!(found.distance(expected) <= tol::EXACT);
    let expected = Rect::new(1.0 - 2.0 * SQRT_2, -SQRT_2, 1.0 + 2.0 * SQRT_2, SQRT_2);
    let found = flat_ellipse().projected_box(2.0, 0.1, View::Orthographic).expect("in front");
    assert!(found.distance(expected) <= tol::EXACT);
}

#[test]
fn the_box_of_a_clipped_floor() {
    // Cut at w = .5 the half chord is sqrt(3)/2, twice that on the screen; the deepest point is (0, 1, 1).
    let found = floor().projected_box(1.0, 0.5, View::Perspective).expect("half of it is in front");
    let expected = Rect::new(-(3.0_f64.sqrt()), 1.0, 3.0_f64.sqrt(), 2.0);
    assert!(found.distance(expected) <= tol::CLIPPED_BOX, "{found:?}");
    // A sliver of it, thinner than the coarse sampling's step.
    let found = floor().projected_box(1.0, 1.0 - 1e-9, View::Perspective).expect("a sliver");
    let half_chord = (1.0 - (1.0 - 1e-9_f64).powi(2)).sqrt() / (1.0 - 1e-9);
    let expected = Rect::new(-half_chord, 1.0, half_chord, 1.0 / (1.0 - 1e-9));
    assert!(found.distance(expected) <= tol::SLIVER, "{found:?}");
    // Nothing of it.
    assert_eq!(floor().projected_box(1.0, 1.1, View::Perspective), None);
}

#[test]
fn the_box_through_a_lens_is_wider_by_the_circle_of_confusion() {
    let lens = Lens { radius: 0.3, focus: 2.0 };
    let pinhole = flat_ellipse().projected_box(2.0, 0.1, View::Perspective).expect("in front");
    let found = flat_ellipse().projected_box_through_lens(2.0, 0.1, &lens, 4).expect("in front");
    assert!(found.distance(pinhole.grown(0.3 * 0.25)) <= tol::EXACT);
    assert_eq!(floor().projected_box_through_lens(1.0, 1.1, &lens, 4), None);
}

#[test]
fn the_depth_extent_of_a_skewed_disc() {
    // sqrt(F (T1w^2 + T2w^2)) = sqrt(2 * 25) on either side.
    let disc = Disc::new(DVec3::new(7.0, 0.0, 1.0), DVec3::new(1.0, 0.0, 3.0), DVec3::new(0.2, 1.0, -4.0));
    let (lo, hi) = disc.depth_extent(2.0);
    let half = 50.0_f64.sqrt();
    assert!((lo - (1.0 - half)).abs() <= tol::DEPTH_EXTENT && (hi - (1.0 + half)).abs() <= tol::DEPTH_EXTENT);
}

#[test]
fn the_share_of_a_lens_that_sees_the_front() {
    let lens = Lens { radius: 0.5, focus: 2.0 };
    let plane = |x: f64| Disc::new(DVec3::new(x, 0.0, 2.0), DVec3::Y, DVec3::Z);
    assert!((lens.share_that_sees_the_front(&plane(0.0), 40_000) - 0.5).abs() <= tol::SHARE_OF_40_000);
    // A chord at half the radius cuts off 1/3 - sqrt(3)/(4 pi) of a disc.
    let cap = 1.0 / 3.0 - 3.0_f64.sqrt() / (4.0 * std::f64::consts::PI);
    assert!((lens.share_that_sees_the_front(&plane(0.25), 40_000) - cap).abs() <= tol::SHARE_OF_40_000);
    assert_eq!(lens.share_that_sees_the_front(&plane(0.6), 40_000), 0.0);
    assert_eq!(lens.share_that_sees_the_front(&plane(-0.6), 40_000), 1.0);
}

#[test]
fn rectangles() {
    let a = Rect::new(0.0, 0.0, 2.0, 1.0);
    let b = Rect::new(1.0, -1.0, 3.0, 0.5);
    assert_eq!(a.union(b), Rect::new(0.0, -1.0, 3.0, 1.0));
    assert_eq!(a.intersection(b), Some(Rect::new(1.0, 0.0, 2.0, 0.5)));
    assert_eq!(a.intersection(Rect::new(5.0, 0.0, 6.0, 1.0)), None);
    assert_eq!(a.grown(1.0), Rect::new(-1.0, -1.0, 3.0, 2.0));
    assert_eq!(a.distance(b), 1.0);
    assert!(a.distance(Rect::new(0.0, f64::NAN, 0.0, 0.0)).is_nan());
    assert!(a.contains(DVec2::new(2.0, 0.5)) && !a.contains(DVec2::new(2.0, 1.5)));
}
