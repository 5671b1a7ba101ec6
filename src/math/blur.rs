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
    fn a_point_becomes_a_round_blob_of_its_weight() {
        let mut point = vec![0.0; 21 * 21];
        point[220] = 1.0;
        let blob = blur(&point, 21, 1.5);
        assert!((blob.iter().sum::<f32>() - 1.0).abs() < 1e-5, "{blob:?}");
        let peak = 1.0 / (std::f32::consts::TAU * 1.5 * 1.5);
        assert!((blob[220] - peak).abs() < 0.02 * peak, "{} {peak}", blob[220]);
        let mirrored = |i: usize| i % 21 * 21 + i / 21;
        assert!((0..441).all(|i| (blob[i] - blob[mirrored(i)]).abs() < 1e-7));
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
