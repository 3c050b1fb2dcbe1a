//! What is said of a camera.

use serde::Serialize;
use splat_core::{Camera, Projection};
use splat_io::read_camera_json;
use std::fmt;
use std::path::{Path, PathBuf};

/// Stands for a near depth that the file leaves to the cloud; no file would ask for it.
const UNKNOWN_NEAR: f64 = f64::MIN_POSITIVE;

/// What is said of a camera.
#[derive(Debug, Serialize)]
pub struct Summary {
    file: PathBuf,
    model: &'static str,
    width: u32,
    height: u32,
    /// Across and down the picture, in degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    field_of_view: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pixels_per_unit: Option<f64>,
    principal_point: [f64; 2],
    eye: [f64; 3],
    /// Unit vector along the axis, in world space.
    forward: [f64; 3],
    near: Option<f64>,
    /// `None`: no limit.
    far: Option<f64>,
    lens: Option<LensSummary>,
}

/// What is said of a lens.
#[derive(Debug, Serialize)]
struct LensSummary {
    radius: f64,
    /// `None`: infinity.
    focus: Option<f64>,
    blades: u32,
}

impl Summary {
    /// Reads a camera and sums it up.
    ///
    /// # Errors
    /// What the reader says.
    pub fn read(path: &Path) -> Result<Self, splat_io::Error> {
        Ok(Self::new(path, &read_camera_json(path, UNKNOWN_NEAR)?))
    }

    fn new(path: &Path, camera: &Camera) -> Self {
        let (field_of_view, pixels_per_unit) = match camera.projection {
            Projection::Perspective { focal_length, .. } => {
                let sides =
                    [f64::from(camera.width) / focal_length.x, f64::from(camera.height) / focal_length.y];
                (Some(sides.map(|side| 2.0 * libm::atan(0.5 * side).to_degrees())), None)
            }
            Projection::Orthographic { pixels_per_unit } => (None, Some(pixels_per_unit)),
        };
        let finite = |value: f64| value.is_finite().then_some(value);
        let lens = camera.lens();
        Self {
            file: path.to_owned(),
            model: if camera.is_orthographic() { "orthographic" } else { "pinhole" },
            width: camera.width,
            height: camera.height,
            field_of_view,
            pixels_per_unit,
            principal_point: camera.principal_point.to_array(),
            eye: camera.eye().to_array(),
            forward: camera.linear().row(2).normalize_or_zero().to_array(),
            near: Some(camera.near).filter(|&near| near != UNKNOWN_NEAR),
            far: finite(camera.far),
            lens: lens.map(|lens| LensSummary {
                radius: lens.radius,
                focus: finite(lens.focus),
                blades: lens.blades,
            }),
        }
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "file           {}", self.file.display())?;
        writeln!(f, "format         camera, {}", self.model)?;
        writeln!(f, "size           {} x {} pixels", self.width, self.height)?;
        if let Some([across, down]) = self.field_of_view {
            writeln!(f, "field of view  {across:.2} x {down:.2} degrees")?;
        }
        if let Some(scale) = self.pixels_per_unit {
            writeln!(f, "scale          {scale} pixels a unit")?;
        }
        let [x, y] = self.principal_point;
        writeln!(f, "centre         {x}, {y} pixels")?;
        let [x, y, z] = self.eye;
        writeln!(f, "eye            {x}, {y}, {z}")?;
        let [x, y, z] = self.forward;
        writeln!(f, "looks along    {x:.6}, {y:.6}, {z:.6}")?;
        match self.near {
            Some(near) => writeln!(f, "near           {near}")?,
            None => writeln!(f, "near           not given: 1e-4 of the cloud's diagonal")?,
        }
        match self.far {
            Some(far) => writeln!(f, "far            {far}")?,
            None => writeln!(f, "far            no limit")?,
        }
        match &self.lens {
            None => writeln!(f, "lens           none (pinhole)"),
            Some(LensSummary { radius, focus, blades }) => {
                let focus = focus.map_or("infinity".to_owned(), |focus| focus.to_string());
                let shape = if *blades == 0 { "round".to_owned() } else { format!("{blades} blades") };
                writeln!(f, "lens           radius {radius}, focus {focus}, {shape}")
            }
        }
    }
}
