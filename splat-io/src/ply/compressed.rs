//! The compressed PLY files of SuperSplat and PlayCanvas: four packed integers a splat, relative to the bounds of its chunk
//! of 256, and perhaps a byte for each further coefficient of the colour.
//!
//! | packed | bits | meaning |
//! |---|---|---|
//! | `packed_position` | 11, 10, 11 | x y z, from the chunk's least to its greatest |
//! | `packed_rotation` | 2, 10, 10, 10 | which of w x y z is the greatest; the others, from -sqrt(1/2) to sqrt(1/2) |
//! | `packed_scale` | 11, 10, 11 | logarithms of the scales, from the chunk's least to its greatest |
//! | `packed_color` | 8, 8, 8, 8 | display-referred r g b, from the chunk's least (else 0) to its greatest (else 1); opacity |
//!
//! The first is in the most significant bits. A further coefficient b is 8 (b + 1/2)/256 - 4; 0 and 255 are -4 and 4.

use super::gaussians::{Rest, missing, position, too_many};
use super::header::Header;
use super::rows::{Rows, Table, Tables};
use crate::table::Element;
use crate::trained::{Gaussian, Gaussians};
use crate::{Error, Place, Usage};
use glam::{DVec3, Vec3};
use splat_core::harmonics::{constant_term, terms};
use std::f64::consts::SQRT_2;
use std::path::Path;

const PACKED: [&str; 4] = ["packed_position", "packed_rotation", "packed_scale", "packed_color"];

const BOUNDS: [&str; 18] = [
    "min_x",
    "min_y",
    "min_z",
    "max_x",
    "max_y",
    "max_z",
    "min_scale_x",
    "min_scale_y",
    "min_scale_z",
    "max_scale_x",
    "max_scale_y",
    "max_scale_z",
    "min_r",
    "min_g",
    "min_b",
    "max_r",
    "max_g",
    "max_b",
];

/// The bounds that older files do not have.
const COLOR_BOUNDS: usize = 12;

/// Splats a chunk.
const CHUNK: usize = 256;

/// Whether a table of points is one of packed splats.
pub(super) fn is_packed(element: &Element) -> bool {
    position(element, PACKED[0]).is_some()
}

/// The tables of a compressed file.
pub(super) struct PackedSplats {
    /// Indices of the three tables; the last may be absent.
    chunk: usize,
    vertex: usize,
    sh: Option<usize>,
    bounds: Numbers<f32>,
    packed: Numbers<u32>,
    rest: Numbers<u8>,
    degree: usize,
}

impl PackedSplats {
    /// Understands the tables, and makes room for their rows, which are known to fit into the file.
    pub fn new(header: &Header, vertex: usize, path: &Path) -> Result<Self, Error> {
        let find = |name: &str| header.elements.iter().position(|element| element.name == name);
        let chunk = find("chunk").ok_or_else(|| {
            Error::invalid(path, Place::File, "no element `chunk`", "the bounds of the packed splats")
        })?;
        let sh = find("sh");
        let (chunks, vertices) = (&header.elements[chunk], &header.elements[vertex]);
        if chunks.count < vertices.count.div_ceil(CHUNK as u64) {
            let found = format!("{} chunks for {} splats", chunks.count, vertices.count);
            return Err(Error::invalid(path, Place::Line(chunks.line), found, "one for every 256"));
        }
        let colored = position(chunks, BOUNDS[COLOR_BOUNDS]).is_some();
        let bounds = if colored { &BOUNDS[..] } else { &BOUNDS[..COLOR_BOUNDS] };
        let mut rest =
            Numbers { slots: Vec::new(), width: 0, count: 0, values: Vec::new(), convert: |v| v as u8 };
        let mut degree = 0;
        if let Some(element) = sh.map(|sh| &header.elements[sh]) {
            if element.count != vertices.count {
                let found = format!("{} rows in element sh", element.count);
                let expected = format!("{}, as many as splats", vertices.count);
                return Err(Error::invalid(path, Place::Line(element.line), found, expected));
            }
            let places = Rest::find(element, path)?;
            degree = places.degree;
            let slot = |(term, channel): (usize, usize)| 3 * (term - 1) + channel;
            let slots = element.properties.iter().map(|property| places.place(&property.name).map(slot));
            rest = Numbers::new(element, slots.collect(), 3 * (terms(degree) - 1), |v| v as u8, path)?;
        }
        Ok(Self {
            chunk,
            vertex,
            sh,
            bounds: Numbers::named(chunks, bounds, |value| value as f32, path)?,
            packed: Numbers::named(vertices, &PACKED, |value| value as u32, path)?,
            rest,
            degree,
        })
    }

