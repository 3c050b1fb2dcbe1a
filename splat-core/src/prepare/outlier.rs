//! Points that belong to no surface.

use super::neighbors::Neighbors;
use crate::Cloud;

/// Which points are taken for stray ones, and dropped. Points that coincide count as one.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Outliers {
    /// None.
    #[default]
    Keep,
    /// Those whose mean distance to their nearest `neighbors` is above the mean of all these by more than `sigmas` standard
    /// deviations (Rusu et al. 2008).
    Statistical {
        /// Number of neighbours, at least 1.
        neighbors: usize,
        /// Standard deviations.
        sigmas: f64,
    },
    /// Those that have fewer than `count` others within `radius`.
    Radius {
        /// In scene units.
        radius: f64,
        /// Number of neighbours, at least 1.
        count: usize,
    },
}

/// Marks the outliers of a cloud, and returns how many points that are.
pub fn mark(cloud: &mut Cloud, outliers: Outliers, progress: &mut dyn FnMut(f64)) -> usize {
    if outliers == Outliers::Keep {
        return 0;
    }
    let neighbors = Neighbors::new(cloud);
    let is_outlier = match outliers {
        Outliers::Keep => Vec::new(),
        Outliers::Statistical { neighbors: count, sigmas } => far_ones(&neighbors, count, sigmas, progress),
        Outliers::Radius { radius, count } => neighbors.map(progress, |place| {
            let found = neighbors.nearest(place, count);
            found.len() < count
                || found.last().is_some_and(|&other| neighbors.distance(place, other) > radius)
        }),
    };
    let mut marks = vec![false; cloud.len()];
    let places = (0..neighbors.len()).filter(|&place| is_outlier[place]);
    places.flat_map(|place| neighbors.members(place)).for_each(|index| marks[index] = true);
    let marked = marks.iter().filter(|&&mark| mark).count();
    cloud.outliers = (marked > 0).then_some(marks);
    marked
}

/// For each place, whether its neighbours are unusually far.
fn far_ones(neighbors: &Neighbors, count: usize, sigmas: f64, progress: &mut dyn FnMut(f64)) -> Vec<bool> {
    let distances = neighbors.map(progress, |place| {
        let found = neighbors.nearest(place, count);
        found.iter().map(|&other| neighbors.distance(place, other)).sum::<f64>() / found.len().max(1) as f64
    });
    // Summed by one task, in the order of places.
    let number = distances.len().max(1) as f64;
    let mean = distances.iter().sum::<f64>() / number;
    let variance =
        distances.iter().map(|distance| (distance - mean) * (distance - mean)).sum::<f64>() / number;
    let limit = mean + sigmas * variance.sqrt();
    distances.into_iter().map(|distance| distance > limit).collect()
}
