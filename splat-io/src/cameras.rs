//! Cameras, one or many, from the files of other programs and our own. The format is told by content.
//!
//! | file | matrix | axes of the camera | pixel centres | names |
//! |---|---|---|---|---|
//! | COLMAP, text or binary: `cameras` and `images` | world to camera: quaternion w x y z, translation | x right, y down, z forward | at .5 | the images'; sorted by them |
//! | nerfstudio, Blender: `transforms.json` | camera to world, rows | x right, y up, z backward | at .5 | `file_path` |
//! | Open3D JSON: parameters, trajectory, intrinsic alone | world to camera, columns | x right, y down, z forward | at integers: cx, cy + .5 | by number |
//! | Open3D `.log` | camera to world, rows; no intrinsics | x right, y down, z forward | at integers | by number |
//! | 3DGS `cameras.json` | camera to world: `position`, `rotation` by rows | x right, y down, z forward | at .5 | `img_name` |
//! | our JSON ([`own`]), one or `{"cameras": [..]}` | world to camera, rows | x right, y down, z forward | at .5 | `name` |
//!
//! "At .5" and "z forward" are [`Camera`]'s own conventions. A COLMAP model is named by its folder (`sparse/0` in it is
//! found) or by any of its files. A camera without a name is called `camera_0001` and so on, by its place.
//!
//! Matrices must turn, shift and scale, no more: mirror images and skewed axes are refused.

pub(crate) mod colmap;
mod open3d;
pub mod own;
#[cfg(test)]
mod tests;
mod trained;
mod transforms;

pub use own::{camera_json, parse_camera_json, read_camera_json, write_camera_json, write_cameras_json};

use crate::error::quoted;
use crate::{Error, Place};
use glam::{DMat3, DMat4, DVec2, DVec3};
use serde::Deserialize;
use serde::de::IgnoredAny;
use splat_core::{Camera, Distortion, Projection};
use std::io::Read;
use std::path::{Path, PathBuf};

/// Cameras of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraSet {
    /// The file or folder, as the caller named it.
    pub path: PathBuf,
    /// The format, as text: "COLMAP, binary".
    pub format: &'static str,
    /// The cameras, at least one.
    pub cameras: Vec<NamedCamera>,
    /// What was assumed, a sentence each.
    pub assumptions: Vec<String>,
}

/// A camera and what its file calls it.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedCamera {
    /// Often the name of a photograph, with folders: nothing to make a path of as it is.
    pub name: String,
    /// The camera.
    pub camera: Camera,
}

/// What holds where a file says nothing.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraDefaults {
    /// Near depth, in scene units: 1e-4 of the cloud's diagonal.
    pub near: f64,
    /// Width and height, in pixels, where a `transforms.json` has none; `None`: those of the image beside it if that is a
    /// PNG file, else 800 x 800 as in Blender's scenes.
    pub size: Option<[u32; 2]>,
    /// The camera of a `.log` trajectory, but for its pose; `None`: Open3D's PrimeSense, 640 x 480 pixels.
    pub intrinsic: Option<Camera>,
}

/// Reads the cameras of a file or folder. See the [module](self) for the formats, [`CameraDefaults::near`] for
/// `default_near`.
///
/// # Errors
/// [`Error::Io`]; [`Error::Unsupported`] for formats and lens models that are none of ours; [`Error::Json`]; [`Error::Limit`]
/// for a text of more than 64 MiB; [`Error::Invalid`] for anything malformed or truncated, for values out of range, matrices
/// that do more than turn, shift and scale, and files without a camera.
pub fn read_cameras(path: &Path, default_near: f64) -> Result<CameraSet, Error> {
    read_cameras_with(path, &CameraDefaults { near: default_near, size: None, intrinsic: None })
}

/// As [`read_cameras`], with all defaults chosen.
///
/// # Errors
/// As [`read_cameras`]; [`Error::Unsupported`] if there is an intrinsic and the file has its own.
pub fn read_cameras_with(path: &Path, defaults: &CameraDefaults) -> Result<CameraSet, Error> {
    let set = if let Some(model) = colmap::Model::find(path) {
        colmap::read(&model, path, defaults.near)?
    } else if path.is_dir() {
        let inside = path.join("transforms.json");
        if !inside.is_file() {
            let expected = "cameras.bin, cameras.txt, sparse/0 or transforms.json in it";
            return Err(Error::unsupported(path, "a folder without a camera file", expected));
        }
        read_text_file(&inside, defaults)?
    } else {
        read_text_file(path, defaults)?
    };
    if defaults.intrinsic.is_some() && set.format != open3d::LOG {
        let expected = "a .log trajectory, which has none";
        return Err(Error::unsupported(path, "an intrinsic for cameras that have their own", expected));
    }
    if set.cameras.is_empty() {
        return Err(Error::invalid(path, Place::File, "no camera", "one or more"));
    }
    Ok(CameraSet { path: path.to_owned(), ..set })
}

