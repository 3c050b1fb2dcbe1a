//! The program from outside: exit codes, files, messages.

use super::common::{PROGRAM, Png, fails, message_of, read_png, real_files, succeeds};
use glam::{DMat4, DVec2, DVec3};
use splat_core::{Camera, Cloud, Projection, Shapes};
use splat_io::{PlyEncoding, write_camera_json, write_ply};
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

/// An evenly covered sphere of radius 1 at `centre`, with colours.
fn sphere(centre: DVec3) -> Cloud {
    let count = 2000;
    let golden_angle = std::f64::consts::PI * (3.0 - 5.0f64.sqrt());
    let directions: Vec<DVec3> = (0..count)
        .map(|i| {
            let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
            let (sin, cos) = (golden_angle * f64::from(i)).sin_cos();
            DVec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z)
        })
        .collect();
    let points: Vec<DVec3> = directions.iter().map(|direction| centre + direction).collect();
    let mut cloud = Cloud::from_points(&points);
    cloud.normals = directions.iter().map(|direction| direction.as_vec3()).collect();
    cloud.colors = Some(directions.iter().map(|direction| (0.5 + 0.5 * direction).as_vec3()).collect());
    cloud.shapes = Shapes::Discs(vec![0.08; directions.len()]);
    cloud.oriented = true;
    cloud
}

/// A camera 4 units in front of `centre`.
fn camera(centre: DVec3) -> Camera {
    Camera {
        width: 320,
        height: 240,
        projection: Projection::Perspective { focal_length: DVec2::splat(380.0), lens: None },
        principal_point: DVec2::new(160.0, 120.0),
        world_to_camera: DMat4::from_translation(-(centre - 4.0 * DVec3::Z)),
        near: 0.01,
        far: f64::INFINITY,
        clip_planes: Vec::new(),
        distortion: None,
    }
}

#[test]
fn the_demo_needs_nothing() {
    let folder = tempfile::tempdir().unwrap();
    succeeds(folder.path(), "demo -o demo.png --size 160x90 --spp 2");
    let Png { size: [width, height], pixels, .. } = read_png(&folder.path().join("demo.png"));
    assert_eq!((width, height), (160, 90));
    let mut colors = pixels;
    colors.sort_unstable();
    colors.dedup();
    assert!(colors.len() > 1000, "{} colours", colors.len());
}

#[test]
fn a_picture_without_any_option_shows_the_whole_cloud() {
    let folder = tempfile::tempdir().unwrap();
    write_ply(&folder.path().join("in.ply"), &sphere(DVec3::ZERO), PlyEncoding::Binary).unwrap();
    let output = succeeds(folder.path(), "render in.ply -o out.png --stats stats.json");
    assert!(output.stdout.is_empty());
    let Png { size: [width, height], pixels, .. } = read_png(&folder.path().join("out.png"));
    let alpha = |x: u32, y: u32| pixels[(y * width + x) as usize][3];
    // The sphere fills the height but for the margin, touches no border, and has no hole.
    assert!((0..width).all(|x| alpha(x, 0) == 0 && alpha(x, height - 1) == 0));
    assert!((height / 10..height * 9 / 10).all(|y| alpha(width / 2, y) == 255));
    let stats: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.path().join("stats.json")).unwrap()).unwrap();
    for key in ["splats", "tests", "fragments", "samples", "threads", "isa", "seconds", "peak_bytes"] {
        assert!(!stats[key].is_null(), "{key} in {stats}");
    }
    assert_eq!(stats["splats"]["read"], 2000);
    assert_eq!(stats["samples"], 1280 * 960 * 16);
    for key in ["read", "prepare", "setup", "bin", "raster", "resolve", "write", "total"] {
        assert!(stats["seconds"][key].is_number(), "{key} in {stats}");
    }
}

