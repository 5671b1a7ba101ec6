//! LangSplat's smoothing and cut of relevancy, which many methods are evaluated with.
//!
//! `avg` = 30 x 30 box filter (window x-15..x+14, edges mirrored); `v = (avg + relevancy) / 2`; `o` =
//! `v` scaled to 0..1, then `clip(2 o - 1, 0, 1)`; mask = `o > 0.4`, then a 7 x 7 majority. Of several levels, that of
//! the largest value counts. Beside it, the common rule, which smooths nothing.

mod filters;

use rayon::prelude::*;

use self::filters::{SmoothedLevel, SmoothedPeak, majority};
use super::relevancy::{LERFS_SHARE, on_lerfs_scale};
use crate::scene::Mask;

/// LangSplat's rule in words.
pub(crate) const BY_SMOOTHING: &str = "smoothed by 30 px, normalized, over 0.4; level of the largest value";
/// The common rule in words.
pub(crate) const BY_COMMON_RULE: &str = "over 20 % of LERF's scale; level of the largest relevancy";

/// Cut of the normalized relevancy.
const CUT: f32 = 0.4;
/// Pixels of a task.
const PART: usize = 1 << 14;
/// Pixels that are compared side by side.
const WIDE: usize = 16;

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
    by_smoothing_filled(levels, &vec![0.0; levels.len()], w, h)
}

/// As [`by_smoothing`], with what stands in each level where relevancy is 0.
pub(crate) fn by_smoothing_filled(levels: &[Vec<f32>], of_nothing: &[f32], w: usize, h: usize) -> Option<LeveledMask> {
    let inputs = levels.iter().zip(of_nothing);
    let inputs: Vec<SmoothedLevel<'_>> =
        inputs.map(|(relevancy, of_nothing)| SmoothedLevel { relevancy, of_nothing: *of_nothing }).collect();
    // Only one level is kept: memory that is written for the first time takes longer than another pass.
    let peaks: Vec<SmoothedPeak> = inputs.par_iter().map(|level| level.peak(w, h)).collect();
    let level = peak(&peaks.iter().map(|p| p.value).collect::<Vec<_>>())?;
    let by_mean = peak(&peaks.iter().map(|p| p.mean).collect::<Vec<_>>())?;
    let mut values = inputs[level].values(w, h);
    normalize(&mut values);
    let mask = majority(w, h, |i| values[i] > CUT);
    Some(LeveledMask { mask, level, peak: Some(peaks[by_mean].at).filter(|at| *at < values.len()), values })
}

/// Cuts relevancy at a fifth of LERF's scale; `None` without a level. The largest relevancy is pointed at.
pub(crate) fn by_common_rule(levels: &[Vec<f32>], w: usize, h: usize) -> Option<LeveledMask> {
    let level = largest_level(levels)?;
    let relevancy = &levels[level];
    let most = largest(relevancy);
    let value = |r: &f32| on_lerfs_scale(*r, most).clamp(0.0, 1.0);
    let values: Vec<f32> = relevancy.par_iter().with_min_len(PART).map(value).collect();
    let mask = Mask::from_fn(w, h, |i| values[i] > LERFS_SHARE);
    Some(LeveledMask { mask, level, peak: peak(relevancy), values })
}

/// Index of the largest value, the first of equal ones.
pub(crate) fn peak(values: &[f32]) -> Option<usize> {
    // Whole numbers in the order of `total_cmp`.
    let place = |v: &f32| {
        let bits = v.to_bits() as i32;
        bits ^ ((bits >> 31) as u32 >> 1) as i32
    };
    let of_part = |part: &[f32]| part.iter().map(place).fold(i32::MIN, i32::max);
    let most = values.par_chunks(PART).map(of_part).max()?;
    values.par_iter().with_min_len(PART).position_first(|v| place(v) == most)
}

/// Level with the largest value, the first of equal ones.
pub(crate) fn largest_level(levels: &[Vec<f32>]) -> Option<usize> {
    let most: Vec<f32> = levels.iter().map(|level| largest(level)).collect();
    peak(&most)
}

/// Makes the upper half of the values between the least and the largest 0 to 1; zeros if they are all equal.
fn normalize(v: &mut [f32]) {
    let [least, most] = range(v);
    let range = most - least;
    let one = |x: &mut f32| *x = if range > 0.0 { (2.0 * (*x - least) / range - 1.0).clamp(0.0, 1.0) } else { 0.0 };
    v.par_iter_mut().with_min_len(PART).for_each(one);
}

/// The largest value; negative infinity if there is none.
pub(crate) fn largest(v: &[f32]) -> f32 {
    range(v)[1]
}

/// The least and the largest value; infinities if there is none.
fn range(v: &[f32]) -> [f32; 2] {
    let both = |a: [f32; 2], b: [f32; 2]| [lower(a[0], b[0]), higher(a[1], b[1])];
    v.par_chunks(PART).map(side_by_side).reduce(|| [f32::INFINITY, f32::NEG_INFINITY], both)
}

/// The range of a part. Values are compared many side by side, for one alone would wait for itself at every step.
fn side_by_side(part: &[f32]) -> [f32; 2] {
    let (mut least, mut most) = ([f32::INFINITY; WIDE], [f32::NEG_INFINITY; WIDE]);
    let (whole, rest) = part.as_chunks::<WIDE>();
    for some in whole {
        for k in 0..WIDE {
            least[k] = lower(least[k], some[k]);
            most[k] = higher(most[k], some[k]);
        }
    }
    for v in rest {
        least[0] = lower(least[0], *v);
        most[0] = higher(most[0], *v);
    }
    [least.into_iter().fold(f32::INFINITY, lower), most.into_iter().fold(f32::NEG_INFINITY, higher)]
}

/// The smaller number; the first if the second is NaN.
fn lower(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

/// The larger number; the first if the second is NaN.
fn higher(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
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
        assert_eq!((peak(&[0.6, 0.6]), peak(&[])), (Some(0), None));
    }

    #[test]
    fn many_values_are_compared_like_a_few() {
        let mut values: Vec<f32> = (0..3 * PART + 5).map(|i| ((i * 7919) % 10_007) as f32 * 1e-4 - 0.4).collect();
        let plain = |values: &[f32]| {
            let peak = (0..values.len()).max_by(|&a, &b| values[a].total_cmp(&values[b]).then(b.cmp(&a)));
            let range = [
                values.iter().copied().fold(f32::INFINITY, f32::min),
                values.iter().copied().fold(f32::NEG_INFINITY, f32::max),
            ];
            (peak, range)
        };
        let before = plain(&values);
        assert_eq!((peak(&values), range(&values)), before);
        for (at, v) in [(2 * PART + 3, 0.7), (3 * PART + 4, 0.8), (40, 0.8), (7, -9.0), (8, f32::NAN)] {
            values[at] = v;
            assert_eq!((peak(&values), range(&values)), plain(&values), "{v} at {at}");
        }
        assert_ne!((peak(&values), range(&values)), before, "the control: other values");
        assert_eq!((range(&[]), peak(&[-0.0, 0.0])), ([f32::INFINITY, f32::NEG_INFINITY], Some(1)));
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
}
