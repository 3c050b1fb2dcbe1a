//! Small scenes made in code, shared by the tests: parts to build them from, and the list of [`golden`] ones.

use glam::{DMat4, DQuat, DVec2, DVec3, Vec3};
use splat_abuffer::{Coverage, Resolve, Thickness};
use splat_core::prepare::{PrepareOptions, prepare};
use splat_core::{Camera, Cloud, Kernel, Lens, PixelFilter, Projection, RenderOptions, Shapes};

use crate::random::Random;

/// One splat, as a test describes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surfel {
    /// World position.
    pub position: DVec3,
    /// World normal, any length.
    pub normal: DVec3,
    /// Sigma, in scene units.
    pub size: f64,
    /// Linear colour.
    pub color: [f32; 3],
    /// Opacity.
    pub opacity: f32,
}

impl Surfel {
    /// A white, opaque, round splat.
    pub fn new(position: DVec3, normal: DVec3, size: f64) -> Self {
        Self { position, normal, size, color: [1.0; 3], opacity: 1.0 }
    }

    /// The same in another colour.
    pub fn colored(self, color: [f32; 3]) -> Self {
        Self { color, ..self }
    }

    /// The same with another opacity.
    pub fn with_opacity(self, opacity: f32) -> Self {
        Self { opacity, ..self }
    }
}

/// The cloud of these splats, oriented, without areas (so that weights are the kernel's values).
pub fn cloud(surfels: &[Surfel]) -> Cloud {
    let positions: Vec<DVec3> = surfels.iter().map(|surfel| surfel.position).collect();
    Cloud {
        normals: surfels.iter().map(|surfel| surfel.normal.normalize().as_vec3()).collect(),
        shapes: Shapes::Discs(surfels.iter().map(|surfel| surfel.size as f32).collect()),
        colors: Some(surfels.iter().map(|surfel| Vec3::from(surfel.color)).collect()),
        opacities: Some(surfels.iter().map(|surfel| surfel.opacity).collect()),
        oriented: true,
        ..Cloud::from_points(&positions)
    }
}

/// The cloud with its points in another order: point i is the old point `order[i]`.
pub fn permuted(cloud: &Cloud, order: &[usize]) -> Cloud {
    cloud.only(order)
}

/// Evenly spread points of the unit sphere (a Fibonacci lattice).
pub fn fibonacci_sphere(count: usize) -> Vec<DVec3> {
    let golden_angle = std::f64::consts::PI * (3.0 - 5.0f64.sqrt());
    let point = |i: usize| {
        let z = 1.0 - (2 * i + 1) as f64 / count as f64;
        let (radius, angle) = ((1.0 - z * z).sqrt(), golden_angle * i as f64);
        DVec3::new(radius * libm::cos(angle), radius * libm::sin(angle), z)
    };
    (0..count).map(point).collect()
}

/// A closed sphere, oriented outwards, its sizes and areas estimated by `prepare` for these options.
pub fn sphere(center: DVec3, radius: f64, count: usize, options: &RenderOptions) -> Cloud {
    let directions = fibonacci_sphere(count);
    let points: Vec<DVec3> = directions.iter().map(|&direction| center + radius * direction).collect();
    let mut cloud = Cloud {
        normals: directions.iter().map(|direction| direction.as_vec3()).collect(),
        oriented: true,
        ..Cloud::from_points(&points)
    };
    let options =
        PrepareOptions { kernel: options.kernel, cutoff: options.cutoff, ..PrepareOptions::default() };
    prepare(&mut cloud, &options, &mut |_| {});
    cloud
}

/// A pinhole at the world's origin that looks along +z, the world's axes being the camera's, with a focal
/// length of `focal` pixels on both axes and its principal point in the middle.
pub fn pinhole(width: u32, height: u32, focal: f64) -> Camera {
    Camera {
        width,
        height,
        projection: Projection::Perspective { focal_length: DVec2::splat(focal), lens: None },
        principal_point: DVec2::new(f64::from(width), f64::from(height)) / 2.0,
        world_to_camera: DMat4::IDENTITY,
        near: 0.01,
        far: f64::INFINITY,
        clip_planes: vec![],
        distortion: None,
    }
}

/// The camera with a lens. It must be a perspective one.
pub fn with_lens(mut camera: Camera, new: Lens) -> Camera {
    let Projection::Perspective { lens, .. } = &mut camera.projection else { panic!("no perspective") };
    *lens = Some(new);
    camera
}