#[test]
fn map_coordinates_change_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let shift = DVec3::new(500_000.0, 5_000_000.0, 100.0);
    for (name, at) in [("near", DVec3::ZERO), ("far", shift)] {
        write_ply(&folder.path().join(format!("{name}.ply")), &sphere(at), PlyEncoding::Binary).unwrap();
        write_camera_json(&folder.path().join(format!("{name}.json")), &camera(at)).unwrap();
        succeeds(folder.path(), &format!("render {name}.ply -o {name}.png --camera {name}.json"));
    }
    let [near, far] = ["near.png", "far.png"].map(|name| read_png(&folder.path().join(name)).pixels);
    let same = |(a, b): (&[u8; 4], &[u8; 4])| a.iter().zip(b).all(|(a, b)| a.abs_diff(*b) <= 2);
    let agree = near.iter().zip(&far).filter(|&pair| same(pair)).count();
    assert!(near.iter().any(|pixel| pixel[3] == 255));
    assert!(agree as f64 >= 0.999 * near.len() as f64, "{agree} of {}", near.len());
}

/// The sphere's points alone, some of them moved, and one far away.
fn bare_points(centre: DVec3) -> Cloud {
    let sphere = sphere(centre);
    let points: Vec<DVec3> = (0..2000)
        .map(|i| (i, sphere.world_position(i)))
        .map(|(i, p)| {
            if i == 77 {
                centre + 9.0 * DVec3::X
            } else {
                centre + (p - centre) * (1.0 + 1e-3 * (i % 7) as f64)
            }
        })
        .collect();
    Cloud::from_points(&points)
}

#[test]
fn a_prepared_cloud_is_the_same_picture() {
    let folder = tempfile::tempdir().unwrap();
    let shift = DVec3::new(500_000.0, 5_000_000.0, 100.0);
    for (name, at) in [("near", DVec3::ZERO), ("far", shift)] {
        write_ply(&folder.path().join(format!("{name}.ply")), &bare_points(at), PlyEncoding::Binary).unwrap();
        for options in
            ["", "--orient graph --outliers statistical --radius-scale 1.2", "--orient up --radius 0.1"]
        {
            let size = "--size 200x150 --spp 4";
            succeeds(folder.path(), &format!("render {name}.ply -o raw.png {size} {options}"));
            succeeds(folder.path(), &format!("prepare {name}.ply -o once.ply {options}"));
            succeeds(folder.path(), &format!("render once.ply -o prepared.png {size}"));
            let pixels = |name: &str| read_png(&folder.path().join(name));
            assert!(pixels("raw.png") == pixels("prepared.png"), "{name} {options}");
            // What is complete stays as it is.
            let output = succeeds(folder.path(), "prepare once.ply -o twice.ply");
            assert!(String::from_utf8_lossy(&output.stderr).contains("nothing was missing"));
            let bytes = |name: &str| fs::read(folder.path().join(name)).unwrap();
            assert!(bytes("once.ply") == bytes("twice.ply"), "{name} {options}");
        }
    }
    let output = succeeds(folder.path(), "prepare near.ply -o once.ply --outliers statistical -v");
    let message = message_of(&output);
    assert!(message.contains("1999 points") && message.contains("1 outliers dropped"), "{message}");
}

#[test]
fn a_crop_of_a_shaded_picture_is_a_part_of_it() {
    let folder = tempfile::tempdir().unwrap();
    write_ply(&folder.path().join("in.ply"), &bare_points(DVec3::ZERO), PlyEncoding::Binary).unwrap();
    let line = "render in.ply --size 160x120 --spp 4 --shading edl --background 0,0,1";
    succeeds(folder.path(), &format!("{line} -o whole.png"));
    succeeds(folder.path(), &format!("{line} -o part.png --crop 40,30,100,90"));
    let [whole, part] = ["whole.png", "part.png"].map(|name| read_png(&folder.path().join(name)));
    assert_eq!(part.size, [60, 60]);
    let at = |x: u32, y: u32| whole.pixels[((y + 30) * 160 + x + 40) as usize];
    assert!((0..60).all(|y| (0..60).all(|x| part.pixels[(y * 60 + x) as usize] == at(x, y))));
    succeeds(
        folder.path(),
        "render in.ply --size 160x120 --spp 4 --background 0,0,1 -o plain.png --shading headlight",
    );
    let plain = read_png(&folder.path().join("plain.png")).pixels;
    assert!(plain.iter().zip(&whole.pixels).any(|(a, b)| a != b) && plain[0] == whole.pixels[0]);
    for wrong in ["--shading edl --samples 0:2", "--shading edl --resolve over", "--edl-strength 2"] {
        fails(folder.path(), &format!("render in.ply -o out.png {wrong}"), 2);
    }
}

