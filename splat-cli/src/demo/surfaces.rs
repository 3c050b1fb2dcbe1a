//! Surfaces, covered evenly with points.

use glam::{DQuat, DVec3};
use std::f64::consts::{PI, TAU};

/// A point of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Where it is, in scene units.
    pub position: DVec3,
    /// Unit vector outwards.
    pub normal: DVec3,
    /// Sides of the piece of surface that it stands for, in scene units, tangent to the surface.
    pub sides: [DVec3; 2],
    /// Its place along the knot and around it, both in radians; zero elsewhere.
    pub place: [f64; 2],
}

impl Point {
    /// The area that it stands for, in squared scene units.
    pub fn area(&self) -> f64 {
        self.sides[0].cross(self.sides[1]).length()
    }
}

/// The golden angle, in radians.
const GOLDEN_ANGLE: f64 = PI * (3.0 - 2.236_067_977_499_79);

/// The i-th of n directions on a Fibonacci spiral from pole to pole along y, each with the same share of the
/// sphere.
pub fn fibonacci_direction(i: usize, n: usize) -> DVec3 {
    let y = 1.0 - (2.0 * i as f64 + 1.0) / n as f64;
    let ring = (1.0 - y * y).max(0.0).sqrt();
    let angle = GOLDEN_ANGLE * i as f64;
    DVec3::new(ring * libm::cos(angle), y, ring * libm::sin(angle))
}

/// A sphere, at this spacing of points.
pub fn sphere(center: DVec3, radius: f64, spacing: f64) -> Vec<Point> {
    let surface = 4.0 * PI * radius * radius;
    let count = (surface / (spacing * spacing)).ceil() as usize;
    let points = (0..count).map(|i| {
        let normal = fibonacci_direction(i, count);
        let side = (surface / count as f64).sqrt() * normal.any_orthonormal_vector();
        let position = center + radius * normal;
        Point { position, normal, sides: [side, normal.cross(side)], place: [0.0; 2] }
    });
    points.collect()
}

/// A tube along a torus knot.
#[derive(Debug, Clone, Copy)]
pub struct Knot {
    /// Centre of the torus.
    pub center: DVec3,
    /// How the torus, around the z axis, is turned.
    pub rotation: DQuat,
    /// Radius from the centre to the middle of the torus.
    pub major: f64,
    /// Radius of the torus around its middle.
    pub minor: f64,
    /// Radius of the tube.
    pub tube: f64,
}

impl Knot {
    /// Turns around the axis of the torus, and through its hole: a trefoil.
    const WINDINGS: [f64; 2] = [2.0, 3.0];

    /// The point of the middle line at `t` in [0, 2 pi), and the outward normal of the torus there.
    fn middle(&self, t: f64) -> [DVec3; 2] {
        let [around, through] = Self::WINDINGS.map(|windings| windings * t);
        let (cos_around, sin_around) = (libm::cos(around), libm::sin(around));
        let (cos_through, sin_through) = (libm::cos(through), libm::sin(through));
        let out = DVec3::new(cos_through * cos_around, cos_through * sin_around, -sin_through);
        let ring = self.major * DVec3::new(cos_around, sin_around, 0.0);
        [self.center + self.rotation * (ring + self.minor * out), self.rotation * out]
    }

    /// The point of the tube at `t` along it and `angle` around it, and its outward normal.
    fn surface(&self, t: f64, angle: f64) -> [DVec3; 2] {
        const STEP: f64 = 1e-4;
        let [middle, out] = self.middle(t);
        let tangent = (self.middle(t + STEP)[0] - self.middle(t - STEP)[0]).normalize();
        let side = tangent.cross(out).normalize();
        let up = side.cross(tangent);
        let normal = libm::cos(angle) * up + libm::sin(angle) * side;
        [middle + self.tube * normal, normal]
    }

    /// Spheres of the tube's radius along its middle line.
    pub fn beads(&self, count: usize) -> impl Iterator<Item = DVec3> {
        (0..count).map(move |i| self.middle(TAU * i as f64 / count as f64)[0])
    }

