//! Cameras once around a cloud, all at one distance: what is turned does not jump.

use glam::{DMat4, DQuat, DVec3};
use splat_core::fit::Up;
use splat_core::{Cloud, Shapes};
use std::f64::consts::PI;

/// An axis to turn around.
#[derive(Debug)]
pub struct Turntable {
    centre: DVec3,
    up: DVec3,
    count: u32,
}

impl Turntable {
    /// Around the axis through the middle of a cloud, in `count` steps.
    pub fn new(cloud: &Cloud, up: Up, count: u32) -> Self {
        let [up, ..] = up.axes();
        Self { centre: centre(cloud), up, count }
    }

    /// How the world turns for a frame, counted from 0: the camera goes to the right.
    pub fn turn(&self, index: usize) -> DMat4 {
        let half = -PI * index as f64 / f64::from(self.count);
        let axis = libm::sin(half) * self.up;
        let rotation = DQuat::from_xyzw(axis.x, axis.y, axis.z, libm::cos(half));
        DMat4::from_translation(self.centre)
            * DMat4::from_quat(rotation)
            * DMat4::from_translation(-self.centre)
    }
}

/// The middle of the cloud's box.
fn centre(cloud: &Cloud) -> DVec3 {
    cloud.bounds().map_or(DVec3::ZERO, |(low, high)| 0.5 * (low + high))
}

/// A part of the cloud between two heights.
#[derive(Debug, Clone, Copy)]
struct Slab {
    low: f64,
    high: f64,
    /// Farthest from the axis.
    radius: f64,
}

/// Number of slabs.
const SLABS: usize = 64;

/// Corners of a ring.
const CORNERS: usize = 64;

/// Rings of points that hold all that a cloud may reach when it is turned around its middle; whatever shows them shows the
/// cloud from every side. `radius` is that of splats, in sigma.
pub fn hull(cloud: &Cloud, up: Up, radius: f64) -> Cloud {
    let [up, front, side] = up.axes();
    let centre = centre(cloud);
    let splats = (0..cloud.len()).filter(|&index| cloud.defect(index).is_none()).map(|index| {
        let reach = radius
            * f64::from(match &cloud.shapes {
                Shapes::Discs(sizes) => sizes[index],
                Shapes::Ellipses(axes) => axes[index][0].length().max(axes[index][1].length()),
            });
        let position = cloud.world_position(index) - centre;
        let height = position.dot(up);
        Slab { low: height - reach, high: height + reach, radius: (position - height * up).length() + reach }
    });
    let (bottom, top) = cloud.bounds().map_or((0.0, 0.0), |(low, high)| {
        let half = (0.5 * (high - low)).dot(up).abs();
        (-half, half)
    });
    let mut slabs = [None::<Slab>; SLABS];
    for splat in splats {
        let part = (0.5 * (splat.low + splat.high) - bottom) / (top - bottom);
        let slab = &mut slabs[((part * SLABS as f64) as usize).min(SLABS - 1)];
        *slab = Some(slab.map_or(splat, |slab| Slab {
            low: slab.low.min(splat.low),
            high: slab.high.max(splat.high),
            radius: slab.radius.max(splat.radius),
        }));
    }
    // A polygon around the circle, not in it.
    let widen = 1.0 / libm::cos(PI / CORNERS as f64);
    let ring = |Slab { low, high, radius }: Slab| {
        (0..2 * CORNERS).map(move |corner| {
            let angle = PI * corner as f64 / CORNERS as f64;
            let outwards = libm::cos(angle) * front + libm::sin(angle) * side;
            centre + radius * widen * outwards + if corner % 2 == 0 { low } else { high } * up
        })
    };
    let points: Vec<DVec3> = slabs.into_iter().flatten().flat_map(ring).collect();
    let mut hull = Cloud::from_points(&points);
    hull.normals = vec![up.as_vec3(); points.len()];
    hull.shapes = Shapes::Discs(vec![f32::MIN_POSITIVE; points.len()]);
    hull
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::fit::{Framing, fit};
    use splat_core::{Camera, RenderOptions};

    /// A long cloud that lies aslant, far from zero.
    fn cloud() -> Cloud {
        let points: Vec<DVec3> = (0..50)
            .map(|i| f64::from(i) * DVec3::new(0.3, 0.02, 0.1) + DVec3::new(100.0, f64::from(i % 3), 7.0))
            .collect();
        let mut cloud = Cloud::from_points(&points);
        cloud.normals = vec![glam::Vec3::X; points.len()];
        cloud.shapes = Shapes::Discs(vec![0.25; points.len()]);
        cloud
    }

    fn cameras(up: Up, orthographic: bool) -> Vec<Camera> {
        let options = RenderOptions::default();
        let framing = Framing { width: 200, height: 150, up, azimuth: 20.0, elevation: 30.0, orthographic };
        let camera = fit(&hull(&cloud(), up, options.cutoff.sqrt()), &framing, &options).unwrap();
        let turntable = Turntable::new(&cloud(), up, 8);
        let turned = |index| Camera {
            world_to_camera: camera.world_to_camera * turntable.turn(index),
            ..camera.clone()
        };
        (0..8).map(turned).collect()
    }

    #[test]
    fn every_frame_shows_the_whole_cloud_from_one_distance() {
        let cloud = cloud();
        for up in [Up::Y, Up::Z, Up::MinusY, Up::MinusZ] {
            for orthographic in [false, true] {
                let cameras = cameras(up, orthographic);
                let mut used: f64 = 0.0;
                for camera in &cameras {
                    for index in 0..cloud.len() {
                        let p = camera.world_to_camera.transform_point3(cloud.world_position(index));
                        let w = if orthographic { 1.0 } else { p.z };
                        let pixel = p.truncate() / w * camera.pixel_scale() + camera.principal_point;
                        let reach = 0.5 / w * camera.pixel_scale().x;
                        assert!(
                            pixel.min_element() > reach && pixel.x < 200.0 - reach && pixel.y < 150.0 - reach
                        );
                        let place = (pixel - camera.principal_point).abs() + reach;
                        used = used.max(place.x / 100.0).max(place.y / 75.0);
                    }
                }
                assert!(used > 0.75, "{up:?}: {used} of the frame");
                let centre = centre(&cloud);
                let distances = cameras.iter().map(|camera| (camera.eye() - centre).length());
                let distances: Vec<f64> = distances.collect();
                assert!(distances.iter().all(|d| (d - distances[0]).abs() < 1e-9), "{distances:?}");
            }
        }
    }

    #[test]
    fn the_camera_goes_to_the_right() {
        for up in [Up::Y, Up::Z, Up::MinusY, Up::MinusZ] {
            let [axis, front, side] = up.axes();
            let turned = Turntable::new(&Cloud::default(), up, 4).turn(1);
            // A camera in front would now see what is at the right where the front was.
            assert!((turned.transform_vector3(side) - front).length() < 1e-15, "{up:?}");
            assert!((turned.transform_vector3(axis) - axis).length() < 1e-15);
        }
    }
}
