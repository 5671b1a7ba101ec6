//! Transforming an object or part: moving, rotating, scaling, duplicating, recoloring.

use std::sync::Arc;

use egui::{Color32, DragValue, Id, Rect, Sense, Stroke, Ui, Vec2};
use glam::{DQuat, DVec3};

use super::super::split::ViewArea;
use super::card::ToolCard;
use super::crop::{on_screen, travel};
use super::{CardPlaces, ToolScene, ViewTool};
use crate::jobs::rearrange::{Arrangement, SplatEdit, apply};
use crate::scene::{Bounds, Camera, GaussianCloud, Identities, IdentityId, NO_IDENTITY, SemanticMap};
use crate::ui::actions::Action;
use crate::ui::ctx::Ctx;
use crate::ui::theme;
use crate::worker::Versioned;

/// Length of the arrows, points.
const ARROW: f32 = 80.0;
const HANDLE: f32 = 7.0;
const AXES: [Color32; 3] =
    [Color32::from_rgb(0xf0, 0x5a, 0x4b), Color32::from_rgb(0x5f, 0xc8, 0x4f), Color32::from_rgb(0x4d, 0x9d, 0xf5)];
/// Initial color.
const FIRST_COLOR: [f32; 3] = [0.8, 0.2, 0.15];

/// The arrangement of an object or part under edit.
pub(crate) struct TransformTool {
    arrangement: Arrangement,
    /// Rotation about the up direction, degrees.
    degrees: f64,
    up: DVec3,
    /// Center and half the diagonal of the object or part before the arrangement.
    middle: DVec3,
    radius: f64,
    /// The selection at the last redraw; a new one is followed while nothing is changed.
    selected: Option<Option<IdentityId>>,
    /// True if the card is in the corner on the right, away from the thing; `None` before the first redraw.
    on_the_right: Option<bool>,
    /// The preview, with the Gaussians and objects that it was made from.
    shown: Option<TransformPreview>,
}

struct TransformPreview {
    of: (u64, u64, Arrangement),
    cloud: Versioned<GaussianCloud>,
    map: Option<Versioned<SemanticMap>>,
}

impl TransformTool {
    pub(crate) fn new(id: u32, cloud: &GaussianCloud, map: &SemanticMap, up: DVec3) -> Self {
        let places = map.members(id).into_iter().filter(|i| *i < cloud.len()).map(|i| cloud.world_position(i));
        let bounds = Bounds::robust(places);
        let (middle, radius) = bounds.map_or((DVec3::ZERO, 1.0), |b| (b.center(), b.radius()));
        Self {
            arrangement: Arrangement::of(id),
            degrees: 0.0,
            up,
            middle,
            radius,
            selected: None,
            on_the_right: None,
            shown: None,
        }
    }

    /// The arrangement so far.
    pub(crate) fn arrangement(&self) -> Arrangement {
        self.arrangement
    }

    /// True if anything is changed.
    pub(crate) fn is_something(&self) -> bool {
        self.arrangement != Arrangement::of(self.arrangement.id)
    }

    /// Arranged Gaussians and their identities; `None` while nothing is changed.
    pub(crate) fn preview(
        &mut self,
        cloud: &Versioned<GaussianCloud>,
        map: Option<&Versioned<SemanticMap>>,
    ) -> Option<(Versioned<GaussianCloud>, Option<Versioned<SemanticMap>>)> {
        if !self.is_something() {
            return None;
        }
        let map = map?;
        let of = (cloud.generation(), map.generation(), self.arrangement);
        if self.shown.as_ref().is_none_or(|shown| shown.of != of) {
            let (new, new_map) = apply(cloud, Some(map), &SplatEdit::Arrange(self.arrangement)).ok()?;
            let (cloud, map) = (Versioned::new(Arc::new(new)), new_map.map(|map| Versioned::new(Arc::new(map))));
            self.shown = Some(TransformPreview { of, cloud, map });
        }
        self.shown.as_ref().map(|shown| (shown.cloud.clone(), shown.map.clone()))
    }

    /// Another identity that was selected since the last redraw, while nothing is changed.
    fn follows(&mut self, selected: Option<IdentityId>) -> Option<IdentityId> {
        let before = self.selected.replace(selected)?;
        selected.filter(|id| before != selected && *id != self.arrangement.id && !self.is_something())
    }

