use super::*;
use exr::prelude::{FlatSamples, ReadChannels, ReadLayers, read};
use glam::{DVec3, DVec4};
use splat_core::{AovSelection, PixelRect};
use std::fs;

/// A film whose every value says where it belongs.
fn film(window: PixelRect, aovs: AovSelection) -> Film {
    let mut film = Film::new([64, 48], window, aovs);
    let value = |plane: usize, index: usize| plane as f32 + index as f32 / 1024.0;
    let fill = |column: &mut Option<Vec<f32>>, plane: usize| {
        let values = column.iter_mut().flatten().enumerate();
        values.for_each(|(index, slot)| *slot = value(plane, index));
    };
    let fill_vectors = |column: &mut Option<Vec<Vec3>>, plane: usize| {
        let values = column.iter_mut().flatten().enumerate();
        values.for_each(|(index, slot)| {
            *slot = Vec3::new(value(plane, index), value(plane + 1, index), value(plane + 2, index));
        });
    };
    for (index, pixel) in film.rgba.iter_mut().enumerate() {
        *pixel = std::array::from_fn(|plane| value(plane, index));
    }
    fill(&mut film.depth, 4);
    fill(&mut film.coverage, 5);
    fill(&mut film.layers, 6);
    fill(&mut film.samples, 7);
    fill_vectors(&mut film.normal, 8);
    fill_vectors(&mut film.albedo, 11);
    fill_vectors(&mut film.position, 14);
    fill_vectors(&mut film.variance, 17);
    film.id.iter_mut().flatten().enumerate().for_each(|(index, id)| *id = index as u32 + 0xffff_0000);
    film
}

fn write(film: &Film, metadata: &Metadata, options: &ExrOptions) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.exr");
    write_exr(&path, film, metadata, options).unwrap();
    fs::read(&path).unwrap()
}

type ReadBack = Image<Layer<exr::prelude::AnyChannels<FlatSamples>>>;

fn read_back(bytes: &[u8]) -> ReadBack {
    let reader = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
    reader.all_attributes().from_buffered(io::Cursor::new(bytes)).unwrap()
}

fn samples<'a>(image: &'a ReadBack, name: &str) -> &'a FlatSamples {
    let mut channels = image.layer_data.channel_data.list.iter();
    &channels.find(|channel| channel.name == *name).unwrap_or_else(|| panic!("{name}")).sample_data
}

#[test]
fn every_channel_comes_back_under_every_compression() {
    let film = film(PixelRect::new(5, -3, 38, 30), AovSelection::ALL);
    let planes = [
        ("R", 0),
        ("G", 1),
        ("B", 2),
        ("A", 3),
        ("Z", 4),
        ("coverage", 5),
        ("layers", 6),
        ("samples", 7),
        ("N.X", 8),
        ("N.Y", 9),
        ("N.Z", 10),
        ("albedo.R", 11),
        ("albedo.G", 12),
        ("albedo.B", 13),
        ("P.X", 14),
        ("P.Y", 15),
        ("P.Z", 16),
        ("variance.R", 17),
        ("variance.G", 18),
        ("variance.B", 19),
    ];
    let compressions =
        [Compression::None, Compression::Rle, Compression::Zip, Compression::Zips, Compression::Piz];
    for compression in compressions {
        for (full_floats, parallel) in [(false, false), (true, true)] {
            let options = ExrOptions { full_floats, compression, parallel };
            let image = read_back(&write(&film, &Metadata::default(), &options));
            assert_eq!(image.layer_data.channel_data.list.len(), planes.len() + 1);
            for (name, plane) in planes {
                let samples = samples(&image, name);
                let is_full = matches!(samples, FlatSamples::F32(_));
                let always = ["Z", "P.X", "P.Y", "P.Z", "layers", "samples"].contains(&name);
                assert_eq!(is_full, full_floats || always || name.starts_with("variance"), "{name}");
                for (index, found) in samples.values_as_f32().enumerate() {
                    let value = plane as f32 + index as f32 / 1024.0;
                    let expected = if is_full { value } else { f16::from_f32(value).to_f32() };
                    assert_eq!(found, expected, "{name}[{index}] {compression:?}");
                }
            }
            let FlatSamples::U32(ids) = samples(&image, "id") else { panic!("id") };
            assert_eq!(ids, film.id.as_ref().unwrap());
        }
    }
}

