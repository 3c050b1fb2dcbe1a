//! The tables as text.

use crate::measure::{LevelTimes, Measured};

const CASES: &str = "\
| case | splats | fragments | tests a fragment | lanes that hit | set-up, ns a splat | binning, ns a splat | \
reference raster, ns a fragment | memory, MB |
|---|---|---|---|---|---|---|---|---|";

const LEVELS: &str = "\
| case | lanes | raster | gain | raster + store | resolve | raster + store + resolve | gain | frame, 1 thread, ms | \
2 threads, ms | gain |
|---|---|---|---|---|---|---|---|---|---|---|";

/// Both tables.
pub fn tables(all: &[Measured]) -> String {
    let cases = all.iter().map(case).collect::<Vec<_>>().join("\n");
    let levels = all.iter().flat_map(|measured| measured.levels.iter().map(|times| level(measured, times)));
    format!("{CASES}\n{cases}\n\n{LEVELS}\n{}", levels.collect::<Vec<_>>().join("\n"))
}

/// What belongs to a case at whatever level.
fn case(measured: &Measured) -> String {
    let Measured { case, splats, fragments, tests, levels, .. } = measured;
    // No lanes in either: whichever level was the least disturbed.
    let least = |time: fn(&LevelTimes) -> f64| levels.iter().map(time).fold(f64::INFINITY, f64::min);
    let per_splat = |nanoseconds: f64| nanoseconds / *splats as f64;
    format!(
        "| {case} | {splats} | {fragments} | {:.2} | {:.0} % | {:.0} | {:.0} | {:.1} | {} |",
        *tests as f64 / *fragments as f64,
        100.0 * *fragments as f64 / *tests as f64,
        per_splat(least(|times| times.setup.per(1))),
        per_splat(least(|times| times.bin.per(1))),
        measured.reference.per(measured.pinhole_fragments),
        measured.memory.map_or("?".to_owned(), |bytes| format!("{:.0}", bytes as f64 / 1e6)),
    )
}

/// The times of a level.
fn level(measured: &Measured, times: &LevelTimes) -> String {
    let per_fragment = |time: fn(&LevelTimes) -> f64| time(times) / measured.fragments as f64;
    let reference = measured.reference.per(measured.pinhole_fragments);
    let raster = per_fragment(|times| times.raster.per(1));
    let both = per_fragment(|times| times.both.per(1));
    let frame = times.frame.map(|time| time.per(1_000_000));
    format!(
        "| {} | {} | {raster:.2} | {:.1} | {:.2} | {:.2} | {both:.2} | {:.1} | {:.0} | {:.0} | {:.2} |",
        measured.case,
        times.level.name(),
        reference / raster,
        per_fragment(|times| times.stored.per(1)),
        per_fragment(|times| times.resolve.per(1)),
        reference / both,
        frame[0],
        frame[1],
        frame[0] / frame[1],
    )
}
