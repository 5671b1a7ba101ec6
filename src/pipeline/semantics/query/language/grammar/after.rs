//! Words after a noun: "left of the lamp", "with a handle", "that are not red", "over 20 cm tall".

use super::Grammar;
use super::lengths::{is_eye, length, said_at_length};
use crate::pipeline::semantics::query::language::expression::{Condition, Expression, OrderBy, Relation, SetOf};
use crate::pipeline::semantics::query::language::words::WordClass;
use crate::scene::colors;

/// Returns the readings of a noun (words `i` to `k`) with all words up to `j` said of it. With `said`, a verb was there
/// already: "the mug is red".
pub(super) fn after(
    g: &mut Grammar<'_>,
    noun: &Expression,
    i: usize,
    k: usize,
    j: usize,
    said: bool,
) -> Vec<Expression> {
    if k == j {
        return vec![noun.clone()];
    }
    let mut at = k;
    let (mut said, mut not, mut closely) = (said, false, false);
    // "that is not directly".
    while at < j {
        let word = g.words[at];
        if matches!(word, "not" | "neither") {
            not = !not;
        } else if word == "," && at + 1 < j && matches!(g.words[at + 1], "which" | "that" | "who") {
            // The clause follows.
        } else if g.is(WordClass::Standing, at) && !is_side(g, at, j) {
            said |= matches!(word, "is" | "are" | "was" | "were" | "that" | "which" | "who");
            closely |= matches!(word, "directly" | "immediately" | "right" | "just");
            if disagrees(g, noun, word) {
                return Vec::new();
            }
        } else {
            break;
        }
        at += 1;
    }
    let (mut found, mut close) = (Vec::new(), Vec::new());
    let mut add = |g: &mut Grammar<'_>, is: Condition, not: bool, end: usize| {
        let set = SetOf::Where { of: Box::new(noun.clone()), is, not };
        let made = g.make(set, i, end);
        found.extend(further(g, &made, i, end, j));
    };
    if at >= j {
        // "The mugs that are here".
        return if at > k && !not { vec![noun.clone()] } else { Vec::new() };
    }
    if let Some(n) = g.vocabulary.here(&g.words[at..j]).filter(|_| !not) {
        found.extend(further(g, noun, i, at + n, j));
        return if found.is_empty() && at + n == j { vec![noun.clone()] } else { found };
    }
    while matches!(g.words[at], "somewhere" | "midway" | "halfway") && at + 1 < j {
        at += 1;
    }
    at += match g.words[at..j] {
        ["in", "between", ..] => 1,
        ["in", "the", "space" | "middle" | "gap", "between" | "of", ..] if g.words[at + 3] == "between" => 3,
        _ => 0,
    };
    let rest = g.words[at..j].to_vec();
    match rest.as_slice() {
        ["does", "not", "have", ..] | ["do", "not", "have", ..] => having(g, at + 3, j, true, &mut add),
        ["has" | "have", "got", "no", ..] => having(g, at + 3, j, true, &mut add),
        ["has" | "have", "got", ..] => having(g, at + 2, j, not, &mut add),
        ["has" | "have", "no", ..] => having(g, at + 2, j, true, &mut add),
        ["with", "no", ..] => having(g, at + 2, j, true, &mut add),
        ["with" | "has" | "have" | "having" | "containing" | "holding" | "contains" | "holds" | "carrying", ..] => {
            having(g, at + 1, j, not, &mut add);
        }
        ["belongs" | "belonging" | "belong", "to", ..] => {
            for end in (at + 3..=j).rev() {
                for whole in g.set(at + 2, end, true).to_vec() {
                    add(g, Condition::Placed(Relation::PartOf, Box::new(whole)), not, end);
                }
            }
        }
        ["without" | "lacking", ..] => having(g, at + 1, j, !not, &mut add),
        ["whose", "color" | "colour", "is", ..] | ["in" | "of", "color" | "colour", ..] if rest.len() > 2 => {
            let skip = if rest[0] == "whose" { 3 } else { 2 };
            if let Some(color) = rest.get(skip).filter(|w| colors::row(w).is_some()) {
                add(g, Condition::Adjective(vec![(*color).to_owned()]), not, at + skip + 1);
            }
        }
        ["of" | "in", "any", "color" | "colour", "but" | "except", color, ..] if colors::row(color).is_some() => {
            add(g, Condition::Adjective(vec![(*color).to_owned()]), !not, at + 5);
        }
        ["between", ..] => {
            for end in (at + 4..=j).rev() {
                for mid in at + 2..end - 1 {
                    if g.words[mid] != "and" {
                        continue;
                    }
                    let (a, b) = (g.set(at + 1, mid, false), g.set(mid + 1, end, false));
                    for (a, b) in super::pairs(&a, &b) {
                        add(g, Condition::Between(Box::new(a), Box::new(b)), not, end);
                    }
                }
                for both in g.set(at + 1, end, true).iter().filter(|e| e.is_plural()).cloned().collect::<Vec<_>>() {
                    if !matches!(both.set, SetOf::Union { .. }) {
                        add(g, Condition::Between(Box::new(both.clone()), Box::new(both)), not, end);
                    }
                }
            }
        }
        _ => {}
    }
    if let Some((relation, n)) = g.vocabulary.relation(&rest) {
        for end in (at + n + 1..=j).rev() {
            for anchor in g.set(at + n, end, true).to_vec() {
                if closely && !not && (relation.is_of_view() || matches!(relation, Relation::Above | Relation::Under)) {
                    // "Directly behind": the nearest one there.
                    let is = Condition::Placed(relation, Box::new(anchor.clone()));
                    let there = g.make(SetOf::Where { of: Box::new(noun.clone()), is, not }, i, end);
                    let set =
                        SetOf::Nearest { of: Box::new(there), to: Box::new(anchor), far: false, first: 0, count: 1 };
                    let made = g.make(set, i, end);
                    close.extend(further(g, &made, i, end, j));
                } else {
                    add(g, Condition::Placed(relation, Box::new(anchor)), not, end);
                }
            }
        }
        if matches!(relation, Relation::Near) && matches!(rest.get(n), Some(&("me" | "us"))) {
            let set = nearest_to_eye(noun, false);
            found.extend(further(g, &g.make(set, i, at + n + 1), i, at + n + 1, j));
            return found;
        }
    }
    found.append(&mut close);
    if let Some(((order, most), n)) = g.vocabulary.place(&rest).filter(|(_, n)| rest.get(*n) != Some(&"of")) {
        let is_most = matches!(rest[0], "furthest" | "farthest" | "most" | "of" | "with");
        let set = if !is_most && noun.is_plural() || not {
            SetOf::Where { of: Box::new(noun.clone()), is: Condition::Side { order, most }, not }
        } else {
            SetOf::Ranked { of: Box::new(noun.clone()), order, most, first: 0, count: 1, superlative: true }
        };
        let made = g.make(set, i, at + n);
        found.extend(further(g, &made, i, at + n, j));
    }
    if g.is(WordClass::Of, at) && !said && !not {
        for end in (at + 2..=j).rev() {
            for whole in g.set(at + 1, end, true).to_vec() {
                let made = g.make(SetOf::PartOf(Box::new(noun.clone()), Box::new(whole)), i, end);
                found.extend(further(g, &made, i, end, j));
            }
        }
    }
    found.extend(compared(g, noun, [i, at, j], not));
    if said || not {
        found.extend(predicate(g, noun, [i, at, j], not));
    } else if noun.is_any() && colors::row(g.words[at]).is_some() {
        // "Everything red". In "all red things", the things that follow are no others.
        let read = if g.words[k - 1] == "all" { colored } else { predicate };
        found.extend(read(g, noun, [i, at, j], not));
    }
    found
}

