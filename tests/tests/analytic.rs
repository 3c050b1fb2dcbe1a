//! Pictures of tiny clouds against answers that can be written down, and against each other where two
//! pictures must be the same.

use std::f64::consts::PI;

use glam::{DMat2, DMat3, DMat4, DQuat, DVec2, DVec3, DVec4, Vec3};
use splat_core::film::NO_ID;
use splat_core::sampling::SampleTable;
use splat_core::{
    AovSelection, Camera, Cloud, Film, Kernel, Lens, PixelFilter, PixelRect, Projection, RenderOptions,
    Rendered, Shapes, TableMode, fragments, render, srgb,
};
use splat_tests::brute_force::{self, Disc, SampleRay};
use splat_tests::random::Random;
use splat_tests::scenes::{
    self, OPAQUE, Surfel, cloud, hard_discs, orthographic, permuted, pinhole, soft, with_lens,
};
use splat_tests::tolerances as tol;

// ---------------------------------------------------------------------------------------------------------
// Helpers

/// All AOVs.
const EVERYTHING: AovSelection = AovSelection {
    depth: true,
    normal: true,
    albedo: true,
    position: true,
    id: true,
    coverage: true,
    layers: true,
    samples: true,
    variance: true,
};

const KERNELS: [Kernel; 3] = [Kernel::Gaussian, Kernel::Windowed, Kernel::Disc];
const TABLES: [TableMode; 3] = [TableMode::Floor256, TableMode::Midpoint256, TableMode::Lerp256];

fn rendered(cloud: &Cloud, camera: &Camera, options: &RenderOptions) -> Rendered {
    render(cloud, camera, options, &mut |_| {}).expect("a valid scene")
}

fn picture(cloud: &Cloud, camera: &Camera, options: &RenderOptions) -> Film {
    rendered(cloud, camera, options).film
}

fn alphas(film: &Film) -> impl Iterator<Item = f64> {
    film.rgba.iter().map(|pixel| f64::from(pixel[3]))
}

/// The pixels of a film with their places in the frame.
fn pixels(film: &Film) -> impl Iterator<Item = (i32, i32)> {
    let PixelRect { x0, y0, x1, y1 } = film.window;
    (y0..y1).flat_map(move |y| (x0..x1).map(move |x| (x, y)))
}

fn center_of(x: i32, y: i32) -> DVec2 {
    DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5)
}

/// Mean and variance per axis of the pixels' centres, weighted by alpha.
fn alpha_moments(film: &Film) -> (DVec2, DVec2) {
    let weighted = |value: &dyn Fn(DVec2) -> DVec2| -> DVec2 {
        let sum: DVec2 = pixels(film).zip(alphas(film)).map(|((x, y), a)| a * value(center_of(x, y))).sum();
        sum / alphas(film).sum::<f64>()
    };
    let mean = weighted(&|p| p);
    (mean, weighted(&|p| (p - mean) * (p - mean)))
}

/// All numbers of a film, as bits, pixel after pixel.
fn film_bits(film: &Film) -> Vec<Vec<u32>> {
    let one = |channel: &Option<Vec<f32>>, i: usize| channel.as_ref().map(|values| values[i].to_bits());
    let three = |channel: &Option<Vec<Vec3>>, i: usize| {
        channel.iter().flat_map(|values| values[i].to_array().map(f32::to_bits)).collect::<Vec<_>>()
    };
    (0..film.rgba.len())
        .map(|i| {
            let mut bits = film.rgba[i].map(f32::to_bits).to_vec();
            for channel in [&film.depth, &film.coverage, &film.layers, &film.samples] {
                bits.extend(one(channel, i));
            }
            for channel in [&film.normal, &film.albedo, &film.position, &film.variance] {
                bits.extend(three(channel, i));
            }
            bits.extend(film.id.as_ref().map(|ids| ids[i]));
            bits
        })
        .collect()
}

fn assert_same_bits(name: &str, a: &Film, b: &Film) {
    assert_eq!(a.window, b.window, "{name}");
    let (a_bits, b_bits) = (film_bits(a), film_bits(b));
    let differing = a_bits.iter().zip(&b_bits).filter(|(a, b)| a != b).count();
    assert_eq!(differing, 0, "{name}: {differing} of {} pixels differ", a_bits.len());
    assert_eq!(a_bits.len(), b_bits.len(), "{name}");
}

/// The golden scenes with all AOVs.
fn all_scenes() -> Vec<scenes::Scene> {
    let mut scenes = scenes::golden();
    scenes.iter_mut().for_each(|scene| scene.options.aovs = EVERYTHING);
    scenes
}

/// A plane as `point` and unit `normal`, in camera space.
#[derive(Debug, Clone, Copy)]
struct Plane {
    point: DVec3,
    normal: DVec3,
}

impl Plane {
    /// The plane of a splat, in world space. A camera of [`scenes`] sees it there.
    fn of(cloud: &Cloud, index: usize) -> Self {
        let normal = cloud.normals[index].as_dvec3().normalize();
        Self { point: cloud.world_position(index), normal }
    }

    /// The depth at which the pixel position's ray meets the plane.
    fn depth(&self, camera: &Camera, pixel: DVec2) -> f64 {
        let screen = (pixel - camera.principal_point) / camera.pixel_scale();
        if camera.is_orthographic() {
            let offset = screen - self.point.truncate();
            self.point.z - self.normal.truncate().dot(offset) / self.normal.z
        } else {
            self.normal.dot(self.point) / self.normal.dot(screen.extend(1.0))
        }
    }
}

/// Where the samples of a pixel lie.
fn sample_positions(table: &SampleTable, x: i32, y: i32) -> impl Iterator<Item = DVec2> {
    let corner = DVec2::new(f64::from(x), f64::from(y));
    table.jitter(x, y).iter().map(move |jitter| corner + DVec2::from(jitter.map(f64::from)))
}

fn sample_table(camera: &Camera, options: &RenderOptions) -> SampleTable {
    SampleTable::new(options, camera.lens(), camera.pixel_scale())
}

/// Two units in the last place of a number.
fn two_ulps(value: f32) -> f32 {
    2.0 * (value.abs().next_up() - value.abs())
}

// ---------------------------------------------------------------------------------------------------------
// Coverage of a disc

/// An ellipse of the picture, in pixels.
#[derive(Debug, Clone, Copy)]
struct Ellipse {
    area: f64,
    center: DVec2,
    /// An upper bound of its perimeter.
    perimeter: f64,
}

/// The image of a disc, from its cone: a ray d meets the plane n.p = k in d k/(n.d), within R of P where
/// k^2 |d|^2 - 2 k (P.d)(n.d) + (|P|^2 - R^2)(n.d)^2 <= 0.
fn image_of_disc(plane: Plane, radius: f64, camera: &Camera) -> Ellipse {
    let Plane { point, normal } = plane;
    let k = normal.dot(point);
    let outer = |a: DVec3, b: DVec3| DMat3::from_cols(a * b.x, a * b.y, a * b.z);
    let cone = DMat3::from_diagonal(DVec3::splat(k * k)) - k * (outer(point, normal) + outer(normal, point))
        + (point.length_squared() - radius * radius) * outer(normal, normal);
    let a = DMat2::from_cols(cone.x_axis.truncate(), cone.y_axis.truncate());
    let level = -cone.determinant() / a.determinant();
    let center = -(a.inverse() * cone.z_axis.truncate());
    let scale = camera.pixel_scale();
    // a^2 + b^2 of the semi-axes, and P <= 2 pi sqrt((a^2 + b^2) / 2).
    let squares = level * (a.x_axis.x + a.y_axis.y) / a.determinant();
    Ellipse {
        area: PI * level / a.determinant().sqrt() * scale.x * scale.y,
        center: center * scale + camera.principal_point,
        perimeter: 2.0 * PI * (0.5 * squares).sqrt() * scale.max_element(),
    }
}

fn assert_ellipse(name: &str, film: &Film, expected: Ellipse, options: &RenderOptions) {
    let area: f64 = alphas(film).sum();
    let error = (area - expected.area).abs();
    let bound = tol::area_of_samples(expected.perimeter, options.samples);
    assert!(error <= bound, "{name}: area {area}, expected {} +- {bound}", expected.area);
    let (centroid, _) = alpha_moments(film);
    let error = (centroid - expected.center).length();
    let bound = tol::centroid_of_samples(expected.perimeter, expected.area, options.samples);
    assert!(error <= bound, "{name}: centroid {error} pixels off, bound {bound}");
}

