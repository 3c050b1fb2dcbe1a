//! The sparse points of a COLMAP model, `points3D.txt` or `points3D.bin`, as a cloud.
//!
//! Positions and colours (8-bit sRGB) are read; errors and tracks are passed over. There are no normals.

use crate::cameras::colmap::Model;
use crate::cameras::colmap::binary::{count, take};
use crate::lines::Lines;
use crate::source::Source;
use crate::srgb::linear_from_srgb8;
use crate::{ElementReport, Error, Import, ImportReport, Place, PropertyReport, Usage};
use glam::{DVec3, Vec3};
use splat_core::Cloud;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Bytes of a point without its track: number, place, colour, error, length of the track.
const POINT_BYTES: u64 = 8 + 24 + 3 + 8 + 8;

/// Bytes of an entry of a track: image and point.
const TRACK_BYTES: u64 = 8;

/// The file of COLMAP's points that a path means: itself, by its name, or that of the model in a folder.
pub fn find_points3d(path: &Path) -> Option<PathBuf> {
    if path.is_dir() {
        return Some(Model::find(path)?.file("points3D"));
    }
    let is_points = path.file_name().is_some_and(|name| name == "points3D.txt" || name == "points3D.bin");
    is_points.then(|| path.to_owned())
}

/// Reads the points of a COLMAP model; text if the name ends in `.txt`. See the [module](self).
///
/// # Errors
/// [`Error::Io`]; [`Error::Invalid`] for what is malformed, truncated, or claims more points than the file can hold;
/// [`Error::Limit`] for more points than memory.
pub fn read_points3d(path: &Path) -> Result<Import, Error> {
    let (file, size) = crate::ply::open(path)?;
    let source = Source::new(file, size, path);
    let is_text = path.extension().is_some_and(|extension| extension == "txt");
    let mut points = Points::default();
    let source = if is_text { points.read_text(source)? } else { points.read_binary(source)? };
    let (sha256, bytes) = source.finish()?;

    let mut cloud = Cloud::from_points(&points.positions);
    let levels = linear_from_srgb8();
    let linear =
        points.colors.iter().map(|color| Vec3::from_array(color.map(|level| levels[usize::from(level)])));
    cloud.colors = Some(linear.collect());
    let column = |name: &str, kind: &str, usage| PropertyReport {
        name: name.to_owned(),
        kind: kind.to_owned(),
        usage,
    };
    let mut properties = vec![column("POINT3D_ID", "integer", Usage::Unused("a number"))];
    properties.extend(["X", "Y", "Z"].map(|name| column(name, "float", Usage::Position)));
    properties.extend(["R", "G", "B"].map(|name| column(name, "integer", Usage::Color)));
    properties.push(column("ERROR", "float", Usage::Unused("the error of reprojection")));
    properties.push(column("TRACK", "list", Usage::Unused("the images that see the point")));
    let count = cloud.len() as u64;
    let report = ImportReport {
        path: path.to_owned(),
        format: format!("COLMAP points, {}", if is_text { "text" } else { "binary" }),
        bytes,
        sha256,
        elements: vec![ElementReport { name: "points3D".to_owned(), count, is_points: true, properties }],
        assumptions: vec!["colours are 8-bit sRGB".to_owned()],
        losses: Vec::new(),
    };
    Ok(Import { cloud, report })
}

/// What is read of the points.
#[derive(Debug, Default)]
struct Points {
    positions: Vec<DVec3>,
    colors: Vec<[u8; 3]>,
}

impl Points {
    /// Rows of `POINT3D_ID X Y Z R G B ERROR TRACK[]`.
    fn read_text(&mut self, source: Source<File>) -> Result<Source<File>, Error> {
        let mut lines = Lines::new(source);
        while lines.next_row()? {
            let (position, color) = point(lines.text()?)
                .ok_or_else(|| lines.invalid("POINT3D_ID X Y Z R G B ERROR and a track"))?;
            self.positions.push(position);
            self.colors.push(color);
        }
        Ok(lines.source)
    }

