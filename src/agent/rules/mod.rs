//! The planner that is built in: a grammar of English requests. It needs no network, and the same
//! words always come to the same calls.

mod beginnings;
mod clauses;
mod commands;
mod moves;
mod questions;
mod sides;

use std::collections::VecDeque;

use super::describe::SEEN;
use super::execute::Outcome;
use super::planner::{Desk, Planner, Step};
use super::refusal::{Refusal, RefusalKind};
use super::resolve::resolve_all;
use super::tool::{LevelWish, Target, ToolCall};
use super::wish::{CLOSENESS, CLOSER, Direction, Distance, FARTHER, NORMAL, Side};
use super::words::{Token, low, without_courtesy};
use crate::scene::Identities;

/// Most tasks of one request.
const MOST_TASKS: usize = 16;

/// One step of a plan, before the scene has been asked.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Task {
    /// Make this call.
    Call(ToolCall),
    /// Find something, and go there if it is not in view.
    Find(String),
    /// Do to another target what was done last.
    Again(String),
    /// Look at the last target from so much closer.
    Closer(f64),
    /// Look at the last target from another side.
    Side(Side),
    /// Make the last movement again.
    Repeat,
    /// Speak of something that a later clause means by "it".
    Mention(String),
    /// It is too close or too far: what mends that, unless something else is asked for.
    Remark(f64),
    /// Words that ask for nothing.
    Noise(String),
    /// Do a call to everything that words may mean.
    Each(ToolCall, String),
    /// Say something.
    Say(String),
    /// Say that it is not done.
    Refuse(Refusal),
}

impl Task {
    fn refuse(kind: RefusalKind, text: impl Into<String>) -> Self {
        Self::Refuse(Refusal::new(kind, text))
    }
}

/// What the agent understands, for "help".
pub const HELP: &str = "You can say: 'show me the handle of the kettle', 'from the other side', 'step back half a metre', \
    'turn left 90 degrees', 'closer', 'where is the lamp?', 'what is on the table?', 'how big is it?', 'what parts does it have?', \
    'show only the mug', 'hide the vase', 'show everything', 'rename the mug to cup', 'remove the doll', 'export the kettle', 'undo'. \
    Several at once with 'then'; 'it', 'the other one' and 'the left one' are understood.";

/// Whether words are a request of their own, not an answer to a question.
pub(crate) fn is_request(words: &[&str], identities: &Identities) -> bool {
    let Some(first) = words.first() else { return false };
    if clauses::is_known(first, identities) && !clauses::VERBS.contains(first) {
        return false;
    }
    clauses::starts_request(words)
}

/// Plans by the grammar.
#[derive(Default)]
pub struct Rules {
    tasks: VecDeque<Task>,
    said: Vec<String>,
    looking_for: bool,
}

impl Planner for Rules {
    fn name(&self) -> &'static str {
        "rules"
    }

    fn start(&mut self, request: &str, desk: &mut Desk<'_>) {
        self.said.clear();
        self.looking_for = false;
        self.tasks = plan(request, desk.world.identities()).into();
    }

    fn next(&mut self, last: Option<&Outcome>, desk: &mut Desk<'_>) -> Result<Step, Refusal> {
        if let Some(outcome) = last {
            if outcome.refused.is_some() {
                // What comes after may rest on what was not done.
                let left = self.tasks.len();
                self.tasks.clear();
                self.looking_for = false;
                if left > 0 {
                    self.said.push("I left out the rest of the request.".into());
                }
                return Ok(self.finish());
            }
            if std::mem::take(&mut self.looking_for) {
                let id = outcome.ids.first().copied();
                let away = |id: &u32| desk.world.facts(*id).is_some_and(|f| f.in_view <= SEEN && !f.hidden);
                if let Some(id) = id.filter(away) {
                    let target = Target::Identity(id);
                    return Ok(Step::Call(ToolCall::GoTo { target, side: Side::Same, closeness: NORMAL }));
                }
            }
        }
        while let Some(task) = self.tasks.pop_front() {
            if let Some(step) = self.step(task, desk)? {
                return Ok(step);
            }
        }
        Ok(self.finish())
    }
}

impl Rules {
    fn finish(&mut self) -> Step {
        Step::Finish { text: std::mem::take(&mut self.said).join(" "), refusal: None }
    }

