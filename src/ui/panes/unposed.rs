//! Dialog on photos without camera poses: runs COLMAP if it is installed, else shows its commands to copy.

use egui::{Button, Label, RichText, ScrollArea, vec2};

use super::super::ctx::Ctx;
use super::super::theme;
use crate::io::unposed::Unposed;
use crate::jobs::poses::{self, PoseTools};
use crate::math::format;
use crate::scene::text;
use crate::ui::actions::Action;

/// Draws the dialog; returns true if it stays open.
pub(crate) fn show(ctx: &egui::Context, photos: &Unposed, cx: &mut Ctx<'_>) -> bool {
    let response = theme::dialog("unposed").show(ctx, |ui| {
        ui.set_width(620.0_f32.min(ui.ctx().content_rect().width() - 80.0));
        ui.heading(format!("{}, no camera poses", format::things(photos.photos.len(), "photo")));
        ui.weak(text::path(&photos.images));
        if !photos.beside.is_empty() {
            ui.label(text::lines(&photos.beside));
        }
        ui.add_space(6.0);
        ui.label("Training needs the camera pose of every photo. COLMAP estimates poses from the photos alone.");
        ui.add_space(10.0);
        let mut stays = true;
        let tools = PoseTools::installed();
        if let Some(tools) = &tools {
            let find = theme::primary_button(&format!("Find the poses with {}", tools.name()));
            if ui.add(find.min_size(vec2(240.0, 32.0))).clicked() {
                cx.ask(Action::FindPoses(Box::new(photos.clone())));
                stays = false;
            }
            ui.weak("Takes minutes per hundred photos; can be canceled and resumed. The photos are not changed.");
        }
        let commands = poses::commands(photos);
        let list = |ui: &mut egui::Ui| {
            ScrollArea::vertical().max_height(260.0).show(ui, |ui| {
                for (line, n) in commands.iter().zip(1..) {
                    ui.horizontal_top(|ui| {
                        let copy = ui.add(Button::new("Copy").small()).on_hover_text("Copy this command");
                        if copy.accessible_name(format!("Copy command {n}")).clicked() {
                            ui.ctx().copy_text(line.clone());
                        }
                        ui.add(Label::new(RichText::new(line).monospace()).wrap());
                    });
                }
            });
            if ui.button("Copy all").clicked() {
                ui.ctx().copy_text(commands.join("\n"));
            }
        };
        ui.add_space(6.0);
        if tools.is_some() {
            ui.collapsing("Manually", list);
        } else {
            ui.label("COLMAP is not installed (no 'colmap' on the PATH). Install it from colmap.github.io, then run:");
            list(ui);
        }
        ui.add_space(10.0);
        stays & !ui.button("Close").clicked()
    });
    response.inner && !response.should_close()
}
