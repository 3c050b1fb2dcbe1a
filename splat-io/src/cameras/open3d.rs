//! Open3D: JSON of pinhole cameras, and `.log` trajectories.

use super::{
    CameraDefaults, CameraSet, Intrinsics, NamedCamera, from_json, inverse, name_or_number, similarity,
};
use crate::error::quoted;
use crate::{Error, Place};
use glam::{DMat4, DVec2, DVec4};
use serde::Deserialize;
use splat_core::{Camera, Distortion};
use std::path::Path;

/// The format of a `.log` file, in words.
pub(super) const LOG: &str = "Open3D .log trajectory";

/// `PinholeCameraIntrinsic`.
#[derive(Debug, Deserialize)]
struct IntrinsicJson {
    width: u32,
    height: u32,
    /// fx 0 0, 0 fy 0, cx cy 1: by columns; pixel centres are at integers.
    intrinsic_matrix: [f64; 9],
}

/// `PinholeCameraParameters`.
#[derive(Debug, Deserialize)]
struct ParametersJson {
    /// World to camera, by columns.
    extrinsic: [f64; 16],
    intrinsic: IntrinsicJson,
}

/// `PinholeCameraTrajectory`.
#[derive(Debug, Deserialize)]
struct TrajectoryJson {
    parameters: Vec<ParametersJson>,
}

/// Reads a trajectory in JSON.
pub(super) fn read_trajectory(text: &str, path: &Path, near: f64) -> Result<CameraSet, Error> {
    let TrajectoryJson { parameters } = from_json(text, path)?;
    set(path, "Open3D camera trajectory", &parameters, near)
}

/// Reads the parameters of one camera.
pub(super) fn read_parameters(text: &str, path: &Path, near: f64) -> Result<CameraSet, Error> {
    set(path, "Open3D camera parameters", &[from_json(text, path)?], near)
}

fn set(
    path: &Path,
    format: &'static str,
    parameters: &[ParametersJson],
    near: f64,
) -> Result<CameraSet, Error> {
    let cameras = parameters.iter().enumerate().map(|(index, ParametersJson { extrinsic, intrinsic })| {
        let camera = similarity(DMat4::from_cols_array(extrinsic), path, "extrinsic")
            .and_then(|pose| Ok(intrinsics(intrinsic, path)?.camera(pose, near)));
        let name = name_or_number(None, index);
        let camera = camera.map_err(|error| error.of_camera(&name))?;
        NamedCamera::new(name, camera, path)
    });
    let cameras = cameras.collect::<Result<_, _>>()?;
    Ok(CameraSet { path: path.to_owned(), format, cameras, assumptions: vec![HALF_PIXEL.to_owned()] })
}

const HALF_PIXEL: &str = "Open3D has pixel centres at integers: cx and cy are .5 more here";

/// Reads a file that holds an intrinsic alone.
pub(super) fn read_intrinsic(text: &str, path: &Path, near: f64) -> Result<CameraSet, Error> {
    let camera = intrinsics(&from_json(text, path)?, path)?.camera(DMat4::IDENTITY, near);
    let place = "the file has no pose: the eye is at 0, looks along z, and y points down";
    Ok(CameraSet {
        path: path.to_owned(),
        format: "Open3D camera intrinsic",
        cameras: vec![NamedCamera::new(name_or_number(None, 0), camera, path)?],
        assumptions: vec![place.to_owned(), HALF_PIXEL.to_owned()],
    })
}

fn intrinsics(json: &IntrinsicJson, path: &Path) -> Result<Intrinsics, Error> {
    let [fx, a, b, skew, fy, c, cx, cy, one] = json.intrinsic_matrix;
    if [a, b, c, skew, one] != [0.0, 0.0, 0.0, 0.0, 1.0] {
        let found = format!("{:?}", json.intrinsic_matrix);
        let expected = "fx 0 0, 0 fy 0, cx cy 1: three columns, no skew";
        return Err(Error::invalid(path, Place::Field("intrinsic_matrix"), found, expected));
    }
    Ok(Intrinsics {
        size: [json.width, json.height],
        focal_length: DVec2::new(fx, fy),
        principal_point: DVec2::new(cx, cy) + 0.5,
        distortion: Distortion::default(),
    })
}

/// Open3D's default, `PrimeSenseDefault`.
const PRIME_SENSE: Intrinsics = Intrinsics {
    size: [640, 480],
    focal_length: DVec2::splat(525.0),
    principal_point: DVec2::new(320.0, 240.0),
    distortion: Distortion { radial: [0.0; 3], tangential: [0.0; 2] },
};

/// Whether a text begins as a `.log` trajectory does: with a line of three whole numbers.
pub(super) fn is_log(text: &str) -> bool {
    let first = text.lines().find(|line| !line.trim().is_empty()).unwrap_or_default();
    let words: Vec<&str> = first.split_ascii_whitespace().collect();
    words.len() == 3 && words.iter().all(|word| word.parse::<i64>().is_ok())
}

/// Reads a `.log` trajectory: for each camera a line of three numbers, which say nothing here, and four rows of a matrix.
pub(super) fn read_log(text: &str, path: &Path, defaults: &CameraDefaults) -> Result<CameraSet, Error> {
    let (intrinsic, assumption) = match &defaults.intrinsic {
        Some(camera) => (camera.clone(), None),
        None => {
            let assumption = "the file has no intrinsic: 640 x 480 pixels, fx = fy = 525, cx 320, cy 240 (Open3D's default)";
            (PRIME_SENSE.camera(DMat4::IDENTITY, defaults.near), Some(assumption.to_owned()))
        }
    };
    let mut cameras = Vec::new();
    let mut lines = text.lines().zip(1_u64..).filter(|(line, _)| !line.trim().is_empty());
    while let Some((_, number)) = lines.next() {
        let mut rows = [DVec4::ZERO; 4];
        for row in &mut rows {
            let (line, number) = lines.next().unwrap_or(("", number));
            *row = numbers(line).ok_or_else(|| {
                let expected = "a row of the camera's matrix: 4 numbers";
                Error::invalid(path, Place::Line(number), quoted(line.as_bytes()), expected)
            })?;
        }
        let [x, y, z, w] = rows;
        let name = name_or_number(None, cameras.len());
        let place = similarity(DMat4::from_cols(x, y, z, w).transpose(), path, "matrix");
        let place = place.map_err(|error| error.of_camera(&name))?;
        let mut camera = Camera { world_to_camera: inverse(place), ..intrinsic.clone() };
        camera.near = defaults.near * camera.scale();
        cameras.push(NamedCamera::new(name, camera, path)?);
    }
    Ok(CameraSet {
        path: path.to_owned(),
        format: LOG,
        cameras,
        assumptions: assumption.into_iter().collect(),
    })
}

/// Four numbers between blanks.
fn numbers(line: &str) -> Option<DVec4> {
    let values: Option<Vec<f64>> = line.split_ascii_whitespace().map(|word| word.parse().ok()).collect();
    Some(DVec4::from_array(values?.try_into().ok()?))
}
