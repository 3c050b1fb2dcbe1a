//! The command line as it is written: raw options, before anything is known of the cloud.

use crate::checkpoint::CheckpointArguments;
use crate::choices::{
    ColorMapChoice, CompressionChoice, CoverageChoice, DetailChoice, EngineChoice, ExrTypeChoice,
    FilterChoice, KernelChoice, MappingChoice, PatternChoice, PngDepthChoice, ProgressChoice, ResolveChoice,
    ShadingChoice, TableChoice, TextureFilterChoice, UpChoice, WrapChoice,
};
use crate::console::Console;
use crate::diff::DiffArguments;
use crate::frames::FrameArguments;
use crate::map::MapArguments;
use crate::memory::Memory;
use crate::prepare::{PreparationArguments, PrepareArguments};
use crate::scene::Scene;
use crate::values::{self, Background, Classes, ColorChoice, Columns, ThicknessValue, Tile, ViewDirection};
use clap::{Args, Parser, Subcommand};
use splat_core::{AovSelection, PixelRect};
use std::ffi::OsString;
use std::ops::Range;
use std::path::PathBuf;

/// Pictures of surfel clouds.
#[derive(Debug, Parser)]
#[command(name = "splat", version, arg_required_else_help = true)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render clouds and meshes to a picture
    Render(Box<RenderArguments>),
    /// Make a cloud from meshes and clouds
    ///
    /// Meshes are covered evenly with surfels: an OBJ file, and a PLY file that has faces (which render takes for the cloud
    /// of its vertices). Each surfel has an area, a normal, axes and, where the mesh has them, colour and texture
    /// coordinates. Clouds are written as they are, several as one; what they lack is estimated by render, and what the format
    /// has no place for is named.
    Convert(ConvertArguments),
    /// Make a cloud complete (.ply): normals, sizes, areas, stray points
    ///
    /// Rendering the result gives the picture of the original, without estimating again.
    Prepare(PrepareArguments),
    /// Say what is in a file, and every assumption made in reading it
    Info(InfoArguments),
    /// Join crops, tiles and ranges of samples to the picture of one run
    ///
    /// Pieces are .exr files of one command line, but for --crop, --tile and --samples. Crops and tiles give the very bits of one
    /// run, ranges of samples agree with it to 2 units in the last place of a float.
    Merge(MergeArguments),
    /// Say how two pictures differ: exit code 0 if they are the same, 1 if not, 2 if they cannot be compared
    ///
    /// The same are pictures whose common channels are equal bit for bit, or, if tolerances are given, where all of these
    /// hold. Of EXR files values are compared as they are; where one picture is a PNG file, the other is compared as the PNG
    /// file that would be written of it.
    Diff(DiffArguments),
    /// Render a scene made in code, which shows what the program does
    Demo(DemoArguments),
}

/// `splat convert`.
#[derive(Debug, Args)]
pub struct ConvertArguments {
    /// Meshes (.obj, or .ply with faces) and clouds (.ply, .las, .laz, .pcd, text, .splat, .spz); several become one cloud
    #[arg(required = true, value_name = "IN")]
    pub inputs: Vec<PathBuf>,
    /// The cloud: .ply, .las, .laz, .xyz, .txt, .asc, .csv, or .splat for viewers of trained splats
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Surfels on each mesh
    #[arg(long, value_name = "N", default_value_t = DEFAULT_POINTS, value_parser = values::points)]
    pub points: usize,
    /// Seed of the surfels' places
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Write a PLY file as text instead of binary numbers
    #[arg(long)]
    pub ascii: bool,
    /// How files are read.
    #[command(flatten)]
    pub reading: ReadArguments,
    /// How much memory may be used.
    #[command(flatten, next_help_heading = "Program")]
    pub memory: Memory,
    /// How talkative the program is.
    #[command(flatten, next_help_heading = "Program")]
    pub talk: TalkArguments,
}

