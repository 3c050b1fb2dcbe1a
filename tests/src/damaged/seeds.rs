//! Small good files of every format, and where in them something begins or ends.

use flate2::Compression as Level;
use flate2::write::GzEncoder;
use glam::{DVec3, Vec3};
use png::{BitDepth, ColorType, Encoder};
use ruzstd::encoding::{CompressionLevel, compress_to_vec};
use splat_core::{AovSelection, Cloud, Field, Film, PixelRect, Shapes};
use splat_io::{
    Compression, ExrOptions, Metadata, PlyEncoding, write_exr, write_las, write_ply, write_splat, write_text,
};
use std::fs;
use std::io::Write;
use std::path::Path;

/// A good file.
#[derive(Debug, Clone)]
pub struct Seed {
    /// What it is, fit for a file's name.
    pub name: &'static str,
    /// What programs tell it by.
    pub extension: &'static str,
    /// The body that reads it: [`crate::fuzz_bodies`].
    pub body: &'static str,
    /// The file.
    pub bytes: Vec<u8>,
    /// Whether it is text, which has other ways to go wrong.
    pub is_text: bool,
    /// Bytes at which something begins, in binary files: a field, a table, a chunk.
    pub boundaries: Vec<usize>,
    /// Where a count or a size stands, and how many bytes it has.
    pub counts: Vec<(usize, usize)>,
    /// In text: what may be replaced, and by what.
    pub replacements: Vec<(&'static str, &'static str)>,
}

fn text(
    name: &'static str,
    extension: &'static str,
    body: &'static str,
    text: impl Into<String>,
    replacements: &[(&'static str, &'static str)],
) -> Seed {
    let bytes = text.into().into_bytes();
    let replacements = replacements.to_vec();
    Seed { name, extension, body, bytes, is_text: true, boundaries: vec![], counts: vec![], replacements }
}

fn binary(
    name: &'static str,
    extension: &'static str,
    body: &'static str,
    bytes: Vec<u8>,
    boundaries: &[usize],
    counts: &[(usize, usize)],
) -> Seed {
    let (boundaries, counts) = (boundaries.to_vec(), counts.to_vec());
    Seed { name, extension, body, bytes, is_text: false, boundaries, counts, replacements: vec![] }
}

/// Every format.
pub fn seeds() -> Vec<Seed> {
    [ply(), trained(), surveys(), pcd(), texts(), meshes_and_points(), cameras(), scenes(), textures()]
        .concat()
}

/// Five surfels with everything that a file can hold.
pub fn surfels() -> Cloud {
    let points = [0.0, 0.3, 0.6, 0.9, 1.2].map(|x| DVec3::new(x, x * x, 0.5 - x));
    let mut cloud = Cloud::from_points(&points);
    cloud.normals = vec![Vec3::Z; 5];
    cloud.shapes = Shapes::Discs(vec![0.25; 5]);
    cloud.colors = Some(vec![Vec3::new(0.5, 0.25, 1.0); 5]);
    cloud.opacities = Some(vec![0.75; 5]);
    cloud.oriented = true;
    cloud
}

/// What a writer writes.
fn written(extension: &str, write: impl FnOnce(&Path)) -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("seed").with_extension(extension);
    write(&path);
    fs::read(path).expect("what was written")
}

