//! Interpolation: of one place, and of a row of them as Footprint Assembly has it.

use super::pyramid::LaneLevel;
use super::rows::{COUNTING, Place, Weight};
use crate::lanes::{Eight, LANES, Lanes};

/// Sums of bilinear lookups: in each vector two channels, four lanes of each, one for each of the four texels around.
#[derive(Clone, Copy)]
pub struct Bilinear<L> {
    pairs: [L; 2],
    /// How many texels were read.
    pub texels: u32,
}

/// The four texels' weights along x, as `[0] + [1] t`: two rows of two texels.
const ALONG_X: [Eight; 2] =
    [[1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0], [-1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0]];

/// The same along y.
const ALONG_Y: [Eight; 2] =
    [[1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0], [-1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0, 1.0]];

impl<L: Lanes> Bilinear<L> {
    #[inline(always)]
    pub fn new() -> Self {
        Self { pairs: [L::splat(0.0); 2], texels: 0 }
    }

    /// Adds the bilinear lookup at a place, times `weight`.
    #[inline(always)]
    pub fn add<const C: usize>(&mut self, level: &LaneLevel, place: Place, weight: f32) {
        let [x, y] = place.whole;
        let [tx, ty] = place.rest;
        let along_x = L::load(&ALONG_X[0]) + L::load(&ALONG_X[1]) * L::splat(tx);
        let along_y = L::load(&ALONG_Y[0]) + L::load(&ALONG_Y[1]) * L::splat(ty);
        let weights = along_x * along_y * L::splat(weight);
        let (planes, column) = (level.planes::<C>(), level.in_row(level.column(x)));
        let (Some(above), Some(below)) = (
            planes.texels::<2>(level.row(y) + column),
            planes.texels::<2>(level.row(y.saturating_add(1)) + column),
        ) else {
            return;
        };
        for pair in 0..C.div_ceil(2) {
            // The last of an odd number of channels stands twice.
            let (first, second) = (2 * pair, (2 * pair + 1).min(C - 1));
            let texels = L::load_pairs([above[first], below[first], above[second], below[second]]);
            self.pairs[pair] = self.pairs[pair] + weights * texels;
        }
        self.texels += 4;
    }

    /// The sums of `C` channels, and zeros.
    #[inline(always)]
    pub fn sums<const C: usize>(&self) -> [f32; 4] {
        let mut lanes = [[0.0; LANES]; 2];
        self.pairs[0].store_cell::<0>(&mut lanes[0]);
        self.pairs[1].store_cell::<0>(&mut lanes[1]);
        let mut sums = [0.0; 4];
        for channel in 0..C {
            let (lanes, start) = (&lanes[channel / 2], 4 * (channel % 2));
            sums[channel] = (lanes[start] + lanes[start + 1]) + (lanes[start + 2] + lanes[start + 3]);
        }
        sums
    }
}

/// A row of equally spaced probes around a place.
#[derive(Debug, Clone, Copy)]
pub struct ProbeRow {
    /// How many: at least one.
    pub count: u32,
    /// From one to the next, in texels of level 0.
    pub step: [f32; 2],
    /// Whether they have Gaussian weights; else the same.
    pub gaussian: bool,
}

/// A level that probes look at.
#[derive(Debug, Clone, Copy)]
pub struct ProbedLevel<'a> {
    pub level: &'a LaneLevel,
    /// The middle of the row.
    pub place: Place,
    /// The level's share.
    pub share: f32,
}

impl ProbeRow {
    /// A single probe.
    pub const ONE: Self = Self { count: 1, step: [0.0; 2], gaussian: false };

