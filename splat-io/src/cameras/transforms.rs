//! `transforms.json` of nerfstudio, instant-ngp and Blender's synthetic scenes.

use super::{
    CameraDefaults, CameraSet, Intrinsics, NamedCamera, from_json, inverse, name_or_number, side, similarity,
};
use crate::{Error, Place};
use glam::{DMat4, DVec2, DVec4};
use serde::Deserialize;
use splat_core::{Camera, Distortion};
use std::collections::BTreeSet;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Width and height of the pictures of Blender's synthetic scenes, which their files do not say.
const BLENDER_SIZE: [u32; 2] = [800, 800];

/// What each frame says. The text is read once for [`Pose`] and once for [`Fields`]: a flattened structure would keep a
/// copy of all else that is in the file.
#[derive(Debug, Deserialize)]
struct Frames<T> {
    frames: Vec<T>,
}

/// Where a camera is.
#[derive(Debug, Deserialize)]
struct Pose {
    file_path: Option<String>,
    /// Camera to world, rows.
    transform_matrix: Vec<[f64; 4]>,
}

/// What may stand at the top or in a frame; lengths are in pixels, angles in radians.
#[derive(Debug, Clone, Default, Deserialize)]
struct Fields {
    camera_model: Option<String>,
    is_fisheye: Option<bool>,
    w: Option<f64>,
    h: Option<f64>,
    fl_x: Option<f64>,
    fl_y: Option<f64>,
    camera_angle_x: Option<f64>,
    camera_angle_y: Option<f64>,
    cx: Option<f64>,
    cy: Option<f64>,
    k1: Option<f64>,
    k2: Option<f64>,
    k3: Option<f64>,
    k4: Option<f64>,
    p1: Option<f64>,
    p2: Option<f64>,
}

impl Fields {
    /// These, and what they leave open from `shared`.
    fn or(self, shared: &Self) -> Self {
        Self {
            camera_model: self.camera_model.or_else(|| shared.camera_model.clone()),
            is_fisheye: self.is_fisheye.or(shared.is_fisheye),
            w: self.w.or(shared.w),
            h: self.h.or(shared.h),
            fl_x: self.fl_x.or(shared.fl_x),
            fl_y: self.fl_y.or(shared.fl_y),
            camera_angle_x: self.camera_angle_x.or(shared.camera_angle_x),
            camera_angle_y: self.camera_angle_y.or(shared.camera_angle_y),
            cx: self.cx.or(shared.cx),
            cy: self.cy.or(shared.cy),
            k1: self.k1.or(shared.k1),
            k2: self.k2.or(shared.k2),
            k3: self.k3.or(shared.k3),
            k4: self.k4.or(shared.k4),
            p1: self.p1.or(shared.p1),
            p2: self.p2.or(shared.p2),
        }
    }

    /// Refuses lenses that are not those of Brown and Conrady.
    fn check_model(&self, path: &Path) -> Result<(), Error> {
        const MODELS: [&str; 5] = ["OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL"];
        let other = self.camera_model.as_deref().filter(|model| !MODELS.contains(model));
        let found = if let Some(model) = other {
            let model = crate::error::quoted(model.as_bytes());
            format!("the camera model {model}")
        } else if self.is_fisheye == Some(true) {
            "a fisheye camera (is_fisheye)".to_owned()
        } else if let Some(k4) = self.k4.filter(|&k4| k4 != 0.0) {
            format!("a distortion with k4 = {k4}")
        } else {
            return Ok(());
        };
        Err(Error::unsupported(path, found, MODELS.join(", ")))
    }

    fn size(&self, path: &Path) -> Result<Option<[u32; 2]>, Error> {
        match (self.w, self.h) {
            (Some(w), Some(h)) => Ok(Some([side(w, path, "w")?, side(h, path, "h")?])),
            _ => Ok(None),
        }
    }

