//! Sentences of several relations: the largest of the things left of another, parts of related things, colors among
//! them, relations of relations.

use super::super::ReferringKind;
use super::super::clarity::Clarity;
use super::super::collect::SentenceSet;
use super::super::color::TERMS;
use super::super::names::NUMBERS;
use super::super::scope::{TruePhrase, TrueScope};
use super::names::of;
use super::places::{PLACES, TruePlace};
use super::sizes::ORDERS;

const KIND: ReferringKind = ReferringKind::Chained;
/// Attempts to write each pattern.
const ATTEMPTS: usize = 160;

pub(super) fn write(scope: &TrueScope, set: &mut SentenceSet) {
    let chain = ChainWords {
        scope,
        heads: [scope.things(), scope.object_nouns(false)].concat(),
        anchors: scope.anchors(false),
        places: PLACES.iter().filter(|p| !p.of_carriers).collect(),
    };
    if chain.heads.is_empty() || chain.anchors.is_empty() {
        return;
    }
    for _ in 0..ATTEMPTS {
        let Some(related) = chain.related(set) else { continue };
        chain.superlative(set, &related);
        chain.colored(set, &related);
        chain.counted(set, &related);
        chain.except(set, &related);
        chain.part(set, &related);
        chain.both(set, &related);
        chain.nested(set, &related);
        chain.to_superlative(set, &related);
    }
}

/// Words that chains are made of.
struct ChainWords<'a> {
    scope: &'a TrueScope,
    heads: Vec<TruePhrase>,
    anchors: Vec<(usize, String)>,
    places: Vec<&'static TruePlace>,
}

/// Things of a noun that stand so to another thing.
struct RelatedThings {
    head: TruePhrase,
    place: &'static TruePlace,
    anchor: usize,
    /// Words after the noun: "left of the mug".
    tail: String,
    fits: Option<Vec<usize>>,
}

