//! Forms of sentences: what is asked of a set, "how many", "is there", "which is taller".

use super::Grammar;
use crate::pipeline::semantics::query::language::expression::{Asks, Expression, OrderBy, Sentence, SetOf};
use crate::pipeline::semantics::query::language::tokens::{Token, is_mark};
use crate::pipeline::semantics::query::language::words::LanguageWords;
use crate::scene::identity::name_words::singular;
use crate::scene::{Identities, LevelFilter};

/// Returns all readings of a text, the best first.
pub(crate) fn sentences(text: &str, tokens: &[Token], identities: &Identities) -> Vec<Sentence> {
    let tokens: Vec<&Token> = tokens.iter().collect();
    let whole = Grammar::new(text, tokens.clone(), identities);
    if let Some(name) = (!tokens.is_empty()).then(|| whole_text(&whole)).flatten() {
        let set = whole.make(SetOf::Called(name), 0, tokens.len());
        return vec![Sentence { asks: Asks::Things, set }];
    }
    let is_question = tokens.last().is_some_and(|t| t.low == "?");
    let mut bare = tokens.as_slice();
    while let [rest @ .., last] = bare
        && (is_mark(&last.low) || matches!(last.low.as_str(), "please" | "thanks"))
    {
        bare = rest;
    }
    let is_question = |bare: &[&Token]| bare.len() == tokens.iter().filter(|t| !is_mark(&t.low)).count() && is_question;
    loop {
        let words: Vec<&str> = bare.iter().map(|t| t.low.as_str()).collect();
        let is_name = || !Grammar::new(text, bare.to_vec(), identities).named_at_start();
        // "Can you see a lamp?" is a question.
        if let ["can" | "could" | "do", "you" | "we" | "i", "see" | "find", ..] = words.as_slice() {
            break;
        }
        match LanguageWords::get().opener(&words).or((words.first() == Some(&",")).then_some(1)) {
            Some(n) if n < bare.len() && is_name() => bare = &bare[n..],
            _ => break,
        }
    }
    let is_question = is_question(bare);
    let mut reader = SentenceReader { whole: Grammar::new(text, bare.to_vec(), identities), found: Vec::new() };
    reader.read(is_question);
    reader.found
}

fn whole_text(g: &Grammar<'_>) -> Option<String> {
    let name = g.text.trim();
    let is_said = g.tokens.len() > 1
        || singular(&name.to_lowercase()) == name.to_lowercase()
        || !name.chars().all(char::is_alphanumeric);
    (is_said && !g.identities.called(name, LevelFilter::Auto).is_empty()).then(|| name.to_owned())
}

impl Grammar<'_> {
    /// Returns whether the first words are a whole name, such as "show piece".
    fn named_at_start(&self) -> bool {
        (2..=self.words.len().min(6)).any(|k| self.whole_name(0, k).is_some())
    }
}

struct SentenceReader<'a> {
    whole: Grammar<'a>,
    found: Vec<Sentence>,
}

