//! Splats that are hard to evaluate, a family a case, and how far the listing in `f32` and both cores are from the truth.
//!
//! The truth is the evaluation in `f64` of every sample of the frame, with the renderer's own splat-centred constants before
//! they are rounded; other tests hold it against plain geometry. The report and the tests share these cases.

use crate::core_scenes::{ellipses, pinhole, thin_lens, tilted_axes};
use crate::listing::{DepthMap, Listing, Parameters, TangentFrame, conic_of};
use crate::random::Random;
use crate::tolerances as tol;
use glam::{DMat4, DVec3};
use splat_abuffer::Fragment;
use splat_core::evaluate::{Hit, LensPoint, Limits, SplatConstants};
use splat_core::raster::SamplePlace;
use splat_core::sampling::SampleTable;
use splat_core::setup::{ErrorBound, View, camera_splat, project, set_up};
use splat_core::{Camera, Cloud, Kernel, Lens, PixelFilter, RenderOptions, TableMode};
use splat_simd::{Level, Method};

/// Width and height of the pictures, and their focal length, in pixels.
const FRAME: [u32; 2] = [96, 64];
const FOCAL: f64 = 80.0;

/// Samples a pixel.
pub const SAMPLES: u32 = 16;

/// Cutoff F.
pub const CUTOFF: f64 = 2.0;

/// A family of splats, all of one kind.
#[derive(Debug, Clone)]
pub struct Case {
    /// Its name.
    pub name: &'static str,
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
#[derive(Debug, Clone, Copy, PartialEq)]
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

    /// Tiny splats are rarely hit: it takes more of them.
    fn repeated(&self, count: usize) -> usize {
        if self.sigmas[1] < 0.1 {
            50 * count
        } else if self.sigmas[1] < 0.5 {
            5 * count
        } else {
            count
        }
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
        let world_to_camera = DMat4::from_translation(-eye);
        Camera { near: self.near * self.depth, world_to_camera, ..camera }
    }
}

