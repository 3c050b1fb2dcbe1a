//! The sRGB transfer function (IEC 61966-2-1), with `libm` so that its bits are the same everywhere.

/// Linear light to an sRGB value; [0, 1] to [0, 1]. Odd beyond: encode(-x) = -encode(x).
pub fn encode(linear: f64) -> f64 {
    let x = linear.abs();
    let y = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * libm::pow(x, 1.0 / 2.4) - 0.055 };
    y.copysign(linear)
}

/// An sRGB value to linear light; the inverse of [`encode`].
pub fn decode(value: f64) -> f64 {
    let y = value.abs();
    let x = if y <= 0.040_45 { y / 12.92 } else { libm::pow((y + 0.055) / 1.055, 2.4) };
    x.copysign(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_two_directions_are_inverse() {
        for i in -1000..=1000 {
            let x = f64::from(i) / 1000.0;
            // The published constants leave a step of 2e-8 (linear) at the joint.
            approx::assert_abs_diff_eq!(decode(encode(x)), x, epsilon = 3e-8);
        }
        assert_eq!([encode(0.0), decode(1.0)], [0.0, 1.0]);
    }
}
