//! Queries asked of the scene: the field to type them into, their answers, and what they draw over
//! the frame. A query takes the place of the one before, unless that is pinned.
//!
//! What the view's pixels belong to is drawn once, when the eye rests; every query then only
//! reads it, while it is still being typed.

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
    /// As it was typed.
    pub(crate) text: String,
    /// What it comes to.
    pub answered: QueryAnswer,
    /// Whether the text encoder has yet to read it: names alone have answered so far.
    pub pending: bool,
    /// A hit that was chosen among the others; else the best are shown.
    chosen: Option<IdentityId>,
    /// How it was read.
    reading: QueryReading,
    /// Words for want of which nothing was found.
    unexplained: Vec<String>,
    /// Words that the answer does not rest on.
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
    /// Of the view that is worked in, and of the other one.
    side: QuerySide,
    other: QuerySide,
    /// Whether the second of two views is the one that is worked in.
    is_second: bool,
    /// Whether anything was asked in this scene, or begun to be.
    wanted: bool,
    /// What was asked, oldest first.
    history: Vec<String>,
    colors: PhraseColors,
    maps: Option<Versioned<ViewMaps>>,
    /// The same while the eye moves, at the resolution of the frame.
    moving: Option<Versioned<ViewMaps>>,
    /// Generation of the objects and parts that were asked.
    answered_for: u64,
    /// Embeddings of the texts on screen.
    embeddings: Embeddings,
    /// Why there are none, once that was reported.
    reported: Option<String>,
    /// What answers are compared with, and where the eye is.
    truth: Option<truth::ViewTruth>,
    eye: Option<Pose>,
}

impl Queries {
    /// All queries, the one in the field last.
    pub fn all(&self) -> impl Iterator<Item = &Asked> {
        self.side.all()
    }

    /// Shows this hit of the query in the field alone, or the best again.
    fn choose(&mut self, chosen: Option<IdentityId>) {
        if let (Some(id), Some(newest)) = (chosen, self.side.live.as_mut()) {
            newest.chosen = (newest.chosen != Some(id)).then_some(id);
        }
    }

    /// The identities that are found on screen.
    pub fn found(&self) -> Vec<IdentityId> {
        self.all().flat_map(|asked| asked.shown(&self.side.settings)).collect()
    }

    /// The same with the colors of their queries.
    pub(super) fn found_colors(&self) -> Vec<(IdentityId, Color32)> {
        let colored = |q: &Asked| {
            let [r, g, b] = self.colors.of(&q.text);
            q.shown(&self.side.settings).into_iter().map(move |id| (id, Color32::from_rgb(r, g, b)))
        };
        self.all().flat_map(colored).collect()
    }

    /// What the present view's pixels belong to, once that is drawn.
    pub fn maps(&self) -> Option<&Versioned<ViewMaps>> {
        self.maps.as_ref()
    }

    /// Whether anything was asked in this scene, or begun to be: what queries need is needed now.
    pub(crate) fn wanted(&self) -> bool {
        self.wanted
    }

    /// Whether blended codes of the view are wanted.
    pub(crate) fn wants_codes(&self) -> bool {
        let needs = |s: &OverlaySettings| s.recipe.masks == MatchMode::Codes || s.color_by == ColorBy::Difference;
        self.sides().iter().any(|side| needs(&side.settings))
    }

    /// Puts the cursor into the field.
    pub(crate) fn start_typing(&mut self) {
        self.wanted = true;
        self.side.start_typing();
    }

    /// Answers anew where objects and parts, or embeddings, have changed.
    pub(crate) fn keep_up(&mut self, ctx: &egui::Context, semantics: &Versioned<SemanticMap>, plan: &ScenePlan) {
        let encoder = semantics.language.as_ref().map(|l| l.encoder.as_str());
        let now = semantics.generation();
        // One that is of no more use goes at once, one that is new waits for a query.
        let texts = self.sides().into_iter().flat_map(QuerySide::texts).collect();
        let encoded =
            (encoder.is_none() || plan.encoder.now(self.wanted)) && self.embeddings.keep_up(ctx, encoder, texts);
        if encoded || self.answered_for != now {
            self.answered_for = now;
            self.ask_again(semantics);
        }
    }

