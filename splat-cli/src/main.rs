//! The program `splat`: pictures of surfel clouds.
//!
//! Data go to stdout; progress, summaries, warnings and errors go to stderr. Exit codes: 0 success, 1
//! failure, 2 usage, 130 interrupted, 143 terminated; those of `splat diff` are [its own](diff::run).

#![forbid(unsafe_code)]

mod arguments;
mod assemble;
mod cameras;
mod checkpoint;
mod choices;
mod colors;
mod console;
mod convert;
mod demo;
mod describe;
mod diff;
mod engine;
mod eye_dome;
mod frames;
mod info;
mod inputs;
mod interrupt;
mod map;
mod material;
mod memory;
mod merge;
mod output;
mod prepare;
mod progress;
mod render;
mod resolve;
mod scene;
mod statistics;
mod strict;
mod turntable;
mod usage;
mod values;

use arguments::Command;
use std::process::ExitCode;
use usage::UsageError;

/// The exit code of a failure.
const FAILURE: u8 = 1;

/// The exit code of a command line that cannot be followed; also clap's.
const USAGE: u8 = 2;

fn main() -> ExitCode {
    let error = match run() {
        Ok(code) => return code,
        Err(error) => error,
    };
    if console::is_broken_pipe(&error) {
        return ExitCode::SUCCESS;
    }
    console::error(&error);
    ExitCode::from(if error.is::<UsageError>() { USAGE } else { FAILURE })
}

/// Runs the command of the command line.
fn run() -> anyhow::Result<ExitCode> {
    interrupt::watch()?;
    let (arguments, matches) = scene::parse(std::env::args_os().collect())?;
    match arguments.command {
        Command::Render(arguments) if arguments.print_config => scene::print(&arguments, &matches),
        Command::Render(arguments) => render::run(&arguments),
        Command::Convert(arguments) => convert::run(&arguments),
        Command::Prepare(arguments) => prepare::run(&arguments),
        Command::Info(arguments) => info::run(&arguments),
        Command::Merge(arguments) => merge::run(&arguments),
        Command::Diff(arguments) => return Ok(diff::run(&arguments)),
        Command::Demo(arguments) => demo::run(&arguments),
    }?;
    Ok(ExitCode::SUCCESS)
}
