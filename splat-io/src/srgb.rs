//! 8-bit sRGB, both ways.

use splat_core::srgb::decode;
use std::sync::LazyLock;

/// The linear values, 0 to 1, of the 256 8-bit sRGB levels.
pub fn linear_from_srgb8() -> &'static [f32; 256] {
    static LEVELS: LazyLock<[f32; 256]> =
        LazyLock::new(|| std::array::from_fn(|level| decode(level as f64 / 255.0) as f32));
    &LEVELS
}

/// The 8-bit sRGB level nearest to a linear value: clamped to 0 to 255, ties rounded up, not a number as 0.
///
/// Found by bisection among the linear values halfway between two levels, which is the same as rounding
/// [`splat_core::srgb::encode`], without its power function.
pub fn srgb8_from_linear(linear: f64) -> u8 {
    static HALFWAY: LazyLock<[f64; 255]> =
        LazyLock::new(|| std::array::from_fn(|level| decode((level as f64 + 0.5) / 255.0)));
    HALFWAY.partition_point(|&halfway| halfway <= linear) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_level_survives_the_round_trip() {
        for level in 0..=255_u8 {
            assert_eq!(srgb8_from_linear(f64::from(linear_from_srgb8()[usize::from(level)])), level);
        }
    }

    #[test]
    fn levels_are_the_rounded_transfer_function() {
        for i in 0..=100_000 {
            let x = f64::from(i) / 100_000.0;
            assert_eq!(
                srgb8_from_linear(x),
                (splat_core::srgb::encode(x) * 255.0 + 0.5).floor() as u8,
                "{x}"
            );
        }
    }

    #[test]
    fn values_out_of_range_are_clamped() {
        assert_eq!(srgb8_from_linear(-1.0), 0);
        assert_eq!(srgb8_from_linear(f64::INFINITY), 255);
        assert_eq!(srgb8_from_linear(f64::NAN), 0);
    }
}
