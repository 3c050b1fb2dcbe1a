//! Pictures that must stay what they are, bit for bit, on any machine and in any profile.
//!
//! A mismatch says which rows differ and by how much in the mean, and writes the new picture to Cargo's
//! folder for the temporary files of tests. `SPLAT_ACCEPT=1 cargo test -p splat-tests --test golden` accepts
//! what is drawn now.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use splat_core::{Film, PixelRect, RenderOptions, render};
use splat_io::{Metadata, PngDepth, write_png};
use splat_tests::hashes::{ACCEPT, accepts, fnv};
use splat_tests::scenes::{self, GOLDEN_SIZE, Scene};

fn draw(scene: &Scene) -> Film {
    render(&scene.cloud, &scene.camera, &scene.options, &mut |_| {}).expect("a valid scene").film
}

/// One line a row: its number, the hash of its numbers, and the mean of each channel.
fn summary(film: &Film) -> String {
    let mut text = String::from("# row, FNV-1a of its rgba bits, mean red, green, blue, alpha\n");
    for (number, row) in film.rgba.chunks(film.width()).enumerate() {
        let mean = [0, 1, 2, 3]
            .map(|i| row.iter().map(|pixel| f64::from(pixel[i])).sum::<f64>() / film.width() as f64);
        let [red, green, blue, alpha] = mean;
        let hash = fnv(row.iter().flatten().map(|value| value.to_bits()));
        writeln!(text, "{number} {hash:016x} {red:.5} {green:.5} {blue:.5} {alpha:.5}")
            .expect("a string grows");
    }
    text
}

/// What differs between two summaries, or `None`.
fn difference(expected: &str, found: &str) -> Option<String> {
    let lines = |text: &str| -> Vec<String> {
        text.lines().filter(|line| !line.starts_with('#')).map(str::to_owned).collect()
    };
    let (expected, found) = (lines(expected), lines(found));
    if expected.len() != found.len() {
        return Some(format!("{} rows, expected {}", found.len(), expected.len()));
    }
    let mut text = String::new();
    for (expected, found) in expected.iter().zip(&found).filter(|(expected, found)| expected != found) {
        writeln!(text, "  expected row {expected}\n  found    row {found}").expect("a string grows");
    }
    (!text.is_empty()).then_some(text)
}

fn golden_path(scene: &Scene) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("golden").join(scene.name).with_extension("txt")
}

fn assert_golden(name: &str) {
    let scenes = scenes::golden();
    let scene = scenes.iter().find(|scene| scene.name == name).expect("a scene of this name");
    let film = draw(scene);
    let found = summary(&film);
    let path = golden_path(scene);
    if accepts() {
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("the folder can be made");
        std::fs::write(&path, found).expect("the golden file can be written");
        return;
    }
    let expected = std::fs::read_to_string(&path).unwrap_or_default();
    if let Some(difference) = difference(&expected, &found) {
        let picture = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("golden-{name}.png"));
        let written = match write_png(&picture, &film, &Metadata::default(), PngDepth::Eight) {
            Ok(()) => format!("the picture drawn now is {}", picture.display()),
            Err(error) => format!("the picture drawn now could not be written: {error}"),
        };
        panic!(
            "{name} is not what {} says:\n{difference}{written}\n\
             if it is right, run the test again with {ACCEPT}=1 and commit that file",
            path.display()
        );
    }
}

#[test]
fn discs() {
    assert_golden("discs");
}

#[test]
fn lens() {
    assert_golden("lens");
}

#[test]
fn tilted() {
    assert_golden("tilted");
}

#[test]
fn over() {
    assert_golden("over");
}

#[test]
fn transparency() {
    assert_golden("transparency");
}

#[test]
fn every_golden_scene_has_a_picture_worth_keeping() {
    let scenes = scenes::golden();
    assert_eq!(scenes.len(), 5, "a test for each scene of the list");
    for scene in scenes {
        let film = draw(&scene);
        assert_eq!([film.width(), film.height()], GOLDEN_SIZE.map(|side| side as usize), "{}", scene.name);
        let colors: std::collections::BTreeSet<[u32; 4]> =
            film.rgba.iter().map(|pixel| pixel.map(f32::to_bits)).collect();
        assert!(colors.len() > 500, "{}: {} colours", scene.name, colors.len());
        assert!(film.rgba.iter().flatten().all(|value| value.is_finite()), "{}", scene.name);
    }
}

#[test]
fn a_changed_bit_is_found_in_its_row() {
    let film = Film::new([4, 3], PixelRect::new(0, 0, 4, 3), RenderOptions::default().aovs);
    let mut other = film.clone();
    // -0 is another number than 0 here.
    other.rgba[6][2] = -0.0;
    let [before, after] = [&film, &other].map(summary);
    assert_eq!(difference(&before, &before), None);
    let text = difference(&before, &after).expect("a difference");
    assert_eq!(text.lines().count(), 2, "{text}");
    assert!(text.lines().all(|line| line.contains("row 1 ")), "{text}");
    assert_eq!(difference("", &before).as_deref(), Some("3 rows, expected 0"));
}
