//! Session with the agent: takes requests, checks and executes calls, and keeps open questions.

use std::sync::atomic::{AtomicBool, Ordering};

use super::answer::{Choice, Confirmation, choice, confirmation};
use super::dialog::DialogState;
use super::event::AgentEvent;
use super::execute::{CallOutcome, CheckedCall, check, perform};
use super::planner::{Planner, PlannerContext, Step};
use super::policy::Policy;
use super::refusal::{Refusal, RefusalKind};
use super::tool::ToolCall;
use super::transcript::{Transcript, What};
use super::words::MAX_CHARS;
use super::world::World;
use crate::scene::{IdentityId, LevelFilter, text};

/// Maximum number of calls per request.
pub(crate) const MOST_CALLS: usize = 24;
/// Maximum number of identical calls in a row.
const MOST_ALIKE: usize = 5;

/// Kind of answer that the session waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Awaited {
    Confirmation,
    Choice,
}

/// Reply of the agent.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reply {
    pub text: String,
    /// Identities to choose from, the nearest matches, or the targets of the last call; may be empty.
    pub candidates: Vec<IdentityId>,
    /// Refusal if the request was not carried out.
    pub refused: Option<Refusal>,
    /// Kind of answer that the session waits for, if any.
    pub pending: Option<Awaited>,
}

/// Open question to the user.
enum Pending {
    Confirm {
        call: ToolCall,
        ids: Vec<IdentityId>,
    },
    /// A call waits for a target. A question of the model itself has no call.
    Choose {
        call: Option<ToolCall>,
        candidates: Vec<IdentityId>,
        question: String,
    },
}

/// Session with the agent.
pub struct Session {
    policy: Policy,
    planner: Box<dyn Planner>,
    dialog: DialogState,
    pending: Option<Pending>,
    transcript: Transcript,
}

/// Receiver of progress events, with the flag that cancels a request.
struct ProgressSink<'a> {
    on: &'a mut dyn FnMut(AgentEvent),
    cancel: &'a AtomicBool,
}

impl Session {
    /// Returns a session under `policy`, planned by `planner`.
    pub fn new(policy: Policy, planner: Box<dyn Planner>) -> Self {
        Self { policy, planner, dialog: DialogState::default(), pending: None, transcript: Transcript::default() }
    }

    /// Transcript of the session.
    pub fn transcript(&self) -> &Transcript {
        &self.transcript
    }

