//! Legend of the colors over the view, with threshold and opacity.

use egui::{Align, Color32, FontId, Layout, Mesh, Rect, Response, RichText, Sense, Slider, Stroke, Ui, vec2};

use super::query::{HATCH, INVENTED, OverlaySettings};
use crate::math::colormap::Colormap;
use crate::math::format;
use crate::scene::NO_IDENTITY;
use crate::ui::actions::Action;
use crate::ui::color_by::ColorBy;
use crate::ui::ctx::Ctx;
use crate::ui::theme;

/// Width of the labels of sliders, points.
const LABEL_PT: f32 = 62.0;
/// Steps of the color bar.
const STEPS: usize = 32;

/// True if the view needs a legend.
pub(super) fn is_needed(settings: &OverlaySettings, depth: Option<(f32, f32)>) -> bool {
    settings.color_by != ColorBy::Masks || depth.is_some()
}

/// Draws the legend of the tint, or of the depths in the frame. `shares` are the shares of unlabeled and of invented
/// pixels, at rest; `photo` is the label of a button that segments one more photo.
pub(super) fn show(
    ui: &mut Ui,
    settings: &mut OverlaySettings,
    depth: Option<(f32, f32)>,
    is_orthographic: bool,
    shares: Option<[f64; 2]>,
    photo: Option<&str>,
    cx: &mut Ctx<'_>,
) {
    ui.vertical(|ui| {
        if let Some((near, far)) = depth {
            // The camera of an orthographic view is far away, and its distance means nothing.
            let (text, from) = if is_orthographic { ("Depth from the nearest point", near) } else { ("Depth", 0.0) };
            let meters = cx.state.scene.as_ref().and_then(|scene| scene.meters_per_unit());
            let unit = if meters.is_some() { "m" } else { "units" };
            ui.label(RichText::new(format!("{text}, {unit}")).small());
            let scale = meters.unwrap_or(1.0) as f32;
            bar(ui, Colormap::Turbo, [near, far].map(|d| format!("{:.2}", (d - from) * scale)));
        }
        let meaning = match settings.color_by {
            ColorBy::Masks => return,
            ColorBy::Heat => "Relevancy to the latest query",
            ColorBy::Objects => "One color per object",
            ColorBy::Parts => "One color per part",
            ColorBy::Codes => "Identity codes as colors",
            ColorBy::Features => "Embeddings: similar colors = similar things",
            ColorBy::Difference => "Where blended codes differ",
        };
        ui.label(RichText::new(meaning).small());
        if settings.color_by.tells_unknown() {
            show_unknown(ui, shares.map(|s| s[0]), photo, cx);
            if let Some([_, invented]) = shares.filter(|s| s[1] > 0.0) {
                show_invented(ui, invented);
            }
        }
        if settings.color_by == ColorBy::Heat {
            bar(ui, settings.colormap, ["0", "1"].map(String::from));
            slider(ui, "Threshold", &mut settings.threshold)
                .on_hover_text("Outline pixels with at least this relevancy; 0 = off");
        }
        slider(ui, "Opacity", &mut settings.opacity);
    });
}

/// Draws a slider from 0 to 1 right of its label.
fn slider(ui: &mut Ui, label: &str, value: &mut f32) -> Response {
    let row = ui.horizontal(|ui| {
        // Sliders stand below each other.
        let room = vec2(LABEL_PT, ui.available_height());
        let label = ui.allocate_ui_with_layout(room, Layout::left_to_right(Align::Center), |ui| {
            ui.set_min_width(LABEL_PT);
            ui.label(RichText::new(label).small())
        });
        let id = label.inner.id;
        ui.add(Slider::new(value, 0.0..=1.0).fixed_decimals(2)).labelled_by(id)
    });
    row.inner
}

/// Draws the share of unlabeled pixels, with a button to segment a photo.
fn show_unknown(ui: &mut Ui, share: Option<f64>, photo: Option<&str>, cx: &mut Ctx<'_>) {
    ui.horizontal(|ui| {
        let (rect, _) = ui.allocate_exact_size(vec2(18.0, 11.0), Sense::hover());
        hatch(ui, rect, HATCH, false);
        let text = match share {
            None => "Unknown".to_owned(),
            Some(share) => format!("{} of this view is unknown", format::percent(share)),
        };
        let why = "No mask or photo decides which object it belongs to. Pixels without a color belong to none.";
        ui.label(RichText::new(text).small()).on_hover_text(why);
    });
    let mark = share.filter(|s| *s > 0.0).map(|_| ("Mark it\u{2026}", Action::SegmentNew(Some(NO_IDENTITY))));
    let segment = photo.map(|text| (text, Action::SegmentPhoto));
    if mark.is_some() || segment.is_some() {
        ui.horizontal(|ui| {
            for (text, action) in mark.into_iter().chain(segment) {
                if ui.small_button(text).on_hover_text(action.tooltip()).clicked() {
                    cx.ask(action);
                }
            }
        });
    }
}

/// Draws the share of pixels that a removal has filled.
fn show_invented(ui: &mut Ui, share: f64) {
    ui.horizontal(|ui| {
        let (rect, _) = ui.allocate_exact_size(vec2(18.0, 11.0), Sense::hover());
        hatch(ui, rect, [INVENTED, [110; 3]], true);
        let text = format!("{} of this view is invented", format::percent(share));
        let why = "Something was removed here that no photo shows the back of: painted from what is around.";
        ui.label(RichText::new(text).small()).on_hover_text(why);
    });
}

/// Draws stripes as over the view; `falling` to the right or rising.
fn hatch(ui: &Ui, rect: Rect, colors: [[u8; 3]; 2], falling: bool) {
    let [light, dark] = colors.map(|[r, g, b]| Color32::from_rgb(r, g, b));
    let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
    painter.rect_filled(rect, 0.0, dark);
    let mut x = rect.left() - rect.height();
    let [low, high] = if falling { [rect.top(), rect.bottom()] } else { [rect.bottom(), rect.top()] };
    while x < rect.right() {
        let ends = [egui::pos2(x, low), egui::pos2(x + rect.height(), high)];
        painter.line_segment(ends, Stroke::new(2.5, light));
        x += 7.0;
    }
}

/// Draws a color map between the labels of its ends.
pub(super) fn bar(ui: &mut Ui, map: Colormap, ends: [String; 2]) {
    let (all, _) = ui.allocate_exact_size(vec2(220.0, 12.0), Sense::hover());
    let [from, to] = ends.map(|text| ui.painter().layout_no_wrap(text, FontId::proportional(11.5), theme::weak()));
    let (left, right) = (all.left() + from.size().x + 6.0, all.right() - to.size().x - 6.0);
    ui.painter().galley(all.left_top() + vec2(0.0, -1.0), from, theme::weak());
    ui.painter().galley(egui::pos2(right + 6.0, all.top() - 1.0), to, theme::weak());
    let rect = Rect::from_x_y_ranges(left..=right, all.y_range());
    let mut mesh = Mesh::default();
    for step in 0..STEPS {
        let at = |k: usize| rect.left() + rect.width() * k as f32 / STEPS as f32;
        let [r, g, b] = map.color((step as f32 + 0.5) / STEPS as f32);
        let cell = Rect::from_x_y_ranges(at(step)..=at(step + 1), rect.y_range());
        mesh.add_colored_rect(cell, Color32::from_rgb(r, g, b));
    }
    ui.painter().add(mesh);
}