#[test]
fn a_disc_covers_the_area_of_its_ellipse() {
    let mut camera = pinhole(128, 112, 100.0);
    let focal_length = DVec2::new(110.0, 85.0);
    camera.projection = Projection::Perspective { focal_length, lens: None };
    camera.principal_point = DVec2::new(61.3, 52.9);
    for (i, normal) in [
        DVec3::new(0.0, 0.0, -1.0),
        DVec3::new(1.0, 0.0, -1.0),
        DVec3::new(-0.4, 0.7, -1.0),
        DVec3::new(0.3, -3.0, -0.5),
        DVec3::new(-2.0, 0.5, 0.6),
    ]
    .into_iter()
    .enumerate()
    {
        for filter in [PixelFilter::Box, PixelFilter::Tent] {
            // The same disc by different sigma and F.
            let cutoff: f64 = [1.0, 4.0, 9.0][i % 3];
            let surfel = Surfel::new(DVec3::new(0.35, -0.2, 3.0), normal, 1.1 / cutoff.sqrt());
            let cloud = cloud(&[surfel]);
            let options = RenderOptions { cutoff, filter, ..hard_discs(64) };
            let film = picture(&cloud, &camera, &options);
            let Shapes::Discs(sizes) = &cloud.shapes else { unreachable!("discs") };
            let expected = image_of_disc(Plane::of(&cloud, 0), f64::from(sizes[0]) * cutoff.sqrt(), &camera);
            assert_ellipse(&format!("disc {i}, {filter:?}"), &film, expected, &options);
        }
    }
}

#[test]
fn an_orthographic_disc_covers_its_foreshortened_area() {
    let mut camera = orthographic(96, 80, 24.0);
    camera.principal_point = DVec2::new(44.7, 43.1);
    let options = hard_discs(64);
    for normal in [DVec3::new(0.0, 0.0, -1.0), DVec3::new(1.0, -0.5, -1.0), DVec3::new(0.2, 4.0, 1.0)] {
        let cloud = cloud(&[Surfel::new(DVec3::new(0.2, -0.3, 3.0), normal, 1.25)]);
        let foreshortening = normal.z.abs() / normal.length();
        let expected = Ellipse {
            area: PI * 1.25 * 1.25 * foreshortening * 24.0 * 24.0,
            center: DVec2::new(0.2, -0.3) * 24.0 + camera.principal_point,
            perimeter: 2.0 * PI * 1.25 * 24.0,
        };
        assert_ellipse(&format!("{normal}"), &picture(&cloud, &camera, &options), expected, &options);
    }
}

#[test]
fn an_ellipse_covers_the_area_of_its_axes() {
    // Axes that are neither equal nor perpendicular, seen straight on: pi F |T1 x T2|.
    let camera = pinhole(96, 80, 60.0);
    let axes = [Vec3::new(0.5, 0.1, 0.0), Vec3::new(-0.2, 0.3, 0.0)];
    let surfel = Surfel::new(DVec3::new(0.1, 0.1, 2.0), DVec3::NEG_Z, 1.0);
    let cloud = Cloud { shapes: Shapes::Ellipses(vec![axes]), ..cloud(&[surfel]) };
    let options = RenderOptions { cutoff: 2.0, ..hard_discs(64) };
    let expected = Ellipse {
        area: PI * 2.0 * 0.17 * 30.0 * 30.0,
        center: DVec2::new(51.0, 43.0),
        perimeter: 2.0 * PI * (0.5 * 2.0 * (0.26 + 0.13f64)).sqrt() * 30.0,
    };
    assert_ellipse("ellipse", &picture(&cloud, &camera, &options), expected, &options);
}

/// The part of pixel (x, y) within a circle, by rows, each exact.
fn part_in_circle(x: i32, y: i32, center: DVec2, radius: f64) -> f64 {
    const ROWS: u32 = 256;
    let row = |i: u32| {
        let dy = f64::from(y) + (f64::from(i) + 0.5) / f64::from(ROWS) - center.y;
        let half = (radius * radius - dy * dy).max(0.0).sqrt();
        let (x0, x1) = (f64::from(x), f64::from(x) + 1.0);
        (x1.min(center.x + half) - x0.max(center.x - half)).max(0.0)
    };
    (0..ROWS).map(row).sum::<f64>() / f64::from(ROWS)
}

#[test]
fn the_edge_of_a_half_plane_covers_parts_of_pixels() {
    // The edge of a disc of 6000 pixels, from four sides and slanted, through the picture's middle (about).
    let camera = orthographic(24, 24, 1.0);
    let options = hard_discs(256);
    let radius = 6000.0;
    for (direction, bound) in [
        (DVec2::X, tol::STRAIGHT_EDGE),
        (DVec2::NEG_X, tol::STRAIGHT_EDGE),
        (DVec2::Y, tol::STRAIGHT_EDGE),
        (DVec2::NEG_Y, tol::STRAIGHT_EDGE),
        (DVec2::new(0.6, 0.8), tol::SLANTED_EDGE),
        (DVec2::new(-0.96, 0.28), tol::SLANTED_EDGE),
    ] {
        let center = -direction * (radius - 0.3);
        let cloud = cloud(&[Surfel::new(center.extend(5.0), DVec3::NEG_Z, radius)]);
        let film = picture(&cloud, &camera, &options);
        let center = cloud.world_position(0).truncate() + camera.principal_point;
        let (mut partial, mut largest) = (0, 0.0f64);
        for ((x, y), alpha) in pixels(&film).zip(alphas(&film)) {
            let expected = part_in_circle(x, y, center, radius);
            partial += i32::from(expected > 0.01 && expected < 0.99);
            largest = largest.max((alpha - expected).abs());
        }
        assert!(largest <= bound, "{direction}: {largest} > {bound}");
        assert!(partial >= 20, "{direction}: only {partial} pixels on the edge");
    }
}

#[test]
fn the_weights_of_a_splat_sum_to_its_area() {
    // area k / (sigma^2 I), with a saturation above the greatest weight: alpha is the weight, but for a
    // factor.
    let camera = pinhole(64, 64, 64.0);
    for kernel in [Kernel::Gaussian, Kernel::Windowed] {
        for table in [TableMode::Lerp256, TableMode::Floor256] {
            let surfel = Surfel::new(DVec3::new(0.05, 0.02, 2.0), DVec3::NEG_Z, 0.4);
            let cloud = Cloud { areas: Some(vec![0.5]), ..cloud(&[surfel]) };
            let options = RenderOptions {
                samples: 16,
                filter: PixelFilter::Box,
                kernel,
                table,
                resolve: soft(4.0),
                ..RenderOptions::default()
            };
            let film = picture(&cloud, &camera, &options);
            let sum = 4.0 * alphas(&film).sum::<f64>();
            let expected = 0.5 * 32.0 * 32.0;
            // The floor table is half a bin of 4/256 too early in the mean, for which the exponential falls
            // by half that: so much of its own integral, in units of the kernel's.
            let rim = libm::exp(-2.0);
            let jump = if kernel == Kernel::Windowed { 2.0 * rim } else { 0.0 };
            let floor = 1.0 / 256.0 * (1.0 - rim) / (1.0 - rim - jump);
            let bias = if table == TableMode::Floor256 { floor } else { 0.0 };
            let error = sum / expected - 1.0 - bias;
            assert!(error.abs() <= tol::SUM_OF_WEIGHTS, "{kernel:?}, {table:?}: {error}");
            // The greatest one at the middle.
            let peak = 4.0 * alphas(&film).fold(0.0, f64::max);
            let expected = 0.5 / (0.16 * kernel.integral(4.0));
            assert!((peak / expected - 1.0).abs() <= tol::PEAK_OF_WEIGHTS, "{kernel:?}: {peak}, {expected}");
        }
    }
}

// ---------------------------------------------------------------------------------------------------------
// Colour

