//! Relations that hold to the bit.

use glam::{BVec3, DMat3, DMat4, DVec3, DVec4, Vec3, Vec3Swizzles};
use proptest::prelude::*;
use splat_abuffer::Resolve;
use splat_core::film::NO_ID;
use splat_core::{AovSelection, Camera, Cloud, Film, Lens, PixelRect, Projection, RenderOptions, Shapes};
use splat_tests::analytic::{assert_same_bits, picture, rendered};
use splat_tests::cases::check;
use splat_tests::random::Random;
use splat_tests::scenes::{OPAQUE, Scene, Surfel, cloud, permuted, pinhole, with_lens};

use crate::scene;

/// Cases of each relation.
const CASES: u32 = 24;

fn draw(scene: &Scene) -> Film {
    picture(&scene.cloud, &scene.camera, &scene.options)
}

/// Applies a function to every number of a film's channel, if it is there.
fn each<T>(channel: &mut Option<Vec<T>>, change: impl FnMut(&mut T)) {
    channel.iter_mut().flatten().for_each(change);
}

/// The axes of a cloud of ellipses.
fn axes(cloud: &mut Cloud) -> &mut Vec<[Vec3; 2]> {
    match &mut cloud.shapes {
        Shapes::Ellipses(axes) => axes,
        Shapes::Discs(_) => panic!("ellipses"),
    }
}

/// The lens of a camera, to be changed.
fn lens(camera: &mut Camera) -> Option<&mut Lens> {
    match &mut camera.projection {
        Projection::Perspective { lens, .. } => lens.as_mut(),
        Projection::Orthographic { .. } => None,
    }
}

/// The camera with other units of length: `factor` times as many of them. A power of two is exact.
fn in_units(camera: &Camera, factor: f64) -> Camera {
    let mut camera = Camera { near: camera.near * factor, far: camera.far * factor, ..camera.clone() };
    if let Some(lens) = lens(&mut camera) {
        (lens.radius, lens.focus) = (lens.radius * factor, lens.focus * factor);
    }
    if let Projection::Orthographic { pixels_per_unit } = &mut camera.projection {
        *pixels_per_unit /= factor;
    }
    camera
}

fn power_of_two(exponent: i32) -> f64 {
    libm::exp2(f64::from(exponent))
}

/// The cloud with those of another after its own; so the ids remain.
fn with_more(cloud: &Cloud, more: &Cloud) -> Cloud {
    let mut all = cloud.clone();
    all.positions.extend(&more.positions);
    all.normals.extend(&more.normals);
    let Shapes::Ellipses(others) = &more.shapes else { panic!("ellipses") };
    axes(&mut all).extend(others);
    let add = |to: &mut Option<Vec<f32>>, from: &Option<Vec<f32>>| {
        if let Some(to) = to {
            to.extend(from.clone().unwrap_or_else(|| vec![1.0; more.len()]));
        }
    };
    add(&mut all.opacities, &more.opacities);
    add(&mut all.areas, &more.areas);
    all.colors.as_mut().unwrap().extend(more.colors.as_ref().unwrap());
    all
}

/// Camera, cloud and origin move by a power of two along an axis: what set-up sees is origin minus eye, the same number.
#[test]
fn a_world_shifted_by_a_power_of_two() {
    check(CASES, 1, (scene(), 0i32..30, 0usize..3), |(mut scene, exponent, axis)| {
        // The position's f64 sums are rounded where they are.
        scene.options.aovs.position = false;
        let here = draw(&scene);
        let shift = DVec3::AXES[axis] * power_of_two(exponent);
        scene.cloud.origin += shift;
        scene.camera.world_to_camera *= DMat4::from_translation(-shift);
        let there = draw(&scene);
        assert_same_bits("shifted", &here, &Film { position_origin: here.position_origin, ..there });
    });
}

/// Scene and camera grow by a power of two: every length is multiplied exactly, every quotient of two stays.
#[test]
fn a_scene_and_camera_of_another_size() {
    check(CASES, 2, (scene(), -12i32..13), |(scene, exponent)| {
        let small = draw(&scene);
        let factor = power_of_two(exponent);
        let mut large = scene.clone();
        large.camera = in_units(&scene.camera, factor);
        large.camera.world_to_camera.w_axis = (scene.camera.world_to_camera.w_axis * factor).with_w(1.0);
        let f = factor as f32;
        large.cloud.positions.iter_mut().for_each(|position| *position *= f);
        axes(&mut large.cloud).iter_mut().flatten().for_each(|axis| *axis *= f);
        each(&mut large.cloud.areas, |area| *area *= f * f);
        let mut film = draw(&large);
        each(&mut film.depth, |depth| *depth /= f);
        each(&mut film.position, |position| *position /= f);
        assert_same_bits("another size", &small, &film);
    });
}

