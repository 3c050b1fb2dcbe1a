//! Ray differentials: how a ray's hit, direction and texture coordinates change from pixel to pixel. Seed 3,
//! sections 11.1.1 and 11.1.3; Igehy 1999.
//!
//! In `f64` and in world space, since there is one ray a pixel. No function panics, whatever its arguments.

use super::footprint::{PixelDerivatives, SINGULAR, bounded};
use crate::distortion::FilmMap;
use crate::{Camera, Projection};
use glam::{DVec2, DVec3};

/// Where |n.d| is smaller than this (n and d of unit length) a ray grazes the surface.
const GRAZING: f64 = 1e-8;

/// How far, in pixels, a ray may start outside of the frame of a camera whose lens distorts: a wide filter, and a pixel more.
const ROOM: f64 = 3.0;

/// A ray in world space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: DVec3,
    /// Its direction, of unit length.
    pub direction: DVec3,
}

/// A ray, and those of the next pixels in x and in y.
///
/// All directions must be of unit length: their differences are the derivatives of a unit vector (erratum
/// F10). [`Ray::new`] sees to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayDifferential {
    /// The pixel's ray.
    pub ray: Ray,
    /// The rays of the next pixel in x and of the next pixel in y.
    pub next: [Ray; 2],
}

/// A surface around a point: what a hit knows of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface {
    /// The point p, in world space.
    pub position: DVec3,
    /// Its unit normal n, of either sign. Whoever turns it around must turn `normal_derivatives`, too
    /// (erratum F10).
    pub normal: DVec3,
    /// dp/du and dp/dv.
    pub position_derivatives: [DVec3; 2],
    /// dn/du and dn/dv, of the unit normal. Zero if flat.
    pub normal_derivatives: [DVec3; 2],
}

/// How what a hit knows changes from one pixel to the next.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SurfaceDifferentials {
    /// dp/dx and dp/dy, in world units a pixel.
    pub position: [DVec3; 2],
    /// The derivatives of (u, v).
    pub parameters: PixelDerivatives,
    /// dn/dx and dn/dy.
    pub normal: [DVec3; 2],
}

impl Ray {
    /// A ray whose direction is brought to unit length. A direction of length zero stays zero.
    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        Self { origin, direction: unit(direction) }
    }

    /// The camera's ray of a place of the picture, in pixels, through the point `on_lens` of the unit disc,
    /// which only matters with a thin lens: a ray goes through P(w) = p + w (s - p/focus), notes 3.4.
    ///
    /// Pinhole rays start at the eye, those of a lens in its plane w = 0, and so do orthographic ones. A place that sees
    /// nothing, since the lens distorts too much there, has a ray of direction zero.
    pub fn from_camera(camera: &Camera, pixel: DVec2, on_lens: DVec2) -> Self {
        let ideal = match FilmMap::new(camera, ROOM) {
            None => pixel,
            Some(map) => match map.ideal(pixel) {
                None => return Self::new(camera.eye(), DVec3::ZERO),
                Some(ideal) => ideal,
            },
        };
        let screen = (ideal - camera.principal_point) / camera.pixel_scale();
        let (origin, direction) = match camera.projection {
            Projection::Orthographic { .. } => (screen.extend(0.0), DVec3::Z),
            Projection::Perspective { lens: None, .. } => (DVec3::ZERO, screen.extend(1.0)),
            Projection::Perspective { lens: Some(lens), .. } => {
                let p = lens.radius * on_lens;
                (p.extend(0.0), (screen - p / lens.focus).extend(1.0))
            }
        };
        let to_world = camera.linear().inverse();
        Self::new(camera.eye() + to_world * origin, to_world * direction)
    }
}

impl RayDifferential {
    /// The camera's ray of a place of the picture and those of the same point of the lens, one pixel on.
    pub fn from_camera(camera: &Camera, pixel: DVec2, on_lens: DVec2) -> Self {
        let ray = |pixel| Ray::from_camera(camera, pixel, on_lens);
        Self { ray: ray(pixel), next: [ray(pixel + DVec2::X), ray(pixel + DVec2::Y)] }
    }

