//! Commands: show, find, hide, rename; and what is said without a verb.

use super::questions::{after, between, plain, query as target};
use super::sides::looked;
use super::{HELP, Task, clauses};
use crate::agent::refusal::RefusalKind;
use crate::agent::tool::{Reference, Target, ToolCall};
use crate::agent::wish::{CLOSER, FARTHER, NORMAL, Side};
use crate::agent::words::{Token, is_mark};
use crate::scene::Identities;

/// What a verb does to its target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verb {
    Go,
    GoCloser,
    GoFarther,
    Around,
    Look,
    Find,
    Isolate,
    Highlight,
    Hide,
    HideRest,
    Unhide,
    Remove,
    Describe,
    Measure,
    Distance,
    Export,
    List,
}

/// How requests begin. The longest that fits counts.
const BEGINNINGS: [(&str, Verb); 126] = [
    ("show me only", Verb::Isolate),
    ("show only", Verb::Isolate),
    ("only show me", Verb::Isolate),
    ("only show", Verb::Isolate),
    ("only", Verb::Isolate),
    ("show me just", Verb::Isolate),
    ("show just", Verb::Isolate),
    ("isolate", Verb::Isolate),
    ("segment out", Verb::Isolate),
    ("segment", Verb::Isolate),
    ("cut out", Verb::Isolate),
    ("extract", Verb::Isolate),
    ("keep only", Verb::Isolate),
    ("hide everything but", Verb::HideRest),
    ("hide everything except for", Verb::HideRest),
    ("hide everything except", Verb::HideRest),
    ("hide all but", Verb::HideRest),
    ("hide all except", Verb::HideRest),
    ("hide everything around", Verb::HideRest),
    ("hide the rest except", Verb::HideRest),
    ("show me everything about", Verb::Describe),
    ("show me", Verb::Go),
    ("show us", Verb::Go),
    ("show", Verb::Go),
    ("display", Verb::Go),
    ("see", Verb::Go),
    ("view", Verb::Go),
    ("visit", Verb::Go),
    ("approach", Verb::GoCloser),
    ("inspect", Verb::GoCloser),
    ("examine", Verb::GoCloser),
    ("check out", Verb::Go),
    ("check", Verb::Go),
    ("go over to", Verb::Go),
    ("go back to", Verb::Go),
    ("go up to", Verb::GoCloser),
    ("go close to", Verb::GoCloser),
    ("go closer to", Verb::GoCloser),
    ("go nearer to", Verb::GoCloser),
    ("go around", Verb::Around),
    ("walk around", Verb::Around),
    ("fly around", Verb::Around),
    ("circle", Verb::Around),
    ("orbit", Verb::Around),
    ("go to", Verb::Go),
    ("go near", Verb::Go),
    ("fly over to", Verb::Go),
    ("fly me to", Verb::Go),
    ("fly to", Verb::Go),
    ("navigate me to", Verb::Go),
    ("navigate to", Verb::Go),
    ("travel to", Verb::Go),
    ("jump to", Verb::Go),
    ("head over to", Verb::Go),
    ("head to", Verb::Go),
    ("walk over to", Verb::Go),
    ("walk to", Verb::Go),
    ("walk up to", Verb::GoCloser),
    ("move over to", Verb::Go),
    ("move closer to", Verb::GoCloser),
    ("move close to", Verb::GoCloser),
    ("move towards", Verb::Go),
    ("move to", Verb::Go),
    ("move away from", Verb::GoFarther),
    ("move farther from", Verb::GoFarther),
    ("move further from", Verb::GoFarther),
    ("come closer to", Verb::GoCloser),
    ("get closer to", Verb::GoCloser),
    ("get close to", Verb::GoCloser),
    ("get nearer to", Verb::GoCloser),
    ("get me closer to", Verb::GoCloser),
    ("get me to", Verb::Go),
    ("get to", Verb::Go),
    ("closer to", Verb::GoCloser),
    ("nearer to", Verb::GoCloser),
    ("take me back to", Verb::Go),
    ("take me over to", Verb::Go),
    ("take me closer to", Verb::GoCloser),
    ("take me to", Verb::Go),
    ("take us to", Verb::Go),
    ("bring me closer to", Verb::GoCloser),
    ("bring me to", Verb::Go),
    ("bring us to", Verb::Go),
    ("return to", Verb::Go),
    ("zoom in on", Verb::GoCloser),
    ("zoom in to", Verb::GoCloser),
    ("zoom into", Verb::GoCloser),
    ("zoom in at", Verb::GoCloser),
    ("zoom to", Verb::GoCloser),
    ("zoom on", Verb::GoCloser),
    ("zoom out from", Verb::GoFarther),
    ("zoom out of", Verb::GoFarther),
    ("look at", Verb::Look),
    ("look towards", Verb::Look),
    ("look toward", Verb::Look),
    ("look over at", Verb::Look),
    ("look over to", Verb::Look),
    ("look to", Verb::Look),
    ("turn to face", Verb::Look),
    ("turn towards", Verb::Look),
    ("turn toward", Verb::Look),
    ("turn to", Verb::Look),
    ("rotate towards", Verb::Look),
    ("face towards", Verb::Look),
    ("face", Verb::Look),
    ("focus on", Verb::Look),
    ("center on", Verb::Look),
    ("centre on", Verb::Look),
    ("center", Verb::Look),
    ("centre", Verb::Look),
    ("point the camera at", Verb::Look),
    ("find me", Verb::Find),
    ("find", Verb::Find),
    ("locate", Verb::Find),
    ("search for", Verb::Find),
    ("look for", Verb::Find),
    ("spot", Verb::Find),
    ("know where", Verb::Find),
    ("hide", Verb::Hide),
    ("conceal", Verb::Hide),
    ("unhide", Verb::Unhide),
    ("reveal", Verb::Unhide),
    ("bring back", Verb::Unhide),
    ("restore", Verb::Unhide),
    ("describe", Verb::Describe),
    ("explain", Verb::Describe),
];
const MORE_BEGINNINGS: [(&str, Verb); 82] = [
    ("remove", Verb::Remove),
    ("delete", Verb::Remove),
    ("erase", Verb::Remove),
    ("get rid of", Verb::Remove),
    ("wipe out", Verb::Remove),
    ("highlight", Verb::Highlight),
    ("mark", Verb::Highlight),
    ("outline", Verb::Highlight),
    ("select", Verb::Highlight),
    ("point out", Verb::Highlight),
    ("point at", Verb::Highlight),
    ("point to", Verb::Highlight),
    ("measure the distance between", Verb::Distance),
    ("measure the distance from", Verb::Distance),
    ("measure the size of", Verb::Measure),
    ("measure", Verb::Measure),
    ("export", Verb::Export),
    ("save", Verb::Export),
    ("write", Verb::Export),
    ("have a closer look at", Verb::GoCloser),
    ("take a closer look at", Verb::GoCloser),
    ("give me a closer look at", Verb::GoCloser),
    ("get a closer look at", Verb::GoCloser),
    ("a closer look at", Verb::GoCloser),
    ("look closer at", Verb::GoCloser),
    ("look closely at", Verb::GoCloser),
    ("give me a close-up of", Verb::GoCloser),
    ("have a look at", Verb::Go),
    ("take a look at", Verb::Go),
    ("get a look at", Verb::Go),
    ("give me a look at", Verb::Go),
    ("give me a view of", Verb::Go),
    ("get a view of", Verb::Go),
    ("give me a good view of", Verb::Go),
    ("distance from", Verb::Distance),
    ("distance between", Verb::Distance),
    ("the distance from", Verb::Distance),
    ("the distance between", Verb::Distance),
    ("distance to", Verb::Distance),
    ("the distance to", Verb::Distance),
    ("peek at", Verb::Go),
    ("a look at", Verb::Go),
    ("a view of", Verb::Go),
    ("a better look at", Verb::GoCloser),
    ("a better view of", Verb::GoCloser),
    ("a good look at", Verb::Go),
    ("a close-up of", Verb::GoCloser),
    ("a close look at", Verb::GoCloser),
    ("take a better look at", Verb::GoCloser),
    ("have a better look at", Verb::GoCloser),
    ("get a better look at", Verb::GoCloser),
    ("take a close look at", Verb::GoCloser),
    ("have a close look at", Verb::GoCloser),
    ("take a peek at", Verb::Go),
    ("have a peek at", Verb::Go),
    ("bring up", Verb::Go),
    ("pull up", Verb::Go),
    ("proceed to", Verb::Go),
    ("enlarge", Verb::GoCloser),
    ("magnify", Verb::GoCloser),
    ("rotate around", Verb::Around),
    ("circle around", Verb::Around),
    ("orbit around", Verb::Around),
    ("stop hiding", Verb::Unhide),
    ("watch", Verb::Go),
    ("observe", Verb::Go),
    ("study", Verb::GoCloser),
    ("size of", Verb::Measure),
    ("the size of", Verb::Measure),
    ("dimensions of", Verb::Measure),
    ("the dimensions of", Verb::Measure),
    ("identify", Verb::Describe),
    ("move in on", Verb::GoCloser),
    ("close in on", Verb::GoCloser),
    ("home in on", Verb::GoCloser),
    ("concentrate on", Verb::Look),
    ("aim at", Verb::Look),
    ("aim the camera at", Verb::Look),
    ("turn the camera to", Verb::Look),
    ("turn the camera towards", Verb::Look),
    ("point the view at", Verb::Look),
    ("list", Verb::List),
];

