//! The properties of the resolve (docs/specification.md, section 6), on random fragments with deliberate
//! ties, and an oracle that shares no code with `splat-abuffer`.

use std::cell::Cell;

use proptest::prelude::*;
use proptest::sample::{Index, select};
use proptest::test_runner::{RngSeed, TestCaseError, TestRunner};
use splat_abuffer::{
    Coverage, Fragment, Layer, MAX_RANK, MIN_ALPHA, MIN_LAYER_WEIGHT, Resolve, Resolver, SampleColor,
    SplatSurface, Thickness, TileBuffer,
};
use splat_tests::tolerances as tol;

// ---------------------------------------------------------------------------------------------------------
// Running

/// Cases of each property; `PROPTEST_CASES` may ask for more, and `PROPTEST_RNG_SEED` for others.
const CASES: u32 = 4096;

/// Runs a property over a strategy. `test` says whether the case had anything to say; at least a quarter
/// must.
fn check<S: Strategy>(strategy: S, test: impl Fn(S::Value) -> Result<bool, TestCaseError>)
where
    S::Value: std::fmt::Debug,
{
    let given = ProptestConfig::default();
    let config = ProptestConfig {
        cases: given.cases.max(CASES),
        rng_seed: if given.rng_seed == RngSeed::Random { RngSeed::Fixed(2002) } else { given.rng_seed },
        failure_persistence: None,
        ..given
    };
    let cases = config.cases;
    let telling = Cell::new(0);
    let result = TestRunner::new(config).run(&strategy, |case| {
        telling.set(telling.get() + u32::from(test(case)?));
        Ok(())
    });
    if let Err(error) = result {
        panic!("{error}");
    }
    assert!(telling.get() >= cases / 4, "only {} of {cases} cases said anything", telling.get());
}

// ---------------------------------------------------------------------------------------------------------
// Random samples

/// The fragments of a sample in order of arrival, and the surfaces of all splats.
#[derive(Debug, Clone)]
struct Sample {
    fragments: Vec<Fragment>,
    surfaces: Vec<SplatSurface>,
}

/// What the fragments of a sample are drawn from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Palette {
    /// Anything, with many ties and values at thresholds.
    Any,
    /// Weights from 1/64 to 4, so that no layer comes near the least weight.
    Moderate,
    /// Numbers with so few binary digits that every sum of a layer is exact.
    Exact,
    /// Mostly opaque splats of at least half the weight of a layer.
    Solid,
}

fn depths() -> impl Strategy<Value = f32> {
    prop_oneof![3 => select(vec![1.0, 1.25, 1.5, 1.5f32.next_up(), 2.0, 3.0]), 2 => 0.5f32..4.0]
}

fn weights(palette: Palette) -> BoxedStrategy<f32> {
    let log_uniform = |lo: i32, hi: i32| (lo..hi, 1.0f32..2.0).prop_map(|(e, m)| m * 2f32.powi(e));
    let thresholds =
        select(vec![0.25, 0.5, 0.5f32.next_down(), 1.0, MIN_LAYER_WEIGHT, MIN_LAYER_WEIGHT.next_down()]);
    match palette {
        Palette::Any => prop_oneof![
            3 => thresholds,
            3 => log_uniform(-5, 1),
            1 => log_uniform(-60, -10),
            1 => log_uniform(10, 30),
        ]
        .boxed(),
        Palette::Moderate => log_uniform(-6, 2).boxed(),
        Palette::Exact => (1u32..=256).prop_map(|n| n as f32 / 64.0).boxed(),
        Palette::Solid => log_uniform(-1, 3).boxed(),
    }
}

/// A channel of a colour; a proxy for the least visible step is 1/8.
fn channels(palette: Palette) -> BoxedStrategy<f32> {
    match palette {
        Palette::Exact => (-32i32..=32).prop_map(|n| n as f32 / 8.0).boxed(),
        _ => prop_oneof![1 => select(vec![0.0, 0.5, 1.0, -0.25, 4.0]), 1 => -1.0f32..5.0].boxed(),
    }
}

fn opacities(palette: Palette) -> BoxedStrategy<f32> {
    match palette {
        Palette::Exact => (0u32..=8).prop_map(|n| n as f32 / 8.0).boxed(),
        Palette::Solid => prop_oneof![9 => Just(1.0f32), 1 => 0.01f32..1.0].boxed(),
        _ => prop_oneof![2 => select(vec![0.0, 0.5, 1.0]), 2 => 0.01f32..1.0].boxed(),
    }
}

