//! The words of the command language, as `assets/commands.toml` has them.

use std::sync::OnceLock;

use serde::Deserialize;

use super::camera_args::Direction;
use super::relation::Relation;
use crate::navigate::target::Side;

/// What things are compared by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Key {
    /// Volume of the thing's own box.
    Size,
    /// Along the scene's up.
    Height,
    /// The longer level edge.
    Length,
    /// Place to the right as seen now.
    Right,
    Up,
    Distance,
}

/// A command, as people read of it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CommandHelp {
    /// By which its task is found.
    pub(crate) id: String,
    /// What it does.
    pub does: String,
    /// An example; `{}` stands for a thing.
    pub example: String,
    /// How it is said.
    pub forms: Vec<String>,
}

/// The file. What each list is for is said there.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CommandLanguage {
    pub(crate) openers: Vec<String>,
    pub(crate) yes: Vec<String>,
    pub(crate) no: Vec<String>,
    pub(crate) determiners: Vec<String>,
    pub(crate) standing: Vec<String>,
    no_name: String,
    pub(crate) sides: Vec<(String, Side)>,
    pub(crate) directions: Vec<(String, Direction)>,
    pub(crate) relations: Vec<(String, Relation)>,
    pub(crate) most: Vec<(String, Key)>,
    pub(crate) least: Vec<(String, Key)>,
    pub(crate) more: Vec<(String, Key)>,
    pub(crate) less: Vec<(String, Key)>,
    pub(crate) amounts: Vec<(String, f64)>,
    pub(crate) units: Vec<(String, f64)>,
    pub(crate) steps: Vec<(String, f64)>,
    pub(crate) angles: Vec<(String, f64)>,
    pub(crate) command: Vec<CommandHelp>,
}

/// What a list has for a text.
pub(super) fn find<T: Copy>(list: &[(String, T)], text: &str) -> Option<T> {
    list.iter().find(|(word, _)| word == text).map(|(_, value)| *value)
}

impl CommandLanguage {
    /// The one that is built in: a test reads it, so that it is never none.
    pub(crate) fn get() -> &'static Self {
        static READ: OnceLock<CommandLanguage> = OnceLock::new();
        READ.get_or_init(|| Self::read().unwrap_or_default())
    }

    fn read() -> Result<Self, toml::de::Error> {
        toml::from_str(include_str!("../../assets/commands.toml"))
    }

    /// Whether no name has this word, unless it is said as a whole.
    pub(crate) fn is_no_name(&self, word: &str) -> bool {
        static WORDS: OnceLock<Vec<&str>> = OnceLock::new();
        let words = || Self::get().no_name.split_whitespace().collect();
        WORDS.get_or_init(words).contains(&word) || self.determiners.iter().any(|w| w == word)
    }

    /// The relation that these words begin with, and how many words say it: the longest.
    pub(crate) fn relation_at(&self, words: &[&str]) -> Option<(Relation, usize)> {
        let first = words.first().copied().unwrap_or("-");
        let begun = self.relations.iter().filter(|(phrase, _)| phrase.starts_with(first));
        let found = begun.filter_map(|(phrase, relation)| {
            let n = phrase.split(' ').count();
            (words.len() >= n && phrase.split(' ').eq(words[..n].iter().copied())).then_some((*relation, n))
        });
        found.max_by_key(|(_, n)| *n)
    }
}

/// All commands; of two that fit, the first is meant.
pub fn commands() -> &'static [CommandHelp] {
    &CommandLanguage::get().command
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_in_language_can_be_read() {
        let read = CommandLanguage::read().expect("the language");
        assert!(read.command.len() > 30 && read.relation_at(&["on", "top", "of", "it"]) == Some((Relation::On, 3)));
        assert!(CommandLanguage::get().is_no_name("and") && !CommandLanguage::get().is_no_name("lamp"));
    }
}
