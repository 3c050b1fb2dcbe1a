//! A cloud of oriented point splats, as it comes from a file.

use crate::{Error, SphericalHarmonics};
use glam::{DVec3, Vec2, Vec3};

/// Oriented point splats, as a structure of arrays.
///
/// Positions are stored as `f32` offsets from an `f64` origin, so that clouds in map coordinates (millions of
/// metres from zero) keep their precision. The index of a splat is its place in the file that it came from:
/// bad points are not taken out, they are recognised by [`Cloud::defect`] and skipped.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Cloud {
    /// World position of offset zero, in scene units.
    pub origin: DVec3,
    /// Offsets from the origin, in scene units.
    pub positions: Vec<Vec3>,
    /// Unit normals; empty where the cloud has none (see [`crate::prepare`]).
    pub normals: Vec<Vec3>,
    /// Extents of the splats.
    pub shapes: Shapes,
    /// Linear, scene-referred colours; `None` where the cloud has none.
    pub colors: Option<Vec<Vec3>>,
    /// Colours by the direction of view, which then count instead of `colors`: those are the same without the view, for
    /// whoever needs one colour a splat. `None` where colours do not depend on the view.
    pub harmonics: Option<SphericalHarmonics>,
    /// Opacities in [0, 1]; `None` is opaque.
    pub opacities: Option<Vec<f32>>,
    /// Surface area that each splat stands for, in squared scene units; `None` is unknown (see
    /// [`crate::prepare`]). SPEC section 4 turns it into normalised weights.
    pub areas: Option<Vec<f32>>,
    /// Where each splat lies on a texture; `None` where the cloud has no texture coordinates.
    pub texture_coordinates: Option<Vec<TextureCoordinates>>,
    /// Whether the normals tell the outside from the inside. Without that every splat faces the camera.
    pub oriented: bool,
    /// Whether these are trained Gaussian splats, to be blended one by one ([`splat_abuffer::Resolve::Over`]) and not
    /// joined into surfaces. The renderer does as its options say; this is for whoever chooses them.
    pub trained: bool,
    /// Which points belong to no surface (see [`crate::prepare::Outliers`]), and are skipped; `None`: nobody has looked.
    pub outliers: Option<Vec<bool>>,
    /// What else was measured at each splat. The renderer passes over it, whatever it is: it can be made into
    /// colours.
    pub fields: Vec<Field>,
}

/// A scalar field: one number a splat.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Field {
    /// Its name in the file: "intensity", "classification".
    pub name: String,
    /// A value for each splat, in the units of the file; may be anything.
    pub values: Vec<f32>,
}

/// The extent of each splat.
#[derive(Debug, Clone, PartialEq)]
pub enum Shapes {
    /// Round splats: the standard deviation `sigma` of each (the listing's `size`), in scene units.
    /// 0 is unknown, and estimated by [`crate::prepare`].
    Discs(Vec<f32>),
    /// Elliptical splats: the two sigma-scaled tangent axes of each, in scene units.
    Ellipses(Vec<[Vec3; 2]>),
}

impl Default for Shapes {
    fn default() -> Self {
        Self::Discs(Vec::new())
    }
}

impl Shapes {
    /// Number of splats described.
    pub fn len(&self) -> usize {
        match self {
            Self::Discs(sizes) => sizes.len(),
            Self::Ellipses(axes) => axes.len(),
        }
    }

    /// Whether no splat is described.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// The part of a texture that a splat carries: an affine map from the splat's (u, v), in units of sigma, to texture
/// coordinates (s, t). A point of the splat is at `center + u * per_u + v * per_v`.
///
/// One unit of s or t is the whole texture; s grows to the right, t upwards, and (0, 0) is the lower left corner of the
/// image, as in OBJ files. Values outside [0, 1] are left to the texture's wrap mode.
///
/// (u, v) follow the two axes of [`Shapes::Ellipses`]. The axes of round splats are not the caller's, so there the
/// derivatives mean nothing; only the centre does.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct TextureCoordinates {
    /// (s, t) at the splat's centre.
    pub center: Vec2,
    /// d(s, t)/du: the change of (s, t) along the first axis, per sigma. With `per_v` zero: unknown.
    pub per_u: Vec2,
    /// d(s, t)/dv: the change of (s, t) along the second axis, per sigma.
    pub per_v: Vec2,
}