/// Reads more words after a condition; "and" may stand before the next one.
fn further(g: &mut Grammar<'_>, made: &Expression, i: usize, end: usize, j: usize) -> Vec<Expression> {
    let mut next = end;
    if end + 1 < j && matches!(g.words[end], "and" | "but" | ",") {
        let rest = &g.words[end + 1..j];
        let goes_on = g.vocabulary.relation(rest).is_some()
            || matches!(
                rest[0],
                "that" | "which" | "not" | "with" | "without" | "has" | "have" | "is" | "are" | "between" | "and"
            );
        if goes_on {
            next = end + 1;
        }
    }
    after(g, made, i, next, j, next > end)
}

/// Returns whether a verb is not of the number of its subject: "the table that are".
fn disagrees(g: &Grammar<'_>, noun: &Expression, verb: &str) -> bool {
    // A word such as "fruit" may be meant in the plural, if no thing is called so.
    let is_name =
        |word: String| g.known.with(&word).iter().any(|id| g.known.names(*id).iter().any(|n| n.last() == Some(&word)));
    let counts = noun.head().is_none_or(is_name);
    let either = matches!(noun.set, SetOf::Any { .. } | SetOf::Kin { .. } | SetOf::Union { .. } | SetOf::Except(..));
    match verb {
        "is" | "was" | "has" => !either && noun.is_plural(),
        "are" | "were" | "have" => !either && counts && !noun.is_plural(),
        _ => false,
    }
}

