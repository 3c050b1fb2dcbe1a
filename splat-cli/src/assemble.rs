//! From the inputs of `splat render` to one complete cloud: each one read, completed, coloured, and put in its place.

use crate::arguments::{CloudArguments, RenderArguments};
use crate::console::Console;
use crate::inputs::{Reading, Sampling, read_one};
use crate::material::{self, Images};
use crate::memory::Memory;
use crate::progress::Progress;
use crate::scene::{self, Source};
use crate::statistics::Times;
use crate::usage::UsageError;
use crate::{colors, describe, prepare as preparation, resolve, strict};
use anyhow::{Context, ensure};
use splat_core::fit::Up;
use splat_core::prepare::{PrepareOptions, prepare};
use splat_core::{Cloud, Material, Materials, RenderOptions};
use splat_io::{Import, ImportReport};

/// A complete cloud, and what is known of it.
#[derive(Debug)]
pub struct Assembled {
    /// The splats of all inputs.
    pub cloud: Cloud,
    /// One for each input.
    pub reports: Vec<ImportReport>,
    /// SHA-256 of the images, those of all clouds first.
    pub image_hashes: Vec<String>,
    /// What the splats are made of.
    pub materials: Materials,
    /// What is shown as colour, in words; empty for the cloud's own.
    pub color: String,
    /// The options of the renderer, as far as they do not depend on a camera.
    pub options: RenderOptions,
}

/// An input that was read.
struct Part {
    source: Source,
    cloud: Cloud,
    images: Images,
}

/// Reads the inputs and makes one complete cloud of them.
///
/// Where nothing tells them apart they are joined first and completed together, so that scans that overlap are one surface.
///
/// # Errors
/// What is wrong with an input, or with what is asked of it.
pub fn assemble(
    arguments: &RenderArguments,
    console: Console,
    progress: &Progress,
    times: &mut Times,
) -> anyhow::Result<Assembled> {
    let strict = arguments.reading.strict;
    let images = material::read(&arguments.material, strict, arguments.memory, console)?;
    let sources = scene::sources(arguments)?;
    ensure!(
        !sources.is_empty(),
        UsageError::new("the scene file has no [[cloud]]: there is nothing to draw")
    );
    let (read, time) = progress.stage("read", |update| read(sources, arguments.memory, console, update));
    times.read = time;
    let (mut parts, reports) = read?;
    let trained = parts.iter().all(|part| part.cloud.trained || part.cloud.is_empty());
    let options = resolve::options(arguments, trained)?;
    note_assumptions(console, &parts, &reports);

    let of_clouds = parts.iter().flat_map(|part| &part.images.hashes);
    let image_hashes = images.hashes.iter().chain(of_clouds).cloned().collect();
    let alone = parts.iter().any(|part| part.source.is_special())
        || Cloud::differ(parts.iter().map(|part| &part.cloud));
    let (assembled, time) = progress.stage("prepare", |update| {
        if alone {
            one_by_one(parts, &images, arguments, &options, console, update)
        } else {
            for part in &mut parts {
                part.cloud.place(&part.source.to_world);
            }
            if parts.len() > 1 {
                arguments.memory.check_copy(parts.iter().map(|part| &part.cloud))?;
            }
            let cloud = Cloud::join(parts.into_iter().map(|part| part.cloud).collect())?;
            together(cloud, images, arguments, &options, console, update)
        }
    });
    times.prepare = time;
    let (mut cloud, materials, color) = assembled?;
    crate::inputs::check_usable(&cloud, &reports)?;
    if arguments.reading.strict {
        strict::check_complete(&mut cloud, &reports)?;
    }
    Ok(Assembled { cloud, reports, image_hashes, materials, color, options })
}

/// Reads all inputs.
fn read(
    sources: Vec<Source>,
    memory: Memory,
    console: Console,
    progress: &mut dyn FnMut(f64),
) -> anyhow::Result<(Vec<Part>, Vec<ImportReport>)> {
    let count = sources.len() as f64;
    let (mut parts, mut reports) = (Vec::new(), Vec::new());
    for (index, source) in sources.into_iter().enumerate() {
        let strict = source.settings.reading.strict;
        let images = material::read(&source.settings.material, strict, memory, console)?;
        let reading = Reading::new(Sampling::default(), false, &source.settings.reading, memory);
        let Import { cloud, report } =
            read_one(&source.path, &reading, &mut |done| progress((index as f64 + done) / count))?;
        parts.push(Part { source, cloud, images });
        reports.push(report);
    }
    Ok((parts, reports))
}

