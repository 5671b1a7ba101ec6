//! A request parted into clauses, each of which asks for one thing.

use super::moves;
use crate::agent::words::{Token, alike, is_mark, low, number, singular, tokens, verb, without_courtesy};
use crate::scene::Identities;

/// Words that begin a request.
pub(super) const VERBS: [&str; 141] = [
    "show",
    "see",
    "view",
    "display",
    "go",
    "fly",
    "navigate",
    "take",
    "bring",
    "give",
    "approach",
    "visit",
    "inspect",
    "examine",
    "check",
    "zoom",
    "focus",
    "center",
    "centre",
    "find",
    "locate",
    "search",
    "look",
    "face",
    "turn",
    "rotate",
    "spin",
    "pan",
    "tilt",
    "step",
    "move",
    "walk",
    "back",
    "come",
    "slide",
    "shift",
    "strafe",
    "climb",
    "rise",
    "sink",
    "descend",
    "lower",
    "raise",
    "hide",
    "conceal",
    "isolate",
    "segment",
    "unhide",
    "reveal",
    "remove",
    "delete",
    "erase",
    "rename",
    "call",
    "name",
    "highlight",
    "mark",
    "outline",
    "select",
    "point",
    "export",
    "save",
    "describe",
    "explain",
    "tell",
    "list",
    "count",
    "enumerate",
    "measure",
    "undo",
    "revert",
    "cancel",
    "help",
    "what",
    "which",
    "where",
    "how",
    "who",
    "is",
    "are",
    "does",
    "do",
    "get",
    "travel",
    "head",
    "jump",
    "reset",
    "restore",
    "stop",
    "hello",
    "thanks",
    "circle",
    "orbit",
    "ascend",
    "advance",
    "retreat",
    "scoot",
    "dolly",
    "return",
    "leave",
    "let",
    "swivel",
    "clear",
    "only",
    "stand",
    "whereabouts",
    "identify",
    "spot",
    "drop",
    "extract",
    "peek",
    "pull",
    "push",
    "keep",
    "put",
    "pick",
    "pour",
    "open",
    "throw",
    "cut",
    "print",
    "make",
    "write",
    "has",
    "have",
    "wipe",
    "fade",
    "can",
    "nudge",
    "enlarge",
    "magnify",
    "watch",
    "observe",
    "study",
    "proceed",
    "continue",
    "again",
    "don't",
    "anything",
    "concentrate",
    "aim",
];

/// Whether a word is in a name of the scene.
pub(super) fn is_known(word: &str, identities: &Identities) -> bool {
    let names = identities.iter().flat_map(|(_, i)| &i.names);
    names.flat_map(|n| n.split(|c: char| !c.is_alphanumeric())).any(|w| alike(&w.to_lowercase(), word) && !w.is_empty())
}

/// Whether a word is in a name of the scene, letter by letter but for a plural.
pub(super) fn is_named(word: &str, identities: &Identities) -> bool {
    let names = identities.iter().flat_map(|(_, i)| &i.names);
    names
        .flat_map(|n| n.split(|c: char| !c.is_alphanumeric()))
        .any(|w| singular(&w.to_lowercase()) == singular(word) && !w.is_empty())
}

/// "Showing" as "show", "hiding" as "hide", "getting" as "get".
fn without_ing(word: &str) -> Option<String> {
    let stem = word.strip_suffix("ing").filter(|s| s.len() >= 2)?;
    let single = stem.get(..stem.len() - 1).unwrap_or_default();
    let forms = [stem.to_owned(), format!("{stem}e"), single.to_owned()];
    forms.into_iter().find(|f| VERBS.contains(&f.as_str()))
}

/// Whether words begin a request of their own: with a verb, a movement, or a side.
pub(super) fn starts_request(words: &[&str]) -> bool {
    let words = without_courtesy(words);
    let Some(first) = words.first() else { return false };
    if VERBS.contains(first) {
        return true;
    }
    let first_clause: Vec<&str> =
        words.iter().copied().take_while(|w| !is_mark(w) && !["and", "then"].contains(w)).collect();
    let first_clause: Vec<&str> = first_clause.into_iter().filter(|w| !is_mark(w)).collect();
    moves::movement(&first_clause).is_some()
        || moves::closer(&first_clause).is_some()
        || super::sides::is_side_only(&first_clause)
}

/// A clause, and whether only a comma parts it from the one before.
pub(super) struct Clause {
    pub words: Vec<Token>,
    pub follows_comma: bool,
}

