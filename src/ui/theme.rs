//! Colors, sizes and fonts of the window: quiet, dark or light, with one accent.

use std::cell::Cell;

use egui::theme::{DefaultStyle, StyleProvider};
use egui::widget_style::{CheckboxStyle, StyleArgs};
use egui::{
    Area, Color32, CornerRadius, FontId, Id, InnerResponse, Margin, Modal, Order, RichText, Stroke, Style, TextStyle,
    Theme, Ui, Visuals, vec2,
};

use super::state::Tone;

/// Room beside content that scrolls, points.
const GUTTER_PT: f32 = 10.0;
/// Height of a chip, points.
const CHIP_PT: f32 = 19.0;

/// The colors of a theme.
#[derive(Clone, Copy)]
struct Colors {
    /// Accent color, and text on it.
    accent: Color32,
    on_accent: Color32,
    panel: Color32,
    canvas: Color32,
    /// Cards and fields on a pane: normal, hovered, pressed.
    surface: Color32,
    hovered: Color32,
    pressed: Color32,
    line: Color32,
    /// Outline of check boxes; contrast of at least 3 : 1 on a pane.
    outline: Color32,
    text: Color32,
    /// Emphasized text.
    strong: Color32,
    /// Secondary text; contrast of at least 5 : 1 on a pane.
    weak: Color32,
    good: Color32,
    /// Warnings; also held-out photos.
    warning: Color32,
    error: Color32,
    /// Cards over the view.
    overlay: Color32,
}

const DARK: Colors = Colors {
    accent: Color32::from_rgb(0x6c, 0xb2, 0xf0),
    on_accent: Color32::from_rgb(0x0c, 0x14, 0x1c),
    panel: Color32::from_rgb(0x18, 0x1a, 0x1f),
    canvas: Color32::from_rgb(0x0e, 0x0f, 0x12),
    surface: Color32::from_rgb(0x22, 0x25, 0x2b),
    hovered: Color32::from_rgb(0x2c, 0x30, 0x38),
    pressed: Color32::from_rgb(0x36, 0x3b, 0x45),
    line: Color32::from_rgb(0x2e, 0x32, 0x3a),
    outline: Color32::from_rgb(0x70, 0x76, 0x82),
    text: Color32::from_rgb(0xd9, 0xdc, 0xe2),
    strong: Color32::WHITE,
    weak: Color32::from_rgb(0x93, 0x99, 0xa5),
    good: Color32::from_rgb(0x7f, 0xc7, 0x9a),
    warning: Color32::from_rgb(0xe3, 0xb3, 0x5f),
    error: Color32::from_rgb(0xee, 0x82, 0x79),
    overlay: Color32::from_rgba_unmultiplied_const(0x14, 0x16, 0x1a, 225),
};

const LIGHT: Colors = Colors {
    accent: Color32::from_rgb(0x1a, 0x66, 0xb8),
    on_accent: Color32::WHITE,
    panel: Color32::from_rgb(0xf5, 0xf6, 0xf8),
    canvas: Color32::WHITE,
    surface: Color32::from_rgb(0xe6, 0xe9, 0xee),
    hovered: Color32::from_rgb(0xd9, 0xde, 0xe6),
    pressed: Color32::from_rgb(0xc9, 0xd1, 0xdd),
    line: Color32::from_rgb(0xcd, 0xd2, 0xda),
    outline: Color32::from_rgb(0x7c, 0x84, 0x92),
    text: Color32::from_rgb(0x24, 0x28, 0x30),
    strong: Color32::BLACK,
    weak: Color32::from_rgb(0x5a, 0x62, 0x70),
    good: Color32::from_rgb(0x1e, 0x73, 0x43),
    warning: Color32::from_rgb(0x8a, 0x59, 0x00),
    error: Color32::from_rgb(0xb4, 0x2b, 0x22),
    overlay: Color32::from_rgba_unmultiplied_const(0xfa, 0xfa, 0xfc, 235),
};

thread_local! {
    // Each window draws on one thread; overlays of a view keep the dark theme within a light window.
    static COLORS: Cell<&'static Colors> = const { Cell::new(&DARK) };
    // The theme of the window.
    static THEME: Cell<Theme> = const { Cell::new(Theme::Dark) };
}

macro_rules! colors {
    ($($name:ident),*) => {
        $(pub(crate) fn $name() -> Color32 {
            COLORS.get().$name
        })*
    };
}

colors!(accent, on_accent, panel, canvas, surface, line, text, weak, good, warning, error);

/// Sets the colors of the window's theme, at the start of a frame.
pub(crate) fn begin_frame(ctx: &egui::Context) {
    THEME.set(ctx.theme());
    COLORS.set(colors_of(ctx.theme()));
}

/// Draws in the dark theme in any window: colors of images are judged on a dark background.
pub(crate) fn dark<T>(ui: &mut Ui, add: impl FnOnce(&mut Ui) -> T) -> T {
    let ctx = ui.ctx().clone();
    ui.set_style(ctx.style_of(Theme::Dark));
    within(&ctx, Theme::Dark, || add(ui))
}

