//! Surfaces that are hard to tell apart: how often the resolve splits one, and how often it takes two for one. And sums of
//! very many or very light fragments.
//!
//! The report and the tests share these scenes.

use crate::core_scenes::ellipses;
use crate::hard_scenes::{Facing, Sheets, sheets};
use crate::listing::{DepthMap, Listing, ListingSplat, Parameters};
use crate::random::Random;
use crate::scenes::{fibonacci_sphere, pinhole};
use glam::{DQuat, DVec2, DVec3, Vec3};
use splat_abuffer::{Coverage, Fragment, Resolve, Resolver, Thickness};
use splat_core::render::Frame;
use splat_core::{Camera, Cloud, RenderOptions, Shapes};

/// The part of a surface's weight in a sample that counts: less lost is not split, less of another is no bleed.
const PART: f64 = 0.02;

/// One or two surfaces, one behind the other.
#[derive(Debug, Clone)]
pub struct Scene {
    /// Its name.
    pub name: String,
    /// The splats of the first surface, then those of the second.
    pub cloud: Cloud,
    /// Number of splats of the first.
    pub first: usize,
    /// The camera.
    pub camera: Camera,
    /// Distances from the middle of the picture, in pixels, between which samples count.
    pub ring: [f64; 2],
    /// Whether both surfaces are at the same place, and so rightly are one.
    pub is_one: bool,
}

/// What a resolve makes of a scene: shares of the samples in which it fails.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Failures {
    /// Samples that count.
    pub samples: usize,
    /// Fiftieths of the first surface's weight, or more, are in other layers than most of it.
    pub split: f64,
    /// Fiftieths of the weight of its layer, or more, are of the second surface.
    pub bleed: f64,
}

/// Every scene: noisy sheets parallel to the picture, two sheets in one place, sheets two sigma apart at several tilts, and
/// the rim of a noisy sphere before a sheet.
pub fn scenes() -> Vec<Scene> {
    let mut all = vec![];
    for noise in [0.01, 0.1, 0.3] {
        all.push(sheet_scene(format!("one sheet, noise {noise} sigma"), 1, 0.0, noise, 0.0));
    }
    all.push(sheet_scene("coincident sheets".into(), 2, 0.0, 0.0, 0.0));
    for tilt in [0.0, 45.0, 60.0, 70.0, 80.0] {
        all.push(sheet_scene(format!("2 sigma apart, tilt {tilt}"), 2, 2.0, 0.0, tilt));
    }
    all.push(rim_scene("noisy rim".into(), None));
    for behind in [1.0, 2.0, 4.0, 8.0] {
        all.push(rim_scene(format!("noisy rim, {behind} sigma before a sheet"), Some(behind)));
    }
    all
}

fn sheet_scene(name: String, count: usize, spacing: f64, noise: f64, degrees: f64) -> Scene {
    let described =
        Sheets { count, spacing, noise, tilt: 0.0, weight: 1.0, facing: Facing::Front, clear: false };
    let cloud = turned(sheets(&described, 3), degrees);
    Scene {
        name,
        first: cloud.len() / count,
        cloud,
        camera: pinhole(40, 36, 60.0),
        // No sheet ends there, at any tilt but the last.
        ring: [0.0, if degrees > 75.0 { 2.5 } else { 5.0 }],
        is_one: spacing == 0.0,
    }
}

/// The cloud turned about the point (0, 0, 4).
fn turned(mut cloud: Cloud, degrees: f64) -> Cloud {
    let turn = DQuat::from_rotation_x(degrees.to_radians());
    let center = DVec3::new(0.0, 0.0, 4.0);
    for position in &mut cloud.positions {
        *position = (center + turn * (position.as_dvec3() - center)).as_vec3();
    }
    for normal in &mut cloud.normals {
        *normal = (turn * normal.as_dvec3()).as_vec3();
    }
    cloud
}

