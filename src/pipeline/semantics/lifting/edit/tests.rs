//! Edits, each on two dolls and a blob.

use super::*;
use crate::scene::LanguageFeatures;

/// Two dolls of 20 Gaussians each with 10 more as an eye, and a blob of 20 in two places.
fn scene() -> (SemanticMap, GaussianCloud) {
    let mut all = Identities::default();
    let red = all.add(Level::Object, NO_IDENTITY, vec!["red doll".into()]);
    let red_eye = all.add(Level::Part, red, vec!["eye".into()]);
    let blue = all.add(Level::Object, NO_IDENTITY, vec!["blue doll".into()]);
    let blue_eye = all.add(Level::Part, blue, vec!["eye".into()]);
    codes::assign(&mut all, &[]);
    let of = [vec![red; 20], vec![red_eye; 10], vec![blue; 20], vec![blue_eye; 10]].concat();
    let n = of.len();
    let place = |i: usize| if i < 10 { [i as f32 * 0.01, 0.0, 0.0] } else { [5.0 + i as f32 * 0.01, 0.0, 0.0] };
    let cloud = GaussianCloud::isotropic((0..n).map(place).collect(), -4.0, 0.0);
    let mut map = SemanticMap::from_identities(all, of, vec![1.0; n], vec![]);
    map.language =
        Some(LanguageFeatures { encoder: "t".into(), dimension: 1, by_identity: vec![ViewFeatures::default(); 4] });
    map.findings = Some(SegmentationReport::new(vec![], vec![Default::default(); 4], vec![]));
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
fn what_is_dissolved_is_its_wholes_or_nobodys() {
    let (map, cloud) = scene();
    let new = apply(&map, &cloud, &Edit::Dissolve(1)).expect("dissolved");
    check(&new);
    assert_eq!((new.identities.len(), new.sizes()), (2, vec![30, 30, 10]));
    assert_eq!(new.identities.full_name(2), "eye · blue doll");
    assert!(new.identities.removed.is_empty(), "it is not removed from the scene");
    let new = apply(&map, &cloud, &Edit::Dissolve(2)).expect("a part goes back into its whole");
    check(&new);
    assert_eq!((new.identities.len(), new.sizes()[1]), (3, 30));
    assert_eq!(apply(&map, &cloud, &Edit::Dissolve(9)), Err(EditError::Unknown(9)));
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
        new.identity_of[..10].iter().all(|id| *id == new.identity_of[0]) && new.identity_of[0] != new.identity_of[10]
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
    let new = add(NO_IDENTITY, 25..35).expect("an object may take what is somebody's");
    check(&new);
    assert_eq!((new.sizes()[5], new.sizes()[1], new.sizes()[3]), (10, 25, 25));
}

#[test]
fn a_reshaped_identity_consists_of_what_was_selected() {
    let (map, cloud) = scene();
    let reshape = |id, gaussians: std::ops::Range<u32>| {
        apply(&map, &cloud, &Edit::Reshape { id, gaussians: gaussians.collect() })
    };
    // The red doll without its first five and with ten of the blue one's; its eye stays its eye.
    let new = reshape(1, 5..40).expect("reshaped");
    check(&new);
    assert_eq!((new.sizes()[0], new.sizes()[1], new.sizes()[2], new.sizes()[3]), (5, 35, 10, 20));
    assert!(new.identity_of[..5].iter().all(|id| *id == NO_IDENTITY) && new.identity_of[35] == 1);
    // Gaussians that a part loses stay with its whole.
    let new = reshape(2, 25..30).expect("reshaped");
    check(&new);
    assert_eq!((new.sizes()[1], new.sizes()[2]), (30, 5));
    assert_eq!(reshape(9, 0..1), Err(EditError::Unknown(9)));
    assert_eq!(reshape(1, 0..0), Err(EditError::Nothing));
}

#[test]
fn a_new_code_is_far_from_all_others() {
    let (map, cloud) = scene();
    let new = apply(&map, &cloud, &Edit::AddPiece { of: 1, name: " ".into(), gaussians: vec![0, 1] }).expect("added");
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
