//! The fast core against the reference: the same fragments and the same pictures, bit for bit, at every level.
//!
//! `SPLAT_CASES=N` tries N times as many cases of everything, the usual ones among them:
//! `SPLAT_CASES=20 cargo test -p splat-tests --test cores`.

use glam::{DQuat, DVec3, Vec3};
use proptest::prelude::*;
use splat_abuffer::{Coverage, Fragment, MIN_LAYER_WEIGHT, Resolve, Thickness};
use splat_core::raster::{Form, SamplePlace};
use splat_core::render::Frame;
use splat_core::setup::VisibleSplat;
use splat_core::{
    AovSelection, Camera, Cloud, Distortion, Film, Kernel, Lens, PatternKind, PixelFilter, PixelRect,
    RenderOptions, Shapes, TableMode,
};
use splat_simd::{Level, Method, Renderer};
use splat_tests::cases::{check, factor};
use splat_tests::hard_scenes::{Facing, Kind, Knowledge, Sheets, adversarial, moved, sheets};
use splat_tests::random::Random;
use splat_tests::scenes::{OPAQUE, Scene, golden, jumble, orthographic, pinhole, soft, sphere, with_lens};
use std::cell::RefCell;
use std::collections::BTreeMap;

// ---------------------------------------------------------------------------------------------------------
// Tallies

/// What was compared: numbers of splat-pixel pairs, of fragments, and of fragments of each sort.
#[derive(Debug, Default)]
struct Tally {
    pairs: u64,
    fragments: u64,
    sorts: BTreeMap<String, u64>,
}

impl Tally {
    fn count(&mut self, sort: impl ToString, fragments: u64) {
        *self.sorts.entry(sort.to_string()).or_default() += fragments;
    }

    fn add(&mut self, other: Self) {
        self.pairs += other.pairs;
        self.fragments += other.fragments;
        for (sort, count) in other.sorts {
            self.count(sort, count);
        }
    }

    /// Checks that there were fragments of each of these sorts.
    fn expect(&self, sorts: &[&str], least: u64) {
        for &sort in sorts {
            let count = self.sorts.get(sort).copied().unwrap_or(0);
            assert!(count >= least, "{count} fragments of {sort}: {self:#?}");
        }
    }
}

// ---------------------------------------------------------------------------------------------------------
// Comparing

type Bits = (u32, SamplePlace, u32, bool, u32, u32);

fn fragment_bits(place: SamplePlace, index: u32, f: Fragment) -> Bits {
    (index, place, f.rank(), f.is_back(), f.depth.to_bits(), f.weight.to_bits())
}

/// The pixels near a splat: far more than those that set-up takes for its candidates.
fn surroundings(splat: &VisibleSplat, window: &PixelRect) -> PixelRect {
    let PixelRect { x0, y0, x1, y1 } = splat.bounds;
    let [x, y] = [8 + (x1 - x0) / 4, 8 + (y1 - y0) / 4];
    PixelRect::new(x0 - x, y0 - y, x1 + x, y1 + y).intersect(window)
}

/// What there is to say about a visible splat.
fn sorts_of(splat: &VisibleSplat, frame: &Frame) -> Vec<&'static str> {
    let all = [
        (splat.plain, "plain"),
        (!splat.plain, "not plain"),
        (splat.flips, "flips"),
        (splat.flips && splat.back, "flips, its back to the eye"),
        (!splat.constants.centred, "not centred"),
        (splat.outline.is_known(), "outline known"),
        (!splat.outline.is_known(), "outline unknown"),
        (splat.bounds.area() == 1, "one pixel"),
        (splat.bounds.area() > frame.view.window.area() / 2, "half of the picture"),
        (splat.weight_scale < f32::MIN_POSITIVE, "denormal weight"),
    ];
    all.into_iter().filter(|(is, _)| *is).map(|(_, name)| name).collect()
}

/// Checks that every level has the reference's fragments. The reference looks at every sample of every pixel near each
/// splat, wherever the fast core looks. `kinds` are those of the splats, if they have any.
fn check_fragments(cloud: &Cloud, camera: &Camera, options: &RenderOptions, kinds: &[Kind]) -> Tally {
    let frame = Frame::new(cloud, camera, options, splat_core::setup::set_up).unwrap();
    let mut tally = Tally::default();
    let mut reference: Vec<Bits> = Vec::new();
    for (rank, splat) in frame.set_up.splats.iter().enumerate() {
        let region = surroundings(splat, &frame.view.window);
        assert_eq!(region.intersect(&splat.bounds), splat.bounds);
        tally.pairs += region.area() as u64;
        let before = reference.len();
        let mut sink = |place, fragment| reference.push(fragment_bits(place, splat.index, fragment));
        frame.rasterizer.rasterize(splat, rank as u32, &region, &mut sink);
        let fragments = &reference[before..];
        tally.fragments += fragments.len() as u64;
        for sort in sorts_of(splat, &frame) {
            tally.count(sort, fragments.len() as u64);
        }
        tally.count("a back", fragments.iter().filter(|bits| bits.3).count() as u64);
        let other = fragments.iter().filter(|bits| bits.3 != splat.back).count();
        tally.count("the side that the eye does not see", other as u64);
        if let Some(kind) = kinds.get(splat.index as usize) {
            tally.count(format!("{kind:?}"), fragments.len() as u64);
        }
    }
    reference.sort_unstable();
    // Without a lens there is but one method.
    let methods = if camera.lens().is_some() { &Method::ALL[..] } else { &[Method::Pixels] };
    for (level, &method) in
        Level::available().iter().flat_map(|level| methods.iter().map(move |m| (level, m)))
    {
        let mut fast: Vec<Bits> = Vec::with_capacity(reference.len());
        let mut sink = |place, index, fragment| fast.push(fragment_bits(place, index, fragment));
        splat_simd::fragments(cloud, camera, options, *level, method, &mut sink).unwrap();
        fast.sort_unstable();
        let first = reference.iter().zip(&fast).find(|(a, b)| a != b);
        assert!(first.is_none(), "{} {method:?}: {first:?}", level.name());
        assert_eq!(reference.len(), fast.len(), "{} {method:?}", level.name());
    }
    let all = tally.fragments;
    for sort in sorts_of_options(camera, options, &frame) {
        tally.count(sort, all);
    }
    tally
}

