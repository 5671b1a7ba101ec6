//! Filters of LangSplat's smoothing: the mean over a box, and the majority of a neighborhood. Both keep sums of columns,
//! band by band of rows.

use std::ops::Range;

use rayon::prelude::*;

use super::side_by_side;
use crate::scene::Mask;

/// Side of the box, px.
const BOX: usize = 30;
/// Half the side of the majority's window, px.
const MAJORITY: usize = 3;
/// Rows of a band: its first row costs as much as [`BOX`] others.
const BAND: usize = 96;
/// Rows of a task of the majority.
const ROWS: usize = 32;

/// Relevancy of the pixels of a level, and what stands where it is 0.
#[derive(Clone, Copy)]
pub(super) struct SmoothedLevel<'a> {
    pub(super) relevancy: &'a [f32],
    pub(super) of_nothing: f32,
}

/// Largest values of a level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SmoothedPeak {
    /// Largest smoothed value.
    pub(super) value: f32,
    /// Largest mean of a window.
    pub(super) mean: f32,
    /// Pixel of that mean, the first of equal ones.
    pub(super) at: usize,
}

impl SmoothedPeak {
    const NONE: Self = Self { value: f32::NEG_INFINITY, mean: f32::NEG_INFINITY, at: 0 };

    fn add(&mut self, other: Self) {
        self.value = self.value.max(other.value);
        if other.mean > self.mean {
            (self.mean, self.at) = (other.mean, other.at);
        }
    }
}

impl SmoothedLevel<'_> {
    /// Smooths without keeping the values.
    pub(super) fn peak(self, w: usize, h: usize) -> SmoothedPeak {
        let band = |band: usize| {
            let first = band * BAND;
            let mut peak = SmoothedPeak::NONE;
            self.smooth(first..h.min(first + BAND), [w, h], |y, line, means| {
                let [mean, value] = [means, line].map(|v| side_by_side(v)[1]);
                if mean > peak.mean {
                    let x = means.iter().position(|m| *m == mean).unwrap_or(0);
                    (peak.mean, peak.at) = (mean, y * w + x);
                }
                peak.value = peak.value.max(value);
            });
            peak
        };
        let count = if self.relevancy.is_empty() { 0 } else { h.div_ceil(BAND) };
        let bands: Vec<SmoothedPeak> = (0..count).into_par_iter().map(band).collect();
        bands.into_iter().fold(SmoothedPeak::NONE, |mut most, peak| {
            most.add(peak);
            most
        })
    }

    /// Returns the mean of each pixel and of the window around it: x-15..x+14, edges mirrored without repeating the
    /// outermost pixel.
    pub(super) fn values(self, w: usize, h: usize) -> Vec<f32> {
        let mut out = vec![0.0; w * h];
        out.par_chunks_mut((BAND * w).max(1)).enumerate().for_each(|(band, out)| {
            let first = band * BAND;
            let rows = first..first + out.len() / w;
            self.smooth(rows, [w, h], |y, line, _| out[(y - first) * w..(y - first + 1) * w].copy_from_slice(line));
        });
        out
    }

    /// Smooths rows; `each` gets a row's number, its values, and its means.
    fn smooth(self, rows: Range<usize>, [w, h]: [usize; 2], mut each: impl FnMut(usize, &[f32], &[f32])) {
        let half = BOX / 2;
        let filled = |v: f32| if v == 0.0 { self.of_nothing } else { v };
        let row = |y: isize| {
            let from = mirrored(y, h) * w;
            &self.relevancy[from..from + w]
        };
        // Sums of columns over the rows of the window, with mirrored ones before and after.
        let mut columns = vec![0.0_f64; w + BOX - 1];
        let before: Vec<usize> = (0..half).map(|k| mirrored(k as isize - half as isize, w)).collect();
        let after: Vec<usize> = (0..half - 1).map(|k| mirrored((w + k) as isize, w)).collect();
        let (mut line, mut means) = (vec![0.0; w], vec![0.0; w]);
        for (number, y) in rows.enumerate() {
            let (middle, half_rows) = (y as isize, half as isize);
            let own = &mut columns[half..half + w];
            if number == 0 {
                for dy in -half_rows..half_rows {
                    own.iter_mut().zip(row(middle + dy)).for_each(|(sum, v)| *sum += f64::from(filled(*v)));
                }
            } else {
                let pairs = row(middle + half_rows - 1).iter().zip(row(middle - half_rows - 1));
                let change = |(new, old): (&f32, &f32)| f64::from(filled(*new)) - f64::from(filled(*old));
                own.iter_mut().zip(pairs).for_each(|(sum, pair)| *sum += change(pair));
            }
            before.iter().enumerate().for_each(|(k, from)| columns[k] = columns[half + from]);
            after.iter().enumerate().for_each(|(k, from)| columns[half + w + k] = columns[half + from]);
            let mut sum: f64 = columns[..BOX - 1].iter().sum();
            let mut last = 0.0;
            for (x, mean) in means.iter_mut().enumerate() {
                sum += columns[x + BOX - 1] - last;
                last = columns[x];
                *mean = (sum / (BOX * BOX) as f64) as f32;
            }
            let pixels = row(middle).iter().zip(&means);
            line.iter_mut().zip(pixels).for_each(|(out, (v, mean))| *out = 0.5 * (mean + filled(*v)));
            each(y, &line, &means);
        }
    }
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
    let widths: Vec<u8> = (0..w).map(|x| around(x, w).len() as u8).collect();
    let mut kept = vec![0_u8; w * h];
    kept.par_chunks_mut((ROWS * w).max(1)).enumerate().for_each(|(task, kept)| {
        let (first, count) = (task * ROWS, kept.len() / w);
        let (top, end) = (around(first, h).start, around(first + count - 1, h).end);
        let flags: Vec<u8> = (top * w..end * w).map(|i| u8::from(inside(i))).collect();
        // Numbers of pixels in columns of the window; none outside of the picture.
        let mut columns = vec![0_u8; w + 2 * MAJORITY];
        for (k, kept) in kept.chunks_exact_mut(w).enumerate() {
            let rows = around(first + k, h);
            let height = rows.len() as u8;
            let own = &mut columns[MAJORITY..MAJORITY + w];
            own.fill(0);
            for y in rows {
                let flags = &flags[(y - top) * w..(y - top + 1) * w];
                own.iter_mut().zip(flags).for_each(|(count, flag)| *count += flag);
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
            let level = SmoothedLevel { relevancy: &v, of_nothing: 0.0 };
            let (values, peak) = (level.values(size[0], size[1]), level.peak(size[0], size[1]));
            assert_eq!(peak.value, values.iter().copied().fold(0.0, f32::max));
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
        let nothing = SmoothedLevel { relevancy: &[], of_nothing: 0.0 };
        assert_eq!((nothing.values(0, 0), nothing.peak(0, 9)), (Vec::new(), SmoothedPeak::NONE));
    }

    #[test]
    fn what_is_nothing_is_filled_before_it_is_smoothed() {
        let [w, h] = SIZES[1];
        let bare: Vec<f32> = picture([w, h]).into_iter().map(|v| if v < 0.3 { 0.0 } else { v }).collect();
        let filled: Vec<f32> = bare.iter().map(|v| if *v == 0.0 { 0.5 } else { *v }).collect();
        let both = |relevancy: &[f32], of_nothing: f32| {
            let level = SmoothedLevel { relevancy, of_nothing };
            (level.values(w, h), level.peak(w, h))
        };
        assert_eq!(both(&bare, 0.5), both(&filled, 0.0));
        assert_ne!(both(&bare, 0.0), both(&filled, 0.0), "the control: not filled");
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
