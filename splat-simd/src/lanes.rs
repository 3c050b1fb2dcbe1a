//! What a vector of samples must be able to do.

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};
use wide::f32x8;

/// A vector of `f32`, one lane a sample.
///
/// Every operation rounds each lane as the scalar one does, so a kernel over lanes gives the scalar kernel's bits.
/// Comparisons give a mask: a vector whose lanes are all ones or all zeros, for `&` and `|`.
pub trait Lanes:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
{
    /// Number of lanes.
    const COUNT: usize;

    /// The same value in every lane.
    fn splat(value: f32) -> Self;

    /// Lanes where self < other.
    fn less(self, other: Self) -> Self;

    /// Lanes where self > other.
    fn greater(self, other: Self) -> Self;

    /// A mask as bits, lane 0 the lowest.
    fn bits(self) -> u32;
}

impl Lanes for f32x8 {
    const COUNT: usize = 8;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self::splat(value)
    }

    #[inline(always)]
    fn less(self, other: Self) -> Self {
        self.simd_lt(other)
    }

    #[inline(always)]
    fn greater(self, other: Self) -> Self {
        self.simd_gt(other)
    }

    #[inline(always)]
    fn bits(self) -> u32 {
        self.to_bitmask()
    }
}
