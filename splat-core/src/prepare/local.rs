//! What one search for the nearest neighbours tells about a place.

use super::neighbors::Neighbors;
use super::normal::least_spread;
use super::size::spacing;
use glam::{DVec3, Vec3};

/// Neighbours that are kept.
const KEPT: usize = 8;

/// No neighbour.
const NONE: u32 = u32::MAX;

/// The neighbourhood of a place.
#[derive(Debug, Clone, Copy)]
pub struct Local {
    /// Unit normal; its sign says nothing.
    pub normal: Vec3,
    /// Distance between points, in scene units; 0 where there is one place only.
    pub spacing: f32,
    nearest: [u32; KEPT],
}

impl Local {
    /// The nearest other places, up to 8.
    pub fn nearest(&self) -> impl Iterator<Item = usize> {
        self.nearest.iter().filter(|&&other| other != NONE).map(|&other| other as usize)
    }
}

/// The neighbourhood of every place: normals from `normals_k` nearest neighbours (none if 0), spacings from `radius_k`.
pub fn explore(
    neighbors: &Neighbors,
    normals_k: usize,
    radius_k: usize,
    progress: &mut dyn FnMut(f64),
) -> Vec<Local> {
    let count = normals_k.max(radius_k).max(KEPT);
    neighbors.map(progress, |place| {
        let found = neighbors.nearest(place, count);
        let mut nearest = [NONE; KEPT];
        for (kept, &(other, _)) in nearest.iter_mut().zip(&found) {
            *kept = other as u32;
        }
        let reached = radius_k.min(found.len());
        let spacing = if reached == 0 { 0.0 } else { spacing(found[reached - 1].1, reached) as f32 };
        let centre = neighbors.place(place);
        let close = &found[..normals_k.min(found.len())];
        let offsets: Vec<DVec3> = close.iter().map(|&(other, _)| neighbors.place(other) - centre).collect();
        let normal = if normals_k == 0 { Vec3::ZERO } else { least_spread(&offsets).as_vec3() };
        Local { normal, spacing, nearest }
    })
}
