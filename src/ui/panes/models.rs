//! Neural networks: installed models, the engine that runs them, and the benefit of the missing ones.

use std::sync::Arc;

use egui::{Button, RichText, Ui};

use super::super::ctx::Ctx;
use super::super::state::AppState;
use super::super::theme;
use super::super::viewport::Viewport;
use super::PaneContents;
use crate::jobs::find_objects::FindSettings;
use crate::jobs::models::{self, ModelEntry, ModelList, ModelRole, ModelState, SAM2};
use crate::pipeline::semantics::lifting::build_map::{MaskPropagation, REGIONS};
use crate::scene::{Lifting, MaskPrompt};
use crate::ui::actions::Action;
use crate::worker::{JobInfo, Stop, Task, Tasks};

/// The pane, with the latest request for the list of models.
#[derive(Default)]
pub(crate) struct ModelsPane {
    /// Count of installed models at the request; a change triggers a new one.
    asked: Option<u64>,
    list: Option<Task<ModelList>>,
}

impl ModelsPane {
    /// Requests the list, and again after each installation.
    pub(crate) fn keep_listed(&mut self, state: &AppState, tasks: &Tasks) {
        let now = Some(state.models_installed);
        if self.asked == now {
            return;
        }
        // With a full queue the request is repeated at the next redraw.
        if let Ok(task) = tasks.spawn(JobInfo::short("Listing models"), |_| Ok::<_, Stop>(models::list())) {
            (self.asked, self.list) = (now, Some(task));
        }
    }

    /// Takes over the list once it is made.
    pub(crate) fn update(&mut self, state: &mut AppState) {
        if let Some(Ok(list)) = Task::take(&mut self.list) {
            state.models = Some(Arc::new(list));
        }
    }
}

impl PaneContents for ModelsPane {
    fn ui(&mut self, ui: &mut Ui, cx: &mut Ctx<'_>, _: &mut Viewport) {
        let state = cx.state;
        self.keep_listed(state, cx.tasks);
        let Some(known) = &state.models else {
            ui.weak("Looking for models\u{2026}");
            return;
        };
        for (entry, model) in &known.models {
            one(ui, entry, model, cx);
        }
        choose(ui, known, &mut cx.layout.finding);
        let engine = known.engine.as_ref().map_or_else(|| "none".to_owned(), |names| names.join(", "));
        ui.label(RichText::new(format!("Inference engine: {engine}")).small().color(theme::weak()));
        if let Some(note) = &known.note {
            ui.label(RichText::new(note).small().color(theme::warning()));
        }
    }

    fn scrolls(&self) -> bool {
        true
    }
}

/// Choice among the installed models that find objects.
fn choose(ui: &mut Ui, known: &ModelList, finding: &mut FindSettings) {
    let here = |role: ModelRole| {
        let usable = known.of(role).filter(|(_, s)| s.is_usable());
        usable.map(|(e, _)| (e.id.clone(), e.title.clone())).collect::<Vec<_>>()
    };
    ui.label(RichText::new("Finding objects").strong());
    let mut segmenters = vec![(REGIONS.to_owned(), "uniform color regions".to_owned())];
    segmenters.extend(here(ModelRole::Segmenter));
    let follows = segmenters.iter().any(|(id, _)| id == SAM2);
    egui::Grid::new("finding").num_columns(2).show(ui, |ui| {
        ui.weak("Masks");
        one_of(ui, "masks", &mut finding.segmenter, &segmenters)
            .on_hover_text("Used if the photos came without masks and none were chosen.");
        ui.end_row();
        ui.weak("Tracker");
        let names = [
            (MaskPropagation::Gaussians, "Gaussians"),
            (MaskPropagation::Sam2, "SAM 2"),
            (MaskPropagation::Both, "Gaussians + SAM 2"),
        ];
        let chosen = names.iter().find(|(c, _)| *c == finding.carry).map_or("", |(_, name)| *name);
        ui.add_enabled_ui(follows || finding.carry != MaskPropagation::Gaussians, |ui| {
            let combo = egui::ComboBox::from_id_salt("carry").selected_text(chosen).width(180.0).show_ui(ui, |ui| {
                for (carry, name) in names {
                    ui.selectable_value(&mut finding.carry, carry, name);
                }
            });
            combo.response.accessible_name("Tracking");
        })
        .response
        .on_disabled_hover_text("Tracking masks from photo to photo needs SAM 2.");
        ui.end_row();
        ui.weak("Encoder");
        one_of(ui, "encoder", &mut finding.encoder, &here(ModelRole::Encoder))
            .on_hover_text("Embeds objects and parts, for open-vocabulary queries.");
        ui.end_row();
        ui.weak("Codes");
        let names = [
            (Lifting::Votes, "from votes"),
            (Lifting::Refined, "from votes, then refined"),
            (Lifting::Paper, "trained only, as in the paper"),
        ];
        let chosen = names.iter().find(|(l, _)| *l == finding.preparation.lifting).map_or("", |(_, name)| *name);
        let combo = egui::ComboBox::from_id_salt("lifting").selected_text(chosen).width(180.0).show_ui(ui, |ui| {
            for (lifting, name) in names {
                ui.selectable_value(&mut finding.preparation.lifting, lifting, name);
            }
        });
        combo.response.accessible_name("Codes");
        ui.end_row();
        let prepared = &mut finding.preparation;
        ui.weak("SAM 2 prompt");
        ui.add_enabled_ui(finding.carry != MaskPropagation::Gaussians, |ui| {
            ui.horizontal(|ui| {
                let prompt = prepared.prompt.get_or_insert_default();
                ui.selectable_value(prompt, MaskPrompt::Mask, "mask");
                ui.selectable_value(prompt, MaskPrompt::Points, "points drawn from it");
            });
        });
        ui.end_row();
        ui.weak("Part weight w");
        ui.add(egui::DragValue::new(&mut prepared.part_weight).range(0.0..=1.0).speed(0.01))
            .accessible_name("Part weight")
            .on_hover_text("Share of its own embedding that a part keeps in semantic deviation.");
        ui.end_row();
        ui.weak("Photos");
        ui.add(egui::DragValue::new(&mut finding.max_seeds).range(1..=100_000).suffix(" max."))
            .accessible_name("Photos with masks")
            .on_hover_text("Upper limit of photos that contribute masks; more are added while much is unlabeled.");
        ui.end_row();
    });
    ui.add_space(4.0);
}

