//! Options that are one of a few words, and what they stand for.

use clap::ValueEnum;
use glam::DVec3;
use splat_core::fit::Up;
use splat_core::texture::{Filter, Probes, Quality, Wrap};
use splat_core::{Detail, Kernel, PatternKind, PixelFilter, Shading, TableMode};
use splat_io::PngDepth;

/// `--up`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum UpChoice {
    /// +y up, the front towards +z
    Y,
    /// +z up, the front towards -y
    Z,
    /// -y up, the front towards -z
    #[value(name = "-y")]
    MinusY,
    /// -z up, the front towards +y
    #[value(name = "-z")]
    MinusZ,
}

impl From<UpChoice> for Up {
    fn from(choice: UpChoice) -> Self {
        match choice {
            UpChoice::Y => Self::Y,
            UpChoice::Z => Self::Z,
            UpChoice::MinusY => Self::MinusY,
            UpChoice::MinusZ => Self::MinusZ,
        }
    }
}

/// `--filter`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FilterChoice {
    /// The pixel's own square
    Box,
    /// A tent of radius 1
    Tent,
    /// A Gaussian of sigma 1/2, cut off at 3/2
    Gaussian,
    /// The Blackman-Harris window of radius 3/2
    BlackmanHarris,
}

impl From<FilterChoice> for PixelFilter {
    fn from(choice: FilterChoice) -> Self {
        match choice {
            FilterChoice::Box => Self::Box,
            FilterChoice::Tent => Self::Tent,
            FilterChoice::Gaussian => Self::Gaussian,
            FilterChoice::BlackmanHarris => Self::BlackmanHarris,
        }
    }
}

/// `--pattern`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum PatternChoice {
    /// Poisson-disc patterns
    Poisson,
    /// Owen-scrambled Sobol points
    Sobol,
    /// one such set for all patterns, dealt out for the least error at edges
    Dealt,
}

impl From<PatternChoice> for PatternKind {
    fn from(choice: PatternChoice) -> Self {
        match choice {
            PatternChoice::Poisson => Self::PoissonDisc,
            PatternChoice::Sobol => Self::Sobol,
            PatternChoice::Dealt => Self::Dealt,
        }
    }
}

/// `--kernel`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum KernelChoice {
    /// exp(-r2/2), which jumps to zero at the rim
    Gaussian,
    /// The Gaussian, lowered to reach zero at the rim
    Windowed,
    /// 1 inside: hard discs
    Disc,
}

impl From<KernelChoice> for Kernel {
    fn from(choice: KernelChoice) -> Self {
        match choice {
            KernelChoice::Gaussian => Self::Gaussian,
            KernelChoice::Windowed => Self::Windowed,
            KernelChoice::Disc => Self::Disc,
        }
    }
}

/// `--exp`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum TableChoice {
    /// 256 bins, read at their near edge
    Floor256,
    /// 256 bins, read at their middle
    Midpoint256,
    /// 256 bins, interpolated linearly
    Lerp256,
    /// 8 polynomials of degree 4
    Quartic8,
    /// 8 polynomials of the least degree that keeps the error below 1e-5
    Poly8,
}

impl From<TableChoice> for TableMode {
    fn from(choice: TableChoice) -> Self {
        match choice {
            TableChoice::Floor256 => Self::Floor256,
            TableChoice::Midpoint256 => Self::Midpoint256,
            TableChoice::Lerp256 => Self::Lerp256,
            TableChoice::Quartic8 => Self::Quartic8,
            TableChoice::Poly8 => Self::Poly8,
        }
    }
}

/// `--resolve`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub enum ResolveChoice {
    /// Fragments that overlap in depth are one surface
    #[default]
    Surface,
    /// Every fragment on its own, front to back: trained Gaussian splats
    Over,
}

/// `--coverage`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub enum CoverageChoice {
    /// A surface covers all of a sample, or nothing
    #[default]
    Opaque,
    /// In proportion to the sum of its weights, up to --wsat
    Soft,
}

/// `--shading`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub enum ShadingChoice {
    /// headlight where the cloud has no colour, else color
    #[default]
    Auto,
    /// The cloud's colours as they are
    Color,
    /// Lit by a lamp at the eye
    Headlight,
    /// Lit from far away: see --light
    Lambert,
    /// As auto without edl, darkened in creases and behind edges by the depths of the picture: see --edl-strength
    Edl,
}

