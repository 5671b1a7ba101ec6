//! A label and its field, which a line break keeps together.

use egui::{Align, Id, Layout, RichText, TextStyle, TextWrapMode, Ui, WidgetText, vec2};

/// Draws a label and its field, which is about `field_pt` wide; if the row has no room for both, both go on in the next.
pub(super) fn paired<T>(ui: &mut Ui, label: RichText, field_pt: f32, field: impl FnOnce(&mut Ui, Id) -> T) -> T {
    let text = WidgetText::from(label);
    let galley = text.clone().into_galley(ui, Some(TextWrapMode::Extend), f32::INFINITY, TextStyle::Body);
    let width = galley.size().x + ui.spacing().item_spacing.x + field_pt;
    let size = vec2(width, ui.spacing().interact_size.y);
    let drawn = ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
        let label = ui.label(text).id;
        field(ui, label)
    });
    drawn.inner
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{Rect, Sense};

    /// Places of a label and its field behind something of this width, in a row of 200 points.
    fn places(before_pt: f32, apart: bool) -> [Rect; 2] {
        let mut places = [Rect::NOTHING; 2];
        let mut harness = egui_kittest::Harness::new_ui(|ui| {
            ui.set_max_width(200.0);
            ui.horizontal_wrapped(|ui| {
                ui.allocate_exact_size(vec2(before_pt, 10.0), Sense::hover());
                let field = |ui: &mut Ui| ui.allocate_exact_size(vec2(50.0, 10.0), Sense::hover()).0;
                places = if apart {
                    [ui.label("True length").rect, field(ui)]
                } else {
                    paired(ui, RichText::new("True length"), 50.0, |ui, label| {
                        let label = ui.ctx().read_response(label).map_or(Rect::NOTHING, |label| label.rect);
                        [label, field(ui)]
                    })
                };
            });
        });
        harness.run_steps(2);
        drop(harness);
        places
    }

    #[test]
    fn a_line_break_takes_the_label_along() {
        let in_one_row = |[label, field]: [Rect; 2]| field.center().y < label.bottom() && field.left() > label.right();
        for before_pt in [10.0, 80.0, 100.0, 150.0] {
            assert!(in_one_row(places(before_pt, false)), "{before_pt}: {:?}", places(before_pt, false));
        }
        assert!(!in_one_row(places(80.0, true)), "the control: {:?}", places(80.0, true));
    }
}
