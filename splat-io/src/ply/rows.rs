//! Tables of which rows are wanted, and who takes them.

use super::faces::Faces;
use crate::table::{Columns, SLOTS};

/// Takes the rows of a table.
pub(super) trait Rows {
    /// Per property, its place among the values of a row that are of use.
    fn slots(&self) -> &[Option<usize>];

    /// Number of these values.
    fn width(&self) -> usize;

    /// Number of rows that were claimed.
    fn count(&self) -> usize;

    /// Takes a row.
    fn push(&mut self, row: &[f64]);
}

impl Rows for Columns {
    fn slots(&self) -> &[Option<usize>] {
        &self.roles.slots
    }

    fn width(&self) -> usize {
        SLOTS
    }

    fn count(&self) -> usize {
        Self::count(self)
    }

    fn push(&mut self, row: &[f64]) {
        Self::push(self, row);
    }
}

/// What becomes of a table.
pub(super) enum Table<'a> {
    Rows(&'a mut dyn Rows),
    Faces(&'a mut Faces),
    Skipped,
}

/// The tables of a file that are wanted.
pub(super) trait Tables {
    /// The number of tables from the first one to the last that is wanted.
    fn end(&self) -> usize;

    /// What becomes of the table of this index.
    fn table(&mut self, index: usize) -> Table<'_>;
}
