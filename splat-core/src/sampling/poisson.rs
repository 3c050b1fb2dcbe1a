//! Poisson-disc patterns, as in the listing (L21): random points that keep a least distance.

use super::unit;
use rand_pcg::Pcg32;

/// Darts thrown for a point before the distance is relaxed, per point already there.
const DARTS: usize = 30;

/// What the distance is multiplied by when no dart finds a place.
const RELAXATION: f64 = 0.95;

/// `samples` points in the unit square; distances wrap around, so that patterns of neighbouring pixels fit.
pub fn pattern(samples: usize, random: &mut Pcg32) -> Vec<[f64; 2]> {
    // The distance of the densest packing, sqrt(2 / (sqrt(3) n)), cannot be reached by darts.
    let mut distance = 0.8 * (2.0 / (3.0f64.sqrt() * samples as f64)).sqrt();
    let mut points: Vec<[f64; 2]> = Vec::with_capacity(samples);
    while points.len() < samples {
        let placed = (0..DARTS * (points.len() + 1)).find_map(|_| {
            let dart = [unit(random), unit(random)];
            points.iter().all(|&point| wrapped_distance(point, dart) >= distance).then_some(dart)
        });
        match placed {
            Some(point) => points.push(point),
            None => distance *= RELAXATION,
        }
    }
    points
}

/// Distance on the torus.
fn wrapped_distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    let [x, y] = [0, 1].map(|axis| {
        let d = (a[axis] - b[axis]).abs();
        d.min(1.0 - d)
    });
    (x * x + y * y).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Stream;

    #[test]
    fn points_keep_their_distance() {
        for samples in [1, 2, 7, 8, 16, 64] {
            let points = pattern(samples, &mut Stream::FilterPoints.generator(3));
            assert_eq!(points.len(), samples);
            let least = (0..samples)
                .flat_map(|i| (0..i).map(move |j| (i, j)))
                .map(|(i, j)| wrapped_distance(points[i], points[j]))
                .fold(f64::INFINITY, f64::min);
            // Random points would come as near as 0.5 / n; darts reach 0.6 of the densest packing.
            let densest = (2.0 / (3.0f64.sqrt() * samples as f64)).sqrt();
            assert!(least >= 0.6 * densest, "{samples}: {least} of {densest}");
        }
    }
}
