//! What is said of a cloud.

use crate::values::Columns;
use crate::{describe, strict};
use glam::{DVec3, Vec3};
use serde::Serialize;
use splat_core::prepare::unknown_sizes;
use splat_core::{Cloud, Field, Shapes, SphericalHarmonics};
use splat_io::{CloudOptions, Import, ImportReport, Usage, decimals, read_cloud};
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

/// What is said of a cloud.
#[derive(Debug, Serialize)]
pub struct Summary {
    file: PathBuf,
    format: String,
    bytes: u64,
    sha256: String,
    elements: Vec<Element>,
    points: usize,
    /// Points whose position is finite.
    finite: usize,
    /// Points that are never rendered, by cause.
    dropped: BTreeMap<&'static str, usize>,
    /// Least and greatest corner of the finite points.
    bounds: Option<[[f64; 3]; 2]>,
    diagonal: f64,
    /// World position that the points are stored relative to.
    origin: [f64; 3],
    normals: Option<Normals>,
    colors: bool,
    /// Degree of the spherical harmonics by which colours depend on the view.
    harmonics: Option<usize>,
    /// Whether they are trained Gaussian splats.
    trained: bool,
    /// Least and greatest.
    opacities: Option<[f32; 2]>,
    areas: bool,
    texture_coordinates: bool,
    sizes: Sizes,
    fields: Vec<FieldSummary>,
    assumptions: Vec<String>,
    /// What else is out of order in the file, and passed over or changed.
    losses: Vec<String>,
}

/// What is said of a scalar field.
#[derive(Debug, Serialize)]
struct FieldSummary {
    name: String,
    /// Least, mean and greatest of the finite values.
    range: Option<[f64; 3]>,
}

/// One table of the file.
#[derive(Debug, Serialize)]
struct Element {
    name: String,
    count: u64,
    is_points: bool,
    properties: Vec<Property>,
}

/// One column of a table.
#[derive(Debug, Serialize)]
struct Property {
    name: String,
    #[serde(rename = "type")]
    kind: String,
    used_as: String,
    #[serde(skip)]
    is_used: bool,
}

/// What is said of normals, which the reader has made unit vectors.
#[derive(Debug, Serialize)]
struct Normals {
    oriented: bool,
    unit: usize,
    zero: usize,
    not_finite: usize,
}

/// What is said of sizes: sigma, in scene units.
#[derive(Debug, Serialize)]
struct Sizes {
    shape: &'static str,
    known: usize,
    unknown: usize,
    /// Least, mean and greatest of the known ones.
    range: Option<[f64; 3]>,
}

impl Summary {
    /// Reads a cloud and sums it up.
    ///
    /// # Errors
    /// What the reader says; with `strict`, everything that is out of order.
    pub fn read(path: &Path, columns: Option<&Columns>, strict: bool) -> anyhow::Result<Self> {
        let options = CloudOptions { columns: columns.map(|columns| columns.0.clone()) };
        let mut import = read_cloud(path, &options)?;
        if strict {
            strict::check_import(&mut import)?;
        }
        let Import { cloud, report } = import;
        Ok(Self::new(cloud, report))
    }

    fn new(mut cloud: Cloud, report: ImportReport) -> Self {
        let mut assumptions = report.assumptions;
        assumptions.extend(describe::assumptions(&cloud));
        let elements = report.elements.into_iter().map(|element| Element {
            name: element.name,
            count: element.count,
            is_points: element.is_points,
            properties: element
                .properties
                .into_iter()
                .map(|property| Property {
                    name: property.name,
                    kind: property.kind,
                    used_as: property.usage.to_string(),
                    is_used: !matches!(property.usage, Usage::Unused(_)),
                })
                .collect(),
        });
        Self {
            file: report.path,
            format: report.format,
            bytes: report.bytes,
            sha256: report.sha256,
            elements: elements.collect(),
            points: cloud.len(),
            finite: cloud.positions.iter().filter(|position| position.is_finite()).count(),
            bounds: bounds(&cloud),
            diagonal: cloud.diagonal(),
            origin: cloud.origin.to_array(),
            normals: (!cloud.normals.is_empty()).then(|| normals(&cloud)),
            colors: cloud.colors.is_some(),
            harmonics: cloud.harmonics.as_ref().map(SphericalHarmonics::degree),
            trained: cloud.trained,
            opacities: cloud.opacities.as_deref().and_then(range),
            areas: cloud.areas.is_some(),
            texture_coordinates: cloud.texture_coordinates.is_some(),
            sizes: sizes(&cloud),
            fields: cloud.fields.iter().map(FieldSummary::new).collect(),
            dropped: dropped(&mut cloud),
            assumptions,
            losses: report.losses.iter().map(ToString::to_string).collect(),
        }
    }
}

