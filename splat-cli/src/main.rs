//! The program `splat`: pictures of surfel clouds.
//!
//! Data go to stdout; progress, summaries, warnings and errors go to stderr. Exit codes: 0 success, 1
//! failure, 2 usage, 130 interrupted.

#![forbid(unsafe_code)]

mod arguments;
mod choices;
mod console;
mod convert;
mod demo;
mod describe;
mod engine;
mod eye_dome;
mod info;
mod inputs;
mod material;
mod output;
mod prepare;
mod progress;
mod render;
mod resolve;
mod statistics;
mod usage;
mod values;

use arguments::{Arguments, Command};
use clap::Parser;
use std::process::ExitCode;
use usage::UsageError;

/// The exit code of a failure.
const FAILURE: u8 = 1;

/// The exit code of a command line that cannot be followed; also clap's.
const USAGE: u8 = 2;

fn main() -> ExitCode {
    let outcome = match Arguments::parse().command {
        Command::Render(arguments) => render::run(&arguments),
        Command::Convert(arguments) => convert::run(&arguments),
        Command::Prepare(arguments) => prepare::run(&arguments),
        Command::Info(arguments) => info::run(&arguments),
        Command::Demo(arguments) => demo::run(&arguments),
    };
    let Err(error) = outcome else { return ExitCode::SUCCESS };
    if console::is_broken_pipe(&error) {
        return ExitCode::SUCCESS;
    }
    console::error(&error);
    ExitCode::from(if error.is::<UsageError>() { USAGE } else { FAILURE })
}
