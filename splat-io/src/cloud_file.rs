//! Clouds of any format behind one door.

use crate::las::{self, read_las, write_las};
use crate::pcd::read_pcd;
use crate::ply::{PlyEncoding, open, read_ply, write_ply};
use crate::points3d::{find_points3d, read_points3d};
use crate::text::{read_text, write_text};
use crate::trained::{read_splat, read_spz, spz, write_splat};
use crate::{Error, Import};
use splat_core::{Cloud, Field, Shapes};
use std::io::Read;
use std::path::Path;

/// What a caller knows of a file that the file may not say.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct CloudOptions {
    /// What the columns of a text are ([`crate::read_text`]); other formats name theirs.
    pub columns: Option<Vec<String>>,
}

/// The formats of clouds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CloudFormat {
    /// [`crate::ply`].
    Ply,
    /// [`crate::las`], compressed or not.
    Las,
    /// [`crate::pcd`].
    Pcd,
    /// [`crate::trained`], `.spz`.
    Spz,
    /// [`crate::trained`], `.splat`.
    Splat,
    /// [`crate::points3d`].
    Points3d,
    /// [`crate::text`].
    Text,
}

/// Number of bytes that tell the format.
const HEAD_BYTES: u64 = 4096;

/// Reads a cloud. What the file is, its first bytes tell; where they cannot, its name does.
///
/// # Errors
/// Those of the format's reader, and [`Error::Unsupported`] for formats that are known and not read.
pub fn read_cloud(path: &Path, options: &CloudOptions) -> Result<Import, Error> {
    match cloud_format(path)? {
        CloudFormat::Ply => read_ply(path),
        CloudFormat::Las => read_las(path),
        CloudFormat::Pcd => read_pcd(path),
        CloudFormat::Spz => read_spz(path),
        CloudFormat::Splat => read_splat(path),
        CloudFormat::Points3d => read_points3d(&find_points3d(path).unwrap_or_else(|| path.to_owned())),
        CloudFormat::Text => read_text(path, options.columns.as_deref()),
    }
}

/// The format of a file.
///
/// # Errors
/// [`Error::Io`]; [`Error::Unsupported`] for formats that are known and not read.
pub fn cloud_format(path: &Path) -> Result<CloudFormat, Error> {
    if find_points3d(path).is_some() {
        return Ok(CloudFormat::Points3d);
    }
    let (file, _) = open(path)?;
    let mut head = Vec::new();
    file.take(HEAD_BYTES).read_to_end(&mut head).map_err(Error::io(path, "read"))?;
    format_of(&head, path)
}

fn format_of(head: &[u8], path: &Path) -> Result<CloudFormat, Error> {
    let named = |extension: &str| path.extension().is_some_and(|known| known.eq_ignore_ascii_case(extension));
    if head.starts_with(b"ASTM-E57") {
        let advice = "LAS, LAZ or PLY: CloudCompare and PDAL convert E57 to them";
        return Err(Error::unsupported(path, "an E57 file", advice));
    }
    if head.starts_with(b"ply\n") || head.starts_with(b"ply\r") || named("ply") {
        return Ok(CloudFormat::Ply);
    }
    if head.starts_with(b"LASF") || named("las") || named("laz") {
        return Ok(CloudFormat::Las);
    }
    if head.starts_with(&spz::GZIP) || head.starts_with(spz::MAGIC) || named("spz") {
        return Ok(CloudFormat::Spz);
    }
    if named("ksplat") {
        let expected = "trained splats as .ply, .spz or .splat (convert it, for example with SuperSplat)";
        return Err(Error::unsupported(path, "the format .ksplat", expected));
    }
    if named("splat") {
        return Ok(CloudFormat::Splat);
    }
    if begins_pcd(head) || named("pcd") {
        return Ok(CloudFormat::Pcd);
    }
    Ok(CloudFormat::Text)
}

/// Whether the first line that is no comment is one of a PCD header.
fn begins_pcd(head: &[u8]) -> bool {
    let mut lines = head.split(|&byte| byte == b'\n').map(<[u8]>::trim_ascii);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with(b"#"));
    first.is_some_and(|line| {
        [&b"VERSION "[..], b"FIELDS ", b"COLUMNS "].iter().any(|key| line.starts_with(key))
    })
}

/// What a cloud can be written as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CloudTarget {
    /// [`write_ply`].
    Ply,
    /// [`write_las`].
    Las,
    /// [`write_las`], compressed.
    Laz,
    /// [`write_text`], with blanks.
    Text,
    /// [`write_text`], with commas.
    Csv,
    /// [`write_splat`].
    Splat,
}

