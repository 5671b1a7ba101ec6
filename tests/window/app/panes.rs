//! Panes as tabs and in windows of their own, the view alone, themes and sizes.

use egui::ThemePreference;
use fmlgs::ui::actions::{Action, Pane};

use super::{Window, write_splat};

fn lists_models(w: &Window) -> bool {
    w.shows("Looking for models") || w.shows("Inference engine")
}

#[test]
fn panes_are_hidden_shown_detached_and_put_back() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = Window::new(Some(Action::Open(write_splat(folder.path()))));
    w.until("a picture", |a| a.viewport.picture().is_some_and(|p| p.full));
    w.click("Scene plan");
    assert!(w.shows("Feature maps") && !lists_models(&w), "one tab is in front");
    w.click("Models");
    assert!(lists_models(&w) && !w.shows("Feature maps"));
    w.click("Menu of Models");
    w.click("Hide");
    assert!(!w.app().layout.shows(Pane::Models) && !lists_models(&w));
    w.ask(Action::ShowPane(Pane::Models));
    assert!(lists_models(&w), "back, and in front");

    w.click("Menu of Models");
    w.click("Open in its own window");
    w.harness.run_steps(3);
    assert!(lists_models(&w) && w.shows("Feature maps"), "beside the tab that was behind it");
    w.ask(Action::ResetPanes);
    assert!(lists_models(&w) != w.shows("Feature maps"), "one tab is in front again");
    assert!(w.app().state.error.is_none());
}

#[test]
fn the_view_fills_the_window_and_gives_it_back() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = Window::new(Some(Action::Open(write_splat(folder.path()))));
    w.until("a picture", |a| a.viewport.picture().is_some_and(|p| p.full));
    let before = w.app().viewport.picture().expect("drawn").camera.width_px;
    w.press(egui::Key::F11);
    assert!(!w.shows("Models") && !w.shows("File"));
    w.until("a wider picture", |a| a.viewport.picture().is_some_and(|p| p.camera.width_px > before + 200));
    w.press(egui::Key::Escape);
    assert!(w.shows("Models") && w.shows("File"));
    w.until("the picture of before", |a| a.viewport.picture().is_some_and(|p| p.camera.width_px == before));
}

#[test]
fn every_theme_is_readable_and_the_picture_keeps_its_colors() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = Window::new(Some(Action::Open(write_splat(folder.path()))));
    w.until("a picture", |a| a.viewport.picture().is_some_and(|p| p.full));
    let corner = |w: &mut Window| w.harness.render().expect("drawn").get_pixel(4, 796).0;
    let (dark, rgb) = (corner(&mut w), w.app().viewport.picture().expect("drawn").rgb.clone());
    w.ask(Action::UseTheme(ThemePreference::Light));
    let light = corner(&mut w);
    assert!(dark[..3].iter().all(|v| *v < 60) && light[..3].iter().all(|v| *v > 200), "{dark:?} {light:?}");
    assert!(w.app().viewport.picture().expect("drawn").rgb == rgb);
    w.ask(Action::LargerText);
    w.harness.run_steps(2);
    assert!(w.harness.ctx.zoom_factor() > 1.05);
    w.ask(Action::NormalText);
    w.harness.run_steps(2);
    assert!((w.harness.ctx.zoom_factor() - 1.0).abs() < 1e-6);
}
