//! `cameras.txt` and `images.txt`.

use super::{Lenses, Posed, lens};
use crate::Error;
use crate::lines::Lines;
use crate::source::Source;
use std::fs::File;
use std::path::Path;

fn lines(path: &Path) -> Result<Lines<File>, Error> {
    let (file, size) = crate::ply::open(path)?;
    Ok(Lines::new(Source::new(file, size, path)))
}

/// Rows of `CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]`.
pub(super) fn read_cameras(path: &Path) -> Result<Lenses, Error> {
    let mut lines = lines(path)?;
    let mut lenses = Lenses::new();
    while lines.next_row()? {
        let mut words = lines.text()?.split_ascii_whitespace();
        let [number, model, width, height] = std::array::from_fn(|_| words.next().unwrap_or_default());
        let parameters: Option<Vec<f64>> = words.map(|word| word.parse().ok()).collect();
        let invalid = || lines.invalid("CAMERA_ID MODEL WIDTH HEIGHT and the model's parameters");
        let (Ok(number), Ok(width), Ok(height), Some(parameters)) =
            (number.parse(), width.parse(), height.parse(), parameters)
        else {
            return Err(invalid());
        };
        let lens = lens(model, [width, height], &parameters, path)?.ok_or_else(invalid)?;
        if lenses.insert(number, lens).is_some() {
            return Err(lines.invalid("a number that no camera has yet"));
        }
    }
    Ok(lenses)
}

/// Pairs of rows: `IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME`, and the points seen, which may be none.
pub(super) fn read_images(path: &Path) -> Result<Vec<Posed>, Error> {
    let mut lines = lines(path)?;
    let mut images = Vec::new();
    while lines.next_row()? {
        images.push(
            image(lines.text()?)
                .ok_or_else(|| lines.invalid("IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME"))?,
        );
        // Without this check an image would be lost for each whose empty line someone has taken out.
        if lines.next()? && lines.text()?.split_ascii_whitespace().last().is_some_and(is_no_number) {
            return Err(lines.invalid("the points of the image above: X Y POINT3D_ID .., or an empty line"));
        }
    }
    Ok(images)
}

fn is_no_number(word: &str) -> bool {
    word.parse::<f64>().is_err()
}

/// The image of a row.
fn image(row: &str) -> Option<Posed> {
    let mut rest = row;
    let mut word = || {
        let (word, after) = rest.split_once(|c: char| c.is_ascii_whitespace())?;
        rest = after.trim_ascii_start();
        Some(word)
    };
    word()?.parse::<u64>().ok()?;
    let mut pose = [0.0; 7];
    for value in &mut pose {
        *value = word()?.parse().ok()?;
    }
    let camera = word()?.parse().ok()?;
    let [w, x, y, z, translation @ ..] = pose;
    (!rest.is_empty()).then(|| Posed { name: rest.to_owned(), camera, rotation: [w, x, y, z], translation })
}
