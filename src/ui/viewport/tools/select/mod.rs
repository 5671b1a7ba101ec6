//! Selecting Gaussians in any view: to name unlabeled ones, to correct objects and parts, to delete or export them. The
//! selection is outlined in every view, which shows the effect of a change elsewhere.

mod card;
mod line;
mod reach;
mod taken;
mod tip;
mod told;

use std::collections::VecDeque;
use std::sync::Arc;

use egui::{Color32, PointerButton, Response, Ui};
use glam::DVec2;

use self::line::DrawnLine;
use self::taken::TakenObject;
use self::tip::SelectTip;
use super::super::outline;
use super::super::picking::{DrawnOutline, innermost};
use super::super::splat_selection::SplatSelection;
use super::super::split::ViewArea;
use super::preparation::SelectionPreparation;
use super::{CardPlaces, ToolScene, ViewTool};
use crate::jobs::select::{self, SelectFor, SelectRequest, SelectStep, Selected, Stroke, kept_as};
use crate::navigate::Pose;
use crate::pipeline::semantics::lifting::edit::Edit;
use crate::scene::{Camera, GaussianCloud, NO_IDENTITY, SemanticMap};
use crate::ui::ctx::Ctx;
use crate::ui::select_shape::SelectShape;
use crate::ui::state::{AppState, Tone};
use crate::worker::{JobInfo, Task, Tasks, Versioned};

/// Title of the jobs.
const TITLE: &str = "Selecting";

/// Most balls along a drag.
const MOST_BALLS: usize = 60;

const PLUS: Color32 = Color32::from_rgb(0x3c, 0xd0, 0x6e);
const MINUS: Color32 = Color32::from_rgb(0xf0, 0x5a, 0x4b);
/// Color of the selection.
const SELECTED: [u8; 3] = [0x3c, 0xd0, 0x6e];

/// The tool that selects.
pub(crate) struct SelectTool {
    purpose: SelectFor,
    pub(crate) shape: SelectShape,
    name: String,
    pub(crate) tip: SelectTip,
    /// Largest distance of a color in red, green and blue, 0 to 1 each.
    tolerance: f32,
    /// True if Gaussians behind the surface are taken, too.
    through: bool,
    /// True if each selected Gaussian is marked, faint ones, too.
    marks: bool,
    /// True if shapes remove from the selection.
    takes_away: bool,
    /// The current line, and the camera of the view in which it was begun.
    line: Option<(DrawnLine, Camera)>,
    /// Lines that wait to be processed, oldest first: they stay on screen.
    drawn_lines: VecDeque<DrawnLine>,
    /// Steps that wait to be processed, and true for those of a line.
    waiting: VecDeque<(SelectStep, bool)>,
    /// The job of the running step, and true if that is of a line.
    running: Option<Task<Selected>>,
    runs_line: bool,
    is_prepared: bool,
    /// True if preparation has failed; the next stroke tries again.
    gave_up: bool,
    selected: Option<Arc<Selected>>,
    /// Objects that lose most of their Gaussians to it; `None` until they are known.
    taken: Option<Vec<TakenObject>>,
    /// Objects and parts with the selection applied.
    preview: Option<Versioned<SemanticMap>>,
    marked: Option<Arc<SplatSelection>>,
    drawn: DrawnOutline,
    drawn_at: Option<Pose>,
}

impl SelectTool {
    /// Selects for `purpose`, from these Gaussians on.
    pub(crate) fn new(purpose: SelectFor, shape: SelectShape, first: Vec<u32>) -> Self {
        let has_first = !first.is_empty();
        Self {
            purpose,
            shape,
            name: String::new(),
            tip: SelectTip::default(),
            tolerance: 0.12,
            through: false,
            marks: has_first,
            takes_away: false,
            line: None,
            drawn_lines: VecDeque::new(),
            waiting: has_first.then_some((SelectStep::Add(first), false)).into_iter().collect(),
            running: None,
            runs_line: false,
            is_prepared: false,
            gave_up: false,
            selected: None,
            taken: None,
            preview: None,
            marked: None,
            drawn: DrawnOutline::default(),
            drawn_at: None,
        }
    }

    /// Drops all waiting strokes, as they are impossible here.
    fn give_up(&mut self) {
        (self.waiting, self.drawn_lines, self.gave_up) = (VecDeque::new(), VecDeque::new(), true);
    }