fn ply() -> Vec<Seed> {
    let faces = "ply\nformat ascii 1.0\ncomment a small mesh\nelement vertex 4\nproperty float x\nproperty double y\n\
                 property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nelement face 2\n\
                 property list uchar int vertex_indices\nend_header\n0 0 0 255 0 0\n1 0 0 0 255 0\n0 1 0 0 0 255\n\
                 1 1 0.5 9 9 9\n3 0 1 2\n3 1 3 2\n";
    let changes = [
        ("vertex 4", "vertex 18446744073709551615"),
        ("vertex 4", "vertex 4294967295"),
        ("vertex 4", "vertex 3"),
        ("vertex 4", "vertex -1"),
        ("vertex 4", "vertex 4.5"),
        ("vertex 4", "vertex 99999999999999999999999"),
        ("face 2", "face 18446744073709551615"),
        ("face 2", "face 1000000000"),
        ("float x", "list uchar float x"),
        ("float x", "quaternion x"),
        ("double y", "double x"),
        ("property float z\n", ""),
        ("list uchar int", "list float int"),
        ("list uchar int", "list int double"),
        ("3 0 1 2", "4000000000 0 1 2"),
        ("3 0 1 2", "3 0 1 4"),
        ("3 0 1 2", "3 0 1 nan"),
        ("3 0 1 2", "-3 0 1 2"),
        ("1 1 0.5", "nan inf -inf"),
        ("1 1 0.5", "1e-320 4.9e-324 1e-45"),
        ("1 1 0.5", "1e999 -1e999 1e38"),
        ("ascii", "binary_little_endian"),
        ("ascii", "binary_big_endian"),
        ("ascii 1.0", "ascii 2.0"),
        ("end_header\n", ""),
        ("element face 2\n", "element vertex 2\n"),
        ("comment a small mesh", "comment splat origin nan inf 1"),
        ("comment a small mesh", "obj_info \u{1b}[31m\u{7}"),
        ("float x", "float \u{1b}[31mx"),
    ];
    let little = written("ply", |path| write_ply(path, &surfels(), PlyEncoding::Binary).expect("a file"));
    let header = header_end(&little);
    let rows: Vec<usize> = (0..=5).map(|row| header + row * (little.len() - header) / 5).collect();
    // Big endian: the header says so, the numbers do not; every value is another one.
    let swapped = replaced(&little, b"binary_little_endian", b"binary_big_endian");
    let swapped_header = header_end(&swapped);
    let count = find(&little, b"vertex 5") + 7;
    vec![
        text("ply_ascii", "ply", "ply", faces, &changes),
        binary("ply_little", "ply", "ply", little, &rows, &[(count, 1), (header, 4)]),
        binary("ply_big", "ply", "ply", swapped, &[3, swapped_header, swapped_header + 7], &[]),
    ]
}

fn trained() -> Vec<Seed> {
    let names =
        "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3".split(' ');
    let properties: String = names.map(|name| format!("property float {name}\n")).collect();
    let row = [0.5_f32, 1.0, 2.0, 0.1, 0.2, 0.3, 1.0, -2.0, -2.5, -6.0, 1.0, 0.1, 0.2, 0.3];
    let head = format!("ply\nformat binary_little_endian 1.0\nelement vertex 2\n{properties}end_header\n");
    let gaussians =
        [head.as_bytes(), &[row, row].concat().into_iter().flat_map(f32::to_le_bytes).collect::<Vec<_>>()]
            .concat();
    let start = head.len();

    let bounds = "min_x min_y min_z max_x max_y max_z min_scale_x min_scale_y min_scale_z max_scale_x max_scale_y max_scale_z";
    let bounds: String = bounds.split(' ').map(|name| format!("property float {name}\n")).collect();
    let packed =
        ["position", "rotation", "scale", "color"].map(|name| format!("property uint packed_{name}\n"));
    let packed = format!(
        "ply\nformat ascii 1.0\nelement chunk 1\n{bounds}element vertex 2\n{}end_header\n\
         0 0 0 1 1 1 -4 -4 -4 -1 -1 -1\n1234567 99999 7654321 4294967295\n4294967295 0 123 255\n",
        packed.concat()
    );
    let changes = [
        ("chunk 1", "chunk 0"),
        ("chunk 1", "chunk 18446744073709551615"),
        ("vertex 2", "vertex 257"),
        ("vertex 2", "vertex 18446744073709551615"),
        ("0 0 0 1 1 1", "nan inf -inf 1 1 1"),
        ("-4 -4 -4", "1e30 1e30 1e30"),
        ("uint packed_scale", "float packed_scale"),
        ("uint packed_scale", "list uchar uint packed_scale"),
        ("property float max_x\n", ""),
    ];

    let splat = written("splat", |path| _ = write_splat(path, &surfels()).expect("a file"));
    let gzip_of = |version: u32| {
        let mut file = spz_header(version, 3);
        file.extend(spz_streams(version).concat());
        gzip(&file)
    };
    let (second, third) = (gzip_of(2), gzip_of(3));
    let raw = [spz_header(3, 3), spz_streams(3).concat()].concat();
    let fourth = spz_frames();
    let table: Vec<usize> = (0..6).map(|stream| 32 + 16 * stream).collect();
    let sizes: Vec<(usize, usize)> = table.iter().flat_map(|&at| [(at, 8), (at + 8, 8)]).collect();
    vec![
        binary(
            "ply_3dgs",
            "ply",
            "ply",
            gaussians,
            &[start, start + 4, start + 56, start + 60],
            &[(start, 4), (start + 28, 4)],
        ),
        text("ply_packed", "ply", "ply", packed, &changes),
        binary("splat", "splat", "splat", splat, &[1, 12, 31, 32, 64], &[(0, 4), (12, 4), (28, 4)]),
        binary("spz_2", "spz", "spz", second, &[1, 2, 10, 18, 30], &[(4, 4)]),
        binary("spz_3", "spz", "spz", third, &[1, 2, 10, 18, 30], &[(4, 4)]),
        binary(
            "spz_raw",
            "spz",
            "spz",
            raw,
            &[4, 8, 12, 16, 43],
            &[(4, 4), (8, 4), (12, 1), (13, 1), (14, 1)],
        ),
        binary(
            "spz_4",
            "spz",
            "spz",
            fourth,
            &[table, vec![16, 20, 128, 140]].concat(),
            &[sizes, vec![(8, 4), (15, 1), (16, 4)]].concat(),
        ),
    ]
}

