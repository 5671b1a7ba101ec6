//! Points worth having: the Pareto front of time and error beyond the spread of repeats, and the choice of a default.

use super::document::{Measure, Point, Rule, Sample, Stage};
use crate::math::stats::median;

/// Range of the repeats of a number, and their median.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Span {
    least: f64,
    median: f64,
    most: f64,
    runs: usize,
}

impl Span {
    /// Span of a measured number; smaller is better. `None` without runs or if a value is not finite.
    fn of(sample: &Sample, error: impl Fn(f64) -> f64) -> Option<Self> {
        let (a, b) = (error(sample.least), error(sample.most));
        let found = Self { least: a.min(b), median: error(sample.median), most: a.max(b), runs: sample.each.len() };
        (found.runs > 0 && [a, b, found.median].iter().all(|v| v.is_finite())).then_some(found)
    }

    /// Distance of the repeats, as a share; `None` of a single one.
    fn share(&self) -> Option<f64> {
        (self.runs > 1 && self.median > 0.0).then(|| (self.most - self.least) / self.median)
    }

    /// Returns whether it is worse by more than repeats differ: no run of it is better than any of the other. `usual`
    /// is the share by which runs differ elsewhere, for numbers of a single run.
    fn is_worse_than(&self, other: &Self, usual: f64) -> bool {
        let usual = if self.runs.min(other.runs) > 1 { 0.0 } else { usual };
        self.least >= other.most * (1.0 + usual) && self.most > other.least
    }
}

/// Indices of the points that nothing is better than, the fastest first. `usual` is the share by which repeats of time
/// and of error differ usually.
///
/// A point is out if one on the front is better in time or in error by more than repeats differ, and not worse in the
/// other by as much. So neither a lucky nor an unlucky run decides.
fn front_of(points: &[Option<[Span; 2]>], usual: [f64; 2]) -> Vec<usize> {
    let worse = |k: usize, a: &[Span; 2], b: &[Span; 2]| a[k].is_worse_than(&b[k], usual[k]);
    let is_beaten =
        |a: &[Span; 2], by: &[Span; 2]| worse(0, a, by) && !worse(1, by, a) || worse(1, a, by) && !worse(0, by, a);
    let mut left: Vec<(usize, [Span; 2])> = points.iter().enumerate().filter_map(|(i, p)| Some((i, (*p)?))).collect();
    let mut front: Vec<(usize, [Span; 2])> = Vec::new();
    while !left.is_empty() {
        let best = |p: &&(usize, [Span; 2])| !left.iter().any(|q| is_beaten(&p.1, &q.1));
        let mut found: Vec<_> = left.iter().filter(best).copied().collect();
        if found.is_empty() {
            found.clone_from(&left);
        }
        // What only such points beat that are out themselves is looked at again.
        left.retain(|p| !found.iter().any(|q| q.0 == p.0 || is_beaten(&p.1, &q.1)));
        front.extend(found);
    }
    front.sort_by(|a, b| {
        let by = |k: usize| a.1[k].median.total_cmp(&b.1[k].median);
        by(0).then(by(1)).then(a.0.cmp(&b.0))
    });
    front.into_iter().map(|(i, _)| i).collect()
}

impl Stage {
    /// Indices of the points that no other is better than by more than repeats differ, the fastest first. Times of
    /// settings that ran once are taken for the same within [`NOISE`].
    pub(crate) fn front(&self, measure: &Measure) -> Vec<usize> {
        let spans = |p: &Point| {
            let error = Span::of(p.values.get(&measure.name)?, |v| measure.error(v))?;
            Some([Span::of(&p.secs, |s| s)?, error])
        };
        let spans: Vec<Option<[Span; 2]>> = self.points.iter().map(spans).collect();
        let usual = |k: usize| {
            let shares: Vec<f64> = spans.iter().flatten().filter_map(|s| s[k].share()).collect();
            if shares.is_empty() { 0.0 } else { median(&shares) }
        };
        front_of(&spans, [usual(0).max(NOISE), usual(1)])
    }
}

