//! Levels of any size are exact box means, and their variance is that of the box.

use super::*;
use half::f16;

fn pyramid(size: [u32; 2], channels: usize, values: Vec<f32>) -> Pyramid {
    Pyramid::new(size, channels, Texels::F32(values), [Wrap::Repeat; 2]).expect("fits")
}

fn ramp(size: [u32; 2]) -> Vec<f32> {
    (0..size[0] * size[1]).map(|i| (i * 7919 % 1009) as f32 / 1009.0).collect()
}

#[test]
fn every_level_keeps_the_mean() {
    for size in [[1, 1], [2, 2], [3, 5], [7, 1], [1, 13], [64, 16], [100, 37], [127, 129]] {
        let values = ramp(size);
        let mean = values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64;
        let pyramid = pyramid(size, 1, values);
        assert_eq!(pyramid.levels()[pyramid.last()].size(), [1, 1]);
        for (i, level) in pyramid.levels().iter().enumerate() {
            let [w, h] = level.size();
            let sum: f64 = (0..h)
                .flat_map(|y| (0..w).map(move |x| (x, y)))
                .map(|(x, y)| f64::from(pyramid.texel(i, x.into(), y.into())[0]))
                .sum();
            let level_mean = sum / f64::from(w * h);
            // One rounding of f32 per texel of the level.
            assert!((level_mean - mean).abs() < 6e-8, "{size:?} {i}: {level_mean} {mean}");
        }
    }
}

#[test]
fn cut_texels_count_by_their_share() {
    // Three texels to two: [0, 1.5) and [1.5, 3).
    let pyramid = pyramid([3, 1], 1, vec![3.0, 6.0, 12.0]);
    assert_eq!(pyramid.levels()[1].texels(), &Texels::F32(vec![4.0, 10.0]));
    assert_eq!(pyramid.levels()[2].texels(), &Texels::F32(vec![7.0]));
}

#[test]
fn the_variance_of_powers_of_two_is_the_box_s() {
    let pyramid = pyramid([64, 16], 1, ramp([64, 16]));
    for (i, level) in pyramid.levels().iter().enumerate() {
        let expected = |level: usize| ((1_u64 << (2 * level)) as f64 - 1.0) / 12.0;
        assert_eq!(level.variance(), [expected(i), expected(i.min(4))]);
        assert_eq!(level.texel_size(), [(1 << i) as f64, (1 << i.min(4)) as f64]);
    }
}

#[test]
fn no_step_is_more_than_twofold() {
    for count in 1..400 {
        let pyramid = pyramid([count, 1], 1, vec![0.0; count as usize]);
        for pair in pyramid.levels().windows(2) {
            assert!(pair[1].coarseness() <= 2.0 * pair[0].coarseness());
            // A box over piecewise constant texels: between (t^2 - 1) / 12 and (t^2 + 1) / 12, or twice that for
            // short rows.
            let t = pair[1].coarseness();
            assert!(pair[1].variance()[0] >= (t * t - 1.0) / 12.0 - 1e-9);
            assert!(pair[1].variance()[0] <= (t * t + 2.0) / 12.0 + 1e-9);
        }
    }
}

#[test]
fn e11_black_beyond_the_edge_does_not_darken_levels() {
    // White, 8 x 1. The printed pyramid averages pairs of rows, one of them black: .5, .25, .125.
    let white = Pyramid::new([8, 1], 1, Texels::F32(vec![1.0; 8]), [Wrap::Black; 2]).expect("fits");
    assert!((0..=white.last()).all(|level| white.texel(level, 0, 0)[0] == 1.0));
    assert_eq!(white.texel(3, 1, 0)[0], 0.0);
    assert_eq!(white.texel(3, 0, -1)[0], 0.0);
}

#[test]
fn wraps() {
    let all = |wrap: Wrap| (-7..8).map(|i| wrap.index(i, 3)).collect::<Vec<_>>();
    let some = |values: [usize; 15]| values.map(Some).to_vec();
    assert_eq!(all(Wrap::Repeat), some([2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1]));
    assert_eq!(all(Wrap::Clamp), some([0, 0, 0, 0, 0, 0, 0, 0, 1, 2, 2, 2, 2, 2, 2]));
    assert_eq!(all(Wrap::Mirror), some([0, 0, 1, 2, 2, 1, 0, 0, 1, 2, 2, 1, 0, 0, 1]));
    assert_eq!(all(Wrap::Black).iter().flatten().count(), 3);
    assert_eq!(Wrap::Mirror.index(i64::MIN, 1), Some(0));
}

#[test]
fn what_is_not_finite_is_replaced_and_counted() {
    let mut values = vec![1.0; 12];
    (values[5], values[6], values[0]) = (f32::NAN, f32::INFINITY, 3.0);
    let one = pyramid([4, 3], 1, values);
    assert_eq!(one.replaced(), 2);
    assert_eq!([one.texel(0, 1, 1)[0], one.texel(0, 2, 1)[0]], [9.0 / 7.0, 1.0]);
    let none = pyramid([2, 1], 1, vec![f32::NAN; 2]);
    assert_eq!((none.replaced(), none.texel(0, 0, 0)), (2, [0.0; 4]));
    let halves = Texels::F16(vec![f16::NAN, f16::ONE]);
    let halves = Pyramid::new([2, 1], 1, halves, [Wrap::Clamp; 2]).expect("fits");
    assert_eq!((halves.replaced(), halves.texel(0, 0, 0)[0]), (1, 1.0));
    assert_eq!(Texels::f16_from(&[1e9, -1e9]), Texels::F16(vec![f16::MAX, f16::MIN]));
}

#[test]
fn srgb_is_averaged_as_light_and_alpha_as_it_is() {
    let texels = Texels::Srgb8(vec![0, 0, 255, 255]);
    let both = Pyramid::new([2, 1], 2, texels, [Wrap::Clamp; 2]).expect("fits");
    // Half the light is code 188; half of the alpha is 128 (127.5).
    assert_eq!(both.levels()[1].texels(), &Texels::Srgb8(vec![188, 128]));
    let texel = both.texel(1, 0, 0);
    assert!((texel[0] - 0.5).abs() < 0.005 && texel[1] == 128.0 / 255.0, "{texel:?}");
}

#[test]
fn errors_say_what_does_not_fit() {
    let make = |size, channels, count| {
        Pyramid::new(size, channels, Texels::F32(vec![0.0; count]), [Wrap::Clamp; 2]).unwrap_err().to_string()
    };
    assert_eq!(make([0, 2], 1, 0), "texture of 0 x 2 texels: expected 1 to 16777216 per axis");
    assert_eq!(make([1, 2], 5, 10), "texture of 5 channels: expected 1 to 4");
    assert_eq!(make([1, 2], 3, 5), "texture of 1 x 2 texels with 3 channels: found 5 values");
}
