//! A request as words, and what people wrap around what they mean.

/// Longest request that is looked at, in characters.
pub const MAX_CHARS: usize = 600;

/// A word or a mark, as typed and in lower case.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Token {
    /// As typed.
    pub raw: String,
    /// In lower case; a quoted text starts with `"`.
    pub low: String,
}

/// Parts a text into words and the marks , ; . ? ! and keeps quoted texts whole.
pub fn tokens(text: &str) -> Vec<Token> {
    let text: String = text.chars().take(MAX_CHARS).collect();
    let text = text.replace(['\u{2019}', '\u{2018}', '`'], "'").replace(['\u{201c}', '\u{201d}'], "\"");
    let mut found = Vec::new();
    for (i, piece) in text.split('"').enumerate() {
        // An odd piece stands between quotes, unless the last quote was never closed.
        if i % 2 == 1 && text.matches('"').count() > i {
            found.push(Token { raw: piece.trim().into(), low: format!("\"{}", piece.trim().to_lowercase()) });
            continue;
        }
        piece.split(|c: char| c.is_whitespace() || c.is_control() || "()[]{}".contains(c)).for_each(|word| {
            split_word(word, &mut found);
        });
    }
    found
}

/// Marks at a word's end become tokens; a number and its unit are parted; 'quotes' are kept whole.
fn split_word(word: &str, found: &mut Vec<Token>) {
    let body = word.trim_end_matches(|c: char| ",;.?!:…".contains(c));
    let marks = &word[body.len()..];
    let body = body.trim_start_matches([',', ';', '!', '?', ':']);
    let mut push = |raw: &str| {
        if !raw.is_empty() {
            found.push(Token { raw: raw.into(), low: raw.to_lowercase() });
        }
    };
    if let Some(quoted) = body.strip_prefix('\'').and_then(|b| b.strip_suffix('\'')).filter(|b| !b.is_empty()) {
        push(quoted);
    } else {
        let digits = body.find(|c: char| !(c.is_ascii_digit() || ".,/".contains(c))).unwrap_or(body.len());
        let starts_number = body.starts_with(|c: char| c.is_ascii_digit() || c == '.');
        let unit = &body[digits..];
        if starts_number && !unit.is_empty() && !["st", "nd", "rd", "th"].contains(&unit) {
            push(&body[..digits]);
            push(unit.trim_start_matches('-'));
        } else {
            push(body);
        }
    }
    if let Some(mark) = marks.chars().next() {
        push(&mark.to_string());
    }
}

/// The words in lower case, without marks.
pub fn low(tokens: &[Token]) -> Vec<&str> {
    tokens.iter().map(|t| t.low.as_str()).filter(|w| !is_mark(w)).collect()
}

/// Whether a token is a mark.
pub fn is_mark(word: &str) -> bool {
    matches!(word, "," | ";" | "." | "?" | "!" | ":" | "…")
}

/// What is said before a request.
const BEFORE: [&str; 105] = [
    "i would like to know",
    "i'd like to know",
    "i want to know",
    "do you happen to know",
    "can you tell me",
    "could you tell me",
    "i was wondering",
    "any idea",
    "i wonder",
    "from now on",
    "from here on",
    "from there",
    "for me to",
    "i guess",
    "i think",
    "i said",
    "i want you",
    "i would like",
    "i'd like",
    "i'd love",
    "i want",
    "i need",
    "we need",
    "can i have",
    "could i have",
    "can i get",
    "could i get",
    "may i have",
    "let's have",
    "let me have",
    "next up",
    "first of all",
    "wait",
    "hold on",
    "hmm",
    "hm",
    "oh",
    "oops",
    "sorry",
    "listen",
    "actually",
    "quickly",
    "i mean",
    "i meant",
    "pretty please",
    "hi there",
    "hello there",
    "hey there",
    "would you be so kind as to",
    "would you be so kind and",
    "i would like for you to",
    "would it be possible to",
    "i would like you to",
    "would you mind to",
    "would you mind",
    "i would like to",
    "i'd like you to",
    "are you able to",
    "is it possible to",
    "i was wondering if you could",
    "i want you to",
    "i need you to",
    "do you think you could",
    "do me a favour and",
    "do me a favor and",
    "could you maybe",
    "can you maybe",
    "i'd like to",
    "could we",
    "can we",
    "may i",
    "can i",
    "could i",
    "i want to",
    "i need to",
    "i'd love to",
    "you should",
    "could you",
    "can you",
    "would you",
    "will you",
    "go ahead and",
    "let us",
    "let me",
    "let's",
    "lets",
    "please",
    "kindly",
    "maybe",
    "perhaps",
    "just",
    "now",
    "okay",
    "ok",
    "alright",
    "hey",
    "hi",
    "hello",
    "well",
    "so",
    "and",
    "then",
    "also",
    "next",
    "um",
];
/// What is said after a request.
const AFTER: [&str; 25] = [
    "if you don't mind",
    "pretty please",
    "of course",
    "to me",
    "to us",
    "if you like",
    "as well",
    "would you kindly",
    "any more",
    "anymore",
    "thanks a lot",
    "cheers",
    "if you can",
    "if possible",
    "would you",
    "could you",
    "thank you very much",
    "thank you",
    "thanks",
    "please",
    "for me",
    "right now",
    "quickly",
    "now",
    "ok",
];

