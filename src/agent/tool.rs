//! Tools of the agent as one closed enum: a planner can do nothing else.

use serde::{Deserialize, Serialize};

use super::camera_args::{self, Direction, Distance};
use super::relation::Relation;
use crate::navigate::target::Side;
use crate::scene::{IdentityId, LevelFilter};

/// Longest text in a call, in characters.
pub const MAX_TEXT: usize = 300;

/// Target of a call.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Target {
    Identity(IdentityId),
    /// A description in words, such as "the handle of the mug left of the laptop".
    Query(String),
}

impl Target {
    /// Returns a target in words.
    pub fn query(words: impl Into<String>) -> Self {
        Self::Query(words.into())
    }
}

/// Call of a tool with its arguments.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "name", content = "arguments", rename_all = "snake_case", deny_unknown_fields)]
pub enum ToolCall {
    /// Find a thing by words, and mark it in the view.
    Locate {
        query: String,
        /// Object or part.
        #[serde(default)]
        kind: LevelFilter,
    },
    GoTo {
        target: Target,
        /// Side to view it from.
        #[serde(default = "camera_args::same")]
        side: Side,
        /// 1 for the usual distance, 2 for half of it, 0.5 for twice of it.
        #[serde(default = "camera_args::normal", deserialize_with = "camera_args::closeness")]
        closeness: f64,
    },
    /// Turn toward a target without moving.
    LookAt {
        target: Target,
    },
    Move {
        direction: Direction,
        /// Length of the movement.
        #[serde(default)]
        distance: Distance,
    },
    Turn {
        direction: Direction,
        /// Angle in degrees, above 0, at most 360.
        degrees: f64,
    },
    Isolate {
        target: Target,
    },
    Highlight {
        target: Target,
    },
    Hide {
        target: Target,
    },
    Unhide {
        target: Target,
    },
    ShowAll {},
    Remove {
        target: Target,
    },
    Rename {
        target: Target,
        name: String,
    },
    /// Describe a thing or the view.
    Describe {
        /// Thing to describe; `None` for the view.
        #[serde(default)]
        target: Option<Target>,
    },
    List {
        /// Objects or parts.
        #[serde(default)]
        level: LevelFilter,
        /// Only things in `relation` to this.
        #[serde(default)]
        of: Option<Target>,
        /// Relation to `of`.
        #[serde(default)]
        relation: Relation,
        /// Only things of this name.
        #[serde(default)]
        named: Option<String>,
    },
    Measure {
        target: Target,
        /// Other end of a distance; `None` for the size of the target.
        #[serde(default)]
        to: Option<Reference>,
    },
    AskUser {
        question: String,
        /// Identities to choose from; may be empty.
        #[serde(default)]
        candidates: Vec<IdentityId>,
    },
    Undo {},
    /// Write the Gaussians of a thing to a file.
    Export {
        target: Target,
    },
    /// Find where a photo was taken, and go there.
    LocatePhoto {
        /// File of the photo; `None` for the last one.
        #[serde(default)]
        photo: Option<String>,
    },
    /// Show the difference of the last photo from the scene.
    ShowChanges {},
    /// Add photos to the scene, which makes another one.
    AddPhotos {
        /// File or folder of photos; `None` for all that were given.
        #[serde(default)]
        photos: Option<String>,
    },
}

/// Reference of a distance.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reference {
    Eye,
    Thing(Target),
}

/// Error of an invalid call.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ToolError {
    /// The tool does not exist.
    #[error("there is no tool '{0}'")]
    Unknown(String),
    /// The arguments do not fit the tool.
    #[error("wrong arguments for '{tool}': {problem}")]
    Arguments { tool: String, problem: String },
}

/// Names of all tools, in the order of [`ToolCall`].
pub const NAMES: [&str; 21] = [
    "locate",
    "go_to",
    "look_at",
    "move",
    "turn",
    "isolate",
    "highlight",
    "hide",
    "unhide",
    "show_all",
    "remove",
    "rename",
    "describe",
    "list",
    "measure",
    "ask_user",
    "undo",
    "export",
    "locate_photo",
    "show_changes",
    "add_photos",
];

/// Pattern of the calls that always have a target.
macro_rules! targeted {
    ($target:ident) => {
        Self::GoTo { target: $target, .. }
            | Self::LookAt { target: $target }
            | Self::Isolate { target: $target }
            | Self::Highlight { target: $target }
            | Self::Hide { target: $target }
            | Self::Unhide { target: $target }
            | Self::Remove { target: $target }
            | Self::Rename { target: $target, .. }
            | Self::Measure { target: $target, .. }
            | Self::Export { target: $target }
    };
}

impl ToolCall {
    /// Returns the search for what a sentence asks for.
    pub(crate) fn ask(sentence: &str) -> Self {
        Self::Locate { query: sentence.chars().take(MAX_TEXT).collect(), kind: LevelFilter::Auto }
    }

