//! Lanes of `wide`: as good as the instruction set that the program was compiled for, on any machine.

use super::{Eight, LANES, Lanes, SET_BITS};
use wide::f32x8;

impl Lanes for f32x8 {
    const CELLS: usize = 1;
    type Index = [i32; LANES];
    type Single = Self;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self::splat(value)
    }

    #[inline(always)]
    fn splat_cells(first: f32, _: f32) -> Self {
        Self::splat(first)
    }

    #[inline(always)]
    fn load_cells(first: &Eight, _: &Eight) -> Self {
        Self::new(*first)
    }

    #[inline(always)]
    fn store_cell<const CELL: usize>(self, to: &mut Eight) {
        *to = self.to_array();
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
    fn not_less(self, other: Self) -> Self {
        !self.simd_lt(other)
    }

    #[inline(always)]
    fn not_less_or_equal(self, other: Self) -> Self {
        !self.simd_le(other)
    }

    #[inline(always)]
    fn least(self, other: Self) -> Self {
        // Written out: what `fast_min` does with NaN depends on the instruction set.
        self.simd_lt(other).bitselect(self, other)
    }

    #[inline(always)]
    fn greatest(self, other: Self) -> Self {
        self.simd_gt(other).bitselect(self, other)
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
    fn or_not(self, mask: Self) -> Self {
        mask.bitselect(self, Self::splat(f32::from_bits(u32::MAX)))
    }

    #[inline(always)]
    fn bits(self) -> u32 {
        self.to_bitmask()
    }

    #[inline(always)]
    fn mask(bits: u32) -> Self {
        let set = f32::from_bits(u32::MAX);
        Self::new(std::array::from_fn(|lane| if bits >> lane & 1 == 1 { set } else { 0.0 }))
    }

    #[inline(always)]
    fn square_root(self) -> Self {
        self.sqrt()
    }

    #[inline(always)]
    fn round_down(self) -> Self {
        // By way of integers: `floor` is a call for each lane where SSE4.1 is not a given.
        let truncated = Self::from_i32x8(self.fast_trunc_int());
        truncated - (truncated.simd_gt(self) & Self::splat(1.0))
    }

    #[inline(always)]
    fn to_index(self) -> [i32; LANES] {
        self.fast_trunc_int().to_array()
    }

    #[inline(always)]
    fn look_up(table: &Eight, index: [i32; LANES]) -> Self {
        // The remainder keeps what a lane without a hit holds within the table.
        Self::new(index.map(|index| table[index as usize % LANES]))
    }

    #[inline(always)]
    fn load_pairs([[a, b], [c, d], [e, f], [g, h]]: [&[f32; 2]; 4]) -> Self {
        Self::new([*a, *b, *c, *d, *e, *f, *g, *h])
    }

    #[inline(always)]
    fn load_halves([[a, b, c, d], [e, f, g, h]]: [&[f32; 4]; 2]) -> Self {
        Self::new([*a, *b, *c, *d, *e, *f, *g, *h])
    }

    #[inline(always)]
    fn pack(self, lanes: u8) -> Self {
        let values = self.to_array();
        Self::new(SET_BITS[usize::from(lanes)].map(|lane| values[usize::from(lane) % LANES]))
    }

    #[inline(always)]
    fn whole(self) -> [i32; LANES] {
        self.fast_trunc_int().to_array()
    }

    #[inline(always)]
    fn sums([a, b, c, d]: [Self; 4]) -> [f32; 4] {
        [sum(a), sum(b), sum(c), sum(d)]
    }
}

/// The sum of the lanes, in the order of [`Lanes::sums`].
#[inline(always)]
fn sum(vector: f32x8) -> f32 {
    let [a, b, c, d, e, f, g, h] = vector.to_array();
    ((a + b) + (c + d)) + ((e + f) + (g + h))
}
