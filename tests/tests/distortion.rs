//! Lens distortion: against OpenCV's formula, written here once more, and against rays cast by brute force.

use glam::{DVec2, DVec3};
use splat_core::raster::SamplePlace;
use splat_core::render::Frame;
use splat_core::setup::{MAX_ERROR, View, camera_splat, set_up};
use splat_core::{
    AovSelection, Camera, Cloud, Distortion, Material, PixelFilter, PixelRect, RenderOptions, Rendered,
};
use splat_tests::brute_force::SampleRay;
use splat_tests::core_scenes::{
    discs, ellipses, hard, lens_of, on_lens, pinhole, random_axes, thin_lens, truth_of,
};
use splat_tests::random::Random;
use splat_tests::scenes;
use splat_tests::tolerances as tol;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

const FOCAL: f64 = 700.0;

/// Where OpenCV's documentation says that a point of the ideal picture is seen; tan units.
fn distorted(d: &Distortion, [x, y]: [f64; 2]) -> [f64; 2] {
    let ([k1, k2, k3], [p1, p2]) = (d.radial, d.tangential);
    let r2 = x * x + y * y;
    let radial = 1.0 + k1 * r2 + k2 * r2 * r2 + k3 * r2 * r2 * r2;
    [
        x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
        y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
    ]
}

/// The same in pixels of a camera.
fn film(camera: &Camera, screen: DVec2) -> DVec2 {
    let distortion = camera.distortion.unwrap_or_default();
    DVec2::from(distorted(&distortion, screen.to_array())) * camera.pixel_scale() + camera.principal_point
}

/// The inverse of [`film`], by dividing by the slowly varying factors again and again, as OpenCV does.
fn ideal(camera: &Camera, pixel: DVec2) -> DVec2 {
    let d = camera.distortion.unwrap_or_default();
    let [x0, y0] = ((pixel - camera.principal_point) / camera.pixel_scale()).to_array();
    let [mut x, mut y] = [x0, y0];
    for _ in 0..1000 {
        let [fx, fy] = distorted(&d, [x, y]);
        // A half of each step: that converges where the whole one does not.
        [x, y] = [x + 0.5 * (x0 - fx), y + 0.5 * (y0 - fy)];
    }
    DVec2::new(x, y)
}

fn lenses() -> [Distortion; 5] {
    let lens = |radial, tangential| Distortion { radial, tangential };
    [
        lens([-0.3, 0.0, 0.0], [0.0; 2]),
        lens([0.2, 0.0, 0.0], [0.0; 2]),
        lens([0.0; 3], [0.01, 0.01]),
        lens([-0.3, 0.08, 0.0], [0.01, -0.01]),
        lens([0.2, -0.1, 0.02], [-0.01, 0.005]),
    ]
}

fn camera(distortion: Distortion) -> Camera {
    Camera {
        distortion: Some(distortion),
        principal_point: DVec2::new(311.0, 232.0),
        ..pinhole(640, 480, FOCAL)
    }
}

/// The places of a picture's hits on the film, with the depths, by the splat's index.
fn hits(cloud: &Cloud, camera: &Camera, options: &RenderOptions) -> BTreeMap<u32, Vec<(DVec2, f64)>> {
    let empty = Cloud { oriented: true, ..Cloud::default() };
    let frame = Frame::new(&empty, camera, options, set_up).unwrap();
    let mut hits = BTreeMap::<u32, Vec<_>>::new();
    splat_core::fragments(cloud, camera, options, &mut |SamplePlace { x, y, sample }, index, fragment| {
        let jitter = frame.rasterizer.samples().jitter(x, y)[sample].map(f64::from);
        let place = DVec2::new(x.into(), y.into()) + DVec2::from(jitter);
        hits.entry(index).or_default().push((place, fragment.depth.into()));
    })
    .unwrap();
    hits
}

fn render(cloud: &Cloud, camera: &Camera, options: &RenderOptions) -> [Rendered; 2] {
    [
        splat_core::render(cloud, camera, options, &mut |_| {}).unwrap(),
        splat_simd::render(cloud, camera, options, &mut |_| {}).unwrap(),
    ]
}

#[test]
fn coefficients_of_zero_change_no_bit() {
    for scene in scenes::golden().into_iter().filter(|scene| !scene.camera.is_orthographic()) {
        let distortion = Some(Distortion { radial: [0.0, -0.0, 0.0], ..Distortion::default() });
        let straight = render(&scene.cloud, &scene.camera, &scene.options);
        let zero = render(&scene.cloud, &Camera { distortion, ..scene.camera }, &scene.options);
        for (a, b) in straight.iter().zip(&zero) {
            assert_eq!(a.film, b.film, "{}", scene.name);
        }
    }
}

