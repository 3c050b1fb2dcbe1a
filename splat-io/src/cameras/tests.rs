//! The formats against each other, damage, and real files where `SPLAT_TEST_DATA` names a folder that has them.

use super::*;
use glam::{DQuat, DVec4};
use proptest::prelude::*;
use std::fs;

const NEAR: f64 = 0.25;

fn read(path: &Path) -> Result<CameraSet, Error> {
    read_cameras(path, NEAR)
}

/// Reads a file of this text.
fn parse(name: &str, text: &str) -> Result<CameraSet, Error> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join(name), text).unwrap();
    read(&folder.path().join(name))
}

fn message(name: &str, text: &str) -> String {
    parse(name, text).unwrap_err().to_string()
}

/// A quaternion, x y z w, and a translation, world to camera.
fn pose() -> (DQuat, DVec3) {
    (DQuat::from_xyzw(0.5, -0.1, 0.3, 0.8).normalize(), DVec3::new(1.5, -2.0, 7.25))
}

/// The camera of that pose, as every format that holds it must give it.
fn expected() -> Camera {
    let (rotation, translation) = pose();
    Camera {
        width: 640,
        height: 480,
        projection: Projection::Perspective { focal_length: DVec2::new(500.0, 510.0), lens: None },
        principal_point: DVec2::new(321.5, 238.5),
        world_to_camera: DMat4::from_rotation_translation(rotation, translation),
        near: NEAR,
        far: f64::INFINITY,
        clip_planes: Vec::new(),
        distortion: None,
    }
}

/// Checks that a set is the one camera of [`expected`], but for the rounding of inverses.
fn assert_expected(set: &CameraSet, name: &str) {
    let [NamedCamera { name: found, camera }] = set.cameras.as_slice() else { panic!("{set:?}") };
    assert_eq!(found, name);
    let expected = expected();
    assert!(camera.world_to_camera.abs_diff_eq(expected.world_to_camera, 1e-14), "{camera:?}");
    assert_eq!(*camera, Camera { world_to_camera: camera.world_to_camera, ..expected });
}

/// Rows of the camera-to-world matrix, the camera's axes changed by these signs.
fn to_world(signs: [f64; 3]) -> [[f64; 4]; 4] {
    let [x, y, z] = signs;
    let matrix = expected().world_to_camera.inverse() * DMat4::from_diagonal(DVec4::new(x, y, z, 1.0));
    matrix.transpose().to_cols_array_2d()
}

fn colmap_text(folder: &Path, camera: &str) {
    let (q, t) = pose();
    fs::write(folder.join("cameras.txt"), format!("# comment\n7 {camera}\n")).unwrap();
    let image =
        format!("3 {} {} {} {} {} {} {} 7 a folder/1.jpg\n1.5 2.5 -1\n", q.w, q.x, q.y, q.z, t.x, t.y, t.z);
    fs::write(folder.join("images.txt"), image).unwrap();
}

/// The bytes of `cameras.bin` and `images.bin`.
fn colmap_binary(model: i32, parameters: &[f64]) -> [Vec<u8>; 2] {
    let (q, t) = pose();
    let numbers = |values: &[f64]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
    let mut cameras = [1_u64.to_le_bytes().as_slice(), &7_u32.to_le_bytes(), &model.to_le_bytes()].concat();
    cameras.extend([640_u64, 480].map(u64::to_le_bytes).concat());
    cameras.extend(numbers(parameters));
    let mut images = [1_u64.to_le_bytes().as_slice(), &3_u32.to_le_bytes()].concat();
    images.extend(numbers(&[q.w, q.x, q.y, q.z, t.x, t.y, t.z]));
    images.extend([7_u32.to_le_bytes().as_slice(), b"a folder/1.jpg\0", &1_u64.to_le_bytes()].concat());
    images.extend(numbers(&[1.5, 2.5]));
    images.extend((-1_i64).to_le_bytes());
    [cameras, images]
}