/// The words without politeness around them. At least one word is kept.
pub fn without_courtesy<'a, 'b>(mut words: &'b [&'a str]) -> &'b [&'a str] {
    let starts = |words: &[&str], phrase: &str| {
        let wanted: Vec<&str> = phrase.split(' ').collect();
        (words.len() > wanted.len() && words.starts_with(&wanted)).then_some(wanted.len())
    };
    let ends = |words: &[&str], phrase: &str| {
        let wanted: Vec<&str> = phrase.split(' ').collect();
        (words.len() > wanted.len() && words.ends_with(&wanted)).then_some(wanted.len())
    };
    loop {
        // "next to the lamp" and "then" differ: what is next to something is a place.
        let is_place = words.starts_with(&["next", "to"]);
        // The longest counts: "i want to" before "i want".
        if let Some(n) = BEFORE.iter().filter_map(|p| starts(words, p)).max().filter(|_| !is_place) {
            words = &words[n..];
        } else if let Some(n) = AFTER.iter().filter_map(|p| ends(words, p)).max() {
            words = &words[..words.len() - n];
        } else {
            return words;
        }
    }
}

/// The verb of `known` that `word` is, or is a slip of: one wrong, missing, additional or swapped
/// letter, two in long words. `None` if it is no verb or could be two.
pub fn verb<'k>(word: &str, known: &[&'k str]) -> Option<&'k str> {
    if let Some(exact) = known.iter().find(|k| **k == word) {
        return Some(exact);
    }
    let length = word.chars().count();
    if !(4..=14).contains(&length) {
        return None;
    }
    let most = if length >= 8 { 2 } else { 1 };
    let slips = |k: &str| if k.len() < 4 { usize::MAX } else { strsim::damerau_levenshtein(word, k) };
    let best = known.iter().map(|k| (slips(k), *k)).min_by_key(|(d, _)| *d)?;
    let rivals = known.iter().filter(|k| slips(k) == best.0).count();
    (best.0 <= most && rivals == 1).then_some(best.1)
}

/// A number in digits or as a word; "a" and "an" are no numbers here.
pub fn number(word: &str) -> Option<f64> {
    const WORDS: [(&str, f64); 30] = [
        ("zero", 0.0),
        ("one", 1.0),
        ("two", 2.0),
        ("three", 3.0),
        ("four", 4.0),
        ("five", 5.0),
        ("six", 6.0),
        ("seven", 7.0),
        ("eight", 8.0),
        ("nine", 9.0),
        ("ten", 10.0),
        ("eleven", 11.0),
        ("twelve", 12.0),
        ("thirteen", 13.0),
        ("fourteen", 14.0),
        ("fifteen", 15.0),
        ("sixteen", 16.0),
        ("seventeen", 17.0),
        ("eighteen", 18.0),
        ("nineteen", 19.0),
        ("twenty", 20.0),
        ("thirty", 30.0),
        ("forty", 40.0),
        ("fifty", 50.0),
        ("sixty", 60.0),
        ("seventy", 70.0),
        ("eighty", 80.0),
        ("ninety", 90.0),
        ("hundred", 100.0),
        ("thousand", 1000.0),
    ];
    if let Some((_, n)) = WORDS.iter().find(|(w, _)| *w == word) {
        return Some(*n);
    }
    if let Some((tens, ones)) = word.split_once('-') {
        let (tens, ones) = (number(tens)?, number(ones)?);
        return (tens >= 20.0 && ones < 10.0).then_some(tens + ones);
    }
    if !word.starts_with(|c: char| c.is_ascii_digit() || c == '.') {
        return None;
    }
    if let Some((top, bottom)) = word.split_once('/') {
        let (top, bottom): (f64, f64) = (top.parse().ok()?, bottom.parse().ok()?);
        return Some(top / bottom).filter(|n| n.is_finite());
    }
    word.replace(',', ".").parse().ok().filter(|n: &f64| n.is_finite())
}

