//! The map between film and ideal picture, both ways.

use super::*;
use crate::Projection;
use glam::DMat4;

fn camera(radial: [f64; 3], tangential: [f64; 2]) -> Camera {
    Camera {
        width: 640,
        height: 480,
        projection: Projection::Perspective { focal_length: DVec2::new(400.0, 420.0), lens: None },
        principal_point: DVec2::new(310.0, 250.0),
        world_to_camera: DMat4::IDENTITY,
        near: 0.1,
        far: f64::INFINITY,
        clip_planes: vec![],
        distortion: Some(Distortion { radial, tangential }),
    }
}

fn map(radial: [f64; 3], tangential: [f64; 2]) -> FilmMap {
    FilmMap::new(&camera(radial, tangential), 1.5).expect("distorted")
}

fn maps() -> Vec<FilmMap> {
    vec![
        map([-0.3, 0.0, 0.0], [0.0; 2]),
        map([0.2, 0.0, 0.0], [0.0; 2]),
        map([-0.28, 0.09, -0.01], [0.01, -0.01]),
        map([0.0; 3], [-0.01, 0.02]),
        map([0.5, -0.4, 0.1], [1e-3, 2e-3]),
    ]
}

/// Places all over the film, and how far apart they are.
fn film_places() -> impl Iterator<Item = DVec2> {
    (0..48).flat_map(|y| (0..64).map(move |x| DVec2::new(f64::from(x), f64::from(y)) * 10.0 + 5.0))
}

#[test]
fn the_inverse_is_one() {
    for map in maps() {
        let mut seen = 0;
        for film in film_places() {
            let Some(ideal) = map.ideal(film) else { continue };
            seen += 1;
            // Newton's last step is at most 8/512 of a pixel; half of its square times a second derivative of 2 or
            // 3, over the focal length, is left.
            assert!((map.film(ideal) - film).length() < 1e-6, "{film} {ideal}");
        }
        assert!(seen > 2300, "{seen} of 3072: {map:?}");
    }
}

#[test]
fn samples_look_where_the_inverse_says() {
    for map in maps() {
        for film in film_places() {
            let [x, y] = film.floor().as_ivec2().to_array();
            let Some(pixel) = map.pixel(x, y) else { continue };
            for jitter in [[0.5f32, 0.5], [-1.0, 2.0], [1.9, -0.9], [0.1, 0.7]] {
                let place = film.floor() + DVec2::from(jitter.map(f64::from));
                let sample = pixel.sample(jitter);
                let Some(ideal) = map.ideal(place) else {
                    assert!(sample[0].is_nan(), "{place}");
                    continue;
                };
                let [x, y] = pixel.corner.map(f64::from);
                let found = DVec2::new(x, y) + DVec2::from(sample.map(f64::from));
                assert!((found - ideal).length() < 1e-5, "{place}: {found} {ideal}");
                let farthest = f64::from(sample[0].abs().max(sample[1].abs()));
                assert!(farthest <= map.max_jitter());
            }
        }
    }
}

#[test]
fn slope_and_bend_are_those_of_the_map() {
    for map in maps() {
        for ideal in film_places().step_by(37) {
            let step = 1e-4;
            for axis in [DVec2::X, DVec2::Y] {
                let difference =
                    (map.film(ideal + step * axis) - map.film(ideal - step * axis)) / (2.0 * step);
                assert!((map.slope(ideal) * axis - difference).length() < 1e-7, "{ideal}");
            }
            for reach in [1.0, 30.0, 200.0] {
                let reach = DVec2::new(reach, 0.6 * reach);
                let bend = map.bend(ideal, reach);
                for corner in [DVec2::ONE, DVec2::new(-1.0, 1.0), DVec2::X, DVec2::NEG_Y] {
                    let offset = corner * reach;
                    let tangent = map.film(ideal) + map.slope(ideal) * offset;
                    let error = (map.film(ideal + offset) - tangent).abs();
                    assert!(error.cmple(bend + 1e-9).all(), "{ideal} {offset}: {error} > {bend}");
                }
            }
        }
    }
}

#[test]
fn boxes_hold_all_that_is_seen() {
    for map in maps() {
        let film: Vec<DVec2> = film_places().collect();
        let ideal: Vec<Option<DVec2>> = film.iter().map(|&film| map.ideal(film)).collect();
        let [x, y] = map.seen();
        for (number, corner) in film_places().step_by(53).enumerate() {
            let size = [3.0, 20.0, 300.0, 5000.0][number % 4];
            let (low, high) = (corner, corner + size);
            let of = |axis: usize| Extent { min: low[axis], max: high[axis] };
            let found = map.film_box(&[of(0), of(1)]);
            for (film, ideal) in film.iter().zip(&ideal) {
                let Some(ideal) = ideal else { continue };
                assert!(x.min <= ideal.x && ideal.x <= x.max && y.min <= ideal.y && ideal.y <= y.max);
                if low.cmple(*ideal).all() && ideal.cmple(high).all() {
                    let [x, y] = found.expect("something is seen");
                    assert!(x.min - 1e-6 <= film.x && film.x <= x.max + 1e-6, "{film}");
                    assert!(y.min - 1e-6 <= film.y && film.y <= y.max + 1e-6, "{film}");
                }
            }
        }
    }
}

#[test]
fn beyond_the_fold_nothing_is_seen() {
    // x (1 - x^2/3) turns at 1, and its slope is 1/8 at sqrt(7/8).
    let map = FilmMap::new(
        &Camera {
            width: 800,
            height: 800,
            principal_point: DVec2::splat(400.0),
            ..camera([-1.0 / 3.0, 0.0, 0.0], [0.0; 2])
        },
        1.5,
    )
    .expect("distorted");
    let r = (7.0f64 / 8.0).sqrt();
    assert!((map.radius - r).abs() < 1e-5, "{}", map.radius);
    let edge = 400.0 + 400.0 * r * (1.0 - r * r / 3.0);
    assert!(map.ideal(DVec2::new(edge - 0.01, 400.0)).is_some());
    assert!(map.ideal(DVec2::new(edge + 0.01, 400.0)).is_none());
    // Nor does the fold bring anything back: one ideal place for each of the film.
    assert!(map.film_box(&[Extent { min: 900.0, max: 1200.0 }, Extent { min: 390.0, max: 410.0 }]).is_none());
}

#[test]
fn no_coefficients_panic_or_hang() {
    let values = [0.0, -0.0, 1e-300, -0.3, 40.0, -1e6, 1e10, f64::MAX, -f64::MAX];
    for (i, &k1) in values.iter().enumerate() {
        for (j, &k2) in values.iter().enumerate() {
            for &p1 in &values {
                let mut camera = camera([k1, k2, values[(i + j) % values.len()]], [p1, -p1]);
                camera.principal_point.x *= [1.0, -1e3, 1e300][(i + j) % 3];
                let Some(map) = FilmMap::new(&camera, 0.5) else { continue };
                for film in film_places().step_by(211) {
                    map.ideal(film);
                    let place = film.as_ivec2();
                    if let Some(pixel) = map.pixel(place.x, place.y) {
                        let [x, y] = pixel.sample([0.3, 0.6]);
                        assert!(x.is_nan() || f64::from(x.abs().max(y.abs())) <= map.max_jitter());
                    }
                    map.film_box(&[Extent { min: film.x, max: film.x }, Extent { min: 0.0, max: film.y }]);
                }
            }
        }
    }
}

#[test]
fn no_distortion_is_none() {
    assert_eq!(FilmMap::new(&camera([0.0, -0.0, 0.0], [0.0; 2]), 1.5), None);
}
