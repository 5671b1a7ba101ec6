//! Questions: what, where, how many, how big, is there.

use super::Task;
use crate::agent::relation::Relation;
use crate::agent::resolve::relation_at;
use crate::agent::tool::{LevelWish, Reference, Target, ToolCall};
use crate::agent::words::singular;

/// The rest of `words` after one of `phrases`; longer phrases first.
pub(super) fn after<'a, 'b>(words: &'b [&'a str], phrases: &[&str]) -> Option<&'b [&'a str]> {
    phrases.iter().find_map(|phrase| {
        let wanted: Vec<&str> = phrase.split(' ').collect();
        words.starts_with(&wanted).then(|| &words[wanted.len()..])
    })
}

/// Words as a target, without the article.
pub(super) fn query(words: &[&str]) -> Target {
    Target::query(plain(words))
}

/// Words without the article.
pub(super) fn plain(words: &[&str]) -> String {
    match words {
        ["the" | "a" | "an", rest @ ..] if !rest.is_empty() => rest.join(" "),
        all => all.join(" "),
    }
}

fn describe(target: Option<Target>) -> Task {
    Task::Call(ToolCall::Describe { target })
}

fn list(level: LevelWish, of: Option<Target>, relation: Relation, named: Option<String>) -> Task {
    Task::Call(ToolCall::List { level, of, relation, named })
}

/// Words for the scene or the view, which limit nothing.
fn is_everywhere(words: &[&str]) -> bool {
    let text = words.join(" ");
    let text = text.strip_prefix("there ").unwrap_or(&text);
    [
        "",
        "there",
        "here",
        "in here",
        "in the scene",
        "in this scene",
        "in the room",
        "in this room",
        "in it",
        "in the picture",
        "around",
        "around here",
        "in total",
        "altogether",
        "exist",
        "you know",
        "do you know",
        "can you see",
        "do you see",
        "can i see",
        "available",
        "present",
        "known",
        "in this place",
    ]
    .contains(&text)
}

/// Words for the present view.
fn is_view(words: &[&str]) -> bool {
    let text = words.join(" ");
    [
        "in view",
        "in the view",
        "in my view",
        "in front of me",
        "in front of us",
        "on screen",
        "on the screen",
        "visible",
        "visible now",
        "in sight",
        "visible here",
        "on my screen",
        "in the picture",
    ]
    .contains(&text.as_str())
}

/// A question.
pub(super) fn read(words: &[&str]) -> Option<Task> {
    let (first, rest) = words.split_first()?;
    match *first {
        "what" | "which" | "who" | "identify" => what(rest),
        "where" | "whereabouts" => find(rest),
        "how" => how(rest),
        "is" | "are" => is_there(rest),
        "does" | "do" | "has" => does(rest),
        "list" | "enumerate" | "name" | "count" => listed(first, rest),
        "can" => after(rest, &["you see", "i see", "we see", "you find"]).and_then(there),
        "tell" => told(rest),
        "anything" | "something" | "any" | "nothing" => there(words),
        "show" | "give" => {
            let rest = after(rest, &["me a list of", "a list of", "me all the", "me all", "all the", "all"])?;
            let all = words.contains(&"all");
            let generic = rest.first().is_some_and(|w| ["objects", "things", "parts", "items"].contains(w));
            (generic || !all).then(|| listed("list", rest)).flatten()
        }
        _ => None,
    }
}

fn told(rest: &[&str]) -> Option<Task> {
    let rest = after(rest, &["me", "us"]).unwrap_or(rest);
    if let Some(about) = after(rest, &["more about", "something about", "about"]) {
        return (!about.is_empty()).then(|| describe(Some(query(about))));
    }
    let inner = read(rest)?;
    Some(inner)
}

fn find(rest: &[&str]) -> Option<Task> {
    // "Where the ball is", after "show me" or "do you know".
    if let [thing @ .., "is" | "are" | "went"] = rest
        && !thing.is_empty()
        && !["is", "are"].contains(&rest[0])
    {
        return Some(Task::Find(plain(thing)));
    }
    let rest = after(
        rest,
        &["can i find", "do i find", "could i find", "can i see", "would i find", "is", "are", "did", "do you see"],
    )?;
    match rest {
        ["am", "i"] | ["i", "am"] | ["we"] => Some(describe(None)),
        [] => None,
        thing => {
            let thing = match thing {
                [start @ .., "located" | "at" | "now" | "standing" | "hiding"] if !start.is_empty() => start,
                all => all,
            };
            Some(Task::Find(plain(thing)))
        }
    }
}

