//! Nothing panics and nothing is NaN, whatever the numbers of cloud and camera.

use glam::{DMat4, DVec2, DVec3, DVec4, Vec3};
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use proptest::sample::select;
use proptest::test_runner::RngSeed;
use splat_abuffer::{Coverage, Resolve, Thickness};
use splat_core::setup::{View, set_up, sort_keys};
use splat_core::{
    AovSelection, Camera, Cloud, Film, Kernel, Lens, PatternKind, PixelFilter, Projection, RenderOptions,
    Shading, Shapes, TableMode, render,
};
use splat_tests::textures::any_f32;

const WIDTH: u32 = 9;
const HEIGHT: u32 = 7;
/// Splats of a cloud.
const N: usize = 8;

/// Finite numbers of any size.
fn finite_f32() -> impl Strategy<Value = f32> {
    any_f32().prop_map(|x| if x.is_finite() { x } else { f32::from_bits(x.to_bits() ^ (1 << 30)) })
}

fn any_f64() -> impl Strategy<Value = f64> {
    let remarkable =
        [0.0, -0.0, 1.0, f64::NAN, f64::INFINITY, f64::MAX, f64::MIN_POSITIVE, 5e-324, 1e300, -1e39];
    prop_oneof![any::<u64>().prop_map(f64::from_bits), select(remarkable.to_vec()), -3.0..3.0, -1e7..1e7]
}

fn vector(number: impl Strategy<Value = f32> + Clone) -> impl Strategy<Value = Vec3> + Clone {
    (number.clone(), number.clone(), number).prop_map(Vec3::from)
}

/// A cloud of `number`s.
fn cloud(number: impl Strategy<Value = f32> + Clone + 'static) -> impl Strategy<Value = Cloud> {
    let vectors = vec(vector(number.clone()), N);
    let numbers = vec(number.clone(), N);
    let axes = vec((vector(number.clone()), vector(number)), N);
    let shapes = prop_oneof![
        numbers.clone().prop_map(Shapes::Discs),
        axes.prop_map(|axes| Shapes::Ellipses(axes.into_iter().map(|(t1, t2)| [t1, t2]).collect())),
    ];
    let origin = prop_oneof![Just(DVec3::ZERO), (any_f64(), any_f64(), any_f64()).prop_map(DVec3::from)];
    (
        origin,
        (vectors.clone(), vectors.clone(), shapes),
        option::of(vectors),
        option::of(numbers.clone()),
        option::of(numbers),
        any::<bool>(),
    )
        .prop_map(|(origin, (positions, normals, shapes), colors, opacities, areas, oriented)| Cloud {
            origin,
            positions,
            normals,
            shapes,
            colors,
            opacities,
            areas,
            texture_coordinates: None,
            oriented,
            outliers: None,
        })
}

/// Any camera that passes its own check: matrices with scale, mirror and shear, all of them of any size.
fn camera() -> impl Strategy<Value = Camera> {
    let ordinary = vec(-2.0..2.0f64, 12);
    let scaled = (ordinary.clone(), -150.0..150.0f64)
        .prop_map(|(m, e)| m.into_iter().map(|x| x * libm::pow(10.0, e)).collect::<Vec<_>>());
    let matrix = prop_oneof![ordinary, scaled, vec(any_f64(), 12)].prop_map(|m| {
        DMat4::from_cols(
            DVec4::new(m[0], m[1], m[2], 0.0),
            DVec4::new(m[3], m[4], m[5], 0.0),
            DVec4::new(m[6], m[7], m[8], 0.0),
            DVec4::new(m[9], m[10], m[11], 1.0),
        )
    });
    let matrix = prop_oneof![2 => Just(DMat4::IDENTITY), 3 => matrix];
    let positive = || prop_oneof![0.1..10.0f64, any_f64().prop_map(f64::abs)];
    let depth = || prop_oneof![1e-4..1.0f64, positive()];
    let lens = (positive(), positive(), select(vec![0, 3, 5])).prop_map(|(radius, focus, blades)| Lens {
        radius,
        focus,
        blades,
    });
    let projection = prop_oneof![
        (positive(), positive(), option::of(lens))
            .prop_map(|(x, y, lens)| Projection::Perspective { focal_length: DVec2::new(x, y), lens }),
        positive().prop_map(|pixels_per_unit| Projection::Orthographic { pixels_per_unit }),
    ];
    let middle = DVec2::new(f64::from(WIDTH), f64::from(HEIGHT)) / 2.0;
    let point = prop_oneof![3 => Just(middle), 1 => (any_f64(), any_f64()).prop_map(DVec2::from)];
    let planes = vec((any_f64(), any_f64(), any_f64(), any_f64()).prop_map(DVec4::from), 0..2);
    (projection, point, matrix, depth(), option::of(depth()), planes)
        .prop_map(|(projection, principal_point, world_to_camera, near, far, clip_planes)| Camera {
            width: WIDTH,
            height: HEIGHT,
            projection,
            principal_point,
            world_to_camera,
            near,
            far: far.map_or(f64::INFINITY, |far| near + far),
            clip_planes,
            distortion: None,
        })
        .prop_filter("a valid camera", |camera| camera.check().is_ok())
}

