//! Choosing Gaussians with a brush: those with centers under the brush, on or before the visible surface, or all along
//! the line of sight.

use egui::{Color32, PointerButton, Response, Slider, Stroke, Ui};
use glam::DVec2;

use super::super::split::ViewArea;
use super::{CardPlaces, ToolScene, ViewTool, bottom_card};
use crate::scene::{Camera, GaussianCloud};
use crate::ui::actions::Action;
use crate::ui::ctx::Ctx;

/// Largest depth of a center behind the rendered surface to count as on it, as a share of its depth.
const ON_SURFACE: f64 = 0.02;

/// Gaussians brushed over since the last request.
pub(crate) struct Brushed {
    pub(crate) numbers: Vec<usize>,
    /// True if they are removed from the choice.
    pub(crate) erase: bool,
}

/// The brush.
pub(crate) struct SplatBrush {
    radius_px: f32,
    /// True if Gaussians behind the surface are chosen, too.
    through: bool,
    /// Projected centers of the Gaussians in the frame of this camera; `None` for those that cannot be chosen there.
    centers: Option<(Camera, bool, Vec<Option<DVec2>>)>,
    brushed: Vec<Brushed>,
}

impl Default for SplatBrush {
    fn default() -> Self {
        Self { radius_px: 18.0, through: false, centers: None, brushed: Vec::new() }
    }
}

impl SplatBrush {
    /// The Gaussians under a dab of this radius in px of the frame.
    fn under(&self, at: DVec2, radius: f64) -> Vec<usize> {
        let centers = self.centers.iter().flat_map(|(_, _, centers)| centers);
        let near = |c: &Option<DVec2>| c.is_some_and(|c| c.distance_squared(at) <= radius * radius);
        centers.enumerate().filter(|(_, c)| near(c)).map(|(i, _)| i).collect()
    }
}

impl ViewTool for SplatBrush {
    fn takes_drags(&self) -> bool {
        true
    }

    /// Chooses Gaussians along drags and clicks; removes them from the choice with Shift.
    fn pointer(&mut self, response: &Response, area: ViewArea, scene: &mut ToolScene<'_>, _cx: &mut Ctx<'_>) {
        let (Some(picture), Some(cloud)) = (scene.display.picture(), scene.cloud) else { return };
        let (Some(pos), true) = (
            response.interact_pointer_pos(),
            response.dragged_by(PointerButton::Primary) || response.clicked_by(PointerButton::Primary),
        ) else {
            return;
        };
        // Marks change during brushing, the view does not.
        let is_here = |c: &Camera| (c.center, c.world_from_camera) == (scene.eye.center, scene.eye.world_from_eye);
        let known = self.centers.as_ref().is_some_and(|(camera, through, centers)| {
            is_here(camera) && (*through, centers.len()) == (self.through, cloud.len())
        });
        if !known {
            // A late frame does not match the current view, and a coarse one has no depth.
            if !picture.full || !is_here(&picture.camera) {
                return;
            }
            let depth = picture.median_depth.as_deref().filter(|_| !self.through);
            let numbers = scene.visibility.numbers();
            let centers = centers(cloud, numbers.as_deref().map(Vec::as_slice), &picture.camera, depth);
            self.centers = Some((picture.camera.clone(), self.through, centers));
        }
        let Some((camera, ..)) = &self.centers else { return };
        let scale = f64::from(camera.width_px) / f64::from(area.shown.width());
        let at = DVec2::new(f64::from(pos.x - area.shown.left()), f64::from(pos.y - area.shown.top())) * scale;
        let erase = response.ctx.input(|i| i.modifiers.shift);
        let numbers = self.under(at, f64::from(self.radius_px) * scale);
        if !numbers.is_empty() {
            self.brushed.push(Brushed { numbers, erase });
        }
    }

