//! Pictures as OpenEXR: everything that a film holds.

use crate::png_file::{check_colors, check_length};
use crate::{AtomicFile, Error, Metadata};
use exr::block::BlockIndex;
use exr::block::UncompressedBlock;
use exr::image::write::channels::{ChannelsWriter, WritableChannels};
use exr::math::RoundingMode;
use exr::meta::attribute::{
    AttributeValue, ChannelDescription, ChannelList, IntegerBounds, LevelMode, LineOrder, SampleType, Text,
};
use exr::meta::header::{Header, ImageAttributes, LayerAttributes};
use exr::prelude::{Blocks, Encoding, Image, Layer, SmallVec, Vec2, WritableImage, f16};
use glam::{DMat4, DVec3, Vec3};
use splat_core::{Ending, Film, PixelRect, SampleSums};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{self, BufRead, BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

pub mod picture;

/// How an EXR file is packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ExrOptions {
    /// Whether color, alpha, normal, albedo and coverage are 32-bit floats instead of 16-bit ones.
    pub full_floats: bool,
    /// The compression; all are lossless.
    pub compression: Compression,
    /// Whether all processor cores may compress.
    pub parallel: bool,
}

impl Default for ExrOptions {
    fn default() -> Self {
        Self { full_floats: false, compression: Compression::Zip, parallel: true }
    }
}

/// Lossless compressions of EXR files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Compression {
    /// None: largest and fastest.
    None,
    /// Run lengths: good for flat pictures.
    Rle,
    /// Deflate, 16 lines at a time.
    #[default]
    Zip,
    /// Deflate, line by line.
    Zips,
    /// Wavelets: good for noisy pictures.
    Piz,
}

impl Compression {
    fn encoding(self) -> exr::prelude::Compression {
        match self {
            Self::None => exr::prelude::Compression::Uncompressed,
            Self::Rle => exr::prelude::Compression::RLE,
            Self::Zip => exr::prelude::Compression::ZIP16,
            Self::Zips => exr::prelude::Compression::ZIP1,
            Self::Piz => exr::prelude::Compression::PIZ,
        }
    }
}

/// Writes a film as an EXR file, in one step ([`AtomicFile`]).
///
/// Color and alpha are linear and premultiplied. The film's window is the data window, its frame the display
/// window. Always there: `R G B A`; where the film has them: `Z`, `N.X N.Y N.Z`, `albedo.R albedo.G
/// albedo.B`, `P.X P.Y P.Z`, `id` (unsigned integers), `coverage`, `layers`, `samples`, `variance.R
/// variance.G variance.B`. `Z`, `P`, `layers`, `samples` and `variance` are always 32-bit floats. What a
/// 16-bit float cannot hold becomes the greatest one that it can (65504), infinities too.
///
/// The metadata become the attributes `software`, `xDensity` (pixels an inch), `worldToCamera` (the standard one, for row vectors, 32-bit
/// floats) and, where those lose digits, `worldToCameraText` (rows listed, for column vectors), `samples` (an
/// integer; the others are texts), `sampleRange` ("A:B", half open), `seed`, `engine`, `options`,
/// `inputHash`, `camera` (our JSON); where there are positions, `positionOrigin` ("X Y Z", to be added to `P`). The
/// same film and metadata give the same bytes.
///
/// A film with [`Film::sums`] has these in channels `sums.NAME.high` and `sums.NAME.low`, the upper and lower half of the bits
/// of an `f64`, and in the attributes `sumsBackground` ("R G B A" or "none") and `sumsSpace` ("linear", or "sRGB" for
/// `--resolve over`) what else is needed to join it with the film of the other samples ([`crate::merge()`]).
///
/// # Errors
/// [`Error::Io`]; [`Error::Core`] if the film is empty or its arrays do not fit its window;
/// [`Error::Encode`].
pub fn write_exr(path: &Path, film: &Film, metadata: &Metadata, options: &ExrOptions) -> Result<(), Error> {
    let channels = Channels::new(film, options.full_floats).map_err(Error::core(path))?;
    write_channels(path, &Place::of(film, true), channels, metadata, options)
}

