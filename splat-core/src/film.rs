//! The finished picture: colour, alpha and what else was asked for (AOVs).

use crate::memory::filled;
use crate::sums::{Ending, SampleSums};
use crate::{Error, RenderOptions};
use glam::{DVec3, Vec3};

/// A half-open rectangle of pixels of the full frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PixelRect {
    /// First column.
    pub x0: i32,
    /// First row.
    pub y0: i32,
    /// One past the last column.
    pub x1: i32,
    /// One past the last row.
    pub y1: i32,
}

impl PixelRect {
    /// The rectangle [x0, x1) x [y0, y1).
    pub const fn new(x0: i32, y0: i32, x1: i32, y1: i32) -> Self {
        Self { x0, y0, x1, y1 }
    }

    /// Number of columns; 0 if there is none.
    pub fn width(&self) -> usize {
        (self.x1 - self.x0).max(0) as usize
    }

    /// Number of rows; 0 if there is none.
    pub fn height(&self) -> usize {
        (self.y1 - self.y0).max(0) as usize
    }

    /// Number of pixels.
    pub fn area(&self) -> usize {
        self.width() * self.height()
    }

    /// Whether no pixel is inside.
    pub fn is_empty(&self) -> bool {
        self.x0 >= self.x1 || self.y0 >= self.y1
    }

    /// The pixels that both rectangles have.
    pub fn intersect(&self, other: &Self) -> Self {
        Self {
            x0: self.x0.max(other.x0),
            y0: self.y0.max(other.y0),
            x1: self.x1.min(other.x1),
            y1: self.y1.min(other.y1),
        }
    }
}

/// Which arbitrary output variables are computed besides colour and alpha. What is off costs nothing.
///
/// The *visible layer* of a sample is the one where its transmittance falls to 1/2 or less.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct AovSelection {
    /// [`Film::depth`].
    pub depth: bool,
    /// [`Film::normal`].
    pub normal: bool,
    /// [`Film::albedo`].
    pub albedo: bool,
    /// [`Film::position`].
    pub position: bool,
    /// [`Film::id`].
    pub id: bool,
    /// [`Film::coverage`].
    pub coverage: bool,
    /// [`Film::layers`].
    pub layers: bool,
    /// [`Film::samples`].
    pub samples: bool,
    /// [`Film::variance`].
    pub variance: bool,
}

impl AovSelection {
    /// Bytes that a film takes for each pixel.
    pub fn bytes_per_pixel(&self) -> usize {
        let vectors = [self.normal, self.albedo, self.position, self.variance];
        let scalars = [self.depth, self.id, self.coverage, self.layers, self.samples];
        let count = |wanted: &[bool]| wanted.iter().filter(|wanted| **wanted).count();
        size_of::<[f32; 4]>() + count(&vectors) * size_of::<Vec3>() + count(&scalars) * size_of::<f32>()
    }

    /// All of them.
    pub const ALL: Self = Self {
        depth: true,
        normal: true,
        albedo: true,
        position: true,
        id: true,
        coverage: true,
        layers: true,
        samples: true,
        variance: true,
    };
}

/// [`Film::id`] of a pixel in which no sample hits anything.
pub const NO_ID: u32 = u32::MAX;

/// What errors call a film, and their advice.
pub(crate) const FILM: &str = "the picture";
pub(crate) const SMALLER_FILM: &str =
    "a smaller size, fewer AOVs, or a part at a time (--crop, --tile) need less";

