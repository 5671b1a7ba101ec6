//! Queries of one of two views of the same scene: maps, embeddings and the history are common to both.

use std::collections::BTreeMap;

use egui::{TextureHandle, Vec2};

use super::paint::Painted;
use super::{Asked, OverlaySettings, Queries, card, truth};
use crate::pipeline::semantics::matching::MatchMode;
use crate::pipeline::semantics::parse::ParsedQuery;
use crate::pipeline::semantics::recipe::Recipe;
use crate::pipeline::semantics::timing::StagesMs;
use crate::scene::IdentityId;

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
    /// Relevancy of the pixels, for the histogram.
    pub(super) heat: Vec<f32>,
    pub(super) texture: Option<TextureHandle>,
    pub(super) painted: Option<Painted>,
    /// Comparison with the true mask.
    pub(super) comparison: Option<truth::TruthComparison>,
    /// Facts about the shown target.
    pub(super) facts: Option<card::Facts>,
    /// Pixel counts of identities in the current view, filled as they are listed.
    pub(super) areas: Areas,
    /// Times of localization and drawing, of all queries on screen.
    pub(super) paint_ms: StagesMs,
}

/// Pixel counts of identities in a view, for one match mode.
#[derive(Default)]
pub(super) struct Areas {
    /// View, objects and match that they were counted for.
    pub(super) of: (u64, u64, MatchMode, u32),
    pub(super) known: BTreeMap<IdentityId, (usize, Option<Vec2>)>,
}

impl QuerySide {
    /// All queries, each once, the one in the field last.
    pub(super) fn all(&self) -> impl Iterator<Item = &Asked> {
        self.pinned.iter().filter(|q| !self.is_live(&q.text)).chain(&self.live)
    }

    /// True if this query is the one in the field.
    pub(super) fn is_live(&self, text: &str) -> bool {
        self.live.as_ref().is_some_and(|live| live.text == text)
    }

    /// Focuses the field; typed text then replaces its text.
    pub(super) fn start_typing(&mut self) {
        (self.focus, self.begun) = (2, false);
    }

    /// Texts of the queries, for the text encoder.
    pub(super) fn texts(&self) -> impl Iterator<Item = (ParsedQuery, Recipe)> {
        self.all().map(|q| (q.reading.phrase.clone(), self.settings.recipe.clone()))
    }

    /// Removes queries and answers.
    pub(super) fn cleared(self) -> Self {
        Self { settings: self.settings, ..Self::default() }
    }

    fn pinned_texts(&self) -> Vec<String> {
        self.pinned.iter().map(|q| q.text.clone()).collect()
    }
}

impl Queries {
    /// The queries of the active view, and of the other one.
    pub(super) fn sides(&self) -> [&QuerySide; 2] {
        [&self.side, &self.other]
    }

    /// True if the second of two views is active, which gets new queries.
    pub fn is_second(&self) -> bool {
        self.is_second
    }

    /// Makes the first or the second of two views active.
    pub(crate) fn work_in(&mut self, second: bool) {
        if self.is_second != second {
            std::mem::swap(&mut self.side, &mut self.other);
            self.is_second = second;
        }
    }

    /// Runs `act` with the first or the second of two views active.
    pub fn in_view<R>(&mut self, second: bool, act: impl FnOnce(&mut Self) -> R) -> R {
        let before = self.is_second;
        self.work_in(second);
        let result = act(self);
        self.work_in(before);
        result
    }

    /// Values of the first and of the second view.
    pub(super) fn in_order<T>(&self, of: impl Fn(&QuerySide) -> T) -> [T; 2] {
        let [side, other] = self.sides().map(of);
        if self.is_second { [other, side] } else { [side, other] }
    }

    /// The queries that are pinned in the first and the second view.
    pub(crate) fn pinned_texts(&self) -> [Vec<String>; 2] {
        self.in_order(QuerySide::pinned_texts)
    }

    /// Forces a new overlay and comparison in both views.
    pub(super) fn forget_painted(&mut self) {
        for side in [&mut self.side, &mut self.other] {
            (side.painted, side.comparison) = (None, None);
        }
    }
}
