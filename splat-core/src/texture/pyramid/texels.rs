//! How texels are stored.

use crate::srgb;
use half::f16;

/// The values of an image, channels interleaved, in one of the stored forms.
#[derive(Debug, Clone, PartialEq)]
pub enum Texels {
    /// Linear values.
    F32(Vec<f32>),
    /// Linear values, rounded to 11 bits: half the memory, and faster where memory is what a lookup waits for.
    F16(Vec<f16>),
    /// sRGB codes, linearised when read. Coarser levels are rounded to the nearest code: half a code of error.
    Srgb8(Vec<u8>),
}

impl Texels {
    /// Linear values as [`Texels::F16`]. What is too large for 16 bits becomes the largest that is not.
    pub fn f16_from(values: &[f32]) -> Self {
        Self::F16(values.iter().map(|&value| to_f16(value)).collect())
    }

    /// The number of values.
    pub fn len(&self) -> usize {
        match self {
            Self::F32(values) => values.len(),
            Self::F16(values) => values.len(),
            Self::Srgb8(values) => values.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The linear texel whose first value is at `start`; `linear`: the values of the sRGB codes.
    #[inline]
    pub(super) fn texel(&self, start: usize, channels: usize, linear: &[f32]) -> [f32; 4] {
        let range = start..start + channels;
        match self {
            Self::F32(values) => padded(&values[range], |value| value),
            Self::F16(values) => padded(&values[range], f16::to_f32),
            Self::Srgb8(values) => {
                let mut texel = padded(&values[range], |code| linear[usize::from(code)]);
                if channels.is_multiple_of(2) {
                    texel[channels - 1] = f32::from(values[start + channels - 1]) / 255.0;
                }
                texel
            }
        }
    }

    /// Brings linear `f32` values to the form of `other`; other values stay.
    pub(super) fn convert_like(&mut self, other: &Self, channels: usize) {
        let Self::F32(values) = &*self else { return };
        match other {
            Self::F32(_) => {}
            Self::F16(_) => *self = Self::f16_from(values),
            Self::Srgb8(_) => {
                let code = |(i, &value): (usize, &f32)| {
                    let is_alpha = channels.is_multiple_of(2) && i % channels == channels - 1;
                    let value = f64::from(value);
                    (255.0 * if is_alpha { value } else { srgb::encode(value) }).round() as u8
                };
                *self = Self::Srgb8(values.iter().enumerate().map(code).collect());
            }
        }
    }
}

/// One to four values and zeros.
#[inline]
fn padded<T: Copy>(values: &[T], to_f32: impl Fn(T) -> f32) -> [f32; 4] {
    match *values {
        [a] => [to_f32(a), 0.0, 0.0, 0.0],
        [a, b] => [to_f32(a), to_f32(b), 0.0, 0.0],
        [a, b, c] => [to_f32(a), to_f32(b), to_f32(c), 0.0],
        [a, b, c, d] => [to_f32(a), to_f32(b), to_f32(c), to_f32(d)],
        _ => [0.0; 4],
    }
}

/// The nearest f16; infinities and beyond become the largest finite ones.
fn to_f16(value: f32) -> f16 {
    let rounded = f16::from_f32(value);
    if rounded.is_infinite() && value.is_finite() { f16::MAX.copysign(rounded) } else { rounded }
}