/// A picture, or the window of one.
///
/// All arrays are row-major over `window`, row 0 the top one; the optional ones are `None` unless asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Film {
    /// Width and height of the full frame, in pixels.
    pub frame: [u32; 2],
    /// The pixels of the frame that are here.
    pub window: PixelRect,
    /// Red, green, blue (linear, scene-referred, premultiplied) and alpha (coverage times opacity).
    pub rgba: Vec<[f32; 4]>,
    /// Depth w in camera units: mean, over the samples that have a visible layer, of that layer's weighted mean
    /// depth; +infinity where there is none.
    pub depth: Option<Vec<f32>>,
    /// World-space unit normal of the visible layer, mean over the samples that have one; zero without.
    pub normal: Option<Vec<Vec3>>,
    /// Unlit colour of the visible layer, mean over the samples that have one; zero without.
    pub albedo: Option<Vec<Vec3>>,
    /// World position minus `position_origin` at the visible layer's depth, mean over the samples that have one;
    /// zero without.
    pub position: Option<Vec<Vec3>>,
    /// What was subtracted from `position`: zero, unless the cloud lies so far from zero that `f32` world
    /// coordinates would lose it.
    pub position_origin: DVec3,
    /// Index in the file of the front layer's heaviest fragment in the first sample that hits; [`NO_ID`] without.
    pub id: Option<Vec<u32>>,
    /// Mean coverage, opacity left out, in [0, 1].
    pub coverage: Option<Vec<f32>>,
    /// Mean number of layers a sample.
    pub layers: Option<Vec<f32>>,
    /// Number of samples taken.
    pub samples: Option<Vec<f32>>,
    /// Variance of the mean of the samples' red, green and blue (before the background); zero for one sample.
    pub variance: Option<Vec<Vec3>>,
    /// What the means were made of, if only a part of the samples was taken: see [`Film::add_samples`].
    pub sums: Option<SampleSums>,
}

impl Film {
    /// An empty film: transparent, nothing hit.
    ///
    /// # Panics
    /// If there is no memory for it: [`Film::try_new`] is for films that may be large.
    pub fn new(frame: [u32; 2], window: PixelRect, aovs: AovSelection) -> Self {
        Self::try_new(frame, window, aovs).unwrap_or_else(|error| panic!("{error}"))
    }

    /// An empty film: transparent, nothing hit.
    ///
    /// # Errors
    /// [`Error::Memory`].
    pub fn try_new(frame: [u32; 2], window: PixelRect, aovs: AovSelection) -> Result<Self, Error> {
        fn channel<T: Clone>(wanted: bool, value: T, count: usize) -> Result<Option<Vec<T>>, Error> {
            wanted.then(|| filled(FILM, value, count, SMALLER_FILM)).transpose()
        }
        let n = window.area();
        Ok(Self {
            frame,
            window,
            rgba: filled(FILM, [0.0; 4], n, SMALLER_FILM)?,
            depth: channel(aovs.depth, f32::INFINITY, n)?,
            normal: channel(aovs.normal, Vec3::ZERO, n)?,
            albedo: channel(aovs.albedo, Vec3::ZERO, n)?,
            position: channel(aovs.position, Vec3::ZERO, n)?,
            position_origin: DVec3::ZERO,
            id: channel(aovs.id, NO_ID, n)?,
            coverage: channel(aovs.coverage, 0.0, n)?,
            layers: channel(aovs.layers, 0.0, n)?,
            samples: channel(aovs.samples, 0.0, n)?,
            variance: channel(aovs.variance, Vec3::ZERO, n)?,
            sums: None,
        })
    }

    /// An empty film for a picture with these options: with sums, if they take a part of the samples.
    ///
    /// # Errors
    /// [`Error::Memory`].
    pub fn for_picture(frame: [u32; 2], window: PixelRect, options: &RenderOptions) -> Result<Self, Error> {
        let mut film = Self::try_new(frame, window, options.aovs)?;
        if options.takes_part_of_samples() {
            let samples = options.sample_range().len() as u32;
            film.sums = Some(SampleSums::new(samples, Ending::of(options), &window, options.aovs)?);
        }
        Ok(film)
    }

    /// Gives every pixel what the first one holds in the channels where a pixel without fragments is not as a new one.
    pub(crate) fn repeat_first_pixel(&mut self) {
        fill_with_first(&mut self.rgba);
        if let Some(samples) = &mut self.samples {
            fill_with_first(samples);
        }
        for plane in self.sums.iter_mut().flat_map(|sums| &mut sums.planes) {
            fill_with_first(plane);
        }
    }

    /// What it holds besides colour and alpha.
    pub fn aovs(&self) -> AovSelection {
        AovSelection {
            depth: self.depth.is_some(),
            normal: self.normal.is_some(),
            albedo: self.albedo.is_some(),
            position: self.position.is_some(),
            id: self.id.is_some(),
            coverage: self.coverage.is_some(),
            layers: self.layers.is_some(),
            samples: self.samples.is_some(),
            variance: self.variance.is_some(),
        }
    }

