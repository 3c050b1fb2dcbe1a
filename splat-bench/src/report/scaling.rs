//! Time and memory against size: number of splats, samples, resolution, overdraw, threads.

use super::Context;
use super::figures::Kind;
use super::fit::exponent;
use super::html::{Block, Section};
use super::plot::{Plot, Series, number};
use super::scenes::sphere_of;
use super::timing::Times;
use splat_bench::sphere;
use splat_core::setup::VisibleSplat;
use splat_core::{Camera, Cloud, Projection, RenderOptions};
use splat_simd::{Level, Renderer};
use std::time::Instant;

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
        "The sphere. Exponents p of time = a size^p are fitted to all sizes. Memory is what set-up keeps of the visible splats \
         and their tiles, computed from their number; fragments are bounded by the budget of a tile.",
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
    let largest = if context.quick { 100_000 } else { 1_000_000 };
    let counts = [10_000usize, 30_000, 100_000, 300_000, 1_000_000];
    let clouds: Vec<(usize, Cloud)> = {
        context.say("scaling: clouds");
        counts.into_iter().filter(|&count| count <= largest).map(|count| (count, sphere(count))).collect()
    };
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
    for _ in 0..context.repetitions {
        for (i, point) in points.iter().enumerate() {
            let cloud = clouds.iter().find(|(count, _)| *count == point.cloud);
            let cloud = &cloud.expect("every size has a cloud").1;
            let start = Instant::now();
            let rendered = times[i][0]
                .measure(|| renderers[i].render(cloud, &point.camera, &point.options, &mut |_| {}))?;
            let whole = start.elapsed();
            statistics[i] = rendered.statistics;
            let splat_core::Statistics { setup, bin, .. } = statistics[i];
            times[i][1].add((setup + bin).min(whole));
        }
    }
    let mut rows = Vec::new();
    let mut curve = Vec::new();
    let mut of_splats = Vec::new();
    for ((point, times), statistics) in points.iter().zip(&times).zip(&statistics) {
        let [frame, setup] = times.each_ref().map(Times::least);
        let fragments = statistics.fragments as f64;
        let memory = statistics.drawn as f64 * size_of::<VisibleSplat>() as f64 / 1e6;
        let size = number(point.size);
        context.figures.note_noisy([SECTION, axis, &size, "frame, ms"], Kind::Time, frame, times[0].noise());
        context.figures.note([SECTION, axis, &size, "memory of visible splats, MB"], Kind::Memory, memory);
        context.figures.note([SECTION, axis, &size, "fragments"], Kind::Plain, fragments);
        rows.push(vec![
            size,
            number(frame),
            number(setup),
            number(fragments),
            number(frame * 1e6 / fragments),
            number(memory),
        ]);
        curve.push([point.size, frame]);
        of_splats.push([point.size, setup]);
    }
    section.heading(axis);
    section.table(
        &[
            axis,
            "frame, ms",
            "set-up and tiles, ms",
            "fragments",
            "frame, ns a fragment",
            "visible splats, MB",
        ],
        rows,
    );
    let series = vec![series("frame", &curve), series("set-up and tiles", &of_splats)];
    let axes = [axis.to_owned(), "time, ms".to_owned()];
    section.blocks.push(Block::Plot(Plot { title: format!("Time against {axis}"), axes, series }));
    if let (Some(frame), Some(setup)) = (exponent(&curve), exponent(&of_splats)) {
        context.figures.note([SECTION, axis, "all", "exponent of the frame"], Kind::Plain, frame);
        context.figures.note([SECTION, axis, "all", "exponent of set-up and tiles"], Kind::Plain, setup);
        let judged = match axis {
            "splats" if frame <= 1.05 => " At fixed overdraw it is not worse than linear.",
            "splats" => " At fixed overdraw it is worse than linear.",
            _ => "",
        };
        section.verdict(format!(
            "The time of a frame grows as {axis}^{frame:.2}, that of set-up and tiles as {axis}^{setup:.2}.{judged}"
        ));
    }
    Ok(())
}

fn series(name: &str, points: &[[f64; 2]]) -> Series {
    let points = points.iter().map(|&[x, y]| (x, y, String::new())).collect();
    Series { name: name.into(), points, joined: true }
}
