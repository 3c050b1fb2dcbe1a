//! What a splat leaves in a sample, and what its fragments share.

/// The greatest splat rank that a fragment can carry.
pub const MAX_RANK: u32 = u32::MAX >> 1;

/// One splat hit by one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fragment {
    /// View depth w of the hit, in camera units.
    pub depth: f32,
    /// Kernel value times the splat's weight scale; greater than 0.
    pub weight: f32,
    /// Splat rank in the upper 31 bits, facing in the lowest one.
    tag: u32,
}

impl Fragment {
    /// A fragment of the splat of this rank (at most [`MAX_RANK`]); `back` if its back side was hit.
    pub fn new(depth: f32, weight: f32, rank: u32, back: bool) -> Self {
        Self { depth, weight, tag: rank << 1 | u32::from(back) }
    }

    /// Position of its splat in splat order; an index into the table of [`SplatSurface`]s.
    pub fn rank(&self) -> u32 {
        self.tag >> 1
    }

    /// Whether the splat's back side was hit.
    pub fn is_back(&self) -> bool {
        self.tag & 1 != 0
    }

    /// Whether the fragment may enter the buffer: everything finite, and a weight greater than 0.
    pub fn is_admitted(&self) -> bool {
        self.depth.is_finite() && self.weight.is_finite() && self.weight > 0.0
    }
}

/// What all fragments of one splat share.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SplatSurface {
    /// Colour; linear for `surface`, in the display's space for `over`.
    pub color: [f32; 3],
    /// Opacity in [0, 1].
    pub opacity: f32,
    /// Depth interval, as [`crate::Thickness`] reads it: the slope `ke` and the limit `cap`, or the least and
    /// the greatest depth of the splat.
    pub interval: [f32; 2],
}
