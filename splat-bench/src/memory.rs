//! The memory that a frame takes, as Linux counts it.

use anyhow::Context;
use splat_core::{Camera, Cloud, RenderOptions};
use splat_simd::{Level, Renderer};
use std::process::Command;

/// The number that this program prints when it is run with these arguments, in a process of its own: [`of_frame`]. `None`
/// where the system does not tell.
pub fn of_child(arguments: &[&str]) -> Option<u64> {
    let mut child = Command::new(std::env::current_exe().ok()?);
    child.args(arguments);
    // What is freed shall go back to the system at once (glibc).
    child.envs([("MALLOC_MMAP_THRESHOLD_", "65536"), ("MALLOC_TRIM_THRESHOLD_", "65536")]);
    let output = child.output().ok().filter(|output| output.status.success())?;
    String::from_utf8(output.stdout).ok()?.trim().parse().ok()
}

/// Bytes that a frame takes at its peak, beyond cloud and picture.
///
/// # Errors
/// If it cannot be rendered, or the system does not tell.
pub fn of_frame(
    cloud: &Cloud,
    camera: &Camera,
    options: &RenderOptions,
    threads: usize,
) -> anyhow::Result<u64> {
    // The peak so far was that of making the cloud.
    std::fs::write("/proc/self/clear_refs", "5").context("a peak that can be reset")?;
    let mut renderer = Renderer::new(threads, Level::choose())?;
    let rendered = renderer.render(cloud, camera, options, &mut |_| {})?;
    let peak = status("VmHWM:")?;
    drop(renderer);
    let rest = status("VmRSS:")?;
    drop(rendered);
    Ok(peak.saturating_sub(rest))
}

/// A line of this process's status, in bytes.
fn status(name: &str) -> anyhow::Result<u64> {
    let text = std::fs::read_to_string("/proc/self/status")?;
    let line = text.lines().find_map(|line| line.strip_prefix(name)).context("a line of the status")?;
    Ok(line.trim().trim_end_matches("kB").trim().parse::<u64>()? * 1024)
}
