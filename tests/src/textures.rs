//! What the tests of footprints, differentials, mappings and texture functions share.

use crate::random::Random;
use glam::{DVec2, DVec3};
use proptest::prelude::*;
use proptest::sample::select;

/// Numbers at which formulas break.
pub const REMARKABLE: [f32; 12] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::MAX,
    f32::MIN,
    f32::MIN_POSITIVE,
    1e-45,
    f32::EPSILON,
];

/// Any pattern of bits of an `f32`, the remarkable ones and ordinary numbers often.
pub fn any_f32() -> impl Strategy<Value = f32> + Clone {
    prop_oneof![
        any::<u32>().prop_map(f32::from_bits),
        select(REMARKABLE.to_vec()),
        -3.0..3.0f32,
        -0.5..0.5f32
    ]
}

/// Any pattern of bits of an `f32`, as `f64`.
pub fn any_f64() -> impl Strategy<Value = f64> + Clone {
    any_f32().prop_map(f64::from)
}

/// Three of them.
pub fn any_vector() -> impl Strategy<Value = DVec3> + Clone {
    (any_f64(), any_f64(), any_f64()).prop_map(DVec3::from)
}

/// A vector with each coordinate uniform in [-r, r).
pub fn vector(rng: &mut Random, r: f64) -> DVec3 {
    DVec3::new(rng.range(-r, r), rng.range(-r, r), rng.range(-r, r))
}

/// The derivative of `f` at 0, by Richardson's extrapolation of central differences of `step` and half of it:
/// its error is of the fourth order in `step`.
pub fn derivative(f: impl Fn(f64) -> DVec3, step: f64) -> DVec3 {
    let central = |h: f64| (f(h) - f(-h)) / (2.0 * h);
    (4.0 * central(0.5 * step) - central(step)) / 3.0
}

/// The same of a pair.
pub fn derivative_2d(f: impl Fn(f64) -> DVec2, step: f64) -> DVec2 {
    derivative(|h| f(h).extend(0.0), step).truncate()
}
