//! Hard cases, each with the error of the printed listing in f32, of the reference and of the fast core.

use super::Context;
use super::figures::Kind;
use super::html::Section;
use super::metrics::distance;
use super::plot::number;
use super::truth::Exact;
use super::whole::picture_of;
use glam::{DQuat, DVec3, Vec3};
use splat_abuffer::{Coverage, Fragment, Resolve, Thickness};
use splat_core::evaluate::{Hit, LensPoint, Limits};
use splat_core::raster::SamplePlace;
use splat_core::sampling::SampleTable;
use splat_core::setup::{View, camera_splat, project};
use splat_core::{AovSelection, Camera, Cloud, Kernel, Lens, PixelFilter, RenderOptions, TableMode};
use splat_simd::{Level, Method, Renderer};
use splat_tests::core_scenes::{ellipses, pinhole, thin_lens, tilted_axes};
use splat_tests::hard_scenes::{Facing, Sheets, sheets};
use splat_tests::listing::{DepthMap, Listing, ListingSplat, Parameters};
use splat_tests::random::Random;

/// The name of this part among the figures.
const SECTION: &str = "hard";

/// Width and height of the pictures of single splats, and their focal length, in pixels.
const FRAME: [u32; 2] = [96, 64];
const FOCAL: f64 = 80.0;

/// Samples a pixel.
const SAMPLES: u32 = 16;

/// A family of splats, all of one kind.
struct Case {
    name: &'static str,
    /// Sigma of both axes, in pixels.
    sigmas: [f64; 2],
    /// In degrees from facing the eye.
    tilt: f64,
    depth: f64,
    /// How far from the world's origin all of it lies, in camera units.
    offset: f64,
    /// The near plane, relative to the depth.
    near: f64,
    /// f-number, and focus relative to the depth.
    lens: Option<[f64; 2]>,
    place: Place,
}

/// Where the splats are.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    /// Within the frame, at the case's depth.
    Frame,
    /// Beside the eye, reaching from behind the camera's plane to before it.
    Crossing,
    /// Behind the eye.
    Behind,
}

impl Case {
    fn new(name: &'static str, sigma: f64, tilt: f64) -> Self {
        Self {
            name,
            sigmas: [sigma; 2],
            tilt,
            depth: 5.0,
            offset: 0.0,
            near: 0.01,
            lens: None,
            place: Place::Frame,
        }
    }

    /// A splat of the family: centre and axes in camera space.
    fn splat(&self, random: &mut Random) -> (DVec3, [DVec3; 2]) {
        let [x, y] = [random.range(-0.5, 0.5), random.range(-0.5, 0.5)];
        if self.place == Place::Crossing {
            // A floor or a wall beside the eye.
            let beside = DVec3::new(0.4 * x, 0.3 + 0.2 * y, random.range(-0.5, 0.5)) * self.depth;
            let down = DVec3::new(0.1 * x, 1.0, 0.1 * y).normalize();
            let along = down.cross(DVec3::new(1.0, 0.0, x)).normalize();
            return (beside, [along * self.depth, down.cross(along) * self.depth]);
        }
        let side = if self.place == Place::Behind { -1.0 } else { 1.0 };
        let frame = FRAME.map(f64::from);
        let center = DVec3::new(x * frame[0] / FOCAL, y * frame[1] / FOCAL, 1.0) * self.depth * side;
        let lengths = self.sigmas.map(|sigma| sigma * self.depth / FOCAL);
        let (turn, twist) = (random.range(0.0, 6.3), random.range(0.0, 6.3));
        (center, tilted_axes(center, self.tilt, turn, twist, lengths))
    }

    fn camera(&self) -> Camera {
        let camera = match self.lens {
            None => pinhole(FRAME[0], FRAME[1], FOCAL),
            Some([fstop, focus]) => {
                let Lens { radius, focus, .. } = Lens::from_fstop(fstop, focus * self.depth, 0);
                thin_lens(FRAME[0], FRAME[1], FOCAL, radius, focus)
            }
        };
        let eye = self.offset * DVec3::new(1.0, -0.7, 0.3);
        let world_to_camera = glam::DMat4::from_translation(-eye);
        Camera { near: self.near * self.depth, world_to_camera, ..camera }
    }
}

