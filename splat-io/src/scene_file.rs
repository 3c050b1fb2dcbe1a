//! Scene files: TOML that says what a command line would, and where each cloud stands.
//!
//! ```toml
//! [[cloud]]
//! path = "statue.ply"        # relative to the scene file
//! scale = 0.001              # first scaled, then turned, then moved
//! rotate = [90, 0, 0]        # degrees about the world's x, then y, then z
//! translate = [0, 0, 1.5]
//!
//! [camera]
//! view = "30,20"
//! ```
//!
//! This module knows clouds and their places. All else is a [`Setting`], whose name and value are an option's of the
//! program; the program says which there are.

use crate::{Error, Place};
use glam::{DAffine3, DMat3, DMat4, DVec3};
use std::fmt;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Greatest accepted length of a scene file, in bytes.
const MOST_BYTES: u64 = 1 << 20;

/// A scene, as its file has it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SceneFile {
    /// The clouds, in the order of the file.
    pub clouds: Vec<CloudEntry>,
    /// All other tables, in alphabetical order.
    pub sections: Vec<Section>,
}

/// A cloud of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct CloudEntry {
    /// Its file, as the scene file has it: relative to the scene file's folder, or absolute.
    pub path: PathBuf,
    /// Where it stands in the world.
    pub to_world: DAffine3,
    /// What else is said of it.
    pub settings: Vec<Setting>,
}

/// A table of settings.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    /// Its name.
    pub name: String,
    /// The line in which it begins, counted from 1.
    pub line: u64,
    /// What it holds, in alphabetical order.
    pub settings: Vec<Setting>,
}

/// A name with a value.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// The name.
    pub name: String,
    /// The line in which it stands, counted from 1.
    pub line: u64,
    /// The value.
    pub value: Value,
}

/// The value of a setting.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Value {
    /// `true` or `false`.
    Flag(bool),
    /// A text; a number as it is written; the elements of an array, with commas between them.
    Text(String),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Flag(flag) => write!(f, "{flag}"),
            Self::Text(text) => f.write_str(text),
        }
    }
}

/// Reads a scene file.
///
/// # Errors
/// [`Error::Io`]; [`Error::Limit`] for more than 1 MiB; [`Error::Invalid`], with the line, for anything else.
pub fn read_scene(path: &Path) -> Result<SceneFile, Error> {
    let (file, size) = crate::ply::open(path)?;
    if size > MOST_BYTES {
        return Err(Error::limit(path, format!("a scene file of {size} bytes"), "1 MiB"));
    }
    let mut bytes = Vec::new();
    File::take(file, MOST_BYTES).read_to_end(&mut bytes).map_err(Error::io(path, "read"))?;
    let text = String::from_utf8(bytes).map_err(|error| {
        let place = Place::Byte(error.utf8_error().valid_up_to() as u64);
        Error::invalid(path, place, "bytes that are not UTF-8", "text")
    })?;
    parse_scene(&text, path)
}

/// Reads a scene from the text of a file; `path` is its name in messages.
///
/// # Errors
/// As [`read_scene`].
pub fn parse_scene(text: &str, path: &Path) -> Result<SceneFile, Error> {
    // Some editors begin a file with a byte order mark.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let parser = Parser { text, path };
    let document = DeTable::parse(text).map_err(|error| {
        let start = error.span().map_or(0, |span| span.start);
        let found = error.message().lines().collect::<Vec<_>>().join(", ");
        parser.invalid(start, found, "TOML")
    })?;
    let mut scene = SceneFile::default();
    for (name, value) in document.get_ref() {
        match (name.get_ref().as_ref(), value.get_ref()) {
            ("cloud", DeValue::Array(clouds)) => {
                for cloud in clouds.iter() {
                    scene.clouds.push(parser.cloud(cloud)?);
                }
            }
            ("cloud", _) => {
                return Err(parser.invalid(value.span().start, "no array of tables", "[[cloud]]"));
            }
            (name, DeValue::Table(table)) => {
                let settings = parser.settings(table)?;
                scene.sections.push(Section { name: name.to_owned(), line: parser.line(value), settings });
            }
            (name, _) => {
                let found = format!("`{name}` outside of any table");
                return Err(parser.invalid(value.span().start, found, "a table such as [camera]"));
            }
        }
    }
    Ok(scene)
}

