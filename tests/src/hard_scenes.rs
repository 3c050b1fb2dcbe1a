//! Scenes that are meant to be hard for a renderer: splats of every [`Kind`] before any camera ([`adversarial`]), and
//! surfaces in many layers ([`sheets`]).

use glam::{DMat4, DQuat, DVec2, DVec3, Vec3};
use splat_core::{Camera, Cloud, Shapes};

use crate::random::Random;

/// What is hard about a splat.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Nothing.
    Ordinary,
    /// Seen at 80 to 89.99 degrees from its normal.
    EdgeOn,
    /// Of a sigma of 0.02 to 0.5 pixels.
    SubPixel,
    /// Of a sigma of 500 to 5000 pixels.
    Huge,
    /// Before the eye and behind it.
    CrossesCamera,
    /// Cut by the near plane.
    CrossesNear,
    /// Cut by the far plane, if there is one.
    CrossesFar,
    /// Wholly behind the eye.
    Behind,
    /// Parallel to the picture, at a depth that others have too.
    SameDepth,
    /// The splat before it once more.
    Duplicate,
    /// A thousand times as long as wide.
    Needle,
    /// Of a denormal weight.
    Light,
    /// Of opacity 0.
    Clear,
    /// Its plane passes through the lens, or through the eye.
    ThroughLens,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 14] = [
        Self::Ordinary,
        Self::EdgeOn,
        Self::SubPixel,
        Self::Huge,
        Self::CrossesCamera,
        Self::CrossesNear,
        Self::CrossesFar,
        Self::Behind,
        Self::SameDepth,
        Self::Duplicate,
        Self::Needle,
        Self::Light,
        Self::Clear,
        Self::ThroughLens,
    ];
}

/// A depth shared by splats of [`Kind::SameDepth`].
const SHARED_DEPTH: f64 = 3.0;

/// A splat of some kind, in camera space.
#[derive(Debug, Clone, Copy)]
struct HardSplat {
    place: DVec3,
    axes: [DVec3; 2],
    /// Relative to the area between its axes.
    area: f64,
    opacity: f32,
}

/// Makes splats for a camera.
struct Maker<'a> {
    camera: &'a Camera,
    random: Random,
}