impl FieldSummary {
    fn new(field: &Field) -> Self {
        let finite: Vec<f64> =
            field.values.iter().filter(|value| value.is_finite()).map(|&value| f64::from(value)).collect();
        Self { name: field.name.clone(), range: spread(&finite) }
    }
}

/// Least and greatest corner, with the decimals that the coordinates have.
fn bounds(cloud: &Cloud) -> Option<[[f64; 3]; 2]> {
    let (low, high) = cloud.bounds()?;
    let power = decimals(cloud).map(|decimals| 10_f64.powi(decimals));
    let rounded = |coordinate: f64| power.map_or(coordinate, |power| (coordinate * power).round() / power);
    Some([low, high].map(|corner| corner.to_array().map(rounded)))
}

fn normals(cloud: &Cloud) -> Normals {
    let count = |holds: fn(&Vec3) -> bool| cloud.normals.iter().filter(|&normal| holds(normal)).count();
    Normals {
        oriented: cloud.oriented,
        unit: count(|normal| normal.is_normalized()),
        zero: count(|&normal| normal == Vec3::ZERO),
        not_finite: count(|normal| !normal.is_finite()),
    }
}

fn sizes(cloud: &Cloud) -> Sizes {
    let (shape, sizes): (_, Vec<f64>) = match &cloud.shapes {
        Shapes::Discs(sizes) => ("discs", sizes.iter().map(|&size| f64::from(size)).collect()),
        Shapes::Ellipses(axes) => {
            let geometric_mean = |[u, v]: &[Vec3; 2]| u.as_dvec3().cross(v.as_dvec3()).length().sqrt();
            ("ellipses", axes.iter().map(geometric_mean).collect())
        }
    };
    let known: Vec<f64> = sizes.into_iter().filter(|&size| size.is_finite() && size > 0.0).collect();
    Sizes { shape, known: known.len(), unknown: unknown_sizes(cloud), range: spread(&known) }
}

/// Least, mean and greatest of numbers.
fn spread(values: &[f64]) -> Option<[f64; 3]> {
    let [low, high] = [f64::min, f64::max].map(|pick| values.iter().copied().reduce(pick));
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    low.zip(high).map(|(low, high)| [low, mean, high])
}

/// Least and greatest of the finite values.
fn range(values: &[f32]) -> Option<[f32; 2]> {
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    Some([finite().reduce(f32::min)?, finite().reduce(f32::max)?])
}

