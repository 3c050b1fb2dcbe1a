//! The truth that texture filters are judged by, and the images that they are judged on.
//!
//! The truth is the integral of `exp(-2 r^2) - exp(-2)` on the footprint's ellipse over the bilinearly interpolated
//! finest level, by points on a grid in the ellipse: brute force, in `f64`, with nothing of the filters under test.

use crate::random::Random;
use glam::{DVec2, Vec2};
use proptest::prelude::*;
use splat_core::texture::{Footprint, Pyramid, Texels, Wrap};

/// An image in linear light, channels interleaved.
#[derive(Debug, Clone)]
pub struct Image {
    /// Columns and rows.
    pub size: [u32; 2],
    /// Values per texel.
    pub channels: usize,
    /// The values, row by row.
    pub values: Vec<f32>,
}

impl Image {
    /// A grey image from its values at (column, row).
    pub fn from_fn(size: [u32; 2], value: impl Fn(u32, u32) -> f32) -> Self {
        let at = |i: u32| value(i % size[0], i / size[0]);
        Self { size, channels: 1, values: (0..size[0] * size[1]).map(at).collect() }
    }

    /// Squares of `square` texels, black and white.
    pub fn checkerboard(size: u32, square: u32) -> Self {
        Self::from_fn([size; 2], |x, y| ((x / square + y / square) % 2) as f32)
    }

    /// Rings `(1 + cos(pi r^2 / size)) / 2` around the middle: at r texels from there, r / size rings a texel, up to
    /// one in two texels at the middle of the edges.
    pub fn zone_plate(size: u32) -> Self {
        let ring = |x: u32, y: u32| {
            let offset = DVec2::new(f64::from(x), f64::from(y)) + 0.5 - 0.5 * f64::from(size);
            let phase = std::f64::consts::PI * offset.length_squared() / f64::from(size);
            (0.5 + 0.5 * libm::cos(phase)) as f32
        };
        Self::from_fn([size; 2], ring)
    }

    /// Independent random values in [0, 1).
    pub fn noise(size: [u32; 2], channels: usize, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let count = size[0] as usize * size[1] as usize * channels;
        Self { size, channels, values: (0..count).map(|_| random.unit() as f32).collect() }
    }

    /// The pyramid of the image, as `f32`.
    pub fn pyramid(&self, wrap: Wrap) -> Pyramid {
        let texels = Texels::F32(self.values.clone());
        Pyramid::new(self.size, self.channels, texels, [wrap; 2]).expect("an image's data fit its size")
    }

    /// The truth, the texture repeating.
    pub fn truth(&self, lookup: &Lookup) -> [f64; 4] {
        let size = DVec2::new(f64::from(self.size[0]), f64::from(self.size[1]));
        let axis = DVec2::new(libm::cos(lookup.angle), libm::sin(lookup.angle));
        // At least 73 points across, 4185 in the disc, and three a texel.
        let points = |semi_axis: f64| (6.0 * semi_axis).ceil().max(73.0) as u32;
        let (columns, rows) = (points(lookup.major), points(lookup.minor));
        let (mut sum, mut total) = ([0.0; 4], 0.0);
        for j in 0..rows {
            let v = (2.0 * f64::from(j) + 1.0) / f64::from(rows) - 1.0;
            for i in 0..columns {
                let u = (2.0 * f64::from(i) + 1.0) / f64::from(columns) - 1.0;
                let r2 = u * u + v * v;
                if r2 < 1.0 {
                    let weight = libm::exp(-2.0 * r2) - libm::exp(-2.0);
                    let place =
                        lookup.center * size + u * lookup.major * axis + v * lookup.minor * axis.perp();
                    let value = self.bilinear(place);
                    (0..self.channels).for_each(|channel| sum[channel] += weight * value[channel]);
                    total += weight;
                }
            }
        }
        sum.map(|value| value / total)
    }

