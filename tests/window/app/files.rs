//! Choosing files in the window's own dialog, as the system has none here, and what is decided before one is written.

use std::path::{Path, PathBuf};

use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::kittest::{NodeT, Queryable};

use fmlgs::ui::actions::Action;

use super::{Window, write_splat};

/// A window with a splat in `folder`.
fn window(folder: &Path) -> Window {
    let mut w = Window::new(Some(Action::Open(write_splat(folder))));
    w.until("a picture", |a| a.viewport.picture().is_some_and(|p| p.full));
    w.harness.state_mut().layout.folder = Some(folder.canonicalize().expect("there"));
    w
}

fn field(w: &Window, name: &str) -> String {
    w.harness.get_by_role_and_label(Role::TextInput, name).value().unwrap_or_default()
}

/// Opens the dialog for a file of the Gaussians, by keys alone.
fn export(w: &mut Window) {
    w.harness.key_press_modifiers(Modifiers::COMMAND, Key::E);
    w.harness.run_steps(3);
    w.press(Key::Enter);
    w.until("a dialog", |a| a.chooses_file());
}

fn until_written(w: &mut Window, path: PathBuf) {
    let text = format!("Saved to {}", path.display());
    w.until("it is written", |a| a.state.log.iter().any(|l| l.text.starts_with(&text)));
    assert!(path.exists() && !w.app().chooses_file());
}

#[test]
fn a_file_is_named_and_saved_by_the_keyboard_alone() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    let at = |name: &str| folder.path().canonicalize().expect("there").join(name);
    export(&mut w);
    assert!(w.harness.get_by_role_and_label(Role::TextInput, "File name").accesskit_node().is_focused());
    assert_eq!(field(&w, "File name"), "dots.ply");
    // What is typed replaces the name, not its ending.
    w.types("other");
    assert_eq!(field(&w, "File name"), "other.ply");
    w.press(Key::Enter);
    until_written(&mut w, at("other.ply"));

    // Missing folders are made once the user says so.
    export(&mut w);
    w.types("deep/er/x");
    w.press(Key::Enter);
    assert!(w.shows("does not exist.") && w.app().chooses_file() && !at("deep").exists());
    w.click("Make this folder");
    until_written(&mut w, at("deep/er/x.ply"));

    // Its own folder, shown; Escape leaves everything.
    export(&mut w);
    assert_eq!(Path::new(&field(&w, "Folder")), at("deep/er"));
    w.harness.key_press_modifiers(Modifiers::ALT, Key::ArrowUp);
    w.harness.run_steps(3);
    assert_eq!(Path::new(&field(&w, "Folder")), at("deep"));
    w.press(Key::Escape);
    assert!(!w.app().chooses_file() && w.app().state.error.is_none());
}

#[test]
fn a_file_is_found_by_arrows_and_by_its_first_letters() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    std::fs::create_dir(folder.path().join("sub")).expect("made");
    std::fs::copy(folder.path().join("dots.ply"), folder.path().join("sub/points.ply")).expect("copied");
    for name in ["sub/notes.doc", "sub/.hidden.ply"] {
        std::fs::write(folder.path().join(name), "").expect("written");
    }
    w.ask(Action::OpenFile);
    w.until("a dialog", |a| a.chooses_file());
    let listed = |w: &mut Window, name: &str| {
        for _ in 0..500 {
            w.harness.step();
            if w.harness.query_by_role_and_label(Role::ListBoxOption, name).is_some() {
                return true;
            }
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
        false
    };
    assert!(listed(&mut w, "sub"));
    w.press(Key::ArrowDown);
    w.press(Key::Enter);
    assert!(listed(&mut w, "points.ply"));
    assert!(!w.shows("notes.doc") && !w.shows(".hidden.ply"), "neither a scene nor shown");
    w.types("poi");
    w.press(Key::Enter);
    w.until("the other splat", |a| a.state.scene.as_ref().is_some_and(|s| s.name == "points"));

    w.ask(Action::OpenFile);
    w.until("a dialog", |a| a.chooses_file());
    w.types("nothing of the kind");
    w.press(Key::Enter);
    assert!(w.shows("There is no \u{201c}nothing of the kind\u{201d} here.") && w.app().chooses_file());
}