    /// Draws the arrows for dragging along the axes.
    fn show_arrows(&mut self, ui: &Ui, shown: Rect, eye: &Camera) {
        let painter = ui.painter_at(shown);
        for (axis, color) in AXES.into_iter().enumerate() {
            let middle = self.middle + self.arrangement.to.shift;
            let Some((at, along)) = on_screen(eye, shown, middle, axis) else { continue };
            // An axis along the line of sight has no arrow.
            if along.length() * (self.radius as f32) < 4.0 {
                continue;
            }
            let tip = at + along.normalized() * ARROW;
            let id = Id::unique("arrange arrow").with(axis);
            let handle = ui.interact(Rect::from_center_size(tip, Vec2::splat(3.0 * HANDLE)), id, Sense::DRAG);
            if handle.dragged() {
                self.arrangement.to.shift[axis] += travel(handle.drag_delta(), along);
            }
            let width = if handle.hovered() || handle.dragged() { 4.0 } else { 2.5 };
            painter.line_segment([at, tip], Stroke::new(width + 2.0, Color32::from_black_alpha(120)));
            painter.line_segment([at, tip], Stroke::new(width, color));
            painter.circle(tip, HANDLE, color, Stroke::new(1.5, Color32::from_black_alpha(200)));
            handle.on_hover_text(format!("Drag along {}", ["x", "y", "z"][axis]));
        }
    }

    /// Draws the card of the tool.
    fn show_card(&mut self, ui: &Ui, rect: Rect, all: &Identities, cx: &mut Ctx<'_>) {
        let name = all.full_name(self.arrangement.id);
        let title = format!("Move \u{201c}{name}\u{201d}: drag an arrow or type values");
        let card = ToolCard::in_corner("arranging", title, rect);
        let card = if self.on_the_right == Some(true) { card.on_the_right() } else { card };
        card.show(ui, |ui, _| {
            // Fields are in meters where the scale is known, as lengths are elsewhere.
            let meters = cx.state.scene.as_ref().and_then(|scene| scene.meters_per_unit());
            let (scale, unit) = meters.map_or((1.0, "units"), |meters| (meters, "m"));
            ui.horizontal(|ui| {
                ui.label("Move");
                for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
                    let shift = &mut self.arrangement.to.shift[axis];
                    let mut shown = *shift * scale;
                    let field = DragValue::new(&mut shown).speed(self.radius * scale / 100.0);
                    let field = field.max_decimals(4).prefix(format!("{name} ")).suffix(format!(" {unit}"));
                    if ui.add(field).accessible_name(format!("Move along {name}, {unit}")).changed() {
                        *shift = shown / scale;
                    }
                }
            });
            ui.horizontal(|ui| {
                ui.label("Turn");
                let turn = DragValue::new(&mut self.degrees).speed(1.0).suffix("\u{b0}").max_decimals(1);
                if ui.add(turn).on_hover_text("About the up direction.").accessible_name("Turn").changed() {
                    self.arrangement.to.turn = DQuat::from_axis_angle(self.up, self.degrees.to_radians());
                }
                ui.label("Scale");
                let scale = DragValue::new(&mut self.arrangement.to.scale).speed(0.01).range(0.01..=100.0);
                ui.add(scale.max_decimals(3)).accessible_name("Scale");
                let mut has_color = self.arrangement.color.is_some();
                if ui.checkbox(&mut has_color, "Color").on_hover_text("Another color; its shades stay.").changed() {
                    self.arrangement.color = has_color.then_some(FIRST_COLOR);
                }
                if let Some(color) = &mut self.arrangement.color {
                    let mut shown = color.map(|v| (255.0 * v).round() as u8);
                    if ui.color_edit_button_srgb(&mut shown).changed() {
                        *color = shown.map(|v| f32::from(v) / 255.0);
                    }
                }
            });
            ui.horizontal(|ui| {
                let grade = &mut self.arrangement.grade;
                for (value, name) in [(&mut grade.brightness, "Brightness"), (&mut grade.saturation, "Saturation")] {
                    ui.label(name);
                    let field = DragValue::new(value).speed(0.01).range(0.0..=4.0).max_decimals(2);
                    ui.add(field).accessible_name(name);
                }
                ui.label("Tint").on_hover_text("White becomes this color, at its brightness.");
                let mut shown = grade.tint.map(|v| (255.0 * v).round() as u8);
                if ui.color_edit_button_srgb(&mut shown).changed() && shown != [0; 3] {
                    grade.tint = shown.map(|v| f32::from(v) / 255.0);
                }
            });
            ui.checkbox(&mut self.arrangement.duplicate, "Apply to a copy");
            ui.horizontal(|ui| {
                let keep = Action::ApplyTransform;
                let button = ui.add_enabled(self.is_something(), theme::primary_button("Apply"));
                if button.on_hover_text(format!("{}  Enter", keep.tooltip())).clicked() {
                    cx.ask(keep);
                }
                if ui.add_enabled(self.is_something(), egui::Button::new("Reset")).clicked() {
                    (self.arrangement, self.degrees) = (Arrangement::of(self.arrangement.id), 0.0);
                }
                if ui.button("Cancel").on_hover_text("Escape").clicked() {
                    cx.ask(Action::SegmentNew(None));
                }
                // Last, as not every thing has a whole: no other button slides under the pointer.
                let whole = all.get(self.arrangement.id).map_or(NO_IDENTITY, |i| i.parent);
                if whole != NO_IDENTITY && ui.button("All of it").on_hover_text(all.full_name(whole)).clicked() {
                    cx.ask(Action::Transform(whole));
                }
            });
        });
    }
}

