//! Which points are worth having: the Pareto front of time and error, and the choice of a default.

use super::document::{Measure, Point, Rule, Stage};

/// Indices of the `(seconds, error)` that no other beats in both, fastest first. Points that are no
/// numbers are left out; of equal ones the first stays.
pub(crate) fn pareto(points: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> =
        (0..points.len()).filter(|&i| points[i].0.is_finite() && points[i].1.is_finite()).collect();
    order.sort_by(|&a, &b| {
        points[a].0.total_cmp(&points[b].0).then(points[a].1.total_cmp(&points[b].1)).then(a.cmp(&b))
    });
    let mut least = f64::INFINITY;
    order.retain(|&i| {
        let better = points[i].1 < least;
        least = least.min(points[i].1);
        better
    });
    order
}

impl Stage {
    /// Indices of the points that no other point beats in both time and error, fastest first.
    pub(crate) fn front(&self, measure: &Measure) -> Vec<usize> {
        let at = |p: &Point| (p.secs.median, p.error(measure).unwrap_or(f64::NAN));
        pareto(&self.points.iter().map(at).collect::<Vec<_>>())
    }
}

/// What a rule makes of one knob.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct KnobChoice<'a> {
    pub(crate) method: &'a str,
    pub(crate) default: &'a Point,
    /// The fastest that is good enough.
    pub(crate) chosen: &'a Point,
    /// The one with the least error.
    pub(crate) best: &'a Point,
    /// Whether the default is good enough, and as fast as the chosen one: within noise, or in one repeat or
    /// another.
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

    #[test]
    fn the_front_holds_what_nothing_beats() {
        let points =
            [(1.0, 5.0), (2.0, 3.0), (2.5, 3.0), (3.0, 4.0), (4.0, 1.0), (f64::NAN, 0.0), (0.5, f64::INFINITY)];
        assert_eq!(pareto(&points), [0, 1, 4]);
        // Every other point is beaten by one on the front.
        for p in [(2.5, 3.0), (3.0, 4.0)] {
            assert!(pareto(&points).iter().any(|&i| points[i].0 <= p.0 && points[i].1 <= p.1));
        }
        assert_eq!(pareto(&[(1.0, 1.0), (1.0, 1.0)]), [0]);
        assert!(pareto(&[]).is_empty());
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
