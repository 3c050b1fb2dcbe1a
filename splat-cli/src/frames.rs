//! Which of several cameras are drawn, and what each picture is called.

use crate::arguments::RenderArguments;
use crate::cameras;
use crate::console::Console;
use crate::usage::UsageError;
use clap::Args;
use splat_core::Camera;
use splat_io::{CameraSet, NamedCamera};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Which of several cameras.
#[derive(Debug, Clone, Default, Args)]
pub struct FrameArguments {
    /// The camera of this name; folders, extension and the end of it may be left out
    #[arg(long, value_name = "NAME", requires = "camera", conflicts_with = "frames")]
    pub camera_name: Option<String>,
    /// These of the cameras or of the turntable's frames, the first of which is 1: N, A-B, A-BxSTEP, or a list with commas
    ///
    /// In the output's name {name} becomes the camera's, and #### the frame's number. Without either, -#### is added where
    /// there are several.
    #[arg(long, value_name = "LIST", value_parser = frames)]
    pub frames: Option<Frames>,
    /// So many frames once around the cloud and its up axis, from --view on
    #[arg(long, value_name = "N", conflicts_with = "camera", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub turntable: Option<u32>,
    /// What the cameras of an Open3D .log trajectory are but for their places: any file of one camera
    #[arg(long, value_name = "FILE", requires = "camera")]
    pub intrinsic: Option<PathBuf>,
}

/// `--frames`: numbers from 1, in the order given.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frames(Vec<Range>);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Range {
    first: usize,
    last: usize,
    step: usize,
}

/// `--frames`.
fn frames(text: &str) -> Result<Frames, String> {
    let range = |text: &str| {
        let (ends, step) = text.split_once('x').unwrap_or((text, "1"));
        let (first, last) = ends.split_once('-').unwrap_or((ends, ends));
        let [first, last, step] = [first, last, step].map(|number| number.trim().parse().ok());
        let range = Range { first: first?, last: last?, step: step? };
        (range.first >= 1 && range.first <= range.last && range.step >= 1).then_some(range)
    };
    let ranges: Option<Vec<Range>> = text.split(',').map(range).collect();
    ranges
        .map(Frames)
        .ok_or_else(|| "expected N, A-B or A-BxSTEP with 1 <= A <= B, or a list of them".to_owned())
}

impl Frames {
    /// The indices, from 0, of these among `count` things.
    fn indices(&self, count: usize, what: &str) -> Result<Vec<usize>, UsageError> {
        match self.0.iter().find(|range| range.last > count) {
            Some(range) => {
                let last = range.last;
                Err(UsageError::new(format!("--frames asks for number {last}, and there are {count} {what}")))
            }
            None => Ok(self
                .0
                .iter()
                .flat_map(|range| (range.first..=range.last).step_by(range.step))
                .map(|number| number - 1)
                .collect()),
        }
    }
}

/// A picture to be made.
#[derive(Debug, PartialEq)]
pub struct Shot {
    /// Its place among the turntable's frames or the file's cameras, from 0.
    pub index: usize,
    /// The file's camera; `None` if it is to be fitted.
    pub camera: Option<Camera>,
    /// The file.
    pub output: PathBuf,
}

