//! The geometric truth in f64, found by intersection and dense sampling.
//!
//! Nothing here uses a formula of the listing or of `splat-core`: a sample ray is intersected with a
//! splat's plane by solving the 3x3 system, boxes and depth extents come from points of the disc, the
//! circle of confusion from rays through points of the lens.
//!
//! Camera space: x right, y down, z = depth w (forward), the eye at the origin, the image plane at w = 1,
//! the lens in the plane w = 0. A *screen* point is (x/w, y/w) (tan units), or (x, y) of an orthographic
//! view (scene units).

use std::f64::consts::TAU;

use glam::{DMat3, DMat4, DVec2, DVec3};

/// Points of the coarse pass round a rim or over a lens.
const COARSE: usize = 2048;
/// Points of each refining pass.
const FINE: usize = 32;
/// Refining passes: the bracket shrinks by FINE/2 each time, so 10 reach the rounding of an angle.
const PASSES: usize = 10;
/// Rings and spokes of the interior points.
const RINGS: usize = 24;
const SPOKES: usize = 96;

/// How camera space maps to the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// (x/w, y/w).
    Perspective,
    /// (x, y).
    Orthographic,
}

/// A splat in camera space: the points `center + u t1 + v t2` with u^2 + v^2 < cutoff.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// The centre.
    pub center: DVec3,
    /// The sigma-scaled tangent axis of u.
    pub t1: DVec3,
    /// The sigma-scaled tangent axis of v; need not be perpendicular to `t1`.
    pub t2: DVec3,
    /// A vector on the front side of the plane, any length.
    pub normal: DVec3,
}

impl Disc {
    /// The disc with the normal t1 x t2.
    pub fn new(center: DVec3, t1: DVec3, t2: DVec3) -> Self {
        Self { center, t1, t2, normal: t1.cross(t2) }
    }

    /// A round disc of the world, `sigma` in world units, seen through `world_to_camera` (affine, column
    /// vectors; scale, shear and reflection allowed).
    pub fn round(position: DVec3, normal: DVec3, sigma: f64, world_to_camera: &DMat4) -> Self {
        let (a, b) = normal.normalize().any_orthonormal_pair();
        let linear = DMat3::from_mat4(*world_to_camera);
        Self {
            center: world_to_camera.transform_point3(position),
            t1: linear * (a * sigma),
            t2: linear * (b * sigma),
            normal: linear.inverse().transpose() * normal,
        }
    }

    /// The point (u, v), in units of sigma.
    pub fn point(&self, u: f64, v: f64) -> DVec3 {
        self.center + self.t1 * u + self.t2 * v
    }

    /// The rim's point at `angle` of the (u, v) plane, in radians.
    pub fn rim(&self, cutoff: f64, angle: f64) -> DVec3 {
        let r = cutoff.sqrt();
        self.point(r * libm::cos(angle), r * libm::sin(angle))
    }

    /// The intersection with a sample ray, anywhere on the plane.
    ///
    /// `None` if the ray is parallel to the plane, or (perspective) meets it at or behind its origin. The
    /// depth is *not* compared with a near plane, and (u, v) *not* with the cutoff.
    pub fn intersect(&self, ray: &SampleRay) -> Option<Hit> {
        let m = DMat3::from_cols(self.t1, self.t2, -ray.direction);
        if m.determinant() == 0.0 {
            return None;
        }
        let solution = m.inverse() * (ray.origin - self.center);
        if !solution.is_finite() || (!ray.from_infinity && solution.z <= 0.0) {
            return None;
        }
        let towards = if ray.from_infinity { -ray.direction } else { ray.origin - self.center };
        Some(Hit {
            u: solution.x,
            v: solution.y,
            depth: ray.origin.z + solution.z * ray.direction.z,
            along: solution.z,
            front: self.normal.dot(towards) > 0.0,
        })
    }

    /// The least and greatest depth of the whole disc, unclipped.
    pub fn depth_extent(&self, cutoff: f64) -> (f64, f64) {
        let depth = |angle| Some(self.rim(cutoff, angle).z);
        let far = maximum_on_circle(0.0, &depth).expect("defined everywhere");
        let near = maximum_on_circle(0.0, &|angle| depth(angle).map(|z| -z)).expect("defined everywhere");
        let (mut lo, mut hi) = (-near.1, far.1);
        for p in self.interior(cutoff) {
            lo = lo.min(p.z);
            hi = hi.max(p.z);
        }
        (lo, hi)
    }

    /// The screen box of the part of the disc with depth >= `near`; `None` if nothing is left.
    /// `near` must be positive for a perspective view. The box is attained by points of the disc, so it is
    /// never too large.
    pub fn projected_box(&self, cutoff: f64, near: f64, view: View) -> Option<Rect> {
        self.box_under(cutoff, near, &|p: DVec3| match view {
            View::Perspective => p.truncate() / p.z,
            View::Orthographic => p.truncate(),
        })
    }

