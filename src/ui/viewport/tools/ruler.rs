//! Measuring in the view: clicks put points on surfaces. Two give a distance, from which the scene's scale can be set;
//! three give a plane, which can be made the floor.

use egui::{Align2, Area, Color32, FontId, Id, Order, Pos2, Rect, Response, RichText, Stroke, TextEdit, Ui, vec2};
use glam::{DVec2, DVec3};

use super::super::split::ViewArea;
use super::{CardPlaces, ToolScene, ViewTool};
use crate::math::format;
use crate::ui::actions::Action;
use crate::ui::ctx::Ctx;
use crate::ui::theme;

/// Largest number of points; the next click begins anew.
const MOST: usize = 3;

/// The points, and the text typed beside them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ruler {
    points: Vec<DVec3>,
    /// The true length of the distance, as typed.
    known: String,
}

impl Ruler {
    fn put(&mut self, point: DVec3) {
        if self.points.len() == MOST {
            self.points.clear();
        }
        self.points.push(point);
    }

    /// The last distance, scene units.
    fn distance(&self) -> Option<f64> {
        let [.., a, b] = self.points.as_slice() else { return None };
        Some(a.distance(*b)).filter(|d| *d > 0.0)
    }

    /// Normal of the plane of three points, toward `eye`.
    fn normal(&self, eye: DVec3) -> Option<DVec3> {
        let [a, b, c] = self.points.as_slice() else { return None };
        let normal = (*b - *a).cross(*c - *a).try_normalize()?;
        Some(if normal.dot(eye - *a) < 0.0 { -normal } else { normal })
    }

    /// Meters per unit, if the typed text is a length.
    fn scale(&self) -> Option<f64> {
        let meters: f64 = self.known.trim().replace(',', ".").parse().ok()?;
        Some(meters / self.distance()?).filter(|s| s.is_finite() && *s > 0.0)
    }
}

impl ViewTool for Ruler {
    fn takes_clicks(&self) -> bool {
        true
    }

    /// Puts a point on the surface under a click.
    fn pointer(&mut self, response: &Response, area: ViewArea, scene: &mut ToolScene<'_>, _cx: &mut Ctx<'_>) {
        let surface = |pos: Pos2| {
            let at = (pos - area.shown.min) / area.shown.size();
            scene.display.picked(DVec2::new(f64::from(at.x), f64::from(at.y)), scene.eye)
        };
        let clicked = response.interact_pointer_pos().filter(|pos| response.clicked() && area.shown.contains(*pos));
        if let Some(point) = clicked.and_then(surface) {
            self.put(point);
        }
    }

    /// Draws the points and the lines between them.
    fn paint(&mut self, ui: &Ui, area: ViewArea, scene: &mut ToolScene<'_>, cx: &mut Ctx<'_>) {
        let shown = area.shown;
        let meters_per_unit = meters_per_unit(cx);
        let eye = scene.camera(shown);
        let painter = ui.painter_at(shown);
        let place = |p: DVec3| eye.project(p).map(|q| shown.min + vec2(q.x as f32, q.y as f32));
        let places: Vec<Option<Pos2>> = self.points.iter().map(|p| place(*p)).collect();
        for (i, pair) in places.windows(2).enumerate() {
            let [Some(a), Some(b)] = pair else { continue };
            for stroke in [Stroke::new(4.5, Color32::from_black_alpha(150)), Stroke::new(2.0, theme::warning())] {
                painter.line_segment([*a, *b], stroke);
            }
            let length = format::length(self.points[i].distance(self.points[i + 1]), meters_per_unit);
            let galley = painter.layout_no_wrap(length, FontId::proportional(14.0), theme::text());
            let at = a.lerp(*b, 0.5) + vec2(10.0, -0.5 * galley.size().y);
            painter.rect_filled(
                Rect::from_min_size(at, galley.size()).expand(5.0),
                5.0,
                Color32::from_black_alpha(205),
            );
            painter.galley(at, galley, theme::text());
        }
        for at in places.iter().flatten() {
            painter.circle(*at, 5.0, theme::warning(), Stroke::new(1.5, Color32::from_black_alpha(200)));
        }
    }

