//! Parsing of the user's answer to a question: yes or no, or one of the candidates.

use super::commands::is_command;
use super::dialog::DialogState;
use super::language::CommandLanguage;
use super::names::words_of;
use super::resolve::{Resolved, resolve};
use super::words::{number, ordinal};
use super::world::World;
use crate::scene::identity::name_words::words as name_words;
use crate::scene::{IdentityId, LevelFilter};

/// Answer to a yes-or-no question.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Confirmation {
    Yes,
    No,
    Neither,
}

/// Polite endings that may follow a yes or a no.
const POLITE: [&str; 3] = [" please", " thanks", " thank you"];

/// Reads a yes or a no. Only plain answers count: "yes but ..." is neither.
pub(crate) fn confirmation(text: &str) -> Confirmation {
    let words: Vec<String> = words_of(text).into_iter().filter(|w| w != ",").collect();
    let said = words.join(" ");
    let said = POLITE.iter().find_map(|p| said.strip_suffix(p)).unwrap_or(&said);
    let language = CommandLanguage::get();
    match said {
        said if language.yes.iter().any(|w| w == said) => Confirmation::Yes,
        said if language.no.iter().any(|w| w == said) => Confirmation::No,
        _ => Confirmation::Neither,
    }
}

/// Answer to a question for one of several candidates.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Choice {
    One(IdentityId),
    None,
    /// An ambiguous answer.
    Unclear,
    /// A text that is not an answer, such as a new command.
    Else,
}

/// Returns the candidate that a text chooses.
pub(crate) fn choice(world: &mut dyn World, text: &str, candidates: &[IdentityId], dialog: &DialogState) -> Choice {
    let called = world.identities().called(text, LevelFilter::Auto);
    if let [only] = candidates.iter().filter(|id| called.contains(id)).collect::<Vec<_>>().as_slice() {
        return Choice::One(**only);
    }
    if confirmation(text) == Confirmation::No {
        return Choice::None;
    }
    let words: Vec<String> = words_of(text).into_iter().filter(|w| w != ",").collect();
    // "The second one", "2": by position in the list that was shown.
    let plain: Vec<&str> = words.iter().map(String::as_str).filter(|w| !["the", "one", "number"].contains(w)).collect();
    if let [only] = plain.as_slice()
        && let Some(n) = ordinal(only).or_else(|| number(only).filter(|n| *n >= 1.0).map(|n| n as usize))
    {
        let at = if n == 0 { candidates.len() } else { n };
        return candidates.get(at.wrapping_sub(1)).map_or(Choice::Unclear, |id| Choice::One(*id));
    }
    // By the names of the candidates or of their ancestors: "the kettle's" chooses its handle.
    let content: Vec<&str> = plain.iter().copied().filter(|w| !["'s", "of", "a"].contains(w)).collect();
    let all = world.identities();
    let fits = |id: &IdentityId| {
        let known: Vec<String> =
            all.ancestors(*id).filter_map(|i| all.get(i)).flat_map(|i| &i.names).flat_map(|n| name_words(n)).collect();
        !content.is_empty() && content.iter().all(|w| name_words(w).iter().all(|w| known.contains(w)))
    };
    let fit: Vec<IdentityId> = candidates.iter().copied().filter(fits).collect();
    if let [only] = fit.as_slice() {
        return Choice::One(*only);
    }
    let among = DialogState { group: candidates.to_vec(), ..dialog.clone() };
    for phrase in [words.join(" "), format!("{} one", words.join(" "))] {
        if let Resolved::One { id, by_looks: false, .. } = resolve(world, &phrase, LevelFilter::Auto, &among)
            && candidates.contains(&id)
        {
            return Choice::One(id);
        }
    }
    if candidates.is_empty() || is_command(text, world.identities()) || words.len() > 4 {
        Choice::Else
    } else {
        Choice::Unclear
    }
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
