//! Bad files from outside: the program says what is wrong and ends with 1, or draws what is left and ends with 0. It never
//! ends by a signal, with a panic's 101, after more than 10 seconds, or with more than 1 GB.

use super::common::PROGRAM;
use splat_io::{PlyEncoding, write_ply};
use splat_tests::damaged::{DamagedFile, corpus, model_of_binary, model_of_text, surfels};
use std::fs::{self, File};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// One of so many files is tried: the readers have read all of them in `tests/tests/damaged_files.rs`.
const STEP: usize = 4;

/// The most time of the processor, in seconds: the shell's limit.
const MOST_SECONDS: u64 = 10;

/// What sleeps so long hangs, however busy the machine is.
const MOST_TIME: Duration = Duration::from_secs(100);

/// The most memory, in kilobytes: the shell's limit on what a process may write to.
const MOST_KILOBYTES: u64 = 1 << 20;

/// Runs the program within the limits. `None`: it had to be ended.
fn limited(folder: &Path, arguments: &[&str]) -> Option<Output> {
    let script = format!("ulimit -d {MOST_KILOBYTES}; ulimit -t {MOST_SECONDS}; exec \"$0\" \"$@\"");
    let mut child = Command::new("sh")
        .args(["-c", &script, PROGRAM])
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let start = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if start.elapsed() > MOST_TIME {
            child.kill().unwrap();
            child.wait().unwrap();
            return None;
        }
        sleep(Duration::from_millis(2));
    }
    Some(child.wait_with_output().unwrap())
}

/// What is done with a file: the arguments of the program.
fn arguments<'a>(file: &DamagedFile, name: &'a str, is_even: bool) -> Vec<&'a str> {
    const PICTURE: [&str; 9] = ["-o", "out.png", "--size", "8x6", "--spp", "1", "--quiet", "--threads", "1"];
    match file.body {
        "colmap_text" | "colmap_binary" => vec!["info", "model"],
        "texture" => {
            [&["render", "good.ply", "--texture", name, "--mapping", "planar"], &PICTURE[..]].concat()
        }
        "scene" => vec!["render", name, "-o", "out.png", "--quiet", "--threads", "1"],
        "obj" if is_even => vec!["convert", name, "-o", "out.ply", "--points", "100", "--quiet"],
        "camera_json" if is_even => {
            vec!["render", "good.ply", "--camera", name, "-o", "out.png", "--crop", "0,0,4,4", "--quiet"]
        }
        "cameras" | "camera_json" => vec!["info", name],
        _ if is_even => [&["render", name], &PICTURE[..]].concat(),
        _ => vec!["info", "--json", name],
    }
}

/// Puts a file where the program looks for it, by the name that its format has.
fn put(folder: &Path, file: &DamagedFile) -> String {
    let model = match file.body {
        "colmap_text" => Some(model_of_text(&file.bytes)),
        "colmap_binary" => Some(model_of_binary(&file.bytes)),
        _ => None,
    };
    for (part, bytes) in model.into_iter().flatten() {
        fs::create_dir_all(folder.join("model")).unwrap();
        fs::write(folder.join("model").join(part), bytes).unwrap();
    }
    let name = match file.body {
        "points3d_text" => "points3D.txt".to_owned(),
        "points3d_binary" => "points3D.bin".to_owned(),
        _ => format!("{}.{}", file.name, file.extension),
    };
    fs::write(folder.join(&name), &file.bytes).unwrap();
    name
}

#[test]
#[cfg_attr(not(target_os = "linux"), ignore = "ulimit -d limits memory on Linux only")]
fn bad_files_end_the_program_in_good_order() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_ply(&folder.join("good.ply"), &surfels(), PlyEncoding::Binary).unwrap();
    let (mut wrong, mut count, mut failures) = (Vec::new(), 0, 0);
    for (number, file) in corpus().iter().step_by(STEP).enumerate() {
        let name = put(folder, file);
        let arguments = arguments(file, &name, number % 2 == 0);
        count += 1;
        let Some(output) = limited(folder, &arguments) else {
            wrong.push(format!("{}: more than {MOST_TIME:?}", file.name));
            continue;
        };
        let message = String::from_utf8_lossy(&output.stderr);
        let code = output.status.code();
        failures += usize::from(code == Some(1));
        let is_clean = match code {
            Some(0) => true,
            Some(1) => message.starts_with("error: "),
            _ => false,
        };
        if !is_clean || message.contains("panicked") || message.len() > 2000 {
            wrong.push(format!("{}: {}: {message:.500}", file.name, output.status));
        }
        fs::remove_file(folder.join(&name)).unwrap();
    }
    assert!(wrong.is_empty(), "{} of {count}: {wrong:#?}", wrong.len());
    assert!(count >= 400 && failures > count / 2, "{count} files, {failures} failures");
}

/// A file of a terabyte of nothing, as disks have them that write no zeros.
#[test]
#[cfg_attr(not(target_os = "linux"), ignore = "ulimit -d limits memory on Linux only")]
fn a_terabyte_of_nothing_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_ply(&folder.join("good.ply"), &surfels(), PlyEncoding::Binary).unwrap();
    let names = "a.ply a.las a.laz a.pcd a.xyz a.csv a.spz a.splat a.obj points3D.bin points3D.txt a.json a.log a.toml a.png a.exr";
    for name in names.split(' ') {
        File::create(folder.join(name)).and_then(|file| file.set_len(1 << 40)).unwrap();
        let arguments = match name.rsplit('.').next() {
            Some("png" | "exr") => {
                vec!["render", "good.ply", "-o", "out.png", "--mapping", "planar", "--texture", name]
            }
            Some("toml") => vec!["render", name, "-o", "out.png"],
            _ => vec!["info", name],
        };
        let output = limited(folder, &arguments).unwrap_or_else(|| panic!("{name}: more than {MOST_TIME:?}"));
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(1) && message.starts_with("error: "), "{name}: {message}");
    }
}

/// To open a pipe is to wait for a writer, who may never come.
#[test]
#[cfg(unix)]
fn a_pipe_is_not_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for name in ["a.ply", "a.xyz", "a.spz", "a.obj", "a.json", "a.toml", "points3D.bin"] {
        assert!(Command::new("mkfifo").arg(folder.join(name)).status().unwrap().success());
        let command = if name.ends_with(".toml") { "render" } else { "info" };
        let output = limited(folder, &[command, name]).unwrap_or_else(|| panic!("{name} hangs"));
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(message.contains("pipe is not supported"), "{name}: {message}");
    }
}

/// A picture that needs more is not made: so the limit holds.
#[test]
#[cfg_attr(not(target_os = "linux"), ignore = "ulimit -d limits memory on Linux only")]
fn the_limit_of_memory_is_one() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_ply(&folder.join("good.ply"), &surfels(), PlyEncoding::Binary).unwrap();
    let code = |size: &str| {
        let arguments = ["render", "good.ply", "-o", "x.png", "--spp", "1", "--quiet", "--size", size];
        limited(folder, &arguments).and_then(|output| output.status.code())
    };
    assert_eq!(code("640x480"), Some(0));
    assert_ne!(code("60000x60000"), Some(0));
}
