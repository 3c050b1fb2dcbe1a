//! Runs that are stopped, and go on: to the bytes of one that was not.

use super::common::{PROGRAM, fails, message_of, splat, succeeds};
use super::faults::{Random, sheet};
use splat_io::{PlyEncoding, write_ply};
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

/// Runs the program until `enough`, and kills it. False if it has ended before.
fn killed_when(folder: &Path, command: &str, enough: impl Fn() -> bool) -> bool {
    let mut child = Command::new(PROGRAM)
        .current_dir(folder)
        .args(command.split_whitespace())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let ended = loop {
        if enough() {
            break false;
        }
        if child.try_wait().unwrap().is_some() {
            break true;
        }
        std::thread::sleep(Duration::from_millis(1));
    };
    _ = child.kill();
    child.wait().unwrap();
    !ended
}

/// When a file was written last, and its size.
fn state(path: &Path) -> Option<(std::time::SystemTime, u64)> {
    let metadata = fs::metadata(path).ok()?;
    Some((metadata.modified().ok()?, metadata.len()))
}

/// Runs a command, kills it after so many checkpoints, `times` over, lets it finish, and compares with `expected`. Returns how
/// many runs were killed.
fn interrupted(
    folder: &Path,
    command: &str,
    threads: &[usize],
    checkpoints: usize,
    expected: &[u8],
) -> usize {
    let output = folder.join("out.exr");
    let checkpoint = folder.join("out.exr.checkpoint");
    _ = fs::remove_file(&output);
    let mut killed = 0;
    for threads in threads {
        let line = format!("{command} --threads {threads} --checkpoint 0.000001 --resume --quiet");
        let seen = std::cell::RefCell::new((state(&checkpoint), 0));
        let enough = || {
            let mut seen = seen.borrow_mut();
            let now = state(&checkpoint);
            if now != seen.0 && now.is_some() {
                *seen = (now, seen.1 + 1);
            }
            seen.1 >= checkpoints
        };
        killed += usize::from(killed_when(folder, &line, enough));
    }
    let rest = succeeds(folder, &format!("{command} --threads 1 --resume -v"));
    assert!(killed == 0 || !message_of(&rest).contains("there is none"), "{}", message_of(&rest));
    assert!(fs::read(&output).unwrap() == expected, "splat {command}");
    assert!(!checkpoint.exists(), "it has served");
    killed
}

#[test]
fn a_killed_run_goes_on_to_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    write_ply(&folder.path().join("in.ply"), &sheet(70), PlyEncoding::Binary).unwrap();
    fs::write(folder.path().join("notes.txt"), "mine").unwrap();
    let cases = [
        "--size 480x360 --spp 32 --aov all --exr-type float",
        "--size 480x360 --spp 8 --engine reference --aov depth",
        "--size 480x360 --spp 32 --lens-radius 0.05 --crop 30,50,460,350",
        "--size 480x360 --spp 32 --resolve over --background 0.5,0.5,0.5",
        "--size 480x360 --spp 32 --shading edl --crop 10,20,470,340",
        // Whose films have sums.
        "--size 320x240 --spp 64 --samples 20:60 --aov all --max-memory 1G",
    ];
    let mut killed = 0;
    for options in cases {
        let command = format!("render in.ply -o out.exr --exr-compression none {options}");
        succeeds(folder.path(), &format!("{command} --threads 2 --checkpoint 0"));
        let expected = fs::read(folder.path().join("out.exr")).unwrap();
        // Killed once, and twice in a row, on other threads each time.
        killed += interrupted(folder.path(), &command, &[2], 1, &expected);
        killed += interrupted(folder.path(), &command, &[1, 3], 1, &expected);
    }
    assert!(killed >= 12, "only {killed} runs were killed before their end");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3, "nothing is left behind");
}

#[test]
fn a_run_killed_at_random_goes_on_to_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    write_ply(&folder.path().join("in.ply"), &sheet(70), PlyEncoding::Binary).unwrap();
    let command = "render in.ply -o out.exr --size 320x240 --spp 16 --aov id --threads 1 --quiet";
    let start = std::time::Instant::now();
    succeeds(folder.path(), command);
    let life = start.elapsed();
    let expected = fs::read(folder.path().join("out.exr")).unwrap();
    let mut random = Random(7);
    for _ in 0..6 {
        fs::remove_file(folder.path().join("out.exr")).unwrap();
        for _ in 0..2 {
            let end = std::time::Instant::now() + life.mul_f64(random.next());
            let line = format!("{command} --resume --checkpoint 0.000001");
            killed_when(folder.path(), &line, || std::time::Instant::now() >= end);
        }
        succeeds(folder.path(), &format!("{command} --resume"));
        assert!(fs::read(folder.path().join("out.exr")).unwrap() == expected);
    }
}

