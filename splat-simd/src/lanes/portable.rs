//! Lanes of `wide`: as good as the instruction set that the program was compiled for, on any machine.

use super::{LANES, Lanes};
use wide::f32x8;

impl Lanes for f32x8 {
    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self::splat(value)
    }

    #[inline(always)]
    fn load(values: &[f32; LANES]) -> Self {
        Self::new(*values)
    }

    #[inline(always)]
    fn to_array(self) -> [f32; LANES] {
        self.to_array()
    }

    #[inline(always)]
    fn mask(bits: u32) -> Self {
        let set = f32::from_bits(u32::MAX);
        Self::new(std::array::from_fn(|lane| if bits >> lane & 1 == 1 { set } else { 0.0 }))
    }

    #[inline(always)]
    fn less(self, other: Self) -> Self {
        self.simd_lt(other)
    }

    #[inline(always)]
    fn less_or_equal(self, other: Self) -> Self {
        self.simd_le(other)
    }

    #[inline(always)]
    fn greater(self, other: Self) -> Self {
        self.simd_gt(other)
    }

    #[inline(always)]
    fn least(self, other: Self) -> Self {
        self.fast_min(other)
    }

    #[inline(always)]
    fn greatest(self, other: Self) -> Self {
        self.fast_max(other)
    }

    #[inline(always)]
    fn select(self, yes: Self, no: Self) -> Self {
        self.bitselect(yes, no)
    }

    #[inline(always)]
    fn and_not(self, mask: Self) -> Self {
        mask.bitselect(Self::splat(0.0), self)
    }

    #[inline(always)]
    fn bits(self) -> u32 {
        self.to_bitmask()
    }

    #[inline(always)]
    fn truncate(self) -> Self {
        self.trunc()
    }

    #[inline(always)]
    fn look_up(self, table: &[f32; LANES]) -> Self {
        // The mask keeps what a lane without a hit holds within the table.
        Self::new(self.to_array().map(|index| table[index as usize % LANES]))
    }
}
