//! A color for each phrase, the same in every view and every time.

use std::collections::HashMap;

/// Colors that are easy to distinguish in a picture, and from the selection.
const COLORS: [[u8; 3]; 12] = [
    [255, 179, 0],
    [225, 90, 255],
    [128, 215, 70],
    [233, 84, 150],
    [160, 130, 255],
    [255, 120, 70],
    [240, 235, 90],
    [70, 110, 255],
    [0, 170, 120],
    [0, 200, 215],
    [205, 165, 120],
    [255, 175, 190],
];

/// Phrases with their colors, in the order of their first use.
#[derive(Clone, Debug, Default)]
pub(crate) struct PhraseColors {
    known: HashMap<String, usize>,
}

impl PhraseColors {
    /// Returns the color of a phrase, or the one that it would get.
    pub(crate) fn of(&self, phrase: &str) -> [u8; 3] {
        let place = self.known.get(&normal(phrase)).copied().unwrap_or(self.known.len());
        COLORS[place % COLORS.len()]
    }

    /// Gives a phrase its color for good, if it has none yet.
    pub(crate) fn keep(&mut self, phrase: &str) {
        let (phrase, next) = (normal(phrase), self.known.len());
        if !phrase.is_empty() {
            self.known.entry(phrase).or_insert(next);
        }
    }

    /// Gives all phrases of a list their colors.
    pub(crate) fn keep_all(&mut self, phrases: &[String]) {
        phrases.iter().for_each(|phrase| self.keep(phrase));
    }
}

/// Normalizes a phrase: lower case, single spaces.
fn normal(phrase: &str) -> String {
    phrase.split_whitespace().map(str::to_lowercase).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn a_phrase_keeps_the_color_that_it_had_first() {
        let mut colors = PhraseColors::default();
        let lamp = colors.of("lamp");
        assert_eq!(colors.of("mug"), lamp, "nothing has it yet");
        colors.keep_all(&["".into(), "lamp".into(), "mug".into()]);
        assert_eq!((colors.of("lamp"), colors.of(" LAMP ")), (lamp, lamp));
        assert!(colors.of("mug") != lamp && colors.of("kettle") != colors.of("mug"));
        let mug = colors.of("mug");
        let others: Vec<String> = (0..10).map(|i| format!("thing {i}")).collect();
        colors.keep_all(&others);
        assert_eq!((colors.of("lamp"), colors.of("mug")), (lamp, mug), "whatever else was asked");
        let all: HashSet<[u8; 3]> = others.iter().map(|p| colors.of(p)).chain([lamp, mug]).collect();
        assert_eq!(all.len(), 12, "as long as there are colors, each has its own");
    }
}
