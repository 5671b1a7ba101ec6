//! Knobs of drawn depth, compared with the true depth of synthetic photos.

use serde_json::json;

use super::{StudyInput, Variants, error, timed};
use crate::math::stats::mean;
use crate::measure::sweep::failed;
use crate::measure::{ErrorKind, Measure, Rule, Stage, StageName, Study, Trial};
use crate::pipeline::depth::{Samples, TrueDepth};
use crate::render::{Cutoffs, Features, RenderSettings, Renderer};
use crate::scene::{Camera, GaussianCloud};

struct Variant {
    /// True for the mean along the ray; false for the depth at which half of the light is spent.
    expected: bool,
    smaller: u32,
    settings: RenderSettings,
}

/// The sweep of the depth of `cloud`, drawn by `settings`, in views whose depth is known at full size.
pub(crate) fn study<'a>(
    cloud: &'a GaussianCloud,
    settings: &RenderSettings,
    views: Vec<(Camera, TrueDepth)>,
    repeats: u32,
    input: StudyInput,
) -> Study<'a> {
    let measures = vec![
        error("relative error", "mean of |drawn - true| over the true depth"),
        error("edges", "the same within two pixels of a jump of the true depth"),
        Measure::new("median error", "units", ErrorKind::Error, "median of |drawn - true| in scene units"),
        error("missing", "share of pixels that show something and have no depth"),
    ];
    let rule = Rule::new("relative error", 1.05, 0.0, 0.0);
    let words = ["one view, drawn with depth", "depths found by casting rays at the scene's triangles"];
    let stage = Stage::new(StageName::Depth, words, (input, repeats), rule, measures);
    let mut renderer = Renderer::new();
    Study::new(stage, variants(settings).0, move |variant: &Variant, _seed, observer| {
        let (mut all, mut edges, mut secs) = (Samples::default(), Samples::default(), Vec::new());
        for (camera, truth) in &views {
            if observer.proceed().is_err() {
                return Ok(None);
            }
            let [width, height] = [camera.width_px, camera.height_px].map(|side| (side / variant.smaller).max(1));
            let small = camera.resized(width, height);
            let draw = || renderer.render(cloud, Features::NONE, &small, &variant.settings).map_err(failed);
            let (frame, took) = timed(draw)?;
            secs.push(took);
            // Compared at the size of the default, whatever size was drawn.
            let truth = truth.resampled(camera.width_px as usize, camera.height_px as usize);
            let drawn = if variant.expected { frame.expected_depth() } else { frame.median_depth };
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
    })
}

fn variants(settings: &RenderSettings) -> Variants<Variant> {
    let settings = RenderSettings { depth: true, sh_degree: 0, ..settings.clone() };
    let variant = |expected, smaller| Variant { expected, smaller, settings: settings.clone() };
    let mut all = Variants::new("median depth", variant(false, 1));
    all.add("kind", "expected depth", &[("kind", json!("expected"))], variant(true, 1));
    for smaller in [2, 4] {
        let knobs = [("scale", json!(1.0 / f64::from(smaller)))];
        all.add("resolution", format!("1/{smaller} of the size"), &knobs, variant(false, smaller));
    }
    let usual = Cutoffs::default();
    for (method, setting, cutoffs) in [
        ("alpha cut-off", "1/32", Cutoffs { alpha: 1.0 / 32.0, ..usual }),
        ("alpha cut-off", "1/1024", Cutoffs { alpha: 1.0 / 1024.0, ..usual }),
        ("transmittance cut-off", "0.4", Cutoffs { transmittance: 0.4, ..usual }),
        ("transmittance cut-off", "1e-2", Cutoffs { transmittance: 1e-2, ..usual }),
    ] {
        let settings = RenderSettings { cutoffs, ..settings.clone() };
        all.add(method, setting, &[("cutoffs", json!(cutoffs))], Variant { settings, ..variant(false, 1) });
    }
    all
}
