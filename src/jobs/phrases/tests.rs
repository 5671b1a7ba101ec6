//! Phrases on a scene of two blobs, and the written files.

use glam::DVec3;
use serde_json::Value;

use super::*;
use crate::io::labels::rle::Rle;
use crate::pipeline::observer::Silent;
use crate::scene::{Identities, Level, NO_IDENTITY};

/// A lamp on the left with its shade above, a mug on the right, seen from the front.
fn request(phrases: &[&str]) -> PhrasesRequest {
    let mut all = Identities::default();
    let lamp = all.add(Level::Object, NO_IDENTITY, vec!["lamp".into()]);
    let mug = all.add(Level::Object, NO_IDENTITY, vec!["mug".into()]);
    let shade = all.add(Level::Part, lamp, vec!["shade".into()]);
    for (id, code) in [(lamp, [0.1, 0.5, 0.5]), (mug, [0.9, 0.5, 0.5]), (shade, [0.5, 0.9, 0.1])] {
        all.get_mut(id).expect("there").code = code;
    }
    let cloud = GaussianCloud {
        positions: vec![[-0.5, 0.3, 0.0], [0.5, 0.0, 0.0], [-0.5, -0.3, 0.0]],
        log_scales: vec![[-2.0; 3]; 3],
        quaternions: vec![[1.0, 0.0, 0.0, 0.0]; 3],
        opacity_logits: vec![6.0; 3],
        sh: vec![[1.0; 3]; 3],
        ..GaussianCloud::default()
    };
    let map = SemanticMap::from_identities(all, vec![lamp, mug, shade], vec![1.0; 3], vec![]);
    let eye = |x: f64| {
        Camera::look_at(DVec3::new(x, 0.0, -3.0), DVec3::new(x, 0.0, 0.0), DVec3::NEG_Y, 0.8, 64, 48).expect("valid")
    };
    PhrasesRequest {
        cloud: Arc::new(cloud),
        map: Arc::new(map),
        settings: RenderSettings::default(),
        views: vec![("images/0.png".into(), eye(0.0)), ("images/1.png".into(), eye(9.0))],
        phrases: phrases.iter().map(|p| (*p).to_owned()).collect(),
        colors: PhraseColors::default(),
        level: LevelFilter::Auto,
        up: DVec3::NEG_Y,
        meters: None,
        recipe: QueryConfig::default(),
        top: 1,
        truth: TrueMasks::None,
        export: None,
    }
}

#[test]
fn every_phrase_is_asked_of_every_view() {
    let rows = run(&request(&["lmap shade", "mug", "giraffe"]), &mut Silent).expect("runs");
    let told: Vec<_> = rows.iter().map(|r| (&*r.view, &*r.answer, r.verdict, r.certainty, r.area_px > 0)).collect();
    assert_eq!(
        told,
        [
            ("images/0.png", "shade · lamp", "found", "certain", true),
            ("images/0.png", "mug", "found", "certain", true),
            ("images/0.png", "", "not found", "guess", false),
            ("images/1.png", "shade · lamp", "found", "certain", false),
            ("images/1.png", "mug", "found", "certain", false),
            ("images/1.png", "", "not found", "guess", false),
        ]
    );
    assert!((rows[1].share - rows[1].area_px as f64 / (64.0 * 48.0)).abs() < 1e-12);
    assert!(rows.iter().all(|r| r.iou.is_none()));
}

