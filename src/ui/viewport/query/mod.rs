//! Queries of the scene: the query field, the answers, and their overlay on the frame. A query replaces the one before,
//! unless that is pinned.
//!
//! Identity maps of the view are drawn once, at rest; every query then only reads them, even during typing.

mod asked;
mod bar;
mod card;
mod carry_over;
pub(crate) mod closed;
pub(super) mod details;
mod embeddings;
mod overlay;
mod paint;
pub(super) mod panel;
mod pins;
mod place;
mod recipe;
mod settings;
mod side;
mod steps;
mod times;
mod truth;

use std::sync::Arc;

use egui::{Color32, Rect, Ui, Vec2};

pub use self::asked::Asked;
use self::embeddings::Embeddings;
pub(crate) use self::overlay::{HATCH, INVENTED};
use self::paint::PaintedQueries;
pub(crate) use self::settings::OverlaySettings;
use self::side::{QuerySide, all_of};
use self::truth::TrueMask;
use super::visible::Visibility;
use crate::jobs::phrases::colors::PhraseColors;
use crate::jobs::query::ViewMaps;
use crate::navigate::Pose;
use crate::pipeline::semantics::query::language::QueryPlace;
use crate::pipeline::semantics::query::matching::MatchMode;
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::scene::{GaussianCloud, IdentityId, Mask, ScenePlan, SemanticMap};
use crate::ui::color_by::ColorBy;
use crate::worker::Versioned;

/// Largest number of pinned queries.
const MOST_PINNED: usize = 6;

/// The scene that is queried.
#[derive(Clone, Copy)]
pub(super) struct SearchedScene<'a> {
    pub(super) semantics: &'a Versioned<SemanticMap>,
    pub(super) cloud: &'a GaussianCloud,
    pub(super) visibility: &'a Visibility,
}

/// The queries on screen.
#[derive(Default)]
pub struct Queries {
    /// Queries of the first and of the second view.
    sides: [QuerySide; 2],
    /// Place of the active view, which gets new queries.
    active: usize,
    /// True if a query was typed or begun in this scene.
    wanted: bool,
    /// Earlier queries, oldest first.
    history: Vec<String>,
    colors: PhraseColors,
    maps: Option<Versioned<ViewMaps>>,
    /// Identity maps of a moving view, at the resolution of the frame.
    moving: Option<Versioned<ViewMaps>>,
    /// Generation of the objects and parts that were searched.
    answered_for: u64,
    /// Embeddings of the texts on screen.
    embeddings: Embeddings,
    /// Reason why embeddings are missing, once reported.
    reported: Option<String>,
    true_mask: TrueMask,
    /// Place from which the scene is asked.
    place: QueryPlace,
}

impl Queries {
    /// Queries of the active view.
    fn side(&self) -> &QuerySide {
        &self.sides[self.active]
    }

    fn side_mut(&mut self) -> &mut QuerySide {
        &mut self.sides[self.active]
    }

    /// True if the second of two views is active, which gets new queries.
    pub fn is_second(&self) -> bool {
        self.active == 1
    }

    /// Makes the first or the second of two views active.
    pub(crate) fn work_in(&mut self, second: bool) {
        self.active = usize::from(second);
    }

    /// Runs `act` with the first or the second of two views active.
    pub fn in_view<R>(&mut self, second: bool, act: impl FnOnce(&mut Self) -> R) -> R {
        let before = self.is_second();
        self.work_in(second);
        let result = act(self);
        self.work_in(before);
        result
    }

    /// The queries that are pinned in the first and the second view.
    pub(crate) fn pinned_texts(&self) -> [Vec<String>; 2] {
        self.sides.each_ref().map(QuerySide::pinned_texts)
    }

    /// Pins only these queries in the first and the second view.
    pub(crate) fn pin_only(&mut self, texts: &[Vec<String>; 2], semantics: &SemanticMap) {
        for (second, texts) in [false, true].into_iter().zip(texts) {
            self.in_view(second, |all| {
                if all.side().pinned.iter().map(|q| &q.text).ne(texts) {
                    all.side_mut().pinned = all.answers(texts, semantics);
                }
            });
        }
    }

    /// Recipe of the active view.
    pub(crate) fn recipe(&self) -> &QueryConfig {
        &self.side().settings.recipe
    }

    /// Recipes of the first and the second view.
    pub(crate) fn recipes(&self) -> [QueryConfig; 2] {
        self.sides.each_ref().map(|side| side.settings.recipe.clone())
    }

    /// Sets the recipes of the first and the second view and answers again.
    pub(crate) fn set_recipes(&mut self, recipes: &[QueryConfig; 2], semantics: &SemanticMap) {
        if self.recipes() != *recipes {
            for (side, recipe) in self.sides.iter_mut().zip(recipes) {
                side.settings.recipe = recipe.clone();
            }
            self.ask_again(semantics);
        }
    }

    /// All queries, the one in the field last.
    pub fn all(&self) -> impl Iterator<Item = &Asked> {
        self.side().all()
    }

