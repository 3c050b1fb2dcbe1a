//! Set-up against brute force: extents, clip planes, culling, circles of confusion, depth intervals, splat
//! order and causes of dropping.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DMat4, DQuat, DVec2, DVec3, DVec4, Vec2, Vec3};
use splat_abuffer::{Resolve, SplatSurface, Thickness};
use splat_core::setup::{
    CameraSplat, Extent, SetUp, View, VisibleSplat, camera_splat, half_depth, orthographic_extent,
    perspective_extent, set_up, sort_keys,
};
use splat_core::{Camera, Cloud, Projection, RenderOptions, Shapes, TextureCoordinates, render};
use splat_tests::brute_force::{self, Disc, Rect};
use splat_tests::core_scenes::{
    camera_space, discs, ellipses, hard, image_of, lens_of, orthographic, pinhole, random_axes, sample_ray,
    thin_lens, tilted_axes, truth_of,
};
use splat_tests::errata_scenes::{random_anisotropic, random_camera, small_picture};
use splat_tests::listing::Listing;
use splat_tests::random::Random;
use splat_tests::tolerances as tol;

// ---------------------------------------------------------------------------------------------------------
// Extents

/// A random ellipse, up to 1:100, within a few units of the eye, on either side of the camera plane or
/// across it.
fn any_splat(rng: &mut Random) -> CameraSplat {
    let center = DVec3::new(rng.range(-3.0, 3.0), rng.range(-3.0, 3.0), rng.range(-2.0, 4.0));
    let (sigma, ratio) = (rng.log_range(0.01, 2.0), [1.0, 100.0][rng.index(2)]);
    camera_space(center, random_axes(rng, sigma, ratio))
}

/// Both extents as a rectangle.
fn perspective_box(splat: &CameraSplat, radius: f64, near: f64) -> Option<Rect> {
    let [x, y] = [0, 1].map(|axis| perspective_extent(splat, radius, near, axis));
    assert_eq!(x.is_some(), y.is_some());
    Some(rect(x?, y?))
}

fn rect(x: Extent, y: Extent) -> Rect {
    Rect::new(x.min, y.min, x.max, y.max)
}

#[test]
fn perspective_extents_are_exact() {
    let mut rng = Random::new(1);
    let (near, radius) = (0.1, 2.0);
    let (mut front, mut crossing, mut behind, mut worst) = (0, 0, 0, 0.0_f64);
    for _ in 0..4000 {
        let splat = any_splat(&mut rng);
        let disc = truth_of(&splat);
        let (lo, hi) = disc.depth_extent(radius * radius);
        let found = perspective_box(&splat, radius, near);
        let Some(truth) = disc.projected_box(radius * radius, near, brute_force::View::Perspective) else {
            behind += 1;
            assert_eq!(found, None);
            continue;
        };
        *(if lo > near { &mut front } else { &mut crossing }) += 1;
        let found = found.expect("a part of it is in front");
        // The numbers of which a screen point is made, and what a clip does to the ends of a short chord.
        let size = splat.center.length() + radius * (splat.axes[0].length() + splat.axes[1].length());
        let reach = 1.0 + truth.min.abs().max_element().max(truth.max.abs().max_element());
        let short = if lo < near { ((hi - near).min(near - lo) / (hi - lo)).sqrt() } else { 1.0 };
        let scale = size / lo.max(near) * reach / short;
        // Never too small, and no larger than the refined sampling can tell.
        let error = found.distance(truth);
        assert!(error <= tol::EXTENT * scale, "{error:e} of {scale:e}: {splat:?}, {found:?}, {truth:?}");
        worst = worst.max(error / scale);
    }
    assert!(front > 1000 && crossing > 500 && behind > 500, "{front} {crossing} {behind}");
    assert!(worst > tol::EXTENT / 1000.0, "{worst:e}: the tolerance means nothing");
}

