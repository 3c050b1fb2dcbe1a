//! The statistics file: what a picture took, as JSON.

use crate::engine::Engine;
use crate::{console, memory};
use serde::Serialize;
use splat_core::Statistics;
use splat_io::AtomicFile;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;
use std::time::Duration;

/// What a picture took.
#[derive(Debug, Serialize)]
pub struct Report {
    /// Counts of splats.
    pub splats: Splats,
    /// Samples tested against a splat.
    pub tests: u64,
    /// Fragments resolved.
    pub fragments: u64,
    /// Samples resolved.
    pub samples: u64,
    /// Threads used.
    pub threads: usize,
    /// Instruction set used.
    pub isa: &'static str,
    /// Times.
    pub seconds: Seconds,
    /// Most memory ever held, where the system tells.
    pub peak_bytes: Option<u64>,
}

/// Counts of splats.
#[derive(Debug, Serialize)]
pub struct Splats {
    /// Rows of the input.
    pub read: usize,
    /// Never rendered, by cause.
    pub dropped: BTreeMap<&'static str, usize>,
    /// Rasterised.
    pub drawn: usize,
}

/// Times, in seconds; raster and resolve are CPU seconds, summed over the threads.
#[derive(Debug, Default, Serialize)]
pub struct Seconds {
    /// Reading files.
    pub read: f64,
    /// Estimating what the cloud lacks.
    pub prepare: f64,
    /// Set-up of the splats.
    pub setup: f64,
    /// Sorting splats into tiles.
    pub bin: f64,
    /// Making fragments.
    pub raster: f64,
    /// Resolving them.
    pub resolve: f64,
    /// Writing the picture.
    pub write: f64,
    /// All, from the start of the command.
    pub total: f64,
}

/// Times of what the renderer does not measure itself.
#[derive(Debug, Clone, Copy, Default)]
pub struct Times {
    /// Reading files.
    pub read: Duration,
    /// Estimating what the cloud lacks.
    pub prepare: Duration,
    /// Writing the picture.
    pub write: Duration,
    /// All, from the start of the command.
    pub total: Duration,
}

impl Report {
    /// The report of a picture by this engine, from a cloud of `read` splats.
    pub fn new(read: usize, statistics: &Statistics, times: Times, engine: &Engine) -> Self {
        Self {
            splats: Splats { read, dropped: statistics.dropped.clone(), drawn: statistics.drawn },
            tests: statistics.tests,
            fragments: statistics.fragments,
            samples: statistics.samples,
            threads: engine.threads(),
            isa: engine.isa(),
            seconds: Seconds {
                read: times.read.as_secs_f64(),
                prepare: times.prepare.as_secs_f64(),
                setup: statistics.setup.as_secs_f64(),
                bin: statistics.bin.as_secs_f64(),
                raster: statistics.raster.as_secs_f64(),
                resolve: statistics.resolve.as_secs_f64(),
                write: times.write.as_secs_f64(),
                total: times.total.as_secs_f64(),
            },
            peak_bytes: memory::peak_bytes(),
        }
    }
}

/// Writes the report of a picture, or the list of those of several, to a file, or to stdout if the path is `-`.
///
/// # Errors
/// What the operating system says.
pub fn write(reports: &[Report], path: &Path) -> anyhow::Result<()> {
    let text = match reports {
        [report] => serde_json::to_string_pretty(report)?,
        _ => serde_json::to_string_pretty(reports)?,
    } + "\n";
    if is_stdout(path) {
        return Ok(console::data(&text)?);
    }
    let mut file = AtomicFile::create(path)?;
    file.write_all(text.as_bytes())?;
    file.commit()?;
    Ok(())
}

/// Whether a path stands for stdout.
pub fn is_stdout(path: &Path) -> bool {
    path == Path::new("-")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_names_are_those_of_the_specification() {
        let statistics = Statistics { dropped: [("edge_on", 2)].into(), drawn: 7, ..Statistics::default() };
        let engine = Engine::new(
            crate::choices::EngineChoice::Reference,
            None,
            console::Console { quiet: true, verbose: false },
        )
        .unwrap();
        let json = serde_json::to_value(Report::new(9, &statistics, Times::default(), &engine)).unwrap();
        let keys = |value: &serde_json::Value| value.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
        let expected = ["fragments", "isa", "peak_bytes", "samples", "seconds", "splats", "tests", "threads"];
        assert_eq!(keys(&json), expected);
        let expected = ["bin", "prepare", "raster", "read", "resolve", "setup", "total", "write"];
        assert_eq!(keys(&json["seconds"]), expected);
        assert_eq!(json["splats"], serde_json::json!({ "read": 9, "dropped": { "edge_on": 2 }, "drawn": 7 }));
        assert_eq!(json["isa"], "scalar");
    }
}
