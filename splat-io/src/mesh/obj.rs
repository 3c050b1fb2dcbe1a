//! Wavefront OBJ files.
//!
//! Understood are `v` (with a colour, as `v x y z r g b`), `vt`, `vn` and `f`, in the forms `v`, `v/vt`, `v//vn` and
//! `v/vt/vn`, with indices from 1 or, negative, from the last one back; comments, any line ends, and lines that a
//! backslash continues. Polygons become fans of triangles. Names, groups and materials are passed over, and so are points,
//! lines, curves and free-form surfaces. Memory is bounded by some twenty times the file's size.

use super::{Mesh, MeshImport, NO_INDEX, fan};
use crate::error::quoted;
use crate::ply::open;
use crate::source::Source;
use crate::{ElementReport, Error, ImportReport, Loss, Place};
use glam::{DVec2, DVec3, Vec3};
use std::io::Read;
use std::path::Path;

/// Greatest length of a line with its continuations, in bytes.
const MOST_LINE_BYTES: usize = 64 << 20;

/// What some editors put in front of a text.
const BYTE_ORDER_MARK: &[u8] = "\u{feff}".as_bytes();

/// Statements that say nothing about the surface's shape.
const SILENT: [&[u8]; 18] = [
    b"o",
    b"g",
    b"s",
    b"mg",
    b"usemtl",
    b"mtllib",
    b"usemap",
    b"maplib",
    b"bevel",
    b"c_interp",
    b"d_interp",
    b"lod",
    b"shadow_obj",
    b"trace_obj",
    b"ctech",
    b"stech",
    b"call",
    b"csh",
];

/// Statements of geometry that has no faces.
const OTHER_GEOMETRY: [&[u8]; 19] = [
    b"p", b"l", b"vp", b"curv", b"curv2", b"surf", b"cstype", b"deg", b"bmat", b"step", b"parm", b"trim",
    b"hole", b"scrv", b"sp", b"end", b"con", b"res", b"cdc",
];

/// Reads a mesh from an OBJ file.
///
/// Vertex colours are taken as sRGB, 0 to 1 (0 to 255 if one exceeds 1), and linearised: so programs write them.
///
/// # Errors
/// [`Error::Io`]; [`Error::Unsupported`] for what is no regular file; [`Error::Invalid`], with the line, for anything
/// malformed, for a corner that is not there, and for a file without faces; [`Error::Limit`] for a line of more than
/// 64 MiB, and for 2^32 - 1 vertices or more.
pub fn read_obj(path: &Path) -> Result<MeshImport, Error> {
    let (file, size) = open(path)?;
    read_obj_from(file, size, path)
}

/// Reads a mesh from the `size` bytes of an OBJ file that `reader` yields; `path` is its name in messages.
///
/// # Errors
/// As [`read_obj`].
pub fn read_obj_from(reader: impl Read, size: u64, path: &Path) -> Result<MeshImport, Error> {
    let mut lines = Lines { source: Source::new(reader, size, path), physical: 0, line: Vec::new() };
    let mut parser = Parser::default();
    while let Some(number) = lines.next()? {
        parser.statement(&lines.line, number).map_err(|problem| match problem {
            Problem::Invalid(expected) => {
                Error::invalid(path, Place::Line(number), quoted(lines.line.trim_ascii()), expected)
            }
            Problem::TooMany => Error::limit(
                path,
                format!("line {number}: one more entry"),
                format!("{} entries", NO_INDEX - 1),
            ),
        })?;
    }
    let (sha256, bytes) = lines.source.finish()?;
    let (elements, losses) = (parser.elements(), parser.losses());
    let (mesh, assumptions) = parser.finish(path)?;
    let report = ImportReport {
        path: path.to_owned(),
        format: "OBJ".to_owned(),
        bytes,
        sha256,
        elements,
        assumptions,
        losses,
    };
    Ok(MeshImport { mesh, report })
}

/// The lines of a file, continuations joined.
struct Lines<R> {
    source: Source<R>,
    /// Number of physical lines read.
    physical: u64,
    /// The last line, without its end.
    line: Vec<u8>,
}

