//! `.splat` files: 32 bytes a splat, no header.
//!
//! Position and scales (standard deviations) are three little-endian `f32` each; then r, g, b (sRGB) and the opacity, and
//! the rotation w, x, y, z, a byte each, of which 128 is 0 and 0 is -1.

use super::{Gaussian, Gaussians};
use crate::ply::open;
use crate::source::Source;
use crate::srgb::srgb8_from_linear;
use crate::{AtomicFile, ElementReport, Error, Import, ImportReport, Place, PropertyReport, Usage};
use glam::{DMat3, DQuat, DVec3, Vec3};
use splat_core::harmonics::constant_term;
use splat_core::{Cloud, Shapes};
use std::io::{BufWriter, Read, Write};
use std::path::Path;

/// Bytes a splat.
const BYTES: usize = 32;

/// The third scale of a surfel, relative to the lesser of the others: a viewer may take the logarithm of it.
const FLATNESS: f64 = 1e-3;

/// Reads trained splats from a `.splat` file.
///
/// # Errors
/// [`Error::Io`]; [`Error::Unsupported`] for what is no regular file; [`Error::Invalid`] for a size that is no multiple
/// of 32 bytes; [`Error::Limit`] for 2^32 - 1 splats or more, or more than memory.
pub fn read_splat(path: &Path) -> Result<Import, Error> {
    let (file, size) = open(path)?;
    read_splat_from(file, size, path)
}

/// Reads trained splats from the `size` bytes of a `.splat` file that `reader` yields; `path` is its name in messages.
///
/// # Errors
/// As [`read_splat`].
pub fn read_splat_from(reader: impl Read, size: u64, path: &Path) -> Result<Import, Error> {
    if !size.is_multiple_of(BYTES as u64) {
        let found = format!("{size} bytes");
        return Err(Error::invalid(path, Place::File, found, "a multiple of 32 bytes, one record a splat"));
    }
    let count = size / BYTES as u64;
    let too_many = |limit: &str| Error::limit(path, format!("a cloud of {count} splats"), limit);
    if count >= u64::from(u32::MAX) {
        return Err(too_many("4294967294 splats"));
    }
    let mut source = Source::new(reader, size, path);
    let room = Gaussians::with_room(count as usize, 0);
    let mut gaussians = room.map_err(|_| too_many("this machine's memory"))?;
    for splat in 0..count {
        if !source.want(BYTES)? {
            let found = "the end of the file";
            return Err(Error::invalid(
                path,
                Place::Byte(splat * BYTES as u64),
                found,
                format!("{count} splats"),
            ));
        }
        if let Some(record) = source.window().first_chunk() {
            let (gaussian, term) = decode(record);
            gaussians.push(&gaussian, &[term]);
        }
        source.consume(BYTES);
    }
    let (sha256, bytes) = source.finish()?;
    let mut assumptions = gaussians.assumptions(false);
    assumptions.push("8-bit colours are taken as sRGB".to_owned());
    let report = ImportReport {
        path: path.to_owned(),
        format: "splat".to_owned(),
        bytes,
        sha256,
        elements: vec![element(count)],
        assumptions,
        losses: Vec::new(),
    };
    Ok(Import { cloud: gaussians.finish(), report })
}

/// What the records hold.
fn element(count: u64) -> ElementReport {
    let property = |name: &str, kind: &str, usage| PropertyReport {
        name: name.to_owned(),
        kind: kind.to_owned(),
        usage,
    };
    ElementReport {
        name: "splat".to_owned(),
        count,
        is_points: true,
        properties: vec![
            property("position", "3 float", Usage::Position),
            property("scale", "3 float", Usage::Size),
            property("rgb", "3 uchar", Usage::Color),
            property("opacity", "uchar", Usage::Opacity),
            property("rotation", "4 uchar", Usage::Rotation),
        ],
    }
}