/// A depth, and an interval that contains it in the form that the thickness reads.
fn placed(thickness: Thickness) -> BoxedStrategy<(f32, [f32; 2])> {
    match thickness {
        Thickness::AroundHit => {
            let slope = select(vec![0.0, 0.01, 0.05, 0.25, f32::INFINITY]);
            let cap = prop_oneof![
                19 => select(vec![0.0, 0.01, 0.125, 0.5]),
                1 => Just(f32::INFINITY),
            ];
            (depths(), slope, cap).prop_map(|(depth, slope, cap)| (depth, [slope, cap])).boxed()
        }
        Thickness::WholeSplat => (depths(), select(vec![0.0, 0.25, 0.5, 1.0]), 0.0f32..=1.0)
            .prop_map(|(near, length, part)| {
                ((near + part * length).min(near + length), [near, near + length])
            })
            .boxed(),
    }
}

/// Up to 14 fragments, in any order of arrival; some splats leave none.
fn samples(thickness: Thickness, palette: Palette) -> impl Strategy<Value = Sample> {
    let color = [channels(palette), channels(palette), channels(palette)];
    let splat = (placed(thickness), weights(palette), opacities(palette), color, any::<bool>());
    prop::collection::vec((splat, prop::bool::weighted(0.9)), 0..15)
        .prop_map(|splats| {
            let mut sample = Sample { fragments: vec![], surfaces: vec![] };
            for (rank, (((depth, interval), weight, opacity, color, back), hit)) in
                splats.into_iter().enumerate()
            {
                sample.surfaces.push(SplatSurface { color, opacity, interval });
                if hit {
                    sample.fragments.push(Fragment::new(depth, weight, rank as u32, back));
                }
            }
            sample
        })
        .prop_flat_map(|sample| {
            let surfaces = sample.surfaces;
            Just(sample.fragments)
                .prop_shuffle()
                .prop_map(move |fragments| Sample { fragments, surfaces: surfaces.clone() })
        })
}

fn thicknesses() -> impl Strategy<Value = Thickness> {
    select(vec![Thickness::AroundHit, Thickness::WholeSplat])
}

fn soft() -> impl Strategy<Value = Coverage> {
    select(vec![0.25, 0.5, 1.0, 1.5, 3.0]).prop_map(|saturation| Coverage::Soft { saturation })
}

fn coverages() -> impl Strategy<Value = Coverage> {
    prop_oneof![Just(Coverage::Opaque), soft()]
}

/// `surface` in all its modes, and a sample for it.
fn surface_scenes(palette: Palette) -> impl Strategy<Value = (Resolve, Sample)> {
    (coverages(), thicknesses()).prop_flat_map(move |(coverage, thickness)| {
        let mode = Resolve::Surface { coverage, thickness };
        samples(thickness, palette).prop_map(move |sample| (mode, sample))
    })
}

/// `over`, and a sample for it.
fn over_scenes(palette: Palette) -> impl Strategy<Value = (Resolve, Sample)> {
    samples(Thickness::AroundHit, palette).prop_map(|sample| (Resolve::Over, sample))
}

fn scenes(palette: Palette) -> impl Strategy<Value = (Resolve, Sample)> {
    prop_oneof![3 => surface_scenes(palette), 1 => over_scenes(palette)]
}

// ---------------------------------------------------------------------------------------------------------
// Resolving

/// Everything that a resolve tells, layers as the ranks of their fragments.
#[derive(Debug, Clone, PartialEq)]
struct Resolved {
    sample: SampleColor,
    layers: Vec<Vec<u32>>,
    visible: Option<Vec<u32>>,
}

fn resolve_with(resolver: &mut Resolver, sample: &Sample) -> Resolved {
    let mut fragments = sample.fragments.clone();
    let color = resolver.resolve(&mut fragments, &sample.surfaces);
    let ranks = |layer: &Layer| resolver.fragments_of(layer, &fragments).map(Fragment::rank).collect();
    let layers = resolver.layers().iter().map(ranks).collect();
    Resolved { sample: color, layers, visible: resolver.visible_layer().map(ranks) }
}

fn resolve(mode: Resolve, sample: &Sample) -> Resolved {
    resolve_with(&mut Resolver::new(mode), sample)
}

/// The bits of a colour: -0 and 0 differ, and a NaN equals itself.
fn bits(sample: SampleColor) -> [u32; 5] {
    let [red, green, blue] = sample.color;
    [red, green, blue, sample.transmittance, sample.uncovered].map(f32::to_bits)
}

