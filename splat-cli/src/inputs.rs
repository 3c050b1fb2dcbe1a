//! The clouds and meshes of the command line, read and joined into one cloud.

use crate::arguments::DEFAULT_POINTS;
use crate::arguments::ReadArguments;
use crate::values::Classes;
use anyhow::{Context, bail, ensure};
use glam::DVec3;
use splat_core::{Cloud, Field, Shapes};
use splat_io::{
    CloudFormat, CloudOptions, Import, ImportReport, MeshImport, Sampled, cloud_format, ply_has_faces,
    read_cloud, read_obj, read_ply_mesh, sample_surface,
};
use std::path::{Path, PathBuf};

/// How meshes become clouds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sampling {
    /// Surfels on each mesh.
    pub points: usize,
    /// Of their places.
    pub seed: u64,
}

impl Default for Sampling {
    fn default() -> Self {
        Self { points: DEFAULT_POINTS, seed: 0 }
    }
}

/// What files are read as.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reading {
    /// How meshes are sampled.
    pub sampling: Sampling,
    /// Whether a PLY file with faces is a mesh; else it is the cloud of its vertices.
    pub with_faces: bool,
    /// What a file may not say of itself.
    pub cloud: CloudOptions,
    /// The classes of points that are wanted; `None`: all.
    pub classes: Option<Classes>,
}

impl Reading {
    /// What the options ask for.
    pub fn new(sampling: Sampling, with_faces: bool, arguments: &ReadArguments) -> Self {
        let columns = arguments.columns.as_ref().map(|columns| columns.0.clone());
        Self { sampling, with_faces, cloud: CloudOptions { columns }, classes: arguments.classes.clone() }
    }
}

/// Reads clouds and meshes and joins them: the first file's splats come first. `progress` is told the share done, 0 to 1.
///
/// # Errors
/// What the readers say; meshes without an area; clouds that do not go together.
pub fn read(
    paths: &[PathBuf],
    reading: &Reading,
    progress: &mut dyn FnMut(f64),
) -> anyhow::Result<(Cloud, Vec<ImportReport>)> {
    let one = |(index, path): (usize, &PathBuf)| {
        read_one(path, reading, &mut |done| progress((index as f64 + done) / paths.len() as f64))
    };
    let imports: Vec<Import> = paths.iter().enumerate().map(one).collect::<anyhow::Result<_>>()?;
    let (clouds, reports): (Vec<Cloud>, Vec<ImportReport>) =
        imports.into_iter().map(|import| (import.cloud, import.report)).unzip();
    let named: Vec<(&Path, Cloud)> = reports.iter().map(|report| report.path.as_path()).zip(clouds).collect();
    let mut cloud = join(named)?;
    if let Some(classes) = &reading.classes {
        // Class 0 is what was never classified.
        let field = cloud.field("classification");
        ensure!(field.is_some() || classes.has(0.0), "--classes: the points have no classification");
        let class = |index: usize| field.map_or(0.0, |field| field.values[index]);
        let kept: Vec<usize> = (0..cloud.len()).filter(|&index| classes.has(class(index))).collect();
        cloud = only(&cloud, &kept);
    }
    Ok((cloud, reports))
}

/// The cloud of some of a cloud's splats.
fn only(cloud: &Cloud, kept: &[usize]) -> Cloud {
    fn pick<T: Copy>(values: &[T], kept: &[usize]) -> Vec<T> {
        if values.is_empty() { Vec::new() } else { kept.iter().map(|&index| values[index]).collect() }
    }
    let field = |field: &Field| Field { name: field.name.clone(), values: pick(&field.values, kept) };
    Cloud {
        origin: cloud.origin,
        positions: pick(&cloud.positions, kept),
        normals: pick(&cloud.normals, kept),
        shapes: match &cloud.shapes {
            Shapes::Discs(sizes) => Shapes::Discs(pick(sizes, kept)),
            Shapes::Ellipses(axes) => Shapes::Ellipses(pick(axes, kept)),
        },
        colors: cloud.colors.as_ref().map(|values| pick(values, kept)),
        opacities: cloud.opacities.as_ref().map(|values| pick(values, kept)),
        areas: cloud.areas.as_ref().map(|values| pick(values, kept)),
        texture_coordinates: cloud.texture_coordinates.as_ref().map(|values| pick(values, kept)),
        oriented: cloud.oriented,
        fields: cloud.fields.iter().map(field).collect(),
    }
}

/// Whether a file is an OBJ mesh, by its name.
pub fn is_obj(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj"))
}

/// Reads a cloud, or a mesh as a cloud.
fn read_one(path: &Path, reading: &Reading, progress: &mut dyn FnMut(f64)) -> anyhow::Result<Import> {
    if is_obj(path) {
        sampled(read_obj(path)?, reading.sampling, progress)
    } else if reading.with_faces && cloud_format(path)? == CloudFormat::Ply && ply_has_faces(path)? {
        sampled(read_ply_mesh(path)?, reading.sampling, progress)
    } else {
        Ok(read_cloud(path, &reading.cloud)?)
    }
}

