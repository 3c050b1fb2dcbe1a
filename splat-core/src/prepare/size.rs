//! Sizes from the local spacing of the points.

use super::Neighbors;
use std::f64::consts::PI;

/// The neighbour whose distance tells the spacing.
const NEIGHBOR: usize = 8;

/// Size of a splat in a cloud that tells nothing about spacing.
const LONE_SIZE: f32 = 1.0;

/// Replaces every size of 0 by one spacing.
///
/// If the k-th neighbour is at distance d, k points share an area of pi d^2: a spacing of d sqrt(pi / k). With sigma
/// equal to the spacing the windowed kernel of F = 4 leaves no hole in an evenly sampled surface (notes 2.4). Where k
/// points coincide, the median of the other sizes is taken.
pub fn estimate(sizes: &mut [f32], neighbors: &Neighbors) {
    let mut unknown = Vec::new();
    let mut known = Vec::new();
    for (index, point) in neighbors.points().filter(|&(index, _)| sizes[index] == 0.0) {
        let spacing = (neighbors.distance_to(point, NEIGHBOR) * (PI / NEIGHBOR as f64).sqrt()) as f32;
        if spacing > 0.0 {
            known.push((index, spacing));
        } else {
            unknown.push(index);
        }
    }
    let middle = known.len() / 2;
    let median = if known.is_empty() {
        LONE_SIZE
    } else {
        known.select_nth_unstable_by(middle, |a, b| a.1.total_cmp(&b.1)).1.1
    };
    known.into_iter().chain(unknown.into_iter().map(|index| (index, median))).for_each(|(index, size)| {
        sizes[index] = size;
    });
}