/// The points that can never be rendered, by cause. Normals and sizes that are unknown will be estimated, so
/// they are no cause; to that end they are filled in.
fn dropped(cloud: &mut Cloud) -> BTreeMap<&'static str, usize> {
    if cloud.normals.is_empty() {
        cloud.normals = vec![Vec3::Z; cloud.len()];
    }
    if let Shapes::Discs(sizes) = &mut cloud.shapes {
        sizes.iter_mut().filter(|size| **size == 0.0).for_each(|size| *size = 1.0);
    }
    let mut causes = BTreeMap::new();
    for defect in (0..cloud.len()).filter_map(|index| cloud.defect(index)) {
        *causes.entry(defect.name()).or_default() += 1;
    }
    causes
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "file         {}", self.file.display())?;
        writeln!(f, "format       {}, {} bytes", self.format, self.bytes)?;
        writeln!(f, "sha256       {}", self.sha256)?;
        for element in &self.elements {
            let is_used = element.properties.iter().any(|property| property.is_used);
            let role = match element.is_points {
                true => "the points",
                false if is_used => "used with the points",
                false => "not used",
            };
            writeln!(f, "element      {}: {} rows, {role}", element.name, element.count)?;
            for property in element.properties.iter().filter(|property| element.is_points || property.is_used)
            {
                writeln!(f, "  {:<10} {}: {}", property.kind, property.name, property.used_as)?;
            }
        }
        let causes =
            if self.dropped.is_empty() { "none".to_owned() } else { describe::causes(&self.dropped) };
        writeln!(f, "points       {}, of which finite: {}; bad: {causes}", self.points, self.finite)?;
        if let Some([low, high]) = self.bounds.map(|bounds| bounds.map(DVec3::from)) {
            writeln!(f, "from         {}, {}, {}", low.x, low.y, low.z)?;
            writeln!(f, "to           {}, {}, {}", high.x, high.y, high.z)?;
            writeln!(f, "diagonal     {}", self.diagonal)?;
        }
        if self.origin != [0.0; 3] {
            let [x, y, z] = self.origin;
            writeln!(f, "origin       {x}, {y}, {z}")?;
        }
        match &self.normals {
            None => writeln!(f, "normals      none")?,
            Some(Normals { oriented, unit, zero, not_finite }) => {
                let oriented = if *oriented { "oriented" } else { "not oriented" };
                writeln!(f, "normals      {oriented}; {unit} unit, {zero} zero, {not_finite} not finite")?;
            }
        }
        let presence = |is_there: bool| if is_there { "yes" } else { "none" };
        match self.harmonics {
            None => writeln!(f, "colours      {}", presence(self.colors))?,
            Some(degree) => writeln!(f, "colours      by direction: spherical harmonics of degree {degree}")?,
        }
        match self.opacities {
            None => writeln!(f, "opacities    none: opaque")?,
            Some([low, high]) => writeln!(f, "opacities    {low} to {high}")?,
        }
        writeln!(f, "areas        {}", presence(self.areas))?;
        writeln!(f, "texture      {}", presence(self.texture_coordinates))?;
        let Sizes { shape, known, unknown, range } = &self.sizes;
        writeln!(f, "sizes        {shape}: {known} known, {unknown} unknown")?;
        if let Some([low, mean, high]) = range {
            writeln!(f, "  sigma      {low} to {high}, mean {mean}")?;
        }
        for FieldSummary { name, range } in &self.fields {
            match range {
                Some([low, mean, high]) => writeln!(f, "field        {name}: {low} to {high}, mean {mean}")?,
                None => writeln!(f, "field        {name}: no finite value")?,
            }
        }
        writeln!(f, "assumptions")?;
        for assumption in &self.assumptions {
            writeln!(f, "  - {assumption}")?;
        }
        for (number, loss) in self.losses.iter().enumerate() {
            writeln!(f, "{}  - {loss}", if number == 0 { "out of order\n" } else { "" })?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn summary(cloud: Cloud) -> Summary {
        let report = ImportReport {
            path: "a.ply".into(),
            format: "PLY".to_owned(),
            bytes: 0,
            sha256: String::new(),
            elements: Vec::new(),
            assumptions: Vec::new(),
            losses: Vec::new(),
        };
        Summary::new(cloud, report)
    }

    #[test]
    fn bare_points_are_summed_up() {
        let points = [DVec3::ZERO, DVec3::new(3.0, 4.0, 0.0), DVec3::NAN];
        let summary = summary(Cloud::from_points(&points));
        assert_eq!((summary.points, summary.finite, summary.diagonal), (3, 2, 5.0));
        assert_eq!(summary.dropped, [("not_finite", 1)].into());
        assert_eq!((summary.sizes.unknown, summary.sizes.range), (3, None));
        assert!(summary.normals.is_none() && summary.to_string().contains("normals      none\n"));
    }

    #[test]
    fn surfels_are_summed_up() {
        let mut cloud = Cloud::from_points(&[DVec3::ZERO; 4]);
        cloud.normals = vec![Vec3::X, Vec3::Y, Vec3::ZERO, Vec3::NAN];
        cloud.shapes = Shapes::Discs(vec![1.0, 3.0, 0.0, -1.0]);
        cloud.opacities = Some(vec![0.25, 1.0, 0.5, 0.5]);
        cloud.fields = vec![Field { name: "time".to_owned(), values: vec![1.0, f32::NAN, 2.0, 6.0] }];
        let summary = summary(cloud);
        let normals = summary.normals.as_ref().unwrap();
        assert_eq!((normals.unit, normals.zero, normals.not_finite), (2, 1, 1));
        assert_eq!(summary.sizes.range, Some([1.0, 2.0, 3.0]));
        assert_eq!((summary.sizes.known, summary.sizes.unknown), (2, 1));
        assert_eq!(summary.opacities, Some([0.25, 1.0]));
        assert!(summary.to_string().contains("field        time: 1 to 6, mean 3\n"));
        assert_eq!(summary.dropped, [("not_finite", 1), ("zero_normal", 1)].into());
    }

    #[test]
    fn an_empty_cloud_is_summed_up() {
        let summary = summary(Cloud::default());
        assert!(summary.to_string().contains("points       0"));
        assert!(serde_json::to_string(&summary).unwrap().contains("\"bounds\":null"));
    }
}
