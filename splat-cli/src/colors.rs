//! Colours from what was measured: `--color`.

use crate::arguments::ColorArguments;
use crate::choices::ColorMapChoice;
use crate::console::Console;
use crate::values::ColorChoice;
use anyhow::{Context, bail, ensure};
use glam::{DVec3, Vec3};
use splat_core::fit::Up;
use splat_core::{Cloud, srgb};

/// The share of the points that lies beyond each end of the colours: so that a few strays do not take all of them.
const BEYOND: f64 = 0.02;

/// The scalar field of classes.
const CLASS: &str = "classification";

/// Of points without a number.
const UNKNOWN: Vec3 = Vec3::new(0.5, 0.0, 0.5);

/// What is to be shown of a cloud: what `--color` asks for, or what it is best seen by; `None` for a cloud without a colour
/// and an intensity.
///
/// # Errors
/// A sentence that names what the cloud lacks.
pub fn choose(cloud: &Cloud, arguments: &ColorArguments) -> anyhow::Result<Option<ColorChoice>> {
    match &arguments.color {
        Some(ColorChoice::Rgb) => ensure!(has_colors(cloud), "--color rgb: the cloud has no colours"),
        Some(ColorChoice::Class) => {
            ensure!(cloud.field(CLASS).is_some(), "--color class: the points have no class");
        }
        Some(ColorChoice::Field(name)) if cloud.field(name).is_none() => {
            let names: Vec<&str> = cloud.fields.iter().map(|field| field.name.as_str()).collect();
            let names = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
            bail!("--color {name}: no such field, the cloud has {names}");
        }
        _ => {}
    }
    Ok(arguments.color.clone().or_else(|| default_choice(cloud)))
}

/// Gives a prepared cloud the colours of a choice. Returns the options that ask for them again; none for the cloud's own.
///
/// # Errors
/// A sentence that names what the cloud lacks.
pub fn apply(
    cloud: &mut Cloud,
    choice: ColorChoice,
    arguments: &ColorArguments,
    up: Up,
    console: Console,
) -> anyhow::Result<String> {
    if choice != ColorChoice::Rgb {
        cloud.harmonics = None;
    }
    let (values, what) = match choice {
        ColorChoice::Rgb => return Ok(String::new()),
        ColorChoice::Normal => {
            cloud.colors = Some(normal_colors(cloud, up.axes()[0]));
            return Ok(" --color normal".to_owned());
        }
        ColorChoice::Class => {
            let classes = &cloud.field(CLASS).context("--color class: the points have no class")?.values;
            cloud.colors = Some(classes.iter().map(|&class| class_color(class)).collect());
            return Ok(" --color class".to_owned());
        }
        ColorChoice::Height => {
            let axis = up.axes()[0];
            let height = |index| cloud.world_position(index).dot(axis) as f32;
            ((0..cloud.len()).map(height).collect(), "height".to_owned())
        }
        ColorChoice::Field(name) => {
            let field = cloud.field(&name).with_context(|| format!("--color {name}: no such field"))?;
            (field.values.clone(), field.name.clone())
        }
    };
    let is_intensity = what.eq_ignore_ascii_case("intensity");
    let map = arguments.colormap.unwrap_or(if is_intensity {
        ColorMapChoice::Gray
    } else {
        ColorMapChoice::Viridis
    });
    let [low, high] = match arguments.color_range {
        Some(range) => range,
        None => robust_range(&values).with_context(|| format!("--color {what}: no point has a number"))?,
    };
    let map_name = map_name(map);
    let power = if is_intensity { intensity_power(&values, [low, high]) } else { 1.0 };
    let how =
        if power < 1.0 { format!("{map_name}, to the power of {power:.2}") } else { map_name.to_owned() };
    console.note(format_args!("colours show the {what} from {low} to {high} ({how}; --color-range)"));
    let table: Vec<Vec3> = (0..=255).map(|i| map_color(map, f64::from(i) / 255.0)).collect();
    let color = |&value: &f32| {
        if !value.is_finite() {
            return UNKNOWN;
        }
        let share = if high > low { (f64::from(value) - low) / (high - low) } else { 0.5 };
        table[(libm::pow(share.clamp(0.0, 1.0), power) * 255.0).round() as usize]
    };
    cloud.colors = Some(values.iter().map(color).collect());
    Ok(format!(" --color {what} --colormap {map_name} --color-range {low}:{high}"))
}

