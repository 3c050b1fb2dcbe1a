//! Pictures, compared.

use crate::common::{fails, message_of, read_png, splat, succeeds};
use serde_json::Value;
use splat_core::{AovSelection, Film, PixelRect};
use splat_io::{ExrOptions, Metadata, PngDepth, read_exr, write_exr, write_png};
use std::fs;
use std::path::Path;

/// A film of 4 x 3 pixels in a frame of 8 x 8, whose corner is at 2, 1.
fn film() -> Film {
    let aovs = AovSelection { depth: true, id: true, ..AovSelection::default() };
    let mut film = Film::new([8, 8], PixelRect::new(2, 1, 6, 4), aovs);
    film.rgba.fill([0.5, 0.25, 0.125, 1.0]);
    film.depth = Some(vec![2.0; 12]);
    film.depth.as_mut().unwrap()[0] = f32::INFINITY;
    film
}

fn write(folder: &Path, name: &str, film: &Film) {
    let path = folder.join(name);
    let options = ExrOptions { full_floats: !name.contains("half"), ..ExrOptions::default() };
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("png") => {
            let depth = if name.contains("16") { PngDepth::Sixteen } else { PngDepth::Eight };
            write_png(&path, film, &Metadata::default(), depth).unwrap();
        }
        _ => write_exr(&path, film, &Metadata::default(), &options).unwrap(),
    }
}

/// What `splat diff --json` says, and its exit code.
fn diff(folder: &Path, arguments: &str) -> (Value, i32) {
    let output = splat(folder, &format!("diff --json {arguments}"));
    let value = serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{}", message_of(&output)));
    (value, output.status.code().unwrap())
}

#[test]
fn numbers_are_those_of_the_definitions() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut other = film();
    write(folder, "a.exr", &film());
    // 6, 2 is the third of its row, the second one.
    other.rgba[4 + 2][1] = 0.35;
    other.rgba[3][3] = f32::from_bits(1f32.to_bits() - 3);
    other.depth.as_mut().unwrap()[5] = 2.5;
    other.id.as_mut().unwrap()[7] = 1;
    write(folder, "b.exr", &other);
    let (found, code) = diff(folder, "a.exr b.exr");
    assert_eq!((code, &found["same"], &found["space"]), (1, &Value::from(false), &Value::from("linear")));
    let color = &found["layers"][0];
    assert_eq!(color["name"], "color");
    assert_eq!(color["max_at"], serde_json::json!([4, 2]));
    assert_eq!(color["max_channel"], "G");
    assert_eq!(color["differing_pixels"], 2);
    let near = |value: &Value, expected: f64| (value.as_f64().unwrap() - expected).abs() < 1e-6 * expected;
    let rmse = 0.1 / 48f64.sqrt();
    assert!(near(&color["max"], 0.1) && near(&color["rmse"], rmse), "{color}");
    assert!(near(&color["psnr"], -20.0 * rmse.log10()), "{color}");
    let ulp = u64::from(0.35f32.to_bits() - 0.25f32.to_bits());
    assert_eq!(color["max_ulp"], ulp);
    assert!(found["flip"].as_f64().unwrap() > 0.0);
    let [depth, id] = [1, 2].map(|index| &found["layers"][index]);
    assert_eq!((&depth["name"], &depth["max"], &depth["max_at"]), (&"Z".into(), &0.5.into(), &[3, 2].into()));
    assert!(near(&depth["rmse"], 0.5 / 12f64.sqrt()), "infinity equals infinity");
    assert_eq!(
        (&id["name"], &id["differing_pixels"], &id["max_ulp"]),
        (&"id".into(), &1.into(), &Value::Null)
    );
    let text = String::from_utf8(splat(folder, "diff a.exr b.exr").stdout).unwrap();
    assert!(text.contains("4,2 G") && text.ends_with("different\n"), "{text}");
}

#[test]
fn exit_codes_follow_the_tolerance() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut other = film();
    other.rgba[0][0] = f32::from_bits(0.5f32.to_bits() + 3);
    write(folder, "a.exr", &film());
    write(folder, "b.exr", &other);
    let cases = [
        ("a.exr a.exr", 0),
        ("a.exr b.exr", 1),
        ("a.exr b.exr --ulp 3", 0),
        ("a.exr b.exr --ulp 2", 1),
        ("a.exr b.exr --max 1e-6", 0),
        ("a.exr b.exr --max 1e-7", 1),
        ("a.exr b.exr --rmse 1e-7", 0),
        ("a.exr b.exr --rmse 1e-9", 1),
        ("a.exr b.exr --flip 0.01", 0),
        ("a.exr b.exr --flip 0.01 --ulp 1", 1),
        ("a.exr b.exr --channels G,Z", 0),
        ("a.exr b.exr --channels color", 1),
        ("a.exr b.exr --channels none", 2),
        ("a.exr missing.exr", 2),
        ("a.exr a.jpg", 2),
        ("a.exr", 2),
        ("a.exr b.exr --max -1", 2),
        ("a.exr b.exr -o a.exr", 2),
        ("a.exr b.exr --channels Z --flip 1", 2),
        ("a.exr b.exr --channels Z -o x.png", 2),
    ];
    for (arguments, code) in cases {
        let output = splat(folder, &format!("diff --quiet {arguments}"));
        assert_eq!(output.status.code(), Some(code), "{arguments}: {}", message_of(&output));
        assert!(output.stdout.is_empty());
        assert_eq!(code == 2, !output.stderr.is_empty(), "{arguments}");
    }
    // Zeros of two signs are equal numbers of different bits.
    other = film();
    other.rgba[0][0] = 0.0;
    write(folder, "plus.exr", &other);
    other.rgba[0][0] = -0.0;
    write(folder, "minus.exr", &other);
    fails(folder, "diff plus.exr minus.exr", 1);
    succeeds(folder, "diff plus.exr minus.exr --ulp 0");
}