/// What there is to say about a camera and options.
fn sorts_of_options(camera: &Camera, options: &RenderOptions, frame: &Frame) -> Vec<String> {
    let range = options.sample_range().len();
    let mut sorts = vec![
        format!("{:?}", frame.rasterizer.form()),
        format!("kernel {:?}", options.kernel),
        format!("{:?}", options.table),
        format!("filter {:?}", options.filter),
        format!("{:?}", options.pattern),
        format!("{range} samples modulo 8: {}", range % 8).split_off(range.to_string().len() + 1),
        format!("cull {}", options.cull),
        format!("{} groups", range.div_ceil(8)),
    ];
    if options.table == TableMode::Poly8 {
        sorts.extend(frame.rasterizer.table().polynomials().map(|p| format!("degree {}", p.degree)));
    }
    if options.sample_range.is_some() {
        sorts.push("sample range".into());
    }
    if frame.view.window.area() == 1 {
        sorts.push("one-pixel crop".into());
    } else if options.window.is_some() {
        sorts.push("crop".into());
    }
    if camera.eye().abs().max_element() > 1e5 {
        sorts.push("far from the origin".into());
    }
    sorts
}

/// All bits of a film.
fn film_bits(film: &Film) -> Vec<(&'static str, Vec<u32>)> {
    let scalars = |values: &Option<Vec<f32>>| values.iter().flatten().map(|v| v.to_bits()).collect();
    let vectors = |values: &Option<Vec<Vec3>>| {
        values.iter().flatten().flat_map(|v| v.to_array().map(f32::to_bits)).collect()
    };
    vec![
        ("rgba", film.rgba.as_flattened().iter().map(|v| v.to_bits()).collect()),
        ("depth", scalars(&film.depth)),
        ("normal", vectors(&film.normal)),
        ("albedo", vectors(&film.albedo)),
        ("position", vectors(&film.position)),
        ("id", film.id.iter().flatten().copied().collect()),
        ("coverage", scalars(&film.coverage)),
        ("layers", scalars(&film.layers)),
        ("samples", scalars(&film.samples)),
        ("variance", vectors(&film.variance)),
    ]
}

/// Checks that every level and number of threads gives the reference's picture and counts, each fragment's memory being
/// `tile_memory` bytes in turn. Returns the number of pixels that are not empty.
fn check_pictures(
    cloud: &Cloud,
    camera: &Camera,
    options: &RenderOptions,
    threads: &[usize],
    tile_memory: &[usize],
) -> usize {
    let reference = splat_core::render(cloud, camera, options, &mut |_| {}).unwrap();
    let bits = film_bits(&reference.film);
    for level in Level::available() {
        for &threads in threads {
            // One renderer, since buffers are kept.
            let mut renderer = Renderer::new(threads, level).unwrap();
            for &tile_memory in tile_memory {
                let options = RenderOptions { tile_memory, ..options.clone() };
                let mut told = 0.0;
                let mut progress = |done: f64| {
                    assert!((told..=1.0).contains(&done), "progress {done} after {told}");
                    told = done;
                };
                let fast = renderer.render(cloud, camera, &options, &mut progress).unwrap();
                assert_eq!(told, 1.0);
                let case = format!("{}, {threads} threads, {tile_memory} bytes", level.name());
                for ((what, reference), (_, fast)) in bits.iter().zip(film_bits(&fast.film)) {
                    let first = reference.iter().zip(&fast).position(|(a, b)| a != b);
                    assert!(first.is_none() && reference.len() == fast.len(), "{case}: {what}[{first:?}]");
                }
                assert_eq!(reference.film.position_origin, fast.film.position_origin);
                assert_eq!(reference.statistics.fragments, fast.statistics.fragments, "{case}");
                assert_eq!(reference.statistics.samples, fast.statistics.samples, "{case}");
                assert_eq!(reference.statistics.dropped, fast.statistics.dropped, "{case}");
            }
        }
    }
    reference.film.rgba.iter().filter(|pixel| pixel[3] > 0.0).count()
}

