//! The catalog of extreme cases: what happens in each, how far it is from double precision, and
//! whether the promise of the numerics holds (finite in, finite out, or a clear refusal).
//!
//! Every case can be run with a fault planted in its input or in what is found, and must then be seen to
//! break: a promise that nothing can break says nothing.
//!
//! One file per area: [`drawing`], [`invariance`], [`training`], [`optimizer`], [`language`],
//! [`moving`]. Random numbers look for more in `tests/fuzz/numbers`.

mod drawing;
mod invariance;
mod language;
mod moving;
mod optimizer;
mod training;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

use serde::Serialize;

use super::table::{Rows, rows};

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Verdict {
    Holds,
    /// The result is finite, but there is nothing to compare it with: no precision is more exact.
    NotCompared,
    Broken,
}

impl Verdict {
    pub(crate) fn of(holds: bool) -> Self {
        if holds { Self::Holds } else { Self::Broken }
    }

    pub(crate) fn text(self) -> &'static str {
        match self {
            Self::Holds => "yes",
            Self::NotCompared => "not compared",
            Self::Broken => "NO",
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Finding {
    pub(crate) outcome: String,
    /// Deviation from what it should be; NaN if there is nothing to compare.
    pub(crate) error: f64,
    /// The largest deviation that is allowed.
    pub(crate) bound: f64,
    pub(crate) verdict: Verdict,
}

impl Finding {
    /// A deviation compared with its bound. One that is not a number does not hold.
    pub(crate) fn within(outcome: impl Into<String>, error: f64, bound: f64) -> Self {
        Self { outcome: outcome.into(), error, bound, verdict: Verdict::of(error <= bound) }
    }

    pub(crate) fn is(outcome: impl Into<String>, holds: bool) -> Self {
        Self { outcome: outcome.into(), error: f64::NAN, bound: f64::NAN, verdict: Verdict::of(holds) }
    }

    /// The same, broken unless this holds too.
    #[must_use]
    pub(crate) fn and(self, holds: bool) -> Self {
        let verdict = if holds { self.verdict } else { Verdict::Broken };
        Self { verdict, ..self }
    }

    /// Returns whether the promise was seen to break.
    pub(crate) fn is_broken(&self) -> bool {
        self.verdict == Verdict::Broken
    }
}

pub(crate) struct Case {
    pub(crate) area: &'static str,
    pub(crate) name: String,
    /// Runs the case, with a planted fault if true.
    run: Box<dyn Fn(bool) -> Finding + Send + Sync>,
}

#[derive(Clone, Debug, Serialize)]
pub(crate) struct Checked {
    pub(crate) area: &'static str,
    pub(crate) name: String,
    pub(crate) secs: f64,
    pub(crate) finding: Finding,
}

impl Case {
    /// A case. `run` plants a fault if its argument is true.
    pub(crate) fn new(
        area: &'static str,
        name: impl Into<String>,
        run: impl Fn(bool) -> Finding + Send + Sync + 'static,
    ) -> Self {
        Self { area, name: name.into(), run: Box::new(run) }
    }

    /// Runs it. A panic is a broken promise, not the end.
    pub(crate) fn check(&self) -> Checked {
        let start = Instant::now();
        let finding = catch_unwind(AssertUnwindSafe(|| (self.run)(false)));
        let finding = finding.unwrap_or_else(|_| Finding::is("it panicked", false));
        Checked { area: self.area, name: self.name.clone(), secs: start.elapsed().as_secs_f64(), finding }
    }

    /// The control: what is found with a fault planted, which must be a broken promise.
    #[cfg(test)]
    pub(crate) fn control(&self) -> Finding {
        (self.run)(true)
    }
}

pub(crate) fn table(checked: &[Checked]) -> Rows {
    let number = |v: f64| if v.is_nan() { String::new() } else { format!("{v:.1e}") };
    rows(
        &["area", "case", "what happened", "error", "bound", "holds"],
        checked.iter().map(|c| {
            let f = &c.finding;
            let holds = f.verdict.text().to_owned();
            vec![c.area.into(), c.name.clone(), f.outcome.clone(), number(f.error), number(f.bound), holds]
        }),
    )
}

/// All cases, in the order of the areas.
pub(crate) fn catalog() -> Vec<Case> {
    let mut all = drawing::cases();
    all.extend(invariance::cases());
    all.extend(training::cases());
    all.extend(optimizer::cases());
    all.extend(language::cases());
    all.extend(moving::cases());
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_promise_holds() {
        let all = catalog();
        assert!(all.len() >= 60, "{} cases", all.len());
        let broken: Vec<Checked> = all.iter().map(Case::check).filter(|c| c.finding.is_broken()).collect();
        let lines: Vec<String> = broken
            .iter()
            .map(|c| {
                format!(
                    "{}, {}: {} ({:e} of {:e})",
                    c.area, c.name, c.finding.outcome, c.finding.error, c.finding.bound
                )
            })
            .collect();
        assert!(lines.is_empty(), "{} broken:\n{}", lines.len(), lines.join("\n"));
    }

    #[test]
    fn every_promise_can_be_broken() {
        let blind: Vec<String> = catalog()
            .iter()
            .map(|c| (c, c.control()))
            .filter(|(_, f)| !f.is_broken())
            .map(|(c, f)| format!("{}, {}: {} ({:e} of {:e})", c.area, c.name, f.outcome, f.error, f.bound))
            .collect();
        assert!(blind.is_empty(), "{} hold with a fault planted:\n{}", blind.len(), blind.join("\n"));
    }

    #[test]
    fn names_are_unique_and_broken_promises_are_seen() {
        let all = catalog();
        let names: std::collections::HashSet<(&str, String)> = all.iter().map(|c| (c.area, c.name.clone())).collect();
        assert_eq!(names.len(), all.len());
        let lengths: Vec<usize> = Vec::new();
        let panicking = Case::new("x", "y", move |_| Finding::is("", lengths[names.len()] == 0));
        assert!(panicking.check().finding.is_broken());
        assert!(Finding::within("", f64::NAN, 1.0).is_broken() && !Finding::within("", 0.5, 1.0).is_broken());
        assert!(Finding::within("", 0.5, 1.0).and(false).is_broken());
    }
}
