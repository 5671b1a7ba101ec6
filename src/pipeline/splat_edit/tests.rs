//! Edits of a mug with a handle on a table: moved, duplicated, recolored and deleted.

use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};

use super::*;
use crate::render::{Features, RenderSettings, Renderer};
use crate::scene::undo::UndoHistory;
use crate::scene::{Camera, Identities, LanguageFeatures, Level, ViewFeatures};

const MUG: IdentityId = 1;
const HANDLE: IdentityId = 2;
const TABLE: IdentityId = 3;

/// 60 Gaussians of the mug, of which 20 are its handle's, and 40 of the table, none of them round or gray.
fn scene() -> (GaussianCloud, SemanticMap) {
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(11);
    let mut v = |scale: f32| rng.random_range(-scale..scale);
    let mut cloud = GaussianCloud { origin: DVec3::new(10.0, -5.0, 2.0), sh_degree: 3, ..GaussianCloud::default() };
    let mut of = Vec::new();
    for i in 0..100 {
        let (at, id) = match i {
            0..40 => ([0.0, 0.0, 0.0], MUG),
            40..60 => ([0.5, 0.0, 0.0], HANDLE),
            _ => ([0.0, -1.0, 0.0], TABLE),
        };
        cloud.positions.push(at.map(|a| a + v(0.3)));
        cloud.log_scales.push([-2.5 + v(0.5), -2.5 + v(0.5), -2.5 + v(0.5)]);
        cloud.quaternions.push([v(1.0), v(1.0), v(1.0), v(1.0)]);
        cloud.opacity_logits.push(2.0);
        cloud.sh.push([v(1.5), v(1.5), v(1.5)]);
        cloud.sh.extend((1..16).map(|_| [v(0.2), v(0.2), v(0.2)]));
        of.push(id);
    }
    let mut all = Identities::default();
    let mug = all.add(Level::Object, NO_IDENTITY, vec!["mug".into(), "cup".into()]);
    all.add(Level::Part, mug, vec!["handle".into()]);
    all.add(Level::Object, NO_IDENTITY, vec!["table".into()]);
    let mut map = SemanticMap::from_identities(all, of, vec![0.8; 100], vec!["photo".into()]);
    let seen = |k: usize| ViewFeatures { raw: vec![vec![k as f32; 2]], deviated: vec![vec![-(k as f32); 2]] };
    let by_identity = (1..=3).map(seen).collect();
    map.language = Some(LanguageFeatures { encoder: "test".into(), dimension: 2, by_identity });
    (cloud, map)
}

fn done(edit: SplatEdit) -> (GaussianCloud, SemanticMap) {
    let (cloud, map) = scene();
    let (cloud, map) = apply(&cloud, Some(&map), &edit).expect("edited");
    cloud.validate().expect("finite");
    (cloud, map.expect("a map"))
}

fn moved(id: IdentityId, to: Placement) -> SplatEdit {
    SplatEdit::Arrange(Arrangement { to, ..Arrangement::of(id) })
}

fn doubled(id: IdentityId, to: Placement) -> SplatEdit {
    SplatEdit::Arrange(Arrangement { to, duplicate: true, ..Arrangement::of(id) })
}

fn recolored(id: IdentityId, color: [f32; 3]) -> SplatEdit {
    SplatEdit::Arrange(Arrangement { color: Some(color), ..Arrangement::of(id) })
}

fn placement() -> Placement {
    Placement {
        shift: DVec3::new(0.4, -0.2, 1.0),
        turn: DQuat::from_scaled_axis(DVec3::new(0.5, 1.2, -0.3)),
        scale: 1.7,
    }
}

/// Renders these Gaussians alone.
fn drawn(cloud: &GaussianCloud, of: &[usize], camera: &Camera) -> Vec<f32> {
    let settings = RenderSettings { sh_degree: 3, ..RenderSettings::default() };
    let frame = Renderer::new().render(&cloud.select(of), Features::NONE, camera, &settings).expect("a frame");
    frame.color.concat()
}