/// How files are read.
#[derive(Debug, Clone, Default, Args)]
pub struct ReadArguments {
    /// What the columns of text files are: x, y, z, r, g, b, nx, ny, nz, radius, the name of a field, or - for nothing
    /// [default: what their names or values tell]
    #[arg(long, value_name = "x,y,z,..", value_parser = values::columns, allow_hyphen_values = true)]
    pub columns: Option<Columns>,
    /// Only points of these classes, as 2,6 or, all but these, !7,18
    #[arg(long, value_name = "LIST", value_parser = values::classes)]
    pub classes: Option<Classes>,
    /// Refuse files of which anything would be dropped, skipped or changed, instead of saying how much
    #[arg(long)]
    pub strict: bool,
}

impl ReadArguments {
    /// Takes from others what these leave open.
    pub fn fill_in(&mut self, others: &Self) {
        self.columns = self.columns.take().or_else(|| others.columns.clone());
        self.classes = self.classes.take().or_else(|| others.classes.clone());
        self.strict |= others.strict;
    }

    /// The options in words, as the command line has them.
    pub fn describe(&self) -> String {
        let columns = self.columns.as_ref().map(|columns| format!(" --columns {}", columns.0.join(",")));
        let classes = self.classes.as_ref().map(|classes| format!(" --classes {classes}"));
        columns.into_iter().chain(classes).collect()
    }
}

/// Surfels on a mesh: one spacing is then below two pixels where the surface fills a picture of the default size.
pub const DEFAULT_POINTS: usize = 200_000;

/// `splat info`.
#[derive(Debug, Args)]
pub struct InfoArguments {
    /// A cloud (.ply, .las, .laz, .pcd, text, .splat, .spz, points3D of COLMAP), a mesh (.obj) or cameras (.json, .log, a
    /// COLMAP folder)
    pub file: PathBuf,
    /// What the columns of a text file are: see render
    #[arg(long, value_name = "x,y,z,..", value_parser = values::columns, allow_hyphen_values = true)]
    pub columns: Option<Columns>,
    /// Fail if anything of the file would be dropped, skipped or changed
    #[arg(long)]
    pub strict: bool,
    /// Write JSON
    #[arg(long)]
    pub json: bool,
    /// How much memory may be used.
    #[command(flatten)]
    pub memory: Memory,
}

/// `splat merge`.
#[derive(Debug, Args)]
pub struct MergeArguments {
    /// The pieces (.exr), in any order
    #[arg(required = true, value_name = "PIECE")]
    pub pieces: Vec<PathBuf>,
    /// The picture: .exr; or .png, of pieces of floats (--exr-type float)
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// The whole is this part of the frame, half open
    #[arg(long, value_name = "x0,y0,x1,y1", value_parser = values::crop)]
    pub crop: Option<PixelRect>,
    /// Lossless compression of an EXR file [default: that of the pieces]
    #[arg(long, value_name = "METHOD")]
    pub exr_compression: Option<CompressionChoice>,
    /// Bits of a value in a PNG file
    #[arg(long, value_name = "BITS", default_value = "8")]
    pub png_depth: PngDepthChoice,
    /// Say nothing but errors
    #[arg(long)]
    pub quiet: bool,
}

/// `splat demo`.
#[derive(Debug, Args)]
pub struct DemoArguments {
    /// The picture: .exr or .png
    #[arg(short, long, value_name = "FILE", required_unless_present = "save_ply")]
    pub output: Option<PathBuf>,
    /// Write the cloud as a PLY file, for `splat render`
    #[arg(long, value_name = "FILE")]
    pub save_ply: Option<PathBuf>,
    /// Write the camera as a JSON file, for `splat render --camera`
    #[arg(long, value_name = "FILE")]
    pub save_camera: Option<PathBuf>,
    /// Width and height of the picture, in pixels
    #[arg(long, value_name = "WxH", value_parser = values::size, default_value = "1280x720")]
    pub size: [u32; 2],
    /// Samples a pixel
    #[arg(long, value_name = "S", default_value_t = 16)]
    pub spp: u32,
    /// How talkative the program is.
    #[command(flatten)]
    pub talk: TalkArguments,
}

