//! The table that justifies the program's defaults: for every knob what is chosen, what a rule
//! applied to the measurements would choose, and the numbers behind both. Written as Markdown by
//! `fmlgs report --defaults`.

use super::document::{Report, Stage, StageName};
use super::front::{KnobChoice, NOISE};
use super::table::{self, Rows};

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

/// The tables of all stages of these reports.
pub fn markdown(reports: &[Report]) -> String {
    let mut out = format!(
        "# Defaults and their evidence\n\n\
         Written by `fmlgs report --defaults`; do not edit. Each row is one knob of a stage. A rule, stated above \
         the table, is applied to the measurements of that knob's settings and of the default: *chosen* is what \
         it picks, *least error* the best setting whatever it costs. The default *holds* if it is good enough by \
         the rule and not more than {:.0} % slower than what is chosen, or slower by less than repeats \
         differ; where it does not, the last column says why it stays. Numbers are medians of the runs, with the least and \
         the most of them in brackets; compare times within a table only.\n",
        100.0 * NOISE
    );
    for report in reports {
        out += &format!(
            "\n## {}\n\nProgram {}, measured on: {}.\n",
            report.scene,
            report.program,
            report.computer.words()
        );
        report.stages.iter().for_each(|s| out += &stage(s));
    }
    out
}

fn stage(stage: &Stage) -> String {
    let choices = stage.choices();
    if choices.is_empty() && stage.orders.is_empty() {
        return String::new();
    }
    let input: Vec<String> = stage.input.iter().map(|(k, v)| format!("{k} {v}")).collect();
    let mut out = format!("\n### {}\n\nSeconds of {}; {}", stage.name.title(), stage.secs_of, stage.reference);
    out += &format!(" ({}; {}). ", input.join(", "), stage.runs());
    if let Some(far) = stage.stopped_at() {
        out += &format!("Stopped early: {far}. ");
    }
    if !choices.is_empty() {
        out += &format!("Chosen is {}.\n\n{}", stage.rule.words(), table::markdown(&with_reasons(stage)));
    }
    if !stage.orders.is_empty() {
        out += &format!("\n{}", table::markdown(&stage.order_table()));
    }
    out
}

/// Table of the rule's choice for each knob, with the reason for which its default stays where the rule differs.
fn with_reasons(stage: &Stage) -> Rows {
    let reason = |c: &KnobChoice<'_>| {
        let stays = STAYS.iter().find(|(name, knob, _)| (*name, *knob) == (stage.name, c.method));
        stays.filter(|_| !c.holds).map_or("", |s| s.2)
    };
    let choices = stage.choices();
    let column = std::iter::once("why it stays").chain(choices.iter().map(reason));
    let mut rows = stage.choice_table();
    rows.iter_mut().zip(column).for_each(|(row, cell)| row.push(cell.to_owned()));
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::tests::example;

    #[test]
    fn every_knob_has_its_row() {
        let text = markdown(&[example()]);
        let row = text.lines().find(|l| l.starts_with("| cut-off")).expect("a row");
        assert!(
            row.contains("1/64: 0.004000 (0.003600 to 0.004400) in 10.00 ms (9.000 ms to 11.00 ms)")
                && row.ends_with("| **no** |  |"),
            "{row}"
        );
        assert!(text.contains("; each setting 3 times). ") && text.contains("| samples | 2 | 2.00 | yes |"));
        assert!(text.contains("at most 1.0e-2 or 10 % over the least"));
    }
}