/// The largest channel of the surfaces, and at least 1.
fn brightest(sample: &Sample) -> f32 {
    sample.surfaces.iter().flat_map(|surface| surface.color).fold(1.0, |most, c| most.max(c.abs()))
}

/// Whether two results agree to the rounding of sums of so many fragments.
fn assert_close(a: SampleColor, b: SampleColor, sample: &Sample) -> Result<(), TestCaseError> {
    let rounding = tol::resolve_rounding(sample.fragments.len() + 1);
    for (a, b) in a.color.into_iter().zip(b.color) {
        let bound = rounding * brightest(sample);
        prop_assert!((a - b).abs() <= bound, "{a} and {b} differ by more than {bound}");
    }
    for (a, b) in [(a.transmittance, b.transmittance), (a.uncovered, b.uncovered)] {
        prop_assert!((a - b).abs() <= rounding, "{a} and {b} differ by more than {rounding}");
    }
    Ok(())
}

// ---------------------------------------------------------------------------------------------------------
// The oracle

/// A layer, as the specification describes it.
#[derive(Debug, Clone)]
struct OracleLayer {
    ranks: Vec<u32>,
    nearest: f32,
    back: bool,
    far_end: f32,
    weight: f32,
    weight_opacity: f32,
    color: [f32; 3],
    coverage: f32,
}

impl OracleLayer {
    fn alpha(&self) -> f32 {
        (self.coverage * (self.weight_opacity / self.weight)).min(1.0)
    }
}

/// The closed interval of a fragment.
fn interval(thickness: Thickness, fragment: &Fragment, surface: &SplatSurface) -> [f32; 2] {
    let [a, b] = surface.interval;
    match thickness {
        Thickness::WholeSplat => [a, b],
        Thickness::AroundHit => {
            let e = if a * fragment.depth < b { a * fragment.depth } else { b };
            [fragment.depth - e, fragment.depth + e]
        }
    }
}

/// The layers of a sample, front to back: connected components of the interval graph by union-find over all
/// pairs.
fn oracle_layers(coverage: Coverage, thickness: Thickness, sample: &Sample) -> Vec<OracleLayer> {
    let mut fragments = sample.fragments.clone();
    fragments.sort_by_key(Fragment::rank);
    let surface = |f: &Fragment| &sample.surfaces[f.rank() as usize];
    let intervals: Vec<[f32; 2]> = fragments.iter().map(|f| interval(thickness, f, surface(f))).collect();
    let mut parent: Vec<usize> = (0..fragments.len()).collect();
    for i in 0..fragments.len() {
        for j in 0..i {
            let overlap = intervals[i][0] <= intervals[j][1] && intervals[j][0] <= intervals[i][1];
            if overlap && fragments[i].is_back() == fragments[j].is_back() {
                // Everything of one component gets the name of the other.
                let (from, to) = (parent[i], parent[j]);
                parent.iter_mut().filter(|name| **name == from).for_each(|name| *name = to);
            }
        }
    }
    let mut layers = Vec::new();
    for name in 0..fragments.len() {
        let members: Vec<usize> = (0..fragments.len()).filter(|&i| parent[i] == name).collect();
        let Some(&first) = members.first() else { continue };
        let mut layer = OracleLayer {
            ranks: members.iter().map(|&i| fragments[i].rank()).collect(),
            nearest: f32::INFINITY,
            back: fragments[first].is_back(),
            far_end: f32::NEG_INFINITY,
            weight: 0.0,
            weight_opacity: 0.0,
            color: [0.0; 3],
            coverage: 0.0,
        };
        for i in members {
            let SplatSurface { color, opacity, .. } = *surface(&fragments[i]);
            let weight_opacity = fragments[i].weight * opacity;
            layer.nearest = layer.nearest.min(fragments[i].depth);
            layer.far_end = layer.far_end.max(intervals[i][1]);
            layer.weight += fragments[i].weight;
            layer.weight_opacity += weight_opacity;
            for (sum, color) in layer.color.iter_mut().zip(color) {
                *sum += weight_opacity * color;
            }
        }
        layer.coverage = match coverage {
            _ if layer.weight < 1e-3 => 0.0,
            Coverage::Opaque if layer.weight < 0.5 => 0.0,
            Coverage::Opaque => 1.0,
            Coverage::Soft { saturation } if layer.weight >= saturation => 1.0,
            Coverage::Soft { saturation } => layer.weight / saturation,
        };
        if layer.coverage > 0.0 {
            layers.push(layer);
        }
    }
    layers.sort_by(|a, b| {
        let key = |layer: &OracleLayer| (layer.nearest, layer.back, layer.ranks[0]);
        key(a).partial_cmp(&key(b)).expect("depths are numbers")
    });
    layers
}

