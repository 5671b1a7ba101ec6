//! Goes through the settings of a stage: every setting once, then every setting again, so that what
//! is stopped early has something of everything, and noise of the machine falls on all alike.

use std::path::Path;
use std::time::Instant;

use super::document::{Point, Report, Stage};
use super::file::FILE;
use super::knobs::Knobs;
use super::order::Order;
use crate::pipeline::observer::{Observer, Severity, Ticker};

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SweepCase {
    pub(crate) method: String,
    pub(crate) setting: String,
    pub(crate) knobs: Knobs,
    pub(crate) default: bool,
}

impl SweepCase {
    pub(crate) fn new(method: &str, setting: impl Into<String>, knobs: &[(&str, serde_json::Value)]) -> Self {
        let knobs = knobs.iter().map(|(k, v)| ((*k).to_owned(), v.clone())).collect();
        Self { method: method.into(), setting: setting.into(), knobs, default: false }
    }

    pub(crate) fn default(setting: impl Into<String>) -> Self {
        Self { method: "default".into(), setting: setting.into(), knobs: Knobs::new(), default: true }
    }
}

#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Trial {
    pub(crate) secs: f64,
    /// Values by name of the measure; those that are NaN or infinite are left out.
    pub(crate) values: Vec<(&'static str, f64)>,
    /// Seconds and first measure on the way.
    pub(crate) curve: Vec<[f64; 2]>,
}

#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct StudyError(pub(crate) String);

pub(crate) fn failed(error: impl std::fmt::Display) -> StudyError {
    StudyError(error.to_string())
}

/// Measures the setting of this number with this seed; `None` if the observer asked to stop.
type Run<'a> = Box<dyn FnMut(usize, u64, &mut dyn Observer) -> Result<Option<Trial>, StudyError> + 'a>;

/// The sweep of one stage on one input.
pub(crate) struct Study<'a> {
    /// The stage without points: what is measured, on what, compared with what.
    pub(crate) stage: Stage,
    cases: Vec<SweepCase>,
    run: Run<'a>,
    /// Checks of convergence. They are the same at every time, so they run once.
    orders: Box<dyn Fn() -> Result<Vec<Order>, StudyError> + 'a>,
}