    /// The screen box of the clipped disc as seen through all of a lens: the rim of the lens is sampled at
    /// `lens_points` points, the first at angle 0.
    pub fn projected_box_through_lens(
        &self,
        cutoff: f64,
        near: f64,
        lens: &Lens,
        lens_points: usize,
    ) -> Option<Rect> {
        (0..lens_points)
            .filter_map(|i| {
                let p = lens.rim(TAU * i as f64 / lens_points as f64);
                self.box_under(cutoff, near, &|point| lens.image_of(point, p))
            })
            .reduce(Rect::union)
    }

    fn box_under(&self, cutoff: f64, near: f64, project: &dyn Fn(DVec3) -> DVec2) -> Option<Rect> {
        let shown = |p: DVec3| (p.z >= near).then(|| project(p));
        // A disc that only just reaches over the near plane shows a short arc about its deepest point.
        let (deepest, _) = maximum_on_circle(0.0, &|angle| Some(self.rim(cutoff, angle).z))?;
        let side =
            |axis: DVec2| maximum_on_circle(deepest, &|a| shown(self.rim(cutoff, a)).map(|s| s.dot(axis)));
        let (right, left) = (side(DVec2::X)?.1, side(DVec2::NEG_X)?.1);
        let (bottom, top) = (side(DVec2::Y)?.1, side(DVec2::NEG_Y)?.1);
        let rim = Rect { min: DVec2::new(-left, -top), max: DVec2::new(right, bottom) };
        let inside = self.interior(cutoff).filter_map(shown).map(|s| Rect { min: s, max: s });
        Some(inside.fold(rim, Rect::union))
    }

    fn interior(&self, cutoff: f64) -> impl Iterator<Item = DVec3> + '_ {
        (0..RINGS * SPOKES).map(move |i| {
            let r = (i / SPOKES) as f64 / RINGS as f64;
            self.rim(cutoff * r * r, TAU * (i % SPOKES) as f64 / SPOKES as f64)
        })
    }
}

/// Where a sample ray meets a splat's plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The first plane coordinate, in units of sigma.
    pub u: f64,
    /// The second plane coordinate, in units of sigma.
    pub v: f64,
    /// The depth w.
    pub depth: f64,
    /// The ray parameter, in units of the ray's direction.
    pub along: f64,
    /// Whether the ray's origin (the eye, or the lens point) is on the front side of the plane.
    pub front: bool,
}

impl Hit {
    /// u^2 + v^2.
    pub fn r2(&self) -> f64 {
        self.u * self.u + self.v * self.v
    }
}

/// A ray of camera space that belongs to a screen point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleRay {
    /// The eye, the lens point, or a point of the plane w = 0.
    pub origin: DVec3,
    /// The direction, not normalised.
    pub direction: DVec3,
    /// Whether the origin stands for a point at infinity (orthographic).
    pub from_infinity: bool,
}

impl SampleRay {
    /// From the eye through the screen point.
    pub fn pinhole(screen: DVec2) -> Self {
        Self { origin: DVec3::ZERO, direction: screen.extend(1.0), from_infinity: false }
    }

    /// From a point of the lens through the point of the plane of focus that the eye sees at `screen`.
    pub fn thin_lens(screen: DVec2, lens_point: DVec2, lens: &Lens) -> Self {
        let direction = if lens.focus.is_infinite() {
            screen.extend(1.0)
        } else {
            (screen * lens.focus - lens_point).extend(lens.focus)
        };
        Self { origin: lens_point.extend(0.0), direction, from_infinity: false }
    }

    /// Along the depth axis through (x, y).
    pub fn orthographic(screen: DVec2) -> Self {
        Self { origin: screen.extend(0.0), direction: DVec3::Z, from_infinity: true }
    }
}

/// A thin lens in the plane w = 0 about the eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// The radius, in scene units.
    pub radius: f64,
    /// The depth of the plane of focus; may be infinite.
    pub focus: f64,
}

impl Lens {
    /// The lens of an f-number when the image plane is at distance 1: the thin lens that images depth
    /// `focus` on depth 1 has 1/f = 1/1 + 1/focus, and its aperture is f/N wide.
    pub fn of_f_number(f_number: f64, focus: f64) -> Self {
        Self { radius: 0.5 / (1.0 + 1.0 / focus) / f_number, focus }
    }

    /// The rim's point at `angle`, in radians.
    pub fn rim(&self, angle: f64) -> DVec2 {
        DVec2::new(libm::cos(angle), libm::sin(angle)) * self.radius
    }

