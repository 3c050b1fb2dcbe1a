//! Texture filters against brute force, with the error bars of the specification, and what holds for every lookup.

use glam::{DVec2, Vec2};
use proptest::prelude::*;
use splat_core::texture::filter::{Ellipse, RowKernel, honoured_anisotropy, place};
use splat_core::texture::{
    Filter, Footprint, Magnification, Probes, Pyramid, Quality, Sampler, SummedArea, Texels, Wrap,
};
use splat_tests::random::Random;
use splat_tests::texture_truth::{Image, Lookup, WRAPS, any_float, pyramids_of_noise};
use splat_tests::tolerances as tol;
use std::path::PathBuf;
use std::sync::LazyLock;

/// Minor semi-axes, in texels: of pictures at about the texture's size, and of smaller ones.
const MINORS: [[f64; 2]; 2] = [[0.75, 3.0], [2.0, 8.0]];

const FILTERS: [Filter; 9] = [
    Filter::Trilinear,
    Filter::EwaPrinted,
    Filter::Ewa,
    Filter::Assembly(Probes::Texram),
    Filter::Assembly(Probes::TexramCeiling),
    Filter::Assembly(Probes::Gaussian),
    Filter::EwaVc(Quality::FAST),
    Filter::EwaVc(Quality::DEFAULT),
    Filter::EwaVc(Quality::REFERENCE),
];

/// Lookups with their true colours.
struct Set {
    image: Image,
    pyramid: Pyramid,
    lookups: Vec<(Lookup, [f64; 4])>,
}

impl Set {
    fn new(image: &Image, anisotropy: f64) -> Self {
        let mut random = Random::new(7);
        let mut lookups = Vec::new();
        for minor in MINORS {
            for _ in 0..160 {
                let lookup = Lookup::random(&mut random, minor, anisotropy);
                lookups.push((lookup, image.truth(&lookup)));
            }
        }
        Self { image: image.clone(), pyramid: image.pyramid(Wrap::Repeat), lookups }
    }

    /// Root of the mean squared error.
    fn error(&self, filter: Filter, width: f64) -> f64 {
        let sampler = Sampler { filter, max_anisotropy: 64.0, width, ..Sampler::default() };
        let mut sum = 0.0;
        for (lookup, truth) in &self.lookups {
            let color = sampler.lookup(&self.pyramid, lookup.st(), &lookup.footprint(self.image.size));
            for channel in 0..self.image.channels {
                sum += (f64::from(color[channel]) - truth[channel]).powi(2);
            }
        }
        (sum / (self.lookups.len() * self.image.channels) as f64).sqrt()
    }

    /// The least error over all widths.
    fn least_error(&self, filter: Filter) -> f64 {
        (4..=12).map(|i| self.error(filter, 0.1 * f64::from(i))).fold(f64::INFINITY, f64::min)
    }
}

/// The sets of all anisotropies; asserts the bars of variance-compensated EWA against pbrt's.
fn assert_bars(image: &Image, bars: [f64; 4]) -> [Set; 4] {
    let sets = tol::ANISOTROPIES.map(|anisotropy| Set::new(image, anisotropy));
    for (set, bar) in sets.iter().zip(bars) {
        let [fast, default, reference] = [Quality::FAST, Quality::DEFAULT, Quality::REFERENCE]
            .map(|quality| set.error(Filter::EwaVc(quality), 1.0));
        let printed = set.least_error(Filter::EwaPrinted);
        assert!(default <= bar * printed, "{default} of {printed}");
        assert!(reference <= default && default <= fast, "{fast} {default} {reference}");
    }
    sets
}

#[test]
fn checkerboard() {
    assert_bars(&Image::checkerboard(512, 16), tol::VC_CHECKERBOARD);
}

#[test]
fn zone_plate() {
    assert_bars(&Image::zone_plate(512), tol::VC_ZONE_PLATE);
}

#[test]
fn zone_plate_of_no_power_of_two() {
    assert_bars(&Image::zone_plate(331), tol::VC_ZONE_PLATE);
}

