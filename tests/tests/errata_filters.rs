//! The errata E1 to E14 of pbrt's EWA (seed 1) and those of Footprint Assembly (seed 2): the printed form goes wrong
//! by the number that the specification's table gives, ours does not.
//!
//! E11 is also tested where levels are built, in `splat-core`.

use glam::{DVec2, Vec2};
use splat_core::texture::filter::{
    Ellipse, KERNEL_VARIANCE, MAX_PERIODS, ProbeRow, RowKernel, place, weight,
};
use splat_core::texture::{
    Filter, Footprint, Magnification, Probes, Pyramid, Quality, Sampler, SummedArea, Texels, Wrap,
};
use splat_tests::random::Random;
use splat_tests::texture_truth::{Image, Lookup};
use splat_tests::tolerances as tol;

const VC: Filter = Filter::EwaVc(Quality::DEFAULT);

fn sampler(filter: Filter) -> Sampler {
    Sampler { filter, max_anisotropy: 64.0, ..Sampler::default() }
}

fn footprint(a: [f32; 2], b: [f32; 2]) -> Footprint {
    Footprint { semi_axes: [a.into(), b.into()] }
}

/// A lookup in the middle, along s.
fn upright(major: f64, minor: f64) -> Lookup {
    Lookup { center: DVec2::splat(0.5), major, minor, angle: 0.0 }
}

/// Root of the mean squared error over lookups, the first channel's.
fn error(
    image: &Image,
    filter: Filter,
    lookups: &[(Lookup, f64)],
    footprint: impl Fn(&Lookup) -> Footprint,
) -> f64 {
    let pyramid = image.pyramid(Wrap::Repeat);
    let square = |(lookup, truth): &(Lookup, f64)| {
        let found = sampler(filter).lookup(&pyramid, lookup.st(), &footprint(lookup))[0];
        (f64::from(found) - truth).powi(2)
    };
    (lookups.iter().map(square).sum::<f64>() / lookups.len() as f64).sqrt()
}

/// Random lookups of an image with their true values.
fn lookups(image: &Image, minor: [f64; 2], anisotropy: f64) -> Vec<(Lookup, f64)> {
    let mut random = Random::new(23);
    let lookup = |_| Lookup::random(&mut random, minor, anisotropy);
    (0..200).map(lookup).map(|lookup| (lookup, image.truth(&lookup)[0])).collect()
}

/// The variance along s of a filter's weights, in squared texels: it turns a parabola of that much at its vertex.
/// As a mean over places between the texels.
fn variance(filter: Filter, lookup: &Lookup) -> f64 {
    let size = [512, 512];
    let parabola = Image::from_fn(size, |x, _| ((f64::from(x) - 255.5) / 256.0).powi(2) as f32);
    let pyramid = parabola.pyramid(Wrap::Clamp);
    let mean = |i: u32| {
        let offset = (f64::from(i) - 31.5) / 8.0;
        let st = Vec2::new((0.5 + offset / 512.0) as f32, 0.5);
        let value = sampler(filter).lookup(&pyramid, st, &lookup.footprint(size))[0];
        f64::from(value) * 65536.0 - offset * offset
    };
    (0..64).map(mean).sum::<f64>() / 64.0
}

#[test]
fn e01_the_longer_vector_is_no_axis() {
    // A 16 x 1 ellipse by vectors that are turned along it.
    for (degrees, printed_minor) in [(10.0_f64, 2.95), (30.0, 8.05), (45.0, 11.34)] {
        let turned = upright(16.0, 1.0).conjugate([256; 2], degrees.to_radians());
        let lengths = turned.semi_axes.map(|axis| 256.0 * f64::from(axis.length()));
        assert!((lengths[0].min(lengths[1]) - printed_minor).abs() <= tol::printed(2), "{lengths:?}");
        let ellipse = Ellipse::new(&turned, [256; 2], 64.0);
        assert!((ellipse.minor - 1.0).abs() < 1e-5 && (ellipse.major - 16.0).abs() < 1e-5, "{ellipse:?}");
    }
    let image = Image::zone_plate(256);
    let lookups = lookups(&image, [0.75, 3.0], 16.0);
    let at = |filter, turn: f64| error(&image, filter, &lookups, |lookup| lookup.conjugate([256; 2], turn));
    // The picture blurs: the printed form loses all its accuracy.
    assert!(at(Filter::EwaPrinted, 0.5) > 3.0 * at(Filter::EwaPrinted, 0.0));
    for filter in [Filter::Ewa, VC, Filter::Assembly(Probes::Gaussian)] {
        assert!((at(filter, 0.5) - at(filter, 0.0)).abs() < tol::CONJUGATE);
    }
}

