//! Bad files: what can be wrong with a good file of any format, done to one of each. Every run makes the same files.

mod seeds;

pub use seeds::{Seed, png, seeds, surfels};

use crate::random::Random;
use ::png::{BitDepth, ColorType};
use std::collections::BTreeSet;

/// A bad file; perhaps not bad enough for its reader to notice.
#[derive(Debug, Clone)]
pub struct DamagedFile {
    /// What it is and what was done to it: no other file has this name.
    pub name: String,
    /// The extension, by which programs tell what it is meant to be.
    pub extension: &'static str,
    /// The body that reads it: [`crate::fuzz_bodies`].
    pub body: &'static str,
    /// The file.
    pub bytes: Vec<u8>,
}

/// The two files of a COLMAP model in one text: the cameras before the first line of `---`, the images behind it.
pub fn model_of_text(bytes: &[u8]) -> [(&str, &[u8]); 2] {
    const BETWEEN: &[u8] = b"\n---\n";
    let at = bytes.windows(BETWEEN.len()).position(|window| window == BETWEEN);
    let (cameras, images) = at.map_or((bytes, &[][..]), |at| (&bytes[..at], &bytes[at + BETWEEN.len()..]));
    [("cameras.txt", cameras), ("images.txt", images)]
}

/// The two files of a binary COLMAP model in one: the first two bytes say how many of the others are the cameras.
pub fn model_of_binary(bytes: &[u8]) -> [(&str, &[u8]); 2] {
    let (length, rest) = bytes.split_first_chunk::<2>().unwrap_or((&[0; 2], &[]));
    let (cameras, images) = rest.split_at(usize::from(u16::from_le_bytes(*length)).min(rest.len()));
    [("cameras.bin", cameras), ("images.bin", images)]
}

/// Files of which one byte was changed, per good file.
const FLIPS: usize = 6;

/// Size of a comment, a word or a line that is much too long, in bytes.
const HUGE: usize = 1 << 20;

/// Depth of brackets in brackets.
const DEEP: usize = 100_000;

/// All of them.
pub fn corpus() -> Vec<DamagedFile> {
    let mut files = Vec::new();
    for seed in seeds() {
        let mut add = |what: String, bytes: Vec<u8>| {
            files.push(DamagedFile {
                name: format!("{}-{what}", seed.name),
                extension: seed.extension,
                body: seed.body,
                bytes,
            });
        };
        anything(&seed, &mut add);
        if seed.is_text { lines(&seed, &mut add) } else { fields(&seed, &mut add) }
    }
    files.extend(nested());
    files.extend(bombs());
    files
}

/// What can be done to the bytes of any file.
fn anything(seed: &Seed, add: &mut impl FnMut(String, Vec<u8>)) {
    let bytes = &seed.bytes;
    add("empty".to_owned(), Vec::new());
    add("twice".to_owned(), [&bytes[..], bytes].concat());
    add("zeros".to_owned(), vec![0; bytes.len()]);
    let mut random = Random::new(bytes.len() as u64);
    for flip in 0..FLIPS {
        let mut bytes = bytes.clone();
        let at = random.index(bytes.len());
        bytes[at] ^= 1 << random.index(8);
        bytes[random.index(seed.bytes.len())] = random.index(256) as u8;
        add(format!("flip{flip}"), bytes);
    }
}

/// What can be wrong with the fields of a binary file.
fn fields(seed: &Seed, add: &mut impl FnMut(String, Vec<u8>)) {
    for at in seed.boundaries.iter().copied().collect::<BTreeSet<usize>>() {
        add(format!("cut{at}"), seed.bytes[..at.min(seed.bytes.len())].to_vec());
    }
    for (number, &(at, size)) in seed.counts.iter().enumerate() {
        // Greatest, least, one too many; and, of a float, not a number and the least positive.
        let values = [u64::MAX, 0, 1 << (8 * size - 1), 0x7ff0_0000_7fc0_0001, 1];
        for value in &values[..if size < 4 { 3 } else { 5 }] {
            let mut bytes = seed.bytes.clone();
            let Some(field) = bytes.get_mut(at..at + size) else { continue };
            field.copy_from_slice(&value.to_le_bytes()[..size]);
            if bytes != seed.bytes {
                add(format!("field{number}x{value:x}"), bytes);
            }
        }
        let mut bytes = seed.bytes.clone();
        if let Some(field) = bytes.get_mut(at..at + size) {
            field.reverse();
            if bytes != seed.bytes {
                add(format!("field{number}swapped"), bytes);
            }
        }
    }
}