/// Memory for the fragments of a tile: that of a pixel, of some, and of all.
const TILE_MEMORY: [usize; 3] = [1, 20_000, 64 << 20];

// ---------------------------------------------------------------------------------------------------------
// Strategies

fn lens() -> impl Strategy<Value = Lens> {
    // Before the splats, among them, and behind them.
    let focus = prop_oneof![0.2..0.5, 0.5..12.0, 12.0..100.0, Just(3.0), Just(f64::INFINITY)];
    // The larger ones reach through the planes of many splats.
    let radius = prop_oneof![1e-4..0.02, 0.02..0.3, 0.3..2.0];
    (radius, focus, prop_oneof![Just(0u32), 3u32..7]).prop_map(|(radius, focus, blades)| Lens {
        radius,
        focus,
        blades,
    })
}

fn camera() -> impl Strategy<Value = Camera> {
    let form = prop_oneof![Just(Form::Pinhole), Just(Form::ThinLens), Just(Form::Orthographic)];
    let near = prop_oneof![2 => Just(0.01), 1 => 0.2..1.5];
    let far = prop_oneof![Just(f64::INFINITY), 3.0..8.0];
    let to = prop_oneof![
        2 => Just(DVec3::ZERO),
        1 => Just(DVec3::new(1e6, -2e6, 0.5e6)),
        1 => Just(DVec3::new(0.3, -1.7, 0.9)),
    ];
    let turn = prop_oneof![Just(0.0), 0.1..3.0]
        .prop_map(|angle: f64| DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), angle));
    (form, lens(), 25.0..250.0, near, far, (to, turn)).prop_map(
        |(form, lens, focal, near, far, (to, turn))| {
            let camera = match form {
                Form::Orthographic => orthographic(72, 52, focal / 4.0),
                Form::ThinLens => with_lens(pinhole(72, 52, focal), lens),
                Form::Pinhole => pinhole(72, 52, focal),
            };
            moved(Camera { near, far, ..camera }, turn, to)
        },
    )
}

/// Lenses that are sold, such as bend the picture to a barrel or a cushion by half, and such as leave parts of it empty.
fn distortion() -> impl Strategy<Value = Distortion> {
    let mild = (-0.1..0.1, -0.02..0.02, Just(0.0), -1e-3..1e-3, -1e-3..1e-3);
    let strong = (-0.5..0.5, -0.2..0.2, -0.05..0.05, -0.02..0.02, -0.02..0.02);
    let broken = (-8.0..8.0, -8.0..8.0, -8.0..8.0, -0.3..0.3, -0.3..0.3);
    prop_oneof![2 => mild, 4 => strong, 1 => broken]
        .prop_map(|(k1, k2, k3, p1, p2)| Distortion { radial: [k1, k2, k3], tangential: [p1, p2] })
}

/// Ways to resolve that the fast core does in lanes, mostly; any other now and then.
fn resolve() -> impl Strategy<Value = Resolve> {
    prop_oneof![
        4 => Just(OPAQUE),
        2 => Just(soft(0.7)),
        2 => Just(soft(1.0)),
        1 => Just(Resolve::Surface { coverage: Coverage::Opaque, thickness: Thickness::WholeSplat }),
        1 => Just(Resolve::Over),
    ]
}

/// No AOVs, those that come of the colours, or all.
fn aovs() -> impl Strategy<Value = AovSelection> {
    let few = AovSelection { coverage: true, samples: true, variance: true, ..AovSelection::default() };
    prop_oneof![3 => Just(AovSelection::default()), 3 => Just(few), 1 => Just(AovSelection::ALL)]
}

/// The whole frame, crops that begin or end where a tile does or one pixel off, and single pixels.
fn window() -> impl Strategy<Value = Option<PixelRect>> {
    let starts = prop_oneof![Just(31), Just(32), Just(33)];
    let starts = (starts.clone(), starts, 1..40, 1..20);
    let crop = starts.prop_map(|(x, y, width, height)| PixelRect::new(x, y, x + width, y + height));
    let ends = (0..31, 0..31, 31..34, 31..34).prop_map(|(x0, y0, x1, y1)| PixelRect::new(x0, y0, x1, y1));
    let corner = (30..34, 30..34).prop_map(|(x, y)| PixelRect::new(x, y, x + 1, y + 1));
    let pixel = (0..72, 0..52).prop_map(|(x, y)| PixelRect::new(x, y, x + 1, y + 1));
    prop_oneof![
        6 => Just(None),
        1 => crop.prop_map(Some),
        1 => ends.prop_map(Some),
        1 => corner.prop_map(Some),
        1 => pixel.prop_map(Some),
    ]
}

fn samples() -> impl Strategy<Value = (u32, Option<std::ops::Range<u32>>)> {
    let samples = prop_oneof![10 => 1u32..=20, 1 => Just(31), 1 => Just(33)];
    (samples, 0u32..4, 0.0..1.0, 0.0..1.0).prop_map(|(samples, whole, start, end): (u32, u32, f64, f64)| {
        let start = (f64::from(samples) * start) as u32;
        let end = start + 1 + (f64::from(samples - start - 1) * end) as u32;
        (samples, (whole == 0).then_some(start..end))
    })
}

