//! FLIP: how different two pictures look to someone who sees them in turn.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, "FLIP: A Difference Evaluator for Alternating
//! Images", HPG 2020; the metric of pictures of low dynamic range, its filters separated. The constants are the paper's.

/// Pixels a degree of the visual field: a monitor 0.7 m wide with 3840 pixels, 0.7 m away.
pub const PIXELS_PER_DEGREE: f64 = 0.7 * 3840.0 / 0.7 * std::f64::consts::PI / 180.0;

/// Exponent of colour differences.
const COLOR_EXPONENT: f64 = 0.7;
/// The share of the largest colour difference from which on differences are compressed, and what that becomes.
const KNEE: [f64; 2] = [0.4, 0.95];
/// Width of the edges and points that are seen, in degrees.
const FEATURE_WIDTH: f64 = 0.082;
/// Exponent of differences of edges and points.
const FEATURE_EXPONENT: f64 = 0.5;

/// Contrast sensitivities as Gaussians of weight a and scale b: of luminance, red-green, and the two of blue-yellow.
const LUMINANCE: [f64; 2] = [1.0, 0.0047];
const RED_GREEN: [f64; 2] = [1.0, 0.0053];
const BLUE_YELLOW: [[f64; 2]; 2] = [[34.1, 0.04], [13.5, 0.025]];

/// The white of D65.
const WHITE: [f64; 3] = [0.950_428_545, 1.0, 1.088_900_371];

/// The map of differences, 0 to 1, row by row, of two pictures of the same size, whose rows have `width` pixels: linear red,
/// green and blue, clamped to 0 to 1, what is no number as 0.
pub fn flip(reference: &[[f32; 3]], test: &[[f32; 3]], width: usize) -> Vec<f32> {
    assert_eq!(reference.len(), test.len(), "pictures of the same size");
    if reference.is_empty() || width == 0 {
        return Vec::new();
    }
    // In bands, each with the rows around it that filters reach: planes of whole large pictures would take too much memory.
    let margin = blur_radius().max(feature_radius()) as usize;
    let height = reference.len() / width;
    let mut map = Vec::with_capacity(reference.len());
    for start in (0..height).step_by(BAND) {
        let end = height.min(start + BAND);
        let first = start.saturating_sub(margin);
        let rows = first * width..height.min(end + margin) * width;
        let of_band = flip_of_band(&reference[rows.clone()], &test[rows], width);
        map.extend_from_slice(&of_band[(start - first) * width..(end - first) * width]);
    }
    map
}

/// Rows that are compared at once.
const BAND: usize = 256;

fn flip_of_band(reference: &[[f32; 3]], test: &[[f32; 3]], width: usize) -> Vec<f32> {
    let [reference, test] = [reference, test].map(|picture| Seen::new(picture, width));
    let largest = largest_difference();
    let features = reference.features.iter().zip(&test.features);
    let colors = reference.colors.iter().zip(&test.colors);
    let errors = colors.zip(features).map(|((a, b), (of_a, of_b))| {
        let color = compressed(color_difference(*a, *b), largest);
        let feature = (of_a[0] - of_b[0]).abs().max((of_a[1] - of_b[1]).abs());
        let feature = libm::pow(feature * std::f64::consts::FRAC_1_SQRT_2, FEATURE_EXPONENT);
        libm::pow(color, 1.0 - feature) as f32
    });
    errors.collect()
}

/// What is seen of a picture.
struct Seen {
    /// Blurred as by the eye, in L*a*b* with Hunt's adjustment.
    colors: Vec<[f64; 3]>,
    /// How much of an edge, and of a point, there is in each pixel.
    features: Vec<[f64; 2]>,
}

impl Seen {
    fn new(picture: &[[f32; 3]], width: usize) -> Self {
        let opponent: Vec<[f64; 3]> = picture
            .iter()
            .map(|pixel| {
                let clamped = |value: f32| if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0).into() };
                opponent_from_linear(pixel.map(clamped))
            })
            .collect();
        let plane = |component: usize| opponent.iter().map(|pixel| pixel[component]).collect::<Vec<_>>();
        let (luminance, red_green, blue_yellow) = (plane(0), plane(1), plane(2));
        Self {
            colors: blurred(&luminance, &red_green, &blue_yellow, width),
            features: features(&luminance, width),
        }
    }
}

