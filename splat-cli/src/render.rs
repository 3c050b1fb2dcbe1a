//! `splat render`: clouds in, a picture out.

use crate::arguments::RenderArguments;
use crate::assemble::{Assembled, assemble};
use crate::cameras::Fitted;
use crate::checkpoint::{self, Checkpoint, Checkpoints};
use crate::choices::{ExrTypeChoice, ShadingChoice};
use crate::console::Console;
use crate::engine::Engine;
use crate::progress::Progress;
use crate::statistics::{self, Report, Times, is_stdout};
use crate::usage::UsageError;
use crate::values::ViewDirection;
use crate::{
    describe, eye_dome, frames, map, material, output, prepare as preparation, resolve, scene, values,
};
use splat_core::{AovSelection, Camera, Cloud, RenderOptions, Statistics};
use splat_io::{ExrOptions, ImportReport, Metadata, PictureOptions, camera_json, write_picture};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Runs the command.
///
/// # Errors
/// The first thing that goes wrong.
pub fn run(arguments: &RenderArguments) -> anyhow::Result<()> {
    let start = Instant::now();
    let console = arguments.talk.console();
    let progress = Progress::new(arguments.talk.progress, console.quiet);
    let options = resolve::options(arguments, false)?;
    let inputs = input_files(arguments)?;
    check_outputs(arguments, options.aovs, &inputs)?;

    preparation::use_threads(arguments.outputs.threads.unwrap_or(0));
    let mut engine = Engine::new(arguments.outputs.engine, arguments.outputs.threads, console)?;
    let mut times = Times::default();
    let Assembled { cloud, reports, image_hashes, materials, color, options } =
        assemble(arguments, console, &progress, &mut times)?;
    let shots = frames::plan(arguments, resolve::default_near(&cloud), console)?;
    for picture in shots.iter().map(|shot| &shot.output).chain([&arguments.picture()]) {
        let mut written = vec![picture.clone(), checkpoint::beside(picture)];
        if arguments.outputs.aov_files {
            written.extend(values::AOVS.iter().map(|aov| picture.with_extension(format!("{aov}.exr"))));
        }
        written.iter().try_for_each(|path| output::spare_inputs(path, &inputs))?;
    }
    let is_fitted = shots.iter().any(|shot| shot.camera.is_none());
    let fitted = is_fitted.then(|| Fitted::new(arguments, &cloud, &options)).transpose()?;

    let count = shots.len();
    let mut statistics = Vec::with_capacity(count);
    let mut memory = None;
    let checkpoints = Checkpoints::new(arguments, &reports);
    let mut sequence = (count > 1).then(|| checkpoints.of_sequence()).transpose()?;
    for (number, shot) in (1..).zip(shots) {
        let camera = shot.camera.or_else(|| Some(fitted.as_ref()?.camera(shot.index)));
        let camera = camera.expect("a shot has a camera, or there is a fitted one");
        let (camera, options) = resolve::against_cloud(arguments, options.clone(), camera, &cloud)?;
        let memory = *memory.get_or_insert_with(|| arguments.memory.for_rendering(camera.width, &options));
        let options = RenderOptions { material: materials.clone(), memory, ..options };
        options.check()?;
        if sequence.as_ref().is_some_and(|sequence| sequence.has(&shot.output, &camera)) {
            console.summary(format_args!("{}: complete already", shot.output.display()));
            continue;
        }
        let mut checkpoint = checkpoints.of(&shot.output, &camera);
        let picture = Picture {
            arguments,
            cloud: &cloud,
            reports: &reports,
            image_hashes: &image_hashes,
            color: &color,
            camera: camera.clone(),
            options,
            path: shot.output.clone(),
        };
        let progress = progress.frame(number, count);
        statistics.push(picture.make(&mut engine, &mut checkpoint, &progress, &mut times, start)?);
        checkpoint.remove();
        if let Some(sequence) = &mut sequence {
            sequence.add(shot.output, camera);
        }
    }
    if let Some(sequence) = sequence {
        sequence.remove();
    }
    if let Some(path) = &arguments.outputs.stats {
        statistics::write(&statistics, path)?;
    }
    Ok(())
}

/// All files that are read: those of the command line, and those that its scene file names.
fn input_files(arguments: &RenderArguments) -> anyhow::Result<Vec<PathBuf>> {
    let RenderArguments { inputs, camera, material, .. } = arguments;
    let sources = scene::sources(arguments)?;
    let of_sources =
        sources.iter().flat_map(|source| source.settings.material.images().chain([&source.path]));
    let cameras = camera.camera.iter().chain(&camera.frames.intrinsic);
    Ok(inputs.iter().chain(cameras).chain(material.images()).chain(of_sources).cloned().collect())
}

