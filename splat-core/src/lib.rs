//! The reference surfel renderer: the specification (docs/specification.md) as plain scalar Rust.

#![forbid(unsafe_code)]

pub mod camera;
pub mod cloud;
pub mod distortion;
pub mod error;
pub mod evaluate;
pub mod eye_dome;
pub mod film;
pub mod fit;
pub mod harmonics;
mod join;
pub mod kernel;
pub mod memory;
pub mod options;
pub mod pixel;
pub mod placement;
pub mod prepare;
pub mod raster;
pub mod real;
pub mod render;
pub mod sampling;
pub mod setup;
pub mod shade;
pub mod srgb;
pub mod sums;
pub mod texture;

pub use camera::{Camera, Distortion, Lens, Projection};
pub use cloud::{Cloud, Defect, Field, Shapes, TextureCoordinates};
pub use error::Error;
pub use film::{AovSelection, Film, PixelRect};
pub use harmonics::SphericalHarmonics;
pub use kernel::{Kernel, TableMode};
pub use options::{RenderOptions, Shading};
pub use render::{Rendered, Statistics, Unfinished, fragments, render, render_from};
pub use sampling::{PatternKind, PixelFilter};
pub use shade::{Detail, Environment, Material, Materials, Optics};
pub use sums::{Ending, SampleSums};
