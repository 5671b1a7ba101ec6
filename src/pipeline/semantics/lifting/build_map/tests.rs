//! The whole pipeline on a scene of three things, with masks of known truth.

use std::path::PathBuf;
use std::sync::Arc;

use glam::DVec3;

use super::*;
use crate::pipeline::observer::testing::StopsAfter;
use crate::pipeline::observer::{Interrupted, Silent};
use crate::pipeline::semantics::lifting::segmenter::FoundMask;
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::Renderer;
use crate::scene::{Camera, Identities, Level as Of, Mask, NO_IDENTITY};

/// Identities of the Gaussians: a doll with an eye on the left, a cat on the right.
const TRUTH: [IdentityId; 15] = [1, 1, 1, 1, 1, 1, 2, 2, 2, 3, 3, 3, 3, 3, 3];

fn cloud() -> GaussianCloud {
    let place = |i: usize| {
        let (x, of) = if i < 6 {
            (-0.8, 0)
        } else if i < 9 {
            (-0.45, 6)
        } else {
            (0.5, 9)
        };
        [x + 0.02 * (i % 2) as f32, 0.1 * (i - of) as f32 - 0.2, 0.0]
    };
    let color = |i: usize| if i < 9 { [10.0, 0.0, 0.0] } else { [0.0, 0.0, 10.0] };
    GaussianCloud {
        sh: (0..15).map(color).collect(),
        ..GaussianCloud::isotropic((0..15).map(place).collect(), -2.4, 5.0)
    }
}

/// The first photo shows the doll alone, the second everything.
fn photos() -> Vec<Photo> {
    let photo = |name: &str, x: f64, away: f64| {
        Photo::new(
            name,
            PathBuf::new(),
            Camera::look_at(DVec3::new(x, 0.0, -away), DVec3::new(x, 0.0, 0.0), DVec3::NEG_Y, 0.7, 96, 64)
                .expect("valid"),
        )
    };
    vec![photo("near", -0.75, 1.6), photo("far", 0.0, 3.2)]
}

/// Keeps the notes that it receives.
struct Notes(Vec<String>);

impl Observer for Notes {
    fn note(&mut self, _: Severity, text: String) {
        self.0.push(text);
    }
}

/// Segments by the truth, with names or without.
struct Told {
    named: bool,
    covers: bool,
}

impl Segmenter for Told {
    fn name(&self) -> &str {
        "told"
    }

    fn covers(&self, _: &Photo) -> bool {
        self.covers
    }

    fn segment(&mut self, photo: &Photo, max_side_px: u32, _: &mut dyn Observer) -> Result<Vec<FoundMask>, FindError> {
        let mut all = Identities::default();
        let doll = all.add(Of::Object, NO_IDENTITY, vec![]);
        all.add(Of::Part, doll, vec![]);
        all.add(Of::Object, NO_IDENTITY, vec![]);
        let camera = photo.camera.limited_to(max_side_px);
        let settings = RenderSettings::default();
        let view = ViewMap::render(&mut Renderer::new(), &cloud(), &TRUTH, &all, &camera, &settings);
        let view = view.expect("drawn");
        let mask = |id: IdentityId| -> Mask { view.mask(&all, id) };
        let list = [("doll", 1, Of::Object, None), ("eye", 2, Of::Part, Some(0)), ("cat", 3, Of::Object, None)];
        let told = list.map(|(name, id, level, parent)| FoundMask {
            level,
            parent,
            name: self.named.then(|| name.to_owned()),
            mask: mask(id),
        });
        Ok(told.into_iter().filter(|m| !m.mask.is_empty()).collect())
    }
}

fn find(
    told: Told,
    (lifting, code_steps): (Lifting, u64),
    max_seeds: usize,
    observer: &mut dyn Observer,
) -> Result<Found, FindError> {
    let mut told = told;
    let models = SearchModels { segmenter: &mut told, follower: None, encoder: None };
    let track = TrackOptions { max_seeds, ..TrackOptions::default() };
    let options = FindOptions { track, lifting, code_steps, ..FindOptions::default() };
    find_objects(&cloud(), &photos(), &RenderSettings::default(), models, &options, observer)
}

