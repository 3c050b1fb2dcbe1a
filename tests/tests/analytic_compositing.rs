//! Fragments blended into a colour and an alpha, against the sums written down.

use std::f64::consts::PI;

use glam::{DVec2, DVec3, Vec3};
use splat_core::{AovSelection, Cloud, Kernel, PixelFilter, RenderOptions, TableMode, fragments, srgb};
use splat_tests::analytic::{picture, pixels, sample_positions, sample_table, wall};
use splat_tests::scenes::{self, OPAQUE, Surfel, cloud, hard_discs, pinhole, soft};
use splat_tests::tolerances as tol;

const KERNELS: [Kernel; 3] = [Kernel::Gaussian, Kernel::Windowed, Kernel::Disc];
const TABLES: [TableMode; 3] = [TableMode::Floor256, TableMode::Midpoint256, TableMode::Lerp256];

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
                let options = RenderOptions { background, aovs: AovSelection::ALL, ..hard_discs(4) };
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
