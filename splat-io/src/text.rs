//! Clouds as text: a point a line (XYZ, TXT, ASC, CSV, PTS).
//!
//! Numbers stand between blanks, tabs, commas or semicolons, with decimal points. What a column means is told by names, in
//! a first line or in a comment before the points (`//X Y Z R G B`), as the properties of PLY files are; else by
//! the values; or by the caller. Empty lines are passed over, and so are comments (`#`, `//`). A PTS
//! file begins with the number of its points, which is checked.
//!
//! Colours are sRGB, 0 to 255, or 0 to 1 or 0 to 65535 if that is what the greatest value of the file says. Columns without
//! a meaning become scalar fields.

mod layout;
#[cfg(test)]
mod tests;
mod writer;

pub use writer::write_text;

use crate::error::quoted;
use crate::table::{Columns, Element, Hints, Kind, Outcome, Property, Row, SLOTS, Scalar, Tone};
use crate::whole_file::{read_whole, sha256};
use crate::{ElementReport, Error, Import, ImportReport, Loss, Place, PropertyReport, Usage};
use glam::Vec3;
use layout::{Layout, is_comment};
use std::path::Path;

/// The name of a column that is passed over.
pub const SKIPPED: &str = "-";

/// Reads a cloud from a text file. See the [module](self) for what is understood.
///
/// `columns` says what the columns mean, instead of the file: `x`, `y`, `z`, `r`, `g`, `b`, `nx`, `ny`, `nz`,
/// `radius`, any other name for a scalar field, or [`SKIPPED`].
///
/// # Errors
/// [`Error::Io`]; [`Error::Unsupported`] for what is no text; [`Error::Invalid`], with the line, for a word that is no
/// number, a row of another length than the first one, columns without x, y or z, and fewer points than the file
/// claims; [`Error::Limit`] for more points than memory.
pub fn read_text(path: &Path, columns: Option<&[String]>) -> Result<Import, Error> {
    read_text_from(&read_whole(path, check_text)?, path, columns)
}

/// Reads a cloud from the bytes of a text file; `path` is its name in messages.
///
/// # Errors
/// As [`read_text`].
pub fn read_text_from(bytes: &[u8], path: &Path, columns: Option<&[String]>) -> Result<Import, Error> {
    check_text(bytes, path)?;
    let mut layout = Layout::find(bytes, path, columns)?;
    let mut element = element(&layout, path)?;
    let mut columns = Columns::new(&element, path)?;
    let mut of_properties = columns.roles.slots.clone().into_iter();
    let slot = |name: &String| if name == SKIPPED { None } else { of_properties.next().flatten() };
    let slots: Vec<Option<usize>> = layout.names.iter().map(slot).collect();
    element.count = read_rows(&mut layout, &slots, &mut columns, path)?;
    let Layout { names, separator, claimed, mut assumptions, .. } = layout;
    let more = check_claim(claimed, element.count, path, &mut assumptions)?;

    let mut outcome = columns.finish(Hints::default());
    let tone = outcome.cloud.colors.as_deref_mut().map(linearise);
    assumptions.append(&mut outcome.assumptions);
    assumptions.extend(tone);
    // What is said of colours there is not true of these, which are not linear.
    assumptions.extend(outcome.color_assumptions.drain(..).filter(|line| line.contains("opacities")));
    let report = ImportReport {
        path: path.to_owned(),
        format: format!("text, numbers between {}", separator.describe()),
        bytes: bytes.len() as u64,
        sha256: sha256(bytes),
        elements: vec![report(&names, &element, &outcome)],
        assumptions,
        losses: outcome.losses.into_iter().chain(more).collect(),
    };
    Ok(Import { cloud: outcome.cloud, report })
}

/// The table of points: its columns, and at most how many rows it has.
fn element(layout: &Layout<'_>, path: &Path) -> Result<Element, Error> {
    let used = layout.names.iter().filter(|&name| name != SKIPPED);
    let properties =
        used.map(|name| Property { name: name.clone(), kind: Kind::Scalar(Scalar::F64) }).collect();
    // A number and what ends it take two bytes: no claim, but what the file has.
    let rest = layout.rows.rest();
    let lines = rest.iter().filter(|&&byte| byte == b'\n').count() + 1;
    let most = lines.min(rest.len() / (2 * layout.names.len()) + 1) as u64;
    if most >= u64::from(u32::MAX) {
        return Err(Error::limit(
            path,
            format!("a text of {lines} lines"),
            format!("{} points", u32::MAX - 1),
        ));
    }
    Ok(Element { name: "points".to_owned(), count: most, line: layout.names_line, properties })
}