#[test]
fn e02_a_wide_texture_has_two_units() {
    // 16 texels along s and 1 along t of 1024 x 64: printed, the level is 10 + log2(1/64) = 4. Stripes of two rows
    // are grey there.
    let image = Image::from_fn([1024, 64], |_, y| (y / 2 % 2) as f32);
    let footprint = footprint([1.0 / 64.0, 0.0], [0.0, 1.0 / 64.0]);
    assert_eq!(10.0 + libm::log2(1.0 / 64.0), 4.0);
    let st = Vec2::new(0.5, 33.0 / 64.0);
    let pyramid = image.pyramid(Wrap::Repeat);
    let truth = image.truth(&Lookup { center: st.as_dvec2(), ..upright(16.0, 1.0) })[0];
    let [printed, corrected, compensated] = [Filter::EwaPrinted, Filter::Ewa, VC]
        .map(|filter| f64::from(sampler(filter).lookup(&pyramid, st, &footprint)[0]) - 0.5);
    let contrast = truth - 0.5;
    assert!(contrast.abs() > 0.2 && printed.abs() < 1e-3, "{contrast} {printed}");
    for ours in [corrected, compensated] {
        // Two rows to each side of the boundary are .5 or 1.5 away: whether the outer ones count at all is 1/20.
        assert!((ours / contrast - 1.0).abs() < 0.06, "{contrast} {ours}");
    }
}

#[test]
fn e03_the_determinant_cancels() {
    // F = A C - B^2 / 4 of a line, which is A + C - 1, by the printed f32.
    let worst = |length: f32| {
        let mut worst = 0.0_f32;
        for i in 0..1000 {
            let (sin, cos) = (libm::sinf(i as f32), libm::cosf(i as f32));
            let (ds, dt) = (length * cos, length * sin);
            let (a, b, c) = (dt * dt + 1.0, -2.0 * ds * dt, ds * ds + 1.0);
            worst = worst.max(((a * c - b * b * 0.25) / (a + c - 1.0) - 1.0).abs());
        }
        worst
    };
    // Nothing is left at 1e4 texels, and at 3000 a third is lost.
    assert!(worst(1e4) >= 1.0 && worst(3e3) > 0.3, "{} {}", worst(1e4), worst(3e3));
    // Ours, of vectors that are nearly parallel: major times minor is the determinant of the f32 vectors.
    let mut random = Random::new(29);
    let (mut ours, mut printed) = (0.0_f64, 0.0_f64);
    for _ in 0..1000 {
        let direction = DVec2::from_angle(random.range(0.0, 6.0));
        let (a, b) = (8000.0 * direction, 4000.0 * direction + 40.0 * direction.perp());
        let (a, b) = ((a / 16384.0).as_vec2(), (b / 16384.0).as_vec2());
        let exact = a.as_dvec2().perp_dot(b.as_dvec2()).abs() * 16384.0 * 16384.0;
        let ellipse = Ellipse::new(&Footprint { semi_axes: [a, b] }, [16384; 2], 256.0);
        ours = ours.max((ellipse.major * ellipse.minor / exact - 1.0).abs());
        let (a, b) = (16384.0 * a, 16384.0 * b);
        let (xx, xy, yy) = (a.x * a.x + b.x * b.x, a.x * a.y + b.x * b.y, a.y * a.y + b.y * b.y);
        printed = printed.max((f64::from(xx * yy - xy * xy).max(0.0).sqrt() / exact - 1.0).abs());
    }
    assert!(ours < 1e-12 && printed > 1e-3, "{ours} {printed}");
}

