//! The undo history of the window: changes of objects, of the view and of the camera path, by the user and by the
//! agent, are undone and redone in the order in which they were made.
//!
//! No code reports a change. The window's state is compared with the last snapshot whenever it is at rest, so a drag or
//! a name that is typed is one change.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

use crate::jobs::edit::EditRequest;
use crate::jobs::rearrange::{Placement, SplatEdit};
use crate::math::format::{count, things};
use crate::pipeline::semantics::lifting::edit::Edit;
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::scene::measurement::{Measurement, change_text};
use crate::scene::undo::UndoHistory;
use crate::scene::{CameraPath, CropBox, GaussianCloud, Identities, IdentityId, NO_IDENTITY, SemanticMap};
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
        if let Some(other) = self.now.replace(now.clone()) {
            self.changes.record(Change { what: what.clone(), other });
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
        let mut change = Change { what: what.clone(), other: self.now.clone()? };
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

/// Description of an edit.
pub(crate) fn edit_text(request: &EditRequest, all: &Identities) -> String {
    let added = |of: IdentityId, name: &str| match (name.trim(), of) {
        ("", NO_IDENTITY) => "added an object".to_owned(),
        ("", of) => format!("added a part of {}", all.label(of)),
        (name, _) => format!("added {name}"),
    };
    match request {
        EditRequest::Apply(Edit::Rename(id, name)) => format!("renamed {} to {}", all.label(*id), name.trim()),
        EditRequest::Apply(Edit::Merge(from, into)) => format!("merged {} into {}", all.label(*from), all.label(*into)),
        EditRequest::Apply(Edit::Dissolve(id)) => format!("dissolved {}", all.label(*id)),
        EditRequest::Apply(Edit::Split(id)) => format!("split {}", all.label(*id)),
        EditRequest::Apply(Edit::AddPiece { of, name, .. }) => added(*of, name),
        EditRequest::Apply(Edit::Reshape { id, .. }) => format!("corrected {}", all.label(*id)),
        EditRequest::Restore(_) => "restored objects and parts".to_owned(),
    }
}

/// Description of an edit of Gaussians.
pub(crate) fn splat_edit_text(edit: &SplatEdit, all: &Identities) -> String {
    match edit {
        SplatEdit::Delete(gone) => format!("deleted {}", things(gone.iter().filter(|g| **g).count(), "Gaussian")),
        SplatEdit::Arrange(to) => {
            let what = match to {
                _ if to.duplicate => "duplicated",
                _ if to.to == Placement::default() => "recolored",
                _ if to.is_recolored() => return format!("changed {}: moved, recolored", all.label(to.id)),
                _ => "moved",
            };
            format!("{what} {}", all.label(to.id))
        }
    }
}

/// Description of a change of the view.
fn described(before: &ViewState, now: &ViewState, all: Option<&Identities>) -> String {
    if before.hidden != now.hidden {
        return all.map_or_else(String::new, |all| shown_text(&before.hidden, &now.hidden, all));
    }
    if before.crop != now.crop {
        return match (before.crop, now.crop) {
            (None, _) => "cropped the view",
            (_, None) => "removed the crop box",
            (Some(before), Some(now)) if before.outside != now.outside => "inverted the crop box",
            _ => "changed the crop box",
        }
        .to_owned();
    }
    if before.path != now.path {
        let (n, keys) = (now.path.keys.len(), before.path.keys.len());
        let what = match n.abs_diff(keys) {
            0 => "changed the camera path",
            1 if n > keys => "added a keyframe",
            1 => "deleted a keyframe",
            _ => "replaced the camera path",
        };
        return what.to_owned();
    }
    if before.measurements != now.measurements {
        return change_text(&before.measurements, &now.measurements);
    }
    if let Some((_, now)) = before.modes.iter().zip(now.modes).find(|(before, now)| *before != now) {
        return match now {
            ViewMode::Rgb => "showed RGB".to_owned(),
            other => format!("showed {}", other.text().to_lowercase()),
        };
    }
    if before.split != now.split {
        return if now.split { "split the view" } else { "ended the split view" }.to_owned();
    }
    if before.dim != now.dim {
        return if now.dim { "dimmed everything else" } else { "ended dimming" }.to_owned();
    }
    if before.cameras != now.cameras {
        return format!("{} the cameras", if now.cameras { "showed" } else { "hid" });
    }
    if before.recipes != now.recipes {
        return "changed the recipe".to_owned();
    }
    "changed what is pinned".to_owned()
}

fn shown_text(before: &BTreeSet<IdentityId>, now: &BTreeSet<IdentityId>, all: &Identities) -> String {
    if now.is_empty() {
        return "showed everything".to_owned();
    }
    // A whole stands for its parts.
    let outermost = |ids: &BTreeSet<IdentityId>| -> Vec<IdentityId> {
        let whole = |id: &IdentityId| all.get(*id).is_some_and(|i| ids.contains(&i.parent));
        ids.iter().copied().filter(|id| all.get(*id).is_some() && !whole(id)).collect()
    };
    let drawn: BTreeSet<IdentityId> = all.iter().map(|(id, _)| id).filter(|id| !now.contains(id)).collect();
    let named = |ids: BTreeSet<IdentityId>| match outermost(&ids).as_slice() {
        [one] => all.full_name(*one),
        [one, other] => format!("{} and {}", all.full_name(*one), all.full_name(*other)),
        more => format!("{} objects and parts", count(more.len() as u64)),
    };
    if let (true, [_] | [_, _]) = (now.contains(&NO_IDENTITY), outermost(&drawn).as_slice()) {
        return format!("showed only {}", named(drawn));
    }
    let (gone, back): (BTreeSet<_>, BTreeSet<_>) = (now - before, before - now);
    match (gone.is_empty(), back.is_empty()) {
        (false, true) => format!("hid {}", named(gone)),
        (true, _) => format!("showed {}", named(back)),
        _ => format!("hid {}, showed {}", named(gone), named(back)),
    }
}

/// An edit that waits for those before it.
pub(super) enum EditStep {
    Request(EditRequest),
    Rearrange(SplatEdit),
    Undo,
    Redo,
    /// The agent undid a rename; the identity gets this name again.
    UndoRename(IdentityId, String),
    /// The agent undid hiding or showing; these identities are hidden again.
    UndoHidden(Vec<IdentityId>),
}

/// A running change of objects and parts.
pub(super) struct Editing {
    /// Description; `None` if it restores an earlier or later state.
    pub(super) what: Option<String>,
    /// True if it is a redo.
    pub(super) redo: bool,
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
    use crate::scene::{Level, PathKey};

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
    fn another_scene_and_objects_found_anew_have_no_past() {
        for change in [|now: &mut EditSnapshot| now.scene = 2, |now: &mut EditSnapshot| now.map = Some(lamp())] {
            let (mut history, mut now) = start();
            now.view.cameras = false;
            assert_eq!(history.settle(&now, None).as_deref(), Some("hid the cameras"));
            change(&mut now);
            assert_eq!((history.settle(&now, None), history.last()), (None, None));
        }
    }

    #[test]
    fn what_is_hidden_is_named_by_its_whole() {
        let map = lamp();
        let text = |before: &[IdentityId], now: &[IdentityId]| {
            let set = |ids: &[IdentityId]| ids.iter().copied().collect();
            shown_text(&set(before), &set(now), &map.identities)
        };
        assert_eq!(text(&[], &[1, 2]), "hid lamp");
        assert_eq!(text(&[], &[2]), "hid shade · lamp");
        assert_eq!(text(&[1, 2, 3], &[3]), "showed lamp");
        assert_eq!(text(&[], &[0, 1, 3]), "showed only shade · lamp");
        assert_eq!(text(&[0, 1, 2], &[0]), "showed only lamp and table");
        assert_eq!(text(&[2], &[3]), "hid table, showed shade · lamp");
    }
}
