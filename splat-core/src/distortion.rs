//! Lens distortion: between the film, on which the samples lie, and the picture of the ideal camera, in which splats are
//! set up and evaluated. SPEC section 1.
//!
//! Only + - * / sqrt, so that all cores see the same bits.

use crate::Camera;
use crate::camera::Distortion;
use crate::setup::Extent;
use glam::{DMat2, DVec2};

/// The least slope of the distortion: where the film is stretched more than eightfold nothing is seen.
const LEAST_SLOPE: f64 = 0.125;

/// Newton's method is done with the step after the residual fell below this, in pixels: that leaves a millionth of one.
const RESIDUAL: f64 = 1.0 / 512.0;

/// Steps of Newton's method, and halvings of one, after which a place sees nothing. Real lenses take three and none.
const STEPS: usize = 32;
const HALVINGS: usize = 10;

/// A sample is found by so many steps with the slope at its pixel's middle, if the residual, in pixels, is below this before
/// the last one: each divides it by a thousand where pixels are small. Else Newton's method starts anew.
const CHORDS: usize = 3;
const CHORD_RESIDUAL: f64 = 1.0 / 1_048_576.0;

/// Steps of the search for the radius of what is seen: 512 are enough for any real lens.
const RADIUS_STEPS: usize = 4096;

impl Distortion {
    /// Whether it leaves every point where it is.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Where an ideal point is seen, both in tan units.
    #[inline(always)]
    pub fn apply(&self, ideal: DVec2) -> DVec2 {
        let [p1, p2] = self.tangential;
        let r2 = ideal.length_squared();
        let p = DVec2::new(p2, p1);
        ideal * (self.factor(r2) + 2.0 * p.dot(ideal)) + p * r2
    }

    /// 1 + k1 r2 + k2 r2^2 + k3 r2^3.
    #[inline(always)]
    fn factor(&self, r2: f64) -> f64 {
        let [k1, k2, k3] = self.radial;
        1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    }

    /// The derivative of [`Self::apply`]. It is symmetric: distortion is the gradient of a function.
    fn jacobian(&self, ideal: DVec2) -> DMat2 {
        let [k1, k2, k3] = self.radial;
        let [p1, p2] = self.tangential;
        let p = DVec2::new(p2, p1);
        let r2 = ideal.length_squared();
        let diagonal = self.factor(r2) + 2.0 * p.dot(ideal);
        let outer = ideal * (2.0 * (k1 + r2 * (2.0 * k2 + r2 * (3.0 * k3))));
        let cross = ideal.x * outer.y + 2.0 * (ideal.x * p.y + ideal.y * p.x);
        DMat2::from_cols(
            DVec2::new(diagonal + ideal.x * (outer.x + 4.0 * p.x), cross),
            DVec2::new(cross, diagonal + ideal.y * (outer.y + 4.0 * p.y)),
        )
    }

    /// The least slope of the distortion in any direction at radius r, at least: the lesser of those along the radius and
    /// across it, less what the tangential terms can take away.
    fn slope(&self, r: f64) -> f64 {
        let [k1, k2, k3] = self.radial;
        let r2 = r * r;
        let along = 1.0 + r2 * (3.0 * k1 + r2 * (5.0 * k2 + r2 * (7.0 * k3)));
        self.factor(r2).min(along) - 6.0 * self.tangential_size() * r
    }

    /// The greatest second derivative within radius r, at most.
    ///
    /// That of x r^2n is 2n (2n + 1) r^(2n - 1), along the radius; that of the tangential terms 6 |p|.
    fn curvature(&self, r: f64) -> f64 {
        let [k1, k2, k3] = self.radial.map(f64::abs);
        let r2 = r * r;
        6.0 * self.tangential_size() + r * (6.0 * k1 + r2 * (20.0 * k2 + r2 * (42.0 * k3)))
    }

    fn tangential_size(&self) -> f64 {
        DVec2::from(self.tangential).length()
    }
}

