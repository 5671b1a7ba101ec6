//! Lists, counts and measurements, in words.

use super::describe::{self, length, the};
use super::dialog::DialogState;
use super::refusal::{Refusal, RefusalKind};
use super::relation::Relation;
use super::resolve::resolve_all;
use super::tool::Reference;
use super::world::World;
use crate::math::format::capital;
use crate::pipeline::semantics::query::language::relations::HOLDS;
use crate::scene::{IdentityId, LevelFilter, NO_IDENTITY};

/// Identities to list or count.
pub(super) fn list_ids(
    world: &mut dyn World,
    filter: LevelFilter,
    of: IdentityId,
    relation: Relation,
    named: Option<&str>,
) -> Result<Vec<IdentityId>, Refusal> {
    let named = match named.map(|name| resolve_all(world, name, LevelFilter::Auto, &DialogState::default())) {
        // An empty list is an answer, not a refusal.
        Some(Err(refusal)) if refusal.kind == RefusalKind::Conflict => Some(Vec::new()),
        Some(found) => Some(found?),
        None => None,
    };
    let all = world.identities();
    let inside = all.descendants(of);
    let is_piece = |id: &IdentityId| *id != of && inside.get(*id as usize) == Some(&true);
    if of != NO_IDENTITY && relation != Relation::PartOf {
        // Named things may be parts: the buttons on a controller, the handles on the table.
        let Some(named) = named else { return Ok(describe::neighbors(world, of, relation)) };
        let space = describe::space(world);
        let stands = |id: &IdentityId| {
            let bearer = all.ancestors(of).any(|whole| whole == *id);
            let holds = || space.share(relation, *id, of).is_some_and(|share| share >= HOLDS[0]);
            !bearer && if is_piece(id) { matches!(relation, Relation::On | Relation::In) } else { holds() }
        };
        return Ok(named.into_iter().filter(stands).collect());
    }
    let is_listed = |id: &IdentityId, level| if of == NO_IDENTITY { filter.accepts(level) } else { is_piece(id) };
    let ids = all.iter().filter(|(id, i)| is_listed(id, i.level)).map(|(id, _)| id);
    let is_named = |id: &IdentityId| named.as_ref().is_none_or(|named| named.contains(id));
    Ok(ids.filter(|id| is_named(id) && world.facts(*id).is_some()).collect())
}

/// Describes a list in words.
pub(super) fn say_list(
    world: &dyn World,
    ids: &[IdentityId],
    level: LevelFilter,
    of: IdentityId,
    relation: Relation,
    named: Option<&str>,
) -> String {
    let here = match (of, relation) {
        (NO_IDENTITY, _) => "in the scene".into(),
        (of, Relation::PartOf) => format!("of {}", the(world, of)),
        (of, relation) => format!("{} {}", relation.text(), the(world, of)),
    };
    let what = named.unwrap_or(match (level, relation) {
        (LevelFilter::Object, _) => "objects",
        (LevelFilter::Part, _) | (_, Relation::PartOf) if of != NO_IDENTITY => "parts",
        (LevelFilter::Part, _) => "parts",
        _ => "things",
    });
    let listed = describe::names(world, ids, 20);
    match ids.len() {
        0 => format!("I know no {what} {here}."),
        1 => format!("There is 1 {} {here}: {listed}.", super::words::singular(what)),
        n => format!("There are {n} {what} {here}: {listed}."),
    }
}

/// Describes a size or a distance.
pub(super) fn measure(
    world: &dyn World,
    id: IdentityId,
    to: Option<&Reference>,
    other: Option<IdentityId>,
) -> Result<String, Refusal> {
    let nothing = || Refusal::new(RefusalKind::Conflict, "It has no Gaussians to measure.");
    let own = world.facts(id).and_then(|f| f.bounds).ok_or_else(nothing)?;
    let it = capital(&the(world, id));
    Ok(match to {
        None => format!("{it} is {}.", describe::size(world, id)),
        Some(Reference::Eye) => {
            let far = own.center().distance(world.view().eye);
            format!("{it} is {} from here.", length(world, far))
        }
        Some(Reference::Thing(_)) => {
            let other = other.ok_or_else(nothing)?;
            let bounds = world.facts(other).and_then(|f| f.bounds).ok_or_else(nothing)?;
            let free = describe::space(world).gap(id, other).unwrap_or(0.0);
            let middle = own.center().distance(bounds.center());
            let name = the(world, other);
            let free = match free > 0.0 {
                true => format!("{} between the nearest points", length(world, free)),
                false => "touching".to_owned(),
            };
            format!("{it} and {name}: {} between the middles, {free}.", length(world, middle))
        }
    })
}
