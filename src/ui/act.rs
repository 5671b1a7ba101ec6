//! Dispatch of the user's actions.

use std::path::PathBuf;
use std::sync::Arc;

use super::app::App;
use super::chat::Snapshot;
use super::context::SceneContext;
use super::dialogs::Question;
use super::history::EditStep;
use super::state::Tone;
use super::viewport::overrides::RenderOverrides;
use super::viewport::selecting::SelectTool;
use crate::agent::scene::{Effect, Parts};
use crate::jobs::edit::EditRequest;
use crate::jobs::go_to::{ApproachRequest, Approached};
use crate::jobs::train::IfChanged;
use crate::measure::is_report;
use crate::navigate::FRAMES;
use crate::navigate::target::ViewPreference;
use crate::pipeline::semantics::edit::Edit;
use crate::scene::IdentityId;
use crate::ui::actions::{Action, Pane};
use crate::worker::{Command, JobId};

impl App {
    /// Carries out an action of the user.
    pub(super) fn act(&mut self, action: Action, ctx: &egui::Context) {
        if self.is_about_nothing(&action) {
            return;
        }
        match action {
            Action::Open(path) if is_report(&path) => self.read_report(path, false),
            Action::Open(path) if path.extension().is_some_and(|e| e == "toml") => self.read_preset(&path),
            Action::OpenDemo | Action::TrainDemo | Action::Open(_) | Action::FindPoses(_) => self.replace_scene(action),
            Action::Connect(url) => self.connect(&url),
            Action::StartTraining => self.start_training(false, IfChanged::Ask),
            Action::TrainAnew => self.start_training(true, IfChanged::Ask),
            Action::TrainChanged(how) => self.start_training(false, how),
            Action::AskHowToTrain(changes) => self.ask_how_to_train(&changes),
            Action::PauseJob => {
                if let Some(job) = self.state.job.clone().filter(|j| j.kind.can_pause()) {
                    self.set_paused(job.id, !job.paused);
                }
            }
            Action::Cancel => self.cancel_job(),
            Action::Dismiss => self.dismiss(ctx),
            Action::InspectAt(at) => self.inspect(at),
            Action::Evaluate => self.evaluate(),
            Action::FindObjects => self.find_objects(),
            Action::SegmentPhoto => self.segment_photo(),
            Action::Remove(id) => self.remove(&[id]),
            Action::KeepArranged => self.keep_arranged(),
            Action::MeasureSplats => self.measure_splats(),
            Action::DeleteChosen => self.delete_chosen(),
            Action::AnotherFill(request) => self.submit_removal(*request),
            Action::DeleteRemoved => self.ask_to_delete_removed(),
            Action::FetchModel(id) => self.install_model(id, None),
            Action::TypeQuery => self.type_question(ctx),
            Action::Ask(text) => {
                if let Some(semantics) = self.state.semantics.clone() {
                    self.viewport.queries.ask(&text, &semantics);
                }
            }
            Action::RunPhrases(to) => self.run_phrases(to),
            Action::TrueMask(path) => self.compare_with_mask(path.as_deref()),
            Action::SetScale(meters_per_unit) => {
                if let Some(scene) = &self.state.scene {
                    let out = scene.out.clone();
                    self.submit(Command::SetScale { out, meters_per_unit });
                }
            }
            Action::Show(_)
            | Action::Tint(_)
            | Action::ToggleTimes
            | Action::ToggleCompare
            | Action::ToggleSplit
            | Action::OtherView
            | Action::ToggleDim
            | Action::OpenBeside(_)
            | Action::ToggleCameras => self.look(action, ctx),
            Action::OpenReport(path) => self.read_report(path, false),
            Action::CompareReport(path) => self.read_report(path, true),
            Action::EndComparison => self.state.second_report = None,
            Action::BenchmarkRendering => self.measure_drawing(),
            Action::ApplySetting(stage, knobs) => self.apply_setting(stage, &knobs),
            Action::ResetRenderSettings => self.viewport.overrides = RenderOverrides::default(),
            Action::TogglePane(pane) => self.layout.toggle(pane),
            Action::ShowPane(pane) => self.layout.show(pane),
            Action::FillWindow
            | Action::ResetPanes
            | Action::UseTheme(_)
            | Action::LargerText
            | Action::SmallerText
            | Action::NormalText => self.arrange(&action, ctx),
            Action::Rename => self.start_renaming(),
            Action::Palette => self.palette.toggle(),
            Action::Shortcuts => self.sheet = !self.sheet,
            Action::Quit => ctx.send_viewport_cmd(egui::ViewportCommand::Close),
            Action::Change(edit) => self.edit(EditStep::Request(EditRequest::Apply(edit))),
            Action::AddPainted => {
                if let Some(edit) = self.viewport.select.take().as_ref().and_then(SelectTool::edit) {
                    self.edit(EditStep::Request(EditRequest::Apply(edit)));
                }
            }
            Action::Undo => self.edit(EditStep::Undo),
            Action::Redo => self.edit(EditStep::Redo),
            Action::GoToTarget(id, side) => self.visit(id, ViewPreference { side, ..ViewPreference::default() }),
            Action::PlayPath | Action::StepBack | Action::StepForward if !self.camera.has_clip() => {
                self.state.toast(Tone::Info, "Nothing to play: add keyframes (K), or go to an object first.");
            }
            Action::PlayPath => self.camera.toggle(),
            Action::StepBack => self.step_in_time(-1.0, ctx),
            Action::StepForward => self.step_in_time(1.0, ctx),
            Action::AddKey => {
                self.camera.record(&self.viewport.pose());
                self.layout.show(Pane::Camera);
            }
            Action::StartChat => {
                self.layout.show(Pane::Chat);
                self.chat.start_typing();
            }
            Action::OpenFolder
            | Action::OpenFile
            | Action::ExportPly
            | Action::ExportTarget(_)
            | Action::ExportCrop
            | Action::ExportAll
            | Action::ExportPage
            | Action::Screenshot
            | Action::ChooseMasks
            | Action::AddModel(_)
            | Action::ExportPhrases
            | Action::ChooseTrueMask
            | Action::SaveTrueMask
            | Action::ChooseBeside
            | Action::ChooseReport
            | Action::ChooseSecondReport
            | Action::OpenPath
            | Action::SavePath
            | Action::ExportVideo
            | Action::SaveChat => self.choose(action),
            Action::IsolateSelected | Action::HideSelected | Action::GoToSelected => self.act_on_selected(&action, ctx),
            Action::SelectNext | Action::SelectPrevious | Action::SelectInner | Action::SelectOuter => {
                self.select_another(&action, ctx)
            }
            Action::FrameScene
            | Action::Crop
            | Action::SetCrop(_)
            | Action::Inspect
            | Action::Select(_)
            | Action::Paint(_)
            | Action::Correct(_)
            | Action::Arrange(_)
            | Action::PaintTrueMask
            | Action::BrushSplats
            | Action::Isolate(_)
            | Action::Hide(_)
            | Action::ResetView
            | Action::TurnUp(_)
            | Action::SetUp(_)
            | Action::Measure
            | Action::PreviousPhoto
            | Action::NextPhoto
            | Action::GoToPhoto(_) => {
                self.view(&action, ctx);
            }
        }
    }