#[test]
fn e04_the_weight_table_is_read_half_a_bin_off() {
    let exact = |r2: f64| libm::exp(-2.0 * r2) - libm::exp(-2.0);
    let printed = |r2: f64| exact((128.0 * r2).floor().min(127.0) / 127.0);
    let over = |approximation: &dyn Fn(f64) -> f64| {
        let errors: Vec<f64> =
            (0..100_000).map(|i| f64::from(i) / 1e5).map(|r2| approximation(r2) - exact(r2)).collect();
        (errors.iter().fold(0.0_f64, |most, e| most.max(e.abs())), errors.iter().sum::<f64>() / 1e5)
    };
    let (most, bias) = over(&printed);
    assert!(
        (most - 0.0155).abs() <= tol::printed(4) && (bias - 0.0011).abs() <= tol::printed(4),
        "{most} {bias}"
    );
    let (most, bias) = over(&weight);
    assert!(most < 1.8e-5 && bias.abs() < 1e-5, "{most} {bias}");
}

#[test]
fn e05_levels_are_blurred_already() {
    for (radius, factor) in [(1.5, 1.7), (3.0, 2.0), (6.0, 2.0), (12.0, 2.0)] {
        let lookup = upright(radius, radius);
        let expected = KERNEL_VARIANCE * radius * radius + 1.0 / 6.0;
        let [printed, ewa, compensated] =
            [Filter::EwaPrinted, Filter::Ewa, VC].map(|f| variance(f, &lookup) / expected);
        assert!(printed > factor && (ewa / printed - 1.0).abs() < 0.05, "{radius}: {printed} {ewa}");
        assert!((compensated - 1.0).abs() < tol::LOOKUP_VARIANCE, "{radius}: {compensated}");
    }
    let image = Image::zone_plate(256);
    let lookups = lookups(&image, [0.75, 8.0], 1.0);
    let at = |filter| error(&image, filter, &lookups, |lookup| lookup.footprint([256; 2]));
    assert!(at(VC) < 0.4 * at(Filter::EwaPrinted));
}

#[test]
fn e06_a_level_of_no_share_is_not_asked() {
    let pyramid = Image::noise([64, 64], 1, 1).pyramid(Wrap::Repeat);
    let texels = |filter, lookup: &Lookup| {
        sampler(filter).average(&pyramid, lookup.st(), &lookup.footprint([64, 64])).texels
    };
    // Exactly one texel wide: all of level 0, nothing of level 1.
    let lookup = upright(1.0, 1.0);
    let both = texels(Filter::EwaPrinted, &lookup);
    assert!(texels(Filter::Ewa, &lookup) < both);
    // Magnified, by two levels of EWA or by one bilinear lookup.
    let magnified = upright(0.1, 0.1);
    assert!(texels(Filter::EwaPrinted, &magnified) >= 8);
    assert_eq!(texels(Filter::Ewa, &magnified), 4);
}

#[test]
fn e07_the_coarsest_level_has_wraps_too() {
    // Four periods wide, nine periods away from a white texture in black.
    let white = Image::from_fn([16, 16], |_, _| 1.0).pyramid(Wrap::Black);
    let (st, wide) = (Vec2::splat(9.0), footprint([4.0, 0.0], [0.0, 4.0]));
    assert_eq!(sampler(Filter::EwaPrinted).lookup(&white, st, &wide)[0], 1.0);
    for filter in [Filter::Trilinear, Filter::Ewa, VC, Filter::Assembly(Probes::Gaussian)] {
        assert_eq!(sampler(filter).lookup(&white, st, &wide)[0], 0.0, "{filter:?}");
    }
    // A level of detail of infinity is the last.
    let endless = footprint([f32::INFINITY, 0.0], [0.0, f32::INFINITY]);
    let grey = Image::noise([16, 16], 1, 1).pyramid(Wrap::Repeat);
    let last = grey.texel(grey.last(), 0, 0)[0];
    for filter in [Filter::Trilinear, Filter::Ewa, VC, Filter::Assembly(Probes::Texram)] {
        assert!((sampler(filter).lookup(&grey, st, &endless)[0] - last).abs() < 1e-6, "{filter:?}");
    }
}