#[test]
fn constant_colour_in_gives_constant_colour_out() {
    let camera = pinhole(40, 30, 30.0);
    let mut jumble = scenes::jumble(150, 0.1, 21);
    // Numbers of few digits survive every product and quotient; others are subject to rounding.
    let exact = Vec3::new(0.5, 2.0, 0.25);
    for color in [exact, Vec3::new(0.7, 0.2, 1.3)] {
        jumble.colors = Some(vec![color; jumble.len()]);
        for resolve in [OPAQUE, soft(1.0)] {
            for kernel in KERNELS {
                for (table, cutoff) in TABLES.into_iter().zip([2.0, 4.0, 9.0]) {
                    for transparent in [false, true] {
                        let cloud = Cloud {
                            opacities: jumble.opacities.clone().filter(|_| transparent),
                            ..jumble.clone()
                        };
                        let options = RenderOptions {
                            samples: 8,
                            kernel,
                            table,
                            cutoff,
                            resolve,
                            ..RenderOptions::default()
                        };
                        let mut overlap = vec![0usize; 40 * 30 * 8];
                        fragments(&cloud, &camera, &options, &mut |place, _, _| {
                            overlap[(place.y * 40 + place.x) as usize * 8 + place.sample] += 1;
                        })
                        .expect("a valid scene");
                        let most = overlap.iter().copied().max().unwrap_or(0);
                        assert!(most >= 8, "{most}");
                        let exactly = color == exact && resolve == OPAQUE && !transparent;
                        for [red, green, blue, alpha] in picture(&cloud, &camera, &options).rgba {
                            for (found, constant) in [red, green, blue].into_iter().zip(color.to_array()) {
                                let error = (found - alpha * constant).abs();
                                let bound = if exactly { 0.0 } else { tol::constant_colour(most) * constant };
                                assert!(
                                    error <= bound,
                                    "{kernel:?} {table:?} {resolve:?}: {found} / {alpha}, not {constant}"
                                );
                            }
                        }
                    }
                }
            }
        }
    }
}

/// A plane that fills any picture of these tests, across the axis at this depth.
fn wall(depth: f64) -> Surfel {
    Surfel::new(DVec3::new(0.0, 0.0, depth), DVec3::NEG_Z, 20.0)
}

#[test]
fn two_planes_composite() {
    let camera = pinhole(8, 8, 10.0);
    let (front, back) = ([0.75, 0.5, 0.125], [0.25, 0.875, 1.5]);
    for (a, b) in [(0.3f32, 0.6f32), (1.0, 0.5), (0.0, 0.7), (0.9, 1.0), (0.0, 0.0)] {
        // In either order of the file.
        for swap in [false, true] {
            let mut surfels =
                vec![wall(3.0).colored(front).with_opacity(a), wall(5.0).colored(back).with_opacity(b)];
            if swap {
                surfels.reverse();
            }
            for background in [None, Some([0.1, 0.2, 0.4, 1.0]), Some([2.0, 0.5, 0.0, 0.5])] {
                let options = RenderOptions { background, aovs: EVERYTHING, ..hard_discs(4) };
                let film = picture(&cloud(&surfels), &camera, &options);
                let behind = (1.0 - a) * (1.0 - b);
                let weight = behind * background.map_or(0.0, |color| color[3]);
                let expected = [0, 1, 2].map(|i| {
                    a * front[i] + (1.0 - a) * b * back[i] + background.map_or(0.0, |c| weight * c[i])
                });
                for pixel in &film.rgba {
                    for (found, expected) in pixel[..3].iter().zip(expected) {
                        assert!((found - expected).abs() <= tol::COMPOSITE, "{found}, expected {expected}");
                    }
                    let alpha = 1.0 - behind + weight;
                    assert!((pixel[3] - alpha).abs() <= tol::COMPOSITE, "{} {alpha}", pixel[3]);
                }
                // The visible layer is the one where half the light is gone.
                let depth = if a >= 0.5 {
                    3.0
                } else if behind <= 0.5 {
                    5.0
                } else {
                    f32::INFINITY
                };
                assert!(film.depth.iter().flatten().all(|&z| z == depth), "{a} {b}: {:?}", film.depth);
                assert!(film.coverage.iter().flatten().all(|&c| c == 1.0));
                assert!(film.layers.iter().flatten().all(|&n| n == 2.0));
            }
        }
    }
}

#[test]
fn over_blends_in_the_display_space() {
    // Two fronto-parallel Gaussians of sigma 4 and 6 pixels, one before the other, against the very samples'
    // places.
    let camera = pinhole(32, 32, 64.0);
    let [front, back] = [[0.8f32, 0.1, 0.4], [0.05, 0.6, 1.0]];
    let surfels = [
        Surfel::new(DVec3::new(0.5, 0.0, 8.0), DVec3::NEG_Z, 0.75).colored(back).with_opacity(0.7),
        Surfel::new(DVec3::new(-0.125, 0.0, 4.0), DVec3::NEG_Z, 0.25).colored(front).with_opacity(0.9),
    ];
    for background in [None, Some([0.2f32, 0.3, 0.9, 1.0]), Some([0.5, 0.5, 0.5, 0.25])] {
        let options = RenderOptions {
            samples: 4,
            kernel: Kernel::Gaussian,
            cutoff: 16.0,
            resolve: splat_abuffer::Resolve::Over,
            background,
            ..RenderOptions::default()
        };
        let film = picture(&cloud(&surfels), &camera, &options);
        let table = sample_table(&camera, &options);
        let mut largest = 0.0f64;
        for (x, y) in pixels(&film) {
            let (mut color, mut transmittance) = ([0.0f64; 3], 0.0f64);
            for position in sample_positions(&table, x, y) {
                let alpha = |center: f64, sigma: f64, opacity: f64| {
                    let r2 = (position - DVec2::new(center, 16.0)).length_squared() / (sigma * sigma);
                    let alpha = if r2 < 16.0 { opacity * libm::exp(-0.5 * r2) } else { 0.0 };
                    if alpha < 1.0 / 255.0 { 0.0 } else { alpha }
                };
                let (a, b) = (alpha(14.0, 4.0, 0.9), alpha(20.0, 6.0, 0.7));
                for i in 0..3 {
                    let [front, back] = [front[i], back[i]].map(|value| srgb::encode(value.into()));
                    color[i] += (a * front + (1.0 - a) * b * back) / 4.0;
                }
                transmittance += (1.0 - a) * (1.0 - b) / 4.0;
            }
            let weight = transmittance * background.map_or(0.0, |behind| f64::from(behind[3]));
            let alpha = 1.0 - transmittance + weight;
            let found = film.rgba[film.index(x, y)];
            largest = largest.max((f64::from(found[3]) - alpha).abs());
            for i in 0..3 {
                let behind = background.map_or(0.0, |behind| srgb::encode(behind[i].into()));
                let blended = color[i] + weight * behind;
                let straight = if alpha > 0.0 { blended / alpha } else { 0.0 };
                let linear = if straight <= 0.04045 {
                    straight / 12.92
                } else {
                    libm::pow((straight + 0.055) / 1.055, 2.4)
                };
                largest = largest.max((f64::from(found[i]) - linear * alpha).abs());
            }
        }
        assert!(largest <= tol::OVER_PICTURE, "{background:?}: {largest}");
    }
}

#[test]
fn over_leaves_out_what_is_fainter_than_one_step_of_eight_bits() {
    // .5 exp(-r2/2) = 1/255 at r2 = 2 ln 127.5, well within F.
    let camera = pinhole(64, 64, 64.0);
    let surfel = Surfel::new(DVec3::new(0.0, 0.0, 4.0), DVec3::NEG_Z, 0.5).with_opacity(0.5);
    let options = RenderOptions {
        samples: 64,
        kernel: Kernel::Gaussian,
        cutoff: 16.0,
        filter: PixelFilter::Box,
        resolve: splat_abuffer::Resolve::Over,
        aovs: AovSelection { coverage: true, ..AovSelection::default() },
        ..RenderOptions::default()
    };
    let film = picture(&cloud(&[surfel]), &camera, &options);
    let covered: f64 = film.coverage.iter().flatten().map(|&c| f64::from(c)).sum();
    let radius = 8.0 * (2.0 * libm::log(127.5)).sqrt();
    let bound = tol::area_of_samples(2.0 * PI * radius, 64);
    assert!((covered - PI * radius * radius).abs() <= bound, "{covered}, {}", PI * radius * radius);
}

// ---------------------------------------------------------------------------------------------------------
// Depth, normal, position

/// A tilted plane that fills a picture of 48 x 36 pixels at a focal length of 60, as one disc of this radius.
fn tilted_plane(radius: f64) -> Cloud {
    cloud(&[Surfel::new(DVec3::new(0.2, -0.1, 4.0), DVec3::new(0.5, -0.3, -0.8), radius)])
}

