//! Ray differentials and the derivatives of splats, against traced neighbours and finite differences.

use glam::{DAffine3, DMat2, DMat4, DQuat, DVec2, DVec3, Vec2};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use splat_core::evaluate::{LensPoint, Limits, SplatConstants};
use splat_core::setup::{CameraSplat, View, project};
use splat_core::texture::footprint::MAX_COMPONENT;
use splat_core::texture::{
    Footprint, FullSides, PixelDerivatives, Ray, RayDifferential, SpacePoint, SphericalMapping, Surface,
    SurfaceDifferentials,
};
use splat_core::{Camera, Lens, Projection, RenderOptions};
use splat_tests::random::Random;
use splat_tests::textures::{any_f32, any_f64, any_vector, derivative, derivative_2d, vector};
use splat_tests::tolerances as tol;

/// A camera somewhere, whose matrix carries scale.
fn camera(projection: Projection, rng: &mut Random) -> Camera {
    let rotation = DQuat::from_axis_angle(rng.direction(), rng.range(0.0, 3.0));
    Camera {
        width: 96,
        height: 64,
        projection,
        principal_point: DVec2::new(47.0, 33.5),
        world_to_camera: DMat4::from_scale_rotation_translation(
            DVec3::splat(rng.range(0.5, 2.0)),
            rotation,
            vector(rng, 5.0),
        ),
        near: 1e-3,
        far: f64::INFINITY,
        clip_planes: vec![],
        distortion: None,
    }
}

fn projections() -> [Projection; 4] {
    let focal_length = DVec2::new(90.0, 70.0);
    let lens = |focus| Some(Lens { radius: 0.1, focus, blades: 0 });
    [
        Projection::Perspective { focal_length, lens: None },
        Projection::Perspective { focal_length, lens: lens(3.0) },
        Projection::Perspective { focal_length, lens: lens(f64::INFINITY) },
        Projection::Orthographic { pixels_per_unit: 40.0 },
    ]
}

/// Where a ray of camera space is at depth w, as SPEC section 1 projects it, in pixels.
fn pixel_at(camera: &Camera, ray: &Ray, w: f64) -> DVec2 {
    let [origin, direction] = [
        camera.world_to_camera.transform_point3(ray.origin),
        camera.world_to_camera.transform_vector3(ray.direction),
    ];
    let p = origin + (w - origin.z) / direction.z * direction;
    let screen = if camera.is_orthographic() { p.truncate() } else { p.truncate() / w };
    screen * camera.pixel_scale() + camera.principal_point
}

#[test]
fn camera_rays_go_through_their_pixels() {
    let mut rng = Random::new(1);
    for projection in projections() {
        for _ in 0..100 {
            let camera = camera(projection, &mut rng);
            let pixel = DVec2::new(rng.range(0.0, 96.0), rng.range(0.0, 64.0));
            let on_lens = rng.in_disc();
            let rays = RayDifferential::from_camera(&camera, pixel, on_lens);
            // Rays of a lens meet those of the eye at the focus; there they are where the pinhole is.
            let w = camera.lens().map_or(2.0, |lens| lens.focus.min(1e15));
            let expected = [pixel, pixel + DVec2::X, pixel + DVec2::Y];
            for (ray, expected) in [rays.ray, rays.next[0], rays.next[1]].iter().zip(expected) {
                let found = pixel_at(&camera, ray, w);
                assert!((found - expected).length() <= tol::RAY_PIXEL, "{found} {expected}");
                assert!((ray.direction.length() - 1.0).abs() <= tol::EXACT);
                // Forwards.
                assert!(camera.world_to_camera.transform_vector3(ray.direction).z > 0.0);
            }
            // All from the same point of the lens, or of the eye.
            if !camera.is_orthographic() {
                let radius = camera.lens().map_or(0.0, |lens| lens.radius);
                let start = camera.world_to_camera.transform_point3(rays.ray.origin);
                assert!((start - (radius * on_lens).extend(0.0)).length() <= tol::EYE * 10.0);
                assert_eq!(rays.next.map(|ray| ray.origin), [rays.ray.origin; 2]);
            }
        }
    }
}

