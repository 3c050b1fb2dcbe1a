//! From the rows of a table of points to a cloud.

use super::Element;
use super::roles::{
    AREA, COLOR, FIELDS, NORMAL, OPACITY, POSITION, Roles, SIZE, TANGENTS, TEXTURE, TEXTURE_DERIVATIVES,
};
use super::scalar::Scalar;
use super::tone::Tone;
use crate::{Error, Loss, Usage};
use glam::{DVec3, Vec2, Vec3};
use splat_core::{Cloud, Field, Shapes, TextureCoordinates};
use std::collections::TryReserveError;
use std::path::Path;

/// A cloud half read, and how its columns are filled.
pub(crate) struct Columns {
    pub roles: Roles,
    /// Number of rows to come.
    count: usize,
    positions: Vec<DVec3>,
    normals: Option<Vec<Vec3>>,
    tones: [Tone; 3],
    colors: Option<Vec<Vec3>>,
    greatest_color: f32,
    opacity_scale: f64,
    opacities: Option<Vec<f32>>,
    /// Number of opacities that were clamped, and the row of the first.
    clamped_opacities: (u64, usize),
    sizes: Option<Vec<f32>>,
    areas: Option<Vec<f32>>,
    tangents: Option<Vec<[Vec3; 2]>>,
    texture_coordinates: Option<Vec<TextureCoordinates>>,
    fields: Vec<Field>,
}

/// What a file says of its points as a whole.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Hints {
    /// Whether the normals are oriented.
    pub oriented: Option<bool>,
    /// The cloud's origin; finite.
    pub origin: Option<DVec3>,
}

/// What became of the columns.
pub(crate) struct Outcome {
    pub cloud: Cloud,
    /// Per property of the element.
    pub usages: Vec<Usage>,
    /// Of places, normals, sizes and texture coordinates.
    pub assumptions: Vec<String>,
    /// Of colours and opacities.
    pub color_assumptions: Vec<String>,
    pub losses: Vec<Loss>,
}

impl Columns {
    /// Understands the properties of the table of points, and makes room for its rows.
    pub fn new(element: &Element, path: &Path) -> Result<Self, Error> {
        let mut columns = Self::without_rows(Roles::assign(element, path)?);
        columns.reserve(element.count).map_err(|_| {
            Error::limit(path, format!("a cloud of {} points", element.count), "this machine's memory")
        })?;
        Ok(columns)
    }

    fn without_rows(roles: Roles) -> Self {
        let kinds = &roles.kinds;
        let tone = |channel: usize| kinds[COLOR.start + channel].map_or(Tone::Linear, Tone::of);
        let range = kinds[OPACITY].and_then(Scalar::range);
        Self {
            count: 0,
            positions: Vec::new(),
            normals: kinds[NORMAL.start].map(|_| Vec::new()),
            tones: std::array::from_fn(tone),
            colors: kinds[COLOR.start].map(|_| Vec::new()),
            greatest_color: 0.0,
            opacity_scale: range.map_or(1.0, |(_, greatest)| 1.0 / greatest as f64),
            opacities: kinds[OPACITY].map(|_| Vec::new()),
            clamped_opacities: (0, 0),
            sizes: kinds[SIZE].map(|_| Vec::new()),
            areas: kinds[AREA].map(|_| Vec::new()),
            tangents: kinds[TANGENTS.start].map(|_| Vec::new()),
            texture_coordinates: kinds[TEXTURE.start].map(|_| Vec::new()),
            fields: roles
                .field_names
                .iter()
                .map(|name| Field { name: name.clone(), values: Vec::new() })
                .collect(),
            roles,
        }
    }

    /// Makes room for rows.
    fn reserve(&mut self, count: u64) -> Result<(), TryReserveError> {
        fn room<T>(column: &mut Option<Vec<T>>, count: usize) -> Result<(), TryReserveError> {
            column.as_mut().map_or(Ok(()), |column| column.try_reserve_exact(count))
        }
        self.count = usize::try_from(count).unwrap_or(usize::MAX);
        self.positions.try_reserve_exact(self.count)?;
        room(&mut self.normals, self.count)?;
        room(&mut self.colors, self.count)?;
        room(&mut self.opacities, self.count)?;
        room(&mut self.sizes, self.count)?;
        room(&mut self.areas, self.count)?;
        room(&mut self.tangents, self.count)?;
        room(&mut self.texture_coordinates, self.count)?;
        self.fields.iter_mut().try_for_each(|field| field.values.try_reserve_exact(self.count))
    }

