//! Built-in planner: a small command language that needs no network. A sentence is valid if a command accounts for
//! every word of it; else nothing is done, and the nearest commands are shown.

mod complete;
mod example;
mod form;
mod halves;
mod nearest;
mod task;

pub use super::language::{CommandHelp, commands};
pub use complete::complete;

use std::collections::VecDeque;

use self::example::example;
use self::form::{FormItem, FormRequest, Slots, Things, beginning_with, sequences};
use self::halves::SEPARATORS;
pub(crate) use self::nearest::nearest;
use self::task::{CommandStep, task};
use super::camera_args::{CLOSENESS, CLOSER, Direction, Distance, FARTHER, NORMAL};
use super::dialog::DialogState;
use super::execute::CallOutcome;
use super::language::CommandLanguage;
use super::names::{NameWords, words_of};
use super::planner::{Planner, PlannerContext, Step};
use super::refusal::{Refusal, RefusalKind};
use super::resolve::{Resolved, resolve};
use super::tool::{Reference, Target, ToolCall};
use super::words::{Token, alike, request_tokens};
use super::world::World;
use crate::math::format::capital;
use crate::navigate::target::Side;
use crate::pipeline::semantics::query::language;
use crate::pipeline::semantics::query::language::words::LanguageWords;
use crate::scene::{Identities, LevelFilter};

/// Maximum number of tasks per request.
const MOST_TASKS: usize = 16;

/// Planner of the command language.
#[derive(Default)]
pub struct Commands {
    tasks: VecDeque<CommandStep>,
    refusal: Option<Refusal>,
    said: Vec<String>,
}

impl Planner for Commands {
    fn name(&self) -> &'static str {
        "commands"
    }

    fn start(&mut self, request: &str, context: &mut PlannerContext<'_>) {
        *self = Self::default();
        let identities = context.world.identities();
        let Some(tasks) = parse(request, identities).or_else(|| search(request, identities)) else {
            self.refusal = Some(not_understood(request, context.world.identities()));
            return;
        };
        match settled(tasks, context) {
            Ok(tasks) => self.tasks = tasks.into(),
            Err(refusal) => self.refusal = Some(refusal),
        }
    }

    fn next(&mut self, last: Option<&CallOutcome>, context: &mut PlannerContext<'_>) -> Result<Step, Refusal> {
        if last.is_some_and(|outcome| outcome.refused.is_some()) {
            // Later tasks may depend on the one that was refused.
            if !self.tasks.is_empty() {
                self.said.push("The rest of the request was left out.".into());
                self.tasks.clear();
            }
            return Ok(self.finish());
        }
        match self.tasks.pop_front() {
            None => Ok(self.finish()),
            Some(task) => Ok(self.step(task, context)),
        }
    }
}

fn go(target: Target, side: Side, closeness: f64) -> Step {
    let closeness = closeness.clamp(*CLOSENESS.start(), *CLOSENESS.end());
    Step::Call(ToolCall::GoTo { target, side, closeness })
}

impl Commands {
    fn finish(&mut self) -> Step {
        Step::Finish { text: std::mem::take(&mut self.said).join(" "), refusal: self.refusal.take() }
    }

    fn step(&mut self, task: CommandStep, context: &mut PlannerContext<'_>) -> Step {
        let dialog = context.dialog;
        let last = dialog.last.filter(|id| context.world.facts(*id).is_some());
        match (task, last) {
            (CommandStep::Call(call), _) => Step::Call(call),
            (CommandStep::Closer(factor), Some(id)) => go(Target::Identity(id), Side::Same, dialog.closeness * factor),
            (CommandStep::Closer(factor), None) => {
                let direction = if factor >= NORMAL { Direction::Forward } else { Direction::Back };
                Step::Call(ToolCall::Move { direction, distance: Distance::Default })
            }
            (CommandStep::From(side), Some(id)) => go(Target::Identity(id), side, dialog.closeness),
            (CommandStep::From(side), None) => {
                let text = format!("{}: of what? Name a thing, such as 'the lamp from above'.", capital(side.text()));
                self.refuse(Refusal::new(RefusalKind::Unclear, text))
            }
            (CommandStep::Again, _) => match dialog.moved.clone() {
                Some(ToolCall::GoTo { target, closeness, .. }) if closeness != NORMAL => {
                    go(target, Side::Same, closeness * if closeness > NORMAL { CLOSER } else { FARTHER })
                }
                Some(call) => Step::Call(call),
                None => self.refuse(Refusal::new(RefusalKind::Unclear, "There is nothing to do again yet.")),
            },
            (CommandStep::Help, _) => {
                self.said.push(help(context.world.identities()));
                self.finish()
            }
        }
    }

