//! Runs as JSON, and what became worse from one to another.

use super::figures::{Figure, Figures, Kind};
use super::plot::number;
use anyhow::{Context, bail};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::path::Path;

/// A time counts as changed beyond this part of itself, if the noise is no reason for more: see [`Noise`].
const TIME: f64 = 0.15;

/// The same of memory, of which whole pages and the allocator's blocks are counted.
const MEMORY: f64 = 0.10;

/// Less memory than this, in megabytes, is the allocator's.
const LITTLE: f64 = 2.0;

/// An error depends on nothing but the program: what differs by more than this part was changed by someone.
const ERROR: f64 = 0.01;

/// Errors below this are rounding, and no matter.
const NEGLIGIBLE: f64 = 1e-12;

/// The part of a run's times that are quieter than what counts as its noise.
const QUIET: f64 = 0.9;

/// With more noise than this, of both runs together, something else had the machine for whole repetitions, and no time is judged.
const TOO_LOUD: f64 = 0.5;

/// How much a time must move to be taken for changed.
///
/// A time's own noise, how far the median of its repetitions is above the least, is made of few repetitions and often too small
/// by chance. So that of all times of a run counts, too: it is the same machine that disturbs them all. Let noise be
/// exponential, of a relative mean m. The median of three repetitions is above the least by 1.5 m or less in nine of ten
/// times, which makes a tolerance of 2 (1.5 + 1.5) m = 6 m. The least of three exceeds the true time by more than that once in
/// 10^7 figures. Bursts are no matter unless they hit all three.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Noise {
    /// Of both runs together, in times of the single figures' noise: what nine of ten do not exceed.
    of_runs: f64,
}

impl Noise {
    fn new(runs: [&Run; 2]) -> Self {
        Self { of_runs: runs.into_iter().map(of_run).sum() }
    }

    /// How much a time of these noises may move, relative to itself. `None` if there is no telling.
    fn tolerance(self, noises: [f64; 2]) -> Option<f64> {
        let tolerance = TIME.max(2.0 * noises.iter().sum::<f64>()).max(2.0 * self.of_runs);
        (self.of_runs <= TOO_LOUD).then_some(tolerance)
    }
}

/// What nine of ten of a run's times are quieter than.
fn of_run(run: &Run) -> f64 {
    let times = run.figures.all.iter().filter(|figure| figure.kind == Kind::Time);
    let mut noises: Vec<f64> = times.map(|figure| figure.noise).collect();
    noises.sort_unstable_by(f64::total_cmp);
    noises.get((QUIET * noises.len() as f64) as usize).copied().unwrap_or(0.0)
}

/// A run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// What it ran on.
    pub machine: String,
    /// How: figures of different parameters do not compare.
    pub parameters: String,
    /// What it measured.
    pub figures: Figures,
}

impl Run {
    /// The run in a file.
    ///
    /// # Errors
    /// If it cannot be read, or is no report.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
        serde_json::from_str(&text).with_context(|| format!("{}: not a report.json", path.display()))
    }

    /// As JSON.
    ///
    /// # Errors
    /// Never, but for numbers that JSON does not know.
    pub fn to_json(&self) -> anyhow::Result<String> {
        if let Some(figure) = self.figures.all.iter().find(|figure| !figure.value.is_finite()) {
            bail!("{figure:?}: not a number");
        }
        Ok(serde_json::to_string_pretty(self)?)
    }
}

/// A figure that moved beyond noise.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// What it is now.
    pub figure: Figure,
    /// What it was.
    pub before: f64,
}

/// What moved from one run to another.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Changes {
    /// What became slower, larger or less accurate.
    pub worse: Vec<Change>,
    /// What became faster, smaller or more accurate.
    pub better: Vec<Change>,
    /// Figures that both runs have.
    pub compared: usize,
    /// By how much a time that is itself quiet must have moved to be among them. `None` if no time was judged.
    pub least_time: Option<f64>,
}

