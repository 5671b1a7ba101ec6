//! The application: the parts of the window, and what they may ask of it.

use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::sync::Arc;

use super::actions::Action;
use super::arrival::PhotoArrival;
use super::camera::CameraPane;
use super::chat::Chat;
use super::ctx::Ctx;
use super::dialogs::{DialogAnswer, Question};
use super::export_dialog::ExportDialog;
use super::file_dialogs::{FileDialogs, FileRequest};
use super::find_dialog::FindDialog;
use super::help::HelpPage;
use super::history::{EditStep, Editing};
use super::keep_dialog::KeepDialog;
use super::layout::Layout;
use super::palette::Palette;
use super::panes::{
    clean::CleanPane, empty::FirstPage, models::ModelsPane, object_thumbnails::ObjectThumbnails, objects::ObjectsPane,
    photos::PhotosPane, phrases::PhrasesPane, report::ReportPane, training::TrainingPane,
};
use super::state::{AppState, Tone};
use super::stored_measurements::StoredMeasurements;
use super::stored_path::StoredPath;
use super::theme;
use super::toasts::Toasts;
use super::viewport::Viewport;
use crate::jobs::Folders;
use crate::jobs::locate::kept::PhotoLocator;
use crate::jobs::workspace::{ChangeElsewhere, Workspace};
use crate::pipeline::observer::Observer;
use crate::remote::ServerLink;
use crate::scene::plan::PlanOverride;
use crate::scene::resource_log::{self, ResourceKind};
use crate::worker::{Failure, JobId, JobInfo, Repaint, Stop, Tasks};

/// What is done once a job has ended.
type Then = Box<dyn FnOnce(&mut App)>;

/// What is done with the answer to a question.
type ThenAnswer = Box<dyn FnOnce(&mut App, DialogAnswer)>;

/// The window's application.
pub struct App {
    /// State of the window.
    pub state: AppState,
    /// Choices that are stored.
    pub layout: Layout,
    /// The view of the scene.
    pub viewport: Viewport,
    pub(super) workspace: Arc<Workspace>,
    pub(super) tasks: Tasks,
    /// What is done with the results of running jobs.
    pending: BTreeMap<JobId, Then>,
    /// Locates photos in the scene of this number.
    pub(super) locator: Option<(u64, PhotoLocator)>,
    /// The located photo that the camera flies to.
    pub(super) arrival: Option<PhotoArrival>,
    /// The server whose scene is on screen.
    pub(super) link: Option<ServerLink>,
    pub(super) repaint: Repaint,
    pub(super) dialogs: FileDialogs<Self>,
    pub(super) question: Option<(Question, ThenAnswer)>,
    pub(super) find_dialog: FindDialog,
    pub(super) export_dialog: Option<ExportDialog>,
    /// True if the dialog for a video is open.
    pub(super) asks_for_video: bool,
    pub(super) keep_dialog: Option<KeepDialog>,
    /// True if the query field is open although queries are impossible.
    pub(super) asks_in_vain: bool,
    pub(super) palette: Palette,
    pub(super) sheet: bool,
    pub(super) help: Option<HelpPage>,
    /// True once the user wants to quit while a job runs.
    pub(super) quits: bool,
    pub(super) first_page: FirstPage,
    pub(super) photos: PhotosPane,
    pub(super) thumbnails: ObjectThumbnails,
    pub(super) training: TrainingPane,
    /// The list of phrases.
    pub phrases: PhrasesPane,
    pub(super) objects: ObjectsPane,
    pub(super) models: ModelsPane,
    pub(super) clean: CleanPane,
    /// Error against run time.
    pub(crate) report: ReportPane,
    /// The camera's path and its player.
    pub(crate) camera: CameraPane,
    /// The conversation with the agent.
    pub(crate) chat: Chat,
    pub(super) measured: StoredMeasurements,
    pub(super) stored_path: StoredPath,
    /// The last change by another program that the user was asked about, with the number of its scene.
    pub(super) seen_elsewhere: Option<(u64, ChangeElsewhere)>,
    pub(super) toasts: Toasts,
    pub(super) actions: Vec<Action>,
    /// Window time of the last frame, s.
    pub(super) last_frame: f64,
    /// Lines of the trace that are in the log already.
    pub(super) traced: usize,
    /// Edits of objects and parts that wait for the running one, with the number of their scene.
    pub(super) edits: VecDeque<(u64, EditStep)>,
    pub(super) editing: Option<Editing>,
    /// True if the view fills the window.
    pub(super) full_view: bool,
    /// Counts the searches for objects that were asked for; only the newest waits for its downloads.
    pub(super) searches: u64,
    /// True if objects were known in the last frame.
    pub(super) had_objects: bool,
}