/// A plane before a camera, with skewed coordinates.
fn plane_before(camera: &Camera, rng: &mut Random) -> Surface {
    let to_world = camera.world_to_camera.inverse();
    let center = DVec3::new(rng.range(-0.3, 0.3), rng.range(-0.3, 0.3), rng.range(2.0, 4.0));
    let normal = DVec3::new(rng.range(-0.7, 0.7), rng.range(-0.7, 0.7), -1.0).normalize();
    let u = normal.cross(rng.direction()).normalize();
    let axes = [u, 0.5 * normal.cross(u) + 0.3 * u];
    Surface {
        position: to_world.transform_point3(center),
        normal: to_world.transform_vector3(normal).normalize(),
        position_derivatives: axes.map(|axis| to_world.transform_vector3(axis)),
        normal_derivatives: [DVec3::ZERO; 2],
    }
}

/// (u, v) and the point at which a ray meets the plane of a surface.
fn meet(surface: &Surface, ray: &Ray) -> (DVec2, DVec3) {
    let t = surface.normal.dot(surface.position - ray.origin) / surface.normal.dot(ray.direction);
    let p = ray.origin + t * ray.direction;
    let [u, v] = surface.position_derivatives;
    // By Cramer's rule in the plane, with the third axis along the normal.
    let n = u.cross(v);
    let o = p - surface.position;
    (DVec2::new(o.cross(v).dot(n), u.cross(o).dot(n)) / n.length_squared(), p)
}

#[test]
fn neighbours_on_a_plane_are_exact() {
    let mut rng = Random::new(2);
    for projection in projections() {
        for _ in 0..100 {
            let camera = camera(projection, &mut rng);
            let mut surface = plane_before(&camera, &mut rng);
            let pixel = DVec2::new(rng.range(40.0, 55.0), rng.range(28.0, 40.0));
            let rays = RayDifferential::from_camera(&camera, pixel, rng.in_disc());
            // The hit, and the surface's coordinates around it.
            let (_, hit) = meet(&surface, &rays.ray);
            surface.position = hit;
            let found = surface.differentials(&rays);
            for i in 0..2 {
                let (uv, p) = meet(&surface, &rays.next[i]);
                let scale = surface.position_derivatives[1].length();
                assert!((found.position[i] - (p - hit)).length() <= tol::NEIGHBOUR * scale.max(1.0));
                let parameters = [found.parameters.x, found.parameters.y][i];
                assert!((parameters - uv).length() <= tol::NEIGHBOUR, "{parameters} {uv}");
                assert_eq!(found.normal[i], DVec3::ZERO);
            }
        }
    }
}

#[test]
fn far_from_the_origin_neighbours_keep_their_digits() {
    // Map coordinates: 1e7 units from the origin a unit in the last place is 1.9e-9.
    let far = DVec3::new(5e5, 1e7, 100.0);
    let rays = |o: DVec3| RayDifferential {
        ray: Ray::new(o, DVec3::new(0.0, 0.1, -1.0)),
        next: [Ray::new(o, DVec3::new(0.001, 0.1, -1.0)), Ray::new(o, DVec3::new(0.0, 0.101, -1.0))],
    };
    let normal = DVec3::new(0.1, 0.2, 1.0).normalize();
    let near = rays(DVec3::ZERO).on_tangent_plane(DVec3::new(0.0, 0.25, -2.5), normal);
    let moved = rays(far).on_tangent_plane(far + DVec3::new(0.0, 0.25, -2.5), normal);
    for i in 0..2 {
        assert!((near[i] - moved[i]).length() <= tol::EXACT, "{} {}", near[i], moved[i]);
    }
}

/// The f32 constants as f64, without rounding.
fn widened(c: &SplatConstants<f32>) -> SplatConstants<f64> {
    SplatConstants {
        xi: c.xi,
        yi: c.yi,
        xf: c.xf.into(),
        yf: c.yf.into(),
        h: c.h.map(f64::from),
        a1: c.a1.into(),
        b: c.b.map(f64::from),
        reference: c.reference.map(f64::from),
        centred: c.centred,
        depth: c.depth.into(),
        depth_slope: c.depth_slope.map(f64::from),
        defocus: c.defocus.into(),
        lens_slope: c.lens_slope.map(f64::from),
        edge_on: c.edge_on.into(),
    }
}