/// All cases.
pub fn cases() -> Vec<Case> {
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
        // Facing the eye, at the near plane's very depth but for the size of a splat.
        Case { near: 1.0, ..case("touching the near plane", 2.0, 5.0) },
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
#[derive(Clone, Copy, PartialEq)]
struct Found {
    weight: f64,
    depth: f64,
}

/// What is true of a sample.
#[derive(Clone, Copy)]
struct Truth {
    hit: Option<Found>,
    /// A hit that rounding can neither make nor unmake.
    certain: bool,
    /// Whether a lens's threshold next to the splat's plane refuses it (section 4, `edge_on`).
    refused: bool,
    /// Largest errors of weight and depth that the arithmetic can make.
    bound: Found,
}

/// How a renderer differs from the truth, over all splats of a case.
#[derive(Debug, Default, Clone, Copy)]
pub struct Errors {
    /// Samples that hit.
    pub hits: usize,
    /// Samples in which one hits and the other does not.
    pub wrong: usize,
    /// Largest error of a weight.
    pub weight: f64,
    /// Largest error of a depth, relative to it.
    pub depth: f64,
}

impl Errors {
    fn add(&mut self, truth: &[Truth], found: &[Option<Found>]) {
        for (truth, found) in truth.iter().zip(found) {
            self.hits += usize::from(truth.hit.is_some());
            match (truth.hit, found) {
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
    pub fn share(&self) -> f64 {
        self.wrong as f64 / self.hits.max(1) as f64
    }
}

/// What a case showed.
#[derive(Debug, Default, Clone)]
pub struct Measured {
    /// The printed listing in `f32`.
    pub listing: Errors,
    /// The reference.
    pub reference: Errors,
    /// The fast core.
    pub fast: Errors,
    /// True hits of splats that set-up dropped as edge-on, and those refused next to the plane of a splat seen through a lens.
    pub lost: usize,
    /// The first of the reference's samples beyond the a-priori bound, lost ones aside.
    pub violation: Option<String>,
    /// Samples in which the two cores differ in any bit.
    pub differences: usize,
}

/// Measures about `count` random splats of a case.
pub fn measure(case: &Case, count: usize) -> Measured {
    let (camera, options) = (case.camera(), options());
    let table = SampleTable::new(&options, camera.lens(), camera.pixel_scale());
    let mut random = Random::new(21);
    let mut measured = Measured::default();
    for _ in 0..case.repeated(count) {
        let (center, axes) = case.splat(&mut random);
        // The cloud stands where the camera does: offsets stay what they are, as in any cloud in map coordinates.
        let cloud = Cloud { origin: camera.eye(), oriented: false, ..ellipses(&[(center, axes)]) };
        let truth = truth(&cloud, &camera, &table);
        let [mut reference, mut fast] = [nothing(), nothing()];
        let sink = &mut |place, _, fragment| keep(&mut reference, place, fragment);
        splat_core::fragments(&cloud, &camera, &options, sink).expect("a valid scene");
        let sink = &mut |place, _, fragment| keep(&mut fast, place, fragment);
        splat_simd::fragments(&cloud, &camera, &options, Level::choose(), Method::Pixels, sink)
            .expect("a valid scene");
        let is_drawn = !set_up(&cloud, &View::new(&camera, &options), &options).splats.is_empty();
        measured.judge(&truth, &reference, is_drawn);
        measured.differences += reference.iter().zip(&fast).filter(|(a, b)| a != b).count();
        measured.reference.add(&truth, &reference);
        measured.fast.add(&truth, &fast);
        measured.listing.add(&truth, &listing(case, (center, axes), &camera, &table));
    }
    measured
}

impl Measured {
    /// Holds the reference's samples against the bound.
    fn judge(&mut self, truth: &[Truth], found: &[Option<Found>], is_drawn: bool) {
        for (i, (truth, found)) in truth.iter().zip(found).enumerate() {
            let is_within = match (truth.hit, found) {
                (None, None) => true,
                (Some(_), None) if !is_drawn || truth.refused => {
                    self.lost += 1;
                    true
                }
                (Some(hit), Some(found)) => {
                    (found.weight - hit.weight).abs() <= truth.bound.weight
                        && (found.depth - hit.depth).abs() <= truth.bound.depth
                }
                _ => !truth.certain,
            };
            if !is_within {
                let found = found.map(|found| [found.weight, found.depth]);
                let hit = truth.hit.map(|hit| [hit.weight, hit.depth]);
                let bound = [truth.bound.weight, truth.bound.depth];
                let text = format!("sample {i}: found {found:?}, truth {hit:?}, bound {bound:?}");
                self.violation.get_or_insert(text);
            }
        }
    }
}

fn options() -> RenderOptions {
    RenderOptions {
        samples: SAMPLES,
        filter: PixelFilter::Box,
        kernel: Kernel::Gaussian,
        cutoff: CUTOFF,
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
fn truth(cloud: &Cloud, camera: &Camera, table: &SampleTable) -> Vec<Truth> {
    const NOTHING: Truth =
        Truth { hit: None, certain: true, refused: false, bound: Found { weight: 0.0, depth: 0.0 } };
    let options = options();
    let view = View::new(camera, &options);
    let mut all = vec![NOTHING; nothing().len()];
    let Some(constants) = project(&camera_splat(cloud, 0, &view), &view) else { return all };
    // Next to the planes of splats seen through a lens, hits are refused by a threshold, which set-up decides.
    let rounded = set_up(cloud, &view, &options).splats.first().map(|splat| splat.constants);
    let edge_on = rounded.map_or(0.0, |constants| f64::from(constants.edge_on));
    for y in 0..FRAME[1] as i32 {
        for x in 0..FRAME[0] as i32 {
            for (sample, jitter) in table.jitter(x, y).iter().enumerate() {
                let d = constants.offset(x, y, jitter.map(f64::from));
                let lens = table.lens(x, y).get(sample).map(|lens| lens.p.map(f64::from));
                if let Some(truth) = truth_of_sample(&constants, d, lens, &view, edge_on) {
                    all[index(x, y, sample)] = truth;
                }
            }
        }
    }
    all
}

/// The truth of the sample at offset `d` through the lens point `lens`; `None` if its ray does not meet the splat's plane.
fn truth_of_sample(
    constants: &SplatConstants<f64>,
    d: [f64; 2],
    lens: Option<[f64; 2]>,
    view: &View,
    edge_on: f64,
) -> Option<Truth> {
    let cast = |constants: &SplatConstants<f64>, limits: &Limits<f64>| -> Option<Hit<f64>> {
        match lens {
            None => constants.pinhole(d, limits),
            Some(p) => constants.thin_lens(d, &LensPoint { p }, limits),
        }
    };
    // Far beyond the rim and the near plane, to see how near to them it is.
    let anywhere = Limits::new(100.0 * view.cutoff, 0.0, f64::INFINITY);
    let Hit { r2, depth, .. } = cast(constants, &anywhere)?;
    let jitter = view.max_jitter();
    let ErrorBound { depth: depth_error, membership, .. } = match lens {
        None => constants.pinhole_error(d, jitter),
        Some(p) => constants.thin_lens_error(d, jitter, &LensPoint { p }),
    };
    let hit = (r2 < view.cutoff && depth > view.near).then(|| Found { weight: libm::exp(-0.5 * r2), depth });
    let from_near = (depth - view.near).abs();
    // A threshold a hundredth larger: in between rounding decides.
    let with = SplatConstants { edge_on: 1.01 * edge_on, ..*constants };
    Some(Truth {
        hit,
        certain: (r2 - view.cutoff).abs() > membership
            && from_near > depth_error + tol::HARD_NEAR * view.near,
        refused: cast(&with, &anywhere).is_none(),
        bound: Found { weight: 0.5 * membership + tol::HARD_WEIGHT, depth: depth_error },
    })
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
    // Both axes as the listing would have them, but along the splat's own: its formulas hold for any conic. Its test for
    // back faces is left out, since ours are drawn.
    let row = |v: DVec3, w: f32| {
        let v = v.to_array().map(|value| value as f32);
        let o = &parameters.object_to_screen;
        std::array::from_fn(|i| v[0] * o[0][i] + v[1] * o[1][i] + v[2] * o[2][i] + w * o[3][i])
    };
    let frame = TangentFrame {
        q: conic_of(&[[t1.length() as f32, 0.0], [0.0, t2.length() as f32]]),
        tuh: row(t1.normalize(), 0.0),
        tvh: row(t2.normalize(), 0.0),
        p0h: row(center + camera.eye(), 1.0),
    };
    let (a, b) = depth_map.coefficients();
    let mut all = nothing();
    let listing = Listing::new(parameters);
    let set_up = listing.set_up_frame(&frame);
    if set_up.culled.is_some() {
        return all;
    }
    listing.rasterise(0, &set_up, &mut |fragment| {
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