impl ShadingChoice {
    /// The shading of a cloud, given whether it has colours and where a distant light is.
    pub fn shading(self, has_colors: bool, to_light: DVec3) -> Shading {
        match self {
            Self::Auto | Self::Edl if has_colors => Shading::Color,
            Self::Auto | Self::Edl | Self::Headlight => Shading::Headlight,
            Self::Color => Shading::Color,
            Self::Lambert => Shading::Lambert { to_light },
        }
    }
}

/// `--colormap`: perceptually uniform, all but gray.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ColorMapChoice {
    /// Violet, green, yellow
    Viridis,
    /// Blue, grey, yellow: the same to the colour-blind
    Cividis,
    /// Black, red, yellow, white
    Inferno,
    /// Dark grey to white
    Gray,
}

/// `--mapping`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub enum MappingChoice {
    /// By the cloud's own texture coordinates
    #[default]
    Uv,
    /// By longitude and latitude around the middle of the cloud; the front shows the middle of the image
    Spherical,
    /// Around the cloud's up axis, as high as the cloud
    Cylindrical,
    /// As seen from the front, as large as the cloud
    Planar,
}

/// `--texture-wrap`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub enum WrapChoice {
    /// The image again
    #[default]
    Repeat,
    /// Its edge
    Clamp,
    /// The image mirrored
    Mirror,
    /// Black
    Black,
}

impl From<WrapChoice> for Wrap {
    fn from(choice: WrapChoice) -> Self {
        match choice {
            WrapChoice::Repeat => Self::Repeat,
            WrapChoice::Clamp => Self::Clamp,
            WrapChoice::Mirror => Self::Mirror,
            WrapChoice::Black => Self::Black,
        }
    }
}

/// `--texture-filter`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub enum TextureFilterChoice {
    /// pbrt's triangle filter: fast, blurred where a surface is seen at an angle
    Trilinear,
    /// pbrt's EWA as printed, its errata included
    EwaPrinted,
    /// pbrt's EWA, corrected
    Ewa,
    /// Footprint Assembly, a power of two of probes
    Texram,
    /// Footprint Assembly, as many probes as it takes, with Gaussian weights
    Probes,
    /// Variance-compensated EWA: the most accurate
    #[default]
    EwaVc,
}

impl From<TextureFilterChoice> for Filter {
    fn from(choice: TextureFilterChoice) -> Self {
        match choice {
            TextureFilterChoice::Trilinear => Self::Trilinear,
            TextureFilterChoice::EwaPrinted => Self::EwaPrinted,
            TextureFilterChoice::Ewa => Self::Ewa,
            TextureFilterChoice::Texram => Self::Assembly(Probes::Texram),
            TextureFilterChoice::Probes => Self::Assembly(Probes::Gaussian),
            TextureFilterChoice::EwaVc => Self::EwaVc(Quality::DEFAULT),
        }
    }
}

/// `--texture-detail`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub enum DetailChoice {
    /// Once a splat and pixel
    #[default]
    Fragment,
    /// Once a splat: faster, and enough where splats are no larger than texels
    Splat,
}

impl From<DetailChoice> for Detail {
    fn from(choice: DetailChoice) -> Self {
        match choice {
            DetailChoice::Fragment => Self::Fragment,
            DetailChoice::Splat => Self::Splat,
        }
    }
}

/// The word for a choice on the command line.
pub fn word(choice: &impl ValueEnum) -> String {
    choice.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
}

/// `--engine`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub enum EngineChoice {
    /// The specification in plain scalar code, on one thread
    Reference,
    /// Eight samples at once, on all threads: the same bits
    #[default]
    Fast,
    /// Both side by side, up to the first fragment that differs; then a picture by the fast one
    Both,
}

/// `--progress`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub enum ProgressChoice {
    /// A bar, where stderr is a terminal
    #[default]
    Auto,
    /// A JSON object a line, on stderr
    Json,
    /// Nothing
    None,
}

