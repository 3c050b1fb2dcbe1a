//! What can be wrong with a scene, a camera or a set of options.

use crate::memory::in_words;

/// Why a picture cannot be made.
///
/// Bad *points* are no error: they are dropped and counted (see [`crate::cloud::Defect`]). An error is
/// something that leaves no sensible picture to make.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A value given by the caller is outside its range.
    #[error("{what}: found {found}, expected {expected}")]
    Invalid {
        /// The name of the value.
        what: &'static str,
        /// The value, as text.
        found: String,
        /// The accepted values, as text.
        expected: &'static str,
    },
    /// The arrays of a cloud do not belong together.
    #[error("cloud: {what} has {found} entries for {expected} positions")]
    Length {
        /// Which array.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The number of positions.
        expected: usize,
    },
    /// More memory than there is, or than was allowed ([`crate::RenderOptions::memory`]).
    #[error("{what} needs {} of memory, and {}: {help}", in_words(*needed),
        left.map_or("the system has no more".to_owned(), |left| in_words(left) + " are left"))]
    Memory {
        /// What it is for.
        what: &'static str,
        /// Bytes needed.
        needed: usize,
        /// Bytes left of what was allowed; `None` where the system refused.
        left: Option<usize>,
        /// How less would do.
        help: &'static str,
    },
    /// The scene has nothing that could be looked at.
    #[error("the cloud has no usable point ({0})")]
    Empty(String),
}

impl Error {
    /// An [`Error::Invalid`] for `what`.
    pub fn invalid(what: &'static str, found: impl std::fmt::Display, expected: &'static str) -> Self {
        Self::Invalid { what, found: found.to_string(), expected }
    }
}
