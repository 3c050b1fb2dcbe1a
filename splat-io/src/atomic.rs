//! Files that are absent, old, or complete.
//!
//! A program that is killed leaves its temporary files behind. They disturb nobody, since every one has a name of its own; and
//! each is locked for as long as somebody writes it, so that [`remove_leftovers`] can tell the dead from the living.

#[cfg(test)]
pub(crate) mod faults;

use crate::Error;
use std::collections::BTreeSet;
use std::fs::{self, File, TryLockError};
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

/// What the names of temporary files begin and end with.
const PREFIX: &str = ".splat-";
const SUFFIX: &str = ".tmp";

/// A new temporary file in a folder, locked where the file system has locks.
fn temporary_in(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX);
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    loop {
        let temporary = builder.tempfile_in(folder)?;
        let locked = temporary.as_file().try_lock();
        // Before it was locked it may have been taken for a leftover: then another.
        if !matches!(locked, Err(TryLockError::WouldBlock)) && temporary.path().exists() {
            return Ok(temporary);
        }
    }
}

/// The folder of a file.
fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    }
}

/// Removes the temporary files beside `path` that nobody writes any more: their program was killed, or the machine stopped.
/// What cannot be removed stays; it harms nobody.
pub fn remove_leftovers(path: &Path) {
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let Ok(entries) = fs::read_dir(folder_of(&target)) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let is_ours = name.to_str().is_some_and(|name| name.starts_with(PREFIX) && name.ends_with(SUFFIX));
        if !is_ours || !entry.file_type().is_ok_and(|kind| kind.is_file()) {
            continue;
        }
        if let Ok(file) = File::open(entry.path())
            && file.try_lock().is_ok()
        {
            _ = fs::remove_file(entry.path());
        }
    }
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
        let temporary = temporary_in(folder_of(&target)).map_err(Error::io(path, "create"))?;
        let unfinished = Unfinished::new(temporary.path());
        Ok(Self { path: path.to_owned(), target, temporary, unfinished })
    }

    /// The path that the file will have.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Makes the file durable, then puts it in the target's place in one step, and makes that durable.
    ///
    /// # Errors
    /// [`Error::Io`]; the target is then what it was before, or (action "make durable") already the new file.
    pub fn commit(self) -> Result<(), Error> {
        let Self { path, target, temporary, unfinished } = self;
        sync(temporary.as_file()).map_err(Error::io(&path, "write"))?;
        let folder = folder_of(&target).to_owned();
        let lock = all_unfinished();
        let persisted = persist(temporary, &target);
        drop(lock);
        drop(unfinished);
        persisted.map_err(Error::io(&path, "replace"))?;
        sync_folder(&folder).map_err(Error::io(&path, "make durable"))
    }

    fn file(&mut self) -> &mut File {
        self.temporary.as_file_mut()
    }
}

fn sync(file: &File) -> io::Result<()> {
    #[cfg(test)]
    faults::on_sync()?;
    file.sync_all()
}

fn persist(temporary: NamedTempFile, target: &Path) -> io::Result<()> {
    #[cfg(test)]
    faults::on_rename()?;
    temporary.persist(target).map_err(|failure| failure.error)?;
    Ok(())
}

/// Makes the names in a folder durable, where the system lets one.
fn sync_folder(folder: &Path) -> io::Result<()> {
    if !cfg!(unix) {
        return Ok(());
    }
    // A folder may be writable and not readable; and some file systems cannot do it.
    let Ok(folder) = File::open(folder) else { return Ok(()) };
    match folder.sync_all() {
        Err(error) if !matches!(error.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported) => {
            Err(error)
        }
        _ => Ok(()),
    }
}

impl Read for AtomicFile {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.file().read(buffer)
    }
}

impl Write for AtomicFile {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        #[cfg(test)]
        let buffer = faults::on_write(buffer)?;
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
    fn what_the_dead_leave_behind_is_removed_and_the_living_keep_theirs() {
        let folder = tempfile::tempdir().unwrap();
        let [dead, other] = [".splat-dead.tmp", "splat-other.tmp"].map(|name| folder.path().join(name));
        fs::write(&dead, "half").unwrap();
        fs::write(&other, "somebody else's").unwrap();
        let path = folder.path().join("picture.png");
        let mut living = AtomicFile::create(&path).unwrap();
        remove_leftovers(&path);
        assert!(!dead.exists() && other.exists());
        living.write_all(b"new").unwrap();
        living.commit().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
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
