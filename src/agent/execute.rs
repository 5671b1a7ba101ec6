//! Execution of a planned call: permission, target, facts of the scene and confirmation are checked, then the
//! [`World`] acts. The calls of every planner pass here, and only here.

use std::sync::atomic::AtomicBool;

use super::camera_args::{Distance, NORMAL};
use super::describe::{self, SEEN, length, the};
use super::dialog::DialogState;
use super::listing::{list_ids, measure, say_list};
use super::objection::{conflict, question};
use super::photo_answer;
use super::policy::Policy;
use super::refusal::{Refusal, RefusalKind};
use super::resolve::{Resolved, resolve};
use super::tool::{Reference, Target, ToolCall};
use super::world::{Unreachable, World, WorldError};
use crate::math::format::{self, capital};
use crate::navigate::target::Side;
use crate::scene::{IdentityId, LevelFilter, NO_IDENTITY};

/// Outcome of a call.
#[derive(Clone, Debug, PartialEq)]
pub struct CallOutcome {
    /// Call, with targets by number where they were found.
    pub(crate) call: ToolCall,
    pub(crate) ids: Vec<IdentityId>,
    pub(crate) text: String,
    /// Kind of refusal if the call was not done.
    pub(crate) refused: Option<RefusalKind>,
}

impl CallOutcome {
    /// Returns whether the text may name local files: such a text is for the user alone.
    pub(crate) fn is_private(&self) -> bool {
        match self.refused {
            Some(kind) => kind == RefusalKind::Failed,
            // A chat model gets neither files nor cameras.
            None => {
                use ToolCall::{AddPhotos, Export, LocatePhoto, ShowChanges};
                matches!(self.call, Export { .. } | LocatePhoto { .. } | ShowChanges {} | AddPhotos { .. })
            }
        }
    }

    /// Result as reported to a remote planner.
    pub(crate) fn heard(&self) -> &str {
        match self.refused {
            _ if !self.is_private() => &self.text,
            None if matches!(self.call, ToolCall::Export { .. }) => "It is written to a file; the user is told which.",
            None if matches!(self.call, ToolCall::AddPhotos { .. }) => {
                "The photos are being added; the new scene is shown to the user once it is done."
            }
            None => "The photo is found, and shown to the user, who is told where it was taken.",
            Some(_) => "It failed on the user's machine; the user is told why.",
        }
    }
}

/// Call after its checks.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum CheckedCall {
    Ready {
        call: ToolCall,
        ids: Vec<IdentityId>,
        /// Note on how the target was found, such as a corrected word; mostly empty.
        note: String,
    },
    Refused {
        refusal: Refusal,
        near: Vec<IdentityId>,
    },
    Choose {
        question: String,
        candidates: Vec<IdentityId>,
    },
    Confirm {
        question: String,
        call: ToolCall,
        ids: Vec<IdentityId>,
    },
}

impl CheckedCall {
    fn refused(kind: RefusalKind, text: impl Into<String>) -> Self {
        Self::Refused { refusal: Refusal::new(kind, text), near: Vec::new() }
    }
}