/// Whether a name is one that cameras are read from: a folder, `.json`, `.log`, or `cameras` or `images` of COLMAP.
pub fn is_camera_path(path: &Path) -> bool {
    let has = |wanted| path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(wanted));
    let is_points = path.file_stem().is_some_and(|stem| stem == "points3D");
    has("json") || has("log") || path.is_dir() || (colmap::Model::find(path).is_some() && !is_points)
}

/// Greatest size of a file of cameras as text, in MiB.
const MOST_MEBIBYTES: u64 = 64;

/// The keys that tell one JSON format from another.
#[derive(Debug, Deserialize)]
struct Keys {
    frames: Option<IgnoredAny>,
    cameras: Option<IgnoredAny>,
    model: Option<IgnoredAny>,
    parameters: Option<IgnoredAny>,
    extrinsic: Option<IgnoredAny>,
    intrinsic_matrix: Option<IgnoredAny>,
}

/// Reads cameras from JSON or a `.log` trajectory.
fn read_text_file(path: &Path, defaults: &CameraDefaults) -> Result<CameraSet, Error> {
    parse_cameras(&read_text(path, MOST_MEBIBYTES)?, path, defaults)
}

/// Reads cameras from the text of a JSON file or of a `.log` trajectory; `path` is its name in messages, and where a
/// `transforms.json` looks for its images.
///
/// # Errors
/// As [`read_cameras`], but for what belongs to files; a list of no camera is none.
pub fn parse_cameras(text: &str, path: &Path, defaults: &CameraDefaults) -> Result<CameraSet, Error> {
    match text.trim_ascii_start().bytes().next() {
        Some(b'{') => {
            let keys: Keys = from_json(text, path)?;
            if keys.frames.is_some() {
                transforms::read(text, path, defaults)
            } else if keys.parameters.is_some() {
                open3d::read_trajectory(text, path, defaults.near)
            } else if keys.extrinsic.is_some() {
                open3d::read_parameters(text, path, defaults.near)
            } else if keys.intrinsic_matrix.is_some() {
                open3d::read_intrinsic(text, path, defaults.near)
            } else if keys.cameras.is_some() {
                own::read_list(text, path, defaults.near)
            } else if keys.model.is_some() {
                own::read_one(text, path, defaults.near)
            } else {
                let found = "an object without any of the fields frames, parameters, extrinsic, intrinsic_matrix, \
                             cameras, model";
                Err(Error::unsupported(path, found, "cameras of a format that has one of them"))
            }
        }
        Some(b'[') => trained::read(text, path, defaults.near),
        _ if open3d::is_log(text) => open3d::read_log(text, path, defaults),
        _ => {
            let start = quoted(text.lines().next().unwrap_or_default().as_bytes());
            let expected = "a camera: JSON (ours, transforms.json, Open3D, 3DGS), an Open3D .log trajectory, or a COLMAP \
                            folder";
            Err(Error::unsupported(path, format!("a file that begins with {start}"), expected))
        }
    }
}

/// A whole file of text.
fn read_text(path: &Path, most_mebibytes: u64) -> Result<String, Error> {
    let most = most_mebibytes << 20;
    let (file, _) = crate::ply::open(path)?;
    let mut bytes = Vec::new();
    file.take(most + 1).read_to_end(&mut bytes).map_err(Error::io(path, "read"))?;
    if bytes.len() as u64 > most {
        let limit = format!("{most_mebibytes} MiB");
        return Err(Error::limit(path, format!("a camera file of more than {limit}"), limit));
    }
    String::from_utf8(bytes).map_err(|error| {
        let place = error.utf8_error().valid_up_to();
        let found = quoted(&error.as_bytes()[place..]);
        Error::invalid(path, Place::Byte(place as u64), found, "UTF-8 text")
    })
}