    /// Draws the circle of the brush at the pointer.
    fn paint(&mut self, ui: &Ui, area: ViewArea, _scene: &mut ToolScene<'_>, _cx: &mut Ctx<'_>) {
        if let Some(pos) = ui.input(|i| i.pointer.hover_pos()).filter(|p| area.shown.contains(*p)) {
            ui.painter().circle_stroke(pos, self.radius_px, Stroke::new(3.0, Color32::from_black_alpha(160)));
            ui.painter().circle_stroke(pos, self.radius_px, Stroke::new(1.0, Color32::WHITE));
        }
    }

    fn take_brushed(&mut self) -> Vec<Brushed> {
        std::mem::take(&mut self.brushed)
    }

    fn card(&mut self, ui: &Ui, places: CardPlaces, _scene: &mut ToolScene<'_>, cx: &mut Ctx<'_>) {
        let rect = places.active_view;
        bottom_card(ui, "splat brush", rect, 200.0..=430.0, |ui| {
            ui.label("Brush over the Gaussians to choose: drag in any view.");
            ui.weak("Shift takes out of the choice. Right-drag and wheel move the view.");
            ui.horizontal(|ui| {
                ui.add(Slider::new(&mut self.radius_px, 2.0..=120.0).show_value(false).text("brush"));
                ui.checkbox(&mut self.through, "Through").on_hover_text("Choose what lies behind the surface, too.");
                if ui.button("Done").clicked() {
                    cx.ask(Action::SegmentNew(None));
                }
            });
        });
    }
}

/// Projected centers of the drawn Gaussians in a frame of this camera; with `depth`, only those on or before the
/// surface.
fn centers(
    cloud: &GaussianCloud,
    numbers: Option<&[usize]>,
    camera: &Camera,
    depth: Option<&[f32]>,
) -> Vec<Option<DVec2>> {
    let (w, h) = (camera.width_px as usize, camera.height_px as usize);
    let center = |i: usize| {
        let world = cloud.world_position(i);
        let at = camera.project(world)?;
        let inside = at.min_element() >= 0.0 && at.x < w as f64 && at.y < h as f64;
        let surface = |depth: &[f32]| depth.get(at.y as usize * w + at.x as usize).copied().unwrap_or(0.0);
        let seen = depth.is_none_or(|depth| {
            let surface = f64::from(surface(depth));
            surface <= 0.0 || camera.camera_from_world(world).z <= surface * (1.0 + ON_SURFACE)
        });
        (inside && seen).then_some(at)
    };
    let mut centers = vec![None; cloud.len()];
    match numbers {
        Some(numbers) => numbers.iter().for_each(|i| centers[*i] = center(*i)),
        None => centers.iter_mut().enumerate().for_each(|(i, c)| *c = center(i)),
    }
    centers
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn what_is_before_the_surface_or_on_it_is_chosen_and_what_is_behind_only_through_it() {
        let camera = Camera::look_at(DVec3::new(0.0, -4.0, 0.0), DVec3::ZERO, DVec3::Z, 0.8, 40, 40).expect("valid");
        // Before the surface, on it, behind it, beside it on it, and behind the camera.
        let positions = vec![[0.0, -2.0, 0.0], [0.0, 0.03, 0.0], [0.0, 2.0, 0.0], [1.0, 0.0, 0.0], [0.0, -9.0, 0.0]];
        let cloud = GaussianCloud::isotropic(positions, 0.0, 0.0);
        let depth = vec![4.0; 40 * 40];
        let under = |depth, numbers| {
            let brush = SplatBrush {
                centers: Some((camera.clone(), false, centers(&cloud, numbers, &camera, depth))),
                ..SplatBrush::default()
            };
            brush.under(DVec2::new(20.0, 20.0), 4.0)
        };
        assert_eq!(under(Some(&depth[..]), None), [0, 1]);
        assert_eq!(under(None, None), [0, 1, 2]);
        assert_eq!(under(None, Some(&[1, 3][..])), [1], "of those that are drawn");
    }
}