/// A mesh as a cloud.
fn sampled(import: MeshImport, sampling: Sampling, progress: &mut dyn FnMut(f64)) -> anyhow::Result<Import> {
    let MeshImport { mesh, mut report } = import;
    let Sampled { cloud, area, skipped, without_texture } =
        sample_surface(&mesh, sampling.points, sampling.seed, progress)
            .with_context(|| report.path.display().to_string())?;
    let (points, triangles) = (cloud.len(), mesh.triangles.len());
    report
        .assumptions
        .push(format!("the mesh of {triangles} triangles, area {area}, is covered with {points} surfels"));
    report.assumptions.push(if mesh.normal_triangles.is_empty() {
        "counter-clockwise triangles are seen from outside".to_owned()
    } else {
        "the normals of vertices tell the outside; splats lie in their triangles".to_owned()
    });
    if skipped > 0 {
        report.assumptions.push(format!("{skipped} triangles without an area are skipped"));
    }
    if without_texture > 0 {
        report.assumptions.push(format!("{without_texture} surfels without texture coordinates have (0, 0)"));
    }
    Ok(Import { cloud, report })
}

/// Joins clouds, each with its name for messages.
///
/// All must have normals or none, colours or none, and the same kind of shape, since what one lacks cannot be
/// told from another. Missing opacities are opaque; areas, texture coordinates and scalar fields are kept only if every
/// cloud has them.
fn join(mut clouds: Vec<(&Path, Cloud)>) -> anyhow::Result<Cloud> {
    if clouds.len() > 1 {
        clouds.retain(|(_, cloud)| !cloud.is_empty());
    }
    if clouds.len() < 2 {
        return Ok(clouds.pop().map(|(_, cloud)| cloud).unwrap_or_default());
    }
    let worlds =
        clouds.iter().flat_map(|(_, cloud)| (0..cloud.len()).map(|index| cloud.world_position(index)));
    let mut joined = Cloud::from_points(&worlds.collect::<Vec<DVec3>>());
    let normals = |cloud: &Cloud| Some(cloud.normals.clone()).filter(|normals| !normals.is_empty());
    joined.normals = all_or_none(&clouds, "normals", normals)?.unwrap_or_default();
    joined.colors = all_or_none(&clouds, "colours", |cloud| cloud.colors.clone())?;
    if clouds.iter().any(|(_, cloud)| cloud.opacities.is_some()) {
        let opacities = |cloud: &Cloud| cloud.opacities.clone().unwrap_or_else(|| vec![1.0; cloud.len()]);
        joined.opacities = Some(clouds.iter().flat_map(|(_, cloud)| opacities(cloud)).collect());
    }
    joined.areas =
        clouds.iter().map(|(_, cloud)| cloud.areas.clone()).collect::<Option<Vec<_>>>().map(|a| a.concat());
    let coordinates = clouds.iter().map(|(_, cloud)| cloud.texture_coordinates.clone());
    joined.texture_coordinates = coordinates.collect::<Option<Vec<_>>>().map(|parts| parts.concat());
    let fields = clouds[0].1.fields.iter().filter_map(|Field { name, .. }| {
        let parts: Option<Vec<_>> =
            clouds.iter().map(|(_, cloud)| cloud.field(name).map(|field| field.values.as_slice())).collect();
        Some(Field { name: name.clone(), values: parts?.concat() })
    });
    joined.fields = fields.collect();
    joined.oriented = clouds.iter().all(|(_, cloud)| cloud.oriented);
    let discs = all_or_none(&clouds, "round splats", |cloud| match &cloud.shapes {
        Shapes::Discs(sizes) => Some(sizes.clone()),
        Shapes::Ellipses(_) => None,
    })?;
    let ellipses = all_or_none(&clouds, "elliptical splats", |cloud| match &cloud.shapes {
        Shapes::Discs(_) => None,
        Shapes::Ellipses(axes) => Some(axes.clone()),
    })?;
    joined.shapes =
        discs.map(Shapes::Discs).or(ellipses.map(Shapes::Ellipses)).context("clouds of no shape")?;
    Ok(joined)
}

/// One property of all clouds, one after the other; `None` if no cloud has it.
fn all_or_none<T: Clone>(
    clouds: &[(&Path, Cloud)],
    what: &str,
    property: impl Fn(&Cloud) -> Option<Vec<T>>,
) -> anyhow::Result<Option<Vec<T>>> {
    let with = clouds.iter().position(|(_, cloud)| property(cloud).is_some());
    let without = clouds.iter().position(|(_, cloud)| property(cloud).is_none());
    if let (Some(with), Some(without)) = (with, without) {
        let [with, without] = [with, without].map(|index| clouds[index].0.display());
        bail!(
            "{without}: found no {what}, expected some as in {with}: such clouds cannot be rendered as one"
        );
    }
    Ok(clouds
        .iter()
        .map(|(_, cloud)| property(cloud))
        .collect::<Option<Vec<_>>>()
        .map(|parts| parts.concat()))
}