    /// dp/dx and dp/dy: from the hit `position` to where the next pixels' rays meet its tangent plane.
    ///
    /// t = -(n.o + d)/(n.dir) with d = -n.p (the seed prints -(n.o) + d: erratum F2), here t = -n.(o -
    /// p)/(n.dir), which keeps its digits far from the world's origin.
    ///
    /// Where the next ray goes to the other side of the plane, because the horizon lies between them, it is
    /// the derivative of the ray itself (Igehy's transfer), with |n.dir| taken as 1e-8 at least. The result
    /// is at most 1e8 times as long as the ray; zero if an argument is not finite.
    pub fn on_tangent_plane(&self, position: DVec3, normal: DVec3) -> [DVec3; 2] {
        self.next.map(|next| {
            let slope = normal.dot(self.ray.direction);
            let next_slope = normal.dot(next.direction);
            let from_hit = next.origin - position;
            let offset = if slope * next_slope > 0.0 {
                from_hit - normal.dot(from_hit) / next_slope * next.direction
            } else {
                let t = (position - self.ray.origin).dot(self.ray.direction);
                let moved = next.origin - self.ray.origin + t * (next.direction - self.ray.direction);
                let slope = slope.abs().max(GRAZING).copysign(slope);
                moved - normal.dot(moved) / slope * self.ray.direction
            };
            let reach = (self.ray.origin - position).length() + from_hit.length();
            at_most(offset, reach / GRAZING)
        })
    }

    /// The rays that a perfect mirror sends on. The printed formula, which is right for unit directions:
    /// dwi = -dwo + 2 ((wo.n) dn + (dwo.n + wo.dn) n).
    ///
    /// What is not finite stays so; the derivatives of the next hit are zero then.
    pub fn reflected(&self, surface: &Surface, differentials: &SurfaceDifferentials) -> Self {
        let (n, wo) = (surface.normal, -self.ray.direction);
        let cosine = wo.dot(n);
        let wi = 2.0 * cosine * n - wo;
        self.sent_on(surface, differentials, wi, |i, dwo| {
            let dn = differentials.normal[i];
            let dcosine = dwo.dot(n) + wo.dot(dn);
            2.0 * (cosine * dn + dcosine * n) - dwo
        })
    }

    /// The rays that go on into another medium; `eta` is the ratio of the index of refraction on the side of
    /// the ray to that on the other. `None` for total internal reflection, at the critical angle, and if an
    /// argument is not finite.
    ///
    /// The seed leaves it out. With n on the side of wo (dn turned with it), k = eta, |wi.n| = sqrt(1 - k^2
    /// (1 - (wo.n)^2)): wi = -k wo + mu n, mu = k (wo.n) - |wi.n|, dmu = (k - k^2 (wo.n)/|wi.n|) (dwo.n +
    /// wo.dn), dwi = -k dwo + mu dn + dmu n. (pbrt-v4 multiplies dwo by 1/k instead: erratum F11.)
    pub fn refracted(
        &self,
        surface: &Surface,
        differentials: &SurfaceDifferentials,
        eta: f64,
    ) -> Option<Self> {
        let wo = -self.ray.direction;
        let side = if wo.dot(surface.normal) < 0.0 { -1.0 } else { 1.0 };
        let n = side * surface.normal;
        let cosine = wo.dot(n);
        let squared = 1.0 - eta * eta * (1.0 - cosine * cosine);
        if !(squared.is_finite() && squared > 0.0) {
            return None;
        }
        let beyond = squared.sqrt();
        let mu = eta * cosine - beyond;
        let result = self.sent_on(surface, differentials, mu * n - eta * wo, |i, dwo| {
            let dn = side * differentials.normal[i];
            let dcosine = dwo.dot(n) + wo.dot(dn);
            let dmu = (eta - eta * eta * cosine / beyond) * dcosine;
            mu * dn + dmu * n - eta * dwo
        });
        result.is_finite().then_some(result)
    }