    /// Asks as if it had been typed.
    pub(crate) fn ask(&mut self, text: &str, semantics: &SemanticMap) {
        (self.side.typed, self.side.typed_at) = (text.to_owned(), None);
        self.wanted = true;
        self.side.live = self.asked(text, semantics);
        self.keep_color();
    }

    /// Gives the query in the field its color for good, if anything has it.
    fn keep_color(&mut self) {
        if let Some(live) = self.side.live.as_ref().filter(|q| !q.shown(&self.side.settings).is_empty()) {
            self.colors.keep(&live.text);
        }
    }

    /// Shows the answers to these queries, and no others.
    pub(crate) fn mark(&mut self, texts: &[String], semantics: &SemanticMap) {
        self.colors.keep_all(texts);
        let (last, others) = texts.split_last().map_or(("", texts), |(last, others)| (last, others));
        self.side.pinned = others.iter().filter_map(|text| self.asked(text, semantics)).collect();
        self.ask(last, semantics);
    }

    /// Answers all queries anew: identities have changed.
    pub(crate) fn ask_again(&mut self, semantics: &SemanticMap) {
        for second in [false, true] {
            self.in_view(second, |all| {
                let pinned = std::mem::take(&mut all.side.pinned);
                all.side.pinned = pinned.iter().filter_map(|q| all.asked(&q.text, semantics)).collect();
                all.side.live = all.side.live.take().and_then(|q| all.asked(&q.text, semantics));
            });
        }
    }

    /// Forgets queries and answers: another scene.
    pub(crate) fn clear(&mut self) {
        let before = std::mem::take(self);
        let (side, other) = (before.side.cleared(), before.other.cleared());
        let Self { is_second, history, colors, embeddings, .. } = before;
        *self = Self { side, other, is_second, history, colors, embeddings, ..Self::default() };
    }

    /// Why only names are understood, once for each reason.
    pub(crate) fn newly_failed(&mut self) -> Option<String> {
        let why = self.embeddings.problem()?.to_owned();
        (self.reported.replace(why.clone()).as_ref() != Some(&why)).then_some(why)
    }

    /// Takes over what the present view's pixels belong to, exactly or as the eye moves.
    pub(crate) fn set_maps(&mut self, maps: Versioned<ViewMaps>, exact: bool) {
        (self.maps, self.moving) = if exact { (Some(maps), None) } else { (None, Some(maps)) };
    }

    /// What the pixels belong to is not known any more. What was drawn stays on screen until it is, if only the
    /// eye has moved.
    pub(crate) fn forget_maps(&mut self, only_moved: bool) {
        let before = self.maps.take().or(self.moving.take());
        self.moving = before.filter(|_| only_moved);
    }

    /// What is on screen of it: exact, or of the newest frame of a moving view.
    pub fn shown_maps(&self) -> Option<&Versioned<ViewMaps>> {
        self.maps.as_ref().or(self.moving.as_ref())
    }

    /// Colors the view by this; by nothing but masks if it is colored so.
    pub(crate) fn tint(&mut self, by: ColorBy) {
        self.side.settings.color_by = if self.side.settings.color_by == by { ColorBy::Masks } else { by };
        self.wanted = true;
    }

    /// How answers are drawn.
    pub(super) fn settings(&mut self) -> &mut OverlaySettings {
        &mut self.side.settings
    }

    /// Whether anything is drawn over the frame that depends on what its pixels belong to.
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

    /// The target's pixels in the present view.
    fn mask_of(&self, maps: &ViewMaps, semantics: &SemanticMap, target: IdentityId) -> Mask {
        let Recipe { masks, tolerance, .. } = self.side.settings.recipe;
        maps.mask(semantics, target, masks, tolerance)
    }

    /// Pixels of an identity in the present view, if that is drawn.
    fn area_of(&mut self, semantics: &Versioned<SemanticMap>, id: IdentityId) -> Option<usize> {
        Some(self.measured(semantics, id)?.0)
    }

    /// Shares of the present view's width and height that an identity spans, if that is drawn; `Some(None)` if it
    /// has no pixel there.
    pub(super) fn span_of(&mut self, semantics: &Versioned<SemanticMap>, id: IdentityId) -> Option<Option<Vec2>> {
        Some(self.measured(semantics, id)?.1)
    }

    /// Both, found once for a view.
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
