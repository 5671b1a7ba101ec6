//! Samples of other methods and a scene of this program side by side; vectors of phrases come with the samples.

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use image::ColorType;

use super::protocol::{ResultEvaluation, evaluate};
use super::views::WantedViews;
use super::*;
use crate::io::results::tests::{expected, sample, samples, with_class_names};
use crate::io::trained::SceneCamera;
use crate::jobs::evaluate_masks::Protocol;
use crate::jobs::{Scene, export};
use crate::models::ModelError;
use crate::pipeline::observer::Silent;
use crate::pipeline::semantics::evaluation::by_rule::{CutRule, PhraseInView};
use crate::pipeline::semantics::query::foreign::own_rules::ForeignMask;
use crate::scene::{Camera, GaussianCloud, Identities, Level, Mask, NO_IDENTITY, SemanticMap};

/// Vectors of the samples: the phrase's, and those of the canonical ones.
fn given(name: &str, phrases: &[&str]) -> Result<Vec<Vec<f32>>, JobError> {
    assert_eq!(name, "clip-vit-b16");
    let all: Vec<Vec<f32>> = expected("scene/texts.npy").chunks_exact(512).map(<[f32]>::to_vec).collect();
    let of = |phrase: &&str| ["object", "things", "stuff", "texture"].iter().position(|c| c == phrase);
    Ok(phrases.iter().map(|phrase| all[of(phrase).map_or(0, |c| c + 1)].clone()).collect())
}

fn request(scenes: &[&str], views: &str) -> CompareRequest {
    CompareRequest {
        scenes: scenes.iter().map(|s| (samples().join(s), ResultOptions::default())).collect(),
        phrases: vec!["kettle".into()],
        views: ViewChoice { wanted: WantedViews::Listed(views.into()), photos: None, truth: None, max_side_px: 1_008 },
        repeats: 1,
        shown: ShownRelevancy::Raw,
        out: None,
        arrays: false,
    }
}

fn compared(request: &CompareRequest) -> Comparison {
    run(request, &mut given, &mut Silent).expect("compared")
}

fn refused(request: &CompareRequest) -> String {
    run(request, &mut given, &mut Silent).expect_err("refused").to_string()
}

/// The mask of the kettle by the common rule in the first view.
fn common(scene: &mut CompareSubject, camera: &Camera) -> ForeignMask {
    let mut encode = given;
    let mut vectors = KnownVectors::new(&mut encode, 1);
    scene.answers.look(camera).expect("drawn");
    let levels = scene.answers.levels("kettle", &mut vectors).expect("answered");
    let size = (camera.width_px as usize, camera.height_px as usize);
    PhraseInView { levels, own: None, size }.mask(CutRule::Common).expect("a mask")
}

/// Labels in LERF-Mask's layout: what LangSplatV2's sample answers by the common rule, as the truth of this view.
fn write_labels(folder: &Path, view: &str) -> Mask {
    let result = sample("langsplat_v2/output");
    let camera = result.cameras[0].camera.clone();
    let mask = common(&mut CompareSubject::of_result(result, Path::new("x")), &camera).mask;
    assert!(!mask.is_empty());
    let own = folder.join("test_mask").join(view);
    export::make_folder(&own).expect("made");
    let pixels: Vec<u8> = (0..mask.width_px() * mask.height_px()).map(|i| 255 * u8::from(mask.contains(i))).collect();
    let size = [camera.width_px, camera.height_px];
    export::png(&own.join("kettle.png"), &pixels, size, ColorType::L8).expect("written");
    mask
}

