//! The query box: typing, completion from known names, history.

use egui::{Id, Key, Modifiers, RichText, TextEdit, Ui};

use super::{MOST, Queries};
use crate::jobs::phrases::colors::PhraseColors;
use crate::pipeline::semantics::names;
use crate::scene::SemanticMap;
use crate::ui::actions::{Action, Pane};
use crate::ui::text_field::{cursor_to_end, select_all};
use crate::ui::theme;

/// Completions that are offered.
const OFFERED: usize = 5;

impl Queries {
    /// The box. Whether it has the keyboard.
    pub(super) fn show_bar(&mut self, ui: &mut Ui, semantics: &SemanticMap, actions: &mut Vec<Action>) -> bool {
        let id = ui.scope_id().with("typed");
        // Taken before the field sees them: it would move its cursor.
        let focused = ui.memory(|m| m.has_focus(id));
        self.wanted |= focused;
        if focused {
            self.recall(ui, id, semantics);
        }
        let offered = self.offered(semantics);
        let complete = focused && !offered.is_empty() && ui.input_mut(|i| i.consume_key(Modifiers::NONE, Key::Tab));
        ui.horizontal(|ui| {
            let width = ui.available_width() - 72.0;
            let edit = TextEdit::singleline(&mut self.side.typed)
                .id(id)
                .hint_text("Find an object or part, e.g. \u{201c}the button of the red controller\u{201d}  ( / )")
                .char_limit(2_000)
                // Tab completes, as long as there is something to complete to.
                .lock_focus(!offered.is_empty())
                .desired_width(width);
            let name = if self.is_second { "Query of the second view" } else { "Query" };
            let response = ui.add(edit).accessible_name(name);
            let starts = std::mem::take(&mut self.side.focus);
            if starts || complete {
                response.request_focus();
            }
            if starts {
                // What is typed now takes the place of the query before.
                select_all(ui.ctx(), id, &self.side.typed);
            }
            if complete {
                self.side.typed.clone_from(&offered[0]);
                cursor_to_end(ui.ctx(), id, &self.side.typed);
            }
            if response.changed() || complete {
                self.side.recalled = None;
                let typed = self.side.typed.clone();
                self.side.live = self.asked(&typed, semantics);
            }
            if response.lost_focus() {
                let typed = self.side.typed.clone();
                self.colors.keep(&typed);
            }
            if response.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter)) {
                self.keep();
                response.request_focus();
            }
            let details = ui.button("Details");
            if details.on_hover_text("Full answer, search and overlay settings").clicked() {
                actions.push(Action::TogglePane(Pane::Query));
            }
        });
        if focused && !self.side.typed.is_empty() && offered.first().is_some_and(|o| *o != self.side.typed) {
            self.show_offered(ui, &offered, semantics);
        }
        focused
    }

    fn offered(&self, semantics: &SemanticMap) -> Vec<String> {
        let typed = self.side.typed.trim();
        if typed.is_empty() { Vec::new() } else { names::completions(&semantics.identities, typed, OFFERED) }
    }

    fn show_offered(&mut self, ui: &mut Ui, offered: &[String], semantics: &SemanticMap) {
        let mut taken = None;
        ui.horizontal_wrapped(|ui| {
            ui.label(RichText::new("Tab:").small().color(theme::weak()));
            for text in offered {
                if ui.small_button(text).clicked() {
                    taken = Some(text.clone());
                }
            }
        });
        if let Some(text) = taken {
            self.ask(&text, semantics);
            self.side.focus = true;
        }
    }

    /// Goes through what was asked before with the arrow keys.
    fn recall(&mut self, ui: &Ui, field: Id, semantics: &SemanticMap) {
        let pressed = |key| ui.input_mut(|i| i.consume_key(Modifiers::NONE, key));
        let n = self.history.len();
        let next = match self.side.recalled {
            _ if n == 0 => return,
            None if pressed(Key::ArrowUp) => Some(n - 1),
            Some(at) if pressed(Key::ArrowUp) => Some(at.saturating_sub(1)),
            Some(at) if pressed(Key::ArrowDown) => (at + 1 < n).then_some(at + 1),
            _ => return,
        };
        let text = next.and_then(|i| self.history.get(i)).cloned().unwrap_or_default();
        self.ask(&text, semantics);
        cursor_to_end(ui.ctx(), field, &text);
        self.side.recalled = next;
    }

    /// The colors that these phrases have from now on, and all others that have one.
    pub(crate) fn colors_of(&mut self, phrases: &[String]) -> PhraseColors {
        self.colors.keep_all(phrases);
        self.colors.clone()
    }

    /// Keeps these queries on screen, and no others, in the first and the second view.
    pub(crate) fn keep_only(&mut self, texts: &[Vec<String>; 2], semantics: &SemanticMap) {
        for (second, texts) in [false, true].into_iter().zip(texts) {
            self.in_view(second, |all| all.keep_here(texts, semantics));
        }
    }

    fn keep_here(&mut self, texts: &[String], semantics: &SemanticMap) {
        if self.side.kept.iter().map(|q| &q.text).ne(texts) {
            self.side.kept = texts.iter().filter_map(|text| self.asked(text, semantics)).collect();
        }
    }

    /// Keeps the query being typed on screen, and makes room for the next.
    pub(super) fn keep(&mut self) {
        let Some(live) = self.side.live.take() else { return };
        self.side.kept.retain(|q| q.text != live.text);
        if self.side.kept.len() == MOST {
            self.side.kept.remove(0);
        }
        self.colors.keep(&live.text);
        self.history.retain(|t| *t != live.text);
        self.history.push(live.text.clone());
        self.side.recalled = None;
        self.side.kept.push(live);
        self.side.typed.clear();
    }

    /// Chips of the queries that stay on screen.
    pub(super) fn show_kept(&mut self, ui: &mut Ui) {
        if self.side.kept.is_empty() {
            return;
        }
        let mut gone = None;
        ui.horizontal_wrapped(|ui| {
            for (k, question) in self.side.kept.iter().enumerate() {
                let [r, g, b] = self.colors.of(&question.text);
                let text = RichText::new(format!("{}  \u{00d7}", question.text)).small();
                let chip = ui.button(text.color(egui::Color32::from_rgb(r, g, b)));
                if chip.on_hover_text("Remove this query").clicked() {
                    gone = Some(k);
                }
            }
        });
        if let Some(k) = gone {
            self.side.kept.remove(k);
        }
    }
}
