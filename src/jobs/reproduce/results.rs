//! Rows of other methods' results in a table, one for each rule that makes masks. They are measured at each call, so that
//! results can be added to a table that is finished.

use std::collections::BTreeMap;

use super::layout::SceneInput;
use super::printed::{LOCALIZATION, MIOU, RECALL};
use super::rows::{ARGMAX, PART_IOU, RowResult};
use super::scene::SceneResult;
use super::{PaperTable, ReproduceRequest};
use crate::io::results::ResultOptions;
use crate::jobs::JobError;
use crate::jobs::compare::protocol::{self, ResultEvaluation, ResultScores};
use crate::jobs::compare::subject::CompareSubject;
use crate::jobs::compare::vectors::InstalledEncoders;
use crate::jobs::compare::views::WantedViews;
use crate::jobs::evaluate_masks::Protocol;
use crate::pipeline::observer::Observer;
use crate::pipeline::semantics::evaluation::Unit;
use crate::pipeline::semantics::evaluation::part_recall::HIT_IOU;
use crate::scene::Level;

/// Reports what is wrong with results before hours of training, not after.
pub(super) fn check(request: &ReproduceRequest, scenes: &[SceneInput]) -> Result<(), JobError> {
    for (name, path) in &request.results {
        let bad = |why: String| Err(JobError::Protocol(format!("--result {name}={}: {why}", path.display())));
        if protocol_of(request.settings.table).is_none() {
            return bad("only the tables lerf-ovs, 3d-ovs and part-ablation have rows of results".into());
        }
        if !scenes.iter().any(|scene| scene.name == *name) {
            return bad(format!("{} has no scene '{name}'", request.data.display()));
        }
        let Some(encoder) = opened(path)?.encoder else {
            return bad("it knows no language, and is asked nothing here".into());
        };
        if let Err(e) = crate::models::encoder(&encoder) {
            return bad(format!("it is asked with '{encoder}': {e}; 'fmlgs models fetch' brings it"));
        }
    }
    Ok(())
}

fn opened(path: &std::path::Path) -> Result<CompareSubject, JobError> {
    CompareSubject::open(path, &ResultOptions::default())
}

/// Adds the rows of a scene's results. Returns notes on them.
pub(super) fn add(
    result: &mut SceneResult,
    input: &SceneInput,
    request: &ReproduceRequest,
    observer: &mut dyn Observer,
) -> Result<Vec<String>, JobError> {
    let mut notes = Vec::new();
    let Some(protocol) = protocol_of(request.settings.table) else { return Ok(notes) };
    let mut encoders = InstalledEncoders::default();
    let mut encode = |name: &str, phrases: &[&str]| encoders.encode(name, phrases);
    for (_, path) in request.results.iter().filter(|(name, _)| *name == input.name) {
        let how = ResultEvaluation {
            labels: input.labels.clone(),
            views: WantedViews::Named(result.views.clone()),
            photos: Some(input.photos.clone()),
            max_side_px: Some(request.settings.train.max_side_px),
            protocol,
        };
        let scores = protocol::evaluate(opened(path)?, &how, &mut encode, observer)?;
        for rule in &scores.rules {
            let rule_name: &str = rule.rule.into();
            let place = path.display();
            notes.push(format!("{}, {rule_name} rule, {} ({place}): {}.", scores.method, input.name, rule.words));
        }
        result.rows.extend(rows(&scores, request.settings.table));
    }
    Ok(notes)
}

fn protocol_of(table: PaperTable) -> Option<Protocol> {
    match table {
        PaperTable::LerfOvs => Some(Protocol::Langsplat),
        PaperTable::Ovs3d => Some(Protocol::Ovs3d),
        PaperTable::PartAblation => Some(Protocol::PartRecall),
        PaperTable::SpinNerf | PaperTable::RefLerf => None,
    }
}