/// A splat of camera space.
fn camera_splat(rng: &mut Random) -> CameraSplat {
    let center = DVec3::new(rng.range(-0.3, 0.3), rng.range(-0.3, 0.3), rng.range(2.0, 4.0));
    let normal = DVec3::new(rng.range(-0.9, 0.9), rng.range(-0.9, 0.9), -1.0).normalize();
    let u = normal.cross(rng.direction()).normalize();
    let size = rng.log_range(0.01, 0.3);
    CameraSplat { center, axes: [size * u, 0.6 * size * (normal.cross(u) + 0.4 * u)], normal, back: false }
}

#[test]
fn splats_know_their_own_derivatives() {
    let mut rng = Random::new(3);
    let limits = Limits::<f64>::new(1e9, 1e-9, f64::INFINITY);
    let mut worst = 0.0_f64;
    for projection in projections() {
        for _ in 0..200 {
            let camera = camera(projection, &mut rng);
            let view = View::new(&camera, &RenderOptions::default());
            let exact = project(&camera_splat(&mut rng), &view).expect("not edge-on");
            let rounded = exact.to_f32();
            let constants = widened(&rounded);
            let offset = [rng.range(-3.0, 3.0) as f32, rng.range(-3.0, 3.0) as f32];
            let d = offset.map(f64::from);
            let point = camera.lens().map(|lens| {
                LensPoint::<f32>::new(rng.in_disc().to_array().map(|x| x as f32), lens, view.pixel_scale)
            });
            let wide = point.map(|point| LensPoint { p: point.p.map(f64::from) });
            let uv = |d: [f64; 2]| {
                let hit = match (&wide, camera.is_orthographic()) {
                    (Some(point), _) => constants.thin_lens(d, point, &limits),
                    (None, false) => constants.pinhole(d, &limits),
                    (None, true) => constants.orthographic(d, &limits),
                };
                hit.map_or(DVec2::NAN, |hit| DVec2::new(hit.u, hit.v))
            };
            if !uv(d).is_finite() {
                continue;
            }
            let found = PixelDerivatives::of_splat(&rounded, offset, point.as_ref());
            let truth = PixelDerivatives {
                x: derivative_2d(|h| uv([d[0] + h, d[1]]), 1e-2),
                y: derivative_2d(|h| uv([d[0], d[1] + h]), 1e-2),
            };
            let scale = truth.x.length().max(truth.y.length());
            worst = worst.max((found.x - truth.x).length().max((found.y - truth.y).length()) / scale);
        }
    }
    assert!(worst <= tol::SPLAT_DERIVATIVE, "{worst:e}");
}

#[test]
fn splats_agree_with_ray_differentials() {
    // In the splat's own basis, after the rotation that set-up applies to it (the documentation of
    // `of_splat`).
    let mut rng = Random::new(4);
    for projection in projections() {
        for _ in 0..100 {
            let camera = camera(projection, &mut rng);
            let view = View::new(&camera, &RenderOptions::default());
            let splat = camera_splat(&mut rng);
            let constants = project(&splat, &view).expect("not edge-on");
            let [t1, t2] = splat.axes;
            // (J01, J11), normalised.
            let s = splat.center.truncate() / splat.center.z;
            let row = |t: DVec3| if camera.is_orthographic() { t.y } else { t.y - s.y * t.z };
            let cs = DVec2::new(row(t1), row(t2)).normalize();
            let back = DMat2::from_cols(cs, DVec2::new(-cs.y, cs.x));
            let to_world = camera.world_to_camera.inverse();
            let surface = Surface {
                position: to_world.transform_point3(splat.center),
                normal: to_world.transform_vector3(splat.normal).normalize(),
                position_derivatives: splat.axes.map(|axis| to_world.transform_vector3(axis)),
                normal_derivatives: [DVec3::ZERO; 2],
            };
            let offset = [0.25_f32, -0.5];
            let pixel = constants.pixel() + Vec2::from(offset).as_dvec2();
            let on_lens = rng.in_disc().to_array().map(|x| x as f32);
            let point = camera.lens().map(|lens| LensPoint::<f32>::new(on_lens, lens, view.pixel_scale));
            let found = PixelDerivatives::of_splat(&constants.to_f32(), offset, point.as_ref()).chain(back);
            let uv =
                |pixel| meet(&surface, &Ray::from_camera(&camera, pixel, Vec2::from(on_lens).as_dvec2())).0;
            let truth = PixelDerivatives {
                x: derivative_2d(|h| uv(pixel + h * DVec2::X), 1e-2),
                y: derivative_2d(|h| uv(pixel + h * DVec2::Y), 1e-2),
            };
            let scale = truth.x.length().max(truth.y.length());
            let error = (found.x - truth.x).length().max((found.y - truth.y).length()) / scale;
            assert!(error <= tol::SPLAT_CONSTANTS, "{error:e} {found:?} {truth:?}");
        }
    }
}

