//! The reference surfel renderer: the specification (docs/specification.md) as plain scalar Rust.

pub mod camera;
pub mod cloud;
pub mod error;
pub mod film;

pub use camera::{Camera, Lens, Projection};
pub use cloud::{Cloud, Defect, Shapes};
pub use error::Error;
pub use film::{AovSelection, Film, PixelRect};
