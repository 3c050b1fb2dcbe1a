//! Textures that are functions, and how their detail is limited to what a footprint can show. Seed 3, section
//! 11.1.2.
//!
//! Three ways, in the seed's order of preference: the mean over a box, where the integral is known
//! ([`Checkerboard`]); *clamping*, where the spectrum is ([`Fbm`], [`ZonePlate`]): frequencies beyond the
//! Nyquist limit become their mean; and [`supersample`] for all else.
//!
//! A function of (s, t) is one of space whose z is 0: [`SpacePoint::in_plane`]. The point's derivatives dx
//! and dy are the semi-axes of the footprint, as pbrt's are: what is as far as the next pixel. Deterministic
//! on every platform.

use super::mapping::SpacePoint;
use glam::{DVec2, DVec3};

/// A texture that is a function of space.
pub trait TextureFunction {
    /// Its value at a point.
    fn value(&self, point: DVec3) -> f64;

    /// Its value at a lookup's point, without the detail that the footprint is too large for.
    fn filtered(&self, at: &SpacePoint) -> f64;
}

/// How much of a frequency remains, given in cycles from one pixel to the next: all below 1/4, nothing (so
/// that the mean remains) from the Nyquist limit 1/2 on, smoothly faded between. 0 for what is not a number.
pub fn clamped_spectrum(cycles_per_pixel: f64) -> f64 {
    let x = (4.0 * cycles_per_pixel.abs() - 1.0).clamp(0.0, 1.0);
    if x.is_nan() { 0.0 } else { 1.0 - x * x * (3.0 - 2.0 * x) }
}

/// Greatest number of strata along each side of [`supersample`].
pub const MAX_STRATA: u32 = 64;

/// The mean of a function over the ellipse of a footprint by n x n samples, n = `strata` (from 1 to
/// [`MAX_STRATA`]): the last resort. The disc is cut into n rings of equal area, these into n sectors, with
/// one sample at a place of its own in each. Values that are not finite count as zero.
pub fn supersample(function: impl Fn(DVec3) -> f64, at: &SpacePoint, strata: u32) -> f64 {
    let n = strata.clamp(1, MAX_STRATA);
    let mut sum = 0.0;
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let bits = mixed(mixed(i) ^ j);
        let [ring, sector] = [bits >> 16, bits & 0xffff].map(|half| (f64::from(half) + 0.5) / 65_536.0);
        let radius = ((f64::from(i) + ring) / f64::from(n)).sqrt();
        let angle = std::f64::consts::TAU * (f64::from(j) + sector) / f64::from(n);
        let value = function(at.point + radius * (libm::cos(angle) * at.dx + libm::sin(angle) * at.dy));
        sum += if value.is_finite() { value } else { 0.0 };
    }
    sum / (f64::from(n) * f64::from(n))
}

/// Cubes (in the plane: squares) of side 1 in two values, band limited by the mean over the box around the
/// footprint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Checkerboard {
    /// The value where the sum of the coordinates' floors is even, and where it is odd.
    pub values: [f64; 2],
}

impl Checkerboard {
    /// From the mean of the product of three square waves, 1 over [0, 1) and -1 over [1, 2).
    fn mixed(&self, wave: f64) -> f64 {
        let [even, odd] = self.values;
        0.5 * (even + odd) + 0.5 * wave * (even - odd)
    }
}

impl TextureFunction for Checkerboard {
    fn value(&self, point: DVec3) -> f64 {
        self.filtered(&SpacePoint { point, ..SpacePoint::default() })
    }

    /// Exact: the mean of a product of functions of one coordinate each over a box is the product of the
    /// means.
    fn filtered(&self, at: &SpacePoint) -> f64 {
        // The half sides of the ellipse's box, as of Footprint::half_box.
        let half = [0, 1, 2].map(|axis| libm::hypot(at.dx[axis], at.dy[axis]));
        self.mixed([0, 1, 2].map(|axis| square_wave_mean(at.point[axis], half[axis])).iter().product())
    }
}

/// The mean of the square wave over [x - half, x + half]. Its integral is the triangle wave T, T(x) = 1 - |x
/// mod 2 - 1|. 0, the mean of all, if an argument is not finite.
fn square_wave_mean(x: f64, half: f64) -> f64 {
    if !(x.is_finite() && half.is_finite()) {
        return 0.0;
    }
    let x = x - 2.0 * (0.5 * x).floor();
    // The distance to the nearest edge: the only one that half a side of up to 1/2 can reach.
    let clear = (x - x.floor()).min(x.floor() + 1.0 - x);
    if half <= 0.5 {
        let share = if half > clear { clear / half } else { 1.0 };
        return if x < 1.0 { share } else { -share };
    }
    let triangle = |x: f64| 1.0 - (x - 2.0 * (0.5 * x).floor() - 1.0).abs();
    (triangle(x + half) - triangle(x - half)) / (2.0 * half)
}

/// Octaves of gradient noise, each of a higher frequency and a lower amplitude: fractional Brownian motion.
/// Mean 0.
///
/// Band limited by clamping: octave i, taken for a wave of [`NOISE_CYCLES`] lacunarity^i cycles a unit, keeps
/// the share [`clamped_spectrum`] of its cycles along the longer of dx and dy, since noise is alike in all
/// directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fbm {
    /// Number of octaves, at most [`MAX_OCTAVES`] of which count.
    pub octaves: u32,
    /// Ratio of an octave's frequency to that of the one before; usually 2.
    pub lacunarity: f64,
    /// Ratio of an octave's amplitude to that of the one before; usually 1/2.
    pub gain: f64,
    /// Which noise.
    pub seed: u32,
}

