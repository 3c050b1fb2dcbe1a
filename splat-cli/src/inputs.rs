//! The clouds and meshes of the command line, read and joined into one cloud.

use crate::arguments::DEFAULT_POINTS;
use crate::arguments::ReadArguments;
use crate::memory::Memory;
use crate::strict;
use crate::values::Classes;
use anyhow::{Context, bail, ensure};
use splat_core::Cloud;
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
    /// Whether what would be passed over is an error.
    pub strict: bool,
    /// How much memory may be used.
    pub memory: Memory,
}

impl Reading {
    /// What the options ask for.
    pub fn new(sampling: Sampling, with_faces: bool, arguments: &ReadArguments, memory: Memory) -> Self {
        let columns = arguments.columns.as_ref().map(|columns| columns.0.clone());
        Self {
            sampling,
            with_faces,
            cloud: CloudOptions { columns },
            classes: arguments.classes.clone(),
            strict: arguments.strict,
            memory,
        }
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
    let (clouds, reports): (Vec<Cloud>, _) =
        imports.into_iter().map(|import| (import.cloud, import.report)).unzip();
    if clouds.len() > 1 {
        reading.memory.check_copy(&clouds)?;
    }
    Ok((Cloud::join(clouds)?, reports))
}

/// Reads a cloud, or a mesh as a cloud, and picks the classes that are wanted.
///
/// # Errors
/// What the reader says; a mesh without an area; a cloud without classes; what a strict reading refuses.
pub fn read_one(path: &Path, reading: &Reading, progress: &mut dyn FnMut(f64)) -> anyhow::Result<Import> {
    let mut import = read_all(path, reading, progress)?;
    if reading.strict {
        strict::check_import(&mut import)?;
    }
    if let Some(classes) = &reading.classes {
        // Class 0 is what was never classified.
        let field = import.cloud.field("classification");
        ensure!(
            field.is_some() || classes.has(0.0),
            "{}: --classes: the points have no classification",
            path.display()
        );
        let class = |index: usize| field.map_or(0.0, |field| field.values[index]);
        let kept: Vec<usize> = (0..import.cloud.len()).filter(|&index| classes.has(class(index))).collect();
        ensure!(
            !kept.is_empty() || import.cloud.is_empty(),
            "{}: --classes: no point is of these classes, there are {}",
            path.display(),
            classes_of(&import.cloud)
        );
        reading.memory.check_copy([&import.cloud])?;
        import.cloud = import.cloud.only(&kept);
    }
    Ok(import)
}

/// Whether a file is an OBJ mesh, by its name.
pub fn is_obj(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj"))
}

/// The classes of a cloud's points, in words.
fn classes_of(cloud: &Cloud) -> String {
    let values = cloud.field("classification").map_or(&[][..], |field| &field.values);
    let mut classes: Vec<String> = values.iter().map(ToString::to_string).collect();
    classes.sort_unstable();
    classes.dedup();
    if classes.is_empty() { "none".to_owned() } else { classes.join(", ") }
}

/// Reads a cloud, or a mesh as a cloud.
fn read_all(path: &Path, reading: &Reading, progress: &mut dyn FnMut(f64)) -> anyhow::Result<Import> {
    if is_obj(path) {
        reading.memory.check_file(path, Some(reading.sampling.points))?;
        sampled(read_obj(path)?, reading.sampling, progress)
    } else if reading.with_faces && cloud_format(path)? == CloudFormat::Ply && ply_has_faces(path)? {
        reading.memory.check_file(path, Some(reading.sampling.points))?;
        sampled(read_ply_mesh(path)?, reading.sampling, progress)
    } else {
        reading.memory.check_file(path, None)?;
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
    report.losses.extend(strict::without_area(&mesh, skipped));
    report.losses.extend(strict::without_texture(&mesh, without_texture));
    if skipped > 0 {
        report.assumptions.push(format!("{skipped} triangles without an area are skipped"));
    }
    if without_texture > 0 {
        report.assumptions.push(format!("{without_texture} surfels without texture coordinates have (0, 0)"));
    }
    Ok(Import { cloud, report })
}

/// Checks that at least one splat of a prepared cloud can be rendered.
///
/// # Errors
/// A sentence that counts the defects.
pub fn check_usable(cloud: &Cloud, reports: &[ImportReport]) -> anyhow::Result<()> {
    let names = crate::describe::paths(reports);
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
    use glam::{DVec3, Vec3};
    use splat_core::Shapes;

    #[test]
    fn a_cloud_without_a_usable_point_is_refused() {
        assert!(check_usable(&Cloud::default(), &[]).unwrap_err().to_string().contains("empty"));
        let mut bad = Cloud::from_points(&[DVec3::ZERO; 3]);
        bad.normals = vec![Vec3::Z; 3];
        bad.shapes = Shapes::Discs(vec![-1.0, f32::NAN, -1.0]);
        let message = check_usable(&bad, &[]).unwrap_err().to_string();
        assert!(message.ends_with("(2 negative_size, 1 not_finite)"), "{message}");
        bad.shapes = Shapes::Discs(vec![1.0, f32::NAN, -1.0]);
        assert!(check_usable(&bad, &[]).is_ok());
    }
}
