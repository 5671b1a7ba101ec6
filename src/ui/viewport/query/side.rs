//! Queries of one of two views of the same scene: maps, embeddings and the history are common to both.

use std::collections::BTreeMap;

use egui::{Ui, Vec2, vec2};

use super::card::Facts;
use super::paint::QueryOverlay;
use super::{Asked, OverlaySettings};
use crate::jobs::query::ViewMaps;
use crate::pipeline::semantics::query::matching::MatchMode;
use crate::pipeline::semantics::query::names;
use crate::pipeline::semantics::query::parse::ParsedQuery;
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::scene::{GaussianCloud, IdentityId, SemanticMap};
use crate::worker::Versioned;

/// Number of completions.
const OFFERED: usize = 5;

/// Pause and least number of characters before "not found" is shown.
const PAUSE_SECS: f64 = 0.6;
const SHORTEST: usize = 3;

/// The queries of a view and their overlay.
#[derive(Default)]
pub(super) struct QuerySide {
    pub(super) typed: String,
    /// Window time of the last character; `None` once the query is complete.
    pub(super) typed_at: Option<f64>,
    /// Frames in which the field still takes the focus, with all of its text selected.
    pub(super) focus: u8,
    /// True if text was typed or the cursor moved since.
    pub(super) begun: bool,
    /// True if a small view shows the full answer.
    pub(super) unfolded: bool,
    /// Position in the history during recall.
    pub(super) recalled: Option<usize>,
    pub(super) settings: OverlaySettings,
    /// The query in the field; a new one replaces it.
    pub(super) live: Option<Asked>,
    /// Pinned queries.
    pub(super) pinned: Vec<Asked>,
    pub(super) overlay: QueryOverlay,
    /// Facts about the shown target.
    facts: Option<Facts>,
    /// Pixel counts of identities in the current view, filled as they are listed.
    areas: Areas,
}

/// Pixel counts of identities in a view, for one match mode.
#[derive(Default)]
struct Areas {
    /// View, objects and match that they were counted for.
    of: (u64, u64, MatchMode, u32),
    known: BTreeMap<IdentityId, (usize, Option<Vec2>)>,
}

/// All queries, each once, the one in the field last.
pub(super) fn all_of<'a>(pinned: &'a [Asked], live: Option<&'a Asked>) -> impl Iterator<Item = &'a Asked> {
    pinned.iter().filter(move |q| live.is_none_or(|live| live.text != q.text)).chain(live)
}

impl QuerySide {
    /// All queries, each once, the one in the field last.
    pub(super) fn all(&self) -> impl Iterator<Item = &Asked> {
        all_of(&self.pinned, self.live.as_ref())
    }

    /// True if this query is the one in the field.
    pub(super) fn is_live(&self, text: &str) -> bool {
        self.live.as_ref().is_some_and(|live| live.text == text)
    }

    /// Focuses the field; typed text then replaces its text.
    pub(super) fn start_typing(&mut self) {
        (self.focus, self.begun) = (2, false);
    }

    /// Shows only this hit of the query in the field, or the best ones again.
    pub(super) fn choose(&mut self, chosen: Option<IdentityId>) {
        if let (Some(id), Some(newest)) = (chosen, self.live.as_mut()) {
            newest.chosen = (newest.chosen != Some(id)).then_some(id);
        }
    }

    /// Completions of the typed text from known names.
    pub(super) fn offered(&self, semantics: &SemanticMap) -> Vec<String> {
        let typed = self.typed.trim();
        match typed.is_empty() || self.typed_at.is_none() {
            true => Vec::new(),
            false => names::completions(&semantics.identities, typed, OFFERED),
        }
    }

    /// True if "not found" may be shown: not while the user types.
    pub(super) fn is_settled(&self, ui: &Ui) -> bool {
        let Some(at) = self.typed_at else { return true };
        let wait = PAUSE_SECS - (ui.input(|i| i.time) - at);
        let is_word = self.typed.trim().chars().count() >= SHORTEST;
        if is_word && wait > 0.0 {
            ui.ctx().request_repaint_after_secs(wait as f32);
        }
        is_word && wait <= 0.0
    }

    /// Texts of the queries, for the text encoder.
    pub(super) fn texts(&self) -> impl Iterator<Item = (ParsedQuery, QueryConfig)> {
        self.all().flat_map(|q| q.reading.phrases()).map(|phrase| (phrase, self.settings.recipe.clone()))
    }

    pub(super) fn pinned_texts(&self) -> Vec<String> {
        self.pinned.iter().map(|q| q.text.clone()).collect()
    }

    /// Removes queries and answers.
    pub(super) fn cleared(self) -> Self {
        Self { settings: self.settings, ..Self::default() }
    }

    /// Facts about the target; recomputed only when it or the match has changed.
    pub(super) fn facts_of(
        &mut self,
        target: IdentityId,
        semantics: &Versioned<SemanticMap>,
        cloud: &GaussianCloud,
    ) -> Facts {
        let known = self.facts.take().filter(|facts| facts.is_of(target, semantics, &self.settings.recipe));
        let facts = known.unwrap_or_else(|| Facts::new(target, semantics, cloud, &self.settings.recipe));
        self.facts = Some(facts.clone());
        facts
    }

    /// Pixel count and span of an identity, as shares of the view's width and height, computed once per view.
    pub(super) fn measured(
        &mut self,
        maps: &Versioned<ViewMaps>,
        semantics: &Versioned<SemanticMap>,
        id: IdentityId,
    ) -> (usize, Option<Vec2>) {
        let QueryConfig { masks, tolerance, .. } = self.settings.recipe;
        let of = (maps.generation(), semantics.generation(), masks, tolerance.to_bits());
        if self.areas.of != of {
            self.areas = Areas { of, known: BTreeMap::new() };
        }
        *self.areas.known.entry(id).or_insert_with(|| {
            let mask = maps.mask(semantics, id, masks, tolerance);
            let of = vec2(mask.width_px() as f32, mask.height_px() as f32);
            let span = mask.bounds().map(|b| vec2(b.x.len() as f32, b.y.len() as f32) / of);
            (mask.area(), span)
        })
    }
}
