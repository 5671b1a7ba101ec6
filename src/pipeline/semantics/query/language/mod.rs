//! Language of questions: one grammar and one resolver for query field, phrases, command line, agent and pages.
//!
//! 1. [`tokens`] takes a text apart; [`words`] are those of the language, the rest are names.
//! 2. [`grammar`] gives all readings as [`expression`]s: sets of identities taken from other sets.
//! 3. [`evaluate`] finds the identities of each reading; [`nouns`] and [`adjectives`] by name, kind, color or
//!    embedding, [`conditions`] by place ([`relations`]), [`order`] by quantity.
//! 4. [`answer`](ask) chooses among the readings, and [`said`] puts counts and names in words.
//!
//! Every word has its place in a reading, or the answer says which word was not understood.

pub(crate) mod adjectives;
pub(crate) mod conditions;
pub(crate) mod evaluate;
pub(crate) mod evaluator;
pub(crate) mod expression;
pub(crate) mod grammar;
pub(crate) mod nouns;
pub(crate) mod order;
pub(crate) mod outcome;
pub(crate) mod portable;
pub(crate) mod relations;
pub(crate) mod said;
pub(crate) mod slips;
pub(crate) mod tokens;
pub(crate) mod viewpoint;
pub(crate) mod words;

use std::collections::HashSet;

use glam::DVec3;

use self::evaluator::Evaluator;
use self::expression::{Asks, Expression, Sentence, SetOf};
use self::outcome::{Matches, Member, QueryStep, Unmet};
use self::relations::Space;
use self::slips::Mended;
use self::viewpoint::Viewpoint;
use super::parse::ParsedQuery;
use crate::scene::identity::name_words::singular;
use crate::scene::{Camera, Identities, IdentityId, LevelFilter};

/// Most readings that are evaluated.
const MOST_READINGS: usize = 10;

/// Things that were spoken of, for "it", "them" and "the other one".
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct SpokenOf {
    pub(crate) last: Vec<IdentityId>,
    /// Candidates of the last question, or the last answer of several things.
    pub(crate) group: Vec<IdentityId>,
}

/// Place from which a scene is asked.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct QueryPlace {
    /// View that left and right refer to.
    pub(crate) view: Option<Viewpoint>,
    /// Length of a scene unit in meters, if known.
    pub(crate) meters: Option<f64>,
    pub(crate) talk: SpokenOf,
    /// Identities that are no longer there.
    pub(crate) gone: Vec<IdentityId>,
}

impl QueryPlace {
    /// Place of a camera in a scene with an up direction and, if known, the length of its unit in meters.
    pub(crate) fn new(camera: &Camera, up: DVec3, meters: Option<f64>) -> Self {
        let view = Some(Viewpoint { eye: camera.center, forward: camera.forward(), up });
        Self { view, meters, ..Self::default() }
    }
}

/// Scene that is asked.
#[derive(Clone, Copy)]
pub(crate) struct QueryScene<'a> {
    pub(crate) identities: &'a Identities,
    pub(crate) level: LevelFilter,
    pub(crate) place: &'a QueryPlace,
    /// False if names must not be used.
    pub(crate) by_names: bool,
}

impl QueryScene<'_> {
    fn is_there(&self, id: IdentityId) -> bool {
        !self.place.gone.contains(&id)
    }
}

/// Search by embedding.
pub(crate) trait Looks {
    /// Returns the identities that look like a phrase, each with a sureness; several if `plural`.
    ///
    /// # Errors
    /// If the encoder fails, in words.
    fn find(&mut self, phrase: &ParsedQuery, plural: bool) -> Result<Vec<(IdentityId, f64)>, String>;
}

/// Answer to a sentence.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Understood {
    pub(crate) found: Matches,
    /// True if all of them are meant, false if one is.
    pub(crate) plural: bool,
    pub(crate) asks: Asks,
    pub(crate) steps: Vec<QueryStep>,
    /// Remarks, such as "A kind of fruit: apple."
    pub(crate) notes: Vec<String>,
    /// Answer in words, where words are asked for.
    pub(crate) said: Option<String>,
    /// Reason that nothing was found.
    pub(crate) unmet: Option<Unmet>,
    /// True if a match came from the encoder.
    pub(crate) by_looks: bool,
    /// Readings of the sentence.
    pub(crate) readings: usize,
    /// True if it depends on the view.
    pub(crate) of_view: bool,
    /// Number of conditions that removed nothing.
    idle: usize,
    /// True if a comparison or a color that is said of another thing than the one asked for removed nothing.
    idle_inside: bool,
    /// True if a comparison or a color that is said of the thing asked for removed all.
    failed: bool,
    /// True if it joins several sets.
    is_union: bool,
    /// True if it leaves a choice between several sets.
    is_choice: bool,
}

impl Understood {
    /// Returns whether several things fit where one is meant.
    pub(crate) fn is_ambiguous(&self) -> bool {
        let n = self.found.settled().len();
        n > 1 && (self.found.unclear || !self.plural)
    }
}