/// A photograph in linear light, where `SPLAT_TEST_DATA` names a folder that has it.
fn photograph(name: &str) -> Option<Image> {
    let folder = std::env::var_os("SPLAT_TEST_DATA").map(PathBuf::from).filter(|folder| folder.is_dir())?;
    let file = std::fs::File::open(folder.join("textures").join(name)).unwrap();
    let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    let values = bytes.iter().map(|&b| splat_core::srgb::decode(f64::from(b) / 255.0) as f32).collect();
    Some(Image { size: [info.width, info.height], channels: info.color_type.samples(), values })
}

#[test]
fn photographs() {
    for name in ["astronaut.png", "chelsea.png"] {
        let Some(image) = photograph(name) else { return };
        let sets = assert_bars(&image, tol::VC_PHOTOGRAPH);
        for set in &sets[..3] {
            // Rows of Gaussian probes are no worse than pbrt's EWA, to 16:1.
            let probes = set.error(Filter::Assembly(Probes::Gaussian), 1.0);
            assert!(probes <= set.error(Filter::EwaPrinted, 1.0), "{name}: {probes}");
        }
        if name == "astronaut.png" {
            for set in &sets {
                // On a square, along the axes, the corrected form differs from the printed one by its weights alone.
                let [printed, corrected] = [Filter::EwaPrinted, Filter::Ewa].map(|f| set.error(f, 1.0));
                assert!((corrected / printed - 1.0).abs() < 0.05, "{corrected} {printed}");
            }
        }
    }
}

/// Footprint Assembly over a summed-area table is near the truth, and with Gaussian weights nearer.
#[test]
fn summed_area_assembly() {
    let image = Image::noise([128, 96], 1, 3);
    let table = SummedArea::new(&image.pyramid(Wrap::Repeat));
    let mut random = Random::new(5);
    let mut sums = [0.0; 4];
    for _ in 0..300 {
        let lookup = Lookup::random(&mut random, [2.0, 4.0], 5.0);
        let (truth, footprint) = (image.truth(&lookup)[0], lookup.footprint(image.size));
        let [texram, ceiling, gaussian] = [Probes::Texram, Probes::TexramCeiling, Probes::Gaussian]
            .map(|probes| table.assemble(lookup.st(), &footprint, probes, 64.0).color[0]);
        let found = [texram, ceiling, gaussian, 0.5];
        for (sum, value) in sums.iter_mut().zip(found) {
            *sum += (f64::from(value) - truth).powi(2);
        }
    }
    let [texram, ceiling, gaussian, grey] = sums;
    assert!(ceiling < texram && gaussian < 0.7 * ceiling && texram < 0.5 * grey, "{sums:?}");
}

/// A value that no float has exactly.
const GREY: f32 = 0.7;

fn storages(count: usize) -> [Texels; 3] {
    [Texels::F32(vec![GREY; count]), Texels::f16_from(&vec![GREY; count]), Texels::Srgb8(vec![180; count])]
}

#[test]
fn a_constant_stays_itself() {
    let mut random = Random::new(1);
    for size in [[64, 64], [48, 20], [33, 7], [1, 9]] {
        for texels in storages((size[0] * size[1]) as usize) {
            for wrap in WRAPS {
                let pyramid = Pyramid::new(size, 1, texels.clone(), [wrap; 2]).unwrap();
                let value = f64::from(pyramid.texel(0, 0, 0)[0]);
                let table = SummedArea::new(&pyramid);
                for _ in 0..40 {
                    let anisotropy = random.log_range(1.0, 100.0);
                    let mut lookup = Lookup::random(&mut random, [0.1, 30.0], anisotropy);
                    if wrap == Wrap::Black {
                        // Within the texture, also when widened by two texels.
                        if size != [64, 64] {
                            continue;
                        }
                        lookup = Lookup { center: DVec2::splat(0.5), major: 4.0, minor: 2.0, ..lookup };
                    }
                    let footprint = lookup.footprint(size);
                    for filter in FILTERS {
                        for magnification in [Magnification::Bilinear, Magnification::Bicubic] {
                            let sampler = Sampler { filter, magnification, ..Sampler::default() };
                            let found = sampler.lookup(&pyramid, lookup.st(), &footprint)[0];
                            let error = (f64::from(found) / value - 1.0).abs();
                            assert!(
                                error <= tol::CONSTANT_TEXTURE,
                                "{filter:?} {wrap:?} {size:?} {lookup:?}: {found}"
                            );
                        }
                    }
                    let found = table.assemble(lookup.st(), &footprint, Probes::Gaussian, 16.0).color[0];
                    assert!(
                        (f64::from(found) / value - 1.0).abs() <= tol::CONSTANT_TEXTURE,
                        "{wrap:?} {lookup:?}: {found}"
                    );
                }
            }
        }
    }
}

