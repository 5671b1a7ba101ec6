//! A photo is dropped on the demo, and finds its place.

use std::sync::Arc;

use egui::DroppedFile;

use super::*;

#[derive(Debug)]
struct PhotoFile(PathBuf);

impl DroppedFile for PhotoFile {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        std::fs::read(&self.0).map_err(|e| e.to_string())
    }
}

fn drop_file(w: &mut Window, path: &Path) {
    w.harness.input_mut().dropped_files.push(Arc::new(PhotoFile(path.to_path_buf())));
    w.harness.run_steps(3);
}

fn saves(path: &Path, pixel: impl Fn(u32, u32) -> [u8; 3]) {
    image::RgbImage::from_fn(480, 360, |x, y| image::Rgb(pixel(x, y))).save(path).expect("written");
}

#[test]
fn a_picture_of_the_demo_is_located_in_it_and_stripes_are_not() {
    let data = tempfile::tempdir().expect("folder");
    let mut w = Window::keeping(data.path().join("data"), Some(Action::OpenDemo));
    w.until("the answer", |a| !a.viewport.queries.found().is_empty());
    let [photo, stripes] = ["photo.png", "stripes.png"].map(|name| data.path().join(name));
    saves(&stripes, |x, y| if (x / 9 + y / 7) % 2 == 0 { [230, 40, 90] } else { [20, 200, 120] });
    drop_file(&mut w, &stripes);
    w.until("the refusal", |a| a.state.log.iter().any(|l| l.text.contains("No place was found for stripes.png")));
    assert!(w.app().state.located.is_empty() && w.app().viewport.photo_index().is_none());

    // From a photo's camera, turned and moved a little.
    w.ask(Action::GoToPhoto(2));
    w.harness.key_down(egui::Key::W);
    w.harness.run_steps(3);
    w.harness.key_up(egui::Key::W);
    w.until("a picture at rest", |a| a.viewport.picture().is_some_and(|p| p.full && p.psnr.is_none()));
    let picture = w.app().viewport.picture().cloned().expect("drawn");
    let (width, height) = (picture.camera.width_px, picture.camera.height_px);
    let rgb = picture.rgb.as_flattened().to_vec();
    image::RgbImage::from_raw(width, height, rgb).expect("all pixels").save(&photo).expect("written");
    w.press(egui::Key::Home);
    drop_file(&mut w, &photo);
    let own = w.app().state.scene.as_ref().and_then(|s| s.dataset.as_ref()).map_or(0, |d| d.photos.len());
    w.until("the photo", |a| a.viewport.photo_index() == Some(own));
    let away = w.app().viewport.pose().center.distance(picture.camera.center);
    assert!(away < 0.02 * picture.camera.center.length(), "{away}");
    for button in ["Save its pose", "Add to scene"] {
        assert!(w.shows(button), "{button}");
    }
    w.ask(Action::ForgetPhoto);
    assert!(!w.shows("Save its pose") && !w.shows("Add to scene"), "the control");
    assert!(w.app().state.located.is_empty() && w.app().viewport.photo_index().is_none());
}
