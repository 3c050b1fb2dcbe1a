//! The fast core against the reference: the same fragments and the same pictures, bit for bit, at every level.

use glam::{DMat3, DVec3, Vec3};
use proptest::prelude::*;
use splat_abuffer::{Coverage, Fragment, Resolve, Thickness};
use splat_core::raster::SamplePlace;
use splat_core::{
    AovSelection, Camera, Cloud, Kernel, Lens, PatternKind, PixelFilter, PixelRect, RenderOptions, Shapes,
    TableMode,
};
use splat_simd::{Level, Method, Renderer};
use splat_tests::random::Random;
use splat_tests::scenes::{Scene, golden, jumble, orthographic, pinhole, with_lens};

type Bits = (SamplePlace, u32, u32, bool, u32, u32);

/// All fragments of a scene in one order, as bits.
fn sorted(each: impl FnOnce(&mut dyn FnMut(SamplePlace, u32, Fragment))) -> Vec<Bits> {
    let mut all = Vec::new();
    each(&mut |place, index, f| {
        all.push((place, index, f.rank(), f.is_back(), f.depth.to_bits(), f.weight.to_bits()));
    });
    all.sort_unstable();
    all
}

/// Checks that every level has the reference's fragments, and returns their number.
fn check_fragments(cloud: &Cloud, camera: &Camera, options: &RenderOptions) -> usize {
    let reference = sorted(|sink| {
        splat_core::fragments(cloud, camera, options, sink).unwrap();
    });
    let both = Level::available().into_iter().flat_map(|level| Method::ALL.map(|method| (level, method)));
    for (level, method) in both {
        let fast = sorted(|sink| {
            splat_simd::fragments(cloud, camera, options, level, method, sink).unwrap();
        });
        let first = reference.iter().zip(&fast).find(|(a, b)| a != b);
        assert!(first.is_none(), "{}: {first:?}", level.name());
        assert_eq!(reference.len(), fast.len(), "{}", level.name());
    }
    reference.len()
}

/// Checks that every level and number of threads gives the reference's picture and counts.
fn check_pictures(cloud: &Cloud, camera: &Camera, options: &RenderOptions, threads: &[usize]) {
    let reference = splat_core::render(cloud, camera, options, &mut |_| {}).unwrap();
    let bits = |values: &[[f32; 4]]| values.iter().map(|p| p.map(f32::to_bits)).collect::<Vec<_>>();
    for level in Level::available() {
        for &threads in threads {
            let mut renderer = Renderer::new(threads, level).unwrap();
            // Twice, since buffers are kept.
            for _ in 0..2 {
                let mut told = 0.0;
                let mut progress = |done: f64| {
                    assert!((told..=1.0).contains(&done), "progress {done} after {told}");
                    told = done;
                };
                let fast = renderer.render(cloud, camera, options, &mut progress).unwrap();
                assert_eq!(told, 1.0);
                assert_eq!(bits(&reference.film.rgba), bits(&fast.film.rgba), "{} {threads}", level.name());
                assert_eq!(reference.film, fast.film, "{} {threads}", level.name());
                assert_eq!(reference.statistics.fragments, fast.statistics.fragments);
                assert_eq!(reference.statistics.samples, fast.statistics.samples);
                assert_eq!(reference.statistics.dropped, fast.statistics.dropped);
            }
        }
    }
}

#[test]
fn golden_scenes_agree_for_any_threads() {
    for Scene { cloud, camera, options, .. } in golden() {
        assert!(check_fragments(&cloud, &camera, &options) > 1000);
        check_pictures(&cloud, &camera, &options, &[1, 2, 3, 8]);
    }
}

/// Splats that try everything: tiny, huge, edge-on, thin, crossing the camera plane, behind, coincident.
fn hard_cloud(count: usize, seed: u64) -> Cloud {
    let mut random = Random::new(seed);
    let mut points = Vec::new();
    let mut axes = Vec::new();
    let mut normals = Vec::new();
    let mut colors = Vec::new();
    for i in 0..count {
        let depth = random.log_range(0.2, 20.0) * if random.index(12) == 0 { -1.0 } else { 1.0 };
        let place = DVec3::new(random.range(-0.8, 0.8) * depth, random.range(-0.6, 0.6) * depth, depth);
        // Some splats share their place.
        let place = if i % 7 == 3 { points[i - 1] } else { place };
        let frame = DMat3::from_euler(
            glam::EulerRot::XYZ,
            random.range(0.0, 6.3),
            random.range(0.0, 6.3),
            random.range(0.0, 6.3),
        );
        let largest = if random.index(8) == 0 { 5.0 } else { 0.1 };
        let size = depth.abs() * random.log_range(2e-4, largest);
        let thin = if random.index(4) == 0 { random.log_range(0.01, 1.0) } else { 1.0 };
        let mut t = [frame.x_axis * size, frame.y_axis * size * thin];
        if random.index(10) == 0 {
            // All but edge-on: one axis along the ray.
            t[0] = place.normalize() * size + frame.x_axis * size * 1e-4;
        }
        points.push(place);
        axes.push(t.map(|axis| axis.as_vec3()));
        normals.push(t[0].cross(t[1]).normalize().as_vec3());
        colors.push(Vec3::new(random.unit() as f32, random.unit() as f32, random.unit() as f32));
    }
    let mut cloud = Cloud::from_points(&points);
    cloud.normals = normals;
    cloud.shapes = Shapes::Ellipses(axes);
    cloud.colors = Some(colors);
    cloud.opacities = Some((0..count).map(|i| [1.0, 1.0, 0.5, 0.03][i % 4]).collect());
    // Some weights are denormal.
    cloud.areas =
        Some((0..count).map(|i| if i % 11 == 5 { 1e-41 } else { 0.2 / (1.0 + i as f32) }).collect());
    cloud.oriented = !seed.is_multiple_of(3);
    cloud
}