impl<'a> SentenceReader<'a> {
    fn read(&mut self, is_question: bool) {
        let words = self.whole.words.clone();
        let n = words.len();
        match words.as_slice() {
            ["how", "many", ..] | ["what", "number", "of", ..] => {
                let from = if words[0] == "how" { 2 } else { 3 };
                self.count(from);
            }
            ["count" | "number", "of", ..] => self.count(2),
            ["count", ..] => self.count(1),
            ["is" | "are", "there", ..] => self.plain(Asks::Truth, 2, n),
            ["do" | "can" | "could", "you" | "we" | "i", "see" | "have" | "find", ..] => self.plain(Asks::Truth, 3, n),
            ["got" | "any", ..] if is_question || words[0] == "got" => self.plain(Asks::Truth, 1, n),
            ["does" | "do", ..] => self.has(),
            ["is" | "are", ..] => self.so(),
            ["what", "color" | "colour" | "colors" | "colours", "is" | "are", ..] => self.plain(Asks::Colors, 3, n),
            ["what", "is" | "are", "the", "color" | "colour" | "colors" | "colours", "of", ..] => {
                self.plain(Asks::Colors, 5, n);
            }
            ["how", quantity, "is" | "are", ..] => {
                if let Some(order) = self.whole.vocabulary.quantity(quantity) {
                    self.plain(Asks::Size(order), 3, n);
                }
            }
            ["what", "is" | "are", "the", quantity, "of", ..] if self.whole.vocabulary.quantity(quantity).is_some() => {
                let order = self.whole.vocabulary.quantity(quantity).unwrap_or(OrderBy::Length);
                self.plain(Asks::Size(order), 5, n);
            }
            ["what" | "which", "can", "be", "found" | "seen", ..] if n > 4 => self.said_of_anything(4),
            ["what" | "which", "do" | "can", "you" | "we" | "i", "see", ..] if n > 4 => self.said_of_anything(4),
            ["of" | "among", "all" | "the", ..] if words.contains(&"which") => self.of_all(),
            ["which" | "what" | "whatever" | "who", ..] => self.which(),
            // "The mug or the bottle, which is wider?"
            [_, .., "which", _, _] | [_, .., "which", _, _, _] | [_, .., "which", _, _, _, _] => self.of_choices(),
            ["between", ..] => self.said_of_anything(0),
            ["list" | "name" | "tell", ..] => {
                let from = if words.get(1) == Some(&"me") { 2 } else { 1 };
                self.plain(Asks::Names, from, n);
            }
            _ => {}
        }
        if self.found.is_empty() {
            self.plain(Asks::Things, 0, n);
        }
    }

    /// Reads words as a set.
    fn plain(&mut self, asks: Asks, from: usize, to: usize) {
        let tokens = self.whole.tokens.get(from..to).unwrap_or_default().to_vec();
        self.of(asks, tokens);
    }

    fn of(&mut self, asks: Asks, tokens: Vec<&'a Token>) {
        let sets = self.whole.of(tokens).all();
        self.found.extend(sets.into_iter().map(|set| Sentence { asks, set }));
    }

    /// Reads "how many books are there on the table", "how many buttons does the controller have".
    fn count(&mut self, from: usize) {
        let tokens = self.whole.tokens[from..].to_vec();
        let words = &self.whole.words[from..].to_vec();
        if let Some(at) = words.iter().position(|w| matches!(*w, "does" | "do"))
            && let [.., "have" | "contain" | "has"] = words.as_slice()
            && at > 0
        {
            let (pieces, whole) = (&tokens[..at], &tokens[at + 1..tokens.len() - 1]);
            let (pieces, wholes) = (self.whole.of(pieces.to_vec()).all(), self.whole.of(whole.to_vec()).all());
            return self.part_of(Asks::Count, &pieces, &wholes);
        }
        let skip = [
            &["are", "there"][..],
            &["is", "there"],
            &["do", "you", "see"],
            &["can", "you", "see"],
            &["do", "i", "see"],
            &["can", "i", "see"],
        ];
        for phrase in skip {
            let found = (1..words.len()).find(|at| words[*at..].starts_with(phrase));
            if let Some(at) = found {
                let rest = tokens[..at].iter().chain(&tokens[at + phrase.len()..]).copied().collect();
                return self.of(Asks::Count, rest);
            }
        }
        self.of(Asks::Count, tokens);
    }

    /// Reads "of all mugs, which one is the largest".
    fn of_all(&mut self) {
        let words = self.whole.words.clone();
        let Some(which) = words.iter().position(|w| *w == "which") else { return };
        let end = if words[which - 1] == "," { which - 1 } else { which };
        let from = if matches!(words[1], "all" | "the") { 2 } else { 1 };
        let is_said = |w: &&str| matches!(*w, "one" | "ones" | "which");
        let said: Vec<&Token> =
            self.whole.tokens[which..].iter().copied().filter(|t| !is_said(&t.low.as_str())).collect();
        for of in self.whole.of(self.whole.tokens[from..end].to_vec()).all() {
            let before = self.found.len();
            self.said_of(&of, said.clone());
            self.found[before..].iter_mut().for_each(|s| {
                if let SetOf::Ranked { superlative, .. } = &mut s.set.set {
                    *superlative = true;
                }
            });
        }
    }

