//! Surfaces summed as they are rasterised, without storing fragments.
//!
//! Where one side of the splats is seen, nearly all samples of a smooth surface see one layer: the intervals of all their
//! fragments have a point in common. The layer's sums run in splat order, and in that order splats are rasterised; so the sums
//! can be made at once, with the bits that stored fragments would give later. Whether the samples of a pixel really see one layer
//! is known at the end. Of the few pixels where that is not certain all splats are rasterised again, into records.

use crate::interval_bounds::IntervalBounds;
use crate::lanes::{Eight, Kernel, LANES, Lanes};
use crate::lens_sums::SampleSums;
use crate::places::PLACES;
use crate::records::cell_of;
use crate::resolve::{Sums, interval};
use splat_abuffer::SplatSurface;

/// [`Line`]s of a cell where all colours are grey: weights, and weights times colours.
pub const GREY: usize = 1;

/// Those of a cell in colour: weights, and weights times red; weights times green and blue.
pub const COLOR: usize = 2;

/// Two sums of each sample of a cell, in a cache line.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
pub struct Line([Eight; 2]);

/// The greatest near end of the intervals of the fragments of each sample of a cell, and the least far end.
type Ends = [Eight; 2];

/// Those of no fragments.
const NO_ENDS: Ends = [[f32::NEG_INFINITY; LANES], [f32::INFINITY; LANES]];

/// The sums of the cells of a tile.
#[derive(Debug, Default)]
pub struct SurfaceSums {
    /// For each cell [`GREY`] or [`COLOR`] of them. Between two tiles all are 0.
    lines: Vec<Line>,
    is_grey: bool,
    groups: usize,
    /// What is known of the intervals of fragments of plain splats before a pinhole.
    pub bounds: IntervalBounds,
    /// For each cell those of the other fragments; empty if there are none.
    ends: Vec<Ends>,
    /// The places whose samples may see several layers.
    layered: Vec<bool>,
    /// Scratch: a cell for each place.
    squares: Vec<Eight>,
}

impl SurfaceSums {
    /// Bytes of a cell with all that belongs to it.
    pub const BYTES_PER_CELL: usize = COLOR * size_of::<Line>()
        + size_of::<Ends>()
        + size_of::<Eight>()
        + 2 * size_of::<f32>()
        + size_of::<bool>();

    /// Makes room for a tile of `groups` times [`PLACES`] cells.
    pub fn prepare(&mut self, groups: usize, is_grey: bool) {
        (self.groups, self.is_grey) = (groups, is_grey);
        let lines = if is_grey { GREY } else { COLOR };
        self.lines.resize(self.cells() * lines, Line::default());
        self.bounds.clear();
        self.ends.clear();
        self.squares.resize(PLACES, [0.0; LANES]);
        self.layered.clear();
        self.layered.resize(PLACES, false);
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.groups * PLACES
    }

    /// Whether cells have [`GREY`] lines each.
    #[inline(always)]
    pub fn is_grey(&self) -> bool {
        self.is_grey
    }

    /// The sums of all cells, of `LINES` lines each; and room for what is hit of a splat in as many places as a tile has.
    #[inline(always)]
    pub fn cells_mut<const LINES: usize>(&mut self) -> (&mut [[Line; LINES]], &mut [Eight]) {
        (self.lines.as_chunks_mut().0, &mut self.squares)
    }

    /// Adds the fragments of a splat in a cell, or in two different ones.
    #[inline(always)]
    pub fn add<L: Lanes>(&mut self, cells: [usize; 2], depth: L, weight: L, surface: &SplatSurface) {
        if self.is_grey {
            add_weights(self.cells_mut::<GREY>().0, cells, weight, surface.color);
        } else {
            add_weights(self.cells_mut::<COLOR>().0, cells, weight, surface.color);
        }
        let [first, second] = cells;
        let [near, far] = interval(depth, surface);
        let (a, b) = (&self.ends[first], &self.ends[second]);
        let near = near.greatest(L::load_cells(&a[0], &b[0]));
        let far = far.least(L::load_cells(&a[1], &b[1]));
        near.store_cell::<0>(&mut self.ends[first][0]);
        far.store_cell::<0>(&mut self.ends[first][1]);
        if L::CELLS == 2 && first != second {
            near.store_cell::<1>(&mut self.ends[second][0]);
            far.store_cell::<1>(&mut self.ends[second][1]);
        }
    }

    /// Makes room for ends of intervals: before [`SurfaceSums::add`].
    #[inline(always)]
    pub fn need_ends(&mut self) {
        if self.ends.is_empty() {
            self.ends.resize(self.cells(), NO_ENDS);
        }
    }

