//! Texture lookups by lanes against the scalar filters, and with the same bits at every level and in every batch.

use glam::{DVec2, Vec2};
use proptest::prelude::*;
use splat_core::texture::filter::{Average, honoured_anisotropy};
use splat_core::texture::{
    Filter, Footprint, Magnification, Probes, Pyramid, Quality, Sampler, Texels, Wrap,
};
use splat_simd::Level;
use splat_simd::texture::{LanePyramid, LaneSampler, Lookup as Request};
use splat_tests::random::Random;
use splat_tests::texture_truth::{Image, Lookup, WRAPS, any_float, pyramids_of_noise};
use splat_tests::tolerances as tol;
use std::sync::LazyLock;

/// All that lanes have: the printed EWA is the reference's alone.
const FILTERS: [Filter; 8] = [
    Filter::Trilinear,
    Filter::Ewa,
    Filter::Assembly(Probes::Texram),
    Filter::Assembly(Probes::TexramCeiling),
    Filter::Assembly(Probes::Gaussian),
    Filter::EwaVc(Quality::FAST),
    Filter::EwaVc(Quality::DEFAULT),
    Filter::EwaVc(Quality::REFERENCE),
];

const MAGNIFICATIONS: [Magnification; 2] = [Magnification::Bilinear, Magnification::Bicubic];

const SIZES: [[u32; 2]; 7] = [[64, 64], [16, 16], [7, 5], [300, 1], [1, 1], [33, 100], [2, 65]];

/// A lookup in a texture of `size`.
fn request(lookup: &Lookup, size: [u32; 2]) -> Request {
    Request { st: lookup.st(), footprint: lookup.footprint(size) }
}

/// A lookup of lanes on some level.
fn at_any_level(sampler: &Sampler, pyramid: &LanePyramid, request: &Request) -> [f32; 4] {
    LaneSampler::new(sampler).lookup(Level::choose(), pyramid, request.st, &request.footprint)
}

/// The greatest difference of two colours.
fn difference(a: [f32; 4], b: [f32; 4]) -> f64 {
    a.into_iter().zip(b).map(|(a, b)| f64::from((a - b).abs())).fold(0.0, f64::max)
}

/// How far lanes are from the scalar filter; where a rounding may decide the level or the number of probes, from the
/// nearer decision.
fn error(sampler: &Sampler, image: &Image, pyramids: (&Pyramid, &LanePyramid), lookup: &Lookup) -> f64 {
    let found = at_any_level(sampler, pyramids.1, &request(lookup, image.size));
    let from = |lookup: Lookup| {
        difference(found, sampler.lookup(pyramids.0, lookup.st(), &lookup.footprint(image.size)))
    };
    let [fewer, more] = [1.0 - tol::LANES_DECIDE, 1.0 + tol::LANES_DECIDE];
    let Lookup { major, minor, .. } = *lookup;
    let near = [[major, minor], [major * more, minor], [major * fewer, minor], [major, minor * more]];
    let near = near.into_iter().chain([[major, minor * fewer]]);
    let mut errors = near.map(|[major, minor]| from(Lookup { major, minor, ..*lookup }));
    let exact = errors.next().unwrap_or(f64::INFINITY);
    if exact <= tol::lanes(lookup.major / lookup.minor) { exact } else { errors.fold(exact, f64::min) }
}

#[test]
fn lanes_are_near_the_scalar_filters() {
    let mut random = Random::new(23);
    let mut worst = 0.0_f64;
    for (i, size) in SIZES.into_iter().enumerate() {
        for wrap in WRAPS {
            let image = Image::noise(size, 1 + i % 4, 31);
            let pyramid = image.pyramid(wrap);
            let lanes = LanePyramid::new(&pyramid);
            for filter in FILTERS {
                for magnification in MAGNIFICATIONS {
                    let sampler = Sampler { filter, magnification, max_anisotropy: 64.0, width: 1.0 };
                    for _ in 0..40 {
                        let anisotropy = random.log_range(1.0, 64.0);
                        let mut lookup = Lookup::random(&mut random, [0.1, 20.0], anisotropy);
                        lookup.center = 4.0 * lookup.center - 1.5;
                        let error = error(&sampler, &image, (&pyramid, &lanes), &lookup);
                        let tolerance = tol::lanes(anisotropy);
                        worst = worst.max(error / tolerance);
                        assert!(error <= tolerance, "{filter:?} {wrap:?} {size:?} {lookup:?}: {error}");
                    }
                }
            }
        }
    }
    assert!(worst > 0.05, "the tolerance is {} times too large", 1.0 / worst);
}

