//! Color words: basic terms with their near synonyms, and words for how dark, light or colorful something is.

/// Color words; near synonyms share a row, the first of which is the basic term.
pub(crate) const COLORS: [&[&str]; 13] = [
    &["black"],
    &["blue", "navy", "azure"],
    &["brown"],
    &["gray", "grey", "silver"],
    &["green", "olive", "lime"],
    &["orange"],
    &["pink", "magenta", "fuchsia"],
    &["purple", "violet", "lilac", "lavender", "indigo"],
    &["red", "crimson", "scarlet", "maroon", "burgundy"],
    &["turquoise", "teal", "cyan", "aqua", "aquamarine"],
    &["white"],
    &["yellow", "gold", "golden", "mustard"],
    &["beige", "tan", "cream", "ivory", "khaki"],
];

/// Row of brown, which is what people call dim orange and dim yellow.
pub(super) const BROWN: usize = 2;
/// Rows whose shade is brown: orange and yellow.
pub(super) const SHADED_BROWN: [usize; 2] = [5, 11];

/// Row of a color word.
pub(crate) fn row(word: &str) -> Option<usize> {
    COLORS.iter().position(|all| all.contains(&word))
}

/// Quality of a color that has no hue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ColorTone {
    Dark,
    Light,
    /// Of several vivid hues.
    Colorful,
}

/// Returns the tone that a word says. A word such as "navy" says a color, too.
pub(crate) fn tone(word: &str) -> Option<ColorTone> {
    match word {
        "dark" | "navy" | "maroon" | "burgundy" => Some(ColorTone::Dark),
        "light" | "bright" | "pale" | "pastel" => Some(ColorTone::Light),
        "colorful" | "colourful" | "multicolored" | "multicoloured" => Some(ColorTone::Colorful),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_synonyms_share_a_row_and_no_word_is_in_two() {
        for (word, term) in [
            ("grey", "gray"),
            ("silver", "gray"),
            ("violet", "purple"),
            ("teal", "turquoise"),
            ("cyan", "turquoise"),
            ("navy", "blue"),
            ("crimson", "red"),
            ("olive", "green"),
            ("golden", "yellow"),
            ("cream", "beige"),
        ] {
            assert_eq!(row(word).map(|row| COLORS[row][0]), Some(term), "{word}");
        }
        assert!([row("lamp"), row("dark"), row(""), row("Red")].iter().all(Option::is_none));
        let mut words: Vec<&str> = COLORS.concat();
        let count = words.len();
        words.sort_unstable();
        words.dedup();
        assert_eq!(words.len(), count);
        assert_eq!((COLORS[BROWN][0], SHADED_BROWN.map(|row| COLORS[row][0])), ("brown", ["orange", "yellow"]));
    }

    #[test]
    fn words_for_tones_are_british_too() {
        assert_eq!((tone("dark"), tone("pale")), (Some(ColorTone::Dark), Some(ColorTone::Light)));
        assert_eq!((tone("colourful"), tone("colorful")), (Some(ColorTone::Colorful), Some(ColorTone::Colorful)));
        assert_eq!((tone("navy"), tone("blue"), tone("")), (Some(ColorTone::Dark), None, None));
    }
}
