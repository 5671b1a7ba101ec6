//! Selecting Gaussians by clicks and strokes in any view: to name unlabeled ones, or to correct objects and parts. The
//! selection is outlined in every view, which shows the effect of a correction elsewhere.

use std::collections::VecDeque;
use std::sync::Arc;

use egui::{Color32, ComboBox, Key, PointerButton, Pos2, Rect, Response, Slider, Stroke as Line, TextEdit, Ui};

use super::super::outline;
use super::super::picking::DrawnOutline;
use super::super::split::ViewArea;
use super::preparation::SelectionPreparation;
use super::{CardPlaces, ToolScene, ViewTool, bottom_card};
use crate::jobs::select::{self, SelectFor, SelectRequest, SelectStep, Selected, Stroke, kept_as};
use crate::math::format;
use crate::pipeline::semantics::lifting::edit::Edit;
use crate::scene::{Camera, GaussianCloud, Identities, Level, Mask, NO_IDENTITY, SemanticMap};
use crate::ui::actions::Action;
use crate::ui::ctx::Ctx;
use crate::ui::state::{AppState, Tone};
use crate::ui::{keys, theme};
use crate::worker::{JobInfo, Task, Tasks, Versioned};

/// Title of the jobs.
const TITLE: &str = "Selecting";

/// Longer side of the view in which strokes are rasterized, px.
const SIDE_PX: u32 = 512;

const PLUS: Color32 = Color32::from_rgb(0x3c, 0xd0, 0x6e);
const MINUS: Color32 = Color32::from_rgb(0xf0, 0x5a, 0x4b);
/// Color of the selection.
const SELECTED: [u8; 3] = [0x3c, 0xd0, 0x6e];

/// The tool that selects by clicks and strokes.
pub(crate) struct SegmentTool {
    purpose: SelectFor,
    name: String,
    radius_pt: f32,
    /// True if strokes remove from the selection.
    takes_away: bool,
    /// The current stroke, and the camera of the view in which it was begun.
    line: Option<(DrawnLine, Camera)>,
    /// Lines that wait to be processed, oldest first: they stay on screen.
    drawn_lines: VecDeque<DrawnLine>,
    /// Steps that wait to be processed.
    waiting: VecDeque<SelectStep>,
    /// The job of the running step, and true if that is a stroke.
    running: Option<Task<Selected>>,
    runs_stroke: bool,
    /// True if the scene is prepared for strokes.
    is_prepared: bool,
    /// True if preparation has failed; the next stroke tries again.
    gave_up: bool,
    selected: Option<Arc<Selected>>,
    /// Objects and parts with the selection applied.
    preview: Option<Versioned<SemanticMap>>,
    drawn: DrawnOutline,
}

impl SegmentTool {
    pub(crate) fn new(purpose: SelectFor) -> Self {
        Self {
            purpose,
            name: String::new(),
            radius_pt: 5.0,
            takes_away: false,
            line: None,
            drawn_lines: VecDeque::new(),
            waiting: VecDeque::new(),
            running: None,
            runs_stroke: false,
            is_prepared: false,
            gave_up: false,
            selected: None,
            preview: None,
            drawn: DrawnOutline::default(),
        }
    }

    /// Drops all waiting steps, as selection is impossible here.
    fn give_up(&mut self) {
        (self.waiting, self.drawn_lines, self.gave_up) = (VecDeque::new(), VecDeque::new(), true);
    }

    /// Takes over the result of the running step.
    fn take_result(&mut self, preparation: &mut SelectionPreparation) {
        let Some(result) = Task::take(&mut self.running) else { return };
        self.end_step();
        // A refused or failed step was reported and leaves the selection as it was.
        if let Ok(selected) = result {
            preparation.keep(&selected);
            self.preview = Some(Versioned::new(Arc::clone(&selected.preview)));
            self.selected = Some(Arc::new(selected));
        }
    }

    /// Removes the line of a processed stroke.
    fn end_step(&mut self) {
        if std::mem::take(&mut self.runs_stroke) {
            self.drawn_lines.pop_front();
        }
    }

