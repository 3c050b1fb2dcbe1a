//! Surfaces summed as they are rasterised, without storing fragments.
//!
//! Where one side of the splats is seen, nearly all cells of a smooth surface hold one layer: in each lane the intervals of all
//! fragments have a point in common. The layer's sums run in splat order, and in that order splats are rasterised; so the sums
//! can be made at once, with the bits that stored fragments would give later. Whether a cell really held one layer is known at
//! the end. The few that did not are rasterised again, into records.

use crate::lanes::{Eight, Kernel, LANES, Lanes};
use crate::lens_sums::SampleSums;
use crate::places::PLACES;
use crate::records::cell_of;
use crate::resolve::{Sums, interval};
use splat_abuffer::SplatSurface;

/// What is known of the opaque fragments of a cell.
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
    /// Cells that hold several layers.
    layered: Vec<bool>,
}

impl SurfaceSums {
    /// Bytes of a cell with all that belongs to it.
    pub const BYTES_PER_CELL: usize = size_of::<CellSums>() + size_of::<bool>();

    /// Makes room for a tile of `groups` times [`PLACES`] cells.
    pub fn prepare(&mut self, groups: usize) {
        self.cells.resize(groups * PLACES, CellSums::EMPTY);
        self.layered.clear();
        self.layered.resize(groups * PLACES, false);
    }

    /// Adds the fragments of a splat in a cell, or in two different ones.
    #[inline(always)]
    pub fn add<L: Lanes>(
        &mut self,
        [first, second]: [usize; 2],
        depth: L,
        weight: L,
        surface: &SplatSurface,
    ) {
        let (a, b) = (&self.cells[first], &self.cells[second]);
        let [near, far] = interval(depth, surface);
        let last_near = near.greatest(L::load_cells(&a.last_near, &b.last_near));
        let first_far = far.least(L::load_cells(&a.first_far, &b.first_far));
        let color = |i: usize| L::load_cells(&a.weight_color[i], &b.weight_color[i]);
        let mut sums = Sums::opaque(L::load_cells(&a.weight, &b.weight), [color(0), color(1), color(2)]);
        sums.add::<true>(weight, surface);
        self.store::<L, 0>(first, [last_near, first_far], &sums);
        if L::CELLS == 2 && first != second {
            self.store::<L, 1>(second, [last_near, first_far], &sums);
        }
    }

    #[inline(always)]
    fn store<L: Lanes, const CELL: usize>(&mut self, cell: usize, [near, far]: [L; 2], sums: &Sums<L>) {
        let to = &mut self.cells[cell];
        near.store_cell::<CELL>(&mut to.last_near);
        far.store_cell::<CELL>(&mut to.first_far);
        sums.weight.store_cell::<CELL>(&mut to.weight);
        for (to, color) in to.weight_color.iter_mut().zip(sums.weight_opacity_color) {
            color.store_cell::<CELL>(to);
        }
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.cells.len()
    }

    /// Takes the sums of the samples of all cells, which lose them.
    pub fn take_samples(&mut self, samples: &mut [SampleSums]) {
        let (samples, _) = samples.as_chunks_mut::<LANES>();
        for (cell, samples) in self.cells.iter_mut().zip(samples) {
            for (lane, sample) in samples.iter_mut().enumerate().filter(|(_, sample)| !sample.is_empty()) {
                let [red, green, blue, weight, last_near, first_far, ..] = sample.0;
                for (to, color) in cell.weight_color.iter_mut().zip([red, green, blue]) {
                    to[lane] = color;
                }
                cell.weight[lane] = weight;
                cell.last_near[lane] = last_near;
                cell.first_far[lane] = first_far;
                *sample = SampleSums::EMPTY;
            }
        }
    }

    /// Whether a cell holds several layers. The cells of a pixel do so together.
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

/// Finds the cells that hold several layers, all of a pixel together, and empties them. Gives their number, and that of the cells that were hit.
#[derive(Debug)]
pub struct FindLayered<'a> {
    /// The sums of a tile.
    pub sums: &'a mut SurfaceSums,
}

impl Kernel for FindLayered<'_> {
    type Output = [usize; 2];

    #[inline(always)]
    fn run<L: Lanes>(self) -> [usize; 2] {
        let SurfaceSums { cells, layered } = self.sums;
        let (mut hit, mut found) = (0, false);
        for (sums, layered) in cells.iter().zip(&mut *layered) {
            let [near, far] = [L::load(&sums.last_near), L::load(&sums.first_far)];
            *layered = near.not_less_or_equal(far).bits() != 0;
            found |= *layered;
            hit += usize::from(sums.first_far != [f32::INFINITY; LANES]);
        }
        if !found {
            return [0, hit];
        }
        let groups = layered.len() / PLACES;
        for place in 0..PLACES as u16 {
            let any = (0..groups).any(|group| layered[cell_of(place, group)]);
            (0..groups).for_each(|group| layered[cell_of(place, group)] = any);
        }
        for (sums, _) in cells.iter_mut().zip(&*layered).filter(|(_, layered)| **layered) {
            *sums = CellSums::EMPTY;
        }
        [layered.iter().filter(|layered| **layered).count(), hit]
    }
}
