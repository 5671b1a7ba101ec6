//! What each action does.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::app::App;
use super::camera;
use super::chat::Snapshot;
use super::dialogs::{Chosen, Purpose, Question};
use super::state::Tone;
use super::viewport::brush::Brush;
use super::viewport::drawing::Drawing;
use crate::agent::scene::{Effect, Parts};
use crate::measure::is_report;
use crate::navigate::target::Wish;
use crate::pipeline::semantics::edit::Edit;
use crate::pipeline::train::TrainConfig;
use crate::scene::IdentityId;
use crate::scene::plan::When;
use crate::worker::{Action, Command, EditRequest, Failure, FilmRequest, JobKind, Pane, VisitRequest, Visited};

impl App {
    /// Does what a person asked for.
    pub(super) fn act(&mut self, action: Action, ctx: &egui::Context) {
        match action {
            Action::TryDemo => self.replace_scene(Action::TryDemo),
            Action::Open(path) if is_report(&path) => self.read_report(path, false),
            Action::Open(path) => self.replace_scene(Action::Open(path)),
            Action::OpenFolder => self.choose(Purpose::OpenFolder),
            Action::OpenFile => self.choose(Purpose::OpenFile),
            Action::ExportPly => self.choose(Purpose::ExportPly),
            Action::Screenshot => self.choose(Purpose::Screenshot),
            Action::StartTraining => self.start_training(),
            Action::PauseTraining => {
                if let Some(job) = self.state.job.as_ref().filter(|j| j.kind == JobKind::Train) {
                    self.worker.set_paused(job.id, !job.paused);
                }
            }
            Action::Cancel => {
                if let Some(job) = &self.state.job {
                    self.worker.cancel(job.id);
                }
            }
            Action::Evaluate => self.evaluate(),
            Action::FindObjects => self.find_objects(None),
            Action::ChooseMasks => self.choose(Purpose::Masks),
            Action::FetchModel(id) => self.submit(Command::InstallModel { id, brought: None }),
            Action::AddModel(id) => self.choose(Purpose::Model(id)),
            Action::TypeQuestion => self.type_question(),
            Action::Ask(text) => {
                if let Some(semantics) = self.state.semantics.clone() {
                    self.viewport.questions.ask(&text, &semantics);
                }
            }
            Action::Show(mode) => self.layout.mode = mode,
            Action::ChooseReport => self.choose(Purpose::Report),
            Action::ChooseSecondReport => self.choose(Purpose::SecondReport),
            Action::OpenReport(path) => self.read_report(path, false),
            Action::CompareReport(path) => self.read_report(path, true),
            Action::EndComparison => self.state.second_report = None,
            Action::MeasureDrawing => self.measure_drawing(),
            Action::ApplySetting(stage, knobs) => self.apply_setting(stage, &knobs),
            Action::ResetDrawing => self.viewport.drawing = Drawing::default(),
            Action::ToggleTimes => self.layout.times = !self.layout.times,
            Action::ToggleCompare => {
                self.layout.compare = !self.layout.compare;
                if self.layout.compare && self.viewport.photo_index().is_none() {
                    self.view(&Action::NextPhoto, ctx);
                }
            }
            Action::ToggleCameras => self.layout.cameras = !self.layout.cameras,
            Action::TogglePane(pane) => self.layout.toggle(pane),
            Action::Palette => self.palette.toggle(),
            Action::Shortcuts => self.sheet = !self.sheet,
            Action::Quit => ctx.send_viewport_cmd(egui::ViewportCommand::Close),
            Action::Change(edit) => self.edit(Some(EditRequest::Apply(edit))),
            Action::AddPainted => {
                let request = self.viewport.brush.as_ref().and_then(Brush::request);
                self.viewport.brush = None;
                self.edit(request);
            }
            Action::Undo => self.edit(self.state.undo.last().cloned().map(EditRequest::Restore)),
            Action::Redo => self.edit(self.state.redo.last().cloned().map(EditRequest::Restore)),
            Action::GoToTarget(id, side) => self.visit(id, Wish { side, ..Wish::default() }),
            Action::PlayPath => self.camera.toggle(),
            Action::StepBack => self.step_in_time(-1.0, ctx),
            Action::StepForward => self.step_in_time(1.0, ctx),
            Action::AddKey => {
                self.camera.record(&self.viewport.pose());
                self.layout.hidden.retain(|p| *p != Pane::Camera);
            }
            Action::OpenPath => self.choose(Purpose::OpenPath),
            Action::SavePath => self.choose(Purpose::SavePath),
            Action::SaveFilm => self.choose(Purpose::SaveFilm),
            Action::SaveTalk => self.choose(Purpose::SaveTalk),
            Action::Talk => {
                self.layout.hidden.retain(|p| *p != Pane::Chat);
                self.chat.start_typing();
            }
            Action::ExportTarget(id) => self.choose(Purpose::ExportTarget(id)),
            Action::FrameScene
            | Action::Paint(_)
            | Action::Isolate(_)
            | Action::Hide(_)
            | Action::ResetView
            | Action::TurnUp(_)
            | Action::PreviousPhoto
            | Action::NextPhoto
            | Action::GoToPhoto(_) => {
                self.view(&action, ctx);
            }
        }
    }