/// Requests that are complete as they stand.
const WHOLE: [(&str, fn() -> Task); 34] = [
    ("undo", || Task::Call(ToolCall::Undo {})),
    ("undo that", || Task::Call(ToolCall::Undo {})),
    ("undo it", || Task::Call(ToolCall::Undo {})),
    ("undo the last change", || Task::Call(ToolCall::Undo {})),
    ("undo the last one", || Task::Call(ToolCall::Undo {})),
    ("undo this", || Task::Call(ToolCall::Undo {})),
    ("take that back", || Task::Call(ToolCall::Undo {})),
    ("take it back", || Task::Call(ToolCall::Undo {})),
    ("revert", || Task::Call(ToolCall::Undo {})),
    ("revert that", || Task::Call(ToolCall::Undo {})),
    ("reverse that", || Task::Call(ToolCall::Undo {})),
    ("show everything", || Task::Call(ToolCall::ShowAll {})),
    ("show me everything", || Task::Call(ToolCall::ShowAll {})),
    ("show everything again", || Task::Call(ToolCall::ShowAll {})),
    ("show me everything again", || Task::Call(ToolCall::ShowAll {})),
    ("show all", || Task::Call(ToolCall::ShowAll {})),
    ("show all again", || Task::Call(ToolCall::ShowAll {})),
    ("show me all", || Task::Call(ToolCall::ShowAll {})),
    ("show all objects", || Task::Call(ToolCall::ShowAll {})),
    ("show all things again", || Task::Call(ToolCall::ShowAll {})),
    ("show the whole scene", || Task::Call(ToolCall::ShowAll {})),
    ("show me the whole scene", || Task::Call(ToolCall::ShowAll {})),
    ("show the rest", || Task::Call(ToolCall::ShowAll {})),
    ("show the rest again", || Task::Call(ToolCall::ShowAll {})),
    ("show everything else again", || Task::Call(ToolCall::ShowAll {})),
    ("unhide all", || Task::Call(ToolCall::ShowAll {})),
    ("unhide everything", || Task::Call(ToolCall::ShowAll {})),
    ("bring everything back", || Task::Call(ToolCall::ShowAll {})),
    ("bring back everything", || Task::Call(ToolCall::ShowAll {})),
    ("restore everything", || Task::Call(ToolCall::ShowAll {})),
    ("reveal everything", || Task::Call(ToolCall::ShowAll {})),
    ("unhide everything again", || Task::Call(ToolCall::ShowAll {})),
    ("look around", || Task::Call(ToolCall::Turn { direction: crate::agent::wish::TurnWay::Right, degrees: 360.0 })),
    ("describe", || Task::Call(ToolCall::Describe { target: None })),
];