    /// The weighted mean of bilinear lookups at the probes' places, of levels whose shares sum to 1; and the number of
    /// texels.
    #[inline(always)]
    pub fn mean<L: Lanes, const C: usize>(&self, levels: &[ProbedLevel<'_>]) -> ([f32; 4], u32) {
        let mut sums = Bilinear::<L>::new();
        if self.count == 1 {
            for probed in levels {
                sums.add::<C>(probed.level, probed.place, probed.share);
            }
            return (sums.sums::<C>(), sums.texels);
        }
        let count = L::splat(self.count as f32);
        let polynomial = Weight::<L>::new();
        let mut total = L::splat(0.0);
        for first in (0..self.count).step_by(LANES) {
            let number = L::splat(first as f32) + L::load(&COUNTING);
            let steps = number - L::splat(0.5) * (count - L::splat(1.0));
            let x = L::splat(2.0) * steps / count;
            let weight = if self.gaussian { polynomial.at(x * x) } else { L::splat(1.0) };
            let weight = weight & number.less(count);
            total = total + weight;
            let probes = (self.count - first).min(LANES as u32) as usize;
            for probed in levels {
                probed.add_probes::<L, C>(
                    &mut sums,
                    steps,
                    weight * L::splat(probed.share),
                    self.step,
                    probes,
                );
            }
        }
        let [total, ..] = L::sums([total; 4]);
        let mut mean = sums.sums::<C>();
        for value in &mut mean[..C] {
            *value /= total;
        }
        (mean, sums.texels)
    }
}

impl ProbedLevel<'_> {
    /// Adds up to eight probes, `steps` from the middle.
    #[inline(always)]
    fn add_probes<L: Lanes, const C: usize>(
        &self,
        sums: &mut Bilinear<L>,
        steps: L,
        weight: L,
        step: [f32; 2],
        probes: usize,
    ) {
        let [scale_x, scale_y] = self.level.metric.scale;
        let x = L::splat(self.place.rest[0]) + steps * L::splat(step[0] * scale_x);
        let y = L::splat(self.place.rest[1]) + steps * L::splat(step[1] * scale_y);
        let (column, row) = (x.round_down(), y.round_down());
        let mut rests = [[0.0; LANES]; 2];
        (x - column).store_cell::<0>(&mut rests[0]);
        (y - row).store_cell::<0>(&mut rests[1]);
        let mut weights = [0.0; LANES];
        weight.store_cell::<0>(&mut weights);
        let (columns, rows) = (column.whole(), row.whole());
        let [x, y] = self.place.whole;
        for i in 0..probes {
            let place = Place {
                whole: [x.saturating_add(columns[i]), y.saturating_add(rows[i])],
                rest: [rests[0][i], rests[1][i]],
            };
            sums.add::<C>(self.level, place, weights[i]);
        }
    }
}

/// Catmull and Rom's cubic through the texels, rows first; each interpolation of four values is kept between the least
/// and the greatest of them.
#[inline(always)]
pub fn bicubic<const C: usize>(level: &LaneLevel, place: Place) -> [f32; 4] {
    let [x, y] = place.whole;
    let (planes, column) = (level.planes::<C>(), level.in_row(level.column(x.saturating_sub(1))));
    let mut values = [[0.0; 4]; C];
    for row in 0..4 {
        if let Some(texels) = planes.texels::<4>(level.row(y.saturating_add(row as i32 - 1)) + column) {
            for (values, texels) in values.iter_mut().zip(texels) {
                values[row] = catmull_rom(texels, place.rest[0]);
            }
        }
    }
    let mut color = [0.0; 4];
    for (color, values) in color.iter_mut().zip(&values) {
        *color = catmull_rom(values, place.rest[1]);
    }
    color
}

/// Between the second and the third of four values, t in [0, 1].
#[inline(always)]
fn catmull_rom(&[a, b, c, d]: &[f32; 4], t: f32) -> f32 {
    let sum = a * (((-0.5 * t + 1.0) * t - 0.5) * t)
        + b * ((1.5 * t - 2.5) * t * t + 1.0)
        + c * (((-1.5 * t + 2.0) * t + 0.5) * t)
        + d * ((0.5 * t - 0.5) * t * t);
    sum.clamp(a.min(b).min(c.min(d)), a.max(b).max(c.max(d)))
}
