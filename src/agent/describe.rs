//! Sentences about things: their kind, place and size.

use super::relation::Relation;
use super::world::World;
use crate::math::format::{self, capital, short};
use crate::pipeline::semantics::query::language::relations::{HOLDS, Space};
use crate::pipeline::semantics::query::language::words::LanguageWords;
use crate::scene::identity::whole_names::BETWEEN;
use crate::scene::{IdentityId, Level, NO_IDENTITY};

/// Least share of the view for a thing to count as visible.
pub(crate) const SEEN: f64 = 0.0005;

/// Name with an article, such as "the lid of the kettle", or "#7" for an identity without a name.
pub(crate) fn the(world: &dyn World, id: IdentityId) -> String {
    let name = world.identities().full_name(id);
    let name = name.replace(BETWEEN, " of the ");
    if name.starts_with('#') { name } else { format!("the {name}") }
}

/// Joins at most `most` names.
pub(crate) fn names(world: &dyn World, ids: &[IdentityId], most: usize) -> String {
    let mut list: Vec<String> = ids.iter().take(most).map(|id| world.identities().label(*id)).collect();
    if ids.len() > most {
        list.push(format!("{} more", ids.len() - most));
    }
    format::list(&list)
}

/// Formats a length given in scene units.
pub(crate) fn length(world: &dyn World, units: f64) -> String {
    match world.meters_per_unit() {
        None => format!("{} scene units", short(units)),
        known => format::length(units, known),
    }
}

/// Describes the edges of a thing's own upright box, which do not depend on the view.
pub(crate) fn size(world: &dyn World, id: IdentityId) -> String {
    let Some(extent) = world.identities().shapes.extent(id, world.view().up) else { return "of unknown size".into() };
    let [long, wide, high] = [extent.length, extent.width, extent.height].map(|edge| length(world, edge));
    let unknown = if world.meters_per_unit().is_none() { " (the scene's scale in meters is not known)" } else { "" };
    format!("{long} on its longer side, {wide} on its shorter side and {high} high{unknown}")
}

/// Shapes of the scene, seen from the current view.
pub(super) fn space(world: &dyn World) -> Space<'_> {
    Space::new(world.identities(), world.view())
}

