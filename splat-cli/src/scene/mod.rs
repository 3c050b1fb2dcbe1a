//! Scene files: what a command line says, in a file that one keeps.
//!
//! A setting of a scene file is an option of `splat render`: its table is the heading under which `--help` lists the
//! option. So a scene file becomes a command line, and is checked like one. What the command line itself says wins,
//! also over settings that contradict it.

mod print;

use crate::arguments::{Arguments, CloudArguments, Command, RenderArguments};
use crate::usage::UsageError;
use crate::{describe, material, resolve};
use anyhow::{anyhow, bail};
use clap::builder::ValueParser;
use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, CommandFactory, FromArgMatches, Parser};
use glam::DAffine3;
use splat_core::placement::scale_of;
use splat_io::read_scene;
use splat_io::scene_file::{CloudEntry, SceneFile, Section, Setting, Value};
use std::collections::HashSet;
use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};

/// A scene file that was read.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// The file.
    pub path: PathBuf,
    /// What it holds; paths of clouds are relative to the file's folder.
    pub file: SceneFile,
}

/// An input: a cloud's file, where the cloud stands, and what else is said of it.
#[derive(Debug, Clone)]
pub struct Source {
    /// The file.
    pub path: PathBuf,
    /// Where the cloud stands.
    pub to_world: DAffine3,
    /// What is said of it alone; of all clouds what the options say.
    pub settings: CloudArguments,
}

impl Source {
    /// Whether anything is said of it that is not said of all, or its shape is changed.
    pub fn is_special(&self) -> bool {
        let CloudArguments { colors, material, radius_scale, opacity, .. } = &self.settings;
        let stands_out =
            colors.color.is_some() || material.texture.is_some() || material.environment.is_some();
        stands_out || *radius_scale != 1.0 || *opacity != 1.0 || scale_of(&self.to_world.matrix3).is_none()
    }
}

/// The inputs of a command line, those of its scene file among them.
///
/// # Errors
/// Settings of a cloud that there are not.
pub fn sources(arguments: &RenderArguments) -> anyhow::Result<Vec<Source>> {
    let mut sources = Vec::new();
    for path in &arguments.inputs {
        match &arguments.scene {
            Some(scene) if scene.path == *path => {
                for entry in &scene.file.clouds {
                    let mut settings = scene.settings_of(entry)?;
                    settings.reading.fill_in(&arguments.reading);
                    let (path, to_world) = (scene.resolve(&entry.path), entry.to_world);
                    sources.push(Source { path, to_world, settings });
                }
            }
            _ => {
                let mut settings = CloudArguments::parse_from::<_, &str>([]);
                settings.reading = arguments.reading.clone();
                sources.push(Source { path: path.clone(), to_world: DAffine3::IDENTITY, settings });
            }
        }
    }
    Ok(sources)
}

/// Whether an input is a scene file, by its name.
pub fn is_scene(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"))
}

/// The command line `line`, with the settings of the scene file that it names.
///
/// # Errors
/// What is wrong with the scene file. What is wrong with the command line is said by clap, which ends the program.
pub fn parse(line: Vec<OsString>) -> anyhow::Result<(Arguments, ArgMatches)> {
    let matches = Arguments::command().get_matches_from(&line);
    let arguments = from_matches(&matches);
    let Command::Render(render) = &arguments.command else { return Ok((arguments, matches)) };
    let mut scenes = render.inputs.iter().filter(|path| is_scene(path));
    let Some(path) = scenes.next().cloned() else { return Ok((arguments, matches)) };
    if let Some(second) = scenes.next() {
        let message = format!("one scene file at a time: {} and {}", path.display(), second.display());
        return Err(UsageError::new(message).into());
    }
    let scene = Scene { file: read_scene(&path)?, path };
    let given = matches.subcommand_matches("render").map(given).unwrap_or_default();
    let settings = scene.options(&given)?;
    // Before the command line's own options, after the program's name and the command's.
    let mut whole = line;
    whole.splice(2..2, settings);
    let matches = match Arguments::command().try_get_matches_from(whole) {
        Ok(matches) => matches,
        Err(error) => bail!("{}: {}", scene.path.display(), error.to_string().trim_end()),
    };
    let mut arguments = from_matches(&matches);
    if let Command::Render(render) = &mut arguments.command {
        render.scene = Some(scene);
    }
    Ok((arguments, matches))
}

