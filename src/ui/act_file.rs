//! What the actions around files do: dialogs, and what becomes of the path that is chosen.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::actions::{Action, Pane};
use super::app::App;
use super::camera;
use super::context::SceneContext;
use super::dialogs::Chosen;
use super::state::Tone;
use crate::jobs::video::VideoRequest;
use crate::render::BackendChoice;
use crate::worker::{Command, Failure};

impl App {
    pub(super) fn choose(&mut self, action: Action) {
        let writes = matches!(action, Action::ExportPly | Action::ExportTarget(_) | Action::Screenshot);
        if writes && self.viewport.picture().is_none() {
            self.state.toast(Tone::Warning, "There is nothing to save yet: open a scene first.");
            return;
        }
        let name = self.state.scene.as_ref().map_or_else(|| "scene".to_owned(), |s| s.name.clone());
        if let Err(e) = self.dialogs.ask(action, &name, Arc::clone(&self.repaint)) {
            self.state.fail("Opening the file dialog", Failure::of(&e, "Close other programs and try again."));
        }
    }

    /// Continues with what the file dialog brought.
    pub(super) fn chosen(&mut self, answer: Chosen) {
        match answer {
            Chosen::Path(Action::OpenFolder | Action::OpenFile, path) => self.ask(Action::Open(path)),
            Chosen::Path(Action::ChooseReport, path) => self.read_report(path, false),
            Chosen::Path(Action::ChooseSecondReport, path) => self.read_report(path, true),
            Chosen::Path(Action::ChooseMasks, path) => self.find_objects(Some(path)),
            Chosen::Path(Action::AddModel(id), path) => self.install_model(id, Some(path)),
            Chosen::Path(Action::ExportPly, path) => {
                if let Some(cloud) = self.viewport.cloud() {
                    self.submit(Command::Export { cloud: Arc::clone(cloud), path });
                }
            }
            Chosen::Path(Action::ExportTarget(id), path) => {
                if let (Some(cloud), Some(map)) = (self.viewport.cloud(), &self.state.semantics) {
                    let cloud = Arc::new(cloud.select(&map.members(id)));
                    self.submit(Command::Export { cloud, path });
                }
            }
            Chosen::Path(Action::OpenPath, path) => match camera::read(&path) {
                Ok(read) => {
                    self.camera.open(read);
                    self.layout.hidden.retain(|p| *p != Pane::Camera);
                }
                Err(message) => {
                    self.state.fail("Opening the camera path", Failure { message, remedy: String::new() });
                }
            },
            Chosen::Path(Action::SavePath, path) => {
                match camera::write(&path, &self.camera.path, self.viewport.aspect()) {
                    Ok(()) => self.state.toast(Tone::Good, format!("Wrote {}", path.display())),
                    Err(message) => {
                        self.state.fail("Saving the camera path", Failure { message, remedy: String::new() });
                    }
                }
            }
            Chosen::Path(Action::ExportVideo, path) => self.export_video(path),
            Chosen::Path(Action::SaveChat, path) => self.save_chat(&path),
            Chosen::Path(Action::Screenshot, path) => {
                if let Some(pixels) = self.viewport.pixels() {
                    self.submit(Command::Picture { pixels: Arc::new(pixels), path });
                }
            }
            Chosen::Path(..) | Chosen::Nothing => {}
            Chosen::NoDialog => self.state.toast(
                Tone::Warning,
                "No file dialog appeared on this system. Drop the file onto the window, or press Ctrl+P and type its path.",
            ),
        }
    }

    /// Exports a video of what is played.
    fn export_video(&mut self, out: PathBuf) {
        let Some(SceneContext { cloud, map, settings: draw, aspect, .. }) = self.context() else { return };
        let Some((cameras, settings)) = self.camera.video(&out, aspect) else {
            self.state.toast(Tone::Warning, "There is nothing to export: add keyframes, or go to something first.");
            return;
        };
        let found = self.viewport.queries.found();
        let marked = map.filter(|_| self.camera.mark).map(|map| (Arc::clone(&map), found));
        let (cloud, backend) = (Arc::clone(&cloud), BackendChoice::Auto);
        self.submit(Command::CameraSpline(Box::new(VideoRequest {
            cloud,
            draw,
            cameras,
            marked,
            out,
            settings,
            backend,
        })));
    }

    fn save_chat(&mut self, path: &Path) {
        let json = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
        let Some(text) = self.chat.transcript(json).map(str::to_owned) else { return };
        match crate::jobs::export::text(path, &text) {
            Ok(()) => self.state.toast(Tone::Good, format!("Wrote {}", path.display())),
            Err(e) => self.state.fail("Saving the conversation", Failure::of(&e, "")),
        }
    }
}