#[test]
fn all_formats_agree_on_one_camera() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir_all(at("text")).unwrap();
    fs::create_dir_all(at("binary/sparse/0")).unwrap();
    colmap_text(&at("text"), "PINHOLE 640 480 500 510 321.5 238.5");
    let [cameras, images] = colmap_binary(1, &[500.0, 510.0, 321.5, 238.5]);
    fs::write(at("binary/sparse/0/cameras.bin"), cameras).unwrap();
    fs::write(at("binary/sparse/0/images.bin"), images).unwrap();
    let text = read(&at("text")).unwrap();
    assert_expected(&text, "a folder/1.jpg");
    for path in ["text/cameras.txt", "text/images.txt", "binary", "binary/sparse/0/images.bin"] {
        assert_eq!(read(&at(path)).unwrap().cameras, text.cameras, "{path}");
    }

    let rows = to_world([1.0, -1.0, -1.0]);
    let transforms = format!(
        r#"{{"fl_x": 500, "fl_y": 510, "cx": 321.5, "cy": 238.5, "w": 640, "h": 480.0, "applied_scale": 3,
            "frames": [{{"file_path": "images/1.png", "transform_matrix": {rows:?}}}]}}"#
    );
    assert_expected(&parse("transforms.json", &transforms).unwrap(), "images/1.png");

    let extrinsic = expected().world_to_camera.to_cols_array();
    let intrinsic =
        r#"{"width": 640, "height": 480, "intrinsic_matrix": [500, 0, 0, 0, 510, 0, 321, 238, 1]}"#;
    let parameters =
        format!(r#"{{"extrinsic": {extrinsic:?}, "intrinsic": {intrinsic}, "version_major": 1}}"#);
    assert_expected(&parse("a.json", &parameters).unwrap(), "camera_0001");
    let trajectory = format!(r#"{{"class_name": "PinholeCameraTrajectory", "parameters": [{parameters}]}}"#);
    assert_expected(&parse("a.json", &trajectory).unwrap(), "camera_0001");

    let rows = to_world([1.0; 3]);
    let line = |row: [f64; 4]| row.map(|value| value.to_string()).join(" ");
    fs::write(at("a.log"), format!("0 0 1\n{}\n", rows.map(line).join("\n"))).unwrap();
    let intrinsic = parse("i.json", intrinsic).unwrap().cameras.remove(0).camera;
    assert_eq!(intrinsic.world_to_camera, DMat4::IDENTITY);
    let defaults = CameraDefaults { near: NEAR, size: None, intrinsic: Some(intrinsic) };
    assert_expected(&read_cameras_with(&at("a.log"), &defaults).unwrap(), "camera_0001");
    let plain = read(&at("a.log")).unwrap();
    assert_eq!(plain.cameras[0].camera.principal_point, DVec2::new(320.0, 240.0));
    assert!(plain.assumptions[0].contains("fx = fy = 525"), "{plain:?}");
    let other = read_cameras_with(&at("text"), &defaults).unwrap_err().to_string();
    assert!(other.contains("an intrinsic for cameras that have their own"), "{other}");

    let eye = expected().eye().to_array();
    let rotation = rows.map(|[x, y, z, _]| [x, y, z]);
    let trained = format!(
        r#"[{{"id": 0, "img_name": "1", "width": 643, "height": 477, "fx": 500, "fy": 510, "position": {eye:?},
             "rotation": {:?}}}]"#,
        &rotation[..3]
    );
    let mut trained = parse("cameras.json", &trained).unwrap();
    let camera = &mut trained.cameras[0].camera;
    (camera.width, camera.height) = (640, 480);
    assert_expected(&trained, "1");

    let own = [("first", expected()), ("second", expected())];
    let own = own.map(|(name, camera)| NamedCamera { name: name.to_owned(), camera });
    write_cameras_json(&at("own.json"), &own).unwrap();
    assert_eq!(read(&at("own.json")).unwrap().cameras, own);
    write_camera_json(&at("one.json"), &expected()).unwrap();
    assert_expected(&read(&at("one.json")).unwrap(), "camera_0001");
}

