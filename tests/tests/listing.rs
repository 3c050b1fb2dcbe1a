//! The printed listing against the geometric truth, where it is right.

use std::collections::BTreeMap;

use glam::{DMat3, DQuat, DVec2, DVec3};
use splat_tests::brute_force::{Disc, Lens, SampleRay, View};
use splat_tests::errata_scenes::{
    D3D, all_pixels, anisotropic, corrected_box, corrected_coc, disc_of, fragments, half_extent,
    random_anisotropic, random_camera, rect_of, screen_point, seen_from, small_picture,
    splats_through_a_lens,
};
use splat_tests::listing::{
    ClipPlane, Culled, DepthMap, Listing, ListingSplat, behind, circle_of_confusion, inverse_times_det,
};
use splat_tests::random::Random;
use splat_tests::tolerances as tol;

#[test]
fn the_eye_is_where_x_y_and_w_vanish() {
    let mut rng = Random::new(1);
    for depth in [
        DepthMap::OpenGl { near: 0.1, far: 100.0 },
        DepthMap::Direct3d { near: 1.0, far: 10.0 },
        DepthMap::ReversedZ { near: 0.1, far: 100.0 },
    ] {
        for _ in 0..200 {
            let camera = random_camera(&mut rng);
            let eye = camera.inverse().transform_point3(DVec3::ZERO);
            let listing = Listing::new(seen_from(small_picture(), &camera, depth));
            let [x, y, z, w] = listing.eye;
            assert!((w - 1.0).abs() <= f64::EPSILON);
            let error = (DVec3::new(x, y, z) - eye).length();
            assert!(error <= tol::EYE, "{depth:?}: {error:e}");
        }
    }
}

#[test]
fn facing_is_the_side_of_the_eye() {
    let mut rng = Random::new(2);
    let (mut front, mut back) = (0, 0);
    for _ in 0..2000 {
        let camera = random_camera(&mut rng);
        let listing = Listing::new(seen_from(small_picture(), &camera, D3D));
        let (position, normal) = (rng.direction() * rng.range(0.0, 9.0), rng.direction());
        let splat = ListingSplat::new(position.to_array(), normal.to_array(), 0.1);
        let disc = Disc::round(position, normal, 0.1, &camera);
        let hit =
            disc.intersect(&SampleRay { origin: DVec3::ZERO, direction: disc.center, from_infinity: false });
        let truth = hit.expect("a random splat is not edge-on").front;
        let s = listing.set_up(&splat);
        assert_eq!(s.dot_sign, !truth);
        assert_eq!(s.culled == Some(Culled::BackFace), !truth);
        *(if truth { &mut front } else { &mut back }) += 1;
    }
    assert!(front > 800 && back > 800, "{front} {back}");
}

#[test]
fn det_m_is_the_facing() {
    // detM = det(A) n.(p0 - eye), A = the (x, y, w) part of objectToScreen.
    let mut rng = Random::new(3);
    for _ in 0..2000 {
        let camera = random_camera(&mut rng);
        let listing = Listing::new(seen_from(small_picture(), &camera, D3D));
        let splat = ListingSplat::new(
            (rng.direction() * rng.range(1.0, 9.0)).to_array(),
            rng.direction().to_array(),
            0.1,
        );
        let s = listing.set_up(&splat);
        // L60 takes tv = n x tu, so (tu, tv, n) is right-handed and det(A) is the camera's.
        let expected = -DMat3::from_mat4(camera).determinant() * s.dot;
        assert!((s.det_m - expected).abs() <= tol::DET_M, "{:e}", (s.det_m - expected).abs());
    }
}

#[test]
fn mi_is_the_adjugate() {
    let mut rng = Random::new(4);
    for _ in 0..2000 {
        let m = [0; 3].map(|_| [0; 3].map(|_| rng.range(-1.0, 1.0)));
        let mi = inverse_times_det(&m);
        // glam holds columns: from_cols of the rows is the transpose, and (AB)^t = B^t A^t.
        let (a, b) = (DMat3::from_cols_array_2d(&m), DMat3::from_cols_array_2d(&mi));
        let error = (b * a - DMat3::IDENTITY * a.determinant()).to_cols_array().map(f64::abs);
        assert!(error.iter().all(|&e| e <= tol::ADJUGATE), "{error:?}");
        // Not only up to a sign or a transposition: the inverse itself, where it is well defined.
        if a.determinant().abs() > 0.1 {
            let error = (b * (1.0 / a.determinant()) - a.inverse()).to_cols_array().map(f64::abs);
            assert!(error.iter().all(|&e| e <= tol::ADJUGATE * 100.0), "{error:?}");
        }
    }
}

