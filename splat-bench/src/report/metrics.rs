//! How far a picture is from the true one.

use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageRgb8, FlipPool, flip};
use splat_core::srgb;

/// A picture: red, green, blue (linear, premultiplied) and alpha, row by row.
pub type Picture = Vec<[f64; 4]>;

/// The differences of two pictures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// Root of the mean of the squared differences of all four channels.
    pub rmse: f64,
    /// Largest difference of a channel.
    pub max: f64,
}

/// The differences of two pictures of the same size.
pub fn distance(a: &[[f64; 4]], b: &[[f64; 4]]) -> Distance {
    assert_eq!(a.len(), b.len(), "pictures of the same size");
    let differences = || a.iter().zip(b).flat_map(|(a, b)| [0, 1, 2, 3].map(|i| (a[i] - b[i]).abs()));
    let squares: f64 = differences().map(|difference| difference * difference).sum();
    Distance { rmse: (squares / (4.0 * a.len() as f64)).sqrt(), max: differences().fold(0.0, f64::max) }
}

/// The mean of FLIP (Andersson et al. 2020) of two pictures before black, as 8-bit sRGB, at 67 pixels a degree.
pub fn mean_flip(truth: &[[f64; 4]], picture: &[[f64; 4]], [width, height]: [u32; 2]) -> f64 {
    let image = |picture: &[[f64; 4]]| {
        let display = |value: f64| (srgb::encode(value.clamp(0.0, 1.0)) * 255.0).round() as u8;
        let bytes: Vec<u8> = picture.iter().flat_map(|rgba| [0, 1, 2].map(|i| display(rgba[i]))).collect();
        FlipImageRgb8::with_data(width, height, &bytes)
    };
    let map = flip(image(truth), image(picture), DEFAULT_PIXELS_PER_DEGREE);
    f64::from(FlipPool::from_image(&map).mean())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_of_the_definition() {
        let a = vec![[0.0; 4], [1.0, 0.5, 0.0, 1.0]];
        let b = vec![[0.0; 4], [0.8, 0.5, 0.0, 1.0]];
        let Distance { rmse, max } = distance(&a, &b);
        assert!((max - 0.2).abs() < 1e-15);
        assert!((rmse - (0.04f64 / 8.0).sqrt()).abs() < 1e-15);
        assert_eq!(distance(&a, &a), Distance { rmse: 0.0, max: 0.0 });
    }

    #[test]
    fn flip_is_zero_for_the_same_and_one_for_black_and_white() {
        let picture = |value| vec![[value, value, value, 1.0]; 32 * 32];
        assert_eq!(mean_flip(&picture(0.5), &picture(0.5), [32, 32]), 0.0);
        assert!(mean_flip(&picture(0.0), &picture(1.0), [32, 32]) > 0.9);
        let near = mean_flip(&picture(0.5), &picture(0.52), [32, 32]);
        assert!(0.0 < near && near < 0.2, "{near}");
    }
}
