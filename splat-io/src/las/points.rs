//! From the records of points to a cloud.

use super::header::{Axis, Header};
use super::property;
use crate::table::Tone;
use crate::{Error, PropertyReport, Usage, table};
use glam::{DVec3, Vec3};
use splat_core::{Cloud, Field};
use std::collections::TryReserveError;
use std::path::Path;

/// The names and types of the scalar fields, in the order of [`Points::push`].
const FIELDS: [[&str; 2]; 8] = [
    ["intensity", "uint16"],
    ["return_number", "bits"],
    ["number_of_returns", "bits"],
    ["classification", "uint8"],
    ["scan_angle", "degrees"],
    ["user_data", "uint8"],
    ["point_source_id", "uint16"],
    ["near_infrared", "uint16"],
];

/// The scan angles of LAS 1.4, in degrees a step.
pub(super) const ANGLE_STEP: f32 = 0.006;

/// What is counted, since it says that a point is not an ordinary one.
const FLAGS: [&str; 5] =
    ["synthetic", "a model key-point", "withheld", "in an overlap", "classified as noise"];

/// Points half read.
pub(super) struct Points {
    axes: [Axis; 3],
    is_extended: bool,
    /// Where a record has the colour and the near infrared, if it has.
    color_at: Option<usize>,
    infrared_at: Option<usize>,
    positions: Vec<DVec3>,
    colors: Vec<[u16; 3]>,
    greatest_color: u16,
    fields: [Vec<f32>; FIELDS.len()],
    flags: [usize; FLAGS.len()],
}

impl Points {
    pub fn new(header: &Header) -> Self {
        Self {
            axes: header.axes,
            is_extended: header.is_extended(),
            color_at: match header.format {
                2 => Some(20),
                3 | 5 => Some(28),
                7 | 8 | 10 => Some(30),
                _ => None,
            },
            infrared_at: matches!(header.format, 8 | 10).then_some(36),
            positions: Vec::new(),
            colors: Vec::new(),
            greatest_color: 0,
            fields: Default::default(),
            flags: [0; FLAGS.len()],
        }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Makes room for more points.
    pub fn reserve(&mut self, count: u64, path: &Path) -> Result<(), Error> {
        let mut reserve = || -> Result<(), TryReserveError> {
            let count = usize::try_from(count).unwrap_or(usize::MAX);
            self.positions.try_reserve(count)?;
            if self.color_at.is_some() {
                self.colors.try_reserve(count)?;
            }
            self.fields.iter_mut().try_for_each(|field| field.try_reserve(count))
        };
        reserve().map_err(|_| {
            let what = format!("a cloud of {} points", self.positions.len() as u64 + count);
            Error::limit(path, what, "this machine's memory")
        })
    }

    /// Adds a point: a record of the header's format, at least as long as that needs.
    #[inline]
    pub fn push(&mut self, record: &[u8]) {
        let whole =
            |at: usize| i32::from_le_bytes([record[at], record[at + 1], record[at + 2], record[at + 3]]);
        let short = |at: usize| u16::from_le_bytes([record[at], record[at + 1]]);
        let axis = |i: usize| self.axes[i].world(whole(4 * i));
        self.positions.push(DVec3::new(axis(0), axis(1), axis(2)));
        if let Some(at) = self.color_at {
            let color = [0, 2, 4].map(|channel| short(at + channel));
            self.greatest_color = self.greatest_color.max(color[0]).max(color[1]).max(color[2]);
            self.colors.push(color);
        }
        let (returns, flags, class, angle, user, source) = if self.is_extended {
            let angle = f32::from(short(18) as i16) * ANGLE_STEP;
            (record[14], record[15], record[16], angle, record[17], short(20))
        } else {
            let angle = f32::from(record[16] as i8);
            (record[14], record[15] >> 5, record[15] & 31, angle, record[17], short(18))
        };
        let [number, of] =
            if self.is_extended { [returns & 15, returns >> 4] } else { [returns & 7, returns >> 3 & 7] };
        let values = [
            f32::from(short(12)),
            f32::from(number),
            f32::from(of),
            f32::from(class),
            angle,
            f32::from(user),
            f32::from(source),
            self.infrared_at.map_or(0.0, |at| f32::from(short(at))),
        ];
        for (field, value) in self.fields.iter_mut().zip(values) {
            field.push(value);
        }
        let is_overlap = if self.is_extended { flags & 8 != 0 } else { class == 12 };
        let is_noise = class == 7 || (class == 18 && self.is_extended);
        let set = [flags & 1 != 0, flags & 2 != 0, flags & 4 != 0, is_overlap, is_noise];
        for (count, is_set) in self.flags.iter_mut().zip(set) {
            *count += usize::from(is_set);
        }
    }

    /// Makes the cloud, says what was assumed, and what became of each column.
    pub fn finish(self, header: &Header) -> (Cloud, Vec<String>, Vec<PropertyReport>) {
        let mut cloud = Cloud::from_points(&self.positions);
        let mut assumptions: Vec<String> = table::far_from_zero(&cloud).into_iter().collect();
        let mut properties: Vec<_> =
            ["X", "Y", "Z"].into_iter().map(|name| property(name, "int32", Usage::Position)).collect();

        if self.color_at.is_some() {
            let tone = if self.greatest_color > 255 { Tone::Srgb16 } else { Tone::Srgb8 };
            let linear = |color: &[u16; 3]| Vec3::from(color.map(|channel| tone.linear(f64::from(channel))));
            let usage = if self.greatest_color == 0 {
                assumptions.push("every colour is zero: taken as absent".to_owned());
                Usage::Unused("every colour is zero")
            } else {
                let bits = if tone == Tone::Srgb8 { 8 } else { 16 };
                let greatest = self.greatest_color;
                assumptions.push(format!(
                    "the colours, {greatest} at most, are taken as {bits}-bit sRGB and linearised"
                ));
                cloud.colors = Some(self.colors.iter().map(linear).collect());
                Usage::Color
            };
            properties.extend(["red", "green", "blue"].map(|name| property(name, "uint16", usage)));
        }
        for ([name, kind], values) in FIELDS.into_iter().zip(self.fields) {
            let all = |number: f32| values.iter().all(|&value| value == number);
            let is_silent = all(0.0) || (name.contains("return") && all(1.0));
            if !is_silent {
                properties.push(property(name, kind, Usage::Field));
                cloud.fields.push(Field { name: name.to_owned(), values });
            } else if name != "near_infrared" || self.infrared_at.is_some() {
                properties.push(property(name, kind, Usage::Unused("the same as if it were not there")));
            }
        }
        if header.extra_bytes() > 0 {
            let kind = format!("{} bytes", header.extra_bytes());
            properties.push(property("extra", &kind, Usage::Unused("extra bytes")));
        }
        if matches!(header.format, 1 | 3..=10) {
            properties.push(property(
                "gps_time",
                "double",
                Usage::Unused("needs more digits than a field has"),
            ));
        }
        for (count, what) in self.flags.into_iter().zip(FLAGS).filter(|(count, _)| *count > 0) {
            assumptions
                .push(format!("{count} points are {what}: they are kept (--classes leaves classes out)"));
        }
        (cloud, assumptions, properties)
    }
}
