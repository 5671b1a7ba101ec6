//! Cards over the frame: the choice of modes, the photo's name, and facts about the frame.

use egui::{Align2, Area, ComboBox, Id, Order, Rect, RichText, Ui, Vec2, vec2};
use strum::VariantArray;

use super::compared::AnswerFigures;
use super::display::Display;
use super::legend;
use super::overrides::RenderOverrides;
use super::photo::PhotoView;
use super::photo_bar::{self, psnr_text};
use super::query::Queries;
use super::split::ViewArea;
use super::visible::Visibility;
use crate::jobs::remove::{Paint, RemovalOptions, RemoveRequest};
use crate::math::format;
use crate::models::lama::LAMA;
use crate::scene::text;
use crate::ui::actions::Action;
use crate::ui::color_by::ColorBy;
use crate::ui::comparison::ComparedScene;
use crate::ui::ctx::Ctx;
use crate::ui::{keys, theme};
use crate::worker::ViewMode;
use crate::worker::view::ViewPicture;

/// Width below which a view has menus in place of buttons, points.
const NARROW: f32 = 480.0;

/// Width below which the menus are narrow, too, points.
const NARROWEST: f32 = 300.0;

/// Width below which the legend stands above the facts, points.
const NARROW_BESIDE_FACTS: f32 = 760.0;

/// Height below which a view has few cards, points.
const LOW: f32 = 330.0;

/// Draws a card over a view, moved down by `down` points.
pub(super) fn card(
    ui: &Ui,
    rect: Rect,
    name: impl std::hash::Hash + std::fmt::Debug,
    align: Align2,
    down: f32,
    add: impl FnOnce(&mut Ui),
) {
    let at = align.pos_in_rect(&rect.shrink(12.0)) + vec2(0.0, down);
    let area = Area::new(Id::unique(name)).order(Order::Middle).pivot(align).fixed_pos(at).constrain_to(rect);
    theme::card(ui.ctx(), area, |ui| ui.horizontal(|ui| add(ui)));
}

/// Width of a view in which the name of another scene stands beside the modes, points.
const NARROW_BESIDE_MODES: f32 = 640.0;
/// Space of a letter of that name, points.
const LETTER_PT: f32 = 7.8;

/// Content of the cards over a view.
pub(super) struct ViewCards<'a> {
    pub(super) display: &'a Display,
    /// The photo whose camera the view looks through.
    pub(super) photo: Option<&'a PhotoView>,
    /// Number of Gaussians, hidden ones included.
    pub(super) gaussians: usize,
    pub(super) visibility: &'a Visibility,
    pub(super) overrides: &'a RenderOverrides,
    /// Words for the view, if it is orthographic.
    pub(super) orthographic: Option<String>,
    pub(super) queries: &'a mut Queries,
    /// True if the camera moves.
    pub(super) moves: bool,
}

