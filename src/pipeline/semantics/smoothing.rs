//! LangSplat's smoothing and cut of relevancy, which many methods are evaluated with.
//!
//! `avg` = 30 x 30 box filter (window x-15..x+14, edges mirrored); `v = (avg + relevancy) / 2`; `o` =
//! `v` scaled to 0..1, then `clip(2 o - 1, 0, 1)`; mask = `o > 0.4`, then a 7 x 7 majority. Of several levels, that of
//! the largest value counts. Beside it, the common rule, which smooths nothing.

use super::relevancy::{LERFS_SHARE, on_lerfs_scale};
use crate::scene::Mask;

/// LangSplat's rule in words.
pub(crate) const BY_SMOOTHING: &str = "smoothed by 30 px, normalized, over 0.4; level of the largest value";
/// The common rule in words.
pub(crate) const BY_COMMON_RULE: &str = "over 20 % of LERF's scale; level of the largest relevancy";

/// Side of the box filter, px.
const BOX: usize = 30;
/// Half the side of the majority filter, px.
const MAJORITY: usize = 3;
/// Cut of the normalized relevancy.
const CUT: f32 = 0.4;

/// Mask of the level that decides.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LeveledMask {
    pub(crate) mask: Mask,
    pub(crate) level: usize,
    /// Values that were cut, row-major, 0 to 1.
    pub(crate) values: Vec<f32>,
    /// Pixel that is pointed at.
    pub(crate) peak: Option<usize>,
}

/// Cuts relevancy by LangSplat's rule; `None` without a level. The largest mean is pointed at.
pub(crate) fn by_smoothing(levels: &[Vec<f32>], w: usize, h: usize) -> Option<LeveledMask> {
    let (means, mut values): (Vec<_>, Vec<_>) = levels.iter().map(|r| smoothed(r, w, h)).unzip();
    let (level, by_mean) = (largest_level(&values)?, largest_level(&means)?);
    let values = values.swap_remove(level);
    Some(LeveledMask { mask: cut(&values, w, h), level, peak: peak(&means[by_mean]), values: normalized(values) })
}

/// Cuts relevancy at a fifth of LERF's scale; `None` without a level. The largest relevancy is pointed at.
pub(crate) fn by_common_rule(levels: &[Vec<f32>], w: usize, h: usize) -> Option<LeveledMask> {
    let level = largest_level(levels)?;
    let relevancy = &levels[level];
    let most = largest(relevancy);
    let values: Vec<f32> = relevancy.iter().map(|r| on_lerfs_scale(*r, most)).collect();
    let mask = Mask::from_fn(w, h, |i| values[i] > LERFS_SHARE);
    let values = values.into_iter().map(|v| v.clamp(0.0, 1.0)).collect();
    Some(LeveledMask { mask, level, peak: peak(relevancy), values })
}

/// Index of the largest value, the first of equal ones.
pub(crate) fn peak(values: &[f32]) -> Option<usize> {
    (0..values.len()).max_by(|&a, &b| values[a].total_cmp(&values[b]).then(b.cmp(&a)))
}

/// Level with the largest value, the first of equal ones.
pub(crate) fn largest_level(levels: &[Vec<f32>]) -> Option<usize> {
    let most: Vec<f32> = levels.iter().map(|level| largest(level)).collect();
    peak(&most)
}

/// Upper half of the values between the least and the largest, as 0 to 1; zeros if they are all equal.
fn normalized(mut v: Vec<f32>) -> Vec<f32> {
    let (least, most) = v.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(l, m), x| (l.min(*x), m.max(*x)));
    let range = most - least;
    v.iter_mut().for_each(|x| *x = if range > 0.0 { (2.0 * (*x - least) / range - 1.0).clamp(0.0, 1.0) } else { 0.0 });
    v
}

/// Returns the mean around each pixel, and the mean of that and the pixel itself.
pub(crate) fn smoothed(relevancy: &[f32], w: usize, h: usize) -> (Vec<f32>, Vec<f32>) {
    let avg = box_filter(relevancy, w, h);
    let v = avg.iter().zip(relevancy).map(|(a, r)| 0.5 * (a + r)).collect();
    (avg, v)
}

/// The largest value; negative infinity if there is none.
pub(crate) fn largest(v: &[f32]) -> f32 {
    v.iter().copied().fold(f32::NEG_INFINITY, f32::max)
}

/// Returns the pixels whose normalized relevancy is over 0.4, without specks.
pub(crate) fn cut(v: &[f32], w: usize, h: usize) -> Mask {
    let (least, most) = v.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(l, m), x| (l.min(*x), m.max(*x)));
    if most.is_nan() || most <= least {
        return Mask::empty(w, h);
    }
    let kept = Mask::from_fn(w, h, |i| (2.0 * (v[i] - least) / (most - least) - 1.0).clamp(0.0, 1.0) > CUT);
    majority(&kept)
}

