//! From the numbers of trained Gaussian splats to surfels.

use glam::{DMat3, DQuat, DVec3, Vec3};
use splat_core::harmonics::{CONSTANT, terms};
use splat_core::srgb::decode;
use splat_core::{Cloud, Shapes, SphericalHarmonics};
use std::collections::TryReserveError;

/// A trained splat, after its activations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Gaussian {
    /// World position, in scene units.
    pub position: DVec3,
    /// Standard deviations along the columns of the rotation, in scene units. The third is 0 where the splat is flat.
    pub scales: [f64; 3],
    /// Rotation: a quaternion w, x, y, z of any length but 0.
    pub rotation: [f64; 4],
    /// Opacity at the centre, 0 to 1.
    pub opacity: f64,
}

/// The cloud of trained splats, half read.
pub(crate) struct Gaussians {
    degree: usize,
    positions: Vec<DVec3>,
    normals: Vec<Vec3>,
    axes: Vec<[Vec3; 2]>,
    colors: Vec<Vec3>,
    opacities: Vec<f32>,
    coefficients: Vec<Vec3>,
}

impl Gaussians {
    /// Makes room for so many splats with harmonics of this degree, 0 to 3.
    pub fn with_room(count: usize, degree: usize) -> Result<Self, TryReserveError> {
        fn room<T>(count: usize) -> Result<Vec<T>, TryReserveError> {
            let mut column = Vec::new();
            column.try_reserve_exact(count)?;
            Ok(column)
        }
        Ok(Self {
            degree,
            positions: room(count)?,
            normals: room(count)?,
            axes: room(count)?,
            colors: room(count)?,
            opacities: room(count)?,
            coefficients: room(if degree > 0 { count.saturating_mul(terms(degree)) } else { 0 })?,
        })
    }

    /// Adds a splat, with the coefficients of its colour, the constant one first.
    pub fn push(&mut self, gaussian: &Gaussian, coefficients: &[Vec3]) {
        let (normal, axes) = surfel(gaussian.scales, gaussian.rotation);
        self.positions.push(gaussian.position);
        self.normals.push(normal);
        self.axes.push(axes);
        self.opacities.push(gaussian.opacity as f32);
        let base = (0.5 + CONSTANT * coefficients[0]).max(Vec3::ZERO);
        self.colors.push(Vec3::from_array(base.to_array().map(|value| decode(value.into()) as f32)));
        if self.degree > 0 {
            self.coefficients.extend_from_slice(&coefficients[..terms(self.degree)]);
        }
    }

    /// The cloud.
    pub fn finish(self) -> Cloud {
        let harmonics = (self.degree > 0).then(|| SphericalHarmonics::new(self.degree, self.coefficients));
        Cloud {
            normals: self.normals,
            shapes: Shapes::Ellipses(self.axes),
            colors: Some(self.colors),
            harmonics: harmonics.and_then(Result::ok),
            opacities: Some(self.opacities),
            trained: true,
            ..Cloud::from_points(&self.positions)
        }
    }

    /// What is assumed of all trained splats, a sentence each.
    pub fn assumptions(&self, flat: bool) -> Vec<String> {
        let shape = if flat {
            "trained splats (2D): their third axis is the normal"
        } else {
            "trained splats: the shortest axis of each is dropped, and is the normal of the disc that is left"
        };
        let color = match self.degree {
            0 => "colours do not depend on the view".to_owned(),
            degree => format!("colours depend on the view: spherical harmonics of degree {degree}"),
        };
        vec![shape.to_owned(), color]
    }
}

