//! Normals by principal component analysis of the neighbourhood.

use glam::DVec3;

/// The unit direction in which the weighted offsets from a point spread least. Its sign says nothing.
///
/// A neighbour at the distance d of a neighbourhood of radius R weighs 1 - (d/R)^2, so that none matters that has only just
/// come in. The point itself, at offset 0, weighs 1.
pub fn least_spread(offsets: &[DVec3]) -> DVec3 {
    let square = offsets.iter().map(|offset| offset.length_squared()).fold(0.0, f64::max);
    // The farthest one weighs nothing; in a neighbourhood of few, it must.
    let bound = if offsets.len() > 3 { square } else { 2.0 * square };
    let weight = |offset: DVec3| if square > 0.0 { 1.0 - offset.length_squared() / bound } else { 1.0 };
    let mut total = 1.0;
    let mut mean = DVec3::ZERO;
    for &offset in offsets {
        total += weight(offset);
        mean += weight(offset) * offset;
    }
    mean /= total;
    let mut covariance = Symmetric::default();
    covariance.add(mean, 1.0);
    for &offset in offsets {
        covariance.add(offset - mean, weight(offset));
    }
    covariance.least_axis()
}

/// A symmetric matrix: xx, yy, zz, and xy, xz, yz.
#[derive(Debug, Clone, Copy, Default)]
struct Symmetric {
    diagonal: [f64; 3],
    /// Off the diagonal: element i is that of the two axes other than 2 - i.
    rest: [f64; 3],
}

impl Symmetric {
    /// Adds weight * v v^t.
    fn add(&mut self, v: DVec3, weight: f64) {
        let w = weight * v;
        for (value, product) in self.diagonal.iter_mut().zip((w * v).to_array()) {
            *value += product;
        }
        for (value, product) in self.rest.iter_mut().zip([w.x * v.y, w.x * v.z, w.y * v.z]) {
            *value += product;
        }
    }

    /// The unit eigenvector of the least eigenvalue, by Jacobi's rotations.
    fn least_axis(mut self) -> DVec3 {
        let mut axes = [DVec3::X, DVec3::Y, DVec3::Z];
        // Each sweep squares what is left off the diagonal; six are more than enough for `f64`.
        for _ in 0..6 {
            if self.rest == [0.0; 3] {
                break;
            }
            for (p, q) in [(0, 1), (0, 2), (1, 2)] {
                self.rotate(&mut axes, p, q);
            }
        }
        let least = (0..3).min_by(|&i, &j| self.diagonal[i].total_cmp(&self.diagonal[j])).unwrap_or(2);
        axes[least].normalize()
    }

    /// Turns the axes p < q so that their element vanishes.
    fn rotate(&mut self, axes: &mut [DVec3; 3], p: usize, q: usize) {
        let off = self.rest[p + q - 1];
        if off == 0.0 {
            return;
        }
        let theta = (self.diagonal[q] - self.diagonal[p]) / (2.0 * off);
        let t = 1.0f64.copysign(theta) / (theta.abs() + (theta * theta + 1.0).sqrt());
        let c = 1.0 / (t * t + 1.0).sqrt();
        let s = t * c;
        self.diagonal[p] -= t * off;
        self.diagonal[q] += t * off;
        self.rest[p + q - 1] = 0.0;
        let r = 3 - p - q;
        let (at_p, at_q) = (self.rest[p + r - 1], self.rest[q + r - 1]);
        self.rest[p + r - 1] = c * at_p - s * at_q;
        self.rest[q + r - 1] = s * at_p + c * at_q;
        (axes[p], axes[q]) = (c * axes[p] - s * axes[q], s * axes[p] + c * axes[q]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;

    #[test]
    fn the_least_axis_of_a_rotated_ellipsoid_is_found() {
        for seed in 0..20 {
            let rotation =
                DMat3::from_euler(glam::EulerRot::XYZ, f64::from(seed), 0.7 * f64::from(seed), 2.0);
            let mut matrix = Symmetric::default();
            matrix.add(rotation.x_axis, 3.0);
            matrix.add(rotation.y_axis, 0.01);
            matrix.add(rotation.z_axis, 7.0);
            approx::assert_relative_eq!(
                matrix.least_axis().dot(rotation.y_axis).abs(),
                1.0,
                max_relative = 1e-12
            );
        }
    }

    #[test]
    fn few_offsets_have_some_unit_normal() {
        let (x, y) = (DVec3::X, DVec3::Y);
        for offsets in
            [vec![], vec![DVec3::ZERO; 5], vec![x], vec![x, -x], vec![x, y], vec![1e-300 * x, 1e-300 * y]]
        {
            let normal = least_spread(&offsets);
            approx::assert_relative_eq!(normal.length(), 1.0, max_relative = 1e-12);
            assert!(offsets.iter().all(|offset| normal.dot(*offset).abs() < 1e-12), "{offsets:?}: {normal}");
        }
    }
}
