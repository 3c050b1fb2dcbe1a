//! The syntax of options that are no plain word: what each text means, and what is said about a wrong one.

use glam::DVec3;
use splat_core::prepare::Outliers;
use splat_core::{AovSelection, PixelRect};
use splat_io::mesh::MOST_SURFELS;
use std::fmt::{self, Display};
use std::ops::{Range, RangeInclusive};
use std::str::FromStr;
use std::time::Duration;

/// Exactly N values with `separator` between them, spaces around each allowed.
fn split<T: FromStr, const N: usize>(text: &str, separator: char) -> Option<[T; N]> {
    let values: Option<Vec<T>> = text.split(separator).map(|part| part.trim().parse().ok()).collect();
    values?.try_into().ok()
}

/// A number in a range, said to be `expected`.
fn number(text: &str, expected: impl Display, accepted: impl Fn(f64) -> bool) -> Result<f64, String> {
    let value = text.trim().parse().ok().filter(|&value| accepted(value));
    value.ok_or_else(|| format!("expected {expected}"))
}

/// A finite number greater than 0.
pub fn positive(text: &str) -> Result<f64, String> {
    number(text, "a finite number greater than 0", |value| value.is_finite() && value > 0.0)
}

/// A time in seconds; 0 is allowed.
pub fn seconds(text: &str) -> Result<Duration, String> {
    const MOST: f64 = 1e9;
    number(text, "a number of seconds, 0 or more", |value| (0.0..=MOST).contains(&value))
        .map(Duration::from_secs_f64)
}

/// A size of memory: bytes, or with K, M, G or T those times powers of 1024.
pub fn memory(text: &str) -> Result<u64, String> {
    let text = text.trim();
    let (number, shift) = match text.char_indices().last() {
        Some((end, unit)) if unit.is_ascii_alphabetic() => {
            let shift = "KMGT".find(unit.to_ascii_uppercase()).map(|power| 10 * (power + 1));
            (&text[..end], shift)
        }
        _ => (text, Some(0)),
    };
    let value: Option<f64> = number.trim().parse().ok().filter(|value| (0.0..=1e15).contains(value));
    let bytes = value.zip(shift).map(|(value, shift)| (value * (1u64 << shift) as f64) as u64);
    bytes.filter(|&bytes| bytes > 0).ok_or_else(|| "expected a size as 512M or 2G".to_owned())
}

/// A share of the whole.
pub fn share(text: &str) -> Result<f64, String> {
    number(text, "a number from 0 to 1", |value| (0.0..=1.0).contains(&value))
}

/// `--columns`: what the columns of a text are, in their order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Columns(pub Vec<String>);

/// A number that differences are held against: 0 or more, not necessarily finite.
pub fn tolerance(text: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|value: &f64| *value >= 0.0);
    value.ok_or_else(|| "expected a number, 0 or more".to_owned())
}

/// `--columns`.
pub fn columns(text: &str) -> Result<Columns, String> {
    let names: Vec<String> = text.split(',').map(|name| name.trim().to_owned()).collect();
    let is_there = |place: &str| names.iter().any(|name| name.eq_ignore_ascii_case(place));
    if ["x", "y", "z"].into_iter().all(is_there) && names.iter().all(|name| !name.is_empty()) {
        Ok(Columns(names))
    } else {
        Err("expected names between commas, x, y and z among them".to_owned())
    }
}

/// `--classes`: classes of LAS points.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Classes {
    listed: Vec<u8>,
    /// Whether all others are wanted.
    is_except: bool,
}

impl Display for Classes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let listed: Vec<String> = self.listed.iter().map(ToString::to_string).collect();
        write!(f, "{}{}", if self.is_except { "!" } else { "" }, listed.join(","))
    }
}

impl Classes {
    /// Whether points of a class are wanted.
    pub fn has(&self, class: f32) -> bool {
        self.listed.iter().any(|&listed| f32::from(listed) == class) != self.is_except
    }
}