/// The pictures that a command line asks for; cameras from a file are read. `near` is their default near depth.
///
/// # Errors
/// What the reader of cameras says; [`UsageError`] for a choice that cannot be followed, and two pictures of one name.
pub fn plan(arguments: &RenderArguments, near: f64, console: Console) -> anyhow::Result<Vec<Shot>> {
    let FrameArguments { camera_name, frames, turntable, .. } = &arguments.camera.frames;
    let output = &arguments.picture();
    let shots = if let Some(path) = &arguments.camera.camera {
        let set = cameras::read(path, &arguments.camera, near, console)?;
        let chosen = choose(&set, camera_name.as_deref(), frames.as_ref(), has_place_holder(output))?;
        let pattern = if chosen.len() > 1 { with_place_holder(output) } else { output.clone() };
        let mut cameras: Vec<_> = set.cameras.into_iter().map(Some).collect();
        let shot = |index: usize| {
            // A frame that is chosen twice is refused below, by its name.
            let NamedCamera { name, camera } = cameras[index].take()?;
            Some(Shot { index, output: expand(&pattern, index + 1, &name), camera: Some(camera) })
        };
        chosen.into_iter().map(shot).collect::<Option<Vec<_>>>().ok_or_else(|| twice(output))?
    } else if let Some(count) = *turntable {
        let count = count as usize;
        let pattern = with_place_holder(output);
        let all = || Ok((0..count).collect());
        let chosen =
            frames.as_ref().map_or_else(all, |frames| frames.indices(count, "frames (--turntable)"))?;
        let shot = |index| Shot { index, output: expand(&pattern, index + 1, "turntable"), camera: None };
        chosen.into_iter().map(shot).collect()
    } else if frames.is_some() {
        return Err(UsageError::new("--frames needs --camera or --turntable").into());
    } else {
        vec![Shot { index: 0, output: output.clone(), camera: None }]
    };
    let mut outputs = BTreeSet::new();
    match shots.iter().find(|shot| !outputs.insert(&shot.output)) {
        Some(shot) => Err(twice(&shot.output).into()),
        None => Ok(shots),
    }
}

fn twice(output: &Path) -> UsageError {
    UsageError::new(format!("{}: two frames would be written to it: put #### in its name", output.display()))
}

/// The indices of the cameras to draw.
fn choose(
    set: &CameraSet,
    name: Option<&str>,
    frames: Option<&Frames>,
    is_pattern: bool,
) -> Result<Vec<usize>, UsageError> {
    let count = set.cameras.len();
    if let Some(frames) = frames {
        return frames.indices(count, "cameras");
    }
    if let Some(name) = name {
        return find(set, name).map(|index| vec![index]);
    }
    if count == 1 || is_pattern {
        return Ok((0..count).collect());
    }
    let names = list(set.cameras.iter().map(|camera| camera.name.as_str()));
    Err(UsageError::new(format!(
        "{}: {count} cameras ({names}): choose with --camera-name NAME or --frames N, or put {{name}} or #### in the \
         output's name to draw all",
        set.path.display()
    )))
}

/// The camera that a name means: the whole name, or without its extension, its folders, or its end; whichever first fits.
fn find(set: &CameraSet, wanted: &str) -> Result<usize, UsageError> {
    let whole = |name: &str| name == wanted;
    let without_extension = |name: &str| Path::new(name).with_extension("").as_os_str() == wanted;
    let without_folders = |name: &str| file_name(name) == wanted || stem(name) == wanted;
    let start = |name: &str| name.starts_with(wanted) || file_name(name).starts_with(wanted);
    let fits: [&dyn Fn(&str) -> bool; 4] = [&whole, &without_extension, &without_folders, &start];
    let named = |fits: &dyn Fn(&str) -> bool| -> Vec<usize> {
        (0..set.cameras.len()).filter(|&index| fits(&set.cameras[index].name)).collect()
    };
    let found = fits.into_iter().map(named).find(|found| !found.is_empty()).unwrap_or_default();
    match found[..] {
        [index] => Ok(index),
        [] => {
            let names = list(set.cameras.iter().map(|camera| camera.name.as_str()));
            Err(UsageError::new(format!("--camera-name {wanted}: no camera is called so, but {names}")))
        }
        _ => {
            let names = list(found.iter().map(|&index| set.cameras[index].name.as_str()));
            Err(UsageError::new(format!(
                "--camera-name {wanted} may mean {} cameras ({names}): --frames chooses by number",
                found.len()
            )))
        }
    }
}

/// The first names.
fn list<'a>(names: impl ExactSizeIterator<Item = &'a str>) -> String {
    const MOST: usize = 5;
    let more = if names.len() > MOST { ", .." } else { "" };
    let first: Vec<String> = names.take(MOST).map(|name| name.escape_debug().to_string()).collect();
    first.join(", ") + more
}