/// Greetings, thanks, help, "no": what asks for nothing in the scene.
pub(super) fn small_talk(words: &[&str]) -> Option<Vec<Task>> {
    let text = words.join(" ");
    let say = |text: &str| Some(vec![Task::Say(text.into())]);
    match text.as_str() {
        "help" | "help me" | "commands" | "help please" | "?" => say(HELP),
        "hello" | "hi" | "hey" | "good morning" | "good evening" | "hello there" | "hi there" => {
            say("Hello. Tell me what to show, or say 'help'.")
        }
        "thanks"
        | "thank you"
        | "thank you very much"
        | "great"
        | "nice"
        | "good"
        | "perfect"
        | "cool"
        | "wonderful"
        | "thanks a lot" => say("You are welcome."),
        "wait" | "hold on" | "hmm" | "hm" | "oh" | "oops" | "ok" | "okay" | "alright" | "well" | "robot"
        | "computer" | "agent" | "assistant" | "please" | "sorry" | "so" | "now" | "right then" | "listen"
        | "actually" | "dear" | "hey robot" | "do you think" | "if you can" | "system" | "quick" | "excuse me" => {
            Some(Vec::new())
        }
        "again" | "once more" | "more" | "a bit more" | "keep going" | "go on" | "continue" | "one more time"
        | "and again" | "do it again" | "do that again" | "further" | "a little more" | "even more" | "some more"
        | "still more" => Some(vec![Task::Repeat]),
        "too close" | "that is too close" | "that is too near" | "too near" => Some(vec![Task::Remark(FARTHER)]),
        "too far" | "too far away" | "that is too far" | "that is too far away" => Some(vec![Task::Remark(CLOSER)]),
        "good afternoon" | "good day" | "very good" | "very well" | "well done" | "lovely" | "fine" | "got it"
        | "i see" | "excellent" => Some(vec![Task::Noise(text)]),
        "no" | "yes" | "yeah" | "nope" | "never mind" | "nevermind" | "cancel" | "stop" | "forget it"
        | "cancel that" => Some(vec![Task::Say("There is no open question.".into())]),
        _ => None,
    }
}

