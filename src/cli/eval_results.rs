//! `fmlgs eval --masks` of another method's result: a row for each rule that makes masks.

use serde_json::json;

use super::progress::Console;
use super::{CliError, output};
use crate::jobs::compare::protocol::{self, ResultEvaluation, ResultScores};
use crate::jobs::compare::subject::CompareSubject;
use crate::jobs::compare::vectors::InstalledEncoders;
use crate::jobs::evaluate_masks::Protocol;
use crate::math::format::things;

pub(super) fn run(
    scene: CompareSubject,
    request: &ResultEvaluation,
    as_json: bool,
    quiet: bool,
) -> Result<(), CliError> {
    let path = scene.path.clone();
    let mut encoders = InstalledEncoders::default();
    let mut console = Console::new(quiet || as_json);
    let mut encode = |name: &str, phrases: &[&str]| encoders.encode(name, phrases);
    let scores = protocol::evaluate(scene, request, &mut encode, &mut console).map_err(CliError::of_views)?;
    drop(console);
    scores.notes.iter().cloned().for_each(output::warn);
    if as_json {
        return output::print_json(&json!({ "scene": path, "result": scores }));
    }
    let queries = if scores.queries == 1 { "query".to_owned() } else { "queries".to_owned() };
    let mut text = output::table(&table(request.protocol, &scores));
    if let Some(miou) = scores.argmax_miou {
        text += &format!("\narg-max over all classes, by relevancy: mean IoU {miou:.4}");
    }
    text += &format!(
        "\n{}, protocol {}, {} {queries} in {}",
        scores.method,
        scores.protocol,
        scores.queries,
        things(scores.views.len(), "view")
    );
    for row in &scores.rules {
        text += &format!("\n{} rule: {}", <&str>::from(row.rule), row.words);
    }
    output::print(&text)
}

/// Scores that the protocol is about, by rule.
fn table(protocol: Protocol, scores: &ResultScores) -> Vec<Vec<String>> {
    let head: &[&str] = match protocol {
        Protocol::Langsplat => &["rule", "localization", "mean IoU", "by view"],
        Protocol::PartRecall => &["rule", "parts found %", "parts' IoU", "mean IoU"],
        Protocol::Ovs3d => &["rule", "mean IoU", "by view"],
        _ => &["rule", "objects' IoU", "parts' IoU", "mean IoU"],
    };
    let number = |v: f64| if v.is_finite() { format!("{v:.4}") } else { "-".to_owned() };
    let mut rows = vec![head.iter().map(|h| (*h).to_owned()).collect()];
    rows.extend(scores.rules.iter().map(|r| {
        let localized = r.localization.unwrap_or(f64::NAN);
        let values = match protocol {
            Protocol::Langsplat => vec![localized, r.miou, r.miou_by_view],
            Protocol::PartRecall => vec![100.0 * r.part_recall, r.part_miou, r.miou],
            Protocol::Ovs3d => vec![r.miou, r.miou_by_view],
            _ => vec![r.object_miou, r.part_miou, r.miou],
        };
        std::iter::once(<&str>::from(r.rule).to_owned()).chain(values.into_iter().map(number)).collect()
    }));
    rows
}
