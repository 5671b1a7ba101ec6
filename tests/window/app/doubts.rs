//! Reports about finding objects: doubts that lead to their photo, the order of the list, unlabeled Gaussians.

use egui::accesskit::Role;
use egui_kittest::kittest::Queryable;
use serde_json::json;

use fmlgs::io::{SceneFolder, semantic_map, trained};
use fmlgs::scene::SegmentationReport;
use fmlgs::ui::actions::{Action, Pane};
use fmlgs::ui::app::App;
use fmlgs::ui::color_by::ColorBy;

use super::{Window, edits};

/// The boxes, with what might have been noticed as they were found: one doubt about the first and the third.
fn window(folder: &std::path::Path, with_findings: bool) -> Window {
    let out = edits::boxes(folder);
    let scene = trained::load(&out).expect("a scene");
    let map = semantic_map::load(&out, scene.state.as_deref(), &scene.cloud).expect("readable");
    let mut map = map.expect("objects");
    assert_eq!((map.identities.len(), &map.findings), (3, &None), "the first version kept none");
    // Of what is nobody's, nothing is known.
    map.margin.iter_mut().zip(&map.identity_of).filter(|(_, id)| **id == 0).for_each(|(m, _)| *m = 0.0);
    let findings: SegmentationReport = serde_json::from_value(json!({
        "photos": [{ "name": scene.info.cameras[2].name, "unknown": 0.25 }, { "name": "gone.png", "unknown": 0.0 }],
        "seen": [
            { "photos": [3], "pixels": 100, "confidence": 0.5 },
            { "photos": [1], "pixels": 10, "confidence": 0.9 },
            { "photos": [], "pixels": 0, "confidence": 0.0 },
        ],
        "doubts": [{ "photo": 0, "what": { "merge": [1, 3] } }, { "photo": 1, "what": { "split": 3 } }],
    }))
    .expect("findings");
    map.findings = with_findings.then_some(findings);
    let place = SceneFolder::hold(&out, "a test").expect("ours");
    place.save(&scene.info, &scene.cloud, Some(&map)).expect("saved");
    drop(place);
    let mut w = Window::new(Some(Action::Open(out)));
    w.until("a picture at rest", |a| a.viewport.picture().is_some_and(|p| p.full));
    w.harness.state_mut().layout.hidden.extend([Pane::Training, Pane::Plan, Pane::Models, Pane::Dataset]);
    w.harness.run_steps(2);
    w
}

/// Rows from the top.
fn rows(w: &Window) -> Vec<String> {
    let mut rows: Vec<(f32, String)> = (0..3)
        .map(|i| format!("box {i}"))
        .map(|name| (w.harness.get_by_role_and_label(Role::Button, &name).rect().center().y, name))
        .collect();
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    rows.into_iter().map(|r| r.1).collect()
}

fn sort(w: &mut Window, key: &str) {
    w.click("Order of the list");
    w.click(key);
    w.harness.run_steps(2);
}

#[test]
fn a_doubt_leads_to_its_photo_and_the_list_is_sorted() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path(), true);
    assert!(w.shows("2 doubts where photos disagreed"), "the pane counts them");
    let here = |a: &App| (a.viewport.photo_index(), a.viewport.picking.selected());
    assert_eq!(here(w.app()).0, None);
    w.click("1 doubt about box 0");
    w.until("the doubt's photo", |a| here(a) == (Some(2), Some(1)));
    // Of several, the menu has each with its sentence.
    w.click("2 doubts about box 2");
    assert!(w.shows("one mask covers box 0 and box 2; they are kept apart.") && w.shows("In gone.png box 2 appears"));
    w.harness.get_by_label_contains("In gone.png").click();
    w.until("what it is about", |a| here(a) == (Some(2), Some(3)));

    w.click("2 doubts where photos disagreed");
    assert_eq!(rows(&w), ["box 2", "box 0", "box 1"]);
    sort(&mut w, "by photos");
    assert_eq!(rows(&w), ["box 0", "box 1", "box 2"]);
    w.click("Reverse the order");
    assert_eq!(rows(&w), ["box 1", "box 0", "box 2"], "of the last it is not known");
    sort(&mut w, "by confidence");
    assert_eq!(rows(&w), ["box 1", "box 0", "box 2"]);
    assert!(w.shows("90 %") && w.shows("50 %"));
    assert!(w.app().state.error.is_none() && w.is_drawn());
}

#[test]
fn a_scene_of_which_nothing_was_noticed_says_nothing_wrong() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path(), false);
    assert!(!w.shows("doubt"));
    sort(&mut w, "by photos");
    assert_eq!(rows(&w), ["box 0", "box 1", "box 2"], "in the order in which they were found");
    assert!(!w.shows("0 photos"));
}

#[test]
fn what_is_unknown_is_counted_at_rest_and_can_be_marked() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path(), true);
    assert!(!w.shows("is unknown"), "only where objects have colors");
    w.ask(Action::Tint(ColorBy::Objects));
    w.until("how much is unknown", |a| a.viewport.queries.maps().is_some());
    w.harness.run_steps(2);
    assert!(w.shows("% of this view is unknown"));
    w.click("Mark it\u{2026}");
    w.harness.run_steps(5);
    assert!(w.shows("New object: click"), "the tool");
}
