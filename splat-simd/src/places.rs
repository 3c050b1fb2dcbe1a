//! Which pixels of a tile a splat may be hit from, row by row.

use crate::evaluate::LaneHits;
use crate::lanes::{Eight, LANES, Lanes};
use splat_core::PixelRect;
use splat_core::setup::{BOX_PADDING, VisibleSplat};

/// Side of a tile, in pixels. That of the table of sample patterns, so that all tiles share one table.
pub const TILE: i32 = 32;

/// Number of pixels of a tile. A pixel's *place* is its number in its tile, row by row.
pub const PLACES: usize = (TILE * TILE) as usize;

/// Number of bits of a place that are its column.
const COLUMN_BITS: u32 = TILE.trailing_zeros();

/// The place of a pixel of the frame.
#[inline(always)]
pub fn place_of(x: i32, y: i32) -> u16 {
    ((y & (TILE - 1)) << COLUMN_BITS | x & (TILE - 1)) as u16
}

/// Column and row of a place in its tile.
#[inline(always)]
pub fn pixel_of(place: u16) -> [i32; 2] {
    let place = i32::from(place);
    [place & (TILE - 1), place >> COLUMN_BITS]
}

/// A list of places, and what each column and row of their tile is for the evaluation.
#[derive(Debug)]
pub struct PlaceList {
    /// Room for a row more: rows are written whole, and only counted as far as they go.
    places: [u16; PLACES + TILE as usize],
    count: usize,
    /// The rows that were listed, of which `row_count` are in use: the first place of each, and the number of its places.
    rows: [(u16, u16); TILE as usize + 1],
    row_count: usize,
    /// x - xi of each column of the tile, and y - yi of each row.
    offsets: [[f32; TILE as usize]; 2],
}

impl Default for PlaceList {
    fn default() -> Self {
        Self {
            places: [0; PLACES + TILE as usize],
            count: 0,
            rows: [(0, 0); TILE as usize + 1],
            row_count: 0,
            offsets: [[0.0; TILE as usize]; 2],
        }
    }
}

impl PlaceList {
    /// The places.
    #[inline(always)]
    pub fn places(&self) -> &[u16] {
        &self.places[..self.count]
    }

    /// The first place of each row, and the number of its places: as they were listed, whichever were kept.
    #[inline(always)]
    pub fn rows(&self) -> &[(u16, u16)] {
        &self.rows[..self.row_count]
    }

    /// Keeps some of the places, in their order.
    #[inline(always)]
    pub fn retain(&mut self, keeps: impl Fn(u16) -> bool) {
        let mut kept = 0;
        for i in 0..self.count {
            let place = self.places[i];
            self.places[kept] = place;
            kept += usize::from(keeps(place));
        }
        self.count = kept;
    }

    /// (x - xi, y - yi) of a place, as the reference has it.
    #[inline(always)]
    pub fn offset(&self, place: u16) -> [f32; 2] {
        let [x, y] = pixel_of(place);
        [self.offsets[0][x as usize % TILE as usize], self.offsets[1][y as usize % TILE as usize]]
    }

    /// Lists the pixels of `region`, which lies within one tile, from which a splat may be hit. `reach` is the radius of
    /// the pixel filter.
    #[inline(always)]
    pub fn fill<L: Lanes>(&mut self, splat: &VisibleSplat, region: &PixelRect, reach: f32) {
        (self.count, self.row_count) = (0, 0);
        let candidates = splat.bounds.intersect(region);
        if candidates.is_empty() {
            return;
        }
        let corner = [candidates.x0 & !(TILE - 1), candidates.y0 & !(TILE - 1)];
        let center = [splat.constants.xi, splat.constants.yi];
        for axis in 0..2 {
            for (i, offset) in self.offsets[axis].iter_mut().enumerate() {
                *offset = (corner[axis] + i as i32 - center[axis]) as f32;
            }
        }
        if !splat.outline.is_known() {
            for y in candidates.y0..candidates.y1 {
                self.push_row(candidates.x0, candidates.x1, y);
            }
            return;
        }
        let rows = RowSpans::<L>::new(splat, reach);
        let mut y = candidates.y0;
        while y < candidates.y1 {
            let [starts, ends] = rows.eight_rows(y - center[1]);
            for (row, (start, end)) in starts.into_iter().zip(ends).enumerate() {
                let y = y + row as i32;
                if y >= candidates.y1 {
                    return;
                }
                let start = (start + center[0]).max(candidates.x0);
                let end = (end + center[0]).min(candidates.x1);
                self.push_row(start, end, y);
            }
            y += LANES as i32;
        }
    }

