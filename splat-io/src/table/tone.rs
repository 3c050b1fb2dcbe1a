//! How the numbers of a color channel become linear.

use super::scalar::Scalar;
use crate::srgb;

/// How a color channel's numbers become linear.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Tone {
    /// They are.
    Linear,
    /// 8-bit sRGB; from other integers clamped to 0 to 255.
    Srgb8,
    /// 8-bit sRGB, its bytes declared as signed.
    Srgb8Signed,
    /// 16-bit sRGB.
    Srgb16,
}

impl Tone {
    /// The reading of a channel of this type.
    pub fn of(kind: Scalar) -> Self {
        match kind {
            Scalar::F32 | Scalar::F64 => Self::Linear,
            Scalar::I8 => Self::Srgb8Signed,
            Scalar::U16 => Self::Srgb16,
            Scalar::U8 | Scalar::I16 | Scalar::I32 | Scalar::U32 => Self::Srgb8,
        }
    }

    /// The linear value of a number of the channel.
    #[inline]
    pub fn linear(self, value: f64) -> f32 {
        match self {
            Self::Linear => value as f32,
            Self::Srgb8 => srgb::linear_from_srgb8()[usize::from(value as u8)],
            Self::Srgb8Signed => srgb::linear_from_srgb8()[usize::from(value as i8 as u8)],
            Self::Srgb16 => splat_core::srgb::decode(value / 65535.0) as f32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integer_colors_of_every_type_mean_the_same() {
        let expected = splat_core::srgb::decode(200.0 / 255.0) as f32;
        for kind in [Scalar::U8, Scalar::I16, Scalar::I32, Scalar::U32] {
            assert_eq!(Tone::of(kind).linear(200.0), expected, "{kind:?}");
        }
        assert_eq!(Tone::of(Scalar::I8).linear(-56.0), expected);
        assert_eq!(Tone::of(Scalar::U16).linear(200.0 * 257.0), expected);
        assert_eq!(Tone::of(Scalar::I32).linear(1000.0), 1.0);
        assert_eq!(Tone::of(Scalar::I32).linear(-5.0), 0.0);
    }
}