/// What is said of a thing without asking for anything, what must not be done, and roundabout ways to
/// say "find".
pub(super) fn stated(words: &[&str]) -> Option<Task> {
    if after(words, &["don't", "do not", "dont", "never", "please don't", "you must not", "you mustn't"])
        .is_some_and(|r| !r.is_empty())
    {
        return Some(Task::Say("All right, I will not.".into()));
    }
    let lost = [
        "i can't find",
        "i cannot find",
        "i can't see",
        "i cannot see",
        "i lost",
        "i have lost",
        "i've lost",
        "i am looking for",
        "i am searching for",
        "i was looking for",
        "i don't see",
        "i do not see",
        "i don't know where",
        "do you know where",
        "i forgot where",
        "have you seen",
        "did you see",
        "help me find",
    ];
    if let Some(thing) = after(words, &lost).filter(|r| !r.is_empty()) {
        let thing = match thing {
            [start @ .., "anywhere" | "is" | "are" | "went" | "now"] if !start.is_empty() => start,
            all => all,
        };
        return Some(Task::Find(plain(thing)));
    }
    // "Where did it go?", after that, says nothing new.
    if ["where did it go", "where has it gone", "where is it gone", "where could it be", "where can it be"]
        .contains(&words.join(" ").as_str())
    {
        return Some(Task::Find("it".into()));
    }
    let said = [
        "i don't need",
        "i do not need",
        "i don't like",
        "i do not like",
        "i don't want",
        "i do not want",
        "i hate",
        "i like",
        "i love",
        "i am done with",
        "i have seen",
        "i saw",
        "i see",
        "i am interested in",
        "i am curious about",
        "there is",
        "here is",
        "that is",
    ];
    let thing = after(words, &said).filter(|r| !r.is_empty())?;
    let thing = match thing {
        [start @ .., "anymore"] if !start.is_empty() => start,
        [start @ .., "any", "more" | "longer"] if !start.is_empty() => start,
        [start @ .., "there" | "here" | "now"] if !start.is_empty() => start,
        all => all,
    };
    Some(Task::Mention(plain(thing)))
}

