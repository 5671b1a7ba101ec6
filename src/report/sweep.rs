//! Goes through the settings of a stage: every setting once, then every setting again, so that what
//! is stopped early has something of everything, and noise of the machine falls on all alike.

use std::time::Instant;

use super::document::{Order, Point, Stage};
use super::knobs::Knobs;
use crate::pipeline::observer::{Observer, Severity, Ticker};

/// A setting to be measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// The knob.
    pub method: String,
    /// Its setting, for people.
    pub setting: String,
    /// Its setting, for the program.
    pub knobs: Knobs,
    /// Whether these are the defaults.
    pub default: bool,
}

impl Case {
    /// A setting of one knob.
    pub fn new(method: &str, setting: impl Into<String>, knobs: &[(&str, serde_json::Value)]) -> Self {
        let knobs = knobs.iter().map(|(k, v)| ((*k).to_owned(), v.clone())).collect();
        Self { method: method.into(), setting: setting.into(), knobs, default: false }
    }

    /// The program's defaults.
    pub fn default(setting: impl Into<String>) -> Self {
        Self { method: "default".into(), setting: setting.into(), knobs: Knobs::new(), default: true }
    }
}

/// What one measurement gave.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trial {
    /// Seconds.
    pub secs: f64,
    /// Values by name of the measure; those that are no numbers are left out.
    pub values: Vec<(&'static str, f64)>,
    /// Seconds and first measure on the way.
    pub curve: Vec<[f64; 2]>,
}

/// Why a measurement failed, in words for people.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct StudyError(pub String);

/// Makes a study's error of another.
pub fn failed(error: impl std::fmt::Display) -> StudyError {
    StudyError(error.to_string())
}

/// The sweep of one stage on one input.
pub trait Study {
    /// The stage without points: what is measured, on what, against what.
    fn stage(&self) -> Stage;

    /// The settings.
    fn cases(&self) -> Vec<Case>;

    /// Measures one setting. `None` if the observer asked to stop.
    ///
    /// # Errors
    /// If it cannot be measured.
    fn run(&mut self, case: &Case, seed: u64, observer: &mut dyn Observer) -> Result<Option<Trial>, StudyError>;

    /// Checks of convergence. They are the same at every time, so they run once.
    ///
    /// # Errors
    /// If they cannot be made.
    fn orders(&mut self, _observer: &mut dyn Observer) -> Result<Vec<Order>, StudyError> {
        Ok(Vec::new())
    }
}

/// How a sweep ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// Everything was measured.
    Finished,
    /// The time was up.
    OutOfTime,
    /// The observer asked to stop.
    Cancelled,
}

/// Measures `study` until all is measured or `budget_secs` are over. `before` is what was measured of
/// the same sweep earlier; it is gone on with. `keep` is handed the stage after every measurement.
///
/// # Errors
/// If orders cannot be measured, or `keep` fails. What was measured before has been kept. A setting that
/// cannot be measured is left out, and the stage says so.
pub fn sweep(
    study: &mut dyn Study,
    before: Option<Stage>,
    budget_secs: f64,
    keep: &mut dyn FnMut(&Stage) -> Result<(), StudyError>,
    observer: &mut dyn Observer,
) -> Result<(Stage, End), StudyError> {
    let cases = study.cases();
    let mut stage = study.stage();
    stage.planned = cases.len();
    if let Some(before) = before {
        (stage.points, stage.orders) = (before.points, before.orders);
    }
    // Points of settings that are no longer there are dropped.
    stage.points.retain(|p| cases.iter().any(|c| c.is(p)));
    let total = (cases.len() * stage.seeds.len()) as u64;
    let measured = |stage: &Stage| stage.points.iter().map(|p| p.secs.each.len() as u64).sum::<u64>().min(total);
    let mut impossible: Vec<&Case> = Vec::new();
    let start = Instant::now();
    let what = format!("Measuring {}", stage.name.title().to_lowercase());
    let mut ticker = Ticker::resumed(what, total, measured(&stage), 0.0);
    if stage.orders.is_empty() {
        stage.orders = study.orders(observer)?;
        keep(&stage)?;
    }
    for (repeat, seed) in stage.seeds.clone().into_iter().enumerate() {
        // Each time from another one on: the first may find a colder machine than those after it.
        let turn = repeat * cases.len() / stage.seeds.len().max(1);
        for case in cases[turn..].iter().chain(&cases[..turn]) {
            if impossible.contains(&case) || stage.points.iter().any(|p| case.is(p) && p.secs.each.len() > repeat) {
                continue;
            }
            if observer.proceed().is_err() {
                return Ok((stage, End::Cancelled));
            }
            if start.elapsed().as_secs_f64() >= budget_secs {
                return Ok((stage, End::OutOfTime));
            }
            match study.run(case, seed, observer) {
                Ok(Some(trial)) => stage.add(case, &trial),
                Ok(None) => return Ok((stage, End::Cancelled)),
                // One setting that fails is no reason to give up the others.
                Err(why) => {
                    let text = format!("{}, {}: {why}", case.method, case.setting);
                    observer.note(Severity::Warning, format!("Left out: {text}"));
                    stage.left_out.push(text);
                    impossible.push(case);
                }
            }
            keep(&stage)?;
            let done = measured(&stage);
            ticker.report(done, observer);
        }
    }
    Ok((stage, End::Finished))
}

