//! How two pictures differ, in numbers.

use super::pictures::{Pair, Plane, layer};
use splat_io::flip;

/// The differences of two pictures.
#[derive(Debug)]
pub struct Difference {
    /// By layer, the colour first.
    pub layers: Vec<Layer>,
    /// FLIP's map, row by row, if both have colours.
    pub flip: Option<Vec<f32>>,
}

/// The differences of the channels of a layer.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Its name.
    pub name: String,
    /// Its channels.
    pub channels: Vec<String>,
    /// Root of the mean of the squared differences of all channels; infinite where one is.
    pub rmse: f64,
    /// The largest difference; infinite where one value only is no finite number.
    pub max: f64,
    /// Its pixel, in the frame.
    pub at: [i32; 2],
    /// Its channel.
    pub channel: String,
    /// Of colours: 20 log10(1 / RMSE), in decibels.
    pub psnr: Option<f64>,
    /// The most floats between two values, plus one; none where not both are floats of one type.
    pub ulp: Option<u64>,
    /// Pixels in which bits differ.
    pub differing: usize,
}

impl Difference {
    /// Measures.
    pub fn of(pair: &Pair) -> Self {
        let mut names: Vec<&str> = pair.channels.iter().map(|(name, _)| layer(name)).collect();
        names.sort_by_key(|&name| (name != "color", name));
        names.dedup();
        let layers: Vec<Layer> = names.into_iter().map(|name| Layer::of(name, pair)).collect();
        let is_same = layers.iter().any(|layer| layer.name == "color" && layer.differing == 0);
        let flip = (|| {
            let [a, b] = [pair.colors(0)?, pair.colors(1)?];
            Some(if is_same { vec![0.0; a.len()] } else { flip(&a, &b, pair.size[0]) })
        })();
        Self { layers, flip }
    }

    /// The mean of FLIP.
    pub fn flip_mean(&self) -> Option<f64> {
        let map = self.flip.as_ref()?;
        Some(map.iter().map(|&error| f64::from(error)).sum::<f64>() / map.len().max(1) as f64)
    }
}

impl Layer {
    fn of(name: &str, pair: &Pair) -> Self {
        let planes: Vec<(&String, &[Plane; 2])> = pair
            .channels
            .iter()
            .filter(|(channel, _)| layer(channel) == name)
            .map(|(channel, planes)| (channel, planes))
            .collect();
        let (width, area) = (pair.size[0], pair.size[0] * pair.size[1]);
        let has_ulp = planes.iter().all(|(_, [a, b])| a.is_of_one_type(b) && a.place(0).is_some());
        let (mut squares, mut max, mut at, mut ulp, mut differing) = (0.0, 0.0, (0, 0), 0, 0);
        for index in 0..area {
            let mut is_different = false;
            for (number, (_, [a, b])) in planes.iter().enumerate() {
                let difference = difference(a.get(index), b.get(index));
                squares += difference * difference;
                if difference > max {
                    (max, at) = (difference, (index, number));
                }
                is_different |= difference > 0.0;
                if let (true, Some(a), Some(b)) = (has_ulp, a.place(index), b.place(index)) {
                    ulp = ulp.max(a.abs_diff(b));
                }
                is_different |= has_ulp && a.bits(index) != b.bits(index);
            }
            differing += usize::from(is_different);
        }
        let rmse = (squares / (area * planes.len()).max(1) as f64).sqrt();
        Self {
            name: name.to_owned(),
            channels: planes.iter().map(|(channel, _)| (*channel).clone()).collect(),
            rmse,
            max,
            at: [pair.window.x0 + (at.0 % width) as i32, pair.window.y0 + (at.0 / width) as i32],
            channel: planes[at.1].0.clone(),
            psnr: (name == "color").then(|| -20.0 * rmse.log10()),
            ulp: has_ulp.then_some(ulp),
            differing,
        }
    }
}

/// The absolute difference; that of equals is 0, also of infinities, and of what is both no number.
pub fn difference(a: f64, b: f64) -> f64 {
    if a == b || (a.is_nan() && b.is_nan()) {
        0.0
    } else if a.is_nan() || b.is_nan() {
        f64::INFINITY
    } else {
        (a - b).abs()
    }
}
