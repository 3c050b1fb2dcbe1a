//! `splat-core` on the scenes where the listing fails, erratum by erratum (`eNN_core_..` is erratum ENN of
//! the specification's table; `listing_set_up.rs` and `listing_samples.rs` show the listing's side). Each
//! test would fail with the listing's form. This file: the samples, the depths and the tables;
//! `errata_core_set_up.rs`: the rest.
//!
//! Not here: E24, a variable that is used out of its scope, which is about the listing's text only.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DVec2, DVec3};
use splat_abuffer::{Coverage, Fragment, Resolve, Thickness};
use splat_core::evaluate::{LensPoint, Limits};
use splat_core::kernel::KernelTable;
use splat_core::sampling::{PATTERNS, SampleTable};
use splat_core::setup::{View, camera_splat, project, set_up};
use splat_core::{
    AovSelection, Camera, Cloud, Kernel, Lens, PixelFilter, RenderOptions, Shapes, TableMode, fragments,
    render,
};
use splat_tests::brute_force::{self, SampleRay};
use splat_tests::core_scenes::{discs, ellipses, hard, pinhole, sample_ray, thin_lens, truth_of};
use splat_tests::errata_scenes::{
    crossing_disc, facing_disc, noisy_wall, steep_splat_and_ray, white_over_black,
};
use splat_tests::listing::{DepthMap, ListingSplat};
use splat_tests::random::Random;
use splat_tests::tolerances as tol;

/// A place: column, row, sample.
type Place = (i32, i32, usize);

/// The same splats for `splat-core`.
fn cloud(splats: &[ListingSplat<f64>]) -> Cloud {
    let one = |s: &ListingSplat<f64>| (DVec3::from_array(s.position), DVec3::from_array(s.normal), s.size);
    discs(&splats.iter().map(one).collect::<Vec<_>>())
}

/// The listing's small picture: 96 x 64 pixels, 90 to the unit, from depth .1 on.
fn small() -> Camera {
    Camera { near: 0.1, ..pinhole(96, 64, 90.0) }
}

fn small_lens(radius: f64, focus: f64) -> Camera {
    Camera { near: 0.1, ..thin_lens(96, 64, 90.0, radius, focus) }
}

fn drawn(cloud: &Cloud, camera: &Camera, options: &RenderOptions) -> BTreeMap<(Place, u32), Fragment> {
    let mut all = BTreeMap::new();
    let mut sink = |place: splat_core::raster::SamplePlace, index, fragment| {
        let before = all.insert(((place.x, place.y, place.sample), index), fragment);
        assert!(before.is_none(), "one fragment of a splat in a sample");
    };
    fragments(cloud, camera, options, &mut sink).expect("renders");
    all
}

/// Every sample of the frame that truly hits the cloud's first splat, with the eye's and the lens's rays.
fn truth(cloud: &Cloud, camera: &Camera, options: &RenderOptions) -> BTreeMap<Place, brute_force::Hit> {
    let view = View::new(camera, options);
    let disc = truth_of(&camera_splat(cloud, 0, &view));
    let samples = SampleTable::new(options, view.lens, view.pixel_scale);
    let mut hits = BTreeMap::new();
    for y in 0..camera.height as i32 {
        for x in 0..camera.width as i32 {
            for sample in 0..options.samples as usize {
                let [jx, jy] = samples.jitter(x, y)[sample].map(f64::from);
                let unit = samples.unit_lens(x, y).get(sample).copied().unwrap_or_default();
                let ray = sample_ray(&view, DVec2::new(f64::from(x) + jx, f64::from(y) + jy), unit);
                let hit =
                    disc.intersect(&ray).filter(|hit| hit.r2() < options.cutoff && hit.depth > camera.near);
                hits.extend(hit.map(|hit| ((x, y, sample), hit)));
            }
        }
    }
    hits
}

/// Draws the cloud's one splat and asserts that its hits, depths and facings are the true ones.
fn assert_true(cloud: &Cloud, camera: &Camera, options: &RenderOptions) -> usize {
    let drawn = drawn(cloud, camera, options);
    let truth = truth(cloud, camera, options);
    let places: BTreeSet<Place> = drawn.keys().map(|key| key.0).collect();
    assert_eq!(
        places,
        truth.keys().copied().collect(),
        "no sample is so near the rim that f32 could not tell"
    );
    for ((place, _), fragment) in &drawn {
        let hit = truth[place];
        assert!(
            (f64::from(fragment.depth) / hit.depth - 1.0).abs() <= tol::DEPTH_F32,
            "{fragment:?} {hit:?}"
        );
        assert_eq!(fragment.is_back(), !hit.front);
    }
    drawn.len()
}