/// What can be wrong with the lines and words of a text.
fn lines(seed: &Seed, add: &mut impl FnMut(String, Vec<u8>)) {
    let text = String::from_utf8_lossy(&seed.bytes).into_owned();
    let ends = text.bytes().enumerate().filter(|(_, byte)| b"\n,".contains(byte)).map(|(at, _)| at);
    let ends: Vec<usize> = ends.collect();
    // At most a dozen, spread evenly.
    for at in ends.iter().step_by(ends.len().div_ceil(12).max(1)) {
        add(format!("cut{at}"), seed.bytes[..*at].to_vec());
    }
    for (number, (from, to)) in seed.replacements.iter().enumerate() {
        assert!(text.contains(from), "{}: no {from} in {text}", seed.name);
        add(format!("change{number}"), text.replacen(from, to, 1).into_bytes());
    }
    add("crlf".to_owned(), text.replace('\n', "\r\n").into_bytes());
    add("cr".to_owned(), text.replace('\n', "\r").into_bytes());
    add("bom".to_owned(), format!("\u{feff}{text}").into_bytes());
    add("utf16".to_owned(), text.encode_utf16().flat_map(u16::to_le_bytes).collect());
    add(
        "latin1".to_owned(),
        [&seed.bytes[..seed.bytes.len() / 2], b"\xe9\xff", &seed.bytes[seed.bytes.len() / 2..]].concat(),
    );
    let first = text.find('\n').map_or(0, |end| end + 1);
    let (head, tail) = text.split_at(first);
    let comment = if seed.name.starts_with("ply") { "comment " } else { "# " };
    add("comment".to_owned(), format!("{head}{comment}{}\n{tail}", "x".repeat(HUGE)).into_bytes());
    add(
        "comments".to_owned(),
        format!("{head}{}{tail}", format!("{comment}x\n").repeat(HUGE / 10)).into_bytes(),
    );
    add("word".to_owned(), format!("{text}{}", "9".repeat(HUGE)).into_bytes());
    add("words".to_owned(), format!("{text}{}", "9 ".repeat(HUGE / 2)).into_bytes());
    add("blanks".to_owned(), format!("{text}{}", "\n".repeat(HUGE)).into_bytes());
    add("nul".to_owned(), format!("{head}\0{tail}").into_bytes());
    if let Some(last) = text.trim_end().lines().last() {
        add("more".to_owned(), format!("{text}{last}\n").into_bytes());
    }
}