fn options() -> impl Strategy<Value = RenderOptions> {
    let opaque = Resolve::Surface { coverage: Coverage::Opaque, thickness: Thickness::AroundHit };
    let soft =
        Resolve::Surface { coverage: Coverage::Soft { saturation: 1.0 }, thickness: Thickness::WholeSplat };
    let aovs = AovSelection::ALL;
    (
        select(vec![opaque, soft, Resolve::Over]),
        select(vec![Kernel::Gaussian, Kernel::Windowed, Kernel::Disc]),
        select(vec![TableMode::Floor256, TableMode::Midpoint256, TableMode::Lerp256]),
        select(vec![PixelFilter::Box, PixelFilter::BlackmanHarris]),
        prop_oneof![Just(4.0), 1e-6..64.0f64],
        any::<bool>(),
        any::<bool>(),
    )
        .prop_map(move |(resolve, kernel, table, filter, cutoff, cull, headlight)| RenderOptions {
            samples: 2,
            pattern: PatternKind::Sobol,
            resolve,
            kernel,
            table,
            filter,
            cutoff,
            cull,
            shading: if headlight { Shading::Headlight } else { Shading::Color },
            aovs,
            ..RenderOptions::default()
        })
}

/// Renders, and checks what must hold of any picture. Returns the number of fragments.
fn sound(cloud: &Cloud, camera: &Camera, options: &RenderOptions) -> Result<u64, TestCaseError> {
    let view = View::new(camera, options);
    let set_up = set_up(cloud, &view, options);
    let (keys, _) = sort_keys(cloud, &view, options, 0..cloud.len());
    let visible = |index| set_up.splats.iter().any(|splat| splat.index == index);
    prop_assert!(keys.iter().all(|key| !(key.nearest().is_nan() && visible(key.index()))));
    prop_assert_eq!(set_up.splats.len(), set_up.surfaces.len());
    prop_assert!(set_up.splats.len() + set_up.dropped.values().sum::<usize>() <= N);
    for splat in &set_up.splats {
        prop_assert!(splat.constants.is_finite());
        prop_assert!(!splat.bounds.is_empty() && splat.bounds == splat.bounds.intersect(&view.window));
        prop_assert!(!splat.weight_scale.is_nan());
    }
    let rendered = render(cloud, camera, options, &mut |_| {});
    let rendered = rendered.map_err(|error| TestCaseError::fail(error.to_string()))?;
    sound_film(&rendered.film)?;
    Ok(rendered.statistics.fragments)
}

fn sound_film(film: &Film) -> Result<(), TestCaseError> {
    for rgba in &film.rgba {
        prop_assert!(rgba.iter().all(|x| x.is_finite()), "rgba {rgba:?}");
        prop_assert!((0.0..=1.0).contains(&rgba[3]), "alpha {}", rgba[3]);
    }
    let scalars = [&film.depth, &film.coverage, &film.layers, &film.samples];
    for (number, channel) in scalars.into_iter().enumerate() {
        prop_assert!(channel.iter().flatten().all(|x| !x.is_nan()), "scalar AOV {number} is NaN");
    }
    let vectors = [&film.normal, &film.albedo, &film.position, &film.variance];
    for (number, channel) in vectors.into_iter().enumerate() {
        prop_assert!(channel.iter().flatten().all(|v| !v.is_nan()), "vector AOV {number} is NaN");
    }
    Ok(())
}

/// A camera that sees the splats about the world's zero.
fn ordinary_camera() -> Camera {
    Camera {
        width: WIDTH,
        height: HEIGHT,
        projection: Projection::Perspective {
            focal_length: DVec2::splat(5.0),
            lens: Some(Lens { radius: 0.2, focus: 2.0, blades: 0 }),
        },
        principal_point: DVec2::new(4.5, 3.5),
        world_to_camera: DMat4::from_translation(DVec3::new(0.0, 0.0, 1.0)),
        near: 1e-3,
        far: f64::INFINITY,
        clip_planes: vec![],
        distortion: None,
    }
}

