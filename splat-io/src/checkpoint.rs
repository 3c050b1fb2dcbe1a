//! Pictures in the making, kept so that a program that was stopped can go on.
//!
//! A checkpoint is the 16 bytes `splat checkpoint`, the version of the format, what the picture is of ([`Identity`]), the number
//! of finished tiles, what they took, the film's channels, and a SHA-256 of all that; integers and floats little endian. How
//! large it must be follows from the picture: nothing that it says is trusted before its checksum is right.

use crate::ply::open;
use crate::{AtomicFile, Error, Place};
use sha2::{Digest, Sha256};
use splat_core::{Film, Statistics, Unfinished};
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::Path;
use std::time::Duration;

const MAGIC: &[u8; 16] = b"splat checkpoint";
const VERSION: u64 = 1;

/// Bytes of a SHA-256.
const HASH: usize = 32;

/// Bytes before the identity.
const HEAD: usize = MAGIC.len() + 8;

/// Hashes of what a picture is a function of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Identity {
    /// The program and its version.
    pub program: [u8; HASH],
    /// The contents of all input files.
    pub inputs: [u8; HASH],
    /// The camera.
    pub camera: [u8; HASH],
    /// All options that change the picture.
    pub options: [u8; HASH],
}

impl Identity {
    /// The hashes one after the other.
    fn to_bytes(self) -> [u8; 4 * HASH] {
        let mut bytes = [0; 4 * HASH];
        let hashes = [self.program, self.inputs, self.camera, self.options];
        bytes.copy_from_slice(hashes.as_flattened());
        bytes
    }

    /// All of it in 64 hexadecimal digits.
    pub fn to_hexadecimal(self) -> String {
        hexadecimal(&Sha256::digest(self.to_bytes()))
    }
}

/// The SHA-256 of a text.
pub fn hash_text(text: &str) -> [u8; HASH] {
    Sha256::digest(text).into()
}

