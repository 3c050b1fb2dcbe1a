//! Clouds made of parts of others: some of the splats of one, or all of several.

use crate::harmonics::{SphericalHarmonics, constant_term, terms};
use crate::prepare::unknown_sizes;
use crate::setup::UNCOLORED_LIT;
use crate::{Cloud, Error, Field, Shapes, TextureCoordinates, srgb};
use glam::{DVec3, Vec3};

impl Cloud {
    /// The cloud of some of the splats, in this order.
    pub fn only(&self, kept: &[usize]) -> Self {
        fn pick<T: Copy>(values: &[T], kept: &[usize]) -> Vec<T> {
            if values.is_empty() { Vec::new() } else { kept.iter().map(|&index| values[index]).collect() }
        }
        let field = |field: &Field| Field { name: field.name.clone(), values: pick(&field.values, kept) };
        Self {
            origin: self.origin,
            positions: pick(&self.positions, kept),
            normals: pick(&self.normals, kept),
            shapes: match &self.shapes {
                Shapes::Discs(sizes) => Shapes::Discs(pick(sizes, kept)),
                Shapes::Ellipses(axes) => Shapes::Ellipses(pick(axes, kept)),
            },
            colors: self.colors.as_ref().map(|values| pick(values, kept)),
            harmonics: self.harmonics.as_ref().map(|harmonics| harmonics.only(kept)),
            opacities: self.opacities.as_ref().map(|values| pick(values, kept)),
            areas: self.areas.as_ref().map(|values| pick(values, kept)),
            texture_coordinates: self.texture_coordinates.as_ref().map(|values| pick(values, kept)),
            oriented: self.oriented,
            trained: self.trained,
            outliers: self.outliers.as_ref().map(|values| pick(values, kept)),
            fields: self.fields.iter().map(field).collect(),
        }
    }

    /// Whether clouds go together only once all their normals and sizes are known ([`crate::prepare`]): some have normals
    /// and some have none, or some are round and some are not.
    pub fn differ<'a>(clouds: impl Iterator<Item = &'a Self> + Clone) -> bool {
        let there = clouds.filter(|cloud| !cloud.is_empty());
        let mixed = |has: fn(&Self) -> bool| there.clone().any(has) && !there.clone().all(has);
        mixed(|cloud| cloud.normals.is_empty()) || mixed(|cloud| matches!(cloud.shapes, Shapes::Ellipses(_)))
    }

    /// Joins clouds: the splats of the first one come first.
    ///
    /// What some have and others lack: opacities are 1, colours light grey, texture coordinates unknown; round splats become
    /// ellipses; colours that do not depend on the view stay so. Areas and scalar fields are kept if all clouds have them. The
    /// normals tell the outside, and the splats are trained ones, if it is so in all clouds.
    ///
    /// # Errors
    /// [`Error::Invalid`] if some clouds have normals and some have none, and if round splats without normals or sizes
    /// are joined with ellipses: they must be completed first ([`crate::prepare`]).
    pub fn join(mut clouds: Vec<Self>) -> Result<Self, Error> {
        if clouds.len() > 1 {
            clouds.retain(|cloud| !cloud.is_empty());
        }
        if clouds.len() < 2 {
            return Ok(clouds.pop().unwrap_or_default());
        }
        let with_normals = clouds.iter().filter(|cloud| !cloud.normals.is_empty()).count();
        if with_normals != 0 && with_normals != clouds.len() {
            let found = format!("some in {with_normals} of {} clouds", clouds.len());
            return Err(Error::invalid("normals", found, "some in all clouds or in none"));
        }
        let is_round = |cloud: &Self| matches!(cloud.shapes, Shapes::Discs(_));
        // A bad point may keep an unknown size: it is a defect anyway.
        let is_bare = |cloud: &Self| cloud.normals.is_empty() || unknown_sizes(cloud) == cloud.len();
        if !clouds.iter().all(is_round) && clouds.iter().any(|cloud| is_round(cloud) && is_bare(cloud)) {
            let expected = "all known, where round splats are joined with ellipses";
            return Err(Error::invalid("normals and sizes", "some unknown", expected));
        }
        let worlds =
            clouds.iter().flat_map(|cloud| (0..cloud.len()).map(|index| cloud.world_position(index)));
        let mut joined = Self::from_points(&worlds.collect::<Vec<DVec3>>());
        joined.harmonics = join_harmonics(&clouds);
        joined.shapes = join_shapes(&mut clouds);
        joined.normals = clouds.iter().flat_map(|cloud| &cloud.normals).copied().collect();
        if joined.harmonics.is_none() {
            joined.colors = filled(&clouds, |cloud| cloud.colors.as_deref(), Vec3::from(UNCOLORED_LIT));
        }
        joined.outliers = filled(&clouds, |cloud| cloud.outliers.as_deref(), false);
        joined.opacities = filled(&clouds, |cloud| cloud.opacities.as_deref(), 1.0);
        joined.texture_coordinates =
            filled(&clouds, |cloud| cloud.texture_coordinates.as_deref(), TextureCoordinates::default());
        if clouds.iter().all(|cloud| cloud.areas.is_some()) {
            joined.areas = filled(&clouds, |cloud| cloud.areas.as_deref(), 0.0);
        }
        joined.fields =
            clouds[0].fields.iter().filter_map(|field| join_field(&clouds, &field.name)).collect();
        joined.oriented = clouds.iter().all(|cloud| cloud.oriented);
        joined.trained = clouds.iter().all(|cloud| cloud.trained);
        Ok(joined)
    }
}

