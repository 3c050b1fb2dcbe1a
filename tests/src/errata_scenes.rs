//! Scenes that show the errata, and the corrected closed forms, for the tests of the listing and of
//! `splat-core`.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DMat3, DMat4, DQuat, DVec2, DVec3};

use crate::brute_force::{Disc, Hit, Lens, Rect, SampleRay};
use crate::listing::{
    Bounds, DepthMap, Listing, ListingFragment, ListingSplat, Matrix2, Matrix4, Parameters, Real, SetUp,
    TangentFrame, conic_of,
};
use crate::random::Random;

/// The depth map with which L194's `z > 0` means "in front of the near plane".
pub const D3D: DepthMap = DepthMap::Direct3d { near: 0.1, far: 100.0 };

/// A small picture, 90 pixels to the unit, of everything from depth 0.1 to 100.
pub fn small_picture<T: Real>() -> Parameters<T> {
    Parameters::new(D3D, 96, 64, 90.0)
}

/// The same picture from a camera elsewhere: `world_to_camera` with column vectors.
pub fn seen_from(mut p: Parameters<f64>, world_to_camera: &DMat4, depth: DepthMap) -> Parameters<f64> {
    p.object_to_screen = times(&world_to_camera.to_cols_array_2d(), &depth.perspective());
    p
}

/// The product of row-vector matrices. (glam's columns of a column-vector matrix are the rows of the
/// row-vector one.)
pub fn times(a: &Matrix4<f64>, b: &Matrix4<f64>) -> Matrix4<f64> {
    a.map(|row| [0, 1, 2, 3].map(|j| (0..4).map(|k| row[k] * b[k][j]).sum()))
}

/// A random rigid motion with scale.
pub fn random_camera(rng: &mut Random) -> DMat4 {
    let turn = DQuat::from_axis_angle(rng.direction(), rng.range(0.0, std::f64::consts::PI));
    DMat4::from_scale_rotation_translation(
        DVec3::splat(rng.log_range(0.5, 2.0)),
        turn,
        rng.direction() * rng.range(0.0, 5.0),
    )
}

/// A splat of any conic in both forms: the listing's frame, and the disc.
pub fn anisotropic(
    p0: DVec3,
    tu: DVec3,
    tv: DVec3,
    vr: &Matrix2<f64>,
    depth: DepthMap,
) -> (TangentFrame<f64>, Disc) {
    let (a, b) = depth.coefficients();
    let frame = TangentFrame {
        q: conic_of(vr),
        tuh: [tu.x, tu.y, a * tu.z, tu.z],
        tvh: [tv.x, tv.y, a * tv.z, tv.z],
        p0h: [p0.x, p0.y, a * p0.z + b, p0.z],
    };
    // (u, v)^t = Vr s with |s|^2 < F, so the axes are Vr's columns.
    let disc = Disc::new(p0, tu * vr[0][0] + tv * vr[1][0], tu * vr[0][1] + tv * vr[1][1]);
    (frame, disc)
}

/// A random splat about `p0`: any orientation, axes between `lo` and `hi`, a general conic.
pub fn random_anisotropic(rng: &mut Random, p0: DVec3, lo: f64, hi: f64) -> (TangentFrame<f64>, Disc) {
    let (tu, tv) = rng.direction().any_orthonormal_pair();
    let angle = rng.range(0.0, std::f64::consts::TAU);
    let (s, c) = (libm::sin(angle), libm::cos(angle));
    let (a, b) = (rng.log_range(lo, hi), rng.log_range(lo, hi));
    anisotropic(p0, tu, tv, &[[c * a, -s * b], [s * a, c * b]], D3D)
}

/// The disc of a splat whose world is camera space.
pub fn disc_of<T: Real>(splat: &ListingSplat<T>) -> Disc {
    let v = |a: [T; 3]| DVec3::from_array(a.map(T::wide));
    Disc::round(v(splat.position), v(splat.normal), splat.size.wide(), &DMat4::IDENTITY)
}

/// A splat of `size` at `p0` that faces the eye at the given tilt, in degrees.
pub fn tilted<T: Real>(p0: DVec3, tilt: f64, turn: f64, size: f64) -> ListingSplat<T> {
    let view = p0.normalize();
    let (a, b) = view.any_orthonormal_pair();
    let side = a * libm::cos(turn) + b * libm::sin(turn);
    let (s, c) = (libm::sin(tilt.to_radians()), libm::cos(tilt.to_radians()));
    ListingSplat::new(p0.to_array(), (side * s - view * c).to_array(), size)
}

/// All fragments of the splats.
pub fn fragments<T: Real>(listing: &Listing<T>, splats: &[ListingSplat<T>]) -> Vec<ListingFragment<T>> {
    let mut all = Vec::new();
    listing.run(splats, |f| all.push(f));
    all
}

