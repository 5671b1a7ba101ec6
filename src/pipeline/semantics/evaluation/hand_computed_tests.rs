//! Every protocol on masks made by hand, compared with values calculated by hand in the comments.

use std::convert::Infallible;

use glam::DVec3;

use super::part_recall::Components;
use super::*;
use crate::io::labels::ref_lerf::{ReferredObject, ReferredPhoto};
use crate::pipeline::semantics::query::answer::Basis;
use crate::pipeline::semantics::query::language::QueryPlace;
use crate::pipeline::semantics::query::localize::{Answer, Hit};
use crate::pipeline::semantics::query::query_engine::ask_by_name;
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::pipeline::semantics::relevancy::deviate;
use crate::render::RenderSettings;
use crate::scene::{
    GaussianCloud, Identities, IdentityId, LanguageFeatures, LevelFilter, NO_IDENTITY, PART_WEIGHT, ViewFeatures,
};

const DOLL: IdentityId = 1;
const EYE: IdentityId = 2;
const CAT: IdentityId = 3;

/// A doll with an eye, and a cat; codes far apart.
fn scene(of: Vec<IdentityId>) -> SemanticMap {
    let mut all = Identities::default();
    let doll = all.add(Level::Object, NO_IDENTITY, vec!["doll".into()]);
    all.add(Level::Part, doll, vec!["eye".into()]);
    all.add(Level::Object, NO_IDENTITY, vec!["cat".into()]);
    for (id, code) in [(DOLL, [0.1, 0.5, 0.5]), (EYE, [0.5, 0.9, 0.9]), (CAT, [0.9, 0.5, 0.5])] {
        all.get_mut(id).expect("there").code = code;
    }
    let n = of.len();
    SemanticMap::from_identities(all, of, vec![1.0; n], vec![])
}

fn exact(width_px: usize, identity: Vec<IdentityId>) -> ViewMap {
    let n = identity.len();
    ViewMap { width_px, height_px: n / width_px, identity, share: vec![1.0; n], alpha: vec![1.0; n] }
}

fn camera(width_px: u32, height_px: u32) -> Camera {
    Camera::look_at(DVec3::new(0.0, 0.0, -4.0), DVec3::ZERO, DVec3::NEG_Y, 0.8, width_px, height_px).expect("valid")
}

fn label(name: &str, level: Level, size: [usize; 2], inside: impl Fn(usize) -> bool + Sync) -> Category {
    let mask = Mask::from_fn(size[0], size[1], inside);
    Category { name: name.into(), level, boxes: mask.bounds().into_iter().collect(), mask }
}

/// Asks a scene by the names of its identities.
fn named(map: &SemanticMap) -> impl FnMut(&str) -> Option<QueryAnswer> + '_ {
    |text| ask_by_name(&map.identities, text, (LevelFilter::Auto, &QueryPlace::default()), &QueryConfig::default())
}

/// An answer whose relevancies are given, best identity first.
fn answered(best: IdentityId, relevancy: &[f32]) -> QueryAnswer {
    let hit = Hit { identity: best, score: relevancy[best as usize], margin: 0.5 };
    QueryAnswer::new(Answer::Found(vec![hit]), Basis::Embedding, relevancy.to_vec(), &QueryConfig::default())
}

fn close(found: &[f64], worked_out: &[f64]) {
    assert_eq!(found.len(), worked_out.len(), "{found:?}");
    assert!(found.iter().zip(worked_out).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?} {worked_out:?}");
}

fn ious(units: &[Unit]) -> Vec<f64> {
    units.iter().map(|u| u.iou).collect()
}

