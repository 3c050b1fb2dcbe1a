//! What a run has measured: a flat list of figures, from which tables, plots, CSV and JSON are made.

use serde::{Deserialize, Serialize};

/// What a figure is about, which decides how two runs are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// A time: less is better; it has noise.
    Time,
    /// Memory: less is better.
    Memory,
    /// An error: less is better; it is the same in every run of the same program.
    Error,
    /// Neither better nor worse.
    Plain,
}

/// A measured number.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// The part of the report.
    pub section: String,
    /// The scene, or what else was measured.
    pub subject: String,
    /// How it was set.
    pub setting: String,
    /// What the number is, with its unit.
    pub quantity: String,
    /// What it is about.
    pub kind: Kind,
    /// The number.
    pub value: f64,
    /// How far it may move from run to run, relative to itself.
    pub noise: f64,
}

/// All figures of a run, in the order of their measurement.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// The figures.
    pub all: Vec<Figure>,
}

impl Figures {
    /// Notes a figure without noise.
    pub fn note(&mut self, [section, subject, setting, quantity]: [&str; 4], kind: Kind, value: f64) {
        self.note_noisy([section, subject, setting, quantity], kind, value, 0.0);
    }

    /// Notes a figure.
    pub fn note_noisy(
        &mut self,
        [section, subject, setting, quantity]: [&str; 4],
        kind: Kind,
        value: f64,
        noise: f64,
    ) {
        self.all.push(Figure {
            section: section.into(),
            subject: subject.into(),
            setting: setting.into(),
            quantity: quantity.into(),
            kind,
            value,
            noise,
        });
    }

    /// All figures as comma-separated values, with a line of names.
    pub fn to_csv(&self) -> String {
        let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
        let mut csv = String::from("section,subject,setting,quantity,value,noise\n");
        for figure in &self.all {
            let names = [&figure.section, &figure.subject, &figure.setting, &figure.quantity];
            let names = names.map(|name| quoted(name)).join(",");
            csv += &format!("{names},{:e},{:e}\n", figure.value, figure.noise);
        }
        csv
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn csv_has_a_line_a_figure() {
        let mut figures = Figures::default();
        figures.note(["a", "b", "c \"d\", e", "f"], Kind::Error, 0.25);
        assert_eq!(
            figures.to_csv(),
            "section,subject,setting,quantity,value,noise\n\"a\",\"b\",\"c \"\"d\"\", e\",\"f\",2.5e-1,0e0\n"
        );
    }
}
