//! Hard cases, each with the error of the printed listing in f32, of the reference and of the fast core. The cases are those of
//! `tests/tests/hard_cases.rs`.

use super::Context;
use super::figures::Kind;
use super::html::Section;
use super::metrics::distance;
use super::plot::number;
use super::truth::Exact;
use super::whole::picture_of;
use splat_abuffer::Thickness;
use splat_core::sampling::SampleTable;
use splat_core::{Camera, Cloud, RenderOptions};
use splat_simd::{Level, Renderer};
use splat_tests::hard_cases::{self, Errors, SAMPLES};
use splat_tests::hard_surfaces as surfaces;

/// The name of this part among the figures.
const SECTION: &str = "hard";

/// Measures all cases.
///
/// # Errors
/// If something cannot be rendered.
pub fn section(context: &mut Context) -> anyhow::Result<Section> {
    let mut section = Section::new("Hard cases");
    context.say("hard cases: single splats");
    single_splats(&mut section, context);
    context.say("hard cases: surfaces");
    told_apart(&mut section, context)?;
    context.say("hard cases: sums");
    sums(&mut section, context)?;
    Ok(section)
}

fn single_splats(section: &mut Section, context: &mut Context) {
    let count = if context.quick { 3 } else { 50 };
    section.heading("Single splats");
    section.text(format!(
        "{count} random splats of each kind (more of tiny ones), gaussian, F = 2, {SAMPLES} samples a pixel, against the evaluation in f64 of every sample of the frame. \
         wrong: samples in which only one of the two hits, over the true hits; then the largest errors of weight and relative depth of the rest. \
         The listing is the printed one in f32 with the same samples (D3D depth, its far plane at 1000 depths), a long splat's conic in its formulas for any conic. \
         Splats that set-up drops as edge-on, which f32 could not place, count as wrong, as do hits that a lens's threshold refuses; all others are within the a-priori bound, which is a test. The fast core must be the reference, bit for bit."
    ));
    let mut rows = Vec::new();
    for case in hard_cases::cases() {
        let found = hard_cases::measure(&case, count);
        let mut row = vec![case.name.to_owned(), found.reference.hits.to_string()];
        for (name, Errors { weight, depth, .. }, share) in [
            ("listing", found.listing, found.listing.share()),
            ("reference", found.reference, found.reference.share()),
            ("fast", found.fast, found.fast.share()),
        ] {
            // The listing does not change; it is there to be compared with.
            let kind = if name == "listing" { Kind::Plain } else { Kind::Error };
            for (quantity, value) in [("wrong", share), ("weight error", weight), ("depth error", depth)] {
                if value.is_finite() {
                    let quantity = format!("{name}: {quantity}");
                    context.figures.note([SECTION, case.name, "single splat", &quantity], kind, value);
                }
                row.push(number(value));
            }
        }
        rows.push(row);
    }
    section.table(
        &[
            "case",
            "true hits",
            "listing: wrong",
            "weight",
            "depth",
            "reference: wrong",
            "weight",
            "depth",
            "fast: wrong",
            "weight",
            "depth",
        ],
        rows,
    );
}

/// The picture of both cores.
fn both(cloud: &Cloud, camera: &Camera, options: &RenderOptions) -> anyhow::Result<[splat_core::Film; 2]> {
    let reference = splat_core::render(cloud, camera, options, &mut |_| {})?.film;
    let fast = Renderer::new(0, Level::choose())?.render(cloud, camera, options, &mut |_| {})?.film;
    Ok([reference, fast])
}

/// Splits and bleeds.
fn told_apart(section: &mut Section, context: &mut Context) -> anyhow::Result<()> {
    section.heading("Surfaces: splits and bleeds");
    section.text(
        "Two surfaces of splats, one behind the other, or one alone. split: samples in which 2 % of the first surface's weight or more are in another layer \
         than most of it; bleed: samples in which 2 % or more of the weight of its layer are of the second surface. “noisy rim” is a sphere of 4000 splats, \
         sigma .8 spacings, seen at 70 to 88 degrees, places off by up to a tenth of sigma and normals by a tenth, before a sheet so far behind its outline. \
         The listing's depth intervals, one for a whole splat, are the mode --thickness listing of the reference, in f32. cores: largest difference of the \
         two cores' pictures. Within about two sigma of another surface no rule is free of errors: the greater --thickness, the less splits and the more bleeds.",
    );
    let mut rows = Vec::new();
    for scene in surfaces::scenes() {
        let mut row = vec![scene.name.clone()];
        for (mode, thickness) in [("listing", Thickness::WholeSplat), ("ours", Thickness::AroundHit)] {
            let found = surfaces::failures(&scene, thickness);
            let options = surfaces::surface_options(thickness);
            let [reference, fast] = both(&scene.cloud, &scene.camera, &options)?;
            let difference = distance(&picture_of(&reference), &picture_of(&fast)).max;
            let kind = if mode == "ours" { Kind::Error } else { Kind::Plain };
            for (quantity, kind, value) in [
                ("split", kind, found.split),
                ("bleed", kind, found.bleed),
                ("cores differ by", Kind::Error, difference),
            ] {
                let quantity = format!("{mode}: {quantity}");
                context.figures.note([SECTION, &scene.name, "surfaces", &quantity], kind, value);
                row.push(number(value));
            }
        }
        rows.push(row);
    }
    section.table(
        &["surfaces", "listing's intervals: split", "bleed", "cores", "around hits: split", "bleed", "cores"],
        rows,
    );
    Ok(())
}

/// A sample with very many fragments, and with next to no weight.
fn sums(section: &mut Section, context: &mut Context) -> anyhow::Result<()> {
    section.heading("Sums");
    section.text(
        "Largest difference of a picture of 8 x 8 pixels to the f64 pipeline at the same samples. Many: splats of random colour and area over one another, all in one layer. \
         Denormal: a layer whose weights are below 1.2e-38 in front of an ordinary one. The listing has no resolve: its number is that of the mean of its fragments' colours, \
         summed in f32 as they come, weighted by its table, against the same in f64 with exact weights. Its weights do not contain the area, so none is denormal.",
    );
    let mut rows = Vec::new();
    let many = if context.quick { 10_000 } else { 100_000 };
    let overlapping = format!("{many} overlapping fragments");
    for (name, cloud, is_listed) in [
        (overlapping.as_str(), surfaces::overlap(many, [1e-7, 1e-4]), true),
        ("denormal weights", surfaces::denormal(), false),
    ] {
        let (camera, options) = (surfaces::sums_camera(), surfaces::sums_options());
        let table = SampleTable::new(&options, None, camera.pixel_scale());
        let exact = Exact::new(&cloud, &camera, &options).with_samples_of(&table);
        let mut row = vec![name.to_owned()];
        if is_listed {
            let error = surfaces::listing_sum_error(&cloud);
            context.figures.note([SECTION, name, "sums", "listing: max error"], Kind::Plain, error);
            row.push(number(error));
        } else {
            row.push("has none".into());
        }
        for (core, film) in ["reference", "fast"].into_iter().zip(both(&cloud, &camera, &options)?) {
            let error = distance(&exact, &picture_of(&film)).max;
            let quantity = format!("{core}: max error");
            context.figures.note([SECTION, name, "sums", &quantity], Kind::Error, error);
            row.push(number(error));
        }
        rows.push(row);
    }
    section.table(&["sums", "listing", "reference", "fast"], rows);
    Ok(())
}
