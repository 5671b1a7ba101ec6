//! The catalogue of extreme cases: what happens in each, how far it is from double precision, and
//! whether the promise of DESIGN's numerics holds (finite in, finite out, or a clear refusal).
//!
//! One file per area: [`drawing`], [`invariance`], [`training`], [`optimiser`], [`language`],
//! [`moving`]; [`fuzz`] looks for more.

pub mod drawing;
pub mod fuzz;
pub mod invariance;
pub mod language;
pub mod moving;
pub mod optimiser;
pub mod training;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

use serde::Serialize;

/// What happened in a case.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// In a few words.
    pub outcome: String,
    /// Deviation from what it should be; NaN if there is nothing to compare.
    pub error: f64,
    /// The largest deviation that is allowed.
    pub bound: f64,
    /// Whether the promise holds.
    pub holds: bool,
}

impl Finding {
    /// A deviation held against its bound. One that is not a number does not hold.
    pub fn within(outcome: impl Into<String>, error: f64, bound: f64) -> Self {
        Self { outcome: outcome.into(), error, bound, holds: error <= bound }
    }

    /// A yes or no.
    pub fn is(outcome: impl Into<String>, holds: bool) -> Self {
        Self { outcome: outcome.into(), error: f64::NAN, bound: f64::NAN, holds }
    }
}

/// A named case.
pub struct Case {
    /// Where it belongs.
    pub area: &'static str,
    /// Its name.
    pub name: String,
    run: Box<dyn Fn() -> Finding + Send + Sync>,
}

/// A case and what was found.
#[derive(Clone, Debug, Serialize)]
pub struct Checked {
    /// Where it belongs.
    pub area: &'static str,
    /// Its name.
    pub name: String,
    /// How long it took, seconds.
    pub secs: f64,
    /// What happened.
    pub finding: Finding,
}

impl Case {
    /// A case.
    pub fn new(area: &'static str, name: impl Into<String>, run: impl Fn() -> Finding + Send + Sync + 'static) -> Self {
        Self { area, name: name.into(), run: Box::new(run) }
    }

    /// Runs it. A panic is a broken promise, not the end.
    pub fn check(&self) -> Checked {
        let start = Instant::now();
        let finding = catch_unwind(AssertUnwindSafe(|| (self.run)()));
        let finding = finding.unwrap_or_else(|_| Finding::is("it panicked", false));
        Checked { area: self.area, name: self.name.clone(), secs: start.elapsed().as_secs_f64(), finding }
    }
}

/// All cases, in the order of the areas.
pub fn catalogue() -> Vec<Case> {
    let mut all = drawing::cases();
    all.extend(invariance::cases());
    all.extend(training::cases());
    all.extend(optimiser::cases());
    all.extend(language::cases());
    all.extend(moving::cases());
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_promise_holds() {
        let all = catalogue();
        assert!(all.len() >= 60, "{} cases", all.len());
        let broken: Vec<Checked> = all.iter().map(Case::check).filter(|c| !c.finding.holds).collect();
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
    fn names_are_unique_and_broken_promises_are_seen() {
        let all = catalogue();
        let names: std::collections::HashSet<(&str, String)> = all.iter().map(|c| (c.area, c.name.clone())).collect();
        assert_eq!(names.len(), all.len());
        let lengths: Vec<usize> = Vec::new();
        let panicking = Case::new("x", "y", move || Finding::is("", lengths[names.len()] == 0));
        assert!(!panicking.check().finding.holds);
        assert!(!Finding::within("", f64::NAN, 1.0).holds && Finding::within("", 0.5, 1.0).holds);
    }
}
