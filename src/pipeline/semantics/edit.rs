//! Corrections by hand: names, merging, splitting, new parts. An edit makes a new map; the old one
//! stays, so that it can be undone.

use glam::Vec3;
use rstar::RTree;
use rstar::primitives::GeomWithData;

use super::codes::{self, RADIUS};
use crate::math::stats::median;
use crate::scene::{Findings, GaussianCloud, Identities, IdentityId, Level, NOBODY, SemanticMap, ViewFeatures};

/// A correction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Edit {
    /// Gives an identity another first name; the old one is still understood.
    Rename(IdentityId, String),
    /// The first becomes the second, with all its pieces.
    Merge(IdentityId, IdentityId),
    /// What does not hang together becomes identities of its own; what does is cut in two.
    Split(IdentityId),
    /// These Gaussians, as far as they belong to the identity, become a new piece of it. Of nobody,
    /// a new object, whosever they were.
    AddPiece {
        /// Whose piece.
        of: IdentityId,
        /// What it is called; may be empty.
        name: String,
        /// Indices of Gaussians.
        gaussians: Vec<u32>,
    },
    /// The identity consists of these Gaussians: what it lacks becomes its own, what it has too much becomes its
    /// whole's.
    Reshape {
        /// Which.
        id: IdentityId,
        /// Indices of Gaussians.
        gaussians: Vec<u32>,
    },
}

/// Why an edit cannot be made.
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
    #[error("what you selected is not a piece of '{0}'; select inside it")]
    Outside(String),
}

/// The map after an edit.
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
        }
        Edit::Merge(from, into) => {
            let (from, into) = (known(*from)?, known(*into)?);
            if all.descendants(from)[into as usize] {
                return Err(EditError::Related(all.name(from), all.name(into)));
            }
            merge(&mut new, from, into);
        }
        Edit::Split(id) => {
            let own: Vec<usize> = (0..map.identity_of.len()).filter(|&i| map.identity_of[i] == *id).collect();
            let (name, whole) = (all.name(known(*id)?), map.members(*id).len());
            let too_small = || match own.len() {
                own if whole > own => EditError::OfParts { name, own, all: whole },
                own => EditError::TooSmall { name, own },
            };
            let parts = pieces(cloud, &own).ok_or_else(too_small)?;
            let (level, parent) = all.get(*id).map_or((Level::Object, NOBODY), |i| (i.level, i.parent));
            for part in parts.iter().skip(1) {
                add(&mut new, level, parent, String::new(), part);
            }
            // Which photos show which of the pieces was not noticed.
            new.findings.iter_mut().for_each(|f| f.forget_seen(*id));
        }
        Edit::AddPiece { of, name, gaussians } => {
            let inside = if *of == NOBODY { Vec::new() } else { all.descendants(known(*of)?) };
            let is = |id: &IdentityId| *of == NOBODY || inside.get(*id as usize) == Some(&true);
            let is_in = |i: &usize| map.identity_of.get(*i).is_some_and(is);
            let own: Vec<usize> = gaussians.iter().map(|i| *i as usize).filter(is_in).collect();
            if own.is_empty() {
                return Err(if gaussians.is_empty() { EditError::Nothing } else { EditError::Outside(all.name(*of)) });
            }
            let level = if *of == NOBODY { Level::Object } else { Level::Part };
            add(&mut new, level, *of, name.trim().to_owned(), &own);
        }
        Edit::Reshape { id, gaussians } => {
            if gaussians.is_empty() {
                return Err(EditError::Nothing);
            }
            reshape(&mut new, known(*id)?, gaussians);
        }
    }
    Ok(new)
}

fn reshape(map: &mut SemanticMap, id: IdentityId, gaussians: &[u32]) {
    let inside = map.identities.descendants(id);
    let whole = map.identities.get(id).map_or(NOBODY, |i| i.parent);
    let mut listed = vec![false; map.identity_of.len()];
    for &i in gaussians {
        if let Some(listed) = listed.get_mut(i as usize) {
            *listed = true;
        }
    }
    for (i, is_listed) in listed.into_iter().enumerate() {
        let has = inside.get(map.identity_of[i] as usize) == Some(&true);
        // Its parts keep theirs.
        if has != is_listed {
            let now = if is_listed { id } else { whole };
            (map.identity_of[i], map.codes[i]) = (now, map.identities.codes(now));
        }
    }
}