/// Returns all readings of a text, the best first.
pub(crate) fn read(text: &str, identities: &Identities) -> Vec<Sentence> {
    let mut all = grammar::sentences(text, &tokens::tokens(text), identities);
    all.dedup();
    all.truncate(MOST_READINGS);
    all
}

/// Mends the slips of a text and returns its readings, the best first. A whole name has no slips.
pub(crate) fn hear(identities: &Identities, text: &str) -> (Mended, Vec<Sentence>) {
    let mended = match identities.called(text, LevelFilter::Auto).is_empty() {
        true => slips::mend(identities, text),
        false => Mended { text: text.to_owned(), ..Mended::default() },
    };
    let sentences = read(&mended.text, identities);
    (mended, sentences)
}

/// Returns whether a text can be read as a set of things, and whether all its words are known in this scene.
pub(crate) fn is_thing(text: &str, identities: &Identities) -> [bool; 2] {
    let all = tokens::tokens(text);
    let sets = grammar::Grammar::new(text, all.iter().collect(), identities).all();
    let any = !sets.is_empty();
    [any, sets.into_iter().any(|set| is_known(Sentence { asks: Asks::Things, set }, identities))]
}

fn is_known(sentence: Sentence, identities: &Identities) -> bool {
    let known = identities.words();
    let is_known =
        |phrase: &ParsedQuery| phrase.text.split(' ').all(|w| known.has(w) || crate::scene::colors::row(w).is_some());
    phrases(&[sentence]).iter().all(is_known)
}

/// Returns whether a text asks for an answer in words, or asks in words of its own to see something that is known here:
/// "I am looking for the mug".
pub(crate) fn is_search(text: &str, identities: &Identities) -> bool {
    let tokens = tokens::tokens(text);
    let words: Vec<&str> = tokens.iter().map(|t| t.low.as_str()).collect();
    let opens = words::LanguageWords::get().opener(&words).is_some();
    let mut sentences = read(text, identities).into_iter();
    sentences.next().is_some_and(|s| s.asks != Asks::Things || opens && is_known(s, identities))
}

/// Returns whether a text asks which of several named things is so: "which is bigger, the mug or the lamp".
pub(crate) fn asks_which(text: &str, identities: &Identities) -> bool {
    let is_choice = |sentence: Sentence| match sentence.set.set {
        SetOf::Ranked { of, .. } | SetOf::Where { of, .. } => matches!(of.set, SetOf::Union { either: true, .. }),
        _ => false,
    };
    read(text, identities).into_iter().next().is_some_and(|s| s.asks == Asks::Names && is_choice(s))
}

/// Returns whether a phrase means all there is.
pub(crate) fn means_everything(text: &str, identities: &Identities) -> bool {
    let is_any = |e: &Expression| match &e.set {
        SetOf::Any { .. } => true,
        SetOf::Every { of, .. } => matches!(of.set, SetOf::Any { .. }),
        _ => false,
    };
    read(text, identities).iter().any(|s| is_any(&s.set))
}

/// Returns whether a phrase means several things.
pub(crate) fn means_several(text: &str, identities: &Identities) -> bool {
    read(text, identities).first().is_some_and(|s| s.set.is_plural())
}

/// Phrases that an encoder would be asked for.
pub(crate) fn phrases(sentences: &[Sentence]) -> Vec<ParsedQuery> {
    fn collect(e: &Expression, all: &mut Vec<ParsedQuery>) {
        use self::expression::Condition as C;
        match &e.set {
            SetOf::Words { words, .. } => {
                let phrase = ParsedQuery::undivided(words.join(" "));
                if !all.contains(&phrase) {
                    all.push(phrase);
                }
            }
            SetOf::PartOf(a, b) | SetOf::Except(a, b) | SetOf::Nearest { of: a, to: b, .. } => {
                collect(a, all);
                collect(b, all);
            }
            SetOf::Where { of, is, .. } => {
                collect(of, all);
                match is {
                    C::Placed(_, a) | C::Has(a) | C::Among(a) => collect(a, all),
                    C::Compared { than: a, .. } | C::Within { of: a, .. } => collect(a, all),
                    C::Between(a, b) => {
                        collect(a, all);
                        collect(b, all);
                    }
                    C::Adjective(_) | C::Measured { .. } | C::Side { .. } => {}
                }
            }
            SetOf::Ranked { of, .. } | SetOf::Counted { of, .. } | SetOf::Every { of, .. } => collect(of, all),
            SetOf::One(of) | SetOf::Other(of) | SetOf::Nth { of, .. } => collect(of, all),
            SetOf::Union { of, .. } => of.iter().for_each(|e| collect(e, all)),
            SetOf::Called(_) | SetOf::Any { .. } | SetOf::Kin { .. } | SetOf::Last { .. } | SetOf::Numbered(_) => {}
        }
    }
    let mut all = Vec::new();
    sentences.iter().for_each(|s| collect(&s.set, &mut all));
    all.truncate(16);
    all
}

