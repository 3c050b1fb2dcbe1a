//! Deterministic random numbers: the same scene on every machine and in every run.

use glam::{DVec2, DVec3};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// A seeded stream of random numbers.
#[derive(Clone, Debug)]
pub struct Random(Pcg64Mcg);

impl Random {
    /// The stream of `seed`.
    pub fn new(seed: u64) -> Self {
        Self(Pcg64Mcg::seed_from_u64(seed))
    }

    /// Uniform in [0, 1), a multiple of 2^-53.
    pub fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform in [lo, hi).
    pub fn range(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * self.unit()
    }

    /// Log-uniform in [lo, hi); both positive.
    pub fn log_range(&mut self, lo: f64, hi: f64) -> f64 {
        lo * libm::pow(hi / lo, self.unit())
    }

    /// Uniform in 0..n (the bias is below n * 2^-53).
    pub fn index(&mut self, n: usize) -> usize {
        (self.unit() * n as f64) as usize
    }

    /// Puts things in a random order.
    pub fn shuffle<T>(&mut self, things: &mut [T]) {
        for last in (1..things.len()).rev() {
            things.swap(last, self.index(last + 1));
        }
    }

    /// Uniform in the unit disc.
    pub fn in_disc(&mut self) -> DVec2 {
        loop {
            let p = DVec2::new(self.range(-1.0, 1.0), self.range(-1.0, 1.0));
            if p.length_squared() < 1.0 {
                return p;
            }
        }
    }

    /// Uniform on the unit sphere.
    pub fn direction(&mut self) -> DVec3 {
        loop {
            let p = DVec3::new(self.range(-1.0, 1.0), self.range(-1.0, 1.0), self.range(-1.0, 1.0));
            let r2 = p.length_squared();
            if r2 > 1e-4 && r2 < 1.0 {
                return p / r2.sqrt();
            }
        }
    }

    /// A normal deviate (mean 0, variance 1), by Box and Muller.
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * libm::log(1.0 - self.unit())).sqrt();
        radius * libm::cos(std::f64::consts::TAU * self.unit())
    }
}
