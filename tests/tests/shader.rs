//! The splat shader: textures, surroundings, light and closures, against closed forms, and in both engines.

use glam::{DAffine3, DMat3, DVec2, DVec3, Vec2};
use splat_abuffer::Resolve;
use splat_core::shade::{Detail, Environment, Material, Materials, Optics, ShadedPoint};
use splat_core::texture::{
    FunctionTexture, ImageTexture, Mapping, Placement, Pyramid, Sampler, SolidMapping, SpacePoint, Texels,
    Texture, TextureFunction, Wrap,
};
use splat_core::{
    AovSelection, Camera, Cloud, Film, Lens, RenderOptions, Shading, Shapes, TextureCoordinates, render,
};
use splat_simd::{Level, Renderer};
use splat_tests::analytic::{assert_same_bits, center_of, picture, pixels};
use splat_tests::core_scenes::tilted_axes;
use splat_tests::scenes::{orthographic, pinhole, with_lens};
use splat_tests::tolerances as tol;
use std::sync::Arc;

/// A plane through `center` that leaves the direction to the eye by `tilt` degrees, as 61 x 61 splats of sigma `size`, one
/// sigma apart, with texture coordinates in units of `period`.
fn plane(center: DVec3, tilt: f64, size: f64, period: f64) -> Cloud {
    let [t1, t2] = tilted_axes(center, tilt, 0.4, 0.3, [size; 2]);
    let mut positions = Vec::new();
    let mut coordinates = Vec::new();
    let step = size / period;
    for j in -30..=30 {
        for i in -30..=30 {
            let (u, v) = (f64::from(i), f64::from(j));
            positions.push(center + u * t1 + v * t2);
            coordinates.push(TextureCoordinates {
                center: DVec2::new(u * step, v * step).as_vec2(),
                per_u: Vec2::new(step as f32, 0.0),
                per_v: Vec2::new(0.0, step as f32),
            });
        }
    }
    let count = positions.len();
    Cloud {
        normals: vec![t1.cross(t2).normalize().as_vec3(); count],
        shapes: Shapes::Ellipses(vec![[t1.as_vec3(), t2.as_vec3()]; count]),
        areas: Some(vec![(size * size) as f32; count]),
        texture_coordinates: Some(coordinates),
        ..Cloud::from_points(&positions)
    }
}

fn options(material: Material) -> RenderOptions {
    RenderOptions { samples: 8, material: material.into(), ..RenderOptions::default() }
}

fn textured(texture: Texture) -> Material {
    Material { texture: Some(Arc::new(texture)), ..Material::default() }
}

/// A function that is linear in space, and so its own mean over any footprint.
struct Linear(DVec3);

impl TextureFunction for Linear {
    fn value(&self, point: DVec3) -> f64 {
        self.0.dot(point)
    }

    fn filtered(&self, at: &SpacePoint) -> f64 {
        self.value(at.point)
    }
}

fn linear(slope: DVec3, placement: Placement) -> Texture {
    let colors = [[0.0; 3], [1.0, 2.0, 4.0]];
    Texture::Function(FunctionTexture { function: Arc::new(Linear(slope)), placement, colors })
}

const IN_SPACE: Placement = Placement::Solid(SolidMapping { world_to_texture: DAffine3::IDENTITY });

/// Where a pixel's ray meets the plane of a cloud of [`plane`].
fn hit(cloud: &Cloud, camera: &Camera, pixel: DVec2) -> DVec3 {
    let (point, normal) = (cloud.world_position(0), cloud.normals[0].as_dvec3());
    let screen = (pixel - camera.principal_point) / camera.pixel_scale();
    if camera.is_orthographic() {
        let from = screen.extend(0.0);
        return from + DVec3::Z * normal.dot(point - from) / normal.z;
    }
    screen.extend(1.0) * normal.dot(point) / normal.dot(screen.extend(1.0))
}

/// An image of the whole sky in which every texel is its direction, from [-1, 1] to [0, 1]: its edges are +x, its middle -x,
/// and as one looks there from inside, +y is at the right.
fn sky() -> Pyramid {
    let size = [256, 128];
    let mut texels = Vec::new();
    for y in 0..size[1] {
        for x in 0..size[0] {
            let longitude = std::f64::consts::TAU * (f64::from(x) + 0.5) / f64::from(size[0]);
            let polar = std::f64::consts::PI * (f64::from(y) + 0.5) / f64::from(size[1]);
            let direction = DVec3::new(
                libm::sin(polar) * libm::cos(longitude),
                -libm::sin(polar) * libm::sin(longitude),
                libm::cos(polar),
            );
            texels.extend((0.5 * direction + 0.5).as_vec3().to_array());
        }
    }
    Pyramid::new(size, 3, Texels::F32(texels), [Wrap::Repeat, Wrap::Clamp]).unwrap()
}