impl<R: Read> Lines<R> {
    /// Reads the next line and gives its number (that of its first physical line, from 1), or `None` at the end.
    fn next(&mut self) -> Result<Option<u64>, Error> {
        self.line.clear();
        let number = self.physical + 1;
        if !self.source.want(1)? {
            return Ok(None);
        }
        if number == 1 && self.source.want(3)? && self.source.window().starts_with(BYTE_ORDER_MARK) {
            self.source.consume(BYTE_ORDER_MARK.len());
        }
        while self.physical_line()? && self.line.last() == Some(&b'\\') {
            self.line.pop();
            self.line.push(b' ');
        }
        Ok(Some(number))
    }

    /// Appends a physical line; `false` at the end of the file.
    fn physical_line(&mut self) -> Result<bool, Error> {
        self.physical += 1;
        while self.source.want(1)? {
            let window = self.source.window();
            let end = window.iter().position(|&byte| matches!(byte, b'\n' | b'\r'));
            let length = end.unwrap_or(window.len());
            if self.line.len() + length > MOST_LINE_BYTES {
                let what = format!("line {} of more than 64 MiB", self.physical);
                return Err(Error::limit(self.source.path(), what, "64 MiB"));
            }
            self.line.extend_from_slice(&window[..length]);
            self.source.consume(length);
            if end.is_some() {
                let pair = self.source.want(2)? && self.source.window().starts_with(b"\r\n");
                self.source.consume(if pair { 2 } else { 1 });
                return Ok(true);
            }
        }
        Ok(false)
    }
}

/// Why a statement is refused.
enum Problem {
    /// Because this was expected.
    Invalid(String),
    /// Because there is no index for it.
    TooMany,
}

impl From<&str> for Problem {
    fn from(expected: &str) -> Self {
        Self::Invalid(expected.to_owned())
    }
}

/// The corner of a face: indices of a position, a texture coordinate and a normal.
type Corner = [u32; 3];

/// A mesh half read.
#[derive(Default)]
struct Parser {
    mesh: Mesh,
    /// One a position, if any vertex had a colour.
    colors: Vec<[f64; 3]>,
    faces: u64,
    /// Whether any face has normals or texture coordinates.
    has_texture: bool,
    has_normals: bool,
    /// The greatest index used of each kind, and its line.
    greatest: [(u64, u64); 3],
    /// Lines that are passed over, and the number of the first.
    other_geometry: (u64, u64),
    unknown: (u64, u64),
    /// What that line begins with.
    first_unknown: String,
    /// The face that is being read.
    corners: Vec<Corner>,
}

impl Parser {
    /// Takes a line.
    fn statement(&mut self, line: &[u8], number: u64) -> Result<(), Problem> {
        let mut words = line
            .split(u8::is_ascii_whitespace)
            .filter(|word| !word.is_empty())
            .take_while(|word| !word.starts_with(b"#"));
        let Some(keyword) = words.next() else { return Ok(()) };
        match keyword {
            b"v" => self.vertex(words),
            b"vt" => {
                let values = numbers::<3>(words, "1 to 3 numbers after `vt`")?;
                let values = values.get(..).filter(|values| !values.is_empty());
                let values = values.ok_or("1 to 3 numbers after `vt`")?;
                let coordinates = DVec2::new(values[0], values.get(1).copied().unwrap_or(0.0));
                push(&mut self.mesh.texture_coordinates, coordinates)
            }
            b"vn" => {
                let values = numbers::<3>(words, "3 numbers after `vn`")?;
                let values: [f64; 3] = (*values).try_into().map_err(|_| "3 numbers after `vn`")?;
                push(&mut self.mesh.normals, DVec3::from(values).as_vec3())
            }
            b"f" | b"fo" => self.face(words, number),
            _ if SILENT.contains(&keyword) => Ok(()),
            _ if OTHER_GEOMETRY.contains(&keyword) => {
                count_line(&mut self.other_geometry, number);
                Ok(())
            }
            _ => {
                if self.unknown.0 == 0 {
                    self.first_unknown = format!("{} in line {number}", quoted(keyword));
                }
                count_line(&mut self.unknown, number);
                Ok(())
            }
        }
    }

