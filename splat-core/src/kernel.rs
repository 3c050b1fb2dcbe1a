//! Reconstruction kernels over r2 = u^2 + v^2, and the tables that replace their exponential (L18-19, L195-196).

use std::f64::consts::PI;

/// The shape of a splat's weight. SPEC section 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kernel {
    /// exp(-r2/2), the listing's; it jumps to zero at the rim.
    Gaussian,
    /// (exp(-r2/2) - exp(-F/2)) / (1 - exp(-F/2)): continuous at the rim (erratum E19).
    Windowed,
    /// 1 inside: hard discs.
    Disc,
}

impl Kernel {
    /// The exact value at r2, for cutoff F: 0 outside of [0, F).
    pub fn value(self, r2: f64, cutoff: f64) -> f64 {
        if !(0.0..cutoff).contains(&r2) {
            return 0.0;
        }
        let rim = libm::exp(-0.5 * cutoff);
        match self {
            Self::Gaussian => libm::exp(-0.5 * r2),
            Self::Windowed => (libm::exp(-0.5 * r2) - rim) / (1.0 - rim),
            Self::Disc => 1.0,
        }
    }

    /// The integral of the kernel over u^2 + v^2 < F: notes 2.4.
    pub fn integral(self, cutoff: f64) -> f64 {
        let rim = libm::exp(-0.5 * cutoff);
        match self {
            Self::Gaussian => 2.0 * PI * (1.0 - rim),
            Self::Windowed => (2.0 * PI * (1.0 - rim) - PI * cutoff * rim) / (1.0 - rim),
            Self::Disc => PI * cutoff,
        }
    }
}

/// How the table is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TableMode {
    /// 256 entries, each the value at its bin's near edge: the listing's; biased high by 2e-3 (erratum E18).
    Floor256,
    /// 256 entries, each the value at its bin's middle.
    Midpoint256,
    /// 256 bins, interpolated linearly.
    Lerp256,
    /// 8 bins, in each a polynomial of degree 4: more exact than the others, and small enough for a vector register.
    Quartic8,
}

/// Number of bins of a [`TableMode::Quartic8`] table.
pub const QUARTIC_BINS: usize = 8;

/// Number of bins of a table over [0, F).
pub const TABLE_BINS: usize = 256;

/// A kernel, tabulated over r2 in [0, F).
#[derive(Debug, Clone, PartialEq)]
pub struct KernelTable {
    mode: TableMode,
    /// Bins per unit of r2 (`exptablescale`, L34).
    scale: f32,
    /// Value at the start of each bin (for `Midpoint256`, at its middle), and the step to the next.
    bins: Box<[[f32; 2]; TABLE_BINS]>,
    quartic: Quartic,
}

/// A kernel over r2 in [0, F) as [`QUARTIC_BINS`] polynomials of degree 4.
#[derive(Debug, Clone, PartialEq)]
pub struct Quartic {
    /// Bins per unit of r2.
    pub scale: f32,
    /// For each power of the position within the bin, the coefficient in each bin.
    pub coefficients: [[f32; QUARTIC_BINS]; 5],
}

impl Quartic {
    /// Each polynomial agrees with the kernel at the five Chebyshev points of its bin.
    fn new(kernel: Kernel, cutoff: f64) -> Self {
        let bin_width = cutoff / QUARTIC_BINS as f64;
        let points: [f64; 5] =
            std::array::from_fn(|i| 0.5 - 0.5 * libm::cos((2.0 * i as f64 + 1.0) * PI / 10.0));
        let bins: [[f64; 5]; QUARTIC_BINS] = std::array::from_fn(|bin| {
            interpolate(points, points.map(|t| kernel.value((bin as f64 + t) * bin_width, cutoff)))
        });
        let coefficients = std::array::from_fn(|power| bins.map(|bin| bin[power] as f32));
        Self { scale: (QUARTIC_BINS as f64 / cutoff) as f32, coefficients }
    }

