//! One picture from its pieces: windows of the frame, ranges of the samples, or both.
//!
//! Windows are copied: the result is the picture of one run to the bit. Ranges of samples are joined from the sums that such
//! pieces carry ([`Film::add_samples`]). The ranges of each window are joined first, then the windows.

use crate::exr_file::picture::{ExrPicture, Values};
use splat_core::{Film, PixelRect};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A picture to be joined with others.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// Its file, for messages.
    pub path: PathBuf,
    /// What is in it.
    pub picture: ExrPicture,
}

/// Why pieces cannot be joined.
#[derive(Debug, thiserror::Error)]
pub enum MergeError {
    /// There is none.
    #[error("there is no piece to join")]
    Nothing,
    /// A file does not say enough of how it was made.
    #[error(
        "{}: it does not say how it was made (no {missing}): only pictures that this program wrote as .exr can be joined",
        path.display()
    )]
    NotOurs {
        /// The file.
        path: PathBuf,
        /// The attribute that is missing or makes no sense.
        missing: &'static str,
    },
    /// Two pieces are not of the same picture.
    #[error(
        "{} and {} are not pieces of one picture: {what}: found {found}, expected {expected}: render all pieces with \
         one command line, but for --crop, --tile and --samples",
        path.display(), other.display()
    )]
    Different {
        /// The file.
        path: PathBuf,
        /// The first file.
        other: PathBuf,
        /// In what they differ.
        what: &'static str,
        /// What the file has.
        found: String,
        /// What the first one has.
        expected: String,
    },
    /// Two pieces have the same samples of the same pixels.
    #[error("{} and {} both have {what}: leave one of them out", path.display(), other.display())]
    Overlap {
        /// One file.
        path: PathBuf,
        /// The other.
        other: PathBuf,
        /// What both have.
        what: String,
    },
    /// Samples are missing.
    #[error(
        "no piece has the samples {}:{} of the pixels {}: render them with --samples {}:{}{}",
        range.start, range.end, text(window), range.start, range.end,
        if *is_frame { String::new() } else { format!(" --crop {}", text(window)) }
    )]
    MissingSamples {
        /// Which.
        range: Range<u32>,
        /// Of which pixels.
        window: PixelRect,
        /// Whether these are all.
        is_frame: bool,
    },
    /// Pixels are missing.
    #[error(
        "{count} pixels of {} are in no piece, the first at {x},{y}: render the rest, or say with --crop what the \
         whole is (the pieces lie within {})",
        text(whole),
        text(bounds)
    )]
    MissingPixels {
        /// How many.
        count: usize,
        /// The first, row by row.
        x: i32,
        /// The same.
        y: i32,
        /// What was to be covered.
        whole: PixelRect,
        /// The smallest window around all pieces.
        bounds: PixelRect,
    },
    /// A piece reaches beyond the whole.
    #[error("{}: its pixels {} reach beyond the whole, {}: leave it out", path.display(), text(window), text(whole))]
    Outside {
        /// The file.
        path: PathBuf,
        /// Its pixels.
        window: PixelRect,
        /// The whole.
        whole: PixelRect,
    },
    /// A piece of a range of samples has no sums.
    #[error(
        "{}: it holds means of the samples {}:{} only, no sums, from which the whole could be made: render it again as \
         .exr, without --aov-files",
        path.display(), range.start, range.end
    )]
    NoSums {
        /// The file.
        path: PathBuf,
        /// Its samples.
        range: Range<u32>,
    },
    /// The renderer's own checks.
    #[error("{}: {cause}", path.display())]
    Core {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        cause: splat_core::Error,
    },
    /// The whole is too large.
    #[error("a picture of {0} pixels is beyond this machine's memory")]
    Memory(usize),
}

/// A window as `--crop` has it.
fn text(window: &PixelRect) -> String {
    let PixelRect { x0, y0, x1, y1 } = window;
    format!("{x0},{y0},{x1},{y1}")
}

