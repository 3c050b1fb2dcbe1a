//! The evaluation of one sample against one splat: SPEC section 4, notes 3.4; it replaces L174-194.
//!
//! These few lines are the contract between the cores: + - * / and comparisons, in exactly this order, never a
//! fused multiply-add. In `f32` they make pictures, in `f64` they are the truth.

use crate::real::Real;
use glam::DVec2;

/// What the evaluation needs of a splat: the splat-centred constants of notes 3.4.
///
/// Lengths on the picture are in pixels, relative to the reference point's projection X0 = xi + xf, Y0 = yi + yf;
/// u and v are in units of sigma. The (u, v) basis is rotated so that u depends on dy alone (a0 = 0).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SplatConstants<R> {
    /// Integer part of X0, in pixels.
    pub xi: i32,
    /// Integer part of Y0, in pixels.
    pub yi: i32,
    /// Fraction of X0, in [-1/2, 1/2] pixel.
    pub xf: R,
    /// Fraction of Y0, in [-1/2, 1/2] pixel.
    pub yf: R,
    /// Slope of g, per pixel of x and of y; zero if orthographic.
    pub h: [R; 2],
    /// du/dy at the reference point, in sigma a pixel.
    pub a1: R,
    /// dv/dx and dv/dy at the reference point, in sigma a pixel.
    pub b: [R; 2],
    /// (u, v) of the reference point: (0, 0), or the deepest point of the splat.
    pub reference: [R; 2],
    /// Whether the reference point is the centre.
    pub centred: bool,
    /// Depth of the reference point, in camera units.
    pub depth: R,
    /// Depth per sigma of u and of v, in camera units.
    pub depth_slope: [R; 2],
    /// Lens only: 1/depth - 1/focus, per camera unit. A lens point times this is how far its ray meets the plane of
    /// depth `depth` from where the eye's does.
    pub defocus: R,
    /// Lens only: h / depth, the slope of 1 - side in the lens point, per pixel at depth 1.
    pub lens_slope: [R; 2],
    /// Lens only: a hit needs g times side above this. Nearer to zero the lens point all but lies in the splat's
    /// plane, and rounding would decide. See [`crate::setup`].
    pub edge_on: R,
}

/// Where a sample hits a splat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit<R> {
    /// First splat coordinate, in sigma.
    pub u: R,
    /// Second splat coordinate, in sigma.
    pub v: R,
    /// u^2 + v^2.
    pub r2: R,
    /// View depth w, in camera units.
    pub depth: R,
    /// Whether the lens point and the eye are on different sides of the splat's plane.
    pub flipped: bool,
}

/// Which hits count, besides the kernel's cutoff.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits<R> {
    /// F: the splat is u^2 + v^2 < cutoff.
    pub cutoff: R,
    /// Hits have depth > near.
    pub near: R,
    /// Hits have depth < far.
    pub far: R,
}

/// A point on the lens, as it enters the evaluation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LensPoint<R> {
    /// Lens radius times unit-disc point times pixel scale, x and y, in pixels at depth 1.
    pub p: [R; 2],
}

impl<R: Real> SplatConstants<R> {
    /// Offset of the sample at (x + jx, y + jy) from the reference point's projection, in pixels.
    #[inline(always)]
    pub fn offset(&self, x: i32, y: i32, jitter: [R; 2]) -> [R; 2] {
        [R::from_i32(x - self.xi) + (jitter[0] - self.xf), R::from_i32(y - self.yi) + (jitter[1] - self.yf)]
    }

    /// The hit of a pinhole's sample at offset `d`.
    #[inline(always)]
    pub fn pinhole(&self, d: [R; 2], limits: &Limits<R>) -> Option<Hit<R>> {
        let g = R::ONE + (self.h[0] * d[0] + self.h[1] * d[1]);
        let inside = g > R::ZERO;
        let nu = self.a1 * d[1];
        let nv = self.b[0] * d[0] + self.b[1] * d[1];
        self.hit(inside, nu, nv, g, self.depth, false, limits)
    }