    /// Takes over the result of the running step.
    fn take_result(&mut self) {
        let Some(result) = Task::take(&mut self.running) else { return };
        self.end_step();
        // A refused or failed step was reported and leaves the selection as it was.
        if let Ok(selected) = result {
            self.preview = Some(Versioned::new(Arc::clone(&selected.preview)));
            self.selected = Some(Arc::new(selected));
            (self.marked, self.taken) = (None, None);
        }
    }

    /// Removes the line of a processed step.
    fn end_step(&mut self) {
        if std::mem::take(&mut self.runs_line) {
            self.drawn_lines.pop_front();
        }
    }

    /// Begins the preparation as soon as the tool is in use, and the next step. Not during training, which would change
    /// the Gaussians meanwhile.
    fn begin_next(
        &mut self,
        preparation: &mut SelectionPreparation,
        cloud: &Arc<GaussianCloud>,
        state: &mut AppState,
        tasks: &Tasks,
    ) {
        let prepared = preparation.of(cloud);
        let is_stroke = |waiting: &(SelectStep, bool)| matches!(waiting.0, SelectStep::Stroke(_));
        self.is_prepared = prepared.is_some();
        if prepared.is_none() && !state.is_training() {
            if preparation.has_failed() {
                // The failure was reported; the next stroke tries again.
                self.give_up();
            }
            let is_wanted = !self.gave_up || self.waiting.iter().any(is_stroke);
            if is_wanted && !preparation.is_running() && !preparation.begin(cloud, state, tasks) {
                self.give_up();
            }
        }
        let can_run = |waiting: &mut (SelectStep, bool)| prepared.is_some() || !is_stroke(waiting);
        if self.running.is_none()
            && let Some((step, of_line)) = self.waiting.pop_front_if(can_run)
        {
            let request = SelectRequest {
                cloud: Arc::clone(cloud),
                settings: state.render_settings(),
                map: state.semantics.as_deref().cloned().unwrap_or_else(|| Arc::new(select::empty_map(cloud))),
                purpose: self.purpose.clone(),
                prepared,
                before: self.selected.clone(),
                step,
            };
            let spawned = tasks.spawn(JobInfo::short(TITLE), move |observer| select::run(&request, observer));
            self.running = spawned.map_err(|e| state.toast(Tone::Warning, format!("{TITLE}: {e}"))).ok();
            self.runs_line = of_line;
            if self.running.is_none() {
                self.end_step();
            }
        }
    }

    /// Undoes the last step; one that waits is dropped.
    fn take_back(&mut self) {
        match self.waiting.pop_back_if(|(step, _)| !matches!(step, SelectStep::TakeBack)) {
            Some((_, true)) => drop(self.drawn_lines.pop_back()),
            Some(_) => {}
            None => self.waiting.push_back((SelectStep::TakeBack, false)),
        }
    }

    /// True if there is a step to undo.
    pub(crate) fn has_steps(&self) -> bool {
        !self.drawn_lines.is_empty() || self.selected.as_ref().is_some_and(|s| s.steps() > 0)
    }

    pub(crate) fn preview(&self) -> Option<&Versioned<SemanticMap>> {
        self.preview.as_ref()
    }

    /// The object that loses the most to the selection, if that is most of it and not what the selection is for.
    fn taken_object(&self) -> Option<TakenObject> {
        let map = &self.selected.as_ref()?.preview;
        self.taken.iter().flatten().find(|taken| taken.surprises(&self.purpose, map)).copied()
    }

    fn is_empty(&self) -> bool {
        self.selected.as_ref().is_none_or(|s| s.id == NO_IDENTITY)
    }

    /// The edit that keeps the selection; `None` without one.
    pub(crate) fn edit(&self) -> Option<Edit> {
        Some(kept_as(&self.purpose, self.name.trim().to_owned(), self.gaussians()?.to_vec()))
    }

    /// Indices of the selected Gaussians, ascending; `None` without any.
    pub(crate) fn gaussians(&self) -> Option<&[u32]> {
        self.selected.as_ref().filter(|s| s.id != NO_IDENTITY).map(|s| s.gaussians.as_slice())
    }

