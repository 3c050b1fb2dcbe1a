//! The evaluation in f64 against the geometric truth, and against the literal listing wherever that is right.

use std::f64::consts::{PI, TAU};

use glam::{DMat2, DVec2, DVec3, Vec3Swizzles};
use splat_core::Camera;
use splat_core::evaluate::{Hit, LensPoint, Limits, SplatConstants};
use splat_core::setup::{CameraSplat, EPSILON, View, project};
use splat_tests::brute_force::{self, Disc};
use splat_tests::core_scenes::{
    camera_space, hard, image_of, on_lens, orthographic, pinhole, random_axes, random_unit_lens, sample_ray,
    thin_lens, tilted_axes, truth_of,
};
use splat_tests::errata_scenes::{D3D, all_pixels, random_anisotropic, small_picture};
use splat_tests::listing::Listing;
use splat_tests::random::Random;
use splat_tests::tolerances as tol;

/// The evaluation of the sample at `jitter` of the pixel (x, y).
fn evaluate(
    c: &SplatConstants<f64>,
    view: &View,
    [x, y]: [i32; 2],
    jitter: [f64; 2],
    unit: [f32; 2],
) -> Option<Hit<f64>> {
    let limits = Limits::new(view.cutoff, view.near, view.far);
    let d = c.offset(x, y, jitter);
    match view.lens {
        _ if view.orthographic => c.orthographic(d, &limits),
        None => c.pinhole(d, &limits),
        Some(lens) => c.thin_lens(d, &LensPoint::new(unit, lens, view.pixel_scale), &limits),
    }
}

/// The image of the splat's plane about its point `point`: the rows d(pixel)/du and d(pixel)/dv, and the
/// size, in pixels, of the numbers from which they and the image are made.
fn jacobian(splat: &CameraSplat, view: &View, point: DVec3, unit: [f32; 2]) -> (DMat2, f64) {
    let lens = on_lens(view, unit);
    let scale = view.pixel_scale;
    let (across, depth) = if view.orthographic { (DVec2::ZERO, 1.0) } else { (point.xy() - lens, point.z) };
    let slope = if view.orthographic { 0.0 } else { 1.0 };
    let rows = splat.axes.map(|t| (t.xy() - across / depth * (slope * t.z)) * scale / depth);
    let focus = view.lens.map_or(f64::INFINITY, |lens| lens.focus);
    let reach = |v: DVec3| v.xy().length() + slope * (v.z * across.length() / depth).abs();
    let size = scale.max_element() / depth
        * (reach(splat.center) + (reach(splat.axes[0]) + reach(splat.axes[1])) * view.cutoff.sqrt())
        + scale.max_element() * lens.length() * (1.0 / depth + 1.0 / focus)
        + view.principal_point.length()
        + image_of(view, point, unit).length();
    (DMat2::from_cols(rows[0], rows[1]), size)
}

/// What a rounding of eps of the numbers that both ways begin with makes of (u, v), at the point `point`: the
/// inverse of the projection there, times eps of the pixel. What [`tol::EXACT_ROUNDINGS`] is multiplied by.
fn sensitivity(splat: &CameraSplat, view: &View, point: DVec3, unit: [f32; 2]) -> f64 {
    let (rows, size) = jacobian(splat, view, point, unit);
    let norm = (rows.x_axis.length_squared() + rows.y_axis.length_squared()).sqrt();
    norm / rows.determinant().abs() * size + view.cutoff.sqrt()
}

/// The lens form's own error, in roundings: for a lens hundreds of times as large as its distance from the splat's
/// plane, side and the terms of n are that much larger than 1 and m, which the problem's condition does not know.
fn form_error(c: &SplatConstants<f64>, view: &View, whole: DVec2, jitter: [f64; 2], unit: [f32; 2]) -> f64 {
    let Some(lens) = view.lens else { return 0.0 };
    let d = c.offset(whole.x as i32, whole.y as i32, jitter);
    let bound = c.thin_lens_error(d, 1.0, &LensPoint::new(unit, lens, view.pixel_scale));
    bound.u.hypot(bound.v) / EPSILON
}

#[derive(Default)]
struct Worst {
    hits: usize,
    flipped: usize,
    undecided: usize,
    /// Largest error relative to its sensitivity, in eps.
    roundings: f64,
    /// Largest error itself of those splats whose sensitivity is below 1000.
    ordinary: f64,
    previous: Option<(DVec2, DVec2, f64)>,
}

const EPS: f64 = f64::EPSILON / 2.0;

