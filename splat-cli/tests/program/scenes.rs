//! Scene files from outside: what they say is drawn, the command line wins, and what is wrong is said with its line.

use super::common::{Png, fails, message_of, read_png, splat, succeeds};
use glam::{DVec3, Vec3};
use splat_core::{Cloud, Shapes};
use splat_io::{PlyEncoding, write_ply};
use std::fs;
use std::path::Path;

/// What the program wrote to stdout; it must succeed.
fn stdout(folder: &Path, arguments: &str) -> String {
    String::from_utf8(succeeds(folder, arguments).stdout).unwrap()
}

/// The message of a program that must fail: with 1 or 2, by who is to blame.
fn failure(folder: &Path, arguments: &str) -> String {
    let output = splat(folder, arguments);
    assert!(matches!(output.status.code(), Some(1 | 2)), "{arguments}");
    message_of(&output)
}

/// A small picture of these inputs.
fn picture(folder: &Path, arguments: &str) -> Png {
    succeeds(folder, &format!("render {arguments} -o out.png --quiet"));
    read_png(&folder.join("out.png"))
}

/// A square of discs in the plane z = 0 around a place, of one colour.
fn square(at: DVec3, color: Vec3) -> Cloud {
    let points: Vec<DVec3> =
        (0..400).map(|i| at + DVec3::new(f64::from(i % 20) - 9.5, f64::from(i / 20) - 9.5, 0.0)).collect();
    Cloud {
        normals: vec![Vec3::Z; 400],
        shapes: Shapes::Discs(vec![0.9; 400]),
        colors: Some(vec![color; 400]),
        oriented: true,
        ..Cloud::from_points(&points)
    }
}

/// A folder with a red square, `red.ply`, and one without normals, sizes and colours, `bare.xyz`.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let red = square(DVec3::ZERO, Vec3::new(1.0, 0.0, 0.0));
    write_ply(&folder.path().join("red.ply"), &red, PlyEncoding::Binary).unwrap();
    let rows = (0..400).map(|i| format!("{} {} 0\n", f64::from(i % 20) - 9.5, f64::from(i / 20) - 9.5));
    fs::write(folder.path().join("bare.xyz"), rows.collect::<String>()).unwrap();
    folder
}

const SMALL: &str = "--size 80x60 --spp 4";

#[test]
fn a_scene_says_what_a_command_line_says() {
    let folder = folder();
    let folder = folder.path();
    fs::create_dir(folder.join("scenes")).unwrap();
    let scene = "[[cloud]]\npath = \"../red.ply\"\n[camera]\nview = \"20,-10\"\nup = \"-y\"\n\
                 [lens]\nlens-radius = 0.5\nfocus = 30\n[film]\nsize = \"80x60\"\nspp = 4\n\
                 background = [0, 0.25, 1]\n[splats]\ncull = false\n[light]\nshading = \"headlight\"\n";
    fs::write(folder.join("scenes/s.toml"), scene).unwrap();
    let line = "--view 20,-10 --up=-y --lens-radius 0.5 --focus 30 --background 0,0.25,1 --shading headlight";
    let expected = picture(folder, &format!("red.ply {line} {SMALL}"));
    assert_eq!(picture(folder, "scenes/s.toml"), expected);
    // What the command line says wins, and so does what contradicts the file.
    let other = picture(folder, &format!("red.ply {line} --spp 4 --size 40x30"));
    assert_eq!(picture(folder, "scenes/s.toml --size 40x30"), other);
    let flat = "--view 20,-10 --up=-y --background 0,0.25,1 --shading headlight --ortho";
    let flat = picture(folder, &format!("red.ply {flat} {SMALL}"));
    assert_eq!(picture(folder, "scenes/s.toml --ortho"), flat);
}

#[test]
fn what_is_printed_means_the_same() {
    let folder = folder();
    let folder = folder.path();
    let lines = [
        format!("red.ply {SMALL}"),
        format!("red.ply bare.xyz {SMALL} --view=-30,10 --ortho --filter tent --kernel gaussian --cutoff 5"),
        format!("bare.xyz {SMALL} --color height --colormap inferno --normals-k 8 --exr-type float --cull"),
    ];
    for line in lines {
        fs::write(folder.join("printed.toml"), stdout(folder, &format!("render {line} --print-config")))
            .unwrap();
        assert_eq!(picture(folder, "printed.toml"), picture(folder, &line), "{line}");
        let again = stdout(folder, "render printed.toml --print-config");
        assert_eq!(again, fs::read_to_string(folder.join("printed.toml")).unwrap(), "{line}");
    }
}

#[test]
fn clouds_have_places_and_looks_of_their_own() {
    let folder = folder();
    let folder = folder.path();
    let film = "[film]\nsize = \"80x60\"\nspp = 4\n[camera]\northo = \"front\"\n";
    // The red square at the left; at the right one without normals and sizes, coloured by its height.
    let scene = "[[cloud]]\npath = \"red.ply\"\ntranslate = [-15, 0, 0]\n\
                 [[cloud]]\npath = \"bare.xyz\"\ntranslate = [15, 0, 0]\ncolor = \"height\"\nopacity = 0.5\n";
    fs::write(folder.join("s.toml"), format!("{scene}{film}")).unwrap();
    let Png { size: [width, height], pixels, .. } = picture(folder, "s.toml");
    let at = |x: u32, y: u32| pixels[(y * width + x) as usize];
    assert_eq!(at(width / 4, height / 2), [255, 0, 0, 255]);
    assert_eq!(at(width / 2, height / 2)[3], 0, "a gap");
    let right = at(3 * width / 4, height / 2);
    assert!((126..=130).contains(&right[3]), "half transparent: {right:?}");
    let [above, below] = [at(3 * width / 4, height * 9 / 20), at(3 * width / 4, height * 11 / 20)];
    assert!(above[1] > below[1], "viridis is greener above: {above:?} {below:?}");

    // Turned by a quarter it is seen from its side, which is nothing.
    let turned =
        "[[cloud]]\npath = \"red.ply\"\n[[cloud]]\npath = \"red.ply\"\nrotate = [0, 90, 0]\nscale = 0.5\n";
    fs::write(folder.join("s.toml"), format!("{turned}{film}")).unwrap();
    let alone = picture(folder, &format!("red.ply --ortho front {SMALL}"));
    assert_eq!(picture(folder, "s.toml"), alone);
}