    /// Takes the sums of the samples of all cells, which lose them.
    pub fn take_samples(&mut self, samples: &mut [SampleSums]) {
        self.need_ends();
        let lines = self.lines.len() / self.cells();
        let (samples, _) = samples.as_chunks_mut::<LANES>();
        for ((cell, ends), samples) in self.lines.chunks_mut(lines).zip(&mut self.ends).zip(samples) {
            for (lane, sample) in samples.iter_mut().enumerate().filter(|(_, sample)| !sample.is_empty()) {
                let [red, green, blue, weight, near, far, ..] = sample.0;
                let values = cell.iter_mut().flat_map(|line| &mut line.0);
                for (to, value) in values.zip([weight, red, green, blue]) {
                    to[lane] = value;
                }
                [ends[0][lane], ends[1][lane]] = [near, far];
                *sample = SampleSums::EMPTY;
            }
        }
    }

    /// Whether samples of a cell may see several layers. The cells of a pixel do so together.
    #[inline(always)]
    pub fn is_layered(&self, cell: usize) -> bool {
        self.layered[cell % PLACES]
    }

    /// Whether a cell has no sums.
    #[inline(always)]
    pub fn is_empty<const LINES: usize>(&self, cell: usize) -> bool {
        let Line([weight, _]) = &self.lines[cell * LINES];
        *weight == [0.0; LANES]
    }

    /// The sums of a cell, which it loses.
    #[inline(always)]
    pub fn take<L: Lanes, const LINES: usize>(&mut self, cell: usize) -> Sums<L> {
        let cell = std::mem::replace(&mut self.cells_mut::<LINES>().0[cell], [Line::default(); LINES]);
        let value = |number: usize| {
            // Grey is red, green and blue.
            let number = number.min(2 * LINES - 1);
            &cell[number / 2].0[number % 2]
        };
        Sums::opaque(L::load(value(0)), [L::load(value(1)), L::load(value(2)), L::load(value(3))])
    }

    /// Empties all cells.
    pub fn clear(&mut self) {
        self.lines.fill(Line::default());
    }
}

/// Adds weights, and weights times colours, to the sums of a cell, or of two different ones.
#[inline(always)]
pub fn add_weights<L: Lanes, const LINES: usize>(
    cells: &mut [[Line; LINES]],
    [first, second]: [usize; 2],
    weight: L,
    [red, green, blue]: [f32; 3],
) {
    for (number, factor) in [1.0, red, green, blue].into_iter().enumerate().take(2 * LINES) {
        let [line, half] = [number / 2, number % 2];
        let added = if number == 0 { weight } else { weight * L::splat(factor) };
        let sum = L::load_cells(&cells[first][line].0[half], &cells[second][line].0[half]) + added;
        sum.store_cell::<0>(&mut cells[first][line].0[half]);
        if L::CELLS == 2 && first != second {
            sum.store_cell::<1>(&mut cells[second][line].0[half]);
        }
    }
}

/// Finds the places whose samples may see several layers, and empties their cells. Gives their number, and that of the places
/// that may be hit.
#[derive(Debug)]
pub struct FindLayered<'a> {
    /// The sums of a tile.
    pub sums: &'a mut SurfaceSums,
}

impl Kernel for FindLayered<'_> {
    type Output = [usize; 2];

    #[inline(always)]
    fn run<L: Lanes>(self) -> [usize; 2] {
        let sums = self.sums;
        let (mut hit, mut found) = (0, 0);
        for first in (0..PLACES).step_by(LANES) {
            let [near, far] = sums.bounds.eight(first).map(L::load);
            let mut several = near.not_less_or_equal(far).bits();
            let mut any = far.less(L::splat(f32::INFINITY)).bits();
            if !sums.ends.is_empty() {
                for i in 0..LANES {
                    let [near, far] = sums.bounds.eight(first).map(|bounds| L::splat(bounds[i]));
                    for group in 0..sums.groups {
                        let ends = &sums.ends[cell_of((first + i) as u16, group)];
                        let [near, far] = [near.greatest(L::load(&ends[0])), far.least(L::load(&ends[1]))];
                        several |= u32::from(near.not_less_or_equal(far).bits() != 0) << i;
                        any |= u32::from(far.less(L::splat(f32::INFINITY)).bits() != 0) << i;
                    }
                }
            }
            hit += any.count_ones() as usize;
            found += several.count_ones() as usize;
            for (i, layered) in sums.layered[first..first + LANES].iter_mut().enumerate() {
                *layered = several >> i & 1 == 1;
            }
        }
        if found > 0 {
            let lines = sums.lines.len() / sums.cells();
            let layered = sums.layered.iter().cycle();
            for (cell, _) in sums.lines.chunks_mut(lines).zip(layered).filter(|(_, layered)| **layered) {
                cell.fill(Line::default());
            }
        }
        [found, hit]
    }
}