#[test]
fn checkpoints_of_other_pictures_are_refused_and_damaged_ones_are_not_used() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    write_ply(&path("in.ply"), &sheet(70), PlyEncoding::Binary).unwrap();
    write_ply(&path("other.ply"), &sheet(71), PlyEncoding::Binary).unwrap();
    let command = "render in.ply -o out.exr --size 480x360 --spp 32 --quiet";
    succeeds(folder.path(), command);
    let expected = fs::read(path("out.exr")).unwrap();
    fs::remove_file(path("out.exr")).unwrap();
    let checkpoint = path("out.exr.checkpoint");
    assert!(killed_when(folder.path(), &format!("{command} --checkpoint 0.000001"), || checkpoint.exists()));
    let bytes = fs::read(&checkpoint).unwrap();
    let size = "-o out.exr --size 480x360 --quiet --resume";
    let others = [
        (format!("render other.ply {size} --spp 32"), "a checkpoint of other inputs"),
        (format!("render in.ply {size} --spp 32 --view front"), "a checkpoint of another camera"),
        (format!("render in.ply {size} --spp 31"), "a checkpoint of other options"),
        (format!("render in.ply {size} --spp 32 --samples 0:16"), "a checkpoint of other options"),
        (format!("render in.ply {size} --spp 32 --seed 1"), "a checkpoint of other options"),
        (format!("render in.ply {size} --spp 32 --aov id"), "a checkpoint of other options"),
        (format!("render in.ply {size} --spp 32 --cull"), "a checkpoint of other options"),
        (format!("render in.ply {size} --spp 32 --engine reference"), "a checkpoint of other options"),
    ];
    for (other, expected) in others {
        let message = fails(folder.path(), &other, 1);
        assert!(message.contains(expected), "{other}: {message}");
        assert!(fs::read(&checkpoint).unwrap() == bytes && !path("out.exr").exists(), "{other}");
    }
    let mut flipped = bytes.clone();
    flipped[2000] ^= 1;
    let damaged = [bytes[..1000].to_vec(), Vec::new(), flipped, [&bytes[..], &[0]].concat()];
    for damaged in damaged {
        fs::write(&checkpoint, damaged).unwrap();
        let output = succeeds(folder.path(), "render in.ply -o out.exr --size 480x360 --spp 32 --resume");
        assert!(message_of(&output).contains("a damaged checkpoint"), "{}", message_of(&output));
        assert!(fs::read(path("out.exr")).unwrap() == expected && !checkpoint.exists());
    }
}

#[test]
fn a_sequence_goes_on_with_what_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    write_ply(&path("in.ply"), &sheet(50), PlyEncoding::Binary).unwrap();
    let command = "render in.ply -o f-##.png --size 160x120 --spp 16 --turntable 8";
    succeeds(folder.path(), command);
    let names: Vec<String> = (1..=8).map(|number| format!("f-{number:02}.png")).collect();
    let frames = || names.iter().map(|name| fs::read(path(name)).ok()).collect::<Vec<_>>();
    let expected = frames();
    names.iter().for_each(|name| fs::remove_file(path(name)).unwrap());
    let line = format!("{command} --resume --checkpoint 0.000001 --quiet");
    assert!(killed_when(folder.path(), &line, || path("f-##.png.checkpoint").exists()
        && path("f-04.png").exists()));
    // The first is sure to be in the list. One of another content is drawn again.
    let list = fs::read(path("f-##.png.checkpoint")).unwrap();
    let first = fs::read(path("f-01.png")).unwrap();
    let resume = |first: &[u8]| {
        fs::write(path("f-##.png.checkpoint"), &list).unwrap();
        fs::write(path("f-01.png"), first).unwrap();
        let said = message_of(&succeeds(folder.path(), &format!("{command} --resume")));
        assert!(frames() == expected && !path("f-##.png.checkpoint").exists());
        said.contains("f-01.png: complete already")
    };
    assert!(resume(&first) && !resume(b"another"));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 9, "nothing is left behind");
    // Without the list all are drawn again.
    assert!(!message_of(&splat(folder.path(), &format!("{command} --resume"))).contains("already"));
}