    fn step(&mut self, task: Task, desk: &mut Desk<'_>) -> Result<Option<Step>, Refusal> {
        let go = |target: Target, side, closeness: f64| {
            let closeness = closeness.clamp(*CLOSENESS.start(), *CLOSENESS.end());
            Step::Call(ToolCall::GoTo { target, side, closeness })
        };
        let last = desk.focus.last.filter(|id| desk.world.facts(*id).is_some());
        Ok(Some(match task {
            Task::Call(call) => Step::Call(call),
            Task::Find(query) => {
                self.looking_for = true;
                Step::Call(ToolCall::Locate { query, kind: LevelWish::Any })
            }
            Task::Again(words) => {
                let again = desk.focus.call.clone().filter(|c| {
                    !matches!(
                        c,
                        ToolCall::Remove { .. }
                            | ToolCall::Rename { .. }
                            | ToolCall::Export { .. }
                            | ToolCall::Locate { .. }
                    )
                });
                match again {
                    Some(call) => Step::Call(call.with_target(Target::Query(words))),
                    None => go(Target::Query(words), Side::Same, NORMAL),
                }
            }
            Task::Closer(factor) | Task::Remark(factor) => match last {
                Some(id) => go(Target::Identity(id), Side::Same, desk.focus.closeness * factor),
                None => {
                    let direction = if factor >= 1.0 { Direction::Forward } else { Direction::Back };
                    Step::Call(ToolCall::Move { direction, distance: Distance::Default })
                }
            },
            Task::Side(side) => match last {
                Some(id) => go(Target::Identity(id), side, desk.focus.closeness),
                None => {
                    let text = format!("From {}: of what? Name a thing, such as 'the lamp from above'.", side.text());
                    return Ok(Some(self.refuse(Refusal::new(RefusalKind::Unclear, text))));
                }
            },
            Task::Each(call, words) => {
                let ids = resolve_all(desk.world, &words, LevelWish::Any, desk.focus)
                    .map_err(|e| Refusal::new(RefusalKind::Failed, e.0))?;
                if ids.len() < 2 {
                    return Ok(Some(Step::Call(call.with_target(Target::Query(words)))));
                }
                for id in ids.into_iter().take(MOST_TASKS).rev() {
                    self.tasks.push_front(Task::Call(call.with_target(Target::Identity(id))));
                }
                return Ok(None);
            }
            Task::Repeat => match desk.focus.moved.clone() {
                Some(ToolCall::GoTo { target, closeness, .. }) if closeness != NORMAL => {
                    let factor = if closeness > NORMAL { CLOSER } else { FARTHER };
                    go(target, Side::Same, closeness * factor)
                }
                Some(call) => Step::Call(call),
                None => {
                    return Ok(Some(
                        self.refuse(Refusal::new(RefusalKind::Unclear, "There is nothing to do again yet.")),
                    ));
                }
            },
            Task::Mention(_) | Task::Noise(_) => return Ok(None),
            Task::Say(text) => {
                self.said.push(text);
                return Ok(None);
            }
            Task::Refuse(refusal) => self.refuse(refusal),
        }))
    }

    fn refuse(&mut self, refusal: Refusal) -> Step {
        self.tasks.clear();
        Step::Finish { text: std::mem::take(&mut self.said).join(" "), refusal: Some(refusal) }
    }
}

/// The tasks that a request asks for.
pub(crate) fn plan(request: &str, identities: &Identities) -> Vec<Task> {
    let mut tasks: Vec<Task> = Vec::new();
    let mut spoken_of: Option<String> = None;
    let mut noise: Option<String> = None;
    for clause in clauses::split(request, identities) {
        // "Turn it, I mean hide it": what was said wrongly is not done.
        if low(&clause.words).starts_with(&["i", "mean"]) {
            tasks.pop();
        }
        for task in read(&clause.words, identities) {
            add(&mut tasks, task, clause.follows_comma, &mut spoken_of, &mut noise);
        }
        if tasks.len() >= MOST_TASKS {
            break;
        }
    }
    if let Some(thing) = spoken_of.filter(|_| tasks.is_empty()) {
        let text = format!("What about the {thing}? {HELP}");
        tasks.push(Task::refuse(RefusalKind::Unclear, text));
    }
    if tasks.is_empty() {
        let said = noise.map_or_else(|| "that".to_owned(), |n| format!("'{n}'"));
        tasks.push(Task::refuse(RefusalKind::Unclear, format!("I did not understand {said}. {HELP}")));
    }
    tasks
}

