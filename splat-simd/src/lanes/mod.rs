//! What a vector of samples must be able to do, and the kinds of vectors there are.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod portable;

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

/// Number of lanes of every vector.
pub const LANES: usize = 8;

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
    /// The same value in every lane.
    fn splat(value: f32) -> Self;

    /// The lanes of an array.
    fn load(values: &[f32; LANES]) -> Self;

    /// The lanes as an array.
    fn to_array(self) -> [f32; LANES];

    /// The mask of which lane i is set where bit i is.
    fn mask(bits: u32) -> Self;

    /// Lanes where self < other.
    fn less(self, other: Self) -> Self;

    /// Lanes where self <= other.
    fn less_or_equal(self, other: Self) -> Self;

    /// Lanes where self > other.
    fn greater(self, other: Self) -> Self;

    /// The lesser of two numbers; neither is NaN in a lane that counts.
    fn least(self, other: Self) -> Self;

    /// The greater of two numbers; neither is NaN in a lane that counts.
    fn greatest(self, other: Self) -> Self;

    /// Where `self`, a mask, is set the lane of `yes`, else that of `no`.
    fn select(self, yes: Self, no: Self) -> Self;

    /// Lanes of `self` where `mask` is not set, else 0.
    fn and_not(self, mask: Self) -> Self;

    /// A mask as bits, lane 0 the lowest.
    fn bits(self) -> u32;

    /// The integer part of numbers in [0, 8).
    fn truncate(self) -> Self;

    /// For each lane, the entry of `table` whose number is the lane's integer in [0, 8).
    fn look_up(self, table: &[f32; LANES]) -> Self;
}

/// A computation over lanes of any kind.
pub trait Kernel {
    /// What it gives.
    type Output;

    /// Runs it. Must be `#[inline(always)]`, or it loses the instruction set of its caller.
    fn run<L: Lanes>(self) -> Self::Output;
}

/// The instruction set of the lanes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// `wide::f32x8`: whatever the program was compiled for.
    Portable,
    /// 256-bit registers of x86-64.
    Avx2,
}

impl Level {
    /// The environment variable that lowers the level: `portable` or `avx2`.
    pub const VARIABLE: &'static str = "SPLAT_LEVEL";

    /// Every level that this machine has, the lowest first.
    pub fn available() -> Vec<Self> {
        let mut levels = vec![Self::Portable];
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            levels.push(Self::Avx2);
        }
        levels
    }

    /// The highest level that this machine has, or the one that [`Level::VARIABLE`] names if that is lower.
    pub fn choose() -> Self {
        let highest = Self::available().into_iter().max().unwrap_or(Self::Portable);
        match std::env::var(Self::VARIABLE).as_deref() {
            Ok("portable") => Self::Portable,
            Ok("avx2") => highest.min(Self::Avx2),
            _ => highest,
        }
    }

    /// The level's name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Portable => "portable",
            Self::Avx2 => "avx2",
        }
    }

    /// Runs a kernel on lanes of this level; on portable ones if the machine does not have it.
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => avx2::run(kernel),
            _ => kernel.run::<wide::f32x8>(),
        }
    }
}