/// Writes each of the film's AOVs as an EXR file of its own beside the picture `path`: for `out.exr` or `out.png` the files
/// `out.depth.exr`, `out.normal.exr` and so on, with the channels that [`write_exr`] gives them, save sums. Returns their
/// paths.
///
/// # Errors
/// As [`write_exr`].
pub fn write_aov_files(
    path: &Path,
    film: &Film,
    metadata: &Metadata,
    options: &ExrOptions,
) -> Result<Vec<PathBuf>, Error> {
    let channels = Channels::new(film, options.full_floats).map_err(Error::core(path))?;
    channels
        .by_aov()
        .into_iter()
        .filter(|(aov, _)| aov != COLOR && aov != SUMS)
        .map(|(aov, channels)| {
            let path = path.with_extension(format!("{aov}.exr"));
            write_channels(&path, &Place::of(film, false), channels, metadata, options)?;
            Ok(path)
        })
        .collect()
}

/// Writes color and alpha alone as an EXR file, for [`write_aov_files`] to do the rest.
///
/// # Errors
/// As [`write_exr`].
pub fn write_color_exr(
    path: &Path,
    film: &Film,
    metadata: &Metadata,
    options: &ExrOptions,
) -> Result<(), Error> {
    let mut channels = Channels::new(film, options.full_floats).map_err(Error::core(path))?;
    channels.0.retain(|channel| channel.aov() == COLOR);
    write_channels(path, &Place::of(film, false), channels, metadata, options)
}

/// Where the pixels of a picture are, and what belongs to its channels.
struct Place {
    frame: [u32; 2],
    window: PixelRect,
    /// To be added to positions, if there are some.
    position_origin: Option<DVec3>,
    /// What becomes of sums, if there are some.
    ending: Option<Ending>,
}

impl Place {
    fn of(film: &Film, with_sums: bool) -> Self {
        Self {
            frame: film.frame,
            window: film.window,
            position_origin: film.position.as_ref().map(|_| film.position_origin),
            ending: film.sums.as_ref().filter(|_| with_sums).map(|sums| sums.ending),
        }
    }
}

fn write_channels(
    path: &Path,
    place: &Place,
    channels: Channels<'_>,
    metadata: &Metadata,
    options: &ExrOptions,
) -> Result<(), Error> {
    let attributes = layer_attributes(place, metadata);
    let encoding = Encoding {
        compression: options.compression.encoding(),
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let frame = Vec2(place.frame[0] as usize, place.frame[1] as usize);
    let size = (place.window.width(), place.window.height());
    let image = Image {
        attributes: ImageAttributes::new(IntegerBounds::from_dimensions(frame)),
        layer_data: Layer::new(size, attributes, encoding, channels),
    };

    let mut file = AtomicFile::create(path)?;
    let mut out = BufWriter::new(&mut file);
    let writer = image.write();
    let written = if options.parallel {
        writer.to_buffered(&mut out)
    } else {
        writer.non_parallel().to_buffered(&mut out)
    };
    written.map_err(|error| match error {
        exr::error::Error::Io(error) => Error::io(path, "write")(error),
        other => Error::Encode { path: path.to_owned(), reason: other.to_string() },
    })?;
    out.flush().map_err(Error::io(path, "write"))?;
    drop(out);
    sort_attributes(&mut file).map_err(Error::io(path, "write"))?;
    file.commit()
}

fn layer_attributes(place: &Place, metadata: &Metadata) -> LayerAttributes {
    let mut attributes = LayerAttributes::default().with_position(Vec2(place.window.x0, place.window.y0));
    attributes.horizontal_density = metadata.pixels_per_inch.map(|density| density as f32);
    attributes.software_name = metadata.software.as_deref().map(text);
    let mut add = |name: &str, value: AttributeValue| _ = attributes.other.insert(text(name), value);
    if let Some(samples) = metadata.samples {
        add("samples", AttributeValue::I32(i32::try_from(samples).unwrap_or(i32::MAX)));
    }
    let mut add_text = |name: &str, value: Option<String>| {
        if let Some(value) = value {
            add(name, AttributeValue::Text(text(&value)));
        }
    };
    add_text(
        "sampleRange",
        metadata.sample_range.as_ref().map(|range| format!("{}:{}", range.start, range.end)),
    );
    add_text("seed", metadata.seed.map(|seed| seed.to_string()));
    add_text("engine", metadata.engine.clone());
    add_text("options", metadata.options.clone());
    add_text("inputHash", metadata.input_hash.clone());
    add_text("camera", metadata.camera.clone());
    let numbers = |origin: DVec3| format!("{} {} {}", origin.x, origin.y, origin.z);
    add_text("positionOrigin", place.position_origin.map(numbers));
    if let Some(Ending { background, display_space }) = place.ending {
        let numbers = background.map(|color| color.map(|value| value.to_string()).join(" "));
        add_text("sumsBackground", Some(numbers.unwrap_or_else(|| "none".to_owned())));
        add_text("sumsSpace", Some(if display_space { "sRGB" } else { "linear" }.to_owned()));
    }
    if let Some(matrix) = metadata.world_to_camera {
        if matrix.as_mat4().as_dmat4() != matrix {
            add_text("worldToCameraText", Some(Metadata::matrix_text(&matrix)));
        }
        attributes.world_to_camera = Some(row_vector_matrix(&matrix));
    }
    attributes
}

/// The matrix for row vectors, its rows listed: what OpenEXR stores. That is the other's columns listed.
fn row_vector_matrix(matrix: &DMat4) -> [f32; 16] {
    matrix.as_mat4().to_cols_array()
}

/// A text of the file; UTF-8, as is the custom.
fn text(text: &str) -> Text {
    Text::from_slice_unchecked(text.as_bytes())
}

/// The name of what is no AOV.
const COLOR: &str = "color";

/// The layer of the sums.
const SUMS: &str = "sums";

/// The channels of a film, in the order of the file: by name.
struct Channels<'a>(Vec<Channel<'a>>);

