//! The part of a texture that one lookup averages.
//!
//! Two conventions are in use for the two vectors that say it, and they differ by a factor of 2: pbrt's are
//! semi-diameters of an ellipse, Ptex's the full sides of a parallelogram. Each has a type here. What both
//! are made from, the change of the coordinates from one pixel to the next, is a third: [`PixelDerivatives`].

use crate::evaluate::{LensPoint, SplatConstants};
use glam::{DMat2, DVec2, Vec2};

/// Greatest component of a footprint's vectors and of derivatives, in whole textures: pbrt-v4's bound. Its
/// square times that of a side of 2^16 texels is far below the greatest `f32`.
pub const MAX_COMPONENT: f64 = 1e8;

/// A ratio of |det| to the product of the rows' lengths at which a matrix of `f32` is singular: rounding its
/// entries alone may change the determinant by this much.
pub const SINGULAR: f64 = 1.0 / (1u64 << 24) as f64;

/// An ellipse in texture coordinates (s, t), given by two of its conjugate semi-diameters: the vectors from
/// its centre to its rim are `cos(a) semi_axes[0] + sin(a) semi_axes[1]`.
///
/// With the change of (s, t) from one pixel to the next in x and in y as the vectors, this is the footprint
/// of pbrt (seed 1). They need not be at right angles. Ptex gives full sides instead: see [`FullSides`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Footprint {
    /// The two semi-diameters, in units of (s, t): 1 is the whole texture.
    pub semi_axes: [Vec2; 2],
}

/// A parallelogram in texture coordinates, given by its two full sides, as Ptex describes a footprint (seed
/// 0): the sides are the *diameters* of the ellipse that it encloses.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FullSides {
    /// The two sides, in units of (s, t): 1 is the whole texture.
    pub sides: [Vec2; 2],
}

/// The change of two surface coordinates, (u, v) or (s, t), from one pixel to the next: their Jacobian by the
/// pixel (x, y), by columns.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PixelDerivatives {
    /// Change a pixel of x: (du/dx, dv/dx).
    pub x: DVec2,
    /// Change a pixel of y: (du/dy, dv/dy).
    pub y: DVec2,
}

/// The axes of a footprint's ellipse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrincipalAxes {
    /// Unit vector along the major axis; (1, 0) for a circle.
    pub direction: DVec2,
    /// Semi-axis along it, in the units of the footprint.
    pub major: f64,
    /// Semi-axis across it, at most `major`.
    pub minor: f64,
}

impl From<FullSides> for Footprint {
    fn from(FullSides { sides }: FullSides) -> Self {
        Self { semi_axes: sides.map(|side| 0.5 * side) }
    }
}

impl From<Footprint> for FullSides {
    fn from(Footprint { semi_axes }: Footprint) -> Self {
        Self { sides: semi_axes.map(|axis| 2.0 * axis) }
    }
}

impl FullSides {
    /// The parallelogram of two given sides (seed 0, W1 and W2).
    pub const fn new(first: Vec2, second: Vec2) -> Self {
        Self { sides: [first, second] }
    }

    /// A rectangle along the axes of the texture, `width` in s by `height` in t: seed 0, case A.
    pub const fn texture_aligned(width: f32, height: f32) -> Self {
        Self::new(Vec2::new(width, 0.0), Vec2::new(0.0, height))
    }
}

impl Footprint {
    /// The ellipse of two given conjugate semi-diameters.
    pub const fn new(first: Vec2, second: Vec2) -> Self {
        Self { semi_axes: [first, second] }
    }

    /// A footprint without NaN or infinity, whose components are at most [`MAX_COMPONENT`]. Per vector:
    ///
    /// - with a component that is not a number, nothing is known of it: zero, a point sample (as pbrt-v4
    ///   does);
    /// - with an infinite component it has the direction of its infinite components, at the bound;
    /// - longer than the bound it keeps its direction, and its longer component becomes the bound;
    /// - otherwise it stays as it is.
    pub fn sanitized(&self) -> Self {
        Self { semi_axes: self.semi_axes.map(|axis| bounded(axis.as_dvec2()).as_vec2()) }
    }

