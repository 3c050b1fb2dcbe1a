//! The benchmarks' program: `cargo run --release -p splat-bench -- report`.

#![forbid(unsafe_code)]
#![expect(clippy::print_stdout, reason = "what this program says")]
#![expect(clippy::print_stderr, reason = "how far it is, since it takes minutes")]

mod report;

use anyhow::bail;

const USAGE: &str = "\
report                  measures speed against error, and writes report.html, report.csv and report.json
  --quick               a smaller picture, fewer settings and repetitions: less than a minute
  --out FOLDER          where they go (default: report)
  --data FOLDER         a folder with surfels/, for the dragon and the pond (default: SPLAT_TEST_DATA)
  --cache FOLDER        where the true pictures are kept between runs (default: report-cache beside the program's folder)
  --readme FILE         also writes the table between the markers of a README, and docs/images/report.svg beside it
  --compare FILE        the report.json of another run: prints what became slower or less accurate beyond noise";

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.split_first() {
        Some((command, rest)) if command == "report" => report::run(&report::Choices::parse(rest)?),
        // What the report asks a process of its own.
        Some((command, rest)) if command == "memory" => {
            println!("{}", report::memory_of_arguments(rest)?);
            Ok(())
        }
        Some((help, _)) if help == "--help" || help == "-h" => {
            println!("{USAGE}");
            Ok(())
        }
        _ => bail!("found {arguments:?}, expected\n{USAGE}"),
    }
}
