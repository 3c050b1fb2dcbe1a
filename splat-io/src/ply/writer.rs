//! Clouds as PLY files.

use crate::{AtomicFile, Error};
use glam::DVec3;
use splat_core::{Cloud, Shapes};
use std::fmt::{self, Display};
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// How [`write_ply`] writes numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PlyEncoding {
    /// Binary, little endian.
    #[default]
    Binary,
    /// Text: the shortest that reads back as the same number.
    Ascii,
}

/// Writes a cloud as a PLY file, in one step ([`AtomicFile`]).
///
/// Positions are `double` if the cloud has an origin other than zero, else `float`; all else is `float`: `nx
/// ny nz`, `radius` (sigma) or `tu_x .. tv_z`, `red green blue` (linear), `opacity`, `area`, `s t ds_du dt_du ds_dv
/// dt_dv`, and the scalar fields under their names (blanks in them become `_`). Spherical harmonics are not written.
/// [`crate::read_ply`] gives the same cloud, bit for bit, provided that normals are unit vectors, that
/// opacities lie in [0, 1], and that origin + offset keeps the offsets' bits (as it does in every cloud that
/// was made from `f64` positions).
///
/// # Errors
/// [`Error::Io`]; [`Error::Core`] if the cloud's arrays differ in length.
pub fn write_ply(path: &Path, cloud: &Cloud, encoding: PlyEncoding) -> Result<(), Error> {
    cloud.check_lengths().map_err(Error::core(path))?;
    let mut file = AtomicFile::create(path)?;
    let mut out = BufWriter::with_capacity(1 << 18, &mut file);
    let written = write_header(&mut out, cloud, encoding).and_then(|()| match encoding {
        PlyEncoding::Binary => write_rows(&mut BinaryRows(&mut out), cloud),
        PlyEncoding::Ascii => write_rows(&mut TextRows { out: &mut out, is_first: true }, cloud),
    });
    written.and_then(|()| out.flush()).map_err(Error::io(path, "write"))?;
    drop(out);
    file.commit()
}

fn write_header(out: &mut impl Write, cloud: &Cloud, encoding: PlyEncoding) -> io::Result<()> {
    let format = match encoding {
        PlyEncoding::Binary => "binary_little_endian",
        PlyEncoding::Ascii => "ascii",
    };
    writeln!(out, "ply\nformat {format} 1.0")?;
    writeln!(out, "comment splat oriented {}", u8::from(cloud.oriented))?;
    if cloud.trained {
        writeln!(out, "comment splat trained 1")?;
    }
    let DVec3 { x, y, z } = cloud.origin;
    writeln!(out, "comment splat origin {} {} {}", Shortest(x), Shortest(y), Shortest(z))?;
    writeln!(out, "element vertex {}", cloud.len())?;

    let position = if cloud.origin == DVec3::ZERO { "float" } else { "double" };
    let properties = |out: &mut dyn Write, kind: &str, names: &[&str]| {
        names.iter().try_for_each(|name| writeln!(out, "property {kind} {name}"))
    };
    properties(out, position, &["x", "y", "z"])?;
    if !cloud.normals.is_empty() {
        properties(out, "float", &["nx", "ny", "nz"])?;
    }
    match &cloud.shapes {
        Shapes::Discs(_) => properties(out, "float", &["radius"])?,
        Shapes::Ellipses(_) => properties(out, "float", &["tu_x", "tu_y", "tu_z", "tv_x", "tv_y", "tv_z"])?,
    }
    if cloud.colors.is_some() {
        properties(out, "float", &["red", "green", "blue"])?;
    }
    if cloud.opacities.is_some() {
        properties(out, "float", &["opacity"])?;
    }
    if cloud.areas.is_some() {
        properties(out, "float", &["area"])?;
    }
    if cloud.texture_coordinates.is_some() {
        properties(out, "float", &["s", "t", "ds_du", "dt_du", "ds_dv", "dt_dv"])?;
    }
    for field in &cloud.fields {
        properties(out, "float", &[&one_word(&field.name)])?;
    }
    writeln!(out, "end_header")
}

fn write_rows(out: &mut impl Rows, cloud: &Cloud) -> io::Result<()> {
    for index in 0..cloud.len() {
        if cloud.origin == DVec3::ZERO {
            out.floats(&cloud.positions[index].to_array())?;
        } else {
            out.doubles(&cloud.world_position(index).to_array())?;
        }
        if let Some(normal) = cloud.normals.get(index) {
            out.floats(&normal.to_array())?;
        }
        match &cloud.shapes {
            Shapes::Discs(sizes) => out.floats(&[sizes[index]])?,
            Shapes::Ellipses(axes) => {
                axes[index].iter().try_for_each(|axis| out.floats(&axis.to_array()))?;
            }
        }
        if let Some(colors) = &cloud.colors {
            out.floats(&colors[index].to_array())?;
        }
        for column in [&cloud.opacities, &cloud.areas].into_iter().flatten() {
            out.floats(&[column[index]])?;
        }
        if let Some(coordinates) = &cloud.texture_coordinates {
            out.floats(&coordinates[index].to_array())?;
        }
        cloud.fields.iter().try_for_each(|field| out.floats(&[field.values[index]]))?;
        out.end()?;
    }
    Ok(())
}

/// A name without blanks.
pub(crate) fn one_word(name: &str) -> String {
    name.chars().map(|c| if c.is_whitespace() || c.is_control() { '_' } else { c }).collect()
}

/// What rows are written to.
trait Rows {
    fn floats(&mut self, values: &[f32]) -> io::Result<()>;
    fn doubles(&mut self, values: &[f64]) -> io::Result<()>;
    fn end(&mut self) -> io::Result<()>;
}

struct BinaryRows<'a, W>(&'a mut W);

impl<W: Write> Rows for BinaryRows<'_, W> {
    fn floats(&mut self, values: &[f32]) -> io::Result<()> {
        values.iter().try_for_each(|value| self.0.write_all(&value.to_le_bytes()))
    }

    fn doubles(&mut self, values: &[f64]) -> io::Result<()> {
        values.iter().try_for_each(|value| self.0.write_all(&value.to_le_bytes()))
    }

    fn end(&mut self) -> io::Result<()> {
        Ok(())
    }
}

struct TextRows<'a, W> {
    out: &'a mut W,
    /// Whether the row is still empty.
    is_first: bool,
}

impl<W: Write> TextRows<'_, W> {
    fn word(&mut self, word: impl Display) -> io::Result<()> {
        let blank = if std::mem::take(&mut self.is_first) { "" } else { " " };
        write!(self.out, "{blank}{word}")
    }
}

impl<W: Write> Rows for TextRows<'_, W> {
    fn floats(&mut self, values: &[f32]) -> io::Result<()> {
        values.iter().try_for_each(|&value| self.word(Shortest(value)))
    }

    fn doubles(&mut self, values: &[f64]) -> io::Result<()> {
        values.iter().try_for_each(|&value| self.word(Shortest(value)))
    }

    fn end(&mut self) -> io::Result<()> {
        self.is_first = true;
        writeln!(self.out)
    }
}

/// The shortest text that reads back as the same number: plain at everyday magnitudes, otherwise with an
/// exponent.
pub(crate) struct Shortest<T>(pub T);

impl<T: Display + fmt::LowerExp + Copy + Into<f64>> Display for Shortest<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let magnitude = self.0.into().abs();
        if magnitude == 0.0 || (1e-5..1e9).contains(&magnitude) || !magnitude.is_finite() {
            write!(f, "{}", self.0)
        } else {
            write!(f, "{:e}", self.0)
        }
    }
}