/// What moved beyond noise between two runs.
///
/// # Errors
/// If the runs had other parameters.
pub fn compare(before: &Run, now: &Run) -> anyhow::Result<Changes> {
    if before.parameters != now.parameters {
        bail!("the runs do not compare: {:?} before, {:?} now", before.parameters, now.parameters);
    }
    let old: HashMap<_, &Figure> = before.figures.all.iter().map(|figure| (name(figure), figure)).collect();
    let noise = Noise::new([before, now]);
    let mut changes = Changes { least_time: noise.tolerance([0.0; 2]), ..Changes::default() };
    for figure in &now.figures.all {
        let Some(old) = old.get(&name(figure)) else { continue };
        changes.compared += 1;
        let (tolerance, negligible) = match figure.kind {
            Kind::Plain => continue,
            Kind::Time => match noise.tolerance([figure.noise, old.noise]) {
                Some(tolerance) => (tolerance, 0.0),
                None => continue,
            },
            Kind::Memory => (MEMORY, LITTLE),
            Kind::Error => (ERROR, NEGLIGIBLE),
        };
        let change = || Change { figure: figure.clone(), before: old.value };
        if figure.value > old.value * (1.0 + tolerance) + negligible {
            changes.worse.push(change());
        } else if old.value > figure.value * (1.0 + tolerance) + negligible {
            changes.better.push(change());
        }
    }
    Ok(changes)
}

fn name(figure: &Figure) -> [&str; 4] {
    [&figure.section, &figure.subject, &figure.setting, &figure.quantity]
}