/// `--classes`.
pub fn classes(text: &str) -> Result<Classes, String> {
    let (is_except, list) = text.strip_prefix('!').map_or((false, text), |list| (true, list));
    let listed: Option<Vec<u8>> = list.split(',').map(|class| class.trim().parse().ok()).collect();
    let listed =
        listed.ok_or("expected numbers from 0 to 255 between commas, ! before them for all others")?;
    Ok(Classes { listed, is_except })
}

/// `--color`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ColorChoice {
    /// The cloud's colours.
    Rgb,
    /// The coordinate along the up axis.
    Height,
    /// The direction of the surface.
    Normal,
    /// The class of LAS points.
    Class,
    /// A scalar field, by its name: the intensity among them.
    Field(String),
}

/// `--color`.
pub fn color(text: &str) -> Result<ColorChoice, String> {
    Ok(match text {
        "" => return Err("expected rgb, intensity, height, normal, class, or the name of a field".to_owned()),
        "rgb" => ColorChoice::Rgb,
        "height" => ColorChoice::Height,
        "normal" => ColorChoice::Normal,
        "class" => ColorChoice::Class,
        field => ColorChoice::Field(field.to_owned()),
    })
}

/// `--color-range`: two finite numbers, the first one less.
pub fn color_range(text: &str) -> Result<[f64; 2], String> {
    let ends = split(text, ':').filter(|ends: &[f64; 2]| ends.iter().all(|end| end.is_finite()));
    ends.filter(|[low, high]| low < high)
        .ok_or_else(|| "expected LO:HI, finite numbers with LO < HI".to_owned())
}

/// A number of neighbours, at least `LEAST`, at most 256.
pub fn count<const LEAST: usize>(text: &str) -> Result<usize, String> {
    let number = text.trim().parse().ok().filter(|number| (LEAST..=256).contains(number));
    number.ok_or_else(|| format!("{text:?} is not a whole number from {LEAST} to 256"))
}

/// `--viewpoint`.
pub fn point(text: &str) -> Result<DVec3, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|word| word.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x, y, z]) if DVec3::new(x, y, z).is_finite() => Ok(DVec3::new(x, y, z)),
        _ => Err(format!("{text:?} is not X,Y,Z, three finite numbers")),
    }
}

/// `--outliers`.
pub fn outliers(text: &str) -> Result<Outliers, String> {
    let (name, numbers) = text.split_once(':').map_or((text, None), |(name, numbers)| (name, Some(numbers)));
    let pair =
        numbers.map(|numbers| numbers.split_once(',').ok_or(format!("{numbers:?} is not two numbers")));
    match (name, pair.transpose()?) {
        ("none", None) => Ok(Outliers::Keep),
        ("statistical", None) => Ok(Outliers::Statistical { neighbors: 8, sigmas: 3.0 }),
        ("statistical", Some((k, sigmas))) => {
            Ok(Outliers::Statistical { neighbors: count::<1>(k)?, sigmas: positive(sigmas)? })
        }
        ("radius", Some((radius, n))) => {
            Ok(Outliers::Radius { radius: positive(radius)?, count: count::<1>(n)? })
        }
        _ => Err("expected none, statistical, statistical:K,SIGMAS or radius:R,N".to_owned()),
    }
}

/// `--focus`: a depth greater than 0, or `inf`.
pub fn focus(text: &str) -> Result<f64, String> {
    number(text, "a number greater than 0, or inf", |value| value > 0.0)
}

/// `--cutoff`.
pub fn cutoff(text: &str) -> Result<f64, String> {
    number(text, "a number greater than 0, at most 64", |value| value > 0.0 && value <= 64.0)
}

/// `--texture-repeat`: two numbers.
pub fn repeat(text: &str) -> Result<[f64; 2], String> {
    let pair = split(text, ',').filter(|pair: &[f64; 2]| pair.iter().all(|value| value.is_finite()));
    pair.ok_or_else(|| "expected S,T, two finite numbers".to_owned())
}

/// `--max-anisotropy`.
pub fn anisotropy(text: &str) -> Result<f64, String> {
    number(text, "a number from 1 to 256", |value| (1.0..=256.0).contains(&value))
}

