//! The table that justifies the program's defaults: for every knob what is chosen, what a rule
//! applied to the measurements would choose, and the numbers behind both. Written as Markdown by
//! `fmlgs report --defaults`.

use super::document::{Report, Stage};
use super::front::NOISE;
use super::table;

/// The tables of all stages of these reports.
pub fn markdown(reports: &[Report]) -> String {
    let mut out = format!(
        "# Defaults and their evidence\n\n\
         Written by `fmlgs report --defaults`; do not edit. Each row is one knob of a stage. A rule, stated above \
         the table, is applied to the measurements of that knob's settings and of the default: *chosen* is what \
         it picks, *least error* the best setting whatever it costs. The default *holds* if it is good enough by \
         the rule and not more than {:.0} % slower than what is chosen, or slower by less than repeats \
         differ. Times are medians of repeats on the machine named; compare them within a table only.\n",
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
    out += &format!(" ({}; {} repeats). ", input.join(", "), stage.seeds.len());
    if !stage.complete() {
        out += &format!("Stopped early: {} of {} settings. ", stage.points.len(), stage.planned);
    }
    if !choices.is_empty() {
        out += &format!("Chosen is {}.\n\n{}", stage.rule.words(), table::markdown(&stage.choice_table()));
    }
    if !stage.orders.is_empty() {
        out += &format!("\n{}", table::markdown(&stage.order_table()));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::tests::example;

    #[test]
    fn every_knob_has_its_row() {
        let text = markdown(&[example()]);
        let row = text.lines().find(|l| l.starts_with("| cut-off")).expect("a row");
        assert!(row.contains("1/64: 0.004000 in 10.00 ms") && row.ends_with("| **no** |"), "{row}");
        assert!(text.contains("| samples | 2 | 2.00 | yes |"));
        assert!(text.contains("at most 1.0e-2 or 10 % over the least"));
    }
}
