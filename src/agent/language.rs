//! Words of the command language, read from `assets/commands.toml`.

use std::sync::OnceLock;

use serde::Deserialize;

use super::camera_args::Direction;
use crate::navigate::target::Side;

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
    pub(crate) sides: Vec<(String, Side)>,
    pub(crate) directions: Vec<(String, Direction)>,
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
        assert!(read.command.len() > 30);
    }
}
