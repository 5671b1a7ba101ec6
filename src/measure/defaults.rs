//! The table that justifies the program's defaults: for every knob what is chosen, what a rule
//! applied to the measurements would choose, and the numbers behind both. Written as Markdown by
//! `fmlgs report --defaults`.

use super::document::{Report, Stage, StageName};
use super::front::{KnobChoice, NOISE};
use super::table;

/// Reasons for which a default stays though the rule would choose another setting, by stage and knob.
const STAYS: [(StageName, &str, &str); 11] = [
    (
        StageName::Render,
        "alpha cut-off",
        "3DGS's: scenes are trained with it, here and elsewhere, and look as trained with no other",
    ),
    (
        StageName::Train,
        "most Gaussians",
        "more always gain something, for time and memory; since this was measured, photos under 200,000 px may have more",
    ),
    (StageName::Train, "anti-aliasing", "with the filter is the default since this was measured"),
    (StageName::Train, "half size at first", "gains on one scene of three"),
    (StageName::Train, "SH schedule", "gains on one scene of three, loses on another"),
    (StageName::Features, "views used", "where most photos are labeled a part of them would do; mostly few are"),
    (StageName::Features, "gradients, exact", "a hundredth of overlap for ten times the time"),
    (StageName::Features, "votes, then gradients, exact", "a hundredth of overlap for ten times the time"),
    (StageName::Depth, "transmittance cut-off", "depth comes with the colors, which need the rest"),
    (StageName::Query, "part features", "the paper's; it depends on the encoder, and this is the one that ships"),
    (StageName::Query, "encoder", "names alone know no words but the labels'"),
];

/// The choices of all stages of these reports as one table, how each stage was measured, and orders of convergence.
pub fn markdown(reports: &[Report]) -> String {
    let mut out = format!(
        "# Defaults and their evidence\n\n\
         Written by `fmlgs report --defaults`; do not edit. One row is one knob. *Chosen* is what the stage's rule picks \
         from the measurements, *least error* the best setting at any cost. The default *holds* if the rule accepts its \
         error and it is at most {:.0} % slower than the chosen setting, or as fast within repeats; otherwise the last \
         column says why it stays. Numbers are medians of the runs, with the range in brackets where there are several. \
         Compare times within a stage of one scene only.\n",
        100.0 * NOISE
    );
    let stages = || reports.iter().flat_map(|r| r.stages.iter().map(move |s| (r, s)));
    let choices = stages().flat_map(|(r, s)| with_reasons(r, s));
    let head = ["scene", "stage", "knob", "chosen", "least error", "holds", "why it stays"];
    out += &format!("\n{}", table::markdown(&table::rows(&head, choices)));
    let measured = stages().filter(|(_, s)| !s.choices().is_empty()).map(|(r, s)| measurement(r, s));
    let head = ["scene", "stage", "default", "seconds of", "errors against", "measured on", "chosen is"];
    out += &format!("\n## How each stage was measured\n\n{}", table::markdown(&table::rows(&head, measured)));
    let orders = stages().flat_map(|(r, s)| {
        let named = move |row: Vec<String>| place(r, s).into_iter().chain(row).collect::<Vec<_>>();
        table::orders(s).into_iter().skip(1).map(named)
    });
    let head = ["scene", "stage", "convergence", "expected order", "observed", "agrees"];
    out += &format!("\n## Convergence\n\n{}", table::markdown(&table::rows(&head, orders)));
    out += "\n## Scenes\n\n";
    for r in reports {
        out += &format!("- {}: program {}, {}\n", r.scene, r.program, r.computer.words());
    }
    out
}

/// The first cells of a row: the scene up to its first comma, and the stage.
fn place(report: &Report, stage: &Stage) -> [String; 2] {
    let scene = report.scene.split(',').next().unwrap_or_default();
    [scene.to_owned(), stage.name.title().to_owned()]
}

/// Row that says what a stage's default costs, on what it was measured, and by which rule a setting is chosen.
fn measurement(report: &Report, stage: &Stage) -> Vec<String> {
    let input: Vec<String> = stage.input.iter().map(|(k, v)| format!("{k} {v}")).collect();
    let stopped = stage.stopped_at().map_or_else(String::new, |far| format!("; stopped early: {far}"));
    let default = table::choices(stage).get(1).and_then(|row| row.get(1)).cloned().unwrap_or_default();
    let input = format!("{}; {}{stopped}", input.join(", "), stage.runs());
    let cells = [default, stage.secs_of.clone(), stage.reference.clone(), input, stage.rule.words()];
    place(report, stage).into_iter().chain(cells).collect()
}

/// Rows of the rule's choice for each knob, with the reason for which its default stays where the rule differs.
fn with_reasons(report: &Report, stage: &Stage) -> Vec<Vec<String>> {
    let reason = |c: &KnobChoice<'_>| {
        let stays = STAYS.iter().find(|(name, knob, _)| (*name, *knob) == (stage.name, c.method));
        stays.filter(|_| !c.holds).map_or("", |s| s.2).to_owned()
    };
    let rows = table::choices(stage).into_iter().skip(1).zip(stage.choices());
    let named = rows.map(|(mut row, choice)| {
        // All rows of a stage have the same default, which the second table names.
        row.remove(1);
        place(report, stage).into_iter().chain(row).chain([reason(&choice)]).collect::<Vec<_>>()
    });
    named.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::tests::example;

    #[test]
    fn every_knob_has_its_row() {
        let text = markdown(&[example()]);
        let row = text.lines().find(|l| l.contains("| cut-off |")).expect("a row");
        assert!(
            row.contains("1/64: 0.004000 (0.003600 to 0.004400) in 10.00 ms (9.000 ms to 11.00 ms)")
                && row.ends_with("| **no** |  |"),
            "{row}"
        );
        assert!(text.contains("; each setting 3 times") && text.contains("| samples | 2 | 2.00 | yes |"));
        assert!(text.contains("at most 1.0e-2 or 10 % over the least"));
    }
}