    /// Reads "the mug or the bottle, which is wider", "between the mug and the bottle, which is wider".
    fn of_choices(&mut self) {
        let words = self.whole.words.clone();
        let (n, Some(which)) = (words.len(), words.iter().rposition(|w| *w == "which")) else { return };
        let end = if words[which - 1] == "," { which - 1 } else { which };
        let from = usize::from(matches!(words[0], "between" | "of" | "out"));
        let Some(verb) = (which + 1..n).find(|k| matches!(words[*k], "is" | "has" | "are")) else { return };
        let is_list = words[from..end].iter().any(|w| matches!(*w, "or" | "and"));
        if from >= end || verb + 1 >= n || !is_list {
            return;
        }
        let said = self.whole.tokens[verb + 1..].to_vec();
        for of in self.whole.of(self.whole.tokens[from..end].to_vec()).all().iter().take(2) {
            self.said_of(of, said.clone());
        }
    }

    /// Reads "does the mug have a handle".
    fn has(&mut self) {
        let tokens = self.whole.tokens[1..].to_vec();
        let at = self.whole.words.iter().skip(1).position(|w| matches!(*w, "have" | "contain"));
        let Some(at) = at.filter(|at| *at > 0) else { return };
        // The piece is the answer.
        let (wholes, pieces) =
            (self.whole.of(tokens[..at].to_vec()).all(), self.whole.of(tokens[at + 1..].to_vec()).all());
        self.part_of(Asks::Truth, &pieces, &wholes);
    }

    fn part_of(&mut self, asks: Asks, pieces: &[Expression], wholes: &[Expression]) {
        for (piece, whole) in super::pairs(pieces, wholes) {
            let at = piece.at.start.min(whole.at.start)..piece.at.end.max(whole.at.end);
            let set = Expression::new(SetOf::PartOf(Box::new(piece), Box::new(whole)), at);
            self.found.push(Sentence { asks, set });
        }
    }

    /// Reads "is the mug or the bottle wider": the choices, then the order that decides.
    fn which_of(&mut self) {
        let (tokens, n) = (self.whole.tokens.clone(), self.whole.tokens.len());
        let is_choice = |e: &Expression| matches!(e.set, SetOf::Union { either: true, .. });
        let or = self.whole.words.iter().position(|w| *w == "or").unwrap_or(n);
        for at in (or + 2..n).rev() {
            let choices = self.whole.of(tokens[1..at].to_vec()).all();
            for of in choices.iter().filter(|e| is_choice(e)).take(2) {
                self.said_of(of, tokens[at..].to_vec());
            }
            self.found.retain(|s| matches!(&s.set.set, SetOf::Ranked { of, .. } if is_choice(of)));
            if !self.found.is_empty() {
                return;
            }
        }
    }

    /// Reads "is the mug left of the kettle": any division into a thing and what is said of it.
    fn so(&mut self) {
        self.which_of();
        if !self.found.is_empty() {
            return;
        }
        let is = self.whole.tokens[0];
        let n = self.whole.tokens.len();
        for at in 2..n {
            let tokens =
                self.whole.tokens[1..at].iter().copied().chain([is]).chain(self.whole.tokens[at..].iter().copied());
            self.truth(tokens.collect(), at - 1);
            if !self.found.is_empty() {
                return;
            }
        }
    }

    /// Reads a statement whose verb is word `at` as a question of its truth.
    fn truth(&mut self, tokens: Vec<&'a Token>, at: usize) {
        let verb = tokens[at].at.clone();
        let subject = tokens[0].at.start;
        for set in self.whole.of(tokens).all() {
            // Something must be said of the subject, not of a thing within it.
            let is_said = match &set.set {
                SetOf::Where { of, .. } | SetOf::Ranked { of, .. } | SetOf::Nearest { of, .. } => {
                    of.at.start >= subject.min(verb.start)
                        && !matches!(set.set, SetOf::Ranked { first: 0, .. } if of.at.is_empty())
                }
                _ => false,
            };
            if is_said {
                self.found.push(Sentence { asks: Asks::Truth, set });
            }
        }
    }

