//! What is asked in one of two views of the same scene: maps, embeddings and the history are common to both.

use std::collections::BTreeMap;

use egui::{TextureHandle, Vec2};

use super::paint::Painted;
use super::{Asked, OverlaySettings, Queries, card, truth};
use crate::pipeline::semantics::matching::MatchMode;
use crate::pipeline::semantics::parse::ParsedQuery;
use crate::pipeline::semantics::recipe::Recipe;
use crate::pipeline::semantics::timing::StagesMs;
use crate::scene::IdentityId;

/// The queries of a view and what they draw.
#[derive(Default)]
pub(super) struct QuerySide {
    pub(super) typed: String,
    /// Window time of the last letter, until Enter says that it was the last.
    pub(super) typed_at: Option<f64>,
    /// Frames in which the field is yet to take the keyboard, with all of its text selected.
    pub(super) focus: u8,
    /// Whether anything was typed since, or the cursor moved.
    pub(super) begun: bool,
    /// Whether a small view shows the answer in full, too.
    pub(super) unfolded: bool,
    /// Place in the history while going through it.
    pub(super) recalled: Option<usize>,
    pub(super) settings: OverlaySettings,
    /// The query in the field: it takes the place of the one before.
    pub(super) live: Option<Asked>,
    /// Those that were pinned, which stay.
    pub(super) pinned: Vec<Asked>,
    /// Relevancy of the pixels, for the histogram.
    pub(super) heat: Vec<f32>,
    pub(super) texture: Option<TextureHandle>,
    pub(super) painted: Option<Painted>,
    /// What comparing with the true mask came to.
    pub(super) comparison: Option<truth::TruthComparison>,
    /// Of the target that is shown.
    pub(super) facts: Option<card::Facts>,
    /// Pixels of identities in the present view, counted as they are listed.
    pub(super) areas: Areas,
    /// What finding the pixels and drawing them took, of all queries on screen.
    pub(super) paint_ms: StagesMs,
}

/// Pixels of identities in a view, for one way of matching.
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

    /// Whether this query is the one in the field.
    pub(super) fn is_live(&self, text: &str) -> bool {
        self.live.as_ref().is_some_and(|live| live.text == text)
    }

    /// Puts the keyboard into the field, and what is typed next in place of its text.
    pub(super) fn start_typing(&mut self) {
        (self.focus, self.begun) = (2, false);
    }

    /// What is asked, for the text encoder.
    pub(super) fn texts(&self) -> impl Iterator<Item = (ParsedQuery, Recipe)> {
        self.all().map(|q| (q.reading.phrase.clone(), self.settings.recipe.clone()))
    }

    /// Without queries and answers.
    pub(super) fn cleared(self) -> Self {
        Self { settings: self.settings, ..Self::default() }
    }

    fn pinned_texts(&self) -> Vec<String> {
        self.pinned.iter().map(|q| q.text.clone()).collect()
    }
}

impl Queries {
    /// The queries of the view that is worked in, and of the other one.
    pub(super) fn sides(&self) -> [&QuerySide; 2] {
        [&self.side, &self.other]
    }

    /// Whether the second of two views is the one that is worked in: what is asked, is asked there.
    pub fn is_second(&self) -> bool {
        self.is_second
    }

    /// Works in the first or the second of two views from now on.
    pub(crate) fn work_in(&mut self, second: bool) {
        if self.is_second != second {
            std::mem::swap(&mut self.side, &mut self.other);
            self.is_second = second;
        }
    }

    /// Does something in the first or the second of two views.
    pub fn in_view<R>(&mut self, second: bool, act: impl FnOnce(&mut Self) -> R) -> R {
        let before = self.is_second;
        self.work_in(second);
        let result = act(self);
        self.work_in(before);
        result
    }

    /// Something of the first and of the second view.
    pub(super) fn in_order<T>(&self, of: impl Fn(&QuerySide) -> T) -> [T; 2] {
        let [side, other] = self.sides().map(of);
        if self.is_second { [other, side] } else { [side, other] }
    }

    /// The queries that are pinned in the first and the second view.
    pub(crate) fn pinned_texts(&self) -> [Vec<String>; 2] {
        self.in_order(QuerySide::pinned_texts)
    }

    /// Paints anew and compares anew, in both views.
    pub(super) fn forget_painted(&mut self) {
        for side in [&mut self.side, &mut self.other] {
            (side.painted, side.comparison) = (None, None);
        }
    }
}