#[test]
fn storages_and_large_textures() {
    let mut random = Random::new(29);
    let image = Image::noise([1000, 700], 3, 37);
    let bytes = image.values.iter().map(|value| (255.0 * value) as u8).collect();
    for texels in [Texels::f16_from(&image.values), Texels::Srgb8(bytes)] {
        let pyramid = Pyramid::new(image.size, 3, texels, [Wrap::Repeat, Wrap::Mirror]).unwrap();
        let lanes = LanePyramid::new(&pyramid);
        for filter in FILTERS {
            let sampler = Sampler { filter, max_anisotropy: 64.0, ..Sampler::default() };
            for _ in 0..60 {
                let anisotropy = random.log_range(1.0, 64.0);
                let lookup = Lookup::random(&mut random, [0.5, 8.0], anisotropy);
                let error = error(&sampler, &image, (&pyramid, &lanes), &lookup);
                assert!(error <= tol::lanes(anisotropy), "{filter:?} {lookup:?}: {error}");
            }
        }
    }
}

/// Some lookups, of ordinary and of hostile footprints.
fn requests(random: &mut Random, size: [u32; 2]) -> Vec<Request> {
    let any = |random: &mut Random| f32::from_bits((random.unit() * 4_294_967_296.0) as u32);
    let request = |i: usize| {
        if i % 5 == 4 {
            let mut vector = || Vec2::new(any(random), any(random));
            return Request { st: vector(), footprint: Footprint::new(vector(), vector()) };
        }
        let anisotropy = random.log_range(1.0, 100.0);
        request(&Lookup::random(random, [0.1, 10.0], anisotropy), size)
    };
    (0..77).map(request).collect()
}

fn bits(found: &[Average]) -> Vec<([u32; 4], u32)> {
    found.iter().map(|average| (average.color.map(f32::to_bits), average.texels)).collect()
}

#[test]
fn the_same_bits_at_every_level_and_in_every_batch() {
    let mut random = Random::new(41);
    for (i, size) in SIZES.into_iter().enumerate() {
        for wrap in WRAPS {
            let lanes = LanePyramid::new(&Image::noise(size, 1 + (i + 2) % 4, 43).pyramid(wrap));
            for filter in FILTERS {
                let magnification = MAGNIFICATIONS[i % 2];
                let sampler = Sampler { filter, magnification, max_anisotropy: 40.0, width: 1.0 };
                let sampler = LaneSampler::new(&sampler);
                let requests = requests(&mut random, size);
                let at = |level: Level, batch: usize| {
                    let mut found = vec![Average::default(); requests.len()];
                    for (requests, found) in requests.chunks(batch).zip(found.chunks_mut(batch)) {
                        sampler.lookups(level, &lanes, requests, found);
                    }
                    bits(&found)
                };
                let expected = at(Level::Portable, 1);
                for level in Level::available() {
                    for batch in [1, 3, 8, 77] {
                        assert_eq!(at(level, batch), expected, "{filter:?} {} {batch}", level.name());
                    }
                }
                let color = sampler.lookup(Level::choose(), &lanes, requests[3].st, &requests[3].footprint);
                assert_eq!(color.map(f32::to_bits), expected[3].0);
            }
        }
    }
}