impl CloudTarget {
    /// The extensions of file names.
    pub const EXTENSIONS: [(&'static str, Self); 8] = [
        ("ply", Self::Ply),
        ("las", Self::Las),
        ("laz", Self::Laz),
        ("xyz", Self::Text),
        ("txt", Self::Text),
        ("asc", Self::Text),
        ("csv", Self::Csv),
        ("splat", Self::Splat),
    ];

    /// What the name of a file says.
    pub fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?;
        let mut known = Self::EXTENSIONS.into_iter();
        known.find(|(known, _)| extension.eq_ignore_ascii_case(known)).map(|(_, target)| target)
    }

    /// What of a cloud the format has no place for.
    fn lacks(self, cloud: &Cloud) -> Vec<&'static str> {
        let is_ellipses = matches!(cloud.shapes, Shapes::Ellipses(_));
        let has_sizes =
            matches!(&cloud.shapes, Shapes::Discs(sizes) if sizes.iter().any(|&size| size != 0.0));
        let in_las = matches!(self, Self::Las | Self::Laz);
        let known = |field: &Field| las::FIELD_NAMES.iter().any(|name| field.name.eq_ignore_ascii_case(name));
        let [in_ply, in_splat] = [self == Self::Ply, self == Self::Splat];
        let lacks = [
            (in_las && !cloud.normals.is_empty(), "normals"),
            ((is_ellipses && !in_splat && !in_ply) || (in_las && has_sizes), "sizes"),
            (in_las && cloud.opacities.is_some(), "opacities"),
            (!in_ply && cloud.areas.is_some(), "areas"),
            (!in_ply && cloud.texture_coordinates.is_some(), "texture coordinates"),
            (in_las && !cloud.fields.iter().all(known), "fields that are none of LAS"),
            (in_splat && !cloud.fields.is_empty(), "scalar fields"),
            (cloud.harmonics.is_some(), "colours that depend on the view"),
        ];
        lacks.into_iter().filter(|(lacks, _)| *lacks).map(|(_, what)| what).collect()
    }
}

/// Writes a cloud. Says what could not be written, a sentence each.
///
/// # Errors
/// Those of the format's writer.
pub fn write_cloud(
    path: &Path,
    cloud: &Cloud,
    target: CloudTarget,
    encoding: PlyEncoding,
) -> Result<Vec<String>, Error> {
    let mut notes = Vec::new();
    match target {
        CloudTarget::Ply => write_ply(path, cloud, encoding)?,
        CloudTarget::Las | CloudTarget::Laz => {
            let left_out = write_las(path, cloud, target == CloudTarget::Laz)?;
            if left_out > 0 {
                notes.push(format!("{left_out} points without finite coordinates are left out"));
            }
        }
        CloudTarget::Text => write_text(path, cloud, ' ')?,
        CloudTarget::Csv => write_text(path, cloud, ',')?,
        CloudTarget::Splat => {
            let left_out = write_splat(path, cloud)?;
            if left_out > 0 {
                notes.push(format!("{left_out} points that cannot be drawn are left out"));
            }
        }
    }
    let lacks = target.lacks(cloud);
    if !lacks.is_empty() {
        notes.push(format!("the format has no place for {}", lacks.join(", ")));
    }
    Ok(notes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contents_tell_the_format_before_the_name_does() {
        let cases: [(&[u8], &str, CloudFormat); 11] = [
            (b"ply\nformat ascii 1.0\n", "a.txt", CloudFormat::Ply),
            (b"LASF", "a.xyz", CloudFormat::Las),
            (b"# .PCD v0.7\nVERSION 0.7\n", "a", CloudFormat::Pcd),
            (b"1 2 3\n", "a.pcd", CloudFormat::Pcd),
            (b"# 1 2 3\n1 2 3\n", "a", CloudFormat::Text),
            (b"", "a.LAZ", CloudFormat::Las),
            (b"", "a.ply", CloudFormat::Ply),
            (b"", "a.xyz", CloudFormat::Text),
            (b"NGSP", "a", CloudFormat::Spz),
            (b"\x1f\x8b", "a", CloudFormat::Spz),
            (b"1 2 3", "a.splat", CloudFormat::Splat),
        ];
        for (head, name, format) in cases {
            assert_eq!(format_of(head, Path::new(name)).unwrap(), format, "{name}");
        }
        let refused = format_of(b"ASTM-E57\x01", Path::new("a.e57")).unwrap_err().to_string();
        assert!(refused.contains("CloudCompare"), "{refused}");
    }
}