/// Choice of a rule for one knob.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct KnobChoice<'a> {
    pub(crate) method: &'a str,
    pub(crate) default: &'a Point,
    /// The fastest that is good enough.
    pub(crate) chosen: &'a Point,
    /// The one with the least error.
    pub(crate) best: &'a Point,
    /// True if the default is good enough, and as fast as the chosen one: within noise, or in one repeat or another.
    pub(crate) holds: bool,
}

/// Two times nearer than this share of the shorter are the same time.
pub(crate) const NOISE: f64 = 0.15;

impl Stage {
    /// The choice for each knob: among its settings and the default. Knobs of stages without a
    /// default, and settings without the rule's measure, are left out.
    pub(crate) fn choices(&self) -> Vec<KnobChoice<'_>> {
        let Some(measure) = self.measure(&self.rule.measure) else { return Vec::new() };
        let Some(default) = self.points.iter().find(|p| p.default) else { return Vec::new() };
        let Some(default_error) = default.error(measure) else { return Vec::new() };
        let methods = self.methods().into_iter().filter(|m| *m != default.method);
        let choice = |method| {
            let of_method = self.points.iter().filter(move |p| p.method == method).chain([default]);
            let all: Vec<(&Point, f64)> = of_method.filter_map(|p| Some((p, p.error(measure)?))).collect();
            // A knob whose settings were measured by other measures alone has no choice here.
            if all.iter().all(|(p, _)| p.default) {
                return None;
            }
            let (best, least) = *all.iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
            let enough = self.rule.enough(least);
            let good = all.iter().filter(|p| p.1 <= enough);
            let (chosen, _) = *good.min_by(|a, b| a.0.secs.median.total_cmp(&b.0.secs.median))?;
            let as_fast = default.secs.median <= (1.0 + NOISE) * chosen.secs.median + self.rule.spare_secs
                || default.secs.least < chosen.secs.most;
            Some(KnobChoice { method, default, chosen, best, holds: default_error <= enough && as_fast })
        };
        methods.filter_map(choice).collect()
    }
}