impl TextureCoordinates {
    /// The (s, t) of a point of the splat, whose (u, v) are in units of sigma.
    pub fn at(&self, uv: Vec2) -> Vec2 {
        self.center + uv.x * self.per_u + uv.y * self.per_v
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        self.center.is_finite() && self.per_u.is_finite() && self.per_v.is_finite()
    }

    /// The six numbers: centre, derivative along u, derivative along v, s before t.
    pub fn to_array(&self) -> [f32; 6] {
        [self.center.x, self.center.y, self.per_u.x, self.per_u.y, self.per_v.x, self.per_v.y]
    }
}

/// Why a splat is never rendered. SPEC section 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Defect {
    /// [`Cloud::outliers`] says that it belongs to no surface.
    Outlier,
    /// A coordinate, normal, size, colour, harmonic, opacity, area or texture coordinate is infinite or not a number.
    NotFinite,
    /// The normal, or the area spanned by the two axes, is zero.
    ZeroNormal,
    /// The size is negative.
    NegativeSize,
    /// The size is zero, and nothing estimated it.
    UnknownSize,
    /// The area that it stands for is zero or negative.
    NoArea,
}

impl Defect {
    /// The name of the cause in statistics.
    pub fn name(self) -> &'static str {
        match self {
            Self::Outlier => "outlier",
            Self::NotFinite => "not_finite",
            Self::ZeroNormal => "zero_normal",
            Self::NegativeSize => "negative_size",
            Self::UnknownSize => "unknown_size",
            Self::NoArea => "no_area",
        }
    }
}

impl Cloud {
    /// A cloud of bare points: `positions` in world coordinates (scene units), nothing else known.
    ///
    /// The origin is chosen by [`choose_origin`]. A point too far from it for `f32` becomes infinite, which
    /// [`Cloud::defect`] reports.
    pub fn from_points(positions: &[DVec3]) -> Self {
        let origin = choose_origin(positions);
        Self {
            origin,
            positions: positions.iter().map(|&p| (p - origin).as_vec3()).collect(),
            shapes: Shapes::Discs(vec![0.0; positions.len()]),
            ..Self::default()
        }
    }

    /// Number of splats, good and bad.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Bytes of memory that its arrays take.
    pub fn bytes(&self) -> usize {
        fn of<T>(values: &[T]) -> usize {
            size_of_val(values)
        }
        let shapes = match &self.shapes {
            Shapes::Discs(sizes) => of(sizes),
            Shapes::Ellipses(axes) => of(axes),
        };
        let harmonics =
            |harmonics: &SphericalHarmonics| (0..harmonics.len()).map(|i| of(harmonics.of(i))).sum();
        let optional = [
            self.colors.as_deref().map(of),
            self.harmonics.as_ref().map(harmonics),
            self.opacities.as_deref().map(of),
            self.areas.as_deref().map(of),
            self.texture_coordinates.as_deref().map(of),
            self.outliers.as_deref().map(of),
        ];
        let fields: usize = self.fields.iter().map(|field| of(&field.values)).sum();
        of(&self.positions) + of(&self.normals) + shapes + optional.iter().flatten().sum::<usize>() + fields
    }

    /// Whether the cloud has no splat at all.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// World position of a splat, in scene units.
    pub fn world_position(&self, index: usize) -> DVec3 {
        self.origin + self.positions[index].as_dvec3()
    }

