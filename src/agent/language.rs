//! Words of the command language, read from `assets/commands.toml`.

use std::sync::OnceLock;

use serde::Deserialize;

use super::camera_args::Direction;
use super::relation::Relation;
use crate::navigate::target::Side;

/// Quantity by which things are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Key {
    /// Volume of the thing's own upright box.
    Size,
    /// Extent along the scene's up direction.
    Height,
    /// Longer horizontal edge.
    Length,
    /// Position to the right in the current view.
    Right,
    Up,
    Distance,
}

/// Command with its help.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CommandHelp {
    /// Identifier of its task.
    pub(crate) id: String,
    /// Description for the user.
    pub does: String,
    /// Example; `{}` stands for a thing.
    pub example: String,
    /// Forms in which it can be typed.
    pub forms: Vec<String>,
}

/// Contents of the file, which documents each list.
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

/// Looks up the value of a text in a list.
pub(super) fn find<T: Copy>(list: &[(String, T)], text: &str) -> Option<T> {
    list.iter().find(|(word, _)| word == text).map(|(_, value)| *value)
}

impl CommandLanguage {
    /// Returns the built-in language. A test parses it, so the fallback to an empty one is never used.
    pub(crate) fn get() -> &'static Self {
        static READ: OnceLock<CommandLanguage> = OnceLock::new();
        READ.get_or_init(|| Self::read().unwrap_or_default())
    }

    fn read() -> Result<Self, toml::de::Error> {
        toml::from_str(include_str!("../../assets/commands.toml"))
    }

    /// Returns whether a word counts as part of a name only within a complete name.
    pub(crate) fn is_no_name(&self, word: &str) -> bool {
        static WORDS: OnceLock<Vec<&str>> = OnceLock::new();
        let words = || Self::get().no_name.split_whitespace().collect();
        WORDS.get_or_init(words).contains(&word) || self.determiners.iter().any(|w| w == word)
    }

    /// Longest relation that `words` begin with, and its number of words.
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

/// All commands; if two match, the first wins.
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
