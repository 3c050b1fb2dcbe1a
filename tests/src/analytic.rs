//! What the analytic tests share: pictures as numbers, planes, and where the samples lie.

use glam::{DVec2, DVec3, Vec3};
use splat_core::sampling::SampleTable;
use splat_core::{Camera, Cloud, Film, PixelRect, RenderOptions, Rendered, render};

use crate::scenes::{Surfel, cloud};

/// The picture and its statistics; panics if the scene is not valid.
pub fn rendered(cloud: &Cloud, camera: &Camera, options: &RenderOptions) -> Rendered {
    render(cloud, camera, options, &mut |_| {}).expect("a valid scene")
}

/// The picture alone.
pub fn picture(cloud: &Cloud, camera: &Camera, options: &RenderOptions) -> Film {
    rendered(cloud, camera, options).film
}

/// The pixels' alphas, in the film's order.
pub fn alphas(film: &Film) -> impl Iterator<Item = f64> {
    film.rgba.iter().map(|pixel| f64::from(pixel[3]))
}

/// The pixels of a film with their places in the frame.
pub fn pixels(film: &Film) -> impl Iterator<Item = (i32, i32)> {
    let PixelRect { x0, y0, x1, y1 } = film.window;
    (y0..y1).flat_map(move |y| (x0..x1).map(move |x| (x, y)))
}

/// The centre of a pixel.
pub fn center_of(x: i32, y: i32) -> DVec2 {
    DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5)
}

/// Mean and variance per axis of the pixels' centres, weighted by alpha.
pub fn alpha_moments(film: &Film) -> (DVec2, DVec2) {
    let weighted = |value: &dyn Fn(DVec2) -> DVec2| -> DVec2 {
        let sum: DVec2 = pixels(film).zip(alphas(film)).map(|((x, y), a)| a * value(center_of(x, y))).sum();
        sum / alphas(film).sum::<f64>()
    };
    let mean = weighted(&|p| p);
    (mean, weighted(&|p| (p - mean) * (p - mean)))
}

/// All numbers of a film, as bits, pixel after pixel.
pub fn film_bits(film: &Film) -> Vec<Vec<u32>> {
    let one = |channel: &Option<Vec<f32>>, i: usize| channel.as_ref().map(|values| values[i].to_bits());
    let three = |channel: &Option<Vec<Vec3>>, i: usize| {
        channel.iter().flat_map(|values| values[i].to_array().map(f32::to_bits)).collect::<Vec<_>>()
    };
    (0..film.rgba.len())
        .map(|i| {
            let mut bits = film.rgba[i].map(f32::to_bits).to_vec();
            for channel in [&film.depth, &film.coverage, &film.layers, &film.samples] {
                bits.extend(one(channel, i));
            }
            for channel in [&film.normal, &film.albedo, &film.position, &film.variance] {
                bits.extend(three(channel, i));
            }
            bits.extend(film.id.as_ref().map(|ids| ids[i]));
            bits
        })
        .collect()
}

/// Asserts that two films are the same, to the bit, in every channel.
pub fn assert_same_bits(name: &str, a: &Film, b: &Film) {
    assert_eq!(a.window, b.window, "{name}");
    let (a_bits, b_bits) = (film_bits(a), film_bits(b));
    let differing = a_bits.iter().zip(&b_bits).filter(|(a, b)| a != b).count();
    assert_eq!(differing, 0, "{name}: {differing} of {} pixels differ", a_bits.len());
    assert_eq!(a_bits.len(), b_bits.len(), "{name}");
}

/// A plane as `point` and unit `normal`, in camera space.
#[derive(Debug, Clone, Copy)]
pub struct Plane {
    /// A point of it.
    pub point: DVec3,
    /// Its unit normal.
    pub normal: DVec3,
}

impl Plane {
    /// The plane of a splat, in world space. A camera of [`crate::scenes`] sees it there.
    pub fn of(cloud: &Cloud, index: usize) -> Self {
        let normal = cloud.normals[index].as_dvec3().normalize();
        Self { point: cloud.world_position(index), normal }
    }

    /// The depth at which the pixel position's ray meets the plane.
    pub fn depth(&self, camera: &Camera, pixel: DVec2) -> f64 {
        let screen = (pixel - camera.principal_point) / camera.pixel_scale();
        if camera.is_orthographic() {
            let offset = screen - self.point.truncate();
            self.point.z - self.normal.truncate().dot(offset) / self.normal.z
        } else {
            self.normal.dot(self.point) / self.normal.dot(screen.extend(1.0))
        }
    }
}

/// Where the samples of a pixel lie.
pub fn sample_positions(table: &SampleTable, x: i32, y: i32) -> impl Iterator<Item = DVec2> {
    let corner = DVec2::new(f64::from(x), f64::from(y));
    table.jitter(x, y).iter().map(move |jitter| corner + DVec2::from(jitter.map(f64::from)))
}

/// The samples of a camera under these options.
pub fn sample_table(camera: &Camera, options: &RenderOptions) -> SampleTable {
    SampleTable::new(options, camera.lens(), camera.pixel_scale())
}

/// A plane that fills any picture of these tests, across the axis at this depth.
pub fn wall(depth: f64) -> Surfel {
    Surfel::new(DVec3::new(0.0, 0.0, depth), DVec3::NEG_Z, 20.0)
}

/// A tilted plane that fills a picture of 48 x 36 pixels at a focal length of 60, as one disc of this radius.
pub fn tilted_plane(radius: f64) -> Cloud {
    cloud(&[Surfel::new(DVec3::new(0.2, -0.1, 4.0), DVec3::new(0.5, -0.3, -0.8), radius)])
}
