//! Dialog on photos or a video without camera poses: finds them by a maker that is here, gets one if the user agrees, or
//! shows commands to copy.

use egui::{Button, Label, RichText, ScrollArea, vec2};

use super::super::ctx::Ctx;
use super::super::theme;
use crate::jobs::poses::front_door::{PoseQuestion, PoseRequest};
use crate::jobs::poses::{MakerKind, environment, manual};
use crate::math::format;
use crate::scene::text;
use crate::ui::actions::Action;

/// Draws the dialog; returns true if it stays open.
pub(crate) fn show(ctx: &egui::Context, question: &PoseQuestion, cx: &mut Ctx<'_>) -> bool {
    let photos = &question.photos;
    let response = theme::dialog("unposed").show(ctx, |ui| {
        ui.set_width(620.0_f32.min(ui.ctx().content_rect().width() - 80.0));
        match &photos.video {
            Some(_) => ui.heading("A video, no camera poses"),
            None => ui.heading(format!("{}, no camera poses", format::things(photos.photos.len(), "photo"))),
        };
        ui.weak(text::path(&photos.images));
        if !photos.beside.is_empty() {
            ui.label(text::lines(&photos.beside));
        }
        ui.add_space(6.0);
        ui.label("Training needs the camera pose of every photo. It is estimated from the photos alone.");
        if photos.video.is_some() {
            ui.label("The sharpest frames become photos, in a folder beside the video.");
        }
        ui.add_space(10.0);
        let mut asked = None;
        for (i, (kind, name)) in question.makers.iter().enumerate() {
            let title = format!("Find the poses with {}", text::line(name));
            let button = if i == 0 { theme::primary_button(&title) } else { Button::new(title) };
            if ui.add(button.min_size(vec2(240.0, 32.0))).clicked() {
                asked = Some((*kind, false));
            }
        }
        let has_colmap = question.makers.iter().any(|(kind, _)| *kind != MakerKind::BuiltIn);
        if let Some(into) = question.installs_into.as_ref().filter(|_| !has_colmap) {
            let title = "Get pycolmap and find the poses";
            let button = if question.makers.is_empty() { theme::primary_button(title) } else { Button::new(title) };
            if ui.add(button.min_size(vec2(240.0, 32.0))).clicked() {
                asked = Some((MakerKind::Pycolmap, true));
            }
            ui.weak(format!("This {}, into {}.", environment::TERMS, text::path(into)));
        }
        let can_find = asked.is_some() || !question.makers.is_empty() || question.installs_into.is_some();
        if can_find {
            ui.weak("Takes minutes per hundred photos; can be canceled and resumed. The photos are not changed.");
        }
        if let Some((maker, install)) = asked {
            let request = PoseRequest { photos: photos.clone(), maker: Some(maker), install, ..PoseRequest::default() };
            cx.ask(Action::FindPoses(Box::new(request)));
        }
        ui.add_space(6.0);
        if photos.video.is_none() {
            by_hand(ui, question, can_find);
        } else if !can_find {
            ui.label("Nothing here finds poses. Install COLMAP from colmap.github.io, and open the video again.");
        }
        ui.add_space(10.0);
        asked.is_none() & !ui.button("Close").clicked()
    });
    response.inner && !response.should_close()
}

/// Lists COLMAP's commands.
fn by_hand(ui: &mut egui::Ui, question: &PoseQuestion, can_find: bool) {
    let commands = manual::commands(&question.photos);
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
    if can_find {
        ui.collapsing("Manually", list);
    } else {
        ui.label("COLMAP is not installed (no 'colmap' on the PATH). Install it from colmap.github.io, then run:");
        list(ui);
    }
}
