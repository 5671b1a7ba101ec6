//! Reading of a typed query in a scene. A whole name comes first; else slips are mended by the words of the scene's
//! own names, and noun compounds ("kettle spout") are read as pieces of wholes if names say so.

use std::collections::BTreeMap;

use super::grounds::{BINDING, without_courtesy};
use super::parse::{MAX_CHARS, ParsedQuery, is_glue};
use super::recipe::{MatchBy, QueryConfig};
use super::words::{singular, words, written};
use crate::models;
use crate::scene::identity::whole_names::key;
use crate::scene::{Identities, IdentityId, LevelFilter};

/// Pairs of a typed word and another one.
pub(crate) type Pairs = Vec<(String, String)>;

/// A query as it is answered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct QueryReading {
    pub(crate) phrase: ParsedQuery,
    /// Identities whose name is the whole text or piece; none if the grammar decides.
    pub(crate) called: Vec<IdentityId>,
    /// Words taken for slips, each with its correction.
    pub(crate) mended: Pairs,
    /// Unknown words near a word of the scene: suggestions if nothing is found.
    pub(crate) near: Pairs,
}

/// Least length of a mended word and of its correction, in letters: short words differ by one letter and mean
/// something else.
const SHORTEST: usize = 4;
/// Length of a word from which two slips are mended, in letters.
const LONG: usize = 8;
/// Most words of a compound.
const MOST_WORDS: usize = 10;

impl QueryReading {
    /// Reads a query about these identities; `None` if there is nothing in it.
    pub(crate) fn new(identities: &Identities, query: &str, level: LevelFilter, recipe: &QueryConfig) -> Option<Self> {
        if recipe.match_by == MatchBy::Embedding {
            // Names are not used.
            let phrase = ParsedQuery::parse(query)?;
            return Some(Self { phrase, called: Vec::new(), mended: Vec::new(), near: Vec::new() });
        }
        for query in [query, without_courtesy(query)] {
            let called = identities.called(query, level);
            if !called.is_empty() {
                let text = ParsedQuery::parse(query).map_or_else(|| key(query), |p| p.text);
                return Some(Self { phrase: ParsedQuery::undivided(text), called, mended: vec![], near: vec![] });
            }
        }
        let query = without_courtesy(query);
        let (text, mended, near) = mend_all(identities, query);
        let partings = ParsedQuery::partings(&text);
        let (at, called) = by_whole_names(identities, &text, &partings, level);
        let parsed = partings.into_iter().nth(at)?;
        // The requested level is respected.
        let is_compound = called.is_empty() && level != LevelFilter::Object;
        let compound =
            if is_compound { bound(identities, &parsed).or_else(|| compound(identities, &parsed)) } else { None };
        Some(Self { phrase: compound.unwrap_or(parsed), called, mended, near })
    }
}

/// Returns the index of the parting by whole names, and the identities with that name: "lid of the doll's house" is
/// about the doll's house, if there is one.
fn by_whole_names(
    identities: &Identities,
    text: &str,
    partings: &[ParsedQuery],
    level: LevelFilter,
) -> (usize, Vec<IdentityId>) {
    let called = identities.called(text, level);
    if !called.is_empty() || level == LevelFilter::Object {
        return (0, called);
    }
    let mut of_whole = None;
    for (at, parting) in partings.iter().enumerate() {
        let whole = parting.whole.as_ref().map(|whole| identities.called(whole, LevelFilter::Auto)).unwrap_or_default();
        if whole.is_empty() {
            continue;
        }
        let is_piece = |id: &IdentityId| identities.ancestors(*id).skip(1).any(|i| whole.contains(&i));
        let pieces: Vec<_> = identities.called(&parting.target, level).into_iter().filter(is_piece).collect();
        if !pieces.is_empty() {
            return (at, pieces);
        }
        of_whole = of_whole.or(Some(at));
    }
    (of_whole.unwrap_or(0), Vec::new())
}

/// Returns the text in lower case with slips of the scene's own words mended, and the mended words.
pub(crate) fn mend(identities: &Identities, text: &str) -> (String, Pairs) {
    let (text, mended, _) = mend_all(identities, text);
    (text, mended)
}

fn mend_all(identities: &Identities, text: &str) -> (String, Pairs, Pairs) {
    let known = vocabulary(identities);
    let (mut mended, mut near) = (Vec::new(), Vec::new());
    let text = by_words(text, |word| match slip(word, &known) {
        Slip::Of(right) => {
            mended.push((word.to_owned(), right.clone()));
            Some(right)
        }
        Slip::Near(other) => {
            near.push((word.to_owned(), other));
            None
        }
        Slip::None => None,
    });
    (text, mended, near)
}