#[test]
fn masks_are_written_in_three_forms_and_compared_with_what_was_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut asked = request(&["lamp", "mug", "Mug!"]);
    asked.export = Some(folder.path().into());
    let rows = run(&asked, &mut Silent).expect("runs");
    // The written masks are the truth: all of it is met, and absent things stay absent.
    asked.truth = TrueMasks::Folder(folder.path().join("masks"));
    asked.export = None;
    let again = run(&asked, &mut Silent).expect("runs");
    assert!(again[..3].iter().all(|r| r.iou == Some(1.0)), "{again:?}");
    // Controls: the mug's mask is not the lamp's; a file that is not there is not compared.
    let place = |name: &str| folder.path().join("masks/images_0").join(name);
    std::fs::copy(place("mug.png"), place("lamp.png")).expect("copied");
    std::fs::remove_file(place("mug_2.png")).expect("removed");
    let wrong = run(&asked, &mut Silent).expect("runs");
    assert_eq!((wrong[0].iou, wrong[1].iou, wrong[2].iou), (Some(0.0), Some(1.0), None));

    let coco: Value = files::read_json(&folder.path().join("coco.json")).expect("JSON");
    assert_eq!(coco["categories"][2]["name"], "Mug!");
    let colors: Vec<&Value> = (0..3).map(|i| &coco["categories"][i]["color"]).collect();
    assert!(
        colors[0] != colors[1] && *colors[0] == json!(rows[0].color) && rows[0].color == rows[3].color,
        "{colors:?}"
    );
    assert_eq!(
        (coco["images"].as_array().map(Vec::len), coco["annotations"].as_array().map(Vec::len)),
        (Some(2), Some(3))
    );
    let lamp = &coco["annotations"][0];
    let rle: Rle = serde_json::from_value(lamp["segmentation"].clone()).expect("run lengths");
    let mask = rle.mask().expect("a mask");
    assert_eq!((mask.area(), mask.width_px(), mask.height_px()), (rows[0].area_px, 64, 48));
    assert_eq!(lamp["area"], rows[0].area_px);

    let csv = std::fs::read_to_string(folder.path().join("phrases.csv")).expect("text");
    assert_eq!(csv.lines().count(), 7);
    assert!(
        csv.lines().nth(2).is_some_and(|l| l.starts_with("\"images/0.png\",\"mug\",\"found\",\"certain\",\"mug\",1.0"))
    );
}

#[test]
fn lists_and_masks_that_make_no_sense_are_refused() {
    assert_eq!(listed(" lamp \n\n #3\r\n").expect("two"), ["lamp", "#3"]);
    assert!(listed("\n \n").is_err_and(|e| e.to_string().contains("one phrase per line")));
    assert!(listed(&"lamp\n".repeat(MOST + 1)).is_err_and(|e| e.to_string().contains("split")));
    let wordless = run(&request(&["?"]), &mut Silent);
    assert!(matches!(&wordless, Err(JobError::Phrases(e)) if e.contains("'?' has no word")), "{wordless:?}");
    assert!(listed("lamp\n..\n").is_err_and(|e| e.to_string().contains("line 2: '..'")));
    let place = Path::new("a/b.png");
    let fit = |w, h| fitted(Mask::from_fn(w, h, |_| true), 64, 48, place);
    assert_eq!(fit(128, 96).expect("twice the size").area(), 64 * 48);
    assert!(fit(64, 47).is_ok(), "rounding");
    assert!(fit(48, 64).is_err_and(|e| e.to_string().contains("a/b.png") && e.to_string().contains("48 x 64")));
}

#[test]
fn names_are_safe_for_files_and_tables() {
    assert_eq!(
        [stem("images/00 1.PNG"), stem("../../x.y/z"), stem("?!"), stem("手柄")],
        ["images_00_1", "x_y_z", "unnamed", "手柄"]
    );
    assert_eq!(stems(&["a b".into(), "a-b".into(), "A B".into()]), ["a_b", "a_b_2", "a_b_3"]);
    let row = PhraseRow {
        view: "v".into(),
        color: [255, 9, 0],
        phrase: "=1+\"x\"".into(),
        verdict: "found",
        certainty: "guess",
        answer: String::new(),
        score: 0.5,
        margin: 0.0,
        area_px: 1,
        share: 0.25,
        iou: Some(0.5),
    };
    assert!(csv(&[row]).ends_with(
        "\"v\",\"'=1+\"\"x\"\"\",\"found\",\"guess\",\"\",0.500000,0.000000,1,0.25000000,0.500000,#ff0900\n"
    ));
}