/// A sample's screen point: pixel plus jitter, by L174 to L179.
pub fn screen_point(p: &Parameters<f64>, x: i64, y: i64, jitter: [f64; 2]) -> DVec2 {
    DVec2::new(
        (x as f64 + jitter[0] - p.vp_mid[0]) / p.vp_scale[0],
        (y as f64 + jitter[1] - p.vp_mid[1]) / p.vp_scale[1],
    )
}

/// Every pixel of the picture, row by row.
pub fn all_pixels(p: &Parameters<f64>) -> impl Iterator<Item = (i64, i64)> + use<> {
    let width = p.width;
    (0..p.width * p.height).map(move |i| (i % width, i / width))
}

/// The hits of the pinhole rays of every pixel, jitter `at`, inside the cutoff and beyond `near`.
pub fn true_hits(p: &Parameters<f64>, disc: &Disc, near: f64, at: [f64; 2]) -> BTreeMap<(i64, i64), Hit> {
    all_pixels(p)
        .filter_map(|(x, y)| {
            let hit = disc.intersect(&SampleRay::pinhole(screen_point(p, x, y, at)))?;
            (hit.r2() < p.cutoff && hit.depth > near).then_some(((x, y), hit))
        })
        .collect()
}

/// The pixels of the fragments.
pub fn pixels_of<T>(fragments: &[ListingFragment<T>]) -> BTreeSet<(i64, i64)> {
    fragments.iter().map(|f| (f.x, f.y)).collect()
}

/// The listing's box, in screen units.
pub fn rect_of<T: Real>(b: &Bounds<T>) -> Rect {
    Rect::new(b.xmin.wide(), b.ymin.wide(), b.xmax.wide(), b.ymax.wide())
}

/// The listing's box after the circle of confusion is added, in screen units.
pub fn rect_with_coc(s: &SetUp<f64>) -> Rect {
    rect_of(&s.bounds).grown(s.coc)
}

/// E1: half the depth extent, sqrt(F t^t Q^-1 t).
pub fn half_extent(q: &Matrix2<f64>, cutoff: f64, t: [f64; 2]) -> f64 {
    let det = q[0][0] * q[1][1] - q[0][1] * q[1][0];
    let form = q[1][1] * t[0] * t[0] - 2.0 * q[0][1] * t[0] * t[1] + q[0][0] * t[1] * t[1];
    (cutoff * form / det).sqrt()
}

/// E6 to E8: the largest circle of confusion of the depths [lo, hi], lo > 0.
pub fn corrected_coc(lens: &Lens, lo: f64, hi: f64) -> f64 {
    let inverse_focus = 1.0 / lens.focus;
    lens.radius * f64::max((1.0 / lo - inverse_focus).abs(), (1.0 / hi - inverse_focus).abs())
}

/// E10, E28: the exact box of the disc clipped at `near`, centred on a point of the disc.
pub fn corrected_box(disc: &Disc, cutoff: f64, near: f64) -> Option<Rect> {
    let t = DVec2::new(disc.t1.z, disc.t2.z);
    let w0 = disc.center.z;
    let ext = cutoff.sqrt() * t.length();
    if w0 + ext < near {
        return None;
    }
    let reference = if w0 >= ext / 4.0 { DVec2::ZERO } else { cutoff.sqrt() * t / t.length() };
    let r = disc.point(reference.x, reference.y);
    let side = |center: f64, a1: f64, a2: f64| {
        let middle = center / r.z;
        let a = DVec2::new(a1 - middle * t.x, a2 - middle * t.y);
        let c0 = -reference.dot(a);
        // (F t.t - w0^2) xi^2 - 2 (F a.t - c0 w0) xi + (F a.a - c0^2) = 0, without cancellation.
        let qa = cutoff * t.length_squared() - w0 * w0;
        let qb = cutoff * a.dot(t) - c0 * w0;
        let qc = cutoff * a.length_squared() - c0 * c0;
        let q = qb + (qb * qb - qa * qc).max(0.0).sqrt().copysign(qb);
        let touching = [q / qa, qc / q].into_iter().filter(|xi| {
            let (k, k3) = (a - *xi * t, c0 - xi * w0);
            let touch = -k * k3 / k.length_squared();
            xi.is_finite() && disc.point(touch.x, touch.y).z >= near
        });
        let mut candidates: Vec<f64> = touching.collect();
        if w0 - ext < near {
            let (along, foot) = (t.perp() / t.length(), t * (near - w0) / t.length_squared());
            let half = (cutoff - foot.length_squared()).max(0.0).sqrt();
            for end in [foot + along * half, foot - along * half] {
                candidates.push((c0 + end.dot(a)) / near);
            }
        }
        let lo = candidates.iter().copied().fold(f64::INFINITY, f64::min);
        let hi = candidates.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        (middle + lo, middle + hi)
    };
    let (x0, x1) = side(r.x, disc.t1.x, disc.t2.x);
    let (y0, y1) = side(r.y, disc.t1.y, disc.t2.y);
    Some(Rect::new(x0, y0, x1, y1))
}

