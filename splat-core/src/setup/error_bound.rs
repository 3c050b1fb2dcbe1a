//! The a-priori bound of the sample evaluation's rounding error: notes 3.5 for the pinhole, derived here in the
//! same way for the lens and for the orthographic camera.
//!
//! Every operation of [`crate::evaluate`] is correctly rounded, so fl(a op b) = (a op b)(1 + d), |d| <= eps. The
//! bounds follow the evaluation line by line to first order; the factor [`SECOND_ORDER`] absorbs the rest. They
//! compare with the evaluation in exact arithmetic of the same jitter and lens point (both given in `f32`), and
//! leave out overflow, underflow, and the error of the `f64` set-up.

use crate::evaluate::{LensPoint, SplatConstants};

/// Half of the distance from 1 to the next `f32`: the relative error of one rounding.
pub const EPSILON: f64 = 1.0 / (1u64 << 24) as f64;

/// Room for the products of roundings that the first-order bounds leave out.
const SECOND_ORDER: f64 = 1.01;

/// How far `f32` may lie from exact arithmetic.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorBound {
    /// Of u, in sigma.
    pub u: f64,
    /// Of v, in sigma.
    pub v: f64,
    /// Of the depth, in camera units.
    pub depth: f64,
    /// Of r2 - F: `f32` and exact arithmetic may disagree about a hit only where |r2 - F| is at most this.
    pub membership: f64,
}

/// The error of an offset d = float(x - X) + (j - Xf) per axis: the integer part, if it is large, and the sum
/// round relative to |d|; the fraction and its subtraction from a jitter of at most `max_jitter` round relative
/// to 1/2 and to `max_jitter` + 1/2.
fn offset_error(d: [f64; 2], max_jitter: f64) -> [f64; 2] {
    d.map(|d| EPSILON * (2.0 * d.abs() + 2.0 * (max_jitter + 1.0)))
}

/// |a0 b0| + |a1 b1|.
fn dot_abs(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] * b[0]).abs() + (a[1] * b[1]).abs()
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

impl SplatConstants<f64> {
    /// The bound for a pinhole's sample at offset `d` (in pixels), its jitter at most `max_jitter` pixels.
    pub fn pinhole_error(&self, d: [f64; 2], max_jitter: f64) -> ErrorBound {
        let ed = offset_error(d, max_jitter);
        let g = 1.0 + dot(self.h, d);
        let g_error = dot_abs(self.h, ed) + 3.0 * EPSILON * dot_abs(self.h, d) + EPSILON * g.abs();
        let numerators = [self.a1 * d[1], dot(self.b, d)];
        let errors = [
            self.a1.abs() * ed[1] + 2.0 * EPSILON * numerators[0].abs(),
            dot_abs(self.b, ed) + 3.0 * EPSILON * dot_abs(self.b, d),
        ];
        self.quotient_error(numerators, errors, g, g_error, self.depth, EPSILON * self.depth.abs())
    }

    /// The bound for a thin lens's sample at offset `d` (in pixels), seen through the point `lens`.
    pub fn thin_lens_error(&self, d: [f64; 2], max_jitter: f64, lens: &LensPoint<f64>) -> ErrorBound {
        let (p, slope) = (lens.p, self.lens_slope);
        let ed = offset_error(d, max_jitter);
        // m = d + p k: p, k, the product; the sum.
        let shift = p.map(|p| p * self.defocus);
        let m = [0, 1].map(|i| d[i] + shift[i]);
        let em = [0, 1].map(|i| ed[i] + EPSILON * (3.0 * shift[i].abs() + m[i].abs()));
        // side = 1 - H.p: H, p, the products, their sum; the difference.
        let side = 1.0 - dot(slope, p);
        let side_error = EPSILON * (4.0 * dot_abs(slope, p) + side.abs());
        let g = side + dot(self.h, m);
        let g_error =
            side_error + dot_abs(self.h, em) + 3.0 * EPSILON * dot_abs(self.h, m) + EPSILON * g.abs();
        let [numerators, errors] = self.lens_numerators(m, em, p);
        let scaled_error = self.depth.abs() * (side_error + 2.0 * EPSILON * side.abs());
        self.quotient_error(numerators, errors, g, g_error, self.depth * side, scaled_error)
    }