    /// Appends the pixels start..end of a row; they lie within one tile.
    #[inline(always)]
    fn push_row(&mut self, start: i32, end: i32, y: i32) {
        let first = place_of(start, y);
        // As many as a row can have, without a branch; the next row overwrites those that are too many.
        if let Some(room) = self.places.get_mut(self.count..self.count + TILE as usize) {
            for (i, place) in room.iter_mut().enumerate() {
                *place = first + i as u16;
            }
        }
        let count = (end - start).max(0);
        self.count += count as usize;
        self.rows[self.row_count] = (first, count as u16);
        self.row_count += usize::from(count > 0);
    }
}

/// The rows of an outline, eight at a time.
struct RowSpans<L> {
    reach: L,
    center: [L; 2],
    half_width: L,
    inverse_half_height: L,
    correlation: L,
    narrowing: L,
}

impl<L: Lanes> RowSpans<L> {
    #[inline(always)]
    fn new(splat: &VisibleSplat, reach: f32) -> Self {
        let outline = &splat.outline;
        Self {
            reach: L::splat(reach + BOX_PADDING as f32),
            center: [L::splat(outline.center[0]), L::splat(outline.center[1])],
            half_width: L::splat(outline.half_width),
            inverse_half_height: L::splat(outline.inverse_half_height),
            correlation: L::splat(outline.correlation),
            narrowing: L::splat(outline.narrowing),
        }
    }

    /// The first and the end column, relative to the splat's, of the eight rows from `row`, relative to the splat's.
    ///
    /// The samples of a row of pixels lie in a band of `reach` about its middle. The outline's edge x(t) = t r +- n sqrt(1 -
    /// t^2) (half widths, t in half heights) turns at t = +-r, so its extreme in the band is where t comes nearest to that.
    #[inline(always)]
    fn eight_rows(&self, row: i32) -> [[i32; LANES]; 2] {
        let (zero, half, one) = (L::splat(0.0), L::splat(0.5), L::splat(1.0));
        let iota = L::load(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
        let middle = (L::splat(row as f32) + iota) + half - self.center[1];
        let low = ((middle - self.reach) * self.inverse_half_height).greatest(zero - one);
        let high = ((middle + self.reach) * self.inverse_half_height).least(one);
        let left = self.edge([low, high], zero - self.correlation, zero - self.narrowing);
        let right = self.edge([low, high], self.correlation, self.narrowing);
        let room = self.reach + half;
        let start = zero - (zero - (self.center[0] + left - room)).round_down();
        let end = (self.center[0] + right + self.reach - half).round_down() + one;
        // No pixel where the band passes by the outline.
        let end = low.less_or_equal(high).select(end, start);
        // They are a few thousand at most.
        [start.whole(), end.whole()]
    }

    /// The edge's extreme in a band of heights, given where it turns.
    #[inline(always)]
    fn edge(&self, [low, high]: [L; 2], turn: L, narrowing: L) -> L {
        let one = L::splat(1.0);
        let height = turn.greatest(low).least(high);
        let square = ((one - height) * (one + height)).greatest(L::splat(0.0));
        self.half_width * (height * self.correlation + narrowing * square.square_root())
    }
}

/// How far the first pixel of a tile is from a splat's pixel.
#[derive(Debug, Clone, Copy)]
pub enum Apart<L> {
    /// So near that offsets in the tile are exact sums.
    Near([L; 2]),
    /// So far that they have to be rounded as the reference does.
    Far([i32; 2]),
}

impl<L: Lanes> Apart<L> {
    /// From the splat's pixel to the tile's first.
    #[inline(always)]
    pub fn new(splat: &VisibleSplat, corner: [i32; 2]) -> Self {
        let [x, y] = [corner[0] - splat.constants.xi, corner[1] - splat.constants.yi];
        if x.unsigned_abs().max(y.unsigned_abs()) < 1 << 23 {
            Self::Near([L::splat(x as f32), L::splat(y as f32)])
        } else {
            Self::Far([x, y])
        }
    }