    /// Checks that all arrays belong together.
    ///
    /// # Errors
    /// [`Error::Length`] if an array is neither absent nor as long as the positions.
    pub fn check_lengths(&self) -> Result<(), Error> {
        let expected = self.len();
        let lengths = [
            ("normals", (!self.normals.is_empty()).then_some(self.normals.len())),
            ("shapes", Some(self.shapes.len())),
            ("colors", self.colors.as_ref().map(Vec::len)),
            ("spherical harmonics", self.harmonics.as_ref().map(SphericalHarmonics::len)),
            ("opacities", self.opacities.as_ref().map(Vec::len)),
            ("areas", self.areas.as_ref().map(Vec::len)),
            ("texture coordinates", self.texture_coordinates.as_ref().map(Vec::len)),
            ("outliers", self.outliers.as_ref().map(Vec::len)),
        ];
        let fields = self.fields.iter().map(|field| ("field", Some(field.values.len())));
        for (what, length) in lengths.into_iter().chain(fields) {
            if let Some(found) = length.filter(|&found| found != expected) {
                return Err(Error::Length { what, found, expected });
            }
        }
        Ok(())
    }

    /// Whether the point is marked as belonging to no surface.
    #[inline]
    pub fn is_outlier(&self, index: usize) -> bool {
        self.outliers.as_ref().is_some_and(|outliers| outliers[index])
    }

    /// Takes the marked outliers out, so that what follows them moves up.
    pub fn remove_outliers(&mut self) {
        if let Some(outliers) = self.outliers.take() {
            let kept: Vec<usize> = (0..self.len()).filter(|&index| !outliers[index]).collect();
            *self = self.only(&kept);
        }
    }

    /// Why the splat must not be rendered, or `None` if it is fit. SPEC section 2.
    ///
    /// Expects a cloud whose arrays belong together and whose normals are known.
    #[inline(always)]
    pub fn defect(&self, index: usize) -> Option<Defect> {
        if self.is_outlier(index) {
            return Some(Defect::Outlier);
        }
        let finite = self.positions[index].is_finite()
            && self.normals[index].is_finite()
            && self.colors.as_ref().is_none_or(|colors| colors[index].is_finite())
            && self.harmonics.as_ref().is_none_or(|harmonics| harmonics.is_finite(index))
            && self.opacities.as_ref().is_none_or(|opacities| opacities[index].is_finite())
            && self.areas.as_ref().is_none_or(|areas| areas[index].is_finite())
            && self.texture_coordinates.as_ref().is_none_or(|coordinates| coordinates[index].is_finite())
            && match &self.shapes {
                Shapes::Discs(sizes) => sizes[index].is_finite(),
                Shapes::Ellipses(axes) => axes[index].iter().all(|axis| axis.is_finite()),
            };
        if !finite {
            return Some(Defect::NotFinite);
        }
        if self.normals[index] == Vec3::ZERO {
            return Some(Defect::ZeroNormal);
        }
        match &self.shapes {
            Shapes::Discs(sizes) if sizes[index] < 0.0 => Some(Defect::NegativeSize),
            Shapes::Discs(sizes) if sizes[index] == 0.0 => Some(Defect::UnknownSize),
            Shapes::Ellipses(axes) if axes[index][0].cross(axes[index][1]) == Vec3::ZERO => {
                Some(Defect::ZeroNormal)
            }
            _ if self.areas.as_ref().is_some_and(|areas| areas[index] <= 0.0) => Some(Defect::NoArea),
            _ => None,
        }
    }

    /// The scalar field of that name, in any case; the first if there are several.
    pub fn field(&self, name: &str) -> Option<&Field> {
        self.fields.iter().find(|field| field.name.eq_ignore_ascii_case(name))
    }

    /// Least and greatest world position of the finite points that are no outliers, or `None` if there is none.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let points = self.positions.iter().enumerate();
        let finite = points.filter(|&(i, p)| p.is_finite() && !self.is_outlier(i)).map(|(_, p)| p.as_dvec3());
        finite
            .fold(None, |bounds: Option<(DVec3, DVec3)>, p| {
                Some(bounds.map_or((p, p), |(low, high)| (low.min(p), high.max(p))))
            })
            .map(|(low, high)| (self.origin + low, self.origin + high))
    }

    /// Length of the diagonal of the finite points' box, in scene units; 0 without points.
    pub fn diagonal(&self) -> f64 {
        self.bounds().map_or(0.0, |(low, high)| (high - low).length())
    }
}

