//! Places of measured points in a plot of error over time, on paper and in the window.

use super::axis::LogAxis;
use super::document::{Measure, Point, Stage};
use crate::scene::text;

/// Letters of a setting that stand beside its point.
const MOST_LETTERS: usize = 28;

/// Both axes: seconds to the right, errors up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PlotAxes {
    pub(crate) secs: LogAxis,
    pub(crate) error: LogAxis,
}

impl PlotAxes {
    /// Axes that hold all points of these stages, their repeats and their curves; `None` where nothing was measured.
    pub(crate) fn of(stages: &[&Stage], measure: &Measure) -> Option<Self> {
        let (mut secs, mut errors) = (Vec::new(), Vec::new());
        for stage in stages {
            for (p, sample) in stage.points.iter().filter_map(|p| Some((p, p.values.get(&measure.name)?))) {
                // The middle of two is none of them: that of zero and more is nearer to zero than either.
                secs.extend([p.secs.least, p.secs.median, p.secs.most]);
                errors.extend([sample.least, sample.median, sample.most].map(|v| measure.error(v)));
                for at in stage.way(p, measure) {
                    secs.push(at[0]);
                    errors.push(at[1]);
                }
            }
        }
        Some(Self { secs: LogAxis::of(secs)?, error: LogAxis::of(errors)? })
    }

    /// The place of a point; `None` if the measure was not taken there.
    pub(crate) fn place(&self, point: &Point, measure: &Measure) -> Option<[f64; 2]> {
        let error = point.error(measure).filter(|e| e.is_finite())?;
        (!point.secs.each.is_empty()).then(|| [self.secs.at(point.secs.median), self.error.at(error)])
    }

    /// The ends of its whiskers, if repeats differ: least and most time at its error, least and most error at its time.
    pub(crate) fn whiskers(&self, point: &Point, measure: &Measure) -> Vec<[[f64; 2]; 2]> {
        let Some([x, y]) = self.place(point, measure) else { return Vec::new() };
        let Some(value) = point.values.get(&measure.name) else { return Vec::new() };
        let secs = [point.secs.least, point.secs.most].map(|s| [self.secs.at(s), y]);
        let errors = [value.least, value.most].map(|v| [x, self.error.at(measure.error(v))]);
        [secs, errors].into_iter().filter(|w| w[0] != w[1]).collect()
    }

    /// The way to a point, where there is one.
    pub(crate) fn way(&self, stage: &Stage, point: &Point, measure: &Measure) -> Vec<[f64; 2]> {
        stage.way(point, measure).into_iter().map(|[s, e]| [self.secs.at(s), self.error.at(e)]).collect()
    }
}

impl Stage {
    /// Seconds and errors on the way to a point. They were noted of the first measure alone.
    fn way(&self, point: &Point, measure: &Measure) -> Vec<[f64; 2]> {
        if self.measures.first().is_none_or(|m| m.name != measure.name) {
            return Vec::new();
        }
        let all = point.curve.iter().map(|c| [c[0], measure.error(c[1])]);
        all.filter(|[s, e]| *s > 0.0 && s.is_finite() && e.is_finite()).collect()
    }
}