impl ViewCards<'_> {
    /// Draws the cards over the active view.
    pub(super) fn show(&mut self, ui: &Ui, area: ViewArea, figures: Option<AnswerFigures<'_>>, cx: &mut Ctx<'_>) {
        let (state, ViewArea { rect, second, index, is_other, .. }) = (cx.state, area);
        if index > 1 {
            // The modes stand in the second view, for all beside the first.
            return self.beside(ui, area, figures, cx);
        }
        let dataset = state.scene.as_ref().and_then(|scene| scene.dataset.as_ref());
        let photos = state.photo_count();
        let (modes, legend) = if second { ("second modes", "second legend") } else { ("modes", "legend") };
        let menus = cx.layout.split_view || rect.width() < NARROW;
        let menus = menus.then_some(if rect.width() < NARROWEST { [52.0, 62.0] } else { [76.0, 86.0] });
        card(ui, rect, modes, Align2::LEFT_TOP, 0.0, |ui| {
            // One card asks all scenes that are compared.
            self.modes(ui, menus, is_other || figures.is_some(), photos > 0, cx);
        });
        let other_depth = |p: &ViewPicture| p.second().filter(|_| second).map(|other| other.depth_range);
        let depth = self.display.picture().and_then(|p| other_depth(p).unwrap_or(p.depth_range));
        if legend::is_needed(self.queries.settings(), depth) && rect.height() > LOW && !is_other {
            let shares = self.queries.maps().map(|m| [m.unknown_share(), m.invented_share()]);
            let can_segment = dataset.is_some() && state.is_trained();
            let is_own = self.photo.is_some_and(|photo| !photo.is_located());
            let segment = if is_own { "Add from this photo" } else { "Add from the nearest photo" };
            // Above the facts if there is no room beside them.
            let up = if rect.width() < NARROW_BESIDE_FACTS { -46.0 } else { 0.0 };
            card(ui, rect, legend, Align2::RIGHT_BOTTOM, up, |ui| {
                let is_orthographic = self.orthographic.is_some();
                legend::show(
                    ui,
                    self.queries.settings(),
                    depth,
                    is_orthographic,
                    shares,
                    can_segment.then_some(segment),
                    cx,
                );
            });
        }
        if second {
            return self.beside(ui, area, figures, cx);
        }
        if let Some(figures) = figures {
            card(ui, rect, "figures", Align2::RIGHT_BOTTOM, 0.0, |ui| figures.show(ui));
        }
        // In a low view the row is shown only with the name of the photo that the view looks through.
        if photos > 0 && (self.photo.is_some() || rect.height() > LOW) {
            // Beside the modes if there is room and no query box, else below them.
            let has_room = rect.width() > 860.0 && state.semantics.is_none();
            let (align, down) = if has_room { (Align2::RIGHT_TOP, 0.0) } else { (Align2::LEFT_TOP, 46.0) };
            let psnr = self.display.picture().and_then(|p| p.psnr);
            card(ui, rect, "photo", align, down, |ui| photo_bar::show(ui, self.photo, psnr, cx));
        }
        let now = ui.input(|i| i.time);
        let rate = self.display.rate(now).filter(|_| self.moves).map(rate_text);
        let size_px = rect.size() * ui.pixels_per_point();
        let facts = if rect.height() > LOW { self.facts(size_px, rate, cx) } else { rate };
        // Overrides of the scene's render settings must be visible in the smallest view.
        let words = self.overrides.words();
        let is_cropped = self.visibility.crop().is_some();
        if facts.is_some() || words.is_some() || is_cropped || self.orthographic.is_some() {
            card(ui, rect, "facts", Align2::LEFT_BOTTOM, 0.0, |ui| {
                if let Some(straight) = &self.orthographic {
                    ui.label(RichText::new(straight).small().color(theme::accent()));
                    let tip = keys::label(ui.ctx(), &Action::Orthographic);
                    if ui.small_button("Perspective").on_hover_text(tip).clicked() {
                        cx.ask(Action::Orthographic);
                    }
                }
                if let Some(facts) = &facts {
                    ui.label(RichText::new(facts).small().color(theme::weak()));
                }
                if is_cropped {
                    ui.label(RichText::new("cropped").small().color(theme::warning()));
                    let all = Action::SetCrop(None);
                    let show = ui.small_button("Show all").on_hover_text("Remove the crop box.");
                    if show.accessible_name(all.text()).clicked() {
                        cx.ask(all);
                    }
                }
                if let Some(words) = words {
                    ui.label(RichText::new(format!("rendered with {words}")).small().color(theme::warning()));
                    let reset = ui.small_button("Reset").on_hover_text(Action::ResetRenderSettings.tooltip());
                    if reset.accessible_name(Action::ResetRenderSettings.text()).clicked() {
                        cx.ask(Action::ResetRenderSettings);
                    }
                }
            });
        }
        // A small view is for the frame.
        if let Some(times) = self.display.times().filter(|_| rect.height() > LOW) {
            card(ui, rect, "times", Align2::LEFT_BOTTOM, -46.0, |ui| times.show(ui));
        }
        if self.display.errors().next().is_some() {
            card(ui, rect, "view error", Align2::CENTER_CENTER, 0.0, |ui| {
                for error in self.display.errors() {
                    ui.colored_label(theme::error(), error);
                }
            });
        }
    }

    /// Draws the cards of another scene: its name, and what it answers.
    fn beside(&self, ui: &Ui, area: ViewArea, figures: Option<AnswerFigures<'_>>, cx: &mut Ctx<'_>) {
        let Some((k, other)) = area.index.checked_sub(1).and_then(|k| Some((k, cx.state.beside.get(k)?))) else {
            return;
        };
        let rect = area.rect;
        // Beside the modes if there is room, else below them.
        let is_wide = rect.width() > NARROW_BESIDE_MODES;
        let (align, down) = match (k, is_wide) {
            (0, true) => (Align2::RIGHT_TOP, 0.0),
            (0, false) => (Align2::LEFT_TOP, 46.0),
            _ => (Align2::LEFT_TOP, 0.0),
        };
        card(ui, rect, ("beside", k), align, down, |ui| {
            self.name_of_other(ui, k, other, rect.width(), cx);
        });
        if let Some(figures) = figures {
            card(ui, rect, ("figures beside", k), Align2::RIGHT_BOTTOM, 0.0, |ui| figures.show(ui));
        }
    }

    /// Draws the name of another scene, and its quality, in a view of this width.
    fn name_of_other(&self, ui: &mut Ui, k: usize, comparison: &ComparedScene, view_pt: f32, cx: &mut Ctx<'_>) {
        let state = cx.state;
        let removed = state.removed.as_ref().filter(|r| r.folder == comparison.path);
        let name = removed.map_or_else(|| comparison.name.clone(), |r| format!("without {}", r.name));
        let place = format!("{name}\n{}", comparison.path.display());
        let psnr = self.display.picture().and_then(|p| p.beside.get(k)?.psnr).filter(|_| view_pt > NARROW_BESIDE_MODES);
        // The name gets what the buttons leave.
        let is_wide = view_pt > NARROW_BESIDE_MODES;
        let buttons_pt = match (&removed, is_wide) {
            (None, _) => 70.0,
            (Some(_), false) => 240.0,
            (Some(_), true) => 480.0,
        };
        let room_pt = view_pt - buttons_pt - if psnr.is_some() { 160.0 } else { 0.0 };
        let most = (room_pt / LETTER_PT).clamp(6.0, 40.0) as usize;
        ui.label(RichText::new(text::elided(&name, most)).strong()).on_hover_text(text::lines(&place));
        if let Some(removed) = removed {
            let open = ui.button("Open").on_hover_text("Go on with this scene. The other one stays where it is.");
            if open.clicked() {
                cx.ask(Action::Open(removed.folder.clone()));
            }
            other_fills(ui, &removed.request, is_wide, cx);
        }
        if let Some(psnr) = psnr {
            ui.colored_label(theme::accent(), psnr_text(psnr));
        }
        let close = Action::CloseComparison(Some(comparison.path.clone()));
        let button = ui.button("\u{d7}").on_hover_text(close.text());
        if button.accessible_name(close.text()).clicked() {
            cx.ask(close);
        }
    }

    /// Draws the choice of the mode; as menus of these widths if the view is narrow or one of two.
    fn modes(&mut self, ui: &mut Ui, menus: Option<[f32; 2]>, is_other: bool, has_photos: bool, cx: &mut Ctx<'_>) {
        ui.spacing_mut().item_spacing.x = 2.0;
        let shown = *cx.layout.mode_of(self.queries.is_second());
        let mut buttons = |ui: &mut Ui| {
            for &mode in ViewMode::VARIANTS.iter().filter(|mode| has_photos || !mode.needs_photo()) {
                let action = Action::Show(mode);
                let tip = format!("{}  {}", action.tooltip(), keys::label(ui.ctx(), &action));
                if ui.selectable_label(shown == mode, mode.text()).on_hover_text(tip).clicked() {
                    cx.ask(action);
                }
            }
        };
        if let Some([mode_pt, tint_pt]) = menus {
            let mode = ComboBox::from_id_salt("mode").selected_text(shown.text()).width(mode_pt).truncate();
            let mode = mode.show_ui(ui, buttons);
            mode.response.on_hover_text(format!("What the view shows: {}", shown.text())).accessible_name("Mode");
            if is_other {
                return;
            }
            let colored_by = self.queries.settings().color_by;
            let tints = ComboBox::from_id_salt("color by").selected_text(colored_by.text()).width(tint_pt).truncate();
            let tints = tints.show_ui(ui, |ui| {
                for &by in ColorBy::VARIANTS {
                    if ui.selectable_label(colored_by == by, by.text()).clicked() && colored_by != by {
                        self.queries.tint(by);
                    }
                }
            });
            tints.response.on_hover_text(format!("Overlay: {}", colored_by.text())).accessible_name("Color by");
        } else {
            buttons(ui);
        }
        if has_photos {
            ui.separator();
            let tip = format!("{}  {}", Action::ToggleCameras.tooltip(), keys::label(ui.ctx(), &Action::ToggleCameras));
            if ui.selectable_label(cx.layout.cameras, "Cameras").on_hover_text(tip).clicked() {
                cx.ask(Action::ToggleCameras);
            }
        }
    }

    /// One line of facts about the frame.
    fn facts(&self, view_px: Vec2, rate: Option<String>, cx: &Ctx<'_>) -> Option<String> {
        let (p, state, layout) = (self.display.picture()?, cx.state, &*cx.layout);
        let drawn_px = vec2(p.camera.width_px as f32, p.camera.height_px as f32);
        let enlarged = (view_px / drawn_px).min_elem();
        let has_result = state.training_job.is_some() || state.scene.as_ref().is_some_and(|s| s.trained);
        let mut parts = vec![
            format!("{} \u{d7} {} px", p.camera.width_px, p.camera.height_px)
                + if p.full && enlarged > 1.05 { ", enlarged" } else { "" },
            format::millis(p.secs),
            match (self.visibility.count(), self.gaussians as u64) {
                (None, all) if !has_result => format!("{} sparse points, not trained yet", format::count(all)),
                (Some(drawn), all) => format!("{} of {} Gaussians", format::count(drawn as u64), format::count(all)),
                (None, all) => format!("{} Gaussians", format::count(all)),
            },
        ];
        let modes = [Some(layout.mode), layout.split_view.then_some(layout.second_mode)];
        match self.photo {
            None if modes.iter().flatten().any(|mode| mode.needs_photo()) => {
                parts.push("choose a photo ( [ or ] )".into())
            }
            Some(_) if modes.contains(&Some(ViewMode::Difference)) => parts.push("difference \u{d7} 4".into()),
            _ => {}
        }
        parts.extend(rate);
        Some(parts.join("  ·  "))
    }
}