fn surroundings(optics: Optics) -> Material {
    let environment = Environment::new(Arc::new(sky()), Sampler::default(), DMat3::IDENTITY, optics);
    Material { environment: Some(Arc::new(environment)), ..Material::default() }
}

/// The colours of the pixels well within the picture, with where they look.
fn inner(cloud: &Cloud, camera: &Camera, options: &RenderOptions) -> Vec<(DVec2, [f64; 3])> {
    let film = picture(cloud, camera, options);
    let inside = |x: i32, y: i32| (16..48).contains(&x) && (16..48).contains(&y);
    let inner: Vec<_> = pixels(&film)
        .filter(|&(x, y)| inside(x, y))
        .map(|(x, y)| {
            let [r, g, b, alpha] = film.rgba[film.index(x, y)];
            assert_eq!(alpha, 1.0, "a hole at {x}, {y}");
            (center_of(x, y), [r, g, b].map(f64::from))
        })
        .collect();
    assert_eq!(inner.len(), 32 * 32);
    inner
}

// ---------------------------------------------------------------------------------------------------------
// Closed forms

#[test]
fn a_linear_texture_is_seen_where_it_is() {
    let slope = DVec3::new(0.3, -0.2, 0.1);
    for camera in [pinhole(64, 64, 100.0), orthographic(64, 64, 25.0)] {
        for tilt in [0.0, 40.0, 62.0] {
            // Some 4 pixels a sigma.
            let cloud = plane(DVec3::new(0.0, 0.0, 4.0), tilt, 0.16, 1.0);
            let material = textured(linear(slope, IN_SPACE));
            for (pixel, [red, green, blue]) in inner(&cloud, &camera, &options(material)) {
                let at = hit(&cloud, &camera, pixel);
                let expected = slope.dot(at);
                let per_pixel = (hit(&cloud, &camera, pixel + DVec2::ONE) - at).length() * slope.length();
                let error = (red - expected).abs();
                assert!(error <= tol::TEXTURE_PLACE * per_pixel, "{tilt}: {red} for {expected} at {pixel}");
                assert!((green - 2.0 * red).abs() < 1e-5 && (blue - 4.0 * red).abs() < 1e-5);
            }
        }
    }
}

#[test]
fn own_coordinates_lie_as_the_splats_do() {
    // The same function of (s, t) and of the place in space that has them.
    let camera = pinhole(64, 64, 100.0);
    for tilt in [0.0, 60.0] {
        let center = DVec3::new(0.0, 0.0, 4.0);
        let cloud = plane(center, tilt, 0.16, 2.0);
        let [t1, t2] = tilted_axes(center, tilt, 0.4, 0.3, [1.0; 2]);
        let placement = Placement::Plane(Mapping::OWN);
        let own = inner(&cloud, &camera, &options(textured(linear(DVec3::new(3.0, -2.0, 0.0), placement))));
        for (pixel, [red, ..]) in own {
            let at = hit(&cloud, &camera, pixel);
            let of = |at: DVec3| 3.0 * (at - center).dot(t1) / 2.0 - 2.0 * (at - center).dot(t2) / 2.0;
            let per_pixel = (hit(&cloud, &camera, pixel + DVec2::ONE) - at).length() * 2.0;
            let error = (red - of(at)).abs();
            assert!(error <= tol::TEXTURE_PLACE * per_pixel, "{tilt}: {red} for {} at {pixel}", of(at));
        }
    }
}

