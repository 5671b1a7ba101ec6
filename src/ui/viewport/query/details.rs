//! The pane with the full answer to the newest query: hits with their scores, the target in space, run times, and the
//! settings of search and display.

use egui::{RichText, Ui};
use strum::VariantArray;

use super::card::Facts;
use super::{Asked, Queries, settings, steps, times};
use crate::math::format;
use crate::navigate::target::Side;
use crate::pipeline::semantics::query::answer::Basis;
use crate::scene::{GaussianCloud, IdentityId, SemanticMap};
use crate::ui::actions::Action;
use crate::ui::ctx::Ctx;
use crate::ui::theme;
use crate::worker::Versioned;

/// Number of hits in the list.
const LISTED: usize = 8;

/// Draws the pane of the query: its answer and the options.
pub(crate) fn show(
    ui: &mut Ui,
    queries: &mut Queries,
    semantics: &Versioned<SemanticMap>,
    cloud: &GaussianCloud,
    cx: &mut Ctx<'_>,
) {
    // The settings need the identity maps.
    queries.wanted = true;
    match queries.side().live.clone() {
        Some(newest) => {
            steps::show_said(ui, &newest);
            steps::show_steps(ui, queries, &newest, semantics);
            show_hits(ui, queries, &newest, semantics, cx);
            if let Some(&target) = newest.shown(&queries.side().settings).first() {
                let facts = queries.side_mut().facts_of(target, semantics, cloud);
                show_target(ui, target, &facts, cx);
            }
            let basis = match newest.answered.basis {
                Basis::Names => "by name",
                Basis::Embedding => "by embedding",
            };
            times::show(ui, basis, &newest.answered.stages.and(queries.side().overlay.paint_ms));
        }
        None => {
            ui.weak("No query yet: type into the field in the view ( / ).");
        }
    }
    ui.add_space(6.0);
    let side = queries.side_mut();
    let heat = (!side.overlay.heat.is_empty()).then_some(side.overlay.heat.as_slice());
    if settings::show(ui, &mut side.settings, heat) {
        queries.ask_again(semantics);
    }
}

fn show_hits(ui: &mut Ui, queries: &mut Queries, newest: &Asked, semantics: &Versioned<SemanticMap>, cx: &Ctx<'_>) {
    let shown = newest.shown(&queries.side().settings);
    let hits = newest.answered.answer.hits().iter().filter(|h| h.score > 0.0).take(LISTED);
    let mut chosen = None;
    // Names may be long.
    egui::ScrollArea::horizontal().id_salt("hits").show(ui, |ui| {
        egui::Grid::new("hits").num_columns(4).striped(true).show(ui, |ui| {
            for hit in hits {
                let name = cx.state.labels.full_name(&semantics.identities, hit.identity);
                if ui.selectable_label(shown.contains(&hit.identity), RichText::new(name).strong()).clicked() {
                    chosen = Some(hit.identity);
                }
                ui.weak(format!("{:.2}", hit.score)).on_hover_text("Score from 0 to 1");
                ui.weak(format!("+{:.2}", hit.margin.max(0.0))).on_hover_text("Margin over the next match");
                let pixels = match queries.area_of(semantics, hit.identity) {
                    Some(0) => "not in this view".to_owned(),
                    Some(n) => format!("{} px", format::count(n as u64)),
                    None => String::new(),
                };
                ui.weak(pixels);
                ui.end_row();
            }
        });
    });
    queries.side_mut().choose(chosen);
}

/// Draws the facts about the target in space, and its actions.
fn show_target(ui: &mut Ui, target: IdentityId, facts: &Facts, cx: &mut Ctx<'_>) {
    let unit = cx.state.scene.as_ref().and_then(|s| s.meters_per_unit());
    let edges = facts.bounds.map(|b| b.size().to_array().map(|edge| format::length(edge, unit)).join(" \u{00d7} "));
    let size = edges.map(|e| format!("  \u{00b7}  box {e}")).unwrap_or_default();
    let gaussians = format::things(facts.gaussians, "Gaussian");
    ui.label(RichText::new(format!("{gaussians}{size}")).small().color(theme::weak()));
    ui.horizontal_wrapped(|ui| {
        ui.menu_button(RichText::new("Go there\u{2026}").small(), |ui| {
            for &side in Side::VARIANTS {
                if ui.button(side.text()).clicked() {
                    cx.ask(Action::GoToTarget(target, side));
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
                cx.ask(action);
            }
        }
    });
}