    /// From the splat's pixel to pixels of the tile.
    #[inline(always)]
    pub fn to(&self, [x, y]: [L; 2]) -> [L; 2] {
        match self {
            // The sums are exact, as their terms are.
            Self::Near(apart) => [apart[0] + x, apart[1] + y],
            Self::Far(apart) => {
                let [x, y] = far_offset(*apart, [x.whole(), y.whole()]);
                [L::load(&x), L::load(&y)]
            }
        }
    }
}

/// Offsets too large for exact sums: each rounded once, as the reference does.
#[inline(never)]
fn far_offset(apart: [i32; 2], pixel: [[i32; LANES]; 2]) -> [Eight; 2] {
    [0, 1].map(|axis| pixel[axis].map(|pixel| (apart[axis] + pixel) as f32))
}

/// Drops hits whose pixels (given by column and row in a tile, and the tile's first) are not in a region.
#[inline(always)]
pub fn clip<L: Lanes>([x, y]: [L; 2], corner: [i32; 2], region: &PixelRect, hits: &mut LaneHits<L>) {
    let edge = |edge: i32, corner: i32| L::splat((edge - corner) as f32);
    hits.missed = hits.missed
        | x.less(edge(region.x0, corner[0]))
        | x.not_less(edge(region.x1, corner[0]))
        | y.less(edge(region.y0, corner[1]))
        | y.not_less(edge(region.y1, corner[1]));
}

#[cfg(test)]
#[expect(clippy::disallowed_methods, reason = "no bits of a picture come from here")]
pub(crate) mod tests {
    use super::*;
    use crate::lanes::{Kernel, Level};
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;
    use splat_core::evaluate::SplatConstants;
    use splat_core::setup::Outline;

    /// [`RowSpans::eight_rows`] of an outline, the splat's pixel being that of row 0 and column 0.
    struct Rows {
        outline: Outline,
        reach: f32,
        row: i32,
    }

    impl Kernel for Rows {
        type Output = [[i32; LANES]; 2];

        #[inline(always)]
        fn run<L: Lanes>(self) -> [[i32; LANES]; 2] {
            RowSpans::<L>::new(&splat(self.outline, PixelRect::new(0, 0, 1, 1)), self.reach)
                .eight_rows(self.row)
        }
    }

    /// The same two thousand cases in every run.
    pub(crate) fn config() -> ProptestConfig {
        ProptestConfig {
            cases: 2000,
            failure_persistence: None,
            rng_seed: RngSeed::Fixed(1),
            ..ProptestConfig::default()
        }
    }

    /// A splat of which nothing but the outline and the bounds matters.
    pub(crate) fn splat(outline: Outline, bounds: PixelRect) -> VisibleSplat {
        let constants = SplatConstants {
            xi: 0,
            yi: 0,
            xf: 0.0,
            yf: 0.0,
            h: [0.0; 2],
            a1: 0.0,
            b: [0.0; 2],
            reference: [0.0; 2],
            centred: true,
            depth: 1.0,
            depth_slope: [0.0; 2],
            defocus: 0.0,
            lens_slope: [0.0; 2],
            edge_on: 0.0,
        };
        VisibleSplat {
            constants,
            bounds,
            outline,
            index: 0,
            weight_scale: 1.0,
            back: false,
            flips: false,
            plain: true,
            certain: true,
        }
    }

    /// The first and the end column of the pixels of a row of which a sample may lie within an outline, if its samples
    /// are at most `reach` off its middle per axis; `None` if there is none.
    fn exact_span(outline: &Outline, reach: f64, row: i32) -> Option<[i32; 2]> {
        let Outline { center, half_width, inverse_half_height, correlation, narrowing } = *outline;
        let [cx, cy] = center.map(f64::from);
        let [half_width, scale, slant, width] =
            [half_width, inverse_half_height, correlation, narrowing].map(f64::from);
        let middle = f64::from(row) + 0.5 - cy;
        let [low, high] = [((middle - reach) * scale).max(-1.0), ((middle + reach) * scale).min(1.0)];
        if low > high {
            return None;
        }
        // x = t c +- n sqrt(1 - t^2) is sin(angle + const) for t = sin(angle): step through the angles, all too finely.
        let [from, to] = [low.asin(), high.asin()];
        let [mut left, mut right] = [f64::INFINITY, f64::NEG_INFINITY];
        for step in 0..=2000 {
            let angle = from + (to - from) * f64::from(step) / 2000.0;
            let (t, n) = (angle.sin() * slant, angle.cos() * width);
            left = left.min(half_width * (t - n));
            right = right.max(half_width * (t + n));
        }
        let start = (cx + left - reach - 0.5).ceil() as i32;
        let end = (cx + right + reach - 0.5).floor() as i32 + 1;
        Some([start, end.max(start)])
    }

