//! The crop box in the view: its edges, faces that can be dragged, and a card with its corners as numbers.

use egui::{Button, Color32, CursorIcon, DragValue, Grid, Id, Pos2, Rect, Sense, Stroke, Ui, Vec2, vec2};
use glam::DVec3;

use super::super::eye::is_in_view;
use super::super::frusta::clipped;
use super::super::split::ViewArea;
use super::card::ToolCard;
use super::{CardPlaces, ToolScene, ViewTool};
use crate::math::format;
use crate::scene::{Bounds, Camera, CropBox, GaussianCloud};
use crate::ui::actions::Action;
use crate::ui::ctx::Ctx;
use crate::ui::{keys, theme};

/// Radius of a face's handle, points.
const HANDLE: f32 = 6.0;
/// Steps across a scene while a number is dragged.
const STEPS: f64 = 500.0;
/// Factor and most steps by which an offered box is shrunk until it is in view.
const SHRINK: f64 = 0.85;
const MOST_SHRUNK: i32 = 30;
/// Border of the picture in which an offered box has no corner, as a share of its size.
const BORDER: f64 = 0.04;

/// The crop box under edit. The box itself is part of what is visible, and outlives the tool.
pub(crate) struct CropTool {
    /// The box that is drawn while there is none: it crops nothing until it is changed or accepted.
    offered: CropBox,
}

impl CropTool {
    /// Offers a box that `eye` sees whole: around all Gaussians, with a margin, or else around `middle`.
    pub(crate) fn new(cloud: Option<&GaussianCloud>, content: &Bounds, eye: &Camera, middle: DVec3) -> Self {
        let all = cloud.and_then(|cloud| Bounds::of((0..cloud.len()).map(|i| cloud.world_position(i))));
        let all = all.unwrap_or(*content);
        let (center, half) = (all.center(), 0.51 * all.size());
        let all = Bounds { min: center - half, max: center + half };
        let middle = middle.clamp(content.min, content.max);
        let shrunk = |step: i32| {
            let share = SHRINK.powi(step);
            Bounds { min: middle.lerp(content.min, share), max: middle.lerp(content.max, share) }
        };
        let bounds =
            std::iter::once(all).chain((0..MOST_SHRUNK).map(shrunk)).find(|bounds| is_in_view(eye, bounds, BORDER));
        Self { offered: CropBox { bounds: bounds.unwrap_or(*content), outside: false } }
    }
}

impl ViewTool for CropTool {
    /// Draws the box in the first view; its faces can be dragged.
    fn paint(&mut self, ui: &Ui, area: ViewArea, scene: &mut ToolScene<'_>, _cx: &mut Ctx<'_>) {
        if area.second {
            return;
        }
        let before = scene.visibility.crop().unwrap_or(self.offered);
        let (mut crop, eye) = (before, scene.camera(area.shown));
        draw_edges(ui, area.shown, &eye, &crop.bounds);
        for axis in 0..3 {
            for high in [false, true] {
                drag_face(ui, area.shown, &eye, &mut crop, axis, high);
            }
        }
        if crop != before {
            scene.visibility.set_crop(Some(crop));
            ui.ctx().request_repaint();
        }
    }

