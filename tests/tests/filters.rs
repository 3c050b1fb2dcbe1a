//! Texture filters against brute force, with the error bars of the specification.

use splat_core::texture::{Filter, Probes, Pyramid, Quality, Sampler, Wrap};
use splat_tests::random::Random;
use splat_tests::texture_truth::{Image, Lookup};
use std::path::PathBuf;

const ANISOTROPIES: [f64; 4] = [1.0, 4.0, 16.0, 64.0];

/// Minor semi-axes, in texels: of pictures at about the texture's size, and of smaller ones.
const MINORS: [[f64; 2]; 2] = [[0.75, 3.0], [2.0, 8.0]];

/// Lookups with their true colours.
struct Set {
    image: Image,
    pyramid: Pyramid,
    lookups: Vec<(Lookup, [f64; 4])>,
}

impl Set {
    fn new(image: &Image, anisotropy: f64, count: usize) -> Self {
        let mut random = Random::new(7);
        let mut lookups = Vec::new();
        for minor in MINORS {
            for _ in 0..count {
                let lookup = Lookup::random(&mut random, minor, anisotropy);
                lookups.push((lookup, image.truth(&lookup)));
            }
        }
        Self { image: image.clone(), pyramid: image.pyramid(Wrap::Repeat), lookups }
    }

    /// Root of the mean squared error.
    fn rmse(&self, filter: Filter, width: f64) -> f64 {
        let sampler = Sampler { filter, max_anisotropy: 64.0, width, ..Sampler::default() };
        let mut sum = 0.0;
        for (lookup, truth) in &self.lookups {
            let color = sampler.lookup(&self.pyramid, lookup.st(), &lookup.footprint(self.image.size));
            for channel in 0..self.image.channels {
                sum += (f64::from(color[channel]) - truth[channel]).powi(2);
            }
        }
        (sum / (self.lookups.len() * self.image.channels) as f64).sqrt()
    }

    /// The least error over all widths.
    fn best(&self, filter: Filter) -> f64 {
        (4..=12).map(|i| self.rmse(filter, 0.1 * f64::from(i))).fold(f64::INFINITY, f64::min)
    }
}

fn photograph() -> Option<Image> {
    let folder = std::env::var_os("SPLAT_TEST_DATA").map(PathBuf::from).filter(|folder| folder.is_dir())?;
    let file = std::fs::File::open(folder.join("textures/astronaut.png")).unwrap();
    let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    let values = bytes.iter().map(|&b| splat_core::srgb::decode(f64::from(b) / 255.0) as f32).collect();
    Some(Image { size: [info.width, info.height], channels: 3, values })
}

#[test]
fn table() {
    let mut images = vec![
        ("checker8", Image::checkerboard(512, 8)),
        ("checker16", Image::checkerboard(512, 16)),
        ("zone", Image::zone_plate(512)),
    ];
    images.extend(photograph().map(|p| ("photo", p)));
    for (name, image) in images {
        let sets = ANISOTROPIES.map(|a| Set::new(&image, a, 160));
        let row = |label: &str, f: &dyn Fn(&Set) -> f64| {
            println!("{name} {label}: {:?}", sets.each_ref().map(|s| (1e5 * f(s)).round() / 100.0));
        };
        row("pbrt", &|s| s.rmse(Filter::EwaPrinted, 1.0));
        row("pbrt best", &|s| s.best(Filter::EwaPrinted));
        row("ewa", &|s| s.rmse(Filter::Ewa, 1.0));
        row("ewa best", &|s| s.best(Filter::Ewa));
        row("trilinear", &|s| s.rmse(Filter::Trilinear, 1.0));
        row("texram", &|s| s.rmse(Filter::Assembly(Probes::Texram), 1.0));
        row("texram best", &|s| s.best(Filter::Assembly(Probes::Texram)));
        row("texram ceil", &|s| s.rmse(Filter::Assembly(Probes::TexramCeiling), 1.0));
        row("gaussian", &|s| s.rmse(Filter::Assembly(Probes::Gaussian), 1.0));
        row("vc 1.5", &|s| s.rmse(Filter::EwaVc(Quality::FAST), 1.0));
        row("vc 2", &|s| s.rmse(Filter::EwaVc(Quality::DEFAULT), 1.0));
        row("vc 3", &|s| s.rmse(Filter::EwaVc(Quality::REFERENCE), 1.0));
    }
}
