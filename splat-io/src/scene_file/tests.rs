use super::*;
use proptest::prelude::*;

fn parse(text: &str) -> Result<SceneFile, String> {
    parse_scene(text, Path::new("s.toml")).map_err(|error| error.to_string())
}

#[test]
fn a_scene_has_clouds_and_settings() {
    let scene = parse(
        "# A comment\n\
         [[cloud]]\npath = 'a.ply'\n\n\
         [[cloud]]\npath = \"sub/b.las\"\ncolor = \"intensity\"\ntranslate = [1, 2.5, -3]\n\n\
         [camera]\nview = \"30,20\"\nnear = 0.5\northo = true\n\
         [film]\nspp = 1_6\nsize = \"64x48\"\nbackground = [0, 0.5, 1e0]\n",
    )
    .unwrap();
    assert_eq!(scene.clouds.len(), 2);
    assert_eq!(scene.clouds[0].to_world, DAffine3::IDENTITY);
    assert_eq!(scene.clouds[1].path, Path::new("sub/b.las"));
    assert_eq!(scene.clouds[1].to_world, DAffine3::from_translation(DVec3::new(1.0, 2.5, -3.0)));
    let text =
        |name: &str, line, text: &str| Setting { name: name.into(), line, value: Value::Text(text.into()) };
    assert_eq!(scene.clouds[1].settings, [text("color", 7, "intensity")]);
    assert_eq!(scene.sections.len(), 2);
    let camera = &scene.sections[0];
    assert_eq!((camera.name.as_str(), camera.line), ("camera", 10));
    let ortho = Setting { name: "ortho".into(), line: 13, value: Value::Flag(true) };
    assert_eq!(camera.settings, [text("near", 12, "0.5"), ortho, text("view", 11, "30,20")]);
    let film = &scene.sections[1].settings;
    assert_eq!(
        film,
        &[text("background", 17, "0,0.5,1e0"), text("size", 16, "64x48"), text("spp", 15, "16")]
    );
}

#[test]
fn a_cloud_is_scaled_then_turned_then_moved() {
    let place = |text: &str| parse(&format!("[[cloud]]\npath = 'a'\n{text}")).unwrap().clouds[0].to_world;
    let p = DVec3::new(1.0, 2.0, 3.0);
    // About x by 90 degrees: y goes to z.
    let turned = place("rotate = [90, 0, 0]").transform_point3(DVec3::Y);
    assert_eq!(turned, DVec3::Z);
    // x first, z last: y goes to z, and stays there.
    assert_eq!(place("rotate = [90, 0, 90]").transform_point3(DVec3::Y), DVec3::Z);
    assert_eq!(place("rotate = [0, 0, -270]").transform_point3(DVec3::X), DVec3::Y);
    let all = place("scale = 2\nrotate = [0, 0, 90]\ntranslate = [10, 0, 0]");
    assert_eq!(all.transform_point3(p), DVec3::new(10.0 - 4.0, 2.0, 6.0));
    let scaled = place("scale = [1, 2, -0.5]").transform_point3(p);
    assert_eq!(scaled, DVec3::new(1.0, 4.0, -1.5));
    let matrix = "matrix = [[0, 1, 0, 5], [1, 0, 0, 6], [0, 0, 1, 7], [0, 0, 0, 1]]\ntranslate = [0, 0, 1]";
    assert_eq!(place(matrix).transform_point3(p), DVec3::new(7.0, 7.0, 11.0));
    // Any angle, against the quaternion.
    let turn = place("rotate = [12.5, -71, 200]").matrix3;
    let [x, y, z] = [12.5f64, -71.0, 200.0].map(f64::to_radians);
    let expected = DMat3::from_euler(glam::EulerRot::ZYX, z, y, x);
    assert!((turn - expected).to_cols_array().iter().all(|d| d.abs() < 1e-15), "{turn} {expected}");
}

#[test]
fn what_is_wrong_is_said_with_its_line() {
    let wrong = [
        ("[[cloud]]\ncolor = 'rgb'\n", "line 1: found a cloud without a path"),
        ("\n[[cloud]]\npath = 3", "line 3: found no path"),
        ("cloud = 'a.ply'", "line 1: found no array of tables, expected [[cloud]]"),
        ("spp = 4", "line 1: found `spp` outside of any table"),
        ("[film]\n\nspp = {a = 1}", "line 3: found table, expected a text or a decimal number"),
        ("[film]\nspp = 0x10", "line 2"),
        ("[film\nspp = 1", "line 1"),
        ("[film]\nspp = 1\nspp = 2", "line 3"),
        ("[[cloud]]\npath = 'a'\nscale = 0", "without extent"),
        ("[[cloud]]\npath = 'a'\nscale = nan", "line 3: found float, expected a finite number"),
        ("[[cloud]]\npath = 'a'\ntranslate = [1, 2]", "line 3: found array, expected 3 numbers"),
        ("[[cloud]]\npath = 'a'\nmatrix = [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,1,1]]", "last row"),
    ];
    for (text, message) in wrong {
        let error = parse(text).unwrap_err();
        assert!(error.starts_with("s.toml: ") && error.contains(message), "{text:?}: {error}");
    }
}

#[test]
fn a_byte_order_mark_and_carriage_returns_are_no_matter() {
    let scene = parse("\u{feff}[film]\r\nspp = 4\r\n").unwrap();
    assert_eq!(scene.sections[0].settings[0].line, 2);
}

#[test]
fn deep_nesting_and_great_files_are_refused() {
    let deep = format!("[film]\nspp = {}{}", "[".repeat(100_000), "]".repeat(100_000));
    assert!(parse(&deep).is_err());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.toml");
    std::fs::write(&path, "#".repeat(2 << 20)).unwrap();
    assert!(read_scene(&path).unwrap_err().to_string().contains("beyond the limit of 1 MiB"));
    std::fs::write(&path, b"[film]\n\xff").unwrap();
    assert!(read_scene(&path).unwrap_err().to_string().contains("byte 7"));
}

proptest! {
    #[test]
    fn no_text_panics(text in "(\\[\\[?[a-z]{1,5}\\]?\\]\n|[a-z]{1,9} = [-0-9.\\[\\], \"'a-z{}]{0,20}\n|.{0,9}\n){0,12}") {
        let _ = parse(&text);
    }
}