fn spz_header(version: u32, count: u32) -> Vec<u8> {
    [b"NGSP", &version.to_le_bytes()[..], &count.to_le_bytes(), &[1, 12, 0, 0]].concat()
}

/// Three splats with harmonics of degree 1.
fn spz_streams(version: u32) -> [Vec<u8>; 6] {
    let rotation = if version == 2 { 3 } else { 4 };
    [9, 1, 3, 3, rotation, 9].map(|bytes| (0..3 * bytes).map(|i| (i * 37 + 90) as u8).collect())
}

fn spz_frames() -> Vec<u8> {
    let streams = spz_streams(4);
    let mut file = spz_header(4, 3);
    file[15] = 6;
    file.extend(32_u32.to_le_bytes());
    file.extend([0; 12]);
    let frames = streams.each_ref().map(|data| compress_to_vec(&data[..], CompressionLevel::Fastest));
    for (frame, data) in frames.iter().zip(&streams) {
        file.extend((frame.len() as u64).to_le_bytes());
        file.extend((data.len() as u64).to_le_bytes());
    }
    file.extend(frames.concat());
    file
}

/// Bytes as a gzip file.
pub fn gzip(data: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Level::best());
    encoder.write_all(data).and_then(|()| encoder.finish()).expect("memory takes what is written")
}

fn surveys() -> Vec<Seed> {
    let cloud = |class: f32| {
        let field = |name: &str, value: f32| Field { name: name.to_owned(), values: vec![value; 5] };
        let fields = vec![field("classification", class), field("intensity", 300.0)];
        Cloud { fields, normals: vec![], opacities: None, ..surfels() }
    };
    let file = |class: f32, is_compressed: bool| {
        written("las", |path| _ = write_las(path, &cloud(class), is_compressed).expect("a file"))
    };
    let header = [4, 24, 26, 94, 100, 104, 131, 155, 179, 226, 227];
    let counts = [(24, 1), (25, 1), (94, 2), (96, 4), (104, 1), (105, 2), (107, 4), (131, 8), (155, 8)];
    let data = |bytes: &[u8]| u32::from_le_bytes([bytes[96], bytes[97], bytes[98], bytes[99]]) as usize;
    let survey = |name, extension, class: f32, is_compressed| {
        let bytes = file(class, is_compressed);
        let data = data(&bytes);
        let mut boundaries = [&header[..], &[data, data + 8, data + 20, data + 26, bytes.len() - 8]].concat();
        let mut counts = counts.to_vec();
        if class > 32.0 {
            boundaries.extend([247, 375]);
            counts.push((247, 8));
        }
        if is_compressed {
            // The record that says how points are compressed, and the table of chunks.
            let vlr = data - 54 - 12;
            boundaries.extend([vlr, data - 12, data + 12, bytes.len() - 4]);
            counts.extend([(vlr, 2), (data - 20, 2), (data, 8), (data + 44, 4), (bytes.len() - 8, 4)]);
        }
        binary(name, extension, "las", bytes, &boundaries, &counts)
    };
    vec![
        survey("las_2", "las", 2.0, false),
        survey("las_7", "las", 100.0, false),
        survey("laz_2", "laz", 2.0, true),
        survey("laz_7", "laz", 100.0, true),
    ]
}