/// "Which of the two bottles is the bigger one": the bigger bottle.
fn which_is(rest: &[&str]) -> Option<Task> {
    let at = rest.iter().position(|w| ["is", "are"].contains(w)).filter(|at| *at > 0)?;
    let skip = ["of", "the", "two", "three", "these", "those", "a", "an"];
    let of: Vec<&str> = rest[..at].iter().copied().filter(|w| !skip.contains(w)).collect();
    let how: Vec<&str> = rest[at + 1..].iter().copied().filter(|w| !["the", "one", "more"].contains(w)).collect();
    let what = if of.is_empty() { "one".to_owned() } else { of.join(" ") };
    // "Which bottle is closer to the lamp?"
    if let ["closer" | "nearer" | "closest" | "nearest", "to", anchor @ ..] = how.as_slice()
        && !anchor.is_empty()
    {
        return Some(describe(Some(Target::query(format!("{what} nearest to {}", anchor.join(" "))))));
    }
    let [how] = how.as_slice() else { return None };
    crate::agent::resolve::is_pick(how).then(|| describe(Some(Target::query(format!("{how} {what}")))))
}

fn what(rest: &[&str]) -> Option<Task> {
    if let Some(task) = which_is(rest) {
        return Some(task);
    }
    if let Some(of) =
        after(rest, &["colour is", "color is", "kind of thing is", "material is", "sort of thing is", "does"])
        && (rest[0] != "does" || of.ends_with(&["look", "like"]))
    {
        let of = of.strip_suffix(&["look", "like"]).unwrap_or(of);
        return (!of.is_empty()).then(|| describe(Some(query(of))));
    }
    let text = rest.join(" ");
    if [
        "have we got here",
        "do we have here",
        "have we here",
        "am i looking at",
        "do i see",
        "do you see",
        "can i see",
        "can you see",
        "are we looking at",
        "can be seen",
        "am i seeing",
        "do we see",
    ]
    .iter()
    .any(|p| text == *p || text.strip_prefix(p).is_some_and(|r| [" here", " now", " there", " right now"].contains(&r)))
        || after(rest, &["is", "are", "things are", "objects are"]).is_some_and(is_view)
    {
        return Some(describe(None));
    }
    // "What is on the table", "what stands left of the laptop", "which things are under the table".
    let verbs = [
        "objects are",
        "things are",
        "object is",
        "thing is",
        "items are",
        "else is",
        "is there",
        "is standing",
        "is lying",
        "is sitting",
        "is placed",
        "are there",
        "stands",
        "lies",
        "sits",
        "is",
        "are",
        "objects stand",
        "things stand",
        "things lie",
    ];
    if let Some(after_verb) = after(rest, &verbs) {
        if let Some((relation, n)) = relation_at(after_verb)
            && !after_verb[n..].is_empty()
            && !is_everywhere(after_verb)
        {
            return Some(list(LevelWish::Object, Some(query(&after_verb[n..])), relation, None));
        }
        if is_everywhere(after_verb) && (rest[0] != "is" || after_verb.is_empty() || rest.len() > 1) {
            return Some(list(LevelWish::Object, None, Relation::PartOf, None));
        }
    }
    // Parts.
    let parts = [
        "are the parts of",
        "are the pieces of",
        "is part of",
        "belongs to",
        "parts are on",
        "parts belong to",
        "are its parts",
    ];
    if let Some(of) = after(rest, &parts) {
        let of = if of.is_empty() { &["it"] } else { of };
        return Some(list(LevelWish::Part, Some(query(of)), Relation::PartOf, None));
    }
    if let Some(of) = after(rest, &["parts does", "parts do", "pieces does", "parts has", "does", "components does"]) {
        let of = match of {
            [start @ .., "have" | "has" | "got"] => Some(start),
            [start @ .., "consist", "of"] => Some(start),
            other if ["parts", "pieces", "components"].contains(&rest[0]) => Some(other),
            _ => None,
        };
        if let Some(of) = of.filter(|o| !o.is_empty()) {
            return Some(list(LevelWish::Part, Some(query(of)), Relation::PartOf, None));
        }
    }
    if let Some([start @ .., "made", "of" | "from"]) = after(rest, &["is", "are"])
        && !start.is_empty()
    {
        return Some(list(LevelWish::Part, Some(query(start)), Relation::PartOf, None));
    }
    // Sizes and distances.
    if let Some(of) = after(rest, &["is the distance between", "distance is there between", "distance is between"]) {
        return between(of);
    }
    if let Some(of) = after(rest, &["is the distance to", "is the distance of", "is its distance"]) {
        return Some(Task::Call(ToolCall::Measure {
            target: query(if of.is_empty() { &["it"] } else { of }),
            to: Some(Reference::Eye),
        }));
    }
    let sizes = [
        "is the size of",
        "are the dimensions of",
        "are the measurements of",
        "is the height of",
        "is the width of",
        "is the length of",
        "is the depth of",
        "size is",
        "size has",
    ];
    if let Some(of) = after(rest, &sizes) {
        return Some(Task::Call(ToolCall::Measure { target: query(of), to: None }));
    }
    if after(rest, &["is its size", "are its dimensions", "is its height", "is its width"]).is_some() {
        return Some(Task::Call(ToolCall::Measure { target: query(&["it"]), to: None }));
    }
    if ["can you do", "can i say", "can i ask", "can i do", "do you understand", "are you able to do"]
        .contains(&text.as_str())
    {
        return Some(Task::Say(super::HELP.into()));
    }
    if let Some(thing) = after(rest, &["about"]).filter(|t| !t.is_empty()) {
        return Some(Task::Again(thing.join(" ")));
    }
    let thing = after(rest, &["is", "are"])?;
    match thing {
        [] => None,
        ["this" | "that" | "it", "thing" | "object"] | ["this" | "that"] => Some(describe(Some(query(&["it"])))),
        [start @ .., "called" | "named"] if !start.is_empty() => Some(describe(Some(query(start)))),
        ["its", "name"] => Some(describe(Some(query(&["it"])))),
        ["your", "name"] | ["you"] => Some(Task::Say(super::HELP.into())),
        thing => Some(describe(Some(query(thing)))),
    }
}