#[test]
fn paths_of_a_scene_elsewhere_are_printed_as_they_are_from_here() {
    let folder = folder();
    let folder = folder.path();
    fs::create_dir(folder.join("scenes")).unwrap();
    succeeds(folder, "render red.ply -o scenes/t.png --size 8x8 --quiet");
    let scene = "[[cloud]]\npath = \"../red.ply\"\ntexture = \"t.png\"\nmapping = \"planar\"\n\
                 [film]\nsize = \"80x60\"\nspp = 4\n";
    fs::write(folder.join("scenes/s.toml"), scene).unwrap();
    fs::write(folder.join("p.toml"), stdout(folder, "render scenes/s.toml --print-config")).unwrap();
    assert_eq!(picture(folder, "p.toml"), picture(folder, "scenes/s.toml"));
    // The picture says what it was made of.
    let bytes = fs::read(folder.join("out.png")).unwrap();
    let says = |text: &str| bytes.windows(text.len()).any(|window| window == text.as_bytes());
    assert!(says("[[cloud]]") && says("texture = \"scenes/t.png\""));
}

#[test]
fn what_is_wrong_is_said_with_its_line() {
    let folder = folder();
    let folder = folder.path();
    let wrong = [
        ("[film]\nspq = 4\n", "s.toml: line 2: found `spq`, expected one of"),
        ("[camera]\nspp = 4\n", "line 2: found `spp` in [camera], expected it in [film]"),
        ("[cinema]\nspp = 4\n", "line 1: found [cinema], expected one of [[cloud]]"),
        ("[film]\nspp = \"many\"\n", "invalid value 'many'"),
        ("[film]\nspp = true\n", "line 2: found spp = true, expected a value"),
        ("[splats]\ncull = 1\n", "line 2: found cull = 1, expected true or false"),
        ("[[cloud]]\npath = \"red.ply\"\nhue = 3\n", "line 3: found `hue`, expected path, translate"),
        ("[[cloud]]\npath = \"none.ply\"\n", "none.ply: cannot open"),
    ];
    for (scene, message) in wrong {
        fs::write(folder.join("s.toml"), scene).unwrap();
        let said = failure(folder, "render s.toml -o out.png");
        assert!(said.contains(message), "{scene:?}: {said}");
    }
    fs::write(folder.join("s.toml"), "").unwrap();
    assert!(failure(folder, "render s.toml s.toml -o o.png").contains("one scene file at a time"));
}

#[test]
fn a_picture_needs_no_name_and_destroys_nothing() {
    let folder = folder();
    let folder = folder.path();
    succeeds(folder, &format!("render red.ply {SMALL} --quiet"));
    assert!(folder.join("red.png").exists());
    let said = failure(folder, &format!("render red.ply {SMALL}"));
    assert!(said.contains("red.png exists: name the picture with -o"), "{said}");
}

#[test]
fn clouds_that_convert_cannot_join_are_refused_not_guessed() {
    let folder = folder();
    let folder = folder.path();
    succeeds(folder, "prepare bare.xyz -o ellipses.ply --quiet");
    let said = failure(folder, "convert ellipses.ply bare.xyz -o all.ply");
    assert!(said.contains("normals") && !said.contains("panicked"), "{said}");
    // To draw them is no matter: each is completed first.
    picture(folder, &format!("ellipses.ply bare.xyz {SMALL}"));
}

#[test]
fn no_file_that_is_read_is_written() {
    let folder = folder();
    let folder = folder.path();
    let scene = "[[cloud]]\npath = \"red.ply\"\ntexture = \"image.png\"\nmapping = \"planar\"\n";
    fs::write(folder.join("scene.toml"), scene).unwrap();
    let options = "--size 8x8 --spp 1";
    succeeds(folder, &format!("render red.ply -o image.png {options}"));
    for (from, to) in
        [("image.png", "turn-0001.png"), ("red.ply", "out.png.checkpoint"), ("red.ply", "out.id.exr")]
    {
        fs::copy(folder.join(from), folder.join(to)).unwrap();
    }
    let contents = || {
        let read = |entry: std::io::Result<fs::DirEntry>| {
            let path = entry.unwrap().path();
            (fs::read(&path).unwrap(), path)
        };
        let mut files: Vec<_> = fs::read_dir(folder).unwrap().map(read).collect();
        files.sort();
        files
    };
    let before = contents();
    for (command, spared) in [
        ("render scene.toml -o image.png", "image.png"),
        ("render scene.toml -o out.png --stats red.ply", "red.ply"),
        ("render scene.toml -o out.png --stats scene.toml", "scene.toml"),
        (
            "render red.ply --texture turn-0001.png --mapping planar --turntable 2 -o turn.png",
            "turn-0001.png",
        ),
        ("render out.png.checkpoint -o out.png", "out.png.checkpoint"),
        ("render out.id.exr -o out.png --aov id --aov-files", "out.id.exr"),
    ] {
        let message = fails(folder, &format!("{command} {options}"), 2);
        assert!(message.contains(&format!("would overwrite {spared}")), "{command}: {message}");
        assert!(contents() == before, "{command}");
    }
}