#[test]
fn what_is_moved_looks_as_it_did_from_where_the_camera_moves_with_it() {
    let (before, map) = scene();
    let thing = map.members(MUG);
    let to = placement();
    let (after, new) = done(moved(MUG, to));
    assert_eq!(new, map, "whose they are has not changed");
    let about = middle(&before, &thing);
    let there = |p: DVec3| about + to.scale * (to.turn * (p - about)) + to.shift;
    let eye = about + DVec3::new(0.5, 1.0, 3.0);
    let look = |eye: DVec3, at: DVec3, up: DVec3| Camera::look_at(eye, at, up, 0.7, 64, 48).expect("a camera");
    let (first, second) = (look(eye, about, DVec3::Y), look(there(eye), there(about), to.turn * DVec3::Y));
    let (a, b) = (drawn(&before, &thing, &first), drawn(&after, &thing, &second));
    let worst = crate::math::stats::worst_difference(&a, &b);
    assert!(worst < 2e-3, "{worst}");
    assert!(a.iter().any(|v| *v > 0.3), "something is seen");
    // The control: without rotated harmonics it looks different.
    let mut wrong = after.clone();
    wrong.sh.clone_from(&before.sh);
    assert!(crate::math::stats::worst_difference(&a, &drawn(&wrong, &thing, &second)) > 0.02);
    for i in map.members(TABLE) {
        assert_eq!((after.positions[i], after.quaternions[i]), (before.positions[i], before.quaternions[i]));
    }
    // A part alone.
    let (after, _) = done(moved(HANDLE, to));
    let changed: Vec<usize> = (0..100).filter(|&i| after.positions[i] != before.positions[i]).collect();
    assert_eq!(changed, map.members(HANDLE));
}

#[test]
fn a_duplicate_is_another_with_parts_of_its_own() {
    let (before, map) = scene();
    let (after, new) = done(doubled(MUG, Placement { shift: DVec3::X, ..Placement::default() }));
    assert_eq!((after.len(), new.identities.len(), new.identity_of.len()), (160, 5, 160));
    assert!(after.select(&(0..100).collect::<Vec<_>>()) == before, "the first is as it was");
    let (copy, handle) = (4, 5);
    assert_eq!(new.members(copy), (100..160).collect::<Vec<_>>());
    assert_eq!(new.members(handle), (140..160).collect::<Vec<_>>());
    let identity = new.identities.get(handle).expect("there");
    assert_eq!(
        (identity.parent, identity.level, identity.names.as_slice()),
        (copy, Level::Part, &["handle".into()][..])
    );
    assert_eq!(new.identities.get(copy).expect("there").names, ["mug", "cup"]);
    assert_eq!(new.codes[100], new.identities.codes(copy));
    assert_ne!(new.identities.codes(copy), new.identities.codes(MUG));
    let language = new.language.expect("kept");
    assert_eq!(language.by_identity[3], language.by_identity[0]);
    assert_eq!(language.by_identity[4], language.by_identity[1]);
    assert!(language.is_valid(&new.identities));
    let gap = after.world_position(100) - before.world_position(0);
    assert!((gap - DVec3::X).length() < 1e-6);
    // Another handle of the same mug.
    let (_, new) = done(doubled(HANDLE, Placement { shift: DVec3::X, ..Placement::default() }));
    assert_eq!(new.identities.get(4).expect("there").parent, MUG);
    assert_eq!((new.members(MUG).len(), map.members(MUG).len()), (80, 60));
}

#[test]
fn another_color_keeps_the_shades() {
    let (before, map) = scene();
    let (after, new) = done(recolored(MUG, [0.8, 0.2, 0.1]));
    assert_eq!(new, map);
    let shown = |cloud: &GaussianCloud, i: usize| cloud.sh[16 * i].map(|v| 0.5 + SH_C0 * f64::from(v));
    for i in map.members(MUG) {
        let [r, g, b] = shown(&after, i);
        assert!((r - 4.0 * g).abs() < 1e-5 && (r - 8.0 * b).abs() < 1e-5, "one hue: {r} {g} {b}");
        let bright = |c: [f64; 3]| BRIGHTNESS.iter().zip(c).map(|(w, v)| w * v).sum::<f64>();
        let ratio = bright(shown(&after, i)) / bright(shown(&before, i));
        let first = bright(shown(&after, 0)) / bright(shown(&before, 0));
        assert!((ratio / first - 1.0).abs() < 1e-4, "{ratio} {first}");
    }
    assert!(map.members(TABLE).iter().all(|&i| shown(&after, i) == shown(&before, i)));
    let mut black = before;
    map.members(MUG).into_iter().for_each(|i| black.sh[16 * i..16 * (i + 1)].fill([-0.5 / SH_C0 as f32; 3]));
    let (after, _) = apply(&black, Some(&map), &recolored(MUG, [1.0; 3])).expect("edited");
    after.validate().expect("finite");
}