    /// Number of rows that were claimed.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Adds a row: a value for each slot.
    #[inline]
    pub fn push(&mut self, row: &[f64]) {
        let triple = |slot: usize| DVec3::new(row[slot], row[slot + 1], row[slot + 2]);
        self.positions.push(triple(POSITION.start));
        if let Some(normals) = &mut self.normals {
            normals.push(unit(triple(NORMAL.start)));
        }
        if let Some(colors) = &mut self.colors {
            let channel = |channel: usize| self.tones[channel].linear(row[COLOR.start + channel]);
            let color = Vec3::new(channel(0), channel(1), channel(2));
            self.greatest_color = self.greatest_color.max(color.max_element());
            colors.push(color);
        }
        if let Some(opacities) = &mut self.opacities {
            let mut opacity = row[OPACITY] * self.opacity_scale;
            if opacity.is_finite() && !(0.0..=1.0).contains(&opacity) {
                opacity = opacity.clamp(0.0, 1.0);
                let (count, first) = &mut self.clamped_opacities;
                if *count == 0 {
                    *first = opacities.len();
                }
                *count += 1;
            }
            opacities.push(opacity as f32);
        }
        if let Some(sizes) = &mut self.sizes {
            sizes.push(row[SIZE] as f32);
        }
        if let Some(areas) = &mut self.areas {
            areas.push(row[AREA] as f32);
        }
        if let Some(tangents) = &mut self.tangents {
            let [u, v] = [TANGENTS.start, TANGENTS.start + 3].map(triple);
            tangents.push([u.as_vec3(), v.as_vec3()]);
        }
        if let Some(coordinates) = &mut self.texture_coordinates {
            let pair = |slot: usize| Vec2::new(row[slot] as f32, row[slot + 1] as f32);
            let [per_u, per_v] = [0, 2].map(|first| pair(TEXTURE_DERIVATIVES.start + first));
            coordinates.push(TextureCoordinates { center: pair(TEXTURE.start), per_u, per_v });
        }
        for (field, value) in self.fields.iter_mut().zip(&row[FIELDS..]) {
            field.values.push(*value as f32);
        }
    }

    /// Makes the cloud and says what was assumed.
    pub fn finish(mut self, hints: Hints) -> Outcome {
        let mut assumptions = Vec::new();
        self.drop_zero_normals(&mut assumptions);
        let mut cloud = located(&self.positions, hints.origin);
        let count = cloud.len();

        assumptions.extend(far_from_zero(&cloud));
        cloud.oriented = self.normals.is_some() && hints.oriented != Some(false);
        assumptions.push(match (&self.normals, cloud.oriented) {
            (None, _) => "no normals: they are unknown".to_owned(),
            (Some(_), true) => "the normals are taken as oriented: they point outwards".to_owned(),
            (Some(_), false) => "the normals are not oriented: a comment of the file says so".to_owned(),
        });
        assumptions.push(match (&self.tangents, &self.roles.size_name) {
            (Some(_), _) => "the splats are ellipses: the tangent axes are read as sigma".to_owned(),
            (None, Some(name)) => {
                format!("{name} is read as sigma: the disc reaches sqrt(cutoff) times as far; 0 is unknown")
            }
            (None, None) => "no size: every size is unknown".to_owned(),
        });
        let mut color_assumptions = Vec::new();
        self.describe_colors(&mut color_assumptions);
        if self.texture_coordinates.is_some() && self.roles.kinds[TEXTURE_DERIVATIVES.start].is_none() {
            let name = "texture coordinates are those of the splats' centres: their derivatives are unknown";
            assumptions.push(name.to_owned());
        }

        cloud.shapes = match (self.tangents, self.sizes) {
            (Some(tangents), _) => Shapes::Ellipses(tangents),
            (None, Some(sizes)) => Shapes::Discs(sizes),
            (None, None) => Shapes::Discs(vec![0.0; count]),
        };
        cloud.normals = self.normals.unwrap_or_default();
        cloud.colors = self.colors;
        cloud.opacities = self.opacities;
        cloud.areas = self.areas;
        cloud.texture_coordinates = self.texture_coordinates;
        cloud.fields = self.fields;
        let (clamped, first) = self.clamped_opacities;
        let losses = Loss::new("opacities outside [0, 1]", clamped, format!("point {first}"));
        let losses = losses.into_iter().collect();
        Outcome { cloud, usages: self.roles.usages, assumptions, color_assumptions, losses }
    }