/// The rim, seen at 70 to 88 degrees, of a sphere of 4000 splats, sigma .8 of their spacing; and a sheet of such splats parallel to
/// the picture, so many sigma behind the sphere's outline. All places are off by up to a tenth of sigma, normals by a tenth.
fn rim_scene(name: String, behind: Option<f64>) -> Scene {
    const COUNT: usize = 4000;
    const DISTANCE: f64 = 20.0;
    const FOCAL: f64 = 600.0;
    let spacing = (4.0 * std::f64::consts::PI / COUNT as f64).sqrt();
    let sigma = 0.8 * spacing;
    let turn = DQuat::from_rotation_y(0.3) * DQuat::from_rotation_x(0.7);
    let sphere = fibonacci_sphere(COUNT).into_iter().map(|direction| (turn * direction, turn * direction));
    let sheet = behind.into_iter().flat_map(|behind| {
        let place = move |i: i32| f64::from(i) * spacing;
        (-24..=24).flat_map(move |x| {
            (-24..=24).map(move |y| (DVec3::new(place(x), place(y), behind * sigma), DVec3::NEG_Z))
        })
    });
    let mut random = Random::new(17);
    let (mut positions, mut normals) = (vec![], vec![]);
    for (place, normal) in sphere.chain(sheet) {
        let noise = 0.1 * sigma * random.unit() * random.direction();
        positions.push((place + noise + DVec3::new(0.0, 0.0, DISTANCE)).as_vec3());
        normals.push((normal + 0.1 * random.direction()).normalize().as_vec3());
    }
    let count = positions.len();
    let cloud = Cloud {
        positions,
        normals,
        shapes: Shapes::Discs(vec![sigma as f32; count]),
        areas: Some(vec![(spacing * spacing) as f32; count]),
        oriented: true,
        ..Cloud::default()
    };
    let radius = |degrees: f64| FOCAL / DISTANCE * libm::sin(degrees.to_radians());
    let ring = [radius(70.0), radius(88.0)];
    Scene { name, cloud, first: COUNT, camera: pinhole(70, 70, FOCAL), ring, is_one: false }
}

/// The options of these scenes, all layers counting.
pub fn surface_options(thickness: Thickness) -> RenderOptions {
    let coverage = Coverage::Soft { saturation: 1.0 };
    RenderOptions {
        samples: 16,
        resolve: Resolve::Surface { coverage, thickness },
        ..RenderOptions::default()
    }
}

/// The front layers of a scene's samples as the resolve has them, counted.
pub fn failures(scene: &Scene, thickness: Thickness) -> Failures {
    let options = surface_options(thickness);
    let frame = Frame::new(&scene.cloud, &scene.camera, &options, splat_core::setup::set_up).expect("valid");
    let size = [scene.camera.width, scene.camera.height].map(f64::from);
    let samples = options.samples as usize;
    let mut of_sample = vec![Vec::<Fragment>::new(); (size[0] * size[1]) as usize * samples];
    for (rank, splat) in frame.set_up.splats.iter().enumerate() {
        frame.rasterizer.rasterize(splat, rank as u32, &splat.bounds, &mut |place, fragment: Fragment| {
            let pixel = place.y as usize * scene.camera.width as usize + place.x as usize;
            if fragment.is_admitted() && !fragment.is_back() {
                of_sample[pixel * samples + place.sample].push(fragment);
            }
        });
    }
    let is_first =
        |fragment: &Fragment| (frame.set_up.splats[fragment.rank() as usize].index as usize) < scene.first;
    let mut resolver = Resolver::new(options.resolve);
    let (mut counted, mut split, mut bleed) = (0, 0, 0);
    for (i, fragments) in of_sample.iter_mut().enumerate() {
        let pixel =
            DVec2::new((i / samples) as f64 % size[0], ((i / samples) as f64 / size[0]).floor()) + 0.5;
        let distance = (pixel - 0.5 * DVec2::from(size)).length();
        if !(scene.ring[0]..scene.ring[1]).contains(&distance) {
            continue;
        }
        resolver.resolve(fragments, &frame.set_up.surfaces);
        let weight = |fragments: &mut dyn Iterator<Item = &Fragment>| {
            fragments.map(|fragment| f64::from(fragment.weight)).sum::<f64>()
        };
        // What each layer has of the first surface, and of the second.
        let layers: Vec<[f64; 2]> = resolver
            .layers()
            .iter()
            .map(|layer| {
                let of = |first: bool| {
                    let mut members = resolver.fragments_of(layer, fragments);
                    weight(&mut members.by_ref().filter(|fragment| is_first(fragment) == first))
                };
                [of(true), of(false)]
            })
            .collect();
        let whole: f64 = layers.iter().map(|layer| layer[0]).sum();
        let Some(most) = layers.iter().copied().max_by(|a, b| a[0].total_cmp(&b[0])) else { continue };
        if whole < 0.5 {
            continue;
        }
        counted += 1;
        split += usize::from(most[0] < (1.0 - PART) * whole);
        bleed += usize::from(!scene.is_one && most[1] > PART * (most[0] + most[1]));
    }
    let share = |count: usize| count as f64 / f64::from(counted.max(1));
    Failures { samples: counted as usize, split: share(split), bleed: share(bleed) }
}

