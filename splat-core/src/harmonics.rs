//! Colours that depend on the direction in which a splat is seen: real spherical harmonics, as trained Gaussian splats
//! have them.

use crate::Error;
use glam::{DMat3, DVec3, Vec3};
use std::f64::consts::PI;

/// The greatest degree.
pub const MAX_DEGREE: usize = 3;

/// The constant function of the basis, 1 / (2 sqrt(pi)).
pub const CONSTANT: f32 = 0.282_094_8;

/// Coefficients of real spherical harmonics, red, green and blue, for every splat of a cloud.
///
/// The colour of a splat seen in the unit direction d (from the eye to its centre, in the world) is
/// 0.5 + sum over k of c_k Y_k(d), negative values taken as 0. It is *display-referred*: sRGB-coded, as the splats were
/// trained. Y_k are the functions of [`basis`].
#[derive(Debug, Clone, PartialEq)]
pub struct SphericalHarmonics {
    degree: usize,
    coefficients: Vec<Vec3>,
}

impl SphericalHarmonics {
    /// Coefficients up to a degree, [`terms`] a splat, one splat after the other, in the order of [`basis`].
    ///
    /// # Errors
    /// [`Error::Invalid`] for a degree above [`MAX_DEGREE`], and for coefficients that fill no whole number of splats.
    pub fn new(degree: usize, coefficients: Vec<Vec3>) -> Result<Self, Error> {
        if degree > MAX_DEGREE {
            return Err(Error::invalid("degree of spherical harmonics", degree, "0 to 3"));
        }
        if !coefficients.len().is_multiple_of(terms(degree)) {
            let expected = "(degree + 1)^2 of them a splat";
            return Err(Error::invalid("number of spherical harmonics", coefficients.len(), expected));
        }
        Ok(Self { degree, coefficients })
    }

    /// The degree, 0 to 3.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// Number of splats described.
    pub fn len(&self) -> usize {
        self.coefficients.len() / terms(self.degree)
    }

    /// Whether no splat is described.
    pub fn is_empty(&self) -> bool {
        self.coefficients.is_empty()
    }

    /// The coefficients of a splat.
    pub fn of(&self, index: usize) -> &[Vec3] {
        let terms = terms(self.degree);
        &self.coefficients[index * terms..][..terms]
    }

    /// Those of some splats, in this order.
    pub fn only(&self, kept: &[usize]) -> Self {
        let coefficients = kept.iter().flat_map(|&index| self.of(index)).copied().collect();
        Self { degree: self.degree, coefficients }
    }

    /// Whether all coefficients of a splat are finite.
    pub fn is_finite(&self, index: usize) -> bool {
        self.of(index).iter().all(|coefficient| coefficient.is_finite())
    }

    /// Goes along with a cloud that `linear` turns, mirrors or scales: what was seen in a direction d now is in `linear` d.
    ///
    /// After a stretch or a shear that is no longer such a sum: then the nearest one, in the mean over all directions.
    pub fn turn(&mut self, linear: &DMat3) {
        let back = linear.inverse();
        let turned = |direction: DVec3| (back * direction).normalize_or_zero().as_vec3();
        // The term k of what term j becomes: the integral of Y_k(d) Y_j(back d), exact for a turn.
        let mut shares = [[0.0; 16]; 16];
        for (direction, weight) in quadrature() {
            let before = basis(turned(direction)).map(f64::from);
            for (row, value) in shares.iter_mut().zip(basis(direction.as_vec3()).map(f64::from)) {
                row.iter_mut().zip(before).for_each(|(share, before)| *share += weight * value * before);
            }
        }
        for splat in self.coefficients.chunks_exact_mut(terms(self.degree)) {
            let mut old = [DVec3::ZERO; 16];
            old.iter_mut().zip(&*splat).for_each(|(old, coefficient)| *old = coefficient.as_dvec3());
            for (coefficient, row) in splat.iter_mut().zip(&shares) {
                *coefficient = row.iter().zip(old).map(|(share, old)| *share * old).sum::<DVec3>().as_vec3();
            }
        }
    }

    /// The display-referred colour of a splat seen in a unit direction: 0 or more, not limited above.
    pub fn color(&self, index: usize, direction: Vec3) -> [f32; 3] {
        let terms = self.of(index).iter().zip(basis(direction));
        let sum = terms.fold(Vec3::ZERO, |sum, (&coefficient, value)| sum + coefficient * value);
        // Sums of huge coefficients may be infinite or not a number: 0 then, too.
        sum.to_array().map(|value| if value + 0.5 > 0.0 { value + 0.5 } else { 0.0 })
    }
}

/// Number of functions up to a degree.
pub const fn terms(degree: usize) -> usize {
    (degree + 1) * (degree + 1)
}

/// The coefficient of [`CONSTANT`] that makes a display-referred value in all directions.
pub fn constant_term(value: f32) -> f32 {
    (value - 0.5) / CONSTANT
}

