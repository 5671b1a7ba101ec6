//! Completion while typing, from the commands and from the names in the scene.

use super::form::{FormItem, FormRequest, FormSlot, Things, is_file, is_folder, sequences};
use super::{SEPARATORS, clauses};
use crate::agent::language::CommandLanguage;
use crate::agent::names::NameWords;
use crate::agent::words::request_tokens;
use crate::pipeline::semantics::query::language::words::LanguageWords;
use crate::scene::Identities;

/// Returns at most `most` completions of `text` by its next words: names of things first, else in the order of the
/// commands.
pub fn complete(text: &str, identities: &Identities, most: usize) -> Vec<String> {
    let tokens = request_tokens(text);
    let words: Vec<&str> = tokens.iter().map(|t| t.low.as_str()).collect();
    let known = NameWords::new(identities);
    // Commands before the last one must be valid; polite openers are skipped.
    let starts = |at: usize| {
        let (tokens, words) = (&tokens[..at], &words[..at]);
        let before = FormRequest { text, tokens, words, known: &known, things: Things::Known };
        let opens = CommandLanguage::get().openers.contains(&words.join(" "));
        at == 0 || opens || (SEPARATORS.contains(&words[at - 1]) && clauses(&before, true).is_some())
    };
    let ends_word = text.is_empty() || text.ends_with(char::is_whitespace);
    let mut found = Vec::new();
    for at in (0..=words.len()).filter(|at| starts(*at)) {
        let typed = &words[at..];
        let (whole, begun) = match typed.split_last() {
            Some((last, whole)) if !ends_word => (whole, *last),
            _ => (typed, ""),
        };
        let kept = Kept { identities, known: &known, begun };
        let mut next = Vec::new();
        for sequence in sequences() {
            kept.follow(&sequence.items, whole, &mut next);
        }
        next.sort_by_key(|(is_name, _)| !is_name);
        for (_, end) in next {
            let all: Vec<&str> = words[..at].iter().chain(whole).copied().chain([end.as_str()]).collect();
            let text = all.join(" ").replace(" 's", "'s").replace(" ,", ",");
            if !found.contains(&text) && found.len() < most {
                found.push(text);
            }
        }
    }
    found
}

struct Kept<'a> {
    identities: &'a Identities,
    known: &'a NameWords<'a>,
    /// Word that is being typed; empty if the next has not begun.
    begun: &'a str,
}

impl Kept<'_> {
    /// Adds the texts that may follow `words` in a sequence, each with a flag for names.
    fn follow(&self, items: &[FormItem], words: &[&str], next: &mut Vec<(bool, String)>) {
        match (items.split_first(), words) {
            (None, _) => {}
            (Some((FormItem::Word(word), _)), []) => self.offer(word, false, next),
            (Some((FormItem::Word(word), items)), [first, words @ ..]) => {
                if word == first {
                    self.follow(items, words, next);
                }
            }
            (Some((FormItem::Slot(slot), items)), words) => {
                let options = self.options(*slot);
                let is_name = matches!(slot, FormSlot::Thing | FormSlot::Things);
                let typed = words.join(" ").replace(" 's", "'s");
                for option in &options {
                    // "the left stick" after "the left", or after "left".
                    let articles = if is_name && !typed.is_empty() { &["the ", ""][..] } else { &[""] };
                    let begun = articles.iter().map(|article| option.strip_prefix(article).unwrap_or(option));
                    let rest = begun.filter_map(|option| match typed.as_str() {
                        "" => Some(option),
                        typed => rest_of(option, typed).filter(|r| r.starts_with(' ')).map(str::trim_start),
                    });
                    rest.for_each(|r| self.offer(r, is_name, next));
                }
                for end in 1..=words.len() {
                    let said = words[..end].join(" ");
                    let names = matches!(slot, FormSlot::Thing | FormSlot::Things | FormSlot::Kind);
                    let fits = match slot {
                        _ if names => self.known.is_thing(&words[..end], true),
                        FormSlot::Name => true,
                        FormSlot::Photo => is_file(&said),
                        FormSlot::Folder => is_folder(&said),
                        FormSlot::Distance | FormSlot::Angle => words[0].starts_with(|c: char| c.is_ascii_digit()),
                        _ => options.contains(&said),
                    };
                    if fits {
                        self.follow(items, &words[end..], next);
                    }
                    if fits && names && end == words.len() {
                        relations().iter().for_each(|r| self.offer(r, false, next));
                    }
                }
            }
        }
    }

    fn offer(&self, text: &str, is_name: bool, next: &mut Vec<(bool, String)>) {
        let goes_on = rest_of(text, self.begun).is_some_and(|rest| !rest.is_empty());
        if text != "?" && goes_on && !next.iter().any(|(_, n)| n == text) {
            next.push((is_name, text.to_owned()));
        }
    }

    /// Suggested texts for a slot.
    fn options(&self, slot: FormSlot) -> Vec<String> {
        let language = CommandLanguage::get();
        let fixed = |words: &[&str]| words.iter().map(|w| (*w).to_owned()).collect();
        let full = || self.identities.iter().filter(|(_, i)| !i.names.is_empty()).map(|(id, _)| id);
        match slot {
            FormSlot::Thing | FormSlot::Things => {
                full().map(|id| format!("the {}", self.identities.full_name(id))).collect()
            }
            FormSlot::Kind => {
                let names = self.identities.iter().filter_map(|(_, i)| i.names.first());
                ["objects".to_owned(), "parts".into()].into_iter().chain(names.cloned()).collect()
            }
            FormSlot::Side => language.sides.iter().map(|(w, _)| (*w).to_owned()).collect(),
            FormSlot::Relation => relations(),
            FormSlot::Direction => language.directions.iter().map(|(w, _)| (*w).to_owned()).collect(),
            FormSlot::Turn => fixed(&["left", "right", "up", "down"]),
            FormSlot::Distance => fixed(&["20 cm", "half a meter", "two steps", "a bit"]),
            FormSlot::Angle => fixed(&["90 degrees", "45 degrees"]),
            FormSlot::Most => LanguageWords::get().superlatives().map(str::to_owned).collect(),
            FormSlot::Name | FormSlot::Photo | FormSlot::Folder => Vec::new(),
        }
    }
}

/// Words of all relations, sorted.
fn relations() -> Vec<String> {
    let mut all: Vec<String> = LanguageWords::get().relations().map(|(words, _)| words).collect();
    all.sort();
    all
}

/// Returns the rest of a text after the prefix `begun`, compared without letter case.
fn rest_of<'a>(text: &'a str, begun: &str) -> Option<&'a str> {
    let end = text.char_indices().map(|(at, c)| at + c.len_utf8()).take(begun.chars().count()).last().unwrap_or(0);
    (text[..end].to_lowercase() == begun).then_some(&text[end..])
}