/// A choice among models; `None` for the best.
fn one_of(ui: &mut Ui, id: &str, chosen: &mut Option<String>, models: &[(String, String)]) -> egui::Response {
    const BEST: &str = "best installed";
    let title =
        |id: &str| models.iter().find(|(m, _)| m == id).map_or_else(|| format!("{id} (missing)"), |m| m.1.clone());
    let text = chosen.as_deref().map_or_else(|| BEST.to_owned(), title);
    // A long title is truncated, so that the pane keeps its width.
    let combo = egui::ComboBox::from_id_salt(id).selected_text(&text).width(180.0).truncate();
    let shown = combo.show_ui(ui, |ui| {
        ui.selectable_value(chosen, None, BEST);
        for (id, title) in models {
            ui.selectable_value(chosen, Some(id.clone()), title);
        }
    });
    shown.response.on_hover_text(text)
}

fn one(ui: &mut Ui, entry: &ModelEntry, model: &ModelState, cx: &mut Ctx<'_>) {
    let idle = cx.state.job.is_none();
    ui.horizontal(|ui| {
        ui.label(RichText::new(&entry.title).strong());
        let (text, color) = match model {
            ModelState::BuiltIn => ("built in", theme::good()),
            ModelState::Here => ("installed", theme::good()),
            ModelState::Missing(_) => ("not installed", theme::weak()),
            ModelState::Broken(_) => ("broken", theme::warning()),
        };
        ui.label(RichText::new(text).small().color(color));
    });
    ui.label(RichText::new(format!("{} {}", entry.adds, entry.speed)).small().color(theme::weak()));
    if let ModelState::Broken(problem) = model {
        ui.label(RichText::new(problem).small().color(theme::warning()));
    }
    if matches!(model, ModelState::Missing(_) | ModelState::Broken(_)) {
        ui.horizontal(|ui| {
            let button = |text: &str| Button::new(text.to_owned()).small();
            if entry.is_hosted() {
                let fetch = Action::FetchModel(entry.id.clone());
                let text = format!("Download {}", crate::math::format::megabytes(entry.download_megabytes()));
                if ui.add_enabled(idle, button(&text)).on_hover_text(fetch.tooltip()).clicked() {
                    cx.ask(fetch);
                }
            }
            let add = Action::AddModel(entry.id.clone());
            if ui.add_enabled(idle, button("Add files\u{2026}")).on_hover_text(add.tooltip()).clicked() {
                cx.ask(add);
            }
        });
        let origin = entry.origin();
        if !origin.is_empty() {
            ui.label(RichText::new(origin).small().color(theme::weak()));
        }
    }
    ui.add_space(4.0);
}
