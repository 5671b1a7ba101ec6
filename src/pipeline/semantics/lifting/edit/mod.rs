//! Edits of a semantic map: names, merges, splits, new parts. An edit makes a new map; the old one stays, so that it
//! can be undone.

use glam::Vec3;
use rstar::RTree;
use rstar::primitives::GeomWithData;
use serde::{Deserialize, Serialize};

use super::codes::{self, RADIUS};
use crate::math::stats::median;
use crate::scene::{
    GaussianCloud, Identities, IdentityId, Level, NO_IDENTITY, SegmentationReport, SemanticMap, ViewFeatures,
};

/// An edit.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Edit {
    /// Gives an identity another first name; the old one still finds it.
    Rename(IdentityId, String),
    /// The first becomes the second, with all its pieces.
    Merge(IdentityId, IdentityId),
    /// Splits an identity into its connected components; if there is only one, into two halves.
    Split(IdentityId),
    /// Ends an identity and its parts. Its Gaussians are its whole's, or nobody's.
    Dissolve(IdentityId),
    /// Makes these Gaussians, as far as they belong to the identity, a new piece of it. Of nobody: a new object,
    /// whatever their labels were.
    AddPiece {
        /// Identity that gets the piece.
        of: IdentityId,
        /// Name of the piece; may be empty.
        name: String,
        /// Indices of Gaussians.
        gaussians: Vec<u32>,
    },
    /// Gives the identity exactly these Gaussians: it takes missing ones, and surplus ones go to its whole.
    Reshape {
        /// Identity to be reshaped.
        id: IdentityId,
        /// Indices of Gaussians.
        gaussians: Vec<u32>,
    },
}

/// Reasons for which an edit is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum EditError {
    #[error("there is no object or part number {0}")]
    Unknown(IdentityId),
    #[error("a name needs at least one letter or digit")]
    NoName,
    #[error("'{0}' and '{1}' cannot become one: one is the other, or a piece of it")]
    Related(String, String),
    #[error("'{name}' has {own} Gaussians; a split needs at least {}", 2 * LEAST)]
    TooSmall { name: String, own: usize },
    #[error("'{name}' consists of its parts: only {own} of its {all} Gaussians are its own; split one of the parts")]
    OfParts { name: String, own: usize, all: usize },
    #[error("nothing is selected; click on something that is visible")]
    Nothing,
    #[error("the scene has no such Gaussians; it may have changed since they were selected")]
    NotThere,
    #[error("what you selected is not a piece of '{0}'; select inside it")]
    Outside(String),
    #[error("'{0}' is empty: no Gaussians belong to it; undo what took them, correct it by clicks, or merge it")]
    Empty(String),
}

