//! Every fuzz target: the body of `splat_tests::fuzz_bodies` that has the program's name.

#![no_main]

use libfuzzer_sys::fuzz_target;
use splat_tests::fuzz_bodies::{self, Body};
use std::path::PathBuf;
use std::sync::LazyLock;

static BODY: LazyLock<Body> = LazyLock::new(|| {
    // Two readers catch a panic of a decoder that is not ours. What nobody catches ends the target all the same.
    std::panic::set_hook(Box::new(|panic| eprintln!("{panic}")));
    let program = std::env::args_os().next().map(PathBuf::from).unwrap_or_default();
    let name = program.file_name().unwrap_or_default().to_string_lossy().into_owned();
    fuzz_bodies::find(&name).expect("targets have the names of bodies")
});

fuzz_target!(|bytes: &[u8]| (BODY.run)(bytes));