fn pcd() -> Vec<Seed> {
    let head = |data: &str| {
        format!(
            "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 3\nHEIGHT 1\n\
             VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 3\nDATA {data}\n"
        )
    };
    let numbers: Vec<u8> = (0..12_u32).flat_map(|i| (i as f32 * 0.25).to_le_bytes()).collect();
    let rows = head("binary").into_bytes();
    let start = rows.len();
    let rows = [rows, numbers.clone()].concat();
    let packed = head("binary_compressed").into_bytes();
    let packed_start = packed.len();
    // Literals of 32 bytes and of 16.
    let literals = [&[31][..], &numbers[..32], &[15], &numbers[32..]].concat();
    let sizes = [(literals.len() as u32).to_le_bytes(), 48_u32.to_le_bytes()].concat();
    let packed = [packed, sizes, literals].concat();
    let changes = [
        ("POINTS 3", "POINTS 18446744073709551615"),
        ("POINTS 3", "POINTS 4294967294"),
        ("WIDTH 3", "WIDTH 4294967295"),
        ("HEIGHT 1", "HEIGHT 4294967295"),
        ("HEIGHT 1", "HEIGHT 0"),
        ("SIZE 4 4 4 4", "SIZE 4 4 4"),
        ("SIZE 4 4 4 4", "SIZE 8 1 3 4"),
        ("TYPE F F F U", "TYPE I U F X"),
        ("COUNT 1 1 1 1", "COUNT 1 1 1 65536"),
        ("COUNT 1 1 1 1", "COUNT 1 1 1 18446744073709551615"),
        ("COUNT 1 1 1 1", "COUNT 0 1 1 1"),
        ("FIELDS x y z rgb", "FIELDS x x x x"),
        ("FIELDS x y z rgb", "FIELDS a b c d"),
        ("FIELDS x y z rgb", "FIELDS"),
        ("VIEWPOINT 0 0 0 1 0 0 0", "VIEWPOINT nan inf"),
        ("DATA ascii", "DATA binary"),
        ("DATA ascii", "DATA binary_compressed"),
        ("DATA ascii", "DATA"),
        ("1 2 3 255", "nan inf -inf 255"),
        ("1 2 3 255", "1 2 3 99999999999"),
        ("1 2 3 255", "1 2 3"),
        ("VERSION 0.7", "VERSION 0.7\nPOINTS 9"),
    ];
    let ascii = head("ascii") + "1 2 3 255\n2 3 4 65535\n3.5 4.25 5 16777215\n";
    vec![
        text("pcd_ascii", "pcd", "pcd", ascii, &changes),
        binary("pcd_binary", "pcd", "pcd", rows, &[start, start + 5, start + 16, start + 47], &[(start, 4)]),
        binary(
            "pcd_packed",
            "pcd",
            "pcd",
            packed,
            &[packed_start, packed_start + 4, packed_start + 8, packed_start + 9, packed_start + 41],
            &[(packed_start, 4), (packed_start + 4, 4), (packed_start + 8, 1)],
        ),
    ]
}