    fn view(&mut self, action: &Action, ctx: &egui::Context) {
        let now = ctx.input(|i| i.time);
        self.viewport.act(action, &self.state, &self.worker, now);
    }

    /// Opens something else; asks first if that ends a running job.
    fn replace_scene(&mut self, action: Action) {
        match self.state.job.as_ref().map(|j| (j.kind, j.title.clone())) {
            None => self.open(action),
            Some((_, title)) => {
                self.question = Some(Question {
                    text: format!("{title} is still running. Cancel it and go on? What it has saved so far stays."),
                    yes: "Cancel it and go on",
                    no: "Keep it running",
                    action,
                });
            }
        }
    }

    /// Cancels what runs and does the action next.
    pub(super) fn give_up_and(&mut self, action: Action) {
        if let Some(job) = &self.state.job {
            self.worker.cancel(job.id);
        }
        self.open(action);
    }

    fn open(&mut self, action: Action) {
        let command = match action {
            Action::Open(path) => Command::Open { path },
            _ => Command::Demo,
        };
        self.submit(command);
    }

    pub(super) fn submit(&mut self, command: Command) {
        let title = command.title();
        if let Err(e) = self.worker.submit(command) {
            self.state.toast(Tone::Warning, format!("{title}: {e}"));
        }
    }

    fn start_training(&mut self) {
        let scene = self.state.scene.as_ref();
        let Some((dataset, out)) = scene.and_then(|s| Some((s.dataset.clone()?, s.out.clone()))) else {
            self.state.toast(Tone::Warning, "Open a folder of posed photos first: training needs them.");
            return;
        };
        if let Some(job) = &self.state.job {
            let text = format!("{} is still running; cancel it first (Esc).", job.title);
            self.state.toast(Tone::Warning, text);
            return;
        }
        let config = TrainConfig { max_side_px: self.state.plan.train_side_px, ..self.layout.config.clone() };
        self.state.antialias = config.antialias;
        self.submit(Command::Train { dataset, config, out });
    }

    fn evaluate(&mut self) {
        let dataset = self.state.scene.as_ref().and_then(|s| s.dataset.clone());
        let trained = self.state.training_job.is_some() || self.state.scene.as_ref().is_some_and(|s| s.trained);
        match (dataset, self.viewport.cloud().cloned()) {
            (Some(dataset), Some(cloud)) if trained => {
                self.submit(Command::Evaluate { dataset, cloud, config: self.layout.config.clone() });
            }
            _ => self
                .state
                .toast(Tone::Warning, "Train first: quality is measured on trained Gaussians and held-out photos."),
        }
    }

    /// Finds objects and parts with these masks, those that came with the photos, or none.
    fn find_objects(&mut self, masks: Option<PathBuf>) {
        let scene = self.state.scene.clone();
        let Some((scene, dataset)) = scene.as_ref().and_then(|s| Some((s, s.dataset.clone()?))) else {
            self.state.toast(Tone::Warning, "Open a folder of posed photos first: masks are masks of photos.");
            return;
        };
        let masks = masks.or_else(|| scene.masks.clone());
        match self.viewport.cloud().cloned().filter(|_| self.state.is_trained()) {
            Some(cloud) => self.submit(Command::FindObjects {
                dataset,
                cloud,
                holdout_every: self.layout.config.holdout_every,
                settings: self.state.drawing(),
                side_px: self.state.plan.object_side_px,
                masks,
                with: self.layout.finding.clone(),
                out: scene.out.clone(),
            }),
            None => self.state.toast(Tone::Warning, "Train first: objects are made of trained Gaussians."),
        }
    }

    fn step_in_time(&mut self, pictures: f64, ctx: &egui::Context) {
        if let Some(pose) = self.camera.step(pictures) {
            self.viewport.stand(&pose, &self.state, ctx.input(|i| i.time));
        }
    }

