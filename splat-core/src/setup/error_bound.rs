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
        self.quotient_error(d, ed, g, g_error, self.depth, EPSILON * self.depth.abs())
    }

    /// The bound for a thin lens's sample at offset `d` (in pixels), seen through the point `lens`.
    pub fn thin_lens_error(&self, d: [f64; 2], max_jitter: f64, lens: &LensPoint<f64>) -> ErrorBound {
        let ed = offset_error(d, max_jitter);
        // e = d - p/focus, the quotient rounded once in the sample table.
        let e = [0, 1].map(|i| d[i] - lens.p_over_focus[i]);
        let ee = [0, 1].map(|i| ed[i] + EPSILON * (lens.p_over_focus[i].abs() + e[i].abs()));
        // q = p * (1/depth): p, the reciprocal, the product.
        let q = lens.p.map(|p| p * self.inverse_depth);
        let eq = q.map(|q| 3.0 * EPSILON * q.abs());
        let he = dot(self.h, e);
        let he_error = dot_abs(self.h, ee) + 3.0 * EPSILON * dot_abs(self.h, e);
        let hq = dot(self.h, q);
        let hq_error = dot_abs(self.h, eq) + 3.0 * EPSILON * dot_abs(self.h, q);
        let g = 1.0 + he;
        let g_error = he_error + EPSILON * g.abs();
        let side = 1.0 - hq;
        let side_error = hq_error + EPSILON * side.abs();
        // m = (e + q) + (q he - e hq): two products, their difference, the inner sum, the outer sum.
        let m = [0, 1].map(|i| (e[i] + q[i]) + (q[i] * he - e[i] * hq));
        let em = [0, 1].map(|i| {
            let inputs = ee[i]
                + eq[i]
                + eq[i] * he.abs()
                + q[i].abs() * he_error
                + ee[i] * hq.abs()
                + e[i].abs() * hq_error;
            let products = (q[i] * he).abs() + (e[i] * hq).abs();
            inputs + EPSILON * ((e[i] + q[i]).abs() + 2.0 * products + m[i].abs())
        });
        let scaled_error = self.depth.abs() * (side_error + 2.0 * EPSILON * side.abs());
        self.quotient_error(m, em, g, g_error, self.depth * side, scaled_error)
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

    /// The common end of the perspective forms: (u, v) = reference + A m / g and depth = scaled_depth / g.
    fn quotient_error(
        &self,
        m: [f64; 2],
        em: [f64; 2],
        g: f64,
        g_error: f64,
        scaled_depth: f64,
        scaled_depth_error: f64,
    ) -> ErrorBound {
        let numerators = [self.a1 * m[1], dot(self.b, m)];
        let numerator_errors = [
            self.a1.abs() * em[1] + 2.0 * EPSILON * numerators[0].abs(),
            dot_abs(self.b, em) + 3.0 * EPSILON * dot_abs(self.b, m),
        ];
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

    /// Adds the second order, and the band in which membership is open: r2 = u u + v v takes three roundings, and
    /// the division-free test rounds F g^2 twice and nu^2 + nv^2 twice.
    fn bound(&self, position: [f64; 2], errors: [f64; 2], depth_error: f64, r2: f64) -> ErrorBound {
        let [u, v] = errors.map(|error| SECOND_ORDER * error);
        let membership = 2.0 * (position[0].abs() * u + position[1].abs() * v)
            + u * u
            + v * v
            + 5.0 * EPSILON * r2.max(dot(position, position));
        ErrorBound { u, v, depth: SECOND_ORDER * depth_error, membership }
    }
}
