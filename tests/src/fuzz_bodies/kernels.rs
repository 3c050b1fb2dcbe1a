//! Kernels: the resolve, footprints and mappings, lookups, and one core against the other.

use super::decode::Bytes;
use glam::{DAffine3, DMat2, DMat3, DVec2, DVec3, Vec3};
use splat_abuffer::{Coverage, Fragment, Resolve, Resolver, SplatSurface, Thickness};
use splat_core::sampling::{PatternKind, PixelFilter};
use splat_core::texture::filter::{Filter, Magnification, Probes, Quality, Sampler};
use splat_core::texture::footprint::{Footprint, PixelDerivatives};
use splat_core::texture::mapping::{SpacePoint, SphericalMapping, UvMapping};
use splat_core::texture::pyramid::{Pyramid, Texels, Wrap};
use splat_core::{
    AovSelection, Camera, Cloud, Kernel, Lens, PixelRect, Projection, RenderOptions, Shading, Shapes,
    TableMode, render,
};
use splat_simd::texture::{LanePyramid, LaneSampler};
use splat_simd::{Level, Renderer};

/// The fragments of a sample: the set decides, not its order, and nothing leaves its range.
pub(super) fn resolve(bytes: &[u8]) {
    let mut bytes = Bytes(bytes);
    let mode = mode(&mut bytes);
    let (mut fragments, mut surfaces) = (Vec::new(), Vec::new());
    while !bytes.is_empty() && fragments.len() < 200 {
        let depth = bytes.number(0.0, 8.0);
        // Sums of so many stay finite.
        let weight = bytes.number(0.0, 1.0).min(1e30);
        let fragment = Fragment::new(depth, weight, fragments.len() as u32, bytes.flag());
        if fragment.is_admitted() {
            fragments.push(fragment);
            let interval = [bytes.number(0.0, 0.3).abs(), bytes.number(0.0, 1.0).abs()];
            surfaces.push(SplatSurface {
                color: [bytes.unit() as f32, bytes.unit() as f32, bytes.unit() as f32],
                opacity: bytes.unit() as f32,
                interval,
            });
        }
    }
    let mut resolver = Resolver::new(mode);
    let once = resolver.resolve(&mut fragments, &surfaces);
    assert!((0.0..=1.0).contains(&once.transmittance), "{once:?}");
    assert!((0.0..=1.0).contains(&once.uncovered), "{once:?}");
    assert!(once.color.iter().all(|value| (0.0..=1.001).contains(value)), "{once:?}");
    for layer in resolver.layers() {
        assert!(resolver.fragments_of(layer, &fragments).next().is_some(), "a layer of nothing");
    }
    fragments.reverse();
    assert_eq!(resolver.resolve(&mut fragments, &surfaces), once, "the order of arrival counted");
}

fn mode(bytes: &mut Bytes<'_>) -> Resolve {
    let coverage = if bytes.flag() {
        Coverage::Opaque
    } else {
        Coverage::Soft { saturation: bytes.range(0.01, 4.0) as f32 }
    };
    let thickness = bytes.pick(&[Thickness::AroundHit, Thickness::WholeSplat]);
    if bytes.byte().is_multiple_of(4) { Resolve::Over } else { Resolve::Surface { coverage, thickness } }
}

/// Footprints and mappings of any numbers.
pub(super) fn footprint(bytes: &[u8]) {
    let mut bytes = Bytes(bytes);
    let footprint = Footprint { semi_axes: [bytes.any2(), bytes.any2()] };
    let sanitized = footprint.sanitized();
    assert!(sanitized.semi_axes.iter().all(|axis| axis.is_finite()), "{sanitized:?}");
    let axes = footprint.principal_axes();
    assert!(axes.minor >= 0.0 && axes.major >= axes.minor && axes.major.is_finite(), "{axes:?}");
    assert!(axes.direction.is_finite() && footprint.half_box().is_finite());
    let derivatives = PixelDerivatives { x: bytes.any2().as_dvec2(), y: bytes.any2().as_dvec2() };
    let bounded = derivatives.bounded();
    assert!(bounded.x.is_finite() && bounded.y.is_finite());
    let matrix = DMat2::from_cols(bytes.any2().as_dvec2(), bytes.any2().as_dvec2());
    let chained = derivatives.chain(matrix).bounded().semi_axes();
    assert!(chained.sanitized().semi_axes.iter().all(|axis| axis.is_finite()));

    let at = SpacePoint { point: bytes.any3(), dx: bytes.any3(), dy: bytes.any3() };
    let linear = DMat3::from_cols(bytes.any3(), bytes.any3(), bytes.any3());
    let world_to_texture = DAffine3 { matrix3: linear, translation: bytes.any3() };
    let place = SphericalMapping { world_to_texture }.map(&at);
    assert!(place.derivatives.x.is_finite() && place.derivatives.y.is_finite(), "{place:?}");
    let mapping = UvMapping { scale: bytes.any2().as_dvec2(), offset: bytes.any2().as_dvec2() };
    let place = mapping.map(bytes.any2().as_dvec2(), &derivatives);
    assert!(place.derivatives.x.is_finite() && place.derivatives.y.is_finite(), "{place:?}");
}