/// Mean over a window of [`BOX`] x [`BOX`], edges mirrored without repeating the outermost pixel.
fn box_filter(v: &[f32], w: usize, h: usize) -> Vec<f32> {
    let mirror = |i: isize, n: usize| -> usize {
        let period = (2 * n as isize - 2).max(1);
        let i = i.rem_euclid(period);
        i.min(period - i).clamp(0, n as isize - 1) as usize
    };
    let pass = |v: &[f64], w: usize, h: usize| -> Vec<f64> {
        // Along rows, written transposed.
        let mut out = vec![0.0; w * h];
        let half = (BOX / 2) as isize;
        for y in 0..h {
            let row = &v[y * w..(y + 1) * w];
            let mut sum: f64 = (-half..half).map(|k| row[mirror(k, w)]).sum();
            for x in 0..w as isize {
                out[x as usize * h + y] = sum / BOX as f64;
                sum += row[mirror(x + half, w)] - row[mirror(x - half, w)];
            }
        }
        out
    };
    let wide: Vec<f64> = v.iter().map(|x| f64::from(*x)).collect();
    pass(&pass(&wide, w, h), h, w).into_iter().map(|x| x as f32).collect()
}

/// Pixels most of whose neighborhood is in the mask.
fn majority(mask: &Mask) -> Mask {
    let (w, h) = (mask.width_px(), mask.height_px());
    Mask::from_fn(w, h, |i| {
        let (x, y) = (i % w, i / w);
        let (xs, ys) = (
            x.saturating_sub(MAJORITY)..(x + MAJORITY + 1).min(w),
            y.saturating_sub(MAJORITY)..(y + MAJORITY + 1).min(h),
        );
        let all = xs.len() * ys.len();
        let inside: usize = ys.map(|y| xs.clone().filter(|x| mask.contains(y * w + x)).count()).sum();
        2 * inside > all
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fifth_of_the_way_to_the_largest_is_cut_off() {
        // The scale goes from 0.5 to 0.7, the cut is at 0.54.
        let found = by_common_rule(&[vec![0.2, 0.5, 0.53, 0.55, 0.7, 0.69]], 3, 2).expect("a level");
        assert_eq!(found.mask.pixels().collect::<Vec<_>>(), [3, 4, 5]);
        assert_eq!((found.peak, found.values[0], found.values[4]), (Some(4), 0.0, 1.0));
        let mask = |values: [f32; 2]| by_common_rule(&[values.to_vec()], 2, 1).expect("a level").mask;
        assert!(mask([0.5, 0.1]).is_empty(), "nothing is more relevant than a canonical phrase");
        assert!(mask([f32::NAN, f32::NAN]).is_empty());
        assert!(by_common_rule(&[], 2, 1).is_none() && by_smoothing(&[], 2, 1).is_none());
        assert_eq!(peak(&[0.6, 0.6]), Some(0));
    }

    #[test]
    fn the_level_of_the_largest_value_is_smoothed_and_cut() {
        let (w, h) = (64, 48);
        let block = |x0: usize, height: f32| -> Vec<f32> {
            (0..w * h).map(|i| if (x0..x0 + 20).contains(&(i % w)) && i / w >= 24 { height } else { 0.3 }).collect()
        };
        let found = by_smoothing(&[block(4, 0.6), block(40, 0.9)], w, h).expect("a level");
        assert_eq!(found.level, 1);
        assert!(found.mask.contains(40 * w + 50) && !found.mask.contains(40 * w + 10));
        assert!(found.peak.is_some_and(|at| at % w >= 40 && at / w >= 24), "{:?}", found.peak);
        assert!(found.values.iter().all(|v| (0.0..=1.0).contains(v)) && found.values.contains(&1.0));
        let other = by_smoothing(&[block(4, 0.9), block(40, 0.6)], w, h).expect("a level");
        assert_eq!(other.level, 0, "the control: levels exchanged");
        assert!(by_smoothing(&[vec![0.5; w * h]], w, h).expect("a level").mask.is_empty());
    }

    #[test]
    fn the_box_filter_is_a_mean_with_mirrored_edges() {
        let (w, h) = (41, 33);
        let v: Vec<f32> = (0..w * h).map(|i| ((i * 37) % 101) as f32).collect();
        let got = box_filter(&v, w, h);
        let mirror = |i: i64, n: usize| {
            let i = i.abs();
            if i >= n as i64 { 2 * n as i64 - 2 - i } else { i }
        };
        for (x, y) in [(0, 0), (20, 16), (40, 32), (3, 30)] {
            let mut sum = 0.0;
            for dy in -15..15_i64 {
                for dx in -15..15_i64 {
                    sum += v[(mirror(y + dy, h) * w as i64 + mirror(x + dx, w)) as usize];
                }
            }
            let at = got[y as usize * w + x as usize];
            assert!((at - sum / 900.0).abs() < 1e-3, "{x} {y}: {at} {}", sum / 900.0);
        }
    }
}
