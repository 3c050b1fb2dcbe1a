//! The program from outside, one file a subject.

mod cameras;
mod checkpoints;
mod clouds;
mod command_line;
mod common;
mod damaged;
mod determinism;
mod diff;
mod faults;
mod memory;
mod merge;
mod real_files;
mod scenes;
mod strict;
