//! Relations that hold but for rounding, or in a limit.

use glam::{DMat4, DQuat, DVec3};
use proptest::prelude::*;
use splat_abuffer::Resolve;
use splat_core::{Camera, Film, Lens, RenderOptions, srgb};
use splat_tests::analytic::{alphas, picture};
use splat_tests::cases::check;
use splat_tests::random::Random;
use splat_tests::scenes::{self, Surfel, cloud, jumble, orthographic, permuted, pinhole, soft, with_lens};
use splat_tests::tolerances as tol;
use std::collections::BTreeMap;

use crate::{random_areas, scene};

/// The greatest difference of two pictures.
fn greatest_difference(a: &Film, b: &Film) -> f64 {
    let pairs = a.rgba.iter().flatten().zip(b.rgba.iter().flatten());
    pairs.map(|(a, b)| f64::from((a - b).abs())).fold(0.0, f64::max)
}

/// A picture over a background is the picture and what it leaves of the background; in `over`, in display space.
#[test]
fn a_background_fills_what_is_left() {
    let color = (0.0f32..1.0, 0.0f32..1.0, 0.0f32..1.0, 0.0f32..1.0);
    check(24, 21, (scene(), color), |(mut scene, (red, green, blue, alpha))| {
        let over = scene.options.resolve == Resolve::Over;
        scene.options.background = Some([red, green, blue, alpha]);
        let found = picture(&scene.cloud, &scene.camera, &scene.options);
        scene.options.background = None;
        let bare = picture(&scene.cloud, &scene.camera, &scene.options);
        let blended = |pixel: [f32; 4]| {
            let [red, green, blue, alpha] = pixel.map(f64::from);
            let shown = |value: f64| if alpha > 0.0 { alpha * srgb::encode(value / alpha) } else { 0.0 };
            if over { [shown(red), shown(green), shown(blue), alpha] } else { [red, green, blue, alpha] }
        };
        let behind = blended([red * alpha, green * alpha, blue * alpha, alpha]);
        for (&bare, &found) in bare.rgba.iter().zip(&found.rgba) {
            let (bare, found) = (blended(bare), blended(found));
            for channel in 0..4 {
                let expected = bare[channel] + (1.0 - bare[3]) * behind[channel];
                let error = (found[channel] - expected).abs();
                assert!(error <= if over { tol::DISPLAY_SPACE } else { tol::BACKGROUND }, "{error}");
            }
        }
    });
}

/// Some splats are each replaced by two of half the area at the same place: the same weight in the same layer.
#[test]
fn splats_split_into_two_of_half_the_area() {
    check(24, 22, (scene(), any::<u64>(), 1usize..4), |(mut scene, seed, every)| {
        // Coverage is continuous: a rounding is no jump.
        scene.options.resolve = soft(1.0);
        scene.options.background = None;
        scene.cloud.areas = Some(random_areas(&scene.cloud, seed));
        let whole = picture(&scene.cloud, &scene.camera, &scene.options);
        let halved = |i: &usize| i.is_multiple_of(every);
        let count = scene.cloud.len();
        let order: Vec<usize> = (0..count).chain((0..count).filter(halved)).collect();
        let mut split = permuted(&scene.cloud, &order);
        for (area, i) in split.areas.iter_mut().flatten().zip(&order) {
            *area *= if halved(i) { 0.5 } else { 1.0 };
        }
        let mut fragments = BTreeMap::<_, usize>::new();
        splat_core::fragments(&split, &scene.camera, &scene.options, &mut |place, _, _| {
            *fragments.entry((place.x, place.y, place.sample)).or_default() += 1;
        })
        .unwrap();
        let most = fragments.into_values().max().unwrap_or(0);
        assert!(most > 1, "nothing to see");
        let error = greatest_difference(&whole, &picture(&split, &scene.camera, &scene.options));
        assert!(error <= f64::from(tol::resolve_rounding(most)), "{error} of {most} fragments");
    });
}

/// As the aperture closes, a lens tends to the pinhole: differences fall with its radius.
#[test]
fn an_aperture_that_closes() {
    for seed in 0..3 {
        let cloud = jumble(60, 0.06, seed);
        let options = RenderOptions { samples: 8, resolve: soft(1.0), ..RenderOptions::default() };
        let sharp = pinhole(48, 36, 40.0);
        let limit = picture(&cloud, &sharp, &options);
        let difference = |radius: f64| {
            let camera = with_lens(sharp.clone(), Lens { radius, focus: 3.0, blades: 0 });
            let film = picture(&cloud, &camera, &options);
            let pairs = film.rgba.iter().flatten().zip(limit.rgba.iter().flatten());
            pairs.map(|(a, b)| f64::from((a - b).abs())).sum::<f64>() / limit.rgba.len() as f64
        };
        let [wide, middle, narrow] = [0.08, 0.01, 0.00125].map(difference);
        assert!(wide > 0.01, "{wide}");
        assert!(middle <= tol::CLOSING * wide && narrow <= tol::CLOSING * middle, "{wide} {middle} {narrow}");
        let closed = difference(1e-9);
        println!("{wide:.4}, {:.3} of it, {:.3} of that; {closed:.1e}", middle / wide, narrow / middle);
        assert!(closed <= tol::CLOSED, "{closed}");
    }
}

/// World and camera move by any distance, millions of units: only samples on the very edge of a splat may change.
#[test]
fn a_world_shifted_anywhere() {
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