#[test]
fn a_pixel_s_footprint_from_end_to_end() {
    // A camera's ray, its hit on a sphere, the spherical mapping: (s, t) as the neighbours' own hits have
    // them.
    let mut rng = Random::new(8);
    for projection in projections() {
        let camera = Camera {
            world_to_camera: DMat4::from_translation(DVec3::Z * 4.0),
            ..camera(projection, &mut rng)
        };
        // Pixels a thousandth as wide: forward differences are all but derivatives.
        let fine = |scale: f64| match projection {
            Projection::Perspective { focal_length, lens } => {
                Projection::Perspective { focal_length: focal_length * scale, lens }
            }
            Projection::Orthographic { pixels_per_unit } => {
                Projection::Orthographic { pixels_per_unit: pixels_per_unit * scale }
            }
        };
        let camera =
            Camera { projection: fine(1000.0), principal_point: camera.principal_point * 1000.0, ..camera };
        let mapping = SphericalMapping { world_to_texture: DAffine3::from_rotation_x(0.5) };
        for _ in 0..50 {
            let pixel = camera.principal_point + 1e4 * rng.in_disc();
            let on_lens = rng.in_disc();
            let hit = |pixel: DVec2| {
                let ray = Ray::from_camera(&camera, pixel, on_lens);
                let b = ray.origin.dot(ray.direction);
                let root = b * b - ray.origin.length_squared() + 1.0;
                ray.origin - (b + root.sqrt()) * ray.direction
            };
            let p = hit(pixel);
            assert!(p.is_finite());
            let [dx, dy] = RayDifferential::from_camera(&camera, pixel, on_lens).on_tangent_plane(p, p);
            let found = mapping.map(&SpacePoint { point: p, dx, dy }).derivatives;
            let st = |pixel| mapping.map(&SpacePoint { point: hit(pixel), ..SpacePoint::default() }).st;
            let truth = [DVec2::X, DVec2::Y].map(|step| {
                derivative_2d(
                    |h| {
                        let d = st(pixel + h * step) - st(pixel);
                        d - d.round()
                    },
                    1.0,
                )
            });
            let error = (found.x - truth[0]).length().max((found.y - truth[1]).length());
            let relative = error / truth[0].length().max(truth[1].length());
            assert!(relative <= tol::FIRST_ORDER_MANY, "{relative:e}");
            // As the two kinds of footprints have them.
            let [semi_axes, sides] = [found.semi_axes().semi_axes, found.full_sides().sides];
            assert_eq!(semi_axes, [found.x.as_vec2(), found.y.as_vec2()]);
            assert_eq!(semi_axes, sides);
        }
    }
}

/// A mirror and a refraction of a unit direction at a unit normal on its side.
fn reflect(d: DVec3, n: DVec3) -> DVec3 {
    d - 2.0 * d.dot(n) * n
}

fn refract(d: DVec3, n: DVec3, eta: f64) -> Option<DVec3> {
    let n = if d.dot(n) > 0.0 { -n } else { n };
    let cosine = -d.dot(n);
    let squared = 1.0 - eta * eta * (1.0 - cosine * cosine);
    (squared > 0.01).then(|| eta * d + (eta * cosine - squared.sqrt()) * n)
}

