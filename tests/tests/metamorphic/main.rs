//! Metamorphic tests: what becomes of a picture when its scene is changed in a way of which the effect is known, whatever the
//! scene. Relations hold to the bit ([`exact`]), within a bound ([`bounded`]), or in the mean over seeds ([`statistical`]).
//!
//! `SPLAT_CASES=N` tries N times as many scenes.

#![expect(clippy::print_stdout, reason = "what is measured, for whoever asks for it")]

mod bounded;
mod exact;
mod statistical;

use glam::{DMat4, DVec3};
use proptest::prelude::*;
use splat_abuffer::Resolve;
use splat_core::{AovSelection, Camera, Cloud, Kernel, Lens, RenderOptions};
use splat_tests::random::Random;
use splat_tests::scenes::{OPAQUE, Scene, jumble, orthographic, pinhole, soft, with_lens};

/// Where the eye of [`scene`] is: not at zero, and exact in sums.
const EYE: DVec3 = DVec3::new(0.5, -0.25, 0.125);

/// A small picture of 50 splats by any kind of camera, blended in any way, with every AOV. The camera's axes are the
/// world's.
fn scene() -> impl Strategy<Value = Scene> {
    let lens = (0.02..0.3, prop_oneof![1.0..6.0, Just(f64::INFINITY)], prop_oneof![Just(0u32), 5u32..7])
        .prop_map(|(radius, focus, blades)| Lens { radius, focus, blades });
    let camera = prop_oneof![
        Just(pinhole(48, 36, 40.0)),
        Just(orthographic(48, 36, 8.0)),
        lens.prop_map(|lens| with_lens(pinhole(48, 36, 40.0), lens)),
    ];
    let resolve = prop_oneof![Just(OPAQUE), Just(soft(1.0)), Just(Resolve::Over)];
    let kernel = prop_oneof![Just((Kernel::Windowed, 4.0)), Just((Kernel::Gaussian, 9.0))];
    let cloud = (0u64..1_000_000, any::<bool>(), any::<bool>(), any::<bool>());
    (cloud, camera, resolve, kernel, 1u32..6).prop_map(
        |(cloud, camera, resolve, (kernel, cutoff), samples)| {
            let aovs = AovSelection::ALL;
            let background = Some([0.25, 0.5, 0.125, 0.5]);
            Scene {
                name: "any",
                cloud: cloud_of(cloud),
                camera: Camera { world_to_camera: DMat4::from_translation(-EYE), ..camera },
                options: RenderOptions {
                    samples,
                    resolve,
                    kernel,
                    cutoff,
                    aovs,
                    background,
                    ..RenderOptions::default()
                },
            }
        },
    )
}

/// Splats before the eye: opaque or not, oriented or not, with areas or without. They are ellipses, so that their axes are
/// the caller's.
fn cloud_of((seed, opaque, oriented, areas): (u64, bool, bool, bool)) -> Cloud {
    let mut cloud = jumble(50, 0.06, seed);
    cloud.make_elliptical();
    cloud.oriented = oriented;
    if opaque {
        cloud.opacities = None;
    }
    if areas {
        cloud.areas = Some(random_areas(&cloud, seed));
    }
    cloud
}

/// Areas of splats of [`cloud_of`], so that one alone covers up to three times what it must.
fn random_areas(cloud: &Cloud, seed: u64) -> Vec<f32> {
    let mut random = Random::new(seed);
    let splat_core::Shapes::Ellipses(axes) = &cloud.shapes else { panic!("ellipses") };
    axes.iter().map(|[t1, t2]| t1.cross(*t2).length() * random.range(0.3, 3.0) as f32).collect()
}
