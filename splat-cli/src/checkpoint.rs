//! Checkpoints: what is finished of a long picture, or of a sequence of pictures, kept beside it now and then.
//!
//! A picture's checkpoint holds its finished tiles ([`splat_io::checkpoint`]). That of a sequence is a text that names the
//! pictures which are complete. Neither is more than a help: where one cannot be written the work goes on without.

use crate::arguments::{MaterialArguments, RenderArguments};
use crate::console::Console;
use crate::scene;
use clap::Args;
use splat_core::setup::View;
use splat_core::{Camera, Film, RenderOptions, Unfinished};
use splat_io::{
    AtomicFile, Error, Identity, ImportReport, hash_file, hash_text, read_checkpoint, write_checkpoint,
};
use std::cell::OnceCell;
use std::collections::HashSet;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// When checkpoints are made and used.
#[derive(Debug, Clone, Args)]
pub struct CheckpointArguments {
    /// Go on where a run of the same command was stopped: from OUT.checkpoint; pictures of a sequence that are complete are
    /// skipped
    #[arg(long)]
    pub resume: bool,
    /// Seconds of rendering between two checkpoints, OUT.checkpoint beside the picture, which is removed once that is complete;
    /// 0 is none
    #[arg(long, value_name = "SECONDS", value_parser = crate::values::seconds, default_value = "30")]
    pub checkpoint: Duration,
}

/// A checkpoint comes no sooner than this many times as long as the last one took: so all together cost less than 2 % of the
/// time.
const REST: u32 = 50;

/// When the next checkpoint is due.
#[derive(Debug)]
struct Schedule {
    /// Zero: never.
    interval: Duration,
    next: Instant,
}

impl Schedule {
    fn new(interval: Duration) -> Self {
        Self { interval, next: Instant::now() + interval }
    }

    fn is_due(&self) -> bool {
        !self.interval.is_zero() && Instant::now() >= self.next
    }

    /// Does the work of a checkpoint; if it fails, the last one.
    fn run(&mut self, path: &Path, console: Console, work: impl FnOnce() -> Result<(), Error>) {
        let start = Instant::now();
        match work() {
            Ok(()) => self.next = Instant::now() + self.interval.max(REST * start.elapsed()),
            Err(error) => {
                console.warn(format_args!("{}: no more checkpoints: {error}", path.display()));
                self.interval = Duration::ZERO;
            }
        }
    }
}

/// The checkpoints of a command line.
#[derive(Debug)]
pub struct Checkpoints<'a> {
    arguments: &'a RenderArguments,
    reports: &'a [ImportReport],
    console: Console,
    /// The hash of all inputs.
    inputs: OnceCell<[u8; 32]>,
}

impl<'a> Checkpoints<'a> {
    /// Those of pictures of these inputs.
    pub fn new(arguments: &'a RenderArguments, reports: &'a [ImportReport]) -> Self {
        Self { arguments, reports, console: arguments.talk.console(), inputs: OnceCell::new() }
    }

    /// That of a picture, to be asked for before its first tile.
    pub fn of(&self, picture: &Path, camera: &Camera) -> Checkpoint<'_> {
        let schedule = Schedule::new(self.arguments.checkpoint.checkpoint);
        Checkpoint { all: self, path: beside(picture), camera: camera.clone(), schedule }
    }

    /// That of a sequence of pictures.
    ///
    /// # Errors
    /// One that is to be read and cannot.
    pub fn of_sequence(&self) -> anyhow::Result<Sequence<'_>> {
        let path = beside(&self.arguments.picture());
        let complete = match self.arguments.checkpoint.resume.then(|| std::fs::read(&path)) {
            Some(Ok(bytes)) => String::from_utf8_lossy(&bytes).lines().map(str::to_owned).collect(),
            Some(Err(error)) if error.kind() != std::io::ErrorKind::NotFound => {
                anyhow::bail!("{}: cannot read: {error}", path.display())
            }
            _ => HashSet::new(),
        };
        let schedule = Schedule::new(self.arguments.checkpoint.checkpoint);
        Ok(Sequence { all: self, path, complete, pending: Vec::new(), schedule })
    }

    /// What a picture by this camera is a function of.
    fn identity(&self, camera: &Camera) -> Result<Identity, Error> {
        let inputs = match self.inputs.get() {
            Some(known) => *known,
            None => {
                let hash = self.hash_inputs()?;
                *self.inputs.get_or_init(|| hash)
            }
        };
        let RenderArguments { reading, camera: cameras, samples, splats, preparation, material, .. } =
            self.arguments;
        let options = (reading, cameras.up, samples, splats, preparation, material);
        let outputs = (self.arguments.outputs.aov, self.arguments.outputs.engine, &self.arguments.scene);
        Ok(Identity {
            program: hash_text(concat!("splat ", env!("CARGO_PKG_VERSION"))),
            inputs,
            camera: hash_text(&format!("{camera:?}")),
            options: hash_text(&format!("{options:?} {outputs:?}")),
        })
    }

    /// The hash of the clouds' and the images' contents.
    fn hash_inputs(&self) -> Result<[u8; 32], Error> {
        let mut hashes: Vec<String> = self.reports.iter().map(|report| report.sha256.clone()).collect();
        // What is wrong with a source was said when it was read.
        let sources = scene::sources(self.arguments).unwrap_or_default();
        let materials = sources.iter().map(|source| &source.settings.material);
        for image in materials.chain([&self.arguments.material]).flat_map(MaterialArguments::images) {
            hashes.push(hash_file(image)?);
        }
        Ok(hash_text(&hashes.join(" ")))
    }
}

