//! The tables of docs/benchmarks.md: `cargo run --release -p splat-bench --bin table`.
//!
//! Real clouds are measured where `SPLAT_TEST_DATA` names a folder of them, and else left out.

#![forbid(unsafe_code)]
#![expect(clippy::print_stdout, reason = "what this program makes")]
#![expect(clippy::print_stderr, reason = "what it is about, since it takes minutes")]

mod markdown;
mod measure;

use anyhow::{Context, bail};
use splat_bench::{Case, Subject, memory};

const USAGE: &str = "\
table                  the tables of docs/benchmarks.md
table --quick          the same of the smaller sphere at 8 samples and the real clouds, fewer repetitions
table CASE..           the same of some cases
table --frame CASE N   renders a frame N times on one thread at the level of SPLAT_LEVEL; the least times
table --raster CASE N  the raster alone
table --memory CASE    bytes that a frame on two threads takes beyond cloud and picture";

/// Repetitions of which the least time counts.
const REPETITIONS: usize = 5;

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match arguments[..] {
        [] => tables(&all(), REPETITIONS)?,
        ["--quick"] => {
            let is_quick =
                |case: &Case| case.subject != Subject::Sphere(1000) && (case.samples == 8 || is_real(case));
            tables(&all().into_iter().filter(is_quick).collect::<Vec<_>>(), 2)?;
        }
        ["--frame", name, count] => println!("{}", measure::frames(Case::named(name)?, count.parse()?)?),
        ["--raster", name, count] => println!("{}", measure::rasters(Case::named(name)?, count.parse()?)?),
        ["--memory", name] => println!("{}", memory_of(Case::named(name)?)?),
        ["--help" | "-h"] => println!("{USAGE}"),
        ref names if names.iter().all(|name| !name.starts_with('-')) => {
            let cases = names.iter().map(|name| Case::named(name)).collect::<anyhow::Result<Vec<_>>>()?;
            tables(&cases, REPETITIONS)?;
        }
        _ => bail!("found {arguments:?}, expected\n{USAGE}"),
    }
    Ok(())
}

fn all() -> Vec<Case> {
    Subject::ALL.into_iter().flat_map(Subject::cases).collect()
}

fn is_real(case: &Case) -> bool {
    matches!(case.subject, Subject::Dragon | Subject::Pond)
}

/// Bytes that a frame of a case takes on two threads.
fn memory_of(case: Case) -> anyhow::Result<u64> {
    let cloud = case.subject.cloud()?.with_context(|| case.subject.skipped())?;
    let scene = case.scene(&cloud)?;
    memory::of_frame(&cloud, &scene.camera, &scene.options, 2)
}

/// Measures cases, and prints the tables.
fn tables(cases: &[Case], repetitions: usize) -> anyhow::Result<()> {
    let mut all = Vec::new();
    // Cases of the same subject stand together, and share its cloud.
    for cases in cases.chunk_by(|a, b| a.subject == b.subject) {
        let subject = cases[0].subject;
        let Some(cloud) = subject.cloud()? else {
            eprintln!("{}", subject.skipped());
            continue;
        };
        for &case in cases {
            let memory = memory::of_child(&["--memory", &case.to_string()]);
            let measured = measure::Measured { memory, ..measure::case(case, &cloud, repetitions)? };
            // Not to be lost if the rest is given up.
            eprintln!("{}", markdown::tables(std::slice::from_ref(&measured)));
            all.push(measured);
        }
    }
    println!("{}", markdown::tables(&all));
    Ok(())
}
