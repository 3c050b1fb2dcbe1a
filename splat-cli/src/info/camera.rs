//! What is said of cameras.

use glam::DVec3;
use serde::Serialize;
use splat_core::{Camera, Distortion, Projection};
use splat_io::{CameraSet, NamedCamera, read_cameras};
use std::fmt;
use std::path::{Path, PathBuf};

/// Stands for a near depth that the file leaves to the cloud; no file would ask for it.
const UNKNOWN_NEAR: f64 = f64::MIN_POSITIVE;

/// What is said of the cameras of a file.
#[derive(Debug, Serialize)]
pub struct Summary {
    file: PathBuf,
    format: &'static str,
    /// Least and greatest corner of the box of all eyes.
    eyes: [[f64; 3]; 2],
    cameras: Vec<One>,
    assumptions: Vec<String>,
}

/// What is said of one camera.
#[derive(Debug, Serialize)]
struct One {
    /// What `--frames` calls it.
    frame: usize,
    name: String,
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
    /// k1, k2, k3, p1, p2.
    #[serde(skip_serializing_if = "Option::is_none")]
    distortion: Option<[f64; 5]>,
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
    /// Reads cameras and sums them up.
    ///
    /// # Errors
    /// What the reader says.
    pub fn read(path: &Path) -> Result<Self, splat_io::Error> {
        let CameraSet { path, format, cameras, assumptions } = read_cameras(path, UNKNOWN_NEAR)?;
        let cameras: Vec<One> = (1..)
            .zip(cameras)
            .map(|(frame, NamedCamera { name, camera })| One::new(frame, name, &camera))
            .collect();
        let eyes = cameras.iter().map(|camera| DVec3::from_array(camera.eye));
        let (low, high) = eyes
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), eye| (low.min(eye), high.max(eye)));
        Ok(Self { file: path, format, eyes: [low.to_array(), high.to_array()], cameras, assumptions })
    }
}

impl One {
    fn new(frame: usize, name: String, camera: &Camera) -> Self {
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
            frame,
            name,
            model: if camera.is_orthographic() { "orthographic" } else { "pinhole" },
            width: camera.width,
            height: camera.height,
            field_of_view,
            pixels_per_unit,
            principal_point: camera.principal_point.to_array(),
            // Adding 0 makes 0 of -0.
            eye: (camera.eye() + 0.0).to_array(),
            forward: camera.linear().row(2).normalize_or_zero().to_array(),
            near: Some(camera.near).filter(|&near| near != UNKNOWN_NEAR),
            far: finite(camera.far),
            lens: lens.map(|lens| LensSummary {
                radius: lens.radius,
                focus: finite(lens.focus),
                blades: lens.blades,
            }),
            distortion: camera
                .distortion
                .map(|Distortion { radial: [k1, k2, k3], tangential: [p1, p2] }| [k1, k2, k3, p1, p2]),
        }
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "file           {}", self.file.display())?;
        match self.cameras.as_slice() {
            [camera] => {
                writeln!(f, "format         {}, {}", self.format, camera.model)?;
                write!(f, "{camera}")?;
            }
            cameras => {
                let [low, high] = self.eyes;
                writeln!(f, "format         {}", self.format)?;
                writeln!(f, "cameras        {}", cameras.len())?;
                writeln!(f, "eyes from      {}, {}, {}", low[0], low[1], low[2])?;
                writeln!(f, "eyes to        {}, {}, {}", high[0], high[1], high[2])?;
                writeln!(f, "frame  size, field of view, eye, name")?;
                for One { frame, name, width, height, field_of_view, eye: [x, y, z], .. } in cameras {
                    let name = name.escape_debug();
                    let view = match field_of_view {
                        Some([across, down]) => format!("{across:.2} x {down:.2} degrees"),
                        None => "orthographic".to_owned(),
                    };
                    writeln!(f, "{frame:>5}  {width}x{height}, {view}, ({x:.6}, {y:.6}, {z:.6}), {name}")?;
                }
            }
        }
        if !self.assumptions.is_empty() {
            writeln!(f, "assumptions")?;
        }
        self.assumptions.iter().try_for_each(|assumption| writeln!(f, "  - {assumption}"))
    }
}

impl fmt::Display for One {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "name           {}", self.name.escape_debug())?;
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
        if let Some([k1, k2, k3, p1, p2]) = self.distortion {
            writeln!(f, "distortion     k1 {k1}, k2 {k2}, k3 {k3}, p1 {p1}, p2 {p2}")?;
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
