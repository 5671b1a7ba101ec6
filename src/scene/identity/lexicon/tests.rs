//! The lexicon against a list of pairs, and its file.

use super::*;
use crate::scene::identity::name_words::{singular, words};

/// Names, asked words and their relation; `tools/lexicon/check.py` reads the same list.
const PAIRS: &str = include_str!("pairs.txt");

#[test]
fn names_are_what_people_ask_for_and_nothing_else() {
    let lines: Vec<Vec<&str>> =
        PAIRS.lines().filter(|l| !l.starts_with('#')).map(|l| l.split(" | ").collect()).collect();
    let wrong: Vec<String> = lines
        .iter()
        .filter_map(|line| {
            let [name, asked, expected] = line[..] else { return Some(format!("{line:?} has no three fields")) };
            let found = is_a(name, asked);
            let fits = match expected {
                "same" => found == Some(Kinship::Same),
                "kind" => found == Some(Kinship::KindOf),
                "yes" => found.is_some(),
                _ => found.is_none(),
            };
            (!fits).then(|| format!("{name} is a {asked}: {found:?}, not {expected}"))
        })
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let negatives = lines.iter().filter(|line| line[2] == "no").count();
    assert!(lines.len() >= 120 && negatives >= 60, "{} pairs, {negatives} of them are not", lines.len());
}

#[test]
fn the_head_of_a_name_says_what_it_is() {
    assert_eq!(head("glass of water"), ["glass"]);
    assert_eq!(head("pair of old scissor"), ["old", "scissor"]);
    assert_eq!(head("button a"), ["button"]);
    assert_eq!(head("box 12"), ["box"]);
    assert_eq!(head("red toy car"), ["red", "toy", "car"], "nothing to leave out");
    assert_eq!(head("of"), ["of"]);
    assert!(head("").is_empty());
}

#[test]
fn nouns_are_known_and_slips_are_not() {
    for word in ["kettle", "zebra", "idea", "teddy bear", "scissor", "scissors", "smartphone"] {
        assert!(is_noun(word), "{word}");
    }
    for slip in ["", "ketle", "contoller", "mugg", "telefone", "xyzzy"] {
        assert!(!is_noun(slip), "{slip}");
    }
}

#[test]
fn odd_plurals_and_british_spellings_are_understood() {
    let plurals = ["mice", "feet", "leaves", "potatoes", "buses", "women", "dice", "movies"];
    let single = ["mouse", "foot", "leaf", "potato", "bus", "woman", "die", "movie"];
    assert_eq!(plurals.map(singular_of), single.map(Some));
    assert_eq!(["mugs", "vases", "mouse", "soles", ""].map(singular_of), [None; 5], "the rules are enough");
    let (british, us) = (["grey", "metre", "colour", "aeroplane"], ["gray", "meter", "color", "airplane"]);
    assert_eq!(british.map(american), us.map(Some));
    assert_eq!(["gray", "tour", "mug", ""].map(american), [None; 4]);
}

#[test]
fn words_are_written_as_names_are() {
    let lexicon = Lexicon::get();
    for line in lexicon.words.lines() {
        let word = line.split('\t').next().expect("a word");
        assert!(is_noun(word), "{word} is out of order");
        // Those with a plural's ending are there in the singular too.
        let single = word.split(' ').map(singular).collect::<Vec<_>>().join(" ");
        assert!(is_noun(&single), "{word}");
    }
    assert!(["Teddy-Bears", "T-shirts", "Rubik's cube"].iter().all(|name| is_noun(&words(name).join(" "))));
    assert!(!is_noun("Teddy-Bears"));
}

#[test]
fn the_file_is_small_and_whole() {
    let packed: &[u8] = include_bytes!("../../../../assets/lexicon.z");
    assert!((100_000..=1_000_000).contains(&packed.len()), "{} bytes", packed.len());
    let lexicon = Lexicon::get();
    let concepts = lexicon.concepts.len();
    let lines = |section: &str| section.lines().count();
    assert!(lines(lexicon.words) > 40_000 && concepts > 20_000 && lines(lexicon.first) > 0);
    assert!(lines(lexicon.plurals) > 1_000 && lines(lexicon.spellings) > 500);
    let told = lexicon.words.lines().chain(lexicon.first.lines()).map(|line| line.split_once('\t').map_or("", |l| l.1));
    assert!(told.chain(lexicon.concepts.iter().copied()).flat_map(numbers).all(|number| number < concepts));
    assert!(include_str!("../../../../assets/lexicon.LICENSE.txt").contains("Princeton University"));
}