/// Checks a call. `is_confirmed` is true once the user has said yes to it.
pub(crate) fn check(
    world: &mut dyn World,
    call: &ToolCall,
    policy: &Policy,
    dialog: &DialogState,
    is_confirmed: bool,
) -> CheckedCall {
    if let Err(problem) = call.sound() {
        return CheckedCall::refused(RefusalKind::Unclear, format!("That cannot be done: {problem}."));
    }
    if let Some(refusal) = policy.refusal(call) {
        return CheckedCall::Refused { refusal, near: Vec::new() };
    }
    let mut call = call.clone();
    let (mut ids, mut note, mut guessed) = (Vec::new(), String::new(), None);
    let wanted = match &call {
        ToolCall::Locate { query, kind } => Some((Target::Query(query.clone()), *kind)),
        // A target may be an object or a part at any level.
        other => other.target().map(|t| (t.clone(), LevelFilter::Auto)),
    };
    if let Some((target, level)) = wanted {
        match find(world, &target, level, dialog) {
            Resolved::One { id, note: said, by_looks } => {
                let asked: &str =
                    if let (ToolCall::Describe { .. }, Target::Query(words)) = (&call, &target) { words } else { "" };
                let ranked = describe::ranked(world, id, asked);
                note = [ranked.unwrap_or_default(), said].join(" ").trim().to_owned();
                guessed =
                    if let Target::Query(words) = &target { Some(words.clone()).filter(|_| by_looks) } else { None };
                ids.push(id);
                if !matches!(call, ToolCall::Locate { .. }) {
                    call = call.with_target(Target::Identity(id));
                }
            }
            Resolved::All(found) if marks(&call) => ids = found,
            Resolved::Several(candidates) | Resolved::All(candidates) => {
                let question = format!("Which one do you mean: {}?", choices(world, &candidates));
                return CheckedCall::Choose { question, candidates };
            }
            Resolved::Missing { refusal, near } => return CheckedCall::Refused { refusal, near },
        }
    }
    if let ToolCall::Measure { to: Some(Reference::Thing(other)), .. } = &mut call {
        match find(world, &other.clone(), LevelFilter::Auto, dialog) {
            Resolved::One { id, note: said, .. } => {
                note = [note, said].into_iter().filter(|n| !n.is_empty()).collect::<Vec<_>>().join(" ");
                ids.push(id);
                *other = Target::Identity(id);
            }
            Resolved::Several(some) | Resolved::All(some) => {
                let text = format!("From which one: {}? Please say it in full.", choices(world, &some));
                return CheckedCall::Refused { refusal: Refusal::new(RefusalKind::Unclear, text), near: some };
            }
            Resolved::Missing { refusal, near } => return CheckedCall::Refused { refusal, near },
        }
    }
    if let Some(conflict) = conflict(world, &call, ids.first().copied()) {
        return CheckedCall::Refused { refusal: conflict, near: ids };
    }
    let id = ids.first().copied();
    // A match by embedding alone is too weak for a change: ask first.
    let looks = guessed.zip(id).filter(|_| changes(&call));
    let looks = looks.map(|(words, id)| format!("No name here says '{words}'; {} looks most like it.", the(world, id)));
    let question = match (question(world, &call, policy, id), looks) {
        (Some(question), Some(looks)) => Some(format!("{looks} {question}")),
        (None, Some(looks)) => Some(format!("{looks} {}: continue? (yes or no)", call.line(world.identities()))),
        (question, None) => question,
    };
    if let Some(question) = question.filter(|_| !is_confirmed) {
        return CheckedCall::Confirm { question, call, ids };
    }
    CheckedCall::Ready { call, ids, note }
}

/// Returns whether a call marks things, one or several.
fn marks(call: &ToolCall) -> bool {
    matches!(call, ToolCall::Locate { .. } | ToolCall::Highlight { .. })
}

/// Returns whether a call changes the picture, a name or a file.
fn changes(call: &ToolCall) -> bool {
    matches!(
        call,
        ToolCall::Hide { .. }
            | ToolCall::Unhide { .. }
            | ToolCall::Isolate { .. }
            | ToolCall::Remove { .. }
            | ToolCall::Rename { .. }
            | ToolCall::Export { .. }
    )
}

fn find(world: &mut dyn World, target: &Target, level: LevelFilter, dialog: &DialogState) -> Resolved {
    match target {
        Target::Query(words) => resolve(world, words, level, dialog),
        Target::Identity(id) => resolve(world, &format!("#{id}"), level, dialog),
    }
}

/// Joins candidates to "the red controller or the blue controller".
fn choices(world: &dyn World, candidates: &[IdentityId]) -> String {
    let mut names: Vec<String> = candidates.iter().take(6).map(|id| the(world, *id)).collect();
    if candidates.len() > 6 {
        names.push(format!("one of {} more", candidates.len() - 6));
    }
    match names.as_slice() {
        [start @ .., last] if !start.is_empty() => format!("{} or {last}", start.join(", ")),
        _ => names.concat(),
    }
}