    /// Copies another film, whose window lies within this one's and which holds the same channels.
    pub fn paste(&mut self, part: &Self) {
        let target = (self.window, part.window);
        paste(&mut self.rgba, &part.rgba, target);
        paste_optional(&mut self.depth, part.depth.as_deref(), target);
        paste_optional(&mut self.normal, part.normal.as_deref(), target);
        paste_optional(&mut self.albedo, part.albedo.as_deref(), target);
        paste_optional(&mut self.position, part.position.as_deref(), target);
        paste_optional(&mut self.id, part.id.as_deref(), target);
        paste_optional(&mut self.coverage, part.coverage.as_deref(), target);
        paste_optional(&mut self.layers, part.layers.as_deref(), target);
        paste_optional(&mut self.samples, part.samples.as_deref(), target);
        paste_optional(&mut self.variance, part.variance.as_deref(), target);
        if let (Some(to), Some(from)) = (&mut self.sums, &part.sums) {
            to.planes.iter_mut().zip(&from.planes).for_each(|(to, from)| paste(to, from, target));
        }
    }

    /// The part of this film in `window`, which lies within its own.
    pub fn part(&self, window: PixelRect) -> Self {
        fn cut<T: Copy>(values: &[T], whole: PixelRect, part: PixelRect) -> Vec<T> {
            let rows = (part.y0..part.y1).map(|y| (y - whole.y0) as usize * whole.width());
            let start = |row: usize| row + (part.x0 - whole.x0) as usize;
            rows.flat_map(|row| &values[start(row)..start(row) + part.width()]).copied().collect()
        }
        let whole = self.window;
        Self {
            frame: self.frame,
            window,
            rgba: cut(&self.rgba, whole, window),
            depth: self.depth.as_ref().map(|values| cut(values, whole, window)),
            normal: self.normal.as_ref().map(|values| cut(values, whole, window)),
            albedo: self.albedo.as_ref().map(|values| cut(values, whole, window)),
            position: self.position.as_ref().map(|values| cut(values, whole, window)),
            position_origin: self.position_origin,
            id: self.id.as_ref().map(|values| cut(values, whole, window)),
            coverage: self.coverage.as_ref().map(|values| cut(values, whole, window)),
            layers: self.layers.as_ref().map(|values| cut(values, whole, window)),
            samples: self.samples.as_ref().map(|values| cut(values, whole, window)),
            variance: self.variance.as_ref().map(|values| cut(values, whole, window)),
            sums: self.sums.as_ref().map(|sums| SampleSums {
                samples: sums.samples,
                ending: sums.ending,
                aovs: sums.aovs,
                planes: sums.planes.iter().map(|values| cut(values, whole, window)).collect(),
            }),
        }
    }

    /// Puts linear red, green, blue, and alpha behind the picture; its sums, which know nothing of it, are gone.
    pub fn put_behind(&mut self, background: [f32; 4]) {
        let [red, green, blue, alpha] = background;
        let behind = [red * alpha, green * alpha, blue * alpha, alpha];
        for rgba in &mut self.rgba {
            let transmittance = 1.0 - rgba[3];
            rgba.iter_mut().zip(behind).for_each(|(value, behind)| *value += transmittance * behind);
        }
        self.sums = None;
    }

    /// Width of the window, in pixels.
    pub fn width(&self) -> usize {
        self.window.width()
    }

    /// Height of the window, in pixels.
    pub fn height(&self) -> usize {
        self.window.height()
    }

    /// Index of the frame's pixel (x, y) in the arrays; it must lie in the window.
    pub fn index(&self, x: i32, y: i32) -> usize {
        (y - self.window.y0) as usize * self.width() + (x - self.window.x0) as usize
    }
}

fn fill_with_first<T: Copy>(values: &mut [T]) {
    if let [first, rest @ ..] = values {
        rest.fill(*first);
    }
}

/// Copies a channel of the window `part` into that of the window `whole`, which contains it, row by row.
pub fn paste<T: Copy>(to: &mut [T], from: &[T], (whole, part): (PixelRect, PixelRect)) {
    let left = (part.x0 - whole.x0) as usize;
    let top = (part.y0 - whole.y0) as usize;
    for (row, values) in from.chunks_exact(part.width().max(1)).enumerate() {
        let start = (top + row) * whole.width() + left;
        to[start..start + values.len()].copy_from_slice(values);
    }
}

/// [`paste`] for a channel that may not be there.
fn paste_optional<T: Copy>(to: &mut Option<Vec<T>>, from: Option<&[T]>, windows: (PixelRect, PixelRect)) {
    if let (Some(to), Some(from)) = (to, from) {
        paste(to, from, windows);
    }
}