/// The camera's own units are others than the scene's: `world_to_camera` carries the scale.
#[test]
fn camera_units_of_another_size() {
    check(CASES, 3, (scene(), -12i32..13), |(scene, exponent)| {
        let factor = power_of_two(exponent);
        let scale = DMat4::from_scale(DVec3::splat(factor));
        let mut other = Scene { camera: in_units(&scene.camera, factor), ..scene.clone() };
        other.camera.world_to_camera = scale * scene.camera.world_to_camera;
        let mut film = draw(&other);
        each(&mut film.depth, |depth| *depth /= factor as f32);
        assert_same_bits("other units", &draw(&scene), &film);
    });
}

/// The 24 turns that bring axes to axes.
fn quarter_turns() -> impl Strategy<Value = DMat3> {
    (0usize..6, any::<[bool; 3]>()).prop_map(|(order, signs)| {
        let order = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]][order];
        let sign = DVec3::select(BVec3::from_array(signs), DVec3::NEG_ONE, DVec3::ONE);
        let turn = DMat3::from_cols(
            sign.x * DVec3::AXES[order[0]],
            sign.y * DVec3::AXES[order[1]],
            sign.z * DVec3::AXES[order[2]],
        );
        // Not a mirror.
        turn * turn.determinant()
    })
}

/// World and camera are turned by quarters: sums of products of which two are zero are exact in any order.
#[test]
fn a_world_turned_by_quarters() {
    check(CASES, 4, (scene(), quarter_turns()), |(scene, turn)| {
        let turned = |v: Vec3| (turn * v.as_dvec3()).as_vec3();
        let mut other = scene.clone();
        other.cloud.positions.iter_mut().for_each(|position| *position = turned(*position));
        other.cloud.normals.iter_mut().for_each(|normal| *normal = turned(*normal));
        axes(&mut other.cloud).iter_mut().flatten().for_each(|axis| *axis = turned(*axis));
        other.camera.world_to_camera *= DMat4::from_mat3(turn.transpose());
        // Zeros may change their sign in a turn.
        let unsigned = |film: &mut Film, back: &dyn Fn(Vec3) -> Vec3| {
            each(&mut film.normal, |normal| *normal = back(*normal) + Vec3::ZERO);
            each(&mut film.position, |position| *position = back(*position) + Vec3::ZERO);
        };
        let (mut here, mut there) = (draw(&scene), draw(&other));
        unsigned(&mut here, &|v| v);
        unsigned(&mut there, &|v| (turn.transpose() * v.as_dvec3()).as_vec3());
        assert_same_bits("turned", &here, &there);
    });
}

/// Without an outside a splat has no sides, and a splat is the same point for point if both axes are negated.
#[test]
fn splats_without_an_outside_turned_over() {
    check(CASES, 5, (scene(), any::<u64>()), |(mut scene, seed)| {
        scene.cloud.oriented = false;
        let film = draw(&scene);
        let mut random = Random::new(seed);
        scene.cloud.normals.iter_mut().for_each(|n| *n *= [1.0, -1.0][random.index(2)]);
        axes(&mut scene.cloud).iter_mut().for_each(|[t1, t2]| {
            let sign = [1.0, -1.0][random.index(2)];
            (*t1, *t2) = (*t1 * sign, *t2 * sign);
        });
        assert_same_bits("turned over", &film, &draw(&scene));
    });
}

/// Colours are three pictures that know nothing of each other.
#[test]
fn exchanged_color_channels() {
    check(CASES, 6, scene(), |mut scene| {
        let mut film = draw(&scene);
        scene.cloud.colors.iter_mut().flatten().for_each(|color| *color = color.zxy());
        if let Some([red, green, blue, alpha]) = scene.options.background {
            scene.options.background = Some([blue, red, green, alpha]);
        }
        film.rgba.iter_mut().for_each(|[red, green, blue, _]| (*red, *green, *blue) = (*blue, *red, *green));
        each(&mut film.albedo, |color| *color = color.zxy());
        each(&mut film.variance, |color| *color = color.zxy());
        assert_same_bits("exchanged", &film, &draw(&scene));
    });
}

