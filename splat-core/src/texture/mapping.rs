//! From a point of a surface to texture coordinates, with their derivatives. Seed 3, section 11.2.
//!
//! The derivatives are analytic, and so have no seam: the seed's differences of coordinates, which jump
//! there, are kept as [`difference_quotient`] to compare with. Angles are in turns (1 is 2 pi), as texture
//! coordinates are. Whatever the arguments, nothing panics, and derivatives are finite (see
//! [`PixelDerivatives::bounded`]).

use super::footprint::{Footprint, PixelDerivatives};
use glam::{DAffine3, DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// A longitude's greatest derivative, in turns a pixel: such a footprint reaches all the way around.
const FULL_TURN: f64 = 1.0;

/// A point in space, and how it changes from one pixel to the next.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SpacePoint {
    /// The point.
    pub point: DVec3,
    /// Its change a pixel of x: dp/dx.
    pub dx: DVec3,
    /// Its change a pixel of y: dp/dy.
    pub dy: DVec3,
}

/// Texture coordinates, and how they change from one pixel to the next.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TexturePoint {
    /// (s, t), where 1 is the whole texture.
    pub st: DVec2,
    /// The derivatives of (s, t). Their footprint: [`PixelDerivatives::semi_axes`] or
    /// [`PixelDerivatives::full_sides`].
    pub derivatives: PixelDerivatives,
}

impl SpacePoint {
    /// Texture coordinates and a footprint as a point of the plane z = 0, for functions of space.
    pub fn in_plane(st: DVec2, footprint: &Footprint) -> Self {
        let [dx, dy] = footprint.semi_axes.map(|axis| axis.as_dvec2().extend(0.0));
        Self { point: st.extend(0.0), dx, dy }
    }
}

/// The coordinates of the surface itself, scaled and moved: s = su u + du, t = sv v + dv (section 11.2.1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UvMapping {
    /// su and sv: how often the texture repeats over a unit of u and of v.
    pub scale: DVec2,
    /// du and dv: where it starts.
    pub offset: DVec2,
}

impl UvMapping {
    /// Texture coordinates of (u, v) and its derivatives.
    pub fn map(&self, uv: DVec2, derivatives: &PixelDerivatives) -> TexturePoint {
        let derivatives = PixelDerivatives { x: self.scale * derivatives.x, y: self.scale * derivatives.y };
        TexturePoint { st: self.scale * uv + self.offset, derivatives: derivatives.bounded() }
    }
}

/// A sphere around the origin of the texture's space, onto which points are projected from its centre
/// (section 11.2.2).
///
/// s = theta/pi in [0, 1], 0 at the pole on +z; t = phi/(2 pi) in [0, 1], the turn from +x to +y. The seam t
/// = 0 is on +x.
///
/// The polar angle is atan2(hypot(x, y), z), since acos(z/r) knows angles near the poles only to 2e-4 in
/// `f32` (erratum F7). At a pole, where t is undefined, it is the one of phi = 0, ds is the change of the
/// distance to the pole, and dt that of a full turn; nowhere is dt more. At the centre all is zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SphericalMapping {
    /// To the texture's space.
    pub world_to_texture: DAffine3,
}

impl SphericalMapping {
    /// Texture coordinates of a point and its derivatives.
    pub fn map(&self, at: &SpacePoint) -> TexturePoint {
        let Some(local) = Local::new(&self.world_to_texture, at) else { return TexturePoint::default() };
        let polar = libm::atan2(local.axis_distance(), local.point.z) / PI;
        TexturePoint {
            st: DVec2::new(polar, local.turn()),
            derivatives: local.derivatives(Local::polar_change, Local::turn_change),
        }
    }
}

/// What the height on a cylinder is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CylinderHeight {
    /// z/|p| in [-1, 1], as the seed prints it (and pbrt up to v3): the point is normalised first, so that
    /// the lines of equal t are those of a sphere.
    #[default]
    Normalized,
    /// z, in units of the texture's space: projected onto the cylinder at right angles to its axis (pbrt-v4).
    AlongAxis,
}

/// A cylinder around the z axis of the texture's space (section 11.2.3).
///
/// s = 1/2 + phi/(2 pi) in [0, 1], with the seam on -x (there it is s that jumps, though pbrt up to v3
/// corrects t: erratum F5); t by [`CylinderHeight`]. On the axis, where s is undefined, it is 1/2, and ds
/// that of a full turn; nowhere is ds more. At the centre all is zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CylindricalMapping {
    /// To the texture's space.
    pub world_to_texture: DAffine3,
    /// What t is.
    pub height: CylinderHeight,
}

impl CylindricalMapping {
    /// Texture coordinates of a point and its derivatives.
    pub fn map(&self, at: &SpacePoint) -> TexturePoint {
        let Some(local) = Local::new(&self.world_to_texture, at) else { return TexturePoint::default() };
        let (height, height_change): (f64, fn(&Local, DVec3) -> f64) = match self.height {
            CylinderHeight::Normalized => (local.point.z / local.distance(), Local::sine_change),
            CylinderHeight::AlongAxis => {
                (local.point.z * local.scale, |local, change| change.z * local.scale)
            }
        };
        // Half a turn on from [0, 1): from [-1/2, 1/2] to [0, 1].
        let turn = local.signed_turn() + 0.5;
        TexturePoint {
            st: DVec2::new(turn, height),
            derivatives: local.derivatives(Local::turn_change, height_change),
        }
    }
}

