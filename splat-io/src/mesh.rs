//! Triangle meshes, and how they become surfels.
//!
//! [`read_obj`] and [`crate::read_ply_mesh`] read meshes; [`sample_surface`] covers one with textured surfels.
//!
//! The OBJ reader is ours: the errors of `tobj` 4 name no line, and it joins no continued lines.

mod eliminate;
mod obj;
mod sample;
#[cfg(test)]
mod tests;

pub use obj::{read_obj, read_obj_from};
pub use sample::{MOST_SURFELS, Sampled, sample_surface};

use crate::ImportReport;
use glam::{DVec2, DVec3, Vec3};
use splat_core::Error;

/// In place of an index: this corner has none.
pub const NO_INDEX: u32 = u32::MAX;

/// A triangle mesh with shared vertices. Positions, texture coordinates and normals have indices of their own, as in
/// OBJ files.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// World positions of the vertices, in scene units.
    pub positions: Vec<DVec3>,
    /// Linear colours, one a position; `None` where the mesh has none.
    pub colors: Option<Vec<Vec3>>,
    /// Texture coordinates (s, t): 1 is the whole texture, (0, 0) its lower left corner.
    pub texture_coordinates: Vec<DVec2>,
    /// Normals, of any length; they tell the outside from the inside.
    pub normals: Vec<Vec3>,
    /// The corners of each triangle, counter-clockwise seen from outside: indices of positions.
    pub triangles: Vec<[u32; 3]>,
    /// The corners' texture coordinates, one triple a triangle ([`NO_INDEX`] where a triangle has none); empty if no
    /// triangle has any.
    pub texture_triangles: Vec<[u32; 3]>,
    /// The corners' normals, one triple a triangle ([`NO_INDEX`] where a triangle has none); empty if no triangle has
    /// any.
    pub normal_triangles: Vec<[u32; 3]>,
}

/// A mesh from a file, and what was understood of it.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshImport {
    /// The mesh.
    pub mesh: Mesh,
    /// What the file holds and how it was read.
    pub report: ImportReport,
}

impl Mesh {
    /// Checks that all arrays belong together and every index is one.
    ///
    /// # Errors
    /// [`Error::Length`] for colours or triples that are too few or too many; [`Error::Invalid`] for an index of
    /// nothing, and for 2^32 - 1 triangles or more.
    pub fn check(&self) -> Result<(), Error> {
        let (positions, triangles) = (self.positions.len(), self.triangles.len());
        if triangles >= NO_INDEX as usize {
            return Err(Error::invalid("number of triangles", triangles, "fewer than 2^32 - 1"));
        }
        let optional = |length: usize| (length > 0).then_some(length);
        let lengths = [
            ("mesh colours", self.colors.as_ref().map(Vec::len), positions),
            ("mesh texture triangles", optional(self.texture_triangles.len()), triangles),
            ("mesh normal triangles", optional(self.normal_triangles.len()), triangles),
        ];
        for (what, length, expected) in lengths {
            if let Some(found) = length.filter(|&found| found != expected) {
                return Err(Error::Length { what, found, expected });
            }
        }
        let is_within = |count: usize| move |&index: &u32| (index as usize) < count;
        let is_within_or_none =
            |count: usize| move |&index: &u32| index == NO_INDEX || (index as usize) < count;
        let all_within = self.triangles.as_flattened().iter().all(is_within(positions))
            && (self.texture_triangles.as_flattened().iter())
                .all(is_within_or_none(self.texture_coordinates.len()))
            && self.normal_triangles.as_flattened().iter().all(is_within_or_none(self.normals.len()));
        if all_within {
            Ok(())
        } else {
            Err(Error::invalid(
                "mesh",
                "a triangle with a corner that is not there",
                "indices of the mesh's own arrays",
            ))
        }
    }

    /// Positions of the corners of a triangle, in scene units.
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|index| self.positions[index as usize])
    }

    /// The area of a triangle in squared scene units; `None` for one without: a corner that is not finite, corners on a
    /// line.
    pub fn triangle_area(&self, triangle: usize) -> Option<f64> {
        let [a, b, c] = self.corners(triangle);
        let twice = (b - a).cross(c - a).length();
        let longest = (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared());
        // Below that, rounding of the corners turns the normal at will.
        const LEAST_SINE: f64 = 1.0 / (1u64 << 40) as f64;
        (twice.is_finite() && twice > LEAST_SINE * longest && twice > f64::MIN_POSITIVE)
            .then_some(0.5 * twice)
    }

    /// The mesh's area in squared scene units, and the number of its triangles that have none.
    pub fn area(&self) -> (f64, usize) {
        let areas = (0..self.triangles.len()).map(|triangle| self.triangle_area(triangle));
        areas.fold((0.0, 0), |(sum, skipped), area| match area {
            Some(area) => (sum + area, skipped),
            None => (sum, skipped + 1),
        })
    }

    /// The texture coordinates of a triangle's corners, if it has any.
    pub(crate) fn texture_corners(&self, triangle: usize) -> Option<[DVec2; 3]> {
        let indices = self.texture_triangles.get(triangle).filter(|indices| !indices.contains(&NO_INDEX))?;
        Some(indices.map(|index| self.texture_coordinates[index as usize]))
    }

    /// The normals of a triangle's corners, if it has any.
    pub(crate) fn normal_corners(&self, triangle: usize) -> Option<[Vec3; 3]> {
        let indices = self.normal_triangles.get(triangle).filter(|indices| !indices.contains(&NO_INDEX))?;
        Some(indices.map(|index| self.normals[index as usize]))
    }
}

/// Adds the triangles of a polygon of so many corners: a fan from the first one. Right for convex polygons.
pub(crate) fn fan(corners: usize, index: impl Fn(usize) -> u32, triangles: &mut Vec<[u32; 3]>) {
    for second in 1..corners.saturating_sub(1) {
        triangles.push([index(0), index(second), index(second + 1)]);
    }
}
