//! Superlatives and ordinals: largest, tallest, leftmost, second from the left.

use super::super::ReferringKind;
use super::super::collect::SentenceSet;
use super::super::facts::{MeshFacts, ViewReading};
use super::super::scope::{TruePhrase, TrueScope};

/// Ratios of volumes and of lengths that tell two sizes apart (8 % of length).
const VOLUMES: f64 = 1.26;
const LENGTHS: f64 = 1.08;
/// Share of the spread of positions that tells two of them apart.
const POSITIONS: f64 = 0.08;

/// Order of things.
pub(super) struct TrueOrder {
    pub(super) kind: ReferringKind,
    /// Superlatives `{}`, of a noun: "largest {}".
    pub(super) forms: &'static [&'static str],
    /// Predicates of questions: "the largest".
    pub(super) predicates: &'static [&'static str],
    /// Ordinals `{n}` of a noun.
    ordinals: &'static [&'static str],
    /// Readings of the order, least first, by which a thing must have the same rank.
    keys: fn(&MeshFacts, usize) -> Vec<f64>,
    /// Least ratio of sizes, of which the first reading is the logarithm; `None` for a share of the spread.
    margin: Option<f64>,
}

/// Orders that sentences use.
pub(super) static ORDERS: [TrueOrder; 8] = [
    TrueOrder {
        kind: ReferringKind::Largest,
        forms: &["largest {}", "biggest {}", "{} that is the largest", "very biggest {}", "{} of the greatest size"],
        predicates: &["the largest", "the biggest"],
        ordinals: &["{n} largest {}", "{n} biggest {}"],
        keys: |f, i| vec![-f.shapes[i].volume().ln(), -f.shapes[i].diagonal()],
        margin: Some(VOLUMES),
    },
    TrueOrder {
        kind: ReferringKind::Smallest,
        forms: &["smallest {}", "tiniest {}", "littlest {}", "{} that is the smallest", "very smallest {}"],
        predicates: &["the smallest", "the tiniest"],
        ordinals: &["{n} smallest {}"],
        keys: |f, i| vec![f.shapes[i].volume().ln(), f.shapes[i].diagonal()],
        margin: Some(VOLUMES),
    },
    TrueOrder {
        kind: ReferringKind::Tallest,
        forms: &["tallest {}", "{} that is the tallest", "{} with the greatest height", "{} which stands tallest"],
        predicates: &["the tallest"],
        ordinals: &["{n} tallest {}", "{n}-tallest {}"],
        keys: |f, i| vec![-f.shapes[i].height.ln()],
        margin: Some(LENGTHS),
    },
    TrueOrder {
        kind: ReferringKind::Longest,
        forms: &["longest {}", "{} that is the longest", "{} with the greatest length", "{} of the greatest length"],
        predicates: &["the longest"],
        ordinals: &["{n} longest {}"],
        keys: |f, i| vec![-f.shapes[i].longest().ln(), -f.shapes[i].length],
        margin: Some(LENGTHS),
    },
    TrueOrder {
        kind: ReferringKind::Leftmost,
        forms: &["leftmost {}", "{} furthest to the left", "{} on the far left", "{} that is farthest left"],
        predicates: &["furthest to the left", "the leftmost"],
        ordinals: &["{n} {} from the left", "{n} {} counting from the left"],
        keys: |f, i| sideways(f, i).to_vec(),
        margin: None,
    },
    TrueOrder {
        kind: ReferringKind::Rightmost,
        forms: &["rightmost {}", "{} furthest to the right", "{} on the far right", "{} that is farthest right"],
        predicates: &["furthest to the right", "the rightmost"],
        ordinals: &["{n} {} from the right", "{n} {} counting from the right"],
        keys: |f, i| sideways(f, i).map(|x| -x).to_vec(),
        margin: None,
    },
    TrueOrder {
        kind: ReferringKind::Closest,
        forms: &["{} closest to me", "{} nearest to me", "{} that is nearest to the viewer", "frontmost {}"],
        predicates: &["closest to me", "the nearest to me"],
        ordinals: &["{n} closest {} to me", "{n} nearest {} to me"],
        keys: |f, i| away(f, i).to_vec(),
        margin: None,
    },
    TrueOrder {
        kind: ReferringKind::Farthest,
        forms: &["{} farthest from me", "{} furthest away from me", "{} that is most distant", "{} at the very back"],
        predicates: &["farthest away from me", "the most distant"],
        ordinals: &["{n} farthest {} from me", "{n} furthest {} from me"],
        keys: |f, i| away(f, i).map(|x| -x).to_vec(),
        margin: None,
    },
];