    fn drop_zero_normals(&mut self, assumptions: &mut Vec<String>) {
        let all_zero = |normals: &Vec<Vec3>| !normals.is_empty() && normals.iter().all(|&n| n == Vec3::ZERO);
        if self.normals.as_ref().is_some_and(all_zero) {
            self.normals = None;
            assumptions.push("every normal is zero: taken as absent".to_owned());
            for usage in &mut self.roles.usages {
                if *usage == Usage::Normal {
                    *usage = Usage::Unused("every normal is zero");
                }
            }
        }
    }

    fn describe_colors(&self, assumptions: &mut Vec<String>) {
        if self.colors.is_some() {
            assumptions.push(match self.tones {
                [Tone::Linear, Tone::Linear, Tone::Linear] => {
                    "the float colors are taken as linear".to_owned()
                }
                [Tone::Srgb8, ..] if self.roles.kinds[COLOR.start] == Some(Scalar::U8) => {
                    "the 8-bit colors are taken as sRGB and linearised".to_owned()
                }
                [Tone::Srgb16, ..] => "the 16-bit colors are taken as sRGB and linearised".to_owned(),
                _ => "the integer colors are taken as 8-bit sRGB, 0 to 255, and linearised".to_owned(),
            });
            if self.greatest_color > 1.5 {
                let greatest = self.greatest_color;
                assumptions.push(format!("float colors reach {greatest}: they are not scaled to 0 to 1"));
            }
        }
        if let (count @ 1.., _) = self.clamped_opacities {
            assumptions.push(format!("{count} opacities outside [0, 1] are clamped"));
        }
    }
}

/// What is said of a cloud with an origin of its own.
pub(crate) fn far_from_zero(cloud: &Cloud) -> Option<String> {
    let DVec3 { x, y, z } = cloud.origin;
    (cloud.origin != DVec3::ZERO)
        .then(|| format!("the points lie far from zero: they are kept relative to ({x}, {y}, {z})"))
}

/// Bare points, relative to the origin that a comment gives if that keeps every position exactly, otherwise
/// to one that the cloud chooses.
fn located(positions: &[DVec3], origin: Option<DVec3>) -> Cloud {
    let offset = |origin: DVec3, p: DVec3| (p - origin).as_vec3();
    let keeps = |origin: DVec3| {
        positions.iter().all(|&p| !p.is_finite() || origin + offset(origin, p).as_dvec3() == p)
    };
    match origin.filter(|&origin| keeps(origin)) {
        Some(origin) => Cloud {
            origin,
            positions: positions.iter().map(|&p| offset(origin, p)).collect(),
            ..Cloud::default()
        },
        None => Cloud::from_points(positions),
    }
}

/// A unit vector, computed in `f64`; what is zero or not finite stays so.
///
/// A vector whose length is 1 to `f32`'s rounding is kept bit for bit. (Rounding each component by 2^-25
/// changes the squared length by less than 2 sqrt(3) 2^-25 < 2^-23; the bound leaves room for other programs'
/// arithmetic.)
#[inline]
fn unit(n: DVec3) -> Vec3 {
    const ROUNDING: f64 = 1.0 / (1 << 21) as f64;
    if (n.length_squared() - 1.0).abs() <= ROUNDING {
        return n.as_vec3();
    }
    // Scaled first, so that no square overflows or vanishes.
    let greatest = n.abs().max_element();
    if !n.is_finite() || greatest == 0.0 {
        return n.as_vec3();
    }
    let scaled = n / greatest;
    (scaled / scaled.length()).as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_become_unit_vectors_at_any_scale() {
        for scale in [1e-300, 1e-30, 1.0, 1e30, 1e300] {
            let n = unit(DVec3::new(3.0, -4.0, 12.0) * scale).as_dvec3();
            assert!((n - DVec3::new(3.0, -4.0, 12.0) / 13.0).length() < 1e-7, "{scale}: {n}");
        }
        assert_eq!(unit(DVec3::ZERO), Vec3::ZERO);
        assert!(!unit(DVec3::new(f64::NAN, 0.0, 1.0)).is_finite());
        assert!(!unit(DVec3::new(f64::INFINITY, 0.0, 1.0)).is_finite());
    }

    #[test]
    fn unit_normals_are_kept_bit_for_bit() {
        for i in 0..1000 {
            let (a, b) = (f64::from(i) * 0.37, f64::from(i) * 0.113);
            let once = unit(DVec3::new(a.cos() * b.sin(), a.sin() * b.sin(), b.cos()) * 7.0);
            assert_eq!(unit(once.as_dvec3()), once);
        }
    }
}
