//! Selecting Gaussians by clicks and strokes in any view: to name unlabeled ones, or to correct objects and parts. The
//! selection is outlined in every view, which shows the effect of a correction elsewhere.

use std::collections::VecDeque;
use std::sync::Arc;

use egui::{
    Align2, Area, Color32, ComboBox, Id, Key, Order, PointerButton, Pos2, Rect, Slider, Stroke as Line, TextEdit, Ui,
};

use super::super::state::AppState;
use super::super::{keys, theme};
use super::Viewport;
use super::outline;
use super::picking::DrawnOutline;
use crate::jobs::query::ViewMaps;
use crate::jobs::select::{SelectFor, SelectStep, Selected, Stroke, kept_as};
use crate::math::format;
use crate::pipeline::semantics::edit::Edit;
use crate::scene::{Camera, Identities, Level, Mask, NOBODY, SemanticMap};
use crate::ui::actions::Action;
use crate::worker::{JobId, Versioned};

/// Longer side of the view in which strokes are rasterized, px.
const SIDE_PX: u32 = 512;

const PLUS: Color32 = Color32::from_rgb(0x3c, 0xd0, 0x6e);
const MINUS: Color32 = Color32::from_rgb(0xf0, 0x5a, 0x4b);
/// Color of the selection.
const SELECTED: [u8; 3] = [0x3c, 0xd0, 0x6e];

/// The selection tool.
pub(crate) struct SelectTool {
    pub(crate) purpose: SelectFor,
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
    /// The running step, and whether it is a stroke; results of other jobs are ignored.
    running: Option<(JobId, bool)>,
    /// True if the scene is prepared for strokes.
    pub(super) is_prepared: bool,
    /// True if preparation has failed; the next stroke tries again.
    pub(super) gave_up: bool,
    pub(crate) selected: Option<Arc<Selected>>,
    /// Objects and parts with the selection applied.
    preview: Option<Versioned<SemanticMap>>,
    drawn: DrawnOutline,
}

