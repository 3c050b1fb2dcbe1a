//! Cameras from outside: formats, frames, turntables and prints to scale.

use super::common::{Png, fails, message_of, read_png, real_files, splat, succeeds};
use glam::DVec3;
use splat_core::{Cloud, Shapes};
use splat_io::{PlyEncoding, write_ply};
use std::fs;
use std::path::{Path, PathBuf};

/// Discs of radius .02 (sigma .01) in planes of constant z, each with a colour.
fn discs(points: &[(DVec3, [f32; 3])]) -> Cloud {
    let mut cloud = Cloud::from_points(&points.iter().map(|&(point, _)| point).collect::<Vec<_>>());
    cloud.normals = vec![glam::Vec3::Z; points.len()];
    cloud.colors = Some(points.iter().map(|&(_, color)| color.into()).collect());
    cloud.shapes = Shapes::Discs(vec![0.01; points.len()]);
    cloud.oriented = true;
    cloud
}

const RED: [f32; 3] = [1.0, 0.0, 0.0];
const BLUE: [f32; 3] = [0.0, 0.0, 1.0];

#[test]
fn a_print_is_to_scale_and_says_its_resolution() {
    let folder = tempfile::tempdir().unwrap();
    // Map coordinates, z up: the blue point is 10 m east and 5 m north of the red one.
    let red = DVec3::new(500_000.0, 5_000_000.0, 80.0);
    let cloud = discs(&[(red, RED), (red + DVec3::new(10.0, 5.0, 3.0), BLUE)]);
    write_ply(&folder.path().join("in.ply"), &cloud, PlyEncoding::Binary).unwrap();
    let line =
        "render in.ply -o map.png --ortho top --spp 256 --shading color --kernel disc --coverage opaque";
    let said = message_of(&succeeds(folder.path(), &format!("{line} --scale 1:200 --dpi 254")));
    // A pixel is 200 * 0.0254 / 254 = 0.02 m; the picture holds both discs.
    assert!(said.contains("1:200 at 254 dpi: 506x256 pixels, 51 x 26 mm; a pixel is 0.020000 m"), "{said}");
    let map = read_png(&folder.path().join("map.png"));
    assert_eq!((map.size, map.density), ([506, 256], Some((10_000, 10_000))));
    let middle = |channel: usize| {
        let is_of = |pixel: &[u8; 4]| pixel[3] > 0 && pixel[channel] > 0;
        let places = map.pixels.iter().enumerate().filter(|(_, pixel)| is_of(pixel));
        let weighted = places.map(|(index, pixel)| {
            let place =
                [index as u32 % map.size[0], index as u32 / map.size[0]].map(|place| f64::from(place) + 0.5);
            (glam::DVec2::from_array(place), f64::from(pixel[3]))
        });
        let (sum, weight) = weighted.fold((glam::DVec2::ZERO, 0.0), |(sum, total), (place, weight)| {
            (sum + weight * place, total + weight)
        });
        sum / weight
    };
    let (red, blue) = (middle(0), middle(2));
    // 10 m are 500 pixels, 5 m are 250; east is right and north is up. By 800 samples of a scatter of one pixel, at most:
    assert!((blue - red - glam::DVec2::new(500.0, -250.0)).abs().max_element() < 0.1, "{red} {blue}");
    // Pixels begin at multiples of their size from zero: the red point, on a corner of four pixels, is one pixel and two of
    // margin from the edge.
    assert!((red - glam::DVec2::new(3.0, 253.0)).abs().max_element() < 0.1, "{red}");

    // The unit of the scene changes the number of pixels, and nothing else.
    let said = message_of(&succeeds(folder.path(), &format!("{line} --scale 1:200 --dpi 254 --unit cm")));
    assert!(said.contains(" 11x8 pixels"), "{said}");
    let message = fails(folder.path(), &format!("{line} --scale 1:1"), 2);
    assert!(message.contains("beyond the limit of 65536 a side"), "{message}");
    assert!(message.contains("take --scale 1:6 or --dpi 58 ("), "{message}");
    let message = fails(folder.path(), &format!("{line} --scale 1:5"), 2);
    assert!(message.contains("beyond the limit of 268435456 in all"), "{message}");
    succeeds(folder.path(), &format!("{line} --scale 1:5 --crop 0,0,8,8"));
    assert_eq!(read_png(&folder.path().join("map.png")).size, [8, 8]);

    // Without a scale the picture fits, and --dpi only says how it is to be printed.
    succeeds(folder.path(), "render in.ply -o fit.png --ortho --view top --size 64x48 --spp 1 --dpi 72");
    let fit = read_png(&folder.path().join("fit.png"));
    assert_eq!((fit.size, fit.density), ([64, 48], Some((2835, 2835))));
}

