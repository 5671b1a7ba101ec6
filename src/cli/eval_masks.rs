//! `fmlgs eval --masks`: objects and parts against labeled photos, by one of the protocols.

use std::path::Path;

use serde_json::json;
use strum::VariantArray;

use super::{CliError, output};
use crate::jobs::evaluate::PhotoComparison;
use crate::jobs::evaluate_masks::{self, Protocol, ProtocolSummary};
use crate::math::format::count;
use crate::math::stats::mean;
use crate::pipeline::semantics::evaluation::Unit;
use crate::pipeline::semantics::evaluation::known_things::WorstOther;
use crate::pipeline::semantics::evaluation::limits::{Cause, LimitRow, SIZES};
use crate::pipeline::semantics::evaluation::part_recall::{HIT_IOU, Row};
use crate::pipeline::semantics::evaluation::recipes::RecipeRow;
use crate::pipeline::semantics::evaluation::strokes::{STROKES, StrokeRow};
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::scene::Level;

/// Rows of the table at most; the worst come first.
const ROWS: usize = 12;

pub(crate) fn run(
    scene: &Path,
    labels: &Path,
    (protocol, query, recipe): (Protocol, Option<&str>, &QueryConfig),
    comparison: &PhotoComparison,
    as_json: bool,
) -> Result<(), CliError> {
    evaluate_masks::label_notes(labels, comparison)?.into_iter().for_each(output::warn);
    let scores = evaluate_masks::run(comparison, scene, labels, protocol, query, recipe)?;
    let (name, views, trained, (miou, miou_by_view)) =
        (protocol.name(), scores.views, scores.trained_on, scores.miou());
    if as_json {
        let mut value = scores.json(protocol, recipe);
        if let Some(all) = value.as_object_mut() {
            all.extend([("scene".to_owned(), json!(scene)), ("units".to_owned(), json!(scores.units))]);
        }
        return output::print_json(&value);
    }
    let mut lines = vec![recipe.to_string()];
    lines.extend(scores.unmet.iter().map(|text| format!("note: {text}")));
    lines.push(summary(&scores.summary));
    if !protocol.has_units() && protocol != Protocol::PartRecall {
        return output::print(&lines.join("\n"));
    }
    if protocol.has_units() {
        lines.push(format!("mean IoU {miou:.4} over queries, {miou_by_view:.4} over views"));
    }
    let mut worst: Vec<&Unit> = scores.units.iter().collect();
    worst.sort_by(|a, b| a.iou.total_cmp(&b.iou));
    let mut rows = vec![["worst queries", "view", "IoU"].map(str::to_owned).to_vec()];
    rows.extend(worst.iter().take(ROWS).map(|u| vec![u.query.clone(), u.view.clone(), format!("{:.3}", u.iou)]));
    output::print(&format!(
        "{}\nprotocol {name}, {} queries in {views} views ({trained} of them trained on)\n{}",
        output::table(&rows),
        scores.units.len(),
        lines.join("\n")
    ))
}

/// Summary of the results of a protocol, in words.
fn summary(summary: &ProtocolSummary) -> String {
    match summary {
        ProtocolSummary::Masks { object_miou, part_miou } => {
            format!("mean IoU: objects {object_miou:.4}, parts {part_miou:.4}")
        }
        ProtocolSummary::Langsplat { localization } => format!("localization accuracy {localization:.4}"),
        ProtocolSummary::Limits { rows } => {
            format!("true labels of these views voted for all Gaussians\n{}", output::table(&limits(rows)))
        }
        ProtocolSummary::FastlgsEx {} => {
            "values are running pooled IoUs; not comparable with those of other protocols".to_owned()
        }
        ProtocolSummary::Selection3d { accuracy_25, accuracy_50 } => {
            format!("accuracy at 0.25 {accuracy_25:.4}, at 0.5 {accuracy_50:.4}")
        }
        ProtocolSummary::SpinNerf { accuracy } => format!("pixel accuracy {accuracy:.4}"),
        ProtocolSummary::Ovs3d { argmax_miou, classes } => {
            format!("arg-max over {classes} classes: mean IoU {argmax_miou:.4}")
        }
        ProtocolSummary::PartRecall { encoder, rows } => {
            let table = output::table(&ablation(rows));
            format!("recall at IoU {}, encoder '{encoder}'\n{table}", HIT_IOU)
        }
        ProtocolSummary::Strokes { gaussians, prepare_secs, rows } => {
            let table = output::table(&strokes(rows));
            let left: usize = rows.iter().flat_map(|r| r.left).sum();
            let along = rows.iter().flat_map(|r| r.along).filter(|is| *is).count();
            let [gaussians, left] = [*gaussians, left].map(|n| count(n as u64));
            format!(
                "{gaussians} Gaussians, made ready in {prepare_secs:.1} s; {left} of things that no stroke touched stay \
                 with these, and {along} lines change only what is along them\n{table}"
            )
        }
        ProtocolSummary::Recipes { absent, rows } => {
            let table = output::table(&recipes(rows, *absent));
            format!("found with IoU {HIT_IOU}; what is absent is rightly not found\n{table}")
        }
    }
}

/// Scores, limits and losses by kind of label.
fn limits(rows: &[LimitRow]) -> Vec<Vec<String>> {
    let sizes = SIZES.map(|size| if size == 1 { "limit".into() } else { format!("at 1/{size}") });
    let causes = Cause::VARIANTS.iter().map(|cause| <&str>::from(cause).to_owned());
    let head = ["", "labels", "IoU"].map(str::to_owned);
    let mut table = vec![head.into_iter().chain(sizes).chain(causes).collect::<Vec<_>>()];
    table.extend(rows.iter().map(|r| {
        let values = [r.iou].into_iter().chain(r.limits).chain(r.lost);
        [r.labels.to_owned(), r.count.to_string()].into_iter().chain(values.map(|v| format!("{v:.3}"))).collect()
    }));
    table
}

