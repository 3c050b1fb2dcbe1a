//! Normals by principal component analysis of the neighbourhood.

use super::Neighbors;
use crate::Cloud;
use glam::{DMat3, DVec3, Vec3};

/// The neighbour that bounds a point's neighbourhood.
const NEIGHBOR: usize = 12;

/// The unit normal of each finite point: the direction in which its neighbours spread least. Its sign says nothing.
pub fn estimate(cloud: &Cloud, neighbors: &Neighbors) -> Vec<Vec3> {
    let mut normals = vec![Vec3::ZERO; cloud.len()];
    for (index, point) in neighbors.points() {
        let radius = neighbors.distance_to(point, NEIGHBOR);
        let mut offsets: Vec<DVec3> = neighbors
            .within(point, radius * (1.0 + f64::EPSILON))
            .map(|neighbor| cloud.positions[neighbor].as_dvec3() - DVec3::from(point))
            .collect();
        // Sorted, so that the sums do not depend on the order of the points.
        offsets
            .sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z)));
        normals[index] = least_axis(covariance(&offsets)).as_vec3();
    }
    normals
}

/// The covariance matrix of some points, not divided by their number.
fn covariance(points: &[DVec3]) -> DMat3 {
    let mean = points.iter().sum::<DVec3>() / points.len().max(1) as f64;
    points.iter().fold(DMat3::ZERO, |sum, &point| {
        let d = point - mean;
        sum + DMat3::from_cols(d * d.x, d * d.y, d * d.z)
    })
}

/// The unit eigenvector of the least eigenvalue of a symmetric matrix, by Jacobi's rotations.
fn least_axis(mut matrix: DMat3) -> DVec3 {
    let mut axes = DMat3::IDENTITY;
    // Each sweep squares what is left off the diagonal; six are more than enough for `f64`.
    for _ in 0..6 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let off = matrix.col(q)[p];
            if off == 0.0 {
                continue;
            }
            let theta = (matrix.col(q)[q] - matrix.col(p)[p]) / (2.0 * off);
            let t = 1.0f64.copysign(theta) / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let mut rotation = DMat3::IDENTITY;
            rotation.col_mut(p)[p] = c;
            rotation.col_mut(q)[q] = c;
            rotation.col_mut(q)[p] = t * c;
            rotation.col_mut(p)[q] = -t * c;
            matrix = rotation.transpose() * matrix * rotation;
            axes *= rotation;
        }
    }
    let least = (0..3).min_by(|&i, &j| matrix.col(i)[i].total_cmp(&matrix.col(j)[j])).unwrap_or(2);
    axes.col(least)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_axis_of_a_rotated_ellipsoid_is_found() {
        for seed in 0..20 {
            let rotation =
                DMat3::from_euler(glam::EulerRot::XYZ, f64::from(seed), 0.7 * f64::from(seed), 2.0);
            let matrix = rotation * DMat3::from_diagonal(DVec3::new(3.0, 0.01, 7.0)) * rotation.transpose();
            let axis = least_axis(matrix);
            approx::assert_relative_eq!(axis.dot(rotation.y_axis).abs(), 1.0, max_relative = 1e-12);
        }
    }
}