#[test]
fn an_image_stands_upright_and_is_blurred_as_the_pixels_are_wide() {
    // 64 x 64 texels: red grows to the right, green upwards.
    let texels: Vec<f32> = (0..64 * 64)
        .flat_map(|i| [(i % 64) as f32 / 64.0, 1.0 - (i / 64) as f32 / 64.0, ((i % 64 + i / 64) % 2) as f32])
        .collect();
    let pyramid = Pyramid::new([64, 64], 3, Texels::F32(texels), [Wrap::Clamp; 2]).unwrap();
    let image =
        ImageTexture { pyramid: Arc::new(pyramid), sampler: Sampler::default(), mapping: Mapping::OWN };
    // The picture shows the middle 38 % of the image; each pixel is as wide as .38 texels, or 7.7.
    let near = plane(DVec3::new(0.0, 0.0, 4.0), 0.0, 0.16, 6.8);
    let camera = pinhole(64, 64, 100.0);
    let [t1, t2] = tilted_axes(DVec3::new(0.0, 0.0, 4.0), 0.0, 0.4, 0.3, [1.0; 2]);
    let mut cloud = near;
    for coordinates in cloud.texture_coordinates.iter_mut().flatten() {
        coordinates.center += Vec2::splat(0.5);
    }
    for (pixel, [red, green, _]) in inner(&cloud, &camera, &options(textured(Texture::Image(image.clone()))))
    {
        let at = hit(&cloud, &camera, pixel) - DVec3::new(0.0, 0.0, 4.0);
        let [s, t] = [0.5 + at.dot(t1) / 6.8, 0.5 + at.dot(t2) / 6.8];
        // Texel i, of value i / 64, has its centre at (i + 1/2) / 64; and so upwards.
        let (expected_red, expected_green) = (s - 0.5 / 64.0, t + 0.5 / 64.0);
        assert!((red - expected_red).abs() < 0.01, "{red} for {expected_red} at {pixel}");
        assert!((green - expected_green).abs() < 0.01, "{green} for {expected_green} at {pixel}");
    }
    // From far away the checks of a texel are grey.
    for coordinates in cloud.texture_coordinates.iter_mut().flatten() {
        coordinates.per_u *= 20.0;
        coordinates.per_v *= 20.0;
        coordinates.center = 20.0 * (coordinates.center - Vec2::splat(0.5));
    }
    let repeated = ImageTexture {
        pyramid: Arc::new(Pyramid::new([64, 64], 1, Texels::F32(checks()), [Wrap::Repeat; 2]).unwrap()),
        ..image
    };
    for (pixel, color) in inner(&cloud, &camera, &options(textured(Texture::Image(repeated)))) {
        assert!(color.iter().all(|value| (value - 0.5).abs() < 0.01), "{color:?} at {pixel}");
    }
}

/// 64 x 64 texels, black and white by turns.
fn checks() -> Vec<f32> {
    (0..64 * 64).map(|i| ((i % 64 + i / 64) % 2) as f32).collect()
}

#[test]
fn a_mirror_shows_where_its_rays_go() {
    let camera = pinhole(64, 64, 100.0);
    for tilt in [0.0, 35.0, 65.0] {
        let cloud = plane(DVec3::new(0.0, 0.0, 4.0), tilt, 0.16, 1.0);
        let normal = cloud.normals[0].as_dvec3();
        for (pixel, color) in inner(&cloud, &camera, &options(surroundings(Optics::Reflect))) {
            let screen = (pixel - camera.principal_point) / camera.pixel_scale();
            let ray = screen.extend(1.0).normalize();
            let seen = ray - 2.0 * normal.dot(ray) * normal;
            let error = (2.0 * DVec3::from(color) - 1.0 - seen).length();
            assert!(error <= tol::SKY_TEXEL, "{tilt}: {color:?} for {seen} at {pixel}");
        }
    }
}

#[test]
fn glass_bends_rays_by_snell_s_law_and_mirrors_what_cannot_leave() {
    let camera = pinhole(64, 64, 100.0);
    let mut cloud = plane(DVec3::new(0.0, 0.0, 4.0), 50.0, 0.16, 1.0);
    let facing = cloud.normals[0].as_dvec3() * -cloud.normals[0].as_dvec3().z.signum();
    let mut totals = 0;
    for (oriented, back) in [(false, false), (true, false), (true, true)] {
        cloud.oriented = oriented;
        let outwards = if back { -facing } else { facing };
        cloud.normals.iter_mut().for_each(|normal| *normal = outwards.as_vec3());
        for (pixel, color) in inner(&cloud, &camera, &options(surroundings(Optics::Refract(1.5)))) {
            let screen = (pixel - camera.principal_point) / camera.pixel_scale();
            let ray = screen.extend(1.0).normalize();
            let ratio = if back { 1.5 } else { 1.0 / 1.5 };
            let across = ratio * (ray - facing.dot(ray) * facing);
            let squared = 1.0 - across.length_squared();
            let seen = if squared > 0.0 {
                across - squared.sqrt() * facing
            } else {
                totals += 1;
                ray - 2.0 * facing.dot(ray) * facing
            };
            // Near the critical angle the footprint is wide.
            if squared.abs() > 0.05 {
                let error = (2.0 * DVec3::from(color) - 1.0 - seen).length();
                assert!(error <= tol::SKY_TEXEL, "back {back}: {color:?} for {seen} at {pixel}");
            }
        }
    }
    assert!(totals > 500, "{totals} pixels of total reflection");
}