/// Returns the map after an edit.
///
/// # Errors
/// If the edit makes no sense; the map is as it was.
pub(crate) fn apply(map: &SemanticMap, cloud: &GaussianCloud, edit: &Edit) -> Result<SemanticMap, EditError> {
    let all = &map.identities;
    let known = |id: IdentityId| if all.get(id).is_some() { Ok(id) } else { Err(EditError::Unknown(id)) };
    let mut new = map.clone();
    match edit {
        Edit::Rename(id, name) => {
            let name = name.trim();
            if !name.chars().any(char::is_alphanumeric) {
                return Err(EditError::NoName);
            }
            new.identities.rename(known(*id)?, name);
            new.identities.mark_by_hand(*id);
        }
        Edit::Merge(from, into) => {
            let (from, into) = (known(*from)?, known(*into)?);
            if all.descendants(from)[into as usize] {
                return Err(EditError::Related(all.name(from), all.name(into)));
            }
            let into = merge(&mut new, from, into);
            new.identities.mark_by_hand(into);
        }
        Edit::Split(id) => {
            let own: Vec<usize> = (0..map.identity_of.len()).filter(|&i| map.identity_of[i] == *id).collect();
            let (name, whole) = (all.name(known(*id)?), map.members(*id).len());
            let too_small = || match own.len() {
                own if whole > own => EditError::OfParts { name, own, all: whole },
                0 => EditError::Empty(name),
                own => EditError::TooSmall { name, own },
            };
            let parts = pieces(cloud, &own).ok_or_else(too_small)?;
            let (level, parent) = all.get(*id).map_or((Level::Object, NO_IDENTITY), |i| (i.level, i.parent));
            new.identities.mark_by_hand(*id);
            for part in parts.iter().skip(1) {
                let part = add(&mut new, level, parent, String::new(), part);
                new.identities.mark_by_hand(part);
            }
            // The photos that show each of the pieces were not recorded.
            new.findings.iter_mut().for_each(|f| f.forget_seen(*id));
        }
        Edit::Dissolve(id) => {
            let whole = all.get(known(*id)?).map_or(NO_IDENTITY, |i| i.parent);
            let inside = all.descendants(*id);
            for i in map.members(*id) {
                (new.identity_of[i], new.codes[i]) = (whole, all.codes(whole));
            }
            renumber(&mut new, |id| inside.get(id as usize) == Some(&true), None);
        }
        Edit::AddPiece { of, name, gaussians } => {
            let inside = if *of == NO_IDENTITY { Vec::new() } else { all.descendants(known(*of)?) };
            let is = |id: &IdentityId| *of == NO_IDENTITY || inside.get(*id as usize) == Some(&true);
            let is_in = |i: &usize| map.identity_of.get(*i).is_some_and(is);
            let own: Vec<usize> = gaussians.iter().map(|i| *i as usize).filter(is_in).collect();
            if own.is_empty() {
                return Err(match (gaussians.is_empty(), *of) {
                    (true, _) => EditError::Nothing,
                    (_, NO_IDENTITY) => EditError::NotThere,
                    (_, of) if map.members(of).is_empty() => EditError::Empty(all.name(of)),
                    (_, of) => EditError::Outside(all.name(of)),
                });
            }
            let level = if *of == NO_IDENTITY { Level::Object } else { Level::Part };
            let piece = add(&mut new, level, *of, name.trim().to_owned(), &own);
            new.identities.mark_by_hand(piece);
        }
        Edit::Reshape { id, gaussians } => {
            if gaussians.is_empty() {
                return Err(EditError::Nothing);
            }
            reshape(&mut new, known(*id)?, gaussians);
            new.identities.mark_by_hand(*id);
        }
    }
    if !matches!(edit, Edit::Rename(..)) {
        new.look_at(cloud);
    }
    Ok(new)
}

fn reshape(map: &mut SemanticMap, id: IdentityId, gaussians: &[u32]) {
    let mut listed = vec![false; map.identity_of.len()];
    for &i in gaussians {
        if let Some(listed) = listed.get_mut(i as usize) {
            *listed = true;
        }
    }
    for (i, now) in reshaped(map, id, &listed).into_iter().enumerate() {
        if map.identity_of[i] != now {
            (map.identity_of[i], map.codes[i]) = (now, map.identities.codes(now));
        }
    }
}

/// Returns the labels of all Gaussians once an identity has exactly the listed ones. Those of its parts keep theirs.
pub(crate) fn reshaped(map: &SemanticMap, id: IdentityId, listed: &[bool]) -> Vec<IdentityId> {
    let inside = map.identities.descendants(id);
    let whole = map.identities.get(id).map_or(NO_IDENTITY, |i| i.parent);
    let label = |(of, is_listed): (&IdentityId, &bool)| {
        let has = inside.get(*of as usize) == Some(&true);
        match (has, *is_listed) {
            (false, true) => id,
            (true, false) => whole,
            _ => *of,
        }
    };
    map.identity_of.iter().zip(listed).map(label).collect()
}

