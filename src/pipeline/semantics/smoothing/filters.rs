//! Filters of LangSplat's smoothing: the mean over a box, and the majority of a neighborhood. Both keep sums of columns,
//! band by band of rows.

use rayon::prelude::*;

use crate::scene::Mask;

/// Side of the box, px.
const BOX: usize = 30;
/// Half the side of the majority's window, px.
const MAJORITY: usize = 3;
/// Rows of a band: its first row costs as much as [`BOX`] others.
const BAND: usize = 96;
/// Rows of a task of the majority.
const ROWS: usize = 32;

/// Largest mean of a level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MeanPeak {
    pub(super) mean: f32,
    /// Its pixel, the first of equal ones.
    pub(super) at: usize,
}

/// Returns the mean of each pixel and of the window around it (x-15..x+14, edges mirrored without repeating the outermost
/// pixel), and the largest mean of a window.
pub(super) fn smoothed(relevancy: &[f32], w: usize, h: usize) -> (Vec<f32>, MeanPeak) {
    let mut out = vec![0.0; w * h];
    let bands = out.par_chunks_mut((BAND * w).max(1)).enumerate();
    let peaks: Vec<MeanPeak> = bands.map(|(band, out)| smooth_band(relevancy, [w, h], band * BAND, out)).collect();
    let none = MeanPeak { mean: f32::NEG_INFINITY, at: 0 };
    (out, peaks.into_iter().fold(none, |most, peak| if peak.mean > most.mean { peak } else { most }))
}

/// Smooths the rows from `first` on.
fn smooth_band(relevancy: &[f32], [w, h]: [usize; 2], first: usize, out: &mut [f32]) -> MeanPeak {
    let half = BOX / 2;
    let row = |y: isize| {
        let from = mirrored(y, h) * w;
        &relevancy[from..from + w]
    };
    // Sums of columns over the rows of the window, with mirrored ones before and after.
    let mut columns = vec![0.0_f64; w + BOX - 1];
    let before: Vec<usize> = (0..half).map(|k| mirrored(k as isize - half as isize, w)).collect();
    let after: Vec<usize> = (0..half - 1).map(|k| mirrored((w + k) as isize, w)).collect();
    let mut peak = MeanPeak { mean: f32::NEG_INFINITY, at: first * w };
    for (k, out) in out.chunks_exact_mut(w).enumerate() {
        let (y, half_rows) = ((first + k) as isize, half as isize);
        let own = &mut columns[half..half + w];
        if k == 0 {
            for dy in -half_rows..half_rows {
                own.iter_mut().zip(row(y + dy)).for_each(|(sum, v)| *sum += f64::from(*v));
            }
        } else {
            let (new, old) = (row(y + half_rows - 1), row(y - half_rows - 1));
            own.iter_mut()
                .zip(new.iter().zip(old))
                .for_each(|(sum, (new, old))| *sum += f64::from(*new) - f64::from(*old));
        }
        before.iter().enumerate().for_each(|(k, from)| columns[k] = columns[half + from]);
        after.iter().enumerate().for_each(|(k, from)| columns[half + w + k] = columns[half + from]);
        let mut sum: f64 = columns[..BOX - 1].iter().sum();
        let (pixels, mut last) = (row(y), 0.0);
        for (x, (out, pixel)) in out.iter_mut().zip(pixels).enumerate() {
            sum += columns[x + BOX - 1] - last;
            last = columns[x];
            let mean = (sum / (BOX * BOX) as f64) as f32;
            *out = 0.5 * (mean + pixel);
            if mean > peak.mean {
                peak = MeanPeak { mean, at: (first + k) * w + x };
            }
        }
    }
    peak
}

/// Index `i` of `n`, mirrored at both ends.
fn mirrored(i: isize, n: usize) -> usize {
    let period = (2 * n as isize - 2).max(1);
    let i = i.rem_euclid(period);
    i.min(period - i).clamp(0, n as isize - 1) as usize
}

