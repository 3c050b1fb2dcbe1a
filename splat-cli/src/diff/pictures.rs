//! Two pictures in a common space.

use anyhow::{bail, ensure};
use splat_core::PixelRect;
use splat_io::{ExrPicture, PictureFormat, PngDepth, Values, read_exr, read_png};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What the values mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Space {
    /// As EXR files have them.
    Linear,
    /// Levels of PNG files, sRGB and straight alpha, as 0 to 1.
    Display,
}

/// The values of a channel, row by row.
#[derive(Debug)]
pub enum Plane {
    /// Of an EXR file.
    Values(Values),
    /// Of a PNG file, or as one would have them; and the highest of them.
    Levels(Vec<u16>, u16),
}

impl Plane {
    /// A value.
    pub fn get(&self, index: usize) -> f64 {
        match self {
            Self::Values(values) => values.get(index),
            Self::Levels(levels, highest) => f64::from(levels[index]) / f64::from(*highest),
        }
    }

    /// Where a float stands among all of its type, both zeros in one place.
    pub fn place(&self, index: usize) -> Option<i64> {
        let place = |magnitude: i64, is_negative| if is_negative { -magnitude } else { magnitude };
        match self {
            Self::Values(Values::Half(values)) => {
                let bits = values[index].to_bits();
                Some(place((bits & 0x7fff).into(), bits >> 15 == 1))
            }
            Self::Values(Values::Float(values)) => {
                let bits = values[index].to_bits();
                Some(place((bits & 0x7fff_ffff).into(), bits >> 31 == 1))
            }
            _ => None,
        }
    }

    /// The bits of a value.
    pub fn bits(&self, index: usize) -> u64 {
        match self {
            Self::Values(Values::Half(values)) => values[index].to_bits().into(),
            Self::Values(Values::Float(values)) => values[index].to_bits().into(),
            Self::Values(Values::Uint(values)) => values[index].into(),
            Self::Levels(levels, _) => levels[index].into(),
        }
    }

    /// Whether places of the two can be compared.
    pub fn is_of_one_type(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Values(a), Self::Values(b)) => std::mem::discriminant(a) == std::mem::discriminant(b),
            _ => false,
        }
    }
}

/// Two pictures of the same size.
#[derive(Debug)]
pub struct Pair {
    /// Their files.
    pub paths: [PathBuf; 2],
    /// Width and height, in pixels.
    pub size: [usize; 2],
    /// Their pixels; from 0 where the files do not say.
    pub window: PixelRect,
    /// What values mean.
    pub space: Space,
    /// The channels that both have, by name.
    pub channels: Vec<(String, [Plane; 2])>,
    /// The channels that one of them has alone.
    pub only: [Vec<String>; 2],
}

/// A picture as its file has it.
enum File {
    Exr(Box<ExrPicture>),
    Png([u32; 2], PngDepth, Vec<[u16; 4]>),
}

impl File {
    fn read(path: &Path) -> anyhow::Result<Self> {
        // The name of what has no name of a picture tells nothing: its first bytes do, and the reader says so.
        Ok(match PictureFormat::from_path(path)? {
            PictureFormat::Exr => Self::Exr(Box::new(read_exr(path)?)),
            PictureFormat::Png => {
                let picture = read_png(path)?;
                Self::Png(picture.size, picture.depth, picture.pixels)
            }
        })
    }

    fn depth(&self) -> Option<PngDepth> {
        match self {
            Self::Exr(_) => None,
            Self::Png(_, depth, _) => Some(*depth),
        }
    }

    fn size(&self) -> [usize; 2] {
        match self {
            Self::Exr(picture) => [picture.window.width(), picture.window.height()],
            Self::Png(size, ..) => size.map(|side| side as usize),
        }
    }

    /// The planes by name, in the display's space if a depth is given.
    fn planes(self, depth: Option<PngDepth>) -> anyhow::Result<BTreeMap<String, Plane>> {
        let (pixels, highest) = match (self, depth) {
            (Self::Exr(picture), None) => {
                let channels = picture.channels.into_iter().filter(|(name, _)| !ExrPicture::is_sum(name));
                return Ok(channels.map(|(name, values)| (name, Plane::Values(values))).collect());
            }
            (Self::Exr(picture), Some(depth)) => (displayed(&picture, depth)?, depth.highest()),
            (Self::Png(_, depth, pixels), _) => (pixels, depth.highest()),
        };
        let plane = |component: usize| pixels.iter().map(|pixel| pixel[component]).collect();
        let planes = ["R", "G", "B", "A"].into_iter().enumerate();
        Ok(planes.map(|(index, name)| (name.to_owned(), Plane::Levels(plane(index), highest))).collect())
    }
}