/// The clauses of a request.
pub(super) fn split(request: &str, identities: &Identities) -> Vec<Clause> {
    let all = tokens(request);
    let whole = protected(&all, identities);
    let mut clauses = vec![Clause { words: Vec::new(), follows_comma: false }];
    let mut i = 0;
    while i < all.len() {
        let word = all[i].low.as_str();
        let rest: Vec<&str> = all[i + 1..].iter().map(|t| t.low.as_str()).collect();
        let skip = if whole[i] { None } else { parting(word, &rest) };
        match skip {
            Some(n) => {
                let joins = rest.iter().find(|w| !["but", ",", "please"].contains(*w));
                let follows_comma =
                    [",", "but"].contains(&word) && !joins.is_some_and(|w| ["then", "and", "now", "also"].contains(w));
                clauses.push(Clause { words: Vec::new(), follows_comma });
                i += n;
            }
            None => {
                if let Some(clause) = clauses.last_mut().filter(|_| whole[i] || !is_mark(word)) {
                    clause.words.push(all[i].clone());
                }
                i += 1;
            }
        }
    }
    clauses.retain(|c| !low(&c.words).is_empty());
    clauses
}

/// How many words part two clauses here, if they do.
fn parting(word: &str, rest: &[&str]) -> Option<usize> {
    match word {
        "." | ";" | "!" | "?" => Some(1),
        "then" | "afterwards" | "thereafter" | "finally" => Some(1),
        "after" if rest.first().is_some_and(|w| ["that", "this"].contains(w)) => Some(2),
        "," | "and" | "but" | ":" => {
            // "No, the other one", "hey, show me ...": what is said before belongs to it.
            let joins = |w: &&str| !["and", "then", "but", ",", "now", "also", "please"].contains(w);
            let next: Vec<&str> = rest.iter().copied().skip_while(|w| !joins(w)).collect();
            let begins = starts_request(&next) || next.first().is_some_and(|w| ["finally", "after"].contains(w));
            begins.then_some(1)
        }
        _ => None,
    }
}

/// Which tokens belong to a name of the scene that has joining words or marks in it.
fn protected(all: &[Token], identities: &Identities) -> Vec<bool> {
    let mut whole = vec![false; all.len()];
    for name in identities.iter().flat_map(|(_, i)| &i.names) {
        let named: Vec<String> = tokens(name).into_iter().map(|t| t.low).filter(|w| !is_mark(w)).collect();
        if named.len() < 3 || !named.iter().any(|w| ["and", "then", "but"].contains(&w.as_str())) {
            continue;
        }
        let places: Vec<usize> = (0..all.len()).filter(|i| !is_mark(&all[*i].low)).collect();
        for window in places.windows(named.len()) {
            if window.iter().zip(&named).all(|(i, word)| all[*i].low == *word)
                && let (Some(from), Some(to)) = (window.first(), window.last())
            {
                whole[*from..=*to].fill(true);
            }
        }
    }
    whole
}

/// Contractions in full: "what's" as "what is".
pub(super) fn expand(words: &[&str]) -> Vec<String> {
    let full = |word: &str| -> String {
        match word {
            "whats" => "what is".into(),
            "wheres" => "where is".into(),
            "hows" => "how is".into(),
            "theres" => "there is".into(),
            "gimme" => "give me".into(),
            "lemme" => "let me".into(),
            "wanna" => "want to".into(),
            "i'm" => "i am".into(),
            "isn't" => "is".into(),
            _ => match word.strip_suffix("'s") {
                Some(stem @ ("what" | "where" | "who" | "how" | "that" | "there" | "here" | "it")) => {
                    format!("{stem} is")
                }
                _ => word.into(),
            },
        }
    };
    words.iter().map(|w| full(w)).collect()
}

/// The words with a slip in the first verb put right; names of the scene are no slips.
pub(super) fn corrected(words: &[&str], identities: &Identities) -> Vec<String> {
    let mut words: Vec<String> = words.iter().map(|w| (*w).to_owned()).collect();
    if let Some(first) = words.first_mut()
        && let Some(plain) = without_ing(first)
    {
        *first = plain;
    }
    if let Some(first) = words.first_mut()
        && !VERBS.contains(&first.as_str())
        && !is_known(first, identities)
        && !moves::is_direction(first)
        && number(first).is_none()
        && !crate::agent::resolve::is_pick(first)
        && ![
            "from", "closer", "nearer", "farther", "further", "other", "another", "their", "there", "these", "those",
            "this", "that",
        ]
        .contains(&first.as_str())
        && let Some(right) = verb(first, &VERBS)
    {
        *first = right.to_owned();
    }
    words
}