    /// The selection as marks of a cloud of `n` Gaussians, if each is to be marked.
    pub(crate) fn marked(&mut self, n: usize) -> Option<Arc<SplatSelection>> {
        let selected = self.selected.as_ref().filter(|s| self.marks && s.id != NO_IDENTITY)?;
        let marks = || Arc::new(SplatSelection::of_numbers(n, &selected.gaussians));
        let marked = self.marked.get_or_insert_with(marks);
        Some(Arc::clone(marked))
    }

    /// Number of selected Gaussians, once all steps are processed.
    pub(crate) fn count(&self) -> Option<usize> {
        let is_done = self.running.is_none() && self.waiting.is_empty();
        self.selected.as_ref().filter(|_| is_done).map(|s| s.gaussians.len())
    }

    /// Number of drawn lines that are not processed yet.
    pub(crate) fn lines_drawn(&self) -> usize {
        self.drawn_lines.len()
    }

    /// Turns a finished line into a step. Returns false if the frame is not complete yet.
    fn finish(&mut self, area: ViewArea, scene: &ToolScene<'_>, cx: &mut Ctx<'_>, with_alt: bool) -> bool {
        let Some((line, camera)) = &self.line else { return true };
        let (Some(picture), Some(cloud)) = (scene.display.picture(), scene.cloud) else { return true };
        let shown = area.shown;
        if line.shape == SelectShape::Click {
            let stroke =
                Stroke { camera: camera.clone(), pixels: line.pixels(shown, camera), is_plus: !line.takes_away };
            return self.queue((!stroke.pixels.is_empty()).then_some(SelectStep::Stroke(stroke)));
        }
        // A coarse frame has no depth, and a late one does not match the line.
        let needs_depth = !(line.shape.is_area() && self.through || line.shape == SelectShape::Color);
        if !picture.full || needs_depth && picture.median_depth.is_none() {
            return false;
        }
        let at = |pos: egui::Pos2| {
            let at = (pos - shown.min) / shown.size();
            DVec2::new(f64::from(at.x), f64::from(at.y))
        };
        let (numbers, last) = (scene.visibility.numbers(), line.at.last().copied().unwrap_or(shown.min));
        let drawn = numbers.as_deref().map(Vec::as_slice);
        let these = match line.shape {
            SelectShape::Sphere => {
                let points_px = f64::from(shown.height());
                let every = line.at.len().div_ceil(MOST_BALLS).max(1);
                let middles = line
                    .at
                    .iter()
                    .step_by(every)
                    .chain([&last])
                    .filter_map(|pos| scene.display.picked(at(*pos), scene.eye));
                let ball = |middle| (middle, f64::from(line.radius_pt) * scene.eye.units_per_px(middle, points_px));
                reach::in_balls(cloud, drawn, &middles.map(ball).collect::<Vec<_>>())
            }
            SelectShape::Color => match reach::color_at(at(last), area, scene, cx) {
                Some(color) => reach::of_color(cloud, drawn, color, self.tolerance),
                None => Vec::new(),
            },
            SelectShape::Object => self.object_at(last, area, scene, cx, with_alt),
            _ => {
                let depth = picture.median_depth.as_deref().filter(|_| !self.through);
                reach::under(cloud, drawn, &picture.camera, depth, &line.pixels(shown, camera))
            }
        };
        let step = if line.takes_away { SelectStep::Remove(these) } else { SelectStep::Add(these) };
        let is_something = matches!(&step, SelectStep::Add(these) | SelectStep::Remove(these) if !these.is_empty());
        self.queue(is_something.then_some(step))
    }

    /// Queues the step of the current line, if it makes one.
    fn queue(&mut self, step: Option<SelectStep>) -> bool {
        if let (Some(step), Some((line, _))) = (step, self.line.take()) {
            self.waiting.push_back((step, true));
            self.drawn_lines.push_back(line);
        }
        self.line = None;
        true
    }

    /// Gaussians of the object or part at a place of the view.
    fn object_at(&self, pos: egui::Pos2, area: ViewArea, scene: &ToolScene<'_>, cx: &Ctx<'_>, whole: bool) -> Vec<u32> {
        let Some((map, cloud)) = cx.state.semantics.as_ref().zip(scene.cloud) else { return Vec::new() };
        let at = (pos - area.shown.min) / area.shown.size();
        let under = scene.queries.maps().and_then(|maps| innermost(&maps.identities, area.shown, pos));
        // The frame shows the selection in place of what it was made of.
        let own = self.selected.as_ref().filter(|s| under == Some(s.id) && map.identities.get(s.id).is_none());
        let below = || {
            let point = scene.display.picked(DVec2::new(f64::from(at.x), f64::from(at.y)), scene.eye)?;
            let nearest = reach::nearest(cloud, &own?.gaussians, point)?;
            map.identity_of.get(nearest as usize).copied()
        };
        let id = if own.is_some() { below() } else { under };
        let id = id.filter(|id| map.identities.get(*id).is_some());
        let id = id.map(|id| if whole { map.identities.object_of(id) } else { id });
        id.map(|id| map.members(id).into_iter().map(|i| i as u32).collect()).unwrap_or_default()
    }
}

