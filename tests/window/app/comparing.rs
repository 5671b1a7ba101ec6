//! Scenes and results of other methods side by side: one camera, one phrase, an answer of each.

use std::path::PathBuf;

use egui::Key;
use egui_kittest::kittest::Queryable;

use fmlgs::ui::actions::Action;
use fmlgs::ui::app::App;

use super::Window;
use super::edits::window;
use super::results::sample;
use super::views::shows_soon;
use crate::cli_support::copy;

fn areas(a: &App) -> Vec<Option<usize>> {
    a.viewport.compared.areas_px()
}

fn open_beside(w: &mut Window, path: PathBuf, count: usize) {
    w.ask(Action::OpenComparison(path));
    w.until("a scene beside", |a| a.state.beside.len() == count);
    w.until("all views", |a| a.viewport.picture().is_some_and(|p| p.full && p.beside.len() == count));
    w.harness.run_steps(2);
}

#[test]
fn one_phrase_is_asked_of_all_scenes() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    assert!(!w.shows("Scale of relevancy"), "the control: one scene has its own queries");
    let again = folder.path().join("again");
    copy(&folder.path().join("scene"), &again);
    let result = sample("langsplat", folder.path()).join("output");
    open_beside(&mut w, again.clone(), 1);
    open_beside(&mut w, result.clone(), 2);
    assert!(w.shows("Scale of relevancy") && w.shows("again") && w.shows("LangSplat: "));
    let place = w.app().viewport.pose().center;
    w.press(Key::Slash);
    w.types("box 1");
    assert_eq!(w.app().viewport.compared.phrase(), Some("box 1"));
    w.until("both answers", |a| areas(a).iter().flatten().count() == 2);
    let first = areas(w.app());
    assert!(first[0] == first[1] && first[0] > Some(0), "{first:?}: the same scene, the same answer");
    // The encoder of LangSplat is not on this computer.
    assert!(shows_soon(&mut w, "clip-vit-b16"), "why it has no answer is told in its view");
    assert!(areas(w.app())[2].is_none());
    assert_eq!(w.app().viewport.pose().center, place, "letters are no flight");

    // Another phrase has another answer, and so has another view.
    w.ask(Action::Ask("box 2".into()));
    w.until("other answers", |a| areas(a)[1].is_some_and(|area| Some(area) != first[1]) && areas(a)[0].is_some());
    let second = areas(w.app());
    w.press(Key::Escape);
    w.harness.hover_at(w.harness.get_by_label("Viewport").rect().center());
    w.harness.key_down(Key::W);
    w.until("a nearer view", |a| a.viewport.pose().center.distance(place) > 0.2);
    w.harness.key_up(Key::W);
    w.until("larger masks", |a| areas(a)[0] > second[0] && areas(a)[0] == areas(a)[1]);

    // One is closed, then all; the scene has its own queries again.
    w.ask(Action::CloseComparison(Some(again)));
    w.until("two views", |a| a.viewport.picture().is_some_and(|p| p.beside.len() == 1));
    assert!(w.shows("LangSplat: ") && w.app().state.beside[0].path == result);
    w.ask(Action::CloseComparison(None));
    w.until("one view", |a| a.viewport.picture().is_some_and(|p| p.beside.is_empty()));
    w.harness.run_steps(2);
    assert!(!w.shows("Scale of relevancy"));
}

