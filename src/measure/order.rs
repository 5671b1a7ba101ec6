//! Order of convergence: the rate at which an error falls as work grows, compared with theory.

use serde::{Deserialize, Serialize};

/// A check of how fast an error falls as work grows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Order {
    /// Quantity that was refined: "samples of a pixel's footprint".
    pub(crate) what: String,
    /// Work (samples, pieces) and error.
    pub(crate) pairs: Vec<[f64; 2]>,
    /// Order in theory: the error falls like `work^-order`.
    pub(crate) expected: f64,
    /// Observed order (see [`observed`]).
    pub(crate) observed: f64,
    pub(crate) agrees: bool,
    pub(crate) meaning: String,
}

impl Order {
    /// Fits the order of `pairs` of work and error, and holds it against `expected`, which it may miss
    /// by `within`. Errors below `noise` are rounding.
    pub(crate) fn fit(what: &str, meaning: &str, pairs: Vec<[f64; 2]>, expected: f64, within: f64, noise: f64) -> Self {
        let observed = observed(&pairs, noise);
        let agrees = (observed - expected).abs() <= within;
        // JSON has no NaN.
        let observed = if observed.is_finite() { observed } else { 0.0 };
        Self { what: what.into(), pairs, expected, observed, agrees, meaning: meaning.into() }
    }
}

/// The slope of `-log(error)` over `log(work)`, a straight line fitted by least squares. Errors below
/// `noise` say nothing and are left out; NaN with fewer than two points left.
fn observed(pairs: &[[f64; 2]], noise: f64) -> f64 {
    let usable = |p: &&[f64; 2]| p[0] > 0.0 && p[1] > noise && p[0].is_finite() && p[1].is_finite();
    let logs: Vec<[f64; 2]> = pairs.iter().filter(usable).map(|p| [p[0].ln(), p[1].ln()]).collect();
    let n = logs.len() as f64;
    let mean = |axis: usize| logs.iter().map(|p| p[axis]).sum::<f64>() / n;
    let (x, y) = (mean(0), mean(1));
    let (mut xy, mut xx) = (0.0, 0.0);
    for p in &logs {
        xy += (p[0] - x) * (p[1] - y);
        xx += (p[0] - x).powi(2);
    }
    if logs.len() < 2 || xx == 0.0 { f64::NAN } else { -xy / xx }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_midpoint_rule_is_of_second_order_and_the_left_sum_of_first() {
        let exact = 1.0_f64.exp() - 1.0;
        let sum = |n: usize, shift: f64| (0..n).map(|i| ((i as f64 + shift) / n as f64).exp()).sum::<f64>() / n as f64;
        let errors = |shift: f64| -> Vec<[f64; 2]> {
            [2, 4, 8, 16, 32].map(|n| [n as f64, (sum(n, shift) - exact).abs()]).to_vec()
        };
        let midpoint = Order::fit("midpoint", "", errors(0.5), 2.0, 0.1, 1e-14);
        assert!(midpoint.agrees && (midpoint.observed - 2.0).abs() < 0.02, "{midpoint:?}");
        // The negative control: a first-order rule is not taken for one of second order.
        let left = Order::fit("left", "", errors(0.0), 2.0, 0.1, 1e-14);
        assert!(!left.agrees && (left.observed - 1.0).abs() < 0.1, "{left:?}");
    }

    #[test]
    fn rounding_and_too_few_points_say_nothing() {
        let pairs = vec![[1.0, 1.0], [2.0, 0.25], [4.0, 1e-17], [8.0, 3e-17]];
        assert!((observed(&pairs, 1e-15) - 2.0).abs() < 1e-12);
        let none = Order::fit("", "", vec![[1.0, 0.0]], 2.0, 0.5, 0.0);
        assert!(!none.agrees && none.observed == 0.0);
    }
}
