//! What lies over the frame: the choice of modes, the photo's name, and facts about the frame.

use egui::{Align2, Area, Id, Order, Rect, RichText, Ui};
use strum::VariantArray;

use super::super::layout::Layout;
use super::super::state::AppState;
use super::super::{keys, theme};
use super::{Viewport, legend};
use crate::jobs::OpenedScene;
use crate::math::format;
use crate::scene::text;
use crate::ui::actions::Action;
use crate::worker::ViewMode;

impl Viewport {
    pub(super) fn show_overlay(
        &mut self,
        ui: &Ui,
        rect: Rect,
        scene: &OpenedScene,
        state: &AppState,
        layout: &Layout,
        actions: &mut Vec<Action>,
    ) {
        let card = |name: &'static str, align: Align2, down: f32, add: &mut dyn FnMut(&mut Ui)| {
            let at = align.pos_in_rect(&rect.shrink(12.0)) + egui::vec2(0.0, down);
            Area::new(Id::unique(name)).order(Order::Middle).pivot(align).fixed_pos(at).constrain_to(rect).show(
                ui.ctx(),
                |ui| {
                    theme::overlay().show(ui, |ui| ui.horizontal(|ui| add(ui)));
                },
            );
        };
        let has_photos = scene.dataset.as_ref().is_some_and(|d| !d.photos.is_empty());
        card("modes", Align2::LEFT_TOP, 0.0, &mut |ui| self.modes(ui, layout, has_photos, actions));
        if has_photos {
            // Beside the modes where there is room and no query box, else below them.
            let beside = rect.width() > 860.0 && state.semantics.is_none();
            let (align, down) = if beside { (Align2::RIGHT_TOP, 0.0) } else { (Align2::LEFT_TOP, 46.0) };
            card("photo", align, down, &mut |ui| self.photo_bar(ui, scene, layout, actions));
        }
        if let Some(facts) = self.facts(layout, state) {
            card("facts", Align2::LEFT_BOTTOM, 0.0, &mut |ui| {
                ui.label(RichText::new(&facts).small().color(theme::weak()));
                if let Some(words) = self.overrides.words() {
                    ui.label(RichText::new(format!("rendered with {words}")).small().color(theme::warning()));
                    let reset = ui.small_button("Reset").on_hover_text(Action::ResetRenderSettings.tooltip());
                    if reset.accessible_name(Action::ResetRenderSettings.text()).clicked() {
                        actions.push(Action::ResetRenderSettings);
                    }
                }
            });
        }
        let depth = self.picture().and_then(|p| p.depth_range);
        if legend::is_needed(self.queries.settings(), depth) && rect.height() > 330.0 {
            card("legend", Align2::RIGHT_BOTTOM, 0.0, &mut |ui| legend::show(ui, self.queries.settings(), depth));
        }
        // A small view is for the frame.
        if let Some(times) = self.display.times().filter(|_| rect.height() > 330.0) {
            card("times", Align2::LEFT_BOTTOM, -46.0, &mut |ui| times.show(ui));
        }
        if self.display.errors().next().is_some() {
            card("view error", Align2::CENTER_CENTER, 0.0, &mut |ui| {
                for error in self.display.errors() {
                    ui.colored_label(theme::error(), error);
                }
            });
        }
    }

    fn modes(&self, ui: &mut Ui, layout: &Layout, has_photos: bool, actions: &mut Vec<Action>) {
        ui.spacing_mut().item_spacing.x = 2.0;
        for &mode in ViewMode::VARIANTS {
            if mode == ViewMode::Difference && !has_photos {
                continue;
            }
            let action = Action::Show(mode);
            let tip = format!("{}  {}", action.tooltip(), keys::label(ui.ctx(), &action));
            if ui.selectable_label(layout.mode == mode, mode.text()).on_hover_text(tip).clicked() {
                actions.push(action);
            }
        }
        if has_photos {
            ui.separator();
            let tip = format!("{}  {}", Action::ToggleCameras.tooltip(), keys::label(ui.ctx(), &Action::ToggleCameras));
            if ui.selectable_label(layout.cameras, "Cameras").on_hover_text(tip).clicked() {
                actions.push(Action::ToggleCameras);
            }
        }
    }

    fn photo_bar(&self, ui: &mut Ui, scene: &OpenedScene, layout: &Layout, actions: &mut Vec<Action>) {
        let total = scene.dataset.as_ref().map_or(0, |d| d.photos.len());
        let step = |ui: &mut Ui, symbol: &str, action: Action, actions: &mut Vec<Action>| {
            let tip = format!("{}  {}", action.text(), keys::label(ui.ctx(), &action));
            let button = ui.button(symbol).on_hover_text(tip).accessible_name(action.text());
            if button.clicked() {
                actions.push(action);
            }
        };
        step(ui, "‹", Action::PreviousPhoto, actions);
        match &self.photo {
            Some(p) => {
                ui.label(RichText::new(text::elided(&p.name(), 28)).strong()).on_hover_text(&*p.name());
                ui.weak(format!("{} of {total}", p.index() + 1));
                if let Some(psnr) = self.picture().and_then(|p| p.psnr) {
                    ui.label(RichText::new(format!("preview {}", format::decibel(psnr))).color(theme::accent()))
                        .on_hover_text(
                            "PSNR of the view at screen resolution. Evaluation uses the training resolution.",
                        );
                }
                if p.failed() {
                    ui.colored_label(theme::warning(), "photo not loaded");
                }
            }
            None => {
                ui.weak("Free view");
            }
        }
        step(ui, "›", Action::NextPhoto, actions);
        if self.photo.is_some() {
            ui.separator();
            let tip = format!("{}  {}", Action::ToggleCompare.tooltip(), keys::label(ui.ctx(), &Action::ToggleCompare));
            if ui.selectable_label(layout.compare, "Compare").on_hover_text(tip).clicked() {
                actions.push(Action::ToggleCompare);
            }
        }
    }

    /// One line about the frame.
    fn facts(&self, layout: &Layout, state: &AppState) -> Option<String> {
        let p = self.picture()?;
        let mut parts = vec![
            format!("{} \u{d7} {} px", p.camera.width_px, p.camera.height_px),
            format::millis(p.secs),
            format!("{} Gaussians", format::count(self.cloud.as_ref().map_or(0, |c| c.len()) as u64)),
        ];
        if let Some((near, far)) = p.depth_range {
            parts.push(format!("depth {near:.2} to {far:.2}, blue to red"));
        }
        if layout.mode == ViewMode::Difference {
            parts.push(match (&self.photo, p.psnr) {
                (None, _) => "choose a photo to see the difference ( [ or ] )".into(),
                (Some(_), _) => "difference \u{d7} 4".into(),
            });
        }
        let trained = state.training_job.is_some() || state.scene.as_ref().is_some_and(|s| s.trained);
        if !trained {
            parts.push("sparse points, not trained yet".into());
        }
        Some(parts.join("  ·  "))
    }
}
