//! A report's tables beside the plot: measurements, comparison, choices, orders of convergence.

use egui::{Color32, Grid, RichText, Ui};

use super::super::super::theme;
use super::scatter;
use crate::math::format;
use crate::measure::{Measure, Point, Report, Stage, StageComparison, table};
use crate::scene::text;

/// Largest number of characters of a setting in a table.
const MOST_LETTERS: usize = 34;

/// Draws the measured settings; returns the one that was clicked.
pub(crate) fn points<'a>(
    ui: &mut Ui,
    stage: &'a Stage,
    measure: &Measure,
    selected: Option<&Point>,
) -> Option<&'a Point> {
    let methods = stage.methods();
    let front = stage.front(measure);
    let mut clicked = None;
    Grid::new("points").num_columns(4).striped(true).spacing([12.0, 1.0]).min_row_height(20.0).show(ui, |ui| {
        head(ui, &["setting", "time", &table::title(measure), "front"]);
        for (i, p) in stage.points.iter().enumerate() {
            let k = methods.iter().position(|m| *m == p.method).unwrap_or(0);
            let is_selected = selected.is_some_and(|s| std::ptr::eq(s, p));
            let text = text::elided(&title(p), MOST_LETTERS);
            let row = ui.selectable_label(is_selected, RichText::new(text).color(scatter::color(k)));
            if row.on_hover_text(title(p)).clicked() {
                clicked = Some(p);
            }
            ui.label(table::spread(&p.secs, format::seconds));
            ui.label(value(p, measure));
            ui.label(if front.contains(&i) { "\u{2022}" } else { "" });
            ui.end_row();
        }
    });
    clicked
}

pub(crate) fn title(p: &Point) -> String {
    format!("{}: {}", p.method, p.setting)
}

fn value(p: &Point, measure: &Measure) -> String {
    p.values.get(&measure.name).map_or_else(|| "\u{2013}".into(), |s| table::spread(s, format::number))
}

/// Draws the verdict of each knob's rule on its default.
pub(crate) fn choices(ui: &mut Ui, stage: &Stage) {
    let choices = stage.choices();
    ui.label(RichText::new(format!("Rule: {}.", stage.rule.words())).small().color(theme::weak()));
    if choices.is_empty() {
        ui.weak("This stage has no default to judge.");
        return;
    }
    let Some(measure) = stage.measure(&stage.rule.measure) else { return };
    Grid::new("choices").num_columns(4).striped(true).spacing([12.0, 1.0]).min_row_height(20.0).show(ui, |ui| {
        head(ui, &["setting", "default", "recommended", "time, error (default; recommended)"]);
        for c in &choices {
            ui.label(c.method);
            verdict(ui, c.holds, ["holds", "does not hold"]);
            let chosen = if c.chosen.default { "the default" } else { &c.chosen.setting };
            ui.label(text::elided(chosen, MOST_LETTERS)).on_hover_text(chosen);
            let of = |p: &Point| format!("{}, {}", format::seconds(p.secs.median), error(p, measure));
            ui.label(RichText::new(format!("{}; {}", of(c.default), of(c.chosen))).small());
            ui.end_row();
        }
    });
}

fn error(p: &Point, measure: &Measure) -> String {
    p.error(measure).map_or_else(|| "\u{2013}".into(), format::number)
}

/// Draws observed orders of convergence against theory.
pub(crate) fn orders(ui: &mut Ui, stage: &Stage) {
    Grid::new("orders").num_columns(4).striped(true).spacing([12.0, 1.0]).min_row_height(20.0).show(ui, |ui| {
        head(ui, &["refined", "order observed", "expected", "theory"]);
        for o in &stage.orders {
            ui.label(&o.what).on_hover_text(&o.meaning);
            ui.label(format!("{:.2}", o.observed));
            ui.label(format::number(o.expected));
            verdict(ui, o.agrees, ["agrees", "does not agree"]);
            ui.end_row();
        }
    });
}

/// Draws two reports side by side.
pub(crate) fn comparison(ui: &mut Ui, comparison: &StageComparison<'_>, measure: &Measure) {
    if comparison.pairs.is_empty() {
        ui.colored_label(theme::warning(), "The two reports have no setting in common.");
    }
    Grid::new("comparison").num_columns(4).striped(true).spacing([12.0, 1.0]).min_row_height(20.0).show(ui, |ui| {
        head(ui, &["setting", "times: second / first", "", &format!("{}: second - first", table::title(measure))]);
        for pair in &comparison.pairs {
            ui.label(text::elided(&title(pair.one), MOST_LETTERS)).on_hover_text(title(pair.one));
            let color = match pair.times {
                _ if !pair.differs() => theme::text(),
                t if t < 1.0 => theme::good(),
                _ => theme::warning(),
            };
            ui.colored_label(color, format!("\u{d7} {:.2}", pair.times));
            let times = [pair.one, pair.other].map(|p| format::seconds(p.secs.median));
            ui.label(RichText::new(format!("{}, {}", times[1], times[0])).small().color(theme::weak()));
            ui.label(pair.difference.map_or_else(|| "\u{2013}".into(), signed));
            ui.end_row();
        }
    });
    let [first, second] = comparison.alone;
    if first + second > 0 {
        ui.weak(format!("Settings without a counterpart: {first} in the first, {second} in the second."));
    }
}

fn signed(v: f64) -> String {
    if v > 0.0 { format!("+{}", format::number(v)) } else { format::number(v) }
}

/// Draws the scene, computer, program, reference and commands of the measurements.
pub(crate) fn about(ui: &mut Ui, report: &Report, stage: &Stage) {
    Grid::new("about").num_columns(2).spacing([12.0, 3.0]).show(ui, |ui| {
        let mut row = |name: &str, text: &str| {
            ui.label(RichText::new(name).small().color(theme::weak()));
            ui.add(egui::Label::new(RichText::new(text).small()).wrap());
            ui.end_row();
        };
        row("scene", &report.scene);
        row("machine", &report.computer.words());
        row("program", &report.program);
        row("reference", &stage.reference);
        stage.input.iter().filter(|(name, _)| *name != "scene").for_each(|(name, value)| row(name, value));
        row("runs", &stage.runs());
        report.commands.iter().for_each(|command| row("command", command));
    });
}

fn head(ui: &mut Ui, titles: &[&str]) {
    titles.iter().for_each(|t| drop(ui.label(RichText::new(*t).small().color(theme::weak()))));
    ui.end_row();
}

fn verdict(ui: &mut Ui, good: bool, [yes, no]: [&str; 2]) {
    let (color, text): (Color32, &str) = if good { (theme::good(), yes) } else { (theme::warning(), no) };
    ui.colored_label(color, text);
}
