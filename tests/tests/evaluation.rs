//! The f32 evaluation against the same evaluation in f64: within the a-priori bound, case by case and for
//! random splats.

use std::f64::consts::{PI, TAU};

use glam::{DMat4, DQuat, DVec2, DVec3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use splat_core::evaluate::{Hit, LensPoint, Limits, SplatConstants};
use splat_core::real::Real;
use splat_core::setup::{CameraSplat, EPSILON, ErrorBound, View, camera_splat, project, set_up};
use splat_core::{Camera, Cloud, Lens, PixelFilter, Projection, RenderOptions};
use splat_tests::core_scenes::{
    ellipses, hard, image_of, orthographic, pinhole, random_axes, random_unit_lens, thin_lens, tilted_axes,
};
use splat_tests::random::Random;
use splat_tests::tolerances as tol;

/// A splat, in f64 and as set-up rounds it, and its view.
struct Subject {
    splat: CameraSplat,
    view: View,
    exact: SplatConstants<f64>,
    rounded: SplatConstants<f32>,
}

/// The options of every subject: the widest pixel filter.
fn options(cutoff: f64) -> RenderOptions {
    RenderOptions { filter: PixelFilter::BlackmanHarris, ..hard(cutoff, 1) }
}

impl Subject {
    /// The cloud's first splat; `None` if set-up drops or culls it.
    fn new(cloud: &Cloud, camera: &Camera, cutoff: f64) -> Option<Self> {
        camera.check().expect("a valid camera");
        let options = options(cutoff);
        let view = View::new(camera, &options);
        let splat = camera_splat(cloud, 0, &view);
        let rounded = set_up(cloud, &view, &options).splats.first()?.constants;
        let edge_on = f64::from(rounded.edge_on);
        let exact = SplatConstants { edge_on, ..project(&splat, &view)? };
        assert_eq!(rounded, exact.to_f32(), "set-up rounds the exact constants once");
        Some(Self { splat, view, exact, rounded })
    }

    fn limits<R: Real>(&self) -> Limits<R> {
        // Rounded for both: the near plane itself is not what is judged here.
        let near = f64::from(self.view.near as f32);
        Limits::new(self.view.cutoff, near, self.view.far)
    }

    fn hit<R: Real>(
        &self,
        c: &SplatConstants<R>,
        d: [R; 2],
        unit: [f32; 2],
        limits: &Limits<R>,
    ) -> Option<Hit<R>> {
        match self.view.lens {
            _ if self.view.orthographic => c.orthographic(d, limits),
            None => c.pinhole(d, limits),
            Some(lens) => c.thin_lens(d, &LensPoint::new(unit, lens, self.view.pixel_scale), limits),
        }
    }

    fn bound(&self, d: [f64; 2], unit: [f32; 2]) -> ErrorBound {
        let jitter = self.view.max_jitter();
        match self.view.lens {
            _ if self.view.orthographic => self.exact.orthographic_error(d, jitter, self.view.cutoff),
            None => self.exact.pinhole_error(d, jitter),
            Some(lens) => {
                let point = LensPoint::new(unit, lens, self.view.pixel_scale);
                self.exact.thin_lens_error(d, jitter, &point)
            }
        }
    }

    /// Whether the tests g > 0 and g side > `edge_on` are within rounding of open.
    fn side_is_uncertain(&self, d: [f64; 2], unit: [f32; 2]) -> bool {
        let c = &self.exact;
        let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
        let size = |a: [f64; 2]| (c.h[0] * a[0]).abs() + (c.h[1] * a[1]).abs();
        let offset = d.map(|d| d.abs() + self.view.max_jitter() + 1.0);
        if self.view.orthographic {
            return false;
        }
        let Some(lens) = self.view.lens else {
            let g = 1.0 + dot(c.h, d);
            return g.abs() <= tol::SIDE_ROUNDINGS * EPSILON * (1.0 + size(offset));
        };
        let point = LensPoint::<f64>::new(unit, lens, self.view.pixel_scale);
        let shift = point.p.map(|p| p * c.defocus);
        let q = point.p.map(|p| p / c.depth);
        let side = 1.0 - dot(c.h, q);
        let g = side + dot(c.h, [d[0] + shift[0], d[1] + shift[1]]);
        let side_error = tol::SIDE_ROUNDINGS * EPSILON * (1.0 + size(q));
        let reach = [0, 1].map(|i| offset[i] + shift[i].abs());
        let g_error = side_error + tol::SIDE_ROUNDINGS * EPSILON * size(reach);
        let product_error = g.abs() * side_error + side.abs() * g_error + g_error * side_error;
        (g * side - c.edge_on).abs() <= product_error + 2.0 * EPSILON * c.edge_on
    }
}

/// What some samples showed.
#[derive(Default)]
struct Worst {
    hits: usize,
    /// Largest error of u or v relative to its bound.
    uv: f64,
    /// The same of the depth.
    depth: f64,
    /// Largest error of u or v, in sigma.
    sigma: f64,
    /// Largest bound of u or v, in sigma.
    bound: f64,
    /// The first sample out of bounds.
    violation: Option<String>,
}

impl Worst {
    fn report(&mut self, violation: String) {
        self.violation.get_or_insert(violation);
    }

    fn check(self, what: &str) -> Self {
        if let Some(violation) = &self.violation {
            panic!("{what}: {violation}");
        }
        self
    }
}

/// Compares `samples` samples, half of them aimed at the splat, half anywhere in the frame.
fn compare(subject: &Subject, rng: &mut Random, samples: usize) -> Worst {
    let view = &subject.view;
    let mut worst = Worst::default();
    for i in 0..samples {
        let unit = random_unit_lens(rng);
        let size = DVec2::new(f64::from(view.window.x1), f64::from(view.window.y1));
        let mut pixel = DVec2::new(rng.unit(), rng.unit()) * size;
        if i % 2 == 0 {
            let aim = rng.in_disc() * (1.02 * view.cutoff.sqrt());
            let point = subject.splat.center + aim.x * subject.splat.axes[0] + aim.y * subject.splat.axes[1];
            let image = image_of(view, point, unit);
            if point.z > 0.0 && image.abs().max_element() < tol::FAR_FROM_THE_FRAME {
                pixel = image;
            }
        }
        // Pixel (x, y), the sample up to 3/2 pixels from its centre.
        let shift = DVec2::new(rng.range(-1.0, 2.0), rng.range(-1.0, 2.0));
        let whole = (pixel - shift).round();
        let jitter = (pixel - whole).to_array().map(|j| j as f32);
        compare_sample(subject, whole.as_ivec2().to_array(), jitter, unit, &mut worst);
    }
    worst
}

fn compare_sample(s: &Subject, [x, y]: [i32; 2], jitter: [f32; 2], unit: [f32; 2], worst: &mut Worst) {
    let d = s.exact.offset(x, y, jitter.map(f64::from));
    let bound = s.bound(d, unit);
    let exact = s.hit(&s.exact, d, unit, &s.limits());
    let rounded = s.hit(&s.rounded, s.rounded.offset(x, y, jitter), unit, &s.limits());
    if let (Some(exact), Some(rounded)) = (&exact, &rounded) {
        worst.hits += 1;
        let errors = [
            (f64::from(rounded.u) - exact.u).abs(),
            (f64::from(rounded.v) - exact.v).abs(),
            (f64::from(rounded.depth) - exact.depth).abs(),
        ];
        let bounds = [bound.u, bound.v, bound.depth];
        let within = errors.iter().zip(&bounds).all(|(error, bound)| error <= bound)
            && (f64::from(rounded.r2) - exact.r2).abs() <= bound.membership
            // `edge_on` keeps lens points away whose side rounding could change.
            && exact.flipped == rounded.flipped;
        if !within {
            worst.report(format!("{exact:?}, {rounded:?}, {bound:?} at {x}, {y}, {jitter:?}, lens {unit:?}"));
        }
        let ratio = |i: usize| if errors[i] > 0.0 { errors[i] / bounds[i] } else { 0.0 };
        worst.uv = worst.uv.max(ratio(0)).max(ratio(1));
        worst.depth = worst.depth.max(ratio(2));
        worst.sigma = worst.sigma.max(errors[0]).max(errors[1]);
        worst.bound = worst.bound.max(bounds[0]).max(bounds[1]);
    } else if exact.is_some() != rounded.is_some() {
        // Where is it, whatever the cutoff and the near plane?
        let open = Limits { cutoff: f64::INFINITY, near: f64::NEG_INFINITY, far: f64::INFINITY };
        let explained = s.side_is_uncertain(d, unit)
            || s.hit(&s.exact, d, unit, &open).is_some_and(|raw| {
                let limits = s.limits::<f64>();
                (raw.r2 - limits.cutoff).abs() <= bound.membership
                    || (raw.depth - limits.near).abs() <= bound.depth
                    || (raw.depth - limits.far).abs() <= bound.depth
            });
        if !explained {
            worst.report(format!(
                "{exact:?}, but {rounded:?} at {x}, {y}, {jitter:?}, lens {unit:?}; {bound:?}"
            ));
        }
    }
}

// ---------------------------------------------------------------------------------------------------------
// The case table

const FOCAL: f64 = 1000.0;

/// A splat of the case table: sigma in pixels along both axes, at this depth and part of the frame's corner.
fn placed(depth: f64, corner: f64, tilt: f64, sigmas: [f64; 2]) -> (DVec3, [DVec3; 2]) {
    let center = DVec3::new(0.95 * corner, 0.53 * corner, 1.0) * depth;
    let lengths = sigmas.map(|sigma| sigma * depth / FOCAL);
    (center, tilted_axes(center, tilt, 0.4, 0.9, lengths))
}

fn hd() -> Camera {
    pinhole(1920, 1080, FOCAL)
}

fn hd_lens(radius: f64, focus: f64) -> Camera {
    thin_lens(1920, 1080, FOCAL, radius, focus)
}

/// A cloud of one splat far from the world's zero, and the camera that sees it from nearby.
fn far_from_zero(offset: f64) -> (Cloud, Camera) {
    let origin = DVec3::new(offset, -0.7 * offset, 0.3 * offset);
    let (center, axes) = placed(5.0, 0.6, 40.0, [2.0; 2]);
    let turn = DQuat::from_axis_angle(DVec3::new(0.3, 0.8, -0.5).normalize(), 2.0);
    let eye = origin + DVec3::new(1.0, 2.0, 3.0);
    // The splat lies at `center` in the camera's space, up to the rounding of its offset from the origin.
    let world = |v: DVec3| turn.inverse() * v;
    let mut cloud = ellipses(&[(eye + world(center) - origin, axes.map(world))]);
    cloud.origin = origin;
    let world_to_camera = DMat4::from_quat(turn) * DMat4::from_translation(-eye);
    (cloud, Camera { world_to_camera, ..hd() })
}

/// The cases of notes 3.2 with F = 4, and their like for a lens and for parallel rays.
fn cases() -> Vec<(&'static str, Cloud, Camera)> {
    let one = |splat: (DVec3, [DVec3; 2])| ellipses(&[splat]);
    let scaled = |scale: f64| {
        let (center, axes) = placed(5.0, 0.6, 40.0, [2.0; 2]);
        one((center * scale, axes.map(|axis| axis * scale)))
    };
    let near = |near: f64| Camera { near, ..hd() };
    let parallel = orthographic(1920, 1080, 200.0);
    let flat =
        |center: DVec3, sigma: f64| one((center, [DVec3::X * sigma, DVec3::new(0.0, 0.3, 1.0) * sigma]));
    let ((cloud_e4, camera_e4), (cloud_e6, camera_e6)) = (far_from_zero(1e4), far_from_zero(1e6));
    vec![
        ("typical 2 px, centre", one(placed(5.0, 0.0, 40.0, [2.0; 2])), hd()),
        ("typical 2 px, corner", one(placed(5.0, 1.0, 40.0, [2.0; 2])), hd()),
        ("tiny .05 px", one(placed(5.0, 0.6, 40.0, [0.05; 2])), hd()),
        ("far 1e5, 1 px", one(placed(1e5, 0.6, 40.0, [1.0; 2])), hd()),
        ("grazing 85", one(placed(5.0, 0.6, 85.0, [2.0; 2])), hd()),
        ("grazing 89.9, 20 px", one(placed(5.0, 0.6, 89.9, [20.0; 2])), hd()),
        ("edge-on 89.999, 200 px", one(placed(5.0, 0.6, 89.999, [200.0; 2])), hd()),
        ("aniso 100:1", one(placed(5.0, 0.6, 40.0, [10.0, 0.1])), hd()),
        ("huge, near", one(placed(0.5, 0.3, 30.0, [3000.0; 2])), hd()),
        ("crossing", flat(DVec3::new(0.1, 0.5, 0.4), 1.0), near(0.05)),
        ("centre behind", flat(DVec3::new(0.1, -0.1, -0.6), 1.0), near(0.05)),
        ("centre at w = 0", flat(DVec3::new(0.1, 0.1, 0.0), 1.0), near(0.05)),
        ("world offset 1e4", cloud_e4, camera_e4),
        ("world offset 1e6", cloud_e6, camera_e6),
        ("scale 1e-6", scaled(1e-6), near(1e-9)),
        ("scale 1e8", scaled(1e8), near(1e3)),
        ("lens, focus in front", one(placed(5.0, 0.6, 40.0, [2.0; 2])), hd_lens(0.1, 2.0)),
        ("lens, focus at", one(placed(5.0, 0.6, 40.0, [2.0; 2])), hd_lens(0.1, 5.0)),
        ("lens, focus behind", one(placed(5.0, 0.6, 40.0, [2.0; 2])), hd_lens(0.1, 20.0)),
        ("lens, focus infinite", one(placed(5.0, 0.6, 40.0, [2.0; 2])), hd_lens(0.1, f64::INFINITY)),
        ("lens, corner", one(placed(5.0, 1.0, 40.0, [2.0; 2])), hd_lens(0.1, 4.0)),
        ("lens, larger than splat", one(placed(5.0, 0.6, 40.0, [2.0; 2])), hd_lens(1.0, 4.0)),
        ("lens, grazing 85", one(placed(5.0, 0.6, 85.0, [20.0; 2])), hd_lens(0.1, 4.0)),
        ("lens, grazing 89.9", one(placed(5.0, 0.6, 89.9, [20.0; 2])), hd_lens(0.1, 4.0)),
        ("lens, plane through it", one(placed(5.0, 0.6, 89.9, [200.0; 2])), hd_lens(1.0, 4.0)),
        ("lens, tiny .05 px", one(placed(5.0, 0.6, 40.0, [0.05; 2])), hd_lens(0.1, 5.1)),
        ("lens, aniso 100:1", one(placed(5.0, 0.6, 40.0, [10.0, 0.1])), hd_lens(0.1, 4.0)),
        ("lens, crossing", flat(DVec3::new(0.1, 0.5, 0.4), 1.0), Camera { near: 0.05, ..hd_lens(0.1, 2.0) }),
        ("parallel, typical", one(placed(5.0, 0.6, 40.0, [10.0; 2])), parallel.clone()),
        ("parallel, tiny .05 px", one(placed(5.0, 0.6, 40.0, [0.25; 2])), parallel.clone()),
        ("parallel, grazing 89.9", one(placed(5.0, 0.6, 89.9, [100.0; 2])), parallel.clone()),
        ("parallel, aniso 100:1", one(placed(5.0, 0.6, 40.0, [50.0, 0.5])), parallel),
    ]
}

#[test]
#[expect(clippy::print_stdout, reason = "the table of measurements, shown by --nocapture")]
fn the_cases_of_the_notes_stay_within_the_bound() {
    let mut rng = Random::new(1);
    println!("{:26} {:>6} {:>9} {:>9} {:>8} {:>8}", "case", "hits", "|du|", "bound", "u,v /", "depth /");
    for (name, cloud, camera) in cases() {
        let subject = Subject::new(&cloud, &camera, 4.0).unwrap_or_else(|| panic!("{name}: not visible"));
        let worst = compare(&subject, &mut rng, 8000).check(name);
        let Worst { hits, sigma, bound, uv, depth, .. } = worst;
        println!("{name:26} {hits:6} {sigma:9.1e} {bound:9.1e} {uv:8.3} {depth:8.3}");
        assert!(hits > 500, "{name}: {hits} hits");
        // The bound means something: it is not a hundred times too large.
        assert!(uv > 0.01 && depth > 0.01, "{name}: {uv} {depth}");
    }
}

#[test]
fn the_bounds_of_ordinary_splats_are_small() {
    // Notes 3.5, where sigma is at least .05 px and the tilt at most 85.
    let mut rng = Random::new(2);
    for (sigma, tilt) in [(2.0, 0.0), (2.0, 85.0), (0.05, 0.0), (0.05, 40.0), (50.0, 0.0)] {
        let cloud = ellipses(&[placed(5.0, 0.6, tilt, [sigma; 2])]);
        let subject = Subject::new(&cloud, &hd(), 4.0).expect("visible");
        let worst = compare(&subject, &mut rng, 1000).check("ordinary");
        assert!(worst.bound <= tol::ORDINARY_BOUND, "{sigma} px, {tilt}: {:e}", worst.bound);
    }
}

#[test]
fn a_perturbed_constant_leaves_the_bound() {
    // The comparison can fail: one constant off by 64 eps, which no rounding of a typical splat makes.
    let cloud = ellipses(&[placed(5.0, 0.6, 40.0, [2.0; 2])]);
    for camera in [hd(), hd_lens(0.1, 4.0), orthographic(1920, 1080, 200.0)] {
        let mut subject = Subject::new(&cloud, &camera, 4.0).expect("visible");
        subject.rounded.b[0] *= 1.0 + 64.0 * EPSILON as f32;
        let worst = compare(&subject, &mut Random::new(3), 4000);
        assert!(worst.violation.is_some(), "an error of 64 roundings went unseen");
    }
    let mut subject = Subject::new(&cloud, &hd_lens(0.1, 4.0), 4.0).expect("visible");
    subject.rounded.defocus *= 1.0 + 64.0 * EPSILON as f32;
    let worst = compare(&subject, &mut Random::new(3), 4000);
    assert!(worst.violation.is_some(), "an error of 64 roundings of the defocus went unseen");
}

// ---------------------------------------------------------------------------------------------------------
// Random splats

#[derive(Debug, Clone)]
struct Scene {
    cloud: Cloud,
    camera: Camera,
    cutoff: f64,
    seed: u64,
}

/// Any splat that may be seen: in front of the camera, or across the camera plane.
fn scene(seed: u64, form: usize, crossing: bool) -> Scene {
    let mut rng = Random::new(seed);
    let focal = rng.log_range(100.0, 3000.0);
    let depth = rng.log_range(1e-3, 1e6);
    let at = DVec2::new(rng.range(-0.5, 0.5) * 1920.0 / focal, rng.range(-0.5, 0.5) * 1080.0 / focal);
    let (center, axes) = if crossing {
        let center = DVec3::new(at.x, at.y, rng.range(-1.0, 1.0)) * depth;
        let sigma = rng.range(0.3, 3.0) * depth;
        (center, random_axes(&mut rng, sigma, 10.0))
    } else {
        let center = at.extend(1.0) * depth;
        let sigma = rng.log_range(0.05, 1000.0) * depth / focal;
        let lengths = [sigma, sigma / rng.log_range(1.0, 100.0)];
        let tilt = 90.0 - rng.log_range(1e-2, 90.0);
        (center, tilted_axes(center, tilt, rng.range(-PI, PI), rng.range(0.0, TAU), lengths))
    };
    let near = depth * rng.log_range(1e-4, 0.1);
    let far = if rng.index(4) == 0 { depth * rng.range(1.0, 1.1) } else { f64::INFINITY };
    let radius = depth * rng.log_range(1e-4, 0.5);
    let focus = if rng.index(5) == 0 { f64::INFINITY } else { depth * rng.log_range(0.1, 10.0) };
    let camera = match form {
        0 => pinhole(1920, 1080, focal),
        1 => thin_lens(1920, 1080, focal, radius, focus),
        _ => orthographic(1920, 1080, focal / depth),
    };
    let cutoff = [2.0, 4.0, 9.0][rng.index(3)];
    Scene { cloud: ellipses(&[(center, axes)]), camera: Camera { near, far, ..camera }, cutoff, seed }
}

fn stays_within_the_bound(scene: &Scene) {
    if let Some(subject) = Subject::new(&scene.cloud, &scene.camera, scene.cutoff) {
        compare(&subject, &mut Random::new(scene.seed ^ 1), 64).check("random splat");
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 40_000,
        failure_persistence: None,
        // The same cases in every run.
        rng_seed: RngSeed::Fixed(1),
        ..ProptestConfig::default()
    })]

    #[test]
    fn random_pinhole_splats_stay_within_the_bound(seed: u64, crossing: bool) {
        stays_within_the_bound(&scene(seed, 0, crossing));
    }

    #[test]
    fn random_splats_through_a_lens_stay_within_the_bound(seed: u64, crossing: bool) {
        stays_within_the_bound(&scene(seed, 1, crossing));
    }

    #[test]
    fn random_orthographic_splats_stay_within_the_bound(seed: u64, crossing: bool) {
        stays_within_the_bound(&scene(seed, 2, crossing));
    }
}

#[test]
fn most_random_splats_are_visible() {
    // What the properties above are about: at least half of the scenes leave hits to compare.
    for form in 0..3 {
        let mut compared = 0;
        for seed in 0..400 {
            let scene = scene(seed, form, seed % 2 == 0);
            let subject = Subject::new(&scene.cloud, &scene.camera, scene.cutoff);
            compared += usize::from(
                subject.is_some_and(|subject| compare(&subject, &mut Random::new(seed), 64).hits > 0),
            );
        }
        assert!(compared > 200, "form {form}: {compared} of 400");
    }
}

#[test]
fn a_lens_in_pixels_is_its_unit_aperture_scaled() {
    let lens = Lens { radius: 0.25, focus: 2.0, blades: 0 };
    let point = LensPoint::<f64>::new([0.5, -1.0], lens, DVec2::new(100.0, 200.0));
    assert_eq!(point.p, [12.5, -50.0]);
    assert_eq!(
        hd_lens(0.25, 2.0).projection,
        Projection::Perspective { focal_length: DVec2::splat(FOCAL), lens: Some(lens) }
    );
}