fn compare_sample(
    splat: &CameraSplat,
    view: &View,
    constants: &SplatConstants<f64>,
    pixel: DVec2,
    unit: [f32; 2],
    worst: &mut Worst,
) {
    let whole = pixel.floor();
    let jitter = (pixel - whole).to_array();
    let pixel = whole + DVec2::from(jitter);
    let found = evaluate(constants, view, whole.as_ivec2().to_array(), jitter, unit);
    let disc = truth_of(splat);
    let ray = sample_ray(view, pixel, unit);
    let truth = disc.intersect(&ray);
    let Some(hit) = truth else {
        assert_eq!(found, None, "no ray meets it");
        return;
    };
    let point = ray.origin + hit.along * ray.direction;
    let sensitivity = sensitivity(splat, view, point, unit)
        + form_error(constants, view, whole, jitter, unit) / (1.0 + hit.r2().sqrt());
    let allowed = tol::EXACT_ROUNDINGS * EPS * sensitivity * (1.0 + hit.r2().sqrt());
    // Depth moves with (u, v), and is itself rounded.
    let slope = DVec2::new(splat.axes[0].z, splat.axes[1].z).length();
    let depth_allowed = slope * allowed + tol::EXACT_ROUNDINGS * EPS * (point.z.abs() + splat.center.z.abs());
    let r = hit.r2().sqrt();
    let inside = hit.r2() < view.cutoff && hit.depth > view.near && hit.depth < view.far;
    if inside != found.is_some() {
        let close = (r - view.cutoff.sqrt()).abs() <= allowed
            || (hit.depth - view.near).abs() <= depth_allowed
            || (hit.depth - view.far).abs() <= depth_allowed;
        assert!(close, "{hit:?} but {found:?}, {allowed:e}");
        worst.undecided += 1;
        return;
    }
    let Some(found) = found else { return };
    worst.hits += 1;
    // (u, v) are the disc's up to the rotation that set-up chose.
    let (here, there) = (DVec2::new(found.u, found.v), DVec2::new(hit.u, hit.v));
    let error = (here.length() - r).abs().max((found.r2.sqrt() - r).abs());
    assert!(error <= allowed, "r: {error:e} > {allowed:e}");
    if let Some((before, truth_before, allowed_before)) = worst.previous {
        let both = allowed * truth_before.length() + allowed_before * there.length();
        let dot = (here.dot(before) - there.dot(truth_before)).abs();
        let cross = (here.perp_dot(before) - there.perp_dot(truth_before)).abs();
        assert!(dot.max(cross) <= 2.0 * both, "angle: {dot:e}, {cross:e} > {both:e}");
    }
    worst.previous = Some((here, there, allowed));
    let depth_error = (found.depth - hit.depth).abs();
    assert!(depth_error <= depth_allowed, "depth: {depth_error:e} > {depth_allowed:e}");
    // Facing: flipped where lens point and eye are on different sides of the plane.
    let side = |p: DVec3| splat.normal.dot(p - splat.center);
    let (eye, from) = (side(DVec3::ZERO), side(ray.origin));
    if !view.orthographic && (eye * from).abs() > tol::EXACT * splat.center.length_squared() {
        assert_eq!(found.flipped, (eye > 0.0) != hit.front);
        assert_eq!(found.flipped, (eye > 0.0) != (from > 0.0));
    }
    worst.flipped += usize::from(found.flipped);
    worst.roundings = worst.roundings.max(error / (EPS * sensitivity * (1.0 + r)));
    if sensitivity < 1000.0 {
        worst.ordinary = worst.ordinary.max(error).max(depth_error / hit.depth);
    }
}

/// Half of the samples aimed at the splat, half anywhere in the frame.
fn compare(splat: &CameraSplat, view: &View, rng: &mut Random, samples: usize, worst: &mut Worst) {
    let Some(constants) = project(splat, view) else { return };
    worst.previous = None;
    for i in 0..samples {
        let unit = random_unit_lens(rng);
        let size = DVec2::new(f64::from(view.window.x1), f64::from(view.window.y1));
        let mut pixel = DVec2::new(rng.unit(), rng.unit()) * size;
        if i % 2 == 0 {
            let aim = rng.in_disc() * (1.05 * view.cutoff.sqrt());
            let point = splat.center + aim.x * splat.axes[0] + aim.y * splat.axes[1];
            let image = image_of(view, point, unit);
            if point.z > 0.0 && image.abs().max_element() < tol::FAR_FROM_THE_FRAME {
                pixel = image;
            }
        }
        compare_sample(splat, view, &constants, pixel, unit, worst);
    }
}

