//! The crop box and the inspector: what is drawn, told, undone and exported.

use egui::accesskit::Role;
use egui::{Key, Modifiers, OutputCommand, Pos2};
use egui_kittest::kittest::Queryable;
use glam::DVec3;

use fmlgs::scene::{Bounds, CropBox, GaussianCloud};
use fmlgs::ui::actions::Action;
use fmlgs::ui::app::App;

use super::edits::window;
use super::{Window, write_splat};

fn cloud(app: &App) -> GaussianCloud {
    (***app.viewport.cloud().expect("Gaussians")).clone()
}

fn picture(app: &App) -> Vec<[u8; 3]> {
    app.viewport.picture().expect("drawn").rgb.clone()
}

/// The boxes in a small window, drawn at the size that they have there.
fn small_window(folder: &std::path::Path) -> Window {
    let mut w = window(folder);
    w.harness.set_size([800.0, 600.0].into());
    w.harness.run_steps(3);
    let width = w.harness.get_by_label("Viewport").rect().width();
    w.until("a picture of that size", |a| {
        a.viewport.picture().is_some_and(|p| p.full && (p.camera.width_px as f32 - width).abs() < 1.0)
    });
    w
}

/// Types a number into a field of a card in place of the one there.
fn put(w: &mut Window, field: &str, number: f64) {
    w.harness.get_by_role_and_label(Role::SpinButton, field).focus();
    w.harness.run_steps(3);
    w.types(&number.to_string());
    w.press(Key::Enter);
    w.harness.run_steps(3);
}

#[test]
fn a_crop_box_is_drawn_inverted_undone_and_exported() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = small_window(folder.path());
    let whole = cloud(w.app());
    let n = whole.len();
    let before = picture(w.app());
    let bounds = Bounds { min: DVec3::splat(-100.0), max: DVec3::splat(100.0) };
    w.ask(Action::SetCrop(Some(CropBox { bounds, outside: false })));
    w.press(Key::B);
    let mut xs: Vec<f64> = (0..n).map(|i| whole.world_position(i).x).collect();
    xs.sort_by(f64::total_cmp);
    let cut = 0.5 * (xs[n / 3] + xs[n / 3 + 1]);
    let inside = xs.iter().filter(|x| **x <= cut).count();
    assert!(w.shows(&format!("{n} of {n} Gaussians")), "the box is around everything");
    put(&mut w, "To x", cut);
    // Pictures of what was typed so far, and coarser ones, come first.
    let drawn = |a: &App| a.viewport.full_picture().map(|p| p.rgb.clone());
    w.until("a picture of a third", |a| drawn(a).is_some_and(|drawn| drawn != before));
    assert!(w.shows(&format!("{inside} of {n} Gaussians")) && inside < n / 2);
    let third = picture(w.app());
    w.click("Invert");
    w.until("a picture of the rest", |a| drawn(a).is_some_and(|drawn| drawn != third));
    assert!(w.shows(&format!("{} of {n} Gaussians", n - inside)));
    w.click("Invert");
    w.until("the third", |a| picture(a) == third);

    w.harness.state_mut().layout.folder = Some(folder.path().to_path_buf());
    w.click("Export\u{2026}");
    w.harness.run_steps(3);
    w.click("Save\u{2026}");
    w.until("a dialog", |a| a.chooses_file());
    w.click("Save");
    w.until("it is written", |a| a.state.log.iter().any(|l| l.text.starts_with("Saved to ")));
    let files = std::fs::read_dir(folder.path()).expect("folder").map(|f| f.expect("file").path());
    let path = files.into_iter().find(|f| f.to_string_lossy().ends_with("-cropped.ply")).expect("a file");
    let written = fmlgs::io::splat_ply::read(&path).expect("a splat");
    assert_eq!(written.len(), inside);
    assert!((0..inside).all(|i| written.world_position(i).x <= cut + 1e-6), "what is inside and nothing else");

    w.press(Key::Escape);
    assert!(!w.shows("Fit scene") && w.shows(&format!("{inside} of {n} Gaussians")), "closed, it stays cropped");
    for what in ["inverted the crop box", "inverted the crop box", "changed the crop box", "cropped the view"] {
        let undone = format!("Undone: {what}");
        let times = |w: &Window| w.app().state.log.iter().filter(|l| l.text == undone).count();
        let so_far = times(&w);
        w.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
        w.harness.run_steps(3);
        assert_eq!(times(&w), so_far + 1, "{what}");
    }
    w.until("the picture as it was", |a| picture(a) == before);
    assert!(!w.shows(" of ") || !w.shows(&format!("of {n} Gaussians")));
    w.ask(Action::ExportCrop);
    assert!(w.shows("no crop box yet") && !w.app().chooses_file());
}

