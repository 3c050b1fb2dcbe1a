//! `splat demo`: a still life, made in code, that shows what the program does.

mod light;
mod paint;
mod scene;
mod surfaces;

use crate::arguments::DemoArguments;
use crate::choices::EngineChoice;
use crate::engine::Engine;
use crate::output;
use crate::progress::Progress;
use crate::render::{metadata, summary};
use crate::usage::UsageError;
use splat_core::{AovSelection, RenderOptions};
use splat_io::{PictureOptions, PlyEncoding, write_camera_json, write_picture, write_ply};
use std::time::Instant;

/// Runs the command.
///
/// # Errors
/// The first thing that goes wrong.
pub fn run(arguments: &DemoArguments) -> anyhow::Result<()> {
    let start = Instant::now();
    let console = arguments.talk.console();
    let progress = Progress::new(arguments.talk.progress, console.quiet);
    let options = RenderOptions {
        samples: arguments.spp,
        background: Some(scene::background()),
        // No surface of the scene shows its back.
        cull: true,
        ..RenderOptions::default()
    };
    options.check().map_err(UsageError::new)?;
    if let Some(path) = &arguments.output {
        output::check_picture(path, AovSelection::default(), false)?;
    }
    for path in [&arguments.save_ply, &arguments.save_camera].into_iter().flatten() {
        output::check_file(path)?;
    }

    let camera = scene::camera(arguments.size);
    let (cloud, _) = progress.stage("build", |_| scene::cloud());
    if let Some(path) = &arguments.save_ply {
        write_ply(path, &cloud, PlyEncoding::Binary)?;
    }
    if let Some(path) = &arguments.save_camera {
        write_camera_json(path, &camera)?;
    }
    let Some(path) = &arguments.output else { return Ok(()) };
    let mut engine = Engine::new(EngineChoice::Fast, None, console)?;
    let rendered = engine.render(&cloud, &camera, &options, None, &progress, console)?;
    let metadata = metadata(&camera, &options, &engine);
    let (written, _) = progress
        .stage("write", |_| write_picture(path, &rendered.film, &metadata, &PictureOptions::default()));
    written?;
    let seconds = start.elapsed().as_secs_f64();
    console.summary(summary(cloud.len(), &rendered.statistics, seconds, path));
    Ok(())
}