    /// Begins the next step. Preparation comes first, as soon as the tool is in use; not during training, which would
    /// change the Gaussians meanwhile.
    fn begin_next(
        &mut self,
        preparation: &mut SelectionPreparation,
        cloud: &Arc<GaussianCloud>,
        state: &mut AppState,
        tasks: &Tasks,
    ) {
        let prepared = self.selected.clone().filter(|s| s.is_of(cloud)).or_else(|| preparation.of(cloud));
        self.is_prepared = prepared.is_some() || state.is_training();
        if !self.is_prepared {
            if preparation.has_failed() {
                // The failure was reported; the next stroke tries again.
                self.give_up();
            }
            if !preparation.is_running() && (!self.gave_up || !self.waiting.is_empty()) {
                match self.spawn(SelectStep::Prepare, None, cloud, state, tasks) {
                    Some(task) => preparation.begin(task),
                    None => self.give_up(),
                }
            }
            return;
        }
        let before = self.selected.clone().or(prepared);
        if let Some(step) = self.waiting.pop_front_if(|_| self.running.is_none()) {
            self.runs_stroke = matches!(step, SelectStep::Stroke(_));
            self.running = self.spawn(step, before, cloud, state, tasks);
            if self.running.is_none() {
                self.end_step();
            }
        }
    }

    /// Queues a step; `None`, with a message, if it is refused.
    fn spawn(
        &self,
        step: SelectStep,
        before: Option<Arc<Selected>>,
        cloud: &Arc<GaussianCloud>,
        state: &mut AppState,
        tasks: &Tasks,
    ) -> Option<Task<Selected>> {
        let scene = state.scene.as_ref()?;
        let request = SelectRequest {
            cloud: Arc::clone(cloud),
            settings: state.render_settings(),
            cameras: scene.dataset.as_ref().map(|d| d.cameras()).unwrap_or_default(),
            home: scene.home.clone(),
            map: state.semantics.as_deref().cloned().unwrap_or_else(|| Arc::new(select::empty_map(cloud))),
            purpose: self.purpose.clone(),
            before,
            step,
        };
        let spawned = tasks.spawn(JobInfo::short(TITLE), move |observer| select::run(&request, observer));
        spawned.map_err(|e| state.toast(Tone::Warning, format!("{TITLE}: {e}"))).ok()
    }

    /// Undoes the last stroke; one that waits is dropped.
    fn take_back(&mut self) {
        match self.waiting.pop_back_if(|step| matches!(step, SelectStep::Stroke(_))) {
            Some(_) => drop(self.drawn_lines.pop_back()),
            None => self.waiting.push_back(SelectStep::TakeBack),
        }
    }

    /// True if there is a stroke to undo.
    fn has_strokes(&self) -> bool {
        !self.drawn_lines.is_empty() || self.selected.as_ref().is_some_and(|s| s.strokes() > 0)
    }

    pub(crate) fn preview(&self) -> Option<&Versioned<SemanticMap>> {
        self.preview.as_ref()
    }

    fn is_empty(&self) -> bool {
        self.selected.as_ref().is_none_or(|s| s.id == NO_IDENTITY)
    }

    /// The edit that applies the selection; `None` without one.
    pub(crate) fn edit(&self) -> Option<Edit> {
        let selected = self.selected.as_ref().filter(|s| s.id != NO_IDENTITY)?;
        Some(kept_as(&self.purpose, self.name.trim().to_owned(), selected.gaussians.clone()))
    }

    /// Number of selected Gaussians, once all clicks and strokes are processed.
    pub(crate) fn count(&self) -> Option<usize> {
        let is_done = self.running.is_none() && self.waiting.is_empty();
        self.selected.as_ref().filter(|_| is_done).map(|s| s.gaussians.len())
    }

    /// Number of drawn lines that are not processed yet.
    pub(crate) fn lines_drawn(&self) -> usize {
        self.drawn_lines.len()
    }

    fn status(&self, ui: &mut Ui) {
        let text = match &self.selected {
            _ if !self.is_prepared => {
                ui.spinner();
                "Preparing selection, once for this scene\u{2026}".to_owned()
            }
            _ if self.running.is_some() => {
                ui.spinner();
                String::new()
            }
            Some(s) if s.id != NO_IDENTITY => {
                format!("{} Gaussians, {:.0} ms", format::count(s.gaussians.len() as u64), s.ms)
            }
            Some(_) => "Nothing is selected".to_owned(),
            None => String::new(),
        };
        ui.weak(text);
    }
}

