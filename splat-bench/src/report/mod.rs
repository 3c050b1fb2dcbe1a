//! Speed against error, as a page that anyone can make again.
//!
//! Every number of the page is computed in the run that writes it: the parts put their numbers into [`figures`], from which CSV
//! and JSON are written, and their tables and plots into a [`html::Section`].

mod baseline;
mod convergence;
mod figures;
mod fit;
mod hard;
mod html;
mod labels;
mod machine;
mod metrics;
mod parts;
mod plot;
mod readme;
mod scaling;
mod scenes;
mod textures;
mod truth;
mod whole;

use anyhow::{Context as _, bail};
use figures::Figures;
use readme::Readme;
pub use scaling::memory_of_arguments;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// What the command line asks for.
#[derive(Debug, Clone, PartialEq)]
pub struct Choices {
    quick: bool,
    out: PathBuf,
    data: Option<PathBuf>,
    cache: PathBuf,
    compare: Option<PathBuf>,
    readme: Option<PathBuf>,
}

impl Choices {
    /// The choices that these arguments make.
    ///
    /// # Errors
    /// If an argument is unknown, or lacks its value.
    pub fn parse(arguments: &[String]) -> anyhow::Result<Self> {
        let mut choices = Self {
            quick: false,
            out: "report".into(),
            data: std::env::var_os("SPLAT_TEST_DATA").filter(|value| !value.is_empty()).map(PathBuf::from),
            cache: default_cache(),
            compare: None,
            readme: None,
        };
        let mut arguments = arguments.iter();
        while let Some(argument) = arguments.next() {
            let mut value = || {
                arguments.next().map(PathBuf::from).with_context(|| format!("{argument}: expected a value"))
            };
            match argument.as_str() {
                "--quick" => choices.quick = true,
                "--out" => choices.out = value()?,
                "--data" => choices.data = Some(value()?),
                "--cache" => choices.cache = value()?,
                "--compare" => choices.compare = Some(value()?),
                "--readme" => choices.readme = Some(value()?),
                _ => bail!("found {argument:?}, expected\n{}", crate::USAGE),
            }
        }
        Ok(choices)
    }
}

/// A folder beside that of the program: within the build's own folder.
fn default_cache() -> PathBuf {
    let program = std::env::current_exe().ok();
    let target = program.as_deref().and_then(Path::parent).and_then(Path::parent);
    target.unwrap_or(Path::new(".")).join("report-cache")
}

/// What all parts share.
#[derive(Debug)]
pub struct Context {
    quick: bool,
    /// Frames of which the least time counts.
    repetitions: usize,
    /// Width of the pictures.
    width: u32,
    /// Side of the grid of samples in each half of the truth: 2 side^2 samples a pixel.
    truth_side: u32,
    cache: PathBuf,
    figures: Figures,
    start: Instant,
}

impl Context {
    /// Says how far it is.
    fn say(&self, what: &str) {
        eprintln!("{:6.1} s  {what}", self.start.elapsed().as_secs_f64());
    }
}

/// Measures, and writes the report.
///
/// # Errors
/// If something cannot be rendered, read or written.
pub fn run(choices: &Choices) -> anyhow::Result<()> {
    // What cannot be compared or written shall be known before minutes have passed.
    let before = choices.compare.as_deref().map(baseline::Run::read).transpose()?;
    let readme = choices.readme.as_deref().map(Readme::read).transpose()?;
    let quick = choices.quick;
    let mut context = Context {
        quick,
        repetitions: if quick { 3 } else { 4 },
        width: if quick { 128 } else { 480 },
        truth_side: 23,
        cache: choices.cache.clone(),
        figures: Figures::default(),
        start: Instant::now(),
    };
    let (scenes, left_out) = scenes::all(context.width, choices.data.as_deref())?;
    let sections = vec![
        whole::section(&scenes, &mut context)?,
        parts::section(&scenes, &mut context)?,
        textures::section(choices.data.as_deref(), &mut context)?,
        convergence::section(&mut context)?,
        hard::section(&mut context)?,
        scaling::section(&mut context)?,
    ];
    let machine = machine::describe();
    let names: Vec<&str> = scenes.iter().map(|scene| scene.name).collect();
    let run = baseline::Run {
        machine: machine.clone(),
        parameters: format!(
            "{} width {}, scenes: {}",
            if quick { "quick," } else { "full," },
            context.width,
            names.join(" ")
        ),
        figures: context.figures.clone(),
    };
    let seconds = context.start.elapsed().as_secs_f64();
    let mut introduction = vec![
        format!(
            "Made by `cargo run --release -p splat-bench -- report{}` in {seconds:.0} seconds. Every figure comes from this run.",
            if quick { " --quick" } else { "" }
        ),
        format!(
            "Machine: {machine}. Times are the least of repetitions that take turns; a machine with other work makes them longer."
        ),
    ];
    introduction.extend(left_out);
    write(choices, &run, &html::page("splat: speed against error", &introduction, &sections))?;
    println!("{}: report.html, report.csv, report.json, in {seconds:.0} s", choices.out.display());
    if let Some(readme) = readme {
        let quick = if quick { " --quick" } else { "" };
        let made = format!(
            "Frames of {} x {} on one thread: milliseconds, and the RMSE against pictures in `f64` of 1058 samples, by samples a pixel (spp), \
             everything else at its default. Made by `cargo run --release -p splat-bench -- report{quick} --readme README.md` on {machine}.",
            context.width,
            context.width * 9 / 16,
        );
        readme.write(&run.figures, &made)?;
    }
    if let Some(before) = before {
        print!("{}", baseline::compare(&before, &run)?.to_text());
    }
    Ok(())
}

fn write(choices: &Choices, run: &baseline::Run, page: &str) -> anyhow::Result<()> {
    let folder = &choices.out;
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let files = [
        ("report.html", page.to_owned()),
        ("report.csv", run.figures.to_csv()),
        ("report.json", run.to_json()?),
    ];
    for (name, content) in files {
        let path = folder.join(name);
        std::fs::write(&path, content).with_context(|| path.display().to_string())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_are_understood_or_refused() {
        let parse =
            |line: &str| Choices::parse(&line.split_whitespace().map(String::from).collect::<Vec<_>>());
        let choices = parse("--quick --out a --cache b --compare c --data d").unwrap();
        assert!(choices.quick);
        assert_eq!([&choices.out, &choices.cache], [Path::new("a"), Path::new("b")]);
        assert_eq!(choices.compare.as_deref(), Some(Path::new("c")));
        assert_eq!(choices.data.as_deref(), Some(Path::new("d")));
        assert!(parse("--slow").is_err());
        assert!(parse("--out").is_err());
    }
}
