//! How much larger than the splat its candidates' box must be, so that rounding cannot make a hit outside of it.
//!
//! Both functions bound the error of (u, v) over all hits at once: the terms are those of
//! [`super::error_bound`], each at its largest.

use super::bounds::Extent;
use super::error_bound::EPSILON;
use super::number::greater;
use super::{Reach, View};
use crate::evaluate::SplatConstants;

/// The margin that every splat gets, in sigma per sqrt(F): far more than the error of any ordinary splat.
pub const USUAL: f64 = 1.0 / 2048.0;

/// The largest error of (u, v), in sigma, with which a splat is drawn.
pub const MAX_ERROR: f64 = 0.25;

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
#[inline(always)]
pub fn without_lens(
    constants: &SplatConstants<f64>,
    depth: Extent,
    reach: &Reach,
    view: &View,
) -> Option<Margin> {
    let radius = view.radius;
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
    (error < MAX_ERROR)
        .then_some(Margin { radius: radius + greater(2.0 * error - usual, usual), edge_on: 0.0 })
}

/// The margin of a splat seen through a lens.
///
/// A lens may reach through the splat's plane; a point of it that lies in the plane sees the splat edge-on, and near
/// that point rounding decides. So a hit must have g side above a threshold that keeps both factors well above their
/// errors. A hit at depth w has g = side wr/w, so g side is g^2 w/wr and side^2 wr/w.
///
/// `depth` and `reach` are those of a disc that holds every hit: of [`hit_radius`].
pub fn with_lens(
    constants: &SplatConstants<f64>,
    depth: Extent,
    reach: &Reach,
    lens_pixels: [f64; 2],
    view: &View,
) -> Margin {
    let radius = view.radius;
    let [h, slope] = [constants.h.map(f64::abs), constants.lens_slope.map(f64::abs)];
    let dot = |p: [f64; 2], q: [f64; 2]| p[0] * q[0] + p[1] * q[1];
    let [g_min, g_max] = [constants.depth / depth.max, constants.depth / depth.min];
    // What a pinhole sees at the offset d' a lens sees at d = d' + p (1/focus - 1/w), so m = d' + p (1/wr - 1/w).
    let blur = view.circle_of_confusion(depth) * view.pixel_scale;
    let inverse = 1.0 / constants.depth;
    let spread = (1.0 / depth.min - inverse).abs().max((1.0 / depth.max - inverse).abs());
    let m = [0, 1].map(|i| reach.of_splat[i] + lens_pixels[i] * spread);
    let em = [0, 1].map(|i| {
        let d = reach.of_splat[i] + blur[i];
        let shift = lens_pixels[i] * constants.defocus.abs();
        EPSILON * (2.0 * d + 2.0 * (view.max_jitter() + 1.0) + 3.0 * shift + m[i])
    });
    let hp = dot(slope, lens_pixels);
    let side_error = EPSILON * (4.0 * hp + (1.0 + hp));
    let g_error = side_error + dot(h, em) + EPSILON * (3.0 * dot(h, m) + g_max * (1.0 + hp));
    let numerators = lens_numerators(constants, m, em, lens_pixels);

    let least_g = (numerators / NUMERATOR_ERROR).max(g_error / DENOMINATOR_ERROR);
    let least_side = side_error / DENOMINATOR_ERROR;
    let edge_on = (least_g * least_g / g_min).max(least_side * least_side * g_max);
    // Where the lens keeps clear of the plane, g has a lower bound without that.
    let usual = USUAL * radius;
    let clear = (1.0 - hp) * g_min;
    let certain = clear > 0.0 && numerators + 2.0 * radius * g_error < 0.5 * usual * clear;
    Margin { radius: if certain { radius + usual } else { hit_radius(radius) }, edge_on }
}

/// The radius, in sigma, within which every hit of a splat of `radius` lies that a lens's rounding can make.
pub fn hit_radius(radius: f64) -> f64 {
    radius + MAX_ERROR
}

/// The largest errors of the numerators of u and of v, added, given the largest |m|, its error and the largest |p|.
fn lens_numerators(constants: &SplatConstants<f64>, m: [f64; 2], em: [f64; 2], p: [f64; 2]) -> f64 {
    let slope = constants.lens_slope;
    let t = p[0] * m[1] + p[1] * m[0];
    let bend = [slope[1].abs() * t, slope[0].abs() * t];
    // Three roundings of c.n and one of n's sum, all relative to n; two of the product.
    let en = [0, 1].map(|i| EPSILON * (4.0 * (m[i] + bend[i]) + 2.0 * bend[i]));
    let error = |c: [f64; 2]| {
        let k = (c[0] * slope[1] - c[1] * slope[0]).abs();
        let from_m = (c[0].abs() + k * p[1]) * em[0] + (c[1].abs() + k * p[0]) * em[1];
        from_m + 3.0 * EPSILON * k * t + c[0].abs() * en[0] + c[1].abs() * en[1]
    };
    error([0.0, constants.a1]) + error(constants.b)
}
