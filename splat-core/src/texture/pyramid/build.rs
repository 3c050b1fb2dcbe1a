//! The levels of a pyramid from its finest one.

use super::{Level, Texels};
use half::f16;

/// All levels of an image, from the given one to that of a single texel. `linear`: the values of the sRGB codes.
pub(super) fn levels(size: [u32; 2], channels: usize, texels: Texels, linear: &[f32]) -> Vec<Level> {
    let mut images = vec![Image { size, channels, texels }];
    while images[images.len() - 1].size != [1, 1] {
        let size = images[images.len() - 1].size.map(|count| count.div_ceil(2));
        // The mean of level 0 over a rectangle is the mean of a coarser level over it, if its texels tile the rectangle.
        let tiles = |image: &&Image| (0..2).all(|axis| image.size[axis].is_multiple_of(size[axis]));
        let source = images.iter().rev().find(tiles).unwrap_or(&images[0]);
        let image = source.reduced(size, linear);
        images.push(image);
    }
    // Rounded only now: coarser levels are not made of rounded ones.
    let (finest, coarser) = images.split_at_mut(1);
    for image in coarser {
        image.texels.convert_like(&finest[0].texels, channels);
    }
    images.into_iter().map(|image| level(size, image.size, image.texels)).collect()
}

fn level(finest: [u32; 2], size: [u32; 2], texels: Texels) -> Level {
    let texel_size = [0, 1].map(|axis| f64::from(finest[axis]) / f64::from(size[axis]));
    let variance = [0, 1].map(|axis| box_variance(finest[axis], size[axis]));
    Level { size, texel_size, variance, texels }
}

/// A level while levels are built; all but the finest are `f32`.
struct Image {
    size: [u32; 2],
    channels: usize,
    texels: Texels,
}

impl Image {
    /// The exact means over `size` equal rectangles; at most as many per axis as there are texels.
    fn reduced(&self, size: [u32; 2], linear: &[f32]) -> Self {
        let columns = overlaps(self.size[0], size[0]);
        let rows = overlaps(self.size[1], size[1]);
        let row_length = size[0] as usize * self.channels;
        let mut sums = vec![0.0_f64; row_length * (size[1] as usize + 1)];
        let mut row_sums = vec![0.0_f64; row_length + self.channels];
        for (y, to_row) in rows.iter().enumerate() {
            row_sums.fill(0.0);
            for (x, to) in columns.iter().enumerate() {
                let source = (y * columns.len() + x) * self.channels;
                let texel = self.texels.texel(source, self.channels, linear);
                let start = to.first * self.channels;
                for (channel, &value) in texel.iter().enumerate().take(self.channels) {
                    row_sums[start + channel] += to.shares[0] * f64::from(value);
                    row_sums[start + self.channels + channel] += to.shares[1] * f64::from(value);
                }
            }
            for (i, share) in to_row.shares.into_iter().enumerate().filter(|(_, share)| *share > 0.0) {
                let start = (to_row.first + i) * row_length;
                for (sum, &value) in sums[start..start + row_length].iter_mut().zip(&row_sums) {
                    *sum += share * value;
                }
            }
        }
        let area = f64::from(self.size[0]) * f64::from(self.size[1]);
        let mean = |sum: &f64| (sum / area) as f32;
        let values = sums[..row_length * size[1] as usize].iter().map(mean).collect();
        Self { size, channels: self.channels, texels: Texels::F32(values) }
    }
}

/// Into which texels of the coarser axis a texel goes: `first`, and the next one, with these shares. A texel
/// of the coarser axis gets as many shares in all as the finer axis has texels.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Overlap {
    first: usize,
    shares: [f64; 2],
}

/// The overlaps of each of `fine` texels with `coarse` ones of the same total length, in whole numbers: a fine texel is
/// `coarse` units long, a coarse one `fine` units.
fn overlaps(fine: u32, coarse: u32) -> Vec<Overlap> {
    let (fine, coarse) = (u64::from(fine), u64::from(coarse));
    let overlap = |texel: u64| {
        let first = texel * coarse / fine;
        let inside = ((first + 1) * fine - texel * coarse).min(coarse);
        Overlap { first: first as usize, shares: [inside as f64, (coarse - inside) as f64] }
    };
    (0..fine).map(overlap).collect()
}

/// The second moment of a coarse texel's weights about its centre, in squared fine texels, as a mean over the coarse
/// texels.
fn box_variance(fine: u32, coarse: u32) -> f64 {
    let texel_size = f64::from(fine) / f64::from(coarse);
    let mut moments = 0.0;
    for (texel, overlap) in overlaps(fine, coarse).into_iter().enumerate() {
        for (i, share) in overlap.shares.into_iter().enumerate() {
            let distance = (texel as f64 + 0.5) - ((overlap.first + i) as f64 + 0.5) * texel_size;
            moments += share * distance * distance;
        }
    }
    moments / (f64::from(fine) * f64::from(coarse))
}

/// Replaces values that are no finite numbers by the mean of the finite ones around; returns how many.
pub(super) fn replace_non_finite(texels: &mut Texels, size: [u32; 2], channels: usize) -> usize {
    match texels {
        Texels::F32(values) => replace(values, size, channels, f64::from, |mean| mean as f32),
        Texels::F16(values) => replace(values, size, channels, f64::from, f16::from_f64),
        Texels::Srgb8(_) => 0,
    }
}

fn replace<T: Copy>(
    values: &mut [T],
    size: [u32; 2],
    channels: usize,
    to_f64: impl Fn(T) -> f64,
    from_f64: impl Fn(f64) -> T,
) -> usize {
    let [width, height] = size.map(|count| count as usize);
    let around = |index: usize| {
        let (texel, channel) = (index / channels, index % channels);
        let (x, y) = (texel % width, texel / width);
        let (mut sum, mut count) = (0.0, 0.0);
        for row in y.saturating_sub(1)..(y + 2).min(height) {
            for column in x.saturating_sub(1)..(x + 2).min(width) {
                let value = to_f64(values[(row * width + column) * channels + channel]);
                if value.is_finite() {
                    (sum, count) = (sum + value, count + 1.0);
                }
            }
        }
        if count > 0.0 { sum / count } else { 0.0 }
    };
    let bad = values.iter().enumerate().filter(|(_, value)| !to_f64(**value).is_finite());
    let replacements: Vec<(usize, f64)> = bad.map(|(index, _)| (index, around(index))).collect();
    for &(index, mean) in &replacements {
        values[index] = from_f64(mean);
    }
    replacements.len()
}