fn options() -> impl Strategy<Value = RenderOptions> {
    let filter = prop_oneof![
        Just(PixelFilter::Box),
        Just(PixelFilter::Tent),
        Just(PixelFilter::Gaussian),
        Just(PixelFilter::BlackmanHarris)
    ];
    let kernel = prop_oneof![Just(Kernel::Gaussian), Just(Kernel::Windowed), Just(Kernel::Disc)];
    let table = prop_oneof![
        6 => Just(TableMode::Poly8),
        1 => Just(TableMode::Quartic8),
        1 => Just(TableMode::Lerp256),
        1 => Just(TableMode::Midpoint256),
        1 => Just(TableMode::Floor256),
    ];
    let cutoff = prop_oneof![Just(2.0), Just(4.0), Just(9.0), 0.3..16.0];
    let thickness = prop_oneof![Just(0.0), Just(0.5), 0.0..4.0];
    let background = prop_oneof![2 => Just(None), 1 => Just(Some([0.2, 0.4, 0.1, 0.5]))];
    let pattern =
        prop_oneof![Just(PatternKind::Dealt), Just(PatternKind::Sobol), Just(PatternKind::PoissonDisc)];
    (
        (resolve(), aovs(), thickness, background),
        (filter, pattern, 0u64..1000, samples()),
        (kernel, table, cutoff),
        window(),
        any::<bool>(),
    )
        .prop_map(|(colors, positions, (kernel, table, cutoff), window, cull)| {
            let (resolve, aovs, thickness, background) = colors;
            let (filter, pattern, seed, (samples, sample_range)) = positions;
            RenderOptions {
                samples,
                sample_range,
                window,
                filter,
                pattern,
                seed,
                kernel,
                cutoff,
                table,
                resolve,
                thickness,
                cull,
                background,
                aovs,
                ..RenderOptions::default()
            }
        })
}

fn knowledge() -> impl Strategy<Value = Knowledge> {
    let often = || prop_oneof![3 => Just(true), 1 => Just(false)];
    (often(), any::<bool>(), often(), often()).prop_map(|(orientation, opacities, areas, ellipses)| {
        Knowledge { orientation, opacities, areas, ellipses }
    })
}

// ---------------------------------------------------------------------------------------------------------
// Fragments and pictures of hard scenes

/// What the hard scenes must have tried.
const SORTS: [&str; 59] = [
    // Kinds of splats; none of those behind the eye leaves a fragment.
    "Ordinary",
    "EdgeOn",
    "SubPixel",
    "Huge",
    "CrossesCamera",
    "CrossesNear",
    "CrossesFar",
    "SameDepth",
    "Duplicate",
    "Needle",
    "Light",
    "Clear",
    "ThroughLens",
    // What set-up makes of them.
    "plain",
    "not plain",
    "flips",
    "flips, its back to the eye",
    "the side that the eye does not see",
    "a back",
    "not centred",
    "outline known",
    "outline unknown",
    "one pixel",
    "half of the picture",
    "denormal weight",
    // Cameras.
    "Pinhole",
    "ThinLens",
    "Orthographic",
    "far from the origin",
    // Options.
    "kernel Gaussian",
    "kernel Windowed",
    "kernel Disc",
    "Poly8",
    "Quartic8",
    "Lerp256",
    "Midpoint256",
    "Floor256",
    "degree 2",
    "degree 3",
    "degree 4",
    "filter Box",
    "filter Tent",
    "filter Gaussian",
    "filter BlackmanHarris",
    "Dealt",
    "Sobol",
    "PoissonDisc",
    "samples modulo 8: 0",
    "samples modulo 8: 1",
    "samples modulo 8: 7",
    "1 groups",
    "2 groups",
    "3 groups",
    "4 groups",
    "cull true",
    "cull false",
    "sample range",
    "one-pixel crop",
    "crop",
];

#[test]
fn hard_scenes_agree_in_a_million_pairs() {
    let total = RefCell::new(Tally::default());
    let scene = (0u64..1_000_000, camera(), options(), knowledge());
    check(64, 1, scene, |(seed, camera, options, known)| {
        let (cloud, kinds) = adversarial(98, seed, &camera, known);
        let tally = check_fragments(&cloud, &camera, &options, &kinds);
        let memory = TILE_MEMORY[seed as usize % 3];
        check_pictures(&cloud, &camera, &options, &[1 + seed as usize % 8], &[memory, memory]);
        total.borrow_mut().add(tally);
    });
    let total = total.into_inner();
    assert!(total.pairs >= 1_000_000, "{}", total.pairs);
    assert!(total.fragments >= 1_000_000, "{}", total.fragments);
    total.expect(&SORTS, 100);
    assert_eq!(total.sorts.get("Behind"), None, "a splat behind the eye was seen");
}

