//! Comparisons with things and with lengths.

use super::super::ReferringKind;
use super::super::clarity::Clarity;
use super::super::collect::SentenceSet;
use super::super::facts::MeshFacts;
use super::super::scope::{TruePhrase, TrueScope};

/// Comparison with a thing `{y}`.
struct TrueComparison {
    forms: &'static [&'static str],
    holds: fn(&MeshFacts, usize, usize) -> Clarity,
}

static COMPARISONS: [TrueComparison; 5] = [
    TrueComparison {
        forms: &["larger than {y}", "bigger than {y}", "of greater size than {y}", "clearly larger than {y}"],
        holds: MeshFacts::larger,
    },
    TrueComparison {
        forms: &["smaller than {y}", "littler than {y}", "not as big as {y}", "of smaller size than {y}"],
        holds: |f, a, b| f.larger(b, a),
    },
    TrueComparison {
        forms: &[
            "taller than {y}",
            "of greater height than {y}",
            "noticeably taller than {y}",
            "clearly taller than {y}",
        ],
        holds: MeshFacts::taller,
    },
    TrueComparison {
        forms: &[
            "less tall than {y}",
            "not as tall as {y}",
            "of smaller height than {y}",
            "clearly less tall than {y}",
        ],
        holds: |f, a, b| f.taller(b, a),
    },
    TrueComparison {
        forms: &[
            "longer than {y}",
            "of greater length than {y}",
            "noticeably longer than {y}",
            "clearly longer than {y}",
        ],
        holds: MeshFacts::longer,
    },
];

/// Comparison with a length `{v}`.
struct TrueLimit {
    forms: &'static [&'static str],
    holds: fn(&MeshFacts, usize, f64) -> Clarity,
    measure: fn(&MeshFacts, usize) -> f64,
}

static LIMITS: [TrueLimit; 4] = [
    TrueLimit {
        forms: &["taller than {v}", "more than {v} tall", "over {v} in height", "at least {v} tall"],
        holds: MeshFacts::taller_than,
        measure: |f, i| f.shapes[i].height,
    },
    TrueLimit {
        forms: &["less than {v} tall", "under {v} in height", "not taller than {v}", "at most {v} tall"],
        holds: |f, i, v| f.taller_than(i, v).inverse(),
        measure: |f, i| f.shapes[i].height,
    },
    TrueLimit {
        forms: &["longer than {v}", "more than {v} long", "over {v} in length", "at least {v} long"],
        holds: MeshFacts::longer_than,
        measure: |f, i| f.shapes[i].longest(),
    },
    TrueLimit {
        forms: &["less than {v} long", "under {v} in length", "not longer than {v}", "shorter than {v} in length"],
        holds: |f, i, v| f.longer_than(i, v).inverse(),
        measure: |f, i| f.shapes[i].longest(),
    },
];

/// Distance `{v}` from a thing `{y}`.
const WITHIN: [&str; 5] = [
    "within {v} of {y}",
    "less than {v} away from {y}",
    "at most {v} from {y}",
    "no further than {v} from {y}",
    "closer than {v} to {y}",
];

/// Ratio of neighboring sizes that leaves room for a limit between them.
const ROOM: f64 = 1.3;

pub(super) fn write(scope: &TrueScope, set: &mut SentenceSet) {
    let heads = [scope.things(), scope.object_nouns(false)].concat();
    for head in &heads {
        for (anchor, name) in scope.anchors(false) {
            let rest: Vec<usize> = head.fits.iter().copied().filter(|i| *i != anchor).collect();
            if rest.is_empty() {
                continue;
            }
            for comparison in &COMPARISONS {
                let fits = scope.among(&rest, |i| (comparison.holds)(&scope.facts, i, anchor));
                let form = set.pick(comparison.forms).replace("{y}", &format!("the {name}"));
                set.related(ReferringKind::Compare, head, &form, fits);
            }
            distances(scope, set, head, (anchor, name.as_str()), &rest);
        }
        lengths(scope, set, head);
    }
    for (whole, name) in scope.anchors(false) {
        let fits = scope.parts(whole);
        let [one, many] = ["part", "parts"].map(|word| Some(format!("{word} of the {name}")));
        if fits.len() > 1 {
            lengths(scope, set, &TruePhrase { one, many, fits, generic: false });
        }
    }
}

/// Writes about limits in the gaps between the sizes of a noun's things, and beyond all of them.
fn lengths(scope: &TrueScope, set: &mut SentenceSet, head: &TruePhrase) {
    for limit in &LIMITS {
        let mut sizes: Vec<f64> = head.fits.iter().map(|&i| (limit.measure)(&scope.facts, i)).collect();
        sizes.sort_by(f64::total_cmp);
        let (Some(least), Some(most)) = (sizes.first(), sizes.last()) else { continue };
        let gaps = sizes.windows(2).filter(|w| w[1] > ROOM * w[0]).map(|w| (w[0] * w[1]).sqrt());
        let limits: Vec<f64> = gaps.chain([0.6 * least, 1.6 * most]).collect();
        for value in set.some(&limits, 4).into_iter().map(round).filter(|v| *v > 0.0) {
            let fits = scope.among(&head.fits, |i| (limit.holds)(&scope.facts, i, value));
            let form = set.pick(limit.forms).replace("{v}", &written(set, value));
            set.related(ReferringKind::Length, head, &form, fits);
        }
    }
}

fn distances(scope: &TrueScope, set: &mut SentenceSet, head: &TruePhrase, anchor: (usize, &str), rest: &[usize]) {
    let mut middles: Vec<f64> = rest.iter().map(|&i| scope.facts.between_middles(i, anchor.0)).collect();
    middles.sort_by(f64::total_cmp);
    let limits: Vec<f64> = middles.iter().flat_map(|d| [1.2 * d, 0.5 * d]).map(round).filter(|v| *v > 0.0).collect();
    for value in set.some(&limits, 2) {
        let fits = scope.among(rest, |i| scope.facts.within(i, anchor.0, value));
        let form = set.pick(&WITHIN).replace("{v}", &written(set, value)).replace("{y}", &format!("the {}", anchor.1));
        set.related(ReferringKind::Length, head, &form, fits);
    }
}

/// Rounds a length in meters to what people say.
fn round(meters: f64) -> f64 {
    let step = if meters > 1.0 { 10.0 } else { 100.0 };
    (meters * step).round() / step
}

/// Length in words: centimeters, or meters from one on.
fn written(set: &mut SentenceSet, meters: f64) -> String {
    if meters >= 1.0 {
        let unit = set.pick(&[" m", " meters", " metres"]);
        return format!("{meters}{unit}");
    }
    let unit = set.pick(&[" cm", "cm", " centimeters", " centimetres"]);
    format!("{:.0}{unit}", meters * 100.0)
}
