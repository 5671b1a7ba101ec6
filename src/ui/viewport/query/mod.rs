//! Queries of the scene: the query field, the answers, and their overlay on the frame. A query replaces the one before,
//! unless that is pinned.
//!
//! Identity maps of the view are drawn once, at rest; every query then only reads them, even during typing.

mod bar;
mod card;
pub(crate) mod closed;
mod details;
mod embeddings;
mod overlay;
mod paint;
mod panel;
mod pins;
mod recipe;
mod settings;
mod side;
mod times;
mod truth;

use std::collections::BTreeMap;

use egui::{Color32, Vec2, vec2};

use self::embeddings::Embeddings;
pub(crate) use self::overlay::{HATCH, INVENTED};
pub(crate) use self::settings::OverlaySettings;
use self::side::{Areas, QuerySide};
use crate::jobs::phrases::colors::PhraseColors;
use crate::jobs::query::{ViewMaps, answer_encoded};
use crate::navigate::Pose;
use crate::pipeline::semantics::answer::QueryAnswer;
use crate::pipeline::semantics::matching::MatchMode;
use crate::pipeline::semantics::names;
use crate::pipeline::semantics::reading::QueryReading;
use crate::pipeline::semantics::recipe::Recipe;
use crate::scene::{IdentityId, Mask, ScenePlan, SemanticMap};
use crate::ui::color_by::ColorBy;
use crate::worker::Versioned;

/// A query with its answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Asked {
    /// The text as typed.
    pub(crate) text: String,
    /// Answer to the query.
    pub answered: QueryAnswer,
    /// True if the text encoder has yet to read it: only names have been searched so far.
    pub pending: bool,
    /// Hit chosen by the user; otherwise the best are shown.
    chosen: Option<IdentityId>,
    /// Interpretation of the text.
    reading: QueryReading,
    /// Unknown words that prevented an answer.
    unexplained: Vec<String>,
    /// Words that the answer ignores.
    ignored: Vec<String>,
}

impl Asked {
    /// The identities that are shown.
    pub(crate) fn shown(&self, settings: &OverlaySettings) -> Vec<IdentityId> {
        self.chosen.map_or_else(|| self.answered.chosen(settings.top), |id| vec![id])
    }
}

/// The queries on screen.
#[derive(Default)]
pub struct Queries {
    /// Queries of the active view, and of the other one.
    side: QuerySide,
    other: QuerySide,
    /// True if the second of two views is active.
    is_second: bool,
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
    /// True mask to compare answers with, and the current camera pose.
    truth: Option<truth::ViewTruth>,
    eye: Option<Pose>,
}

impl Queries {
    /// All queries, the one in the field last.
    pub fn all(&self) -> impl Iterator<Item = &Asked> {
        self.side.all()
    }

    /// Shows only this hit of the query in the field, or the best ones again.
    fn choose(&mut self, chosen: Option<IdentityId>) {
        if let (Some(id), Some(newest)) = (chosen, self.side.live.as_mut()) {
            newest.chosen = (newest.chosen != Some(id)).then_some(id);
        }
    }

    /// The identities found on screen.
    pub fn found(&self) -> Vec<IdentityId> {
        self.all().flat_map(|asked| asked.shown(&self.side.settings)).collect()
    }