    /// The identities found on screen.
    pub fn found(&self) -> Vec<IdentityId> {
        self.all().flat_map(|asked| asked.shown(&self.side().settings)).collect()
    }

    /// The found identities with the colors of their queries.
    pub(super) fn found_colors(&self) -> Vec<(IdentityId, Color32)> {
        let colored = |q: &Asked| {
            let [r, g, b] = self.colors.of(&q.text);
            q.shown(&self.side().settings).into_iter().map(move |id| (id, Color32::from_rgb(r, g, b)))
        };
        self.all().flat_map(colored).collect()
    }

    /// Identity maps of the current view, once drawn.
    pub fn maps(&self) -> Option<&Versioned<ViewMaps>> {
        self.maps.as_ref()
    }

    /// True if a query was typed or begun in this scene: its resources are needed now.
    pub(crate) fn wanted(&self) -> bool {
        self.wanted
    }

    /// True if blended codes of the view are needed.
    pub(crate) fn wants_codes(&self) -> bool {
        let needs = |s: &OverlaySettings| s.recipe.masks == MatchMode::Codes || s.color_by == ColorBy::Difference;
        self.sides.iter().any(|side| needs(&side.settings))
    }

    /// Focuses the query field.
    pub(crate) fn start_typing(&mut self) {
        self.wanted = true;
        self.side_mut().start_typing();
    }

    /// Answers again if objects, parts or embeddings have changed.
    pub(crate) fn keep_up(&mut self, ctx: &egui::Context, semantics: &Versioned<SemanticMap>, plan: &ScenePlan) {
        let encoder = semantics.language.as_ref().map(|l| l.encoder.as_str());
        let now = semantics.generation();
        // An encoder no longer in use is dropped at once; a new one is loaded at the first query.
        let texts = self.sides.iter().flat_map(QuerySide::texts).collect();
        let encoded =
            (encoder.is_none() || plan.encoder.now(self.wanted)) && self.embeddings.keep_up(ctx, encoder, texts);
        if encoded || self.answered_for != now {
            self.answered_for = now;
            self.ask_again(semantics);
        }
    }

    /// Runs a query as if its text had been typed.
    pub(crate) fn ask(&mut self, text: &str, semantics: &SemanticMap) {
        self.wanted = true;
        let live = self.asked(text, semantics);
        let side = self.side_mut();
        (side.typed, side.typed_at, side.live) = (text.to_owned(), None, live);
        self.keep_color();
    }

    /// Answers the typed text, which may change yet.
    fn ask_typed(&mut self, now: f64, semantics: &SemanticMap) {
        let live = self.asked(&self.side().typed, semantics);
        let side = self.side_mut();
        (side.live, side.typed_at) = (live, Some(now));
        (side.recalled, side.focus) = (None, 0);
    }

    /// Marks the typed query as complete: it enters the history and keeps its color.
    fn settle(&mut self) {
        self.side_mut().typed_at = None;
        self.keep_color();
        let Some(text) = self.side().live.as_ref().map(|q| q.text.clone()) else { return };
        self.history.retain(|t| *t != text);
        self.history.push(text);
        self.side_mut().recalled = Some(self.history.len() - 1);
    }

    /// Fixes the color of the query in the field, if it has an answer.
    fn keep_color(&mut self) {
        let side = &self.sides[self.active];
        if let Some(live) = side.live.as_ref().filter(|q| !q.shown(&side.settings).is_empty()) {
            self.colors.keep(&live.text);
        }
    }

    /// Fixes the colors of these phrases; returns all fixed colors.
    pub(crate) fn colors_of(&mut self, phrases: &[String]) -> PhraseColors {
        self.colors.keep_all(phrases);
        self.colors.clone()
    }

    /// The color of a query's outline; `None` if nothing is outlined.
    fn color_of(&self, query: &Asked) -> Option<Color32> {
        let [r, g, b] = self.colors.of(&query.text);
        (!query.shown(&self.side().settings).is_empty()).then_some(Color32::from_rgb(r, g, b))
    }

    /// Pins or unpins the query in the field.
    fn pin(&mut self) {
        let side = &mut self.sides[self.active];
        let Some(live) = side.live.clone() else { return };
        let before = side.pinned.len();
        side.pinned.retain(|q| q.text != live.text);
        if side.pinned.len() < before {
            return;
        }
        if before == MOST_PINNED {
            side.pinned.remove(0);
        }
        self.colors.keep(&live.text);
        side.pinned.push(live);
    }

    /// Shows the answers to these queries only.
    pub(crate) fn mark(&mut self, texts: &[String], semantics: &SemanticMap) {
        self.colors.keep_all(texts);
        let (last, others) = texts.split_last().map_or(("", texts), |(last, others)| (last, others));
        self.side_mut().pinned = self.answers(others, semantics);
        self.ask(last, semantics);
    }

    /// Answers all queries again, as identities have changed.
    pub(crate) fn ask_again(&mut self, semantics: &SemanticMap) {
        for second in [false, true] {
            self.in_view(second, |all| {
                let pinned = all.answers(&all.side().pinned_texts(), semantics);
                let live = all.side().live.as_ref().and_then(|q| all.asked(&q.text, semantics));
                let side = all.side_mut();
                (side.pinned, side.live) = (pinned, live);
            });
        }
    }