fn how(rest: &[&str]) -> Option<Task> {
    let measured = [
        "big is",
        "tall is",
        "high is",
        "wide is",
        "long is",
        "large is",
        "thick is",
        "deep is",
        "small is",
        "broad is",
        "big are",
        "tall are",
        "large are",
    ];
    if let Some(of) = after(rest, &measured) {
        return (!of.is_empty()).then(|| Task::Call(ToolCall::Measure { target: query(of), to: None }));
    }
    let far = [
        "far away is",
        "far away are",
        "far apart are",
        "far is it to",
        "far is it from",
        "far off is",
        "far is",
        "far are",
        "distant is",
        "close is",
    ];
    if let Some(of) = after(rest, &far) {
        return distance_of(of);
    }
    if let Some(rest) = after(rest, &["many", "much"]) {
        return count(rest);
    }
    if ["does this work", "does it work", "do i use this", "can i use this"].contains(&rest.join(" ").as_str()) {
        return Some(Task::Say(super::HELP.into()));
    }
    after(rest, &["about"]).filter(|r| !r.is_empty()).map(|r| Task::Again(r.join(" ")))
}

/// "The mug from the lamp", "the mug and the lamp", "the lamp".
fn distance_of(of: &[&str]) -> Option<Task> {
    let of = match of {
        [start @ .., "away"] | [start @ .., "apart"] | [start @ .., "from", "here"] | [start @ .., "from", "me"] => {
            start
        }
        all => all,
    };
    let of = match of {
        [start @ .., "away", "from", "me" | "here"] => start,
        all => all,
    };
    if let Some(at) =
        of.iter().position(|w| ["from", "to", "and"].contains(w)).filter(|at| *at > 0 && at + 1 < of.len())
    {
        let first = match &of[..at] {
            [start @ .., "away"] => start,
            all => all,
        };
        let to = Some(Reference::Thing(query(&of[at + 1..])));
        return Some(Task::Call(ToolCall::Measure { target: query(first), to }));
    }
    (!of.is_empty()).then(|| Task::Call(ToolCall::Measure { target: query(of), to: Some(Reference::Eye) }))
}

