//! Objects by their names, and parts by theirs and their wholes'.

use super::super::ReferringKind;
use super::super::collect::SentenceSet;
use super::super::names::a;
use super::super::scope::{TruePhrase, TrueScope};

/// A part `{p}` of a whole `{w}`.
const OF: [&str; 6] = [
    "the {p} of the {w}",
    "the {s} {p}",
    "the {w} {p}",
    "the {p} that belongs to the {w}",
    "the {p} which is part of the {w}",
    "the {w}, just its {p}",
];
/// Wordings of each part, as far as there are some.
const WORDINGS: usize = 3;

pub(super) fn write(scope: &TrueScope, set: &mut SentenceSet) {
    for noun in &scope.nouns {
        let kind = if scope.is_object(noun.fits[0]) { ReferringKind::Name } else { ReferringKind::Part };
        named(set, kind, noun);
    }
    for whole in scope.object_nouns(true) {
        let parts: Vec<usize> = whole.fits.iter().flat_map(|&w| scope.parts(w)).collect();
        for part in scope.nouns_of(&parts) {
            for form in set.some(&OF, WORDINGS) {
                let text = of(form, part.name(), whole.name());
                match part.one {
                    Some(_) => set.one(ReferringKind::Part, text, Some(part.fits.clone())),
                    None => set.many(
                        ReferringKind::Part,
                        text.replace("belongs", "belong").replace("is part", "are part"),
                        Some(part.fits.clone()),
                    ),
                }
            }
        }
    }
}

/// Names a part of a whole: "the lid of the kettle".
pub(super) fn of(form: &str, part: &str, whole: &str) -> String {
    form.replace("{s}", &possessive(whole)).replace("{p}", part).replace("{w}", whole)
}

fn possessive(noun: &str) -> String {
    format!("{noun}{}", if noun.ends_with('s') { "'" } else { "'s" })
}

fn named(set: &mut SentenceSet, kind: ReferringKind, noun: &TruePhrase) {
    let fits = || Some(noun.fits.clone());
    let Some(one) = &noun.one else {
        // Plural names of single things: the headphones, the legs of one table.
        if let (1, Some(many)) = (noun.fits.len(), &noun.many) {
            set.many(kind, format!("the {many}"), fits());
            set.many(kind, many.clone(), fits());
        }
        return;
    };
    set.one(kind, format!("the {one}"), fits());
    set.one(kind, one.clone(), fits());
    set.one(kind, a(one), fits());
    set.one(kind, format!("that {one}"), fits());
    if one.contains("grey") {
        set.one(kind, format!("the {}", one.replace("grey", "gray")), fits());
    }
}
