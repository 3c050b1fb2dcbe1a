//! From the unit square to the aperture of a lens.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};

/// The point of an aperture of radius 1 that a point of the unit square maps to, equal areas to equal areas. The
/// aperture is a disc, or the regular polygon of `blades` corners on it, one corner at the top (y down).
pub fn on_aperture(point: [f64; 2], blades: u32) -> [f32; 2] {
    let point = if blades == 0 { on_disc(point) } else { on_polygon(point, blades) };
    point.map(|value| value as f32)
}

/// The concentric map of Shirley and Chiu (1997), which keeps neighbours neighbours.
fn on_disc(point: [f64; 2]) -> [f64; 2] {
    let [x, y] = point.map(|value| 2.0 * value - 1.0);
    if x == 0.0 && y == 0.0 {
        return [0.0; 2];
    }
    let (radius, angle) =
        if x.abs() > y.abs() { (x, FRAC_PI_4 * (y / x)) } else { (y, FRAC_PI_2 - FRAC_PI_4 * (x / y)) };
    [radius * libm::cos(angle), radius * libm::sin(angle)]
}

/// The first coordinate chooses one of the triangles (centre, corner, next corner) and its distance from the centre,
/// the second one the place between the two corners.
fn on_polygon([first, second]: [f64; 2], blades: u32) -> [f64; 2] {
    let position = first * f64::from(blades);
    let corner = |number: f64| {
        let angle = TAU * number / f64::from(blades) - FRAC_PI_2;
        [libm::cos(angle), libm::sin(angle)]
    };
    let [here, next] = [corner(position.floor()), corner(position.floor() + 1.0)];
    let distance = (position - position.floor()).sqrt();
    [0, 1].map(|axis| distance * (here[axis] + second * (next[axis] - here[axis])))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Area, centroid and second moment of the mapped unit square, by a regular grid.
    fn moments(blades: u32) -> ([f64; 2], f64) {
        let n = 540;
        let points = (0..n * n).map(|i| {
            let point = [f64::from(i % n) + 0.5, f64::from(i / n) + 0.5].map(|value| value / f64::from(n));
            on_aperture(point, blades).map(f64::from)
        });
        let (mut sum, mut second) = ([0.0; 2], 0.0);
        for [x, y] in points {
            assert!(x * x + y * y <= 1.0 + 1e-6);
            sum[0] += x;
            sum[1] += y;
            second += x * x + y * y;
        }
        (sum.map(|s| s / f64::from(n * n)), second / f64::from(n * n))
    }

    #[test]
    fn discs_and_polygons_are_filled_evenly() {
        // Mean of r^2: 1/2 on the disc; (2 + cos(2 pi / n)) / 6 on a regular polygon of n corners on the unit circle.
        for blades in [0, 3, 4, 5, 6, 9] {
            let expected = if blades == 0 { 0.5 } else { (2.0 + libm::cos(TAU / f64::from(blades))) / 6.0 };
            let (centroid, second) = moments(blades);
            approx::assert_abs_diff_eq!(centroid[0], 0.0, epsilon = 1e-3);
            approx::assert_abs_diff_eq!(centroid[1], 0.0, epsilon = 1e-3);
            approx::assert_abs_diff_eq!(second, expected, epsilon = 1e-3);
        }
    }

    #[test]
    fn a_corner_is_at_the_top() {
        let [x, y] = on_aperture([1.0f64.next_down() / 5.0, 0.0], 5);
        approx::assert_abs_diff_eq!(x, 0.0, epsilon = 1e-6);
        approx::assert_abs_diff_eq!(y, -1.0, epsilon = 1e-6);
    }
}