#[test]
fn perspective_extents_of_slivers_and_of_discs_through_the_eye_s_plane() {
    let radius = 1.0;
    // A floor one unit under the eye: cut at w = .5 the half chord is sqrt(3)/2, twice that on the screen.
    let floor = camera_space(DVec3::new(0.0, 1.0, 0.0), [DVec3::Z, DVec3::X]);
    let found = perspective_box(&floor, radius, 0.5).expect("half of it is in front");
    assert!(
        found.distance(Rect::new(-(3.0_f64.sqrt()), 1.0, 3.0_f64.sqrt(), 2.0)) <= tol::EXACT,
        "{found:?}"
    );
    let found = perspective_box(&floor, radius, 1.0 - 1e-9).expect("a sliver");
    let half_chord = (1.0 - (1.0 - 1e-9_f64).powi(2)).sqrt() / (1.0 - 1e-9);
    let truth = Rect::new(-half_chord, 1.0, half_chord, 1.0 / (1.0 - 1e-9));
    assert!(found.distance(truth) <= tol::SLIVER, "{found:?}");
    assert_eq!(perspective_box(&floor, radius, 1.1), None);
    // The rim touches the camera plane: one tangent is at infinity.
    let touching = camera_space(DVec3::new(0.0, 1.0, 1.0), [DVec3::Z, DVec3::X]);
    let found = perspective_box(&touching, radius, 0.5).expect("in front");
    let truth =
        truth_of(&touching).projected_box(1.0, 0.5, brute_force::View::Perspective).expect("in front");
    assert!(found.distance(truth) <= tol::CLIPPED_BOX, "{found:?} {truth:?}");
}

#[test]
fn extents_are_never_nan() {
    let mut rng = Random::new(2);
    let (mut some, mut none, mut inside) = (0, 0, 0);
    for _ in 0..200_000 {
        let mut any =
            || rng.direction() * rng.log_range(1e-12, 1e12) * f64::from(u8::from(rng.index(20) > 0));
        let splat = CameraSplat { center: any(), axes: [any(), any()], normal: DVec3::Z, back: false };
        let near = rng.log_range(1e-9, 1e3);
        for axis in 0..2 {
            match perspective_extent(&splat, 2.0, near, axis) {
                Some(Extent { min, max }) => {
                    some += 1;
                    assert!(min <= max, "{min} {max}: {splat:?}");
                    // The centre is inside, where the numbers are of a size.
                    let sizes = [splat.center, splat.axes[0], splat.axes[1]].map(|v| v.length());
                    let [least, greatest] =
                        [f64::min, f64::max].map(|f| sizes.into_iter().reduce(f).unwrap_or(0.0));
                    if splat.center.z > near && greatest < 1e3 * least {
                        inside += 1;
                        let x = splat.center[axis] / splat.center.z;
                        let margin = tol::OF_A_SIZE * (min.abs().max(max.abs()) + 1.0);
                        assert!(min - margin <= x && x <= max + margin, "{x} not in {min}, {max}: {splat:?}");
                    }
                }
                None => none += 1,
            }
            let Extent { min, max } = orthographic_extent(&splat, 2.0, axis);
            assert!(min <= splat.center[axis] && splat.center[axis] <= max);
        }
    }
    assert!(some > 50_000 && none > 50_000 && inside > 1000, "{some} {none} {inside}");
}

#[test]
fn orthographic_extents_and_depths_are_exact() {
    let mut rng = Random::new(3);
    for _ in 0..500 {
        let splat = any_splat(&mut rng);
        let disc = truth_of(&splat);
        let truth =
            disc.projected_box(4.0, f64::NEG_INFINITY, brute_force::View::Orthographic).expect("all of it");
        let [x, y] = [0, 1].map(|axis| orthographic_extent(&splat, 2.0, axis));
        assert!(rect(x, y).distance(truth) <= tol::DEPTH_EXTENT, "{:e}", rect(x, y).distance(truth));
        let (lo, hi) = disc.depth_extent(4.0);
        let half = half_depth(&splat, 2.0);
        let error = (splat.center.z - half - lo).abs().max((splat.center.z + half - hi).abs());
        assert!(error <= tol::DEPTH_EXTENT, "{error:e}");
    }
}

#[test]
fn perspective_extents_of_discs_in_front_are_the_listing_s_box() {
    let mut rng = Random::new(4);
    let listing = Listing::new(small_picture::<f64>());
    let mut tested = 0;
    while tested < 2000 {
        let depth = rng.log_range(1.0, 50.0);
        let p0 = DVec3::new(rng.range(-1.0, 1.0) * depth, rng.range(-1.0, 1.0) * depth, depth);
        let (frame, disc) = random_anisotropic(&mut rng, p0, 0.02 * depth, 0.5 * depth);
        let tilt = disc.normal.normalize().dot(p0.normalize()).abs();
        if tilt < 0.05 || disc.depth_extent(2.0).0 < 0.1 * depth {
            continue;
        }
        tested += 1;
        let b = listing.set_up_frame(&frame).bounds;
        let listed = Rect::new(b.xmin, b.ymin, b.xmax, b.ymax);
        let splat = camera_space(disc.center, [disc.t1, disc.t2]);
        let found = perspective_box(&splat, 2.0_f64.sqrt(), 0.05 * depth).expect("in front");
        let size = found.size().min_element();
        assert!(found.distance(listed) <= tol::CONIC_BOX * size, "{:e}", found.distance(listed) / size);
    }
}