fn cases() -> Vec<Case> {
    let case = Case::new;
    let at = |name, depth| Case { depth, ..case(name, 2.0, 40.0) };
    let far = |name, offset| Case { offset, ..case(name, 2.0, 40.0) };
    let lens = |name, fstop, focus| Case { lens: Some([fstop, focus]), ..case(name, 2.0, 40.0) };
    vec![
        case("tilt 60, 10 px", 10.0, 60.0),
        case("tilt 85, 10 px", 10.0, 85.0),
        case("tilt 89.9, 20 px", 20.0, 89.9),
        case("tilt 89.999, 200 px", 200.0, 89.999),
        case(".05 px", 0.05, 40.0),
        case(".3 px", 0.3, 40.0),
        case("1 px", 1.0, 40.0),
        case("200 px", 200.0, 40.0),
        Case { sigmas: [20.0, 0.2], ..case("1:100, 20 px", 20.0, 40.0) },
        at("depth 1e-3", 1e-3),
        at("depth 1", 1.0),
        at("depth 1e4", 1e4),
        at("depth 1e8", 1e8),
        far("world offset 1e4", 1e4),
        far("world offset 1e6", 1e6),
        far("world offset 1e8", 1e8),
        Case { place: Place::Crossing, near: 0.05, ..case("across the camera's plane", 1.0, 0.0) },
        Case { near: 1.0, ..case("across the near plane", 8.0, 60.0) },
        Case { place: Place::Behind, ..case("behind the eye", 8.0, 40.0) },
        lens("lens, focus in front", 2.8, 0.4),
        lens("lens, focus at the splat", 2.8, 1.0),
        lens("lens, focus behind", 2.8, 4.0),
        lens("lens, focus infinite", 2.8, f64::INFINITY),
        lens("lens larger than the splat", 0.5, 0.7),
        Case { lens: Some([2.8, 0.7]), ..case("lens, tilt 89.9, 20 px", 20.0, 89.9) },
    ]
}

/// What a renderer found in a sample.
#[derive(Clone, Copy)]
struct Found {
    weight: f64,
    depth: f64,
}

/// How a renderer differs from the truth, over all splats of a case.
#[derive(Default, Clone, Copy)]
struct Errors {
    hits: usize,
    wrong: usize,
    weight: f64,
    depth: f64,
}

impl Errors {
    fn add(&mut self, truth: &[Option<Found>], found: &[Option<Found>]) {
        for (truth, found) in truth.iter().zip(found) {
            self.hits += usize::from(truth.is_some());
            match (truth, found) {
                (Some(truth), Some(found)) => {
                    self.weight = self.weight.max((found.weight - truth.weight).abs());
                    self.depth = self.depth.max((found.depth - truth.depth).abs() / truth.depth);
                }
                (None, None) => {}
                _ => self.wrong += 1,
            }
        }
    }

    /// Samples in which one hits and the other does not, relative to the true hits.
    fn share(&self) -> f64 {
        self.wrong as f64 / self.hits.max(1) as f64
    }

    fn cells(&self) -> Vec<String> {
        [self.share(), self.weight, self.depth].map(number).into()
    }
}

fn options() -> RenderOptions {
    RenderOptions {
        samples: SAMPLES,
        filter: PixelFilter::Box,
        kernel: Kernel::Gaussian,
        cutoff: 2.0,
        table: TableMode::Quartic8,
        ..RenderOptions::default()
    }
}

/// The place of a sample in a list of all of a frame.
fn index(x: i32, y: i32, sample: usize) -> usize {
    (y as usize * FRAME[0] as usize + x as usize) * SAMPLES as usize + sample
}

fn nothing() -> Vec<Option<Found>> {
    vec![None; FRAME[0] as usize * FRAME[1] as usize * SAMPLES as usize]
}

/// The hits of a cloud's only splat in f64, every sample of the frame tested, the weights by exp.
fn truth(cloud: &Cloud, camera: &Camera, table: &SampleTable) -> Vec<Option<Found>> {
    let options = options();
    let view = View::new(camera, &options);
    let mut all = nothing();
    let Some(constants) = project(&camera_splat(cloud, 0, &view), &view) else { return all };
    let limits = Limits::new(view.cutoff, view.near, view.far);
    for y in 0..FRAME[1] as i32 {
        for x in 0..FRAME[0] as i32 {
            let jitter = table.jitter(x, y);
            let lens = table.lens(x, y);
            for (sample, jitter) in jitter.iter().enumerate() {
                let d = constants.offset(x, y, jitter.map(f64::from));
                let hit: Option<Hit<f64>> = match lens.get(sample) {
                    None => constants.pinhole(d, &limits),
                    Some(lens) => constants.thin_lens(d, &LensPoint { p: lens.p.map(f64::from) }, &limits),
                };
                let found = |hit: Hit<f64>| Found { weight: libm::exp(-0.5 * hit.r2), depth: hit.depth };
                all[index(x, y, sample)] = hit.map(found);
            }
        }
    }
    all
}

