//! JSON schemas of the tools for chat models: `assets/agent_tools.json`, which a test compares with
//! [`ToolCall`](super::tool::ToolCall).

use serde_json::Value;

/// Schema of every tool, in the order of [`super::tool::NAMES`].
pub fn tools() -> Vec<Value> {
    // A test parses the file, so the fallback to an empty list is never used.
    serde_json::from_str(include_str!("../../assets/agent_tools.json")).unwrap_or_default()
}
