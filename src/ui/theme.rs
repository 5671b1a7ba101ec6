//! Colors, sizes and fonts of the window: dark and quiet, with one accent.

use egui::{Color32, CornerRadius, FontId, Margin, RichText, Stroke, Style, TextStyle, Theme, Visuals, vec2};

use super::state::Tone;

/// The one color that asks for attention.
pub(crate) const ACCENT: Color32 = Color32::from_rgb(0x6c, 0xb2, 0xf0);
/// Text on the accent.
pub(crate) const ON_ACCENT: Color32 = Color32::from_rgb(0x0c, 0x14, 0x1c);
pub(crate) const PANEL: Color32 = Color32::from_rgb(0x18, 0x1a, 0x1f);
pub(crate) const CANVAS: Color32 = Color32::from_rgb(0x0e, 0x0f, 0x12);
/// Cards and fields on a pane.
pub(crate) const SURFACE: Color32 = Color32::from_rgb(0x22, 0x25, 0x2b);
pub(crate) const LINE: Color32 = Color32::from_rgb(0x2e, 0x32, 0x3a);
pub(crate) const TEXT: Color32 = Color32::from_rgb(0xd9, 0xdc, 0xe2);
/// Text of less weight; still 5.5 : 1 on a pane.
pub(crate) const WEAK: Color32 = Color32::from_rgb(0x93, 0x99, 0xa5);
pub(crate) const GOOD: Color32 = Color32::from_rgb(0x7f, 0xc7, 0x9a);
/// Left out or changed; also held-out photos.
pub(crate) const WARNING: Color32 = Color32::from_rgb(0xe3, 0xb3, 0x5f);
pub(crate) const ERROR: Color32 = Color32::from_rgb(0xee, 0x82, 0x79);

/// The color of a message.
pub(crate) fn tone_color(tone: Tone) -> Color32 {
    match tone {
        Tone::Info => TEXT,
        Tone::Good => GOOD,
        Tone::Warning => WARNING,
        Tone::Error => ERROR,
    }
}

/// Puts the theme on the window.
pub(crate) fn install(ctx: &egui::Context) {
    ctx.set_theme(Theme::Dark);
    super::fonts::install(ctx);
    ctx.style_mut_of(Theme::Dark, |style| {
        style.visuals = visuals();
        spacing(style);
        style.animation_time = 0.1;
        style.text_styles = [
            (TextStyle::Heading, FontId::proportional(19.0)),
            (TextStyle::Body, FontId::proportional(13.5)),
            (TextStyle::Button, FontId::proportional(13.5)),
            (TextStyle::Small, FontId::proportional(11.5)),
            (TextStyle::Monospace, FontId::monospace(12.5)),
        ]
        .into();
    });
}

fn spacing(style: &mut Style) {
    let s = &mut style.spacing;
    s.item_spacing = vec2(8.0, 7.0);
    s.button_padding = vec2(10.0, 4.0);
    s.interact_size.y = 26.0;
    s.menu_margin = Margin::same(6);
    s.window_margin = Margin::same(16);
    s.slider_width = 130.0;
    s.scroll.floating = true;
}

fn visuals() -> Visuals {
    let mut v = Visuals::dark();
    // A blinking one has the whole window drawn twice a second, for as long as a box has the keyboard.
    v.text_cursor.blink = false;
    v.panel_fill = PANEL;
    v.window_fill = PANEL;
    v.extreme_bg_color = CANVAS;
    v.text_edit_bg_color = Some(CANVAS);
    v.faint_bg_color = SURFACE;
    v.code_bg_color = SURFACE;
    v.window_stroke = Stroke::new(1.0, LINE);
    v.window_corner_radius = CornerRadius::same(10);
    v.menu_corner_radius = CornerRadius::same(8);
    v.weak_text_color = Some(WEAK);
    v.hyperlink_color = ACCENT;
    v.warn_fg_color = WARNING;
    v.error_fg_color = ERROR;
    v.selection.bg_fill = ACCENT.gamma_multiply(0.28);
    v.selection.stroke = Stroke::new(1.0, ACCENT);
    v.slider_trailing_fill = true;
    v.striped = false;
    let w = &mut v.widgets;
    w.noninteractive.bg_stroke = Stroke::new(1.0, LINE);
    w.noninteractive.fg_stroke = Stroke::new(1.0, TEXT);
    let states = [
        (&mut w.inactive, SURFACE, Color32::TRANSPARENT, TEXT),
        (&mut w.hovered, Color32::from_rgb(0x2c, 0x30, 0x38), Color32::from_rgb(0x45, 0x4b, 0x57), Color32::WHITE),
        (&mut w.active, Color32::from_rgb(0x36, 0x3b, 0x45), ACCENT, Color32::WHITE),
        (&mut w.open, Color32::from_rgb(0x2c, 0x30, 0x38), LINE, Color32::WHITE),
    ];
    for (state, fill, border, text) in states {
        state.bg_fill = fill;
        state.weak_bg_fill = fill;
        state.bg_stroke = Stroke::new(1.0, border);
        state.fg_stroke = Stroke::new(1.2, text);
        state.corner_radius = CornerRadius::same(6);
        state.expansion = 0.0;
    }
    w.noninteractive.corner_radius = CornerRadius::same(6);
    v
}

/// The frame of a dialog.
pub(crate) fn dialog() -> egui::Frame {
    egui::Frame::new().fill(PANEL).stroke(Stroke::new(1.0, LINE)).corner_radius(10).inner_margin(18)
}

/// The one button of a group that a user most likely wants.
pub(crate) fn primary_button(text: &str) -> egui::Button<'static> {
    egui::Button::new(RichText::new(text.to_owned()).color(ON_ACCENT).strong()).fill(ACCENT).stroke(Stroke::NONE)
}

/// A small title over a group of things.
pub(crate) fn section(ui: &mut egui::Ui, title: &str) {
    ui.add_space(6.0);
    ui.label(RichText::new(title).small().strong().color(WEAK));
}

/// A round mark in the color of a message.
pub(crate) fn mark(ui: &mut egui::Ui, tone: Tone, size: f32) {
    let (rect, _) = ui.allocate_exact_size(egui::Vec2::splat(size), egui::Sense::hover());
    let (color, c, r) = (tone_color(tone), rect.center(), 0.5 * size);
    ui.painter().circle_filled(c, r, color.gamma_multiply(0.22));
    let stroke = Stroke::new(0.1 * size, color);
    let line = |a: [f32; 2], b: [f32; 2]| {
        ui.painter().line_segment([c + r * egui::Vec2::from(a), c + r * egui::Vec2::from(b)], stroke);
    };
    match tone {
        Tone::Good => {
            line([-0.45, 0.05], [-0.1, 0.4]);
            line([-0.1, 0.4], [0.5, -0.4]);
        }
        Tone::Info => {
            line([0.0, -0.1], [0.0, 0.55]);
            line([0.0, -0.55], [0.0, -0.35]);
        }
        Tone::Warning | Tone::Error => {
            line([0.0, -0.55], [0.0, 0.15]);
            line([0.0, 0.4], [0.0, 0.58]);
        }
    }
}

/// A translucent card, for what lies over the viewport.
pub(crate) fn overlay() -> egui::Frame {
    egui::Frame::new()
        .fill(Color32::from_rgba_unmultiplied(0x14, 0x16, 0x1a, 225))
        .stroke(Stroke::new(1.0, LINE))
        .corner_radius(8)
        .inner_margin(Margin::symmetric(8, 5))
}