/// Things by how well strokes select them, the worst first, and the means; of corrections, also the largest loss of any
/// other thing by each stroke.
fn strokes(rows: &[StrokeRow]) -> Vec<Vec<String>> {
    let mut sorted: Vec<&StrokeRow> = rows.iter().collect();
    sorted.sort_by(|a, b| a.iou[STROKES].total_cmp(&b.iou[STROKES]));
    let head = ["", "level", "drawn in", "before", "1 stroke", "2", "3", "ms"];
    let others = ["worst other by 1", "by 2", "by 3", "which"];
    let has_others = rows.iter().any(|r| !r.others.is_empty());
    let mut table =
        vec![head.into_iter().chain(others.into_iter().filter(|_| has_others)).map(str::to_owned).collect()];
    let row = |name: &str, level: &str, view: &str, of: &[&StrokeRow]| {
        let after = |k: usize| mean(&of.iter().map(|r| r.iou[k]).collect::<Vec<_>>());
        let ms: Vec<f64> = of.iter().flat_map(|r| r.ms).filter(|ms| *ms > 0.0).collect();
        let mut row = [name, level, view].map(str::to_owned).to_vec();
        row.extend((0..=STROKES).map(|k| format!("{:.3}", after(k))).chain([format!("{:.0}", mean(&ms))]));
        let lost =
            |k: usize| of.iter().filter_map(move |r| r.others.get(k)).min_by(|a, b| a.change.total_cmp(&b.change));
        let worst: Vec<&WorstOther> = (0..STROKES).filter_map(lost).collect();
        row.extend(worst.iter().map(|worst| format!("{:.3}", worst.change)));
        row.extend(worst.into_iter().min_by(|a, b| a.change.total_cmp(&b.change)).map(|worst| worst.name.clone()));
        row
    };
    let level = |r: &StrokeRow| if r.level == Level::Object { "object" } else { "part" };
    table.extend(sorted.iter().map(|r| row(&r.name, level(r), &r.drawn_in, &[*r])));
    for (what, is) in [("objects", Level::Object), ("parts", Level::Part)] {
        let of: Vec<&StrokeRow> = rows.iter().filter(|r| r.level == is).collect();
        table.push(row(&format!("mean of {} {what}", of.len()), "", "", &of));
    }
    table
}

/// Recipes by what they find and what they rightly do not, as a table.
fn recipes(rows: &[RecipeRow], [kinds, colors, parts]: [usize; 3]) -> Vec<Vec<String>> {
    let percent = |share: &f64| format!("{:.0}", 100.0 * share);
    let head = ["objects", "parts", "compounds"].map(|what| format!("{what} found %"));
    let right = [("kinds", kinds), ("colors", colors), ("parts", parts)];
    let right = right.map(|(what, n)| format!("of {n} absent {what} %"));
    let mut table = vec![["".to_owned()].into_iter().chain(head).chain(right).chain(["ms".to_owned()]).collect()];
    table.extend(rows.iter().map(|r| {
        let shares = r.recall.iter().chain(&r.rejected).map(percent);
        std::iter::once(r.title.clone()).chain(shares).chain([format!("{:.2}", r.mean_ms)]).collect()
    }));
    table
}

/// The paper's ablation as a table.
fn ablation(rows: &[Row]) -> Vec<Vec<String>> {
    let tick = |on: bool| if on { "x" } else { "" }.to_owned();
    let mut table = vec![["ME", "SD", "ML", "recall %", "mean IoU", "ms"].map(str::to_owned).to_vec()];
    table.extend(rows.iter().map(|r| {
        let c = r.components;
        vec![
            tick(c.extraction),
            tick(c.deviation),
            if c.joint { "joint".into() } else { tick(c.localization) },
            format!("{:.1}", 100.0 * r.recall),
            format!("{:.3}", r.mean_iou),
            format!("{:.2}", 1e3 * r.mean_secs),
        ]
    }));
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_loss_of_others_stands_beside_each_stroke_of_a_correction() {
        let worst = |name: &str, change| WorstOther { name: name.into(), change };
        let row = |name: &str, others| StrokeRow {
            name: name.into(),
            level: Level::Part,
            drawn_in: "view".into(),
            views: 2,
            iou: [0.5; STROKES + 1],
            ms: [1.0; STROKES],
            others,
            left: [0; STROKES],
            along: [false; STROKES],
        };
        let mouth = row("mouth", vec![worst("", 0.0), worst("face", -0.25), worst("ear", -0.125)]);
        let ear = row("ear", vec![worst("mouth", -0.5), worst("", 0.0), worst("", 0.0)]);
        let table = strokes(&[mouth, ear]);
        let others = |k: usize| table[k][8..].to_vec();
        assert_eq!(others(0), ["worst other by 1", "by 2", "by 3", "which"]);
        assert_eq!(others(1), ["0.000", "-0.250", "-0.125", "face"]);
        assert_eq!(others(4), ["-0.500", "-0.250", "-0.125", "mouth"], "the worst of all parts");
        assert!(others(3).is_empty(), "there are no objects");
        // The control: things that are only selected.
        assert!(strokes(&[row("mouth", Vec::new())]).iter().all(|row| row.len() == 8));
    }
}
