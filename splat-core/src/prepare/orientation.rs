//! Which side of a surface is the outside.

use super::local::Local;
use super::neighbors::Neighbors;
use crate::Cloud;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// How normals without sides get them.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Orientation {
    /// They get none: every splat faces the camera.
    #[default]
    TwoSided,
    /// Towards this place in the world: where the scanner stood.
    Viewpoint(DVec3),
    /// Towards this direction in the world: up, for scans from the air.
    Direction(DVec3),
    /// As their neighbours, along the tree of neighbours that turn least from one to the next (Hoppe et al. 1992). Of each
    /// connected part the half that lies farther in this direction of the world looks that way in the mean, as the upper
    /// half of every closed surface does (by the divergence theorem), and a terrain.
    Graph(DVec3),
}

/// Turns the cloud's normals. `locals` are the neighbourhoods of all places.
pub fn orient(cloud: &mut Cloud, neighbors: &Neighbors, locals: &[Local], orientation: Orientation) {
    let outside: Vec<Vec3> = match orientation {
        Orientation::TwoSided => return,
        Orientation::Viewpoint(viewpoint) => {
            let viewpoint = viewpoint - cloud.origin;
            (0..neighbors.len())
                .map(|place| (viewpoint - neighbors.place(place)).normalize_or_zero().as_vec3())
                .collect()
        }
        Orientation::Direction(direction) => vec![direction.as_vec3(); neighbors.len()],
        Orientation::Graph(up) => {
            let first = |place: usize| {
                neighbors.members(place).next().map_or(Vec3::ZERO, |index| cloud.normals[index])
            };
            let normals: Vec<Vec3> = (0..neighbors.len()).map(first).collect();
            propagate(neighbors, locals, &normals, up)
        }
    };
    for (place, outside) in outside.into_iter().enumerate() {
        for index in neighbors.members(place) {
            if cloud.normals[index].dot(outside) < 0.0 {
                cloud.normals[index] = -cloud.normals[index];
            }
        }
    }
    cloud.oriented = true;
}

/// The normals of all places, turned alike: Kruskal's minimum spanning tree over the angles between neighbours, whose sets
/// remember how each member is turned to the set's first.
fn propagate(neighbors: &Neighbors, locals: &[Local], normals: &[Vec3], up: DVec3) -> Vec<Vec3> {
    let edge = |(a, b): (usize, usize)| {
        let turn = 1.0 - normals[a].dot(normals[b]).abs().min(1.0);
        // Not negative, so that its bits are ordered as its values are.
        (turn.to_bits(), a as u32, b as u32)
    };
    let mut edges: Vec<(u32, u32, u32)> = (0..normals.len())
        .into_par_iter()
        .flat_map_iter(|a| locals[a].nearest().map(move |b| (a.min(b), a.max(b))))
        .map(edge)
        .collect();
    edges.par_sort_unstable();

    let mut sets = TurnedSets::new(normals.len());
    for (_, a, b) in edges {
        let is_turned = normals[a as usize].dot(normals[b as usize]) < 0.0;
        sets.join(a as usize, b as usize, is_turned);
    }
    let faces_down = faces_down(neighbors, locals, normals, &sets, up);
    let turned = |place: usize| {
        let (set, turned) = sets.find(place);
        if turned != faces_down[set] { -normals[place] } else { normals[place] }
    };
    (0..normals.len()).map(turned).collect()
}

/// For the first member of each set, whether its normal makes the upper half of the set look down.
fn faces_down(
    neighbors: &Neighbors,
    locals: &[Local],
    normals: &[Vec3],
    sets: &TurnedSets,
    up: DVec3,
) -> Vec<bool> {
    let height = |place: usize| neighbors.place(place).dot(up);
    let mut heights = vec![(f64::INFINITY, f64::NEG_INFINITY); normals.len()];
    for place in 0..normals.len() {
        let (low, high) = &mut heights[sets.find(place).0];
        (*low, *high) = (low.min(height(place)), high.max(height(place)));
    }
    // Summed by one task, in the order of places.
    let mut upwards = vec![0.0; normals.len()];
    for place in 0..normals.len() {
        let (set, turned) = sets.find(place);
        let (low, high) = heights[set];
        if height(place) >= 0.5 * (low + high) {
            let area = f64::from(locals[place].size() * locals[place].size());
            let sign = if turned { -1.0 } else { 1.0 };
            upwards[set] += sign * area * normals[place].as_dvec3().dot(up);
        }
    }
    upwards.into_iter().map(|sum| sum < 0.0).collect()
}

/// Disjoint sets of which each member knows whether it is turned against another.
struct TurnedSets {
    parents: Vec<u32>,
    /// Whether each is turned against its parent.
    turned: Vec<bool>,
}

impl TurnedSets {
    fn new(len: usize) -> Self {
        Self { parents: (0..len as u32).collect(), turned: vec![false; len] }
    }

    /// The set's first member, and whether this one is turned against it.
    fn find(&self, member: usize) -> (usize, bool) {
        let (mut at, mut turned) = (member, false);
        while self.parents[at] as usize != at {
            turned ^= self.turned[at];
            at = self.parents[at] as usize;
        }
        (at, turned)
    }

    /// Joins the sets of two members, which are turned against each other or not; nothing if they are in one set.
    fn join(&mut self, a: usize, b: usize, is_turned: bool) {
        let ((first, a_turned), (second, b_turned)) = (self.shorten(a), self.shorten(b));
        if first != second {
            let (low, high) = (first.min(second), first.max(second));
            self.parents[high] = low as u32;
            self.turned[high] = is_turned ^ a_turned ^ b_turned;
        }
    }

    /// [`Self::find`], after which the member's whole way leads straight to the first.
    fn shorten(&mut self, member: usize) -> (usize, bool) {
        let found @ (first, mut turned) = self.find(member);
        let mut at = member;
        while at != first {
            let next = self.parents[at] as usize;
            let step = self.turned[at];
            self.parents[at] = first as u32;
            self.turned[at] = turned;
            turned ^= step;
            at = next;
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turned_sets_add_up() {
        let mut sets = TurnedSets::new(6);
        sets.join(4, 5, true);
        sets.join(2, 3, true);
        sets.join(3, 4, false);
        sets.join(0, 5, true);
        let found: Vec<_> = (0..6).map(|member| sets.find(member)).collect();
        let turned = |member: usize| found[member].1 != found[0].1;
        assert!([2, 3, 4, 5].iter().all(|&member| found[member].0 == found[0].0));
        assert_ne!(found[1].0, found[0].0);
        assert_eq!([2, 3, 4, 5].map(turned), [true, false, false, true]);
    }
}
