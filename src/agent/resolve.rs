//! Resolution of a phrase to identities, by the language of questions. Ambiguous and unmatched phrases are reported;
//! nothing is guessed. What is found by embedding is said to be.

use super::describe::names;
use super::dialog::DialogState;
use super::refusal::{Refusal, RefusalKind};
use super::world::World;
use crate::pipeline::semantics::query::answer::{Basis, QueryAnswer};
use crate::pipeline::semantics::query::language::outcome::Why;
use crate::pipeline::semantics::query::language::slips::{mend, mended_text};
use crate::pipeline::semantics::query::language::{QueryPlace, SpokenOf};
use crate::pipeline::semantics::query::localize::Answer;
use crate::pipeline::semantics::query::recipe::MatchBy;
use crate::scene::{IdentityId, LevelFilter};

/// Offers of things that look like a phrase.
const OFFERED: usize = 3;
/// Identities that are near a phrase without a match.
const NEAR: usize = 6;

/// Result of a resolution.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Resolved {
    /// A single identity. The note says how it was found, if not by its name.
    One {
        id: IdentityId,
        note: String,
        /// True if it was found by embedding, not by name: a change then needs a confirmation.
        by_looks: bool,
    },
    /// All of these are meant.
    All(Vec<IdentityId>),
    /// One of these is meant.
    Several(Vec<IdentityId>),
    Missing {
        refusal: Refusal,
        near: Vec<IdentityId>,
    },
}

/// Resolves `phrase` to identities.
pub(crate) fn resolve(world: &mut dyn World, phrase: &str, level: LevelFilter, dialog: &DialogState) -> Resolved {
    let answered = match world.locate(phrase, level, &place(world, dialog)) {
        Ok(answered) => answered,
        Err(e) => return Resolved::Missing { refusal: Refusal::new(RefusalKind::Failed, e.0), near: Vec::new() },
    };
    let chosen = answered.chosen(1);
    match (&answered.answer, chosen.as_slice()) {
        (_, []) => missing(world, &answered),
        (_, [id]) => {
            let by_looks = answered.basis == Basis::Embedding;
            // Correcting typing errors is safe here: the reply names the thing, so a wrong correction is noticed.
            let mended = match world.identities().called(phrase, level).as_slice() {
                [] => mended_text(&mend(world.identities(), phrase).slips),
                _ => None,
            };
            let looked = by_looks.then(|| "(Found by embedding, not by name.)".to_owned());
            let said = answered.understood.iter().flat_map(|u| u.said.iter().chain(&u.notes).cloned());
            let notes: Vec<String> = mended.into_iter().chain(looked).chain(said).collect();
            Resolved::One { id: *id, note: notes.join(" "), by_looks }
        }
        (Answer::Ambiguous(_), _) => Resolved::Several(chosen),
        _ if answered.basis == Basis::Embedding => {
            let text = "What is found by embedding is no count: ask for one thing at a time.";
            Resolved::Missing { refusal: Refusal::new(RefusalKind::NotFound, text), near: chosen }
        }
        _ => Resolved::All(chosen),
    }
}

/// Resolves a phrase such as "buttons" or "bottles on the table" to all its identities.
pub(crate) fn resolve_all(
    world: &mut dyn World,
    phrase: &str,
    level: LevelFilter,
    dialog: &DialogState,
) -> Result<Vec<IdentityId>, Refusal> {
    match resolve(world, phrase, level, dialog) {
        Resolved::One { by_looks: true, .. } if world.match_by() != MatchBy::Embedding => {
            Err(Refusal::new(RefusalKind::NotFound, "By embedding, which is no count: ask for one thing at a time."))
        }
        Resolved::One { id, .. } => Ok(vec![id]),
        Resolved::All(ids) | Resolved::Several(ids) => Ok(ids),
        Resolved::Missing { refusal, .. } => Err(refusal),
    }
}

/// Place from which the world is asked.
pub(super) fn place(world: &dyn World, dialog: &DialogState) -> QueryPlace {
    let talk = SpokenOf { last: dialog.last.into_iter().collect(), group: dialog.group.clone() };
    QueryPlace { view: Some(world.view()), meters: world.meters_per_unit(), talk, gone: world.gone() }
}

fn missing(world: &dyn World, answered: &QueryAnswer) -> Resolved {
    let unmet = answered.understood.as_ref().and_then(|u| u.unmet.as_ref());
    let (kind, mut text) = match unmet {
        Some(unmet) => {
            let kind = match unmet.why {
                Why::Nothing => RefusalKind::Conflict,
                Why::Unknown => RefusalKind::NotFound,
                // A word that nothing here has, beside a thing that is there.
                Why::NotUnderstood if !unmet.near.is_empty() => RefusalKind::NotFound,
                Why::NotUnderstood => RefusalKind::Unclear,
                Why::Failed => RefusalKind::Failed,
            };
            let said = answered.understood.as_ref().and_then(|u| u.said.clone());
            (kind, said.unwrap_or_else(|| unmet.text.clone()))
        }
        None => (RefusalKind::Unclear, "I am not sure which thing you mean.".to_owned()),
    };
    let [mut near, looks] = answered.offers(NEAR);
    let alike: Vec<IdentityId> = looks.into_iter().filter(|id| world.facts(*id).is_some()).take(OFFERED).collect();
    if !alike.is_empty() && kind != RefusalKind::Conflict {
        text += &format!(" Looks most like: {}.", names(world, &alike, OFFERED));
        near.extend(alike);
    }
    Resolved::Missing { refusal: Refusal::new(kind, text), near }
}
