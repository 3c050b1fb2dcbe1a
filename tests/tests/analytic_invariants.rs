//! Pictures that must be the same by other means: sample ranges, memory, splats with defects. See `metamorphic` for others.

use glam::{DVec3, Vec3};
use splat_core::{AovSelection, Cloud, RenderOptions, Shapes, srgb};
use splat_tests::analytic::{alphas, assert_same_bits, picture, rendered};
use splat_tests::scenes::{self, Surfel, cloud, hard_discs, permuted, pinhole};
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

/// The cloud with one more point in front of all others, like the first one.
fn with_one_more(cloud: &Cloud) -> Cloud {
    let order: Vec<usize> = std::iter::once(0).chain(0..cloud.len()).collect();
    permuted(cloud, &order)
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
