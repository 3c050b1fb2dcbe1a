//! Error against time of the parts: the kernel's tables, the evaluation of a sample, the candidates.

use super::Context;
use super::figures::Kind;
use super::html::{Block, Section};
use super::plot::{Plot, Series, number};
use super::scenes::Subjects;
use super::whole::TABLES;
use glam::{DVec2, DVec3};
use splat_bench::timing::Times;
use splat_core::evaluate::{Hit, LensPoint, Limits, SplatConstants};
use splat_core::kernel::KernelTable;
use splat_core::real::Real;
use splat_core::setup::{CameraSplat, ErrorBound, View, camera_splat, project, set_up};
use splat_core::{Camera, Cloud, Kernel, RenderOptions};
use splat_tests::core_scenes::{ellipses, image_of, orthographic, pinhole, thin_lens, tilted_axes};
use splat_tests::random::Random;
use std::hint::black_box;

/// The name of this part among the figures.
const SECTION: &str = "parts";

/// Measures all parts.
///
/// # Errors
/// If a scene cannot be rendered.
pub fn section(scenes: &[Subjects], context: &mut Context) -> anyhow::Result<Section> {
    let mut section = Section::new("Error against time: the parts");
    context.say("the kernel's tables");
    tables(&mut section, context);
    context.say("the evaluation of a sample");
    evaluation(&mut section, context);
    context.say("candidates");
    candidates(&mut section, scenes, context)?;
    Ok(section)
}

/// The tables against exact exp.
fn tables(section: &mut Section, context: &mut Context) {
    const COUNT: usize = 1_000_000;
    section.heading("Tables of the kernel");
    section.text(format!(
        "Against exp of libm in f64, at {COUNT} places r2 spread evenly over [0, F): largest and mean error, and the mean with its \
         sign (bias). The time is that of the scalar table alone, the values added up."
    ));
    let mut rows = Vec::new();
    let mut series: Vec<Series> = Vec::new();
    for (kernel, name, cutoff) in [
        (Kernel::Gaussian, "gaussian", 2.0),
        (Kernel::Windowed, "windowed", 4.0),
        (Kernel::Gaussian, "gaussian", 9.0),
    ] {
        let places: Vec<f32> = (0..COUNT)
            .map(|i| (i as f64 / COUNT as f64 * cutoff) as f32)
            .filter(|&r2| f64::from(r2) < cutoff)
            .collect();
        let exact: Vec<f64> = places.iter().map(|&r2| kernel.value(f64::from(r2), cutoff)).collect();
        let all = TABLES.map(|(mode, name)| (KernelTable::new(kernel, cutoff, mode), name));
        let mut times = vec![Times::default(); TABLES.len() + 1];
        for _ in 0..context.repetitions {
            for ((table, _), times) in all.iter().zip(&mut times) {
                black_box(times.measure(|| places.iter().map(|&r2| table.weight(r2)).sum::<f32>()));
            }
            let exp = || places.iter().map(|&r2| libm::expf(-0.5 * r2)).sum::<f32>();
            black_box(times[TABLES.len()].measure(exp));
        }
        let subject = format!("{name}, F = {cutoff}");
        let mut points = Vec::new();
        for (i, (table, mode)) in all.iter().enumerate() {
            let errors: Vec<f64> =
                places.iter().zip(&exact).map(|(&r2, exact)| f64::from(table.weight(r2)) - exact).collect();
            let max = errors.iter().fold(0.0f64, |max, error| max.max(error.abs()));
            let mean = errors.iter().map(|error| error.abs()).sum::<f64>() / errors.len() as f64;
            let bias = errors.iter().sum::<f64>() / errors.len() as f64;
            let nanoseconds = times[i].least() * 1e6 / places.len() as f64;
            let mut note = |quantity, kind, value| {
                context.figures.note([SECTION, &subject, mode, quantity], kind, value);
            };
            note("max error", Kind::Error, max);
            note("mean error", Kind::Error, mean);
            note("bias", Kind::Plain, bias);
            context.figures.note_noisy(
                [SECTION, &subject, mode, "time, ns"],
                Kind::Time,
                nanoseconds,
                times[i].noise(),
            );
            points.push((nanoseconds, max, (*mode).into()));
            rows.push(
                [
                    subject.clone(),
                    (*mode).into(),
                    number(max),
                    number(mean),
                    number(bias),
                    number(nanoseconds),
                ]
                .into(),
            );
        }
        let exp = times[TABLES.len()].least() * 1e6 / places.len() as f64;
        rows.push(
            [
                subject.clone(),
                "expf of libm".into(),
                String::new(),
                String::new(),
                String::new(),
                number(exp),
            ]
            .into(),
        );
        series.push(Series { name: subject, points, joined: false, rings: false });
    }
    section.table(&["kernel", "table", "max", "mean", "bias", "ns a value"], rows);
    let axes = ["ns a value, scalar".into(), "largest error".into()];
    section.blocks.push(Block::Plot(Plot { title: "Kernel tables".into(), axes, series }));
}

