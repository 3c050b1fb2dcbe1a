//! How many decimals the coordinates of a cloud have.

use splat_core::Cloud;

/// Most decimals that are looked for.
const MOST: i32 = 9;

/// The least number of decimals that gives every coordinate again, to the rounding of its offset in `f32`; `None` if that
/// takes more than the rounding leaves.
///
/// Surveys are kept in whole centimetres or millimetres: so they can be written as they were read.
pub fn decimals(cloud: &Cloud) -> Option<i32> {
    (0..=MOST).find(|&k| {
        let power = 10_f64.powi(k);
        cloud.positions.iter().filter(|position| position.is_finite()).all(|position| {
            (0..3).all(|axis| {
                let world = cloud.origin[axis] + f64::from(position[axis]);
                let rounding =
                    f64::from(position[axis].abs()) * f64::from(f32::EPSILON) + world.abs() * f64::EPSILON;
                // Where rounding reaches a tenth of the last digit, that digit says nothing.
                let off = (world * power).round() / power - world;
                rounding * power < 0.1 && off.abs() <= rounding
            })
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn centimetres_are_found_far_from_zero() {
        let point = |i: i32| DVec3::new(636_001.76 + f64::from(i) * 0.37, 848_935.2 + f64::from(i), 406.26);
        let points: Vec<DVec3> = (0..1000).map(point).collect();
        assert_eq!(decimals(&Cloud::from_points(&points)), Some(2));
        let whole = [DVec3::new(1.0, 2.0, 3.0), DVec3::new(5.0, 2e5, -7.0)];
        assert_eq!(decimals(&Cloud::from_points(&whole)), Some(0));
        let thirds: Vec<DVec3> = points.iter().map(|&p| p / 3.0).collect();
        assert_eq!(decimals(&Cloud::from_points(&thirds)), None);
    }
}
