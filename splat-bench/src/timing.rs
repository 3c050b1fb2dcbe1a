//! Times: the least of several repetitions, all that is compared taking turns.

use std::hint::black_box;
use std::time::{Duration, Instant};

/// The times of something, in milliseconds.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Times(Vec<f64>);

/// What takes less is timed [`MORE`] times a turn: its times are the noisiest, and cost the least.
const SHORT: Duration = Duration::from_millis(10);
const MORE: usize = 4;

impl Times {
    /// Times `work` once more; where it is short, some times more.
    pub fn measure<T>(&mut self, mut work: impl FnMut() -> T) -> T {
        let mut result = self.once(&mut work);
        if self.0.last().is_some_and(|&time| time < SHORT.as_secs_f64() * 1e3) {
            for _ in 1..MORE {
                result = self.once(&mut work);
            }
        }
        result
    }

    fn once<T>(&mut self, work: &mut impl FnMut() -> T) -> T {
        // Lest the compiler sees that it is the same work again, and does it once.
        let work = black_box(work);
        let start = Instant::now();
        let result = black_box(work());
        self.add(start.elapsed());
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

    #[test]
    fn what_is_short_is_timed_more_often() {
        let mut times = Times::default();
        let mut count = 0;
        times.measure(|| count += 1);
        assert_eq!((count, times.0.len()), (MORE, MORE));
        times.measure(|| std::thread::sleep(SHORT));
        assert_eq!(times.0.len(), MORE + 1);
    }
}