/// The values of the 16 real spherical harmonics of degree 0 to 3 in a unit direction.
///
/// They are orthonormal on the sphere. Degree l has the orders m = -l to l, in this order; those of odd m are the negative of
/// the usual real functions, as in Kerbl et al. 2023 (the Condon-Shortley phase).
pub fn basis(direction: Vec3) -> [f32; 16] {
    let Vec3 { x, y, z } = direction;
    let (xx, yy, zz) = (x * x, y * y, z * z);
    // sqrt of 3 / 4 pi; 15 / 4 pi, 5 / 16 pi, 15 / 16 pi; 35 / 32 pi, 105 / 4 pi, 21 / 32 pi, 7 / 16 pi, 105 / 16 pi.
    const L1: f32 = 0.488_602_52;
    const L2: [f32; 3] = [1.092_548_5, 0.315_391_57, 0.546_274_24];
    const L3: [f32; 5] = [0.590_043_6, 2.890_611_4, 0.457_045_8, 0.373_176_34, 1.445_305_7];
    [
        CONSTANT,
        -L1 * y,
        L1 * z,
        -L1 * x,
        L2[0] * (x * y),
        -L2[0] * (y * z),
        L2[1] * (2.0 * zz - xx - yy),
        -L2[0] * (x * z),
        L2[2] * (xx - yy),
        -L3[0] * (y * (3.0 * xx - yy)),
        L3[1] * (x * y * z),
        -L3[2] * (y * (4.0 * zz - xx - yy)),
        L3[3] * (z * (2.0 * zz - 3.0 * xx - 3.0 * yy)),
        -L3[2] * (x * (4.0 * zz - xx - yy)),
        L3[4] * (z * (xx - yy)),
        -L3[0] * (x * (xx - 3.0 * yy)),
    ]
}