/// Reads the rows and says how many there are. Further counts, as PTS files of several scans have them, are added to the
/// first one.
fn read_rows(
    layout: &mut Layout<'_>,
    slots: &[Option<usize>],
    columns: &mut Columns,
    path: &Path,
) -> Result<u64, Error> {
    let Layout { names, separator, claimed, rows, .. } = layout;
    let mut values: Row = [0.0; SLOTS];
    let mut read = 0;
    for (number, line) in rows {
        if line.is_empty() || is_comment(line) {
            continue;
        }
        if let (Some(claim), Some(more)) = (claimed.as_mut(), layout::count_line(line)) {
            *claim = claim.saturating_add(more);
            continue;
        }
        let place = || Place::Line(number);
        let mut words = separator.split(line);
        for (slot, name) in slots.iter().zip(names.iter()) {
            let Some(word) = words.next() else {
                let expected = format!("{} numbers, as in the first row: {name} is missing", names.len());
                return Err(Error::invalid(path, place(), "the end of the line", expected));
            };
            if let Some(slot) = *slot {
                values[slot] = Scalar::F64.parse(word).map_err(|expected| {
                    let expected = format!("{expected} with a decimal point for {name}");
                    Error::invalid(path, place(), quoted(word), expected)
                })?;
            }
        }
        if let Some(word) = words.next().filter(|word| !word.is_empty()) {
            let expected = format!("the end of a row of {} numbers", names.len());
            return Err(Error::invalid(path, place(), quoted(word), expected));
        }
        columns.push(&values);
        read += 1;
    }
    Ok(read)
}

/// Refuses what is certainly no text.
fn check_text(bytes: &[u8], path: &Path) -> Result<(), Error> {
    if bytes.is_empty() {
        return Err(Error::invalid(path, Place::File, "an empty file", "a cloud"));
    }
    let head = &bytes[..bytes.len().min(4096)];
    if head.contains(&0) {
        let found = format!(
            "a file of a kind that is not known (it begins with {})",
            quoted(&head[..head.len().min(8)])
        );
        let expected = "PLY, LAS, LAZ, PCD, or text with a point a line";
        return Err(Error::unsupported(path, found, expected));
    }
    Ok(())
}

/// Holds the number of points that the file claims against the number that it has.
fn check_claim(
    claimed: Option<u64>,
    read: u64,
    path: &Path,
    assumptions: &mut Vec<String>,
) -> Result<Option<Loss>, Error> {
    match claimed {
        Some(claimed) if read < claimed => {
            let expected = format!("{claimed} points, as the file says");
            Err(Error::invalid(path, Place::File, format!("{read} points"), expected))
        }
        Some(claimed) if read > claimed => {
            assumptions.push(format!("the file says {claimed} points and has {read}: all are kept"));
            Ok(Loss::new("points more than the file says", read - claimed, format!("point {claimed}")))
        }
        _ => Ok(None),
    }
}

/// Makes colours linear, and says how.
fn linearise(colors: &mut [Vec3]) -> String {
    let channels = || colors.iter().flat_map(|color| color.to_array()).filter(|value| value.is_finite());
    let greatest = channels().fold(0.0, f32::max);
    let is_whole = channels().all(|value| value.fract() == 0.0);
    let (range, tone) = match greatest {
        ..=1.0 => (1.0, None),
        ..=255.0 => (255.0, is_whole.then_some(Tone::Srgb8)),
        _ => (65535.0, is_whole.then_some(Tone::Srgb16)),
    };
    let linear = |value: f32| match tone {
        _ if !value.is_finite() => value,
        Some(tone) => tone.linear(f64::from(value)),
        None => splat_core::srgb::decode((f64::from(value) / range).clamp(0.0, 1.0)) as f32,
    };
    for color in colors.iter_mut() {
        *color = color.map(linear);
    }
    format!("the colours, {greatest} at most, are taken as sRGB from 0 to {range} and linearised")
}

/// What is said of the columns, those that are passed over included.
fn report(names: &[String], element: &Element, outcome: &Outcome) -> ElementReport {
    let mut usages = outcome.usages.iter().copied();
    let mut usage = |name: &str| match name {
        SKIPPED => Some(Usage::Unused("not wanted")),
        _ => usages.next(),
    };
    ElementReport {
        name: element.name.clone(),
        count: element.count,
        is_points: true,
        properties: names
            .iter()
            .filter_map(|name| {
                let usage = usage(name)?;
                Some(PropertyReport { name: name.clone(), kind: "text".to_owned(), usage })
            })
            .collect(),
    }
}
