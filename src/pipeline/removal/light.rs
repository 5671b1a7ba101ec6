//! Light from each direction by the shadows on a surface: weighted least squares with non-negative weights.

use crate::math::stats::{OF_MAD, median};

/// Sweeps over all unknowns.
const SWEEPS: usize = 200;
/// Rounds of reweighting, in which outliers count less.
const ROBUST_ROUNDS: usize = 4;
/// Ridge, as a share of the diagonal: directions with nearly the same shadows share the light.
const RIDGE: f64 = 1e-3;
/// Leading columns with weights of any sign: brightness and its change along the surface, up to squares.
pub(super) const FREE: usize = 6;

/// Fits weights of `columns`, each with as many rows as `values`, to `values`; outlier rows, such as patterns and
/// spots, count less. Returns the weights of the columns and of the rows.
pub(super) fn fit(columns: &[Vec<f32>], values: &[f32]) -> (Vec<f64>, Vec<f64>) {
    let mut rows = vec![1.0; values.len()];
    let mut weights = solve(columns, values, &rows);
    for _ in 0..ROBUST_ROUNDS {
        rows = row_weights(&residuals(columns, values, &weights)).0;
        weights = solve(columns, values, &rows);
    }
    (weights, rows)
}

/// The same with given weights of the rows.
pub(super) fn solve(columns: &[Vec<f32>], values: &[f32], rows: &[f64]) -> Vec<f64> {
    let dot = |a: &[f32], b: &[f32]| -> f64 {
        a.iter().zip(b).zip(rows).map(|((a, b), w)| f64::from(*a) * f64::from(*b) * w).sum()
    };
    let k = columns.len();
    let mut gram = vec![0.0; k * k];
    for i in 0..k {
        for j in i..k {
            let product = dot(&columns[i], &columns[j]);
            (gram[i * k + j], gram[j * k + i]) = (product, product);
        }
    }
    let right: Vec<f64> = columns.iter().map(|c| dot(c, values)).collect();
    let mut weights = vec![0.0; k];
    for _ in 0..SWEEPS {
        for i in 0..k {
            let diagonal = gram[i * k + i] * (1.0 + if i < FREE { 0.0 } else { RIDGE });
            if diagonal <= 0.0 {
                continue;
            }
            let others: f64 = (0..k).filter(|j| *j != i).map(|j| gram[i * k + j] * weights[j]).sum();
            let best = (right[i] - others) / diagonal;
            weights[i] = if i < FREE { best } else { best.max(0.0) };
        }
    }
    weights
}

/// Returns the weight of each row by its residual, small for outliers, and the usual deviation.
pub(super) fn row_weights(off: &[f64]) -> (Vec<f64>, f64) {
    let sizes: Vec<f64> = off.iter().map(|r| r.abs()).collect();
    let usual = if sizes.is_empty() { 0.0 } else { median(&sizes) };
    // Tukey's weight at six times the median.
    let limit = (6.0 * usual).max(1e-6);
    let weight = |r: &f64| (1.0 - (r / limit).powi(2)).max(0.0).powi(2);
    (off.iter().map(weight).collect(), OF_MAD * usual)
}

/// Returns the values minus the weighted columns.
pub(super) fn residuals(columns: &[Vec<f32>], values: &[f32], weights: &[f64]) -> Vec<f64> {
    let made = |row: usize| -> f64 { columns.iter().zip(weights).map(|(c, w)| f64::from(c[row]) * w).sum() };
    values.iter().enumerate().map(|(row, v)| f64::from(*v) - made(row)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_found_among_spots_and_none_is_negative() {
        let n = 400;
        let along = |f: &dyn Fn(usize) -> f32| (0..n).map(f).collect::<Vec<f32>>();
        let columns = [
            vec![1.0; n],
            along(&|i| i as f32 / n as f32),
            along(&|i| (i % 20) as f32 / 20.0),
            vec![0.0; n],
            vec![0.0; n],
            vec![0.0; n],
            along(&|i| -f32::from(u8::from((100..160).contains(&i)))),
            along(&|i| -f32::from(u8::from((140..220).contains(&i)))),
            along(&|i| -f32::from(u8::from((300..320).contains(&i)))),
        ];
        let truth = [0.8, -0.2, 0.1, 0.0, 0.0, 0.0, 0.3, 0.15, 0.0];
        let mut values: Vec<f32> =
            (0..n).map(|i| columns.iter().zip(truth).map(|(c, w): (_, f32)| c[i] * w).sum()).collect();
        // A bright area that would need a negative weight, and a few dark spots.
        (300..320).for_each(|i| values[i] += 0.05);
        (0..n).step_by(17).for_each(|i| values[i] = 0.1);
        let (weights, rows) = fit(&columns, &values);
        for (w, t) in weights.iter().zip(truth) {
            assert!((w - f64::from(t)).abs() < 0.01, "{weights:?}");
        }
        assert!(weights[8] == 0.0 && rows[17] < 0.1, "{weights:?}");
        assert!(fit(&columns.map(|_| Vec::new()), &[]).0.iter().all(|w| *w == 0.0));
    }
}
