//! Descriptions of changes that can be undone.

use std::collections::BTreeSet;

use super::ViewState;
use crate::jobs::edit::EditRequest;
use crate::jobs::rearrange::{Placement, SplatEdit};
use crate::math::format::{count, things};
use crate::pipeline::semantics::lifting::edit::Edit;
use crate::scene::measurement::change_text;
use crate::scene::{Identities, IdentityId, NO_IDENTITY};
use crate::worker::ViewMode;

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
pub(super) fn described(before: &ViewState, now: &ViewState, all: Option<&Identities>) -> String {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Level;

    #[test]
    fn what_is_hidden_is_named_by_its_whole() {
        let mut identities = Identities::default();
        let lamp = identities.add(Level::Object, NO_IDENTITY, vec!["lamp".into()]);
        identities.add(Level::Part, lamp, vec!["shade".into()]);
        identities.add(Level::Object, NO_IDENTITY, vec!["table".into()]);
        let text = |before: &[IdentityId], now: &[IdentityId]| {
            let set = |ids: &[IdentityId]| ids.iter().copied().collect();
            shown_text(&set(before), &set(now), &identities)
        };
        assert_eq!(text(&[], &[1, 2]), "hid lamp");
        assert_eq!(text(&[], &[2]), "hid shade · lamp");
        assert_eq!(text(&[1, 2, 3], &[3]), "showed lamp");
        assert_eq!(text(&[], &[0, 1, 3]), "showed only shade · lamp");
        assert_eq!(text(&[0, 1, 2], &[0]), "showed only lamp and table");
        assert_eq!(text(&[2], &[3]), "hid table, showed shade · lamp");
    }
}
