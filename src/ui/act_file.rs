//! Actions on files: dialogs, and what is done with the chosen path.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::actions::{Action, Pane};
use super::app::App;
use super::camera;
use super::context::SceneContext;
use super::state::Tone;
use crate::jobs::page::PageRequest;
use crate::jobs::video::VideoRequest;
use crate::jobs::{export, page, presets};
use crate::render::BackendChoice;
use crate::worker::{Command, Failure};

impl App {
    /// Reads settings for the next training from a file.
    pub(super) fn read_preset(&mut self, path: &Path) {
        match presets::read(path) {
            Ok(config) => {
                self.layout.config = config;
                self.state.toast(Tone::Good, format!("The next training uses the settings of {}", path.display()));
            }
            Err(e) => self.state.fail("Reading training settings", Failure::of(&e, "")),
        }
    }

    pub(super) fn choose(&mut self, action: Action) {
        let writes = matches!(
            action,
            Action::ExportPly | Action::ExportTarget(_) | Action::ExportCrop | Action::ExportPage | Action::Screenshot
        );
        if writes && self.viewport.picture().is_none() {
            self.state.toast(Tone::Warning, "Nothing to save yet: open a scene first.");
            return;
        }
        if action == Action::SaveTrueMask && self.viewport.queries.truth().is_none() {
            return self.state.toast(Tone::Info, "This view has no true mask: load or paint one.");
        }
        if action == Action::ExportCrop && self.viewport.visibility.crop().is_none() {
            self.state.toast(Tone::Info, "There is no crop box yet: press B.");
            return;
        }
        let scene = self.state.scene.as_ref().map_or_else(|| "scene".to_owned(), |s| s.name.clone());
        let name = match (&action, &self.state.semantics) {
            (Action::ExportCrop, _) => format!("{scene}-cropped"),
            (Action::ExportTarget(id), Some(map)) => export::identity_name(&map.identities, *id),
            _ => scene,
        };
        let folder = self.layout.folder.as_deref();
        if let Err(e) = self.dialogs.ask(action, &name, folder, Arc::clone(&self.repaint)) {
            self.state.fail("Opening the file dialog", Failure::of(&e, "Close other programs and try again."));
        }
    }

    /// Continues with the path from the file dialog.
    pub(super) fn chosen(&mut self, action: Action, path: PathBuf) {
        let folder = if path.is_dir() { Some(path.as_path()) } else { path.parent() };
        self.layout.folder = folder.map(Path::to_path_buf);
        match action {
            Action::OpenFolder | Action::OpenFile => self.ask(Action::Open(path)),
            Action::ExportPhrases => self.ask(Action::RunPhrases(Some(path))),
            Action::ChooseTrueMask => self.ask(Action::TrueMask(Some(path))),
            Action::ChooseReport => self.read_report(path, false),
            Action::ChooseSecondReport => self.read_report(path, true),
            Action::ChooseMasks => self.find_objects_by(Some(path)),
            Action::AddModel(id) => self.install_model(id, Some(path)),
            Action::ExportPly => {
                if let Some(cloud) = self.viewport.cloud() {
                    self.submit(Command::Export { cloud: Arc::clone(cloud), path });
                }
            }
            Action::ExportAll => self.export_all(path),
            Action::ExportPage => self.export_page(path),
            Action::ExportTarget(id) => {
                if let (Some(cloud), Some(map)) = (self.viewport.cloud(), &self.state.semantics) {
                    let cloud = Arc::new(cloud.select(&map.members(id)));
                    self.submit(Command::Export { cloud, path });
                }
            }
            Action::ExportCrop => {
                if let (Some(cloud), Some(crop)) = (self.viewport.cloud(), self.viewport.visibility.crop()) {
                    match export::cropped(cloud, &crop) {
                        Ok(kept) => {
                            self.submit(Command::Export { cloud: Arc::new(kept), path });
                        }
                        Err(e) => self.state.toast(Tone::Warning, format!("Nothing is exported: {e}.")),
                    }
                }
            }
            Action::OpenPath => match camera::read(&path) {
                Ok(read) => {
                    self.camera.open(read);
                    self.layout.show(Pane::Camera);
                }
                Err(message) => {
                    self.state.fail("Opening the camera path", Failure { message, remedy: String::new() });
                }
            },
            Action::SavePath => match camera::write(&path, &self.camera.path, self.viewport.aspect()) {
                Ok(()) => self.state.toast(Tone::Good, format!("Saved to {}", path.display())),
                Err(message) => {
                    self.state.fail("Saving the camera path", Failure { message, remedy: String::new() });
                }
            },
            Action::ExportVideo => self.export_video(path),
            Action::SaveChat => self.save_chat(&path),
            Action::ChooseBeside => self.ask(Action::OpenBeside(Some(path))),
            Action::SaveTrueMask => self.save_true_mask(&path),
            Action::Screenshot => match self.viewport.pixels() {
                Ok(Some(pixels)) => {
                    self.submit(Command::Picture { pixels: Arc::new(pixels), path });
                }
                Ok(None) => {}
                Err(e) => self.state.fail("Saving the picture", Failure::of(&e, "Try again once the view rests.")),
            },
            _ => {}
        }
    }

    /// Writes the scene as a page, with the camera path of the pane and those in its folder.
    fn export_page(&mut self, out: PathBuf) {
        let Some(SceneContext { scene, cloud, map, settings, cameras, .. }) = self.context() else { return };
        if let Err(e) = export::check(&out, &page::ENDINGS, &[&scene.path]) {
            return self.state.fail("Exporting the page", Failure::of(&e, ""));
        }
        let mut paths = page::paths_in(&scene.out);
        let own = &self.camera.path;
        if !own.keys.is_empty() && paths.iter().all(|(_, path)| path != own) {
            paths.insert(0, ("Camera path".to_owned(), own.clone()));
        }
        self.submit(Command::ExportPage(Box::new(PageRequest {
            title: scene.name.clone(),
            cloud: Arc::clone(&cloud),
            map: map.as_deref().map(Arc::clone),
            cameras,
            home: scene.home.clone(),
            settings,
            paths,
            out,
        })));
    }

    /// Exports a video of the loaded flight or path.
    fn export_video(&mut self, out: PathBuf) {
        let Some(SceneContext { cloud, map, settings: draw, aspect, .. }) = self.context() else { return };
        let Some((cameras, settings)) = self.camera.video(&out, aspect) else {
            self.state.toast(Tone::Warning, "Nothing to export: add keyframes, or fly to an object first.");
            return;
        };
        let found = self.viewport.queries.found();
        let marked = map.filter(|_| self.camera.mark).map(|map| (Arc::clone(&map), found));
        let (cloud, backend) = (Arc::clone(&cloud), BackendChoice::Auto);
        self.submit(Command::Video(Box::new(VideoRequest { cloud, draw, cameras, marked, out, settings, backend })));
    }

    fn save_chat(&mut self, path: &Path) {
        let json = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
        let Some(text) = self.chat.transcript(json).map(str::to_owned) else { return };
        match export::text(path, &text) {
            Ok(()) => self.state.toast(Tone::Good, format!("Saved to {}", path.display())),
            Err(e) => self.state.fail("Saving the conversation", Failure::of(&e, "")),
        }
    }
}
