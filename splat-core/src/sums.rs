//! Sums over the samples of a pixel, and the pixel that they make: the mean, the background, and the AOVs. SPEC section 6.
//!
//! The film of a part of the samples keeps its sums ([`SampleSums`]): so the films of all parts become the picture
//! ([`Film::add_samples`]) that one run would have made, but for the order in which numbers were added. What could come near
//! zero by cancellation is kept in a form in which that order does not matter.

use crate::film::{FILM, NO_ID, SMALLER_FILM};
use crate::memory::filled;
use crate::{AovSelection, Error, Film, PixelRect, RenderOptions, srgb};
use glam::{DVec3, Vec3};
use splat_abuffer::{Resolve, SampleColor};

/// What is summed over the samples of a pixel.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Sums {
    pub color: [f64; 3],
    pub color_squared: [f64; 3],
    /// What rounding took from `color_squared`.
    pub color_squared_low: [f64; 3],
    pub transmittance: f64,
    pub uncovered: f64,
    pub layers: f64,
    /// Samples that have a visible layer.
    pub visible: f64,
    pub depth: f64,
    /// Of normals that are multiples of 2^-32, which makes it exact: those of two sides may cancel to nothing.
    pub normal: DVec3,
    pub albedo: DVec3,
    pub position: DVec3,
}

/// How sums become a pixel, besides the number of samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ending {
    /// Linear red, green, blue, and alpha behind everything.
    pub background: Option<[f32; 4]>,
    /// Whether colours are summed as the display has them, in sRGB, and become linear only then.
    pub display_space: bool,
}

impl Ending {
    /// That of a picture.
    pub fn of(options: &RenderOptions) -> Self {
        Self { background: options.background, display_space: options.resolve == Resolve::Over }
    }
}

impl Sums {
    /// Adds the colour of a sample.
    #[inline(always)]
    pub fn add(&mut self, sample: &SampleColor, aovs: &AovSelection) {
        let color = sample.color.map(f64::from);
        for (sum, value) in self.color.iter_mut().zip(color) {
            *sum += value;
        }
        self.transmittance += f64::from(sample.transmittance);
        if aovs.variance {
            let sums = self.color_squared.iter_mut().zip(&mut self.color_squared_low);
            for ((sum, low), value) in sums.zip(color) {
                // The square of an f32 is exact.
                let lost;
                (*sum, lost) = sum_and_rest(*sum, value * value);
                *low += lost;
            }
        }
        if aovs.coverage {
            self.uncovered += f64::from(sample.uncovered);
        }
    }

    /// Adds the unit normal of a sample's visible layer, or zero.
    pub fn add_normal(&mut self, normal: DVec3) {
        const STEPS: f64 = (1_u64 << 32) as f64;
        self.normal += (normal * STEPS).round() / STEPS;
    }

    /// Adds the sums of later samples.
    fn add_all(&mut self, later: &Self) {
        let mut later = *later;
        let earlier = *self;
        for plane in &PLANES {
            *(plane.of)(self) += *(plane.of)(&mut later);
        }
        for channel in 0..3 {
            let (sum, lost) = sum_and_rest(earlier.color_squared[channel], later.color_squared[channel]);
            self.color_squared[channel] = sum;
            self.color_squared_low[channel] += lost;
        }
    }

    /// Writes the means over `samples` samples to a pixel of the film; all but its id.
    #[inline(always)]
    pub fn finish(&self, samples: u32, ending: &Ending, index: usize, film: &mut Film) {
        let n = f64::from(samples);
        film.rgba[index] = ending.color(self.color.map(|sum| sum / n), self.transmittance / n);
        if self.visible > 0.0 {
            set(&mut film.depth, index, (self.depth / self.visible) as f32);
            set(&mut film.normal, index, (self.normal / self.visible).as_vec3());
            set(&mut film.albedo, index, (self.albedo / self.visible).as_vec3());
            set(&mut film.position, index, (self.position / self.visible).as_vec3());
        }
        set(&mut film.coverage, index, (1.0 - self.uncovered / n) as f32);
        set(&mut film.layers, index, (self.layers / n) as f32);
        set(&mut film.samples, index, samples as f32);
        if let Some(variance) = &mut film.variance {
            // It takes longer than all the rest.
            variance[index] = self.variance_of_the_mean(n);
        }
        if let Some(sums) = &mut film.sums {
            sums.set(index, *self);
        }
    }