    /// Opens another scene; asks first if that ends a running job.
    fn replace_scene(&mut self, action: Action) {
        // A job on another computer continues there.
        let here = |id| !self.link.as_ref().is_some_and(|link| link.owns(id));
        match self.state.job.as_ref().filter(|j| here(j.id)).map(|j| j.title.clone()) {
            None => self.open(action),
            Some(title) => {
                self.question = Some(Question {
                    text: format!("{title} is still running. Cancel it and continue? Saved progress is kept."),
                    yes: "Cancel and continue",
                    other: None,
                    no: "Keep running",
                    action,
                });
            }
        }
    }

    /// Cancels the running job, then opens what the action names.
    pub(super) fn give_up_and(&mut self, action: Action) {
        self.cancel_job();
        self.open(action);
    }

    fn open(&mut self, action: Action) {
        self.disconnect();
        let command = match action {
            Action::Open(path) => Command::Open { path },
            Action::TrainDemo => Command::DemoPhotos,
            Action::FindPoses(photos) => Command::FindPoses(photos),
            _ => Command::Demo,
        };
        self.submit(command);
    }

    pub(super) fn submit(&mut self, command: Command) -> Option<JobId> {
        if self.settled_remotely(&command) {
            return None;
        }
        let title = command.title();
        let job = self.worker.submit(command);
        job.map_err(|e| self.state.toast(Tone::Warning, format!("{title}: {e}"))).ok()
    }

    pub(super) fn install_model(&mut self, id: String, brought: Option<PathBuf>) {
        self.submit(Command::InstallModel { id, brought });
    }