#[test]
fn light_follows_lambert_s_law_on_the_side_that_is_seen() {
    let camera = orthographic(64, 64, 25.0);
    for tilt in [0.0, 30.0, 60.0] {
        let mut cloud = plane(DVec3::new(0.0, 0.0, 4.0), tilt, 0.16, 1.0);
        let facing = cloud.normals[0].as_dvec3() * -cloud.normals[0].as_dvec3().z.signum();
        for (oriented, sign) in [(false, 1.0), (true, 1.0), (true, -1.0)] {
            cloud.oriented = oriented;
            cloud.normals.iter_mut().for_each(|normal| *normal = (sign * facing).as_vec3());
            for to_light in [DVec3::new(0.3, -0.5, -2.0), DVec3::new(3.0, 1.0, 0.2)] {
                let lambert = RenderOptions {
                    shading: Shading::Lambert { to_light },
                    ..options(textured(Texture::Constant([0.5, 0.25, 1.0])))
                };
                let light = 0.15 + 0.85 * facing.dot(to_light.normalize()).max(0.0);
                for (pixel, [red, green, blue]) in inner(&cloud, &camera, &lambert) {
                    let error = (blue - light).abs();
                    assert!(error < 1e-5, "{tilt}: {blue} for {light} at {pixel}");
                    assert!((red - 0.5 * blue).abs() < 1e-5 && (green - 0.25 * blue).abs() < 1e-5);
                }
            }
        }
    }
}

#[test]
fn a_closure_has_the_last_word() {
    let camera = pinhole(64, 64, 100.0);
    let cloud = plane(DVec3::new(0.0, 0.0, 4.0), 30.0, 0.16, 1.0);
    let shader = |at: &ShadedPoint, [red, _, _]: [f32; 3]| {
        // What it is told is what it would find: a normal on the viewer's side, a ray to the point.
        assert!(at.normal.dot(at.ray.ray.direction) < 0.0 && !at.back && at.index < 61 * 61);
        [red, at.surface.space.point.x as f32, at.ray.ray.direction.z as f32]
    };
    let material = Material { shader: Some(Arc::new(shader)), ..textured(Texture::Constant([0.7; 3])) };
    for (pixel, [red, x, z]) in inner(&cloud, &camera, &options(material)) {
        let at = hit(&cloud, &camera, pixel);
        let per_pixel = (hit(&cloud, &camera, pixel + DVec2::ONE) - at).length();
        assert!((red - 0.7).abs() < 1e-5);
        assert!((x - at.x).abs() <= tol::TEXTURE_PLACE * per_pixel, "{x} for {} at {pixel}", at.x);
        assert!((z - at.normalize().z).abs() < 1e-5, "{z} for {} at {pixel}", at.normalize().z);
    }
}

#[test]
fn textures_are_made_of_textures() {
    let camera = pinhole(64, 64, 100.0);
    let cloud = plane(DVec3::new(0.0, 0.0, 4.0), 0.0, 0.16, 1.0);
    let constant = |color| Arc::new(Texture::Constant(color));
    let (a, b) = (constant([0.5, 1.0, 2.0]), constant([1.0, 0.5, 0.25]));
    let cases = [
        (Texture::Scale(a.clone(), b.clone()), [0.5, 0.5, 0.5]),
        (Texture::Mix(a.clone(), b.clone(), constant([0.0, 0.5, 1.0])), [0.5, 0.75, 0.25]),
        (Texture::Mix(a, b, constant([1.0; 3])), [1.0, 0.5, 0.25]),
    ];
    for (texture, expected) in cases {
        for (pixel, color) in inner(&cloud, &camera, &options(textured(texture.clone()))) {
            let near = color.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5);
            assert!(near, "{color:?} for {expected:?} at {pixel}");
        }
    }
}