/// Describes the mended words in a sentence; `None` if there are none.
pub(crate) fn mended_text(mended: &[(String, String)]) -> Option<String> {
    let each: Vec<String> = mended.iter().map(|(typed, read)| format!("\"{typed}\" as \"{read}\"")).collect();
    (!each.is_empty()).then(|| format!("Read {}.", each.join(", ")))
}

/// Words of all names as they are written, by their singular.
type SceneWords = BTreeMap<String, String>;

fn vocabulary(identities: &Identities) -> SceneWords {
    identities.iter().flat_map(|(_, i)| &i.names).flat_map(|n| written(n)).map(|w| (singular(&w), w)).collect()
}

/// Returns the text with each word exchanged for which `instead` gives another one.
fn by_words(text: &str, mut instead: impl FnMut(&str) -> Option<String>) -> String {
    let text: String = text.chars().take(MAX_CHARS).collect::<String>().to_lowercase();
    let mut all = String::with_capacity(text.len());
    for run in text.split_inclusive(|c: char| !c.is_alphanumeric()) {
        let word = run.trim_end_matches(|c: char| !c.is_alphanumeric());
        all.push_str(&instead(word).unwrap_or_else(|| word.to_owned()));
        all.push_str(&run[word.len()..]);
    }
    all
}

/// Relation of a word to the words of the scene.
enum Slip {
    /// Slip of this word.
    Of(String),
    /// Unknown word that is near this one.
    Near(String),
    None,
}

fn slip(word: &str, known: &SceneWords) -> Slip {
    let is_known = |w: &str| known.contains_key(w) || known.contains_key(&singular(w)) || is_glue(w);
    if matches!(word, "teh" | "hte") && !is_known(word) {
        return Slip::Of("the".into());
    }
    let letters = word.chars().count();
    if letters < SHORTEST || !word.chars().all(char::is_alphabetic) || is_known(word) {
        return Slip::None;
    }
    let most = if letters >= LONG { 2 } else { 1 };
    let letters_of = |w: &str| {
        w.chars().fold(BTreeMap::new(), |mut n, c| {
            *n.entry(c).or_insert(0) += 1;
            n
        })
    };
    let mut near = Vec::new();
    for (single, written) in known.iter().filter(|(_, w)| w.chars().count() >= SHORTEST) {
        // A slip at the first letter swaps it with the second, or drops it.
        if !written.chars().take(2).any(|c| word.starts_with(c)) {
            continue;
        }
        let far = |other: &str| strsim::damerau_levenshtein(word, other);
        let far = far(written).min(far(single)).min(strsim::damerau_levenshtein(&singular(word), single));
        if far <= most {
            // Letters that only changed places are the likelier slip.
            near.push(((far, letters_of(written) != letters_of(word)), written));
        }
    }
    near.sort();
    match near.as_slice() {
        // Two words at the same distance are a guess.
        [a, b, ..] if a.0 == b.0 => Slip::None,
        [(_, other), ..] if models::is_word(word) => Slip::Near((*other).clone()),
        [(_, other), ..] => Slip::Of((*other).clone()),
        [] => Slip::None,
    }
}

/// Reads "B in the A" as "B of the A" if names say that B is a piece of A: both must have the last words of their
/// phrases.
fn bound(identities: &Identities, phrase: &ParsedQuery) -> Option<ParsedQuery> {
    let raw: Vec<&str> = phrase.text.split_whitespace().collect();
    let at = raw.iter().position(|word| BINDING.contains(word)).filter(|_| phrase.whole.is_none())?;
    let parted = ParsedQuery::parse(&format!("{} of {}", raw[..at].join(" "), raw[at + 1..].join(" ")))?;
    let asked = |text: &str| text.split_whitespace().map(words).collect::<Vec<_>>();
    let (piece, whole) = (asked(&parted.target), asked(parted.whole.as_ref()?));
    let is_called = |id: IdentityId, asked: &[Vec<String>]| {
        identities.get(id).is_some_and(|i| i.names.iter().any(|name| has_last(asked, &words(name))))
    };
    let is_piece = |id: IdentityId| {
        is_called(id, &piece) && identities.ancestors(id).skip(1).any(|whole_id| is_called(whole_id, &whole))
    };
    identities.iter().any(|(id, _)| is_piece(id)).then_some(parted)
}

