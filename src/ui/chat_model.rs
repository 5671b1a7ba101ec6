//! Choice of the planner in the chat: the built-in commands or a chat model, with the servers that are found on this
//! computer and a connection test.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crossbeam_channel::{Receiver, bounded};
use egui::{Button, ComboBox, RichText, TextEdit, Ui};

use super::theme;
use crate::agent::llm::SENT;
use crate::agent::llm::discover::{self, LocalServer};
use crate::agent::llm::settings::{LlmSettings, RequestTimeouts};

/// Settings of the planner, stored between runs.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default)]
pub(crate) struct ChatSettings {
    /// True if a chat model plans, instead of the built-in commands.
    pub(crate) use_model: bool,
    pub(crate) model: LlmSettings,
}

/// A request on another thread, or its answer.
#[derive(Default)]
enum Asked<T> {
    #[default]
    Not,
    Waiting(Receiver<T>),
    Answered(T),
}

impl<T: Send + 'static> Asked<T> {
    /// Runs `work` on its own thread, which ends by its own time limits.
    fn ask(ui: &Ui, work: impl FnOnce() -> T + Send + 'static) -> Self {
        let (send, receive) = bounded(1);
        let context = ui.ctx().clone();
        let thread = std::thread::Builder::new().name("chat model".into()).spawn(move || {
            // The settings may be closed by now.
            let _ = send.send(work());
            context.request_repaint();
        });
        if thread.is_ok() { Self::Waiting(receive) } else { Self::Not }
    }

    fn answer(&mut self) -> Option<&T> {
        if let Self::Waiting(receive) = self
            && let Ok(answer) = receive.try_recv()
        {
            *self = Self::Answered(answer);
        }
        if let Self::Answered(answer) = self { Some(answer) } else { None }
    }
}

/// Servers and connection test, while the settings are open.
#[derive(Default)]
pub(crate) struct ModelChooser {
    found: Asked<Vec<LocalServer>>,
    tested: Asked<Result<String, String>>,
}

impl ModelChooser {
    pub(crate) fn show(&mut self, ui: &mut Ui, settings: &mut ChatSettings) {
        let text = if settings.use_model { "Chat model" } else { "Built-in" };
        let planner = ComboBox::from_id_salt("planner").selected_text(text).width(90.0).show_ui(ui, |ui| {
            ui.selectable_value(&mut settings.use_model, false, "Built-in")
                .on_hover_text("The built-in commands; no network.");
            ui.selectable_value(&mut settings.use_model, true, "Chat model").on_hover_text(SENT);
        });
        planner.response.accessible_name("Planner");
        if settings.use_model {
            let open = ui.menu_button("Address\u{2026}", |ui| self.settings(ui, &mut settings.model));
            if open.inner.is_none() {
                // Servers are searched only while the settings are open.
                *self = Self::default();
            }
        }
    }

    fn settings(&mut self, ui: &mut Ui, model: &mut LlmSettings) {
        ui.set_min_width(300.0);
        if matches!(self.found, Asked::Not) {
            self.found = Asked::ask(ui, || discover::find(&discover::PORTS, &AtomicBool::new(false)));
        }
        match self.found.answer() {
            None => drop(ui.weak("Looking for chat models on this machine\u{2026}")),
            Some(none) if none.is_empty() => drop(ui.weak("No chat model server found on this machine.")),
            Some(found) => {
                for server in found {
                    ui.label(RichText::new(format!("{}, on this machine", server.kind)).small().color(theme::weak()));
                    for name in server.models.iter().take(8) {
                        let is_chosen = model.base_url == server.base_url && model.model == *name;
                        if ui.selectable_label(is_chosen, crate::scene::text::line(name)).clicked() {
                            (model.base_url, model.model) = (server.base_url.clone(), name.clone());
                            self.tested = Asked::Not;
                        }
                    }
                }
            }
        }
        ui.separator();
        for (label, value, hint) in [
            ("Address", &mut model.base_url, "http://127.0.0.1:11434/v1"),
            ("Model", &mut model.model, "model name on the server"),
            ("API key variable", &mut model.key_variable, "environment variable; empty if none"),
        ] {
            ui.label(RichText::new(label).small().color(theme::weak()));
            ui.add(TextEdit::singleline(value).hint_text(hint).desired_width(f32::INFINITY)).accessible_name(label);
        }
        let is_waiting = matches!(self.tested, Asked::Waiting(_));
        ui.horizontal_wrapped(|ui| {
            if ui.add_enabled(!is_waiting, Button::new("Test connection").small()).clicked() {
                let settings = model.clone();
                self.tested = Asked::ask(ui, move || {
                    discover::test(&settings, &RequestTimeouts::default(), &Arc::new(AtomicBool::new(false)))
                });
            }
            match self.tested.answer() {
                Some(Ok(text)) => drop(ui.label(crate::scene::text::line(text))),
                Some(Err(text)) => {
                    drop(ui.label(RichText::new(crate::scene::text::line(text)).color(theme::warning())));
                }
                None if is_waiting => drop(ui.spinner()),
                None => {}
            }
        });
        ui.label(RichText::new(SENT).small().color(theme::weak()));
    }
}
