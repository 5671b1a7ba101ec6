//! JSON schemas of the tools, for chat models and programs: `assets/agent_tools.json`, which a test compares with
//! [`ToolCall`](super::tool::ToolCall).

use serde_json::{Value, json};

/// Key of the hints on what a tool changes, which chat models do not take.
const HINTS: &str = "annotations";

fn read() -> Vec<Value> {
    // A test parses the file, so the fallback to an empty list is never used.
    serde_json::from_str(include_str!("../../assets/agent_tools.json")).unwrap_or_default()
}

/// Schema of every tool for chat models, in the order of [`super::tool::NAMES`].
pub fn tools() -> Vec<Value> {
    let mut tools = read();
    tools.iter_mut().filter_map(Value::as_object_mut).for_each(|tool| drop(tool.remove(HINTS)));
    tools
}

/// Schema of every tool in the form of the Model Context Protocol, in the same order.
pub(super) fn protocol_tools() -> Vec<Value> {
    let listed = |tool: Value| {
        let function = &tool["function"];
        json!({
            "name": function["name"],
            "description": function["description"],
            "inputSchema": function["parameters"],
            HINTS: tool[HINTS],
        })
    };
    read().into_iter().map(listed).collect()
}
