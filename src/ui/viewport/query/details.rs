//! The pane with the full answer to the newest query: hits with their scores, the target in space, run times, and the
//! settings of search and display.

use egui::{RichText, Ui};
use strum::VariantArray;

use super::super::Viewport;
use super::card::Facts;
use super::{Queries, settings, times};
use crate::math::format;
use crate::navigate::target::Side;
use crate::pipeline::semantics::answer::Basis;
use crate::scene::{GaussianCloud, IdentityId, SemanticMap};
use crate::ui::actions::Action;
use crate::ui::state::AppState;
use crate::ui::theme;
use crate::worker::Versioned;

/// Number of hits in the list.
const LISTED: usize = 8;

impl Viewport {
    /// Draws the pane of the query: its answer and the options.
    pub(crate) fn show_query(&mut self, ui: &mut Ui, state: &AppState, actions: &mut Vec<Action>) {
        let (Some(semantics), Some(cloud)) = (&state.semantics, &self.cloud) else {
            ui.weak("Find objects first: queries search among them.");
            return;
        };
        self.queries.show_details(ui, state, semantics, cloud, actions);
    }
}

impl Queries {
    fn show_details(
        &mut self,
        ui: &mut Ui,
        state: &AppState,
        semantics: &Versioned<SemanticMap>,
        cloud: &GaussianCloud,
        actions: &mut Vec<Action>,
    ) {
        // The settings need the identity maps.
        self.wanted = true;
        match self.side.live.clone() {
            Some(newest) => {
                self.show_hits(ui, &newest, state, semantics);
                if let Some(&target) = newest.shown(&self.side.settings).first() {
                    let facts = self.facts_of(target, semantics, cloud);
                    show_target(ui, target, &facts, state, actions);
                }
                let basis = match newest.answered.basis {
                    Basis::Names => "by name",
                    Basis::Embedding => "by embedding",
                };
                times::show(ui, basis, &newest.answered.stages.and(self.side.paint_ms));
            }
            None => {
                ui.weak("No query yet: type into the field in the view ( / ).");
            }
        }
        ui.add_space(6.0);
        let heat = (!self.side.heat.is_empty()).then_some(self.side.heat.as_slice());
        if settings::show(ui, &mut self.side.settings, heat) {
            self.ask_again(semantics);
        }
    }

    fn show_hits(&mut self, ui: &mut Ui, newest: &super::Asked, state: &AppState, semantics: &Versioned<SemanticMap>) {
        let shown = newest.shown(&self.side.settings);
        let hits = newest.answered.answer.hits().iter().filter(|h| h.score > 0.0).take(LISTED);
        let mut chosen = None;
        // Names may be long.
        egui::ScrollArea::horizontal().id_salt("hits").show(ui, |ui| {
            egui::Grid::new("hits").num_columns(4).striped(true).show(ui, |ui| {
                for hit in hits {
                    let name = state.labels.full_name(&semantics.identities, hit.identity);
                    if ui.selectable_label(shown.contains(&hit.identity), RichText::new(name).strong()).clicked() {
                        chosen = Some(hit.identity);
                    }
                    ui.weak(format!("{:.2}", hit.score)).on_hover_text("Score from 0 to 1");
                    ui.weak(format!("+{:.2}", hit.margin.max(0.0))).on_hover_text("Margin over the next match");
                    let pixels = match self.area_of(semantics, hit.identity) {
                        Some(0) => "not in this view".to_owned(),
                        Some(n) => format!("{} px", format::count(n as u64)),
                        None => String::new(),
                    };
                    ui.weak(pixels);
                    ui.end_row();
                }
            });
        });
        self.choose(chosen);
    }
}

/// Draws the facts about the target in space, and its actions.
fn show_target(ui: &mut Ui, target: IdentityId, facts: &Facts, state: &AppState, actions: &mut Vec<Action>) {
    let unit = state.scene.as_ref().and_then(|s| s.meters_per_unit());
    let edges = facts.bounds.map(|b| b.size().to_array().map(|edge| format::length(edge, unit)).join(" \u{00d7} "));
    let size = edges.map(|e| format!("  \u{00b7}  box {e}")).unwrap_or_default();
    let gaussians = format::things(facts.gaussians, "Gaussian");
    ui.label(RichText::new(format!("{gaussians}{size}")).small().color(theme::weak()));
    ui.horizontal(|ui| {
        ui.menu_button(RichText::new("Go there\u{2026}").small(), |ui| {
            for &side in Side::VARIANTS {
                if ui.button(side.text()).clicked() {
                    actions.push(Action::GoToTarget(target, side));
                    ui.close();
                }
            }
        });
        for (action, text) in [
            (Action::Isolate(Some(target)), "Isolate"),
            (Action::Hide(target), "Hide"),
            (Action::Remove(target), "Remove and fill"),
            (Action::ExportTarget(target), "Export Gaussians\u{2026}"),
        ] {
            if ui.small_button(text).on_hover_text(action.tooltip()).clicked() {
                actions.push(action);
            }
        }
    });
}