    /// The screen point whose ray through `lens_point` meets `point`: the line from the lens point through
    /// the point is followed to the plane of focus, which the eye projects.
    pub fn image_of(&self, point: DVec3, lens_point: DVec2) -> DVec2 {
        let across = point.truncate() - lens_point;
        if self.focus.is_infinite() {
            return across / point.z;
        }
        (lens_point + across * (self.focus / point.z)) / self.focus
    }

    /// The radius of the circle of confusion of a point at `depth`, in screen units: the farthest image
    /// from the one through the lens's centre, over the lens's points.
    pub fn circle_of_confusion(&self, depth: f64) -> f64 {
        let point = DVec3::new(0.0, 0.0, depth);
        let middle = self.image_of(point, DVec2::ZERO);
        let mut largest = 0.0_f64;
        for i in 0..COARSE {
            let p = self.rim(TAU * i as f64 / COARSE as f64);
            for scale in [0.25, 0.5, 0.75, 1.0] {
                largest = largest.max((self.image_of(point, p * scale) - middle).length());
            }
        }
        largest
    }

    /// The share of the lens whose points see the front of the disc's plane, from about `points` points of
    /// a square grid.
    pub fn share_that_sees_the_front(&self, disc: &Disc, points: usize) -> f64 {
        let n = (points as f64).sqrt().ceil() as usize;
        let at = |i: usize| (2.0 * (i as f64 + 0.5) / n as f64 - 1.0) * self.radius;
        let (mut on_lens, mut front) = (0_usize, 0_usize);
        for i in 0..n * n {
            let p = DVec2::new(at(i % n), at(i / n));
            if p.length() < self.radius {
                on_lens += 1;
                front += usize::from(disc.normal.dot(p.extend(0.0) - disc.center) > 0.0);
            }
        }
        front as f64 / on_lens as f64
    }
}

/// An axis-parallel rectangle of the screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rect {
    /// Least x and y.
    pub min: DVec2,
    /// Greatest x and y.
    pub max: DVec2,
}

impl Rect {
    /// The rectangle [x0, x1] x [y0, y1].
    pub fn new(x0: f64, y0: f64, x1: f64, y1: f64) -> Self {
        Self { min: DVec2::new(x0, y0), max: DVec2::new(x1, y1) }
    }

    /// The least rectangle that holds both.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// What both share, if they touch.
    pub fn intersection(self, other: Self) -> Option<Self> {
        let r = Self { min: self.min.max(other.min), max: self.max.min(other.max) };
        (r.min.cmple(r.max).all()).then_some(r)
    }

    /// Grown by `by` on all four sides.
    pub fn grown(self, by: f64) -> Self {
        Self { min: self.min - by, max: self.max + by }
    }

    /// Whether the point is inside or on the border.
    pub fn contains(self, p: DVec2) -> bool {
        self.min.cmple(p).all() && p.cmple(self.max).all()
    }

    /// Width and height.
    pub fn size(self) -> DVec2 {
        self.max - self.min
    }

    /// The greatest distance between corresponding sides; NaN if a side is NaN.
    pub fn distance(self, other: Self) -> f64 {
        let d = [
            self.min.x - other.min.x,
            self.min.y - other.min.y,
            self.max.x - other.max.x,
            self.max.y - other.max.y,
        ];
        d.iter().fold(0.0, |m: f64, x| if x.is_nan() || m.is_nan() { f64::NAN } else { m.max(x.abs()) })
    }
}

/// The place and value of the greatest value of `f` over the angles, in radians; `None` where `f` is
/// undefined. A coarse pass that starts at `first`, then every coarse local maximum is refined.
fn maximum_on_circle(first: f64, f: &dyn Fn(f64) -> Option<f64>) -> Option<(f64, f64)> {
    let step = TAU / COARSE as f64;
    let value = |angle: f64| f(angle).unwrap_or(f64::NEG_INFINITY);
    let coarse: Vec<f64> = (0..COARSE).map(|i| value(first + step * i as f64)).collect();
    let mut best = (first, f64::NEG_INFINITY);
    for (i, &here) in coarse.iter().enumerate() {
        let (before, after) = (coarse[(i + COARSE - 1) % COARSE], coarse[(i + 1) % COARSE]);
        if here == f64::NEG_INFINITY || here < before || here < after {
            continue;
        }
        let (mut peak, mut half) = ((first + step * i as f64, here), step);
        for _ in 0..PASSES {
            let middle = peak.0;
            for k in 0..=FINE {
                let angle = middle + half * (2.0 * k as f64 / FINE as f64 - 1.0);
                let candidate = value(angle);
                if candidate > peak.1 {
                    peak = (angle, candidate);
                }
            }
            half *= 2.0 / FINE as f64;
        }
        if peak.1 > best.1 {
            best = peak;
        }
    }
    (best.1 > f64::NEG_INFINITY).then_some(best)
}