#[test]
fn methods_stand_side_by_side_and_those_without_language_say_so() {
    let found = compared(&request(&["langsplat_v2/output", "opengaussian", "gaussian_grouping", "ludvig"], "0,view_1"));
    assert_eq!((found.cells.len(), found.views.len()), (2 * 4, 2));
    let row = &found.cells[..4];
    assert!(row.iter().all(|c| c.view == "view_0" && c.phrase == "kettle"));
    let problem = row[2].problem.as_deref().expect("no language");
    assert!(problem.contains("Gaussian Grouping") && row[2].common.is_none(), "{problem}");
    let rules: Vec<bool> = row.iter().map(|c| c.own.is_some()).collect();
    assert_eq!(rules, [true, true, false, false], "LUDVIG has no rule of its own");
    let common: Vec<&str> = [0, 1, 3].map(|k| row[k].common.as_ref().expect("a mask").rule).to_vec();
    assert!(common.iter().all(|rule| *rule == common[0] && row[0].own.as_ref().is_some_and(|own| own.rule != *rule)));
    assert!(found.range[0] < found.range[1] && found.range[1] <= 1.0, "{:?}", found.range);
    let e = refused(&request(&["langsplat_v2/output", "opengaussian"], "7"));
    assert!(e.contains("'7'") && e.contains("'view_0' to 'view_1'"), "{e}");
}

#[test]
fn classes_with_names_answer_them_and_nothing_else() {
    let folder = tempfile::tempdir().expect("folder");
    let named = with_class_names(folder.path(), "7 kettle\n3 mug\n");
    let mut asked = request(&["langsplat_v2/output", "gaussian_grouping"], "0");
    asked.scenes[0].0 = named;
    asked.phrases = ["the kettle", "mug", "lid"].map(str::to_owned).to_vec();
    let found = compared(&asked);
    let own = |k: usize| found.cells[k].own.as_ref().map(|own| own.area_px);
    assert!(own(0).is_some_and(|area| area > 0) && own(0) != own(2), "{:?}", &found.cells[..3]);
    let problem = |k: usize| found.cells[k].problem.as_deref().unwrap_or_default();
    assert!(problem(4).contains("'lid'") && problem(4).contains("class_names.txt"), "{}", problem(4));
    assert!(problem(1).contains("knows no language"), "the control: no names");
    assert_eq!(found.methods.iter().map(|m| m.encoder.as_deref()).collect::<Vec<_>>(), [None, None]);
}

#[test]
fn a_result_is_asked_by_the_encoder_that_it_was_trained_with() {
    let mut asked = request(&["langsplat_v2/output", "langsplat/output"], "0");
    asked.scenes[1].1.encoder = Some("demo".into());
    let mut encoders = Vec::new();
    let mut encode = |name: &str, phrases: &[&str]| {
        encoders.push(name.to_owned());
        match name {
            "demo" => Ok(vec![vec![1.0; 128]; phrases.len()]),
            name => given(name, phrases),
        }
    };
    let found = run(&asked, &mut encode, &mut Silent).expect("compared");
    encoders.sort();
    encoders.dedup();
    assert_eq!(encoders, ["clip-vit-b16", "demo"]);
    assert_eq!(found.methods[1].encoder.as_deref(), Some("demo"));
    let problem = found.cells[1].problem.as_deref().expect("another width");
    assert!(["demo", "128", "512", "--encoder"].iter().all(|word| problem.contains(word)), "{problem}");
    assert!(found.cells[0].problem.is_none(), "the control");
    // A phrase without a known word is a reason, not the end.
    let mut unknown =
        |_: &str, _: &[&str]| Err(JobError::Model(ModelError::NoKnownWord { unknown: vec!["giraffe".into()] }));
    let found = run(&asked, &mut unknown, &mut Silent).expect("compared");
    assert!(
        found.cells.iter().all(|c| c.problem.as_deref().is_some_and(|p| p.contains("giraffe"))),
        "{:?}",
        found.cells
    );
}

#[test]
fn options_of_results_are_refused_for_scenes_of_this_program() {
    let folder = tempfile::tempdir().expect("folder");
    std::fs::write(folder.path().join("scene.json"), "{}").expect("written");
    let with = |encoder: Option<&str>| {
        let options = ResultOptions { encoder: encoder.map(str::to_owned), ..ResultOptions::default() };
        CompareSubject::open(folder.path(), &options).err().expect("refused").to_string()
    };
    assert!(with(Some("demo")).contains("--encoder"));
    assert!(!with(None).contains("--encoder"), "the control");
}

