//! The table of faces of a PLY file.

use super::header::Header;
use crate::mesh::{Mesh, NO_INDEX, fan};
use crate::table::{Element, Kind};
use crate::{Error, Loss, Place, Usage};
use glam::DVec2;
use splat_core::Cloud;
use std::path::Path;

/// What a property of a face is used for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum List {
    /// The corners: indices of vertices.
    Corners,
    /// The corners' texture coordinates, s and t in turn.
    Texture,
    /// Nothing.
    Skipped,
}

/// Faces half read.
pub(super) struct Faces {
    /// Per property.
    lists: Vec<List>,
    /// Per property, what is said of it.
    pub usages: Vec<Usage>,
    /// Number of vertices.
    vertices: u64,
    /// The row that is being read.
    corners: Vec<f64>,
    texture: Vec<f64>,
    mesh: Mesh,
    /// Number of rows read.
    rows: u64,
    /// Number of faces that are left out, and the row of the first.
    too_few: (u64, u64),
}

/// The names of the list of corners.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

impl Faces {
    /// Index of the table of faces: `face`, if it has a list of corners.
    pub fn find(header: &Header) -> Option<usize> {
        let is_list = |kind| matches!(kind, Kind::List { .. });
        header.elements.iter().position(|element| {
            let mut properties = element.properties.iter();
            element.name.eq_ignore_ascii_case("face")
                && properties.any(|property| is_list(property.kind) && is_one_of(&property.name, &CORNERS))
        })
    }

    /// The error for a file in which [`Faces::find`] finds nothing.
    pub fn missing(path: &Path) -> Error {
        let expected =
            "an element `face` with a list `vertex_indices` (without faces a file is a cloud, not a mesh)";
        Error::invalid(path, Place::File, "no faces", expected)
    }

    /// Understands the properties of the table of faces between so many vertices.
    pub fn new(element: &Element, vertices: u64) -> Self {
        let mut lists = vec![List::Skipped; element.properties.len()];
        let mut usages = vec![Usage::Unused("a face's"); lists.len()];
        for (index, property) in element.properties.iter().enumerate() {
            if !matches!(property.kind, Kind::List { .. }) {
                continue;
            }
            if is_one_of(&property.name, &CORNERS) && !lists.contains(&List::Corners) {
                (lists[index], usages[index]) = (List::Corners, Usage::Face);
            } else if is_one_of(&property.name, &["texcoord"]) {
                (lists[index], usages[index]) = (List::Texture, Usage::TextureCoordinate);
            }
        }
        Self {
            lists,
            usages,
            vertices,
            corners: Vec::new(),
            texture: Vec::new(),
            mesh: Mesh::default(),
            rows: 0,
            too_few: (0, 0),
        }
    }

    /// What the property of this index is used for.
    pub fn list(&self, index: usize) -> List {
        self.lists[index]
    }

    /// Forgets the last row.
    pub fn start_row(&mut self) {
        self.corners.clear();
        self.texture.clear();
    }

    /// Takes an entry of a list.
    #[inline]
    pub fn value(&mut self, list: List, value: f64) {
        match list {
            List::Corners => self.corners.push(value),
            List::Texture => self.texture.push(value),
            List::Skipped => {}
        }
    }

    /// Takes the row as a face. Faces of fewer than three corners have no area, and are left out.
    pub fn end_row(&mut self, path: &Path, place: impl FnOnce() -> Place) -> Result<(), Error> {
        let is_vertex =
            |&corner: &f64| corner.fract() == 0.0 && corner >= 0.0 && corner < self.vertices as f64;
        if let Some(wrong) = self.corners.iter().copied().find(|corner| !is_vertex(corner)) {
            let expected = format!("the index of one of {} vertices, from 0", self.vertices);
            return Err(Error::invalid(path, place(), format!("a face with the vertex {wrong}"), expected));
        }
        let corners = self.corners.len();
        if corners < 3 {
            let (count, first) = &mut self.too_few;
            if *count == 0 {
                *first = self.rows;
            }
            *count += 1;
        }
        self.rows += 1;
        fan(corners, |corner| self.corners[corner] as u32, &mut self.mesh.triangles);
        if !self.lists.contains(&List::Texture) {
            return Ok(());
        }
        let first = self.mesh.texture_coordinates.len();
        if self.texture.len() != 2 * corners || first + corners >= NO_INDEX as usize {
            fan(corners, |_| NO_INDEX, &mut self.mesh.texture_triangles);
            return Ok(());
        }
        self.mesh.texture_coordinates.extend(self.texture.chunks_exact(2).map(DVec2::from_slice));
        fan(corners, |corner| (first + corner) as u32, &mut self.mesh.texture_triangles);
        Ok(())
    }

    /// The faces that were left out.
    pub fn losses(&self) -> Option<Loss> {
        let (count, first) = self.too_few;
        Loss::new("faces of fewer than three corners", count, format!("face {first}"))
    }

    /// The mesh of these faces between the points of a cloud.
    pub fn into_mesh(self, vertices: &Cloud) -> Mesh {
        let mut mesh = self.mesh;
        mesh.positions = (0..vertices.len()).map(|index| vertices.world_position(index)).collect();
        mesh.colors.clone_from(&vertices.colors);
        if vertices.oriented {
            mesh.normals.clone_from(&vertices.normals);
            mesh.normal_triangles.clone_from(&mesh.triangles);
        }
        if let (Some(coordinates), true) = (&vertices.texture_coordinates, mesh.texture_triangles.is_empty())
        {
            mesh.texture_coordinates = coordinates.iter().map(|c| c.center.as_dvec2()).collect();
            mesh.texture_triangles.clone_from(&mesh.triangles);
        }
        mesh
    }
}

fn is_one_of(name: &str, known: &[&str]) -> bool {
    known.iter().any(|known| name.eq_ignore_ascii_case(known))
}