fn texts() -> Vec<Seed> {
    let xyz = written("xyz", |path| write_text(path, &surfels(), ' ').expect("a file"));
    let xyz = String::from_utf8(xyz).expect("text");
    let changes = [
        ("0.09", "nan"),
        ("0.09", "1e400"),
        ("0.09", "0,3"),
        ("0.09", "0x1p3"),
        ("0.09", "4.9e-324"),
        ("0.09", "-inf"),
        ("0.09 ", ""),
        ("0.09", "0.3 0.3"),
    ];
    let csv = "x,y,z,intensity,name\n1,2,3,0.5,7\n2,3,4,0.25,8\n3,4,5,1,9\n";
    let columns = [
        ("x,y,z", "x,x,x"),
        ("x,y,z", "a,b,c"),
        ("intensity,name", "intensity"),
        ("1,2,3,0.5,7", "1,2,3,0.5,7,8,9"),
        ("1,2,3,0.5,7", "1,2,3"),
        ("1,2,3,0.5,7", ",,,,"),
        ("2,3,4,0.25", "2;3;4;0.25"),
        ("name", "\u{1b}[2J\u{7}"),
    ];
    let pts = "3\n1 2 3 -1000 255 0 0\n2 3 4 -900 0 255 0\n3 4 5 -800 0 0 255\n";
    let claims = [
        ("3\n1", "18446744073709551615\n1"),
        ("3\n1", "99999999999999999999999\n1"),
        ("3\n1", "0\n1"),
        ("3\n1", "4\n1"),
        ("3\n1", "-3\n1"),
        ("3\n1", "3\n3\n3\n1"),
    ];
    vec![
        text("xyz", "xyz", "text", xyz, &changes),
        text("csv", "csv", "text", csv, &columns),
        text("pts", "pts", "text", pts, &claims),
    ]
}

fn meshes_and_points() -> Vec<Seed> {
    let obj = "# a mesh\nmtllib x.mtl\nv 0 0 0\nv 1 0 0 1 0.5 0\nv 0 1 0\nv 1 1 0.5\nvt 0 0\nvt 1 0\nvn 0 0 1\n\
               f 1/1/1 2/2/1 3/1/1\nf 2//1 4//1 3//1\nf -1 -2 -3\n";
    let changes = [
        ("f -1 -2 -3", "f 1 2 18446744073709551615"),
        ("f -1 -2 -3", "f 1 2 4294967295"),
        ("f -1 -2 -3", "f 0 1 2"),
        ("f -1 -2 -3", "f -9223372036854775808 1 2"),
        ("f -1 -2 -3", "f 1 2"),
        ("f -1 -2 -3", "f 1/2/3/4 2 3"),
        ("f -1 -2 -3", "f 1 1 1"),
        ("f -1 -2 -3", "f 9 9 9"),
        ("f -1 -2 -3", "f 1 2 \\"),
        ("v 0 1 0", "v nan inf -inf"),
        ("v 0 1 0", "v 1e308 1e308 -1e308"),
        ("v 0 1 0", "v 0 1"),
        ("v 0 1 0", "v 4.9e-324 1e-320 0"),
        ("vn 0 0 1", "vn nan 0 0"),
        ("vt 1 0", "vt"),
        ("mtllib x.mtl", "\u{1b}[31m nonsense"),
    ];
    let points = "# points\n1 1.5 -2 3.25 0 128 255 0.5\n9 1.5 -2 29.25 0 128 255 0.5 1 2\n";
    let point_changes = [
        ("1 1.5", "-1 1.5"),
        ("1.5 -2", "nan inf"),
        ("0 128 255", "0 128 256"),
        ("0.5 1 2", "1e999 1 2"),
        ("9 1.5", "99999999999999999999999 1.5"),
        ("-2 29.25", "-2"),
    ];
    let mut table = 2_u64.to_le_bytes().to_vec();
    for (number, track) in [(1_u64, 0_u64), (9, 1)] {
        table.extend(number.to_le_bytes());
        table.extend([1.5_f64, -2.0, 3.25].map(f64::to_le_bytes).concat());
        table.extend([0, 128, 255]);
        table.extend(0.5_f64.to_le_bytes());
        table.extend(track.to_le_bytes());
        table.extend(vec![7; 8 * track as usize]);
    }
    vec![
        text("obj", "obj", "obj", obj, &changes),
        text("points3d_text", "txt", "points3d_text", points, &point_changes),
        binary(
            "points3d",
            "bin",
            "points3d_binary",
            table,
            &[8, 16, 40, 43, 51, 59, 102],
            &[(0, 8), (16, 8), (51, 8), (102, 8)],
        ),
    ]
}

