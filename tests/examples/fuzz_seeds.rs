//! Writes the first inputs of the fuzz targets, `CORPUS/TARGET/FILE`: the good and the bad files that the tests make, and
//! the small files of a folder of real ones, if one is named.
//!
//! `cargo run -p splat-tests --example fuzz_seeds -- fuzz/corpus [FOLDER]`

use splat_tests::damaged::{corpus, seeds};
use splat_tests::random::Random;
use std::path::{Path, PathBuf};
use std::{env, fs, io};

/// Larger files make a fuzzer slow, in bytes.
const MOST_BYTES: u64 = 64 << 10;

/// The targets that read files of an extension.
const TARGETS: [(&str, &[&str]); 15] = [
    ("ply", &["ply"]),
    ("las", &["las"]),
    ("laz", &["las"]),
    ("pcd", &["pcd"]),
    ("xyz", &["text"]),
    ("txt", &["text", "points3d_text", "colmap_text"]),
    ("pts", &["text"]),
    ("csv", &["text"]),
    ("splat", &["splat"]),
    ("spz", &["spz"]),
    ("obj", &["obj"]),
    ("bin", &["points3d_binary"]),
    ("json", &["cameras", "camera_json"]),
    ("log", &["cameras"]),
    ("toml", &["scene"]),
];

/// Images go to one target, whatever they are called.
const IMAGES: [&str; 2] = ["png", "exr"];

fn main() -> io::Result<()> {
    let mut arguments = env::args_os().skip(1).map(PathBuf::from);
    let Some(to) = arguments.next() else {
        return Err(io::Error::other("expected the folder of the targets' inputs"));
    };
    let write = |target: &str, name: &str, bytes: &[u8]| {
        fs::create_dir_all(to.join(target))?;
        fs::write(to.join(target).join(name), bytes)
    };
    for seed in seeds() {
        write(seed.body, seed.name, &seed.bytes)?;
    }
    for file in corpus().iter().filter(|file| file.bytes.len() as u64 <= MOST_BYTES) {
        write(file.body, &file.name, &file.bytes)?;
    }
    let mut random = Random::new(1);
    for target in ["resolve", "footprint", "lookup", "cores"] {
        for number in 0..20 {
            let bytes: Vec<u8> = (0..40 * (number + 1)).map(|_| random.index(256) as u8).collect();
            write(target, &number.to_string(), &bytes)?;
        }
    }
    let mut files = Vec::new();
    for folder in arguments {
        list(&folder, &mut files)?;
    }
    for (number, path) in files.iter().enumerate() {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let named =
            TARGETS.iter().find(|(known, _)| *known == extension).map_or(&[][..], |(_, targets)| *targets);
        let targets = if IMAGES.contains(&extension.as_str()) { &["texture"][..] } else { named };
        for target in targets {
            write(target, &format!("real{number}"), &fs::read(path)?)?;
        }
    }
    Ok(())
}

/// The small files of a folder and of those in it.
fn list(folder: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    let mut entries: Vec<PathBuf> =
        fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<io::Result<_>>()?;
    entries.sort();
    for path in entries {
        let about = fs::metadata(&path)?;
        if about.is_dir() {
            list(&path, files)?;
        } else if about.len() <= MOST_BYTES {
            files.push(path);
        }
    }
    Ok(())
}