#[test]
fn masks_are_intersection_over_union_by_level() {
    // Pixels:  doll 0..4, eye 4..6, cat 6..9, nobody 9.
    let map = scene(vec![]);
    let view = exact(10, vec![1, 1, 1, 1, 2, 2, 3, 3, 3, 0]);
    let (camera, blended) = (camera(10, 1), CodeMap::default());
    let categories = vec![
        // The doll and its eye are pixels 0..6; the label has 0..5: 5 of 6.
        label("doll", Level::Object, [10, 1], |i| i < 5),
        // The eye is 4..6; the label has 5..8: pixel 5 of 4..8, 1 of 4.
        label("eye of the doll", Level::Part, [10, 1], |i| (5..8).contains(&i)),
        // No identity has this name: nothing of 3 pixels.
        label("giraffe", Level::Object, [10, 1], |i| i < 3),
    ];
    let view = LabeledView { name: "a", camera: &camera, exact: &view, blended: &blended, categories };
    let units = masks::compare(&mut AskedScene { map: &map, ask: &mut named(&map) }, &view);
    close(&ious(&units), &[5.0 / 6.0, 0.25, 0.0]);
    // Objects: (5/6 + 0) / 2; parts: 1/4.
    close(&masks::by_level(&units), &[5.0 / 12.0, 0.25]);
    assert!(units.iter().all(|u| u.hit.is_none() && u.view == "a"));
    assert!(masks::by_level(&units[..1])[1].is_nan(), "no parts, no mean");
}

#[test]
fn every_sentence_counts_and_hidden_objects_are_not_asked_for() {
    // The cat is pixels 6..9; the label has 6..8: 2 of 3. The doll is not labeled in this view.
    let map = scene(vec![]);
    let view = exact(10, vec![1, 1, 1, 1, 2, 2, 3, 3, 3, 0]);
    let (camera, blended) = (camera(10, 1), CodeMap::default());
    let categories = vec![label("cat", Level::Object, [10, 1], |i| (6..8).contains(&i))];
    let view = LabeledView { name: "a", camera: &camera, exact: &view, blended: &blended, categories };
    let object = |name: &str, sentences: &[&str]| ReferredObject {
        name: name.into(),
        sentences: sentences.iter().map(|s| (*s).to_owned()).collect(),
        mask: None,
    };
    let objects = vec![object("cat", &["the cat", "doll", "giraffe"]), object("doll", &["the doll"])];
    let photo = ReferredPhoto { is_test: true, objects };
    let units = ref_lerf::compare(&mut AskedScene { map: &map, ask: &mut named(&map) }, &view, &photo);
    // Another thing's pixels, and no answer, are nothing of the label.
    close(&ious(&units), &[2.0 / 3.0, 0.0, 0.0]);
    assert_eq!(units[0].query, "the cat");
}

#[test]
fn langsplat_smooths_scales_and_cuts() {
    // Columns of four objects, 60 px each; rows are all the same, so only columns count.
    let (w, h) = (240, 8);
    let all = Identities::objects(4);
    let map = SemanticMap { identities: all, ..SemanticMap::default() };
    let view = exact(w, (0..w * h).map(|i| (i % w / 60) as IdentityId + 1).collect());
    // Relevancies 1, 0.65, 0.76, 0. `v` is half the relevancy, half its mean over columns x-15..x+14;
    // its least is 0 and its largest 1, so `o = 2 v - 1`, and `o > 0.4` where `v > 0.7`.
    // First object: v >= (1 + 0.65 + 0.35 x 16/30) / 2 = 0.92: all of it.
    // Second: v = 0.65 + 0.175 (75 - x)/30 > 0.7 up to x = 66; at its end less than 0.68: not.
    // Third: v = 0.705 + 0.055 (x - 105)/30 at its beginning: in; v = 0.38 + 0.38 (195 - x)/30 > 0.7
    // up to x = 169. Fourth: at most 0.2. A majority of 7 x 7 leaves straight edges where they are.
    // So the mask is columns 0..67 and 120..170: 67 + 50 of them.
    let categories = vec![
        // Columns 0..120 are labeled: 67 in both, 120 + 50 in either. The largest mean is 1, first at
        // column 0, which is in the label's box.
        label("a", Level::Object, [w, h], |i| i % w < 120),
        // Columns 100..200: 50 in both, 100 + 67 in either; column 0 is not in the box.
        label("a", Level::Object, [w, h], |i| (100..200).contains(&(i % w))),
    ];
    let (camera, blended) = (camera(w as u32, h as u32), CodeMap::default());
    let view = LabeledView { name: "a", camera: &camera, exact: &view, blended: &blended, categories };
    let mut ask = |_: &str| Some(answered(1, &[0.0, 1.0, 0.65, 0.76, 0.0]));
    let units = langsplat::compare(&mut AskedScene { map: &map, ask: &mut ask }, &view);
    close(&ious(&units), &[67.0 / 170.0, 50.0 / 167.0]);
    assert_eq!(units.iter().map(|u| u.hit).collect::<Vec<_>>(), [Some(true), Some(false)]);
    // A category without an answer is a miss, even if the box begins at the first pixel.
    let units = langsplat::compare(&mut AskedScene { map: &map, ask: &mut |_| None }, &view);
    assert!(units.iter().all(|u| u.iou == 0.0 && u.hit == Some(false)), "{units:?}");
}