// ---------------------------------------------------------------------------------------------------------
// Clip planes

/// A frame that holds all of the view but directions at right angles to it.
fn wide(camera: Camera) -> Camera {
    let side = f64::from(splat_core::camera::MAX_SIDE);
    let projection = match camera.projection {
        Projection::Perspective { lens, .. } => {
            Projection::Perspective { focal_length: DVec2::splat(10.0), lens }
        }
        Projection::Orthographic { .. } => Projection::Orthographic { pixels_per_unit: 100.0 },
    };
    let principal_point = DVec2::splat(side / 2.0);
    Camera { width: side as u32, height: side as u32, principal_point, projection, ..camera }
}

fn set_up_one(splat: (DVec3, [DVec3; 2]), camera: &Camera, options: &RenderOptions) -> (SetUp, CameraSplat) {
    camera.check().expect("a valid camera");
    let cloud = ellipses(&[splat]);
    let view = View::new(camera, options);
    (set_up(&cloud, &view, options), camera_splat(&cloud, 0, &view))
}

/// The greatest value of normal.p + offset over the splat, by sampling: turned so that it becomes a depth.
fn greatest(splat: &CameraSplat, cutoff: f64, normal: DVec3, offset: f64) -> f64 {
    let turned = DQuat::from_rotation_arc(normal.normalize(), DVec3::Z);
    let disc = Disc::new(turned * splat.center, turned * splat.axes[0], turned * splat.axes[1]);
    disc.depth_extent(cutoff).1 * normal.length() + offset
}

#[test]
fn near_and_far_planes_cull_what_is_wholly_outside() {
    let mut rng = Random::new(5);
    let (mut culled, mut kept) = ([0; 2], [0; 2]);
    for i in 0..2000 {
        let base = if i % 2 == 0 { pinhole(1, 1, 1.0) } else { orthographic(1, 1, 1.0) };
        let camera = wide(Camera { near: 1.0, far: 3.0, ..base });
        let center = DVec3::new(rng.range(-0.5, 0.5), rng.range(-0.5, 0.5), rng.range(0.2, 4.0));
        let axes = random_axes(&mut rng, 0.3, 10.0);
        let (set_up, splat) = set_up_one((center, axes), &camera, &hard(4.0, 1));
        let (lo, hi) = truth_of(&splat).depth_extent(4.0);
        if !set_up.dropped.is_empty()
            || (lo - 3.0).abs() < tol::DEPTH_EXTENT
            || (hi - 1.0).abs() < tol::DEPTH_EXTENT
        {
            continue;
        }
        let outside = hi < 1.0 || lo > 3.0;
        assert_eq!(set_up.splats.is_empty(), outside, "[{lo}, {hi}]");
        (if outside { &mut culled } else { &mut kept })[usize::from(lo > 2.0)] += 1;
    }
    assert!(culled.iter().chain(&kept).all(|&n| n > 100), "{culled:?} {kept:?}");
}