/// Lookups of a small texture, scalar and in lanes: finite, within the range of the texels, and of the same bits at
/// every level.
pub(super) fn lookup(bytes: &[u8]) {
    let mut bytes = Bytes(bytes);
    let size = [1 + bytes.below(9) as u32, 1 + bytes.below(9) as u32];
    let channels = 1 + bytes.below(4);
    let count = (size[0] * size[1]) as usize * channels;
    let texels = match bytes.below(3) {
        0 => Texels::Srgb8((0..count).map(|_| bytes.byte()).collect()),
        1 => Texels::f16_from(&(0..count).map(|_| bytes.number(0.0, 1.0)).collect::<Vec<_>>()),
        _ => Texels::F32((0..count).map(|_| bytes.number(0.0, 1.0)).collect()),
    };
    let wraps = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror, Wrap::Black];
    let wrap = [bytes.pick(&wraps), bytes.pick(&wraps)];
    let pyramid = Pyramid::new(size, channels, texels, wrap).expect("sizes that fit");
    let filters = [
        Filter::Trilinear,
        Filter::EwaPrinted,
        Filter::Ewa,
        Filter::Assembly(Probes::Texram),
        Filter::Assembly(Probes::TexramCeiling),
        Filter::Assembly(Probes::Gaussian),
        Filter::EwaVc(Quality::DEFAULT),
        Filter::EwaVc(Quality::new(bytes.any().into())),
    ];
    let sampler = Sampler {
        filter: bytes.pick(&filters),
        magnification: bytes.pick(&[Magnification::Bilinear, Magnification::Bicubic]),
        max_anisotropy: bytes.any().into(),
        width: bytes.any().into(),
    };
    let lanes = LanePyramid::new(&pyramid);
    let lane_sampler = LaneSampler::new(&sampler);
    for _ in 0..3 {
        let st = bytes.any2();
        let footprint = Footprint { semi_axes: [bytes.any2(), bytes.any2()] };
        let color = sampler.lookup(&pyramid, st, &footprint);
        assert!(color.iter().all(|value| value.is_finite()), "{sampler:?} {st} {footprint:?}: {color:?}");
        let of_level = |level: &Level| lane_sampler.lookup(*level, &lanes, st, &footprint).map(f32::to_bits);
        let bits: Vec<_> = Level::available().iter().map(of_level).collect();
        assert!(bits.windows(2).all(|pair| pair[0] == pair[1]), "levels differ: {bits:?}");
        let finite = bits[0].iter().all(|&bits| f32::from_bits(bits).is_finite());
        assert!(finite, "{sampler:?} {st} {footprint:?}: {bits:?}");
    }
}

/// A scene of a few splats: the fast core draws what the reference draws, bit for bit.
pub(super) fn cores(bytes: &[u8]) {
    let mut bytes = Bytes(bytes);
    let (camera, options) = (camera(&mut bytes), options(&mut bytes));
    let cloud = cloud(&mut bytes);
    let Ok(reference) = render(&cloud, &camera, &options, &mut |_| {}) else { return };
    let bits = |film: &splat_core::Film| -> Vec<u32> {
        film.rgba.as_flattened().iter().map(|value| value.to_bits()).collect()
    };
    for value in reference.film.rgba.as_flattened() {
        assert!(value.is_finite(), "{value}");
    }
    for level in Level::available() {
        let mut renderer = Renderer::new(1, level).expect("one thread");
        let fast = renderer.render(&cloud, &camera, &options, &mut |_| {}).expect("the reference could");
        assert_eq!(bits(&fast.film), bits(&reference.film), "{}", level.name());
        assert_eq!(fast.statistics.fragments, reference.statistics.fragments, "{}", level.name());
    }
}

