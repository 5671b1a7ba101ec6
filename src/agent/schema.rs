//! The tools as JSON schemas, as chat models take them: `assets/agent_tools.json`, which a test compares with
//! [`ToolCall`](super::tool::ToolCall).

use serde_json::Value;

/// The schema of every tool, in the order of [`super::tool::NAMES`].
pub fn tools() -> Vec<Value> {
    // A test reads it, so that it is never none.
    serde_json::from_str(include_str!("../../assets/agent_tools.json")).unwrap_or_default()
}
