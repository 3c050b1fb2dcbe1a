//! Eye-dome lighting: shading of a finished picture by its depths alone (after Boucheny 2009).
//!
//! A pixel darkens by how far it lies behind the middle of two opposite neighbours. Their depths are interpolated as those
//! of a plane are (1/w is linear in a perspective picture, w in an orthographic one), so planes of any slope stay as they are;
//! creases, and what lies behind an edge, get dark. Lengths are counted in pixels at the pixel's own depth: neither the
//! scene's unit nor, with a reach that grows with the frame, the size of the picture matters.

use crate::{Camera, Error, Film, PixelRect, Projection};

/// Four of the eight directions; the others are their opposites.
const DIRECTIONS: [[i32; 2]; 4] = [[1, 0], [1, 1], [0, 1], [-1, 1]];

/// Distances of the neighbours, in units of the reach.
const RINGS: [i32; 3] = [1, 2, 4];

/// The nearest neighbours' distance in pixels: 1 for every 480 of the frame's height.
fn reach(frame: [u32; 2]) -> i32 {
    ((frame[1] + 240) / 480).max(1) as i32
}

/// The window that must be rendered for this one to be shaded as it is in the whole frame.
pub fn with_margin(window: PixelRect, frame: [u32; 2]) -> PixelRect {
    let margin = reach(frame) * RINGS[2];
    let wide = PixelRect::new(window.x0 - margin, window.y0 - margin, window.x1 + margin, window.y1 + margin);
    wide.intersect(&PixelRect::new(0, 0, frame[0] as i32, frame[1] as i32))
}

/// Darkens the colours of a film without a background; `strength` 0 leaves them, 1 is the usual one.
///
/// The factor is exp(-2 strength m), m the mean of h/(h + d) over all pairs of neighbours, d their distance and h the depth by
/// which the pixel lies behind their middle, both in pixels. A pair of which one lies outside the film, or has no depth,
/// says nothing.
///
/// # Errors
/// [`Error::Invalid`] if the film has no depths.
pub fn shade(film: &mut Film, camera: &Camera, strength: f64) -> Result<(), Error> {
    let Some(depth) = &film.depth else {
        return Err(Error::invalid("AOVs of the film", "no depth", "depth, for eye-dome lighting"));
    };
    let depths = Depths { depth, window: film.window, camera };
    let reach = reach(film.frame);
    let PixelRect { x0, y0, x1, y1 } = film.window;
    let factors: Vec<f32> = (y0..y1)
        .flat_map(|y| (x0..x1).map(move |x| (x, y)))
        .map(|(x, y)| libm::exp(-2.0 * strength * depths.obscurance(x, y, reach)) as f32)
        .collect();
    for (rgba, factor) in film.rgba.iter_mut().zip(factors) {
        rgba[..3].iter_mut().for_each(|value| *value *= factor);
    }
    // They know nothing of the factors.
    film.sums = None;
    Ok(())
}

/// The depths of a film.
struct Depths<'a> {
    depth: &'a [f32],
    window: PixelRect,
    camera: &'a Camera,
}