/// An orthographic camera along +z, as [`pinhole`].
pub fn orthographic(width: u32, height: u32, pixels_per_unit: f64) -> Camera {
    let projection = Projection::Orthographic { pixels_per_unit };
    Camera { projection, near: 0.0, ..pinhole(width, height, 1.0) }
}

/// Hard discs of radius sigma, and the box filter: a sample is hit or not. Discs are thin, however large.
pub fn hard_discs(samples: u32) -> RenderOptions {
    RenderOptions {
        samples,
        kernel: Kernel::Disc,
        cutoff: 1.0,
        thickness: 0.01,
        filter: PixelFilter::Box,
        ..RenderOptions::default()
    }
}

/// `surface` with soft coverage and this saturation.
pub fn soft(saturation: f32) -> Resolve {
    Resolve::Surface { coverage: Coverage::Soft { saturation }, thickness: Thickness::AroundHit }
}

/// `surface` with opaque coverage.
pub const OPAQUE: Resolve = Resolve::Surface { coverage: Coverage::Opaque, thickness: Thickness::AroundHit };

/// Splats of random place, direction, colour and opacity that a [`pinhole`] with a focal length of its height
/// sees between depths 2 and 6, `size` being their sigma relative to the depth.
pub fn jumble(count: usize, size: f64, seed: u64) -> Cloud {
    let mut random = Random::new(seed);
    let surfels: Vec<Surfel> = (0..count)
        .map(|_| {
            let depth = random.range(2.0, 6.0);
            let place = DVec3::new(random.range(-0.6, 0.6), random.range(-0.45, 0.45), 1.0) * depth;
            let color = [0; 3].map(|_| random.unit() as f32);
            let opacity = if random.unit() < 0.5 { 1.0 } else { random.unit() as f32 };
            let scale = random.log_range(0.5, 2.0);
            Surfel::new(place, random.direction(), size * scale * depth).colored(color).with_opacity(opacity)
        })
        .collect();
    cloud(&surfels)
}

/// A cloud, a camera and options under a name.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// The name, fit for a file.
    pub name: &'static str,
    /// The cloud, complete.
    pub cloud: Cloud,
    /// The camera.
    pub camera: Camera,
    /// The options.
    pub options: RenderOptions,
}

/// Width and height of the golden pictures, in pixels.
pub const GOLDEN_SIZE: [u32; 2] = [64, 48];

/// The scenes whose pictures are kept: 64 x 48 pixels, few samples, every stage of the renderer in one of
/// them.
pub fn golden() -> Vec<Scene> {
    vec![discs(), lens(), tilted(), over(), transparency()]
}

fn golden_camera() -> Camera {
    pinhole(GOLDEN_SIZE[0], GOLDEN_SIZE[1], 50.0)
}

/// Overlapping coloured discs that merge, intersect and hide each other; the defaults (opaque, windowed, F =
/// 4).
fn discs() -> Scene {
    let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let surfels = [
        Surfel::new(at(-0.6, -0.2, 4.0), at(0.2, 0.1, -1.0), 0.55).colored([0.9, 0.15, 0.1]),
        Surfel::new(at(0.1, -0.3, 4.05), at(-0.1, 0.2, -1.0), 0.5).colored([0.1, 0.7, 0.2]),
        Surfel::new(at(-0.1, 0.5, 4.4), at(0.0, -0.6, -1.0), 0.6).colored([0.15, 0.25, 0.95]),
        Surfel::new(at(0.9, 0.2, 3.5), at(-0.9, 0.1, -0.5), 0.5).colored([0.95, 0.8, 0.1]),
        // From behind, and partly behind the eye's near plane.
        Surfel::new(at(1.0, 0.8, 5.0), at(0.2, 0.3, 1.0), 0.7).colored([0.6, 0.1, 0.7]),
        Surfel::new(at(0.0, 0.35, 0.3), at(0.02, -1.0, -0.05), 0.8).colored([0.4, 0.4, 0.4]),
    ];
    Scene {
        name: "discs",
        cloud: cloud(&surfels),
        camera: golden_camera(),
        options: RenderOptions { samples: 8, ..RenderOptions::default() },
    }
}

