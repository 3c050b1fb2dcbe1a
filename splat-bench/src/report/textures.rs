//! Error against time of texture lookups: the measurements of docs/textures.md, of fewer lookups.

use super::Context;
use super::figures::Kind;
use super::html::{Block, Section};
use super::plot::{Plot, Series, number};
use splat_bench::textures::images;
use splat_bench::textures::measure::{Column, Effort, FILTERS, Measured, Method, SETS, column};
use splat_core::texture::Sampler;
use splat_simd::Level;
use std::path::Path;

/// The name of this part among the figures.
const SECTION: &str = "textures";

/// Of [`SETS`], the footprints of textures about as large as they are looked at.
const LOOK: usize = 0;

/// Measures every filter on one image (`quick`) or all.
///
/// # Errors
/// If an image cannot be read.
pub fn section(data: Option<&Path>, context: &mut Context) -> anyhow::Result<Section> {
    let effort = if context.quick {
        Effort { tiles: [8, 1], truths: 48, repetitions: context.repetitions }
    } else {
        Effort { tiles: [32, 4], truths: 192, repetitions: context.repetitions }
    };
    let (anisotropies, count): (&[f64], _) =
        if context.quick { (&[1.0, 16.0], 1) } else { (&[1.0, 4.0, 16.0, 64.0], 3) };
    let mut section = Section::new("Texture filters");
    let [low, high] = SETS[LOOK].1;
    section.text(format!(
        "Lookups of random footprints whose minor semi-axis is {low} to {high} texels, in tiles of 8 x 8, against the integral over the ellipse. Times are \
         nanoseconds a lookup, all filters, cores and levels taking turns; lanes have the same bits at every level. \
         docs/textures.md has more of them, and what is wanted."
    ));
    for subject in images::all(data)?.iter().take(count) {
        section.heading(subject.name);
        for &anisotropy in anisotropies {
            context.say(&format!("textures: {}, {anisotropy}:1", subject.name));
            let column = column(subject, LOOK, anisotropy, effort);
            note(subject.name, &column, context);
            section.blocks.push(Block::Plot(plot(subject.name, &column)));
            section.table(&["filter", "core", "ns", "texels", "RMSE", "max", "Pareto"], rows(&column));
            section.verdict(verdict(&column));
        }
    }
    Ok(section)
}

/// The methods that are shown: the scalar core, and lanes at the level that would be taken.
fn shown(column: &Column) -> impl Iterator<Item = &Measured> {
    let best = Level::choose();
    column.methods.iter().filter(move |found| found.method.level.is_none_or(|level| level == best))
}

fn note(image: &str, column: &Column, context: &mut Context) {
    for Measured { method, time, noise, errors: [rmse, max], .. } in shown(column) {
        let setting = format!("{}:1, {}, {}", column.anisotropy, method.name(), method.core());
        context.figures.note_noisy([SECTION, image, &setting, "time, ns"], Kind::Time, *time, *noise);
        context.figures.note([SECTION, image, &setting, "RMSE"], Kind::Error, *rmse);
        context.figures.note([SECTION, image, &setting, "max"], Kind::Error, *max);
    }
}

/// Whether no other method is both faster and more accurate.
fn is_efficient(one: &Measured, column: &Column) -> bool {
    shown(column).all(|other| other.time >= one.time || other.errors[0] >= one.errors[0])
}

fn rows(column: &Column) -> Vec<Vec<String>> {
    let row = |found: &Measured| {
        let efficient = if is_efficient(found, column) { "yes" } else { "" };
        vec![
            found.method.name().into(),
            found.method.core().into(),
            number(found.time),
            number(found.texels),
            number(found.errors[0]),
            number(found.errors[1]),
            efficient.into(),
        ]
    };
    shown(column).map(row).collect()
}

fn plot(image: &str, column: &Column) -> Plot {
    let of = |(name, filter): (&str, _)| Series {
        name: name.into(),
        points: shown(column)
            .filter(|found| found.method.filter == filter)
            .map(|found| (found.time, found.errors[0], found.method.core().into()))
            .collect(),
        joined: true,
        rings: false,
    };
    Plot {
        title: format!("{image}, {}:1: error against time", column.anisotropy),
        axes: ["ns a lookup".into(), "RMSE".into()],
        series: FILTERS.into_iter().map(of).collect(),
    }
}

fn verdict(column: &Column) -> String {
    let printed = &column.methods[0];
    let default = column.of(Method { filter: Sampler::default().filter, level: Some(Level::choose()) });
    format!(
        "{}:1: the default filter ({}, {}) takes 1/{:.1} of the time of the printed EWA of the scalar core, with {:.2} times the RMSE \
         that the printed one has at its best width.",
        column.anisotropy,
        default.method.name(),
        default.method.core(),
        printed.time / default.time,
        default.errors[0] / column.best_printed,
    )
}
