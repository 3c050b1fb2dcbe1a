//! What is seen and what is left out: facings, near and far, clip planes.

use glam::{DMat4, DQuat, DVec3, DVec4};
use splat_core::film::NO_ID;
use splat_core::{AovSelection, Camera, Cloud, Lens, RenderOptions, Rendered};
use splat_tests::analytic::{
    Plane, alphas, assert_same_bits, picture, pixels, rendered, sample_positions, sample_table, tilted_plane,
    wall,
};
use splat_tests::scenes::{Surfel, cloud, hard_discs, orthographic, permuted, pinhole, with_lens};
use splat_tests::tolerances as tol;

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
    let options = RenderOptions { aovs: AovSelection::ALL, ..hard_discs(4) };
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
        let ids = RenderOptions { aovs: AovSelection::ALL, ..options.clone() };
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