#[test]
fn distortion_is_read_by_every_model_that_has_it() {
    let folder = tempfile::tempdir().unwrap();
    let cases = [
        (0, "SIMPLE_PINHOLE", vec![500.0, 320.0, 240.0], [0.0; 4]),
        (2, "SIMPLE_RADIAL", vec![500.0, 320.0, 240.0, 0.1], [0.1, 0.0, 0.0, 0.0]),
        (3, "RADIAL", vec![500.0, 320.0, 240.0, 0.1, 0.2], [0.1, 0.2, 0.0, 0.0]),
        (4, "OPENCV", vec![500.0, 500.0, 320.0, 240.0, 0.1, 0.2, 0.3, 0.4], [0.1, 0.2, 0.3, 0.4]),
    ];
    for (number, model, parameters, [k1, k2, p1, p2]) in cases {
        let words: Vec<String> = parameters.iter().map(f64::to_string).collect();
        colmap_text(folder.path(), &format!("{model} 640 480 {}", words.join(" ")));
        let text = read(&folder.path().join("images.txt")).unwrap();
        let [cameras, images] = colmap_binary(number, &parameters);
        fs::write(folder.path().join("cameras.bin"), cameras).unwrap();
        fs::write(folder.path().join("images.bin"), images).unwrap();
        let binary = read(&folder.path().join("images.bin")).unwrap();
        assert_eq!(binary.cameras, text.cameras, "{model}");
        let camera = &text.cameras[0].camera;
        let distortion = Distortion { radial: [k1, k2, 0.0], tangential: [p1, p2] };
        assert_eq!(camera.distortion.unwrap_or_default(), distortion, "{model}");
        assert_eq!(camera.distortion.is_some(), k1 != 0.0);
        assert_eq!(camera.pixel_scale(), DVec2::splat(500.0));
        let path = folder.path().join("own.json");
        write_camera_json(&path, camera).unwrap();
        assert_eq!(read(&path).unwrap().cameras[0].camera, *camera);
    }
    let text = r#"{"k1": 0.5, "k3": 0.25, "p2": 2, "camera_angle_x": 1, "w": 4, "h": 2, "frames": [
        {"file_path": "a", "k1": 1, "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0]]}]}"#;
    let camera = &parse("transforms.json", text).unwrap().cameras[0].camera;
    assert_eq!(camera.distortion, Some(Distortion { radial: [1.0, 0.0, 0.25], tangential: [0.0, 2.0] }));
}

const IDENTITY: &str = "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]";

#[test]
fn blender_says_no_size() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("transforms_train.json");
    let text = format!(
        r#"{{"camera_angle_x": 1.5707963267948966, "frames": [{{"file_path": "./train/r_0", "transform_matrix": {IDENTITY}}}]}}"#
    );
    fs::write(&path, text).unwrap();
    let set = read(&path).unwrap();
    let camera = &set.cameras[0].camera;
    assert_eq!([camera.width, camera.height], [800, 800]);
    assert!((camera.pixel_scale() - 400.0).abs().max_element() < 1e-9, "{camera:?}");
    assert!(set.assumptions[0].contains("800 x 800"), "{set:?}");
    assert_eq!(camera.linear() * DVec3::NEG_Z, DVec3::Z, "it looks along -z, y is up");
    assert_eq!(camera.linear() * DVec3::Y, DVec3::NEG_Y);
    let defaults = CameraDefaults { near: NEAR, size: Some([100, 50]), intrinsic: None };
    let camera = &read_cameras_with(&path, &defaults).unwrap().cameras[0].camera;
    assert_eq!((camera.width, camera.height, camera.principal_point), (100, 50, DVec2::new(50.0, 25.0)));
    assert!((camera.pixel_scale() - 50.0).abs().max_element() < 1e-9, "{camera:?}");

    fs::create_dir(folder.path().join("train")).unwrap();
    let image = fs::File::create(folder.path().join("train/r_0.png")).unwrap();
    png::Encoder::new(image, 30, 20).write_header().unwrap().write_image_data(&[0; 600]).unwrap();
    let set = read(&path).unwrap();
    assert_eq!([set.cameras[0].camera.width, set.cameras[0].camera.height], [30, 20]);
    assert!(set.assumptions[0].contains("images beside"), "{set:?}");
}

