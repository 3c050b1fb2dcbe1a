//! Pictures as OpenEXR files have them, ours and others': to compare, to join, and to write again.

use super::{Channel, Channels, Compression, ExrOptions, Place, SUMS, sum_names, write_channels};
use crate::ply::open;
use crate::texture_file::Format;
use crate::texture_file::exr::channels;
pub use crate::texture_file::exr::channels::Values;
use crate::{Error, Metadata};
use exr::meta::attribute::SampleType;
use glam::{DMat4, DVec3};
use splat_core::film::paste;
use splat_core::{AovSelection, Ending, Film, PixelRect, SampleSums};
use std::collections::BTreeMap;
use std::io::{BufReader, Cursor, Read};
use std::path::Path;

/// A picture: channels by name.
#[derive(Debug, Clone, PartialEq)]
pub struct ExrPicture {
    /// The display window: the full frame, which for ours begins at 0.
    pub frame: PixelRect,
    /// The data window: the pixels that are here.
    pub window: PixelRect,
    /// In the order of their names; each has a value for each pixel of the window, row by row.
    pub channels: Vec<(String, Values)>,
    /// How it was made, if it says so as ours do.
    pub metadata: Metadata,
    /// What is to be added to the channels `P`.
    pub position_origin: Option<DVec3>,
    /// How sums become colours, if there are sums.
    pub ending: Option<Ending>,
    /// How the file is packed; `None` if ours never are so.
    pub compression: Option<Compression>,
}

/// Reads the first flat image of an OpenEXR file: scan lines or tiles (the largest level), every compression but HTJ2K.
///
/// # Errors
/// [`Error::Io`]; [`Error::Unsupported`] for what is no OpenEXR file, deep data and subsampled channels;
/// [`Error::Limit`] for an image of more than [`crate::texture_file::MAX_PIXELS`], 2^24 per axis, or more than
/// memory; [`Error::Invalid`] for anything damaged, truncated, or claiming more than the file can hold.
pub fn read_exr(path: &Path) -> Result<ExrPicture, Error> {
    let (mut file, size) = open(path)?;
    let mut start = Vec::new();
    file.by_ref().take(16).read_to_end(&mut start).map_err(Error::io(path, "read"))?;
    if Format::of(&start) != Format::Exr {
        return Err(Error::unsupported(path, "a file that is no OpenEXR image", "an OpenEXR image"));
    }
    let reader = Cursor::new(start).chain(BufReader::with_capacity(256 << 10, file));
    let read = channels::read(reader, size, path)?;
    let attributes = Attributes(&read.attributes);
    Ok(ExrPicture {
        frame: attributes.frame().unwrap_or(read.window),
        window: read.window,
        metadata: attributes.metadata(),
        position_origin: attributes
            .text("positionOrigin")
            .and_then(|text| numbers(&text))
            .map(DVec3::from_array),
        ending: attributes.ending(),
        compression: Compression::of(read.compression),
        channels: read.channels,
    })
}

/// Writes a picture as an EXR file, in one step ([`crate::AtomicFile`]); a film that was read comes out as
/// [`super::write_exr`] wrote it.
///
/// # Errors
/// [`Error::Io`]; [`Error::Core`] if there is no pixel, no channel, or not a value a pixel; [`Error::Encode`].
pub fn write_exr_picture(path: &Path, picture: &ExrPicture, compression: Compression) -> Result<(), Error> {
    let area = picture.window.area();
    let is_whole = picture.channels.iter().all(|(_, values)| values.len() == area);
    if picture.window.is_empty() || picture.channels.is_empty() || !is_whole {
        let cause =
            splat_core::Error::invalid("picture", "none, or a part", "a value a pixel in each channel");
        return Err(Error::Core { path: path.to_owned(), cause });
    }
    let channels = picture.channels.iter().map(|(name, values)| match values {
        Values::Half(values) => Channel::new(name, SampleType::F16, super::Values::Half(values)),
        Values::Float(values) => Channel::new(name, SampleType::F32, super::Values::Scalar(values)),
        Values::Uint(values) => Channel::new(name, SampleType::U32, super::Values::Id(values)),
    });
    let mut channels: Vec<_> = channels.collect();
    channels.sort_by(|a, b| a.name.cmp(&b.name));
    let place = Place {
        frame: [picture.frame.x1 as u32, picture.frame.y1 as u32],
        window: picture.window,
        position_origin: picture.position_origin,
        ending: picture.ending,
    };
    let options = ExrOptions { compression, ..ExrOptions::default() };
    write_channels(path, &place, Channels(channels), &picture.metadata, &options)
}