impl ViewTool for SelectTool {
    fn takes_drags(&self) -> bool {
        true
    }

    fn waits_for_depth(&self) -> bool {
        self.line.is_some()
    }

    fn update(&mut self, scene: &mut ToolScene<'_>, state: &mut AppState, tasks: &Tasks) {
        self.take_result();
        if self.taken.is_none()
            && let (Some(map), Some(gaussians)) = (&state.semantics, self.gaussians())
        {
            self.taken = Some(TakenObject::all_of(map, gaussians));
        }
        if let Some(cloud) = scene.cloud {
            self.begin_next(scene.preparation, cloud, state, tasks);
        }
    }

    /// Handles clicks and drags as lines of the shape.
    fn pointer(&mut self, response: &Response, area: ViewArea, scene: &mut ToolScene<'_>, cx: &mut Ctx<'_>) {
        let Some(picture) = scene.display.picture() else { return };
        let modifiers = response.ctx.input(|i| i.modifiers);
        let (is_click, pos) = (response.clicked() && self.shape.takes_clicks(), response.interact_pointer_pos());
        if (response.drag_started_by(PointerButton::Primary) || is_click)
            && let Some(pos) = pos
            && !area.is_other
        {
            let at = response.ctx.input(|i| i.pointer.press_origin()).unwrap_or(pos);
            // The camera of the visible frame, though a newer frame may be on its way.
            let radius_pt = self.tip.radius_pt(self.shape);
            let radius_px = radius_pt * picture.camera.width_px as f32 / area.shown.width().max(1.0);
            let camera = Stroke::view(&picture.camera, radius_px);
            let takes_away = self.takes_away != modifiers.shift;
            self.line = Some((DrawnLine { shape: self.shape, at: vec![at], takes_away, radius_pt }, camera));
        }
        if let (Some((line, _)), Some(pos)) = (&mut self.line, pos)
            && (response.dragged_by(PointerButton::Primary) || is_click)
            && line.at.last() != Some(&pos)
        {
            line.at.push(pos);
        }
        let is_pressed =
            response.dragged_by(PointerButton::Primary) && !response.drag_stopped_by(PointerButton::Primary);
        if self.line.is_some() && !is_pressed && !self.finish(area, scene, cx, modifiers.alt) {
            response.ctx.request_repaint_after_secs(0.05);
        }
    }

    /// Draws the selection, the current line, and the brush tip, but not over another scene.
    fn paint(&mut self, ui: &Ui, area: ViewArea, scene: &mut ToolScene<'_>, _cx: &mut Ctx<'_>) {
        if area.is_other {
            return;
        }
        let shown = area.shown;
        if let (Some(preview), Some(selected)) = (&self.preview, &self.selected)
            && selected.id != NO_IDENTITY
        {
            match scene.queries.shown_maps() {
                Some(maps) => {
                    self.drawn.paint(ui, shown, preview, maps, selected.id, |mask| outline::image(mask, SELECTED));
                    self.drawn_at = Some(scene.pose);
                }
                // Until the changed view is there, the last outline stays.
                None if self.drawn_at == Some(scene.pose) => self.drawn.paint_again(ui, shown),
                None => {}
            }
        }
        self.drawn_lines.iter().chain(self.line.iter().map(|(line, _)| line)).for_each(|line| line.paint(ui, shown));
        let takes_away = self.takes_away != ui.input(|i| i.modifiers.shift);
        self.tip.paint(ui, shown, self.shape, if takes_away { MINUS } else { PLUS });
    }

    fn card(&mut self, ui: &Ui, places: CardPlaces, scene: &mut ToolScene<'_>, cx: &mut Ctx<'_>) {
        card::show(self, ui, places.active_view, scene, cx);
    }
}