    /// The weight at r2 >= 0.
    #[inline(always)]
    fn weight(&self, r2: f32) -> f32 {
        let position = r2 * self.scale;
        // By way of i32, whose conversion is the cheapest.
        let bin = (position as i32).min(QUARTIC_BINS as i32 - 1) as usize;
        let t = position - bin as f32;
        let c = &self.coefficients;
        (((c[4][bin] * t + c[3][bin]) * t + c[2][bin]) * t + c[1][bin]) * t + c[0][bin]
    }
}

/// The coefficients, by rising power, of the polynomial through five points (Newton's divided differences).
fn interpolate(points: [f64; 5], values: [f64; 5]) -> [f64; 5] {
    let mut differences = values;
    for order in 1..5 {
        for i in (order..5).rev() {
            differences[i] = (differences[i] - differences[i - 1]) / (points[i] - points[i - order]);
        }
    }
    // Horner's scheme over (t - points[i]), expanded.
    let mut coefficients = [0.0; 5];
    for i in (0..5).rev() {
        for power in (1..5).rev() {
            coefficients[power] = coefficients[power - 1] - points[i] * coefficients[power];
        }
        coefficients[0] = differences[i] - points[i] * coefficients[0];
    }
    coefficients
}

impl KernelTable {
    /// The table of a kernel with cutoff F.
    pub fn new(kernel: Kernel, cutoff: f64, mode: TableMode) -> Self {
        let bin_width = cutoff / TABLE_BINS as f64;
        let shift = if mode == TableMode::Midpoint256 { 0.5 } else { 0.0 };
        // Just below the edge, since the last bin ends at the rim, where every kernel is 0.
        let value =
            |bin: usize| kernel.value((bin as f64 + shift) * bin_width * (1.0 - f64::EPSILON), cutoff);
        let mut bins = Box::new([[0.0; 2]; TABLE_BINS]);
        for (bin, entry) in bins.iter_mut().enumerate() {
            let step = if mode == TableMode::Lerp256 { value(bin + 1) - value(bin) } else { 0.0 };
            *entry = [value(bin) as f32, step as f32];
        }
        let quartic = Quartic::new(kernel, cutoff);
        Self { mode, scale: (TABLE_BINS as f64 / cutoff) as f32, bins, quartic }
    }

    /// The polynomials, where the table is read as such.
    pub fn quartic(&self) -> Option<&Quartic> {
        (self.mode == TableMode::Quartic8).then_some(&self.quartic)
    }

