//! Texture functions: band limiting against means of many samples, and noise.

use glam::{DVec2, DVec3, Vec2};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use splat_core::texture::function::{NOISE_CYCLES, clamped_spectrum, gradient_noise, supersample};
use splat_core::texture::{Checkerboard, Fbm, Footprint, SpacePoint, TextureFunction, ZonePlate};
use splat_tests::random::Random;
use splat_tests::textures::{any_f64, any_vector, vector};
use splat_tests::tolerances as tol;
use std::f64::consts::{PI, TAU};

const CHECKS: Checkerboard = Checkerboard { values: [1.0, 0.0] };
const FBM: Fbm = Fbm { octaves: 6, lacunarity: 2.0, gain: 0.5, seed: 7 };

/// The mean over the box [-half, half] around a point of the plane by 64 x 64 midpoints.
fn mean_over_box(function: &impl TextureFunction, center: DVec2, half: DVec2) -> f64 {
    let place = |i: u32| (f64::from(i) + 0.5) / 32.0 - 1.0;
    let sum: f64 = (0..4096)
        .map(|i| function.value((center + half * DVec2::new(place(i % 64), place(i / 64))).extend(0.0)))
        .sum();
    sum / 4096.0
}

/// The mean over the ellipse of a footprint by 4096 points of a Fibonacci spiral.
fn mean_over_ellipse(function: &impl TextureFunction, at: &SpacePoint) -> f64 {
    let sum: f64 = (0..4096)
        .map(|i| {
            let radius = ((f64::from(i) + 0.5) / 4096.0).sqrt();
            let angle = f64::from(i) * TAU * 0.618_033_988_749_894_9;
            function.value(at.point + radius * (libm::cos(angle) * at.dx + libm::sin(angle) * at.dy))
        })
        .sum();
    sum / 4096.0
}

/// The share of a wave of `cycles` from the centre to the rim of a disc that its mean over the disc keeps: 2
/// J1(w)/w.
fn transfer(cycles: f64) -> f64 {
    let w = TAU * cycles;
    if w == 0.0 { 1.0 } else { 2.0 * libm::j1(w) / w }
}

/// A point of the plane with the box [-half, half] as its footprint's.
fn boxed(center: DVec2, half: DVec2) -> SpacePoint {
    SpacePoint {
        point: center.extend(0.0),
        dx: DVec3::new(half.x, 0.0, 0.0),
        dy: DVec3::new(0.0, half.y, 0.0),
    }
}

#[test]
fn checks_are_the_exact_mean_over_a_box() {
    let mut rng = Random::new(1);
    for half in [0.25, 0.5, 1.0, 2.0] {
        for _ in 0..20 {
            // Edges between the midpoints of the samples, which then are exact.
            let place = |rng: &mut Random| (rng.index(512) as f64 - 256.0) * half / 32.0;
            let center = DVec2::new(place(&mut rng), place(&mut rng));
            let found = CHECKS.filtered(&boxed(center, DVec2::splat(half)));
            let truth = mean_over_box(&CHECKS, center, DVec2::splat(half));
            assert!((found - truth).abs() <= tol::EXACT, "{found} {truth} at {center} +- {half}");
        }
    }
    // Anywhere: each edge misplaces up to half a sample.
    let mut squares = 0.0;
    for _ in 0..300 {
        let center = vector(&mut rng, 5.0).truncate();
        let half = DVec2::new(rng.log_range(0.01, 1.5), rng.log_range(0.01, 1.5));
        let error = CHECKS.filtered(&boxed(center, half)) - mean_over_box(&CHECKS, center, half);
        assert!(error.abs() <= tol::CHECKS_BY_4096, "{error}");
        squares += error * error;
    }
    let rms = (squares / 300.0_f64).sqrt();
    assert!(rms <= tol::CHECKS_BY_4096_RMS, "{rms:e}");
}

#[test]
fn checks_of_a_footprint_are_those_of_its_box() {
    let footprint = Footprint::new(Vec2::new(0.3, 0.4), Vec2::new(-0.4, 0.3));
    let center = DVec2::new(0.3, 0.7);
    let found = CHECKS.filtered(&SpacePoint::in_plane(center, &footprint));
    let truth = CHECKS.filtered(&boxed(center, footprint.half_box()));
    assert!((found - truth).abs() <= tol::EXACT);
    assert!((found - mean_over_box(&CHECKS, center, footprint.half_box())).abs() <= tol::CHECKS_BY_4096);
}