/// The clouds of a command line as a scene file has them.
pub fn clouds(arguments: &RenderArguments) -> String {
    let mut text = String::new();
    for path in &arguments.inputs {
        match &arguments.scene {
            Some(scene) if scene.path == *path => {
                for entry in &scene.file.clouds {
                    let settings = scene.seen_from_here(&entry.settings);
                    text.push_str(&print::cloud(&scene.resolve(&entry.path), &entry.to_world, &settings));
                }
            }
            _ => text.push_str(&print::cloud(path, &DAffine3::IDENTITY, &[])),
        }
    }
    text
}

/// Prints the scene file that a command line means.
///
/// # Errors
/// What is wrong with the options; that nobody listens.
pub fn print(arguments: &RenderArguments, matches: &ArgMatches) -> anyhow::Result<()> {
    let mut text = clouds(arguments);
    // The words that metadata have for options are options; some are left to the cloud.
    let words = describe::options(&resolve::options(arguments, false)?);
    let mut left_to_cloud = vec!["shading"];
    if arguments.splats.resolve.is_none() {
        left_to_cloud.extend(["resolve", "kernel", "cutoff", "coverage", "thickness"]);
    }
    let words: Vec<&str> = words.split_whitespace().collect();
    let pairs = words.windows(2).filter_map(|pair| Some((pair[0].strip_prefix("--")?, pair[1].to_owned())));
    let settled: Vec<(&str, String)> = pairs.filter(|(name, _)| !left_to_cloud.contains(name)).collect();
    let matches = matches.subcommand_matches("render").unwrap_or(matches);
    text.push_str(&print::settings(matches, &settled));
    Ok(std::io::stdout().write_all(text.as_bytes())?)
}

fn from_matches(matches: &ArgMatches) -> Arguments {
    Arguments::from_arg_matches(matches).unwrap_or_else(|error| error.exit())
}

/// The options that stand on a command line, by their names in the code, and those that contradict them.
fn given(matches: &ArgMatches) -> HashSet<String> {
    let command = render_command();
    let on_line = |arg: &&Arg| {
        matches.value_source(arg.get_id().as_str()).is_some_and(|source| source == ValueSource::CommandLine)
    };
    let mut names = HashSet::new();
    for arg in command.get_arguments().filter(on_line) {
        names.insert(arg.get_id().to_string());
        names.extend(command.get_arg_conflicts_with(arg).iter().map(|other| other.get_id().to_string()));
    }
    names
}

/// What clap knows of `splat render`.
fn render_command() -> clap::Command {
    let mut command = Arguments::command();
    command.build();
    command.find_subcommand("render").cloned().unwrap_or_default()
}

/// The table that an option stands in.
fn table_of(arg: &Arg) -> Option<String> {
    let heading = arg.get_help_heading()?.to_lowercase();
    // How the program talks, and what it does instead of a picture, is not the scene's.
    (heading != "program").then_some(heading)
}

/// Whether an option's value is the path of a file.
fn is_path(arg: &Arg) -> bool {
    arg.get_value_parser().type_id() == ValueParser::path_buf().type_id()
}