fn blurred(luminance: &[f64], red_green: &[f64], blue_yellow: &[f64], width: usize) -> Vec<[f64; 3]> {
    let (radius, pi_squared) = (blur_radius(), std::f64::consts::PI.powi(2));
    let gaussian = |[a, b]: [f64; 2]| {
        (-radius..=radius).map(move |x| {
            let degrees = f64::from(x) / PIXELS_PER_DEGREE;
            // The product of two of them is a sqrt(pi / b) times the two-dimensional Gaussian.
            (a * (std::f64::consts::PI / b).sqrt()).sqrt() * libm::exp(-pi_squared * degrees * degrees / b)
        })
    };
    let normalized =
        |kernel: Vec<f64>, sum: f64| kernel.iter().map(|weight| weight / sum).collect::<Vec<_>>();
    let alone = |constants| {
        let kernel: Vec<f64> = gaussian(constants).collect();
        let sum = kernel.iter().sum();
        normalized(kernel, sum)
    };
    let both_ways = |plane: &[f64], kernel: &[f64]| {
        convolved(&convolved(plane, width, kernel, Axis::Row), width, kernel, Axis::Column)
    };
    let luminance = both_ways(luminance, &alone(LUMINANCE));
    let red_green = both_ways(red_green, &alone(RED_GREEN));
    let parts = BLUE_YELLOW.map(|constants| gaussian(constants).collect::<Vec<f64>>());
    let sums = parts.each_ref().map(|kernel| kernel.iter().sum::<f64>());
    let sum = sums[0].hypot(sums[1]);
    let [first, second] = parts.map(|kernel| both_ways(blue_yellow, &normalized(kernel, sum)));
    (0..luminance.len())
        .map(|index| {
            let rgb =
                linear_from_opponent([luminance[index], red_green[index], first[index] + second[index]]);
            adjusted_lab(rgb.map(|value| value.clamp(0.0, 1.0)))
        })
        .collect()
}

/// How far the eye's blur reaches, in pixels: three deviations of the widest Gaussian.
fn blur_radius() -> i32 {
    let scales = [LUMINANCE[1], RED_GREEN[1], BLUE_YELLOW[0][1], BLUE_YELLOW[1][1]];
    let widest = scales.into_iter().fold(0.0, f64::max);
    (3.0 * (widest / (2.0 * std::f64::consts::PI.powi(2))).sqrt() * PIXELS_PER_DEGREE).ceil() as i32
}

/// The deviation of the Gaussian of edges and points, in pixels.
const FEATURE_DEVIATION: f64 = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;

/// How far edges and points reach, in pixels.
fn feature_radius() -> i32 {
    (3.0 * FEATURE_DEVIATION).ceil() as i32
}

/// How much of an edge (first derivatives of a Gaussian) and of a point (second ones) each pixel has.
fn features(luminance: &[f64], width: usize) -> Vec<[f64; 2]> {
    let (deviation, radius) = (FEATURE_DEVIATION, feature_radius());
    let kernel = |of: &dyn Fn(f64, f64) -> f64| -> Vec<f64> {
        let weight = |x: i32| {
            let x = f64::from(x);
            of(x, libm::exp(-x * x / (2.0 * deviation * deviation)))
        };
        let weights: Vec<f64> = (-radius..=radius).map(weight).collect();
        // Positive and negative weights sum to 1 each.
        let sum = |sign: f64| weights.iter().map(|weight| (sign * weight).max(0.0)).sum::<f64>();
        let sums = [sum(1.0), sum(-1.0)];
        weights
            .iter()
            .map(|&weight| weight / if weight > 0.0 { sums[0] } else { sums[1].max(f64::MIN_POSITIVE) })
            .collect()
    };
    let smooth = kernel(&|_, gaussian| gaussian);
    let first = kernel(&|x, gaussian| -x * gaussian);
    let second = kernel(&|x, gaussian| (x * x / (deviation * deviation) - 1.0) * gaussian);
    let light: Vec<f64> = luminance.iter().map(|value| (value + 16.0) / 116.0).collect();
    let gradient = |derivative: &[f64]| {
        let across =
            convolved(&convolved(&light, width, derivative, Axis::Row), width, &smooth, Axis::Column);
        let down = convolved(&convolved(&light, width, &smooth, Axis::Row), width, derivative, Axis::Column);
        across.into_iter().zip(down).map(|(x, y)| x.hypot(y)).collect::<Vec<f64>>()
    };
    gradient(&first).into_iter().zip(gradient(&second)).map(|(edge, point)| [edge, point]).collect()
}

#[derive(Clone, Copy)]
enum Axis {
    Row,
    Column,
}

/// A plane, weighted with a kernel of odd length along an axis; beyond its edges are those of the edge.
fn convolved(plane: &[f64], width: usize, kernel: &[f64], axis: Axis) -> Vec<f64> {
    let radius = kernel.len() / 2;
    let height = plane.len() / width;
    let mut result = vec![0.0; plane.len()];
    for (y, row) in result.chunks_exact_mut(width).enumerate() {
        for (tap, weight) in kernel.iter().enumerate() {
            match axis {
                Axis::Column => {
                    let from = (y + tap).saturating_sub(radius).min(height - 1);
                    for (sum, value) in row.iter_mut().zip(&plane[from * width..]) {
                        *sum += weight * value;
                    }
                }
                Axis::Row => {
                    let line = &plane[y * width..(y + 1) * width];
                    for (x, sum) in row.iter_mut().enumerate() {
                        *sum += weight * line[(x + tap).saturating_sub(radius).min(width - 1)];
                    }
                }
            }
        }
    }
    result
}

