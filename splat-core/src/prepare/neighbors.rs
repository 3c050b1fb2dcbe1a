//! Which points are near which.

use crate::Cloud;
use glam::{DVec3, Vec3};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;
use std::cmp::Ordering;
use std::num::NonZero;
use std::ops::Range;

/// The distinct places of a cloud's points, ready to be searched.
///
/// Places are sorted along a Morton curve: so nothing depends on the order of the points in the file, and what is near in
/// space is near in memory. Points that coincide are one place: they tell nothing about spacing or surface.
pub struct Neighbors {
    /// Offset of each place from the cloud's origin.
    places: Vec<[f64; 3]>,
    /// Cloud indices, by place; those of one place by normal.
    members: Vec<u32>,
    /// Where the members of each place start, and the number of all at the end.
    starts: Vec<u32>,
    /// Of the places as [`turned`] has them.
    tree: Option<ImmutableKdTree<f64, 3>>,
}

/// Places done in parallel between two reports of progress.
pub const BLOCK: usize = 1 << 14;

impl Neighbors {
    /// Sorts a cloud's finite points, outliers left out, into a tree.
    pub fn new(cloud: &Cloud) -> Self {
        let members = sorted(cloud);
        let mut places: Vec<[f64; 3]> = Vec::with_capacity(members.len());
        let mut starts = Vec::with_capacity(members.len() + 1);
        for (rank, &index) in members.iter().enumerate() {
            let place = cloud.positions[index as usize].as_dvec3().to_array();
            if places.last() != Some(&place) {
                places.push(place);
                starts.push(rank as u32);
            }
        }
        starts.push(members.len() as u32);
        // No tree of no points; the constructor's only other failure is a count beyond its index type.
        let turned: Vec<[f64; 3]> = places.iter().map(|&place| turned(place)).collect();
        let tree = if places.is_empty() { None } else { ImmutableKdTree::new_from_slice(&turned).ok() };
        Self { places, members, starts, tree }
    }

    /// Number of places.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Offset of a place from the cloud's origin.
    pub fn place(&self, place: usize) -> DVec3 {
        self.places[place].into()
    }

    /// The cloud indices of the points of a place; at least one.
    pub fn members(&self, place: usize) -> impl Iterator<Item = usize> {
        let range = self.starts[place] as usize..self.starts[place + 1] as usize;
        self.members[range].iter().map(|&index| index as usize)
    }

    /// Distance between two places.
    pub fn distance(&self, a: usize, b: usize) -> f64 {
        self.place(a).distance(self.place(b))
    }

    /// The `count` nearest other places, the nearest first; fewer if there are fewer.
    pub fn nearest(&self, place: usize, count: usize) -> Vec<usize> {
        let (Some(tree), Some(wanted)) = (&self.tree, NonZero::new(count.saturating_add(1).min(self.len())))
        else {
            return Vec::new();
        };
        let found =
            tree.query(&turned(self.places[place])).nearest_n::<SquaredEuclidean<f64>>(wanted).execute();
        let others = found.into_iter().map(|found| found.item as usize);
        others.filter(|&other| other != place).take(count).collect()
    }

    /// The places within `radius` of a place, itself among them, in no useful order; and perhaps some that are farther by
    /// rounding.
    pub fn within(&self, place: usize, radius: f64) -> impl Iterator<Item = usize> {
        let found = self.tree.as_ref().map(|tree| {
            let centre = turned(self.places[place]);
            let query = tree.query(&centre);
            query.within::<SquaredEuclidean<f64>>(radius * radius * (1.0 + ROUNDING)).unsorted().execute()
        });
        found.into_iter().flatten().map(|neighbor| neighbor.item as usize)
    }

    /// What `function` makes of every place, computed in parallel. `progress` is told the share done, 0 to 1.
    pub fn map<T: Send>(
        &self,
        progress: &mut dyn FnMut(f64),
        function: impl Fn(usize) -> T + Send + Sync,
    ) -> Vec<T> {
        let mut results = Vec::with_capacity(self.len());
        for block in self.blocks() {
            results.par_extend(block.clone().into_par_iter().map(&function));
            progress(block.end as f64 / self.len() as f64);
        }
        results
    }

    /// The places in blocks, each enough for all threads.
    pub fn blocks(&self) -> impl Iterator<Item = Range<usize>> + use<> {
        let len = self.len();
        (0..len).step_by(BLOCK).map(move |start| start..(start + BLOCK).min(len))
    }
}

