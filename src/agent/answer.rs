//! What people answer to a question: yes or no, or which of the candidates they mean.

use super::focus::Focus;
use super::refusal::{Refusal, RefusalKind};
use super::resolve::{Resolved, resolve};
use super::rules::is_request;
use super::tool::LevelWish;
use super::words::{low, number, ordinal, tokens, without_courtesy};
use super::world::World;
use crate::scene::IdentityId;

/// An answer to "shall I?".
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Confirmation {
    /// Do it.
    Yes,
    /// Do not.
    No,
    /// Something else was said.
    Neither,
}

const YES: [&str; 27] = [
    "yes",
    "y",
    "yeah",
    "yep",
    "yup",
    "sure",
    "ok",
    "okay",
    "do it",
    "go ahead",
    "confirm",
    "confirmed",
    "i confirm",
    "yes do it",
    "yes please",
    "yes go ahead",
    "of course",
    "certainly",
    "please do",
    "right",
    "correct",
    "that's right",
    "yes remove it",
    "yes delete it",
    "yes rename it",
    "yes i am sure",
    "yes i'm sure",
];
const NO: [&str; 24] = [
    "no",
    "n",
    "nope",
    "nah",
    "don't",
    "do not",
    "don't do it",
    "do not do it",
    "no don't",
    "cancel",
    "cancel that",
    "stop",
    "abort",
    "never mind",
    "nevermind",
    "forget it",
    "leave it",
    "no leave it",
    "rather not",
    "better not",
    "no thanks",
    "no thank you",
    "no never mind",
    "neither",
];

/// Whether a text says yes or no. Only plain answers count: "yes but ..." is neither.
pub fn confirmation(text: &str) -> Confirmation {
    let tokens = tokens(text);
    let words = low(&tokens);
    let said = words.join(" ");
    let said = [said.strip_suffix(" please"), said.strip_suffix(" thanks"), Some(said.as_str())]
        .into_iter()
        .flatten()
        .next()
        .unwrap_or_default();
    if YES.contains(&said) {
        Confirmation::Yes
    } else if NO.contains(&said) {
        Confirmation::No
    } else {
        Confirmation::Neither
    }
}

/// An answer to "which one?".
#[derive(Clone, Debug, PartialEq)]
pub enum Choice {
    /// This one.
    One(IdentityId),
    /// None of them: the request is dropped.
    None,
    /// It was an answer, but it does not choose.
    Unclear(Refusal),
    /// Something else was said: a new request.
    Else,
}

/// Which of the candidates a text means.
pub fn choice(world: &mut dyn World, text: &str, candidates: &[IdentityId], focus: &Focus) -> Choice {
    if confirmation(text) == Confirmation::No {
        return Choice::None;
    }
    if candidates.is_empty() {
        return Choice::Else;
    }
    let tokens = tokens(text);
    let words = low(&tokens);
    let words = without_courtesy(&words);
    let unclear = |text: String| Choice::Unclear(Refusal::new(RefusalKind::Unclear, text));
    let plain: Vec<&str> = words
        .iter()
        .copied()
        .filter(|w| !["the", "number", "no", "one", "option", "i", "mean", "meant", "it's"].contains(w))
        .collect();
    // "The second one", "2", "number two": as they were listed.
    if let [only] = plain.as_slice() {
        let listed = ordinal(only).map(f64::from).or_else(|| number(only));
        if let Some(n) = listed {
            let at = if n < 0.0 { candidates.len() } else { n as usize };
            return match at.checked_sub(1).and_then(|i| candidates.get(i)) {
                Some(id) => Choice::One(*id),
                None => unclear(format!("There are only {} to choose from.", candidates.len())),
            };
        }
        if let Some(id) = only.strip_prefix('#').and_then(|n| n.parse().ok()).filter(|id| candidates.contains(id)) {
            return Choice::One(id);
        }
    }
    if words == ["one"] || words == ["the", "one"] {
        return candidates.first().map_or(Choice::Else, |id| Choice::One(*id));
    }
    if is_request(words, world.identities()) {
        return Choice::Else;
    }
    // "Any", "either".
    if let ["any" | "either" | "whichever" | "whatever", ..] = words {
        return candidates.first().map_or(Choice::Else, |id| Choice::One(*id));
    }
    let words = match words {
        ["i", "mean" | "meant", rest @ ..] if !rest.is_empty() => rest,
        other => other,
    };
    // Among the candidates first, by what names them: "the kettle's" chooses its handle.
    let said: Vec<&str> = words.iter().map(|w| w.strip_suffix("'s").unwrap_or(w)).collect();
    let content: Vec<&str> = said
        .iter()
        .copied()
        .filter(|w| !["the", "one", "of", "on", "that", "a", "an", "this", "from"].contains(w))
        .collect();
    let all = world.identities();
    let fits = |id: &IdentityId| {
        let names = all.line(*id).filter_map(|i| all.get(i)).flat_map(|i| &i.names);
        let known: Vec<String> =
            names.flat_map(|n| n.to_lowercase().split_whitespace().map(str::to_owned).collect::<Vec<_>>()).collect();
        !content.is_empty() && content.iter().all(|w| known.iter().any(|k| super::words::alike(k, w)))
    };
    let fit: Vec<IdentityId> = candidates.iter().copied().filter(fits).collect();
    if let [only] = fit.as_slice() {
        return Choice::One(*only);
    }
    let phrases = [words.join(" "), format!("{} one", words.join(" "))];
    for phrase in phrases {
        match resolve(world, &phrase, LevelWish::Any, focus) {
            Ok(Resolved::One { id, .. }) if candidates.contains(&id) => return Choice::One(id),
            Ok(Resolved::Several(some)) => {
                let fit: Vec<IdentityId> = candidates.iter().copied().filter(|c| some.contains(c)).collect();
                if let [only] = fit.as_slice() {
                    return Choice::One(*only);
                }
            }
            _ => {}
        }
    }
    if words.len() <= 4 { unclear("I do not know which of them that is.".into()) } else { Choice::Else }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_plain_answers_are_a_yes_or_a_no() {
        for yes in ["yes", "Yes, please!", "do it", "OK.", "sure"] {
            assert_eq!(confirmation(yes), Confirmation::Yes, "{yes}");
        }
        for no in ["no", "No, thanks.", "cancel", "never mind", "don't!"] {
            assert_eq!(confirmation(no), Confirmation::No, "{no}");
        }
        for neither in ["yes but only the lid", "show me the lamp", "no, the blue one", "", "the yes button"] {
            assert_eq!(confirmation(neither), Confirmation::Neither, "{neither}");
        }
    }
}
