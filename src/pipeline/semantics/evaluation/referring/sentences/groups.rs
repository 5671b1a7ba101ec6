//! Plurals, all, numbers, and, or, except.

use super::super::ReferringKind;
use super::super::collect::SentenceSet;
use super::super::names::{NUMBERS, a};
use super::super::scope::{TruePhrase, TrueScope};

/// Pairs of things that are joined by "and" and by "or".
const PAIRS: usize = 60;
/// All `{many}`, or every `{one}`, without `{x}`.
const EXCEPT: [&str; 6] = [
    "all {many} except {x}",
    "every {one} apart from {x}",
    "the {many} but not {x}",
    "all {many} other than {x}",
    "each {one} excluding {x}",
    "all the {many} with the exception of {x}",
];

pub(super) fn write(scope: &TrueScope, set: &mut SentenceSet) {
    for noun in &scope.nouns {
        group(set, noun, "");
        except_members(scope, set, noun);
    }
    for (whole, name) in scope.anchors(true) {
        parts(scope, set, whole, &name);
    }
    for wholes in scope.object_nouns(true).iter().filter(|n| n.fits.len() > 1) {
        let parts: Vec<usize> = wholes.fits.iter().flat_map(|&w| scope.parts(w)).collect();
        let Some(many) = &wholes.many else { continue };
        scope.nouns_of(&parts).iter().for_each(|noun| group(set, noun, &format!(" of the {many}")));
    }
    joined(scope, set);
    except_on_carriers(scope, set);
}

/// Writes about all things of a noun; `tail` follows it.
fn group(set: &mut SentenceSet, noun: &TruePhrase, tail: &str) {
    let Some(many) = noun.many.as_ref().filter(|_| noun.fits.len() > 1) else { return };
    let fits = || Some(noun.fits.clone());
    for form in ["the {}", "{}", "those {}", "the various {}"] {
        set.many(ReferringKind::Plural, form.replace("{}", &format!("{many}{tail}")), fits());
    }
    for form in ["all {}", "all the {}", "all of the {}", "each and every one of the {}"] {
        set.many(ReferringKind::All, form.replace("{}", &format!("{many}{tail}")), fits());
    }
    let Some(one) = &noun.one else { return };
    set.many(ReferringKind::All, format!("every {one}{tail}"), fits());
    set.many(ReferringKind::All, format!("each {one}{tail}"), fits());
    let count = noun.fits.len();
    if let Some(number) = NUMBERS.get(count) {
        for form in ["the {n} {}", "{n} {}", "all {n} {}"] {
            set.many(ReferringKind::Number, counted(form, number, many, tail), fits());
        }
        if count == 2 {
            set.many(ReferringKind::Number, format!("both {many}{tail}"), fits());
            set.many(ReferringKind::Number, format!("the pair of {many}{tail}"), fits());
        }
    }
    for number in [count + 2, count + 4].iter().filter_map(|n| NUMBERS.get(*n)) {
        let form = set.pick(&["the {n} {}", "all {n} {}"]);
        set.many(ReferringKind::Number, counted(form, number, many, tail), Some(Vec::new()));
    }
}

fn counted(form: &str, number: &str, many: &str, tail: &str) -> String {
    form.replace("{n}", number).replace("{}", many) + tail
}

fn parts(scope: &TrueScope, set: &mut SentenceSet, whole: usize, name: &str) {
    let (all, nouns) = (scope.parts(whole), scope.nouns_of(&scope.parts(whole)));
    let tail = format!(" of the {name}");
    nouns.iter().for_each(|noun| group(set, noun, &tail));
    for noun in nouns.iter().filter(|n| n.fits.len() > 1 && n.one.is_some()) {
        let Some(one) = &noun.one else { continue };
        set.one(ReferringKind::Part, format!("{}{tail}", a(one)), Some(noun.fits.clone()));
        set.one(ReferringKind::Part, format!("one {one}{tail}"), Some(noun.fits.clone()));
    }
    if all.len() < 2 {
        return;
    }
    for form in ["all parts", "every part", "all the pieces", "each part", "all of the parts"] {
        set.many(ReferringKind::All, format!("{form}{tail}"), Some(all.clone()));
    }
    for left_out in &nouns {
        let rest: Vec<usize> = all.iter().copied().filter(|i| !left_out.fits.contains(i)).collect();
        let several = left_out.fits.len() > 1 && left_out.one.is_some();
        let name = if several { left_out.many.as_deref() } else { Some(left_out.name()) };
        let Some(name) = name.filter(|_| !rest.is_empty()) else { continue };
        let form = set.pick(&EXCEPT).replace("{many}", &format!("parts{tail}"));
        let text = form.replace("{one}", &format!("part{tail}")).replace("{x}", &format!("the {name}"));
        set.many(ReferringKind::Except, text, Some(rest));
    }
    for noun in nouns.iter().filter(|n| n.fits.len() > 2) {
        let (Some(one), Some(many)) = (&noun.one, &noun.many) else { continue };
        let single = nouns.iter().filter(|n| n.fits.len() == 1 && noun.fits.contains(&n.fits[0]));
        for left_out in single {
            let rest = noun.fits.iter().copied().filter(|i| *i != left_out.fits[0]).collect();
            let form = set.pick(&EXCEPT).replace("{many}", &format!("{many}{tail}"));
            let text = form.replace("{one}", &format!("{one}{tail}"));
            set.many(ReferringKind::Except, text.replace("{x}", &format!("the {}", left_out.name())), Some(rest));
        }
    }
}

