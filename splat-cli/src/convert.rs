//! `splat convert`: meshes and clouds in, a cloud out.

use crate::arguments::ConvertArguments;
use crate::inputs::{self, Reading, Sampling};
use crate::progress::Progress;
use crate::usage::UsageError;
use crate::{console::Console, output};
use splat_core::Kernel;
use splat_core::prepare::{PrepareOptions, prepare};
use splat_io::{CloudTarget, PlyEncoding, write_cloud};
use std::time::Instant;

/// What a `.splat` file needs of a cloud: normals and sizes.
fn for_splats() -> PrepareOptions {
    PrepareOptions { kernel: Kernel::Gaussian, cutoff: 9.0, areas: false, ..PrepareOptions::default() }
}

/// Runs the command.
///
/// # Errors
/// The first thing that goes wrong.
pub fn run(arguments: &ConvertArguments) -> anyhow::Result<()> {
    let start = Instant::now();
    let console: Console = arguments.talk.console();
    let progress = Progress::new(arguments.talk.progress, console.quiet);
    let path = &arguments.output;
    let Some(target) = CloudTarget::of(path) else {
        let known = CloudTarget::EXTENSIONS.map(|(extension, _)| format!(".{extension}")).join(", ");
        let message = format!("{}: expected a name that ends in one of {known}", path.display());
        return Err(UsageError::new(message).into());
    };
    output::spare_inputs(path, &arguments.inputs)?;
    output::check_file(path)?;

    let sampling = Sampling { points: arguments.points, seed: arguments.seed };
    let reading = Reading::new(sampling, true, &arguments.reading, arguments.memory);
    let (input, _) = progress.stage("read", |update| inputs::read(&arguments.inputs, &reading, update));
    let (mut cloud, reports) = input?;
    for report in &reports {
        for assumption in &report.assumptions {
            console.note(format_args!("{}: {assumption}", report.path.display()));
        }
    }
    if target == CloudTarget::Splat {
        arguments.memory.check_preparation(&cloud, &for_splats())?;
        progress.stage("prepare", |update| prepare(&mut cloud, &for_splats(), update));
    }
    let encoding = if arguments.ascii { PlyEncoding::Ascii } else { PlyEncoding::Binary };
    let (written, _) = progress.stage("write", |_| write_cloud(path, &cloud, target, encoding));
    for note in written? {
        console.warn(format_args!("{}: {note}", path.display()));
    }
    let seconds = start.elapsed().as_secs_f64();
    console.summary(format_args!("{}: {} points, {seconds:.1} s", path.display(), cloud.len()));
    Ok(())
}