#[test]
fn a_lookup_stays_on_its_splat() {
    // Each splat alone has a colour of its own, as in an atlas: what lies beyond it on the texture must not show, in focus
    // or out of it, large or small. Texture coordinates jump by 10 from one to the next.
    let stripes = |at: &ShadedPoint, _: [f32; 3]| {
        let own = at.surface.own;
        let s = own.st.x - 10.0 * (own.st.x / 10.0).round();
        let reach = own.derivatives.semi_axes().half_box().x + s.abs();
        [reach as f32; 3]
    };
    for (size, radius) in [(0.16, 0.0), (0.16, 0.3), (0.004, 0.0), (0.004, 0.3)] {
        let mut cloud = plane(DVec3::new(0.0, 0.0, 4.0), 50.0, size, size);
        for (i, coordinates) in cloud.texture_coordinates.iter_mut().flatten().enumerate() {
            coordinates.center = Vec2::new(10.0 * (i % 7) as f32, 0.0);
        }
        let lens = Lens { radius, focus: 2.0, blades: 0 };
        let camera = pinhole(64, 64, 100.0);
        let camera = if radius > 0.0 { with_lens(camera, lens) } else { camera };
        let material = Material { shader: Some(Arc::new(stripes)), ..Material::default() };
        let film = picture(&cloud, &camera, &options(material));
        let greatest = film.rgba.iter().map(|pixel| pixel[0]).fold(0.0, f32::max);
        // Mean within the disc of 2 sigma, and a footprint whose Gaussian is no wider than the splat's.
        assert!(greatest > 0.1 && f64::from(greatest) <= tol::LOOKUP_REACH, "{size} {radius}: {greatest}");
    }
}

// ---------------------------------------------------------------------------------------------------------
// Both engines

/// Checks that two pictures have the same bits, but for colours, which filters of images have rounded otherwise.
fn assert_same_but_for_lookups(name: &str, reference: &Film, fast: &Film) {
    let without_colors = |film: &Film| {
        let mut film = film.clone();
        film.rgba.iter_mut().for_each(|pixel| pixel[..3].fill(0.0));
        film.albedo = None;
        film
    };
    assert_same_bits(name, &without_colors(reference), &without_colors(fast));
    let colors = |film: &Film| -> Vec<f32> {
        let albedo = film.albedo.iter().flatten().flat_map(|color| color.to_array());
        film.rgba.iter().flatten().copied().chain(albedo).collect()
    };
    let (reference, fast) = (colors(reference), colors(fast));
    let greatest = reference.iter().zip(&fast).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(f64::from(greatest) <= tol::ENGINES_COLORS, "{name}: {greatest}");
}