fn xyz_from_linear([r, g, b]: [f64; 3]) -> [f64; 3] {
    // Of the primaries and D65, as quotients of integers.
    [
        (10_135_552.0 * r + 8_788_810.0 * g + 4_435_075.0 * b) / 24_577_794.0,
        (2_613_072.0 * r + 8_788_810.0 * g + 887_015.0 * b) / 12_288_897.0,
        (1_425_312.0 * r + 8_788_810.0 * g + 70_074_185.0 * b) / 73_733_382.0,
    ]
}

fn linear_from_xyz([x, y, z]: [f64; 3]) -> [f64; 3] {
    [
        3.241_003_275 * x - 1.537_398_934 * y - 0.498_615_861 * z,
        -0.969_224_334 * x + 1.875_930_071 * y + 0.041_554_224 * z,
        0.055_639_423 * x - 0.204_011_202 * y + 1.057_148_933 * z,
    ]
}

/// The space YCxCz: like L*a*b*, but linear.
fn opponent_from_linear(rgb: [f64; 3]) -> [f64; 3] {
    let xyz = xyz_from_linear(rgb);
    let [x, y, z] = [0, 1, 2].map(|i| xyz[i] / WHITE[i]);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn linear_from_opponent([luminance, red_green, blue_yellow]: [f64; 3]) -> [f64; 3] {
    let y = (luminance + 16.0) / 116.0;
    let relative = [y + red_green / 500.0, y, y - blue_yellow / 200.0];
    linear_from_xyz([0, 1, 2].map(|i| relative[i] * WHITE[i]))
}

/// L*a*b*, where dark colours are less colourful (Hunt).
fn adjusted_lab(rgb: [f64; 3]) -> [f64; 3] {
    const DELTA: f64 = 6.0 / 29.0;
    let xyz = xyz_from_linear(rgb);
    let [x, y, z] = [0, 1, 2].map(|i| {
        let value = xyz[i] / WHITE[i];
        if value > DELTA.powi(3) { libm::cbrt(value) } else { value / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    });
    let lightness = 116.0 * y - 16.0;
    [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
}

/// The distance HyAB, its exponent applied.
fn color_difference(a: [f64; 3], b: [f64; 3]) -> f64 {
    libm::pow((a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2]), COLOR_EXPONENT)
}

/// That of the two colours that differ most: green and blue.
fn largest_difference() -> f64 {
    color_difference(adjusted_lab([0.0, 1.0, 0.0]), adjusted_lab([0.0, 0.0, 1.0]))
}

/// A colour difference as 0 to 1, large ones compressed.
fn compressed(difference: f64, largest: f64) -> f64 {
    let knee = KNEE[0] * largest;
    if difference < knee {
        difference * KNEE[1] / knee
    } else {
        KNEE[1] + (difference - knee) / (largest - knee) * (1.0 - KNEE[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_is_nothing_and_what_differs_most_is_one() {
        let picture = |pixel: [f32; 3]| vec![pixel; 30 * 20];
        assert!(
            flip(&picture([0.2, 0.4, 0.6]), &picture([0.2, 0.4, 0.6]), 30).iter().all(|&error| error == 0.0)
        );
        let most = flip(&picture([0.0, 1.0, 0.0]), &picture([0.0, 0.0, 1.0]), 30);
        assert!(most.iter().all(|error| (error - 1.0).abs() < 1e-6), "{}", most[0]);
        assert!(flip(&[], &[], 0).is_empty());
        let strange = vec![[f32::NAN, f32::INFINITY, -1.0]; 6];
        assert_eq!(flip(&strange, &[[0.0, 1.0, 0.0]; 6], 3), [0.0; 6]);
    }

    #[test]
    fn flat_greys_differ_as_their_lightness() {
        // L* of 0.5 and of 0.4, by the definition: 116 cbrt(Y) - 16.
        let lightness = |y: f64| 116.0 * y.cbrt() - 16.0;
        let difference = (lightness(0.5) - lightness(0.4)).powf(0.7);
        let expected = difference * 0.95 / (0.4 * largest_difference());
        let map = flip(&vec![[0.5; 3]; 25], &vec![[0.4; 3]; 25], 5);
        assert!(map.iter().all(|&error| (f64::from(error) - expected).abs() < 1e-6), "{} {expected}", map[0]);
    }

    #[test]
    fn bands_leave_no_trace() {
        let picture = |seed: u32| -> Vec<[f32; 3]> {
            let noise = |i: u32| ((i + seed).wrapping_mul(2_654_435_761) >> 24) as f32 / 255.0;
            (0..7 * 600).map(|i| [noise(3 * i), noise(3 * i + 1), noise(3 * i + 2)]).collect()
        };
        let (a, b) = (picture(0), picture(99));
        assert!(flip(&a, &b, 7) == flip_of_band(&a, &b, 7));
    }

    #[test]
    fn an_edge_counts_more_than_its_colours() {
        let step =
            |right: f32| (0..400).map(|i| [if i % 20 < 10 { 0.5 } else { right }; 3]).collect::<Vec<_>>();
        let map = flip(&step(0.5), &step(0.6), 20);
        let (edge, flat) = (map[10 * 20 + 11], map[10 * 20 + 19]);
        assert!(edge > flat && flat > 0.0, "{edge} {flat}");
    }
}