/// Adds an identity of these Gaussians, whatever their labels were; returns its number.
pub(crate) fn add(
    map: &mut SemanticMap,
    level: Level,
    parent: IdentityId,
    name: String,
    gaussians: &[usize],
) -> IdentityId {
    let code = free_code(&map.identities);
    let id = map.identities.add(level, parent, Some(name).filter(|n| !n.is_empty()).into_iter().collect());
    if let Some(identity) = map.identities.get_mut(id) {
        identity.code = code;
    }
    if let Some(language) = &mut map.language {
        language.by_identity.push(ViewFeatures::default());
    }
    map.findings.iter_mut().for_each(SegmentationReport::add_identity);
    let codes = map.identities.codes(id);
    for &i in gaussians {
        (map.identity_of[i], map.codes[i]) = (id, codes);
    }
    id
}

/// Returns the point of the code sphere that is farthest from all codes in use.
pub(super) fn free_code(identities: &Identities) -> [f32; 3] {
    let taken: Vec<Vec3> = identities.iter().map(|(_, i)| Vec3::from(i.code)).collect();
    let points = codes::sphere(2 * taken.len() + 8).into_iter().map(|p| p * RADIUS + Vec3::splat(0.5));
    let far = |p: &Vec3| taken.iter().map(|t| t.distance_squared(*p)).fold(f32::INFINITY, f32::min);
    points.max_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(Vec3::ONE).to_array()
}

/// Merges `from` into `into`; returns the number of `into`, which may change because there is one identity less.
fn merge(map: &mut SemanticMap, from: IdentityId, into: IdentityId) -> IdentityId {
    renumber(map, |id| id == from, Some((from, into)))[into as usize]
}

/// Returns the identities that an edit left without Gaussians, if the edit changed no numbers.
pub(crate) fn emptied(before: &SemanticMap, after: &SemanticMap) -> Vec<IdentityId> {
    let (before, after) = (before.sizes(), after.sizes());
    let is_empty = |id: &usize| before[*id] > 0 && after.get(*id) == Some(&0);
    (1..before.len()).filter(is_empty).map(|id| id as IdentityId).collect()
}

/// Returns the map without these identities and their pieces, whose Gaussians become unlabeled, and the new number of
/// each identity.
pub(crate) fn forget(map: &SemanticMap, ids: &[IdentityId]) -> (SemanticMap, Vec<IdentityId>) {
    let inside: Vec<Vec<bool>> = ids.iter().map(|id| map.identities.descendants(*id)).collect();
    let mut new = map.clone();
    let is_gone = |id: IdentityId| inside.iter().any(|all| all.get(id as usize) == Some(&true));
    let number = renumber(&mut new, is_gone, None);
    let gone = map.identities.iter().filter(|(id, _)| is_gone(*id)).flat_map(|(_, i)| i.names.clone());
    new.identities.removed.extend(gone);
    (new, number)
}

/// Removes the identities that are `gone`; if one became another (`merged`: from, into), the latter gets its pieces
/// and Gaussians. Returns the new number of each.
pub(super) fn renumber(
    map: &mut SemanticMap,
    gone: impl Fn(IdentityId) -> bool,
    merged: Option<(IdentityId, IdentityId)>,
) -> Vec<IdentityId> {
    let old = std::mem::take(&mut map.identities);
    map.identities.removed.clone_from(&old.removed);
    let codes_before: Vec<_> = (0..=old.len() as IdentityId).map(|id| old.codes(id)).collect();
    // Wholes before pieces, whatever the numbers were.
    let parent_of = |id: IdentityId| -> IdentityId {
        let parent = old.get(id).map_or(NO_IDENTITY, |i| i.parent);
        merged.filter(|(from, _)| *from == parent).map_or(parent, |(_, into)| into)
    };
    let depth = |id: IdentityId| {
        std::iter::successors(Some(id), |&i| Some(parent_of(i)).filter(|p| *p != NO_IDENTITY)).take(old.len()).count()
    };
    let mut order: Vec<IdentityId> = old.iter().map(|(id, _)| id).filter(|id| !gone(*id)).collect();
    order.sort_by_key(|id| (depth(*id), *id));
    let mut number = vec![NO_IDENTITY; old.len() + 1];
    let mut features = Vec::new();
    for &id in &order {
        let Some(identity) = old.get(id) else { continue };
        let mut names = identity.names.clone();
        if let Some((from, _)) = merged.filter(|(_, into)| *into == id) {
            let others = old.get(from).map(|i| i.names.clone()).unwrap_or_default();
            names.extend(others.into_iter().filter(|n| !identity.names.contains(n)));
        }
        number[id as usize] = map.identities.add(identity.level, number[parent_of(id) as usize], names);
        if let Some(new) = map.identities.get_mut(number[id as usize]) {
            (new.code, new.by_hand) = (identity.code, identity.by_hand);
        }
        features.extend(map.language.as_ref().map(|l| l.by_identity.get(id as usize - 1).cloned().unwrap_or_default()));
    }
    if let Some((from, into)) = merged {
        number[from as usize] = number[into as usize];
    }
    if let Some(language) = &mut map.language {
        language.by_identity = features;
    }
    map.findings.iter_mut().for_each(|f| f.renumber(&number, map.identities.len()));
    for (of, codes) in map.identity_of.iter_mut().zip(&mut map.codes) {
        let before = *of as usize;
        *of = number.get(before).copied().unwrap_or(NO_IDENTITY);
        let now = map.identities.codes(*of);
        // Trained codes of unchanged identities are kept.
        if codes_before.get(before) != Some(&now) {
            *codes = now;
        }
    }
    number
}