/// Brackets in brackets in brackets.
fn nested() -> Vec<DamagedFile> {
    let file = |name: &str, extension, body, text: String| DamagedFile {
        name: format!("nested-{name}"),
        extension,
        body,
        bytes: text.into_bytes(),
    };
    let [arrays, objects] = ["[", "{\"a\":"].map(|open| open.repeat(DEEP));
    let inline = "{a=".repeat(DEEP);
    let table: String = vec!["a"; DEEP].join(".");
    let long = "a".repeat(HUGE);
    vec![
        file("arrays", "json", "cameras", arrays.clone()),
        file("objects", "json", "cameras", objects.clone()),
        file("frames", "json", "cameras", format!("{{\"frames\":{arrays}")),
        file("ignored", "json", "cameras", format!("{{\"x\":{arrays}")),
        file("camera", "json", "camera_json", objects),
        file("key", "json", "camera_json", format!("{{\"{long}\":1}}")),
        file("keys", "json", "camera_json", format!("{{\"\\u001b[31m\\n{long}\":1}}")),
        file("string", "json", "cameras", format!("{{\"model\":\"{long}\"}}")),
        file("array", "toml", "scene", format!("a = {arrays}")),
        file("inline", "toml", "scene", format!("a = {inline}")),
        file("table", "toml", "scene", format!("[{table}]\n")),
        file("tables", "toml", "scene", "[[cloud]]\n".repeat(20_000)),
        file("dotted", "toml", "scene", format!("{table} = 1\n")),
        file("name", "toml", "scene", format!("{long} = 1\n")),
        file("path", "toml", "scene", format!("[[cloud]]\npath = \"{}\"\n", "x".repeat(HUGE / 2))),
        file("polygon", "obj", "obj", format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf{}\n", " 1 2 3".repeat(HUGE / 6))),
        file("continued", "obj", "obj", "\\\n".repeat(HUGE / 2)),
        file(
            "elements",
            "ply",
            "ply",
            format!("ply\nformat ascii 1.0\n{}end_header\n", "element a 1\n".repeat(20_000)),
        ),
        file(
            "properties",
            "ply",
            "ply",
            format!(
                "ply\nformat ascii 1.0\nelement vertex 1\n{}end_header\n",
                (0..30_000).map(|i| format!("property float f_rest_{i}\n")).collect::<String>()
            ),
        ),
        file(
            "long_name",
            "ply",
            "ply",
            format!(
                "ply\nformat ascii 1.0\nelement vertex 1\nproperty float {}\nend_header\n",
                "x".repeat(HUGE / 2)
            ),
        ),
    ]
}

/// Files that become much more than they are.
fn bombs() -> Vec<DamagedFile> {
    let file = |name: &str, extension, body, bytes| DamagedFile {
        name: format!("bomb-{name}"),
        extension,
        body,
        bytes,
    };
    let mut gray = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut gray, 8192, 8192);
    encoder.set_color(ColorType::Grayscale);
    encoder.set_depth(BitDepth::Eight);
    let written = encoder.write_header().and_then(|mut writer| writer.write_image_data(&vec![0; 1 << 26]));
    written.expect("a PNG file in memory");
    // The same few bytes for a picture that they cannot hold, with the checksum of the header made to fit.
    let small = png(ColorType::Rgba, BitDepth::Sixteen);
    let claim = |width: u32, height: u32| {
        let mut bytes = small.clone();
        bytes[16..20].copy_from_slice(&width.to_be_bytes());
        bytes[20..24].copy_from_slice(&height.to_be_bytes());
        let mut checksum = flate2::Crc::new();
        checksum.update(&bytes[12..29]);
        bytes[29..33].copy_from_slice(&checksum.sum().to_be_bytes());
        bytes
    };
    let zeros = |count: usize| seeds::gzip(&vec![0; count]);
    let splats = |count: u32| {
        let header = [b"NGSP", &3_u32.to_le_bytes()[..], &count.to_le_bytes(), &[3, 12, 0, 0]].concat();
        seeds::gzip(&[header, vec![0; 1 << 25]].concat())
    };
    let lzf = |whole: u32| {
        let head = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 357913941\nHEIGHT 1\nDATA binary_compressed\n";
        let packed = [&[0, 0][..], &[0xe0, 0xff, 0].repeat(10_000)].concat();
        [head.as_bytes(), &(packed.len() as u32).to_le_bytes(), &whole.to_le_bytes(), &packed].concat()
    };
    vec![
        file("png", "png", "texture", gray),
        file("png_claim", "png", "texture", claim(16384, 16384)),
        file("png_axis", "png", "texture", claim(u32::MAX >> 1, 1)),
        file("png_most", "png", "texture", claim(u32::MAX >> 1, u32::MAX >> 1)),
        file("gzip", "spz", "spz", zeros(1 << 28)),
        file("spz", "spz", "spz", splats(1 << 19)),
        file("spz_claim", "spz", "spz", splats(u32::MAX - 1)),
        file("pcd", "pcd", "pcd", lzf(4_294_967_292)),
    ]
}
