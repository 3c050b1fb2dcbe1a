//! The area that each splat stands for: SPEC section 4.

use super::PrepareOptions;
use super::neighbors::{BLOCK, Neighbors};
use crate::setup::{InverseShape, splat_area};
use crate::{Cloud, Shapes};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Binary digits of the fixed-point sums, relative to the largest possible term: integers add up to the same sum in
/// any order, and 2^40 splats of the largest weight fit.
const FRACTION: f64 = (1u128 << 80) as f64;

/// Terms that are kept at once, 32 bytes each.
const MOST_TERMS: usize = 1 << 21;

/// area_i = 1 / sum_j s_ij k_j(p_i) / (|T1 x T2|_j I): the weights at each splat's centre then sum to about 1,
/// whatever the density. 0 where a splat has a defect.
///
/// Two choices keep crests and thin walls closed. k_j takes the distance in space, not the shorter one along the
/// plane of j: it is nearer to the distance along a bent surface. And s_ij = (1 + n_i.n_j) / 2 lets neighbours count
/// less the more they turn away, down to nothing on the other side (1 where normals tell no sides). On the dragon and
/// the bunny this leaves a tenth of the holes that distances along the plane and a sharp change of sides leave
/// (ARCHITECTURE.md, "Areas").
///
/// `progress` is told the share done, 0 to 1.
pub fn estimate(
    cloud: &Cloud,
    neighbors: &Neighbors,
    options: &PrepareOptions,
    progress: &mut dyn FnMut(f64),
) -> Vec<f32> {
    let integral = options.kernel.integral(options.cutoff);
    let fit: Vec<bool> = (0..cloud.len()).map(|index| cloud.defect(index).is_none()).collect();
    let inverse_area = |index: usize| 1.0 / (splat_area(cloud, index) * integral);
    let largest = (0..cloud.len()).filter(|&index| fit[index]).map(inverse_area).fold(0.0, f64::max);

    // What the splats of a place add to the sums of others; nothing once there are too many of several places.
    let terms = |place: usize, room: Option<&AtomicUsize>| -> Option<Vec<(usize, u128)>> {
        let mut terms = Vec::new();
        for j in neighbors.members(place).filter(|&j| fit[j]) {
            let shape = InverseShape::new(cloud, j);
            let scale = inverse_area(j) / largest * FRACTION;
            for near in neighbors.within(place, options.cutoff.sqrt() * reach(cloud, j)) {
                let r2 = shape.r2(neighbors.place(near) - neighbors.place(place));
                let value = options.kernel.value(r2, options.cutoff);
                let term = |i| (i, (value * same_side(cloud, i, j) * scale) as u128);
                let before = terms.len();
                terms.extend(neighbors.members(near).filter(|&i| fit[i]).map(term));
                let count = terms.len() - before;
                if room.is_some_and(|room| room.fetch_add(count, Ordering::Relaxed) > MOST_TERMS) {
                    return None;
                }
            }
        }
        Some(terms)
    };
    let mut sums = vec![0u128; cloud.len()];
    let (mut start, mut places) = (0, BLOCK);
    while start < neighbors.len() {
        let end = neighbors.len().min(start + places);
        let (room, is_block) = (AtomicUsize::new(0), places > 1);
        let room = is_block.then_some(&room);
        let found: Option<Vec<_>> = (start..end).into_par_iter().map(|place| terms(place, room)).collect();
        // Splats much larger than their spacing reach very many places: then fewer at once.
        let Some(found) = found else {
            places = places.div_ceil(2);
            continue;
        };
        found.into_iter().flatten().for_each(|(index, term)| sums[index] += term);
        (start, places) = (end, BLOCK.min(2 * places));
        progress(end as f64 / neighbors.len() as f64);
    }
    let area = |sum: u128| if sum == 0 { 0.0 } else { (FRACTION / largest / sum as f64) as f32 };
    sums.into_iter().map(area).collect()
}

/// How much two neighbours belong to the same side of a surface, in [0, 1].
fn same_side(cloud: &Cloud, i: usize, j: usize) -> f64 {
    if !cloud.oriented {
        return 1.0;
    }
    let [a, b] = [i, j].map(|index| cloud.normals[index].as_dvec3());
    // The product of f32 unit vectors can exceed 1 by rounding.
    (0.5 + 0.5 * a.dot(b)).clamp(0.0, 1.0)
}

/// The longest axis of a splat, in scene units per sigma.
fn reach(cloud: &Cloud, index: usize) -> f64 {
    match &cloud.shapes {
        Shapes::Discs(sizes) => f64::from(sizes[index]),
        // An upper bound for axes that are not perpendicular.
        Shapes::Ellipses(axes) => {
            let [t1, t2] = axes[index].map(|axis| axis.as_dvec3());
            (t1.length_squared() + t2.length_squared()).sqrt()
        }
    }
}