    /// Looks at where one can go in a scene, once, where the plan wants that before anybody asks.
    pub(super) fn explore(&mut self) {
        let wanted = self.state.plan.navigation == When::Always && self.state.explored.is_none();
        let (Some(scene), Some(cloud)) = (self.state.scene.clone(), self.viewport.cloud().cloned()) else { return };
        if wanted && std::mem::replace(&mut self.explored_for, self.state.scene_number) != self.state.scene_number {
            let cameras = scene.dataset.as_ref().map(|d| d.cameras()).unwrap_or_default();
            self.submit(Command::Explore { cloud, cameras, up: self.viewport.up(&scene) });
        }
    }

    /// Looks for the way to an identity; the flight begins when it is found.
    fn visit(&mut self, id: IdentityId, wish: Wish) {
        let (scene, map, cloud) =
            (self.state.scene.clone(), self.state.semantics.clone(), self.viewport.cloud().cloned());
        let (Some(scene), Some(map), Some(cloud)) = (scene, map, cloud) else { return };
        let photos = scene.dataset.iter().flat_map(|d| &d.photos);
        self.submit(Command::Visit(Box::new(VisitRequest {
            explored: self.state.explored.clone(),
            cloud,
            cameras: photos.map(|p| p.camera.clone()).collect(),
            up: self.viewport.up(&scene),
            settings: self.state.drawing(),
            map,
            id,
            wish,
            from: self.viewport.pose(),
            aspect: self.viewport.aspect(),
        })));
    }

    /// Begins the flight that was found, or says why there is none.
    pub(super) fn visited(&mut self) {
        let Some(Visited { name, flight, problem }) = self.state.visited.take() else { return };
        match (&problem, &flight) {
            (Some(problem), Some(_)) => {
                self.state.toast(Tone::Warning, format!("{name}: {problem}. Going to the nearest place instead."));
            }
            (Some(problem), None) => self.state.toast(Tone::Warning, format!("{name}: {problem}.")),
            (None, _) => {}
        }
        if let Some(visit) = flight {
            self.viewport.turn_about(visit.target);
            self.camera.play_flight(visit.flight);
        }
    }

    /// Makes a film of what is played.
    fn make_film(&mut self, out: PathBuf) {
        let (scene, cloud) = (self.state.scene.clone(), self.viewport.cloud().cloned());
        let (Some(_), Some(cloud)) = (scene, cloud) else { return };
        let Some((cameras, settings)) = self.camera.film(&out, self.viewport.aspect()) else {
            self.state.toast(Tone::Warning, "There is nothing to film: record keys, or go to something first.");
            return;
        };
        let found = self.viewport.questions.found();
        let marked = self.state.semantics.clone().filter(|_| self.camera.mark).map(|map| (map, found));
        let draw = self.state.drawing();
        self.submit(Command::Film(Box::new(FilmRequest { cloud, draw, cameras, marked, out, settings })));
    }

    /// Sends what was typed to the assistant, with the scene as it is.
    pub(super) fn talk(&mut self) {
        let Some(text) = self.chat.wants() else { return };
        let (scene, map, cloud) =
            (self.state.scene.clone(), self.state.semantics.clone(), self.viewport.cloud().cloned());
        let (Some(scene), Some(map), Some(cloud)) = (scene, map, cloud) else {
            self.chat.answer("There is no scene with objects yet: open or train one, and find its objects.");
            return;
        };
        let photos = scene.dataset.iter().flat_map(|d| &d.photos);
        let parts = Parts {
            cloud,
            settings: self.state.drawing(),
            map,
            cameras: photos.map(|p| p.camera.clone()).collect(),
            up: self.viewport.up(&scene),
            metres: scene.metres_per_unit.or_else(|| scene.dataset.as_ref().and_then(|d| d.metres_per_unit)),
            exports: scene.out.join("exports"),
            explored: self.state.explored.clone(),
        };
        let snapshot = Snapshot {
            parts,
            scene: self.state.scene_number,
            eye: self.viewport.pose(),
            aspect: self.viewport.aspect(),
            hidden: self.viewport.visibility.hidden().collect(),
        };
        self.chat.send(text, snapshot, self.layout.chat.clone(), &self.repaint);
    }

    /// Does to the window what the assistant has done.
    pub(super) fn effect(&mut self, effect: Effect) {
        match effect {
            Effect::Fly(flight, about) => {
                if let Some(point) = about {
                    self.viewport.turn_about(point);
                }
                self.camera.play_flight(*flight);
            }
            Effect::Mark(ids) => {
                if let Some(map) = self.state.semantics.clone() {
                    let names: Vec<String> = ids.iter().take(6).map(|id| map.identities.full_name(*id)).collect();
                    self.viewport.questions.mark(&names, &map);
                }
            }
            Effect::Hidden(ids) => self.viewport.visibility.set_hidden(ids),
            Effect::Renamed(id, name) => self.ask(Action::Change(Edit::Rename(id, name))),
            Effect::Explored(explored) => self.state.explored = Some(explored),
        }
    }