    fn read_binary(&mut self, mut source: Source<File>) -> Result<Source<File>, Error> {
        let points = count(&mut source, POINT_BYTES, "points")?;
        let reserved = usize::try_from(points).is_ok_and(|points| {
            self.positions.try_reserve_exact(points).is_ok() && self.colors.try_reserve_exact(points).is_ok()
        });
        if !reserved {
            return Err(Error::limit(source.path(), format!("a count of {points} points"), "the memory"));
        }
        for _ in 0..points {
            let _number: [u8; 8] = take(&mut source)?;
            let mut position = [0.0; 3];
            for value in &mut position {
                *value = f64::from_le_bytes(take(&mut source)?);
            }
            self.positions.push(DVec3::from_array(position));
            self.colors.push(take(&mut source)?);
            let _error: [u8; 8] = take(&mut source)?;
            let track = count(&mut source, TRACK_BYTES, "images that see a point")?;
            source.skip(track * TRACK_BYTES)?;
        }
        if source.left() > 0 {
            let (place, found) = (Place::Byte(source.offset()), format!("{} more bytes", source.left()));
            return Err(Error::invalid(source.path(), place, found, "the end of the file"));
        }
        Ok(source)
    }
}

/// The point of a row.
fn point(row: &str) -> Option<(DVec3, [u8; 3])> {
    let mut words = row.split_ascii_whitespace();
    words.next()?.parse::<u64>().ok()?;
    let mut position = [0.0; 3];
    for value in &mut position {
        *value = words.next()?.parse().ok()?;
    }
    let mut color = [0; 3];
    for level in &mut color {
        *level = words.next()?.parse().ok()?;
    }
    words.next()?.parse::<f64>().ok()?;
    Some((DVec3::from_array(position), color))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn read(name: &str, bytes: &[u8]) -> Result<Import, Error> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        read_points3d(&path)
    }

    /// Two points, the second with a track of one image.
    fn binary() -> Vec<u8> {
        let mut bytes = 2_u64.to_le_bytes().to_vec();
        for (number, track) in [(1_u64, 0_u64), (9, 1)] {
            bytes.extend(number.to_le_bytes());
            bytes.extend([1.5_f64, -2.0, 3.25 * number as f64].map(f64::to_le_bytes).concat());
            bytes.extend([0, 128, 255]);
            bytes.extend(0.5_f64.to_le_bytes());
            bytes.extend(track.to_le_bytes());
            bytes.extend(vec![7; 8 * track as usize]);
        }
        bytes
    }

    #[test]
    fn text_and_binary_agree() {
        let text = "# comment\n1 1.5 -2 3.25 0 128 255 0.5\n\n9 1.5 -2 29.25 0 128 255 0.5 1 2\n";
        let (text, binary) =
            (read("points3D.txt", text.as_bytes()).unwrap(), read("points3D.bin", &binary()).unwrap());
        assert_eq!(text.cloud, binary.cloud);
        assert_eq!(text.cloud.world_position(1), DVec3::new(1.5, -2.0, 29.25));
        assert_eq!(text.cloud.colors.unwrap()[0].z, 1.0);
        assert_eq!(binary.report.elements[0].count, 2);
    }

    #[test]
    fn damage_is_refused() {
        let bytes = binary();
        for end in 0..bytes.len() {
            assert!(read("points3D.bin", &bytes[..end]).is_err(), "the file ends at byte {end}");
        }
        assert!(read("points3D.bin", &[bytes.as_slice(), &[0]].concat()).is_err());
        for place in 0..bytes.len() {
            for value in [0x7f, 0xff] {
                let mut bytes = bytes.clone();
                bytes[place] = value;
                _ = read("points3D.bin", &bytes);
            }
        }
        for row in ["1 2 3", "1 1 1 1 1 1 256 0", "1 1 1 x 1 1 1 0", "a 1 1 1 1 1 1 0", "1 1 1 1 1 1 1"] {
            let message = read("points3D.txt", row.as_bytes()).unwrap_err().to_string();
            assert!(message.contains("line 1: found"), "{message}");
        }
    }
}
