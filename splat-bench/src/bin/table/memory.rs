//! The memory that a frame takes, as Linux counts it.

use anyhow::Context;
use splat_bench::Case;
use splat_simd::{Level, Renderer};
use std::process::Command;

/// [`measure`] in a process of its own. `None` where the system does not tell.
pub fn of_child(case: Case) -> Option<u64> {
    let mut child = Command::new(std::env::current_exe().ok()?);
    child.args(["--memory", &case.to_string()]);
    // What is freed shall go back to the system at once (glibc).
    child.envs([("MALLOC_MMAP_THRESHOLD_", "65536"), ("MALLOC_TRIM_THRESHOLD_", "65536")]);
    let output = child.output().ok().filter(|output| output.status.success())?;
    String::from_utf8(output.stdout).ok()?.trim().parse().ok()
}

/// Bytes that a frame on two threads takes at its peak, beyond cloud and picture.
///
/// # Errors
/// If it cannot be rendered, or the system does not tell.
pub fn measure(case: Case) -> anyhow::Result<u64> {
    let cloud = case.subject.cloud()?.with_context(|| case.subject.skipped())?;
    let scene = case.scene(&cloud)?;
    // The peak so far was that of making the cloud.
    std::fs::write("/proc/self/clear_refs", "5").context("a peak that can be reset")?;
    let mut renderer = Renderer::new(2, Level::choose())?;
    let rendered = renderer.render(&cloud, &scene.camera, &scene.options, &mut |_| {})?;
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