    /// Half the width and height of the ellipse's bounding box: the roots of the diagonal of J J^t. Of the
    /// sanitised footprint, so finite.
    pub fn half_box(&self) -> DVec2 {
        let [a, b] = self.sanitized().semi_axes.map(|axis| axis.as_dvec2());
        DVec2::new((a.x * a.x + b.x * b.x).sqrt(), (a.y * a.y + b.y * b.y).sqrt())
    }

    /// The ellipse's axes, by the eigenvalues of M = J J^t = a a^t + b b^t (a, b the semi-diameters). Never
    /// NaN: the footprint is sanitised first.
    ///
    /// major^2 = (tr M + root)/2; minor = |det J|/major, since the textbook's (tr M - root)/2 loses all
    /// digits of a thin ellipse. The longer of two conjugate vectors is not the major axis (erratum E1 of
    /// seed 1).
    pub fn principal_axes(&self) -> PrincipalAxes {
        // Squares and products of f32 are exact in f64, and neither overflow nor vanish.
        let [a, b] = self.sanitized().semi_axes.map(|axis| axis.as_dvec2());
        let [xx, xy, yy] = [a.x * a.x + b.x * b.x, a.x * a.y + b.x * b.y, a.y * a.y + b.y * b.y];
        let difference = xx - yy;
        let root = (difference * difference + 4.0 * xy * xy).sqrt();
        let major = (0.5 * (xx + yy + root)).sqrt();
        if major == 0.0 {
            return PrincipalAxes { direction: DVec2::X, major: 0.0, minor: 0.0 };
        }
        // The column of M - minor^2 that has no difference in it.
        let column = if difference >= 0.0 {
            DVec2::new(0.5 * (difference + root), xy)
        } else {
            DVec2::new(xy, 0.5 * (root - difference))
        };
        let longest = column.abs().max_element();
        let direction = if longest > 0.0 { (column / longest).normalize() } else { DVec2::X };
        PrincipalAxes { direction, major, minor: (a.perp_dot(b).abs() / major).min(major) }
    }
}

impl PixelDerivatives {
    /// The derivatives of (u, v) by the screen coordinates (a, b), in pixels, from those of (a, b) by (u, v):
    /// `du` is (da/du, db/du), `dv` is (da/dv, db/dv). Seed 0, case B, which is right but for what it does
    /// not say:
    ///
    /// - the determinant is a difference of products. Those of `f32` are exact in `f64`, so it is rounded
    ///   once;
    /// - of a surface seen edge-on it vanishes. |det| is taken as at least [`SINGULAR`] |du| |dv| (a relative
    ///   test: the unit of length does not matter), and so that no component exceeds [`MAX_COMPONENT`]. The
    ///   directions stay right, and the result is continuous and finite.
    ///
    /// Zero if an argument is not finite, or if all are zero.
    pub fn from_screen(du: Vec2, dv: Vec2) -> Self {
        if !(du.is_finite() && dv.is_finite()) {
            return Self::default();
        }
        let [du, dv] = [du.as_dvec2(), dv.as_dvec2()];
        let determinant = du.x * dv.y - du.y * dv.x;
        // The transposed cofactors: columns d(u, v)/da and d(u, v)/db, times det.
        let [da, db] = [DVec2::new(dv.y, -du.y), DVec2::new(-dv.x, du.x)];
        let longest = da.abs().max_element().max(db.abs().max_element());
        let least = (SINGULAR * du.length() * dv.length()).max(longest / MAX_COMPONENT);
        if least == 0.0 {
            return Self::default();
        }
        let divisor = determinant.abs().max(least).copysign(determinant);
        Self { x: da / divisor, y: db / divisor }.bounded()
    }

