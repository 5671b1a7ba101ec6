//! What the colors over the view mean, with the threshold and the opacity beside it.

use egui::{Color32, Mesh, Rect, RichText, Sense, Slider, Ui, vec2};

use super::query::OverlaySettings;
use crate::math::colormap::Colormap;
use crate::ui::color_by::ColorBy;
use crate::ui::theme;

/// Steps of the color bar.
const STEPS: usize = 32;

/// Whether there is something to explain.
pub(super) fn is_needed(settings: &OverlaySettings, depth: Option<(f32, f32)>) -> bool {
    settings.color_by != ColorBy::Masks || depth.is_some()
}

/// The legend of the tint, or of the depths that the frame shows.
pub(super) fn show(ui: &mut Ui, settings: &mut OverlaySettings, depth: Option<(f32, f32)>) {
    let small = |text: String| RichText::new(text).small().color(theme::WEAK);
    ui.vertical(|ui| {
        if let Some((near, far)) = depth {
            ui.label(RichText::new("Depth").small());
            bar(ui, Colormap::Turbo);
            ui.horizontal(|ui| {
                ui.label(small(format!("{near:.2}")));
                ui.add_space(70.0);
                ui.label(small(format!("{far:.2} units")));
            });
        }
        let meaning = match settings.color_by {
            ColorBy::Masks => return,
            ColorBy::Heat => "Relevancy to the newest query",
            ColorBy::Objects => "One color per object",
            ColorBy::Parts => "One color per part",
            ColorBy::Codes => "Identity codes as colors",
            ColorBy::Features => "Embeddings: like colors, like things",
            ColorBy::Difference => "Where blended codes differ",
        };
        ui.label(RichText::new(meaning).small());
        if settings.color_by == ColorBy::Heat {
            bar(ui, settings.colormap);
            ui.add(Slider::new(&mut settings.threshold, 0.0..=1.0).fixed_decimals(2).text("threshold"))
                .on_hover_text("Outline all pixels of at least this relevancy; 0 = none");
        }
        ui.add(Slider::new(&mut settings.opacity, 0.0..=1.0).fixed_decimals(2).text("opacity"));
    });
}

/// A color map from 0 on the left to 1 on the right.
fn bar(ui: &mut Ui, map: Colormap) {
    let (rect, _) = ui.allocate_exact_size(vec2(170.0, 10.0), Sense::hover());
    let mut mesh = Mesh::default();
    for step in 0..STEPS {
        let at = |k: usize| rect.left() + rect.width() * k as f32 / STEPS as f32;
        let [r, g, b] = map.color((step as f32 + 0.5) / STEPS as f32);
        let cell = Rect::from_x_y_ranges(at(step)..=at(step + 1), rect.y_range());
        mesh.add_colored_rect(cell, Color32::from_rgb(r, g, b));
    }
    ui.painter().add(mesh);
}