#[test]
fn fastlgs_ex_pools_over_categories_and_views() {
    // Pixels: doll 0..4, eye 4..5, cat 5..8, nobody 8..10; each has its own code.
    let of = vec![1, 1, 1, 1, 2, 3, 3, 3, 0, 0];
    let map = scene(of.clone());
    let view = exact(10, of);
    let planes = std::array::from_fn(|c| map.codes.iter().map(|codes| codes[c]).collect());
    let blended = CodeMap { width_px: 10, height_px: 1, planes };
    let camera = camera(10, 1);
    let labeled = |name, categories| LabeledView { name, camera: &camera, exact: &view, blended: &blended, categories };
    let first = labeled(
        "a",
        vec![
            // Doll with eye 0..5, label 3..7: 2 in both, 7 in either. Pool 2/7.
            label("doll", Level::Object, [10, 1], |i| (3..7).contains(&i)),
            // Cat 5..8, label 5..8: 3 of 3. Pool 5/10.
            label("cat", Level::Object, [10, 1], |i| (5..8).contains(&i)),
        ],
    );
    // In the next view, no identity has the name, and 10 px are labeled: 0 of 10. Pool 5/20.
    let second = labeled("b", vec![label("giraffe", Level::Object, [10, 1], |_| true)]);
    let mut ask = named(&map);
    let (mut scene, mut pool) = (AskedScene { map: &map, ask: &mut ask }, fastlgs_ex::Pool::default());
    close(&ious(&fastlgs_ex::compare(&mut scene, &first, &mut pool)), &[2.0 / 7.0, 0.5]);
    close(&ious(&fastlgs_ex::compare(&mut scene, &second, &mut pool)), &[0.25]);
    // A pool of its own begins anew.
    close(&ious(&fastlgs_ex::compare(&mut scene, &second, &mut fastlgs_ex::Pool::default())), &[0.0]);
}

#[test]
fn a_selection_is_drawn_alone_and_cut_at_seven_tenths() {
    // A doll, and a cat that stands in front of it.
    let cloud = GaussianCloud {
        log_scales: vec![[-0.6; 3], [-0.2; 3]],
        ..GaussianCloud::isotropic(vec![[0.0, 0.0, 0.0], [0.0, 0.0, -1.0]], 0.0, 4.0)
    };
    let map = scene(vec![DOLL, CAT]);
    let camera = camera(120, 90);
    let (view, blended) = (exact(120, vec![CAT; 120 * 90]), CodeMap::default());
    // Alpha is o exp(-r²/2s²) with o = 1/(1 + e⁻⁴) = 0.982: over 0.7 up to r = s sqrt(2 ln(0.982/0.7)).
    // The standard deviation is f e^-0.6 / 4 px, its square 0.3 px² more: 0.3 px of smoothing.
    let s2 = (camera.focal_px.x * (-0.6_f64).exp() / 4.0).powi(2) + 0.3;
    let r2 = 2.0 * s2 * (1.0 / (1.0 + (-4.0_f64).exp()) / 0.7).ln();
    let off = |i: usize| [(i % 120) as f64 + 0.5 - 60.0, (i / 120) as f64 + 0.5 - 45.0];
    let disc = |i: usize| off(i)[0].powi(2) + off(i)[1].powi(2) < r2;
    let area = Mask::from_fn(120, 90, disc).area() as f64;
    assert!(area > 300.0, "large enough that single pixels do not count: {area}");
    let size = [120, 90];
    let categories = vec![
        label("doll", Level::Object, size, disc),
        label("doll", Level::Object, size, |i| disc(i) && off(i)[0] < 0.0),
        label("giraffe", Level::Object, size, disc),
    ];
    let view = LabeledView { name: "a", camera: &camera, exact: &view, blended: &blended, categories };
    let mut ask = named(&map);
    let mut asked = AskedScene { map: &map, ask: &mut ask };
    let units = selection_3d::compare(&mut asked, &view, &cloud, &RenderSettings::default()).expect("drawn");
    // The disc itself, whoever stands in front; half of it; and nothing.
    let [whole, half, none] = ious(&units)[..] else { panic!("{units:?}") };
    assert!(whole > 0.97 && (half - 0.5).abs() < 0.02 && none == 0.0, "{units:?}");
    // 2 of 3 reach a quarter, 1 of 3 reaches 0.6.
    close(&[0.25, 0.6].map(|least| selection_3d::accuracy(&units, least)), &[2.0 / 3.0, 1.0 / 3.0]);
    assert!(selection_3d::accuracy(&[], 0.5).is_nan());
}