#[test]
fn the_engines_write_the_same_file() {
    let folder = tempfile::tempdir().unwrap();
    write_ply(&folder.path().join("in.ply"), &sphere(DVec3::ZERO), PlyEncoding::Binary).unwrap();
    let line = "render in.ply --size 160x120 --spp 9 --lens-radius 0.1 --stats stats.json";
    let mut pictures = Vec::new();
    for engine in ["reference", "fast --threads 1", "fast --threads 3", "both"] {
        succeeds(folder.path(), &format!("{line} -o out.png --engine {engine}"));
        pictures.push(read_png(&folder.path().join("out.png")));
    }
    assert!(pictures.iter().all(|picture| *picture == pictures[0]));
    let stats = fs::read_to_string(folder.path().join("stats.json")).unwrap();
    assert!(!stats.contains("scalar"), "{stats}");
    let said = succeeds(folder.path(), &format!("{line} -o out.png --engine both -v"));
    assert!(String::from_utf8_lossy(&said.stderr).contains("agree on all"));
}

#[test]
fn trained_splats_have_defaults_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    write_ply(&folder.path().join("in.ply"), &sphere(DVec3::ZERO), PlyEncoding::Binary).unwrap();
    succeeds(folder.path(), "convert in.ply -o in.splat");
    succeeds(folder.path(), "convert in.splat -o back.ply");
    let render = |line: &str| {
        let said = succeeds(folder.path(), &format!("render {line} -o out.png --size 80x60 --spp 4 -v"));
        let said = String::from_utf8_lossy(&said.stderr).into_owned();
        (read_png(&folder.path().join("out.png")), said)
    };
    let (trained, said) = render("in.splat");
    assert!(said.contains("blended one by one") && said.contains("y is down"), "{said}");
    let given = "--resolve over --kernel gaussian --cutoff 9 --up -y --shading color --background none";
    assert_eq!(trained, render(&format!("in.splat {given}")).0);
    assert_eq!(trained, render("back.ply").0, "the cloud's own format remembers");
    assert_eq!(trained, render("in.splat --engine both").0);
    for other in ["--resolve surface", "--coverage opaque", "--up y"] {
        assert_ne!(trained, render(&format!("in.splat {other}")).0, "{other}");
    }
    let info = succeeds(folder.path(), "info in.splat --json");
    assert!(String::from_utf8_lossy(&info.stdout).contains("\"trained\": true"));

    fs::write(folder.path().join("a.ksplat"), [0; 5000]).unwrap();
    assert!(fails(folder.path(), "render a.ksplat -o out.png", 1).contains(".ksplat is not supported"));
    assert!(fails(folder.path(), "convert in.ply -o out.spz", 2).contains("one of .ply, .las"));
}

