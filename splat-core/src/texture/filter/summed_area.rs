//! Summed-area tables (Crow 1984): the mean of any upright rectangle in constant time.

use super::assembly::{ProbeRow, Probes};
use super::ellipse::{Ellipse, MAX_PERIODS, place};
use super::mean::{Average, Mean};
use crate::texture::Footprint;
use crate::texture::pyramid::{Pyramid, Wrap};
use glam::{DVec2, Vec2};

/// The integral of a texture from its corner to each texel's: in `f64`, since the sums of a large texture leave an
/// `f32` few digits for a difference (4 x 4 texels of 1024 x 1024: 5e-3).
#[derive(Debug, Clone, PartialEq)]
pub struct SummedArea {
    size: [u32; 2],
    channels: usize,
    wrap: [Wrap; 2],
    /// (width + 1) x (height + 1) entries, channels interleaved.
    sums: Vec<f64>,
    /// Least and greatest value of each channel, 0 included where black surrounds the texture.
    range: [[f64; 2]; 4],
}

impl SummedArea {
    /// The table of the pyramid's finest level, with its wraps.
    pub fn new(pyramid: &Pyramid) -> Self {
        let size = pyramid.levels()[0].size();
        let channels = pyramid.channels();
        let stride = (size[0] as usize + 1) * channels;
        let mut sums = vec![0.0; stride * (size[1] as usize + 1)];
        let black = pyramid.wrap().contains(&Wrap::Black);
        let mut range = [if black { [0.0; 2] } else { [f64::INFINITY, f64::NEG_INFINITY] }; 4];
        for y in 0..size[1] as usize {
            let mut row = [0.0; 4];
            for x in 0..size[0] as usize {
                let texel = pyramid.texel(0, x as i64, y as i64).map(f64::from);
                let entry = (y + 1) * stride + (x + 1) * channels;
                for channel in 0..channels {
                    row[channel] += texel[channel];
                    sums[entry + channel] = sums[entry - stride + channel] + row[channel];
                    let [least, greatest] = range[channel];
                    range[channel] = [least.min(texel[channel]), greatest.max(texel[channel])];
                }
            }
        }
        Self { size, channels, wrap: pyramid.wrap(), sums, range }
    }

    /// The mean over an upright rectangle with any corners, texels being squares of one colour. Position and sides in
    /// units of (s, t); a side is at least a texel and at most
    /// `2 MAX_PERIODS` (not a number: a texel).
    pub fn rectangle(&self, center: Vec2, sides: Vec2) -> Average {
        let texels = |side: f32, count: u32| {
            let side = if side.is_nan() { 0.0 } else { f64::from(side).clamp(0.0, 2.0 * MAX_PERIODS) };
            side * f64::from(count)
        };
        let sides = DVec2::new(texels(sides.x, self.size[0]), texels(sides.y, self.size[1]));
        self.mean(place(self.wrap, center), sides).rounded()
    }

    /// Footprint Assembly (seed 2) of squares from the table, along the footprint's longer axis. The squares stay
    /// upright, so their error depends on the direction.
    pub fn assemble(&self, st: Vec2, footprint: &Footprint, probes: Probes, max_anisotropy: f64) -> Average {
        let row = ProbeRow::new(&Ellipse::new(footprint, self.size, max_anisotropy), probes);
        // The Gaussian row's squares stand for interpolated texels: 1/6 - 1/12 of variance is added.
        let side = match probes {
            Probes::Texram | Probes::TexramCeiling => row.side(),
            Probes::Gaussian => (12.0 * row.variance + 1.0).sqrt(),
        };
        let place = place(self.wrap, st);
        let size = DVec2::from(self.size.map(f64::from));
        row.mean(|offset| self.mean(place + offset / size, DVec2::splat(side))).rounded()
    }

