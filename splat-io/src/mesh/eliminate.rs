//! Evenly spread points out of too many: sample elimination (Yuksel 2015, "Sample elimination for generating Poisson disk
//! sample sets").
//!
//! The point that its neighbours crowd most is removed, again and again, until the wanted number is left. The result is
//! blue noise with an exact count, at M log M for M candidates.

use glam::Vec3;

/// A point of a surface.
#[derive(Debug, Clone, Copy)]
pub struct Candidate {
    /// Place, in units of the greatest radius that discs around the kept points can have.
    pub place: Vec3,
    /// Unit normal of the surface there.
    pub normal: Vec3,
}

/// The radius, in the unit of length whose square is `area`, that `count` discs of the densest packing have on such an
/// area: the unit of [`Candidate::place`].
pub fn greatest_radius(area: f64, count: usize) -> f64 {
    (area / (2.0 * 3.0f64.sqrt() * count as f64)).sqrt()
}

/// Beyond this distance points do not see each other: twice the greatest radius.
const REACH: f32 = 2.0;

/// Most points of a cell that are looked at: a mesh may pile up any number of layers, and must not take forever.
const MOST_OF_A_CELL: usize = 64;

/// Surfaces that turn away by more than 120 degrees are different sides of something thin: no neighbours.
const LEAST_COSINE: f32 = -0.5;

/// The indices of the `keep` candidates that remain, in ascending order. `progress` is told the share done, 0 to 1.
pub fn eliminate(candidates: &[Candidate], keep: usize, progress: &mut dyn FnMut(f64)) -> Vec<u32> {
    let crowding = Crowding::new(keep as f64 / candidates.len() as f64);
    let grid = Grid::new(candidates);
    let mut weights = vec![0.0; candidates.len()];
    for (place, weight) in weights.iter_mut().enumerate() {
        grid.neighbors(place, |_, distance| *weight += crowding.weight(distance));
    }
    progress(0.3);
    let mut heap = Heap::new(weights);
    let removals = candidates.len().saturating_sub(keep);
    for removal in 0..removals {
        let removed = heap.pop();
        grid.neighbors(removed as usize, |place, distance| heap.lighten(place, crowding.weight(distance)));
        if removal % 4096 == 0 {
            progress(0.3 + 0.7 * removal as f64 / removals as f64);
        }
    }
    let mut kept: Vec<u32> = heap.items.into_iter().map(|place| grid.indices[place as usize]).collect();
    kept.sort_unstable();
    kept
}

/// How much two points crowd each other.
struct Crowding {
    /// Distances below that count as that: the limit that keeps the points' density even.
    least_distance: f32,
}

impl Crowding {
    /// For this share of points to be kept. The constants are Yuksel's.
    fn new(kept: f64) -> Self {
        const BETA: f64 = 0.65;
        let least_radius = (1.0 - kept * kept.sqrt()) * BETA;
        Self { least_distance: 2.0 * least_radius as f32 }
    }

    /// (1 - d/2r)^8.
    fn weight(&self, distance: f32) -> f32 {
        let nearness = 1.0 - distance.max(self.least_distance).min(REACH) / REACH;
        let squared = nearness * nearness;
        let fourth = squared * squared;
        fourth * fourth
    }
}

/// Points by cells of a cubic lattice, in a hash table.
struct Grid {
    /// The candidates, bucket after bucket: those of b are `candidates[starts[b]..starts[b + 1]]`.
    candidates: Vec<Candidate>,
    /// Where each of them was before.
    indices: Vec<u32>,
    starts: Vec<u32>,
    mask: u32,
}

impl Grid {
    /// Fewest buckets: among so many no two cells of a neighbourhood share one.
    const LEAST_BUCKETS: usize = 4096;

    fn new(candidates: &[Candidate]) -> Self {
        let buckets = candidates.len().next_power_of_two().max(Self::LEAST_BUCKETS);
        let mask = (buckets - 1) as u32;
        let mut starts = vec![0u32; buckets + 1];
        let bucket = |candidate: &Candidate| (bucket(cell(candidate.place)) & mask) as usize;
        for candidate in candidates {
            starts[bucket(candidate) + 1] += 1;
        }
        for index in 1..starts.len() {
            starts[index] += starts[index - 1];
        }
        let mut ends = starts.clone();
        let mut indices = vec![0; candidates.len()];
        for (index, candidate) in candidates.iter().enumerate() {
            let end = &mut ends[bucket(candidate)];
            indices[*end as usize] = index as u32;
            *end += 1;
        }
        let candidates = indices.iter().map(|&index| candidates[index as usize]).collect();
        Self { candidates, indices, starts, mask }
    }