    /// The splats.
    pub fn unpack(&self, path: &Path) -> Result<Gaussians, Error> {
        let count = self.packed.count;
        let mut gaussians = Gaussians::with_room(count, self.degree).map_err(|_| too_many(count, path))?;
        let mut coefficients = vec![Vec3::ZERO; terms(self.degree)];
        for (index, packed) in self.packed.values.as_chunks::<4>().0.iter().enumerate() {
            let chunk = &self.bounds.row(index / CHUNK);
            let [position, rotation, scale, color] = *packed;
            let within = |at: usize, share: [f64; 3]| {
                let bound = |slot: usize| f64::from(chunk[slot]);
                std::array::from_fn(|axis| {
                    bound(at + axis) * (1.0 - share[axis]) + bound(at + 3 + axis) * share[axis]
                })
            };
            let [r, g, b, opacity] = [24, 16, 8, 0].map(|shift| share(color, shift, 8));
            let color = if chunk.len() > COLOR_BOUNDS { within(COLOR_BOUNDS, [r, g, b]) } else { [r, g, b] };
            let gaussian = Gaussian {
                position: DVec3::from_array(within(0, three(position))),
                scales: within(6, three(scale)).map(libm::exp),
                rotation: quaternion(rotation),
                opacity,
            };
            coefficients[0] = Vec3::from_array(color.map(|value| constant_term(value as f32)));
            if self.degree > 0 {
                let further = self.rest.row(index).as_chunks::<3>().0;
                for (coefficient, rgb) in coefficients[1..].iter_mut().zip(further) {
                    *coefficient = Vec3::from_array(rgb.map(harmonic));
                }
            }
            gaussians.push(&gaussian, &coefficients);
        }
        Ok(gaussians)
    }

    /// Per property of a table, what it is used for.
    pub fn usages(&self, table: usize) -> Option<Vec<Usage>> {
        let used = |slots: &[Option<usize>], usage: fn(usize) -> Usage| {
            let usage = |slot: &Option<usize>| slot.map_or(Usage::Unused("unknown"), usage);
            slots.iter().map(usage).collect()
        };
        match table {
            _ if table == self.vertex => {
                let usage = |slot| [Usage::Position, Usage::Rotation, Usage::Size, Usage::Color][slot];
                Some(used(&self.packed.slots, usage))
            }
            _ if table == self.chunk => Some(used(&self.bounds.slots, |_| Usage::Bounds)),
            _ if Some(table) == self.sh => Some(used(&self.rest.slots, |_| Usage::Harmonic)),
            _ => None,
        }
    }
}

impl Tables for PackedSplats {
    fn end(&self) -> usize {
        self.chunk.max(self.vertex).max(self.sh.unwrap_or(0)) + 1
    }

    fn table(&mut self, index: usize) -> Table<'_> {
        match index {
            _ if index == self.vertex => Table::Rows(&mut self.packed),
            _ if index == self.chunk => Table::Rows(&mut self.bounds),
            _ if Some(index) == self.sh => Table::Rows(&mut self.rest),
            _ => Table::Skipped,
        }
    }
}

/// The values of a table that are of use, row by row.
struct Numbers<T> {
    /// Per property, its place in a row.
    slots: Vec<Option<usize>>,
    width: usize,
    count: usize,
    values: Vec<T>,
    convert: fn(f64) -> T,
}

impl<T> Numbers<T> {
    fn new(
        element: &Element,
        slots: Vec<Option<usize>>,
        width: usize,
        convert: fn(f64) -> T,
        path: &Path,
    ) -> Result<Self, Error> {
        let count = usize::try_from(element.count).unwrap_or(usize::MAX);
        let mut values = Vec::new();
        values.try_reserve_exact(count.saturating_mul(width)).map_err(|_| too_many(count, path))?;
        Ok(Self { slots, width, count, values, convert })
    }

    /// The properties of these names, all of which must be there.
    fn named(element: &Element, names: &[&str], convert: fn(f64) -> T, path: &Path) -> Result<Self, Error> {
        let mut slots = vec![None; element.properties.len()];
        for (slot, name) in names.iter().enumerate() {
            let index = position(element, name).ok_or_else(|| missing(element, name, path))?;
            slots[index] = Some(slot);
        }
        Self::new(element, slots, names.len(), convert, path)
    }

    fn row(&self, index: usize) -> &[T] {
        &self.values[index * self.width..][..self.width]
    }
}

impl<T> Rows for Numbers<T> {
    fn slots(&self) -> &[Option<usize>] {
        &self.slots
    }

    fn width(&self) -> usize {
        self.width
    }

    fn count(&self) -> usize {
        self.count
    }

    fn push(&mut self, row: &[f64]) {
        self.values.extend(row.iter().map(|&value| (self.convert)(value)));
    }
}

/// So many bits as a share of their greatest value, 0 to 1.
fn share(packed: u32, shift: u32, bits: u32) -> f64 {
    let greatest = (1 << bits) - 1;
    f64::from(packed >> shift & greatest) / f64::from(greatest)
}

fn three(packed: u32) -> [f64; 3] {
    [share(packed, 21, 11), share(packed, 11, 10), share(packed, 0, 11)]
}

/// The quaternion w, x, y, z: its greatest component, positive, follows from the others.
fn quaternion(packed: u32) -> [f64; 4] {
    let others = [20, 10, 0].map(|shift| (share(packed, shift, 10) - 0.5) * SQRT_2);
    let greatest = (1.0 - others.iter().map(|value| value * value).sum::<f64>()).max(0.0).sqrt();
    let [a, b, c] = others;
    match packed >> 30 {
        0 => [greatest, a, b, c],
        1 => [a, greatest, b, c],
        2 => [a, b, greatest, c],
        _ => [a, b, c, greatest],
    }
}

/// A coefficient of the colour, -4 to 4.
fn harmonic(byte: u8) -> f32 {
    match byte {
        0 => -4.0,
        255 => 4.0,
        _ => (f32::from(byte) + 0.5) / 32.0 - 4.0,
    }
}