const LENSES: &str = "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n1 PINHOLE 640 480 500 500 320 240\n";
const IMAGES: &str = "1 1 0 0 0 0.5 -0.25 2 1 a.png\n1 2 -1\n";

fn cameras() -> Vec<Seed> {
    let identity = "[[1,0,0,0],[0,1,0,0],[0,0,1,4],[0,0,0,1]]";
    let own = format!(
        "{{\"model\":\"pinhole\",\"width\":8,\"height\":6,\"fx\":9,\"fy\":9,\"cx\":4,\"cy\":3,\"world_to_camera\":{identity}}}"
    );
    let own_changes = [
        ("\"width\":8", "\"width\":18446744073709551615"),
        ("\"width\":8", "\"width\":65537"),
        ("\"width\":8", "\"width\":0"),
        ("\"width\":8", "\"width\":-8"),
        ("\"width\":8", "\"width\":8.5"),
        ("\"width\":8", "\"width\":\"8\""),
        ("\"width\":8", "\"width\":8,\"width\":9"),
        ("\"fx\":9", "\"fx\":1e999"),
        ("\"fx\":9", "\"fx\":NaN"),
        ("\"fx\":9", "\"fx\":-9"),
        ("\"fx\":9", "\"fx\":4.9e-324"),
        ("\"fx\":9", "\"fx\":null"),
        ("pinhole", "orthographic"),
        ("pinhole", "\\u0000\\ud800"),
        ("[0,0,1,4]", "[0,0,0,0]"),
        ("[0,0,1,4]", "[0,0,1e308,1e308]"),
        ("[0,0,1,4]", "[0,0,1]"),
        ("\"fy\":9", "\"fy\":9,\"\\u001b[31m\":1"),
    ];
    let list = format!("{{\"cameras\":[{own},{own}]}}");
    let transforms = format!(
        "{{\"camera_angle_x\":0.7,\"w\":8,\"h\":6,\"frames\":[{{\"file_path\":\"a\",\"transform_matrix\":{identity}}}]}}"
    );
    let transform_changes = [
        ("0.7", "0"),
        ("0.7", "1e308"),
        ("0.7", "-1"),
        ("\"w\":8", "\"w\":1e30"),
        ("\"w\":8", "\"w\":0.5"),
        ("[0,0,1,4]", "[0,0,-1,4]"),
        ("[1,0,0,0]", "[1e200,0,0,0]"),
        ("\"a\"", "\"../../../../../../etc/passwd\""),
        ("\"a\"", "\"\\u0000\""),
        ("\"frames\":[", "\"frames\":[],\"x\":["),
    ];
    let parameters = "{\"extrinsic\":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,4,1],\"intrinsic\":{\"width\":8,\"height\":6,\
                      \"intrinsic_matrix\":[9,0,0,0,9,0,4,3,1]}}";
    let log = "0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 4\n0 0 0 1\n1 1 2\n1 0 0 0\n0 1 0 0\n0 0 1 5\n0 0 0 1\n";
    let log_changes = [
        ("0 0 1 4", "nan 0 1 4"),
        ("0 0 1 4", "0 0 1"),
        ("0 0 1 4", "0 0 1e300 4"),
        ("0 0 1\n", "-1 99999999999999999999 1\n"),
        ("0 0 0 1\n1 1 2", "1 1 2"),
    ];
    let trained = "[{\"id\":0,\"img_name\":\"a\",\"width\":8,\"height\":6,\"position\":[0,0,1],\
                   \"rotation\":[[1,0,0],[0,1,0],[0,0,1]],\"fy\":9,\"fx\":9}]";
    let trained_changes = [
        ("[0,0,1]]", "[0,0,0]]"),
        ("\"position\":[0,0,1]", "\"position\":[0,0,1e308]"),
        ("\"width\":8", "\"width\":4294967295"),
        ("\"img_name\":\"a\"", "\"img_name\":7"),
    ];
    let lens_changes = [
        ("PINHOLE", "OPENCV_FISHEYE"),
        ("640 480", "4294967295 480"),
        ("640 480", "0 0"),
        ("500 500 320 240", "500"),
        ("500 500 320 240", "nan inf 320 240"),
        ("1 0 0 0 0.5", "0 0 0 0 0.5"),
        ("1 0 0 0 0.5", "nan 0 0 0 0.5"),
        ("2 1 a.png", "2 7 a.png"),
        ("2 1 a.png", "2 1"),
        ("1 2 -1", "x.png"),
        ("1 PINHOLE", "1 PINHOLE 640 480 500 500 320 240\n1 PINHOLE"),
    ];
    let lens =
        [&1_u32.to_le_bytes()[..], &1_i32.to_le_bytes(), &640_u64.to_le_bytes(), &480_u64.to_le_bytes()]
            .concat();
    let lens =
        [1_u64.to_le_bytes().to_vec(), lens, [500.0_f64, 500.0, 320.0, 240.0].map(f64::to_le_bytes).concat()]
            .concat();
    let pose = [1.0_f64, 0.0, 0.0, 0.0, 0.5, -0.25, 2.0].map(f64::to_le_bytes).concat();
    let image = [
        &1_u64.to_le_bytes()[..],
        &1_u32.to_le_bytes(),
        &pose,
        &1_u32.to_le_bytes(),
        b"a.png\0",
        &0_u64.to_le_bytes(),
    ]
    .concat();
    let start = 2 + lens.len();
    let model = [&(lens.len() as u16).to_le_bytes()[..], &lens, &image].concat();
    vec![
        text("camera", "json", "camera_json", own, &own_changes),
        text("camera_list", "json", "cameras", list, &own_changes[..6]),
        text("transforms", "json", "cameras", transforms, &transform_changes),
        text("open3d", "json", "cameras", parameters, &[("[9,0,0", "[0,0,0"), ("[1,0,0,0,0", "[1,0,0,0")]),
        text("trajectory", "log", "cameras", log, &log_changes),
        text("cameras_3dgs", "json", "cameras", trained, &trained_changes),
        text("colmap_text", "colmap", "colmap_text", format!("{LENSES}\n---\n{IMAGES}"), &lens_changes),
        binary(
            "colmap",
            "colmap",
            "colmap_binary",
            model,
            &[2, 10, 14, 18, 34, 60, start, start + 8, start + 12, start + 68, start + 75],
            &[(2, 8), (14, 4), (18, 8), (34, 8), (start, 8), (start + 12, 8), (start + 78, 8)],
        ),
    ]
}