/// Checks, before the work, that what will be written can be, and is none of the inputs.
fn check_outputs(arguments: &RenderArguments, aovs: AovSelection, inputs: &[PathBuf]) -> anyhow::Result<()> {
    let picture = arguments.picture();
    if arguments.output.is_none() && picture.exists() {
        let message = format!("{} exists: name the picture with -o", picture.display());
        return Err(UsageError::new(message).into());
    }
    output::spare_inputs(&picture, inputs)?;
    output::check_picture(&picture, aovs, arguments.outputs.aov_files)?;
    if let Some(path) = arguments.outputs.stats.as_deref().filter(|path| !is_stdout(path)) {
        if *path == picture {
            return Err(UsageError::new(format!("--stats {} is the picture", path.display())).into());
        }
        output::spare_inputs(path, inputs)?;
        output::check_file(path)?;
    }
    Ok(())
}

/// A picture to be made.
struct Picture<'a> {
    arguments: &'a RenderArguments,
    cloud: &'a Cloud,
    reports: &'a [ImportReport],
    image_hashes: &'a [String],
    /// What is shown as colour, in words.
    color: &'a str,
    camera: Camera,
    options: RenderOptions,
    path: PathBuf,
}

impl Picture<'_> {
    /// Renders and writes it, and says what it took.
    fn make(
        self,
        engine: &mut Engine,
        checkpoint: &mut Checkpoint<'_>,
        progress: &Progress,
        times: &mut Times,
        start: Instant,
    ) -> anyhow::Result<Report> {
        let Self { arguments, cloud, reports, image_hashes, color, camera, options, path } = self;
        let console = arguments.talk.console();
        let strength = arguments.splats.edl_strength.unwrap_or(1.0);
        let is_edl = arguments.splats.shading == ShadingChoice::Edl;
        let mut render =
            |options: &_| engine.render(cloud, &camera, options, Some(checkpoint), progress, console);
        let rendered =
            if is_edl { eye_dome::render(&camera, &options, strength, render)? } else { render(&options)? };
        let hashes = reports.iter().map(|report| &report.sha256).chain(image_hashes);
        let hashes: Vec<&str> = hashes.map(String::as_str).collect();
        let mut in_words = describe::options(&options) + &material::describe(&arguments.material) + color;
        in_words += &arguments.preparation.describe();
        in_words += &arguments.reading.describe();
        if is_edl {
            for lit in ["--shading color", "--shading headlight"] {
                in_words = in_words.replace(lit, &format!("--shading edl --edl-strength {strength}"));
            }
        }
        if let Some(ViewDirection { azimuth, elevation }) = arguments.splats.light {
            in_words += &format!(" --light {azimuth},{elevation}");
        }
        if arguments.scene.is_some() {
            in_words += &format!("\n{}", scene::clouds(arguments));
        }
        let metadata = Metadata {
            input_hash: Some(hashes.join(" ")),
            options: Some(in_words),
            pixels_per_inch: arguments.camera.map.dpi(),
            ..metadata(&camera, &options, engine)
        };
        let (written, time) = progress
            .stage("write", |_| write_picture(&path, &rendered.film, &metadata, &picture_options(arguments)));
        times.write = time;
        written?;
        times.total = start.elapsed();

        let read = cloud.len();
        warn_of_losses(console, &rendered.statistics);
        console.summary(summary(read, &rendered.statistics, times.total.as_secs_f64(), &path));
        if let Some(print) = map::describe(&arguments.camera.map, &camera) {
            console.summary(print);
        }
        Ok(Report::new(read, &rendered.statistics, *times, engine))
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
        camera: camera_json(camera),
        crop: options.window,
        ..Metadata::default()
    }
}

fn picture_options(arguments: &RenderArguments) -> PictureOptions {
    let RenderArguments { outputs: arguments, memory, .. } = arguments;
    PictureOptions {
        exr: ExrOptions {
            full_floats: arguments.exr_type == ExrTypeChoice::Float,
            compression: arguments.exr_compression.into(),
            // Each processor would have some lines at hand.
            parallel: !memory.is_limited(),
        },
        png_depth: arguments.png_depth.into(),
        separate_aovs: arguments.aov_files,
    }
}

/// Warns of bad points and of an empty picture. That some splats are seen edge-on is nobody's fault: the summary counts
/// them.
fn warn_of_losses(console: Console, statistics: &Statistics) {
    let bad = || statistics.dropped.iter().filter(|(cause, _)| **cause != "edge_on");
    let count: usize = bad().map(|(_, count)| count).sum();
    if count > 0 {
        console.warn(format_args!("points dropped: {count} ({})", describe::causes(bad())));
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
