//! Display of answers: the settings below the query box, and the histogram of relevancy.

use egui::{Color32, ComboBox, Rect, Sense, Slider, Stroke, Ui, pos2, vec2};
use strum::VariantArray;

use super::recipe;
use crate::math::colormap::Colormap;
use crate::math::format;
use crate::pipeline::semantics::query::matching::MatchMode;
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::scene::LevelFilter;
use crate::ui::color_by::ColorBy;
use crate::ui::theme;

/// Settings of search and display of answers.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct OverlaySettings {
    /// Quantity that colors the frame.
    pub(crate) color_by: ColorBy,
    pub(crate) colormap: Colormap,
    /// Opacity of the tint.
    pub(crate) opacity: f32,
    /// Level that queries search.
    pub(crate) kind: LevelFilter,
    /// Largest number of answers that are shown.
    pub(crate) top: usize,
    /// Recipe of the queries.
    pub(crate) recipe: QueryConfig,
    /// Relevancy threshold that is outlined too; 0 for none.
    pub(crate) threshold: f32,
}

impl Default for OverlaySettings {
    fn default() -> Self {
        Self {
            color_by: ColorBy::Masks,
            colormap: Colormap::Turbo,
            opacity: 0.6,
            kind: LevelFilter::Auto,
            top: 1,
            recipe: QueryConfig::default(),
            threshold: 0.0,
        }
    }
}

/// Draws the settings. `heat` is the relevancy of the view's pixels, for the histogram. Returns whether the query must
/// be answered again.
pub(crate) fn show(ui: &mut Ui, settings: &mut OverlaySettings, heat: Option<&[f32]>) -> bool {
    let (kind, recipe) = (settings.kind, settings.recipe.clone());
    egui::Grid::new("overlay settings").num_columns(2).spacing(vec2(10.0, 5.0)).show(ui, |ui| {
        ui.weak("Search in");
        ui.horizontal(|ui| {
            for (kind, text) in
                [(LevelFilter::Auto, "auto"), (LevelFilter::Object, "objects"), (LevelFilter::Part, "parts")]
            {
                ui.selectable_value(&mut settings.kind, kind, text);
            }
        });
        ui.end_row();
        ui.weak("Top answers");
        let top = ui.add(Slider::new(&mut settings.top, 1..=8)).accessible_name("Top answers");
        top.on_hover_text("How many answers are outlined at once");
        ui.end_row();
        ui.weak("Color by");
        ui.horizontal(|ui| {
            let color = ComboBox::from_id_salt("color by")
                .selected_text(settings.color_by.text())
                .width(112.0)
                .show_ui(ui, |ui| {
                    for &tint in ColorBy::VARIANTS {
                        ui.selectable_value(&mut settings.color_by, tint, tint.text());
                    }
                });
            color.response.accessible_name("Color by");
            let colors = ComboBox::from_id_salt("colormap")
                .selected_text(settings.colormap.text())
                .width(70.0)
                .show_ui(ui, |ui| {
                    for &map in Colormap::VARIANTS {
                        ui.selectable_value(&mut settings.colormap, map, map.text());
                    }
                });
            colors.response.accessible_name("Color map");
        });
        ui.end_row();
        recipe::show(ui, &mut settings.recipe);
        ui.weak("Opacity");
        ui.add(Slider::new(&mut settings.opacity, 0.0..=1.0).fixed_decimals(2)).accessible_name("Opacity");
        ui.end_row();
        ui.weak("Mask");
        ui.horizontal(|ui| {
            ui.selectable_value(&mut settings.recipe.masks, MatchMode::Identities, "exact")
                .on_hover_text("Pixels of the identity with the largest weight");
            ui.selectable_value(&mut settings.recipe.masks, MatchMode::Codes, "blended")
                .on_hover_text("Pixels whose alpha-blended code lies within the tolerance, as in the paper");
            ui.selectable_value(&mut settings.recipe.masks, MatchMode::Relevancy, "relevancy")
                .on_hover_text("Pixels over 20 % of LERF's scale: from 0.5 to the largest relevancy in the view");
        });
        ui.end_row();
        ui.weak("Tolerance");
        let mut steps = settings.recipe.tolerance * 255.0;
        let slider = Slider::new(&mut steps, 0.0..=64.0).fixed_decimals(0).suffix(" / 255");
        let slider = ui.add(slider).accessible_name("Tolerance");
        if slider.on_hover_text("Largest difference per channel from the target's code").changed() {
            settings.recipe.tolerance = steps / 255.0;
        }
        ui.end_row();
    });
    if let Some(heat) = heat {
        histogram(ui, settings, heat);
    }
    settings.kind != kind || settings.recipe != recipe
}

/// Bins of the histogram.
const BINS: usize = 64;

/// Draws the histogram of pixel relevancies, with the threshold as a line to drag.
fn histogram(ui: &mut Ui, settings: &mut OverlaySettings, heat: &[f32]) {
    let mut counts = [0_u32; BINS];
    heat.iter().for_each(|h| counts[((h * BINS as f32) as usize).min(BINS - 1)] += 1);
    ui.horizontal_wrapped(|ui| {
        ui.weak("Relevancy of the pixels");
        if settings.threshold > 0.0 {
            let above = heat.iter().filter(|h| **h >= settings.threshold).count();
            let above = format::count(above as u64);
            ui.weak(format!("· {above} px at {:.2} or more, outlined in white", settings.threshold));
        }
    });
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), 54.0), Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Slider, true, "Relevancy threshold"));
    let response = response.on_hover_text("Drag: outline pixels with at least this relevancy. Double-click: off");
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 3.0, theme::canvas());
    // Logarithmic: most pixels are not relevant to a query.
    let height = |n: u32| (1.0 + n as f32).ln() / (1.0 + heat.len() as f32).ln() * rect.height();
    let width = rect.width() / BINS as f32;
    for (i, &n) in counts.iter().enumerate() {
        let [r, g, b] = settings.colormap.color((i as f32 + 0.5) / BINS as f32);
        let left = rect.left() + i as f32 * width;
        let bar = Rect::from_min_max(pos2(left, rect.bottom() - height(n)), pos2(left + width - 1.0, rect.bottom()));
        painter.rect_filled(bar, 0.0, Color32::from_rgb(r, g, b));
    }
    if let Some(pos) = response.interact_pointer_pos() {
        settings.threshold = ((pos.x - rect.left()) / rect.width()).clamp(0.0, 1.0);
    }
    if response.double_clicked() {
        settings.threshold = 0.0;
    }
    if settings.threshold > 0.0 {
        let x = rect.left() + settings.threshold * rect.width();
        painter.vline(x, rect.y_range(), Stroke::new(1.5, Color32::WHITE));
    }
}
