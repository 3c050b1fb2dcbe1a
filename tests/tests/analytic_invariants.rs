//! Pictures that must be the same by other means: crops, sample ranges, memory, orders, bad points, shifts.

use glam::{DMat4, DQuat, DVec3, Vec3};
use splat_core::film::NO_ID;
use splat_core::{AovSelection, Camera, Cloud, Lens, PixelRect, RenderOptions, Shapes, srgb};
use splat_tests::analytic::{alphas, assert_same_bits, film_bits, picture, pixels, rendered};
use splat_tests::random::Random;
use splat_tests::scenes::{self, Surfel, cloud, hard_discs, orthographic, permuted, pinhole, with_lens};
use splat_tests::tolerances as tol;

/// The golden scenes with all AOVs.
fn all_scenes() -> Vec<scenes::Scene> {
    let mut scenes = scenes::golden();
    scenes.iter_mut().for_each(|scene| scene.options.aovs = AovSelection::ALL);
    scenes
}

/// Two units in the last place of a number.
fn two_ulps(value: f32) -> f32 {
    2.0 * (value.abs().next_up() - value.abs())
}

#[test]
fn a_crop_is_a_window_of_the_whole() {
    for scene in all_scenes() {
        let whole = picture(&scene.cloud, &scene.camera, &scene.options);
        let bits = film_bits(&whole);
        for window in [
            PixelRect::new(0, 0, 64, 48),
            PixelRect::new(13, 7, 51, 40),
            PixelRect::new(31, 31, 33, 33),
            PixelRect::new(40, 20, 41, 21),
            PixelRect::new(-5, 44, 9, 99),
        ] {
            let options = RenderOptions { window: Some(window), ..scene.options.clone() };
            let crop = picture(&scene.cloud, &scene.camera, &options);
            assert_eq!(crop.window, window.intersect(&PixelRect::new(0, 0, 64, 48)));
            assert_eq!(crop.frame, [64, 48]);
            let crop_bits = film_bits(&crop);
            assert_eq!(crop_bits.len(), crop.window.area());
            for (x, y) in pixels(&crop) {
                let [part, all] = [&crop_bits[crop.index(x, y)], &bits[whole.index(x, y)]];
                assert_eq!(part, all, "{}: ({x}, {y}) of {window:?}", scene.name);
            }
        }
    }
}

#[test]
fn joined_sample_ranges_agree_with_the_whole() {
    let mut compared = 0;
    for scene in all_scenes() {
        // `over` is linearised after the mean: its films join in the display's space.
        let over = scene.options.resolve == splat_abuffer::Resolve::Over;
        let whole = picture(&scene.cloud, &scene.camera, &scene.options);
        let n = scene.options.samples;
        for cut in 1..n {
            let parts = [0..cut, cut..n].map(|range| {
                let options = RenderOptions { sample_range: Some(range), ..scene.options.clone() };
                picture(&scene.cloud, &scene.camera, &options)
            });
            let weights = [cut, n - cut].map(|count| f64::from(count) / f64::from(n));
            for (i, &expected) in whole.rgba.iter().enumerate() {
                for channel in 0..4 {
                    let value = |pixel: [f32; 4]| {
                        let [value, alpha] = [pixel[channel], pixel[3]].map(f64::from);
                        let encoded = over && channel < 3 && alpha > 0.0;
                        if encoded { srgb::encode(value / alpha) * alpha } else { value }
                    };
                    let joined: f64 =
                        parts.iter().zip(weights).map(|(film, w)| w * value(film.rgba[i])).sum();
                    let bound = if over && channel < 3 {
                        tol::DISPLAY_SPACE
                    } else {
                        f64::from(two_ulps(expected[channel]))
                    };
                    let expected = value(expected);
                    let error = (joined - expected).abs();
                    assert!(error <= bound, "{}: {joined}, not {expected}", scene.name);
                    compared += i32::from(expected > 0.0);
                }
                for (channel, parts) in [
                    (&whole.coverage, parts.each_ref().map(|film| &film.coverage)),
                    (&whole.layers, parts.each_ref().map(|film| &film.layers)),
                ] {
                    let at = |values: &Option<Vec<f32>>| values.as_ref().map_or(f32::NAN, |values| values[i]);
                    let joined: f64 = parts.iter().zip(weights).map(|(c, w)| w * f64::from(at(c))).sum();
                    let error = (joined - f64::from(at(channel))).abs();
                    assert!(error <= f64::from(two_ulps(at(channel))), "{}: {joined}", scene.name);
                }
            }
        }
    }
    assert!(compared > 100_000, "{compared}");
}

