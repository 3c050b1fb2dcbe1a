//! Sizes from the local spacing of the points.

use super::local::Local;
use super::neighbors::Neighbors;
use std::f64::consts::PI;

/// Size of a splat in a cloud that tells nothing about spacing.
const LONE_SIZE: f32 = 1.0;

/// The spacing of a surface whose `count` nearest points reach to this distance: they share an area of pi d^2.
pub fn spacing(distance: f64, count: usize) -> f64 {
    distance * (PI / count.max(1) as f64).sqrt()
}

/// The size of the splats of each place: its spacing, but at most [`CAP`] times the median of its nearest places' spacings.
///
/// So neither a point far from all others nor the rim of a surface, whose neighbours lie on one side, gets a large disc.
pub fn estimate(neighbors: &Neighbors, locals: &[Local]) -> Vec<f32> {
    let cap = std::env::var("SPLAT_CAP").map_or(CAP, |cap| cap.parse().unwrap());
    let size = |place: usize| {
        let own = locals[place].spacing;
        if own == 0.0 {
            return LONE_SIZE;
        }
        let mut others: Vec<f32> = locals[place].nearest().map(|other| locals[other].spacing).collect();
        let middle = others.len() / 2;
        let (_, median, _) = others.select_nth_unstable_by(middle, f32::total_cmp);
        own.min(cap * *median)
    };
    neighbors.map(&mut |_| {}, size)
}

/// How much larger than its neighbours a splat may be.
const CAP: f32 = 1.5;
