//! Nouns: names, generic words, colors alone, and words that no name has.

use super::{Grammar, LONGEST_NOUN};
use crate::pipeline::semantics::query::language::expression::{Condition, Expression, SetOf};
use crate::pipeline::semantics::query::language::tokens::number;
use crate::pipeline::semantics::query::language::words::WordClass;
use crate::scene::colors;
use crate::scene::identity::lexicon;
use crate::scene::identity::name_words::{SceneWords, singular, written};

/// Returns the words from `i` to `k` as a noun with adjectives before it.
pub(super) fn noun(g: &Grammar<'_>, i: usize, k: usize) -> Option<Expression> {
    if k - i > 1
        && let Some(name) = g.whole_name(i, k)
    {
        return Some(g.make(SetOf::Called(name), i, k));
    }
    let own = &g.words[i..k];
    let last = *own.last()?;
    let generic = singular(last);
    if k - i == 1
        && matches!(*own.last()?, "those" | "that")
        && matches!(g.words.get(k), Some(&("of" | "with" | "on" | "in" | "from" | "without")))
    {
        return Some(g.make(SetOf::Kin { plural: own[0] == "those" }, i, k));
    }
    // The last word may be a letter, such as "button a"; no name ends in "left" that does not say so.
    let is_letter = k - i > 1 && last == "a" && g.known.has("a");
    let own = if is_letter { &own[..own.len() - 1] } else { own };
    if g.vocabulary.order(last).is_some() && !g.known.ends(last)
        || k - i > 1 && number(own[0]).is_some() && !g.known.has(own[0])
    {
        return None;
    }
    let of_none = |w: &str| {
        g.vocabulary.is(WordClass::NoName, w) && !matches!(w, "everything" | "something" | "anything" | "all")
    };
    if k - i > LONGEST_NOUN
        || own.iter().any(|w| of_none(w))
        || !own.iter().any(|w| w.chars().any(char::is_alphanumeric))
    {
        return None;
    }
    let is_named = g.known.is_name(&generic);
    let plural = is_plural(last);
    if last == "all" && matches!(g.words.get(k), Some(&"not")) {
        return None;
    }
    let everything = matches!(last, "everything" | "anything" | "whatever" | "stuff" | "all");
    let single = k - i == 1;
    let one = matches!(generic.as_str(), "one");
    if single && !g.known.ends(&generic) && colors::row(last).is_some() {
        let any = g.make(SetOf::Any { parts: false, plural: false }, i, k);
        let is = Condition::Adjective(vec![last.to_owned()]);
        return Some(g.make(SetOf::Where { of: Box::new(any), is, not: false }, i, k));
    }
    let set = if one && !is_named {
        SetOf::Kin { plural }
    } else if g.vocabulary.is(WordClass::Thing, &generic) && !is_named {
        SetOf::Any { parts: false, plural: plural || everything }
    } else if g.vocabulary.is(WordClass::Part, &generic) && !is_named {
        SetOf::Any { parts: true, plural }
    } else {
        let all = g.words[i..k].iter().flat_map(|w| spoken(w, g.known)).collect::<Vec<_>>();
        let words = if all.is_empty() { vec![last.to_owned()] } else { all };
        return Some(g.make(SetOf::Words { words, plural }, i, k));
    };
    let generic = g.make(set, k - 1, k);
    if single {
        return Some(generic);
    }
    // "Red things": adjectives of a generic word.
    let adjectives = own[..own.len() - 1].iter().map(|w| (*w).to_owned()).collect();
    let is = Condition::Adjective(adjectives);
    Some(g.make(SetOf::Where { of: Box::new(generic), is, not: false }, i, k))
}

/// Words of a name as they are compared: in the singular, in American spelling.
pub(super) fn spoken(word: &str, known: &SceneWords) -> Vec<String> {
    let plain = |w: String| {
        if known.has(&w) {
            return singular(&w);
        }
        let single = lexicon::singular_of(&w).map_or_else(|| singular(&w), str::to_owned);
        lexicon::american(&single).map_or(single.clone(), str::to_owned)
    };
    written(word).map(plain).collect()
}

/// Returns whether a word is an English plural.
pub(super) fn is_plural(word: &str) -> bool {
    singular(word) != word || lexicon::singular_of(word).is_some_and(|single| single != word)
}