    /// Reads a call from a tool's name and its arguments as JSON.
    ///
    /// # Errors
    /// If the tool does not exist, or the arguments do not fit it.
    pub fn parse(name: &str, arguments: &str) -> Result<Self, ToolError> {
        if !NAMES.contains(&name) {
            return Err(ToolError::Unknown(name.chars().take(60).collect()));
        }
        let wrong = |problem: String| ToolError::Arguments { tool: name.into(), problem };
        let given = if arguments.trim().is_empty() { "{}" } else { arguments };
        let given: serde_json::Value =
            serde_json::from_str(given).map_err(|e| wrong(format!("they are no JSON ({e})")))?;
        if !given.is_object() {
            return Err(wrong("they must be a JSON object".into()));
        }
        let whole = serde_json::json!({ "name": name, "arguments": given });
        let call: Self = serde_json::from_value(whole).map_err(|e| wrong(e.to_string()))?;
        call.sound().map_err(wrong)?;
        Ok(call)
    }

    /// Checks the numbers and texts.
    ///
    /// # Errors
    /// If one is out of its range, in words.
    pub(crate) fn sound(&self) -> Result<(), String> {
        match self {
            Self::Move { distance, .. } if !distance.is_sound() => {
                return Err(format!("the distance must be above 0 and at most {}", camera_args::FARTHEST));
            }
            Self::Turn { degrees, .. } if !(*degrees > 0.0 && *degrees <= 360.0) => {
                return Err("degrees must be above 0 and at most 360".into());
            }
            Self::Turn { direction: Direction::Forward | Direction::Back, .. } => {
                return Err("a turn goes left, right, up or down".into());
            }
            Self::GoTo { closeness, .. } if !camera_args::CLOSENESS.contains(closeness) => {
                return Err("closeness must be between 0.1 and 10".into());
            }
            _ => {}
        }
        let texts = [
            match self {
                Self::Locate { query, .. } => Some(query),
                Self::Rename { name, .. } => Some(name),
                Self::AskUser { question, .. } => Some(question),
                Self::List { named, .. } => named.as_ref(),
                Self::LocatePhoto { photo: file } | Self::AddPhotos { photos: file } => file.as_ref(),
                _ => None,
            },
            match self.target() {
                Some(Target::Query(query)) => Some(query),
                _ => None,
            },
        ];
        for text in texts.into_iter().flatten() {
            if text.trim().is_empty() {
                return Err("a text is empty".into());
            }
            if text.chars().count() > MAX_TEXT {
                return Err(format!("a text is longer than {MAX_TEXT} characters"));
            }
        }
        Ok(())
    }

    /// Name of the tool.
    pub fn name(&self) -> &'static str {
        let tagged = serde_json::to_value(self).unwrap_or_default();
        NAMES.into_iter().find(|name| tagged["name"] == *name).unwrap_or("unknown")
    }

    /// Target, if the call has one.
    pub(crate) fn target(&self) -> Option<&Target> {
        match self {
            targeted!(target) => Some(target),
            Self::Describe { target } | Self::List { of: target, .. } => target.as_ref(),
            _ => None,
        }
    }

    /// Returns the call with another target; a call without one is unchanged. [`Self::Locate`] becomes
    /// [`Self::Highlight`].
    #[must_use]
    pub(crate) fn with_target(&self, new: Target) -> Self {
        let mut call = self.clone();
        match &mut call {
            targeted!(target) => *target = new,
            Self::Describe { target } | Self::List { of: target, .. } => *target = Some(new),
            Self::Locate { .. } => return Self::Highlight { target: new },
            _ => {}
        }
        call
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn calls_survive_json() {
        let call = ToolCall::parse("go_to", r#"{"target": "the lamp", "side": "other", "closeness": "closer"}"#);
        let wanted = ToolCall::GoTo { target: Target::query("the lamp"), side: Side::Other, closeness: 2.0 };
        assert_eq!(call, Ok(wanted.clone()));
        let text = serde_json::to_string(&wanted).expect("JSON");
        assert_eq!(serde_json::from_str::<ToolCall>(&text).expect("read"), wanted);
        assert_eq!(ToolCall::parse("undo", ""), Ok(ToolCall::Undo {}));
        let wanted = ToolCall::Move { direction: Direction::Back, distance: Distance::Meters(0.5) };
        assert_eq!(ToolCall::parse("move", r#"{"direction": "back", "distance": {"meters": 0.5}}"#), Ok(wanted));
    }

    #[test]
    fn what_is_no_call_is_refused() {
        for (name, arguments) in [
            ("format_disk", "{}"),
            ("go_to", "{"),
            ("go_to", "{}"),
            ("go_to", "[]"),
            ("go_to", r#"{"target": "lamp", "speed": 9}"#),
            ("go_to", r#"{"target": -3}"#),
            ("go_to", r#"{"target": "lamp", "closeness": 1e9}"#),
            ("go_to", r#"{"target": ""}"#),
            ("show_all", r#"{"and": "remove"}"#),
            ("turn", r#"{"direction": "left", "degrees": -5}"#),
            ("turn", r#"{"direction": "left", "degrees": "many"}"#),
            ("move", r#"{"direction": "sideways"}"#),
            ("move", r#"{"direction": "up", "distance": {"meters": 1e30}}"#),
        ] {
            assert!(ToolCall::parse(name, arguments).is_err(), "{name} {arguments}");
        }
        let long = format!(r#"{{"query": "{}"}}"#, "x".repeat(MAX_TEXT + 1));
        assert!(ToolCall::parse("locate", &long).is_err());
    }
}
