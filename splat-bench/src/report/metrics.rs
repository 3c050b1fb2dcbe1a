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

    /// Pictures of red, green and blue levels, with a width: photographs where there are real files, and one of ramps, edges
    /// and noise.
    fn pictures() -> Vec<(Vec<[u8; 3]>, usize)> {
        let made = (0..120 * 80).map(|i: u32| {
            let noise = (i.wrapping_mul(2_654_435_761) >> 24) as u8;
            let (x, y) = (i % 120, i / 120);
            match (x / 40, y / 40) {
                (0, _) => [(2 * y) as u8, (6 * x) as u8, 40],
                (1, 0) => [noise; 3],
                (1, _) => [if x % 9 < 4 { 250 } else { 5 }, 128, noise / 4],
                _ => [0, if (x + y) % 31 < 3 { 255 } else { 20 }, 200],
            }
        });
        let mut pictures = vec![(made.collect(), 120)];
        let Some(data) = splat_bench::textures::images::data() else { return pictures };
        for name in ["textures/astronaut.png", "textures/chelsea.png", "meshes/spot/spot_texture.png"] {
            let picture = splat_io::read_png(&data.join(name)).unwrap();
            let width = picture.size[0] as usize;
            // A part of each, so that this takes no time.
            let rows = picture.pixels.chunks_exact(width).skip(60).take(150);
            let part =
                rows.flat_map(|row| &row[40..240]).map(|&[r, g, b, _]| [r, g, b].map(|level| level as u8));
            pictures.push((part.collect(), 200));
        }
        pictures
    }

    /// FLIP of two 8-bit pictures by the library of its authors, and by ours.
    fn both_flips(a: &[[u8; 3]], b: &[[u8; 3]], width: usize) -> [Vec<f32>; 2] {
        let height = a.len() / width;
        let image =
            |levels: &[[u8; 3]]| FlipImageRgb8::with_data(width as u32, height as u32, levels.as_flattened());
        let theirs = flip(image(a), image(b), DEFAULT_PIXELS_PER_DEGREE).to_vec();
        let linear = |levels: &[[u8; 3]]| -> Vec<[f32; 3]> {
            let decode = |level: u8| srgb::decode(f64::from(level) / 255.0) as f32;
            levels.iter().map(|pixel| pixel.map(decode)).collect()
        };
        [theirs, splat_io::flip(&linear(a), &linear(b), width)]
    }

    /// Theirs is computed in `f32`. Sums over 21 and 19 taps and the products before cbrt leave an error of at most some
    /// 30 * 2^-24 of values up to 1, which is 500 times as large in a*: 1e-3 for each colour. A difference of 2e-3 that is noise
    /// alone becomes (2e-3)^0.7 * 0.95 / (0.4 * 41) = 7.5e-4, where 41 is the largest difference; the exponent 1 - (difference
    /// of features) raises it where features differ a lot, but there colours do not differ by noise alone. Twice that for
    /// a pixel. To a difference of one unit or more it adds 0.7 * 2e-3 * 0.95 / (0.4 * 41) = 8e-5, which may be the
    /// same all over a flat picture: twice that for the mean.
    const PIXEL: f32 = 1.5e-3;
    const MEAN: f64 = 1.6e-4;

    #[test]
    fn our_flip_is_that_of_its_authors() {
        for (picture, width) in pictures() {
            let changed: [Vec<[u8; 3]>; 4] = [
                picture.iter().map(|pixel| pixel.map(|level| level.saturating_add(9))).collect(),
                picture.iter().map(|&[r, g, b]| [b, r, g]).collect(),
                picture.iter().skip(1).chain(&picture[..1]).copied().collect(),
                picture.chunks_exact(2).flat_map(|pair| [pair[0], pair[0]]).collect(),
            ];
            for (number, other) in changed.iter().enumerate() {
                let [theirs, ours] = both_flips(&picture, other, width);
                let most = theirs.iter().zip(&ours).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
                let mean =
                    |map: &[f32]| map.iter().map(|&error| f64::from(error)).sum::<f64>() / map.len() as f64;
                let (a, b) = (mean(&theirs), mean(&ours));
                assert!(most <= PIXEL, "change {number}: {most}");
                assert!((a - b).abs() <= MEAN && a > 1e-3, "change {number}: {a} {b}");
            }
        }
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
