//! Clouds as LAS and LAZ files.

use crate::decimals::decimals;
use crate::{AtomicFile, Error};
use glam::{DVec3, Vec3};
use laz::{LasZipCompressor, LazVlr, LazVlrBuilder};
use splat_core::{Cloud, srgb};
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// The share of the spacing of the points that a coordinate may be off, where decimals do not tell the scale.
const PRECISION: f64 = 1e-4;

/// Greatest whole number of a coordinate; a little less than 2^31, for the rounding of bounds.
const GREATEST: f64 = 2.1e9;

/// Writes a cloud as a LAS file, or as LAZ if it is to be compressed, in one step ([`AtomicFile`]). Says how many points
/// were left out: those without finite coordinates, which the format has no numbers for.
///
/// Coordinates are whole multiples of a power of ten: the greatest that gives each one again where they have few
/// decimals, else below 10^-4 of the mean spacing. Colours are 16-bit sRGB. Of the scalar fields those that LAS knows are
/// written (see the [module](super)), rounded; an intensity from 0 to 1 is spread over 0 to 65535. The rest of the
/// cloud has no place in the format.
///
/// The version is 1.2 with point format 0 or 2, or 1.4 with format 6 or 7 where class, returns or angles need it.
///
/// # Errors
/// [`Error::Io`]; [`Error::Core`] if the cloud's arrays differ in length; [`Error::Limit`] for coordinates that no scale
/// holds.
pub fn write_las(path: &Path, cloud: &Cloud, compressed: bool) -> Result<usize, Error> {
    cloud.check_lengths().map_err(Error::core(path))?;
    let encoding = Encoding::new(cloud, path)?;
    let mut file = AtomicFile::create(path)?;
    let mut out = BufWriter::with_capacity(1 << 18, &mut file);
    encoding
        .write(&mut out, cloud, compressed)
        .and_then(|()| out.flush())
        .map_err(Error::io(path, "write"))?;
    drop(out);
    file.commit()?;
    Ok(cloud.len() - encoding.count)
}

/// The numbers of a cloud in the terms of LAS.
struct Encoding<'a> {
    /// Points with finite coordinates.
    count: usize,
    bounds: [DVec3; 2],
    scale: Scale,
    has_colors: bool,
    /// Whether points have the layout of LAS 1.4.
    is_extended: bool,
    fields: Fields<'a>,
}

/// The scalar fields that LAS knows.
struct Fields<'a> {
    intensity: Option<&'a [f32]>,
    /// What an intensity is multiplied by.
    gain: f32,
    number: Option<&'a [f32]>,
    of: Option<&'a [f32]>,
    class: Option<&'a [f32]>,
    angle: Option<&'a [f32]>,
    user: Option<&'a [f32]>,
    source: Option<&'a [f32]>,
}

impl<'a> Fields<'a> {
    fn of(cloud: &'a Cloud) -> Self {
        let field = |name: &str| cloud.field(name).map(|field| field.values.as_slice());
        let intensity = field("intensity");
        let greatest = intensity.unwrap_or_default().iter().copied().fold(0.0, f32::max);
        let is_whole = intensity.unwrap_or_default().iter().all(|value| value.fract() == 0.0);
        Self {
            intensity,
            gain: if greatest <= 1.0 && !is_whole { 65535.0 } else { 1.0 },
            number: field("return_number"),
            of: field("number_of_returns"),
            class: field("classification"),
            angle: field("scan_angle"),
            user: field("user_data"),
            source: field("point_source_id"),
        }
    }

    /// Whether LAS 1.2 has too few bits for them.
    fn need_extended(&self) -> bool {
        let above =
            |field: Option<&[f32]>, most: f32| field.unwrap_or_default().iter().any(|&value| value > most);
        let is_whole =
            self.angle.unwrap_or_default().iter().all(|angle| angle.fract() == 0.0 && angle.abs() <= 90.0);
        above(self.class, 31.0) || above(self.number, 7.0) || above(self.of, 7.0) || !is_whole
    }
}

