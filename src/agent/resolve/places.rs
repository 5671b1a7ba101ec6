//! Lookup of parts of a whole, of things by their place relative to another, and of one among several.

use super::noun::{Noun, Pick};
use super::{Candidates, Resolver, Unresolved, embedded};
use crate::agent::describe::{self, join, the};
use crate::agent::language::Key;
use crate::agent::refusal::RefusalKind;
use crate::agent::relation::gap;
use crate::pipeline::semantics::query::recipe::MatchBy;
use crate::scene::identity::whole_names::BETWEEN;
use crate::scene::{Bounds, IdentityId, LevelFilter};

/// Candidates among the parts of a whole.
pub(super) fn pieces(resolver: &mut Resolver<'_>, piece: &Noun, whole: &Noun) -> Result<Candidates, Unresolved> {
    let set = resolver.set(whole)?;
    let found = pieces_of(resolver, set.settled(), piece, whole);
    // The exact "bowl" may lack the part: another match, the fruit bowl, has the apple.
    match found {
        Err(unresolved) if set.ids.len() > set.settled().len() => {
            pieces_of(resolver, &set.ids, piece, whole).or(Err(unresolved))
        }
        found => found,
    }
}

fn pieces_of(
    resolver: &mut Resolver<'_>,
    wholes: &[IdentityId],
    piece: &Noun,
    whole: &Noun,
) -> Result<Candidates, Unresolved> {
    let all = resolver.world.identities();
    let mut inside = vec![false; all.len() + 1];
    for whole in wholes {
        all.descendants(*whole).iter().enumerate().for_each(|(i, is_in)| inside[i] |= *is_in);
    }
    // A whole is not a part of itself.
    wholes.iter().for_each(|id| inside[*id as usize] = false);
    let is_in = |id: &IdentityId| inside.get(*id as usize) == Some(&true);
    let known: Vec<IdentityId> =
        all.iter().map(|(id, _)| id).filter(is_in).filter(|id| resolver.world.facts(*id).is_some()).collect();
    let name = wholes.first().map(|id| all.full_name(*id)).unwrap_or_default();
    let said = match piece {
        Noun::Named(words) => words.join(" "),
        Noun::Called(name) => name.clone(),
        _ => "such piece".into(),
    };
    let level = std::mem::replace(&mut resolver.level, LevelFilter::Auto);
    let set = resolver.set(piece);
    resolver.level = level;
    if let Err(unresolved) = &set
        && unresolved.refusal.kind == RefusalKind::Failed
    {
        return set;
    }
    if let Ok(set) = set {
        let keep = |ids: Vec<IdentityId>| ids.into_iter().filter(is_in).collect::<Vec<_>>();
        let set = Candidates { ids: keep(set.ids), exact: keep(set.exact) };
        if !set.ids.is_empty() {
            return Ok(set);
        }
    }
    let of = match whole {
        Noun::Named(words) if resolver.world.match_by() == MatchBy::Embedding => words.join(" "),
        Noun::Called(name) => name.clone(),
        _ => name.clone(),
    };
    let text = [said.as_str(), &of].join(BETWEEN);
    let meant = embedded::candidates(resolver, &text, LevelFilter::Part)?.unwrap_or_default();
    let meant: Vec<IdentityId> = meant.into_iter().filter(is_in).collect();
    if !meant.is_empty() {
        return Ok(Candidates::new(meant));
    }
    let names: Vec<String> = known.iter().take(12).map(|id| resolver.world.identities().label(*id)).collect();
    let parts =
        if names.is_empty() { "no parts are known of it".into() } else { format!("its parts: {}", join(&names)) };
    let text = format!("The {name} has no '{said}' here; {parts}.");
    Err(Unresolved { is_open: true, ..Unresolved::new(RefusalKind::Conflict, text, known) })
}

