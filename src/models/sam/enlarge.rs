//! Low-resolution logits at a picture's size: bilinear, half-pixel centres, as the official code does.

use rayon::prelude::*;

use crate::models::prepare::Side;

/// The two pixels and their shares that a line of `to` pixels takes from one of `from`.
fn taps(from: usize, to: usize) -> Vec<(usize, usize, f32)> {
    // In f32, as the official code has them: in f64 a mask's border differs by a pixel now and then.
    let scale = (from as f64 / to as f64) as f32;
    let tap = |i: usize| {
        let at = ((i as f32 + 0.5) * scale - 0.5).max(0.0);
        let low = (at as usize).min(from - 1);
        (low, (low + 1).min(from - 1), at - low as f32)
    };
    (0..to).map(tap).collect()
}

/// A plane of `from` = (width, height) px at the size `to`.
pub fn bilinear(plane: &[f32], from: (usize, usize), to: (usize, usize)) -> Vec<f32> {
    if from == to {
        return plane.to_vec();
    }
    let (columns, rows) = (taps(from.0, to.0), taps(from.1, to.1));
    let mut out = vec![0.0; to.0 * to.1];
    out.par_chunks_exact_mut(to.0.max(1)).with_min_len(32).zip(&rows).for_each(|(line, &(low, high, share))| {
        let (a, b) = (&plane[low * from.0..], &plane[high * from.0..]);
        for (value, &(left, right, part)) in line.iter_mut().zip(&columns) {
            let across = |row: &[f32]| row[left] * (1.0 - part) + row[right] * part;
            *value = across(a) * (1.0 - share) + across(b) * share;
        }
    });
    out
}

/// A network's plane of logits, `low` px a side, at the size of the picture that lies in its square
/// of `side` px as `fit` says.
pub fn enlarge(plane: &[f32], low: usize, side: usize, fit: Side, to: (usize, usize)) -> Vec<f32> {
    if fit != Side::Longer {
        return bilinear(plane, (low, low), to);
    }
    // The rest of the square is empty.
    let scale = side as f64 / to.0.max(to.1) as f64;
    let used = |n: usize| ((n as f64 * scale + 0.5) as usize).clamp(1, side);
    let (w, h) = (used(to.0), used(to.1));
    let full = bilinear(plane, (low, low), (side, side));
    let cut: Vec<f32> = full.chunks_exact(side).take(h).flat_map(|row| row[..w].iter().copied()).collect();
    bilinear(&cut, (w, h), to)
}

/// A mask of a picture as a square of `side` px: the mean of the pixels under each.
pub fn shrink(plane: &[f32], from: (usize, usize), side: usize) -> Vec<f32> {
    let (columns, rows) = (triangle(from.0, side), triangle(from.1, side));
    let wide: Vec<Vec<f32>> = plane
        .chunks_exact(from.0.max(1))
        .map(|row| columns.iter().map(|tap| weighted(tap, |i| row[i])).collect())
        .collect();
    let line = |tap: &Tap| (0..side).map(|x| weighted(tap, |i| wide[i][x])).collect::<Vec<f32>>();
    rows.iter().flat_map(line).collect()
}

/// First input pixel, and weights from it on.
type Tap = (usize, Vec<f32>);

fn weighted(tap: &Tap, value: impl Fn(usize) -> f32) -> f32 {
    tap.1.iter().enumerate().map(|(k, w)| w * value(tap.0 + k)).sum()
}

/// A triangle filter that grows with the shrinkage.
fn triangle(from: usize, to: usize) -> Vec<Tap> {
    let scale = from as f64 / to as f64;
    let reach = scale.max(1.0);
    let tap = |i: usize| {
        let centre = (i as f64 + 0.5) * scale;
        let first = (centre - reach).floor().max(0.0) as usize;
        let end = ((centre + reach).ceil() as usize).min(from);
        let weights: Vec<f64> =
            (first..end).map(|j| (1.0 - ((j as f64 + 0.5 - centre) / reach).abs()).max(0.0)).collect();
        let sum: f64 = weights.iter().sum();
        (first, weights.iter().map(|w| (w / sum) as f32).collect())
    };
    (0..to).map(tap).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_keep_their_value_and_middles_are_mixed() {
        let out = bilinear(&[0.0, 4.0], (2, 1), (4, 1));
        assert_eq!(out, [0.0, 1.0, 3.0, 4.0]);
        assert_eq!(bilinear(&out, (4, 1), (4, 1)), out);
        assert_eq!(bilinear(&[7.0], (1, 1), (3, 2)), [7.0; 6]);
    }

    #[test]
    fn a_wide_picture_uses_the_upper_part_of_the_square() {
        // 8 x 4 px in a square of 8: the lower half of the logits is of nothing.
        let plane: Vec<f32> = (0..16).map(|i| if i / 4 < 2 { 1.0 } else { -9.0 }).collect();
        let out = enlarge(&plane, 4, 8, Side::Longer, (8, 4));
        assert!(out[..24].iter().all(|v| *v == 1.0), "{out:?}");
        assert!(enlarge(&plane, 4, 8, Side::Both, (8, 4))[24..].iter().all(|v| *v == -9.0));
    }

    #[test]
    fn shrinking_takes_means() {
        let plane: Vec<f32> = (0..64).map(|i| if i % 8 < 4 { 1.0 } else { 0.0 }).collect();
        let out = shrink(&plane, (8, 8), 2);
        assert!(out[0] > 0.8 && out[1] < 0.2 && (out[0] + out[1] - 1.0).abs() < 1e-6, "{out:?}");
    }
}
