//! `--strict`: what is passed over otherwise, and counted, is an error.

use crate::describe;
use anyhow::ensure;
use glam::Vec3;
use splat_core::{Cloud, Defect};
use splat_io::mesh::NO_INDEX;
use splat_io::{Import, ImportReport, Loss, Mesh};
use std::collections::BTreeMap;

/// Checks that all of a file can be used as it is.
///
/// # Errors
/// A sentence that says what cannot, how many of it, and where the first is.
pub fn check_import(import: &mut Import) -> anyhow::Result<()> {
    let losses = [&import.report.losses[..], &defects(&mut import.cloud, false)].concat();
    check(&import.report, &losses)
}

/// Checks that there are no losses.
///
/// # Errors
/// As [`check_import`].
pub fn check(report: &ImportReport, losses: &[Loss]) -> anyhow::Result<()> {
    ensure!(losses.is_empty(), "{}: --strict: {}", report.path.display(), in_words(losses));
    Ok(())
}

/// The triangles of a mesh that have no area, so many of them.
pub fn without_area(mesh: &Mesh, count: usize) -> Option<Loss> {
    let first = (0..mesh.triangles.len()).find(|&triangle| mesh.triangle_area(triangle).is_none());
    Loss::new("triangles without an area", count as u64, format!("triangle {}", first.unwrap_or_default()))
}

/// The surfels on a mesh that have no texture coordinates, so many of them, by the first triangle without.
pub fn without_texture(mesh: &Mesh, surfels: usize) -> Option<Loss> {
    let has_texture = |corners: &[u32; 3]| !corners.contains(&NO_INDEX);
    let first = mesh.texture_triangles.iter().position(|corners| !has_texture(corners)).unwrap_or_default();
    Loss::new("surfels without texture coordinates", surfels as u64, format!("in triangle {first}"))
}

/// Checks that every splat of a complete cloud can be rendered, outliers aside: whoever marks them wants them to go.
///
/// # Errors
/// As [`check_import`].
pub fn check_complete(cloud: &mut Cloud, reports: &[ImportReport]) -> anyhow::Result<()> {
    let losses = defects(cloud, true);
    ensure!(losses.is_empty(), "{}: --strict: {}", describe::paths(reports), in_words(&losses));
    Ok(())
}

/// Losses, one after the other.
fn in_words(losses: &[Loss]) -> String {
    losses.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

/// The points that can never be rendered, by cause. As long as a cloud is not complete, normals and sizes that are unknown
/// are none: they will be estimated.
fn defects(cloud: &mut Cloud, is_complete: bool) -> Vec<Loss> {
    let lacks_normals = cloud.normals.is_empty();
    if lacks_normals {
        cloud.normals = vec![Vec3::Z; cloud.len()];
    }
    let mut causes: BTreeMap<Defect, (u64, usize)> = BTreeMap::new();
    for (index, defect) in (0..cloud.len()).filter_map(|index| Some((index, cloud.defect(index)?))) {
        causes.entry(defect).or_insert((0, index)).0 += 1;
    }
    if lacks_normals {
        cloud.normals.clear();
    }
    let causes = causes.into_iter().filter(|&(defect, _)| {
        !matches!((defect, is_complete), (Defect::Outlier, _) | (Defect::UnknownSize, false))
    });
    causes
        .filter_map(|(defect, (count, first))| {
            Loss::new(format!("points {}", defect.name()), count, format!("point {first}"))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use splat_core::Shapes;

    #[test]
    fn what_is_dropped_is_said_with_its_place() {
        let mut cloud = Cloud::from_points(&[DVec3::ZERO, DVec3::NAN, DVec3::ONE, DVec3::NAN, DVec3::X]);
        assert_eq!(in_words(&defects(&mut cloud, false)), "2 points not_finite (the first: point 1)");
        assert!(cloud.normals.is_empty(), "as it was");
        cloud.shapes = Shapes::Discs(vec![1.0, 1.0, -1.0, 1.0, 0.0]);
        let words = in_words(&defects(&mut cloud, false));
        assert!(words.ends_with("1 points negative_size (the first: point 2)"), "{words}");
        let words = in_words(&defects(&mut cloud, true));
        assert!(words.ends_with("1 points unknown_size (the first: point 4)"), "{words}");
    }
}