/// Where the spectrum of [`gradient_noise`] is, in cycles a unit: its mean over a disc of radius 1/2, 3/4 and
/// 1 keeps .67, .41 and .23 of it, and that of a wave of 1/2 cycle a unit .72, .40 and .18.
pub const NOISE_CYCLES: f64 = 0.5;

/// Greatest number of octaves.
pub const MAX_OCTAVES: u32 = 32;

impl TextureFunction for Fbm {
    fn value(&self, point: DVec3) -> f64 {
        self.filtered(&SpacePoint { point, ..SpacePoint::default() })
    }

    fn filtered(&self, at: &SpacePoint) -> f64 {
        let longest = at.dx.length().max(at.dy.length());
        let (mut sum, mut frequency, mut amplitude) = (0.0, 1.0, 1.0);
        for octave in 0..self.octaves.min(MAX_OCTAVES) {
            let share = clamped_spectrum(NOISE_CYCLES * frequency * longest);
            if share > 0.0 {
                sum +=
                    share * amplitude * gradient_noise(frequency * at.point, self.seed.wrapping_add(octave));
            }
            frequency *= self.lacunarity;
            amplitude *= self.gain;
        }
        if sum.is_finite() { sum } else { 0.0 }
    }
}

/// The zone plate 1/2 + 1/2 cos(pi c (x^2 + y^2)), c = `cycles`: rings whose frequency grows with their
/// radius, c r cycles a unit. The usual trial of band limiting: the alias of a ring is a ring.
///
/// Band limited by clamping, by the cycles that its phase advances to the next pixels in x and y, as the root
/// of their squares' sum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZonePlate {
    /// c, in cycles a squared unit.
    pub cycles: f64,
}

impl TextureFunction for ZonePlate {
    fn value(&self, point: DVec3) -> f64 {
        self.filtered(&SpacePoint { point, ..SpacePoint::default() })
    }

    fn filtered(&self, at: &SpacePoint) -> f64 {
        let point = at.point.truncate();
        // To the next pixel the phase advances by c (p.d + d^2/2), to the one before by c (p.d - d^2/2): the
        // greater.
        let advance = |d: DVec2| self.cycles * (point.dot(d).abs() + 0.5 * d.length_squared());
        let share = clamped_spectrum(libm::hypot(advance(at.dx.truncate()), advance(at.dy.truncate())));
        let phase = 0.5 * self.cycles * point.length_squared();
        let wave = libm::cos(std::f64::consts::TAU * (phase - phase.round()));
        if wave.is_finite() { 0.5 + 0.5 * share * wave } else { 0.5 }
    }
}

/// Gradient noise (Perlin 2002): 0 at the points of the integer lattice, with one of 12 gradients there,
/// chosen by a hash of the point; between them interpolated so that two derivatives are continuous. Mean 0,
/// within +-1.04; 0 if not finite.
pub fn gradient_noise(point: DVec3, seed: u32) -> f64 {
    if !point.is_finite() {
        return 0.0;
    }
    let cell = point.floor();
    let inside = point - cell;
    // Cells repeat every 2^32 units; beyond 2^53 there is nothing between them.
    let corner = cell.to_array().map(|x| (x.clamp(-9e15, 9e15) as i64) as u32);
    let fade = inside.to_array().map(|x| x * x * x * (x * (6.0 * x - 15.0) + 10.0));
    let mut sum = 0.0;
    for (x, y, z) in (0..8).map(|i| (i & 1, (i >> 1) & 1, i >> 2)) {
        let mut hash = seed;
        for (step, corner) in [x, y, z].into_iter().zip(corner) {
            hash = mixed(hash ^ corner.wrapping_add(step)).wrapping_add(0x9e37_79b9);
        }
        let from_corner = inside - DVec3::new(f64::from(x), f64::from(y), f64::from(z));
        let weight = |step: u32, fade: f64| if step == 1 { fade } else { 1.0 - fade };
        sum += weight(x, fade[0]) * weight(y, fade[1]) * weight(z, fade[2]) * slope(mixed(hash), from_corner);
    }
    sum
}

/// The product of an offset and one of the 12 vectors from the centre of a cube to its edges.
fn slope(hash: u32, offset: DVec3) -> f64 {
    // The high bits of a 32-bit hash times 12 are uniform in 0..12.
    let edge = (u64::from(hash) * 12) >> 32;
    let [first, second] = match edge >> 2 {
        0 => [offset.x, offset.y],
        1 => [offset.x, offset.z],
        _ => [offset.y, offset.z],
    };
    let first = if edge & 1 == 0 { first } else { -first };
    if edge & 2 == 0 { first + second } else { first - second }
}

/// A permutation of the 32-bit numbers in which every bit depends on every other (the end of MurmurHash3).
fn mixed(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x85eb_ca6b);
    x ^= x >> 13;
    x = x.wrapping_mul(0xc2b2_ae35);
    x ^ (x >> 16)
}
