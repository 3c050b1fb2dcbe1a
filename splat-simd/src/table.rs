//! The kernel's table, read eight samples at a time.

use crate::lanes::{LANES, Lanes};
use splat_core::kernel::{KernelTable, Polynomials};

/// A computation over lanes and a table of the kernel.
pub trait TableKernel {
    /// What it gives.
    type Output;

    /// Runs it; see [`Kernel::run`].
    fn run<L: Lanes, T: LaneTable>(self, table: &T) -> Self::Output;
}

/// Runs one with a table: there is a copy of it for each way to read one, so that nothing is decided inside.
#[inline(always)]
pub fn with_table<L: Lanes, K: TableKernel>(table: &KernelTable, kernel: K) -> K::Output {
    match table.polynomials() {
        None => kernel.run::<L, _>(table),
        Some(polynomials) => match polynomials.degree {
            2 => kernel.run::<L, _>(&OfDegree::<2>(polynomials)),
            3 => kernel.run::<L, _>(&OfDegree::<3>(polynomials)),
            _ => kernel.run::<L, _>(&OfDegree::<4>(polynomials)),
        },
    }
}

/// A table of the kernel that lanes can read.
pub trait LaneTable {
    /// [`KernelTable::weight`] for a sample a lane; arbitrary where `missed` is set.
    fn kernel<L: Lanes>(&self, r2: L, missed: L) -> L;
}

/// Polynomials of this degree.
struct OfDegree<'a, const DEGREE: usize>(&'a Polynomials);

impl<const DEGREE: usize> LaneTable for OfDegree<'_, DEGREE> {
    #[inline(always)]
    fn kernel<L: Lanes>(&self, r2: L, _: L) -> L {
        let x = r2 * L::splat(self.0.scale);
        let bin = x.to_index();
        let coefficients = &self.0.coefficients;
        let mut value = L::look_up(&coefficients[DEGREE], bin);
        for power in (0..DEGREE).rev() {
            value = value * x + L::look_up(&coefficients[power], bin);
        }
        value
    }
}

impl LaneTable for KernelTable {
    #[inline(always)]
    fn kernel<L: Lanes>(&self, r2: L, missed: L) -> L {
        let mut values = [[0.0; LANES]; 2];
        r2.store_cell::<0>(&mut values[0]);
        if L::CELLS == 2 {
            r2.store_cell::<1>(&mut values[1]);
        }
        let misses = missed.bits();
        for (lane, value) in values.as_flattened_mut().iter_mut().enumerate().take(LANES * L::CELLS) {
            *value = if misses >> lane & 1 == 0 { self.weight(*value) } else { 0.0 };
        }
        L::load_cells(&values[0], &values[1])
    }
}
