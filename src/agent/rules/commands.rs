//! Commands: show, find, hide, rename; and what is said without a verb.

use super::beginnings::{Verb, WHOLE, beginning};
use super::questions::{after, between, plain, query as target};
use super::sides::looked;
use super::{HELP, Task, clauses};
use crate::agent::refusal::RefusalKind;
use crate::agent::relation::Relation;
use crate::agent::resolve::relation_at;
use crate::agent::tool::{Reference, Target, ToolCall};
use crate::agent::wish::{CLOSER, FARTHER, NORMAL, Side};
use crate::agent::words::{Token, is_mark};
use crate::scene::Identities;

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
    if let Some((task, _)) = WHOLE.iter().find(|(_, whole)| whole.contains(&text.as_str())) {
        return Some(vec![task()]);
    }
    if let Some(task) = rename(words, clause) {
        return Some(vec![task]);
    }
    if let ["point", thing @ .., "out"] = words
        && !thing.is_empty()
    {
        return Some(vec![Task::Call(ToolCall::Highlight { target: target(thing) })]);
    }
    // "Go behind the lamp", "stand left of the table".
    if let Some(rest) =
        after(words, &["go to stand", "go", "fly", "walk", "move", "get", "stand", "step", "take me", "bring me"])
        && let Some((relation, n)) = relation_at(rest)
        && rest.len() > n
        && let Some(side) = side_for(relation)
    {
        return Some(vec![Task::Call(ToolCall::GoTo { target: target(&rest[n..]), side, closeness: NORMAL })]);
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
    let Some((verb, rest)) = beginning(words) else { return unknown_verb(words, identities) };
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
            || clauses::is_named(w, identities)
            || crate::agent::resolve::is_pick(w)
            || w.starts_with('#')
            || ["the", "a", "an", "it", "its", "one", "this", "that", "my", "both", "all", "thing"].contains(w)
    });
    if begins_known {
        return None;
    }
    for start in 1..words.len() {
        let rest = crate::agent::words::without_courtesy(&words[start..]);
        let begins = beginning(rest).is_some_and(|(_, what)| !what.is_empty());
        // What destroys is not guessed from the middle of a sentence.
        let destroys =
            ["remove", "delete", "erase", "get", "wipe", "export", "save", "write", "rename", "call", "name"];
        if begins && !destroys.contains(&rest[0]) {
            return read(rest, clause, identities);
        }
    }
    None
}

/// The side from which one looks who stands in this relation to a thing.
fn side_for(relation: Relation) -> Option<Side> {
    Some(match relation {
        Relation::Behind => Side::Other,
        Relation::Above => Side::Above,
        Relation::Under => Side::Below,
        Relation::InFrontOf => Side::Front,
        Relation::LeftOf => Side::Left,
        Relation::RightOf => Side::Right,
        Relation::Near => Side::Same,
        Relation::On | Relation::In | Relation::PartOf => return None,
    })
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
    let is_name = identities.iter().flat_map(|(_, i)| &i.names).any(|n| n.to_lowercase().contains(&plain(words)));
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
    // "The front of the laptop" is a side, unless something is called so.
    let mut side = side;
    let sides = ["front", "back", "rear", "top", "bottom", "underside"];
    let of = rest.iter().position(|w| *w == "of").filter(|at| *at > 0 && at + 1 < rest.len());
    if let Some(of) = of
        && sides.contains(&rest[of - 1])
        && rest[..of - 1].iter().all(|w| ["the", "at", "to", "from"].contains(w))
        && side.is_none()
        && !clauses::is_named(rest[of - 1], identities)
    {
        side = Some(match rest[of - 1] {
            "front" => Side::Front,
            "top" => Side::Above,
            "bottom" | "underside" => Side::Below,
            _ => Side::Other,
        });
        rest = rest[of + 1..].to_vec();
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
