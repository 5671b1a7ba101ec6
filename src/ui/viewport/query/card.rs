//! The answer to the query in the field: its target, certainty and size, and a button to fly there; in small views one
//! word.

use egui::{Align, Button, Color32, Layout, RichText, Ui};

use super::super::visible::Visibility;
use super::pins::swatch;
use super::{Asked, Queries};
use crate::math::format;
use crate::navigate::target::Side;
use crate::pipeline::semantics::answer::{Basis, Certainty};
use crate::pipeline::semantics::localize::Answer;
use crate::pipeline::semantics::matching::{self, MatchMode};
use crate::pipeline::semantics::names;
use crate::pipeline::semantics::reading::mended_text;
use crate::pipeline::semantics::recipe::Recipe;
use crate::scene::{Bounds, GaussianCloud, Identities, IdentityId, SemanticMap, text};
use crate::ui::actions::{Action, Pane};
use crate::ui::state::AppState;
use crate::ui::theme;
use crate::worker::Versioned;

/// Note on identities without Gaussians.
const EMPTY: &str = "empty: no Gaussians belong to it";

/// Number of equal hits that are named.
const NAMED: usize = 3;

impl Queries {
    pub(super) fn show_answer(
        &mut self,
        ui: &mut Ui,
        state: &AppState,
        (semantics, cloud, visibility): (&Versioned<SemanticMap>, &GaussianCloud, &Visibility),
        actions: &mut Vec<Action>,
    ) {
        let Some(newest) = self.side.live.clone() else { return };
        if let Some(mended) = mended_text(&newest.reading.mended) {
            ui.weak(text::shortened(&mended, 120));
        }
        let ignored = newest.ignored.join("\u{201d}, \u{201c}");
        if !ignored.is_empty() {
            let text = format!("Ignored: \u{201c}{}\u{201d}.", text::shortened(&ignored, 80));
            ui.colored_label(theme::warning(), text);
        }
        let shown = newest.shown(&self.side.settings);
        match (&newest.answered.answer, shown.first()) {
            (Answer::NotFound(_), None) if self.is_settled(ui) => self.show_nothing(ui, &newest, semantics),
            (Answer::Ambiguous(_), Some(_)) if newest.chosen.is_none() => {
                self.show_candidates(ui, state, &newest, &shown, semantics, actions);
            }
            (_, Some(&target)) => self.show_target(ui, state, &newest, target, (semantics, cloud, visibility), actions),
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

    /// Draws the choice among several hits.
    fn show_candidates(
        &mut self,
        ui: &mut Ui,
        state: &AppState,
        newest: &Asked,
        shown: &[IdentityId],
        semantics: &Versioned<SemanticMap>,
        actions: &mut Vec<Action>,
    ) {
        ui.horizontal(|ui| {
            swatch(ui, self.color_of(newest));
            ui.strong("Which one?");
            ui.weak(format!("{} fit equally.", shown.len()));
        });
        let mut chosen = None;
        for id in shown.iter().take(NAMED) {
            if ui.small_button(state.labels.full_name(&semantics.identities, *id)).clicked() {
                chosen = Some(*id);
            }
        }
        let more = shown.len().saturating_sub(NAMED);
        if more > 0 && ui.link(format!("{more} more\u{2026}")).clicked() {
            actions.push(Action::ShowPane(Pane::Query));
        }
        self.choose(chosen);
    }

    /// Draws the target.
    fn show_target(
        &mut self,
        ui: &mut Ui,
        state: &AppState,
        newest: &Asked,
        target: IdentityId,
        (semantics, cloud, visibility): (&Versioned<SemanticMap>, &GaussianCloud, &Visibility),
        actions: &mut Vec<Action>,
    ) {
        let facts = self.facts_of(target, semantics, cloud);
        let is_empty = state.is_empty(target);
        ui.horizontal(|ui| {
            swatch(ui, self.color_of(newest));
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let go = Action::GoToTarget(target, Side::Best);
                let button = ui.add_enabled(!is_empty, Button::new("Go there").small());
                if button.on_hover_text(go.tooltip()).clicked() {
                    actions.push(go);
                }
                let name = RichText::new(state.labels.full_name(&semantics.identities, target)).strong();
                ui.with_layout(Layout::left_to_right(Align::Center), |ui| ui.add(egui::Label::new(name).truncate()));
            });
        });
        ui.horizontal(|ui| {
            let (certainty, color, numbers) = certainty(newest);
            ui.colored_label(color, certainty).on_hover_text(numbers);
            if let Some(bounds) = facts.bounds {
                ui.weak(size_text(bounds, state)).on_hover_text("Longest edge of its bounding box");
            }
            let unseen = if is_empty { Some(EMPTY) } else { self.why_unseen(semantics, visibility, target) };
            if let Some(why) = unseen {
                ui.colored_label(theme::warning(), format!("It is {why}."));
                if visibility.draws(&semantics.identities, target) == Some(false)
                    && ui.small_button("Show it").clicked()
                {
                    actions.push(Action::Hide(target));
                }
            }
        });
    }

