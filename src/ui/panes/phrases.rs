//! A list of phrases, queried in this view or in all photos, with a table of the answers.

use egui::style::ScrollStyle;
use egui::{Button, Grid, RichText, ScrollArea, TextEdit, Ui};

use super::super::ctx::Ctx;
use super::super::theme;
use super::super::viewport::Viewport;
use super::PaneContents;
use crate::jobs::phrases::PhraseRow;
use crate::math::format::{count, percent, things};
use crate::scene::text::elided;
use crate::ui::actions::Action;

/// Rows shown; files have all.
const SHOWN: usize = 300;

/// Largest number of characters of a phrase or an answer that is shown.
const LETTERS: usize = 26;

/// The typed phrases, and the views to query.
#[derive(Default)]
pub struct PhrasesPane {
    /// Phrases, one per line.
    pub text: String,
    pub all_photos: bool,
}

impl PaneContents for PhrasesPane {
    fn ui(&mut self, ui: &mut Ui, cx: &mut Ctx<'_>, view: &mut Viewport) {
        let comparing = view.queries.truth().is_some();
        ui.horizontal_top(|ui| {
            ui.vertical(|ui| {
                ui.set_width(230.0);
                ui.horizontal(|ui| {
                    ui.weak("Ask in");
                    ui.selectable_value(&mut self.all_photos, false, "This view");
                    ui.selectable_value(&mut self.all_photos, true, "All photos");
                });
                let edit = TextEdit::multiline(&mut self.text)
                    .hint_text("One phrase per line:\nkettle spout\na button of the red controller")
                    .desired_rows(4)
                    .desired_width(f32::INFINITY);
                ScrollArea::vertical().id_salt("phrases").max_height(ui.available_height() - 68.0).show(ui, |ui| {
                    ui.add(edit).accessible_name("Phrases");
                });
                ui.horizontal(|ui| {
                    let some = !self.text.trim().is_empty();
                    for (action, text) in [(Action::RunPhrases(None), "Run"), (Action::ExportPhrases, "Export\u{2026}")]
                    {
                        let button = ui.add_enabled(some, Button::new(text)).on_hover_text(action.tooltip());
                        if button.on_disabled_hover_text("Enter phrases first.").clicked() {
                            cx.ask(action);
                        }
                    }
                });
                ui.horizontal(|ui| {
                    ui.weak("True mask");
                    let mask = if comparing { Action::TrueMask(None) } else { Action::ChooseTrueMask };
                    let text = if comparing { "End comparison" } else { "Load\u{2026}" };
                    for (action, text) in [(mask, text), (Action::PaintTrueMask, "Paint")] {
                        let button = ui.small_button(text).on_hover_text(action.tooltip());
                        if button.accessible_name(action.text()).clicked() {
                            cx.ask(action);
                        }
                    }
                });
            });
            ui.separator();
            ui.vertical(|ui| show_rows(ui, cx));
        });
    }
}

fn show_rows(ui: &mut Ui, cx: &mut Ctx<'_>) {
    let state = cx.state;
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
    // A single view needs no column.
    let views = rows.iter().any(|row| row.view != rows[0].view);
    ui.spacing_mut().scroll = ScrollStyle::solid();
    ScrollArea::both().id_salt("answers").auto_shrink([false, false]).show(ui, |ui| {
        Grid::new("answers").num_columns(7).striped(true).spacing([12.0, 4.0]).show(ui, |ui| {
            for head in ["Phrase", "Answer", "", "Score", "Area", "IoU"].into_iter().chain(views.then_some("View")) {
                ui.label(RichText::new(head).small().color(theme::weak()));
            }
            ui.end_row();
            rows.iter().take(SHOWN).for_each(|row| show_row(ui, row, views, cx));
        });
        if rows.len() > SHOWN {
            ui.weak(format!("{} more rows in the export", count((rows.len() - SHOWN) as u64)));
        }
    });
}

fn show_row(ui: &mut Ui, row: &PhraseRow, views: bool, cx: &mut Ctx<'_>) {
    let [red, green, blue] = row.color;
    let found = !row.answer.is_empty();
    let color = if found { egui::Color32::from_rgb(red, green, blue) } else { theme::weak() };
    let phrase = RichText::new(elided(&row.phrase, LETTERS)).color(color);
    if ui.link(phrase).on_hover_text(format!("Query \u{201c}{}\u{201d} in the view", row.phrase)).clicked() {
        cx.ask(Action::Ask(row.phrase.clone()));
    }
    let answer = if found { &row.answer } else { row.verdict };
    ui.label(elided(answer, LETTERS)).on_hover_text(answer);
    ui.weak(if found { row.certainty } else { "" });
    ui.label(format!("{:.2}", row.score)).on_hover_text(format!("margin {:.2}", row.margin));
    let share = format!("{} of the view", percent(row.share));
    ui.label(format!("{} px", count(row.area_px as u64))).on_hover_text(share);
    ui.label(row.iou.map_or_else(String::new, |v| format!("{v:.3}")));
    if views {
        ui.weak(&row.view);
    }
    ui.end_row();
}
