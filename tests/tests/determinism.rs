//! A picture depends on its scene alone: not on threads, tiles, memory, crops, instructions, the core, or the order of the
//! points. Each combination is told by one hash over every bit of every channel.
//!
//! The hashes are kept in `tests/golden/hashes.txt`, so that another machine, system or architecture is held to them too.
//! `SPLAT_ACCEPT=1 cargo test -p splat-tests --test determinism` keeps those of what is drawn now.

#![expect(clippy::print_stdout, reason = "what is measured, for whoever asks for it")]

use splat_core::film::NO_ID;
use splat_core::{Film, PixelRect, RenderOptions};
use splat_simd::{Level, Method, Renderer};
use splat_tests::analytic::{picture, rendered};
use splat_tests::hashes::{ACCEPT, accepts, film_hash};
use splat_tests::random::Random;
use splat_tests::scenes::{Scene, permuted};
use splat_tests::varied_scenes::{SIZE, Varied, all};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::ops::Range;
use std::path::Path;

/// What is tried for every scene, at least, and how many scenes there are.
const LEAST: [usize; 2] = [200, 12];

/// Memory for the fragments of a tile: of all, of some, and of a pixel.
const TILE_MEMORY: [usize; 3] = [64 << 20, 20_000, 1];

/// Parts of the frame: one that tiles cut, one at the edge, and a pixel at the corner of four tiles.
const WINDOWS: [PixelRect; 3] =
    [PixelRect::new(13, 7, 51, 40), PixelRect::new(31, 33, 70, 50), PixelRect::new(32, 31, 33, 32)];

/// A way to draw a scene.
#[derive(Debug, Clone)]
struct Way {
    threads: usize,
    level: Level,
    tile_memory: usize,
    window: Option<PixelRect>,
    samples: Option<Range<u32>>,
    /// Seed of the order of the points.
    order: Option<u64>,
}

/// Every way that a scene is drawn.
fn ways(samples: u32) -> Vec<Way> {
    let levels = Level::available();
    let whole = |number: usize| Way {
        threads: number % 16 + 1,
        level: levels[number % levels.len()],
        tile_memory: TILE_MEMORY[number % 2],
        window: None,
        samples: None,
        order: None,
    };
    // One to sixteen threads, and each level alone with each memory.
    let mut ways: Vec<Way> = (0..16).map(whole).collect();
    for &level in &levels {
        ways.extend(TILE_MEMORY.map(|tile_memory| Way { level, tile_memory, ..whole(2) }));
    }
    let windows = WINDOWS.into_iter().enumerate();
    ways.extend(windows.map(|(i, window)| Way { window: Some(window), ..whole(i + 1) }));
    let ranges = [0..1, samples / 2..samples].into_iter().enumerate();
    ways.extend(ranges.map(|(i, range)| Way { samples: Some(range), ..whole(i + 4) }));
    ways.extend([1, 2].map(|seed| Way { order: Some(seed), ..whole(seed as usize) }));
    ways.push(Way { window: Some(WINDOWS[0]), samples: Some(1..samples), order: Some(3), ..whole(6) });
    ways
}

/// A random order of the splats, each within its run.
fn shuffled(runs: &[usize], seed: u64) -> Vec<usize> {
    let mut random = Random::new(seed);
    let mut order: Vec<usize> = Vec::new();
    for &count in runs {
        let start = order.len();
        order.extend(start..start + count);
        random.shuffle(&mut order[start..]);
    }
    order
}

/// The options of a scene for a part of the picture.
fn part(scene: &Scene, window: Option<PixelRect>, samples: Option<Range<u32>>) -> RenderOptions {
    RenderOptions { window, sample_range: samples, ..scene.options.clone() }
}

/// The hash of what the fast core draws in some way.
fn drawn(Varied { scene, runs, .. }: &Varied, way: &Way) -> u64 {
    let mut renderer = Renderer::new(way.threads, way.level).unwrap();
    let options =
        RenderOptions { tile_memory: way.tile_memory, ..part(scene, way.window, way.samples.clone()) };
    let Some(seed) = way.order else {
        return film_hash(&renderer.render(&scene.cloud, &scene.camera, &options, &mut |_| {}).unwrap().film);
    };
    let order = shuffled(runs, seed);
    let cloud = permuted(&scene.cloud, &order);
    let mut film = renderer.render(&cloud, &scene.camera, &options, &mut |_| {}).unwrap().film;
    // The id is the place in the cloud: new point i was `order[i]`.
    for id in film.id.iter_mut().flatten().filter(|id| **id != NO_ID) {
        *id = order[*id as usize] as u32;
    }
    film_hash(&film)
}

/// The whole picture by the fast core as anyone has it: portable, on one thread.
fn fast(scene: &Scene, samples: Option<Range<u32>>) -> Film {
    let mut renderer = Renderer::new(1, Level::Portable).unwrap();
    let options = part(scene, None, samples);
    renderer.render(&scene.cloud, &scene.camera, &options, &mut |_| {}).unwrap().film
}