    fn intrinsics(&self, size: [u32; 2], path: &Path) -> Result<Intrinsics, Error> {
        let [w, h] = size.map(f64::from);
        let from_angle = |field, angle: Option<f64>, side: f64| match angle {
            Some(angle) if angle > 0.0 && angle < std::f64::consts::PI => {
                Ok(Some(0.5 * side / libm::tan(0.5 * angle)))
            }
            Some(angle) => {
                let expected = "an angle in radians, between 0 and pi";
                Err(Error::invalid(path, Place::Field(field), angle.to_string(), expected))
            }
            None => Ok(None),
        };
        let fx = match self.fl_x {
            Some(fx) => Some(fx),
            None => from_angle("camera_angle_x", self.camera_angle_x, w)?,
        };
        // An angle down the picture says nothing beside a focal length: files have been seen where the two disagree.
        let fy = match (self.fl_y, self.fl_x) {
            (Some(fy), _) => Some(fy),
            (None, Some(fx)) => Some(fx),
            (None, None) => from_angle("camera_angle_y", self.camera_angle_y, h)?,
        };
        let Some(fx) = fx.or(fy) else {
            let expected = "a focal length: fl_x or camera_angle_x";
            return Err(Error::invalid(path, Place::Field("fl_x"), "nothing", expected));
        };
        let coefficient = |value: Option<f64>| value.unwrap_or(0.0);
        Ok(Intrinsics {
            size,
            focal_length: DVec2::new(fx, fy.unwrap_or(fx)),
            principal_point: DVec2::new(self.cx.unwrap_or(0.5 * w), self.cy.unwrap_or(0.5 * h)),
            distortion: Distortion {
                radial: [self.k1, self.k2, self.k3].map(coefficient),
                tangential: [self.p1, self.p2].map(coefficient),
            },
        })
    }
}

/// Reads the file.
pub(super) fn read(text: &str, path: &Path, defaults: &CameraDefaults) -> Result<CameraSet, Error> {
    let shared: Fields = from_json(text, path)?;
    let own: Frames<Fields> = from_json(text, path)?;
    let poses: Frames<Pose> = from_json(text, path)?;
    let mut assumptions = BTreeSet::new();
    let frames = own.frames.into_iter().zip(poses.frames).enumerate();
    let cameras = frames.map(|(index, (own, pose))| {
        let name = pose.file_path.map(|name| name.trim_start_matches("./").to_owned());
        let name = name_or_number(name, index);
        let fields = own.or(&shared);
        let camera = camera(&fields, &pose.transform_matrix, &name, path, defaults, &mut assumptions);
        let camera = camera.map_err(|error| error.of_camera(&name))?;
        NamedCamera::new(name, camera, path)
    });
    Ok(CameraSet {
        path: path.to_owned(),
        format: "transforms.json",
        cameras: cameras.collect::<Result<_, _>>()?,
        assumptions: assumptions.into_iter().collect(),
    })
}

fn camera(
    fields: &Fields,
    rows: &[[f64; 4]],
    name: &str,
    path: &Path,
    defaults: &CameraDefaults,
    assumptions: &mut BTreeSet<String>,
) -> Result<Camera, Error> {
    fields.check_model(path)?;
    let matrix = match *rows {
        [x, y, z] => [x, y, z, [0.0, 0.0, 0.0, 1.0]],
        [x, y, z, w] => [x, y, z, w],
        _ => {
            let (found, place) = (format!("{} rows", rows.len()), Place::Field("transform_matrix"));
            return Err(Error::invalid(path, place, found, "3 or 4 rows of 4 numbers"));
        }
    };
    let place = similarity(DMat4::from_cols_array_2d(&matrix).transpose(), path, "transform_matrix")?;
    // From y up and z backward to y down and z forward.
    let place = place * DMat4::from_diagonal(DVec4::new(1.0, -1.0, -1.0, 1.0));
    let size = match (fields.size(path)?, defaults.size) {
        (Some(size), _) => size,
        (None, Some(size)) => size,
        (None, None) => match size_of_image(path, name) {
            Some(size) => {
                assumptions.insert("the pictures' size is that of the images beside the file".to_owned());
                size
            }
            None => {
                assumptions.insert(
                    "the file says no size and no image is beside it: 800 x 800 pixels, as Blender's scenes have"
                        .to_owned(),
                );
                BLENDER_SIZE
            }
        },
    };
    Ok(fields.intrinsics(size, path)?.camera(inverse(place), defaults.near))
}

/// Width and height of the PNG image of a frame, `.png` added or not, if there is such a file.
fn size_of_image(path: &Path, name: &str) -> Option<[u32; 2]> {
    let folder = path.parent()?;
    [folder.join(name), folder.join(format!("{name}.png"))].iter().find_map(|image| {
        let mut start = [0; 24];
        if !image.is_file() {
            return None;
        }
        File::open(image).ok()?.read_exact(&mut start).ok()?;
        let is_png = start.starts_with(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR");
        let side = |at: usize| {
            let side = u32::from_be_bytes([start[at], start[at + 1], start[at + 2], start[at + 3]]);
            (1..=splat_core::camera::MAX_SIDE).contains(&side).then_some(side)
        };
        if is_png { Some([side(16)?, side(20)?]) } else { None }
    })
}
