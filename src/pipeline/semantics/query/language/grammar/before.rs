//! Words before a noun: "all", "two", "second largest", "its", "the kettle's".

use super::Grammar;
use super::after::after;
use super::noun::{is_plural, noun};
use crate::pipeline::semantics::query::language::expression::{Condition, Expression, OrderBy, SetOf};
use crate::pipeline::semantics::query::language::tokens::{number, ordinal};
use crate::pipeline::semantics::query::language::words::WordClass;
use crate::scene::colors;
use crate::scene::identity::name_words::singular;

/// Returns readings of the words from `i` to `j` as one set.
pub(super) fn read(g: &mut Grammar<'_>, i: usize, j: usize) -> Vec<Expression> {
    let end = trimmed(g, i, j);
    if end < j {
        return g.set(i, end, false).to_vec();
    }
    let mut found = owned(g, i, j);
    let amount = singular(g.words[i]);
    let is_amount = g.vocabulary.is(WordClass::Amount, &amount) && !matches!(amount.as_str(), "one" | "all");
    if !(is_amount && g.words.get(i + 1) == Some(&"of") && g.known.with(&amount).is_empty() && !is_of_the(g, i)) {
        found.extend(nouns(g, i, j));
    }
    // The name may have its words in another order: the front wheel is called "wheel-front".
    let is_name = i + 1 < j && (g.known.follow(g.words[i], g.words[i + 1]) || g.whole_name(i, i + 2).is_some());
    if !found.is_empty() && is_name {
        return found;
    }
    if !found.is_empty() && quantified_first(g, i) {
        // A name such as "left stick" goes before the left one of the sticks.
        found.extend(quantified(g, i, j));
        return found;
    }
    let mut quantified = quantified(g, i, j);
    quantified.append(&mut found);
    quantified
}

/// Reads "one of these: A, B", "either A or B".
pub(super) fn one_of(g: &mut Grammar<'_>, i: usize, j: usize) -> Vec<Expression> {
    let from = match g.words[i..j] {
        ["either", _, ..] => i + 1,
        ["one" | "any", "of", "these" | "the" | "those", "," | "following", ..] => {
            (i + 3..j).find(|k| !matches!(g.words[*k], "," | "following")).unwrap_or(j)
        }
        _ => return Vec::new(),
    };
    let of = g.set(from, j, true).to_vec();
    of.into_iter().map(|of| g.make(SetOf::One(Box::new(of)), i, j)).collect()
}

/// End of the words without phrases that exclude nothing, such as "in the scene".
fn trimmed(g: &Grammar<'_>, i: usize, j: usize) -> usize {
    let is_rest = |from: &usize| g.vocabulary.here(&g.words[*from..j]) == Some(j - from);
    let named =
        |from: usize| (from..j).any(|k| g.known.has(g.words[k]) && !g.vocabulary.is(WordClass::NoName, g.words[k]));
    (i + 1..j)
        .find(is_rest)
        .filter(|from| !named(*from))
        .unwrap_or(if j - i > 1 && matches!(g.words[j - 1], "," | "?") { j - 1 } else { j })
}

/// Returns whether the words may be a name although they begin with a word such as "left".
fn quantified_first(g: &Grammar<'_>, i: usize) -> bool {
    g.known.has(g.words[i])
}

/// Returns whether "pieces of the" stands there: parts of a thing. "Pieces of fruit" are fruit.
fn is_of_the(g: &Grammar<'_>, i: usize) -> bool {
    matches!(g.words.get(i + 1..i + 3), Some(["of", "the" | "this" | "that"]))
}

/// Reads "its lid", "the kettle's lid".
fn owned(g: &mut Grammar<'_>, i: usize, j: usize) -> Vec<Expression> {
    let mut found = Vec::new();
    if matches!(g.words[i], "its" | "their") && i + 1 < j {
        let plural = g.words[i] == "their";
        for piece in g.set(i + 1, j, false).iter() {
            let last = g.make(SetOf::Last { plural }, i, i + 1);
            found.push(g.make(SetOf::PartOf(Box::new(piece.clone()), Box::new(last)), i, j));
        }
    }
    for p in (i + 1..j.saturating_sub(1)).rev().filter(|p| g.words[*p] == "'s").collect::<Vec<_>>() {
        let (whole, piece) = (g.set(i, p, false), g.set(p + 1, j, true));
        for (whole, piece) in super::pairs(&whole, &piece) {
            // What follows the piece is said of the piece.
            found.push(within(piece, &whole, g.at(i, j)));
        }
    }
    found
}