/// `--size`: width and height, in pixels.
pub fn size(text: &str) -> Result<[u32; 2], String> {
    const SIDES: RangeInclusive<u32> = 1..=splat_core::camera::MAX_SIDE;
    let sides = split(text, 'x').filter(|sides: &[u32; 2]| sides.iter().all(|side| SIDES.contains(side)));
    sides.ok_or_else(|| "expected WIDTHxHEIGHT, each 1 to 65536 pixels".to_owned())
}

/// `--samples`: a half-open range.
pub fn samples(text: &str) -> Result<Range<u32>, String> {
    let range = split(text, ':').filter(|[start, end]: &[u32; 2]| start < end);
    range.map(|[start, end]| start..end).ok_or_else(|| "expected A:B with 0 <= A < B".to_owned())
}

/// `--crop`: a half-open rectangle.
pub fn crop(text: &str) -> Result<PixelRect, String> {
    let corners =
        split(text, ',').filter(|[x0, y0, x1, y1]: &[i32; 4]| 0 <= *x0 && x0 < x1 && 0 <= *y0 && y0 < y1);
    let rect = corners.map(|[x0, y0, x1, y1]| PixelRect::new(x0, y0, x1, y1));
    rect.ok_or_else(|| "expected x0,y0,x1,y1 with 0 <= x0 < x1 and 0 <= y0 < y1".to_owned())
}

/// `--tile`: one of a grid of tiles that make up the frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tile {
    /// Its number, row by row.
    index: u32,
    columns: u32,
    rows: u32,
}

impl Tile {
    /// The tile's pixels. Edges are rounded down, so that tiles join without gap or overlap.
    pub fn of_frame(self, width: u32, height: u32) -> PixelRect {
        let edge = |number: u32, count: u32, side: u32| {
            (u64::from(number) * u64::from(side) / u64::from(count)) as i32
        };
        let (column, row) = (self.index % self.columns, self.index / self.columns);
        PixelRect::new(
            edge(column, self.columns, width),
            edge(row, self.rows, height),
            edge(column + 1, self.columns, width),
            edge(row + 1, self.rows, height),
        )
    }
}

/// `--tile`.
pub fn tile(text: &str) -> Result<Tile, String> {
    let parse = || {
        let (index, grid) = text.split_once('/')?;
        let [columns, rows]: [u32; 2] = split(grid, 'x')?;
        let index = index.trim().parse().ok()?;
        (index < columns.checked_mul(rows)?).then_some(Tile { index, columns, rows })
    };
    parse().ok_or_else(|| "expected I/NxM: tile I, from 0, of N columns by M rows".to_owned())
}

/// `--view`: from where the cloud is seen, in degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewDirection {
    /// Around the up axis: 0 in front, 90 at the right.
    pub azimuth: f64,
    /// Above the horizon.
    pub elevation: f64,
}

/// `--ortho`: one of the six faces of the cloud's box.
pub fn face(text: &str) -> Result<ViewDirection, String> {
    let [azimuth, elevation] = match text {
        "front" => [0.0, 0.0],
        "right" => [90.0, 0.0],
        "back" => [180.0, 0.0],
        "left" => [270.0, 0.0],
        "top" => [0.0, 90.0],
        "bottom" => [0.0, -90.0],
        _ => return Err("expected front, back, left, right, top or bottom".to_owned()),
    };
    Ok(ViewDirection { azimuth, elevation })
}

/// `--view`.
pub fn view(text: &str) -> Result<ViewDirection, String> {
    if let Ok(face) = face(text) {
        return Ok(face);
    }
    let angles = split(text, ',')
        .filter(|[azimuth, elevation]: &[f64; 2]| azimuth.is_finite() && (-90.0..=90.0).contains(elevation));
    angles.map(|[azimuth, elevation]| ViewDirection { azimuth, elevation }).ok_or_else(|| {
        "expected front, back, left, right, top, bottom, or AZ,EL in degrees (EL from -90 to 90)".to_owned()
    })
}

/// `--blades`.
pub fn blades(text: &str) -> Result<u32, String> {
    let blades = text.parse().ok().filter(|blades| matches!(blades, 0 | 3..=64));
    blades.ok_or_else(|| "expected 0 (round) or 3 to 64".to_owned())
}