/// The value of a field at a point, rounded and clamped; what is not a number is 0.
fn at(field: Option<&[f32]>, index: usize, default: f32) -> f32 {
    field.map_or(default, |values| values[index]).round()
}

/// How coordinates become whole numbers.
#[derive(Debug, Clone, Copy)]
struct Scale {
    /// A unit is 10^-decimals.
    decimals: i32,
    offset: DVec3,
}

impl Scale {
    fn unit(self) -> f64 {
        // A division of exact numbers: what text would be read as.
        if self.decimals >= 0 { 1.0 / 10_f64.powi(self.decimals) } else { 10_f64.powi(-self.decimals) }
    }

    fn number(self, world: f64, axis: usize) -> i32 {
        ((world - self.offset[axis]) / self.unit()).round() as i32
    }
}

impl<'a> Encoding<'a> {
    fn new(cloud: &'a Cloud, path: &Path) -> Result<Self, Error> {
        let (low, high) = cloud.bounds().unwrap_or_default();
        let count = cloud.positions.iter().filter(|position| position.is_finite()).count();
        let spacing = (high - low).length() / (count.max(1) as f64).sqrt();
        let from_spacing =
            || if spacing > 0.0 { (-libm::log10(PRECISION * spacing)).ceil() as i32 } else { 3 };
        let mut scale = Scale { decimals: decimals(cloud).unwrap_or_else(from_spacing), offset: DVec3::ZERO };
        let reach = |scale: Scale| {
            (low - scale.offset).abs().max((high - scale.offset).abs()).max_element() / scale.unit()
        };
        while reach(scale) > GREATEST {
            scale.offset = (0.5 * (low + high)).round();
            if reach(scale) > GREATEST {
                scale.decimals -= 1;
            }
            if scale.decimals < -300 || !scale.offset.is_finite() {
                let what = format!("a cloud from {low} to {high}");
                return Err(Error::limit(path, what, "what 32 bits and a scale can tell apart"));
            }
        }
        let fields = Fields::of(cloud);
        let is_extended = fields.need_extended();
        Ok(Self {
            count,
            bounds: [low, high],
            scale,
            has_colors: cloud.colors.is_some(),
            is_extended,
            fields,
        })
    }

    /// The point format: its number and the size of a point, in bytes.
    fn format(&self) -> (u8, u16) {
        match (self.is_extended, self.has_colors) {
            (false, false) => (0, 20),
            (false, true) => (2, 26),
            (true, false) => (6, 30),
            (true, true) => (7, 36),
        }
    }

    fn write<W>(&self, out: &mut W, cloud: &Cloud, compressed: bool) -> io::Result<()>
    where
        W: Write + io::Seek + Send + Sync,
    {
        let (format, record_bytes) = self.format();
        let mut record = vec![0; usize::from(record_bytes)];
        let finite = (0..cloud.len()).filter(|&index| cloud.positions[index].is_finite());
        if !compressed {
            out.write_all(&self.header(format, record_bytes, &[]))?;
            for index in finite {
                self.record(cloud, index, &mut record);
                out.write_all(&record)?;
            }
            return Ok(());
        }
        let vlr = LazVlrBuilder::default().with_point_format(format, 0).map_err(io::Error::other)?.build();
        let mut description = Vec::new();
        vlr.write_to(&mut description)?;
        out.write_all(&self.header(format | 0x80, record_bytes, &description))?;
        let mut compressor = LasZipCompressor::new(&mut *out, vlr).map_err(io::Error::other)?;
        for index in finite {
            self.record(cloud, index, &mut record);
            compressor.compress_one(&record)?;
        }
        compressor.done()
    }

