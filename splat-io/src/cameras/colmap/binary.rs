//! `cameras.bin` and `images.bin`: little endian.

use super::{Lenses, Posed, lens, model_of};
use crate::source::Source;
use crate::{Error, Place};
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Greatest length of an image's name, in bytes.
const MOST_NAME_BYTES: usize = 4096;

/// Bytes of a camera without parameters: number, model, width, height.
const LENS_BYTES: u64 = 24;

/// Least bytes of an image: number, pose, camera, the end of its name, the count of its points.
const IMAGE_BYTES: u64 = 4 + 7 * 8 + 4 + 1 + 8;

/// Bytes of a point that an image sees: its place, and its number.
const SEEN_BYTES: u64 = 24;

fn open(path: &Path) -> Result<Source<File>, Error> {
    let (file, size) = crate::ply::open(path)?;
    Ok(Source::new(file, size, path))
}

/// Reads `cameras.bin`.
pub(super) fn read_cameras(path: &Path) -> Result<Lenses, Error> {
    let mut source = open(path)?;
    let mut lenses = Lenses::new();
    for _ in 0..count(&mut source, LENS_BYTES, "cameras")? {
        let start = source.offset();
        let invalid = |found: String, expected| Error::invalid(path, Place::Byte(start), found, expected);
        let number = u32::from_le_bytes(take(&mut source)?);
        let model = i32::from_le_bytes(take(&mut source)?);
        let size: [u64; 2] = [u64::from_le_bytes(take(&mut source)?), u64::from_le_bytes(take(&mut source)?)];
        let Some((name, parameters)) = model_of(model) else {
            return Err(invalid(format!("a camera of model {model}"), "one of COLMAP's models, 0 to 11"));
        };
        let parameters = (0..parameters).map(|_| Ok(f64::from_le_bytes(take(&mut source)?)));
        let parameters: Vec<f64> = parameters.collect::<Result<_, Error>>()?;
        let [Ok(width), Ok(height)] = size.map(u32::try_from) else {
            return Err(invalid(
                format!("a camera of {} x {} pixels", size[0], size[1]),
                "1 to 65536 pixels",
            ));
        };
        let lens = lens(name, [width, height], &parameters, path)?;
        let lens = lens.ok_or_else(|| invalid(format!("{parameters:?}"), "the parameters of the model"))?;
        if lenses.insert(number, lens).is_some() {
            return Err(invalid(format!("another camera {number}"), "a number that no camera has yet"));
        }
    }
    Ok(lenses)
}

/// Reads `images.bin`.
pub(super) fn read_images(path: &Path) -> Result<Vec<Posed>, Error> {
    let mut source = open(path)?;
    let mut images = Vec::new();
    for _ in 0..count(&mut source, IMAGE_BYTES, "images")? {
        let _number: [u8; 4] = take(&mut source)?;
        let mut pose = [0.0; 7];
        for value in &mut pose {
            *value = f64::from_le_bytes(take(&mut source)?);
        }
        let camera = u32::from_le_bytes(take(&mut source)?);
        let name = name(&mut source)?;
        let seen = count(&mut source, SEEN_BYTES, "points of an image")?;
        source.skip(seen * SEEN_BYTES)?;
        let [w, x, y, z, translation @ ..] = pose;
        images.push(Posed { name, camera, rotation: [w, x, y, z], translation });
    }
    Ok(images)
}

/// A count of things of at least so many bytes, held against what the file has left.
pub(crate) fn count<R: Read>(source: &mut Source<R>, bytes: u64, what: &str) -> Result<u64, Error> {
    let start = source.offset();
    let count = u64::from_le_bytes(take(source)?);
    let most = source.left() / bytes;
    if count > most {
        let expected = format!("at most {most}: the file has {} more bytes", source.left());
        let place = Place::Byte(start);
        return Err(Error::invalid(source.path(), place, format!("a count of {count} {what}"), expected));
    }
    Ok(count)
}

/// The next bytes.
pub(crate) fn take<R: Read, const N: usize>(source: &mut Source<R>) -> Result<[u8; N], Error> {
    if !source.want(N)? {
        let place = Place::Byte(source.offset());
        return Err(Error::invalid(source.path(), place, "the end of the file", format!("{N} more bytes")));
    }
    let mut bytes = [0; N];
    bytes.copy_from_slice(&source.window()[..N]);
    source.consume(N);
    Ok(bytes)
}

/// A name that a zero byte ends.
fn name<R: Read>(source: &mut Source<R>) -> Result<String, Error> {
    let mut name = Vec::new();
    loop {
        match take(source)? {
            [0] => return Ok(String::from_utf8_lossy(&name).into_owned()),
            [byte] if name.len() < MOST_NAME_BYTES => name.push(byte),
            _ => return Err(Error::limit(source.path(), "an image's name of more than 4096 bytes", "4096")),
        }
    }
}