#[test]
fn four_scenes_are_compared_at_most_and_the_sheet_is_written_once() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    for count in 1..=3 {
        let path = folder.path().join(format!("copy {count}"));
        copy(&folder.path().join("scene"), &path);
        open_beside(&mut w, path, count);
    }
    w.ask(Action::ChooseComparison);
    w.harness.run_steps(2);
    assert!(w.app().state.log.iter().any(|line| line.text.contains("4 scenes are compared at most")));
    // A sheet is of a phrase.
    let sheet = folder.path().join("sheet");
    w.ask(Action::SaveSheet(sheet.clone()));
    assert!(!sheet.exists() && w.app().state.log.iter().any(|line| line.text.contains("Type a phrase")));
    w.ask(Action::Ask("box 1".into()));
    w.until("all answers", |a| areas(a).iter().flatten().count() == 4);
    w.ask(Action::SaveSheet(sheet.clone()));
    w.until("the sheet", |a| a.state.log.iter().any(|line| line.text.contains("Compared in the view of")));
    let written = std::fs::read(sheet.join("compare.json")).expect("written");
    assert!(["compare.png", "compare.csv", "compare.html"].iter().all(|name| sheet.join(name).is_file()));
    // What is there is not replaced.
    w.ask(Action::SaveSheet(sheet.clone()));
    w.until("refused", |a| a.state.error.is_some());
    assert_eq!(std::fs::read(sheet.join("compare.json")).expect("there"), written);
}

#[test]
fn a_result_with_embeddings_alone_is_asked_in_its_view() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = Window::new(Some(Action::Open(sample("langsplat", folder.path()).join("output"))));
    w.until("a picture", |a| a.viewport.picture().is_some_and(|p| p.full));
    w.harness.run_steps(2);
    assert!(w.shows("Scale of relevancy"));
    w.press(Key::Slash);
    w.types("kettle");
    assert!(shows_soon(&mut w, "clip-vit-b16"), "the encoder that is missing is named");
    // The control: a plain training knows no language.
    let plain = folder.path().join("plain");
    copy(&std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/results/3dgs"), &plain);
    let mut w = Window::new(Some(Action::Open(plain)));
    w.until("a picture", |a| a.viewport.picture().is_some_and(|p| p.full));
    w.harness.run_steps(2);
    assert!(!w.shows("Scale of relevancy"));
}

#[test]
fn a_click_asks_what_a_point_belongs_to_and_a_result_becomes_a_scene() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = Window::new(Some(Action::Open(sample("saga", folder.path()))));
    w.until("a picture", |a| a.viewport.picture().is_some_and(|p| p.full && p.median_depth.is_some()));
    w.harness.run_steps(2);
    assert!(w.shows("Scale of relevancy") && !w.shows("Threshold"));
    // A pixel with a surface.
    let view = w.harness.get_by_label("Viewport").rect();
    let at = {
        let picture = w.app().viewport.picture().expect("drawn");
        let depth = picture.median_depth.as_ref().expect("depth");
        let (wide, high) = (picture.camera.width_px as usize, picture.camera.height_px as usize);
        let away = |i: &usize| ((i % wide) as f32 / wide as f32 - 0.5).hypot((i / wide) as f32 / high as f32 - 0.5);
        let i =
            (0..depth.len()).filter(|i| depth[*i] > 0.0).min_by(|a, b| away(a).total_cmp(&away(b))).expect("something");
        let share = egui::vec2((i % wide) as f32 / wide as f32, (i / wide) as f32 / high as f32);
        view.min + share * view.size()
    };
    w.harness.hover_at(at);
    w.harness.step();
    let (button, modifiers) = (egui::PointerButton::Primary, egui::Modifiers::NONE);
    for pressed in [true, false] {
        w.harness.event(egui::Event::PointerButton { pos: at, button, pressed, modifiers });
        w.harness.step();
    }
    w.until("the mask of the point", |a| areas(a)[0].is_some_and(|area| area > 0));
    assert!(w.shows("Threshold") && w.shows("Size"));
    w.click("Ask the phrase again");
    w.until("nothing is asked", |a| areas(a)[0].is_none());

    let made = folder.path().join("made");
    w.ask(Action::Import(made.clone()));
    w.until("the scene", |a| a.state.scene.as_ref().is_some_and(|s| s.out == made));
    assert!(made.join("scene.json").is_file() && !w.shows("Scale of relevancy"), "a scene has its own queries");
}
