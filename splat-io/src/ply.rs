//! PLY files (Stanford triangle format), the usual carrier of point clouds.
//!
//! Read are ASCII and binary files of both endians, any elements and properties in any order, lists anywhere;
//! of all that, the element `vertex` (or `point`, if there is no `vertex`) becomes the cloud. Its properties
//! are found by name, whatever their type and case:
//!
//! | property | names, the first one present counts | meaning |
//! |---|---|---|
//! | position | `x y z` | scene units, read as `f64`; required |
//! | normal | `nx`, `normal_x`, `normalx`, .. | made unit vectors; if every one is zero, there are none |
//! | color | `red`, `r`, `diffuse_red`, .. | floats: linear; integers: sRGB, linearised (below) |
//! | opacity | `opacity`, `alpha`, `a`, `diffuse_alpha` | integers over their maximum; clamped to [0, 1] |
//! | size | `radius`, `psz`, `size`, `pscale`, `scale` | sigma, in scene units; 0 is unknown |
//! | area | `area` | surface area that the splat stands for, in squared scene units |
//! | tangents | `tu_x tu_y tu_z tv_x tv_y tv_z` | sigma-scaled axes of an ellipse; they win over a size |
//! | texture coordinates | `s t`, `u v`, `texture_u texture_v`, .. | at the centre; 1 is the whole texture, t upwards |
//! | their derivatives | `ds_du dt_du ds_dv dt_dv` | along the two axes, per sigma; absent or zero: unknown |
//!
//! Integer colors are sRGB: `uchar` and `ushort` over their type's range, `char` as if it were `uchar`, other
//! types as 8-bit levels, clamped to 0 to 255.
//!
//! Other numbers (`confidence`, `quality`, `intensity`) become scalar fields of the cloud, the first 32 of them. All else
//! (lists, faces) is reported as not used. ([`crate::read_ply_mesh`] reads the faces, too.) Three comments that
//! [`write_ply`] leaves are understood: `comment splat oriented 0|1` (normals from a file are oriented unless it says 0),
//! `comment splat trained 1` ([`splat_core::Cloud::trained`]) and `comment splat origin X Y Z` (the cloud's origin, used if
//! it keeps every position exactly). PLY files of trained Gaussian splats have properties of their own: [`crate::trained`].
//!
//! ASCII numbers are read with the precision of `f64` whatever type is declared, since many programs declare
//! `float` and write more digits. A row is a line; blank lines between rows are skipped.

mod ascii;
mod binary;
mod compressed;
mod faces;
mod gaussians;
mod header;
mod rows;
#[cfg(test)]
pub(crate) mod tests;
mod trained;
pub(crate) mod writer;

pub use writer::{PlyEncoding, write_ply};

use crate::mesh::MeshImport;
use crate::source::Source;
use crate::table::{Columns, Element, Outcome};
use crate::{ElementReport, Error, Import, ImportReport, Loss, PropertyReport, Usage};
use faces::Faces;
use header::{Format, Header};
use rows::{Table, Tables};
use std::fs::{File, Metadata};
use std::io::Read;
use std::path::Path;

/// Reads a cloud from a PLY file. See the [module](self) for what is understood.
///
/// A file with a vertex element of no rows is an empty cloud. Bad points (not finite, zero normal, negative
/// size) stay in their rows; the renderer recognises them.
///
/// # Errors
/// [`Error::Io`]; [`Error::Unsupported`] for what is no regular file; [`Error::Invalid`] for anything malformed, truncated, or claiming more rows than the file
/// can hold; [`Error::Limit`] for a header of more than 1 MiB, 2^32 - 1 points or more, or more points than
/// memory.
pub fn read_ply(path: &Path) -> Result<Import, Error> {
    let (file, size) = open(path)?;
    read_ply_from(file, size, path)
}