    /// The mean over a rectangle; `place` in periods, `sides` in texels.
    fn mean(&self, place: DVec2, sides: DVec2) -> Mean {
        let half = 0.5 * sides.max(DVec2::ONE);
        let center = place * DVec2::from(self.size.map(f64::from));
        let columns = Terms::of_interval(center.x - half.x, center.x + half.x, self.size[0], self.wrap[0]);
        let rows = Terms::of_interval(center.y - half.y, center.y + half.y, self.size[1], self.wrap[1]);
        let mut mean = Mean::default();
        for &(row_factor, y) in rows.terms() {
            for &(column_factor, x) in columns.terms() {
                let sum = self.integral(x, y);
                for (total, value) in mean.color.iter_mut().zip(sum) {
                    *total += row_factor * column_factor * value;
                }
                mean.texels += 4;
            }
        }
        let area = 4.0 * half.x * half.y;
        for (value, [least, greatest]) in mean.color.iter_mut().zip(self.range).take(self.channels) {
            // Differences of large sums round to a little outside.
            *value = (*value / area).clamp(least, greatest);
        }
        mean
    }

    /// The integral from the texture's corner to (x, y), which lie within the texture, in texels.
    fn integral(&self, x: f64, y: f64) -> [f64; 4] {
        let cell = |value: f64, count: u32| {
            let index = (value as usize).min(count as usize - 1);
            (index, value - index as f64)
        };
        let ((column, tx), (row, ty)) = (cell(x, self.size[0]), cell(y, self.size[1]));
        let stride = (self.size[0] as usize + 1) * self.channels;
        let start = row * stride + column * self.channels;
        let mut integral = [0.0; 4];
        for (channel, value) in integral.iter_mut().enumerate().take(self.channels) {
            let at = |offset: usize| self.sums[start + offset + channel];
            let (above, below) = (
                (1.0 - tx) * at(0) + tx * at(self.channels),
                (1.0 - tx) * at(stride) + tx * at(stride + self.channels),
            );
            *value = (1.0 - ty) * above + ty * below;
        }
        integral
    }
}

/// An integral along one axis of the wrapped texture as a sum of few integrals P(x) from 0 to x within it: pairs of
/// factor and x.
#[derive(Debug, Clone, Copy, Default)]
struct Terms {
    terms: [(f64, f64); 6],
    count: usize,
}

impl Terms {
    fn of_interval(from: f64, to: f64, count: u32, wrap: Wrap) -> Self {
        let mut terms = Self::default();
        terms.push_integral(1.0, to, f64::from(count), wrap);
        terms.push_integral(-1.0, from, f64::from(count), wrap);
        terms
    }

    fn terms(&self) -> &[(f64, f64)] {
        &self.terms[..self.count]
    }

    fn push(&mut self, factor: f64, x: f64) {
        if factor != 0.0 && x != 0.0 {
            self.terms[self.count] = (factor, x);
            self.count += 1;
        }
    }

    /// `sign` times the integral from 0 to x of an axis of n texels: S(x + k n) = k P(n) + P(x) for a period.
    fn push_integral(&mut self, sign: f64, x: f64, n: f64, wrap: Wrap) {
        match wrap {
            Wrap::Repeat => {
                let periods = (x / n).floor();
                self.push(sign * periods, n);
                self.push(sign, (x - periods * n).clamp(0.0, n));
            }
            Wrap::Mirror => {
                let periods = (0.5 * x / n).floor();
                let within = (x - 2.0 * periods * n).clamp(0.0, 2.0 * n);
                if within <= n {
                    self.push(sign * 2.0 * periods, n);
                    self.push(sign, within);
                } else {
                    self.push(sign * 2.0 * (periods + 1.0), n);
                    self.push(-sign, 2.0 * n - within);
                }
            }
            Wrap::Clamp => {
                let within = x.clamp(0.0, n);
                self.push(sign, within);
                let beyond = x - within;
                if beyond < 0.0 {
                    self.push(sign * beyond, 1.0);
                } else {
                    self.push(sign * beyond, n);
                    self.push(-sign * beyond, n - 1.0);
                }
            }
            Wrap::Black => self.push(sign, x.clamp(0.0, n)),
        }
    }
}