#[test]
fn distorted_pictures_agree() {
    let total = RefCell::new(Tally::default());
    let perspective = camera().prop_filter("perspective", |camera| !camera.is_orthographic());
    let scene = (0u64..1_000_000, perspective, distortion(), options(), knowledge());
    check(40, 5, scene, |(seed, camera, distortion, options, known)| {
        let camera = Camera { distortion: Some(distortion), ..camera };
        let (cloud, kinds) = adversarial(98, seed, &camera, known);
        let tally = check_fragments(&cloud, &camera, &options, &kinds);
        let memory = TILE_MEMORY[seed as usize % 3];
        check_pictures(&cloud, &camera, &options, &[1 + seed as usize % 8], &[memory, memory]);
        // A renderer that has drawn with distortion forgets it.
        let mut renderer = Renderer::new(1, Level::Portable).unwrap();
        renderer.render(&cloud, &camera, &options, &mut |_| {}).unwrap();
        let ideal = Camera { distortion: None, ..camera };
        let fast = renderer.render(&cloud, &ideal, &options, &mut |_| {}).unwrap();
        let reference = splat_core::render(&cloud, &ideal, &options, &mut |_| {}).unwrap();
        assert_eq!(film_bits(&fast.film), film_bits(&reference.film));
        total.borrow_mut().add(tally);
    });
    let total = total.into_inner();
    assert!(total.fragments >= 500_000, "{}", total.fragments);
    let sorts = [
        "Pinhole",
        "ThinLens",
        "flips",
        "outline known",
        "outline unknown",
        "one pixel",
        "crop",
        "sample range",
    ];
    total.expect(&sorts, 100);
}

#[test]
fn ordinary_scenes_agree() {
    let fragments = RefCell::new(0);
    check(24, 2, (0u64..1_000_000, camera(), options()), |(seed, camera, options)| {
        let cloud = jumble(200, 0.05, seed);
        let camera = Camera { world_to_camera: glam::DMat4::IDENTITY, ..camera };
        *fragments.borrow_mut() += check_fragments(&cloud, &camera, &options, &[]).fragments;
        check_pictures(&cloud, &camera, &options, &[2], &TILE_MEMORY);
    });
    assert!(*fragments.borrow() > 1_000_000);
}

#[test]
fn golden_scenes_agree_for_any_threads_and_tiles() {
    for Scene { cloud, camera, options, .. } in golden() {
        assert!(check_fragments(&cloud, &camera, &options, &[]).fragments > 1000);
        check_pictures(&cloud, &camera, &options, &[1, 2, 3, 8], &TILE_MEMORY);
    }
}

/// A splat whose every hit lies on the rim of the cutoff, of the planes, or of the frame would tell whether `<` and `<=`
/// are told apart: discs of which samples hit the very rim.
#[test]
fn hits_on_the_very_limits_agree() {
    let mut on_the_rim = 0;
    for (size, cutoff) in [(0.5, 4.0), (1.0, 1.0), (0.25, 16.0)] {
        // Orthographic, one pixel a unit, centres on corners of pixels or on samples: u and v are exact.
        let camera = Camera { near: 3.0, far: 5.0, ..orthographic(16, 16, 1.0) };
        let options = RenderOptions {
            samples: 1,
            cutoff,
            kernel: Kernel::Disc,
            filter: PixelFilter::Box,
            ..RenderOptions::default()
        };
        let empty = Cloud { oriented: true, ..Cloud::default() };
        let frame = Frame::new(&empty, &camera, &options, splat_core::setup::set_up).unwrap();
        let [jx, jy] = frame.rasterizer.samples().jitter(4, 4)[0].map(f64::from);
        let at = |x: f64, y: f64, depth: f64| DVec3::new(4.0 + jx + x - 8.0, 4.0 + jy + y - 8.0, depth);
        let radius = size * libm::sqrt(cutoff);
        // Just as far away as they reach, and exactly at the near and the far plane.
        let places = [
            at(radius, 0.0, 4.0),
            at(-radius, 0.0, 4.0),
            at(0.0, radius, 4.0),
            at(0.0, -radius, 4.0),
            at(0.0, 0.0, 3.0),
            at(0.0, 0.0, 5.0),
            at(0.0, 0.0, 4.0),
        ];
        let cloud = Cloud {
            normals: vec![Vec3::Z; places.len()],
            shapes: Shapes::Discs(vec![size as f32; places.len()]),
            ..Cloud::from_points(&places)
        };
        check_fragments(&cloud, &camera, &options, &[]);
        let frame = Frame::new(&cloud, &camera, &options, splat_core::setup::set_up).unwrap();
        for splat in &frame.set_up.splats {
            let offset = splat.constants.offset(4, 4, frame.rasterizer.samples().jitter(4, 4)[0]);
            let [u, v] = [splat.constants.a1 * offset[1], splat.constants.b[0] * offset[0]];
            on_the_rim += usize::from(u * u + v * v == cutoff as f32);
        }
    }
    assert!(on_the_rim >= 4, "{on_the_rim} samples on a rim");
}