struct Channel<'a> {
    name: Cow<'a, str>,
    kind: SampleType,
    values: Values<'a>,
}

/// Where a channel's values are, row by row.
enum Values<'a> {
    Color(&'a [[f32; 4]], usize),
    Vector(&'a [Vec3], usize),
    Scalar(&'a [f32]),
    Half(&'a [f16]),
    Id(&'a [u32]),
    /// The upper half of the bits.
    High(&'a [f64]),
    /// The lower half of the bits.
    Low(&'a [f64]),
}

impl<'a> Channels<'a> {
    fn new(film: &'a Film, full_floats: bool) -> Result<Self, splat_core::Error> {
        check_colors(film)?;
        let float = if full_floats { SampleType::F32 } else { SampleType::F16 };
        let mut channels = Vec::new();
        for (component, name) in ["R", "G", "B", "A"].into_iter().enumerate() {
            channels.push(Channel::new(name, float, Values::Color(&film.rgba, component)));
        }
        let vectors = [
            (&film.normal, float, ["N.X", "N.Y", "N.Z"]),
            (&film.albedo, float, ["albedo.R", "albedo.G", "albedo.B"]),
            (&film.position, SampleType::F32, ["P.X", "P.Y", "P.Z"]),
            (&film.variance, SampleType::F32, ["variance.R", "variance.G", "variance.B"]),
        ];
        for (vectors, kind, names) in vectors {
            let Some(vectors) = vectors else { continue };
            check_length(names[0], vectors.len(), film)?;
            for (component, name) in names.into_iter().enumerate() {
                channels.push(Channel::new(name, kind, Values::Vector(vectors, component)));
            }
        }
        let scalars = [
            (&film.depth, SampleType::F32, "Z"),
            (&film.coverage, float, "coverage"),
            (&film.layers, SampleType::F32, "layers"),
            (&film.samples, SampleType::F32, "samples"),
        ];
        for (scalars, kind, name) in scalars {
            let Some(scalars) = scalars else { continue };
            check_length(name, scalars.len(), film)?;
            channels.push(Channel::new(name, kind, Values::Scalar(scalars)));
        }
        if let Some(ids) = &film.id {
            check_length("id", ids.len(), film)?;
            channels.push(Channel::new("id", SampleType::U32, Values::Id(ids)));
        }
        if let Some(sums) = &film.sums {
            for (name, plane) in SampleSums::names(sums.aovs).zip(&sums.planes) {
                check_length("sums", plane.len(), film)?;
                let [high, low] = sum_names(name);
                channels.push(Channel::new(high, SampleType::U32, Values::High(plane)));
                channels.push(Channel::new(low, SampleType::U32, Values::Low(plane)));
            }
        }
        channels.sort_unstable_by(|a, b| a.name.cmp(&b.name));
        Ok(Self(channels))
    }

    /// The channels of each AOV, by its name.
    fn by_aov(self) -> BTreeMap<String, Self> {
        let mut aovs: BTreeMap<_, Self> = BTreeMap::new();
        for channel in self.0 {
            aovs.entry(channel.aov().to_owned()).or_insert_with(|| Self(Vec::new())).0.push(channel);
        }
        aovs
    }
}

/// The names of the channels of a sum.
fn sum_names(name: &str) -> [String; 2] {
    ["high", "low"].map(|half| format!("{SUMS}.{name}.{half}"))
}

impl<'a> Channel<'a> {
    fn new(name: impl Into<Cow<'a, str>>, kind: SampleType, values: Values<'a>) -> Self {
        Self { name: name.into(), kind, values }
    }

    /// The AOV that it belongs to, as `--aov` names it.
    fn aov(&self) -> &str {
        match self.name.split_once('.').map_or(&*self.name, |(layer, _)| layer) {
            "R" | "G" | "B" | "A" => COLOR,
            "N" => "normal",
            "P" => "position",
            "Z" => "depth",
            layer => layer,
        }
    }

    /// Writes the values from `start` on, in the machine's byte order, until `bytes` is full.
    fn write(&self, start: usize, bytes: &mut [u8]) {
        match &self.values {
            Values::Id(ids) => fill(bytes, ids[start..].iter().map(|id| id.to_ne_bytes())),
            Values::Color(colors, component) => {
                self.write_floats(bytes, colors[start..].iter().map(|color| color[*component]));
            }
            Values::Vector(vectors, component) => {
                self.write_floats(bytes, vectors[start..].iter().map(|vector| vector[*component]));
            }
            Values::Scalar(scalars) => self.write_floats(bytes, scalars[start..].iter().copied()),
            Values::Half(halves) => fill(bytes, halves[start..].iter().map(|half| half.to_ne_bytes())),
            Values::High(plane) => {
                fill(bytes, plane[start..].iter().map(|&value| halves(value)[0].to_ne_bytes()));
            }
            Values::Low(plane) => {
                fill(bytes, plane[start..].iter().map(|&value| halves(value)[1].to_ne_bytes()));
            }
        }
    }

    fn write_floats(&self, bytes: &mut [u8], values: impl Iterator<Item = f32>) {
        match self.kind {
            SampleType::F16 => fill(bytes, values.map(|value| saturated(value).to_ne_bytes())),
            SampleType::F32 | SampleType::U32 => fill(bytes, values.map(f32::to_ne_bytes)),
        }
    }
}

/// The upper and the lower half of a number's bits.
fn halves(value: f64) -> [u32; 2] {
    let bits = value.to_bits();
    [(bits >> 32) as u32, bits as u32]
}

/// The nearest 16-bit float, the greatest one for all beyond it.
fn saturated(value: f32) -> f16 {
    f16::from_f32(value.clamp(f16::MIN.to_f32(), f16::MAX.to_f32()))
}

fn fill<const N: usize>(bytes: &mut [u8], values: impl Iterator<Item = [u8; N]>) {
    for (bytes, value) in bytes.chunks_exact_mut(N).zip(values) {
        bytes.copy_from_slice(&value);
    }
}

impl<'a> WritableChannels<'a> for Channels<'a> {
    type Writer = &'a Self;

    fn infer_channel_list(&self) -> ChannelList {
        let description = |channel: &Channel| ChannelDescription::new(&*channel.name, channel.kind, false);
        ChannelList::new(self.0.iter().map(description).collect::<SmallVec<_>>())
    }

    fn infer_level_modes(&self) -> (LevelMode, RoundingMode) {
        (LevelMode::Singular, RoundingMode::Down)
    }

    fn create_writer(&'a self, _: &Header) -> Self::Writer {
        self
    }
}

impl<'a> ChannelsWriter for &'a Channels<'a> {
    fn extract_uncompressed_block(&self, header: &Header, block: BlockIndex) -> Vec<u8> {
        UncompressedBlock::collect_block_data_from_lines(&header.channels, block, |line| {
            let Vec2(x, y) = line.location.position;
            self.0[line.location.channel].write(y * header.layer_size.width() + x, line.value);
        })
    }
}

/// Sorts the attributes of the (only) header by name.
///
/// The crate `exr` writes them in the order of a hash map, which differs from run to run.
fn sort_attributes(file: &mut (impl Read + Write + Seek)) -> io::Result<()> {
    const START: u64 = 8;
    file.seek(SeekFrom::Start(START))?;
    let mut reader = BufReader::new(&mut *file);
    let mut attributes = Vec::new();
    loop {
        let mut attribute = Vec::new();
        reader.read_until(0, &mut attribute)?;
        if attribute.len() <= 1 {
            break;
        }
        reader.read_until(0, &mut attribute)?;
        let mut size = [0; 4];
        reader.read_exact(&mut size)?;
        attribute.extend_from_slice(&size);
        reader.by_ref().take(u32::from_le_bytes(size).into()).read_to_end(&mut attribute)?;
        attributes.push(attribute);
    }
    attributes.sort_unstable();
    file.seek(SeekFrom::Start(START))?;
    file.write_all(&attributes.concat())
}

#[cfg(test)]
mod tests;
