//! Tables of points, whatever the format: what the columns mean, and how rows become a cloud.

mod columns;
mod roles;
mod scalar;
mod tone;

pub(crate) use columns::{Columns, Hints, Outcome, far_from_zero};
pub(crate) use roles::{Row, SLOTS};
pub(crate) use scalar::Scalar;
pub(crate) use tone::Tone;

/// A table.
#[derive(Debug)]
pub(crate) struct Element {
    pub name: String,
    /// Number of rows that the header claims.
    pub count: u64,
    /// The line that claims it.
    pub line: u64,
    pub properties: Vec<Property>,
}

/// A column.
#[derive(Debug)]
pub(crate) struct Property {
    pub name: String,
    pub kind: Kind,
}

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Scalar(Scalar),
    List { count: Scalar, item: Scalar },
}

impl Kind {
    /// The type as the header writes it.
    pub fn describe(self) -> String {
        match self {
            Self::Scalar(kind) => kind.names()[0].to_owned(),
            Self::List { count, item } => format!("list {} {}", count.names()[0], item.names()[0]),
        }
    }

    /// Size of the smallest value in a binary file, in bytes: a list may be empty.
    fn least_bytes(self) -> usize {
        match self {
            Self::Scalar(kind) | Self::List { count: kind, .. } => kind.bytes(),
        }
    }
}

impl Element {
    /// Size of the smallest row in a binary file, in bytes.
    pub fn least_bytes(&self) -> usize {
        self.properties.iter().map(|property| property.kind.least_bytes()).sum()
    }

    /// Whether every row of a binary file has the same size.
    pub fn is_fixed(&self) -> bool {
        self.properties.iter().all(|property| matches!(property.kind, Kind::Scalar(_)))
    }
}