    /// Reason why no pixel of an identity is visible, if none is.
    fn why_unseen(
        &mut self,
        semantics: &Versioned<SemanticMap>,
        visibility: &Visibility,
        target: IdentityId,
    ) -> Option<&'static str> {
        if let Some(hidden) = visibility.why_not_drawn(&semantics.identities, target) {
            return Some(hidden);
        }
        if self.area_of(semantics, target) != Some(0) {
            return None;
        }
        let maps = self.maps.as_ref()?;
        let Recipe { masks, tolerance, .. } = self.side.settings.recipe;
        let is_there = || maps.mask(semantics, target, MatchMode::Identities, tolerance).area() > 0;
        if masks == MatchMode::Codes && is_there() {
            return Some("blended beyond the tolerance here; the exact mask shows it");
        }
        Some("not in this view")
    }

    /// The answer in a word or two, its color, and further remarks.
    pub(super) fn answer_in_short(
        &mut self,
        ui: &Ui,
        state: &AppState,
        semantics: &Versioned<SemanticMap>,
        visibility: &Visibility,
    ) -> Option<(String, Color32, String)> {
        let newest = self.side.live.clone()?;
        if let Some(comparison) = &self.side.comparison {
            return Some((comparison.figure(), theme::text(), newest.text));
        }
        let shown = newest.shown(&self.side.settings);
        match (&newest.answered.answer, shown.first()) {
            (Answer::NotFound(_), None) => (self.is_settled(ui) && !newest.pending)
                .then(|| ("no match".to_owned(), theme::warning(), self.nothing_text(&newest, &semantics.identities))),
            (Answer::Ambiguous(_), Some(_)) if newest.chosen.is_none() => {
                Some((format!("{} fit", shown.len()), theme::warning(), "Which one? Unfold to choose.".to_owned()))
            }
            (_, Some(&target)) => {
                let name = state.labels.full_name(&semantics.identities, target);
                if state.is_empty(target) {
                    return Some(("empty".to_owned(), theme::warning(), format!("{name} is {EMPTY}.")));
                }
                match self.why_unseen(semantics, visibility, target) {
                    Some(why) => Some((why.to_owned(), theme::warning(), name)),
                    None => {
                        let (certainty, color, numbers) = certainty(&newest);
                        Some((certainty.to_owned(), color, format!("{name}\n{numbers}")))
                    }
                }
            }
            _ => None,
        }
    }

    fn nothing_text(&self, newest: &Asked, identities: &Identities) -> String {
        if names::was_removed(identities, &newest.reading.phrase.text) {
            return "It was removed from this scene.".to_owned();
        }
        let unexplained = newest.unexplained.join("\u{201d}, \u{201c}");
        match &*text::shortened(&unexplained, 80) {
            "" => "No match.".to_owned(),
            words => format!("No match for \u{201c}{words}\u{201d}."),
        }
    }

    fn show_nothing(&mut self, ui: &mut Ui, newest: &Asked, semantics: &SemanticMap) {
        if newest.pending {
            ui.weak("Encoding the query\u{2026}");
            return;
        }
        ui.colored_label(theme::warning(), self.nothing_text(newest, &semantics.identities));
        let [by_name, by_looks] = newest
            .answered
            .offers(NAMED)
            .map(|ids| ids.into_iter().map(|id| semantics.identities.full_name(id)).collect::<Vec<_>>());
        let named: Vec<String> = newest.reading.near.iter().map(|(_, other)| other.clone()).chain(by_name).collect();
        ui.horizontal_wrapped(|ui| match (named.is_empty(), by_looks.is_empty()) {
            (false, _) => {
                ui.weak("Did you mean");
                self.show_names(ui, &named[..named.len().min(NAMED)], semantics);
            }
            (true, false) => {}
            (true, true) => {
                let mut known = names::completions(&semantics.identities, "", usize::MAX);
                if known.is_empty() {
                    ui.weak("Nothing here has a name yet; Details lists what comes nearest.");
                } else {
                    ui.weak(format!("{}, e.g.", format::things(known.len(), "name")));
                }
                known.truncate(NAMED);
                self.show_names(ui, &known, semantics);
            }
        });
        if !by_looks.is_empty() {
            ui.horizontal_wrapped(|ui| {
                ui.weak("Looks most like").on_hover_text("By embedding: no name says so");
                self.show_names(ui, &by_looks, semantics);
            });
        }
    }
}

/// Certainty of the answer, its color, and the scores behind it.
fn certainty(newest: &Asked) -> (&'static str, Color32, String) {
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
    (certainty.into(), color, numbers)
}

/// The longest edge, with the scene's unit.
fn size_text(bounds: Bounds, state: &AppState) -> String {
    format::length(bounds.size().max_element(), state.scene.as_ref().and_then(|s| s.meters_per_unit()))
}

/// Facts about the target in space.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Facts {
    /// Generation, identity and match that they were computed for.
    of: (u64, IdentityId, MatchMode, u32),
    pub(super) gaussians: usize,
    /// Bounds in scene units, without outlier Gaussians.
    pub(super) bounds: Option<Bounds>,
}

impl Queries {
    /// Facts about the target; recomputed only when it or the match has changed.
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