#[test]
fn reflection_and_refraction_follow_traced_neighbours() {
    const STEP: f64 = 1e-5;
    let mut rng = Random::new(5);
    let (mut mirrored, mut bent, mut cases) = (0.0_f64, 0.0_f64, 0);
    while cases < 600 {
        // A flat surface, or a sphere of any curvature: n(p) = normalize(n0 + k (p - p0)), of either side.
        let curvature = if cases % 3 == 0 { 0.0 } else { rng.range(-2.0, 2.0) };
        let n0 = rng.direction();
        let origin = vector(&mut rng, 2.0);
        let p0 = vector(&mut rng, 0.5);
        let across = rng.direction();
        let d0 = (p0 - origin).normalize();
        if d0.dot(n0).abs() < 0.3 {
            continue;
        }
        cases += 1;
        let hit = |x: f64| {
            let d = (d0 + x * across).normalize();
            // The paraboloid n0.o + k o^2/2 = 0 around p0, by Newton's method: its normal is n0 + k o.
            let mut t = (p0 - origin).length();
            for _ in 0..20 {
                let o = origin + t * d - p0;
                t -= (n0.dot(o) + 0.5 * curvature * o.length_squared()) / (n0 + curvature * o).dot(d);
            }
            let o = origin + t * d - p0;
            (p0 + o, (n0 + curvature * o).normalize(), d)
        };
        let ray = RayDifferential {
            ray: Ray::new(origin, d0),
            next: [Ray::new(origin, d0 + STEP * across), Ray::new(origin, d0)],
        };
        let u = n0.cross(rng.direction()).normalize();
        let axes = [2.0 * u, n0.cross(u) - 0.5 * u];
        let surface = Surface {
            position: p0,
            normal: n0,
            position_derivatives: axes,
            normal_derivatives: axes.map(|axis| curvature * axis),
        };
        let differentials = surface.differentials(&ray);
        let change = |sent: &RayDifferential| {
            [
                (sent.next[0].origin - sent.ray.origin) / STEP,
                (sent.next[0].direction - sent.ray.direction) / STEP,
            ]
        };
        let sent = ray.reflected(&surface, &differentials);
        let truth = [derivative(|x| hit(x).0, 1e-4), derivative(|x| reflect(hit(x).2, hit(x).1), 1e-4)];
        let error = |found: [DVec3; 2], truth: [DVec3; 2]| {
            let scale = 1.0 + truth[0].length() + truth[1].length();
            (found[0] - truth[0]).length().max((found[1] - truth[1]).length()) / scale
        };
        mirrored = mirrored.max(error(change(&sent), truth));
        // What does not change stays.
        assert!((sent.next[1].origin - sent.ray.origin).length() <= tol::EXACT);
        let eta = rng.range(0.6, 1.6);
        let Some(_) = refract(d0, n0, eta) else { continue };
        let sent = ray.refracted(&surface, &differentials, eta).expect("not total");
        let bend = |x| {
            let (_, n, d) = hit(x);
            refract(d, n, eta).unwrap_or(DVec3::NAN)
        };
        let slope = derivative(bend, 1e-4);
        if slope.is_finite() {
            bent = bent.max(error(change(&sent), [truth[0], slope]));
        }
    }
    assert!(mirrored <= tol::FIRST_ORDER_MANY, "{mirrored:e}");
    assert!(bent <= tol::FIRST_ORDER_MANY, "{bent:e}");
}

#[test]
fn a_second_bounce_follows_the_first() {
    // Two flat mirrors at right angles send every ray straight back, whatever its direction.
    let eye = DVec3::new(1.0, 2.0, 0.0);
    let d = DVec3::new(-0.6, -0.8, 0.1);
    let ray = RayDifferential {
        ray: Ray::new(eye, d),
        next: [Ray::new(eye, d + DVec3::new(1e-3, 0.0, 0.0)), Ray::new(eye, d + DVec3::new(0.0, 0.0, 1e-3))],
    };
    let mirror = |normal: DVec3, position| Surface {
        position,
        normal,
        position_derivatives: [normal.cross(DVec3::Z), DVec3::Z],
        normal_derivatives: [DVec3::ZERO; 2],
    };
    let first = mirror(DVec3::X, meet(&mirror(DVec3::X, DVec3::ZERO), &ray.ray).1);
    let once = ray.reflected(&first, &first.differentials(&ray));
    let second = mirror(DVec3::Y, meet(&mirror(DVec3::Y, DVec3::ZERO), &once.ray).1);
    let twice = once.reflected(&second, &second.differentials(&once));
    let turned = |d: DVec3| DVec3::new(-d.x, -d.y, d.z);
    assert!((twice.ray.direction - turned(ray.ray.direction)).length() <= tol::EXACT);
    for i in 0..2 {
        let error = (twice.next[i].direction - turned(ray.next[i].direction)).length();
        assert!(error <= tol::EXACT, "{error:e}");
    }
}