/// Ordinal numbers from the second.
const ORDINALS: [&str; 5] = ["second", "third", "fourth", "fifth", "sixth"];

fn sideways(facts: &MeshFacts, thing: usize) -> [f64; 3] {
    let [axis, angle] = [ViewReading::Right, ViewReading::Angle].map(|reading| facts.span(thing, reading));
    [axis.middle(), angle.middle(), axis.low]
}

fn away(facts: &MeshFacts, thing: usize) -> [f64; 3] {
    let [ahead, distance] = [ViewReading::Ahead, ViewReading::Distance].map(|reading| facts.span(thing, reading));
    [ahead.middle(), distance.middle(), facts.distance_to_eye(thing)]
}

impl TrueOrder {
    /// Thing at a rank, from 0; `None` if readings differ or a neighbor is too near.
    pub(super) fn at(&self, scope: &TrueScope, things: &[usize], rank: usize) -> Option<usize> {
        let keys: Vec<Vec<f64>> = things.iter().map(|&i| (self.keys)(&scope.facts, i)).collect();
        let order = |reading: usize| {
            let mut order: Vec<usize> = (0..things.len()).collect();
            order.sort_by(|a, b| keys[*a][reading].total_cmp(&keys[*b][reading]));
            order
        };
        let first = order(0);
        let value = |rank: usize| first.get(rank).map(|i| keys[*i][0]);
        let spread = value(things.len().checked_sub(1)?)? - value(0)?;
        let margin = self.margin.map_or(POSITIONS * spread, f64::ln);
        let apart = |a: Option<f64>, b: Option<f64>| a.zip(b).is_none_or(|(a, b)| b - a >= margin && b > a);
        let before = rank.checked_sub(1).and_then(value);
        let clear = apart(before, value(rank)) && apart(value(rank), value(rank + 1));
        let readings = keys.first().map_or(0, Vec::len);
        let agreed = (1..readings).all(|reading| order(reading).get(rank) == first.get(rank));
        first.get(rank).filter(|_| clear && agreed).map(|i| things[*i])
    }

    /// Things that have the first rank: one, or `None` if that is unclear; none of none.
    pub(super) fn best(&self, scope: &TrueScope, things: &[usize]) -> Option<Vec<usize>> {
        if things.is_empty() { Some(Vec::new()) } else { self.at(scope, things, 0).map(|i| vec![i]) }
    }
}

pub(super) fn write(scope: &TrueScope, set: &mut SentenceSet) {
    let objects = [scope.things(), scope.object_nouns(false)].concat();
    for head in objects.iter().filter(|h| h.fits.len() > 1) {
        superlatives(scope, set, head, "");
        ordinals(scope, set, head);
    }
    for (whole, name) in scope.anchors(true) {
        let tail = format!(" of the {name}");
        let parts = scope.parts(whole);
        let part = TruePhrase { one: Some("part".into()), many: None, fits: parts.clone(), generic: false };
        for head in std::iter::once(part).chain(scope.nouns_of(&parts)).filter(|h| h.fits.len() > 1) {
            superlatives(scope, set, &head, &tail);
        }
    }
}

fn superlatives(scope: &TrueScope, set: &mut SentenceSet, head: &TruePhrase, tail: &str) {
    let Some(one) = &head.one else { return };
    for order in &ORDERS {
        let fits = order.best(scope, &head.fits);
        for form in set.some(order.forms, 3) {
            set.one(order.kind, format!("the {}", form.replace("{}", &format!("{one}{tail}"))), fits.clone());
        }
        let Some(many) = head.many.as_ref().filter(|_| !head.generic && tail.is_empty()) else { continue };
        let of = set.pick(order.predicates);
        set.ask_one(order.kind, format!("Of all {many}, which one is {of}?"), fits);
    }
}

fn ordinals(scope: &TrueScope, set: &mut SentenceSet, head: &TruePhrase) {
    let Some(one) = &head.one else { return };
    for order in &ORDERS {
        for (k, number) in ORDINALS.iter().enumerate() {
            let rank = k + 1;
            let fits = if rank < head.fits.len() {
                order.at(scope, &head.fits, rank).map(|i| vec![i])
            } else if head.generic || rank == head.fits.len() {
                // The third of two; that many things are not counted at a glance.
                Some(Vec::new())
            } else {
                continue;
            };
            let form = set.pick(order.ordinals);
            let text = form.replace("{n}", number).replace("{}", one);
            set.one(ReferringKind::Ordinal, format!("the {text}"), fits);
        }
    }
}
