//! The part of a texture that one lookup averages.

use glam::Vec2;

/// An ellipse in texture coordinates (s, t), given by two of its conjugate semi-diameters: the vectors from its centre
/// to its rim are `cos(a) semi_axes[0] + sin(a) semi_axes[1]`.
///
/// With the change of (s, t) from one pixel to the next in x and in y as the vectors, this is the footprint of pbrt
/// (seed 1). They need not be at right angles. Ptex gives full sides instead: see [`FullSides`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Footprint {
    /// The two semi-diameters, in units of (s, t): 1 is the whole texture.
    pub semi_axes: [Vec2; 2],
}

/// A parallelogram in texture coordinates, given by its two full sides, as Ptex describes a footprint (seed 0): the
/// sides are the *diameters* of the ellipse that it encloses.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FullSides {
    /// The two sides, in units of (s, t): 1 is the whole texture.
    pub sides: [Vec2; 2],
}

impl From<FullSides> for Footprint {
    fn from(FullSides { sides }: FullSides) -> Self {
        Self { semi_axes: sides.map(|side| 0.5 * side) }
    }
}

impl From<Footprint> for FullSides {
    fn from(Footprint { semi_axes }: Footprint) -> Self {
        Self { sides: semi_axes.map(|axis| 2.0 * axis) }
    }
}
