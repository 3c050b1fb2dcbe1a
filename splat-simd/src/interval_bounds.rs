//! Bounds of depth intervals, pixel by pixel, for plain splats before a pinhole.
//!
//! Whether all fragments of a sample are one layer is a question to their depth intervals. Where all samples of a pixel see one
//! layer it need not be asked of each of them: over a pixel a splat's depth differs by far less than an interval is long. So
//! there are two bounds a pixel, which all of its samples share, and depths need not even be computed.

use crate::lanes::{Eight, LANES, Lanes};
use crate::places::{PLACES, PlaceList};
use splat_abuffer::SplatSurface;
use splat_core::evaluate::SplatConstants;
use splat_core::setup::VisibleSplat;

/// What rounding can do to g, here and where samples are evaluated: 16 roundings of numbers below 2 (the terms of g add up to less).
const G_ERROR: f32 = 16.0 / (1 << 23) as f32;

/// A number below any g of a plain splat's candidates, which is at least 1/16 less rounding.
const LEAST_G: f32 = 1.0 / 32.0;

/// What rounding can do to the ends of an interval, relative to depth and length together.
const END_ERROR: f32 = 4.0 / (1 << 23) as f32;

/// For each place of a tile an upper bound of the near ends of the intervals of its fragments, and a lower one of their far ends.
#[derive(Debug, Default)]
pub struct IntervalBounds {
    near: Vec<f32>,
    far: Vec<f32>,
}

impl IntervalBounds {
    /// Those of a tile without fragments.
    pub fn clear(&mut self) {
        // Rows are written eight places at a time.
        for (bounds, none) in [(&mut self.near, f32::NEG_INFINITY), (&mut self.far, f32::INFINITY)] {
            bounds.clear();
            bounds.resize(PLACES + LANES, none);
        }
    }

    /// The bounds of near and far ends in a place and the seven that follow.
    #[inline(always)]
    pub fn eight(&self, place: usize) -> [&Eight; 2] {
        [&self.near, &self.far].map(|bounds| bounds[place..].first_chunk().unwrap_or(&[0.0; LANES]))
    }

    /// Whether the depth of a plain splat differs so little over a pixel that its bounds are tight.
    #[inline(always)]
    pub fn suit(splat: &VisibleSplat, surface: &SplatSurface, reach: f32) -> bool {
        let SplatConstants { h: [hx, hy], depth, .. } = splat.constants;
        let [slope, cap] = surface.interval;
        let half = (slope * depth).min(cap);
        2.0 * reach * (hx.abs() + hy.abs()) * depth <= half
    }

    /// Counts in the fragments that a plain splat may have in the rows of a list. `reach` is the radius of the pixel filter.
    ///
    /// Its depth in a pixel is that of the reference point over g, which is linear.
    #[inline(always)]
    pub fn add<L: Lanes>(
        &mut self,
        splat: &VisibleSplat,
        surface: &SplatSurface,
        list: &PlaceList,
        reach: f32,
    ) {
        let constants = &splat.constants;
        let [hx, hy] = constants.h;
        let iota = L::load(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
        let step = L::splat(hx) * iota;
        let room = L::splat((hx.abs() + hy.abs()) * reach + G_ERROR);
        let [slope, cap] = surface.interval.map(L::splat);
        let depth = L::splat(constants.depth);
        for &(first, count) in list.rows() {
            let [x, y] = list.offset(first);
            let first_g = 1.0 + (hx * (x + (0.5 - constants.xf)) + hy * (y + (0.5 - constants.yf)));
            for column in (0..count).step_by(LANES) {
                let g = L::splat(first_g + hx * f32::from(column)) + step;
                let farthest = depth / (g - room).greatest(L::splat(LEAST_G));
                let nearest = depth / (g + room);
                let half = (slope * nearest).least(cap);
                let error = (farthest + half) * L::splat(END_ERROR);
                let outside = iota.not_less(L::splat(f32::from(count - column)));
                self.join(
                    usize::from(first + column),
                    [farthest - half + error, nearest + half - error],
                    outside,
                );
            }
        }
    }

    /// Counts in the intervals of eight places, but for those `outside`.
    #[inline(always)]
    fn join<L: Lanes>(&mut self, place: usize, [near, far]: [L; 2], outside: L) {
        let bounds = [&mut self.near, &mut self.far].map(|bounds| bounds[place..].first_chunk_mut());
        if let [Some(all_near), Some(all_far)] = bounds {
            // What is not a number is not counted in.
            (near | outside).greatest(L::load(all_near)).store_cell::<0>(all_near);
            (far | outside).least(L::load(all_far)).store_cell::<0>(all_far);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{Kernel, Level};
    use crate::places::tests::{config, splat as splat_of};
    use crate::places::{TILE, pixel_of};
    use proptest::prelude::*;
    use splat_core::PixelRect;
    use splat_core::evaluate::Limits;
    use splat_core::setup::Outline;

    /// [`IntervalBounds::add`] for all pixels of a rectangle.
    struct Add<'a> {
        bounds: &'a mut IntervalBounds,
        splat: &'a VisibleSplat,
        surface: &'a SplatSurface,
        reach: f32,
    }

    impl Kernel for Add<'_> {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            let mut list = PlaceList::default();
            list.fill::<L>(self.splat, &PixelRect::new(0, 0, TILE, TILE), self.reach);
            self.bounds.add::<L>(self.splat, self.surface, &list, self.reach);
        }
    }