/// Returns a set restricted to parts of a whole, its noun first: "the kettle's largest part".
fn within(piece: Expression, whole: &Expression, at: std::ops::Range<usize>) -> Expression {
    let inner = |of: Box<Expression>| Box::new(within(*of, whole, at.clone()));
    let set = match piece.set {
        SetOf::Ranked { of, order, most, first, count, superlative } => {
            SetOf::Ranked { of: inner(of), order, most, first, count, superlative }
        }
        SetOf::Where { of, is, not } => SetOf::Where { of: inner(of), is, not },
        SetOf::Counted { of, count } => SetOf::Counted { of: inner(of), count },
        SetOf::Every { of, both } => SetOf::Every { of: inner(of), both },
        SetOf::Nearest { of, to, far, first, count } => SetOf::Nearest { of: inner(of), to, far, first, count },
        SetOf::Union { of, either } => {
            SetOf::Union { of: of.into_iter().map(|e| within(e, whole, at.clone())).collect(), either }
        }
        other => SetOf::PartOf(Box::new(Expression::new(other, piece.at)), Box::new(whole.clone())),
    };
    Expression::new(set, at)
}

/// Reads determiners, numbers, orders and pronouns.
fn quantified(g: &mut Grammar<'_>, i: usize, j: usize) -> Vec<Expression> {
    let word = g.words[i];
    if let Some(id) = word.strip_prefix('#').and_then(|n| n.parse().ok()).filter(|_| i + 1 == j) {
        return vec![g.make(SetOf::Numbered(id), i, j)];
    }
    let last = |plural| SetOf::Last { plural };
    match &g.words[i..j] {
        ["it" | "this" | "that"] | ["this" | "that", "one"] => return vec![g.make(last(false), i, j)],
        ["them" | "they" | "these" | "those"] | ["these" | "those", "ones"] => return vec![g.make(last(true), i, j)],
        ["the", "others"] | ["others"] | ["the", "rest"] => {
            let kin = g.make(SetOf::Kin { plural: true }, i, j);
            return vec![g.make(SetOf::Other(Box::new(kin)), i, j)];
        }
        _ => {}
    }
    let after_of = |g: &Grammar<'_>, k: usize| if g.words.get(k) == Some(&"of") { k + 1 } else { k };
    let wrap = |g: &mut Grammar<'_>, from: usize, make: &dyn Fn(Box<Expression>) -> SetOf| -> Vec<Expression> {
        let inner = g.set(from, j, false);
        inner.iter().map(|e| g.make(make(Box::new(e.clone())), i, j)).collect()
    };
    if word == "not" && i + 2 < j && colors::row(g.words[i + 1]).is_some() {
        let is = Condition::Adjective(vec![g.words[i + 1].to_owned()]);
        let of = g.set(i + 2, j, false).to_vec();
        return of.into_iter().map(|of| g.make(negated(of, &is), i, j)).collect();
    }
    if let ["each", "and", "every", ..] = g.words[i..j] {
        return g.set(i + 2, j, false).to_vec();
    }
    if g.is(WordClass::All, i) && i + 1 < j {
        let both = word == "both";
        if both && g.words[i + 1..j].contains(&"and") {
            return g.set(i + 1, j, true).to_vec();
        }
        if let ["one", "of", ..] = g.words[i + 1..j] {
            return wrap(g, i + 3, &|of| SetOf::Every { of, both });
        }
        return wrap(g, after_of(g, i + 1), &|of| SetOf::Every { of, both });
    }
    if i + 1 < j && (matches!(word, "only" | "just" | "exactly") || g.is(WordClass::Determiner, i)) {
        return g.set(i + 1, j, false).to_vec();
    }
    if word == "other" && i + 1 < j {
        return wrap(g, i + 1, &SetOf::Other);
    }
    if word == "another" && i + 1 < j {
        return wrap(g, i + 1, &|of| SetOf::One(Box::new(Expression::new(SetOf::Other(of), 0..0))));
    }
    let amount = singular(word);
    let is_part = g.vocabulary.is(WordClass::Part, &amount) && is_of_the(g, i);
    let is_amount = g.vocabulary.is(WordClass::Amount, &amount) && amount != "one";
    if is_amount && g.words.get(i + 1) == Some(&"of") && i + 2 < j && !is_part {
        let two = matches!(amount.as_str(), "pair" | "couple");
        return match (two, is_plural(word)) {
            (true, _) => wrap(g, i + 2, &|of| SetOf::Counted { of, count: 2 }),
            (false, true) => wrap(g, i + 2, &|of| SetOf::Every { of, both: false }),
            (false, false) => g.set(i + 2, j, false).to_vec(),
        };
    }
    if let Some(count) = number(word).filter(|n| (1.0..=99.0).contains(n) && n.fract() == 0.0).filter(|_| i + 1 < j) {
        let count = count as usize;
        let from = after_of(g, i + 1);
        if count == 1 {
            // "One of the mugs" is any of them; "the one of the house" is a piece of it.
            let of_several = from == i + 1 || g.set(from, j, false).iter().any(Expression::is_plural);
            return if of_several { wrap(g, from, &SetOf::One) } else { Vec::new() };
        }
        return wrap(g, from, &|of| counted(of, count));
    }
    if g.is(WordClass::Any, i) && i + 1 < j && word != "one" {
        return wrap(g, after_of(g, i + 1), &SetOf::One);
    }
    ranked(g, i, j)
}

