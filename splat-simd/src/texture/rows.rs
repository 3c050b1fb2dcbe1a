//! Weighted sums over the texels in an ellipse, row by row, eight texels at once.

use super::ellipse::RowKernels;
use super::pyramid::LaneLevel;
use crate::lanes::{Eight, LANES, Lanes};
use splat_core::texture::filter::WEIGHT_POLYNOMIAL;

/// The numbers of the lanes.
pub const COUNTING: Eight = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

/// The numbers of the lanes of each half.
const COUNTING_TWICE: Eight = [0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0];

/// For each two of eight rows the lanes' rows.
const PAIRS_OF_ROWS: [Eight; 4] = [
    [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0],
    [2.0, 2.0, 2.0, 2.0, 3.0, 3.0, 3.0, 3.0],
    [4.0, 4.0, 4.0, 4.0, 5.0, 5.0, 5.0, 5.0],
    [6.0, 6.0, 6.0, 6.0, 7.0, 7.0, 7.0, 7.0],
];

/// A place among the texels of a level, in whole texels and a rest in [0, 1); texel i has its centre at i.
#[derive(Debug, Clone, Copy, Default)]
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
}

/// One lookup's kernel.
#[derive(Debug, Clone, Copy, Default)]
pub struct RowKernel {
    slope: f32,
    width: f32,
    per_width: f32,
    inverse_yy: f32,
    place: Place,
    /// The first row and the last, from the whole part of the centre.
    rows: [i32; 2],
    /// How many columns the ellipse extends from there, at most.
    reach: i32,
}

/// Where eight rows meet the ellipse.
struct Middles<L> {
    /// The place where r2 is least.
    middle: L,
    /// r2 there.
    least: L,
}

/// What eight rows have to be summed.
struct Spans {
    /// The first texel, from the whole part of the centre.
    first: [i32; LANES],
    /// Vectors of eight texels.
    vectors: [i32; LANES],
    /// From the row's middle to the first texel, over half the length of the row through the centre.
    from_middle: Eight,
    least: Eight,
}

/// What a lookup has in every lane.
#[derive(Clone, Copy)]
struct Common<L> {
    polynomial: Weight<L>,
    /// The eight texels of a vector, over half the length of the row through the centre.
    counting: L,
    /// Eight texels.
    step: L,
}

impl RowKernel {
    /// One of eight kernels, around a place.
    #[inline(always)]
    pub fn new(kernels: &RowKernels, lane: usize, place: Place) -> Self {
        let [width, height] = [kernels.extent[0][lane], kernels.extent[1][lane]];
        let middle = place.rest[1];
        Self {
            slope: kernels.slope[lane],
            width: kernels.width[lane],
            per_width: kernels.per_width[lane],
            inverse_yy: kernels.inverse_yy[lane],
            place,
            rows: [(middle - height).ceil() as i32, (middle + height).floor() as i32],
            reach: width as i32 + 2,
        }
    }

    /// The weighted sums over the ellipse, and the number of vectors of eight texels that were read.
    #[inline(always)]
    pub fn sums<L: Lanes, const C: usize>(&self, level: &LaneLevel) -> (Sums<L, C>, u32) {
        let half = LANES as f32 / 2.0;
        // A row's ends are hard to predict, so short rows all read as many texels.
        if self.width < 0.5 * half {
            if let Some(start) = self.start::<1>(level) {
                return self.paired(level, start);
            }
        } else if self.width < half {
            if let Some(start) = self.start::<1>(level) {
                return self.narrow::<L, C, 1>(level, start);
            }
        } else if self.width < 2.0 * half
            && let Some(start) = self.start::<2>(level)
        {
            return self.narrow::<L, C, 2>(level, start);
        }
        self.wide(level)
    }

    #[inline(always)]
    fn common<L: Lanes>(&self) -> Common<L> {
        Common {
            polynomial: Weight::new(),
            counting: L::load(&COUNTING) * L::splat(self.per_width),
            step: L::splat(LANES as f32 * self.per_width),
        }
    }

    /// Of eight rows from `row` on.
    #[inline(always)]
    fn middles<L: Lanes>(&self, row: i32) -> Middles<L> {
        let dy = L::splat(row as f32 - self.place.rest[1]) + L::load(&COUNTING);
        Middles {
            middle: L::splat(self.place.rest[0]) + L::splat(self.slope) * dy,
            least: L::splat(self.inverse_yy) * (dy * dy),
        }
    }

    /// Where the centre's whole part stands among the level's texels, if no wrap is within reach of `V` vectors.
    #[inline(always)]
    fn start<const V: usize>(&self, level: &LaneLevel) -> Option<isize> {
        let margin = self.reach + (V * LANES) as i32;
        let [column, row] = self.place.whole;
        let columns = [column.saturating_sub(margin), column.saturating_add(margin)];
        // Pairs of rows may have one too many.
        let rows = [row.saturating_add(self.rows[0]), row.saturating_add(self.rows[1] + 1)];
        level.is_interior(columns, rows).then(|| level.offset(column, row))
    }