#[test]
fn both_engines_agree() {
    let checks = Pyramid::new([64, 64], 1, Texels::F32(checks()), [Wrap::Repeat; 2]).unwrap();
    let image = Texture::Image(ImageTexture {
        pyramid: Arc::new(checks),
        sampler: Sampler::default(),
        mapping: Mapping::OWN,
    });
    let environment = surroundings(Optics::Refract(1.3)).environment;
    let materials = [
        textured(image.clone()),
        Material { detail: Detail::Splat, ..textured(image.clone()) },
        Material { environment, ..textured(image) },
    ];
    let lens = Lens { radius: 0.2, focus: 3.0, blades: 5 };
    let cameras =
        [pinhole(64, 64, 100.0), with_lens(pinhole(64, 64, 100.0), lens), orthographic(64, 64, 25.0)];
    let cloud = plane(DVec3::new(0.0, 0.0, 4.0), 60.0, 0.16, 0.5);
    let surface = RenderOptions::default().resolve;
    let albedo = AovSelection { albedo: true, ..Default::default() };
    let modes = [
        (surface, AovSelection::default(), 8),
        (surface, albedo, 5),
        (Resolve::Over, AovSelection::default(), 12),
    ];
    for (i, material) in materials.into_iter().enumerate() {
        for camera in &cameras {
            for &(resolve, aovs, samples) in if i == 0 { &modes[..] } else { &modes[..1] } {
                let options = RenderOptions { samples, resolve, aovs, ..options(material.clone()) };
                let reference = render(&cloud, camera, &options, &mut |_| {}).unwrap();
                let mut first_fast = None;
                for level in Level::available() {
                    for (threads, tile_memory) in [(1, 40_000), (3, 64 << 20)] {
                        let mut renderer = Renderer::new(threads, level).unwrap();
                        let options = RenderOptions { tile_memory, ..options.clone() };
                        let fast = renderer.render(&cloud, camera, &options, &mut |_| {}).unwrap();
                        if options.material.of(0).detail == Detail::Splat {
                            assert_same_bits(level.name(), &reference.film, &fast.film);
                        } else {
                            assert_same_but_for_lookups(level.name(), &reference.film, &fast.film);
                            let first = first_fast.get_or_insert_with(|| fast.film.clone());
                            assert_same_bits(level.name(), first, &fast.film);
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn albedo_is_the_texture_without_light() {
    let camera = pinhole(64, 64, 100.0);
    let cloud = plane(DVec3::new(0.0, 0.0, 4.0), 40.0, 0.16, 1.0);
    for detail in [Detail::Fragment, Detail::Splat] {
        let material = Material { detail, ..textured(Texture::Constant([0.5, 0.25, 1.0])) };
        let aovs = AovSelection { albedo: true, ..Default::default() };
        let options = RenderOptions { aovs, shading: Shading::Headlight, ..options(material) };
        let film = picture(&cloud, &camera, &options);
        let center = film.index(32, 32);
        let albedo = film.albedo.as_ref().unwrap()[center];
        assert!((albedo[0] - 0.5).abs() < 1e-5 && (albedo[1] - 0.25).abs() < 1e-5, "{albedo:?}");
        assert!(film.rgba[center][0] < 0.45, "{:?}", film.rgba[center]);
    }
}

#[test]
fn a_frame_of_axes_is_no_mirror() {
    // What `sky` says of directions, checked against a rotation that swaps them.
    let camera = pinhole(64, 64, 100.0);
    let cloud = plane(DVec3::new(0.0, 0.0, 4.0), 20.0, 0.16, 1.0);
    let turn = DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X);
    let environment = Environment::new(Arc::new(sky()), Sampler::default(), turn, Optics::Reflect);
    let material = Material { environment: Some(Arc::new(environment)), ..Material::default() };
    let normal = cloud.normals[0].as_dvec3();
    for (pixel, color) in inner(&cloud, &camera, &options(material)) {
        let screen = (pixel - camera.principal_point) / camera.pixel_scale();
        let ray = screen.extend(1.0).normalize();
        let seen = turn * (ray - 2.0 * normal.dot(ray) * normal);
        let error = (2.0 * DVec3::from(color) - 1.0 - seen).length();
        assert!(error <= tol::SKY_TEXEL, "{color:?} for {seen} at {pixel}");
    }
}

#[test]
fn each_run_of_splats_has_its_own_material() {
    let camera = pinhole(64, 64, 100.0);
    let (center, size) = (DVec3::new(0.0, 0.0, 4.0), 0.16);
    let cloud = plane(center, 30.0, size, 0.5);
    let [_, t2] = tilted_axes(center, 30.0, 0.4, 0.3, [size; 2]);
    let varying = textured(linear(DVec3::new(0.3, 0.2, 0.0), IN_SPACE));
    let mirror = surroundings(Optics::Reflect);
    for [a, b] in [[varying.clone(), mirror.clone()], [Material::PLAIN, varying], [mirror, Material::PLAIN]] {
        // The rows of splats up to the one through the centre are of one material, all others of the other.
        let rows = Materials::of_runs([(31 * 61, a.clone()), (30 * 61, b.clone())]);
        let together = RenderOptions { material: rows, ..options(Material::PLAIN) };
        let whole = picture(&cloud, &camera, &together);
        let alone = [picture(&cloud, &camera, &options(a)), picture(&cloud, &camera, &options(b))];
        let mut compared = [0, 0];
        for (x, y) in pixels(&whole) {
            let pixel = DVec2::new(f64::from(x), f64::from(y)) + 0.5;
            let v = (hit(&cloud, &camera, pixel) - center).dot(t2) / t2.length_squared();
            // A splat reaches two sigma, a pixel and its filter as far again.
            if (v - 0.5).abs() > 4.0 {
                let side = usize::from(v > 0.5);
                let index = whole.index(x, y);
                assert_eq!(whole.rgba[index], alone[side].rgba[index], "pixel {x}, {y}");
                compared[side] += 1;
            }
        }
        assert!(compared.iter().all(|&count| count > 500), "{compared:?}");
        for level in Level::available() {
            let fast = Renderer::new(1, level).unwrap().render(&cloud, &camera, &together, &mut |_| {});
            assert_same_but_for_lookups(level.name(), &whole, &fast.unwrap().film);
        }
    }
}
