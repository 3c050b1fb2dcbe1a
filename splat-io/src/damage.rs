//! Damage to files, for tests.

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

/// A seeded source of damage.
pub(crate) struct Random(Pcg64Mcg);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(Pcg64Mcg::seed_from_u64(seed))
    }

    fn below(&mut self, n: usize) -> usize {
        (self.0.next_u64() % n as u64) as usize
    }

    /// The bytes with one to four of them changed: a bit flipped, or all of it replaced.
    pub fn damaged(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut damaged = bytes.to_vec();
        for _ in 0..=self.below(4) {
            let at = self.below(bytes.len());
            damaged[at] = match self.below(4) {
                0 => 0xff,
                1 => 0,
                2 => self.0.next_u64() as u8,
                _ => damaged[at] ^ (1 << self.below(8)),
            };
        }
        damaged
    }
}