#[test]
fn points_are_where_opencv_says() {
    // Discs of a pixel and a half, hit by a thousand samples and more: their mean is off by what their rim leaves open,
    // below a hundredth of a pixel, and their own bend, half of the greatest second derivative (2) times a quarter of the
    // squared radius (in tan units): .001 of a pixel.
    let options = RenderOptions { filter: PixelFilter::Box, ..hard(1.0, 256) };
    for lens in lenses() {
        let camera = camera(lens);
        let places: Vec<DVec2> = (0..20)
            .map(|i| DVec2::new(f64::from(i % 5) * 140.0 + 40.0, f64::from(i / 5) * 130.0 + 45.0))
            .map(|pixel| ideal(&camera, pixel))
            .collect();
        let splats: Vec<_> = places
            .iter()
            .enumerate()
            .map(|(i, &at)| {
                let w = 1.0 + i as f64;
                (at.extend(1.0) * w, DVec3::Z, 1.5 * w / FOCAL)
            })
            .collect();
        let hits = hits(&discs(&splats), &camera, &options);
        assert_eq!(hits.len(), 20);
        for (index, hits) in hits {
            let count = hits.len() as f64;
            assert!(count > 300.0, "{count}");
            let mean = hits.iter().map(|hit| hit.0).sum::<DVec2>() / count;
            let expected = film(&camera, places[index as usize]);
            assert!((mean - expected).length() < tol::DISTORTED_POINT, "{lens:?}: {mean}, not {expected}");
        }
    }
}

#[test]
fn straight_lines_bend_as_the_formula_says() {
    // A splat a thousand times as long as wide, along y = .25; and in every column the mean row of what is hit.
    let options = RenderOptions { filter: PixelFilter::Box, ..hard(1.0, 64) };
    let line = (DVec3::new(0.0, 0.25, 1.0), [DVec3::X * 3.0, DVec3::Y * 0.004]);
    for lens in lenses() {
        let camera = camera(lens);
        let mut columns = BTreeMap::<i64, Vec<DVec2>>::new();
        for (place, _) in hits(&ellipses(&[line]), &camera, &options).remove(&0).expect("seen") {
            columns.entry(place.x.floor() as i64).or_default().push(place);
        }
        assert_eq!(columns.len(), 640);
        for hits in columns.values() {
            let mean = hits.iter().sum::<DVec2>() / hits.len() as f64;
            // Where the line crosses this column.
            let (mut left, mut right) = (-1.5, 1.5);
            while right - left > 1e-9 {
                let middle = 0.5 * (left + right);
                let beyond = film(&camera, DVec2::new(middle, 0.25)).x > mean.x;
                (left, right) = if beyond { (left, middle) } else { (middle, right) };
            }
            let expected = film(&camera, DVec2::new(left, 0.25));
            assert!((mean - expected).length() < tol::DISTORTED_LINE, "{lens:?}: {mean}, not {expected}");
        }
    }
}

/// Splats of all sizes and directions, across the camera plane and beside the frame as well.
fn any_splats(count: usize, rng: &mut Random) -> Cloud {
    let splats: Vec<_> = (0..count)
        .map(|i| {
            let w = if i % 8 == 0 { rng.range(-1.0, 1.0) } else { rng.log_range(0.5, 20.0) };
            let at = DVec2::new(rng.range(-1.4, 1.4), rng.range(-1.2, 1.2)) * f64::abs(w);
            (at.extend(w), random_axes(rng, rng_size(i) * f64::abs(w), 8.0))
        })
        .collect();
    ellipses(&splats)
}

/// From a tenth of a pixel to the whole picture.
fn rng_size(i: usize) -> f64 {
    [0.002, 0.01, 0.05, 0.2, 1.0][i % 5]
}