/// What `surface` must give.
fn oracle(coverage: Coverage, thickness: Thickness, sample: &Sample) -> Resolved {
    let layers = oracle_layers(coverage, thickness, sample);
    let mut result = SampleColor { color: [0.0; 3], transmittance: 1.0, uncovered: 1.0 };
    let mut visible = None;
    for layer in &layers {
        let alpha = layer.alpha();
        for channel in 0..3 {
            if layer.weight_opacity > 0.0 {
                let color = layer.color[channel] / layer.weight_opacity;
                result.color[channel] += result.transmittance * alpha * color;
            }
        }
        result.transmittance *= 1.0 - alpha;
        result.uncovered *= 1.0 - layer.coverage;
        if result.transmittance <= 0.5 && visible.is_none() {
            visible = Some(layer.ranks.clone());
        }
    }
    Resolved { sample: result, layers: layers.into_iter().map(|layer| layer.ranks).collect(), visible }
}

#[test]
fn surface_equals_the_oracle_bit_for_bit() {
    check(surface_scenes(Palette::Any), |(mode, sample)| {
        let Resolve::Surface { coverage, thickness } = mode else { unreachable!("only `surface` is drawn") };
        let expected = oracle(coverage, thickness, &sample);
        let found = resolve(mode, &sample);
        prop_assert_eq!(bits(found.sample), bits(expected.sample));
        prop_assert_eq!(&found, &expected);
        Ok(expected.layers.len() >= 2)
    });
}

#[test]
fn over_equals_sorting_and_blending() {
    check(over_scenes(Palette::Any), |(mode, sample)| {
        let mut sorted = sample.fragments.clone();
        sorted.sort_by(|a, b| (a.depth, a.rank()).partial_cmp(&(b.depth, b.rank())).expect("numbers"));
        let (mut transmittance, mut color, mut ranks) = (1.0f32, [0.0f64; 3], Vec::new());
        let mut visible = None;
        for fragment in &sorted {
            let surface = &sample.surfaces[fragment.rank() as usize];
            let alpha = fragment.weight * surface.opacity;
            if alpha < MIN_ALPHA {
                continue;
            }
            ranks.push(vec![fragment.rank()]);
            let alpha = alpha.min(1.0);
            for (sum, color) in color.iter_mut().zip(surface.color) {
                *sum += f64::from(transmittance * alpha) * f64::from(color);
            }
            transmittance *= 1.0 - alpha;
            if transmittance <= 0.5 && visible.is_none() {
                visible = Some(vec![fragment.rank()]);
            }
        }
        let found = resolve(mode, &sample);
        prop_assert_eq!(found.sample.transmittance.to_bits(), transmittance.to_bits());
        prop_assert_eq!(found.sample.uncovered, if ranks.is_empty() { 1.0 } else { 0.0 });
        prop_assert_eq!(&found.layers, &ranks);
        prop_assert_eq!(&found.visible, &visible);
        for (found, expected) in found.sample.color.into_iter().zip(color) {
            let error = (f64::from(found) - expected).abs();
            let bound = f64::from(tol::resolve_rounding(ranks.len()) * brightest(&sample));
            prop_assert!(error <= bound, "{found}, expected {expected}: {error} > {bound}");
        }
        Ok(ranks.len() >= 2)
    });
}

#[test]
fn over_skips_what_is_fainter_than_one_step_of_eight_bits() {
    let one = |weight: f32| Sample {
        fragments: vec![Fragment::new(1.0, weight, 0, false)],
        surfaces: vec![SplatSurface { color: [1.0; 3], opacity: 1.0, interval: [0.0; 2] }],
    };
    assert_eq!(resolve(Resolve::Over, &one(1.0 / 255.0)).sample.transmittance, 1.0 - 1.0 / 255.0);
    assert_eq!(resolve(Resolve::Over, &one((1.0f32 / 255.0).next_down())).sample.transmittance, 1.0);
}

// ---------------------------------------------------------------------------------------------------------
// The seven properties

