//! Relations of the pictures that samples estimate: they hold in the mean over seeds, within so many standard deviations.

use glam::{DVec2, Vec3};
use splat_core::{AovSelection, Camera, Cloud, Film, Lens, PixelFilter, Projection, RenderOptions, Shapes};
use splat_simd::{Level, Renderer};
use splat_tests::scenes::{Scene, jumble, pinhole, soft, with_lens};
use splat_tests::tolerances as tol;
use std::ops::Range;

/// Seeds of an estimate, and as many others of the one that it is compared with.
const SEEDS: [Range<u64>; 2] = [0..16, 16..32];

/// Width and height of the pictures; even.
const SIZE: [u32; 2] = [40, 32];

/// Independent estimates of a picture, pixel by pixel: red, green, blue and alpha.
struct Estimate {
    mean: Vec<[f64; 4]>,
    /// Of the mean, unbiased.
    variance: Vec<[f64; 4]>,
}

impl Estimate {
    /// By these seeds, each picture changed in the same way.
    fn of(scene: &Scene, seeds: Range<u64>, change: impl Fn(&Film) -> Vec<[f64; 4]>) -> Self {
        let mut renderer = Renderer::new(1, Level::choose()).unwrap();
        let n = (seeds.end - seeds.start) as f64;
        let pictures: Vec<Vec<[f64; 4]>> = seeds
            .map(|seed| {
                let options = RenderOptions { seed, ..scene.options.clone() };
                change(&renderer.render(&scene.cloud, &scene.camera, &options, &mut |_| {}).unwrap().film)
            })
            .collect();
        let over_pictures = |term: &dyn Fn(usize, usize, f64) -> f64| -> Vec<[f64; 4]> {
            let sum = |pixel: usize, channel: usize| -> f64 {
                pictures.iter().map(|picture| term(pixel, channel, picture[pixel][channel])).sum()
            };
            (0..pictures[0].len()).map(|pixel| [0, 1, 2, 3].map(|channel| sum(pixel, channel))).collect()
        };
        let mean = over_pictures(&|_, _, value| value / n);
        let squared = |pixel: usize, channel: usize, value: f64| (value - mean[pixel][channel]).powi(2);
        let variance =
            over_pictures(&|pixel, channel, value| squared(pixel, channel, value) / (n * (n - 1.0)));
        Self { mean, variance }
    }

    /// The sum of all variances of single pictures.
    fn noise(&self) -> f64 {
        self.variance.iter().flatten().sum()
    }

    /// How far apart two estimates are, in standard deviations, if they are of the same picture: in their squared
    /// differences, which see any deviation of many pixels, and in the sum of each channel, which sees a small one of all.
    ///
    /// Squared differences less the variances have the mean 0, and are independent from pixel to pixel: so their sum has the
    /// variance of the sum of their squares. It is one-sided.
    fn deviations(&self, other: &Self) -> f64 {
        let mut excess = (0.0, 0.0);
        let mut sums = [(0.0, 0.0); 4];
        for pixel in 0..self.mean.len() {
            let mut of_pixel = 0.0;
            for (channel, sum) in sums.iter_mut().enumerate() {
                let difference = self.mean[pixel][channel] - other.mean[pixel][channel];
                let variance = self.variance[pixel][channel] + other.variance[pixel][channel];
                of_pixel += difference * difference - variance;
                (sum.0, sum.1) = (sum.0 + difference, sum.1 + variance);
            }
            excess = (excess.0 + of_pixel, excess.1 + of_pixel * of_pixel);
        }
        let net = sums.map(|(sum, variance): (f64, f64)| (sum / variance.sqrt()).abs());
        net.into_iter().fold(excess.0 / excess.1.sqrt(), f64::max)
    }
}

/// The pixels of a film as they are.
fn as_it_is(film: &Film) -> Vec<[f64; 4]> {
    film.rgba.iter().map(|pixel| pixel.map(f64::from)).collect()
}