#[test]
fn principal_axes_keep_the_ellipse() {
    let mut rng = Random::new(6);
    for _ in 0..5000 {
        let (major, minor) = (rng.log_range(1e-3, 1e3), rng.log_range(1e-7, 1.0));
        let minor = major * minor;
        let [turn, phase] = [rng.range(0.0, 6.3), rng.range(0.0, 6.3)];
        let [c, s] = [libm::cos(turn), libm::sin(turn)];
        let [a, b] = [DVec2::new(c, s), DVec2::new(-s, c)];
        // Any two conjugate semi-diameters of it.
        let at = |phase: f64| (major * libm::cos(phase) * a + minor * libm::sin(phase) * b).as_vec2();
        let footprint = Footprint::new(at(phase), at(phase + std::f64::consts::FRAC_PI_2));
        let axes = footprint.principal_axes();
        // M of the axes is M of the vectors, and so is the area.
        let [p, q] = footprint.semi_axes.map(|axis| axis.as_dvec2());
        let across = axes.direction.perp();
        let m = |v: DVec2| DVec2::new(p.dot(v), q.dot(v)).length_squared();
        assert!((m(axes.direction).sqrt() / axes.major - 1.0).abs() <= tol::PRINCIPAL);
        assert!(m(across).sqrt() <= axes.minor + tol::PRINCIPAL * axes.major * 2.0);
        let area = p.perp_dot(q).abs();
        assert!((axes.major * axes.minor - area).abs() <= tol::PRINCIPAL * area);
        assert!((axes.major / major - 1.0).abs() <= 4.0 * tol::FOOTPRINT_F32);
        // Its box holds it, and touches.
        let half = footprint.half_box();
        assert!((half.x - m(DVec2::X).sqrt()).abs() <= tol::PRINCIPAL * axes.major);
        assert!((half.y - m(DVec2::Y).sqrt()).abs() <= tol::PRINCIPAL * axes.major);
    }
    // However thin, and along either axis.
    for (along, expected) in
        [(Vec2::new(1e-6, 1.0), 1e-6), (Vec2::new(0.0, -3.0), 0.0), (Vec2::new(1.0, 1e-6), 1e6)]
    {
        let axes = Footprint::new(Vec2::ZERO, along).principal_axes();
        let ratio = axes.direction.x / axes.direction.y;
        assert!((ratio - expected).abs() <= 2.0 * tol::FOOTPRINT_F32 * expected, "{axes:?}");
        assert_eq!(axes.minor, 0.0);
    }
    // A circle, nothing, and a line.
    let circle = Footprint::new(Vec2::new(3.0, 4.0), Vec2::new(-4.0, 3.0)).principal_axes();
    assert_eq!((circle.direction, circle.major, circle.minor), (DVec2::X, 5.0, 5.0));
    let none = Footprint::default().principal_axes();
    assert_eq!((none.direction, none.major, none.minor), (DVec2::X, 0.0, 0.0));
    let line = Footprint::new(Vec2::new(1e4, 1e4), Vec2::new(2e4, 2e4)).principal_axes();
    assert_eq!(line.minor, 0.0);
    assert!((line.major - 5e8_f64.sqrt() * 2.0_f64.sqrt()).abs() <= 1e-9 * line.major, "{line:?}");
}

#[test]
fn sanitized_is_what_it_says() {
    let bound = MAX_COMPONENT as f32;
    let footprint = |x, y| Footprint::new(Vec2::new(x, y), Vec2::X).sanitized().semi_axes;
    assert_eq!(footprint(0.5, -1e8), [Vec2::new(0.5, -1e8), Vec2::X]);
    assert_eq!(footprint(f32::NAN, 3.0), [Vec2::ZERO, Vec2::X]);
    assert_eq!(footprint(f32::NAN, f32::INFINITY), [Vec2::ZERO, Vec2::X]);
    assert_eq!(footprint(f32::NEG_INFINITY, 3.0), [Vec2::new(-bound, 0.0), Vec2::X]);
    assert_eq!(footprint(f32::INFINITY, f32::NEG_INFINITY), [Vec2::new(bound, -bound), Vec2::X]);
    assert_eq!(footprint(4e10, -2e10), [Vec2::new(bound, -0.5 * bound), Vec2::X]);
    assert_eq!(footprint(f32::MAX, f32::MIN), [Vec2::new(bound, -bound), Vec2::X]);
}

