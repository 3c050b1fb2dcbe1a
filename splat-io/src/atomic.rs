//! Files that are absent, old, or complete.

use crate::Error;
use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tempfile::NamedTempFile;

/// A file in the making: a temporary beside its target, which takes the target's place on
/// [`AtomicFile::commit`].
///
/// Dropped without a commit it vanishes, and whatever the target was before remains.
#[derive(Debug)]
pub struct AtomicFile {
    /// What the caller called it.
    path: PathBuf,
    /// Where it goes: the path, symbolic links followed.
    target: PathBuf,
    temporary: NamedTempFile,
    unfinished: Unfinished,
}

/// The temporary files of this process.
static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn all_unfinished() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    // A set of paths is never half changed.
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A temporary file, known to [`abandon_all`] for as long as this lives.
#[derive(Debug)]
struct Unfinished(PathBuf);

impl Unfinished {
    fn new(path: &Path) -> Self {
        all_unfinished().insert(path.to_owned());
        Self(path.to_owned())
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        all_unfinished().remove(&self.0);
    }
}

/// Removes all files in the making, and lets none be begun or finished any more: for a program that is about to end.
pub fn abandon_all() {
    let unfinished = all_unfinished();
    for path in unfinished.iter() {
        // What cannot be removed stays behind; there is nobody left to tell.
        _ = fs::remove_file(path);
    }
    std::mem::forget(unfinished);
}

impl AtomicFile {
    /// Starts a file that will become `path`, readable by whom the process's umask allows.
    ///
    /// # Errors
    /// [`Error::Io`] if no file can be made in that folder; [`Error::Unsupported`] if the path exists and is
    /// no regular file (a folder, a device, a pipe), since that cannot be replaced by a rename.
    pub fn create(path: &Path) -> Result<Self, Error> {
        let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        if fs::metadata(&target).is_ok_and(|existing| !existing.is_file()) {
            return Err(Error::unsupported(path, "writing to a folder, device or pipe", "a regular file"));
        }
        let folder = match target.parent() {
            Some(parent) if parent != Path::new("") => parent,
            _ => Path::new("."),
        };
        let mut builder = tempfile::Builder::new();
        builder.prefix(".splat-").suffix(".tmp");
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let temporary = builder.tempfile_in(folder).map_err(Error::io(path, "create"))?;
        let unfinished = Unfinished::new(temporary.path());
        Ok(Self { path: path.to_owned(), target, temporary, unfinished })
    }

    /// The path that the file will have.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Makes the file durable, then puts it in the target's place in one step.
    ///
    /// # Errors
    /// [`Error::Io`]; the target is then what it was before.
    pub fn commit(self) -> Result<(), Error> {
        self.temporary.as_file().sync_all().map_err(Error::io(&self.path, "write"))?;
        let Self { path, target, temporary, unfinished } = self;
        let lock = all_unfinished();
        let persisted = temporary.persist(target);
        drop(lock);
        drop(unfinished);
        persisted.map_err(|failure| Error::io(&path, "replace")(failure.error))?;
        Ok(())
    }

    fn file(&mut self) -> &mut File {
        self.temporary.as_file_mut()
    }
}

impl Read for AtomicFile {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.file().read(buffer)
    }
}

impl Write for AtomicFile {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        self.file().write(buffer)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file().flush()
    }
}

impl Seek for AtomicFile {
    fn seek(&mut self, position: SeekFrom) -> io::Result<u64> {
        self.file().seek(position)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.png");
        fs::write(&path, "old").unwrap();
        let mut file = AtomicFile::create(&path).unwrap();
        file.write_all(b"half of the n").unwrap();
        drop(file);
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_commit_replaces_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.png");
        fs::write(&path, "old").unwrap();
        let mut file = AtomicFile::create(&path).unwrap();
        file.write_all(b"new").unwrap();
        file.commit().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn permissions_are_those_of_any_new_file() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (ours, plain) = (folder.path().join("ours"), folder.path().join("plain"));
        AtomicFile::create(&ours).unwrap().commit().unwrap();
        File::create(&plain).unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));
    }

    #[cfg(unix)]
    #[test]
    fn a_symbolic_link_stays_and_its_target_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let (link, target) = (folder.path().join("link"), folder.path().join("target"));
        fs::write(&target, "old").unwrap();
        std::os::unix::fs::symlink(&target, &link).unwrap();
        let mut file = AtomicFile::create(&link).unwrap();
        file.write_all(b"new").unwrap();
        file.commit().unwrap();
        assert_eq!(fs::read(&target).unwrap(), b"new");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    }

    #[test]
    fn folders_and_missing_folders_are_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let refused = AtomicFile::create(folder.path()).unwrap_err().to_string();
        assert!(refused.contains("regular file"), "{refused}");
        let missing = AtomicFile::create(&folder.path().join("no/such/x.png")).unwrap_err().to_string();
        assert!(missing.contains("x.png: cannot create"), "{missing}");
    }
}