/// Adds a task to those before it in the same request, or makes it part of the last.
fn add(
    tasks: &mut Vec<Task>,
    task: Task,
    follows_comma: bool,
    spoken_of: &mut Option<String>,
    noise: &mut Option<String>,
) {
    match (task, tasks.last_mut()) {
        // What asks for nothing is left out, if anything else is asked for.
        (Task::Noise(text), _) => *noise = Some(text),
        (Task::Mention(thing), _) => *spoken_of = Some(thing),
        // "I can't find the mug, where did it go?" asks once.
        (Task::Find(it), Some(Task::Find(_))) if it == "it" => {}
        // "Too close, back off a little" moves once.
        (task, Some(last @ Task::Remark(_))) => *last = task,
        // "Again but closer".
        (task @ (Task::Closer(_) | Task::Side(_)), Some(last @ Task::Repeat)) => *last = task,
        // "The mug, from above, close" is one flight.
        (Task::Side(which), Some(Task::Call(ToolCall::GoTo { side, .. }))) if follows_comma && *side == Side::Same => {
            *side = which
        }
        (Task::Side(side), Some(last @ Task::Again(_))) if follows_comma => {
            if let Task::Again(words) = last {
                let target = Target::Query(std::mem::take(words));
                *last = Task::Call(ToolCall::GoTo { target, side, closeness: NORMAL });
            }
        }
        (Task::Closer(factor), Some(Task::Call(ToolCall::GoTo { closeness, .. }))) if follows_comma => {
            *closeness = (*closeness * factor).clamp(*CLOSENESS.start(), *CLOSENESS.end());
        }
        (Task::Call(call), _) if call.target() == Some(&Target::query("it")) && spoken_of.is_some() => {
            let thing = spoken_of.take().unwrap_or_default();
            tasks.push(Task::Call(call.with_target(Target::query(thing))));
        }
        (task, _) => tasks.push(task),
    }
}

/// What one clause asks for.
fn read(clause: &[Token], identities: &Identities) -> Vec<Task> {
    let said = low(clause);
    let expanded = clauses::expand(&said);
    let words: Vec<&str> = expanded.iter().flat_map(|w| w.split(' ')).collect();
    let words = without_courtesy(&words);
    if words.is_empty() {
        return Vec::new();
    }
    let corrected = clauses::corrected(words, identities);
    let words: Vec<&str> = corrected.iter().map(String::as_str).collect();
    let words = without_courtesy(&words);
    if let Some(tasks) = commands::small_talk(words) {
        return tasks;
    }
    if let Some(task) = commands::stated(words) {
        return vec![task];
    }
    if let Some(task) = questions::read(words) {
        return vec![task];
    }
    if let Some(task) = moves::read(words, identities) {
        return vec![task];
    }
    if let Some(tasks) = commands::read(words, clause, identities) {
        return tasks;
    }
    if let Some(tasks) = commands::salvaged(words, clause, identities) {
        return tasks;
    }
    vec![commands::bare(words, identities)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Level, NOBODY};

    #[test]
    fn several_clauses_become_several_tasks() {
        let mut all = Identities::default();
        let kettle = all.add(Level::Object, NOBODY, vec!["kettle".into()]);
        all.add(Level::Part, kettle, vec!["handle".into()]);
        let tasks = plan("Show me the handle of the kettle from the other side, then step back half a metre.", &all);
        let wanted = [
            Task::Call(ToolCall::GoTo {
                target: Target::query("handle of the kettle"),
                side: Side::Other,
                closeness: NORMAL,
            }),
            Task::Call(ToolCall::Move { direction: Direction::Back, distance: Distance::Metres(0.5) }),
        ];
        assert_eq!(tasks, wanted);
        assert!(matches!(plan("", &all)[0], Task::Refuse(_)));
        assert!(plan(&"then go left ".repeat(500), &all).len() <= MOST_TASKS + 1);
    }
}