    pub(crate) fn planner(&self) -> &'static str {
        self.planner.name()
    }

    /// Kind of answer that the session waits for.
    pub fn awaited(&self) -> Option<Awaited> {
        self.pending.as_ref().map(|p| match p {
            Pending::Confirm { .. } => Awaited::Confirmation,
            Pending::Choose { .. } => Awaited::Choice,
        })
    }

    /// Carries out the request `text`. `on` receives progress events; `cancel` ends the request after the current call.
    pub fn say(
        &mut self,
        world: &mut dyn World,
        text: &str,
        on: &mut dyn FnMut(AgentEvent),
        cancel: &AtomicBool,
    ) -> Reply {
        let text = self.planner.redact(text);
        self.transcript.add(What::User { text: text.chars().take(2 * MAX_CHARS).collect() });
        let reply = self.answer(world, &text, &mut ProgressSink { on, cancel });
        self.concluded(world, reply)
    }

    /// Carries out a call that somebody else has planned, with the checks of all calls. It drops an open question.
    pub fn call(
        &mut self,
        world: &mut dyn World,
        call: ToolCall,
        on: &mut dyn FnMut(AgentEvent),
        cancel: &AtomicBool,
    ) -> Reply {
        if self.pending.take().is_some() {
            self.note("no yes", "The open question is dropped: a call was made instead.");
        }
        self.dialog.marked.clear();
        self.dialog.isolated.clear();
        world.begin();
        let reply = if cancel.load(Ordering::Relaxed) {
            self.ended(&[], Refusal::new(RefusalKind::Stopped, "Stopped."))
        } else {
            match self.attempt(world, call, &mut ProgressSink { on, cancel }) {
                Ok(outcome) => self.finished(&[outcome], String::new(), None),
                Err(reply) => *reply,
            }
        };
        self.concluded(world, reply)
    }

    fn concluded(&mut self, world: &mut dyn World, mut reply: Reply) -> Reply {
        if self.pending.is_none() {
            world.carry_out();
        }
        reply.text = self.planner.redact(&reply.text);
        reply.pending = self.awaited();
        self.transcript.add(What::Reply { text: reply.text.clone() });
        reply
    }

    fn answer(&mut self, world: &mut dyn World, text: &str, sink: &mut ProgressSink<'_>) -> Reply {
        let is_name = !world.identities().called(text, LevelFilter::Auto).is_empty();
        if !is_name && !text.chars().any(char::is_alphanumeric) {
            return self
                .refuse(RefusalKind::Unclear, "Tell me what you would like to see, such as 'show me the lamp'.");
        }
        if text.chars().count() > MAX_CHARS {
            let text = format!("That is too long for me: say it in fewer than {MAX_CHARS} characters.");
            return self.refuse(RefusalKind::Unclear, &text);
        }
        match self.pending.take() {
            Some(Pending::Confirm { call, ids }) => match confirmation(text) {
                Confirmation::Yes => return self.confirmed(world, call, ids, sink),
                Confirmation::No => return self.left("All right, I leave it as it is."),
                Confirmation::Neither => self.note("no yes", "The open question is dropped: something else was said."),
            },
            Some(Pending::Choose { call, candidates, question }) => {
                self.dialog.group.clone_from(&candidates);
                match choice(world, text, &candidates, &self.dialog) {
                    Choice::One(id) => return self.chosen(world, call, id, text, sink),
                    Choice::None => return self.left("All right, never mind."),
                    // The planner asked this question itself, so it receives the answer as a new request.
                    Choice::Unclear if call.is_none() => {}
                    Choice::Unclear => {
                        let problem = "I do not know which of them that is.";
                        let text = format!("{problem} {question}");
                        let reply = Reply { text, candidates: candidates.clone(), ..Reply::default() };
                        self.note("still open", problem);
                        self.pending = Some(Pending::Choose { call, candidates, question });
                        return reply;
                    }
                    Choice::Else => {}
                }
            }
            None => {}
        }
        self.plan(world, text, sink)
    }

    /// Starts a new request: the outer loop.
    fn plan(&mut self, world: &mut dyn World, text: &str, sink: &mut ProgressSink<'_>) -> Reply {
        self.dialog.marked.clear();
        self.dialog.isolated.clear();
        world.begin();
        let (dialog, policy) = (&self.dialog, &self.policy);
        self.planner.start(
            text,
            &mut PlannerContext { world: &mut *world, dialog, policy, on: &mut *sink.on, cancel: sink.cancel },
        );
        self.run(world, None, sink)
    }

    fn confirmed(
        &mut self,
        world: &mut dyn World,
        call: ToolCall,
        ids: Vec<IdentityId>,
        sink: &mut ProgressSink<'_>,
    ) -> Reply {
        // The scene may have changed since the question.
        let outcome = match check(world, &call, &self.policy, &self.dialog, true) {
            CheckedCall::Ready { call, note, .. } => self.perform(world, call, ids, &note, sink),
            CheckedCall::Refused { refusal, .. } => self.refused_call(call, refusal, sink),
            CheckedCall::Choose { question, .. } | CheckedCall::Confirm { question, .. } => {
                self.refused_call(call, Refusal::new(RefusalKind::Unclear, question), sink)
            }
        };
        self.run(world, Some(outcome), sink)
    }

    fn chosen(
        &mut self,
        world: &mut dyn World,
        call: Option<ToolCall>,
        id: IdentityId,
        text: &str,
        sink: &mut ProgressSink<'_>,
    ) -> Reply {
        let Some(call) = call else {
            // The planner asked: it receives the answer as typed.
            self.dialog.last = Some(id);
            return self.plan(world, text, sink);
        };
        let call = call.with_target(super::tool::Target::Identity(id));
        match self.attempt(world, call, sink) {
            Ok(outcome) => self.run(world, Some(outcome), sink),
            Err(reply) => *reply,
        }
    }

    /// Runs the inner loop: one call after another, each planned after the result of the last one.
    fn run(&mut self, world: &mut dyn World, first: Option<CallOutcome>, sink: &mut ProgressSink<'_>) -> Reply {
        let mut outcomes: Vec<CallOutcome> = first.into_iter().collect();
        let mut alike = (None, 0);
        for calls in 0.. {
            if sink.cancel.load(Ordering::Relaxed) {
                return self.ended(&outcomes, Refusal::new(RefusalKind::Stopped, "Stopped."));
            }
            if calls >= MOST_CALLS {
                let text = format!("I stopped after {MOST_CALLS} steps; ask for less at once.");
                return self.ended(&outcomes, Refusal::new(RefusalKind::Limit, text));
            }
            let (dialog, policy) = (&self.dialog, &self.policy);
            let mut context =
                PlannerContext { world: &mut *world, dialog, policy, on: &mut *sink.on, cancel: sink.cancel };
            let call = match self.planner.next(outcomes.last(), &mut context) {
                Ok(Step::Call(call)) => call,
                Ok(Step::Finish { text, refusal }) => return self.finished(&outcomes, text, refusal),
                Err(refusal) => return self.ended(&outcomes, refusal),
            };
            alike = if alike.0.as_ref() == Some(&call) { (alike.0, alike.1 + 1) } else { (Some(call.clone()), 1) };
            if alike.1 > MOST_ALIKE {
                let text = "I stopped: the same step came again and again.";
                return self.ended(&outcomes, Refusal::new(RefusalKind::Limit, text));
            }
            match self.attempt(world, call, sink) {
                Ok(outcome) => outcomes.push(outcome),
                Err(mut reply) => {
                    let done: Vec<&str> =
                        outcomes.iter().filter(|o| o.refused.is_none()).map(|o| o.text.as_str()).collect();
                    if !done.is_empty() {
                        reply.text = format!("{} {}", done.join(" "), reply.text);
                    }
                    return *reply;
                }
            }
        }
        Reply::default()
    }

    /// Checks and executes a call. `Err` is a reply that asks the user.
    fn attempt(
        &mut self,
        world: &mut dyn World,
        call: ToolCall,
        sink: &mut ProgressSink<'_>,
    ) -> Result<CallOutcome, Box<Reply>> {
        let said = call.line(world.identities());
        self.transcript.add(What::Call { call: call.clone(), line: said });
        if let ToolCall::AskUser { question, candidates } = &call {
            if let Some(refusal) = self.policy.refusal(&call) {
                return Ok(self.refused_call(call, refusal, sink));
            }
            let there: Vec<IdentityId> = candidates.iter().copied().filter(|id| world.facts(*id).is_some()).collect();
            // The model's text may hold line breaks and control characters.
            let question = text::line(question).into_owned();
            let reply = Reply { text: question.clone(), candidates: there.clone(), ..Reply::default() };
            self.pending = Some(Pending::Choose { call: None, candidates: there, question });
            return Err(Box::new(reply));
        }
        match check(world, &call, &self.policy, &self.dialog, false) {
            CheckedCall::Ready { call, ids, note } => Ok(self.perform(world, call, ids, &note, sink)),
            CheckedCall::Refused { refusal, near } => {
                let mut outcome = self.refused_call(call, refusal, sink);
                outcome.ids = near;
                Ok(outcome)
            }
            CheckedCall::Choose { question, candidates } => {
                self.note("ambiguous", &question);
                let reply = Reply { text: question.clone(), candidates: candidates.clone(), ..Reply::default() };
                self.pending = Some(Pending::Choose { call: Some(call), candidates, question });
                Err(Box::new(reply))
            }
            CheckedCall::Confirm { question, call, ids } => {
                self.note("needs a yes", &question);
                self.dialog.last = ids.first().copied().or(self.dialog.last);
                let reply = Reply { text: question, candidates: ids.clone(), ..Reply::default() };
                self.pending = Some(Pending::Confirm { call, ids });
                Err(Box::new(reply))
            }
        }
    }

    fn perform(
        &mut self,
        world: &mut dyn World,
        call: ToolCall,
        ids: Vec<IdentityId>,
        note: &str,
        sink: &mut ProgressSink<'_>,
    ) -> CallOutcome {
        let said = call.line(world.identities());
        (sink.on)(AgentEvent::Call { call: call.clone(), line: said.clone() });
        let outcome = perform(world, call, ids, note, &mut self.dialog, sink.cancel);
        let done = outcome.refused.is_none();
        (sink.on)(AgentEvent::Result { text: outcome.text.clone(), done });
        self.transcript.add(What::Result { call: outcome.call.clone(), line: said, text: outcome.text.clone(), done });
        outcome
    }

    /// Outcome of a call that a check has refused.
    fn refused_call(&mut self, call: ToolCall, refusal: Refusal, sink: &mut ProgressSink<'_>) -> CallOutcome {
        self.note("refused", &refusal.text);
        (sink.on)(AgentEvent::Result { text: refusal.text.clone(), done: false });
        CallOutcome { call, ids: Vec::new(), text: refusal.text, refused: Some(refusal.kind) }
    }

    fn note(&mut self, verdict: &str, text: &str) {
        self.transcript.add(What::Check { verdict: verdict.into(), text: text.into() });
    }

    /// Reply after the user's no, which is not a refusal.
    fn left(&mut self, text: &str) -> Reply {
        self.note("answered no", text);
        Reply { text: text.into(), ..Reply::default() }
    }

    /// Refuses a request for a reason of the caller's.
    pub(super) fn refuse(&mut self, kind: RefusalKind, text: &str) -> Reply {
        self.note("refused", text);
        Reply { text: text.into(), refused: Some(Refusal::new(kind, text)), ..Reply::default() }
    }

    /// Reply after the planner has finished.
    fn finished(&mut self, outcomes: &[CallOutcome], text: String, refusal: Option<Refusal>) -> Reply {
        let failed = outcomes.iter().rev().find_map(|o| Some((o, o.refused?)));
        let refused = refusal.or_else(|| {
            // A refused call that the planner recovered from does not refuse the request.
            let last = outcomes.last().filter(|o| o.refused.is_some())?;
            Some(Refusal::new(last.refused?, last.text.clone()))
        });
        // A planner that speaks for itself does not know the private results, so they are added to its text.
        let speaks = self.planner.speaks() && !text.is_empty();
        let told =
            outcomes.iter().enumerate().filter(|(i, o)| (!speaks || o.is_private()) && !is_outdated(outcomes, *i));
        let mut said: Vec<&str> = told.map(|(_, o)| o.text.as_str()).collect();
        if let Some(refusal) = refused.as_ref().filter(|r| said.last() != Some(&r.text.as_str()) && text != r.text) {
            said.push(&refusal.text);
        }
        if !text.is_empty() {
            said.push(&text);
        }
        let text = said.join(" ");
        let near = failed.filter(|_| refused.is_some()).map(|(o, _)| o.ids.clone());
        let candidates = near.unwrap_or_else(|| outcomes.last().map(|o| o.ids.clone()).unwrap_or_default());
        Reply { text, candidates, refused, pending: None }
    }

    /// Reply after the planner could not go on.
    fn ended(&mut self, outcomes: &[CallOutcome], refusal: Refusal) -> Reply {
        self.note("ended", &refusal.text);
        let mut said: Vec<&str> = outcomes.iter().map(|o| o.text.as_str()).collect();
        said.push(&refusal.text);
        Reply { text: said.join(" "), refused: Some(refusal.clone()), ..Reply::default() }
    }
}

/// True if a later result tells the state that this one told: of several isolated things, the last names all.
fn is_outdated(outcomes: &[CallOutcome], at: usize) -> bool {
    let isolates = |o: &CallOutcome| o.refused.is_none() && matches!(o.call, ToolCall::Isolate { .. });
    isolates(&outcomes[at]) && outcomes[at + 1..].iter().any(isolates)
}