impl ViewTool for TransformTool {
    /// Draws the arrows in the first view.
    fn paint(&mut self, ui: &Ui, area: ViewArea, scene: &mut ToolScene<'_>, _cx: &mut Ctx<'_>) {
        if area.second {
            return;
        }
        let before = self.arrangement;
        self.show_arrows(ui, area.shown, &scene.camera(area.shown));
        if self.arrangement != before {
            ui.ctx().request_repaint();
        }
    }

    fn card(&mut self, ui: &Ui, places: CardPlaces, scene: &mut ToolScene<'_>, cx: &mut Ctx<'_>) {
        let shown = places.first_frame;
        let middle = self.middle + self.arrangement.to.shift;
        let is_left = || Some(scene.camera(shown).project(middle)?.x < 0.5 * f64::from(shown.width()));
        self.on_the_right.get_or_insert_with(|| is_left().unwrap_or(false));
        if let Some(next) = self.follows(scene.picking.selected()) {
            cx.ask(Action::Transform(next));
        }
        let (before, none, state) = (self.arrangement, Identities::default(), cx.state);
        let all = state.semantics.as_ref().map_or(&none, |map| &map.identities);
        self.show_card(ui, shown, all, cx);
        if self.arrangement != before {
            ui.ctx().request_repaint();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jobs::rearrange::Placement;
    use crate::scene::Level;

    #[test]
    fn another_selection_is_followed_while_nothing_is_changed() {
        let cloud = GaussianCloud::isotropic(vec![[0.0; 3]; 2], -3.0, 2.0);
        let mut all = Identities::default();
        all.add(Level::Object, NO_IDENTITY, vec!["mug".into()]);
        let map = SemanticMap::from_identities(all, vec![1, 1], vec![1.0; 2], vec![]);
        let mut tool = TransformTool::new(1, &cloud, &map, DVec3::Y);
        assert_eq!(tool.follows(Some(2)), None, "it was begun for another one than the selection");
        assert_eq!((tool.follows(Some(2)), tool.follows(Some(1)), tool.follows(None)), (None, None, None));
        assert_eq!(tool.follows(Some(2)), Some(2));
        tool.arrangement.duplicate = true;
        assert_eq!(tool.follows(Some(3)), None, "a change is not lost");
    }

    #[test]
    fn the_preview_is_what_is_kept_and_nothing_is_shown_before_a_change() {
        let cloud = GaussianCloud::isotropic((0..6).map(|i| [i as f32, 0.0, 0.0]).collect(), -3.0, 2.0);
        let mut all = Identities::default();
        all.add(Level::Object, NO_IDENTITY, vec!["mug".into()]);
        let map = SemanticMap::from_identities(all, vec![1, 1, 1, 0, 0, 0], vec![1.0; 6], vec![]);
        let mut tool = TransformTool::new(1, &cloud, &map, DVec3::Y);
        let (cloud, map) = (Versioned::new(Arc::new(cloud)), Versioned::new(Arc::new(map)));
        assert!(tool.preview(&cloud, Some(&map)).is_none());
        tool.arrangement.to = Placement { shift: DVec3::new(0.0, 2.0, 0.0), ..Placement::default() };
        let (shown, _) = tool.preview(&cloud, Some(&map)).expect("changed");
        assert_eq!(shown.positions[1], [1.0, 2.0, 0.0]);
        let (again, _) = tool.preview(&cloud, Some(&map)).expect("changed");
        assert_eq!(again.generation(), shown.generation(), "made once");
        let (kept, _) = apply(&cloud, Some(&map), &SplatEdit::Arrange(tool.arrangement())).expect("kept");
        assert!(kept == **shown);
    }
}