/// Four good splats about the world's zero, whose numbers a test spoils.
fn good() -> Cloud {
    let at = |i: usize| Vec3::new(i as f32 * 0.3 - 1.0, 0.1 * i as f32 - 0.4, 0.2 * i as f32);
    Cloud {
        positions: (0..N).map(at).collect(),
        normals: vec![Vec3::NEG_Z; N],
        shapes: Shapes::Discs(vec![0.5; N]),
        colors: Some(vec![Vec3::ONE; N]),
        opacities: Some(vec![0.8; N]),
        areas: Some(vec![0.1; N]),
        oriented: true,
        ..Cloud::default()
    }
}

/// The same cases in every run.
fn configuration() -> ProptestConfig {
    ProptestConfig {
        cases: 3000,
        max_local_rejects: 1 << 20,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(1),
        ..ProptestConfig::default()
    }
}

#[test]
fn a_needle_of_any_length_has_bounds_or_is_dropped() {
    // Found by the properties below: a box that is not what a larger one holds, after rounding.
    let mut cloud = good();
    let needle = [Vec3::new(-1.7360828e22, 0.0, 5.42062e16), Vec3::new(0.0, 0.0008520389, 0.0)];
    cloud.positions = vec![Vec3::ZERO; N];
    cloud.shapes = Shapes::Ellipses(vec![needle; N]);
    let options = RenderOptions {
        filter: PixelFilter::Box,
        kernel: Kernel::Gaussian,
        cutoff: 21.658942148617722,
        ..RenderOptions::default()
    };
    sound(&cloud, &ordinary_camera(), &options).expect("sound");
}

proptest! {
    #![proptest_config(configuration())]

    #[test]
    fn any_bits_in_a_cloud_make_a_sound_picture(cloud in cloud(any_f32().boxed()), options in options()) {
        sound(&cloud, &ordinary_camera(), &options)?;
    }

    #[test]
    fn any_finite_numbers_in_a_cloud_make_a_sound_picture(
        cloud in cloud(finite_f32().boxed()), options in options(),
    ) {
        sound(&cloud, &ordinary_camera(), &options)?;
    }

    #[test]
    fn any_valid_camera_makes_a_sound_picture(camera in camera(), options in options()) {
        sound(&good(), &camera, &options)?;
    }

    #[test]
    fn any_cloud_under_any_camera_makes_a_sound_picture(
        cloud in cloud(finite_f32().boxed()), camera in camera(), options in options(),
    ) {
        sound(&cloud, &camera, &options)?;
    }

    #[test]
    fn one_bad_number_among_good_ones_makes_a_sound_picture(
        number in any_f32(), what in 0..7usize, options in options(),
    ) {
        let mut cloud = good();
        match what {
            0 => cloud.positions[3].x = number,
            1 => cloud.normals[3].y = number,
            2 => cloud.shapes = Shapes::Discs([vec![number], vec![0.5; N - 1]].concat()),
            3 => cloud.colors.iter_mut().flatten().nth(3).expect("eight").z = number,
            4 => cloud.opacities.iter_mut().for_each(|values| values[3] = number),
            5 => cloud.areas.iter_mut().for_each(|values| values[3] = number),
            _ => cloud.shapes = Shapes::Ellipses(
                [vec![[Vec3::X, Vec3::new(0.0, number, 0.0)]], vec![[Vec3::X, Vec3::Y]; N - 1]].concat()
            ),
        }
        let fragments = sound(&cloud, &ordinary_camera(), &options)?;
        prop_assert!(options.cutoff < 1.0 || fragments > 0, "the good ones stay");
    }

    #[test]
    fn any_points_make_a_cloud(points in vec((any_f64(), any_f64(), any_f64()).prop_map(DVec3::from), 0..9)) {
        let mut cloud = Cloud::from_points(&points);
        cloud.normals = vec![Vec3::NEG_Z; points.len()];
        cloud.shapes = Shapes::Discs(vec![0.3; points.len()]);
        sound(&cloud, &ordinary_camera(), &RenderOptions::default())?;
        // A point that fits is where it was: to f32 of the distance from the origin.
        for (i, point) in points.iter().enumerate() {
            if cloud.positions[i].is_finite() && point.is_finite() {
                let error = (cloud.world_position(i) - point).length();
                let allowed = f64::from(f32::EPSILON) * (point - cloud.origin).length()
                    + f64::from(f32::MIN_POSITIVE) + f64::EPSILON * point.length();
                prop_assert!(error <= allowed || !allowed.is_finite(), "{point}: {error:e} > {allowed:e}");
            }
        }
    }
}
