//! Error against time of the whole pipeline, one axis varied at a time.

use super::Context;
use super::figures::Kind;
use super::fit::exponent;
use super::html::{Block, Section};
use super::metrics::{Picture, distance, mean_flip};
use super::plot::{Plot, Series, number};
use super::scenes::Subjects;
use super::truth::{Exact, Truth, cached};
use rayon::prelude::*;
use splat_bench::timing::Times;
use splat_core::sampling::SampleTable;
use splat_core::{Film, PatternKind, PixelFilter, RenderOptions, TableMode};
use splat_simd::{Level, Renderer};

/// The name of this part among the figures.
pub const SECTION: &str = "whole";

/// Samples a pixel where another axis is varied.
const SAMPLES: u32 = 16;

/// The axes, in the order of the report.
const AXES: [&str; 5] = ["samples", "pattern", "filter", "table", "core"];

/// Who renders.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Core {
    Reference,
    Fast(Level),
}

/// A setting of an axis.
#[derive(Debug, Clone)]
struct Setting {
    axis: &'static str,
    name: String,
    options: RenderOptions,
    core: Core,
}

/// What was measured of a setting.
struct Measured {
    setting: Setting,
    times: Times,
    rmse: f64,
    max: f64,
    flip: f64,
    /// Against the truth of the same samples: the error of the arithmetic alone.
    arithmetic: f64,
}

impl Measured {
    /// A time that does not depend on how many samples a setting happens to have: with the error falling as time^-p, the
    /// time in which it would reach an error of 1.
    fn time_to_error(&self, p: f64) -> f64 {
        self.times.least() * self.rmse.powf(1.0 / p)
    }
}

/// The settings of every axis. The first of each other axis than samples is the default.
fn settings(defaults: &RenderOptions, quick: bool) -> Vec<Setting> {
    let best = Level::choose();
    let base = RenderOptions { samples: SAMPLES, ..defaults.clone() };
    let mut all = Vec::new();
    let mut add = |axis, name: String, options: RenderOptions, core| {
        all.push(Setting { axis, name, options, core });
    };
    let counts: &[u32] = if quick { &[1, 4, 16, 64] } else { &[1, 2, 4, 8, 16, 32, 64] };
    for &samples in counts {
        add("samples", samples.to_string(), RenderOptions { samples, ..base.clone() }, Core::Fast(best));
    }
    for pattern in PATTERN_KINDS {
        let name = pattern_name(pattern).into();
        add("pattern", name, RenderOptions { pattern, ..base.clone() }, Core::Fast(best));
    }
    for (filter, name) in [
        (PixelFilter::BlackmanHarris, "blackman-harris"),
        (PixelFilter::Box, "box"),
        (PixelFilter::Tent, "tent"),
        (PixelFilter::Gaussian, "gaussian"),
    ] {
        add("filter", name.into(), RenderOptions { filter, ..base.clone() }, Core::Fast(best));
    }
    for (table, name) in TABLES {
        add("table", name.into(), RenderOptions { table, ..base.clone() }, Core::Fast(best));
    }
    for level in Level::available().into_iter().rev() {
        add("core", format!("fast, {}", level.name()), base.clone(), Core::Fast(level));
    }
    add("core", "reference".into(), base, Core::Reference);
    all
}

/// All kinds of patterns, the default first.
pub const PATTERN_KINDS: [PatternKind; 3] =
    [PatternKind::Dealt, PatternKind::Sobol, PatternKind::PoissonDisc];

/// The name of a kind of pattern.
pub fn pattern_name(pattern: PatternKind) -> &'static str {
    match pattern {
        PatternKind::Dealt => "dealt",
        PatternKind::Sobol => "sobol",
        PatternKind::PoissonDisc => "poisson",
    }
}

/// All forms of the kernel's table, the default first.
pub const TABLES: [(TableMode, &str); 5] = [
    (TableMode::Poly8, "poly8"),
    (TableMode::Quartic8, "quartic8"),
    (TableMode::Lerp256, "lerp256"),
    (TableMode::Midpoint256, "midpoint256"),
    (TableMode::Floor256, "floor256"),
];

/// A film's colours.
pub fn picture_of(film: &Film) -> Picture {
    film.rgba.iter().map(|rgba| rgba.map(f64::from)).collect()
}

/// The truth of a scene, and the root of the mean square of its own error, for the scene's filter.
///
/// # Errors
/// If the cache cannot be written.
pub fn truth_of(scene: &Subjects, context: &Context) -> anyhow::Result<(Truth, f64)> {
    // Two halves of at least 512 samples each, whose difference tells the error of their mean.
    let side = context.truth_side;
    let [a, b] = [0x5EED, 0xF00D]
        .map(|seed| cached(&context.cache, &scene.cloud, &scene.camera, &scene.options, side, seed));
    let (a, b) = (a?, b?);
    let filter = scene.options.filter;
    let noise = 0.5 * distance(a.of(filter), b.of(filter)).rmse;
    Ok((Truth::mean(&a, &b), noise))
}