#[test]
fn the_depth_of_a_tilted_plane() {
    let options = RenderOptions { aovs: EVERYTHING, ..hard_discs(64) };
    // Measured from the centre, and from the deepest point of a disc that reaches behind the eye.
    for radius in [6.0, 50.0] {
        let cloud = tilted_plane(radius);
        let plane = Plane::of(&cloud, 0);
        for camera in [pinhole(48, 36, 60.0), orthographic(48, 36, 16.0)] {
            let film = picture(&cloud, &camera, &options);
            let table = sample_table(&camera, &options);
            let depths = film.depth.as_ref().expect("asked for");
            for (x, y) in pixels(&film) {
                let found = f64::from(depths[film.index(x, y)]);
                // Against the very samples' places: rounding only.
                let exact =
                    sample_positions(&table, x, y).map(|p| plane.depth(&camera, p)).sum::<f64>() / 64.0;
                let error = (found / exact - 1.0).abs();
                assert!(error <= tol::PLANE_DEPTH, "({x}, {y}): {found}, expected {exact}: {error}");
                // Against the pixel's centre: its samples' mean lies within 1/(2 S) of it on either axis,
                // since one sample lies in each of S strips, and a curved w has another mean than its middle.
                let at = |dx: f64, dy: f64| plane.depth(&camera, center_of(x, y) + DVec2::new(dx, dy));
                let middle = at(0.0, 0.0);
                let slope = (at(0.5, 0.0) - at(-0.5, 0.0)).abs() + (at(0.0, 0.5) - at(0.0, -0.5)).abs();
                let bend = (at(0.5, 0.0) + at(-0.5, 0.0) - 2.0 * middle).abs()
                    + (at(0.0, 0.5) + at(0.0, -0.5) - 2.0 * middle).abs()
                    + (at(0.5, 0.5) + at(-0.5, -0.5) - at(0.5, -0.5) - at(-0.5, 0.5)).abs();
                let bound = slope / 128.0 + bend + tol::PLANE_DEPTH * middle;
                assert!((found - middle).abs() <= bound, "({x}, {y}): {found}, {middle} +- {bound}");
                assert!(bound < 0.01 * middle, "({x}, {y}): a bound of {bound} says nothing");
            }
        }
    }
}

#[test]
fn the_depth_of_a_tilted_plane_through_a_lens() {
    // The ray from lens point p: (p + (s - p/focus) w, w).
    let lens = Lens { radius: 0.4, focus: 3.0, blades: 0 };
    let camera = with_lens(pinhole(48, 36, 60.0), lens);
    let options = RenderOptions { aovs: EVERYTHING, ..hard_discs(16) };
    let cloud = tilted_plane(6.0);
    let plane = Plane::of(&cloud, 0);
    let film = picture(&cloud, &camera, &options);
    let table = sample_table(&camera, &options);
    let (depths, positions) =
        (film.depth.as_ref().expect("asked for"), film.position.as_ref().expect("asked for"));
    for (x, y) in pixels(&film) {
        let points: DVec3 = sample_positions(&table, x, y)
            .zip(table.unit_lens(x, y))
            .map(|(position, unit)| {
                let p = DVec2::from(unit.map(f64::from)) * lens.radius;
                let screen = (position - camera.principal_point) / 60.0;
                let (origin, direction) = (p.extend(0.0), (screen - p / lens.focus).extend(1.0));
                let along = plane.normal.dot(plane.point - origin) / plane.normal.dot(direction);
                origin + along * direction
            })
            .sum::<DVec3>()
            / 16.0;
        let i = film.index(x, y);
        let error = (f64::from(depths[i]) / points.z - 1.0).abs();
        assert!(error <= tol::PLANE_DEPTH, "({x}, {y}): {error}");
        let position = positions[i].as_dvec3() + film.position_origin;
        let error = (position - points).length() / points.z;
        assert!(error <= tol::PLANE_DEPTH, "({x}, {y}): {error}");
    }
}

#[test]
fn the_normal_and_the_position_of_a_tilted_plane_anywhere() {
    for origin in [DVec3::ZERO, DVec3::new(500_000.0, 5_000_000.0, 100.0)] {
        let point = origin + DVec3::new(0.2, -0.1, 4.0);
        let surfel = Surfel::new(point, DVec3::new(0.5, -0.3, -0.8), 6.0);
        // Not the only point, so that the origin is no accident.
        let cloud =
            cloud(&[surfel, surfel, Surfel::new(point + DVec3::new(9.0, 0.1, 1.0), DVec3::NEG_Z, 0.1)]);
        let plane = Plane::of(&cloud, 0);
        let turn = DQuat::from_rotation_z(0.4);
        for mut camera in [pinhole(48, 36, 60.0), orthographic(48, 36, 16.0)] {
            camera.world_to_camera = DMat4::from_quat(turn) * DMat4::from_translation(-origin);
            let options = RenderOptions { aovs: EVERYTHING, ..hard_discs(16) };
            let film = picture(&cloud, &camera, &options);
            assert_eq!(film.position_origin, cloud.origin);
            let positions = film.position.as_ref().expect("asked for");
            let depths = film.depth.as_ref().expect("asked for");
            for (x, y) in pixels(&film) {
                let i = film.index(x, y);
                let position = positions[i].as_dvec3() + film.position_origin;
                // Points of a plane have their mean on the plane.
                let off = (position - plane.point).dot(plane.normal).abs();
                assert!(off <= tol::PLANE_POSITION, "({x}, {y}): {off} off the plane");
                let seen = camera.world_to_camera.transform_point3(position);
                assert!((seen.z - f64::from(depths[i])).abs() <= tol::PLANE_POSITION);
                let screen =
                    if camera.is_orthographic() { seen.truncate() } else { seen.truncate() / seen.z };
                let pixel = screen * camera.pixel_scale() + camera.principal_point;
                let error = (pixel - center_of(x, y)).abs().max_element();
                assert!(error <= tol::PLANE_PIXEL, "({x}, {y}): {error} pixels off");
                let normal = film.normal.as_ref().expect("asked for")[i].as_dvec3();
                assert!((normal - plane.normal).length() <= tol::UNIT_VECTOR, "{normal}");
                assert_eq!(film.albedo.as_ref().expect("asked for")[i], Vec3::ONE);
            }
        }
    }
}

#[test]
fn normals_of_unknown_side_face_the_eye() {
    for orthographic_camera in [false, true] {
        for oriented in [false, true] {
            let camera = if orthographic_camera { orthographic(8, 8, 4.0) } else { pinhole(8, 8, 10.0) };
            let away = Surfel { normal: DVec3::new(0.2, 0.1, 1.0), ..wall(4.0) };
            let cloud = Cloud { oriented, ..cloud(&[away]) };
            let options = RenderOptions { aovs: EVERYTHING, ..hard_discs(4) };
            let film = picture(&cloud, &camera, &options);
            let expected = if oriented { cloud.normals[0] } else { -cloud.normals[0] };
            for normal in film.normal.iter().flatten() {
                assert!((*normal - expected).length() <= tol::UNIT_VECTOR as f32, "{normal}");
            }
        }
    }
}

// ---------------------------------------------------------------------------------------------------------
// The lens

#[test]
fn a_point_out_of_focus_fills_its_circle_of_confusion() {
    const SAMPLES: u32 = 2048;
    let focal_length = DVec2::new(90.0, 75.0);
    for (depth, focus, blades) in [
        (2.0, 4.0, 0),
        (6.0, 3.0, 0),
        (5.0, f64::INFINITY, 0),
        (2.0, 4.0, 3),
        (6.0, 3.0, 5),
        (5.0, f64::INFINITY, 6),
    ] {
        let lens = Lens { radius: 0.5, focus, blades };
        let mut camera = pinhole(56, 48, 1.0);
        camera.projection = Projection::Perspective { focal_length, lens: Some(lens) };
        // A little disc of 1.5 pixels in x.
        let size = 1.5 * depth / focal_length.x;
        let surfel = Surfel::new(DVec3::new(0.02, -0.03, 1.0) * depth, DVec3::NEG_Z, size);
        let options = hard_discs(SAMPLES);
        let film = picture(&cloud(&[surfel]), &camera, &options);
        let name = format!("depth {depth}, focus {focus}, {blades} blades");

        let blur = lens.radius * (1.0 / depth - 1.0 / focus).abs() * focal_length;
        let disc = size / depth * focal_length;
        // The blur moves light, but loses none.
        let hits = alphas(&film).sum::<f64>() * f64::from(SAMPLES);
        let expected = PI * disc.x * disc.y * f64::from(SAMPLES);
        let bound = tol::deviations_of_count(expected);
        assert!((hits - expected).abs() <= bound, "{name}: {hits} hits, expected {expected} +- {bound}");

        // Second moments add: the aperture's, the disc's, and a pixel's (Sheppard's correction).
        let of_aperture = match blades {
            0 => 0.25,
            n => (2.0 + libm::cos(2.0 * PI / f64::from(n))) / 12.0,
        };
        let expected = of_aperture * blur * blur + 0.25 * disc * disc + 1.0 / 12.0;
        let (mean, moment) = alpha_moments(&film);
        let center = DVec2::new(0.02, -0.03) * focal_length + camera.principal_point;
        let bound = tol::deviations_of_moment(hits);
        for axis in 0..2 {
            let ratio = moment[axis] / expected[axis];
            assert!((ratio - 1.0).abs() <= bound, "{name}, axis {axis}: moment {ratio} of the expected");
            let error = (mean[axis] - center[axis]).abs();
            let bound = tol::deviations_of_mean(expected[axis], hits);
            assert!(error <= bound, "{name}, axis {axis}: {error} pixels off, bound {bound}");
        }

        // Every hit lies within the sum of both ellipses, and some lie near its rim.
        let reach = blur + disc;
        let mut farthest = 0.0f64;
        for ((x, y), _) in pixels(&film).zip(alphas(&film)).filter(|(_, alpha)| *alpha > 0.0) {
            let to_center = center_of(x, y) - center;
            let nearest = (to_center.abs() - 0.5).max(DVec2::ZERO) / reach;
            assert!(nearest.length() <= 1.0, "{name}: ({x}, {y}) lies outside of the blur");
            farthest = farthest.max((to_center / reach).length());
        }
        if blades == 0 {
            assert!(farthest >= tol::FARTHEST_PIXEL, "{name}: the farthest hit is at {farthest}");
        }
    }
}

