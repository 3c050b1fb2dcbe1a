//! The errata of seed 0 (the Ptex filter footprint) and seed 3 (pbrt, chapter 11), each by its name: the
//! printed form is wrong by about as much as the erratum says, and ours is right.

use glam::{DAffine3, DMat2, DVec2, DVec3, Vec2};
use splat_core::texture::footprint::SINGULAR;
use splat_core::texture::{
    CylinderHeight, CylindricalMapping, Footprint, FullSides, PixelDerivatives, PlanarMapping, Ray,
    RayDifferential, SpacePoint, SphericalMapping, Surface, SurfaceDifferentials,
};
use splat_tests::printed_textures as printed;
use splat_tests::random::Random;
use splat_tests::textures::{derivative, vector};
use splat_tests::tolerances as tol;
use std::f64::consts::{PI, TAU};

const SPHERE: SphericalMapping = SphericalMapping { world_to_texture: DAffine3::IDENTITY };
const CYLINDER: CylindricalMapping =
    CylindricalMapping { world_to_texture: DAffine3::IDENTITY, height: CylinderHeight::Normalized };

/// d(s, t)/dx of our spherical mapping.
fn sphere(point: DVec3, dx: DVec3) -> DVec2 {
    SPHERE.map(&SpacePoint { point, dx, dy: DVec3::ZERO }).derivatives.x
}

/// d(s, t)/dx of our cylindrical mapping.
fn cylinder(point: DVec3, dx: DVec3) -> DVec2 {
    CYLINDER.map(&SpacePoint { point, dx, dy: DVec3::ZERO }).derivatives.x
}

/// Whether a number is one that was printed with so many decimals.
fn is_about(value: f64, quoted: f64, decimals: i32) -> bool {
    (value - quoted).abs() <= tol::printed(decimals)
}

#[test]
fn seed_0_inverse_and_chain_rule_are_right() {
    let mut rng = Random::new(0);
    let (mut inverse, mut chain) = (0.0_f64, 0.0_f64);
    for _ in 0..2000 {
        let [du, dv, ds, dt] = [0; 4].map(|_| vector(&mut rng, 2.0).truncate().as_vec2());
        let forward = DMat2::from_cols(du.as_dvec2(), dv.as_dvec2());
        if forward.determinant().abs() < 0.1 {
            continue;
        }
        let derivatives = PixelDerivatives::from_screen(du, dv);
        let back = DMat2::from_cols(derivatives.x, derivatives.y);
        let error = back * forward - DMat2::IDENTITY;
        inverse = inverse.max(error.x_axis.abs().max_element().max(error.y_axis.abs().max_element()));
        // The printed chain rule, written out.
        let matrix = DMat2::from_cols(ds.as_dvec2(), dt.as_dvec2());
        let chained = derivatives.chain(matrix);
        let printed = ds.as_dvec2() * derivatives.x.x + dt.as_dvec2() * derivatives.x.y;
        chain = chain.max((chained.x - printed).abs().max_element() / (1.0 + printed.length()));
    }
    assert!(inverse <= tol::INVERSE, "{inverse:e}");
    assert!(chain <= tol::EXACT, "{chain:e}");
}

/// For random vectors that lie nearly along each other, sin(angle) log-uniform in a range: the sorted
/// relative errors of the determinant in `f32`, the share of them whose sign is wrong or which are zero, and
/// the greatest error of ours.
fn errors_of_determinants(least: f64, greatest: f64) -> (Vec<f64>, f64, f64) {
    let mut rng = Random::new(1);
    let (mut errors, mut wrong, mut ours) = (vec![], 0, 0.0_f64);
    while errors.len() < 20_000 {
        let angle = rng.range(0.1, 1.4);
        let turn = rng.log_range(least, greatest);
        let [du, dv] = [angle, angle + turn].map(|a| {
            let length = rng.range(0.5, 2.0);
            [libm::cos(a) * length, libm::sin(a) * length].map(|x| x as f32)
        });
        // Exact: multiples of 2^-32, since no component is below 2^-8.
        let [a, b] = [du, dv].map(|v| v.map(|x| libm::scalbn(f64::from(x), 32) as i128));
        let exact = libm::scalbn((a[0] * b[1] - a[1] * b[0]) as f64, -64);
        if exact == 0.0 {
            continue;
        }
        let found = f64::from(printed::determinant_f32(du, dv));
        wrong += usize::from(found * exact <= 0.0);
        errors.push((found / exact - 1.0).abs());
        // Lengths are below 2: not singular.
        if exact.abs() > 4.0 * SINGULAR {
            // Ours, by what it divides.
            let derivatives = PixelDerivatives::from_screen(du.into(), dv.into());
            ours = ours.max((f64::from(dv[1]) / derivatives.x.x / exact - 1.0).abs());
        }
    }
    errors.sort_by(f64::total_cmp);
    let wrong = wrong as f64 / errors.len() as f64;
    (errors, wrong, ours)
}