impl Values {
    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Self::Half(values) => values.len(),
            Self::Float(values) => values.len(),
            Self::Uint(values) => values.len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// One of them, exactly.
    pub fn get(&self, index: usize) -> f64 {
        match self {
            Self::Half(values) => values[index].to_f64(),
            Self::Float(values) => values[index].into(),
            Self::Uint(values) => values[index].into(),
        }
    }

    /// Their type, as the format calls it.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Half(_) => "half",
            Self::Float(_) => "float",
            Self::Uint(_) => "uint",
        }
    }

    /// Copies those of the window `part` into these of the window `whole`, which contains it; if they are of one type.
    pub(crate) fn paste(&mut self, from: &Self, whole: PixelRect, part: PixelRect) {
        match (self, from) {
            (Self::Half(to), Self::Half(from)) => paste(to, from, (whole, part)),
            (Self::Float(to), Self::Float(from)) => paste(to, from, (whole, part)),
            (Self::Uint(to), Self::Uint(from)) => paste(to, from, (whole, part)),
            _ => {}
        }
    }

    /// As many as `count`, all zero, of the same type.
    ///
    /// # Errors
    /// If memory ends.
    pub(crate) fn zeros(&self, count: usize) -> Result<Self, std::collections::TryReserveError> {
        fn zeros<T: Copy + Default>(count: usize) -> Result<Vec<T>, std::collections::TryReserveError> {
            let mut values = Vec::new();
            values.try_reserve_exact(count)?;
            values.resize(count, T::default());
            Ok(values)
        }
        Ok(match self {
            Self::Half(_) => Self::Half(zeros(count)?),
            Self::Float(_) => Self::Float(zeros(count)?),
            Self::Uint(_) => Self::Uint(zeros(count)?),
        })
    }
}

impl ExrPicture {
    /// The values of a channel.
    pub fn channel(&self, name: &str) -> Option<&Values> {
        self.channels.iter().find(|(other, _)| other == name).map(|(_, values)| values)
    }

    /// The same without its channels.
    pub(crate) fn without_channels(&self) -> Self {
        Self { channels: Vec::new(), metadata: self.metadata.clone(), ..*self }
    }

    /// Whether a channel is one of a sum, and nothing to look at.
    pub fn is_sum(name: &str) -> bool {
        name.split_once('.').is_some_and(|(layer, _)| layer == SUMS)
    }

    /// The film whose sums these are; nothing else of it is filled in but ids. None if a sum is missing.
    pub(crate) fn film_of_sums(&self) -> Option<Film> {
        let has = |name: &str| self.channel(name).is_some();
        let aovs = AovSelection {
            depth: has("Z"),
            normal: has("N.X"),
            albedo: has("albedo.R"),
            position: has("P.X"),
            id: has("id"),
            coverage: has("coverage"),
            layers: has("layers"),
            samples: has("samples"),
            variance: has("variance.R"),
        };
        let uint = |name: &str| match self.channel(name)? {
            Values::Uint(values) => Some(values),
            _ => None,
        };
        let plane = |name: &str| -> Option<Vec<f64>> {
            let [high, low] = sum_names(name);
            let joined = |(&high, &low): (&u32, &u32)| f64::from_bits(u64::from(high) << 32 | u64::from(low));
            Some(uint(&high)?.iter().zip(uint(&low)?).map(joined).collect())
        };
        let range = self.metadata.sample_range.as_ref()?;
        let mut film = Film::new([self.frame.x1 as u32, self.frame.y1 as u32], self.window, aovs);
        film.sums = Some(SampleSums {
            samples: range.end.checked_sub(range.start)?,
            ending: self.ending?,
            aovs,
            planes: SampleSums::names(aovs).map(plane).collect::<Option<_>>()?,
        });
        if aovs.id {
            film.id = Some(uint("id")?.clone());
        }
        Some(film)
    }

    /// The channels of a film, as [`super::write_exr`] writes them.
    pub(crate) fn set_film(&mut self, film: &Film, full_floats: bool) -> Result<(), splat_core::Error> {
        let channels = Channels::new(film, full_floats)?;
        let values = |channel: Channel| (channel.name.to_string(), channel.values());
        self.channels = channels.0.into_iter().map(values).collect();
        self.ending = film.sums.as_ref().map(|sums| sums.ending);
        Ok(())
    }
}

