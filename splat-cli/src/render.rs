//! `splat render`: clouds in, a picture out.

use crate::arguments::{OutputArguments, RenderArguments};
use crate::choices::{ExrTypeChoice, ShadingChoice};
use crate::console::Console;
use crate::engine::Engine;
use crate::inputs::{Reading, Sampling};
use crate::progress::Progress;
use crate::statistics::{Report, Times, is_stdout};
use crate::values::ViewDirection;
use crate::{describe, eye_dome, inputs, material, output, prepare as preparation, resolve};
use splat_abuffer::Resolve;
use splat_core::prepare::{PrepareOptions, prepare};
use splat_core::{Camera, Cloud, RenderOptions, Statistics};
use splat_io::{ExrOptions, ImportReport, Metadata, read_camera_json, write_picture};
use std::path::Path;
use std::time::Instant;

/// Runs the command.
///
/// # Errors
/// The first thing that goes wrong.
pub fn run(arguments: &RenderArguments) -> anyhow::Result<()> {
    let start = Instant::now();
    let console = arguments.talk.console();
    let progress = Progress::new(arguments.talk.progress, console.quiet);
    let options = resolve::options(arguments)?;
    output::check_picture(&arguments.output, options.aovs)?;
    if let Some(path) = arguments.outputs.stats.as_deref().filter(|path| !is_stdout(path)) {
        output::check_file(path)?;
    }

    preparation::use_threads(arguments.outputs.threads.unwrap_or(0));
    let mut engine = Engine::new(arguments.outputs.engine, arguments.outputs.threads, console)?;
    let mut times = Times::default();
    let images = material::read(&arguments.material, console)?;
    let reading = Reading { sampling: Sampling::default(), with_faces: false };
    let (input, time) = progress.stage("read", |update| inputs::read(&arguments.inputs, reading, update));
    times.read = time;
    let (mut cloud, reports) = input?;
    note_assumptions(console, &cloud, &reports);
    let camera_path = arguments.camera.camera.as_deref();
    let camera = camera_path.map(|path| read_camera_json(path, resolve::default_near(&cloud))).transpose()?;

    let up = resolve::up(&arguments.camera, &cloud);
    let missing = PrepareOptions {
        kernel: options.kernel,
        cutoff: options.cutoff,
        areas: options.resolve != Resolve::Over,
        ..arguments.preparation.options(up)
    };
    let (estimated, time) = progress.stage("prepare", |update| prepare(&mut cloud, &missing, update));
    times.prepare = time;
    if let Some(text) = preparation::in_words(&estimated, &missing) {
        console.note(text);
    }
    inputs::check_usable(&cloud, &reports)?;
    let (camera, mut options) = resolve::against_cloud(arguments, options, camera, &cloud)?;
    options.material = material::material(&arguments.material, images, &cloud, up)?;
    options.check()?;

    let strength = arguments.splats.edl_strength.unwrap_or(1.0);
    let rendered = if arguments.splats.shading == ShadingChoice::Edl {
        eye_dome::render(&mut engine, &cloud, &camera, &options, strength, &progress, console)?
    } else {
        engine.render(&cloud, &camera, &options, &progress, console)?
    };
    let hashes: Vec<&str> = reports.iter().map(|report| report.sha256.as_str()).collect();
    let mut in_words = describe::options(&options) + &material::describe(&arguments.material);
    in_words += &arguments.preparation.describe();
    if arguments.splats.shading == ShadingChoice::Edl {
        for lit in ["--shading color", "--shading headlight"] {
            in_words = in_words.replace(lit, &format!("--shading edl --edl-strength {strength}"));
        }
    }
    if let Some(ViewDirection { azimuth, elevation }) = arguments.splats.light {
        in_words += &format!(" --light {azimuth},{elevation}");
    }
    let metadata = Metadata {
        input_hash: Some(hashes.join(" ")),
        options: Some(in_words),
        ..metadata(&camera, &options, &engine)
    };
    let (written, time) = progress.stage("write", |_| {
        write_picture(&arguments.output, &rendered.film, &metadata, &exr_options(&arguments.outputs))
    });
    times.write = time;
    written?;
    times.total = start.elapsed();

    let read = cloud.len();
    warn_of_losses(console, &rendered.statistics);
    console.summary(summary(read, &rendered.statistics, times.total.as_secs_f64(), &arguments.output));
    if let Some(path) = &arguments.outputs.stats {
        Report::new(read, &rendered.statistics, times, &engine).write(path)?;
    }
    Ok(())
}

/// Says what was assumed of files and cloud, if anyone wants to know.
fn note_assumptions(console: Console, cloud: &Cloud, reports: &[ImportReport]) {
    for report in reports {
        for assumption in &report.assumptions {
            console.note(format_args!("{}: {assumption}", report.path.display()));
        }
    }
    for assumption in describe::assumptions(cloud) {
        console.note(assumption);
    }
}

/// What the picture file says about how it was made, save the input.
pub fn metadata(camera: &Camera, options: &RenderOptions, engine: &Engine) -> Metadata {
    Metadata {
        software: Some(concat!("splat ", env!("CARGO_PKG_VERSION")).to_owned()),
        world_to_camera: Some(camera.world_to_camera),
        samples: Some(options.samples),
        sample_range: options.sample_range.clone(),
        seed: Some(options.seed),
        engine: Some(engine.name().to_owned()),
        options: Some(describe::options(options)),
        input_hash: None,
    }
}

fn exr_options(arguments: &OutputArguments) -> ExrOptions {
    ExrOptions {
        full_floats: arguments.exr_type == ExrTypeChoice::Float,
        compression: arguments.exr_compression.into(),
        ..ExrOptions::default()
    }
}

/// Warns of dropped points and of an empty picture.
fn warn_of_losses(console: Console, statistics: &Statistics) {
    if !statistics.dropped.is_empty() {
        let dropped: usize = statistics.dropped.values().sum();
        console.warn(format_args!("points dropped: {dropped} ({})", describe::causes(&statistics.dropped)));
    }
    if statistics.drawn == 0 {
        console.warn("no splat is in view: the picture is empty");
    }
}

/// The one line that says what was done.
pub fn summary(read: usize, statistics: &Statistics, seconds: f64, output: &Path) -> String {
    let Statistics { dropped, drawn, .. } = statistics;
    let causes = if dropped.is_empty() { String::new() } else { format!(" ({})", describe::causes(dropped)) };
    let dropped: usize = dropped.values().sum();
    let output = output.display();
    format!("{output}: {read} points read, {dropped} dropped{causes}, {drawn} drawn, {seconds:.1} s")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_summary_is_one_line() {
        let dropped = [("edge_on", 2), ("not_finite", 1)].into();
        let statistics = Statistics { dropped, drawn: 7, ..Statistics::default() };
        assert_eq!(
            summary(10, &statistics, 1.25, Path::new("a.png")),
            "a.png: 10 points read, 3 dropped (2 edge_on, 1 not_finite), 7 drawn, 1.2 s"
        );
        let clean = Statistics { drawn: 3, ..Statistics::default() };
        assert_eq!(
            summary(3, &clean, 0.0, Path::new("a.png")),
            "a.png: 3 points read, 0 dropped, 3 drawn, 0.0 s"
        );
    }
}