#[test]
fn wrong_files_are_refused_with_their_place() {
    let frame = |matrix: &str, more: &str| {
        format!(
            r#"{{"w": 4, "h": 4, "fl_x": 4, "frames": [{{"file_path": "a/1.png", "transform_matrix": {matrix} {more}}}]}}"#
        )
    };
    let cases = [
        (frame("[[2,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]", ""), "camera `a/1.png`, field transform_matrix: found a matrix that is no rotation"),
        (frame("[[-1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]", ""), "a matrix that makes a mirror image"),
        (frame("[[0,0,0,0],[0,0,0,0],[0,0,0,0],[0,0,0,1]]", ""), "no rotation"),
        (frame("[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,2]]", ""), "last row"),
        (frame("[[1,0,0,0],[0,1,0,0]]", ""), "2 rows"),
        (frame("[[1,0,0,NaN],[0,1,0,0],[0,0,1,0]]", ""), "line 1 column"),
        (frame("[[1,0,0,1e999],[0,1,0,0],[0,0,1,0]]", ""), "number out of range"),
        (frame(IDENTITY, r#", "fl_x": -3"#), "camera `a/1.png`, field camera fx: found -3"),
        (frame(IDENTITY, r#", "w": 1.5"#), "field w: found 1.5"),
        (frame(IDENTITY, r#", "w": 1e9"#), "field w: found 1000000000"),
        (frame(IDENTITY, r#", "camera_model": "OPENCV_FISHEYE""#), "the camera model `OPENCV_FISHEYE` is not supported"),
        (frame(IDENTITY, r#", "is_fisheye": true"#), "fisheye"),
        (frame(IDENTITY, r#", "k4": 0.1"#), "k4 = 0.1"),
        (frame(IDENTITY, "").replace(r#""fl_x": 4,"#, ""), "field fl_x: found nothing"),
        (frame(IDENTITY, r#", "fl_x": null, "camera_angle_x": 4"#).replace(r#""fl_x": 4,"#, ""), "field camera_angle_x: found 4"),
        (r#"{"frames": []}"#.to_owned(), "found no camera"),
        (r#"{"cameras": []}"#.to_owned(), "found no camera"),
        (r#"{"cameras": [{"model": "pinhole", "width": 3, "height": 3, "world_to_camera": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]}"#.to_owned(), "camera `camera_0001`, field fx: found nothing"),
        (r#"{"a": 1}"#.to_owned(), "an object without any of the fields"),
        (r#"{"width": 6, "height": 4, "intrinsic_matrix": [5,0,0,0.1,5,0,2,2,1]}"#.to_owned(), "no skew"),
        ("0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1\n".to_owned(), "line 4: found `0 0 1`"),
        ("0 0 0\n1 0 0 0\n0 1 0 nan\n0 0 1 0\n0 0 0 1".to_owned(), "camera `camera_0001`, field matrix: found a number that is not finite"),
        ("0 0 0\n1 0 0 0".to_owned(), "expected a row of the camera's matrix"),
        ("hello".to_owned(), "a file that begins with `hello`"),
        (String::new(), "begins with ``"),
        (r#"[{"img_name": "a"}]"#.to_owned(), "missing field `width`"),
    ];
    for (text, expected) in cases {
        let message = message("cameras.json", &text);
        assert!(message.contains(expected), "{text}: {message}");
    }
    // A uniform scale is a change of units, not a mistake.
    let scaled = parse("a.json", &frame("[[2,0,0,3],[0,2,0,0],[0,0,2,0],[0,0,0,1]]", "")).unwrap();
    let camera = &scaled.cameras[0].camera;
    assert_eq!((camera.eye(), camera.near), (DVec3::new(3.0, 0.0, 0.0), 0.5 * NEAR));
}

#[test]
fn wrong_colmap_models_are_refused_with_their_place() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let error = || read(&at("cameras.txt")).unwrap_err().to_string();
    let cases = [
        ("OPENCV_FISHEYE 640 480 1 2 3 4 5 6 7 8", "the camera model `OPENCV_FISHEYE` is not supported"),
        ("PINHOLE 640 480 1 2 3", "line 2: found `7 PINHOLE 640 480 1 2 3`"),
        ("PINHOLE 640 -480 1 2 3 4", "line 2"),
        ("PINHOLE 640 480 1 x 3 4", "line 2"),
        ("PINHOLE 640 0 1 2 3 4", "camera `a folder/1.jpg`, field camera height: found 0"),
        ("PINHOLE 640 480 nan 2 3 4", "field camera fx: found NaN"),
        ("OPENCV 640 480 1 2 3 4 inf 0 0 0", "field k1: found inf"),
        ("PINHOLE 640 480 1 2 3 4\n7 PINHOLE 640 480 1 2 3 4", "a number that no camera has yet"),
    ];
    for (camera, expected) in cases {
        colmap_text(folder.path(), camera);
        assert!(error().contains(expected), "{camera}: {}", error());
    }
    fs::write(at("cameras.txt"), "1 PINHOLE 640 480 1 2 3 4").unwrap();
    assert!(error().contains("field CAMERA_ID: found 7"), "{}", error());
    let row = |number: u32, quaternion: &str| format!("{number} {quaternion} 0 0 0 1 {number}.png\n");
    let cases = [
        (row(1, "0 0 0 0"), "camera `1.png`, field pose: found [0.0, 0.0, 0.0, 0.0]"),
        (row(1, "NaN 0 0 0"), "field pose"),
        (row(1, "1 0 0"), "line 1"),
        ("1 1 0 0 0 0 0 0 1".to_owned(), "line 1"),
        (
            row(1, "1 0 0 0") + &row(2, "1 0 0 0"),
            "line 2: found `2 1 0 0 0 0 0 0 1 2.png`, expected the points",
        ),
        (String::new(), "found no camera"),
    ];
    for (images, expected) in cases {
        fs::write(at("images.txt"), &images).unwrap();
        assert!(error().contains(expected), "{images}: {}", error());
    }
    fs::write(at("images.txt"), row(2, "2 0 0 0") + "\n" + &row(1, "1 0 0 0")).unwrap();
    let names: Vec<String> =
        read(&at("images.txt")).unwrap().cameras.into_iter().map(|named| named.name).collect();
    assert_eq!(names, ["1.png", "2.png"], "sorted by name; quaternions are made unit ones");
    fs::remove_file(at("images.txt")).unwrap();
    assert!(error().contains("images.txt: cannot open"), "{}", error());
    assert!(read(&at("nothing")).unwrap_err().to_string().contains("cannot open"));
    fs::remove_file(at("cameras.txt")).unwrap();
    assert!(read(folder.path()).unwrap_err().to_string().contains("a folder without a camera file"));
}

#[test]
fn damaged_binary_models_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let [cameras, images] = colmap_binary(4, &[500.0, 500.0, 320.0, 240.0, 0.1, 0.2, 0.3, 0.4]);
    let write = |cameras: &[u8], images: &[u8]| {
        fs::write(folder.path().join("cameras.bin"), cameras).unwrap();
        fs::write(folder.path().join("images.bin"), images).unwrap();
        read(folder.path())
    };
    assert!(write(&cameras, &images).is_ok());
    for end in 0..cameras.len() {
        assert!(write(&cameras[..end], &images).is_err(), "cameras.bin ends at byte {end}");
    }
    for end in 0..images.len() {
        assert!(write(&cameras, &images[..end]).is_err(), "images.bin ends at byte {end}");
    }
    let huge = |bytes: &[u8]| [&[0xff; 8], &bytes[8..]].concat();
    let message = write(&huge(&cameras), &images).unwrap_err().to_string();
    assert!(message.contains("a count of 18446744073709551615 cameras, expected at most"), "{message}");
    assert!(write(&cameras, &huge(&images)).unwrap_err().to_string().contains("images"));
    // Any byte may be anything: an answer or an error, and no more.
    for place in 0..cameras.len() + images.len() {
        for value in [0, 0x7f, 0x80, 0xff] {
            let (mut cameras, mut images) = (cameras.clone(), images.clone());
            match place.checked_sub(cameras.len()) {
                None => cameras[place] = value,
                Some(place) => images[place] = value,
            }
            _ = write(&cameras, &images);
        }
    }
}

proptest! {
    #[test]
    fn no_text_makes_it_panic(text in r#"[\[\]{}":, 0-9a-z.\n-]{0,80}"#) {
        _ = parse("cameras.json", &text);
        _ = parse("images.txt", &text);
    }

    #[test]
    fn no_change_of_a_text_makes_it_panic(place in 0_usize..400, byte in 0_u8..128) {
        let text = format!(
            r#"{{"fl_x": 500, "w": 640, "h": 480.0, "frames": [{{"file_path": "1.png", "transform_matrix": {IDENTITY}}}]}}"#
        );
        let mut bytes = text.into_bytes();
        let length = bytes.len();
        bytes[place % length] = byte;
        _ = parse("transforms.json", std::str::from_utf8(&bytes).unwrap());
    }
}

/// Number of cameras, size of the first, least and greatest eye.
type Facts = (usize, [u32; 2], [f64; 3], [f64; 3]);

fn facts(set: &CameraSet) -> Facts {
    let first = &set.cameras[0].camera;
    let eyes = set.cameras.iter().map(|named| named.camera.eye());
    let (low, high) = eyes.map(|eye| (eye, eye)).reduce(|(a, b), (c, d)| (a.min(c), b.max(d))).unwrap();
    (set.cameras.len(), [first.width, first.height], low.to_array(), high.to_array())
}

#[test]
fn real_files_have_the_cameras_that_others_found_in_them() {
    let Some(data) = std::env::var_os("SPLAT_TEST_DATA") else { return };
    let data = PathBuf::from(data).join("cameras");
    let garden =
        (3, [648, 420], [-1.06599706, -0.798153573, 0.484257931], [0.227751794, -0.33239223, 0.631791205]);
    let eye = [-0.0537983216, 3.84547043, 1.20808232];
    let cases: [(&str, Facts); 7] = [
        ("garden_colmap_text", garden),
        ("garden_colmap_bin", garden),
        ("brush_transforms.json", (1, [50, 50], eye, eye)),
        ("lego_transforms_train.json", (1, [800, 800], eye, eye)),
        ("open3d_camera.json", (1, [640, 480], [0.0; 3], [0.0; 3])),
        (
            "open3d_camera_trajectory.json",
            (
                31,
                [1920, 1080],
                [1.79568917, 0.386721332, -1.31326798],
                [3.78249844, 1.40435272, -0.116961992],
            ),
        ),
        (
            "open3d_trajectory.log",
            (5, [640, 480], [-0.31057997, 0.573012244, 2.12039735], [-0.307548122, 0.670723649, 2.12648002]),
        ),
    ];
    for (name, (count, size, low, high)) in cases {
        let set = read(&data.join(name)).unwrap();
        let found = facts(&set);
        assert_eq!((found.0, found.1), (count, size), "{name}");
        for (found, expected) in [(found.2, low), (found.3, high)] {
            let close = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-8);
            assert!(close, "{name}: {found:?}, expected {expected:?}");
        }
    }
    let read = |name: &str| read(&data.join(name)).unwrap().cameras;
    assert_eq!(read("garden_colmap_text"), read("garden_colmap_bin"));
    let lego = &read("lego_transforms_train.json")[0];
    assert_eq!(lego.name, "train/r_0");
    let focal_length = 400.0 / (0.5_f64 * 0.691_111_207_008_361_8).tan();
    assert!((lego.camera.pixel_scale() - focal_length).abs().max_element() < 1e-9, "{lego:?}");
    let open3d = &read("open3d_camera.json")[0].camera;
    assert_eq!(open3d.principal_point, DVec2::new(320.0, 240.0));
    assert!((open3d.pixel_scale() - 415.692_193_816_530_7).abs().max_element() < 1e-12);
}

#[test]
fn real_points_are_the_same_as_text_and_as_binary() {
    let Some(data) = std::env::var_os("SPLAT_TEST_DATA") else { return };
    let data = PathBuf::from(data).join("cameras");
    let read = |name: &str| crate::read_points3d(&data.join(name)).unwrap();
    let (text, binary) = (read("garden_colmap_text/points3D.txt"), read("garden_colmap_bin/points3D.bin"));
    assert_eq!(text.cloud, binary.cloud);
    assert_eq!(text.cloud.len(), 5000);
    let (low, high) = text.cloud.bounds().unwrap();
    assert!((low - DVec3::new(-6.60607433, -4.71046066, -0.11175108)).abs().max_element() < 1e-6, "{low}");
    assert!((high - DVec3::new(9.68600273, 11.2098465, 2.75984144)).abs().max_element() < 1e-6, "{high}");
}