/// A plane spanned by two vectors of the texture's space: s = p.vs + ds, t = p.vt + dt (section 11.2.4).
///
/// The seed, and pbrt before v4, know no transform here (erratum F12).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanarMapping {
    /// To the texture's space.
    pub world_to_texture: DAffine3,
    /// vs, in textures a unit.
    pub vs: DVec3,
    /// vt, in textures a unit.
    pub vt: DVec3,
    /// ds and dt: (s, t) of the origin.
    pub offset: DVec2,
}

impl PlanarMapping {
    /// Texture coordinates of a point and its derivatives.
    pub fn map(&self, at: &SpacePoint) -> TexturePoint {
        let local = SolidMapping { world_to_texture: self.world_to_texture }.map(at);
        let along = |vector: DVec3| DVec2::new(vector.dot(self.vs), vector.dot(self.vt));
        let derivatives = PixelDerivatives { x: along(local.dx), y: along(local.dy) }.bounded();
        TexturePoint { st: along(local.point) + self.offset, derivatives }
    }
}

/// Space itself, moved into the texture's: for textures that are functions of three coordinates
/// (`TextureMapping3D`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolidMapping {
    /// To the texture's space.
    pub world_to_texture: DAffine3,
}

impl SolidMapping {
    /// The point in the texture's space, with its derivatives. Derivatives that are not finite become zero.
    pub fn map(&self, at: &SpacePoint) -> SpacePoint {
        let vector = |v: DVec3| {
            let v = self.world_to_texture.transform_vector3(v);
            if v.is_finite() { v } else { DVec3::ZERO }
        };
        SpacePoint {
            point: self.world_to_texture.transform_point3(at.point),
            dx: vector(at.dx),
            dy: vector(at.dy),
        }
    }
}

/// The derivative of texture coordinates along `change` by a forward difference over `delta` of it, as the
/// seed has it for spheres and cylinders, corrected: the coordinates that wrap around (period 1) jump at the
/// seam, and lose their whole turns *before* the division by `delta`.
///
/// As printed, 1 - d or -(d + 1) replaces a *quotient* d beyond +-1/2: too late, and of the wrong sign
/// (erratum F4: -8.98 for -0.0159). Correct as long as the coordinates change by less than half a turn over
/// the difference. For tests.
pub fn difference_quotient(
    map: impl Fn(DVec3) -> DVec2,
    point: DVec3,
    change: DVec3,
    delta: f64,
    wraps: [bool; 2],
) -> DVec2 {
    let difference = map(point + delta * change) - map(point);
    let turns = DVec2::from(wraps.map(|wraps| if wraps { 1.0 } else { 0.0 })) * difference.round();
    (difference - turns) / delta
}

/// A point and its derivatives in the texture's space, divided by `scale`, a power of 2, so that nothing
/// overflows and no digit is lost.
struct Local {
    scale: f64,
    point: DVec3,
    changes: [DVec3; 2],
}

impl Local {
    /// `None` at the centre, and for a point that is not finite.
    fn new(world_to_texture: &DAffine3, at: &SpacePoint) -> Option<Self> {
        let SpacePoint { point, dx, dy } = SolidMapping { world_to_texture: *world_to_texture }.map(at);
        let longest = point.abs().max_element();
        let usable = point.is_finite() && longest > 0.0;
        let scale = libm::scalbn(1.0, libm::ilogb(longest));
        usable.then(|| Self { scale, point: point / scale, changes: [dx / scale, dy / scale] })
    }

    fn distance(&self) -> f64 {
        self.point.length()
    }

    fn axis_distance(&self) -> f64 {
        libm::hypot(self.point.x, self.point.y)
    }

    /// The turn from +x to +y, in [-1/2, 1/2]; 0 on the axis, also for negative zeros.
    fn signed_turn(&self) -> f64 {
        if self.axis_distance() == 0.0 {
            return 0.0;
        }
        libm::atan2(self.point.y, self.point.x) / TAU
    }

    /// The same in [0, 1].
    fn turn(&self) -> f64 {
        let turn = self.signed_turn();
        if turn < 0.0 { turn + 1.0 } else { turn }
    }

    /// dphi = (x dy - y dx)/rho^2, in turns.
    fn turn_change(&self, change: DVec3) -> f64 {
        let rho = self.axis_distance();
        if rho == 0.0 {
            return if change.x == 0.0 && change.y == 0.0 { 0.0 } else { FULL_TURN };
        }
        let [cosine, sine] = [self.point.x / rho, self.point.y / rho];
        ((cosine * change.y - sine * change.x) / rho / TAU).clamp(-FULL_TURN, FULL_TURN)
    }

    /// dtheta = (z drho - rho dz)/r^2, over pi.
    fn polar_change(&self, change: DVec3) -> f64 {
        let [rho, r] = [self.axis_distance(), self.distance()];
        (self.point.z / r * self.axis_distance_change(change) - rho / r * change.z) / r / PI
    }

    /// d(z/r) = rho (rho dz - z drho)/r^3.
    fn sine_change(&self, change: DVec3) -> f64 {
        let [rho, r] = [self.axis_distance(), self.distance()];
        rho / r * (rho / r * change.z - self.point.z / r * self.axis_distance_change(change)) / r
    }

    /// drho = (x dx + y dy)/rho; on the axis, whence it grows in every direction, the length of (dx, dy).
    fn axis_distance_change(&self, change: DVec3) -> f64 {
        let rho = self.axis_distance();
        if rho == 0.0 {
            return libm::hypot(change.x, change.y);
        }
        self.point.x / rho * change.x + self.point.y / rho * change.y
    }

    fn derivatives(&self, s: fn(&Self, DVec3) -> f64, t: fn(&Self, DVec3) -> f64) -> PixelDerivatives {
        let [x, y] = self.changes.map(|change| DVec2::new(s(self, change), t(self, change)));
        PixelDerivatives { x, y }.bounded()
    }
}