/// `--points`.
pub fn points(text: &str) -> Result<usize, String> {
    let points = text.parse().ok().filter(|points| (1..=MOST_SURFELS).contains(points));
    points.ok_or_else(|| format!("expected a whole number, 1 to {MOST_SURFELS}"))
}

/// `--thickness`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ThicknessValue {
    /// The half thickness of a fragment, in sigma.
    Factor(f64),
    /// The depth interval of the whole splat, as in the listing.
    Listing,
}

/// `--thickness`.
pub fn thickness(text: &str) -> Result<ThicknessValue, String> {
    if text == "listing" {
        return Ok(ThicknessValue::Listing);
    }
    let factor =
        number(text, "a finite number, 0 or more, or listing", |value| value.is_finite() && value >= 0.0);
    factor.map(ThicknessValue::Factor)
}

/// `--background`: linear red, green, blue and alpha, or nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Background(pub Option<[f32; 4]>);

/// `--background`.
pub fn background(text: &str) -> Result<Background, String> {
    if text == "none" {
        return Ok(Background(None));
    }
    let opaque = || split(text, ',').map(|[red, green, blue]: [f32; 3]| [red, green, blue, 1.0]);
    let color = split(text, ',').or_else(opaque);
    color
        .filter(|color: &[f32; 4]| {
            color.iter().all(|value| value.is_finite()) && (0.0..=1.0).contains(&color[3])
        })
        .map(|color| Background(Some(color)))
        .ok_or_else(|| "expected R,G,B or R,G,B,A (linear, alpha in 0 to 1), or none".to_owned())
}

/// What `--aov` may name, besides all of them.
pub const AOVS: [&str; 9] =
    ["depth", "normal", "albedo", "position", "id", "coverage", "layers", "samples", "variance"];

