//! The answer to the query in the field: its target, certainty and size, and a button to fly there; in small views one
//! word.

use egui::{Align, Button, Color32, Layout, RichText, Ui};

use super::bar::show_names;
use super::pins::swatch;
use super::{Asked, Queries, SearchedScene, steps};
use crate::math::format;
use crate::navigate::target::Side;
use crate::pipeline::semantics::query::answer::{Basis, Certainty};
use crate::pipeline::semantics::query::language::slips::mended_text;
use crate::pipeline::semantics::query::localize::Answer;
use crate::pipeline::semantics::query::matching::{self, MatchMode};
use crate::pipeline::semantics::query::names;
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::scene::{Bounds, GaussianCloud, Identities, IdentityId, SemanticMap, text};
use crate::ui::actions::{Action, Pane};
use crate::ui::ctx::Ctx;
use crate::ui::state::AppState;
use crate::ui::theme;
use crate::worker::Versioned;

/// Note on identities without Gaussians.
const EMPTY: &str = "empty: no Gaussians belong to it";

/// Number of equal hits that are named.
const NAMED: usize = 3;

/// Draws the answer to the query in the field.
pub(super) fn show(ui: &mut Ui, queries: &mut Queries, scene: SearchedScene<'_>, cx: &mut Ctx<'_>) {
    let Some(newest) = queries.side().live.clone() else { return };
    if let Some(mended) = mended_text(&newest.reading.mended) {
        ui.weak(text::shortened_at_word(&mended, 120));
    }
    let ignored = newest.ignored.join("\u{201d}, \u{201c}");
    if !ignored.is_empty() {
        let text = format!("Ignored: \u{201c}{}\u{201d}.", text::shortened_at_word(&ignored, 80));
        ui.colored_label(theme::warning(), text);
    }
    let shown = newest.shown(&queries.side().settings);
    steps::show_said(ui, &newest);
    match (&newest.answered.answer, shown.first()) {
        (Answer::NotFound(_), None) if queries.side().is_settled(ui) => {
            show_nothing(ui, queries, &newest, scene.semantics);
        }
        (Answer::Ambiguous(_), Some(_)) if newest.chosen.is_none() => {
            show_several(ui, queries, &newest, scene.semantics, cx);
        }
        (Answer::Found(_), Some(_)) if shown.len() > 1 => show_several(ui, queries, &newest, scene.semantics, cx),
        (_, Some(&target)) => show_target(ui, queries, &newest, target, scene, cx),
        _ => {}
    }
    if let Some(comparison) = &queries.side().overlay.comparison {
        comparison.show(ui);
    }
    if let Some(trouble) = queries.embeddings.problem() {
        let text = format!("Names only, no open-vocabulary queries: {}", text::line(trouble));
        ui.label(RichText::new(text).small().color(theme::warning()));
    }
}

/// Draws several hits with their numbers: all that are meant, or a choice.
fn show_several(
    ui: &mut Ui,
    queries: &mut Queries,
    newest: &Asked,
    semantics: &Versioned<SemanticMap>,
    cx: &mut Ctx<'_>,
) {
    let shown = newest.shown(&queries.side().settings);
    ui.horizontal(|ui| {
        swatch(ui, queries.color_of(newest));
        if matches!(newest.answered.answer, Answer::Ambiguous(_)) {
            ui.strong("Which one?");
            ui.weak(format!("{} fit equally.", shown.len()));
        } else {
            let (certainty, color, numbers) = certainty(newest);
            ui.strong(format::things(shown.len(), "thing"));
            ui.colored_label(color, certainty).on_hover_text(numbers);
        }
    });
    let mut chosen = None;
    for (id, n) in shown.iter().zip(1..).take(NAMED) {
        let name = cx.state.labels.full_name(&semantics.identities, *id);
        let button = ui.small_button(format!("{n}  {name}")).on_hover_text("Show this one");
        if button.accessible_name(&name).clicked() {
            chosen = Some(*id);
        }
    }
    let more = shown.len().saturating_sub(NAMED);
    if more > 0 && ui.link(format!("{more} more\u{2026}")).clicked() {
        cx.ask(Action::ShowPane(Pane::Query));
    }
    queries.side_mut().choose(chosen);
}

/// Draws the target.
fn show_target(
    ui: &mut Ui,
    queries: &mut Queries,
    newest: &Asked,
    target: IdentityId,
    scene: SearchedScene<'_>,
    cx: &mut Ctx<'_>,
) {
    let (state, SearchedScene { semantics, cloud, visibility }) = (cx.state, scene);
    let facts = queries.side_mut().facts_of(target, semantics, cloud);
    let is_empty = state.is_empty(target);
    ui.horizontal(|ui| {
        swatch(ui, queries.color_of(newest));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let go = Action::GoToTarget(target, Side::Best);
            let button = ui.add_enabled(!is_empty, Button::new("Go there").small());
            if button.on_hover_text(go.tooltip()).clicked() {
                cx.ask(go);
            }
            let name = RichText::new(state.labels.full_name(&semantics.identities, target)).strong();
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| ui.add(egui::Label::new(name).truncate()));
        });
    });
    ui.horizontal(|ui| {
        let (certainty, color, numbers) = certainty(newest);
        ui.colored_label(color, certainty).on_hover_text(numbers);
        if let Some(bounds) = facts.bounds {
            let text = format!("\u{b7} {} long", size_text(bounds, state));
            ui.weak(text).on_hover_text("Longest edge of its bounding box");
        }
        let unseen = if is_empty { Some(EMPTY) } else { why_unseen(queries, scene, target) };
        if let Some(why) = unseen {
            ui.colored_label(theme::warning(), format!("It is {why}."));
            if visibility.draws(&semantics.identities, target) == Some(false) && ui.small_button("Show it").clicked() {
                cx.ask(Action::Hide(target));
            }
        }
    });
}

