//! Knobs of training against held-out photos.

use serde_json::{Value, json};

use super::{Input, Plans, stage};
use crate::pipeline::evaluate::evaluate;
use crate::pipeline::observer::{Observer, Signal, Silent};
use crate::pipeline::train::{self, TrainConfig, TrainEnd, TrainView, load_views};
use crate::report::document::Form;
use crate::report::sweep::failed;
use crate::report::{Case, Measure, Rule, Stage, StageName, Study, StudyError, Trial, turned};
use crate::scene::Dataset;

/// Evaluations on the way, of which the curves are made.
const LOOKS: u64 = 8;

/// The sweep of training.
pub struct TrainStudy<'a> {
    dataset: &'a Dataset,
    base: TrainConfig,
    tests: Vec<TrainView>,
    input: Input,
    repeats: u32,
    plans: Plans<TrainConfig>,
}

impl<'a> TrainStudy<'a> {
    /// Of the photos `dataset`; `base` is what is turned one knob at a time.
    ///
    /// # Errors
    /// If a photo cannot be read, or none is held out.
    pub fn new(dataset: &'a Dataset, base: TrainConfig, repeats: u32, input: Input) -> Result<Self, StudyError> {
        let base = TrainConfig { eval_every: (base.steps / LOOKS).max(1), checkpoint_secs: 0.0, ..base };
        let held = dataset.split(base.holdout_every).1;
        let tests = load_views(dataset, &held, &base, "Loading held-out photos", &mut Silent).map_err(failed)?;
        let tests = tests.filter(|t| !t.is_empty()).ok_or_else(|| failed("no photo is held out"))?;
        let plans = plans(&base)?;
        Ok(Self { dataset, base, tests, input, repeats, plans })
    }
}

fn plans(base: &TrainConfig) -> Result<Plans<TrainConfig>, StudyError> {
    let words = format!("{} steps, {} px, SH {}", base.steps, base.max_side_px, base.sh_degree);
    let mut all = vec![(Case::default(words), base.clone())];
    let mut add = |method: &str, setting: String, name: &str, value: Value| -> Result<(), StudyError> {
        let case = Case::new(method, setting, &[(name, value)]);
        let config = turned(base, &case.knobs).map_err(StudyError)?;
        all.push((case, config));
        Ok(())
    };
    for (times, share) in [(1, 4), (1, 2), (2, 1)] {
        let steps = (base.steps * times / share).max(1);
        add("steps", steps.to_string(), "steps", json!(steps))?;
    }
    for (times, share) in [(1, 2), (3, 4)] {
        let side = base.max_side_px * times / share;
        add("picture size", format!("{side} px"), "max_side_px", json!(side))?;
    }
    for share in [0.3, 0.6] {
        add("half size at first", format!("{:.0} % of the steps", 100.0 * share), "coarse_share", json!(share))?;
    }
    for most in [5_000, 20_000, 80_000] {
        add("most Gaussians", most.to_string(), "max_gaussians", json!(most))?;
    }
    add("density control", "off".into(), "densify", json!(false))?;
    for degree in 0..base.sh_degree {
        add("SH bands", format!("degree {degree}"), "sh_degree", json!(degree))?;
    }
    add("SH schedule", "all bands from the start".into(), "sh_at_once", json!(true))?;
    add("anti-aliasing", "with the filter".into(), "antialias", json!(!base.antialias))?;
    Ok(Plans(all))
}

/// Passes the wish to stop on, and nothing back.
struct Quiet<'a>(&'a mut dyn Observer);

impl Observer for Quiet<'_> {
    fn signal(&self) -> Signal {
        self.0.signal()
    }
}

impl Study for TrainStudy<'_> {
    fn stage(&self) -> Stage {
        let measures = vec![
            Measure::new("PSNR", "dB", Form::Decibels, "peak signal to noise ratio in held-out photos"),
            Measure::new("SSIM", "", Form::Share, "structural similarity to held-out photos"),
            Measure::new("Gaussians", "", Form::Error, "how many there are in the end"),
        ];
        // 2 % of the error are 0.17 dB.
        let rule = Rule { measure: "PSNR".into(), times: 1.02, floor: 0.0, spare_secs: 0.0 };
        let reference = "photos that training did not see, at the default's size";
        stage(StageName::Train, "training, evaluation left out", reference, &self.input, self.repeats, rule, measures)
    }

    fn cases(&self) -> Vec<Case> {
        self.plans.cases()
    }

    fn run(&mut self, case: &Case, seed: u64, observer: &mut dyn Observer) -> Result<Option<Trial>, StudyError> {
        let Some(plan) = self.plans.of(case) else { return Ok(None) };
        let config = TrainConfig { seed, ..plan.clone() };
        let outcome = train::run(self.dataset, &config, None, &mut Quiet(observer)).map_err(failed)?;
        if outcome.end == TrainEnd::Cancelled {
            return Ok(None);
        }
        let settings = config.render_settings(self.dataset.background);
        let e = evaluate(&outcome.cloud, &self.tests, &settings, outcome.steps, outcome.secs).map_err(failed)?;
        let values = vec![("PSNR", e.psnr), ("SSIM", e.ssim), ("Gaussians", e.gaussians as f64)];
        // Pictures of another size are scored at that size on the way: another curve.
        let comparable = config.max_side_px == self.base.max_side_px;
        let curve = outcome.evaluations.iter().filter(|_| comparable).map(|e| [e.secs, e.psnr]).collect();
        Ok(Some(Trial { secs: outcome.secs, values, curve }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knobs_are_fields_of_the_settings() {
        let base = TrainConfig::default();
        let plans = plans(&base).expect("every knob is a field");
        let default = plans.0.iter().filter(|(case, _)| case.default).count();
        assert_eq!(default, 1);
        for (case, config) in &plans.0 {
            assert_eq!(turned(&base, &case.knobs).expect("fits"), *config);
            assert!(case.default || *config != base, "{} {} turns nothing", case.method, case.setting);
        }
    }
}
