//! The undo history of the window: changes of objects, of the view and of the camera path, by the user and by the
//! agent, are undone and redone in the order in which they were made.
//!
//! No code reports a change. The window's state is compared with the last snapshot whenever it is at rest, so a drag or
//! a name that is typed is one change.

pub(super) mod texts;

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

use self::texts::described;
use crate::agent::scene::UndoneRequest;
use crate::jobs::edit::EditRequest;
use crate::jobs::rearrange::SplatEdit;
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::scene::measurement::Measurement;
use crate::scene::undo::UndoHistory;
use crate::scene::{CameraPath, CropBox, GaussianCloud, IdentityId, SemanticMap};
use crate::worker::ViewMode;

/// Largest memory for Gaussians of earlier states, bytes.
const MOST_BYTES: u64 = 1 << 30;

/// State of the view that can be undone, beside objects and parts.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ViewState {
    /// Identities whose own Gaussians are hidden.
    pub(crate) hidden: BTreeSet<IdentityId>,
    pub(crate) crop: Option<CropBox>,
    /// Modes of the first and the second view, and whether there are two.
    pub(crate) modes: [ViewMode; 2],
    pub(crate) split: bool,
    pub(crate) dim: bool,
    pub(crate) cameras: bool,
    pub(crate) path: CameraPath,
    pub(crate) measurements: Vec<Measurement>,
    /// Pinned queries in the first and the second view.
    pub(crate) pinned: [Vec<String>; 2],
    /// Recipes of the queries in both views.
    pub(crate) recipes: [QueryConfig; 2],
}

/// All state that can be undone.
#[derive(Clone, Debug)]
pub(crate) struct EditSnapshot {
    /// Number of the scene; changes of another scene are forgotten.
    pub(crate) scene: u64,
    pub(crate) folder: PathBuf,
    pub(crate) map: Option<Arc<SemanticMap>>,
    /// The Gaussians, if they are a result.
    pub(crate) cloud: Option<Arc<GaussianCloud>>,
    pub(crate) view: ViewState,
}

/// A change: its description, and the state on its other side.
#[derive(Clone, Debug)]
struct Change {
    what: String,
    other: EditSnapshot,
    /// Number of the sentence of the chat that made it, if one did: all that it makes is one change.
    sentence: Option<u64>,
}

/// The changes so far, and the current state.
#[derive(Clone, Debug, Default)]
pub(crate) struct ChangeHistory {
    changes: UndoHistory<Change>,
    now: Option<EditSnapshot>,
}

impl EditSnapshot {
    /// True if the other has other objects and parts, or other Gaussians.
    fn is_edited(&self, other: &Self) -> bool {
        !is_same(&self.map, &other.map) || !is_same(&self.cloud, &other.cloud)
    }

    /// True if an identity has this name.
    pub(crate) fn is_called(&self, id: IdentityId, name: &str) -> bool {
        let identity = self.map.as_ref().and_then(|map| map.identities.get(id));
        identity.is_some_and(|i| i.names.first().map_or("", |n| n) == name)
    }
}

impl ChangeHistory {
    /// The state at the last snapshot.
    pub(crate) fn now(&self) -> Option<&EditSnapshot> {
        self.now.as_ref()
    }

    /// True if objects, parts and Gaussians equal those of the last snapshot.
    pub(crate) fn has(&self, other: &EditSnapshot) -> bool {
        self.now.as_ref().is_some_and(|now| !now.is_edited(other))
    }

    /// Records the current state. `edit` describes a change of objects, parts and Gaussians; if they changed without
    /// it, the history is cleared. Returns the description of the change.
    pub(crate) fn settle(&mut self, now: &EditSnapshot, edit: Option<&str>) -> Option<String> {
        self.settle_as(now, edit, None)
    }

