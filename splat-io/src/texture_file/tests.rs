//! Exact values of small images, and damaged ones.

use super::*;
use ::exr as exr_crate;
use ::png::{BitDepth, ColorType, Encoder};
use exr_crate::compression::Compression;
use exr_crate::prelude::{
    AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples, Image as ExrImage, Layer, LayerAttributes,
    LineOrder, SmallVec, Vec2, WritableImage, f16,
};
use proptest::prelude::*;
use splat_core::srgb::decode;
use std::io::Cursor;

fn read_bytes(bytes: &[u8]) -> Result<Pyramid, Error> {
    read_pyramid_from(Cursor::new(bytes), bytes.len() as u64, Path::new("x"), [Wrap::Clamp; 2])
}

fn message(bytes: &[u8]) -> String {
    read_bytes(bytes).unwrap_err().to_string()
}

fn texels(bytes: &[u8]) -> Texels {
    read_bytes(bytes).unwrap().levels()[0].texels().clone()
}

/// A PNG image; `edit` may add chunks.
fn png_bytes(
    size: [u32; 2],
    color: ColorType,
    depth: BitDepth,
    data: &[u8],
    edit: impl FnOnce(&mut Encoder<'_, &mut Vec<u8>>),
) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, size[0], size[1]);
    encoder.set_color(color);
    encoder.set_depth(depth);
    edit(&mut encoder);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(data).unwrap();
    writer.finish().unwrap();
    bytes
}

fn png(size: [u32; 2], color: ColorType, depth: BitDepth, data: &[u8]) -> Vec<u8> {
    png_bytes(size, color, depth, data, |_| {})
}

#[test]
fn small_grey_codes_span_0_to_255() {
    let grey = |depth, data: &[u8], width| texels(&png([width, 1], ColorType::Grayscale, depth, data));
    assert_eq!(grey(BitDepth::One, &[0b0110_0000], 3), Texels::Srgb8(vec![0, 255, 255]));
    assert_eq!(grey(BitDepth::Two, &[0b0001_1011], 4), Texels::Srgb8(vec![0, 85, 170, 255]));
    assert_eq!(grey(BitDepth::Four, &[0x0f, 0x20], 3), Texels::Srgb8(vec![0, 255, 34]));
    assert_eq!(grey(BitDepth::Eight, &[0, 7, 255], 3), Texels::Srgb8(vec![0, 7, 255]));
}

#[test]
fn a_palette_is_looked_up_and_may_be_transparent() {
    let colors = [1, 2, 3, 200, 100, 50];
    let bytes = |alphas: Option<Vec<u8>>| {
        png_bytes([2, 1], ColorType::Indexed, BitDepth::One, &[0b0100_0000], |encoder| {
            encoder.set_palette(colors.to_vec());
            if let Some(alphas) = alphas {
                encoder.set_trns(alphas);
            }
        })
    };
    assert_eq!(texels(&bytes(None)), Texels::Srgb8(colors.to_vec()));
    assert_eq!(texels(&bytes(Some(vec![255, 255]))), Texels::Srgb8(colors.to_vec()), "all opaque");
    let Texels::F16(values) = texels(&bytes(Some(vec![255, 51]))) else { panic!("expected F16") };
    let linear = |code: u8, alpha: f32| f16::from_f32(decode(f64::from(code) / 255.0) as f32 * alpha);
    let fifth = 51.0 / 255.0;
    let expected = [
        [linear(1, 1.0), linear(2, 1.0), linear(3, 1.0), f16::ONE],
        [linear(200, fifth), linear(100, fifth), linear(50, fifth), f16::from_f32(fifth)],
    ];
    assert_eq!(values, expected.concat());
}