fn camera(form: usize, focal: f64, depth: f64, rng: &mut Random) -> Camera {
    let radius = depth * rng.log_range(1e-3, 0.5);
    let focus = if rng.index(5) == 0 { f64::INFINITY } else { depth * rng.log_range(0.2, 5.0) };
    let camera = match form {
        0 => pinhole(960, 540, focal),
        1 => thin_lens(960, 540, focal, radius, focus),
        _ => orthographic(960, 540, focal / depth),
    };
    Camera { near: depth * 0.01, ..camera }
}

#[test]
fn ordinary_splats_are_exact_to_a_few_roundings() {
    let mut rng = Random::new(1);
    for form in 0..3 {
        let mut worst = Worst::default();
        for _ in 0..1000 {
            let depth = rng.log_range(1e-2, 1e3);
            let view = View::new(&camera(form, 500.0, depth, &mut rng), &hard(4.0, 1));
            let at = DVec3::new(rng.range(-0.8, 0.8), rng.range(-0.5, 0.5), 1.0);
            let lengths = [rng.log_range(0.01, 0.3) * depth, rng.log_range(0.01, 0.3) * depth];
            let (turn, twist) = (rng.range(-PI, PI), rng.range(0.0, TAU));
            let axes = tilted_axes(at * depth, rng.range(0.0, 75.0), turn, twist, lengths);
            compare(&camera_space(at * depth, axes), &view, &mut rng, 40, &mut worst);
        }
        assert!(worst.hits > 10_000, "form {form}: {}", worst.hits);
        assert!(worst.ordinary <= tol::EXACT_ORDINARY, "form {form}: {:e}", worst.ordinary);
        assert!(worst.undecided <= 2, "form {form}: {}", worst.undecided);
    }
}

#[test]
fn hard_splats_are_exact_for_their_condition() {
    // Any direction, 1:100, up to edge-on; tiny and huge; across the camera plane; seen through a lens as
    // large as half of their distance.
    let mut rng = Random::new(2);
    for form in 0..3 {
        let mut worst = Worst::default();
        for i in 0..6000 {
            let depth = rng.log_range(1e-3, 1e5);
            let focal = rng.log_range(100.0, 3000.0);
            let view = View::new(&camera(form, focal, depth, &mut rng), &hard(4.0, 1));
            let at = DVec2::new(rng.range(-480.0, 480.0), rng.range(-270.0, 270.0)) / focal;
            let splat = if i % 3 == 0 {
                let center = at.extend(rng.range(-1.0, 1.0)) * depth;
                let sigma = rng.range(0.3, 3.0) * depth;
                camera_space(center, random_axes(&mut rng, sigma, 10.0))
            } else {
                let center = at.extend(1.0) * depth;
                let sigma = rng.log_range(0.05, 1000.0) * depth / focal;
                let lengths = [sigma, sigma / rng.log_range(1.0, 100.0)];
                let tilt = 90.0 - rng.log_range(1e-3, 90.0);
                let (turn, twist) = (rng.range(-PI, PI), rng.range(0.0, TAU));
                camera_space(center, tilted_axes(center, tilt, turn, twist, lengths))
            };
            compare(&splat, &view, &mut rng, 20, &mut worst);
        }
        assert!(worst.hits > 20_000, "form {form}: {}", worst.hits);
        assert!(form != 1 || worst.flipped > 500, "flipped {}", worst.flipped);
        assert!(worst.undecided * 1000 < worst.hits, "form {form}: {} undecided", worst.undecided);
        // The tolerance is not a thousand times too large.
        assert!(worst.roundings > tol::EXACT_ROUNDINGS / 1000.0, "form {form}: {}", worst.roundings);
    }
}

#[test]
fn facing_flips_with_the_lens_point() {
    // A steep plane between two parts of the lens.
    let view = View::new(&thin_lens(96, 64, 50.0, 0.5, 2.0), &hard(4.0, 1));
    let splat = camera_space(DVec3::new(0.06, 0.0, 2.0), [DVec3::Y, DVec3::new(0.01, 0.0, 0.4)]);
    let constants = project(&splat, &view).expect("not edge-on");
    let (mut flipped, mut straight) = (0, 0);
    for i in -10..=10 {
        let unit = [i as f32 / 10.0, 0.2];
        let pixel = image_of(&view, splat.center + 0.3 * splat.axes[1], unit);
        let (whole, jitter) = (pixel.floor(), pixel - pixel.floor());
        let hit = evaluate(&constants, &view, whole.as_ivec2().to_array(), jitter.to_array(), unit);
        let Some(hit) = hit else { panic!("{unit:?} must see the point that it is aimed at") };
        // The plane meets the lens's plane at x = .01, just right of the eye.
        let point = on_lens(&view, unit).extend(0.0);
        let side = |p: DVec3| splat.normal.dot(p - splat.center) > 0.0;
        assert_eq!(hit.flipped, side(point) != side(DVec3::ZERO), "{unit:?}");
        *(if hit.flipped { &mut flipped } else { &mut straight }) += 1;
    }
    assert!(flipped == 10 && straight == 11, "{flipped} {straight}");
}

