//! Progress events of a session.

use super::tool::ToolCall;

/// Progress event.
#[derive(Clone, Debug, PartialEq)]
pub enum AgentEvent {
    /// The planner waits for a chat model.
    Thinking,
    /// Chunk of the answer, as a model streams it.
    Piece(String),
    /// A call is about to be executed, with targets by number.
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