#[test]
fn seed_0_the_determinant_cancels_in_f32() {
    let (errors, _, ours) = errors_of_determinants(1e-6, 1e-3);
    let [median, late] = [0.5, 0.99].map(|share| errors[(share * errors.len() as f64) as usize]);
    assert!((1e-4..4e-4).contains(&median), "{median:e}");
    assert!(late > 0.01, "{late:e}");
    assert!(ours <= 3.0 * tol::DETERMINANT, "{ours:e}");
    let (_, wrong, _) = errors_of_determinants(1e-8, 1e-6);
    assert!(wrong > 1e-3, "{wrong:e}");
}

#[test]
fn seed_0_a_singular_matrix_gives_a_bounded_footprint_whatever_the_unit() {
    for unit in [1e-18_f32, 1e-6, 1.0, 1e6, 1e18] {
        // Exactly parallel, and so near that f32 cannot tell.
        for tilt in [0.0_f32, 1e-8, 3e-8] {
            let [du, dv] = [Vec2::new(unit, 2.0 * unit), Vec2::new(unit, (2.0 + tilt) * unit)];
            let derivatives = PixelDerivatives::from_screen(du, dv);
            for column in [derivatives.x, derivatives.y] {
                let limit = 1.001 * f64::from(1 << 24) / f64::from(unit);
                assert!(column.is_finite() && column.length() <= limit, "{unit:e} {column}");
                // What the screen cannot see: along (1, -1).
                assert!((column.x + column.y).abs() <= 1e-6 * column.length(), "{column}");
            }
        }
        // A small determinant alone is not a singular matrix.
        let fine = PixelDerivatives::from_screen(Vec2::new(unit, 0.0), Vec2::new(0.0, unit));
        if unit > 1e-7 {
            assert!((fine.x.x * f64::from(unit) - 1.0).abs() <= tol::EXACT, "{fine:?}");
        }
    }
    // At the limit of the relative test the result is continuous.
    let at =
        |tilt: f64| PixelDerivatives::from_screen(Vec2::new(1.0, 0.0), Vec2::new(1.0, tilt as f32)).x.x.abs();
    let limit = SINGULAR * 2.0_f64.sqrt();
    assert!((at(limit * 1.001) / at(limit * 0.999) - 1.0).abs() < 0.003);
}

#[test]
fn seed_0_sides_are_diameters() {
    // The rectangle of case A, and the ellipse that it encloses: half of each.
    let ellipse = Footprint::from(FullSides::texture_aligned(0.5, 0.25));
    assert_eq!(ellipse.semi_axes, [Vec2::new(0.25, 0.0), Vec2::new(0.0, 0.125)]);
    let axes = ellipse.principal_axes();
    assert_eq!((axes.major, axes.minor, axes.direction), (0.25, 0.125, DVec2::X));
    // pbrt takes the same derivatives for semi-axes: an ellipse of twice the size.
    let derivatives = PixelDerivatives { x: DVec2::new(0.5, 0.0), y: DVec2::new(0.0, 0.25) };
    assert_eq!(Footprint::from(derivatives.full_sides()), ellipse);
    assert_eq!(derivatives.semi_axes().principal_axes().major, 0.5);
}

#[test]
fn f01_taylor_s_second_term() {
    // f = 2 x - 3 y, from (0, 0) to (1, 1).
    assert_eq!(printed::taylor(0.0, 2.0, -3.0, DVec2::ONE), 4.0);
    // Our plane differentials use both: the step (1, 1) is dp/dx + dp/dy on a plane seen from straight above.
    let ray = RayDifferential {
        ray: Ray::new(DVec3::ZERO, DVec3::Z),
        next: [DVec3::new(2.0, 0.0, 0.0), DVec3::new(0.0, -3.0, 0.0)].map(|o| Ray::new(o, DVec3::Z)),
    };
    let [dx, dy] = ray.on_tangent_plane(DVec3::Z, DVec3::NEG_Z);
    assert_eq!(dx + dy, DVec3::new(2.0, -3.0, 0.0));
}

