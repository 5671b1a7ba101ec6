//! From where and from how far to look: "from the other side", "from above", "up close".

use crate::agent::wish::{CLOSER, FARTHER, NORMAL, Side};
use crate::agent::words::ordinal;

/// What a clause says of the side and the closeness, and the words that remain.
pub(super) struct Looked<'a> {
    pub rest: Vec<&'a str>,
    pub side: Option<Side>,
    pub closeness: f64,
}

fn side_of(word: &str) -> Option<Side> {
    Some(match word {
        "other" | "opposite" | "far" | "back" | "rear" | "behind" => Side::Other,
        "left" => Side::Left,
        "right" => Side::Right,
        "above" | "top" | "overhead" | "atop" => Side::Above,
        "below" | "underneath" | "beneath" | "bottom" | "under" | "underside" => Side::Below,
        "front" => Side::Front,
        _ => return None,
    })
}

/// The side that begins here, as "from the other side" or "the other side of", with its length.
fn side_at(words: &[&str]) -> Option<(Side, usize)> {
    let mut i = 0;
    let from = match words.first()? {
        &"from" => true,
        &"on" | &"to" | &"around" | &"round" => false,
        &"the" | &"its" => {
            let (side, n) = named_side(&words[1..])?;
            return Some((side, n + 1));
        }
        _ => return named_side(words),
    };
    i += 1;
    while words.get(i).is_some_and(|w| ["to", "around", "on"].contains(w)) {
        i += 1;
    }
    if words.get(i).is_some_and(|w| ["the", "its", "directly", "right"].contains(w))
        && words.get(i + 1).is_some_and(|w| side_of(w).is_some())
    {
        i += 1;
    }
    let side = side_of(words.get(i)?)?;
    let said = words.get(i + 1).is_some_and(|w| *w == "side") || words.get(i + 1..i + 3) == Some(&["hand", "side"]);
    if !from && !said {
        return None;
    }
    i += 1;
    if words.get(i) == Some(&"hand") {
        i += 1;
    }
    if words.get(i) == Some(&"side") {
        i += 1;
    }
    Some((side, i))
}

/// "Other side", with "side" said.
fn named_side(words: &[&str]) -> Option<(Side, usize)> {
    let side = side_of(words.first()?)?;
    if words.get(1) == Some(&"side") {
        return Some((side, 2));
    }
    (words.get(1) == Some(&"hand") && words.get(2) == Some(&"side")).then_some((side, 3))
}

/// Takes side and closeness out of a clause.
pub(super) fn looked<'a>(words: &[&'a str]) -> Looked<'a> {
    const NEAR: [&str; 9] = [
        "from up close",
        "from close up",
        "from close by",
        "from nearby",
        "from very close",
        "close up",
        "up close",
        "closely",
        "in close-up",
    ];
    const FAR: [&str; 9] = [
        "from farther away",
        "from further away",
        "from far away",
        "from a distance",
        "from afar",
        "from farther",
        "from further back",
        "from further",
        "at a distance",
    ];
    let mut rest = words.to_vec();
    let mut closeness = NORMAL;
    for (phrases, value) in [(NEAR, CLOSER), (FAR, FARTHER)] {
        for phrase in phrases {
            let wanted: Vec<&str> = phrase.split(' ').collect();
            if let Some(at) = rest.windows(wanted.len()).position(|w| w == wanted) {
                rest.drain(at..at + wanted.len());
                closeness = value;
            }
        }
    }
    // "The second mug from the left" counts.
    let counts = rest.iter().any(|w| ordinal(w).is_some());
    let mut side = None;
    let found = (0..rest.len()).find_map(|i| Some((i, side_at(&rest[i..])?)));
    if let Some((at, (which, n))) = found.filter(|_| !counts) {
        let after = rest.get(at + n).copied();
        // "On the left side of the lamp" is where a thing stands, unless it is what is looked at.
        let is_place = after == Some("of") && ["on", "to"].contains(&rest[at]) && at > 0;
        if !is_place {
            side = Some(which);
            let of = usize::from(after == Some("of"));
            rest.drain(at..at + n + of);
        }
    }
    Looked { rest, side, closeness }
}

/// Whether a clause says nothing but a side or a closeness.
pub(super) fn is_side_only(words: &[&str]) -> bool {
    let looked = looked(words);
    let said = looked.side.is_some() || looked.closeness != NORMAL;
    said && looked
        .rest
        .iter()
        .all(|w| ["and", "then", "now", "also", "but", "this", "time", "instead", "it", "again"].contains(w))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_are_taken_out_of_a_clause() {
        let read = |text: &str| {
            let words: Vec<&str> = text.split(' ').collect();
            let l = looked(&words);
            (l.rest.join(" "), l.side, l.closeness)
        };
        assert_eq!(
            read("show me the kettle from the other side"),
            ("show me the kettle".into(), Some(Side::Other), 1.0)
        );
        assert_eq!(read("from above"), (String::new(), Some(Side::Above), 1.0));
        assert_eq!(read("show me the left side of the mug"), ("show me the mug".into(), Some(Side::Left), 1.0));
        assert_eq!(read("the mug up close"), ("the mug".into(), None, 2.0));
        assert_eq!(read("the second mug from the left").1, None);
        assert_eq!(read("the mug on the left side of the lamp").1, None);
        assert_eq!(read("the lid from the kettle").1, None);
        assert!(is_side_only(&["from", "the", "left"]) && !is_side_only(&["the", "mug", "from", "above"]));
    }
}