/// Percentages of every query, by metric.
fn rows(scores: &ResultScores, table: PaperTable) -> Vec<RowResult> {
    let percent = |values: &mut dyn Iterator<Item = f64>| values.map(|v| 100.0 * v).collect::<Vec<f64>>();
    let iou = |units: &[Unit]| percent(&mut units.iter().map(|u| u.iou));
    let mut rows = Vec::new();
    for rule in &scores.rules {
        let rule_name: &str = rule.rule.into();
        let units = &rule.units;
        let mut of: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        match table {
            PaperTable::PartAblation => {
                let parts: Vec<Unit> = units.iter().filter(|u| u.level == Level::Part).cloned().collect();
                let found = percent(&mut parts.iter().map(|u| f64::from(u.iou >= HIT_IOU)));
                of.extend([(RECALL.to_owned(), found), (PART_IOU.to_owned(), iou(&parts))]);
            }
            PaperTable::LerfOvs => {
                of.insert(MIOU.to_owned(), iou(units));
                let hits = percent(&mut units.iter().filter_map(|u| u.hit).map(f64::from));
                if !hits.is_empty() {
                    of.insert(LOCALIZATION.to_owned(), hits);
                }
            }
            _ => drop(of.insert(MIOU.to_owned(), iou(units))),
        }
        rows.push(RowResult { name: format!("{}, {rule_name} rule", scores.method), scores: of });
    }
    if scores.argmax_miou.is_some() {
        let of = BTreeMap::from([(ARGMAX.to_owned(), iou(&scores.argmax_units))]);
        rows.push(RowResult { name: format!("{}, most relevant class", scores.method), scores: of });
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::semantics::evaluation::by_rule::{CutRule, RuleScores};

    fn scores() -> ResultScores {
        let unit = |level, iou, hit| Unit { view: "v".into(), query: "q".into(), level, iou, hit };
        let rule = |rule, units: Vec<Unit>| RuleScores {
            rule,
            words: "x",
            miou: 0.0,
            miou_by_view: 0.0,
            object_miou: 0.0,
            part_miou: 0.0,
            part_recall: 0.0,
            localization: None,
            units,
        };
        let of = |hit| vec![unit(Level::Object, 1.0, hit), unit(Level::Part, 0.25, hit)];
        ResultScores {
            method: "LangSplat".into(),
            protocol: "langsplat".into(),
            views: vec!["v".into()],
            queries: 2,
            rules: vec![rule(CutRule::Own, of(None)), rule(CutRule::Common, of(Some(true)))],
            argmax_miou: Some(0.5),
            argmax_units: vec![unit(Level::Object, 0.5, None)],
            notes: Vec::new(),
        }
    }

    #[test]
    fn rules_of_a_result_are_rows_with_the_metrics_of_their_table() {
        let names = |rows: &[RowResult]| rows.iter().map(|r| r.name.clone()).collect::<Vec<_>>();
        let lerf = rows(&scores(), PaperTable::LerfOvs);
        let wanted = ["LangSplat, own rule", "LangSplat, common rule", "LangSplat, most relevant class"];
        assert_eq!(names(&lerf), wanted);
        assert_eq!(lerf[0].scores.get(MIOU), Some(&vec![100.0, 25.0]));
        assert_eq!((lerf[0].scores.get(LOCALIZATION), lerf[1].scores.get(LOCALIZATION)), (None, Some(&vec![100.0; 2])));
        let parts = rows(&scores(), PaperTable::PartAblation);
        assert_eq!(parts[0].scores.get(RECALL), Some(&vec![0.0]));
        assert_eq!(parts[0].scores.get(PART_IOU), Some(&vec![25.0]), "the control: objects do not count");
        let classes = rows(&scores(), PaperTable::Ovs3d);
        assert_eq!(classes[2].scores.get(ARGMAX), Some(&vec![50.0]));
        assert!(protocol_of(PaperTable::SpinNerf).is_none() && protocol_of(PaperTable::RefLerf).is_none());
    }
}
