//! `splat diff`: whether two pictures are the same, and how they differ.

mod map;
mod measure;
mod pictures;

use crate::console;
use crate::output::{check_file, spare_inputs};
use crate::usage::UsageError;
use crate::values;
use anyhow::bail;
use clap::Args;
use measure::{Difference, Layer};
use pictures::{Pair, Space};
use serde_json::{Value, json};
use splat_io::PictureFormat;
use std::fmt::Write;
use std::path::PathBuf;
use std::process::ExitCode;

/// The exit code for pictures that differ.
const DIFFERENT: u8 = 1;

/// The exit code for what cannot be compared.
const TROUBLE: u8 = 2;

/// `splat diff`.
#[derive(Debug, Args)]
pub struct DiffArguments {
    /// A picture: .exr or .png
    #[arg(value_name = "A")]
    pub a: PathBuf,
    /// Another, of the same size
    #[arg(value_name = "B")]
    pub b: PathBuf,
    /// Write a picture of the differences: .png is FLIP's map, from black over red to white; .exr has the absolute
    /// differences of each channel, and the map
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// The same if no value differs by more than this
    #[arg(long, value_name = "D", value_parser = values::tolerance)]
    pub max: Option<f64>,
    /// The same if no layer's RMSE is more than this
    #[arg(long, value_name = "D", value_parser = values::tolerance)]
    pub rmse: Option<f64>,
    /// The same if the mean of FLIP is not more than this
    #[arg(long, value_name = "F", value_parser = values::tolerance)]
    pub flip: Option<f64>,
    /// The same if no float differs by more than so many units in the last place, and nothing else differs
    #[arg(long, value_name = "N")]
    pub ulp: Option<u64>,
    /// Only these channels or layers, as R,G,B or N,Z
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub channels: Option<Vec<String>>,
    /// Write JSON
    #[arg(long)]
    pub json: bool,
    /// Write nothing: the exit code tells
    #[arg(long)]
    pub quiet: bool,
}

/// Runs the command: the exit code is 0 for pictures that are the same within the tolerance, 1 for others, and 2 for what
/// cannot be compared, for whatever reason.
pub fn run(arguments: &DiffArguments) -> ExitCode {
    match compare(arguments) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(DIFFERENT),
        Err(error) => {
            console::error(&error);
            ExitCode::from(TROUBLE)
        }
    }
}

/// Compares and reports; whether the pictures are the same.
fn compare(arguments: &DiffArguments) -> anyhow::Result<bool> {
    let DiffArguments { a, b, output, channels, .. } = arguments;
    if let Some(path) = output {
        PictureFormat::from_path(path).map_err(UsageError::new)?;
        spare_inputs(path, [a, b])?;
        check_file(path)?;
    }
    let pair = Pair::read([a, b], channels.as_deref())?;
    let difference = Difference::of(&pair);
    if difference.flip.is_none() && arguments.flip.is_some() {
        bail!(UsageError::new("--flip needs pictures that both have the channels R, G and B, or Y"));
    }
    let is_same = is_same(arguments, &difference);
    if !arguments.quiet {
        let text = if arguments.json {
            in_json(&pair, &difference, is_same)
        } else {
            in_words(&pair, &difference, is_same)
        };
        match console::data(&text) {
            Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => return Err(error.into()),
            _ => {}
        }
    }
    if let Some(path) = output {
        map::write(path, &pair, &difference)?;
    }
    Ok(is_same)
}

/// Whether every tolerance holds; without any, whether all bits are equal.
fn is_same(arguments: &DiffArguments, difference: &Difference) -> bool {
    let DiffArguments { max, rmse, flip, ulp, .. } = *arguments;
    let layers = || difference.layers.iter();
    if max.is_none() && rmse.is_none() && flip.is_none() && ulp.is_none() {
        return layers().all(|layer| layer.differing == 0);
    }
    let within = |value: f64, most: Option<f64>| most.is_none_or(|most| value <= most);
    let ulps =
        |layer: &Layer| ulp.is_none_or(|most| layer.ulp.map_or(layer.differing == 0, |found| found <= most));
    layers().all(|layer| within(layer.max, max) && within(layer.rmse, rmse) && ulps(layer))
        && within(difference.flip_mean().unwrap_or(0.0), flip)
}

fn in_words(pair: &Pair, difference: &Difference, is_same: bool) -> String {
    let [width, height] = pair.size;
    let space = match pair.space {
        Space::Linear => "values as the EXR files have them, linear",
        Space::Display => "sRGB and straight alpha, 0 to 1, as in PNG files",
    };
    let mut text = format!("{width}x{height} pixels, {space}\n");
    let mut row = |cells: [&str; 7]| {
        let [name, rmse, max, at, psnr, ulp, differing] = cells;
        _ = writeln!(text, "{name:<10} {rmse:>10} {max:>10} {at:>18} {psnr:>8} {ulp:>10} {differing:>10}");
    };
    row(["layer", "RMSE", "max", "at", "PSNR", "ulp", "pixels"]);
    for layer in &difference.layers {
        let [x, y] = layer.at;
        row([
            &layer.name,
            &number(layer.rmse),
            &number(layer.max),
            &if layer.max > 0.0 { format!("{x},{y} {}", layer.channel) } else { "-".to_owned() },
            &layer.psnr.map_or("-".to_owned(), |psnr| format!("{psnr:.2}")),
            &layer.ulp.map_or("-".to_owned(), |ulp| ulp.to_string()),
            &layer.differing.to_string(),
        ]);
    }
    if let Some(flip) = difference.flip_mean() {
        _ = writeln!(text, "FLIP       {:>10}  (mean; color over black, clamped to 0 to 1)", number(flip));
    }
    for (path, only) in pair.paths.iter().zip(&pair.only) {
        if !only.is_empty() {
            _ = writeln!(text, "only in {}: {}", path.display(), only.join(" "));
        }
    }
    text + if is_same { "the same\n" } else { "different\n" }
}

/// A number of four digits.
fn number(value: f64) -> String {
    if value == 0.0 || (1e-3..1e4).contains(&value) {
        let text = format!("{value:.4}");
        if value == 0.0 { "0".to_owned() } else { text }
    } else {
        format!("{value:.3e}")
    }
}

fn in_json(pair: &Pair, difference: &Difference, is_same: bool) -> String {
    // JSON has no infinity: null.
    let layer = |layer: &Layer| {
        json!({
            "name": layer.name, "channels": layer.channels, "rmse": layer.rmse, "max": layer.max,
            "max_at": layer.at, "max_channel": layer.channel, "psnr": layer.psnr, "max_ulp": layer.ulp,
            "differing_pixels": layer.differing,
        })
    };
    let value = json!({
        "a": pair.paths[0].display().to_string(),
        "b": pair.paths[1].display().to_string(),
        "same": is_same,
        "size": pair.size,
        "space": match pair.space { Space::Linear => "linear", Space::Display => "display" },
        "flip": difference.flip_mean(),
        "layers": difference.layers.iter().map(layer).collect::<Vec<Value>>(),
        "only_in_a": pair.only[0],
        "only_in_b": pair.only[1],
    });
    format!("{value:#}\n")
}