pub(super) fn between(of: &[&str]) -> Option<Task> {
    let at = of.iter().position(|w| *w == "and").filter(|at| *at > 0 && at + 1 < of.len())?;
    let to = Some(Reference::Thing(query(&of[at + 1..])));
    Some(Task::Call(ToolCall::Measure { target: query(&of[..at]), to }))
}

/// "Buttons does the red controller have", "mugs are on the table", "mugs are there".
fn count(rest: &[&str]) -> Option<Task> {
    let verb = rest
        .iter()
        .position(|w| ["does", "do", "are", "is", "has", "have", "can", "on", "in", "of", "you"].contains(w));
    let verb = verb.unwrap_or(rest.len());
    let (what, rest) = rest.split_at(verb);
    if what.is_empty() {
        return None;
    }
    let (level, named) = named(what);
    if is_everywhere(rest) || is_everywhere(rest.get(1..).unwrap_or_default()) {
        return Some(list(level, None, Relation::PartOf, named));
    }
    if is_view(rest.get(1..).unwrap_or_default()) {
        return Some(describe(None));
    }
    if let [_, of @ .., "have" | "has" | "got"] = rest
        && !of.is_empty()
    {
        return Some(list(LevelWish::Part, Some(query(of)), Relation::PartOf, named));
    }
    let placed =
        after(rest, &["are there", "is there", "are", "is", "do you see", "can you see", "can i see", "stand", "lie"])
            .unwrap_or(rest);
    let placed = match placed {
        ["standing" | "lying" | "placed", rest @ ..] => rest,
        all => all,
    };
    if let Some((relation, n)) = relation_at(placed) {
        let of = &placed[n..];
        // "On the controller": its parts, if it has such; the list looks at both.
        let parts =
            relation == Relation::On && level != LevelWish::Object && named.as_deref().is_some_and(is_piece_word);
        let relation = if parts { Relation::PartOf } else { relation };
        return (!of.is_empty()).then(|| list(level, Some(query(of)), relation, named));
    }
    if let Some(of) = after(placed, &["of", "part of", "belong to"]) {
        return (!of.is_empty()).then(|| list(LevelWish::Part, Some(query(of)), Relation::PartOf, named));
    }
    if let ["has" | "have", ..] = rest {
        return None;
    }
    Some(list(level, None, Relation::PartOf, named))
}

/// Words that mostly name pieces.
fn is_piece_word(word: &str) -> bool {
    [
        "button", "key", "handle", "lid", "knob", "eye", "leg", "wheel", "stick", "spout", "drawer", "switch", "part",
        "piece",
    ]
    .contains(&singular(word).as_str())
}

/// Level and name of what is listed: "objects" are a level, "mugs" a name.
fn named(what: &[&str]) -> (LevelWish, Option<String>) {
    let words: Vec<&str> = what
        .iter()
        .copied()
        .filter(|w| !["the", "all", "different", "other", "of", "every", "named"].contains(w))
        .collect();
    match words.as_slice() {
        ["objects" | "object" | "items"] => (LevelWish::Object, None),
        ["things" | "thing" | "stuff"] => (LevelWish::Object, None),
        ["parts" | "part" | "pieces" | "components"] => (LevelWish::Part, None),
        [] => (LevelWish::Object, None),
        words => (LevelWish::Any, Some(words.join(" "))),
    }
}