    fn card(&mut self, ui: &Ui, places: CardPlaces, scene: &mut ToolScene<'_>, cx: &mut Ctx<'_>) {
        let state = cx.state;
        let Some(content) = state.scene.as_ref().map(|opened| opened.home.bounds) else { return };
        let before = scene.visibility.crop();
        let mut crop = before;
        let selected = scene.selected_bounds(state.semantics.as_ref());
        ToolCard::in_corner("crop", "Crop box", places.first_frame).show(ui, |ui, _| {
            if before.is_none() {
                ui.weak("Nothing is cropped yet: drag a face, or type.");
            }
            let mut drawn = before.unwrap_or(self.offered);
            numbers(ui, &mut drawn, 2.0 * content.radius() / STEPS);
            if drawn != before.unwrap_or(self.offered) {
                crop = Some(drawn);
            }
            ui.horizontal(|ui| {
                let mut fit = |ui: &mut Ui, text: &str, tip: &str, to: Option<Bounds>| {
                    let button = ui.add_enabled(to.is_some(), Button::new(text)).on_hover_text(tip);
                    if let Some(bounds) = to.filter(|_| button.clicked()) {
                        crop = Some(CropBox { bounds, outside: crop.is_some_and(|c| c.outside) });
                    }
                };
                fit(ui, "Fit scene", "The box of the scene without its stray points.", Some(content));
                fit(ui, "Fit selection", "The box of what is selected.", selected);
                if before.is_none() {
                    let accept = ui.add(theme::primary_button("Crop")).on_hover_text("Show only what is in this box.");
                    crop = if accept.clicked() { Some(self.offered) } else { crop };
                } else if ui.button("Remove box").on_hover_text("Show all again.").clicked() {
                    crop = None;
                }
            });
            ui.horizontal(|ui| {
                let export = Action::ExportCrop;
                let button = ui.add_enabled(crop.is_some(), Button::new("Export\u{2026}"));
                if button.on_hover_text(export.text()).clicked() {
                    cx.ask(export);
                }
                let close = ui
                    .button("Close")
                    .on_hover_text(format!("What is cropped stays so.  {}", keys::label(ui.ctx(), &Action::Crop)));
                if close.clicked() {
                    cx.ask(Action::Crop);
                }
                if let Some(count) = scene.visibility.count() {
                    ui.weak(format!("{} Gaussians", format::count(count as u64)));
                }
            });
        });
        if crop != before {
            scene.visibility.set_crop(crop);
            ui.ctx().request_repaint();
        }
    }
}

/// Draws the corners, scene units, and the choice whether the outside is kept.
fn numbers(ui: &mut Ui, crop: &mut CropBox, step: f64) {
    Grid::new("crop corners").num_columns(4).spacing([8.0, 4.0]).show(ui, |ui| {
        for high in [false, true] {
            let corner = if high { "To" } else { "From" };
            ui.label(corner);
            for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
                let Bounds { min, max } = crop.bounds;
                let (mut value, range) = match high {
                    true => (max[axis], min[axis]..=f64::INFINITY),
                    false => (min[axis], f64::NEG_INFINITY..=max[axis]),
                };
                let field = DragValue::new(&mut value).speed(step).range(range).max_decimals(4);
                let field = ui.add(field.prefix(format!("{name} "))).accessible_name(format!("{corner} {name}"));
                if field.changed() {
                    crop.put_face(axis, high, value);
                }
            }
            ui.end_row();
        }
    });
    ui.checkbox(&mut crop.outside, "Invert").on_hover_text("Show what is not in the box instead.");
}

/// Draws the twelve edges.
fn draw_edges(ui: &Ui, shown: Rect, eye: &Camera, bounds: &Bounds) {
    let painter = ui.painter_at(shown);
    let (corners, place) = (bounds.corners(), |p: glam::DVec2| shown.min + vec2(p.x as f32, p.y as f32));
    for axis in 0..3 {
        for i in (0..8).filter(|i| i >> axis & 1 == 0) {
            let Some((a, b)) = clipped(eye, corners[i], corners[i | 1 << axis]) else { continue };
            for stroke in [Stroke::new(3.0, Color32::from_black_alpha(110)), Stroke::new(1.3, theme::warning())] {
                painter.line_segment([place(a), place(b)], stroke);
            }
        }
    }
}

/// Draws the handle in the middle of a face, and drags the face along its axis.
fn drag_face(ui: &Ui, shown: Rect, eye: &Camera, crop: &mut CropBox, axis: usize, high: bool) {
    let Bounds { min, max } = crop.bounds;
    let mut middle = crop.bounds.center();
    middle[axis] = if high { max[axis] } else { min[axis] };
    let Some((at, along)) = on_screen(eye, shown, middle, axis) else { return };
    // Drag only: for the keyboard there are the numbers.
    let id = Id::unique("crop face").with((axis, high));
    let handle = ui.interact(Rect::from_center_size(at, Vec2::splat(3.0 * HANDLE)), id, Sense::DRAG);
    if handle.dragged() {
        crop.put_face(axis, high, middle[axis] + travel(handle.drag_delta(), along));
    }
    let held = handle.hovered() || handle.dragged();
    let fill = if held { theme::accent() } else { theme::warning() };
    ui.painter_at(shown).circle(at, HANDLE, fill, Stroke::new(1.5, Color32::from_black_alpha(200)));
    if held {
        handle.on_hover_and_drag_cursor(CursorIcon::Grab).on_hover_text("Drag the face of the crop box");
    }
}