/// The pixels of a film at the places that `place` gives for each of `size`, row by row.
fn rearranged(film: &Film, size: [u32; 2], place: impl Fn(i32, i32) -> (i32, i32)) -> Vec<[f64; 4]> {
    let [width, height] = size.map(|side| side as i32);
    let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    places.map(|(x, y)| place(x, y)).map(|(x, y)| film.rgba[film.index(x, y)].map(f64::from)).collect()
}

/// Scenes with edges, smooth parts and transparency: before a pinhole, and before a lens. The principal point is not in the
/// middle.
fn scenes() -> Vec<Scene> {
    let sharp = Camera { principal_point: DVec2::new(17.25, 18.5), ..pinhole(SIZE[0], SIZE[1], 36.0) };
    let blurred = with_lens(sharp.clone(), Lens { radius: 0.1, focus: 3.0, blades: 0 });
    let options = RenderOptions { samples: 4, resolve: soft(1.0), ..RenderOptions::default() };
    let scene = |name, camera, seed| {
        let mut cloud = jumble(60, 0.06, seed);
        cloud.make_elliptical();
        Scene { name, cloud, camera, options: options.clone() }
    };
    vec![scene("pinhole", sharp, 41), scene("lens", blurred, 42)]
}

#[track_caller]
fn assert_same_picture(scene: &Scene, a: &Estimate, b: &Estimate) {
    let found = a.deviations(b);
    println!("{}: {found:.2} standard deviations", scene.name);
    assert!(found <= tol::DEVIATIONS, "{}: {found} standard deviations", scene.name);
}

/// Changes each position, normal and axis of a cloud of ellipses.
fn changed(cloud: &Cloud, change: impl Fn(Vec3) -> Vec3) -> Cloud {
    let mut cloud = cloud.clone();
    cloud.positions.iter_mut().for_each(|position| *position = change(*position));
    cloud.normals.iter_mut().for_each(|normal| *normal = change(*normal));
    let Shapes::Ellipses(axes) = &mut cloud.shapes else { panic!("ellipses") };
    axes.iter_mut().flatten().for_each(|axis| *axis = change(*axis));
    cloud
}

/// Another seed is another estimate of the same picture. And the instrument: these estimates tell pictures apart whose
/// principal points differ by a part of a pixel, or whose colours by a few percent.
#[test]
fn another_seed() {
    for scene in scenes() {
        let [a, b] = SEEDS.map(|seeds| Estimate::of(&scene, seeds, as_it_is));
        assert_same_picture(&scene, &a, &b);
        let differing = a.mean.iter().zip(&b.mean).filter(|(a, b)| a != b).count();
        assert!(differing > a.mean.len() / 4, "{differing} pixels");
        let mut moved = scene.clone();
        moved.camera.principal_point.x += tol::DETECTED[0];
        let mut brighter = scene.clone();
        brighter.cloud.colors.iter_mut().flatten().for_each(|color| *color *= 1.0 + tol::DETECTED[1] as f32);
        for other in [moved, brighter] {
            let other = Estimate::of(&other, SEEDS[1].clone(), as_it_is);
            let found = a.deviations(&other);
            println!("{}: told apart by {found:.1} standard deviations", scene.name);
            assert!(found > tol::DEVIATIONS, "{}: {found} standard deviations", scene.name);
        }
    }
}

/// A mirrored scene is a mirrored picture; so is one with x and y exchanged.
#[test]
fn a_mirrored_scene() {
    for scene in scenes() {
        let here = Estimate::of(&scene, SEEDS[0].clone(), as_it_is);
        let [width, height] = SIZE.map(|side| side as i32);
        let middle = scene.camera.principal_point;

        let mut mirrored = scene.clone();
        mirrored.cloud = changed(&scene.cloud, |v| v.with_x(-v.x));
        mirrored.camera.principal_point.x = f64::from(width) - middle.x;
        let back = |film: &Film| rearranged(film, SIZE, |x, y| (width - 1 - x, y));
        assert_same_picture(&scene, &here, &Estimate::of(&mirrored, SEEDS[1].clone(), back));

        let mut exchanged = scene.clone();
        exchanged.cloud = changed(&scene.cloud, |v| Vec3::new(v.y, v.x, v.z));
        exchanged.camera.principal_point = DVec2::new(middle.y, middle.x);
        (exchanged.camera.width, exchanged.camera.height) = (height as u32, width as u32);
        let back = |film: &Film| rearranged(film, SIZE, |x, y| (y, x));
        assert_same_picture(&scene, &here, &Estimate::of(&exchanged, SEEDS[1].clone(), back));
    }
}

