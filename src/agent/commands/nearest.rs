//! Commands that are nearest to a request, as examples to type.

use super::example::example;
use super::form::{FormItem, sequences};
use crate::agent::language::{CommandHelp, commands};
use crate::agent::words::{alike, request_tokens};
use crate::scene::Identities;

/// Commands nearest to a request: the first word counts most, then other shared words.
pub(crate) fn nearest(request: &str, identities: &Identities) -> Vec<String> {
    let tokens = request_tokens(request);
    let words: Vec<&str> = tokens.iter().map(|t| t.low.as_str()).filter(|w| *w != ",").collect();
    let common = ["the", "a", "is", "to", "of", "in", "it", "me", "and"];
    let score = |items: &[FormItem]| {
        let own: Vec<&str> = items.iter().filter_map(FormItem::word).collect();
        let verb = own.first().is_some_and(|w| words.first().is_some_and(|f| alike(f, w)));
        let shared = words.iter().filter(|w| !common.contains(*w) && own.iter().any(|o| alike(o, w))).count();
        3 * usize::from(verb) + 2 * shared
    };
    let mut best: Vec<(usize, &CommandHelp)> = Vec::new();
    for sequence in sequences() {
        let score = score(&sequence.items);
        match best.last_mut() {
            Some((most, command)) if std::ptr::eq(*command, sequence.command) => *most = score.max(*most),
            _ => best.push((score, sequence.command)),
        }
    }
    best.sort_by_key(|(score, _)| std::cmp::Reverse(*score));
    let fits = best.iter().filter(|(score, _)| *score > 0).map(|(_, c)| *c);
    let usual = ["show me the {}", "what is on the table", "describe the {}"];
    let usual = commands().iter().filter(|c| usual.contains(&c.example.as_str()));
    let mut found: Vec<String> = Vec::new();
    for command in fits.chain(usual) {
        let text = example(command, identities, &words);
        if found.len() < 3 && !found.contains(&text) {
            found.push(text);
        }
    }
    found
}
