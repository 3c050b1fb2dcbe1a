//! One scrambled net for all patterns, dealt out so that each is as even as it can be.
//!
//! Let an edge be a straight line of any direction, anywhere. What the share of a pattern's points on one side of it is off
//! by, squared and integrated over all edges, is up to a constant the *energy distance* of the pattern and the density
//! from which it is drawn (Szekely and Rizzo 2013): with X, X' points of the pattern and Y, Y' drawn from the density,
//! 2 E|X - Y| - E|X - X'| - E|Y - Y'|. Over all patterns together the first term depends on all points alone, whatever
//! pattern has which, and the last one on none. So the mean square error of edges is the least where the points of each
//! pattern are farthest from each other in the sum. Points that minimise the distance pattern by pattern (Mak and Joseph
//! 2018) have still less error, but all avoid the same places, and so no mean over patterns would be right.

use super::{PATTERNS, below, shuffle, sobol};
use rand_pcg::Pcg32;

/// Rounds of proposed swaps, times the number of samples of a pattern: so the time grows as that of a picture does.
/// Twice as many lower the error by half a percent.
const ROUNDS: usize = 400;

/// How far apart, in the order of [`z_order`], the two points of a proposed swap are at most. Near ones are worth a swap
/// far more often than any two.
const REACH: usize = 32;

/// A sum of distances (of some units) must grow by this, lest rounding makes points go to and fro.
const LEAST_GAIN: f32 = 1e-5;

/// [`PATTERNS`] patterns of `samples` points each, one after the other, where `place` puts the points of the unit square.
pub fn patterns(samples: usize, place: impl Fn([f64; 2]) -> [f32; 2], random: &mut Pcg32) -> Vec<[f32; 2]> {
    // As many consecutive points as a pattern has are about as even as the whole, and a net themselves if they are 2^m.
    let net = sobol::pattern(PATTERNS * samples, random);
    let mut places: Vec<[f32; 2]> = net.iter().map(|&point| place(point)).collect();
    let rounds = if samples == 1 { 0 } else { ROUNDS / samples };
    if rounds > 0 {
        let mut order: Vec<usize> = (0..net.len()).collect();
        order.sort_by_key(|&i| z_order(net[i]));
        for _ in 0..rounds {
            swap_neighbors(&mut places, &mut order, samples, random);
        }
    }
    // The net puts the first points of all patterns near each other: then some of the samples would be no mean of all.
    places.chunks_mut(samples).for_each(|pattern| shuffle(pattern, random));
    places
}

/// Proposes to swap each point with one that is near it, and does where that increases the distances within the two
/// patterns. `order` has the places of neighbours near each other.
fn swap_neighbors(places: &mut [[f32; 2]], order: &mut [usize], samples: usize, random: &mut Pcg32) {
    for here in 0..order.len() {
        let there = (here + 1 + below(REACH, random)) % order.len();
        let [first, second] = [order[here], order[there]];
        if first / samples != second / samples && gain(places, samples, first, second) > LEAST_GAIN {
            places.swap(first, second);
            order.swap(here, there);
        }
    }
}

/// What the sum of the distances within two patterns grows by if these points of theirs are swapped.
fn gain(places: &[[f32; 2]], samples: usize, first: usize, second: usize) -> f32 {
    let pattern_of = |point: usize| &places[point / samples * samples..][..samples];
    let (a, b) = (places[first], places[second]);
    // Four sums side by side, which is one vector: new and old ones, each of two patterns.
    let mut sums = [0.0f32; 4];
    for (&p, &q) in pattern_of(first).iter().zip(pattern_of(second)) {
        let distances = [distance(p, b), distance(q, a), distance(p, a), distance(q, b)];
        sums.iter_mut().zip(distances).for_each(|(sum, distance)| *sum += distance);
    }
    // The new sums hold the distance to the point that leaves.
    (sums[0] - sums[2]) + (sums[1] - sums[3]) - 2.0 * distance(a, b)
}

fn distance(a: [f32; 2], b: [f32; 2]) -> f32 {
    let [x, y] = [a[0] - b[0], a[1] - b[1]];
    (x * x + y * y).sqrt()
}