#[test]
fn sixteen_bits_become_linear_floats() {
    let bytes = png([3, 1], ColorType::Grayscale, BitDepth::Sixteen, &[0, 0, 0x80, 1, 0xff, 0xff]);
    let middle = decode(f64::from(0x8001) / 65535.0) as f32;
    assert_eq!(texels(&bytes), Texels::F32(vec![0.0, middle, 1.0]));

    let opaque = png([1, 1], ColorType::GrayscaleAlpha, BitDepth::Sixteen, &[0x80, 1, 0xff, 0xff]);
    assert_eq!(texels(&opaque), Texels::F32(vec![middle]), "alpha is dropped");
    let clear = png([1, 1], ColorType::GrayscaleAlpha, BitDepth::Sixteen, &[0x80, 1, 0x33, 0x33]);
    let alpha = f32::from(0x3333_u16) / 65535.0;
    assert_eq!(texels(&clear), Texels::F32(vec![middle * alpha, alpha]));
    let color = png([1, 1], ColorType::Rgba, BitDepth::Sixteen, &[0xff, 0xff, 0, 0, 0x80, 1, 0, 0]);
    assert_eq!(texels(&color), Texels::F32(vec![0.0; 4]), "nothing is left of invisible colours");
}

#[test]
fn a_transparent_grey_or_colour_counts() {
    let grey = png_bytes([2, 1], ColorType::Grayscale, BitDepth::Eight, &[255, 9], |encoder| {
        encoder.set_trns(vec![0, 9]);
    });
    assert_eq!(texels(&grey), Texels::F16(vec![f16::ONE, f16::ONE, f16::ZERO, f16::ZERO]));
    let color = png_bytes([1, 2], ColorType::Rgb, BitDepth::Eight, &[255, 255, 255, 1, 2, 3], |encoder| {
        encoder.set_trns(vec![0, 7, 0, 7, 0, 7]);
    });
    let pyramid = read_bytes(&color).unwrap();
    assert_eq!((pyramid.channels(), pyramid.levels()[0].size()), (3, [1, 2]), "no pixel has that colour");
    assert_eq!(*pyramid.levels()[0].texels(), Texels::Srgb8(vec![255, 255, 255, 1, 2, 3]));
}

#[test]
fn the_first_row_is_on_top_and_gamma_is_ignored() {
    let bytes = png_bytes(
        [2, 2],
        ColorType::Rgb,
        BitDepth::Eight,
        &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11],
        |encoder| {
            encoder.set_source_gamma(::png::ScaledFloat::new(1.0));
        },
    );
    assert_eq!(texels(&bytes), Texels::Srgb8((0..12).collect()));
}

/// An interlaced grey image of 8 x 8, made by hand: the encoder cannot.
#[test]
fn interlaced_rows_are_put_in_order() {
    let code = |x: usize, y: usize| (x * 16 + y) as u8;
    // Start and step of each pass, in x and y.
    let passes =
        [[0, 8, 0, 8], [4, 8, 0, 8], [0, 4, 4, 8], [2, 4, 0, 4], [0, 2, 2, 4], [1, 2, 0, 2], [0, 1, 1, 2]];
    let mut lines = Vec::new();
    for [x, dx, y, dy] in passes {
        for y in (y..8).step_by(dy) {
            lines.push(0);
            lines.extend((x..8).step_by(dx).map(|x| code(x, y)));
        }
    }
    let mut zlib = vec![0x78, 0x01, 0x01];
    zlib.extend_from_slice(&(lines.len() as u16).to_le_bytes());
    zlib.extend_from_slice(&(!(lines.len() as u16)).to_le_bytes());
    zlib.extend_from_slice(&lines);
    let (mut a, mut b) = (1_u32, 0_u32);
    for &byte in &lines {
        a = (a + u32::from(byte)) % 65521;
        b = (b + a) % 65521;
    }
    zlib.extend_from_slice(&(b << 16 | a).to_be_bytes());
    let mut bytes = b"\x89PNG\r\n\x1a\n".to_vec();
    let header = [0, 0, 0, 8, 0, 0, 0, 8, 8, 0, 0, 0, 1];
    for (name, data) in [(b"IHDR", &header[..]), (b"IDAT", &zlib), (b"IEND", &[])] {
        bytes.extend_from_slice(&(data.len() as u32).to_be_bytes());
        let chunk = [name, data].concat();
        bytes.extend_from_slice(&chunk);
        bytes.extend_from_slice(&crc32(&chunk).to_be_bytes());
    }
    let expected = (0..64).map(|at| code(at % 8, at / 8)).collect();
    assert_eq!(texels(&bytes), Texels::Srgb8(expected));
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| crc >> 1 ^ (0xedb8_8320 * (crc & 1)))
    })
}