#[test]
fn a_constant_stays_itself() {
    let mut random = Random::new(3);
    for size in SIZES {
        for channels in 1..=4 {
            let texels = Texels::F32(vec![0.7; size[0] as usize * size[1] as usize * channels]);
            for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
                let lanes =
                    LanePyramid::new(&Pyramid::new(size, channels, texels.clone(), [wrap; 2]).unwrap());
                for _ in 0..20 {
                    let anisotropy = random.log_range(1.0, 100.0);
                    let lookup = request(&Lookup::random(&mut random, [0.1, 30.0], anisotropy), size);
                    for filter in FILTERS {
                        for magnification in MAGNIFICATIONS {
                            let sampler = Sampler { filter, magnification, ..Sampler::default() };
                            let found = at_any_level(&sampler, &lanes, &lookup);
                            for (channel, value) in found.into_iter().enumerate() {
                                let expected = if channel < channels { 0.7 } else { 0.0 };
                                let error = f64::from((value - expected).abs());
                                assert!(
                                    error <= tol::LANES_CONSTANT,
                                    "{filter:?} {size:?} {lookup:?}: {found:?}"
                                );
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Conjugate vectors and huge footprints: as of the scalar filters.
#[test]
fn conjugate_vectors_make_no_difference() {
    let image = Image::noise([128, 128], 1, 2);
    let lanes = LanePyramid::new(&image.pyramid(Wrap::Repeat));
    let mut random = Random::new(11);
    for _ in 0..400 {
        let anisotropy = random.log_range(1.0, 16.0);
        let lookup = Lookup::random(&mut random, [0.4, 8.0], anisotropy);
        let turn = random.range(0.0, std::f64::consts::TAU);
        for filter in FILTERS {
            let sampler = Sampler { filter, max_anisotropy: 64.0, ..Sampler::default() };
            let [a, b] = [0.0, turn].map(|turn| {
                let footprint = lookup.conjugate(image.size, turn);
                at_any_level(&sampler, &lanes, &Request { st: lookup.st(), footprint })
            });
            assert!(difference(a, b) < tol::CONJUGATE + tol::lanes(anisotropy), "{filter:?} {lookup:?}");
        }
    }
}

#[test]
fn huge_footprints_see_the_mean() {
    let image = Image::noise([64, 48], 2, 5);
    let pyramid = image.pyramid(Wrap::Repeat);
    let lanes = LanePyramid::new(&pyramid);
    let mean = pyramid.texel(pyramid.last(), 0, 0);
    for filter in FILTERS {
        for scale in [2.0, 1e3, 1e10, 1e20, f32::MAX, f32::INFINITY] {
            let footprint = Footprint::new(Vec2::new(scale, 0.0), Vec2::new(0.0, scale));
            let sampler = Sampler { filter, ..Sampler::default() };
            let request = Request { st: DVec2::new(0.3, 0.6).as_vec2(), footprint };
            let found = at_any_level(&sampler, &lanes, &request);
            assert!(difference(found, mean) < 1e-2, "{filter:?} {scale}: {found:?} {mean:?}");
        }
    }
}

/// The most texels that a lookup may load for an anisotropy A: see `most_texels` of the scalar filters' test. There, an
/// ellipse has at most `2 pi a b + 8 a + 9` texels; here each of its rows, at most `4 a + 1`, loads up to 15 more, since
/// they come by eights and a row that has none loads eight. Levels of few texels in one axis have `8 n + 1` rows or
/// columns at most (four periods each way), of at most `2 a + 1` texels.
fn most_loaded(filter: Filter, anisotropy: f64) -> f64 {
    let rows = |quality: f64| {
        let a = ((2.0 * quality * anisotropy).powi(2) + 1.23).sqrt();
        let b = ((2.0 * quality).powi(2) + 1.23).sqrt();
        let texels = (2.0 * std::f64::consts::PI * a * b + 8.0 * a + 9.0).max(81.0);
        texels + 15.0 * (4.0 * a + 9.0)
    };
    16.0 + match filter {
        Filter::Trilinear => 8.0,
        Filter::Ewa | Filter::EwaPrinted => rows(1.0) + rows(0.5),
        Filter::Assembly(_) => 8.0 * (2.0 * anisotropy + 1.0),
        Filter::EwaVc(quality) => rows(quality.texels()),
    }
}

/// Pyramids of all kinds of sizes and values.
static PYRAMIDS: LazyLock<Vec<(Pyramid, LanePyramid)>> = LazyLock::new(|| {
    let prepared = |pyramid: Pyramid| {
        let lanes = LanePyramid::new(&pyramid);
        (pyramid, lanes)
    };
    pyramids_of_noise(&SIZES).into_iter().map(prepared).collect()
});

proptest! {
    #![proptest_config(ProptestConfig { cases: 4000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_lookup_is_finite_bounded_and_takes_bounded_time(
        pyramid in 0..2 * WRAPS.len() * SIZES.len(),
        filter in 0..FILTERS.len(),
        cubic in any::<bool>(),
        st in [any_float(), any_float()],
        axes in [any_float(), any_float(), any_float(), any_float()],
        max_anisotropy in prop_oneof![any::<u64>().prop_map(f64::from_bits), 1.0..32.0_f64],
        width in prop_oneof![any::<u64>().prop_map(f64::from_bits), Just(1.0_f64)],
    ) {
        let (pyramid, lanes) = &PYRAMIDS[pyramid];
        let filter = FILTERS[filter];
        let magnification = if cubic { Magnification::Bicubic } else { Magnification::Bilinear };
        let footprint = Footprint::new(Vec2::new(axes[0], axes[1]), Vec2::new(axes[2], axes[3]));
        let sampler = LaneSampler::new(&Sampler { filter, magnification, max_anisotropy, width });
        let found = sampler.average(Level::choose(), lanes, Vec2::from_array(st), &footprint);
        let anisotropy = honoured_anisotropy(max_anisotropy);
        prop_assert!(f64::from(found.texels) <= most_loaded(filter, anisotropy), "{}", found.texels);
        let Texels::F32(values) = pyramid.levels()[0].texels() else { unreachable!("made of f32") };
        let outside = if pyramid.wrap()[0] == Wrap::Black { 0.0 } else { values[0] };
        let [least, greatest] = [f32::min, f32::max]
            .map(|of_two| f64::from(values.iter().fold(outside, |found, &value| of_two(found, value))));
        let slack = tol::LANES_RANGE * least.abs().max(greatest.abs());
        for &value in &found.color[..pyramid.channels()] {
            prop_assert!((least - slack..=greatest + slack).contains(&f64::from(value)), "{found:?}");
        }
        prop_assert!(found.color.iter().all(|value| value.is_finite()));
        prop_assert!(found.color[pyramid.channels()..].iter().all(|&value| value == 0.0));
    }
}
