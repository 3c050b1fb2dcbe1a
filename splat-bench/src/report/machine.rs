//! What the report ran on.

use splat_simd::Level;

/// Processor, number of processors, level, system.
pub fn describe() -> String {
    let model = std::fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| {
        let line = text.lines().find(|line| line.starts_with("model name"))?;
        Some(line.split_once(':')?.1.trim().to_owned())
    });
    let count = std::thread::available_parallelism().map_or(1, usize::from);
    let load = std::fs::read_to_string("/proc/loadavg")
        .ok()
        .and_then(|text| Some(format!(", load of the last minute {}", text.split_whitespace().next()?)));
    format!(
        "{}, {count} processors, {} {}, level {}{}",
        model.unwrap_or_else(|| "unknown processor".into()),
        std::env::consts::OS,
        std::env::consts::ARCH,
        Level::choose().name(),
        load.unwrap_or_default()
    )
}