/// Objects in `relation` to an identity, nearest first.
pub(crate) fn neighbors(world: &dyn World, id: IdentityId, relation: Relation) -> Vec<IdentityId> {
    let (all, space) = (world.identities(), space(world));
    let mut found: Vec<(f64, IdentityId)> = Vec::new();
    for (other, _) in all.iter().filter(|(_, i)| i.level == Level::Object && i.parent == NO_IDENTITY) {
        let holds = space.share(relation, other, id).is_some_and(|share| share >= HOLDS[0]);
        if holds && world.facts(other).is_some() {
            found.push((space.gap(other, id).unwrap_or(f64::INFINITY), other));
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.into_iter().map(|(_, id)| id).collect()
}

/// Describes the place of a thing by its support and its neighbors; empty if nothing is near.
pub(crate) fn place(world: &dyn World, id: IdentityId) -> String {
    let object = world.identities().object_of(id);
    let space = space(world);
    let others = || {
        world.identities().iter().filter(|(i, o)| o.parent == NO_IDENTITY && *i != object && world.facts(*i).is_some())
    };
    let holds = |relation, other| space.share(relation, object, other).is_some_and(|share| share >= HOLDS[0]);
    let bearer = others().map(|(i, _)| i).find(|i| space.rests(object, *i, 1));
    // A smaller thing above is not mentioned: a table is not "under" its mugs.
    let radius = |id| space.shapes.get(id).map_or(0.0, |s| s.bounds.radius());
    let over = others().map(|(i, _)| i).find(|i| radius(*i) > radius(object) && holds(Relation::Under, *i));
    let mut said: Vec<String> = bearer.map(|id| format!("on {}", the(world, id))).into_iter().collect();
    said.extend(over.map(|id| format!("under {}", the(world, id))));
    for (relation, words) in [(Relation::RightOf, "left of"), (Relation::LeftOf, "right of")] {
        let near = |id: &IdentityId| Some(*id) != bearer && Some(*id) != over && beside(&space, object, *id);
        let next = neighbors(world, object, relation).into_iter().find(near);
        said.extend(next.map(|id| format!("{words} {}", the(world, id))));
    }
    format::list(&said)
}

/// Returns whether a thing is beside another and not rather behind or above it.
fn beside(space: &Space<'_>, object: IdentityId, other: IdentityId) -> bool {
    let Some((a, b)) = space.shapes.get(object).zip(space.shapes.get(other)) else { return false };
    let axes = space.axes();
    let off = |axis| {
        let (a, b) = (a.span(axis), b.span(axis));
        ((a.0 + a.1 - b.0 - b.1) * 0.5, (a.0 - b.1).max(b.0 - a.1).max(0.0))
    };
    let (sideways, _) = off(axes.right);
    [axes.ahead, axes.up].into_iter().all(|axis| off(axis).1 <= 1.5 * sideways.abs())
}

/// Describes one thing in full.
pub(crate) fn thing(world: &dyn World, id: IdentityId) -> String {
    let Some(facts) = world.facts(id) else { return "It is not in the scene.".into() };
    let all = world.identities();
    let name = the(world, id);
    let level = if facts.level == Level::Object { "an object" } else { "a part" };
    let mut text = format!("{} is {level}", capital(&name));
    let pieces: Vec<IdentityId> = all.children(id).filter(|p| world.facts(*p).is_some()).collect();
    if !pieces.is_empty() {
        let word = if pieces.len() == 1 { "one part".into() } else { format!("{} parts", pieces.len()) };
        text += &format!(" with {word}: {}", names(world, &pieces, 10));
    }
    text += ".";
    if facts.bounds.is_some() {
        text += &format!(" It is {}.", size(world, id));
    }
    let place = place(world, id);
    if !place.is_empty() {
        text += &format!(" It is {place}.");
    }
    if facts.hidden {
        text += " It is hidden now.";
    } else if facts.in_view > SEEN {
        text += &format!(" It covers {} % of the view.", short((facts.in_view * 1000.0).round() / 10.0));
    } else {
        text += " It is not in view.";
    }
    if facts.names.len() > 1 {
        text += &format!(" It is also called {}.", format::list(&facts.names[1..]));
    }
    text
}

/// Says which thing is the most of its kind, if a phrase asks for that: "The green book is the largest book."
pub(crate) fn ranked(world: &dyn World, id: IdentityId, phrase: &str) -> Option<String> {
    let words = phrase.strip_prefix("the ").unwrap_or(phrase);
    let is_most = LanguageWords::get().order(words.split_once(' ')?.0).is_some_and(|order| order.superlative);
    is_most.then(|| format!("{} is the {words}.", capital(&the(world, id))))
}

/// Joins the description of a thing with a note on how it was found. A note that answers what was asked comes first.
pub(crate) fn noted(world: &dyn World, id: IdentityId, text: &str, note: &str) -> String {
    let it = format!("{} is ", capital(&the(world, id)));
    match note.starts_with(&it) {
        true => format!("{note} {}", text.replacen(&it, "It is ", 1)),
        false => format!("{text} {note}"),
    }
}

/// Objects in the current view, largest share first.
pub(crate) fn in_view(world: &dyn World) -> Vec<IdentityId> {
    let mut seen: Vec<(f64, IdentityId)> = Vec::new();
    for (id, _) in world.identities().iter().filter(|(_, i)| i.level == Level::Object) {
        if let Some(facts) = world.facts(id).filter(|f| !f.hidden && f.in_view > SEEN) {
            seen.push((facts.in_view, id));
        }
    }
    seen.sort_by(|a, b| b.0.total_cmp(&a.0));
    seen.into_iter().map(|(_, id)| id).collect()
}

/// Describes the current view.
pub(crate) fn view(world: &dyn World) -> String {
    let seen = in_view(world);
    match seen.as_slice() {
        [] => "Nothing in view has a name or number; move back or to the side to see more.".into(),
        [only] => format!("You are looking at {}.", the(world, *only)),
        [most, rest @ ..] => {
            format!("You are looking at {}; also in view: {}.", the(world, *most), names(world, rest, 12))
        }
    }
}
