//! Time of a stroke that selects Gaussians or corrects a selection.

use serde::Serialize;

use super::super::table::{Rows, rows};
use super::query::Percentiles;
use crate::math::stats::quantile;
use crate::scene::Mask;

/// Half of a stroke's width, px.
const RADIUS_PX: usize = 3;

#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct StrokesTiming {
    pub(crate) name: String,
    pub(crate) gaussians: usize,
    /// Seconds from the first stroke to its answer, which makes everything ready.
    pub(crate) first_secs: f64,
    /// Strokes after that.
    pub(crate) strokes: usize,
    /// From a stroke to what the scene's objects would be with it.
    #[serde(flatten)]
    pub(crate) stroke: Percentiles,
}

impl StrokesTiming {
    /// Of the seconds that the first stroke and each one after it took.
    pub(crate) fn new(name: &str, gaussians: usize, secs: &[f64]) -> Self {
        let (first, after) = secs.split_first().map_or((f64::NAN, &[][..]), |(first, after)| (*first, after));
        let ms: Vec<f64> = after.iter().map(|s| 1e3 * s).collect();
        let stroke = Percentiles { p50_ms: quantile(&ms, 0.5), p95_ms: quantile(&ms, 0.95) };
        Self { name: name.to_owned(), gaussians, first_secs: first, strokes: after.len(), stroke }
    }

    pub(super) fn table(all: &[Self]) -> Rows {
        let head = ["selecting by strokes", "Gaussians", "first s", "strokes", "p50 ms", "p95 ms"];
        let row = |t: &Self| {
            let times = [t.stroke.p50_ms, t.stroke.p95_ms].map(|ms| format!("{ms:.0}"));
            let row = [t.name.clone(), t.gaussians.to_string(), format!("{:.1}", t.first_secs), t.strokes.to_string()];
            [row.to_vec(), times.to_vec()].concat()
        };
        rows(&head, all.iter().map(row))
    }
}

/// The stroke number `k` in a view: level lines at changing places and of changing lengths.
pub(crate) fn stroke(k: usize, [w, h]: [usize; 2]) -> Mask {
    // Steps of the golden ratio spread evenly.
    let part = |step: f64| ((k + 1) as f64 * step).fract();
    let y = ((0.2 + 0.6 * part(0.618_034)) * h as f64) as usize;
    let x = ((0.2 + 0.5 * part(0.754_878)) * w as f64) as usize;
    let end = x + ((0.02 + 0.13 * part(0.569_84)) * w as f64) as usize;
    Mask::from_fn(w, h, |i| (x..=end).contains(&(i % w)) && (i / w).abs_diff(y) <= RADIUS_PX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strokes_lie_inside_and_the_first_is_counted_apart() {
        let all: Vec<Mask> = (0..50).map(|k| stroke(k, [640, 480])).collect();
        assert!(all.iter().all(|m| (7 * 12..7 * 100).contains(&m.area())), "{:?}", all[0].area());
        assert!(all.windows(2).all(|two| two[0].iou(&two[1]) < 0.5));
        let timing = StrokesTiming::new("a", 3, &[4.0, 0.02, 0.01, 0.03]);
        assert_eq!((timing.first_secs, timing.strokes, timing.stroke.p50_ms), (4.0, 3, 20.0));
        let row = &StrokesTiming::table(&[timing])[1];
        assert_eq!(row[..5], ["a", "3", "4.0", "3", "20"].map(str::to_owned));
    }
}
