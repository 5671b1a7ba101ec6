//! Measuring in the view: clicks put points on surfaces, which make a length, an angle or an area; of a selected object
//! the upright box is measured. A length sets the scene's scale, an area the floor.

use egui::{Button, Key, Response, RichText, ScrollArea, TextEdit, TextStyle, Ui};
use glam::{DVec2, DVec3};

use super::super::display::Display;
use super::super::eye::Eye;
use super::super::measured::DrawnMeasurement;
use super::super::split::ViewArea;
use super::card::ToolCard;
use super::{CardPlaces, ToolScene, ViewTool};
use crate::math::format;
use crate::math::geometry::GeometryFault;
use crate::navigate::Pose;
use crate::scene::measurement::{MeasuredValue, Measurement, MeasurementKind, free_name};
use crate::scene::upright_box::UprightBox;
use crate::scene::{SemanticMap, text};
use crate::ui::actions::Action;
use crate::ui::ctx::Ctx;
use crate::ui::paired::paired;
use crate::ui::state::AppState;
use crate::ui::{keys, theme};
use crate::worker::Versioned;
use crate::worker::view::ViewPicture;

/// Height of the list of kept measurements, three rows, points.
const LIST_PT: f32 = 88.0;
/// Width of the button that deletes one, with the gaps, points.
const DELETE_PT: f32 = 64.0;
/// Width of a view that has room for the field of the true length in a folded card, points.
const WITH_SCALE_PT: f32 = 480.0;

/// The points so far, and the text typed beside them.
#[derive(Clone, Debug)]
pub(crate) struct Ruler {
    kind: MeasurementKind,
    points: Vec<DVec3>,
    /// The true length, as typed.
    known: String,
    /// Clicks that wait for the depth of the view: its pose, and their places relative to the frame.
    waiting: Vec<(Pose, DVec2)>,
    /// True if the last click met no surface.
    missed: bool,
    /// Number of measurements in the list at the last redraw.
    listed: usize,
}

impl Default for Ruler {
    fn default() -> Self {
        let (kind, points, waiting) = (MeasurementKind::Length, Vec::new(), Vec::new());
        Self { kind, points, known: String::new(), waiting, missed: false, listed: usize::MAX }
    }
}

impl Ruler {
    fn put(&mut self, point: DVec3) {
        if self.points.len() >= self.kind.points().1 {
            self.points.clear();
        }
        self.points.push(point);
    }

    /// Puts the points of waiting clicks once the depth of their view is drawn; those of a view that was left are
    /// forgotten.
    fn put_waiting(&mut self, display: &Display, eye: &Eye, pose: Pose) {
        self.waiting.retain(|(from, _)| *from == pose);
        let has_depth = |p: &ViewPicture| p.median_depth.is_some() && eye.is_at(p.camera.center);
        if self.waiting.is_empty() || !display.picture().is_some_and(has_depth) {
            return;
        }
        for (_, at) in std::mem::take(&mut self.waiting) {
            let point = display.picked(at, eye);
            self.missed = point.is_none();
            point.into_iter().for_each(|point| self.put(point));
        }
    }

    /// Takes the last click back.
    fn take_back(&mut self) {
        if self.waiting.pop().is_none() {
            self.points.pop();
        }
    }

    /// Points of the measurement: those that were put, or those of the selected object's box.
    fn measured(&self, scene: &ToolScene<'_>, semantics: Option<&Versioned<SemanticMap>>) -> Vec<DVec3> {
        if self.kind != MeasurementKind::Box {
            return self.points.clone();
        }
        let shape = || semantics?.identities.shapes.get(scene.picking.selected()?);
        let fitted = shape().and_then(|shape| UprightBox::fit(shape.points(), scene.eye.up));
        fitted.map_or_else(Vec::new, |fitted| fitted.ends().to_vec())
    }

    /// The measurement so far, for the view.
    pub(in crate::ui::viewport) fn drawn(&self, scene: &ToolScene<'_>, state: &AppState) -> DrawnMeasurement {
        DrawnMeasurement::new(self.kind, self.measured(scene, state.semantics.as_ref()), meters_per_unit(state))
    }

    /// Ends the measurement; returns it with a name and a number of its own, if it has a value.
    pub(in crate::ui::viewport) fn take(&mut self, scene: &ToolScene<'_>, state: &AppState) -> Option<Measurement> {
        let points = self.measured(scene, state.semantics.as_ref());
        self.kind.value(&points).ok()?;
        let all = &*scene.measurements;
        let selected = scene.picking.selected().zip(state.semantics.as_ref());
        let base = match selected.filter(|_| self.kind == MeasurementKind::Box) {
            Some((id, map)) => format!("Box of {}", state.labels.full_name(&map.identities, id)),
            None => self.kind.text().to_owned(),
        };
        let is_taken = |name: &str| all.iter().any(|m| m.name == name);
        let name = match self.kind {
            MeasurementKind::Box if !is_taken(&base) => base,
            _ => free_name(&base, all),
        };
        let id = std::iter::repeat_with(rand::random::<u32>).find(|id| all.iter().all(|m| m.id != *id))?;
        self.points.clear();
        Some(Measurement { id, name, kind: self.kind, points, hidden: false })
    }

