//! State of an evaluation: the scene, the steps so far, and what the sentence depends on.

use std::ops::Range;

use super::outcome::{Matches, QueryStep, Unmet, Why};
use super::relations::{HOLDS, Space};
use super::{Looks, QueryScene};
use crate::scene::{IdentityId, LevelFilter};

pub(super) type Outcome = Result<Matches, Unmet>;

/// Evaluator of the readings of one text.
pub(super) struct Evaluator<'a> {
    pub(super) scene: &'a QueryScene<'a>,
    pub(super) space: Option<&'a Space<'a>>,
    pub(super) text: &'a str,
    pub(super) looks: Option<&'a mut dyn Looks>,
    pub(super) steps: Vec<QueryStep>,
    /// Number of conditions that removed nothing.
    pub(super) idle: usize,
    /// True if a comparison or a color that is said of another thing than the one asked for removed nothing.
    pub(super) idle_inside: bool,
    /// True if a comparison or a color that is said of the thing asked for removed all.
    pub(super) failed: bool,
    /// True once the view decided.
    pub(super) of_view: bool,
    /// Remarks on the way, such as "a kettle is a kind of pot".
    pub(super) notes: Vec<String>,
    /// True once a match came from the encoder.
    pub(super) looked: bool,
    /// Thing that "one" stands for in a part of a sentence.
    pub(super) antecedent: Option<String>,
    /// Number of expressions around the one that is evaluated.
    pub(super) depth: usize,
    /// True where the level that is asked for does not matter: in anchors and wholes.
    any_level: bool,
    /// True if "things" may be what most others stand on.
    pub(super) with_stages: bool,
}

impl<'a> Evaluator<'a> {
    pub(super) fn new(
        scene: &'a QueryScene<'a>,
        space: Option<&'a Space<'a>>,
        text: &'a str,
        looks: Option<&'a mut dyn Looks>,
    ) -> Self {
        let (steps, notes, looked, antecedent, depth, any_level) = (Vec::new(), Vec::new(), false, None, 0, false);
        let (with_stages, idle, idle_inside, failed, of_view) = (false, 0, false, false, false);
        Self {
            scene,
            space,
            text,
            looks,
            steps,
            notes,
            looked,
            antecedent,
            depth,
            any_level,
            with_stages,
            idle,
            idle_inside,
            failed,
            of_view,
        }
    }

    /// Text of some bytes.
    pub(super) fn said(&self, at: &Range<usize>) -> &'a str {
        self.text.get(at.clone()).unwrap_or_default()
    }

    pub(super) fn unmet(&self, why: Why, text: impl Into<String>, at: &Range<usize>) -> Unmet {
        Unmet { why, text: text.into(), words: Vec::new(), near: Vec::new(), at: at.clone() }
    }

    /// Shapes and view, which relations and orders need.
    pub(super) fn space(&self, at: &Range<usize>) -> Result<&'a Space<'a>, Unmet> {
        let known = self.space.filter(|s| s.shapes.are_known());
        known.ok_or_else(|| self.unmet(Why::NotUnderstood, "Nothing is known here of where things are.", at))
    }

    /// Records a step.
    pub(super) fn step(&mut self, at: &Range<usize>, text: impl Into<String>, found: &Matches) {
        let left = found.settled();
        let guess = left.iter().any(|m| m.sure < HOLDS[0]);
        let (at, text, depth) = (at.clone(), text.into(), self.depth);
        self.steps.push(QueryStep { at, text, left: left.len(), guess, depth, is_noun: false });
    }

    /// Records the step of a noun.
    pub(super) fn noun_step(&mut self, at: &Range<usize>, text: impl Into<String>, found: &Matches) {
        self.step(at, text, found);
        self.steps.iter_mut().next_back().into_iter().for_each(|step| step.is_noun = true);
    }

    /// Evaluates within an expression: its steps stand deeper.
    pub(super) fn inner<T>(&mut self, run: impl FnOnce(&mut Self) -> T) -> T {
        self.depth += 1;
        let result = run(self);
        self.depth -= 1;
        result
    }

    /// Evaluates without regard to the level that is asked for.
    pub(super) fn of_any_level<T>(&mut self, run: impl FnOnce(&mut Self) -> T) -> T {
        let before = std::mem::replace(&mut self.any_level, true);
        let result = run(self);
        self.any_level = before;
        result
    }

    /// Returns whether identities of a level may be matched here.
    pub(super) fn accepts(&self, id: IdentityId) -> bool {
        let level = if self.any_level { LevelFilter::Auto } else { self.scene.level };
        self.scene.identities.get(id).is_some_and(|i| level.accepts(i.level)) && self.scene.is_there(id)
    }

    /// Remark on a step that depends on the view.
    pub(super) fn seen_from_here(&mut self, by_view: bool) -> &'static str {
        self.of_view |= by_view;
        if by_view { ", seen from here" } else { "" }
    }
}