impl Case {
    fn is(&self, point: &Point) -> bool {
        self.method == point.method && self.setting == point.setting
    }
}

impl Stage {
    /// Adds a measurement.
    fn add(&mut self, case: &Case, trial: &Trial) {
        let at = self.points.iter().position(|p| case.is(p)).unwrap_or_else(|| {
            self.points.push(Point {
                method: case.method.clone(),
                setting: case.setting.clone(),
                knobs: case.knobs.clone(),
                default: case.default,
                ..Point::default()
            });
            self.points.len() - 1
        });
        let point = &mut self.points[at];
        point.secs.add(trial.secs);
        for (name, value) in trial.values.iter().filter(|v| v.1.is_finite()) {
            point.values.entry((*name).to_owned()).or_default().add(*value);
        }
        if point.curve.is_empty() {
            point.curve.clone_from(&trial.curve);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::tests::example;

    /// Counts what it is asked to measure.
    #[derive(Default)]
    struct Counting {
        ran: Vec<(String, u64)>,
        stop_after: usize,
        broken: Option<&'static str>,
    }

    impl Study for Counting {
        fn stage(&self) -> Stage {
            Stage { seeds: vec![0, 1, 2], points: vec![], orders: vec![], ..example().stages.remove(0) }
        }
        fn cases(&self) -> Vec<Case> {
            vec![Case::default("all"), Case::new("knob", "left", &[]), Case::new("knob", "right", &[])]
        }
        fn run(&mut self, case: &Case, seed: u64, _: &mut dyn Observer) -> Result<Option<Trial>, StudyError> {
            if self.ran.len() == self.stop_after {
                return Ok(None);
            }
            if self.broken == Some(case.setting.as_str()) {
                return Err(failed("it is broken"));
            }
            self.ran.push((case.setting.clone(), seed));
            Ok(Some(Trial { secs: 1.0 + seed as f64, values: vec![("RMS", 0.5), ("none", f64::NAN)], curve: vec![] }))
        }
    }

    fn kept(study: &mut Counting, before: Option<Stage>, budget: f64) -> (Stage, End, usize) {
        let mut keeps = 0;
        let mut keep = |_: &Stage| {
            keeps += 1;
            Ok(())
        };
        let (stage, end) =
            sweep(study, before, budget, &mut keep, &mut crate::pipeline::observer::Silent).expect("runs");
        (stage, end, keeps)
    }

    #[test]
    fn every_setting_is_measured_once_before_any_is_measured_twice() {
        let mut study = Counting { stop_after: usize::MAX, ..Counting::default() };
        let (stage, end, keeps) = kept(&mut study, None, f64::INFINITY);
        assert_eq!((end, keeps, stage.complete()), (End::Finished, 10, true));
        let first: Vec<&str> = study.ran[..3].iter().map(|r| r.0.as_str()).collect();
        assert_eq!(first, ["all", "left", "right"]);
        assert_eq!((study.ran[3].0.as_str(), study.ran[6].0.as_str()), ("left", "right"), "in turns");
        let secs = &stage.points[0].secs;
        assert_eq!((secs.median, secs.least, secs.most), (2.0, 1.0, 3.0));
        assert!(!stage.points[0].values.contains_key("none"));
    }

    #[test]
    fn a_stopped_sweep_is_gone_on_with() {
        let mut study = Counting { stop_after: 4, ..Counting::default() };
        let (stage, end, _) = kept(&mut study, None, f64::INFINITY);
        assert_eq!((end, stage.complete(), study.ran.len()), (End::Cancelled, false, 4));
        let mut rest = Counting { stop_after: usize::MAX, ..Counting::default() };
        let (stage, end, _) = kept(&mut rest, Some(stage), f64::INFINITY);
        assert_eq!((end, stage.complete(), rest.ran.len()), (End::Finished, true, 5));
        assert_eq!(rest.ran[0], ("right".to_owned(), 1));
        let mut nothing = Counting { stop_after: usize::MAX, ..Counting::default() };
        assert_eq!(kept(&mut nothing, Some(stage), f64::INFINITY).1, End::Finished);
        assert!(nothing.ran.is_empty());
    }

    #[test]
    fn a_setting_that_fails_is_left_out_and_named() {
        let mut study = Counting { stop_after: usize::MAX, broken: Some("left"), ..Counting::default() };
        let (stage, end, _) = kept(&mut study, None, f64::INFINITY);
        assert_eq!((end, stage.points.len(), study.ran.len(), stage.complete()), (End::Finished, 2, 6, false));
        assert_eq!(stage.left_out, ["knob, left: it is broken"]);
    }

    #[test]
    fn a_budget_ends_it_with_what_there_is() {
        let mut study = Counting { stop_after: usize::MAX, ..Counting::default() };
        let (stage, end, _) = kept(&mut study, None, 0.0);
        assert_eq!((end, stage.points.len(), stage.planned), (End::OutOfTime, 0, 3));
    }
}