fn within<T>(ctx: &egui::Context, theme: Theme, add: impl FnOnce() -> T) -> T {
    let (colors, preference) = (COLORS.replace(colors_of(theme)), ctx.options(|o| o.theme_preference));
    ctx.set_theme(theme);
    let shown = add();
    ctx.set_theme(preference);
    COLORS.set(colors);
    shown
}

fn colors_of(theme: Theme) -> &'static Colors {
    match theme {
        Theme::Dark => &DARK,
        Theme::Light => &LIGHT,
    }
}

/// The color of a message.
pub(crate) fn tone_color(tone: Tone) -> Color32 {
    match tone {
        Tone::Info => text(),
        Tone::Good => good(),
        Tone::Warning => warning(),
        Tone::Error => error(),
    }
}

/// Installs the theme.
pub(crate) fn install(ctx: &egui::Context) {
    super::fonts::install(ctx);
    for theme in [Theme::Dark, Theme::Light] {
        ctx.style_mut_of(theme, |style| style_in(style, theme));
    }
    ctx.replace_widget_theme::<CheckboxStyle>(OutlinedBox);
}

/// Check boxes with an outline: without their mark they would be invisible.
struct OutlinedBox;

impl StyleProvider<CheckboxStyle> for OutlinedBox {
    fn style(&mut self, args: &StyleArgs<'_>) -> CheckboxStyle {
        let mut style: CheckboxStyle = DefaultStyle.style(args);
        style.checkbox_frame.stroke = Stroke::new(1.0, outline(args.style));
        style
    }
}

/// The outline of check boxes and radio buttons in the theme of a style.
fn outline(style: &Style) -> Color32 {
    colors_of(Theme::from_dark_mode(style.visuals.dark_mode)).outline
}

/// Draws radio buttons with an outline like that of check boxes.
pub(crate) fn outlined<T>(ui: &mut Ui, add: impl FnOnce(&mut Ui) -> T) -> T {
    ui.scope(|ui| {
        let stroke = Stroke::new(1.0, outline(ui.style()));
        ui.visuals_mut().widgets.inactive.bg_stroke = stroke;
        add(ui)
    })
    .inner
}

fn style_in(style: &mut Style, theme: Theme) {
    style.visuals = visuals(theme);
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
    // A scroll bar has room of its own: it covers neither digits nor text.
    s.scroll.floating_allocated_width = GUTTER_PT;
}

fn visuals(theme: Theme) -> Visuals {
    let c = colors_of(theme);
    let mut v = theme.default_visuals();
    // A blinking cursor would redraw the whole window twice a second while a field has the focus.
    v.text_cursor.blink = false;
    v.panel_fill = c.panel;
    v.window_fill = c.panel;
    v.extreme_bg_color = c.canvas;
    v.text_edit_bg_color = Some(c.canvas);
    v.faint_bg_color = c.surface;
    v.code_bg_color = c.surface;
    v.window_stroke = Stroke::new(1.0, c.line);
    v.window_corner_radius = CornerRadius::same(10);
    v.menu_corner_radius = CornerRadius::same(8);
    v.weak_text_color = Some(c.weak);
    v.hyperlink_color = c.accent;
    v.warn_fg_color = c.warning;
    v.error_fg_color = c.error;
    v.selection.bg_fill = c.accent.gamma_multiply(0.28);
    v.selection.stroke = Stroke::new(1.0, c.accent);
    v.slider_trailing_fill = true;
    v.striped = false;
    let w = &mut v.widgets;
    w.noninteractive.bg_stroke = Stroke::new(1.0, c.line);
    w.noninteractive.fg_stroke = Stroke::new(1.0, c.text);
    let states = [
        (&mut w.inactive, c.surface, Color32::TRANSPARENT, c.text),
        (&mut w.hovered, c.hovered, c.pressed, c.strong),
        (&mut w.active, c.pressed, c.accent, c.strong),
        (&mut w.open, c.hovered, c.line, c.strong),
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

/// A dialog. It is above tooltips, too: those of the background stay until the pointer moves.
pub(crate) fn dialog(name: &'static str) -> Modal {
    let frame = egui::Frame::new().fill(panel()).stroke(Stroke::new(1.0, line())).corner_radius(10).inner_margin(18);
    Modal::new(Id::unique(name)).frame(frame).area(dialog_area(name))
}

/// Area of a dialog.
pub(crate) fn dialog_area(name: &'static str) -> Area {
    Modal::default_area(Id::unique(name)).order(Order::Tooltip)
}

/// The main button of a group.
pub(crate) fn primary_button(text: &str) -> egui::Button<'static> {
    egui::Button::new(RichText::new(text.to_owned()).color(on_accent()).strong()).fill(accent()).stroke(Stroke::NONE)
}

/// A button that deletes something for good.
pub(crate) fn delete_button(text: &str) -> egui::Button<'static> {
    egui::Button::new(RichText::new(text.to_owned()).color(panel()).strong()).fill(error()).stroke(Stroke::NONE)
}