impl ViewTool for SegmentTool {
    fn takes_drags(&self) -> bool {
        true
    }

    fn update(&mut self, scene: &mut ToolScene<'_>, state: &mut AppState, tasks: &Tasks) {
        self.take_result(scene.preparation);
        if let Some(cloud) = scene.cloud {
            self.begin_next(scene.preparation, cloud, state, tasks);
        }
    }

    /// Handles clicks and drags as strokes.
    fn pointer(&mut self, response: &Response, area: ViewArea, scene: &mut ToolScene<'_>, _cx: &mut Ctx<'_>) {
        let (Some(picture), Some(pos)) = (scene.display.picture(), response.interact_pointer_pos()) else { return };
        if response.drag_started_by(PointerButton::Primary) || response.clicked() {
            let at = response.ctx.input(|i| i.pointer.press_origin()).into_iter().collect();
            let takes_away = self.takes_away != response.ctx.input(|i| i.modifiers.shift);
            // The camera of the visible frame, though a newer frame may be on its way.
            let camera = picture.camera.limited_to(SIDE_PX);
            self.line = Some((DrawnLine { at, takes_away, radius_pt: self.radius_pt }, camera));
        }
        if let Some((line, _)) = &mut self.line
            && (response.dragged_by(PointerButton::Primary) || response.clicked())
        {
            line.at.push(pos);
        }
        if (response.drag_stopped_by(PointerButton::Primary) || response.clicked())
            && let Some((line, camera)) = self.line.take()
        {
            let pixels = line.pixels(area.shown, &camera);
            if !pixels.is_empty() {
                let stroke = Stroke { camera, pixels, is_plus: !line.takes_away };
                self.waiting.push_back(SelectStep::Stroke(stroke));
                self.drawn_lines.push_back(line);
            }
        }
    }

    /// Draws the selection, the current line, and the brush tip, but not over another scene.
    fn paint(&mut self, ui: &Ui, area: ViewArea, scene: &mut ToolScene<'_>, _cx: &mut Ctx<'_>) {
        if area.is_other {
            return;
        }
        let shown = area.shown;
        if let (Some(maps), Some(preview), Some(selected)) = (scene.queries.shown_maps(), &self.preview, &self.selected)
            && selected.id != NO_IDENTITY
        {
            self.drawn.paint(ui, shown, preview, maps, selected.id, |mask| outline::image(mask, SELECTED));
        }
        let painter = ui.painter_at(shown);
        let color = |takes_away: bool| if takes_away { MINUS } else { PLUS };
        for drawn in self.drawn_lines.iter().chain(self.line.iter().map(|(line, _)| line)) {
            let ink = color(drawn.takes_away).gamma_multiply(0.6);
            let line = Line::new(2.0 * drawn.radius_pt, ink);
            drawn.at.windows(2).for_each(|pair| {
                painter.line_segment([pair[0], pair[1]], line);
            });
            if let Some(pos) = drawn.at.first() {
                painter.circle_filled(*pos, drawn.radius_pt, ink);
            }
        }
        if let Some(pos) = ui.input(|i| i.pointer.hover_pos()).filter(|pos| shown.contains(*pos)) {
            let takes_away = self.takes_away != ui.input(|i| i.modifiers.shift);
            painter.circle_stroke(pos, self.radius_pt, Line::new(1.5, color(takes_away)));
        }
    }

