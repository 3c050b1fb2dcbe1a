//! Weighted sums over the texels in an ellipse, row by row, eight texels at once.

use super::ellipse::RowKernels;
use super::pyramid::LaneLevel;
use crate::lanes::{Eight, LANES, Lanes};
use splat_core::texture::filter::WEIGHT_POLYNOMIAL;

/// The numbers of the lanes.
pub const COUNTING: Eight = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

/// A place among the texels of a level, in whole texels and a rest in [0, 1); texel i has its centre at i.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    pub whole: [i32; 2],
    pub rest: [f32; 2],
}

/// The kernel's polynomial, each coefficient in every lane.
#[derive(Clone, Copy)]
pub struct Weight<L>([L; 6]);

impl<L: Lanes> Weight<L> {
    #[inline(always)]
    pub fn new() -> Self {
        let [a, b, c, d, e, f] = WEIGHT_POLYNOMIAL;
        Self([
            L::splat(a as f32),
            L::splat(b as f32),
            L::splat(c as f32),
            L::splat(d as f32),
            L::splat(e as f32),
            L::splat(f as f32),
        ])
    }

    /// The weight at squared radius `r2`, which may be any: the polynomial is negative beyond 1, so the weight is 0
    /// there without a test.
    #[inline(always)]
    pub fn at(&self, r2: L) -> L {
        let [a, b, c, d, e, f] = self.0;
        (((((f * r2 + e) * r2 + d) * r2 + c) * r2 + b) * r2 + a).greatest(L::splat(0.0))
    }
}

/// Weighted sums of texels, each over eight lanes.
#[derive(Clone, Copy)]
pub struct Sums<L, const C: usize> {
    pub colors: [L; C],
    pub weight: L,
    /// How many vectors of eight texels were read.
    pub vectors: u32,
}

/// What eight rows have in the ellipse.
struct Spans {
    /// The first texel, from the whole part of the centre.
    first: [i32; LANES],
    /// Vectors of eight texels: at least one.
    vectors: [i32; LANES],
    /// From the row's middle to the first texel, over half the length of the row through the centre.
    from_middle: Eight,
    /// The least r2 in the row.
    least: Eight,
}

/// One lookup's kernel.
#[derive(Debug, Clone, Copy)]
pub struct RowKernel {
    slope: f32,
    width: f32,
    per_width: f32,
    inverse_yy: f32,
    extent: f32,
    place: Place,
}

impl RowKernel {
    /// One of eight kernels, around a place.
    #[inline(always)]
    pub fn new(kernels: &RowKernels, lane: usize, place: Place) -> Self {
        Self {
            slope: kernels.slope[lane],
            width: kernels.width[lane],
            per_width: kernels.per_width[lane],
            inverse_yy: kernels.inverse_yy[lane],
            extent: kernels.extent[lane],
            place,
        }
    }

    /// The spans of eight rows from `row` on, counted from the whole part of the centre.
    ///
    /// Exact but for rounding, which matters nowhere: at the rim the weight is 0.
    #[inline(always)]
    fn spans<L: Lanes>(&self, row: i32) -> Spans {
        let zero = L::splat(0.0);
        let dy = L::splat(row as f32 - self.place.rest[1]) + L::load(&COUNTING);
        let middle = L::splat(self.place.rest[0]) + L::splat(self.slope) * dy;
        let least = L::splat(self.inverse_yy) * (dy * dy);
        let half = (L::splat(1.0) - least).greatest(zero).square_root() * L::splat(self.width);
        let first = zero - (zero - (middle - half)).round_down();
        let steps = (middle + half - first) * L::splat(1.0 / LANES as f32);
        let mut spans = Spans {
            first: first.whole(),
            vectors: (steps.round_down() + L::splat(1.0)).greatest(L::splat(1.0)).whole(),
            from_middle: [0.0; LANES],
            least: [0.0; LANES],
        };
        ((first - middle) * L::splat(self.per_width)).store_cell::<0>(&mut spans.from_middle);
        least.store_cell::<0>(&mut spans.least);
        spans
    }

    /// The sums over the ellipse, rows and vectors in order.
    #[inline(always)]
    pub fn sums<L: Lanes, const C: usize>(&self, level: &LaneLevel) -> Sums<L, C> {
        let polynomial = Weight::<L>::new();
        let counting = L::load(&COUNTING) * L::splat(self.per_width);
        let step = L::splat(LANES as f32 * self.per_width);
        let mut sums = Sums { colors: [L::splat(0.0); C], weight: L::splat(0.0), vectors: 0 };
        let [column, line] = self.place.whole;
        let mut row = (self.place.rest[1] - self.extent).ceil() as i32;
        let last = (self.place.rest[1] + self.extent).floor() as i32;
        while row <= last {
            let spans = self.spans::<L>(row);
            let rows = (last - row + 1).min(LANES as i32) as usize;
            for i in 0..rows {
                let texels = level.row::<C>(line + row + i as i32);
                let mut place = texels.start(column + spans.first[i]);
                let mut x = L::splat(spans.from_middle[i]) + counting;
                let least = L::splat(spans.least[i]);
                for _ in 0..spans.vectors[i] {
                    let weight = polynomial.at(least + x * x);
                    sums.weight = sums.weight + weight;
                    for channel in 0..C {
                        let values = L::load(texels.texels(place, channel));
                        sums.colors[channel] = sums.colors[channel] + weight * values;
                    }
                    x = x + step;
                    place = texels.advance(place);
                }
                sums.vectors += spans.vectors[i] as u32;
            }
            row += LANES as i32;
        }
        sums
    }
}
