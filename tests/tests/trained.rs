//! Trained splats in pictures: colours by the direction of view, in both cores; real files, where `SPLAT_TEST_DATA` names a
//! folder that has them.

use glam::{DMat4, DVec3, Vec3};
use splat_abuffer::Resolve;
use splat_core::fit::{Framing, Up, fence, fit};
use splat_core::harmonics::{basis, constant_term, terms};
use splat_core::{
    AovSelection, Camera, Cloud, Film, Kernel, Lens, RenderOptions, Shapes, SphericalHarmonics, srgb,
};
use splat_simd::{Level, Renderer};
use splat_tests::random::Random;
use splat_tests::scenes::{OPAQUE, Surfel, cloud, jumble, orthographic, permuted, pinhole, with_lens};
use splat_tests::tolerances as tol;
use std::path::Path;

/// As trained splats are drawn.
fn over(samples: u32) -> RenderOptions {
    RenderOptions {
        samples,
        resolve: Resolve::Over,
        kernel: Kernel::Gaussian,
        cutoff: 9.0,
        ..RenderOptions::default()
    }
}

fn rendered(cloud: &Cloud, camera: &Camera, options: &RenderOptions) -> Film {
    splat_core::render(cloud, camera, options, &mut |_| {}).unwrap().film
}

/// Random coefficients for a cloud, bright and dark ones.
fn with_harmonics(mut cloud: Cloud, degree: usize, seed: u64) -> Cloud {
    let mut random = Random::new(seed);
    let mut value = || random.range(-1.0, 1.0) as f32;
    let coefficients =
        (0..cloud.len() * terms(degree)).map(|_| Vec3::new(value(), value(), value())).collect();
    cloud.harmonics = Some(SphericalHarmonics::new(degree, coefficients).unwrap());
    cloud
}

// ---------------------------------------------------------------------------------------------------------
// The colour

#[test]
fn the_colour_is_that_of_the_direction_from_the_eye_to_the_splat() {
    let coefficients: Vec<Vec3> = (0..16).map(|k| Vec3::new(0.2, -0.1, 0.3) / (1.0 + k as f32)).collect();
    for resolve in [OPAQUE, Resolve::Over] {
        let options = RenderOptions { kernel: Kernel::Disc, cutoff: 4.0, ..over(4) };
        let options = RenderOptions { resolve, ..options };
        for place in [DVec3::new(0.5, -0.4, 3.0), DVec3::new(-0.3, 0.2, 2.0)] {
            // Far from the world's origin, as in a map; the eye at `eye`.
            let eye = DVec3::new(4e5, 5e6, -100.0);
            let mut splats = cloud(&[Surfel::new(eye + place, DVec3::new(0.1, 0.2, -1.0), 0.2)]);
            splats.harmonics = Some(SphericalHarmonics::new(3, coefficients.clone()).unwrap());
            let sum = |direction: DVec3| {
                let values = basis(direction.normalize().as_vec3());
                let sum: Vec3 = coefficients.iter().zip(values).map(|(&c, value)| c * value).sum();
                (sum + 0.5).max(Vec3::ZERO)
            };
            let cameras = [(pinhole(64, 64, 60.0), place), (orthographic(64, 64, 30.0), DVec3::Z)];
            for (mut camera, direction) in cameras {
                let at = if camera.lens().is_none() && direction == DVec3::Z {
                    place.truncate() * 30.0
                } else {
                    place.truncate() / place.z * 60.0
                } + 32.0;
                camera.world_to_camera = DMat4::from_translation(-eye);
                let film = rendered(&splats, &camera, &options);
                let pixel = film.rgba[at.y as usize * 64 + at.x as usize];
                let expected = sum(direction).to_array().map(|value| srgb::decode(value.into()) as f32);
                for (found, expected) in pixel[..3].iter().zip(expected) {
                    assert!(
                        (found - expected).abs() < tol::HARMONIC_COLOR,
                        "{resolve:?}: {pixel:?} {expected}"
                    );
                }
                assert_eq!(pixel[3], 1.0);
            }
        }
    }
}

#[test]
fn constant_harmonics_are_colours() {
    let plain = jumble(80, 0.06, 3);
    let mut trained = plain.clone();
    let term = |linear: f32| constant_term(srgb::encode(linear.into()) as f32);
    let colors = trained.colors.take().unwrap();
    let coefficients = colors.iter().map(|color| Vec3::from_array(color.to_array().map(term))).collect();
    trained.harmonics = Some(SphericalHarmonics::new(0, coefficients).unwrap());
    let camera = pinhole(48, 36, 40.0);
    for options in [over(4), RenderOptions { samples: 4, ..RenderOptions::default() }] {
        let pairs = rendered(&plain, &camera, &options)
            .rgba
            .into_iter()
            .zip(rendered(&trained, &camera, &options).rgba);
        for (plain, trained) in pairs {
            assert!(
                plain.iter().zip(trained).all(|(a, b)| (a - b).abs() < tol::HARMONIC_COLOR),
                "{plain:?} {trained:?}"
            );
        }
    }
}