#[test]
fn a_png_that_claims_too_much_is_refused_before_it_is_believed() {
    let claiming = |width: u32, height: u32| {
        let mut bytes = png([1, 1], ColorType::Rgb, BitDepth::Eight, &[1, 2, 3]);
        bytes[16..20].copy_from_slice(&width.to_be_bytes());
        bytes[20..24].copy_from_slice(&height.to_be_bytes());
        let crc = crc32(&bytes[12..29]);
        bytes[29..33].copy_from_slice(&crc.to_be_bytes());
        message(&bytes)
    };
    assert_eq!(
        claiming(1 << 20, 1 << 20),
        "x: an image of 1048576 x 1048576 pixels is beyond the limit of 268435456 pixels"
    );
    assert!(claiming(0x7fff_ffff, 0x7fff_ffff).contains("beyond the limit"));
    assert_eq!(
        claiming(1 << 25, 1),
        "x: an image of 33554432 x 1 pixels is beyond the limit of 16777216 pixels per axis"
    );
    assert_eq!(
        claiming(16384, 16384),
        "x: field IHDR: found 16384 x 16384 pixels in a file of 69 bytes, expected no more than the file can hold"
    );
    assert!(claiming(2, 2).starts_with("x: whole file: found "));
}

#[test]
fn other_formats_are_named() {
    let unsupported = [
        (&b"\xff\xd8\xff\xe0\0\x10JFIF"[..], "a JPEG image"),
        (b"RIFF\x10\0\0\0WEBPVP8 ", "a WebP image"),
        (b"II*\0", "a TIFF image"),
    ];
    for (bytes, name) in unsupported {
        let expected = format!(
            "x: {name} is not supported, expected a PNG or OpenEXR image: convert it to one of these"
        );
        assert_eq!(message(bytes), expected);
    }
    assert_eq!(message(b""), "x: an empty file is not supported, expected a PNG or OpenEXR image");
    assert_eq!(
        message(b"ply\n"),
        "x: a file that starts with `ply\\n` is not supported, expected a PNG or OpenEXR image"
    );
}