    /// Visits the points within reach of the one at `own`, save itself, with their distances.
    fn neighbors(&self, own: usize, mut visit: impl FnMut(u32, f32)) {
        let Candidate { place, normal } = self.candidates[own];
        let [x, y, z] = cell(place);
        for (dz, dy) in [-1, 0, 1].into_iter().flat_map(|dz| [-1, 0, 1].map(|dy| (dz, dy))) {
            let first = bucket([x.wrapping_sub(1), y.wrapping_add(dy), z.wrapping_add(dz)]);
            for dx in 0..3 {
                let bucket = (first.wrapping_add(dx) & self.mask) as usize;
                let (start, end) = (self.starts[bucket] as usize, self.starts[bucket + 1] as usize);
                let end = end.min(start + MOST_OF_A_CELL);
                for (other, candidate) in (start..end).zip(&self.candidates[start..end]) {
                    let distance = (candidate.place - place).length_squared();
                    if distance < REACH * REACH && other != own && candidate.normal.dot(normal) > LEAST_COSINE
                    {
                        visit(other as u32, distance.sqrt());
                    }
                }
            }
        }
    }
}

/// The cell of a place; cells are as large as points see.
fn cell(place: Vec3) -> [i32; 3] {
    (place / REACH).to_array().map(|value| value.floor() as i32)
}

/// The bucket of a cell, before the mask. Neighbours along x have neighbouring buckets.
fn bucket([x, y, z]: [i32; 3]) -> u32 {
    (x as u32)
        .wrapping_add((y as u32).wrapping_mul(0x9e37_79b1))
        .wrapping_add((z as u32).wrapping_mul(0x85eb_ca6b))
}

/// A binary heap, the greatest weight on top, in which weights may sink.
struct Heap {
    weights: Vec<f32>,
    items: Vec<u32>,
    /// Where each item is; [`Heap::GONE`] if it is not.
    places: Vec<u32>,
}

impl Heap {
    const GONE: u32 = u32::MAX;

    fn new(weights: Vec<f32>) -> Self {
        let items: Vec<u32> = (0..weights.len() as u32).collect();
        let mut heap = Self { places: items.clone(), items, weights };
        for place in (0..heap.items.len() / 2).rev() {
            heap.sink(place);
        }
        heap
    }

    fn weight(&self, place: usize) -> f32 {
        self.weights[self.items[place] as usize]
    }

    /// Takes the heaviest item out. There must be one.
    fn pop(&mut self) -> u32 {
        let top = self.items.swap_remove(0);
        self.places[top as usize] = Self::GONE;
        if let Some(&first) = self.items.first() {
            self.places[first as usize] = 0;
            self.sink(0);
        }
        top
    }

    /// Makes an item lighter, if it is still there.
    fn lighten(&mut self, item: u32, by: f32) {
        let place = self.places[item as usize];
        if place != Self::GONE {
            self.weights[item as usize] -= by;
            self.sink(place as usize);
        }
    }

    /// Moves an item down to where it belongs.
    fn sink(&mut self, mut place: usize) {
        let item = self.items[place];
        let weight = self.weights[item as usize];
        loop {
            let mut child = 2 * place + 1;
            if child >= self.items.len() {
                break;
            }
            if child + 1 < self.items.len() && self.weight(child + 1) > self.weight(child) {
                child += 1;
            }
            if self.weight(child) <= weight {
                break;
            }
            self.items[place] = self.items[child];
            self.places[self.items[place] as usize] = place as u32;
            place = child;
        }
        self.items[place] = item;
        self.places[item as usize] = place as u32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_cells_of_a_neighborhood_share_a_bucket() {
        let mut buckets: Vec<u32> = (0..27)
            .map(|i| bucket([i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1]) & (Grid::LEAST_BUCKETS as u32 - 1))
            .collect();
        buckets.sort_unstable();
        buckets.dedup();
        assert_eq!(buckets.len(), 27);
    }

    #[test]
    fn the_heap_gives_the_heaviest_whatever_becomes_lighter() {
        let mut heap = Heap::new((0..100).map(|i| (i * 37 % 100) as f32).collect());
        for item in 0..50 {
            heap.lighten(item, 30.0);
        }
        let mut last = f32::INFINITY;
        while !heap.items.is_empty() {
            let top = heap.pop() as usize;
            assert!(heap.weights[top] <= last);
            last = heap.weights[top];
            heap.lighten(top as u32, 1.0);
        }
        assert_eq!(last, -30.0);
    }

    #[test]
    fn points_that_coincide_or_lie_far_apart_are_thinned_out_all_the_same() {
        let at = |place: Vec3| Candidate { place, normal: Vec3::Z };
        let places = [Vec3::ZERO, Vec3::splat(1e30), Vec3::splat(f32::MAX), Vec3::X];
        let candidates: Vec<Candidate> = (0..4000).map(|i| at(places[i % 4])).collect();
        let kept = eliminate(&candidates, 1000, &mut |_| {});
        assert_eq!(kept.len(), 1000);
        assert!(kept.is_sorted());
    }
}