/// Answers the readings of a text; `None` if there is nothing in it.
pub(crate) fn ask(
    scene: &QueryScene<'_>,
    text: &str,
    sentences: &[Sentence],
    mut looks: Option<&mut dyn Looks>,
) -> Option<Understood> {
    let mut best: Option<Understood> = None;
    let space = scene.place.view.map(|view| Space::new(scene.identities, view));
    for sentence in sentences {
        let looks: Option<&mut dyn Looks> = looks.as_deref_mut().map(|l| l as &mut dyn Looks);
        let new = answer(scene, space.as_ref(), text, sentence, looks);
        best = Some(match best {
            None => new,
            Some(old) => better(old, new),
        });
    }
    let mut best = best?;
    best.readings = sentences.len();
    best.unmet.iter_mut().for_each(|unmet| say_as_typed(unmet, text));
    said::complete(scene, &mut best);
    Some(best)
}

/// Names the words that are a reason as they were typed: "boots", not "boot".
fn say_as_typed(unmet: &mut Unmet, text: &str) {
    for word in &mut unmet.words {
        let typed = tokens::tokens(text).into_iter().map(|t| t.low).find(|typed| singular(typed) == *word);
        if let Some(typed) = typed.filter(|typed| typed != word) {
            unmet.text = unmet.text.replace(&format!("\u{201c}{word}\u{201d}"), &format!("\u{201c}{typed}\u{201d}"));
            *word = typed;
        }
    }
}

fn answer<'a>(
    scene: &'a QueryScene<'a>,
    space: Option<&'a Space<'a>>,
    text: &'a str,
    sentence: &Sentence,
    looks: Option<&'a mut dyn Looks>,
) -> Understood {
    let mut evaluator = Evaluator::new(scene, space, text, looks);
    let found = evaluator.set(&sentence.set);
    let Evaluator { steps, notes, looked, idle, idle_inside, failed, of_view, .. } = evaluator;
    let plural = sentence.set.is_plural() || matches!(sentence.asks, Asks::Count | Asks::Names | Asks::Truth);
    let (found, unmet) = match found {
        Ok(found) => (found, None),
        Err(unmet) => (Matches::default(), Some(unmet)),
    };
    let is_union = matches!(sentence.set.set, SetOf::Union { .. });
    let is_choice = matches!(sentence.set.set, SetOf::Union { either: true, .. });
    let (asks, said, readings) = (sentence.asks, None, 1);
    Understood {
        found,
        plural,
        asks,
        steps,
        notes,
        said,
        unmet,
        by_looks: looked,
        readings,
        of_view,
        idle,
        idle_inside,
        failed,
        is_union,
        is_choice,
    }
}

/// Chooses between the answers of two readings: one that finds a thing, and clearly; if both do and differ, both.
fn better(old: Understood, new: Understood) -> Understood {
    let rank = |u: &Understood| match &u.unmet {
        // "The box on the shelf taller than a meter" is said of the box, even if none is: not of the only shelf. But a
        // reading that misses a word of the sentence, or a piece, is no reason against one that finds a thing.
        None if u.idle_inside => 3,
        // A choice is not clear, and meant so.
        None if !u.is_ambiguous() || u.is_choice => 0,
        None => 1,
        Some(_) if u.failed => 2,
        Some(unmet) => 4 + unmet.why as usize,
    };
    let (a, b) = (rank(&old), rank(&new));
    if b < a {
        return new;
    }
    if a < b || a > 1 {
        return old;
    }
    let ids = |u: &Understood| {
        let mut ids: Vec<IdentityId> = u.found.settled().iter().map(|m| m.id).collect();
        ids.sort_unstable();
        ids
    };
    if ids(&old) == ids(&new) || old.asks != new.asks {
        return old;
    }
    // A condition is said in order to tell things apart: "the mug on the table that is taller than the lamp".
    if old.idle != new.idle {
        return if old.idle < new.idle { old } else { new };
    }
    // "The lid and the knob of the kettle": both of the kettle, if it has both.
    let (a, b) = (ids(&old), ids(&new));
    if old.is_union && new.is_union && (a.iter().all(|id| b.contains(id)) || b.iter().all(|id| a.contains(id))) {
        return if a.len() < b.len() { old } else { new };
    }
    let known: HashSet<IdentityId> = ids(&old).into_iter().collect();
    // All of a plural fit alike, whatever the other reading finds.
    let settled = |u: &Understood| {
        let plural = u.plural;
        u.found.settled().into_iter().map(move |m| Member { rank: if plural { 0 } else { m.rank }, ..m })
    };
    let members = settled(&old).chain(settled(&new).filter(|m| !known.contains(&m.id))).collect();
    Understood { found: Matches { members, unclear: true }, ..old }
}

/// Returns whether two words are equal but for a plural or a typing error.
pub(crate) fn alike(a: &str, b: &str) -> bool {
    let (a, b) = (singular(a), singular(b));
    if a == b {
        return true;
    }
    let short = a.chars().count().min(b.chars().count());
    let most = if short >= 8 { 2 } else { 1 };
    short >= 4 && strsim::damerau_levenshtein(&a, &b) <= most
}

#[cfg(test)]
mod exact_name_tests;
#[cfg(test)]
mod tests;
