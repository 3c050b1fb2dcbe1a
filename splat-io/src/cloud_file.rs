//! Clouds of any format behind one door.

use crate::las::read_las_from;
use crate::pcd::read_pcd_from;
use crate::ply::{open, read_ply};
use crate::text::read_text_from;
use crate::whole_file::read_whole;
use crate::{Error, Import};
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
        CloudFormat::Las => read_las_from(&read_whole(path)?, path),
        CloudFormat::Pcd => read_pcd_from(&read_whole(path)?, path),
        CloudFormat::Text => read_text_from(&read_whole(path)?, path, options.columns.as_deref()),
    }
}

/// The format of a file.
///
/// # Errors
/// [`Error::Io`]; [`Error::Unsupported`] for formats that are known and not read.
pub fn cloud_format(path: &Path) -> Result<CloudFormat, Error> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contents_tell_the_format_before_the_name_does() {
        let cases: [(&[u8], &str, CloudFormat); 8] = [
            (b"ply\nformat ascii 1.0\n", "a.txt", CloudFormat::Ply),
            (b"LASF", "a.xyz", CloudFormat::Las),
            (b"# .PCD v0.7\nVERSION 0.7\n", "a", CloudFormat::Pcd),
            (b"1 2 3\n", "a.pcd", CloudFormat::Pcd),
            (b"# 1 2 3\n1 2 3\n", "a", CloudFormat::Text),
            (b"", "a.LAZ", CloudFormat::Las),
            (b"", "a.ply", CloudFormat::Ply),
            (b"", "a.xyz", CloudFormat::Text),
        ];
        for (head, name, format) in cases {
            assert_eq!(format_of(head, Path::new(name)).unwrap(), format, "{name}");
        }
        let refused = format_of(b"ASTM-E57\x01", Path::new("a.e57")).unwrap_err().to_string();
        assert!(refused.contains("CloudCompare"), "{refused}");
    }
}