    fn save_talk(&mut self, path: &Path) {
        let json = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
        let Some(text) = self.chat.transcript(json).map(str::to_owned) else { return };
        match crate::io::atomic::write(path, |w| w.write_all(text.as_bytes())) {
            Ok(()) => self.state.toast(Tone::Good, format!("Wrote {}", path.display())),
            Err(e) => self.state.fail("Saving the talk", Failure::of(&e, "")),
        }
    }

    /// Changes objects and parts; `None` is a change that there is none of.
    fn edit(&mut self, request: Option<EditRequest>) {
        let Some(request) = request else {
            self.state.toast(Tone::Warning, "There is no such change of objects and parts.");
            return;
        };
        let (scene, map, cloud) =
            (self.state.scene.clone(), self.state.semantics.clone(), self.viewport.cloud().cloned());
        if let (Some(scene), Some(map), Some(cloud)) = (scene, map, cloud) {
            let (settings, out) = (self.state.drawing(), scene.out.clone());
            self.submit(Command::EditObjects { cloud, map, settings, request, out });
        }
    }

    fn type_question(&mut self) {
        if self.state.semantics.is_some() {
            self.viewport.questions.start_typing();
        } else {
            self.state.toast(Tone::Warning, "Nothing can be asked for yet: find the objects first (Objects pane).");
        }
    }

    fn choose(&mut self, purpose: Purpose) {
        let writes = matches!(purpose, Purpose::ExportPly | Purpose::ExportTarget(_) | Purpose::Screenshot);
        if writes && self.viewport.picture().is_none() {
            self.state.toast(Tone::Warning, "There is nothing to write yet: open a scene first.");
            return;
        }
        let name = self.state.scene.as_ref().map_or_else(|| "scene".to_owned(), |s| s.name.clone());
        if let Err(e) = self.dialogs.ask(purpose, &name, Arc::clone(&self.repaint)) {
            self.state.fail("Opening the file dialog", Failure::of(&e, "Close other programs and try again."));
        }
    }

    /// Goes on with what the file dialog brought.
    pub(super) fn chosen(&mut self, answer: Chosen) {
        match answer {
            Chosen::Path(Purpose::OpenFolder | Purpose::OpenFile, path) => self.ask(Action::Open(path)),
            Chosen::Path(Purpose::Report, path) => self.read_report(path, false),
            Chosen::Path(Purpose::SecondReport, path) => self.read_report(path, true),
            Chosen::Path(Purpose::Masks, path) => self.find_objects(Some(path)),
            Chosen::Path(Purpose::Model(id), path) => self.submit(Command::InstallModel { id, brought: Some(path) }),
            Chosen::Path(Purpose::ExportPly, path) => {
                if let Some(cloud) = self.viewport.cloud().cloned() {
                    self.submit(Command::Export { cloud, path });
                }
            }
            Chosen::Path(Purpose::ExportTarget(id), path) => {
                if let (Some(cloud), Some(map)) = (self.viewport.cloud(), &self.state.semantics) {
                    let cloud = Arc::new(cloud.select(&map.members(id)));
                    self.submit(Command::Export { cloud, path });
                }
            }
            Chosen::Path(Purpose::OpenPath, path) => match camera::read(&path) {
                Ok(read) => {
                    self.camera.open(read);
                    self.layout.hidden.retain(|p| *p != Pane::Camera);
                }
                Err(message) => {
                    self.state.fail("Opening the camera path", Failure { message, remedy: String::new() });
                }
            },
            Chosen::Path(Purpose::SavePath, path) => {
                match camera::write(&path, &self.camera.path, self.viewport.aspect()) {
                    Ok(()) => self.state.toast(Tone::Good, format!("Wrote {}", path.display())),
                    Err(message) => {
                        self.state.fail("Saving the camera path", Failure { message, remedy: String::new() });
                    }
                }
            }
            Chosen::Path(Purpose::SaveFilm, path) => self.make_film(path),
            Chosen::Path(Purpose::SaveTalk, path) => self.save_talk(&path),
            Chosen::Path(Purpose::Screenshot, path) => {
                if let Some(pixels) = self.viewport.pixels() {
                    self.submit(Command::Picture { pixels: Arc::new(pixels), path });
                }
            }
            Chosen::Nothing => {}
            Chosen::NoDialog => self.state.toast(
                Tone::Warning,
                "No file dialog appeared on this system. Drop the file onto the window, or press Ctrl+P and type its path.",
            ),
        }
    }
}