/// Renders every setting of every scene.
///
/// # Errors
/// If something cannot be rendered.
pub fn section(scenes: &[Subjects], context: &mut Context) -> anyhow::Result<Section> {
    let mut section = Section::new("Error against time: the whole pipeline");
    section.text(format!(
        "One axis is varied at a time; the others are at the renderer's defaults, {SAMPLES} samples a pixel, one thread, level {}. \
         Time is the least of {} frames (Renderer::render, its buffers kept; for the reference splat_core::render), in which all settings \
         take turns. RMSE and maximum are over linear, premultiplied red, green, blue and alpha, against pictures \
         in f64 with exact exp, {} samples in each pixel's square of an independent generator, weighed by the filter. FLIP is the mean \
         at 67 pixels a degree before black. “arithmetic” is the RMSE against the same f64 pipeline at the renderer's own samples: \
         what f32, tables and dropped splats alone do.",
        Level::choose().name(),
        context.repetitions,
        2 * context.truth_side * context.truth_side,
    ));
    let mut all: Vec<Vec<Measured>> = Vec::new();
    let mut slopes = Vec::new();
    for scene in scenes {
        context.say(&format!("{}: the truth", scene.name));
        let (truth, truth_error) = truth_of(scene, context)?;
        context.say(&format!("{}: settings", scene.name));
        let measured = measure(scene, &truth, context)?;
        for one in &measured {
            let Measured { setting, times, rmse, max, flip, arithmetic } = one;
            let at = format!("{}: {}", setting.axis, setting.name);
            let mut note = |quantity, kind, value| {
                context.figures.note([SECTION, scene.name, &at, quantity], kind, value);
            };
            note("RMSE", Kind::Error, *rmse);
            note("max", Kind::Error, *max);
            note("FLIP", Kind::Error, *flip);
            note("arithmetic RMSE", Kind::Error, *arithmetic);
            context.figures.note_noisy(
                [SECTION, scene.name, &at, "time, ms"],
                Kind::Time,
                times.least(),
                times.noise(),
            );
        }
        context.figures.note([SECTION, scene.name, "truth", "RMSE of its own"], Kind::Plain, truth_error);
        let by_samples: Vec<[f64; 2]> = measured
            .iter()
            .filter(|one| one.setting.axis == "samples")
            .map(|one| [f64::from(one.setting.options.samples), one.rmse])
            .collect();
        let slope = -exponent(&by_samples).unwrap_or(0.0);
        slopes.push(slope);
        section.heading(format!("{}: {}", scene.name, scene.about));
        section.text(format!(
            "{} splats, {} x {}. The truth's own RMSE is {} (from its two halves). RMSE falls as samples^-{slope:.2}.",
            scene.cloud.len(),
            scene.camera.width,
            scene.camera.height,
            number(truth_error)
        ));
        section.blocks.push(Block::Plot(plot(scene.name, &measured)));
        section.table(
            &["axis", "setting", "time, ms", "RMSE", "max", "FLIP", "arithmetic", "Pareto"],
            rows(&measured),
        );
        all.push(measured);
    }
    section.heading("What to choose");
    for axis in AXES {
        section.verdict(choice(axis, &all, &slopes));
    }
    Ok(section)
}