#[test]
fn a_tiny_budget_of_memory_changes_no_bit() {
    for scene in all_scenes() {
        let whole = rendered(&scene.cloud, &scene.camera, &scene.options);
        for tile_memory in [1, 20_000] {
            let options = RenderOptions { tile_memory, ..scene.options.clone() };
            let split = rendered(&scene.cloud, &scene.camera, &options);
            assert_same_bits(scene.name, &whole.film, &split.film);
            assert_eq!(whole.statistics.fragments, split.statistics.fragments, "{}", scene.name);
            assert_eq!(whole.statistics.samples, split.statistics.samples, "{}", scene.name);
            assert_eq!(whole.statistics.tests, split.statistics.tests, "{}", scene.name);
        }
    }
}

/// A random order of `count` things.
fn shuffled(count: usize, seed: u64) -> Vec<usize> {
    let mut random = Random::new(seed);
    let mut order: Vec<usize> = (0..count).collect();
    for last in (1..count).rev() {
        order.swap(last, random.index(last + 1));
    }
    order
}

#[test]
fn the_order_of_points_changes_no_bit() {
    for scene in all_scenes() {
        // Four splats that differ in colour alone: enough for the order of sums to tell.
        let order: Vec<usize> = (0..scene.cloud.len()).map(|i| if i < 4 { 0 } else { i }).collect();
        let mut cloud = permuted(&scene.cloud, &order);
        for (i, color) in cloud.colors.iter_mut().flatten().take(4).enumerate() {
            *color *= 0.7 + 0.11 * i as f32;
        }
        let film = picture(&cloud, &scene.camera, &scene.options);
        for seed in 0..3 {
            let order = shuffled(cloud.len(), seed);
            let mut other = picture(&permuted(&cloud, &order), &scene.camera, &scene.options);
            // The id is the place in the file: new point i was `order[i]`.
            for id in other.id.iter_mut().flatten().filter(|id| **id != NO_ID) {
                *id = order[*id as usize] as u32;
            }
            assert_same_bits(scene.name, &film, &other);
        }
    }
}

/// The cloud with one more point in front of all others, like the first one.
fn with_one_more(cloud: &Cloud) -> Cloud {
    let order: Vec<usize> = std::iter::once(0).chain(0..cloud.len()).collect();
    permuted(cloud, &order)
}

#[test]
fn a_bad_point_changes_nothing_but_the_count() {
    for scene in all_scenes() {
        let good = rendered(&scene.cloud, &scene.camera, &scene.options);
        assert!(good.statistics.dropped.is_empty(), "{}", scene.name);
        let mut bad = with_one_more(&scene.cloud);
        bad.positions[0].y = f32::NAN;
        let mut found = rendered(&bad, &scene.camera, &scene.options);
        assert_eq!(found.statistics.dropped.get("not_finite"), Some(&1), "{}", scene.name);
        assert_eq!(found.statistics.dropped.len(), 1);
        assert_eq!(found.statistics.drawn, good.statistics.drawn);
        for id in found.film.id.iter_mut().flatten().filter(|id| **id != NO_ID) {
            *id -= 1;
        }
        assert_same_bits(scene.name, &good.film, &found.film);
    }
}

