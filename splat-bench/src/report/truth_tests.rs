use super::*;
use crate::report::metrics::distance;
use glam::DVec3;
use splat_tests::core_scenes::{hard, pinhole, thin_lens};
use splat_tests::scenes::{Surfel, cloud, golden};

/// A disc of radius 1 at depth 2 before a pinhole, in pixels of 1/20: its image has a radius of 10 pixels.
#[test]
fn a_discs_coverage_is_its_area() {
    let options = RenderOptions { filter: PixelFilter::Box, ..hard(1.0, 1) };
    let disc = cloud(&[Surfel::new(DVec3::new(0.03, -0.05, 2.0), DVec3::NEG_Z, 1.0)]);
    let camera = pinhole(32, 32, 20.0);
    let truth = Exact::new(&disc, &camera, &options).truth(32, 1);
    let expected = std::f64::consts::PI * 100.0;
    for filter in FILTERS {
        let area: f64 = truth.of(filter).iter().map(|rgba| rgba[3]).sum();
        // All of it lies well within the frame. The rim crosses some 63 pixels; with 32 x 32 jittered samples each is known
        // to about 32^-1.5, their sum to sqrt(63) times that: 0.044. Five of those.
        assert!((area - expected).abs() < 0.22, "{filter:?}: {area} of {expected}");
    }
    // Inside and outside are exact.
    let at = |x: usize, y: usize| truth.of(PixelFilter::BlackmanHarris)[y * 32 + x][3];
    assert_eq!([at(16, 16), at(1, 1)], [1.0, 0.0]);
}

#[test]
fn a_blurred_disc_keeps_its_area() {
    // Parallel to the picture it is blurred, not scaled, by a circle of confusion of 1/4 |1/2 - 1/1| 20 = 2.5 pixels.
    let options = RenderOptions { filter: PixelFilter::Box, ..hard(1.0, 1) };
    let disc = cloud(&[Surfel::new(DVec3::new(0.03, -0.05, 2.0), DVec3::NEG_Z, 1.0)]);
    let camera = thin_lens(32, 32, 20.0, 0.25, 1.0);
    let truth = Exact::new(&disc, &camera, &options).truth(32, 1);
    let area: f64 = truth.of(PixelFilter::Box).iter().map(|rgba| rgba[3]).sum();
    // Some 300 pixels are partly covered, each known to 1/2 / 32 at worst: sqrt(300) / 64 = 0.27. Four of those.
    let expected = std::f64::consts::PI * 100.0;
    assert!((area - expected).abs() < 1.1, "{area} of {expected}");
}

#[test]
fn densities_are_those_of_the_filters() {
    // Against differences of the cumulative functions, up to a common factor: that of the centre.
    for (index, filter) in FILTERS.into_iter().enumerate().skip(1) {
        let density = |x: f64| {
            let step = 1e-5;
            let inside = |x: f64| x.clamp(-filter.radius(), filter.radius());
            (filter.cumulative(inside(x + step)) - filter.cumulative(inside(x - step))) / (2.0 * step)
        };
        let factor = density(0.0) / densities(0.0)[1][index];
        for x in [-0.45, -0.2, 0.0, 0.1, 0.37] {
            for (i, offset) in [x + 1.0, x, x - 1.0].into_iter().enumerate() {
                let error = factor * densities(x)[i][index] - density(offset);
                assert!(error.abs() < 1e-4, "{filter:?} at {offset}: {error}");
            }
        }
    }
}

#[test]
fn the_renderer_agrees_within_the_error_of_its_samples() {
    let scenes =
        golden().into_iter().filter(|scene| matches!(scene.name, "discs" | "tilted" | "transparency"));
    for mut scene in scenes {
        scene.options.background = None;
        let options =
            RenderOptions { samples: 1024, table: splat_core::TableMode::Quartic8, ..scene.options };
        let rendered = splat_core::render(&scene.cloud, &scene.camera, &options, &mut |_| {}).unwrap();
        let picture: Picture = rendered.film.rgba.iter().map(|rgba| rgba.map(f64::from)).collect();
        let exact = Exact::new(&scene.cloud, &scene.camera, &options);
        // The same samples: nothing but rounding, and the few samples of which it decides.
        let table = SampleTable::new(&options, None, scene.camera.pixel_scale());
        let same = distance(&exact.with_samples_of(&table), &picture);
        assert!(same.rmse < 2e-5, "{}: {same:?}", scene.name);
        // Its own: samples of a standard deviation of at most 1/2, of which random ones would leave 1/2 / sqrt(1024).
        let own = distance(exact.truth(23, 7).of(options.filter), &picture);
        assert!(own.rmse < 0.5 / 32.0 / 3.0, "{}: {own:?}", scene.name);
    }
}

#[test]
fn the_cache_gives_back_what_was_made() {
    let folder = std::env::temp_dir().join(format!("splat-truth-{}", std::process::id()));
    let options = hard(1.0, 1);
    let disc = cloud(&[Surfel::new(DVec3::new(0.0, 0.0, 2.0), DVec3::NEG_Z, 0.5)]);
    let camera = pinhole(8, 6, 10.0);
    let make = |seed| cached(&folder, &disc, &camera, &options, 4, seed).unwrap();
    let first = make(1);
    assert_eq!(first, make(1));
    assert_ne!(first, make(2));
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 2);
    std::fs::remove_dir_all(folder).unwrap();
}