    /// Meters per unit, if the typed text is the length of the line.
    fn scale(&self) -> Option<f64> {
        let Ok(MeasuredValue::Length(length)) = self.kind.value(&self.points) else { return None };
        let meters: f64 = self.known.trim().replace(',', ".").parse().ok()?;
        Some(meters / length).filter(|s| s.is_finite() && *s > 0.0)
    }

    /// What to do next, or the value.
    fn says(&self, value: Result<MeasuredValue, GeometryFault>, state: &AppState) -> String {
        let meters = meters_per_unit(state);
        if !self.waiting.is_empty() {
            return "Waiting for the depth of this view\u{2026}".to_owned();
        }
        if self.missed && self.kind != MeasurementKind::Box {
            return "No surface there: click again".to_owned();
        }
        match (value, self.kind, self.points.len()) {
            (Ok(value), ..) if meters.is_none() && !matches!(value, MeasuredValue::Angle(_)) => {
                format!("{} (scale unknown)", value.text(None))
            }
            (Ok(value), ..) => value.text(meters),
            (Err(_), MeasurementKind::Box, _) if state.semantics.is_none() => "Find objects first".to_owned(),
            (Err(_), MeasurementKind::Box, _) => "Click an object".to_owned(),
            (Err(GeometryFault::TooFew), _, 0) => "Click the first point on a surface".to_owned(),
            (Err(GeometryFault::TooFew), MeasurementKind::Angle, 1) => "Click the vertex".to_owned(),
            (Err(GeometryFault::TooFew), ..) => "Click the next point".to_owned(),
            (Err(fault), ..) => format!("No value: {fault}"),
        }
    }

    fn kinds(&mut self, ui: &mut Ui, cx: &mut Ctx<'_>) {
        ui.horizontal(|ui| {
            for kind in MeasurementKind::ALL {
                let tip = match kind {
                    MeasurementKind::Length => "Length of a line through points on surfaces.",
                    MeasurementKind::Angle => "Angle at the second of three points.",
                    MeasurementKind::Area => "Area of a flat polygon, of three corners or more.",
                    MeasurementKind::Box => "Edges and volume of the upright box around the selected object.",
                };
                if ui.selectable_value(&mut self.kind, kind, kind.text()).on_hover_text(tip).changed() {
                    (self.points, self.waiting, self.missed) = (Vec::new(), Vec::new(), false);
                }
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                if ui.button("Close").on_hover_text(Action::Measure.tooltip()).clicked() {
                    cx.ask(Action::Measure);
                }
            });
        });
    }

    /// Draws the field of the true length, and the button of the floor.
    fn uses(&mut self, ui: &mut Ui, value: &MeasuredValue, eye: DVec3, cx: &mut Ctx<'_>) {
        match value {
            MeasuredValue::Length(_) => {
                paired(ui, "True length".into(), 90.0, |ui, _| {
                    let known = TextEdit::singleline(&mut self.known).hint_text("0.30").desired_width(50.0);
                    ui.add(known).accessible_name("True length in meters");
                    ui.label("m");
                });
                let scale = self.scale();
                let set = ui.add_enabled(scale.is_some(), Button::new("Set scale"));
                if let Some(scale) = scale.filter(|_| set.clicked()) {
                    cx.ask(Action::SetScale(scale));
                }
            }
            MeasuredValue::Area(fit) => {
                let is_below = self.points.first().is_some_and(|p| fit.normal.dot(eye - *p) < 0.0);
                let normal = if is_below { -fit.normal } else { fit.normal };
                if ui.button("Use as the floor").on_hover_text(Action::SetUp(normal).tooltip()).clicked() {
                    cx.ask(Action::SetUp(normal));
                }
            }
            MeasuredValue::Angle(_) | MeasuredValue::Box(_) => {}
        }
    }
}

impl ViewTool for Ruler {
    fn takes_clicks(&self) -> bool {
        // Clicks select the object to measure.
        self.kind != MeasurementKind::Box
    }