fn scenes() -> Vec<Seed> {
    let scene = "[[cloud]]\npath = \"good.ply\"\nscale = 0.5\nrotate = [90, 0, 0]\ntranslate = [0, 0, 1.5]\n\n[film]\nsize = \"8x6\"\n\
                 spp = 1\n";
    let changes = [
        ("0.5", "nan"),
        ("0.5", "0"),
        ("0.5", "inf"),
        ("0.5", "1e-320"),
        ("0.5", "\"0.5\""),
        ("[90, 0, 0]", "[90, 0]"),
        ("[90, 0, 0]", "[[90], 0, 0]"),
        ("[90, 0, 0]", "{x = 1}"),
        ("[90, 0, 0]", "1979-05-27"),
        ("[0, 0, 1.5]", "[0, 0, 1e308]"),
        ("\"good.ply\"", "\"\""),
        ("\"good.ply\"", "\"/dev/zero\""),
        ("\"good.ply\"", "\"/dev/stdin\""),
        ("\"good.ply\"", "\"good.ply\\u0000\""),
        ("[[cloud]]", "[cloud]"),
        ("[film]", "[[film]]"),
        ("[film]", "[\"\\u001b[31m\"]"),
        ("spp = 1", "spp = 18446744073709551615"),
        ("spp = 1", "spp = -1"),
        ("spp = 1", "spp = 1\nspp = 1"),
        ("spp = 1", "\"\\u001b[31m\" = 1"),
        ("8x6", "65536x65536"),
        ("8x6", "0x0"),
    ];
    vec![text("scene", "toml", "scene", scene, &changes)]
}