/// `splat render`.
#[derive(Debug, Args)]
pub struct RenderArguments {
    /// Clouds (.ply, .las, .laz, .pcd, text, .splat, .spz, COLMAP points) and meshes (.obj, sampled as by convert), several
    /// as one; or a scene file (.toml)
    #[arg(required = true, value_name = "IN")]
    pub inputs: Vec<PathBuf>,
    /// The picture: .exr (linear, all AOVs) or .png [default: the input's name with .png, here]
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    pub output: Option<PathBuf>,
    /// Print a scene file that means this command line instead of rendering it
    #[arg(long, help_heading = "Program")]
    pub print_config: bool,
    /// The scene file among the inputs, once it is read.
    #[arg(skip)]
    pub scene: Option<Scene>,
    /// How files are read.
    #[command(flatten, next_help_heading = "Input")]
    pub reading: ReadArguments,
    /// From where.
    #[command(flatten, next_help_heading = "Camera")]
    pub camera: CameraArguments,
    /// What part of the picture, and how it is sampled.
    #[command(flatten, next_help_heading = "Film")]
    pub samples: SampleArguments,
    /// What the splats look like.
    #[command(flatten, next_help_heading = "Splats")]
    pub splats: SplatArguments,
    /// What is estimated, and how.
    #[command(flatten, next_help_heading = "Preparation")]
    pub preparation: PreparationArguments,
    /// Textures and surroundings.
    #[command(flatten, next_help_heading = "Texture")]
    pub material: MaterialArguments,
    /// What is written.
    #[command(flatten, next_help_heading = "Output")]
    pub outputs: OutputArguments,
    /// When checkpoints are made and used.
    #[command(flatten, next_help_heading = "Program")]
    pub checkpoint: CheckpointArguments,
    /// How much memory may be used.
    #[command(flatten, next_help_heading = "Program")]
    pub memory: Memory,
    /// How talkative the program is.
    #[command(flatten, next_help_heading = "Program")]
    pub talk: TalkArguments,
}

impl RenderArguments {
    /// The picture: as named, or else after the first input.
    pub fn picture(&self) -> PathBuf {
        self.output.clone().unwrap_or_else(|| {
            let stem = self.inputs.first().and_then(|input| input.file_stem()).unwrap_or("picture".as_ref());
            [stem, ".png".as_ref()].into_iter().collect::<OsString>().into()
        })
    }
}

/// The camera: from a file, or fitted to the cloud.
#[derive(Debug, Clone, Default, Args)]
pub struct CameraArguments {
    /// Cameras instead of one that is fitted to the cloud: our JSON, a COLMAP folder, transforms.json, Open3D's JSON or .log,
    /// cameras.json of 3DGS
    #[arg(long, value_name = "PATH", conflicts_with_all = ["view", "up", "ortho"])]
    pub camera: Option<PathBuf>,
    /// Which of several cameras.
    #[command(flatten)]
    pub frames: FrameArguments,
    /// front, back, left, right, top, bottom, or AZIMUTH,ELEVATION in degrees [default: 30,20]
    #[arg(long, value_name = "VIEW", value_parser = values::view, allow_hyphen_values = true)]
    pub view: Option<ViewDirection>,
    /// The axis that points up [default: y; z where the cloud lies far from zero, as maps do; -y for trained splats]
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true)]
    pub up: Option<UpChoice>,
    /// An orthographic camera, from top, bottom, front, back, left or right or else as --view says
    #[arg(long, value_name = "VIEW", num_args = 0..=1, value_parser = values::face)]
    #[arg(conflicts_with_all = ["fstop", "lens_radius", "focus", "blades"])]
    pub ortho: Option<Option<ViewDirection>>,
    /// The scale of a print.
    #[command(flatten)]
    pub map: MapArguments,
    /// Width and height of the picture, in pixels; of the shape of a camera's own [default: its own, or 1280x960]
    #[arg(long, value_name = "WxH", value_parser = values::size, help_heading = "Film")]
    pub size: Option<[u32; 2]>,
    /// f-number of a thin lens whose image plane is at distance 1, in camera units
    #[arg(long, value_name = "N", value_parser = values::positive, help_heading = "Lens")]
    pub fstop: Option<f64>,
    /// Radius of a thin lens, in scene units; overrides --fstop
    #[arg(long, value_name = "R", value_parser = values::positive, help_heading = "Lens")]
    pub lens_radius: Option<f64>,
    /// Depth in focus, in camera units, or inf [default: that of the cloud's centre]
    #[arg(long, value_name = "DEPTH", value_parser = values::focus, help_heading = "Lens")]
    pub focus: Option<f64>,
    /// Straight blades of the aperture; 0 is round
    #[arg(long, value_name = "N", value_parser = values::blades, help_heading = "Lens")]
    pub blades: Option<u32>,
    /// Nothing nearer than this depth is drawn, in camera units [default: 1e-4 of the cloud's diagonal]
    #[arg(long, value_name = "DEPTH", value_parser = values::positive)]
    pub near: Option<f64>,
}