#[test]
fn f02_the_tangent_plane_s_sign() {
    let mut rng = Random::new(2);
    let (mut printed_worst, mut ours) = (0.0_f64, 0.0_f64);
    for _ in 0..1000 {
        let (p, n) = (vector(&mut rng, 1.0), rng.direction());
        let origin = vector(&mut rng, 2.0);
        let direction = p + 0.1 * rng.direction() - origin;
        let ray = Ray::new(origin, p - origin);
        let next = Ray::new(origin, direction);
        if n.dot(next.direction) * n.dot(ray.direction) < 0.1 {
            continue;
        }
        let d = -n.dot(p);
        let t = printed::plane_distance(n, d, origin, next.direction);
        printed_worst = printed_worst.max((n.dot(origin + t * next.direction) + d).abs());
        let [dx, dy] = RayDifferential { ray, next: [next; 2] }.on_tangent_plane(p, n);
        assert_eq!(dx, dy);
        ours = ours.max(n.dot(dx).abs());
    }
    assert!(printed_worst > 1.5, "{printed_worst}");
    assert!(ours <= tol::ON_PLANE, "{ours:e}");
}

#[test]
fn f03_misprints_of_the_second_derivative() {
    let (p, dpdx, dpdy) =
        (DVec3::new(-0.3, 0.5, 0.6), DVec3::new(0.01, 0.02, 0.0), DVec3::new(0.0, -0.01, 0.02));
    let [dsdx, dtdx, dsdy, dtdy] = printed::sphere_derivatives_with_misprints(p, dpdx, dpdy);
    let found = SPHERE.map(&SpacePoint { point: p, dx: dpdx, dy: dpdy }).derivatives;
    // ds/dx is a fair approximation; ds/dy and dt/dy are not even near, and dt/dx was overwritten.
    assert!((dsdx - found.x.x).abs() < 1e-4);
    assert!((dtdx - found.x.y).abs() > 0.5, "{dtdx} {}", found.x.y);
    assert!((dsdy - found.y.x).abs() > 1.0 && (dtdy - found.y.y).abs() > 1.0, "{dsdy} {dtdy}");
}

#[test]
fn f04_the_seam_of_the_sphere() {
    // Across phi = 0, by -.1 radian a pixel.
    let p = DVec3::new(libm::cos(0.005), libm::sin(0.005), 0.0);
    let dp = DVec3::new(0.0, -0.1, 0.0);
    let as_printed = printed::sphere_derivative(p, dp, 0.1).y;
    assert!(is_about(as_printed, -8.98, 2), "{as_printed}");
    // With a step of a whole pixel the sign flips.
    let with_one = printed::sphere_derivative(p, dp, 1.0).y;
    assert!(is_about(with_one, 0.0159, 4), "{with_one}");
    let found = sphere(p, dp).y;
    assert!(is_about(found, -0.0159, 4), "{found}");
    // Near a pole, where .74 of a turn a pixel is right.
    let p = DVec3::new(libm::cos(1.0), libm::sin(1.0), 10.0);
    let dp = TAU * 0.74 * DVec3::new(-p.y, p.x, 0.0);
    let as_printed = printed::sphere_derivative(p, dp, 1e-4).y;
    assert!(is_about(as_printed, 0.26, 2), "{as_printed}");
    assert!(is_about(sphere(p, dp).y, 0.74, 4));
    // Corrected, the printed way is right across the seam as well.
    let p = DVec3::new(1.0, 0.005, 0.3);
    let dp = DVec3::new(0.0, -0.1, 0.02);
    let map = |point| SPHERE.map(&SpacePoint { point, ..SpacePoint::default() }).st;
    let corrected = splat_core::texture::mapping::difference_quotient(map, p, dp, 0.1, [false, true]);
    assert!((corrected - sphere(p, dp)).length() < 1e-4, "{corrected}");
}