/// The place that an ordinal names, from 1; -1 for the last.
pub fn ordinal(word: &str) -> Option<i32> {
    const WORDS: [&str; 10] =
        ["first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth"];
    if word == "last" {
        return Some(-1);
    }
    if let Some(i) = WORDS.iter().position(|w| *w == word) {
        return Some(i as i32 + 1);
    }
    let digits = ["st", "nd", "rd", "th"].iter().find_map(|end| word.strip_suffix(end))?;
    digits.parse().ok().filter(|n| (1..=99).contains(n))
}

/// A word without an English plural's ending.
pub fn singular(word: &str) -> String {
    for (end, instead) in [("knives", "knife"), ("shelves", "shelf"), ("ies", "y")] {
        if let Some(stem) = word.strip_suffix(end).filter(|s| s.len() > 1 || end.len() > 3) {
            return format!("{stem}{instead}");
        }
    }
    for end in ["sses", "xes", "ches", "shes"] {
        if word.ends_with(end) {
            return word[..word.len() - 2].into();
        }
    }
    match word.strip_suffix('s') {
        Some(stem) if stem.chars().count() > 2 && !stem.ends_with(['s', 'u', 'i']) => stem.into(),
        _ => word.into(),
    }
}

/// Whether two words are the same but for a plural or a slip.
pub fn alike(a: &str, b: &str) -> bool {
    let (a, b) = (singular(a), singular(b));
    if a == b {
        return true;
    }
    let short = a.chars().count().min(b.chars().count());
    let most = if short >= 8 { 2 } else { 1 };
    short >= 4 && strsim::damerau_levenshtein(&a, &b) <= most
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(text: &str) -> Vec<String> {
        tokens(text).into_iter().map(|t| t.low).collect()
    }

    #[test]
    fn texts_become_words() {
        assert_eq!(cut("Move 20cm left, please!"), ["move", "20", "cm", "left", ",", "please", "!"]);
        assert_eq!(cut("the kettle\u{2019}s lid"), ["the", "kettle's", "lid"]);
        assert_eq!(cut("rename it to \"Big Cup\" now"), ["rename", "it", "to", "\"big cup", "now"]);
        assert_eq!(cut("0.5 m... the 2nd 'mug'"), ["0.5", "m", ".", "the", "2nd", "mug"]);
        assert_eq!(cut("90° and 3\" wide"), ["90", "°", "and", "3", "wide"]);
        assert!(cut(" \t\u{0} ").is_empty());
        assert!(cut(&"word ".repeat(9_999)).len() <= MAX_CHARS);
    }

    #[test]
    fn courtesy_is_no_content() {
        let strip = |text: &str| {
            let words: Vec<&str> = text.split(' ').collect();
            without_courtesy(&words).join(" ")
        };
        assert_eq!(strip("hey could you please show me the mug please"), "show me the mug");
        assert_eq!(strip("next to the lamp"), "next to the lamp");
        assert_eq!(strip("please"), "please");
        assert_eq!(strip("and then step back thank you"), "step back");
    }

    #[test]
    fn slips_of_verbs_are_understood() {
        let known = ["show", "remove", "rename", "describe", "hide", "move"];
        assert_eq!(verb("shwo", &known), Some("show"));
        assert_eq!(verb("descirbe", &known), Some("describe"));
        assert_eq!(verb("hide", &known), Some("hide"));
        assert_eq!(verb("kettle", &known), None);
        assert_eq!(verb("mug", &known), None);
    }

    #[test]
    fn numbers_and_ordinals() {
        assert_eq!((number("half"), number("twenty-five"), number("1/2")), (None, Some(25.0), Some(0.5)));
        assert_eq!((number("0,5"), number("1e999"), number("nan"), number("1/0")), (Some(0.5), None, None, None));
        assert_eq!(
            (ordinal("second"), ordinal("3rd"), ordinal("last"), ordinal("th")),
            (Some(2), Some(3), Some(-1), None)
        );
        assert!(alike("controllers", "controller") && alike("contoller", "controller") && !alike("mug", "mag"));
        assert_eq!(
            (singular("knives"), singular("glasses"), singular("dishes")),
            ("knife".into(), "glass".into(), "dish".into())
        );
    }
}