impl App {
    /// Starts the worker and carries out `first` in order; files go into `folders`. Fails only if the system cannot
    /// start threads.
    pub fn new(
        cc: &eframe::CreationContext<'_>,
        folders: Folders,
        first: impl IntoIterator<Item = Action>,
    ) -> std::io::Result<Self> {
        theme::install(&cc.egui_ctx);
        // Frames answer input. Progress is read no faster than it is written, and every frame takes computing time from
        // the job that reports it.
        let (repaint, unhurried) = (super::repainter(&cc.egui_ctx, 8), super::repainter(&cc.egui_ctx, 120));
        resource_log::record(ResourceKind::Window, "window", "the program was started", 0);
        let layout = Layout::load(cc.storage);
        cc.egui_ctx.set_theme(layout.theme);
        cc.egui_ctx.set_zoom_factor(layout.zoom);
        let mut state = AppState::new(layout.recent.clone());
        state.say(Tone::Info, format!("FMLGS {}", env!("CARGO_PKG_VERSION")));
        Ok(Self {
            workspace: Arc::new(Workspace::new(folders)),
            tasks: Tasks::start(unhurried)?,
            pending: BTreeMap::new(),
            locator: None,
            arrival: None,
            link: None,
            viewport: Viewport::new(Arc::clone(&repaint))?,
            state,
            layout,
            repaint,
            dialogs: FileDialogs::default(),
            question: None,
            find_dialog: FindDialog::default(),
            export_dialog: None,
            asks_for_video: false,
            keep_dialog: None,
            asks_in_vain: false,
            palette: Palette::default(),
            sheet: false,
            help: None,
            quits: false,
            first_page: FirstPage::default(),
            photos: PhotosPane::default(),
            thumbnails: ObjectThumbnails::default(),
            training: TrainingPane::default(),
            phrases: PhrasesPane::default(),
            objects: ObjectsPane::default(),
            models: ModelsPane::default(),
            clean: CleanPane::default(),
            report: ReportPane::default(),
            camera: CameraPane::default(),
            chat: Chat::default(),
            measured: StoredMeasurements::default(),
            stored_path: StoredPath::default(),
            seen_elsewhere: None,
            toasts: Toasts::default(),
            last_frame: 0.0,
            traced: 0,
            edits: VecDeque::new(),
            editing: None,
            full_view: false,
            searches: 0,
            had_objects: false,
            actions: first.into_iter().collect(),
        })
    }

    /// Queues an action, as a key or a button does.
    pub fn ask(&mut self, action: Action) {
        self.actions.push(action);
    }

    /// True if the window's own file dialog is open.
    pub fn chooses_file(&self) -> bool {
        self.dialogs.is_own_open()
    }

    /// The conversation so far, as Markdown, once all of it is answered.
    pub fn conversation(&self) -> Option<&str> {
        self.chat.transcript(false).filter(|_| self.chat.is_idle())
    }

    /// Sets the user's overrides of scene plans, for this run and, as they are stored, for later ones.
    pub fn override_plan(&mut self, overrides: impl IntoIterator<Item = PlanOverride>) {
        overrides.into_iter().for_each(|one| self.layout.plan.set(one));
    }