/// Executes a checked call and updates the dialog.
pub(crate) fn perform(
    world: &mut dyn World,
    call: ToolCall,
    ids: Vec<IdentityId>,
    note: &str,
    dialog: &mut DialogState,
    cancel: &AtomicBool,
) -> CallOutcome {
    let id = ids.first().copied().unwrap_or(NO_IDENTITY);
    let mut listed = Vec::new();
    let done = match ids.as_slice() {
        [_, _, ..] if marks(&call) => mark_all(world, &ids, dialog, &mut listed),
        _ => act(world, &call, id, ids.get(1).copied(), dialog, &mut listed, cancel),
    };
    if done.is_ok() && matches!(call, ToolCall::Move { .. } | ToolCall::Turn { .. } | ToolCall::GoTo { .. }) {
        dialog.moved = Some(call.clone());
    }
    let (text, refused) = match done {
        Ok(text) if note.is_empty() => (text, None),
        // What was asked is answered first.
        Ok(text) if matches!(call, ToolCall::Locate { .. }) => (format!("{note} {text}"), None),
        Ok(text) if matches!(call, ToolCall::Describe { .. }) => (describe::noted(world, id, &text, note), None),
        Ok(text) => (format!("{text} {note}"), None),
        Err(refusal) => (refusal.text, Some(refusal.kind)),
    };
    if id != NO_IDENTITY {
        dialog.last = Some(id);
        dialog.group.clear();
    }
    // "Are there any mugs?" - "Show me the red one."
    if let (ToolCall::List { named: Some(_), .. } | ToolCall::Locate { .. } | ToolCall::Highlight { .. }, false) =
        (&call, listed.is_empty())
    {
        if let [only] = listed.as_slice() {
            dialog.last = Some(*only);
        }
        dialog.group = listed;
    }
    CallOutcome { call, ids, text, refused }
}

/// Marks several things together.
fn mark_all(
    world: &mut dyn World,
    ids: &[IdentityId],
    dialog: &mut DialogState,
    listed: &mut Vec<IdentityId>,
) -> Result<String, Refusal> {
    dialog.marked.extend(ids);
    world.highlight(&dialog.marked).map_err(|e| Refusal::new(RefusalKind::Failed, capital(&e.0)))?;
    *listed = ids.to_vec();
    Ok(format!("Marked in the view: {}.", describe::names(world, ids, 12)))
}