    /// The hit of a thin lens's sample at offset `d`, seen through the point `lens`.
    ///
    /// Everything is said relative to m, where the ray meets the plane of the reference point's depth: it is as small
    /// as the splat however large the blur, so that only its own sum cancels.
    #[inline(always)]
    pub fn thin_lens(&self, d: [R; 2], lens: &LensPoint<R>, limits: &Limits<R>) -> Option<Hit<R>> {
        let p = lens.p;
        let m = [d[0] + p[0] * self.defocus, d[1] + p[1] * self.defocus];
        let side = R::ONE - (self.lens_slope[0] * p[0] + self.lens_slope[1] * p[1]);
        let g = side + (self.h[0] * m[0] + self.h[1] * m[1]);
        let inside = g * side > self.edge_on;
        // From there along the ray to the splat.
        let t = p[0] * m[1] - p[1] * m[0];
        let n = [m[0] + self.lens_slope[1] * t, m[1] - self.lens_slope[0] * t];
        let nu = self.a1 * n[1];
        let nv = self.b[0] * n[0] + self.b[1] * n[1];
        self.hit(inside, nu, nv, g, self.depth * side, side < R::ZERO, limits)
    }

    /// The hit of an orthographic camera's sample at offset `d`.
    #[inline(always)]
    pub fn orthographic(&self, d: [R; 2], limits: &Limits<R>) -> Option<Hit<R>> {
        let u = self.reference[0] + self.a1 * d[1];
        let v = self.reference[1] + (self.b[0] * d[0] + self.b[1] * d[1]);
        let r2 = u * u + v * v;
        let depth = self.depth + (self.depth_slope[0] * u + self.depth_slope[1] * v);
        let inside = r2 < limits.cutoff && depth > limits.near && depth < limits.far;
        inside.then_some(Hit { u, v, r2, depth, flipped: false })
    }

    /// The common end of the perspective forms: (u, v) = reference + (nu, nv)/g, w = scaled_depth/g.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "the seven quantities of one formula, inlined twice")]
    fn hit(
        &self,
        inside: bool,
        nu: R,
        nv: R,
        g: R,
        scaled_depth: R,
        flipped: bool,
        limits: &Limits<R>,
    ) -> Option<Hit<R>> {
        let inverse_g = g.recip();
        let u = self.reference[0] + nu * inverse_g;
        let v = self.reference[1] + nv * inverse_g;
        let r2 = u * u + v * v;
        let depth = scaled_depth * inverse_g;
        let inside = inside && r2 < limits.cutoff && depth > limits.near && depth < limits.far;
        inside.then_some(Hit { u, v, r2, depth, flipped })
    }
}

impl SplatConstants<f64> {
    /// Projection (X0, Y0) of the reference point, in pixels.
    pub fn pixel(&self) -> DVec2 {
        DVec2::new(f64::from(self.xi) + self.xf, f64::from(self.yi) + self.yf)
    }

    /// The same constants, each rounded once.
    pub fn to_f32(&self) -> SplatConstants<f32> {
        SplatConstants {
            xi: self.xi,
            yi: self.yi,
            xf: self.xf as f32,
            yf: self.yf as f32,
            h: self.h.map(|value| value as f32),
            a1: self.a1 as f32,
            b: self.b.map(|value| value as f32),
            reference: self.reference.map(|value| value as f32),
            centred: self.centred,
            depth: self.depth as f32,
            depth_slope: self.depth_slope.map(|value| value as f32),
            defocus: self.defocus as f32,
            lens_slope: self.lens_slope.map(|value| value as f32),
            edge_on: self.edge_on as f32,
        }
    }
}

impl SplatConstants<f32> {
    /// Whether every constant is finite.
    pub fn is_finite(&self) -> bool {
        let pairs = [self.h, self.b, self.reference, self.depth_slope, self.lens_slope];
        let values = [self.xf, self.yf, self.a1, self.depth, self.defocus, self.edge_on];
        // All of them nearly always: no use in stopping at the first.
        values.iter().chain(pairs.as_flattened()).fold(true, |finite, value| finite & value.is_finite())
    }
}

impl<R: Real> Limits<R> {
    /// Limits from exact values, each rounded once.
    pub fn new(cutoff: f64, near: f64, far: f64) -> Self {
        Self { cutoff: R::from_f64(cutoff), near: R::from_f64(near), far: R::from_f64(far) }
    }
}
