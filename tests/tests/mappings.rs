//! Mappings: their analytic derivatives against finite differences, away from seams, across them, and where
//! there are none.

use glam::{DAffine3, DMat3, DVec2, DVec3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use splat_core::texture::footprint::MAX_COMPONENT;
use splat_core::texture::mapping::difference_quotient;
use splat_core::texture::{
    CylinderHeight, CylindricalMapping, PixelDerivatives, PlanarMapping, SolidMapping, SpacePoint,
    SphericalMapping, TexturePoint, UvMapping,
};
use splat_tests::random::Random;
use splat_tests::textures::{any_f64, any_vector, derivative, vector};
use splat_tests::tolerances as tol;
use std::f64::consts::{PI, TAU};

/// A mapping of points, and which of its coordinates wrap around.
struct Mapping {
    map: Box<dyn Fn(&SpacePoint) -> TexturePoint>,
    wraps: [bool; 2],
    /// Least distance from the axis at which it is tried.
    clear: f64,
}

fn mappings(world_to_texture: DAffine3) -> [Mapping; 4] {
    let sphere = SphericalMapping { world_to_texture };
    let cylinder = move |height| CylindricalMapping { world_to_texture, height };
    let [normalized, along] = [CylinderHeight::Normalized, CylinderHeight::AlongAxis].map(cylinder);
    let plane = PlanarMapping {
        world_to_texture,
        vs: DVec3::new(0.5, 1.0, -0.25),
        vt: DVec3::new(-0.3, 0.2, 2.0),
        offset: DVec2::new(0.5, -7.0),
    };
    [
        Mapping { map: Box::new(move |p| sphere.map(p)), wraps: [false, true], clear: 0.3 },
        Mapping { map: Box::new(move |p| normalized.map(p)), wraps: [true, false], clear: 0.3 },
        Mapping { map: Box::new(move |p| along.map(p)), wraps: [true, false], clear: 0.3 },
        Mapping { map: Box::new(move |p| plane.map(p)), wraps: [false, false], clear: 0.0 },
    ]
}

impl Mapping {
    fn st(&self, point: DVec3) -> DVec2 {
        (self.map)(&SpacePoint { point, ..SpacePoint::default() }).st
    }

    /// The derivative along `change`, from central differences that lose their whole turns.
    fn derivative(&self, point: DVec3, change: DVec3) -> DVec2 {
        let from = self.st(point);
        let unwrapped = |h: f64| {
            let d = self.st(point + h * change) - from;
            let wraps = DVec2::from(self.wraps.map(|wraps| f64::from(u8::from(wraps))));
            (d - wraps * d.round()).extend(0.0)
        };
        derivative(unwrapped, 1e-3).truncate()
    }

    fn assert_derivatives(&self, point: DVec3, dx: DVec3, dy: DVec3) {
        let found = (self.map)(&SpacePoint { point, dx, dy });
        for (found, change) in [(found.derivatives.x, dx), (found.derivatives.y, dy)] {
            let truth = self.derivative(point, change);
            let error = (found - truth).length();
            assert!(error <= tol::CENTRAL_DIFFERENCE, "{error:e} {found} {truth} at {point}");
        }
    }
}

/// A motion with a scale of .5 to 2.
fn transform(rng: &mut Random) -> DAffine3 {
    DAffine3::from_scale_rotation_translation(
        DVec3::new(rng.range(0.5, 2.0), rng.range(0.5, 2.0), rng.range(0.5, 2.0)),
        glam::DQuat::from_axis_angle(rng.direction(), rng.range(0.0, 3.0)),
        vector(rng, 1.0),
    )
}

#[test]
fn derivatives_are_those_of_the_coordinates() {
    let mut rng = Random::new(1);
    let mut tried = 0;
    for _ in 0..500 {
        let world_to_texture = transform(&mut rng);
        let (point, dx, dy) = (vector(&mut rng, 2.0), vector(&mut rng, 0.5), vector(&mut rng, 0.5));
        let local = world_to_texture.transform_point3(point);
        for mapping in mappings(world_to_texture) {
            if libm::hypot(local.x, local.y) > mapping.clear {
                mapping.assert_derivatives(point, dx, dy);
                tried += 1;
            }
        }
    }
    assert!(tried > 1500, "{tried}");
}

#[test]
fn derivatives_go_on_across_the_seam() {
    let mut rng = Random::new(2);
    for (mapping, seam) in mappings(DAffine3::IDENTITY).iter().zip([0.0, PI, PI]) {
        for _ in 0..200 {
            let [rho, z] = [rng.range(0.5, 2.0), rng.range(-1.0, 1.0)];
            let (dx, dy) = (vector(&mut rng, 0.5), vector(&mut rng, 0.5));
            let at = |off: f64| {
                let angle = seam + off;
                DVec3::new(rho * libm::cos(angle), rho * libm::sin(angle), z)
            };
            // Differences of .001 of dx reach over the seam on both sides of it.
            let off = rng.range(-1e-4, 1e-4);
            mapping.assert_derivatives(at(off), dx, dy);
            // The coordinate jumps by 1 and its derivative does not.
            let [before, after] =
                [at(-1e-12), at(1e-12)].map(|point| (mapping.map)(&SpacePoint { point, dx, dy }));
            let jump = (before.st - after.st).abs().max_element();
            assert!((jump - 1.0).abs() < 1e-9, "{jump}");
            let change = (before.derivatives.x - after.derivatives.x).length();
            assert!(change < 1e-10, "{change:e}");
        }
    }
}

#[test]
fn the_seed_s_differences_corrected_tend_to_the_derivatives() {
    let mut rng = Random::new(3);
    for (mapping, seam) in mappings(DAffine3::IDENTITY).iter().zip([0.0, PI, PI]) {
        for i in 0..200 {
            // A pixel of up to .05, from both sides of the seam, and anywhere.
            let angle = if i % 2 == 0 { seam + rng.range(-0.01, 0.01) } else { rng.range(0.0, TAU) };
            let p = DVec3::new(libm::cos(angle), libm::sin(angle), rng.range(-1.0, 1.0));
            let dx = vector(&mut rng, 0.05);
            let truth = (mapping.map)(&SpacePoint { point: p, dx, dy: dx }).derivatives.x;
            let mut last = f64::INFINITY;
            for delta in [0.1, 0.01, 0.001] {
                let found = difference_quotient(|p| mapping.st(p), p, dx, delta, mapping.wraps);
                let error = (found - truth).length();
                // Of the first order in the difference, second derivatives being below 1.
                assert!(error <= delta * dx.length_squared() + 1e-12, "{error:e} for {delta}");
                assert!(error <= last);
                last = error;
            }
        }
    }
}

#[test]
fn coordinates_are_the_seed_s() {
    use splat_tests::printed_textures as printed;
    let mut rng = Random::new(4);
    let [sphere, cylinder, along, _] = mappings(DAffine3::IDENTITY);
    for _ in 0..2000 {
        let p = vector(&mut rng, 3.0);
        let st = sphere.st(p);
        assert!((st - printed::sphere(p)).length() <= tol::ACOS, "{st}");
        assert!((0.0..=1.0).contains(&st.x) && (0.0..=1.0).contains(&st.y));
        assert!((cylinder.st(p) - printed::cylinder(p)).length() <= tol::EXACT);
        assert_eq!(along.st(p), DVec2::new(cylinder.st(p).x, p.z));
    }
    // Poles: theta is 0 on +z and pi on -z. The seams.
    assert_eq!(sphere.st(DVec3::Z), DVec2::ZERO);
    assert_eq!(sphere.st(DVec3::NEG_Z), DVec2::new(1.0, 0.0));
    assert_eq!(sphere.st(DVec3::new(-0.0, -0.0, 1.0)), DVec2::ZERO);
    assert_eq!(sphere.st(DVec3::Y), DVec2::new(0.5, 0.25));
    assert_eq!(cylinder.st(DVec3::X), DVec2::new(0.5, 0.0));
    assert_eq!(cylinder.st(DVec3::NEG_X), DVec2::new(1.0, 0.0));
}

#[test]
fn poles_axes_and_centre_are_finite_and_as_stated() {
    let [sphere, cylinder, along, _] = mappings(DAffine3::IDENTITY);
    let at = |point, dx, dy| SpacePoint { point, dx, dy };
    let (dx, dy) = (DVec3::new(0.3, 0.4, 0.0), DVec3::new(0.0, 0.0, 0.1));
    // At the pole: the change of the distance to it, and a full turn; up and down, nothing.
    for (z, sign) in [(2.0, 1.0), (-2.0, -1.0)] {
        let found = (sphere.map)(&at(DVec3::new(0.0, 0.0, z), dx, dy)).derivatives;
        assert!((found.x - DVec2::new(sign * 0.25 / PI, 1.0)).length() <= tol::EXACT, "{found:?}");
        assert_eq!(found.y.abs(), DVec2::ZERO);
    }
    // On the axis.
    let on_axis = DVec3::new(0.0, 0.0, 2.0);
    let found = (cylinder.map)(&at(on_axis, dx, dy));
    assert_eq!((found.st, found.derivatives.x.x, found.derivatives.y.x), (DVec2::new(0.5, 1.0), 1.0, 0.0));
    let found = (along.map)(&at(on_axis, dx, dy));
    assert_eq!((found.st, found.derivatives.x), (DVec2::new(0.5, 2.0), DVec2::new(1.0, 0.0)));
    assert!((found.derivatives.y - DVec2::new(0.0, 0.1)).length() <= tol::EXACT);
    // Near them no more than a full turn, and the derivative where it is less.
    for rho in [1e-300, 1e-9, 1e-3, 0.1] {
        let found = (sphere.map)(&at(DVec3::new(rho, 0.0, 1.0), DVec3::Y, DVec3::X)).derivatives;
        let truth = (1.0 / (TAU * rho)).min(1.0);
        assert!((found.x.y - truth).abs() <= tol::EXACT, "{found:?}");
        assert_eq!(found.y.y, 0.0);
    }
    // At the centre.
    for mapping in [sphere, cylinder, along] {
        assert_eq!((mapping.map)(&at(DVec3::ZERO, dx, dy)), TexturePoint::default());
    }
    // As far away and as near as numbers go.
    for scale in [1e-310, 1e-150, 1e150, 1e300] {
        let [sphere, ..] = mappings(DAffine3::IDENTITY);
        let p = DVec3::new(0.5, 0.25, -0.5);
        let found = (sphere.map)(&at(scale * p, scale * dx, scale * dy));
        let near = (sphere.map)(&at(p, dx, dy));
        let error = (found.st - near.st).length() + (found.derivatives.x - near.derivatives.x).length();
        assert!(error <= if scale < 1e-300 { 1e-12 } else { tol::EXACT }, "{scale:e} {error:e}");
    }
}

#[test]
fn uv_is_scaled_and_moved() {
    let mapping = UvMapping { scale: DVec2::new(2.0, -3.0), offset: DVec2::new(0.5, 0.25) };
    let derivatives = PixelDerivatives { x: DVec2::new(0.1, 0.2), y: DVec2::new(-0.3, 0.4) };
    let found = mapping.map(DVec2::new(1.0, 2.0), &derivatives);
    assert_eq!(found.st, DVec2::new(2.5, -5.75));
    // dsdx = su dudx, dtdx = sv dvdx, and so in y.
    let expected = [DVec2::new(0.2, -3.0 * 0.2), DVec2::new(-0.6, -3.0 * 0.4)];
    assert_eq!([found.derivatives.x, found.derivatives.y], expected);
}

#[test]
fn space_is_transformed() {
    let linear = DMat3::from_cols(DVec3::new(1.0, 2.0, 0.0), DVec3::new(0.0, 1.0, 3.0), DVec3::Z);
    let world_to_texture = DAffine3::from_mat3_translation(linear, DVec3::new(10.0, 20.0, 30.0));
    let at = SpacePoint { point: DVec3::new(1.0, 2.0, 3.0), dx: DVec3::X, dy: DVec3::new(0.0, 1.0, -1.0) };
    let found = SolidMapping { world_to_texture }.map(&at);
    assert_eq!(found.point, DVec3::new(11.0, 24.0, 39.0));
    // Without the translation.
    assert_eq!([found.dx, found.dy], [DVec3::new(1.0, 2.0, 0.0), DVec3::new(0.0, 1.0, 2.0)]);
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 5000, rng_seed: RngSeed::Fixed(8), failure_persistence: None, ..ProptestConfig::default()
    })]

    #[test]
    fn derivatives_are_bounded_whatever_the_numbers(
        v in prop::array::uniform7(any_vector()),
        uv in prop::array::uniform2(any_f64()),
        identity in any::<bool>()
    ) {
        let any = DAffine3::from_mat3_translation(DMat3::from_cols(v[3], v[4], v[5]), v[6]);
        let world_to_texture = if identity { DAffine3::IDENTITY } else { any };
        let at = SpacePoint { point: v[0], dx: v[1], dy: v[2] };
        let bounded =
            |d: &PixelDerivatives| d.x.abs().max(d.y.abs()).max_element() <= MAX_COMPONENT && !d.x.is_nan();
        for mapping in mappings(world_to_texture) {
            let found = (mapping.map)(&at);
            prop_assert!(bounded(&found.derivatives), "{:?}", found);
            prop_assert!(mapping.wraps == [false; 2] || found.st.is_finite(), "{:?}", found);
        }
        let solid = SolidMapping { world_to_texture }.map(&at);
        prop_assert!(solid.dx.is_finite() && solid.dy.is_finite());
        let uv = DVec2::new(uv[0], uv[1]);
        let derivatives = PixelDerivatives { x: uv, y: v[0].truncate() };
        let found = UvMapping { scale: v[1].truncate(), offset: uv }.map(uv, &derivatives);
        prop_assert!(bounded(&found.derivatives));
    }
}