/// Layers of which the sum of weights is just what it takes to be there.
#[test]
fn weights_on_the_very_thresholds_agree() {
    let camera = orthographic(16, 16, 40.0);
    for (resolve, threshold) in [(OPAQUE, 0.5), (soft(1.0), MIN_LAYER_WEIGHT)] {
        let options = RenderOptions {
            resolve,
            // 1 throughout the first bin.
            kernel: Kernel::Gaussian,
            table: TableMode::Floor256,
            samples: 4,
            ..RenderOptions::default()
        };
        let integral = Kernel::Gaussian.integral(options.cutoff);
        let mut found = 0;
        for i in 0..30 {
            // Rounded, the weight is the threshold or next to it.
            let size = 0.4 + 0.01 * i as f32;
            let area = f64::from(threshold) * f64::from(size).powi(2) * integral;
            let cloud = Cloud {
                normals: vec![Vec3::NEG_Z],
                shapes: Shapes::Discs(vec![size]),
                areas: Some(vec![area as f32]),
                oriented: true,
                ..Cloud::from_points(&[DVec3::new(0.0, 0.0, 4.0)])
            };
            let mut on_threshold = 0;
            splat_core::fragments(&cloud, &camera, &options, &mut |_, _, fragment| {
                on_threshold += usize::from(fragment.weight == threshold);
            })
            .unwrap();
            found += usize::from(on_threshold > 10);
            check_pictures(&cloud, &camera, &options, &[1], &TILE_MEMORY[2..]);
        }
        assert!(found >= 10, "{found} of 30");
    }
}

/// Small splats far out of focus, for which the fast core takes another way than for others.
/// Whether the fast core tests fewer samples than it would pixel by pixel.
fn goes_by_lens_points(cloud: &Cloud, camera: &Camera, options: &RenderOptions) -> bool {
    let level = Level::Portable;
    let by_pixels = splat_simd::fragments(cloud, camera, options, level, Method::Pixels, &mut |_, _, _| {});
    let options = RenderOptions { tile_memory: 64 << 20, ..options.clone() };
    let mut renderer = Renderer::new(1, level).unwrap();
    let rendered = renderer.render(cloud, camera, &options, &mut |_| {}).unwrap();
    rendered.statistics.tests < by_pixels.unwrap()
}

#[test]
fn large_circles_of_confusion_agree() {
    let counts = RefCell::new([0; 2]);
    let lens =
        (0.1..0.6, prop_oneof![0.3..1.0, 8.0..40.0, Just(f64::INFINITY)], prop_oneof![Just(0u32), 3u32..7]);
    let memory = prop_oneof![Just(1usize), Just(20_000), Just(64 << 20)];
    let case = (0u64..1_000_000, lens, options(), memory, (any::<bool>(), 0.002..0.02));
    check(24, 4, case, |(seed, (radius, focus, blades), options, memory, (opaque, size))| {
        let mut cloud = jumble(60, size, seed);
        if opaque {
            cloud.opacities = None;
        }
        let camera = with_lens(pinhole(72, 52, 150.0), Lens { radius, focus, blades });
        check_fragments(&cloud, &camera, &options, &[]);
        check_pictures(&cloud, &camera, &options, &[2], &[memory]);
        counts.borrow_mut()[usize::from(goes_by_lens_points(&cloud, &camera, &options))] += 1;
    });
    let [one_way, another] = counts.into_inner();
    assert!(another > 8, "{another} of {} were drawn by lens points", one_way + another);
}

/// Surfaces of one side, out of focus: they are summed sample by sample.
#[test]
fn blurred_surfaces_agree() {
    let counts = RefCell::new([0; 2]);
    let lens = (0.1..0.6, prop_oneof![0.3..1.0, 2.0..6.0, 8.0..40.0, Just(f64::INFINITY)]);
    let coverage = prop_oneof![Just(OPAQUE), Just(soft(1.0)), Just(soft(0.5)), Just(soft(8.0))];
    let memory = prop_oneof![Just(1usize), Just(20_000), Just(64 << 20)];
    // A cloud without a side is seen from both; of others the backs are left out.
    let case = (0u64..1_000_000, lens, options(), (coverage, memory), (any::<bool>(), 0.002..0.02));
    check(32, 7, case, |(seed, (radius, focus), options, (resolve, memory), (oriented, size))| {
        let mut cloud = jumble(200, size, seed);
        cloud.opacities = None;
        cloud.oriented = oriented;
        let camera = with_lens(pinhole(100, 70, 150.0), Lens { radius, focus, blades: 0 });
        let aovs = AovSelection { coverage: true, variance: true, ..AovSelection::default() };
        let aovs = [AovSelection::default(), aovs][seed as usize % 2];
        let thickness = if seed % 5 == 0 { 1e200 } else { options.thickness };
        let options = RenderOptions { resolve, aovs, thickness, cull: true, ..options };
        check_pictures(&cloud, &camera, &options, &[1 + seed as usize % 3], &[memory, memory]);
        counts.borrow_mut()[usize::from(goes_by_lens_points(&cloud, &camera, &options))] += 1;
    });
    let [one_way, another] = counts.into_inner();
    assert!(another > 8, "{another} of {} were drawn sample by sample", one_way + another);
}

// ---------------------------------------------------------------------------------------------------------
// Many layers