/// The lens distortion of a camera, both ways. *Film* places are those of the picture, *ideal* ones where a camera without
/// distortion would see the same; both in pixels.
///
/// What is seen lies within a disc of the ideal picture about the axis, in which the slope is at least 1/8 in
/// all directions: there distortion is the gradient of a convex function, so no two places are seen in the same one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilmMap {
    distortion: Distortion,
    scale: DVec2,
    inverse_scale: DVec2,
    principal_point: DVec2,
    /// Radius of the disc, in tan units; no larger than the frame needs.
    radius: f64,
    /// Nothing is seen at a place of the film farther from the axis than this, in tan units.
    film_radius: f64,
    /// Radius of the pixel filter.
    filter_radius: f64,
}

impl FilmMap {
    /// The map of a perspective camera whose pixels take samples up to `filter_radius` pixels from their middles. `None`
    /// where nothing is distorted.
    pub fn new(camera: &Camera, filter_radius: f64) -> Option<Self> {
        let distortion = camera.distortion.filter(|distortion| !distortion.is_none())?;
        let mut map = Self {
            distortion,
            scale: camera.pixel_scale(),
            inverse_scale: camera.pixel_scale().recip(),
            principal_point: camera.principal_point,
            radius: 0.0,
            film_radius: 0.0,
            filter_radius,
        };
        let size = DVec2::new(camera.width.into(), camera.height.into());
        let low = map.tangents(DVec2::splat(-filter_radius)).abs();
        let high = map.tangents(size + filter_radius).abs();
        map.radius = seen_radius(&distortion, low.max(high).length());
        let r2 = map.radius * map.radius;
        map.film_radius = map.radius * distortion.factor(r2) + 3.0 * distortion.tangential_size() * r2;
        Some(map)
    }

    /// The largest coordinate of a sample relative to [`PixelView::corner`], in pixels.
    pub fn max_jitter(&self) -> f64 {
        1.0 + 2.0 / LEAST_SLOPE * self.filter_radius
    }

    /// A box around all places of the ideal picture that are seen.
    pub fn seen(&self) -> [Extent; 2] {
        [0, 1].map(|axis| {
            let half = self.radius * self.scale[axis];
            let middle = self.principal_point[axis];
            Extent { min: middle - half, max: middle + half }
        })
    }

    /// The film's place of an ideal one.
    pub fn film(&self, ideal: DVec2) -> DVec2 {
        self.pixels(self.distortion.apply(self.tangents(ideal)))
    }

    /// The ideal place of one of the film, if there anything is seen.
    pub fn ideal(&self, film: DVec2) -> Option<DVec2> {
        let film = self.tangents(film);
        self.solve(film, film).map(|ideal| self.pixels(ideal))
    }

    /// The derivative of [`Self::film`] at an ideal place.
    pub fn slope(&self, ideal: DVec2) -> DMat2 {
        let slope = self.distortion.jacobian(self.tangents(ideal));
        let [fx, fy] = self.scale.to_array();
        DMat2::from_cols(
            DVec2::new(slope.x_axis.x, slope.x_axis.y * (fy / fx)),
            DVec2::new(slope.y_axis.x * (fx / fy), slope.y_axis.y),
        )
    }

    /// How far the next pixels in x and in y look from one that looks at an ideal place (its columns): the inverse of
    /// [`Self::slope`] there, or at the nearest place that is seen.
    pub fn next_pixels(&self, ideal: DVec2) -> DMat2 {
        let tangents = self.tangents(ideal).clamp_length_max(self.radius);
        self.slope(self.pixels(tangents)).inverse()
    }

    /// How far [`Self::film`] may be from its tangent at `ideal`, per axis, at places around it at most `reach` pixels away,
    /// per axis: half of the greatest second derivative times the squared distance.
    pub fn bend(&self, ideal: DVec2, reach: DVec2) -> DVec2 {
        let distance = (reach * self.inverse_scale).length();
        let curvature = self.distortion.curvature(self.tangents(ideal).length() + distance);
        self.scale * (0.5 * curvature * distance * distance)
    }