#[test]
fn what_a_second_photo_shows_is_found_too() {
    for named in [true, false] {
        let found = find(Told { named, covers: true }, (Lifting::Votes, 0), 12, &mut Silent).expect("found");
        let map = &found.map;
        assert_eq!(
            (map.identity_of.as_slice(), map.seeds.as_slice()),
            (&TRUTH[..], &["near".into(), "far".to_owned()][..])
        );
        let list: Vec<_> = map.identities.iter().map(|(_, i)| (i.level, i.parent, i.names.clone())).collect();
        let names = |name: &str| if named { vec![name.to_owned()] } else { vec![] };
        let expected = [(Of::Object, 0, names("doll")), (Of::Part, 1, names("eye")), (Of::Object, 0, names("cat"))];
        assert_eq!(list, expected);
        let findings = map.findings.as_ref().expect("noticed");
        assert!(findings.is_valid(&map.identities) && findings.conflicts().is_empty(), "{findings:?}");
        let photos: Vec<_> = map.facts().iter().map(|f| f.photos).collect();
        assert_eq!(photos, [None, Some(2), Some(2), Some(1)]);
        assert!(map.margin.iter().all(|m| *m > 0.0), "{:?}", map.margin);
        let codes: Vec<_> = map.identity_of.iter().map(|id| map.identities.codes(*id)).collect();
        assert_eq!(map.codes, codes);
        let seen = |k: usize| found.views[k].seen.iter().map(|s| s.identity).collect::<Vec<_>>();
        assert_eq!((seen(0), seen(1)), (vec![1, 2], vec![1, 2, 3]));
        assert!(found.views.iter().all(|v| v.unknown == 0.0), "{:?}", found.views);
        let stages: Vec<&str> = found.secs.iter().map(|s| s.0).collect();
        let of_models = ["segment", "encode frames", "follow masks"];
        let by_gaussians = ["measure visibility", "check labels", "read photos", "grow labels", "group Gaussians"];
        let all = [&of_models[..], &by_gaussians, &["carry by Gaussians", "train codes"]].concat();
        assert_eq!(stages, all);
        assert!(found.secs.iter().all(|s| s.1 >= 0.0), "{:?}", found.secs);
    }
}

#[test]
fn one_more_photo_adds_what_it_shows_of_the_unknown_and_nothing_that_is_known_changes() {
    let mut known = find(Told { named: true, covers: true }, (Lifting::Votes, 0), 1, &mut Silent).expect("found").map;
    assert!((9..15).all(|i| known.is_unknown(i)));
    // By hand: one Gaussian less of the eye, and another name of the doll.
    (known.identity_of[7], known.codes[7]) = (1, known.identities.codes(1));
    known.identities.rename(1, "puppet");
    // One Gaussian of the cat was left unlabeled by the masks.
    known.margin[14] = 0.5;
    let known = Arc::new(known);
    let add = |photo: usize| {
        let mut told = Told { named: true, covers: true };
        let models = SearchModels { segmenter: &mut told, follower: None, encoder: None };
        let track =
            TrackOptions { known: Some(Arc::clone(&known)), seed: Some(photo), max_seeds: 1, ..Default::default() };
        let options = FindOptions { track, ..FindOptions::default() };
        find_objects(&cloud(), &photos(), &RenderSettings::default(), models, &options, &mut Silent).expect("found").map
    };
    let map = add(1);
    assert_eq!((&map.identity_of[..9], &map.identity_of[9..]), (&known.identity_of[..9], &[3; 6][..]));
    assert_eq!((&map.codes[..9], &map.margin[..9]), (&known.codes[..9], &known.margin[..9]));
    assert_eq!((map.identities.name(1), map.identities.name(3)), ("puppet".to_owned(), "cat".to_owned()));
    assert_eq!((map.identities.len(), map.seeds.clone()), (3, vec!["near".to_owned(), "far".to_owned()]));
    assert!(map.margin[9..].iter().all(|m| *m > 0.0) && map.codes[9..].iter().all(|c| *c == map.identities.codes(3)));
    let findings = map.findings.as_ref().expect("noticed");
    assert!(
        findings.is_valid(&map.identities) && findings.unknown() < known.findings.as_ref().expect("noticed").unknown()
    );
    // The control: a photo without anything new adds nothing.
    let same = add(0);
    assert_eq!((&same.identity_of, &same.margin, &same.codes), (&known.identity_of, &known.margin, &known.codes));
    assert_eq!((&same.identities, &same.seeds), (&known.identities, &known.seeds));
}