fn keep(all: &mut [Option<Found>], place: SamplePlace, fragment: Fragment) {
    let found = Found { weight: f64::from(fragment.weight), depth: f64::from(fragment.depth) };
    all[index(place.x, place.y, place.sample)] = Some(found);
}

/// The printed listing in f32, given the same samples; its patterns hold what E14 and E15 ask for, so that these faults do
/// not hide the others. The weight is exp of its r2, without its table.
fn listing(
    case: &Case,
    splat: (DVec3, [DVec3; 2]),
    camera: &Camera,
    table: &SampleTable,
) -> Vec<Option<Found>> {
    let (near, far) = (camera.near, 1e3 * case.depth);
    let depth_map = DepthMap::Direct3d { near, far };
    let mut parameters = Parameters::<f32>::new(depth_map, FRAME[0] as usize, FRAME[1] as usize, FOCAL);
    let lens = camera.lens();
    parameters.focus = lens.map_or(case.depth, |lens| lens.focus) as f32;
    parameters.aperture = case.lens.map_or(f32::INFINITY, |[fstop, _]| fstop as f32);
    parameters.subpixels = SAMPLES as usize;
    let patterns = splat_core::sampling::PATTERNS;
    let jitter = (0..patterns).flat_map(|pattern| table.jitter_of_pattern(pattern).iter().copied());
    parameters.prefilter_jitter = jitter.collect();
    parameters.lens_jitter = match lens {
        None => vec![[0.0; 2]; parameters.prefilter_jitter.len()],
        Some(_) => (0..patterns)
            .flat_map(|pattern| table.lens_of_pattern(pattern))
            .map(|point| point.p.map(|p| p / FOCAL as f32))
            .collect(),
    };
    let size = splat_core::sampling::SELECTION_SIZE;
    parameters.sel_size = size;
    let cells = || (0..size * size).map(|i| table.patterns_of((i % size) as i32, (i / size) as i32));
    parameters.prefilter_selection = cells().map(|[filter, _]| filter * SAMPLES as usize).collect();
    parameters.lens_selection = cells().map(|[_, lens]| lens * SAMPLES as usize).collect();
    // World to camera, then the projection: the product of row-vector matrices, rounded once.
    let world = camera.world_to_camera.transpose().to_cols_array_2d();
    let world: Vec<[f64; 4]> = (0..4).map(|row| [0, 1, 2, 3].map(|column| world[column][row])).collect();
    let projection = depth_map.perspective();
    let product =
        |row: usize, column: usize| (0..4).map(|i| world[row][i] * projection[i][column]).sum::<f64>();
    parameters.object_to_screen =
        std::array::from_fn(|row| std::array::from_fn(|column| product(row, column) as f32));
    let (center, [t1, t2]) = splat;
    let position = (center + camera.eye()).to_array();
    let normal = t1.cross(t2).normalize();
    // Its back faces are culled; ours are drawn here.
    let normal = if normal.dot(center) > 0.0 { -normal } else { normal };
    let (a, b) = depth_map.coefficients();
    let mut all = nothing();
    let listing = Listing::new(parameters);
    listing.run(&[ListingSplat::new(position, normal.to_array(), t1.length())], |fragment| {
        let inside = (0..FRAME[0] as i64).contains(&fragment.x) && (0..FRAME[1] as i64).contains(&fragment.y);
        if inside {
            let uv2 = f64::from(fragment.ray.uv[2]);
            let r2 = f64::from(fragment.ray.radius) / (uv2 * uv2);
            let depth = (f64::from(fragment.z) - b) / a;
            let place = index(fragment.x as i32, fragment.y as i32, fragment.j);
            all[place] = Some(Found { weight: libm::exp(-0.5 * r2), depth });
        }
    });
    all
}