    fn waits_for_depth(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Puts a point on the surface under a click, once its depth is known.
    fn pointer(&mut self, response: &Response, area: ViewArea, scene: &mut ToolScene<'_>, _cx: &mut Ctx<'_>) {
        let clicked = response.interact_pointer_pos().filter(|pos| response.clicked() && area.shown.contains(*pos));
        if let Some(pos) = clicked.filter(|_| self.takes_clicks()) {
            let at = (pos - area.shown.min) / area.shown.size();
            self.waiting.push((scene.pose, DVec2::new(f64::from(at.x), f64::from(at.y))));
        }
        self.put_waiting(scene.display, scene.eye, scene.pose);
    }

    /// Draws kinds, value and kept measurements.
    fn card(&mut self, ui: &Ui, places: CardPlaces, scene: &mut ToolScene<'_>, cx: &mut Ctx<'_>) {
        let state = cx.state;
        // What grows is at the top, so that the rest stays under the pointer.
        let card = ToolCard::in_corner("ruler", "Measure", places.active_view).folding(340.0, 450.0);
        let has_room = places.active_view.width() >= WITH_SCALE_PT;
        card.show(ui, |ui, is_folded| {
            ui.spacing_mut().item_spacing.y = 5.0;
            if !is_folded {
                let is_longer =
                    scene.measurements.len() > std::mem::replace(&mut self.listed, scene.measurements.len());
                list(ui, scene.measurements, meters_per_unit(state), is_longer, cx);
            }
            let uses = self.kind.value(&self.measured(scene, state.semantics.as_ref())).ok();
            let has_use = |value: &MeasuredValue| matches!(value, MeasuredValue::Length(_) | MeasuredValue::Area(_));
            if let Some(value) = uses.filter(|value| has_use(value) && (has_room || !is_folded)) {
                ui.horizontal_wrapped(|ui| self.uses(ui, &value, scene.eye.center, cx));
            }
            self.kinds(ui, cx);
            let value = self.kind.value(&self.measured(scene, state.semantics.as_ref()));
            ui.horizontal_wrapped(|ui| {
                ui.label(RichText::new(self.says(value, state)).strong());
                if let Some(remark) = value.ok().and_then(|value| value.remark(meters_per_unit(state))) {
                    ui.weak(remark);
                }
            });
            ui.horizontal_wrapped(|ui| {
                let keep = ui.add_enabled(value.is_ok(), theme::primary_button("Keep"));
                let keep = keep.on_hover_text(format!("{}  Enter", Action::KeepMeasurement.tooltip()));
                if keep.on_disabled_hover_text("There is nothing to keep yet.").clicked() {
                    cx.ask(Action::KeepMeasurement);
                }
                let has_points = !self.points.is_empty() || !self.waiting.is_empty();
                let back = ui.add_enabled(has_points, Button::new("Undo point")).on_hover_text("Backspace");
                if back.clicked() {
                    self.take_back();
                }
                if ui.add_enabled(has_points, Button::new("Clear")).clicked() {
                    (self.points, self.waiting) = (Vec::new(), Vec::new());
                }
            });
        });
        if !keys::is_typing(ui.ctx()) && ui.input(|i| i.key_pressed(Key::Backspace)) {
            self.take_back();
        }
    }
}

/// Draws the kept measurements, scrolled to the newest if `to_end`.
fn list(ui: &mut Ui, all: &mut Vec<Measurement>, meters: Option<f64>, to_end: bool, cx: &mut Ctx<'_>) {
    if all.is_empty() {
        return;
    }
    ui.horizontal(|ui| {
        ui.label(format::things(all.len(), "measurement"));
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            if ui.button("Export\u{2026}").on_hover_text(Action::ExportMeasurements.tooltip()).clicked() {
                cx.ask(Action::ExportMeasurements);
            }
        });
    });
    let mut gone = None;
    ScrollArea::vertical().max_height(LIST_PT).show(ui, |ui| {
        let last = all.len().saturating_sub(1);
        for (i, m) in all.iter_mut().enumerate() {
            let row = ui.horizontal(|ui| {
                let mut is_shown = !m.hidden;
                let tick = ui.checkbox(&mut is_shown, "").on_hover_text("Show it in the view.");
                tick.accessible_name(format!("{} is visible", m.name));
                m.hidden = !is_shown;
                // The name has what the value leaves.
                let font = TextStyle::Body.resolve(ui.style());
                let value_pt = ui.painter().layout_no_wrap(m.text(meters), font, theme::text()).size().x;
                let name_pt = (ui.available_width() - value_pt - DELETE_PT).max(90.0);
                let name = TextEdit::singleline(&mut m.name).desired_width(name_pt).char_limit(80).hint_text("Name");
                if ui.add(name).accessible_name(format!("Name of measurement {}", i + 1)).changed() {
                    m.name = text::line(&m.name).into_owned();
                }
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    let delete = ui.button("\u{d7}").on_hover_text("Delete it; can be undone.");
                    if delete.accessible_name(format!("Delete {}", m.name)).clicked() {
                        gone = Some(i);
                    }
                    let remark = m.value().ok().and_then(|value| value.remark(meters));
                    let value = ui.add(egui::Label::new(m.text(meters)).truncate());
                    if let Some(remark) = remark {
                        value.on_hover_text(remark);
                    }
                });
            });
            if to_end && i == last {
                row.response.scroll_to_me(None);
            }
        }
    });
    if let Some(gone) = gone {
        all.remove(gone);
    }
    ui.separator();
}