    /// `v x y z`, perhaps a weight, perhaps a colour.
    fn vertex<'a>(&mut self, words: impl Iterator<Item = &'a [u8]>) -> Result<(), Problem> {
        const EXPECTED: &str = "`v x y z`, `v x y z w`, or `v x y z r g b`";
        let values = numbers::<7>(words, EXPECTED)?;
        let color = match values[..] {
            [_, _, _] | [_, _, _, _] => None,
            [_, _, _, r, g, b] | [_, _, _, r, g, b, _] => Some([r, g, b]),
            _ => return Err(EXPECTED.into()),
        };
        let count = self.mesh.positions.len();
        push(&mut self.mesh.positions, DVec3::from_slice(&values[..3]))?;
        if let Some(color) = color {
            self.colors.resize(count, [1.0; 3]);
            self.colors.push(color);
        }
        Ok(())
    }

    /// A face, its corners one a word.
    fn face<'a>(&mut self, words: impl Iterator<Item = &'a [u8]>, number: u64) -> Result<(), Problem> {
        let counts =
            [self.mesh.positions.len(), self.mesh.texture_coordinates.len(), self.mesh.normals.len()];
        let mut corners = std::mem::take(&mut self.corners);
        corners.clear();
        for word in words {
            corners.push(corner(word, counts)?);
        }
        if corners.len() < 3 {
            return Err("a face of at least 3 corners".into());
        }
        for (kind, (greatest, line)) in self.greatest.iter_mut().enumerate() {
            let used = corners.iter().map(|corner| corner[kind]).filter(|&index| index != NO_INDEX);
            if let Some(index) = used.max().map(u64::from).filter(|&index| index + 1 > *greatest) {
                (*greatest, *line) = (index + 1, number);
            }
        }
        // A kind that a corner lacks counts for none.
        let has = |kind: usize| corners.iter().all(|corner| corner[kind] != NO_INDEX);
        let (has_texture, has_normals) = (has(1), has(2));
        let before = self.mesh.triangles.len();
        let mesh = &mut self.mesh;
        self.has_texture |= has_texture;
        self.has_normals |= has_normals;
        for (is_kept, has, kind, triangles) in [
            (self.has_texture, has_texture, 1, &mut mesh.texture_triangles),
            (self.has_normals, has_normals, 2, &mut mesh.normal_triangles),
        ] {
            if is_kept {
                triangles.resize(before, [NO_INDEX; 3]);
                fan(corners.len(), |i| if has { corners[i][kind] } else { NO_INDEX }, triangles);
            }
        }
        fan(corners.len(), |i| corners[i][0], &mut mesh.triangles);
        self.faces += 1;
        self.corners = corners;
        Ok(())
    }

    /// What the file has, for the report.
    fn elements(&self) -> Vec<ElementReport> {
        let [positions, coordinates, normals] =
            [self.mesh.positions.len(), self.mesh.texture_coordinates.len(), self.mesh.normals.len()];
        let counts =
            [("v", positions as u64), ("vt", coordinates as u64), ("vn", normals as u64), ("f", self.faces)];
        let element = |(name, count): (&str, u64)| ElementReport {
            name: name.to_owned(),
            count,
            is_points: name == "v",
            properties: Vec::new(),
        };
        counts.into_iter().filter(|&(_, count)| count > 0).map(element).collect()
    }

    /// The lines that are passed over.
    fn losses(&self) -> Vec<Loss> {
        let kinds = [
            (self.other_geometry, "lines of points, lines, curves or free-form surfaces"),
            (self.unknown, "lines of unknown meaning"),
        ];
        kinds
            .into_iter()
            .filter_map(|((count, line), what)| Loss::new(what, count, format!("line {line}")))
            .collect()
    }

    /// Checks what could not be checked before, and says what was assumed.
    fn finish(self, path: &Path) -> Result<(Mesh, Vec<String>), Error> {
        let mut mesh = self.mesh;
        if mesh.triangles.is_empty() {
            let found = format!("no face among {} vertices", mesh.positions.len());
            return Err(Error::invalid(
                path,
                Place::File,
                found,
                "at least one line `f`: a surface to sample",
            ));
        }
        let counts = [mesh.positions.len(), mesh.texture_coordinates.len(), mesh.normals.len()];
        for ((kind, count), (greatest, line)) in ["v", "vt", "vn"].into_iter().zip(counts).zip(self.greatest)
        {
            if greatest > count as u64 {
                let found = format!("a face with `{kind}` {greatest}");
                let expected = format!("1 to {count}, as many `{kind}` as the file has");
                return Err(Error::invalid(path, Place::Line(line), found, expected));
            }
        }
        let mut assumptions = Vec::new();
        if !self.colors.is_empty() {
            let (colors, assumption) = linear_colors(self.colors, mesh.positions.len());
            mesh.colors = Some(colors);
            assumptions.push(assumption);
        }
        if let (count @ 1.., _) = self.other_geometry {
            assumptions.push(format!(
                "{count} lines of points, lines, curves or free-form surfaces are passed over"
            ));
        }
        if let ((count @ 1.., _), first) = (self.unknown, self.first_unknown) {
            assumptions.push(format!("{count} lines of unknown meaning are passed over, the first {first}"));
        }
        Ok((mesh, assumptions))
    }
}