#[test]
fn clip_planes_of_the_world_cull_what_is_wholly_outside() {
    let mut rng = Random::new(6);
    let (mut culled, mut kept) = (0, 0);
    for i in 0..3000 {
        // A pose with scale, and planes in world space: their values are those of the world's points.
        let world_to_camera = random_camera(&mut rng);
        let to_world = world_to_camera.inverse();
        let at = DVec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(1.0, 3.0));
        let center = to_world.transform_point3(at);
        let axes = random_axes(&mut rng, 0.5, 10.0);
        // Every other time one of two planes, the first of which clips nothing.
        let normal = rng.direction() * rng.log_range(0.1, 10.0);
        let offset = -normal.dot(center) + rng.range(-1.5, 1.5) * normal.length();
        let mut clip_planes = vec![normal.extend(offset)];
        if i % 2 == 0 {
            clip_planes.insert(0, DVec4::new(0.0, 0.0, 0.0, 1.0));
        }
        let base = if i % 3 == 0 { orthographic(1, 1, 1.0) } else { pinhole(1, 1, 1.0) };
        let camera = wide(Camera { world_to_camera, clip_planes, near: 1e-3, ..base });
        let (set_up, splat) = set_up_one((center, axes), &camera, &hard(2.0, 1));
        if !set_up.dropped.is_empty() || splat.center.z + half_depth(&splat, 2.0_f64.sqrt()) < 1e-2 {
            continue;
        }
        let in_world = ellipses(&[(center, axes)]);
        let Shapes::Ellipses(world_axes) = &in_world.shapes else { unreachable!() };
        let world = camera_space(in_world.world_position(0), world_axes[0].map(|axis| axis.as_dvec3()));
        let reach = greatest(&world, 2.0, normal, offset) / normal.length();
        if reach.abs() > tol::PLANE {
            assert_eq!(set_up.splats.is_empty(), reach < 0.0, "{reach:e}");
            *(if reach < 0.0 { &mut culled } else { &mut kept }) += 1;
        }
    }
    assert!(culled > 300 && kept > 1000, "{culled} {kept}");
}

// ---------------------------------------------------------------------------------------------------------
// Facing

#[test]
fn the_cull_asks_every_point_of_the_lens() {
    let mut rng = Random::new(7);
    let (mut partly, mut back, mut front) = (0, 0, 0);
    for i in 0..1000 {
        let radius = rng.log_range(0.05, 0.5);
        let lens = i % 4 != 0;
        let base = if lens { thin_lens(1, 1, 1.0, radius, 2.0) } else { pinhole(1, 1, 1.0) };
        // Mirrored poses, too.
        let mut world_to_camera = random_camera(&mut rng);
        if i % 3 == 0 {
            world_to_camera = DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0)) * world_to_camera;
        }
        let to_world = world_to_camera.inverse();
        let camera = wide(Camera { world_to_camera, near: 1e-2, ..base });
        let at = DVec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(1.0, 3.0));
        // Mostly steep, so that the lens sees both sides.
        let tilt = 90.0 + rng.range(-1.0, 1.0) * [3.0, 20.0, 90.0][rng.index(3)];
        let axes = tilted_axes(at, tilt, rng.range(-PI, PI), 0.0, [0.1; 2]);
        let splat = (to_world.transform_point3(at), axes.map(|axis| to_world.transform_vector3(axis)));
        let mut cloud = ellipses(&[splat]);
        if rng.index(2) == 0 {
            cloud.normals[0] = -cloud.normals[0];
        }
        let options = RenderOptions { cull: true, ..hard(4.0, 1) };
        let view = View::new(&camera, &options);
        // The world's facing, as the normal of the cloud says.
        let normal = cloud.normals[0].as_dvec3();
        let sees = |p: DVec3| normal.dot(to_world.transform_point3(p) - cloud.world_position(0)) > 0.0;
        let in_camera = camera_splat(&cloud, 0, &view);
        assert_eq!(in_camera.back, !sees(DVec3::ZERO));
        let share = lens_of(&view).map_or(f64::from(u8::from(sees(DVec3::ZERO))), |lens| {
            lens.share_that_sees_the_front(&truth_of(&in_camera), 10_000)
        });
        assert_eq!(in_camera.normal.dot(-in_camera.center) > 0.0, sees(DVec3::ZERO), "the camera's normal");
        let culled = set_up(&cloud, &view, &options);
        if !culled.dropped.is_empty() {
            continue;
        }
        // The grid of lens points misses slivers next to the rim.
        let n = in_camera.normal;
        let clearance =
            -n.dot(in_camera.center) + lens_of(&view).map_or(0.0, |lens| lens.radius * n.x.hypot(n.y));
        if clearance.abs() > tol::LENS_GRID * radius {
            assert_eq!(culled.splats.is_empty(), share == 0.0, "share {share}, clearance {clearance}");
        }
        *(match share {
            0.0 => &mut back,
            1.0 => &mut front,
            _ => &mut partly,
        }) += 1;
        // Without `cull`, or without orientation, it stays.
        assert_eq!(set_up(&cloud, &view, &hard(4.0, 1)).splats.len(), 1);
        cloud.oriented = false;
        assert_eq!(set_up(&cloud, &view, &options).splats.len(), 1);
    }
    assert!(partly > 100 && back > 200 && front > 200, "{partly} {back} {front}");
}