#[test]
fn e08_a_line_is_not_a_point() {
    let image = Image::noise([256, 256], 1, 31);
    let lookups = lookups(&image, [0.01, 0.010_001], 3200.0);
    let line = |lookup: &Lookup| {
        let [long, _] = lookup.footprint([256; 2]).semi_axes;
        Footprint { semi_axes: [long, Vec2::ZERO] }
    };
    // 32 texels of noise to each side have little contrast left, but a point has all of it.
    let grey = (lookups.iter().map(|(_, truth)| (truth - 0.5).powi(2)).sum::<f64>() / 200.0).sqrt();
    let [printed, compensated] = [Filter::EwaPrinted, VC].map(|filter| error(&image, filter, &lookups, line));
    assert!(printed > 3.0 * grey, "{printed} {grey}");
    assert!(compensated < 0.5 * grey, "{compensated} {grey}");
}

#[test]
fn e09_the_clamp_moves_the_major_axis() {
    // 64 texels, and 3.9 nearly along it, at an anisotropy of 8. Printed: the second vector is stretched to 8.
    let (a, mut b) = (DVec2::new(64.0, 0.0), DVec2::new(3.9, 0.1));
    let axes = |a: DVec2, b: DVec2| {
        let all = Footprint { semi_axes: [(a / 256.0).as_vec2(), (b / 256.0).as_vec2()] };
        let ellipse = Ellipse::new(&all, [256; 2], 256.0 * 8.0);
        (ellipse.major, a.perp_dot(b).abs() / ellipse.major)
    };
    let (major, _) = axes(a, b);
    let given = footprint([0.25, 0.0], (b / 256.0).as_vec2().to_array());
    b *= a.length() / (b.length() * 8.0);
    let (printed_major, printed_minor) = axes(a, b);
    assert!(printed_major > major + 0.3, "{printed_major} {major}");
    // The level is chosen for a minor axis of 8, but it is .2: a ratio of 300 where 8 was asked for.
    assert!(printed_major / printed_minor > 300.0, "{printed_major} {printed_minor}");
    let ours = Ellipse::new(&given, [256; 2], 8.0);
    assert!((ours.major - major).abs() < 1e-9 && (ours.major / ours.minor - 8.0).abs() < 1e-9, "{ours:?}");
}

#[test]
fn e10_hostile_footprints_give_colours() {
    // Printed: A C - B^2 / 4 of large vectors is inf - inf.
    let d = 1e20_f32;
    assert!((d * d * (d * d) - (d * d) * (d * d)).is_nan());
    let pyramid = Image::noise([64, 64], 1, 1).pyramid(Wrap::Repeat);
    let mean = pyramid.texel(pyramid.last(), 0, 0)[0];
    for size in [1e10_f32, 1e15, 1e20, f32::MAX, f32::INFINITY] {
        for filter in
            [Filter::EwaPrinted, Filter::Ewa, VC, Filter::Trilinear, Filter::Assembly(Probes::Gaussian)]
        {
            let wide = footprint([size, 0.0], [0.0, size]);
            let found = sampler(filter).average(&pyramid, Vec2::splat(0.3), &wide);
            assert!((found.color[0] - mean).abs() < 1e-5, "{filter:?} {size}: {found:?}");
            assert!(f64::from(found.texels) <= (2.0 * MAX_PERIODS + 1.0).powi(2), "{found:?}");
        }
    }
    // A vector that is not a number says nothing: the other one counts.
    let nan = footprint([f32::NAN, 0.0], [0.0, 0.1]);
    let ellipse = Ellipse::new(&nan, [64; 2], 16.0);
    assert!((ellipse.major - 6.4).abs() < 1e-6 && (ellipse.minor - 0.4).abs() < 1e-6);
}

#[test]
fn e11_levels_of_a_white_image_in_black_are_white() {
    let white = Image::from_fn([8, 1], |_, _| 1.0).pyramid(Wrap::Black);
    let ours: Vec<f32> = (1..4).map(|level| white.texel(level, 0, 0)[0]).collect();
    // Printed: each texel is a quarter of two rows, of which one is black. One row once, then halved.
    let mut printed = vec![0.5];
    printed.extend([0.25, 0.125]);
    assert_eq!((ours, printed), (vec![1.0; 3], vec![0.5, 0.25, 0.125]));
}

