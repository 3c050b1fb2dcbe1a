//! The scenes of the report.

use anyhow::Context;
use glam::{DMat4, DVec2, DVec3, Vec3};
use splat_bench::{Blur, Case, Scene, Subject, sphere};
use splat_core::fit::{Framing, Up, fit};
use splat_core::prepare::{PrepareOptions, prepare};
use splat_core::{Camera, Cloud, Kernel, PixelFilter, Projection, RenderOptions, Shading, Shapes};
use splat_tests::random::Random;
use std::path::Path;

/// A scene of the report.
#[derive(Debug, Clone)]
pub struct Subjects {
    /// Its name.
    pub name: &'static str,
    /// What it is.
    pub about: &'static str,
    /// The cloud.
    pub cloud: Cloud,
    /// The camera.
    pub camera: Camera,
    /// The options; axes vary them.
    pub options: RenderOptions,
}

/// All scenes at a width (the height is 9/16 of it), and what was left out.
///
/// # Errors
/// If a file of the data cannot be read.
pub fn all(width: u32, data: Option<&Path>) -> anyhow::Result<(Vec<Subjects>, Vec<String>)> {
    let mut scenes = vec![sphere_scene(width)?];
    let mut left_out = Vec::new();
    for (name, about, file) in [
        ("dragon", "a scanned surface, 22,792 surfels", "surfels/dragon_res3_surfels.ply"),
        ("pond", "a photogrammetric cloud with noise and holes", "surfels/pond_pmvs.ply"),
    ] {
        match data.map(|folder| folder.join(file)).filter(|path| path.exists()) {
            Some(path) => scenes.push(real(name, about, &path, width)?),
            None => left_out.push(format!(
                "The scene “{name}” is left out: no {file} in a folder given by --data or SPLAT_TEST_DATA."
            )),
        }
    }
    scenes.push(horizon(width));
    scenes.push(defocus(width)?);
    Ok((scenes, left_out))
}

/// The camera of a frame of 480 pixels' width at another one.
fn resized(mut camera: Camera, width: u32) -> Camera {
    let factor = f64::from(width) / f64::from(camera.width);
    camera.height = (f64::from(camera.height) * factor).round() as u32;
    camera.width = width;
    camera.principal_point *= factor;
    if let Projection::Perspective { focal_length, .. } = &mut camera.projection {
        *focal_length *= factor;
    }
    camera
}

/// The options that the axes vary: the renderer's own defaults for surfaces.
fn defaults(shading: Shading) -> RenderOptions {
    RenderOptions { shading, ..RenderOptions::default() }
}

/// The benchmarks' sphere at a quarter of its size, in the colours of a globe.
fn sphere_scene(width: u32) -> anyhow::Result<Subjects> {
    let subject = Subject::Quarter(100);
    let mut cloud = subject.cloud()?.context("a sphere is made, not read")?;
    cloud.colors = Some(checks(&cloud));
    let Scene { camera, options } =
        Case { subject, samples: 16, blur: Blur::Pinhole }.scene(&cloud).context("a scene")?;
    let options =
        RenderOptions { filter: PixelFilter::BlackmanHarris, shading: Shading::Headlight, ..options };
    Ok(Subjects {
        name: "sphere",
        about: "6,250 discs on a sphere in checks, Gaussian kernel, cutoff 2, front faces",
        cloud,
        camera: resized(camera, width),
        options,
    })
}

/// The same far out of focus at its rim, less so at its middle.
fn defocus(width: u32) -> anyhow::Result<Subjects> {
    let sphere = sphere_scene(width)?;
    let mut camera = sphere.camera;
    if let Projection::Perspective { lens, .. } = &mut camera.projection {
        // The circle of confusion of the sphere's centre has a radius of 5 pixels of a frame of 480.
        *lens = Some(splat_core::Lens { radius: 0.0385, focus: 1.0, blades: 0 });
    }
    Ok(Subjects {
        name: "defocus",
        about: "the sphere through a lens; its centre is blurred over a radius of 5/480 of the width",
        camera,
        ..sphere
    })
}