#[test]
fn endings_and_formats_choose_each_other() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    export(&mut w);
    w.click("Format");
    w.click("SPZ (.spz)");
    assert_eq!(field(&w, "File name"), "dots.spz");
    // All of the name is replaced by one with another ending.
    w.harness.get_by_role_and_label(Role::TextInput, "File name").focus();
    w.harness.run_steps(2);
    w.harness.key_press_modifiers(Modifiers::COMMAND, Key::A);
    w.harness.run_steps(2);
    w.types("a.splat");
    let chosen = |w: &Window| w.harness.get_by_role_and_label(Role::ComboBox, "Format").value().unwrap_or_default();
    assert_eq!(chosen(&w), "Splat (.splat)");
    w.harness.key_press_modifiers(Modifiers::COMMAND, Key::A);
    w.harness.run_steps(2);
    w.types("b");
    assert_eq!(chosen(&w), "Splat (.splat)", "no ending leaves the format");
    w.press(Key::Enter);
    until_written(&mut w, folder.path().canonicalize().expect("there").join("b.splat"));
}

#[test]
fn sizes_and_losses_are_known_before_gaussians_are_saved() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    w.ask(Action::ExportPly);
    for name in ["PLY (.ply)", "Compressed PLY (.compressed.ply)", "SPZ (.spz)", "SOG (.sog)", "Splat (.splat)"] {
        assert!(w.harness.query_by_role_and_label(Role::RadioButton, name).is_some(), "{name}");
    }
    for _ in 0..3000 {
        w.harness.step();
        if w.harness.query_all_by_label("\u{2026}").next().is_none() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    w.click("Splat (.splat)");
    let texts: Vec<String> = w.harness.query_all_by_role(Role::Label).filter_map(|n| n.value()).collect();
    w.click("Save\u{2026}");
    w.until("a dialog", |a| a.chooses_file());
    assert_eq!(field(&w, "File name"), "dots.splat", "in the chosen format");
    w.press(Key::Enter);
    let path = folder.path().canonicalize().expect("there").join("dots.splat");
    until_written(&mut w, path.clone());
    let bytes = std::fs::metadata(path).expect("there").len();
    let size = if bytes < 1000 { format!("{bytes} B") } else { format!("{:.1} kB", bytes as f64 / 1000.0) };
    assert!(texts.contains(&size), "{size} of {texts:?}");
    let log = &w.app().state.log;
    let line = log.iter().find(|l| l.text.starts_with("drawn from 4 views")).expect("the loss").text.clone();
    let db = line.split(": ").nth(1).and_then(|rest| rest.split(" PSNR").next()).expect("dB");
    assert!(db.ends_with("dB") && texts.iter().any(|t| t == db), "{db} of {texts:?}");
}

#[test]
fn every_kind_of_file_has_a_folder_of_its_own() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    let at = |name: &str| folder.path().canonicalize().expect("there").join(name);
    for name in ["splats", "pages"] {
        std::fs::create_dir(at(name)).expect("made");
    }
    export(&mut w);
    w.types("splats/a");
    w.press(Key::Enter);
    until_written(&mut w, at("splats/a.ply"));
    w.ask(Action::ExportPage);
    w.until("a dialog", |a| a.chooses_file());
    assert_eq!(Path::new(&field(&w, "Folder")), at(""), "not where Gaussians were written");
    w.types("pages/a");
    w.press(Key::Enter);
    until_written(&mut w, at("pages/a.html"));
    for (action, name) in [(Action::ExportPage, "pages"), (Action::Screenshot, "")] {
        w.ask(action);
        w.until("a dialog", |a| a.chooses_file());
        assert_eq!(Path::new(&field(&w, "Folder")), at(name));
        w.press(Key::Escape);
    }
    export(&mut w);
    assert_eq!(Path::new(&field(&w, "Folder")), at("splats"));
}

