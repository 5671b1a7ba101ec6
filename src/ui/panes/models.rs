//! The networks: which are here, which engine runs them, what the others would add.

use std::sync::{Arc, OnceLock};

use egui::{Button, RichText, Ui};

use super::super::state::AppState;
use super::super::theme;
use crate::jobs::find_objects::FindSettings;
use crate::models::catalogue::{self, Entry, Role, SAM2, State};
use crate::models::engine::engine;
use crate::pipeline::semantics::find::{Carry, Lifting, REGIONS};
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
        let (engine, mut note) = match engine() {
            Ok(engine) => (format!("{}, {}", engine.name(), engine.device()), engine.note().map(str::to_owned)),
            Err(e) => ("none".to_owned(), Some(e.to_string())),
        };
        let folder = catalogue::folder();
        let models = catalogue::entries().unwrap_or_else(|e| {
            note = Some(e.to_string());
            Vec::new()
        });
        Self { engine, note, models: models.into_iter().map(|e| (e.clone(), e.state(&folder))).collect() }
    }
}

impl Models {
    /// Draws the pane.
    pub fn show(&mut self, ui: &mut Ui, state: &AppState, finding: &mut FindSettings, actions: &mut Vec<Action>) {
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
        choose(ui, &known.models, finding);
        ui.label(RichText::new(format!("Run by {}", known.engine)).small().color(theme::WEAK));
        if let Some(note) = &known.note {
            ui.label(RichText::new(note).small().color(theme::WARNING));
        }
    }
}

/// The models that find objects, of those that are here.
fn choose(ui: &mut Ui, models: &[(Entry, State)], finding: &mut FindSettings) {
    let here = |role: Role| {
        let of_role = models.iter().filter(move |(e, s)| e.role == role && matches!(s, State::Here | State::BuiltIn));
        of_role.map(|(e, _)| (e.id.clone(), e.title.clone())).collect::<Vec<_>>()
    };
    ui.label(RichText::new("Finding objects").strong());
    let mut segmenters = vec![(REGIONS.to_owned(), "regions of even colour".to_owned())];
    segmenters.extend(here(Role::Segmenter));
    let follows = segmenters.iter().any(|(id, _)| id == SAM2);
    egui::Grid::new("finding").num_columns(2).show(ui, |ui| {
        ui.weak("Masks");
        one_of(ui, "masks", &mut finding.segmenter, &segmenters)
            .on_hover_text("Where no masks came with the photos, and none were chosen.");
        ui.end_row();
        ui.weak("Carried by");
        let names = [
            (Carry::Gaussians, "the Gaussians"),
            (Carry::Sam2, "the Gaussians and SAM 2"),
            (Carry::Both, "both, Gaussians have the last word"),
        ];
        let chosen = names.iter().find(|(c, _)| *c == finding.carry).map_or("", |(_, name)| *name);
        ui.add_enabled_ui(follows || finding.carry != Carry::Gaussians, |ui| {
            egui::ComboBox::from_id_salt("carry").selected_text(chosen).width(180.0).show_ui(ui, |ui| {
                for (carry, name) in names {
                    ui.selectable_value(&mut finding.carry, carry, name);
                }
            });
        })
        .response
        .on_disabled_hover_text("Following masks from photo to photo needs SAM 2.");
        ui.end_row();
        ui.weak("Looked at by");
        one_of(ui, "encoder", &mut finding.encoder, &here(Role::Encoder))
            .on_hover_text("What turns their looks into something that words can be compared with.");
        ui.end_row();
        ui.weak("Codes");
        let names = [
            (Lifting::Votes, "of the votes"),
            (Lifting::Refined, "of the votes, then trained"),
            (Lifting::Paper, "trained alone, as in the paper"),
        ];
        let chosen = names.iter().find(|(l, _)| *l == finding.lifting).map_or("", |(_, name)| *name);
        egui::ComboBox::from_id_salt("lifting").selected_text(chosen).width(180.0).show_ui(ui, |ui| {
            for (lifting, name) in names {
                ui.selectable_value(&mut finding.lifting, lifting, name);
            }
        });
        ui.end_row();
        ui.weak("Photos");
        ui.add(egui::DragValue::new(&mut finding.max_seeds).range(1..=100_000).suffix(" at most"))
            .on_hover_text("Photos whose masks are used: more are taken where those before leave much unknown.");
        ui.end_row();
    });
    ui.add_space(4.0);
}

/// A choice among models; none = the best.
fn one_of(ui: &mut Ui, id: &str, chosen: &mut Option<String>, models: &[(String, String)]) -> egui::Response {
    const BEST: &str = "the best that is here";
    let title =
        |id: &str| models.iter().find(|(m, _)| m == id).map_or_else(|| format!("{id} (missing)"), |m| m.1.clone());
    let text = chosen.as_deref().map_or_else(|| BEST.to_owned(), title);
    let combo = egui::ComboBox::from_id_salt(id).selected_text(text).width(180.0);
    let shown = combo.show_ui(ui, |ui| {
        ui.selectable_value(chosen, None, BEST);
        for (id, title) in models {
            ui.selectable_value(chosen, Some(id.clone()), title);
        }
    });
    shown.response
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