/// Checks by longitude and latitude.
fn checks(cloud: &Cloud) -> Vec<Vec3> {
    let color = |p: &Vec3| {
        let longitude = libm::atan2(f64::from(p.y), f64::from(p.x)) * (6.0 / std::f64::consts::PI);
        let latitude = f64::from(p.z) * 5.0;
        let odd = (longitude.floor() + latitude.floor()).rem_euclid(2.0) > 0.5;
        if odd { Vec3::new(0.9, 0.35, 0.1) } else { Vec3::new(0.15, 0.4, 0.8) }
    };
    cloud.positions.iter().map(color).collect()
}

/// A cloud from a file, as `splat render` shows it without further options.
fn real(name: &'static str, about: &'static str, path: &Path, width: u32) -> anyhow::Result<Subjects> {
    let mut cloud = splat_io::read_ply(path).context("a cloud")?.cloud;
    let RenderOptions { kernel, cutoff, .. } = RenderOptions::default();
    prepare(&mut cloud, &PrepareOptions { kernel, cutoff, ..PrepareOptions::default() }, &mut |_| {});
    let options = defaults(if cloud.colors.is_some() { Shading::Color } else { Shading::Headlight });
    let framing = Framing {
        width,
        height: width * 9 / 16,
        up: Up::Y,
        azimuth: 30.0,
        elevation: 20.0,
        orthographic: false,
    };
    let camera = fit(&cloud, &framing, &options)?;
    Ok(Subjects { name, about, cloud, camera, options })
}

/// A plane seen at a grazing angle from beneath one's feet to the horizon, blades of grass (ellipses of 1:50) on it,
/// some all but edge-on, and splats across the camera's plane.
fn horizon(width: u32) -> Subjects {
    let mut random = Random::new(5);
    let mut splats: Vec<(DVec3, [DVec3; 2], Vec3)> = Vec::new();
    // The eye is one unit above the plane; y points down. Rows grow with the distance, as the splats do.
    let mut depth: f64 = 0.15;
    while depth < 400.0 {
        let spacing = 0.06 * (1.0 + depth * 0.35);
        let half_width = 0.75 * depth + 4.0 * spacing;
        let count = (2.0 * half_width / spacing).ceil() as i32;
        for i in 0..=count {
            let x = -half_width + f64::from(i) * spacing + random.range(-0.2, 0.2) * spacing;
            let z = depth + random.range(-0.2, 0.2) * spacing;
            let tilt = 0.01 * random.direction();
            let odd = ((x * 0.5).floor() + (z * 0.25).floor()).rem_euclid(2.0) > 0.5;
            let color = if odd { Vec3::new(0.7, 0.65, 0.5) } else { Vec3::new(0.2, 0.3, 0.2) };
            let axes = [DVec3::X + tilt, DVec3::Z + 0.01 * random.direction()].map(|axis| axis * spacing);
            splats.push((DVec3::new(x, 1.0, z), axes, color));
        }
        depth += spacing;
    }
    for _ in 0..600 {
        let z = random.log_range(1.0, 40.0);
        let x = random.range(-0.5, 0.5) * z;
        let height = random.range(0.1, 0.4);
        let lean = DVec3::new(random.range(-0.3, 0.3), -1.0, random.range(-0.3, 0.3)).normalize();
        let across = lean.cross(random.direction()).normalize();
        let axes = [lean * height, across * height / 50.0];
        splats.push((DVec3::new(x, 1.0 - height, z), axes, Vec3::new(0.1, 0.6, 0.1)));
    }
    for i in 0..4 {
        // Long walls that begin behind the eye.
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        let axes = [DVec3::new(0.02 * side, 0.0, 1.5), DVec3::new(0.0, 0.25, 0.0)];
        let center = DVec3::new(side * (0.9 + 0.2 * f64::from(i)), 0.1 * f64::from(i) - 0.4, 0.5);
        splats.push((center, axes, Vec3::new(0.8, 0.2 * i as f32, 0.3)));
    }
    let positions: Vec<DVec3> = splats.iter().map(|splat| splat.0).collect();
    let normal = |axes: &[DVec3; 2]| axes[0].cross(axes[1]).normalize().as_vec3();
    let mut cloud = Cloud::from_points(&positions);
    cloud.normals = splats.iter().map(|splat| normal(&splat.1)).collect();
    cloud.shapes = Shapes::Ellipses(splats.iter().map(|s| s.1.map(|axis| axis.as_vec3())).collect());
    cloud.colors = Some(splats.iter().map(|splat| splat.2).collect());
    // Each stands for the square of its spacing on the plane; a blade alone covers what it is.
    cloud.areas = Some(
        splats
            .iter()
            .map(|(_, [t1, t2], _)| {
                let area = t1.cross(*t2).length();
                let alone = t1.length() > 10.0 * t2.length() || t1.length() > 1.2 && t2.y > 0.1;
                (if alone { area * Kernel::Windowed.integral(4.0) } else { area }) as f32
            })
            .collect(),
    );
    let camera = Camera {
        width: 480,
        height: 270,
        projection: Projection::Perspective { focal_length: DVec2::splat(400.0), lens: None },
        principal_point: DVec2::new(240.0, 100.0),
        world_to_camera: DMat4::IDENTITY,
        near: 0.05,
        far: f64::INFINITY,
        clip_planes: Vec::new(),
        distortion: None,
    };
    Subjects {
        name: "horizon",
        about: "a plane to the horizon, thin blades, walls across the camera's plane",
        cloud,
        camera: resized(camera, width),
        options: defaults(Shading::Color),
    }
}