    /// Clears queries and answers for another scene.
    pub(crate) fn clear(&mut self) {
        let Self { sides, active, history, colors, embeddings, .. } = std::mem::take(self);
        let sides = sides.map(QuerySide::cleared);
        *self = Self { sides, active, history, colors, embeddings, ..Self::default() };
    }

    /// Reason why only names are searched, once for each reason.
    pub(crate) fn newly_failed(&mut self) -> Option<String> {
        let why = self.embeddings.problem()?.to_owned();
        (self.reported.replace(why.clone()).as_ref() != Some(&why)).then_some(why)
    }

    /// Takes over identity maps of the current view: exact, or of a moving one.
    pub(crate) fn set_maps(&mut self, maps: Versioned<ViewMaps>, exact: bool) {
        (self.maps, self.moving) = if exact { (Some(maps), None) } else { (None, Some(maps)) };
    }

    /// Drops the identity maps. If only the camera has moved, the drawn ones stay on screen until new ones arrive.
    pub(crate) fn forget_maps(&mut self, only_moved: bool) {
        let before = self.maps.take().or(self.moving.take());
        self.moving = before.filter(|_| only_moved);
    }

    /// The identity maps on screen: exact, or of the newest frame of a moving view.
    pub fn shown_maps(&self) -> Option<&Versioned<ViewMaps>> {
        self.maps.as_ref().or(self.moving.as_ref())
    }

    /// Colors the view by this quantity; back to masks if it is in use already.
    pub(crate) fn tint(&mut self, by: ColorBy) {
        let color_by = &mut self.side_mut().settings.color_by;
        *color_by = if *color_by == by { ColorBy::Masks } else { by };
        self.wanted = true;
    }

    /// Display settings of the answers.
    pub(super) fn settings(&mut self) -> &mut OverlaySettings {
        &mut self.side_mut().settings
    }

    /// True if an overlay from identity maps is drawn over the frame.
    pub(super) fn tints(&self) -> bool {
        self.sides.iter().any(|side| side.overlay.is_painted())
    }

    /// Paints masks and tints over the frame in `rect`. With `lit`, all else is dimmed except the found ones.
    pub(crate) fn paint(
        &mut self,
        ui: &Ui,
        rect: Rect,
        semantics: &Versioned<SemanticMap>,
        lit: Option<Vec<IdentityId>>,
    ) {
        let Some(maps) = self.maps.as_ref().or(self.moving.as_ref()) else { return };
        let QuerySide { settings, live, pinned, overlay, .. } = &mut self.sides[self.active];
        let asked = all_of(pinned, live.as_ref()).collect();
        let (colors, truth) = (&self.colors, self.true_mask.here());
        overlay.paint(ui, rect, &PaintedQueries { asked, settings, colors, maps, semantics, truth, lit });
    }

    /// Compares answers with a mask of the view from this pose; `None` ends the comparison.
    pub(crate) fn compare_with(&mut self, truth: Option<(Arc<Mask>, Pose)>) {
        self.true_mask.set(truth);
        self.forget_painted();
    }

    /// Sets the current pose: a true mask is true of one view only.
    pub(crate) fn stand(&mut self, pose: Pose) {
        if self.true_mask.stand(pose) {
            self.forget_painted();
        }
    }

    /// The true mask of the current view.
    pub(crate) fn truth(&self) -> Option<Arc<Mask>> {
        self.true_mask.here()
    }

    /// True if the answer of the view is compared with the true mask.
    pub(crate) fn compares(&self) -> bool {
        self.side().overlay.comparison.is_some()
    }

    /// Forces a new overlay and comparison in both views.
    fn forget_painted(&mut self) {
        self.sides.iter_mut().for_each(|side| side.overlay.forget());
    }

    /// Answers to texts, without those that are none.
    fn answers(&self, texts: &[String], semantics: &SemanticMap) -> Vec<Asked> {
        texts.iter().filter_map(|text| self.asked(text, semantics)).collect()
    }

    fn asked(&self, text: &str, semantics: &SemanticMap) -> Option<Asked> {
        Asked::new(text, semantics, &self.place, &self.side().settings, &self.embeddings)
    }

    /// Number of pixels of an identity in the current view, if its maps are drawn.
    fn area_of(&mut self, semantics: &Versioned<SemanticMap>, id: IdentityId) -> Option<usize> {
        Some(self.sides[self.active].measured(self.maps.as_ref()?, semantics, id).0)
    }

    /// Shares of the current view's width and height that an identity spans, if its maps are drawn; `Some(None)` if it
    /// has no pixel there.
    pub(super) fn span_of(&mut self, semantics: &Versioned<SemanticMap>, id: IdentityId) -> Option<Option<Vec2>> {
        Some(self.sides[self.active].measured(self.maps.as_ref()?, semantics, id).1)
    }
}

#[cfg(test)]
mod tests;
