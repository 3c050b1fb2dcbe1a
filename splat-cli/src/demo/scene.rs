//! The still life: what stands where, and the camera.

use super::light::{Occluder, Stage};
use super::paint::{Paint, Painter};
use super::surfaces::{self, Knot, Point, hash};
use glam::{DMat3, DMat4, DQuat, DVec2, DVec3, Vec3};
use splat_core::{Camera, Cloud, Lens, Projection, Shapes};

/// Where the camera is, and where it looks.
const EYE: DVec3 = DVec3::new(0.0, 1.34, 4.35);
const TARGET: DVec3 = DVec3::new(0.0, 0.70, 0.0);

/// Half the picture's width, over the depth.
const HALF_WIDTH: f64 = 0.41;

/// The lens: its radius, in scene units, and the depth in focus.
const APERTURE: f64 = 0.05;
const FOCUS: f64 = 4.15;
const BLADES: u32 = 7;

/// Width, in pixels, of the picture for which the density of the points is chosen.
const WIDTH: f64 = 1280.0;

/// Linear colour far away.
const HAZE: DVec3 = DVec3::new(0.050, 0.066, 0.084);

/// Sigma of a splat, relative to the spacing of the points.
const SIGMA: f64 = 0.8;

const KNOT_TUBE: f64 = 0.155;
const GLASS: Occluder = Occluder { center: DVec3::new(-0.98, 0.36, 0.86), radius: 0.36 };
const DOTTED: Occluder = Occluder { center: DVec3::new(1.12, 0.50, -0.42), radius: 0.50 };

/// The colour behind everything: the ground fades into it.
pub fn background() -> [f32; 4] {
    let [red, green, blue] = HAZE.as_vec3().to_array();
    [red, green, blue, 1.0]
}

/// The camera, for a picture of this size.
pub fn camera([width, height]: [u32; 2]) -> Camera {
    let forward = (TARGET - EYE).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    let rotation = DMat3::from_cols(right, forward.cross(right), forward).transpose();
    let size = DVec2::new(width.into(), height.into());
    // The whole still life is in view whatever the shape of the picture.
    let focal_length = (0.5 * size / DVec2::new(HALF_WIDTH, HALF_WIDTH * 9.0 / 16.0)).min_element();
    Camera {
        width,
        height,
        projection: Projection::Perspective {
            focal_length: DVec2::splat(focal_length),
            lens: Some(Lens { radius: APERTURE, focus: FOCUS, blades: BLADES }),
        },
        principal_point: 0.5 * size,
        world_to_camera: DMat4::from_mat3(rotation) * DMat4::from_translation(-EYE),
        near: 0.01,
        far: f64::INFINITY,
        clip_planes: Vec::new(),
        distortion: None,
    }
}

/// Distance between points at a depth: so many pixels, and more where the picture is out of focus anyway.
fn spacing(depth: f64, pixels: f64) -> f64 {
    let focal_length = 0.5 * WIDTH / HALF_WIDTH;
    let blur = APERTURE * focal_length * (1.0 / depth - 1.0 / FOCUS).abs();
    (pixels + 0.6 * blur) * depth / focal_length
}

/// Distances between the points of the ground, across and along the view: longer where they are
/// foreshortened.
fn ground_spacing(depth: f64) -> [f64; 2] {
    let across = spacing(depth, 4.0);
    let foreshortening = depth / EYE.y;
    [across, across * foreshortening.min(2.4 + 0.5 * (depth - 7.0).max(0.0))]
}

/// The surfels of the still life.
pub fn cloud() -> Cloud {
    let knot = knot();
    let pearls = pearls();
    let bead = |center| Occluder { center, radius: KNOT_TUBE };
    let painter = Painter {
        stage: Stage {
            spheres: std::iter::once(DOTTED).chain(pearls.iter().copied()).collect(),
            beads: knot.beads(96).map(bead).collect(),
            glass: GLASS,
            haze: HAZE,
        },
        eye: EYE,
    };
    let mut cloud = Collector::default();
    let reach = |depth: f64| 1.08 * HALF_WIDTH * depth + 0.25;
    for point in surfaces::ground(EYE.z, 2.4..26.0, reach, ground_spacing) {
        cloud.add(&point, painter.ground(&point));
    }
    for point in knot.points(spacing(EYE.distance(knot.center), 3.2)) {
        cloud.add(&point, painter.knot(&point));
    }
    let turned = DQuat::from_xyzw(0.41, 0.0, -0.36, 0.838).normalize();
    for point in cover(&DOTTED, 3.2) {
        cloud.add(&point, painter.dotted(&point, turned));
    }
    for point in cover(&GLASS, 3.6) {
        // Of the far half one sees the inside.
        let seen = if point.normal.dot(EYE - point.position) < 0.0 { -point.normal } else { point.normal };
        cloud.add(&Point { normal: seen, ..point }, painter.glass(&point));
    }
    for (pearl, number) in pearls.iter().zip(0..) {
        for point in cover(pearl, 2.8) {
            cloud.add(&point, painter.pearl(&point, hash(number, 77)));
        }
    }
    cloud.finish()
}