#[test]
fn windows_are_data_and_display_window() {
    let film = film(PixelRect::new(5, 7, 9, 10), AovSelection::default());
    let image = read_back(&write(&film, &Metadata::default(), &ExrOptions::default()));
    assert_eq!(image.attributes.display_window, IntegerBounds::from_dimensions(Vec2(64, 48)));
    assert_eq!(image.layer_data.attributes.layer_position, Vec2(5, 7));
    assert_eq!(image.layer_data.size, Vec2(4, 3));
    assert_eq!(image.layer_data.channel_data.list.len(), 4);
}

#[test]
fn halves_saturate() {
    assert_eq!(saturated(1e6).to_f32(), 65504.0);
    assert_eq!(saturated(65519.0).to_f32(), 65504.0);
    assert_eq!(saturated(f32::NEG_INFINITY).to_f32(), -65504.0);
    assert!(saturated(f32::NAN).is_nan());
    assert_eq!(saturated(0.5).to_f32(), 0.5);
}

#[test]
fn metadata_come_back() {
    let mut matrix = DMat4::from_cols_array(&std::array::from_fn(|i| i as f64));
    matrix.w_axis = DVec4::new(500_000.1, 2.0, 3.0, 1.0);
    let metadata = Metadata {
        software: Some("splat 0.1.0".to_owned()),
        world_to_camera: Some(matrix),
        samples: Some(64),
        sample_range: Some(16..32),
        seed: Some(u64::MAX),
        engine: Some("reference".to_owned()),
        options: Some("--exp lerp256 ü".to_owned()),
        pixels_per_inch: Some(300.0),
        input_hash: Some("00ff".to_owned()),
        camera: Some("{}".to_owned()),
        crop: None,
    };
    let mut film = film(PixelRect::new(0, 0, 2, 2), AovSelection::ALL);
    film.position_origin = DVec3::new(500_000.25, 0.0, -1.0);
    let image = read_back(&write(&film, &metadata, &ExrOptions::default()));
    let attributes = &image.layer_data.attributes;
    assert_eq!(attributes.software_name, Some(text("splat 0.1.0")));
    assert_eq!(attributes.horizontal_density, Some(300.0));
    let expected = [0., 1., 2., 3., 4., 5., 6., 7., 8., 9., 10., 11., 500_000.1_f64 as f32, 2., 3., 1.];
    assert_eq!(attributes.world_to_camera, Some(expected));
    let texts = [
        ("worldToCameraText", "[[0, 4, 8, 500000.1], [1, 5, 9, 2], [2, 6, 10, 3], [3, 7, 11, 1]]"),
        ("sampleRange", "16:32"),
        ("seed", "18446744073709551615"),
        ("engine", "reference"),
        ("options", "--exp lerp256 ü"),
        ("inputHash", "00ff"),
        ("camera", "{}"),
        ("positionOrigin", "500000.25 0 -1"),
    ];
    for (name, value) in texts {
        assert_eq!(attributes.other.get(&text(name)), Some(&AttributeValue::Text(text(value))), "{name}");
    }
    assert_eq!(attributes.other.get(&text("samples")), Some(&AttributeValue::I32(64)));
    assert_eq!(attributes.other.len(), texts.len() + 1);
}

#[test]
fn the_same_picture_is_the_same_file_with_sorted_attributes() {
    let metadata =
        Metadata { seed: Some(1), samples: Some(2), engine: Some("x".into()), ..Metadata::default() };
    let film = film(PixelRect::new(0, 0, 64, 48), AovSelection::ALL);
    let files: Vec<_> = [true, false, true]
        .map(|parallel| write(&film, &metadata, &ExrOptions { parallel, ..ExrOptions::default() }))
        .to_vec();
    assert!(files.windows(2).all(|pair| pair[0] == pair[1]));
    let place = |name: &[u8]| files[0].windows(name.len()).position(|window| window == name).unwrap();
    assert!(place(b"channels\0") < place(b"compression\0"));
    assert!(place(b"engine\0") < place(b"seed\0"));
}