/// Position of a point in the view, and its motion there per unit along an axis.
pub(super) fn on_screen(eye: &Camera, shown: Rect, p: DVec3, axis: usize) -> Option<(Pos2, Vec2)> {
    let step = 1e-3 * (p - eye.center).length();
    let mut beside = p;
    beside[axis] += step;
    let (a, b) = (eye.project(p)?, eye.project(beside)?);
    let along = (b - a) / step;
    let at = shown.min + vec2(a.x as f32, a.y as f32);
    shown.contains(at).then_some((at, vec2(along.x as f32, along.y as f32)))
}

/// Motion of a face along its axis for a drag in the view; `along` is the motion of one unit in the view.
pub(super) fn travel(drag: Vec2, along: Vec2) -> f64 {
    // An axis along the line of sight would move the face very far.
    let length_sq = along.length_sq();
    if length_sq < 1.0 { 0.0 } else { f64::from(drag.dot(along) / length_sq) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_box_is_in_view_and_around_every_gaussian_if_that_can_be() {
        let mut positions: Vec<[f32; 3]> = (0..100).map(|i| [i as f32 * 0.01; 3]).collect();
        positions.extend([[9.0, -9.0, 0.0], [f32::NAN; 3]]);
        let cloud = GaussianCloud { positions, ..GaussianCloud::default() };
        let content = Bounds::robust((0..cloud.len()).map(|i| cloud.world_position(i))).expect("some");
        let is_in = |b: &Bounds, i| {
            let p: DVec3 = cloud.world_position(i);
            p.cmpge(b.min).all() && p.cmple(b.max).all()
        };
        let from = |distance: f64| {
            let middle = content.center();
            let eye = middle + DVec3::new(0.6, -1.0, 0.5) * distance;
            Camera::look_at(eye, middle, DVec3::Z, 0.8, 400, 300).expect("valid")
        };
        let offered = |cloud, eye: &Camera| CropTool::new(cloud, &content, eye, content.center()).offered.bounds;
        let far = from(60.0);
        let first = offered(Some(&cloud), &far);
        assert!((0..101).all(|i| is_in(&first, i)) && is_in_view(&far, &first, BORDER), "{first:?}");
        // From within the scene that box has no edge in view: a smaller one is offered, which has.
        let near = from(0.7);
        assert!(!is_in_view(&near, &first, BORDER) && !is_in_view(&near, &content, BORDER), "the control");
        let first = offered(Some(&cloud), &near);
        assert!(is_in_view(&near, &first, BORDER) && is_in(&first, 50) && !is_in(&first, 100), "{first:?}");
        // The box of the content leaves the stray one out; without Gaussians it is all that is known.
        assert!(!is_in(&content, 100));
        let without = offered(None, &far);
        assert!(!is_in(&without, 100) && is_in(&without, 50));
    }

    #[test]
    fn a_face_follows_the_cursor_along_its_axis() {
        let eye = Camera::look_at(DVec3::new(0.0, -5.0, 0.0), DVec3::ZERO, DVec3::Z, 0.8, 400, 300).expect("valid");
        let shown = Rect::from_min_size(egui::pos2(20.0, 30.0), vec2(400.0, 300.0));
        let (at, along) = on_screen(&eye, shown, DVec3::X, 0).expect("in view");
        assert!(along.x > 1.0 && along.y.abs() < 1e-2, "{along:?}");
        // The face follows the pointer.
        let moved = travel(vec2(40.0, 7.0), along);
        let (there, _) = on_screen(&eye, shown, DVec3::X + DVec3::X * moved, 0).expect("in view");
        assert!((there.x - at.x - 40.0).abs() < 0.1, "{there:?} {at:?}");
        let (_, towards) = on_screen(&eye, shown, DVec3::ZERO, 1).expect("in view");
        assert_eq!(travel(vec2(40.0, 0.0), towards), 0.0, "an axis towards the eye is not dragged");
        assert!(on_screen(&eye, shown, DVec3::X * 50.0, 0).is_none(), "beside the view");
    }
}
