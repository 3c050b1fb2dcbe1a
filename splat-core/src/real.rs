//! The two precisions of the sample evaluation.

use std::ops::{Add, Mul, Sub};

/// `f32`, in which pictures are made, or `f64`, the truth to judge them by.
///
/// Only what the evaluation of SPEC section 4 needs: every operation is a single correctly rounded one, so that
/// the same bits come out on any machine and in any vector width.
pub trait Real: Copy + PartialOrd + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;

    /// The nearest value to `value`.
    fn from_f64(value: f64) -> Self;

    /// The nearest value to `value`.
    fn from_i32(value: i32) -> Self;

    /// 1/self, by a true division.
    fn recip(self) -> Self;
}

impl Real for f32 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;

    fn from_f64(value: f64) -> Self {
        value as Self
    }

    fn from_i32(value: i32) -> Self {
        value as Self
    }

    fn recip(self) -> Self {
        1.0 / self
    }
}

impl Real for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;

    fn from_f64(value: f64) -> Self {
        value
    }

    fn from_i32(value: i32) -> Self {
        Self::from(value)
    }

    fn recip(self) -> Self {
        1.0 / self
    }
}