    /// The header, and the record that says how points are compressed, if they are.
    fn header(&self, format: u8, record_bytes: u16, compression: &[u8]) -> Vec<u8> {
        let header_bytes: u16 = if self.is_extended { 375 } else { 227 };
        let mut bytes = vec![0; usize::from(header_bytes)];
        let mut put = |at: usize, value: &[u8]| bytes[at..at + value.len()].copy_from_slice(value);
        put(0, b"LASF");
        if self.is_extended {
            // Coordinate systems are text, if any is given.
            put(6, &16_u16.to_le_bytes());
        }
        put(24, &[1, if self.is_extended { 4 } else { 2 }]);
        put(58, concat!("splat ", env!("CARGO_PKG_VERSION")).as_bytes());
        put(94, &header_bytes.to_le_bytes());
        let records = if compression.is_empty() { 0 } else { 54 + compression.len() };
        put(96, &(u32::from(header_bytes) + records as u32).to_le_bytes());
        put(100, &u32::from(!compression.is_empty()).to_le_bytes());
        put(104, &[format]);
        put(105, &record_bytes.to_le_bytes());
        if self.is_extended {
            put(247, &(self.count as u64).to_le_bytes());
        } else {
            put(107, &(self.count as u32).to_le_bytes());
        }
        let [low, high] = self.bounds;
        for axis in 0..3 {
            put(131 + 8 * axis, &self.scale.unit().to_le_bytes());
            put(155 + 8 * axis, &self.scale.offset[axis].to_le_bytes());
            put(179 + 16 * axis, &high[axis].to_le_bytes());
            put(187 + 16 * axis, &low[axis].to_le_bytes());
        }
        if !compression.is_empty() {
            let mut head = [0; 54];
            head[2..2 + LazVlr::USER_ID.len()].copy_from_slice(LazVlr::USER_ID.as_bytes());
            head[18..20].copy_from_slice(&LazVlr::RECORD_ID.to_le_bytes());
            head[20..22].copy_from_slice(&(compression.len() as u16).to_le_bytes());
            bytes.extend(head);
            bytes.extend(compression);
        }
        bytes
    }

    /// The record of a point.
    fn record(&self, cloud: &Cloud, index: usize, record: &mut [u8]) {
        let world = cloud.world_position(index);
        let mut put = |at: usize, value: &[u8]| record[at..at + value.len()].copy_from_slice(value);
        for axis in 0..3 {
            put(4 * axis, &self.scale.number(world[axis], axis).to_le_bytes());
        }
        let fields = &self.fields;
        let intensity = fields.intensity.map_or(0.0, |values| (values[index] * fields.gain).round());
        put(12, &(intensity as u16).to_le_bytes());
        let (number, of) = (at(fields.number, index, 1.0) as u8, at(fields.of, index, 1.0) as u8);
        let (class, user) = (at(fields.class, index, 0.0) as u8, at(fields.user, index, 0.0) as u8);
        let source = (at(fields.source, index, 0.0) as u16).to_le_bytes();
        let angle = fields.angle.map_or(0.0, |values| values[index]);
        let color_at = if self.is_extended {
            put(14, &[number & 15 | of << 4, 0, class, user]);
            put(18, &((angle / super::points::ANGLE_STEP).round() as i16).to_le_bytes());
            put(20, &source);
            30
        } else {
            put(14, &[number & 7 | (of & 7) << 3, class & 31, (angle as i8) as u8, user]);
            put(18, &source);
            20
        };
        if let Some(colors) = &cloud.colors {
            put(color_at, &encoded(colors[index]));
        }
    }
}

/// A colour in 16-bit sRGB.
fn encoded(color: Vec3) -> [u8; 6] {
    let channel = |value: f32| (srgb::encode(f64::from(value).clamp(0.0, 1.0)) * 65535.0).round() as u16;
    let [r, g, b] = color.to_array().map(|value| channel(value).to_le_bytes());
    [r[0], r[1], g[0], g[1], b[0], b[1]]
}