/// Reads "A B" as "B of the A" if that explains more words by names than any single name does. A is in the name of a
/// whole and B in that of one of its pieces, both with the last words of their phrases.
fn compound(identities: &Identities, phrase: &ParsedQuery) -> Option<ParsedQuery> {
    let raw: Vec<&str> = phrase.text.split_whitespace().collect();
    if phrase.whole.is_some() || !(2..=MOST_WORDS).contains(&raw.len()) {
        return None;
    }
    let asked: Vec<Vec<String>> = raw.iter().map(|w| words(w)).collect();
    let names: Vec<Vec<Vec<String>>> =
        identities.iter().map(|(_, i)| i.names.iter().map(|n| words(n)).collect()).collect();
    let names_of = |id: IdentityId| names.get(id as usize - 1).map(Vec::as_slice).unwrap_or_default();
    let alone = names.iter().flatten().map(|n| explained(&asked, n)).max().unwrap_or(0);
    let (mut best, mut split) = ((alone, 0.0), None);
    for (id, _) in identities.iter() {
        let pieces = names_of(id).iter().filter(|n| has_last(&asked, n));
        for (piece, whole) in
            pieces.flat_map(|p| identities.ancestors(id).skip(1).flat_map(names_of).map(move |w| (p, w)))
        {
            for i in 1..asked.len() {
                let (left, right) = asked.split_at(i);
                if !has_last(left, whole) {
                    continue;
                }
                let (by_whole, by_piece) = (explained(left, whole), explained(right, piece));
                // The query should have most of both names; the first of equals has the longest piece.
                let said = by_whole as f64 / whole.len() as f64 + by_piece as f64 / piece.len() as f64;
                let new = (by_whole + by_piece, said);
                if new.0 > alone && (new.0 > best.0 || (new.0 == best.0 && new.1 > best.1)) {
                    (best, split) = (new, Some(i));
                }
            }
        }
    }
    let (whole, piece) = raw.split_at(split?);
    let (whole, target) = (whole.join(" "), piece.join(" "));
    Some(ParsedQuery { text: format!("{target} of the {whole}"), target, whole: Some(whole) })
}

/// Counts the words that are in a name, each word of the name used once.
fn explained(asked: &[Vec<String>], name: &[String]) -> usize {
    let mut left: Vec<&String> = name.iter().collect();
    let mut take = |word: &String| left.iter().position(|n| *n == word).map(|at| left.swap_remove(at)).is_some();
    asked.iter().filter(|ws| !ws.is_empty() && ws.iter().all(&mut take)).count()
}

fn has_last(asked: &[Vec<String>], name: &[String]) -> bool {
    asked.last().is_some_and(|ws| !ws.is_empty() && ws.iter().all(|w| name.contains(w)))
}

#[cfg(test)]
mod exact_name_tests;

#[cfg(test)]
mod tests {
    use super::super::answer::by_name;
    use super::super::localize::Answer;
    use super::super::recipe::Rejection;
    use super::*;
    use crate::scene::{Level, NO_IDENTITY};

    /// Returns the demo's scene, and the lists of questions.
    fn data() -> (Identities, toml::Table) {
        let table: toml::Table =
            include_str!("../../../../../tests/data/compounds_and_slips.toml").parse().expect("sound TOML");
        let mut all = Identities::default();
        for (object, parts) in table["scene"].as_table().expect("a table") {
            let id = all.add(Level::Object, NO_IDENTITY, vec![object.clone()]);
            for part in parts.as_array().expect("a list") {
                all.add(Level::Part, id, vec![part.as_str().expect("a name").into()]);
            }
        }
        (all, table)
    }

