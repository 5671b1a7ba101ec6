//! Card of the photo whose camera the view looks through: its name, how well it fits, and what can be done with it.

use egui::{RichText, Ui};

use super::photo::PhotoView;
use crate::scene::text;
use crate::ui::actions::Action;
use crate::ui::ctx::Ctx;
use crate::ui::state::PlacedPhoto;
use crate::ui::{keys, theme};

/// Letters of a photo's name; of a located one, which has more beside it.
const LETTERS: [usize; 2] = [28, 14];

/// Text of the button that adds a located photo.
const ADD: &str = "Add to scene";

/// Draws the card's content. `psnr` is that of the frame against the photo.
pub(super) fn show(ui: &mut Ui, photo: Option<&PhotoView>, psnr: Option<f64>, cx: &mut Ctx<'_>) {
    let state = cx.state;
    let placed = photo.and_then(|photo| state.placed(photo.index()));
    step(ui, "\u{2039}", Action::PreviousPhoto, cx);
    match photo {
        Some(photo) => {
            let name = text::elided(&photo.name(), LETTERS[usize::from(placed.is_some())]);
            ui.label(RichText::new(name).strong()).on_hover_text(&*photo.name());
            match placed {
                Some(placed) => found(ui, placed, cx),
                None => {
                    ui.weak(format!("{} of {}", photo.index() + 1, state.photo_count()));
                    if let Some(psnr) = psnr {
                        ui.label(RichText::new(psnr_text(psnr)).color(theme::accent()))
                            .on_hover_text("At the size of the view. Evaluation uses the size of training.");
                    }
                }
            }
            if photo.failed() {
                ui.colored_label(theme::warning(), "photo not loaded");
            }
        }
        None => {
            ui.weak("Free view");
        }
    }
    step(ui, "\u{203a}", Action::NextPhoto, cx);
    // Half a view is too narrow for the slider's button, and shows the photo otherwise.
    if photo.is_some() && (!cx.layout.split_view || cx.layout.compare) {
        ui.separator();
        let tip = format!("{}  {}", Action::ToggleCompare.tooltip(), keys::label(ui.ctx(), &Action::ToggleCompare));
        if ui.selectable_label(cx.layout.compare, "Compare").on_hover_text(tip).clicked() {
            cx.ask(Action::ToggleCompare);
        }
    }
    if let Some(placed) = placed {
        offer_to_add(ui, placed, cx);
        for (symbol, action) in [("Save pose\u{2026}", Action::SavePose), ("\u{d7}", Action::ForgetPhoto)] {
            let tip = format!("{}: {}", action.text(), action.tooltip());
            if ui.button(symbol).on_hover_text(tip).accessible_name(action.text()).clicked() {
                cx.ask(action);
            }
        }
    }
}

/// Draws the button that adds the photo to the scene; of several located ones, one or all.
fn offer_to_add(ui: &mut Ui, placed: &PlacedPhoto, cx: &mut Ctx<'_>) {
    let (this, all) = (vec![placed.photo.path.clone()], cx.state.located.files());
    let why = cx.state.why_no_added_photos();
    let several = format!("All {} located photos", all.len());
    let added = ui.add_enabled_ui(why.is_none(), |ui| {
        if all.len() == 1 {
            return ui.button(ADD).clicked().then_some(all);
        }
        let chosen = ui.menu_button(ADD, |ui| {
            let this = ui.button("This photo").clicked().then_some(this);
            this.or_else(|| ui.button(several).clicked().then_some(all))
        });
        chosen.inner.flatten()
    });
    let tip = Action::AddPhotos(Vec::new()).tooltip();
    added.response.on_hover_text(tip).on_disabled_hover_text(why.unwrap_or_default());
    added.inner.into_iter().for_each(|photos| cx.ask(Action::AddPhotos(photos)));
}

/// Draws a button to another photo.
fn step(ui: &mut Ui, symbol: &str, action: Action, cx: &mut Ctx<'_>) {
    let tip = format!("{}  {}", action.text(), keys::label(ui.ctx(), &action));
    if ui.button(symbol).on_hover_text(tip).accessible_name(action.text()).clicked() {
        cx.ask(action);
    }
}

/// Draws how well a located photo fits the scene.
fn found(ui: &mut Ui, placed: &PlacedPhoto, cx: &Ctx<'_>) {
    let Some(place) = &placed.found.place else { return };
    let meters = cx.state.scene.as_ref().and_then(|scene| scene.meters_per_unit());
    let share = format!("located, {}", place.share_text());
    let tip = "Share of what has structure in the photo that looks the same in the scene. Show the difference (6) to see \
               where something has changed.";
    ui.label(RichText::new(share).color(theme::good())).on_hover_text(tip);
    if let Some(sure) = place.deviation_text(meters) {
        let center = place.camera.center;
        let tip = format!(
            "Standard deviations of place and direction. The camera is at ({:.4}, {:.4}, {:.4}), its focal length {:.0} px.",
            center.x, center.y, center.z, place.camera.focal_px.x
        );
        ui.label(RichText::new(sure).color(theme::weak())).on_hover_text(tip);
    }
}

/// PSNR of a picture at the size of the view.
pub(super) fn psnr_text(psnr: f64) -> String {
    format!("PSNR {psnr:.1} dB (view size)")
}
