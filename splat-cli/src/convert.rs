//! `splat convert`: meshes and clouds in, a cloud out.

use crate::arguments::ConvertArguments;
use crate::inputs::{self, Reading, Sampling};
use crate::progress::Progress;
use crate::usage::UsageError;
use crate::{console::Console, output};
use splat_io::{PlyEncoding, write_ply};
use std::time::Instant;

/// Runs the command.
///
/// # Errors
/// The first thing that goes wrong.
pub fn run(arguments: &ConvertArguments) -> anyhow::Result<()> {
    let start = Instant::now();
    let console: Console = arguments.talk.console();
    let progress = Progress::new(arguments.talk.progress, console.quiet);
    let path = &arguments.output;
    if path.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("ply")) {
        return Err(UsageError::new(format!("{}: expected a name that ends in .ply", path.display())).into());
    }
    output::check_file(path)?;

    let sampling = Sampling { points: arguments.points, seed: arguments.seed };
    let reading = Reading { sampling, with_faces: true };
    let (input, _) = progress.stage("read", |update| inputs::read(&arguments.inputs, reading, update));
    let (cloud, reports) = input?;
    for report in &reports {
        for assumption in &report.assumptions {
            console.note(format_args!("{}: {assumption}", report.path.display()));
        }
    }
    let encoding = if arguments.ascii { PlyEncoding::Ascii } else { PlyEncoding::Binary };
    let (written, _) = progress.stage("write", |_| write_ply(path, &cloud, encoding));
    written?;
    let seconds = start.elapsed().as_secs_f64();
    console.summary(format_args!("{}: {} points, {seconds:.1} s", path.display(), cloud.len()));
    Ok(())
}
