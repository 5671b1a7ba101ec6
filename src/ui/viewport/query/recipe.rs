//! The recipe of a view's queries: this program's method, the paper's, or a mix of both.

use egui::containers::menu::{MenuButton, MenuConfig};
use egui::{PopupCloseBehavior, TextEdit, Ui};
use strum::VariantArray;

use crate::pipeline::semantics::query::recipe::{
    CanonicalPhrases, MatchBy, PartEmbedding, QueryConfig, RecipeName, Rejection, RelevancyScale, Strategy,
};
use crate::scene::{Lifting, MaskGrid, MaskPrompt};

/// Draws the rows of the recipe in a grid of two columns.
pub(super) fn show(ui: &mut Ui, recipe: &mut QueryConfig) {
    ui.weak("Recipe");
    ui.horizontal(|ui| {
        let name = recipe.name();
        for (other, text, hint) in [
            (RecipeName::Default, "default", "Names first; embeddings where no name fits"),
            (RecipeName::Paper, "paper", "All of the paper's choices: by embedding, in two steps, never 'not found'"),
        ] {
            let label = ui.selectable_label(name == Some(other), text).on_hover_text(hint);
            if label.clicked() {
                *recipe = other.recipe();
            }
        }
        // By default a menu closes at the first click into it; here it stays for several choices.
        let stays = MenuConfig::new().close_behavior(PopupCloseBehavior::CloseOnClickOutside);
        let menu = MenuButton::new("Choices\u{2026}").config(stays);
        let (button, _) = menu.ui(ui, |ui| choices(ui, recipe));
        button.on_hover_text(recipe.to_string());
        // Last, so that the menu keeps its id, and stays open, if this appears.
        if name.is_none() {
            ui.weak("own");
        }
    });
    ui.end_row();
}

fn choices(ui: &mut Ui, recipe: &mut QueryConfig) {
    egui::Grid::new("recipe").num_columns(2).show(ui, |ui| {
        one_of(ui, "By", MatchBy::VARIANTS, &mut recipe.match_by);
        one_of(ui, "Parts of wholes", Strategy::VARIANTS, &mut recipe.strategy);
        one_of(ui, "Deviation", PartEmbedding::VARIANTS, &mut recipe.parts);
        one_of(ui, "Relevancy", RelevancyScale::VARIANTS, &mut recipe.scale);
        one_of(ui, "Not found", Rejection::VARIANTS, &mut recipe.rejection);
        ui.weak("Temperature");
        ui.add(egui::DragValue::new(&mut recipe.temperature).range(0.1..=100.0).speed(0.1))
            .accessible_name("Temperature");
        ui.end_row();
        canonical(ui, &mut recipe.canonical);
        ui.weak("When objects are found");
        ui.weak("(for the next search)");
        ui.end_row();
        let prepared = &mut recipe.preparation;
        one_of(ui, "Codes", Lifting::VARIANTS, &mut prepared.lifting);
        ui.weak("Part weight w");
        ui.add(egui::DragValue::new(&mut prepared.part_weight).range(0.0..=1.0).speed(0.01))
            .accessible_name("Part weight w")
            .on_hover_text("Share of its own embedding that a part keeps in semantic deviation");
        ui.end_row();
        let mut grid = prepared.grid.unwrap_or_default();
        one_of(ui, "Mask grid", MaskGrid::VARIANTS, &mut grid);
        prepared.grid = (grid != MaskGrid::default()).then_some(grid);
        ui.weak("Masks carried by");
        ui.horizontal(|ui| {
            for (prompt, text) in [
                (None, "Gaussians"),
                (Some(MaskPrompt::Mask), "SAM 2, by mask"),
                (Some(MaskPrompt::Points), "by points"),
            ] {
                ui.selectable_value(&mut prepared.prompt, prompt, text);
            }
        });
        ui.end_row();
    });
}

/// Draws the canonical phrases, applied when the field loses the focus.
fn canonical(ui: &mut Ui, phrases: &mut CanonicalPhrases) {
    ui.weak("Canonical phrases");
    let id = ui.scope_id().with("canonical phrases");
    let mut typed = ui.data_mut(|d| d.get_temp::<String>(id)).unwrap_or_else(|| phrases.to_string());
    let field = ui.add(TextEdit::singleline(&mut typed).desired_width(180.0)).accessible_name("Canonical phrases");
    let field = field.on_hover_text("With commas between; 'paper' and 'lerf' are lists of their own");
    if let (true, Ok(new)) = (field.lost_focus(), typed.parse()) {
        *phrases = new;
    }
    if field.has_focus() {
        ui.data_mut(|d| d.insert_temp(id, typed));
    } else {
        ui.data_mut(|d| d.remove::<String>(id));
    }
    ui.end_row();
}

fn one_of<T: Copy + PartialEq + ToString>(ui: &mut Ui, what: &str, all: &[T], chosen: &mut T) {
    ui.weak(what);
    // No drop-down list: a click into it would close the menu.
    ui.horizontal(|ui| {
        for value in all {
            ui.selectable_value(chosen, *value, value.to_string());
        }
    });
    ui.end_row();
}