/// Light is linear: colours multiplied by a power of two are so in the picture. (`over` blends in display space.)
#[test]
fn brighter_colors() {
    let surfaces = scene().prop_filter("linear", |scene| scene.options.resolve != Resolve::Over);
    check(CASES, 7, (surfaces, -8i32..9), |(mut scene, exponent)| {
        let mut film = draw(&scene);
        let factor = power_of_two(exponent) as f32;
        scene.cloud.colors.iter_mut().flatten().for_each(|color| *color *= factor);
        scene
            .options
            .background
            .iter_mut()
            .for_each(|color| color[..3].iter_mut().for_each(|c| *c *= factor));
        film.rgba.iter_mut().for_each(|pixel| pixel[..3].iter_mut().for_each(|value| *value *= factor));
        each(&mut film.albedo, |color| *color *= factor);
        each(&mut film.variance, |color| *color *= factor * factor);
        assert_same_bits("brighter", &film, &draw(&scene));
    });
}

/// What is behind the eye, before the near plane, or beside the frame is not there. Nor is what no light shows: splats of no
/// opacity, which `over` passes by, and `surface` where they are layers of their own.
#[test]
fn splats_that_cannot_be_seen() {
    check(CASES, 8, (scene(), 1usize..20, any::<u64>()), |(mut scene, count, seed)| {
        let mut random = Random::new(seed);
        let mut more = permuted(&scene.cloud, &vec![0; count]);
        // As large as the sigma of a pixel at depth 1.
        axes(&mut more).fill([Vec3::X / 40.0, Vec3::Y / 40.0]);
        more.normals.fill(Vec3::NEG_Z);
        for place in &mut more.positions {
            let [x, y] = [random.range(-0.4, 0.4), random.range(-0.3, 0.3)];
            let at = match random.index(3) {
                0 => DVec3::new(x, y, -random.range(1.0, 9.0)),
                1 => DVec3::new(x, y, 0.5 * scene.camera.near - 1e-3),
                // Twice as far aside as the frame, and farther than any blur.
                _ => DVec3::new(30.0, -20.0, random.range(1.0, 5.0)),
            };
            *place = (at + crate::EYE).as_vec3();
        }
        let (found, expected) = (
            rendered(&with_more(&scene.cloud, &more), &scene.camera, &scene.options),
            rendered(&scene.cloud, &scene.camera, &scene.options),
        );
        assert_same_bits("not in view", &expected.film, &found.film);
        assert_eq!(found.statistics.drawn, expected.statistics.drawn);

        // Before all others by more than any interval is long.
        more.opacities = Some(vec![0.0; count]);
        axes(&mut more).iter_mut().flatten().for_each(|axis| *axis *= 0.1);
        let opacities = vec![1.0; scene.cloud.len()];
        scene.cloud.opacities.get_or_insert(opacities);
        for place in &mut more.positions {
            let at =
                DVec3::new(random.range(-0.04, 0.04), random.range(-0.04, 0.04), random.range(0.1, 0.15));
            *place = (at + crate::EYE).as_vec3();
        }
        if scene.options.resolve != Resolve::Over {
            // They are layers that cover, and the first that is hit.
            scene.options.aovs = AovSelection { variance: true, ..AovSelection::default() };
        }
        let with = Scene { cloud: with_more(&scene.cloud, &more), ..scene.clone() };
        assert_same_bits("clear", &draw(&scene), &draw(&with));
    });
}

/// Planes that cut nothing.
#[test]
fn planes_beyond_all_splats() {
    check(CASES, 9, (scene(), 0.01..0.3, 40.0..1e6), |(mut scene, near, far)| {
        let film = draw(&scene);
        (scene.camera.near, scene.camera.far) = (near, far);
        scene.camera.clip_planes = vec![DVec4::Z];
        assert_same_bits("planes", &film, &draw(&scene));
    });
}

/// What lies in the plane of focus, parallel to it, is as a pinhole shows it.
#[test]
fn splats_in_focus() {
    let case = (any::<u64>(), 1.0..8.0f64, 0.01..1.0f64, 1u32..9);
    check(CASES, 10, case, |(seed, depth, radius, samples)| {
        // Coordinates in f32, so that they are in the plane.
        let depth = f64::from(depth as f32);
        let mut random = Random::new(seed);
        let surfels: Vec<Surfel> = (0..30)
            .map(|_| {
                let place = DVec3::new(random.range(-0.6, 0.6), random.range(-0.4, 0.4), 1.0) * depth;
                let color = [0; 3].map(|_| random.unit() as f32);
                Surfel::new(place, DVec3::NEG_Z, 0.05 * depth).colored(color)
            })
            .collect();
        let options = RenderOptions { samples, resolve: OPAQUE, ..RenderOptions::default() };
        let sharp = pinhole(48, 36, 40.0);
        let focused = with_lens(sharp.clone(), Lens { radius, focus: depth, blades: 0 });
        let cloud = cloud(&surfels);
        let [sharp, focused] = [sharp, focused].map(|camera| picture(&cloud, &camera, &options));
        assert!(sharp.rgba.iter().any(|pixel| pixel[3] > 0.0), "an empty picture says nothing");
        assert_same_bits("in focus", &sharp, &focused);
    });
}