fn add(map: &mut SemanticMap, level: Level, parent: IdentityId, name: String, gaussians: &[usize]) {
    let code = free_code(&map.identities);
    let id = map.identities.add(level, parent, Some(name).filter(|n| !n.is_empty()).into_iter().collect());
    if let Some(identity) = map.identities.get_mut(id) {
        identity.code = code;
    }
    if let Some(language) = &mut map.language {
        language.by_identity.push(ViewFeatures::default());
    }
    map.findings.iter_mut().for_each(Findings::add_identity);
    let codes = map.identities.codes(id);
    for &i in gaussians {
        (map.identity_of[i], map.codes[i]) = (id, codes);
    }
}

/// The point of the code sphere that is farthest from all codes that are taken.
fn free_code(identities: &Identities) -> [f32; 3] {
    let taken: Vec<Vec3> = identities.iter().map(|(_, i)| Vec3::from(i.code)).collect();
    let points = codes::sphere(2 * taken.len() + 8).into_iter().map(|p| p * RADIUS + Vec3::splat(0.5));
    let far = |p: &Vec3| taken.iter().map(|t| t.distance_squared(*p)).fold(f32::INFINITY, f32::min);
    points.max_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(Vec3::ONE).to_array()
}

/// `from` becomes `into`. Numbers change, because there is one identity less.
fn merge(map: &mut SemanticMap, from: IdentityId, into: IdentityId) {
    let old = std::mem::take(&mut map.identities);
    let codes_before: Vec<_> = (0..=old.len() as IdentityId).map(|id| old.codes(id)).collect();
    // Wholes before pieces, whatever the numbers were.
    let parent_of = |id: IdentityId| -> IdentityId {
        let parent = old.get(id).map_or(NOBODY, |i| i.parent);
        if parent == from { into } else { parent }
    };
    let depth = |id: IdentityId| {
        std::iter::successors(Some(id), |&i| Some(parent_of(i)).filter(|p| *p != NOBODY)).take(old.len()).count()
    };
    let mut order: Vec<IdentityId> = old.iter().map(|(id, _)| id).filter(|id| *id != from).collect();
    order.sort_by_key(|id| (depth(*id), *id));
    let mut number = vec![NOBODY; old.len() + 1];
    let mut features = Vec::new();
    for &id in &order {
        let Some(identity) = old.get(id) else { continue };
        let mut names = identity.names.clone();
        if id == into {
            let others = old.get(from).map(|i| i.names.clone()).unwrap_or_default();
            names.extend(others.into_iter().filter(|n| !identity.names.contains(n)));
        }
        number[id as usize] = map.identities.add(identity.level, number[parent_of(id) as usize], names);
        if let Some(new) = map.identities.get_mut(number[id as usize]) {
            new.code = identity.code;
        }
        features.extend(map.language.as_ref().map(|l| l.by_identity.get(id as usize - 1).cloned().unwrap_or_default()));
    }
    number[from as usize] = number[into as usize];
    if let Some(language) = &mut map.language {
        language.by_identity = features;
    }
    map.findings.iter_mut().for_each(|f| f.renumber(&number, map.identities.len()));
    for (of, codes) in map.identity_of.iter_mut().zip(&mut map.codes) {
        let before = *of as usize;
        *of = number.get(before).copied().unwrap_or(NOBODY);
        let now = map.identities.codes(*of);
        // Trained codes of those that stay what they were are kept.
        if codes_before.get(before) != Some(&now) {
            *codes = now;
        }
    }
}

/// Gaussians of a component that count; smaller ones stay with the largest.
const LEAST: usize = 8;

/// What hangs together among the Gaussians `own`, largest first; if all does, two halves. `None` if
/// there are too few.
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

/// Two halves of the Gaussians along the axis on which they spread most.
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
mod tests {
    use super::*;
    use crate::scene::LanguageFeatures;