#[test]
fn e02_core_a_noisy_wall_is_one_layer() {
    let mut wall = cloud(&noisy_wall());
    wall.areas = Some(vec![0.15 * 0.15; 200]);
    let layers = |thickness: Thickness| {
        let options = RenderOptions {
            samples: 1,
            cutoff: 2.0,
            kernel: Kernel::Gaussian,
            resolve: Resolve::Surface { coverage: Coverage::Opaque, thickness },
            aovs: AovSelection { layers: true, ..AovSelection::default() },
            ..RenderOptions::default()
        };
        let film = render(&wall, &small(), &options, &mut |_| {}).expect("renders").film;
        let layers = film.layers.expect("asked for");
        let covered: Vec<f32> =
            layers.iter().copied().zip(&film.rgba).filter(|(_, c)| c[3] > 0.0).map(|x| x.0).collect();
        (covered.len(), covered.into_iter().fold(0.0, f32::max))
    };
    let (pixels, most) = layers(Thickness::AroundHit);
    assert!(pixels > 2500, "{pixels}");
    assert_eq!(most, 1.0);
    // The listing's interval on the same scene: every splat is a layer of its own, and few of them weigh
    // enough.
    let (pixels_with_the_listing_s, _) = layers(Thickness::WholeSplat);
    assert!(pixels_with_the_listing_s * 2 < pixels, "{pixels_with_the_listing_s} of {pixels}");
}

#[test]
fn e03_core_fragments_store_view_depth() {
    for f in drawn(&cloud(&[facing_disc()]), &small(), &hard(2.0, 4)).values() {
        assert_eq!(f.depth, 5.0);
    }
    // Not only where all is flat.
    let tilted = discs(&[(DVec3::new(0.2, 0.1, 5.0), DVec3::new(0.5, 0.3, -0.8).normalize(), 0.5)]);
    assert!(assert_true(&tilted, &small(), &hard(2.0, 4)) > 500);
}

#[test]
fn e04_core_nothing_behind_the_near_plane_is_hit() {
    let (_, splat) = crossing_disc(DepthMap::ReversedZ { near: 0.5, far: 100.0 });
    for near in [0.5, 0.05] {
        let camera = Camera { near, ..pinhole(80, 50, 40.0) };
        assert!(assert_true(&cloud(&[splat]), &camera, &hard(2.0, 3)) > 1000);
        let lens = Camera { near, ..thin_lens(80, 50, 40.0, 0.05, 2.0) };
        assert!(assert_true(&cloud(&[splat]), &lens, &hard(2.0, 3)) > 1000);
    }
}

#[test]
fn e05_core_facing_is_the_lens_point_s() {
    let lens = brute_force::Lens::of_f_number(2.8, 5.0);
    let camera = small_lens(lens.radius, lens.focus);
    let view = View::new(&camera, &hard(2.0, 1));
    let limits = Limits::new(2.0, 1e-3, f64::INFINITY);
    let mut rng = Random::new(105);
    let (mut differ, mut far) = (0, 0);
    for _ in 0..5000 {
        let (splat, at, on_lens) = steep_splat_and_ray(&mut rng, &lens);
        let splat = camera_splat(&cloud(&[splat]), 0, &view);
        let (disc, constants) = (truth_of(&splat), project(&splat, &view).expect("not edge-on"));
        let unit = (on_lens / lens.radius).to_array().map(|x| x as f32);
        let ray = SampleRay::thin_lens(at, DVec2::from(unit.map(f64::from)) * lens.radius, &lens);
        let hit = disc.intersect(&ray).expect("aimed at it");
        let pixel = at * view.pixel_scale + view.principal_point;
        let [x, y] = pixel.floor().as_ivec2().to_array();
        let d = constants.offset(x, y, (pixel - pixel.floor()).to_array());
        let point = LensPoint::new(unit, view.lens.expect("a lens"), view.pixel_scale);
        let Some(found) = constants.thin_lens(d, &point, &limits) else {
            assert!(hit.r2() > 2.0 - tol::RAY * 1e4, "{hit:?}");
            far += 1;
            continue;
        };
        // A fragment's facing, as rasterization makes it.
        assert_eq!(splat.back != found.flipped, !hit.front);
        differ += usize::from(found.flipped);
    }
    assert!(differ > 20 && far < 100, "{differ} {far}");
}