#[test]
fn property_1_the_order_of_arrival_changes_no_bit() {
    let shuffled = scenes(Palette::Any).prop_flat_map(|(mode, sample)| {
        let arrival = Just(sample.fragments.clone()).prop_shuffle();
        (Just(mode), Just(sample), arrival)
    });
    check(shuffled, |(mode, sample, arrival)| {
        // The second one in a resolver that has seen another sample: its scratch memory must not matter.
        let other = Sample { fragments: arrival, ..sample.clone() };
        let mut used = Resolver::new(mode);
        let first = resolve_with(&mut used, &sample);
        let second = resolve_with(&mut used, &other);
        prop_assert_eq!(bits(first.sample), bits(second.sample));
        prop_assert_eq!(&first, &second);
        Ok(other.fragments != sample.fragments)
    });
}

/// The sample with one fragment split into two halves that differ in rank only: neighbours in rank, or with
/// the second half behind all others.
fn split(sample: &Sample, which: Index, adjacent: bool) -> Option<Sample> {
    if sample.fragments.is_empty() {
        return None;
    }
    let which = which.index(sample.fragments.len());
    let Sample { mut fragments, mut surfaces } = sample.clone();
    let half = fragments[which];
    let rank = if adjacent {
        // Every splat gets a twin.
        surfaces = surfaces.into_iter().flat_map(|surface| [surface; 2]).collect();
        for f in &mut fragments {
            *f = Fragment::new(f.depth, f.weight, 2 * f.rank(), f.is_back());
        }
        2 * half.rank() + 1
    } else {
        surfaces.push(surfaces[half.rank() as usize]);
        surfaces.len() as u32 - 1
    };
    fragments[which].weight *= 0.5;
    fragments.push(Fragment::new(half.depth, 0.5 * half.weight, rank, half.is_back()));
    Some(Sample { fragments, surfaces })
}

// Properties 2 and 3 are of `surface` alone: for `over` every fragment is a layer with an alpha of its own,
// and two of half the weight let 1 - a + a^2/4 through instead of 1 - a.

#[test]
fn property_2_splitting_a_fragment_changes_nothing() {
    // Where all sums are exact, not one bit; layers of just half the weight included.
    let strategy = (surface_scenes(Palette::Exact), any::<Index>(), any::<bool>());
    check(strategy, |((mode, sample), which, adjacent)| {
        let Some(other) = split(&sample, which, adjacent) else { return Ok(false) };
        let [before, after] = [&sample, &other].map(|sample| resolve(mode, sample));
        prop_assert_eq!(bits(before.sample), bits(after.sample));
        prop_assert_eq!(before.layers.len(), after.layers.len());
        Ok(!before.layers.is_empty())
    });
}

#[test]
fn property_2_splitting_a_fragment_changes_nothing_but_rounding() {
    let strategy = (surface_scenes(Palette::Any), any::<Index>(), any::<bool>());
    check(strategy, |((mode, sample), which, adjacent)| {
        let Some(other) = split(&sample, which, adjacent) else { return Ok(false) };
        let Resolve::Surface { thickness, .. } = mode else { unreachable!("only `surface` is drawn") };
        // A layer whose weight is a threshold's to rounding may fall to either side of it.
        let every = Coverage::Soft { saturation: 1.0 };
        let near =
            |weight: f32, threshold: f32| (weight / threshold - 1.0).abs() <= tol::resolve_rounding(16);
        let ambiguous = oracle_layers(every, thickness, &sample)
            .iter()
            .any(|layer| near(layer.weight, 0.5) || near(layer.weight, MIN_LAYER_WEIGHT));
        if ambiguous {
            return Ok(false);
        }
        let [before, after] = [&sample, &other].map(|sample| resolve(mode, sample));
        assert_close(before.sample, after.sample, &sample)?;
        prop_assert_eq!(before.layers.len(), after.layers.len());
        Ok(!before.layers.is_empty())
    });
}

fn scaled(sample: &Sample, factor: f32) -> Sample {
    let scale = |f: &Fragment| Fragment::new(f.depth, f.weight * factor, f.rank(), f.is_back());
    Sample { fragments: sample.fragments.iter().map(scale).collect(), surfaces: sample.surfaces.clone() }
}

#[test]
fn property_3_scaling_weights_and_saturation_changes_nothing() {
    // The least weight of a layer is fixed, so no layer may cross it: weights are 1/64 at least, and are
    // scaled by 1/8 at least. Powers of two commute with rounding: not one bit may change. Other factors:
    // rounding.
    let strategy = (thicknesses(), select(vec![0.25, 1.0, 3.0])).prop_flat_map(|(thickness, saturation)| {
        (samples(thickness, Palette::Moderate), Just((thickness, saturation)), -3i32..=30, 1.0f32..2.0)
    });
    check(strategy, |(sample, (thickness, saturation), exponent, other)| {
        let mode = |saturation| Resolve::Surface { coverage: Coverage::Soft { saturation }, thickness };
        let before = resolve(mode(saturation), &sample);
        let factor = 2f32.powi(exponent);
        let after = resolve(mode(saturation * factor), &scaled(&sample, factor));
        prop_assert_eq!(bits(before.sample), bits(after.sample));
        prop_assert_eq!(&before, &after);
        let factor = factor * other;
        let after = resolve(mode(saturation * factor), &scaled(&sample, factor));
        assert_close(before.sample, after.sample, &sample)?;
        prop_assert_eq!(&before.layers, &after.layers);
        Ok(!before.layers.is_empty())
    });
}

