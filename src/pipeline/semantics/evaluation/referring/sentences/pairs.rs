//! Between two things, around one, nearest to one.

use super::super::ReferringKind;
use super::super::collect::SentenceSet;
use super::super::scope::{TruePhrase, TrueScope};

const BETWEEN: [&str; 5] = [
    "between the {y} and the {z}",
    "in between the {y} and the {z}",
    "standing between the {y} and the {z}",
    "in the space between the {y} and the {z}",
    "somewhere between the {y} and the {z}",
];
const AROUND: [&str; 5] = ["around {y}", "all around {y}", "surrounding {y}", "round {y}", "grouped around {y}"];
const NEAREST: [&str; 5] = [
    "{x} nearest to {y}",
    "{x} closest to {y}",
    "nearest {x} to {y}",
    "closest {x} to {y}",
    "{x} at the smallest distance from {y}",
];
const FARTHEST: [&str; 4] = [
    "{x} farthest from {y}",
    "{x} furthest away from {y}",
    "most distant {x} from {y}",
    "{x} that is farthest from {y}",
];
/// Ratio of the nearest distance to the next that is clear, by surfaces and by middles.
const CLEAR: f64 = 0.8;
const ALSO: f64 = 0.95;
/// Pairs of things for each phrase.
const PAIRS: usize = 12;

pub(super) fn write(scope: &TrueScope, set: &mut SentenceSet) {
    let anchors = scope.anchors(false);
    let mut pairs = Vec::new();
    for (i, a) in anchors.iter().enumerate() {
        pairs.extend(anchors[i + 1..].iter().filter(|b| b.0 != a.0).map(|b| (a.clone(), b.clone())));
    }
    for head in [scope.things(), scope.object_nouns(false)].concat() {
        for (y, z) in set.some(&pairs, PAIRS) {
            let rest: Vec<usize> = head.fits.iter().copied().filter(|i| *i != y.0 && *i != z.0).collect();
            if !rest.is_empty() {
                let fits = scope.among(&rest, |i| scope.facts.between(i, y.0, z.0));
                let tail = set.pick(&BETWEEN).replace("{y}", &y.1).replace("{z}", &z.1);
                set.related(ReferringKind::Between, &head, &tail, fits);
            }
        }
        for (anchor, name) in &anchors {
            let rest: Vec<usize> = head.fits.iter().copied().filter(|i| i != anchor).collect();
            let of = format!("the {name}");
            around(scope, set, &head, (*anchor, of.as_str()), &rest);
            if rest.len() > 1 {
                extremes(scope, set, &head, (*anchor, of.as_str()), &rest);
            }
        }
    }
}

fn around(scope: &TrueScope, set: &mut SentenceSet, head: &TruePhrase, anchor: (usize, &str), rest: &[usize]) {
    let Some(many) = head.many.as_ref().filter(|_| rest.len() > 1) else { return };
    let fits = scope.among(rest, |i| scope.facts.around(i, anchor.0));
    // "The mugs around the kettle" are several or none.
    if fits.as_ref().is_some_and(|fits| fits.len() == 1) {
        return;
    }
    let tail = set.pick(&AROUND).replace("{y}", anchor.1);
    let all = set.pick(&["all {} ", "the {} ", "all the {} "]).replace("{}", many);
    set.many(ReferringKind::Around, all + &tail, fits);
}

/// Writes about the nearest and the farthest thing.
fn extremes(scope: &TrueScope, set: &mut SentenceSet, head: &TruePhrase, anchor: (usize, &str), rest: &[usize]) {
    let Some(one) = &head.one else { return };
    for form in set.some(&NEAREST, 2) {
        let text = form.replace("{x}", one).replace("{y}", anchor.1);
        set.one(ReferringKind::Nearest, format!("the {text}"), nearest(scope, anchor.0, rest).map(|i| vec![i]));
    }
    let form = set.pick(&FARTHEST).replace("{x}", one).replace("{y}", anchor.1);
    set.one(ReferringKind::Nearest, format!("the {form}"), farthest(scope, anchor.0, rest).map(|i| vec![i]));
}

/// Thing nearest to another, if it is clearly so.
pub(super) fn nearest(scope: &TrueScope, anchor: usize, things: &[usize]) -> Option<usize> {
    let by_gap = |i: usize| scope.facts.gap(i, anchor).unwrap_or(f64::NAN);
    let by_middle = |i: usize| scope.facts.between_middles(i, anchor);
    let best = things.iter().copied().min_by(|a, b| by_gap(*a).total_cmp(&by_gap(*b)))?;
    let others = || things.iter().copied().filter(|i| *i != best);
    let is_nearer = |i: usize| by_gap(i) > 0.0 && by_gap(best) <= CLEAR * by_gap(i);
    let clear = others().all(|i| is_nearer(i) && by_middle(best) <= ALSO * by_middle(i));
    clear.then_some(best)
}

/// Thing farthest from another, if it is clearly so.
fn farthest(scope: &TrueScope, anchor: usize, things: &[usize]) -> Option<usize> {
    let by_gap = |i: usize| scope.facts.gap(i, anchor).unwrap_or(f64::NAN);
    let by_middle = |i: usize| scope.facts.between_middles(i, anchor);
    let best = things.iter().copied().max_by(|a, b| by_gap(*a).total_cmp(&by_gap(*b)))?;
    let others = || things.iter().copied().filter(|i| *i != best);
    let clear = others().all(|i| by_gap(i) <= ALSO * by_gap(best) && by_middle(i) <= ALSO * by_middle(best));
    clear.then_some(best)
}