#[test]
fn checks_near_and_far() {
    let at = |x, y, z| CHECKS.value(DVec3::new(x, y, z));
    assert_eq!(
        [at(0.5, 0.5, 0.0), at(1.5, 0.5, 0.0), at(-0.5, -0.5, 0.0), at(-0.5, 0.5, 0.5)],
        [1.0, 0.0, 1.0, 0.0]
    );
    assert_eq!([at(0.5, 0.5, 1.5), at(0.0, 1.0, 0.0), at(2.0, 0.0, 0.0)], [0.0, 0.0, 1.0]);
    // The values of whoever asks.
    assert_eq!(Checkerboard { values: [3.0, 5.0] }.value(DVec3::new(1.5, 0.5, 0.0)), 5.0);
    // An edge in the middle of however small a box: half of each.
    for half in [1e-300, 1e-16, 1e-9, 0.5, 1.0, 1e9, 1e300] {
        let found = CHECKS.filtered(&boxed(DVec2::new(3.0, 0.25), DVec2::new(half, 0.0)));
        assert_eq!(found, 0.5, "{half:e}");
    }
    // A quarter to the left, three to the right.
    let found = CHECKS.filtered(&boxed(DVec2::new(1.0 + 1e-9, 0.5), DVec2::new(2e-9, 0.0)));
    assert!((found - 0.25).abs() < 1e-6, "{found}");
    // As wide as whole periods: the mean.
    assert_eq!(CHECKS.filtered(&boxed(DVec2::new(0.3, 0.3), DVec2::new(1.0, 0.0))), 0.5);
    assert!((CHECKS.filtered(&boxed(DVec2::new(0.3, 0.3), DVec2::splat(1e6 + 0.25))) - 0.5).abs() < 1e-9);
}

#[test]
fn the_spectrum_is_clamped_at_the_nyquist_limit() {
    assert_eq!([0.0, 0.2, 0.25].map(clamped_spectrum), [1.0; 3]);
    assert_eq!([0.5, 0.6, 1e30, f64::INFINITY, f64::NAN].map(clamped_spectrum), [0.0; 5]);
    // Falling, without jumps.
    let values: Vec<f64> = (0..=1000).map(|i| clamped_spectrum(f64::from(i) / 1000.0)).collect();
    assert!(values.windows(2).all(|pair| pair[0] >= pair[1] && pair[0] - pair[1] < 0.0062));
    // From the mean over the ellipse it differs by at most this.
    let worst = (0..4000)
        .map(|i| f64::from(i) / 1000.0)
        .map(|c| (clamped_spectrum(c) - transfer(c)).abs())
        .fold(0.0, f64::max);
    assert!(worst <= tol::CLAMPING, "{worst}");
}

/// The root mean squares of the differences of the filtered function, and of its bare value, from the mean
/// over the ellipse.
fn errors(function: &impl TextureFunction, lookups: &[SpacePoint]) -> [f64; 2] {
    let mut squares = [0.0; 2];
    for at in lookups {
        let truth = mean_over_ellipse(function, at);
        for (sum, value) in squares.iter_mut().zip([function.filtered(at), function.value(at.point)]) {
            *sum += (value - truth) * (value - truth);
        }
    }
    squares.map(|sum| (sum / lookups.len() as f64).sqrt())
}

#[test]
fn the_zone_plate_fades_to_its_mean() {
    let plate = ZonePlate { cycles: 4.0 };
    let mut rng = Random::new(2);
    let mut lookups = |least: f64, greatest: f64| -> Vec<SpacePoint> {
        (0..200)
            .map(|_| {
                let r = rng.range(least, greatest);
                let angle = rng.range(0.0, TAU);
                let st = r * DVec2::new(libm::cos(angle), libm::sin(angle));
                SpacePoint::in_plane(st, &Footprint::new(Vec2::new(0.01, 0.004), Vec2::new(-0.003, 0.008)))
            })
            .collect()
    };
    // 4 r cycles a unit, .0133 the longer axis: all below 1/4 a pixel up to r = 4.5, none from r = 14 on.
    let [near, bare_near] = errors(&plate, &lookups(0.0, 2.0));
    let [middle, bare_middle] = errors(&plate, &lookups(4.0, 14.0));
    let [far, bare_far] = errors(&plate, &lookups(16.0, 60.0));
    assert!(near == bare_near && near <= 0.5 * tol::CLAMPING);
    assert!(middle <= 0.5 * tol::CLAMPING && middle < bare_middle);
    assert!(far <= 0.05 && bare_far > 0.3, "{far} {bare_far}");
    // Beyond, exactly the mean; in the middle of the plate, too, where a pixel holds many rings.
    for at in lookups(40.0, 60.0) {
        assert_eq!(plate.filtered(&at), 0.5);
    }
    assert_eq!(plate.filtered(&boxed(DVec2::ZERO, DVec2::ONE)), 0.5);
    assert_eq!(plate.value(DVec3::ZERO), 1.0);
    assert!((plate.value(DVec3::new(0.5, 0.0, 0.0)) - 0.0 - 0.5 * (1.0 + libm::cos(PI))).abs() <= tol::EXACT);
}