/// Attributes and blocks of an OpenEXR file without compression, made by hand.
struct Part {
    channels: Vec<(&'static str, u32, u32)>,
    window: [i32; 4],
    attributes: Vec<(&'static str, &'static str, Vec<u8>)>,
    compression: u8,
    /// What stands between number of part and pixels, and the pixels.
    blocks: Vec<(Vec<i32>, Vec<u8>)>,
}

impl Part {
    /// Scan lines; channels: name, type, sampling.
    fn new(channels: &[(&'static str, u32, u32)], window: [i32; 4], lines: &[Vec<u8>]) -> Self {
        let blocks = lines.iter().enumerate().map(|(row, line)| (vec![window[1] + row as i32], line.clone()));
        Self {
            channels: channels.to_vec(),
            window,
            attributes: Vec::new(),
            compression: 0,
            blocks: blocks.collect(),
        }
    }

    fn with(mut self, name: &'static str, kind: &'static str, value: &[u8]) -> Self {
        self.attributes.push((name, kind, value.to_vec()));
        self
    }

    fn header(&self) -> Vec<u8> {
        let mut channels = Vec::new();
        for &(name, kind, sampling) in &self.channels {
            channels.extend_from_slice(name.as_bytes());
            channels.push(0);
            channels.extend([kind, 0, sampling, sampling].into_iter().flat_map(u32::to_le_bytes));
        }
        channels.push(0);
        let window: Vec<u8> = self.window.into_iter().flat_map(i32::to_le_bytes).collect();
        let own = [
            ("channels", "chlist", channels),
            ("compression", "compression", vec![self.compression]),
            ("dataWindow", "box2i", window),
        ];
        let mut bytes = Vec::new();
        for (name, kind, value) in own.iter().chain(&self.attributes) {
            bytes.extend_from_slice(&[name.as_bytes(), b"\0", kind.as_bytes(), b"\0"].concat());
            bytes.extend_from_slice(&(value.len() as u32).to_le_bytes());
            bytes.extend_from_slice(value);
        }
        bytes.push(0);
        bytes
    }
}

fn exr_bytes(flags: u32, parts: &[Part]) -> Vec<u8> {
    let mut bytes = [0x0131_2f76_u32, 2 | flags].into_iter().flat_map(u32::to_le_bytes).collect::<Vec<_>>();
    parts.iter().for_each(|part| bytes.extend(part.header()));
    if parts.len() > 1 {
        bytes.push(0);
    }
    for part in parts {
        bytes.resize(bytes.len() + 8 * part.blocks.len(), 0);
    }
    for (index, part) in parts.iter().enumerate() {
        for (place, data) in &part.blocks {
            if parts.len() > 1 {
                bytes.extend((index as u32).to_le_bytes());
            }
            bytes.extend(place.iter().flat_map(|int| int.to_le_bytes()));
            bytes.extend((data.len() as u32).to_le_bytes());
            bytes.extend(data);
        }
    }
    bytes
}

const UINT: u32 = 0;
const HALF: u32 = 1;
const FLOAT: u32 = 2;

fn halves(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|&value| f16::from_f32(value).to_le_bytes()).collect()
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

#[test]
fn halves_stay_halves_wherever_the_window_is() {
    let rgb = [("B", HALF, 1), ("G", HALF, 1), ("R", HALF, 1)];
    let lines = [halves(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]), halves(&[7.0, 8.0, 9.0, 10.0, 11.0, 12.0])];
    let expected = [5, 3, 1, 6, 4, 2, 11, 9, 7, 12, 10, 8].map(|value| f16::from_f32(value as f32));
    for (x, y) in [(0, 0), (-5, 77), (i32::MIN, i32::MIN), (i32::MAX - 1, i32::MAX - 1)] {
        let bytes = exr_bytes(0, &[Part::new(&rgb, [x, y, x + 1, y + 1], &lines)]);
        assert_eq!(texels(&bytes), Texels::F16(expected.to_vec()));
    }
}

#[test]
fn mixed_types_become_floats_and_grey_has_one_channel() {
    let mixed = [("A", HALF, 1), ("B", UINT, 1), ("G", FLOAT, 1), ("R", HALF, 1), ("Z", FLOAT, 1)];
    let line =
        [halves(&[0.5]), 7_u32.to_le_bytes().to_vec(), floats(&[-0.1]), halves(&[2.0]), floats(&[9.0])];
    let bytes = exr_bytes(0, &[Part::new(&mixed, [0; 4], &[line.concat()])]);
    assert_eq!(texels(&bytes), Texels::F32(vec![2.0, -0.1, 7.0, 0.5]));

    let grey = exr_bytes(0, &[Part::new(&[("Y", FLOAT, 1)], [0, 0, 1, 0], &[floats(&[0.25, f32::NAN])])]);
    let pyramid = read_bytes(&grey).unwrap();
    assert_eq!((pyramid.channels(), pyramid.replaced()), (1, 1));
    assert_eq!(*pyramid.levels()[0].texels(), Texels::F32(vec![0.25, 0.25]));
}

#[test]
fn channels_without_a_layer_come_first() {
    let layers = [
        ("B", HALF, 1),
        ("G", HALF, 1),
        ("R", HALF, 1),
        ("a.B", HALF, 1),
        ("a.G", HALF, 1),
        ("a.R", HALF, 1),
    ];
    let line = halves(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    let bytes = exr_bytes(0, &[Part::new(&layers, [0; 4], std::slice::from_ref(&line))]);
    let texel = |values: [f32; 3]| Texels::F16(values.map(f16::from_f32).to_vec());
    assert_eq!(texels(&bytes), texel([3.0, 2.0, 1.0]));
    let bytes = exr_bytes(0, &[Part::new(&layers[3..], [0; 4], &[halves(&[4.0, 5.0, 6.0])])]);
    assert_eq!(texels(&bytes), texel([6.0, 5.0, 4.0]));
}

#[test]
fn the_suitable_part_of_several_is_read() {
    let rgb = [("B", HALF, 1), ("G", HALF, 1), ("R", HALF, 1)];
    let flat = b"scanlineimage";
    let depth =
        Part::new(&[("Z", FLOAT, 1)], [0, 0, 1, 0], &[floats(&[1.0, 2.0])]).with("type", "string", flat);
    let layer = Part::new(&[("x.Y", FLOAT, 1)], [0, 0, 0, 0], &[floats(&[1.0])]).with("type", "string", flat);
    let color = Part::new(&rgb, [0; 4], &[halves(&[1.0, 2.0, 3.0])]).with("type", "string", flat);
    let mut deep = Part::new(&rgb, [0; 4], &[vec![0; 24]]).with("type", "string", b"deepscanline");
    // Sizes of 8 and 0 bytes, then 8 bytes; the size that the builder writes is the low half of the first one.
    deep.blocks[0].1 = [&[0; 4][..], &[0; 8], &[0; 8], &[0; 24]].concat();
    let bytes = exr_bytes(0x1800, &[deep, depth, layer, color]);
    let expected = [3.0, 2.0, 1.0].map(f16::from_f32);
    assert_eq!(texels(&bytes), Texels::F16(expected.to_vec()));
}

#[test]
fn the_largest_of_several_levels_is_read_whatever_the_order() {
    let tile = |level: i32, at: [i32; 2], value: f32, count: usize| {
        (vec![at[0], at[1], level, level], halves(&vec![value; count]))
    };
    let mut part = Part::new(&[("Y", HALF, 1)], [3, 3, 5, 4], &[]);
    part.blocks = vec![tile(1, [0, 0], 9.0, 1), tile(0, [1, 0], 2.0, 2), tile(0, [0, 0], 1.0, 4)];
    let tiles = [2, 0, 0, 0, 2, 0, 0, 0, 1];
    let bytes = exr_bytes(0x200, &[part.with("tiles", "tiledesc", &tiles)]);
    let expected = [1.0, 1.0, 2.0, 1.0, 1.0, 2.0].map(f16::from_f32);
    assert_eq!(texels(&bytes), Texels::F16(expected.to_vec()));
}

#[test]
fn what_an_exr_lacks_is_said() {
    let rgb = [("B", HALF, 1), ("G", HALF, 1), ("R", HALF, 1)];
    let one = |channels: &[(&'static str, u32, u32)], window| {
        Part::new(channels, window, &[halves(&[1.0, 2.0, 3.0])])
    };
    assert_eq!(
        message(&exr_bytes(0, &[one(&[("G", HALF, 1), ("R", HALF, 1), ("Z", HALF, 1)], [0; 4])])),
        "x: an image of the channels `G R Z` is not supported, expected channels R, G and B, or Y alone, of a flat \
         image, with or without A"
    );
    assert!(
        message(&exr_bytes(0x800, &[one(&rgb, [0; 4])]))
            .starts_with("x: deep data is not supported, expected")
    );
    assert_eq!(
        message(&exr_bytes(0, &[one(&[("BY", HALF, 2), ("RY", HALF, 2), ("Y", HALF, 1)], [0; 4])])),
        "x: channel `BY` of one value per 2 x 2 pixels is not supported, expected channels of full resolution, such \
         as R, G and B"
    );
    let mut htj2k = one(&rgb, [0; 4]);
    htj2k.compression = 10;
    assert!(message(&exr_bytes(0, &[htj2k])).contains("OpenEXR compression 10 is not supported"));
    let claims = [
        ([0, 0, i32::MAX, i32::MAX], "blocks of 2147483648 x 2147483648 pixels"),
        ([i32::MIN, 0, i32::MAX, 0], "4294967296 x 1 pixels is beyond the limit of 16777216"),
        ([0, 0, 9999, 0], "10000 x 1 pixels of 3 channels in a file of"),
        ([0, 0, -1, 0], "expected one pixel or more"),
    ];
    for (window, expected) in claims {
        let message = message(&exr_bytes(0, &[one(&rgb, window)]));
        assert!(message.contains(expected), "{message}");
    }
    let mut twice = Part::new(&rgb, [0, 0, 0, 1], &[halves(&[1.0; 3]), halves(&[1.0; 3])]);
    twice.blocks[1].0[0] = 0;
    assert!(message(&exr_bytes(0, &[twice])).contains("found block 0, 0 again"));
    let mut outside = one(&rgb, [0; 4]);
    outside.blocks[0].0[0] = 1;
    assert!(message(&exr_bytes(0, &[outside])).contains("found block 0, 1, expected below 1, 1"));
    let whole = exr_bytes(0, &[one(&rgb, [0; 4])]);
    for end in 8..whole.len() {
        assert!(matches!(read_bytes(&whole[..end]), Err(Error::Invalid { .. })), "{end} bytes");
    }
}

/// An OpenEXR image of a smooth pattern: half colours, and a float depth.
fn packed_exr(size: [usize; 2], compression: Compression, blocks: Blocks) -> Vec<u8> {
    let value = |x: usize, y: usize, scale: f32| (1.5 + (x as f32 * 0.1 + y as f32 * 0.03).sin()) * scale;
    let channel = |name: &str, scale: f32, is_half: bool| {
        let pixels = (0..size[0] * size[1]).map(|at| value(at % size[0], at / size[0], scale));
        let samples = if is_half {
            FlatSamples::F16(pixels.map(f16::from_f32).collect())
        } else {
            FlatSamples::F32(pixels.collect())
        };
        AnyChannel::new(name, samples)
    };
    let channels = AnyChannels::sort(
        [
            channel("R", 1.0, true),
            channel("G", 0.5, true),
            channel("B", 0.25, true),
            channel("Z", 9.0, false),
        ]
        .into_iter()
        .collect::<SmallVec<_>>(),
    );
    let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
    let layer = Layer::new(Vec2(size[0], size[1]), LayerAttributes::default(), encoding, channels);
    let mut bytes = Vec::new();
    ExrImage::from_layer(layer).write().non_parallel().to_buffered(Cursor::new(&mut bytes)).unwrap();
    bytes
}

const COMPRESSIONS: [Compression; 10] = [
    Compression::Uncompressed,
    Compression::RLE,
    Compression::ZIP1,
    Compression::ZIP16,
    Compression::PIZ,
    Compression::PXR24,
    Compression::B44,
    Compression::B44A,
    Compression::DWAA(None),
    Compression::DWAB(None),
];

#[test]
fn every_compression_is_unpacked() {
    let size = [75, 70];
    for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(32, 16))] {
        for compression in COMPRESSIONS {
            let Texels::F16(values) = texels(&packed_exr(size, compression, blocks)) else {
                panic!("expected F16")
            };
            let tolerance = if compression.is_lossless_for(exr_crate::meta::attribute::SampleType::F16) {
                0.0
            } else {
                0.03
            };
            for (at, texel) in values.chunks_exact(3).enumerate() {
                let (x, y) = (at % size[0], at / size[0]);
                let value = 1.5 + (x as f32 * 0.1 + y as f32 * 0.03).sin();
                for (found, scale) in texel.iter().zip([1.0, 0.5, 0.25]) {
                    let expected = f16::from_f32(value * scale).to_f32();
                    assert!(
                        (found.to_f32() - expected).abs() <= tolerance,
                        "{compression:?}, {x} {y}: {found} for {expected}"
                    );
                }
            }
        }
    }
}

/// The decoder would allocate what the block says.
#[test]
fn a_dwa_block_that_claims_too_much_is_refused() {
    let intact = packed_exr([32, 32], Compression::DWAA(None), Blocks::ScanLines);
    let int = |at: usize| u32::from_le_bytes(intact[at..at + 4].try_into().unwrap()) as usize;
    let block =
        (0..intact.len() - 8).find(|&at| int(at) == 0 && int(at + 4) == intact.len() - at - 8).unwrap();
    for counter in [1, 6, 7, 8, 9] {
        let mut bytes = intact.clone();
        bytes[block + 8 + 8 * counter + 5] = 1;
        let message = message(&bytes);
        assert!(message.contains(&format!("in counter {counter}, at most")), "{message}");
    }
}

/// Small files of every kind, for damage.
fn specimens() -> Vec<Vec<u8>> {
    let mut files: Vec<Vec<u8>> = COMPRESSIONS
        .into_iter()
        .flat_map(|compression| {
            [Blocks::ScanLines, Blocks::Tiles(Vec2(16, 16))]
                .map(|blocks| packed_exr([37, 35], compression, blocks))
        })
        .collect();
    let data: Vec<u8> = (0..40 * 9 * 8).map(|at| (at * 7 % 251) as u8).collect();
    for (color, depth, bytes) in [
        (ColorType::Rgb, BitDepth::Eight, 120),
        (ColorType::Rgba, BitDepth::Sixteen, 320),
        (ColorType::Grayscale, BitDepth::One, 5),
        (ColorType::GrayscaleAlpha, BitDepth::Eight, 80),
    ] {
        files.push(png([40, 9], color, depth, &data[..bytes * 9]));
    }
    files.push(png_bytes([40, 9], ColorType::Indexed, BitDepth::Four, &data[..180], |encoder| {
        encoder.set_palette(vec![9; 48]);
    }));
    files
}

/// Damages a file: each edit sets a byte, as a share of the length, by one of three ways.
fn damaged(file: &[u8], edits: &[(f64, u8, u8)], end: f64) -> Vec<u8> {
    let mut bytes = file.to_vec();
    for &(place, value, way) in edits {
        let byte = &mut bytes[(place * file.len() as f64) as usize];
        match way {
            0 => *byte = value,
            1 => *byte ^= 1 << (value % 8),
            _ => *byte = [0, 1, 0x7f, 0x80, 0xff][usize::from(value) % 5],
        }
    }
    bytes.truncate((end * file.len() as f64) as usize);
    // Checksums would catch nearly all damage to a PNG image.
    if bytes.starts_with(b"\x89PNG") {
        let mut at = 8;
        while let Some(size) = bytes.get(at..at + 4) {
            let size = u32::from_be_bytes(size.try_into().unwrap()) as usize;
            if size > bytes.len() || at + 12 + size > bytes.len() {
                break;
            }
            let crc = crc32(&bytes[at + 4..at + 8 + size]);
            bytes[at + 8 + size..at + 12 + size].copy_from_slice(&crc.to_be_bytes());
            at += 12 + size;
        }
    }
    bytes
}

#[test]
fn damage_is_survived() {
    let files = specimens();
    let cases = std::env::var("SPLAT_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(1) * 4000;
    let edits = prop::collection::vec((0.0..1.0, any::<u8>(), 0..3_u8), 1..8);
    let end = prop_oneof![3 => Just(1.0), 1 => 0.0..1.0];
    proptest!(ProptestConfig::with_cases(cases), |(file in 0..files.len(), edits in edits, end in end)| {
        let bytes = damaged(&files[file], &edits, end);
        if let Ok(pyramid) = read_bytes(&bytes) {
            prop_assert!(pyramid.levels().len() < 32);
        }
    });
}