fn is_side(g: &Grammar<'_>, at: usize, j: usize) -> bool {
    g.vocabulary.relation(&g.words[at..j]).is_some()
}

type Add<'f, 'a> = dyn FnMut(&mut Grammar<'a>, Condition, bool, usize) + 'f;

/// Reads "with a red handle".
fn having<'a>(g: &mut Grammar<'a>, from: usize, j: usize, not: bool, add: &mut Add<'_, 'a>) {
    for end in (from + 1..=j).rev() {
        // "With coffee in it".
        let to = match g.words[from..end] {
            [.., "in" | "on" | "inside", "it" | "them"] if end - from > 2 => end - 2,
            _ => end,
        };
        for piece in g.set(from, to, true).to_vec() {
            add(g, Condition::Has(Box::new(piece)), not, end);
        }
    }
}

fn nearest_to_eye(noun: &Expression, far: bool) -> SetOf {
    let (of, order) = (Box::new(noun.clone()), OrderBy::Distance);
    SetOf::Ranked { of, order, most: far, first: 0, count: 1, superlative: true }
}

/// Reads "nearest to the lamp", "taller than the mug", "over 20 cm tall".
fn compared(g: &mut Grammar<'_>, noun: &Expression, [i, at, j]: [usize; 3], not: bool) -> Vec<Expression> {
    let mut found = Vec::new();
    let from = if g.words[at] == "the" && at + 1 < j { at + 1 } else { at };
    if let Some((order, more, n)) = said_at_length(g, from, j) {
        let mut found = Vec::new();
        for end in (from + n + 1..=j).rev() {
            for than in g.set(from + n, end, true).to_vec() {
                let is = Condition::Compared { order, more, than: Box::new(than) };
                let made = g.make(SetOf::Where { of: Box::new(noun.clone()), is, not }, i, end);
                found.extend(further(g, &made, i, end, j));
            }
        }
        return found;
    }
    let choice = g.vocabulary.order(g.words[from]);
    if let Some(choice) = choice.filter(|c| c.order == OrderBy::Distance && !not) {
        let to = if matches!(g.words.get(from + 1), Some(&("to" | "from"))) { from + 2 } else { from + 1 };
        let far = choice.most;
        let to = if g.words.get(from + 1) == Some(&"away") && g.words.get(from + 2) == Some(&"from") {
            from + 3
        } else {
            to
        };
        if let Some(n) = (to < j).then(|| is_eye(g, &g.words[to..j])).flatten() {
            let end = to + n;
            let made = g.make(nearest_to_eye(noun, far), i, end);
            return further(g, &made, i, end, j);
        }
        if choice.superlative || to >= from + 2 {
            for end in (to + 1..=j).rev() {
                for anchor in g.set(to, end, true).to_vec() {
                    let (of, to) = (Box::new(noun.clone()), Box::new(anchor));
                    let made = g.make(SetOf::Nearest { of, to, far, first: 0, count: 1 }, i, end);
                    found.extend(further(g, &made, i, end, j));
                }
            }
        }
    }
    let mut add = |g: &mut Grammar<'_>, is: Condition, not: bool, end: usize| {
        let made = g.make(SetOf::Where { of: Box::new(noun.clone()), is, not }, i, end);
        found.extend(further(g, &made, i, end, j));
    };
    let (near, skip) = match g.words[at..j] {
        ["within", ..] => (true, 1),
        ["at", "most", ..] => (true, 2),
        ["at", "least", ..] => (false, 2),
        ["no", "further" | "farther" | "more", "than", ..] => (true, 3),
        ["closer" | "nearer" | "less", "than", ..] => (true, 2),
        ["more" | "further" | "farther", "than", ..] => (false, 2),
        _ => (true, 0),
    };
    if skip > 0
        && let Some((meters, end)) = length(g, at + skip, j)
    {
        let to = if g.words.get(end) == Some(&"away") { end + 1 } else { end };
        if matches!(g.words.get(to), Some(&("of" | "from" | "to"))) {
            for end in (to + 2..=j).rev() {
                for anchor in g.set(to + 1, end, true).to_vec() {
                    add(g, Condition::Within { near, meters, of: Box::new(anchor) }, not, end);
                }
            }
        }
    }
    if let Some(choice) = choice.filter(|_| g.words.get(from + 1) == Some(&"than")) {
        let (order, more) = (choice.order, choice.most);
        if let Some((meters, end)) = length(g, from + 2, j) {
            add(g, Condition::Measured { order, more, meters }, not, end);
        } else {
            for end in (from + 3..=j).rev() {
                for than in g.set(from + 2, end, true).to_vec() {
                    add(g, Condition::Compared { order, more, than: Box::new(than) }, not, end);
                }
            }
        }
        return found;
    }
    let (more, skip) = match g.words[at..j] {
        ["more" | "greater", "than", ..] | ["at", "least", ..] => (true, 2),
        ["less" | "fewer", "than", ..] | ["at", "most", ..] | ["up", "to", ..] => (false, 2),
        ["over" | "above" | "exceeding", ..] => (true, 1),
        ["under" | "below", ..] => (false, 1),
        _ => return found,
    };
    if let Some((meters, end)) = length(g, at + skip, j) {
        let to = if g.words.get(end) == Some(&"in") && end + 1 < j { end + 1 } else { end };
        let (order, end) = match g.words.get(to).and_then(|w| g.vocabulary.quantity(w)) {
            Some(order) if to < j => (order, to + 1),
            _ => (OrderBy::Length, end),
        };
        add(g, Condition::Measured { order, more, meters }, not, end);
    }
    found
}

