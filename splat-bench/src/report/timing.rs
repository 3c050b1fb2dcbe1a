//! Times: the least of several repetitions, all that is compared taking turns.

use std::time::{Duration, Instant};

/// The times of something, in milliseconds.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Times(Vec<f64>);

impl Times {
    /// Times `work` once more.
    pub fn measure<T>(&mut self, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = work();
        self.0.push(start.elapsed().as_secs_f64() * 1e3);
        result
    }

    /// Adds a time that was measured elsewhere.
    pub fn add(&mut self, time: Duration) {
        self.0.push(time.as_secs_f64() * 1e3);
    }

    /// The least, in milliseconds.
    pub fn least(&self) -> f64 {
        self.0.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// How far the median is above the least, relative to it.
    pub fn noise(&self) -> f64 {
        let mut sorted = self.0.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).map_or(0.0, |median| median / self.least() - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_counts_and_the_median_tells_the_noise() {
        let times = Times(vec![3.0, 2.0, 2.5]);
        assert_eq!(times.least(), 2.0);
        assert_eq!(times.noise(), 0.25);
    }
}