#[test]
fn e05_core_fragments_carry_that_facing() {
    // A steep plane that cuts the lens: some samples see the front, some the back.
    let splat = ellipses(&[(DVec3::new(0.1, 0.0, 2.0), [DVec3::Y, DVec3::new(0.04, 0.0, 0.7)])]);
    let camera = small_lens(0.3, 3.0);
    assert!(assert_true(&splat, &camera, &hard(4.0, 8)) > 500);
    let backs = drawn(&splat, &camera, &hard(4.0, 8)).values().filter(|f| f.is_back()).count();
    assert!(backs > 100, "{backs}");
    // Without orientation every fragment faces the viewer.
    let unoriented = Cloud { oriented: false, ..splat };
    assert!(drawn(&unoriented, &camera, &hard(4.0, 8)).values().all(|f| !f.is_back()));
}

/// Half width and height, in pixels, of the image of a splat that reaches 1/100 at depth 1, through an
/// f/2.8 lens focused at 5.
fn bokeh(focal: DVec2) -> [f64; 2] {
    let lens = Lens::from_fstop(2.8, 5.0, 0);
    let projection = splat_core::Projection::Perspective { focal_length: focal, lens: Some(lens) };
    let camera = Camera { projection, ..pinhole(1920, 1080, 1.0) };
    let splat = discs(&[(DVec3::Z, DVec3::NEG_Z, 0.01 / 2.0_f64.sqrt())]);
    let options = RenderOptions { filter: PixelFilter::Box, ..hard(2.0, 64) };
    let mut reach = [0.0_f64; 2];
    for ((x, y, _), _) in drawn(&splat, &camera, &options).into_keys() {
        reach = [
            reach[0].max((f64::from(x) + 0.5 - 960.0).abs()),
            reach[1].max((f64::from(y) + 0.5 - 540.0).abs()),
        ];
    }
    reach
}

#[test]
fn e12_e13_core_the_lens_is_round_and_does_not_depend_on_the_field_of_view() {
    let coc = brute_force::Lens::of_f_number(2.8, 5.0).circle_of_confusion(1.0);
    assert!((coc - 0.119).abs() <= tol::printed(3));
    // In tan units, whatever the width of the picture (E12) and its field of view (E13), even with oblong
    // pixels.
    for focal in [DVec2::splat(540.0), DVec2::splat(540.0 * 3.73), DVec2::new(600.0, 400.0)] {
        let [x, y] = bokeh(focal);
        let expected = (coc + 0.01) * focal;
        let error = (x - expected.x).abs().max((y - expected.y).abs());
        assert!(error <= tol::BOKEH, "{x} {y}, not {expected}");
    }
}

#[test]
fn e14_core_the_f_number_is_applied() {
    let splat = discs(&[(DVec3::new(0.0, 0.0, 3.0), DVec3::NEG_Z, 0.1)]);
    let mut counts = vec![];
    for f_number in [1.0, 2.8, 1000.0] {
        let lens = Lens::from_fstop(f_number, 5.0, 0);
        assert!((lens.radius - brute_force::Lens::of_f_number(f_number, 5.0).radius).abs() <= tol::EXACT);
        assert_true(&splat, &small_lens(lens.radius, 5.0), &hard(2.0, 16));
        let places = drawn(&splat, &small_lens(lens.radius, 5.0), &hard(2.0, 16)).into_keys();
        counts.push(places.map(|((x, y, _), _)| (x, y)).collect::<BTreeSet<_>>().len());
    }
    // The wider the lens, the wider the blur.
    assert!(counts[0] > counts[1] && counts[1] > counts[2], "{counts:?}");
}

#[test]
fn e15_core_every_sample_is_reached() {
    let options = hard(2.0, 8);
    let table =
        SampleTable::new(&options, Some(Lens { radius: 0.2, focus: 5.0, blades: 0 }), DVec2::splat(90.0));
    let (mut jitters, mut lenses) = (BTreeSet::new(), BTreeSet::new());
    for (x, y) in (0..96).flat_map(|x| (0..64).map(move |y| (x, y))) {
        assert_eq!((table.jitter(x, y).len(), table.unit_lens(x, y).len()), (8, 8));
        jitters.extend(table.jitter(x, y).iter().map(|j| j.map(f32::to_bits)));
        lenses.extend(table.unit_lens(x, y).iter().map(|j| j.map(f32::to_bits)));
    }
    // The listing reaches 71 of 512.
    assert_eq!((jitters.len(), lenses.len()), (PATTERNS * 8, PATTERNS * 8));
}