/// Reads a color that is said of a thing: "red", "red or blue".
fn colored(g: &mut Grammar<'_>, noun: &Expression, [i, at, j]: [usize; 3], not: bool) -> Vec<Expression> {
    let mut found = Vec::new();
    for end in (at + 1..=j).rev() {
        let words = &g.words[at..end];
        let plain = |w: &&str| !g.vocabulary.is(WordClass::NoName, w) || matches!(*w, "or" | "and" | "nor");
        let last_is_color = words.last().is_some_and(|w| colors::row(w).is_some() || colors::tone(w).is_some());
        if last_is_color && words.iter().all(plain) && words.len() <= 5 {
            let adjectives = words.iter().map(|w| (*w).to_owned()).collect();
            let made = SetOf::Where { of: Box::new(noun.clone()), is: Condition::Adjective(adjectives), not };
            let made = g.make(made, i, end);
            found.extend(further(g, &made, i, end, j));
        }
    }
    found
}

/// Reads what is said of a thing after "is": a color, an order, another set.
fn predicate(g: &mut Grammar<'_>, noun: &Expression, [i, at, j]: [usize; 3], not: bool) -> Vec<Expression> {
    let from = if matches!(g.words[at], "the" | "a" | "an") && at + 1 < j { at + 1 } else { at };
    let mut found = colored(g, noun, [i, from, j], not);
    if let Some(choice) = g.vocabulary.order(g.words[from]).filter(|_| !not) {
        let end = if matches!(g.words.get(from + 1), Some(&("one" | "ones" | "away" | "back"))) {
            from + 2
        } else {
            from + 1
        };
        if end <= j && g.words.get(end) != Some(&"than") {
            let (order, most) = (choice.order, choice.most);
            let set = SetOf::Ranked {
                of: Box::new(noun.clone()),
                order,
                most,
                first: 0,
                count: 1,
                superlative: choice.superlative,
            };
            let made = g.make(set, i, end);
            found.extend(further(g, &made, i, end, j));
        }
    }
    if found.is_empty() {
        for end in (from + 1..=j).rev() {
            for of in g.set(at, end, true).to_vec() {
                let made = SetOf::Where { of: Box::new(noun.clone()), is: Condition::Among(Box::new(of)), not };
                let made = g.make(made, i, end);
                found.extend(further(g, &made, i, end, j));
            }
        }
    }
    found
}
