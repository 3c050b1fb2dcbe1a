//! What a lookup averages, in texels: the sanitised ellipse of a footprint.

use crate::texture::Footprint;
use crate::texture::pyramid::{Level, Wrap};
use glam::{DVec2, Vec2};

/// Footprints are at most this many times as large as the texture, in each of s and t and from the centre: what reaches
/// farther has the mean of a periodic texture already, to a thousandth of its contrast.
pub const MAX_PERIODS: f64 = 4.0;

/// The largest anisotropy that a lookup honours.
pub const MAX_ANISOTROPY: f64 = 256.0;

/// The largest position, in periods from the texture's origin, of wraps that are no period.
const FAR: f64 = 64.0;

/// A symmetric 2 x 2 matrix `[xx, xy, yy]`.
pub type Symmetric = [f64; 3];

/// An ellipse in texels of level 0, finite and of bounded anisotropy: the set-up that all filters share, once per lookup.
///
/// Its points are `M^(1/2) p` for |p| <= 1, with `M = J J^T` and J the footprint's semi-diameters as columns: so it
/// does not matter which of its conjugate semi-diameters describe it (E1, E9).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipse {
    /// M, in squared texels of level 0 in (s, t).
    pub matrix: Symmetric,
    /// The longer semi-axis, in texels of level 0.
    pub major: f64,
    /// The shorter semi-axis, in texels of level 0: at least `major` over the largest anisotropy (E8).
    pub minor: f64,
    /// The unit vector along the longer axis.
    pub direction: DVec2,
}

impl Ellipse {
    /// The ellipse of a footprint in a texture of `size` texels. Where it is longer than `max_anisotropy` (clamped
    /// to 1 to [`MAX_ANISOTROPY`]; not a number: 1) times its width, it is widened, so that a lookup's time has a bound.
    ///
    /// Any footprint will do: a vector that has a NaN is taken for zero, and what exceeds [`MAX_PERIODS`] is
    /// shrunk to that (E10). All in `f64`, where the products of the determinant of two `f32` vectors are exact, so
    /// that it does not cancel (E3), and units are texels per axis (E2).
    pub fn new(footprint: &Footprint, size: [u32; 2], max_anisotropy: f64) -> Self {
        let [a, b] = footprint.semi_axes.map(finite);
        let [limit_s, limit_t] = [a.x * a.x + b.x * b.x, a.y * a.y + b.y * b.y].map(shrinkage);
        let scale = DVec2::new(f64::from(size[0]) * limit_s, f64::from(size[1]) * limit_t);
        let determinant = (a.x * b.y - a.y * b.x) * scale.x * scale.y;
        let (a, b) = (a * scale, b * scale);
        let (xx, xy, yy) = (a.x * a.x + b.x * b.x, a.x * a.y + b.x * b.y, a.y * a.y + b.y * b.y);

        // Eigenvalues of [xx, xy; xy, yy]; the lesser from the determinant, since the difference cancels.
        let half = 0.5 * (xx - yy);
        let root = (half * half + xy * xy).sqrt();
        let major_squared = 0.5 * (xx + yy) + root;
        let minor_squared = if major_squared > 0.0 { determinant * determinant / major_squared } else { 0.0 };
        let axis = if half >= 0.0 { DVec2::new(half + root, xy) } else { DVec2::new(xy, root - half) };
        let direction = axis.try_normalize().unwrap_or(DVec2::X);

        let anisotropy = honoured_anisotropy(max_anisotropy);
        let minor_squared = minor_squared.max(major_squared / (anisotropy * anisotropy)).min(major_squared);
        let DVec2 { x, y } = direction;
        let matrix = [
            major_squared * x * x + minor_squared * y * y,
            (major_squared - minor_squared) * x * y,
            major_squared * y * y + minor_squared * x * x,
        ];
        Self { matrix, major: major_squared.sqrt(), minor: minor_squared.sqrt(), direction }
    }
}