#[test]
fn a_tilted_disc_out_of_focus_is_what_its_rays_hit() {
    let lens = Lens { radius: 0.6, focus: 5.0, blades: 0 };
    let camera = with_lens(pinhole(64, 56, 60.0), lens);
    let normal = DVec3::new(0.8, -0.5, -0.7).normalize();
    let cloud = cloud(&[Surfel::new(DVec3::new(0.3, 0.1, 3.0), normal, 0.9)]);
    let options = hard_discs(16);
    let film = picture(&cloud, &camera, &options);
    let table = sample_table(&camera, &options);
    let disc = Disc::round(
        cloud.world_position(0),
        Plane::of(&cloud, 0).normal,
        f64::from(0.9f32),
        &DMat4::IDENTITY,
    );
    let oracle_lens = brute_force::Lens { radius: lens.radius, focus: lens.focus };
    let mut partial = 0;
    for ((x, y), alpha) in pixels(&film).zip(alphas(&film)) {
        let squares: Vec<f64> = sample_positions(&table, x, y)
            .zip(table.unit_lens(x, y))
            .map(|(position, unit)| {
                let screen = (position - camera.principal_point) / 60.0;
                let on_lens = DVec2::from(unit.map(f64::from)) * lens.radius;
                let ray = SampleRay::thin_lens(screen, on_lens, &oracle_lens);
                disc.intersect(&ray).map_or(f64::INFINITY, |hit| hit.r2())
            })
            .collect();
        let within = |r2: f64| squares.iter().filter(|&&square| square < r2).count() as f64 / 16.0;
        let (least, most) = (within(1.0 - tol::LENS_R2), within(1.0 + tol::LENS_R2));
        assert!(least <= alpha && alpha <= most, "({x}, {y}): {alpha}, expected {least} to {most}");
        partial += i32::from(alpha > 0.0 && alpha < 1.0);
    }
    assert!(partial > 300, "{partial}");
}

#[test]
fn in_focus_a_lens_is_a_pinhole() {
    // Every ray of a sample meets the plane of focus in one point; only rounding at the rim may tell.
    let options = RenderOptions { kernel: Kernel::Disc, ..scenes::golden()[0].options.clone() };
    let surfels = [
        Surfel::new(DVec3::new(-0.3, 0.1, 3.0), DVec3::NEG_Z, 0.2).colored([0.2, 0.5, 0.9]),
        Surfel::new(DVec3::new(0.5, -0.2, 3.0), DVec3::NEG_Z, 0.4).colored([0.9, 0.1, 0.3]),
    ];
    let camera = pinhole(64, 48, 50.0);
    let sharp = picture(&cloud(&surfels), &camera, &options);
    for blades in [0, 7] {
        let camera = with_lens(camera.clone(), Lens { radius: 0.5, focus: 3.0, blades });
        let film = picture(&cloud(&surfels), &camera, &options);
        let differing = film.rgba.iter().zip(&sharp.rgba).filter(|(a, b)| a != b).count();
        assert!(differing <= tol::IN_FOCUS_PIXELS, "{differing} pixels differ");
        // A little out of focus, many do.
        let camera = with_lens(camera, Lens { radius: 0.5, focus: 3.1, blades });
        let film = picture(&cloud(&surfels), &camera, &options);
        let differing = film.rgba.iter().zip(&sharp.rgba).filter(|(a, b)| a != b).count();
        assert!(differing >= 20, "only {differing} pixels differ");
    }
}

// ---------------------------------------------------------------------------------------------------------
// A closed surface

#[test]
fn the_weights_of_a_closed_surface_sum_to_one() {
    let camera = pinhole(112, 112, 200.0);
    // Fronts only, a saturation of 2 and one sample a pixel: alpha is W/2 of one sample, if W < 2.
    let options = RenderOptions {
        samples: 1,
        filter: PixelFilter::Box,
        resolve: soft(2.0),
        cull: true,
        ..RenderOptions::default()
    };
    // The image of a unit sphere at distance 4 has a radius of 200/sqrt(15) pixels.
    let inside =
        |x: i32, y: i32| (center_of(x, y) - DVec2::splat(56.0)).length() < 0.95 * 200.0 / 15f64.sqrt();
    for count in [500, 4000] {
        for (kernel, cutoff) in [(Kernel::Windowed, 4.0), (Kernel::Gaussian, 4.0), (Kernel::Windowed, 9.0)] {
            let options = RenderOptions { kernel, cutoff, ..options.clone() };
            let cloud = scenes::sphere(DVec3::new(0.0, 0.0, 4.0), 1.0, count, &options);
            let film = picture(&cloud, &camera, &options);
            let weights: Vec<f64> = pixels(&film)
                .zip(alphas(&film))
                .filter(|&((x, y), _)| inside(x, y))
                .map(|(_, alpha)| 2.0 * alpha)
                .collect();
            let n = weights.len() as f64;
            let mean = weights.iter().sum::<f64>() / n;
            let spread = (weights.iter().map(|w| (w - mean).powi(2)).sum::<f64>() / n).sqrt();
            let least = weights.iter().copied().fold(f64::INFINITY, f64::min);
            let name = format!("{count} splats, {kernel:?}, F = {cutoff}");
            let Shapes::Discs(sizes) = &cloud.shapes else { unreachable!("discs") };
            let bound = tol::mean_weight(f64::from(sizes[count / 2]));
            assert!((mean - 1.0).abs() <= bound, "{name}: mean {mean}, bound {bound}");
            assert!(spread <= tol::SPREAD_OF_WEIGHT, "{name}: spread {spread}");
            let bound = 1.0 - bound - 4.0 * tol::SPREAD_OF_WEIGHT;
            assert!(least >= bound, "{name}: least {least}, bound {bound}");
            // With a saturation of 1, front and back together let next to nothing through.
            let usual = RenderOptions { resolve: soft(1.0), cull: false, samples: 4, ..options.clone() };
            let film = picture(&cloud, &camera, &usual);
            for ((x, y), alpha) in pixels(&film).zip(alphas(&film)).filter(|&((x, y), _)| inside(x, y)) {
                assert!(1.0 - alpha <= (1.0 - bound).powi(2), "{name}: alpha {alpha} at ({x}, {y})");
            }

            // So there is no hole: neither in front alone, nor with the far side behind.
            for cull in [false, true] {
                let options =
                    RenderOptions { resolve: OPAQUE, cull, samples: 8, aovs: EVERYTHING, ..options.clone() };
                let film = picture(&cloud, &camera, &options);
                for (x, y) in pixels(&film).filter(|&(x, y)| inside(x, y)) {
                    let i = film.index(x, y);
                    assert_eq!(film.rgba[i], [1.0; 4], "{name}: ({x}, {y})");
                    assert_eq!(film.coverage.as_ref().expect("asked for")[i], 1.0, "{name}: ({x}, {y})");
                }
            }
        }
    }
}

// ---------------------------------------------------------------------------------------------------------
// What is seen