/// Joins pieces to the picture of `crop`, or else of the whole frame, with all samples.
///
/// Its metadata are those of one run. Which threads, levels and machines rendered the pieces is of no concern.
///
/// # Errors
/// See [`MergeError`].
pub fn merge(pieces: Vec<Piece>, crop: Option<PixelRect>) -> Result<ExrPicture, MergeError> {
    let first = pieces.first().ok_or(MergeError::Nothing)?;
    for piece in &pieces {
        check(piece)?;
        compare(piece, first)?;
    }
    let whole = crop.unwrap_or(first.picture.frame);
    if let Some(Piece { path, picture }) =
        pieces.iter().find(|piece| piece.picture.window.intersect(&whole) != piece.picture.window)
    {
        return Err(MergeError::Outside { path: path.clone(), window: picture.window, whole });
    }
    let mut by_window: BTreeMap<_, Vec<Piece>> = BTreeMap::new();
    for piece in pieces {
        let PixelRect { x0, y0, x1, y1 } = piece.picture.window;
        by_window.entry([y0, x0, y1, x1]).or_default().push(piece);
    }
    let tiles = by_window.into_values().map(join_samples).collect::<Result<Vec<_>, _>>()?;
    join_windows(tiles, whole)
}

/// The samples of a piece.
fn samples(picture: &ExrPicture) -> Range<u32> {
    let all = 0..picture.metadata.samples.unwrap_or(0);
    picture.metadata.sample_range.clone().unwrap_or(all)
}

/// Checks that a piece says what it is of.
fn check(Piece { path, picture }: &Piece) -> Result<(), MergeError> {
    let metadata = &picture.metadata;
    let all = 0..metadata.samples.unwrap_or(0);
    let range = samples(picture);
    let PixelRect { x0, y0, x1, y1 } = picture.frame;
    let is_frame = x0 == 0 && y0 == 0 && x1 > 0 && y1 > 0;
    let is_window = !picture.window.is_empty() && picture.window.intersect(&picture.frame) == picture.window;
    let said = [
        (metadata.software.is_some(), "software"),
        (metadata.options.is_some(), "options"),
        (metadata.input_hash.is_some(), "inputHash"),
        (metadata.camera.is_some(), "camera"),
        (metadata.seed.is_some(), "seed"),
        (!all.is_empty(), "samples"),
        (!range.is_empty() && range.end <= all.end, "sampleRange"),
        (is_frame, "displayWindow"),
        (is_window, "dataWindow"),
    ];
    match said.into_iter().find(|(is_said, _)| !is_said) {
        None => Ok(()),
        Some((_, missing)) => Err(MergeError::NotOurs { path: path.clone(), missing }),
    }
}

/// Checks that a piece is of the same picture as the first.
fn compare(piece: &Piece, first: &Piece) -> Result<(), MergeError> {
    let of = |picture: &ExrPicture| {
        let metadata = &picture.metadata;
        let shown = |value: &Option<String>| value.clone().unwrap_or_default();
        let channels = picture.channels.iter().filter(|(name, _)| !ExrPicture::is_sum(name));
        let channels = channels.map(|(name, values)| format!("{name} ({})", values.kind()));
        [
            ("the inputs (inputHash)", shown(&metadata.input_hash)),
            ("the options", shown(&metadata.options)),
            ("the frame", text(&picture.frame)),
            ("the camera", shown(&metadata.camera)),
            ("--spp", format!("{:?}", metadata.samples)),
            ("--seed", format!("{:?}", metadata.seed)),
            ("--dpi", format!("{:?}", metadata.pixels_per_inch)),
            ("the engine", shown(&metadata.engine)),
            ("the program's version", shown(&metadata.software)),
            ("the channels", channels.collect::<Vec<_>>().join(", ")),
            ("the origin of positions", format!("{:?}", picture.position_origin)),
        ]
    };
    for ((what, found), (_, expected)) in of(&piece.picture).into_iter().zip(of(&first.picture)) {
        if found != expected {
            let (path, other) = (piece.path.clone(), first.path.clone());
            return Err(MergeError::Different { path, other, what, found, expected });
        }
    }
    Ok(())
}

