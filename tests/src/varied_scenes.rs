//! Scenes that differ in all that the renderer tells apart, a small picture each: for tests that a picture depends on its
//! scene alone. They are made without the platform's mathematics, so they are the same on every machine.

use glam::{DQuat, DVec2, DVec3, Vec2, Vec3};
use splat_abuffer::{Coverage, Resolve, Thickness};
use splat_core::shade::{Detail, Environment, Material, Materials, Optics, ShadedPoint};
use splat_core::texture::{
    FunctionTexture, ImageTexture, Mapping, Placement, Sampler, SolidMapping, SpacePoint, Texture,
    TextureFunction, Wrap,
};
use splat_core::{
    AovSelection, Camera, Cloud, Distortion, Kernel, Lens, PatternKind, PixelFilter, RenderOptions, Shading,
    Shapes, SphericalHarmonics, TableMode, TextureCoordinates,
};
use std::sync::Arc;

use crate::core_scenes::tilted_axes;
use crate::hard_scenes::{Knowledge, adversarial, moved};
use crate::random::Random;
use crate::scenes::{OPAQUE, Scene, jumble, orthographic, pinhole, soft, sphere, with_lens};
use crate::texture_truth::Image;

/// A scene, and what a test of it must know.
#[derive(Debug, Clone, PartialEq)]
pub struct Varied {
    /// The scene.
    pub scene: Scene,
    /// Numbers of splats of the runs whose order among each other matters: materials go by place in the cloud.
    pub runs: Vec<usize>,
    /// Whether images are looked up pixel by pixel, for colours or for the albedo, which each core rounds in its way.
    pub looks_up: bool,
}

/// Width and height of the pictures, in pixels: 3 x 2 tiles, of which the last ones are cut.
pub const SIZE: [u32; 2] = [70, 50];

/// The AOVs that eight samples at once can give.
const FEW: AovSelection = AovSelection {
    depth: false,
    normal: false,
    albedo: false,
    position: false,
    id: false,
    coverage: true,
    layers: false,
    samples: true,
    variance: true,
};

/// All of them.
pub fn all() -> Vec<Varied> {
    let one_run = |scene: Scene| (vec![scene.cloud.len()], scene);
    let scenes = [
        closed_surface(),
        small_blur(),
        large_blur(),
        parallel_rays(),
        distorted(),
        trained(),
        glass(),
        textured("textured", Detail::Fragment),
        textured("textured_by_splat", Detail::Splat),
        mirror(),
        closure_through_a_lens(),
        inside(),
        far_away(),
        needles(),
        hard(),
        listing(),
    ];
    let varied = |(runs, scene): (Vec<usize>, Scene)| {
        let RenderOptions { material, aovs, .. } = &scene.options;
        let by_pixel = material.varies_by_pixel() || aovs.albedo;
        Varied { looks_up: by_pixel && !material.images().is_empty(), runs, scene }
    };
    scenes.into_iter().map(one_run).chain([joined()]).map(varied).collect()
}

fn camera() -> Camera {
    pinhole(SIZE[0], SIZE[1], 60.0)
}

fn options() -> RenderOptions {
    RenderOptions { samples: 8, aovs: FEW, ..RenderOptions::default() }
}

/// A turn that no axis keeps.
fn turn() -> DQuat {
    DQuat::from_xyzw(0.1, -0.2, 0.3, 0.9).normalize()
}

fn random_colors(count: usize, seed: u64) -> Option<Vec<Vec3>> {
    let mut random = Random::new(seed);
    Some((0..count).map(|_| Vec3::from_array([0; 3].map(|_| random.unit() as f32))).collect())
}

/// A sphere, without colours, lit from the eye.
fn closed_surface() -> Scene {
    let options = RenderOptions { shading: Shading::Headlight, ..options() };
    let cloud = sphere(DVec3::new(0.05, -0.1, 4.0), 1.3, 400, &options);
    Scene { name: "closed_surface", cloud, camera: camera(), options }
}

/// A lens whose blur is some pixels wide; opaque splats.
fn small_blur() -> Scene {
    let cloud = Cloud { opacities: None, ..jumble(120, 0.06, 21) };
    let camera = with_lens(camera(), Lens { radius: 0.05, focus: 3.5, blades: 0 });
    Scene { name: "small_blur", cloud, camera, options: options() }
}

/// A lens whose blur is most of the picture, and splats of a pixel: drawn by lens points.
fn large_blur() -> Scene {
    let camera = with_lens(camera(), Lens { radius: 0.3, focus: 0.6, blades: 5 });
    let options = RenderOptions { samples: 16, resolve: soft(1.0), ..options() };
    Scene { name: "large_blur", cloud: jumble(500, 0.012, 22), camera, options }
}

/// Orthographic, seen from aside, its back sides culled.
fn parallel_rays() -> Scene {
    let camera = moved(orthographic(SIZE[0], SIZE[1], 9.0), turn(), turn().inverse() * DVec3::NEG_Z);
    let options = RenderOptions { samples: 11, cull: true, filter: PixelFilter::Gaussian, ..options() };
    Scene { name: "parallel_rays", cloud: jumble(500, 0.06, 23), camera, options }
}

