//! What the user reads: data on stdout, everything else on stderr.

use std::fmt::Display;
use std::io::{self, ErrorKind, Write};

/// How talkative the program is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Console {
    /// Errors only.
    pub quiet: bool,
    /// Assumptions and details, too.
    pub verbose: bool,
}

impl Console {
    /// What was done: unless quiet.
    pub fn summary(self, message: impl Display) {
        if !self.quiet {
            to_stderr(format_args!("{message}"));
        }
    }

    /// What the user may not have wanted: unless quiet.
    pub fn warn(self, message: impl Display) {
        if !self.quiet {
            to_stderr(format_args!("warning: {message}"));
        }
    }

    /// What was assumed, and details: if verbose.
    pub fn note(self, message: impl Display) {
        if self.verbose {
            to_stderr(format_args!("note: {message}"));
        }
    }
}

/// Writes data to stdout.
///
/// # Errors
/// What the operating system says; see [`is_broken_pipe`].
pub fn data(text: &str) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    stdout.write_all(text.as_bytes())?;
    stdout.flush()
}

/// The error that ends the program.
pub fn error(error: &anyhow::Error) {
    to_stderr(format_args!("error: {error:#}"));
}

/// A line to stderr. If even that fails, nobody is there to be told.
pub fn to_stderr(line: impl Display) {
    _ = writeln!(io::stderr().lock(), "{}", shown(&line.to_string()));
}

/// A text for a terminal, which may hold names from a file: without control characters but ends of lines and tabs.
pub fn shown(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '\n' | '\t' => shown.push(character),
            _ if character.is_control() => shown.extend(character.escape_default()),
            _ => shown.push(character),
        }
    }
    shown
}

/// Whether the reader of stdout has gone (`splat info x.ply | head`), which is no failure of ours.
pub fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == ErrorKind::BrokenPipe)
}