/// Renders the settings of a scene in turns, and judges their pictures.
fn measure(scene: &Subjects, truth: &Truth, context: &Context) -> anyhow::Result<Vec<Measured>> {
    let settings = settings(&scene.options, context.quick);
    let mut renderers = Vec::new();
    for setting in &settings {
        renderers.push(match setting.core {
            Core::Fast(level) => Some(Renderer::new(1, level)?),
            Core::Reference => None,
        });
    }
    let mut times = vec![Times::default(); settings.len()];
    let mut pictures = vec![Picture::new(); settings.len()];
    for repetition in 0..context.repetitions {
        for (i, setting) in settings.iter().enumerate() {
            let Subjects { cloud, camera, .. } = scene;
            let rendered = times[i].measure(|| match &mut renderers[i] {
                Some(renderer) => renderer.render(cloud, camera, &setting.options, &mut |_| {}),
                None => splat_core::render(cloud, camera, &setting.options, &mut |_| {}),
            })?;
            if repetition == 0 {
                pictures[i] = picture_of(&rendered.film);
            }
        }
    }
    let size = [scene.camera.width, scene.camera.height];
    // The exact picture of the samples changes with the samples only.
    let mut exact: Vec<(RenderOptions, Picture)> = Vec::new();
    let mut of_setting = Vec::new();
    for setting in &settings {
        let same_samples = RenderOptions { table: TableMode::Poly8, ..setting.options.clone() };
        let known = exact.iter().position(|(options, _)| *options == same_samples);
        of_setting.push(known.unwrap_or_else(|| {
            let Subjects { cloud, camera, .. } = scene;
            let table = SampleTable::new(&setting.options, camera.lens(), camera.pixel_scale());
            let picture = Exact::new(cloud, camera, &setting.options).with_samples_of(&table);
            exact.push((same_samples, picture));
            exact.len() - 1
        }));
    }
    // FLIP takes longer than most pictures: not twice for the same one, and several at once.
    let first_alike: Vec<usize> = (0..settings.len())
        .map(|i| {
            let alike = |j: &usize| {
                settings[*j].options.filter == settings[i].options.filter && pictures[*j] == pictures[i]
            };
            (0..i).find(alike).unwrap_or(i)
        })
        .collect();
    let judge = |i: usize| {
        let true_picture = truth.of(settings[i].options.filter);
        let flip = (first_alike[i] == i).then(|| mean_flip(true_picture, &pictures[i], size));
        let arithmetic = distance(&exact[of_setting[i]].1, &pictures[i]).rmse;
        (distance(true_picture, &pictures[i]), flip, arithmetic)
    };
    let judged: Vec<_> = (0..settings.len()).into_par_iter().map(judge).collect();
    let flips: Vec<f64> = first_alike.iter().map(|&i| judged[i].1.unwrap_or(f64::NAN)).collect();
    let all = settings.into_iter().zip(times).zip(judged).zip(flips);
    Ok(all
        .map(|(((setting, times), (error, _, arithmetic)), flip)| Measured {
            rmse: error.rmse,
            max: error.max,
            flip,
            arithmetic,
            setting,
            times,
        })
        .collect())
}

/// Whether no other setting of the same filter is both faster and more accurate.
fn is_efficient(one: &Measured, all: &[Measured]) -> bool {
    let same_filter = |other: &&Measured| other.setting.options.filter == one.setting.options.filter;
    all.iter().filter(same_filter).all(|other| {
        let [slower, worse] = [other.times.least() >= one.times.least(), other.rmse >= one.rmse];
        slower || worse
    })
}

fn rows(measured: &[Measured]) -> Vec<Vec<String>> {
    measured
        .iter()
        .map(|one| {
            vec![
                one.setting.axis.into(),
                one.setting.name.clone(),
                number(one.times.least()),
                number(one.rmse),
                number(one.max),
                number(one.flip),
                number(one.arithmetic),
                if is_efficient(one, measured) { "yes".into() } else { String::new() },
            ]
        })
        .collect()
}

fn plot(scene: &str, measured: &[Measured]) -> Plot {
    let of = |axis: &'static str| Series {
        name: axis.into(),
        points: measured
            .iter()
            .filter(|one| one.setting.axis == axis)
            .map(|one| (one.times.least(), one.rmse, one.setting.name.clone()))
            .collect(),
        joined: axis == "samples",
        rings: false,
    };
    let mut efficient: Vec<(f64, f64, String)> = measured
        .iter()
        .filter(|one| is_efficient(one, measured))
        .map(|one| (one.times.least(), one.rmse, String::new()))
        .collect();
    efficient.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut series: Vec<Series> = AXES.into_iter().map(of).collect();
    series.push(Series {
        name: "Pareto (same filter)".into(),
        points: efficient,
        joined: false,
        rings: true,
    });
    Plot {
        title: format!("{scene}: error against time"),
        axes: ["time of a frame, ms, one thread".into(), "RMSE".into()],
        series,
    }
}