/// Through a lens that bends the picture, and leaves its corners empty.
fn distorted() -> Scene {
    let distortion = Some(Distortion { radial: [-0.35, 0.1, 0.0], tangential: [0.01, -0.02] });
    let camera = Camera { distortion, ..camera() };
    let options = RenderOptions { samples: 5, pattern: PatternKind::Sobol, ..options() };
    Scene { name: "distorted", cloud: jumble(150, 0.08, 24), camera, options }
}

/// Trained splats: blended one by one, in colours by the direction of view.
fn trained() -> Scene {
    let mut random = Random::new(25);
    let mut cloud = jumble(150, 0.05, 25);
    cloud.make_elliptical();
    let Shapes::Ellipses(axes) = &mut cloud.shapes else { unreachable!("made so") };
    axes.iter_mut().for_each(|[_, second]| *second *= random.range(0.2, 1.0) as f32);
    let mut number = || random.range(-0.4, 0.4) as f32;
    let terms = (0..16 * cloud.len()).map(|_| Vec3::new(number(), number(), number())).collect();
    cloud.harmonics = Some(SphericalHarmonics::new(3, terms).expect("16 terms each"));
    (cloud.oriented, cloud.trained) = (false, true);
    let background = Some([0.05, 0.1, 0.3, 1.0]);
    let options = RenderOptions { aovs: FEW, background, samples: 9, ..RenderOptions::suited_to(&cloud) };
    Scene { name: "trained", cloud, camera: camera(), options }
}

/// A glass sphere before a half transparent background, lit from aside; soft coverage.
fn glass() -> Scene {
    let shading = Shading::Lambert { to_light: DVec3::new(1.0, -2.0, -1.0) };
    let background = Some([0.2, 0.5, 0.8, 0.5]);
    let options = RenderOptions { resolve: soft(0.8), shading, background, ..options() };
    let mut cloud = sphere(DVec3::new(0.0, 0.1, 4.0), 1.2, 300, &options);
    cloud.colors = random_colors(cloud.len(), 26);
    cloud.opacities = Some(vec![0.4; cloud.len()]);
    Scene { name: "glass", cloud, camera: camera(), options }
}

/// A tilted plane of 21 x 21 splats with texture coordinates.
fn sheet() -> Cloud {
    let (center, sigma) = (DVec3::new(0.0, 0.0, 4.0), 0.2);
    let [t1, t2] = tilted_axes(center, 50.0, 0.4, 0.3, [sigma; 2]);
    let places = (-10..=10).flat_map(|v| (-10..=10).map(move |u| DVec2::new(f64::from(u), f64::from(v))));
    let places: Vec<DVec2> = places.collect();
    let points: Vec<DVec3> = places.iter().map(|uv| center + uv.x * t1 + uv.y * t2).collect();
    let step = 0.125;
    let on_texture = |uv: &DVec2| TextureCoordinates {
        center: step * uv.as_vec2(),
        per_u: step * Vec2::X,
        per_v: step * Vec2::Y,
    };
    let count = places.len();
    Cloud {
        normals: vec![t1.cross(t2).normalize().as_vec3(); count],
        shapes: Shapes::Ellipses(vec![[t1.as_vec3(), t2.as_vec3()]; count]),
        areas: Some(vec![(sigma * sigma) as f32; count]),
        texture_coordinates: Some(places.iter().map(on_texture).collect()),
        ..Cloud::from_points(&points)
    }
}

fn image(detail: Detail) -> Material {
    let pyramid = Arc::new(Image::noise([64, 64], 3, 27).pyramid(Wrap::Mirror));
    let image = ImageTexture { pyramid, sampler: Sampler::default(), mapping: Mapping::OWN };
    Material { texture: Some(Arc::new(Texture::Image(image))), detail, ..Material::default() }
}

/// An image on a plane.
fn textured(name: &'static str, detail: Detail) -> Scene {
    let options = RenderOptions { material: image(detail).into(), ..options() };
    Scene { name, cloud: sheet(), camera: camera(), options }
}