/// A PNG file of 16 x 16 pixels.
pub fn png(color: ColorType, depth: BitDepth) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, 16, 16);
    encoder.set_color(color);
    encoder.set_depth(depth);
    if color == ColorType::Indexed {
        encoder.set_palette((0..48).collect::<Vec<u8>>());
    }
    let samples = 16 * color.samples() * if depth == BitDepth::Sixteen { 2 } else { 1 };
    let data: Vec<u8> = (0..16 * samples).map(|i| (i * 7 % 16) as u8).collect();
    encoder
        .write_header()
        .and_then(|mut writer| writer.write_image_data(&data))
        .expect("a PNG file in memory");
    bytes
}

fn textures() -> Vec<Seed> {
    let mut seeds: Vec<Seed> = [
        ("png_rgb8", ColorType::Rgb, BitDepth::Eight),
        ("png_rgba16", ColorType::Rgba, BitDepth::Sixteen),
        ("png_palette", ColorType::Indexed, BitDepth::Eight),
    ]
    .into_iter()
    .map(|(name, color, depth)| {
        let bytes = png(color, depth);
        let data = find(&bytes, b"IDAT");
        let boundaries =
            [4, 8, 16, 24, 29, 33, data - 4, data, data + 4, data + 9, bytes.len() - 12, bytes.len() - 4];
        let counts = [(8, 4), (16, 4), (20, 4), (24, 1), (25, 1), (28, 1), (data - 4, 4), (data + 4, 4)];
        binary(name, "png", "texture", bytes, &boundaries, &counts)
    })
    .collect();
    let exr = [
        ("exr_none", Compression::None, true),
        ("exr_rle", Compression::Rle, false),
        ("exr_zip", Compression::Zip, false),
        ("exr_piz", Compression::Piz, true),
    ];
    for (name, compression, full_floats) in exr {
        let window = PixelRect::new(0, 0, 20, 18);
        let mut film = Film::new([20, 18], window, AovSelection::default());
        for (index, pixel) in film.rgba.iter_mut().enumerate() {
            *pixel = [index as f32 / 400.0, 0.5, 0.25, 1.0];
        }
        let options = ExrOptions { full_floats, compression, parallel: false };
        let bytes =
            written("exr", |path| write_exr(path, &film, &Metadata::default(), &options).expect("a file"));
        let at = |attribute: &[u8]| find(&bytes, attribute) + attribute.len();
        let channels = at(b"channels\0chlist\0");
        let window = at(b"dataWindow\0box2i\0") + 4;
        let compression = at(b"compression\0compression\0") + 4;
        let boundaries = [
            4,
            8,
            channels,
            channels + 4,
            channels + 22,
            window,
            compression,
            bytes.len() / 2,
            bytes.len() - 9,
        ];
        let counts = [
            (4, 4),
            (channels, 4),
            (channels + 6, 4),
            (channels + 14, 4),
            (window, 4),
            (window + 8, 4),
            (window + 12, 4),
            (compression, 1),
        ];
        seeds.push(binary(name, "exr", "texture", bytes, &boundaries, &counts));
    }
    seeds
}

/// The place of some bytes, which are there.
fn find(bytes: &[u8], what: &[u8]) -> usize {
    bytes.windows(what.len()).position(|window| window == what).expect("a good file has it")
}

/// The first byte behind the header of a PLY file.
fn header_end(bytes: &[u8]) -> usize {
    find(bytes, b"end_header\n") + 11
}

fn replaced(bytes: &[u8], from: &[u8], to: &[u8]) -> Vec<u8> {
    let at = find(bytes, from);
    [&bytes[..at], to, &bytes[at + from.len()..]].concat()
}