/// A camera's name without folders of either kind.
fn file_name(name: &str) -> &str {
    name.rsplit(['/', '\\']).next().unwrap_or_default()
}

/// The same without its extension.
fn stem(name: &str) -> &str {
    let name = file_name(name);
    match name.rsplit_once('.') {
        Some((stem, _)) if !stem.is_empty() => stem,
        _ if name.is_empty() => "camera",
        _ => name,
    }
}

const NAME: &str = "{name}";

/// The first run of two or more `#`.
fn number_signs(name: &str) -> Option<std::ops::Range<usize>> {
    let start = name.find("##")?;
    let length = name[start..].bytes().take_while(|&byte| byte == b'#').count();
    Some(start..start + length)
}

/// The name of a file without folders; nothing is put in place of a name that is no Unicode.
fn output_name(output: &Path) -> &str {
    output.file_name().and_then(|name| name.to_str()).unwrap_or_default()
}

fn has_place_holder(output: &Path) -> bool {
    let name = output_name(output);
    name.contains(NAME) || number_signs(name).is_some()
}

/// The output's name with `-####` before its extension, unless it has a place for the name or the number.
fn with_place_holder(output: &Path) -> PathBuf {
    if has_place_holder(output) {
        return output.to_owned();
    }
    let mut name = output.file_stem().unwrap_or_default().to_owned();
    name.push("-####");
    if let Some(extension) = output.extension() {
        name.push(".");
        name.push(extension);
    }
    output.with_file_name(name)
}