impl Channel<'_> {
    /// What is written of it.
    fn values(&self) -> Values {
        let count = match &self.values {
            super::Values::Color(colors, _) => colors.len(),
            super::Values::Vector(vectors, _) => vectors.len(),
            super::Values::Scalar(scalars) => scalars.len(),
            super::Values::Half(halves) => halves.len(),
            super::Values::Id(ids) => ids.len(),
            super::Values::High(plane) | super::Values::Low(plane) => plane.len(),
        };
        let mut bytes = vec![0; count * self.kind.bytes_per_sample()];
        self.write(0, &mut bytes);
        match self.kind {
            SampleType::F16 => Values::Half(numbers_of(&bytes, exr::prelude::f16::from_ne_bytes)),
            SampleType::F32 => Values::Float(numbers_of(&bytes, f32::from_ne_bytes)),
            SampleType::U32 => Values::Uint(numbers_of(&bytes, u32::from_ne_bytes)),
        }
    }
}

fn numbers_of<T, const N: usize>(bytes: &[u8], convert: fn([u8; N]) -> T) -> Vec<T> {
    bytes.as_chunks::<N>().0.iter().map(|&chunk| convert(chunk)).collect()
}

/// The attributes of a file, by name and type.
struct Attributes<'a>(&'a BTreeMap<(Vec<u8>, Vec<u8>), Vec<u8>>);

impl Attributes<'_> {
    fn get(&self, name: &str, kind: &str) -> Option<&[u8]> {
        let key = (name.as_bytes().to_vec(), kind.as_bytes().to_vec());
        self.0.get(&key).map(Vec::as_slice)
    }

    fn text(&self, name: &str) -> Option<String> {
        Some(String::from_utf8_lossy(self.get(name, "string")?).into_owned())
    }

    fn numbers<T, const N: usize, const M: usize>(
        &self,
        (name, kind): (&str, &str),
        convert: fn([u8; N]) -> T,
    ) -> Option<[T; M]> {
        numbers_of(self.get(name, kind)?, convert).try_into().ok()
    }

    fn frame(&self) -> Option<PixelRect> {
        let [x0, y0, x1, y1] = self.numbers(("displayWindow", "box2i"), i32::from_le_bytes)?;
        Some(PixelRect::new(x0, y0, x1.checked_add(1)?, y1.checked_add(1)?))
    }

    fn ending(&self) -> Option<Ending> {
        let background = self.text("sumsBackground")?;
        let background = if background == "none" { None } else { Some(numbers(&background)?) };
        let display_space = match self.text("sumsSpace")?.as_str() {
            "sRGB" => true,
            "linear" => false,
            _ => return None,
        };
        Some(Ending { background, display_space })
    }

    fn metadata(&self) -> Metadata {
        let matrix = self.numbers::<f32, 4, 16>(("worldToCamera", "m44f"), f32::from_le_bytes);
        // Its rows are the columns of ours.
        let matrix = matrix.map(|values| DMat4::from_cols_array(&values.map(f64::from)));
        let range = self.text("sampleRange").and_then(|text| {
            let (start, end) = text.split_once(':')?;
            Some(start.parse().ok()?..end.parse().ok()?)
        });
        let density = self.numbers::<f32, 4, 1>(("xDensity", "float"), f32::from_le_bytes);
        let samples = self.numbers::<i32, 4, 1>(("samples", "int"), i32::from_le_bytes);
        Metadata {
            software: self.text("software"),
            world_to_camera: self.text("worldToCameraText").and_then(|text| matrix_of(&text)).or(matrix),
            samples: samples.and_then(|[samples]| u32::try_from(samples).ok()),
            sample_range: range,
            seed: self.text("seed").and_then(|seed| seed.parse().ok()),
            engine: self.text("engine"),
            options: self.text("options"),
            pixels_per_inch: density.map(|[density]| density.into()),
            input_hash: self.text("inputHash"),
            camera: self.text("camera"),
            crop: None,
        }
    }
}

/// Numbers with spaces between them.
fn numbers<T: std::str::FromStr, const N: usize>(text: &str) -> Option<[T; N]> {
    text.split(' ').map(|number| number.parse().ok()).collect::<Option<Vec<T>>>()?.try_into().ok()
}

/// A matrix whose rows are listed.
fn matrix_of(text: &str) -> Option<DMat4> {
    let rows: [[f64; 4]; 4] = serde_json::from_str(text).ok()?;
    Some(DMat4::from_cols_array_2d(&rows).transpose())
}

impl Compression {
    /// That of a file, if it is one of ours.
    fn of(compression: exr::compression::Compression) -> Option<Self> {
        let all = [Self::None, Self::Rle, Self::Zip, Self::Zips, Self::Piz];
        all.into_iter().find(|ours| ours.encoding() == compression)
    }
}