/// The text of a file, for places.
struct Parser<'a> {
    text: &'a str,
    path: &'a Path,
}

impl Parser<'_> {
    /// The line of a value, counted from 1.
    fn line<T>(&self, value: &Spanned<T>) -> u64 {
        self.line_at(value.span().start)
    }

    fn line_at(&self, byte: usize) -> u64 {
        let before = self.text.as_bytes().iter().take(byte);
        before.filter(|&&byte| byte == b'\n').count() as u64 + 1
    }

    fn invalid(&self, byte: usize, found: impl Into<String>, expected: impl Into<String>) -> Error {
        Error::invalid(self.path, Place::Line(self.line_at(byte)), found, expected)
    }

    /// A cloud: what is known of it here, and the rest.
    fn cloud(&self, value: &Spanned<DeValue<'_>>) -> Result<CloudEntry, Error> {
        let Some(table) = value.get_ref().as_table() else {
            return Err(self.invalid(value.span().start, "no table", "[[cloud]]"));
        };
        let mut file = None;
        let mut placement = Placement::default();
        let mut settings = Vec::new();
        for (name, value) in table {
            match name.get_ref().as_ref() {
                "path" => {
                    let text = value.get_ref().as_str().filter(|text| !text.is_empty());
                    let text = text.ok_or_else(|| self.invalid(value.span().start, "no path", "a text"))?;
                    file = Some(PathBuf::from(text));
                }
                "scale" => placement.scale = self.scale(value)?,
                "rotate" => placement.rotate = DVec3::from_array(self.numbers(value)?),
                "translate" => placement.translate = DVec3::from_array(self.numbers(value)?),
                "matrix" => placement.matrix = Some(self.matrix(value)?),
                name => settings.push(self.setting(name, value)?),
            }
        }
        let path = file.ok_or_else(|| self.invalid(value.span().start, "a cloud without a path", "path"))?;
        let to_world = placement.to_world();
        if !(to_world.is_finite() && to_world.matrix3.determinant().abs() > 0.0) {
            return Err(self.invalid(
                value.span().start,
                "a cloud without extent",
                "a placement with an inverse",
            ));
        }
        Ok(CloudEntry { path, to_world, settings })
    }

    fn settings(&self, table: &DeTable<'_>) -> Result<Vec<Setting>, Error> {
        table.iter().map(|(name, value)| self.setting(name.get_ref(), value)).collect()
    }

    fn setting(&self, name: &str, value: &Spanned<DeValue<'_>>) -> Result<Setting, Error> {
        let line = self.line(value);
        let value = match value.get_ref() {
            DeValue::Boolean(flag) => Value::Flag(*flag),
            DeValue::Array(elements) => {
                let texts: Result<Vec<_>, _> = elements.iter().map(|element| self.scalar(element)).collect();
                Value::Text(texts?.join(","))
            }
            _ => Value::Text(self.scalar(value)?),
        };
        Ok(Setting { name: name.to_owned(), line, value })
    }

    /// A text, or a number as it is written.
    fn scalar(&self, value: &Spanned<DeValue<'_>>) -> Result<String, Error> {
        match value.get_ref() {
            DeValue::String(text) => Ok(text.clone().into_owned()),
            DeValue::Integer(number) if number.radix() == 10 => Ok(number.as_str().to_owned()),
            DeValue::Float(number) => Ok(number.as_str().to_owned()),
            other => Err(self.invalid(value.span().start, other.type_str(), "a text or a decimal number")),
        }
    }

    /// A finite number.
    fn number(&self, value: &Spanned<DeValue<'_>>) -> Result<f64, Error> {
        let number = match value.get_ref() {
            DeValue::Integer(number) if number.radix() == 10 => number.as_str().parse().ok(),
            DeValue::Float(number) => number.as_str().parse().ok(),
            _ => None,
        };
        let finite = number.filter(|number: &f64| number.is_finite());
        finite.ok_or_else(|| self.invalid(value.span().start, value.get_ref().type_str(), "a finite number"))
    }

    /// So many numbers.
    fn numbers<const N: usize>(&self, value: &Spanned<DeValue<'_>>) -> Result<[f64; N], Error> {
        let elements = value.get_ref().as_array().filter(|elements| elements.len() == N);
        let Some(elements) = elements else {
            return Err(self.invalid(value.span().start, value.get_ref().type_str(), format!("{N} numbers")));
        };
        let mut numbers = [0.0; N];
        for (number, element) in numbers.iter_mut().zip(elements.iter()) {
            *number = self.number(element)?;
        }
        Ok(numbers)
    }

    /// One factor, or one an axis.
    fn scale(&self, value: &Spanned<DeValue<'_>>) -> Result<DVec3, Error> {
        match value.get_ref() {
            DeValue::Array(_) => Ok(DVec3::from_array(self.numbers(value)?)),
            _ => Ok(DVec3::splat(self.number(value)?)),
        }
    }

    /// Four rows of four, for column vectors, the last one 0 0 0 1.
    fn matrix(&self, value: &Spanned<DeValue<'_>>) -> Result<DAffine3, Error> {
        const EXPECTED: &str = "4 rows of 4 numbers, the last one 0 0 0 1";
        let rows = value.get_ref().as_array().filter(|rows| rows.len() == 4);
        let rows = rows.ok_or_else(|| self.invalid(value.span().start, "another value", EXPECTED))?;
        let mut numbers = [[0.0; 4]; 4];
        for (row, found) in numbers.iter_mut().zip(rows.iter()) {
            *row = self.numbers(found)?;
        }
        if numbers[3] != [0.0, 0.0, 0.0, 1.0] {
            return Err(self.invalid(
                value.span().start,
                format!("a last row of {:?}", numbers[3]),
                EXPECTED,
            ));
        }
        Ok(DAffine3::from_mat4(DMat4::from_cols_array_2d(&numbers).transpose()))
    }
}

