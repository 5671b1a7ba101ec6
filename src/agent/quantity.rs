//! Lengths and angles in a request: "half a metre", "20 cm", "a bit", "two steps", "90 degrees".

use std::ops::Range;

use super::wish::Distance;
use super::words::number;

/// A quantity and the words that say it.
#[derive(Clone, Debug, PartialEq)]
pub struct Said<T> {
    /// What is said.
    pub value: T,
    /// By which words.
    pub words: Range<usize>,
}

/// What a unit of length is: metres, or steps.
enum Unit {
    Metres(f64),
    Steps,
}

fn unit(word: &str) -> Option<Unit> {
    Some(Unit::Metres(match word {
        "m" | "meter" | "meters" | "metre" | "metres" => 1.0,
        "cm" | "centimeter" | "centimeters" | "centimetre" | "centimetres" => 0.01,
        "mm" | "millimeter" | "millimeters" | "millimetre" | "millimetres" => 0.001,
        "km" | "kilometer" | "kilometers" | "kilometre" | "kilometres" => 1000.0,
        "ft" | "foot" | "feet" => 0.3048,
        "in" | "inch" | "inches" => 0.0254,
        "yard" | "yards" | "yd" => 0.9144,
        "step" | "steps" | "pace" | "paces" => return Some(Unit::Steps),
        _ => return None,
    }))
}

/// A number at the beginning of these words, with the count of words that say it: "20", "half a",
/// "one and a half", "a couple of", "two hundred".
fn amount(words: &[&str]) -> Option<(f64, usize)> {
    const FIXED: [(&str, f64); 14] = [
        ("three quarters of a", 0.75),
        ("one and a half", 1.5),
        ("two and a half", 2.5),
        ("a quarter of a", 0.25),
        ("a quarter of an", 0.25),
        ("a third of a", 1.0 / 3.0),
        ("half of a", 0.5),
        ("a couple of", 2.0),
        ("half an", 0.5),
        ("half a", 0.5),
        ("a few", 3.0),
        ("half", 0.5),
        ("an", 1.0),
        ("a", 1.0),
    ];
    let starts = |phrase: &str| {
        let wanted: Vec<&str> = phrase.split(' ').collect();
        words.starts_with(&wanted).then_some(wanted.len())
    };
    // "a half metre" says half a metre.
    if words.starts_with(&["a", "half"]) {
        return Some((0.5, 2));
    }
    if let Some(found) = FIXED.iter().find_map(|(phrase, n)| Some((*n, starts(phrase)?))) {
        return Some(found);
    }
    let first = number(words.first()?)?;
    match words.get(1).copied() {
        Some("hundred") => Some((first * 100.0, 2)),
        Some("and") if words.get(2..4) == Some(&["a", "half"]) => Some((first + 0.5, 4)),
        Some(next) if first >= 20.0 => match number(next).filter(|n| *n >= 1.0 && *n < 10.0) {
            Some(ones) if number(words[0]).is_some() && !words[0].starts_with(|c: char| c.is_ascii_digit()) => {
                Some((first + ones, 2))
            }
            _ => Some((first, 1)),
        },
        _ => Some((first, 1)),
    }
}

/// The first length in these words.
pub fn distance(words: &[&str]) -> Option<Said<Distance>> {
    const VAGUE: [(&str, f64); 18] = [
        ("a tiny little bit", 0.25),
        ("a tiny bit", 0.25),
        ("just a bit", 0.5),
        ("a little bit", 0.5),
        ("a bit", 0.5),
        ("a little", 0.5),
        ("a touch", 0.5),
        ("a tad", 0.5),
        ("slightly", 0.5),
        ("somewhat", 0.5),
        ("a long way", 3.0),
        ("quite a bit", 2.0),
        ("quite a lot", 2.0),
        ("a whole lot", 3.0),
        ("a lot", 2.0),
        ("a good deal", 2.0),
        ("much", 2.0),
        ("way", 2.0),
    ];
    for i in 0..words.len() {
        if let Some((n, used)) = amount(&words[i..])
            && let Some(unit) = words.get(i + used).and_then(|w| unit(w))
        {
            let value = match unit {
                Unit::Metres(m) => Distance::Metres(n * m),
                Unit::Steps => Distance::Relative(n),
            };
            return Some(Said { value, words: i..i + used + 1 });
        }
    }
    (0..words.len()).find_map(|i| {
        VAGUE.iter().find_map(|(phrase, steps)| {
            let wanted: Vec<&str> = phrase.split(' ').collect();
            let said = words[i..].starts_with(&wanted);
            said.then(|| Said { value: Distance::Relative(*steps), words: i..i + wanted.len() })
        })
    })
}

/// The first angle in these words, in degrees.
pub fn angle(words: &[&str]) -> Option<Said<f64>> {
    const FIXED: [(&str, f64); 9] = [
        ("all the way around", 360.0),
        ("a full circle", 360.0),
        ("a full turn", 360.0),
        ("half a turn", 180.0),
        ("a half turn", 180.0),
        ("a quarter of a turn", 90.0),
        ("a quarter turn", 90.0),
        ("around", 180.0),
        ("round", 180.0),
    ];
    for i in 0..words.len() {
        if let Some((n, used)) = amount(&words[i..])
            && words.get(i + used).is_some_and(|w| ["°", "deg", "degree", "degrees"].contains(w))
        {
            return Some(Said { value: n, words: i..i + used + 1 });
        }
        let fixed = FIXED.iter().find_map(|(phrase, degrees)| {
            let wanted: Vec<&str> = phrase.split(' ').collect();
            words[i..].starts_with(&wanted).then(|| Said { value: *degrees, words: i..i + wanted.len() })
        });
        if fixed.is_some() {
            return fixed;
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn far(text: &str) -> Option<Distance> {
        let words: Vec<&str> = text.split(' ').collect();
        distance(&words).map(|s| s.value)
    }

    #[test]
    fn lengths_in_many_words() {
        let metres = |text: &str| match far(text) {
            Some(Distance::Metres(m)) => (m * 1e6).round() / 1e6,
            other => panic!("{text}: {other:?}"),
        };
        assert_eq!((metres("back half a metre"), metres("20 cm to the left"), metres("a half meter")), (0.5, 0.2, 0.5));
        assert_eq!((metres("two feet up"), metres("10 in"), metres("a quarter of a metre")), (0.6096, 0.254, 0.25));
        assert_eq!(
            (metres("one and a half metres"), metres("thirty five cm"), metres("two hundred mm")),
            (1.5, 0.35, 0.2)
        );
        assert_eq!((metres("0.3 m"), metres("a metre")), (0.3, 1.0));
        assert_eq!(
            (far("two steps"), far("a step back")),
            (Some(Distance::Relative(2.0)), Some(Distance::Relative(1.0)))
        );
        assert_eq!(
            (far("up a bit"), far("back a lot")),
            (Some(Distance::Relative(0.5)), Some(Distance::Relative(2.0)))
        );
        assert_eq!((far("back"), far("the mug in the room"), far("")), (None, None, None));
    }

    #[test]
    fn angles_in_words_and_digits() {
        let turn = |text: &str| {
            let words: Vec<&str> = text.split(' ').collect();
            angle(&words).map(|s| s.value)
        };
        assert_eq!(
            (turn("left 90 degrees"), turn("turn around"), turn("a quarter turn")),
            (Some(90.0), Some(180.0), Some(90.0))
        );
        assert_eq!((turn("forty five degrees"), turn("left")), (Some(45.0), None));
    }
}