#[test]
fn a_second_copy_of_a_result_has_equal_rows_and_another_result_has_others() {
    let found = compared(&request(&["langsplat_v2/output", "langsplat_v2/output", "opengaussian"], "0"));
    let [a, b, c] = &found.cells[..] else { panic!("{} cells", found.cells.len()) };
    assert_eq!((&a.own, &a.common, a.most), (&b.own, &b.common, b.most));
    assert_ne!((&a.common, a.most), (&c.common, c.most), "the control");
    let names: Vec<&str> = found.methods.iter().map(|m| &*m.method).collect();
    assert_eq!(names, ["LangSplatV2, output (1)", "LangSplatV2, output (2)", "OpenGaussian"]);
}

#[test]
fn labels_give_scores_and_exchanged_levels_lower_them() {
    let folder = tempfile::tempdir().expect("folder");
    write_labels(folder.path(), "view_0");
    let mut asked = request(&["langsplat_v2/output", "ludvig"], "0");
    asked.views.truth = Some(folder.path().into());
    let found = compared(&asked);
    let first = found.cells[0].common.as_ref().expect("a mask");
    assert_eq!((first.iou, first.hit), (Some(1.0), Some(true)));
    assert_eq!((found.methods[0].common_miou, found.methods[0].compared), (Some(1.0), 1));
    assert!(found.cells[1].common.as_ref().is_some_and(|r| r.iou.is_some_and(|iou| iou < 0.99)));
    // The level that decided takes the values of another.
    let mut result = sample("langsplat_v2/output");
    let level = first.level;
    result.levels[level].values = result.levels[(level + 1) % 3].values.clone();
    let scenes = vec![CompareSubject::of_result(result, Path::new("exchanged"))];
    let other = of_scenes(scenes, &asked, &mut given, &mut Silent).expect("compared");
    assert!(other.methods[0].common_miou.is_some_and(|iou| iou < 0.99), "{:?}", other.methods[0]);
    // A phrase that nobody labeled.
    asked.phrases = vec!["teapot".into()];
    let found = compared(&asked);
    assert!(found.cells[0].common.as_ref().is_some_and(|r| r.iou.is_none()));
    assert!(found.notes.iter().any(|note| note.contains("'teapot'")), "{:?}", found.notes);
}

#[test]
fn missing_labels_are_named() {
    let folder = tempfile::tempdir().expect("folder");
    write_labels(folder.path(), "view_1");
    let mut asked = request(&["langsplat_v2/output", "opengaussian"], "0");
    asked.views.truth = Some(folder.path().into());
    let e = refused(&asked);
    let name = folder.path().display().to_string();
    assert!(e.contains(&name) && e.contains("'view_0'"), "{e}");
    asked.views.wanted = WantedViews::Listed("all".into());
    let found = compared(&asked);
    assert!(found.notes.iter().any(|note| note.contains(&name) && note.contains("'view_0'")), "{:?}", found.notes);
    let nowhere = folder.path().join("nowhere");
    asked.views.truth = Some(nowhere.clone());
    assert!(refused(&asked).contains(&nowhere.display().to_string()));
}

#[test]
fn files_are_written_once_and_load_nothing() {
    let folder = tempfile::tempdir().expect("folder");
    let out = folder.path().join("side");
    let mut asked = request(&["langsplat_v2/output", "gaussian_grouping"], "all");
    (asked.out, asked.arrays) = (Some(out.clone()), true);
    let found = compared(&asked);
    let text = |name: &str| std::fs::read_to_string(out.join(name)).expect(name);
    let json: serde_json::Value = serde_json::from_str(&text("compare.json")).expect("JSON");
    assert_eq!(json["cells"].as_array().map(Vec::len), Some(found.cells.len()));
    let csv = text("compare.csv");
    let columns: Vec<usize> = csv.lines().map(|line| line.matches(',').count()).collect();
    assert_eq!(columns.len(), found.cells.len() + 1);
    assert!(csv.contains("knows no language"), "{csv}");
    let page = text("compare.html");
    assert!(page.contains("data:image/png;base64,") && page.contains("Content-Security-Policy"));
    assert!(!page.contains("http://") && !page.contains("https://") && !page.contains("<script"));
    let picture = image::open(out.join("compare.png")).expect("a picture").to_rgb8();
    assert!(picture.width() > 3 * 320 && picture.height() > 2 * 240);
    assert_eq!(std::fs::read_dir(out.join("relevancy")).expect("a folder").count(), 2 * 3, "one method answered");
    let e = refused(&asked);
    assert!(e.contains("compare.json") && e.contains("--out"), "{e}");
}