#[test]
fn f05_the_seam_of_the_cylinder_is_in_s() {
    // Across phi = pi, by .3 radian a pixel; the correction of t does nothing.
    let angle = PI - 0.001;
    let p = DVec3::new(libm::cos(angle), libm::sin(angle), 0.0);
    let dp = 0.3 * DVec3::new(-p.y, p.x, 0.0);
    let as_printed = printed::cylinder_derivative(p, dp, 0.01).x;
    assert!(is_about(as_printed, -99.95, 2), "{as_printed}");
    let found = cylinder(p, dp).x;
    assert!(is_about(found, 0.0478, 4) || is_about(found, 0.0477, 4), "{found}");
}

#[test]
fn f06_pbrt_v4_exchanges_the_derivatives_of_the_sphere() {
    let mut rng = Random::new(6);
    let (mut theirs, mut ours) = (0.0_f64, 0.0_f64);
    for _ in 0..200 {
        let (p, dp) = (rng.direction(), vector(&mut rng, 0.2));
        if libm::hypot(p.x, p.y) < 0.3 || p.y.abs() < 0.05 {
            continue;
        }
        let truth = derivative(|h| printed::sphere(p + h * dp).extend(0.0), 1e-3).truncate();
        theirs = theirs.max((printed::sphere_derivative_v4(p, dp) - truth).length());
        ours = ours.max((sphere(p, dp) - truth).length());
    }
    assert!(theirs > 0.05, "{theirs}");
    assert!(ours <= tol::CENTRAL_DIFFERENCE, "{ours:e}");
}

#[test]
fn f07_the_angle_near_a_pole_and_the_centre() {
    let (mut acos, mut atan) = (0.0_f64, 0.0_f64);
    for i in 1..2000 {
        let angle = f64::from(i) * 1e-6;
        let [x, z] = [libm::sin(angle) as f32, libm::cos(angle) as f32];
        acos = acos.max((f64::from(libm::acosf(z)) - angle).abs());
        atan = atan.max((f64::from(libm::atan2f(x, z)) - angle).abs());
        let st = SPHERE.map(&SpacePoint {
            point: DVec3::new(libm::sin(angle), 0.0, libm::cos(angle)),
            ..SpacePoint::default()
        });
        assert!((st.st.x * PI - angle).abs() <= tol::EXACT);
    }
    assert!((1.5e-4..3.5e-4).contains(&acos), "{acos:e}");
    assert!(atan <= 2.4e-7, "{atan:e}");
    // The printed mapping divides by zero at the centre.
    assert!(printed::sphere(DVec3::ZERO).is_nan());
    let centre = SpacePoint { point: DVec3::ZERO, dx: DVec3::X, dy: DVec3::Y };
    assert_eq!(SPHERE.map(&centre), Default::default());
    assert_eq!(CYLINDER.map(&centre), Default::default());
}

/// A surface whose dp/du and dp/dv these are.
fn surface(dpdu: DVec3, dpdv: DVec3) -> Surface {
    Surface {
        position: DVec3::ZERO,
        normal: DVec3::Z,
        position_derivatives: [dpdu, dpdv],
        normal_derivatives: [DVec3::ZERO; 2],
    }
}

#[test]
fn f08_singular_is_relative() {
    let (scale, offset) = (1e-6, DVec3::new(3e-6, 4e-6, 0.0));
    let [dpdu, dpdv] = [scale * DVec3::new(1.0, 0.5, 0.0), scale * DVec3::new(-0.5, 1.0, 0.0)];
    // The absolute test finds no solution, and takes the whole texture.
    assert_eq!(printed::solve([[dpdu.x, dpdv.x], [dpdu.y, dpdv.y]], [offset.x, offset.y]), [1.0, 0.0]);
    let found = surface(dpdu, dpdv).parameters_of(offset);
    let truth = DVec2::new(4.0, 2.0);
    assert!((found - truth).length() <= tol::EXACT, "{found}");
    // The same numbers whatever the unit of length.
    for scale in [1e-150, 1e-30, 1e6, 1e150] {
        let found = surface(scale * dpdu, scale * dpdv).parameters_of(scale * offset);
        assert!((found - truth).length() <= tol::EXACT, "{scale:e} {found}");
    }
    // What sticks out of the surface does not matter: least squares.
    let above = surface(dpdu, dpdv).parameters_of(offset + DVec3::new(0.0, 0.0, 1e-5));
    assert!((above - truth).length() <= tol::EXACT, "{above}");
}