#[test]
fn the_arrows_choose_a_format_and_enter_never_replaces_a_file() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    let at = folder.path().canonicalize().expect("there").join("dots.ply");
    let before = std::fs::read(&at).expect("it was opened");
    w.harness.key_press_modifiers(Modifiers::COMMAND, Key::E);
    w.harness.run_steps(3);
    w.press(Key::ArrowDown);
    w.press(Key::Enter);
    w.until("a dialog", |a| a.chooses_file());
    w.harness.run_steps(3);
    let name = field(&w, "File name");
    assert!(name.starts_with("dots.") && name != "dots.ply", "the second format: {name}");
    w.press(Key::Escape);
    // Control: the format is remembered, and the arrow back chooses the first. The file is there already.
    w.harness.key_press_modifiers(Modifiers::COMMAND, Key::E);
    w.harness.run_steps(3);
    w.press(Key::ArrowUp);
    w.press(Key::Enter);
    w.until("a dialog", |a| a.chooses_file());
    w.harness.run_steps(3);
    assert_eq!(field(&w, "File name"), "dots.ply");
    w.press(Key::Enter);
    w.harness.run_steps(3);
    assert!(w.shows("already exists. Replace it?"));
    assert!(w.harness.get_by_label("Choose another name").accesskit_node().is_focused());
    w.press(Key::Enter);
    w.harness.run_steps(3);
    assert!(w.app().chooses_file() && !w.shows("already exists"), "it goes on");
    assert_eq!(std::fs::read(&at).expect("there"), before);
}

#[test]
fn tab_completes_a_begun_name_and_then_leaves_the_field() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    ["kitchen-1", "kitchen-2", "photos"]
        .iter()
        .for_each(|name| std::fs::create_dir(folder.path().join(name)).expect("made"));
    w.ask(Action::OpenFolder);
    w.until("a dialog", |a| a.chooses_file());
    for _ in 0..500 {
        w.harness.step();
        if w.shows("kitchen-1") {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    let is_in =
        |w: &Window| w.harness.get_by_role_and_label(Role::TextInput, "File name").accesskit_node().is_focused();
    w.types("ki");
    w.press(Key::Tab);
    assert_eq!((field(&w, "File name").as_str(), is_in(&w)), ("kitchen-", true), "both go on so");
    w.types("2");
    w.press(Key::Tab);
    assert_eq!((field(&w, "File name").as_str(), is_in(&w)), ("kitchen-2", false), "there is nothing to complete");
    w.press(Key::Escape);
    assert!(!w.app().chooses_file());
}

#[test]
fn a_copy_of_a_scene_has_a_name_beside_it_and_makes_its_folder() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = super::edits::window(folder.path());
    let scene = folder.path().join("scene");
    let copies = || {
        let all = std::fs::read_dir(folder.path()).expect("there").flatten().map(|entry| entry.path());
        let is_copy = |path: &PathBuf| path.file_name().is_some_and(|name| name.to_string_lossy().contains("-copy"));
        let mut copies: Vec<PathBuf> = all.filter(is_copy).collect();
        copies.sort();
        copies
    };
    for n in 1..=2 {
        w.ask(Action::SaveCopy);
        w.until("a dialog", |a| a.chooses_file());
        assert_eq!(copies().len(), n - 1, "nothing is made before the choice");
        w.press(Key::Enter);
        w.until("it is copied", |_| copies().len() == n);
        w.until("its end", |a| a.state.job.is_none());
        w.harness.run_steps(2);
    }
    assert!(w.app().state.error.is_none());
    let copies = copies();
    assert!(copies[1].to_string_lossy().ends_with("-copy-2"), "a name that is free: {copies:?}");
    for copy in copies {
        let [own, copied] = [&scene, &copy].map(|path| std::fs::read(path.join("point_cloud.ply")).expect("Gaussians"));
        assert_eq!(own, copied);
    }
}
