//! Knobs of drawn depth against the true depth of synthetic photos.

use serde_json::json;

use super::{Input, Plans, stage, timed};
use crate::math::stats::mean;
use crate::pipeline::depth::{Samples, TrueDepth};
use crate::pipeline::observer::Observer;
use crate::render::cpu::Renderer;
use crate::render::{Cutoffs, Features, RenderSettings};
use crate::report::document::Form;
use crate::report::sweep::failed;
use crate::report::{Case, Measure, Rule, Stage, StageName, Study, StudyError, Trial};
use crate::scene::{Camera, GaussianCloud};

/// Which of a pixel's depths is taken.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    /// At which half of the light is spent.
    Median,
    /// The mean along the ray.
    Expected,
}

#[derive(Clone)]
struct Plan {
    kind: Kind,
    /// Pictures are smaller by this factor.
    smaller: u32,
    settings: RenderSettings,
}

/// The sweep of depth.
pub struct DepthStudy<'a> {
    cloud: &'a GaussianCloud,
    views: Vec<(Camera, TrueDepth)>,
    input: Input,
    repeats: u32,
    plans: Plans<Plan>,
}

impl<'a> DepthStudy<'a> {
    /// Of `cloud`, drawn by `settings`, in views whose depth is known at full size.
    pub fn new(
        cloud: &'a GaussianCloud,
        settings: &RenderSettings,
        views: Vec<(Camera, TrueDepth)>,
        repeats: u32,
        input: Input,
    ) -> Self {
        let settings = RenderSettings { depth: true, sh_degree: 0, ..settings.clone() };
        Self { cloud, views, input, repeats, plans: plans(&settings) }
    }
}

fn plans(settings: &RenderSettings) -> Plans<Plan> {
    let plan = |kind, smaller, settings: &RenderSettings| Plan { kind, smaller, settings: settings.clone() };
    let mut all = vec![(Case::default("median depth"), plan(Kind::Median, 1, settings))];
    let mut add = |method: &str, setting: String, knobs: &[(&str, serde_json::Value)], plan: Plan| {
        all.push((Case::new(method, setting, knobs), plan));
    };
    add("kind", "expected depth".into(), &[("kind", json!("expected"))], plan(Kind::Expected, 1, settings));
    for smaller in [2, 4] {
        let knobs = [("scale", json!(1.0 / f64::from(smaller)))];
        add("resolution", format!("1/{smaller} of the size"), &knobs, plan(Kind::Median, smaller, settings));
    }
    for (alpha, name) in [(1.0 / 32.0, "1/32"), (1.0 / 1024.0, "1/1024")] {
        let cutoffs = Cutoffs { alpha, ..Cutoffs::default() };
        let settings = RenderSettings { cutoffs, ..settings.clone() };
        add("alpha cut-off", name.into(), &[("cutoffs", json!(cutoffs))], plan(Kind::Median, 1, &settings));
    }
    for (transmittance, name) in [(0.4, "0.4"), (1e-2, "1e-2")] {
        let cutoffs = Cutoffs { transmittance, ..Cutoffs::default() };
        let settings = RenderSettings { cutoffs, ..settings.clone() };
        add("transmittance cut-off", name.into(), &[("cutoffs", json!(cutoffs))], plan(Kind::Median, 1, &settings));
    }
    Plans(all)
}

impl Study for DepthStudy<'_> {
    fn stage(&self) -> Stage {
        let error = |name: &str, unit: &str, meaning: &str| Measure::new(name, unit, Form::Error, meaning);
        let measures = vec![
            error("relative error", "", "mean of |drawn - true| over the true depth"),
            error("edges", "", "the same within two pixels of a jump of the true depth"),
            error("median error", "units", "median of |drawn - true| in scene units"),
            error("missing", "", "share of pixels that show something and have no depth"),
        ];
        let rule = Rule { measure: "relative error".into(), times: 1.05, floor: 0.0, spare_secs: 0.0 };
        let reference = "depths found by casting rays at the scene's triangles";
        stage(StageName::Depth, "one view, drawn with depth", reference, &self.input, self.repeats, rule, measures)
    }

    fn cases(&self) -> Vec<Case> {
        self.plans.cases()
    }

    fn run(&mut self, case: &Case, _seed: u64, observer: &mut dyn Observer) -> Result<Option<Trial>, StudyError> {
        let Some(plan) = self.plans.of(case) else { return Ok(None) };
        let (mut all, mut edges, mut secs) = (Samples::default(), Samples::default(), Vec::new());
        let mut renderer = Renderer::<f32>::new();
        for (camera, truth) in &self.views {
            if observer.proceed().is_err() {
                return Ok(None);
            }
            let size = [camera.width_px / plan.smaller, camera.height_px / plan.smaller];
            let small = camera.resized(size[0].max(1), size[1].max(1));
            let draw = || renderer.render(self.cloud, Features::NONE, &small, &plan.settings).map_err(failed);
            let (frame, took) = timed(draw)?;
            secs.push(took);
            // Compared at the size of the default, whatever size was drawn.
            let truth = truth.resampled(camera.width_px as usize, camera.height_px as usize);
            let drawn = match plan.kind {
                Kind::Median => frame.median_depth,
                Kind::Expected => frame.expected_depth(),
            };
            let near = |i: usize| {
                let (x, y) = (i % truth.width, i / truth.width);
                let (u, v) = (x * frame.width_px / truth.width, y * frame.height_px / truth.height);
                drawn.get(v * frame.width_px + u).copied().unwrap_or(0.0)
            };
            for (i, (&want, edge)) in truth.values.iter().zip(truth.edges()).enumerate() {
                all.add(near(i), want);
                if edge {
                    edges.add(near(i), want);
                }
            }
        }
        let (all, edges) = (all.errors(), edges.errors());
        let values = vec![
            ("relative error", all.mean_rel),
            ("edges", edges.mean_rel),
            ("median error", all.median_abs),
            ("missing", all.missing),
        ];
        Ok(Some(Trial { secs: mean(&secs), values, curve: Vec::new() }))
    }
}