impl<'a> Study<'a> {
    /// A sweep of settings, each with what it means to the study itself.
    pub(crate) fn new<V: 'a>(
        stage: Stage,
        variants: Vec<(SweepCase, V)>,
        mut measure: impl FnMut(&V, u64, &mut dyn Observer) -> Result<Option<Trial>, StudyError> + 'a,
    ) -> Self {
        let (cases, variants): (Vec<SweepCase>, Vec<V>) = variants.into_iter().unzip();
        let run: Run<'a> = Box::new(move |k, seed, observer| measure(&variants[k], seed, observer));
        Self { stage: Stage { planned: cases.len(), ..stage }, cases, run, orders: Box::new(|| Ok(Vec::new())) }
    }

    #[must_use]
    pub(crate) fn with_orders(self, orders: impl Fn() -> Result<Vec<Order>, StudyError> + 'a) -> Self {
        Self { orders: Box::new(orders), ..self }
    }

    /// Measures the setting of a knob whose words contain these.
    #[cfg(test)]
    pub(crate) fn measured(&mut self, method: &str, setting: &str, seed: u64) -> Trial {
        let is = |c: &SweepCase| c.method == method && c.setting.contains(setting);
        let k = self.cases.iter().position(is).expect("a case");
        (self.run)(k, seed, &mut crate::pipeline::observer::Silent).expect("runs").expect("not canceled")
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum End {
    Finished,
    OutOfTime,
    Cancelled,
}

/// Measures `study` until all is measured or `budget_secs` are over. `before` is what was measured of
/// the same sweep earlier; it is resumed. `keep` is handed the stage after every measurement.
///
/// # Errors
/// If orders cannot be measured, or `keep` fails. What was measured before has been kept. A setting that
/// cannot be measured is left out, and the stage says so.
pub(crate) fn sweep(
    study: &mut Study<'_>,
    before: Option<Stage>,
    budget_secs: f64,
    keep: &mut dyn FnMut(&Stage) -> Result<(), StudyError>,
    observer: &mut dyn Observer,
) -> Result<(Stage, End), StudyError> {
    let cases = &study.cases;
    let mut stage = study.stage.clone();
    if let Some(before) = before {
        (stage.points, stage.orders) = (before.points, before.orders);
    }
    // Points of settings that are no longer there are dropped.
    stage.points.retain(|p| cases.iter().any(|c| c.is(p)));
    let total = (cases.len() * stage.seeds.len()) as u64;
    let measured = |stage: &Stage| stage.points.iter().map(|p| p.secs.each.len() as u64).sum::<u64>().min(total);
    let mut impossible: Vec<usize> = Vec::new();
    let start = Instant::now();
    let what = format!("Measuring {}", stage.name.title().to_lowercase());
    let mut ticker = Ticker::resumed(what, total, measured(&stage), 0.0);
    if stage.orders.is_empty() {
        if observer.proceed().is_ok() && budget_secs > 0.0 {
            stage.orders = (study.orders)()?;
        }
        keep(&stage)?;
    }
    for (repeat, seed) in stage.seeds.clone().into_iter().enumerate() {
        // Each time from another one on: the first may find a colder machine than those after it.
        let turn = repeat * cases.len() / stage.seeds.len().max(1);
        for k in (turn..cases.len()).chain(0..turn) {
            let case = &cases[k];
            if impossible.contains(&k) || stage.points.iter().any(|p| case.is(p) && p.secs.each.len() > repeat) {
                continue;
            }
            if observer.proceed().is_err() {
                return Ok((stage, End::Cancelled));
            }
            if start.elapsed().as_secs_f64() >= budget_secs {
                return Ok((stage, End::OutOfTime));
            }
            match (study.run)(k, seed, observer) {
                Ok(Some(trial)) => stage.add(case, &trial),
                Ok(None) => return Ok((stage, End::Cancelled)),
                // One setting that fails is no reason to give up the others.
                Err(why) => {
                    let text = format!("{}, {}: {why}", case.method, case.setting);
                    observer.note(Severity::Warning, format!("Left out: {text}"));
                    stage.left_out.push(text);
                    impossible.push(k);
                }
            }
            keep(&stage)?;
            let done = measured(&stage);
            ticker.report(done, observer);
        }
    }
    Ok((stage, End::Finished))
}

impl Report {
    /// Measures `study` as [`sweep`] does, and writes the report into `folder` after every measurement.
    pub(crate) fn measure(
        &mut self,
        study: &mut Study<'_>,
        folder: &Path,
        budget_secs: f64,
        observer: &mut dyn Observer,
    ) -> Result<End, StudyError> {
        let before = self.earlier(&study.stage);
        let mut keep = |stage: &Stage| {
            self.put(stage.clone());
            self.write(&folder.join(FILE)).map_err(failed)
        };
        Ok(sweep(study, before, budget_secs, &mut keep, observer)?.1)
    }
}

impl SweepCase {
    fn is(&self, point: &Point) -> bool {
        self.method == point.method && self.setting == point.setting
    }
}

impl Stage {
    pub(crate) fn add(&mut self, case: &SweepCase, trial: &Trial) {
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
    use crate::measure::tests::example;

    /// Sweeps three settings with three repeats, until it stops; one may be broken. Returns the trials that ran, too.
    fn kept(stop_after: usize, broken: &str, before: Option<Stage>, budget: f64) -> (Stage, End, Vec<(String, u64)>) {
        let stage = Stage { points: vec![], orders: vec![], ..example().stages.remove(0) };
        let cases =
            [SweepCase::default("all"), SweepCase::new("knob", "left", &[]), SweepCase::new("knob", "right", &[])];
        let variants: Vec<_> = cases.map(|c| (c.clone(), c.setting)).into();
        let mut ran = Vec::new();
        let mut keeps = 0;
        let mut study = Study::new(stage, variants, |setting: &String, seed, _: &mut dyn Observer| {
            if ran.len() == stop_after {
                return Ok(None);
            }
            if setting == broken {
                return Err(failed("it is broken"));
            }
            ran.push((setting.clone(), seed));
            Ok(Some(Trial { secs: 1.0 + seed as f64, values: vec![("RMS", 0.5), ("none", f64::NAN)], curve: vec![] }))
        });
        let mut keep = |_: &Stage| {
            keeps += 1;
            Ok(())
        };
        let observer = &mut crate::pipeline::observer::Silent;
        let (stage, end) = sweep(&mut study, before, budget, &mut keep, observer).expect("runs");
        drop(study);
        assert!(keeps >= ran.len(), "everything measured is kept");
        (stage, end, ran)
    }

    const ALL: usize = usize::MAX;

    #[test]
    fn every_setting_is_measured_once_before_any_is_measured_twice() {
        let (stage, end, ran) = kept(ALL, "", None, f64::INFINITY);
        assert_eq!((end, ran.len(), stage.complete()), (End::Finished, 9, true));
        let first: Vec<&str> = ran[..3].iter().map(|r| r.0.as_str()).collect();
        assert_eq!(first, ["all", "left", "right"]);
        assert_eq!((ran[3].0.as_str(), ran[6].0.as_str()), ("left", "right"), "in turns");
        let secs = &stage.points[0].secs;
        assert_eq!((secs.median, secs.least, secs.most), (2.0, 1.0, 3.0));
        assert!(!stage.points[0].values.contains_key("none"));
    }

    #[test]
    fn a_stopped_sweep_is_resumed() {
        let (stage, end, ran) = kept(4, "", None, f64::INFINITY);
        assert_eq!((end, stage.complete(), ran.len()), (End::Cancelled, false, 4));
        let (stage, end, rest) = kept(ALL, "", Some(stage), f64::INFINITY);
        assert_eq!((end, stage.complete(), rest.len()), (End::Finished, true, 5));
        assert_eq!(rest[0], ("right".to_owned(), 1));
        let (_, end, nothing) = kept(ALL, "", Some(stage), f64::INFINITY);
        assert_eq!((end, nothing.len()), (End::Finished, 0));
    }

    #[test]
    fn a_setting_that_fails_is_left_out_and_named() {
        let (stage, end, ran) = kept(ALL, "left", None, f64::INFINITY);
        assert_eq!((end, stage.points.len(), ran.len(), stage.complete()), (End::Finished, 2, 6, false));
        assert_eq!(stage.left_out, ["knob, left: it is broken"]);
    }

    #[test]
    fn without_time_no_order_is_measured() {
        let stage = Stage { points: vec![], orders: vec![], ..example().stages.remove(0) };
        let study = || {
            let cases = vec![(SweepCase::default("all"), 0_u8)];
            let study = Study::new(stage.clone(), cases, |_: &u8, _, _: &mut dyn Observer| Ok(None));
            study.with_orders(|| Err(failed("orders were measured")))
        };
        let keeps = std::cell::Cell::new(0);
        let mut keep = |_: &Stage| {
            keeps.set(keeps.get() + 1);
            Ok(())
        };
        let observer = &mut crate::pipeline::observer::Silent;
        let (_, end) = sweep(&mut study(), None, 0.0, &mut keep, observer).expect("not measured");
        assert_eq!((end, keeps.get()), (End::OutOfTime, 1), "what there is of it is kept");
        // The control: with time they are.
        assert!(sweep(&mut study(), None, 9.0, &mut keep, observer).is_err());
    }

    #[test]
    fn a_budget_ends_it_with_what_there_is() {
        let (stage, end, _) = kept(ALL, "", None, 0.0);
        assert_eq!((end, stage.points.len(), stage.planned), (End::OutOfTime, 0, 3));
    }
}
