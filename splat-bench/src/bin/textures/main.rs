//! The tables of docs/textures.md: `cargo run --release -p splat-bench --bin textures`.

#![forbid(unsafe_code)]
#![expect(clippy::print_stdout, reason = "what this program makes")]
#![expect(clippy::print_stderr, reason = "what it is about, since it takes minutes")]

mod images;
mod markdown;
mod measure;

use anyhow::bail;
use measure::{ANISOTROPIES, Column, Effort, SETS};

const USAGE: &str = "\
textures             the tables of docs/textures.md
textures --quick     the same of fewer lookups and repetitions
textures --run FILTER ANISOTROPY COUNT
                     looks the first image up COUNT times, at the level of SPLAT_LEVEL: ns a lookup, for profilers";

const FULL: Effort = Effort { tiles: [64, 8], truths: 256, repetitions: 9 };
const QUICK: Effort = Effort { tiles: [16, 2], truths: 64, repetitions: 3 };

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let effort = match arguments[..] {
        [] => FULL,
        ["--quick"] => QUICK,
        ["--run", filter, anisotropy, count] => {
            let time = measure::run(&images::all()?[0], filter, anisotropy.parse()?, count.parse()?)?;
            println!("{time:.1}");
            return Ok(());
        }
        ["--help" | "-h"] => {
            println!("{USAGE}");
            return Ok(());
        }
        _ => bail!("found {arguments:?}, expected\n{USAGE}"),
    };
    let subjects = images::all()?;
    if subjects.iter().all(|subject| subject.name != "photograph") {
        eprintln!("{}", images::skipped());
    }
    for subject in &subjects {
        for set in 0..SETS.len() {
            let columns: Vec<Column> = ANISOTROPIES
                .map(|anisotropy| measure::column(subject, set, anisotropy, effort))
                .into_iter()
                .collect();
            let columns: Vec<&Column> = columns.iter().collect();
            println!("\n### {}, {}\n", subject.name, SETS[set].0);
            println!("{}\n\n{}", markdown::times(&columns), markdown::errors(&columns));
        }
    }
    Ok(())
}
