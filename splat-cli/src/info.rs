//! `splat info`: what is in a file, and every assumption made in reading it.

mod camera;
mod cloud;
mod mesh;

use crate::arguments::InfoArguments;
use crate::{console, inputs};
use splat_io::cameras::is_camera_path;

/// Runs the command.
///
/// # Errors
/// What the reader says; what the operating system says about stdout.
pub fn run(arguments: &InfoArguments) -> anyhow::Result<()> {
    let (json, text) = if is_camera_path(&arguments.file) {
        let summary = camera::Summary::read(&arguments.file)?;
        (serde_json::to_string_pretty(&summary)?, summary.to_string())
    } else if inputs::is_obj(&arguments.file) {
        arguments.memory.check_file(&arguments.file, Some(0))?;
        let summary = mesh::Summary::read(&arguments.file, arguments.strict)?;
        (serde_json::to_string_pretty(&summary)?, summary.to_string())
    } else {
        arguments.memory.check_file(&arguments.file, None)?;
        let summary = cloud::Summary::read(&arguments.file, arguments.columns.as_ref(), arguments.strict)?;
        (serde_json::to_string_pretty(&summary)?, summary.to_string())
    };
    Ok(console::data(&if arguments.json { json + "\n" } else { console::shown(&text) })?)
}
