//! Faults of the disk, made on purpose: what every writer leaves behind when one strikes.

use super::AtomicFile;
use crate::{
    Compression, Error, ExrOptions, Metadata, NamedCamera, PictureOptions, PlyEncoding, PngDepth,
    write_cameras_json, write_exr, write_las, write_picture, write_ply, write_png, write_splat, write_text,
};
use glam::{DMat4, DVec2, DVec3, Vec3};
use splat_core::{AovSelection, Camera, Cloud, Film, PixelRect, Projection, Shapes};
use std::cell::Cell;
use std::fs;
use std::io;
use std::path::Path;

/// What goes wrong, for the files that this thread writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fault {
    None,
    /// So many bytes can be written; the next write takes what fits, the one after fails.
    FullAfter(usize),
    /// A write takes at most so many bytes, and every other one is interrupted before it begins.
    Short {
        most: usize,
        interrupt: bool,
    },
    /// The bytes are not made durable.
    Sync,
    /// The temporary cannot take the target's place.
    Rename,
}

thread_local! {
    static FAULT: Cell<Fault> = const { Cell::new(Fault::None) };
}

fn disk_full() -> io::Error {
    io::Error::from(io::ErrorKind::StorageFull)
}

/// The part of a buffer that may be written.
pub(super) fn on_write(buffer: &[u8]) -> io::Result<&[u8]> {
    match FAULT.get() {
        Fault::FullAfter(0) if !buffer.is_empty() => Err(disk_full()),
        Fault::FullAfter(left) => {
            let part = &buffer[..buffer.len().min(left)];
            FAULT.set(Fault::FullAfter(left - part.len()));
            Ok(part)
        }
        Fault::Short { most, interrupt } => {
            FAULT.set(Fault::Short { most, interrupt: !interrupt });
            if interrupt {
                return Err(io::ErrorKind::Interrupted.into());
            }
            Ok(&buffer[..buffer.len().min(most)])
        }
        _ => Ok(buffer),
    }
}

pub(super) fn on_sync() -> io::Result<()> {
    if FAULT.get() == Fault::Sync { Err(disk_full()) } else { Ok(()) }
}

pub(super) fn on_rename() -> io::Result<()> {
    if FAULT.get() == Fault::Rename { Err(disk_full()) } else { Ok(()) }
}

/// Does something under a fault.
fn under<T>(fault: Fault, work: impl FnOnce() -> T) -> T {
    FAULT.set(fault);
    let result = work();
    FAULT.set(Fault::None);
    result
}

fn cloud() -> Cloud {
    let points: Vec<DVec3> =
        (0..300).map(|i| DVec3::new(f64::from(i % 20), f64::from(i / 20), 0.25 * f64::from(i % 7))).collect();
    let mut cloud = Cloud::from_points(&points);
    cloud.normals = vec![Vec3::Z; points.len()];
    cloud.shapes = Shapes::Discs(vec![0.5; points.len()]);
    cloud.colors = Some(points.iter().map(|p| (p / 20.0).as_vec3()).collect());
    cloud
}

fn film() -> Film {
    let mut film = Film::new([37, 21], PixelRect::new(0, 0, 37, 21), AovSelection::ALL);
    for (index, pixel) in film.rgba.iter_mut().enumerate() {
        *pixel = std::array::from_fn(|channel| ((index * 4 + channel) % 97) as f32 / 97.0);
    }
    film
}

fn cameras() -> Vec<NamedCamera> {
    let camera = Camera {
        width: 8,
        height: 8,
        projection: Projection::Perspective { focal_length: DVec2::splat(8.0), lens: None },
        principal_point: DVec2::splat(4.0),
        world_to_camera: DMat4::IDENTITY,
        near: 0.1,
        far: f64::INFINITY,
        clip_planes: Vec::new(),
        distortion: None,
    };
    (0..20).map(|i| NamedCamera { name: format!("camera {i}"), camera: camera.clone() }).collect()
}

type Writer = Box<dyn Fn(&Path) -> Result<(), Error>>;