#[test]
fn an_empty_or_damaged_film_is_refused() {
    let empty = film(PixelRect::new(3, 3, 3, 9), AovSelection::ALL);
    let path = Path::new("never-written.exr");
    let message =
        write_exr(path, &empty, &Metadata::default(), &ExrOptions::default()).unwrap_err().to_string();
    assert!(message.contains("no pixel"), "{message}");
    let mut short = film(PixelRect::new(0, 0, 3, 3), AovSelection::ALL);
    short.depth.as_mut().unwrap().pop();
    assert!(write_exr(path, &short, &Metadata::default(), &ExrOptions::default()).is_err());
    assert!(!path.exists());
}

#[test]
fn each_aov_may_have_a_file_of_its_own() {
    let film = film(PixelRect::new(0, 0, 64, 48), AovSelection::ALL);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.b.png");
    let options = ExrOptions::default();
    let written = write_aov_files(&path, &film, &Metadata::default(), &options).unwrap();
    let names: Vec<_> = written.iter().map(|path| path.file_name().unwrap().to_str().unwrap()).collect();
    let aovs = ["albedo", "coverage", "depth", "id", "layers", "normal", "position", "samples", "variance"];
    assert_eq!(names, aovs.map(|aov| format!("a.b.{aov}.exr")));
    let normal = read_back(&fs::read(&written[5]).unwrap());
    let channels: Vec<_> = normal.layer_data.channel_data.list.iter().map(|c| c.name.to_string()).collect();
    assert_eq!(channels, ["N.X", "N.Y", "N.Z"]);
    let whole = read_back(&write(&film, &Metadata::default(), &options));
    assert_eq!(samples(&normal, "N.Y"), samples(&whole, "N.Y"));
    let depth = read_back(&fs::read(&written[2]).unwrap());
    assert_eq!(samples(&depth, "Z"), samples(&whole, "Z"));

    write_color_exr(&path, &film, &Metadata::default(), &options).unwrap();
    let color = read_back(&fs::read(&path).unwrap());
    assert_eq!(color.layer_data.channel_data.list.len(), 4);
    assert_eq!(samples(&color, "G"), samples(&whole, "G"));
}

/// What was written, as it is read back from a file, with that file's bytes.
fn read_again(film: &Film, metadata: &Metadata, options: &ExrOptions) -> (picture::ExrPicture, Vec<u8>) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.exr");
    write_exr(&path, film, metadata, options).unwrap();
    (picture::read_exr(&path).unwrap(), fs::read(&path).unwrap())
}

/// A film of samples 4 to 8 of 16, with sums.
fn part_of_the_samples() -> (Film, Metadata) {
    let window = PixelRect::new(5, 3, 38, 30);
    let mut film = film(window, AovSelection::ALL);
    film.position_origin = DVec3::new(500_000.25, 0.0, -1.0);
    let ending = Ending { background: Some([0.1, 0.25, 3e-9, 1.0]), display_space: true };
    let mut sums = SampleSums::new(4, ending, &window, AovSelection::ALL).unwrap();
    for (number, plane) in sums.planes.iter_mut().enumerate() {
        plane.iter_mut().enumerate().for_each(|(i, value)| *value = 1.0 / (number + 3 * i + 1) as f64);
    }
    film.sums = Some(sums);
    let metadata = Metadata {
        software: Some("splat 0.1.0".to_owned()),
        world_to_camera: Some(DMat4::from_cols_array(&std::array::from_fn(|i| 0.1 * i as f64))),
        samples: Some(16),
        sample_range: Some(4..8),
        seed: Some(u64::MAX),
        engine: Some("fast".to_owned()),
        options: Some("--exp poly8 \u{fc}".to_owned()),
        pixels_per_inch: Some(300.0),
        input_hash: Some("00ff".to_owned()),
        camera: Some("{}".to_owned()),
        crop: None,
    };
    (film, metadata)
}