    /// Records the current state, which the chat's `sentence` of this number led to: one sentence is one change.
    pub(crate) fn settle_as(
        &mut self,
        now: &EditSnapshot,
        edit: Option<&str>,
        sentence: Option<u64>,
    ) -> Option<String> {
        let before = self.now.as_ref().filter(|before| before.scene == now.scene);
        let is_edited = before.is_some_and(|before| before.is_edited(now));
        let Some(before) = before.filter(|_| !is_edited || edit.is_some()) else {
            *self = Self { now: Some(now.clone()), ..Self::default() };
            return None;
        };
        if !is_edited && before.view == now.view {
            return None;
        }
        let what = match edit.filter(|_| is_edited) {
            Some(edit) => edit.to_owned(),
            None => described(&before.view, &now.view, now.map.as_ref().map(|map| &map.identities)),
        };
        let goes_on = sentence.is_some() && self.changes.last().is_some_and(|last| last.sentence == sentence);
        let begun = if goes_on { self.changes.take() } else { None };
        let other = self.now.replace(now.clone());
        let (what, other) = match begun {
            Some(begun) if !begun.other.is_edited(now) => {
                if begun.other.view == now.view {
                    return None;
                }
                let identities = now.map.as_ref().map(|map| &map.identities);
                (described(&begun.other.view, &now.view, identities), Some(begun.other))
            }
            Some(begun) => (format!("{}, {what}", begun.what), Some(begun.other)),
            None => (what, other),
        };
        if let Some(other) = other {
            self.changes.record(Change { what: what.clone(), other, sentence });
            self.forget_the_farthest();
        }
        Some(what)
    }

    /// Forgets the oldest changes if the Gaussians of their states take too much memory.
    fn forget_the_farthest(&mut self) {
        let (mut last, mut bytes) = (self.now.as_ref().and_then(|now| now.cloud.clone()), 0);
        self.changes.keep_newest_while(|change| {
            if !is_same(&change.other.cloud, &last) {
                last.clone_from(&change.other.cloud);
                bytes += last.as_ref().map_or(0, |cloud| cloud.bytes());
            }
            bytes <= MOST_BYTES
        });
    }

    /// Description of the change that undo reverts.
    pub(crate) fn last(&self) -> Option<&str> {
        self.changes.last().map(|c| c.what.as_str())
    }

    /// Description of the change that redo repeats.
    pub(crate) fn next(&self) -> Option<&str> {
        self.changes.next().map(|c| c.what.as_str())
    }

    /// The state that undoing would lead to.
    pub(crate) fn before(&self) -> Option<&EditSnapshot> {
        self.changes.last().map(|c| &c.other)
    }

    /// Goes back or forth by one change; returns its description and the state to restore.
    pub(crate) fn go(&mut self, redo: bool) -> Option<(String, EditSnapshot)> {
        let what = if redo { self.next() } else { self.last() }?.to_owned();
        // What was undone and redone is complete: nothing is added to it.
        let mut change = Change { what: what.clone(), other: self.now.clone()?, sentence: None };
        if redo {
            self.changes.redo(&mut change)
        } else {
            self.changes.undo(&mut change)
        };
        self.now = Some(change.other.clone());
        Some((what, change.other))
    }
}

fn is_same<T>(a: &Option<Arc<T>>, b: &Option<Arc<T>>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => Arc::ptr_eq(a, b),
        (a, b) => a.is_none() && b.is_none(),
    }
}

/// An edit that waits for those before it.
pub(super) enum EditStep {
    Request(EditRequest),
    /// An edit by the chat's sentence of this number.
    Said(EditRequest, u64),
    Rearrange(SplatEdit),
    Undo,
    Redo,
    /// The agent undid the changes of a sentence.
    UndoSentence(UndoneRequest),
}

/// A running change of objects and parts.
pub(super) struct Editing {
    /// Description; `None` if it restores an earlier or later state.
    pub(super) what: Option<String>,
    /// True if it is a redo.
    pub(super) redo: bool,
    /// Number of the chat's sentence that asked for it.
    pub(super) sentence: Option<u64>,
}

