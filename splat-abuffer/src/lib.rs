//! The A-buffer: fragments of subpixel samples, and their order-independent resolve into surfaces.
//!
//! A renderer appends [`Fragment`]s to a [`TileBuffer`], one list a sample. [`Resolver`] turns the list of a
//! sample into its colour and transmittance. What all fragments of one splat share stands once in a table of
//! [`SplatSurface`]s, indexed by splat rank. This crate knows nothing of splats or cameras beyond that.
//!
//! The result depends on the *set* of fragments only, never on the order in which they arrived: see
//! docs/specification.md, section 6.

#![forbid(unsafe_code)]

mod fragment;
mod resolve;
mod storage;

pub use fragment::{Fragment, MAX_RANK, SplatSurface};
pub use resolve::{Coverage, Layer, MIN_ALPHA, MIN_LAYER_WEIGHT, Resolve, Resolver, SampleColor, Thickness};
pub use storage::TileBuffer;
