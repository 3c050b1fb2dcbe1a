//! Disks that are full, folders that are closed, runs that are killed: every file is the old one or the new one.

#![expect(clippy::print_stdout, reason = "what cannot be tested here is said")]

use super::common::{PROGRAM, fails, message_of, succeeds};
use glam::{DVec3, Vec3};
use splat_core::{Cloud, Shapes};
use splat_io::{PlyEncoding, write_ply};
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A wavy sheet of discs.
pub fn sheet(side: u32) -> Cloud {
    let points: Vec<DVec3> = (0..side * side)
        .map(|i| [i % side, i / side].map(|k| f64::from(k) / f64::from(side)))
        .map(|[x, y]| DVec3::new(x, y, 0.1 * (9.0 * x).sin() * (7.0 * y).cos()))
        .collect();
    let mut cloud = Cloud::from_points(&points);
    cloud.normals = vec![Vec3::Z; points.len()];
    cloud.shapes = Shapes::Discs(vec![0.7 / side as f32; points.len()]);
    cloud.colors = Some(points.iter().map(|p| (0.5 + 0.5 * p).as_vec3()).collect());
    cloud
}

/// A source of numbers that are the same in every run.
pub struct Random(pub u64);

impl Random {
    /// The next number, 0 to 1. Steele, Lea, Flood 2014 (SplitMix).
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) as f64 / u64::MAX as f64
    }
}

/// The files of a folder by name, the inputs left out.
fn outputs(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name != "in.ply")
        .map(|name| (name.clone(), fs::read(folder.join(&name)).unwrap()))
        .collect();
    files.sort();
    files
}

const SMALL: &str = "--size 48x36 --spp 4 --threads 1 --quiet";

/// Runs a command many times, kills each run after a random part of its life, and looks at what it left. Returns how often the
/// files were old, and new.
fn kill(command: &str, inputs: &Cloud, count: usize, seed: u64) -> [usize; 2] {
    let (expected, folder) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    for folder in [&expected, &folder] {
        write_ply(&folder.path().join("in.ply"), inputs, PlyEncoding::Binary).unwrap();
    }
    let start = Instant::now();
    succeeds(expected.path(), command);
    let mut life = start.elapsed();
    let expected = outputs(expected.path());
    let mut random = Random(seed);
    let mut found = [0; 2];
    for _ in 0..count {
        expected.iter().for_each(|(name, _)| fs::write(folder.path().join(name), "old").unwrap());
        let mut child = Command::new(PROGRAM)
            .current_dir(folder.path())
            .args(command.split_whitespace())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(life.mul_f64(random.next()));
        // How long a life is depends on what else the machine does: one run in four is to end by itself.
        life = life.mul_f64(if child.try_wait().unwrap().is_some() { 0.94 } else { 1.02 });
        child.kill().unwrap();
        child.wait().unwrap();
        for (name, new) in &expected {
            let bytes = fs::read(folder.path().join(name)).unwrap();
            assert!(bytes == b"old" || bytes == *new, "splat {command}: {name} has {} bytes", bytes.len());
            found[usize::from(bytes == *new)] += 1;
        }
    }
    // What they left behind disturbs nobody, and goes.
    succeeds(folder.path(), command);
    assert!(outputs(folder.path()) == expected, "splat {command}");
    found
}

#[test]
fn killed_at_any_moment_files_are_old_or_new() {
    let bare = Cloud::from_points(&(0..900).map(|i| sheet(30).world_position(i)).collect::<Vec<_>>());
    let jobs = [
        (format!("render in.ply -o out.exr --aov all {SMALL}"), sheet(30)),
        (format!("render in.ply -o out.png --aov depth,id --aov-files {SMALL}"), sheet(30)),
        (format!("render in.ply -o out.png --turntable 3 --checkpoint 0.001 --resume {SMALL}"), sheet(30)),
        ("convert in.ply -o out.laz --quiet".to_owned(), sheet(60)),
        ("prepare in.ply -o out.ply --threads 1 --quiet".to_owned(), bare),
    ];
    const KILLS: usize = 64;
    std::thread::scope(|scope| {
        let run = |(seed, (command, inputs)): (usize, &(String, Cloud))| {
            let (command, inputs) = (command.clone(), inputs.clone());
            scope.spawn(move || (kill(&command, &inputs, KILLS, seed as u64), command))
        };
        let threads: Vec<_> = jobs.iter().enumerate().map(run).collect();
        for thread in threads {
            let ([old, new], command) = thread.join().unwrap();
            // Else the moments were not those of its life.
            assert!(old >= KILLS / 8 && new >= KILLS / 16, "splat {command}: {old} old, {new} new");
        }
    });
}