    /// Two dolls of 20 Gaussians each with 10 more as an eye, and a blob of 20 in two places.
    fn scene() -> (SemanticMap, GaussianCloud) {
        let mut all = Identities::default();
        let red = all.add(Level::Object, NOBODY, vec!["red doll".into()]);
        let red_eye = all.add(Level::Part, red, vec!["eye".into()]);
        let blue = all.add(Level::Object, NOBODY, vec!["blue doll".into()]);
        let blue_eye = all.add(Level::Part, blue, vec!["eye".into()]);
        codes::assign(&mut all, &[]);
        let of = [vec![red; 20], vec![red_eye; 10], vec![blue; 20], vec![blue_eye; 10]].concat();
        let n = of.len();
        let place = |i: usize| if i < 10 { [i as f32 * 0.01, 0.0, 0.0] } else { [5.0 + i as f32 * 0.01, 0.0, 0.0] };
        let cloud = GaussianCloud::isotropic((0..n).map(place).collect(), -4.0, 0.0);
        let mut map = SemanticMap::from_identities(all, of, vec![1.0; n], vec![]);
        map.language =
            Some(LanguageFeatures { encoder: "t".into(), dimension: 1, by_identity: vec![ViewFeatures::default(); 4] });
        map.findings = Some(Findings::new(vec![], vec![Default::default(); 4], vec![]));
        (map, cloud)
    }

    fn check(map: &SemanticMap) {
        for (id, identity) in map.identities.iter() {
            assert!(identity.parent < id, "wholes come before their pieces");
        }
        let codes: Vec<_> = map.identity_of.iter().map(|id| map.identities.codes(*id)).collect();
        assert_eq!(map.codes, codes);
        assert!(map.language.as_ref().is_some_and(|l| l.is_valid(&map.identities)));
        assert!(map.findings.as_ref().is_some_and(|f| f.is_valid(&map.identities)), "they follow every edit");
    }

    #[test]
    fn renaming_keeps_the_old_name() {
        let (map, cloud) = scene();
        let new = apply(&map, &cloud, &Edit::Rename(1, " Rosa ".into())).expect("renamed");
        assert_eq!(new.identities.get(1).map(|i| i.names.clone()), Some(vec!["Rosa".into(), "red doll".into()]));
        assert_eq!(apply(&map, &cloud, &Edit::Rename(1, " - ".into())), Err(EditError::NoName));
        assert_eq!(apply(&map, &cloud, &Edit::Rename(9, "x".into())), Err(EditError::Unknown(9)));
        check(&new);
    }

    #[test]
    fn merged_identities_are_one_with_all_pieces() {
        let (map, cloud) = scene();
        for (from, into) in [(1, 3), (3, 1)] {
            let new = apply(&map, &cloud, &Edit::Merge(from, into)).expect("merged");
            check(&new);
            assert_eq!((new.identities.len(), new.sizes()[1]), (3, 60));
            assert_eq!(new.identities.children(1).count(), 2);
            assert_eq!(new.identities.get(1).map(|i| i.names.len()), Some(2), "both names are understood");
        }
        let new = apply(&map, &cloud, &Edit::Merge(2, 1)).expect("a part can go back into its whole");
        check(&new);
        assert_eq!((new.identities.len(), new.sizes()[1]), (3, 30));
        for (from, into) in [(1, 1), (1, 2)] {
            assert!(matches!(apply(&map, &cloud, &Edit::Merge(from, into)), Err(EditError::Related(..))));
        }
    }

    #[test]
    fn what_lies_apart_is_split_apart() {
        let (map, cloud) = scene();
        let new = apply(&map, &cloud, &Edit::Split(1)).expect("split");
        check(&new);
        assert_eq!((new.identities.len(), new.sizes()[5]), (5, 10));
        assert!(
            new.identity_of[..10].iter().all(|id| *id == new.identity_of[0])
                && new.identity_of[0] != new.identity_of[10]
        );
        // In one place: two halves.
        let new = apply(&map, &cloud, &Edit::Split(3)).expect("split");
        assert_eq!((new.sizes()[3], new.sizes()[5]), (20, 10), "its eye stays with it");
        let refused = |id| apply(&map, &cloud, &Edit::Split(id)).expect_err("too few").to_string();
        assert_eq!(refused(2), "'eye' has 10 Gaussians; a split needs at least 16");
        let mut of_parts = map.clone();
        of_parts.identity_of[..15].fill(2);
        let refused = apply(&of_parts, &cloud, &Edit::Split(1)).expect_err("its parts have them").to_string();
        assert!(refused.contains("only 5 of its 30 Gaussians are its own"), "{refused}");
        assert_eq!(apply(&map, &cloud, &Edit::Split(9)), Err(EditError::Unknown(9)));
    }