    /// Starts a job; `then` gets its result if it finishes. Returns false, with a message, if too many jobs wait.
    pub(super) fn start<T, E>(
        &mut self,
        info: JobInfo,
        work: impl FnOnce(&mut dyn Observer) -> Result<T, E> + Send + 'static,
        then: impl FnOnce(&mut Self, T) + 'static,
    ) -> bool
    where
        T: Send + 'static,
        E: Into<Stop> + 'static,
    {
        self.start_to_end(info, work, |app, _, result| {
            if let Ok(value) = result {
                then(app, value);
            }
        })
    }

    /// Starts a job; `then` gets its number and its result, or how it ended without one.
    pub(super) fn start_to_end<T, E>(
        &mut self,
        info: JobInfo,
        work: impl FnOnce(&mut dyn Observer) -> Result<T, E> + Send + 'static,
        then: impl FnOnce(&mut Self, JobId, Result<T, Stop>) + 'static,
    ) -> bool
    where
        T: Send + 'static,
        E: Into<Stop> + 'static,
    {
        let title = info.title.clone();
        match self.tasks.spawn(info, work) {
            Ok(task) => {
                let job = task.job();
                let then = move |app: &mut Self| {
                    // The result is there before the event of the end.
                    let result = task.poll().unwrap_or(Err(Stop::Cancelled));
                    then(app, job, result);
                };
                self.pending.insert(job, Box::new(then));
                true
            }
            Err(e) => {
                self.state.toast(Tone::Warning, format!("{title}: {e}"));
                false
            }
        }
    }

    /// Starts a job about the open scene: if another scene is open when it ends, its result is dropped, and `then` gets
    /// nothing.
    pub(super) fn start_in_scene<T, E>(
        &mut self,
        info: JobInfo,
        work: impl FnOnce(&mut dyn Observer) -> Result<T, E> + Send + 'static,
        then: impl FnOnce(&mut Self, Option<T>) + 'static,
    ) -> bool
    where
        T: Send + 'static,
        E: Into<Stop> + 'static,
    {
        let scene = self.state.scene_number;
        self.start_to_end(info, work, move |app, _, result| {
            let is_open = scene == app.state.scene_number;
            then(app, result.ok().filter(|_| is_open));
        })
    }

    /// Asks for a path; `then` continues with it.
    pub(super) fn choose(&mut self, request: FileRequest, then: impl FnOnce(&mut Self, PathBuf) + 'static) {
        let (folder, repaint) = (self.layout.folder_of(request.kind()), Arc::clone(&self.repaint));
        if let Err(e) = self.dialogs.ask(request, folder, repaint, Box::new(then)) {
            self.state.fail("Opening the file dialog", Failure::of(&e, "Close other programs and try again."));
        }
    }

    /// Shows a question; `then` gets the answer.
    pub(super) fn put_question(&mut self, question: Question, then: impl FnOnce(&mut Self, DialogAnswer) + 'static) {
        self.question = Some((question, Box::new(then)));
    }

    /// True if objects, parts or Gaussians are being changed, or wait for it.
    pub(super) fn is_editing(&self) -> bool {
        self.editing.is_some() || !self.edits.is_empty()
    }

    /// Applies all events since the last call, and continues after the ends of jobs.
    pub(super) fn take_events(&mut self) {
        while let Some(event) = self.tasks.next_event() {
            let ended = event.is_end().then(|| event.job());
            self.state.apply(event);
            if let Some(then) = ended.and_then(|job| self.pending.remove(&job)) {
                then(self);
            }
        }
    }

    /// The context of panes and tools, and the view.
    pub(super) fn context(&mut self) -> (Ctx<'_>, &mut Viewport) {
        let Self { state, layout, tasks, thumbnails, actions, viewport, .. } = self;
        (Ctx { state, layout, tasks, thumbnails, actions }, viewport)
    }
}
