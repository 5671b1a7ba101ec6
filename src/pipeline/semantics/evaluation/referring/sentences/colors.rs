//! Things by their color, and by a color that they do not have.

use super::super::ReferringKind;
use super::super::collect::SentenceSet;
use super::super::color::{TERMS, is_color};
use super::super::scope::{TruePhrase, TrueScope};

const ONE: [&str; 6] = [
    "the {c} {x}",
    "the {x} that is {c}",
    "the {c}-colored {x}",
    "the {c} coloured {x}",
    "the {x} which looks {c}",
    "the {x} whose color is {c}",
];
const MANY: [&str; 5] =
    ["all {c} {x}", "the {c} {x}", "all {x} that are {c}", "every one of the {c} {x}", "the {x} of {c} colour"];
const GENERIC: [&str; 4] = ["everything {c}", "everything that is {c}", "anything {c}", "all {c} things"];
const NOT_ONE: [&str; 5] = [
    "the {x} that is not {c}",
    "the {x} which isn't {c}",
    "the non-{c} {x}",
    "the {x} of another color than {c}",
    "the {x} that is any colour but {c}",
];
const NOT_MANY: [&str; 4] =
    ["all {x} that are not {c}", "all non-{c} {x}", "the {x} which aren't {c}", "the {x} of any colour but {c}"];

pub(super) fn write(scope: &TrueScope, set: &mut SentenceSet) {
    let plain = |n: &TruePhrase| !n.name().split(' ').any(is_color);
    let nouns = scope.object_nouns(true).into_iter().filter(plain);
    for head in scope.things().into_iter().chain(nouns) {
        colored(scope, set, &head, "");
    }
    for (whole, name) in scope.anchors(true) {
        let parts = scope.parts(whole);
        let [one, many] = ["part", "parts"].map(|word| Some(word.to_owned()));
        let any = TruePhrase { one, many, fits: parts.clone(), generic: false };
        for head in std::iter::once(any).chain(scope.nouns_of(&parts).into_iter().filter(plain)) {
            if !head.fits.is_empty() {
                colored(scope, set, &head, &format!(" of the {name}"));
            }
        }
    }
}

/// Writes about the things of a noun by each color; `tail` follows the noun.
fn colored(scope: &TrueScope, set: &mut SentenceSet, head: &TruePhrase, tail: &str) {
    for (term, color) in TERMS.iter().enumerate() {
        let fits = scope.either_way(head, |i| scope.colored(i, term));
        let others = scope.either_way(head, |i| scope.colored(i, term).inverse());
        let word = if color.name == "grey" { set.pick(&["grey", "gray"]) } else { color.name };
        let say = |form: &str, noun: &str| form.replace("{c}", word).replace("{x}", &format!("{noun}{tail}"));
        let is_trivial = others.as_ref().is_none_or(|others| others.len() == head.fits.len());
        if let Some(one) = &head.one {
            let form = set.pick(&ONE);
            set.one(ReferringKind::Color, say(form, one), fits.clone());
            if !is_trivial && head.fits.len() > 1 {
                let form = set.pick(&NOT_ONE);
                set.one(ReferringKind::NotColor, say(form, one), others.clone());
            }
        }
        let count = fits.as_ref().map_or(0, Vec::len);
        if head.generic {
            let form = set.pick(&GENERIC);
            set.many(ReferringKind::Color, say(form, ""), fits);
        } else if let Some(many) = head.many.as_ref().filter(|_| head.fits.len() > 1 && count != 1) {
            let form = set.pick(&MANY);
            set.many(ReferringKind::Color, say(form, many), fits);
        }
        let Some(many) = head.many.as_ref().filter(|_| !is_trivial && head.fits.len() > 2) else { continue };
        let form = set.pick(&NOT_MANY);
        set.many(ReferringKind::NotColor, say(form, many), others);
    }
}
