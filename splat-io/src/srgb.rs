//! The sRGB transfer functions (IEC 61966-2-1), both ways.
//!
//! Computed with the crate `libm`, so that every machine gets the same bits.

use std::sync::LazyLock;

/// The linear value of an sRGB-encoded one; 0 to 1 maps onto 0 to 1.
pub fn linear_from_srgb(encoded: f64) -> f64 {
    if encoded <= 0.04045 { encoded / 12.92 } else { libm::pow((encoded + 0.055) / 1.055, 2.4) }
}

/// The sRGB-encoded value of a linear one; 0 to 1 maps onto 0 to 1.
pub fn srgb_from_linear(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055 }
}

/// The linear values, 0 to 1, of the 256 8-bit sRGB levels.
pub fn linear_from_srgb8() -> &'static [f32; 256] {
    static LEVELS: LazyLock<[f32; 256]> =
        LazyLock::new(|| std::array::from_fn(|level| linear_from_srgb(level as f64 / 255.0) as f32));
    &LEVELS
}

/// The 8-bit sRGB level nearest to a linear value: clamped to 0 to 255, ties rounded up, not a number as 0.
///
/// Found by bisection among the linear values halfway between two levels, which is the same as rounding
/// [`srgb_from_linear`], without its power function.
pub fn srgb8_from_linear(linear: f64) -> u8 {
    static HALFWAY: LazyLock<[f64; 255]> =
        LazyLock::new(|| std::array::from_fn(|level| linear_from_srgb((level as f64 + 0.5) / 255.0)));
    HALFWAY.partition_point(|&halfway| halfway <= linear) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_two_directions_are_inverse() {
        for i in 0..=1000 {
            let x = f64::from(i) / 1000.0;
            // The published constants leave a step of 2e-8 (linear) at the joint.
            assert!((linear_from_srgb(srgb_from_linear(x)) - x).abs() < 3e-8, "{x}");
        }
        assert_eq!(srgb_from_linear(0.0), 0.0);
        assert_eq!(linear_from_srgb(1.0), 1.0);
    }

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
            assert_eq!(srgb8_from_linear(x), (srgb_from_linear(x) * 255.0 + 0.5).floor() as u8, "{x}");
        }
    }

    #[test]
    fn values_out_of_range_are_clamped() {
        assert_eq!(srgb8_from_linear(-1.0), 0);
        assert_eq!(srgb8_from_linear(f64::INFINITY), 255);
        assert_eq!(srgb8_from_linear(f64::NAN), 0);
    }
}