/// `--aov`: a list of names, or `all`.
pub fn aovs(text: &str) -> Result<AovSelection, String> {
    let mut aovs = AovSelection::default();
    for name in text.split(',').map(str::trim) {
        match name {
            "depth" => aovs.depth = true,
            "normal" => aovs.normal = true,
            "albedo" => aovs.albedo = true,
            "position" => aovs.position = true,
            "id" => aovs.id = true,
            "coverage" => aovs.coverage = true,
            "layers" => aovs.layers = true,
            "samples" => aovs.samples = true,
            "variance" => aovs.variance = true,
            "all" => aovs = AovSelection::ALL,
            _ => {
                return Err(format!("{name:?} is not one of {}, all", AOVS.join(", ")));
            }
        }
    }
    Ok(aovs)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks that each text is refused.
    fn refused<T: fmt::Debug>(parse: impl Fn(&str) -> Result<T, String>, texts: &[&str]) {
        for text in texts {
            assert!(parse(text).is_err(), "{text:?}: {:?}", parse(text));
        }
    }

    #[test]
    fn numbers() {
        assert_eq!(positive("2.8"), Ok(2.8));
        refused(positive, &["0", "-1", "inf", "nan", "", "1x"]);
        assert_eq!(count::<3>("3"), Ok(3));
        refused(count::<3>, &["2", "257", "-1", "4.5", ""]);
        assert_eq!(point("1, -2,3e6"), Ok(DVec3::new(1.0, -2.0, 3e6)));
        refused(point, &["1,2", "1,2,3,4", "1,2,inf", "a,b,c", ""]);
        assert_eq!(focus("3"), Ok(3.0));
        assert_eq!(focus("inf"), Ok(f64::INFINITY));
        refused(focus, &["0", "-inf", "nan", "far"]);
        assert_eq!(cutoff("9"), Ok(9.0));
        refused(cutoff, &["0", "65", "nan"]);
        assert_eq!([blades("0"), blades("3"), blades("64")], [Ok(0), Ok(3), Ok(64)]);
        refused(blades, &["1", "2", "65", "-3", "3.5"]);
    }

    #[test]
    fn outlier_filters() {
        assert_eq!(outliers("none"), Ok(Outliers::Keep));
        assert_eq!(outliers("statistical"), Ok(Outliers::Statistical { neighbors: 8, sigmas: 3.0 }));
        assert_eq!(outliers("statistical:16,2.5"), Ok(Outliers::Statistical { neighbors: 16, sigmas: 2.5 }));
        assert_eq!(outliers("radius:0.5,3"), Ok(Outliers::Radius { radius: 0.5, count: 3 }));
        refused(
            outliers,
            &["", "all", "none:1,2", "radius", "radius:1", "radius:0,3", "statistical:0,1", "statistical:8"],
        );
    }

    #[test]
    fn sizes() {
        assert_eq!(size("640x480"), Ok([640, 480]));
        assert_eq!(size("1 x 65536"), Ok([1, 65_536]));
        refused(size, &["640", "640x", "640x480x3", "0x5", "5x65537", "640X480", "-1x5", "640*480"]);
    }

    #[test]
    fn sample_ranges() {
        assert_eq!(samples("0:8"), Ok(0..8));
        assert_eq!(samples("8:16"), Ok(8..16));
        refused(samples, &["8:8", "9:8", "8", ":8", "8:", "-1:4", "0:4:8"]);
    }

    #[test]
    fn crops() {
        assert_eq!(crop("0,0,10,20"), Ok(PixelRect::new(0, 0, 10, 20)));
        refused(crop, &["0,0,10", "5,0,5,9", "0,9,5,8", "-1,0,5,5", "0,0,5,5,5", "a,b,c,d", "0 0 5 5"]);
    }

    #[test]
    fn tiles_join_exactly() {
        let (width, height) = (101, 37);
        let mut covered = vec![0; (width * height) as usize];
        for index in 0..12 {
            let rect = tile(&format!("{index}/4x3")).unwrap().of_frame(width, height);
            for y in rect.y0..rect.y1 {
                for x in rect.x0..rect.x1 {
                    covered[(y * width as i32 + x) as usize] += 1;
                }
            }
        }
        assert!(covered.iter().all(|&count| count == 1));
        assert_eq!(tile("5/4x3").unwrap().of_frame(100, 90), PixelRect::new(25, 30, 50, 60));
        refused(tile, &["12/4x3", "-1/4x3", "1/4", "1", "1/0x3", "0/4x3x2", "0/65536x65536"]);
    }

    #[test]
    fn views() {
        let direction = |azimuth, elevation| Ok(ViewDirection { azimuth, elevation });
        assert_eq!(view("front"), direction(0.0, 0.0));
        assert_eq!(view("right"), direction(90.0, 0.0));
        assert_eq!(view("back"), direction(180.0, 0.0));
        assert_eq!(view("left"), direction(270.0, 0.0));
        assert_eq!(view("top"), direction(0.0, 90.0));
        assert_eq!(view("bottom"), direction(0.0, -90.0));
        assert_eq!(view("-30,12.5"), direction(-30.0, 12.5));
        refused(view, &["Front", "30", "30,91", "inf,0", "30,20,10", ""]);
    }

    #[test]
    fn thicknesses() {
        assert_eq!(thickness("0.5"), Ok(ThicknessValue::Factor(0.5)));
        assert_eq!(thickness("0"), Ok(ThicknessValue::Factor(0.0)));
        assert_eq!(thickness("listing"), Ok(ThicknessValue::Listing));
        refused(thickness, &["-1", "inf", "nan", "thick"]);
    }

    #[test]
    fn backgrounds() {
        assert_eq!(background("none"), Ok(Background(None)));
        assert_eq!(background("0.1,0.2,3"), Ok(Background(Some([0.1, 0.2, 3.0, 1.0]))));
        assert_eq!(background("1, 1, 1, 0.5"), Ok(Background(Some([1.0, 1.0, 1.0, 0.5]))));
        refused(background, &["1", "1,1", "1,1,1,2", "1,1,1,-1", "nan,0,0", "white", "1,1,1,1,1"]);
    }

    #[test]
    fn aov_lists() {
        assert_eq!(aovs("depth"), Ok(AovSelection { depth: true, ..AovSelection::default() }));
        let each = "depth,normal,albedo,position, id,coverage,layers,samples,variance";
        assert_eq!(aovs(each), aovs("all"));
        assert_eq!(aovs("all,depth"), aovs("all"));
        refused(aovs, &["", "depth,", "z", "Depth"]);
    }
}