/// A thin lens with five blades, discs before, in and behind the plane of focus; the listing's patterns, the
/// Gaussian filter, and soft coverage.
fn lens() -> Scene {
    let surfels: Vec<Surfel> = (0..9)
        .map(|i| {
            let (x, y) = (f64::from(i % 3) - 1.0, f64::from(i / 3) - 1.0);
            let depth = 1.5 + 0.5 * f64::from(i);
            let position = DVec3::new(0.36 * x, 0.28 * y, 1.0) * depth;
            let color = [0.2 + 0.08 * i as f32, 0.9 - 0.07 * i as f32, 0.5];
            Surfel::new(position, DVec3::new(0.3 * x, 0.3, -1.0), 0.06 * depth).colored(color)
        })
        .collect();
    let camera = with_lens(golden_camera(), Lens { radius: 0.12, focus: 3.5, blades: 5 });
    let options = RenderOptions {
        samples: 8,
        resolve: soft(1.0),
        pattern: splat_core::PatternKind::PoissonDisc,
        filter: PixelFilter::Gaussian,
        ..RenderOptions::default()
    };
    Scene { name: "lens", cloud: cloud(&surfels), camera, options }
}

/// Tilted ellipses under an orthographic camera that is turned; the plain Gaussian with the listing's F and
/// table.
fn tilted() -> Scene {
    let mut random = Random::new(11);
    let turn = DQuat::from_rotation_z(0.3) * DQuat::from_rotation_x(0.2);
    let mut axes = Vec::new();
    let surfels: Vec<Surfel> = (0..20)
        .map(|_| {
            let place = DVec3::new(random.range(-1.4, 1.4), random.range(-1.0, 1.0), random.range(3.0, 4.0));
            let normal = random.direction();
            let along = normal.any_orthonormal_vector();
            let across = normal.cross(along);
            axes.push([(0.5 * along).as_vec3(), (0.22 * across + 0.1 * along).as_vec3()]);
            let color = [0; 3].map(|_| random.unit() as f32);
            Surfel::new(turn.inverse() * place, normal, 1.0).colored(color)
        })
        .collect();
    let cloud = Cloud { shapes: Shapes::Ellipses(axes), oriented: false, ..cloud(&surfels) };
    let mut camera = orthographic(GOLDEN_SIZE[0], GOLDEN_SIZE[1], 20.0);
    camera.world_to_camera = DMat4::from_quat(turn);
    let options = RenderOptions {
        samples: 8,
        kernel: Kernel::Gaussian,
        cutoff: 2.0,
        table: splat_core::TableMode::Floor256,
        filter: PixelFilter::Tent,
        ..RenderOptions::default()
    };
    Scene { name: "tilted", cloud, camera, options }
}

/// `over`, as trained Gaussian splats are drawn, before a background.
fn over() -> Scene {
    let options = RenderOptions {
        samples: 4,
        kernel: Kernel::Gaussian,
        cutoff: 9.0,
        resolve: Resolve::Over,
        background: Some([0.05, 0.1, 0.3, 1.0]),
        ..RenderOptions::default()
    };
    Scene { name: "over", cloud: jumble(24, 0.07, 12), camera: golden_camera(), options }
}

/// Two glass spheres, one within the other, lit from the eye, before a half transparent background.
fn transparency() -> Scene {
    let options = RenderOptions {
        samples: 8,
        resolve: soft(1.0),
        background: Some([0.2, 0.5, 0.8, 0.5]),
        shading: splat_core::Shading::Headlight,
        ..RenderOptions::default()
    };
    let center = DVec3::new(0.05, -0.1, 4.0);
    let outer = sphere(center, 1.6, 400, &options);
    let inner = sphere(center + DVec3::new(0.3, 0.2, 0.2), 0.7, 150, &options);
    let counts = [outer.len(), inner.len()];
    let mut cloud = Cloud::join(vec![outer, inner]).expect("two spheres go together");
    let of_each = |outer, inner| [vec![outer; counts[0]], vec![inner; counts[1]]].concat();
    cloud.colors = Some(of_each(Vec3::new(0.9, 0.9, 0.6), Vec3::new(0.9, 0.2, 0.3)));
    cloud.opacities = Some([vec![0.35; counts[0]], vec![0.8; counts[1]]].concat());
    Scene { name: "transparency", cloud, camera: golden_camera(), options }
}