/// The points of a sphere, as dense as its distance asks for.
fn cover(sphere: &Occluder, pixels: f64) -> Vec<Point> {
    let nearest = EYE.distance(sphere.center) - sphere.radius;
    surfaces::sphere(sphere.center, sphere.radius, spacing(nearest, pixels).min(0.2 * sphere.radius))
}

/// The trefoil knot, standing on the ground.
fn knot() -> Knot {
    // Turned a little to the left, leaning back, two of its lobes below.
    let turn = |axis: DVec3, degrees: f64| {
        let half = 0.5 * degrees.to_radians();
        let DVec3 { x, y, z } = libm::sin(half) * axis;
        DQuat::from_xyzw(x, y, z, libm::cos(half))
    };
    let rotation = turn(DVec3::Y, -24.0) * turn(DVec3::X, -10.0) * turn(DVec3::Z, 90.0);
    let mut knot =
        Knot { center: DVec3::new(-0.06, 0.0, 0.0), rotation, major: 0.47, minor: 0.225, tube: KNOT_TUBE };
    let lowest = knot.beads(2000).map(|bead| bead.y).fold(f64::INFINITY, f64::min);
    knot.center.y = KNOT_TUBE - lowest;
    knot
}

/// The pearls: some placed by hand, others scattered far behind.
fn pearls() -> Vec<Occluder> {
    const PLACED: [[f64; 3]; 12] = [
        [-0.40, 1.17, 0.085],
        [-0.18, 1.02, 0.05],
        [0.36, 1.00, 0.09],
        [0.56, 0.86, 0.055],
        [0.88, 0.74, 0.11],
        [1.24, 0.46, 0.065],
        [-1.62, 0.02, 0.13],
        [-1.30, -0.22, 0.08],
        [-0.92, -0.80, 0.10],
        [1.17, 1.16, 0.15],
        [-1.42, 1.02, 0.07],
        [0.02, 1.14, 0.04],
    ];
    let on_ground = |[x, z, radius]: [f64; 3]| Occluder { center: DVec3::new(x, radius, z), radius };
    let scattered = (0..26).map(|i| {
        let depth = 6.6 + 11.0 * hash(i, 1) * hash(i, 2) + 0.16 * f64::from(i);
        let aside = (2.0 * hash(i, 3) - 1.0) * 0.92 * HALF_WIDTH * depth;
        on_ground([aside, EYE.z - depth, 0.10 + 0.16 * hash(i, 4)])
    });
    PLACED.into_iter().map(on_ground).chain(scattered).collect()
}

/// Points and paint, on the way to a cloud.
#[derive(Debug, Default)]
struct Collector {
    cloud: Cloud,
    axes: Vec<[Vec3; 2]>,
    colors: Vec<Vec3>,
    opacities: Vec<f32>,
    areas: Vec<f32>,
}

impl Collector {
    fn add(&mut self, point: &Point, paint: Paint) {
        self.cloud.positions.push(point.position.as_vec3());
        self.cloud.normals.push(point.normal.as_vec3().normalize());
        self.axes.push(point.sides.map(|side| (SIGMA * side).as_vec3()));
        self.colors.push(paint.color.as_vec3());
        self.opacities.push(paint.opacity.clamp(0.0, 1.0) as f32);
        self.areas.push(point.area() as f32);
    }

    fn finish(self) -> Cloud {
        Cloud {
            shapes: Shapes::Ellipses(self.axes),
            colors: Some(self.colors),
            opacities: Some(self.opacities),
            areas: Some(self.areas),
            oriented: true,
            ..self.cloud
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_still_life_is_sound_and_the_same_every_time() {
        let cloud = cloud();
        assert!((100_000..=300_000).contains(&cloud.len()), "{}", cloud.len());
        cloud.check_lengths().unwrap();
        assert!((0..cloud.len()).all(|index| cloud.defect(index).is_none()));
        assert_eq!(cloud, super::cloud());
        let lowest = cloud.positions.iter().map(|position| position.y).fold(f32::INFINITY, f32::min);
        assert!(lowest > -0.01, "{lowest}");
        camera([1280, 720]).check().unwrap();
    }
}
