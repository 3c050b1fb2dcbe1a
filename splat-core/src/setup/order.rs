//! The first step of set-up: which splats are in the view, and in which order.

use super::{CameraSplat, Dropped, View, camera_splat, count_dropped, from_eye, shows_back};
use crate::{Cloud, RenderOptions, Shapes};
use glam::Vec3Swizzles;
use std::cmp::Ordering;
use std::ops::Range;

/// What splats are sorted by. Keys in their own order are in splat order but for ties, which [`splat_order`] breaks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct SortKey {
    /// The splat's nearest depth, as an integer of the same order.
    nearest: i64,
    /// The splat's index in the cloud.
    index: u32,
}

impl SortKey {
    /// The splat's nearest depth, in camera units.
    pub fn nearest(&self) -> f64 {
        f64::from_bits(ordered(self.nearest) as u64)
    }

    /// The splat's index in the cloud.
    pub fn index(&self) -> u32 {
        self.index
    }
}

/// The keys of those splats of a range that are without a defect, not culled and not clipped; and how many have a
/// defect.
pub fn sort_keys(
    cloud: &Cloud,
    view: &View,
    options: &RenderOptions,
    range: Range<usize>,
) -> (Vec<SortKey>, Dropped) {
    let (mut keys, mut dropped) = (Vec::new(), Dropped::new());
    for index in range {
        if let Some(defect) = cloud.defect(index) {
            count_dropped(&mut dropped, defect.name(), 1);
            continue;
        }
        let from_eye = from_eye(cloud, index, view);
        if options.cull && view.lens.is_none() && shows_back(cloud, index, from_eye, view) {
            continue;
        }
        // Without the splat's axes, which most cameras do not ask for here.
        let depth = view.linear.row(2).dot(from_eye);
        let half_depth = view.radius * view.steepness(cloud, index);
        if view.is_out_of_depth(depth, half_depth) {
            continue;
        }
        if (options.cull && view.lens.is_some()) || view.has_clip_planes() {
            let splat = camera_splat(cloud, index, view);
            if (options.cull && faces_away(&splat, view)) || view.is_clipped(&splat) {
                continue;
            }
        }
        let nearest = depth - half_depth;
        keys.push(SortKey { nearest: ordered(nearest.to_bits() as i64), index: index as u32 });
    }
    (keys, dropped)
}

/// The back-face cull (L49-52), corrected for the lens: no point of the aperture sees the front (erratum E21).
fn faces_away(splat: &CameraSplat, view: &View) -> bool {
    let no_point_sees_front =
        |radius: f64| radius * splat.normal.xy().length() < splat.normal.dot(splat.center);
    splat.back && view.lens.is_none_or(|lens| no_point_sees_front(lens.radius))
}

/// An integer for a float's bits, such that they compare as [`f64::total_cmp`] does; and back.
fn ordered(bits: i64) -> i64 {
    // Of negative values the greater magnitude is the less.
    if bits < 0 { bits ^ i64::MAX } else { bits }
}

/// The indices of sorted keys, in splat order: by nearest depth, then by the splat's own data, so that the order in the
/// file changes nothing.
pub fn splat_order(cloud: &Cloud, mut keys: Vec<SortKey>) -> Vec<u32> {
    for ties in keys.chunk_by_mut(|a, b| a.nearest == b.nearest).filter(|ties| ties.len() > 1) {
        ties.sort_unstable_by(|a, b| compare_data(cloud, a.index as usize, b.index as usize));
    }
    // In the memory of the keys.
    keys.into_iter().map(|key| key.index).collect()
}

/// Two splats by all that the cloud says of them.
fn compare_data(cloud: &Cloud, a: usize, b: usize) -> Ordering {
    compare(cloud.positions[a], cloud.positions[b])
        .then_with(|| compare(cloud.normals[a], cloud.normals[b]))
        .then_with(|| match &cloud.shapes {
            Shapes::Discs(sizes) => sizes[a].total_cmp(&sizes[b]),
            Shapes::Ellipses(axes) => {
                compare(axes[a][0], axes[b][0]).then_with(|| compare(axes[a][1], axes[b][1]))
            }
        })
        .then_with(|| cloud.colors.as_ref().map_or(Ordering::Equal, |c| compare(c[a], c[b])))
        .then_with(|| match &cloud.harmonics {
            Some(h) => {
                let pairs = h.of(a).iter().zip(h.of(b));
                pairs.map(|(a, b)| compare(*a, *b)).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
            }
            None => Ordering::Equal,
        })
        .then_with(|| cloud.opacities.as_ref().map_or(Ordering::Equal, |o| o[a].total_cmp(&o[b])))
        .then_with(|| cloud.areas.as_ref().map_or(Ordering::Equal, |s| s[a].total_cmp(&s[b])))
        .then_with(|| {
            let coordinates = cloud.texture_coordinates.as_ref();
            coordinates.map_or(Ordering::Equal, |c| compare(c[a].to_array(), c[b].to_array()))
        })
        // Equal in everything: interchangeable in the picture, told apart only by the id.
        .then(a.cmp(&b))
}

/// A total order of vectors, component by component.
fn compare<const N: usize>(a: impl Into<[f32; N]>, b: impl Into<[f32; N]>) -> Ordering {
    let pairs = a.into().into_iter().zip(b.into());
    pairs.map(|(a, b)| a.total_cmp(&b)).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
}
