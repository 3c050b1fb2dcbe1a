//! Real images as textures, where `SPLAT_TEST_DATA` names a folder that has them. Sizes and means were computed by other
//! programs (OpenEXR's own library, Pillow).

use splat_core::texture::pyramid::{Pyramid, Texels, Wrap, f16};
use splat_io::{Error, read_pyramid};
use std::path::{Path, PathBuf};

/// A folder of real images, if there is one.
fn folder(name: &str) -> Option<PathBuf> {
    std::env::var_os("SPLAT_TEST_DATA")
        .map(|data| Path::new(&data).join(name))
        .filter(|folder| folder.is_dir())
}

fn read(path: &Path) -> Pyramid {
    read_pyramid(path, [Wrap::Repeat; 2]).unwrap()
}

/// The means of each channel, as stored: codes of sRGB, or linear values.
fn means(pyramid: &Pyramid) -> Vec<f64> {
    let values: Vec<f64> = match pyramid.levels()[0].texels() {
        Texels::Srgb8(codes) => codes.iter().map(|&code| code.into()).collect(),
        Texels::F16(values) => values.iter().copied().map(f16::to_f64).collect(),
        Texels::F32(values) => values.iter().map(|&value| value.into()).collect(),
    };
    let channels = pyramid.channels();
    let count = (values.len() / channels) as f64;
    (0..channels).map(|c| values[c..].iter().step_by(channels).sum::<f64>() / count).collect()
}

fn assert_means(name: &str, pyramid: &Pyramid, expected: &[f64], tolerance: f64) {
    let found = means(pyramid);
    assert_eq!(found.len(), expected.len(), "{name}");
    for (found, expected) in found.iter().zip(expected) {
        assert!(
            (found - expected).abs() <= tolerance * expected.abs(),
            "{name}: mean {found} for {expected}"
        );
    }
}

/// Printed means have five or six digits.
const PRINTED: f64 = 1e-5;

#[test]
fn photographs_have_their_sizes_and_means() {
    let images: [(&str, &str, [u32; 2], &[f64]); 4] = [
        ("textures", "astronaut.png", [512, 512], &[141.562, 105.759, 96.475]),
        ("textures", "brick.png", [512, 512], &[111.455]),
        ("textures", "chelsea.png", [451, 300], &[147.673, 111.444, 86.798]),
        ("meshes/spot", "spot_texture.png", [1024, 1024], &[242.004, 223.206, 214.05]),
    ];
    for (place, name, size, expected) in images {
        let Some(folder) = folder(place) else { return };
        let pyramid = read(&folder.join(name));
        assert_eq!(pyramid.levels()[0].size(), size, "{name}");
        assert!(matches!(pyramid.levels()[0].texels(), Texels::Srgb8(_)), "{name}");
        assert_means(name, &pyramid, expected, PRINTED);
    }
    // 16 bits a channel, so linear: the mean of its eight codes, decoded by a program of a few lines.
    let Some(folder) = folder("textures") else { return };
    let chessboard = read(&folder.join("chessboard_RGB.png"));
    assert_eq!(chessboard.levels()[0].size(), [200, 200]);
    assert!(matches!(chessboard.levels()[0].texels(), Texels::F32(_)));
    assert_means("chessboard_RGB.png", &chessboard, &[0.475_598_16; 3], PRINTED);
}

#[test]
fn exr_images_have_their_sizes_and_means() {
    let Some(folder) = folder("exr") else { return };
    let images: [(&str, [u32; 2], &[f64], usize); 7] = [
        ("TestImages_GammaChart.exr", [800, 800], &[0.17578, 0.17578, 0.17578], 0),
        ("TestImages_RgbRampsDiagonal.exr", [800, 800], &[0.23913, 0.23711, 0.23733], 0),
        ("TestImages_WideColorGamut.exr", [800, 800], &[1.0991, 0.96227, 1.0819], 0),
        ("TestImages_BrightRingsNanInf.exr", [800, 800], &[27.586, 27.586, 27.586], 18),
        ("MultiResolution_ColorCodedLevels.exr", [512, 512], &[0.49457, 0.49457, 0.49457, 1.0], 0),
        ("MultiResolution_PeriodicPattern.exr", [517, 517], &[0.21151, 0.2106, 0.19967], 0),
        ("LuminanceChroma_Garden.exr", [874, 493], &[0.33411], 0),
    ];
    for (name, size, expected, replaced) in images {
        let pyramid = read(&folder.join(name));
        assert_eq!(pyramid.levels()[0].size(), size, "{name}");
        assert_eq!(pyramid.replaced(), replaced, "{name}");
        assert!(matches!(pyramid.levels()[0].texels(), Texels::F16(_)), "{name}");
        // The printed means have five digits.
        assert_means(name, &pyramid, expected, 5.0 * PRINTED);
    }
}

#[test]
fn deep_images_and_damaged_ones_are_refused() {
    if let Some(folder) = folder("exr") {
        let error = read_pyramid(&folder.join("v2_LowResLeftView_Trunks.exr"), [Wrap::Clamp; 2]).unwrap_err();
        assert!(matches!(&error, Error::Unsupported { found, .. } if found == "deep data"), "{error}");
    }
    let Some(folder) = folder("exr_damaged") else { return };
    for file in std::fs::read_dir(folder).unwrap() {
        let path = file.unwrap().path();
        let error = read_pyramid(&path, [Wrap::Clamp; 2]).unwrap_err();
        assert!(!matches!(error, Error::Io { .. }), "{error}");
    }
}