/// A splat in f64 and as set-up rounds it, and its view.
pub struct Subject {
    splat: CameraSplat,
    view: View,
    exact: SplatConstants<f64>,
    rounded: SplatConstants<f32>,
}

impl Subject {
    /// The only splat of a cloud. `None` if set-up drops it.
    pub fn new(cloud: &Cloud, camera: &Camera, options: &RenderOptions) -> Option<Self> {
        let view = View::new(camera, options);
        let splat = camera_splat(cloud, 0, &view);
        let rounded = set_up(cloud, &view, options).splats.first()?.constants;
        // The threshold of lens points in the splat's plane belongs to both.
        let exact = SplatConstants { edge_on: f64::from(rounded.edge_on), ..project(&splat, &view)? };
        Some(Self { splat, view, exact, rounded })
    }

    fn hit<R: Real>(&self, c: &SplatConstants<R>, d: [R; 2], lens: &LensPoint<R>) -> Option<Hit<R>> {
        let limits = Limits::new(self.view.cutoff, self.view.near, self.view.far);
        match self.view.lens {
            _ if self.view.orthographic => c.orthographic(d, &limits),
            None => c.pinhole(d, &limits),
            Some(_) => c.thin_lens(d, lens, &limits),
        }
    }

    fn bound(&self, d: [f64; 2], lens: &LensPoint<f64>) -> ErrorBound {
        let jitter = self.view.max_jitter();
        match self.view.lens {
            _ if self.view.orthographic => self.exact.orthographic_error(d, jitter, self.view.cutoff),
            None => self.exact.pinhole_error(d, jitter),
            Some(_) => self.exact.thin_lens_error(d, jitter, lens),
        }
    }
}

/// What samples of a splat showed.
#[derive(Debug, Default, Clone, Copy)]
struct Errors {
    hits: usize,
    disagree: usize,
    /// Disagreements outside the band in which the bound allows them.
    unexplained: usize,
    uv: f64,
    uv_bound: f64,
    depth: f64,
    depth_bound: f64,
    weight: f64,
}

/// A sample: pixel, jitter, point on the unit aperture.
type Sample = ([i32; 2], [f32; 2], [f32; 2]);

/// Samples aimed at a splat, and a little beside it.
fn aimed(subject: &Subject, count: usize) -> Vec<Sample> {
    let mut random = Random::new(11);
    let view = &subject.view;
    (0..count)
        .filter_map(|_| {
            let unit = random.in_disc().to_array().map(|value| value as f32);
            let aim = random.in_disc() * (1.02 * view.radius);
            let splat = &subject.splat;
            let point = splat.center + aim.x * splat.axes[0] + aim.y * splat.axes[1];
            let shift = DVec2::new(random.range(-1.0, 2.0), random.range(-1.0, 2.0));
            let pixel = image_of(view, point, unit);
            let seen = point.z > view.near && pixel.abs().max_element() < 1e6;
            let whole = (pixel - shift).round();
            let jitter = (pixel - whole).to_array().map(|value| value as f32);
            seen.then(|| (whole.as_ivec2().to_array(), jitter, unit))
        })
        .collect()
}