/// A wall of smoothly coloured, overlapping splats beyond the frame: no edge anywhere.
pub fn smooth(width: u32) -> Subjects {
    let mut random = Random::new(9);
    let mut cloud = Cloud { shapes: Shapes::Discs(vec![]), oriented: true, ..Cloud::default() };
    let (mut sizes, mut colors, mut areas) = (vec![], vec![], vec![]);
    // Spacing of 6 pixels at a width of 96, sigma of 7.5.
    let spacing = 6.0 / 96.0;
    for row in -10..=10 {
        for column in -14..=14 {
            let jitter = DVec2::new(random.range(-0.1, 0.1), random.range(-0.1, 0.1));
            let at = (DVec2::new(f64::from(column), f64::from(row)) + jitter) * spacing;
            cloud.positions.push(at.extend(1.0).as_vec3());
            cloud.normals.push(Vec3::NEG_Z);
            sizes.push((1.25 * spacing) as f32);
            colors.push(Vec3::from_array([0; 3].map(|_| random.unit() as f32)));
            areas.push((spacing * spacing) as f32);
        }
    }
    cloud.shapes = Shapes::Discs(sizes);
    cloud.colors = Some(colors);
    cloud.areas = Some(areas);
    // Opaque wherever the weight is at least a half, which it is everywhere: the rims of F = 9 hardly show.
    let options = RenderOptions { cutoff: 9.0, ..defaults(Shading::Color) };
    Subjects {
        name: "smooth",
        about: "a wall of blended colours",
        cloud,
        camera: small_camera(width),
        options,
    }
}

/// Hard discs over one another: every difference is an edge.
pub fn edges(width: u32) -> Subjects {
    let mut random = Random::new(10);
    let surfels: Vec<splat_tests::scenes::Surfel> = (0..150)
        .map(|_| {
            let depth = random.range(1.0, 3.0);
            let place = DVec3::new(random.range(-0.55, 0.55), random.range(-0.35, 0.35), 1.0) * depth;
            let normal = (DVec3::NEG_Z + 0.6 * random.direction()).normalize();
            let color = [0; 3].map(|_| random.unit() as f32);
            splat_tests::scenes::Surfel::new(place, normal, random.range(0.03, 0.1) * depth).colored(color)
        })
        .collect();
    let options = splat_tests::scenes::hard_discs(16);
    let options = RenderOptions { filter: PixelFilter::BlackmanHarris, ..options };
    Subjects {
        name: "edges",
        about: "hard discs over one another",
        cloud: splat_tests::scenes::cloud(&surfels),
        camera: small_camera(width),
        options,
    }
}

/// A frame of 16:9 whose width is one unit at depth 1.
fn small_camera(width: u32) -> Camera {
    let focal = f64::from(width);
    splat_tests::core_scenes::pinhole(width, width * 9 / 16, focal)
}

/// The benchmarks' sphere of any number of discs in a frame of 480 x 270, whose sizes in pixels therefore shrink.
pub fn sphere_of(count: usize, width: u32) -> anyhow::Result<Subjects> {
    let mut scene = sphere_scene(width)?;
    scene.cloud = sphere(count);
    scene.cloud.colors = Some(checks(&scene.cloud));
    Ok(scene)
}
