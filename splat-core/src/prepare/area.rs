//! The area that each splat stands for: SPEC section 4.

use super::{Neighbors, PrepareOptions};
use crate::setup::{InverseShape, splat_area};
use crate::{Cloud, Shapes};
use glam::DVec3;

/// Binary digits of the fixed-point sums, relative to the largest possible term: integers add up to the same sum in
/// any order, and 2^40 splats of the largest weight fit.
const FRACTION: f64 = (1u128 << 80) as f64;

/// area_i = 1 / sum_j k_j(p_i) / (|T1 x T2|_j I), over the neighbours on the same side of the surface: the weights at
/// each splat's centre then sum to about 1, whatever the density. 0 where a splat has a defect.
pub fn estimate(cloud: &Cloud, neighbors: &Neighbors, options: &PrepareOptions) -> Vec<f32> {
    let radius = options.cutoff.sqrt();
    let integral = options.kernel.integral(options.cutoff);
    let fit: Vec<bool> = (0..cloud.len()).map(|index| cloud.defect(index).is_none()).collect();
    let inverse_area = |index: usize| 1.0 / (splat_area(cloud, index) * integral);
    let largest = (0..cloud.len()).filter(|&index| fit[index]).map(inverse_area).fold(0.0, f64::max);

    let mut sums = vec![0u128; cloud.len()];
    for (j, point) in neighbors.points().filter(|&(j, _)| fit[j]) {
        let shape = InverseShape::new(cloud, j);
        let scale = inverse_area(j) / largest * FRACTION;
        for i in neighbors.within(point, radius * reach(cloud, j)) {
            let same_side = !cloud.oriented || cloud.normals[i].dot(cloud.normals[j]) > 0.0;
            if fit[i] && same_side {
                let offset = cloud.positions[i].as_dvec3() - DVec3::from(point);
                let value = options.kernel.value(shape.r2(offset), options.cutoff);
                sums[i] += (value * scale) as u128;
            }
        }
    }
    let area = |sum: u128| if sum == 0 { 0.0 } else { (FRACTION / largest / sum as f64) as f32 };
    sums.into_iter().map(area).collect()
}

/// The longest axis of a splat, in scene units per sigma.
fn reach(cloud: &Cloud, index: usize) -> f64 {
    match &cloud.shapes {
        Shapes::Discs(sizes) => f64::from(sizes[index]),
        // An upper bound for axes that are not perpendicular.
        Shapes::Ellipses(axes) => {
            let [t1, t2] = axes[index].map(|axis| axis.as_dvec3());
            t1.length().hypot(t2.length())
        }
    }
}