#[test]
fn a_picture_depends_on_its_scene_alone() {
    let mut counts = BTreeMap::<&str, usize>::new();
    let scenes = all();
    for varied in &scenes {
        let scene = &varied.scene;
        // The picture of each range of samples: the reference's, but where images are looked up by pixel.
        let of_range = |samples: Option<Range<u32>>| match varied.looks_up {
            true => fast(scene, samples),
            false => picture(&scene.cloud, &scene.camera, &part(scene, None, samples)),
        };
        let mut expected = BTreeMap::<Option<(u32, u32)>, Film>::new();
        for way in ways(scene.options.samples) {
            let range = way.samples.clone();
            let film = expected
                .entry(range.clone().map(|range| (range.start, range.end)))
                .or_insert_with(|| of_range(range));
            let hash = film_hash(&way.window.map_or_else(|| film.clone(), |window| film.part(window)));
            assert_eq!(drawn(varied, &way), hash, "{}: {way:?}", scene.name);
            *counts.entry(way.level.name()).or_default() += 1;
        }
        // The reference itself, whose tiles are split and cut as well.
        for (window, tile_memory) in [(None, 1), (Some(WINDOWS[0]), 20_000)] {
            let whole = picture(&scene.cloud, &scene.camera, &scene.options);
            let hash = film_hash(&window.map_or_else(|| whole.clone(), |window| whole.part(window)));
            let options = RenderOptions { tile_memory, ..part(scene, window, None) };
            let found = film_hash(&picture(&scene.cloud, &scene.camera, &options));
            assert_eq!(found, hash, "{}: reference, {window:?}", scene.name);
            *counts.entry("reference").or_default() += 1;
        }
    }
    let combinations: usize = counts.values().sum();
    println!("{combinations} combinations over {} scenes: {counts:?}", scenes.len());
    assert!(combinations >= LEAST[0] && scenes.len() >= LEAST[1], "{counts:?}");
}

#[test]
fn every_machine_draws_the_same_hashes() {
    let mut found = String::from("# scene, hash of the reference's picture, hash of the fast core's\n");
    for Varied { scene, .. } in all() {
        let reference = film_hash(&picture(&scene.cloud, &scene.camera, &scene.options));
        writeln!(found, "{} {reference:016x} {:016x}", scene.name, film_hash(&fast(&scene, None))).unwrap();
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden/hashes.txt");
    if accepts() {
        std::fs::write(&path, found).unwrap();
        return;
    }
    let expected = std::fs::read_to_string(&path).unwrap_or_default();
    let hint = format!("if it is right, run the test again with {ACCEPT}=1 and commit {}", path.display());
    assert_eq!(found, expected, "{hint}");
}

#[test]
fn the_scenes_are_worth_it() {
    for Varied { scene, looks_up, runs } in all() {
        let name = scene.name;
        let reference = rendered(&scene.cloud, &scene.camera, &scene.options);
        assert_eq!([reference.film.width(), reference.film.height()], SIZE.map(|side| side as usize));
        assert_eq!(runs.iter().sum::<usize>(), scene.cloud.len(), "{name}");
        let colors: std::collections::BTreeSet<_> =
            reference.film.rgba.iter().map(|pixel| pixel.map(f32::to_bits)).collect();
        assert!(colors.len() > 800, "{name}: {} colours", colors.len());
        // Where images are looked up by pixel, the cores do differ.
        assert_eq!(film_hash(&reference.film) != film_hash(&fast(&scene, None)), looks_up, "{name}");
        // Less memory splits tiles.
        let mut options = RenderOptions { tile_memory: TILE_MEMORY[1], ..scene.options.clone() };
        let mut renderer = Renderer::new(1, Level::Portable).unwrap();
        let split = renderer.render(&scene.cloud, &scene.camera, &options, &mut |_| {}).unwrap();
        options.tile_memory = TILE_MEMORY[0];
        let whole = renderer.render(&scene.cloud, &scene.camera, &options, &mut |_| {}).unwrap();
        let fragments = whole.statistics.fragments as usize * splat_abuffer::TileBuffer::BYTES_PER_FRAGMENT;
        assert!(fragments > 6 * TILE_MEMORY[1], "{name}: {fragments} bytes of fragments in 6 tiles");
        assert_eq!(split.statistics.fragments, whole.statistics.fragments, "{name}");
        // Large blurs are drawn by lens points, and nothing else is.
        let level = Level::Portable;
        let mut ignore = |_, _, _| {};
        let by_pixels =
            splat_simd::fragments(&scene.cloud, &scene.camera, &options, level, Method::Pixels, &mut ignore);
        let by_lens_points = whole.statistics.tests < by_pixels.unwrap();
        println!("{name}: {} fragments, by lens points: {by_lens_points}", whole.statistics.fragments);
        if name == "large_blur" {
            assert!(by_lens_points, "{name}");
        }
    }
}
