//! The table of actions is consistent.

use super::*;
use std::collections::HashSet;

#[test]
fn no_two_actions_share_a_key_or_a_name_and_each_is_explained() {
    let all = Action::all();
    let keys: Vec<Shortcut> = all.iter().filter_map(Action::shortcut).collect();
    assert_eq!(keys.iter().collect::<HashSet<_>>().len(), keys.len());
    let names: HashSet<String> = all.iter().map(Action::text).collect();
    assert_eq!(names.len(), all.len());
    assert!(keys.len() > 20 && all.iter().all(|a| a.tooltip().ends_with('.')));
}

#[test]
fn no_action_takes_a_flying_key() {
    for action in Action::all() {
        if let Some(Shortcut { ctrl: false, key }) = action.shortcut() {
            assert!(!["W", "A", "S", "D", "Q", "E"].contains(&key), "{action:?} would stop flying");
        }
    }
}

#[test]
fn axes_are_as_they_are_called() {
    assert_eq!([Axis::PlusX, Axis::MinusY, Axis::PlusZ].map(Axis::vector), [DVec3::X, -DVec3::Y, DVec3::Z]);
    assert_eq!(Axis::VARIANTS.iter().map(|a| a.vector()).sum::<DVec3>(), DVec3::ZERO);
    assert_eq!(Axis::MinusZ.text(), "-Z");
}