    fn refuse(&mut self, refusal: Refusal) -> Step {
        self.tasks.clear();
        self.refusal = Some(refusal);
        self.finish()
    }
}

/// Parses a request into tasks; `None` unless every word is understood. Complete names are tried first, then words
/// of names. Unknown things are accepted last, so that the reply can say that they are not in the scene.
pub(crate) fn parse(request: &str, identities: &Identities) -> Option<Vec<CommandStep>> {
    let (tokens, known) = (request_tokens(request), NameWords::new(identities));
    let words: Vec<&str> = tokens.iter().map(|t| t.low.as_str()).collect();
    let with =
        |things| clauses(&FormRequest { text: request, tokens: &tokens, words: &words, known: &known, things }, true);
    let mut readings = [Things::Whole, Things::Known, Things::Any].into_iter();
    readings.find_map(with).filter(|tasks| tasks.len() <= MOST_TASKS)
}

fn search(request: &str, identities: &Identities) -> Option<Vec<CommandStep>> {
    language::is_search(request, identities).then(|| vec![CommandStep::Call(ToolCall::ask(request))])
}

/// Returns the part of a request that is not understood, if the rest of it is.
pub(crate) fn part_not_understood<'a>(request: &'a str, identities: &Identities) -> Option<&'a str> {
    let is_understood = |text: &str| parse(text, identities).or_else(|| search(text, identities)).is_some();
    halves::not_understood(request, is_understood)
}

/// Returns whether a text is a command and not only a name.
pub(crate) fn is_command(text: &str, identities: &Identities) -> bool {
    let words = words_of(text);
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    !NameWords::new(identities).is_thing(&words, false) && parse(text, identities).is_some()
}

/// Parses a request as one command, or as several in a row.
fn clauses(request: &FormRequest<'_>, is_first: bool) -> Option<Vec<CommandStep>> {
    if let Some(tasks) = command(request, is_first) {
        return Some(tasks);
    }
    let request = trimmed(request);
    // The mark is dropped only if no form with it matches: "the lamp?" asks about it, "the lamp" flies there.
    if let Some(("?", rest)) = request.words.split_last().map(|(last, rest)| (*last, rest)) {
        return clauses(&part(&request, 0, rest.len()), is_first);
    }
    let parts = (1..request.words.len()).filter(|i| SEPARATORS.contains(&request.words[*i]));
    parts.take(MOST_TASKS).find_map(|i| {
        let mut tasks = command(&part(&request, 0, i), is_first)?;
        tasks.extend(clauses(&part(&request, i + 1, request.words.len()), false)?);
        Some(tasks)
    })
}

fn part<'a>(request: &FormRequest<'a>, from: usize, to: usize) -> FormRequest<'a> {
    FormRequest { tokens: &request.tokens[from..to], words: &request.words[from..to], ..*request }
}

/// Removes separators and polite words at both ends.
fn trimmed<'a>(request: &FormRequest<'a>) -> FormRequest<'a> {
    let (mut from, mut to) = (0, request.words.len());
    loop {
        let words = &request.words[from..to];
        if words.last().is_some_and(|w| *w == "," || *w == "please") {
            to -= 1;
        } else if words.first().is_some_and(|w| SEPARATORS.contains(w)) {
            from += 1;
        } else if let Some(n) = CommandLanguage::get().openers.iter().find_map(|o| opens(words, o)) {
            from += n;
        } else {
            return part(request, from, to);
        }
    }
}

/// Number of words of `phrase` if `words` begin with it.
fn opens(words: &[&str], phrase: &str) -> Option<usize> {
    let n = phrase.split(' ').count();
    (words.len() >= n && phrase.split(' ').eq(words[..n].iter().copied())).then_some(n)
}

