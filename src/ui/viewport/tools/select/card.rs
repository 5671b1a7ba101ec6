//! The card of the selection: shape, changes, and what becomes of it.

use egui::{Button, ComboBox, Key, Label, ProgressBar, Rect, RichText, Slider, TextEdit, Ui, vec2};
use strum::VariantArray;

use super::super::ToolScene;
use super::super::card::ToolCard;
use super::SelectTool;
use super::tip::{RADII_PT, WIDTHS_PX};
use super::told::ToldEffect;
use crate::jobs::select::{SelectFor, SelectStep};
use crate::math::format;
use crate::scene::{Identities, Level, NO_IDENTITY};
use crate::ui::actions::Action;
use crate::ui::ctx::Ctx;
use crate::ui::labels::sentence;
use crate::ui::select_shape::SelectShape;
use crate::ui::{keys, theme};

/// Draws the card in a corner of the view in `rect`.
pub(super) fn show(tool: &mut SelectTool, ui: &Ui, rect: Rect, scene: &ToolScene<'_>, cx: &mut Ctx<'_>) {
    let (none, state) = (Identities::default(), cx.state);
    let all = state.semantics.as_ref().map_or(&none, |map| &map.identities);
    let what = match tool.purpose {
        SelectFor::New(NO_IDENTITY) => "New object".to_owned(),
        SelectFor::New(of) => format!("New part of {}", all.full_name(of)),
        SelectFor::Extent(id) => format!("Correct {}", all.full_name(id)),
    };
    let title = format!("{what}: {}", tool.shape.hint());
    ToolCard::in_corner("selecting", title, rect).folding(400.0, 400.0).show(ui, |ui, is_folded| {
        ui.spacing_mut().item_spacing.y = 5.0;
        if !is_folded {
            let text = "Shift removes. Backspace undoes. Right-drag and wheel move the view.";
            ui.label(RichText::new(text).small().color(theme::weak()));
        }
        ui.horizontal_wrapped(|ui| {
            (ui.spacing_mut().item_spacing.x, ui.spacing_mut().button_padding) = (1.0, vec2(5.0, 2.0));
            for shape in SelectShape::VARIANTS {
                let button = ui.selectable_label(tool.shape == *shape, sentence(<&str>::from(shape)));
                if button.on_hover_text(sentence(shape.hint())).clicked() {
                    tool.shape = *shape;
                }
            }
        });
        if !is_folded {
            options(tool, ui);
            changes(tool, ui, scene);
        }
        if let SelectFor::New(of) = tool.purpose
            && !is_folded
        {
            ui.horizontal(|ui| {
                ui.label("Keep as");
                name_field(tool, ui, cx);
                let text =
                    if of == NO_IDENTITY { "an object".to_owned() } else { format!("part of {}", all.label(of)) };
                let whole = ComboBox::from_id_salt("whole").selected_text(text).width(120.0);
                let whole = whole.show_ui(ui, |ui| {
                    ui.selectable_value(&mut tool.purpose, SelectFor::New(NO_IDENTITY), "an object");
                    for (id, _) in all.iter().filter(|(_, i)| i.level == Level::Object) {
                        let text = format!("part of {}", all.label(id));
                        ui.selectable_value(&mut tool.purpose, SelectFor::New(id), text);
                    }
                });
                whole.response.accessible_name("What it becomes");
            });
        }
        ui.horizontal(|ui| {
            if is_folded && matches!(tool.purpose, SelectFor::New(_)) {
                name_field(tool, ui, cx);
            }
            status(tool, ui, scene, cx);
        });
        ui.horizontal(|ui| {
            if ui.add_enabled(!tool.is_empty(), theme::primary_button("Keep")).clicked() {
                cx.ask(Action::AddPainted);
            }
            if let SelectFor::New(of) = tool.purpose {
                let next = ui.add_enabled(!tool.is_empty(), Button::new("Keep and next"));
                if next.on_hover_text("Keep it, and select another one.").clicked() {
                    cx.ask(Action::AddPainted);
                    cx.ask(Action::SegmentNew(Some(of)));
                }
            }
            ui.add_enabled_ui(!tool.is_empty(), |ui| {
                let menu = ui.menu_button("More", |ui| {
                    for action in [Action::DeleteChosen, Action::ExportSelection] {
                        if ui.button(action.text()).on_hover_text(action.tooltip()).clicked() {
                            cx.ask(action);
                            ui.close();
                        }
                    }
                });
                menu.response.on_hover_text("Delete or export the selected Gaussians.");
            });
            if ui.button("Cancel").clicked() {
                cx.ask(Action::SegmentNew(None));
            }
        });
    });
    if !keys::is_typing(ui.ctx()) && ui.input(|i| i.key_pressed(Key::Backspace)) && tool.has_steps() {
        tool.take_back();
    }
}