    /// A box of the film that holds what is seen of a box of the ideal picture; `None` if that is nothing.
    pub fn film_box(&self, ideal: &[Extent; 2]) -> Option<[Extent; 2]> {
        let seen = self.seen();
        let [x, y] = [0, 1].map(|axis| Extent {
            min: ideal[axis].min.max(seen[axis].min),
            max: ideal[axis].max.min(seen[axis].max),
        });
        if x.min > x.max || y.min > y.max {
            return None;
        }
        let middle = DVec2::new(x.min + x.max, y.min + y.max) * 0.5;
        let half = DVec2::new(x.max - x.min, y.max - y.min) * 0.5;
        let slope = self.slope(middle);
        let reach = slope.x_axis.abs() * half.x + slope.y_axis.abs() * half.y + self.bend(middle, half);
        let [low, high] = [self.film(middle) - reach, self.film(middle) + reach];
        Some([0, 1].map(|axis| Extent { min: low[axis], max: high[axis] }))
    }

    /// What a pixel of the film sees; `None` if its middle sees nothing, and so all of it.
    pub fn pixel(&self, x: i32, y: i32) -> Option<PixelView<'_>> {
        let film = self.tangents(DVec2::new(x.into(), y.into()) + 0.5);
        let ideal = self.solve(film, film)?;
        let corner = self.pixels(ideal).floor();
        // So that the distance from any splat's pixel is an integer.
        let fits = corner.abs().max_element() < f64::from(1 << 30);
        fits.then(|| PixelView {
            map: self,
            corner: [corner.x as i32, corner.y as i32],
            film,
            ideal,
            inverse: self.distortion.jacobian(ideal).inverse(),
        })
    }

    /// The ideal place that is seen at a place of the film, both in tan units: Newton's method from a place to start at.
    fn solve(&self, film: DVec2, start: DVec2) -> Option<DVec2> {
        let may_be_seen = film.length_squared() <= self.film_radius * self.film_radius;
        if !may_be_seen {
            return None;
        }
        let squared_radius = self.radius * self.radius;
        let mut ideal = start;
        if start.length_squared() > squared_radius {
            ideal *= self.radius / start.length();
        }
        let mut residual = film - self.distortion.apply(ideal);
        for _ in 0..STEPS {
            let mut step = self.distortion.jacobian(ideal).inverse() * residual;
            if (residual * self.scale).abs().max_element() < RESIDUAL {
                ideal += step;
                return (ideal.length_squared() <= squared_radius).then_some(ideal);
            }
            // The whole step, or as much of it as leads nearer.
            let mut next = None;
            for _ in 0..HALVINGS {
                let place = ideal + step;
                let left = film - self.distortion.apply(place);
                if place.length_squared() <= squared_radius
                    && left.length_squared() < residual.length_squared()
                {
                    next = Some((place, left));
                    break;
                }
                step *= 0.5;
            }
            (ideal, residual) = next?;
        }
        None
    }

    /// Tan units from pixels.
    fn tangents(&self, pixels: DVec2) -> DVec2 {
        (pixels - self.principal_point) * self.inverse_scale
    }

    /// Pixels from tan units.
    fn pixels(&self, tangents: DVec2) -> DVec2 {
        tangents * self.scale + self.principal_point
    }
}

/// The radius of the disc in which the slope is at least [`LEAST_SLOPE`], as far as film places up to `farthest` from the
/// axis can see; in tan units. 0 if there is none (coefficients or places that are no camera's).
fn seen_radius(distortion: &Distortion, farthest: f64) -> f64 {
    let stride = farthest / 64.0;
    let tangential = distortion.tangential_size();
    let mut r = 0.0;
    for _ in 0..RADIUS_STEPS {
        // The film's nearest place of this radius.
        if r * (distortion.factor(r * r) - 3.0 * tangential * r) > farthest {
            break;
        }
        // So far the slope cannot fall to the least.
        let step = stride.min((distortion.slope(r) - LEAST_SLOPE) / distortion.curvature(r + stride));
        let goes_on = step > stride * 1e-6;
        if !goes_on {
            break;
        }
        r += step;
    }
    r
}