/// The SHA-256 of a file, in hexadecimal.
///
/// # Errors
/// [`Error::Io`].
pub fn hash_file(path: &Path) -> Result<String, Error> {
    let (file, size) = open(path)?;
    let mut hash = Sha256::new();
    io::copy(&mut file.take(size), &mut hash).map_err(Error::io(path, "read"))?;
    Ok(hexadecimal(&hash.finalize()))
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Writes a checkpoint, in one step ([`AtomicFile`]).
///
/// # Errors
/// [`Error::Io`].
pub fn write_checkpoint(path: &Path, identity: &Identity, unfinished: &Unfinished) -> Result<(), Error> {
    let mut file = AtomicFile::create(path)?;
    let mut out = BufWriter::with_capacity(1 << 18, &mut file);
    let mut hashing = Hashing { inner: &mut out, hash: Sha256::new() };
    let written = write_contents(&mut hashing, identity, unfinished);
    let checksum = hashing.hash.finalize();
    written
        .and_then(|()| out.write_all(&checksum))
        .and_then(|()| out.flush())
        .map_err(Error::io(path, "write"))?;
    drop(out);
    file.commit()
}

/// Reads the checkpoint of the picture of this identity, of which `empty` has the window and the channels.
///
/// # Errors
/// [`Error::Invalid`] if it is damaged; [`Error::Unsupported`] if it is one of another picture, saying what differs;
/// [`Error::Io`].
pub fn read_checkpoint(path: &Path, identity: &Identity, empty: Film) -> Result<Unfinished, Error> {
    let (_, size) = open(path)?;
    let damaged = || {
        let expected = "one that was written as a whole";
        Error::invalid(path, Place::File, "a damaged checkpoint", expected)
    };
    let start = || -> Result<_, Error> { Ok(BufReader::with_capacity(1 << 18, open(path)?.0)) };
    // Twice through the file: what is wrong with it is known before anything else.
    let contents = size.checked_sub(HASH as u64).ok_or_else(damaged)?;
    let io_error = |error: io::Error| match error.kind() {
        io::ErrorKind::UnexpectedEof => damaged(),
        _ => Error::io(path, "read")(error),
    };
    let mut file = start()?;
    let mut hash = Sha256::new();
    io::copy(&mut file.by_ref().take(contents), &mut hash).map_err(io_error)?;
    let mut checksum = [0; HASH];
    file.read_exact(&mut checksum).map_err(io_error)?;
    if hash.finalize()[..] != checksum {
        return Err(damaged());
    }
    let mut file = start()?.take(contents);
    let mut head = [0; HEAD + 4 * HASH];
    file.read_exact(&mut head).map_err(io_error)?;
    check_identity(path, &head, identity)?;
    let unfinished = read_contents(&mut file, empty).map_err(io_error)?;
    // What is left over cannot be of this film.
    if file.limit() == 0 { Ok(unfinished) } else { Err(damaged()) }
}

/// Checks that a checkpoint is one, and of this picture.
fn check_identity(path: &Path, head: &[u8; HEAD + 4 * HASH], identity: &Identity) -> Result<(), Error> {
    let other = |what: &str| {
        let expected = "one of the same picture: remove it, or leave --resume out";
        Err(Error::unsupported(path, format!("a checkpoint of {what}"), expected))
    };
    let (start, hashes) = head.split_at(HEAD);
    if start[..MAGIC.len()] != MAGIC[..] || start[MAGIC.len()..] != VERSION.to_le_bytes() {
        return other("another version of the program");
    }
    let known = identity.to_bytes();
    let mut pairs = hashes.chunks_exact(HASH).zip(known.chunks_exact(HASH));
    match pairs.position(|(found, known)| found != known) {
        None => Ok(()),
        Some(0) => other("another version of the program"),
        Some(1) => other("other inputs"),
        Some(2) => other("another camera"),
        Some(_) => other("other options"),
    }
}

/// Hashes what it writes.
struct Hashing<W> {
    inner: W,
    hash: Sha256,
}

impl<W: Write> Write for Hashing<W> {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let written = self.inner.write(buffer)?;
        self.hash.update(&buffer[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

fn write_contents(out: &mut impl Write, identity: &Identity, unfinished: &Unfinished) -> io::Result<()> {
    let Unfinished { film, tiles, statistics } = unfinished;
    out.write_all(MAGIC)?;
    out.write_all(&VERSION.to_le_bytes())?;
    out.write_all(&identity.to_bytes())?;
    let Statistics { tests, fragments, samples, raster, resolve, .. } = statistics;
    let numbers = [*tiles as u64, *tests, *fragments, *samples, nanoseconds(*raster), nanoseconds(*resolve)];
    numbers.iter().try_for_each(|number| out.write_all(&number.to_le_bytes()))?;
    let mut bytes = Vec::new();
    let mut write = |values: &mut dyn Iterator<Item = [u8; 4]>| -> io::Result<()> {
        // A row or so at a time.
        loop {
            bytes.clear();
            bytes.extend(values.take(1 << 16).flatten());
            if bytes.is_empty() {
                return Ok(());
            }
            out.write_all(&bytes)?;
        }
    };
    write(&mut film.rgba.iter().flatten().map(|value| value.to_le_bytes()))?;
    for scalars in [&film.depth, &film.coverage, &film.layers, &film.samples].into_iter().flatten() {
        write(&mut scalars.iter().map(|value| value.to_le_bytes()))?;
    }
    for vectors in [&film.normal, &film.albedo, &film.position, &film.variance].into_iter().flatten() {
        write(&mut vectors.iter().flat_map(|vector| vector.to_array()).map(f32::to_le_bytes))?;
    }
    if let Some(ids) = &film.id {
        write(&mut ids.iter().map(|id| id.to_le_bytes()))?;
    }
    let planes = film.sums.iter().flat_map(|sums| &sums.planes);
    planes.into_iter().try_for_each(|plane| {
        // Halves of eight bytes, in their order.
        write(&mut plane.iter().flat_map(|value| {
            let [a, b, c, d, e, f, g, h] = value.to_le_bytes();
            [[a, b, c, d], [e, f, g, h]]
        }))
    })
}

fn nanoseconds(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
}

fn read_contents(file: &mut impl Read, mut film: Film) -> io::Result<Unfinished> {
    let mut numbers = [0; 6];
    for number in &mut numbers {
        let mut bytes = [0; 8];
        file.read_exact(&mut bytes)?;
        *number = u64::from_le_bytes(bytes);
    }
    let [tiles, tests, fragments, samples, raster, resolve] = numbers;
    let mut next = || {
        let mut bytes = [0; 4];
        file.read_exact(&mut bytes).map(|()| bytes)
    };
    for value in film.rgba.as_flattened_mut() {
        *value = f32::from_le_bytes(next()?);
    }
    let Film {
        depth, coverage, layers, samples: counts, normal, albedo, position, variance, id, sums, ..
    } = &mut film;
    for value in [depth, coverage, layers, counts].into_iter().flatten().flatten() {
        *value = f32::from_le_bytes(next()?);
    }
    for vector in [normal, albedo, position, variance].into_iter().flatten().flatten() {
        for axis in 0..3 {
            vector[axis] = f32::from_le_bytes(next()?);
        }
    }
    for value in id.iter_mut().flatten() {
        *value = u32::from_le_bytes(next()?);
    }
    for value in sums.iter_mut().flat_map(|sums| &mut sums.planes).flatten() {
        let ([a, b, c, d], [e, f, g, h]) = (next()?, next()?);
        *value = f64::from_le_bytes([a, b, c, d, e, f, g, h]);
    }
    let [raster, resolve] = [raster, resolve].map(Duration::from_nanos);
    let statistics = Statistics { tests, fragments, samples, raster, resolve, ..Statistics::default() };
    Ok(Unfinished { film, tiles: usize::try_from(tiles).unwrap_or(usize::MAX), statistics })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use splat_core::{AovSelection, PixelRect};
    use std::fs;

    const WINDOW: PixelRect = PixelRect::new(3, 4, 40, 31);

    fn empty(aovs: AovSelection) -> Film {
        Film::new([64, 48], WINDOW, aovs)
    }

    fn unfinished(aovs: AovSelection) -> Unfinished {
        let mut film = empty(aovs);
        let mut number = 0.0;
        let mut next = || {
            number += 0.5f32;
            number
        };
        film.rgba.as_flattened_mut().iter_mut().for_each(|value| *value = next());
        film.depth.iter_mut().flatten().for_each(|value| *value = next());
        film.normal.iter_mut().flatten().for_each(|value| *value = Vec3::new(next(), next(), f32::INFINITY));
        film.id.iter_mut().flatten().for_each(|value| *value = next() as u32);
        let statistics = Statistics {
            tests: 1 << 40,
            fragments: 7,
            samples: 9,
            raster: Duration::from_millis(12),
            resolve: Duration::from_nanos(5),
            ..Statistics::default()
        };
        Unfinished { film, tiles: 3, statistics }
    }

    fn identity() -> Identity {
        let [program, inputs, camera, options] = ["program", "inputs", "camera", "options"].map(hash_text);
        Identity { program, inputs, camera, options }
    }

    #[test]
    fn what_is_written_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.checkpoint");
        let some = AovSelection { depth: true, id: true, ..AovSelection::default() };
        for aovs in [AovSelection::default(), some, AovSelection::ALL] {
            let unfinished = unfinished(aovs);
            write_checkpoint(&path, &identity(), &unfinished).unwrap();
            assert_eq!(read_checkpoint(&path, &identity(), empty(aovs)).unwrap(), unfinished);
        }
    }

    #[test]
    fn a_damaged_one_is_never_used() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.checkpoint");
        let aovs = AovSelection { depth: true, ..AovSelection::default() };
        write_checkpoint(&path, &identity(), &unfinished(aovs)).unwrap();
        let whole = fs::read(&path).unwrap();
        let refused = |bytes: &[u8], film: Film| {
            fs::write(&path, bytes).unwrap();
            let refused = read_checkpoint(&path, &identity(), film).unwrap_err();
            assert!(matches!(refused, Error::Invalid { .. }), "{refused}");
        };
        for at in (0..whole.len()).step_by(97) {
            let mut changed = whole.clone();
            changed[at] ^= 0x10;
            refused(&changed, empty(aovs));
            refused(&whole[..at], empty(aovs));
        }
        refused(&[&whole[..], b"more"].concat(), empty(aovs));
        // Whole, but of another film than its identity tells.
        refused(&whole, empty(AovSelection::ALL));
        refused(&whole, empty(AovSelection::default()));
    }

    #[test]
    fn one_of_another_picture_says_what_differs() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.checkpoint");
        let aovs = AovSelection::default();
        write_checkpoint(&path, &identity(), &unfinished(aovs)).unwrap();
        let other = hash_text("other");
        let cases = [
            (Identity { program: other, ..identity() }, "another version of the program"),
            (Identity { inputs: other, ..identity() }, "other inputs"),
            (Identity { camera: other, ..identity() }, "another camera"),
            (Identity { options: other, ..identity() }, "other options"),
        ];
        for (identity, expected) in cases {
            let refused = read_checkpoint(&path, &identity, empty(aovs)).unwrap_err();
            assert!(matches!(refused, Error::Unsupported { .. }), "{refused}");
            assert!(refused.to_string().contains(expected), "{refused}");
        }
    }
}
