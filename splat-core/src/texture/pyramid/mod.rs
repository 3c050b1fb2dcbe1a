//! An image in levels of falling resolution: pbrt's `MIPMap` (seed 1) without its need for powers of two.
//!
//! Level L + 1 has `ceil(n / 2)` texels per axis where level L has n. Rounding up keeps each level's texels at most twice
//! as large as the finer level's, so that a lookup that stays `Q` texels wide after halving never was wider than `2 Q`:
//! that bounds its cost. (Rounding down, as graphics cards do, makes steps of up to 3.) For powers of two the two agree.
//!
//! Each texel of a level is the exact mean of level 0 over the texel's rectangle, with level 0's texels as squares of
//! one colour and those cut by the rectangle's edge counted by their share. Nothing but existing texels is averaged
//! (E11: with a black wrap the printed pyramid darkens), nothing is resampled to a power of two first (E13). So the
//! prefilter of each level is known: see [`Level::variance`].

mod build;
mod texels;

use crate::srgb;
pub use half::f16;
pub use texels::Texels;

/// What lies beyond the edge of a texture, along one axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Wrap {
    /// The texture again.
    #[default]
    Repeat,
    /// The texels of the edge.
    Clamp,
    /// The texture, turned over each time; its edge texel is met twice.
    Mirror,
    /// Zero in all channels.
    Black,
}

impl Wrap {
    /// The texel that stands at place `index` of an axis of `count` texels (at least 1), or none where that is black.
    #[inline]
    pub fn index(self, index: i64, count: u32) -> Option<usize> {
        let count = i64::from(count);
        if (0..count).contains(&index) {
            return Some(index as usize);
        }
        match self {
            Self::Repeat => Some(index.rem_euclid(count) as usize),
            Self::Clamp => Some(index.clamp(0, count - 1) as usize),
            Self::Mirror => {
                let place = index.rem_euclid(2 * count);
                Some(place.min(2 * count - 1 - place) as usize)
            }
            Self::Black => None,
        }
    }
}

/// Why texels do not make a pyramid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum PyramidError {
    /// The image is empty, or longer than indices can tell.
    #[error("texture of {width} x {height} texels: expected 1 to {MAX_SIZE} per axis")]
    Size {
        /// Texels per row.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// Not a number of channels that lookups return.
    #[error("texture of {found} channels: expected 1 to 4")]
    Channels {
        /// The number of channels.
        found: usize,
    },
    /// The data do not fit the size.
    #[error("texture of {width} x {height} texels with {channels} channels: found {found} values")]
    Length {
        /// Texels per row.
        width: u32,
        /// Rows.
        height: u32,
        /// Values per texel.
        channels: usize,
        /// The number of values.
        found: usize,
    },
}

/// The most texels per axis.
pub const MAX_SIZE: u32 = 1 << 24;

/// One level of a [`Pyramid`]. Rows are contiguous, top row first, and channels interleaved: the value of channel c
/// of texel (x, y) stands at `(y * width + x) * channels + c` in the texels.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    size: [u32; 2],
    texel_size: [f64; 2],
    variance: [f64; 2],
    texels: Texels,
}

impl Level {
    /// Number of texels in s and t.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Width and height of a texel, in texels of level 0: at least 1.
    pub fn texel_size(&self) -> [f64; 2] {
        self.texel_size
    }

    /// The larger side of a texel, in texels of level 0.
    pub fn coarseness(&self) -> f64 {
        self.texel_size[0].max(self.texel_size[1])
    }

    /// The variance of the weights with which texels of level 0 make one of this level, in s and t, about the texel's
    /// centre, in squared texels of level 0, as a mean over the texels: `(4^L - 1) / 12` for powers of two.
    pub fn variance(&self) -> [f64; 2] {
        self.variance
    }

    /// All values of the level, as stored.
    pub fn texels(&self) -> &Texels {
        &self.texels
    }
}

/// A texture of 1 to 4 channels in levels, each half as large as the one before, down to one texel.
#[derive(Debug, Clone, PartialEq)]
pub struct Pyramid {
    channels: usize,
    wrap: [Wrap; 2],
    levels: Vec<Level>,
    replaced: usize,
    /// The linear value of each sRGB code, where the texels are such codes.
    linear: Box<[f32]>,
}

impl Pyramid {
    /// The pyramid of an image of `size` (in s and t) whose `texels` stand in rows, `channels` values each.
    ///
    /// Channels are averaged independently: give colours premultiplied by their alpha. Of [`Texels::Srgb8`] with 2 or 4
    /// channels the last is alpha, which is linear.
    ///
    /// A value that is no finite number (renderers write such) would spread over every level, so it is replaced
    /// by the mean of the finite ones of the same channel among the eight texels around, or by 0 where there are
    /// none, and counted: see [`Self::replaced`].
    ///
    /// # Errors
    /// Where sizes, channels or the number of values are out of range or do not fit each other.
    pub fn new(
        size: [u32; 2],
        channels: usize,
        mut texels: Texels,
        wrap: [Wrap; 2],
    ) -> Result<Self, PyramidError> {
        let [width, height] = size;
        if !(1..=MAX_SIZE).contains(&width) || !(1..=MAX_SIZE).contains(&height) {
            return Err(PyramidError::Size { width, height });
        }
        if !(1..=4).contains(&channels) {
            return Err(PyramidError::Channels { found: channels });
        }
        let found = texels.len();
        if u64::from(width) * u64::from(height) * channels as u64 != found as u64 {
            return Err(PyramidError::Length { width, height, channels, found });
        }
        let replaced = build::replace_non_finite(&mut texels, size, channels);
        let linear: Box<[f32]> = match texels {
            Texels::Srgb8(_) => (0..256).map(|code| srgb::decode(f64::from(code) / 255.0) as f32).collect(),
            Texels::F32(_) | Texels::F16(_) => Box::default(),
        };
        let levels = build::levels(size, channels, texels, &linear);
        Ok(Self { channels, wrap, levels, replaced, linear })
    }

    /// Values per texel, 1 to 4.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// What lies beyond the edges, in s and t.
    pub fn wrap(&self) -> [Wrap; 2] {
        self.wrap
    }

    /// The levels, finest first; at least one, the last of one texel.
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// How many values were not finite and were replaced.
    pub fn replaced(&self) -> usize {
        self.replaced
    }

    /// The linear values of the 256 sRGB codes, for [`Texels::Srgb8`]; else empty.
    pub fn linear_values(&self) -> &[f32] {
        &self.linear
    }

    /// The index of the coarsest level.
    pub fn last(&self) -> usize {
        self.levels.len() - 1
    }

    /// The texel at column x and row y of a level (a level beyond the last is the last), linear; channels that the
    /// texture does not have are 0. Any x and y: what lies outside follows the wraps, also at the coarsest level
    /// (E7).
    #[inline]
    pub fn texel(&self, level: usize, x: i64, y: i64) -> [f32; 4] {
        let level = &self.levels[level.min(self.last())];
        match (self.wrap[0].index(x, level.size[0]), self.wrap[1].index(y, level.size[1])) {
            (Some(x), Some(y)) => {
                let start = (y * level.size[0] as usize + x) * self.channels;
                level.texels.texel(start, self.channels, &self.linear)
            }
            _ => [0.0; 4],
        }
    }
}

#[cfg(test)]
mod tests;