/// The samples and the pixels.
#[derive(Debug, Clone, Args)]
pub struct SampleArguments {
    /// Samples a pixel
    #[arg(long, value_name = "S", default_value_t = 16)]
    pub spp: u32,
    /// Only these of the samples, half open
    #[arg(long, value_name = "A:B", value_parser = values::samples)]
    pub samples: Option<Range<u32>>,
    /// Only these pixels, half open
    #[arg(long, value_name = "x0,y0,x1,y1", value_parser = values::crop, conflicts_with = "tile")]
    pub crop: Option<PixelRect>,
    /// Only tile I (from 0, row by row) of N columns by M rows
    #[arg(long, value_name = "I/NxM", value_parser = values::tile)]
    pub tile: Option<Tile>,
    /// The pixel filter
    #[arg(long, value_name = "FILTER", default_value = "blackman-harris")]
    pub filter: FilterChoice,
    /// The set of sample positions
    #[arg(long, value_name = "PATTERN", default_value = "dealt")]
    pub pattern: PatternChoice,
    /// Seed of the sample positions
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
}

/// The splats and their surfaces.
#[derive(Debug, Clone, Args)]
pub struct SplatArguments {
    /// How fragments become a colour [default: surface; over if all inputs are trained splats]
    #[arg(long, value_name = "RESOLVE")]
    pub resolve: Option<ResolveChoice>,
    /// The shape of a splat's weight [default: windowed; gaussian with --resolve over]
    #[arg(long, value_name = "KERNEL")]
    pub kernel: Option<KernelChoice>,
    /// F: a splat reaches to sqrt(F) sigma [default: 4; 9 with --resolve over]
    #[arg(long, value_name = "F", value_parser = values::cutoff)]
    pub cutoff: Option<f64>,
    /// How the kernel's table is read
    #[arg(long, value_name = "TABLE", default_value = "poly8")]
    pub exp: TableChoice,
    /// How much of a sample a surface covers [default: opaque]
    #[arg(long, value_name = "COVERAGE")]
    pub coverage: Option<CoverageChoice>,
    /// Sum of weights at which soft coverage is full [default: 1]
    #[arg(long, value_name = "W", value_parser = values::positive)]
    pub wsat: Option<f64>,
    /// Half thickness of a surface in sigma, or listing [default: 0.5]
    #[arg(long, value_name = "C", value_parser = values::thickness)]
    pub thickness: Option<ThicknessValue>,
    /// Draw the fronts of splats only
    #[arg(long)]
    pub cull: bool,
    /// What is shown as colour.
    #[command(flatten)]
    pub colors: ColorArguments,
    /// How light falls on splats
    #[arg(long, value_name = "SHADING", default_value = "auto", help_heading = "Light")]
    pub shading: ShadingChoice,
    /// How much --shading edl darkens; 1 is usual [default: 1]
    #[arg(long, value_name = "STRENGTH", value_parser = values::positive, help_heading = "Light")]
    pub edl_strength: Option<f64>,
    /// Where --shading lambert has its light: AZIMUTH,ELEVATION in degrees, as in --view [default: 45,45]
    #[arg(long, value_name = "DIRECTION", value_parser = values::view, allow_hyphen_values = true)]
    #[arg(help_heading = "Light")]
    pub light: Option<ViewDirection>,
    /// Linear R,G,B or R,G,B,A behind everything, or none
    #[arg(long, value_name = "COLOR", value_parser = values::background, default_value = "none")]
    #[arg(allow_hyphen_values = true, help_heading = "Film")]
    pub background: Background,
}

