//! The exact extents of a disc clipped at the near plane: notes 1.3, which replaces L106-134.

use super::CameraSplat;
use glam::DVec2;

/// The least and greatest value of something over a splat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Least value.
    pub min: f64,
    /// Greatest value.
    pub max: f64,
}

/// Half of the depth extent of a disc of the given radius: radius |t|, t = (T1.w, T2.w) (erratum E1).
#[inline(always)]
pub fn half_depth(splat: &CameraSplat, radius: f64) -> f64 {
    radius * DVec2::new(splat.axes[0].z, splat.axes[1].z).length()
}

/// The extent of x/w (axis 0) or y/w (axis 1) over the disc of `radius` (in sigma), as far as it lies at w >= near.
///
/// `None` if no part of it does. In tan units; exact to rounding. `near` must be greater than 0.
pub fn perspective_extent(splat: &CameraSplat, radius: f64, near: f64, axis: usize) -> Option<Extent> {
    let [t1, t2] = splat.axes;
    let center = splat.center;
    let slope = [t1.z, t2.z];
    let half_depth = half_depth(splat, radius);
    if center.z + half_depth < near {
        return None;
    }
    // Everything relative to the projection s of a reference point: the centre, or the deepest point where the
    // centre comes too near to the eye. s(u) - s = (a.u + c0) / (w0 + t.u).
    let reference = deep_reference(splat, radius, half_depth).unwrap_or([0.0; 2]);
    let depth = center.z + reference[0] * slope[0] + reference[1] * slope[1];
    let screen = (center[axis] + reference[0] * t1[axis] + reference[1] * t2[axis]) / depth;
    let a = [t1[axis] - screen * slope[0], t2[axis] - screen * slope[1]];
    let c0 = -(reference[0] * a[0] + reference[1] * a[1]);

    let mut extent = Extent { min: f64::INFINITY, max: f64::NEG_INFINITY };
    let mut include = |offset: f64| {
        extent.min = extent.min.min(screen + offset);
        extent.max = extent.max.max(screen + offset);
    };
    for root in tangents(radius, a, c0, slope, center.z) {
        // The line of constant offset touches the rim at u = -k k3 / |k|^2.
        let k = [a[0] - root * slope[0], a[1] - root * slope[1]];
        let k3 = c0 - root * center.z;
        let scale = -k3 / (k[0] * k[0] + k[1] * k[1]);
        if center.z + scale * (k[0] * slope[0] + k[1] * slope[1]) >= near {
            include(root);
        }
    }
    if center.z - half_depth < near {
        // The ends of the chord in which the near plane cuts the disc: t.u = near - w0, |u| = radius.
        let slope_squared = slope[0] * slope[0] + slope[1] * slope[1];
        let along = (near - center.z) / slope_squared;
        let across = (radius * radius / slope_squared - along * along).max(0.0).sqrt();
        for side in [-across, across] {
            let u = [along * slope[0] - side * slope[1], along * slope[1] + side * slope[0]];
            include((c0 + u[0] * a[0] + u[1] * a[1]) / near);
        }
    }
    (extent.min <= extent.max).then_some(extent)
}

/// The deepest point of the disc, in sigma, where its centre is nearer to the eye than a quarter of its half
/// depth; there the centre is no good reference point. SPEC section 3.
pub fn deep_reference(splat: &CameraSplat, radius: f64, half_depth: f64) -> Option<[f64; 2]> {
    let slope = DVec2::new(splat.axes[0].z, splat.axes[1].z);
    (splat.center.z < 0.25 * half_depth).then(|| (radius / slope.length() * slope).to_array())
}

/// The extent of x (axis 0) or y (axis 1) over the disc of `radius`, in camera units. (The near plane is left out:
/// it never makes an orthographic extent unbounded.)
pub fn orthographic_extent(splat: &CameraSplat, radius: f64, axis: usize) -> Extent {
    let half = radius * DVec2::new(splat.axes[0][axis], splat.axes[1][axis]).length();
    Extent { min: splat.center[axis] - half, max: splat.center[axis] + half }
}

/// The offsets of the two lines of constant offset that touch the rim: the roots of
/// (R^2 |t|^2 - w0^2) x^2 - 2 (R^2 a.t - c0 w0) x + (R^2 |a|^2 - c0^2) = 0, without cancellation.
/// A root may be infinite or NaN, which the caller's comparison drops.
fn tangents(radius: f64, a: [f64; 2], c0: f64, slope: [f64; 2], depth: f64) -> [f64; 2] {
    let dot = |p: [f64; 2], q: [f64; 2]| radius * radius * (p[0] * q[0] + p[1] * q[1]);
    let qa = dot(slope, slope) - depth * depth;
    let qb = dot(a, slope) - c0 * depth;
    let qc = dot(a, a) - c0 * c0;
    let q = qb + (qb * qb - qa * qc).max(0.0).sqrt().copysign(qb);
    [q / qa, qc / q]
}