/// Joins pieces of one window.
fn join_samples(mut pieces: Vec<Piece>) -> Result<Piece, MergeError> {
    pieces.sort_by_key(|piece| (samples(&piece.picture).start, samples(&piece.picture).end));
    let mut end = 0;
    let missing = |range, picture: &ExrPicture| {
        let window = picture.window;
        Err(MergeError::MissingSamples { range, window, is_frame: window == picture.frame })
    };
    for (index, Piece { path, picture }) in pieces.iter().enumerate() {
        let range = samples(picture);
        if range.start < end {
            // The first piece starts at 0 or later.
            let other = pieces[index.saturating_sub(1)].path.clone();
            let what = format!("samples from {} on of the pixels {}", range.start, text(&picture.window));
            return Err(MergeError::Overlap { path: path.clone(), other, what });
        }
        if range.start > end {
            return missing(end..range.start, picture);
        }
        end = range.end;
    }
    let mut pieces = pieces.into_iter();
    let Some(Piece { path, mut picture }) = pieces.next() else { return Err(MergeError::Nothing) };
    let all = picture.metadata.samples.unwrap_or(0);
    if end < all {
        return missing(end..all, &picture);
    }
    if samples(&picture) != (0..all) {
        let core = |path: &Path| {
            let path = path.to_owned();
            move |cause| MergeError::Core { path, cause }
        };
        let mut film = film_of_sums(&path, &picture)?;
        for piece in pieces {
            let later = film_of_sums(&piece.path, &piece.picture)?;
            film.add_samples(&later).map_err(core(&piece.path))?;
        }
        film.sums = None;
        let full_floats = matches!(picture.channel("R"), Some(Values::Float(_)));
        picture.set_film(&film, full_floats).map_err(core(&path))?;
    }
    picture.metadata.sample_range = None;
    Ok(Piece { path, picture })
}

fn film_of_sums(path: &Path, picture: &ExrPicture) -> Result<Film, MergeError> {
    picture
        .film_of_sums()
        .ok_or_else(|| MergeError::NoSums { path: path.to_owned(), range: samples(picture) })
}

/// Joins pieces of different windows, each with all samples.
fn join_windows(tiles: Vec<Piece>, whole: PixelRect) -> Result<ExrPicture, MergeError> {
    for (index, tile) in tiles.iter().enumerate() {
        for other in &tiles[..index] {
            let common = tile.picture.window.intersect(&other.picture.window);
            if !common.is_empty() {
                let what = format!("the pixels {}", text(&common));
                return Err(MergeError::Overlap { path: tile.path.clone(), other: other.path.clone(), what });
            }
        }
    }
    check_coverage(&tiles, whole)?;
    let Some(first) = tiles.first() else { return Err(MergeError::Nothing) };
    let out_of_memory = |_| MergeError::Memory(whole.area());
    let mut picture = ExrPicture { window: whole, ..first.picture.without_channels() };
    for (index, (name, values)) in first.picture.channels.iter().enumerate() {
        let mut joined = values.zeros(whole.area()).map_err(out_of_memory)?;
        for tile in &tiles {
            joined.paste(&tile.picture.channels[index].1, whole, tile.picture.window);
        }
        picture.channels.push((name.clone(), joined));
    }
    Ok(picture)
}

/// Checks that every pixel is in one of the tiles, which are disjoint and within the whole.
fn check_coverage(tiles: &[Piece], whole: PixelRect) -> Result<(), MergeError> {
    let windows = || tiles.iter().map(|tile| tile.picture.window);
    let area: usize = windows().map(|window| window.area()).sum();
    if area == whole.area() {
        return Ok(());
    }
    let around = |a: PixelRect, b: PixelRect| {
        PixelRect::new(a.x0.min(b.x0), a.y0.min(b.y0), a.x1.max(b.x1), a.y1.max(b.y1))
    };
    // The first missing pixel is at a left edge of the whole, or right of a tile; and likewise at an upper one.
    let rows: BTreeSet<i32> = std::iter::once(whole.y0).chain(windows().map(|window| window.y1)).collect();
    let columns: BTreeSet<i32> = std::iter::once(whole.x0).chain(windows().map(|window| window.x1)).collect();
    let mut places = rows.iter().flat_map(|&y| columns.iter().map(move |&x| (x, y)));
    let is_missing = |&(x, y): &(i32, i32)| {
        let has =
            |window: PixelRect| (window.x0..window.x1).contains(&x) && (window.y0..window.y1).contains(&y);
        has(whole) && !windows().any(has)
    };
    let (x, y) = places.find(is_missing).unwrap_or((whole.x0, whole.y0));
    let bounds = windows().reduce(around).unwrap_or(whole);
    Err(MergeError::MissingPixels { count: whole.area() - area, x, y, whole, bounds })
}