/// A principal point moved by whole tiles of the sample tables, 32 pixels, moves the picture so far. (Places in pixels are
/// rounded otherwise elsewhere, in f64: that one in 2^29 of them could differ in f32 is left to chance.)
#[test]
fn a_principal_point_moved_by_the_tables_period() {
    check(CASES, 11, (scene(), -1i32..2, -1i32..2), |(mut scene, x, y)| {
        (scene.camera.width, scene.camera.height) = (96, 96);
        // Positions are sums with those of pixels, which are rounded otherwise.
        scene.options.aovs.position = false;
        let film = draw(&scene);
        scene.camera.principal_point += 32.0 * DVec3::new(f64::from(x), f64::from(y), 0.0).truncate();
        let moved = draw(&scene);
        let shift = |rect: PixelRect, sign: i32| {
            let [x, y] = [32 * sign * x, 32 * sign * y];
            PixelRect::new(rect.x0 + x, rect.y0 + y, rect.x1 + x, rect.y1 + y)
        };
        // What both pictures show.
        let window = film.window.intersect(&shift(film.window, -1));
        let moved = Film { window, ..moved.part(shift(window, 1)) };
        assert_same_bits("moved", &film.part(window), &moved);
    });
}

/// A part of the picture.
#[test]
fn a_crop() {
    let corner = (-9i32..48, -9i32..36);
    check(CASES, 12, (scene(), corner, 1i32..50, 1i32..40), |(mut scene, (x, y), width, height)| {
        let whole = draw(&scene);
        let window = PixelRect::new(x, y, x + width, y + height);
        let inside = window.intersect(&whole.window);
        scene.options.window = Some(window);
        if inside.is_empty() {
            assert!(splat_core::render(&scene.cloud, &scene.camera, &scene.options, &mut |_| {}).is_err());
            return;
        }
        let crop = draw(&scene);
        assert_eq!((crop.window, crop.frame), (inside, whole.frame));
        assert_same_bits("crop", &whole.part(inside), &crop);
    });
}

/// Puts the ids back that splats had before they were put into this order.
fn put_back_ids(film: &mut Film, order: &[usize]) {
    each(&mut film.id, |id| {
        if *id != NO_ID {
            *id = order[*id as usize] as u32;
        }
    });
}

/// Points in another order; some of them differ in their colour alone, enough for the order of sums to tell.
#[test]
fn points_in_another_order() {
    check(CASES, 13, (scene(), any::<u64>()), |(mut scene, seed)| {
        let order: Vec<usize> = (0..scene.cloud.len()).map(|i| if i < 4 { 0 } else { i }).collect();
        scene.cloud = permuted(&scene.cloud, &order);
        for (i, color) in scene.cloud.colors.iter_mut().flatten().take(4).enumerate() {
            *color *= 0.7 + 0.11 * i as f32;
        }
        let film = draw(&scene);
        let mut order: Vec<usize> = (0..scene.cloud.len()).collect();
        Random::new(seed).shuffle(&mut order);
        scene.cloud = permuted(&scene.cloud, &order);
        let mut other = draw(&scene);
        put_back_ids(&mut other, &order);
        assert_same_bits("another order", &film, &other);
    });
}

/// One more point that is not a number, anywhere, changes nothing but the count.
#[test]
fn one_bad_point() {
    let bad = prop_oneof![Just(f32::NAN), Just(f32::INFINITY), Just(f32::NEG_INFINITY)];
    check(CASES, 14, (scene(), any::<prop::sample::Index>(), 0usize..4, bad), |(scene, at, what, bad)| {
        let good = rendered(&scene.cloud, &scene.camera, &scene.options);
        assert!(good.statistics.dropped.is_empty());
        let at = at.index(scene.cloud.len() + 1);
        let mut order: Vec<usize> = (0..scene.cloud.len()).collect();
        order.insert(at, 0);
        let mut cloud = permuted(&scene.cloud, &order);
        match what {
            0 => cloud.positions[at].y = bad,
            1 => cloud.normals[at].x = bad,
            2 => axes(&mut cloud)[at][1].z = bad,
            _ => cloud.colors.as_mut().unwrap()[at].x = bad,
        }
        let mut found = rendered(&cloud, &scene.camera, &scene.options);
        assert_eq!(found.statistics.dropped.get("not_finite"), Some(&1));
        assert_eq!(found.statistics.dropped.len(), 1);
        assert_eq!(found.statistics.drawn, good.statistics.drawn);
        put_back_ids(&mut found.film, &order);
        assert_same_bits("a bad point", &good.film, &found.film);
    });
}