/// "The parts of the kettle", "all objects", "what is on the table".
fn listed(verb: &str, rest: &[&str]) -> Option<Task> {
    let rest = after(rest, &["me", "for me", "up"]).unwrap_or(rest);
    if let Some(["what", inner @ ..]) = Some(rest) {
        return what(inner);
    }
    if rest.is_empty() || rest == ["everything"] {
        return (verb != "name").then(|| list(LevelWish::Object, None, Relation::PartOf, None));
    }
    let generic = |w: &str| {
        ["objects", "things", "parts", "pieces", "items", "components", "part", "everything", "names"].contains(&w)
    };
    if verb == "name" && !rest.iter().any(|w| generic(w)) {
        return None;
    }
    if let Some(of) = rest.iter().position(|w| ["of"].contains(w)).filter(|at| *at > 0 && at + 1 < rest.len()) {
        let (level, name) = named(&rest[..of]);
        let level = if level == LevelWish::Object { LevelWish::Part } else { level };
        return Some(list(level, Some(query(&rest[of + 1..])), Relation::PartOf, name));
    }
    for at in 1..rest.len() {
        if is_everywhere(&rest[at..]) {
            let (level, name) = named(&rest[..at]);
            return Some(list(level, None, Relation::PartOf, name));
        }
        if let Some((relation, n)) = relation_at(&rest[at..]).filter(|(_, n)| at + n < rest.len()) {
            let (level, name) = named(&rest[..at]);
            return Some(list(level, Some(query(&rest[at + n..])), relation, name));
        }
    }
    if let [own, what @ ..] = rest
        && ["its", "their"].contains(own)
        && !what.is_empty()
    {
        let (_, name) = named(what);
        return Some(list(LevelWish::Part, Some(query(&["it"])), Relation::PartOf, name));
    }
    let (level, name) = named(rest);
    Some(list(level, None, Relation::PartOf, name))
}

/// "Is there a mug (left of the laptop)", "are there any bottles", "is the mug on the table".
fn is_there(rest: &[&str]) -> Option<Task> {
    match rest {
        ["there", what @ ..] => there(what),
        ["you", ..] | [] => None,
        ["it" | "that" | "this", "safe" | "dangerous", ..] => None,
        // "Is the mug left of the laptop?"
        thing => {
            let place = (1..thing.len()).any(|i| relation_at(&thing[i..]).is_some());
            place.then(|| Task::Call(ToolCall::Locate { query: plain(thing), kind: LevelWish::Any }))
        }
    }
}

/// What there may be: placed things are looked for, others listed.
fn there(what: &[&str]) -> Option<Task> {
    let what: Vec<&str> = what.iter().copied().skip_while(|w| ["a", "an", "any", "some", "the"].contains(w)).collect();
    let end = (1..what.len()).find(|i| is_everywhere(&what[*i..])).unwrap_or(what.len());
    let what = &what[..end];
    if what.is_empty() {
        return None;
    }
    if matches!(what, ["anything" | "something", ..])
        && let Some((relation, n)) = relation_at(&what[1..])
        && !what[1 + n..].is_empty()
    {
        return Some(list(LevelWish::Object, Some(query(&what[1 + n..])), relation, None));
    }
    let placed = (1..what.len()).any(|i| relation_at(&what[i..]).is_some() || ["of", "with"].contains(&what[i]));
    if placed {
        return Some(Task::Call(ToolCall::Locate { query: what.join(" "), kind: LevelWish::Any }));
    }
    let (level, name) = named(what);
    Some(list(level, None, Relation::PartOf, name))
}

/// "Does the kettle have a lid", "do you see a mug", "has it buttons".
fn does(rest: &[&str]) -> Option<Task> {
    if let Some(what) = after(rest, &["you see", "you know", "you have", "i see"]) {
        let what = after(what, &["where"]).map_or_else(|| there(what), |w| find(&[&["is"], w].concat()));
        return what;
    }
    let at = rest.iter().position(|w| ["have", "has"].contains(w))?;
    let (whole, piece) = (&rest[..at], &rest[at + 1..]);
    let piece: Vec<&str> =
        piece.iter().copied().skip_while(|w| ["a", "an", "any", "the", "some"].contains(w)).collect();
    if whole.is_empty() || piece.is_empty() {
        return None;
    }
    let (level, name) = named(&piece);
    let level = if level == LevelWish::Any { LevelWish::Part } else { level };
    Some(list(level, Some(query(whole)), Relation::PartOf, name))
}