/// A command with a verb.
pub(super) fn read(words: &[&str], clause: &[Token], identities: &Identities) -> Option<Vec<Task>> {
    let text = words.join(" ");
    if let Some((_, task)) = WHOLE.iter().find(|(whole, _)| *whole == text) {
        return Some(vec![task()]);
    }
    if let Some(task) = rename(words, clause) {
        return Some(vec![task]);
    }
    if let Some(task) = made(words) {
        return Some(vec![task]);
    }
    // "Show me what is on the table".
    if let Some(rest) = after(words, &["show me", "show us", "show", "see", "check", "find out", "explain", "say"])
        && ["what", "where", "how", "which", "if", "whether"].contains(rest.first().unwrap_or(&""))
    {
        let rest = if ["if", "whether"].contains(&rest[0]) { &rest[1..] } else { rest };
        if let Some(task) = super::questions::read(rest) {
            return Some(vec![task]);
        }
    }
    // "No, the other one", "not that one, the blue one", "I meant the lamp".
    if let Some(rest) = after(
        words,
        &[
            "not that one",
            "not this one",
            "no i meant",
            "no i mean",
            "i meant",
            "i mean",
            "rather",
            "instead",
            "no",
            "how about",
            "what about",
            "the same for",
            "same for",
            "also",
            "now",
        ],
    ) && !rest.is_empty()
    {
        let rest: Vec<&str> = rest
            .iter()
            .copied()
            .skip_while(|w| ["but", "rather", "instead", "show", "me", "that", "is", "wrong"].contains(w))
            .collect();
        return (!rest.is_empty()).then(|| vec![bare(&rest, identities)]);
    }
    let all = BEGINNINGS.iter().chain(MORE_BEGINNINGS.iter());
    let fits = all.filter_map(|(begin, verb)| Some((begin.len(), *verb, after(words, &[begin])?)));
    let Some((_, verb, rest)) = fits.max_by_key(|(n, ..)| *n) else { return unknown_verb(words, identities) };
    Some(done_to(verb, rest, words, identities))
}

/// "Make the curtain invisible", "get the lamp out of the way", "make it bigger", "put the lamp on screen".
fn made(words: &[&str]) -> Option<Task> {
    let rest = after(words, &["make", "let", "have", "get", "take", "keep", "put", "bring", "turn", "set"])
        .filter(|r| r.len() > 1)?;
    let ends = |end: &str| {
        let wanted: Vec<&str> = end.split(' ').collect();
        (rest.len() > wanted.len() && rest.ends_with(&wanted)).then(|| &rest[..rest.len() - wanted.len()])
    };
    let first = |all: &[&str]| all.iter().find_map(|end| ends(end));
    let gone = [
        "invisible",
        "disappear",
        "vanish",
        "go away",
        "transparent",
        "out of my sight",
        "out of sight",
        "out of the way",
        "out of my way",
        "out of view",
        "out of the view",
        "out of my view",
        "out of the picture",
        "hidden",
    ];
    if let Some(thing) = first(&gone) {
        return Some(Task::Call(ToolCall::Hide { target: target(thing) }));
    }
    if let Some(thing) = first(&["visible again", "visible", "reappear", "appear again", "appear", "come back"]) {
        return Some(Task::Call(ToolCall::Unhide { target: target(thing) }));
    }
    let near = first(&["bigger", "larger", "fill the screen", "fill the view", "fill the picture"]);
    let far = first(&["smaller"]);
    if let Some(thing) = near.or(far) {
        let closeness = if near.is_some() { CLOSER } else { FARTHER };
        if ["it", "that", "this"].contains(&thing.join(" ").as_str()) {
            return Some(Task::Closer(closeness));
        }
        return Some(Task::Call(ToolCall::GoTo { target: target(thing), side: Side::Same, closeness }));
    }
    let seen = first(&[
        "on screen",
        "on the screen",
        "in view",
        "into view",
        "into the view",
        "in the picture",
        "into focus",
        "in focus",
    ])?;
    Some(Task::Call(ToolCall::GoTo { target: target(seen), side: Side::Same, closeness: NORMAL }))
}

