//! What a session tells while it works, for a window that shows it at once.

use super::tool::ToolCall;

/// Something that goes on.
#[derive(Clone, Debug, PartialEq)]
pub enum AgentEvent {
    /// The planner is thinking (a model was asked).
    Thinking,
    /// A piece of the answer, as a model writes it.
    Piece(String),
    /// A call is about to be made, targets by number.
    Call {
        call: ToolCall,
        line: String,
    },
    Result {
        text: String,
        done: bool,
    },
    /// The planner reports about itself: retries, limits.
    Note(String),
}
