//! What turns requests into calls. A planner proposes; the session checks and acts.

use std::sync::atomic::AtomicBool;

use super::dialog::DialogState;
use super::event::AgentEvent;
use super::execute::CallOutcome;
use super::policy::Policy;
use super::refusal::Refusal;
use super::tool::ToolCall;
use super::world::World;

/// What to do next.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    Call(ToolCall),
    Finish {
        /// What to say beyond the calls' results; of a planner that speaks for itself, all of it.
        text: String,
        /// Why it was not done, if it was not.
        refusal: Option<Refusal>,
    },
}

impl Step {
    /// The request is dealt with, and the calls' results say it all.
    pub fn finish() -> Self {
        Self::Finish { text: String::new(), refusal: None }
    }
}

/// What a planner sees of the session.
pub struct PlannerContext<'a> {
    /// The scene. Planners look; only the session acts.
    pub(crate) world: &'a mut dyn World,
    pub(crate) dialog: &'a DialogState,
    pub(crate) policy: &'a Policy,
    pub(crate) on: &'a mut dyn FnMut(AgentEvent),
    pub(crate) cancel: &'a AtomicBool,
}

/// Turns a request into a sequence of calls that may change after each result.
pub trait Planner: Send {
    /// Its name for display.
    fn name(&self) -> &'static str;

    /// A new request. What was left of the last one is forgotten.
    fn start(&mut self, request: &str, context: &mut PlannerContext<'_>);

    /// The next step; `last` is what became of the last call.
    ///
    /// # Errors
    /// If it cannot go on.
    fn next(&mut self, last: Option<&CallOutcome>, context: &mut PlannerContext<'_>) -> Result<Step, Refusal>;

    /// Whether its last words stand for the calls' results, which are else said one by one.
    fn speaks(&self) -> bool {
        false
    }

    /// Whether it sends texts to another machine.
    fn is_remote(&self) -> bool {
        false
    }

    /// A text without secrets that the planner knows of.
    fn redact(&self, text: &str) -> String {
        text.to_owned()
    }
}
