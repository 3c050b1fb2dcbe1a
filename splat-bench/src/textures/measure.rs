//! Times and errors.

use super::images::{Lookups, Subject};
use crate::timing::Times;
use anyhow::Context;
use splat_core::texture::filter::Average;
use splat_core::texture::{Filter, Probes, Quality, Sampler};
use splat_simd::Level;
use splat_simd::texture::LaneSampler;
use std::hint::black_box;
use std::time::Instant;

/// Anisotropies that are measured.
pub const ANISOTROPIES: [f64; 4] = [1.0, 4.0, 16.0, 64.0];

/// Tiles of [`run`].
const FULL_TILES: usize = 64;

/// The least anisotropy of which fewer lookups are timed.
const FEWER_FROM: f64 = 16.0;

/// The largest anisotropy that samplers honour.
const MAX_ANISOTROPY: f64 = 64.0;

/// Widths among which the printed EWA's best one is looked for.
const WIDTHS: std::ops::RangeInclusive<u32> = 4..=12;

/// The sizes of footprints: a name, and the range of the minor semi-axis in texels.
pub const SETS: [(&str, [f64; 2]); 2] = [("look", [0.75, 3.0]), ("smaller", [2.0, 8.0])];

/// How much is measured.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// Tiles of 64 lookups that are timed, of small anisotropies and of large ones.
    pub tiles: [usize; 2],
    /// Lookups whose truth is found.
    pub truths: usize,
    /// How many times each filter is timed.
    pub repetitions: usize,
}

/// A filter of the scalar core (no level) or of lanes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Method {
    /// The filter.
    pub filter: Filter,
    /// The level of lanes.
    pub level: Option<Level>,
}

/// What is known of a method for one image, set and anisotropy.
#[derive(Debug, Clone, Copy)]
pub struct Measured {
    /// The method.
    pub method: Method,
    /// Nanoseconds a lookup: the least of all repetitions.
    pub time: f64,
    /// How far the median of the repetitions is above the least, relative to it.
    pub noise: f64,
    /// Texels read by a lookup, in the mean.
    pub texels: f64,
    /// Root mean squared and greatest error.
    pub errors: [f64; 2],
}

/// Everything of one image, set and anisotropy.
#[derive(Debug)]
pub struct Column {
    /// Major over minor semi-axis.
    pub anisotropy: f64,
    /// Every method, in the order of [`Method::all`].
    pub methods: Vec<Measured>,
    /// The root mean squared error of the printed EWA at its best width.
    pub best_printed: f64,
}

impl Column {
    /// What was measured of a method.
    pub fn of(&self, method: Method) -> &Measured {
        self.methods.iter().find(|found| found.method == method).unwrap_or(&self.methods[0])
    }
}

/// Every filter with its name.
pub const FILTERS: [(&str, Filter); 9] = [
    ("EWA as printed", Filter::EwaPrinted),
    ("EWA", Filter::Ewa),
    ("EWA, compensated, Q = 1.5", Filter::EwaVc(Quality::FAST)),
    ("EWA, compensated, Q = 2", Filter::EwaVc(Quality::DEFAULT)),
    ("EWA, compensated, Q = 3", Filter::EwaVc(Quality::REFERENCE)),
    ("Footprint Assembly, Texram", Filter::Assembly(Probes::Texram)),
    ("Footprint Assembly, Texram, ceiling", Filter::Assembly(Probes::TexramCeiling)),
    ("Footprint Assembly, Gaussian", Filter::Assembly(Probes::Gaussian)),
    ("trilinear", Filter::Trilinear),
];

impl Method {
    /// Every filter of both cores, the printed EWA of the scalar one first.
    pub fn all() -> Vec<Self> {
        let mut methods = Vec::new();
        for (_, filter) in FILTERS {
            methods.push(Self { filter, level: None });
            if filter != Filter::EwaPrinted {
                methods
                    .extend(Level::available().into_iter().map(|level| Self { filter, level: Some(level) }));
            }
        }
        methods
    }

