//! What a vector of samples must be able to do, and the kinds of vectors there are.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod portable;
#[cfg(test)]
mod tests;

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

/// Number of samples of a cell: what a record holds, and what a vector of [`Lanes`] holds once or twice.
pub const LANES: usize = 8;

/// One value for each sample of a cell.
pub type Eight = [f32; LANES];

/// A vector of `f32`, one lane a sample, over one cell of eight samples or two.
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
    /// Number of cells that a vector spans: 1 or 2.
    const CELLS: usize;

    /// For each lane the number of an entry of a table of eight.
    type Index: Copy;

    /// Lanes over one cell, of the same instruction set.
    type Single: Lanes;

    /// The same value in every lane.
    fn splat(value: f32) -> Self;

    /// The first value in the lanes of the first cell, the second in those of the second, if there is one.
    fn splat_cells(first: f32, second: f32) -> Self;

    /// The lanes of the first cell, and of the second, if there is one.
    fn load_cells(first: &Eight, second: &Eight) -> Self;

    /// Writes the lanes of a cell, 0 or 1 (which there must be).
    fn store_cell<const CELL: usize>(self, to: &mut Eight);

    /// Lanes where self < other.
    fn less(self, other: Self) -> Self;

    /// Lanes where self <= other.
    fn less_or_equal(self, other: Self) -> Self;

    /// Lanes where not self < other: also where one of them is NaN.
    fn not_less(self, other: Self) -> Self;

    /// Lanes where not self <= other: also where one of them is NaN.
    fn not_less_or_equal(self, other: Self) -> Self;

    /// The lesser of two numbers; `other` where one of them is NaN.
    fn least(self, other: Self) -> Self;

    /// The greater of two numbers; `other` where one of them is NaN.
    fn greatest(self, other: Self) -> Self;

    /// Where `self`, a mask, is set the lane of `yes`, else that of `no`.
    fn select(self, yes: Self, no: Self) -> Self;

    /// Lanes of `self` where `mask` is not set, else 0.
    fn and_not(self, mask: Self) -> Self;

    /// Lanes of `self` where `mask` is set, else all ones, which is not a number.
    fn or_not(self, mask: Self) -> Self;

    /// A mask as bits, lane 0 the lowest.
    fn bits(self) -> u32;

    /// The mask of which lane i is set where bit i is.
    fn mask(bits: u32) -> Self;

    /// The square root.
    fn square_root(self) -> Self;

    /// The greatest integer that is not greater, of numbers whose magnitude is below 2^31; arbitrary for others.
    fn round_down(self) -> Self;

    /// The numbers of the entries of a table of eight for lanes in [0, 8); arbitrary ones for others.
    fn to_index(self) -> Self::Index;

    /// For each lane, an entry of `table`.
    fn look_up(table: &Eight, index: Self::Index) -> Self;

    /// Four pairs of neighbours, one after the other, in each cell.
    fn load_pairs(pairs: [&[f32; 2]; 4]) -> Self;

    /// Four values and another four, in each cell.
    fn load_halves(halves: [&[f32; 4]; 2]) -> Self;

    /// The lanes of the first cell of which a bit is set, one after the other, in each cell; what follows is arbitrary.
    fn pack(self, lanes: u8) -> Self;

    /// The lanes of the first cell without their fractions, for lanes whose magnitude is below 2^31; arbitrary for others.
    fn whole(self) -> [i32; LANES];

    /// For each of four vectors the sum of the first cell's lanes, `((0 + 1) + (2 + 3)) + ((4 + 5) + (6 + 7))`.
    fn sums(vectors: [Self; 4]) -> [f32; 4];

    /// The lanes of one cell, in every cell.
    #[inline(always)]
    fn load(values: &Eight) -> Self {
        Self::load_cells(values, values)
    }
}

/// For each byte the numbers of the bits that are set in it, the lowest first.
const SET_BITS: [[u8; LANES]; 256] = {
    let mut table = [[0; LANES]; 256];
    let mut byte = 0;
    while byte < 256 {
        let (mut count, mut bit) = (0, 0);
        while bit < LANES {
            if byte >> bit & 1 == 1 {
                table[byte][count] = bit as u8;
                count += 1;
            }
            bit += 1;
        }
        byte += 1;
    }
    table
};

/// A computation over lanes of any kind.
pub trait Kernel {
    /// What it gives.
    type Output;

    /// Runs it. Must be `#[inline(always)]`, as must be all that it calls on lanes, or that loses the instruction set of
    /// its caller.
    fn run<L: Lanes>(self) -> Self::Output;
}

/// The instruction set of the lanes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// `wide::f32x8`: whatever the program was compiled for.
    Portable,
    /// 256-bit registers of x86-64.
    Avx2,
    /// 512-bit registers of x86-64: two cells at once.
    Avx512,
}

impl Level {
    /// The environment variable that lowers the level: `portable`, `avx2` or `avx512`.
    pub const VARIABLE: &'static str = "SPLAT_LEVEL";

    /// Every level, the lowest first.
    const ALL: [Self; 3] = [Self::Portable, Self::Avx2, Self::Avx512];

    /// Every level that this machine has, the lowest first.
    pub fn available() -> Vec<Self> {
        Self::ALL.into_iter().filter(|level| level.is_available()).collect()
    }

    /// Whether this machine has the level.
    fn is_available(self) -> bool {
        match self {
            Self::Portable => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => avx2::is_available(),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => avx512::is_available(),
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }

    /// The highest level that this machine has, or the one that [`Level::VARIABLE`] names if that is lower.
    pub fn choose() -> Self {
        let wanted = std::env::var(Self::VARIABLE).ok();
        let limit = Self::ALL.into_iter().find(|level| wanted.as_deref() == Some(level.name()));
        let allowed = |level: &Self| limit.is_none_or(|limit| *level <= limit);
        Self::available().into_iter().filter(allowed).max().unwrap_or(Self::Portable)
    }

    /// The level's name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Portable => "portable",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        }
    }

    /// Runs a kernel on lanes of this level; on portable ones if the machine does not have it.
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => avx2::run(kernel),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => avx512::run(kernel),
            _ => kernel.run::<wide::f32x8>(),
        }
    }

    /// Runs a kernel on lanes of one cell.
    pub fn run_single<K: Kernel>(self, kernel: K) -> K::Output {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 | Self::Avx512 => avx2::run(kernel),
            _ => kernel.run::<wide::f32x8>(),
        }
    }
}

/// Asks the processor to fetch what it will soon need: all cache lines of an item.
#[inline(always)]
pub fn prefetch<T>(item: &T) {
    #[cfg(target_arch = "x86_64")]
    avx2::prefetch(item);
    #[cfg(not(target_arch = "x86_64"))]
    let _ = item;
}
