//! The test oracle: what every renderer of this workspace is judged against.
//!
//! - [`analytic`]: what the analytic tests measure pictures by;
//! - [`cases`]: properties over many cases;
//! - [`hard_cases`]: splats that are hard to evaluate, a family a case, and the errors of the listing and both cores;
//! - [`hard_scenes`]: scenes that are meant to be hard for a renderer;
//! - [`hard_surfaces`]: surfaces that are hard to tell apart, and sums of very many or very light fragments;
//! - [`hashes`]: hashes of pictures;
//! - [`listing`]: the printed listing of Räsänen 2002, appendix A.2, faults included;
//! - [`brute_force`]: the geometric truth in f64, by intersection and dense sampling;
//! - [`core_scenes`]: scenes of `splat-core`, and the same for the brute-force truth;
//! - [`damaged`]: bad files, made from good ones of every format;
//! - [`errata_scenes`]: scenes that show the errata, and the corrected closed forms;
//! - [`fuzz_bodies`]: what must hold for any bytes whatever, for the fuzz targets and for tests;
//! - [`printed_textures`]: footprints, differentials and mappings as printed, faults included;
//! - [`random`]: deterministic random numbers for scenes;
//! - [`scenes`]: small scenes made in code;
//! - [`textures`]: what the tests of footprints, differentials and mappings share;
//! - [`texture_truth`]: the integral that texture filters approximate, and images for it;
//! - [`tolerances`]: every tolerance with its derivation;
//! - [`varied_scenes`]: scenes that differ in all that the renderer tells apart.

#![forbid(unsafe_code)]

pub mod analytic;
pub mod brute_force;
pub mod cases;
pub mod core_scenes;
pub mod damaged;
pub mod errata_scenes;
pub mod fuzz_bodies;
pub mod hard_cases;
pub mod hard_scenes;
pub mod hard_surfaces;
pub mod hashes;
pub mod listing;
pub mod printed_textures;
pub mod random;
pub mod scenes;
pub mod texture_truth;
pub mod textures;
pub mod tolerances;
pub mod varied_scenes;