impl Point {
    /// The words beside it in a plot.
    pub(crate) fn label(&self) -> String {
        if self.default { "default".into() } else { text::elided(&self.setting, MOST_LETTERS) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::ErrorKind;
    use crate::measure::tests::example;

    fn one(secs: [f64; 3], values: [f64; 3]) -> (Stage, Measure) {
        let mut stage = example().stages.remove(0);
        let psnr = Measure::new("PSNR", "dB", ErrorKind::Decibels, "");
        let values = [("PSNR".to_owned(), values.into_iter().collect())].into();
        stage.points = vec![Point { secs: secs.into_iter().collect(), values, ..Point::default() }];
        stage.measures = vec![psnr.clone()];
        (stage, psnr)
    }

    fn near(a: [f64; 2], b: [f64; 2]) -> bool {
        (0..2).all(|k| (a[k] - b[k]).abs() < 1e-9)
    }

    #[test]
    fn places_are_logarithms_of_time_and_error() {
        let (stage, psnr) = one([0.1, 0.01, 1.0], [40.0, 20.0, 60.0]);
        let (axes, p) = (PlotAxes::of(&[&stage], &psnr).expect("axes"), &stage.points[0]);
        assert!(near(axes.place(p, &psnr).expect("a place"), [-1.0, -2.0]), "40 dB are an error of a hundredth");
        let whiskers = axes.whiskers(p, &psnr);
        assert!(near(whiskers[0][0], [-2.0, -2.0]) && near(whiskers[0][1], [0.0, -2.0]), "{whiskers:?}");
        assert!(near(whiskers[1][0], [-1.0, -1.0]) && near(whiskers[1][1], [-1.0, -3.0]), "{whiskers:?}");
        let other = Measure::new("SSIM", "", ErrorKind::Share, "");
        assert!(axes.place(p, &other).is_none() && axes.whiskers(p, &other).is_empty());
        assert!(PlotAxes::of(&[&stage], &other).is_none());
    }

    #[test]
    fn a_perfect_image_is_at_zero_and_a_single_run_has_no_whiskers() {
        let (mut stage, psnr) = one([0.1, 0.1, 0.1], [150.0, 150.0, 150.0]);
        let (other, _) = one([0.2, 0.2, 0.2], [60.0, 60.0, 60.0]);
        stage.points.extend(other.points);
        let axes = PlotAxes::of(&[&stage], &psnr).expect("axes");
        let place = |k: usize| axes.place(&stage.points[k], &psnr).expect("a place")[1];
        let band = axes.error.band_end().expect("a band");
        assert!(place(0) < band && place(1) > band, "a PSNR at its limit is no error, not one of 3e-8");
        assert!(axes.whiskers(&stage.points[0], &psnr).is_empty(), "all repeats are alike");
    }

    #[test]
    fn the_middle_of_zero_and_more_is_not_in_the_band_of_zero() {
        let mut stage = example().stages.remove(0);
        let rms = stage.measures[0].clone();
        stage.points.truncate(2);
        stage.points[0].values.insert("RMS".into(), [0.0, 0.02].into_iter().collect());
        stage.points[1].values.insert("RMS".into(), [0.0, 0.0].into_iter().collect());
        let axes = PlotAxes::of(&[&stage], &rms).expect("axes");
        let band = axes.error.band_end().expect("a band");
        let [middle, zero] = [0, 1].map(|k| axes.place(&stage.points[k], &rms).expect("a place")[1]);
        assert!(middle > band && zero < band, "{middle} {zero} {band}");
    }

    #[test]
    fn ways_are_of_the_first_measure_alone() {
        let (mut stage, psnr) = one([10.0; 3], [30.0; 3]);
        let ssim = Measure::new("SSIM", "", ErrorKind::Share, "");
        stage.points[0].values.insert("SSIM".into(), [0.9].into_iter().collect());
        stage.points[0].curve = vec![[0.0, 5.0], [5.0, 20.0], [10.0, 30.0]];
        stage.measures.push(ssim.clone());
        let axes = PlotAxes::of(&[&stage], &psnr).expect("axes");
        assert_eq!(axes.way(&stage, &stage.points[0], &psnr).len(), 2, "what took no time has no place");
        assert!(axes.way(&stage, &stage.points[0], &ssim).is_empty(), "20 dB are no SSIM of 20");
    }

    #[test]
    fn every_point_says_its_setting() {
        let labels: Vec<String> = example().stages[0].points.iter().map(Point::label).collect();
        assert_eq!(labels, ["default", "1/64", "1/16", "1/1000"]);
        let long = Point { setting: "the order of a view that is half a turn away".into(), ..Point::default() };
        assert_eq!(long.label().chars().count(), MOST_LETTERS);
    }
}
