//! Pixel filters by importance sampling: positions are drawn from the filter, so every sample weighs the same.

use std::f64::consts::TAU;

/// The filter by which a pixel averages the picture around its centre.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PixelFilter {
    /// The pixel's own square, radius 1/2.
    Box,
    /// A tent of radius 1.
    Tent,
    /// A Gaussian of standard deviation 1/2, cut off at radius 3/2.
    Gaussian,
    /// The four-term Blackman-Harris window of radius 3/2.
    BlackmanHarris,
}

impl PixelFilter {
    /// How far from the pixel's centre samples may lie, per axis, in pixels.
    pub fn radius(self) -> f64 {
        match self {
            Self::Box => 0.5,
            Self::Tent => 1.0,
            Self::Gaussian | Self::BlackmanHarris => 1.5,
        }
    }

    /// The part of the filter below `position` (in pixels from the centre, within the radius).
    pub fn cumulative(self, position: f64) -> f64 {
        match self {
            Self::Box => position + 0.5,
            Self::Tent if position < 0.0 => 0.5 * (1.0 + position) * (1.0 + position),
            Self::Tent => 1.0 - 0.5 * (1.0 - position) * (1.0 - position),
            Self::Gaussian => {
                let below = |x: f64| 0.5 * (1.0 + libm::erf(x / (GAUSSIAN_SIGMA * std::f64::consts::SQRT_2)));
                let tail = below(-self.radius());
                (below(position) - tail) / (1.0 - 2.0 * tail)
            }
            Self::BlackmanHarris => {
                // The integral of a0 - a1 cos(2 pi t) + a2 cos(4 pi t) - a3 cos(6 pi t) over [0, t], over that to 1.
                const A: [f64; 4] = [0.35875, 0.48829, 0.14128, 0.01168];
                let t = position / (2.0 * self.radius()) + 0.5;
                let wave = |k: f64| libm::sin(k * TAU * t) / (k * TAU);
                t + (-A[1] * wave(1.0) + A[2] * wave(2.0) - A[3] * wave(3.0)) / A[0]
            }
        }
    }
}

const GAUSSIAN_SIGMA: f64 = 0.5;

/// Number of steps in which a filter's cumulative function is tabulated.
const STEPS: usize = 4096;

/// Draws positions from a filter, by inverting its cumulative function.
#[derive(Debug)]
pub struct FilterSampler {
    filter: PixelFilter,
    cumulative: Vec<f64>,
}

impl FilterSampler {
    /// The sampler of a filter.
    pub fn new(filter: PixelFilter) -> Self {
        let position = |step: usize| filter.radius() * (2.0 * step as f64 / STEPS as f64 - 1.0);
        Self { filter, cumulative: (0..=STEPS).map(|step| filter.cumulative(position(step))).collect() }
    }

    /// The position, relative to the pixel's upper left corner, below which the part `value` of the filter lies;
    /// `value` in [0, 1).
    pub fn jitter(&self, value: f64) -> f32 {
        if self.filter == PixelFilter::Box {
            return value as f32;
        }
        let step = self.cumulative.partition_point(|&below| below <= value).clamp(1, STEPS);
        let [low, high] = [self.cumulative[step - 1], self.cumulative[step]];
        let fraction = ((value - low) / (high - low)).clamp(0.0, 1.0);
        let radius = self.filter.radius();
        (0.5 + radius * (2.0 * ((step - 1) as f64 + fraction) / STEPS as f64 - 1.0)) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [PixelFilter; 4] =
        [PixelFilter::Box, PixelFilter::Tent, PixelFilter::Gaussian, PixelFilter::BlackmanHarris];

    #[test]
    fn inverts_the_cumulative_function() {
        for filter in ALL {
            let sampler = FilterSampler::new(filter);
            approx::assert_abs_diff_eq!(filter.cumulative(-filter.radius()), 0.0, epsilon = 1e-12);
            approx::assert_abs_diff_eq!(filter.cumulative(filter.radius()), 1.0, epsilon = 1e-12);
            for i in 0..1000 {
                let value = f64::from(i) / 1000.0;
                let position = f64::from(sampler.jitter(value)) - 0.5;
                assert!(position.abs() <= filter.radius());
                // Linear interpolation of 4096 steps: far below the 1e-6 asked for.
                approx::assert_abs_diff_eq!(filter.cumulative(position), value, epsilon = 1e-6);
            }
        }
    }

    #[test]
    fn samples_are_centred_on_the_pixel() {
        for filter in ALL {
            let sampler = FilterSampler::new(filter);
            let mean =
                (0..4096).map(|i| f64::from(sampler.jitter((f64::from(i) + 0.5) / 4096.0))).sum::<f64>();
            approx::assert_abs_diff_eq!(mean / 4096.0, 0.5, epsilon = 1e-6);
        }
    }
}
