//! Kinds of things: fruit, vehicles, furniture.

use super::super::ReferringKind;
use super::super::collect::SentenceSet;
use super::super::kinds::{KINDS, TrueKind};
use super::super::names::a;
use super::super::scope::{TruePhrase, TrueScope};
use super::places::PLACES;

pub(super) fn write(scope: &TrueScope, set: &mut SentenceSet) {
    for kind in &KINDS {
        let [one, many] = kind.names;
        // The scene's own words are names.
        if scope.has_noun(one) {
            continue;
        }
        let fits = scope.of_kind(kind);
        for form in ["the {}", "a {}", "any {}", "the one that is a {}", "something that is a {}"] {
            set.one(ReferringKind::Kind, form.replace("a {}", &a(one)).replace("{}", one), fits.clone());
        }
        for form in ["every {}", "each {}"] {
            set.many(ReferringKind::Kind, form.replace("{}", one), fits.clone());
        }
        // Of a single one, nobody says "all".
        if fits.as_ref().is_none_or(|fits| fits.len() != 1) {
            for form in ["all {}", "the {}", "{}", "all of the {}"] {
                set.many(ReferringKind::Kind, form.replace("{}", many), fits.clone());
            }
        }
        related(scope, set, kind, fits);
    }
}

/// Writes "the vehicle behind the house".
fn related(scope: &TrueScope, set: &mut SentenceSet, kind: &TrueKind, fits: Option<Vec<usize>>) {
    let Some(fits) = fits else { return };
    let [one, many] = kind.names.map(|name| Some(name.to_owned()));
    let head = TruePhrase { one, many, fits, generic: false };
    if !head.fits.iter().all(|&i| scope.is_object(i)) {
        return;
    }
    let anchors = scope.anchors(false);
    for place in PLACES.iter().filter(|p| !p.of_carriers) {
        for (anchor, name) in set.some(&anchors, 3) {
            if let Some(fits) = place.fits(scope, &head, anchor) {
                let tail = place.to(set, &name);
                set.related(ReferringKind::Chained, &head, &tail, fits);
            }
        }
    }
}
