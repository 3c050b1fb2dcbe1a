//! `splat prepare`: a cloud that lacks something in, a complete one out. And the options that render shares with it.

use crate::arguments::{ReadArguments, TalkArguments};
use crate::choices::{KernelChoice, UpChoice};
use crate::inputs::{self, Reading, Sampling};
use crate::memory::Memory;
use crate::progress::Progress;
use crate::usage::UsageError;
use crate::{output, resolve, strict, values};
use clap::{Args, ValueEnum};
use glam::DVec3;
use splat_core::Cloud;
use splat_core::fit::Up;
use splat_core::prepare::{Estimated, Orientation, Outliers, PrepareOptions, prepare};
use splat_io::{PlyEncoding, write_ply};
use std::fmt::Write;
use std::path::PathBuf;
use std::time::Instant;

/// `splat prepare`.
#[derive(Debug, Args)]
pub struct PrepareArguments {
    /// Clouds and meshes, as for render; several become one cloud
    #[arg(required = true, value_name = "IN")]
    pub inputs: Vec<PathBuf>,
    /// The complete cloud: .ply
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// How files are read.
    #[command(flatten)]
    pub reading: ReadArguments,
    /// What is estimated, and how.
    #[command(flatten)]
    pub preparation: PreparationArguments,
    /// The axis that points up [default: as render]
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true)]
    pub up: Option<UpChoice>,
    /// The kernel for which the areas are right
    #[arg(long, value_name = "KERNEL", default_value = "windowed")]
    pub kernel: KernelChoice,
    /// Its cutoff F
    #[arg(long, value_name = "F", value_parser = values::cutoff, default_value_t = 4.0)]
    pub cutoff: f64,
    /// Write text instead of binary numbers
    #[arg(long)]
    pub ascii: bool,
    /// Threads; 0 is one a processor
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub threads: usize,
    /// How much memory may be used.
    #[command(flatten, next_help_heading = "Program")]
    pub memory: Memory,
    /// How talkative the program is.
    #[command(flatten, next_help_heading = "Program")]
    pub talk: TalkArguments,
}

/// How what a cloud lacks is estimated.
#[derive(Debug, Clone, Copy, PartialEq, Args)]
pub struct PreparationArguments {
    /// Neighbours from which a normal is estimated, 3 to 256: more for noisy scans, fewer for fine detail
    #[arg(long, value_name = "K", value_parser = values::count::<3>, default_value_t = PrepareOptions::default().normals_k)]
    pub normals_k: usize,
    /// How normals without sides get them; without, both sides of a splat look alike
    #[arg(long, value_name = "HOW", default_value = "none", conflicts_with = "viewpoint")]
    pub orient: OrientChoice,
    /// Where the scanner stood: normals without sides are turned there
    #[arg(long, value_name = "X,Y,Z", value_parser = values::point, allow_hyphen_values = true)]
    pub viewpoint: Option<DVec3>,
    /// Sigma of all round splats, in scene units, in place of those given and estimated
    #[arg(long, value_name = "R", value_parser = values::positive)]
    pub radius: Option<f64>,
    /// Neighbours from which a size is estimated, 1 to 256
    #[arg(long, value_name = "K", value_parser = values::count::<1>, default_value_t = PrepareOptions::default().radius_k)]
    pub radius_k: usize,
    /// Factor on all sizes, given and estimated
    #[arg(long, value_name = "FACTOR", value_parser = values::positive, default_value_t = 1.0)]
    pub radius_scale: f64,
    /// Stray points to drop: none, statistical or statistical:K,SIGMAS, radius:R,N
    ///
    /// statistical drops points whose mean distance to K neighbours (default 8) is more than SIGMAS standard deviations
    /// (default 3) above the mean of all; radius drops those with fewer than N others within R scene units.
    #[arg(long, value_name = "FILTER", value_parser = values::outliers, default_value = "none", verbatim_doc_comment)]
    pub outliers: Outliers,
}

/// `--orient`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub enum OrientChoice {
    /// No sides
    #[default]
    None,
    /// Up, for scans from the air
    Up,
    /// Alike from neighbour to neighbour; the highest point of each part looks up
    Graph,
}

impl PreparationArguments {
    /// The options that these arguments mean for a cloud whose axis `up` points up.
    pub fn options(&self, up: Up) -> PrepareOptions {
        let [up, ..] = up.axes();
        let orientation = match (self.viewpoint, self.orient) {
            (Some(viewpoint), _) => Orientation::Viewpoint(viewpoint),
            (None, OrientChoice::None) => Orientation::TwoSided,
            (None, OrientChoice::Up) => Orientation::Direction(up),
            (None, OrientChoice::Graph) => Orientation::Graph(up),
        };
        PrepareOptions {
            normals_k: self.normals_k,
            orientation,
            radius: self.radius,
            radius_k: self.radius_k,
            size_scale: self.radius_scale,
            outliers: self.outliers,
            ..PrepareOptions::default()
        }
    }