#[test]
fn e12_the_triangle_filter_is_as_wide_as_the_footprint_is_long() {
    let printed_width = |lookup: &Lookup| {
        let axes = lookup.footprint([512; 2]).semi_axes;
        f64::from(2.0 * axes.map(|axis| axis.abs().max_element()).into_iter().fold(0.0, f32::max)) * 512.0
    };
    let (along, across) =
        (upright(8.0, 8.0 / 64.0), Lookup { angle: std::f64::consts::FRAC_PI_4, ..upright(8.0, 8.0 / 64.0) });
    assert!((printed_width(&along) - 16.0).abs() < 1e-4 && (printed_width(&across) - 11.314).abs() < 1e-3);
    // Ours: level 3 either way, with the variance (4^3 - 1) / 12 + 4^3 / 6.
    let expected = 63.0 / 12.0 + 64.0 / 6.0;
    for lookup in [along, across] {
        let found = variance(Filter::Trilinear, &lookup);
        assert!((found / expected - 1.0).abs() < tol::LOOKUP_VARIANCE, "{found} {expected}");
    }
}

#[test]
fn e13_sizes_stay_as_they_are() {
    // A step at 50 of 100 texels: resampled to 128 by a Lanczos filter, it would be softer and ring to below 0.
    let image = Image::from_fn([100, 30], |x, _| if x < 50 { 0.0 } else { 1.0 });
    let pyramid = image.pyramid(Wrap::Clamp);
    assert_eq!(pyramid.levels()[0].size(), [100, 30]);
    for x in 0..100 {
        let st = Vec2::new((x as f32 + 0.5) / 100.0, 0.5);
        let found = sampler(VC).lookup(&pyramid, st, &Footprint::default())[0];
        assert!((found - if x < 50 { 0.0 } else { 1.0 }).abs() < 1e-5, "{x}: {found}");
    }
}

#[test]
fn e14_magnified_texels_keep_their_colour() {
    let image = Image::noise([16, 16], 1, 37);
    let pyramid = image.pyramid(Wrap::Repeat);
    let close = upright(0.01, 0.01).footprint([16; 2]);
    let (mut printed, mut ours) = (0.0_f32, 0.0_f32);
    for (i, &value) in image.values.iter().enumerate() {
        let st = (Vec2::new((i % 16) as f32, (i / 16) as f32) + 0.5) / 16.0;
        let found = sampler(Filter::EwaPrinted).lookup(&pyramid, st, &close)[0];
        printed = printed.max((found - value).abs());
        for magnification in [Magnification::Bilinear, Magnification::Bicubic] {
            let sampler = Sampler { magnification, ..sampler(VC) };
            ours = ours.max((sampler.lookup(&pyramid, st, &close)[0] - value).abs());
        }
    }
    // At a texel's centre pbrt's disc of a texel's radius just misses the neighbours; between texels it shows:
    // a corner's four texels weigh the same either way, but the middle of an edge sees two discs of two.
    let st = Vec2::new(8.25, 8.5) / 16.0;
    let [a, b] = [image.values[8 * 16 + 7], image.values[8 * 16 + 8]];
    let linear = sampler(VC).lookup(&pyramid, st, &close)[0];
    assert!((linear - (0.25 * a + 0.75 * b)).abs() < 1e-5 && ours < 1e-5, "{linear} {ours}");
    let disc = sampler(Filter::EwaPrinted).lookup(&pyramid, st, &close)[0];
    assert!(
        (disc - linear).abs() > 0.04 * (a - b).abs() && printed < 1e-3,
        "{disc} {linear} {a} {b} {printed}"
    );
}

/// The row of an upright ellipse.
fn probe_row(major: f64, minor: f64, probes: Probes) -> ProbeRow {
    let footprint = upright(major, minor).footprint([1024; 2]);
    ProbeRow::new(&Ellipse::new(&footprint, [1024; 2], 64.0), probes)
}