    /// Reads "what is on the table", "which mugs are red", "which is taller, the lamp or the kettle".
    fn which(&mut self) {
        let words = self.whole.words.clone();
        let tokens = self.whole.tokens.clone();
        let n = words.len();
        let is_verb = |w: &str| {
            matches!(w, "is" | "are" | "stands" | "stand" | "lies" | "lie" | "sits" | "sit" | "was" | "has" | "have")
        };
        if let Some(comma) =
            words.iter().rposition(|w| *w == ",").filter(|at| *at + 3 < n && words[at + 1..].contains(&"or"))
        {
            // The choices follow: they are what is compared.
            let verb = words[..comma].iter().position(|w| is_verb(w)).unwrap_or(0);
            let choices = self.whole.of(tokens[comma + 1..].to_vec()).all();
            let said: Vec<&Token> = tokens[verb + 1..comma].iter().copied().filter(|t| t.low != "one").collect();
            for of in choices.iter().take(2) {
                self.said_of(of, said.clone());
            }
            return;
        }
        if words.get(1) == Some(&"of") {
            return self.plain(Asks::Names, 2, n);
        }
        if words.get(1).is_some_and(|w| *w == "else") && n > 2 {
            return self.said_of_anything(2);
        }
        if words.get(1).is_some_and(|w| is_verb(w)) {
            self.said_of_anything(1);
            if self.found.is_empty() || matches!(words.get(2), Some(&("the" | "a" | "an"))) {
                // "What is the tallest object": a set, unless that says nothing of a thing.
                let before = self.found.len();
                self.plain(Asks::Names, 2, n);
                if self.found.len() > before {
                    self.found.drain(..before);
                }
            }
            return;
        }
        if words.get(1) == Some(&"parts")
            && words.get(2).is_some_and(|w| matches!(*w, "does" | "do"))
            && words[n - 1] == "have"
        {
            let parts = self.whole.make(SetOf::Any { parts: true, plural: true }, 1, 2);
            let wholes = self.whole.of(tokens[3..n - 1].to_vec()).all();
            return self.part_of(Asks::Names, &[parts], &wholes);
        }
        self.plain(Asks::Names, 1, n);
    }

    /// Reads what is said of anything, from the verb on.
    fn said_of_anything(&mut self, verb: usize) {
        let any = self.whole.make(SetOf::Any { parts: false, plural: true }, 0, verb);
        self.said_of(&any, self.whole.tokens[verb..].to_vec());
    }

    fn said_of(&mut self, noun: &Expression, tokens: Vec<&'a Token>) {
        let mut rest = self.whole.of(tokens);
        let n = rest.words.len();
        let out = (1..n).find_map(|p| Some((p, rest.vocabulary.except(&rest.words[p..])?))).filter(|(p, m)| p + m < n);
        let sets = match out {
            // "What is on the table, except the lamp".
            Some((p, m)) => {
                let of = super::after::after(&mut rest, noun, 0, 0, p, true);
                let but = rest.set(p + m, n, true);
                let made = super::pairs(&of, &but).into_iter().map(|(of, but)| {
                    let at = of.at.start.min(but.at.start)..of.at.end.max(but.at.end);
                    Expression::new(SetOf::Except(Box::new(of), Box::new(but)), at)
                });
                made.collect()
            }
            None => super::after::after(&mut rest, noun, 0, 0, n, true),
        };
        let of_one = |mut set: Expression| {
            // Of choices, the one that is more so.
            if let (SetOf::Ranked { superlative, .. }, SetOf::Union { .. }) = (&mut set.set, &noun.set) {
                *superlative = true;
            }
            Sentence { asks: Asks::Names, set }
        };
        self.found.extend(sets.into_iter().map(of_one));
    }
}
