//! Edited objects stay as they are beside the result of a new search.

use super::super::edit::{Edit, apply};
use super::*;
use crate::scene::{GaussianCloud, Identities, Level};

/// Forty Gaussians in a row.
fn cloud() -> GaussianCloud {
    GaussianCloud::isotropic((0..40).map(|i| [i as f32, 0.0, 0.0]).collect(), -3.0, 2.0)
}

/// A doll (0 to 19) with a face (10 to 19), and a cat (20 to 29); the rest is unlabeled.
fn found() -> SemanticMap {
    let mut all = Identities::default();
    let doll = all.add(Level::Object, NO_IDENTITY, vec!["doll".into()]);
    let face = all.add(Level::Part, doll, vec!["face".into()]);
    let cat = all.add(Level::Object, NO_IDENTITY, vec!["cat".into()]);
    for (id, code) in [(doll, 0.1), (face, 0.5), (cat, 0.9)] {
        all.get_mut(id).expect("there").code = [code; 3];
    }
    let of = (0..40).map(|i| [doll, face, cat, NO_IDENTITY][i / 10]).collect();
    SemanticMap::from_identities(all, of, vec![0.75; 40], vec!["a.jpg".into()])
}

fn own(map: &SemanticMap, name: &str) -> Vec<usize> {
    let id = map.identities.iter().find(|(_, i)| i.names.first().is_some_and(|n| n == name)).map(|(id, _)| id);
    id.map_or_else(Vec::new, |id| (0..40).filter(|i| map.identity_of[*i] == id).collect())
}

fn edited(map: &SemanticMap, edits: &[Edit]) -> SemanticMap {
    edits.iter().fold(map.clone(), |map, edit| apply(&map, &cloud(), edit).expect("edited"))
}

#[test]
fn every_kind_of_work_by_hand_is_noted_and_nothing_else() {
    let map = found();
    assert_eq!((map.by_hand(), worked_on(&map)), (vec![], None), "what was found was not");
    let piece =
        |of, gaussians: std::ops::Range<u32>| Edit::AddPiece { of, name: "x".into(), gaussians: gaussians.collect() };
    for (edit, ids) in [
        (Edit::Rename(3, "kitty".into()), vec![3]),
        (Edit::Merge(3, 1), vec![1]),
        (Edit::Split(2), vec![]),
        (piece(NO_IDENTITY, 30..35), vec![4]),
        (piece(1, 0..5), vec![4]),
        (Edit::Reshape { id: 2, gaussians: (8..20).collect() }, vec![2]),
    ] {
        match apply(&map, &cloud(), &edit) {
            Ok(new) => assert_eq!(new.by_hand(), ids, "{edit:?}"),
            Err(e) => assert!(ids.is_empty(), "{edit:?}: {e}"),
        }
    }
    // As earlier versions left it.
    let mut renamed = found();
    renamed.identities.get_mut(3).expect("there").names.insert(0, "kitty".into());
    assert_eq!(renamed.by_hand(), [3]);
    let clicked = SemanticMap { seeds: Vec::new(), ..found() };
    assert_eq!(clicked.by_hand(), [1, 2, 3], "nothing came from a photo");
    // Merging and forgetting others, it is still known.
    let named = edited(&map, &[Edit::Rename(3, "kitty".into()), Edit::Merge(2, 1)]);
    assert_eq!(named.by_hand(), [1, 2]);
}

#[test]
fn what_is_found_again_where_something_is_kept_is_no_second_one() {
    // Found by clicks: a bow on the doll's head, where the next search finds the doll and a "ribbon".
    let map =
        edited(&found(), &[Edit::AddPiece { of: NO_IDENTITY, name: "bow".into(), gaussians: (14..20).collect() }]);
    let kept = worked_on(&map).expect("the bow");
    assert_eq!((kept.identities.len(), own(&kept, "bow")), (1, (14..20).collect::<Vec<_>>()));
    let mut again = found();
    let ribbon = again.identities.add(Level::Part, 1, vec!["ribbon".into()]);
    (13..20).for_each(|i| again.identity_of[i] = ribbon);
    let new = joined(&again, &kept);
    let names: Vec<_> = new.identities.iter().map(|(_, i)| i.names[0].clone()).collect();
    assert_eq!(names, ["bow", "doll", "face", "cat"], "the ribbon is the bow");
    assert_eq!((own(&new, "bow"), own(&new, "face")), ((14..20).collect(), (10..13).collect()));
    assert_eq!(new.identity_of[13], 2, "what is left of it is the doll's");
    assert_eq!((new.by_hand(), new.identities.get(3).expect("the face").parent), (vec![1], 2));
    assert_eq!(new.codes[25], again.codes[25], "codes of what was found stay");
    let codes: BTreeSet<_> = new.identities.iter().map(|(_, i)| i.code.map(f32::to_bits)).collect();
    assert_eq!(codes.len(), 4, "everybody has a code of its own");
    assert_eq!(joined(&new, &worked_on(&new).expect("the bow")).identity_of, new.identity_of, "again, nothing changes");
}

#[test]
fn an_object_stays_with_its_parts_and_gets_those_that_it_lacks() {
    let map = edited(&found(), &[Edit::Rename(2, "smile".into())]);
    let kept = worked_on(&map).expect("the doll");
    assert_eq!(kept.identities.len(), 2, "with its whole, not with the cat");
    // The next search finds more of the doll, and its boots, which are new.
    let mut again = found();
    let boots = again.identities.add(Level::Part, 1, vec!["boots".into()]);
    (30..36).for_each(|i| again.identity_of[i] = boots);
    let new = joined(&again, &kept);
    assert_eq!((new.identities.name(2), new.identities.full_name(4)), ("smile".into(), "boots · doll".into()));
    assert_eq!((own(&new, "doll"), own(&new, "smile")), (own(&map, "doll"), own(&map, "smile")));
    assert_eq!((own(&new, "boots").len(), own(&new, "cat").len()), (6, 10));
    // The control: nothing is kept, and all is as it was found.
    let nothing = SemanticMap::from_identities(Identities::default(), vec![NO_IDENTITY; 40], vec![0.0; 40], vec![]);
    assert_eq!(joined(&again, &nothing).identity_of, again.identity_of);
}