/// The normal and the sigma-scaled axes of the disc that is left of an ellipsoid without its shortest axis (of equal ones, the
/// first). The normal is their cross product.
///
/// Without a rotation (a quaternion of zeros) the normal is zero, and with a value that is not finite it is not a number:
/// the renderer drops either.
fn surfel(scales: [f64; 3], [w, x, y, z]: [f64; 4]) -> (Vec3, [Vec3; 2]) {
    let rotation = DQuat::from_xyzw(x, y, z, w);
    let length = rotation.length();
    if length == 0.0 {
        return (Vec3::ZERO, [Vec3::ZERO; 2]);
    }
    if !length.is_finite() || !scales.iter().all(|scale| scale.is_finite()) {
        return (Vec3::NAN, [Vec3::NAN; 2]);
    }
    let columns = DMat3::from_quat(rotation / length);
    let shorter = |least: usize, axis: usize| if scales[axis] < scales[least] { axis } else { least };
    let normal = [1, 2].into_iter().fold(0, shorter);
    let axis = |axis: usize| (columns.col(axis % 3) * scales[axis % 3]).as_vec3();
    (columns.col(normal).as_vec3(), [axis(normal + 1), axis(normal + 2)])
}

/// The opacity of a trained value: the logistic function.
pub(crate) fn sigmoid(value: f64) -> f64 {
    1.0 / (1.0 + libm::exp(-value))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::EulerRot;

    #[test]
    fn the_shortest_axis_is_the_normal_and_the_others_turn_right() {
        let turned = DQuat::from_euler(EulerRot::XYZ, 0.3, -1.2, 2.0);
        let rotation = [turned.w, turned.x, turned.y, turned.z].map(|value| -3.0 * value);
        let columns = DMat3::from_quat(turned);
        for (scales, normal) in [
            ([1.0, 2.0, 3.0], 0),
            ([2.0, 1.0, 3.0], 1),
            ([2.0, 3.0, 1.0], 2),
            ([2.0, 3.0, 0.0], 2),
            ([1.0, 1.0, 1.0], 0),
            ([1.0, 1.0, 3.0], 0),
            ([3.0, 1.0, 1.0], 1),
        ] {
            let (n, [t1, t2]) = surfel(scales, rotation);
            assert!((n.as_dvec3() - columns.col(normal)).length() < 1e-6, "{scales:?}");
            assert!(t1.cross(t2).normalize().distance(n) < 1e-6);
            let covariance = |direction: DVec3| {
                [t1, t2].iter().map(|axis| axis.as_dvec3().dot(direction).powi(2)).sum::<f64>()
            };
            for (axis, scale) in scales.into_iter().enumerate() {
                let expected = if axis == normal { 0.0 } else { scale };
                assert!((covariance(columns.col(axis)).sqrt() - expected).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn what_has_no_shape_is_a_defect() {
        let one = [1.0, 0.0, 0.0, 0.0];
        let cases = [
            ([1.0, 1.0, 1.0], [0.0; 4], "zero_normal"),
            ([1.0, 0.0, 0.0], one, "zero_normal"),
            ([f64::INFINITY, 1.0, 1.0], one, "not_finite"),
            ([1.0, 1.0, f64::NAN], one, "not_finite"),
            ([1.0, 1.0, 1.0], [f64::NAN, 0.0, 0.0, 0.0], "not_finite"),
            ([1e300, 1e300, 1.0], one, "not_finite"),
        ];
        for (scales, rotation, cause) in cases {
            let mut splats = Gaussians::with_room(1, 0).unwrap();
            splats.push(&Gaussian { position: DVec3::ZERO, scales, rotation, opacity: 1.0 }, &[Vec3::ZERO]);
            let cloud = splats.finish();
            assert_eq!(cloud.defect(0).map(|defect| defect.name()), Some(cause), "{scales:?} {rotation:?}");
        }
    }

    #[test]
    fn opacities_stay_within_0_and_1() {
        assert_eq!([sigmoid(0.0), sigmoid(1e4), sigmoid(-1e4)], [0.5, 1.0, 0.0]);
        assert!((sigmoid(1.0) - 0.731_058_578_630_004_9).abs() < 1e-15);
        assert!(sigmoid(f64::NAN).is_nan());
    }
}
