//! Movements and turns: "step back half a metre", "a bit to the left", "turn around", "closer".

use super::Task;
use super::clauses::is_known;
use crate::agent::quantity::{Said, angle, distance};
use crate::agent::tool::ToolCall;
use crate::agent::wish::{CLOSER, Direction, Distance, FARTHER, TurnWay};
use crate::agent::words::number;
use crate::scene::Identities;

/// Angle of a turn that says none, in degrees.
const USUAL_TURN: f64 = 30.0;

const MOVE_VERBS: [&str; 53] = [
    "step",
    "move",
    "go",
    "walk",
    "fly",
    "back",
    "come",
    "shift",
    "slide",
    "strafe",
    "climb",
    "rise",
    "raise",
    "sink",
    "descend",
    "lower",
    "zoom",
    "dolly",
    "get",
    "push",
    "pull",
    "take",
    "make",
    "scoot",
    "float",
    "advance",
    "retreat",
    "ascend",
    "head",
    "drift",
    "travel",
    "bring",
    "nudge",
    "crawl",
    "inch",
    "creep",
    "glide",
    "hop",
    "swing",
    "shuffle",
    "proceed",
    "dive",
    "hover",
    "budge",
    "roll",
    "set",
    "translate",
    "displace",
    "jog",
    "moving",
    "stepping",
    "going",
    "walking",
];
const TURN_VERBS: [&str; 14] = [
    "turn", "rotate", "spin", "pan", "tilt", "swivel", "look", "face", "do", "make", "swing", "yaw", "pitch", "turning",
];
/// Words that add nothing to a movement.
const FILLERS: [&str; 44] = [
    "off",
    "to",
    "the",
    "a",
    "an",
    "more",
    "again",
    "by",
    "towards",
    "toward",
    "your",
    "my",
    "me",
    "some",
    "side",
    "of",
    "for",
    "about",
    "only",
    "just",
    "and",
    "camera",
    "view",
    "eye",
    "us",
    "further",
    "farther",
    "little",
    "bit",
    "slowly",
    "straight",
    "then",
    "please",
    "step",
    "steps",
    "another",
    "one",
    "distance",
    "direction",
    "hand",
    "over",
    "on",
    "around",
    "even",
];

/// The direction that a word says.
fn direction(word: &str, verb: Option<&str>) -> Option<Direction> {
    Some(match word {
        "forward" | "forwards" | "ahead" | "onward" | "onwards" => Direction::Forward,
        "back" | "backward" | "backwards" | "away" => Direction::Back,
        "left" | "leftward" | "leftwards" => Direction::Left,
        "right" | "rightward" | "rightwards" => Direction::Right,
        "up" | "upward" | "upwards" | "higher" => Direction::Up,
        "down" | "downward" | "downwards" | "lower" => Direction::Down,
        "in" | "inward" | "inwards"
            if verb.is_some_and(|v| ["zoom", "push", "move", "dolly", "come", "go"].contains(&v)) =>
        {
            Direction::Forward
        }
        "out" | "outward" | "outwards"
            if verb.is_some_and(|v| ["zoom", "pull", "move", "dolly", "back", "go"].contains(&v)) =>
        {
            Direction::Back
        }
        _ => return None,
    })
}

/// Whether a word alone says a direction.
pub(super) fn is_direction(word: &str) -> bool {
    direction(word, None).is_some()
}

/// What a verb says of the direction by itself.
fn of_verb(verb: &str) -> Option<Direction> {
    Some(match verb {
        "back" | "retreat" => Direction::Back,
        "climb" | "rise" | "raise" | "ascend" => Direction::Up,
        "sink" | "descend" | "lower" => Direction::Down,
        "advance" => Direction::Forward,
        _ => return None,
    })
}

fn without(words: &[&str], range: &std::ops::Range<usize>) -> Vec<String> {
    words.iter().enumerate().filter(|(i, _)| !range.contains(i)).map(|(_, w)| (*w).to_owned()).collect()
}