#[test]
fn conjugate_vectors_make_no_difference() {
    let image = Image::noise([128, 128], 1, 2);
    let pyramid = image.pyramid(Wrap::Repeat);
    let mut random = Random::new(11);
    let (mut worst, mut printed) = (0.0_f64, 0.0_f64);
    for _ in 0..400 {
        let anisotropy = random.log_range(1.0, 16.0);
        let lookup = Lookup::random(&mut random, [0.4, 8.0], anisotropy);
        let turn = random.range(0.0, std::f64::consts::TAU);
        for filter in FILTERS {
            let sampler = Sampler { filter, max_anisotropy: 64.0, ..Sampler::default() };
            let [a, b] = [0.0, turn]
                .map(|turn| sampler.lookup(&pyramid, lookup.st(), &lookup.conjugate(image.size, turn))[0]);
            let change = f64::from((a - b).abs());
            if filter == Filter::EwaPrinted {
                printed = printed.max(change);
            } else {
                worst = worst.max(change);
            }
        }
    }
    assert!(worst < tol::CONJUGATE, "{worst}");
    assert!(printed > 0.1, "{printed}");
}

/// The jump of variance-compensated EWA at a switch of levels, against its error on both sides.
#[test]
fn no_jump_at_a_level_switch() {
    let images = [Image::checkerboard(256, 16), Image::zone_plate(256), Image::noise([256, 256], 1, 9)];
    for image in images.into_iter().chain(photograph("chelsea.png")) {
        let pyramid = image.pyramid(Wrap::Repeat);
        for quality in [Quality::FAST, Quality::DEFAULT, Quality::REFERENCE] {
            let sampler =
                Sampler { filter: Filter::EwaVc(quality), max_anisotropy: 64.0, ..Sampler::default() };
            let mut random = Random::new(13);
            let (mut jump, mut error) = (0.0, 0.0);
            for i in 0..200 {
                let at = quality.texels() * pyramid.levels()[1 + i % 3].coarseness();
                let lookup = Lookup::random(&mut random, [1.0, 1.0 + 1e-9], 4.0);
                let [below, above] = [1.0 - 1e-5, 1.0 + 1e-5].map(|factor| {
                    let lookup = Lookup { minor: at * factor, major: 4.0 * at * factor, ..lookup };
                    f64::from(sampler.lookup(&pyramid, lookup.st(), &lookup.footprint(image.size))[0])
                });
                let truth = image.truth(&Lookup { minor: at, major: 4.0 * at, ..lookup })[0];
                jump += (below - above).powi(2);
                error += (below - truth).powi(2).max((above - truth).powi(2));
            }
            let [jump, error] = [jump, error].map(|sum: f64| (sum / 200.0).sqrt());
            assert!(jump <= tol::LEVEL_SWITCH * error + 1e-6, "{quality:?}: {jump} {error}");
        }
    }
}