/// Opens a regular file and gives its size, in bytes.
pub(crate) fn open(path: &Path) -> Result<(File, u64), Error> {
    // Asked before it is opened, too: to open a pipe is to wait for someone who writes to it.
    let is_file = |metadata: &Metadata| {
        let refusal = || Error::unsupported(path, "reading a folder, device or pipe", "a regular file");
        if metadata.is_file() { Ok(()) } else { Err(refusal()) }
    };
    is_file(&path.metadata().map_err(Error::io(path, "open"))?)?;
    let file = File::open(path).map_err(Error::io(path, "open"))?;
    let metadata = file.metadata().map_err(Error::io(path, "read"))?;
    is_file(&metadata)?;
    Ok((file, metadata.len()))
}

/// Reads a cloud from the `size` bytes of a PLY file that `reader` yields; `path` is its name in messages.
///
/// Reads in large pieces: the reader needs no buffer of its own.
///
/// # Errors
/// As [`read_ply`].
pub fn read_ply_from(reader: impl Read, size: u64, path: &Path) -> Result<Import, Error> {
    let mut source = Source::new(reader, size, path);
    let header = Header::read(&mut source)?;
    let points = &header.elements[header.points(path)?];
    if trained::holds_splats(points) {
        return trained::read(&header, source);
    }
    let mut tables = Surfels::new(&header, false, &source)?;
    read_tables(&header, &mut source, &mut tables)?;
    let points = tables.points;
    let more = behind(&header, tables.end(), &mut source)?;
    let (sha256, bytes) = source.finish()?;

    let Outcome { mut cloud, usages, mut assumptions, color_assumptions, losses } =
        tables.columns.finish(header.hints());
    cloud.trained = header.trained;
    assumptions.extend(color_assumptions);
    for (index, other) in header.elements.iter().enumerate().filter(|(_, other)| other.count > 0) {
        if index != points {
            let (name, rows) = (&other.name, other.count);
            assumptions.push(format!("element {name} ({rows} rows) is ignored: only points are drawn"));
        }
    }
    let elements = header.elements.iter().enumerate();
    let elements = elements.map(|(index, element)| report(element, (index == points).then_some(&usages)));
    let report = ImportReport {
        path: path.to_owned(),
        format: format!("PLY, {}", header.format.describe()),
        bytes,
        sha256,
        elements: elements.collect(),
        assumptions,
        losses: losses.into_iter().chain(more).collect(),
    };
    Ok(Import { cloud, report })
}

/// Whether the header of a PLY file claims faces that [`read_ply_mesh`] would read.
///
/// # Errors
/// As [`read_ply`], as far as the header goes.
pub fn ply_has_faces(path: &Path) -> Result<bool, Error> {
    let header = header_of(path)?;
    Ok(Faces::find(&header).is_some_and(|index| header.elements[index].count > 0))
}

/// The tables of a PLY file.
pub(crate) fn elements_of(path: &Path) -> Result<Vec<Element>, Error> {
    Ok(header_of(path)?.elements)
}

fn header_of(path: &Path) -> Result<Header, Error> {
    let (file, size) = open(path)?;
    Header::read(&mut Source::new(file, size, path))
}

/// Reads a mesh from a PLY file: the vertices as [`read_ply`] does, and the faces between them.
///
/// Faces are the list `vertex_indices` (or `vertex_index`) of an element `face`; one of more than three corners becomes
/// a fan of triangles. Texture coordinates are those of the vertices or, where the faces have one, the list `texcoord`:
/// s and t of each corner in turn. Sizes, opacities, areas and tangents of vertices say nothing about a mesh.
///
/// # Errors
/// As [`read_ply`]; [`Error::Invalid`] for a file without faces, and for a face with a vertex that is not there.
pub fn read_ply_mesh(path: &Path) -> Result<MeshImport, Error> {
    let (file, size) = open(path)?;
    read_ply_mesh_from(file, size, path)
}