    /// The tube, at this spacing of points. A point's place is its `t` and its angle around the tube.
    pub fn points(&self, spacing: f64) -> Vec<Point> {
        const STEP: f64 = 1e-4;
        let around = (TAU * self.tube / spacing).ceil() as usize;
        let mut points = Vec::new();
        let (mut t, mut ring) = (0.0, 0);
        while t < TAU {
            let speed = (self.middle(t + STEP)[0] - self.middle(t - STEP)[0]).length() / (2.0 * STEP);
            let step = (spacing / speed).min(TAU - t);
            for i in 0..around {
                let angle = TAU * (i as f64 + 0.5 * f64::from(ring % 2)) / around as f64;
                let at = t + 0.5 * step;
                let [position, normal] = self.surface(at, angle);
                let along =
                    (self.surface(at + STEP, angle)[0] - self.surface(at - STEP, angle)[0]) / (2.0 * STEP);
                let across = TAU * self.tube / around as f64 * normal.cross(along).normalize();
                points.push(Point { position, normal, sides: [step * along, across], place: [at, angle] });
            }
            t += step;
            ring += 1;
        }
        points
    }
}

/// The ground y = 0 as seen by a camera at `eye_z` that looks along -z: rows across the view, from one depth
/// to another, as far aside as `half_width` at each depth. `spacing` is that of the points, across and along,
/// at a depth.
pub fn ground(
    eye_z: f64,
    depths: std::ops::Range<f64>,
    half_width: impl Fn(f64) -> f64,
    spacing: impl Fn(f64) -> [f64; 2],
) -> Vec<Point> {
    let mut points = Vec::new();
    let (mut depth, mut row) = (depths.start, 0);
    while depth < depths.end {
        let [across, along] = spacing(depth);
        let count = (half_width(depth) / across).ceil() as i32;
        for i in -count..=count {
            // Rows are staggered, and points moved a little off the lattice, which the eye would find.
            let x = f64::from(i) + 0.5 * f64::from(row % 2) + 0.25 * (hash(i, row) - 0.5);
            let z = 0.25 * (hash(row, i) - 0.5);
            let position = DVec3::new(x * across, 0.0, eye_z - depth - z * along);
            let sides = [DVec3::X * across, DVec3::NEG_Z * along];
            points.push(Point { position, normal: DVec3::Y, sides, place: [0.0; 2] });
        }
        depth += along;
        row += 1;
    }
    points
}

/// A number in [0, 1) that looks random and is the same for the same two integers.
pub fn hash(a: i32, b: i32) -> f64 {
    let mut bits =
        (a as u32).wrapping_mul(0x9e37_79b9) ^ (b as u32).wrapping_mul(0x85eb_ca6b).rotate_left(15);
    for factor in [0x7feb_352d_u32, 0x846c_a68b] {
        bits = (bits ^ (bits >> 16)).wrapping_mul(factor);
    }
    f64::from(bits ^ (bits >> 15)) / 4_294_967_296.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_areas_add_up() {
        let area = |points: &[Point]| points.iter().map(Point::area).sum::<f64>();
        let ball = sphere(DVec3::ONE, 0.5, 0.05);
        assert!((area(&ball) - PI).abs() < 1e-9);
        // A tube has the area of its middle line's length times its circumference, however it bends.
        let knot = Knot { center: DVec3::ZERO, rotation: DQuat::IDENTITY, major: 1.0, minor: 0.4, tube: 0.1 };
        let beads: Vec<DVec3> = knot.beads(10_000).collect();
        let length: f64 = (0..beads.len()).map(|i| beads[i].distance(beads[(i + 1) % beads.len()])).sum();
        let tube = area(&knot.points(0.05));
        assert!((tube / (length * TAU * 0.1) - 1.0).abs() < 0.01, "{tube}");
        let floor = ground(0.0, 1.0..3.0, |_| 2.0, |_| [0.02, 0.04]);
        assert!((area(&floor) / 8.0 - 1.0).abs() < 0.02);
    }

    #[test]
    fn normals_are_unit_vectors_outwards() {
        let knot = Knot { center: DVec3::ZERO, rotation: DQuat::IDENTITY, major: 1.0, minor: 0.4, tube: 0.1 };
        for point in knot.points(0.05) {
            assert!(point.normal.is_normalized());
            let nearest = knot.beads(2000).map(|bead| bead.distance(point.position + 0.05 * point.normal));
            assert!(nearest.fold(f64::INFINITY, f64::min) > 0.14);
        }
    }
}