/// A sphere in which its surroundings are seen.
fn mirror() -> Scene {
    let sky = Arc::new(Image::noise([32, 16], 3, 28).pyramid(Wrap::Repeat));
    let to_image = glam::DMat3::from_quat(turn());
    let environment = Environment::new(sky, Sampler::default(), to_image, Optics::Reflect);
    let material = Material { environment: Some(Arc::new(environment)), ..Material::default() };
    let options = RenderOptions { material: material.into(), ..options() };
    let cloud = sphere(DVec3::new(0.05, 0.0, 4.0), 1.2, 300, &options);
    Scene { name: "mirror", cloud, camera: camera(), options }
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

fn function() -> Material {
    let placement = Placement::Solid(SolidMapping { world_to_texture: glam::DAffine3::IDENTITY });
    let colors = [[0.1, 0.2, 0.3], [0.9, 0.4, 0.5]];
    let function = Arc::new(Linear(DVec3::new(0.3, -0.2, 0.2)));
    let texture = Texture::Function(FunctionTexture { function, placement, colors });
    Material { texture: Some(Arc::new(texture)), ..Material::default() }
}

/// A function of space by pixel, a caller's closure after it, out of focus.
fn closure_through_a_lens() -> Scene {
    let closure = |at: &ShadedPoint, [red, green, blue]: [f32; 3]| {
        let stripe = libm::floor(8.0 * at.surface.space.point.x) % 2.0;
        [red + 0.1 * at.normal.x as f32, green, blue * stripe as f32]
    };
    let material = Material { shader: Some(Arc::new(closure)), ..function() };
    let options = RenderOptions { material: material.into(), samples: 12, ..options() };
    let camera = with_lens(camera(), Lens { radius: 0.2, focus: 2.0, blades: 0 });
    Scene { name: "closure_through_a_lens", cloud: sheet(), camera, options }
}

/// Within a closed surface whose splats let light through; every AOV.
fn inside() -> Scene {
    let options = RenderOptions { samples: 4, resolve: soft(1.0), aovs: AovSelection::ALL, ..options() };
    let mut cloud = sphere(DVec3::new(0.1, 0.0, 0.3), 2.0, 300, &options);
    let mut random = Random::new(29);
    cloud.opacities = Some((0..cloud.len()).map(|_| random.unit() as f32).collect());
    cloud.colors = random_colors(cloud.len(), 30);
    Scene { name: "inside", cloud, camera: camera(), options }
}

/// Map coordinates: millions of units from zero; every AOV, culled.
fn far_away() -> Scene {
    let place = DVec3::new(500_000.25, 5_000_000.5, 100.125);
    let options = RenderOptions { samples: 5, aovs: AovSelection::ALL, cull: true, ..options() };
    let mut cloud = sphere(place + DVec3::new(0.1, 0.0, 4.0), 1.2, 300, &options);
    cloud.colors = random_colors(cloud.len(), 31);
    Scene { name: "far_away", cloud, camera: moved(camera(), DQuat::IDENTITY, place), options }
}

/// Splats a thousand times as long as wide.
fn needles() -> Scene {
    let mut cloud = jumble(600, 0.15, 32);
    cloud.make_elliptical();
    let Shapes::Ellipses(axes) = &mut cloud.shapes else { unreachable!("made so") };
    axes.iter_mut().for_each(|[_, second]| *second *= 1e-3);
    cloud.opacities = None;
    let options = RenderOptions { samples: 16, resolve: soft(0.5), ..options() };
    Scene { name: "needles", cloud, camera: camera(), options }
}

/// Every kind of splat that is hard to draw, through a lens, between near planes.
fn hard() -> Scene {
    let lens = Lens { radius: 0.1, focus: 3.0, blades: 6 };
    let camera = Camera { near: 0.3, far: 9.0, ..with_lens(camera(), lens) };
    let known = Knowledge { orientation: true, opacities: true, areas: true, ellipses: true };
    let (cloud, _) = adversarial(140, 33, &camera, known);
    let options = RenderOptions { samples: 7, kernel: Kernel::Gaussian, cutoff: 9.0, ..options() };
    Scene { name: "hard", cloud, camera, options }
}

/// What the listing of 2002 has: its intervals, table, kernel and patterns.
fn listing() -> Scene {
    let options = RenderOptions {
        samples: 5,
        resolve: Resolve::Surface { coverage: Coverage::Opaque, thickness: Thickness::WholeSplat },
        kernel: Kernel::Gaussian,
        cutoff: 2.0,
        table: TableMode::Floor256,
        pattern: PatternKind::PoissonDisc,
        filter: PixelFilter::Tent,
        ..options()
    };
    Scene { name: "listing", cloud: jumble(150, 0.07, 34), camera: camera(), options }
}

/// Three clouds as one, and the number of splats of each: plain, of a function by pixel, and with an image by splat; every
/// AOV.
fn joined() -> (Vec<usize>, Scene) {
    let options = RenderOptions { samples: 3, resolve: OPAQUE, aovs: AovSelection::ALL, ..options() };
    let plain = Cloud { opacities: None, ..jumble(80, 0.06, 35) };
    let shaped = sphere(DVec3::new(-0.8, 0.0, 4.0), 0.8, 150, &options);
    let clouds = vec![plain, shaped, sheet()];
    let runs: Vec<usize> = clouds.iter().map(Cloud::len).collect();
    let of_each = [Material::default(), function(), image(Detail::Splat)];
    let material = Materials::of_runs(runs.iter().copied().zip(of_each));
    let cloud = Cloud::join(clouds).expect("all have normals and sizes");
    let options = RenderOptions { material, ..options };
    (runs, Scene { name: "joined", cloud, camera: camera(), options })
}