/// Reads a mesh from the `size` bytes of a PLY file that `reader` yields; `path` is its name in messages.
///
/// # Errors
/// As [`read_ply_mesh`].
pub fn read_ply_mesh_from(reader: impl Read, size: u64, path: &Path) -> Result<MeshImport, Error> {
    let mut source = Source::new(reader, size, path);
    let header = Header::read(&mut source)?;
    let mut tables = Surfels::new(&header, true, &source)?;
    read_tables(&header, &mut source, &mut tables)?;
    let more = behind(&header, tables.end(), &mut source)?;
    let (sha256, bytes) = source.finish()?;

    let points = tables.points;
    let Outcome { cloud, usages, color_assumptions, losses, .. } = tables.columns.finish(header.hints());
    let Some((faces_index, faces)) = tables.faces else {
        return Err(Faces::missing(path));
    };
    let elements = header.elements.iter().enumerate().map(|(index, element)| match index {
        _ if index == points => report(element, Some(&usages)),
        _ if index == faces_index => report(element, Some(&faces.usages)),
        _ => report(element, None),
    });
    let elements = elements
        .map(|element| ElementReport { is_points: element.name == header.elements[points].name, ..element });
    let report = ImportReport {
        path: path.to_owned(),
        format: format!("PLY, {}", header.format.describe()),
        bytes,
        sha256,
        elements: elements.collect(),
        assumptions: color_assumptions,
        losses: losses.into_iter().chain(faces.losses()).chain(more).collect(),
    };
    Ok(MeshImport { mesh: faces.into_mesh(&cloud), report })
}

/// The tables of a file that are read; others are skipped.
struct Surfels {
    /// Index of the table of points.
    points: usize,
    columns: Columns,
    /// The table of faces, with its index, if faces are wanted.
    faces: Option<(usize, Faces)>,
}

impl Surfels {
    /// Finds the tables and holds what they claim against the file's size.
    fn new<R: Read>(header: &Header, with_faces: bool, source: &Source<R>) -> Result<Self, Error> {
        let points = header.points(source.path())?;
        let faces = if with_faces { Faces::find(header) } else { None };
        header.check_claims(points, faces.map_or(points, |faces| faces.max(points)), source)?;
        let vertices = header.elements[points].count;
        let columns = Columns::new(&header.elements[points], source.path())?;
        let faces = faces.map(|index| (index, Faces::new(&header.elements[index], vertices)));
        Ok(Self { points, columns, faces })
    }
}

impl Tables for Surfels {
    fn end(&self) -> usize {
        self.faces.as_ref().map_or(self.points, |(index, _)| self.points.max(*index)) + 1
    }

    fn table(&mut self, index: usize) -> Table<'_> {
        match &mut self.faces {
            _ if index == self.points => Table::Rows(&mut self.columns),
            Some((place, faces)) if *place == index => Table::Faces(faces),
            _ => Table::Skipped,
        }
    }
}

/// Reads the tables that are wanted.
fn read_tables<R: Read>(
    header: &Header,
    source: &mut Source<R>,
    tables: &mut impl Tables,
) -> Result<(), Error> {
    match header.format {
        Format::Ascii => ascii::read(source, header, tables),
        Format::BinaryLittleEndian => binary::read::<_, false>(source, header, tables),
        Format::BinaryBigEndian => binary::read::<_, true>(source, header, tables),
    }
}

/// What stands behind the last table of a file, if so many tables that were read are all; blanks behind text are nothing.
fn behind<R: Read>(header: &Header, read: usize, source: &mut Source<R>) -> Result<Option<Loss>, Error> {
    let (mut count, start) = (0, source.offset());
    let is_text = header.format == Format::Ascii;
    while read == header.elements.len() && source.want(1)? {
        let window = source.window();
        let bytes = window.iter().filter(|byte| !(is_text && byte.is_ascii_whitespace())).count();
        count += bytes as u64;
        source.consume(source.window().len());
    }
    Ok(Loss::new("bytes behind the last row", count, format!("from byte {start} on")))
}

/// What is said of an element; `usages`, one a property, if it is the table of points.
fn report(element: &Element, usages: Option<&Vec<Usage>>) -> ElementReport {
    let properties = element.properties.iter().enumerate();
    ElementReport {
        name: element.name.clone(),
        count: element.count,
        is_points: usages.is_some(),
        properties: properties
            .map(|(index, property)| PropertyReport {
                name: property.name.clone(),
                kind: property.kind.describe(),
                usage: usages.map_or(Usage::Unused("not the table of points"), |usages| usages[index]),
            })
            .collect(),
    }
}
