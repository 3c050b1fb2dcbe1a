//! What one search for the nearest neighbours tells about a place.

use super::neighbors::Neighbors;
use super::normal::least_spread;
use super::{PrepareOptions, cell};
use glam::{DVec3, Vec3};

/// Neighbours that are kept.
const KEPT: usize = 8;

/// No neighbour.
const NONE: u32 = u32::MAX;

/// Sigma of a splat in a cloud that tells nothing about spacing.
const LONE_SIZE: f64 = 1.0;

/// How much larger than those around it a splat may be.
const CAP: f32 = 2.0;

/// The neighbourhood of a place.
#[derive(Debug, Clone, Copy)]
pub struct Local {
    /// Unit normal: as given, else estimated, and then its sign says nothing.
    pub normal: Vec3,
    /// Sigma-scaled axes of the splat.
    pub axes: [Vec3; 2],
    nearest: [u32; KEPT],
}

impl Local {
    /// The nearest other places, up to 8.
    pub fn nearest(&self) -> impl Iterator<Item = usize> {
        self.nearest.iter().filter(|&&other| other != NONE).map(|&other| other as usize)
    }

    /// Sigma of the round splat of the same area.
    pub fn size(&self) -> f32 {
        (self.axes[0].length() * self.axes[1].length()).sqrt()
    }
}

/// The neighbourhood of every place; `normals` are those of the cloud, empty if they are to be estimated.
pub fn explore(
    neighbors: &Neighbors,
    normals: &[Vec3],
    options: &PrepareOptions,
    progress: &mut dyn FnMut(f64),
) -> Vec<Local> {
    let PrepareOptions { normals_k, radius_k, .. } = *options;
    neighbors.map(progress, |place| {
        let found = neighbors.nearest(place, normals_k.max(radius_k).max(KEPT));
        let mut nearest = [NONE; KEPT];
        for (kept, &other) in nearest.iter_mut().zip(&found) {
            *kept = other as u32;
        }
        let centre = neighbors.place(place);
        let offsets: Vec<DVec3> = found.iter().map(|&other| neighbors.place(other) - centre).collect();
        let first = |count: usize| &offsets[..count.min(offsets.len())];
        let given = neighbors.members(place).next().and_then(|index| normals.get(index));
        let normal = given.copied().unwrap_or_else(|| least_spread(first(normals_k)).as_vec3());
        // A normal that is zero or not finite belongs to a splat that is never drawn.
        let plane = normal.as_dvec3().try_normalize().unwrap_or(DVec3::Z);
        let lone = || <[DVec3; 2]>::from(plane.any_orthonormal_pair()).map(|axis| LONE_SIZE * axis);
        let axes = cell::axes(plane, first(radius_k)).unwrap_or_else(lone).map(|axis| axis.as_vec3());
        Local { normal, axes, nearest }
    })
}

/// Makes each splat that is more than twice as large as the median of its nearest ones as small as that: a point far from all
/// others is no giant.
pub fn cap_sizes(neighbors: &Neighbors, locals: &mut [Local]) {
    let factors = neighbors.map(&mut |_| {}, |place| {
        let mut others: Vec<f32> = locals[place].nearest().map(|other| locals[other].size()).collect();
        if others.is_empty() {
            return 1.0;
        }
        let middle = others.len() / 2;
        let (_, median, _) = others.select_nth_unstable_by(middle, f32::total_cmp);
        (CAP * *median / locals[place].size()).min(1.0)
    });
    for (local, factor) in locals.iter_mut().zip(factors) {
        local.axes = local.axes.map(|axis| axis * factor);
    }
}
