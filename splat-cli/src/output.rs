//! Output files, checked before the long work starts.

use crate::usage::UsageError;
use anyhow::bail;
use splat_core::AovSelection;
use splat_io::atomic::remove_leftovers;
use splat_io::{AtomicFile, PictureFormat};
use std::path::{Path, PathBuf};

/// Checks that a picture with these AOVs, in files of their own if `separate`, can be written there.
///
/// # Errors
/// [`UsageError`] for an unknown extension, and for AOVs in a PNG file; otherwise as [`check_file`].
pub fn check_picture(path: &Path, aovs: AovSelection, separate: bool) -> anyhow::Result<()> {
    let format = PictureFormat::from_path(path).map_err(UsageError::new)?;
    if format == PictureFormat::Png && aovs != AovSelection::default() && !separate {
        let message = format!(
            "{}: a PNG file cannot hold what --aov asks for: write an .exr file, or add --aov-files",
            path.display()
        );
        return Err(UsageError::new(message).into());
    }
    check_file(path)
}

/// Checks that a file can be made there, by making one and throwing it away; and clears away what runs that were killed left
/// there.
///
/// # Errors
/// A folder that is missing; what the operating system says.
pub fn check_file(path: &Path) -> anyhow::Result<()> {
    let folder = path.parent().filter(|folder| *folder != Path::new(""));
    if let Some(folder) = folder.filter(|folder| !folder.is_dir()) {
        bail!("{}: there is no folder {}", path.display(), folder.display());
    }
    drop(AtomicFile::create(path)?);
    remove_leftovers(path);
    Ok(())
}

/// Checks that no input would be overwritten, by whatever name.
///
/// # Errors
/// [`UsageError`] naming the input.
pub fn spare_inputs<'a>(
    path: &Path,
    inputs: impl IntoIterator<Item = &'a PathBuf>,
) -> Result<(), UsageError> {
    let Ok(target) = path.canonicalize() else { return Ok(()) };
    match inputs.into_iter().find(|input| input.canonicalize().is_ok_and(|input| input == target)) {
        Some(input) => {
            Err(UsageError::new(format!("{} would overwrite {}", path.display(), input.display())))
        }
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_written_is_known_at_once() {
        let aovs = AovSelection { depth: true, ..AovSelection::default() };
        let folder = std::env::temp_dir();
        let check = |name: &str, aovs| check_picture(&folder.join(name), aovs, false);
        assert!(check("splat-check.png", AovSelection::default()).is_ok());
        assert!(check("splat-check.exr", aovs).is_ok());
        assert!(check("splat-check.png", aovs).unwrap_err().is::<UsageError>());
        assert!(check_picture(&folder.join("splat-check.png"), aovs, true).is_ok());
        assert!(check("splat-check.jpg", aovs).unwrap_err().is::<UsageError>());
        let missing = check("no such folder/x.png", AovSelection::default()).unwrap_err();
        assert!(!missing.is::<UsageError>() && missing.to_string().contains("no such folder"), "{missing}");
        assert!(!folder.join("splat-check.png").exists());
    }

    #[test]
    fn inputs_are_not_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let [input, other] = ["in.ply", "other.ply"].map(|name| folder.path().join(name));
        std::fs::write(&input, "x").unwrap();
        std::fs::write(&other, "x").unwrap();
        let inputs = [other.clone(), input];
        assert!(spare_inputs(&folder.path().join("new.ply"), &inputs).is_ok());
        assert!(spare_inputs(&folder.path().join(".").join("in.ply"), &inputs).is_err());
        #[cfg(unix)]
        {
            let link = folder.path().join("link.ply");
            std::os::unix::fs::symlink(&other, &link).unwrap();
            let refused = spare_inputs(&link, &inputs).unwrap_err().to_string();
            assert!(refused.contains("would overwrite") && refused.contains("other.ply"), "{refused}");
        }
    }
}