/// Relative error, much exaggerated, of squared distances between turned places.
const ROUNDING: f64 = 1e-9;

/// A place in axes that are turned against those of the scene. Else walls, floors and water would lie in one plane of the
/// tree's axes, in which it could not split them: searches took four times as long.
fn turned(place: [f64; 3]) -> [f64; 3] {
    // An orthogonal matrix of rational numbers.
    let [x, y, z] = place.map(|value| value / 7.0);
    [2.0 * x + 3.0 * y + 6.0 * z, 3.0 * x - 6.0 * y + 2.0 * z, 6.0 * x + 2.0 * y - 3.0 * z]
}

/// The indices of a cloud's finite points that are no outliers, along a Morton curve; what it leaves together is sorted by
/// coordinates, then by normal.
fn sorted(cloud: &Cloud) -> Vec<u32> {
    let is_usable = |index: usize| cloud.positions[index].is_finite() && !cloud.is_outlier(index);
    let finite = cloud.positions.iter().filter(|p| p.is_finite());
    let low = finite.clone().fold(Vec3::INFINITY, |low, &p| low.min(p)).as_dvec3();
    let high = finite.fold(Vec3::NEG_INFINITY, |high, &p| high.max(p)).as_dvec3();
    let scale = f64::from(1 << 21) / (high - low).max_element().max(f64::MIN_POSITIVE);
    let code = |index: usize| {
        let cell =
            ((cloud.positions[index].as_dvec3() - low) * scale).min(DVec3::splat(f64::from((1 << 21) - 1)));
        spread(cell.x as u64) | spread(cell.y as u64) << 1 | spread(cell.z as u64) << 2
    };
    let mut keys: Vec<(u64, u32)> = (0..cloud.len())
        .into_par_iter()
        .filter(|&index| is_usable(index))
        .map(|index| (code(index), index as u32))
        .collect();
    let details =
        |index: u32| [Some(cloud.positions[index as usize]), cloud.normals.get(index as usize).copied()];
    keys.par_sort_unstable_by(|a, b| {
        a.0.cmp(&b.0).then_with(|| compare(details(a.1), details(b.1))).then(a.1.cmp(&b.1))
    });
    keys.into_iter().map(|(_, index)| index).collect()
}

/// A total order of some vectors.
fn compare(a: [Option<Vec3>; 2], b: [Option<Vec3>; 2]) -> Ordering {
    let numbers = |vectors: [Option<Vec3>; 2]| vectors.into_iter().flatten().flat_map(|v| v.to_array());
    let pairs = numbers(a).zip(numbers(b));
    pairs.fold(Ordering::Equal, |order, (a, b)| order.then(a.total_cmp(&b)))
}

/// The 21 low bits of a number, two zeros after each.
fn spread(mut bits: u64) -> u64 {
    bits = (bits | bits << 32) & 0x001f_0000_0000_ffff;
    bits = (bits | bits << 16) & 0x001f_0000_ff00_00ff;
    bits = (bits | bits << 8) & 0x100f_00f0_0f00_f00f;
    bits = (bits | bits << 4) & 0x10c3_0c30_c30c_30c3;
    (bits | bits << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_spread() {
        assert_eq!(spread(0b1011), 0b001_000_001_001);
        assert_eq!(spread((1 << 21) - 1), 0x1249_2492_4924_9249);
    }

    #[test]
    fn coincident_points_are_one_place() {
        let mut points = vec![DVec3::ZERO; 5];
        points.extend([DVec3::X, DVec3::NAN, DVec3::Y, DVec3::X]);
        let neighbors = Neighbors::new(&Cloud::from_points(&points));
        assert_eq!(neighbors.len(), 3);
        let mut members: Vec<Vec<usize>> = (0..3).map(|place| neighbors.members(place).collect()).collect();
        members.sort();
        assert_eq!(members, [vec![0, 1, 2, 3, 4], vec![5, 8], vec![7]]);
        let origin = (0..3).find(|&place| neighbors.place(place) == DVec3::ZERO).unwrap();
        let distances: Vec<f64> =
            neighbors.nearest(origin, 9).into_iter().map(|other| neighbors.distance(origin, other)).collect();
        assert_eq!(distances, [1.0, 1.0]);
        assert_eq!(neighbors.within(origin, 0.5).collect::<Vec<_>>(), [origin]);
    }
}
