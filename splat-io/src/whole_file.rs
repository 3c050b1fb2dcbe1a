//! Files that are read into memory at once, and numbers in them.

use crate::{Error, ply};
use sha2::{Digest, Sha256};
use std::io::{self, Read};
use std::path::Path;

/// Number of bytes by which a file is judged before the rest is read.
const HEAD_BYTES: u64 = 64 << 10;

/// Reads all of a regular file, if `check` finds nothing wrong with its first bytes (64 KiB, or all there are).
pub(crate) fn read_whole(
    path: &Path,
    check: impl FnOnce(&[u8], &Path) -> Result<(), Error>,
) -> Result<Vec<u8>, Error> {
    let (mut file, size) = ply::open(path)?;
    let mut head = Vec::new();
    file.by_ref().take(size.min(HEAD_BYTES)).read_to_end(&mut head).map_err(Error::io(path, "read"))?;
    check(&head, path)?;
    // What is written to the file meanwhile is none of ours.
    read_rest(head, file, size, path)
}

/// Reads on, up to `size` bytes in all, behind those that are read.
pub(crate) fn read_rest(
    mut bytes: Vec<u8>,
    reader: impl Read,
    size: u64,
    path: &Path,
) -> Result<Vec<u8>, Error> {
    let left = size.saturating_sub(bytes.len() as u64);
    let reserved = usize::try_from(left).ok().map(|left| bytes.try_reserve_exact(left));
    if !matches!(reserved, Some(Ok(()))) {
        return Err(Error::limit(path, format!("a file of {size} bytes"), "this machine's memory"));
    }
    reader.take(left).read_to_end(&mut bytes).map_err(Error::io(path, "read"))?;
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