#[test]
fn every_defect_is_counted_by_its_cause() {
    let camera = pinhole(16, 12, 12.0);
    let options = hard_discs(4);
    let good = Cloud { areas: Some(vec![1.0]), ..cloud(&[Surfel::new(DVec3::Z * 3.0, DVec3::NEG_Z, 0.5)]) };
    let ellipse = Cloud { shapes: Shapes::Ellipses(vec![[Vec3::X, Vec3::Y]]), ..good.clone() };
    let clean = picture(&good, &camera, &options);
    assert!(alphas(&clean).sum::<f64>() > 1.0);

    type Spoil = fn(&mut Cloud);
    fn size(cloud: &mut Cloud, value: f32) {
        cloud.shapes = Shapes::Discs(vec![value, 0.5]);
    }
    let spoils: &[(&str, Spoil)] = &[
        ("not_finite", |c| c.positions[0].x = f32::NAN),
        ("not_finite", |c| c.positions[0].z = f32::INFINITY),
        ("not_finite", |c| c.normals[0].y = f32::NAN),
        ("not_finite", |c| c.normals[0].z = f32::NEG_INFINITY),
        ("not_finite", |c| c.colors.as_mut().expect("there")[0].y = f32::NAN),
        ("not_finite", |c| c.colors.as_mut().expect("there")[0].z = f32::INFINITY),
        ("not_finite", |c| c.opacities.as_mut().expect("there")[0] = f32::NAN),
        ("not_finite", |c| c.areas.as_mut().expect("there")[0] = f32::INFINITY),
        ("not_finite", |c| size(c, f32::NAN)),
        ("not_finite", |c| size(c, f32::INFINITY)),
        ("zero_normal", |c| c.normals[0] = Vec3::ZERO),
        ("negative_size", |c| size(c, -0.5)),
        ("unknown_size", |c| size(c, 0.0)),
        ("edge_on", |c| c.normals[0] = Vec3::X),
    ];
    for (cause, spoil) in spoils {
        let mut bad = with_one_more(&good);
        spoil(&mut bad);
        let found = rendered(&bad, &camera, &options);
        assert_eq!(found.statistics.dropped.get(cause), Some(&1), "{cause}: {:?}", found.statistics.dropped);
        assert_eq!(found.statistics.dropped.len(), 1, "{cause}");
        assert_eq!(found.statistics.drawn, 1, "{cause}");
        assert_same_bits(cause, &clean, &found.film);
    }
    let clean = picture(&ellipse, &camera, &options);
    for (cause, axes) in [
        ("not_finite", [Vec3::new(0.0, f32::NAN, 0.0), Vec3::Y]),
        ("not_finite", [Vec3::X, Vec3::new(0.0, f32::INFINITY, 0.0)]),
        ("zero_normal", [Vec3::X, 2.0 * Vec3::X]),
        ("zero_normal", [Vec3::X, Vec3::ZERO]),
    ] {
        let bad =
            Cloud { shapes: Shapes::Ellipses(vec![axes, [Vec3::X, Vec3::Y]]), ..with_one_more(&ellipse) };
        let found = rendered(&bad, &camera, &options);
        assert_eq!(found.statistics.dropped.get(cause), Some(&1), "{axes:?}: {:?}", found.statistics.dropped);
        assert_eq!(found.statistics.dropped.len(), 1, "{axes:?}");
        assert_same_bits(cause, &clean, &found.film);
    }
    // An area that leaves no weight is no defect, and nothing to see either.
    for area in [0.0, -1.0] {
        let none = Cloud { areas: Some(vec![area]), ..good.clone() };
        let film = picture(&none, &camera, &RenderOptions::default());
        assert!(film.rgba.iter().all(|&pixel| pixel == [0.0; 4]), "{area}");
    }
}

#[test]
fn a_shifted_world_is_the_same_picture() {
    let (width, height) = (160, 120);
    let mut random = Random::new(31);
    let directions = scenes::fibonacci_sphere(3000);
    let mut surfels: Vec<Surfel> = directions
        .iter()
        .map(|&direction| {
            let color = [0; 3].map(|_| random.unit() as f32);
            Surfel::new(DVec3::new(0.1, 0.0, 3.0) + 0.8 * direction, direction, 0.035).colored(color)
        })
        .collect();
    surfels.extend((0..30).map(|_| {
        let place = DVec3::new(random.range(-1.5, 1.5), random.range(-1.2, 1.2), random.range(1.5, 5.0));
        let color = [0; 3].map(|_| random.unit() as f32);
        Surfel::new(place, random.direction(), random.range(0.02, 0.2)).colored(color).with_opacity(0.5)
    }));
    let turn = DMat4::from_rotation_translation(DQuat::from_rotation_z(0.5), DVec3::new(0.0, 0.1, 0.2));
    let lens = Lens { radius: 0.03, focus: 2.5, blades: 0 };
    for camera in [
        pinhole(width, height, 130.0),
        with_lens(pinhole(width, height, 130.0), lens),
        orthographic(width, height, 50.0),
    ] {
        let picture_at = |shift: DVec3| {
            let shifted: Vec<Surfel> =
                surfels.iter().map(|s| Surfel { position: s.position + shift, ..*s }).collect();
            let camera = Camera { world_to_camera: turn * DMat4::from_translation(-shift), ..camera.clone() };
            let options = RenderOptions { samples: 4, ..RenderOptions::default() };
            picture(&cloud(&shifted), &camera, &options)
        };
        let here = picture_at(DVec3::ZERO);
        let there = picture_at(DVec3::new(500_000.0, 5_000_000.0, 100.0));
        let shown = |pixel: [f32; 4]| {
            let [red, green, blue, alpha] = pixel.map(f64::from);
            [srgb::encode(red), srgb::encode(green), srgb::encode(blue), alpha]
        };
        let differing = here.rgba.iter().zip(&there.rgba).filter(|&(&a, &b)| {
            let pairs = shown(a).into_iter().zip(shown(b));
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) > 2.0 / 255.0
        });
        let part = differing.count() as f64 / here.rgba.len() as f64;
        assert!(part <= tol::SHIFTED_PIXELS, "{part}");
        assert!(alphas(&here).sum::<f64>() > 0.2 * here.rgba.len() as f64, "an empty picture says nothing");
    }
}