/// The levels of an EXR picture as a PNG file.
fn displayed(picture: &ExrPicture, depth: PngDepth) -> anyhow::Result<Vec<[u16; 4]>> {
    let channel = |name: &str| picture.channel(name).or_else(|| picture.channel("Y"));
    let (Some(red), Some(green), Some(blue)) = (channel("R"), channel("G"), channel("B")) else {
        bail!("an EXR file without the channels R, G and B, or Y, cannot be compared with a PNG file");
    };
    let alpha = picture.channel("A");
    let pixel = |index: usize| {
        let alpha = alpha.map_or(1.0, |values| values.get(index));
        depth.levels([red.get(index), green.get(index), blue.get(index), alpha].map(|value| value as f32))
    };
    Ok((0..picture.window.area()).map(pixel).collect())
}

impl Pair {
    /// Reads two pictures; of their channels those of `wanted` names, or layers.
    ///
    /// # Errors
    /// What the readers say; pictures of different sizes, and without a common channel of each wanted name.
    pub fn read(paths: [&PathBuf; 2], wanted: Option<&[String]>) -> anyhow::Result<Self> {
        let [a, b] = [File::read(paths[0])?, File::read(paths[1])?];
        let size = a.size();
        let [width, height] = size;
        let [paths_a, paths_b] = paths.map(|path| path.display());
        let [other_width, other_height] = b.size();
        ensure!(
            size == b.size(),
            "{paths_a} has {width}x{height} pixels, {paths_b} {other_width}x{other_height}: they cannot be compared"
        );
        let windows = [&a, &b].map(|file| match file {
            File::Exr(picture) => Some(picture.window),
            File::Png(..) => None,
        });
        if let [Some(a), Some(b)] = windows {
            ensure!(
                a == b,
                "{paths_a} has the pixels of its frame from {},{} on, {paths_b} those from {},{} on: they cannot be \
                 compared",
                a.x0,
                a.y0,
                b.x0,
                b.y0
            );
        }
        let window = windows.into_iter().flatten().next();
        // An EXR picture is shown with the depth of the other.
        let depth = a.depth().or(b.depth());
        let [mut a, mut b] = [a.planes(depth)?, b.planes(depth)?];
        let is_wanted =
            |name: &String| wanted.is_none_or(|wanted| wanted.iter().any(|part| belongs(name, part)));
        a.retain(|name, _| is_wanted(name));
        b.retain(|name, _| is_wanted(name));
        let mut channels = Vec::new();
        let mut only = [Vec::new(), Vec::new()];
        for (name, plane) in a {
            match b.remove(&name) {
                Some(other) => channels.push((name, [plane, other])),
                None => only[0].push(name),
            }
        }
        only[1].extend(b.into_keys());
        for part in wanted.into_iter().flatten() {
            ensure!(
                channels.iter().any(|(name, _)| belongs(name, part)),
                "--channels {part}: {paths_a} and {paths_b} have no such channel in common"
            );
        }
        ensure!(
            !channels.is_empty(),
            "{paths_a} and {paths_b} have no channel in common that could be compared"
        );
        Ok(Self {
            paths: paths.map(Clone::clone),
            size,
            window: window.unwrap_or(PixelRect::new(0, 0, width as i32, height as i32)),
            space: if depth.is_some() { Space::Display } else { Space::Linear },
            channels,
            only,
        })
    }

    /// The colour over black of one of the pictures, linear, clamped to 0 to 1; if both have it.
    pub fn colors(&self, which: usize) -> Option<Vec<[f32; 3]>> {
        let plane = |name: &str| {
            let find = |name: &str| self.channels.iter().find(|(other, _)| other == name);
            find(name).or_else(|| find("Y").filter(|_| name != "A")).map(|(_, planes)| &planes[which])
        };
        let rgb = [plane("R")?, plane("G")?, plane("B")?];
        let alpha = plane("A");
        let area = self.size[0] * self.size[1];
        let color = |index: usize| {
            rgb.map(|plane| match self.space {
                Space::Linear => plane.get(index) as f32,
                Space::Display => {
                    let alpha = alpha.map_or(1.0, |plane| plane.get(index));
                    (splat_core::srgb::decode(plane.get(index)) * alpha) as f32
                }
            })
        };
        Some((0..area).map(color).collect())
    }
}

/// The layer of a channel: what stands before its last point; those of the picture itself are "color".
pub fn layer(channel: &str) -> &str {
    match channel.rsplit_once('.') {
        Some((layer, _)) => layer,
        None if ["R", "G", "B", "A", "Y"].contains(&channel) => "color",
        None => channel,
    }
}

/// Whether a channel is, or is in, what a part of `--channels` names.
fn belongs(channel: &str, part: &str) -> bool {
    channel == part || layer(channel) == part
}
