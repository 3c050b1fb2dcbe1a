//! The extent of a splat: the moments of its cell among its neighbours.

use glam::{DVec2, DVec3};

/// Sigma of a splat whose cell is a square, in sides of the square.
const SIGMA: f64 = 0.8;

/// Least cosine of the angle between a neighbour's direction and the tangent plane; steeper ones are of another sheet.
const IN_PLANE: f64 = 0.5;

/// How many times as long as wide a splat may be.
const ASPECT: f64 = 16.0;

/// Half the side of a regular octagon whose inscribed circle has the radius 1.
const OCTAGON: f64 = 0.414_213_562_373_095_05;

/// The two sigma-scaled axes of the splat at a point, perpendicular to `normal` and to each other.
///
/// In the tangent plane the point has a Voronoi cell, what is nearer to it than to any neighbour, within an octagon whose
/// sides are half as far as the farthest neighbour. The axes are those of the cell's second moments about the point:
/// sigma = .8 sqrt(12 m), which is .8 a and .8 b for a rectangle of sides a and b. So splats close scan lines that are
/// farther apart than their points, and the wider gaps of uneven clouds, without overlapping more than needed where points
/// are dense.
///
/// `offsets` are those of the neighbours, the nearest first; each counts by its true distance, in its direction in the plane.
/// `None` if there are none.
pub fn axes(normal: DVec3, offsets: &[DVec3]) -> Option<[DVec3; 2]> {
    let bound = 0.5 * offsets.last()?.length();
    let (u, v) = normal.any_orthonormal_pair();
    let mut cell = Cell::octagon(bound);
    for offset in offsets {
        let distance = offset.length();
        if 0.5 * distance >= cell.reach() {
            break;
        }
        let flat = DVec2::new(offset.dot(u), offset.dot(v));
        let length = flat.length();
        if length >= IN_PLANE * distance {
            cell.cut(flat / length, 0.5 * distance);
        }
    }
    let [long, short] = cell.principal_axes();
    let length = long.length();
    let short = short.normalize() * short.length().max(length / ASPECT);
    Some([long, short].map(|axis| SIGMA * (axis.x * u + axis.y * v)))
}

/// A convex polygon around the origin, counter-clockwise.
struct Cell {
    corners: Vec<DVec2>,
    /// Kept for its memory.
    cut: Vec<DVec2>,
}

impl Cell {
    /// The regular octagon whose sides have this distance.
    fn octagon(distance: f64) -> Self {
        let quarter = [DVec2::new(1.0, -OCTAGON), DVec2::new(1.0, OCTAGON)];
        let turned =
            |turn: usize, corner: DVec2| (0..turn).fold(distance * corner, |corner, _| corner.perp());
        let corners = (0..4).flat_map(|turn| quarter.map(|corner| turned(turn, corner))).collect();
        Self { corners, cut: Vec::with_capacity(16) }
    }

    /// Distance of the farthest corner.
    fn reach(&self) -> f64 {
        self.corners.iter().map(|corner| corner.length_squared()).fold(0.0, f64::max).sqrt()
    }

    /// Cuts off what lies farther than `distance` in a direction.
    fn cut(&mut self, direction: DVec2, distance: f64) {
        let inside = |corner: DVec2| distance - direction.dot(corner);
        if self.corners.iter().all(|&corner| inside(corner) >= 0.0) {
            return;
        }
        self.cut.clear();
        for (index, &a) in self.corners.iter().enumerate() {
            let b = self.corners[(index + 1) % self.corners.len()];
            let (at_a, at_b) = (inside(a), inside(b));
            if at_a >= 0.0 {
                self.cut.push(a);
            }
            if (at_a >= 0.0) != (at_b >= 0.0) {
                self.cut.push(a + at_a / (at_a - at_b) * (b - a));
            }
        }
        std::mem::swap(&mut self.corners, &mut self.cut);
    }

    /// The principal axes of the second moments about the origin, the longer one first; a rectangle's are its sides.
    fn principal_axes(&self) -> [DVec2; 2] {
        let (mut area, mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0, 0.0);
        for (index, &a) in self.corners.iter().enumerate() {
            let b = self.corners[(index + 1) % self.corners.len()];
            let twice = a.perp_dot(b);
            area += twice;
            xx += twice * (a.x * a.x + a.x * b.x + b.x * b.x);
            yy += twice * (a.y * a.y + a.y * b.y + b.y * b.y);
            xy += twice * (a.x * a.y + 0.5 * (a.x * b.y + b.x * a.y) + b.x * b.y);
        }
        // The integrals are these sums over 12 and the area's over 2; times 12, as a square's second moment is a^2/12.
        let scale = 2.0 / area;
        let (mean, half, off) = (0.5 * scale * (xx + yy), 0.5 * scale * (xx - yy), scale * xy);
        let difference = (half * half + off * off).sqrt();
        // Of the two columns of M - least that which has no difference of like terms.
        let major =
            if half >= 0.0 { DVec2::new(difference + half, off) } else { DVec2::new(off, difference - half) };
        let major = major.try_normalize().unwrap_or(DVec2::X);
        [(mean + difference).sqrt() * major, (mean - difference).max(0.0).sqrt() * major.perp()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The lengths of the axes among points of a lattice in the plane of x and z.
    fn lattice(a: f64, b: f64, reach: i32) -> [f64; 2] {
        let mut offsets: Vec<DVec3> = (-reach..=reach)
            .flat_map(|i| (-reach..=reach).map(move |j| DVec3::new(a * f64::from(i), 0.0, b * f64::from(j))))
            .filter(|offset| *offset != DVec3::ZERO)
            .collect();
        offsets.sort_by(|a, b| a.length().total_cmp(&b.length()));
        let axes = axes(DVec3::Y, &offsets).unwrap();
        assert!(axes.iter().all(|axis| axis.y == 0.0) && axes[0].dot(axes[1]).abs() < 1e-12);
        axes.map(|axis| axis.length())
    }

    #[test]
    fn rectangles_have_their_sides() {
        for (a, b) in [(1.0, 1.0), (2.0, 1.0), (0.1, 0.5)] {
            let [long, short] = lattice(a, b, 6);
            approx::assert_relative_eq!(long, SIGMA * f64::max(a, b), max_relative = 1e-12);
            approx::assert_relative_eq!(short, SIGMA * f64::min(a, b), max_relative = 1e-12);
        }
    }

    #[test]
    fn neighbours_on_another_sheet_cut_nothing() {
        let flat = [DVec3::X, -DVec3::X, DVec3::Z, -DVec3::Z];
        let above = [DVec3::new(0.1, 1.1, 0.0), DVec3::new(0.0, -1.2, 0.3)];
        let both: Vec<DVec3> = flat.into_iter().chain(above).chain([3.0 * DVec3::X]).collect();
        let axes = axes(DVec3::Y, &both).unwrap();
        assert!(axes.iter().all(|axis| (axis.length() - SIGMA).abs() < 1e-12), "{axes:?}");
    }

    #[test]
    fn few_neighbours_give_bounded_axes() {
        assert_eq!(axes(DVec3::Z, &[]), None);
        for offsets in
            [vec![DVec3::X], vec![DVec3::Z], vec![DVec3::X, -2.0 * DVec3::X], vec![1e-6 * DVec3::X, DVec3::Y]]
        {
            for length in axes(DVec3::Z, &offsets).unwrap().map(|axis| axis.length()) {
                let farthest = offsets.last().unwrap().length();
                assert!((0.02 * farthest..=1.2 * farthest).contains(&length), "{offsets:?}: {length}");
            }
        }
    }
}