#[test]
fn splats_have_two_sides_unless_backs_are_culled() {
    let camera = pinhole(16, 12, 20.0);
    let ortho = orthographic(16, 12, 5.0);
    let lens = with_lens(pinhole(16, 12, 20.0), Lens { radius: 0.1, focus: 5.0, blades: 0 });
    for camera in [&camera, &ortho, &lens] {
        for (normal, front) in [(DVec3::NEG_Z, true), (DVec3::Z, false), (DVec3::new(0.3, 0.2, 1.0), false)] {
            for oriented in [true, false] {
                for cull in [false, true] {
                    let cloud = Cloud { oriented, ..cloud(&[Surfel { normal, ..wall(4.0) }]) };
                    let options = RenderOptions { cull, ..hard_discs(4) };
                    let seen = front || !oriented || !cull;
                    let expected = if seen { 1.0 } else { 0.0 };
                    let Rendered { film, statistics } = rendered(&cloud, camera, &options);
                    assert!(alphas(&film).all(|a| a == expected), "{normal} {oriented} {cull}");
                    // What shows no front to the lens costs no test.
                    assert_eq!(statistics.drawn, usize::from(seen), "{normal} {oriented} {cull}");
                }
            }
        }
    }
}

#[test]
fn facings_are_layers_of_their_own() {
    // Two coplanar splats merge; a front and a back at the same place do not.
    let camera = pinhole(8, 8, 10.0);
    let options = RenderOptions { aovs: EVERYTHING, ..hard_discs(4) };
    for (normal, oriented, layers) in
        [(DVec3::NEG_Z, true, 1.0), (DVec3::Z, true, 2.0), (DVec3::Z, false, 1.0)]
    {
        let cloud = Cloud { oriented, ..cloud(&[wall(4.0), Surfel { normal, ..wall(4.0) }]) };
        let film = picture(&cloud, &camera, &options);
        assert!(film.layers.iter().flatten().all(|&n| n == layers), "{normal} {oriented}");
    }
}

#[test]
fn a_lens_sees_fronts_that_its_middle_does_not() {
    // The disc's plane meets the lens of radius 1 in the chord x = -.03. Through a lens point at a distance d
    // from the chord, the image of the disc has an area in proportion to d, whichever the side. The fronts'
    // share is that of the integral of d over their side, of which F(p) = int_p^1 (x - p) 2 sqrt(1 - x^2) dx
    // is the closed form.
    let camera = with_lens(pinhole(32, 32, 60.0), Lens { radius: 1.0, focus: 3.0, blades: 0 });
    let steep = cloud(&[Surfel::new(DVec3::new(0.0, 0.0, 3.0), DVec3::new(1.0, 0.0, -0.01), 0.5)]);
    let options = hard_discs(512);
    let both: f64 = alphas(&picture(&steep, &camera, &options)).sum();
    let front: f64 =
        alphas(&picture(&steep, &camera, &RenderOptions { cull: true, ..options.clone() })).sum();
    let integral = |p: f64| {
        let rest = 1.0 - p * p;
        2.0 / 3.0 * rest * rest.sqrt() - p * (libm::acos(p) - p * rest.sqrt())
    };
    let expected = integral(-0.03) / (integral(-0.03) + integral(0.03));
    let bound = tol::deviations_of_share(both * 512.0);
    assert!(bound < 0.03, "{both} pixels say nothing");
    assert!((front / both - expected).abs() <= bound, "{}, expected {expected} +- {bound}", front / both);
    // The other side: what one shows, the other hides.
    let turned = Cloud { normals: vec![-steep.normals[0]], ..steep };
    let back: f64 = alphas(&picture(&turned, &camera, &RenderOptions { cull: true, ..options })).sum();
    assert!((front + back - both).abs() <= f64::from(tol::COMPOSITE), "{front} + {back}, not {both}");
}

#[test]
fn near_and_far_cut_samples_off() {
    let cloud = tilted_plane(50.0);
    let plane = Plane::of(&cloud, 0);
    for mut camera in [pinhole(48, 36, 60.0), orthographic(48, 36, 16.0)] {
        (camera.near, camera.far) = (3.7, 4.6);
        let options = hard_discs(16);
        let film = picture(&cloud, &camera, &options);
        let table = sample_table(&camera, &options);
        let mut kinds = [0; 3];
        for ((x, y), alpha) in pixels(&film).zip(alphas(&film)) {
            let depths: Vec<f64> = sample_positions(&table, x, y).map(|p| plane.depth(&camera, p)).collect();
            let between = |slack: f64| {
                let [near, far] = [camera.near * (1.0 + slack), camera.far * (1.0 - slack)];
                depths.iter().filter(|&&w| w > near && w < far).count() as f64 / 16.0
            };
            let (least, most) = (between(tol::PLANE_DEPTH), between(-tol::PLANE_DEPTH));
            assert!(least <= alpha && alpha <= most, "({x}, {y}): {alpha}, expected {least} to {most}");
            kinds[usize::from(most > 0.0) + usize::from(least == 1.0)] += 1;
        }
        assert!(kinds.iter().all(|&n| n > 50), "{kinds:?}");
    }
}

#[test]
fn what_is_wholly_out_of_near_and_far_is_not_drawn() {
    // Half a unit of depth on either side: sigma 1 at 30 degrees, F = 1.
    let cloud = cloud(&[Surfel::new(DVec3::Z * 5.0, DVec3::new(0.5, 0.0, -0.75f64.sqrt()), 1.0)]);
    for mut camera in [pinhole(16, 12, 20.0), orthographic(16, 12, 10.0)] {
        for (near, far, drawn) in [
            (4.4, 5.6, 1),
            (5.49, f64::INFINITY, 1),
            (5.51, f64::INFINITY, 0),
            (0.01, 4.51, 1),
            (0.01, 4.49, 0),
        ] {
            (camera.near, camera.far) = (near, far);
            let options = hard_discs(16);
            let Rendered { film, statistics } = rendered(&cloud, &camera, &options);
            assert_eq!(statistics.drawn, drawn, "{near} {far}");
            assert!(drawn == 1 || alphas(&film).sum::<f64>() == 0.0, "{near} {far}");
        }
    }
}

#[test]
fn clip_planes_leave_out_whole_splats() {
    let discs: Vec<Surfel> = (0..4)
        .map(|i| Surfel::new(DVec3::new(-1.5 + f64::from(i), 0.0, 4.0), DVec3::new(1.0, 0.0, -1.0), 0.3))
        .collect();
    let cloud = cloud(&discs);
    let options = hard_discs(4);
    let turn = DMat4::from_rotation_translation(DQuat::from_rotation_y(0.1), DVec3::new(0.1, 0.0, 0.3));
    let mut camera = Camera { world_to_camera: turn, ..pinhole(64, 32, 50.0) };
    let drawn = |camera: &Camera| {
        let mut seen = [false; 4];
        let ids = RenderOptions { aovs: EVERYTHING, ..options.clone() };
        for id in picture(&cloud, camera, &ids).id.into_iter().flatten().filter(|&id| id != NO_ID) {
            seen[id as usize] = true;
        }
        seen
    };
    assert_eq!(drawn(&camera), [true; 4]);
    // Half a disc reaches .3 sin 45 = .212 along x.
    camera.clip_planes = vec![DVec4::new(1.0, 0.0, 0.0, 0.5 - 0.21)];
    assert_eq!(drawn(&camera), [false, true, true, true]);
    camera.clip_planes = vec![DVec4::new(1.0, 0.0, 0.0, 0.5 - 0.215)];
    assert_eq!(drawn(&camera), [false, false, true, true]);
    camera.clip_planes.push(DVec4::new(-1.0, 0.0, 0.0, 1.0));
    assert_eq!(drawn(&camera), [false, false, true, false]);
    // A splat that is not left out is drawn whole.
    camera.clip_planes = vec![DVec4::new(1.0, 0.0, 0.0, 0.5)];
    let clipped = picture(&cloud, &camera, &options);
    camera.clip_planes.clear();
    let three = permuted(&cloud, &[1, 2, 3]);
    assert_same_bits("clipped", &clipped, &picture(&three, &camera, &options));
}

// ---------------------------------------------------------------------------------------------------------
// AOVs

