//! Time and memory against size: number of splats, samples, resolution, overdraw, threads.

use super::Context;
use super::figures::Kind;
use super::fit::exponent;
use super::html::{Block, Section};
use super::plot::{Plot, Series, number};
use super::scenes::sphere_of;
use anyhow::bail;
use splat_bench::timing::Times;
use splat_bench::{bare_sphere, memory};
use splat_core::{Camera, Cloud, Projection, RenderOptions};
use splat_simd::{Level, Renderer};

/// The name of this part among the figures.
const SECTION: &str = "scaling";

/// Something rendered at one size.
struct Point {
    size: f64,
    cloud: usize,
    camera: Camera,
    options: RenderOptions,
    threads: usize,
}

/// Measures every axis.
///
/// # Errors
/// If something cannot be rendered.
pub fn section(context: &mut Context) -> anyhow::Result<Section> {
    let mut section = Section::new("Scaling");
    section.text(
        "The sphere. Exponents p of time = a size^p and memory = b size^p are fitted to all sizes. Memory is the peak of a frame beyond cloud and picture, \
         measured in a process of its own (VmHWM of Linux); of fragments there is never more than the budget of a tile on each thread, \
         so that it is splats, tables and threads that count.",
    );
    let base = sphere_of(1000, 480)?;
    let (camera, options) = (base.camera, base.options);
    let point = |size: f64, cloud, camera: &Camera, options: &RenderOptions, threads| Point {
        size,
        cloud,
        camera: camera.clone(),
        options: options.clone(),
        threads,
    };
    let largest = if context.quick { 100_000 } else { 10_000_000 };
    let counts = [10_000usize, 30_000, 100_000, 300_000, 1_000_000, 3_000_000, 10_000_000];
    context.say("scaling: clouds");
    let clouds: Vec<(usize, Cloud)> = counts
        .into_iter()
        .filter(|&count| count <= largest)
        .map(|count| (count, even_sphere(count)))
        .collect();
    // Sizes shrink with the spacing, so the overdraw stays.
    let splats: Vec<Point> =
        clouds.iter().map(|(count, _)| point(*count as f64, *count, &camera, &options, 1)).collect();
    let samples: Vec<Point> = [4, 8, 16, 32, 64]
        .map(|samples| {
            let options = RenderOptions { samples, ..options.clone() };
            point(f64::from(samples), 10_000, &camera, &options, 1)
        })
        .into();
    let resolution: Vec<Point> = [240, 480, 960, 1440]
        .into_iter()
        .filter(|&width| !context.quick || width <= 960)
        .map(|width| {
            let camera = resized(&camera, width);
            point(f64::from(camera.width * camera.height), 10_000, &camera, &options, 1)
        })
        .collect();
    // A larger cutoff is a larger disc: its area is the number of fragments in a sample.
    let overdraw: Vec<Point> = [1.0, 2.0, 4.0, 8.0, 16.0]
        .map(|cutoff| {
            let options = RenderOptions { cutoff, ..options.clone() };
            point(cutoff, 10_000, &camera, &options, 1)
        })
        .into();
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    let threads: Vec<Point> = (0..)
        .map(|power| 1usize << power)
        .take_while(|&threads| threads <= processors)
        .map(|threads| point(threads as f64, 10_000, &camera, &options, threads))
        .collect();
    for (axis, points) in [
        ("splats", splats),
        ("samples a pixel", samples),
        ("pixels", resolution),
        ("overdraw (cutoff F)", overdraw),
        ("threads", threads),
    ] {
        context.say(&format!("scaling: {axis}"));
        measure(axis, &points, &clouds, &mut section, context)?;
    }
    Ok(section)
}

/// The sphere of so many discs, each of the same part of its area: what `prepare` would find, without the search.
fn even_sphere(count: usize) -> Cloud {
    let mut cloud = bare_sphere(count);
    cloud.areas = Some(vec![(4.0 * std::f64::consts::PI / count as f64) as f32; count]);
    cloud
}

impl Point {
    /// The arguments that [`memory_of_arguments`] understands.
    fn arguments(&self) -> [String; 6] {
        let options = &self.options;
        [
            "memory".into(),
            self.cloud.to_string(),
            self.camera.width.to_string(),
            options.samples.to_string(),
            options.cutoff.to_string(),
            self.threads.to_string(),
        ]
    }
}

/// Bytes that the frame of these arguments (splats, width, samples, cutoff, threads) takes in this process.
///
/// # Errors
/// If they are none, or the system does not tell.
pub fn memory_of_arguments(arguments: &[String]) -> anyhow::Result<u64> {
    let [count, width, samples, cutoff, threads] = arguments else { bail!("expected five numbers") };
    let cloud = even_sphere(count.parse()?);
    let base = sphere_of(1000, 480)?;
    let options = RenderOptions { samples: samples.parse()?, cutoff: cutoff.parse()?, ..base.options };
    memory::of_frame(&cloud, &resized(&base.camera, width.parse()?), &options, threads.parse()?)
}