#[test]
fn f09_the_fallback_is_bounded_and_along_what_is_there() {
    // dp/du = 2 dp/dv: a solution of least length exists.
    let dpdv = DVec3::new(0.1, 0.2, 0.0);
    let offset = 0.05 * dpdv;
    assert_eq!(printed::solve([[0.2, 0.1], [0.4, 0.2]], [offset.x, offset.y]), [1.0, 0.0]);
    let found = surface(2.0 * dpdv, dpdv).parameters_of(offset);
    assert!((found - DVec2::new(0.02, 0.01)).length() <= tol::EXACT, "{found}");
    // So near to it that f32 cannot tell: not 1e9 times as much.
    let nearly = surface(2.0 * dpdv, dpdv + DVec3::new(2e-10, -1e-10, 0.0));
    let across = offset + DVec3::new(0.02, -0.01, 0.0);
    let found = nearly.parameters_of(across);
    assert!((found - DVec2::new(0.02, 0.01)).length() <= 1e-9, "{found}");
    // As at the pole of a sphere.
    let found = surface(DVec3::ZERO, dpdv).parameters_of(offset);
    assert!((found - DVec2::new(0.0, 0.05)).length() <= tol::EXACT, "{found}");
    assert_eq!(surface(DVec3::ZERO, DVec3::ZERO).parameters_of(offset), DVec2::ZERO);
    // A ray along the plane never meets it.
    let along = DVec3::X;
    assert!(!printed::plane_distance(DVec3::Z, 0.0, DVec3::Z, along).is_finite());
    let ray = RayDifferential {
        ray: Ray::new(DVec3::new(0.0, 0.0, 1.0), DVec3::new(1.0, 0.0, -1e-3)),
        next: [along, DVec3::new(1.0, 0.0, 1e-3)].map(|d| Ray::new(DVec3::Z, d)),
    };
    for offset in ray.on_tangent_plane(DVec3::new(1000.0, 0.0, 0.0), DVec3::Z) {
        assert!(offset.is_finite() && offset.z.abs() < 1e-6 && offset.length() > 1000.0, "{offset}");
    }
}

/// How the ray of a pixel off by `x` is sent on by the unit sphere around the origin.
fn traced(x: f64, send: impl Fn(DVec3, DVec3) -> Option<DVec3>) -> (DVec3, DVec3, DVec3, Option<DVec3>) {
    let origin = DVec3::new(0.3, 0.2, -3.0);
    let d = (DVec3::new(0.05, -0.02, 1.0) + x * DVec3::new(0.8, 0.6, 0.0)).normalize();
    let b = origin.dot(d);
    let t = -b - (b * b - origin.length_squared() + 1.0).sqrt();
    let p = origin + t * d;
    (p, p, d, send(d, p))
}

fn refract(d: DVec3, n: DVec3, eta: f64) -> Option<DVec3> {
    let cosine = -d.dot(n);
    let squared = 1.0 - eta * eta * (1.0 - cosine * cosine);
    (squared > 0.0).then(|| eta * d + (eta * cosine - squared.sqrt()) * n)
}

/// The surface and the ray of the tests above, with a pixel of `step`.
fn on_sphere(step: f64) -> (RayDifferential, Surface, SurfaceDifferentials) {
    let [(p, n, d, _), (_, _, next, _)] = [0.0, step].map(|x| traced(x, |_, _| None));
    let origin = DVec3::new(0.3, 0.2, -3.0);
    let ray = RayDifferential { ray: Ray::new(origin, d), next: [Ray::new(origin, next); 2] };
    let u = n.cross(DVec3::X).normalize();
    let v = n.cross(u);
    let surface =
        Surface { position: p, normal: n, position_derivatives: [u, v], normal_derivatives: [u, v] };
    let differentials = surface.differentials(&ray);
    (ray, surface, differentials)
}

const STEP: f64 = 1e-5;