#[test]
fn the_id_is_that_of_the_heaviest_fragment_in_front() {
    // Two coplanar Gaussians of one size: the nearer centre is the heavier. A third one far behind.
    let camera = pinhole(32, 24, 20.0);
    let surfels = [
        Surfel::new(DVec3::new(0.0, 0.0, 8.0), DVec3::NEG_Z, 20.0),
        Surfel::new(DVec3::new(-0.6, 0.0, 4.0), DVec3::NEG_Z, 3.0),
        Surfel::new(DVec3::new(0.6, 0.0, 4.0), DVec3::NEG_Z, 3.0),
    ];
    let options = RenderOptions {
        samples: 4,
        filter: PixelFilter::Box,
        kernel: Kernel::Gaussian,
        cutoff: 3.0,
        thickness: 0.01,
        aovs: EVERYTHING,
        ..RenderOptions::default()
    };
    let film = picture(&cloud(&surfels), &camera, &options);
    let ids = film.id.as_ref().expect("asked for");
    for (x, y) in pixels(&film) {
        assert_eq!(ids[film.index(x, y)], if x < 16 { 1 } else { 2 }, "({x}, {y})");
    }
    assert!(film.layers.iter().flatten().all(|&n| n == 2.0));
    // Nothing there, nothing told.
    let empty = picture(&cloud(&[Surfel::new(DVec3::NEG_Z, DVec3::Z, 0.1)]), &camera, &options);
    assert_eq!(empty.rgba, vec![[0.0; 4]; 32 * 24]);
    assert!(empty.id.iter().flatten().all(|&id| id == NO_ID));
    assert!(empty.depth.iter().flatten().all(|&z| z == f32::INFINITY));
    assert!(empty.coverage.iter().chain(&empty.layers).flatten().all(|&value| value == 0.0));
    assert!(empty.normal.iter().chain(&empty.albedo).flatten().all(|&value| value == Vec3::ZERO));
    assert!(empty.position.iter().chain(&empty.variance).flatten().all(|&value| value == Vec3::ZERO));
}

#[test]
fn aovs_count_samples_layers_coverage_and_variance() {
    // A transparent wall before an opaque disc.
    let camera = pinhole(24, 24, 24.0);
    let surfels = [wall(3.0).with_opacity(0.25), Surfel::new(DVec3::new(0.0, 0.0, 4.0), DVec3::NEG_Z, 1.0)];
    let options = RenderOptions { aovs: EVERYTHING, ..hard_discs(16) };
    let film = picture(&cloud(&surfels), &camera, &options);
    let (layers, variance) = (film.layers.as_ref().expect("asked"), film.variance.as_ref().expect("asked"));
    let mut partial = 0;
    for i in 0..film.rgba.len() {
        // p of the samples hit the disc: two layers, alpha 1; the others see the wall alone.
        let p = layers[i] - 1.0;
        partial += i32::from(p > 0.0 && p < 1.0);
        assert!((0.0..=1.0).contains(&p));
        assert_eq!(film.rgba[i][3], 0.25 + 0.75 * p);
        assert_eq!(film.coverage.as_ref().expect("asked")[i], 1.0);
        assert_eq!(film.samples.as_ref().expect("asked")[i], 16.0);
        // The variance of the mean of n values, of which a part p is .75 larger.
        let expected = 0.75 * 0.75 * p * (1.0 - p) / 15.0;
        assert!(
            (variance[i] - Vec3::splat(expected)).abs().max_element() <= tol::VARIANCE,
            "{}",
            variance[i]
        );
        // The disc is what one sees, at its very depth; the wall alone leaves most of the light.
        let depth = film.depth.as_ref().expect("asked")[i];
        assert_eq!(depth, if p > 0.0 { 4.0 } else { f32::INFINITY });
    }
    assert!(partial > 20, "{partial}");
    // Without the wall, coverage is alpha.
    let alone = picture(&cloud(&surfels[1..]), &camera, &options);
    let coverage = alone.coverage.as_ref().expect("asked");
    assert!(alone.rgba.iter().zip(coverage).all(|(pixel, &c)| pixel[3] == c));
    assert!(coverage.iter().any(|&c| c > 0.0 && c < 1.0));
    let some = RenderOptions { sample_range: Some(3..5), ..options };
    assert!(picture(&cloud(&surfels), &camera, &some).samples.iter().flatten().all(|&n| n == 2.0));
    let one = RenderOptions { samples: 1, ..some };
    let one = RenderOptions { sample_range: None, ..one };
    assert!(picture(&cloud(&surfels), &camera, &one).variance.iter().flatten().all(|&v| v == Vec3::ZERO));
}

// ---------------------------------------------------------------------------------------------------------
// The same picture by other means

#[test]
fn a_crop_is_a_window_of_the_whole() {
    for scene in all_scenes() {
        let whole = picture(&scene.cloud, &scene.camera, &scene.options);
        let bits = film_bits(&whole);
        for window in [
            PixelRect::new(0, 0, 64, 48),
            PixelRect::new(13, 7, 51, 40),
            PixelRect::new(31, 31, 33, 33),
            PixelRect::new(40, 20, 41, 21),
            PixelRect::new(-5, 44, 9, 99),
        ] {
            let options = RenderOptions { window: Some(window), ..scene.options.clone() };
            let crop = picture(&scene.cloud, &scene.camera, &options);
            assert_eq!(crop.window, window.intersect(&PixelRect::new(0, 0, 64, 48)));
            assert_eq!(crop.frame, [64, 48]);
            let crop_bits = film_bits(&crop);
            assert_eq!(crop_bits.len(), crop.window.area());
            for (x, y) in pixels(&crop) {
                let [part, all] = [&crop_bits[crop.index(x, y)], &bits[whole.index(x, y)]];
                assert_eq!(part, all, "{}: ({x}, {y}) of {window:?}", scene.name);
            }
        }
    }
}

#[test]
fn joined_sample_ranges_agree_with_the_whole() {
    let mut compared = 0;
    for scene in all_scenes() {
        // `over` is linearised after the mean: its films join in the display's space.
        let over = scene.options.resolve == splat_abuffer::Resolve::Over;
        let whole = picture(&scene.cloud, &scene.camera, &scene.options);
        let n = scene.options.samples;
        for cut in 1..n {
            let parts = [0..cut, cut..n].map(|range| {
                let options = RenderOptions { sample_range: Some(range), ..scene.options.clone() };
                picture(&scene.cloud, &scene.camera, &options)
            });
            let weights = [cut, n - cut].map(|count| f64::from(count) / f64::from(n));
            for (i, &expected) in whole.rgba.iter().enumerate() {
                for channel in 0..4 {
                    let value = |pixel: [f32; 4]| {
                        let [value, alpha] = [pixel[channel], pixel[3]].map(f64::from);
                        let encoded = over && channel < 3 && alpha > 0.0;
                        if encoded { srgb::encode(value / alpha) * alpha } else { value }
                    };
                    let joined: f64 =
                        parts.iter().zip(weights).map(|(film, w)| w * value(film.rgba[i])).sum();
                    let bound = if over && channel < 3 {
                        tol::DISPLAY_SPACE
                    } else {
                        f64::from(two_ulps(expected[channel]))
                    };
                    let expected = value(expected);
                    let error = (joined - expected).abs();
                    assert!(error <= bound, "{}: {joined}, not {expected}", scene.name);
                    compared += i32::from(expected > 0.0);
                }
                for (channel, parts) in [
                    (&whole.coverage, parts.each_ref().map(|film| &film.coverage)),
                    (&whole.layers, parts.each_ref().map(|film| &film.layers)),
                ] {
                    let at = |values: &Option<Vec<f32>>| values.as_ref().map_or(f32::NAN, |values| values[i]);
                    let joined: f64 = parts.iter().zip(weights).map(|(c, w)| w * f64::from(at(c))).sum();
                    let error = (joined - f64::from(at(channel))).abs();
                    assert!(error <= f64::from(two_ulps(at(channel))), "{}: {joined}", scene.name);
                }
            }
        }
    }
    assert!(compared > 100_000, "{compared}");
}

#[test]
fn a_tiny_budget_of_memory_changes_no_bit() {
    for scene in all_scenes() {
        let whole = rendered(&scene.cloud, &scene.camera, &scene.options);
        for tile_memory in [1, 20_000] {
            let options = RenderOptions { tile_memory, ..scene.options.clone() };
            let split = rendered(&scene.cloud, &scene.camera, &options);
            assert_same_bits(scene.name, &whole.film, &split.film);
            assert_eq!(whole.statistics.fragments, split.statistics.fragments, "{}", scene.name);
            assert_eq!(whole.statistics.samples, split.statistics.samples, "{}", scene.name);
            assert_eq!(whole.statistics.tests, split.statistics.tests, "{}", scene.name);
        }
    }
}