/// What is shown as colour.
#[derive(Debug, Clone, Default, Args)]
pub struct ColorArguments {
    /// What is shown as colour: rgb, intensity, height, normal, class, or the name of a scalar field
    /// [default: rgb; where there is none, the intensity]
    #[arg(long, value_name = "WHAT", value_parser = values::color)]
    pub color: Option<ColorChoice>,
    /// The colours of numbers [default: viridis; gray for the intensity]
    #[arg(long, value_name = "MAP")]
    pub colormap: Option<ColorMapChoice>,
    /// The numbers at both ends of the colours [default: 2 % of the points lie below, and 2 % above]
    #[arg(long, value_name = "LO:HI", value_parser = values::color_range, allow_hyphen_values = true)]
    pub color_range: Option<[f64; 2]>,
}

/// What a scene file may say of one of its clouds, besides where it is.
#[derive(Debug, Clone, Parser)]
#[command(no_binary_name = true)]
pub struct CloudArguments {
    /// How the file is read.
    #[command(flatten)]
    pub reading: ReadArguments,
    /// What is shown as its colour.
    #[command(flatten)]
    pub colors: ColorArguments,
    /// What it is made of.
    #[command(flatten)]
    pub material: MaterialArguments,
    /// Factor on its sizes, besides that of all clouds
    #[arg(long, value_parser = values::positive, default_value_t = 1.0)]
    pub radius_scale: f64,
    /// Factor on its opacities, 0 to 1
    #[arg(long, value_parser = values::share, default_value_t = 1.0)]
    pub opacity: f64,
}

/// Textures and surroundings.
#[derive(Debug, Clone, Args)]
pub struct MaterialArguments {
    /// An image (.png, .exr) on the surface, in place of the cloud's colours
    #[arg(long, value_name = "IMAGE")]
    pub texture: Option<PathBuf>,
    /// How it lies on the surface [default: uv]
    #[arg(long, value_name = "MAPPING")]
    pub mapping: Option<MappingChoice>,
    /// What lies beyond its edges [default: repeat]
    #[arg(long, value_name = "WRAP")]
    pub texture_wrap: Option<WrapChoice>,
    /// How often it is repeated over the unit square of --mapping uv [default: 1,1]
    #[arg(long, value_name = "S,T", value_parser = values::repeat, allow_hyphen_values = true)]
    pub texture_repeat: Option<[f64; 2]>,
    /// How images are filtered
    #[arg(long, value_name = "FILTER", default_value = "ewa-vc")]
    pub texture_filter: TextureFilterChoice,
    /// How many times as long as wide a filter may be: bounds the time of a lookup, 1 to 256
    #[arg(long, value_name = "A", value_parser = values::anisotropy, default_value_t = 16.0)]
    pub max_anisotropy: f64,
    /// How often images are looked up
    #[arg(long, value_name = "DETAIL", default_value = "fragment")]
    pub texture_detail: DetailChoice,
    /// An image (.png, .exr) of all directions by longitude and latitude, up above, to be seen in the surface
    #[arg(long, value_name = "IMAGE", help_heading = "Light")]
    pub environment: Option<PathBuf>,
    /// See the surroundings as in a mirror; the default
    #[arg(long, conflicts_with = "refract", help_heading = "Light")]
    pub reflect: bool,
    /// See the surroundings through the surface, whose index of refraction this is (glass: 1.5)
    #[arg(long, value_name = "IOR", value_parser = values::positive, help_heading = "Light")]
    pub refract: Option<f64>,
}

