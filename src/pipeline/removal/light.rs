//! Light from each direction by the shadows on a surface: weighted least squares with non-negative weights.

use crate::math::stats::{OF_MAD, median};

/// Sweeps over all unknowns.
const SWEEPS: usize = 200;
/// Rounds of reweighting, in which outliers count less.
const ROBUST_ROUNDS: usize = 4;
/// Difference that is no outlier even on a plain surface, as a share of the mean: lights are found step by step.
const ORDINARY: f64 = 0.1;
/// Ridge, as a share of the diagonal: directions with nearly the same shadows share the light.
const RIDGE: f64 = 1e-3;
/// Leading columns with weights of any sign: brightness and its change along the surface, up to squares.
pub(super) const FREE: usize = 6;
/// Column of an even sky; those of single lights follow it.
pub(super) const SKY: usize = FREE;

/// Fits weights of `columns`, each with as many rows as `values`, to `values`; outlier rows, such as patterns and
/// spots, count less, and single lights have to explain more than `grain` usual deviations of a row (lasso). Returns
/// the weights of the columns and of the rows.
pub(super) fn fit(columns: &[Vec<f32>], values: &[f32], grain: f64) -> (Vec<f64>, Vec<f64>) {
    let mut rows = vec![1.0; values.len()];
    let mut weights = solve(columns, values, &rows, 0.0);
    for _ in 0..ROBUST_ROUNDS {
        let usual;
        (rows, usual) = row_weights(&residuals(columns, values, &weights), values);
        weights = solve(columns, values, &rows, grain * usual);
    }
    (weights, rows)
}

/// The same with given weights of the rows. `least` = projection of the residual on the shadow of a single light, of
/// unit length, that counts for nothing.
pub(super) fn solve(columns: &[Vec<f32>], values: &[f32], rows: &[f64], least: f64) -> Vec<f64> {
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
            let least = if i > SKY { least / gram[i * k + i].sqrt() } else { 0.0 };
            weights[i] = if i < FREE { best } else { (best - least).max(0.0) };
        }
    }
    weights
}

/// Returns the weight of each row by its residual, small for outliers, and the usual deviation.
pub(super) fn row_weights(off: &[f64], values: &[f32]) -> (Vec<f64>, f64) {
    let sizes: Vec<f64> = off.iter().map(|r| r.abs()).collect();
    let usual = if sizes.is_empty() { 0.0 } else { median(&sizes) };
    let mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len().max(1) as f64;
    // Tukey's weight at six times the median.
    let limit = (6.0 * usual).max(ORDINARY * mean).max(1e-6);
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
        let (weights, rows) = fit(&columns, &values, 0.0);
        for (w, t) in weights.iter().zip(truth) {
            assert!((w - f64::from(t)).abs() < 0.01, "{weights:?}");
        }
        assert!(weights[8] == 0.0 && rows[17] < 0.1, "{weights:?}");
        assert!(fit(&columns.map(|_| Vec::new()), &[], 1.0).0.iter().all(|w| *w == 0.0));
    }

    #[test]
    fn a_light_whose_shadow_could_be_grain_counts_for_nothing() {
        let n = 2000;
        let mut columns = vec![vec![0.0; n]; SKY + 3];
        columns[0] = vec![1.0; n];
        let [light, grain] = [400..1000, 1210..1290];
        light.clone().for_each(|i| columns[SKY + 1][i] = -1.0);
        grain.clone().for_each(|i| columns[SKY + 2][i] = -1.0);
        let mut values: Vec<f32> = (0..n).map(|i| if i / 20 % 2 == 0 { 0.78 } else { 0.82 }).collect();
        light.for_each(|i| values[i] -= 0.3);
        grain.for_each(|i| values[i] -= 0.02);
        let weights = |grain: f64| fit(&columns, &values, grain).0;
        let [certain, any] = [weights(9.0), weights(0.0)];
        assert!(any[SKY + 2] > 0.01 && certain[SKY + 2] == 0.0, "{any:?}, {certain:?}");
        assert!((any[SKY + 1] - 0.3).abs() < 0.01 && (certain[SKY + 1] - 0.3).abs() < 0.02, "{any:?}, {certain:?}");
    }
}
