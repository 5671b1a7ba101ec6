//! `fmlgs eval --removal`: what removing things uncovers and invents, against the truth.

use std::path::Path;

use serde_json::json;

use super::{CliError, output};
use crate::jobs::Scene;
use crate::jobs::evaluate::PhotoComparison;
use crate::jobs::evaluate_removal::{self, RemovalRow};
use crate::math::format::NONE;
use crate::pipeline::observer::Observer;
use crate::pipeline::removal::score::RegionScore;

pub(crate) fn run(
    scene: &Scene,
    truth: &Path,
    comparison: &PhotoComparison,
    as_json: bool,
    observer: &mut dyn Observer,
) -> Result<(), CliError> {
    let rows = evaluate_removal::run(scene, truth, comparison, observer).map_err(CliError::of_views)?;
    if as_json {
        return output::print_json(&json!({ "scene": scene.path, "rows": rows }));
    }
    let head = [
        "without",
        "fill",
        "uncovered px",
        "dB",
        "SSIM",
        "depth %",
        "invented px",
        "dB",
        "SSIM",
        "depth %",
        "shaded dB",
        "change",
        "outside dB",
        "change",
        "flat %",
        "Gaussians",
        "s",
        "found again",
    ];
    let mut table = vec![head.map(str::to_owned).to_vec()];
    table.extend(rows.iter().map(row));
    output::print(&output::table(&table))
}

fn row(r: &RemovalRow) -> Vec<String> {
    let region = |score: &Option<RegionScore>| match score {
        None => [NONE; 4].map(str::to_owned),
        Some(s) => [
            s.pixels.to_string(),
            format!("{:.2}", s.psnr),
            format!("{:.4}", s.ssim),
            format!("{:.2}", 100.0 * s.depth),
        ],
    };
    let way = r.paint.map_or("none".into(), |p| format!("{p:?}").to_lowercase());
    let mut cells = vec![r.name.clone(), if r.lift_shadow { way + ", lifted" } else { way }];
    cells.extend(region(&r.uncovered));
    cells.extend(region(&r.invented));
    for [before, after] in [&r.shaded, &r.outside] {
        cells.extend(match before.as_ref().zip(after.as_ref()) {
            Some((b, a)) => [format!("{:.2}", a.psnr), format!("{:+.3}", a.psnr - b.psnr)],
            None => [NONE; 2].map(str::to_owned),
        });
    }
    cells.push(format!("{:.0}", 100.0 * r.flat));
    cells.push(format!("-{} +{}", r.gaussians_removed, r.gaussians_invented));
    cells.extend([format!("{:.1}", r.secs), if r.found_again { "yes" } else { "no" }.to_owned()]);
    cells
}