/// Of a picture of twice the resolution each four pixels have the mean of one: so it is for the box filter.
#[test]
fn doubled_resolution() {
    for mut scene in scenes() {
        scene.options.filter = PixelFilter::Box;
        let here = Estimate::of(&scene, SEEDS[0].clone(), as_it_is);
        let mut doubled = scene.clone();
        (doubled.camera.width, doubled.camera.height) = (2 * SIZE[0], 2 * SIZE[1]);
        doubled.camera.principal_point *= 2.0;
        let Projection::Perspective { focal_length, .. } = &mut doubled.camera.projection else { panic!() };
        *focal_length *= 2.0;
        let means = |film: &Film| -> Vec<[f64; 4]> {
            let quarter = |i: i32| rearranged(film, SIZE, move |x, y| (2 * x + i % 2, 2 * y + i / 2));
            let quarters = [0, 1, 2, 3].map(quarter);
            let mean =
                |pixel: usize, channel: usize| quarters.iter().map(|q| q[pixel][channel]).sum::<f64>() / 4.0;
            (0..quarters[0].len()).map(|pixel| [0, 1, 2, 3].map(|channel| mean(pixel, channel))).collect()
        };
        assert_same_picture(&scene, &here, &Estimate::of(&doubled, SEEDS[1].clone(), means));
    }
}

/// A principal point moved by whole pixels, which are not the period of the samples, moves the picture.
#[test]
fn a_principal_point_moved_by_pixels() {
    for scene in scenes() {
        let (dx, dy) = (5, -3);
        let mut moved = scene.clone();
        moved.camera.principal_point += DVec2::new(f64::from(dx), f64::from(dy));
        let shared = [SIZE[0] - 5, SIZE[1] - 3];
        let here = Estimate::of(&scene, SEEDS[0].clone(), |film| rearranged(film, shared, |x, y| (x, y + 3)));
        let there = |film: &Film| rearranged(film, shared, |x, y| (x + dx, y + 3 + dy));
        assert_same_picture(&scene, &here, &Estimate::of(&moved, SEEDS[1].clone(), there));
    }
}

/// More samples are less noise: four times as many at least a quarter of the variance, as if they were independent, and no
/// less than their even distribution can give. What a picture says of its own variance is that of independent samples.
#[test]
fn more_samples() {
    for mut scene in scenes() {
        scene.options.aovs = AovSelection { variance: true, ..AovSelection::default() };
        let [few, many] = [4, 16].map(|samples| {
            let options = RenderOptions { samples, ..scene.options.clone() };
            let scene = Scene { options, ..scene.clone() };
            let told = Estimate::of(&scene, SEEDS[0].clone(), |film| {
                let variances = film.variance.as_ref().expect("asked for");
                variances.iter().map(|v| [v.x, v.y, v.z, 0.0].map(f64::from)).collect()
            });
            let told: f64 = told.mean.iter().flatten().sum();
            let colors =
                |film: &Film| film.rgba.iter().map(|&[r, g, b, _]| [r, g, b, 0.0].map(f64::from)).collect();
            // That of one picture.
            let found = 16.0 * Estimate::of(&scene, SEEDS[0].clone(), colors).noise();
            println!("{}: {samples} samples, variance {found:.4}, said to be {told:.4}", scene.name);
            assert!(told >= found, "{}: {told} for {found}", scene.name);
            found
        });
        let ratio = few / many;
        assert!((tol::FOUR_TIMES_THE_SAMPLES[0]..tol::FOUR_TIMES_THE_SAMPLES[1]).contains(&ratio), "{ratio}");
    }
}