fn camera(bytes: &mut Bytes<'_>) -> Camera {
    let [width, height] = [1 + bytes.below(40) as u32, 1 + bytes.below(40) as u32];
    let lens = bytes.flag().then(|| Lens {
        radius: f64::from(bytes.number(0.0, 0.5)).abs().max(1e-6),
        focus: f64::from(bytes.number(0.5, 6.0)).abs().max(1e-3),
        blades: bytes.pick(&[0, 3, 5]),
    });
    let focal_length = DVec2::new(bytes.range(5.0, 80.0), bytes.range(5.0, 80.0));
    let projection = if bytes.byte().is_multiple_of(4) {
        Projection::Orthographic { pixels_per_unit: bytes.range(1.0, 30.0) }
    } else {
        Projection::Perspective { focal_length, lens }
    };
    let near = bytes.range(0.0, 1.0).max(1e-3);
    let far = if bytes.flag() { f64::INFINITY } else { near + bytes.range(0.01, 8.0) };
    Camera {
        projection,
        near,
        far,
        principal_point: DVec2::new(f64::from(width), f64::from(height)) * bytes.range(0.2, 0.8),
        ..crate::scenes::pinhole(width, height, 1.0)
    }
}

fn options(bytes: &mut Bytes<'_>) -> RenderOptions {
    let start = bytes.below(40) as i32;
    RenderOptions {
        samples: 1 + bytes.below(10) as u32,
        window: (bytes.byte().is_multiple_of(4))
            .then(|| PixelRect::new(start, start / 2, start + 9, start + 3)),
        filter: bytes.pick(&[PixelFilter::Box, PixelFilter::Tent, PixelFilter::BlackmanHarris]),
        pattern: bytes.pick(&[PatternKind::Dealt, PatternKind::Sobol]),
        kernel: bytes.pick(&[Kernel::Windowed, Kernel::Gaussian, Kernel::Disc]),
        cutoff: bytes.range(0.05, 16.0),
        table: bytes.pick(&[TableMode::Poly8, TableMode::Floor256, TableMode::Lerp256, TableMode::Quartic8]),
        resolve: mode(bytes),
        cull: bytes.flag(),
        shading: bytes.pick(&[Shading::Color, Shading::Headlight]),
        aovs: if bytes.byte().is_multiple_of(8) { AovSelection::ALL } else { AovSelection::default() },
        tile_memory: bytes.pick(&[1, 20_000, 64 << 20]),
        ..RenderOptions::default()
    }
}

fn cloud(bytes: &mut Bytes<'_>) -> Cloud {
    let are_ellipses = bytes.flag();
    let [has_opacities, has_areas] = [bytes.flag(), bytes.flag()];
    let mut cloud = Cloud { oriented: bytes.flag(), ..Cloud::default() };
    let (mut sizes, mut axes) = (Vec::new(), Vec::new());
    let (mut colors, mut opacities, mut areas) = (Vec::new(), Vec::new(), Vec::new());
    while !bytes.is_empty() && cloud.positions.len() < 24 {
        let depth = bytes.number(0.5, 8.0);
        let place = bytes.vector(-0.5, 0.5);
        cloud.positions.push(Vec3::new(place.x * depth, place.y * depth, depth));
        let normal = DVec3::from(bytes.vector(-1.0, 1.0)).normalize_or_zero();
        cloud.normals.push(normal.as_vec3());
        sizes.push(bytes.number(0.001, 1.0));
        axes.push([bytes.vector(-0.5, 0.5), bytes.vector(-0.5, 0.5)]);
        colors.push(bytes.vector(0.0, 1.0).abs());
        opacities.push(bytes.unit() as f32);
        areas.push(bytes.number(0.001, 1.0));
    }
    cloud.shapes = if are_ellipses { Shapes::Ellipses(axes) } else { Shapes::Discs(sizes) };
    cloud.colors = Some(colors);
    cloud.opacities = has_opacities.then_some(opacities);
    cloud.areas = has_areas.then_some(areas);
    cloud
}