impl MaterialArguments {
    /// The images that it names.
    pub fn images(&self) -> impl Iterator<Item = &PathBuf> {
        self.texture.iter().chain(&self.environment)
    }
}

/// What is written besides the picture, and how.
#[derive(Debug, Clone, Args)]
pub struct OutputArguments {
    /// More EXR channels: depth,normal,albedo,position,id,coverage,layers,samples,variance or all
    #[arg(long, value_name = "LIST", value_parser = values::aovs)]
    pub aov: Option<AovSelection>,
    /// Write each of these channels to an EXR file of its own beside the picture: OUT.depth.exr, OUT.normal.exr, ..
    #[arg(long, requires = "aov")]
    pub aov_files: bool,
    /// Bits of a value in a PNG file
    #[arg(long, value_name = "BITS", default_value = "8")]
    pub png_depth: PngDepthChoice,
    /// Floats of an EXR file
    #[arg(long, value_name = "TYPE", default_value = "half")]
    pub exr_type: ExrTypeChoice,
    /// Lossless compression of an EXR file
    #[arg(long, value_name = "METHOD", default_value = "zip")]
    pub exr_compression: CompressionChoice,
    /// Write what the picture took as JSON; - is stdout
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,
    /// The renderer
    #[arg(long, value_name = "ENGINE", default_value = "fast")]
    pub engine: EngineChoice,
    /// Threads; 0 is one a processor (the reference engine uses one) [default: 0]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,
}

/// How talkative the program is.
#[derive(Debug, Clone, Copy, Args)]
pub struct TalkArguments {
    /// Say nothing but errors
    #[arg(long, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Say what was assumed, too
    #[arg(short, long)]
    pub verbose: bool,
    /// How progress is shown
    #[arg(long, value_name = "HOW", default_value = "auto")]
    pub progress: ProgressChoice,
}

