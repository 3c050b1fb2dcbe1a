//! The splat-centred constants of a splat: SPEC section 3, notes 3.4; they replace L86-106.

use super::bounds::{deep_reference, half_depth};
use super::number::floor;
use super::{CameraSplat, View};
use crate::evaluate::SplatConstants;
use glam::{DVec2, DVec3, Vec3Swizzles};

/// Below this ratio of (det J)^2 to the product of its rows' squares a splat is seen edge-on, and dropped.
const EDGE_ON: f64 = 1.0 / (1u128 << 80) as f64;

/// A reference point farther than this from pixel 0 (in pixels) does not fit the integer part of the offset.
const MAX_PIXEL: f64 = (1u64 << 30) as f64;

/// The (c, s) by which [`project`] rotates the basis of a splat that is not seen edge-on: (u', v') = (c u + s v, c v - s u).
pub fn rotation(splat: &CameraSplat, view: &View) -> [f64; 2] {
    let [u, v] = reference(splat, view).unwrap_or([0.0; 2]);
    let (_, rows) = jacobian(splat, splat.center + u * splat.axes[0] + v * splat.axes[1], view);
    let q = DVec2::new(rows[0].y, rows[1].y).length();
    [rows[0].y / q, rows[1].y / q]
}

/// The reference point's (u, v), if it is not the centre.
#[inline(always)]
fn reference(splat: &CameraSplat, view: &View) -> Option<[f64; 2]> {
    if view.orthographic {
        return None;
    }
    deep_reference(splat, view.radius, half_depth(splat, view.radius))
}

/// The screen coordinates of a point of a splat, and J, the Jacobian of the projection there; its rows are d(pixel)/du and
/// d(pixel)/dv.
#[inline(always)]
fn jacobian(splat: &CameraSplat, point: DVec3, view: &View) -> (DVec2, [DVec2; 2]) {
    let scale = view.pixel_scale;
    if view.orthographic {
        return (point.xy(), splat.axes.map(|t| t.xy() * scale));
    }
    let inverse = 1.0 / point.z;
    let screen = point.xy() * inverse;
    let scale = scale * inverse;
    (screen, splat.axes.map(|t| (t.xy() - screen * t.z) * scale))
}

/// The constants of a splat, exact to `f64`. `None` if it is seen edge-on.
///
/// [`SplatConstants::edge_on`] is left at 0; the margin of the candidates' box decides it.
#[inline(always)]
pub fn project(splat: &CameraSplat, view: &View) -> Option<SplatConstants<f64>> {
    let [t1, t2] = splat.axes;
    let scale = view.pixel_scale;
    let deep = reference(splat, view);
    let [u, v] = deep.unwrap_or([0.0; 2]);
    let point = splat.center + u * t1 + v * t2;

    let (screen, rows) = jacobian(splat, point, view);
    let determinant = rows[0].perp_dot(rows[1]);
    let has_area = determinant * determinant > EDGE_ON * rows[0].length_squared() * rows[1].length_squared();
    if !has_area {
        return None;
    }

    // Rotate the basis by the (c, s) that makes the new second row horizontal: J' = [[p, q], [m, 0]]. Then
    // u = dy / q depends on dy alone, and v = (dx - u p) / m. r2 does not change.
    let q = DVec2::new(rows[0].y, rows[1].y).length();
    let a1 = 1.0 / q;
    let [c, s] = [rows[0].y * a1, rows[1].y * a1];
    let rotate = |first: f64, second: f64| [c * first + s * second, c * second - s * first];
    let p = rotate(rows[0].x, rows[1].x)[0];
    // m is -det J / q.
    let inverse_m = -q / determinant;
    let b = [inverse_m, -p * a1 * inverse_m];
    let depth_slope = rotate(t1.z, t2.z);
    let h = if view.orthographic {
        [0.0; 2]
    } else {
        let inverse = 1.0 / point.z;
        [-b[0] * depth_slope[1] * inverse, -(a1 * depth_slope[0] + b[1] * depth_slope[1]) * inverse]
    };

    let pixel = screen * scale + view.principal_point;
    let fits = pixel.abs().max_element() < MAX_PIXEL;
    if !fits {
        return None;
    }
    let [xi, yi] = [floor(pixel.x + 0.5), floor(pixel.y + 0.5)];
    Some(SplatConstants {
        xi,
        yi,
        xf: pixel.x - f64::from(xi),
        yf: pixel.y - f64::from(yi),
        h,
        a1,
        b,
        reference: rotate(u, v),
        centred: deep.is_none(),
        depth: point.z,
        depth_slope,
        defocus: view.lens.map_or(0.0, |lens| 1.0 / point.z - 1.0 / lens.focus),
        lens_slope: view.lens.map_or([0.0; 2], |_| h.map(|h| h / point.z)),
        edge_on: 0.0,
    })
}