#[test]
fn exit_codes_and_messages_tell_who_is_to_blame() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(
        folder.path().join("bad.ply"),
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n",
    )
    .unwrap();
    write_ply(&folder.path().join("in.ply"), &sphere(DVec3::ZERO), PlyEncoding::Ascii).unwrap();
    let usage = [
        "render",
        "render in.ply -o out.jpg",
        "render in.ply -o out.png --spp none",
        "render in.ply -o out.png --aov depth",
        "render in.ply -o out.png --engine slow",
        "render in.ply -o out.png --kernel cubic",
        "render in.ply -o out.png --stats out.png",
        "paint in.ply",
    ];
    for arguments in usage {
        assert!(!fails(folder.path(), arguments, 2).is_empty(), "{arguments}");
    }
    assert!(fails(folder.path(), "render none.ply -o out.png", 1).contains("none.ply"));
    assert!(fails(folder.path(), "render in.ply -o none/out.png", 1).contains("none"));
    let message = fails(folder.path(), "render bad.ply -o out.png", 1);
    assert!(
        message.contains("bad.ply") && message.contains('y') && message.contains("expected"),
        "{message}"
    );
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2, "nothing is left behind");
}

#[test]
fn a_claim_of_a_billion_points_fails_at_once_in_little_memory() {
    let folder = tempfile::tempdir().unwrap();
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let header = format!(
            "ply\nformat {format} 1.0\nelement vertex 1000000000\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n"
        );
        fs::write(folder.path().join("huge.ply"), header).unwrap();
        for command in ["info huge.ply", "render huge.ply -o out.png"] {
            // The whole address space, program and libraries included, is held to 50 MB (ulimit counts in KiB).
            let line = format!("ulimit -v 48828 && exec {PROGRAM} {command}");
            let start = Instant::now();
            let output = Command::new("sh").current_dir(folder.path()).args(["-c", &line]).output().unwrap();
            let time = start.elapsed();
            let message = message_of(&output);
            assert_eq!(output.status.code(), Some(1), "{command}: {message}");
            assert!(message.contains("1000000000") && message.contains("vertex"), "{message}");
            assert!(time < Duration::from_millis(100), "{command}: {time:?}");
        }
    }
}

/// A square of two triangles, textured.
const SQUARE: &str =
    "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";

#[test]
fn a_mesh_is_converted_and_both_render_alike() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("square.obj"), SQUARE).unwrap();
    let said = succeeds(folder.path(), "convert square.obj -o surfels.ply --points 5000 --seed 3");
    assert!(String::from_utf8_lossy(&said.stderr).starts_with("surfels.ply: 5000 points"));
    let cloud = splat_io::read_ply(&folder.path().join("surfels.ply")).unwrap().cloud;
    assert_eq!(cloud.len(), 5000);
    for (index, coordinates) in cloud.texture_coordinates.as_ref().unwrap().iter().enumerate() {
        let place = cloud.world_position(index).as_vec3();
        assert!((2.0 * coordinates.center - place.truncate()).length() < 1e-5, "{place} {coordinates:?}");
    }
    let info = String::from_utf8(succeeds(folder.path(), "info surfels.ply").stdout).unwrap();
    assert!(
        info.contains("ds_du: derivative of a texture coordinate") && info.contains("texture      yes"),
        "{info}"
    );
    let info = String::from_utf8(succeeds(folder.path(), "info square.obj").stdout).unwrap();
    assert!(info.contains("triangles    2, of which without an area: 0\narea         4"), "{info}");
    let json = succeeds(folder.path(), "info --json square.obj").stdout;
    assert_eq!(serde_json::from_slice::<serde_json::Value>(&json).unwrap()["textured"], 2);

    // The same seed and number give the same cloud again, and so the same picture.
    let options = "--view front --size 64x48 --spp 4";
    succeeds(folder.path(), "convert square.obj -o default.ply");
    succeeds(folder.path(), &format!("render default.ply -o a.png {options}"));
    succeeds(folder.path(), &format!("render square.obj -o b.png {options}"));
    let [a, b] = ["a.png", "b.png"].map(|name| read_png(&folder.path().join(name)));
    assert_eq!(a, b);
    let Png { size: [width, height], pixels, .. } = a;
    assert_eq!(pixels[(height / 2 * width + width / 2) as usize][3], 255);
}