    /// The rays that start at the hit and, to first order, at its neighbours (seed 3: rd.rx.o = p + dpdx).
    /// `change` gives dwi/dx (0) or dwi/dy (1) from dwo. Unit length changes the directions to second order
    /// only.
    fn sent_on(
        &self,
        surface: &Surface,
        differentials: &SurfaceDifferentials,
        wi: DVec3,
        change: impl Fn(usize, DVec3) -> DVec3,
    ) -> Self {
        let next = [0, 1].map(|i| {
            let dwo = self.ray.direction - self.next[i].direction;
            Ray::new(surface.position + differentials.position[i], wi + change(i, dwo))
        });
        Self { ray: Ray::new(surface.position, wi), next }
    }

    fn is_finite(&self) -> bool {
        let rays = [self.ray, self.next[0], self.next[1]];
        rays.iter().all(|ray| ray.origin.is_finite() && ray.direction.is_finite())
    }
}

impl Surface {
    /// What changes how much from pixel to pixel where `ray` hits this surface (ComputeDifferentials of the
    /// seed).
    pub fn differentials(&self, ray: &RayDifferential) -> SurfaceDifferentials {
        let position = ray.on_tangent_plane(self.position, self.normal);
        let [x, y] = position.map(|offset| self.parameters_of(offset));
        let [dndu, dndv] = self.normal_derivatives;
        let normal = [x, y].map(|change| change.x * dndu + change.y * dndv);
        SurfaceDifferentials { position, parameters: PixelDerivatives { x, y }, normal }
    }

    /// (du, dv) with du dp/du + dv dp/dv as near as can be to `offset`: least squares, three equations for
    /// two unknowns.
    ///
    /// By the normal equations A^t A, whose determinant |dp/du x dp/dv|^2 is had without cancellation by way
    /// of the cross product N: du = (offset x dp/dv).N/N^2, dv = (dp/du x offset).N/N^2.
    ///
    /// Singular is |N| <= 2^-24 |dp/du| |dp/dv|, relative, whatever the unit of length (the printed solver
    /// takes |det| < 1e-10 for it: erratum F8). Then it is the pseudo-inverse along the one live direction,
    /// A^t offset/|A|^2: not the whole texture, nor a point of it (erratum F9). Bounded like
    /// [`PixelDerivatives::bounded`].
    pub fn parameters_of(&self, offset: DVec3) -> DVec2 {
        let [dpdu, dpdv] = self.position_derivatives;
        let lengths = DVec2::new(dpdu.abs().max_element(), dpdv.abs().max_element());
        let longest = lengths.max_element();
        if !(longest > 0.0 && longest.is_finite() && dpdu.is_finite() && dpdv.is_finite()) {
            return DVec2::ZERO;
        }
        if lengths.min_element() > 0.0 {
            let [u, v] = [dpdu / lengths.x, dpdv / lengths.y];
            let normal = u.cross(v);
            if normal.length() > SINGULAR * u.length() * v.length() {
                let solution = DVec2::new(offset.cross(v).dot(normal), u.cross(offset).dot(normal));
                return bounded(solution / normal.length_squared() / lengths);
            }
        }
        let [u, v] = [dpdu / longest, dpdv / longest];
        let squared = u.length_squared() + v.length_squared();
        bounded(DVec2::new(u.dot(offset), v.dot(offset)) / squared / longest)
    }
}

/// A vector of unit length, without overflow; zero stays zero.
fn unit(vector: DVec3) -> DVec3 {
    let longest = vector.abs().max_element();
    if longest > 0.0 && longest.is_finite() { (vector / longest).normalize() } else { vector }
}

/// The vector, shortened to `length` if it is longer; zero if it is not finite.
fn at_most(vector: DVec3, length: f64) -> DVec3 {
    if !vector.is_finite() {
        return DVec3::ZERO;
    }
    let ratio = vector.length() / length;
    if ratio > 1.0 { vector / ratio } else { vector }
}