/// A random order of `count` things.
fn shuffled(count: usize, seed: u64) -> Vec<usize> {
    let mut random = Random::new(seed);
    let mut order: Vec<usize> = (0..count).collect();
    for last in (1..count).rev() {
        order.swap(last, random.index(last + 1));
    }
    order
}

#[test]
fn the_order_of_points_changes_no_bit() {
    for scene in all_scenes() {
        // Four splats that differ in colour alone: enough for the order of sums to tell.
        let order: Vec<usize> = (0..scene.cloud.len()).map(|i| if i < 4 { 0 } else { i }).collect();
        let mut cloud = permuted(&scene.cloud, &order);
        for (i, color) in cloud.colors.iter_mut().flatten().take(4).enumerate() {
            *color *= 0.7 + 0.11 * i as f32;
        }
        let film = picture(&cloud, &scene.camera, &scene.options);
        for seed in 0..3 {
            let order = shuffled(cloud.len(), seed);
            let mut other = picture(&permuted(&cloud, &order), &scene.camera, &scene.options);
            // The id is the place in the file: new point i was `order[i]`.
            for id in other.id.iter_mut().flatten().filter(|id| **id != NO_ID) {
                *id = order[*id as usize] as u32;
            }
            assert_same_bits(scene.name, &film, &other);
        }
    }
}

/// The cloud with one more point in front of all others, like the first one.
fn with_one_more(cloud: &Cloud) -> Cloud {
    let order: Vec<usize> = std::iter::once(0).chain(0..cloud.len()).collect();
    permuted(cloud, &order)
}

#[test]
fn a_bad_point_changes_nothing_but_the_count() {
    for scene in all_scenes() {
        let good = rendered(&scene.cloud, &scene.camera, &scene.options);
        assert!(good.statistics.dropped.is_empty(), "{}", scene.name);
        let mut bad = with_one_more(&scene.cloud);
        bad.positions[0].y = f32::NAN;
        let mut found = rendered(&bad, &scene.camera, &scene.options);
        assert_eq!(found.statistics.dropped.get("not_finite"), Some(&1), "{}", scene.name);
        assert_eq!(found.statistics.dropped.len(), 1);
        assert_eq!(found.statistics.drawn, good.statistics.drawn);
        for id in found.film.id.iter_mut().flatten().filter(|id| **id != NO_ID) {
            *id -= 1;
        }
        assert_same_bits(scene.name, &good.film, &found.film);
    }
}

#[test]
fn every_defect_is_counted_by_its_cause() {
    let camera = pinhole(16, 12, 12.0);
    let options = hard_discs(4);
    let good = Cloud { areas: Some(vec![1.0]), ..cloud(&[Surfel::new(DVec3::Z * 3.0, DVec3::NEG_Z, 0.5)]) };
    let ellipse = Cloud { shapes: Shapes::Ellipses(vec![[Vec3::X, Vec3::Y]]), ..good.clone() };
    let clean = picture(&good, &camera, &options);
    assert!(alphas(&clean).sum::<f64>() > 1.0);

    type Spoil = fn(&mut Cloud);
    fn size(cloud: &mut Cloud, value: f32) {
        cloud.shapes = Shapes::Discs(vec![value, 0.5]);
    }
    let spoils: &[(&str, Spoil)] = &[
        ("not_finite", |c| c.positions[0].x = f32::NAN),
        ("not_finite", |c| c.positions[0].z = f32::INFINITY),
        ("not_finite", |c| c.normals[0].y = f32::NAN),
        ("not_finite", |c| c.normals[0].z = f32::NEG_INFINITY),
        ("not_finite", |c| c.colors.as_mut().expect("there")[0].y = f32::NAN),
        ("not_finite", |c| c.colors.as_mut().expect("there")[0].z = f32::INFINITY),
        ("not_finite", |c| c.opacities.as_mut().expect("there")[0] = f32::NAN),
        ("not_finite", |c| c.areas.as_mut().expect("there")[0] = f32::INFINITY),
        ("not_finite", |c| size(c, f32::NAN)),
        ("not_finite", |c| size(c, f32::INFINITY)),
        ("zero_normal", |c| c.normals[0] = Vec3::ZERO),
        ("negative_size", |c| size(c, -0.5)),
        ("unknown_size", |c| size(c, 0.0)),
        ("edge_on", |c| c.normals[0] = Vec3::X),
    ];
    for (cause, spoil) in spoils {
        let mut bad = with_one_more(&good);
        spoil(&mut bad);
        let found = rendered(&bad, &camera, &options);
        assert_eq!(found.statistics.dropped.get(cause), Some(&1), "{cause}: {:?}", found.statistics.dropped);
        assert_eq!(found.statistics.dropped.len(), 1, "{cause}");
        assert_eq!(found.statistics.drawn, 1, "{cause}");
        assert_same_bits(cause, &clean, &found.film);
    }
    let clean = picture(&ellipse, &camera, &options);
    for (cause, axes) in [
        ("not_finite", [Vec3::new(0.0, f32::NAN, 0.0), Vec3::Y]),
        ("not_finite", [Vec3::X, Vec3::new(0.0, f32::INFINITY, 0.0)]),
        ("zero_normal", [Vec3::X, 2.0 * Vec3::X]),
        ("zero_normal", [Vec3::X, Vec3::ZERO]),
    ] {
        let bad =
            Cloud { shapes: Shapes::Ellipses(vec![axes, [Vec3::X, Vec3::Y]]), ..with_one_more(&ellipse) };
        let found = rendered(&bad, &camera, &options);
        assert_eq!(found.statistics.dropped.get(cause), Some(&1), "{axes:?}: {:?}", found.statistics.dropped);
        assert_eq!(found.statistics.dropped.len(), 1, "{axes:?}");
        assert_same_bits(cause, &clean, &found.film);
    }
    // An area that leaves no weight is no defect, and nothing to see either.
    for area in [0.0, -1.0] {
        let none = Cloud { areas: Some(vec![area]), ..good.clone() };
        let film = picture(&none, &camera, &RenderOptions::default());
        assert!(film.rgba.iter().all(|&pixel| pixel == [0.0; 4]), "{area}");
    }
}

#[test]
fn a_shifted_world_is_the_same_picture() {
    let (width, height) = (160, 120);
    let mut random = Random::new(31);
    let directions = scenes::fibonacci_sphere(3000);
    let mut surfels: Vec<Surfel> = directions
        .iter()
        .map(|&direction| {
            let color = [0; 3].map(|_| random.unit() as f32);
            Surfel::new(DVec3::new(0.1, 0.0, 3.0) + 0.8 * direction, direction, 0.035).colored(color)
        })
        .collect();
    surfels.extend((0..30).map(|_| {
        let place = DVec3::new(random.range(-1.5, 1.5), random.range(-1.2, 1.2), random.range(1.5, 5.0));
        let color = [0; 3].map(|_| random.unit() as f32);
        Surfel::new(place, random.direction(), random.range(0.02, 0.2)).colored(color).with_opacity(0.5)
    }));
    let turn = DMat4::from_rotation_translation(DQuat::from_rotation_z(0.5), DVec3::new(0.0, 0.1, 0.2));
    let lens = Lens { radius: 0.03, focus: 2.5, blades: 0 };
    for camera in [
        pinhole(width, height, 130.0),
        with_lens(pinhole(width, height, 130.0), lens),
        orthographic(width, height, 50.0),
    ] {
        let picture_at = |shift: DVec3| {
            let shifted: Vec<Surfel> =
                surfels.iter().map(|s| Surfel { position: s.position + shift, ..*s }).collect();
            let camera = Camera { world_to_camera: turn * DMat4::from_translation(-shift), ..camera.clone() };
            let options = RenderOptions { samples: 4, ..RenderOptions::default() };
            picture(&cloud(&shifted), &camera, &options)
        };
        let here = picture_at(DVec3::ZERO);
        let there = picture_at(DVec3::new(500_000.0, 5_000_000.0, 100.0));
        let shown = |pixel: [f32; 4]| {
            let [red, green, blue, alpha] = pixel.map(f64::from);
            [srgb::encode(red), srgb::encode(green), srgb::encode(blue), alpha]
        };
        let differing = here.rgba.iter().zip(&there.rgba).filter(|&(&a, &b)| {
            let pairs = shown(a).into_iter().zip(shown(b));
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) > 2.0 / 255.0
        });
        let part = differing.count() as f64 / here.rgba.len() as f64;
        assert!(part <= tol::SHIFTED_PIXELS, "{part}");
        assert!(alphas(&here).sum::<f64>() > 0.2 * here.rgba.len() as f64, "an empty picture says nothing");
    }
}
