//! The sRGB transfer function (IEC 61966-2-1), with `libm` so that its bits are the same everywhere.

/// Linear light to an sRGB value; [0, 1] to [0, 1]. Odd beyond: encode(-x) = -encode(x).
pub fn encode(linear: f32) -> f32 {
    let x = f64::from(linear.abs());
    let y = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * libm::pow(x, 1.0 / 2.4) - 0.055 };
    (y as f32).copysign(linear)
}

/// An sRGB value to linear light; the inverse of [`encode`].
pub fn decode(value: f32) -> f32 {
    let y = f64::from(value.abs());
    let x = if y <= 0.040_45 { y / 12.92 } else { libm::pow((y + 0.055) / 1.055, 2.4) };
    (x as f32).copysign(value)
}