/// Draws buttons for further removals, in one menu unless there is room; each makes another scene.
fn other_fills(ui: &mut Ui, last: &RemoveRequest, is_wide: bool, cx: &mut Ctx<'_>) {
    let state = cx.state;
    let options = RemovalOptions { seed: last.options.seed + 1, ..last.options.clone() };
    let mut next = RemoveRequest { options, retrain: false, ..last.clone() };
    let again = Action::AnotherFill(Box::new(next.clone()));
    if is_wide && ui.button(again.text()).on_hover_text(again.tooltip()).clicked() {
        cx.ask(again.clone());
    }
    let changed = ui.menu_button("Options", |ui| {
        if !is_wide && ui.button(again.text()).on_hover_text(again.tooltip()).clicked() {
            cx.ask(again);
            ui.close();
        }
        let options = &mut next.options;
        let mut changed = ui
            .checkbox(&mut options.halo, "With its fringes")
            .on_hover_text("Unsure Gaussians within it are removed, too.")
            .changed();
        let tip = "The shadow that it casts on flat surfaces is lifted, as far as what blocks the light explains it.";
        changed |= ui.checkbox(&mut options.lift_shadow, "With its shadow").on_hover_text(tip).changed();
        if state.models.as_ref().and_then(|m| m.get(LAMA)).is_some_and(|(_, s)| s.is_usable()) {
            let mut by_network = options.paint == Some(Paint::Lama);
            let tip = "The network paints the surfaces that it hid.";
            if ui.checkbox(&mut by_network, "Painted by LaMa").on_hover_text(tip).changed() {
                options.paint = Some(if by_network { Paint::Lama } else { Paint::default() });
                changed = true;
            }
        }
        ui.separator();
        let tip = "Trains the scene anew on its photos, in which it is replaced by what is behind it. Takes as long as \
                       the scene's training took.";
        if ui.button("Train anew without it").on_hover_text(tip).clicked() {
            // With the options of the removal on screen.
            next = RemoveRequest { retrain: true, ..last.clone() };
            changed = true;
        }
        // A retrained scene also holds photos, which are not deleted.
        let delete = Action::DeleteRemoved;
        if !last.retrain && ui.button("Delete this copy\u{2026}").on_hover_text(delete.tooltip()).clicked() {
            cx.ask(delete);
            ui.close();
        }
        if changed {
            ui.close();
        }
        changed
    });
    if changed.inner == Some(true) {
        cx.ask(Action::AnotherFill(Box::new(next)));
    }
}

fn rate_text(fps: f64) -> String {
    if fps < 10.0 { format!("{fps:.1} fps") } else { format!("{fps:.0} fps") }
}