/// Directions and weights that integrate polynomials up to degree 7 over the sphere: Gauss and Legendre's four points along
/// z, eight around.
fn quadrature() -> impl Iterator<Item = (DVec3, f64)> {
    const POINTS: [(f64, f64); 4] = [
        (-0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
        (-0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
        (0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
        (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
    ];
    POINTS.into_iter().flat_map(|(z, weight)| {
        let radius = (1.0 - z * z).sqrt();
        (0..8).map(move |i| {
            let (sin, cos) = libm::sincos(f64::from(i) * 0.25 * PI);
            (DVec3::new(radius * cos, radius * sin, z), weight * 0.25 * PI)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The associated Legendre function P_l^m(x), m >= 0, with the Condon-Shortley phase, by the usual recurrences.
    fn legendre(l: i32, m: i32, x: f64) -> f64 {
        let root = (1.0 - x * x).max(0.0).sqrt();
        let mut last = (1..=m).fold(1.0, |p, k| -p * f64::from(2 * k - 1) * root);
        if l == m {
            return last;
        }
        let mut p = x * f64::from(2 * m + 1) * last;
        for k in m + 2..=l {
            (last, p) = (p, (x * f64::from(2 * k - 1) * p - f64::from(k + m - 1) * last) / f64::from(k - m));
        }
        p
    }

    /// The definition: N P_l^|m|(cos theta) times sqrt(2) cos(m phi), 1 or sqrt(2) sin(|m| phi).
    fn definition(l: i32, m: i32, direction: Vec3) -> f64 {
        let [x, y, z] = direction.as_dvec3().normalize().to_array();
        let order = m.abs();
        let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
        let norm = (f64::from(2 * l + 1) / (4.0 * PI) * factorial(l - order) / factorial(l + order)).sqrt();
        let angle = f64::from(order) * libm::atan2(y, x);
        let around = match m {
            0 => 1.0,
            1.. => 2_f64.sqrt() * libm::cos(angle),
            _ => 2_f64.sqrt() * libm::sin(angle),
        };
        norm * legendre(l, order, z) * around
    }

    /// Points spread over the sphere.
    fn directions(count: usize) -> impl Iterator<Item = Vec3> {
        (0..count).map(move |i| {
            let z = 1.0 - (2.0 * i as f64 + 1.0) / count as f64;
            let (angle, r) = (2.399_963_229_728_653 * i as f64, (1.0 - z * z).sqrt());
            DVec3::new(r * libm::cos(angle), r * libm::sin(angle), z).as_vec3()
        })
    }

    #[test]
    fn the_basis_is_its_definition() {
        for direction in directions(500).chain([Vec3::X, -Vec3::Y, Vec3::Z, -Vec3::Z]) {
            let values = basis(direction);
            let orders = (0..=3).flat_map(|l| (-l..=l).map(move |m| (l, m)));
            for (value, (l, m)) in values.into_iter().zip(orders) {
                let expected = definition(l, m, direction);
                assert!(
                    (f64::from(value) - expected).abs() < 2e-6,
                    "{l} {m} {direction}: {value} {expected}"
                );
            }
        }
    }

    #[test]
    fn constants_and_signs_are_the_published_ones() {
        let close = |a: f32, b: f64| assert!((f64::from(a) - b).abs() < 1e-7, "{a} {b}");
        close(CONSTANT, 0.282_094_791_773_878_14);
        let c1 = 0.488_602_511_902_919_9;
        close(basis(Vec3::Y)[1], -c1);
        close(basis(Vec3::Z)[2], c1);
        close(basis(Vec3::X)[3], -c1);
        let diagonal = Vec3::new(1.0, 1.0, 0.0);
        close(basis(diagonal)[4], 1.092_548_430_592_079_2);
        close(basis(Vec3::X)[8], 0.546_274_215_296_039_6);
        close(basis(Vec3::X)[15], -0.590_043_589_926_643_5);
        close(basis(Vec3::ONE)[10], 2.890_611_442_640_554);
    }

    #[test]
    fn the_basis_is_orthonormal() {
        const COUNT: usize = 20_000;
        let mut sums = [[0.0; 16]; 16];
        for direction in directions(COUNT) {
            let values = basis(direction).map(f64::from);
            for (row, a) in sums.iter_mut().zip(values) {
                for (sum, b) in row.iter_mut().zip(values) {
                    *sum += a * b * 4.0 * PI / COUNT as f64;
                }
            }
        }
        for (i, row) in sums.iter().enumerate() {
            for (j, sum) in row.iter().enumerate() {
                let expected = f64::from(u8::from(i == j));
                assert!((sum - expected).abs() < 2e-3, "{i} {j}: {sum}");
            }
        }
    }

    #[test]
    fn colours_are_half_grey_and_what_the_terms_add() {
        let along_z =
            SphericalHarmonics::new(1, vec![Vec3::ZERO, Vec3::ZERO, Vec3::new(1.0, -2.0, 0.0), Vec3::ZERO])
                .unwrap();
        let c1 = 0.488_602_52;
        assert_eq!(along_z.color(0, Vec3::Z), [0.5 + c1, 0.0, 0.5]);
        assert_eq!(along_z.color(0, -Vec3::Z), [0.5 - c1, 2.0 * c1 + 0.5, 0.5]);
        assert_eq!(along_z.color(0, Vec3::X), [0.5; 3]);

        let term = constant_term(0.75);
        let constant = SphericalHarmonics::new(0, vec![Vec3::splat(term)]).unwrap();
        assert!((constant.color(0, Vec3::Y)[0] - 0.75).abs() < 1e-7);

        // What overflows is black, or bright, but never not a number.
        let huge =
            |other| SphericalHarmonics::new(1, vec![Vec3::MAX, Vec3::splat(other), Vec3::MAX, Vec3::MAX]);
        let diagonal = Vec3::ONE.normalize();
        for other in [f32::MAX, f32::MIN] {
            assert!(!huge(other).unwrap().color(0, diagonal)[0].is_nan());
        }
    }

    #[test]
    fn turned_colours_are_seen_in_turned_directions() {
        let values: Vec<Vec3> =
            (0..32).map(|i| Vec3::new(0.1 * i as f32 - 1.0, 0.03 * (i * i % 50) as f32, -0.2)).collect();
        let before = SphericalHarmonics::new(3, values).unwrap();
        let mirror = DMat3::from_diagonal(DVec3::new(2.0, -2.0, 2.0));
        for linear in [DMat3::IDENTITY, DMat3::from_axis_angle(DVec3::ONE.normalize(), 2.0) * 5.0, mirror] {
            let mut after = before.clone();
            after.turn(&linear);
            for direction in directions(50) {
                let turned = (linear * direction.as_dvec3()).normalize().as_vec3();
                for index in 0..2 {
                    let pair = before.color(index, direction).into_iter().zip(after.color(index, turned));
                    assert!(
                        pair.into_iter().all(|(old, new)| (old - new).abs() < 2e-5),
                        "{linear} {direction}"
                    );
                }
            }
        }
        // A stretch leaves the basis: still a sum of the same degree, and finite.
        let mut stretched = before.clone();
        stretched.turn(&DMat3::from_diagonal(DVec3::new(1.0, 1.0, 4.0)));
        assert!((0..2).all(|index| stretched.is_finite(index)) && stretched != before);
    }

    #[test]
    fn lengths_and_degrees_are_checked() {
        assert!(SphericalHarmonics::new(4, vec![]).is_err());
        assert!(SphericalHarmonics::new(1, vec![Vec3::ZERO; 5]).is_err());
        let two = SphericalHarmonics::new(2, vec![Vec3::ZERO; 18]).unwrap();
        assert_eq!((two.len(), two.degree(), two.is_empty()), (2, 2, false));
        assert_eq!(two.of(1).len(), 9);
    }
}