#[test]
fn an_orthographic_cull_goes_by_the_direction() {
    let mut rng = Random::new(8);
    let mut seen = [0; 2];
    for i in 0..300 {
        let mut world_to_camera = random_camera(&mut rng);
        if i % 2 == 0 {
            world_to_camera = DMat4::from_scale(DVec3::new(1.0, -1.0, 1.0)) * world_to_camera;
        }
        let to_world = world_to_camera.inverse();
        let camera = wide(Camera { world_to_camera, ..orthographic(1, 1, 1.0) });
        let center = to_world.transform_point3(DVec3::new(rng.range(-9.0, 9.0), 0.4, 3.0));
        let cloud = discs(&[(center, rng.direction(), 0.1)]);
        let options = RenderOptions { cull: true, ..hard(4.0, 1) };
        let view = View::new(&camera, &options);
        let towards = to_world.transform_vector3(DVec3::NEG_Z);
        let front = cloud.normals[0].as_dvec3().dot(towards) > 0.0;
        assert_eq!(set_up(&cloud, &view, &options).splats.len(), usize::from(front));
        seen[usize::from(front)] += 1;
    }
    assert!(seen.iter().all(|&n| n > 100), "{seen:?}");
}

#[test]
fn axes_and_normals_follow_any_pose() {
    // Shear, scale and mirror: the disc of the world, point by point.
    let mut rng = Random::new(9);
    for _ in 0..500 {
        let linear = DMat3::from_cols(rng.direction(), rng.direction(), rng.direction());
        if linear.determinant().abs() < 0.1 {
            continue;
        }
        let world_to_camera = DMat4::from_mat3_translation(linear, rng.direction() * 3.0);
        let camera = Camera { world_to_camera, ..pinhole(96, 64, 90.0) };
        let view = View::new(&camera, &hard(4.0, 1));
        let (position, sigma) = (rng.direction() * 3.0, rng.log_range(0.01, 1.0));
        let cloud = discs(&[(position, rng.direction(), sigma)]);
        let splat = camera_splat(&cloud, 0, &view);
        let Shapes::Discs(sizes) = &cloud.shapes else { unreachable!() };
        let normal = cloud.normals[0].as_dvec3().normalize();
        let truth = Disc::round(cloud.world_position(0), normal, f64::from(sizes[0]), &world_to_camera);
        assert!((splat.center - truth.center).length() <= tol::POSE);
        assert!((splat.normal - truth.normal.normalize()).length() <= tol::POSE);
        assert!((splat.normal.length() - 1.0).abs() <= tol::EXACT);
        // The same set of points: every point of the one's rim is on the other's, u^2 + v^2 = 1.
        for k in 0..8 {
            let offset = truth.rim(1.0, TAU * f64::from(k) / 8.0) - truth.center;
            let [t1, t2] = splat.axes;
            let uv = DMat3::from_cols(t1, t2, splat.normal).inverse() * offset;
            assert!((uv.x.hypot(uv.y) - 1.0).abs() <= tol::POSE && uv.z.abs() <= tol::POSE);
        }
    }
}

// ---------------------------------------------------------------------------------------------------------
// Circles of confusion and depth intervals

#[test]
fn circles_of_confusion_are_the_largest_over_the_depths() {
    let mut rng = Random::new(10);
    for i in 0..300 {
        let focus = if i % 5 == 0 { f64::INFINITY } else { rng.log_range(0.1, 50.0) };
        let radius = rng.log_range(0.01, 1.0);
        let view = View::new(&thin_lens(96, 64, 90.0, radius, focus), &hard(4.0, 1));
        let min = rng.log_range(0.05, 10.0);
        let max = min * rng.log_range(1.0, 100.0);
        let found = view.circle_of_confusion(Extent { min, max });
        let lens = brute_force::Lens { radius, focus };
        let truth = (0..=20)
            .map(|k| lens.circle_of_confusion(min + (max - min) * f64::from(k) / 20.0))
            .fold(0.0, f64::max);
        let scale = radius * (1.0 / min + 1.0 / focus);
        assert!((found - truth).abs() <= tol::COC * scale, "{found} {truth}");
        let formula = f64::max((1.0 / min - 1.0 / focus).abs(), (1.0 / max - 1.0 / focus).abs());
        assert!((found - radius * formula).abs() <= tol::COC * scale);
    }
    let pinhole = View::new(&pinhole(96, 64, 90.0), &hard(4.0, 1));
    assert_eq!(pinhole.circle_of_confusion(Extent { min: 0.1, max: 9.0 }), 0.0);
}

