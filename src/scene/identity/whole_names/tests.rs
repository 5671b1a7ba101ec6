//! Names as they are compared, told apart and found.

use super::*;
use crate::scene::{Level, NO_IDENTITY};

fn add(all: &mut Identities, whole: IdentityId, name: &str) -> IdentityId {
    let level = if whole == NO_IDENTITY { Level::Object } else { Level::Part };
    all.add(level, whole, if name.is_empty() { vec![] } else { vec![name.to_owned()] })
}

fn called(all: &Identities, text: &str) -> Vec<IdentityId> {
    all.called(text, LevelFilter::Auto)
}

#[test]
fn case_space_articles_and_marks_around_do_not_count() {
    for (text, expected) in [
        ("  The  Pink\tbow on the plush doll\u{2019}s hood? ", "pink bow on the plush doll's hood"),
        ("a the an \u{201c}Lamp\u{201d}!", "lamp"),
        ("STRASSE", "strasse"),
        ("Straße", "strasse"),
        ("ΟΔΟΣ", "οδος"),
        ("eye·The Doll", "eye · doll"),
        ("·", "·"),
        ("the", "the"),
        ("the a", "a"),
        ("?!", "?!"),
        ("the ?!", "?!"),
        ("(part) lid", "part) lid"),
        ("C++ #3", "c++ #3"),
        ("手柄", "手柄"),
        ("", ""),
        (" \n", ""),
    ] {
        assert_eq!(key(text), expected, "{text:?}");
    }
}

#[test]
fn the_same_names_are_told_apart_by_their_wholes_then_by_numbers() {
    let mut all = Identities::default();
    let mugs = [
        add(&mut all, NO_IDENTITY, "mug"),
        add(&mut all, NO_IDENTITY, "The Mug"),
        add(&mut all, NO_IDENTITY, "red mug"),
    ];
    let handles = mugs.map(|mug| add(&mut all, mug, "handle"));
    let twins = [add(&mut all, mugs[2], "dot"), add(&mut all, mugs[2], "dot")];
    let full: Vec<String> = all.iter().map(|(id, _)| all.full_name(id)).collect();
    let expected = [
        "mug #1",
        "The Mug #2",
        "red mug",
        "handle · mug #1",
        "handle · The Mug #2",
        "handle · red mug",
        "dot #7 · red mug",
        "dot #8 · red mug",
    ];
    assert_eq!(full, expected);
    assert_eq!(
        (all.label(twins[0]), all.label(handles[0]), all.name(mugs[0])),
        ("dot #7".into(), "handle".into(), "mug".into())
    );
    all.iter().for_each(|(id, _)| assert_eq!(called(&all, &all.full_name(id)), [id]));
    assert_eq!(
        (called(&all, "mug"), called(&all, "HANDLE"), called(&all, "a dot")),
        (vec![1, 2], vec![4, 5, 6], twins.to_vec())
    );
    assert_eq!(
        (called(&all, "handle · mug"), called(&all, "dot #8"), called(&all, "red mug #3")),
        (vec![4, 5], vec![8], vec![3])
    );
    // As full names were written before.
    assert_eq!((called(&all, "handle of the mug"), called(&all, "dot of the red mug")), (vec![4], twins.to_vec()));
    for nobody in ["", "mu", "mugs", "mug mug", "mug #3", "dot #1", "handle · dot", "#1", "the red"] {
        assert!(called(&all, nobody).is_empty(), "{nobody}");
    }
    assert!(all.called("mug", LevelFilter::Part).is_empty() && all.called("dot", LevelFilter::Object).is_empty());
    // Renamed, it is called otherwise, too.
    all.rename(mugs[1], "cup");
    assert_eq!((all.full_name(mugs[0]), all.full_name(mugs[1])), ("mug #1".into(), "cup".into()));
    assert_eq!(
        (called(&all, "cup"), called(&all, "The mug")),
        (vec![2], vec![1, 2]),
        "the former name is still its own"
    );
}

#[test]
fn names_that_look_like_full_names_and_numbers_are_told_apart_too() {
    let mut all = Identities::default();
    let doll = add(&mut all, NO_IDENTITY, "doll");
    let eye = add(&mut all, doll, "eye");
    let odd = ["eye · doll", "eye", "eye of the doll", "doll #1", "#9", "", "lamp"]
        .map(|name| add(&mut all, NO_IDENTITY, name));
    let lamp = add(&mut all, odd[6], "lamp");
    for (id, identity) in all.iter() {
        assert_eq!(called(&all, &all.full_name(id))[0], id, "{}", all.full_name(id));
        assert!(identity.names.iter().all(|name| called(&all, name).contains(&id)));
    }
    assert_eq!((called(&all, "eye · doll"), called(&all, "eye of the doll")), (vec![eye, odd[0]], vec![odd[2]]));
    assert_eq!((all.full_name(odd[5]), called(&all, "#8")), ("#8".into(), vec![8]), "what has no name has a number");
    // An object and its part of the same name are not two things.
    assert_eq!((all.full_name(lamp), called(&all, "lamp")), ("lamp · lamp".into(), vec![odd[6], lamp]));
}

#[test]
fn endless_and_deep_lists_of_names_are_survived() {
    let mut all = Identities::default();
    let mut whole = NO_IDENTITY;
    for _ in 0..2_000 {
        whole = add(&mut all, whole, &"x".repeat(text::LONGEST_NAME));
    }
    (0..2_000).for_each(|_| {
        add(&mut all, NO_IDENTITY, "mug");
    });
    assert_eq!((called(&all, "mug").len(), called(&all, "mug #3000")), (2_000, vec![3_000]));
    assert_eq!(called(&all, &all.full_name(whole)), [whole]);
    assert!(all.full_name(whole).len() < LONGEST && called(&all, &"x".repeat(1 << 20)).is_empty());
}