/// E19: the kernel that is zero at the rim.
pub fn windowed(r2: f64, cutoff: f64) -> f64 {
    let rim = libm::exp(-0.5 * cutoff);
    (libm::exp(-0.5 * r2) - rim) / (1.0 - rim)
}

/// Eleven splats wholly in front of the camera, seen through a lens by a camera away from the origin.
pub fn splats_through_a_lens() -> (Listing<f64>, Lens, Vec<ListingSplat<f64>>, DMat4) {
    let mut rng = Random::new(11);
    let camera = random_camera(&mut rng);
    let lens = Lens::of_f_number(1.4, 4.0);
    let mut p = seen_from(small_picture(), &camera, D3D);
    p.aperture = 1.4;
    p.focus = 4.0;
    let samples: Vec<_> =
        (0..5).map(|_| ([rng.unit(), rng.unit()], (rng.in_disc() * lens.radius).to_array())).collect();
    let to_world = camera.inverse();
    let scale = DMat3::from_mat4(camera).determinant().cbrt();
    let splats = (0..11)
        .map(|_| {
            let w = rng.range(2.0, 9.0);
            let p0 = DVec3::new(rng.range(-0.5, 0.5) * w, rng.range(-0.3, 0.3) * w, w);
            let normal = (rng.direction() * 0.7 - p0.normalize()).normalize();
            let position = to_world.transform_point3(p0);
            let normal = to_world.transform_vector3(normal).normalize();
            ListingSplat::new(position.to_array(), normal.to_array(), rng.range(0.02, 0.05) * w / scale)
        })
        .collect();
    (Listing::new(p.with_pattern(&samples)), lens, splats, camera)
}

/// Two hundred overlapping splats of one flat wall that faces the camera, with a position noise of .001
/// sigma.
pub fn noisy_wall() -> Vec<ListingSplat<f64>> {
    let mut rng = Random::new(102);
    (0..200)
        .map(|_| {
            let p = [rng.range(-1.0, 1.0), rng.range(-0.7, 0.7), 3.0 + 0.15 * 0.001 * rng.normal()];
            ListingSplat::new(p, [0.0, 0.0, -1.0], 0.15)
        })
        .collect()
}

/// A disc at depth 5 that faces the camera.
pub fn facing_disc() -> ListingSplat<f64> {
    ListingSplat::new([0.0, 0.0, 5.0], [0.0, 0.0, -1.0], 0.3)
}

/// A large disc through the camera plane, and a wide picture of 80 x 50 rays that just fits the listing's
/// [-1, 1] (E11). The near plane is far from the eye, so that hits between both are many.
pub fn crossing_disc(depth: DepthMap) -> (Listing<f64>, ListingSplat<f64>) {
    let n = DVec3::new(0.2, -1.0, -0.3).normalize();
    (
        Listing::new(Parameters::new(depth, 80, 50, 40.0)),
        ListingSplat::new([0.05, 0.22, 0.11], n.to_array(), 3.0),
    )
}

/// A steep splat close to a wide lens, and a random ray through the lens that meets it.
pub fn steep_splat_and_ray(rng: &mut Random, lens: &Lens) -> (ListingSplat<f64>, DVec2, DVec2) {
    let w = rng.range(0.5, 2.0);
    let p0 = DVec3::new(rng.range(-1.0, 1.0) * w, rng.range(-1.0, 1.0) * w, w);
    let splat = tilted(p0, rng.range(0.0, 89.0), rng.range(0.0, std::f64::consts::TAU), 0.3 * w);
    let on_lens = rng.in_disc() * lens.radius;
    let aim = rng.in_disc() * 1.4;
    (splat, lens.image_of(disc_of(&splat).point(aim.x, aim.y), on_lens), on_lens)
}

/// Splats of a floor under the camera that are about as large as the camera is high, around the camera plane.
pub fn floor_discs() -> Vec<ListingSplat<f64>> {
    let mut rng = Random::new(110);
    (0..500)
        .map(|_| {
            let p0 = [rng.range(-2.0, 2.0), rng.range(0.3, 1.0), rng.range(-0.8, 0.8)];
            ListingSplat::new(p0, [0.0, -1.0, 0.0], rng.range(0.25, 1.0))
        })
        .collect()
}

/// A white splat half over a black one, both facing the camera.
pub fn white_over_black() -> [ListingSplat<f64>; 2] {
    let mut white = ListingSplat::new([-0.1, 0.0, 2.0], [0.0, 0.0, -1.0], 0.2);
    white.color = [1.0; 4];
    let mut black = ListingSplat::new([0.1, 0.0, 2.0], [0.0, 0.0, -1.0], 0.2);
    black.color = [0.0, 0.0, 0.0, 1.0];
    [white, black]
}
