//! Planners, which turn requests into calls. A planner proposes; the session checks and acts.

use std::sync::atomic::AtomicBool;

use super::dialog::DialogState;
use super::event::AgentEvent;
use super::execute::CallOutcome;
use super::policy::Policy;
use super::refusal::Refusal;
use super::tool::ToolCall;
use super::world::World;

/// Next step of a plan.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    Call(ToolCall),
    Finish {
        /// Reply beyond the results of the calls; the whole reply if the planner speaks for itself.
        text: String,
        /// Refusal if the request was not carried out.
        refusal: Option<Refusal>,
    },
}

impl Step {
    /// End of the request without a reply beyond the results of the calls.
    pub fn finish() -> Self {
        Self::Finish { text: String::new(), refusal: None }
    }
}

/// Part of the session that a planner can access.
pub struct PlannerContext<'a> {
    /// Scene. Planners only read it; the session acts.
    pub(crate) world: &'a mut dyn World,
    pub(crate) dialog: &'a DialogState,
    pub(crate) policy: &'a Policy,
    pub(crate) on: &'a mut dyn FnMut(AgentEvent),
    pub(crate) cancel: &'a AtomicBool,
}

/// Turns a request into a sequence of calls that may change after each result.
pub trait Planner: Send {
    /// Name for display.
    fn name(&self) -> &'static str;

    /// Starts a new request and drops the rest of the last one.
    fn start(&mut self, request: &str, context: &mut PlannerContext<'_>);

    /// Returns the next step; `last` is the outcome of the last call.
    ///
    /// # Errors
    /// If the planner cannot go on.
    fn next(&mut self, last: Option<&CallOutcome>, context: &mut PlannerContext<'_>) -> Result<Step, Refusal>;

    /// Returns whether its final text replaces the results of the calls, which are else reported one by one.
    fn speaks(&self) -> bool {
        false
    }

    /// Returns whether it sends texts to another machine.
    fn is_remote(&self) -> bool {
        false
    }

    /// Removes the planner's secrets from a text.
    fn redact(&self, text: &str) -> String {
        text.to_owned()
    }
}