/// Where the checkpoint of a picture is: beside it.
pub fn beside(picture: &Path) -> PathBuf {
    let mut name = picture.as_os_str().to_owned();
    name.push(".checkpoint");
    name.into()
}

/// The checkpoint of a picture.
#[derive(Debug)]
pub struct Checkpoint<'a> {
    all: &'a Checkpoints<'a>,
    path: PathBuf,
    camera: Camera,
    schedule: Schedule,
}

impl Checkpoint<'_> {
    /// What an earlier run has finished of the picture, if that is asked for and there is such a thing. A damaged one is as
    /// none.
    ///
    /// # Errors
    /// A checkpoint of another picture; what the system says; too little memory.
    pub fn begun(&self, options: &RenderOptions) -> anyhow::Result<Option<Unfinished>> {
        let console = self.all.console;
        let path = self.path.display();
        if !self.all.arguments.checkpoint.resume {
            if self.path.exists() {
                console.note(format_args!("{path}: --resume would go on from it"));
            }
            return Ok(None);
        }
        if !self.path.exists() {
            console.note(format_args!("{path}: there is none, so the picture is begun"));
            return Ok(None);
        }
        let frame = [self.camera.width, self.camera.height];
        let window = View::new(&self.camera, options).window;
        if window.area().saturating_mul(options.film_bytes_per_pixel()) > options.memory {
            // It is refused at once, by whom knows the words.
            return Ok(None);
        }
        let empty = Film::for_picture(frame, window, options)?;
        match read_checkpoint(&self.path, &self.all.identity(&self.camera)?, empty) {
            Ok(unfinished) => {
                console.summary(format_args!("{path}: the picture goes on from here"));
                Ok(Some(unfinished))
            }
            Err(error @ Error::Invalid { .. }) => {
                console.warn(format_args!("{error}; the picture is begun again"));
                Ok(None)
            }
            Err(error) => Err(error.into()),
        }
    }

    /// Keeps what is finished, if it is time.
    pub fn keep(&mut self, unfinished: &Unfinished) {
        if unfinished.tiles == 0 || !self.schedule.is_due() {
            return;
        }
        let Self { all, path, camera, schedule } = self;
        schedule.run(path, all.console, || write_checkpoint(path, &all.identity(camera)?, unfinished));
    }

    /// The picture is complete.
    pub fn remove(self) {
        remove(&self.path, self.all.arguments);
    }
}

/// Removes a checkpoint that has served, unless there are none to be.
fn remove(path: &Path, arguments: &RenderArguments) {
    if arguments.checkpoint.resume || !arguments.checkpoint.checkpoint.is_zero() {
        // There is none of a short picture; and one that cannot be removed is refused or overwritten by the next run.
        _ = std::fs::remove_file(path);
    }
}

/// The checkpoint of a sequence of pictures: a line each, with what it is of, the hash of its file, and the file's name.
#[derive(Debug)]
pub struct Sequence<'a> {
    all: &'a Checkpoints<'a>,
    path: PathBuf,
    /// Its lines. One that is damaged is of no picture.
    complete: HashSet<String>,
    /// Pictures that are not yet among them.
    pending: Vec<(PathBuf, Camera)>,
    schedule: Schedule,
}

impl Sequence<'_> {
    /// Whether a picture was completed by an earlier run, and is still there.
    pub fn has(&self, picture: &Path, camera: &Camera) -> bool {
        let line = || self.line(picture, camera);
        !self.complete.is_empty() && line().is_ok_and(|line| self.complete.contains(&line))
    }

    /// Adds a picture that is complete.
    pub fn add(&mut self, picture: PathBuf, camera: Camera) {
        self.pending.push((picture, camera));
        if !self.schedule.is_due() {
            return;
        }
        let pending = std::mem::take(&mut self.pending);
        let lines = pending.iter().map(|(picture, camera)| self.line(picture, camera));
        match lines.collect::<Result<Vec<String>, Error>>() {
            Ok(lines) => self.complete.extend(lines),
            // Somebody takes pictures away; those count as unfinished.
            Err(error) => self.all.console.note(error),
        }
        let Self { all, path, complete, schedule, .. } = self;
        schedule.run(path, all.console, || write_lines(path, complete));
    }

    /// All pictures are complete.
    pub fn remove(self) {
        remove(&self.path, self.all.arguments);
    }

    fn line(&self, picture: &Path, camera: &Camera) -> Result<String, Error> {
        let name = picture.file_name().unwrap_or_default().to_string_lossy().replace(['\n', '\r'], " ");
        Ok(format!("{} {} {name}", self.all.identity(camera)?.to_hexadecimal(), hash_file(picture)?))
    }
}

fn write_lines(path: &Path, lines: &HashSet<String>) -> Result<(), Error> {
    let mut lines: Vec<&str> = lines.iter().map(String::as_str).collect();
    lines.sort_unstable();
    let mut file = AtomicFile::create(path)?;
    let text = lines.join("\n") + "\n";
    file.write_all(text.as_bytes()).map_err(|cause| Error::Io {
        path: path.to_owned(),
        action: "write",
        cause,
    })?;
    file.commit()
}
