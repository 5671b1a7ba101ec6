//! Knobs of training, compared by held-out photos.

use serde_json::{Value, json};

use super::{StudyInput, Variants, error, overlap};
use crate::measure::sweep::failed;
use crate::measure::{ErrorKind, Measure, Rule, Stage, StageName, Study, StudyError, Trial, turned};
use crate::pipeline::evaluate::scores;
use crate::pipeline::observer::{Evaluation, Observer, Signal, Silent};
use crate::pipeline::train::{self, TrainConfig, TrainEnd, load_views};
use crate::render::{Features, Renderer};
use crate::scene::{Camera, Dataset};

/// Evaluations on the way, of which the curves are made.
const EVALUATIONS: u64 = 8;

/// The sweep of training on `dataset`; `base` is what is turned one knob at a time.
pub(crate) fn study(
    dataset: &Dataset,
    base: TrainConfig,
    repeats: u32,
    input: StudyInput,
) -> Result<Study<'_>, StudyError> {
    let base = TrainConfig { eval_every: (base.steps / EVALUATIONS).max(1), checkpoint_secs: 0.0, ..base };
    let held = dataset.split(base.holdout_every).1;
    let tests = load_views(dataset, &held, &base, "Loading held-out photos", &mut Silent).map_err(failed)?;
    let tests = tests.filter(|t| !t.is_empty()).ok_or_else(|| failed("no photo is held out"))?;
    let measures = vec![
        Measure::new("PSNR", "dB", ErrorKind::Decibels, "peak signal to noise ratio in held-out photos"),
        overlap("SSIM", "structural similarity to held-out photos"),
        error("Gaussians", "how many there are in the end"),
    ];
    // 2 % of the error are 0.17 dB.
    let rule = Rule::new("PSNR", 1.02, 0.0, 0.0);
    let words = ["training, evaluation left out", "photos that training did not see, at the default's size"];
    let stage = Stage::new(StageName::Train, words, (input, repeats), rule, measures);
    Ok(Study::new(stage, variants(&base)?.0, move |variant: &TrainConfig, seed, observer| {
        let config = TrainConfig { seed, ..variant.clone() };
        let outcome = train::run(dataset, &config, None, &mut Quiet(observer)).map_err(failed)?;
        if outcome.end == TrainEnd::Cancelled {
            return Ok(None);
        }
        let settings = config.render_settings(dataset.background, dataset.camera_extent().1);
        let mut renderer = Renderer::new();
        let draw = |camera: &Camera| renderer.render(&outcome.cloud, Features::NONE, camera, &settings);
        let e = Evaluation::of(scores(&tests, draw).map_err(failed)?, outcome.cloud.len(), outcome.steps, outcome.secs);
        let values = vec![("PSNR", e.psnr), ("SSIM", e.ssim), ("Gaussians", e.gaussians as f64)];
        // Images of another size are scored at that size on the way: another curve.
        let comparable = config.max_side_px == base.max_side_px;
        let curve = outcome.evaluations.iter().filter(|_| comparable).map(|e| [e.secs, e.psnr]).collect();
        Ok(Some(Trial { secs: outcome.secs, values, curve }))
    }))
}

fn variants(base: &TrainConfig) -> Result<Variants<TrainConfig>, StudyError> {
    let filter = if base.antialias { "filter" } else { "no filter" };
    let words = format!("{} steps, {} px, SH {}, {filter}", base.steps, base.max_side_px, base.sh_degree);
    let mut all = Variants::new(words, base.clone());
    let mut add = |method: &str, setting: String, name: &str, value: Value| -> Result<(), StudyError> {
        let knob = [(name, value)];
        let knobs = knob.iter().map(|(k, v)| ((*k).to_owned(), v.clone())).collect();
        all.add(method, setting, &knob, turned(base, &knobs).map_err(StudyError)?);
        Ok(())
    };
    // More of them are on the default's own curve.
    let steps = (base.steps / 2).max(1);
    add("steps", steps.to_string(), "steps", json!(steps))?;
    let side = base.max_side_px / 2;
    add("picture size", format!("{side} px"), "max_side_px", json!(side))?;
    add("half size at first", "30 % of the steps".into(), "coarse_share", json!(0.3))?;
    for most in [30_000, 120_000] {
        add("most Gaussians", most.to_string(), "max_gaussians", json!(most))?;
    }
    add("density control", "off".into(), "densify", json!(false))?;
    add("SH bands", "degree 1".into(), "sh_degree", json!(1))?;
    add("SH schedule", "all bands from the start".into(), "sh_at_once", json!(true))?;
    let filter = if base.antialias { "without the filter" } else { "with the filter" };
    add("anti-aliasing", filter.into(), "antialias", json!(!base.antialias))?;
    Ok(all)
}

/// Observer that passes the signal to stop on, and reports nothing.
struct Quiet<'a>(&'a mut dyn Observer);

impl Observer for Quiet<'_> {
    fn signal(&self) -> Signal {
        self.0.signal()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knobs_are_fields_of_the_settings() {
        let base = TrainConfig::default();
        let variants = variants(&base).expect("every knob is a field");
        let default = variants.0.iter().filter(|(case, _)| case.default).count();
        assert_eq!(default, 1);
        for (case, config) in &variants.0 {
            assert_eq!(turned(&base, &case.knobs).expect("fits"), *config);
            assert!(case.default || *config != base, "{} {} turns nothing", case.method, case.setting);
        }
    }
}