/// One property of all clouds, one after the other, `missing` where a cloud has none; `None` if no cloud has it.
fn filled<T: Copy>(
    clouds: &[Cloud],
    property: impl for<'a> Fn(&'a Cloud) -> Option<&'a [T]>,
    missing: T,
) -> Option<Vec<T>> {
    clouds.iter().any(|cloud| property(cloud).is_some()).then(|| {
        let mut values = Vec::new();
        for cloud in clouds {
            let end = values.len() + cloud.len();
            values.extend_from_slice(property(cloud).unwrap_or_default());
            values.resize(end, missing);
        }
        values
    })
}

/// Round splats if all are, else ellipses.
fn join_shapes(clouds: &mut [Cloud]) -> Shapes {
    if clouds.iter().all(|cloud| matches!(cloud.shapes, Shapes::Discs(_))) {
        let sizes = clouds.iter().map(|cloud| match &cloud.shapes {
            Shapes::Discs(sizes) => sizes.as_slice(),
            Shapes::Ellipses(_) => &[],
        });
        return Shapes::Discs(sizes.collect::<Vec<_>>().concat());
    }
    let mut all = Vec::new();
    for cloud in clouds {
        cloud.make_elliptical();
        if let Shapes::Ellipses(axes) = &cloud.shapes {
            all.extend_from_slice(axes);
        }
    }
    Shapes::Ellipses(all)
}

/// The harmonics of all clouds, of the greatest degree; `None` if no cloud has any.
fn join_harmonics(clouds: &[Cloud]) -> Option<SphericalHarmonics> {
    let degree = clouds.iter().filter_map(|cloud| Some(cloud.harmonics.as_ref()?.degree())).max()?;
    let mut coefficients = Vec::new();
    for cloud in clouds {
        for index in 0..cloud.len() {
            let start = coefficients.len();
            match (&cloud.harmonics, &cloud.colors) {
                (Some(harmonics), _) => coefficients.extend_from_slice(harmonics.of(index)),
                (None, colors) => {
                    let color = colors.as_ref().map_or(UNCOLORED_LIT, |colors| colors[index].to_array());
                    let term = |linear: f32| constant_term(srgb::encode(linear.into()) as f32);
                    coefficients.push(Vec3::from_array(color.map(term)));
                }
            }
            coefficients.resize(start + terms(degree), Vec3::ZERO);
        }
    }
    SphericalHarmonics::new(degree, coefficients).ok()
}

