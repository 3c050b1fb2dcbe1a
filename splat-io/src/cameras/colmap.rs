//! COLMAP models: the cameras of `cameras.txt` or `.bin`, at the places of `images.txt` or `.bin`.

pub(crate) mod binary;
mod text;

use super::{CameraSet, Intrinsics, NamedCamera, name_or_number};
use crate::{Error, Place};
use glam::{DMat3, DMat4, DQuat, DVec2, DVec3};
use splat_core::Distortion;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The files of a model.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Model {
    folder: PathBuf,
    is_binary: bool,
}

impl Model {
    /// The model that a path means: a folder that has one, or one of its files. `None` if it means none.
    pub fn find(path: &Path) -> Option<Self> {
        if path.is_dir() {
            let folders = ["", "sparse/0", "sparse", "colmap/sparse/0"].map(|inside| path.join(inside));
            let mut models = folders
                .iter()
                .flat_map(|folder| [true, false].map(|is_binary| Self { folder: folder.clone(), is_binary }));
            return models.find(|model| model.file("cameras").is_file());
        }
        let is_known = matches!(path.file_stem()?.to_str()?, "cameras" | "images" | "points3D");
        let is_binary = match path.extension()?.to_str()? {
            "bin" => true,
            "txt" => false,
            _ => return None,
        };
        is_known.then(|| Self { folder: path.parent().unwrap_or(Path::new("")).to_owned(), is_binary })
    }

    /// One of its files.
    pub fn file(&self, stem: &str) -> PathBuf {
        self.folder.join(stem).with_extension(if self.is_binary { "bin" } else { "txt" })
    }
}

/// An image: a camera at a place.
#[derive(Debug)]
struct Posed {
    name: String,
    camera: u32,
    /// w x y z, world to camera.
    rotation: [f64; 4],
    translation: [f64; 3],
}

/// Lenses by the images' numbers of them.
type Lenses = BTreeMap<u32, Intrinsics>;

/// Reads a model; `path` is what the caller called it.
pub(super) fn read(model: &Model, path: &Path, near: f64) -> Result<CameraSet, Error> {
    let [cameras, images] = ["cameras", "images"].map(|stem| model.file(stem));
    let (lenses, mut posed) = if model.is_binary {
        (binary::read_cameras(&cameras)?, binary::read_images(&images)?)
    } else {
        (text::read_cameras(&cameras)?, text::read_images(&images)?)
    };
    // Binary files have the images in no order that means anything.
    posed.sort_by(|a, b| a.name.cmp(&b.name));
    let named = posed.into_iter().enumerate().map(|(index, mut posed)| {
        posed.name = name_or_number(Some(posed.name), index);
        let lens = lenses.get(&posed.camera).ok_or_else(|| {
            let place = Place::Camera { name: posed.name.clone(), field: Some("CAMERA_ID") };
            Error::invalid(&images, place, posed.camera.to_string(), "a camera of the other file")
        })?;
        let pose = pose(&posed, &images).map_err(|error| error.of_camera(&posed.name))?;
        NamedCamera::new(posed.name, lens.camera(pose, near), path)
    });
    Ok(CameraSet {
        path: path.to_owned(),
        format: if model.is_binary { "COLMAP, binary" } else { "COLMAP, text" },
        cameras: named.collect::<Result<_, _>>()?,
        assumptions: Vec::new(),
    })
}

/// World to camera. The quaternion is made a unit one, as COLMAP does.
fn pose(posed: &Posed, path: &Path) -> Result<DMat4, Error> {
    let [w, x, y, z] = posed.rotation;
    let quaternion = DQuat::from_xyzw(x, y, z, w);
    let translation = DVec3::from_array(posed.translation);
    let unit = quaternion.normalize();
    if !(unit.is_finite() && quaternion.length() > 1e-6 && translation.is_finite()) {
        let found = format!("{:?}, {:?}", posed.rotation, posed.translation);
        let expected = "a quaternion w x y z that is not zero, and a translation";
        return Err(Error::invalid(path, Place::Field("pose"), found, expected));
    }
    let mut matrix = DMat4::from_mat3(DMat3::from_quat(unit));
    matrix.w_axis = translation.extend(1.0);
    Ok(matrix)
}

/// The models of lenses, in the order of their numbers, with the count of their parameters.
const MODELS: [(&str, usize); 12] = [
    ("SIMPLE_PINHOLE", 3),
    ("PINHOLE", 4),
    ("SIMPLE_RADIAL", 4),
    ("RADIAL", 5),
    ("OPENCV", 8),
    ("OPENCV_FISHEYE", 8),
    ("FULL_OPENCV", 12),
    ("FOV", 5),
    ("SIMPLE_RADIAL_FISHEYE", 4),
    ("RADIAL_FISHEYE", 5),
    ("THIN_PRISM_FISHEYE", 12),
    ("RAD_TAN_THIN_PRISM_FISHEYE", 16),
];

/// The model of a lens by its number, with the count of its parameters.
fn model_of(number: i32) -> Option<(&'static str, usize)> {
    usize::try_from(number).ok().and_then(|number| MODELS.get(number)).copied()
}

/// A lens of a model with its parameters; `None` if their count is wrong.
///
/// # Errors
/// [`Error::Unsupported`] for models whose lenses are not those of Brown and Conrady.
fn lens(model: &str, size: [u32; 2], parameters: &[f64], path: &Path) -> Result<Option<Intrinsics>, Error> {
    let (focal_length, principal_point, [k1, k2, p1, p2]) = match (model, parameters) {
        ("SIMPLE_PINHOLE", &[f, cx, cy]) => ([f, f], [cx, cy], [0.0; 4]),
        ("PINHOLE", &[fx, fy, cx, cy]) => ([fx, fy], [cx, cy], [0.0; 4]),
        ("SIMPLE_RADIAL", &[f, cx, cy, k]) => ([f, f], [cx, cy], [k, 0.0, 0.0, 0.0]),
        ("RADIAL", &[f, cx, cy, k1, k2]) => ([f, f], [cx, cy], [k1, k2, 0.0, 0.0]),
        ("OPENCV", &[fx, fy, cx, cy, k1, k2, p1, p2]) => ([fx, fy], [cx, cy], [k1, k2, p1, p2]),
        ("SIMPLE_PINHOLE" | "PINHOLE" | "SIMPLE_RADIAL" | "RADIAL" | "OPENCV", _) => return Ok(None),
        _ => {
            let model = crate::error::quoted(model.as_bytes());
            let expected =
                "SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL or OPENCV (undistort the images with COLMAP)";
            return Err(Error::unsupported(path, format!("the camera model {model}"), expected));
        }
    };
    Ok(Some(Intrinsics {
        size,
        focal_length: DVec2::from_array(focal_length),
        principal_point: DVec2::from_array(principal_point),
        distortion: Distortion { radial: [k1, k2, 0.0], tangential: [p1, p2] },
    }))
}