/// A splat, and the constant term of its colour.
fn decode(record: &[u8; BYTES]) -> (Gaussian, Vec3) {
    let floats = record.as_chunks::<4>().0;
    let float = |index: usize| f64::from(f32::from_le_bytes(floats[index]));
    let ([r, g, b, opacity], rotation) = (floats[6], floats[7]);
    let gaussian = Gaussian {
        position: DVec3::new(float(0), float(1), float(2)),
        scales: [float(3), float(4), float(5)],
        rotation: rotation.map(|byte| (f64::from(byte) - 128.0) / 128.0),
        opacity: f64::from(opacity) / 255.0,
    };
    (gaussian, Vec3::from_array([r, g, b].map(|level| constant_term(f32::from(level) / 255.0))))
}

/// Writes a complete cloud (with normals and sizes) as a `.splat` file, in one step ([`AtomicFile`]), and gives the number
/// of splats that were left out because they have a defect.
///
/// Positions are `f32` in the world: of map coordinates little is left. Colours are those of [`Cloud::colors`], in 8 bits,
/// white where there are none; what depends on the view is lost. A splat is as good as flat: its third scale is a
/// thousandth of the lesser of the others.
///
/// # Errors
/// [`Error::Io`]; [`Error::Core`] if the cloud's arrays differ in length.
pub fn write_splat(path: &Path, cloud: &Cloud) -> Result<usize, Error> {
    cloud.check_lengths().map_err(Error::core(path))?;
    let mut file = AtomicFile::create(path)?;
    let mut out = BufWriter::with_capacity(1 << 18, &mut file);
    let mut skipped = 0;
    for index in 0..cloud.len() {
        if cloud.defect(index).is_some() {
            skipped += 1;
        } else {
            out.write_all(&encode(cloud, index)).map_err(Error::io(path, "write"))?;
        }
    }
    out.flush().map_err(Error::io(path, "write"))?;
    drop(out);
    file.commit()?;
    Ok(skipped)
}

fn encode(cloud: &Cloud, index: usize) -> [u8; BYTES] {
    let [major, minor] = principal_axes(world_axes(cloud, index));
    let scales = [major.length(), minor.length(), FLATNESS * major.length().min(minor.length())];
    let (u, v) = (major.normalize(), minor.normalize());
    let rotation = DQuat::from_mat3(&DMat3::from_cols(u, v, u.cross(v)));
    let color = cloud.colors.as_ref().map_or(Vec3::ONE, |colors| colors[index]);
    let opacity = cloud.opacities.as_ref().map_or(1.0, |opacities| opacities[index]);

    let mut record = [0; BYTES];
    let numbers = cloud.world_position(index).to_array().into_iter().chain(scales);
    for (bytes, number) in record.as_chunks_mut::<4>().0.iter_mut().zip(numbers) {
        *bytes = (number as f32).to_le_bytes();
    }
    let levels = color.to_array().map(|value| srgb8_from_linear(value.into()));
    record[24..27].copy_from_slice(&levels);
    record[27] = (opacity.clamp(0.0, 1.0) * 255.0).round() as u8;
    let rotation = [rotation.w, rotation.x, rotation.y, rotation.z];
    record[28..].copy_from_slice(&rotation.map(|value| (value * 128.0 + 128.0).round() as u8));
    record
}

/// The sigma-scaled axes of a splat, in the world.
fn world_axes(cloud: &Cloud, index: usize) -> [DVec3; 2] {
    match &cloud.shapes {
        Shapes::Discs(sizes) => {
            let (u, v) = cloud.normals[index].as_dvec3().normalize().any_orthonormal_pair();
            [u, v].map(|axis| f64::from(sizes[index]) * axis)
        }
        Shapes::Ellipses(axes) => axes[index].map(|axis| axis.as_dvec3()),
    }
}

/// The perpendicular axes of the ellipse that two axes span, the longer one first.
fn principal_axes([t1, t2]: [DVec3; 2]) -> [DVec3; 2] {
    let angle = 0.5 * libm::atan2(2.0 * t1.dot(t2), t1.length_squared() - t2.length_squared());
    let (sin, cos) = (libm::sin(angle), libm::cos(angle));
    [cos * t1 + sin * t2, cos * t2 - sin * t1]
}