    /// The filter's name.
    pub fn name(self) -> &'static str {
        FILTERS.iter().find(|(_, filter)| *filter == self.filter).map_or("", |(name, _)| name)
    }

    /// The core's name.
    pub fn core(self) -> &'static str {
        self.level.map_or("scalar", |level| level.name())
    }

    fn sampler(self, width: f64) -> Sampler {
        Sampler { filter: self.filter, max_anisotropy: MAX_ANISOTROPY, width, ..Sampler::default() }
    }

    fn run(self, subject: &Subject, lookups: &Lookups, found: &mut [Average], width: f64) {
        let sampler = self.sampler(width);
        let requests = &lookups.requests[..found.len()];
        match self.level {
            Some(level) => LaneSampler::new(&sampler).lookups(level, &subject.lanes, requests, found),
            None => {
                for (request, found) in requests.iter().zip(found) {
                    *found = sampler.average(&subject.pyramid, request.st, &request.footprint);
                }
            }
        }
    }
}

/// Nanoseconds a lookup of a filter in the first set: the least of some repetitions.
///
/// # Errors
/// If there is no such filter.
pub fn run(subject: &Subject, name: &str, anisotropy: f64, count: usize) -> anyhow::Result<f64> {
    let found = FILTERS.into_iter().find(|(known, _)| *known == name);
    let names = FILTERS.map(|(known, _)| known).join("; ");
    let (_, filter) = found.with_context(|| format!("found filter {name:?}, expected one of {names}"))?;
    let method = Method { filter, level: Some(Level::choose()) };
    let lookups = Lookups::new(subject.image.size, SETS[0].1, anisotropy, FULL_TILES);
    let mut found = vec![Average::default(); lookups.requests.len()];
    let mut least = f64::INFINITY;
    for _ in 0..count.div_ceil(found.len()) {
        let start = Instant::now();
        method.run(subject, &lookups, &mut found, 1.0);
        least = least.min(start.elapsed().as_nanos() as f64 / found.len() as f64);
        black_box(&mut found);
    }
    Ok(least)
}

/// Measures all methods.
pub fn column(subject: &Subject, set: usize, anisotropy: f64, effort: Effort) -> Column {
    let (_, minor) = SETS[set];
    let fewer = usize::from(anisotropy >= FEWER_FROM);
    let lookups = Lookups::new(subject.image.size, minor, anisotropy, effort.tiles[0]);
    let mut found = vec![Average::default(); lookups.requests.len()];
    let methods = Method::all();

    let timed = 64 * effort.tiles[fewer];
    let mut times = vec![Times::default(); methods.len()];
    // One after the other, so that what slows the machine for a while slows them all.
    for _ in 0..effort.repetitions {
        for (method, time) in methods.iter().zip(&mut times) {
            time.measure(|| method.run(subject, &lookups, &mut found[..timed], 1.0));
            black_box(&mut found);
        }
    }

    let chosen = Lookups::every(&lookups, lookups.lookups.len() / effort.truths);
    let truths: Vec<[f64; 4]> = chosen.lookups.iter().map(|lookup| subject.image.truth(lookup)).collect();
    let mut errors = |method: Method, width: f64| {
        let found = &mut found[..truths.len()];
        method.run(subject, &chosen, found, width);
        (errors(found, &truths, subject.image.channels), texels(found))
    };
    let printed = methods[0];
    let of_width = |width: u32| errors(printed, 0.1 * f64::from(width)).0[0];
    let best_printed = WIDTHS.map(of_width).fold(f64::INFINITY, f64::min);
    let measured = methods.iter().zip(&times).map(|(&method, times)| {
        let (errors, texels) = errors(method, 1.0);
        let time = 1e6 * times.least() / timed as f64;
        Measured { method, time, noise: times.noise(), texels, errors }
    });
    let methods = measured.collect();
    Column { anisotropy, methods, best_printed }
}

impl Lookups {
    /// Some of them.
    fn every(&self, step: usize) -> Self {
        Self {
            lookups: self.lookups.iter().step_by(step.max(1)).copied().collect(),
            requests: self.requests.iter().step_by(step.max(1)).copied().collect(),
        }
    }
}

fn texels(found: &[Average]) -> f64 {
    found.iter().map(|average| f64::from(average.texels)).sum::<f64>() / found.len() as f64
}

/// Root of the mean squared error, and the greatest.
fn errors(found: &[Average], truths: &[[f64; 4]], channels: usize) -> [f64; 2] {
    let (mut sum, mut greatest) = (0.0, 0.0_f64);
    for (average, truth) in found.iter().zip(truths) {
        for (&value, truth) in average.color.iter().zip(truth).take(channels) {
            let error = f64::from(value) - truth;
            sum += error * error;
            greatest = greatest.max(error.abs());
        }
    }
    [(sum / (found.len() * channels) as f64).sqrt(), greatest]
}