/// Things with a `score` at the anchor, smallest first. Descendants and ancestors of the anchor are excluded.
pub(super) fn at(
    resolver: &mut Resolver<'_>,
    thing: &Noun,
    anchor: &Noun,
    what: &str,
    score: &dyn Fn(&Bounds, &Bounds) -> Option<f64>,
) -> Result<Candidates, Unresolved> {
    let anchor = resolver.anchor(anchor)?;
    let set = resolver.set(thing)?;
    let all = resolver.world.identities();
    let place = resolver.bounds(anchor);
    let apart = |id: &IdentityId| !all.ancestors(*id).any(|l| l == anchor) && !all.ancestors(anchor).any(|l| l == *id);
    let holds = |id: &IdentityId| score(&resolver.bounds(*id)?, place.as_ref()?).map(|s| (s, *id));
    let mut found: Vec<(f64, IdentityId)> = set.ids.iter().filter(|id| apart(id)).filter_map(holds).collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    if found.is_empty() {
        let text = format!("I find nothing like that {what}: I looked at {}.", the(resolver.world, anchor));
        return Err(Unresolved::new(RefusalKind::Conflict, text, Vec::new()));
    }
    let ids: Vec<IdentityId> = found.into_iter().map(|(_, id)| id).collect();
    let exact = set.exact.into_iter().filter(|id| ids.contains(id)).collect();
    Ok(Candidates { ids, exact })
}

/// Returns the first of things sorted by their gap to the anchor, with all that are equally near.
pub(super) fn alike_first(
    resolver: &mut Resolver<'_>,
    ids: &[IdentityId],
    anchor: &Noun,
) -> Result<Vec<IdentityId>, Unresolved> {
    let place = resolver.anchor(anchor).map(|id| resolver.bounds(id))?;
    let far = |id: &IdentityId| resolver.bounds(*id).zip(place).map_or(f64::INFINITY, |(b, p)| gap(&b, &p));
    let least = ids.first().map_or(0.0, far);
    Ok(ids.iter().copied().filter(|id| far(id) <= least + 1e-9).collect())
}

/// Returns the candidate that `pick` chooses; several if they are equal.
pub(super) fn picked(resolver: &mut Resolver<'_>, pick: Pick, of: &Noun) -> Result<Candidates, Unresolved> {
    let ids = resolver.set(of)?.ids;
    let (key, most) = match pick {
        Pick::Other => {
            let others: Vec<IdentityId> = ids.iter().copied().filter(|id| Some(*id) != resolver.dialog.last).collect();
            let told = others.len() < ids.len() && !others.is_empty();
            let unclear =
                || Unresolved::new(RefusalKind::Unclear, "I do not know which other one you mean.", ids.clone());
            return if told { Ok(Candidates::new(others)) } else { Err(unclear()) };
        }
        // A comparative needs two things: of three, "the left one" stays ambiguous.
        Pick::More(..) if ids.len() > 2 => return Ok(Candidates::new(ids)),
        Pick::Most(key, most) | Pick::More(key, most) => (key, most),
    };
    let values: Vec<(f64, IdentityId)> = ids.iter().filter_map(|id| Some((value(resolver, *id, key)?, *id))).collect();
    let sign = if most { -1.0 } else { 1.0 };
    let Some(best) = values.iter().map(|(v, _)| sign * v).min_by(f64::total_cmp) else {
        return Err(Unresolved::new(RefusalKind::Conflict, "Nothing here has a size or place to compare.", ids));
    };
    let slack = 1e-6 * best.abs().max(1e-6);
    Ok(Candidates::new(values.iter().filter(|(v, _)| sign * v <= best + slack).map(|(_, id)| *id).collect()))
}

fn value(resolver: &Resolver<'_>, id: IdentityId, key: Key) -> Option<f64> {
    let (view, bounds) = (resolver.world.view(), resolver.bounds(id)?);
    let frame = view.frame();
    let extent = || resolver.world.extent(id);
    match key {
        Key::Size => extent().map(|e| [e.length, e.width, e.height].map(|x| x.max(1e-9)).iter().product()),
        Key::Height => extent().map(|e| e.height),
        Key::Length => extent().map(|e| e.length),
        Key::Right => Some(bounds.center().dot(frame.right)),
        Key::Up => Some(bounds.center().dot(frame.up)),
        Key::Distance => Some(bounds.center().distance(view.eye)),
    }
}

/// Returns the candidates if there are exactly `count`.
pub(super) fn counted(resolver: &mut Resolver<'_>, count: usize, of: &Noun) -> Result<Candidates, Unresolved> {
    let ids = resolver.set(of)?.ids;
    if ids.len() == count && !resolver.looked {
        return Ok(Candidates::new(ids));
    }
    let listed = describe::names(resolver.world, &ids, 6);
    let text = match ids.len() {
        _ if resolver.looked => format!("By embedding, which is no count: {listed}. Say each by its name."),
        1 => format!("There is 1 of them here, not {count}: {listed}."),
        n => format!("There are {n} of them here, not {count}: {listed}."),
    };
    Err(Unresolved::new(RefusalKind::Conflict, text, ids))
}