impl Scene {
    /// A path of the scene file, which may be relative to its folder.
    pub fn resolve(&self, path: &Path) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(path)
    }

    /// The settings as options of a command line, save those of `given` names.
    fn options(&self, given: &HashSet<String>) -> anyhow::Result<Vec<OsString>> {
        let command = render_command();
        let mut options = Vec::new();
        for section in &self.file.sections {
            for setting in &section.settings {
                let arg = self.option(&command, section, setting)?;
                if !given.contains(arg.get_id().as_str()) {
                    options.extend(self.written(arg, setting)?);
                }
            }
        }
        Ok(options)
    }

    /// The settings of a cloud, paths not relative to the scene file's folder but as they are from here.
    fn seen_from_here(&self, settings: &[Setting]) -> Vec<Setting> {
        let command = CloudArguments::command();
        let takes_path =
            |name: &str| command.get_arguments().any(|arg| arg.get_long() == Some(name) && is_path(arg));
        let mut settings = settings.to_vec();
        for Setting { name, value, .. } in &mut settings {
            if let (Value::Text(text), true) = (value, takes_path(name)) {
                *text = self.resolve(Path::new(text)).to_string_lossy().into_owned();
            }
        }
        settings
    }

    /// What is said of a cloud, besides where it is.
    fn settings_of(&self, entry: &CloudEntry) -> anyhow::Result<CloudArguments> {
        let mut command = CloudArguments::command();
        command.build();
        let mut line = Vec::new();
        for setting in &entry.settings {
            let arg = command.get_arguments().find(|arg| arg.get_long() == Some(&setting.name));
            let Some(arg) = arg else {
                let names = command.get_arguments().filter_map(Arg::get_long);
                let names: Vec<&str> = names.filter(|name| *name != "help").collect();
                bail!(
                    "{}: line {}: found `{}`, expected path, translate, rotate, scale, matrix, or one of {}",
                    self.path.display(),
                    setting.line,
                    setting.name,
                    names.join(", ")
                );
            };
            line.extend(self.written(arg, setting)?);
        }
        let settings = CloudArguments::try_parse_from(line)
            .map_err(|error| anyhow!("{}: {}", self.path.display(), error.to_string().trim_end()))?;
        material::check(&settings.material)?;
        Ok(settings)
    }

    /// The option that a setting stands for.
    fn option<'a>(
        &self,
        command: &'a clap::Command,
        section: &Section,
        setting: &Setting,
    ) -> anyhow::Result<&'a Arg> {
        let (path, line, name) = (self.path.display(), setting.line, &setting.name);
        let options = || command.get_arguments().filter(|arg| table_of(arg).is_some());
        let here = options().filter(|arg| table_of(arg).as_ref() == Some(&section.name));
        let names: Vec<&str> = here.filter_map(Arg::get_long).collect();
        if names.is_empty() {
            let mut tables: Vec<String> = options().filter_map(table_of).collect();
            tables.sort();
            tables.dedup();
            bail!(
                "{path}: line {}: found [{}], expected one of [[cloud]], [{}]",
                section.line,
                section.name,
                tables.join("], [")
            );
        }
        let Some(arg) = options().find(|arg| arg.get_long() == Some(name)) else {
            bail!("{path}: line {line}: found `{name}`, expected one of {}", names.join(", "));
        };
        match table_of(arg) {
            Some(table) if table != section.name => {
                bail!("{path}: line {line}: found `{name}` in [{}], expected it in [{table}]", section.name)
            }
            _ => Ok(arg),
        }
    }

    /// A setting as it stands on a command line.
    fn written(&self, arg: &Arg, setting: &Setting) -> anyhow::Result<Option<OsString>> {
        let option = format!("--{}", setting.name);
        let takes_values = arg.get_num_args().is_some_and(|range| range.takes_values());
        let may_stand_alone = arg.get_num_args().is_none_or(|range| range.min_values() == 0);
        match &setting.value {
            Value::Flag(false) => Ok(None),
            Value::Flag(true) if may_stand_alone => Ok(Some(option.into())),
            Value::Text(text) if takes_values => {
                let value =
                    if is_path(arg) { self.resolve(Path::new(text)).into() } else { OsString::from(text) };
                Ok(Some([OsString::from(option + "="), value].into_iter().collect()))
            }
            value => {
                let expected = if takes_values { "a value" } else { "true or false" };
                let (path, line, name) = (self.path.display(), setting.line, &setting.name);
                bail!("{path}: line {line}: found {name} = {value}, expected {expected}")
            }
        }
    }
}