#[test]
fn delta_identity() {
    // delta = detM^2 det(Q) (w0^2 - F t^t Q^-1 t), positive exactly where the disc is on one side of w = 0.
    let mut rng = Random::new(5);
    let listing = Listing::new(small_picture::<f64>());
    let cutoff = listing.parameters.cutoff;
    let (mut front, mut behind, mut crossing) = (0, 0, 0);
    for _ in 0..6000 {
        let p0 = DVec3::new(rng.range(-2.0, 2.0), rng.range(-2.0, 2.0), rng.range(-2.0, 2.0));
        let (frame, disc) = random_anisotropic(&mut rng, p0, 0.1, 2.0);
        let s = listing.set_up_frame(&frame);
        let q = &frame.q;
        let det_q = q[0][0] * q[1][1] - q[0][1] * q[1][0];
        let half = half_extent(q, cutoff, [frame.tuh[3], frame.tvh[3]]);
        let expected = s.det_m * s.det_m * det_q * (p0.z * p0.z - half * half);
        // What the sums of products could have been without cancellation.
        let size = |i: usize, j: usize| {
            let (a, b) = (s.mi[i].map(f64::abs), s.mi[j].map(f64::abs));
            let q = q.map(|row| row.map(f64::abs));
            a[0] * (q[0][0] * b[0] + q[0][1] * b[1])
                + a[1] * (q[1][0] * b[0] + q[1][1] * b[1])
                + cutoff * a[2] * b[2]
        };
        let scale = size(0, 0) * size(1, 1) + size(0, 1) * size(0, 1);
        let error = (s.bounds.delta - expected).abs();
        assert!(error <= tol::DELTA * scale, "{:e}", error / scale);

        let (lo, hi) = disc.depth_extent(cutoff);
        if expected.abs() > 2.0 * tol::DELTA * scale {
            let one_side = lo > 0.0 || hi < 0.0;
            assert_eq!(s.bounds.delta > 0.0, one_side);
            *(if lo > 0.0 {
                &mut front
            } else if hi < 0.0 {
                &mut behind
            } else {
                &mut crossing
            }) += 1;
        }
    }
    assert!(front > 1000 && behind > 1000 && crossing > 1000, "{front} {behind} {crossing}");
}

#[test]
fn the_box_of_a_disc_in_front_is_exact() {
    let mut rng = Random::new(6);
    let listing = Listing::new(small_picture::<f64>());
    let mut tested = 0;
    while tested < 300 {
        let depth = rng.log_range(1.0, 50.0);
        let p0 = DVec3::new(rng.range(-1.0, 1.0) * depth, rng.range(-1.0, 1.0) * depth, depth);
        let (frame, disc) = random_anisotropic(&mut rng, p0, 0.02 * depth, 0.5 * depth);
        let tilt = disc.normal.normalize().dot(p0.normalize()).abs();
        if tilt < 0.05 || disc.depth_extent(2.0).0 < 0.1 * depth {
            continue;
        }
        tested += 1;
        let truth = disc.projected_box(2.0, 0.05 * depth, View::Perspective).expect("in front");
        let listed = rect_of(&listing.set_up_frame(&frame).bounds);
        let closed = corrected_box(&disc, 2.0, 0.05 * depth).expect("in front");
        let size = truth.size().min_element();
        assert!(listed.distance(truth) <= tol::CONIC_BOX * size, "{:e}", listed.distance(truth) / size);
        assert!(closed.distance(truth) <= tol::CENTRED_BOX * size, "{:e}", closed.distance(truth) / size);
    }
}