/// The name of one picture: `{name}` is the camera's, without folders and extension and without what file names may not
/// hold; each run of two or more `#` is the number, with as many digits at least.
fn expand(pattern: &Path, number: usize, camera: &str) -> PathBuf {
    if !has_place_holder(pattern) {
        return pattern.to_owned();
    }
    let mut name = output_name(pattern).to_owned();
    while let Some(signs) = number_signs(&name) {
        let digits = signs.len();
        name.replace_range(signs, &format!("{number:0digits$}"));
    }
    let is_unfit = |c: char| c.is_control() || "<>:\"/\\|?*".contains(c);
    pattern.with_file_name(name.replace(NAME, &stem(camera).replace(is_unfit, "_")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arguments::{Arguments, Command};
    use clap::Parser;
    use splat_io::write_cameras_json;

    #[test]
    fn lists_of_frames() {
        let indices = |text: &str| frames(text).unwrap().indices(10, "cameras");
        assert_eq!(indices("3").unwrap(), [2]);
        assert_eq!(indices("1-10x4, 2").unwrap(), [0, 4, 8, 1]);
        assert_eq!(indices("9-10").unwrap(), [8, 9]);
        let message = indices("8-11").unwrap_err().to_string();
        assert_eq!(message, "--frames asks for number 11, and there are 10 cameras");
        for text in ["", "0", "-3", "3-1", "1-3x0", "1-3x", "a", "1,,2", "1-2-3", "1x2x3"] {
            assert!(frames(text).is_err(), "{text}");
        }
        assert!(indices("1-99999999999999999").is_err());
    }

    #[test]
    fn names_of_pictures() {
        let name = |pattern: &str, camera: &str| expand(Path::new(pattern), 7, camera).display().to_string();
        assert_eq!(name("a/x-####.png", "c"), "a/x-0007.png");
        assert_eq!(name("##-{name}.png", "images/left\\0001.jpg"), "07-0001.png");
        assert_eq!(name("{name}.exr", "../..\\.x"), ".x.exr");
        assert_eq!(name("{name}.exr", "a:b\n*.tar.gz"), "a_b__.tar.exr");
        assert_eq!(name("{name}.exr", "####"), "####.exr");
        assert_eq!(name("C#.png", "c"), "C#.png");
        assert_eq!(name("##/a.png", "c"), "##/a.png");
        assert_eq!(with_place_holder(Path::new("a/b.png")), Path::new("a/b-####.png"));
        assert_eq!(with_place_holder(Path::new("{name}.png")), Path::new("{name}.png"));
    }

    /// What is planned for cameras of these names.
    fn planned(names: &[&str], options: &str) -> anyhow::Result<Vec<(usize, String)>> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cameras.json");
        let camera = cameras::tests::camera();
        let named = |name: &&str| NamedCamera { name: (*name).to_owned(), camera: camera.clone() };
        write_cameras_json(&path, &names.iter().map(named).collect::<Vec<_>>()).unwrap();
        let options = options.replace("FILE", path.to_str().unwrap());
        let line = ["splat", "render", "in.ply"].into_iter().chain(options.split_whitespace());
        let Command::Render(arguments) = Arguments::parse_from(line).command else { panic!("not render") };
        let shots = plan(&arguments, 1.0, Console { quiet: true, verbose: false })?;
        Ok(shots.into_iter().map(|shot| (shot.index, shot.output.display().to_string())).collect())
    }

    #[test]
    fn cameras_are_chosen_by_name_number_or_pattern() {
        let names = ["a/01.jpg", "a/02.jpg", "b/02.jpg", "b/02.jpg.png"];
        let index =
            |options: &str| planned(&names, &format!("-o x.png --camera FILE {options}")).unwrap()[0].0;
        assert_eq!(index("--camera-name a/01.jpg"), 0);
        assert_eq!(index("--camera-name a/01"), 0);
        assert_eq!(index("--camera-name 01"), 0);
        assert_eq!(index("--camera-name a/02"), 1);
        assert_eq!(index("--camera-name b/02.jpg"), 2);
        assert_eq!(index("--camera-name 01.j"), 0);
        assert_eq!(index("--frames 4"), 3);
        let all = planned(&names, "-o x-##.png --camera FILE").unwrap();
        assert_eq!(
            all.iter().map(|(_, name)| name.as_str()).collect::<Vec<_>>(),
            ["x-01.png", "x-02.png", "x-03.png", "x-04.png"]
        );
        let two = planned(&names, "-o x.png --camera FILE --frames 2-4x2").unwrap();
        assert_eq!(two, [(1, "x-0002.png".to_owned()), (3, "x-0004.png".to_owned())]);
        assert_eq!(planned(&names[..1], "-o {name}.png --camera FILE").unwrap(), [(0, "01.png".to_owned())]);
        assert_eq!(planned(&names[..1], "-o x.png --camera FILE").unwrap(), [(0, "x.png".to_owned())]);
    }

    #[test]
    fn choices_that_cannot_be_followed_are_refused() {
        let names = ["a/01.jpg", "a/02.jpg", "b/02.jpg", "c", "d", "e"];
        let cases = [
            ("--camera FILE -o x.png", "6 cameras (a/01.jpg, a/02.jpg, b/02.jpg, c, d, ..): choose with"),
            ("--camera FILE -o x.png --camera-name 02", "may mean 2 cameras (a/02.jpg, b/02.jpg)"),
            ("--camera FILE -o x.png --camera-name z", "no camera is called so, but a/01.jpg"),
            ("--camera FILE -o x.png --frames 7", "number 7, and there are 6 cameras"),
            ("--camera FILE -o {name}.png", "02.png: two frames would be written to it"),
            ("--camera FILE -o x.png --frames 1,1", "two frames"),
            ("-o x.png --frames 1", "--frames needs --camera or --turntable"),
            ("-o x.png --turntable 4 --frames 5", "number 5, and there are 4 frames"),
        ];
        for (options, expected) in cases {
            let error = planned(&names, options).unwrap_err();
            assert!(error.is::<UsageError>() && error.to_string().contains(expected), "{options}: {error}");
        }
    }

    #[test]
    fn turntables_number_their_frames() {
        let names = |options: &str| -> Vec<String> {
            planned(&["c"], options).unwrap().into_iter().map(|(_, name)| name).collect()
        };
        assert_eq!(names("-o x.png --turntable 2"), ["x-0001.png", "x-0002.png"]);
        assert_eq!(names("-o x##.png --turntable 12 --frames 3-12x9"), ["x03.png", "x12.png"]);
        assert_eq!(names("-o x##.png"), ["x##.png"]);
    }
}