#[test]
fn footprint_assembly_has_the_published_points() {
    // N = 8: p + (n / 2) (r1 / 8), n = +-1 .. +-7: at +-1/16 .. +-7/16 of r1.
    let row = probe_row(8.0, 1.0, Probes::Texram);
    let side = row.side() * 8.0;
    assert_eq!(row.count, 8);
    let offsets: Vec<f64> = (0..8).map(|i| (f64::from(i) - 3.5) * row.step.x / side).collect();
    for (offset, n) in offsets.iter().zip([-7.0, -5.0, -3.0, -1.0, 1.0, 3.0, 5.0, 7.0]) {
        assert!((offset - n / 16.0).abs() < 1e-6, "{offsets:?}");
    }
    assert_eq!(probe_row(1.0, 1.0, Probes::Texram).count, 1);
}

#[test]
fn footprint_assembly_rounds_to_gaps() {
    let spacing = |ratio: f64, probes| {
        let row = probe_row(ratio, 1.0, probes);
        row.step.length() / row.side()
    };
    let range = |probes| {
        let all = (0..1000).map(|i| spacing(2.0 + 0.03 * f64::from(i), probes));
        all.fold((f64::INFINITY, 0.0_f64), |(least, most), x| (least.min(x), most.max(x)))
    };
    let (least, most) = range(Probes::Texram);
    assert!((least - 0.71).abs() < 0.01 && (most - 1.41).abs() < 0.01, "{least} {most}");
    let (least, most) = range(Probes::TexramCeiling);
    assert!(least >= 0.5 && most <= 1.001, "{least} {most}");
    // At 11:1 (just below sqrt(2) 8) the gaps alias.
    let image = Image::noise([256, 256], 1, 41);
    let lookups = lookups(&image, [2.0, 2.1], 11.0);
    let at = |probes| error(&image, Filter::Assembly(probes), &lookups, |lookup| lookup.footprint([256; 2]));
    let [texram, ceiling, gaussian] = [Probes::Texram, Probes::TexramCeiling, Probes::Gaussian].map(at);
    assert!(ceiling < 0.9 * texram && gaussian < 0.8 * texram, "{texram} {ceiling} {gaussian}");
}

#[test]
fn footprint_assembly_needs_the_axes() {
    // Conjugate vectors turned by 45 degrees are of the same length: printed, a single square stands for 16:1.
    let turned = upright(16.0, 1.0).conjugate([1024; 2], std::f64::consts::FRAC_PI_4);
    let [a, b] = turned.semi_axes.map(|axis| f64::from(axis.length()));
    assert_eq!(libm::exp2(libm::log2(a / b).round()), 1.0);
    let row = ProbeRow::new(&Ellipse::new(&turned, [1024; 2], 64.0), Probes::Texram);
    assert_eq!(row.count, 16);
    assert!((row.side() / probe_row(16.0, 1.0, Probes::Texram).side() - 1.0).abs() < 1e-5);
}

/// The mean over a rectangle in texels, of squares of one colour: brute force along each axis.
fn rectangle_mean(pyramid: &Pyramid, corner: DVec2, sides: DVec2) -> f64 {
    let shares = |from: f64, to: f64| {
        let share = move |i: i64| (i, (to.min(i as f64 + 1.0) - from.max(i as f64)).max(0.0));
        (from.floor() as i64..=to.floor() as i64).map(share)
    };
    let mut sum = 0.0;
    for (y, height) in shares(corner.y, corner.y + sides.y) {
        for (x, width) in shares(corner.x, corner.x + sides.x) {
            sum += width * height * f64::from(pyramid.texel(0, x, y)[0]);
        }
    }
    sum / (sides.x * sides.y)
}

#[test]
fn summed_areas_are_exact_for_any_corners_and_wraps() {
    let image = Image::noise([13, 9], 1, 43);
    let size = DVec2::new(13.0, 9.0);
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror, Wrap::Black] {
        let pyramid = image.pyramid(wrap);
        let table = SummedArea::new(&pyramid);
        let mut random = Random::new(47);
        for _ in 0..500 {
            let center = DVec2::new(random.range(-2.0, 3.0), random.range(-2.0, 3.0)).as_vec2();
            let sides = DVec2::new(random.range(0.2, 2.0), random.range(0.2, 2.0)).as_vec2();
            let corner = (center.as_dvec2() - 0.5 * sides.as_dvec2()) * size;
            let truth = rectangle_mean(&pyramid, corner, sides.as_dvec2() * size);
            let found = f64::from(table.rectangle(center, sides).color[0]);
            assert!((found - truth).abs() < 1e-7, "{wrap:?} {center} {sides}: {found} {truth}");
        }
    }
}