#[test]
fn noise_loses_the_octaves_that_a_pixel_cannot_show() {
    let mut rng = Random::new(3);
    let mut lookups = |size: f64| -> Vec<SpacePoint> {
        (0..150)
            .map(|_| {
                let a = size * rng.direction();
                let dy = a.cross(rng.direction()).normalize() * size;
                SpacePoint { point: vector(&mut rng, 20.0), dx: a, dy }
            })
            .collect()
    };
    for (size, gain) in [(1.0 / 16.0, 1.15), (1.0 / 8.0, 1.2), (0.5, 1.4), (4.0, 8.0)] {
        let [clamped, bare] = errors(&FBM, &lookups(size));
        assert!(clamped * gain <= bare, "size {size}: {clamped} {bare}");
    }
    for at in lookups(1.01) {
        assert_eq!(FBM.filtered(&at), 0.0, "the mean");
    }
    // A pixel of less than half of the finest lattice's unit: all of it. More than all of that: nothing of
    // the finest.
    for at in lookups(0.99 / 64.0) {
        assert_eq!(FBM.filtered(&at), FBM.value(at.point));
    }
    let coarse = Fbm { octaves: 3, ..FBM };
    let whole = Fbm { octaves: 4, ..FBM };
    for at in lookups(1.01 / 8.0) {
        assert_eq!(whole.filtered(&at), coarse.filtered(&at));
        assert_ne!(whole.filtered(&at), whole.value(at.point));
    }
}

#[test]
fn noise_is_where_its_spectrum_is_said_to_be() {
    // The share of the noise that its mean over a disc keeps: least squares.
    let mut rng = Random::new(6);
    let noise = Fbm { octaves: 1, ..FBM };
    for (radius, quoted) in [(0.5, 0.67), (0.75, 0.41), (1.0, 0.23)] {
        let (mut product, mut square) = (0.0, 0.0);
        for _ in 0..1000 {
            let dx = radius * rng.direction();
            let dy = dx.cross(rng.direction()).normalize() * radius;
            let at = SpacePoint { point: vector(&mut rng, 100.0), dx, dy };
            let value = noise.value(at.point);
            product += value * supersample(|p| noise.value(p), &at, 12);
            square += value * value;
        }
        let share = product / square;
        assert!((share - quoted).abs() <= tol::NOISE_SHARE, "{share} at {radius}");
        assert!((share - transfer(NOISE_CYCLES * radius)).abs() <= 0.05 + tol::NOISE_SHARE);
    }
}

#[test]
fn noise_is_gradient_noise() {
    let mut rng = Random::new(4);
    let (mut sum, mut squares, mut most) = (0.0, 0.0, 0.0_f64);
    for _ in 0..100_000 {
        let p = vector(&mut rng, 1000.0);
        let value = gradient_noise(p, 1);
        (sum, squares, most) = (sum + value, squares + value * value, most.max(value.abs()));
    }
    // Its variance is below .1, so 1e5 values know the mean to 1e-3.
    assert!((sum / 1e5_f64).abs() < 4e-3 && most <= 1.04 && most > 0.7);
    for _ in 0..100 {
        // Zero on the lattice, and without jumps across the faces of its cells.
        let p = vector(&mut rng, 100.0);
        assert_eq!(gradient_noise(p.floor(), 3), 0.0);
        let face = DVec3::new(p.x.floor(), p.y, p.z);
        let [before, after] = [-1e-9, 1e-9].map(|h| gradient_noise(face + h * DVec3::X, 3));
        assert!((before - after).abs() < 1e-8);
    }
    // Another seed, another noise; lattices repeat in no direction that one would notice.
    let p = DVec3::new(0.3, 0.4, 0.6);
    let values: std::collections::BTreeSet<u64> =
        (0..20).map(|i| gradient_noise(p + DVec3::new(f64::from(i), 0.0, 0.0), 0).to_bits()).collect();
    assert!(values.len() > 8);
    assert!((0..20).any(|seed| gradient_noise(p, seed) != gradient_noise(p, 0)));
}

