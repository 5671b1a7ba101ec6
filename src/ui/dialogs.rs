//! Dialogs: choosing files, errors, and queries before something is given up.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, Sender, bounded};
use egui::{Id, Modal, RichText};
use rfd::{AsyncFileDialog, FileHandle};

use super::state::{ErrorBox, Tone};
use super::theme;
use crate::scene::IdentityId;
use crate::ui::actions::Action;
use crate::worker::Repaint;

/// What a chosen path is for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Open this folder.
    OpenFolder,
    /// Open this file.
    OpenFile,
    /// Find objects with the masks in this folder.
    Masks,
    /// Take over the files of this model from there.
    Model(String),
    /// Write Gaussians there.
    ExportPly,
    /// Write the Gaussians of an identity there.
    ExportTarget(IdentityId),
    /// Write the frame there.
    Screenshot,
    /// Read a camera path.
    OpenPath,
    /// Write the camera path there.
    SavePath,
    /// Write a film there.
    ExportVideo,
    /// Write the conversation with the agent there.
    SaveChat,
    /// Read a report.
    Report,
    /// Read a report to compare with.
    SecondReport,
}

/// The system's answer.
pub enum Chosen {
    /// This path.
    Path(Purpose, PathBuf),
    /// A user closed the dialog.
    Nothing,
    /// It closed faster than anybody could: the system has no such dialog.
    NoDialog,
}

/// Asks the system for paths, off the window's thread.
pub struct FileDialogs {
    sender: Sender<Chosen>,
    answers: Receiver<Chosen>,
    open: bool,
}

impl Default for FileDialogs {
    fn default() -> Self {
        let (sender, answers) = bounded(1);
        Self { sender, answers, open: false }
    }
}

impl FileDialogs {
    /// Shows the system's dialog, unless one is open already.
    pub fn ask(&mut self, purpose: Purpose, name: &str, repaint: Repaint) -> std::io::Result<()> {
        if self.open {
            return Ok(());
        }
        // Some systems want the dialog made on the window's thread; waiting for it is what must not
        // happen here.
        let dialog = AsyncFileDialog::new();
        let answer: std::pin::Pin<Box<dyn Future<Output = Option<FileHandle>> + Send>> = match &purpose {
            Purpose::OpenFolder => {
                Box::pin(dialog.set_title("Open a folder of photos or a trained scene").pick_folder())
            }
            Purpose::OpenFile => Box::pin(
                dialog
                    .set_title("Open a scene")
                    .add_filter("Scenes", &["ply", "json"])
                    .add_filter("All files", &["*"])
                    .pick_file(),
            ),
            Purpose::Model(id) => {
                Box::pin(dialog.set_title(format!("Choose the folder with the files of {id}")).pick_folder())
            }
            Purpose::Masks => Box::pin(dialog.set_title("Choose the folder with the masks").pick_folder()),
            Purpose::ExportPly | Purpose::ExportTarget(_) => {
                Box::pin(dialog.set_title("Export Gaussians").set_file_name(format!("{name}.ply")).save_file())
            }
            Purpose::OpenPath => {
                Box::pin(dialog.set_title("Open a camera path").add_filter("Camera paths", &["json"]).pick_file())
            }
            Purpose::Report | Purpose::SecondReport => {
                Box::pin(dialog.set_title("Open a report").add_filter("Reports", &["json"]).pick_file())
            }
            Purpose::SavePath => Box::pin(
                dialog.set_title("Save the camera path").set_file_name(format!("{name}-path.json")).save_file(),
            ),
            Purpose::SaveChat => Box::pin(
                dialog.set_title("Save the conversation").set_file_name(format!("{name}-conversation.md")).save_file(),
            ),
            Purpose::ExportVideo => {
                Box::pin(dialog.set_title("Export video").set_file_name(format!("{name}.mp4")).save_file())
            }
            Purpose::Screenshot => {
                Box::pin(dialog.set_title("Save the view").set_file_name(format!("{name}.png")).save_file())
            }
        };
        let sender = self.sender.clone();
        std::thread::Builder::new().name("file dialog".into()).spawn(move || {
            let start = Instant::now();
            let chosen = match pollster::block_on(answer) {
                Some(file) => Chosen::Path(purpose, file.path().to_path_buf()),
                None if start.elapsed() < Duration::from_millis(200) => Chosen::NoDialog,
                None => Chosen::Nothing,
            };
            // The window may be gone by now.
            let _ = sender.send(chosen);
            repaint();
        })?;
        self.open = true;
        Ok(())
    }

    /// The answer, if one has come.
    pub fn answer(&mut self) -> Option<Chosen> {
        let answer = self.answers.try_recv().ok()?;
        self.open = false;
        Some(answer)
    }
}

/// A query before something is given up.
pub struct Question {
    /// What is asked.
    pub text: String,
    /// The button that goes ahead.
    pub yes: &'static str,
    /// The button that does not.
    pub no: &'static str,
    /// What then happens.
    pub action: Action,
}

/// Shows an error until it is read. Returns whether it was.
pub fn show_error(ctx: &egui::Context, error: &ErrorBox) -> bool {
    let response = Modal::new(Id::unique("error")).frame(theme::dialog()).show(ctx, |ui| {
        ui.set_width(480.0);
        ui.horizontal(|ui| {
            theme::mark(ui, Tone::Error, 24.0);
            ui.heading(format!("{} failed", error.doing));
        });
        ui.add_space(8.0);
        egui::ScrollArea::vertical().max_height(220.0).show(ui, |ui| ui.label(&error.failure.message));
        if !error.failure.remedy.is_empty() {
            ui.add_space(6.0);
            ui.label(RichText::new(&error.failure.remedy).color(theme::TEXT).strong());
        }
        ui.add_space(6.0);
        ui.weak("What was open is unchanged.");
        ui.add_space(12.0);
        ui.horizontal(|ui| {
            let close = ui.add(theme::primary_button("Close")).clicked();
            if ui.button("Copy message").clicked() {
                let f = &error.failure;
                ui.ctx().copy_text(format!("{}: {}\n{}", error.doing, f.message, f.remedy));
            }
            close
        })
        .inner
    });
    response.inner || response.should_close()
}

/// Asks a query. `Some(true)` to go ahead, `Some(false)` not to, `None` while no one answered.
pub fn show_question(ctx: &egui::Context, question: &Question) -> Option<bool> {
    let response = Modal::new(Id::unique("question")).frame(theme::dialog()).show(ctx, |ui| {
        ui.set_width(420.0);
        ui.label(&question.text);
        ui.add_space(12.0);
        ui.horizontal(|ui| {
            let yes = ui.add(theme::primary_button(question.yes)).clicked();
            let no = ui.button(question.no).clicked();
            if yes { Some(true) } else { no.then_some(false) }
        })
        .inner
    });
    response.inner.or_else(|| response.should_close().then_some(false))
}