/// Parses one command, first as typed, then without polite words: a name may begin or end with one of them.
fn command(request: &FormRequest<'_>, is_first: bool) -> Option<Vec<CommandStep>> {
    if let Some(question) = choice(request) {
        return Some(vec![CommandStep::Call(ToolCall::ask(&question))]);
    }
    let all = if request.things == Things::Whole { one(request, is_first) } else { None };
    all.or_else(|| one(&trimmed(request), is_first))
}

/// Returns the text of a request that asks which of several things is so; the query's grammar answers it.
fn choice(request: &FormRequest<'_>) -> Option<String> {
    let has = |word: &str| request.words.contains(&word);
    if !has("or") || !["which", "what", "who"].into_iter().any(has) {
        return None;
    }
    let raw: Vec<&str> = request.tokens.iter().map(|t| t.raw.as_str()).collect();
    let text = raw.join(" ").replace(" 's", "'s").replace(" ,", ",").replace(" ?", "?");
    request.known.asks_which(&text).then_some(text)
}

/// Parses one command: the first sequence that matches. With complete names the longest name wins, as "the handle
/// from above" may be a name. If the first match is a command without a thing, it is kept.
fn one(request: &FormRequest<'_>, is_first: bool) -> Option<Vec<CommandStep>> {
    let mut fits = beginning_with(request.words.first()?).filter_map(|sequence| {
        // A command may begin with a name only if the name is known and first: "hide the lamp and the mug from above".
        let begins_with_word = matches!(sequence.items.first(), Some(FormItem::Word(_)));
        if !(begins_with_word || request.things != Things::Any && is_first) {
            return None;
        }
        let slots = request.fit(&sequence.items)?;
        let named = if slots.texts.is_empty() { usize::MAX } else { slots.named };
        Some((named, tasks(&sequence.command.id, slots)?))
    });
    if request.things != Things::Whole {
        return Some(fits.next()?.1);
    }
    Some(fits.reduce(|first, next| if next.0 > first.0 && next.0 < usize::MAX { next } else { first })?.1)
}

/// Tasks of a command, one for each of several things.
fn tasks(command: &str, mut slots: Slots) -> Option<Vec<CommandStep>> {
    let Some((place, several)) = slots.several.take() else {
        return Some(vec![task(command, &slots)?]);
    };
    let each = several.into_iter().map(|text| {
        slots.texts[place] = text;
        task(command, &slots)
    });
    each.collect()
}

/// Phrases of a task that name things.
fn phrases(task: &CommandStep) -> Vec<String> {
    let CommandStep::Call(call) = task else { return Vec::new() };
    let other = match call {
        ToolCall::Measure { to: Some(Reference::Thing(Target::Query(words))), .. } => Some(words),
        ToolCall::Locate { query, .. } => Some(query),
        _ => None,
    };
    let own = match call.target() {
        Some(Target::Query(words)) => Some(words),
        _ => None,
    };
    own.into_iter().chain(other).cloned().collect()
}

/// Splits tasks about all of several things into single ones. If there are several tasks, all their targets must be
/// found and unambiguous before the first one starts.
fn settled(tasks: Vec<CommandStep>, context: &mut PlannerContext<'_>) -> Result<Vec<CommandStep>, Refusal> {
    let mut dialog = context.dialog.clone();
    let mut done = Vec::new();
    let is_alone = tasks.len() == 1;
    for task in tasks {
        if let (CommandStep::Call(call), [phrase]) = (&task, phrases(&task).as_slice())
            && is_done_to_several(call)
            && let Some(ids) = all_of(phrase, context.world, &dialog)?
        {
            if matches!(call, ToolCall::Remove { .. }) && language::means_everything(phrase, context.world.identities())
            {
                return Err(Refusal::new(RefusalKind::Unclear, "Say which things to remove."));
            }
            dialog.last = ids.last().copied();
            done.extend(ids.into_iter().map(|id| CommandStep::Call(call.with_target(Target::Identity(id)))));
            continue;
        }
        for phrase in phrases(&task).iter().filter(|_| !is_alone) {
            match resolve(context.world, phrase, LevelFilter::Auto, &dialog) {
                Resolved::One { id, .. } => dialog.last = Some(id),
                Resolved::Several(some) | Resolved::All(some) => {
                    let names: Vec<String> = some.iter().map(|id| context.world.identities().full_name(*id)).collect();
                    let text = format!(
                        "Several things fit '{phrase}': {}. Nothing was done; say it in full.",
                        names.join(", ")
                    );
                    return Err(Refusal::new(RefusalKind::Unclear, text));
                }
                Resolved::Missing { refusal, .. } => {
                    return Err(Refusal::new(refusal.kind, format!("{} Nothing was done.", refusal.text)));
                }
            }
        }
        done.push(task);
    }
    if done.len() > MOST_TASKS {
        return Err(Refusal::new(RefusalKind::Limit, format!("That is more than {MOST_TASKS} steps: ask for less.")));
    }
    Ok(done)
}