#[test]
fn pictures_are_those_of_rays() {
    // Each sample of a small picture against each splat, wherever set-up looks: what is hit, and how far away.
    let (mut found, mut undecided) = (0, 0);
    for (number, distortion) in lenses().into_iter().enumerate() {
        for blur in [0.0, 0.05] {
            let mut rng = Random::new(number as u64);
            let base = if blur > 0.0 { thin_lens(72, 52, 80.0, blur, 3.0) } else { pinhole(72, 52, 80.0) };
            let camera = Camera { distortion: Some(distortion), near: 0.05, ..base };
            let options = hard(4.0, 3);
            let cloud = any_splats(60, &mut rng);
            let view = View::new(&camera, &options);
            let frame = Frame::new(&cloud, &camera, &options, set_up).unwrap();
            let samples = frame.rasterizer.samples();
            let places = (0..52).flat_map(|y| (0..72 * 3).map(move |i| (i / 3, y, i as usize % 3)));
            let rays: Vec<_> = places
                .map(|(x, y, sample)| {
                    let jitter = DVec2::from(samples.jitter(x, y)[sample].map(f64::from));
                    let screen = ideal(&camera, DVec2::new(x.into(), y.into()) + jitter);
                    let ray = match lens_of(&view) {
                        None => SampleRay::pinhole(screen),
                        Some(lens) => SampleRay::thin_lens(
                            screen,
                            on_lens(&view, samples.unit_lens(x, y)[sample]),
                            &lens,
                        ),
                    };
                    (SamplePlace { x, y, sample }, ray)
                })
                .collect();
            let mut drawn = BTreeMap::new();
            splat_core::fragments(&cloud, &camera, &options, &mut |place, index, fragment| {
                assert_eq!(drawn.insert((index, place), f64::from(fragment.depth)), None);
            })
            .unwrap();
            for splat in &frame.set_up.splats {
                let disc = truth_of(&camera_splat(&cloud, splat.index as usize, &view));
                for &(place, ray) in &rays {
                    let truth = disc.intersect(&ray);
                    let hit = truth.filter(|hit| hit.r2() < 4.0 && hit.depth > 0.05);
                    let depth = drawn.remove(&(splat.index, place));
                    match (hit, depth) {
                        (Some(hit), Some(depth)) => {
                            found += 1;
                            let slack = tol::DISTORTED_DEPTH * (1.0 + splat_steepness(&disc, hit.depth));
                            assert!((depth / hit.depth - 1.0).abs() < slack, "{depth} {hit:?}");
                        }
                        (None, None) => {}
                        // On the rim.
                        _ => {
                            undecided += 1;
                            let r2 = truth.map_or(f64::NAN, |hit| hit.r2());
                            let near = truth.map_or(f64::NAN, |hit| hit.depth);
                            let close =
                                (r2.sqrt() - 2.0).abs() < MAX_ERROR || (near / 0.05 - 1.0).abs() < 0.01;
                            assert!(close, "{truth:?} {depth:?} {disc:?} {distortion:?} at {place:?}");
                        }
                    }
                }
            }
            assert!(drawn.is_empty(), "{drawn:?}");
        }
    }
    assert!(found > 500_000 && undecided * 1000 < found, "{found} {undecided}");
}

/// How much the depth changes, relative to itself, over a tan unit.
fn splat_steepness(disc: &splat_tests::brute_force::Disc, depth: f64) -> f64 {
    // The plane n.p = d has the depth w = d / (n.(x, y, 1)).
    let n = disc.normal.normalize();
    depth * n.truncate().length() / n.dot(disc.center).abs()
}

#[test]
fn crops_and_ranges_are_parts_of_the_whole() {
    let lens = lenses()[3];
    let camera = Camera { distortion: Some(lens), ..pinhole(101, 71, 60.0) };
    let cloud = any_splats(200, &mut Random::new(5));
    let options = RenderOptions { samples: 11, aovs: AovSelection::ALL, ..RenderOptions::default() };
    let whole = &render(&cloud, &camera, &options)[0].film;
    for window in
        [PixelRect::new(0, 0, 32, 32), PixelRect::new(17, 5, 90, 66), PixelRect::new(100, 70, 101, 71)]
    {
        for part in render(&cloud, &camera, &RenderOptions { window: Some(window), ..options.clone() }) {
            for y in window.y0..window.y1 {
                for x in window.x0..window.x1 {
                    let [a, b] = [whole, &part.film].map(|film| {
                        let i = film.index(x, y);
                        (film.rgba[i], film.position.as_ref().map(|p| p[i]), film.id.as_ref().map(|p| p[i]))
                    });
                    assert_eq!(a, b, "{x} {y}");
                }
            }
        }
    }
    let part = |range| {
        let [reference, fast] =
            render(&cloud, &camera, &RenderOptions { sample_range: Some(range), ..options.clone() });
        assert_eq!(reference.film, fast.film);
        reference.film.rgba
    };
    let (first, rest) = (part(0..5), part(5..11));
    for ((whole, first), rest) in whole.rgba.iter().zip(first).zip(rest) {
        for channel in 0..4 {
            let joined = (5.0 * first[channel] + 6.0 * rest[channel]) / 11.0;
            assert!((whole[channel] - joined).abs() < 1e-6, "{whole:?}");
        }
    }
}