    /// The interval of the fragment of a sample, as the reference has it.
    fn interval(depth: f32, surface: &SplatSurface) -> [f32; 2] {
        let half = (surface.interval[0] * depth).min(surface.interval[1]);
        [depth - half, depth + half]
    }

    proptest! {
        #![proptest_config(config())]

        #[test]
        fn bounds_hold_every_fragment_and_little_more(
            [x0, y0, width, height] in [0i32..32, 0i32..32, 1i32..32, 1i32..32],
            center in [-40i32..72, -40i32..72],
            fraction in [-0.5f32..0.5, -0.5f32..0.5],
            // How far g comes from 1, and in which direction it changes.
            steepness in prop_oneof![Just(0.0f32), 0.0f32..0.9375, Just(0.9375f32)],
            angle in 0.0f32..6.3,
            depth in prop_oneof![0.1f32..10.0, Just(1e-5f32), Just(1e7f32)],
            slope in prop_oneof![0.0f32..0.01, 0.0f32..3.0, Just(f32::INFINITY)],
            cap in prop_oneof![0.0f32..0.1, 0.0f32..30.0],
            reach in prop_oneof![Just(0.5f32), Just(1.5f32)],
            jitters in proptest::collection::vec([-1.0f32..=1.0, -1.0f32..=1.0], 16),
        ) {
            let pixels = PixelRect::new(x0, y0, (x0 + width).min(TILE), (y0 + height).min(TILE));
            let mut splat = splat_of(Outline::EVERYTHING, pixels);
            let constants = &mut splat.constants;
            [constants.xi, constants.yi] = center;
            [constants.xf, constants.yf] = fraction;
            constants.depth = depth;
            let farthest = |axis: usize, first: i32, end: i32| {
                let center = center[axis] as f32 + fraction[axis];
                (first as f32 + 0.5 - reach - center).abs().max((end as f32 - 0.5 + reach - center).abs())
            };
            let [dx, dy] = [farthest(0, pixels.x0, pixels.x1), farthest(1, pixels.y0, pixels.y1)];
            let [hx, hy] = [libm::cosf(angle), libm::sinf(angle)];
            // As `VisibleSplat::plain` asks for, but to the limit.
            constants.h = [hx, hy].map(|h| h * steepness / (hx.abs() * dx + hy.abs() * dy));
            let surface = SplatSurface { color: [1.0; 3], opacity: 1.0, interval: [slope, cap] };
            let limits = Limits { cutoff: f32::INFINITY, near: 0.0, far: f32::INFINITY };
            for level in Level::available() {
                let mut bounds = IntervalBounds::default();
                bounds.clear();
                let all = &mut bounds;
                level.run_single(Add { bounds: all, splat: &splat, surface: &surface, reach });
                for place in 0..PLACES {
                    let [near, far] = bounds.eight(place).map(|bounds| bounds[0]);
                    let [x, y] = pixel_of(place as u16);
                    if !(pixels.x0..pixels.x1).contains(&x) || !(pixels.y0..pixels.y1).contains(&y) {
                        prop_assert_eq!([near, far], [f32::NEG_INFINITY, f32::INFINITY]);
                        continue;
                    }
                    let corners = [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]];
                    let mut depths = [f32::INFINITY, 0.0f32];
                    for jitter in jitters.iter().chain(&corners) {
                        let jitter = jitter.map(|jitter| 0.5 + jitter * reach);
                        let d = [
                            (x - center[0]) as f32 + (jitter[0] - fraction[0]),
                            (y - center[1]) as f32 + (jitter[1] - fraction[1]),
                        ];
                        let Some(hit) = splat.constants.pinhole(d, &limits) else { continue };
                        let [nearest, farthest] = interval(hit.depth, &surface);
                        prop_assert!(nearest <= near && far <= farthest, "{nearest} {near} {far} {farthest}");
                        depths = [depths[0].min(hit.depth), depths[1].max(hit.depth)];
                    }
                    // The corners have the least depth and the greatest. Rounding of g, which is 1/16 at least, counts most.
                    let half = (slope * depths[0]).min(cap);
                    let error = 32.0 * G_ERROR * (depths[1] + half);
                    prop_assert!(near <= depths[1] - half + error && far >= depths[0] + half - error);
                }
            }
        }
    }
}