fn lens() -> impl Strategy<Value = Option<Lens>> {
    let focus = prop_oneof![0.3..30.0, Just(f64::INFINITY)];
    let lens = (prop_oneof![1e-4..0.05, 0.05..2.0], focus, prop_oneof![Just(0u32), 3u32..7])
        .prop_map(|(radius, focus, blades)| Lens { radius, focus, blades });
    prop::option::of(lens)
}

fn camera() -> impl Strategy<Value = Camera> {
    (lens(), any::<bool>(), 20.0..200.0).prop_map(|(lens, flat, focal)| match lens {
        _ if flat => orthographic(64, 48, focal / 4.0),
        Some(lens) => with_lens(pinhole(64, 48, focal), lens),
        None => pinhole(64, 48, focal),
    })
}

fn options() -> impl Strategy<Value = RenderOptions> {
    let resolve = prop_oneof![
        4 => Just(Resolve::Surface { coverage: Coverage::Opaque, thickness: Thickness::AroundHit }),
        4 => Just(Resolve::Surface { coverage: Coverage::Soft { saturation: 0.7 }, thickness: Thickness::AroundHit }),
        1 => Just(Resolve::Surface { coverage: Coverage::Opaque, thickness: Thickness::WholeSplat }),
        1 => Just(Resolve::Over),
    ];
    let filter =
        prop_oneof![Just(PixelFilter::Box), Just(PixelFilter::Tent), Just(PixelFilter::BlackmanHarris)];
    let kernel = prop_oneof![Just(Kernel::Gaussian), Just(Kernel::Windowed), Just(Kernel::Disc)];
    let table = prop_oneof![3 => Just(TableMode::Poly8), 1 => Just(TableMode::Quartic8), 1 => Just(TableMode::Lerp256), 1 => Just(TableMode::Floor256)];
    let thickness = prop_oneof![Just(0.0), Just(0.5), Just(3.0)];
    (
        resolve,
        filter,
        kernel,
        table,
        thickness,
        1u32..20,
        any::<bool>(),
        prop_oneof![Just(64usize << 20), Just(1), Just(20_000)],
        0u64..1000,
    )
        .prop_map(|(resolve, filter, kernel, table, thickness, samples, cull, tile_memory, seed)| {
            RenderOptions {
                samples,
                filter,
                kernel,
                table,
                thickness,
                resolve,
                cull,
                tile_memory,
                seed,
                pattern: if seed % 2 == 0 { PatternKind::Sobol } else { PatternKind::PoissonDisc },
                aovs: AovSelection {
                    variance: seed % 3 == 0,
                    depth: seed % 5 == 0,
                    ..AovSelection::default()
                },
                background: (seed % 4 == 0).then_some([0.2, 0.4, 0.1, 0.5]),
                window: (seed % 6 == 0).then_some(PixelRect::new(31, 17, 32 + (seed % 20) as i32, 18)),
                sample_range: (seed % 7 == 0 && samples > 2).then_some(1..samples - 1),
                ..RenderOptions::default()
            }
        })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn hard_scenes_agree(seed in 0u64..1_000_000, camera in camera(), options in options()) {
        let cloud = hard_cloud(120, seed);
        check_fragments(&cloud, &camera, &options);
        check_pictures(&cloud, &camera, &options, &[2]);
    }

    #[test]
    fn ordinary_scenes_agree(seed in 0u64..1_000_000, camera in camera(), options in options()) {
        let cloud = jumble(300, 0.05, seed);
        check_fragments(&cloud, &camera, &options);
        check_pictures(&cloud, &camera, &options, &[2]);
    }
}

#[test]
fn at_least_a_million_fragments_agree() {
    let mut total = 0;
    for seed in 0..4 {
        let cloud = hard_cloud(400, seed);
        let camera = with_lens(pinhole(160, 120, 120.0), Lens { radius: 0.03, focus: 2.0, blades: 6 });
        let options = RenderOptions { samples: 11, ..RenderOptions::default() };
        total += check_fragments(&cloud, &camera, &options);
        total += check_fragments(&cloud, &pinhole(160, 120, 120.0), &options);
    }
    assert!(total > 1_000_000, "{total}");
}