impl TalkArguments {
    /// Where messages go.
    pub fn console(self) -> Console {
        Console { quiet: self.quiet, verbose: self.verbose }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;
    use clap::error::ErrorKind;

    fn render(options: &str) -> Result<RenderArguments, ErrorKind> {
        let line =
            ["splat", "render", "in.ply", "-o", "out.exr"].into_iter().chain(options.split_whitespace());
        match Arguments::try_parse_from(line).map_err(|error| error.kind())?.command {
            Command::Render(arguments) => Ok(*arguments),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn clap_finds_nothing_wrong() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn every_option_of_the_specification_is_there() {
        let line = "--view front --up z --size 64x48 --spp 8 --samples 0:4 --crop 0,0,8,8 --fstop 8 \
                    --focus inf --blades 6 --near 0.1 --filter box --pattern poisson --kernel disc \
                    --cutoff 2 --exp floor256 --resolve surface --coverage soft --wsat 0.9 --thickness \
                    listing --cull --radius-scale 1.5 --background 0,0,0,1 --aov depth,id --engine \
                    reference --threads 4 --seed 7 --quiet --progress json --stats - --shading lambert \
                    --light 30,-10 --texture t.png --mapping planar --texture-wrap clamp --texture-filter \
                    trilinear --max-anisotropy 8 --texture-detail splat --environment e.exr --reflect \
                    --exr-type float --exr-compression piz --columns x,y,z,- --classes !7,18 --color height \
                    --colormap inferno --color-range -1:2.5 --resume --checkpoint 0.5 --max-memory 1.5g";
        let arguments = render(line).unwrap();
        assert_eq!(arguments.camera.focus, Some(f64::INFINITY));
        assert_eq!(arguments.samples.samples, Some(0..4));
        assert_eq!(arguments.outputs.stats, Some(PathBuf::from("-")));
        render("--camera cam.json --tile 0/2x2 --lens-radius 0.1 -v").unwrap();
        assert_eq!(render("--ortho --view top").unwrap().camera.ortho, Some(None));
        let top = ViewDirection { azimuth: 0.0, elevation: 90.0 };
        let map = render("--ortho top --scale 1:200 --dpi 300 --unit us-ft").unwrap().camera;
        assert_eq!((map.ortho, map.map.scale, map.map.dpi), (Some(Some(top)), Some(200.0), Some(300.0)));
        render("--camera c.json --size 4x4 --camera-name a --intrinsic i.json").unwrap();
        render("--camera c.json --frames 1-10x2,5").unwrap();
        render("--turntable 36 --view 10,20 --up z --frames 1-18").unwrap();
    }

    #[test]
    fn values_may_begin_with_a_hyphen_where_that_makes_sense() {
        let arguments = render("--view -30,-20 --up -y --background -1,0,0").unwrap();
        assert_eq!(arguments.camera.view, Some(ViewDirection { azimuth: -30.0, elevation: -20.0 }));
        assert_eq!(arguments.camera.up, Some(UpChoice::MinusY));
    }

    #[test]
    fn contradictions_are_refused() {
        let contradictions = [
            "--camera c.json --turntable 4",
            "--camera c.json --camera-name a --frames 1",
            "--ortho --scale 1:2 --size 4x4",
            "--ortho --scale 1:2 --turntable 4",
            "--camera c.json --view front",
            "--camera c.json --up z",
            "--camera c.json --ortho",
            "--ortho --fstop 4",
            "--ortho --lens-radius 1",
            "--ortho --focus 1",
            "--ortho --blades 6",
            "--crop 0,0,4,4 --tile 0/2x2",
            "--quiet -v",
            "--environment e.exr --reflect --refract 1.5",
        ];
        for line in contradictions {
            assert_eq!(render(line).unwrap_err(), ErrorKind::ArgumentConflict, "{line}");
        }
    }

    #[test]
    fn wrong_values_are_refused() {
        for line in ["--frames 0", "--turntable 0", "--ortho up", "--ortho --scale 200", "--dpi 0"] {
            assert_eq!(render(line).unwrap_err(), ErrorKind::ValueValidation, "{line}");
        }
        for line in ["--scale 1:2", "--camera-name a", "--ortho --unit m", "--intrinsic a"] {
            assert_eq!(render(line).unwrap_err(), ErrorKind::MissingRequiredArgument, "{line}");
        }
        for line in ["--size 0x4", "--focus 0", "--aov z", "--wsat 0", "--radius-scale 0", "--view 1"] {
            assert_eq!(render(line).unwrap_err(), ErrorKind::ValueValidation, "{line}");
        }
        for line in
            ["--max-memory 0", "--max-memory 2Q", "--max-memory M", "--max-memory=-1", "--checkpoint x"]
        {
            assert_eq!(render(line).unwrap_err(), ErrorKind::ValueValidation, "{line}");
        }
        for line in ["--up x", "--filter sinc", "--engine gpu"] {
            assert_eq!(render(line).unwrap_err(), ErrorKind::InvalidValue, "{line}");
        }
    }

    #[test]
    fn convert_counts_surfels() {
        let parse =
            |line: &str| Arguments::try_parse_from(line.split_whitespace()).map(|parsed| parsed.command);
        let Command::Convert(arguments) =
            parse("splat convert a.obj b.ply -o c.ply --points 9 --seed 3").unwrap()
        else {
            panic!("not convert")
        };
        assert_eq!((arguments.inputs.len(), arguments.points, arguments.seed), (2, 9, 3));
        for line in ["convert a.obj", "convert -o c.ply", "convert a.obj -o c.ply --points 0"] {
            assert!(parse(&format!("splat {line}")).is_err(), "{line}");
        }
    }

    #[test]
    fn demo_wants_something_to_write() {
        let parse = |line: &str| Arguments::try_parse_from(line.split_whitespace());
        assert!(parse("splat demo").is_err());
        assert!(parse("splat demo -o a.png").is_ok());
        assert!(parse("splat demo --save-ply a.ply").is_ok());
    }
}
