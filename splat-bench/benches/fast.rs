//! The fast core, stage by stage, at the level of `SPLAT_LEVEL`: `cargo bench -p splat-bench --bench fast [FILTER]`. Times are
//! of one thread, unless they say otherwise, and per splat or per fragment: the reciprocal of the "elements a second".
//! Each group is a case of the benchmark table; the real clouds are measured where `SPLAT_TEST_DATA` names a folder of them.

#![expect(clippy::print_stderr, reason = "for who reads the figures")]

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, SamplingMode, Throughput, criterion_group, criterion_main};
use splat_bench::{Case, Scene, Subject};
use splat_core::{Cloud, Statistics};
use splat_simd::{Level, Renderer};
use std::time::{Duration, Instant};

/// Repetitions of a benchmark: the least that Criterion takes.
const SAMPLES: usize = 10;

/// Short, so that a sample is one frame.
const TIME: Duration = Duration::from_millis(1);

/// A case ready to be measured.
struct Bench<'a> {
    cloud: &'a Cloud,
    scene: Scene,
    renderer: Renderer,
    level: Level,
}

impl Bench<'_> {
    fn render(&mut self) -> Statistics {
        let Scene { camera, options } = &self.scene;
        self.renderer.render(self.cloud, camera, options, &mut |_| {}).expect("a valid scene").statistics
    }

    fn rasterize(&mut self) -> Statistics {
        let Scene { camera, options } = &self.scene;
        self.renderer.rasterize(self.cloud, camera, options).expect("a valid scene")
    }

    /// A benchmark whose times `pick` takes from the statistics that `run` gives.
    fn stage(
        &mut self,
        group: &mut BenchmarkGroup<'_, WallTime>,
        name: &str,
        run: fn(&mut Self) -> Statistics,
        pick: fn(&Statistics) -> Duration,
    ) {
        group.bench_function(name, |bencher| {
            bencher.iter_custom(|count| (0..count).map(|_| pick(&run(self))).sum());
        });
    }

    /// A benchmark of the whole frame on this many threads.
    fn frame(&mut self, group: &mut BenchmarkGroup<'_, WallTime>, threads: usize) {
        self.renderer = Renderer::new(threads, self.level).expect("threads");
        group.bench_function(format!("frame, threads: {threads}"), |bencher| {
            bencher.iter_custom(|count| {
                let start = Instant::now();
                for _ in 0..count {
                    self.render();
                }
                start.elapsed()
            });
        });
    }
}

fn stages(criterion: &mut Criterion) {
    for subject in Subject::ALL {
        let cases: Vec<Case> = subject.cases().into_iter().filter(is_wanted).collect();
        if cases.is_empty() {
            continue;
        }
        match subject.cloud().expect("a readable file") {
            Some(cloud) => cases.into_iter().for_each(|case| stages_of(case, &cloud, criterion)),
            None => eprintln!("{}", subject.skipped()),
        }
    }
}

/// Whether the filter of the command line, if there is one, names a case: so that the others' clouds are not made in vain.
fn is_wanted(case: &Case) -> bool {
    let filter = std::env::args().skip(1).find(|argument| !argument.starts_with('-'));
    let group = filter.as_deref().and_then(|filter| filter.split('/').next());
    group.is_none_or(|group| case.to_string().contains(group))
}

fn stages_of(case: Case, cloud: &Cloud, criterion: &mut Criterion) {
    let level = Level::choose();
    let renderer = Renderer::new(1, level).expect("threads");
    let scene = case.scene(cloud).expect("a cloud to be seen");
    let mut bench = Bench { cloud, scene, renderer, level };
    let Statistics { tests, fragments, .. } = bench.rasterize();
    let ratio = tests as f64 / fragments as f64;
    eprintln!("{case}, {}: {fragments} fragments, {ratio:.2} sample tests for each", level.name());

    let mut group = criterion.benchmark_group(case.to_string());
    group.sample_size(SAMPLES).warm_up_time(TIME).measurement_time(TIME).sampling_mode(SamplingMode::Flat);
    group.throughput(Throughput::Elements(cloud.len() as u64));
    bench.stage(&mut group, "set-up, a splat", Bench::rasterize, |statistics| statistics.setup);
    bench.stage(&mut group, "binning, a splat", Bench::rasterize, |statistics| statistics.bin);
    group.throughput(Throughput::Elements(fragments));
    bench.stage(&mut group, "raster", Bench::rasterize, |statistics| statistics.raster);
    bench.stage(&mut group, "raster and store", Bench::render, |statistics| statistics.raster);
    bench.stage(&mut group, "resolve", Bench::render, |statistics| statistics.resolve);
    bench.frame(&mut group, 1);
    bench.frame(&mut group, 2);
    group.finish();
}

criterion_group!(benches, stages);
criterion_main!(benches);