/// What the estimates of a cloud depend on.
fn estimates(arguments: &RenderArguments, options: &RenderOptions, up: Up) -> PrepareOptions {
    let PrepareOptions { kernel, cutoff, areas, .. } = PrepareOptions::for_picture(options);
    PrepareOptions { kernel, cutoff, areas, ..arguments.preparation.options(up) }
}

/// A cloud, what it is made of, and what is shown as its colour.
type Complete = (Cloud, Materials, String);

/// Completes a cloud of which nothing is special.
fn together(
    mut cloud: Cloud,
    images: Images,
    arguments: &RenderArguments,
    options: &RenderOptions,
    console: Console,
    progress: &mut dyn FnMut(f64),
) -> anyhow::Result<Complete> {
    let up = resolve::up(&arguments.camera, &cloud);
    let choice = colors::choose(&cloud, &arguments.splats.colors)?;
    let missing = estimates(arguments, options, up);
    arguments.memory.check_preparation(&cloud, &missing)?;
    let estimated = prepare(&mut cloud, &missing, progress);
    if let Some(text) = preparation::in_words(&estimated, &missing) {
        console.note(text);
    }
    let color = choice.map(|choice| colors::apply(&mut cloud, choice, &arguments.splats.colors, up, console));
    let color = color.transpose()?.unwrap_or_default();
    let material = material::material(&arguments.material, images, &cloud, up)?;
    Ok((cloud, material.into(), color))
}

/// Completes, places and colours each cloud by itself, and joins them.
fn one_by_one(
    parts: Vec<Part>,
    shared: &Images,
    arguments: &RenderArguments,
    options: &RenderOptions,
    console: Console,
    progress: &mut dyn FnMut(f64),
) -> anyhow::Result<Complete> {
    let count = parts.len() as f64;
    let mut clouds = Vec::new();
    let mut runs: Vec<(usize, Material)> = Vec::new();
    let mut color = String::new();
    for (index, Part { source, mut cloud, images }) in parts.into_iter().enumerate() {
        let Source { path, to_world, settings } = source;
        let CloudArguments { colors: own, material, radius_scale, opacity, .. } = &settings;
        let own = if own.color.is_some() { own } else { &arguments.splats.colors };
        let context = || path.display().to_string();
        let choice = colors::choose(&cloud, own).with_context(context)?;
        let up = resolve::up(&arguments.camera, &cloud);
        let mut missing = estimates(arguments, options, up);
        missing.size_scale *= radius_scale;
        arguments.memory.check_preparation(&cloud, &missing)?;
        let estimated = prepare(&mut cloud, &missing, &mut |done| progress((index as f64 + done) / count));
        if let Some(text) = preparation::in_words(&estimated, &missing) {
            console.note(format_args!("{}: {text}", path.display()));
        }
        cloud.place(&to_world);
        let up = resolve::up(&arguments.camera, &cloud);
        if let Some(choice) = choice {
            let words = colors::apply(&mut cloud, choice, own, up, console).with_context(context)?;
            if !words.is_empty() {
                color += &format!(" [{}:{words}]", path.display());
            }
        }
        if *opacity < 1.0 {
            let opacities = cloud.opacities.get_or_insert_with(|| vec![1.0; cloud.positions.len()]);
            opacities.iter_mut().for_each(|value| *value *= *opacity as f32);
        }
        let is_own = material.texture.is_some() || material.environment.is_some();
        let (material, images) =
            if is_own { (material, images) } else { (&arguments.material, shared.clone()) };
        runs.push((cloud.len(), material::material(material, images, &cloud, up).with_context(context)?));
        clouds.push(cloud);
    }
    if clouds.len() > 1 {
        arguments.memory.check_copy(&clouds)?;
    }
    Ok((Cloud::join(clouds)?, Materials::of_runs(runs), color))
}

/// Says what was assumed of files and clouds, if anyone wants to know.
fn note_assumptions(console: Console, parts: &[Part], reports: &[ImportReport]) {
    for (part, report) in parts.iter().zip(reports) {
        for assumption in report.assumptions.iter().cloned().chain(describe::assumptions(&part.cloud)) {
            console.note(format_args!("{}: {assumption}", report.path.display()));
        }
    }
}
