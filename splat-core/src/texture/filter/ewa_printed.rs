//! EWA as pbrt prints it (seed 1), for comparison, faults E1 to E10 included.
//!
//! In `f32`, its statements in their order; they say where they depart:
//! - the pyramid is ours: of any size (E13), and box-filtered from existing texels only (E11);
//! - hostile input (E10) is made harmless: the vectors' components lie within [`MAX_PERIODS`] and are 0 below 1e-18,
//!   whose squares `f32` does not have, and a lookup without weights becomes bilinear. That is enough for an end and
//!   a bound: the second vector has less than 2 texels at the chosen level, so the first has less than `2
//!   maxAnisotropy`, with which the determinant does not cancel (E3) for anisotropies up to
//!   [`MAX_ANISOTROPY`](super::MAX_ANISOTROPY).

use super::ellipse::MAX_PERIODS;
use super::isotropic::bilinear;
use super::mean::{Mean, WeightedSum};
use crate::texture::Footprint;
use crate::texture::pyramid::Pyramid;
use glam::{DVec2, Vec2};
use std::sync::LazyLock;

/// Number of entries of the weight table.
const WEIGHT_LUT_SIZE: usize = 128;

/// The printed weights: filled at i / 127, read at floor(128 r2), the last 0 (E4).
static WEIGHT_LUT: LazyLock<[f32; WEIGHT_LUT_SIZE]> = LazyLock::new(|| {
    std::array::from_fn(|i| {
        let alpha = 2.0;
        let r2 = i as f32 / (WEIGHT_LUT_SIZE - 1) as f32;
        libm::expf(-alpha * r2) - libm::expf(-alpha)
    })
});

/// `MIPMap::Lookup` without `doTrilinear`.
pub(super) fn lookup(pyramid: &Pyramid, place: DVec2, footprint: &Footprint, max_anisotropy: f32) -> Mean {
    let [mut d0, mut d1] = footprint.semi_axes.map(harmless);
    // Compute ellipse minor and major axes
    if d0.length_squared() < d1.length_squared() {
        (d0, d1) = (d1, d0);
    }
    let major_length = d0.length();
    let mut minor_length = d1.length();

    // Clamp ellipse eccentricity if too large
    if minor_length * max_anisotropy < major_length && minor_length > 0.0 {
        let scale = major_length / (minor_length * max_anisotropy);
        d1 *= scale;
        minor_length *= scale;
    }
    if minor_length == 0.0 {
        return bilinear(pyramid, 0, place);
    }

    // Choose level of detail for EWA lookup and perform EWA filtering
    let levels = pyramid.levels().len();
    let lod = (levels as f32 - 1.0 + libm::log2f(minor_length)).max(0.0);
    let ilod = lod.floor() as usize;
    let d = lod - lod.floor();
    let filter = |level| ewa(pyramid, level, place, d0, d1);
    filter(ilod).mix(filter(ilod + 1), f64::from(d))
}

/// `MIPMap::EWA`.
fn ewa(pyramid: &Pyramid, level: usize, place: DVec2, d0: Vec2, d1: Vec2) -> Mean {
    if level >= pyramid.levels().len() {
        return Mean { color: pyramid.texel(pyramid.last(), 0, 0).map(f64::from), texels: 1 };
    }
    // Convert EWA coordinates to appropriate scale for level
    let size = Vec2::from_array(pyramid.levels()[level].size().map(|count| count as f32));
    let Vec2 { x: s, y: t } = place.as_vec2() * size - 0.5;
    let (Vec2 { x: ds0, y: dt0 }, Vec2 { x: ds1, y: dt1 }) = (d0 * size, d1 * size);

    // Compute ellipse coefficients to bound EWA filter region
    let mut a = dt0 * dt0 + dt1 * dt1 + 1.0;
    let mut b = -2.0 * (ds0 * dt0 + ds1 * dt1);
    let mut c = ds0 * ds0 + ds1 * ds1 + 1.0;
    let inv_f = 1.0 / (a * c - b * b * 0.25);
    a *= inv_f;
    b *= inv_f;
    c *= inv_f;

    // Compute the ellipse's (s,t) bounding box in texture space
    let det = -b * b + 4.0 * a * c;
    let inv_det = 1.0 / det;
    let (u, v) = (2.0 * inv_det * (det * c).sqrt(), 2.0 * inv_det * (a * det).sqrt());
    let (s0, s1) = ((s - u).ceil() as i64, (s + u).floor() as i64);
    let (t0, t1) = ((t - v).ceil() as i64, (t + v).floor() as i64);

    // Scan over ellipse bound and compute quadratic equation
    let mut sum = WeightedSum::default();
    for it in t0..=t1 {
        let tt = it as f32 - t;
        for is in s0..=s1 {
            let ss = is as f32 - s;
            // Compute squared radius and filter texel if inside ellipse
            let r2 = a * ss * ss + b * ss * tt + c * tt * tt;
            if r2 < 1.0 {
                let weight = WEIGHT_LUT[((r2 * WEIGHT_LUT_SIZE as f32) as usize).min(WEIGHT_LUT_SIZE - 1)];
                sum.add_texel(pyramid.texel(level, is, it), f64::from(weight));
            }
        }
    }
    sum.mean().unwrap_or_else(|| bilinear(pyramid, level, place))
}

/// The guard against E10.
fn harmless(vector: Vec2) -> Vec2 {
    let most = MAX_PERIODS as f32;
    let component = |value: f32| if value.abs() >= 1e-18 { value.clamp(-most, most) } else { 0.0 };
    Vec2::new(component(vector.x), component(vector.y))
}
