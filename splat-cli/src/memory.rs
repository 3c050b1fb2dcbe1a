//! `--max-memory`: each stage is asked what it needs at most before it begins.
//!
//! What is in use already, the system tells (Linux does): so the account cannot drift from the truth, whatever the allocator
//! keeps. The 64 MB that the program may take beyond the limit are its own code, its threads, and small things that nobody counts.

use clap::Args;
use splat_core::memory::Budget;
use splat_core::prepare::PrepareOptions;
use splat_core::{Cloud, Error, RenderOptions};
use splat_io::memory::{memory_of_cloud, memory_of_image, memory_of_mesh};
use std::path::Path;

/// How much memory may be used.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Args)]
pub struct Memory {
    /// Most memory to use, as 512M or 2G: what needs more is refused before it begins, and tiles are rendered in smaller parts
    /// [default: no limit]
    #[arg(id = "max_memory", long = "max-memory", value_name = "SIZE", value_parser = crate::values::memory)]
    limit: Option<u64>,
}

/// A point in preparation: its place along the curve and in the tree, its neighbourhood, what is estimated of it.
const PREPARE_POINT: usize = 400;

/// And for each thread the neighbours of one point, which may be all of a cloud.
const PREPARE_NEIGHBOR: usize = 64;

/// Neighbours of the points that are looked at together, or what they add up to.
const PREPARE_TERMS: usize = 100 << 20;

/// The lines of an EXR file that are packed together, and how many copies of them there are.
const EXR_LINES: usize = 32 * 4;

impl Memory {
    /// Whether there is a limit.
    pub fn is_limited(self) -> bool {
        self.limit.is_some()
    }

    /// Bytes that may still be taken.
    fn left(self) -> usize {
        let left = |limit: u64| limit.saturating_sub(resident_bytes().unwrap_or(0));
        self.limit.map_or(usize::MAX, |limit| usize::try_from(left(limit)).unwrap_or(usize::MAX - 1))
    }

    /// Checks that there is room for something.
    ///
    /// # Errors
    /// [`Error::Memory`].
    fn check(self, what: &'static str, bytes: usize, help: &'static str) -> Result<(), Error> {
        Budget::new(self.left()).take(what, bytes, help)
    }

    /// Checks that there is room to read a file, as a mesh of so many surfels or as a cloud.
    ///
    /// # Errors
    /// As [`Memory::check`]; what is wrong with the file at first sight.
    pub fn check_file(self, path: &Path, surfels: Option<usize>) -> anyhow::Result<()> {
        if !self.is_limited() {
            return Ok(());
        }
        let bytes = match surfels {
            Some(surfels) => memory_of_mesh(path, surfels)?,
            None => memory_of_cloud(path)?,
        };
        let help = "a part of the cloud, fewer --points of a mesh, or a larger --max-memory";
        let checked = self.check("reading the file", usize::try_from(bytes).unwrap_or(usize::MAX), help);
        checked.map_err(|error| anyhow::Error::new(error).context(path.display().to_string()))
    }

    /// The same for an image.
    ///
    /// # Errors
    /// As [`Memory::check_file`].
    pub fn check_image(self, path: &Path) -> anyhow::Result<()> {
        if !self.is_limited() {
            return Ok(());
        }
        let bytes = usize::try_from(memory_of_image(path)?).unwrap_or(usize::MAX);
        let checked = self.check("reading the image", bytes, "a smaller image, or a larger --max-memory");
        checked.map_err(|error| anyhow::Error::new(error).context(path.display().to_string()))
    }

    /// Checks that there is room for a second copy of clouds: joined, or a part of them.
    ///
    /// # Errors
    /// [`Error::Memory`].
    pub fn check_copy<'a>(self, clouds: impl IntoIterator<Item = &'a Cloud>) -> Result<(), Error> {
        if !self.is_limited() {
            return Ok(());
        }
        /// World positions in `f64`, and the coordinates to find their origin by.
        const WORLD: usize = 32;
        let bytes = clouds.into_iter().map(|cloud| cloud.bytes() + WORLD * cloud.len()).sum();
        self.check(
            "the cloud, once more in other order",
            bytes,
            "one file, all of its points, or a larger --max-memory",
        )
    }

    /// Checks that there is room to complete a cloud.
    ///
    /// # Errors
    /// [`Error::Memory`].
    pub fn check_preparation(self, cloud: &Cloud, options: &PrepareOptions) -> Result<(), Error> {
        if !self.is_limited() || (!cloud.is_empty() && options.would_keep(cloud)) {
            return Ok(());
        }
        let per_point = PREPARE_POINT + PREPARE_NEIGHBOR * rayon::current_num_threads();
        let terms = PREPARE_TERMS.min(cloud.len().saturating_mul(PREPARE_TERMS / 10_000));
        let bytes = cloud.len().saturating_mul(per_point).saturating_add(terms);
        let help = "fewer --threads, `splat prepare` once on a larger machine, or a larger --max-memory";
        self.check("estimating normals, sizes and areas", bytes, help)
    }

    /// Bytes that rendering may take, beside those that writing pictures takes; to be asked for once, since a renderer keeps
    /// what it has taken.
    pub fn for_rendering(self, width: u32, options: &RenderOptions) -> usize {
        if !self.is_limited() {
            return usize::MAX;
        }
        self.left().saturating_sub(EXR_LINES * width as usize * options.film_bytes_per_pixel())
    }
}

/// Memory that this process holds, in bytes: Linux tells.
pub fn resident_bytes() -> Option<u64> {
    of_status("VmRSS:")
}

/// Most memory that it ever held, in bytes.
pub fn peak_bytes() -> Option<u64> {
    of_status("VmHWM:")
}

fn of_status(name: &str) -> Option<u64> {
    kilobytes(&std::fs::read_to_string("/proc/self/status").ok()?, name)
}

/// A line of a process's status, in bytes.
fn kilobytes(status: &str, name: &str) -> Option<u64> {
    let kilobytes = status.lines().find_map(|line| line.strip_prefix(name))?;
    Some(kilobytes.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_a_line_of_the_status() {
        let status = "Name:\tsplat\nVmPeak:\t  9 kB\nVmHWM:\t    1234 kB\n";
        assert_eq!(kilobytes(status, "VmHWM:"), Some(1_263_616));
        assert_eq!(kilobytes("Name:\tsplat\n", "VmHWM:"), None);
        assert_eq!(kilobytes("VmHWM:\tmany kB", "VmHWM:"), None);
    }
}
