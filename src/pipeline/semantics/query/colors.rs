//! Color words in questions and names: a thing of another color is another thing.

use crate::scene::colors::{COLORS, row};
use crate::scene::identity::name_words::words;

/// Returns the colors that a phrase names, by row. A last word is the thing itself: an orange.
pub(crate) fn named(phrase: &str) -> Vec<usize> {
    let words = words(phrase);
    words.iter().take(words.len().saturating_sub(1)).filter_map(|w| row(w)).collect()
}

/// Returns the words of a phrase that are no colors.
pub(crate) fn without(phrase: &str) -> Vec<String> {
    let words = words(phrase);
    let last = words.len().saturating_sub(1);
    words.into_iter().enumerate().filter(|(i, w)| *i == last || row(w).is_none()).map(|(_, w)| w).collect()
}

/// Returns the phrase with its first color replaced by each of the others; none if it has no color.
pub(crate) fn alternatives(phrase: &str) -> Vec<String> {
    let said: Vec<&str> = phrase.split(' ').collect();
    let last = said.len() - 1;
    let Some((at, own)) = said.iter().take(last).enumerate().find_map(|(i, w)| Some((i, row(w)?))) else {
        return Vec::new();
    };
    let exchanged = |other: &&[&str]| {
        let mut words = said.clone();
        words[at] = other[0];
        words.join(" ")
    };
    COLORS.iter().enumerate().filter(|(row, _)| *row != own).map(|(_, other)| exchanged(other)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colors_are_what_something_has_and_not_what_it_is() {
        assert_eq!(named("red and grey mug").len(), 2);
        assert_eq!(named("gray mug"), named("grey lamp"));
        assert!(named("orange").is_empty() && named("mug").is_empty() && named("").is_empty());
        let others = alternatives("handle of the red mug");
        assert_eq!(others.len(), COLORS.len() - 1);
        assert!(others.contains(&"handle of the blue mug".to_owned()) && !others.iter().any(|o| o.contains("red")));
        assert!(alternatives("orange").is_empty() && alternatives("mug").is_empty() && alternatives("").is_empty());
    }
}