    /// The derivatives of a splat's own (u, v), in sigma, by the pixel: those of SPEC section 4, exactly, at
    /// the offset `[dx, dy]` of the evaluation, for a pinhole and an orthographic camera (`lens` is `None`)
    /// or through a point of the lens.
    ///
    /// u = u* + a.n/g, so du/dx = (a.(dn/dx) g - a.n dg/dx)/g^2; without a lens n is the offset, and g = 1 +
    /// h.n.
    ///
    /// They are in the basis that set-up rotates the splat's axes into, T1' = c T1 + s T2, T2' = c T2 - s T1:
    /// for derivatives of the splat's own (u, v) = (c u' - s v', s u' + c v'), apply that matrix by
    /// [`Self::chain`]. (c, s) is (J01, J11) normalised, notes 3.4; [`crate::setup::project`] does not keep
    /// it. The derivatives of texture coordinates (s, t) follow by `chain` once more, with d(s, t)/d(u, v).
    /// Bounded, also on the horizon g = 0.
    pub fn of_splat(
        constants: &SplatConstants<f32>,
        offset: [f32; 2],
        lens: Option<&LensPoint<f32>>,
    ) -> Self {
        let vector = |pair: [f32; 2]| Vec2::from(pair).as_dvec2();
        let [d, h, b] = [offset, constants.h, constants.b].map(vector);
        let a = DVec2::new(0.0, f64::from(constants.a1));
        let p = lens.map_or(DVec2::ZERO, |lens| vector(lens.p));
        let slope = vector(constants.lens_slope);
        let m = d + p * f64::from(constants.defocus);
        let g = 1.0 - slope.dot(p) + h.dot(m);
        let bend = DVec2::new(slope.y, -slope.x);
        let n = m + bend * p.perp_dot(m);
        // d(p x m)/dx = -p1, d(p x m)/dy = p0.
        let [n_x, n_y] = [DVec2::X - bend * p.y, DVec2::Y + bend * p.x];
        let column = |n_i: DVec2, h_i: f64| [a, b].map(|c| (c.dot(n_i) - c.dot(n) / g * h_i) / g);
        Self { x: column(n_x, h.x).into(), y: column(n_y, h.y).into() }.bounded()
    }

    /// The same derivatives of other coordinates, by the chain rule: of (s, t), where the columns of `matrix`
    /// are (ds/du, dt/du) and (ds/dv, dt/dv). The last equations of seed 0. Bounded.
    pub fn chain(&self, matrix: DMat2) -> Self {
        Self { x: matrix * self.x, y: matrix * self.y }.bounded()
    }

    /// The ellipse whose conjugate semi-diameters are these derivatives of (s, t): pbrt's footprint, as far
    /// from the centre as the next pixel. Twice the size of [`Self::full_sides`].
    pub fn semi_axes(&self) -> Footprint {
        let Self { x, y } = self.bounded();
        Footprint::new(x.as_vec2(), y.as_vec2())
    }

    /// The parallelogram whose sides are these derivatives of (s, t): Ptex's footprint, one pixel wide.
    pub fn full_sides(&self) -> FullSides {
        let Self { x, y } = self.bounded();
        FullSides::new(x.as_vec2(), y.as_vec2())
    }

    /// The same with both columns bounded as [`Footprint::sanitized`] does.
    pub fn bounded(&self) -> Self {
        Self { x: bounded(self.x), y: bounded(self.y) }
    }
}

/// See [`Footprint::sanitized`].
pub(super) fn bounded(vector: DVec2) -> DVec2 {
    let longest = vector.abs().max_element();
    if vector.is_nan() {
        DVec2::ZERO
    } else if longest <= MAX_COMPONENT {
        vector
    } else if longest.is_infinite() {
        let direction = |x: f64| if x.is_infinite() { x.signum() } else { 0.0 };
        MAX_COMPONENT * DVec2::new(direction(vector.x), direction(vector.y))
    } else {
        let bound = DVec2::splat(MAX_COMPONENT);
        (vector / longest * MAX_COMPONENT).clamp(-bound, bound)
    }
}
