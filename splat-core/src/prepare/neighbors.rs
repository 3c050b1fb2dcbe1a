//! Which points are near which.

use crate::Cloud;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use std::num::NonZero;

/// The finite points of a cloud, ready to be searched.
pub struct Neighbors {
    /// Cloud index of each point of the tree.
    indices: Vec<u32>,
    points: Vec<[f64; 3]>,
    tree: Option<ImmutableKdTree<f64, 3>>,
}

impl Neighbors {
    /// Sorts a cloud's finite points into a tree.
    pub fn new(cloud: &Cloud) -> Self {
        let finite = (0..cloud.len()).filter(|&index| cloud.positions[index].is_finite());
        let indices: Vec<u32> = finite.map(|index| index as u32).collect();
        let position = |&index: &u32| cloud.positions[index as usize].as_dvec3().to_array();
        let points: Vec<[f64; 3]> = indices.iter().map(position).collect();
        // No tree of no points; the constructor's only other failure is a count beyond its index type.
        let tree = if points.is_empty() { None } else { ImmutableKdTree::new_from_slice(&points).ok() };
        Self { indices, points, tree }
    }

    /// The finite points: their cloud index and their offset from the cloud's origin.
    pub fn points(&self) -> impl Iterator<Item = (usize, [f64; 3])> {
        self.indices.iter().map(|&index| index as usize).zip(self.points.iter().copied())
    }

    /// Distance to the `count`-th nearest other point (or to the farthest, if there are fewer); 0 without others.
    pub fn distance_to(&self, point: [f64; 3], count: usize) -> f64 {
        let Some(tree) = &self.tree else { return 0.0 };
        // The point itself is the nearest.
        let wanted = NonZero::new(count + 1).expect("a count plus one is not zero");
        let found = tree.query(&point).nearest_n::<SquaredEuclidean<f64>>(wanted).execute();
        found.last().map_or(0.0, |farthest| farthest.distance.sqrt())
    }

    /// The cloud indices of the points within `radius`, in no useful order.
    pub fn within(&self, point: [f64; 3], radius: f64) -> impl Iterator<Item = usize> {
        let found = self.tree.as_ref().map(|tree| {
            tree.query(&point).within::<SquaredEuclidean<f64>>(radius * radius).unsorted().execute()
        });
        found.into_iter().flatten().map(|neighbor| self.indices[neighbor.item as usize] as usize)
    }
}
