//! The reference, stage by stage: `cargo bench -p splat-bench`. Times are those of one thread.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use splat_bench::{sphere, sphere_camera, sphere_options};
use splat_core::raster::Rasterizer;
use splat_core::setup::{View, set_up};
use splat_core::{Lens, Projection, fragments, render};
use std::hint::black_box;

/// Splats of the sphere.
const SPLATS: usize = 100_000;

fn stages(criterion: &mut Criterion) {
    let cloud = sphere(SPLATS);
    let options = sphere_options();
    for (name, lens_radius) in [("pinhole", None), ("blur of 4 pixels", Some(0.007))] {
        let mut camera = sphere_camera();
        if let Projection::Perspective { lens, .. } = &mut camera.projection {
            *lens = lens_radius.map(|radius| Lens { radius, focus: 1.0, blades: 0 });
        }
        let mut group = criterion.benchmark_group(format!("reference, {SPLATS} discs, 8 samples, {name}"));
        group.sample_size(10);

        let view = View::new(&camera, &options);
        group.throughput(Throughput::Elements(SPLATS as u64));
        group.bench_function("set-up, a splat", |bencher| bencher.iter(|| set_up(&cloud, &view, &options)));

        let splats = set_up(&cloud, &view, &options).splats;
        let rasterizer = Rasterizer::new(&view, &options);
        let (mut count, mut tests) = (0, 0);
        for (rank, splat) in splats.iter().enumerate() {
            tests += rasterizer.rasterize(splat, rank as u32, &splat.bounds, &mut |_, _| count += 1);
        }
        group.throughput(Throughput::Elements(tests));
        group.bench_function("raster, a sample test", |bencher| {
            bencher.iter(|| {
                let mut sum = 0.0;
                for (rank, splat) in splats.iter().enumerate() {
                    rasterizer.rasterize(splat, rank as u32, &splat.bounds, &mut |_, fragment| {
                        sum += fragment.weight + fragment.depth;
                    });
                }
                black_box(sum)
            });
        });
        group.throughput(Throughput::Elements(count));
        group.bench_function("whole frame, a fragment", |bencher| {
            bencher.iter(|| render(&cloud, &camera, &options, &mut |_| {}).expect("a valid scene"));
        });
        group.finish();
    }
    // Of use to whoever reads the figures: how many of the tests hit.
    let camera = sphere_camera();
    let mut hits = 0u64;
    let tests = fragments(&cloud, &camera, &options, &mut |_, _, _| hits += 1).expect("a valid scene");
    assert!(hits * 3 > tests, "the candidates' boxes have grown loose: {hits} hits in {tests} tests");
}

criterion_group!(benches, stages);
criterion_main!(benches);