impl Changes {
    /// What moved, the most first, a line each.
    pub fn to_text(&self) -> String {
        let list = |title: &str, changes: &[Change]| {
            let ratio = |change: &Change| (change.figure.value / change.before).ln().abs();
            let mut sorted: Vec<&Change> = changes.iter().collect();
            sorted.sort_by(|a, b| ratio(b).total_cmp(&ratio(a)));
            let lines = sorted.iter().map(|change| {
                let Change { figure, before } = change;
                format!(
                    "  {}: {} -> {} ({:+.1} %)\n",
                    name(figure).join(" | "),
                    number(*before),
                    number(figure.value),
                    100.0 * (figure.value / before - 1.0)
                )
            });
            format!("{title}: {}\n{}", changes.len(), lines.collect::<String>())
        };
        let (worse, better) = (list("slower or less accurate", &self.worse), list("better", &self.better));
        let noise = match self.least_time {
            Some(least) => format!(
                "by the noise of these runs a time counts as changed from {:.0} % on, or more where it is itself noisy",
                100.0 * least
            ),
            None => "too noisy for times to be judged: run again with nothing else on the machine".to_owned(),
        };
        format!("{} figures compared; {noise}\n{worse}{better}", self.compared)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_bench::timing::Times;
    use splat_tests::random::Random;
    use std::time::Duration;

    fn run(values: &[(Kind, f64, f64)]) -> Run {
        let mut figures = Figures::default();
        for (i, &(kind, value, noise)) in values.iter().enumerate() {
            figures.note_noisy(["section", "subject", "setting", &i.to_string()], kind, value, noise);
        }
        Run { machine: "m".into(), parameters: "p".into(), figures }
    }

    #[test]
    fn noise_is_no_change() {
        let before = run(&[(Kind::Time, 10.0, 0.02), (Kind::Time, 10.0, 0.2), (Kind::Error, 1e-3, 0.0)]);
        let now = run(&[(Kind::Time, 10.9, 0.02), (Kind::Time, 13.0, 0.1), (Kind::Error, 1.005e-3, 0.0)]);
        let changes = compare(&before, &now).unwrap();
        assert_eq!((changes.worse.len(), changes.better.len(), changes.compared), (0, 0, 3));
    }

    /// A run of 400 times of which `repetitions` were taken, each longer than the true one by a share that is exponential
    /// with this mean, ten times as much once in fifty; the first one's truth is `slower` times what it was. And an error.
    fn measured(seed: u64, repetitions: usize, mean: f64, slower: f64, error: f64) -> Run {
        let mut random = Random::new(seed);
        let mut figures = Figures::default();
        for i in 0..400 {
            let truth = if i == 0 { 5.0 * slower } else { 5.0 + 0.1 * f64::from(i) };
            let mut times = Times::default();
            for _ in 0..repetitions {
                let burst = if random.index(50) == 0 { 10.0 } else { 1.0 };
                let extra = -mean * burst * random.unit().max(1e-9).ln();
                times.add(Duration::from_secs_f64(truth * (1.0 + extra) * 1e-3));
            }
            let names = ["section", "subject", "setting", &i.to_string()];
            figures.note_noisy(names, Kind::Time, times.least(), times.noise());
        }
        figures.note(["section", "subject", "setting", "RMSE"], Kind::Error, error);
        Run { machine: "m".into(), parameters: "p".into(), figures }
    }

    #[test]
    fn identical_runs_show_no_change_however_loud_the_machine() {
        for repetitions in [3, 4, 12] {
            for mean in [0.001, 0.01, 0.1, 0.3] {
                for seed in 0..50 {
                    let [before, now] =
                        [2 * seed, 2 * seed + 1].map(|seed| measured(seed, repetitions, mean, 1.0, 1e-3));
                    let changes = compare(&before, &now).unwrap();
                    assert!(changes.worse.is_empty(), "{repetitions}, {mean}, {seed}: {}", changes.to_text());
                    assert!(
                        changes.better.is_empty(),
                        "{repetitions}, {mean}, {seed}: {}",
                        changes.to_text()
                    );
                }
            }
        }
    }

    #[test]
    fn a_third_slower_is_found_on_a_quiet_machine_and_an_error_on_any() {
        for seed in 0..50 {
            for (mean, expected) in [(0.01, vec!["0", "RMSE"]), (0.3, vec!["RMSE"])] {
                let before = measured(2 * seed, 12, mean, 1.0, 1e-3);
                let now = measured(2 * seed + 1, 12, mean, 1.3, 1.05e-3);
                let changes = compare(&before, &now).unwrap();
                let mut found: Vec<&str> =
                    changes.worse.iter().map(|change| change.figure.quantity.as_str()).collect();
                found.sort_unstable();
                assert_eq!(found, expected, "{mean}, {seed}: {}", changes.to_text());
                let back = compare(&now, &before).unwrap();
                assert_eq!(back.better.len(), expected.len());
            }
        }
    }

    #[test]
    fn what_became_worse_is_named() {
        let before = run(&[(Kind::Time, 10.0, 0.0), (Kind::Error, 1e-3, 0.0), (Kind::Memory, 80.0, 0.0)]);
        let now = run(&[(Kind::Time, 12.0, 0.0), (Kind::Error, 2e-3, 0.0), (Kind::Memory, 70.0, 0.0)]);
        let changes = compare(&before, &now).unwrap();
        assert_eq!((changes.worse.len(), changes.better.len()), (2, 1));
        let text = changes.to_text();
        let second = text.lines().nth(2).unwrap();
        // The larger change comes first.
        assert!(second.contains("+100.0 %"), "{text}");
    }

    #[test]
    fn runs_of_other_parameters_do_not_compare() {
        let before = run(&[]);
        let now = Run { parameters: "q".into(), ..run(&[]) };
        assert!(compare(&before, &now).is_err());
    }

    #[test]
    fn json_comes_back_as_it_went() {
        let run = run(&[(Kind::Time, 0.1, 0.25), (Kind::Plain, 3.0, 0.0)]);
        let back: Run = serde_json::from_str(&run.to_json().unwrap()).unwrap();
        assert_eq!(back, run);
    }
}
