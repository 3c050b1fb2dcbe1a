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
//!
//! Integer colors are sRGB: `uchar` and `ushort` over their type's range, `char` as if it were `uchar`, other
//! types as 8-bit levels, clamped to 0 to 255.
//!
//! Everything else (`confidence`, `quality`, `intensity`, texture coordinates, faces) is reported as not
//! used. Two comments that [`write_ply`] leaves are understood: `comment splat oriented 0|1` (normals from a
//! file are oriented unless it says 0) and `comment splat origin X Y Z` (the cloud's origin, used if it keeps
//! every position exactly).
//!
//! ASCII numbers are read with the precision of `f64` whatever type is declared, since many programs declare
//! `float` and write more digits. A row is a line; blank lines between rows are skipped.

mod ascii;
mod binary;
mod columns;
mod header;
mod roles;
mod scalar;
mod source;
#[cfg(test)]
mod tests;
mod tone;
mod writer;

pub use writer::{PlyEncoding, write_ply};

use crate::{ElementReport, Error, Import, ImportReport, PropertyReport, Usage};
use columns::Columns;
use header::{Element, Format, Header};
use source::Source;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Reads a cloud from a PLY file. See the [module](self) for what is understood.
///
/// A file with a vertex element of no rows is an empty cloud. Bad points (not finite, zero normal, negative
/// size) stay in their rows; the renderer recognises them.
///
/// # Errors
/// [`Error::Io`]; [`Error::Unsupported`] for trained Gaussian splats, compressed splats and what is no
/// regular file; [`Error::Invalid`] for anything malformed, truncated, or claiming more rows than the file
/// can hold; [`Error::Limit`] for a header of more than 1 MiB, 2^32 - 1 points or more, or more points than
/// memory.
pub fn read_ply(path: &Path) -> Result<Import, Error> {
    let file = File::open(path).map_err(Error::io(path, "open"))?;
    let metadata = file.metadata().map_err(Error::io(path, "read"))?;
    if !metadata.is_file() {
        return Err(Error::unsupported(path, "reading a folder, device or pipe", "a regular file"));
    }
    read_ply_from(file, metadata.len(), path)
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
    let points = header.points(path)?;
    header.check_claims(points, &source)?;

    let element = &header.elements[points];
    let mut columns = Columns::new(element, path)?;
    match header.format {
        Format::Ascii => ascii::read(&mut source, &header, points, &mut columns)?,
        Format::BinaryLittleEndian => binary::read::<_, false>(&mut source, &header, points, &mut columns)?,
        Format::BinaryBigEndian => binary::read::<_, true>(&mut source, &header, points, &mut columns)?,
    }
    let (sha256, bytes) = source.finish()?;

    let outcome = columns.finish(&header);
    let mut assumptions = outcome.assumptions;
    for (index, other) in header.elements.iter().enumerate().filter(|(_, other)| other.count > 0) {
        if index != points {
            let (name, rows) = (&other.name, other.count);
            assumptions.push(format!("element {name} ({rows} rows) is ignored: only points are drawn"));
        }
    }
    let elements = header.elements.iter().enumerate();
    let elements =
        elements.map(|(index, element)| report(element, (index == points).then_some(&outcome.usages)));
    let report = ImportReport {
        path: path.to_owned(),
        format: format!("PLY, {}", header.format.describe()),
        bytes,
        sha256,
        elements: elements.collect(),
        assumptions,
    };
    Ok(Import { cloud: outcome.cloud, report })
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
