//! Choosing Gaussians by the color under the cursor: those whose own color is near it.

use egui::{Color32, PointerButton, Response, Sense, Slider, Ui, vec2};

use super::super::split::ViewArea;
use super::splat_brush::Brushed;
use super::{CardPlaces, ToolScene, ViewTool, bottom_card};
use crate::math::format;
use crate::scene::GaussianCloud;
use crate::ui::actions::Action;
use crate::ui::ctx::Ctx;
use crate::worker::ViewMode;

/// The eyedropper, with the color that was picked last and how many Gaussians have it.
pub(crate) struct Eyedropper {
    /// Largest distance in red, green and blue, each 0 to 1.
    tolerance: f32,
    picked: Option<([u8; 3], usize)>,
    brushed: Vec<Brushed>,
}

impl Default for Eyedropper {
    fn default() -> Self {
        Self { tolerance: 0.12, picked: None, brushed: Vec::new() }
    }
}

/// Those of the drawn Gaussians whose view-independent color is within `tolerance` of `color`; all are drawn without
/// `drawn`.
fn of_color(cloud: &GaussianCloud, drawn: Option<&[usize]>, color: [u8; 3], tolerance: f32) -> Vec<usize> {
    let color = color.map(|v| f32::from(v) / 255.0);
    let is_near = |i: &usize| {
        let own = cloud.mean_color(*i);
        (0..3).map(|k| (own[k] - color[k]).powi(2)).sum::<f32>().sqrt() <= tolerance
    };
    match drawn {
        Some(drawn) => drawn.iter().copied().filter(is_near).collect(),
        None => (0..cloud.len()).filter(is_near).collect(),
    }
}

impl ViewTool for Eyedropper {
    fn takes_clicks(&self) -> bool {
        true
    }

    /// Chooses the Gaussians of the clicked color; removes them from the choice with Shift.
    fn pointer(&mut self, response: &Response, area: ViewArea, scene: &mut ToolScene<'_>, cx: &mut Ctx<'_>) {
        let (Some(picture), Some(cloud), Some(pos)) =
            (scene.display.picture(), scene.cloud, response.interact_pointer_pos())
        else {
            return;
        };
        // Other modes show colors that no Gaussian has, and another scene has other Gaussians.
        let is_rgb = *cx.layout.mode_of(area.second) == ViewMode::Rgb && !area.is_other;
        if !is_rgb || !response.clicked_by(PointerButton::Primary) || !area.shown.contains(pos) {
            return;
        }
        let Ok(pixels) = picture.pixels(area.second) else { return };
        let at = (pos - area.shown.min) / area.shown.size();
        let x = ((at.x * pixels.width_px as f32) as u32).min(pixels.width_px - 1);
        let y = ((at.y * pixels.height_px as f32) as u32).min(pixels.height_px - 1);
        let Some(color) = pixels.rgb.get((y * pixels.width_px + x) as usize) else { return };
        let drawn = scene.visibility.numbers();
        let numbers = of_color(cloud, drawn.as_deref().map(Vec::as_slice), *color, self.tolerance);
        self.picked = Some((*color, numbers.len()));
        let erase = response.ctx.input(|i| i.modifiers.shift);
        if !numbers.is_empty() {
            self.brushed.push(Brushed { numbers, erase });
        }
    }

    fn take_brushed(&mut self) -> Vec<Brushed> {
        std::mem::take(&mut self.brushed)
    }

    fn card(&mut self, ui: &Ui, places: CardPlaces, _scene: &mut ToolScene<'_>, cx: &mut Ctx<'_>) {
        let rect = places.active_view;
        bottom_card(ui, "eyedropper", rect, 200.0..=430.0, |ui| {
            ui.label("Click a color: all Gaussians of that color are chosen.");
            ui.weak("Shift takes them out of the choice. The view must show RGB.");
            ui.horizontal(|ui| {
                ui.add(Slider::new(&mut self.tolerance, 0.01..=0.6).show_value(false).text("tolerance"));
                if let Some(([r, g, b], count)) = self.picked {
                    let (swatch, _) = ui.allocate_exact_size(vec2(18.0, 14.0), Sense::hover());
                    ui.painter().rect_filled(swatch, 3.0, Color32::from_rgb(r, g, b));
                    ui.weak(format::things(count, "Gaussian"));
                }
                if ui.button("Done").clicked() {
                    cx.ask(Action::SegmentNew(None));
                }
            });
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sh::SH_C0;

    #[test]
    fn the_color_and_the_tolerance_decide_among_what_is_drawn() {
        let sh = |color: [f32; 3]| color.map(|v| (v - 0.5) / SH_C0 as f32);
        let cloud = GaussianCloud {
            sh: vec![sh([1.0, 0.0, 0.0]), sh([0.9, 0.1, 0.0]), sh([0.0, 0.0, 1.0])],
            ..GaussianCloud::isotropic(vec![[0.0; 3]; 3], 0.0, 0.0)
        };
        let red = [255, 0, 0];
        assert_eq!(of_color(&cloud, None, red, 0.05), [0]);
        assert_eq!(of_color(&cloud, None, red, 0.2), [0, 1]);
        assert_eq!(of_color(&cloud, Some(&[1, 2]), red, 0.2), [1], "of those that are drawn");
        assert!(of_color(&cloud, None, [0, 255, 0], 0.2).is_empty());
    }
}