/// Writes a PNG of four fields: red and green above, blue and white below.
fn write_texture(path: &Path) {
    const SIDE: usize = 64;
    let mut encoder = png::Encoder::new(fs::File::create(path).unwrap(), SIDE as u32, SIDE as u32);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().unwrap();
    let texel = |i: usize| match (i % SIDE < SIDE / 2, i / SIDE < SIDE / 2) {
        (true, true) => [255, 0, 0],
        (false, true) => [0, 255, 0],
        (true, false) => [0, 0, 255],
        (false, false) => [255; 3],
    };
    let texels: Vec<u8> = (0..SIDE * SIDE).flat_map(texel).collect();
    writer.write_image_data(&texels).unwrap();
}

#[test]
fn a_mesh_shows_its_texture_upright_with_every_mapping_and_surroundings() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("square.obj"), SQUARE).unwrap();
    write_texture(&folder.path().join("texture.png"));
    let corners = |options: &str| {
        let line = format!("render square.obj -o out.png --view front --size 64x64 --spp 4 {options}");
        succeeds(folder.path(), &line);
        let Png { size: [width, _], pixels, .. } = read_png(&folder.path().join("out.png"));
        [(20, 20), (44, 20), (20, 44), (44, 44)].map(|(x, y)| {
            let [red, green, blue, _] = pixels[y * width as usize + x];
            [red > 128, green > 128, blue > 128]
        })
    };
    let [red, green, blue, white] =
        [[true, false, false], [false, true, false], [false, false, true], [true; 3]];
    for options in
        ["", "--texture-detail splat", "--texture-filter trilinear", "--engine reference", "--engine both"]
    {
        let found = corners(&format!("--texture texture.png --texture-wrap clamp {options}"));
        assert_eq!(found, [red, green, blue, white], "{options}");
    }
    let planar = corners("--texture texture.png --mapping planar");
    assert_eq!(planar, [red, green, blue, white]);
    // A flat sheet before the whole sky: seen through, its middle is in the middle, and left is left.
    let through = corners("--environment texture.png --refract 1.000001");
    assert_eq!(through, [red, green, blue, white]);
    // In the mirror is what stands behind the viewer: the image's edges, each on its own side.
    let mirror = corners("--environment texture.png --reflect");
    assert_eq!(mirror, [red, green, blue, white]);
}

#[test]
fn materials_that_make_no_sense_say_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let cloud = sphere(DVec3::ZERO);
    write_ply(&folder.path().join("in.ply"), &cloud, PlyEncoding::Binary).unwrap();
    write_texture(&folder.path().join("t.png"));
    fs::write(folder.path().join("t.jpg"), [0xff, 0xd8, 0xff, 0xe0, 0, 16]).unwrap();
    let cases = [
        ("--mapping planar", 2, "--mapping says nothing without --texture"),
        ("--texture t.png", 2, "add --mapping spherical, cylindrical or planar"),
        ("--texture t.png --mapping planar --texture-repeat 2,2", 2, "--texture-repeat needs --mapping uv"),
        ("--reflect", 2, "need --environment"),
        ("--light 0,0", 2, "--light says nothing without --shading lambert"),
        ("--texture t.jpg --mapping planar", 1, "a JPEG image is not supported"),
        ("--texture none.png --mapping planar", 1, "none.png: cannot open"),
        ("--environment t.png --max-anisotropy 0", 2, "1 to 256"),
    ];
    for (options, code, expected) in cases {
        let message = fails(folder.path(), &format!("render in.ply -o out.png {options}"), code);
        assert!(message.contains(expected), "{options}: {message}");
    }
    assert!(!folder.path().join("out.png").exists());
}