impl SelectTool {
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
            is_prepared: false,
            gave_up: false,
            selected: None,
            preview: None,
            drawn: DrawnOutline::default(),
        }
    }

    /// The next step to process, if none is running.
    pub(crate) fn next(&mut self) -> Option<SelectStep> {
        self.waiting.pop_front_if(|_| self.running.is_none())
    }

    /// Records the job of the step that was handed on; `None` if it was refused.
    pub(crate) fn runs(&mut self, job: Option<JobId>, is_stroke: bool) {
        self.running = job.map(|job| (job, is_stroke));
        if job.is_none() {
            self.end_step(is_stroke);
        }
    }

    /// True if steps wait to be processed.
    pub(crate) fn waits(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Drops all waiting steps, as selection is impossible here.
    pub(crate) fn give_up(&mut self) {
        (self.waiting, self.drawn_lines, self.gave_up) = (VecDeque::new(), VecDeque::new(), true);
    }

    /// Takes over the selection, if it comes from the running step.
    pub(crate) fn take(&mut self, job: JobId, selected: Arc<Selected>) {
        let Some((_, is_stroke)) = self.running.take_if(|(running, _)| *running == job) else { return };
        self.end_step(is_stroke);
        self.preview = Some(Versioned::new(Arc::clone(&selected.preview)));
        self.selected = Some(selected);
    }

    fn end_step(&mut self, is_stroke: bool) {
        if is_stroke {
            self.drawn_lines.pop_front();
        }
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

    pub(super) fn preview(&self) -> Option<&Versioned<SemanticMap>> {
        self.preview.as_ref()
    }

    fn is_empty(&self) -> bool {
        self.selected.as_ref().is_none_or(|s| s.id == NOBODY)
    }

    /// The edit that applies the selection; `None` without one.
    pub(crate) fn edit(&self) -> Option<Edit> {
        let selected = self.selected.as_ref().filter(|s| s.id != NOBODY)?;
        Some(kept_as(&self.purpose, self.name.trim().to_owned(), selected.gaussians.clone()))
    }

    /// Draws the selection, the current line, and the brush tip over the frame in `shown`.
    pub(super) fn paint(&mut self, ui: &Ui, shown: Rect, maps: Option<&Versioned<ViewMaps>>) {
        if let (Some(maps), Some(preview), Some(selected)) = (maps, &self.preview, &self.selected)
            && selected.id != NOBODY
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

    /// Draws the card of the tool.
    pub(super) fn show(&mut self, ui: &Ui, rect: Rect, all: &Identities, actions: &mut Vec<Action>) {
        let at = Align2::CENTER_BOTTOM.pos_in_rect(&rect.shrink(52.0));
        let area =
            Area::new(Id::unique("selecting")).order(Order::Foreground).pivot(Align2::CENTER_BOTTOM).fixed_pos(at);
        theme::card(ui.ctx(), area.constrain_to(rect), |ui| {
            ui.set_width((rect.width() - 40.0).clamp(220.0, 460.0));
            let what = match self.purpose {
                SelectFor::New(NOBODY) => "a new object".to_owned(),
                SelectFor::New(of) => format!("a new part of {}", all.full_name(of)),
                SelectFor::Extent(id) => all.full_name(id),
            };
            ui.label(format!("Select {what}: click on it or draw a line through it, in any view."));
            ui.weak("Shift: not this. Backspace takes the last stroke back. Right-drag and wheel move the view.");
            ui.horizontal(|ui| {
                ui.selectable_value(&mut self.takes_away, false, "+ add");
                ui.selectable_value(&mut self.takes_away, true, "\u{2212} remove");
                ui.add(Slider::new(&mut self.radius_pt, 2.0..=30.0).show_value(false).text("width"));
            });
            if let SelectFor::New(of) = self.purpose {
                ui.horizontal(|ui| {
                    ui.label("Keep as");
                    let name = TextEdit::singleline(&mut self.name).hint_text("Name").char_limit(80);
                    ui.add(name.desired_width(130.0)).accessible_name("Name of what is selected");
                    let text = if of == NOBODY { "an object".to_owned() } else { format!("part of {}", all.label(of)) };
                    let whole = ComboBox::from_id_salt("whole").selected_text(text).width(120.0);
                    let whole = whole.show_ui(ui, |ui| {
                        ui.selectable_value(&mut self.purpose, SelectFor::New(NOBODY), "an object");
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
                    actions.push(Action::AddPainted);
                }
                if ui.add_enabled(self.has_strokes(), egui::Button::new("Undo stroke")).clicked() {
                    self.take_back();
                }
                if ui.button("Cancel").clicked() {
                    actions.push(Action::Paint(None));
                }
                self.status(ui);
            });
        });
        if !keys::is_typing(ui.ctx()) && ui.input(|i| i.key_pressed(Key::Backspace)) && self.has_strokes() {
            self.take_back();
        }
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
            Some(s) if s.id != NOBODY => {
                format!("{} Gaussians, {:.0} ms", format::count(s.gaussians.len() as u64), s.ms)
            }
            Some(_) => "Nothing is selected".to_owned(),
            None => String::new(),
        };
        ui.weak(text);
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

impl Viewport {
    /// Number of selected Gaussians, once all clicks and strokes are processed.
    pub fn selection(&self) -> Option<usize> {
        let tool = self.select.as_ref().filter(|tool| tool.running.is_none() && tool.waiting.is_empty())?;
        tool.selected.as_ref().map(|s| s.gaussians.len())
    }

    /// Number of drawn lines that are not processed yet.
    pub fn lines_drawn(&self) -> usize {
        self.select.as_ref().map_or(0, |tool| tool.drawn_lines.len())
    }

    /// Handles clicks and drags as strokes.
    pub(super) fn use_select_tool(&mut self, response: &egui::Response, rect: Rect, state: &AppState) {
        let shown = self.photo.as_mut().map_or(rect, |p| p.fit(rect));
        let (Some(tool), Some(picture)) = (&mut self.select, self.display.picture()) else { return };
        // A refused or failed step has no result.
        if let Some((_, is_stroke)) = tool.running.take_if(|(job, _)| *job <= state.short_jobs_done) {
            tool.end_step(is_stroke);
        }
        let Some(pos) = response.interact_pointer_pos() else { return };
        if response.drag_started_by(PointerButton::Primary) || response.clicked() {
            let at = response.ctx.input(|i| i.pointer.press_origin()).into_iter().collect();
            let takes_away = tool.takes_away != response.ctx.input(|i| i.modifiers.shift);
            // The camera of the visible frame, though a newer frame may be on its way.
            let camera = picture.camera.limited_to(SIDE_PX);
            tool.line = Some((DrawnLine { at, takes_away, radius_pt: tool.radius_pt }, camera));
        }
        if let Some((line, _)) = &mut tool.line
            && (response.dragged_by(PointerButton::Primary) || response.clicked())
        {
            line.at.push(pos);
        }
        if (response.drag_stopped_by(PointerButton::Primary) || response.clicked())
            && let Some((line, camera)) = tool.line.take()
        {
            let pixels = line.pixels(shown, &camera);
            if !pixels.is_empty() {
                let stroke = Stroke { camera, pixels, is_plus: !line.takes_away };
                tool.waiting.push_back(SelectStep::Stroke(stroke));
                tool.drawn_lines.push_back(line);
            }
        }
    }
}