/// Returns the members of a set that are not so, its noun first: "the non-red buttons of the controller".
fn negated(of: Expression, is: &Condition) -> SetOf {
    let inner = |of: Box<Expression>, at| Box::new(Expression::new(negated(*of, is), at));
    match of.set {
        SetOf::PartOf(piece, whole) => SetOf::PartOf(inner(piece, of.at.clone()), whole),
        SetOf::Where { of: inside, is: other, not } => {
            SetOf::Where { of: inner(inside, of.at.clone()), is: other, not }
        }
        set => SetOf::Where { of: Box::new(Expression::new(set, of.at)), is: is.clone(), not: true },
    }
}

/// Returns a number of a set: of the largest ones, the first so many.
fn counted(of: Box<Expression>, number: usize) -> SetOf {
    match of.set {
        SetOf::Ranked { of, order, most, first, count: 1, superlative } => {
            SetOf::Ranked { of, order, most, first, count: number, superlative }
        }
        SetOf::Nearest { of, to, far, first, count: 1 } => SetOf::Nearest { of, to, far, first, count: number },
        _ => SetOf::Counted { of, count: number },
    }
}

/// Reads "second largest", "third from the left", "largest two", "largest of the".
fn ranked(g: &mut Grammar<'_>, i: usize, j: usize) -> Vec<Expression> {
    let (first, at) = match ordinal(g.words[i]) {
        Some(n) if i + 1 < j => (n, i + 1),
        _ => (1, i),
    };
    if at > i && g.vocabulary.order(g.words[at]).is_none() {
        let found = from_a_side(g, first, at, i, j);
        if !found.is_empty() || first < 2 {
            return found;
        }
        let of = g.set(at, j, false).to_vec();
        return of.into_iter().map(|of| g.make(SetOf::Nth { of: Box::new(of), nth: first }, i, j)).collect();
    }
    let Some(choice) = g.vocabulary.order(g.words[at]).filter(|_| first > 0) else { return Vec::new() };
    let mut from = at + 1;
    let mut count = 1;
    if let Some(n) = g.words.get(from).and_then(|w| number(w)).filter(|n| (2.0..=99.0).contains(n) && n.fract() == 0.0)
    {
        (count, from) = (n as usize, from + 1);
    }
    if matches!(g.words.get(from), Some(&("one" | "ones")))
        && matches!(g.words.get(from + 1), Some(&("of" | "from" | "in")))
    {
        from += 1;
    }
    if matches!(g.words.get(from), Some(&("of" | "among" | "amongst"))) {
        from += 1;
    }
    if choice.order == OrderBy::Distance && from < j {
        // "The nearest mug to the lamp".
        if g.words.get(from) == Some(&"to") {
            return Vec::new();
        }
        let far = choice.most;
        if let [noun @ .., "to" | "from", "me" | "us"] | [noun @ .., "to" | "from", "the", "camera" | "viewer"] =
            &g.words[from..j]
            && !noun.is_empty()
            && !(g.words[j - 1] != "me" && g.known.ends(g.words[j - 1]))
        {
            let end = from + noun.len();
            let of = g.set(from, end, false).to_vec();
            let first = first.saturating_sub(1);
            let order = |of| SetOf::Ranked {
                of: Box::new(of),
                order: OrderBy::Distance,
                most: far,
                first,
                count,
                superlative: true,
            };
            return of.into_iter().map(|of| g.make(order(of), i, j)).collect();
        }
        for p in (from + 1..j.saturating_sub(1)).filter(|p| matches!(g.words[*p], "to" | "from")).collect::<Vec<_>>() {
            let (of, to) = (g.set(from, p, false), g.set(p + 1, j, false));
            let made = super::pairs(&of, &to).into_iter().map(|(of, to)| {
                let (of, to) = (Box::new(of), Box::new(to));
                g.make(SetOf::Nearest { of, to, far, first: first.saturating_sub(1), count }, i, j)
            });
            let made: Vec<Expression> = made.collect();
            if !made.is_empty() {
                return made;
            }
        }
    }
    let make = |of: Expression, g: &Grammar<'_>| {
        let first = first.saturating_sub(1);
        let (order, most, superlative) = (choice.order, choice.most, choice.superlative || first > 0);
        g.make(SetOf::Ranked { of: Box::new(of), order, most, first, count, superlative }, i, j)
    };
    if from >= j {
        // "The largest": of all things.
        return if from == j && choice.superlative {
            let any = g.make(SetOf::Any { parts: false, plural: true }, i, j);
            vec![make(any, g)]
        } else {
            Vec::new()
        };
    }
    let inner = g.set(from, j, false);
    inner.iter().map(|of| make(of.clone(), g)).collect()
}