/// Compares f32 with f64, sample by sample.
fn compare(subject: &Subject, samples: &[Sample]) -> Errors {
    let mut errors = Errors::default();
    let view = &subject.view;
    for &([x, y], jitter, unit) in samples {
        let lens = |lens| {
            (LensPoint::new(unit, lens, view.pixel_scale), LensPoint::new(unit, lens, view.pixel_scale))
        };
        let none = (LensPoint { p: [0.0f32; 2] }, LensPoint { p: [0.0f64; 2] });
        let (lens32, lens64) = view.lens.map_or(none, lens);
        let d = subject.exact.offset(x, y, jitter.map(f64::from));
        let exact = subject.hit(&subject.exact, d, &lens64);
        let rounded = subject.hit(&subject.rounded, subject.rounded.offset(x, y, jitter), &lens32);
        let bound = subject.bound(d, &lens64);
        match (exact, rounded) {
            (Some(exact), Some(rounded)) => {
                errors.hits += 1;
                let uv = (f64::from(rounded.u) - exact.u).abs().max((f64::from(rounded.v) - exact.v).abs());
                errors.uv = errors.uv.max(uv);
                errors.uv_bound = errors.uv_bound.max(bound.u.max(bound.v));
                errors.depth = errors.depth.max((f64::from(rounded.depth) - exact.depth).abs() / exact.depth);
                errors.depth_bound = errors.depth_bound.max(bound.depth / exact.depth);
                let weight = |r2: f64| libm::exp(-0.5 * r2);
                errors.weight = errors.weight.max((weight(f64::from(rounded.r2)) - weight(exact.r2)).abs());
            }
            (None, None) => {}
            (one, other) => {
                errors.disagree += 1;
                let r2 = one.map_or_else(|| other.map_or(f64::NAN, |hit| f64::from(hit.r2)), |hit| hit.r2);
                let depth =
                    one.map_or_else(|| other.map_or(f64::NAN, |hit| f64::from(hit.depth)), |hit| hit.depth);
                // The one that hits is itself off by no more than the bound.
                let explained = (r2 - view.cutoff).abs() <= 2.0 * bound.membership
                    || (depth - view.near).abs() <= 2.0 * bound.depth;
                errors.unexplained += usize::from(!explained);
            }
        }
    }
    errors
}

/// Splats of notes 3.2 of the specification: name, sigma of both axes in pixels, tilt, depth, lens, parallel rays.
fn cases() -> Vec<(&'static str, Cloud, Camera)> {
    const FOCAL: f64 = 1000.0;
    let splat = |depth: f64, corner: f64, tilt: f64, sigmas: [f64; 2]| {
        let center = DVec3::new(0.95 * corner, 0.53 * corner, 1.0) * depth;
        let lengths = sigmas.map(|sigma| sigma * depth / FOCAL);
        ellipses(&[(center, tilted_axes(center, tilt, 0.4, 0.9, lengths))])
    };
    let hole = || pinhole(1920, 1080, FOCAL);
    let lens = |radius, focus| thin_lens(1920, 1080, FOCAL, radius, focus);
    let parallel = || orthographic(1920, 1080, 200.0);
    vec![
        ("2 px, centre", splat(5.0, 0.0, 40.0, [2.0; 2]), hole()),
        ("2 px, corner", splat(5.0, 1.0, 40.0, [2.0; 2]), hole()),
        (".05 px", splat(5.0, 0.6, 40.0, [0.05; 2]), hole()),
        ("depth 1e5, 1 px", splat(1e5, 0.6, 40.0, [1.0; 2]), hole()),
        ("tilt 85, 2 px", splat(5.0, 0.6, 85.0, [2.0; 2]), hole()),
        ("tilt 89.9, 20 px", splat(5.0, 0.6, 89.9, [20.0; 2]), hole()),
        ("tilt 89.999, 200 px", splat(5.0, 0.6, 89.999, [200.0; 2]), hole()),
        ("1:100", splat(5.0, 0.6, 40.0, [10.0, 0.1]), hole()),
        ("lens, 2 px", splat(5.0, 0.6, 40.0, [2.0; 2]), lens(0.1, 2.0)),
        ("lens, tilt 89.9, 20 px", splat(5.0, 0.6, 89.9, [20.0; 2]), lens(0.1, 4.0)),
        ("lens wider than the splat", splat(5.0, 0.6, 40.0, [2.0; 2]), lens(1.0, 4.0)),
        ("parallel, 2 px", splat(5.0, 0.6, 40.0, [10.0; 2]), parallel()),
        ("parallel, tilt 89.9", splat(5.0, 0.6, 89.9, [100.0; 2]), parallel()),
    ]
}

