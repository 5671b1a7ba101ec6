//! A list of phrases, asked of this view or of all photos, with their answers as a table.

use egui::{Grid, RichText, ScrollArea, TextEdit, Ui};

use super::super::state::AppState;
use super::super::theme;
use crate::jobs::phrases::PhraseRow;
use crate::math::format::{count, things};
use crate::ui::actions::Action;

/// Rows that are shown; files have all.
const SHOWN: usize = 300;

/// What is typed, and of which views it is asked.
#[derive(Default)]
pub struct PhrasesPane {
    /// One phrase a line.
    pub text: String,
    pub all_photos: bool,
}

impl PhrasesPane {
    pub(crate) fn show(&mut self, ui: &mut Ui, state: &AppState, comparing: bool, actions: &mut Vec<Action>) {
        ui.horizontal_top(|ui| {
            ui.vertical(|ui| {
                ui.set_width(230.0);
                ui.horizontal(|ui| {
                    if ui.button("Run").on_hover_text(Action::RunPhrases(None).tooltip()).clicked() {
                        actions.push(Action::RunPhrases(None));
                    }
                    ui.selectable_value(&mut self.all_photos, false, "this view");
                    ui.selectable_value(&mut self.all_photos, true, "all photos");
                });
                let edit = TextEdit::multiline(&mut self.text)
                    .hint_text("One phrase per line:\nkettle spout\na button of the red controller")
                    .desired_rows(4)
                    .desired_width(f32::INFINITY);
                ScrollArea::vertical().id_salt("phrases").max_height(ui.available_height() - 34.0).show(ui, |ui| {
                    ui.add(edit).accessible_name("Phrases");
                });
                ui.horizontal(|ui| {
                    let mask = if comparing { Action::TrueMask(None) } else { Action::ChooseTrueMask };
                    let text = if comparing { "End comparison" } else { "True mask\u{2026}" };
                    let paint = (Action::PaintTrueMask, "Paint it");
                    for (action, text) in [(Action::ExportPhrases, "Export\u{2026}"), (mask, text), paint] {
                        if ui.small_button(text).on_hover_text(action.tooltip()).clicked() {
                            actions.push(action);
                        }
                    }
                });
            });
            ui.separator();
            ui.vertical(|ui| show_rows(ui, state, actions));
        });
    }
}

fn show_rows(ui: &mut Ui, state: &AppState, actions: &mut Vec<Action>) {
    let rows = &state.phrases.rows;
    if rows.is_empty() {
        ui.weak("Enter phrases and run them: answers, areas and IoU with a true mask appear here.");
        return;
    }
    let found = rows.iter().filter(|r| !r.answer.is_empty()).count();
    let known: Vec<f64> = rows.iter().filter_map(|r| r.iou).collect();
    let mean = known.iter().sum::<f64>() / known.len().max(1) as f64;
    let iou = if known.is_empty() { String::new() } else { format!(", mean IoU {mean:.3} of {}", known.len()) };
    let written = state.phrases.written.as_ref().map(|p| format!(", written to {}", p.display())).unwrap_or_default();
    ui.weak(format!("{found} of {} answered{iou}{written}", things(rows.len(), "question")));
    ScrollArea::both().id_salt("answers").auto_shrink([false, false]).show(ui, |ui| {
        Grid::new("answers").num_columns(7).striped(true).show(ui, |ui| {
            for head in ["View", "Phrase", "Answer", "", "Score", "Area", "IoU"] {
                ui.label(RichText::new(head).small().color(theme::weak()));
            }
            ui.end_row();
            rows.iter().take(SHOWN).for_each(|row| show_row(ui, row, actions));
        });
        if rows.len() > SHOWN {
            ui.weak(format!("{} more rows in the export", count((rows.len() - SHOWN) as u64)));
        }
    });
}

fn show_row(ui: &mut Ui, row: &PhraseRow, actions: &mut Vec<Action>) {
    ui.weak(&row.view);
    let [red, green, blue] = row.color;
    let phrase = RichText::new(&row.phrase).color(egui::Color32::from_rgb(red, green, blue));
    if ui.link(phrase).on_hover_text("Query it in the view").clicked() {
        actions.push(Action::Ask(row.phrase.clone()));
    }
    ui.label(if row.answer.is_empty() { row.verdict } else { &row.answer });
    ui.weak(if row.answer.is_empty() { "" } else { row.certainty });
    ui.label(format!("{:.2}", row.score)).on_hover_text(format!("margin {:.2}", row.margin));
    let share = format!("{:.2} % of the view", 100.0 * row.share);
    ui.label(format!("{} px", count(row.area_px as u64))).on_hover_text(share);
    ui.label(row.iou.map_or_else(String::new, |v| format!("{v:.3}")));
    ui.end_row();
}
