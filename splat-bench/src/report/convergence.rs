//! Error against the number of samples, for each kind of pattern.

use super::Context;
use super::figures::Kind;
use super::fit::exponent;
use super::html::{Block, Section};
use super::metrics::{Picture, distance};
use super::plot::{Plot, Series, number};
use super::scenes::{Subjects, edges, smooth};
use super::whole::{PATTERN_KINDS, pattern_name, picture_of, truth_of};
use splat_core::{PixelFilter, RenderOptions};
use splat_simd::{Level, Renderer};

/// The name of this part among the figures.
const SECTION: &str = "convergence";

/// What the default patterns must gain over Poisson-disc ones.
const WANTED_GAIN: f64 = 1.3;

/// The numbers of samples at which they must.
const JUDGED_AT: [u32; 2] = [8, 16];

/// Numbers of samples.
const SAMPLES: [u32; 9] = [1, 2, 4, 6, 8, 16, 32, 64, 128];

/// Renders both scenes with every number of samples.
///
/// # Errors
/// If something cannot be rendered.
pub fn section(context: &mut Context) -> anyhow::Result<Section> {
    let mut section = Section::new("Convergence: error against samples");
    let seeds = if context.quick { 3 } else { 12 };
    section.text(format!(
        "RMSE over all pixels and {seeds} seeds, against the truth of the same filter. Slopes are fitted from 4 samples on. Without any order in the samples the slope is -0.5."
    ));
    let width = if context.quick { 64 } else { 96 };
    for scene in [smooth(width), edges(width)] {
        context.say(&format!("convergence: {}", scene.name));
        let (truth, truth_error) = truth_of(&scene, context)?;
        section.heading(format!("{}: {}", scene.name, scene.about));
        section.text(format!("The truth's own RMSE: {} (Blackman-Harris).", number(truth_error)));
        let mut series = Vec::new();
        let mut rows = Vec::new();
        let mut verdicts = Vec::new();
        for (filter, filter_name) in
            [(PixelFilter::BlackmanHarris, "blackman-harris"), (PixelFilter::Box, "box")]
        {
            let mut curves = Vec::new();
            for pattern in PATTERN_KINDS {
                let options = RenderOptions { filter, pattern, ..scene.options.clone() };
                let errors = curve(&scene, &options, truth.of(filter), seeds)?;
                let name = format!("{}, {filter_name}", pattern_name(pattern));
                for &[samples, rmse] in &errors {
                    let setting = format!("{name}, {samples} samples");
                    context.figures.note([SECTION, scene.name, &setting, "RMSE"], Kind::Error, rmse);
                }
                // What the truth does not know cannot be fitted.
                let is_known = |point: &&[f64; 2]| point[0] >= 4.0 && point[1] > 3.0 * truth_error;
                let fitted: Vec<[f64; 2]> = errors.iter().filter(is_known).copied().collect();
                let slope = exponent(&fitted);
                if let Some(slope) = slope {
                    context.figures.note([SECTION, scene.name, &name, "slope"], Kind::Plain, slope);
                }
                let mut row = vec![name.clone()];
                row.extend(errors.iter().map(|[_, rmse]| number(*rmse)));
                row.push(slope.map_or(String::new(), |slope| format!("{slope:.2}")));
                rows.push(row);
                let points = errors.iter().map(|&[samples, rmse]| (samples, rmse, String::new())).collect();
                series.push(Series { name, points, joined: true, rings: false });
                curves.push(errors);
            }
            for samples in JUDGED_AT {
                let at = |errors: &[[f64; 2]]| {
                    errors
                        .iter()
                        .find(|point| point[0] == f64::from(samples))
                        .map_or(f64::NAN, |point| point[1])
                };
                // Poisson-disc ones are the last.
                let gain = at(&curves[curves.len() - 1]) / at(&curves[0]);
                let setting = format!("{filter_name}, {samples} samples");
                context.figures.note(
                    [SECTION, scene.name, &setting, "poisson over default"],
                    Kind::Plain,
                    gain,
                );
                let result = if gain >= WANTED_GAIN { "met" } else { "missed" };
                verdicts.push(format!(
                    "{}, {setting}: the default patterns' RMSE is 1/{gain:.2} of that of Poisson-disc ones; \
                     wanted 1/{WANTED_GAIN}: {result}.",
                    scene.name
                ));
            }
        }
        let mut names = vec!["pattern, filter".to_owned()];
        names.extend(SAMPLES.map(|samples| samples.to_string()));
        names.push("slope".into());
        section.blocks.push(Block::Table(names, rows));
        let axes = ["samples a pixel".into(), "RMSE".into()];
        let title = format!("{}: error against samples", scene.name);
        section.blocks.push(Block::Plot(Plot { title, axes, series }));
        verdicts.into_iter().for_each(|verdict| section.verdict(verdict));
    }
    Ok(section)
}

/// Numbers of samples, and the root of the mean square of the errors of pictures of that many, over pixels and seeds.
fn curve(
    scene: &Subjects,
    options: &RenderOptions,
    truth: &Picture,
    seeds: u64,
) -> anyhow::Result<Vec<[f64; 2]>> {
    let mut renderer = Renderer::new(0, Level::choose())?;
    let mut errors = Vec::new();
    for samples in SAMPLES {
        let mut squares = 0.0;
        for seed in 0..seeds {
            let options = RenderOptions { samples, seed, ..options.clone() };
            let film = renderer.render(&scene.cloud, &scene.camera, &options, &mut |_| {})?.film;
            squares += distance(truth, &picture_of(&film)).rmse.powi(2);
        }
        errors.push([f64::from(samples), (squares / seeds as f64).sqrt()]);
    }
    Ok(errors)
}
