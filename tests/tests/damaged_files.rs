//! Bad files of every format: no panic, no signal, no hang, and each below 10 seconds and 1 GB.
//!
//! Files are read by a child: this very program, told to run [`child`] on the files of a folder. So even a stack that
//! overflows ends only the child, and the system can say how much memory each file took.

use splat_tests::cases;
use splat_tests::damaged::{DamagedFile, corpus};
use splat_tests::fuzz_bodies::{self, Body};
use splat_tests::random::Random;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// The files are in the folder that this variable names.
const FOLDER: &str = "SPLAT_DAMAGED_FILES";

/// What a file may take of the processor's time, in hundredths of a second, and of memory.
const MOST_TICKS: u64 = 1000;
const MOST_BYTES: u64 = 1 << 30;

/// What sleeps so long hangs, however busy the machine is.
const MOST_TIME: Duration = Duration::from_secs(100);

/// What the child has done, a line a file: its name, hundredths of a second, and kilobytes at most.
const LOG: &str = "log";

/// The line of a status: kilobytes.
fn status(name: &str) -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix(name)).unwrap_or_default();
    line.trim().trim_end_matches(" kB").parse().unwrap_or_default()
}

/// What the name of a file begins with that is no file, but an order to do harm.
const HARM: &str = "harm-";

/// The processor's time that this process has had, in hundredths of a second.
fn ticks() -> u64 {
    let status = fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // Behind the program's name, the twelfth and thirteenth number.
    let numbers = status.rsplit(')').next().unwrap_or_default().split_whitespace().skip(11).take(2);
    numbers.filter_map(|number| number.parse::<u64>().ok()).sum()
}

/// Bodies that do what no body may do, so that it is known to be noticed.
fn misbehave(name: &str) -> bool {
    match name.strip_prefix(HARM).unwrap_or_default() {
        "panics" => panic!("as it was told to"),
        "overflows" => {
            fn deeper(depth: u64) -> u64 {
                if std::hint::black_box(depth) == u64::MAX { 0 } else { 1 + deeper(depth + 1) }
            }
            std::hint::black_box(deeper(0));
        }
        "allocates" => drop(std::hint::black_box(vec![1_u8; (MOST_BYTES + (64 << 20)) as usize])),
        "hangs" => sleep(Duration::from_secs(3600)),
        _ => return false,
    }
    true
}

/// Not a test of its own: reads the files of a folder, if it is told of one.
#[test]
fn child() {
    let Some(folder) = std::env::var_os(FOLDER) else { return };
    let folder = Path::new(&folder);
    let mut names: Vec<String> = Vec::new();
    for entry in fs::read_dir(folder).expect("the folder of files") {
        names.push(entry.expect("an entry").file_name().into_string().expect("our own names"));
    }
    names.sort();
    let mut log = String::new();
    for name in names.iter().filter(|name| *name != LOG) {
        log += name;
        fs::write(folder.join(LOG), &log).expect("the log");
        // From here on, the greatest memory is that of this file.
        fs::write("/proc/self/clear_refs", "5").expect("the greatest memory, forgotten");
        let (before, start) = (status("VmRSS:"), ticks());
        if !misbehave(name) {
            let bytes = fs::read(folder.join(name)).expect("a file");
            let body =
                name.split('@').next().and_then(fuzz_bodies::find).expect("the name begins with a body's");
            (body.run)(&bytes);
        }
        let kilobytes = status("VmHWM:").saturating_sub(before);
        log += &format!(" {} {kilobytes}\n", ticks() - start);
    }
    fs::write(folder.join(LOG), &log).expect("the log");
}

/// What a child found: the line of each file, and the file that ended it.
struct Report {
    lines: Vec<(String, u64, u64)>,
    ended_by: Option<String>,
}

/// Has a child read the files of a folder.
fn report(folder: &Path, most_time: Duration) -> Report {
    let mut child = Command::new(std::env::current_exe().expect("this program"))
        .args(["--exact", "child", "--test-threads=1"])
        .env(FOLDER, folder)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("a child");
    let log = || fs::read_to_string(folder.join(LOG)).unwrap_or_default();
    let is_good = wait(&mut child, &log, most_time);
    let log = log();
    let line = |line: &str| -> Option<(String, u64, u64)> {
        let mut words = line.split(' ');
        Some((words.next()?.to_owned(), words.next()?.parse().ok()?, words.next()?.parse().ok()?))
    };
    let last = log.lines().last().unwrap_or("the start").to_owned();
    Report { lines: log.lines().filter_map(line).collect(), ended_by: (!is_good).then_some(last) }
}