#[test]
fn both_cores_have_the_same_bits() {
    let cameras = [
        pinhole(60, 44, 50.0),
        orthographic(60, 44, 20.0),
        with_lens(pinhole(60, 44, 50.0), Lens { radius: 0.05, focus: 3.0, blades: 0 }),
    ];
    for (degree, camera) in (0..=3).flat_map(|degree| cameras.iter().map(move |camera| (degree, camera))) {
        let trained = with_harmonics(jumble(80, 0.05, 7), degree, 11);
        for resolve in [Resolve::Over, OPAQUE] {
            let aovs = AovSelection { albedo: true, ..AovSelection::default() };
            let options = RenderOptions { resolve, aovs, ..over(8) };
            let reference = rendered(&trained, camera, &options);
            for level in Level::available() {
                let fast = Renderer::new(2, level).unwrap().render(&trained, camera, &options, &mut |_| {});
                let fast = fast.unwrap().film;
                let bits = |film: &Film| -> Vec<u32> {
                    let albedo = film.albedo.iter().flatten().flat_map(|color| color.to_array());
                    film.rgba.as_flattened().iter().copied().chain(albedo).map(f32::to_bits).collect()
                };
                assert!(bits(&reference) == bits(&fast), "degree {degree}, {resolve:?}, {}", level.name());
            }
        }
    }
}

#[test]
fn the_order_of_splats_that_differ_in_a_coefficient_alone_changes_nothing() {
    let surfel = Surfel::new(DVec3::new(0.0, 0.0, 2.0), DVec3::new(0.3, 0.0, -1.0), 0.3).with_opacity(0.5);
    let mut splats = cloud(&[surfel; 6]);
    splats = with_harmonics(splats, 3, 5);
    let camera = pinhole(32, 32, 40.0);
    let first = rendered(&splats, &camera, &over(4));
    for order in [[5, 4, 3, 2, 1, 0], [2, 0, 1, 5, 3, 4]] {
        assert_eq!(rendered(&permuted(&splats, &order), &camera, &over(4)).rgba, first.rgba);
    }
}

// ---------------------------------------------------------------------------------------------------------
// The fitted camera

#[test]
fn strays_do_not_make_a_scene_small() {
    let mut splats = jumble(400, 0.02, 9);
    let framing =
        Framing { width: 64, height: 64, up: Up::Y, azimuth: 30.0, elevation: 20.0, orthographic: false };
    let options = over(1);
    let eye_distance = |cloud: &Cloud| {
        let camera = fit(cloud, &framing, &options).unwrap();
        camera.eye().distance(DVec3::new(0.0, 0.0, 4.0))
    };
    splats.trained = true;
    let before = eye_distance(&splats);
    // One splat a hundred times as far as all others.
    splats.positions[0] = Vec3::new(300.0, 20.0, -100.0);
    let after = eye_distance(&splats);
    assert!((after / before - 1.0).abs() < 0.05, "{before} {after}");
    let (center, radius) = fence(&splats).unwrap();
    assert!(center.distance(DVec3::new(0.0, 0.0, 4.0)) < 1.0 && radius < 6.0, "{center} {radius}");
    splats.trained = false;
    assert!(eye_distance(&splats) > 20.0 * before, "a scan is shown whole");
    assert_eq!(fence(&Cloud::default()), None);
}

// ---------------------------------------------------------------------------------------------------------
// Real files

fn real_cloud(name: &str) -> Option<Cloud> {
    let path = Path::new(&std::env::var_os("SPLAT_TEST_DATA")?).join("splats").join(name);
    Some(splat_io::read_cloud(&path, &splat_io::CloudOptions::default()).unwrap().cloud)
}

/// The picture of Playbot, 160 x 120.
fn picture(cloud: &Cloud) -> Film {
    let framing = Framing {
        width: 160,
        height: 120,
        up: Up::MinusY,
        azimuth: 30.0,
        elevation: 20.0,
        orthographic: false,
    };
    let camera = fit(cloud, &framing, &over(8)).unwrap();
    let mut renderer = Renderer::new(0, Level::choose()).unwrap();
    renderer.render(cloud, &camera, &over(8), &mut |_| {}).unwrap().film
}

/// The root of the mean squared difference of two pictures, display-referred.
fn difference(a: &Film, b: &Film) -> f64 {
    let values = |film: &Film| -> Vec<f64> {
        let display = |pixel: &[f32; 4]| {
            let [r, g, b, a] = pixel.map(f64::from);
            [srgb::encode(r), srgb::encode(g), srgb::encode(b), a]
        };
        film.rgba.iter().flat_map(display).collect()
    };
    let (a, b) = (values(a), values(b));
    (a.iter().zip(&b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / a.len() as f64).sqrt()
}

#[test]
fn one_object_looks_the_same_in_every_format() {
    let Some(truth) = real_cloud("playbot_lod5.ply") else { return };
    let with = picture(&truth);
    let covered = with.rgba.iter().filter(|pixel| pixel[3] > 0.5).count();
    assert!((5_000..10_000).contains(&covered), "{covered} of 19200 pixels");
    // Without what depends on the view.
    let without = picture(&Cloud { harmonics: None, ..truth });
    for (name, most) in [
        ("playbot_lod5.compressed.ply", tol::PLAYBOT_COMPRESSED),
        ("playbot_lod5.spz", tol::PLAYBOT_SPZ),
        ("playbot_lod5_2dgs.ply", tol::PLAYBOT_2DGS),
        ("playbot_lod5.splat", tol::PLAYBOT_SPLAT),
    ] {
        let cloud = real_cloud(name).unwrap();
        let expected = if cloud.harmonics.is_some() { &with } else { &without };
        let difference = difference(&picture(&cloud), expected);
        assert!(difference < most, "{name}: {difference}");
        let Shapes::Ellipses(_) = cloud.shapes else { panic!("{name}") };
    }
    // The harmonics do something, or the comparison would say little.
    let harmonics = difference(&with, &without);
    assert!(harmonics > 2.0 * tol::PLAYBOT_COMPRESSED, "{harmonics}");
}
