//! Questions: which, what, is there.

use super::super::ReferringKind;
use super::super::collect::SentenceSet;
use super::super::kinds::ABSENT;
use super::super::names::a;
use super::super::scope::{TruePhrase, TrueScope};
use super::places::PLACES;
use super::sizes::ORDERS;

const KIND: ReferringKind = ReferringKind::Question;
/// Things to which each phrase is related.
const ANCHORS: usize = 4;

pub(super) fn write(scope: &TrueScope, set: &mut SentenceSet) {
    for head in scope.object_nouns(false) {
        related(scope, set, &head);
    }
    if let Some(things) = scope.things().first() {
        related(scope, set, things);
        what(scope, set, things);
    }
    for head in scope.things().iter().chain(&scope.object_nouns(false)).filter(|h| h.fits.len() > 1) {
        let Some(one) = &head.one else { continue };
        for order in &ORDERS {
            let is = set.pick(order.predicates);
            let form =
                set.pick(&["Which {x} is {p}?", "Which of the {m} is {p}?", "Can you tell me which {x} is {p}?"]);
            let many = head.many.as_deref().unwrap_or(one);
            let text = form.replace("{x}", one).replace("{m}", many).replace("{p}", is);
            set.ask_one(KIND, text, order.best(scope, &head.fits));
        }
    }
    for noun in &scope.nouns {
        let Some(one) = &noun.one else { continue };
        let form =
            set.pick(&["Is there {a}?", "Do you see {a} here?", "Can you see {a} anywhere?", "Where can I find {a}?"]);
        set.ask_one(KIND, form.replace("{a}", &a(one)), Some(noun.fits.clone()));
    }
    for noun in ABSENT.iter().filter(|noun| !scope.knows(noun)) {
        let form =
            set.pick(&["Is there {a}?", "Do you see {a} here?", "Is {a} in the scene?", "Where can I find {a}?"]);
        set.ask_one(KIND, form.replace("{a}", &a(noun)), Some(Vec::new()));
    }
}

/// Asks which thing of a noun stands so to another.
fn related(scope: &TrueScope, set: &mut SentenceSet, head: &TruePhrase) {
    let anchors = scope.anchors(false);
    for place in &PLACES {
        for (anchor, name) in set.some(&anchors, ANCHORS) {
            let Some(fits) = place.fits(scope, head, anchor) else { continue };
            let tail = place.to(set, &name);
            if let Some(one) = head.one.as_ref().filter(|_| head.fits.len() > 1) {
                let form = set.pick(&["Which {x} is {t}?", "Is there {a} {t}?", "Which one is the {x} {t}?"]);
                let text = form.replace("{x}", one).replace("{a}", &a(one)).replace("{t}", &tail);
                set.ask_one(KIND, text, fits.clone());
            }
            let several = fits.as_ref().is_none_or(|fits| fits.len() != 1) && head.fits.len() > 1;
            if let Some(many) = head.many.as_ref().filter(|_| several) {
                let form = set.pick(&["Which {m} are {t}?", "Are there any {m} {t}?", "What are the {m} {t}?"]);
                set.ask_many(KIND, form.replace("{m}", many).replace("{t}", &tail), fits);
            }
        }
    }
}

/// Asks for whatever stands so to another thing.
fn what(scope: &TrueScope, set: &mut SentenceSet, things: &TruePhrase) {
    for place in &PLACES {
        for (anchor, name) in scope.anchors(place.of_carriers) {
            let Some(fits) = place.fits(scope, things, anchor) else { continue };
            let form = set.pick(&["What is {t}?", "What's {t}?", "What do you see {t}?", "What can be found {t}?"]);
            let tail = place.to(set, &name);
            set.ask_many(KIND, form.replace("{t}", &tail), fits);
        }
    }
}
