//! A file read once, from front to back: buffered, hashed and measured.

use crate::Error;
use sha2::{Digest, Sha256};
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

/// Size of the buffer, in bytes: some hundred times a row, and small enough for the second-level cache.
const BUFFER_BYTES: usize = 256 << 10;

/// The bytes of a file, seen through a sliding window.
pub(crate) struct Source<R> {
    reader: R,
    path: PathBuf,
    /// What the file system says, in bytes.
    size: u64,
    hash: Sha256,
    buffer: Vec<u8>,
    /// The unread bytes are `buffer[start..end]`.
    start: usize,
    end: usize,
    /// Place in the file of `buffer[start]`, in bytes.
    offset: u64,
    /// Whether the reader has said that there is no more.
    ended: bool,
}

impl<R: Read> Source<R> {
    pub fn new(reader: R, size: u64, path: &Path) -> Self {
        Self {
            reader,
            path: path.to_owned(),
            size,
            hash: Sha256::new(),
            buffer: vec![0; BUFFER_BYTES],
            start: 0,
            end: 0,
            offset: 0,
            ended: false,
        }
    }

    /// The file's name.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Place in the file of the next unread byte.
    pub fn offset(&self) -> u64 {
        self.offset
    }

    /// Size of the file, in bytes.
    pub fn size(&self) -> u64 {
        self.size
    }

    /// Number of bytes that the file should still hold.
    pub fn left(&self) -> u64 {
        self.size.saturating_sub(self.offset)
    }

    /// The unread bytes at hand.
    #[inline]
    pub fn window(&self) -> &[u8] {
        &self.buffer[self.start..self.end]
    }

    /// Marks bytes at hand as read.
    #[inline]
    pub fn consume(&mut self, bytes: usize) {
        debug_assert!(bytes <= self.end - self.start);
        self.start += bytes;
        self.offset += bytes as u64;
    }

    /// Gets at least `wanted` unread bytes into the window and says whether the file had as many.
    #[inline]
    pub fn want(&mut self, wanted: usize) -> Result<bool, Error> {
        if self.end - self.start >= wanted { Ok(true) } else { self.refill(wanted) }
    }

    fn refill(&mut self, wanted: usize) -> Result<bool, Error> {
        self.buffer.copy_within(self.start..self.end, 0);
        self.end -= self.start;
        self.start = 0;
        if wanted > self.buffer.len() {
            if self.buffer.try_reserve_exact(wanted - self.buffer.len()).is_err() {
                let what = format!("a part of {wanted} bytes");
                return Err(Error::limit(&self.path, what, "this machine's memory"));
            }
            self.buffer.resize(wanted, 0);
        }
        while self.end < wanted && !self.ended {
            match self.reader.read(&mut self.buffer[self.end..]) {
                Ok(0) => self.ended = true,
                Ok(read) => {
                    self.hash.update(&self.buffer[self.end..self.end + read]);
                    self.end += read;
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(Error::io(&self.path, "read")(error)),
            }
        }
        Ok(self.end >= wanted)
    }

    /// Skips bytes, and says whether the file had as many.
    pub fn skip(&mut self, mut bytes: u64) -> Result<bool, Error> {
        while bytes > 0 {
            if !self.want(1)? {
                return Ok(false);
            }
            let step = self.window().len().min(usize::try_from(bytes).unwrap_or(usize::MAX));
            self.consume(step);
            bytes -= step as u64;
        }
        Ok(true)
    }

    /// Reads what is left, and gives the SHA-256 (lower-case hexadecimal) and the size of the whole.
    pub fn finish(mut self) -> Result<(String, u64), Error> {
        while self.want(1)? {
            self.consume(self.window().len());
        }
        let hexadecimal = self.hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
        Ok((hexadecimal, self.offset))
    }
}