/// Counts a line, and keeps the number of the first.
fn count_line((count, first): &mut (u64, u64), line: u64) {
    if *count == 0 {
        *first = line;
    }
    *count += 1;
}

/// sRGB colours made linear, for so many vertices; those without are white.
fn linear_colors(mut colors: Vec<[f64; 3]>, count: usize) -> (Vec<Vec3>, String) {
    let greatest = colors.as_flattened().iter().copied().fold(0.0, f64::max);
    let (scale, range) = if greatest > 1.0 { (255.0, "0 to 255") } else { (1.0, "0 to 1") };
    colors.resize(count, [scale; 3]);
    let linear = |value: f64| splat_core::srgb::decode((value / scale).clamp(0.0, 1.0)) as f32;
    let colors = colors.into_iter().map(|color| Vec3::from(color.map(linear))).collect();
    (colors, format!("the vertex colors are taken as sRGB, {range}, and linearised"))
}

/// Up to N numbers.
struct Numbers<const N: usize> {
    values: [f64; N],
    count: usize,
}

impl<const N: usize> std::ops::Deref for Numbers<N> {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.values[..self.count]
    }
}

/// At most N numbers, one a word.
fn numbers<'a, const N: usize>(
    words: impl Iterator<Item = &'a [u8]>,
    expected: &str,
) -> Result<Numbers<N>, Problem> {
    let mut numbers = Numbers { values: [0.0; N], count: 0 };
    for word in words {
        let value = str::from_utf8(word).ok().and_then(|word| word.parse().ok()).ok_or(expected)?;
        *numbers.values.get_mut(numbers.count).ok_or(expected)? = value;
        numbers.count += 1;
    }
    Ok(numbers)
}

/// Adds an entry, if it can have an index.
fn push<T>(entries: &mut Vec<T>, entry: T) -> Result<(), Problem> {
    if entries.len() >= NO_INDEX as usize - 1 {
        return Err(Problem::TooMany);
    }
    entries.push(entry);
    Ok(())
}

/// A corner: `v`, `v/vt`, `v//vn` or `v/vt/vn`; `counts` are the entries so far, from which negative indices count back.
fn corner(word: &[u8], counts: [usize; 3]) -> Result<Corner, Problem> {
    let mut corner = [NO_INDEX; 3];
    let mut parts = word.split(|&byte| byte == b'/');
    for (kind, index) in corner.iter_mut().enumerate() {
        match parts.next() {
            Some(b"") if kind > 0 => {}
            Some(part) => *index = resolve(part, counts[kind])?,
            None => break,
        }
    }
    if parts.next().is_some() {
        return Err("corners as `v`, `v/vt`, `v//vn` or `v/vt/vn`".into());
    }
    Ok(corner)
}

/// The index, from 0, that a word stands for. Whether there is such an entry is known only at the end of the file.
fn resolve(word: &[u8], count: usize) -> Result<u32, Problem> {
    const EXPECTED: &str = "whole numbers in corners: from 1, or from -1 back to the first entry";
    let index: i64 = str::from_utf8(word).ok().and_then(|word| word.parse().ok()).ok_or(EXPECTED)?;
    let index = match index {
        1.. => index - 1,
        0 => return Err(EXPECTED.into()),
        _ => index.checked_add(count as i64).filter(|&index| index >= 0).ok_or(EXPECTED)?,
    };
    u32::try_from(index).ok().filter(|&index| index != NO_INDEX).ok_or_else(|| EXPECTED.into())
}