/// Every writer of a file.
fn writers() -> Vec<(&'static str, Writer)> {
    fn exr(compression: Compression, parallel: bool) -> Writer {
        let options = ExrOptions { compression, parallel, full_floats: true };
        Box::new(move |path| write_exr(path, &film(), &Metadata::default(), &options))
    }
    fn png(depth: PngDepth) -> Writer {
        Box::new(move |path| write_png(path, &film(), &Metadata::default(), depth))
    }
    vec![
        ("zip.exr", exr(Compression::Zip, true)),
        ("none.exr", exr(Compression::None, false)),
        ("8.png", png(PngDepth::Eight)),
        ("16.png", png(PngDepth::Sixteen)),
        ("binary.ply", Box::new(|path| write_ply(path, &cloud(), PlyEncoding::Binary))),
        ("text.ply", Box::new(|path| write_ply(path, &cloud(), PlyEncoding::Ascii))),
        ("a.las", Box::new(|path| write_las(path, &cloud(), false).map(drop))),
        ("a.laz", Box::new(|path| write_las(path, &cloud(), true).map(drop))),
        ("a.xyz", Box::new(|path| write_text(path, &cloud(), ' '))),
        ("a.csv", Box::new(|path| write_text(path, &cloud(), ','))),
        ("a.splat", Box::new(|path| write_splat(path, &cloud()).map(drop))),
        ("a.json", Box::new(|path| write_cameras_json(path, &cameras()))),
    ]
}

/// Checks that a folder holds this one file.
fn holds_only(folder: &Path, path: &Path, bytes: &[u8], what: &str) {
    assert!(fs::read(path).unwrap() == bytes, "{what}: {}", path.display());
    assert_eq!(fs::read_dir(folder).unwrap().count(), 1, "{what}: {}", path.display());
}

#[test]
fn a_fault_at_any_byte_leaves_the_old_file() {
    for (name, write) in writers() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        write(&path).unwrap();
        let size = fs::metadata(&path).unwrap().len() as usize;
        fs::write(&path, "old").unwrap();
        // Headers byte by byte; of the rest a hundred places. An EXR file's header is written twice.
        let places = (0..300).chain((300..size).step_by((size / 100).max(1))).chain(size - 5..size);
        let faults = places.filter(|&at| at < size).map(Fault::FullAfter).chain([Fault::Sync, Fault::Rename]);
        for fault in faults {
            let failure = under(fault, || write(&path));
            let failure = failure.expect_err(&format!("{name}: {fault:?}"));
            assert!(matches!(failure, Error::Io { .. }), "{name}: {fault:?}: {failure:?}");
            assert!(failure.to_string().contains(name), "{failure}");
            holds_only(folder.path(), &path, b"old", &format!("{fault:?}"));
        }
    }
}

#[test]
fn short_and_interrupted_writes_change_nothing() {
    for (name, write) in writers() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        write(&path).unwrap();
        let whole = fs::read(&path).unwrap();
        for most in [1, 7, 1000] {
            fs::write(&path, "old").unwrap();
            under(Fault::Short { most, interrupt: false }, || write(&path)).unwrap();
            holds_only(folder.path(), &path, &whole, &format!("{most} bytes a write"));
        }
    }
}

#[test]
fn a_picture_of_several_files_is_old_or_new_file_by_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let options = PictureOptions { separate_aovs: true, ..PictureOptions::default() };
    let write = || write_picture(&path, &film(), &Metadata::default(), &options);
    write().unwrap();
    let files = || -> Vec<(std::path::PathBuf, Vec<u8>)> {
        let mut paths: Vec<_> =
            fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path()).collect();
        paths.sort();
        paths.into_iter().map(|path| (path.clone(), fs::read(path).unwrap())).collect()
    };
    let new = files();
    let total: usize = new.iter().map(|(_, bytes)| bytes.len()).sum();
    for at in (0..total).step_by(total / 50) {
        new.iter().for_each(|(path, _)| fs::write(path, "old").unwrap());
        under(Fault::FullAfter(at), write).unwrap_err();
        let found = files();
        assert_eq!(found.len(), new.len(), "nothing is left behind");
        for ((path, found), (_, new)) in found.iter().zip(&new) {
            assert!(found == b"old" || found == new, "{}: {at}", path.display());
        }
    }
}

#[test]
fn a_file_that_cannot_be_begun_is_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("missing").join("a.png");
    assert!(matches!(AtomicFile::create(&path), Err(Error::Io { action: "create", .. })));
}