#[test]
fn what_changes_nothing_is_refused() {
    let (cloud, map) = scene();
    let refused = |edit: SplatEdit| apply(&cloud, Some(&map), &edit).expect_err("refused");
    let turned = |degrees: f64| Placement {
        turn: DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize_or(DVec3::X), degrees.to_radians()),
        ..Placement::default()
    };
    let shifted = Placement { shift: DVec3::new(0.0, 0.0, 1e-9), ..Placement::default() };
    for nothing in [Placement::default(), turned(360.0), turned(-720.0), turned(0.0)] {
        assert_eq!(refused(moved(MUG, nothing)), SplatEditError::NoChange);
        assert_eq!(refused(doubled(MUG, nothing)), SplatEditError::SamePlace);
        let colored = Arrangement { to: nothing, color: Some([1.0, 0.0, 0.0]), ..Arrangement::of(MUG) };
        assert!(apply(&cloud, Some(&map), &SplatEdit::Arrange(colored)).is_ok(), "the color changes");
    }
    assert_eq!(refused(SplatEdit::Delete(vec![false; 100])), SplatEditError::NothingChosen);
    // The controls: small edits are accepted.
    for little in [turned(0.001), turned(359.9), shifted] {
        assert!(apply(&cloud, Some(&map), &moved(MUG, little)).is_ok(), "{little:?}");
        assert!(apply(&cloud, Some(&map), &doubled(MUG, little)).is_ok(), "{little:?}");
    }
}

#[test]
fn what_makes_no_sense_is_refused() {
    let (cloud, map) = scene();
    let refused = |map: Option<&SemanticMap>, edit| apply(&cloud, map, &edit).expect_err("refused");
    assert_eq!(refused(Some(&map), moved(9, placement())), SplatEditError::Unknown(9));
    assert_eq!(refused(None, recolored(MUG, [0.0; 3])), SplatEditError::NoObjects);
    assert_eq!(refused(Some(&map), SplatEdit::Delete(vec![true; 100])), SplatEditError::NothingLeft);
    for wrong in [
        Placement { scale: 0.0, ..Placement::default() },
        Placement { scale: f64::NAN, ..Placement::default() },
        Placement { shift: DVec3::INFINITY, ..Placement::default() },
        Placement { turn: DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0), ..Placement::default() },
    ] {
        assert_eq!(refused(Some(&map), moved(MUG, wrong)), SplatEditError::Placement);
    }
    let far = Placement { shift: DVec3::splat(1e300), ..Placement::default() };
    assert_eq!(refused(Some(&map), moved(MUG, far)), SplatEditError::OutOfRange("mug".into()));
    let mut bare = map.clone();
    bare.identity_of.fill(TABLE);
    assert_eq!(refused(Some(&bare), moved(MUG, placement())), SplatEditError::Empty("mug".into()));
}

#[test]
fn a_hundred_edits_undone_and_redone_in_random_order_end_where_they_began() {
    type State = (GaussianCloud, Option<SemanticMap>);
    let (cloud, map) = scene();
    let first: State = (cloud, Some(map));
    let (mut now, mut history) = (first.clone(), UndoHistory::default());
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(3);
    let mut edited = 0;
    while edited < 100 {
        match rng.random_range(0..4) {
            0 => drop(history.undo(&mut now)),
            1 => drop(history.redo(&mut now)),
            _ => {
                let ids: Vec<IdentityId> = now.1.iter().flat_map(|m| m.identities.iter().map(|(id, _)| id)).collect();
                let id = *ids.choose(&mut rng).expect("some");
                let edit = match rng.random_range(0..4) {
                    0 => SplatEdit::Delete((0..now.0.len()).map(|_| rng.random_bool(0.01)).collect()),
                    1 => moved(id, placement()),
                    2 if now.0.len() < 500 => doubled(id, placement()),
                    _ => recolored(id, [rng.random(), 0.3, 0.9]),
                };
                let Ok(new) = apply(&now.0, now.1.as_ref(), &edit) else { continue };
                history.record(std::mem::replace(&mut now, new));
                edited += 1;
            }
        }
    }
    let last = now.clone();
    let mut back = 0;
    while history.undo(&mut now) {
        back += 1;
    }
    assert!(back > 10 && now == first && last != first, "{back}");
    while history.redo(&mut now) {}
    assert!(now == last);
}
