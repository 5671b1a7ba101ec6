//! Relations among the parts of one thing.

use super::super::ReferringKind;
use super::super::collect::SentenceSet;
use super::super::scope::{TruePhrase, TrueScope};
use super::places::PLACES;

/// Relations between parts: the others hold for none, as parts touch.
const KINDS: [ReferringKind; 6] = [
    ReferringKind::LeftOf,
    ReferringKind::RightOf,
    ReferringKind::InFrontOf,
    ReferringKind::Behind,
    ReferringKind::Above,
    ReferringKind::Under,
];
/// Parts to which each phrase is related.
const ANCHORS: usize = 3;

pub(super) fn write(scope: &TrueScope, set: &mut SentenceSet) {
    for (whole, name) in scope.anchors(true) {
        let (parts, nouns) = (scope.parts(whole), scope.nouns_of(&scope.parts(whole)));
        let [one, many] = ["part", "parts"].map(|word| Some(word.to_owned()));
        let any = TruePhrase { one, many, fits: parts, generic: false };
        let anchors: Vec<TruePhrase> = nouns.iter().filter(|n| n.fits.len() == 1).cloned().collect();
        for head in std::iter::once(any).chain(nouns) {
            let of_whole = TruePhrase {
                one: head.one.as_ref().map(|one| format!("{one} of the {name}")),
                many: head.many.as_ref().map(|many| format!("{many} of the {name}")),
                ..head.clone()
            };
            for place in PLACES.iter().filter(|p| KINDS.contains(&p.kind)) {
                for anchor in set.some(&anchors, ANCHORS) {
                    if let Some(fits) = place.fits(scope, &of_whole, anchor.fits[0]) {
                        let tail = place.to(set, anchor.name());
                        set.related(place.kind, &of_whole, &tail, fits);
                    }
                }
            }
        }
    }
}