/// Where a cloud stands, step by step.
struct Placement {
    scale: DVec3,
    /// Degrees.
    rotate: DVec3,
    translate: DVec3,
    /// Before all that.
    matrix: Option<DAffine3>,
}

impl Default for Placement {
    fn default() -> Self {
        Self { scale: DVec3::ONE, rotate: DVec3::ZERO, translate: DVec3::ZERO, matrix: None }
    }
}

impl Placement {
    fn to_world(&self) -> DAffine3 {
        let turn =
            turn(self.rotate.z, DVec3::Z) * turn(self.rotate.y, DVec3::Y) * turn(self.rotate.x, DVec3::X);
        let placed =
            DAffine3 { matrix3: turn * DMat3::from_diagonal(self.scale), translation: self.translate };
        placed * self.matrix.unwrap_or(DAffine3::IDENTITY)
    }
}

/// A turn about an axis; quarters are exact.
fn turn(degrees: f64, axis: DVec3) -> DMat3 {
    let quarters = degrees / 90.0;
    let (sin, cos) = if quarters == quarters.round() {
        [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)][quarters.rem_euclid(4.0) as usize % 4]
    } else {
        (libm::sin(degrees.to_radians()), libm::cos(degrees.to_radians()))
    };
    // Rodrigues: cos 1 + sin [axis] + (1 - cos) axis axis^T.
    let cross = DMat3::from_cols(axis.cross(DVec3::X), axis.cross(DVec3::Y), axis.cross(DVec3::Z));
    let outer = DMat3::from_cols(axis * axis.x, axis * axis.y, axis * axis.z);
    DMat3::from_diagonal(DVec3::splat(cos)) + cross * sin + outer * (1.0 - cos)
}

#[cfg(test)]
mod tests;
