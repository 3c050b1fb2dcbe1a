//! `cameras.json` beside a trained 3DGS model: a list of the cameras that it was trained with.

use super::{CameraSet, Intrinsics, NamedCamera, from_json, inverse, name_or_number, similarity};
use crate::Error;
use glam::{DMat3, DMat4, DVec2, DVec3};
use serde::Deserialize;
use splat_core::Distortion;
use std::path::Path;

/// One camera of the list.
#[derive(Debug, Deserialize)]
struct Entry {
    img_name: Option<String>,
    width: u32,
    height: u32,
    fx: f64,
    fy: f64,
    /// The eye.
    position: [f64; 3],
    /// Camera to world, rows.
    rotation: [[f64; 3]; 3],
}

/// Reads the list.
pub(super) fn read(text: &str, path: &Path, near: f64) -> Result<CameraSet, Error> {
    let entries: Vec<Entry> = from_json(text, path)?;
    let cameras = entries.into_iter().enumerate().map(|(index, entry)| {
        let mut place = DMat4::from_mat3(DMat3::from_cols_array_2d(&entry.rotation).transpose());
        place.w_axis = DVec3::from_array(entry.position).extend(1.0);
        let name = name_or_number(entry.img_name, index);
        let place = similarity(place, path, "rotation").map_err(|error| error.of_camera(&name))?;
        let size = [entry.width, entry.height];
        let intrinsics = Intrinsics {
            size,
            focal_length: DVec2::new(entry.fx, entry.fy),
            principal_point: 0.5 * DVec2::from_array(size.map(f64::from)),
            distortion: Distortion::default(),
        };
        NamedCamera::new(name, intrinsics.camera(inverse(place), near), path)
    });
    Ok(CameraSet {
        path: path.to_owned(),
        format: "3DGS cameras.json",
        cameras: cameras.collect::<Result<_, _>>()?,
        assumptions: vec!["the principal point is the middle of the picture".to_owned()],
    })
}