#[test]
fn e16_core_the_image_of_a_point_has_both_variances() {
    // The image of a point is the pixel filter convolved with the circle of confusion: variances add.
    let options = RenderOptions { filter: PixelFilter::Tent, ..hard(2.0, 64) };
    let table =
        SampleTable::new(&options, Some(Lens { radius: 1.0, focus: 5.0, blades: 0 }), DVec2::splat(1.0));
    let blur = 3.0;
    let (mut n, mut sum, mut squares, mut filter, mut lens) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (x, y) in (0..32).flat_map(|x| (0..32).map(move |y| (x, y))) {
        for (jitter, unit) in table.jitter(x, y).iter().zip(table.unit_lens(x, y)) {
            for axis in 0..2 {
                let (j, l) = (f64::from(jitter[axis]) - 0.5, blur * f64::from(unit[axis]));
                (n, sum, squares) = (n + 1.0, sum + j + l, squares + (j + l) * (j + l));
                (filter, lens) = (filter + j * j, lens + l * l);
            }
        }
    }
    // A tent of radius 1 has a variance of 1/6, a disc of radius R one of R^2/4 along an axis.
    assert!(
        (filter / n * 6.0 - 1.0).abs() <= tol::MOMENT_OF_4096
            && (lens / n / 2.25 - 1.0).abs() <= tol::MOMENT_OF_4096
    );
    let variance = squares / n - (sum / n) * (sum / n);
    let expected = 1.0 / 6.0 + blur * blur / 4.0;
    assert!((variance / expected - 1.0).abs() <= tol::MOMENT_OF_4096, "{variance} {expected}");
    // The same index for both would correlate them: (1/sqrt 6 + blur/2)^2, a third more.
    assert!((1.0 / 6.0_f64.sqrt() + blur / 2.0).powi(2) / expected > 1.4);
}

#[test]
fn e17_core_weights_at_the_rim_are_in_the_table() {
    for cutoff in [2.0, 3.0] {
        for mode in [TableMode::Floor256, TableMode::Midpoint256, TableMode::Lerp256] {
            let table = KernelTable::new(Kernel::Gaussian, cutoff, mode);
            let rim = libm::exp(-0.5 * cutoff);
            let limit = 0.5 * cutoff / 256.0;
            for r2 in (0..1000).scan(cutoff as f32, |r2, _| {
                *r2 = r2.next_down();
                Some(*r2)
            }) {
                let weight = f64::from(table.weight(r2));
                // The value of the last bin, if not interpolated.
                assert!((weight / rim - 1.0).abs() <= limit * (1.0 + limit), "{mode:?} {r2}: {weight}");
            }
        }
    }
    // And in the sample loop: every hit of a disc has its weight.
    let options = RenderOptions { kernel: Kernel::Gaussian, table: TableMode::Floor256, ..hard(2.0, 64) };
    let splat = discs(&[(DVec3::Z * 1.001, DVec3::NEG_Z, 0.1)]);
    let hits = truth(&splat, &small(), &options);
    let drawn = drawn(&splat, &small(), &options);
    assert_eq!(hits.len(), drawn.len());
    for ((place, _), fragment) in drawn {
        let error = f64::from(fragment.weight) / libm::exp(-0.5 * hits[&place].r2()) - 1.0;
        assert!((-tol::WEIGHT_F32..=tol::FLOOR_TABLE_F2).contains(&error), "{error:e}");
    }
}

#[test]
fn e18_core_the_default_table_has_no_bias() {
    // The listing's table is 1.96e-3 too large on average, and 3.9e-3 at most.
    let mean_and_max = |mode: TableMode| {
        let table = KernelTable::new(Kernel::Gaussian, 2.0, mode);
        let n = 256 * 64;
        let errors = (0..n).map(|i| {
            let r2 = ((f64::from(i) + 0.5) * 2.0 / f64::from(n)) as f32;
            f64::from(table.weight(r2)) / libm::exp(-0.5 * f64::from(r2)) - 1.0
        });
        let (sum, max) = errors.fold((0.0, 0.0_f64), |(sum, max), e| (sum + e, max.max(e.abs())));
        (sum / f64::from(n), max)
    };
    let (mean, max) = mean_and_max(RenderOptions::default().table);
    assert!(mean.abs() <= tol::LERP_F2 && max <= tol::LERP_F2, "{mean:e} {max:e}");
    let (mean, max) = mean_and_max(TableMode::Midpoint256);
    assert!(mean.abs() <= tol::LERP_F2 && (max - 1.96e-3).abs() <= tol::printed(4), "{mean:e} {max:e}");
    let (mean, _) = mean_and_max(TableMode::Floor256);
    assert!((mean - 1.96e-3).abs() <= tol::printed(5), "the listing's own: {mean:e}");
}

