//! Things, parts and anchors that no scene has.

use super::super::ReferringKind;
use super::super::collect::SentenceSet;
use super::super::kinds::{ABSENT, ABSENT_PARTS};
use super::super::names::{a, plural};
use super::super::scope::{TruePhrase, TrueScope};
use super::names::of;
use super::places::PLACES;

const KIND: ReferringKind = ReferringKind::Absent;

pub(super) fn write(scope: &TrueScope, set: &mut SentenceSet) {
    let nothing = || Some(Vec::new());
    let heads: Vec<TruePhrase> = [scope.things(), scope.object_nouns(false)].concat();
    for noun in ABSENT.iter().filter(|noun| !scope.knows(noun)) {
        set.one(KIND, format!("the {noun}"), nothing());
        set.one(KIND, a(noun), nothing());
        if let Some(many) = plural(noun) {
            set.many(KIND, format!("all {many}"), nothing());
        }
        let color = set.pick(&["red", "blue", "small", "big", "yellow", "old"]);
        set.one(KIND, format!("the {color} {noun}"), nothing());
        // The thing is absent, or what it is related to.
        let anchors = set.some(&scope.anchors(false), 2);
        let head = TruePhrase { one: Some((*noun).to_owned()), many: plural(noun), fits: Vec::new(), generic: false };
        for (_, name) in anchors {
            let place = &PLACES[set.pick(&[0, 1, 2, 3, 7])];
            let tail = place.to(set, &name);
            set.related(place.kind, &head, &tail, nothing());
        }
        for head in set.some(&heads, 2) {
            let place = &PLACES[set.pick(&[0, 1, 2, 3, 7])];
            let tail = place.to(set, noun);
            set.related(place.kind, &head, &tail, nothing());
        }
        for (_, name) in set.some(&scope.anchors(true), 1) {
            set.one(ReferringKind::Part, format!("the {name} of the {noun}"), nothing());
        }
    }
    for (_, whole) in scope.anchors(true) {
        for part in ABSENT_PARTS.iter().filter(|part| !scope.knows(part)) {
            let form =
                set.pick(&["the {p} of the {w}", "the {s} {p}", "the {w} {p}", "the {p} that belongs to the {w}"]);
            set.one(ReferringKind::Part, of(form, part, &whole), nothing());
        }
    }
    foreign_parts(scope, set);
}

/// Writes about parts that other things have: "the spout of the book".
fn foreign_parts(scope: &TrueScope, set: &mut SentenceSet) {
    let all: Vec<usize> = (0..scope.words.len()).filter(|&i| !scope.is_object(i)).collect();
    let parts = scope.nouns_of(&all);
    for (whole, name) in scope.anchors(true) {
        let own = scope.nouns_of(&scope.parts(whole));
        let is_foreign = |n: &&TruePhrase| FOREIGN.contains(&n.name()) && !own.iter().any(|o| o.name() == n.name());
        for part in parts.iter().filter(is_foreign) {
            let form =
                set.pick(&["the {p} of the {w}", "the {s} {p}", "the {w} {p}", "the {p} that belongs to the {w}"]);
            set.one(ReferringKind::Part, of(form, part.name(), &name), Some(Vec::new()));
        }
    }
}

/// Parts that a thing has only if it has a name for them.
const FOREIGN: [&str; 12] = [
    "spout",
    "stalk",
    "direction pad",
    "viewfinder",
    "coffee",
    "soil",
    "icing",
    "chimney",
    "mast",
    "beak",
    "antenna",
    "lemon",
];
