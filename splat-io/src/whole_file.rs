//! Files that are read into memory at once, and numbers in them.

use crate::{Error, ply};
use sha2::{Digest, Sha256};
use std::io::{self, Read};
use std::path::Path;

/// Reads all of a regular file.
pub(crate) fn read_whole(path: &Path) -> Result<Vec<u8>, Error> {
    let (file, size) = ply::open(path)?;
    let mut bytes = Vec::new();
    let reserved = usize::try_from(size).ok().map(|size| bytes.try_reserve_exact(size));
    if !matches!(reserved, Some(Ok(()))) {
        return Err(Error::limit(path, format!("a file of {size} bytes"), "this machine's memory"));
    }
    // What is written to the file meanwhile is none of ours.
    file.take(size).read_to_end(&mut bytes).map_err(Error::io(path, "read"))?;
    Ok(bytes)
}

/// SHA-256 of a file, in lower-case hexadecimal.
///
/// # Errors
/// [`Error::Io`]; [`Error::Unsupported`] for what is no regular file.
pub fn file_sha256(path: &Path) -> Result<String, Error> {
    let (file, size) = ply::open(path)?;
    let mut hash = Sha256::new();
    io::copy(&mut file.take(size), &mut hash).map_err(Error::io(path, "read"))?;
    Ok(hexadecimal(&hash.finalize()))
}

/// SHA-256 in lower-case hexadecimal.
pub(crate) fn sha256(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The N bytes at a place, if the file has them.
pub(crate) fn bytes_at<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..)?.first_chunk().copied()
}
