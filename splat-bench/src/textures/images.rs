//! What is looked up: images, and lookups as a renderer makes them.

use anyhow::Context;
use glam::DVec2;
use splat_core::srgb;
use splat_core::texture::Wrap;
use splat_simd::texture::{LanePyramid, Lookup as Request};
use splat_tests::random::Random;
use splat_tests::texture_truth::{Image, Lookup};
use std::path::{Path, PathBuf};

/// The environment variable that names the folder of real files.
const DATA: &str = "SPLAT_TEST_DATA";

/// Lookups of a tile, per side.
const TILE: usize = 8;

/// An image in both cores.
#[derive(Debug)]
pub struct Subject {
    /// Its name.
    pub name: &'static str,
    /// Its texels.
    pub image: Image,
    /// The scalar core's.
    pub pyramid: splat_core::texture::Pyramid,
    /// That of lanes.
    pub lanes: LanePyramid,
}

/// Lookups of one anisotropy, tile by tile.
#[derive(Debug)]
pub struct Lookups {
    /// Where, and over what.
    pub lookups: Vec<Lookup>,
    /// The same as lanes take them.
    pub requests: Vec<Request>,
}

/// The folder of real files, if there is one.
pub fn data() -> Option<PathBuf> {
    std::env::var_os(DATA).filter(|value| !value.is_empty()).map(PathBuf::from)
}

/// All images; without the photograph where it is not in the folder of real files.
///
/// # Errors
/// If its file cannot be read.
pub fn all(data: Option<&Path>) -> anyhow::Result<Vec<Subject>> {
    let mut images = Vec::new();
    if let Some(photograph) = photograph(data)? {
        images.push(Subject::new("photograph", photograph));
    }
    images.push(Subject::new("checkerboard", Image::checkerboard(1024, 16)));
    images.push(Subject::new("zone plate", Image::zone_plate(1024)));
    Ok(images)
}

/// Why there is no photograph, where there is none.
pub fn skipped() -> String {
    format!("photograph: skipped, {DATA} does not name a folder with textures/")
}

/// `textures/astronaut.png` of the real files, in linear light.
fn photograph(data: Option<&Path>) -> anyhow::Result<Option<Image>> {
    let path = data.map(|folder| folder.join("textures/astronaut.png"));
    let Some(path) = path.filter(|path| path.exists()) else { return Ok(None) };
    let file = std::fs::File::open(path).context("a real file")?;
    let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info()?;
    let mut bytes = vec![0; reader.output_buffer_size().context("an image that fits the memory")?];
    let info = reader.next_frame(&mut bytes)?;
    let values = bytes.iter().map(|&byte| srgb::decode(f64::from(byte) / 255.0) as f32).collect();
    Ok(Some(Image { size: [info.width, info.height], channels: info.color_type.samples(), values }))
}

impl Subject {
    fn new(name: &'static str, image: Image) -> Self {
        let pyramid = image.pyramid(Wrap::Repeat);
        let lanes = LanePyramid::new(&pyramid);
        Self { name, image, pyramid, lanes }
    }
}

impl Lookups {
    /// `tiles` of 8 x 8 pixels, each of a random place, direction and size (minor semi-axes log-uniform in `minor`, in
    /// texels) that its pixels share; they are a semi-axis apart, as pbrt's footprints have it.
    pub fn new(size: [u32; 2], minor: [f64; 2], anisotropy: f64, tiles: usize) -> Self {
        let mut random = Random::new(3);
        let texels = DVec2::from(size.map(f64::from));
        let mut lookups = Vec::new();
        for _ in 0..tiles {
            let first = Lookup::random(&mut random, minor, anisotropy);
            let footprint = first.footprint(size).semi_axes.map(|axis| axis.as_dvec2());
            for pixel in 0..TILE * TILE {
                let step =
                    DVec2::new((pixel % TILE) as f64, (pixel / TILE) as f64) - 0.5 * (TILE as f64 - 1.0);
                let center = first.center + step.x * footprint[0] + step.y * footprint[1];
                // As f32 has it.
                let center = ((center - center.floor()) * texels).floor() / texels;
                let offset = DVec2::new(random.unit(), random.unit());
                let center = (center + (256.0 * offset).floor() / 256.0 / texels).as_vec2().as_dvec2();
                lookups.push(Lookup { center, ..first });
            }
        }
        let request = |lookup: &Lookup| Request { st: lookup.st(), footprint: lookup.footprint(size) };
        Self { requests: lookups.iter().map(request).collect(), lookups }
    }
}
