//! Surfaces summed as they are rasterised, without storing fragments.
//!
//! Nearly all cells of a smooth surface hold one layer: in each lane the intervals of all fragments have a point in common. Its
//! sums run in splat order, and so do the splats that are rasterised; so they can be made at once, with the bits that the
//! fragments would give later. Whether a cell really held one layer is known at the end. The few that did not are
//! rasterised again, into records.

use crate::lanes::{Eight, LANES, Lanes};
use crate::places::PLACES;
use crate::records::cell_of;
use crate::resolve::{Sums, interval};
use splat_abuffer::SplatSurface;

/// What is known of the fragments of a cell, if they are opaque.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
struct CellSums {
    /// The greatest near end of their intervals, and the least far end.
    last_near: Eight,
    first_far: Eight,
    weight: Eight,
    weight_color: [Eight; 3],
}

impl CellSums {
    /// Those of no fragments.
    const EMPTY: Self = Self {
        last_near: [f32::NEG_INFINITY; LANES],
        first_far: [f32::INFINITY; LANES],
        weight: [0.0; LANES],
        weight_color: [[0.0; LANES]; 3],
    };
}

/// The sums of the cells of a tile.
#[derive(Debug, Default)]
pub struct SurfaceSums {
    /// Between two tiles all of them are empty.
    cells: Vec<CellSums>,
    /// Cells of several layers.
    layered: Vec<bool>,
    /// Number of these.
    pub layered_count: usize,
}

impl SurfaceSums {
    /// Makes room for a tile of `groups` times [`PLACES`] cells.
    pub fn prepare(&mut self, groups: usize) {
        self.cells.resize(groups * PLACES, CellSums::EMPTY);
        self.layered.clear();
        self.layered.resize(groups * PLACES, false);
        self.layered_count = 0;
    }

    /// Adds the fragments of a splat in a cell, or in two different ones.
    #[inline(always)]
    pub fn add<L: Lanes>(&mut self, cells: [usize; 2], depth: L, weight: L, surface: &SplatSurface) {
        let [first, second] = cells;
        let (a, b) = (&self.cells[first], &self.cells[second]);
        let [near, far] = interval(depth, surface);
        let last_near = near.greatest(L::load_cells(&a.last_near, &b.last_near));
        let first_far = far.least(L::load_cells(&a.first_far, &b.first_far));
        let color = |i: usize| L::load_cells(&a.weight_color[i], &b.weight_color[i]);
        let mut sums = Sums::opaque(L::load_cells(&a.weight, &b.weight), [color(0), color(1), color(2)]);
        sums.add::<true>(weight, surface);
        self.store::<L, 0>(first, last_near, first_far, &sums);
        if L::CELLS == 2 && first != second {
            self.store::<L, 1>(second, last_near, first_far, &sums);
        }
    }

    #[inline(always)]
    fn store<L: Lanes, const CELL: usize>(&mut self, cell: usize, last_near: L, first_far: L, sums: &Sums<L>) {
        let to = &mut self.cells[cell];
        last_near.store_cell::<CELL>(&mut to.last_near);
        first_far.store_cell::<CELL>(&mut to.first_far);
        sums.weight.store_cell::<CELL>(&mut to.weight);
        for (to, color) in to.weight_color.iter_mut().zip(sums.weight_opacity_color) {
            color.store_cell::<CELL>(to);
        }
    }

    /// Finds the cells of several layers and empties them. If `by_pixel`, all groups of a pixel are rasterised again together.
    #[inline(always)]
    pub fn find_layered<L: Lanes>(&mut self, by_pixel: bool) {
        for (cell, sums) in self.cells.iter().enumerate() {
            let [near, far] = [L::load(&sums.last_near), L::load(&sums.first_far)];
            let layered = near.not_less_or_equal(far).bits() != 0;
            self.layered[cell] |= layered;
            self.layered_count += usize::from(layered);
        }
        if self.layered_count == 0 {
            return;
        }
        if by_pixel {
            let groups = self.layered.len() / PLACES;
            for place in 0..PLACES {
                let cells = (0..groups).map(|group| cell_of(place as u16, group));
                if cells.clone().any(|cell| self.layered[cell]) {
                    cells.for_each(|cell| self.layered[cell] = true);
                }
            }
        }
        for (sums, _) in self.cells.iter_mut().zip(&self.layered).filter(|(_, layered)| **layered) {
            *sums = CellSums::EMPTY;
        }
    }

    /// Whether a cell (of a pixel, if those were asked for: its place) holds several layers.
    #[inline(always)]
    pub fn is_layered(&self, cell: usize) -> bool {
        self.layered[cell]
    }

    /// Whether a cell has no sums.
    #[inline(always)]
    pub fn is_empty(&self, cell: usize) -> bool {
        self.cells[cell].weight == [0.0; LANES]
    }

    /// The sums of a cell, which it loses.
    #[inline(always)]
    pub fn take<L: Lanes>(&mut self, cell: usize) -> Sums<L> {
        let CellSums { weight, weight_color: [red, green, blue], .. } =
            std::mem::replace(&mut self.cells[cell], CellSums::EMPTY);
        Sums::opaque(L::load(&weight), [L::load(&red), L::load(&green), L::load(&blue)])
    }

    /// Empties all cells.
    pub fn clear(&mut self) {
        self.cells.fill(CellSums::EMPTY);
    }
}