/// From a point to several texels, nothing jumps but at a switch of levels, and where the row of probes becomes
/// longer by one.
#[test]
fn magnification_fades_in() {
    let image = Image::noise([32, 32], 1, 4);
    let pyramid = image.pyramid(Wrap::Repeat);
    for filter in [Filter::Trilinear, Filter::Ewa, Filter::EwaVc(Quality::DEFAULT)] {
        for magnification in [Magnification::Bilinear, Magnification::Bicubic] {
            let sampler = Sampler { filter, magnification, ..Sampler::default() };
            let at = |i: u32| {
                let axis = f64::from(i) * 1e-4;
                let lookup =
                    Lookup { center: DVec2::new(0.31, 0.77), major: axis, minor: 0.5 * axis, angle: 0.7 };
                sampler.lookup(&pyramid, lookup.st(), &lookup.footprint(image.size))[0]
            };
            let largest = (0..15_000).map(|i| (at(i + 1) - at(i)).abs()).fold(0.0, f32::max);
            assert!(largest < 5e-4, "{filter:?} {magnification:?}: {largest}");
        }
    }
}

/// The most texels that a lookup may read, whatever the footprint, for an anisotropy A.
///
/// Of variance-compensated EWA: unless it is the last, a level has texels of t with minor < 2 Q t, so the ellipse
/// there has the semi-axes a = sqrt((2 Q A)^2 + 1.23) and b = sqrt((2 Q)^2 + 1.23) texels at most (1.23: 1/6 over the
/// kernel's variance), texels being t in both axes. They may be half of that in one axis (sizes are rounded up),
/// where area and extent double. A convex set of area F and perimeter P has at most F + P/2 + 1 lattice points
/// (Nosarzewska 1948), and here P/2 <= 8 a. A level of one texel in one axis has 9 rows or columns at most, of 2 a +
/// 1 texels, fewer than that; the last one 9 x 9 texels. Of EWA: the same with Q = 1 and 1/2, at two levels (where 1
/// stands for 1.23). Of probes: 8 texels each.
fn most_texels(filter: Filter, anisotropy: f64) -> f64 {
    let rows = |quality: f64| {
        let a = ((2.0 * quality * anisotropy).powi(2) + 1.23).sqrt();
        let b = ((2.0 * quality).powi(2) + 1.23).sqrt();
        (2.0 * std::f64::consts::PI * a * b + 8.0 * a + 9.0).max(81.0)
    };
    let magnified = 16.0;
    magnified
        + match filter {
            Filter::Trilinear => 8.0,
            Filter::EwaPrinted => 2.0 * (2.0 * (3.0 * anisotropy + 8.0) + 1.0).powi(2),
            Filter::Ewa => rows(1.0) + rows(0.5),
            Filter::Assembly(_) => 8.0 * (2.0 * anisotropy + 1.0),
            Filter::EwaVc(quality) => rows(quality.texels()),
        }
}

/// The bound is not far above what the most costly footprints take.
#[test]
fn the_bound_on_time_is_of_the_right_order() {
    let pyramid = Image::noise([331, 300], 1, 1).pyramid(Wrap::Repeat);
    let mut random = Random::new(67);
    for filter in FILTERS.into_iter().filter(|filter| *filter != Filter::EwaPrinted) {
        let sampler = Sampler { filter, ..Sampler::default() };
        let reads = |_| {
            let lookup = Lookup::random(&mut random, [1.0, 8.0], 20.0);
            sampler.average(&pyramid, lookup.st(), &lookup.footprint([331, 300])).texels
        };
        let most = f64::from((0..2000).map(reads).max().unwrap_or(0));
        assert!(most > 0.25 * most_texels(filter, 16.0), "{filter:?}: {most}");
    }
}

/// Pyramids of all kinds of sizes and values.
static PYRAMIDS: LazyLock<Vec<Pyramid>> =
    LazyLock::new(|| pyramids_of_noise(&[[16, 16], [7, 5], [300, 1], [1, 1], [33, 100], [2, 65]]));