fn layered() -> impl Strategy<Value = (Sheets, f64, u64)> {
    let facing =
        prop_oneof![Just(Facing::Front), Just(Facing::Back), Just(Facing::BySheet), Just(Facing::Mixed)];
    let noise = prop_oneof![Just(0.0), 0.0..3.0];
    let tilt = prop_oneof![Just(0.0), 0.0..0.5];
    let sheets = (1usize..7, 0.5..4.0, noise, tilt, 0.1..2.0, facing, any::<bool>()).prop_map(
        |(count, spacing, noise, tilt, weight, facing, clear)| Sheets {
            count,
            spacing,
            noise,
            tilt,
            weight,
            facing,
            clear,
        },
    );
    // None at all, thin, usual, thick, and infinite.
    let thickness =
        prop_oneof![1 => Just(0.0), 3 => 0.02..0.3, 4 => 0.3..1.0, 1 => 1.0..3.0, 1 => Just(1e200)];
    (sheets, thickness, 0u64..1_000_000)
}

#[test]
fn sheets_agree() {
    let layers = RefCell::new(BTreeMap::<usize, usize>::new());
    let coverage = prop_oneof![Just(OPAQUE), Just(soft(1.0)), Just(soft(0.5)), Just(soft(8.0))];
    // Both sides of splats, or one: surfaces of one side are summed without being stored, where they are smooth.
    let sides = prop_oneof![Just((true, false)), Just((true, true)), Just((false, false))];
    let case = (layered(), coverage, aovs(), 1u32..18, any::<bool>(), sides);
    check(72, 3, case, |((made, thickness, seed), resolve, aovs, samples, lens, (oriented, cull))| {
        let mut cloud = sheets(&made, seed);
        cloud.oriented &= oriented;
        let camera = pinhole(40, 36, 60.0);
        let lens_of = Lens { radius: 0.4, focus: 4.5, blades: 0 };
        let camera = if lens { with_lens(camera, lens_of) } else { camera };
        let options = RenderOptions { samples, resolve, thickness, aovs, cull, ..RenderOptions::default() };
        check_pictures(&cloud, &camera, &options, &[2], &TILE_MEMORY[seed as usize % 3..][..1]);
        // That there was something to tell apart.
        let aovs = AovSelection { layers: true, ..AovSelection::default() };
        let film = splat_core::render(&cloud, &camera, &RenderOptions { aovs, ..options }, &mut |_| {});
        for mean in film.unwrap().film.layers.unwrap() {
            *layers.borrow_mut().entry(mean as usize).or_default() += 1;
        }
    });
    let layers = layers.into_inner();
    for count in 0..6 {
        assert!(layers.get(&count).is_some_and(|&pixels| pixels > 100), "{layers:?}");
    }
}

/// Surfaces of one side before a pinhole: they are summed, in colour or grey, and what is layered is found by bounds.
#[test]
fn summed_surfaces_agree() {
    let coverage = prop_oneof![Just(OPAQUE), Just(soft(1.0)), Just(soft(0.5)), Just(soft(8.0))];
    let case = (layered(), coverage, 1u32..18, any::<bool>(), any::<bool>());
    check(48, 8, case, |((made, thickness, seed), resolve, samples, is_grey, is_narrow)| {
        let mut cloud = sheets(&Sheets { clear: false, facing: Facing::Front, ..made }, seed);
        cloud.opacities = None;
        if is_grey {
            cloud.colors = None;
        }
        let filter = if is_narrow { PixelFilter::Box } else { RenderOptions::default().filter };
        let options =
            RenderOptions { samples, resolve, thickness, filter, cull: true, ..RenderOptions::default() };
        let tile_memory = &TILE_MEMORY[seed as usize % 3..];
        check_pictures(&cloud, &pinhole(40, 36, 60.0), &options, &[2], tile_memory);
    });
}

