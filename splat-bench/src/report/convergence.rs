//! Error against the number of samples, for each kind of pattern.

use super::Context;
use super::figures::Kind;
use super::fit::exponent;
use super::html::{Block, Section};
use super::metrics::distance;
use super::plot::{Plot, Series, number};
use super::scenes::{Subjects, edges, smooth};
use super::whole::{pattern_name, picture_of, truth_of};
use splat_core::{PatternKind, RenderOptions};
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
    let seeds = if context.quick { 4 } else { 16 };
    section.text(format!(
        "RMSE over all pixels and {seeds} seeds, Blackman-Harris filter, against the truth of the same filter; its own error is in the text of \
         each scene. Slopes are fitted from 4 samples on. Without any order in the samples the slope is -0.5."
    ));
    let width = if context.quick { 64 } else { 96 };
    for scene in [smooth(width), edges(width)] {
        context.say(&format!("convergence: {}", scene.name));
        let (truth, truth_error) = truth_of(&scene, context)?;
        let truth = truth.of(scene.options.filter);
        let kinds = [PatternKind::Sobol, PatternKind::PoissonDisc];
        let mut errors: Vec<Vec<[f64; 2]>> = Vec::new();
        for pattern in kinds {
            let mut renderer = Renderer::new(0, Level::choose())?;
            let mut of_kind = Vec::new();
            for samples in SAMPLES {
                let mut squares = 0.0;
                for seed in 0..seeds {
                    let options = RenderOptions { samples, pattern, seed, ..scene.options.clone() };
                    let Subjects { cloud, camera, .. } = &scene;
                    let film = renderer.render(cloud, camera, &options, &mut |_| {})?.film;
                    squares += distance(truth, &picture_of(&film)).rmse.powi(2);
                }
                let rmse = (squares / seeds as f64).sqrt();
                let setting = format!("{}, {samples} samples", pattern_name(pattern));
                context.figures.note([SECTION, scene.name, &setting, "RMSE"], Kind::Error, rmse);
                of_kind.push([f64::from(samples), rmse]);
            }
            errors.push(of_kind);
        }
        section.heading(format!("{}: {}", scene.name, scene.about));
        section.text(format!("The truth's own RMSE: {}.", number(truth_error)));
        let mut names = vec!["pattern".to_owned()];
        names.extend(SAMPLES.map(|samples| samples.to_string()));
        names.push("slope".into());
        let mut rows = Vec::new();
        let mut series = Vec::new();
        for (kind, errors) in kinds.into_iter().zip(&errors) {
            // What the truth does not know cannot be fitted.
            let fitted: Vec<[f64; 2]> = errors
                .iter()
                .copied()
                .filter(|&[samples, rmse]| samples >= 4.0 && rmse > 3.0 * truth_error)
                .collect();
            let slope = exponent(&fitted);
            if let Some(slope) = slope {
                let at = [SECTION, scene.name, pattern_name(kind), "slope"];
                context.figures.note(at, Kind::Plain, slope);
            }
            let mut row = vec![pattern_name(kind).to_owned()];
            row.extend(errors.iter().map(|[_, rmse]| number(*rmse)));
            row.push(slope.map_or(String::new(), |slope| format!("{slope:.2}")));
            rows.push(row);
            let points = errors.iter().map(|&[samples, rmse]| (samples, rmse, String::new())).collect();
            series.push(Series { name: pattern_name(kind).into(), points, joined: true });
        }
        section.blocks.push(Block::Table(names, rows));
        let axes = ["samples a pixel".into(), "RMSE".into()];
        let title = format!("{}: error against samples", scene.name);
        section.blocks.push(Block::Plot(Plot { title, axes, series }));
        for samples in JUDGED_AT {
            let at = |errors: &[[f64; 2]]| {
                errors.iter().find(|point| point[0] == f64::from(samples)).map_or(f64::NAN, |point| point[1])
            };
            let gain = at(&errors[1]) / at(&errors[0]);
            let setting = format!("{samples} samples");
            context.figures.note([SECTION, scene.name, &setting, "poisson over default"], Kind::Plain, gain);
            let result = if gain >= WANTED_GAIN { "met" } else { "missed" };
            section.verdict(format!(
                "{}, {samples} samples: the default patterns' RMSE is 1/{gain:.2} of that of Poisson-disc ones; wanted 1/{WANTED_GAIN}: {result}.",
                scene.name
            ));
        }
    }
    Ok(section)
}