/// The evaluation in f32 against f64.
fn evaluation(section: &mut Section, context: &mut Context) {
    let count = if context.quick { 20_000 } else { 200_000 };
    section.heading("Evaluation of a sample: f32 against f64");
    section.text(format!(
        "{count} samples aimed at a splat (F = 4, filter of radius 1.5): largest errors beside the largest a-priori bound (notes 3.5 of the \
         specification). Weights are exp(-r2/2), exact in both, so that the table does not count. Samples about which f32 and f64 disagree \
         must lie within the bound's band around the rim or the near plane."
    ));
    let mut rows = Vec::new();
    let mut worst: f64 = 0.0;
    let mut unexplained = 0;
    for (name, cloud, camera) in cases() {
        let options = RenderOptions { cutoff: 4.0, ..RenderOptions::default() };
        let Some(subject) = Subject::new(&cloud, &camera, &options) else {
            rows.push(vec![name.into(), "dropped by set-up".into()]);
            continue;
        };
        let samples = aimed(&subject, count);
        let errors = compare(&subject, &samples);
        let [mut single, mut double] = [Times::default(), Times::default()];
        for _ in 0..context.repetitions {
            black_box(single.measure(|| evaluate_all(&subject, &subject.rounded, &samples)));
            black_box(double.measure(|| evaluate_all(&subject, &subject.exact, &samples)));
        }
        let each = 1e6 / samples.len().max(1) as f64;
        let mut note = |quantity, kind, value| {
            context.figures.note([SECTION, "evaluation", name, quantity], kind, value);
        };
        note("(u, v) error, sigma", Kind::Error, errors.uv);
        note("(u, v) bound, sigma", Kind::Plain, errors.uv_bound);
        note("depth error, relative", Kind::Error, errors.depth);
        note("depth bound, relative", Kind::Plain, errors.depth_bound);
        note("weight error", Kind::Error, errors.weight);
        note("disagreements", Kind::Error, errors.disagree as f64);
        note("unexplained disagreements", Kind::Error, errors.unexplained as f64);
        for (quantity, times) in [("f32, ns", &single), ("f64, ns", &double)] {
            context.figures.note_noisy(
                [SECTION, "evaluation", name, quantity],
                Kind::Time,
                times.least() * each,
                times.noise(),
            );
        }
        worst = worst.max(errors.uv / errors.uv_bound).max(errors.depth / errors.depth_bound);
        unexplained += errors.unexplained;
        rows.push(vec![
            name.into(),
            errors.hits.to_string(),
            number(errors.uv),
            number(errors.uv_bound),
            number(errors.depth),
            number(errors.depth_bound),
            number(errors.weight),
            errors.disagree.to_string(),
            errors.unexplained.to_string(),
            number(single.least() * each),
            number(double.least() * each),
        ]);
    }
    section.table(
        &[
            "splat",
            "hits",
            "|d(u, v)|, sigma",
            "bound",
            "|dw|/w",
            "bound",
            "|d weight|",
            "disagree",
            "outside the band",
            "f32, ns",
            "f64, ns",
        ],
        rows,
    );
    section.verdict(format!(
        "The largest error of a splat is at most {worst:.2} of its largest bound; {unexplained} disagreements lie outside of the band."
    ));
}