#[test]
fn property_3_opaque_layers_stay_so_when_weights_grow() {
    // The threshold of `opaque` is fixed at 1/2: scaling must leave every layer on its side. Where each
    // fragment alone has half the weight, so has each layer, and growing changes nothing.
    let strategy = thicknesses().prop_flat_map(|thickness| {
        (samples(thickness, Palette::Solid), Just(Resolve::Surface { coverage: Coverage::Opaque, thickness }))
    });
    check((strategy, 0i32..=40), |((sample, mode), exponent)| {
        let before = resolve(mode, &sample);
        let after = resolve(mode, &scaled(&sample, 2f32.powi(exponent)));
        prop_assert_eq!(bits(before.sample), bits(after.sample));
        prop_assert_eq!(&before, &after);
        Ok(!before.layers.is_empty())
    });
}

/// Whether red and green over blue lie in the convex hull of the fragments' (red, green), where blue is 1 in
/// all of them, so that blue is the alpha to which every channel was weighted.
fn assert_in_hull(
    sample: SampleColor,
    surfaces: &[SplatSurface],
    fragments: &[Fragment],
) -> Result<(), TestCaseError> {
    let [red, green, alpha] = sample.color;
    let error = (alpha - (1.0 - sample.transmittance)).abs();
    prop_assert!(
        error <= tol::resolve_rounding(fragments.len()),
        "a colour of 1 gives {alpha} in {:?}",
        sample
    );
    let colors: Vec<[f32; 3]> = fragments.iter().map(|f| surfaces[f.rank() as usize].color).collect();
    let largest = colors.iter().flat_map(|c| [c[0].abs(), c[1].abs()]).fold(1.0, f32::max);
    let slack = tol::resolve_rounding(fragments.len()) * largest;
    // The hull's extent in 16 directions; those of the axes are the bounds of each channel.
    for step in 0..16 {
        let angle = std::f32::consts::TAU * step as f32 / 16.0;
        let reach = |color: [f32; 2]| color[0] * angle.cos() + color[1] * angle.sin();
        let most = colors.iter().map(|c| reach([c[0], c[1]])).fold(f32::NEG_INFINITY, f32::max);
        let found = reach([red / alpha, green / alpha]);
        prop_assert!(found <= most + slack, "{:?} / {alpha} leaves the hull by {}", sample, found - most);
    }
    Ok(())
}

#[test]
fn property_4_a_layer_s_colour_is_in_the_hull_of_its_fragments() {
    check(scenes(Palette::Any), |(mode, mut sample)| {
        // Below 2^-24 a product with an opacity of .01 and a small colour still has all its digits.
        sample.fragments.iter_mut().for_each(|f| f.weight = f.weight.max(2f32.powi(-24)));
        sample.surfaces.iter_mut().for_each(|surface| surface.color[2] = 1.0);
        let whole = resolve(mode, &sample);
        if whole.sample.color[2] > 0.0 {
            let seen: Vec<Fragment> = (sample.fragments.iter().copied())
                .filter(|f| whole.layers.iter().any(|layer| layer.contains(&f.rank())))
                .collect();
            assert_in_hull(whole.sample, &sample.surfaces, &seen)?;
        }
        // Each layer by itself.
        for layer in &whole.layers {
            let members = sample.fragments.iter().copied().filter(|f| layer.contains(&f.rank())).collect();
            let alone = Sample { fragments: members, surfaces: sample.surfaces.clone() };
            let color = resolve(mode, &alone).sample;
            if color.color[2] > 0.0 {
                assert_in_hull(color, &alone.surfaces, &alone.fragments)?;
            }
        }
        Ok(whole.layers.iter().any(|layer| layer.len() >= 2) || mode == Resolve::Over)
    });
}