    /// Draws instructions and measurements.
    fn card(&mut self, ui: &Ui, places: CardPlaces, scene: &mut ToolScene<'_>, cx: &mut Ctx<'_>) {
        let meters_per_unit = meters_per_unit(cx);
        let at = Align2::CENTER_BOTTOM.pos_in_rect(&places.active_view.shrink(12.0));
        let area = Area::new(Id::unique("ruler")).order(Order::Middle).pivot(Align2::CENTER_BOTTOM).fixed_pos(at);
        theme::card(ui.ctx(), area.constrain_to(places.active_view), |ui| {
            ui.horizontal(|ui| {
                let next = match self.points.len() {
                    0 => "Click the first point on a surface".to_owned(),
                    1 => "Click the second point".to_owned(),
                    _ => self.distance().map_or_else(
                        || "The points coincide: click again".to_owned(),
                        |d| match meters_per_unit {
                            Some(_) => format!("{}, {}", format::length(d, meters_per_unit), format::length(d, None)),
                            None => format!("{} (scale unknown)", format::length(d, None)),
                        },
                    ),
                };
                ui.label(RichText::new(next).strong());
                if ui.button("Clear").clicked() {
                    self.points.clear();
                }
                if ui.button("Close").on_hover_text(Action::Measure.tooltip()).clicked() {
                    cx.ask(Action::Measure);
                }
            });
            if self.distance().is_some() {
                ui.horizontal(|ui| {
                    ui.label("True length");
                    ui.add(TextEdit::singleline(&mut self.known).hint_text("0.30").desired_width(60.0)).widget_info(
                        || egui::WidgetInfo::labeled(egui::Role::TextInput, true, "True length in meters"),
                    );
                    ui.label("m");
                    let scale = self.scale();
                    let set = ui.add_enabled(scale.is_some(), egui::Button::new("Set scale"));
                    if let Some(scale) = scale.filter(|_| set.clicked()) {
                        cx.ask(Action::SetScale(scale));
                    }
                });
            }
            match self.normal(scene.eye.center) {
                Some(normal) if ui.button("Use these three points as the floor").clicked() => {
                    cx.ask(Action::SetUp(normal));
                }
                None if self.points.len() == 2 => {
                    ui.weak("Click a third point to define the floor.");
                }
                _ => {}
            }
        });
    }
}

fn meters_per_unit(cx: &Ctx<'_>) -> Option<f64> {
    cx.state.scene.as_ref().and_then(|scene| scene.meters_per_unit())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_points_are_a_distance_and_three_a_floor() {
        let mut ruler = Ruler::default();
        assert_eq!((ruler.distance(), ruler.scale(), ruler.normal(DVec3::ZERO)), (None, None, None));
        ruler.put(DVec3::new(1.0, 0.0, 0.0));
        ruler.put(DVec3::new(1.0, 2.0, 0.0));
        assert_eq!((ruler.distance(), ruler.scale()), (Some(2.0), None), "nothing was typed");
        for (typed, scale) in
            [("0.5", Some(0.25)), (" 1,0 ", Some(0.5)), ("0", None), ("-1", None), ("x", None), ("inf", None)]
        {
            ruler.known = typed.into();
            assert_eq!(ruler.scale(), scale, "{typed}");
        }
        ruler.put(DVec3::new(3.0, 1.0, 0.0));
        assert_eq!(ruler.normal(DVec3::new(0.0, 0.0, -5.0)), Some(DVec3::NEG_Z), "toward the eye");
        assert_eq!(ruler.normal(DVec3::new(0.0, 0.0, 5.0)), Some(DVec3::Z));
        ruler.put(DVec3::ZERO);
        assert_eq!((ruler.points.len(), ruler.distance()), (1, None), "the fourth begins anew");
        ruler.put(DVec3::ZERO);
        assert_eq!((ruler.distance(), ruler.scale()), (None, None), "twice the same point");
        ruler.put(DVec3::ZERO);
        assert_eq!(ruler.normal(DVec3::Z), None, "no plane");
    }
}
