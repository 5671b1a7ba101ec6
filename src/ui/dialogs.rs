//! Dialogs: choosing files, errors, and queries before something is given up.

use std::path::PathBuf;
use std::pin::Pin;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, Sender, bounded};
use egui::{Id, Modal, RichText};
use rfd::{AsyncFileDialog, FileHandle};

use super::state::{ErrorBox, Tone};
use super::theme;
use crate::ui::actions::Action;
use crate::worker::Repaint;

pub(crate) enum Chosen {
    /// This path, for the action that asked for one.
    Path(Action, PathBuf),
    /// A user closed the dialog.
    Nothing,
    /// It closed faster than anybody could: the system has no such dialog.
    NoDialog,
}

/// Asks the system for paths, off the window's thread.
pub(crate) struct FileDialogs {
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
    /// Shows the system's dialog for an action that needs a path, unless one is open already.
    pub(crate) fn ask(&mut self, action: Action, name: &str, repaint: Repaint) -> std::io::Result<()> {
        let Some((title, dialog)) = dialog(&action, name).filter(|_| !self.open) else { return Ok(()) };
        let title = AsyncFileDialog::new().set_title(title);
        // Some systems want the dialog made on the window's thread; waiting for it is what must not happen here.
        let answer: Pin<Box<dyn Future<Output = Option<FileHandle>> + Send>> = match dialog {
            Dialog::Folder => Box::pin(title.pick_folder()),
            Dialog::File(files, endings) => {
                Box::pin(title.add_filter(files, endings).add_filter("All files", &["*"]).pick_file())
            }
            Dialog::Save(file) => Box::pin(title.set_file_name(file).save_file()),
        };
        let sender = self.sender.clone();
        std::thread::Builder::new().name("file dialog".into()).spawn(move || {
            let start = Instant::now();
            let chosen = match pollster::block_on(answer) {
                Some(file) => Chosen::Path(action, file.path().to_path_buf()),
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
    pub(crate) fn answer(&mut self) -> Option<Chosen> {
        let answer = self.answers.try_recv().ok()?;
        self.open = false;
        Some(answer)
    }
}

/// What is to be chosen.
enum Dialog {
    Folder,
    /// A file of this kind, with these endings.
    File(&'static str, &'static [&'static str]),
    /// Where to write a file, with the name that is proposed.
    Save(String),
}

/// Title and dialog of an action that needs a path; `name` is the scene's.
fn dialog(action: &Action, name: &str) -> Option<(String, Dialog)> {
    let save = |ending: &str| Dialog::Save(format!("{name}{ending}"));
    let (title, dialog) = match action {
        Action::OpenFolder => ("Open a folder of photos or a trained scene", Dialog::Folder),
        Action::OpenFile => ("Open a scene", Dialog::File("Scenes", &["ply", "json", "toml"])),
        Action::AddModel(id) => return Some((format!("Choose the folder with the files of {id}"), Dialog::Folder)),
        Action::ChooseMasks => ("Choose the folder with the masks", Dialog::Folder),
        Action::ExportPly | Action::ExportTarget(_) => ("Export Gaussians", save(".ply")),
        Action::OpenPath => ("Open a camera path", Dialog::File("Camera paths", &["json"])),
        Action::ChooseReport | Action::ChooseSecondReport => ("Open a report", Dialog::File("Reports", &["json"])),
        Action::SavePath => ("Save the camera path", save("-path.json")),
        Action::SaveChat => ("Save the conversation", save("-conversation.md")),
        Action::ExportVideo => ("Export video", save(".mp4")),
        Action::Screenshot => ("Save the view", save(".png")),
        _ => return None,
    };
    Some((title.to_owned(), dialog))
}

/// A question before something is given up.
pub(crate) struct Question {
    pub(crate) text: String,
    /// The button that goes ahead.
    pub(crate) yes: &'static str,
    /// The button that does not.
    pub(crate) no: &'static str,
    pub(crate) action: Action,
}

/// Shows an error until it is read. Returns whether it was.
pub(crate) fn show_error(ctx: &egui::Context, error: &ErrorBox) -> bool {
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

/// Asks a question. `Some(true)` to go ahead, `Some(false)` not to, `None` while no one answered.
pub(crate) fn show_question(ctx: &egui::Context, question: &Question) -> Option<bool> {
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