/// A command inside roundabout words: "might I trouble you for the size of the table". Only where the
/// clause begins with nothing that the scene or the grammar knows.
pub(super) fn salvaged(words: &[&str], clause: &[Token], identities: &Identities) -> Option<Vec<Task>> {
    let begins_known = words.first().is_some_and(|w| {
        clauses::VERBS.contains(w)
            || clauses::is_known(w, identities)
            || crate::agent::resolve::is_pick(w)
            || w.starts_with('#')
            || ["the", "a", "an", "it", "its", "one", "this", "that", "my", "both", "all", "thing"].contains(w)
    });
    if begins_known {
        return None;
    }
    for start in 1..words.len() {
        let rest = crate::agent::words::without_courtesy(&words[start..]);
        let all = BEGINNINGS.iter().chain(MORE_BEGINNINGS.iter());
        let begins = all.map(|(begin, _)| *begin).any(|begin| after(rest, &[begin]).is_some_and(|r| !r.is_empty()));
        // What destroys is not guessed from the middle of a sentence.
        let destroys =
            ["remove", "delete", "erase", "get", "wipe", "export", "save", "write", "rename", "call", "name"];
        if begins && !destroys.contains(&rest[0]) {
            return read(rest, clause, identities);
        }
    }
    None
}

fn done_to(verb: Verb, rest: &[&str], words: &[&str], identities: &Identities) -> Vec<Task> {
    let unclear = |what: &str| {
        vec![Task::refuse(RefusalKind::Unclear, format!("{what} what? Name a thing, such as 'the lamp'."))]
    };
    if rest.is_empty() {
        return match verb {
            Verb::Around => vec![Task::Side(Side::Other)],
            // "Which one is bigger? Show me."
            Verb::Go if words.len() > 1 => go(Verb::Go, &["it"], identities),
            _ => unclear(&crate::agent::describe::capital(&words.join(" "))),
        };
    }
    let everything = ["everything", "all", "all of it", "all of them", "all objects", "all things", "everything here"]
        .contains(&rest.join(" ").as_str());
    let each = |call: fn(Target) -> ToolCall| {
        let rest = match rest {
            ["me", rest @ ..] if !rest.is_empty() => rest,
            all => all,
        };
        let many = rest.first().is_some_and(|w| ["both", "all", "every", "each"].contains(w));
        let words = if many { &rest[1..] } else { rest };
        if many && !words.is_empty() {
            return vec![Task::Each(call(target(words)), words.join(" "))];
        }
        split_and(rest, identities).into_iter().map(|words| Task::Call(call(target(&words)))).collect()
    };
    match verb {
        Verb::Go | Verb::GoCloser | Verb::GoFarther | Verb::Around => go(verb, rest, identities),
        Verb::Look => {
            let looked = looked(rest);
            if looked.side.is_some() || looked.closeness != NORMAL {
                return go(Verb::Go, rest, identities);
            }
            vec![Task::Call(ToolCall::LookAt { target: target(rest) })]
        }
        Verb::Find => {
            let rest: Vec<&str> = match rest {
                [start @ .., "is" | "are"] if !start.is_empty() => start.to_vec(),
                all => all.to_vec(),
            };
            let looked = looked(&rest);
            if looked.side.is_some() || looked.closeness != NORMAL {
                go(Verb::Go, &rest, identities)
            } else {
                vec![Task::Find(plain(&rest))]
            }
        }
        Verb::Isolate | Verb::HideRest => vec![Task::Call(ToolCall::Isolate { target: target(rest) })],
        Verb::Unhide if everything => vec![Task::Call(ToolCall::ShowAll {})],
        Verb::Hide | Verb::Remove if everything => {
            let text = "One thing at a time, please: name what it is about.";
            vec![Task::refuse(RefusalKind::NotPermitted, text)]
        }
        Verb::Remove if rest.first().is_some_and(|w| ["both", "all", "every"].contains(w)) => {
            let text = "I remove one thing at a time: name which.";
            vec![Task::refuse(RefusalKind::NotPermitted, text)]
        }
        Verb::Hide => each(|target| ToolCall::Hide { target }),
        Verb::Unhide => each(|target| ToolCall::Unhide { target }),
        Verb::Remove => each(|target| ToolCall::Remove { target }),
        Verb::Highlight => each(|target| ToolCall::Highlight { target }),
        Verb::Describe => {
            let view = [
                "the view",
                "the scene",
                "what i see",
                "what you see",
                "this view",
                "what is here",
                "this scene",
                "the room",
            ];
            if view.contains(&rest.join(" ").as_str()) {
                return vec![Task::Call(ToolCall::Describe { target: None })];
            }
            each(|target| ToolCall::Describe { target: Some(target) })
        }
        Verb::Measure => match after(rest, &["the distance to", "how far"]) {
            Some(to) if !to.is_empty() => {
                vec![Task::Call(ToolCall::Measure { target: target(to), to: Some(Reference::Eye) })]
            }
            _ => each(|target| ToolCall::Measure { target, to: None }),
        },
        Verb::Distance => match between(rest).or_else(|| {
            let at = rest.iter().position(|w| *w == "to").filter(|at| *at > 0 && at + 1 < rest.len())?;
            let to = Some(Reference::Thing(target(&rest[at + 1..])));
            Some(Task::Call(ToolCall::Measure { target: target(&rest[..at]), to }))
        }) {
            Some(task) => vec![task],
            None => vec![Task::Call(ToolCall::Measure { target: target(rest), to: Some(Reference::Eye) })],
        },
        Verb::Export => each(|target| ToolCall::Export { target }),
        Verb::List => vec![super::questions::read(words).unwrap_or_else(|| Task::Again(rest.join(" ")))],
    }
}