#[test]
fn the_depth_extent_of_a_round_splat_is_exact() {
    let mut rng = Random::new(7);
    let listing = Listing::new(small_picture::<f64>());
    for _ in 0..300 {
        let p0 = DVec3::new(rng.range(-3.0, 3.0), rng.range(-3.0, 3.0), rng.range(-5.0, 5.0));
        let splat = ListingSplat::new(p0.to_array(), rng.direction().to_array(), rng.log_range(0.01, 3.0));
        let s = listing.set_up(&splat);
        let (lo, hi) = disc_of(&splat).depth_extent(2.0);
        let error = (s.zmin - lo).abs().max((s.zmax - hi).abs());
        assert!(error <= tol::DEPTH_EXTENT, "{error:e}");
    }
}

#[test]
fn the_clip_plane_test_is_exact_for_any_conic() {
    let mut rng = Random::new(8);
    let (mut culled, mut kept) = (0, 0);
    for i in 0..3000 {
        let p0 = DVec3::new(rng.range(-3.0, 3.0), rng.range(-3.0, 3.0), rng.range(0.1, 4.0));
        let (frame, disc) = random_anisotropic(&mut rng, p0, 0.05, 2.0);
        // Planes of (x, y, w), where a point of the disc is known; every third one parallel to z = const.
        let normal = if i % 3 == 0 { DVec3::Z } else { rng.direction() };
        let origin = DVec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(-1.0, 3.0));
        let plane = ClipPlane {
            origin: [origin.x, origin.y, 0.0, origin.z],
            normal: [normal.x, normal.y, 0.0, normal.z],
        };
        let listed = behind(&plane, 2.0, &frame);
        // The greatest plane value over the disc, by turning camera space so that it becomes a depth.
        let turned = DQuat::from_rotation_arc(normal, DVec3::Z);
        let (_, reach) =
            Disc::new(turned * (disc.center - origin), turned * disc.t1, turned * disc.t2).depth_extent(2.0);
        if reach.abs() > tol::DEPTH_EXTENT {
            assert_eq!(listed, reach < 0.0, "reach {reach:e}");
            *(if listed { &mut culled } else { &mut kept }) += 1;
        }
    }
    assert!(culled > 500 && kept > 500, "{culled} {kept}");
    // L76: parallel to the disc.
    let (frame, _) =
        anisotropic(DVec3::new(0.0, 0.0, 2.0), DVec3::X, DVec3::Y, &[[1.0, 0.0], [0.0, 1.0]], D3D);
    for (depth, expected) in [(1.0, false), (3.0, true)] {
        let plane = ClipPlane { origin: [0.0, 0.0, 0.0, depth], normal: [0.0, 0.0, 0.0, 1.0] };
        assert_eq!(behind(&plane, 2.0, &frame), expected);
    }
}

#[test]
fn the_circle_of_confusion_has_the_right_magnitude() {
    let mut rng = Random::new(9);
    for _ in 0..300 {
        let (f_number, focus, w) =
            (rng.log_range(1.0, 16.0), rng.log_range(0.5, 50.0), rng.log_range(0.05, 100.0));
        let lens = Lens::of_f_number(f_number, focus);
        let focal_length = focus / (1.0 + focus);
        let listed = circle_of_confusion(focal_length, 1.0, f_number, w, w);
        let truth = lens.circle_of_confusion(w);
        let closed = corrected_coc(&lens, w, w);
        let scale = lens.radius * (1.0 / w + 1.0 / focus);
        assert!((closed - truth).abs() <= tol::COC * scale, "{:e}", (closed - truth).abs() / scale);
        // The division by w - focalLength amplifies: see E7.
        let near_pole = w.max(focal_length) / (w - focal_length).abs();
        let error = (listed.abs() - truth).abs();
        assert!(error <= tol::COC * scale * near_pole, "{:e}", error / scale / near_pole);
        // Its sign is right only beyond the focal length: see E6.
        assert_eq!(listed > 0.0, w > focal_length);
    }
}