impl Maker<'_> {
    /// The size of a pixel at a depth.
    fn pixel(&self, depth: f64) -> f64 {
        let depth = if self.camera.is_orthographic() { 1.0 } else { depth.abs() };
        depth / self.camera.pixel_scale().x
    }

    /// A place at a depth, a little beyond the frame at most.
    fn place(&mut self, depth: f64) -> DVec3 {
        let frame = DVec2::new(f64::from(self.camera.width), f64::from(self.camera.height));
        let at = DVec2::new(self.random.range(-0.1, 1.1), self.random.range(-0.1, 1.1)) * frame;
        ((at - self.camera.principal_point) * self.pixel(depth)).extend(depth)
    }

    /// The direction in which a place is seen.
    fn ray(&self, place: DVec3) -> DVec3 {
        if self.camera.is_orthographic() { DVec3::Z } else { place.normalize() }
    }

    /// Round axes of this size in any direction.
    fn axes(&mut self, size: f64) -> [DVec3; 2] {
        // By Euler's angles about x, y and z; by `libm`, so that scenes are the same on every machine.
        let [(sa, ca), (sb, cb), (sc, cc)] =
            [0; 3].map(|_| libm::sincos(self.random.range(0.0, std::f64::consts::TAU)));
        let first = DVec3::new(cb * cc, sa * sb * cc + ca * sc, sa * sc - ca * sb * cc);
        let second = DVec3::new(-cb * sc, ca * cc - sa * sb * sc, ca * sb * sc + sa * cc);
        [first * size, second * size]
    }

    /// Axes of this size, the first of which is all but along a direction: as far off as `angle`.
    fn axes_along(&mut self, direction: DVec3, angle: f64, size: f64) -> [DVec3; 2] {
        let across = direction.cross(self.random.direction()).normalize();
        let first = libm::cos(angle) * direction + libm::sin(angle) * across;
        [first * size, direction.cross(across) * size]
    }

    fn splat(&mut self, kind: Kind) -> HardSplat {
        let depth = self.random.log_range(0.5, 12.0);
        let place = self.place(depth);
        let pixel = self.pixel(depth);
        let sigma = self.random.log_range(0.5, 6.0) * pixel;
        let area = self.random.log_range(0.02, 4.0);
        let opacity = if self.random.index(2) == 0 { 1.0 } else { self.random.unit() as f32 };
        let ordinary = HardSplat { place, axes: self.axes(sigma), area, opacity };
        match kind {
            Kind::Ordinary | Kind::Duplicate => ordinary,
            Kind::EdgeOn => {
                let angle = self.random.log_range(0.01, 10.0).to_radians();
                let size = self.random.log_range(1.0, 40.0) * pixel;
                HardSplat { axes: self.axes_along(self.ray(place), angle, size), ..ordinary }
            }
            Kind::SubPixel => {
                let size = self.random.log_range(0.02, 0.5) * pixel;
                HardSplat { axes: self.axes(size), ..ordinary }
            }
            Kind::Huge => {
                // Facing the eye, or it would reach to the camera plane.
                let size = self.random.log_range(500.0, 5000.0) * pixel;
                let tilt = self.random.log_range(1e-3, 0.1) * self.random.direction();
                let normal = (self.ray(place) + tilt).normalize();
                let first = normal.cross(self.random.direction()).normalize();
                HardSplat { axes: [first * size, normal.cross(first) * size], ..ordinary }
            }
            Kind::CrossesCamera => {
                let depth = self.random.range(-0.6, 0.6);
                let size = self.random.log_range(0.8, 4.0);
                let direction = (DVec3::Z + 0.7 * self.random.direction()).normalize();
                let side = DVec3::new(self.random.range(-0.7, 0.7), self.random.range(-0.7, 0.7), depth);
                let angle = self.random.range(0.0, 0.3);
                HardSplat { place: side, axes: self.axes_along(direction, angle, size), ..ordinary }
            }
            Kind::CrossesNear | Kind::CrossesFar => {
                let plane = if kind == Kind::CrossesNear { self.camera.near } else { self.camera.far };
                let plane = if plane.is_finite() { plane.max(0.01) } else { 100.0 };
                let depth = plane * self.random.range(0.8, 1.2);
                let size = plane * self.random.log_range(0.03, 0.3);
                HardSplat { place: self.place(depth), axes: self.axes(size), ..ordinary }
            }
            Kind::Behind => {
                let axes = ordinary.axes.map(|axis| axis * 0.05);
                HardSplat { place: -place, axes, ..ordinary }
            }
            Kind::SameDepth => {
                let place = self.place(SHARED_DEPTH);
                let size = self.random.log_range(1.0, 8.0) * self.pixel(SHARED_DEPTH);
                HardSplat { place, axes: [DVec3::X * size, DVec3::Y * size], ..ordinary }
            }
            Kind::Needle => {
                let [first, second] = self.axes(self.random.clone().log_range(5.0, 60.0) * pixel);
                HardSplat { axes: [first, second * 1e-3], ..ordinary }
            }
            Kind::Light => HardSplat { area: self.random.log_range(1e-43, 1e-38), ..ordinary },
            Kind::Clear => HardSplat { opacity: 0.0, ..ordinary },
            Kind::ThroughLens => {
                let size = self.random.log_range(1.0, 30.0) * pixel;
                let radius = self.camera.lens().map_or(1e-4, |lens| lens.radius);
                let through = (radius * self.random.in_disc()).extend(0.0);
                let direction =
                    if self.camera.is_orthographic() { DVec3::Z } else { (place - through).normalize() };
                let angle = if self.camera.lens().is_some() { 0.0 } else { 1e-3 };
                HardSplat { axes: self.axes_along(direction, angle, size), ..ordinary }
            }
        }
    }
}

/// What the cloud of [`adversarial`] knows of its splats.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Knowledge {
    /// Which side of a splat is its front.
    pub orientation: bool,
    /// Opacities.
    pub opacities: bool,
    /// Areas; without, no weight is denormal.
    pub areas: bool,
    /// Elliptical shapes; without, needles are round.
    pub ellipses: bool,
}