/// Writes "all mugs except the black one".
fn except_members(scope: &TrueScope, set: &mut SentenceSet, noun: &TruePhrase) {
    let (Some(one), Some(many)) = (&noun.one, &noun.many) else { return };
    if noun.fits.len() < 2 || !scope.is_object(noun.fits[0]) {
        return;
    }
    for (thing, name) in scope.anchors(true).into_iter().filter(|(i, _)| noun.fits.contains(i)) {
        let rest: Vec<usize> = noun.fits.iter().copied().filter(|i| *i != thing).collect();
        let prefix = name.strip_suffix(one.as_str()).map(str::trim).filter(|p| !p.is_empty());
        let short = prefix.map(|p| format!("the {p} one"));
        for left_out in [Some(format!("the {name}")), short].into_iter().flatten() {
            for form in set.some(&EXCEPT, 4) {
                let text = form.replace("{many}", many).replace("{one}", one).replace("{x}", &left_out);
                set.many(ReferringKind::Except, text, Some(rest.clone()));
            }
        }
    }
}

/// Writes "everything on the table except the mug".
fn except_on_carriers(scope: &TrueScope, set: &mut SentenceSet) {
    let Some(things) = scope.things().into_iter().next() else { return };
    let carriers = scope.anchors(true).into_iter().filter(|(i, _)| scope.carriers().contains(i));
    for (carrier, name) in carriers {
        for noun in scope.object_nouns(false) {
            let rest: Vec<usize> = things.fits.iter().copied().filter(|i| !noun.fits.contains(i)).collect();
            let fits = scope.among(&rest, |i| scope.facts.on(i, carrier));
            let left_out = if noun.fits.len() > 1 { noun.many.as_deref() } else { Some(noun.name()) };
            let Some(left_out) = left_out else { continue };
            let form = set.pick(&[
                "everything on the {c} except the {x}",
                "everything on the {c} but the {x}",
                "all objects on the {c} apart from the {x}",
                "all the things on the {c}, excluding the {x}",
                "what is on the {c}, without the {x}",
            ]);
            set.many(ReferringKind::Except, form.replace("{c}", &name).replace("{x}", left_out), fits);
        }
    }
}

/// Joins things, and parts of one thing, by "and" and "or".
fn joined(scope: &TrueScope, set: &mut SentenceSet) {
    let objects = scope.anchors(true);
    let mut sets = vec![(objects, String::new())];
    for (whole, name) in scope.anchors(true) {
        let nouns = scope.nouns_of(&scope.parts(whole));
        let single = nouns.iter().filter(|n| n.fits.len() == 1).map(|n| (n.fits[0], n.name().to_owned()));
        sets.push((single.collect(), format!(" of the {name}")));
    }
    for (names, tail) in sets {
        let mut pairs = Vec::new();
        for (i, x) in names.iter().enumerate() {
            pairs.extend(names[i + 1..].iter().filter(|y| y.0 != x.0).map(|y| (x.clone(), y.clone())));
        }
        let most = if tail.is_empty() { PAIRS } else { PAIRS / 10 };
        for ((i, x), (j, y)) in set.some(&pairs, most) {
            let and = set.pick(&[
                "the {x} and the {y}",
                "both the {x} and the {y}",
                "the {x} as well as the {y}",
                "the {x} together with the {y}",
                "the {x} plus the {y}",
            ]);
            let text = and.replace("{x}", &x).replace("{y}", &y) + &tail;
            set.many(ReferringKind::And, text, Some(vec![i, j]));
            let or = set.pick(&[
                "the {x} or the {y}",
                "either the {x} or the {y}",
                "the {x} or else the {y}",
                "one of these: the {x}, the {y}",
            ]);
            let text = or.replace("{x}", &x).replace("{y}", &y) + &tail;
            set.one(ReferringKind::Or, text, Some(vec![i, j]));
        }
        if tail.is_empty() {
            lists(set, &names);
        }
    }
    let kinds = scope.object_nouns(false).into_iter().filter(|n| n.fits.len() > 1).collect::<Vec<_>>();
    for noun in &kinds {
        for (i, name) in scope.anchors(false).into_iter().filter(|(i, _)| !noun.fits.contains(i)) {
            let Some(many) = &noun.many else { continue };
            let fits = || Some([&noun.fits[..], &[i]].concat());
            set.many(ReferringKind::And, format!("all {many} and the {name}"), fits());
            if let Some(one) = &noun.one {
                set.many(ReferringKind::Or, format!("everything that is {} or {}", a(one), a(&name)), fits());
            }
        }
    }
}

/// Names three things at once.
fn lists(set: &mut SentenceSet, names: &[(usize, String)]) {
    for _ in 0..PAIRS / 3 {
        let three = set.some(names, 3);
        let [(i, x), (j, y), (k, z)] = &three[..] else { return };
        if i != j && j != k && i != k {
            set.many(ReferringKind::And, format!("the {x}, the {y} and the {z}"), Some(vec![*i, *j, *k]));
        }
    }
}