#[test]
fn e19_core_the_default_kernel_has_no_jump() {
    let mut both = cloud(&white_over_black());
    both.colors = Some(vec![glam::Vec3::ONE, glam::Vec3::ZERO]);
    let largest_jump = |kernel: Kernel, samples: u32| {
        // The share of white along the row through both centres, at F = 2.
        let options = RenderOptions { kernel, ..hard(2.0, 1) };
        let view = View::new(&small(), &options);
        let constants: Vec<_> =
            (0..2).map(|i| project(&camera_splat(&both, i, &view), &view).expect("seen")).collect();
        let table = KernelTable::new(kernel, 2.0, options.table);
        let limits = Limits::new(2.0, 0.1, f64::INFINITY);
        let share = |i: u32| {
            let x = (-0.18 + 0.36 * f64::from(i) / f64::from(samples)) * 90.0 + 48.0;
            let weights = [0, 1].map(|k| {
                let c = &constants[k];
                let hit = c.pinhole(c.offset(x.floor() as i32, 32, [x - x.floor(), 0.0]), &limits);
                hit.map_or(0.0, |hit| f64::from(table.weight(hit.r2 as f32)))
            });
            weights[0] / (weights[0] + weights[1])
        };
        (1..=samples).map(|i| (share(i) - share(i - 1)).abs()).fold(0.0, f64::max)
    };
    let default = RenderOptions::default().kernel;
    let (coarse, fine) = (largest_jump(default, 1000), largest_jump(default, 30_000));
    assert!(fine < coarse / 20.0, "{coarse} {fine}");
    // The listing's kernel jumps, however fine the steps.
    assert!(largest_jump(Kernel::Gaussian, 30_000) > 0.2);
}

#[test]
fn e32_core_pictures_do_not_depend_on_the_unit_of_length() {
    let places = |reach: f64| {
        let camera = Camera { near: 0.1 * reach, ..thin_lens(96, 64, 90.0, 0.1 * reach, 2.0 * reach) };
        let splat = discs(&[(
            DVec3::new(0.05, 0.02, 1.0) * reach,
            DVec3::new(0.5, 0.0, -1.0).normalize(),
            0.1 * reach,
        )]);
        drawn(&splat, &camera, &hard(2.0, 2)).into_keys().collect::<BTreeSet<_>>()
    };
    // Powers of 2, so that f32 rounds alike: the same bits, where the listing fails at 1e10.
    let picture = places(1.0);
    assert!(picture.len() > 600, "{}", picture.len());
    for exponent in [-60, -20, 20, 40, 60] {
        assert_eq!(places(libm::exp2(f64::from(exponent))), picture, "2^{exponent}");
    }
}

#[test]
fn e33_core_weights_sum_to_one_whatever_the_density() {
    // One flat sheet on a grid of spacing h, sigma = .8 h; every splat stands for h^2.
    for (h, kernel) in
        [(0.1, Kernel::Gaussian), (0.05, Kernel::Gaussian), (0.1, Kernel::Windowed), (0.05, Kernel::Windowed)]
    {
        let n = (1.5 / h) as i32;
        let splats: Vec<_> = (-n..=n)
            .flat_map(|i| (-n..=n).map(move |j| DVec3::new(f64::from(i) * h, f64::from(j) * h, 2.0)))
            .map(|at| (at, DVec3::NEG_Z, 0.8 * h))
            .collect();
        let mut sheet = discs(&splats);
        sheet.areas = Some(vec![(h * h) as f32; splats.len()]);
        let options = RenderOptions { kernel, ..hard(4.0, 2) };
        let mut sums: BTreeMap<Place, f64> = BTreeMap::new();
        for ((place, _), fragment) in drawn(&sheet, &small(), &options) {
            *sums.entry(place).or_default() += f64::from(fragment.weight);
        }
        assert_eq!(sums.len(), 96 * 64 * 2);
        let mean = sums.values().sum::<f64>() / sums.len() as f64;
        assert!((mean - 1.0).abs() <= tol::GRID_SUM, "{kernel:?}, h = {h}: {mean}");
    }
    // Where no area is known the kernel's own value counts.
    let alone = discs(&[(DVec3::Z * 2.0, DVec3::NEG_Z, 0.2)]);
    let Shapes::Discs(_) = alone.shapes else { unreachable!() };
    let options = RenderOptions { kernel: Kernel::Gaussian, ..hard(4.0, 2) };
    let view = View::new(&small(), &options);
    assert_eq!(set_up(&alone, &view, &options).splats[0].weight_scale, 1.0);
}