/// What a pixel of the film sees of the ideal picture.
#[derive(Debug, Clone, Copy)]
pub struct PixelView<'a> {
    map: &'a FilmMap,
    /// The ideal pixel from whose corner its samples are counted: that in which its middle lies.
    pub corner: [i32; 2],
    /// Its middle, on the film and ideal, in tan units.
    film: DVec2,
    ideal: DVec2,
    /// The slope of the ideal place there.
    inverse: DMat2,
}

impl PixelView<'_> {
    /// The ideal place of its middle, in pixels.
    pub fn middle(&self) -> DVec2 {
        self.map.pixels(self.ideal)
    }

    /// The ideal places of samples (an array for x, one for y), relative to [`Self::corner`] as those on the film are to the
    /// pixel's corner. Not numbers where nothing is seen.
    ///
    /// Plain loops over lanes: compilers take as many at once as the processor can, and the bits are the same.
    #[inline(always)]
    pub fn samples<const N: usize>(&self, jitter: &[[f32; N]; 2]) -> [[f32; N]; 2] {
        let map = self.map;
        let [inverse_x, inverse_y] = [self.inverse.x_axis, self.inverse.y_axis];
        let [mut film, mut start] = [[[0.0; N]; 2]; 2];
        for lane in 0..N {
            let from_middle = [0, 1].map(|i| (f64::from(jitter[i][lane]) - 0.5) * map.inverse_scale[i]);
            for i in 0..2 {
                film[i][lane] = self.film[i] + from_middle[i];
                start[i][lane] =
                    self.ideal[i] + (inverse_x[i] * from_middle[0] + inverse_y[i] * from_middle[1]);
            }
        }
        let mut ideal = start;
        let mut residual = [[0.0; N]; 2];
        for _ in 0..CHORDS {
            for lane in 0..N {
                let seen = map.distortion.apply(DVec2::new(ideal[0][lane], ideal[1][lane]));
                let left = [film[0][lane] - seen.x, film[1][lane] - seen.y];
                for i in 0..2 {
                    ideal[i][lane] += inverse_x[i] * left[0] + inverse_y[i] * left[1];
                    residual[i][lane] = left[i];
                }
            }
        }
        let is_close = |lane: usize, i: usize| (residual[i][lane] * map.scale[i]).abs() < CHORD_RESIDUAL;
        for lane in 0..N {
            let done = is_close(lane, 0) && is_close(lane, 1);
            if !done {
                let [film, start] = [film, start].map(|place| DVec2::new(place[0][lane], place[1][lane]));
                [ideal[0][lane], ideal[1][lane]] = map.solve(film, start).unwrap_or(DVec2::NAN).to_array();
            }
        }
        let shift = [0, 1].map(|i| map.principal_point[i] - f64::from(self.corner[i]));
        let (most, squared_radius) = (map.max_jitter(), map.radius * map.radius);
        let mut found = [[f32::NAN; N]; 2];
        for lane in 0..N {
            let [x, y] = [ideal[0][lane], ideal[1][lane]];
            let offset = [x * map.scale.x + shift[0], y * map.scale.y + shift[1]];
            // Beyond `most` only where pixels are far from square.
            let fits = (offset[0].abs() <= most) & (offset[1].abs() <= most);
            let is_seen = (x * x + y * y <= squared_radius) & fits;
            for i in 0..2 {
                found[i][lane] = if is_seen { offset[i] as f32 } else { f32::NAN };
            }
        }
        found
    }

    /// [`Self::samples`] of one.
    pub fn sample(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let [[x], [y]] = self.samples(&[[x], [y]]);
        [x, y]
    }
}

#[cfg(test)]
mod tests;