#[test]
fn positions_lie_on_the_rays_of_their_samples() {
    // A wall: with one sample a pixel, the position that is seen there is imaged on that sample.
    for blur in [0.0, 0.1] {
        let lens = lenses()[3];
        let base = if blur > 0.0 { thin_lens(96, 64, 60.0, blur, 2.0) } else { pinhole(96, 64, 60.0) };
        let camera = Camera { distortion: Some(lens), ..base };
        let aovs = AovSelection { position: true, ..AovSelection::default() };
        let options = RenderOptions { aovs, ..hard(4.0, 1) };
        let wall = discs(&[(DVec3::new(0.0, 0.0, 2.0), DVec3::new(0.0, 0.0, -1.0), 20.0)]);
        let view = View::new(&camera, &options);
        let frame = Frame::new(&wall, &camera, &options, set_up).unwrap();
        for rendered in render(&wall, &camera, &options) {
            let film_ = rendered.film;
            for (x, y) in (0..64).flat_map(|y| (0..96).map(move |x| (x, y))) {
                let position = film_.position.as_ref().unwrap()[film_.index(x, y)].as_dvec3();
                let jitter = DVec2::from(frame.rasterizer.samples().jitter(x, y)[0].map(f64::from));
                let place = DVec2::new(x.into(), y.into()) + jitter;
                // The plane of focus is the wall: whatever point of the lens it is.
                let image = film(&camera, position.truncate() / position.z);
                assert!((position.z - 2.0).abs() < 1e-5);
                assert!((image - place).length() < tol::DISTORTED_POSITION, "{image} {place}");
            }
        }
        assert_eq!(view.lens.is_some(), blur > 0.0);
    }
}

#[test]
fn shaders_see_the_rays_of_pixels() {
    let lens = lenses()[3];
    let camera = Camera { distortion: Some(lens), ..pinhole(96, 64, 60.0) };
    let seen = Arc::new(Mutex::new(Vec::new()));
    let notes = seen.clone();
    let material = Material {
        shader: Some(Arc::new(move |point, color| {
            notes.lock().unwrap().push((point.ray, point.surface.space));
            color
        })),
        ..Material::default()
    };
    let wall = discs(&[(DVec3::new(0.0, 0.0, 2.0), DVec3::new(0.0, 0.0, -1.0), 20.0)]);
    let options = RenderOptions { material: material.into(), ..hard(4.0, 1) };
    splat_core::render(&wall, &camera, &options, &mut |_| {}).unwrap();
    let seen = seen.lock().unwrap();
    let mut pixels = 0;
    for (ray, space) in seen.iter() {
        let place = |direction: DVec3| film(&camera, direction.truncate() / direction.z);
        let at = place(ray.ray.direction);
        // Once a splat is shaded as a whole, in set-up.
        if (at - at.floor() - 0.5).length() > 1e-6 {
            continue;
        }
        pixels += 1;
        let [x, y] = ray.next.map(|next| place(next.direction) - at);
        // The next pixel, but for the bend: half of a second derivative of 3 in units of 60 pixels.
        assert!((x - DVec2::X).length() < 0.03 && (y - DVec2::Y).length() < 0.03, "{x} {y}");
        // The wall is so large that the pixel's Gaussian decides: the point is the ray's, up to a part in 10^4.
        let hit = ray.ray.direction * (2.0 / ray.ray.direction.z);
        assert!((space.point - hit).length() < 1e-3 * hit.length(), "{} {hit}", space.point);
    }
    assert!(pixels >= 96 * 64, "{pixels}");
}

#[test]
fn impossible_lenses_are_refused() {
    let check =
        |distortion: Distortion, camera: Camera| Camera { distortion: Some(distortion), ..camera }.check();
    let straight = Distortion::default();
    for bad in [f64::NAN, f64::INFINITY] {
        assert!(check(Distortion { radial: [0.1, bad, 0.0], ..straight }, pinhole(8, 8, 4.0)).is_err());
        assert!(check(Distortion { tangential: [0.0, bad], ..straight }, pinhole(8, 8, 4.0)).is_err());
    }
    assert!(check(straight, scenes::orthographic(8, 8, 4.0)).is_err());
    // Any other makes a picture, if an empty one.
    let wall = discs(&[(DVec3::new(0.0, 0.0, 2.0), DVec3::new(0.0, 0.0, -1.0), 20.0)]);
    for k1 in [-2.0, -1e9, 1e9, -f64::MAX, f64::MAX] {
        let camera = Camera {
            distortion: Some(Distortion { radial: [k1, -k1, 0.5 * k1], tangential: [k1, 0.1] }),
            ..pinhole(48, 40, 30.0)
        };
        let [reference, fast] = render(&wall, &camera, &hard(4.0, 5));
        assert_eq!(reference.film, fast.film);
    }
    // What is folded over is empty: x (1 - 2 x^2) turns at .41, where it is .27.
    let camera = Camera {
        distortion: Some(Distortion { radial: [-2.0, 0.0, 0.0], ..straight }),
        ..pinhole(48, 40, 30.0)
    };
    let [reference, _] = render(&wall, &camera, &hard(4.0, 5));
    let alpha = |x, y| reference.film.rgba[reference.film.index(x, y)][3];
    assert!(alpha(24, 20) == 1.0 && alpha(30, 20) == 1.0 && alpha(34, 20) == 0.0 && alpha(0, 0) == 0.0);
}
