//! What is said of a mesh.

use crate::strict;
use serde::Serialize;
use splat_io::{MeshImport, read_obj};
use std::fmt;
use std::path::{Path, PathBuf};

/// What is said of a mesh.
#[derive(Debug, Serialize)]
pub struct Summary {
    file: PathBuf,
    format: String,
    bytes: u64,
    sha256: String,
    vertices: usize,
    triangles: usize,
    /// Triangles without an area.
    degenerate: usize,
    /// In squared scene units.
    area: f64,
    /// Least and greatest corner of the finite vertices.
    bounds: Option<[[f64; 3]; 2]>,
    colors: bool,
    /// Triangles with texture coordinates.
    textured: usize,
    /// Triangles with normals at their corners.
    with_normals: usize,
    assumptions: Vec<String>,
    /// What is out of order in the file, and passed over.
    losses: Vec<String>,
}

impl Summary {
    /// Reads a mesh and sums it up.
    ///
    /// # Errors
    /// What the reader says; with `strict`, everything that is out of order.
    pub fn read(path: &Path, strict: bool) -> anyhow::Result<Self> {
        let MeshImport { mesh, mut report } = read_obj(path)?;
        let (area, degenerate) = mesh.area();
        report.losses.extend(strict::without_area(&mesh, degenerate));
        if strict {
            strict::check(&report, &report.losses)?;
        }
        let finite = mesh.positions.iter().filter(|position| position.is_finite());
        let corners = finite.map(|&p| (p, p)).reduce(|(low, high), (p, _)| (low.min(p), high.max(p)));
        let with = |triples: &[[u32; 3]]| {
            triples.iter().filter(|triple| !triple.contains(&splat_io::mesh::NO_INDEX)).count()
        };
        Ok(Self {
            file: report.path,
            format: report.format,
            bytes: report.bytes,
            sha256: report.sha256,
            vertices: mesh.positions.len(),
            triangles: mesh.triangles.len(),
            degenerate,
            area,
            bounds: corners.map(|(low, high)| [low.to_array(), high.to_array()]),
            colors: mesh.colors.is_some(),
            textured: with(&mesh.texture_triangles),
            with_normals: with(&mesh.normal_triangles),
            assumptions: report.assumptions,
            losses: report.losses.iter().map(ToString::to_string).collect(),
        })
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "file         {}", self.file.display())?;
        writeln!(f, "format       {}, {} bytes", self.format, self.bytes)?;
        writeln!(f, "sha256       {}", self.sha256)?;
        writeln!(f, "vertices     {}", self.vertices)?;
        writeln!(f, "triangles    {}, of which without an area: {}", self.triangles, self.degenerate)?;
        writeln!(f, "area         {}", self.area)?;
        if let Some([low, high]) = self.bounds {
            writeln!(f, "from         {}, {}, {}", low[0], low[1], low[2])?;
            writeln!(f, "to           {}, {}, {}", high[0], high[1], high[2])?;
        }
        writeln!(f, "colours      {}", if self.colors { "yes" } else { "none" })?;
        writeln!(f, "texture      coordinates on {} triangles", self.textured)?;
        writeln!(f, "normals      on {} triangles", self.with_normals)?;
        writeln!(f, "assumptions")?;
        for assumption in &self.assumptions {
            writeln!(f, "  - {assumption}")?;
        }
        writeln!(f, "  - rendered as it is, the surface is sampled: splat convert has the options")?;
        for (number, loss) in self.losses.iter().enumerate() {
            writeln!(f, "{}  - {loss}", if number == 0 { "out of order\n" } else { "" })?;
        }
        Ok(())
    }
}
