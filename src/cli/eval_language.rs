//! `fmlgs eval --questions`: sentences with known answers.

use std::path::Path;

use serde_json::json;

use super::{CliError, output};
use crate::jobs::Scene;
use crate::jobs::evaluate_language::{self, LanguageTally};
use crate::pipeline::semantics::query::recipe::QueryConfig;

/// Missed sentences that are printed at most.
const LISTED: usize = 40;

pub(super) fn run(scene: &Scene, file: &Path, recipe: &QueryConfig, as_json: bool) -> Result<(), CliError> {
    let map = scene.semantics()?;
    let found = evaluate_language::run(scene, &map, file, recipe)?;
    if as_json {
        return output::print_json(
            &json!({ "scene": scene.path, "questions": file, "recipe": recipe, "result": found }),
        );
    }
    let row = |kind: &str, t: &LanguageTally| {
        let share = |n: usize| format!("{:.1} %", 100.0 * n as f64 / t.asked.max(1) as f64);
        vec![kind.to_owned(), t.asked.to_string(), share(t.right), share(t.open), share(t.wrong)]
    };
    let mut rows = vec![["questions", "asked", "right", "open", "wrong"].map(str::to_owned).to_vec()];
    rows.extend(found.by_kind.iter().map(|(kind, tally)| row(kind, tally)));
    rows.push(row("all", &found.total));
    rows.extend(found.controls.iter().map(|(what, tally)| row(&format!("control: {what}"), tally)));
    let mut text = output::table(&rows);
    text += &format!("\n{} left out as borderline; {:.3} ms a question", found.skipped, found.median_ms);
    for missed in found.missed.iter().filter(|m| m.wrong).take(LISTED) {
        text += &format!("\nwrong: '{}' is {}, answered {}", missed.text, missed.wanted, missed.got);
    }
    output::print(&text)
}
