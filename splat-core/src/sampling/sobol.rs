//! Sobol's sequence in two dimensions, Owen-scrambled: Sobol 1967, Owen 1995.

use rand_pcg::Pcg32;
use rand_pcg::rand_core::Rng;

/// Number of binary digits of a coordinate; all of them are exact in `f32`.
const DIGITS: u32 = 24;

/// The first `samples` points, randomised so that every pattern is a different net of the same evenness.
pub fn pattern(samples: usize, random: &mut Pcg32) -> Vec<[f64; 2]> {
    let seeds = [random.next_u32(), random.next_u32()];
    (0..samples as u32)
        .map(|index| {
            let point = [first_dimension(index), second_dimension(index)];
            [0, 1].map(|axis| {
                let scrambled = owen_scramble(point[axis], seeds[axis]);
                f64::from(scrambled >> (32 - DIGITS)) / f64::from(1u32 << DIGITS)
            })
        })
        .collect()
}

/// Van der Corput's sequence, as a binary fraction.
fn first_dimension(index: u32) -> u32 {
    index.reverse_bits()
}

/// The second dimension of Sobol's sequence, as a binary fraction: direction numbers v(i+1) = v(i) ^ (v(i) >> 1).
fn second_dimension(index: u32) -> u32 {
    let directions = std::iter::successors(Some(1u32 << 31), |v| Some(v ^ (v >> 1)));
    let digits = directions.enumerate().take_while(|&(i, _)| i < 32 && index >> i != 0);
    digits.filter(|&(i, _)| index >> i & 1 == 1).fold(0, |sum, (_, direction)| sum ^ direction)
}

/// Nested uniform scrambling: each digit is flipped or not by a random choice that depends on the digits above it.
fn owen_scramble(value: u32, seed: u32) -> u32 {
    (0..DIGITS).fold(value, |scrambled, digit| {
        let above = if digit == 0 { 0 } else { value >> (32 - digit) };
        let flip = hash(above, hash(digit, seed)) & 1;
        scrambled ^ flip << (31 - digit)
    })
}

/// A hash in which every bit of the input moves every bit of the output (the finaliser of MurmurHash3).
fn hash(value: u32, seed: u32) -> u32 {
    let mut h = value.wrapping_mul(0x9E37_79B9) ^ seed;
    h = (h ^ h >> 16).wrapping_mul(0x85EB_CA6B);
    h = (h ^ h >> 13).wrapping_mul(0xC2B2_AE35);
    h ^ h >> 16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Stream;

    #[test]
    fn every_elementary_interval_holds_one_point() {
        // A (0, m, 2)-net in base 2: each of the 2^m boxes of size 2^-k x 2^(k-m) holds exactly one of 2^m points.
        for m in 0..=6u32 {
            for seed in 0..4 {
                let points = pattern(1 << m, &mut Stream::LensPoints.generator(seed));
                for k in 0..=m {
                    let mut boxes: Vec<(u32, u32)> = points
                        .iter()
                        .map(|p| ((p[0] * f64::from(1 << k)) as u32, (p[1] * f64::from(1 << (m - k))) as u32))
                        .collect();
                    boxes.sort_unstable();
                    boxes.dedup();
                    assert_eq!(boxes.len(), 1 << m, "m {m}, k {k}, seed {seed}");
                }
            }
        }
    }

    #[test]
    fn scrambling_moves_every_digit_evenly() {
        // The mean of 4096 points of one index over seeds is 1/2 within 5 standard deviations (1/sqrt(12 n)).
        let n = 4096;
        for index in [0, 1, 5] {
            let mean = (0..n)
                .map(|seed| {
                    f64::from(owen_scramble(first_dimension(index), hash(seed, 1)))
                        / (u64::from(u32::MAX) + 1) as f64
                })
                .sum::<f64>()
                / f64::from(n);
            assert!((mean - 0.5).abs() < 5.0 / (12.0 * f64::from(n)).sqrt(), "{index}: {mean}");
        }
    }
}