impl ChainWords<'_> {
    fn related(&self, set: &mut SentenceSet) -> Option<RelatedThings> {
        let head = set.some(&self.heads, 1).pop()?;
        let (anchor, name) = set.some(&self.anchors, 1).pop()?;
        let place = set.pick(&self.places);
        let fits = place.fits(self.scope, &head, anchor)?;
        let tail = place.to(set, &name);
        Some(RelatedThings { head, place, anchor, tail, fits })
    }

    /// Writes "the largest thing left of the mug".
    fn superlative(&self, set: &mut SentenceSet, related: &RelatedThings) {
        let Some(one) = related.head.one.as_ref().filter(|_| related.head.fits.len() > 1) else { return };
        for order in set.some(&[0, 1, 2, 3], 2).into_iter().map(|i| &ORDERS[i]) {
            let fits = related.fits.as_ref().and_then(|fits| order.best(self.scope, fits));
            let text = order.forms[0].replace("{}", &format!("{one} {}", related.tail));
            set.one(KIND, format!("the {text}"), fits);
        }
    }

    /// Writes "the red thing left of the mug".
    fn colored(&self, set: &mut SentenceSet, related: &RelatedThings) {
        let Some(one) = &related.head.one else { return };
        let named = |term: &usize| one.split(' ').any(|word| TERMS[*term].is(word));
        let terms: Vec<usize> = (0..TERMS.len()).filter(|term| !named(term)).collect();
        for term in set.some(&terms, 3) {
            let fits = self.among(related, |i| self.scope.colored(i, term));
            let color = TERMS[term].name;
            let text = match set.pick(&[0, 1]) {
                0 => format!("the {color} {one} {}", related.tail),
                _ => format!("the {color} {one} that is {}", related.tail),
            };
            set.one(KIND, text, fits);
        }
    }

    /// Writes "the two mugs left of the kettle".
    fn counted(&self, set: &mut SentenceSet, related: &RelatedThings) {
        let (Some(fits), Some(many)) = (&related.fits, &related.head.many) else { return };
        if related.head.one.is_none() || fits.len() < 2 {
            return;
        }
        let form = set.pick(&["the {n} {x} {t}", "all {n} {x} {t}", "the {n} {x} that are {t}"]);
        let write = |number: &str| form.replace("{n}", number).replace("{x}", many).replace("{t}", &related.tail);
        if let Some(number) = NUMBERS.get(fits.len()) {
            set.many(KIND, write(number), Some(fits.clone()));
        }
        if let Some(number) = NUMBERS.get(fits.len() + 2) {
            set.many(KIND, write(number), Some(Vec::new()));
        }
    }

    /// Writes "everything left of the mug except the lamp".
    fn except(&self, set: &mut SentenceSet, related: &RelatedThings) {
        let (Some(fits), Some(many)) = (&related.fits, &related.head.many) else { return };
        let inside: Vec<_> = self.anchors.iter().filter(|(i, _)| fits.contains(i)).cloned().collect();
        if fits.len() < 2 || related.head.one.is_none() {
            return;
        }
        for (left_out, name) in set.some(&inside, 2) {
            let rest = fits.iter().copied().filter(|i| *i != left_out).collect();
            let form = set.pick(&[
                "all {x} {t} except the {o}",
                "the {x} {t}, but not the {o}",
                "every one of the {x} {t} apart from the {o}",
            ]);
            let text = form.replace("{x}", many).replace("{t}", &related.tail).replace("{o}", &name);
            set.many(KIND, text, Some(rest));
        }
    }

    /// Writes "the handle of the mug left of the kettle", if it does not matter which of the two is on the left.
    fn part(&self, set: &mut SentenceSet, related: &RelatedThings) {
        let (Some(fits), Some(whole)) = (&related.fits, &related.head.one) else { return };
        let parts = |wholes: &[usize]| wholes.iter().flat_map(|&w| self.scope.parts(w)).collect::<Vec<_>>();
        let wholes: Vec<usize> = related.head.fits.iter().copied().filter(|i| *i != related.anchor).collect();
        let nouns = self.scope.nouns_of(&parts(&wholes));
        for part in set.some(&nouns, 3).iter().filter(|n| n.one.is_some() && !related.head.generic) {
            let of_fits = parts(fits);
            let first: Vec<usize> = part.fits.iter().copied().filter(|i| of_fits.contains(i)).collect();
            let holds = |i: usize| (related.place.holds)(&self.scope.facts, i, related.anchor);
            let second = self.scope.among(&part.fits, holds);
            let text = of("the {p} of the {w}", part.name(), whole);
            let agreed = second.filter(|second| *second == first);
            set.one(KIND, format!("{text} {}", related.tail), agreed);
            // "That is" belongs to the whole, which stands right before it.
            set.one(KIND, of("the {p} on that {w} which is ", part.name(), whole) + &related.tail, Some(first));
        }
    }

    /// Writes "the thing that is left of the mug and behind the lamp".
    fn both(&self, set: &mut SentenceSet, related: &RelatedThings) {
        let Some((second, name)) = set.some(&self.anchors, 1).pop() else { return };
        let place = set.pick(&self.places);
        if second == related.anchor || place.kind == related.place.kind {
            return;
        }
        let fits = self
            .among(related, |i| if i == second { Clarity::No } else { (place.holds)(&self.scope.facts, i, second) });
        let tail = format!("{} and {}", related.tail, place.to(set, &name));
        set.related(KIND, &related.head, &tail, fits);
    }

    /// Writes "the thing behind the mug that is left of the kettle", about the only mug that is.
    fn nested(&self, set: &mut SentenceSet, related: &RelatedThings) {
        let (Some(fits), Some(one)) = (&related.fits, &related.head.one) else { return };
        let ([anchor], true) = (&fits[..], related.head.fits.len() > 1) else { return };
        let place = set.pick(&self.places);
        for head in set.some(&self.heads, 3) {
            let Some(fits) = place.fits(self.scope, &head, *anchor) else { continue };
            let clause = set.pick(&["", "that is ", "which is "]);
            let tail = place.to(set, &format!("{one} {clause}{}", related.tail));
            set.related(KIND, &head, &tail, fits);
        }
    }

    /// Writes "the thing left of the largest mug".
    fn to_superlative(&self, set: &mut SentenceSet, related: &RelatedThings) {
        let Some(one) = related.head.one.as_ref().filter(|_| related.head.fits.len() > 1) else { return };
        let order = &ORDERS[set.pick(&[0, 1, 2, 4, 5])];
        let Some(&[anchor]) = order.best(self.scope, &related.head.fits).as_deref() else { return };
        for head in set.some(&self.heads, 2) {
            let place = set.pick(&self.places);
            let Some(fits) = place.fits(self.scope, &head, anchor) else { continue };
            let tail = place.to(set, &order.forms[0].replace("{}", one));
            set.related(KIND, &head, &tail, fits);
        }
    }

    /// Things of the noun that stand so, and for which `holds`.
    fn among(&self, related: &RelatedThings, holds: impl Fn(usize) -> Clarity) -> Option<Vec<usize>> {
        let rest: Vec<usize> = related.head.fits.iter().copied().filter(|i| *i != related.anchor).collect();
        self.scope.among(&rest, |i| (related.place.holds)(&self.scope.facts, i, related.anchor).and(holds(i)))
    }
}