    /// Variance of the mean colour of n samples, per channel; zero for a single one.
    fn variance_of_the_mean(&self, n: f64) -> Vec3 {
        if n < 2.0 {
            return Vec3::ZERO;
        }
        // n sum(x^2) - sum(x)^2 in twice the precision: where colours hardly differ, little is left of them.
        let variance = [0, 1, 2].map(|channel| {
            let (squared, sum) = (self.color_squared[channel], self.color[channel]);
            let minuend = n * squared;
            let rest = libm::fma(n, squared, -minuend) + n * self.color_squared_low[channel];
            let subtrahend = sum * sum;
            let difference = (minuend - subtrahend) + (rest - libm::fma(sum, sum, -subtrahend));
            (difference / (n * n * (n - 1.0))).max(0.0) as f32
        });
        Vec3::from(variance)
    }
}

impl Ending {
    /// The mean over its background: premultiplied, linear colour and alpha.
    fn color(&self, color: [f64; 3], transmittance: f64) -> [f32; 4] {
        let mut rgba = [color[0], color[1], color[2], 1.0 - transmittance];
        if let Some([red, green, blue, alpha]) = self.background.map(|values| values.map(f64::from)) {
            let weight = transmittance * alpha;
            for (value, behind) in rgba.iter_mut().zip([red, green, blue]) {
                *value += weight * if self.display_space { srgb::encode(behind) } else { behind };
            }
            rgba[3] += weight;
        }
        let [red, green, blue, alpha] = rgba;
        if self.display_space && alpha > 0.0 {
            // Blended as trained, in the display's space; linear from here on.
            let [red, green, blue] = [red, green, blue].map(|value| srgb::decode(value / alpha) * alpha);
            rgba = [red, green, blue, alpha];
        }
        rgba.map(|value| value as f32)
    }
}

/// A sum, rounded, and what rounding took from it (Knuth).
#[inline(always)]
fn sum_and_rest(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let of_b = sum - a;
    (sum, (a - (sum - of_b)) + (b - of_b))
}

/// Sets a pixel of a channel that may not be there.
fn set<T>(channel: &mut Option<Vec<T>>, index: usize, value: T) {
    if let Some(values) = channel {
        values[index] = value;
    }
}

/// The sums of a film of a part of the samples.
#[derive(Debug, Clone, PartialEq)]
pub struct SampleSums {
    /// Number of samples that are in them.
    pub samples: u32,
    /// How they become pixels.
    pub ending: Ending,
    /// The film's AOVs.
    pub aovs: AovSelection,
    /// A value a pixel for each of the sums that these need: [`SampleSums::names`].
    pub planes: Vec<Vec<f64>>,
}

/// One of the sums.
struct Plane {
    name: &'static str,
    is_needed: fn(&AovSelection) -> bool,
    of: fn(&mut Sums) -> &mut f64,
}

const fn plane(
    name: &'static str,
    is_needed: fn(&AovSelection) -> bool,
    of: fn(&mut Sums) -> &mut f64,
) -> Plane {
    Plane { name, is_needed, of }
}

/// All sums, in the order of [`SampleSums::planes`].
const PLANES: [Plane; 23] = [
    plane("color.R", |_| true, |sums| &mut sums.color[0]),
    plane("color.G", |_| true, |sums| &mut sums.color[1]),
    plane("color.B", |_| true, |sums| &mut sums.color[2]),
    plane("transmittance", |_| true, |sums| &mut sums.transmittance),
    plane("square.R", |aovs| aovs.variance, |sums| &mut sums.color_squared[0]),
    plane("square.G", |aovs| aovs.variance, |sums| &mut sums.color_squared[1]),
    plane("square.B", |aovs| aovs.variance, |sums| &mut sums.color_squared[2]),
    plane("squareRest.R", |aovs| aovs.variance, |sums| &mut sums.color_squared_low[0]),
    plane("squareRest.G", |aovs| aovs.variance, |sums| &mut sums.color_squared_low[1]),
    plane("squareRest.B", |aovs| aovs.variance, |sums| &mut sums.color_squared_low[2]),
    plane("uncovered", |aovs| aovs.coverage, |sums| &mut sums.uncovered),
    plane("layers", |aovs| aovs.layers, |sums| &mut sums.layers),
    plane("visible", has_visible_layer, |sums| &mut sums.visible),
    plane("depth", |aovs| aovs.depth, |sums| &mut sums.depth),
    plane("N.X", |aovs| aovs.normal, |sums| &mut sums.normal.x),
    plane("N.Y", |aovs| aovs.normal, |sums| &mut sums.normal.y),
    plane("N.Z", |aovs| aovs.normal, |sums| &mut sums.normal.z),
    plane("albedo.R", |aovs| aovs.albedo, |sums| &mut sums.albedo.x),
    plane("albedo.G", |aovs| aovs.albedo, |sums| &mut sums.albedo.y),
    plane("albedo.B", |aovs| aovs.albedo, |sums| &mut sums.albedo.z),
    plane("P.X", |aovs| aovs.position, |sums| &mut sums.position.x),
    plane("P.Y", |aovs| aovs.position, |sums| &mut sums.position.y),
    plane("P.Z", |aovs| aovs.position, |sums| &mut sums.position.z),
];