fn is_bounded(derivatives: &PixelDerivatives) -> bool {
    [derivatives.x, derivatives.y].iter().all(|v| v.abs().max_element() <= MAX_COMPONENT)
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 20_000, rng_seed: RngSeed::Fixed(7), failure_persistence: None, ..ProptestConfig::default()
    })]

    #[test]
    fn no_footprint_is_unbounded(v in prop::array::uniform4(any_f32())) {
        let [a, b] = [Vec2::new(v[0], v[1]), Vec2::new(v[2], v[3])];
        let bound = MAX_COMPONENT as f32;
        let footprint = Footprint::new(a, b);
        let clean = footprint.sanitized();
        prop_assert!(clean.semi_axes.iter().all(|v| v.is_finite() && v.abs().max_element() <= bound));
        prop_assert_eq!(clean.sanitized(), clean);
        let axes = footprint.principal_axes();
        prop_assert!(axes.major.is_finite() && axes.minor >= 0.0 && axes.minor <= axes.major);
        prop_assert!((axes.direction.length() - 1.0).abs() <= tol::EXACT);
        prop_assert!(footprint.half_box().is_finite());
        let screen = PixelDerivatives::from_screen(a, b);
        prop_assert!(is_bounded(&screen), "{:?}", screen);
        prop_assert!(screen.semi_axes().sanitized() == screen.semi_axes());
        let sides = FullSides::texture_aligned(v[0], v[3]);
        prop_assert!(Footprint::from(sides).principal_axes().major.is_finite());
        let matrix = DMat2::from_cols(a.as_dvec2(), b.as_dvec2());
        prop_assert!(is_bounded(&screen.chain(matrix)));
    }

    #[test]
    fn no_derivative_of_a_splat_is_unbounded(v in prop::array::uniform16(any_f32())) {
        let constants = SplatConstants::<f32> {
            xi: 0, yi: 0, xf: v[0], yf: v[1], h: [v[2], v[3]], a1: v[4], b: [v[5], v[6]],
            reference: [v[7], v[8]], centred: true, depth: v[9], depth_slope: [0.0; 2],
            defocus: v[10], lens_slope: [v[11], v[12]], edge_on: 0.0,
        };
        let lens = LensPoint { p: [v[13], v[14]] };
        for lens in [None, Some(&lens)] {
            let found = PixelDerivatives::of_splat(&constants, [v[0], v[15]], lens);
            prop_assert!(is_bounded(&found), "{:?}", found);
        }
    }

    #[test]
    fn no_differential_is_unbounded(
        v in prop::array::uniform9(any_vector()), eta in any_f64(), normalized in any::<bool>()
    ) {
        let ray = RayDifferential {
            ray: Ray::new(v[0], v[1]),
            next: [Ray::new(v[0], v[2]), Ray::new(v[3], v[1])],
        };
        let surface = Surface {
            position: v[4],
            normal: if normalized { Ray::new(v[0], v[5]).direction } else { v[5] },
            position_derivatives: [v[6], v[7]],
            normal_derivatives: [v[8], v[0]],
        };
        let SurfaceDifferentials { position, parameters, .. } = surface.differentials(&ray);
        prop_assert!(position.iter().all(|p| p.is_finite()));
        prop_assert!(is_bounded(&parameters), "{:?}", parameters);
        let differentials = surface.differentials(&ray);
        if let Some(sent) = ray.refracted(&surface, &differentials, eta) {
            let rays = [sent.ray, sent.next[0], sent.next[1]];
            prop_assert!(rays.iter().all(|r| r.origin.is_finite() && r.direction.is_finite()));
        }
        let sent = ray.reflected(&surface, &differentials);
        let again = surface.differentials(&sent);
        prop_assert!(is_bounded(&again.parameters));
    }
}
