//! Tools as the protocol lists them: those of the agent that the policy permits, the picture and the answer.

use std::ops::RangeInclusive;

use serde::{Deserialize, Deserializer};
use serde_json::{Value, json};

use crate::agent::policy::Policy;
use crate::agent::schema;
use crate::agent::words::MAX_CHARS;
use crate::scene::Camera;

/// Tool that draws the view.
pub(super) const PICTURE: &str = "picture";
/// Tool that passes on the user's answer to a question.
pub(super) const ANSWER: &str = "answer";

/// Permitted sides of a picture, in px.
const SIDE_PX: RangeInclusive<u32> = 16..=2048;
/// Longer side of a picture of no stated size, in px.
const USUAL_PX: u32 = 1024;

/// Lists the tools.
pub(super) fn list(policy: &Policy) -> Vec<Value> {
    let permitted: Vec<&str> = policy.usable().collect();
    let is_permitted = |tool: &Value| tool["name"].as_str().is_some_and(|name| permitted.contains(&name));
    let of_agent = schema::protocol_tools().into_iter().filter(is_permitted);
    of_agent.chain([picture(), answer()]).map(with_all_hints).collect()
}

/// States every hint, since clients assume the worst of those that are missing.
fn with_all_hints(mut tool: Value) -> Value {
    let hint = |name: &str| tool["annotations"][name].as_bool();
    let reads = hint("readOnlyHint") == Some(true);
    let destroys = !reads && hint("destructiveHint") != Some(false);
    tool["annotations"] = json!({ "readOnlyHint": reads, "destructiveHint": destroys, "openWorldHint": false });
    tool
}

fn picture() -> Value {
    let side = |which: &str| json!({ "type": "integer", "minimum": SIDE_PX.start(), "maximum": SIDE_PX.end(), "description": which });
    json!({
        "name": PICTURE,
        "description": "Draw the scene as it is seen now, without what is hidden, with what is marked outlined.",
        "inputSchema": {
            "type": "object",
            "properties": {
                "photo": {
                    "anyOf": [{ "type": "integer", "minimum": 0 }, { "type": "string", "minLength": 1 }],
                    "description": "the photo to look from, by its number from 0 or its name; the view stays as it is",
                },
                "width": side("width in pixels"),
                "height": side("height in pixels"),
            },
            "required": [],
            "additionalProperties": false,
        },
        "annotations": { "readOnlyHint": true },
    })
}

fn answer() -> Value {
    json!({
        "name": ANSWER,
        "description": "Pass on the user's answer to a question that a result asks. Ask the user; never answer yourself.",
        "inputSchema": {
            "type": "object",
            "properties": {
                "question": { "type": "integer", "minimum": 1, "description": "the number of the question" },
                "answer": {
                    "type": "string",
                    "minLength": 1,
                    "maxLength": MAX_CHARS,
                    "description": "yes or no; or which one is meant, in the user's words",
                },
            },
            "required": ["question", "answer"],
            "additionalProperties": false,
        },
        "annotations": { "destructiveHint": true },
    })
}

/// Answer of the user to the question of this number.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct UserAnswer {
    pub(super) question: u64,
    pub(super) answer: String,
}

/// Picture that a client asks for.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PictureRequest {
    /// Photo to look from, by index or name; without it, the current view.
    #[serde(default, deserialize_with = "photo")]
    pub photo: Option<String>,
    #[serde(default, deserialize_with = "side")]
    width: Option<u32>,
    #[serde(default, deserialize_with = "side")]
    height: Option<u32>,
}

fn photo<'de, D: Deserializer<'de>>(from: D) -> Result<Option<String>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged, expecting = "a photo is a number from 0 or a name")]
    enum Given {
        Index(u64),
        Name(String),
    }
    let text = |given: Given| match given {
        Given::Index(index) => index.to_string(),
        Given::Name(name) => name,
    };
    Ok(Option::<Given>::deserialize(from)?.map(text))
}

