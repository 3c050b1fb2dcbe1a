//! The tables of docs/textures.md: `cargo run --release -p splat-bench --bin textures`.

#![forbid(unsafe_code)]
#![expect(clippy::print_stdout, reason = "what this program makes")]
#![expect(clippy::print_stderr, reason = "what it is about, since it takes minutes")]

mod markdown;
mod plot;

use anyhow::bail;
use splat_bench::textures::measure::{ANISOTROPIES, Effort, SETS};
use splat_bench::textures::{images, measure};

const USAGE: &str = "\
textures             the tables of docs/textures.md
textures --quick     the same of fewer lookups and repetitions
textures --plot FILE the tables, and a plot of those of the first image as SVG
textures --run FILTER ANISOTROPY COUNT
                     looks the first image up COUNT times, at the level of SPLAT_LEVEL: ns a lookup, for profilers";

const FULL: Effort = Effort { tiles: [64, 8], truths: 256, repetitions: 9 };
const QUICK: Effort = Effort { tiles: [16, 2], truths: 64, repetitions: 3 };

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let (effort, file) = match arguments[..] {
        [] => (FULL, None),
        ["--quick"] => (QUICK, None),
        ["--plot", file] => (FULL, Some(file)),
        ["--run", filter, anisotropy, count] => {
            let time = measure::run(
                &images::all(images::data().as_deref())?[0],
                filter,
                anisotropy.parse()?,
                count.parse()?,
            )?;
            println!("{time:.1}");
            return Ok(());
        }
        ["--help" | "-h"] => {
            println!("{USAGE}");
            return Ok(());
        }
        _ => bail!("found {arguments:?}, expected\n{USAGE}"),
    };
    let subjects = images::all(images::data().as_deref())?;
    if subjects.iter().all(|subject| subject.name != "photograph") {
        eprintln!("{}", images::skipped());
    }
    for (i, subject) in subjects.iter().enumerate() {
        for (j, (set, _)) in SETS.into_iter().enumerate() {
            let columns = ANISOTROPIES.map(|anisotropy| measure::column(subject, j, anisotropy, effort));
            println!("### {}, {set}\n", subject.name);
            println!("{}\n\n{}\n", markdown::times(&columns), markdown::errors(&columns));
            if let Some(file) = file.filter(|_| i == 0 && j == 0) {
                plot::write(file.as_ref(), subject.name, &columns)?;
            }
        }
    }
    Ok(())
}
