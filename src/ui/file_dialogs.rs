//! Choice of files and folders: by the system's dialog if there is one, else by the window's own.

use std::path::{Path, PathBuf};
use std::pin::Pin;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, Sender, bounded};
use egui::{Align2, Context, Id, LayerId, Order, TextEdit};
use egui_file::FileDialog;
use rfd::{AsyncFileDialog, FileHandle};

use super::dialogs::show_question;
use crate::worker::Repaint;

/// Least time in which a user closes a dialog: one that ends sooner is missing on the system.
const NO_DIALOG: Duration = Duration::from_millis(500);

/// Kind of path to choose.
enum Kind {
    Folder,
    /// A file of this kind, with these endings.
    File(&'static str, &'static [&'static str]),
    /// A file to write, with the proposed name.
    Save(String),
}

/// What `A`, the window, does with the chosen path.
type Then<A> = Box<dyn FnOnce(&mut A, PathBuf)>;

/// A request for a path.
pub(super) struct FileRequest {
    title: String,
    kind: Kind,
}

impl FileRequest {
    /// A folder.
    pub(super) fn folder(title: impl Into<String>) -> Self {
        Self { title: title.into(), kind: Kind::Folder }
    }

    /// A file of the kind `files`, with one of these endings.
    pub(super) fn file(title: impl Into<String>, files: &'static str, endings: &'static [&'static str]) -> Self {
        Self { title: title.into(), kind: Kind::File(files, endings) }
    }

    /// A file to write, with the proposed name.
    pub(super) fn save(title: impl Into<String>, name: String) -> Self {
        Self { title: title.into(), kind: Kind::Save(name) }
    }
}

/// A request whose dialog is open.
struct Open<A> {
    request: FileRequest,
    then: Then<A>,
    /// Folder in which the dialog opens.
    folder: PathBuf,
}

/// The window's own dialog.
struct Own<A> {
    open: Open<A>,
    dialog: FileDialog,
    /// An existing file that is replaced if the user confirms.
    replaces: Option<PathBuf>,
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
    own: Option<Own<A>>,
    /// True if the system has turned out to have no dialog.
    own_only: bool,
}

impl<A> Default for FileDialogs<A> {
    fn default() -> Self {
        let (sender, answers) = bounded(1);
        Self { sender, answers, asked: None, own: None, own_only: false }
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
        let folder = folder.filter(|f| f.is_dir()).map(Path::to_path_buf);
        let folder = folder.or_else(std::env::home_dir).unwrap_or_else(|| "/".into());
        let open = Open { request, then, folder };
        if self.own_only {
            self.own = Some(Own::new(open));
            return Ok(());
        }
        let request = &open.request;
        let system = AsyncFileDialog::new().set_title(&request.title).set_directory(&open.folder);
        // Some systems need the dialog made on the window's thread, but that thread must not wait for it.
        let answer: Pin<Box<dyn Future<Output = Option<FileHandle>> + Send>> = match &request.kind {
            Kind::Folder => Box::pin(system.pick_folder()),
            Kind::File(files, endings) => {
                Box::pin(system.add_filter(*files, endings).add_filter("All files", &["*"]).pick_file())
            }
            Kind::Save(file) => Box::pin(system.set_file_name(file).save_file()),
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

    /// Draws the window's own dialog. Returns the path chosen in either dialog, with what is done with it.
    pub(super) fn show(&mut self, ctx: &Context) -> Option<(Then<A>, PathBuf)> {
        if let Ok(answer) = self.answers.try_recv()
            && let Some(open) = self.asked.take()
        {
            match answer {
                Answer::Path(path) => return Some((open.then, path)),
                Answer::Closed => {}
                Answer::NoDialog => {
                    self.own_only = true;
                    self.own = Some(Own::new(open));
                }
            }
        }
        let chosen = self.own.as_mut()?.show(ctx)?;
        let Own { open, .. } = self.own.take()?;
        chosen.map(|path| (open.then, path))
    }
}

impl<A> Own<A> {
    fn new(open: Open<A>) -> Self {
        let request = &open.request;
        let dialog = match &request.kind {
            Kind::Folder => FileDialog::select_folder(),
            Kind::File(_, endings) => {
                let endings = *endings;
                let fits = move |path: &Path| {
                    path.extension().is_some_and(|e| endings.iter().any(|one| e.eq_ignore_ascii_case(one)))
                };
                FileDialog::open_file().show_files_filter(Box::new(fits))
            }
            Kind::Save(name) => FileDialog::save_file().default_filename(name),
        };
        let mut dialog = dialog
            .id(own_layer().id)
            .title(&request.title)
            .initial_path(&open.folder)
            .show_rename(false)
            .show_new_folder(matches!(request.kind, Kind::Save(_)))
            .anchor(Align2::CENTER_CENTER, [0.0, 0.0])
            .default_size([560.0, 380.0])
            .keep_on_top(true);
        dialog.open();
        Self { open, dialog, replaces: None }
    }

    /// Draws the dialog. `Some(None)` once it is closed without a path.
    fn show(&mut self, ctx: &Context) -> Option<Option<PathBuf>> {
        if let Some(path) = &self.replaces {
            let text = format!("{} already exists. Replace it?", path.display());
            let replace = show_question(ctx, &text, "Replace", "Choose another name")?;
            let path = self.replaces.take();
            if replace {
                return Some(path);
            }
            self.dialog.open();
        }
        ctx.memory_mut(|m| m.set_modal_layer(own_layer()));
        let state = self.dialog.show(ctx).state();
        name_fields(ctx);
        match state {
            egui_file::State::Open => None,
            egui_file::State::Selected => {
                let path = self.dialog.path().map(Path::to_path_buf)?;
                if matches!(self.open.request.kind, Kind::Save(_)) && path.exists() {
                    self.replaces = Some(path);
                    return None;
                }
                Some(Some(path))
            }
            egui_file::State::Cancelled | egui_file::State::Closed => Some(None),
        }
    }
}

/// Layer of the window's own dialog.
fn own_layer() -> LayerId {
    LayerId::new(Order::Middle, Id::unique("file dialog"))
}

/// Labels the dialog's fields for accessibility, which its crate does not.
fn name_fields(ctx: &Context) {
    let all: Vec<Id> = ctx.viewport(|v| v.this_pass.widgets.get_layer(own_layer()).map(|w| w.id).collect());
    let fields = all.into_iter().filter(|id| TextEdit::load_state(ctx, *id).is_some());
    for (field, name) in fields.zip(["Folder", "File name"]) {
        ctx.accesskit_node_builder(field, |node| node.set_label(name));
    }
}