#[test]
fn pinhole_and_lens_rays_meet_the_plane_where_they_should() {
    let mut rng = Random::new(10);
    let mut p = small_picture::<f64>();
    p.focus = 3.0;
    let listing = Listing::new(p);
    let lens = Lens { radius: 0.2, focus: 3.0 };
    let mut tested = 0;
    while tested < 5000 {
        let w = rng.log_range(0.5, 30.0);
        let p0 = DVec3::new(rng.range(-1.0, 1.0) * w, rng.range(-1.0, 1.0) * w, w);
        let (frame, disc) = random_anisotropic(&mut rng, p0, 0.02 * w, 0.2 * w);
        let at = DVec2::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0));
        let on_lens = if tested % 2 == 0 { DVec2::ZERO } else { rng.in_disc() * lens.radius };
        let ray = SampleRay::thin_lens(at, on_lens, &lens);
        let steepness = disc
            .normal
            .normalize()
            .dot(ray.direction.normalize())
            .abs()
            .min(disc.normal.normalize().dot(disc.center.normalize()).abs());
        let Some(hit) = disc.intersect(&ray) else { continue };
        if steepness < 0.1 || hit.r2() > 100.0 {
            continue;
        }
        tested += 1;
        let s = listing.set_up_frame(&frame);
        let cast = listing.cast(&s, at.to_array(), on_lens.to_array());
        let scale = 1.0 / (steepness * steepness);
        // r^2 by the conic; (u, v) themselves in units of the tangents.
        let r2 = cast.radius / (cast.uv[2] * cast.uv[2]);
        assert!((r2 - hit.r2()).abs() <= tol::RAY * scale * 100.0, "{:e}", (r2 - hit.r2()).abs() / scale);
        let (u, v) = (cast.uv[0] / cast.uv[2], cast.uv[1] / cast.uv[2]);
        let depth = frame.p0h[3] + u * frame.tuh[3] + v * frame.tvh[3];
        assert!((depth / hit.depth - 1.0).abs() <= tol::RAY * scale);
        // Not in the listing, but free: w = focus (detM - p'.z)/f'.z.
        let column = |v: DVec3| s.mi[0][2] * v.x + s.mi[1][2] * v.y + s.mi[2][2] * v.z;
        let (p_z, f_z) = (column(ray.origin), column(ray.direction));
        let depth = lens.focus * (s.det_m - p_z) / f_z;
        assert!((depth / hit.depth - 1.0).abs() <= tol::RAY * scale);
        assert_eq!(cast.inside, hit.r2() < 2.0, "the random r^2 is not within rounding of the cutoff");
    }
}

#[test]
fn a_picture_through_the_lens_has_the_true_fragments() {
    let (listing, lens, splats, camera) = splats_through_a_lens();
    let p = &listing.parameters;
    let listed: BTreeMap<_, _> =
        fragments(&listing, &splats).into_iter().map(|f| ((f.splat, f.x, f.y, f.j), f)).collect();
    let mut hits = 0;
    for (i, splat) in splats.iter().enumerate() {
        let disc = Disc::round(
            DVec3::from_array(splat.position),
            DVec3::from_array(splat.normal),
            splat.size,
            &camera,
        );
        for (x, y) in all_pixels(p) {
            for j in 0..p.subpixels {
                let at = screen_point(p, x, y, p.prefilter_jitter[j]);
                let ray = SampleRay::thin_lens(at, DVec2::from_array(p.lens_jitter[j]), &lens);
                let hit = disc.intersect(&ray).filter(|h| h.r2() < 2.0 && h.depth > 0.1);
                let fragment = listed.get(&(i, x, y, j));
                assert_eq!(hit.is_some(), fragment.is_some(), "splat {i} at {x}, {y}, sample {j}");
                if let (Some(hit), Some(fragment)) = (hit, fragment) {
                    hits += 1;
                    let weight = fragment.weight.expect("inside the table");
                    let error = weight / libm::exp(-0.5 * hit.r2()) - 1.0;
                    assert!((-tol::RAY..=tol::FLOOR_TABLE_F2).contains(&error), "{error:e}");
                    let (a, b) = D3D.coefficients();
                    assert!((fragment.z - (a * hit.depth + b)).abs() <= tol::RAY * 100.0);
                    assert!(hit.front && !fragment.dot_sign);
                    assert!(fragment.zmin <= hit.depth && hit.depth <= fragment.zmax);
                }
            }
        }
    }
    assert_eq!(hits, listed.len(), "no fragment outside the picture");
    assert!(hits > 2000, "{hits}");
}