    fn outline() -> impl Strategy<Value = Outline> {
        let size = || (-6.0f32..7.0).prop_map(f32::exp2);
        // Slanted ones all but to a line.
        let angle = prop_oneof![3 => -1.57f64..1.57, 1 => 1.55..1.5705, 1 => -1.5705..-1.55, 1 => Just(0.0)];
        (-8.0f32..8.0, -8.0f32..8.0, size(), size(), angle).prop_map(|(x, y, width, height, angle)| Outline {
            center: [x, y],
            half_width: width,
            inverse_half_height: 1.0 / height,
            correlation: angle.sin() as f32,
            narrowing: angle.cos() as f32,
        })
    }

    proptest! {
        #![proptest_config(config())]

        #[test]
        fn rows_hold_the_padded_outline_and_little_more(
            outline in outline(),
            reach in prop_oneof![Just(0.5f32), Just(1.0), Just(1.5)],
            row in -12i32..5,
        ) {
            for level in Level::available() {
                let [starts, ends] = level.run(Rows { outline, reach, row });
                for i in 0..LANES {
                    let [start, end] = [starts[i], ends[i]];
                    let span = |padding: f64| exact_span(&outline, f64::from(reach) + padding * BOX_PADDING, row + i as i32);
                    // Padded by half as much it lies within, padded by twice as much without.
                    if let Some([first, last]) = span(0.5) {
                        prop_assert!(start <= first && last <= end.max(start), "{first}..{last} in {start}..{end}");
                    }
                    match span(2.0) {
                        Some([first, last]) => prop_assert!(first <= start && end <= last, "{start}..{end} in {first}..{last}"),
                        None => prop_assert!(end <= start, "{start}..{end} where nothing is"),
                    }
                }
            }
        }

        #[test]
        fn lists_hold_the_rows_within_bounds_and_region(
            outline in prop_oneof![4 => outline(), 1 => Just(Outline::EVERYTHING)],
            [x0, y0] in [-20i32..20, -20i32..20],
            [width, height] in [1i32..40, 1i32..40],
            crop in [0i32..32, 0i32..32, 1i32..33, 1i32..33],
            tile in [-1i32..2, -1i32..2],
        ) {
            struct Fill<'a>(&'a mut PlaceList, &'a VisibleSplat, PixelRect);
            impl Kernel for Fill<'_> {
                type Output = ();
                #[inline(always)]
                fn run<L: Lanes>(self) {
                    self.0.fill::<L>(self.1, &self.2, 1.5);
                }
            }
            let corner = tile.map(|tile| tile * TILE);
            let [left, top, crop_width, crop_height] = crop;
            let region = PixelRect::new(corner[0] + left, corner[1] + top, corner[0] + left + crop_width, corner[1] + top + crop_height)
                .intersect(&PixelRect::new(corner[0], corner[1], corner[0] + TILE, corner[1] + TILE));
            let splat = splat(outline, PixelRect::new(x0, y0, x0 + width, y0 + height));
            let candidates = splat.bounds.intersect(&region);
            for level in Level::available() {
                let mut expected = Vec::new();
                for y in candidates.y0..candidates.y1.max(candidates.y0) {
                    let [starts, ends] = level.run(Rows { outline, reach: 1.5, row: y });
                    let [start, end] = if outline.is_known() { [starts[0], ends[0]] } else { [-99, 99] };
                    expected.extend((start.max(candidates.x0)..end.min(candidates.x1)).map(|x| [x, y]));
                }
                let mut list = PlaceList::default();
                // Twice: nothing of the first time may remain.
                for _ in 0..2 {
                    level.run(Fill(&mut list, &splat, region));
                    let places = list.places().iter();
                    let found: Vec<[i32; 2]> = places.map(|&place| {
                        let [x, y] = pixel_of(place);
                        assert_eq!(list.offset(place), [(corner[0] + x) as f32, (corner[1] + y) as f32]);
                        [corner[0] + x, corner[1] + y]
                    }).collect();
                    prop_assert_eq!(&found, &expected);
                }
            }
        }
    }
}