#[test]
fn a_turntable_numbers_its_pictures_and_parts_are_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let points = [(DVec3::ZERO, RED), (DVec3::X, BLUE), (DVec3::new(0.5, 0.3, -1.0), RED)];
    write_ply(&folder.path().join("in.ply"), &discs(&points), PlyEncoding::Binary).unwrap();
    let line = "render in.ply -o t.png --turntable 4 --size 64x48 --spp 4 --stats stats.json --progress json";
    let said = message_of(&succeeds(folder.path(), line));
    assert!(said.contains(r#""frame":3,"frames":4}"#), "{said}");
    let names: Vec<String> = (1..=4).map(|number| format!("t-000{number}.png")).collect();
    let all: Vec<Vec<u8>> = names.iter().map(|name| fs::read(folder.path().join(name)).unwrap()).collect();
    assert_ne!(all[0], all[1]);
    let stats = fs::read(folder.path().join("stats.json")).unwrap();
    let stats: serde_json::Value = serde_json::from_slice(&stats).unwrap();
    assert_eq!(stats.as_array().unwrap().len(), 4);
    for name in &names {
        fs::remove_file(folder.path().join(name)).unwrap();
    }
    // The first is what a view of the same direction shows of the same distance: a part of a turntable is a part of it.
    succeeds(folder.path(), &format!("{line} --frames 2-4x2"));
    assert!(!folder.path().join(&names[0]).exists() && !folder.path().join(&names[2]).exists());
    for index in [1, 3] {
        assert_eq!(fs::read(folder.path().join(&names[index])).unwrap(), all[index]);
    }
}

/// A COLMAP model of two cameras 4 units before the origin and beside it, as text.
fn write_model(folder: &Path) {
    fs::create_dir_all(folder).unwrap();
    fs::write(folder.join("cameras.txt"), "1 PINHOLE 64 48 60 60 32 24\n").unwrap();
    fs::write(
        folder.join("images.txt"),
        "1 1 0 0 0 0 0 4 1 left/a.jpg\n\n2 1 0 0 0 -0.5 0 4 1 right/b.jpg\n\n",
    )
    .unwrap();
    fs::write(folder.join("points3D.txt"), "1 0 0 0 255 0 0 0\n2 1 0 0 0 0 255 0\n3 0 1 0 9 9 9 0\n")
        .unwrap();
}

#[test]
fn one_run_draws_all_cameras_of_a_model() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    write_model(&at("model/sparse/0"));
    let line = "render model --camera model --spp 4";
    let message = fails(folder.path(), &format!("{line} -o out.png"), 2);
    assert!(message.contains("2 cameras (left/a.jpg, right/b.jpg): choose with --camera-name"), "{message}");
    succeeds(folder.path(), &format!("{line} -o {{name}}.png"));
    let [a, b] = ["a.png", "b.png"].map(|name| fs::read(at(name)).unwrap());
    assert_ne!(a, b);
    succeeds(folder.path(), &format!("{line} -o one.png --camera-name b"));
    assert_eq!(fs::read(at("one.png")).unwrap(), b);
    succeeds(folder.path(), &format!("{line} -o two-##.png --frames 2"));
    assert_eq!(fs::read(at("two-02.png")).unwrap(), b);
    succeeds(folder.path(), &format!("{line} -o large.png --frames 1 --size 128x96"));
    assert_eq!(read_png(&at("large.png")).size, [128, 96]);
    let message = fails(folder.path(), &format!("{line} -o large.png --frames 1 --size 128x90"), 2);
    assert!(message.contains("has not the shape of the camera's picture, 64x48: 128x96 would"), "{message}");
    let info = splat(folder.path(), "info model");
    let info = String::from_utf8(info.stdout).unwrap();
    assert!(
        info.contains("format         COLMAP, text\ncameras        2\n") && info.contains("right/b.jpg"),
        "{info}"
    );
    let json = splat(folder.path(), "info --json model").stdout;
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    assert_eq!(json["cameras"][1]["eye"], serde_json::json!([0.5, 0.0, -4.0]));
    assert_eq!(json["cameras"][1]["frame"], 2);
}

#[test]
fn every_real_camera_file_draws_and_text_is_binary() {
    let Some(data) = real_files() else { return };
    let folder = tempfile::tempdir().unwrap();
    let cameras = data.join("cameras");
    let render = |input: &Path, camera: &str, options: &str| {
        let (input, camera) = (input.display(), cameras.join(camera));
        let line =
            format!("render {input} --camera {} -o {{name}}-##.png --spp 2 {options}", camera.display());
        succeeds(folder.path(), &line);
        let mut files: Vec<PathBuf> =
            fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path()).collect();
        files.sort();
        let pictures: Vec<Png> = files.iter().map(|path| read_png(path)).collect();
        files.iter().for_each(|path| fs::remove_file(path).unwrap());
        pictures
    };
    let [text, binary] =
        ["garden_colmap_text", "garden_colmap_bin"].map(|name| render(&cameras.join(name), name, ""));
    assert_eq!(text.len(), 3);
    for (text, binary) in text.iter().zip(&binary) {
        assert_eq!(text.size, [648, 420]);
        assert!(text.pixels == binary.pixels, "the pictures differ");
        let covered = text.pixels.iter().filter(|pixel| pixel[3] == 255).count();
        assert!(covered > text.pixels.len() / 2, "{covered} pixels");
    }
    let bunny = data.join("surfels/bunny_npm_surfels.ply");
    for (name, options, count) in [
        ("brush_transforms.json", "", 1),
        ("lego_transforms_train.json", "", 1),
        ("open3d_camera.json", "", 1),
        ("open3d_camera_trajectory.json", "--frames 1-31x15 --size 320x180", 3),
        ("open3d_trajectory.log", "--size 320x240", 5),
    ] {
        assert_eq!(render(&bunny, name, options).len(), count, "{name}");
    }
    let intrinsic = cameras.join("open3d_camera.json");
    let options = format!("--intrinsic {}", intrinsic.display());
    assert_eq!(render(&bunny, "open3d_trajectory.log", &options)[0].size, [640, 480]);
}
