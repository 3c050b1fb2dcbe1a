//! Interpolation within a level and between levels.

use super::ellipse::{Ellipse, texel_place};
use super::mean::{Mean, WeightedSum};
use crate::texture::pyramid::{Level, Pyramid};
use glam::DVec2;

/// pbrt's `MIPMap::triangle`: the four texels around, by their tents.
pub(super) fn bilinear(pyramid: &Pyramid, level: usize, place: DVec2) -> Mean {
    let level = level.min(pyramid.last());
    let place = texel_place(place, &pyramid.levels()[level]);
    let corner = place.floor();
    let t = place - corner;
    let (x, y) = (corner.x as i64, corner.y as i64);
    let mut sum = WeightedSum::default();
    sum.add_texel(pyramid.texel(level, x, y), (1.0 - t.x) * (1.0 - t.y));
    sum.add_texel(pyramid.texel(level, x + 1, y), t.x * (1.0 - t.y));
    sum.add_texel(pyramid.texel(level, x, y + 1), (1.0 - t.x) * t.y);
    sum.add_texel(pyramid.texel(level, x + 1, y + 1), t.x * t.y);
    sum.mean().unwrap_or_default()
}

/// Catmull and Rom's cubic through the texels of level 0 (Keys 1981, a = -1/2), rows first. Each interpolation of four
/// values is kept between the least and the greatest of them: no new highlights, and still continuous.
pub(super) fn bicubic(pyramid: &Pyramid, place: DVec2) -> Mean {
    let place = texel_place(place, &pyramid.levels()[0]);
    let corner = place.floor();
    let t = place - corner;
    let (x, y) = (corner.x as i64, corner.y as i64);
    let row = |dy: i64| {
        let texels = [-1, 0, 1, 2].map(|dx| pyramid.texel(0, x.saturating_add(dx), y + dy).map(f64::from));
        catmull_rom(texels, t.x)
    };
    Mean { color: catmull_rom([-1, 0, 1, 2].map(row), t.y), texels: 16 }
}

/// Between the second and the third of four colours, t in [0, 1].
fn catmull_rom(colors: [[f64; 4]; 4], t: f64) -> [f64; 4] {
    let weights = [
        ((-0.5 * t + 1.0) * t - 0.5) * t,
        (1.5 * t - 2.5) * t * t + 1.0,
        ((-1.5 * t + 2.0) * t + 0.5) * t,
        (0.5 * t - 0.5) * t * t,
    ];
    std::array::from_fn(|channel| {
        let values = colors.map(|color| color[channel]);
        let sum: f64 = values.iter().zip(weights).map(|(value, weight)| value * weight).sum();
        let least = values.into_iter().fold(f64::INFINITY, f64::min);
        let greatest = values.into_iter().fold(f64::NEG_INFINITY, f64::max);
        sum.clamp(least, greatest)
    })
}

/// A place between two levels: the finer one, and the share of the next, 0 at the last.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BetweenLevels {
    pub finer: usize,
    pub share: f64,
}

impl BetweenLevels {
    /// Where texels are `width` texels of level 0 large, on a logarithmic scale as pbrt's. Clamped to the
    /// levels that there are (E7), in texels of each axis (E2).
    pub fn of_width(pyramid: &Pyramid, width: f64) -> Self {
        Self::of(pyramid, width, Level::coarseness, |below, above| libm::log2(above / below))
    }

    /// Where bilinear interpolation of the level's texels has this variance, in squared texels of level 0.
    pub fn of_variance(pyramid: &Pyramid, variance: f64) -> Self {
        let of_level = |level: &Level| {
            let axis = |axis: usize| {
                let size = level.texel_size()[axis];
                level.variance()[axis] + size * size * super::rows::BILINEAR_VARIANCE
            };
            axis(0).max(axis(1))
        };
        Self::of(pyramid, variance, of_level, |below, above| above - below)
    }

    /// Between the levels whose measures enclose `value`, by the distances of measures.
    fn of(
        pyramid: &Pyramid,
        value: f64,
        measure: impl Fn(&Level) -> f64,
        distance: impl Fn(f64, f64) -> f64,
    ) -> Self {
        let levels = pyramid.levels();
        let finer = levels.partition_point(|level| measure(level) <= value).saturating_sub(1);
        let low = measure(&levels[finer]);
        let share = levels
            .get(finer + 1)
            .filter(|_| value > low)
            .map_or(0.0, |coarser| (distance(low, value) / distance(low, measure(coarser))).clamp(0.0, 1.0));
        Self { finer, share }
    }

    /// What `lookup` finds at the two levels, mixed; only one is asked where the share of the other is 0 (E6).
    pub fn mix(self, lookup: impl Fn(usize) -> Mean) -> Mean {
        let finer = lookup(self.finer);
        if self.share > 0.0 { finer.mix(lookup(self.finer + 1), self.share) } else { finer }
    }
}

/// pbrt's trilinear lookup with the triangle filter: its width is the longer semi-axis, wherever it points (E12).
pub(super) fn trilinear(pyramid: &Pyramid, place: DVec2, ellipse: &Ellipse) -> Mean {
    BetweenLevels::of_width(pyramid, ellipse.major).mix(|level| bilinear(pyramid, level, place))
}