#[test]
fn spin_nerf_joins_the_labels_and_counts_all_pixels() {
    // 10 x 10 px: doll in columns 0..4, cat elsewhere. At 1008 x 567 a column is 100.8 px wide: the
    // nearest pixel gives columns of 100 or 101.
    let map = scene(vec![]);
    let view = exact(10, (0..100).map(|i| if i % 10 < 4 { DOLL } else { CAT }).collect());
    let (camera, blended) = (camera(10, 10), CodeMap::default());
    // Labels in two pieces, columns 2..4 and 4..6. Both: 2..4; either: 0..6: 2 of 6 columns. Wrong are
    // 0..2 and 4..6: 6 of 10 columns are right.
    let piece = |from: usize| label("x", Level::Object, [10, 10], move |i| (from..from + 2).contains(&(i % 10)));
    let categories = vec![piece(2), piece(4)];
    let view = LabeledView { name: "a", camera: &camera, exact: &view, blended: &blended, categories };
    let mut ask = named(&map);
    let mut asked = AskedScene { map: &map, ask: &mut ask };
    let found = spin_nerf::compare(&mut asked, &view, "the doll").expect("has labels");
    assert!((found.unit.iou - 1.0 / 3.0).abs() < 2e-3 && (found.accuracy - 0.6).abs() < 2e-3, "{found:?}");
    assert_eq!((found.unit.query.as_str(), found.unit.view.as_str()), ("the doll", "a"));
    // Not found: no pixel is right but those that are no foreground, 6 of 10 columns.
    let found = spin_nerf::compare(&mut asked, &view, "giraffe").expect("has labels");
    assert!(found.unit.iou == 0.0 && (found.accuracy - 0.6).abs() < 2e-3, "{found:?}");
    let empty = LabeledView { categories: vec![], ..view };
    assert_eq!(spin_nerf::compare(&mut asked, &empty, "the doll"), None);
}

#[test]
fn classes_have_their_own_masks_or_compete_for_pixels() {
    // Pixels: doll 0..4, eye 4..6, cat 6..10.
    let map = scene(vec![]);
    let view = exact(10, vec![1, 1, 1, 1, 2, 2, 3, 3, 3, 3]);
    let (camera, blended) = (camera(10, 1), CodeMap::default());
    let categories =
        vec![label("cat", Level::Object, [10, 1], |i| i >= 6), label("toy", Level::Object, [10, 1], |i| i < 6)];
    let view = LabeledView { name: "a", camera: &camera, exact: &view, blended: &blended, categories };
    // "cat" is most relevant for the cat, 0.9, where "toy" has 0.95; "toy" is most relevant for the
    // doll, 0.97, but for its eye "cat" has 0.6 against 0.5.
    let mut ask = |text: &str| match text {
        "cat" => Some(answered(CAT, &[0.0, 0.2, 0.6, 0.9])),
        "toy" => Some(answered(DOLL, &[0.0, 0.97, 0.5, 0.95])),
        _ => None,
    };
    let mut asked = AskedScene { map: &map, ask: &mut ask };
    let classes = ["cat", "sofa", "toy"].map(str::to_owned);
    let [own, winner] = multi_class::compare(&mut asked, &view, &classes);
    // Own masks: the cat is 6..10, 4 of 4; the toy is the doll with its eye, 6 of 6. No label is a sofa.
    close(&ious(&own), &[1.0, 1.0]);
    // Arg-max: "cat" wins the eye only, 4..6: 0 of 6. "toy" wins doll and cat, 0..4 and 6..10: 4 of 10.
    close(&ious(&winner), &[0.0, 0.4]);
}