/// Pixels most of whose neighborhood of 7 x 7 px, as far as it is in the picture, is `inside`.
pub(super) fn majority(w: usize, h: usize, inside: impl Fn(usize) -> bool + Sync) -> Mask {
    let around = |at: usize, n: usize| at.saturating_sub(MAJORITY)..(at + MAJORITY + 1).min(n);
    let flags: Vec<u8> = (0..w * h).into_par_iter().with_min_len(1 << 14).map(|i| u8::from(inside(i))).collect();
    let widths: Vec<u8> = (0..w).map(|x| around(x, w).len() as u8).collect();
    let mut kept = vec![0_u8; w * h];
    kept.par_chunks_mut((ROWS * w).max(1)).enumerate().for_each(|(task, kept)| {
        // Numbers of pixels in columns of the window; none outside of the picture.
        let mut columns = vec![0_u8; w + 2 * MAJORITY];
        for (k, kept) in kept.chunks_exact_mut(w).enumerate() {
            let rows = around(task * ROWS + k, h);
            let height = rows.len() as u8;
            let own = &mut columns[MAJORITY..MAJORITY + w];
            own.fill(0);
            for y in rows {
                own.iter_mut().zip(&flags[y * w..(y + 1) * w]).for_each(|(count, flag)| *count += flag);
            }
            for from in 0..=2 * MAJORITY {
                kept.iter_mut().zip(&columns[from..]).for_each(|(count, column)| *count += column);
            }
            // At most 49 pixels, so that twice as many fit.
            kept.iter_mut().zip(&widths).for_each(|(count, width)| *count = u8::from(2 * *count > height * width));
        }
    });
    Mask::from_fn(w, h, |i| kept[i] == 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pictures of several bands and of one, one of them smaller than the windows.
    const SIZES: [[usize; 2]; 4] = [[41, 33], [67, 230], [5, 4], [1, 9]];

    fn picture([w, h]: [usize; 2]) -> Vec<f32> {
        (0..w * h).map(|i| ((i * 37) % 101) as f32 / 101.0).collect()
    }

    /// The mean over the window, added pixel by pixel.
    fn plain_mean(v: &[f32], [w, h]: [usize; 2], i: usize, before: isize) -> f64 {
        let (x, y) = ((i % w) as isize, (i / w) as isize);
        let window = || -before..BOX as isize - before;
        let of = |dx: isize, dy: isize| f64::from(v[mirrored(y + dy, h) * w + mirrored(x + dx, w)]);
        window().flat_map(|dy| window().map(move |dx| (dx, dy))).map(|(dx, dy)| of(dx, dy)).sum::<f64>() / 900.0
    }

    #[test]
    fn indices_are_mirrored_at_the_outermost_pixels() {
        let found: Vec<usize> = (-4..8).map(|i| mirrored(i, 4)).collect();
        assert_eq!(found, [2, 3, 2, 1, 0, 1, 2, 3, 2, 1, 0, 1]);
        assert_eq!((mirrored(-15, 1), mirrored(14, 1)), (0, 0));
    }

    #[test]
    fn sums_of_columns_are_the_plain_mean() {
        for size in SIZES {
            let v = picture(size);
            let (values, peak) = smoothed(&v, size[0], size[1]);
            let plain = |before: isize| -> Vec<f64> { (0..v.len()).map(|i| plain_mean(&v, size, i, before)).collect() };
            let apart = |means: &[f64]| {
                let one = |i: usize| (f64::from(values[i]) - 0.5 * (means[i] + f64::from(v[i]))).abs();
                (0..v.len()).map(one).fold(0.0, f64::max)
            };
            let means = plain(15);
            assert!(apart(&means) < 1e-6, "{size:?}: {}", apart(&means));
            let most = means.iter().copied().fold(0.0, f64::max);
            assert!((f64::from(peak.mean) - most).abs() < 1e-6 && (means[peak.at] - most).abs() < 1e-6, "{size:?}");
            if size[0] > BOX {
                assert!(apart(&plain(14)) > 1e-4, "the control: a window that lies one pixel further");
            }
        }
        assert_eq!(smoothed(&[], 0, 0).0, [0.0_f32; 0]);
    }

    #[test]
    fn counts_of_columns_are_the_plain_majority() {
        for [w, h] in SIZES {
            // Rings, wide in the middle and ever narrower.
            let inside = |i: usize| ((i % w).pow(2) + 3 * (i / w).pow(2)) % 97 < 48;
            let plain = |half: usize| {
                Mask::from_fn(w, h, |i| {
                    let around = |at: usize, n: usize| at.saturating_sub(half)..(at + half + 1).min(n);
                    let (xs, ys) = (around(i % w, w), around(i / w, h));
                    let all = xs.len() * ys.len();
                    let found: usize = ys.map(|y| xs.clone().filter(|x| inside(y * w + x)).count()).sum();
                    2 * found > all
                })
            };
            assert_eq!(majority(w, h, inside), plain(MAJORITY), "{w} x {h}");
            if w > BOX {
                assert_ne!(majority(w, h, inside), plain(MAJORITY - 1), "the control: a smaller window");
            }
        }
    }
}
