//! The fast core against the reference, on one thread: `cargo bench -p splat-bench --bench fast`.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use splat_bench::{sphere, sphere_camera, sphere_options};
use splat_core::render;
use splat_simd::{Level, Renderer};

fn frames(criterion: &mut Criterion) {
    for count in [100_000, 1_000_000] {
        let cloud = sphere(count);
        let (camera, options) = (sphere_camera(), sphere_options());
        let fragments =
            render(&cloud, &camera, &options, &mut |_| {}).expect("a valid scene").statistics.fragments;
        let mut group = criterion.benchmark_group(format!("{count} discs, 8 samples, a fragment"));
        group.sample_size(10);
        group.throughput(Throughput::Elements(fragments));
        group.bench_function("reference", |bencher| {
            bencher.iter(|| render(&cloud, &camera, &options, &mut |_| {}).expect("a valid scene"));
        });
        for level in Level::available() {
            for threads in [1, 2] {
                let mut renderer = Renderer::new(threads, level).expect("threads");
                group.bench_function(format!("{}, {threads} threads", level.name()), |bencher| {
                    bencher.iter(|| {
                        renderer.render(&cloud, &camera, &options, &mut |_| {}).expect("a valid scene")
                    });
                });
            }
        }
        group.finish();
    }
}

criterion_group!(benches, frames);
criterion_main!(benches);