fn meters_per_unit(state: &AppState) -> Option<f64> {
    state.scene.as_ref().and_then(|scene| scene.meters_per_unit())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::super::display::frame_of as frame;
    use super::*;
    use crate::scene::Bounds;
    use crate::worker::Slot;

    fn value(ruler: &Ruler) -> Result<MeasuredValue, GeometryFault> {
        ruler.kind.value(&ruler.points)
    }

    #[test]
    fn a_line_sets_the_scale_from_a_true_length() {
        let mut ruler = Ruler::default();
        assert_eq!((value(&ruler), ruler.scale()), (Err(GeometryFault::TooFew), None));
        ruler.put(DVec3::new(1.0, 0.0, 0.0));
        ruler.put(DVec3::new(1.0, 2.0, 0.0));
        assert_eq!((value(&ruler), ruler.scale()), (Ok(MeasuredValue::Length(2.0)), None), "nothing was typed");
        for (typed, scale) in
            [("0.5", Some(0.25)), (" 1,0 ", Some(0.5)), ("0", None), ("-1", None), ("x", None), ("inf", None)]
        {
            ruler.known = typed.into();
            assert_eq!(ruler.scale(), scale, "{typed}");
        }
        ruler.put(DVec3::new(1.0, 4.0, 0.0));
        ruler.known = "1".into();
        assert_eq!(ruler.scale(), Some(0.25), "of the whole line");
        ruler.put(DVec3::new(1.0, 4.0, 0.0));
        assert_eq!((value(&ruler), ruler.scale()), (Err(GeometryFault::SamePoints), None));
    }

    #[test]
    fn a_click_waits_for_the_depth_of_its_view() {
        let ctx = egui::Context::default();
        let eye = Eye::framing(&Bounds { min: DVec3::NEG_ONE, max: DVec3::ONE }, DVec3::Z);
        let pose = Pose { center: eye.center, world_from_camera: eye.world_from_eye, fov_y_rad: eye.fov_y_rad };
        let (mut display, pictures, mut ruler) = (Display::default(), Slot::default(), Ruler::default());
        let mut click = |ruler: &mut Ruler, picture: Option<ViewPicture>, clicked: Option<(Pose, DVec2)>| {
            if let Some(picture) = picture {
                pictures.publish(Ok(Arc::new(picture)));
                display.take(&ctx, &pictures);
            }
            ruler.waiting.extend(clicked);
            ruler.put_waiting(&display, &eye, pose);
            (ruler.points.len(), ruler.waits_for_depth(), ruler.missed)
        };
        let (surface, nothing) = (DVec2::splat(0.625), DVec2::splat(0.1));
        let coarse = ViewPicture { median_depth: None, full: false, ..frame(1, &eye) };
        assert_eq!(click(&mut ruler, Some(coarse), Some((pose, surface))), (0, true, false), "no depth yet");
        assert_eq!(click(&mut ruler, Some(frame(2, &eye)), None), (1, false, false), "it has come");
        let elsewhere = Pose { center: pose.center + DVec3::X, ..pose };
        assert_eq!(click(&mut ruler, None, Some((elsewhere, surface))), (1, false, false), "of a view that was left");
        assert_eq!(click(&mut ruler, None, Some((pose, nothing))), (1, false, true), "control: nothing is there");
    }

    #[test]
    fn an_angle_begins_anew_after_its_third_point() {
        let mut ruler = Ruler { kind: MeasurementKind::Angle, ..Ruler::default() };
        for point in [DVec3::X, DVec3::ZERO, DVec3::Y] {
            ruler.put(point);
        }
        assert_eq!(value(&ruler), Ok(MeasuredValue::Angle(std::f64::consts::FRAC_PI_2)));
        assert_eq!(ruler.scale(), None, "an angle sets no scale");
        ruler.put(DVec3::Z);
        assert_eq!((ruler.points.len(), value(&ruler)), (1, Err(GeometryFault::TooFew)));
        // Control: an area takes another corner.
        let mut area = Ruler { kind: MeasurementKind::Area, points: vec![DVec3::ZERO, DVec3::X, DVec3::ONE], ..ruler };
        area.put(DVec3::Y);
        assert_eq!(area.points.len(), 4);
    }
}
