//! The tools as JSON schemas, as chat models take them. Written by hand; a test holds them against
//! a snapshot and against [`ToolCall`](super::tool::ToolCall).

use serde_json::{Value, json};

use super::camera_args::{CLOSENESS, Direction, FARTHEST, Side};
use super::relation::Relation;
use crate::agent::tool::MAX_TEXT;

fn words<T: serde::Serialize>(all: &[T]) -> Value {
    json!(all)
}

fn target(what: &str) -> Value {
    json!({
        "description": format!("{what}: its number, or words such as 'the handle of the mug left of the laptop'"),
        "anyOf": [{ "type": "integer", "minimum": 1 }, { "type": "string", "minLength": 1, "maxLength": MAX_TEXT }]
    })
}

fn text(what: &str) -> Value {
    json!({ "type": "string", "description": what, "minLength": 1, "maxLength": MAX_TEXT })
}

fn level() -> Value {
    json!({ "type": "string", "enum": ["any", "object", "part"], "description": "whole objects, parts, or both" })
}

fn tool(name: &str, description: &str, properties: Value, required: &[&str]) -> Value {
    json!({
        "type": "function",
        "function": {
            "name": name,
            "description": description,
            "parameters": {
                "type": "object", "properties": properties, "required": required, "additionalProperties": false
            }
        }
    })
}

fn on_target(name: &str, description: &str) -> Value {
    tool(name, description, json!({ "target": target("the thing") }), &["target"])
}

/// The schema of every tool, in the order of [`super::tool::NAMES`].
pub fn tools() -> Vec<Value> {
    let distance = json!({
        "description": "how far: in metres, in steps that suit the scene, or one step",
        "anyOf": [
            { "type": "object", "properties": { "metres": { "type": "number", "exclusiveMinimum": 0, "maximum": FARTHEST } },
              "required": ["metres"], "additionalProperties": false },
            { "type": "object", "properties": { "relative": { "type": "number", "exclusiveMinimum": 0, "maximum": FARTHEST } },
              "required": ["relative"], "additionalProperties": false },
            { "type": "string", "enum": ["default"] }
        ]
    });
    let closeness = json!({
        "description": "1 as usual, 2 twice as close, 0.5 from twice as far",
        "anyOf": [
            { "type": "string", "enum": ["normal", "closer", "farther"] },
            { "type": "number", "minimum": CLOSENESS.start(), "maximum": CLOSENESS.end() }
        ]
    });
    let reference = json!({
        "description": "from what to measure a distance; without it the size is measured",
        "anyOf": [
            { "type": "string", "enum": ["eye"] },
            { "type": "object", "properties": { "thing": target("the other thing") }, "required": ["thing"],
              "additionalProperties": false }
        ]
    });
    vec![
        tool(
            "locate",
            "Find what words mean and mark it in the view.",
            json!({ "query": text("the words"), "kind": level() }),
            &["query"],
        ),
        tool(
            "go_to",
            "Fly the camera to a thing.",
            json!({
                "target": target("the thing"),
                "side": { "type": "string", "enum": words(&Side::ALL), "description": "from where to look at it" },
                "closeness": closeness
            }),
            &["target"],
        ),
        on_target("look_at", "Turn the camera towards a thing without moving."),
        tool(
            "move",
            "Move the camera, as the viewer sees it.",
            json!({ "direction": { "type": "string", "enum": words(&Direction::ALL) }, "distance": distance }),
            &["direction"],
        ),
        tool(
            "turn",
            "Turn the camera without moving.",
            json!({
                "direction": { "type": "string", "enum": words(Direction::TURNS) },
                "degrees": { "type": "number", "exclusiveMinimum": 0, "maximum": 360 }
            }),
            &["direction", "degrees"],
        ),
        on_target("isolate", "Draw one thing alone."),
        on_target("highlight", "Mark a thing in the view."),
        on_target("hide", "Leave a thing out of the picture."),
        on_target("unhide", "Draw a hidden thing again."),
        tool("show_all", "Draw everything again.", json!({}), &[]),
        on_target("remove", "Hide a thing that the user wants gone; files keep it. The program asks the user first."),
        tool(
            "rename",
            "Give a thing another name. The program asks the user first.",
            json!({ "target": target("the thing"), "name": text("the new name") }),
            &["target", "name"],
        ),
        tool(
            "describe",
            "Emit about a thing; without a target, about what is in the view.",
            json!({ "target": target("the thing") }),
            &[],
        ),
        tool(
            "list",
            "List or count things: all, the parts of a thing, or what stands in a relation to it.",
            json!({
                "level": level(),
                "of": target("only what stands in 'relation' to this"),
                "relation": { "type": "string", "enum": words(&Relation::ALL) },
                "named": text("only what is called like this")
            }),
            &[],
        ),
        tool(
            "measure",
            "Size of a thing, or its distance from the eye or another thing.",
            json!({ "target": target("the thing"), "to": reference }),
            &["target"],
        ),
        tool(
            "ask_user",
            "Ask the user when it is not clear what is meant.",
            json!({
                "question": text("the question"),
                "candidates": { "type": "array", "items": { "type": "integer", "minimum": 1 }, "description": "numbers to choose from" }
            }),
            &["question"],
        ),
        tool("undo", "Take back the last change.", json!({}), &[]),
        on_target("export", "Write the Gaussians of a thing to a file. The program asks before it replaces one."),
    ]
}
