//! Cameras from files, in the size that is asked for, and cameras that are fitted to the cloud.

use crate::arguments::{CameraArguments, RenderArguments};
use crate::console::Console;
use crate::resolve::{framing, up};
use crate::turntable::Turntable;
use crate::usage::UsageError;
use crate::{map, turntable};
use splat_core::fit::fit;
use splat_core::{Camera, Cloud, Projection, RenderOptions};
use splat_io::{CameraDefaults, CameraSet, read_cameras, read_cameras_with};
use std::path::Path;

/// Reads the cameras of a file, in the size that is asked for. `near` is the default near depth, in scene units.
///
/// # Errors
/// What the reader says; [`UsageError`] for a size of another shape, and an intrinsic of several cameras.
pub fn read(
    path: &Path,
    arguments: &CameraArguments,
    near: f64,
    console: Console,
) -> anyhow::Result<CameraSet> {
    let intrinsic = arguments.frames.intrinsic.as_deref().map(|path| intrinsic(path, near)).transpose()?;
    let defaults = CameraDefaults { near, size: arguments.size, intrinsic };
    let mut set = read_cameras_with(path, &defaults)?;
    for assumption in &set.assumptions {
        console.note(format_args!("{}: {assumption}", path.display()));
    }
    if let Some(size) = arguments.size {
        for named in &mut set.cameras {
            resize(&mut named.camera, size)?;
        }
    }
    Ok(set)
}

/// The camera of a file that has one.
fn intrinsic(path: &Path, near: f64) -> anyhow::Result<Camera> {
    let mut cameras = read_cameras(path, near)?.cameras;
    match cameras.len() {
        1 => Ok(cameras.remove(0).camera),
        count => Err(UsageError::new(format!(
            "--intrinsic {}: found {count} cameras, expected a file of one",
            path.display()
        ))
        .into()),
    }
}

/// Makes a camera's picture larger or smaller: the same view in other pixels.
fn resize(camera: &mut Camera, [width, height]: [u32; 2]) -> Result<(), UsageError> {
    let [from, to] = [[camera.width, camera.height], [width, height]].map(|size| size.map(f64::from));
    // Some one factor must give both sides, each rounded to whole pixels.
    let least = [0, 1].map(|axis| (to[axis] - 0.5) / from[axis]);
    let most = [0, 1].map(|axis| (to[axis] + 0.5) / from[axis]);
    if least[0].max(least[1]) > most[0].min(most[1]) {
        let fitting = (to[0] / from[0] * from[1]).round().max(1.0);
        return Err(UsageError::new(format!(
            "--size {width}x{height} has not the shape of the camera's picture, {}x{}: {width}x{fitting} would",
            camera.width, camera.height
        )));
    }
    let factor = glam::DVec2::new(to[0] / from[0], to[1] / from[1]);
    match &mut camera.projection {
        Projection::Perspective { focal_length, .. } => *focal_length *= factor,
        Projection::Orthographic { pixels_per_unit } => *pixels_per_unit *= factor.x,
    }
    camera.principal_point *= factor;
    [camera.width, camera.height] = [width, height];
    Ok(())
}

/// A camera that is fitted to the cloud, or the cameras of a turntable.
#[derive(Debug)]
pub struct Fitted {
    camera: Camera,
    turntable: Option<Turntable>,
}

impl Fitted {
    /// Fits to a prepared cloud.
    ///
    /// # Errors
    /// The renderer's own if the cloud cannot be shown; [`UsageError`] for a map that is too large.
    pub fn new(whole: &RenderArguments, cloud: &Cloud, options: &RenderOptions) -> anyhow::Result<Self> {
        let arguments = &whole.camera;
        let framing = framing(arguments, cloud);
        let camera = if arguments.map.scale.is_some() {
            map::camera(whole, cloud, options)?
        } else if arguments.frames.turntable.is_some() {
            fit(&turntable::hull(cloud, up(arguments, cloud), options.cutoff.sqrt()), &framing, options)?
        } else {
            fit(cloud, &framing, options)?
        };
        let turntable =
            arguments.frames.turntable.map(|count| Turntable::new(cloud, up(arguments, cloud), count));
        Ok(Self { camera, turntable })
    }

    /// The camera of a frame, counted from 0.
    pub fn camera(&self, index: usize) -> Camera {
        let mut camera = self.camera.clone();
        if let Some(turntable) = &self.turntable {
            camera.world_to_camera *= turntable.turn(index);
        }
        camera
    }
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use glam::{DMat4, DVec2};

    /// A camera of 640 x 480 pixels.
    pub fn camera() -> Camera {
        Camera {
            width: 640,
            height: 480,
            projection: Projection::Perspective { focal_length: DVec2::new(500.0, 501.0), lens: None },
            principal_point: DVec2::new(310.0, 250.0),
            world_to_camera: DMat4::IDENTITY,
            near: 1.0,
            far: f64::INFINITY,
            clip_planes: Vec::new(),
            distortion: None,
        }
    }

    #[test]
    fn a_picture_is_the_same_view_in_any_size() {
        let mut small = camera();
        resize(&mut small, [320, 240]).unwrap();
        assert_eq!((small.width, small.height), (320, 240));
        assert_eq!(small.pixel_scale(), DVec2::new(250.0, 250.5));
        assert_eq!(small.principal_point, DVec2::new(155.0, 125.0));
        let mut same = camera();
        resize(&mut same, [640, 480]).unwrap();
        assert_eq!(same, camera());
        // A third of 480 is 160, of 640 it is 213.3.
        resize(&mut camera(), [213, 160]).unwrap();
        for size in [[212, 160], [215, 160], [640, 479], [480, 640]] {
            assert!(resize(&mut camera(), size).is_err(), "{size:?}");
        }
        let message = resize(&mut camera(), [320, 200]).unwrap_err().to_string();
        assert!(message.contains("the camera's picture, 640x480: 320x240 would"), "{message}");
        let mut map = Camera { projection: Projection::Orthographic { pixels_per_unit: 3.0 }, ..camera() };
        resize(&mut map, [1280, 960]).unwrap();
        assert_eq!(map.pixel_scale(), DVec2::splat(6.0));
    }
}
