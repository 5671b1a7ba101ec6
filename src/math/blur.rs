//! Gaussian blur of a plane.

use rayon::prelude::*;

use super::vector::add_scaled;

/// Blurs a plane, row by row, by a Gaussian of a standard deviation in px; the border pixels repeat.
pub(crate) fn blur(plane: &[f32], width: usize, sigma_px: f32) -> Vec<f32> {
    let reach = (3.0 * sigma_px).ceil() as usize;
    let weight = |k: usize| (-0.5 * ((k as f32 - reach as f32) / sigma_px).powi(2)).exp();
    let weights: Vec<f32> = (0..=2 * reach).map(weight).collect();
    let sum: f32 = weights.iter().sum();
    let Some(height) = plane.len().checked_div(width).filter(|h| *h > 0) else { return plane.to_vec() };
    let mut rows = vec![0.0; width * height];
    rows.par_chunks_mut(width).zip(plane.par_chunks(width)).for_each(|(out, row)| {
        let mut padded = vec![row[0]; reach];
        padded.extend(row);
        padded.extend(vec![row[width - 1]; reach]);
        weights.iter().enumerate().for_each(|(k, w)| add_scaled(out, &padded[k..k + width], w / sum));
    });
    let mut out = vec![0.0; width * height];
    out.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        for (k, w) in weights.iter().enumerate() {
            let from = (y + k).saturating_sub(reach).min(height - 1) * width;
            add_scaled(out, &rows[from..from + width], w / sum);
        }
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_blur_is_the_weighted_sum_of_each_row_and_column() {
        let (width, height, sigma) = (23, 9, 1.6_f32);
        let plane: Vec<f32> = (0..width * height).map(|i| (i * 7919 % 101) as f32).collect();
        let reach = (3.0 * sigma).ceil() as isize;
        let weight = |d: isize| (-0.5 * (d as f32 / sigma).powi(2)).exp();
        let all: f32 = (-reach..=reach).map(weight).sum();
        let at = |x: isize, y: isize| {
            plane[y.clamp(0, height as isize - 1) as usize * width + x.clamp(0, width as isize - 1) as usize]
        };
        let row = |x: isize, y: isize| (-reach..=reach).map(|d| weight(d) / all * at(x + d, y)).sum::<f32>();
        let both = |x: isize, y: isize| (-reach..=reach).map(|d| weight(d) / all * row(x, y + d)).sum::<f32>();
        let found = blur(&plane, width, sigma);
        for (i, v) in found.iter().enumerate() {
            let expected = both((i % width) as isize, (i / width) as isize);
            assert!((v - expected).abs() < 1e-3, "{i}: {v} {expected}");
        }
        let far = found.iter().zip(&plane).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(far > 10.0, "the control: it is blurred");
        // Narrower than the blur.
        assert_eq!(blur(&[3.0; 8], 2, sigma).len(), 8);
        assert!(blur(&[3.0; 8], 2, sigma).iter().all(|v| (v - 3.0).abs() < 1e-5));
    }

    #[test]
    fn the_border_goes_on_and_nothing_has_no_blur() {
        assert!(blur(&[0.25; 10], 5, 2.0).iter().all(|v| (v - 0.25).abs() < 1e-6));
        // The control: a slope is flatter at its ends.
        let slope: Vec<f32> = (0..10).map(|x| x as f32).collect();
        let soft = blur(&slope, 10, 1.0);
        assert!(soft[0] > 0.1 && (soft[5] - 5.0).abs() < 1e-5, "{soft:?}");
        assert!(blur(&[], 0, 1.0).is_empty() && blur(&[], 4, 1.0).is_empty());
    }
}
