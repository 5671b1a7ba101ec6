//! Conversion of a command, by its id in `assets/commands.toml` and the values of its slots, into a task.

use super::form::Slots;
use crate::agent::camera_args::{CLOSER, Direction, FARTHER, NORMAL};
use crate::agent::relation::Relation;
use crate::agent::tool::{Reference, Target, ToolCall};
use crate::navigate::target::Side;
use crate::scene::LevelFilter;

/// Step of a plan.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum CommandStep {
    Call(ToolCall),
    /// Multiply the closeness to the last target by this factor; without a target, step forward or back.
    Closer(f64),
    /// Look at the last target from another side.
    From(Side),
    Again,
    Help,
}

/// Returns the task of a command; `None` if a slot is missing.
pub(super) fn task(id: &str, slots: &Slots) -> Option<CommandStep> {
    let text = |n: usize| slots.texts.get(n).map(String::as_str);
    let thing = |n: usize| slots.texts.get(n).map(Target::query);
    let go = |closeness| Some(ToolCall::GoTo { target: thing(0)?, side: slots.side.unwrap_or(Side::Same), closeness });
    let shift = |direction| ToolCall::Move { direction, distance: slots.distance.unwrap_or_default() };
    let turn = |usual| {
        let (direction, degrees) = (slots.direction.unwrap_or(Direction::Right), slots.degrees.unwrap_or(usual));
        ToolCall::Turn { direction, degrees }
    };
    let describe = |words: String| ToolCall::Describe { target: Some(Target::Query(words)) };
    let measure = |to| Some(ToolCall::Measure { target: thing(0)?, to });
    let list = |kind: Option<&str>, of: Option<Target>| list(kind, of, slots.relation.unwrap_or_default());
    Some(CommandStep::Call(match id {
        "help" => return Some(CommandStep::Help),
        "again" => return Some(CommandStep::Again),
        "closer" => return Some(CommandStep::Closer(CLOSER)),
        "farther" => return Some(CommandStep::Closer(FARTHER)),
        "from_side" => return Some(CommandStep::From(slots.side?)),
        "move" => shift(slots.direction?),
        "back" => shift(Direction::Back),
        "turn_around" => turn(180.0),
        "turn" => turn(30.0),
        "show_all" => ToolCall::ShowAll {},
        "isolate" => ToolCall::Isolate { target: thing(0)? },
        "hide" => ToolCall::Hide { target: thing(0)? },
        "unhide" => ToolCall::Unhide { target: thing(0)? },
        "highlight" => ToolCall::Highlight { target: thing(0)? },
        "remove" => ToolCall::Remove { target: thing(0)? },
        "rename" => ToolCall::Rename { target: thing(0)?, name: slots.name.clone()? },
        "export" => ToolCall::Export { target: thing(0)? },
        "undo" => ToolCall::Undo {},
        "locate_photo" => ToolCall::LocatePhoto { photo: slots.photo.clone() },
        "add_photos" => ToolCall::AddPhotos { photos: slots.photo.clone() },
        "changes" => ToolCall::ShowChanges {},
        "distance" => measure(Some(Reference::Eye))?,
        "apart" => measure(Some(Reference::Thing(thing(1)?)))?,
        "own_size" => ToolCall::Measure { target: Target::query("it"), to: None },
        "size" => measure(None)?,
        "count_parts" => list(text(0), thing(1)),
        "has_parts" => list(text(1), thing(0)),
        "parts" => list(Some("parts"), thing(0)),
        "standing" => list(text(0), thing(1)),
        "at" => list(None, thing(0)),
        "list" | "called" => list(text(0), None),
        "objects" => list(None, None),
        "view" => ToolCall::Describe { target: None },
        "most" => describe(format!("the {} {}", slots.most.as_ref()?, text(0)?)),
        "nearest_of" => describe(format!("the {} nearest to {}", text(0)?, text(1)?)),
        "nearest" => describe(format!("the thing nearest to {}", text(0)?)),
        "describe" => describe(text(0)?.to_owned()),
        "where" => ToolCall::Locate { query: text(0)?.to_owned(), kind: LevelFilter::Auto },
        "look_at" => ToolCall::LookAt { target: thing(0)? },
        "approach" => go(CLOSER)?,
        "retreat" => go(FARTHER)?,
        "from_side_of" | "go_to" => go(NORMAL)?,
        "behind" => ToolCall::GoTo { target: thing(0)?, side: Side::Other, closeness: NORMAL },
        _ => return None,
    }))
}

/// Builds a list call: of all objects, of all parts, or of the things of a name.
fn list(kind: Option<&str>, of: Option<Target>, relation: Relation) -> ToolCall {
    let words: Vec<&str> = kind.unwrap_or("objects").split(' ').collect();
    let words = match words.as_slice() {
        ["the" | "any" | "a" | "an" | "some" | "all", rest @ ..] if !rest.is_empty() => rest,
        all => all,
    };
    let (level, named) = match words {
        ["object" | "objects" | "thing" | "things" | "item" | "items" | "something" | "anything"] => {
            (LevelFilter::Object, None)
        }
        ["part" | "parts" | "piece" | "pieces"] => (LevelFilter::Part, None),
        words if of.is_some() && relation == Relation::PartOf => (LevelFilter::Part, Some(words.join(" "))),
        words => (LevelFilter::Auto, Some(words.join(" "))),
    };
    ToolCall::List { level, of, relation, named }
}
