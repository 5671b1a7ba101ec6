//! The networks: which are here, which engine runs them, what the others would add.

use std::sync::{Arc, OnceLock};

use egui::{Button, RichText, Ui};

use super::super::state::AppState;
use super::super::theme;
use crate::models::catalogue::{self, Entry, State};
use crate::models::engine::engine;
use crate::worker::Action;

/// What is known of engine and models; looked up off the window's thread.
#[derive(Default)]
pub struct Models {
    known: Arc<OnceLock<Known>>,
    asked: bool,
    /// Models that were put in place so far; looked up anew when that changes.
    installed: u64,
}

struct Known {
    engine: String,
    note: Option<String>,
    models: Vec<(Entry, State)>,
}

impl Known {
    fn look() -> Self {
        let (engine, note) = match engine() {
            Ok(engine) => (format!("{}, {}", engine.name(), engine.device()), engine.note().map(str::to_owned)),
            Err(e) => ("none".to_owned(), Some(e.to_string())),
        };
        let folder = catalogue::folder();
        let models = catalogue::entries().unwrap_or_default();
        Self { engine, note, models: models.into_iter().map(|e| (e.clone(), e.state(&folder))).collect() }
    }
}

impl Models {
    /// Draws the pane.
    pub fn show(&mut self, ui: &mut Ui, state: &AppState, actions: &mut Vec<Action>) {
        if self.installed != state.models_installed {
            *self = Self { installed: state.models_installed, ..Self::default() };
        }
        if !self.asked {
            self.asked = true;
            let (slot, ctx) = (Arc::clone(&self.known), ui.ctx().clone());
            let look = move || {
                // Nobody else fills this slot.
                let _ = slot.set(Known::look());
                ctx.request_repaint();
            };
            // Without a thread the pane stays empty.
            let _ = std::thread::Builder::new().name("models".into()).spawn(look);
        }
        let Some(known) = self.known.get() else {
            ui.weak("Looking for models\u{2026}");
            return;
        };
        for (entry, model) in &known.models {
            one(ui, entry, model, state.job.is_none(), actions);
        }
        ui.label(RichText::new(format!("Run by {}", known.engine)).small().color(theme::WEAK));
        if let Some(note) = &known.note {
            ui.label(RichText::new(note).small().color(theme::WARNING));
        }
    }
}

fn one(ui: &mut Ui, entry: &Entry, model: &State, idle: bool, actions: &mut Vec<Action>) {
    ui.horizontal(|ui| {
        ui.label(RichText::new(&entry.title).strong());
        let (text, color) = match model {
            State::BuiltIn => ("built in", theme::GOOD),
            State::Here => ("here", theme::GOOD),
            State::Missing(_) => ("not here", theme::WEAK),
            State::Broken(_) => ("broken", theme::WARNING),
        };
        ui.label(RichText::new(text).small().color(color));
    });
    ui.label(RichText::new(&entry.adds).small().color(theme::WEAK));
    if let State::Broken(problem) = model {
        ui.label(RichText::new(problem).small().color(theme::WARNING));
    }
    if matches!(model, State::Missing(_) | State::Broken(_)) {
        ui.horizontal(|ui| {
            let button = |text: &str| Button::new(text.to_owned()).small();
            if entry.url.is_some() {
                let fetch = Action::FetchModel(entry.id.clone());
                let text = format!("Fetch {} MB", entry.megabytes());
                if ui.add_enabled(idle, button(&text)).on_hover_text(fetch.tooltip()).clicked() {
                    actions.push(fetch);
                }
            }
            let add = Action::AddModel(entry.id.clone());
            if ui.add_enabled(idle, button("Add files\u{2026}")).on_hover_text(add.tooltip()).clicked() {
                actions.push(add);
            }
        });
        if entry.url.is_none() {
            let text = format!(
                "Nobody hosts its files yet ({} MB, {}). tools/export makes them of the official checkpoint.",
                entry.megabytes(),
                entry.licence
            );
            ui.label(RichText::new(text).small().color(theme::WEAK));
        }
    }
    ui.add_space(4.0);
}