/// "The mug and the lamp" as two; "knife and candle", too, if these are names.
fn split_and<'a>(words: &[&'a str], identities: &Identities) -> Vec<Vec<&'a str>> {
    let parts: Vec<Vec<&str>> = words.split(|w| *w == "and" || is_mark(w)).map(<[&str]>::to_vec).collect();
    let sound = parts.len() > 1
        && parts[1..]
            .iter()
            .all(|p| p.first().is_some_and(|w| ["the", "a", "an", "its", "my", "this", "that"].contains(w)));
    let named = parts.len() > 1
        && parts.iter().all(|p| !p.is_empty() && p.iter().all(|w| clauses::is_known(w, identities) || *w == "the"));
    let is_name = identities.iter().flat_map(|(_, i)| &i.names).any(|n| n.to_lowercase().contains(&words.join(" ")));
    if (sound || (named && !is_name)) && !parts[0].is_empty() { parts } else { vec![words.to_vec()] }
}

fn go(verb: Verb, rest: &[&str], identities: &Identities) -> Vec<Task> {
    let looked = looked(rest);
    let mut rest: Vec<&str> = looked.rest;
    let mut closeness = looked.closeness;
    match verb {
        Verb::GoCloser => closeness = CLOSER,
        Verb::GoFarther => closeness = FARTHER,
        _ => {}
    }
    let side = looked.side.or((verb == Verb::Around).then_some(Side::Other));
    for (word, value) in [("closer", CLOSER), ("nearer", CLOSER), ("farther", FARTHER), ("further", FARTHER)] {
        if rest.last() == Some(&word) {
            rest.pop();
            closeness = value;
        }
    }
    // "From the other side and a bit closer" leaves joining words behind.
    while rest.last().is_some_and(|w| ["and", "but", "a", "bit", "me", "around", "to"].contains(w)) {
        rest.pop();
    }
    let pronoun = rest.is_empty() || ["it", "that", "this", "me it", "me"].contains(&rest.join(" ").as_str());
    match (pronoun, side) {
        (true, Some(side)) if closeness == NORMAL => return vec![Task::Side(side)],
        (true, None) if closeness != NORMAL => return vec![Task::Closer(closeness)],
        _ => {}
    }
    if rest.is_empty() {
        rest = vec!["it"];
    }
    let side = side.unwrap_or_default();
    // "The mug again", of something hidden, is clear from the scene; the camera goes there all the same.
    let go = |words: Vec<&str>| Task::Call(ToolCall::GoTo { target: target(&words), side, closeness });
    split_and(&rest, identities).into_iter().map(go).collect()
}