/// Reason why no pixel of an identity is visible, if none is.
fn why_unseen(queries: &mut Queries, scene: SearchedScene<'_>, target: IdentityId) -> Option<&'static str> {
    let semantics = scene.semantics;
    if let Some(hidden) = scene.visibility.why_not_drawn(&semantics.identities, target) {
        return Some(hidden);
    }
    if queries.area_of(semantics, target) != Some(0) {
        return None;
    }
    let maps = queries.maps.as_ref()?;
    let QueryConfig { masks, tolerance, .. } = queries.side().settings.recipe;
    let is_there = || maps.mask(semantics, target, MatchMode::Identities, tolerance).area() > 0;
    if masks == MatchMode::Codes && is_there() {
        return Some("blended beyond the tolerance here; the exact mask shows it");
    }
    Some("not in this view")
}

/// The answer in a word or two, its color, and further remarks.
pub(super) fn in_short(
    ui: &Ui,
    queries: &mut Queries,
    scene: SearchedScene<'_>,
    state: &AppState,
) -> Option<(String, Color32, String)> {
    let newest = queries.side().live.clone()?;
    if let Some(comparison) = &queries.side().overlay.comparison {
        return Some((comparison.figure(), theme::text(), newest.text));
    }
    let semantics = scene.semantics;
    let shown = newest.shown(&queries.side().settings);
    match (&newest.answered.answer, shown.first()) {
        (Answer::NotFound(_), None) => (queries.side().is_settled(ui) && !newest.pending)
            .then(|| ("no match".to_owned(), theme::warning(), nothing_text(&newest, &semantics.identities))),
        (Answer::Ambiguous(_), Some(_)) if newest.chosen.is_none() => {
            Some((format!("{} fit", shown.len()), theme::warning(), "Which one? Unfold to choose.".to_owned()))
        }
        (Answer::Found(_), Some(_)) if shown.len() > 1 => {
            let (_, color, numbers) = certainty(&newest);
            Some((format::things(shown.len(), "thing"), color, numbers))
        }
        (_, Some(&target)) => {
            let name = state.labels.full_name(&semantics.identities, target);
            if state.is_empty(target) {
                return Some(("empty".to_owned(), theme::warning(), format!("{name} is {EMPTY}.")));
            }
            match why_unseen(queries, scene, target) {
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

fn nothing_text(newest: &Asked, identities: &Identities) -> String {
    if names::was_removed(identities, &newest.reading.phrase.text) {
        return "It was removed from this scene.".to_owned();
    }
    let unexplained = newest.unexplained.join("\u{201d}, \u{201c}");
    match &*text::shortened_at_word(&unexplained, 80) {
        "" => "No match.".to_owned(),
        words => format!("No match for \u{201c}{words}\u{201d}."),
    }
}

fn show_nothing(ui: &mut Ui, queries: &mut Queries, newest: &Asked, semantics: &SemanticMap) {
    if newest.pending {
        ui.weak("Encoding the query\u{2026}");
        return;
    }
    ui.colored_label(theme::warning(), nothing_text(newest, &semantics.identities));
    steps::show_misunderstood(ui, newest);
    let [by_name, by_looks] = newest
        .answered
        .offers(NAMED)
        .map(|ids| ids.into_iter().map(|id| semantics.identities.full_name(id)).collect::<Vec<_>>());
    let named: Vec<String> = newest.reading.near.iter().map(|(_, other)| other.clone()).chain(by_name).collect();
    let weak = |text: String| RichText::new(text).color(theme::weak());
    match (named.is_empty(), by_looks.is_empty()) {
        (false, _) => {
            let named = &named[..named.len().min(NAMED)];
            theme::hanging(ui, weak("Did you mean".into()), |ui| show_names(ui, queries, named, semantics));
        }
        (true, false) => {}
        (true, true) => {
            let mut known = names::completions(&semantics.identities, "", usize::MAX);
            if known.is_empty() {
                ui.weak("Nothing here has a name yet; Details lists what comes nearest.");
            } else {
                let label = format!("{}, e.g.", format::things(known.len(), "name"));
                known.truncate(NAMED);
                theme::hanging(ui, weak(label), |ui| show_names(ui, queries, &known, semantics));
            }
        }
    }
    if !by_looks.is_empty() {
        // By embedding: no name says so.
        let label = weak("Looks most like".into());
        theme::hanging(ui, label, |ui| show_names(ui, queries, &by_looks, semantics));
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

impl Facts {
    pub(super) fn new(
        target: IdentityId,
        semantics: &Versioned<SemanticMap>,
        cloud: &GaussianCloud,
        recipe: &QueryConfig,
    ) -> Self {
        let QueryConfig { masks, tolerance, .. } = *recipe;
        let inside = matching::gaussians(semantics, target, masks, tolerance);
        let gaussians = inside.iter().filter(|g| **g).count();
        let points = (0..cloud.len()).filter(|&i| inside.get(i) == Some(&true)).map(|i| cloud.world_position(i));
        let of = Self::key(target, semantics, recipe);
        Self { of, gaussians, bounds: Bounds::robust(points) }
    }

    /// True if they are about this target as the recipe matches it.
    pub(super) fn is_of(&self, target: IdentityId, semantics: &Versioned<SemanticMap>, recipe: &QueryConfig) -> bool {
        self.of == Self::key(target, semantics, recipe)
    }

    fn key(
        target: IdentityId,
        semantics: &Versioned<SemanticMap>,
        recipe: &QueryConfig,
    ) -> (u64, IdentityId, MatchMode, u32) {
        (semantics.generation(), target, recipe.masks, recipe.tolerance.to_bits())
    }
}