#[test]
fn f10_reflection_needs_both_signs_and_unit_directions() {
    let (ray, surface, differentials) = on_sphere(STEP);
    let mirror = |d: DVec3, n: DVec3| Some(d - 2.0 * d.dot(n) * n);
    let truth = derivative(|x| traced(x, mirror).3.expect("hit"), 1e-4);
    let relative = |change: DVec3| (change - truth).length() / truth.length();
    let sent = ray.reflected(&surface, &differentials);
    let right = relative((sent.next[0].direction - sent.ray.direction) / STEP);
    let (wo, dwo) = (-ray.ray.direction, ray.ray.direction - ray.next[0].direction);
    let (n, dn) = (surface.normal, differentials.normal[0]);
    let printed_right = relative(printed::reflected_change(wo, dwo, n, dn) / STEP);
    let flipped = relative(printed::reflected_change(wo, dwo, -n, dn) / STEP);
    assert!(right <= tol::FIRST_ORDER && printed_right <= tol::FIRST_ORDER);
    assert!((1.0..3.0).contains(&flipped), "{flipped}");
    // Turning both is the same mirror.
    let turned = Surface { normal: -n, ..surface };
    let turned_differentials =
        SurfaceDifferentials { normal: differentials.normal.map(|dn| -dn), ..differentials };
    assert_eq!(ray.reflected(&turned, &turned_differentials).next, sent.next);
    // Directions of another length than 1 have derivatives of another length.
    let long = relative(printed::reflected_change(1.5 * wo, 1.5 * dwo, n, dn) / STEP);
    assert!((long - 0.5).abs() <= tol::FIRST_ORDER, "{long}");
}

#[test]
fn f11_refraction_of_pbrt_v4() {
    let (ray, surface, differentials) = on_sphere(STEP);
    for eta in [1.0 / 1.5, 1.5] {
        let truth = derivative(|x| traced(x, |d, n| refract(d, n, eta)).3.expect("not total"), 1e-4);
        let relative = |change: DVec3| (change - truth).length() / truth.length();
        let sent = ray.refracted(&surface, &differentials, eta).expect("not total");
        let ours = relative((sent.next[0].direction - sent.ray.direction) / STEP);
        let (wo, dwo) = (-ray.ray.direction, ray.ray.direction - ray.next[0].direction);
        let (n, dn) = (surface.normal, differentials.normal[0]);
        let v4 = relative(printed::refracted_change_v4(wo, dwo, n, dn, 1.0 / eta) / STEP);
        assert!(ours <= tol::FIRST_ORDER, "{ours:e}");
        assert!(v4 > 0.2, "{v4}");
        // From the other side of the normal: both turned.
        let turned = Surface { normal: -n, ..surface };
        let turned_differentials =
            SurfaceDifferentials { normal: differentials.normal.map(|dn| -dn), ..differentials };
        assert_eq!(ray.refracted(&turned, &turned_differentials, eta), Some(sent));
    }
    // Total reflection: none.
    let steep = RayDifferential {
        ray: Ray::new(DVec3::new(-1.0, 0.0, 0.5), DVec3::new(1.0, 0.0, -0.5)),
        next: [Ray::new(DVec3::new(-1.0, 0.0, 0.5), DVec3::new(1.0, 0.0, -0.5)); 2],
    };
    let flat = Surface { normal: DVec3::Z, normal_derivatives: [DVec3::ZERO; 2], ..surface };
    assert_eq!(steep.refracted(&flat, &SurfaceDifferentials::default(), 1.5), None);
    assert!(steep.refracted(&flat, &SurfaceDifferentials::default(), 1.0 / 1.5).is_some());
}

#[test]
fn f12_the_plane_has_a_transform() {
    let world_to_texture = DAffine3::from_translation(DVec3::new(1.0, 2.0, 3.0))
        * DAffine3::from_rotation_z(PI / 2.0)
        * DAffine3::from_scale(DVec3::splat(2.0));
    let map = PlanarMapping { world_to_texture, vs: DVec3::X, vt: DVec3::Y, offset: DVec2::new(0.5, 0.25) };
    let at = SpacePoint { point: DVec3::new(0.1, 0.2, 0.3), dx: DVec3::X, dy: DVec3::Y };
    let found = map.map(&at);
    // (x, y) -> 2 (-y, x) + (1, 2).
    assert!((found.st - DVec2::new(1.1, 2.45)).length() <= tol::EXACT, "{found:?}");
    assert!((found.derivatives.x - DVec2::new(0.0, 2.0)).length() <= tol::EXACT);
    assert!((found.derivatives.y - DVec2::new(-2.0, 0.0)).length() <= tol::EXACT);
    // As printed, the point's own coordinates.
    assert!((DVec2::new(0.1 + 0.5, 0.2 + 0.25) - found.st).length() > 1.0);
}