/// A movement of the eye, if the words are nothing else.
pub(super) fn movement(words: &[&str]) -> Option<ToolCall> {
    let verb = words.first().copied().filter(|w| MOVE_VERBS.contains(w));
    // "Back" is a direction before it is a verb; it is one by itself, too.
    let rest = if verb.is_some() { &words[1..] } else { words };
    // "Back away from the table": from where matters little.
    let rest = match rest.iter().position(|w| *w == "from") {
        Some(at) if at > 0 || verb.is_some_and(|v| of_verb(v) == Some(Direction::Back)) => {
            let away = rest[..at].iter().any(|w| direction(w, verb) == Some(Direction::Back));
            let side = super::sides::is_side_only(&rest[at..]);
            if side || !(away || verb.is_some_and(|v| of_verb(v) == Some(Direction::Back))) {
                rest
            } else {
                cut(rest, at)
            }
        }
        _ => rest,
    };
    let length = distance(rest);
    let left = length.as_ref().map_or_else(|| without(rest, &(0..0)), |l| without(rest, &l.words));
    let mut found = None;
    for word in &left {
        match direction(word, verb) {
            Some(d) if found.is_none() || found == Some(d) => found = Some(d),
            // "Back up", "step back down": the second says how the first is meant.
            Some(Direction::Up) if found == Some(Direction::Back) => {}
            Some(_) => return None,
            None if FILLERS.contains(&word.as_str()) => {}
            None => return None,
        }
    }
    if verb == Some("get") && found.is_none() {
        return None;
    }
    let implied = verb.and_then(of_verb);
    let direction = match (found, implied) {
        (Some(Direction::Up), Some(Direction::Back)) => Direction::Back,
        (Some(d), _) => d,
        (None, Some(d)) => d,
        // "Walk two steps", "move half a metre".
        (None, None) if verb.is_some() && length.is_some() => Direction::Forward,
        _ => return None,
    };
    // "The left", "the back side": a thing or a side, not a way to go, unless a verb or "to" says so.
    if words.last() == Some(&"side") && verb.is_none() && !words.contains(&"to") {
        return None;
    }
    let is_way =
        verb.is_some() || length.is_some() || words[0] == "to" || is_direction(words[0]) || words[0] == "further";
    let more = words.iter().any(|w| ["further", "farther"].contains(w)) && length.is_none();
    let said = length.map_or(if more { Distance::Relative(1.0) } else { Distance::Default }, |l| l.value);
    is_way.then_some(ToolCall::Move { direction, distance: said })
}

/// Words up to "from", with a length that comes later kept.
fn cut<'a, 'b>(rest: &'b [&'a str], at: usize) -> &'b [&'a str] {
    let later = distance(&rest[at..]).is_some();
    if later { rest } else { &rest[..at] }
}

/// A turn of the eye, if the words are nothing else.
fn turn(words: &[&str]) -> Option<ToolCall> {
    let verb = words.first().copied().filter(|w| TURN_VERBS.contains(w))?;
    let rest = &words[1..];
    if rest == ["behind"] || rest == ["behind", "you"] || rest == ["behind", "me"] || rest == ["back"] {
        return Some(ToolCall::Turn { direction: TurnWay::Right, degrees: 180.0 });
    }
    // "Turn 90 to the left", "do a 180", "make a u-turn".
    let bare = rest.iter().position(|w| number(w).is_some_and(|n| n >= 10.0)).filter(|_| angle(rest).is_none());
    let u_turn = rest.iter().position(|w| ["u-turn", "uturn", "about-face"].contains(w));
    let said = match (angle(rest), bare, u_turn) {
        (Some(said), ..) => Some(said),
        (None, Some(at), _) => number(rest[at]).map(|value| Said { value, words: at..at + 1 }),
        (None, None, Some(at)) => Some(Said { value: 180.0, words: at..at + 1 }),
        _ => None,
    };
    if (verb == "do" || verb == "make") && said.is_none() {
        return None;
    }
    let vague = distance(rest).filter(|_| said.is_none());
    let range = said.as_ref().map(|s| s.words.clone()).or_else(|| vague.as_ref().map(|v| v.words.clone()));
    let left = without(rest, &range.unwrap_or(0..0));
    let mut way = None;
    for word in &left {
        let new = match word.as_str() {
            "left" | "anticlockwise" | "counterclockwise" | "counter-clockwise" => TurnWay::Left,
            "right" | "clockwise" => TurnWay::Right,
            "up" | "upward" | "upwards" => TurnWay::Up,
            "down" | "downward" | "downwards" => TurnWay::Down,
            filler if FILLERS.contains(&filler) => continue,
            _ => return None,
        };
        if way.is_some_and(|w| w != new) {
            return None;
        }
        way = Some(new);
    }
    let degrees = match (said, vague.map(|v| v.value)) {
        (Some(said), _) => said.value,
        (None, Some(Distance::Relative(steps))) => USUAL_TURN * steps,
        (None, Some(Distance::Metres(_))) => return None,
        _ => USUAL_TURN,
    };
    let around = words.iter().any(|w| ["around", "round"].contains(w)) || degrees >= 180.0;
    let around = around || (verb != "look" && verb != "face" && degrees > USUAL_TURN);
    let direction = way.or_else(|| around.then_some(TurnWay::Right))?;
    Some(ToolCall::Turn { direction, degrees })
}

