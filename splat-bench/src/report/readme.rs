//! The README's table and plot: error against time for several numbers of samples.

use super::figures::Figures;
use super::plot::{Plot, Series, number};
use super::whole;
use anyhow::Context;
use std::path::{Path, PathBuf};

/// The lines between which a README holds what is written here.
const MARKERS: [&str; 2] = ["<!-- report:begin -->", "<!-- report:end -->"];

/// Where the plot goes, from the README's folder.
const PLOT: &str = "docs/images/report.svg";

/// Numbers of samples of the table.
const SAMPLES: [u32; 4] = [1, 4, 16, 64];

/// A README that has a place for the table.
#[derive(Debug)]
pub struct Readme {
    path: PathBuf,
    /// What stands before the first marker, and from the second one on.
    around: [String; 2],
}

impl Readme {
    /// Reads it.
    ///
    /// # Errors
    /// If it cannot be read, or does not have both markers, one after the other.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
        let around = split(&text)
            .with_context(|| format!("{}: expected {} and {}", path.display(), MARKERS[0], MARKERS[1]))?;
        Ok(Self { path: path.to_owned(), around })
    }

    /// Writes the table between the markers, and the plot beside them.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(&self, figures: &Figures, made: &str) -> anyhow::Result<()> {
        let plot = self.path.parent().unwrap_or(Path::new(".")).join(PLOT);
        let [before, after] = &self.around;
        let text = format!("{before}{}\n{}{after}", MARKERS[0], table(figures, made));
        for (path, content) in [(plot, picture(figures).to_svg()), (self.path.clone(), text)] {
            std::fs::write(&path, content).with_context(|| path.display().to_string())?;
        }
        Ok(())
    }
}

/// What stands before the first marker, and from the second one on.
fn split(text: &str) -> Option<[String; 2]> {
    let (before, rest) = text.split_once(MARKERS[0])?;
    let end = rest.find(MARKERS[1])?;
    Some([before.to_owned(), rest[end..].to_owned()])
}

/// The scenes, in the order of the report.
fn scenes(figures: &Figures) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for figure in figures.all.iter().filter(|figure| figure.section == whole::SECTION) {
        if !names.contains(&figure.subject.as_str()) {
            names.push(&figure.subject);
        }
    }
    names
}

/// What was measured of a scene with so many samples.
fn of(figures: &Figures, scene: &str, samples: u32, quantity: &str) -> Option<f64> {
    let setting = format!("samples: {samples}");
    let names = [whole::SECTION, scene, &setting, quantity];
    let found = figures.all.iter().find(|figure| {
        [&figure.section, &figure.subject, &figure.setting, &figure.quantity].map(String::as_str) == names
    });
    found.map(|figure| figure.value)
}

fn table(figures: &Figures, made: &str) -> String {
    let mut text = format!("{made}\n\n| scene |");
    for samples in SAMPLES {
        text += &format!(" {samples} spp: ms | RMSE |");
    }
    text += &format!("\n|---|{}", "---|---|".repeat(SAMPLES.len()));
    for scene in scenes(figures) {
        text += &format!("\n| {scene} |");
        for samples in SAMPLES {
            for quantity in ["time, ms", "RMSE"] {
                let value = of(figures, scene, samples, quantity).map_or("-".into(), number);
                text += &format!(" {value} |");
            }
        }
    }
    text + &format!(
        "\n\n![RMSE against the time of a frame, a line a scene, a point a number of samples]({PLOT})\n"
    )
}

fn picture(figures: &Figures) -> Plot {
    let series = scenes(figures).into_iter().map(|scene| {
        let points = [1, 2, 4, 8, 16, 32, 64].into_iter().filter_map(|samples| {
            let value = |quantity| of(figures, scene, samples, quantity);
            Some((value("time, ms")?, value("RMSE")?, samples.to_string()))
        });
        Series { name: scene.into(), points: points.collect(), joined: true, rings: false }
    });
    Plot {
        title: "Error against time; the numbers are samples a pixel".into(),
        axes: ["time of a frame, ms, one thread".into(), "RMSE".into()],
        series: series.collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::figures::Kind;

    #[test]
    fn the_table_stands_between_the_markers() {
        let [before, after] = split("a\n<!-- report:begin -->\nold\n<!-- report:end -->\nb").unwrap();
        assert_eq!([before.as_str(), after.as_str()], ["a\n", "<!-- report:end -->\nb"]);
        assert!(split("<!-- report:end --> <!-- report:begin -->").is_none());
        assert!(split("nothing").is_none());
    }

    #[test]
    fn every_scene_has_a_row_and_a_line() {
        let mut figures = Figures::default();
        for scene in ["one", "two"] {
            for (samples, time) in [(1, 2.5), (4, 3.5)] {
                let setting = format!("samples: {samples}");
                figures.note([whole::SECTION, scene, &setting, "time, ms"], Kind::Time, time);
                figures.note([whole::SECTION, scene, &setting, "RMSE"], Kind::Error, 0.1 / time);
            }
        }
        let text = table(&figures, "made by hand");
        assert!(text.contains("| one | 2.5 | 0.04 | 3.5 |"), "{text}");
        assert_eq!(picture(&figures).series.iter().map(|s| s.points.len()).sum::<usize>(), 4);
    }
}
