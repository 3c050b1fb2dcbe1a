//! Times, the least of several repetitions.

use anyhow::Context;
use splat_bench::{Case, Scene};
use splat_core::raster::Rasterizer;
use splat_core::setup::{SetUp, View, set_up};
use splat_core::{Cloud, Statistics};
use splat_simd::{Level, Renderer};
use std::hint::black_box;
use std::time::{Duration, Instant};

/// The least of several times.
#[derive(Debug, Clone, Copy)]
pub struct Least(Duration);

impl Default for Least {
    fn default() -> Self {
        Self(Duration::MAX)
    }
}

impl Least {
    fn take(&mut self, time: Duration) {
        self.0 = self.0.min(time);
    }

    /// In nanoseconds, shared among `count` things.
    pub fn per(self, count: u64) -> f64 {
        self.0.as_secs_f64() * 1e9 / count as f64
    }
}

/// What is measured of a case.
#[derive(Debug)]
pub struct Measured {
    /// The case.
    pub case: Case,
    /// Splats of the cloud.
    pub splats: u64,
    /// Fragments of the picture.
    pub fragments: u64,
    /// Samples that the fast core tests for them.
    pub tests: u64,
    /// Fragments of the same without blur.
    pub pinhole_fragments: u64,
    /// The raster of the reference without blur.
    pub reference: Least,
    /// The fast core at each level.
    pub levels: Vec<LevelTimes>,
    /// Bytes beyond cloud and picture.
    pub memory: Option<u64>,
}

/// The fast core's times at a level: those of one thread, unless it says otherwise.
#[derive(Debug)]
pub struct LevelTimes {
    /// The level.
    pub level: Level,
    /// Set-up.
    pub setup: Least,
    /// Sorting splats into tiles.
    pub bin: Least,
    /// Making fragments, and no more.
    pub raster: Least,
    /// Making, storing and grouping fragments.
    pub stored: Least,
    /// Resolving them.
    pub resolve: Least,
    /// Both of that in the same frame.
    pub both: Least,
    /// The whole frame, on one thread and on two.
    pub frame: [Least; 2],
    renderers: [Renderer; 2],
}

impl LevelTimes {
    fn new(level: Level) -> anyhow::Result<Self> {
        let least = Least::default();
        Ok(Self {
            level,
            setup: least,
            bin: least,
            raster: least,
            stored: least,
            resolve: least,
            both: least,
            frame: [least; 2],
            renderers: [Renderer::new(1, level)?, Renderer::new(2, level)?],
        })
    }

    /// The raster alone once more.
    fn rasterize(&mut self, cloud: &Cloud, Scene { camera, options }: &Scene) -> anyhow::Result<Statistics> {
        let statistics = self.renderers[0].rasterize(cloud, camera, options)?;
        self.raster.take(statistics.raster);
        Ok(statistics)
    }

    /// A frame once more, on `threads`, 1 or 2.
    fn render(&mut self, cloud: &Cloud, scene: &Scene, threads: usize) -> anyhow::Result<Statistics> {
        let start = Instant::now();
        let rendered =
            self.renderers[threads - 1].render(cloud, &scene.camera, &scene.options, &mut |_| {})?;
        self.frame[threads - 1].take(start.elapsed());
        let statistics = rendered.statistics;
        if threads == 1 {
            self.setup.take(statistics.setup);
            self.bin.take(statistics.bin);
            self.stored.take(statistics.raster);
            self.resolve.take(statistics.resolve);
            self.both.take(statistics.raster + statistics.resolve);
        }
        Ok(statistics)
    }
}

/// The reference's raster, ready to be run.
struct Reference {
    rasterizer: Rasterizer,
    set_up: SetUp,
}

impl Reference {
    fn new(cloud: &Cloud, Scene { camera, options }: &Scene) -> Self {
        let view = View::new(camera, options);
        Self { rasterizer: Rasterizer::new(&view, options), set_up: set_up(cloud, &view, options) }
    }

    /// Makes every fragment and adds them up. Returns their number.
    fn run(&self) -> u64 {
        let (mut count, mut sum) = (0, 0.0);
        for (rank, splat) in self.set_up.splats.iter().enumerate() {
            self.rasterizer.rasterize(splat, rank as u32, &splat.bounds, &mut |_, fragment| {
                count += 1;
                sum += fragment.weight + fragment.depth;
            });
        }
        black_box(sum);
        count
    }
}

/// Measures a case at every level.
///
/// # Errors
/// If it cannot be rendered.
pub fn case(case: Case, cloud: &Cloud, repetitions: usize) -> anyhow::Result<Measured> {
    let scene = case.scene(cloud)?;
    let reference = Reference::new(cloud, &case.pinhole().scene(cloud)?);
    let mut measured = Measured {
        case,
        splats: cloud.len() as u64,
        fragments: 0,
        tests: 0,
        pinhole_fragments: 0,
        reference: Least::default(),
        levels: Level::available().into_iter().map(LevelTimes::new).collect::<Result<_, _>>()?,
        memory: None,
    };
    // One after the other, so that what slows the machine for a while slows them all.
    for _ in 0..repetitions {
        let start = Instant::now();
        measured.pinhole_fragments = reference.run();
        measured.reference.take(start.elapsed());
        for level in &mut measured.levels {
            let statistics = level.rasterize(cloud, &scene)?;
            (measured.fragments, measured.tests) = (statistics.fragments, statistics.tests);
            for threads in [1, 2] {
                level.render(cloud, &scene, threads)?;
            }
        }
    }
    Ok(measured)
}

/// Renders a case `count` times on one thread, and says what it took.
///
/// # Errors
/// If it cannot be rendered.
pub fn frames(case: Case, count: usize) -> anyhow::Result<String> {
    let cloud = case.subject.cloud()?.with_context(|| case.subject.skipped())?;
    let scene = case.scene(&cloud)?;
    let mut times = LevelTimes::new(Level::choose())?;
    let mut fragments = 0;
    for _ in 0..count {
        fragments = times.render(&cloud, &scene, 1)?.fragments;
    }
    Ok(format!(
        "{case} {}: {fragments} fragments; ns a fragment: raster and store {:.2}, resolve {:.2}, both {:.2}, \
         frame {:.2}",
        times.level.name(),
        times.stored.per(fragments),
        times.resolve.per(fragments),
        times.both.per(fragments),
        times.frame[0].per(fragments),
    ))
}

/// The same of the raster alone.
///
/// # Errors
/// If it cannot be rendered.
pub fn rasters(case: Case, count: usize) -> anyhow::Result<String> {
    let cloud = case.subject.cloud()?.with_context(|| case.subject.skipped())?;
    let scene = case.scene(&cloud)?;
    let mut times = LevelTimes::new(Level::choose())?;
    let mut fragments = 0;
    for _ in 0..count {
        fragments = times.rasterize(&cloud, &scene)?.fragments;
    }
    let (level, raster) = (times.level.name(), times.raster.per(fragments));
    Ok(format!("{case} {level}: {fragments} fragments; ns a fragment: raster alone {raster:.2}"))
}