/// Whether some AOV is a mean over the samples that have a visible layer.
fn has_visible_layer(aovs: &AovSelection) -> bool {
    aovs.depth || aovs.normal || aovs.albedo || aovs.position
}

fn needed(aovs: AovSelection) -> impl Iterator<Item = &'static Plane> {
    PLANES.iter().filter(move |plane| (plane.is_needed)(&aovs))
}

impl SampleSums {
    /// Sums of a film of this window and these AOVs, to which nothing was added yet; `samples` is what will be.
    ///
    /// # Errors
    /// [`Error::Memory`].
    pub fn new(samples: u32, ending: Ending, window: &PixelRect, aovs: AovSelection) -> Result<Self, Error> {
        let planes = needed(aovs).map(|_| filled(FILM, 0.0, window.area(), SMALLER_FILM));
        Ok(Self { samples, ending, aovs, planes: planes.collect::<Result<_, _>>()? })
    }

    /// Bytes that they take for each pixel.
    pub fn bytes_per_pixel(aovs: AovSelection) -> usize {
        needed(aovs).count() * size_of::<f64>()
    }

    /// The names of the planes of a film with these AOVs.
    pub fn names(aovs: AovSelection) -> impl Iterator<Item = &'static str> {
        needed(aovs).map(|plane| plane.name)
    }

    fn get(&self, index: usize) -> Sums {
        let mut sums = Sums::default();
        for (plane, values) in needed(self.aovs).zip(&self.planes) {
            *(plane.of)(&mut sums) = values[index];
        }
        sums
    }

    fn set(&mut self, index: usize, mut sums: Sums) {
        for (plane, values) in needed(self.aovs).zip(&mut self.planes) {
            values[index] = *(plane.of)(&mut sums);
        }
    }

    /// Whether others are of the same kind and number of pixels, so that they can be added.
    fn goes_with(&self, other: &Self) -> bool {
        let lengths = |sums: &Self| sums.planes.iter().map(Vec::len).collect::<Vec<_>>();
        self.aovs == other.aovs && self.ending == other.ending && lengths(self) == lengths(other)
    }
}