/// What set-up says of the splat's fragments, and the splat.
fn surface(
    camera: &Camera,
    options: &RenderOptions,
    rng: &mut Random,
) -> Option<(SplatSurface, CameraSplat)> {
    let center = DVec3::new(rng.range(-0.4, 0.4), rng.range(-0.3, 0.3), 1.0) * rng.log_range(1.0, 20.0);
    let axes = random_axes(rng, 0.1 * center.z, 20.0);
    let (set_up, splat) = set_up_one((center, axes), camera, options);
    Some((*set_up.surfaces.first()?, splat))
}

#[test]
fn depth_intervals_are_those_of_a_slab() {
    // A hit's half thickness is where its ray crosses the plane moved by c sigma along the normal, at most
    // the splat's own half depth and c sigma.
    let mut rng = Random::new(11);
    let (mut by_plane, mut by_cap) = (0, 0);
    for i in 0..2000 {
        let c = rng.range(0.1, 1.0);
        let options = RenderOptions { thickness: c, ..hard(4.0, 1) };
        let camera = if i % 2 == 0 { pinhole(96, 64, 90.0) } else { orthographic(96, 64, 3.0) };
        let Some((surface, splat)) = surface(&camera, &options, &mut rng) else { continue };
        let disc = truth_of(&splat);
        let sigma = splat.axes[0].cross(splat.axes[1]).length().sqrt();
        let moved = Disc { center: disc.center + splat.normal * (c * sigma), ..disc };
        let aim = rng.in_disc() * 2.0;
        let view = View::new(&camera, &options);
        let ray = sample_ray(&view, image_of(&view, disc.point(aim.x, aim.y), [0.0; 2]), [0.0; 2]);
        let Some((hit, crossing)) = disc.intersect(&ray).zip(moved.intersect(&ray)) else { continue };
        let [slope, cap] = surface.interval.map(f64::from);
        let half = (slope * hit.depth).min(cap);
        let (lo, hi) = disc.depth_extent(4.0);
        let limit = (hi - lo) / 2.0 + c * sigma;
        let truth = (crossing.depth - hit.depth).abs().min(limit);
        assert!((half / truth - 1.0).abs() <= tol::INTERVAL, "{half} {truth}");
        *(if truth < limit { &mut by_plane } else { &mut by_cap }) += 1;
    }
    assert!(by_plane > 500 && by_cap > 100, "{by_plane} {by_cap}");
}

#[test]
fn the_listing_s_interval_is_the_whole_splat() {
    let mut rng = Random::new(12);
    let RenderOptions { resolve: Resolve::Surface { coverage, .. }, .. } = hard(4.0, 1) else {
        unreachable!()
    };
    let resolve = Resolve::Surface { coverage, thickness: Thickness::WholeSplat };
    let options = RenderOptions { resolve, ..hard(4.0, 1) };
    for _ in 0..200 {
        let Some((surface, splat)) = surface(&pinhole(96, 64, 90.0), &options, &mut rng) else { continue };
        let (lo, hi) = truth_of(&splat).depth_extent(4.0);
        let [near, far] = surface.interval.map(f64::from);
        assert!((near - lo).abs() <= tol::INTERVAL * hi && (far - hi).abs() <= tol::INTERVAL * hi);
    }
}

// ---------------------------------------------------------------------------------------------------------
// Order and dropping

/// A cloud with every sort of tie: equal nearest depths, equal places, equal all but one property,
/// duplicates.
fn tied_cloud(rng: &mut Random) -> Cloud {
    let n = 60;
    let pick = |rng: &mut Random, values: &[f32]| values[rng.index(values.len())];
    let vector = |rng: &mut Random, values: &[f32]| Vec3::from_array([0; 3].map(|_| pick(rng, values)));
    Cloud {
        positions: (0..n).map(|_| Vec3::new(pick(rng, &[-0.1, 0.1]), pick(rng, &[0.0, 0.1]), 2.0)).collect(),
        normals: (0..n).map(|_| Vec3::new(0.0, pick(rng, &[0.0, -0.0]), pick(rng, &[-1.0, 1.0]))).collect(),
        shapes: Shapes::Discs((0..n).map(|_| pick(rng, &[0.1, 0.2])).collect()),
        colors: Some((0..n).map(|_| vector(rng, &[0.2, 0.9])).collect()),
        opacities: Some((0..n).map(|_| pick(rng, &[0.5, 0.6])).collect()),
        areas: Some((0..n).map(|_| pick(rng, &[0.01, 0.02])).collect()),
        oriented: true,
        ..Cloud::default()
    }
}