#[test]
fn noise_has_the_same_bits_everywhere() {
    let value = |x, y, z, seed| gradient_noise(DVec3::new(x, y, z), seed).to_bits();
    let found = [value(0.5, 0.25, 0.125, 0), value(-3.75, 100.5, 7.25, 1), value(0.3, 0.7, -0.9, 7)];
    assert_eq!(found, NOISE_BITS, "{found:#x?}");
}

const NOISE_BITS: [u64; 3] = [0xbfb8_9e44_2000_0000, 0x3fd5_1646_0000_0000, 0x3fb9_4e77_6ba8_2698];

#[test]
fn supersampling_is_the_mean_over_the_ellipse() {
    let mut rng = Random::new(5);
    // Smooth and with edges, by 64 x 64 strata, and smooth by 8 x 8.
    let mut worst = [0.0_f64; 3];
    for _ in 0..50 {
        let st = vector(&mut rng, 3.0).truncate();
        let [a, b] = [0; 2].map(|_| vector(&mut rng, 0.4).truncate().as_vec2());
        let at = SpacePoint::in_plane(st, &Footprint::new(a, b));
        let plate = ZonePlate { cycles: 0.5 };
        let [smooth, edges] = [mean_over_ellipse(&plate, &at), mean_over_ellipse(&CHECKS, &at)];
        let errors = [
            supersample(|p| plate.value(p), &at, 64) - smooth,
            supersample(|p| CHECKS.value(p), &at, 64) - edges,
            supersample(|p| plate.value(p), &at, 8) - smooth,
        ];
        worst = [0, 1, 2].map(|i| worst[i].max(errors[i].abs()));
    }
    for (worst, limit) in
        worst.iter().zip([tol::SUPERSAMPLED, tol::SUPERSAMPLED_EDGES, 64.0 * tol::SUPERSAMPLED])
    {
        assert!(*worst <= limit, "{worst} {limit}");
    }
    // The ellipse's second moments: a quarter of the squared semi-axes.
    let at = boxed(DVec2::ZERO, DVec2::new(2.0, 1.0));
    for (axis, expected) in [(0, 1.0), (1, 0.25)] {
        let found = supersample(|p| p[axis] * p[axis], &at, 32);
        assert!((found - expected).abs() <= 0.01, "{found}");
    }
}

#[test]
fn supersampling_is_bounded_in_time_and_values() {
    for (asked, expected) in [(0, 1), (1, 1), (5, 25), (64, 4096), (u32::MAX, 4096)] {
        let count = std::cell::Cell::new(0);
        let at = boxed(DVec2::ZERO, DVec2::ONE);
        let mean = supersample(
            |p| {
                count.set(count.get() + 1);
                assert!(p.length() <= 1.0 + 1e-12);
                2.0
            },
            &at,
            asked,
        );
        assert_eq!((count.get(), mean), (expected, 2.0));
    }
    assert_eq!(supersample(|_| f64::NAN, &SpacePoint::default(), 4), 0.0);
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 10_000, rng_seed: RngSeed::Fixed(9), failure_persistence: None, ..ProptestConfig::default()
    })]

    #[test]
    fn values_are_finite_whatever_the_numbers(
        v in prop::array::uniform3(any_vector()), numbers in prop::array::uniform2(any_f64()),
        octaves in any::<u32>(), seed in any::<u32>()
    ) {
        let at = SpacePoint { point: v[0], dx: v[1], dy: v[2] };
        for value in [CHECKS.filtered(&at), CHECKS.value(v[0])] {
            prop_assert!((0.0..=1.0).contains(&value), "{}", value);
        }
        let plate = ZonePlate { cycles: numbers[0] };
        for value in [plate.filtered(&at), plate.value(v[0])] {
            prop_assert!((0.0..=1.0).contains(&value), "{}", value);
        }
        prop_assert!(gradient_noise(v[0], seed).abs() <= 1.04);
        let octaves = if seed % 2 == 0 { octaves } else { octaves % 8 };
        let fbm = Fbm { octaves, lacunarity: numbers[0], gain: numbers[1], seed };
        prop_assert!(fbm.filtered(&at).is_finite());
        let usual = Fbm { octaves: 8, ..FBM };
        prop_assert!(usual.filtered(&at).abs() <= 2.08);
        prop_assert!(supersample(|p| usual.value(p), &at, 3).is_finite());
    }
}