/// Checks that at least one splat of a prepared cloud can be rendered.
///
/// # Errors
/// A sentence that counts the defects.
pub fn check_usable(cloud: &Cloud, reports: &[ImportReport]) -> anyhow::Result<()> {
    let names: Vec<String> = reports.iter().map(|report| report.path.display().to_string()).collect();
    let names = names.join(", ");
    ensure!(!cloud.is_empty(), "{names}: the cloud is empty");
    if (0..cloud.len()).any(|index| cloud.defect(index).is_none()) {
        return Ok(());
    }
    let mut causes = std::collections::BTreeMap::new();
    for defect in (0..cloud.len()).filter_map(|index| cloud.defect(index)) {
        *causes.entry(defect.name()).or_default() += 1;
    }
    bail!("{names}: no usable point in {} ({})", cloud.len(), crate::describe::causes(&causes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn cloud(at: DVec3, count: usize) -> Cloud {
        let points: Vec<DVec3> = (0..count).map(|i| at + DVec3::X * i as f64).collect();
        let mut cloud = Cloud::from_points(&points);
        cloud.normals = vec![Vec3::Z; count];
        cloud.oriented = true;
        cloud
    }

    fn joined(clouds: Vec<Cloud>) -> anyhow::Result<Cloud> {
        join(clouds.into_iter().map(|cloud| (Path::new("a.ply"), cloud)).collect())
    }

    #[test]
    fn clouds_are_joined_in_order_and_far_from_zero() {
        let (first, second) = (DVec3::new(5e5, 5e6, 0.0), DVec3::new(5e5, 5e6, 9.0));
        let field = |name: &str, values: &[f32]| Field { name: name.to_owned(), values: values.to_vec() };
        let mut other = cloud(second, 3);
        other.opacities = Some(vec![0.5; 3]);
        other.fields = vec![field("time", &[0.0; 3]), field("Intensity", &[3.0, 4.0, 5.0])];
        let mut one = cloud(first, 2);
        one.fields = vec![field("intensity", &[1.0, 2.0]), field("class", &[0.0; 2])];
        let all = joined(vec![one, other]).unwrap();
        assert_eq!(all.fields, [field("intensity", &[1.0, 2.0, 3.0, 4.0, 5.0])]);
        assert!(all.check_lengths().is_ok() && all.oriented);
        assert_eq!(all.world_position(1), first + DVec3::X);
        assert_eq!(all.world_position(2), second);
        assert_eq!(all.opacities, Some(vec![1.0, 1.0, 0.5, 0.5, 0.5]));
        assert_eq!(all.areas, None);
    }

    #[test]
    fn one_cloud_stays_what_it_is_and_empty_ones_say_nothing() {
        let one = cloud(DVec3::ONE, 2);
        assert_eq!(joined(vec![one.clone()]).unwrap(), one);
        assert_eq!(joined(vec![Cloud::default(), one.clone()]).unwrap(), one);
        assert_eq!(joined(vec![Cloud::default(), Cloud::default()]).unwrap(), Cloud::default());
    }

    #[test]
    fn some_of_a_cloud_is_a_cloud() {
        let mut whole = cloud(DVec3::new(5e5, 5e6, 0.0), 4);
        whole.colors = Some((0..4).map(|i| Vec3::splat(i as f32)).collect());
        whole.fields = vec![Field { name: "classification".to_owned(), values: vec![2.0, 7.0, 6.0, 18.0] }];
        let some = only(&whole, &[0, 2]);
        assert!(some.check_lengths().is_ok());
        assert_eq!(some.world_position(1), whole.world_position(2));
        assert_eq!(some.fields[0].values, [2.0, 6.0]);
        assert_eq!(only(&whole, &[0, 1, 2, 3]), whole);
    }

    #[test]
    fn clouds_that_do_not_go_together_are_refused() {
        let plain = cloud(DVec3::ZERO, 2);
        let coloured = Cloud { colors: Some(vec![Vec3::ONE; 2]), ..plain.clone() };
        let bare = Cloud { normals: Vec::new(), ..plain.clone() };
        let ellipses = Cloud { shapes: Shapes::Ellipses(vec![[Vec3::X, Vec3::Y]; 2]), ..plain.clone() };
        for (other, what) in [(coloured, "colours"), (bare, "normals"), (ellipses, "splats")] {
            let message = joined(vec![plain.clone(), other]).unwrap_err().to_string();
            assert!(message.contains(what), "{message}");
        }
    }

    #[test]
    fn a_cloud_without_a_usable_point_is_refused() {
        assert!(check_usable(&Cloud::default(), &[]).unwrap_err().to_string().contains("empty"));
        let mut bad = cloud(DVec3::ZERO, 3);
        bad.shapes = Shapes::Discs(vec![-1.0, f32::NAN, -1.0]);
        let message = check_usable(&bad, &[]).unwrap_err().to_string();
        assert!(message.ends_with("(2 negative_size, 1 not_finite)"), "{message}");
        bad.shapes = Shapes::Discs(vec![1.0, f32::NAN, -1.0]);
        assert!(check_usable(&bad, &[]).is_ok());
    }
}