#[test]
fn summed_areas_of_thin_rectangles_stay_thin() {
    let wide = Image::noise([2048, 8], 1, 71).pyramid(Wrap::Clamp);
    let found = SummedArea::new(&wide).rectangle(Vec2::splat(0.5), Vec2::new(1.0, 0.125)).color[0];
    let truth = rectangle_mean(&wide, DVec2::new(0.0, 3.5), DVec2::new(2048.0, 1.0));
    assert!((f64::from(found) - truth).abs() < 1e-7, "{found} {truth}");
}

#[test]
fn summed_areas_need_f64() {
    let image = Image::noise([1024, 1024], 1, 53);
    let mut sums = vec![0.0_f32; 1025 * 1025];
    for y in 0..1024 {
        let mut row = 0.0;
        for x in 0..1024 {
            row += image.values[y * 1024 + x];
            sums[(y + 1) * 1025 + x + 1] = sums[y * 1025 + x + 1] + row;
        }
    }
    let pyramid = image.pyramid(Wrap::Repeat);
    let table = SummedArea::new(&pyramid);
    let (mut single, mut double) = (0.0_f64, 0.0_f64);
    for i in 0..2000_usize {
        let (x, y) = (i * 389 % 1020, 1019 - i * 7 % 400);
        let truth = rectangle_mean(&pyramid, DVec2::new(x as f64, y as f64), DVec2::splat(4.0));
        let at = |dx: usize, dy: usize| sums[(y + dy) * 1025 + x + dx];
        let value = (at(4, 4) - at(0, 4) - at(4, 0) + at(0, 0)) / 16.0;
        single = single.max((f64::from(value) - truth).abs());
        let center = (Vec2::new(x as f32, y as f32) + 2.0) / 1024.0;
        let found = table.rectangle(center, Vec2::splat(4.0 / 1024.0)).color[0];
        double = double.max((f64::from(found) - truth).abs());
    }
    // The result is rounded to f32.
    assert!(single > 3e-3 && double < 6e-8, "{single} {double}");
}

#[test]
fn stored_forms_agree() {
    let image = Image::noise([64, 64], 3, 59);
    let full = image.pyramid(Wrap::Repeat);
    let codes = image.values.iter().map(|&v| (255.0 * splat_core::srgb::encode(f64::from(v))).round() as u8);
    let texels = [(Texels::f16_from(&image.values), 1e-3), (Texels::Srgb8(codes.collect()), 6e-3)];
    let mut random = Random::new(61);
    for (texels, most) in texels {
        let stored = Pyramid::new([64; 2], 3, texels, [Wrap::Repeat; 2]).unwrap();
        for _ in 0..200 {
            let lookup = Lookup::random(&mut random, [0.2, 8.0], 3.0);
            let footprint = lookup.footprint([64; 2]);
            let [a, b] = [&full, &stored].map(|pyramid| sampler(VC).lookup(pyramid, lookup.st(), &footprint));
            assert!(a.iter().zip(b).all(|(a, b)| f64::from((a - b).abs()) < most), "{a:?} {b:?}");
        }
    }
}

/// Every level has a kernel of the right size, whatever the texture's: a positive definite one, at least a texel wide.
#[test]
fn compensated_kernels_are_never_too_small() {
    for size in [[127, 129], [331, 100], [4096, 1], [3, 1000], [1, 1]] {
        let pyramid = Image::from_fn(size, |_, _| 0.0).pyramid(Wrap::Repeat);
        let center = place(pyramid.wrap(), Vec2::splat(0.4));
        for i in 0..400 {
            let minor = libm::exp2(0.04 * f64::from(i) - 2.0);
            let lookup = upright(minor, minor);
            let ellipse = Ellipse::new(&lookup.footprint(size), size, 16.0);
            let kernel = RowKernel::variance_compensated(&pyramid, center, &ellipse, 1.25);
            assert!(
                kernel.extent > 0.9 && kernel.curvature > 0.0 && kernel.curvature < 1.3,
                "{size:?} {kernel:?}"
            );
        }
    }
}