/// Compares with the listing on every pixel of a small picture: (u, v) by r2, membership, and depth w.
fn compare_with_the_listing(rng: &mut Random, lens: Option<brute_force::Lens>, splats: usize) -> usize {
    let mut parameters = small_picture::<f64>();
    parameters.focus = lens.map_or(5.0, |lens| lens.focus);
    let listing = Listing::new(parameters);
    let p = &listing.parameters;
    let camera = match lens {
        None => pinhole(96, 64, 90.0),
        Some(lens) => thin_lens(96, 64, 90.0, lens.radius, lens.focus),
    };
    let view = View::new(&Camera { near: 0.1, ..camera }, &hard(2.0, 1));
    let mut hits = 0;
    for _ in 0..splats {
        let w = rng.log_range(0.6, 30.0);
        let center = DVec3::new(rng.range(-0.5, 0.5) * w, rng.range(-0.35, 0.35) * w, w);
        let (frame, disc) = random_anisotropic(rng, center, 0.02 * w, 0.2 * w);
        let Disc { t1, t2, .. } = disc;
        let splat = camera_space(center, [t1, t2]);
        // Where the listing's forms lose digits (its product of adjugates), and where E4, E5 make it wrong.
        let steepness = splat.normal.dot(center.normalize()).abs();
        let clearance = splat.normal.dot(center).abs() - lens.map_or(0.0, |lens| lens.radius);
        if steepness < 0.1 || clearance < 0.0 || disc.depth_extent(2.0).0 < 0.3 * w {
            continue;
        }
        let constants = project(&splat, &view).expect("not edge-on");
        let s = listing.set_up_frame(&frame);
        for (x, y) in all_pixels(p) {
            let (jitter, unit) = ([rng.unit(), rng.unit()], random_unit_lens(rng));
            let at = [0, 1].map(|i| ([x, y][i] as f64 + jitter[i] - p.vp_mid[i]) / p.vp_scale[i]);
            let cast = listing.cast(&s, at, on_lens(&view, unit).to_array());
            let listed_r2 = cast.radius / (cast.uv[2] * cast.uv[2]);
            let found = evaluate(&constants, &view, [x as i32, y as i32], jitter, unit);
            let allowed = tol::RAY * 100.0 / (steepness * steepness);
            if cast.accepted != found.is_some() {
                assert!((listed_r2 - 2.0).abs() <= allowed, "{listed_r2} and {found:?}");
                continue;
            }
            let Some(hit) = found else { continue };
            hits += 1;
            assert!((hit.r2 - listed_r2).abs() <= allowed, "{:e}", (hit.r2 - listed_r2).abs());
            let (u, v) = (cast.uv[0] / cast.uv[2], cast.uv[1] / cast.uv[2]);
            let depth = frame.p0h[3] + u * frame.tuh[3] + v * frame.tvh[3];
            assert!((hit.depth / depth - 1.0).abs() <= allowed);
            // The listing's own z, clip z, is that depth's (E3).
            let (a, b) = D3D.coefficients();
            assert!((cast.z - (a * hit.depth + b)).abs() <= allowed * depth);
            assert!(!hit.flipped);
        }
    }
    hits
}

#[test]
fn pinhole_hits_are_the_listing_s() {
    let hits = compare_with_the_listing(&mut Random::new(3), None, 300);
    assert!(hits > 40_000, "{hits}");
}

#[test]
fn lens_hits_are_the_listing_s() {
    for lens in [
        brute_force::Lens { radius: 0.02, focus: 5.0 },
        brute_force::Lens { radius: 0.2, focus: 0.7 },
        brute_force::Lens { radius: 0.2, focus: 50.0 },
    ] {
        let hits = compare_with_the_listing(&mut Random::new(4), Some(lens), 200);
        assert!(hits > 25_000, "{hits}");
    }
}
