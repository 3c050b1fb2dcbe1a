//! How much larger than the splat its candidates' box must be, so that rounding cannot make a hit outside of it.
//!
//! Both functions bound the error of (u, v) over all hits at once: the terms are those of
//! [`super::error_bound`], each at its largest.

use super::bounds::Extent;
use super::error_bound::EPSILON;
use super::{Reach, View};
use crate::evaluate::SplatConstants;

/// The margin that every splat gets, in sigma per sqrt(F): far more than the error of any ordinary splat.
pub const USUAL: f64 = 1.0 / 2048.0;

/// The largest error of (u, v), in sigma, with which a splat is drawn.
const MAX_ERROR: f64 = 0.25;

/// The part of [`MAX_ERROR`] that the numerators of (u, v) may take; the rest is left to their denominator g.
const NUMERATOR_ERROR: f64 = 0.5 * MAX_ERROR;

/// The largest relative error of g: with |(u, v)| up to 2 it takes the other half of [`MAX_ERROR`].
const DENOMINATOR_ERROR: f64 = 1.0 / 16.0;

/// What the candidates' box needs to know about a splat's rounding error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margin {
    /// Radius of the disc that the box must hold, in sigma.
    pub radius: f64,
    /// [`SplatConstants::edge_on`].
    pub edge_on: f64,
}

/// The margin of a splat seen by a pinhole or orthographically. `None` if it is seen edge-on as far as `f32` can
/// tell: where the error of (u, v) reaches [`MAX_ERROR`].
pub fn without_lens(
    constants: &SplatConstants<f64>,
    depth: Extent,
    reach: &Reach,
    view: &View,
) -> Option<Margin> {
    let radius = view.cutoff.sqrt();
    let [h, b] = [constants.h.map(f64::abs), constants.b.map(f64::abs)];
    let a1 = constants.a1.abs();
    let d = reach.in_frame;
    let ed = d.map(|d| EPSILON * (2.0 * d + 2.0 * (view.max_jitter() + 1.0)));
    let [g_min, g_max] = if view.orthographic {
        [1.0, 1.0]
    } else {
        [constants.depth / depth.max, constants.depth / depth.min]
    };
    let dot = |p: [f64; 2], q: [f64; 2]| p[0] * q[0] + p[1] * q[1];
    let numerators = a1 * (ed[1] + 2.0 * EPSILON * d[1]) + dot(b, ed) + 3.0 * EPSILON * dot(b, d);
    let denominator = dot(h, ed) + EPSILON * (3.0 * dot(h, d) + g_max);
    let error = (numerators + 2.0 * radius * denominator) / g_min;
    let usual = USUAL * radius;
    (error < MAX_ERROR).then_some(Margin { radius: radius + usual.max(2.0 * error - usual), edge_on: 0.0 })
}

/// The margin of a splat seen through a lens.
///
/// A lens may reach through the splat's plane; a point of it that lies in the plane sees the splat edge-on, and near
/// that point rounding decides. So a hit must have g (1 - h.q) above a threshold that keeps both factors well above
/// their errors. A hit at depth w has g = (1 - h.q) wr/w, so g (1 - h.q) is g^2 w/wr and (1 - h.q)^2 wr/w.
pub fn with_lens(
    constants: &SplatConstants<f64>,
    depth: Extent,
    reach: &Reach,
    lens_pixels: [f64; 2],
    view: &View,
) -> Margin {
    let radius = view.cutoff.sqrt();
    let [h, b] = [constants.h.map(f64::abs), constants.b.map(f64::abs)];
    let dot = |p: [f64; 2], q: [f64; 2]| p[0] * q[0] + p[1] * q[1];
    let [g_min, g_max] = [constants.depth / depth.max, constants.depth / depth.min];
    let q = lens_pixels.map(|p| p / constants.depth);
    // A hit's e is d' - q wr/w, where d' is the offset at which a pinhole would see the same point of the splat.
    let e = [0, 1].map(|i| reach.of_splat[i] + q[i] * g_max);
    let d = [0, 1].map(|i| e[i] + reach.lens_over_focus[i]);
    let ee = [0, 1]
        .map(|i| EPSILON * (2.0 * d[i] + 2.0 * (view.max_jitter() + 1.0) + reach.lens_over_focus[i] + e[i]));
    let eq = q.map(|q| 3.0 * EPSILON * q);
    let [he, hq] = [dot(h, e), dot(h, q)];
    let he_error = dot(h, ee) + 3.0 * EPSILON * he;
    let hq_error = 6.0 * EPSILON * hq;
    let em = [0, 1].map(|i| {
        let inputs = ee[i] * (1.0 + hq) + eq[i] * (1.0 + he) + q[i] * he_error + e[i] * hq_error;
        inputs + EPSILON * (2.0 * (e[i] + q[i]) + 3.0 * (q[i] * he + e[i] * hq))
    });
    let numerators = constants.a1.abs() * em[1] + dot(b, em);
    let g_error = he_error + EPSILON * g_max * (1.0 + hq);
    let side_error = hq_error + EPSILON * (1.0 + hq);

    let least_g = (numerators / NUMERATOR_ERROR).max(g_error / DENOMINATOR_ERROR);
    let least_side = side_error / DENOMINATOR_ERROR;
    let edge_on = (least_g * least_g / g_min).max(least_side * least_side * g_max);
    // Where the lens keeps clear of the plane, g has a lower bound without that.
    let usual = USUAL * radius;
    let clear = (1.0 - hq) * g_min;
    let certain = clear > 0.0 && numerators + 2.0 * radius * g_error < 0.5 * usual * clear;
    Margin { radius: radius + if certain { usual } else { MAX_ERROR }, edge_on }
}
