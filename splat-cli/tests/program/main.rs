//! The program from outside, one file a subject.

mod cameras;
mod clouds;
mod command_line;
mod common;
mod damaged;
mod determinism;
mod diff;
mod merge;
mod real_files;
mod scenes;
mod strict;