impl Depths<'_> {
    /// How much its surroundings hide a pixel, in [0, 1].
    fn obscurance(&self, x: i32, y: i32, reach: i32) -> f64 {
        let Some(centre) = self.at(x, y) else { return 0.0 };
        let mut sum = 0.0;
        for ring in RINGS {
            for [dx, dy] in DIRECTIONS.map(|direction| direction.map(|step| step * ring * reach)) {
                if let (Some(a), Some(b)) = (self.at(x + dx, y + dy), self.at(x - dx, y - dy)) {
                    let distance = f64::from(dx * dx + dy * dy).sqrt();
                    let behind = self.behind(centre, a, b).max(0.0);
                    sum += behind / (behind + distance);
                }
            }
        }
        sum / (RINGS.len() * DIRECTIONS.len()) as f64
    }

    /// How far the depth `centre` lies behind the middle of a plane's depths `a` and `b`, in pixels.
    fn behind(&self, centre: f64, a: f64, b: f64) -> f64 {
        match &self.camera.projection {
            Projection::Perspective { focal_length, .. } => {
                (0.5 * (centre / a + centre / b) - 1.0) * focal_length.y
            }
            Projection::Orthographic { pixels_per_unit } => (centre - 0.5 * (a + b)) * pixels_per_unit,
        }
    }

    /// The depth of a pixel, if it has one.
    fn at(&self, x: i32, y: i32) -> Option<f64> {
        let PixelRect { x0, y0, x1, y1 } = self.window;
        let is_inside = (x0..x1).contains(&x) && (y0..y1).contains(&y);
        let index = || (y - y0) as usize * self.window.width() + (x - x0) as usize;
        is_inside.then(|| f64::from(self.depth[index()])).filter(|depth| depth.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::AovSelection;
    use glam::{DMat4, DVec2};

    const SIZE: u32 = 40;

    fn camera(is_perspective: bool, scale: f64) -> Camera {
        let perspective = Projection::Perspective { focal_length: DVec2::splat(50.0), lens: None };
        let orthographic = Projection::Orthographic { pixels_per_unit: 10.0 / scale };
        Camera {
            width: SIZE,
            height: SIZE,
            projection: if is_perspective { perspective } else { orthographic },
            principal_point: DVec2::splat(0.5 * f64::from(SIZE)),
            world_to_camera: DMat4::IDENTITY,
            near: 1e-3 * scale,
            far: f64::INFINITY,
            clip_planes: Vec::new(),
            distortion: None,
        }
    }

    /// The red of a white film of these depths, shaded.
    fn shaded(camera: &Camera, window: PixelRect, depth: impl Fn(i32, i32) -> f64) -> Vec<f32> {
        let aovs = AovSelection { depth: true, ..AovSelection::default() };
        let mut film = Film::new([SIZE; 2], window, aovs);
        film.rgba.fill([1.0; 4]);
        let places = (window.y0..window.y1).flat_map(|y| (window.x0..window.x1).map(move |x| (x, y)));
        film.depth = Some(places.map(|(x, y)| depth(x, y) as f32).collect());
        shade(&mut film, camera, 1.0).unwrap();
        assert!(film.rgba.iter().all(|rgba| rgba[3] == 1.0 && (0.0..=1.0).contains(&rgba[0])));
        film.rgba.iter().map(|rgba| rgba[0]).collect()
    }

    const WHOLE: PixelRect = PixelRect::new(0, 0, SIZE as i32, SIZE as i32);

    #[test]
    fn planes_of_any_slope_stay_as_they_are() {
        for slope in [0.0, 0.3, -2.0] {
            let perspective = shaded(&camera(true, 1.0), WHOLE, |x, y| {
                1.0 / (1.0 + 0.01 * slope * (f64::from(x) - 0.5 * f64::from(y)))
            });
            let orthographic =
                shaded(&camera(false, 1.0), WHOLE, |x, y| 5.0 + 0.1 * slope * f64::from(x + y));
            // The depths' rounding to f32 is some 1e-5 pixels.
            assert!(perspective.iter().chain(&orthographic).all(|&red| red > 0.9999), "{slope}");
        }
    }

    #[test]
    fn an_edge_darkens_what_lies_behind_it_at_any_scale() {
        for is_perspective in [true, false] {
            let step = |scale: f64| {
                shaded(&camera(is_perspective, scale), WHOLE, |x, _| scale * if x < 20 { 2.0 } else { 3.0 })
            };
            let row = &step(1.0)[20 * 40..][..40];
            assert!(row[..20].iter().all(|&red| red == 1.0), "{row:?}");
            assert!(row[20] < 0.7 && row[20] < row[21] && row[21] < row[23] && row[24] == 1.0, "{row:?}");
            let larger = step(1024.0);
            assert!(step(1.0).iter().zip(&larger).all(|(a, b)| (a - b).abs() < 1e-6));
        }
    }

    #[test]
    fn a_crop_with_its_margin_is_a_part_of_the_whole() {
        let depth = |x: i32, y: i32| {
            if (x * 7 + y * 3) % 11 == 0 { f64::INFINITY } else { 2.0 + f64::from((x * y) % 5) }
        };
        let camera = camera(true, 1.0);
        let whole = shaded(&camera, WHOLE, depth);
        let crop = PixelRect::new(1, 17, 22, 40);
        let wide = with_margin(crop, [SIZE; 2]);
        assert_eq!(wide, PixelRect::new(0, 13, 26, 40));
        let part = shaded(&camera, wide, depth);
        for (x, y) in (crop.y0..crop.y1).flat_map(|y| (crop.x0..crop.x1).map(move |x| (x, y))) {
            let in_part = part[(y - wide.y0) as usize * wide.width() + (x - wide.x0) as usize];
            assert_eq!(in_part, whole[y as usize * SIZE as usize + x as usize]);
        }
    }

    #[test]
    fn a_film_without_depths_is_refused() {
        let mut film = Film::new([SIZE; 2], WHOLE, AovSelection::default());
        assert!(shade(&mut film, &camera(true, 1.0), 1.0).is_err());
    }
}
