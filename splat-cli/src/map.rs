//! Prints to scale: orthographic pictures in which so many pixels are a metre.

use crate::arguments::RenderArguments;
use crate::resolve::framing;
use crate::usage::UsageError;
use clap::{Args, ValueEnum};
use glam::{DMat3, DMat4, DVec2, DVec3};
use splat_core::camera::MAX_SIDE;
use splat_core::fit::fit;
use splat_core::{Camera, Cloud, Projection, RenderOptions, Shapes};

/// The scale of a print.
#[derive(Debug, Clone, Default, Args)]
pub struct MapArguments {
    /// A print to scale, as large as it takes: 1:200 is one unit on paper for 200 in the scene
    #[arg(long, value_name = "1:N", value_parser = scale, requires = "ortho", conflicts_with_all = ["size", "turntable"])]
    pub scale: Option<f64>,
    /// Pixels an inch of the print, which PNG and EXR files say [default: 300 with --scale, else not said]
    #[arg(long, value_name = "N", value_parser = dpi)]
    pub dpi: Option<f64>,
    /// The unit of the cloud's coordinates, for --scale [default: m]
    #[arg(long, value_name = "UNIT", requires = "scale")]
    pub unit: Option<UnitChoice>,
}

/// Pixels an inch of a print to scale.
const DEFAULT_DPI: f64 = 300.0;

/// Metres an inch.
const INCH: f64 = 0.0254;

/// Most pixels of a map that is drawn at once: 4 GiB of colours.
const MOST_PIXELS: f64 = (1_u64 << 28) as f64;

/// Pixels around the cloud: the widest pixel filter reaches 3/2.
const MARGIN: f64 = 2.0;

impl MapArguments {
    /// Pixels an inch of the print, if anyone asks for a print.
    pub fn dpi(&self) -> Option<f64> {
        self.dpi.or(self.scale.map(|_| DEFAULT_DPI))
    }
}

/// `--unit`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub enum UnitChoice {
    /// Metres
    #[default]
    M,
    /// Millimetres
    Mm,
    /// Centimetres
    Cm,
    /// Kilometres
    Km,
    /// Feet of 0.3048 m
    Ft,
    /// US survey feet of 1200/3937 m
    UsFt,
}

impl UnitChoice {
    fn metres(self) -> f64 {
        match self {
            Self::M => 1.0,
            Self::Mm => 1e-3,
            Self::Cm => 1e-2,
            Self::Km => 1e3,
            Self::Ft => 0.3048,
            Self::UsFt => 1200.0 / 3937.0,
        }
    }
}

/// `--scale`: N of 1:N.
fn scale(text: &str) -> Result<f64, String> {
    let number = text.strip_prefix("1:").and_then(|number| number.trim().parse().ok());
    number
        .filter(|number: &f64| number.is_finite() && *number > 0.0)
        .ok_or_else(|| "expected 1:N with N greater than 0, as in 1:200".to_owned())
}

/// `--dpi`.
fn dpi(text: &str) -> Result<f64, String> {
    let number = text.trim().parse().ok().filter(|number| (1.0..=100_000.0).contains(number));
    number.ok_or_else(|| "expected a number of pixels an inch, 1 to 100000".to_owned())
}

