//! Photos are added to a scene: a better one is made beside it and opened, a stop leaves everything, and so does a refusal.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use egui::{DroppedFile, Key};
use egui_kittest::kittest::Queryable;

use fmlgs::ui::actions::Action;
use fmlgs::ui::app::App;

use super::Window;
use super::edits::{boxes, window};
use crate::cli_support::files_in;

#[derive(Debug)]
struct DroppedFolder(PathBuf);

impl DroppedFile for DroppedFolder {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        Err("a folder".into())
    }
}

fn said(app: &App, text: &str) -> bool {
    app.state.log.iter().any(|line| line.text.contains(text))
}

fn out(app: &App) -> PathBuf {
    app.state.scene.as_ref().map(|scene| scene.out.clone()).unwrap_or_default()
}

/// Posed photos in `folder`: three of the boxes' own, with a spot where something is new.
fn write_more(photos: &Path, folder: &Path) {
    std::fs::create_dir_all(folder.join("images")).expect("made");
    let text = std::fs::read_to_string(photos.join("transforms.json")).expect("the boxes' photos");
    let mut list: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let frames: Vec<serde_json::Value> = list["frames"].as_array().expect("frames")[2..5].to_vec();
    for frame in &frames {
        let name = frame["file_path"].as_str().expect("a name");
        let mut picture = image::open(photos.join(name)).expect("a photo").to_rgb8();
        for (x, y) in (26..38).flat_map(|x| (19..29).map(move |y| (x, y))) {
            picture.put_pixel(x, y, image::Rgb([200, 60, 160]));
        }
        picture.save(folder.join(name)).expect("written");
    }
    list["frames"] = frames.into();
    let all = list.as_object_mut().expect("an object");
    ["train_filenames", "test_filenames", "val_filenames", "ply_file_path"]
        .iter()
        .for_each(|key| drop(all.remove(*key)));
    std::fs::write(folder.join("transforms.json"), list.to_string()).expect("written");
}

#[test]
fn photos_make_a_new_scene_beside_the_old_one_which_stays() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    let (scene, more) = (folder.path().join("scene"), folder.path().join("more"));
    write_more(&folder.path().join("photos"), &more);
    let before = files_in(&scene);
    let is_as_before = || {
        let now = files_in(&scene);
        before.iter().all(|(name, bytes)| now.get(name) == Some(bytes))
    };
    // Chosen in the menu and the dialog, and stopped at once.
    w.harness.state_mut().layout.folder = Some(folder.path().canonicalize().expect("there"));
    w.click("File");
    w.harness.run_steps(2);
    w.harness.query_all_by_label_contains("Add photos").next().expect("the entry").click();
    w.harness.run_steps(2);
    w.until("a dialog", |a| a.chooses_file());
    w.types("more");
    w.press(Key::Enter);
    w.harness.run_steps(3);
    w.click("Choose");
    w.until("the job", |a| a.state.job.is_some());
    assert!(said(w.app(), "Adding more to ") && !w.app().state.is_training());
    w.ask(Action::AddPhotos(vec![more.clone()]));
    assert!(said(w.app(), "is still running; stop it first"), "one at a time");
    w.ask(Action::Cancel);
    w.until("its end", |a| a.state.job.is_none());
    assert!(said(w.app(), "this scene is as it was") && w.app().state.error.is_none());
    assert!(out(w.app()) == scene && w.app().state.semantics.is_some() && is_as_before());
    assert!(w.app().viewport.cloud().is_some());

    // Dropped on the scene, it is asked what to do with them; the stopped run goes on.
    w.harness.input_mut().dropped_files.push(Arc::new(DroppedFolder(more.clone())));
    for _ in 0..1000 {
        w.harness.step();
        if w.shows("Add to this scene") {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    w.click("Add to this scene");
    w.until("the new scene", |a| out(a).ends_with("scene-closer") && a.state.job.is_none());
    let told = "3 photos added";
    assert!(said(w.app(), told) && said(w.app(), &format!("The scene before is unchanged in {}", scene.display())));
    assert!(is_as_before(), "the old scene is untouched");
    let opened = w.app().state.scene.clone().expect("open");
    assert_eq!(opened.dataset.as_ref().map(|d| d.photos.len()), Some(11), "with all photos");
    assert_eq!(w.app().state.semantics.as_ref().map(|map| map.identities.len()), Some(3), "and all objects");
    assert_eq!(w.app().state.recent, [folder.path().join("scene-closer"), scene.clone()]);
    w.until("its picture", |a| a.viewport.picture().is_some());

    // A file that is no picture is refused, and nothing changes.
    let text = folder.path().join("text.jpg");
    std::fs::write(&text, "no picture").expect("written");
    w.ask(Action::AddPhotos(vec![text]));
    w.until("the error", |a| a.state.error.is_some());
    assert!(w.shows("no photo is left to add") && w.shows("The open scene is unchanged."));
    w.click("Close");
    assert!(out(w.app()).ends_with("scene-closer") && !folder.path().join("scene-closer-2").exists());
}

#[test]
fn photos_that_are_not_trained_yet_get_no_others() {
    let folder = tempfile::tempdir().expect("folder");
    boxes(folder.path());
    let (photos, more) = (folder.path().join("photos"), folder.path().join("more"));
    write_more(&photos, &more);
    let mut w = Window::new(Some(Action::Open(photos)));
    w.until("the photos", |a| a.state.scene.is_some());
    w.ask(Action::AddFolder);
    assert!(said(w.app(), "Train the scene first") && !w.app().chooses_file());
    w.ask(Action::AddPhotos(vec![more.clone()]));
    assert!(w.app().state.job.is_none());
    // Without a trained scene, a dropped folder is opened as ever.
    w.harness.input_mut().dropped_files.push(Arc::new(DroppedFolder(more.clone())));
    w.until("the others", |a| a.state.scene.as_ref().is_some_and(|s| s.name == "more"));
}