// Unit vectors: two things, three kinds of parts, what means anything, and something else.
const MUG: usize = 0;
const PAN: usize = 1;
const HANDLE: usize = 2;
const LID: usize = 3;
const KNOB: usize = 4;
const ANYTHING: usize = 5;
const ELSE: usize = 6;

fn mixed(of: &[(usize, f32)]) -> Vec<f32> {
    let mut v = vec![0.0; 7];
    of.iter().for_each(|(axis, x)| v[*axis] = *x);
    v
}

/// A mug with handle, lid and knob, and a pan with handle and knob, each looked at once.
fn kitchen() -> (SemanticMap, LanguageFeatures) {
    let mut all = Identities::default();
    let mug = all.add(Level::Object, NO_IDENTITY, vec![]);
    let pan = all.add(Level::Object, NO_IDENTITY, vec![]);
    (0..3).for_each(|_| {
        all.add(Level::Part, mug, vec![]);
    });
    (0..2).for_each(|_| {
        all.add(Level::Part, pan, vec![]);
    });
    let [of_mug, of_pan] = [mixed(&[(MUG, 1.0)]), mixed(&[(PAN, 1.0)])];
    // Of the mug's handle, and of the pan's knob, something else is seen too.
    let parts = [
        (mixed(&[(HANDLE, 0.96), (ELSE, 0.28)]), &of_mug),
        (mixed(&[(LID, 1.0)]), &of_mug),
        (mixed(&[(KNOB, 1.0)]), &of_mug),
        (mixed(&[(HANDLE, 1.0)]), &of_pan),
        (mixed(&[(KNOB, 0.8), (ELSE, 0.6)]), &of_pan),
    ];
    let whole = |v: &Vec<f32>| ViewFeatures { raw: vec![v.clone()], deviated: vec![v.clone()] };
    let part = |(raw, whole): &(Vec<f32>, &Vec<f32>)| ViewFeatures {
        raw: vec![raw.clone()],
        deviated: vec![deviate(raw, whole, PART_WEIGHT).expect("a direction")],
    };
    let of = [&of_mug, &of_pan].into_iter().map(whole).chain(parts.iter().map(part)).collect();
    let map = SemanticMap { identities: all, ..SemanticMap::default() };
    (map, LanguageFeatures { encoder: "test".into(), dimension: 7, by_identity: of })
}