/// A plain sentence of what to choose on an axis, from what was measured over all scenes.
fn choice(axis: &str, scenes: &[Vec<Measured>], slopes: &[f64]) -> String {
    if scenes.is_empty() {
        return format!("{axis}: no scene was measured.");
    }
    let of_axis = |scene: &'_ [Measured]| -> Vec<usize> {
        (0..scene.len()).filter(|&i| scene[i].setting.axis == axis).collect()
    };
    let mean = |value: &dyn Fn(&[Measured], f64, usize) -> f64, place: usize| {
        let logs =
            scenes.iter().zip(slopes).map(|(scene, &slope)| value(scene, slope, of_axis(scene)[place]).ln());
        (logs.sum::<f64>() / scenes.len() as f64).exp()
    };
    let time = |scene: &[Measured], _: f64, i: usize| scene[i].times.least();
    let rmse = |scene: &[Measured], _: f64, i: usize| scene[i].rmse;
    let arithmetic = |scene: &[Measured], _: f64, i: usize| scene[i].arithmetic;
    let to_error = |scene: &[Measured], slope: f64, i: usize| scene[i].time_to_error(slope.max(0.1));
    let indices = of_axis(&scenes[0]);
    let places = 0..indices.len();
    let name = |place: usize| scenes[0][indices[place]].setting.name.as_str();
    let least = |value: &dyn Fn(usize) -> f64| {
        places.clone().min_by(|&a, &b| value(a).total_cmp(&value(b))).unwrap_or(0)
    };
    // Means over the scenes are geometric.
    match axis {
        "samples" => {
            let last = places.end - 1;
            let times: Vec<[f64; 2]> = places
                .clone()
                .map(|place| {
                    let samples = scenes[0][indices[place]].setting.options.samples;
                    [f64::from(samples), mean(&time, place)]
                })
                .collect();
            let growth = exponent(&times).unwrap_or(0.0);
            // The fast core takes samples in eights, so that some cost next to nothing.
            let free = places.clone().rfind(|&place| times[place][1] <= 1.1 * times[0][1]).unwrap_or(0);
            format!(
                "samples: twice the samples divide the error by {:.2} and multiply the time by {:.2} (means over the scenes); \
                 from {} to {} the error falls from {} to {}, the time grows from {} to {} ms. \
                 {} samples take at most a tenth longer than {}: take these at least, and else as many as the time allows.",
                2f64.powf(slopes.iter().sum::<f64>() / slopes.len() as f64),
                2f64.powf(growth),
                name(0),
                name(last),
                number(mean(&rmse, 0)),
                number(mean(&rmse, last)),
                number(mean(&time, 0)),
                number(mean(&time, last)),
                name(free),
                name(0),
            )
        }
        "pattern" | "filter" => {
            let best = least(&|place| mean(&to_error, place));
            let rest: Vec<String> = places
                .clone()
                .filter(|&place| place != best)
                .map(|place| {
                    let ratio = mean(&to_error, place) / mean(&to_error, best);
                    format!("{} {ratio:.2} times", name(place))
                })
                .collect();
            let against = if axis == "filter" {
                ", each against its own truth (a narrower filter is noisier or sharper, not wrong)"
            } else {
                ""
            };
            format!(
                "{axis}: {} reaches a given error soonest; to the same error take: {}{against}.",
                name(best),
                rest.join(", ")
            )
        }
        "table" => {
            // What remains at the most samples measured, a tenth of it.
            let samples: Vec<f64> = scenes
                .iter()
                .map(|scene| {
                    let of_samples = scene.iter().filter(|one| one.setting.axis == "samples");
                    of_samples.map(|one| one.rmse).fold(f64::INFINITY, f64::min)
                })
                .collect();
            let invisible = |place: usize| {
                let errors = scenes.iter().map(|scene| scene[of_axis(scene)[place]].arithmetic);
                errors.zip(&samples).all(|(error, sampling)| error < 0.1 * sampling)
            };
            let fastest = places
                .clone()
                .filter(|&place| invisible(place))
                .min_by(|&a, &b| mean(&time, a).total_cmp(&mean(&time, b)));
            let list: Vec<String> = places
                .clone()
                .map(|place| {
                    format!(
                        "{} {} ms, {}",
                        name(place),
                        number(mean(&time, place)),
                        number(mean(&arithmetic, place))
                    )
                })
                .collect();
            let chosen = match fastest {
                Some(place) => format!("{} is the fastest whose arithmetic error stays below a tenth of the sampling error of the most samples", name(place)),
                None => "the arithmetic error of each exceeds a tenth of the sampling error of the most samples in some scene".into(),
            };
            format!("table: {chosen} (time and arithmetic RMSE: {}).", list.join("; "))
        }
        _ => {
            let best = least(&|place| mean(&time, place));
            let same = scenes.iter().all(|scene| {
                let places = of_axis(scene);
                places.iter().all(|&i| scene[i].rmse.to_bits() == scene[places[0]].rmse.to_bits())
            });
            let rest: Vec<String> = places
                .clone()
                .filter(|&place| place != best)
                .map(|place| {
                    format!(
                        "{} takes {:.2} times as long",
                        name(place),
                        mean(&time, place) / mean(&time, best)
                    )
                })
                .collect();
            let error = if same {
                "All have the same error, to the last bit."
            } else {
                "Their errors differ, which they must not."
            };
            format!("core: {} is the fastest; {}. {error}", name(best), rest.join(", "))
        }
    }
}
