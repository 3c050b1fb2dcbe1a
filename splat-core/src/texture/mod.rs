//! Textures: where a lookup falls, how much of the texture it must average, and how that average is made.
//!
//! Sources: seeds 0 to 3 (Ptex filter footprints, pbrt MIP maps with EWA, Footprint Assembly, pbrt chapter 11),
//! with the errata of docs/specification.md, section 7.

pub mod differentials;
pub mod filter;
pub mod footprint;
pub mod function;
pub mod mapping;
pub mod pyramid;
pub mod textures;

pub use differentials::{Ray, RayDifferential, Surface, SurfaceDifferentials};
pub use filter::{Filter, Magnification, Probes, Quality, Sampler, SummedArea};
pub use footprint::{Footprint, FullSides, PixelDerivatives, PrincipalAxes};
pub use function::{Checkerboard, Fbm, TextureFunction, ZonePlate};
pub use mapping::{
    CylinderHeight, CylindricalMapping, PlanarMapping, SolidMapping, SpacePoint, SphericalMapping,
    TexturePoint, UvMapping,
};
pub use pyramid::{Pyramid, PyramidError, Texels, Wrap};
pub use textures::{
    FunctionTexture, ImageLookup, ImageTexture, Mapping, Placement, ScalarLookup, SurfacePoint, Texture,
};
