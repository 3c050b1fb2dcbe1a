//! Clouds moved, turned and scaled as a whole.

use crate::setup::world_axes;
use crate::{Cloud, Shapes};
use glam::{DAffine3, DMat3, DVec3, Vec3};

/// How far a placement may be from one that keeps shapes, relative to its scale, to be taken for it.
const SIMILAR: f64 = 1e-6;

/// The scale of a placement that keeps shapes, turned or mirrored; `None` if it stretches or shears them.
pub fn scale_of(linear: &DMat3) -> Option<f64> {
    let scale = linear.x_axis.length();
    let deviation = linear.transpose() * *linear - DMat3::from_diagonal(DVec3::splat(scale * scale));
    let greatest =
        deviation.to_cols_array().iter().fold(0.0, |greatest: f64, value| greatest.max(value.abs()));
    (greatest <= SIMILAR * scale * scale).then_some(scale)
}

impl Cloud {
    /// Moves the cloud: `to_world`, which must have an inverse, gives the new place of every point.
    ///
    /// Round splats under a placement that keeps shapes stay round. Else they become ellipses; their normals and sizes
    /// must be known for that (see [`crate::prepare`]).
    pub fn place(&mut self, to_world: &DAffine3) {
        if *to_world == DAffine3::IDENTITY {
            return;
        }
        let linear = to_world.matrix3;
        let scale = scale_of(&linear);
        if scale.is_none() {
            self.make_elliptical();
        }
        let worlds: Vec<DVec3> =
            (0..self.len()).map(|index| to_world.transform_point3(self.world_position(index))).collect();
        let Cloud { origin, positions, .. } = Cloud::from_points(&worlds);
        (self.origin, self.positions) = (origin, positions);
        // Areas grow with the volume, divided by the growth along the normal.
        let cofactors = linear.inverse().transpose();
        let determinant = linear.determinant().abs();
        if let Some(areas) = &mut self.areas {
            for (index, area) in areas.iter_mut().enumerate() {
                let growth = match (scale, self.normals.get(index)) {
                    (None, Some(normal)) => {
                        determinant * (cofactors * normal.as_dvec3().normalize_or_zero()).length()
                    }
                    _ => libm::cbrt(determinant * determinant),
                };
                *area = (f64::from(*area) * growth) as f32;
            }
        }
        if let Some(harmonics) = &mut self.harmonics {
            harmonics.turn(&linear);
        }
        for normal in &mut self.normals {
            *normal = (cofactors * normal.as_dvec3()).normalize_or_zero().as_vec3();
        }
        match (&mut self.shapes, scale) {
            (Shapes::Discs(sizes), Some(scale)) => sizes.iter_mut().for_each(|size| *size *= scale as f32),
            (Shapes::Discs(_), None) => {}
            (Shapes::Ellipses(axes), _) => {
                axes.iter_mut().flatten().for_each(|axis| *axis = (linear * axis.as_dvec3()).as_vec3());
            }
        }
    }

    /// Turns round splats into ellipses of the same extent, so that the cloud can be joined with one of ellipses.
    /// Splats without a normal or a size become defects.
    pub fn make_elliptical(&mut self) {
        if matches!(self.shapes, Shapes::Ellipses(_)) {
            return;
        }
        let ellipse = |index: usize| -> [Vec3; 2] {
            let normal = self.normals.get(index).copied().unwrap_or_default().as_dvec3().normalize_or_zero();
            world_axes(self, index, normal).map(|axis| axis.as_vec3())
        };
        self.shapes = Shapes::Ellipses((0..self.len()).map(ellipse).collect());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SphericalHarmonics;
    use approx::assert_relative_eq;

    fn disc() -> Cloud {
        let mut cloud = Cloud::from_points(&[DVec3::new(1.0, 2.0, 3.0)]);
        cloud.normals = vec![Vec3::Z];
        cloud.shapes = Shapes::Discs(vec![0.5]);
        cloud.areas = Some(vec![2.0]);
        cloud
    }

    #[test]
    fn a_cloud_that_is_turned_and_scaled_keeps_its_shape() {
        let mut cloud = disc();
        let turn = DMat3::from_rotation_x(std::f64::consts::FRAC_PI_2);
        cloud.place(&DAffine3 { matrix3: turn * 3.0, translation: DVec3::new(1e6, 0.0, 0.0) });
        assert!(cloud.world_position(0).abs_diff_eq(DVec3::new(1e6 + 3.0, -9.0, 6.0), 1e-6));
        assert_eq!(cloud.origin, cloud.world_position(0), "far from zero the origin moves along");
        assert!(cloud.normals[0].abs_diff_eq(-Vec3::Y, 1e-6));
        assert_eq!(cloud.shapes, Shapes::Discs(vec![1.5]));
        assert_relative_eq!(cloud.areas.unwrap()[0], 18.0, max_relative = 1e-6);
    }

    #[test]
    fn a_cloud_that_is_stretched_gets_ellipses() {
        let mut cloud = disc();
        cloud.place(&DAffine3::from_scale(DVec3::new(2.0, 1.0, 5.0)));
        let Shapes::Ellipses(axes) = &cloud.shapes else { panic!("{cloud:?}") };
        let [t1, t2] = axes[0];
        // The disc of radius 0.5 becomes an ellipse of semi-axes 1 and 0.5 in the plane of z.
        assert_relative_eq!(t1.cross(t2).length(), 0.5, max_relative = 1e-6);
        let covariance = [t1.x * t1.x + t2.x * t2.x, t1.y * t1.y + t2.y * t2.y, t1.z.abs() + t2.z.abs()];
        assert!(Vec3::from(covariance).abs_diff_eq(Vec3::new(1.0, 0.25, 0.0), 1e-6));
        assert_relative_eq!(cloud.areas.as_ref().unwrap()[0], 4.0, max_relative = 1e-6);
        assert_eq!(cloud.normals[0], Vec3::Z);
    }

    #[test]
    fn colours_by_direction_go_along_once() {
        let mut cloud = disc();
        let terms = vec![Vec3::ZERO, Vec3::ZERO, Vec3::ONE, Vec3::ZERO];
        cloud.harmonics = Some(SphericalHarmonics::new(1, terms).unwrap());
        let before = cloud.harmonics.as_ref().unwrap().color(0, Vec3::Z);
        let turn = DMat3::from_rotation_x(std::f64::consts::FRAC_PI_2);
        cloud.place(&DAffine3::from_mat3(turn));
        let after = cloud.harmonics.as_ref().unwrap().color(0, (turn * DVec3::Z).as_vec3());
        assert_relative_eq!(after[0], before[0], max_relative = 1e-6);
    }

    #[test]
    fn a_mirror_keeps_the_outside_outside() {
        let mut cloud = disc();
        cloud.place(&DAffine3::from_scale(DVec3::new(1.0, 1.0, -1.0)));
        assert_eq!(cloud.normals[0], -Vec3::Z);
        assert_eq!(cloud.shapes, Shapes::Discs(vec![0.5]));
        let mut sheared = disc();
        sheared.normals = vec![Vec3::X];
        // x' = x + y: the plane of constant x leans; its normal stays perpendicular to it.
        let shear = DMat3::from_cols(DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Z);
        sheared.place(&DAffine3::from_mat3(shear));
        assert!(sheared.normals[0].abs_diff_eq(Vec3::new(1.0, -1.0, 0.0).normalize(), 1e-6));
        assert_eq!(scale_of(&shear), None);
        assert_relative_eq!(
            scale_of(&(DMat3::from_rotation_y(0.3) * -2.5)).unwrap(),
            2.5,
            max_relative = 1e-12
        );
    }
}
