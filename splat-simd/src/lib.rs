//! Eight subpixel samples at once, with the bits of the reference.
//!
//! So far this crate holds the sample evaluation: the three forms of [`splat_core::evaluate`], written once over the
//! small trait [`Lanes`] and run on `wide::f32x8`. The fast renderer that is to stand on it (tiles, records,
//! instruction sets chosen at run time) does not exist yet.

mod evaluate;
mod lanes;

pub use evaluate::{LaneHits, LaneLensPoint, LaneLimits, LaneSplat};
pub use lanes::Lanes;