/// Splats across the whole picture of [`sums_camera`], all at the same depth to a hundredth of sigma, of random colours and of
/// areas within a range.
pub fn overlap(count: usize, areas: [f64; 2]) -> Cloud {
    let mut random = Random::new(31);
    let mut splats = Vec::new();
    let mut colors = Vec::new();
    for _ in 0..count {
        let center = DVec3::new(random.range(-0.5, 0.5), random.range(-0.5, 0.5), random.range(2.0, 2.01));
        splats.push((center, [DVec3::X, DVec3::NEG_Y]));
        colors.push(Vec3::from_array([0; 3].map(|_| random.unit() as f32)));
    }
    let mut cloud = ellipses(&splats);
    cloud.colors = Some(colors);
    cloud.areas = Some((0..count).map(|_| random.log_range(areas[0], areas[1]) as f32).collect());
    cloud
}

/// A few splats of denormal weight in front of some of an ordinary one.
pub fn denormal() -> Cloud {
    let mut cloud = overlap(10, [1e-44, 1e-39]);
    let behind = overlap(10, [1.0, 2.0]);
    cloud.positions.extend(behind.positions.iter().map(|&position| position + 4.0 * Vec3::Z));
    cloud.normals.extend(behind.normals);
    if let (Shapes::Ellipses(all), Shapes::Ellipses(more)) = (&mut cloud.shapes, behind.shapes) {
        all.extend(more);
    }
    if let (Some(all), Some(more)) = (&mut cloud.colors, behind.colors) {
        all.extend(more);
    }
    if let (Some(all), Some(more)) = (&mut cloud.areas, behind.areas) {
        all.extend(more);
    }
    cloud
}

/// A picture of 8 x 8 pixels.
pub fn sums_camera() -> Camera {
    pinhole(8, 8, 8.0)
}

/// The options of the sums.
pub fn sums_options() -> RenderOptions {
    RenderOptions { samples: 4, resolve: crate::scenes::soft(1.0), ..RenderOptions::default() }
}

/// What the listing's fragments of a cloud of round splats add up to in `f32`: the largest difference of a sample's colour,
/// the mean weighted by its table, in the order of arrival, from the same mean in `f64` with exact weights. (It has no resolve of
/// its own, and its weights do not contain the areas.)
pub fn listing_sum_error(cloud: &Cloud) -> f64 {
    let single = listing_means::<f32>(cloud, |fragment| fragment.ray.weight.map_or(0.0, f64::from));
    let exact = listing_means::<f64>(cloud, |fragment| {
        let [_, _, g] = fragment.ray.uv;
        libm::exp(-0.5 * fragment.ray.radius / (g * g))
    });
    let differences = single.iter().zip(&exact).flat_map(|(a, b)| (0..3).map(move |i| (a[i] - b[i]).abs()));
    differences.filter(|difference| difference.is_finite()).fold(0.0, f64::max)
}

/// For each sample the listing's mean colour, summed in `T`.
fn listing_means<T: crate::listing::Real>(
    cloud: &Cloud,
    weight: impl Fn(&crate::listing::ListingFragment<T>) -> f64,
) -> Vec<[f64; 3]> {
    let camera = sums_camera();
    let depth_map = DepthMap::Direct3d { near: 0.1, far: 100.0 };
    let [width, height] = [camera.width, camera.height].map(|size| size as usize);
    let parameters = Parameters::<T>::new(depth_map, width, height, camera.pixel_scale().x);
    let samples = parameters.subpixels;
    let mut sums = vec![[T::of(0.0); 4]; width * height * samples];
    let listing = Listing::new(parameters);
    let colors = cloud.colors.as_deref().unwrap_or_default();
    let splats: Vec<ListingSplat<T>> = (0..cloud.len())
        .map(|i| {
            let position = cloud.positions[i].as_dvec3().to_array();
            // Its back faces are culled.
            ListingSplat::new(position, [0.0, 0.0, -1.0], 1.0)
        })
        .collect();
    listing.run(&splats, |fragment| {
        let inside = (0..width as i64).contains(&fragment.x) && (0..height as i64).contains(&fragment.y);
        if inside {
            let weight = T::of(weight(&fragment));
            let color = colors[fragment.splat].to_array().map(|value| T::of(f64::from(value)));
            let sum = &mut sums[(fragment.y as usize * width + fragment.x as usize) * samples + fragment.j];
            for i in 0..3 {
                sum[i] = sum[i] + weight * color[i];
            }
            sum[3] = sum[3] + weight;
        }
    });
    sums.iter().map(|sum| [0, 1, 2].map(|i| (sum[i] / sum[3]).wide())).collect()
}