#[test]
fn property_5_alpha_and_coverage_are_between_0_and_1() {
    check(scenes(Palette::Any), |(mode, sample)| {
        let Resolved { sample: SampleColor { color, transmittance, uncovered }, layers, .. } =
            resolve(mode, &sample);
        prop_assert!((0.0..=1.0).contains(&transmittance), "{transmittance}");
        prop_assert!((0.0..=1.0).contains(&uncovered), "{uncovered}");
        // Opacity can only let more light through.
        prop_assert!(uncovered <= transmittance, "{uncovered} > {transmittance}");
        prop_assert!(color.iter().all(|value| value.is_finite()), "{color:?}");
        prop_assert!(!layers.is_empty() || (transmittance == 1.0 && color == [0.0; 3]));
        Ok(!layers.is_empty())
    });
}

#[test]
fn property_6_alpha_grows_with_every_opacity() {
    // Every operation on the way from an opacity to the transmittance is monotone, and so is its rounding: no
    // slack.
    check((scenes(Palette::Any), any::<Index>(), 0.0f32..=1.0), |((mode, sample), which, raise)| {
        if sample.surfaces.is_empty() {
            return Ok(false);
        }
        let mut raised = sample.clone();
        let opacity = &mut raised.surfaces[which.index(sample.surfaces.len())].opacity;
        *opacity += (1.0 - *opacity) * raise;
        let [before, after] = [&sample, &raised].map(|sample| resolve(mode, sample).sample);
        prop_assert!(
            after.transmittance <= before.transmittance,
            "{} -> {}",
            before.transmittance,
            after.transmittance
        );
        prop_assert!(after.uncovered <= before.uncovered);
        Ok(after.transmittance < before.transmittance)
    });
}

#[test]
fn property_7_what_lies_wholly_behind_an_opaque_layer_changes_no_bit() {
    // Behind means: the interval begins behind the far end of the opaque layer and of every layer before it.
    // (Behind the opaque layer alone is not enough: a fragment of the other facing can belong to a long layer
    // that begins in front of it.)
    let strategy =
        (surface_scenes(Palette::Solid), 0.0f32..2.0, (placed(Thickness::AroundHit), any::<bool>()));
    check(strategy, |((mode, sample), gap, (added, back))| {
        let Resolve::Surface { coverage, thickness } = mode else { unreachable!("only `surface` is drawn") };
        let layers = oracle_layers(coverage, thickness, &sample);
        let Some(opaque) = layers.iter().position(|layer| layer.alpha() == 1.0) else { return Ok(false) };
        let end = layers[..=opaque].iter().map(|layer| layer.far_end).fold(0.0, f32::max);
        if end == f32::INFINITY {
            return Ok(false);
        }
        let mut other = sample.clone();
        let rank = other.surfaces.len() as u32;
        let (depth, surface_interval) = match thickness {
            // A cap of 1 at most, so that there is a depth at which the interval begins behind.
            Thickness::AroundHit => {
                let [slope, cap] = added.1;
                let cap = cap.min(1.0);
                ((end + cap).next_up() + gap, [slope, cap])
            }
            Thickness::WholeSplat => (end.next_up() + gap, [end.next_up(), end + 3.0]),
        };
        let surface = SplatSurface { color: [7.0, -3.0, 0.5], opacity: 0.5, interval: surface_interval };
        let fragment = Fragment::new(depth, 2.0, rank, back);
        if interval(thickness, &fragment, &surface)[0] <= end {
            // Rounding closed the gap.
            return Ok(false);
        }
        other.surfaces.push(surface);
        other.fragments.insert(0, fragment);
        let [before, after] = [&sample, &other].map(|sample| resolve(mode, sample));
        prop_assert_eq!(bits(before.sample), bits(after.sample));
        prop_assert_eq!(&before.visible, &after.visible);
        Ok(true)
    });
}

#[test]
fn property_7_what_lies_behind_an_opaque_fragment_changes_no_bit_in_over() {
    check((over_scenes(Palette::Solid), 0.0f32..2.0, any::<bool>()), |((mode, sample), gap, back)| {
        let alpha = |f: &Fragment| f.weight * sample.surfaces[f.rank() as usize].opacity;
        let opaque = sample.fragments.iter().filter(|f| alpha(f) >= 1.0).map(|f| f.depth);
        let Some(nearest) = opaque.reduce(f32::min) else { return Ok(false) };
        let mut other = sample.clone();
        // Without a gap at the very depth, where the rank decides: the greater one is behind.
        let rank = other.surfaces.len() as u32;
        other.surfaces.push(SplatSurface { color: [7.0, -3.0, 0.5], opacity: 0.5, interval: [0.0; 2] });
        let depth = if gap < 0.5 { nearest } else { nearest + gap };
        other.fragments.insert(0, Fragment::new(depth, 1.0, rank, back));
        let [before, after] = [&sample, &other].map(|sample| resolve(mode, sample));
        prop_assert_eq!(bits(before.sample), bits(after.sample));
        prop_assert_eq!(&before.visible, &after.visible);
        Ok(true)
    });
}