fn permuted(cloud: &Cloud, order: &[usize]) -> Cloud {
    fn by<T: Copy>(values: &[T], order: &[usize]) -> Vec<T> {
        order.iter().map(|&i| values[i]).collect()
    }
    let Shapes::Discs(sizes) = &cloud.shapes else { unreachable!() };
    Cloud {
        positions: by(&cloud.positions, order),
        normals: by(&cloud.normals, order),
        shapes: Shapes::Discs(by(sizes, order)),
        colors: cloud.colors.as_ref().map(|values| by(values, order)),
        opacities: cloud.opacities.as_ref().map(|values| by(values, order)),
        areas: cloud.areas.as_ref().map(|values| by(values, order)),
        texture_coordinates: cloud.texture_coordinates.as_ref().map(|values| by(values, order)),
        ..cloud.clone()
    }
}

/// All that the picture can know of the splats in their order, bit by bit.
fn data(cloud: &Cloud, set_up: &SetUp) -> Vec<String> {
    let Shapes::Discs(sizes) = &cloud.shapes else { unreachable!() };
    let line = |(splat, surface): (&VisibleSplat, &SplatSurface)| {
        let i = splat.index as usize;
        let mut same = *splat;
        same.index = 0;
        format!("{same:?} {surface:?} {:?} {:?} {}", cloud.positions[i], cloud.normals[i], sizes[i])
    };
    set_up.splats.iter().zip(&set_up.surfaces).map(line).collect()
}

#[test]
fn splat_order_does_not_depend_on_the_file_s() {
    let mut rng = Random::new(13);
    let camera = pinhole(48, 32, 60.0);
    let options = RenderOptions { samples: 2, ..RenderOptions::default() };
    let view = View::new(&camera, &options);
    for _ in 0..10 {
        let cloud = tied_cloud(&mut rng);
        let first = set_up(&cloud, &view, &options);
        assert_eq!(first.splats.len(), 60);
        let (keys, _) = sort_keys(&cloud, &view, &options, 0..60);
        assert!(keys.iter().all(|key| key.nearest() == keys[0].nearest()), "a tie");
        let truth = keys[0].nearest() - truth_of(&camera_splat(&cloud, 0, &view)).depth_extent(4.0).0;
        assert!(truth.abs() <= tol::DEPTH_EXTENT);
        let picture = render(&cloud, &camera, &options, &mut |_| {}).expect("renders").film;
        for _ in 0..5 {
            let mut order: Vec<usize> = (0..60).collect();
            for last in (1..60).rev() {
                order.swap(last, rng.index(last + 1));
            }
            let shuffled = permuted(&cloud, &order);
            assert_eq!(data(&shuffled, &set_up(&shuffled, &view, &options)), data(&cloud, &first));
            let again = render(&shuffled, &camera, &options, &mut |_| {}).expect("renders").film;
            assert_eq!(again, picture);
        }
    }
    // The comparison sees a wrong order: two splats that differ change places.
    let cloud = tied_cloud(&mut rng);
    let mut wrong = set_up(&cloud, &view, &options);
    let expected = data(&cloud, &wrong);
    let other = expected.iter().position(|line| *line != expected[0]).expect("not all are the same");
    wrong.splats.swap(0, other);
    wrong.surfaces.swap(0, other);
    assert_ne!(data(&cloud, &wrong), expected);
}