    /// The numerators of (u, v) through the lens point `p`, and their errors, given m and its error.
    ///
    /// With n = m + (H1, -H0) t a numerator c.n is c.m + k t, where k = c0 H1 - c1 H0; and t = p0 m1 - p1 m0. So it
    /// is linear in m, its slopes c0 - k p1 and c1 + k p0. Where a splat is steep c and H are large, but all but
    /// parallel, and k is small.
    fn lens_numerators(&self, m: [f64; 2], em: [f64; 2], p: [f64; 2]) -> [[f64; 2]; 2] {
        let slope = self.lens_slope;
        let t = p[0] * m[1] - p[1] * m[0];
        // p and each product; the difference.
        let et = EPSILON * (2.0 * dot_abs(p, [m[1], m[0]]) + t.abs());
        let bend = [slope[1] * t, -slope[0] * t];
        let n = [0, 1].map(|i| m[i] + bend[i]);
        // H and the product; the sum.
        let en = [0, 1].map(|i| EPSILON * (2.0 * bend[i].abs() + n[i].abs()));
        let columns = [[0.0, self.a1], self.b];
        let errors = columns.map(|c| {
            let k = c[0] * slope[1] - c[1] * slope[0];
            let from_m = dot_abs([c[0] - k * p[1], c[1] + k * p[0]], em);
            from_m + k.abs() * et + dot_abs(c, en) + 3.0 * EPSILON * dot_abs(c, n)
        });
        [columns.map(|c| dot(c, n)), errors]
    }

    /// The bound for an orthographic camera's sample at offset `d` (in pixels).
    pub fn orthographic_error(&self, d: [f64; 2], max_jitter: f64, cutoff: f64) -> ErrorBound {
        let ed = offset_error(d, max_jitter);
        let position = [self.a1 * d[1], dot(self.b, d)];
        let eu = self.a1.abs() * ed[1] + 2.0 * EPSILON * position[0].abs();
        let ev = dot_abs(self.b, ed) + 3.0 * EPSILON * dot_abs(self.b, d);
        let rise = dot_abs(self.depth_slope, position);
        let depth = self.depth + dot(self.depth_slope, position);
        let depth_error =
            dot_abs(self.depth_slope, [eu, ev]) + EPSILON * (3.0 * rise + self.depth.abs() + depth.abs());
        self.bound(position, [eu, ev], depth_error, cutoff)
    }

    /// The common end of the perspective forms: (u, v) = reference + numerators / g and depth = scaled_depth / g.
    fn quotient_error(
        &self,
        numerators: [f64; 2],
        numerator_errors: [f64; 2],
        g: f64,
        g_error: f64,
        scaled_depth: f64,
        scaled_depth_error: f64,
    ) -> ErrorBound {
        let from_reference = numerators.map(|numerator| numerator / g);
        let position = [0, 1].map(|i| self.reference[i] + from_reference[i]);
        let errors = [0, 1].map(|i| {
            let quotient = (numerator_errors[i] + from_reference[i].abs() * g_error) / g.abs();
            // The reciprocal and the product; then the reference's own rounding and the sum.
            quotient
                + 2.0 * EPSILON * from_reference[i].abs()
                + if self.centred { 0.0 } else { EPSILON * (self.reference[i].abs() + position[i].abs()) }
        });
        let depth = scaled_depth / g;
        let depth_error =
            (scaled_depth_error + depth.abs() * g_error) / g.abs() + 2.0 * EPSILON * depth.abs();
        let r2 = dot(position, position);
        self.bound(position, errors, depth_error, r2)
    }

    /// Adds the second order, and the band in which membership is open: r2 = u u + v v takes three roundings.
    fn bound(&self, position: [f64; 2], errors: [f64; 2], depth_error: f64, r2: f64) -> ErrorBound {
        let [u, v] = errors.map(|error| SECOND_ORDER * error);
        let membership = 2.0 * (position[0].abs() * u + position[1].abs() * v)
            + u * u
            + v * v
            + 3.0 * EPSILON * r2.max(dot(position, position));
        ErrorBound { u, v, depth: SECOND_ORDER * depth_error, membership }
    }
}