    /// The tabulated weight at r2 >= 0. The bin is clamped: rounding can carry r2 to F itself (erratum E17).
    #[inline(always)]
    pub fn weight(&self, r2: f32) -> f32 {
        if self.mode == TableMode::Quartic8 {
            return self.quartic.weight(r2);
        }
        let position = r2 * self.scale;
        let bin = (position as i32).min(TABLE_BINS as i32 - 1) as usize;
        let [start, step] = self.bins[bin];
        if self.mode == TableMode::Lerp256 { start + (position - bin as f32) * step } else { start }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KERNELS: [Kernel; 3] = [Kernel::Gaussian, Kernel::Windowed, Kernel::Disc];

    /// The largest error of a table over 10^6 values of r2 below F.
    fn largest_error(kernel: Kernel, cutoff: f64, mode: TableMode) -> f64 {
        let table = KernelTable::new(kernel, cutoff, mode);
        (0..1_000_000)
            .map(|i| (i as f64 / 1e6 * cutoff) as f32)
            .filter(|&r2| f64::from(r2) < cutoff)
            .map(|r2| (f64::from(table.weight(r2)) - kernel.value(r2.into(), cutoff)).abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn errors_are_those_of_the_derivation() {
        // floor: slope 1/2 times the bin; midpoint: half of that; lerp: second derivative 1/4 times bin^2 / 8.
        // The windowed kernel divides all of them by 1 - exp(-F/2). Each gets 1e-7 for rounding to f32.
        for cutoff in [2.0, 4.0, 9.0] {
            let bin = cutoff / 256.0;
            for (kernel, gain) in
                [(Kernel::Gaussian, 1.0), (Kernel::Windowed, 1.0 / (1.0 - libm::exp(-cutoff / 2.0)))]
            {
                let bounds = [
                    (TableMode::Floor256, 0.5 * bin),
                    (TableMode::Midpoint256, 0.25 * bin),
                    (TableMode::Lerp256, 0.25 * bin * bin / 8.0),
                ];
                for (mode, bound) in bounds {
                    let error = largest_error(kernel, cutoff, mode);
                    let bound = gain * bound + 1.5e-7;
                    assert!(error <= bound, "{kernel:?} F={cutoff} {mode:?}: {error} > {bound}");
                    assert!(
                        error >= 0.9 * (bound - 1.5e-7),
                        "{kernel:?} F={cutoff} {mode:?}: {error} << {bound}"
                    );
                }
            }
            assert_eq!(largest_error(Kernel::Disc, cutoff, TableMode::Lerp256), 0.0);
        }
    }

    #[test]
    fn the_quartic_is_exact_to_a_millionth() {
        // Interpolation at n = 5 Chebyshev points of a bin of width h errs by at most (h/2)^5 |f^(5)| / (2^4 5!), and the
        // fifth derivative of exp(-r2/2) is at most 1/32. Horner's scheme in f32 adds some 3e-7.
        for (cutoff, bound) in [(2.0f64, 4e-7), (4.0, 4e-7), (9.0, 1.3e-6)] {
            for kernel in [Kernel::Gaussian, Kernel::Windowed] {
                let error = largest_error(kernel, cutoff, TableMode::Quartic8);
                let half = cutoff / 16.0;
                let exact = half * half * half * half * half / 32.0 / 1920.0;
                let gain = kernel.value(0.0, cutoff) / (1.0 - libm::exp(-cutoff / 2.0));
                assert!(bound >= exact * gain, "{cutoff}");
                assert!(error <= bound, "{kernel:?} F={cutoff}: {error}");
            }
            assert_eq!(largest_error(Kernel::Disc, cutoff, TableMode::Quartic8), 0.0);
        }
    }

    #[test]
    fn the_listings_table_is_reproduced() {
        // exptable[i] = exp(-0.5 F i / size), L19, read at floor(r2 size / F), L195-196.
        let table = KernelTable::new(Kernel::Gaussian, 2.0, TableMode::Floor256);
        for i in 0..256 {
            let expected = libm::exp(-0.5 * 2.0 * i as f64 / 256.0) as f32;
            approx::assert_relative_eq!(
                table.weight((i as f32 + 0.5) * 2.0 / 256.0),
                expected,
                max_relative = 1e-7
            );
        }
    }

    #[test]
    fn the_bin_is_clamped_at_the_rim() {
        for kernel in KERNELS {
            for mode in [TableMode::Floor256, TableMode::Midpoint256, TableMode::Lerp256, TableMode::Quartic8]
            {
                let table = KernelTable::new(kernel, 3.0, mode);
                for r2 in [3.0, 3.0f32.next_up(), 1e30] {
                    assert!(!table.weight(r2).is_nan(), "{kernel:?} {mode:?} {r2}");
                }
            }
        }
    }

    #[test]
    fn integrals_match_quadrature() {
        for kernel in KERNELS {
            for cutoff in [0.5, 2.0, 4.0, 9.0] {
                // dA = pi d(r2); midpoint rule with an error of about (F/n)^2.
                let n = 20_000;
                let step = cutoff / f64::from(n);
                let sum: f64 = (0..n).map(|i| kernel.value((f64::from(i) + 0.5) * step, cutoff)).sum();
                approx::assert_relative_eq!(sum * step * PI, kernel.integral(cutoff), max_relative = 1e-7);
            }
        }
    }
}