impl Rule {
    /// The largest error that is good enough where the least is `least`.
    pub(crate) fn enough(&self, least: f64) -> f64 {
        (self.times * least).max(self.floor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::tests::example;

    /// A stage of points with these times and values of "RMS", a list of repeats each.
    fn stage(points: &[(&[f64], &[f64])]) -> Stage {
        let mut stage = example().stages.remove(0);
        let sample = |values: &[f64]| values.iter().copied().collect::<Sample>();
        let point = |(secs, values): &(&[f64], &[f64])| Point {
            secs: sample(secs),
            values: [("RMS".to_owned(), sample(values))].into(),
            ..Point::default()
        };
        stage.points = points.iter().map(point).collect();
        stage
    }

    fn front(points: &[(&[f64], &[f64])]) -> Vec<usize> {
        let stage = stage(points);
        stage.front(&stage.measures[0])
    }

    #[test]
    fn the_front_holds_what_nothing_beats() {
        let exact = |v: f64| [v, v];
        let points =
            [(1.0, 5.0), (2.0, 3.0), (2.5, 3.0), (3.0, 4.0), (4.0, 1.0), (f64::NAN, 0.0), (0.5, f64::INFINITY)];
        let points = points.map(|(s, e)| (exact(s), exact(e)));
        let all: Vec<(&[f64], &[f64])> = points.iter().map(|(s, e)| (&s[..], &e[..])).collect();
        assert_eq!(front(&all), [0, 1, 4]);
        // Of equal ones none is better.
        assert_eq!(front(&[all[0], all[0]]), [0, 1]);
        assert!(front(&[]).is_empty());
    }

    #[test]
    fn noise_puts_nothing_on_the_front_and_takes_nothing_off() {
        // Both the same within repeats: neither is better, whichever has the better median.
        assert_eq!(front(&[(&[1.0, 1.2], &[0.10, 0.12]), (&[1.05, 1.3], &[0.11, 0.13])]), [0, 1]);
        // Clearly worse, and faster by a median within noise: off.
        assert_eq!(front(&[(&[1.0, 1.2], &[0.10, 0.12]), (&[0.99, 1.15], &[0.20, 0.22])]), [0]);
        // The control: clearly worse and clearly faster is a choice.
        assert_eq!(front(&[(&[1.0, 1.2], &[0.10, 0.12]), (&[0.5, 0.6], &[0.20, 0.22])]), [1, 0]);
        // A chain: the last is beaten by the second alone, which is out itself, and is faster than the first.
        let chain: [(&[f64], &[f64]); 3] =
            [(&[5.0, 7.0], &[1.0, 1.0]), (&[4.0, 6.0], &[2.0, 2.0]), (&[3.0, 4.5], &[3.0, 3.0])];
        assert_eq!(front(&chain), [2, 0]);
    }

    #[test]
    fn what_ran_once_is_as_noisy_as_the_rest() {
        // The same training took 11.2 and 14.7 s: a single run at 12 s is no faster than one at 13.
        let noisy: (&[f64], &[f64]) = (&[11.2, 14.7], &[0.030, 0.031]);
        assert_eq!(front(&[noisy, (&[13.0], &[0.020]), (&[12.0], &[0.025])]), [1]);
        // The control: with exact repeats beside them it is 15 % that count.
        assert_eq!(front(&[(&[13.0], &[0.020]), (&[12.0], &[0.025])]), [0]);
        assert_eq!(front(&[(&[13.0], &[0.020]), (&[10.0], &[0.025])]), [1, 0]);
    }

    #[test]
    fn what_is_perfect_in_every_run_is_better_than_what_is_in_some() {
        assert_eq!(front(&[(&[2.0, 2.1], &[0.0, 0.0]), (&[1.0, 1.1], &[0.0, 0.02])]), [1, 0]);
        // The control: one bad run of each, and only the faster is left.
        assert_eq!(front(&[(&[2.0, 2.1], &[0.0, 0.01]), (&[1.0, 1.1], &[0.0, 0.02])]), [1]);
    }

    #[test]
    fn of_perfect_ones_the_fastest_is_on_the_front() {
        assert_eq!(
            front(&[(&[2.0, 2.1], &[0.0, 0.0]), (&[1.0, 1.1], &[0.0, 0.0]), (&[0.5, 0.6], &[0.1, 0.1])]),
            [2, 1]
        );
    }

    #[test]
    fn the_fastest_that_is_good_enough_is_chosen() {
        let mut report = example();
        let stage = &mut report.stages[0];
        let choices = stage.choices();
        assert_eq!(choices.len(), 1);
        assert_eq!(
            (choices[0].method, choices[0].chosen.setting.as_str(), choices[0].holds),
            ("cut-off", "1/64", false)
        );
        // With a stricter rule the default is what is left.
        stage.rule.times = 1.01;
        stage.rule.floor = 0.0;
        let choices = stage.choices();
        assert!(choices[0].holds && choices[0].chosen.default);
        // Ten milliseconds that nobody notices are no reason to change a default.
        stage.rule = Rule { times: 1.1, floor: 0.01, spare_secs: 0.02, ..stage.rule.clone() };
        let choices = stage.choices();
        assert!(choices[0].holds && !choices[0].chosen.default);
        // Neither are times whose repeats overlap.
        stage.rule.spare_secs = 0.0;
        assert!(!stage.choices()[0].holds);
        let slow = stage.points.iter().position(|p| p.setting == "1/64").expect("there");
        stage.points[slow].secs.add(0.03);
        let choices = stage.choices();
        assert!(choices[0].holds && !choices[0].chosen.default);
    }
}
