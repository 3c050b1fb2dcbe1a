//! A cloud that was read, and what was understood of its file.

use splat_core::Cloud;
use std::fmt;
use std::path::PathBuf;

/// A cloud from a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Import {
    /// The cloud: as many splats as the file has rows, bad ones included.
    pub cloud: Cloud,
    /// What the file holds and how it was read.
    pub report: ImportReport,
}

/// What a file holds, and every assumption made in reading it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ImportReport {
    /// The file.
    pub path: PathBuf,
    /// The format, as text: "PLY, binary little endian".
    pub format: String,
    /// Size of the file, in bytes.
    pub bytes: u64,
    /// SHA-256 of the whole file, in lower-case hexadecimal.
    pub sha256: String,
    /// The file's tables, in its order.
    pub elements: Vec<ElementReport>,
    /// What was assumed, a sentence each.
    pub assumptions: Vec<String>,
    /// What was passed over or changed because it is out of order: a strict caller refuses the file.
    pub losses: Vec<Loss>,
}

/// Something in a file that was passed over or changed, so that the rest can be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Loss {
    /// What, in the plural: "opacities outside [0, 1]".
    pub what: String,
    /// How many.
    pub count: u64,
    /// Where the first one is: "point 17", counted from 0 as the rows of a file are.
    pub first: String,
}

impl Loss {
    /// So many of these, the first of them there; `None` if there is none.
    pub fn new(what: impl Into<String>, count: u64, first: impl Into<String>) -> Option<Self> {
        (count > 0).then(|| Self { what: what.into(), count, first: first.into() })
    }
}

impl fmt::Display for Loss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} (the first: {})", self.count, self.what, self.first)
    }
}

/// One table of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ElementReport {
    /// Its name.
    pub name: String,
    /// Number of rows that the file claims (and, for the table of points, has).
    pub count: u64,
    /// Whether it is the table of points.
    pub is_points: bool,
    /// Its columns, in the file's order.
    pub properties: Vec<PropertyReport>,
}

/// One column of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PropertyReport {
    /// Its name.
    pub name: String,
    /// Its type: "float", "uchar", "list uchar int".
    pub kind: String,
    /// What it is used for.
    pub usage: Usage,
}

/// What a column is used for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Usage {
    /// A coordinate.
    Position,
    /// A component of the normal.
    Normal,
    /// A channel of the colour.
    Color,
    /// The opacity.
    Opacity,
    /// The size: sigma.
    Size,
    /// The surface area.
    Area,
    /// A component of a tangent axis.
    Tangent,
    /// A texture coordinate.
    TextureCoordinate,
    /// A derivative of a texture coordinate along a tangent axis.
    TextureDerivative,
    /// A component of a rotation.
    Rotation,
    /// A coefficient of spherical harmonics: a part of the colour.
    Harmonic,
    /// A bound, between which packed numbers lie.
    Bounds,
    /// A scalar field of the cloud.
    Field,
    /// A list of the vertices of a face.
    Face,
    /// Nothing, for this reason.
    Unused(&'static str),
}

impl fmt::Display for Usage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Position => write!(f, "position"),
            Self::Normal => write!(f, "normal"),
            Self::Color => write!(f, "color"),
            Self::Opacity => write!(f, "opacity"),
            Self::Size => write!(f, "size"),
            Self::Area => write!(f, "area"),
            Self::Tangent => write!(f, "tangent axis"),
            Self::TextureCoordinate => write!(f, "texture coordinate"),
            Self::TextureDerivative => write!(f, "derivative of a texture coordinate, per sigma"),
            Self::Rotation => write!(f, "rotation"),
            Self::Harmonic => write!(f, "color, by direction"),
            Self::Bounds => write!(f, "bounds of packed numbers"),
            Self::Field => write!(f, "scalar field"),
            Self::Face => write!(f, "the corners of faces"),
            Self::Unused(reason) => write!(f, "not used ({reason})"),
        }
    }
}