    /// The found identities with the colors of their queries.
    pub(super) fn found_colors(&self) -> Vec<(IdentityId, Color32)> {
        let colored = |q: &Asked| {
            let [r, g, b] = self.colors.of(&q.text);
            q.shown(&self.side.settings).into_iter().map(move |id| (id, Color32::from_rgb(r, g, b)))
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
        self.sides().iter().any(|side| needs(&side.settings))
    }

    /// Focuses the query field.
    pub(crate) fn start_typing(&mut self) {
        self.wanted = true;
        self.side.start_typing();
    }

    /// Answers again if objects, parts or embeddings have changed.
    pub(crate) fn keep_up(&mut self, ctx: &egui::Context, semantics: &Versioned<SemanticMap>, plan: &ScenePlan) {
        let encoder = semantics.language.as_ref().map(|l| l.encoder.as_str());
        let now = semantics.generation();
        // An encoder no longer in use is dropped at once; a new one is loaded at the first query.
        let texts = self.sides().into_iter().flat_map(QuerySide::texts).collect();
        let encoded =
            (encoder.is_none() || plan.encoder.now(self.wanted)) && self.embeddings.keep_up(ctx, encoder, texts);
        if encoded || self.answered_for != now {
            self.answered_for = now;
            self.ask_again(semantics);
        }
    }

    /// Runs a query as if its text had been typed.
    pub(crate) fn ask(&mut self, text: &str, semantics: &SemanticMap) {
        (self.side.typed, self.side.typed_at) = (text.to_owned(), None);
        self.wanted = true;
        self.side.live = self.asked(text, semantics);
        self.keep_color();
    }

    /// Fixes the color of the query in the field, if it has an answer.
    fn keep_color(&mut self) {
        if let Some(live) = self.side.live.as_ref().filter(|q| !q.shown(&self.side.settings).is_empty()) {
            self.colors.keep(&live.text);
        }
    }

    /// Shows the answers to these queries only.
    pub(crate) fn mark(&mut self, texts: &[String], semantics: &SemanticMap) {
        self.colors.keep_all(texts);
        let (last, others) = texts.split_last().map_or(("", texts), |(last, others)| (last, others));
        self.side.pinned = others.iter().filter_map(|text| self.asked(text, semantics)).collect();
        self.ask(last, semantics);
    }

    /// Answers all queries again, as identities have changed.
    pub(crate) fn ask_again(&mut self, semantics: &SemanticMap) {
        for second in [false, true] {
            self.in_view(second, |all| {
                let pinned = std::mem::take(&mut all.side.pinned);
                all.side.pinned = pinned.iter().filter_map(|q| all.asked(&q.text, semantics)).collect();
                all.side.live = all.side.live.take().and_then(|q| all.asked(&q.text, semantics));
            });
        }
    }

    /// Clears queries and answers for another scene.
    pub(crate) fn clear(&mut self) {
        let before = std::mem::take(self);
        let (side, other) = (before.side.cleared(), before.other.cleared());
        let Self { is_second, history, colors, embeddings, .. } = before;
        *self = Self { side, other, is_second, history, colors, embeddings, ..Self::default() };
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
        self.side.settings.color_by = if self.side.settings.color_by == by { ColorBy::Masks } else { by };
        self.wanted = true;
    }

    /// Display settings of the answers.
    pub(super) fn settings(&mut self) -> &mut OverlaySettings {
        &mut self.side.settings
    }

    /// True if an overlay from identity maps is drawn over the frame.
    pub(super) fn tints(&self) -> bool {
        self.sides().iter().any(|side| side.painted.is_some())
    }

    fn asked(&self, text: &str, semantics: &SemanticMap) -> Option<Asked> {
        let text = text.trim();
        let reading =
            QueryReading::new(&semantics.identities, text, self.side.settings.kind, &self.side.settings.recipe)?;
        let phrase = &reading.phrase;
        let encoded = self.embeddings.of(phrase);
        let OverlaySettings { kind, recipe, .. } = &self.side.settings;
        let unread = encoded.map(|t| t.unknown.as_slice()).unwrap_or_default();
        let phrases = self.embeddings.phrases(phrase).map(|phrases| (phrases, unread));
        let mut answered = answer_encoded(semantics, &reading, *kind, recipe, phrases);
        answered.stages.encode = encoded.map_or(0.0, |t| t.encode_ms);
        let to_encoder = encoded.map(|t| t.unknown.as_slice());
        let unknown = names::unknown_to_all(&semantics.identities, &phrase.text, to_encoder);
        let ignored = answered.ignored_words(&semantics.identities, &reading, &unknown);
        let unexplained = answered.unexplained(&semantics.identities, &reading, &unknown);
        let pending = semantics.language.is_some() && self.embeddings.is_pending(phrase);
        Some(Asked { text: text.to_owned(), answered, pending, chosen: None, reading, unexplained, ignored })
    }

    /// Mask of the target in the current view.
    fn mask_of(&self, maps: &ViewMaps, semantics: &SemanticMap, target: IdentityId) -> Mask {
        let Recipe { masks, tolerance, .. } = self.side.settings.recipe;
        maps.mask(semantics, target, masks, tolerance)
    }

    /// Number of pixels of an identity in the current view, if its maps are drawn.
    fn area_of(&mut self, semantics: &Versioned<SemanticMap>, id: IdentityId) -> Option<usize> {
        Some(self.measured(semantics, id)?.0)
    }

    /// Shares of the current view's width and height that an identity spans, if its maps are drawn; `Some(None)` if it
    /// has no pixel there.
    pub(super) fn span_of(&mut self, semantics: &Versioned<SemanticMap>, id: IdentityId) -> Option<Option<Vec2>> {
        Some(self.measured(semantics, id)?.1)
    }

    /// Pixel count and span of an identity, computed once per view.
    fn measured(&mut self, semantics: &Versioned<SemanticMap>, id: IdentityId) -> Option<(usize, Option<Vec2>)> {
        let maps = self.maps.clone()?;
        let Recipe { masks, tolerance, .. } = self.side.settings.recipe;
        let of = (maps.generation(), semantics.generation(), masks, tolerance.to_bits());
        if self.side.areas.of != of {
            self.side.areas = Areas { of, known: BTreeMap::new() };
        }
        if let Some(known) = self.side.areas.known.get(&id) {
            return Some(*known);
        }
        let mask = self.mask_of(&maps, semantics, id);
        let of = vec2(mask.width_px() as f32, mask.height_px() as f32);
        let span = mask.bounds().map(|b| vec2(b.x.len() as f32, b.y.len() as f32) / of);
        self.side.areas.known.insert(id, (mask.area(), span));
        Some((mask.area(), span))
    }
}

#[cfg(test)]
mod tests;