#[cfg(unix)]
#[test]
fn a_full_disk_leaves_the_old_file() {
    let folder = tempfile::tempdir().unwrap();
    write_ply(&folder.path().join("in.ply"), &sheet(60), PlyEncoding::Binary).unwrap();
    let commands = [
        "render ../in.ply -o out.exr --size 160x120 --spp 1 --exr-compression none",
        "render ../in.ply -o out.png --size 300x200 --spp 1 --png-depth 16",
        "convert ../in.ply -o out.ply",
        "convert ../in.ply -o out.las",
        "convert ../in.ply -o out.xyz",
        "prepare ../in.ply -o out.ply",
    ];
    // A file system of 40 kB in a name space of our own; else a limit of as much a file, with the signal for it ignored.
    let mount = "mount -t tmpfs -o size=40k none full && cd full";
    fs::create_dir(folder.path().join("full")).unwrap();
    let can_mount =
        Command::new("unshare").current_dir(folder.path()).args(["-rm", "sh", "-c", mount]).output();
    let can_mount = can_mount.is_ok_and(|output| output.status.success());
    if !can_mount {
        println!("no file system can be mounted here: only the limit of a file's size is tested");
    }
    for command in commands {
        let name = command.split_whitespace().skip_while(|word| *word != "-o").nth(1).unwrap();
        let script =
            format!("echo old > {name}; {PROGRAM} {command} --quiet; code=$?; ls -A; cat {name}; exit $code");
        let ways = [
            can_mount.then(|| {
                (
                    "unshare",
                    vec![
                        "-rm".to_owned(),
                        "sh".to_owned(),
                        "-c".to_owned(),
                        format!("{mount} && {{ {script}; }}"),
                    ],
                )
            }),
            Some(("bash", vec!["-c".to_owned(), format!("trap '' XFSZ; cd full; ulimit -f 20; {script}")])),
        ];
        for (shell, arguments) in ways.into_iter().flatten() {
            _ = fs::remove_dir_all(folder.path().join("full"));
            fs::create_dir(folder.path().join("full")).unwrap();
            let output = Command::new(shell).current_dir(folder.path()).args(arguments).output().unwrap();
            let message = message_of(&output);
            assert_eq!(output.status.code(), Some(1), "{shell}: {command}: {message}");
            assert!(message.contains(&format!("{name}: cannot write")), "{shell}: {command}: {message}");
            let found = String::from_utf8_lossy(&output.stdout).into_owned();
            assert_eq!(found, format!("{name}\nold\n"), "{shell}: {command}");
        }
    }
}

#[cfg(unix)]
#[test]
fn a_closed_folder_is_refused_before_the_work() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    write_ply(&folder.path().join("in.ply"), &sheet(9), PlyEncoding::Binary).unwrap();
    let closed = folder.path().join("closed");
    fs::create_dir(&closed).unwrap();
    fs::write(closed.join("out.png"), "old").unwrap();
    fs::set_permissions(&closed, fs::Permissions::from_mode(0o555)).unwrap();
    if fs::write(closed.join("probe"), "").is_ok() {
        // The administrator may write anywhere; a folder that is none refuses him, too.
        println!("this user may write to closed folders");
        assert!(fails(folder.path(), "render in.ply -o in.ply/out.png", 1).contains("no folder"));
    } else {
        let start = Instant::now();
        let message = fails(folder.path(), "render in.ply -o closed/out.png --size 4000x4000 --spp 256", 1);
        assert!(message.contains("closed/out.png: cannot create"), "{message}");
        assert!(start.elapsed() < Duration::from_secs(2), "it is known before the work");
    }
    fs::set_permissions(&closed, fs::Permissions::from_mode(0o755)).unwrap();
    assert_eq!(fs::read(closed.join("out.png")).unwrap(), b"old");
}