/// Draws the options of the shape.
fn options(tool: &mut SelectTool, ui: &mut Ui) {
    ui.horizontal(|ui| {
        ui.selectable_value(&mut tool.takes_away, false, "+ add");
        ui.selectable_value(&mut tool.takes_away, true, "\u{2212} remove");
        let slider = match tool.shape {
            SelectShape::Click => {
                let width = Slider::new(&mut tool.tip.line_width_px, WIDTHS_PX).logarithmic(true).integer();
                Some(("Width", width.suffix(" px")))
            }
            SelectShape::Brush | SelectShape::Sphere => Some(("Radius", Slider::new(&mut tool.tip.brush_pt, RADII_PT))),
            SelectShape::Color => Some(("Tolerance", Slider::new(&mut tool.tolerance, 0.01..=0.6))),
            SelectShape::Object | SelectShape::Lasso | SelectShape::Rectangle => None,
        };
        if let Some((name, slider)) = slider {
            ui.label(name);
            let slider = ui.add(slider.show_value(tool.shape == SelectShape::Click)).accessible_name(name);
            let keys = [Action::NarrowLine, Action::WidenLine].map(|action| keys::label(ui.ctx(), &action));
            if tool.shape != SelectShape::Color {
                slider.on_hover_text(format!("Also by the keys {} and {}.", keys[0], keys[1]));
            }
        }
        if tool.shape.is_area() {
            ui.checkbox(&mut tool.through, "Through").on_hover_text("Take what lies behind the surface, too.");
        }
    });
}

/// Draws the changes of the whole selection.
fn changes(tool: &mut SelectTool, ui: &mut Ui, scene: &ToolScene<'_>) {
    ui.horizontal(|ui| {
        let button = |ui: &mut Ui, is_possible: bool, text: &str, tip: &str| {
            ui.add_enabled(is_possible, Button::new(text)).on_hover_text(tip).clicked()
        };
        let is_some = !tool.is_empty();
        let mut step = None;
        if button(ui, is_some, "Grow", "Take the neighbors of the selected Gaussians, too.") {
            step = Some(SelectStep::Grow);
        }
        if button(ui, is_some, "Shrink", "Leave out Gaussians with a neighbor that is not selected.") {
            step = Some(SelectStep::Shrink);
        }
        let crop = scene.visibility.crop();
        if button(ui, crop.is_some(), "In the box", "Take what the crop box keeps. B shows the box.")
            && let Some((cloud, crop)) = scene.cloud.zip(crop)
        {
            let inside = (0..cloud.len()).filter(|i| crop.keeps(cloud.world_position(*i)));
            step = Some(SelectStep::Add(inside.map(|i| i as u32).collect()));
        }
        tool.waiting.extend(step.map(|step| (step, false)));
        if button(ui, tool.has_steps(), "Undo", "Undo the last step (Backspace).") {
            tool.take_back();
        }
        let tip = "Show each selected Gaussian in magenta, faint ones, too.";
        ui.checkbox(&mut tool.marks, "Mark").on_hover_text(tip);
    });
}

/// Draws the state of the selection, and what it does to other things, in one row: nothing moves as they change.
fn status(tool: &SelectTool, ui: &mut Ui, scene: &ToolScene<'_>, cx: &Ctx<'_>) {
    count(tool, ui, scene, cx);
    let all = cx.state.semantics.as_ref().map(|map| &map.identities);
    let name = |id| all.map_or_else(String::new, |all| cx.state.labels.full_name(all, id));
    // What is cut is told on hover, once.
    let label = |text: String, color| Label::new(RichText::new(text).color(color)).truncate();
    if let Some(taken) = tool.taken_object() {
        ui.add(label(taken.text(&name(taken.from)), theme::warning()));
    } else if let Some(told) = tool.selected.as_ref().and_then(|s| ToldEffect::new(&s.effect, &name)) {
        let color = if told.is_warning { theme::warning() } else { theme::weak() };
        ui.add(label(told.line, color).show_tooltip_when_elided(false)).on_hover_text(told.all);
    }
}

/// Draws the field of the name.
fn name_field(tool: &mut SelectTool, ui: &mut Ui, cx: &mut Ctx<'_>) {
    let name = TextEdit::singleline(&mut tool.name).hint_text("Name").char_limit(80);
    let name = ui.add(name.desired_width(130.0)).accessible_name("Name of what is selected");
    if name.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter)) && !tool.is_empty() {
        cx.ask(Action::AddPainted);
    }
}

fn count(tool: &SelectTool, ui: &mut Ui, scene: &ToolScene<'_>, cx: &Ctx<'_>) {
    let text = match &tool.selected {
        _ if tool.running.is_some() => {
            ui.spinner();
            String::new()
        }
        _ if !tool.is_prepared && tool.shape == SelectShape::Click => {
            let text = "Preparing selection, once for this scene";
            let bar = ProgressBar::new(scene.preparation.share(cx.state).unwrap_or(0.0)).desired_width(60.0);
            ui.add(bar.desired_height(6.0)).on_hover_text(text);
            "Preparing\u{2026}".to_owned()
        }
        Some(s) if s.id != NO_IDENTITY => format::things(s.gaussians.len(), "Gaussian"),
        _ => "Nothing is selected".to_owned(),
    };
    ui.weak(text);
}
