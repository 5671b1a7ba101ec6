//! `fmlgs eval --depth`: drawn depth against the true depth of a synthetic data set.

use std::path::Path;

use serde_json::json;

use super::{CliError, output};
use crate::jobs::evaluate::{self, PhotoComparison};
use crate::pipeline::depth::{DepthErrors, EDGE_JUMP, EDGE_PX};
use crate::pipeline::observer::Observer;

pub(crate) fn run(
    scene: &Path,
    job: &PhotoComparison,
    as_json: bool,
    observer: &mut dyn Observer,
) -> Result<(), CliError> {
    let (scores, median_render_ms) = evaluate::depth(job, observer).map_err(CliError::of_views)?;
    if as_json {
        return output::print_json(&json!({
            "scene": scene,
            "gaussians": job.cloud.len(),
            "surfels": job.settings.surfels,
            "max_side_px": job.max_side_px,
            "views": job.views.len(),
            "edge_px": EDGE_PX,
            "edge_jump": EDGE_JUMP,
            "median_render_ms": median_render_ms,
            "scores": scores,
        }));
    }
    let head = ["depth", "pixels", "none %", "mean abs", "median abs", "RMSE", "mean rel %", "< 1 %", "< 2 %", "< 5 %"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    for (name, split) in [("expected", &scores.expected), ("median", &scores.median)] {
        rows.push(row(name, &split.all));
        rows.push(row(&format!("{name}, edges"), &split.edges));
    }
    output::print(&format!(
        "{}\n{} views, longer side {} px; abs and RMSE in scene units, shares in %",
        output::table(&rows),
        job.views.len(),
        job.max_side_px
    ))
}

fn row(name: &str, e: &DepthErrors) -> Vec<String> {
    let percent = |share: f64| format!("{:.2}", 100.0 * share);
    vec![
        name.to_owned(),
        e.pixels.to_string(),
        percent(e.missing),
        format!("{:.5}", e.mean_abs),
        format!("{:.5}", e.median_abs),
        format!("{:.5}", e.rmse),
        percent(e.mean_rel),
        percent(e.within_1),
        percent(e.within_2),
        percent(e.within_5),
    ]
}
