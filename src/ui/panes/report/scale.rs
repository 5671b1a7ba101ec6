//! Logarithmic axes for a plot that has none: places are decimal logarithms, marks are where they are
//! expected.

use std::ops::RangeInclusive;

use egui_plot::GridMark;

use crate::measure::plot;
use crate::measure::{Measure, Point, Sample};

/// Spans of fewer decades than this get evenly spaced marks, as on a common axis.
const SMALL: f64 = 0.5;

/// Where a point is: decimal logarithms of seconds and error.
pub(crate) fn place(point: &Point, measure: &Measure) -> Option<[f64; 2]> {
    plot::place(point, measure).map(|(secs, error)| [secs.log10(), error.log10()])
}

/// The ends of a point's whiskers: least and most time at its error, least and most error at its time.
pub(crate) fn whiskers(point: &Point, measure: &Measure) -> Option<[[[f64; 2]; 2]; 2]> {
    let [x, y] = place(point, measure)?;
    let at_secs = |s: f64| [s.max(1e-9).log10(), y];
    let at_value = |v: f64| [x, measure.error(v).max(plot::LEAST).log10()];
    let Sample { least, most, .. } = point.values.get(&measure.name)?;
    Some([[at_secs(point.secs.least), at_secs(point.secs.most)], [at_value(*least), at_value(*most)]])
}

/// Marks of an axis from `low` to `high`, both logarithms.
pub(crate) fn marks((low, high): (f64, f64)) -> Vec<GridMark> {
    if !(low.is_finite() && high.is_finite() && low < high && high - low < 100.0) {
        return Vec::new();
    }
    if high - low < SMALL {
        return even(low, high);
    }
    let mut marks = Vec::new();
    for decade in low.floor() as i32..=high.ceil() as i32 {
        for digit in 1..10 {
            let value = f64::from(decade) + f64::from(digit).log10();
            let step_size = match digit {
                1 => 1.0,
                2 | 5 => 0.3,
                _ => 0.08,
            };
            marks.push(GridMark { value, step_size });
        }
    }
    marks.retain(|m| (low..=high).contains(&m.value));
    marks
}

/// About six marks at round values.
fn even(low: f64, high: f64) -> Vec<GridMark> {
    let (from, to) = (10.0_f64.powf(low), 10.0_f64.powf(high));
    let rough = (to - from) / 6.0;
    let power = 10.0_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|k| k * power).into_iter().find(|s| *s >= rough).unwrap_or(rough);
    let (first, last) = ((from / step).ceil() as i64, (to / step).floor() as i64);
    let step_size = (high - low) / 6.0;
    (first..=last).map(|k| GridMark { value: (k as f64 * step).log10(), step_size }).collect()
}

/// The text of a mark; empty where there is no room for one.
pub(crate) fn label(mark: GridMark, range: &RangeInclusive<f64>, text: impl Fn(f64) -> String) -> String {
    let span = range.end() - range.start();
    let least = if span < SMALL {
        0.0
    } else if span < 2.0 {
        0.3
    } else {
        1.0
    };
    if mark.step_size < least { String::new() } else { text(10.0_f64.powf(mark.value)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::format::tick;
    use crate::measure::document::ErrorKind;

    fn point(secs: [f64; 3], values: [f64; 3]) -> Point {
        let mut p = Point::default();
        secs.iter().for_each(|s| p.secs.add(*s));
        let sample = p.values.entry("PSNR".into()).or_default();
        values.iter().for_each(|v| sample.add(*v));
        p
    }

    #[test]
    fn places_are_logarithms_of_time_and_error() {
        let psnr = Measure::new("PSNR", "dB", ErrorKind::Decibels, "");
        let p = point([0.1, 0.01, 1.0], [40.0, 20.0, 60.0]);
        assert_eq!(place(&p, &psnr), Some([-1.0, -2.0]), "40 dB are an error of a hundredth");
        let [time, error] = whiskers(&p, &psnr).expect("measured");
        assert_eq!(time, [[-2.0, -2.0], [0.0, -2.0]]);
        assert_eq!(error, [[-1.0, -1.0], [-1.0, -3.0]]);
        let other = Measure::new("SSIM", "", ErrorKind::Share, "");
        assert!(place(&p, &other).is_none() && whiskers(&p, &other).is_none());
    }

    #[test]
    fn marks_are_decades_with_digits_between() {
        let all = marks((-2.5, 0.2));
        let decades: Vec<f64> = all.iter().filter(|m| m.step_size == 1.0).map(|m| m.value).collect();
        assert_eq!(decades, [-2.0, -1.0, 0.0]);
        assert!(all.iter().all(|m| (-2.5..=0.2).contains(&m.value)));
        let texts = |range: (f64, f64)| -> Vec<String> {
            let of = range.0..=range.1;
            marks(range).into_iter().map(|m| label(m, &of, tick)).filter(|t| !t.is_empty()).collect()
        };
        assert_eq!(texts((-2.5, 0.2)), ["0.01", "0.1", "1"]);
        assert_eq!(texts((-1.1, 0.1)), ["0.1", "0.2", "0.5", "1"]);
        assert_eq!(texts((-6.1, -3.9)), ["1e-6", "1e-5", "1e-4"]);
    }

    #[test]
    fn narrow_axes_have_marks_too() {
        let (low, high) = (0.030_f64.log10(), 0.0305_f64.log10());
        let texts: Vec<String> = marks((low, high)).into_iter().map(|m| label(m, &(low..=high), tick)).collect();
        assert_eq!(texts, ["0.03", "0.0301", "0.0302", "0.0303", "0.0304", "0.0305"]);
        assert!(marks((f64::NAN, 1.0)).is_empty() && marks((1.0, 1.0)).is_empty() && marks((0.0, 1e9)).is_empty());
    }
}