/// A small title of a group.
pub(crate) fn section(ui: &mut Ui, title: &str) {
    ui.add_space(6.0);
    ui.label(RichText::new(title).small().strong().color(weak()));
}

/// Draws a label with chips beside it; those that do not fit go on below the first.
pub(crate) fn hanging<T>(ui: &mut Ui, label: RichText, chips: impl FnOnce(&mut Ui) -> T) -> T {
    ui.horizontal_top(|ui| {
        ui.spacing_mut().interact_size.y = CHIP_PT;
        ui.spacing_mut().item_spacing.y = 4.0;
        ui.horizontal(|ui| ui.label(label));
        ui.horizontal_wrapped(chips).inner
    })
    .inner
}

/// A round mark in the color of a message.
pub(crate) fn mark(ui: &mut Ui, tone: Tone, size: f32) {
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

/// Draws a menu of the view in the window's own theme.
pub(crate) fn in_window_theme<T>(ctx: &egui::Context, add: impl FnOnce() -> T) -> T {
    within(ctx, THEME.get(), add)
}

/// Draws a card over the view, and its menus, in the window's own theme.
pub(crate) fn card<T>(ctx: &egui::Context, area: Area, add: impl FnOnce(&mut Ui) -> T) -> InnerResponse<T> {
    in_window_theme(ctx, || area.show(ctx, |ui| overlay().show(ui, add).inner))
}

/// A card as [`card`], which in a small view lies over others: they do not shine through.
pub(crate) fn solid_card<T>(ctx: &egui::Context, area: Area, add: impl FnOnce(&mut Ui) -> T) -> InnerResponse<T> {
    let frame = || overlay().fill(COLORS.get().overlay.to_opaque());
    in_window_theme(ctx, || area.show(ctx, |ui| frame().show(ui, add).inner))
}

/// UV rectangle of the centered part of an image that fills a place.
pub(crate) fn filling(picture: egui::Vec2, place: egui::Vec2) -> egui::Rect {
    let scale = (place.x / picture.x.max(1.0)).max(place.y / picture.y.max(1.0));
    egui::Rect::from_center_size(egui::pos2(0.5, 0.5), place / (picture.max(egui::Vec2::splat(1.0)) * scale))
}

/// The translucent frame of a card.
pub(crate) fn overlay() -> egui::Frame {
    egui::Frame::new()
        .fill(COLORS.get().overlay)
        .stroke(Stroke::new(1.0, line()))
        .corner_radius(8)
        .inner_margin(Margin { left: 8, right: 8, top: 5, bottom: 7 })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Contrast by WCAG 2.1, 1 to 21.
    fn contrast(a: Color32, b: Color32) -> f32 {
        let luminance = |c: Color32| {
            let [r, g, b, _] = egui::Rgba::from(c).to_array();
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        let (a, b) = (luminance(a), luminance(b));
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    #[test]
    fn a_picture_fills_its_place_undistorted() {
        let uv = filling(vec2(400.0, 300.0), vec2(200.0, 100.0));
        assert!((uv.width() - 1.0).abs() < 1e-6 && (uv.height() - 2.0 / 3.0).abs() < 1e-6, "{uv:?}");
        let uv = filling(vec2(100.0, 300.0), vec2(200.0, 100.0));
        assert!((uv.width() - 1.0).abs() < 1e-6 && (uv.height() - 1.0 / 6.0).abs() < 1e-6, "{uv:?}");
        assert_eq!(uv.center(), egui::pos2(0.5, 0.5));
    }

    #[test]
    fn a_menu_of_the_dark_view_has_the_theme_of_the_window() {
        let (ctx, mut seen) = (egui::Context::default(), Vec::new());
        ctx.set_theme(Theme::Light);
        ctx.run_ui(egui::RawInput::default(), |ui| {
            begin_frame(ui.ctx());
            dark(ui, |ui| {
                let theme = || ui.ctx().theme();
                seen.extend([theme(), in_window_theme(ui.ctx(), theme), theme()]);
            });
        })
        .textures_delta
        .clear();
        assert_eq!(seen[..3], [Theme::Dark, Theme::Light, Theme::Dark]);
    }

    #[test]
    fn text_can_be_read_in_both_themes() {
        for c in [&DARK, &LIGHT] {
            for ground in [c.panel, c.canvas] {
                for text in [c.text, c.strong, c.weak, c.good, c.warning, c.error, c.accent] {
                    assert!(contrast(text, ground) >= 4.5, "{text:?} on {ground:?}: {}", contrast(text, ground));
                }
            }
            assert!(contrast(c.text, c.surface) >= 7.0 && contrast(c.on_accent, c.accent) >= 4.5);
            assert!(contrast(c.outline, c.panel) >= 3.0 && contrast(c.outline, c.surface) >= 2.5);
        }
        // Control: unreadable colors are detected.
        assert!(contrast(DARK.line, DARK.panel) < 2.0);
    }
}