/// `over`, in lanes: nearly sorted and not, many fragments of one depth, more than 64 a sample, and alphas at the limit.
#[test]
fn fragments_laid_over_each_other_agree() {
    let (most, equal, limits) = (RefCell::new(0), RefCell::new(0), RefCell::new(0));
    let sizes = prop_oneof![Just(None), (0.2f32..1.0).prop_map(Some), (1.5f32..3.0).prop_map(Some)];
    let lens = prop_oneof![2 => Just(0.0), 1 => 0.2..0.6];
    let kernel = prop_oneof![2 => Just(Kernel::Gaussian), 1 => Just(Kernel::Disc)];
    let case = (layered(), sizes, lens, (1u32..20, kernel, any::<bool>(), any::<bool>()));
    check(24, 6, case, |((made, _, seed), sizes, radius, (samples, kernel, cull, orthographic_view))| {
        let mut cloud = sheets(&made, seed);
        let mut random = Random::new(seed);
        if let (Some(scale), Shapes::Discs(all)) = (sizes, &mut cloud.shapes) {
            all.iter_mut().for_each(|size| *size *= scale * random.log_range(0.3, 1.0) as f32);
        }
        let count = cloud.len();
        for opacity in cloud.opacities.get_or_insert_with(|| vec![1.0; count]) {
            let limit = splat_abuffer::MIN_ALPHA;
            *opacity = [*opacity, limit, limit.next_down(), random.unit() as f32][random.index(4)];
        }
        let focused = Lens { radius, focus: 4.5, blades: 0 };
        let camera = match (orthographic_view, radius > 0.0) {
            (true, _) => orthographic(40, 36, 15.0),
            (false, true) => with_lens(pinhole(40, 36, 60.0), focused),
            (false, false) => pinhole(40, 36, 60.0),
        };
        let aovs = AovSelection { coverage: true, variance: true, ..AovSelection::default() };
        let aovs = [AovSelection::default(), aovs, AovSelection::ALL][[0, 1, 1, 2][random.index(4)]];
        let resolve = Resolve::Over;
        let options =
            RenderOptions { samples, resolve, kernel, cutoff: 9.0, cull, aovs, ..RenderOptions::default() };
        let threads = 1 + seed as usize % 3;
        check_pictures(&cloud, &camera, &options, &[threads], &TILE_MEMORY[seed as usize % 3..][..1]);
        // That there was something to tell apart.
        let mut found = BTreeMap::<SamplePlace, Vec<u32>>::new();
        let opacities = cloud.opacities.as_ref().unwrap();
        splat_core::fragments(&cloud, &camera, &options, &mut |place, index, fragment| {
            found.entry(place).or_default().push(fragment.depth.to_bits());
            let alpha = fragment.weight * opacities[index as usize];
            *limits.borrow_mut() += usize::from(alpha == splat_abuffer::MIN_ALPHA);
        })
        .unwrap();
        for mut depths in found.into_values() {
            let count = depths.len();
            depths.sort_unstable();
            depths.dedup();
            *equal.borrow_mut() += usize::from(depths.len() < count);
            let mut most = most.borrow_mut();
            *most = count.max(*most);
        }
    });
    let (most, equal, limits) = (most.into_inner(), equal.into_inner(), limits.into_inner());
    assert!(most > 200 && equal > 1000 && limits > 1000, "{most} {equal} {limits}");
}

#[test]
fn closed_surfaces_agree_from_outside_and_inside() {
    let mut seen = 0;
    for seed in 0..6 * u64::from(factor()) {
        let mut random = Random::new(seed);
        for (depth, radius) in [(4.0, 1.2), (0.3, 2.0)] {
            let options = RenderOptions {
                samples: 5 + random.index(8) as u32,
                resolve: [OPAQUE, soft(1.0)][random.index(2)],
                thickness: [0.0, 0.3, 0.5, 2.0][random.index(4)],
                aovs: [AovSelection::default(), AovSelection::ALL][random.index(2)],
                cull: random.index(4) == 0,
                ..RenderOptions::default()
            };
            let center = DVec3::new(random.range(-0.2, 0.2), random.range(-0.2, 0.2), depth);
            let mut cloud = sphere(center, radius, 300, &options);
            let count = cloud.len();
            cloud.opacities =
                (random.index(2) == 0).then(|| (0..count).map(|_| random.unit() as f32).collect());
            cloud.colors =
                Some((0..count).map(|_| Vec3::from_array([0; 3].map(|_| random.unit() as f32))).collect());
            let camera = pinhole(64, 48, 50.0);
            seen += check_pictures(&cloud, &camera, &options, &[1, 3], &[20_000]);
        }
    }
    assert!(seen > 10_000, "{seen}");
}

#[test]
fn any_number_of_threads_and_any_tiles_agree() {
    // 4 x 3 tiles, the last ones cut.
    let camera = with_lens(pinhole(101, 71, 90.0), Lens { radius: 0.1, focus: 3.0, blades: 6 });
    for seed in 0..2 * u64::from(factor()) {
        let mut random = Random::new(seed);
        let known =
            Knowledge { orientation: seed % 3 < 2, opacities: seed % 2 == 0, areas: true, ellipses: true };
        let (cloud, _) = adversarial(140, seed, &camera, known);
        let options = RenderOptions {
            samples: 5 + random.index(8) as u32,
            resolve: [OPAQUE, soft(1.0)][seed as usize % 2],
            aovs: AovSelection { coverage: true, variance: true, ..AovSelection::default() },
            ..RenderOptions::default()
        };
        // Down to single pixels once: that takes its time.
        let [least, middle, most] = TILE_MEMORY;
        check_pictures(&cloud, &camera, &options, &[2], &[least]);
        let seen = check_pictures(&cloud, &camera, &options, &[1, 2, 3, 4, 5, 6, 7, 8], &[middle, most]);
        assert!(seen > 3000, "{seen}");
    }
}

#[test]
fn side_by_side_comparison_agrees() {
    let camera = with_lens(pinhole(101, 71, 90.0), Lens { radius: 0.1, focus: 3.0, blades: 6 });
    let known = Knowledge { orientation: true, opacities: true, areas: true, ellipses: true };
    let (cloud, _) = adversarial(140, 1, &camera, known);
    let distortion = Some(Distortion { radial: [-0.2, 0.05, 0.0], tangential: [0.01, -0.02] });
    let options = RenderOptions::default();
    for camera in [camera.clone(), Camera { distortion, ..camera }] {
        for level in Level::available() {
            let result = splat_simd::compare(&cloud, &camera, &options, level, &mut |_| {}).unwrap();
            assert!(result.is_ok_and(|fragments| fragments > 10_000), "{}: {result:?}", level.name());
        }
    }
}
