//! Footprints, differentials and mappings as printed: seed 0 (the Ptex filter footprint), seed 3 (pbrt,
//! chapter 11), and what later versions of pbrt made of them, faults included. What the errata tests show to
//! be wrong.

use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// Seed 0, case B, in `f32` as a renderer would: the determinant of d(a, b)/d(u, v).
pub fn determinant_f32(du: [f32; 2], dv: [f32; 2]) -> f32 {
    du[0] * dv[1] - du[1] * dv[0]
}

/// The linear approximation of section 11.1.1, whose second term has df/dx again (erratum F1).
pub fn taylor(f: f64, dfdx: f64, _dfdy: f64, step: DVec2) -> f64 {
    f + step.x * dfdx + step.y * dfdx
}

/// Where a ray meets the plane n.p + d = 0, by the printed formula (erratum F2).
pub fn plane_distance(n: DVec3, d: f64, origin: DVec3, direction: DVec3) -> f64 {
    (-n.dot(origin) + d) / n.dot(direction)
}

/// The spherical mapping (section 11.2.2).
pub fn sphere(p: DVec3) -> DVec2 {
    let v = p.normalize();
    let phi = libm::atan2(v.y, v.x);
    DVec2::new(libm::acos(v.z.clamp(-1.0, 1.0)) / PI, if phi < 0.0 { phi + TAU } else { phi } / TAU)
}

/// The cylindrical mapping (section 11.2.3).
pub fn cylinder(p: DVec3) -> DVec2 {
    let v = p.normalize();
    DVec2::new((PI + libm::atan2(v.y, v.x)) / TAU, v.z)
}

/// The printed correction at the seam (errata F3 and F4).
pub fn correct_seam(quotient: f64) -> f64 {
    if quotient > 0.5 {
        1.0 - quotient
    } else if quotient < -0.5 {
        -(quotient + 1.0)
    } else {
        quotient
    }
}

/// d(s, t)/dx of the spherical mapping as printed, for any `delta` (printed: .1).
pub fn sphere_derivative(p: DVec3, dp: DVec3, delta: f64) -> DVec2 {
    let d = (sphere(p + delta * dp) - sphere(p)) / delta;
    DVec2::new(d.x, correct_seam(d.y))
}

/// `[ds/dx, dt/dx, ds/dy, dt/dy]` of the spherical mapping with every misprint of section 11.2.2: the second
/// call writes to sx and tx, so that sy and ty (0 here) are never set, and the last correction changes dt/dx
/// (erratum F3).
pub fn sphere_derivatives_with_misprints(p: DVec3, dpdx: DVec3, dpdy: DVec3) -> [f64; 4] {
    let delta = 0.1;
    let st = sphere(p);
    let [sy, ty] = [0.0, 0.0];
    let x = sphere(p + delta * dpdx);
    let dsdx = (x.x - st.x) / delta;
    let mut dtdx = correct_seam((x.y - st.y) / delta);
    let _sx_and_tx = sphere(p + delta * dpdy);
    let dsdy = (sy - st.x) / delta;
    let mut dtdy = (ty - st.y) / delta;
    if dtdy > 0.5 {
        dtdy = 1.0 - dtdy;
    } else if dtdy < -0.5 {
        dtdx = -(dtdy + 1.0);
    }
    [dsdx, dtdx, dsdy, dtdy]
}

/// d(s, t)/dx of the cylindrical mapping as in pbrt-v2 and v3, which corrects t (erratum F5); their delta is
/// .01.
pub fn cylinder_derivative(p: DVec3, dp: DVec3, delta: f64) -> DVec2 {
    let d = (cylinder(p + delta * dp) - cylinder(p)) / delta;
    DVec2::new(d.x, correct_seam(d.y))
}

/// d(s, t)/dx of the spherical mapping in pbrt-v4: (s, t) is (theta, phi), the derivatives are (dphi, dtheta)
/// (erratum F6).
pub fn sphere_derivative_v4(p: DVec3, dp: DVec3) -> DVec2 {
    let rho2 = p.x * p.x + p.y * p.y;
    let dphi = DVec3::new(-p.y, p.x, 0.0) / (TAU * rho2);
    let dtheta = DVec3::new(p.x * p.z, p.y * p.z, -rho2) / (PI * p.length_squared() * rho2.sqrt());
    DVec2::new(dphi.dot(dp), dtheta.dot(dp))
}

/// The 2x2 solver of pbrt, with its absolute test (erratum F8), and the fallback of v1 for x (erratum F9):
/// the whole texture.
pub fn solve(a: [[f64; 2]; 2], b: [f64; 2]) -> [f64; 2] {
    let det = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    if det.abs() < 1e-10 {
        return [1.0, 0.0];
    }
    [(a[1][1] * b[0] - a[0][1] * b[1]) / det, (a[0][0] * b[1] - a[1][0] * b[0]) / det]
}

/// dwi of a mirror as printed, with the normal and its derivative as they are given (erratum F10).
pub fn reflected_change(wo: DVec3, dwo: DVec3, n: DVec3, dn: DVec3) -> DVec3 {
    -dwo + 2.0 * (wo.dot(n) * dn + (dwo.dot(n) + wo.dot(dn)) * n)
}

/// dwi of refraction in pbrt-v4, whose `eta` is nt/ni (erratum F11): -eta dwo where -dwo/eta is right.
pub fn refracted_change_v4(wo: DVec3, dwo: DVec3, n: DVec3, dn: DVec3, eta: f64) -> DVec3 {
    let cosine = wo.dot(n);
    let beyond = (1.0 - (1.0 - cosine * cosine) / (eta * eta)).sqrt();
    let d = dwo.dot(n) + wo.dot(dn);
    let mu = cosine / eta - beyond;
    let dmu = (1.0 / eta + cosine / (eta * eta * -beyond)) * d;
    -eta * dwo + mu * dn + dmu * n
}