/// The same view at another width.
fn resized(camera: &Camera, width: u32) -> Camera {
    let factor = f64::from(width) / f64::from(camera.width);
    let mut camera = camera.clone();
    camera.height = (f64::from(camera.height) * factor).round() as u32;
    camera.width = width;
    camera.principal_point *= factor;
    if let Projection::Perspective { focal_length, .. } = &mut camera.projection {
        *focal_length *= factor;
    }
    camera
}

/// Measures an axis, its sizes taking turns.
fn measure(
    axis: &str,
    points: &[Point],
    clouds: &[(usize, Cloud)],
    section: &mut Section,
    context: &mut Context,
) -> anyhow::Result<()> {
    let mut times = vec![[Times::default(), Times::default()]; points.len()];
    let mut renderers = Vec::new();
    for point in points {
        renderers.push(Renderer::new(point.threads, Level::choose())?);
    }
    let mut statistics = vec![Default::default(); points.len()];
    for repetition in 0..context.repetitions {
        for (i, point) in points.iter().enumerate() {
            // What takes seconds is less noisy.
            if repetition > 0 && times[i][0].least() > 1e3 && repetition >= context.repetitions / 2 {
                continue;
            }
            let cloud = clouds.iter().find(|(count, _)| *count == point.cloud);
            let cloud = &cloud.expect("every size has a cloud").1;
            let [frames, set_ups] = &mut times[i];
            let rendered =
                frames.measure(|| renderers[i].render(cloud, &point.camera, &point.options, &mut |_| {}))?;
            statistics[i] = rendered.statistics;
            let splat_core::Statistics { setup, bin, .. } = statistics[i];
            set_ups.add(setup + bin);
        }
    }
    drop(renderers);
    let mut rows = Vec::new();
    let [mut of_frame, mut of_set_up, mut of_memory] = [const { Vec::new() }; 3];
    for ((point, times), statistics) in points.iter().zip(&times).zip(&statistics) {
        let [frame, setup] = times.each_ref().map(Times::least);
        let fragments = statistics.fragments as f64;
        let arguments = point.arguments();
        let memory =
            memory::of_child(&arguments.each_ref().map(String::as_str)).map(|bytes| bytes as f64 / 1e6);
        let size = number(point.size);
        let mut note = |quantity: &str, kind, value, noise| {
            context.figures.note_noisy([SECTION, axis, &size, quantity], kind, value, noise);
        };
        note("frame, ms", Kind::Time, frame, times[0].noise());
        note("fragments", Kind::Plain, fragments, 0.0);
        if let Some(memory) = memory {
            note("peak memory, MB", Kind::Memory, memory, 0.0);
            of_memory.push([point.size, memory]);
        }
        rows.push(vec![
            size,
            number(frame),
            number(setup),
            number(fragments),
            number(frame * 1e6 / fragments),
            memory.map_or("?".into(), number),
        ]);
        of_frame.push([point.size, frame]);
        of_set_up.push([point.size, setup]);
    }
    section.heading(axis);
    section.table(
        &[axis, "frame, ms", "set-up and tiles, ms", "fragments", "frame, ns a fragment", "peak memory, MB"],
        rows,
    );
    for (title, unit, curves) in [
        ("Time", "time, ms", vec![series("frame", &of_frame), series("set-up and tiles", &of_set_up)]),
        ("Memory", "peak memory, MB", vec![series("peak memory", &of_memory)]),
    ] {
        let axes = [axis.to_owned(), unit.to_owned()];
        section.blocks.push(Block::Plot(Plot {
            title: format!("{title} against {axis}"),
            axes,
            series: curves,
        }));
    }
    let mut words = Vec::new();
    for (what, curve) in
        [("time of a frame", of_frame), ("time of set-up and tiles", of_set_up), ("peak memory", of_memory)]
    {
        if let Some(p) = exponent(&curve) {
            let quantity = format!("exponent of the {what}");
            context.figures.note([SECTION, axis, "all", &quantity], Kind::Plain, p);
            let judged = match axis {
                "splats" if p <= 1.05 => ", not worse than linear",
                "splats" => ", worse than linear",
                _ => "",
            };
            words.push(format!("the {what} grows as {axis}^{p:.2}{judged}"));
        }
    }
    if !words.is_empty() {
        let overdraw = if axis == "splats" { "At fixed overdraw " } else { "Here " };
        section.verdict(format!("{overdraw}{}.", words.join("; ")));
    }
    Ok(())
}

fn series(name: &str, points: &[[f64; 2]]) -> Series {
    let points = points.iter().map(|&[x, y]| (x, y, String::new())).collect();
    Series { name: name.into(), points, joined: true, rings: false }
}