// ---------------------------------------------------------------------------------------------------------
// Fragments and their storage

/// Numbers that a careless renderer would let in, and others.
fn awkward() -> impl Strategy<Value = f32> {
    let special = [
        0.0,
        -0.0,
        f32::NAN,
        -f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::MIN_POSITIVE,
        f32::from_bits(1),
        f32::MAX,
        -f32::MAX,
        1.0,
        -1.0,
    ];
    prop_oneof![select(special.to_vec()), any::<u32>().prop_map(f32::from_bits)]
}

#[test]
fn only_finite_fragments_of_a_positive_weight_are_admitted() {
    check((awkward(), awkward(), 0..=MAX_RANK, any::<bool>()), |(depth, weight, rank, back)| {
        let fragment = Fragment::new(depth, weight, rank, back);
        let class = |value: f32| value.to_bits() >> 23 & 0xff;
        let positive = weight.to_bits() >> 31 == 0 && weight.to_bits() != 0;
        let expected = class(depth) != 0xff && class(weight) != 0xff && positive;
        prop_assert_eq!(fragment.is_admitted(), expected, "{:?}", fragment);
        prop_assert_eq!((fragment.rank(), fragment.is_back()), (rank, back));
        let mut buffer = TileBuffer::default();
        buffer.clear(1);
        buffer.push(0, fragment);
        prop_assert_eq!(buffer.len(), usize::from(expected));
        prop_assert_eq!(buffer.is_empty(), !expected);
        buffer.group();
        prop_assert_eq!(buffer.sample(0).len(), usize::from(expected));
        Ok(expected)
    });
}

/// Tiles of some samples, each with a stream of (sample, rank), one after the other in one buffer.
fn tiles() -> impl Strategy<Value = Vec<(usize, Vec<usize>)>> {
    let tile =
        (1usize..20).prop_flat_map(|samples| (Just(samples), prop::collection::vec(0..samples, 0..60)));
    prop::collection::vec(tile, 1..4)
}

/// The lists that a stream of samples must give; fragment i has rank i.
fn lists(samples: usize, stream: &[usize]) -> Vec<Vec<u32>> {
    let list = |sample| (0..stream.len()).filter(|&i| stream[i] == sample).map(|i| i as u32).collect();
    (0..samples).map(list).collect()
}

fn found_lists(buffer: &mut TileBuffer, samples: usize) -> Vec<Vec<u32>> {
    (0..samples).map(|sample| buffer.sample(sample).iter().map(Fragment::rank).collect()).collect()
}

fn push_all(buffer: &mut TileBuffer, stream: &[usize], first_rank: usize) {
    for (i, &sample) in stream.iter().enumerate() {
        buffer.push(sample, Fragment::new(1.0, 1.0, (first_rank + i) as u32, false));
    }
}

#[test]
fn a_buffer_groups_tile_after_tile() {
    check(tiles(), |tiles| {
        let mut buffer = TileBuffer::default();
        for (samples, stream) in &tiles {
            buffer.clear(*samples);
            prop_assert!(buffer.is_empty());
            push_all(&mut buffer, stream, 0);
            prop_assert_eq!(buffer.len(), stream.len());
            buffer.group();
            prop_assert_eq!(found_lists(&mut buffer, *samples), lists(*samples, stream));
        }
        Ok(tiles.iter().any(|(_, stream)| stream.len() > 1))
    });
}

#[test]
fn a_buffer_can_be_grouped_again() {
    // After more fragments, or after the lists were sorted by a resolve.
    check((tiles(), any::<Index>()), |(tiles, cut)| {
        let (samples, stream) = &tiles[0];
        let cut = cut.index(stream.len() + 1);
        let mut buffer = TileBuffer::default();
        buffer.clear(*samples);
        push_all(&mut buffer, &stream[..cut], 0);
        buffer.group();
        for sample in 0..*samples {
            buffer.sample(sample).reverse();
        }
        push_all(&mut buffer, &stream[cut..], cut);
        buffer.group();
        prop_assert_eq!(found_lists(&mut buffer, *samples), lists(*samples, stream));
        Ok(!stream.is_empty())
    });
}