    /// Rows of less than four texels, no wrap within reach: each two rows are one vector, of the four texels around either's
    /// middle.
    #[inline(always)]
    fn paired<L: Lanes, const C: usize>(&self, level: &LaneLevel, start: isize) -> (Sums<L, C>, u32) {
        let polynomial = Weight::<L>::new();
        let counting = L::load(&COUNTING_TWICE) * L::splat(self.per_width);
        let [a, b, c, d] = &PAIRS_OF_ROWS;
        let pairs =
            [L::load(a).to_index(), L::load(b).to_index(), L::load(c).to_index(), L::load(d).to_index()];
        let planes = level.planes::<C>();
        let mut sums = Sums::new();
        let mut row = self.rows[0];
        let mut at = start + row as isize * level.stride();
        while row <= self.rows[1] {
            let Middles { middle, least } = self.middles::<L>(row);
            let first = (middle - L::splat(1.0)).round_down();
            let (mut from_middle, mut leasts) = ([0.0; LANES], [0.0; LANES]);
            ((first - middle) * L::splat(self.per_width)).store_cell::<0>(&mut from_middle);
            least.store_cell::<0>(&mut leasts);
            let first = first.whole();
            let rows = (self.rows[1] - row + 1).min(LANES as i32) as usize;
            for pair in 0..rows.div_ceil(2).min(LANES / 2) {
                let x = L::look_up(&from_middle, pairs[pair]) + counting;
                let least = L::look_up(&leasts, pairs[pair]);
                let above = planes.texels::<4>(at + first[2 * pair] as isize);
                let below = planes.texels::<4>(at + level.stride() + first[2 * pair + 1] as isize);
                let (Some(above), Some(below)) = (above, below) else { break };
                let weight = polynomial.at(least + x * x);
                sums.weight = sums.weight + weight;
                for channel in 0..C {
                    let texels = L::load_halves([above[channel], below[channel]]);
                    sums.colors[channel] = sums.colors[channel] + weight * texels;
                }
                at += 2 * level.stride();
            }
            row += LANES as i32;
        }
        let rows = self.rows[1] - self.rows[0] + 1;
        (sums, (rows.max(0) as u32).div_ceil(2))
    }

    /// Rows of less than `8 V` texels, no wrap within reach: each reads the `8 V` texels around its middle.
    #[inline(always)]
    fn narrow<L: Lanes, const C: usize, const V: usize>(
        &self,
        level: &LaneLevel,
        start: isize,
    ) -> (Sums<L, C>, u32) {
        let common = self.common::<L>();
        let planes = level.planes::<C>();
        let mut sums = Sums::new();
        let mut row = self.rows[0];
        let mut at = start + row as isize * level.stride();
        while row <= self.rows[1] {
            let Middles { middle, least } = self.middles::<L>(row);
            let first = (middle - L::splat((V * LANES) as f32 / 2.0 - 1.0)).round_down();
            let mut from_middle = [0.0; LANES];
            ((first - middle) * L::splat(self.per_width)).store_cell::<0>(&mut from_middle);
            let mut leasts = [0.0; LANES];
            least.store_cell::<0>(&mut leasts);
            let first = first.whole();
            let rows = (self.rows[1] - row + 1).min(LANES as i32) as usize;
            for i in 0..rows.min(LANES) {
                let (mut x, least) = (L::splat(from_middle[i]) + common.counting, L::splat(leasts[i]));
                for vector in 0..V {
                    let from = at + first[i] as isize + (vector * LANES) as isize;
                    let Some(texels) = planes.texels::<LANES>(from) else { break };
                    sums.add(common.polynomial.at(least + x * x), texels);
                    x = x + common.step;
                }
                at += level.stride();
            }
            row += LANES as i32;
        }
        let rows = self.rows[1] - self.rows[0] + 1;
        (sums, V as u32 * rows.max(0) as u32)
    }

    /// Rows of any length, wherever they are: each reads what it has in the ellipse.
    #[inline(always)]
    fn wide<L: Lanes, const C: usize>(&self, level: &LaneLevel) -> (Sums<L, C>, u32) {
        let common = self.common::<L>();
        let planes = level.planes::<C>();
        let mut sums = Sums::new();
        let mut total = 0;
        let [column, line] = self.place.whole;
        let mut row = self.rows[0];
        while row <= self.rows[1] {
            let spans = self.spans::<L>(row);
            let rows = (self.rows[1] - row + 1).min(LANES as i32) as usize;
            for i in 0..rows {
                let start = level.row(line.saturating_add(row + i as i32));
                let mut column = level.column(column.saturating_add(spans.first[i]));
                let (mut x, least) =
                    (L::splat(spans.from_middle[i]) + common.counting, L::splat(spans.least[i]));
                for _ in 0..spans.vectors[i] {
                    let Some(texels) = planes.texels::<LANES>(start + level.in_row(column)) else { break };
                    sums.add(common.polynomial.at(least + x * x), texels);
                    x = x + common.step;
                    column = level.advance(column);
                }
                total += spans.vectors[i] as u32;
            }
            row += LANES as i32;
        }
        (sums, total)
    }

    /// The spans of eight rows from `row` on: exact but for rounding, which matters nowhere: at the rim the weight is 0.
    #[inline(always)]
    fn spans<L: Lanes>(&self, row: i32) -> Spans {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let Middles { middle, least } = self.middles::<L>(row);
        let half = (one - least).greatest(zero).square_root() * L::splat(self.width);
        let first = zero - (half - middle).round_down();
        let steps = (middle + half - first) * L::splat(1.0 / LANES as f32);
        let mut spans = Spans {
            first: first.whole(),
            vectors: (steps.round_down() + one).whole(),
            from_middle: [0.0; LANES],
            least: [0.0; LANES],
        };
        ((first - middle) * L::splat(self.per_width)).store_cell::<0>(&mut spans.from_middle);
        least.store_cell::<0>(&mut spans.least);
        spans
    }
}

impl<L: Lanes, const C: usize> Sums<L, C> {
    #[inline(always)]
    pub fn new() -> Self {
        Self { colors: [L::splat(0.0); C], weight: L::splat(0.0) }
    }

    /// Adds eight texels with their weights.
    #[inline(always)]
    fn add(&mut self, weight: L, texels: [&Eight; C]) {
        self.weight = self.weight + weight;
        for (color, texels) in self.colors.iter_mut().zip(texels) {
            *color = *color + weight * L::load(texels);
        }
    }
}
