//! Words of names: heads, plurals, and the shorter nouns that also fit.

use std::collections::BTreeSet;

use super::color::is_color;

/// Words that say where a part is. Alone they name a side of anything.
const SIDES: [&str; 10] = ["left", "right", "front", "back", "rear", "top", "bottom", "upper", "lower", "side"];
/// First words that the short name of a part leaves out, as colors are.
const LEFT_OUT: [&str; 10] = ["left", "right", "front", "back", "rear", "upper", "lower", "menu", "start", "shutter"];
/// Singular nouns that end like plurals.
const SINGULAR: [&str; 5] = ["lens", "gas", "bus", "canvas", "compass"];
/// Plurals that follow no rule.
const IRREGULAR: [(&str, &str); 4] = [("leaf", "leaves"), ("shelf", "shelves"), ("knife", "knives"), ("mouse", "mice")];
/// Numbers in words.
pub(super) const NUMBERS: [&str; 10] = ["zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine"];

/// Words of a name in lower case, without numbers; in `wheel-back` the side moves to the front.
pub(super) fn words(name: &str) -> Vec<String> {
    let pieces = name.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty());
    let mut words: Vec<String> = pieces.map(str::to_lowercase).collect();
    let has_letter = |word: &String| word.chars().any(char::is_alphabetic);
    if words.iter().any(has_letter) {
        words.retain(has_letter);
    }
    let ends_with_side = words.last().is_some_and(|w| is_side(w));
    if words.len() > 1 && ends_with_side && !name.contains(' ') {
        words.rotate_right(1);
    }
    words
}

pub(super) fn is_side(word: &str) -> bool {
    SIDES.contains(&word)
}

/// Nouns that fit a name, in the singular, with true where the name is a plural: "red controller" and "controller", or
/// "button a" and "button".
pub(super) fn keys(words: &[String], is_part: bool) -> BTreeSet<(String, bool)> {
    let Some(last) = words.len().checked_sub(1) else { return BTreeSet::new() };
    let head = words.iter().rposition(|w| w.chars().count() > 1).unwrap_or(last);
    let mut single = words.to_vec();
    single[head] = singular(&words[head]);
    let grouped = single[head] != words[head];
    let mut keys = BTreeSet::from([(single.join(" "), grouped)]);
    for start in 0..=head {
        let may_drop = |w: &String| !is_part || is_color(w) || LEFT_OUT.contains(&w.as_str());
        let begins_well = start == 0 || start == head || !is_side(&words[start]);
        if begins_well && words[..start].iter().all(may_drop) {
            keys.insert((single[start..=head].join(" "), grouped));
        }
    }
    keys
}

/// Plural of a noun; `None` for one that ends in a letter, such as "button a".
pub(super) fn plural(noun: &str) -> Option<String> {
    let (rest, word) = noun.rsplit_once(' ').unwrap_or(("", noun));
    if word.chars().count() < 2 {
        return None;
    }
    let ends = |endings: &[&str]| endings.iter().any(|e| word.ends_with(*e));
    let vowel_before_y = ends(&["ay", "ey", "oy", "uy"]);
    let many = match IRREGULAR.iter().find(|(one, _)| *one == word) {
        Some((_, many)) => (*many).to_owned(),
        None if ends(&["s", "x", "ch", "sh"]) => format!("{word}es"),
        None if ends(&["y"]) && !vowel_before_y => format!("{}ies", &word[..word.len() - 1]),
        None => format!("{word}s"),
    };
    Some(if rest.is_empty() { many } else { format!("{rest} {many}") })
}

/// Singular of a word; the word itself if it is no plural.
pub(super) fn singular(word: &str) -> String {
    if let Some((one, _)) = IRREGULAR.iter().find(|(_, many)| *many == word) {
        return (*one).to_owned();
    }
    if !word.ends_with('s') || word.ends_with("ss") || SINGULAR.contains(&word) || word.chars().count() < 3 {
        return word.to_owned();
    }
    if let Some(stem) = word.strip_suffix("ies").filter(|stem| stem.len() > 1) {
        return format!("{stem}y");
    }
    let hisses = ["sses", "xes", "ches", "shes", "lenses"].iter().any(|e| word.ends_with(*e));
    word[..word.len() - if hisses { 2 } else { 1 }].to_owned()
}

/// The noun with its indefinite article.
pub(super) fn a(noun: &str) -> String {
    let article = if noun.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
    format!("{article} {noun}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_words() {
        for (name, expected) in [
            ("Cesium_Milk_Truck", "cesium milk truck"),
            ("Wheels.001", "wheels"),
            ("wheel-back", "back wheel"),
            ("seat back", "seat back"),
            ("button a", "button a"),
            ("42", "42"),
        ] {
            assert_eq!(words(name).join(" "), expected);
        }
        assert!(words("--").is_empty() && keys(&[], true).is_empty());
    }

    #[test]
    fn short_nouns_keep_the_head() {
        let all = |name: &str, is_part| keys(&words(name), is_part).into_iter().collect::<Vec<_>>();
        let single = |list: &[&str]| list.iter().map(|k| ((*k).to_owned(), false)).collect::<Vec<_>>();
        assert_eq!(all("grey pot plant", false), single(&["grey pot plant", "plant", "pot plant"]));
        assert_eq!(all("menu button", true), single(&["button", "menu button"]));
        assert_eq!(all("top plate", true), single(&["top plate"]));
        assert_eq!(all("band padding", true), single(&["band padding"]), "a padding of what?");
        assert_eq!(all("button a", true), single(&["button", "button a"]));
        assert_eq!(all("front left wheel", true), single(&["front left wheel", "wheel"]));
        assert_eq!(all("Wheels.001", true), [("wheel".to_owned(), true)]);
        assert_eq!(all("headphones", false), [("headphone".to_owned(), true)]);
    }

    #[test]
    fn nouns_have_plurals() {
        for (one, many) in [
            ("mug", "mugs"),
            ("direction pad", "direction pads"),
            ("leaf", "leaves"),
            ("glass", "glasses"),
            ("switch", "switches"),
            ("toy", "toys"),
            ("body", "bodies"),
            ("lens", "lenses"),
        ] {
            assert_eq!(plural(one).as_deref(), Some(many));
            let last = |text: &str| text.rsplit(' ').next().unwrap_or_default().to_owned();
            assert_eq!(singular(&last(many)), last(one));
            assert_eq!(singular(&last(one)), last(one), "a singular stays");
        }
        assert_eq!(plural("button a"), None);
        assert_eq!((a("mug"), a("orange")), ("a mug".to_owned(), "an orange".to_owned()));
    }
}