fn side<'de, D: Deserializer<'de>>(from: D) -> Result<Option<u32>, D::Error> {
    let side = Option::<u32>::deserialize(from)?;
    if side.is_some_and(|px| !SIDE_PX.contains(&px)) {
        let text = format!("a side has {} to {} pixels", SIDE_PX.start(), SIDE_PX.end());
        return Err(serde::de::Error::custom(text));
    }
    Ok(side)
}

impl PictureRequest {
    /// Returns the camera at the size that is asked for. A side that is not follows the other.
    pub(crate) fn fit(&self, camera: &Camera) -> Camera {
        let aspect = f64::from(camera.width_px) / f64::from(camera.height_px);
        let follows = |px: f64| (px.round() as u32).clamp(1, *SIDE_PX.end());
        match (self.width, self.height) {
            (None, None) => camera.limited_to(USUAL_PX),
            (Some(width), Some(height)) => camera.with_size(width, height),
            (Some(width), None) => camera.with_size(width, follows(f64::from(width) / aspect)),
            (None, Some(height)) => camera.with_size(follows(f64::from(height) * aspect), height),
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::agent::tool::NAMES;

    #[test]
    fn the_list_is_the_permitted_tools_and_two_more() {
        let names = |policy: &Policy| {
            let list = list(policy);
            list.iter().map(|t| t["name"].as_str().expect("a name").to_owned()).collect::<Vec<_>>()
        };
        let all = names(&Policy::built_in().expect("policy"));
        assert_eq!(all, [&NAMES[..], &[PICTURE, ANSWER]].concat());
        assert!(!NAMES.contains(&PICTURE) && !NAMES.contains(&ANSWER));
        let first = NAMES[0];
        let less = Policy::parse(&format!("[tools]\nallowed = [\"{first}\"]"), "own").expect("policy");
        assert_eq!(names(&less), [first, PICTURE, ANSWER]);
    }

    #[test]
    fn every_tool_says_what_it_changes() {
        let policy = Policy::built_in().expect("policy");
        let list = list(&policy);
        for tool in &list {
            let hints = tool["annotations"].as_object().expect("hints");
            assert!(hints.len() == 3 && hints.values().all(Value::is_boolean), "{tool}");
            assert!(!tool["description"].as_str().expect("a text").is_empty(), "{tool}");
            assert_eq!(tool["inputSchema"]["type"], "object", "{tool}");
        }
        let destroys =
            |name: &str| list.iter().any(|t| t["name"] == name && t["annotations"]["destructiveHint"] == true);
        for name in NAMES {
            use crate::agent::policy::Permission;
            let asks = policy.permission(name) != Permission::Free;
            assert!(!asks || destroys(name), "{name} asks the user, so it destroys");
        }
        assert!(destroys(ANSWER) && !destroys(PICTURE));
    }

    #[test]
    fn a_picture_has_the_sides_that_are_asked_for() {
        let camera = Camera::look_at(DVec3::NEG_Y, DVec3::ZERO, DVec3::Z, 0.8, 4000, 1000).expect("valid");
        let size = |given: Value| {
            let request: Result<PictureRequest, _> = serde_json::from_value(given);
            request.map(|r| r.fit(&camera)).map(|c| (c.width_px, c.height_px)).map_err(|e| e.to_string())
        };
        assert_eq!(size(json!({})), Ok((1024, 256)));
        assert_eq!(size(json!({ "width": 400 })), Ok((400, 100)));
        assert_eq!(size(json!({ "height": 100, "photo": 3 })), Ok((400, 100)));
        assert_eq!(size(json!({ "height": 2048 })), Ok((2048, 2048)), "no side is longer");
        assert_eq!(size(json!({ "width": 30, "height": 20, "photo": null })), Ok((30, 20)));
        for bad in [
            json!({ "width": 15 }),
            json!({ "height": 2049 }),
            json!({ "width": -1 }),
            json!({ "width": 1.5 }),
            json!({ "width": "wide" }),
            json!({ "photo": [] }),
            json!({ "photo": -1 }),
            json!({ "path": "/etc/passwd" }),
        ] {
            assert!(size(bad.clone()).is_err(), "{bad}");
        }
    }
}
