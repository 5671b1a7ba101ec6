//! The answer to the newest query in one line: what is meant, how surely, how large it is, and the way there.

use egui::{Align, Layout, RichText, Ui};

use super::super::visible::Visibility;
use super::Queries;
use crate::math::format;
use crate::navigate::target::Side;
use crate::pipeline::semantics::answer::{Basis, Certainty};
use crate::pipeline::semantics::localize::Answer;
use crate::pipeline::semantics::matching::{self, MatchMode};
use crate::pipeline::semantics::names;
use crate::pipeline::semantics::reading::mended_text;
use crate::pipeline::semantics::recipe::Recipe;
use crate::scene::{Bounds, GaussianCloud, IdentityId, SemanticMap, text};
use crate::ui::actions::{Action, Pane};
use crate::ui::state::AppState;
use crate::ui::theme;
use crate::worker::Versioned;

/// Things that fit equally and are named.
const NAMED: usize = 3;

impl Queries {
    pub(super) fn show_answer(
        &mut self,
        ui: &mut Ui,
        state: &AppState,
        (semantics, cloud, visibility): (&Versioned<SemanticMap>, &GaussianCloud, &Visibility),
        actions: &mut Vec<Action>,
    ) {
        let Some(newest) = self.newest().cloned() else { return };
        if let Some(mended) = mended_text(&newest.reading.mended) {
            ui.weak(text::shortened(&mended, 120));
        }
        let ignored = newest.ignored.join("\", \"");
        if !ignored.is_empty() {
            ui.colored_label(theme::warning(), format!("Ignored: \"{}\".", text::shortened(&ignored, 80)));
        }
        let shown = newest.shown(&self.side.settings);
        match (&newest.answered.answer, shown.first()) {
            (Answer::NotFound(_), None) => self.show_nothing(ui, &newest, semantics),
            (Answer::Ambiguous(_), Some(_)) if newest.chosen.is_none() => {
                let mut chosen = None;
                ui.colored_label(theme::warning(), format!("Ambiguous: {} equal matches.", shown.len()));
                for id in shown.iter().take(NAMED) {
                    if ui.small_button(state.labels.full_name(&semantics.identities, *id)).clicked() {
                        chosen = Some(*id);
                    }
                }
                if let Some(more) = shown.len().checked_sub(NAMED).filter(|more| *more > 0)
                    && ui.link(format!("{more} more\u{2026}")).clicked()
                {
                    actions.push(Action::ShowPane(Pane::Query));
                }
                self.choose(chosen);
            }
            (_, Some(&target)) => {
                let facts = self.facts_of(target, semantics, cloud);
                let pixels = self.area_of(semantics, target);
                ui.horizontal(|ui| {
                    let name = state.labels.full_name(&semantics.identities, target);
                    ui.add(egui::Label::new(RichText::new(name).strong()).truncate());
                    certainty(ui, &newest);
                    if let Some(bounds) = facts.bounds {
                        ui.weak(size_text(bounds, state)).on_hover_text("Longest edge of its bounding box");
                    }
                    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                        let go = Action::GoToTarget(target, Side::Best);
                        if ui.small_button("Go there").on_hover_text(go.tooltip()).clicked() {
                            actions.push(go);
                        }
                    });
                });
                let hidden = visibility.why_not_drawn(&semantics.identities, target);
                if let Some(why) = hidden.or((pixels == Some(0)).then_some("not in this view")) {
                    ui.horizontal(|ui| {
                        ui.colored_label(theme::warning(), format!("It is {why}."));
                        if visibility.draws(&semantics.identities, target) == Some(false)
                            && ui.small_button("Show it").clicked()
                        {
                            actions.push(Action::Hide(target));
                        }
                    });
                }
            }
            _ => {}
        }
        if let Some(comparison) = &self.side.comparison {
            comparison.show(ui);
        }
        if let Some(trouble) = self.embeddings.problem() {
            let text = format!("Names only, no open-vocabulary queries: {}", text::line(trouble));
            ui.label(RichText::new(text).small().color(theme::warning()));
        }
    }

    fn show_nothing(&self, ui: &mut Ui, newest: &super::Asked, semantics: &SemanticMap) {
        if newest.pending {
            ui.weak("Encoding the query\u{2026}");
            return;
        }
        let unknown = newest.unknown.join("\", \"");
        let text = match &*text::shortened(&unknown, 80) {
            "" => "No match.".to_owned(),
            unknown => format!("No match for \"{unknown}\"."),
        };
        ui.colored_label(theme::warning(), text);
        let known = names::completions(&semantics.identities, "", 6).join(", ");
        match newest.reading.near.first() {
            Some((_, other)) => ui.weak(format!("Did you mean \"{other}\"?")),
            None => ui.weak(format!("Names in this scene: {known}")),
        };
    }
}

/// How sure the answer is, with the numbers that say so.
fn certainty(ui: &mut Ui, newest: &super::Asked) {
    let certainty = newest.answered.certainty(&newest.ignored);
    let color = match certainty {
        Certainty::Certain => theme::good(),
        Certainty::Likely => theme::text(),
        Certainty::Guess => theme::warning(),
    };
    let by = match newest.answered.basis {
        Basis::Names => "by name",
        Basis::Embedding => "by embedding",
    };
    let numbers = newest.answered.answer.hits().first().map_or_else(String::new, |hit| {
        format!("Score {:.2}, margin {:.2}, found {by}", hit.score, hit.margin.max(0.0))
    });
    ui.colored_label(color, <&str>::from(certainty)).on_hover_text(numbers);
}

/// The longest edge, in the scene's unit.
fn size_text(bounds: Bounds, state: &AppState) -> String {
    format::length(bounds.size().max_element(), state.scene.as_ref().and_then(|s| s.meters_per_unit()))
}

/// The target in space.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Facts {
    /// What they were counted for.
    of: (u64, IdentityId, MatchMode, u32),
    pub(super) gaussians: usize,
    /// In scene units, without stray Gaussians.
    pub(super) bounds: Option<Bounds>,
}

impl Queries {
    /// Facts of the target; counted anew only when it or the match has changed.
    pub(super) fn facts_of(
        &mut self,
        target: IdentityId,
        semantics: &Versioned<SemanticMap>,
        cloud: &GaussianCloud,
    ) -> Facts {
        let Recipe { masks: mode, tolerance, .. } = self.side.settings.recipe;
        let of = (semantics.generation(), target, mode, tolerance.to_bits());
        if let Some(facts) = self.side.facts.as_ref().filter(|f| f.of == of) {
            return facts.clone();
        }
        let inside = matching::gaussians(semantics, target, mode, tolerance);
        let gaussians = inside.iter().filter(|g| **g).count();
        let points = (0..cloud.len()).filter(|&i| inside.get(i) == Some(&true)).map(|i| cloud.world_position(i));
        let facts = Facts { of, gaussians, bounds: Bounds::robust(points) };
        self.side.facts = Some(facts.clone());
        facts
    }
}