/// The nearest anisotropy that lookups honour: 1 to [`MAX_ANISOTROPY`], and 1 for what is not a number.
pub fn honoured_anisotropy(max_anisotropy: f64) -> f64 {
    if max_anisotropy.is_nan() { 1.0 } else { max_anisotropy.clamp(1.0, MAX_ANISOTROPY) }
}

/// A vector without NaN and infinities.
fn finite(vector: Vec2) -> DVec2 {
    if vector.is_nan() {
        return DVec2::ZERO;
    }
    vector.clamp(Vec2::splat(f32::MIN), Vec2::splat(f32::MAX)).as_dvec2()
}

/// The factor that brings an extent, given by its square, in periods, to the most that is allowed.
fn shrinkage(squared: f64) -> f64 {
    if squared > MAX_PERIODS * MAX_PERIODS { MAX_PERIODS / squared.sqrt() } else { 1.0 }
}

/// A position in periods, reduced by the wraps so that texel indices are small; what is not finite becomes 0.
pub fn place(wrap: [Wrap; 2], st: Vec2) -> DVec2 {
    let reduce = |position: f32, wrap: Wrap| {
        let position = if position.is_finite() { f64::from(position) } else { 0.0 };
        match wrap {
            Wrap::Repeat => position - position.floor(),
            Wrap::Mirror => position - 2.0 * (0.5 * position).floor(),
            Wrap::Clamp | Wrap::Black => position.clamp(-FAR, FAR),
        }
    };
    DVec2::new(reduce(st.x, wrap[0]), reduce(st.y, wrap[1]))
}

/// A place in texels of a level, where texel i has its centre at i.
pub(super) fn texel_place(place: DVec2, level: &Level) -> DVec2 {
    DVec2::new(place.x * f64::from(level.size()[0]), place.y * f64::from(level.size()[1])) - 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ellipse(a: [f32; 2], b: [f32; 2], size: [u32; 2]) -> Ellipse {
        Ellipse::new(&Footprint { semi_axes: [a.into(), b.into()] }, size, 64.0)
    }

    #[test]
    fn axes_of_conjugate_vectors() {
        // 16 x 1 texels along (3, 4)/5, its semi-diameters turned by any angle.
        let (major, minor) = (DVec2::new(9.6, 12.8), DVec2::new(-0.8, 0.6));
        for i in 0..32 {
            let (sin, cos) = (libm::sin(0.2 * f64::from(i)), libm::cos(0.2 * f64::from(i)));
            let [a, b] = [cos * major + sin * minor, cos * minor - sin * major];
            let found = ellipse((a / 64.0).as_vec2().to_array(), (b / 64.0).as_vec2().to_array(), [64, 64]);
            assert!((found.major - 16.0).abs() < 4e-6 && (found.minor - 1.0).abs() < 4e-6, "{found:?}");
            assert!(found.direction.perp_dot(major).abs() < 1e-5);
        }
    }

    #[test]
    fn each_axis_has_its_own_unit() {
        let found = ellipse([1.0 / 1024.0, 0.0], [0.0, 1.0 / 64.0], [1024, 64]);
        assert_eq!((found.major, found.minor), (1.0, 1.0));
    }

    #[test]
    fn a_line_is_widened_and_a_point_is_not() {
        let found = ellipse([0.5, 0.5], [0.0, 0.0], [256, 256]);
        assert!((found.major / found.minor - 64.0).abs() < 1e-12);
        assert_eq!(ellipse([0.0; 2], [0.0; 2], [256, 256]).major, 0.0);
    }

    #[test]
    fn nothing_is_too_large() {
        let all = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, 1e-45, -0.0, 1.0];
        for i in 0..all.len().pow(4) {
            let value = |place: u32| all[i / all.len().pow(place) % all.len()];
            let found = ellipse([value(0), value(1)], [value(2), value(3)], [16384, 4]);
            let most = 1.5 * MAX_PERIODS * 16384.0;
            assert!((0.0..=most).contains(&found.major) && (0.0..=found.major).contains(&found.minor));
            assert!(found.minor * 64.01 >= found.major, "{found:?}");
            assert!(found.direction.is_finite() && found.matrix.iter().all(|m| m.abs() <= most * most));
        }
    }
}