    fn evaluate(&mut self) {
        let scene = self.state.scene.as_ref().and_then(|s| Some((s.dataset.clone()?, s.out.clone())));
        let trained = self.state.training_job.is_some() || self.state.scene.as_ref().is_some_and(|s| s.trained);
        match (scene, self.viewport.cloud().cloned()) {
            (Some((dataset, out)), Some(cloud)) if trained => {
                let (cloud, config) = (Arc::clone(&cloud), self.layout.config.clone());
                let settings = self.state.render_settings();
                self.submit(Command::Evaluate { dataset, cloud, config, settings, out });
            }
            _ => {
                self.state.toast(Tone::Warning, "Train first: evaluation needs trained Gaussians and held-out photos.")
            }
        }
    }

    fn step_in_time(&mut self, pictures: f64, ctx: &egui::Context) {
        if let Some(pose) = self.camera.step(pictures) {
            self.viewport.stand(&pose, &self.state, ctx.input(|i| i.time));
        }
    }

    /// Searches a flight to an identity; it begins when it is found.
    fn visit(&mut self, id: IdentityId, preference: ViewPreference) {
        let Some(SceneContext { cloud, map: Some(map), settings, cameras, up, eye, aspect, explored, .. }) =
            self.context()
        else {
            return;
        };
        let (cloud, map, from) = (Arc::clone(&cloud), Arc::clone(&map), eye);
        let frames = FRAMES;
        let request =
            ApproachRequest { explored, cloud, cameras, up, settings, map, id, preference, from, aspect, frames };
        self.submit(Command::Approach(Box::new(request)));
    }

    /// Begins the flight that was found, or reports why there is none.
    pub(super) fn visited(&mut self) {
        let Some(Approached { name, flight, problem }) = self.state.visited.take() else { return };
        match (&problem, &flight) {
            (Some(problem), Some(_)) => {
                self.state.toast(Tone::Warning, format!("{name}: {problem}. Going to the nearest place instead."));
            }
            (Some(problem), None) => self.state.toast(Tone::Warning, format!("{name}: {problem}.")),
            (None, _) => {}
        }
        if let Some(visit) = flight {
            self.viewport.turn_about(visit.target);
            self.camera.play_flight(visit.flight, name);
        }
    }

    /// Sends the typed text to the agent, with a snapshot of the scene.
    pub(super) fn send_chat(&mut self) {
        let Some(text) = self.chat.wants() else { return };
        let Some(SceneContext { scene, cloud, map: Some(map), settings, cameras, up, eye, aspect, explored }) =
            self.context()
        else {
            self.chat.answer("Open or train a scene and find its objects first.");
            return;
        };
        let snapshot = Snapshot {
            cloud: cloud.generation(),
            parts: Parts {
                cloud: Arc::clone(&cloud),
                settings,
                map: Arc::clone(&map),
                cameras,
                up,
                meters: scene.meters_per_unit(),
                exports: scene.out.join("exports"),
                folder: self.state.is_trained().then(|| scene.out.clone()),
                recipe: self.viewport.queries.recipe().clone(),
                explored,
            },
            scene: self.state.scene_number,
            eye,
            aspect,
            hidden: self.viewport.visibility.hidden().iter().copied().collect(),
            undoable: self.state.changes.last().map(str::to_owned),
        };
        self.chat.send(text, snapshot, self.layout.chat.clone(), &self.repaint);
    }

    /// Applies an effect of the agent to the window.
    pub(super) fn effect(&mut self, effect: Effect) {
        match effect {
            Effect::Fly(flight, about) => {
                if let Some(point) = about {
                    self.viewport.turn_about(point);
                }
                self.camera.play_flight(*flight, String::new());
            }
            Effect::Mark(ids) => {
                if let Some(map) = self.state.semantics.clone() {
                    let names: Vec<String> = ids.iter().take(6).map(|id| map.identities.full_name(*id)).collect();
                    self.viewport.queries.mark(&names, &map);
                }
            }
            Effect::Hidden(ids) => self.viewport.visibility.set_hidden(ids),
            Effect::Remove(ids) => self.remove(&ids),
            Effect::Undo => self.edit(EditStep::Undo),
            Effect::HiddenUndone(ids) => self.edit(EditStep::UndoHidden(ids)),
            Effect::Renamed(id, name) => self.edit(EditStep::Request(EditRequest::Apply(Edit::Rename(id, name)))),
            Effect::RenameUndone(id, name) => self.edit(EditStep::UndoRename(id, name)),
            Effect::Explored(explored) => self.state.explored = Some(explored),
        }
    }
}