fn act(
    world: &mut dyn World,
    call: &ToolCall,
    id: IdentityId,
    other: Option<IdentityId>,
    dialog: &mut DialogState,
    listed: &mut Vec<IdentityId>,
    cancel: &AtomicBool,
) -> Result<String, Refusal> {
    let failed = |e: WorldError| Refusal::new(RefusalKind::Failed, capital(&e.0));
    let it = if id == NO_IDENTITY { String::new() } else { the(world, id) };
    Ok(match call {
        ToolCall::Locate { .. } | ToolCall::Highlight { .. } => {
            // Earlier targets of the same request stay marked.
            dialog.marked.push(id);
            world.highlight(&dialog.marked).map_err(failed)?;
            let place = describe::place(world, id);
            let facts = world.facts(id);
            let seen = facts.as_ref().is_some_and(|f| f.in_view > SEEN && !f.hidden);
            let place = if place.is_empty() { String::new() } else { format!(" It is {place}.") };
            let hidden = facts.is_some_and(|f| f.hidden);
            match (seen, hidden) {
                (true, _) => format!("{} is marked in the view.{place}", capital(&it)),
                (false, true) => format!("I found {it}; it is hidden now.{place}"),
                (false, false) => format!("I found {it}; it is not in view.{place}"),
            }
        }
        ToolCall::GoTo { side, closeness, .. } => {
            let arrival = world.go_to(id, *side, *closeness).map_err(|e| unreachable(world, &it, &e))?;
            dialog.closeness = *closeness;
            let from = if *side == Side::Same { String::new() } else { format!(" {}", side.text()) };
            let close = match *closeness {
                c if c > NORMAL => ", closer",
                c if c < NORMAL => ", from farther away",
                _ => "",
            };
            let hidden = world.facts(id).is_some_and(|f| f.hidden);
            let note = match (hidden, arrival.in_view <= SEEN) {
                (true, _) => " It is hidden now; say 'show everything' to see it.",
                (false, true) => " Something may be in the way: little of it is in view.",
                _ => "",
            };
            format!("Here is {it}{from}{close}.{note}")
        }
        ToolCall::LookAt { .. } => {
            world.look_at(id).map_err(|e| unreachable(world, &it, &e))?;
            format!("Looking at {it}.")
        }
        ToolCall::Move { direction, distance } => {
            let (distance, note) = match distance {
                Distance::Meters(m) if world.meters_per_unit().is_none() => {
                    let note = " This scene's scale in meters is not known, so I took a step for a meter.";
                    (Distance::Relative(*m), note)
                }
                known => (*known, ""),
            };
            let moved = world.move_eye(*direction, distance).map_err(|e| unreachable(world, "there", &e))?;
            let far = length(world, moved.distance_done);
            if moved.stopped_by_obstacle {
                format!(
                    "Moved {} {far}, and stopped there: something is in the way, or nothing is known beyond.{note}",
                    direction.text()
                )
            } else {
                format!("Moved {} {far}.{note}", direction.text())
            }
        }
        ToolCall::Turn { direction, degrees } => {
            world.turn(*direction, *degrees).map_err(|e| unreachable(world, "that way", &e))?;
            format!("Turned {} by {} degrees.", direction.text(), crate::math::format::short(*degrees))
        }
        ToolCall::Isolate { .. } => {
            dialog.isolated.push(id);
            world.isolate(&dialog.isolated).map_err(failed)?;
            let names: Vec<String> = dialog.isolated.iter().map(|id| the(world, *id)).collect();
            let are = if names.len() > 1 { "are" } else { "is" };
            format!("Only {} {are} drawn now; say 'show everything' for the rest.", format::list(&names))
        }
        ToolCall::Hide { .. } => {
            world.set_hidden(id, true).map_err(failed)?;
            format!("{} is hidden.", capital(&it))
        }
        ToolCall::Unhide { .. } => {
            world.set_hidden(id, false).map_err(failed)?;
            format!("{} is visible again.", capital(&it))
        }
        ToolCall::ShowAll {} => {
            world.show_all().map_err(failed)?;
            "Everything is visible again.".into()
        }
        ToolCall::Remove { .. } => {
            world.remove(id).map_err(failed)?;
            format!("Making a copy of this scene without {it}; this one stays as it is.")
        }
        ToolCall::Rename { name, .. } => {
            world.rename(id, name).map_err(failed)?;
            format!("{} is now called '{name}'.", capital(&it))
        }
        ToolCall::Describe { .. } if id == NO_IDENTITY => describe::view(world),
        ToolCall::Describe { .. } => describe::thing(world, id),
        ToolCall::List { level, relation, named, .. } => {
            *listed = list_ids(world, *level, id, *relation, named.as_deref())?;
            say_list(world, listed, *level, id, *relation, named.as_deref())
        }
        ToolCall::Measure { to, .. } => measure(world, id, to.as_ref(), other)?,
        ToolCall::AskUser { question, .. } => question.clone(),
        ToolCall::Undo {} => format!("Undone: {}.", world.undo().map_err(failed)?),
        ToolCall::LocatePhoto { photo } => photo_answer::taken(world, photo.as_deref(), cancel).map_err(failed)?,
        ToolCall::ShowChanges {} => photo_answer::changed(world, cancel).map_err(failed)?,
        ToolCall::AddPhotos { photos } => photo_answer::added(world, photos.as_deref()).map_err(failed)?,
        ToolCall::Export { .. } => format!("{} is written to {}.", capital(&it), world.export(id).map_err(failed)?),
    })
}

fn unreachable(world: &dyn World, goal: &str, e: &Unreachable) -> Refusal {
    let near = e.nearest.map(|d| format!(" The camera can come as near as {}.", length(world, d))).unwrap_or_default();
    Refusal::new(RefusalKind::Unreachable, format!("I cannot go to {goal}: {}.{near}", e.reason.trim_end_matches('.')))
}
