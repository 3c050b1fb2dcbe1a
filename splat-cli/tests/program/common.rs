//! Runs of the program, and the pictures that it leaves.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

pub const PROGRAM: &str = env!("CARGO_BIN_EXE_splat");

/// Runs the program in `folder`, with arguments that blanks separate.
pub fn splat(folder: &Path, arguments: &str) -> Output {
    Command::new(PROGRAM).current_dir(folder).args(arguments.split_whitespace()).output().unwrap()
}

/// Runs the program, which must succeed.
pub fn succeeds(folder: &Path, arguments: &str) -> Output {
    let output = splat(folder, arguments);
    assert!(output.status.success(), "splat {arguments}: {}", message_of(&output));
    output
}

/// Runs the program, which must fail with this code. Returns its message.
pub fn fails(folder: &Path, arguments: &str, code: i32) -> String {
    let output = splat(folder, arguments);
    assert_eq!(output.status.code(), Some(code), "splat {arguments}: {}", message_of(&output));
    message_of(&output)
}

/// What a run said to its user.
pub fn message_of(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The folder of real files, if there is one.
pub fn real_files() -> Option<PathBuf> {
    std::env::var_os("SPLAT_TEST_DATA").map(PathBuf::from).filter(|folder| folder.is_dir())
}

/// A decoded PNG file.
#[derive(Debug, PartialEq)]
pub struct Png {
    /// Pixels a metre along x and y, or without a unit.
    pub density: Option<(u32, u32)>,
    pub size: [u32; 2],
    /// RGBA; without alpha in the file all opaque.
    pub pixels: Vec<[u8; 4]>,
}

pub fn read_png(path: &Path) -> Png {
    let mut decoder = png::Decoder::new(BufReader::new(File::open(path).unwrap()));
    decoder.set_transformations(png::Transformations::ALPHA);
    let mut reader = decoder.read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    let pixels = bytes[..info.buffer_size()].as_chunks().0.to_vec();
    let density = reader.info().pixel_dims.map(|dims| (dims.xppu, dims.yppu));
    Png { density, size: [info.width, info.height], pixels }
}