/// Evaluates all samples, and adds up what they hit.
fn evaluate_all<R: Real>(subject: &Subject, constants: &SplatConstants<R>, samples: &[Sample]) -> R {
    let view = &subject.view;
    samples.iter().fold(R::ZERO, |sum, &([x, y], jitter, unit)| {
        let jitter = jitter.map(|value| R::from_f64(f64::from(value)));
        let point = match view.lens {
            Some(lens) => LensPoint::new(unit, lens, view.pixel_scale),
            None => LensPoint { p: [R::ZERO; 2] },
        };
        let hit = subject.hit(constants, constants.offset(x, y, jitter), &point);
        sum + hit.map_or(R::ZERO, |hit| hit.r2)
    })
}

/// How many samples are tested for a hit, and whether a hit lies outside of what is tested.
fn candidates(section: &mut Section, scenes: &[Subjects], context: &mut Context) -> anyhow::Result<()> {
    section.heading("Candidates: boxes and spans");
    section.text(
        "Samples that are tested for each fragment: in the boxes of set-up (the reference), and in the fast core's rows or \
         lattices. “outside”: hits of the evaluation in the 4 pixels around each box, which must not be.",
    );
    let mut rows = Vec::new();
    for scene in scenes {
        let Subjects { cloud, camera, .. } = scene;
        let options = RenderOptions { samples: 4, ..scene.options.clone() };
        let mut fragments = 0u64;
        let tests = splat_core::fragments(cloud, camera, &options, &mut |_, _, _| fragments += 1)?;
        let fast = splat_simd::render(cloud, camera, &options, &mut |_| {})?.statistics;
        let outside = outside_of_boxes(scene, &options);
        let [boxes, spans] = [tests as f64 / fragments as f64, fast.tests as f64 / fast.fragments as f64];
        let mut note = |quantity, kind, value| {
            context.figures.note([SECTION, "candidates", scene.name, quantity], kind, value);
        };
        note("tests a fragment, boxes", Kind::Error, boxes);
        note("tests a fragment, fast core", Kind::Error, spans);
        note("hits outside the boxes", Kind::Error, outside as f64);
        rows.push(vec![
            scene.name.into(),
            fragments.to_string(),
            number(boxes),
            number(spans),
            outside.to_string(),
        ]);
    }
    section.table(&["scene", "fragments", "boxes", "fast core", "outside"], rows);
    Ok(())
}

/// Hits in a border around the boxes of a scene's splats.
fn outside_of_boxes(scene: &Subjects, options: &RenderOptions) -> u64 {
    use splat_core::PixelRect;
    use splat_core::raster::Rasterizer;
    const BORDER: i32 = 4;
    let view = View::new(&scene.camera, options);
    let rasterizer = Rasterizer::new(&view, options);
    let mut outside = 0;
    // Up to a thousand splats, evenly taken.
    let splats = set_up(&scene.cloud, &view, options).splats;
    for splat in splats.iter().step_by(splats.len() / 1000 + 1) {
        let b = splat.bounds;
        let [x0, y0, x1, y1] = [b.x0 - BORDER, b.y0 - BORDER, b.x1 + BORDER, b.y1 + BORDER];
        let frames = [
            PixelRect::new(x0, y0, x1, b.y0),
            PixelRect::new(x0, b.y1, x1, y1),
            PixelRect::new(x0, b.y0, b.x0, b.y1),
            PixelRect::new(b.x1, b.y0, x1, b.y1),
        ];
        for frame in frames {
            rasterizer.rasterize(splat, 0, &frame.intersect(&view.window), &mut |_, _| outside += 1);
        }
    }
    outside
}
