//! Clouds as text.

use crate::decimals::decimals;
use crate::ply::writer::{Shortest, one_word};
use crate::srgb::srgb8_from_linear;
use crate::{AtomicFile, Error};
use splat_core::{Cloud, Shapes};
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Writes a cloud as text, in one step ([`AtomicFile`]): a first line with names, then a row a point: `x y z`, and where
/// the cloud has them `r g b` (sRGB, 0 to 255), `alpha`, `nx ny nz`, `radius` (sigma), and its scalar fields.
///
/// `separator` stands between the numbers; where it is a blank, the names are a comment (`#`). Coordinates have the
/// decimals that the cloud's own have, if they are few, else as many digits as give the same number again. Axes of ellipses,
/// areas and texture coordinates have no columns.
///
/// # Errors
/// [`Error::Io`]; [`Error::Core`] if the cloud's arrays differ in length.
pub fn write_text(path: &Path, cloud: &Cloud, separator: char) -> Result<(), Error> {
    cloud.check_lengths().map_err(Error::core(path))?;
    let mut file = AtomicFile::create(path)?;
    let mut out = BufWriter::with_capacity(1 << 18, &mut file);
    let written =
        write_names(&mut out, cloud, separator).and_then(|()| write_rows(&mut out, cloud, separator));
    written.and_then(|()| out.flush()).map_err(Error::io(path, "write"))?;
    drop(out);
    file.commit()
}

/// The sizes, if any is known.
fn sizes(cloud: &Cloud) -> Option<&[f32]> {
    match &cloud.shapes {
        Shapes::Discs(sizes) if sizes.iter().any(|&size| size != 0.0) => Some(sizes),
        _ => None,
    }
}

fn write_names(out: &mut impl Write, cloud: &Cloud, separator: char) -> io::Result<()> {
    let mut names = vec!["x", "y", "z"];
    let groups = [
        (cloud.colors.is_some(), &["r", "g", "b"][..]),
        (cloud.opacities.is_some(), &["alpha"]),
        (!cloud.normals.is_empty(), &["nx", "ny", "nz"]),
        (sizes(cloud).is_some(), &["radius"]),
    ];
    names.extend(groups.into_iter().filter(|(is_there, _)| *is_there).flat_map(|(_, names)| names));
    let fields = cloud.fields.iter().map(|field| one_word(&field.name).replace([',', ';'], "_"));
    let names: Vec<String> = names.into_iter().map(str::to_owned).chain(fields).collect();
    let comment = if separator == ' ' { "# " } else { "" };
    writeln!(out, "{comment}{}", names.join(&separator.to_string()))
}

fn write_rows(out: &mut impl Write, cloud: &Cloud, separator: char) -> io::Result<()> {
    let decimals = decimals(cloud).and_then(|decimals| usize::try_from(decimals).ok());
    let sizes = sizes(cloud);
    for index in 0..cloud.len() {
        for (axis, coordinate) in cloud.world_position(index).to_array().into_iter().enumerate() {
            if axis > 0 {
                write!(out, "{separator}")?;
            }
            match decimals {
                Some(decimals) => write!(out, "{coordinate:.decimals$}")?,
                None => write!(out, "{}", Shortest(coordinate))?,
            }
        }
        if let Some(colors) = &cloud.colors {
            for channel in colors[index].to_array() {
                write!(out, "{separator}{}", srgb8_from_linear(f64::from(channel)))?;
            }
        }
        if let Some(opacities) = &cloud.opacities {
            write!(out, "{separator}{}", Shortest(opacities[index]))?;
        }
        if let Some(normal) = cloud.normals.get(index) {
            for component in normal.to_array() {
                write!(out, "{separator}{}", Shortest(component))?;
            }
        }
        if let Some(sizes) = sizes {
            write!(out, "{separator}{}", Shortest(sizes[index]))?;
        }
        for field in &cloud.fields {
            write!(out, "{separator}{}", Shortest(field.values[index]))?;
        }
        writeln!(out)?;
    }
    Ok(())
}
