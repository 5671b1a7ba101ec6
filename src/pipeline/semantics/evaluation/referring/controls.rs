//! Controls: expressions and identities that are wrong on purpose, which a measurement must notice.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_pcg::Pcg32;

use super::Referring;
use crate::pipeline::synth::TrueIdentity;
use crate::scene::Level;

/// Words of opposite relations. Each stands for the other; the longest that fits wins.
const OPPOSITES: [(&str, &str); 33] = [
    ("on the left-hand side of", "on the right-hand side of"),
    ("to the left of", "to the right of"),
    ("on the left of", "on the right of"),
    ("left of", "right of"),
    ("from the left", "from the right"),
    ("to the left", "to the right"),
    ("on the far left", "on the far right"),
    ("farthest left", "farthest right"),
    ("leftmost", "rightmost"),
    ("in front of", "behind"),
    ("nearer to me than", "farther away than"),
    ("closer to the viewer than", "further away from me than"),
    ("standing before", "in back of"),
    ("closest to me", "farthest from me"),
    ("nearest to me", "furthest away from me"),
    ("nearest to the viewer", "most distant"),
    ("frontmost", "hindmost"),
    ("largest", "smallest"),
    ("biggest", "tiniest"),
    ("larger than", "smaller than"),
    ("bigger than", "littler than"),
    ("taller than", "less tall than"),
    ("of greater height than", "of smaller height than"),
    ("nearest to", "farthest from"),
    ("closest to", "furthest away from"),
    ("on top of", "underneath"),
    ("on the", "under the"),
    ("resting on", "beneath"),
    ("above", "below"),
    ("more than", "less than"),
    ("over", "under"),
    ("longer than", "not longer than"),
    ("closest", "farthest"),
];

/// Exchanges left and right, front and behind, largest and smallest, on and under in the texts, and keeps the truths.
/// Only expressions that this changes are returned.
pub(crate) fn exchanged(expressions: &[Referring]) -> Vec<Referring> {
    let changed = expressions.iter().map(|e| Referring { text: exchange(&e.text), ..e.clone() });
    changed.zip(expressions).filter(|(new, old)| new.text != old.text).map(|(new, _)| new).collect()
}

/// Gives objects the names of other objects, and parts those of other parts.
pub(crate) fn shuffled(identities: &[TrueIdentity], seed: u64) -> Vec<TrueIdentity> {
    let mut rng = Pcg32::seed_from_u64(seed);
    let mut renamed = identities.to_vec();
    for level in [Level::Object, Level::Part] {
        let mut order: Vec<usize> = (0..identities.len()).filter(|&i| identities[i].level == level).collect();
        order.shuffle(&mut rng);
        for (k, &i) in order.iter().enumerate() {
            renamed[i].name.clone_from(&identities[order[(k + 1) % order.len()]].name);
        }
    }
    renamed
}

fn exchange(text: &str) -> String {
    let both = || OPPOSITES.iter().flat_map(|&(a, b)| [(a, b), (b, a)]);
    let ends = |rest: &str| !rest.starts_with(char::is_alphanumeric);
    let (mut out, mut rest, mut begins) = (String::new(), text, true);
    while let Some(c) = rest.chars().next() {
        let found = both().filter(|(from, _)| begins && rest.strip_prefix(*from).is_some_and(ends));
        match found.max_by_key(|(from, _)| from.len()) {
            Some((from, to)) => {
                out.push_str(to);
                rest = &rest[from.len()..];
                begins = false;
            }
            None => {
                out.push(c);
                rest = &rest[c.len_utf8()..];
                begins = !c.is_alphanumeric();
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::{ReferringKind, ReferringTruth};
    use super::*;

    #[test]
    fn relations_are_exchanged_and_names_are_not() {
        for (text, other) in [
            ("the mug left of the kettle", "the mug right of the kettle"),
            ("the largest thing behind the left ear", "the smallest thing in front of the left ear"),
            ("everything standing on the table", "everything standing under the table"),
            ("the button on the left of it", "the button on the right of it"),
            ("the third mug from the left", "the third mug from the right"),
        ] {
            assert_eq!(exchange(text), other);
            assert_eq!(exchange(other), text, "twice is as before");
        }
        for text in ["the left ear of the teddy bear", "the cover of the book", "a moreover", ""] {
            assert_eq!(exchange(text), text);
        }
        let all = |text: &str| Referring {
            text: text.into(),
            kind: ReferringKind::Name,
            truth: ReferringTruth::All(vec![1]),
        };
        let changed = exchanged(&[all("the mug"), all("the leftmost mug")]);
        assert_eq!(changed, [all("the rightmost mug")]);
    }

    #[test]
    fn nobody_keeps_a_name() {
        let identity = |id: u16, level, name: &str| TrueIdentity {
            id,
            name: name.into(),
            level,
            parent: None,
            path: name.into(),
            color: [0; 3],
            pixels: 0,
            views: 0,
        };
        let objects = ["mug", "lamp", "book", "kettle"].iter().zip(1..).map(|(n, i)| identity(i, Level::Object, n));
        let parts = ["lid", "knob"].iter().zip(5..).map(|(n, i)| identity(i, Level::Part, n));
        let all: Vec<TrueIdentity> = objects.chain(parts).collect();
        for seed in 0..20 {
            let renamed = shuffled(&all, seed);
            assert!(all.iter().zip(&renamed).all(|(a, b)| a.name != b.name && a.id == b.id));
            let mut names: Vec<&str> = renamed[4..].iter().map(|i| i.name.as_str()).collect();
            names.sort_unstable();
            assert_eq!(names, ["knob", "lid"], "parts stay parts");
        }
        assert!(shuffled(&[], 1).is_empty());
    }
}