/// "Rename the mug to cup", "call the mug 'tea cup'". The name is kept as it was typed.
fn rename(words: &[&str], clause: &[Token]) -> Option<Task> {
    let verb = *words.first()?;
    if !["rename", "call", "name"].contains(&verb) {
        return None;
    }
    let typed: Vec<&Token> = clause.iter().filter(|t| !is_mark(&t.low)).collect();
    // The verb may stand after words of courtesy, or have a slip in it.
    let start = typed.len().checked_sub(words.len())?;
    let rest = typed.get(start + 1..)?;
    let (what, name) = match rest.iter().rposition(|t| ["to", "as", "into"].contains(&t.low.as_str())) {
        Some(at) => (&rest[..at], &rest[at + 1..]),
        // "Call the mug 'tea cup'": a quoted text, or the last word.
        None if verb != "rename" || rest.last().is_some_and(|t| t.low.starts_with('"')) => {
            rest.split_at(rest.len().checked_sub(1)?)
        }
        None => (rest, &rest[..0]),
    };
    let what: Vec<&str> = what.iter().map(|t| t.low.trim_start_matches('"')).collect();
    let name: Vec<&str> = name.iter().map(|t| t.raw.as_str()).collect();
    if what.is_empty() || name.is_empty() {
        return Some(Task::refuse(RefusalKind::Unclear, "Say it as in 'rename the mug to tea cup'."));
    }
    Some(Task::Call(ToolCall::Rename { target: target(&what), name: name.join(" ") }))
}

/// A clause with a verb that is not one of a viewer's, or with none.
fn unknown_verb(words: &[&str], identities: &Identities) -> Option<Vec<Task>> {
    let first = *words.first()?;
    // "Move the mug to the left" moves no mug.
    let is_thing = |w: &&&str| clauses::is_known(w, identities) || ["it", "that", "this", "them"].contains(*w);
    let things: Vec<&&str> = words[1..].iter().filter(is_thing).collect();
    if ["move", "turn", "rotate", "push", "pull", "lower", "raise", "slide", "shift", "tilt", "spin", "put", "pick"]
        .contains(&first)
        && !things.is_empty()
    {
        let text = "I can only look and show; I cannot move or use anything in the real world. I can move the view instead: \
            say 'show me it from the left' or 'move left'.";
        return Some(vec![Task::refuse(RefusalKind::CannotDo, text)]);
    }
    if first == "go" || first == "walk" || first == "fly" || first == "move" || first == "take" || first == "get" {
        let rest = after(&words[1..], &["me to", "to", "over to", "me"]).unwrap_or(&words[1..]);
        if !rest.is_empty() && rest.iter().any(|w| clauses::is_known(w, identities)) {
            return Some(go(Verb::Go, rest, identities));
        }
    }
    None
}

/// What is said without a verb: a side, or a thing, which is treated as the last one was.
pub(super) fn bare(words: &[&str], identities: &Identities) -> Task {
    if let Some(task) = super::moves::read(words, identities) {
        return task;
    }
    let looked = looked(words);
    let rest: Vec<&str> = looked
        .rest
        .iter()
        .copied()
        .filter(|w| !["and", "but", "then", "too", "instead", "now", "also"].contains(w))
        .collect();
    let said = looked.side.is_some() || looked.closeness != NORMAL;
    if said && (rest.is_empty() || rest == ["it"]) {
        return match looked.side {
            Some(side) => Task::Side(side),
            None => Task::Closer(looked.closeness),
        };
    }
    if said {
        let side = looked.side.unwrap_or_default();
        return Task::Call(ToolCall::GoTo { target: target(&rest), side, closeness: looked.closeness });
    }
    // "Left a bit more" is read as a movement before; a verb nobody knows is no thing.
    let pointing = ["it", "its", "one", "ones", "other", "another", "this", "that", "them", "thing", "their"];
    let known = rest.iter().any(|w| pointing.contains(w) || clauses::is_known(w, identities) || w.starts_with('#'));
    if !known && (rest.len() > 3 || clauses::VERBS.contains(&rest.first().copied().unwrap_or_default())) {
        return Task::Noise(words.join(" "));
    }
    // Talk about a thing asks for nothing yet: "I believe there was a candle somewhere".
    if ["i", "we", "my", "he", "she", "they", "somebody", "someone", "there"].contains(rest.first().unwrap_or(&""))
        && rest.len() > 2
    {
        let first = rest.iter().position(|w| clauses::is_known(w, identities));
        if let Some(first) = first {
            let run: Vec<&str> =
                rest[first..].iter().copied().take_while(|w| clauses::is_known(w, identities)).collect();
            return Task::Mention(run.join(" "));
        }
    }
    if rest.is_empty() {
        return Task::refuse(RefusalKind::Unclear, format!("I did not understand that. {HELP}"));
    }
    Task::Again(rest.join(" "))
}
