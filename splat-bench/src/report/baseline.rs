//! Runs as JSON, and what became worse from one to another.

use super::figures::{Figure, Figures, Kind};
use super::plot::number;
use anyhow::{Context, bail};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::path::Path;

/// A time counts as slower beyond this part of itself, or twice the noise of both runs, whichever is more.
const TIME: f64 = 0.10;

/// The same of memory.
const MEMORY: f64 = 0.05;

/// An error depends on nothing but the program: what differs by more than this part was changed by someone.
const ERROR: f64 = 0.01;

/// Errors below this are rounding, and no matter.
const NEGLIGIBLE: f64 = 1e-12;

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
    let mut changes = Changes::default();
    for figure in &now.figures.all {
        let Some(old) = old.get(&name(figure)) else { continue };
        changes.compared += 1;
        let tolerance = match figure.kind {
            Kind::Plain => continue,
            Kind::Time => TIME.max(2.0 * (figure.noise + old.noise)),
            Kind::Memory => MEMORY,
            Kind::Error => ERROR.max(figure.noise + old.noise),
        };
        let change = || Change { figure: figure.clone(), before: old.value };
        if figure.value > old.value * (1.0 + tolerance) + NEGLIGIBLE {
            changes.worse.push(change());
        } else if old.value > figure.value * (1.0 + tolerance) + NEGLIGIBLE {
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
        format!("{} figures compared\n{worse}{better}", self.compared)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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

    #[test]
    fn what_became_worse_is_named() {
        let before = run(&[(Kind::Time, 10.0, 0.0), (Kind::Error, 1e-3, 0.0), (Kind::Memory, 8.0, 0.0)]);
        let now = run(&[(Kind::Time, 12.0, 0.0), (Kind::Error, 2e-3, 0.0), (Kind::Memory, 7.0, 0.0)]);
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