/// The origin for a cloud of these world positions: zero where `f32` coordinates serve as well, the median
/// point where the cloud lies far from zero for its extent.
///
/// "Far" is 16 interquartile ranges; below that an offset from the median would gain no more than 4 bits, and
/// coordinates that were `f32` in the file stay exactly what they were. Median and quartiles ignore outliers (one
/// stray point at zero is common in map coordinates), non-finite points, and the order of the points.
pub fn choose_origin(positions: &[DVec3]) -> DVec3 {
    let mut median = DVec3::ZERO;
    let mut spread: f64 = 0.0;
    let mut values = Vec::with_capacity(positions.len());
    for axis in 0..3 {
        values.clear();
        values.extend(positions.iter().filter(|p| p.is_finite()).map(|p| p[axis]));
        if values.is_empty() {
            return DVec3::ZERO;
        }
        let last = values.len() - 1;
        let mut quantile = |rank: usize| *values.select_nth_unstable_by(rank, f64::total_cmp).1;
        median[axis] = quantile(last / 2);
        spread = spread.max(quantile(last - last / 4) - quantile(last / 4));
    }
    if median.abs().max_element() < 16.0 * spread { DVec3::ZERO } else { median }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn textured(coordinates: TextureCoordinates) -> Cloud {
        let mut cloud = Cloud::from_points(&[DVec3::ZERO]);
        cloud.normals = vec![Vec3::Z];
        cloud.shapes = Shapes::Ellipses(vec![[Vec3::X, Vec3::Y]]);
        cloud.texture_coordinates = Some(vec![coordinates]);
        cloud
    }

    #[test]
    fn texture_coordinates_are_checked_as_all_else() {
        let good = TextureCoordinates { center: Vec2::ONE, per_u: Vec2::X, per_v: -2.0 * Vec2::Y };
        assert_eq!(good.at(Vec2::new(2.0, 0.5)), Vec2::new(3.0, 0.0));
        assert_eq!(textured(good).defect(0), None);
        let bad = [
            TextureCoordinates { center: Vec2::NAN, ..good },
            TextureCoordinates { per_u: Vec2::new(0.0, f32::INFINITY), ..good },
            TextureCoordinates { per_v: Vec2::new(f32::NEG_INFINITY, 0.0), ..good },
        ];
        for coordinates in bad {
            assert_eq!(textured(coordinates).defect(0), Some(Defect::NotFinite), "{coordinates:?}");
        }
        let mut cloud = textured(good);
        let of = |coefficient| SphericalHarmonics::new(0, vec![coefficient]).unwrap();
        cloud.harmonics = Some(of(Vec3::ONE));
        assert_eq!((cloud.check_lengths(), cloud.defect(0)), (Ok(()), None));
        cloud.harmonics = Some(of(Vec3::new(0.0, f32::NAN, 0.0)));
        assert_eq!(cloud.defect(0), Some(Defect::NotFinite));
        cloud.texture_coordinates = Some(Vec::new());
        assert_eq!(
            cloud.check_lengths().unwrap_err().to_string(),
            "cloud: texture coordinates has 0 entries for 1 positions"
        );
    }

    #[test]
    fn fields_must_be_as_long_as_the_cloud_and_are_no_defect() {
        let mut cloud = textured(TextureCoordinates::default());
        cloud.fields = vec![Field { name: "Intensity".to_owned(), values: vec![f32::NAN] }];
        assert!(cloud.check_lengths().is_ok() && cloud.defect(0).is_none());
        assert!(cloud.field("intensity").is_some() && cloud.field("time").is_none());
        cloud.fields[0].values.clear();
        assert_eq!(
            cloud.check_lengths().unwrap_err().to_string(),
            "cloud: field has 0 entries for 1 positions"
        );
    }
}
