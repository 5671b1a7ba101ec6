//! The answer to the newest query: verdict, hits, and what can be done with the one that is shown.

use egui::{RichText, Ui};
use strum::VariantArray;

use super::{OverlaySettings, Queries, times};
use crate::navigate::target::Side;
use crate::pipeline::semantics::answer::Basis;
use crate::pipeline::semantics::localize::Answer;
use crate::pipeline::semantics::matching::{self, MatchMode};
use crate::pipeline::semantics::names;
use crate::pipeline::semantics::reading::mended_text;
use crate::scene::{Bounds, GaussianCloud, IdentityId, SemanticMap, text};
use crate::ui::actions::Action;
use crate::ui::theme;
use crate::worker::Versioned;

/// Hits that are listed.
const LISTED: usize = 5;

impl Queries {
    pub(super) fn show_answer(
        &mut self,
        ui: &mut Ui,
        semantics: &Versioned<SemanticMap>,
        cloud: &GaussianCloud,
        actions: &mut Vec<Action>,
    ) {
        let Some(newest) = self.live.as_ref().or(self.kept.last()).cloned() else { return };
        let identities = &semantics.identities;
        self.show_verdict(ui, &newest);
        let shown = newest.shown(&self.settings);
        let mut chosen = None;
        let hits = newest.answered.answer.hits().iter();
        for hit in hits.filter(|h| h.score > 0.0).take(LISTED) {
            ui.horizontal(|ui| {
                let name = RichText::new(identities.full_name(hit.identity)).strong();
                if ui.selectable_label(shown.contains(&hit.identity), name).clicked() {
                    chosen = Some(hit.identity);
                }
                let pixels = match self.area_of(semantics, hit.identity) {
                    Some(0) => "  not in this view".to_owned(),
                    Some(n) => format!("  {n} px"),
                    None => String::new(),
                };
                ui.weak(format!("{:.2}  +{:.2}{pixels}", hit.score, hit.margin.max(0.0)))
                    .on_hover_text("Score from 0 to 1, margin over the next, and pixels in this view");
            });
        }
        if let Some(&target) = shown.first() {
            let facts = self.facts_of(target, semantics, cloud);
            show_target(ui, target, &facts, actions);
        }
        let basis = match newest.answered.basis {
            Basis::Names => "by name",
            Basis::Embedding => "by embedding",
        };
        times::show(ui, basis, &newest.answered.stages.and(self.paint_ms));
        if newest.answered.answer.hits().iter().all(|h| h.score <= 0.0) {
            let known = names::completions(identities, "", 6).join(", ");
            ui.weak(format!("Names in this scene: {known}"));
        }
        if let (Some(id), Some(newest)) = (chosen, self.live.as_mut().or(self.kept.last_mut())) {
            newest.chosen = (newest.chosen != Some(id)).then_some(id);
        }
    }
}

/// The target in space.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Facts {
    /// What they were counted for.
    of: (u64, IdentityId, MatchMode, u32),
    gaussians: usize,
    /// In scene units, without stray Gaussians.
    bounds: Option<Bounds>,
}

impl Queries {
    /// Facts of the target; counted anew only when it or the match has changed.
    fn facts_of(&mut self, target: IdentityId, semantics: &Versioned<SemanticMap>, cloud: &GaussianCloud) -> Facts {
        let OverlaySettings { mode, tolerance, .. } = self.settings;
        let of = (semantics.generation(), target, mode, tolerance.to_bits());
        if let Some(facts) = self.facts.as_ref().filter(|f| f.of == of) {
            return facts.clone();
        }
        let inside = matching::gaussians(semantics, target, mode, tolerance);
        let gaussians = inside.iter().filter(|g| **g).count();
        let points = (0..cloud.len()).filter(|&i| inside.get(i) == Some(&true)).map(|i| cloud.world_position(i));
        let facts = Facts { of, gaussians, bounds: Bounds::robust(points) };
        self.facts = Some(facts.clone());
        facts
    }

    fn show_verdict(&self, ui: &mut Ui, newest: &super::Asked) {
        let quoted = |words: &[String]| text::shortened(&words.join("\", \""), 80).into_owned();
        let unknown = quoted(&newest.unknown);
        if let Some(mended) = mended_text(&newest.reading.mended) {
            ui.weak(text::shortened(&mended, 120));
        }
        match &newest.answered.answer {
            Answer::Found(_) if newest.ignored.is_empty() => {}
            Answer::Found(_) => {
                ui.colored_label(theme::WARNING, format!("Ignored: \"{}\".", quoted(&newest.ignored)));
            }
            Answer::Ambiguous(_) => {
                ui.colored_label(theme::WARNING, "Ambiguous:");
            }
            Answer::NotFound(_) if newest.pending => {
                ui.weak("Encoding the query\u{2026}");
            }
            Answer::NotFound(_) => {
                let text = match &*unknown {
                    "" => "No match.".to_owned(),
                    _ => format!("No match for \"{unknown}\"."),
                };
                ui.colored_label(theme::WARNING, text);
                if let Some((_, other)) = newest.reading.near.first() {
                    ui.weak(format!("Did you mean \"{other}\"?"));
                }
            }
        }
        if let Some(trouble) = self.embeddings.problem() {
            let text = format!("Names only, no open-vocabulary queries: {}", text::line(trouble));
            ui.label(RichText::new(text).small().color(theme::WARNING));
        }
    }
}

/// Facts of the target in space, and what can be done with it.
fn show_target(ui: &mut Ui, target: IdentityId, facts: &Facts, actions: &mut Vec<Action>) {
    let size = facts.bounds.map(size_text).unwrap_or_default();
    ui.label(RichText::new(format!("{} Gaussians{size}", facts.gaussians)).small().color(theme::WEAK));
    ui.horizontal(|ui| {
        let go = Action::GoToTarget(target, Side::Best);
        if ui.small_button("Go there").on_hover_text(go.tooltip()).clicked() {
            actions.push(go);
        }
        ui.menu_button(RichText::new("from\u{2026}").small(), |ui| {
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
            (Action::ExportTarget(target), "Export\u{2026}"),
        ] {
            if ui.small_button(text).on_hover_text(action.tooltip()).clicked() {
                actions.push(action);
            }
        }
    });
}

/// " · box 0.21 x 0.10 x 0.08", in scene units.
fn size_text(bounds: Bounds) -> String {
    let s = bounds.size();
    format!("  \u{00b7}  box {:.3} \u{00d7} {:.3} \u{00d7} {:.3}", s.x, s.y, s.z)
}