/// A cloud of `count` splats, as many of each kind, that `camera` sees as described; and their kinds. The cloud lies where
/// the camera is.
pub fn adversarial(count: usize, seed: u64, camera: &Camera, known: Knowledge) -> (Cloud, Vec<Kind>) {
    let mut maker = Maker { camera, random: Random::new(seed) };
    let kinds: Vec<Kind> = (0..count).map(|i| Kind::ALL[i % Kind::ALL.len()]).collect();
    let mut splats: Vec<HardSplat> = Vec::new();
    for &kind in &kinds {
        let before = splats.last().filter(|_| kind == Kind::Duplicate).copied();
        splats.push(before.unwrap_or_else(|| maker.splat(kind)));
    }
    let random = &mut maker.random;
    let eye = camera.eye();
    // Where the eye is far from the origin all of it is, and the offsets stay exact.
    let origin = DVec3::from_array(eye.to_array().map(|x| if x.abs() > 1000.0 { x } else { 0.0 }));
    let to_world = camera.linear().inverse();
    let place = |splat: &HardSplat| (to_world * splat.place + (eye - origin)).as_vec3();
    let axes: Vec<[DVec3; 2]> = splats.iter().map(|splat| splat.axes.map(|axis| to_world * axis)).collect();
    let areas = axes.iter().zip(&splats).map(|([t1, t2], splat)| {
        let area = if known.ellipses { t1.cross(*t2).length() } else { t1.length_squared() };
        (splat.area * area).max(1e-44) as f32
    });
    let cloud = Cloud {
        origin,
        positions: splats.iter().map(place).collect(),
        normals: axes
            .iter()
            .map(|[t1, t2]| {
                let side = if random.index(2) == 0 { 1.0 } else { -1.0 };
                (side * t1.cross(*t2)).normalize().as_vec3()
            })
            .collect(),
        colors: Some((0..count).map(|_| Vec3::from_array([0; 3].map(|_| random.unit() as f32))).collect()),
        opacities: known.opacities.then(|| splats.iter().map(|splat| splat.opacity).collect()),
        areas: known.areas.then(|| areas.collect()),
        shapes: if known.ellipses {
            Shapes::Ellipses(axes.iter().map(|axes| axes.map(|axis| axis.as_vec3())).collect())
        } else {
            Shapes::Discs(axes.iter().map(|[t1, _]| t1.length() as f32).collect())
        },
        oriented: known.orientation,
        ..Cloud::default()
    };
    (cloud, kinds)
}

/// The camera, which stands at the world's origin, turned and moved there.
pub fn moved(camera: Camera, turn: DQuat, to: DVec3) -> Camera {
    Camera {
        world_to_camera: DMat4::from_quat(turn) * DMat4::from_translation(-to) * camera.world_to_camera,
        ..camera
    }
}

/// Which way the splats of [`sheets`] face.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Facing {
    /// All to the eye.
    Front,
    /// All away from it.
    Back,
    /// Every other sheet away.
    BySheet,
    /// Each at random.
    Mixed,
}

/// Surfaces one behind the other.
#[derive(Debug, Clone, Copy)]
pub struct Sheets {
    /// How many.
    pub count: usize,
    /// How far apart, in sigma.
    pub spacing: f64,
    /// How much splats lie before and behind their sheet, in sigma.
    pub noise: f64,
    /// How much they are tilted at random.
    pub tilt: f64,
    /// Sum of the weights in a sample of a sheet, about.
    pub weight: f64,
    /// Which way they face.
    pub facing: Facing,
    /// Whether they let light through.
    pub clear: bool,
}

/// Sheets across a small picture of `pinhole(40, 36, 60.0)`, from depth 4 on, of splats of a sigma of 2.5 pixels.
pub fn sheets(sheets: &Sheets, seed: u64) -> Cloud {
    const SIGMA: f64 = 2.5 * 4.0 / 60.0;
    let mut random = Random::new(seed);
    let mut cloud = Cloud { shapes: Shapes::Discs(vec![]), oriented: true, ..Cloud::default() };
    let (mut sizes, mut colors, mut opacities, mut areas) = (vec![], vec![], vec![], vec![]);
    for sheet in 0..sheets.count {
        for column in -8..=8 {
            for row in -7..=7 {
                let jitter = DVec2::new(random.range(-0.5, 0.5), random.range(-0.5, 0.5));
                let at = DVec2::new(f64::from(column), f64::from(row)) + jitter;
                let depth = sheet as f64 * sheets.spacing + random.range(-sheets.noise, sheets.noise);
                let place = DVec3::new(0.0, 0.0, 4.0) + at.extend(depth) * SIGMA;
                let away = match sheets.facing {
                    Facing::Front => false,
                    Facing::Back => true,
                    Facing::BySheet => sheet % 2 == 1,
                    Facing::Mixed => random.index(2) == 0,
                };
                let normal = (DVec3::NEG_Z + sheets.tilt * random.direction()).normalize();
                cloud.positions.push(place.as_vec3());
                cloud.normals.push((if away { -normal } else { normal }).as_vec3());
                sizes.push(SIGMA as f32);
                colors.push(Vec3::from_array([0; 3].map(|_| random.unit() as f32)));
                opacities.push([1.0, 0.9, 0.3, 0.0][random.index(4)]);
                areas.push((sheets.weight * random.range(0.3, 1.7) * SIGMA * SIGMA) as f32);
            }
        }
    }
    cloud.shapes = Shapes::Discs(sizes);
    cloud.colors = Some(colors);
    cloud.opacities = sheets.clear.then_some(opacities);
    cloud.areas = Some(areas);
    cloud
}