/// The camera of a print to scale that holds every splat of a prepared cloud. Pixels begin at multiples of their size from
/// the world's zero, so prints of neighbouring clouds fit together.
///
/// # Errors
/// The renderer's own if the cloud cannot be shown; [`UsageError`] if the picture would be too large.
pub fn camera(arguments: &RenderArguments, cloud: &Cloud, options: &RenderOptions) -> anyhow::Result<Camera> {
    let is_part = arguments.samples.crop.is_some() || arguments.samples.tile.is_some();
    let arguments = &arguments.camera;
    let MapArguments { scale, unit, .. } = arguments.map;
    let (scale, unit) = (scale.unwrap_or(1.0), unit.unwrap_or_default());
    let dpi = arguments.map.dpi().unwrap_or(DEFAULT_DPI);
    let pixels_per_unit = unit.metres() / (scale * INCH) * dpi;

    let fitted = fit(cloud, &framing(arguments, cloud), options)?;
    let axes = straight(fitted.linear());
    let (low, high) = reach(cloud, axes, options.cutoff.sqrt());
    let first = (low * pixels_per_unit).floor() - MARGIN;
    let last = (high * pixels_per_unit).ceil() + MARGIN;
    let size = (last - first).max(DVec2::ONE);
    let middle = (first + 0.5 * size) / pixels_per_unit;
    let depth = fitted.world_to_camera.w_axis.z;
    let camera = Camera {
        projection: Projection::Orthographic { pixels_per_unit },
        principal_point: 0.5 * size,
        world_to_camera: DMat4::from_translation((-middle).extend(depth)) * DMat4::from_mat3(axes),
        ..fitted
    };

    let excess = (size.max_element() / f64::from(MAX_SIDE)).max(if is_part {
        0.0
    } else {
        (size.x / MOST_PIXELS * size.y).sqrt()
    });
    if excess > 1.0 {
        let limit = if size.max_element() > f64::from(MAX_SIDE) {
            format!("{MAX_SIDE} a side")
        } else {
            format!("{MOST_PIXELS} in all but for --tile and --crop")
        };
        return Err(UsageError::new(format!(
            "1:{scale} at {dpi} dpi is a picture of {}x{} pixels, beyond the limit of {limit}: take --scale 1:{} or --dpi {} \
             (or is the cloud's --unit another?)",
            size.x,
            size.y,
            (scale * excess).ceil(),
            (dpi / excess).floor().max(1.0)
        ))
        .into());
    }
    Ok(Camera { width: size.x as u32, height: size.y as u32, ..camera })
}

/// Axes of which those along the world's are so exactly.
fn straight(axes: DMat3) -> DMat3 {
    let round = |x: f64| if (x - x.round()).abs() < 1e-15 { x.round() } else { x };
    DMat3::from_cols_array(&axes.to_cols_array().map(round))
}

/// The least and greatest coordinates of splats along the first two rows of `axes`; `radius` is that of splats, in sigma.
fn reach(cloud: &Cloud, axes: DMat3, radius: f64) -> (DVec2, DVec2) {
    let [right, down] = [axes.row(0), axes.row(1)];
    let mut bounds = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for index in (0..cloud.len()).filter(|&index| cloud.defect(index).is_none()) {
        let position = cloud.world_position(index);
        let extent = |axis: DVec3| match &cloud.shapes {
            Shapes::Discs(sizes) => {
                let normal = cloud.normals[index].as_dvec3().dot(axis);
                f64::from(sizes[index]) * (1.0 - normal * normal).max(0.0).sqrt()
            }
            Shapes::Ellipses(ellipses) => {
                let [a, b] = ellipses[index].map(|tangent| tangent.as_dvec3().dot(axis));
                DVec2::new(a, b).length()
            }
        };
        let extent = radius * DVec2::new(extent(right), extent(down));
        let place = DVec2::new(position.dot(right), position.dot(down));
        bounds = (bounds.0.min(place - extent), bounds.1.max(place + extent));
    }
    bounds
}

/// What a print is, in words.
pub fn describe(arguments: &MapArguments, camera: &Camera) -> Option<String> {
    let (scale, dpi) = (arguments.scale?, arguments.dpi()?);
    let [width, height] = [camera.width, camera.height];
    let millimetres = |pixels: u32| f64::from(pixels) / dpi * INCH * 1e3;
    Some(format!(
        "1:{scale} at {dpi} dpi: {width}x{height} pixels, {:.0} x {:.0} mm; a pixel is {:.6} m",
        millimetres(width),
        millimetres(height),
        scale * INCH / dpi
    ))
}
