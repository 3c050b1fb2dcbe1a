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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arguments::{Arguments, Command};
    use clap::Parser;

    /// Three splats in map coordinates, 30 m east and 20 m north of each other, one of them turned.
    fn cloud() -> Cloud {
        let corner = DVec3::new(636_001.76, 5_848_935.2, 406.26);
        let points = [corner, corner + DVec3::new(30.0, 0.0, 5.0), corner + DVec3::new(0.0, 20.0, 1.0)];
        let mut cloud = Cloud::from_points(&points);
        cloud.normals = vec![glam::Vec3::Z, glam::Vec3::X, glam::Vec3::Z];
        cloud.shapes = Shapes::Discs(vec![0.25; 3]);
        cloud
    }

    fn map(options: &str) -> anyhow::Result<(Camera, RenderOptions)> {
        let line = ["splat", "render", "in.ply", "-o", "x.png"].into_iter().chain(options.split_whitespace());
        let Command::Render(arguments) = Arguments::parse_from(line).command else { panic!("not render") };
        let options = crate::resolve::options(&arguments, false)?;
        Ok((camera(&arguments, &cloud(), &options)?, options))
    }

    /// Where a camera draws a splat of the cloud.
    fn pixel(camera: &Camera, index: usize) -> DVec2 {
        let p = camera.world_to_camera.transform_point3(cloud().world_position(index));
        p.truncate() * camera.pixel_scale() + camera.principal_point
    }

    #[test]
    fn a_pixel_is_the_scale_times_an_inch_over_the_dots_an_inch() {
        for (options, metres) in [
            ("--scale 1:200", 200.0 * 0.0254 / 300.0),
            ("--scale 1:500 --dpi 72.5", 500.0 * 0.0254 / 72.5),
            ("--scale 1:1000 --unit ft", 1000.0 * 0.0254 / 300.0 / 0.3048),
            ("--scale 1:1000 --unit us-ft --up z", 1000.0 * 0.0254 / 300.0 / (1200.0 / 3937.0)),
            ("--scale 1:10 --unit mm --crop 0,0,1,1", 10.0 * 25.4 / 300.0),
        ] {
            let (camera, _) = map(&format!("--ortho top {options}")).unwrap();
            let east = pixel(&camera, 1) - pixel(&camera, 0);
            let north = pixel(&camera, 2) - pixel(&camera, 0);
            // Coordinates of 6e6 in `f64` leave 1e-9 units.
            assert!((east - DVec2::new(30.0 / metres, 0.0)).abs().max_element() < 1e-6, "{options}: {east}");
            assert!(
                (north - DVec2::new(0.0, -20.0 / metres)).abs().max_element() < 1e-6,
                "{options}: {north}"
            );
            // Where the pixels begin, counted from the world's zero.
            let corner = cloud().world_position(0) / metres;
            let first = DVec2::new(corner.x, -corner.y) - pixel(&camera, 0);
            assert!((first - first.round()).abs().max_element() < 1e-6, "{options}: {first}");
        }
    }

    #[test]
    fn the_picture_holds_every_splat_and_little_more() {
        for view in ["top", "bottom", "front", "back", "left", "right"] {
            let (camera, options) = map(&format!("--ortho {view} --scale 1:100 --dpi 25.4")).unwrap();
            assert!((camera.pixel_scale() - 10.0).abs().max_element() < 1e-12, "{view}");
            let (low, high) = reach(&cloud(), straight(camera.linear()), options.cutoff.sqrt());
            let size = DVec2::new(camera.width.into(), camera.height.into());
            let excess = size - 10.0 * (high - low);
            assert!(
                excess.min_element() >= 2.0 * MARGIN && excess.max_element() < 2.0 * MARGIN + 2.0,
                "{view}: {excess}"
            );
            assert_eq!(camera.principal_point, 0.5 * size);
        }
    }

    #[test]
    fn a_map_that_is_too_large_says_what_to_change() {
        let error = map("--ortho top --scale 1:1 --unit km").unwrap_err();
        assert!(error.is::<UsageError>());
        let message = error.to_string();
        assert!(message.starts_with("1:1 at 300 dpi is a picture of 360236"), "{message}");
        assert!(message.contains("limit of 65536 a side") && message.contains("--unit"), "{message}");
    }

    #[test]
    fn scales_and_resolutions() {
        assert_eq!([scale("1:200"), scale("1: 0.5")], [Ok(200.0), Ok(0.5)]);
        for text in ["200", "1:0", "1:-1", "1:inf", "2:1", "1:x", ""] {
            assert!(scale(text).is_err(), "{text}");
        }
        assert_eq!(dpi("300"), Ok(300.0));
        assert!(["0", "nan", "1e9"].iter().all(|text| dpi(text).is_err()));
    }
}