#[test]
fn faces_of_a_ply_file_count_for_convert_alone() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    fs::write(folder.path().join("mesh.ply"), mesh).unwrap();
    succeeds(folder.path(), "convert mesh.ply -o surfels.ply --points 100 --ascii");
    succeeds(folder.path(), "convert surfels.ply -o copy.ply");
    let read = |name: &str| splat_io::read_ply(&folder.path().join(name)).unwrap().cloud;
    assert_eq!(read("surfels.ply").len(), 100);
    assert_eq!(read("surfels.ply"), read("copy.ply"));
    let stats = succeeds(folder.path(), "render mesh.ply -o out.png --size 32x24 --spp 1 --stats -").stdout;
    assert_eq!(serde_json::from_slice::<serde_json::Value>(&stats).unwrap()["splats"]["read"], 3);
}

#[test]
fn meshes_that_cannot_be_converted_say_why() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("points.obj"), "v 0 0 0\n").unwrap();
    fs::write(folder.path().join("line.obj"), "v 0 0 0\nv 1 1 1\nf 1 2 1\n").unwrap();
    fs::write(folder.path().join("wrong.obj"), "v 0 0 0\nf 1 2 x\n").unwrap();
    assert!(fails(folder.path(), "convert points.obj -o out.ply", 1).contains("no face among 1 vertices"));
    assert!(
        fails(folder.path(), "convert line.obj -o out.ply", 1)
            .contains("line.obj: area of the mesh: found 0")
    );
    assert!(
        fails(folder.path(), "convert wrong.obj -o out.ply", 1)
            .contains("wrong.obj: line 2: found `f 1 2 x`")
    );
    assert!(fails(folder.path(), "convert wrong.obj -o out.obj", 2).contains("ends in one of .ply"));
    assert!(fails(folder.path(), "convert wrong.obj -o out.ply --points 0", 2).contains("1 to 20000000"));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3, "nothing is left behind");
}

#[test]
fn real_files_are_rendered_or_refused_and_never_a_panic() {
    let Some(data) = real_files() else { return };
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("out.png");
    let folders = ["clouds", "splats", "tricky_las", "tricky_ply", "tricky_text"];
    let files = folders.map(|name| fs::read_dir(data.join(name)).unwrap());
    for entry in files.into_iter().flatten() {
        let path = entry.unwrap().path();
        let run = Command::new(PROGRAM)
            .args(["render", "--size", "64x48", "--spp", "4", "-o"])
            .args([&output, &path])
            .output()
            .unwrap();
        let message = message_of(&run);
        match run.status.code() {
            Some(0) => fs::remove_file(&output).unwrap(),
            Some(1) => {
                let name = path.file_name().unwrap().to_string_lossy();
                assert!(message.contains(&*name) && !output.exists(), "{message}");
                assert!(!message.contains("panicked"), "{message}");
            }
            code => panic!("{}: {code:?}: {message}", path.display()),
        }
    }
}

#[cfg(unix)]
#[test]
fn a_program_that_is_stopped_ends_at_once_and_leaves_nothing() {
    for (signal, code) in [("INT", 130), ("TERM", 143)] {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("out.png"), "old").unwrap();
        // Minutes of work, of which a moment passes; a machine that is busy may need a second try to be quick.
        let quickest = (0..5).map(|_| {
            let mut child = Command::new(PROGRAM)
                .current_dir(folder.path())
                .args(["demo", "-o", "out.png", "--size", "4000x3000", "--spp", "256", "--quiet"])
                .stderr(std::process::Stdio::null())
                .spawn()
                .unwrap();
            std::thread::sleep(Duration::from_millis(700));
            assert!(child.try_wait().unwrap().is_none(), "it has ended by itself");
            let start = Instant::now();
            let kill = Command::new("kill").args([format!("-{signal}"), child.id().to_string()]).status();
            assert!(kill.unwrap().success());
            assert_eq!(child.wait().unwrap().code(), Some(code));
            start.elapsed()
        });
        let quickest = quickest.min().unwrap();
        assert!(quickest < Duration::from_millis(250), "{signal}: {quickest:?}");
        let left: Vec<_> =
            fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        assert_eq!(left, ["out.png"]);
        assert_eq!(fs::read(folder.path().join("out.png")).unwrap(), b"old");
    }
}