/// Returns whether a call can be repeated for several things.
fn is_done_to_several(call: &ToolCall) -> bool {
    !matches!(
        call,
        ToolCall::GoTo { .. }
            | ToolCall::LookAt { .. }
            | ToolCall::Rename { .. }
            | ToolCall::Measure { to: Some(_), .. }
    )
}

/// Identities of "all bottles", "both controllers" or "the lamp and the mug"; `None` if the phrase means one thing.
fn all_of(phrase: &str, world: &mut dyn World, dialog: &DialogState) -> Result<Option<Vec<u32>>, Refusal> {
    if !language::means_several(phrase, world.identities()) {
        return Ok(None);
    }
    let ids = match resolve(world, phrase, LevelFilter::Auto, dialog) {
        Resolved::One { id, .. } => vec![id],
        Resolved::All(ids) => ids,
        // The question for one of them comes with the call.
        Resolved::Several(_) => return Ok(None),
        Resolved::Missing { refusal, .. } => return Err(refusal),
    };
    Ok(Some(ids))
}

/// Request with typing errors corrected, if that makes it a command. It is only suggested, never executed.
fn corrected(request: &str, identities: &Identities) -> Option<String> {
    let known = NameWords::new(identities);
    let mut words: Vec<&str> = sequences().iter().flat_map(|s| &s.items).filter_map(FormItem::word).collect();
    let relations: Vec<String> = LanguageWords::get().relations().map(|(words, _)| words).collect();
    words.extend(relations.iter().flat_map(|r| r.split(' ')));
    words.extend(known.words());
    words.sort_unstable();
    words.dedup();
    let mend = |token: &Token| {
        let near = || words.iter().filter(|w| alike(w, &token.low));
        let is_known = words.contains(&token.low.as_str()) || known.has(&token.low);
        if is_known { token.low.clone() } else { near().next().map_or(token.low.clone(), |w| (*w).to_owned()) }
    };
    let mended: Vec<String> = request_tokens(request).iter().map(mend).collect();
    let text = mended.join(" ").replace(" 's", "'s").replace(" ,", ",");
    parse(&text, identities).map(|_| text)
}

fn not_understood(request: &str, identities: &Identities) -> Refusal {
    let part = part_not_understood(request, identities).unwrap_or(request);
    let said: String = part.trim().chars().take(80).collect();
    let mut near = nearest(part, identities);
    if let Some(text) = corrected(request, identities) {
        near.insert(0, text);
        near.truncate(3);
    }
    let near = near.join("', '");
    let text = format!(
        "I did not understand '{said}', so nothing was done. The nearest commands: '{near}'. 'help' lists all."
    );
    Refusal::new(RefusalKind::Unclear, text)
}

/// Help text with an example of every command.
pub(crate) fn help(identities: &Identities) -> String {
    let mut lines: Vec<String> = Vec::new();
    for command in commands() {
        let line = format!("'{}': {}", example(command, identities, &[]), command.does);
        if !lines.iter().any(|l| l.ends_with(&command.does)) {
            lines.push(line);
        }
    }
    format!(
        "You can say, for example:\n{}\nSeveral at once with 'and' or 'then'; 'it' is the last thing.",
        lines.join("\n")
    )
}