#[test]
fn what_cannot_be_compared_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(folder, "a.exr", &film());
    write(folder, "small.exr", &film().part(PixelRect::new(2, 1, 6, 3)));
    let moved = Film { window: PixelRect::new(3, 1, 7, 4), ..film() };
    write(folder, "moved.exr", &moved);
    let message = fails(folder, "diff a.exr small.exr", 2);
    assert!(message.contains("4x3 pixels") && message.contains("4x2"), "{message}");
    let message = fails(folder, "diff a.exr moved.exr", 2);
    assert!(message.contains("from 2,1 on") && message.contains("3,1"), "{message}");
    let message = fails(folder, "diff a.exr a.exr --channels R,Q", 2);
    assert!(message.contains("--channels Q: ") && message.contains("no such channel in common"), "{message}");
    let bytes = fs::read(folder.join("a.exr")).unwrap();
    for length in [0, 3, 100, bytes.len() / 2, bytes.len() - 1] {
        fs::write(folder.join("broken.exr"), &bytes[..length]).unwrap();
        fails(folder, "diff a.exr broken.exr", 2);
    }
    fs::write(folder.join("a.png"), &bytes).unwrap();
    let message = fails(folder, "diff a.exr a.png", 2);
    assert!(message.contains("no PNG image"), "{message}");
}

#[test]
fn an_exr_file_is_compared_as_the_png_file_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut film = film();
    film.rgba[1] = [0.1, 0.2, 0.05, 0.3];
    film.rgba[2] = [3.0, -1.0, f32::NAN, 1.0];
    for name in ["a.exr", "a.png", "a16.png"] {
        write(folder, name, &film);
    }
    let (found, code) = diff(folder, "a.exr a.png");
    assert_eq!((code, &found["space"]), (0, &Value::from("display")));
    assert_eq!(diff(folder, "a16.png a.exr").1, 0);
    let (found, code) = diff(folder, "a.png a16.png");
    assert_eq!(code, 1);
    let max = found["layers"][0]["max"].as_f64().unwrap();
    assert!(0.0 < max && max <= 0.5 / 255.0 + 1e-9, "{max}");
    film.rgba[5][0] = 0.6;
    write(folder, "b.png", &film);
    let (found, code) = diff(folder, "a.exr b.png");
    let level = |x: f64| (splat_core::srgb::encode(x) * 255.0).round();
    let expected = (level(0.6) - level(0.5)) / 255.0;
    assert!((found["layers"][0]["max"].as_f64().unwrap() - expected).abs() < 1e-12 && code == 1);
    // Without colours there is nothing that a PNG file has.
    succeeds(folder, "diff a.exr a.exr --channels Z -o depth.exr --quiet");
    fails(folder, "diff depth.exr a.png", 2);
}

#[test]
fn channels_that_one_has_alone_are_named_and_types_may_differ() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(folder, "a.exr", &film());
    write(folder, "half.exr", &Film { id: None, ..film() });
    let (found, code) = diff(folder, "a.exr half.exr");
    // These values are the same as 16-bit floats.
    assert_eq!(code, 0, "{found}");
    assert_eq!(found["only_in_a"], serde_json::json!(["id"]));
    assert_eq!(found["layers"][0]["max_ulp"], Value::Null);
    let text = String::from_utf8(splat(folder, "diff half.exr a.exr").stdout).unwrap();
    assert!(text.contains("only in a.exr: id"), "{text}");
}

#[test]
fn the_differences_become_a_picture() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut other = film();
    other.rgba[6] = [0.0, 1.0, 0.0, 1.0];
    write(folder, "a.exr", &film());
    write(folder, "b.exr", &other);
    fails(folder, "diff a.exr b.exr --quiet -o map.png", 1);
    let map = read_png(&folder.join("map.png"));
    assert_eq!(map.size, [4, 3]);
    let light = |pixel: [u8; 4]| pixel[..3].iter().map(|&level| u32::from(level)).sum::<u32>();
    assert!(map.pixels.iter().all(|&pixel| pixel[3] == 255 && light(pixel) <= light(map.pixels[6])));
    fails(folder, "diff a.exr b.exr --quiet -o map.exr", 1);
    let map = read_exr(&folder.join("map.exr")).unwrap();
    assert_eq!(map.window, film().window);
    assert_eq!(map.channel("G").unwrap().get(6), 0.75);
    assert_eq!(map.channel("G").unwrap().get(5), 0.0);
    assert!(map.channel("flip").unwrap().get(6) > 0.1);
    succeeds(folder, "diff a.exr a.exr --quiet -o same.png");
    assert!(read_png(&folder.join("same.png")).pixels.iter().all(|&pixel| light(pixel) < 10));
}