    /// The options other than the default ones, as the command line has them.
    pub fn describe(&self) -> String {
        let default = PrepareOptions::default();
        let mut text = String::new();
        let mut add = |is_default: bool, option: String| {
            if !is_default {
                _ = write!(text, " {option}");
            }
        };
        add(self.normals_k == default.normals_k, format!("--normals-k {}", self.normals_k));
        let orient =
            self.orient.to_possible_value().map_or(String::new(), |value| value.get_name().to_owned());
        add(self.orient == OrientChoice::None, format!("--orient {orient}"));
        if let Some(DVec3 { x, y, z }) = self.viewpoint {
            add(false, format!("--viewpoint {x},{y},{z}"));
        }
        if let Some(radius) = self.radius {
            add(false, format!("--radius {radius}"));
        }
        add(self.radius_k == default.radius_k, format!("--radius-k {}", self.radius_k));
        add(self.radius_scale == 1.0, format!("--radius-scale {}", self.radius_scale));
        match self.outliers {
            Outliers::Keep => {}
            Outliers::Statistical { neighbors, sigmas } => {
                add(false, format!("--outliers statistical:{neighbors},{sigmas}"));
            }
            Outliers::Radius { radius, count } => add(false, format!("--outliers radius:{radius},{count}")),
        }
        text
    }
}

/// What was estimated, for people: `None` if the cloud lacked nothing.
pub fn in_words(estimated: &Estimated, options: &PrepareOptions) -> Option<String> {
    let Estimated { outliers, normals, sides, sizes, areas } = *estimated;
    let sides = match (sides, options.orientation) {
        (false, _) | (_, Orientation::TwoSided) => None,
        (_, Orientation::Viewpoint(_)) => Some("sides (towards the viewpoint)"),
        (_, Orientation::Direction(_)) => Some("sides (up)"),
        (_, Orientation::Graph(_)) => Some("sides (from neighbour to neighbour)"),
    };
    let parts = [
        normals.then(|| format!("normals from {} neighbours", options.normals_k)),
        sides.map(str::to_owned),
        (sizes > 0).then(|| format!("{sizes} sizes from {} neighbours", options.radius_k)),
        areas.then(|| "areas".to_owned()),
    ];
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    let mut text = if parts.is_empty() { String::new() } else { format!("estimated {}", parts.join(", ")) };
    if outliers > 0 {
        let comma = if text.is_empty() { "" } else { "; " };
        _ = write!(text, "{comma}{outliers} outliers dropped");
    }
    (!text.is_empty()).then_some(text)
}

/// Lets preparation run on so many threads (0: one a processor).
pub fn use_threads(threads: usize) {
    // The only failure is that the threads are there already: this is done once a run of the program.
    _ = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
}

/// Runs the command.
///
/// # Errors
/// The first thing that goes wrong.
pub fn run(arguments: &PrepareArguments) -> anyhow::Result<()> {
    let start = Instant::now();
    let console = arguments.talk.console();
    let progress = Progress::new(arguments.talk.progress, console.quiet);
    let path = &arguments.output;
    if path.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("ply")) {
        return Err(UsageError::new(format!("{}: expected a name that ends in .ply", path.display())).into());
    }
    output::spare_inputs(path, &arguments.inputs)?;
    output::check_file(path)?;
    use_threads(arguments.threads);

    let reading = Reading::new(Sampling::default(), false, &arguments.reading, arguments.memory);
    let (input, _) = progress.stage("read", |update| inputs::read(&arguments.inputs, &reading, update));
    let (mut cloud, reports) = input?;
    for report in &reports {
        for assumption in &report.assumptions {
            console.note(format_args!("{}: {assumption}", report.path.display()));
        }
    }
    let options = PrepareOptions {
        kernel: arguments.kernel.into(),
        cutoff: arguments.cutoff,
        ..arguments.preparation.options(up(arguments, &cloud))
    };
    arguments.memory.check_preparation(&cloud, &options)?;
    let (estimated, _) = progress.stage("prepare", |update| prepare(&mut cloud, &options, update));
    inputs::check_usable(&cloud, &reports)?;
    if arguments.reading.strict {
        strict::check_complete(&mut cloud, &reports)?;
    }
    if cloud.outliers.is_some() {
        arguments.memory.check_copy([&cloud])?;
    }
    cloud.remove_outliers();
    let encoding = if arguments.ascii { PlyEncoding::Ascii } else { PlyEncoding::Binary };
    let (written, _) = progress.stage("write", |_| write_ply(path, &cloud, encoding));
    written?;
    let seconds = start.elapsed().as_secs_f64();
    let done = in_words(&estimated, &options).unwrap_or_else(|| "nothing was missing".to_owned());
    console.summary(format_args!("{}: {} points; {done}; {seconds:.1} s", path.display(), cloud.len()));
    Ok(())
}

fn up(arguments: &PrepareArguments, cloud: &Cloud) -> Up {
    arguments.up.map_or_else(|| resolve::assumed_up(cloud), Up::from)
}
