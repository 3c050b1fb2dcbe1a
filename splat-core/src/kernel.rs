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
    /// 8 bins, in each a polynomial of degree 4: more exact than the others, and small enough for vector registers.
    Quartic8,
    /// 8 bins, in each a polynomial of degree 2, 3 or 4: the least that keeps the error below 1e-5.
    Poly8,
}

/// Number of bins of a [`TableMode::Quartic8`] or [`TableMode::Poly8`] table.
pub const POLYNOMIAL_BINS: usize = 8;

/// Greatest degree of the polynomials.
pub const MAX_DEGREE: usize = 4;

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
    polynomials: Option<Polynomials>,
}

/// A kernel over r2 in [0, F) as a polynomial in each of [`POLYNOMIAL_BINS`] bins.
#[derive(Debug, Clone, PartialEq)]
pub struct Polynomials {
    /// From r2 to x: bin i is [i, i + 1) of x. A little less than 8/F, so that x < 8 whatever the rounding.
    pub scale: f32,
    /// Degree of the polynomials, at most [`MAX_DEGREE`].
    pub degree: usize,
    /// For each power of x, the coefficient in each bin; 0 beyond the degree.
    pub coefficients: [[f32; POLYNOMIAL_BINS]; MAX_DEGREE + 1],
}

impl Polynomials {
    /// What [`TableMode::Poly8`] keeps the error below; a tenth is left to rounding.
    const LARGEST_ERROR: f64 = 0.9e-5;

    fn new(kernel: Kernel, cutoff: f64, mode: TableMode) -> Option<Self> {
        let degree = match mode {
            TableMode::Quartic8 => MAX_DEGREE,
            TableMode::Poly8 => (2..MAX_DEGREE)
                .find(|&degree| Self::error_bound(kernel, cutoff, degree) < Self::LARGEST_ERROR)
                .unwrap_or(MAX_DEGREE),
            _ => return None,
        };
        let scale = (POLYNOMIAL_BINS as f64 / cutoff * (1.0 - 1.0 / f64::from(1 << 22))) as f32;
        // Each polynomial agrees with the kernel at the Chebyshev points of its bin.
        let count = degree + 1;
        let bins: [Vec<f64>; POLYNOMIAL_BINS] = std::array::from_fn(|bin| {
            let point = |i: usize| {
                bin as f64 + 0.5 - 0.5 * libm::cos((2.0 * i as f64 + 1.0) * PI / (2.0 * count as f64))
            };
            let points: Vec<f64> = (0..count).map(point).collect();
            let value =
                |x: &f64| kernel.value((x / f64::from(scale)).min(cutoff * (1.0 - f64::EPSILON)), cutoff);
            let values = points.iter().map(value).collect();
            interpolate(&points, values)
        });
        let coefficient = |power: usize, bin: &Vec<f64>| bin.get(power).map_or(0.0, |&value| value as f32);
        let coefficients = std::array::from_fn(|power| bins.each_ref().map(|bin| coefficient(power, bin)));
        Some(Self { scale, degree, coefficients })
    }

    /// Interpolation at n Chebyshev points of a bin of width h errs by at most (h/2)^n max |f^(n)| / (2^(n-1) n!), and the
    /// derivatives of exp(-r2/2) are at most 2^-n; the windowed kernel is it times 1 / (1 - exp(-F/2)) and a constant.
    fn error_bound(kernel: Kernel, cutoff: f64, degree: usize) -> f64 {
        let quarter = cutoff / POLYNOMIAL_BINS as f64 / 4.0;
        let gain = match kernel {
            Kernel::Gaussian => 1.0,
            Kernel::Windowed => 1.0 / (1.0 - libm::exp(-0.5 * cutoff)),
            Kernel::Disc => 0.0,
        };
        let n = degree as i32 + 1;
        (1..=n).fold(2.0 * gain, |bound, i| bound * quarter / (2.0 * f64::from(i)))
    }

    /// The weight at r2 in [0, F).
    #[inline(always)]
    fn weight(&self, r2: f32) -> f32 {
        let x = r2 * self.scale;
        // By way of i32, whose conversion is the cheapest. The remainder only matters for what is no hit.
        let bin = x as i32 as usize % POLYNOMIAL_BINS;
        let mut value = self.coefficients[self.degree % (MAX_DEGREE + 1)][bin];
        for power in (0..self.degree).rev() {
            value = value * x + self.coefficients[power][bin];
        }
        value
    }
}

/// The coefficients, by rising power, of the polynomial through some points (Newton's divided differences).
fn interpolate(points: &[f64], values: Vec<f64>) -> Vec<f64> {
    let mut differences = values;
    let count = points.len();
    for order in 1..count {
        for i in (order..count).rev() {
            differences[i] = (differences[i] - differences[i - 1]) / (points[i] - points[i - order]);
        }
    }
    // Horner's scheme over (x - points[i]), expanded.
    let mut coefficients = vec![0.0; count];
    for i in (0..count).rev() {
        for power in (1..count).rev() {
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
        let polynomials = Polynomials::new(kernel, cutoff, mode);
        Self { mode, scale: (TABLE_BINS as f64 / cutoff) as f32, bins, polynomials }
    }

    /// The polynomials, where the table is read as such.
    pub fn polynomials(&self) -> Option<&Polynomials> {
        self.polynomials.as_ref()
    }

    /// The tabulated weight at r2 in [0, F). The bin is clamped: rounding can carry it to its end (erratum E17).
    #[inline(always)]
    pub fn weight(&self, r2: f32) -> f32 {
        if let Some(polynomials) = &self.polynomials {
            return polynomials.weight(r2);
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
    fn polynomials_are_as_exact_as_their_bound() {
        // Horner's scheme over x in [0, 8) rounds each of its sums, whose terms are about 1 in all: some 1e-6 at most.
        let rounding = 1.2e-6;
        for cutoff in [0.5, 2.0, 4.0, 9.0, 12.0] {
            for kernel in KERNELS {
                for mode in [TableMode::Quartic8, TableMode::Poly8] {
                    let degree = KernelTable::new(kernel, cutoff, mode).polynomials.unwrap().degree;
                    let bound = Polynomials::error_bound(kernel, cutoff, degree);
                    let error = largest_error(kernel, cutoff, mode);
                    assert!(error <= bound + rounding, "{kernel:?} F={cutoff} {mode:?}: {error}");
                    // No looser than need be: the next lower degree would not do.
                    if mode == TableMode::Poly8 {
                        assert!(cutoff > 9.0 || error < 1e-5, "{kernel:?} F={cutoff}: {error}");
                        let lower = Polynomials::error_bound(kernel, cutoff, degree - 1);
                        assert!(degree == 2 || lower >= Polynomials::LARGEST_ERROR);
                    }
                }
            }
            assert_eq!(largest_error(Kernel::Disc, cutoff, TableMode::Poly8), 0.0);
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
            for mode in [
                TableMode::Floor256,
                TableMode::Midpoint256,
                TableMode::Lerp256,
                TableMode::Quartic8,
                TableMode::Poly8,
            ] {
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
