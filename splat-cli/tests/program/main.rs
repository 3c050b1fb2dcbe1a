//! The program from outside, one file a subject.

mod cameras;
mod clouds;
mod command_line;
mod common;
mod real_files;
mod scenes;