/// "Closer", "a bit nearer", "farther away", "zoom in": closer to the last target, or a way ahead if
/// a length is said.
pub(super) fn closer(words: &[&str]) -> Option<Task> {
    let verb = words.first().copied().filter(|w| MOVE_VERBS.contains(w) || *w == "look");
    let rest = if verb.is_some() { &words[1..] } else { words };
    let length = distance(rest);
    let left = length.as_ref().map_or_else(|| without(rest, &(0..0)), |l| without(rest, &l.words));
    let (mut near, mut far) = (false, false);
    for word in &left {
        match word.as_str() {
            "closer" | "nearer" | "close" => near = true,
            "farther" | "further" | "away" => far = true,
            "in" if verb == Some("zoom") => near = true,
            "out" if verb == Some("zoom") => far = true,
            "up" if near => {}
            "it" | "that" if near && left.iter().any(|w| w == "to") => {}
            "it" if far && left.iter().any(|w| w == "from") => {}
            "from" if far => {}
            filler if FILLERS.contains(&filler) => {}
            _ => return None,
        }
    }
    if near == far {
        return None;
    }
    match length.map(|l| l.value) {
        Some(metres @ Distance::Metres(_)) => {
            let direction = if near { Direction::Forward } else { Direction::Back };
            Some(Task::Call(ToolCall::Move { direction, distance: metres }))
        }
        Some(Distance::Relative(steps)) => {
            let factor = if near { CLOSER } else { FARTHER };
            // "A bit closer" is half as much closer.
            Some(Task::Closer(factor.powf(steps.clamp(0.25, 3.0))))
        }
        _ => Some(Task::Closer(if near { CLOSER } else { FARTHER })),
    }
}

/// A movement, a turn, or "closer".
pub(super) fn read(words: &[&str], identities: &Identities) -> Option<Task> {
    // "Right" and "back" may be names in the scene; said with a verb they are directions.
    if words.len() == 1 && is_known(words[0], identities) && !is_direction(words[0]) {
        return None;
    }
    if let Some(call) = turn(words) {
        return Some(Task::Call(call));
    }
    closer(words).or_else(|| movement(words).map(Task::Call))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(text: &str) -> Option<String> {
        let words: Vec<&str> = text.split(' ').collect();
        let all = Identities::default();
        match read(&words, &all)? {
            Task::Call(call) => Some(call.line(&all)),
            Task::Closer(factor) => Some(format!("closer {factor:.2}")),
            other => Some(format!("{other:?}")),
        }
    }

    #[test]
    fn movements_and_turns_are_read() {
        for (text, wanted) in [
            ("step back half a metre", "move(back, 0.5 m)"),
            ("move 20 cm to the left", "move(left, 0.2 m)"),
            ("go up a bit", "move(up, 0.5 steps)"),
            ("back up", "move(back)"),
            ("take two steps forward", "move(forward, 2 steps)"),
            ("a bit to the right", "move(right, 0.5 steps)"),
            ("up", "move(up)"),
            ("step away from the table", "move(back)"),
            ("zoom in", "closer 2.00"),
            ("come closer", "closer 2.00"),
            ("further away", "closer 0.50"),
            ("come 30 cm closer", "move(forward, 0.3 m)"),
            ("turn around", "turn(right, 180 degrees)"),
            ("turn left 90 degrees", "turn(left, 90 degrees)"),
            ("look up", "turn(up, 30 degrees)"),
            ("turn a bit to the right", "turn(right, 15 degrees)"),
            ("rotate 45 degrees to the left", "turn(left, 45 degrees)"),
        ] {
            assert_eq!(said(text).as_deref(), Some(wanted), "{text}");
        }
        for other in
            ["go to the mug", "the left one", "look at the lamp", "show me the lamp", "get the mug", "move the mug", ""]
        {
            assert_eq!(said(other), None, "{other}");
        }
    }
}