impl Film {
    /// Adds the samples of a film of the same picture and window that come after this one's. Both must have their
    /// [`Film::sums`].
    ///
    /// The result agrees with the film of all these samples in its ids, normals, layers and samples to the bit, in all
    /// else to the rounding of sums in `f64`: 2 ulp.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the films have no sums, or do not go together.
    pub fn add_samples(&mut self, later: &Self) -> Result<(), Error> {
        const EXPECTED: &str = "films of parts of the samples of one window, with their sums";
        let mismatch = |what| Err(Error::invalid("films", what, EXPECTED));
        let (Some(mut sums), Some(added)) = (self.sums.take(), &later.sums) else {
            return mismatch("one without sums");
        };
        let area = self.window.area();
        let fits = sums.planes.iter().all(|plane| plane.len() == area) && self.rgba.len() == area;
        if self.window != later.window || !fits || !sums.goes_with(added) {
            return mismatch("two that differ in more than their samples");
        }
        sums.samples += added.samples;
        let (samples, ending) = (sums.samples, sums.ending);
        self.sums = Some(sums);
        for index in 0..area {
            let Some(sums) = &self.sums else { break };
            let mut both = sums.get(index);
            both.add_all(&added.get(index));
            both.finish(samples, &ending, index, self);
        }
        if let (Some(ids), Some(later)) = (&mut self.id, &later.id) {
            for (id, &later) in ids.iter_mut().zip(later).filter(|(id, _)| **id == NO_ID) {
                *id = later;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sums of some samples, by a recipe that makes them hard to add: nearly alike, or of very different size.
    fn sums(samples: impl Iterator<Item = u32>, spread: f32) -> Sums {
        let mut sums = Sums::default();
        for sample in samples {
            let x = 0.3 + spread * (sample.wrapping_mul(2_654_435_761) >> 8) as f32 / 16_777_216.0;
            let color = [x, x * 1e-6, x * 1e6];
            sums.add(&SampleColor { color, transmittance: x, uncovered: x }, &AovSelection::ALL);
            let side = if sample % 2 == 0 { 1.0 } else { -1.0 };
            sums.add_normal(DVec3::new(side * 0.6, 0.1, 0.8).normalize());
        }
        sums
    }

    /// The number of floats between two positive ones.
    fn ulps(a: f32, b: f32) -> u32 {
        a.to_bits().abs_diff(b.to_bits())
    }

    #[test]
    fn variances_are_exact_where_colours_hardly_differ() {
        for (samples, spread) in [(16, 1.0), (13, 1e-3), (16, 1e-6), (1000, 1e-6), (7, 3e-8)] {
            let found = sums(0..samples, spread).variance_of_the_mean(samples.into());
            // Exact: integers in units of the last place of the smallest value.
            let values: Vec<i128> = (0..samples)
                .map(|sample| {
                    let x = 0.3 + spread * (sample.wrapping_mul(2_654_435_761) >> 8) as f32 / 16_777_216.0;
                    (f64::from(x) * (1_u64 << 26) as f64) as i128
                })
                .collect();
            let (n, sum) = (i128::from(samples), values.iter().sum::<i128>());
            let difference = n * values.iter().map(|x| x * x).sum::<i128>() - sum * sum;
            let exact = difference as f64 / (n * n * (n - 1)) as f64 / (1_u64 << 52) as f64;
            assert!(ulps(found.x, exact as f32) <= 1, "{samples} {spread}: {} {exact}", found.x);
        }
        assert_eq!(sums(0..16, 0.0).variance_of_the_mean(16.0), Vec3::ZERO);
        assert_eq!(sums(0..1, 1.0).variance_of_the_mean(1.0), Vec3::ZERO);
    }

    #[test]
    fn parts_give_the_whole() {
        let ending = Ending { background: Some([0.2, 0.4, 0.6, 0.5]), display_space: true };
        let window = PixelRect::new(0, 0, 1, 1);
        let film = |range: std::ops::Range<u32>, spread| {
            let mut film = Film::new([1, 1], window, AovSelection::ALL);
            let count = range.len() as u32;
            film.sums = Some(SampleSums::new(count, ending, &window, AovSelection::ALL).unwrap());
            let mut sums = sums(range.clone(), spread);
            sums.visible = f64::from(count);
            sums.finish(count, &ending, 0, &mut film);
            film.id = Some(vec![if range.start == 0 { NO_ID } else { range.start }]);
            film
        };
        for spread in [0.0, 1e-6, 1e-3, 0.5] {
            let whole = film(0..16, spread);
            let mut joined = film(0..5, spread);
            joined.add_samples(&film(5..6, spread)).unwrap();
            joined.add_samples(&film(6..16, spread)).unwrap();
            assert_eq!(joined.normal, whole.normal);
            assert_eq!(joined.normal.as_ref().unwrap()[0].x, 0.0, "two sides cancel");
            assert_eq!((&joined.samples, &joined.layers), (&whole.samples, &whole.layers));
            assert_eq!(joined.id, Some(vec![5]));
            for channel in 0..4 {
                assert!(ulps(joined.rgba[0][channel], whole.rgba[0][channel]) <= 1, "{spread} {channel}");
            }
            let variances = |film: &Film| film.variance.as_ref().unwrap()[0].to_array();
            for (a, b) in variances(&joined).into_iter().zip(variances(&whole)) {
                assert!(ulps(a, b) <= 1, "{spread}: {a} {b}");
            }
        }
    }

    #[test]
    fn what_does_not_go_together_is_refused() {
        let window = PixelRect::new(0, 0, 2, 1);
        let ending = Ending { background: None, display_space: false };
        let film = |window, aovs| {
            let mut film = Film::new([4, 4], window, aovs);
            film.sums = Some(SampleSums::new(1, ending, &window, aovs).unwrap());
            film
        };
        let none = AovSelection::default();
        let other = PixelRect::new(1, 0, 3, 1);
        assert!(film(window, none).add_samples(&film(window, none)).is_ok());
        assert!(film(window, none).add_samples(&film(other, none)).is_err());
        assert!(film(window, none).add_samples(&film(window, AovSelection::ALL)).is_err());
        assert!(film(window, none).add_samples(&Film::new([4, 4], window, none)).is_err());
    }
}
