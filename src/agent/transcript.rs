//! Transcript of a session: texts, checks and calls.

use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::camera_args::{self, Distance};
use super::relation::Relation;
use super::tool::{Reference, Target, ToolCall};
use crate::math::format::short;
use crate::navigate::target::Side;
use crate::scene::{Identities, LevelFilter, text};

/// Maximum number of entries; the oldest are dropped first.
const MOST: usize = 4000;

/// Event of the transcript.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum What {
    User {
        text: String,
    },
    Call {
        call: ToolCall,
        line: String,
    },
    /// A check stopped or changed a call.
    Check {
        verdict: String,
        text: String,
    },
    Result {
        /// Call as executed, with targets by number.
        call: ToolCall,
        line: String,
        text: String,
        done: bool,
    },
    /// The planner reports about itself: retries, limits.
    Planner {
        text: String,
    },
    Reply {
        text: String,
    },
}

/// Entry of the transcript.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TranscriptEntry {
    /// Time since the start of the session, in ms.
    pub(crate) elapsed_ms: u64,
    /// Event.
    #[serde(flatten)]
    pub what: What,
}

/// All events of a session, in order.
#[derive(Clone, Debug, Serialize)]
pub struct Transcript {
    pub entries: Vec<TranscriptEntry>,
    #[serde(skip)]
    start: Instant,
}

impl Default for Transcript {
    fn default() -> Self {
        Self { entries: Vec::new(), start: Instant::now() }
    }
}

impl Transcript {
    pub(crate) fn add(&mut self, what: What) {
        if self.entries.len() >= MOST {
            self.entries.drain(..MOST / 4);
        }
        let elapsed_ms = u64::try_from(self.start.elapsed().as_millis()).unwrap_or(u64::MAX);
        self.entries.push(TranscriptEntry { elapsed_ms, what });
    }

    /// Formats the transcript as JSON.
    pub fn to_json(&self) -> String {
        // Texts and finite numbers always serialize.
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// Formats the transcript as Markdown.
    pub fn to_markdown(&self) -> String {
        let mut text = String::from("# Transcript\n");
        for entry in &self.entries {
            let secs = entry.elapsed_ms as f64 / 1000.0;
            let line = match &entry.what {
                What::User { text } => format!("\n**You** ({secs:.1} s): {}\n", flat(text)),
                What::Call { line, .. } => format!("- {secs:.1} s plan: `{}`", code(line)),
                What::Check { verdict, text } => format!("- {secs:.1} s check: {} ({})", flat(text), flat(verdict)),
                What::Result { line, text, done, .. } => {
                    let sign = if *done { "done" } else { "not done" };
                    format!("- {secs:.1} s {sign}: `{}`: {}", code(line), flat(text))
                }
                What::Planner { text } => format!("- {secs:.1} s planner: {}", flat(text)),
                What::Reply { text } => format!("\n**Agent** ({secs:.1} s): {}", flat(text)),
            };
            text += &line;
            text.push('\n');
        }
        text
    }
}

impl ToolCall {
    /// Formats the call on one line for display, with names in place of numbers.
    pub fn line(&self, identities: &Identities) -> String {
        let name = |target: &Target| match target {
            Target::Identity(id) => identities.full_name(*id),
            Target::Query(words) => format!("\"{words}\""),
        };
        let mut parts: Vec<String> = self.target().map(name).into_iter().collect();
        match self {
            Self::Locate { query, kind } => {
                parts.push(format!("\"{query}\""));
                match kind {
                    LevelFilter::Auto => {}
                    LevelFilter::Object => parts.push("object".into()),
                    LevelFilter::Part => parts.push("part".into()),
                }
            }
            Self::GoTo { side, closeness, .. } => {
                if *side != Side::Same {
                    parts.push(side.text().into());
                }
                if *closeness > camera_args::NORMAL {
                    parts.push("closer".into());
                } else if *closeness < camera_args::NORMAL {
                    parts.push("farther".into());
                }
            }
            Self::Move { direction, distance } => {
                parts.push(direction.text().into());
                match distance {
                    Distance::Meters(m) => parts.push(format!("{} m", short(*m))),
                    Distance::Relative(r) => parts.push(format!("{} steps", short(*r))),
                    Distance::Default => {}
                }
            }
            Self::Turn { direction, degrees } => {
                parts.extend([direction.text().into(), format!("{} degrees", short(*degrees))]);
            }
            Self::Rename { name, .. } => parts.push(format!("\"{name}\"")),
            Self::List { level, relation, named, of } => {
                if of.is_some() && *relation != Relation::PartOf {
                    parts.insert(0, relation.text().into());
                }
                match level {
                    LevelFilter::Auto => {}
                    LevelFilter::Object => parts.insert(0, "objects".into()),
                    LevelFilter::Part => parts.insert(0, "parts".into()),
                }
                parts.extend(named.iter().map(|n| format!("\"{n}\"")));
            }
            Self::Measure { to: Some(Reference::Eye), .. } => parts.push("from here".into()),
            Self::Measure { to: Some(Reference::Thing(t)), .. } => parts.push(format!("from {}", name(t))),
            Self::AskUser { question, .. } => parts.push(format!("\"{question}\"")),
            Self::LocatePhoto { photo: file } | Self::AddPhotos { photos: file } => {
                parts.extend(file.iter().map(|file| format!("\"{file}\"")))
            }
            _ => {}
        }
        format!("{}({})", self.name(), parts.join(", "))
    }
}

/// Formats a text on one line, with Markdown markup escaped.
fn flat(text: &str) -> String {
    let mut flat = String::with_capacity(text.len());
    for c in text::line(text).chars() {
        match c {
            '*' | '_' | '`' | '#' | '[' | ']' | '<' | '>' | '|' | '\\' => flat.extend(['\\', c]),
            c => flat.push(c),
        }
    }
    flat
}

fn code(text: &str) -> String {
    text::line(text).replace('`', "'")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_transcript_is_read_by_people_and_programs() {
        let mut t = Transcript::default();
        t.add(What::User { text: "hide\n# the `mug`".into() });
        t.add(What::Result { call: ToolCall::Undo {}, line: "undo()".into(), text: "Undone.".into(), done: true });
        let json: serde_json::Value = serde_json::from_str(&t.to_json()).expect("JSON");
        assert_eq!(json["entries"][1]["call"]["name"], "undo");
        let text = t.to_markdown();
        assert!(text.contains("hide \\# the \\`mug\\`") && text.contains("done: `undo()`"), "{text}");
        assert_eq!(t.entries.iter().filter(|e| matches!(e.what, What::Result { done: true, .. })).count(), 1);
        for _ in 0..2 * MOST {
            t.add(What::Planner { text: String::new() });
        }
        assert!(t.entries.len() <= MOST);
    }
}
