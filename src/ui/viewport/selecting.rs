//! Selecting something by clicks and strokes in any view: to name what nobody has named, or to correct what was found.
//! What is selected is outlined in every view, so that one sees what a correction elsewhere has done.

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
use crate::jobs::select::{SelectFor, Selected, Stroke, kept_as};
use crate::math::format;
use crate::pipeline::semantics::edit::Edit;
use crate::scene::{Camera, Identities, Level, Mask, NOBODY, SemanticMap};
use crate::ui::actions::Action;
use crate::worker::{JobId, Versioned};

/// Longer side of the view in which strokes are taken, px.
const SIDE_PX: u32 = 512;

const PLUS: Color32 = Color32::from_rgb(0x3c, 0xd0, 0x6e);
const MINUS: Color32 = Color32::from_rgb(0xf0, 0x5a, 0x4b);
/// Color of what is selected.
const SELECTED: [u8; 3] = [0x3c, 0xd0, 0x6e];

/// What is being selected.
pub(crate) struct SelectTool {
    pub(crate) purpose: SelectFor,
    name: String,
    radius_pt: f32,
    /// Whether strokes take away.
    takes_away: bool,
    /// Places of the window that the stroke under way went through, and whether it takes away.
    line: Vec<Pos2>,
    line_takes_away: bool,
    /// The view in which it was begun.
    line_camera: Option<Camera>,
    /// Whether that line waits to be taken in: it stays on screen.
    is_drawn: bool,
    /// Strokes that wait for their turn; `None` takes the last one back.
    waiting: VecDeque<Option<Stroke>>,
    /// The stroke that is being taken in.
    pub(crate) running: Option<JobId>,
    pub(crate) selected: Option<Arc<Selected>>,
    /// Objects and parts as they would be.
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
            line: Vec::new(),
            line_takes_away: false,
            line_camera: None,
            is_drawn: false,
            waiting: VecDeque::new(),
            running: None,
            selected: None,
            preview: None,
            drawn: DrawnOutline::default(),
        }
    }

    /// The next stroke to be taken in, if none is.
    pub(crate) fn next(&mut self) -> Option<Option<Stroke>> {
        self.waiting.pop_front_if(|_| self.running.is_none())
    }

    /// Takes in what strokes select by now.
    pub(crate) fn take(&mut self, selected: Arc<Selected>) {
        if self.is_drawn && self.waiting.is_empty() {
            (self.is_drawn, self.line) = (false, Vec::new());
        }
        self.preview = Some(Versioned::new(Arc::clone(&selected.preview)));
        self.selected = Some(selected);
    }

    pub(super) fn preview(&self) -> Option<&Versioned<SemanticMap>> {
        self.preview.as_ref()
    }

    fn is_empty(&self) -> bool {
        self.selected.as_ref().is_none_or(|s| s.id == NOBODY)
    }

    /// The edit that keeps the selection; `None` if there is none.
    pub(crate) fn edit(&self) -> Option<Edit> {
        let selected = self.selected.as_ref().filter(|s| s.id != NOBODY)?;
        Some(kept_as(&self.purpose, self.name.trim().to_owned(), selected.gaussians.clone()))
    }

    /// The selection, the line under way, and the tip, over the frame in `shown`.
    pub(super) fn paint(&mut self, ui: &Ui, shown: Rect, maps: Option<&Versioned<ViewMaps>>) {
        if let (Some(maps), Some(preview), Some(selected)) = (maps, &self.preview, &self.selected)
            && selected.id != NOBODY
        {
            self.drawn.paint(ui, shown, preview, maps, selected.id, |mask| outline::image(mask, SELECTED));
        }
        let painter = ui.painter_at(shown);
        let color = |takes_away: bool| if takes_away { MINUS } else { PLUS };
        let ink = color(self.line_takes_away).gamma_multiply(0.6);
        let line = Line::new(2.0 * self.radius_pt, ink);
        self.line.windows(2).for_each(|pair| {
            painter.line_segment([pair[0], pair[1]], line);
        });
        if let Some(pos) = self.line.first() {
            painter.circle_filled(*pos, self.radius_pt, ink);
        }
        if let Some(pos) = ui.input(|i| i.pointer.hover_pos()).filter(|pos| shown.contains(*pos)) {
            let takes_away = self.takes_away != ui.input(|i| i.modifiers.shift);
            painter.circle_stroke(pos, self.radius_pt, Line::new(1.5, color(takes_away)));
        }
    }

    /// The card of the tool.
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
                let strokes = self.selected.as_ref().map_or(0, |s| s.strokes());
                if ui.add_enabled(strokes > 0, egui::Button::new("Undo stroke")).clicked() {
                    self.waiting.push_back(None);
                }
                if ui.button("Cancel").clicked() {
                    actions.push(Action::Paint(None));
                }
                self.status(ui);
            });
        });
        if !keys::is_typing(ui.ctx()) && ui.input(|i| i.key_pressed(Key::Backspace)) {
            self.waiting.push_back(None);
        }
    }

    fn status(&self, ui: &mut Ui) {
        let text = match &self.selected {
            _ if self.running.is_some() && self.selected.is_none() => {
                ui.spinner();
                "Looking at surfaces\u{2026}".to_owned()
            }
            Some(s) if s.id != NOBODY => {
                format!("{} Gaussians, {:.0} ms", format::count(s.gaussians.len() as u64), s.ms)
            }
            Some(_) => "Nothing is selected".to_owned(),
            None => String::new(),
        };
        ui.weak(text);
    }

    /// The pixels of a view, at most [`SIDE_PX`] large, that the line under way went over.
    fn pixels(&self, shown: Rect, camera: &Camera) -> Mask {
        let (w, h) = (camera.width_px as usize, camera.height_px as usize);
        let scale = w as f32 / shown.width().max(1.0);
        let radius = (self.radius_pt * scale).max(1.0);
        let at: Vec<egui::Vec2> = self.line.iter().map(|p| (*p - shown.min) * scale).collect();
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
    /// How many Gaussians clicks and strokes select, once all of them are taken in.
    pub fn selection(&self) -> Option<usize> {
        let tool = self.select.as_ref().filter(|tool| tool.running.is_none() && tool.waiting.is_empty())?;
        tool.selected.as_ref().map(|s| s.gaussians.len())
    }

    /// Takes clicks and drags as strokes.
    pub(super) fn use_select_tool(&mut self, response: &egui::Response, rect: Rect, state: &AppState) {
        let shown = self.photo.as_mut().map_or(rect, |p| p.fit(rect));
        let (Some(tool), Some(picture)) = (&mut self.select, self.display.picture()) else { return };
        if tool.running.is_some_and(|job| job <= state.short_jobs_done) {
            tool.running = None;
        }
        let Some(pos) = response.interact_pointer_pos() else { return };
        if response.drag_started_by(PointerButton::Primary) || response.clicked() {
            tool.is_drawn = false;
            tool.line = response.ctx.input(|i| i.pointer.press_origin()).into_iter().collect();
            tool.line_takes_away = tool.takes_away != response.ctx.input(|i| i.modifiers.shift);
            // What the eye sees there, though a newer picture may be on its way.
            tool.line_camera = Some(picture.camera.limited_to(SIDE_PX));
        }
        let is_dragged = response.dragged_by(PointerButton::Primary);
        if is_dragged || response.clicked() {
            tool.line.push(pos);
        }
        if (response.drag_stopped_by(PointerButton::Primary) || response.clicked())
            && !tool.line.is_empty()
            && !tool.is_drawn
            && let Some(camera) = tool.line_camera.take()
        {
            let pixels = tool.pixels(shown, &camera);
            if !pixels.is_empty() {
                tool.waiting.push_back(Some(Stroke { camera, pixels, is_plus: !tool.line_takes_away }));
            }
            tool.is_drawn = true;
        }
    }
}