    fn rows<'a>(table: &'a toml::Table, list: &str) -> Vec<Vec<&'a str>> {
        let texts = |row: &'a toml::Value| {
            row.as_array().expect("a row").iter().map(|t| t.as_str().expect("a text")).collect::<Vec<_>>()
        };
        table[list].as_array().expect("a list").iter().map(texts).collect()
    }

    /// Describes a reading in the words of the lists.
    fn summary(all: &Identities, reading: &QueryReading) -> String {
        summary_by(all, reading, &QueryConfig::default())
    }

    fn summary_by(all: &Identities, reading: &QueryReading, recipe: &QueryConfig) -> String {
        let answered = by_name(all, reading, LevelFilter::Auto, recipe);
        let first = answered.answer.hits().first().map(|h| all.full_name(h.identity)).unwrap_or_default();
        match answered.answer {
            Answer::Found(_) => first,
            Answer::Ambiguous(_) => format!("ambiguous {first}"),
            Answer::NotFound(_) => "not found".into(),
        }
    }

    fn read(all: &Identities, text: &str) -> QueryReading {
        QueryReading::new(all, text, LevelFilter::Auto, &QueryConfig::default()).expect("words")
    }

    /// Returns a question as read by its grammar alone.
    fn plain(text: &str) -> QueryReading {
        let phrase = ParsedQuery::parse(text).expect("words");
        QueryReading { phrase, called: vec![], mended: vec![], near: vec![] }
    }

    #[test]
    fn compounds_are_pieces_of_wholes_and_nothing_else_changes() {
        let (all, table) = data();
        let lists = [rows(&table, "compounds"), rows(&table, "kept")];
        assert!(lists[0].len() >= 40);
        let mut wrong = Vec::new();
        for row in lists.iter().flatten() {
            let found = summary(&all, &read(&all, row[0]));
            if found != row[1] {
                wrong.push(format!("{}: {found}, not {}", row[0], row[1]));
            }
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
        for row in &lists[1] {
            assert_eq!(read(&all, row[0]).phrase.text, plain(row[0]).phrase.text, "{}", row[0]);
        }
        // Without the reading most are wrong if words may be left over, and a requested object is no piece.
        let lax = QueryConfig { rejection: Rejection::Canonical, ..QueryConfig::default() };
        let is_plain = |row: &&Vec<&str>| summary_by(&all, &plain(row[0]), &lax) == row[1];
        assert!(lists[0].iter().filter(is_plain).count() * 4 < lists[0].len());
        let object =
            QueryReading::new(&all, "kettle spout", LevelFilter::Object, &QueryConfig::default()).expect("words");
        assert_eq!((object.phrase.target.as_str(), object.phrase.whole), ("kettle spout", None));
        // By embedding, names are not used: they decide neither compounds nor slips.
        let paper = QueryReading::new(&all, "ketle spout", LevelFilter::Auto, &QueryConfig::paper()).expect("words");
        assert_eq!((paper.phrase.text.as_str(), paper.phrase.whole, paper.mended), ("ketle spout", None, vec![]));
    }

    #[test]
    fn slips_are_mended_word_by_word_and_words_of_their_own_are_not() {
        let (all, table) = data();
        let (slips, own) = (rows(&table, "slips"), rows(&table, "own_words"));
        assert!(slips.len() >= 40);
        for row in &slips {
            let reading = read(&all, row[0]);
            let said: Vec<String> = reading.mended.iter().map(|(a, b)| format!("{a}={b}")).collect();
            let mut wanted: Vec<&str> = row[2].split(' ').collect();
            wanted.sort_by_key(|w| row[0].find(w.split('=').next().unwrap_or_default()));
            assert_eq!((said.join(" "), summary(&all, &reading)), (wanted.join(" "), row[1].into()), "{}", row[0]);
        }
        for row in &own {
            assert!(read(&all, row[0]).mended.is_empty(), "{}", row[0]);
            assert_ne!(summary(&all, &read(&all, row[0])), row[1], "{}", row[0]);
        }
        assert_eq!(read(&all, "lamb").near, [("lamb".into(), "lamp".into())]);
        // The words of another scene are its own; names are never mended.
        let mut other = Identities::default();
        other.add(Level::Object, NO_IDENTITY, vec!["kettel".into(), "teh".into()]);
        assert!(read(&other, "teh kettel").mended.is_empty());
        assert!(rows(&table, "compounds").iter().all(|row| read(&all, row[0]).mended.is_empty()));
        let mended = read(&all, "buton of teh lmap").mended;
        assert_eq!(mended_text(&mended[1..]).as_deref(), Some("Read \"teh\" as \"the\", \"lmap\" as \"lamp\"."));
        assert_eq!(mended_text(&[]), None);
    }

    #[test]
    fn strange_texts_are_read_in_no_time() {
        let (all, _) = data();
        assert!(QueryReading::new(&all, " \t", LevelFilter::Auto, &QueryConfig::default()).is_none());
        for text in ["lamp ".repeat(5_000), "x".repeat(5_000), "的".repeat(900), "a\u{0}b \u{202e}lmap".into()] {
            assert!(QueryReading::new(&all, &text, LevelFilter::Auto, &QueryConfig::default()).is_some());
        }
    }
}