proptest! {
    #![proptest_config(ProptestConfig { cases: 2500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_lookup_is_finite_bounded_and_takes_bounded_time(
        pyramid in 0..48_usize,
        filter in 0..9_usize,
        cubic in any::<bool>(),
        st in [any_float(), any_float()],
        axes in [any_float(), any_float(), any_float(), any_float()],
        max_anisotropy in prop_oneof![any::<u64>().prop_map(f64::from_bits), 1.0..32.0_f64],
        width in prop_oneof![any::<u64>().prop_map(f64::from_bits), Just(1.0_f64)],
    ) {
        let pyramid = &PYRAMIDS[pyramid];
        let (filter, st) = (FILTERS[filter], Vec2::from_array(st));
        let magnification = if cubic { Magnification::Bicubic } else { Magnification::Bilinear };
        let footprint = Footprint { semi_axes: [Vec2::new(axes[0], axes[1]), Vec2::new(axes[2], axes[3])] };
        let sampler = Sampler { filter, magnification, max_anisotropy, width };
        let found = sampler.average(pyramid, st, &footprint);
        let anisotropy = honoured_anisotropy(max_anisotropy);
        prop_assert!(f64::from(found.texels) <= most_texels(filter, anisotropy), "{}", found.texels);
        let Texels::F32(values) = pyramid.levels()[0].texels() else { unreachable!("made of f32") };
        let outside = if pyramid.wrap()[0] == Wrap::Black { 0.0 } else { values[0] };
        let [least, greatest] = [f32::min, f32::max]
            .map(|of_two| f64::from(values.iter().fold(outside, |found, &value| of_two(found, value))));
        let slack = tol::TEXEL_RANGE * least.abs().max(greatest.abs());
        for &value in &found.color[..pyramid.channels()] {
            prop_assert!((least - slack..=greatest + slack).contains(&f64::from(value)), "{found:?}");
        }
        prop_assert!(found.color[pyramid.channels()..].iter().all(|&value| value == 0.0));
    }

    #[test]
    fn any_summed_area_lookup_is_finite_and_bounded(
        pyramid in 0..48_usize,
        st in [any_float(), any_float()],
        axes in [any_float(), any_float(), any_float(), any_float()],
        max_anisotropy in 1.0..64.0_f64,
    ) {
        static TABLES: LazyLock<Vec<SummedArea>> =
            LazyLock::new(|| PYRAMIDS.iter().map(SummedArea::new).collect());
        let table = &TABLES[pyramid];
        let (a, b) = (Vec2::new(axes[0], axes[1]), Vec2::new(axes[2], axes[3]));
        let footprint = Footprint { semi_axes: [a, b] };
        for probes in [Probes::Texram, Probes::TexramCeiling, Probes::Gaussian] {
            let found = table.assemble(st.into(), &footprint, probes, max_anisotropy);
            prop_assert!(found.color.iter().all(|value| value.is_finite()), "{found:?}");
            prop_assert!(f64::from(found.texels) <= 36.0 * 4.0 * (2.0 * max_anisotropy + 1.0));
        }
        prop_assert!(table.rectangle(a, b).color.iter().all(|value| value.is_finite()));
    }
}

/// The spans of rows hold the texels of the ellipse and no others.
#[test]
fn spans_are_exact() {
    let pyramid = Image::noise([64, 64], 1, 6).pyramid(Wrap::Repeat);
    let mut random = Random::new(19);
    for _ in 0..300 {
        let lookup = Lookup::random(&mut random, [1.0, 4.0], 5.0);
        let ellipse = Ellipse::new(&lookup.footprint([64, 64]), [64, 64], 64.0);
        let place = place(pyramid.wrap(), lookup.st());
        let kernel = RowKernel::variance_compensated(&pyramid, place, &ellipse, 1.5);
        let r2 = |x: i64, y: i64| {
            let d = DVec2::new(x as f64, y as f64) - kernel.center;
            kernel.curvature * (d.x - kernel.slope * d.y).powi(2) + kernel.inverse_yy * d.y * d.y
        };
        let (first, last) = kernel.rows();
        for y in -40..104 {
            let span = kernel.span(y);
            for x in -40..104 {
                let inside = (first..=last).contains(&y) && (span.first..=span.last).contains(&x);
                let r2 = r2(x, y);
                assert!(inside == (r2 < 1.0) || (r2 - 1.0).abs() < 1e-9, "{x} {y}: {r2}");
            }
        }
    }
}