#[test]
fn what_no_mask_reached_is_nobodys_and_told() {
    let mut notes = Notes(vec![]);
    let found = find(Told { named: true, covers: true }, (Lifting::Votes, 0), 1, &mut notes).expect("found");
    assert_eq!(found.map.identities.len(), 2);
    assert_eq!((&found.map.identity_of[..9], &found.map.identity_of[9..]), (&TRUTH[..9], &[NO_IDENTITY; 6][..]));
    // The far photo shows the cat, too different in color to be taken for a piece of the near things.
    assert!((0.01..0.3).contains(&found.views[1].unknown) && found.views[0].unknown == 0.0);
    assert!(
        notes.0.iter().any(|n| n.starts_with("1 of 2 photos have over 0.5 % unknown") && n.contains("far")),
        "{:?}",
        notes.0
    );
    let views = [0.2, 0.5].map(|unknown| ViewReport { photo: 0, unknown, seen: vec![] });
    let text = unknown(&views, &photos(), 0.1).expect("two");
    assert!(text.starts_with("2 of 2 photos have over 10.0 % unknown") && text.contains("worst: near, 50 %"), "{text}");
    assert_eq!(unknown(&views, &photos(), 0.5), None, "as much is not more");
}

#[test]
fn every_way_of_lifting_ends_at_the_same_identities() {
    let told = || Told { named: true, covers: true };
    let votes = find(told(), (Lifting::Votes, 0), 12, &mut Silent).expect("found").map;
    for lifting in [(Lifting::Refined, 20), (Lifting::Paper, 120)] {
        let map = find(told(), lifting, 12, &mut Silent).expect("found").map;
        assert_eq!(map.identity_of, TRUTH, "{lifting:?}");
        assert_ne!(map.codes, votes.codes, "{lifting:?} trains");
        let far = |a: &[f32; 6], b: &[f32; 6]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        let worst = map.codes.iter().zip(&votes.codes).map(|(a, b)| far(a, b)).fold(0.0, f32::max);
        assert!(worst < 0.25, "{lifting:?}: {worst}");
    }
}

#[test]
fn codes_are_trained_on_masks_and_never_on_what_votes_make_of_them() {
    for (max_seeds, masks) in [(1, "1 of 2"), (12, "2 of 2")] {
        let mut notes = Notes(vec![]);
        let told = Told { named: true, covers: true };
        let map = find(told, (Lifting::Paper, 60), max_seeds, &mut notes).expect("found").map;
        assert!(notes.0.iter().any(|n| n.contains(&format!("the masks of {masks} photos"))), "{:?}", notes.0);
        // Gaussians that no mask shows keep the background's codes, though the Gaussians beside them had votes.
        let untouched = map.codes[9..].iter().all(|c| c.iter().all(|v| (v - 0.5).abs() < 1e-6));
        assert_eq!(untouched, max_seeds == 1);
        let prepared = Preparation { lifting: Lifting::Paper, ..Preparation::default() };
        assert_eq!(map.prepared, Some(prepared), "it is stored how it was made");
    }
}

#[test]
fn nothing_to_begin_with_and_a_stop_are_told() {
    let nothing =
        find(Told { named: true, covers: false }, (Lifting::Votes, 0), 12, &mut Silent).expect_err("no masks");
    assert!(!Interrupted::is_cause_of(&nothing) && nothing.to_string().contains("'told'"), "{nothing}");
    let stopped = find(Told { named: true, covers: true }, (Lifting::Votes, 0), 12, &mut StopsAfter::new(0))
        .expect_err("stopped");
    assert!(Interrupted::is_cause_of(&stopped), "{stopped}");
}
