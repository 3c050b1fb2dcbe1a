//! How much larger than the splat its candidates' box must be, so that rounding cannot make a hit outside of it.

use super::bounds::Extent;
use super::error_bound::EPSILON;
use super::{CameraSplat, View};
use crate::evaluate::SplatConstants;

/// The margin that every splat gets, in sigma per sqrt(F): far more than the error of any ordinary splat.
pub const USUAL: f64 = 1.0 / 2048.0;

/// A pinhole splat whose position is less certain than this, in sigma, is seen edge-on as far as `f32` can tell,
/// and is dropped. Its minor axis is then below 2^-18 of its distance from the reference point's pixel.
const MAX_ERROR: f64 = 0.25;

/// The factor by which 1 - h.q and g must exceed their own errors for a lens point to count.
const LENS_CERTAINTY: f64 = 64.0;

/// What the candidates' box needs to know about a splat's rounding error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margin {
    /// Radius of the disc that the box must hold, in sigma.
    pub radius: f64,
    /// [`SplatConstants::edge_on`].
    pub edge_on: f64,
}

/// The margin of a splat, given its exact constants and the largest offset |d| (in pixels) in its box. `None` if
/// it must be dropped.
pub fn margin(
    splat: &CameraSplat,
    constants: &SplatConstants<f64>,
    depth: Extent,
    reach: [f64; 2],
    view: &View,
) -> Option<Margin> {
    let cutoff_radius = view.cutoff.sqrt();
    let usual = cutoff_radius * (1.0 + USUAL);
    let [h, b] = [constants.h.map(f64::abs), constants.b.map(f64::abs)];
    let a1 = constants.a1.abs();
    let g_min = if view.orthographic { 1.0 } else { constants.depth / depth.max };

    if let Some(lens) = view.lens {
        let p = [0, 1].map(|i| lens.radius * view.pixel_scale[i]);
        let e = [0, 1].map(|i| reach[i] + p[i] / lens.focus);
        let q = p.map(|p| p / constants.depth);
        let [he, hq] = [h[0] * e[0] + h[1] * e[1], h[0] * q[0] + h[1] * q[1]];
        // The errors of 1 - h.q and of A m, coarsely: see `thin_lens_error` for the terms.
        let side_error = 8.0 * EPSILON * (1.0 + hq + he);
        let m_error = [0, 1].map(|i| 8.0 * EPSILON * (e[i] + q[i] + 1.0) * (1.0 + he + hq));
        let position_error = a1 * m_error[1] + b[0] * m_error[0] + b[1] * m_error[1];
        // A hit has g = (1 - h.q) wr/w, so g (1 - h.q) = (1 - h.q)^2 wr/w = g^2 w/wr.
        let [side_limit, position_limit] = [side_error, position_error].map(|error| LENS_CERTAINTY * error);
        let by_side = side_limit * side_limit * g_min;
        let by_position = position_limit * position_limit * depth.min / constants.depth;
        let certain = hq < 0.5 && position_error < 0.5 * g_min * cutoff_radius * USUAL;
        return Some(Margin {
            radius: if certain { usual } else { cutoff_radius + MAX_ERROR },
            edge_on: by_side.max(by_position),
        });
    }

    // A coarse bound that settles all but a few; those are judged at their rim.
    let coarse =
        8.0 * EPSILON * (1.0 + reach[0].max(reach[1])) * (a1 + b[0] + b[1] + cutoff_radius * (h[0] + h[1]))
            / g_min.min(1.0);
    if coarse < 0.5 * cutoff_radius * USUAL {
        return Some(Margin { radius: usual, edge_on: 0.0 });
    }
    let error = rim_error(splat, constants, view);
    (error < MAX_ERROR).then_some(Margin { radius: usual + 2.0 * error, edge_on: 0.0 })
}

/// The largest error of (u, v), in sigma, at 16 points of the rim, as far as they lie in front of the near plane.
fn rim_error(splat: &CameraSplat, constants: &SplatConstants<f64>, view: &View) -> f64 {
    let radius = view.cutoff.sqrt();
    let points = (0..16).map(|i| {
        let angle = std::f64::consts::TAU * f64::from(i) / 16.0;
        [radius * libm::cos(angle), radius * libm::sin(angle)]
    });
    let mut largest: f64 = 0.0;
    for [u, v] in points {
        let mut point = splat.center + u * splat.axes[0] + v * splat.axes[1];
        if view.orthographic {
            let offset = view.project(point) - constants.pixel();
            let bound = constants.orthographic_error(offset.to_array(), view.max_jitter(), view.cutoff);
            largest = largest.max(bound.u + bound.v);
            continue;
        }
        if point.z < view.near {
            // Move along the chord to the centre, or give the point up where all of that chord is behind.
            let step = (view.near - point.z) / (splat.center.z - point.z);
            if !(0.0..=1.0).contains(&step) {
                continue;
            }
            point += step * (splat.center - point);
        }
        let offset = view.project(point) - constants.pixel();
        let bound = constants.pinhole_error(offset.to_array(), view.max_jitter());
        largest = largest.max(bound.u + bound.v);
    }
    largest
}