/// A scalar field, if all clouds have it.
fn join_field(clouds: &[Cloud], name: &str) -> Option<Field> {
    let parts: Option<Vec<&[f32]>> =
        clouds.iter().map(|cloud| cloud.field(name).map(|field| field.values.as_slice())).collect();
    Some(Field { name: name.to_owned(), values: parts?.concat() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud(at: DVec3, count: usize) -> Cloud {
        let points: Vec<DVec3> = (0..count).map(|i| at + DVec3::X * i as f64).collect();
        let mut cloud = Cloud::from_points(&points);
        cloud.normals = vec![Vec3::Z; count];
        cloud.oriented = true;
        cloud
    }

    #[test]
    fn clouds_are_joined_in_order_and_far_from_zero() {
        let (first, second) = (DVec3::new(5e5, 5e6, 0.0), DVec3::new(5e5, 5e6, 9.0));
        let mut other = cloud(second, 3);
        other.opacities = Some(vec![0.5; 3]);
        let all = Cloud::join(vec![cloud(first, 2), other]).unwrap();
        assert!(all.check_lengths().is_ok() && all.oriented);
        assert_eq!(all.world_position(1), first + DVec3::X);
        assert_eq!(all.world_position(2), second);
        assert_eq!(all.opacities, Some(vec![1.0, 1.0, 0.5, 0.5, 0.5]));
        assert_eq!(all.areas, None);
    }

    #[test]
    fn one_cloud_stays_what_it_is_and_empty_ones_say_nothing() {
        let one = cloud(DVec3::ONE, 2);
        assert_eq!(Cloud::join(vec![one.clone()]).unwrap(), one);
        assert_eq!(Cloud::join(vec![Cloud::default(), one.clone()]).unwrap(), one);
        assert_eq!(Cloud::join(vec![Cloud::default(); 2]).unwrap(), Cloud::default());
        assert!(!Cloud::differ([Cloud::default(), one].iter()));
    }

    #[test]
    fn what_one_cloud_lacks_is_filled_in() {
        let plain = Cloud { shapes: Shapes::Discs(vec![2.0; 2]), ..cloud(DVec3::ZERO, 2) };
        let rich = Cloud {
            colors: Some(vec![Vec3::ONE]),
            shapes: Shapes::Ellipses(vec![[Vec3::X, Vec3::Y]]),
            fields: vec![Field { name: "intensity".to_owned(), values: vec![7.0] }],
            ..cloud(DVec3::ZERO, 1)
        };
        assert!(Cloud::differ([plain.clone(), rich.clone()].iter()));
        let all = Cloud::join(vec![rich.clone(), plain.clone()]).unwrap();
        assert!(all.check_lengths().is_ok() && all.fields.is_empty());
        assert_eq!(all.colors.unwrap()[1], Vec3::from(UNCOLORED_LIT));
        let Shapes::Ellipses(axes) = &all.shapes else { panic!("{:?}", all.shapes) };
        assert_eq!(axes[0], [Vec3::X, Vec3::Y]);
        assert!(axes[1].iter().all(|axis| (axis.length() - 2.0).abs() < 1e-6 && axis.z == 0.0));
        let both = Cloud::join(vec![rich.clone(), rich]).unwrap();
        assert_eq!(both.field("intensity").unwrap().values, [7.0, 7.0]);
        let bare = Cloud { normals: Vec::new(), ..plain.clone() };
        assert!(Cloud::differ([plain.clone(), bare.clone()].iter()));
        assert!(Cloud::join(vec![plain, bare.clone()]).unwrap_err().to_string().contains("normals"));
        // Tangent axes alone, as files have them, with round splats of which less is known.
        let axes = Cloud {
            normals: Vec::new(),
            shapes: Shapes::Ellipses(vec![[Vec3::X, Vec3::Y]; 2]),
            ..bare.clone()
        };
        assert!(Cloud::join(vec![axes, bare]).unwrap_err().to_string().contains("normals and sizes"));
    }

    #[test]
    fn colours_by_direction_and_others_become_one() {
        let plain = Cloud { colors: Some(vec![Vec3::splat(0.25)]), ..cloud(DVec3::ZERO, 1) };
        let mut trained = cloud(DVec3::X, 1);
        let degree_1 = vec![Vec3::ZERO, Vec3::ONE, Vec3::NEG_ONE, Vec3::X];
        trained.harmonics = Some(SphericalHarmonics::new(1, degree_1.clone()).unwrap());
        let all = Cloud::join(vec![trained, plain.clone()]).unwrap();
        let harmonics = all.harmonics.unwrap();
        assert_eq!(harmonics.of(0), degree_1);
        let color = Vec3::from_array(harmonics.color(1, Vec3::X));
        let expected = Vec3::splat(srgb::encode(0.25) as f32);
        assert!(color.abs_diff_eq(expected, 1e-6), "{color} for {expected}");
        assert_eq!(Cloud::join(vec![plain.clone(), plain]).unwrap().harmonics, None);
    }

    #[test]
    fn some_of_a_cloud() {
        let some = cloud(DVec3::ZERO, 5).only(&[4, 1]);
        assert_eq!([some.world_position(0), some.world_position(1)], [4.0 * DVec3::X, DVec3::X]);
        assert!(some.check_lengths().is_ok() && some.len() == 2);
    }
}