/// Waits for a child; `false` if it did not end well, or had to be ended since its log stood still.
fn wait(child: &mut Child, log: &dyn Fn() -> String, most_time: Duration) -> bool {
    let (mut seen, mut since) = (0, Instant::now());
    loop {
        if let Some(status) = child.try_wait().expect("a child") {
            return status.success();
        }
        let length = log().len();
        if length != seen {
            (seen, since) = (length, Instant::now());
        } else if since.elapsed() > most_time {
            child.kill().expect("a child that runs");
            child.wait().expect("a child");
            return false;
        }
        sleep(Duration::from_millis(20));
    }
}

/// Names of files in a folder say by what body they are read.
fn put(folder: &Path, file: &DamagedFile) {
    let name = format!("{}@{}.{}", file.body, file.name, file.extension);
    fs::write(folder.join(name), &file.bytes).expect("a file");
}

#[test]
fn bad_files_are_many_and_all_different() {
    let corpus = corpus();
    assert!(corpus.len() >= 400, "{}", corpus.len());
    let names: BTreeSet<&str> = corpus.iter().map(|file| file.name.as_str()).collect();
    assert_eq!(names.len(), corpus.len(), "two files of one name");
    for Body { name, .. } in fuzz_bodies::READERS {
        let count = corpus.iter().filter(|file| file.body == name).count();
        assert!(count >= 10, "{count} files for {name}");
    }
}

#[test]
#[cfg_attr(not(target_os = "linux"), ignore = "the memory of a file is known on Linux only")]
#[expect(clippy::print_stdout, reason = "what was measured, with --nocapture")]
fn bad_files_do_no_harm() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let corpus = corpus();
    for file in &corpus {
        put(folder.path(), file);
    }
    // Files that end the child are taken out, to see whether there are more.
    let mut harmful = Vec::new();
    let lines = loop {
        let Report { lines, ended_by } = report(folder.path(), MOST_TIME);
        let Some(name) = ended_by.filter(|_| harmful.len() < 20) else { break lines };
        fs::remove_file(folder.path().join(&name)).expect("a file");
        harmful.push(name);
    };
    assert!(harmful.is_empty(), "files that end their reader, or hang it: {harmful:#?}");
    assert_eq!(lines.len(), corpus.len());
    for (name, ticks, kilobytes) in &lines {
        assert!(*ticks < MOST_TICKS, "{name}: {ticks} hundredths of a second");
        assert!(kilobytes * 1024 < MOST_BYTES, "{name}: {kilobytes} kB");
    }
    let slowest = lines.iter().max_by_key(|(_, time, _)| time).expect("a file");
    let largest = lines.iter().max_by_key(|(_, _, memory)| memory).expect("a file");
    println!("{} files; slowest {slowest:?}, largest {largest:?} (name, s/100, kB)", lines.len());
}

/// A file of each kind of harm among good ones.
#[test]
#[cfg_attr(not(target_os = "linux"), ignore = "the memory of a file is known on Linux only")]
fn harm_is_noticed() {
    for harm in ["panics", "overflows", "hangs", "allocates"] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let harm = format!("{HARM}{harm}");
        for name in ["camera_json@good.json", &harm] {
            fs::write(folder.path().join(name), "{}").expect("a file");
        }
        let Report { lines, ended_by } =
            report(folder.path(), if harm == "harm-hangs" { Duration::from_secs(2) } else { MOST_TIME });
        assert_eq!(lines[0].0, "camera_json@good.json", "{harm}");
        if harm.ends_with("allocates") {
            assert!(ended_by.is_none() && lines[1].2 * 1024 >= MOST_BYTES, "{lines:?}");
            continue;
        }
        assert_eq!(ended_by.as_ref(), Some(&harm), "{lines:?}");
    }
}

/// Random bytes as scenes, fragments and footprints: what the fuzz targets do, for a moment; `SPLAT_CASES=N` tries N times
/// as many.
#[test]
fn random_bytes_make_sound_kernels() {
    for (Body { name, run }, cases) in fuzz_bodies::KERNELS.into_iter().zip([2000, 4000, 300, 150]) {
        let mut random = Random::new(7);
        for case in 0..cases * cases::factor() {
            let bytes: Vec<u8> = (0..16 + random.index(400)).map(|_| random.index(256) as u8).collect();
            let outcome = std::panic::catch_unwind(|| run(&bytes));
            assert!(outcome.is_ok(), "{name}, case {case}: {bytes:?}");
        }
    }
}
