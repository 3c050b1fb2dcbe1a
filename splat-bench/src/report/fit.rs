//! Exponents: straight lines through logarithms.

/// The exponent p of y = a x^p, by least squares of the logarithms. `None` with fewer than two different x, or where
/// a value has no logarithm.
pub fn exponent(points: &[[f64; 2]]) -> Option<f64> {
    if points.iter().flatten().any(|value| !(value.is_finite() && *value > 0.0)) {
        return None;
    }
    let logs: Vec<[f64; 2]> = points.iter().map(|point| point.map(f64::ln)).collect();
    let mean = |axis: usize| logs.iter().map(|log| log[axis]).sum::<f64>() / logs.len() as f64;
    let [mx, my] = [mean(0), mean(1)];
    let spread: f64 = logs.iter().map(|log| (log[0] - mx) * (log[0] - mx)).sum();
    let product: f64 = logs.iter().map(|log| (log[0] - mx) * (log[1] - my)).sum();
    (spread > 0.0).then(|| product / spread)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_exponent_of_a_power() {
        let points: Vec<[f64; 2]> = [1.0, 2.0, 8.0, 64.0].map(|x| [x, 3.0 * f64::powf(x, -0.75)]).to_vec();
        assert!((exponent(&points).unwrap() + 0.75).abs() < 1e-12);
    }

    #[test]
    fn has_no_exponent_for_too_little() {
        assert_eq!(exponent(&[[2.0, 1.0]]), None);
        assert_eq!(exponent(&[[2.0, 1.0], [2.0, 3.0]]), None);
        assert_eq!(exponent(&[[1.0, 1.0], [2.0, 0.0]]), None);
    }
}