/// Least number of Gaussians of a component; smaller ones stay with the largest.
const LEAST: usize = 8;

/// Returns the connected components of the Gaussians `own`, largest first; two halves if there is one component.
/// `None` if there are too few Gaussians.
fn pieces(cloud: &GaussianCloud, own: &[usize]) -> Option<Vec<Vec<usize>>> {
    if own.len() < 2 * LEAST {
        return None;
    }
    let place = |i: usize| cloud.positions[i].map(f64::from);
    let tree = RTree::bulk_load(own.iter().enumerate().map(|(k, &i)| GeomWithData::new(place(i), k)).collect());
    let near = |k: usize, n: usize| tree.nearest_neighbor_iter_with_distance_2(place(own[k])).skip(1).take(n);
    let spacing: Vec<f64> = (0..own.len()).filter_map(|k| near(k, 1).next()).map(|(_, d)| d.sqrt()).collect();
    let reach = 6.0 * median(&spacing).max(f64::MIN_POSITIVE);
    let mut component = vec![usize::MAX; own.len()];
    let mut found: Vec<Vec<usize>> = Vec::new();
    for first in 0..own.len() {
        if component[first] != usize::MAX {
            continue;
        }
        let mut open = vec![first];
        component[first] = found.len();
        let mut members = Vec::new();
        while let Some(k) = open.pop() {
            members.push(own[k]);
            for neighbor in tree.locate_within_distance(place(own[k]), reach * reach).map(|p| p.data) {
                if component[neighbor] == usize::MAX {
                    component[neighbor] = found.len();
                    open.push(neighbor);
                }
            }
        }
        found.push(members);
    }
    found.sort_by_key(|m| std::cmp::Reverse(m.len()));
    let (mut large, small): (Vec<_>, Vec<_>) = found.into_iter().partition(|m| m.len() >= LEAST);
    if large.len() < 2 {
        return Some(halves(own, place));
    }
    large[0].extend(small.into_iter().flatten());
    Some(large)
}

/// Splits the Gaussians into two halves along the axis of largest spread.
fn halves(own: &[usize], place: impl Fn(usize) -> [f64; 3]) -> Vec<Vec<usize>> {
    let spread = |axis: usize| {
        let v: Vec<f64> = own.iter().map(|&i| place(i)[axis]).collect();
        let mean = crate::math::stats::mean(&v);
        v.iter().map(|x| (x - mean).powi(2)).sum::<f64>()
    };
    let axis = (0..3).max_by(|&a, &b| spread(a).total_cmp(&spread(b))).unwrap_or(0);
    let middle = median(&own.iter().map(|&i| place(i)[axis]).collect::<Vec<_>>());
    let (low, high) = own.iter().partition(|&&i| place(i)[axis] <= middle);
    vec![low, high]
}

#[cfg(test)]
mod tests;
