//! Relations to one other thing: left of, in front of, on, under, in, next to.

use super::super::ReferringKind;
use super::super::clarity::Clarity;
use super::super::collect::SentenceSet;
use super::super::facts::MeshFacts;
use super::super::kinds::{CONTENTS, HOLLOWS};
use super::super::scope::{TruePhrase, TrueScope};

/// Relation to a thing `{y}`.
pub(super) struct TruePlace {
    pub(super) kind: ReferringKind,
    pub(super) forms: &'static [&'static str],
    pub(super) holds: fn(&MeshFacts, usize, usize) -> Clarity,
    /// True if tables and floors take part.
    pub(super) of_carriers: bool,
}

/// Relations that sentences use.
pub(super) static PLACES: [TruePlace; 9] = [
    TruePlace {
        kind: ReferringKind::LeftOf,
        forms: &["left of {y}", "to the left of {y}", "on the left of {y}", "on the left-hand side of {y}"],
        holds: MeshFacts::left,
        of_carriers: false,
    },
    TruePlace {
        kind: ReferringKind::RightOf,
        forms: &["right of {y}", "to the right of {y}", "on the right of {y}", "on the right-hand side of {y}"],
        holds: MeshFacts::right,
        of_carriers: false,
    },
    TruePlace {
        kind: ReferringKind::InFrontOf,
        forms: &["in front of {y}", "nearer to me than {y}", "closer to the viewer than {y}", "standing before {y}"],
        holds: MeshFacts::front,
        of_carriers: false,
    },
    TruePlace {
        kind: ReferringKind::Behind,
        forms: &["behind {y}", "in back of {y}", "farther away than {y}", "further away from me than {y}"],
        holds: MeshFacts::behind,
        of_carriers: false,
    },
    TruePlace {
        kind: ReferringKind::On,
        forms: &["on {y}", "on top of {y}", "standing on {y}", "resting on {y}", "placed on {y}", "sitting on {y}"],
        holds: MeshFacts::on,
        of_carriers: true,
    },
    TruePlace {
        kind: ReferringKind::Under,
        forms: &["under {y}", "below {y}", "beneath {y}", "underneath {y}"],
        holds: MeshFacts::under,
        of_carriers: true,
    },
    TruePlace {
        kind: ReferringKind::Above,
        forms: &["above {y}", "over {y}", "directly above {y}", "right above {y}"],
        holds: MeshFacts::above,
        of_carriers: false,
    },
    TruePlace {
        kind: ReferringKind::NextTo,
        forms: &["next to {y}", "beside {y}", "close to {y}", "right next to {y}", "near {y}", "alongside {y}"],
        holds: MeshFacts::beside,
        of_carriers: false,
    },
    TruePlace {
        kind: ReferringKind::Touching,
        forms: &["touching {y}", "in contact with {y}", "in direct contact with {y}", "in touch with {y}"],
        holds: MeshFacts::touching,
        of_carriers: true,
    },
];

const INSIDE: [&str; 5] = ["in {y}", "inside {y}", "inside of {y}", "within {y}", "lying in {y}"];

impl TruePlace {
    /// Things of a phrase that stand so to another; the outer `None` means that there are no candidates, the inner one
    /// that it is unclear.
    pub(super) fn fits(&self, scope: &TrueScope, head: &TruePhrase, anchor: usize) -> Option<Option<Vec<usize>>> {
        let rest: Vec<usize> = head.fits.iter().copied().filter(|i| *i != anchor).collect();
        if rest.is_empty() {
            return None;
        }
        let holds = |i: usize| if i == anchor { Clarity::No } else { (self.holds)(&scope.facts, i, anchor) };
        let rest = TruePhrase { fits: rest, ..head.clone() };
        Some(if self.of_carriers { scope.either_way(&rest, holds) } else { scope.among(&rest.fits, holds) })
    }

    /// Phrase of the relation to a thing called `name`.
    pub(super) fn to(&self, set: &mut SentenceSet, name: &str) -> String {
        set.pick(self.forms).replace("{y}", &format!("the {name}"))
    }
}

pub(super) fn write(scope: &TrueScope, set: &mut SentenceSet) {
    for place in &PLACES {
        let heads = [scope.things(), scope.object_nouns(place.of_carriers)].concat();
        for head in &heads {
            for (anchor, name) in scope.anchors(place.of_carriers) {
                if let Some(fits) = place.fits(scope, head, anchor) {
                    let tail = place.to(set, &name);
                    set.related(place.kind, head, &tail, fits);
                }
            }
        }
    }
    inside(scope, set);
}

/// Writes "the lemon in the bowl" and "the mug in the kettle".
fn inside(scope: &TrueScope, set: &mut SentenceSet) {
    let is_content = |n: &TruePhrase| CONTENTS.contains(&n.name());
    let all: Vec<usize> = (0..scope.words.len()).collect();
    let contents = scope.nouns_of(&all).into_iter().filter(is_content);
    let heads: Vec<TruePhrase> = [scope.things(), scope.object_nouns(false), contents.collect()].concat();
    let is_hollow = |thing: &usize| scope.nouns.iter().any(|n| n.fits.contains(thing) && HOLLOWS.contains(&n.name()));
    for (hollow, name) in scope.anchors(false).into_iter().filter(|(i, _)| is_hollow(i)) {
        let parts = scope.parts(hollow);
        let filled = scope.nouns_of(&parts).iter().any(is_content);
        for head in &heads {
            let rest: Vec<usize> = head.fits.iter().copied().filter(|i| *i != hollow).collect();
            // To some people, "the thing in the bowl" is a lemon; a lemon is a part here.
            let fits =
                if head.generic && filled { None } else { scope.among(&rest, |i| scope.facts.inside(i, hollow)) };
            if !rest.is_empty() {
                let tail = set.pick(&INSIDE).replace("{y}", &format!("the {name}"));
                set.related(ReferringKind::In, head, &tail, fits);
            }
        }
    }
}
