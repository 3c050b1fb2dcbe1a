//! Trained Gaussian splats in PLY files: 3DGS (Kerbl et al. 2023) and 2DGS (Huang et al. 2024).

use super::rows::Rows;
use crate::table::{Element, Kind};
use crate::trained::{Gaussian, Gaussians, sigmoid};
use crate::{Error, Place, Usage};
use glam::{DVec3, Vec3};
use splat_core::harmonics::{MAX_DEGREE, terms};
use std::path::Path;

/// Properties that only trained splats have.
const TELLING: [&str; 6] = ["rot_0", "rot_1", "rot_2", "rot_3", "scale_0", "f_dc_0"];

/// The properties that all have, by slot; scale_2 is the last, since 2DGS has none. The harmonics follow.
const NAMES: [&str; 14] = [
    "x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "rot_0", "rot_1", "rot_2", "rot_3", "scale_0",
    "scale_1", "scale_2",
];
const SCALE_2: usize = 13;
const REST: usize = NAMES.len();

/// Whether a table of points is one of trained splats.
pub(super) fn is_trained(element: &Element) -> bool {
    TELLING.into_iter().all(|name| position(element, name).is_some())
}

/// Trained splats half read.
pub(super) struct Splats {
    slots: Vec<Option<usize>>,
    count: usize,
    /// Degree of the harmonics that are kept.
    degree: usize,
    /// Whether they are 2DGS.
    pub flat: bool,
    pub gaussians: Gaussians,
    /// Of the row that is being read.
    coefficients: Vec<Vec3>,
    /// Per property.
    pub usages: Vec<Usage>,
}

impl Splats {
    /// Understands the properties of the table of points, and makes room for its rows.
    pub fn new(element: &Element, path: &Path) -> Result<Self, Error> {
        let rest = Rest::find(element, path)?;
        let mut slots = vec![None; element.properties.len()];
        let mut usages = vec![Usage::Unused("unknown"); slots.len()];
        for (index, property) in element.properties.iter().enumerate() {
            if matches!(property.kind, Kind::List { .. }) {
                usages[index] = Usage::Unused("a list");
            } else if let Some(slot) = NAMES.iter().position(|name| *name == property.name) {
                slots[index] = Some(slot);
                usages[index] = usage(slot);
            } else if let Some((term, channel)) = rest.place(&property.name) {
                slots[index] = Some(REST + 3 * (term - 1) + channel);
                usages[index] = Usage::Harmonic;
            } else if property.name.starts_with("f_rest_") {
                usages[index] = Usage::Unused("of a degree above 3");
            } else if ["nx", "ny", "nz"].contains(&property.name.as_str()) {
                usages[index] = Usage::Unused("the shape tells the normal");
            }
        }
        for (slot, name) in NAMES.into_iter().enumerate() {
            if slot != SCALE_2 && !slots.contains(&Some(slot)) {
                return Err(missing(element, name, path));
            }
        }
        let count = usize::try_from(element.count).unwrap_or(usize::MAX);
        let gaussians = Gaussians::with_room(count, rest.degree).map_err(|_| too_many(count, path))?;
        Ok(Self {
            flat: !slots.contains(&Some(SCALE_2)),
            slots,
            count,
            degree: rest.degree,
            gaussians,
            coefficients: vec![Vec3::ZERO; terms(rest.degree)],
            usages,
        })
    }
}

impl Rows for Splats {
    fn slots(&self) -> &[Option<usize>] {
        &self.slots
    }

    fn width(&self) -> usize {
        REST + 3 * (terms(self.degree) - 1)
    }

    fn count(&self) -> usize {
        self.count
    }

    fn push(&mut self, row: &[f64]) {
        let scale = |slot: usize| libm::exp(row[slot]);
        let gaussian = Gaussian {
            position: DVec3::new(row[0], row[1], row[2]),
            scales: [scale(11), scale(12), if self.flat { 0.0 } else { scale(SCALE_2) }],
            rotation: [row[7], row[8], row[9], row[10]],
            opacity: sigmoid(row[6]),
        };
        self.coefficients[0] = DVec3::new(row[3], row[4], row[5]).as_vec3();
        for (coefficient, rgb) in self.coefficients[1..].iter_mut().zip(row[REST..].as_chunks::<3>().0) {
            *coefficient = DVec3::from_array(*rgb).as_vec3();
        }
        self.gaussians.push(&gaussian, &self.coefficients);
    }
}

fn usage(slot: usize) -> Usage {
    match slot {
        0..3 => Usage::Position,
        3..6 => Usage::Harmonic,
        6 => Usage::Opacity,
        7..11 => Usage::Rotation,
        _ => Usage::Size,
    }
}

/// The properties `f_rest_0`, `f_rest_1`, ..: the terms of red after the constant one, then those of green, then blue.
pub(super) struct Rest {
    /// Terms a channel, without the constant one.
    per_channel: usize,
    /// Degree of the harmonics that are kept.
    pub degree: usize,
}

impl Rest {
    /// Counts the properties.
    pub fn find(element: &Element, path: &Path) -> Result<Self, Error> {
        // More than any degree has, but no long search in a header of nothing else.
        let count = (0..1000).take_while(|i| position(element, &format!("f_rest_{i}")).is_some()).count();
        let degree = (0..=8).find(|&degree| 3 * (terms(degree) - 1) == count).ok_or_else(|| {
            let found = format!("{count} properties f_rest_0, f_rest_1, .. in element {}", element.name);
            Error::invalid(path, Place::Line(element.line), found, "0, 9, 24 or 45")
        })?;
        Ok(Self { per_channel: count / 3, degree: degree.min(MAX_DEGREE) })
    }

    /// Term (from 1) and channel of a property, if it is one that is kept.
    pub fn place(&self, name: &str) -> Option<(usize, usize)> {
        let index: usize = name.strip_prefix("f_rest_")?.parse().ok()?;
        let (channel, term) = (index.checked_div(self.per_channel)?, index % self.per_channel + 1);
        (channel < 3 && term < terms(self.degree)).then_some((term, channel))
    }
}

/// The index of a property of numbers.
pub(super) fn position(element: &Element, name: &str) -> Option<usize> {
    let is = |kind| matches!(kind, Kind::Scalar(_));
    element.properties.iter().position(|property| property.name == name && is(property.kind))
}

pub(super) fn missing(element: &Element, name: &str, path: &Path) -> Error {
    let found = format!("no property {name} in element {}", element.name);
    Error::invalid(path, Place::Line(element.line), found, "all numbers of trained Gaussian splats")
}

pub(super) fn too_many(count: usize, path: &Path) -> Error {
    Error::limit(path, format!("a cloud of {count} splats"), "this machine's memory")
}