    #[test]
    fn a_piece_takes_only_what_belongs_to_its_whole() {
        let (map, cloud) = scene();
        let add = |of, gaussians: std::ops::Range<u32>| {
            apply(&map, &cloud, &Edit::AddPiece { of, name: "foot".into(), gaussians: gaussians.collect() })
        };
        let new = add(1, 15..40).expect("added");
        check(&new);
        assert_eq!((new.identities.name(5), new.sizes()[5]), ("foot".into(), 15));
        assert_eq!(add(1, 40..50), Err(EditError::Outside("red doll".into())));
        assert_eq!(add(1, 0..0), Err(EditError::Nothing));
        let new = add(NOBODY, 25..35).expect("an object may take what is somebody's");
        check(&new);
        assert_eq!((new.sizes()[5], new.sizes()[1], new.sizes()[3]), (10, 25, 25));
    }

    #[test]
    fn a_reshaped_identity_consists_of_what_was_selected() {
        let (map, cloud) = scene();
        let reshape = |id, gaussians: &[std::ops::Range<u32>]| {
            let gaussians = gaussians.iter().cloned().flatten().collect();
            apply(&map, &cloud, &Edit::Reshape { id, gaussians })
        };
        // The red doll without its first five and with ten of the blue one's; its eye stays its eye.
        let new = reshape(1, &[5..40]).expect("reshaped");
        check(&new);
        assert_eq!((new.sizes()[0], new.sizes()[1], new.sizes()[2], new.sizes()[3]), (5, 35, 10, 20));
        assert!(new.identity_of[..5].iter().all(|id| *id == NOBODY) && new.identity_of[35] == 1);
        // What a part loses stays with its whole.
        let new = reshape(2, &[25..30]).expect("reshaped");
        check(&new);
        assert_eq!((new.sizes()[1], new.sizes()[2]), (30, 5));
        assert_eq!(reshape(9, &[0..1]), Err(EditError::Unknown(9)));
        assert_eq!(reshape(1, &[]), Err(EditError::Nothing));
    }

    #[test]
    fn a_new_code_is_far_from_all_others() {
        let (map, cloud) = scene();
        let new =
            apply(&map, &cloud, &Edit::AddPiece { of: 1, name: " ".into(), gaussians: vec![0, 1] }).expect("added");
        let code = |id: u32| Vec3::from(new.identities.get(id).expect("there").code);
        assert!(((code(5) - Vec3::splat(0.5)).length() - RADIUS).abs() < 1e-5, "on the sphere");
        // Four codes are taken; a fifth can be a right angle from the nearest, nearly: 0.7 x 0.5 x 1.4.
        let nearest = (1..5).map(|id| code(id).distance(code(5))).fold(9.0, f32::min);
        assert!(nearest > 0.45, "{nearest}");
        assert!(new.identities.get(5).is_some_and(|i| i.names.is_empty()), "no name is none");
    }

    #[test]
    fn crumbs_stay_with_the_largest_and_halves_are_cut_across_the_longest_axis() {
        // 20 here, 10 there, 3 elsewhere.
        let place = |i: usize| match i {
            0..20 => [0.01 * i as f32, 0.0, 0.0],
            20..30 => [5.0, 0.01 * i as f32, 0.0],
            _ => [0.0, 9.0, 0.01 * i as f32],
        };
        let cloud = |n: usize, place: &dyn Fn(usize) -> [f32; 3]| GaussianCloud {
            positions: (0..n).map(place).collect(),
            ..GaussianCloud::default()
        };
        let own: Vec<usize> = (0..33).collect();
        let found = pieces(&cloud(33, &place), &own).expect("enough");
        let mut sizes: Vec<usize> = found.iter().map(Vec::len).collect();
        assert_eq!((sizes.as_slice(), found[1].iter().min()), (&[23, 10][..], Some(&20)));
        // Eight are a piece, seven are not.
        for (small, expected) in [(8, vec![20, 8]), (7, vec![14, 13])] {
            let all: Vec<usize> = (0..20 + small).collect();
            sizes = pieces(&cloud(20 + small, &place), &all).expect("enough").iter().map(Vec::len).collect();
            assert_eq!(sizes, expected);
        }
        assert!(pieces(&cloud(33, &place), &own[..15]).is_none());
        // Longest along y, although farther off along x.
        let long = |i: usize| [100.0, 0.1 * (i % 16) as f32, 0.01 * i as f32];
        let halves = pieces(&cloud(16, &long), &(0..16).collect::<Vec<_>>()).expect("enough");
        assert_eq!(halves, [(0..8).collect::<Vec<_>>(), (8..16).collect()]);
    }
}