/// Deserialises JSON.
fn from_json<'a, T: Deserialize<'a>>(text: &'a str, path: &Path) -> Result<T, Error> {
    serde_json::from_str(text).map_err(|cause| Error::Json { path: path.to_owned(), cause })
}

/// Everything of a perspective camera but its place.
#[derive(Debug, Clone, Copy)]
struct Intrinsics {
    /// Width and height, in pixels.
    size: [u32; 2],
    /// In pixels.
    focal_length: DVec2,
    /// In pixels; the first pixel's centre is at .5.
    principal_point: DVec2,
    distortion: Distortion,
}

impl Intrinsics {
    /// The camera at a place; `near` is in scene units.
    fn camera(self, world_to_camera: DMat4, near: f64) -> Camera {
        let mut camera = Camera {
            width: self.size[0],
            height: self.size[1],
            projection: Projection::Perspective { focal_length: self.focal_length, lens: None },
            principal_point: self.principal_point,
            world_to_camera,
            near,
            far: f64::INFINITY,
            clip_planes: Vec::new(),
            distortion: Some(self.distortion).filter(|distortion| *distortion != Distortion::default()),
        };
        camera.near *= camera.scale();
        camera
    }
}

impl NamedCamera {
    /// A camera of a file, checked.
    fn new(name: String, camera: Camera, path: &Path) -> Result<Self, Error> {
        check(&camera, path).map_err(|error| error.of_camera(&name))?;
        Ok(Self { name, camera })
    }
}

/// A camera's name: without one it is called by its place, counted from 0 here and from 1 there.
fn name_or_number(name: Option<String>, index: usize) -> String {
    name.filter(|name| !name.is_empty()).unwrap_or_else(|| format!("camera_{:04}", index + 1))
}

/// Checks a camera's values.
fn check(camera: &Camera, path: &Path) -> Result<(), Error> {
    if let Some(Distortion { radial: [k1, k2, k3], tangential: [p1, p2] }) = camera.distortion {
        let coefficients = [("k1", k1), ("k2", k2), ("k3", k3), ("p1", p1), ("p2", p2)];
        if let Some((field, value)) = coefficients.into_iter().find(|(_, value)| !value.is_finite()) {
            return Err(Error::invalid(path, Place::Field(field), value.to_string(), "a finite number"));
        }
    }
    camera.check().map_err(Error::core(path))
}

/// A matrix that turns, shifts and perhaps scales, or else an error for `field`.
///
/// The axes' lengths and angles may be wrong by 10^-3: matrices written with few digits are right enough.
fn similarity(matrix: DMat4, path: &Path, field: &'static str) -> Result<DMat4, Error> {
    const TOLERANCE: f64 = 1e-3;
    let linear = DMat3::from_mat4(matrix);
    let gram = linear.transpose() * linear;
    let square = libm::cbrt(linear.determinant()).powi(2);
    let deviation = (gram - DMat3::from_diagonal(DVec3::splat(square))).to_cols_array();
    let found = if !matrix.is_finite() {
        "a number that is not finite"
    } else if matrix.row(3).to_array() != [0.0, 0.0, 0.0, 1.0] {
        "a last row that is not 0 0 0 1"
    } else if linear.determinant() < 0.0 {
        "a matrix that makes a mirror image"
    } else if square.is_normal() && deviation.iter().all(|entry| entry.abs() <= TOLERANCE * square) {
        return Ok(matrix);
    } else {
        "a matrix that is no rotation"
    };
    Err(Error::invalid(path, Place::Field(field), found, "perpendicular axes of one length, and a place"))
}

/// The inverse of a matrix that turns, shifts and scales.
fn inverse(matrix: DMat4) -> DMat4 {
    let linear = DMat3::from_mat4(matrix).inverse();
    let mut inverse = DMat4::from_mat3(linear);
    inverse.w_axis = (-(linear * matrix.w_axis.truncate())).extend(1.0);
    inverse
}

/// A width or height in pixels, where files have them as floats.
fn side(value: f64, path: &Path, field: &'static str) -> Result<u32, Error> {
    if value.fract() == 0.0 && (1.0..=f64::from(splat_core::camera::MAX_SIDE)).contains(&value) {
        Ok(value as u32)
    } else {
        Err(Error::invalid(path, Place::Field(field), value.to_string(), "1 to 65536 whole pixels"))
    }
}