    fn card(&mut self, ui: &Ui, places: CardPlaces, _scene: &mut ToolScene<'_>, cx: &mut Ctx<'_>) {
        let (rect, none, state) = (places.active_view, Identities::default(), cx.state);
        let all = state.semantics.as_ref().map_or(&none, |map| &map.identities);
        bottom_card(ui, "selecting", rect, 220.0..=460.0, |ui| {
            let what = match self.purpose {
                SelectFor::New(NO_IDENTITY) => "New object".to_owned(),
                SelectFor::New(of) => format!("New part of {}", all.full_name(of)),
                SelectFor::Extent(id) => format!("Correct {}", all.full_name(id)),
            };
            ui.label(format!("{what}: click on it or draw a line through it, in any view."));
            ui.weak("Shift removes. Backspace undoes the last stroke. Right-drag and wheel move the view.");
            ui.horizontal(|ui| {
                ui.selectable_value(&mut self.takes_away, false, "+ add");
                ui.selectable_value(&mut self.takes_away, true, "\u{2212} remove");
                ui.add(Slider::new(&mut self.radius_pt, 2.0..=30.0).show_value(false).text("width"));
            });
            if let SelectFor::New(of) = self.purpose {
                ui.horizontal(|ui| {
                    ui.label("Keep as");
                    let name = TextEdit::singleline(&mut self.name).hint_text("Name").char_limit(80);
                    let name = ui.add(name.desired_width(130.0)).accessible_name("Name of what is selected");
                    if name.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter)) && !self.is_empty() {
                        cx.ask(Action::AddPainted);
                    }
                    let text =
                        if of == NO_IDENTITY { "an object".to_owned() } else { format!("part of {}", all.label(of)) };
                    let whole = ComboBox::from_id_salt("whole").selected_text(text).width(120.0);
                    let whole = whole.show_ui(ui, |ui| {
                        ui.selectable_value(&mut self.purpose, SelectFor::New(NO_IDENTITY), "an object");
                        for (id, _) in all.iter().filter(|(_, i)| i.level == Level::Object) {
                            let text = format!("part of {}", all.label(id));
                            ui.selectable_value(&mut self.purpose, SelectFor::New(id), text);
                        }
                    });
                    whole.response.accessible_name("What it becomes");
                });
            }
            ui.horizontal(|ui| {
                if ui.add_enabled(!self.is_empty(), theme::primary_button("Keep")).clicked() {
                    cx.ask(Action::AddPainted);
                }
                if let SelectFor::New(of) = self.purpose {
                    let next = ui.add_enabled(!self.is_empty(), egui::Button::new("Keep and next"));
                    if next.on_hover_text("Keep it, and select another one.").clicked() {
                        cx.ask(Action::AddPainted);
                        cx.ask(Action::SegmentNew(Some(of)));
                    }
                }
                if ui.add_enabled(self.has_strokes(), egui::Button::new("Undo stroke")).clicked() {
                    self.take_back();
                }
                if ui.button("Cancel").clicked() {
                    cx.ask(Action::SegmentNew(None));
                }
                self.status(ui);
            });
        });
        if !keys::is_typing(ui.ctx()) && ui.input(|i| i.key_pressed(Key::Backspace)) && self.has_strokes() {
            self.take_back();
        }
    }
}

/// A line across the view.
#[derive(Clone, Debug)]
struct DrawnLine {
    /// Window positions along the line.
    at: Vec<Pos2>,
    takes_away: bool,
    radius_pt: f32,
}

impl DrawnLine {
    /// The pixels under the line in a view of at most [`SIDE_PX`].
    fn pixels(&self, shown: Rect, camera: &Camera) -> Mask {
        let (w, h) = (camera.width_px as usize, camera.height_px as usize);
        let scale = w as f32 / shown.width().max(1.0);
        let radius = (self.radius_pt * scale).max(1.0);
        let at: Vec<egui::Vec2> = self.at.iter().map(|p| (*p - shown.min) * scale).collect();
        let near = |p: egui::Vec2, pair: &[egui::Vec2]| {
            let (a, b) = (pair[0], pair[pair.len() - 1]);
            let along = if a == b { 0.0 } else { ((p - a).dot(b - a) / (b - a).length_sq()).clamp(0.0, 1.0) };
            (p - a - along * (b - a)).length() <= radius
        };
        let pairs: Vec<&[egui::Vec2]> = if at.len() > 1 { at.windows(2).collect() } else { vec![&at] };
        Mask::from_fn(w, h, |i| {
            let p = egui::vec2((i % w) as f32 + 0.5, (i / w) as f32 + 0.5);
            pairs.iter().any(|pair| !pair.is_empty() && near(p, pair))
        })
    }
}