/// What is shown of a cloud where no option says: its colours, or else its intensity, if that differs from point to point;
/// `None` for neither.
pub fn default_choice(cloud: &Cloud) -> Option<ColorChoice> {
    if has_colors(cloud) {
        return Some(ColorChoice::Rgb);
    }
    let [low, high] = robust_range(&cloud.field("intensity")?.values)?;
    (low < high).then(|| ColorChoice::Field("intensity".to_owned()))
}

/// Whether a cloud has colours of its own.
fn has_colors(cloud: &Cloud) -> bool {
    cloud.colors.is_some() || cloud.harmonics.is_some()
}

/// The numbers between which all but a share of the points lies at each end, those that are not finite left out; the
/// least and the greatest where these are the same.
fn robust_range(values: &[f32]) -> Option<[f64; 2]> {
    let mut finite: Vec<f32> = values.iter().copied().filter(|value| value.is_finite()).collect();
    let last = finite.len().checked_sub(1)?;
    let beyond = (BEYOND * last as f64) as usize;
    let mut at = |rank: usize| f64::from(*finite.select_nth_unstable_by(rank, f32::total_cmp).1);
    let (low, high) = (at(beyond), at(last - beyond));
    Some(if low < high { [low, high] } else { [at(0), at(last)] })
}

/// The power that brings the median of intensities to the middle of the colours, if it is at least 1/4: a few mirrors in a scan
/// are a hundred times as bright as all else, which would be black.
fn intensity_power(values: &[f32], [low, high]: [f64; 2]) -> f64 {
    const LEAST: f64 = 0.25;
    let mut finite: Vec<f32> = values.iter().copied().filter(|value| value.is_finite()).collect();
    if finite.is_empty() {
        return 1.0;
    }
    let middle = finite.len() / 2;
    let median = f64::from(*finite.select_nth_unstable_by(middle, f32::total_cmp).1);
    let share = (median - low) / (high - low);
    if share > 0.0 && share < 0.5 { (libm::log(0.5) / libm::log(share)).max(LEAST) } else { 1.0 }
}

/// Directions as colours: half of each component and a half. Normals that do not tell the outside point up.
fn normal_colors(cloud: &Cloud, up: DVec3) -> Vec<Vec3> {
    let up = up.as_vec3();
    let facing = |normal: Vec3| if cloud.oriented || normal.dot(up) >= 0.0 { normal } else { -normal };
    let linear = |component: f32| srgb::decode(f64::from(0.5 * component + 0.5).clamp(0.0, 1.0)) as f32;
    cloud.normals.iter().map(|&normal| facing(normal).map(linear)).collect()
}

fn map_name(map: ColorMapChoice) -> &'static str {
    match map {
        ColorMapChoice::Viridis => "viridis",
        ColorMapChoice::Cividis => "cividis",
        ColorMapChoice::Inferno => "inferno",
        ColorMapChoice::Gray => "gray",
    }
}

/// The linear colour at a place of a map, 0 to 1.
fn map_color(map: ColorMapChoice, place: f64) -> Vec3 {
    let gradient = match map {
        ColorMapChoice::Viridis => colorous::VIRIDIS,
        ColorMapChoice::Cividis => colorous::CIVIDIS,
        ColorMapChoice::Inferno => colorous::INFERNO,
        // sRGB levels look evenly spaced. Black is left to what is not there.
        ColorMapChoice::Gray => return Vec3::splat(srgb::decode(0.1 + 0.9 * place) as f32),
    };
    let colorous::Color { r, g, b } = gradient.eval_continuous(place);
    from_srgb([r, g, b])
}

fn from_srgb(color: [u8; 3]) -> Vec3 {
    let levels = splat_io::srgb::linear_from_srgb8();
    Vec3::from(color.map(|level| levels[usize::from(level)]))
}

