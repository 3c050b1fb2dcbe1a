//! The program from outside, one file a subject.

mod cameras;
mod checkpoints;
mod clouds;
mod command_line;
mod common;
mod faults;
mod memory;
mod real_files;
mod scenes;