#[test]
fn a_face_of_the_crop_box_is_dragged_and_all_of_it_may_be_cropped_away() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = Window::new(Some(Action::Open(write_splat(folder.path()))));
    w.until("a picture", |a| a.viewport.picture().is_some_and(|p| p.full));
    let bounds = Bounds { min: DVec3::new(-0.1, -0.1, -0.1), max: DVec3::new(0.7, 0.6, 0.1) };
    w.ask(Action::SetCrop(Some(CropBox { bounds, outside: false })));
    w.ask(Action::Crop);
    let view = w.harness.get_by_label("Viewport").rect();
    let camera = w.app().viewport.picture().expect("drawn").camera.resized(view.width() as u32, view.height() as u32);
    let place = |p: DVec3| -> Pos2 {
        let q = camera.project(p).expect("ahead");
        view.min + egui::vec2(q.x as f32, q.y as f32)
    };
    let middle = bounds.center();
    let (from, to) = (place(DVec3::new(0.7, middle.y, middle.z)), place(DVec3::new(0.35, middle.y, middle.z)));
    let eye = w.app().viewport.pose().center;
    w.harness.drag_at(from);
    w.harness.step();
    w.harness.hover_at(to);
    w.harness.step();
    w.harness.drop_at(to);
    w.harness.run_steps(3);
    let kept = (0..40).filter(|i| (i % 7) as f64 * 0.1 <= 0.35).count();
    assert!(w.shows(&format!("{kept} of 40 Gaussians")), "the face went where the cursor went");
    assert_eq!(w.app().viewport.pose().center, eye, "and the eye stayed");
    // A drag is one change.
    w.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    w.harness.run_steps(3);
    assert!(w.app().state.log.iter().any(|l| l.text == "Undone: changed the crop box"));
    assert!(w.shows("40 of 40 Gaussians"));
    w.ask(Action::SetCrop(Some(CropBox { bounds, outside: true })));
    let dark = |a: &App| {
        let rgb = picture(a);
        rgb.iter().all(|p| *p == rgb[0])
    };
    w.until("an empty picture", |a| dark(a) && a.viewport.picture().is_some_and(|p| p.full));
    assert!(w.shows("0 of 40 Gaussians") && w.app().state.error.is_none());
}

fn copied(w: &mut Window) -> serde_json::Value {
    w.harness.get_by_label("Copy").click();
    w.harness.step();
    let commands = w.harness.output().platform_output.commands.clone();
    let text = commands.iter().find_map(|c| if let OutputCommand::CopyText(text) = c { Some(text) } else { None });
    serde_json::from_str(text.expect("something is copied")).expect("JSON")
}

#[test]
fn a_click_tells_every_property_of_the_gaussians_of_a_pixel() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = small_window(folder.path());
    w.press(Key::X);
    w.harness.run_steps(2);
    let view = w.harness.get_by_label("Viewport").rect();
    // Where box 1 is seen.
    w.ask(Action::Ask("box 1".into()));
    w.until("maps", |a| a.viewport.queries.maps().is_some());
    let maps = w.app().viewport.queries.maps().cloned().expect("maps");
    let (cols, rows) = (maps.identities.width_px, maps.identities.height_px);
    let its: Vec<usize> = (0..cols * rows).filter(|i| maps.identities.identity[*i] == 2).collect();
    let i = its[its.len() / 2];
    let at = egui::vec2((i % cols) as f32 + 0.5, (i / cols) as f32 + 0.5) / egui::vec2(cols as f32, rows as f32);
    let selected = w.app().viewport.picking.selected();
    w.harness.hover_at(view.min + at * view.size());
    w.harness.drag_at(view.min + at * view.size());
    w.harness.drop_at(view.min + at * view.size());
    w.harness.run_steps(2);
    w.until("its Gaussians", |_| true);
    let shown = |w: &Window| w.shows("1 of ") && w.shows("of the pixel");
    for _ in 0..200 {
        if shown(&w) {
            break;
        }
        w.harness.step();
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    assert!(shown(&w) && w.app().viewport.picking.selected() == selected, "the click selects nothing");
    let first = copied(&mut w);
    let whole = cloud(w.app());
    let number = first["number"].as_u64().expect("a number") as usize;
    let center: Vec<f64> = first["center"].as_array().expect("three").iter().filter_map(|v| v.as_f64()).collect();
    assert_eq!(DVec3::from_slice(&center), whole.world_position(number), "it is the Gaussian of that number");
    let map = w.app().state.semantics.clone().expect("objects");
    assert_eq!(first["identities"][0]["number"].as_u64(), Some(u64::from(map.identity_of[number])));
    assert_eq!(first["sh"].as_array().map(Vec::len), Some(whole.sh_stride()));
    w.click("Next Gaussian");
    let second = copied(&mut w);
    let weight = |json: &serde_json::Value| json["pixel"]["weight"].as_f64().expect("a weight");
    assert!(second["number"] != first["number"] && weight(&second) <= weight(&first));
    w.click("Previous Gaussian");
    assert_eq!(copied(&mut w), first);

    // Cropped, the numbers are still those of the scene.
    let bounds = Bounds { min: DVec3::from_slice(&center), max: DVec3::splat(1e6) };
    w.ask(Action::SetCrop(Some(CropBox { bounds, outside: false })));
    w.until("the rest", |a| a.viewport.picture().is_some_and(|p| p.full));
    w.ask(Action::InspectAt(glam::DVec2::new(f64::from(at.x), f64::from(at.y))));
    for _ in 0..200 {
        w.harness.step();
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    if !w.shows("No Gaussian is drawn there") {
        let json = copied(&mut w);
        let number = json["number"].as_u64().expect("a number") as usize;
        let center: Vec<f64> = json["center"].as_array().expect("three").iter().filter_map(|v| v.as_f64()).collect();
        assert_eq!(DVec3::from_slice(&center), whole.world_position(number));
    }
    w.press(Key::Escape);
    assert!(!w.shows("Next Gaussian"), "Escape puts the tool away");
}