/// Two blobs, a lamp and a mug, by their names.
fn own_scene() -> (CompareSubject, Camera) {
    let mut all = Identities::default();
    let lamp = all.add(Level::Object, NO_IDENTITY, vec!["lamp".into()]);
    let kettle = all.add(Level::Object, NO_IDENTITY, vec!["kettle".into()]);
    let cloud = GaussianCloud::isotropic(vec![[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]], -2.0, 6.0);
    let map = SemanticMap::from_identities(all, vec![lamp, kettle], vec![1.0; 2], vec![]);
    let camera = Camera::look_at(DVec3::new(0.0, 0.0, -3.0), DVec3::ZERO, DVec3::NEG_Y, 0.8, 64, 48).expect("valid");
    let cameras = vec![SceneCamera { name: "a.png".into(), camera: camera.clone(), held_out: false }];
    let scene = Scene { path: "own".into(), cloud: Arc::new(cloud), cameras, ..Scene::default() };
    (CompareSubject::own(scene, map).expect("names need no encoder"), camera)
}

#[test]
fn a_scene_of_this_program_is_asked_like_the_others() {
    let (own, _) = own_scene();
    let ludvig = CompareSubject::of_result(sample("ludvig"), Path::new("ludvig"));
    let mut asked = request(&[], "a");
    asked.phrases = vec!["kettle".into(), "giraffe".into()];
    let found = of_scenes(vec![own, ludvig], &asked, &mut given, &mut Silent).expect("compared");
    let area = |k: usize, own: bool| {
        let cell = &found.cells[k];
        let ruled = if own { &cell.own } else { &cell.common };
        ruled.as_ref().map(|r| r.area_px)
    };
    // Its own rule takes the pixels of the object, the common one cuts the relevancy.
    let [ruled, common] = [true, false].map(|own| area(0, own).unwrap_or(0));
    assert!(0 < common && common <= ruled, "{:?}", found.cells[0]);
    assert_eq!((area(2, true), found.cells[2].phrase.as_str()), (Some(0), "giraffe"), "the control");
    assert_eq!((found.methods[0].method.as_str(), &found.methods[0].encoder), ("FMLGS", &None));
}

#[test]
fn protocols_have_a_row_for_each_rule() {
    let folder = tempfile::tempdir().expect("folder");
    write_labels(folder.path(), "view_0");
    let of = |protocol| ResultEvaluation {
        labels: folder.path().into(),
        views: WantedViews::Labeled,
        photos: None,
        max_side_px: None,
        protocol,
    };
    let opened = || CompareSubject::of_result(sample("langsplat_v2/output"), Path::new("x"));
    let scores = |protocol| evaluate(opened(), &of(protocol), &mut given, &mut Silent);
    let found = scores(Protocol::Langsplat).expect("measured");
    let rows: Vec<CutRule> = found.rules.iter().map(|r| r.rule).collect();
    assert_eq!(rows, [CutRule::Own, CutRule::LangSplat, CutRule::Common]);
    let [own, langsplat, common] = &found.rules[..] else { panic!("three rules") };
    assert_eq!((common.miou, common.localization, found.queries), (1.0, Some(1.0), 1));
    assert_eq!(own.words, langsplat.words, "its own rule is LangSplat's");
    assert!(langsplat.miou < 1.0 && common.words != own.words);
    assert_eq!((found.views.as_slice(), found.argmax_miou), (&["view_0".to_owned()][..], None));
    let classes = scores(Protocol::Ovs3d).expect("measured");
    assert!(classes.argmax_miou.is_some_and(|miou| miou < 1.0), "one class has every pixel");
    let e = scores(Protocol::Strokes).expect_err("refused").to_string();
    assert!(e.contains("strokes") && e.contains("3d-ovs"), "{e}");
    let none = CompareSubject::of_another_method(&samples().join("mip_splatting"), &ResultOptions::default());
    assert!(none.expect("no error").is_none(), "a plain training");
}
