//! Planner of a session whose client plans: it only tells which thing an answer of the user chooses.

use crate::agent::answer::{Choice, choice};
use crate::agent::describe::the;
use crate::agent::execute::CallOutcome;
use crate::agent::planner::{Planner, PlannerContext, Step};
use crate::agent::refusal::{Refusal, RefusalKind};
use crate::scene::IdentityId;

/// Planner that never plans a call.
#[derive(Default)]
pub(super) struct NoPlan {
    /// Candidate that the last answer chose, for a question of the client itself.
    chosen: Option<IdentityId>,
}

impl Planner for NoPlan {
    fn name(&self) -> &'static str {
        "none"
    }

    fn start(&mut self, request: &str, context: &mut PlannerContext<'_>) {
        let dialog = context.dialog;
        self.chosen = match choice(&mut *context.world, request, &dialog.group, dialog) {
            Choice::One(id) => Some(id),
            Choice::None | Choice::Unclear | Choice::Else => None,
        };
    }

    fn next(&mut self, last: Option<&CallOutcome>, context: &mut PlannerContext<'_>) -> Result<Step, Refusal> {
        if last.is_some() {
            return Ok(Step::finish());
        }
        let text = "That chooses none of them, so nothing was done; make a call.";
        self.chosen.take().map_or_else(
            || Err(Refusal::new(RefusalKind::Unclear, text)),
            |id| Ok(Step::Finish { text: format!("That is {}.", the(&*context.world, id)), refusal: None }),
        )
    }
}