/// Measures all cases.
///
/// # Errors
/// If something cannot be rendered.
pub fn section(context: &mut Context) -> anyhow::Result<Section> {
    let mut section = Section::new("Hard cases");
    context.say("hard cases: single splats");
    single_splats(&mut section, context)?;
    context.say("hard cases: surfaces");
    surfaces(&mut section, context)?;
    context.say("hard cases: sums");
    sums(&mut section, context)?;
    Ok(section)
}

fn single_splats(section: &mut Section, context: &mut Context) -> anyhow::Result<()> {
    let count = if context.quick { 12 } else { 50 };
    section.heading("Single splats");
    section.text(format!(
        "{count} random splats of each kind (more of tiny ones), gaussian, F = 2, {SAMPLES} samples a pixel, against the evaluation in f64 of every sample of the frame. \
         wrong: samples in which only one of the two hits, over the true hits; then the largest errors of weight and relative depth of the rest. \
         The listing is the printed one in f32 with the same samples (D3D depth, its far plane at 1000 depths); it knows round splats only. Splats that set-up drops as edge-on, which f32 could not place, count as wrong. The fast core must be the reference, bit for bit."
    ));
    let mut rows = Vec::new();
    for case in cases() {
        let camera = case.camera();
        let options = options();
        let table = SampleTable::new(&options, camera.lens(), camera.pixel_scale());
        let mut random = Random::new(21);
        let [mut by_listing, mut by_reference, mut by_fast] = [Errors::default(); 3];
        // Tiny splats are rarely hit: it takes more of them.
        let count = if case.sigmas[1] < 0.1 {
            50 * count
        } else if case.sigmas[1] < 0.5 {
            5 * count
        } else {
            count
        };
        for _ in 0..count {
            let (center, axes) = case.splat(&mut random);
            let mut cloud = ellipses(&[(center, axes)]);
            // The cloud stands where the camera does: offsets stay what they are, as in any cloud in map coordinates.
            cloud.origin = camera.eye();
            cloud.oriented = false;
            let exact = truth(&cloud, &camera, &table);
            let mut found = nothing();
            splat_core::fragments(&cloud, &camera, &options, &mut |place, _, fragment| {
                keep(&mut found, place, fragment);
            })?;
            by_reference.add(&exact, &found);
            let mut found = nothing();
            let sink = &mut |place, _, fragment| keep(&mut found, place, fragment);
            splat_simd::fragments(&cloud, &camera, &options, Level::choose(), Method::Pixels, sink)?;
            by_fast.add(&exact, &found);
            if case.sigmas[0] == case.sigmas[1] {
                by_listing.add(&exact, &listing(&case, (center, axes), &camera, &table));
            }
        }
        let mut row = vec![case.name.to_owned(), by_reference.hits.to_string()];
        for (name, errors) in [("listing", by_listing), ("reference", by_reference), ("fast", by_fast)] {
            if name == "listing" && case.sigmas[0] != case.sigmas[1] {
                row.extend(["-", "-", "-"].map(String::from));
                continue;
            }
            // The listing does not change; it is there to be compared with.
            let kind = if name == "listing" { Kind::Plain } else { Kind::Error };
            let mut note = |quantity: &str, value: f64| {
                let quantity = format!("{name}: {quantity}");
                context.figures.note([SECTION, case.name, "single splat", &quantity], kind, value);
            };
            note("wrong", errors.share());
            note("weight error", errors.weight);
            if errors.depth.is_finite() {
                note("depth error", errors.depth);
            }
            row.extend(errors.cells());
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
    Ok(())
}

/// The picture of both cores.
fn both(cloud: &Cloud, camera: &Camera, options: &RenderOptions) -> anyhow::Result<[splat_core::Film; 2]> {
    let reference = splat_core::render(cloud, camera, options, &mut |_| {})?.film;
    let fast = Renderer::new(0, Level::choose())?.render(cloud, camera, options, &mut |_| {})?.film;
    Ok([reference, fast])
}

/// Two colours, red in front of blue, or all red where there is one sheet.
fn colored(mut cloud: Cloud, sheets: usize) -> Cloud {
    let a_sheet = cloud.len() / sheets;
    let color = |i: usize| if i < a_sheet { Vec3::X } else { Vec3::Z };
    cloud.colors = Some((0..cloud.len()).map(color).collect());
    cloud
}

/// The cloud turned about the point (0, 0, 4).
fn turned(mut cloud: Cloud, degrees: f64) -> Cloud {
    let turn = DQuat::from_rotation_x(degrees.to_radians());
    let center = DVec3::new(0.0, 0.0, 4.0);
    for position in &mut cloud.positions {
        *position = (center + turn * (position.as_dvec3() - center)).as_vec3();
    }
    for normal in &mut cloud.normals {
        *normal = (turn * normal.as_dvec3()).as_vec3();
    }
    cloud
}

/// Splits and bleeds.
fn surfaces(section: &mut Section, context: &mut Context) -> anyhow::Result<()> {
    section.heading("Surfaces: splits and bleeds");
    section.text(
        "Sheets of splats, seen in the middle of a picture. split: layers a sample beyond those that there are; bleed: share of the \
         second sheet (blue) in the colour of the first (red), which hides it, with opaque coverage. The listing's depth intervals (one for the whole splat) are \
         the mode --thickness listing of the reference. cores: largest difference of the two cores' pictures.",
    );
    // Sheets, spacing in sigma, noise in sigma, degrees.
    let scenes = [
        ("one sheet, noise .01 sigma", 1, 0.0, 0.01, 0.0),
        ("one sheet, noise .1 sigma", 1, 0.0, 0.1, 0.0),
        ("one sheet, noise .3 sigma", 1, 0.0, 0.3, 0.0),
        ("coincident sheets", 2, 0.0, 0.0, 0.0),
        ("2 sigma apart, tilt 0", 2, 2.0, 0.0, 0.0),
        ("2 sigma apart, tilt 45", 2, 2.0, 0.0, 45.0),
        ("2 sigma apart, tilt 60", 2, 2.0, 0.0, 60.0),
        ("2 sigma apart, tilt 70", 2, 2.0, 0.0, 70.0),
    ];
    let mut rows = Vec::new();
    for (name, count, spacing, noise, tilt) in scenes {
        let described =
            Sheets { count, spacing, noise, tilt: 0.0, weight: 1.0, facing: Facing::Front, clear: false };
        let cloud = turned(colored(sheets(&described, 3), count), tilt);
        let camera = splat_tests::scenes::pinhole(40, 36, 60.0);
        let expected = if spacing > 0.0 { count as f64 } else { 1.0 };
        let mut row = vec![name.to_owned()];
        for (mode, thickness) in [("listing", Thickness::WholeSplat), ("ours", Thickness::AroundHit)] {
            let render = |coverage| {
                let options = RenderOptions {
                    resolve: Resolve::Surface { coverage, thickness },
                    aovs: AovSelection { layers: true, ..AovSelection::default() },
                    ..RenderOptions::default()
                };
                both(&cloud, &camera, &options)
            };
            // Soft, so that every layer counts; opaque, so that nothing shines through the first sheet's own weight.
            let [reference, fast] = render(Coverage::Soft { saturation: 1.0 })?;
            let opaque = &render(Coverage::Opaque)?[0];
            // The middle: no sheet ends there, at any tilt.
            let middle = || (13..23).flat_map(|y| (15..25).map(move |x| (x, y)));
            let pixels = middle().count() as f64;
            let layers = reference.layers.as_ref().expect("asked for");
            let split = middle().map(|(x, y)| (f64::from(layers[reference.index(x, y)]) - expected).max(0.0));
            let split = split.sum::<f64>() / pixels;
            let kind = if mode == "ours" { Kind::Error } else { Kind::Plain };
            let quantity = format!("{mode}: split");
            context.figures.note([SECTION, name, "surfaces", &quantity], kind, split);
            row.push(number(split));
            if count == 2 && spacing > 0.0 {
                let bleed = middle().map(|(x, y)| {
                    let [red, _, blue, _] = opaque.rgba[opaque.index(x, y)].map(f64::from);
                    blue / (red + blue).max(f64::MIN_POSITIVE)
                });
                let bleed = bleed.sum::<f64>() / pixels;
                let quantity = format!("{mode}: bleed");
                context.figures.note([SECTION, name, "surfaces", &quantity], kind, bleed);
                row.push(number(bleed));
            } else {
                row.push("-".into());
            }
            let difference = distance(&picture_of(&reference), &picture_of(&fast)).max;
            let quantity = format!("{mode}: cores differ by");
            context.figures.note([SECTION, name, "surfaces", &quantity], Kind::Error, difference);
            row.push(number(difference));
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
        "Largest difference of a picture of 8 x 8 pixels to the f64 pipeline at the same samples. The listing has no resolve, so no \
         number. Many: splats of random colour and area over one another, all in one layer. Denormal: a layer whose weights are below \
         1.2e-38 in front of an ordinary one.",
    );
    let mut rows = Vec::new();
    let many = if context.quick { 10_000 } else { 100_000 };
    let overlapping = format!("{many} overlapping fragments");
    for (name, cloud) in
        [(overlapping.as_str(), overlap(many, [1e-7, 1e-4])), ("denormal weights", denormal())]
    {
        let camera = splat_tests::scenes::pinhole(8, 8, 8.0);
        let resolve = splat_tests::scenes::soft(1.0);
        let options = RenderOptions { samples: 4, resolve, ..RenderOptions::default() };
        let exact = Exact::new(&cloud, &camera, &options).with_samples_of(&SampleTable::new(
            &options,
            None,
            camera.pixel_scale(),
        ));
        let mut row = vec![name.to_owned(), "-".to_owned()];
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

/// Splats across the whole picture, all at the same depth to a hundredth of sigma.
fn overlap(count: usize, areas: [f64; 2]) -> Cloud {
    let mut random = Random::new(31);
    let mut splats = Vec::new();
    let mut colors = Vec::new();
    for _ in 0..count {
        let center = DVec3::new(random.range(-0.5, 0.5), random.range(-0.5, 0.5), random.range(2.0, 2.01));
        splats.push((center, [DVec3::X, DVec3::NEG_Y]));
        colors.push(Vec3::from_array([0; 3].map(|_| random.unit() as f32)));
    }
    let mut cloud = ellipses(&splats);
    cloud.colors = Some(colors);
    cloud.areas = Some((0..count).map(|_| random.log_range(areas[0], areas[1]) as f32).collect());
    cloud
}

/// A few splats of denormal weight in front of some of an ordinary one.
fn denormal() -> Cloud {
    let mut cloud = overlap(10, [1e-44, 1e-39]);
    let behind = overlap(10, [1.0, 2.0]);
    cloud.positions.extend(behind.positions.iter().map(|&position| position + 4.0 * Vec3::Z));
    cloud.normals.extend(behind.normals);
    if let (splat_core::Shapes::Ellipses(all), splat_core::Shapes::Ellipses(more)) =
        (&mut cloud.shapes, behind.shapes)
    {
        all.extend(more);
    }
    if let (Some(all), Some(more)) = (&mut cloud.colors, behind.colors) {
        all.extend(more);
    }
    if let (Some(all), Some(more)) = (&mut cloud.areas, behind.areas) {
        all.extend(more);
    }
    cloud
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Errors of the listing and of the reference for some splats of a case.
    fn errors(case: &Case) -> [Errors; 2] {
        let (camera, options) = (case.camera(), options());
        let table = SampleTable::new(&options, camera.lens(), camera.pixel_scale());
        let mut random = Random::new(3);
        let mut errors = [Errors::default(); 2];
        for _ in 0..4 {
            let (center, axes) = case.splat(&mut random);
            let cloud = Cloud { origin: camera.eye(), oriented: false, ..ellipses(&[(center, axes)]) };
            let exact = truth(&cloud, &camera, &table);
            let mut found = nothing();
            let sink = &mut |place, _, fragment| keep(&mut found, place, fragment);
            splat_core::fragments(&cloud, &camera, &options, sink).unwrap();
            errors[0].add(&exact, &listing(case, (center, axes), &camera, &table));
            errors[1].add(&exact, &found);
        }
        errors
    }

    #[test]
    fn an_ordinary_splat_is_no_trouble_for_anyone() {
        for lens in [None, Some([2.8, 0.7])] {
            for errors in errors(&Case { lens, ..Case::new("ordinary", 4.0, 30.0) }) {
                assert!(errors.hits > 500 && errors.share() < 0.01, "{} of {}", errors.wrong, errors.hits);
                assert!(errors.weight < 1e-4 && errors.depth < 1e-4, "{} {}", errors.weight, errors.depth);
            }
        }
    }

    #[test]
    fn far_from_zero_the_listing_fails_and_the_reference_does_not() {
        let far = Case { offset: 1e8, ..Case::new("far", 4.0, 30.0) };
        let [listing, reference] = errors(&far);
        assert!(listing.share() > 0.1 && reference.share() < 0.01);
    }
}