/// A running search of objects and parts that becomes a step of the history.
pub(super) struct FoundStep {
    /// Description.
    pub(super) what: String,
    /// True if it adds to the existing objects.
    pub(super) adds: bool,
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};

    use super::*;
    use crate::scene::{Identities, Level, NO_IDENTITY, PathKey};

    fn lamp() -> Arc<SemanticMap> {
        let mut identities = Identities::default();
        let lamp = identities.add(Level::Object, NO_IDENTITY, vec!["lamp".into()]);
        identities.add(Level::Part, lamp, vec!["shade".into()]);
        identities.add(Level::Object, NO_IDENTITY, vec!["table".into()]);
        Arc::new(SemanticMap { identities, ..SemanticMap::default() })
    }

    fn start() -> (ChangeHistory, EditSnapshot) {
        let path = CameraPath { keys: Vec::new(), closed: false, fps: 30.0, seconds: 5.0 };
        let view = ViewState {
            hidden: BTreeSet::new(),
            crop: None,
            modes: [ViewMode::Rgb; 2],
            split: false,
            dim: false,
            cameras: true,
            path,
            measurements: Vec::new(),
            pinned: Default::default(),
            recipes: Default::default(),
        };
        let now = EditSnapshot { scene: 1, folder: PathBuf::new(), map: Some(lamp()), cloud: None, view };
        let mut history = ChangeHistory::default();
        assert_eq!(history.settle(&now, None), None);
        (history, now)
    }

    #[test]
    fn changes_of_every_kind_come_back_in_order() {
        let (mut history, mut now) = start();
        let done = |history: &mut ChangeHistory, now: &EditSnapshot, edit| history.settle(now, edit).expect("a change");
        now.view.hidden = [0, 3].into();
        assert_eq!(done(&mut history, &now, None), "showed only lamp");
        now.map = Some(lamp());
        assert_eq!(done(&mut history, &now, Some("split lamp")), "split lamp");
        now.view.path.keys.push(PathKey::of_pose(DVec3::ZERO, DMat3::IDENTITY, 1.0));
        assert_eq!(done(&mut history, &now, None), "added a keyframe");
        now.view.modes[0] = ViewMode::Depth;
        assert_eq!(done(&mut history, &now, None), "showed depth");
        now.view.split = true;
        assert_eq!(done(&mut history, &now, None), "split the view");
        now.view.recipes[1] = QueryConfig::paper();
        assert_eq!(done(&mut history, &now, None), "changed the recipe");
        assert_eq!(history.settle(&now, None), None, "nothing has changed");
        let back: Vec<String> = std::iter::from_fn(|| history.go(false)).map(|(what, _)| what).collect();
        assert_eq!(
            back,
            [
                "changed the recipe",
                "split the view",
                "showed depth",
                "added a keyframe",
                "split lamp",
                "showed only lamp"
            ]
        );
        assert_eq!((history.last(), history.next()), (None, Some("showed only lamp")));
        let (_, again) = history.go(true).expect("something to redo");
        assert!(again.view.hidden.len() == 2 && again.view.path.keys.is_empty());
        assert_eq!(history.settle(&again, None), None, "redoing is no change");
        let mut other = again;
        other.view.hidden.clear();
        assert_eq!(done(&mut history, &other, None), "showed everything");
        assert!(history.go(true).is_none(), "a change ends what could be redone");
        assert!(history.go(false).is_some_and(|(_, back)| back.view.hidden.len() == 2));
    }

    #[test]
    fn all_that_one_sentence_changes_is_one_change() {
        let (mut history, mut now) = start();
        now.view.hidden = [1, 2].into();
        assert_eq!(history.settle_as(&now, None, Some(1)).as_deref(), Some("hid lamp"));
        now.view.hidden = [0, 1, 2].into();
        assert_eq!(history.settle_as(&now, None, Some(1)).as_deref(), Some("showed only table"));
        now.map = Some(lamp());
        assert_eq!(
            history.settle_as(&now, Some("renamed table to desk"), Some(1)).as_deref(),
            Some("showed only table, renamed table to desk")
        );
        now.view.dim = true;
        assert_eq!(history.settle_as(&now, None, Some(2)).as_deref(), Some("dimmed everything else"), "the control");
        assert!(history.go(false).is_some_and(|(what, _)| what == "dimmed everything else"));
        assert!(history.go(false).is_some_and(|(_, back)| back.view.hidden.is_empty()), "in one step");
        assert_eq!(history.last(), None);
        let (_, again) = history.go(true).expect("something to redo");
        assert_eq!(again.view.hidden.len(), 3);
        // What it takes back itself is no change.
        let (mut history, mut now) = start();
        now.view.dim = true;
        assert!(history.settle_as(&now, None, Some(1)).is_some());
        now.view.dim = false;
        assert_eq!((history.settle_as(&now, None, Some(1)), history.last()), (None, None));
    }

    #[test]
    fn another_scene_and_objects_found_anew_have_no_past() {
        for change in [|now: &mut EditSnapshot| now.scene = 2, |now: &mut EditSnapshot| now.map = Some(lamp())] {
            let (mut history, mut now) = start();
            now.view.cameras = false;
            assert_eq!(history.settle(&now, None).as_deref(), Some("hid the cameras"));
            change(&mut now);
            assert_eq!((history.settle(&now, None), history.last()), (None, None));
        }
    }
}