#[test]
fn our_files_are_read_and_written_again_to_the_byte() {
    let (film, metadata) = part_of_the_samples();
    let compressions =
        [Compression::None, Compression::Rle, Compression::Zip, Compression::Zips, Compression::Piz];
    for compression in compressions {
        for full_floats in [false, true] {
            let options = ExrOptions { full_floats, compression, ..ExrOptions::default() };
            let (read, bytes) = read_again(&film, &metadata, &options);
            assert_eq!(read.metadata, metadata);
            assert_eq!(read.window, film.window);
            assert_eq!(read.frame, PixelRect::new(0, 0, 64, 48));
            assert_eq!(read.position_origin, Some(film.position_origin));
            assert_eq!(read.compression, Some(compression));
            assert_eq!(read.film_of_sums().unwrap().sums, film.sums);
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("again.exr");
            picture::write_exr_picture(&path, &read, compression).unwrap();
            assert!(fs::read(&path).unwrap() == bytes, "{compression:?} {full_floats}");
            let mut of_film = read.clone();
            of_film.set_film(&film, full_floats).unwrap();
            assert_eq!(of_film, read);
        }
    }
}

#[test]
fn pictures_of_other_programs_are_read() {
    use exr::prelude::*;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.exr");
    let pixel = |position: Vec2<usize>| {
        (f16::from_f32(position.x() as f32), f16::from_f32(position.y() as f32), f16::from_f32(0.5))
    };
    for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(16, 8))] {
        let encoding =
            Encoding { compression: Compression::PXR24, blocks, line_order: LineOrder::Increasing };
        let image = Image::from_encoded_channels((37, 21), encoding, SpecificChannels::rgb(pixel));
        image.write().to_file(&path).unwrap();
        let read = picture::read_exr(&path).unwrap();
        assert_eq!(read.channels.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["B", "G", "R"]);
        assert_eq!((read.window.width(), read.window.height(), read.compression), (37, 21, None));
        assert_eq!(read.metadata, Metadata::default());
        for (index, (x, y)) in (0..21).flat_map(|y| (0..37).map(move |x| (x, y))).enumerate() {
            assert_eq!(read.channel("R").unwrap().get(index), f64::from(x));
            assert_eq!(read.channel("G").unwrap().get(index), f64::from(y));
        }
    }
}

#[test]
fn damaged_files_are_errors() {
    let (film, metadata) = part_of_the_samples();
    let film = film.part(PixelRect::new(5, 3, 12, 9));
    let options = ExrOptions { compression: Compression::Zips, ..ExrOptions::default() };
    let (_, bytes) = read_again(&film, &metadata, &options);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.exr");
    let read = |bytes: &[u8]| {
        fs::write(&path, bytes).unwrap();
        picture::read_exr(&path)
    };
    for length in (0..bytes.len()).step_by(61).chain(bytes.len() - 3..bytes.len()) {
        assert!(read(&bytes[..length]).is_err(), "{length} of {}", bytes.len());
    }
    let mut next = 1_u32;
    for _ in 0..400 {
        next = next.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let mut damaged = bytes.clone();
        let place = next as usize % damaged.len();
        damaged[place] ^= 1 << (next >> 29);
        // Whatever it says, it does not panic; and what is read can be used.
        if let Ok(read) = read(&damaged) {
            let _film = read.film_of_sums();
            let piece = crate::Piece { path: path.clone(), picture: read };
            let _merged = crate::merge(vec![piece], None);
        }
    }
    // A header that claims 16384 x 16384 pixels.
    let place = bytes.windows(16).position(|window| window == b"dataWindow\0box2i").unwrap() + 17 + 4;
    let mut huge = bytes;
    huge[place + 8..place + 12].copy_from_slice(&(5 + 16_383_i32).to_le_bytes());
    huge[place + 12..place + 16].copy_from_slice(&(3 + 16_383_i32).to_le_bytes());
    assert!(matches!(read(&huge), Err(Error::Invalid { .. })));
}