/// The place of a point of the unit square on a curve that visits each quarter of a square before the next (Morton 1966).
fn z_order(point: [f64; 2]) -> u32 {
    let [x, y] = point.map(|value| (value * 65536.0) as u32);
    (0..16).fold(0, |sum, digit| sum | (x >> digit & 1) << (2 * digit) | (y >> digit & 1) << (2 * digit + 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Stream, unit};

    fn generator(seed: u64) -> Pcg32 {
        Stream::FilterPoints.generator(seed)
    }

    #[test]
    fn all_points_of_the_net_are_dealt() {
        for samples in [1, 3, 8, 64] {
            let place = |point: [f64; 2]| point.map(|value| value as f32);
            let sorted = |mut points: Vec<[f32; 2]>| {
                points.sort_by_key(|point| point.map(f32::to_bits));
                points
            };
            let net = sobol::pattern(PATTERNS * samples, &mut generator(5)).into_iter().map(place).collect();
            assert_eq!(sorted(patterns(samples, place, &mut generator(5))), sorted(net), "{samples}");
        }
    }

    /// Mean square of what patterns say less the truth, over random edges through the unit square.
    fn edge_error(patterns: &[[f32; 2]], samples: usize) -> f64 {
        let mut random = generator(77);
        let mut sum = 0.0;
        let edges = 400;
        for _ in 0..edges {
            let angle = std::f64::consts::TAU * unit(&mut random);
            let normal = [libm::cos(angle), libm::sin(angle)];
            let offset = 1.4 * (unit(&mut random) - 0.5);
            let inside = |x: f64, y: f64| (x - 0.5) * normal[0] + (y - 0.5) * normal[1] < offset;
            let grid = (0..64 * 64)
                .filter(|i| inside(f64::from(i % 64) / 64.0 + 0.0078, f64::from(i / 64) / 64.0 + 0.0078));
            let truth = grid.count() as f64 / 4096.0;
            for pattern in patterns.chunks(samples) {
                let count = pattern.iter().filter(|p| inside(f64::from(p[0]), f64::from(p[1]))).count();
                let error = count as f64 / samples as f64 - truth;
                sum += error * error;
            }
        }
        sum / f64::from(edges) / (patterns.len() / samples) as f64
    }

    #[test]
    fn edges_have_less_error_than_by_separate_nets() {
        let place = |point: [f64; 2]| point.map(|value| value as f32);
        // On the unit square, errors at 8 and 16 samples are about 1/1.05 and 1/1.12 of those of separate nets.
        for (samples, least) in [(3, 1.1), (8, 1.02), (16, 1.05)] {
            let mut random = generator(9);
            let separate: Vec<[f32; 2]> =
                (0..PATTERNS).flat_map(|_| sobol::pattern(samples, &mut random)).map(place).collect();
            let dealt = patterns(samples, place, &mut generator(9));
            let ratio = (edge_error(&separate, samples) / edge_error(&dealt, samples)).sqrt();
            assert!(ratio > least, "{samples}: {ratio}");
        }
    }

    #[test]
    fn each_sample_is_anywhere() {
        // The mean place of a sample over all patterns: 1/2 within five deviations, 1/sqrt(12 n). In the net's own order the
        // first sample of every pattern is in the same strip.
        let samples = 8;
        let points = patterns(samples, |point| point.map(|value| value as f32), &mut generator(4));
        for sample in 0..samples {
            for axis in 0..2 {
                let values = points.iter().skip(sample).step_by(samples).map(|point| f64::from(point[axis]));
                let mean = values.sum::<f64>() / PATTERNS as f64;
                assert!((mean - 0.5).abs() < 5.0 / (12.0 * PATTERNS as f64).sqrt(), "{sample}: {mean}");
            }
        }
    }

    #[test]
    fn a_gain_is_what_distances_grow_by() {
        let place = |point: [f64; 2]| point.map(|value| value as f32);
        let samples = 5;
        let mut places: Vec<[f32; 2]> =
            sobol::pattern(3 * samples, &mut generator(1)).into_iter().map(place).collect();
        let total = |places: &[[f32; 2]]| -> f32 {
            let within = |pattern: &[[f32; 2]]| -> f32 {
                (0..samples).flat_map(|i| (0..i).map(move |j| distance(pattern[i], pattern[j]))).sum()
            };
            places.chunks(samples).map(within).sum()
        };
        for (first, second) in [(0, 5), (3, 14), (12, 6)] {
            let (before, gain) = (total(&places), gain(&places, samples, first, second));
            places.swap(first, second);
            approx::assert_abs_diff_eq!(total(&places) - before, gain, epsilon = 1e-5);
        }
    }
}
