//! Reading of a typed query in a scene: its slips mended, its sentences, and the phrase that an encoder is asked for.

use super::grounds::without_courtesy;
use super::language::expression::{Asks, Condition, Expression, Sentence, SetOf};
use super::language::slips::Pairs;
use super::language::{self};
use super::parse::ParsedQuery;
use super::recipe::{MatchBy, QueryConfig};
use crate::scene::{Identities, LevelFilter};

/// A query as it is answered.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct QueryReading {
    /// The text with its slips mended; sentences refer to its bytes.
    pub(crate) text: String,
    /// Readings of the text, the best first.
    pub(crate) sentences: Vec<Sentence>,
    /// The text as one phrase, or as a piece of a whole.
    pub(crate) phrase: ParsedQuery,
    /// Words taken for slips, each with its correction.
    pub(crate) mended: Pairs,
    /// Unknown words near a word of the scene: suggestions if nothing is found.
    pub(crate) near: Pairs,
}

impl QueryReading {
    /// Reads a query about these identities; `None` if there is nothing in it.
    pub(crate) fn new(identities: &Identities, query: &str, recipe: &QueryConfig) -> Option<Self> {
        let query = query.trim();
        if recipe.match_by == MatchBy::Embedding {
            // Names are not used.
            let (text, sentences) = (query.to_owned(), language::read(query, &Identities::default()));
            let phrase = ParsedQuery::parse(query)?;
            return Some(Self { text, sentences, phrase, mended: Vec::new(), near: Vec::new() });
        }
        let (mended, sentences) = language::hear(identities, query);
        let is_name = || !identities.called(query, LevelFilter::Auto).is_empty();
        let phrase = ParsedQuery::parse(without_courtesy(&mended.text));
        let phrase = phrase.or_else(|| is_name().then(|| ParsedQuery::undivided(query.to_lowercase())))?;
        Some(Self { text: mended.text, sentences, phrase, mended: mended.slips, near: mended.near })
    }

    /// Returns whether it asks for a thing or a piece of one, without relations and the like.
    pub(crate) fn is_plain(&self) -> bool {
        fn plain(e: &Expression) -> bool {
            match &e.set {
                SetOf::Words { .. } | SetOf::Called(_) | SetOf::Numbered(_) => true,
                SetOf::PartOf(piece, whole) => plain(piece) && plain(whole),
                SetOf::One(of) => plain(of),
                SetOf::Where { of, is: Condition::Adjective(_), not: false } => matches!(of.set, SetOf::Any { .. }),
                _ => false,
            }
        }
        self.sentences.first().is_none_or(|s| s.asks == Asks::Things && plain(&s.set))
    }

    /// Phrases that an encoder is asked for.
    pub(crate) fn phrases(&self) -> Vec<ParsedQuery> {
        let own = vec![self.phrase.clone()];
        if self.is_plain() { own } else { [own, language::phrases(&self.sentences)].concat() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Level, NO_IDENTITY};

    #[test]
    fn readings_are_mended_and_plain_ones_are_told_from_others() {
        let mut all = Identities::default();
        let kettle = all.add(Level::Object, NO_IDENTITY, vec!["kettle".into()]);
        all.add(Level::Part, kettle, vec!["lid".into()]);
        let read = |text: &str| QueryReading::new(&all, text, &QueryConfig::default());
        let plain = read("please show me the lid of the ketle").expect("words");
        assert_eq!((plain.phrase.target.as_str(), plain.phrase.whole.as_deref()), ("lid", Some("kettle")));
        assert!(plain.is_plain() && plain.mended == [("ketle".to_owned(), "kettle".to_owned())]);
        let placed = read("the mug left of the kettle").expect("words");
        assert!(!placed.is_plain() && placed.phrases().len() == 3, "{:?}", placed.phrases());
        assert!(read(" ?! ").is_none() && read("\t").is_none());
        for text in ["lamp ".repeat(5_000), "x".repeat(5_000), "的".repeat(900), "a\u{0}b \u{202e}lmap".into()] {
            assert!(read(&text).is_some());
        }
    }
}
