//! Choice of files and folders: by the system's dialog if there is one, else by the window's own.

mod format_list;
mod listing;
mod own;
mod place;
mod request;
mod rows;
mod verdict;

use std::path::{Path, PathBuf};
use std::pin::Pin;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, Sender, bounded};
use egui::Context;
use rfd::{AsyncFileDialog, FileHandle};

use self::own::OwnDialog;
pub(crate) use self::request::FileFormat;
pub(super) use self::request::FileRequest;
use self::request::PathPurpose;
use super::file_kind::FileKind;
use crate::worker::Repaint;

/// Least time in which a user closes a dialog: one that ends sooner is missing on the system.
const NO_DIALOG: Duration = Duration::from_millis(500);

/// What `A`, the window, does with the chosen path.
type Then<A> = Box<dyn FnOnce(&mut A, PathBuf)>;

/// A request whose dialog is open.
struct Open<A> {
    request: FileRequest,
    then: Then<A>,
    /// Folder in which the dialog opens.
    folder: PathBuf,
}

/// Result of the system's dialog.
enum Answer {
    Path(PathBuf),
    Closed,
    NoDialog,
}

/// File dialogs; the system's runs off the window's thread.
pub(crate) struct FileDialogs<A> {
    sender: Sender<Answer>,
    answers: Receiver<Answer>,
    /// Request that the system's dialog is open for.
    asked: Option<Open<A>>,
    /// The window's own dialog.
    own: Option<(Open<A>, OwnDialog)>,
    repaint: Option<Repaint>,
    /// True if the system has turned out to have no dialog.
    own_only: bool,
}

impl<A> Default for FileDialogs<A> {
    fn default() -> Self {
        let (sender, answers) = bounded(1);
        Self { sender, answers, asked: None, own: None, repaint: None, own_only: false }
    }
}

impl<A> FileDialogs<A> {
    /// Shows a dialog that opens in `folder`, unless one is open already.
    pub(super) fn ask(
        &mut self,
        request: FileRequest,
        folder: Option<&Path>,
        repaint: Repaint,
        then: Then<A>,
    ) -> std::io::Result<()> {
        if self.asked.is_some() || self.own.is_some() {
            return Ok(());
        }
        let folder = request.start.as_deref().or(folder).filter(|f| f.is_dir()).map(Path::to_path_buf);
        let folder = folder.or_else(std::env::home_dir).unwrap_or_else(|| "/".into());
        let open = Open { request, then, folder };
        self.repaint = Some(repaint.clone());
        if self.own_only {
            self.own = Some(open.in_window(&repaint));
            return Ok(());
        }
        let request = &open.request;
        let system = AsyncFileDialog::new().set_title(&request.title).set_directory(&open.folder);
        // Some systems need the dialog made on the window's thread, but that thread must not wait for it.
        let filtered = |mut dialog: AsyncFileDialog| {
            // The first is what the system proposes.
            let (before, after) = request.formats.split_at(request.format.min(request.formats.len()));
            for format in after.iter().chain(before).filter(|f| !f.extensions().is_empty()) {
                dialog = dialog.add_filter(format.name, &format.extensions());
            }
            dialog
        };
        let answer: Pin<Box<dyn Future<Output = Option<FileHandle>> + Send>> = match &request.purpose {
            PathPurpose::Folder { .. } => Box::pin(system.set_can_create_directories(request.creates()).pick_folder()),
            PathPurpose::Open => Box::pin(filtered(system).add_filter("All files", &["*"]).pick_file()),
            PathPurpose::Save(_) => Box::pin(filtered(system).set_file_name(request.proposed()).save_file()),
        };
        let sender = self.sender.clone();
        std::thread::Builder::new().name("file dialog".into()).spawn(move || {
            let start = Instant::now();
            let answer = match pollster::block_on(answer) {
                Some(file) => Answer::Path(file.path().to_path_buf()),
                None if start.elapsed() < NO_DIALOG => Answer::NoDialog,
                None => Answer::Closed,
            };
            // The window may be closed by now.
            let _ = sender.send(answer);
            repaint();
        })?;
        self.asked = Some(open);
        Ok(())
    }

    /// True if the window's own dialog is open, which then takes the keys.
    pub(crate) fn is_own_open(&self) -> bool {
        self.own.is_some()
    }

    /// Draws the window's own dialog. Returns the path chosen in either dialog, with its kind and what is done with it.
    pub(super) fn show(&mut self, ctx: &Context) -> Option<(Then<A>, FileKind, PathBuf)> {
        if let Ok(answer) = self.answers.try_recv()
            && let Some((open, repaint)) = self.asked.take().zip(self.repaint.clone())
        {
            match answer {
                Answer::Path(path) => match open.with_ending(&path) {
                    // The system asked about the name without its ending.
                    Some(complete) if complete.exists() => {
                        let (open, dialog) = open.in_window(&repaint);
                        self.own = Some((open, dialog.replacing(complete)));
                    }
                    complete => return Some((open.then, open.request.kind, complete.unwrap_or(path))),
                },
                Answer::Closed => {}
                Answer::NoDialog => {
                    self.own_only = true;
                    self.own = Some(open.in_window(&repaint));
                }
            }
        }
        let chosen = self.own.as_mut()?.1.show(ctx)?;
        let (open, _) = self.own.take()?;
        chosen.map(|path| (open.then, open.request.kind, path))
    }
}

impl<A> Open<A> {
    /// The same request in the window's own dialog.
    fn in_window(self, repaint: &Repaint) -> (Self, OwnDialog) {
        let dialog = OwnDialog::new(self.request.clone(), self.folder.clone(), repaint.clone());
        (self, dialog)
    }

    /// The path of a file to write with its ending; `None` if it has one.
    fn with_ending(&self, path: &Path) -> Option<PathBuf> {
        let name = path.file_name()?.to_string_lossy();
        let complete = self.request.completed(&name, self.request.format);
        (self.request.saves() && complete != name).then(|| path.with_file_name(complete))
    }
}