#[test]
fn splat_order_is_by_nearest_depth() {
    let mut rng = Random::new(14);
    for i in 0..20 {
        let base = if i % 2 == 0 { pinhole(1, 1, 1.0) } else { orthographic(1, 1, 1.0) };
        // What crosses an orthographic near plane may begin behind the eye: depths of both signs.
        let near = if i % 2 == 0 { 0.1 } else { 0.0 };
        let camera = wide(Camera { world_to_camera: random_camera(&mut rng), near, ..base });
        let to_world = camera.world_to_camera.inverse();
        let at = |rng: &mut Random| {
            let depth = if i % 2 == 0 { rng.range(1.0, 5.0) } else { rng.range(0.0, 0.5) };
            to_world.transform_point3(DVec3::new(rng.range(-0.5, 0.5), rng.range(-0.5, 0.5), depth))
        };
        let random: Vec<_> =
            (0..100).map(|_| (at(&mut rng), rng.direction(), rng.log_range(0.01, 0.3))).collect();
        let cloud = if i % 4 < 2 {
            discs(&random)
        } else {
            let axes = |rng: &mut Random, size| random_axes(rng, size, 10.0);
            ellipses(&random.iter().map(|&(at, _, size)| (at, axes(&mut rng, size))).collect::<Vec<_>>())
        };
        let options = hard(4.0, 1);
        let view = View::new(&camera, &options);
        let nearest: Vec<f64> = set_up(&cloud, &view, &options)
            .splats
            .iter()
            .map(|splat| truth_of(&camera_splat(&cloud, splat.index as usize, &view)).depth_extent(4.0).0)
            .collect();
        assert!(nearest.len() > 50);
        assert!(nearest.is_sorted_by(|a, b| a <= &(b + tol::DEPTH_EXTENT)), "{nearest:?}");
    }
}

#[test]
fn every_cause_of_dropping_is_counted() {
    let good = || discs(&[(DVec3::new(0.0, 0.0, 2.0), DVec3::NEG_Z, 0.1); 3]);
    let camera = pinhole(96, 64, 90.0);
    let dropped = |change: &dyn Fn(&mut Cloud)| {
        let mut cloud = good();
        change(&mut cloud);
        let options = hard(4.0, 1);
        let set_up = set_up(&cloud, &View::new(&camera, &options), &options);
        let rendered = render(&cloud, &camera, &options, &mut |_| {}).expect("bad points are no error");
        assert_eq!(rendered.statistics.dropped, set_up.dropped);
        assert_eq!(set_up.splats.len() + set_up.dropped.values().sum::<usize>(), 3, "the others stay");
        set_up.dropped.into_iter().collect::<Vec<_>>()
    };
    assert_eq!(dropped(&|_| {}), vec![]);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let not_finite = vec![("not_finite", 1)];
        assert_eq!(dropped(&|cloud| cloud.positions[1].y = bad), not_finite);
        assert_eq!(dropped(&|cloud| cloud.normals[1].z = bad), not_finite);
        assert_eq!(dropped(&|cloud| cloud.shapes = Shapes::Discs(vec![0.1, bad, 0.1])), not_finite);
        let axes = [[Vec3::X * 0.1, Vec3::Y * 0.1], [Vec3::X, Vec3::new(0.0, bad, 0.0)], [Vec3::Y, Vec3::X]];
        assert_eq!(dropped(&|cloud| cloud.shapes = Shapes::Ellipses(axes.to_vec())), not_finite);
        assert_eq!(
            dropped(&|cloud| cloud.colors = Some(vec![Vec3::ONE, Vec3::splat(bad), Vec3::ONE])),
            not_finite
        );
        assert_eq!(dropped(&|cloud| cloud.opacities = Some(vec![1.0, bad, 1.0])), not_finite);
        assert_eq!(dropped(&|cloud| cloud.areas = Some(vec![1.0, bad, 1.0])), not_finite);
        let known = TextureCoordinates::default();
        let wrong = TextureCoordinates { per_v: Vec2::new(0.0, bad), ..known };
        assert_eq!(dropped(&|cloud| cloud.texture_coordinates = Some(vec![known, wrong, known])), not_finite);
    }
    assert_eq!(dropped(&|cloud| cloud.normals[1] = Vec3::ZERO), vec![("zero_normal", 1)]);
    let parallel = [[Vec3::X * 0.1, Vec3::Y * 0.1], [Vec3::X, Vec3::X], [Vec3::Y, Vec3::X]];
    assert_eq!(
        dropped(&|cloud| cloud.shapes = Shapes::Ellipses(parallel.to_vec())),
        vec![("zero_normal", 1)]
    );
    assert_eq!(
        dropped(&|cloud| cloud.shapes = Shapes::Discs(vec![0.1, -0.1, 0.1])),
        vec![("negative_size", 1)]
    );
    assert_eq!(
        dropped(&|cloud| cloud.shapes = Shapes::Discs(vec![0.1, 0.0, -0.0])),
        vec![("unknown_size", 2)]
    );
    assert_eq!(dropped(&|cloud| cloud.normals[1] = Vec3::X), vec![("edge_on", 1)]);
}