/// `--exr-type`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub enum ExrTypeChoice {
    /// 16 bits (depth, position and counts always have 32)
    #[default]
    Half,
    /// 32 bits
    Float,
}

/// `--png-depth`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum PngDepthChoice {
    /// 256 levels
    #[value(name = "8")]
    Eight,
    /// 65,536 levels
    #[value(name = "16")]
    Sixteen,
}

impl From<PngDepthChoice> for PngDepth {
    fn from(choice: PngDepthChoice) -> Self {
        match choice {
            PngDepthChoice::Eight => Self::Eight,
            PngDepthChoice::Sixteen => Self::Sixteen,
        }
    }
}

/// `--exr-compression`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub enum CompressionChoice {
    /// Largest, fastest
    None,
    /// Run lengths
    Rle,
    /// Deflate, 16 lines at a time
    #[default]
    Zip,
    /// Deflate, line by line
    Zips,
    /// Wavelets: good for noise
    Piz,
}

impl From<CompressionChoice> for splat_io::Compression {
    fn from(choice: CompressionChoice) -> Self {
        match choice {
            CompressionChoice::None => Self::None,
            CompressionChoice::Rle => Self::Rle,
            CompressionChoice::Zip => Self::Zip,
            CompressionChoice::Zips => Self::Zips,
            CompressionChoice::Piz => Self::Piz,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The words of a choice, each of which stands for a different value.
    fn words<T: ValueEnum + PartialEq>() -> Vec<String> {
        let variants = T::value_variants();
        let names =
            variants.iter().map(|variant| variant.to_possible_value().expect("listed").get_name().to_owned());
        let names: Vec<String> = names.collect();
        for (name, variant) in names.iter().zip(variants) {
            assert!(T::from_str(name, false).as_ref() == Ok(variant), "{name}");
        }
        assert!(T::from_str("nonsense", false).is_err());
        names
    }

    #[test]
    fn the_words_are_those_of_the_specification() {
        assert_eq!(words::<UpChoice>(), ["y", "z", "-y", "-z"]);
        assert_eq!(words::<FilterChoice>(), ["box", "tent", "gaussian", "blackman-harris"]);
        assert_eq!(words::<PatternChoice>(), ["poisson", "sobol", "dealt"]);
        assert_eq!(words::<KernelChoice>(), ["gaussian", "windowed", "disc"]);
        assert_eq!(words::<TableChoice>(), ["floor256", "midpoint256", "lerp256", "quartic8", "poly8"]);
        assert_eq!(words::<ResolveChoice>(), ["surface", "over"]);
        assert_eq!(words::<CoverageChoice>(), ["opaque", "soft"]);
        assert_eq!(words::<ShadingChoice>(), ["auto", "color", "headlight", "lambert", "edl"]);
        assert_eq!(words::<ColorMapChoice>(), ["viridis", "cividis", "inferno", "gray"]);
        assert_eq!(words::<MappingChoice>(), ["uv", "spherical", "cylindrical", "planar"]);
        assert_eq!(words::<WrapChoice>(), ["repeat", "clamp", "mirror", "black"]);
        let filters = ["trilinear", "ewa-printed", "ewa", "texram", "probes", "ewa-vc"];
        assert_eq!(words::<TextureFilterChoice>(), filters);
        assert_eq!(words::<DetailChoice>(), ["fragment", "splat"]);
        assert_eq!(words::<EngineChoice>(), ["reference", "fast", "both"]);
        assert_eq!(words::<ProgressChoice>(), ["auto", "json", "none"]);
        assert_eq!(words::<ExrTypeChoice>(), ["half", "float"]);
        assert_eq!(words::<CompressionChoice>(), ["none", "rle", "zip", "zips", "piz"]);
    }

    #[test]
    fn a_cloud_without_colours_gets_a_headlight() {
        assert_eq!(ShadingChoice::Auto.shading(true, DVec3::Z), Shading::Color);
        assert_eq!(ShadingChoice::Auto.shading(false, DVec3::Z), Shading::Headlight);
        assert_eq!(ShadingChoice::Color.shading(false, DVec3::Z), Shading::Color);
        assert_eq!(ShadingChoice::Headlight.shading(true, DVec3::Z), Shading::Headlight);
    }
}