    /// Bilinear interpolation at a place in texels, where texel i has its centre at i + 1/2.
    fn bilinear(&self, place: DVec2) -> [f64; 4] {
        let corner = (place - 0.5).floor();
        let t = place - 0.5 - corner;
        let wrapped = |index: i64, count: u32| index.rem_euclid(i64::from(count)) as usize;
        let columns = [0, 1].map(|dx| wrapped(corner.x as i64 + dx, self.size[0]));
        let rows = [0, 1].map(|dy| wrapped(corner.y as i64 + dy, self.size[1]));
        let mut value = [0.0; 4];
        for (row, ty) in rows.into_iter().zip([1.0 - t.y, t.y]) {
            for (column, tx) in columns.into_iter().zip([1.0 - t.x, t.x]) {
                let start = (row * self.size[0] as usize + column) * self.channels;
                for (sum, &texel) in value.iter_mut().zip(&self.values[start..start + self.channels]) {
                    *sum += tx * ty * f64::from(texel);
                }
            }
        }
        value
    }
}

/// A place in a texture and an ellipse around it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lookup {
    /// The centre, in (s, t).
    pub center: DVec2,
    /// The longer semi-axis, in texels.
    pub major: f64,
    /// The shorter one.
    pub minor: f64,
    /// The direction of the longer one, in radians from s towards t.
    pub angle: f64,
}

impl Lookup {
    /// A random place and direction, with a minor semi-axis that is log-uniform in `minor`.
    pub fn random(random: &mut Random, minor: [f64; 2], anisotropy: f64) -> Self {
        let minor = random.log_range(minor[0], minor[1]);
        // Multiples of 2^-16: f32 has them exactly.
        let mut coordinate = || (random.unit() * 65536.0).floor() / 65536.0;
        let center = DVec2::new(coordinate(), coordinate());
        let angle = random.range(0.0, std::f64::consts::PI);
        Self { center, major: anisotropy * minor, minor, angle }
    }

    /// The position as `f32`.
    pub fn st(&self) -> Vec2 {
        self.center.as_vec2()
    }

    /// The footprint in a texture of `size`, by its axes.
    pub fn footprint(&self, size: [u32; 2]) -> Footprint {
        self.conjugate(size, 0.0)
    }

    /// The same footprint by two of its conjugate semi-diameters: the axes turned by `turn` radians, as points of the
    /// unit circle.
    pub fn conjugate(&self, size: [u32; 2], turn: f64) -> Footprint {
        let size = DVec2::new(f64::from(size[0]), f64::from(size[1]));
        let axis = DVec2::new(libm::cos(self.angle), libm::sin(self.angle));
        let (major, minor) = (self.major * axis, self.minor * axis.perp());
        let (sin, cos) = (libm::sin(turn), libm::cos(turn));
        let semi_axes = [cos * major + sin * minor, cos * minor - sin * major];
        Footprint { semi_axes: semi_axes.map(|axis| (axis / size).as_vec2()) }
    }
}

/// All wraps.
pub const WRAPS: [Wrap; 4] = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror, Wrap::Black];

/// For each size and wrap two pyramids, of 1 to 4 channels: of values in [0, 1], and of values as large as they come.
pub fn pyramids_of_noise(sizes: &[[u32; 2]]) -> Vec<Pyramid> {
    let mut pyramids = Vec::new();
    for (i, &size) in sizes.iter().enumerate() {
        for wrap in WRAPS {
            let mut image = Image::noise(size, 1 + i % 4, 17);
            pyramids.push(image.pyramid(wrap));
            image.values.iter_mut().for_each(|value| *value = (2.0 * *value - 1.0) * f32::MAX);
            pyramids.push(image.pyramid(wrap));
        }
    }
    pyramids
}

/// Any bits; half of the time such as footprints have.
pub fn any_float() -> impl Strategy<Value = f32> {
    prop_oneof![any::<u32>().prop_map(f32::from_bits), -2.0_f32..2.0, Just(0.0), -0.05_f32..0.05]
}