/// The colour of an ASPRS class. The standard names the classes; the colours are those that viewers have in common: brown
/// ground, green plants, red buildings, blue water.
fn class_color(class: f32) -> Vec3 {
    const COLORS: [[u8; 3]; 23] = [
        [150, 150, 150], // never classified
        [190, 190, 190], // unclassified
        [166, 118, 60],  // ground
        [161, 217, 120], // low vegetation
        [80, 180, 75],   // medium vegetation
        [25, 115, 50],   // high vegetation
        [222, 70, 55],   // building
        [255, 0, 255],   // low noise
        [120, 120, 60],  // model key-point
        [50, 120, 220],  // water
        [110, 80, 70],   // rail
        [80, 80, 90],    // road surface
        [240, 220, 110], // overlap
        [250, 180, 60],  // wire, guard
        [255, 215, 0],   // wire, conductor
        [160, 90, 200],  // transmission tower
        [255, 130, 0],   // wire connector
        [190, 140, 170], // bridge deck
        [255, 60, 180],  // high noise
        [200, 110, 110], // overhead structure
        [130, 100, 80],  // ignored ground
        [235, 245, 255], // snow
        [100, 60, 60],   // temporal exclusion
    ];
    // Further classes are the user's own.
    const OTHERS: [[u8; 3]; 4] = [[0, 170, 170], [170, 170, 0], [120, 90, 220], [230, 150, 200]];
    if !class.is_finite() {
        return UNKNOWN;
    }
    let class = class.max(0.0) as usize;
    from_srgb(COLORS.get(class).copied().unwrap_or(OTHERS[class % OTHERS.len()]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::Field;

    #[test]
    fn strays_do_not_take_the_colours() {
        let mut values: Vec<f32> = (0..=1000).map(|i| i as f32).collect();
        values[1000] = 1e9;
        values[3] = f32::NAN;
        let [low, high] = robust_range(&values).unwrap();
        assert!((low - 20.0).abs() < 3.0 && (high - 980.0).abs() < 3.0, "{low} {high}");
        assert_eq!(robust_range(&[5.0; 9]), Some([5.0, 5.0]));
        let mostly = [vec![1.0; 1000], vec![2.0]].concat();
        assert_eq!(robust_range(&mostly), Some([1.0, 2.0]));
        assert_eq!(robust_range(&[f32::NAN]), None);
    }

    #[test]
    fn a_few_mirrors_do_not_make_all_else_black() {
        let skewed = [vec![800.0; 90], vec![60_000.0; 10]].concat();
        let power = intensity_power(&skewed, [0.0, 60_000.0]);
        assert!(power == 0.25 && libm::pow(800.0 / 60_000.0, power) > 0.3, "{power}");
        let even: Vec<f32> = (0..=100).map(|i| i as f32).collect();
        assert_eq!(intensity_power(&even, [0.0, 100.0]), 1.0);
        assert!((intensity_power(&even, [0.0, 200.0]) - 0.5).abs() < 1e-12);
        assert_eq!(intensity_power(&[], [0.0, 1.0]), 1.0);
    }

    #[test]
    fn maps_become_lighter_all_the_way() {
        let maps =
            [ColorMapChoice::Viridis, ColorMapChoice::Cividis, ColorMapChoice::Inferno, ColorMapChoice::Gray];
        for map in maps {
            let lightness =
                |i: i32| map_color(map, f64::from(i) / 64.0).dot(Vec3::new(0.2126, 0.7152, 0.0722));
            assert!((0..64).all(|i| lightness(i) < lightness(i + 1)), "{map:?}");
        }
    }

    #[test]
    fn without_colours_the_intensity_is_shown_if_it_says_anything() {
        let mut cloud = Cloud::from_points(&[DVec3::ZERO; 3]);
        assert_eq!(default_choice(&cloud), None);
        let intensity = |values| vec![Field { name: "Intensity".to_owned(), values }];
        cloud.fields = intensity(vec![3.0; 3]);
        assert_eq!(default_choice(&cloud), None);
        cloud.fields = intensity(vec![3.0, 4.0, 5.0]);
        assert_eq!(default_choice(&cloud), Some(ColorChoice::Field("intensity".to_owned())));
        cloud.colors = Some(vec![Vec3::ONE; 3]);
        assert_eq!(default_choice(&cloud), Some(ColorChoice::Rgb));
    }
}