#[test]
fn part_recall_rises_with_every_component() {
    let (map, language) = kitchen();
    // Pixels: mug 4, its handle 2, lid 3, knob 1; pan 4, its handle 4, knob 2.
    let identity = [(1, 4), (3, 2), (4, 3), (5, 1), (2, 4), (6, 4), (7, 2)];
    let identity: Vec<IdentityId> = identity.into_iter().flat_map(|(id, n)| vec![id; n]).collect();
    let view = exact(20, identity);
    let part = |name: &str, of: IdentityId| label(name, Level::Part, [20, 1], |i| view.identity[i] == of);
    let categories = vec![
        part("handle of the mug", 3),
        part("lid of the mug", 4),
        part("handle of the pan", 6),
        part("knob of the pan", 7),
        // Objects are not part queries.
        label("mug", Level::Object, [20, 1], |i| i < 10),
    ];
    let (camera, blended) = (camera(20, 1), CodeMap::default());
    let views = [LabeledView { name: "a", camera: &camera, exact: &view, blended: &blended, categories }];
    let mut encode = |phrase: &str| {
        Ok::<_, Infallible>(match phrase {
            "mug" => mixed(&[(MUG, 1.0)]),
            "pan" => mixed(&[(PAN, 1.0)]),
            "handle of the mug" => mixed(&[(MUG, 0.6), (HANDLE, 0.8)]),
            "lid of the mug" => mixed(&[(MUG, 0.9), (LID, 0.436)]),
            "handle of the pan" => mixed(&[(PAN, 0.6), (HANDLE, 0.8)]),
            "knob of the pan" => mixed(&[(PAN, 0.2), (KNOB, 0.98)]),
            _ => mixed(&[(ANYTHING, 1.0)]),
        })
    };
    let mut row = |c: Components| {
        part_recall::row((c, &QueryConfig::default()), &map, &language, &views, &mut encode).expect("encodes")
    };
    let worked_out = [
        // Objects alone: the whole mug (10 px) for its handle and lid, the whole pan (10 px) for its own.
        [0.2, 0.3, 0.4, 0.2],
        // + parts. Mug's handle: 0.8 x 0.96 = 0.768, the pan's 0.8: wrong. Lid: 0.436, the mug 0.9: the
        // mug again. Pan's handle: 0.8, right. Pan's knob: 0.98 x 0.8 = 0.784, the mug's 0.98: wrong.
        [0.0, 0.3, 1.0, 0.0],
        // + deviation, 0.3 of the whole and 0.7 of the part, of length 0.762. Mug's handle:
        // (0.18 + 0.538)/0.762 = 0.94, the pan's 0.56/0.762 = 0.74: right. Lid: (0.27 + 0.305)/0.762 =
        // 0.755, the mug 0.9. Pan's knob: (0.06 + 0.549)/0.762 = 0.80, the mug's 0.686/0.762 = 0.90: wrong.
        [1.0, 0.3, 1.0, 0.0],
        // + the second step: the mug won, so its parts compete, the mug's phrase among the canonical ones:
        // the lid has 0.755 - 0.3/0.762 = 0.36, handle and knob 0.27/0.762 - 0.3/0.762 < 0: right.
        [1.0, 1.0, 1.0, 0.0],
        // Part and whole at once: the pan has 1 for "pan", the mug 0, so 0.80 + 1 against 0.90 + 0: right.
        [1.0, 1.0, 1.0, 1.0],
    ];
    for (components, expected) in Components::ROWS.into_iter().zip(worked_out) {
        let row = row(components);
        close(&ious(&row.units), &expected);
        let hits = expected.iter().filter(|iou| **iou >= 0.5).count();
        close(&[row.recall, row.mean_iou], &[hits as f64 / 4.0, expected.iter().sum::<f64>() / 4.0]);
    }
    // The fourth row's gain is not due to deviation alone.
    let alone = Components { deviation: false, ..Components::ROWS[3] };
    close(&ious(&row(alone).units), &[0.0, 1.0, 1.0, 0.0]);
}

#[test]
fn an_overlap_of_a_half_is_a_hit_and_less_is_none() {
    let (map, language) = kitchen();
    let view = exact(4, vec![3, 3, 1, 1]);
    let (camera, blended) = (camera(4, 1), CodeMap::default());
    let mut encode = |phrase: &str| {
        Ok::<_, Infallible>(match phrase {
            "handle of the mug" => mixed(&[(MUG, 0.6), (HANDLE, 0.8)]),
            "mug" => mixed(&[(MUG, 1.0)]),
            _ => mixed(&[(ANYTHING, 1.0)]),
        })
    };
    // The handle is pixels 0 and 1: half of four, and of what begins at pixel 1, 1 of 4.
    for (from, recall, iou) in [(0, 1.0, 0.5), (1, 0.0, 0.25)] {
        let categories = vec![label("handle of the mug", Level::Part, [4, 1], move |i| i >= from)];
        let view = LabeledView { name: "a", camera: &camera, exact: &view, blended: &blended, categories };
        let row =
            part_recall::row((Components::ROWS[4], &QueryConfig::default()), &map, &language, &[view], &mut encode)
                .expect("encodes");
        close(&[row.recall, row.mean_iou], &[recall, iou]);
    }
}