/// Reads "third book from the left".
fn from_a_side(g: &mut Grammar<'_>, nth: usize, from: usize, i: usize, j: usize) -> Vec<Expression> {
    let found = (from + 1..j.saturating_sub(2)).find(|p| matches!(g.words[*p..*p + 2], ["from", "the"]));
    let Some(at) = found else { return Vec::new() };
    // "The second mug, counting from the front".
    let mut end = at;
    while end > from + 1
        && matches!(g.words[end - 1], "counting" | "counted" | "starting" | "seen" | "in" | "along" | ",")
    {
        end -= 1;
    }
    let (order, most) = match g.words[at + 2] {
        "left" => (OrderBy::Right, false),
        "right" => (OrderBy::Right, true),
        "top" => (OrderBy::Up, true),
        "bottom" => (OrderBy::Up, false),
        "front" => (OrderBy::Distance, false),
        "back" => (OrderBy::Distance, true),
        _ => return Vec::new(),
    };
    let (most, first) = if nth == 0 { (!most, 0) } else { (most, nth - 1) };
    // What follows is said of all of them.
    let tokens = (from..end).chain(at + 3..j).map(|k| g.tokens[k]).collect();
    let inner = g.of(tokens).all();
    let make =
        |of: &Expression| SetOf::Ranked { of: Box::new(of.clone()), order, most, first, count: 1, superlative: true };
    inner.iter().map(|of| g.make(make(of), i, j)).collect()
}

/// Reads a noun with what stands after it.
fn nouns(g: &mut Grammar<'_>, i: usize, j: usize) -> Vec<Expression> {
    let mut found = Vec::new();
    for k in (i + 1..=j).rev() {
        let Some(noun) = noun(g, i, k) else { continue };
        found.extend(after(g, &noun, i, k, j, false));
    }
    found
}
