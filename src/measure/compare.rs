//! Two reports side by side: the same settings on two machines, scenes or versions of the program.

use super::document::{Measure, Point, Report, Stage};
use super::front::NOISE;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pair<'a> {
    pub(crate) one: &'a Point,
    pub(crate) other: &'a Point,
    /// Times of the second by times of the first.
    pub(crate) times: f64,
    /// The measure in the second less that in the first, where both have it.
    pub(crate) difference: Option<f64>,
}

impl Pair<'_> {
    /// Returns whether the times differ by more than repeats of the same do: usually, and here.
    pub(crate) fn differs(&self) -> bool {
        let (one, other) = (&self.one.secs, &self.other.secs);
        let is_apart = one.most < other.least || other.most < one.least;
        is_apart && !(1.0 / (1.0 + NOISE)..=1.0 + NOISE).contains(&self.times)
    }
}

/// A stage of two reports, by what they have in common.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct StageComparison<'a> {
    /// Settings of both, in the order of the first.
    pub(crate) pairs: Vec<Pair<'a>>,
    /// Numbers of settings that only the first has, and only the second.
    pub(crate) alone: [usize; 2],
}

impl Stage {
    /// This stage beside `other`, by the names of knobs and settings and by `measure`.
    pub(crate) fn beside<'a>(&'a self, other: &'a Stage, measure: &Measure) -> StageComparison<'a> {
        let value = |p: &Point| p.values.get(&measure.name).map(|s| s.median);
        let pair = |one: &'a Point| {
            let other = other.points.iter().find(|p| p.is_setting(one))?;
            let times = other.secs.median / one.secs.median;
            let difference = value(one).zip(value(other)).map(|(a, b)| b - a);
            Some(Pair { one, other, times, difference })
        };
        let pairs: Vec<Pair<'_>> = self.points.iter().filter_map(pair).collect();
        let alone = [self.points.len() - pairs.len(), other.points.len().saturating_sub(pairs.len())];
        StageComparison { pairs, alone }
    }
}

impl Point {
    /// Returns whether both are the same setting of the same knob. Defaults are one setting, whatever words
    /// describe them.
    pub(crate) fn is_setting(&self, other: &Point) -> bool {
        self.method == other.method && (self.setting == other.setting || self.default && other.default)
    }
}

impl Report {
    /// Conditions of `other` that differ, so that times do not compare.
    pub(crate) fn differs_from(&self, other: &Report) -> Vec<String> {
        let (a, b) = (&self.computer, &other.computer);
        let name = |gpu: &Option<String>| gpu.clone().unwrap_or_else(|| "none".into());
        let all = [
            ("processor", a.processor.clone(), b.processor.clone()),
            ("cores", a.cores.to_string(), b.cores.to_string()),
            ("GPU", name(&a.gpu), name(&b.gpu)),
            ("system", a.system.clone(), b.system.clone()),
            ("build", a.build.clone(), b.build.clone()),
            ("version", self.program.clone(), other.program.clone()),
            ("scene", self.scene.clone(), other.scene.clone()),
        ];
        all.into_iter().filter(|(_, a, b)| a != b).map(|(what, a, b)| format!("{what}: {a} / {b}")).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::Computer;
    use super::super::tests::example;
    use super::*;

    #[test]
    fn the_same_settings_are_compared() {
        let one = example();
        let mut other = example();
        let stage = &mut other.stages[0];
        stage.points[1].secs = stage.points[1].secs.each.iter().map(|s| 2.0 * s).collect();
        stage.points[2].secs = [0.0049, 0.01, 0.011].into_iter().collect();
        stage.points[1].values.get_mut("RMS").expect("measured").median += 0.5;
        stage.points[0].setting = "other words".into();
        stage.points[3].setting = "1/2000".into();
        let c = one.stages[0].beside(&other.stages[0], &one.stages[0].measures[0]);
        assert_eq!((c.pairs.len(), c.alone), (3, [1, 1]));
        assert!(c.pairs[0].one.default && !c.pairs[0].differs(), "defaults are one setting");
        assert_eq!((c.pairs[1].times, c.pairs[1].differs()), (2.0, true));
        assert!((c.pairs[2].times - 2.0).abs() < 1e-9 && !c.pairs[2].differs(), "one run was as fast");
        assert!((c.pairs[1].difference.expect("both have it") - 0.5).abs() < 1e-12);
        let missing = Measure { name: "none".into(), ..one.stages[0].measures[0].clone() };
        assert!(one.stages[0].beside(&other.stages[0], &missing).pairs.iter().all(|p| p.difference.is_none()));
    }

    #[test]
    fn other_conditions_are_named() {
        let one = example();
        assert!(one.differs_from(&one).is_empty());
        let other = Report { computer: Computer { cores: 64, ..one.computer.clone() }, ..one.clone() };
        assert_eq!(one.differs_from(&other), ["cores: 2 / 64"]);
    }
}
